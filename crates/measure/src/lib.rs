//! Measuring pictures. A metric is named for exactly what it computes.

mod image_file;
mod metric;

pub use image_file::{read_exr, write_exr};
pub use metric::{Mask, Statistics, compare, mean, relative_mse, rmse};

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
    /// A file.
    #[error("{file}: {reason}")]
    File {
        /// Path.
        file: String,
        /// What went wrong.
        reason: String,
    },
}
