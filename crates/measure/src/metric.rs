//! Differences between a reference and a test image.

use crate::{Image, MeasureError};

/// Which pixels count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Row by row; `true` counts.
    pub counts: Vec<bool>,
}

impl Mask {
    /// Everything.
    pub fn all(image: &Image) -> Self {
        Self { counts: vec![true; image.pixels.len()] }
    }

    /// Takes away every pixel within `radius` of one that does not count.
    pub fn eroded(&self, width: usize, radius: usize) -> Self {
        let height = self.counts.len() / width.max(1);
        let near = |x: usize, y: usize| {
            (y.saturating_sub(radius)..=(y + radius).min(height - 1))
                .all(|row| self.counts[row * width..][x.saturating_sub(radius)..=(x + radius).min(width - 1)].iter().all(|counts| *counts))
        };
        let counts = (0..self.counts.len()).map(|index| near(index % width, index / width)).collect();
        Self { counts }
    }

    /// Share of pixels that count.
    pub fn share(&self) -> f64 {
        self.counts.iter().filter(|counts| **counts).count() as f64 / self.counts.len().max(1) as f64
    }
}

/// What [`compare`] finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// `mean of (test - reference)^2 / (reference^2 + (0.1 m)^2)` over pixels and channels, m the mean of the whole reference over pixels and channels.
    pub relative_mse: f64,
    /// Root of the mean squared difference over pixels and channels.
    pub rmse: f64,
    /// Mean of the test image over that of the reference, all channels.
    pub mean_ratio: f64,
}

fn check(image: &Image, which: &'static str) -> Result<(), MeasureError> {
    if image.pixels.len() != image.width * image.height || image.pixels.is_empty() {
        return Err(MeasureError::Size(format!("the {which} has {} pixels, not {} x {}", image.pixels.len(), image.width, image.height)));
    }
    match image.pixels.iter().position(|pixel| pixel.iter().any(|value| !value.is_finite())) {
        Some(place) => Err(MeasureError::NotFinite { which, x: place % image.width, y: place / image.width }),
        None => Ok(()),
    }
}

/// Mean of each channel.
pub fn mean(image: &Image) -> [f64; 3] {
    let mut total = [0.0; 3];
    for pixel in &image.pixels {
        for channel in 0..3 {
            total[channel] += f64::from(pixel[channel]);
        }
    }
    total.map(|value| value / image.pixels.len().max(1) as f64)
}

/// Compares two images where the mask counts. The mean in the relative MSE is that of the whole reference, masked or not.
pub fn compare(reference: &Image, test: &Image, mask: &Mask) -> Result<Statistics, MeasureError> {
    check(reference, "reference")?;
    check(test, "test image")?;
    if (reference.width, reference.height) != (test.width, test.height) || mask.counts.len() != reference.pixels.len() {
        return Err(MeasureError::Size(format!(
            "the reference has {} x {} pixels, the test image {} x {}, the mask {}",
            reference.width,
            reference.height,
            test.width,
            test.height,
            mask.counts.len()
        )));
    }
    let floor = (0.1 * mean(reference).iter().sum::<f64>() / 3.0).powi(2);
    let (mut count, mut squared, mut relative, mut sums) = (0.0, 0.0, 0.0, [0.0; 2]);
    let pairs = reference.pixels.iter().zip(&test.pixels).zip(&mask.counts).filter(|(_, counts)| **counts);
    for ((expected, found), _) in pairs {
        for channel in 0..3 {
            let (r, t) = (f64::from(expected[channel]), f64::from(found[channel]));
            let difference = (t - r).powi(2);
            squared += difference;
            // A black reference has no scale: equal pixels count 0, others infinitely.
            relative += if difference == 0.0 { 0.0 } else { difference / (r * r + floor) };
            (sums[0], sums[1]) = (sums[0] + r, sums[1] + t);
            count += 1.0;
        }
    }
    if count == 0.0 {
        return Err(MeasureError::EmptyMask);
    }
    Ok(Statistics { relative_mse: relative / count, rmse: (squared / count).sqrt(), mean_ratio: sums[1] / sums[0] })
}

/// [`Statistics::relative_mse`] over all pixels.
pub fn relative_mse(reference: &Image, test: &Image) -> Result<f64, MeasureError> {
    Ok(compare(reference, test, &Mask::all(reference))?.relative_mse)
}

/// [`Statistics::rmse`] over all pixels.
pub fn rmse(reference: &Image, test: &Image) -> Result<f64, MeasureError> {
    Ok(compare(reference, test, &Mask::all(reference))?.rmse)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn image(values: &[f32]) -> Image {
        Image { width: values.len(), height: 1, pixels: values.iter().map(|value| [*value; 3]).collect() }
    }

    #[test]
    fn values_by_hand() {
        let (reference, test) = (image(&[1.0, 3.0]), image(&[2.0, 3.0]));
        // Mean 2, floor 0.04: 1 / 1.04 / 2.
        assert!((relative_mse(&reference, &test).unwrap() - 0.5 / 1.04).abs() < 1e-12);
        assert!((rmse(&reference, &test).unwrap() - 0.5f64.sqrt()).abs() < 1e-12);
        let masked = compare(&reference, &test, &Mask { counts: vec![false, true] }).unwrap();
        assert_eq!((masked.relative_mse, masked.mean_ratio), (0.0, 1.0));
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let good = image(&[1.0, 2.0]);
        assert!(matches!(relative_mse(&good, &image(&[1.0])), Err(MeasureError::Size(_))));
        assert_eq!(relative_mse(&good, &image(&[1.0, f32::NAN])), Err(MeasureError::NotFinite { which: "test image", x: 1, y: 0 }));
        assert_eq!(relative_mse(&image(&[f32::INFINITY, 1.0]), &good), Err(MeasureError::NotFinite { which: "reference", x: 0, y: 0 }));
        assert_eq!(compare(&good, &good, &Mask { counts: vec![false; 2] }), Err(MeasureError::EmptyMask));
        assert!(compare(&good, &good, &Mask { counts: vec![true] }).is_err());
    }

    #[test]
    fn a_difference_is_seen() {
        let good = image(&[1.0, 2.0]);
        assert_eq!(relative_mse(&good, &good).unwrap(), 0.0);
        assert!(relative_mse(&good, &image(&[1.1, 2.0])).unwrap() > 1e-3);
        assert!(relative_mse(&image(&[0.0, 0.0]), &image(&[0.0, 1e-6])).unwrap().is_infinite());
    }

    #[test]
    fn eroding_takes_the_neighbourhood_too() {
        let mask = Mask { counts: vec![true, true, true, true, false] };
        assert_eq!(mask.eroded(5, 1).counts, [true, true, true, false, false]);
        assert_eq!(mask.eroded(5, 1).share(), 0.6);
    }

    #[test]
    fn blocks_are_averaged() {
        let picture = Image { width: 2, height: 2, pixels: vec![[0.0; 3], [1.0; 3], [2.0; 3], [5.0; 3]] };
        assert_eq!(picture.downsampled(2).unwrap().pixels, [[2.0; 3]]);
        assert!(picture.downsampled(3).is_err());
    }
}
