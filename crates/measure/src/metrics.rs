//! Everything that a report shows of two pictures.

use crate::{
    Image, Mask, MeasureError, compare,
    flip::{self, PIXELS_PER_DEGREE},
    metric::check_pair,
    ssim::ssim,
};
use glam::DVec3;
use lobelia_lobes::{luminance, tonemap::srgb_encode};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Metrics by name. Radiance is compared as it is; PSNR, SSIM and LDR-FLIP see both pictures as [`display`] shows them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// `mean of (test - reference)^2 / (reference^2 + (0.1 m)^2)`, m the mean of the reference. Lower is better; infinite against a black reference.
    #[serde(with = "unbounded")]
    pub relative_mse: f64,
    /// Root of the mean squared difference, in radiance. Lower is better.
    pub rmse: f64,
    /// Mean absolute difference, in radiance. Lower is better.
    pub mae: f64,
    /// `-10 log10` of the mean squared difference of displayed values, whose peak is 1, dB. Higher is better; infinite for equal pictures.
    #[serde(with = "unbounded")]
    pub psnr: f64,
    /// Structural similarity of displayed luma. Higher is better, at most 1.
    pub ssim: f64,
    /// FLIP of displayed values. Lower is better, in [0, 1].
    pub flip_ldr: f64,
    /// FLIP over the exposures of the reference. Lower is better, in [0, 1].
    pub flip_hdr: f64,
    /// Pixels in a million that are ten times as bright as the reference is there and next to it, and as all but two of their eight neighbours.
    /// Lower is better.
    pub fireflies: f64,
    /// Mean of the test image over that of the reference; 1 is right. Infinite where the reference's is 0.
    #[serde(with = "unbounded")]
    pub mean_ratio: f64,
}

/// JSON has no infinity: it is written as nothing, and nothing is read as infinity. The sign of an infinite ratio is lost.
mod unbounded {
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
        value.is_finite().then_some(*value).serialize(to)
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::INFINITY))
    }
}

/// Radiance as it is displayed: so exposed that the mean luminance of the reference is middle grey (0.18), under a fit of the ACES curve, sRGB-encoded.
pub fn display(reference: &Image, image: &Image) -> Image {
    let luminance_of = |pixel: &[f32; 3]| luminance(DVec3::from(pixel.map(f64::from)));
    let mean = reference.pixels.iter().map(luminance_of).sum::<f64>() / reference.pixels.len().max(1) as f64;
    let exposure = if mean > 0.0 && mean.is_finite() { 0.18 / mean } else { 1.0 };
    let shown = |value: f32| {
        let linear = flip::aces(f64::from(value).max(0.0) * exposure);
        srgb_encode(linear) as f32
    };
    Image { pixels: image.pixels.iter().map(|pixel| pixel.map(shown)).collect(), ..image.clone() }
}

impl Metrics {
    /// All of them, under the names of their fields.
    pub fn by_name(&self) -> [(&'static str, f64); 9] {
        [
            ("relative_mse", self.relative_mse),
            ("rmse", self.rmse),
            ("mae", self.mae),
            ("psnr", self.psnr),
            ("ssim", self.ssim),
            ("flip_ldr", self.flip_ldr),
            ("flip_hdr", self.flip_hdr),
            ("fireflies", self.fireflies),
            ("mean_ratio", self.mean_ratio),
        ]
    }
}

/// All metrics of a finite pair of one size, over all pixels.
pub fn measure(reference: &Image, test: &Image) -> Result<Metrics, MeasureError> {
    let mut found = measure_each(reference, &[test])?;
    found.pop().ok_or(MeasureError::EmptyMask)
}

/// As [`measure`], of several pictures against one reference, whose part of the work is done once.
pub fn measure_each(reference: &Image, tests: &[&Image]) -> Result<Vec<Metrics>, MeasureError> {
    for test in tests {
        check_pair(reference, test)?;
    }
    let shown_reference = display(reference, reference);
    let shown: Vec<Image> = tests.par_iter().map(|test| display(reference, test)).collect();
    let flip_ldr = flip::flip_ldr_each(&shown_reference, &shown.iter().collect::<Vec<_>>(), PIXELS_PER_DEGREE)?;
    let flip_hdr = flip::flip_hdr_each(reference, tests, PIXELS_PER_DEGREE)?;
    let pairs = |a: &Image, b: &Image| -> Vec<f64> {
        a.pixels.as_flattened().iter().zip(b.pixels.as_flattened()).map(|(left, right)| f64::from(*left) - f64::from(*right)).collect()
    };
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / (3 * reference.pixels.len()) as f64;
    let one = |index: usize| {
        let (test, shown_test) = (tests[index], &shown[index]);
        let basic = compare(reference, test, &Mask::all(reference))?;
        let squared = mean(&mut pairs(&shown_reference, shown_test).into_iter().map(|difference| difference * difference));
        Ok(Metrics {
            relative_mse: basic.relative_mse,
            rmse: basic.rmse,
            mae: mean(&mut pairs(reference, test).into_iter().map(f64::abs)),
            psnr: -10.0 * squared.log10(),
            ssim: ssim(&shown_reference, shown_test)?.0,
            flip_ldr: flip_ldr[index].mean,
            flip_hdr: flip_hdr[index].mean,
            fireflies: fireflies(reference, test) as f64 / reference.pixels.len() as f64 * 1e6,
            mean_ratio: basic.mean_ratio,
        })
    };
    (0..tests.len()).into_par_iter().map(one).collect()
}

/// Pixels that are ten times as bright as the reference there and next to it, and as all but two of their neighbours, and above a tenth of the reference's mean.
fn fireflies(reference: &Image, test: &Image) -> usize {
    const FACTOR: f64 = 10.0;
    let brightness = |image: &Image, index: usize| image.pixels[index].iter().map(|value| f64::from(*value)).sum::<f64>();
    let floor = 0.1 * (0..reference.pixels.len()).map(|index| brightness(reference, index)).sum::<f64>() / reference.pixels.len() as f64;
    let (width, height) = (test.width as i64, test.height as i64);
    let is_one = |index: &usize| {
        let value = brightness(test, *index);
        if value <= FACTOR * brightness(reference, *index) || value <= floor {
            return false;
        }
        let (x, y) = (*index as i64 % width, *index as i64 / width);
        let near: Vec<usize> = (-1..=1)
            .flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)))
            .filter(|(u, v)| (*u, *v) != (x, y) && (0..width).contains(u) && (0..height).contains(v))
            .map(|(u, v)| (v * width + u) as usize)
            .collect();
        // A bright edge that lies a pixel elsewhere is no firefly.
        if near.iter().any(|place| value <= FACTOR * brightness(reference, *place)) {
            return false;
        }
        let mut near: Vec<f64> = near.into_iter().map(|place| brightness(test, place)).collect();
        near.sort_by(f64::total_cmp);
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
            let difference = (f64::from(*t) - f64::from(*r)).abs();
            if difference == 0.0 { 0.0 } else { difference / (f64::from(*r).abs() + 0.1 * mean.abs()) }
        });
        (parts.sum::<f64>() / 3.0) as f32
    };
    Ok(reference.pixels.iter().zip(&test.pixels).map(off).collect())
}

/// Colours for a map: black at `low` and below, bright yellow at `high` and above, on a logarithmic scale if `low` is above 0, else a linear one.
/// NaN is shown as what is above. Without a range (`high` not above `low`, or not finite) what is above `low` is bright and all else black.
pub fn false_colour(map: &[f32], low: f32, high: f32) -> Vec<[u8; 3]> {
    let share = |value: f32| {
        let range = high > low && low.is_finite() && high.is_finite();
        if value.is_nan() || (!range && value > low) {
            1.0
        } else if !range {
            0.0
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
    fn a_bright_line_elsewhere_is_no_row_of_fireflies() {
        let line = |at: usize| {
            let value = |index: usize| if index % 32 == at { 20.0 } else { 0.2 };
            Image { width: 32, height: 32, pixels: (0..1024).map(|index| [value(index); 3]).collect() }
        };
        assert_eq!(measure(&line(15), &line(16)).unwrap().fireflies, 0.0);
        // Where the reference has no line at all, each pixel has two bright neighbours and counts.
        assert_eq!(measure(&Image { pixels: vec![[0.2; 3]; 1024], ..line(0) }, &line(16)).unwrap().fireflies, 31250.0);
    }

    /// What JSON has no number for comes back, too.
    #[test]
    fn metrics_come_back_from_json() {
        for (reference, test) in [(0.4, 0.4), (0.0, 1.0), (0.4, 0.5)] {
            let metrics = measure(&flat(reference), &flat(test)).unwrap();
            let text = serde_json::to_string(&metrics).unwrap();
            let back: Metrics = serde_json::from_str(&text).unwrap();
            let numbers = |of: &Metrics| [of.relative_mse, of.psnr, of.mean_ratio, of.mae, of.flip_hdr];
            for (found, expected) in numbers(&back).into_iter().zip(numbers(&metrics)) {
                // Reading decimal digits may round the last bit.
                assert!(found == expected || (found / expected - 1.0).abs() < 1e-15, "{found} {expected} {text}");
            }
        }
        assert!(serde_json::from_str::<Metrics>("{\"psnr\":null}").is_err(), "what is missing is not infinite");
    }

    /// Differences of the largest floats do not fit a float.
    #[test]
    fn the_largest_floats_have_finite_metrics() {
        let mut ends = [flat(0.0), flat(0.0)];
        (ends[0].pixels[7], ends[1].pixels[7]) = ([f32::MAX; 3], [-f32::MAX; 3]);
        let found = measure(&ends[0], &ends[1]).unwrap();
        assert!((found.mae / (2.0 * f64::from(f32::MAX) / 192.0) - 1.0).abs() < 1e-6, "{found:?}");
        let map = relative_error_map(&ends[0], &ends[1]).unwrap();
        assert!((map[7] - 2.0).abs() < 2e-3, "{}", map[7]);
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
        for (low, high) in [(0.5, 0.5), (0.5, 0.1), (0.5, f32::NAN), (0.5, f32::INFINITY)] {
            let colours = false_colour(&[0.4, 0.5, 0.6, f32::INFINITY], low, high);
            assert_eq!(colours, false_colour(&[0.0, 0.0, 1.0, 1.0], 0.0, 1.0), "{low} to {high}");
        }
    }
}
