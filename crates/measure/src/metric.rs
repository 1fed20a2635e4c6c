//! Differences between a reference and a test image.

use crate::{Image, Mask, MeasureError};

/// What [`compare`] finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// `mean of (test - reference)^2 / (reference^2 + (0.1 m)^2)` over pixels and channels, m the mean of the whole reference over pixels and channels.
    /// Infinite where an all-black reference meets anything else.
    pub relative_mse: f64,
    /// Root of the mean squared difference over pixels and channels.
    pub rmse: f64,
    /// Mean of the test image over that of the reference, all channels; 1 where both are 0.
    pub mean_ratio: f64,
}

fn check(image: &Image, which: &'static str) -> Result<(), MeasureError> {
    image.check_size().map_err(|error| MeasureError::Size(format!("the {which}: {error}")))?;
    match image.pixels.iter().position(|pixel| pixel.iter().any(|value| !value.is_finite())) {
        Some(place) => Err(MeasureError::NotFinite { which, x: place % image.width, y: place / image.width }),
        None => Ok(()),
    }
}

/// Two finite pictures of one size.
pub(crate) fn check_pair(reference: &Image, test: &Image) -> Result<(), MeasureError> {
    check(reference, "reference")?;
    check(test, "test image")?;
    if (reference.width, reference.height) == (test.width, test.height) {
        return Ok(());
    }
    let what =
        format!("the reference has {} x {} pixels, the test image {} x {}", reference.width, reference.height, test.width, test.height);
    Err(MeasureError::Size(what))
}

/// Mean of each channel; 0 without pixels.
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
    let floor = (0.1 * mean(reference).iter().sum::<f64>() / 3.0).powi(2);
    compare_above(floor, reference, test, mask)
}

/// As [`compare`], with `epsilon` in the place of `(0.1 m)^2` in the relative MSE.
fn compare_above(epsilon: f64, reference: &Image, test: &Image, mask: &Mask) -> Result<Statistics, MeasureError> {
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
    let (mut count, mut squared, mut relative, mut sums) = (0.0, 0.0, 0.0, [0.0; 2]);
    let pairs = reference.pixels.iter().zip(&test.pixels).zip(&mask.counts).filter(|(_, counts)| **counts);
    for ((expected, found), _) in pairs {
        for channel in 0..3 {
            let (r, t) = (f64::from(expected[channel]), f64::from(found[channel]));
            let difference = (t - r).powi(2);
            squared += difference;
            // A black reference has no scale: equal pixels count 0, others infinitely.
            relative += if difference == 0.0 { 0.0 } else { difference / (r * r + epsilon) };
            (sums[0], sums[1]) = (sums[0] + r, sums[1] + t);
            count += 1.0;
        }
    }
    if count == 0.0 {
        return Err(MeasureError::EmptyMask);
    }
    let mean_ratio = if sums[0] == sums[1] { 1.0 } else { sums[1] / sums[0] };
    Ok(Statistics { relative_mse: relative / count, rmse: (squared / count).sqrt(), mean_ratio })
}

/// [`Statistics::relative_mse`] over all pixels.
pub fn relative_mse(reference: &Image, test: &Image) -> Result<f64, MeasureError> {
    Ok(compare(reference, test, &Mask::all(reference))?.relative_mse)
}

/// Relative MSE with a fixed floor: `mean of (test - reference)^2 / (reference^2 + epsilon)` over pixels and channels.
///
/// The form in which papers on denoising give it, after Rousselle, Knaus and Zwicker 2011, Adaptive Sampling and Reconstruction using Greedy Error
/// Minimization; 0.01 is a usual epsilon. Unlike [`relative_mse`] it changes when both images are scaled by one factor. `epsilon` is finite and >= 0,
/// else [`MeasureError::Epsilon`].
pub fn relative_mse_with_epsilon(reference: &Image, test: &Image, epsilon: f64) -> Result<f64, MeasureError> {
    if !(epsilon.is_finite() && epsilon >= 0.0) {
        return Err(MeasureError::Epsilon(epsilon));
    }
    Ok(compare_above(epsilon, reference, test, &Mask::all(reference))?.relative_mse)
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
        assert!((relative_mse_with_epsilon(&reference, &test, 0.25).unwrap() - 0.5 / 1.25).abs() < 1e-12);
        assert!((rmse(&reference, &test).unwrap() - 0.5f64.sqrt()).abs() < 1e-12);
        let masked = compare(&reference, &test, &Mask { counts: vec![false, true] }).unwrap();
        assert_eq!((masked.relative_mse, masked.mean_ratio), (0.0, 1.0));
        // Masked or not, the floor is that of the whole reference.
        let masked = compare(&reference, &test, &Mask { counts: vec![true, false] }).unwrap();
        assert!((masked.relative_mse - 1.0 / 1.04).abs() < 1e-12);
        assert_eq!(masked.mean_ratio, 2.0);
    }

    /// One mean for all channels, not one for each: with (1, 2, 6) for a reference it is 3, and the floor 0.09.
    #[test]
    fn channels_share_one_mean() {
        let pixel = |pixel| Image { width: 1, height: 1, pixels: vec![pixel] };
        let (reference, test) = (pixel([1.0, 2.0, 6.0]), pixel([2.0, 2.0, 6.0]));
        let found = relative_mse(&reference, &test).unwrap();
        assert!((found - 1.0 / 1.09 / 3.0).abs() < 1e-12, "{found}");
        assert!((found - 1.0 / 1.01 / 3.0).abs() > 1e-2, "that would be a mean for each channel");
    }

    #[test]
    fn scaling_both_images_changes_nothing() {
        let scaled = |factor: f32| relative_mse(&image(&[factor, 3.0 * factor]), &image(&[1.5 * factor, 3.0 * factor])).unwrap();
        assert!((scaled(1e-12) / scaled(1.0) - 1.0).abs() < 1e-6);
        assert!((scaled(1e12) / scaled(1.0) - 1.0).abs() < 1e-6);
        let fixed = |factor: f32| relative_mse_with_epsilon(&image(&[factor]), &image(&[2.0 * factor]), 0.01).unwrap();
        assert!(fixed(1e-3) < 0.01 * fixed(1.0), "a fixed floor does change it");
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let good = image(&[1.0, 2.0]);
        assert!(matches!(relative_mse(&good, &image(&[1.0])), Err(MeasureError::Size(_))));
        let broken = Image { width: 2, height: 2, ..good.clone() };
        assert!(matches!(relative_mse(&broken, &broken), Err(MeasureError::Size(_))));
        assert!(matches!(rmse(&image(&[]), &image(&[])), Err(MeasureError::Size(_))));
        assert_eq!(relative_mse(&good, &image(&[1.0, f32::NAN])), Err(MeasureError::NotFinite { which: "test image", x: 1, y: 0 }));
        assert_eq!(relative_mse(&image(&[f32::INFINITY, 1.0]), &good), Err(MeasureError::NotFinite { which: "reference", x: 0, y: 0 }));
        assert_eq!(compare(&good, &good, &Mask { counts: vec![false; 2] }), Err(MeasureError::EmptyMask));
        assert!(compare(&good, &good, &Mask { counts: vec![true] }).is_err());
        for epsilon in [-1.0, f64::INFINITY, f64::NAN] {
            assert!(matches!(relative_mse_with_epsilon(&good, &good, epsilon), Err(MeasureError::Epsilon(_))));
        }
    }

    #[test]
    fn a_difference_is_seen() {
        let good = image(&[1.0, 2.0]);
        assert_eq!(relative_mse(&good, &good).unwrap(), 0.0);
        assert!(relative_mse(&good, &image(&[1.1, 2.0])).unwrap() > 1e-3);
        assert!(rmse(&good, &image(&[1.1, 2.0])).unwrap() > 1e-2);
        let black = image(&[0.0, 0.0]);
        let all = Mask::all(&black);
        assert!(relative_mse(&black, &image(&[0.0, 1e-6])).unwrap().is_infinite());
        assert_eq!(compare(&black, &black, &all).unwrap(), Statistics { relative_mse: 0.0, rmse: 0.0, mean_ratio: 1.0 });
        assert!(compare(&black, &good, &all).unwrap().mean_ratio.is_infinite());
    }

    /// Squares of the largest floats do not fit a float.
    #[test]
    fn the_largest_floats_have_finite_metrics() {
        let found = compare(&image(&[f32::MAX, 0.0]), &image(&[-f32::MAX, 1e-40]), &Mask { counts: vec![true; 2] }).unwrap();
        assert!(found.relative_mse.is_finite() && found.rmse.is_finite() && found.mean_ratio.is_finite(), "{found:?}");
    }
}
