//! Measuring pictures. A metric is named for exactly what it computes.
//!
//! [`compare`] gives every metric of a reference and a test image at once, where a [`Mask`] counts; [`relative_mse`], [`relative_mse_with_epsilon`]
//! and [`rmse`] give one over all pixels. [`measure`] gives everything that a report shows: those, and MAE, PSNR, SSIM, FLIP and fireflies.
//! [`measure_replicates`] gives them with what samples, seeds and the noise of the reference do to them, from which [`sampled`] makes intervals and ties. [`bias_variance`] and
//! [`temporal_error`] take several pictures of one setting. All sums are 64-bit floats. [`read_exr`], [`write_exr`] and [`write_png`] move pictures in and out.

pub mod flip;
mod image_file;
mod mask;
mod metric;
mod metrics;
mod replicates;
pub mod sampled;
mod sequence;
mod ssim;
pub mod timing;

pub use flip::{flip_hdr, flip_ldr};
pub use image_file::{Precision, WriteSeek, read_exr, read_picture, replace_file, write_exr, write_exr_with, write_png};
pub use mask::Mask;
pub use metric::{Statistics, compare, mean, relative_mse, relative_mse_with_epsilon, rmse};
pub use metrics::{Metrics, display, false_colour, measure, measure_each, relative_error_map};
pub use replicates::{Pictures, measure_replicates, noise_floor, replicate};
pub use sequence::{BiasVariance, bias_variance, temporal_error, temporal_errors};
pub use ssim::ssim;

/// Linear RGB, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Row by row.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Means of k x k blocks; sides must be multiples of k.
    pub fn downsampled(&self, k: usize) -> Result<Image, MeasureError> {
        self.check_size()?;
        if k == 0 || !self.width.is_multiple_of(k) || !self.height.is_multiple_of(k) {
            return Err(MeasureError::Size(format!("{} x {} pixels cannot be divided into blocks of {k}", self.width, self.height)));
        }
        let (width, height) = (self.width / k, self.height / k);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut total = [0.0f64; 3];
                for row in 0..k {
                    for pixel in &self.pixels[(y * k + row) * self.width + x * k..][..k] {
                        for channel in 0..3 {
                            total[channel] += f64::from(pixel[channel]);
                        }
                    }
                }
                pixels.push(total.map(|value| (value / (k * k) as f64) as f32));
            }
        }
        Ok(Image { width, height, pixels })
    }

    /// The fields are public, so nothing else holds them together.
    fn check_size(&self) -> Result<(), MeasureError> {
        if self.pixels.is_empty() || self.width.checked_mul(self.height) != Some(self.pixels.len()) {
            return Err(MeasureError::Size(format!("{} pixels are no picture of {} x {}", self.pixels.len(), self.width, self.height)));
        }
        Ok(())
    }
}

/// A picture could not be read, written or compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeasureError {
    /// Sizes do not go together.
    #[error("{0}")]
    Size(String),
    /// A pixel is NaN or infinite, so that no metric means anything.
    #[error("pixel ({x}, {y}) of the {which} is not finite")]
    NotFinite {
        /// `reference` or `test image`.
        which: &'static str,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
    /// Nothing is left to compare.
    #[error("the mask leaves no pixel to compare")]
    EmptyMask,
    /// A floor below 0 or without a finite value.
    #[error("epsilon is {0}; it must be finite and not below 0")]
    Epsilon(f64),
    /// A viewing distance that no display has.
    #[error("{0} pixels per degree; it must lie in [1, 2000]")]
    PixelsPerDegree(f64),
    /// A sequence too short, or of unequal lengths.
    #[error("{0}")]
    Sequence(String),
    /// A file.
    #[error("{file}: {reason}")]
    File {
        /// Path.
        file: String,
        /// What went wrong.
        reason: String,
    },
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_averaged() {
        let picture = Image { width: 2, height: 2, pixels: vec![[0.0; 3], [1.0; 3], [2.0; 3], [5.0; 3]] };
        assert_eq!(picture.downsampled(2).unwrap().pixels, [[2.0; 3]]);
        assert_eq!(picture.downsampled(1).unwrap(), picture);
        let wide = Image { width: 4, height: 2, pixels: (0..8).map(|index| [index as f32, 0.0, 1.0]).collect() };
        assert_eq!(wide.downsampled(2).unwrap().pixels, [[2.5, 0.0, 1.0], [4.5, 0.0, 1.0]]);
    }

    #[test]
    fn what_has_no_blocks_is_refused() {
        let picture = Image { width: 2, height: 2, pixels: vec![[0.0; 3]; 4] };
        assert!(picture.downsampled(3).is_err());
        assert!(picture.downsampled(0).is_err());
        assert!(Image { width: 4, ..picture }.downsampled(2).is_err());
    }
}
