//! Everything that a report shows of two pictures.

use crate::{
    Image, Mask, MeasureError, compare,
    flip::{self, PIXELS_PER_DEGREE},
    metric::check_pair,
    ssim::ssim,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Metrics by name. Radiance is compared as it is; PSNR, SSIM and LDR-FLIP see both pictures as [`display`] shows them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// `mean of (test - reference)^2 / (reference^2 + (0.1 m)^2)`, m the mean of the reference. Lower is better.
    pub relative_mse: f64,
    /// Root of the mean squared difference, in radiance. Lower is better.
    pub rmse: f64,
    /// Mean absolute difference, in radiance. Lower is better.
    pub mae: f64,
    /// `-10 log10` of the mean squared difference of displayed values, whose peak is 1, dB. Higher is better; infinite for equal pictures.
    pub psnr: f64,
    /// Structural similarity of displayed luma. Higher is better, at most 1.
    pub ssim: f64,
    /// FLIP of displayed values. Lower is better, in [0, 1].
    pub flip_ldr: f64,
    /// FLIP over the exposures of the reference. Lower is better, in [0, 1].
    pub flip_hdr: f64,
    /// Pixels in a million that are ten times as bright as the reference and as all but two of their eight neighbours. Lower is better.
    pub fireflies: f64,
    /// Mean of the test image over that of the reference; 1 is right.
    pub mean_ratio: f64,
}

/// Radiance as it is displayed: so exposed that the mean luminance of the reference is middle grey (0.18), under a fit of the ACES curve, sRGB-encoded.
pub fn display(reference: &Image, image: &Image) -> Image {
    let luminance = |pixel: &[f32; 3]| DVec3::from(pixel.map(f64::from)).dot(DVec3::new(0.2126, 0.7152, 0.0722));
    let mean = reference.pixels.iter().map(luminance).sum::<f64>() / reference.pixels.len().max(1) as f64;
    let exposure = if mean > 0.0 && mean.is_finite() { 0.18 / mean } else { 1.0 };
    let shown = |value: f32| {
        let linear = flip::aces(f64::from(value).max(0.0) * exposure);
        (if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }) as f32
    };
    Image { pixels: image.pixels.iter().map(|pixel| pixel.map(shown)).collect(), ..image.clone() }
}

/// All metrics of a finite pair of one size, over all pixels.
pub fn measure(reference: &Image, test: &Image) -> Result<Metrics, MeasureError> {
    check_pair(reference, test)?;
    let basic = compare(reference, test, &Mask::all(reference))?;
    let [shown_reference, shown_test] = [reference, test].map(|image| display(reference, image));
    let pairs = |a: &Image, b: &Image| -> Vec<f64> {
        a.pixels.as_flattened().iter().zip(b.pixels.as_flattened()).map(|(left, right)| f64::from(left - right)).collect()
    };
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / (3 * reference.pixels.len()) as f64;
    let squared = mean(&mut pairs(&shown_reference, &shown_test).into_iter().map(|difference| difference * difference));
    Ok(Metrics {
        relative_mse: basic.relative_mse,
        rmse: basic.rmse,
        mae: mean(&mut pairs(reference, test).into_iter().map(f64::abs)),
        psnr: -10.0 * squared.log10(),
        ssim: ssim(&shown_reference, &shown_test)?.0,
        flip_ldr: flip::flip_ldr(&shown_reference, &shown_test, PIXELS_PER_DEGREE)?.mean,
        flip_hdr: flip::flip_hdr(reference, test, PIXELS_PER_DEGREE)?.mean,
        fireflies: fireflies(reference, test) as f64 / reference.pixels.len() as f64 * 1e6,
        mean_ratio: basic.mean_ratio,
    })
}

/// Pixels that are ten times as bright as the reference there and as all but two of their neighbours, and above a tenth of the reference's mean.
fn fireflies(reference: &Image, test: &Image) -> usize {
    const FACTOR: f32 = 10.0;
    let brightness = |image: &Image, index: usize| image.pixels[index].iter().sum::<f32>();
    let floor = 0.1 * (0..reference.pixels.len()).map(|index| brightness(reference, index)).sum::<f32>() / reference.pixels.len() as f32;
    let (width, height) = (test.width as i64, test.height as i64);
    let is_one = |index: &usize| {
        let value = brightness(test, *index);
        if value <= FACTOR * brightness(reference, *index) || value <= floor {
            return false;
        }
        let (x, y) = (*index as i64 % width, *index as i64 / width);
        let near = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
        let mut near: Vec<f32> = near
            .filter(|(u, v)| (*u, *v) != (x, y) && (0..width).contains(u) && (0..height).contains(v))
            .map(|(u, v)| brightness(test, (v * width + u) as usize))
            .collect();
        near.sort_by(f32::total_cmp);
        // Two neighbours may be as bright: fireflies come in pairs.
        near.len().checked_sub(3).is_none_or(|third| value > FACTOR * near[third])
    };
    (0..test.pixels.len()).filter(is_one).count()
}

/// For every pixel, the mean over channels of `|test - reference| / (reference + 0.1 m)`, m the mean of the reference.
pub fn relative_error_map(reference: &Image, test: &Image) -> Result<Vec<f32>, MeasureError> {
    check_pair(reference, test)?;
    let mean = reference.pixels.as_flattened().iter().map(|value| f64::from(*value)).sum::<f64>() / (3 * reference.pixels.len()) as f64;
    let off = |(expected, found): (&[f32; 3], &[f32; 3])| {
        let parts = expected.iter().zip(found).map(|(r, t)| {
            let difference = f64::from(t - r).abs();
            if difference == 0.0 { 0.0 } else { difference / (f64::from(*r).abs() + 0.1 * mean.abs()) }
        });
        (parts.sum::<f64>() / 3.0) as f32
    };
    Ok(reference.pixels.iter().zip(&test.pixels).map(off).collect())
}

/// Colours for a map: black at `low` and below, bright yellow at `high` and above, on a logarithmic scale if `low` is above 0, else a linear one.
pub fn false_colour(map: &[f32], low: f32, high: f32) -> Vec<[u8; 3]> {
    let share = |value: f32| {
        if value.is_nan() {
            1.0
        } else if low > 0.0 {
            (value.max(low) / low).ln() / (high / low).ln()
        } else {
            (value - low) / (high - low)
        }
    };
    let colour = |value: &f32| {
        let colour = colorous::INFERNO.eval_continuous(f64::from(share(*value)).clamp(0.0, 1.0));
        [colour.r, colour.g, colour.b]
    };
    map.iter().map(colour).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Image {
        Image { width: 16, height: 12, pixels: vec![[value; 3]; 16 * 12] }
    }

    #[test]
    fn equal_pictures_are_perfect_and_others_are_not() {
        let reference = flat(0.4);
        let same = measure(&reference, &reference).unwrap();
        assert_eq!(
            (same.relative_mse, same.mae, same.flip_hdr, same.flip_ldr, same.fireflies, same.mean_ratio),
            (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        );
        assert!(same.psnr == f64::INFINITY && (same.ssim - 1.0).abs() < 1e-6);
        let worse = measure(&reference, &flat(0.5)).unwrap();
        assert!((worse.mae - 0.1).abs() < 1e-6 && (worse.rmse - 0.1).abs() < 1e-6 && (worse.mean_ratio - 1.25).abs() < 1e-6);
        assert!(worse.psnr < 40.0 && worse.psnr > 10.0 && worse.ssim < 1.0 && worse.flip_hdr > 0.01 && worse.flip_ldr > 0.01, "{worse:?}");
        let worst = measure(&reference, &flat(2.0)).unwrap();
        assert!(worst.psnr < worse.psnr && worst.ssim < worse.ssim && worst.flip_ldr > worse.flip_ldr && worst.flip_hdr > worse.flip_hdr);
    }

    #[test]
    fn a_firefly_is_bright_alone() {
        let reference = flat(1.0);
        let mut test = reference.clone();
        test.pixels[5 * 16 + 5] = [30.0; 3];
        assert!((measure(&reference, &test).unwrap().fireflies - 1e6 / 192.0).abs() < 1e-6);
        // A bright patch is a wrong surface, not fireflies; twice as bright is noise.
        for y in 4..8 {
            for x in 4..8 {
                test.pixels[y * 16 + x] = [30.0; 3];
            }
        }
        assert_eq!(measure(&reference, &test).unwrap().fireflies, 0.0);
        let mut noisy = reference.clone();
        noisy.pixels[50] = [2.0; 3];
        assert_eq!(measure(&reference, &noisy).unwrap().fireflies, 0.0);
    }

    #[test]
    fn a_black_reference_and_broken_pictures() {
        let black = measure(&flat(0.0), &flat(1.0)).unwrap();
        assert!(black.relative_mse.is_infinite() && black.flip_hdr > 0.5);
        let mut broken = flat(1.0);
        broken.pixels[3][1] = f32::NAN;
        assert!(matches!(measure(&flat(1.0), &broken), Err(MeasureError::NotFinite { x: 3, y: 0, .. })));
        let other = Image { width: 12, height: 16, pixels: flat(1.0).pixels };
        assert!(matches!(measure(&flat(1.0), &other), Err(MeasureError::Size(_))));
        assert!(relative_error_map(&flat(1.0), &other).is_err());
    }

    #[test]
    fn maps_and_their_colours() {
        let map = relative_error_map(&flat(1.0), &flat(1.11)).unwrap();
        assert!(map.iter().all(|value| (value - 0.1).abs() < 1e-5));
        let colours = false_colour(&[0.0, 1e-3, 1.0, 5.0, f32::NAN], 1e-3, 1.0);
        assert_eq!((colours[0], colours[2], colours[2]), (colours[1], colours[3], colours[4]));
        assert_ne!(colours[0], colours[2]);
        assert_ne!(false_colour(&[0.5], 0.0, 1.0), false_colour(&[0.6], 0.0, 1.0));
    }
}
