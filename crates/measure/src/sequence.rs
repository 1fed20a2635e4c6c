//! Several pictures of one setting: what is off on average, what is noise, and what flickers.

use crate::{Image, MeasureError, metric::check_pair};

/// An error taken apart: the sum of both numbers is the mean squared error of one picture, exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct BiasVariance {
    /// Mean over pixels and channels of the squared difference between the mean picture and the reference, what noise alone would make
    /// of it taken away. Right on average, so that it may lie below 0 where there is no bias.
    pub bias_squared: f64,
    /// Mean over pixels and channels of the variance over the pictures.
    pub variance: f64,
    /// The mean picture minus the reference.
    pub bias: Vec<[f32; 3]>,
}

/// Splits the error of pictures that differ by their seed alone, at least two.
pub fn bias_variance(reference: &Image, tests: &[Image]) -> Result<BiasVariance, MeasureError> {
    if tests.len() < 2 {
        return Err(MeasureError::Sequence(format!("bias and variance need at least 2 pictures, not {}", tests.len())));
    }
    for test in tests {
        check_pair(reference, test)?;
    }
    let count = tests.len() as f64;
    let (mut squared, mut variance, mut bias) = (0.0, 0.0, Vec::with_capacity(reference.pixels.len()));
    for (index, expected) in reference.pixels.iter().enumerate() {
        bias.push([0, 1, 2].map(|channel| {
            let values = || tests.iter().map(|test| f64::from(test.pixels[index][channel]));
            let mean = values().sum::<f64>() / count;
            let spread = values().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
            let off = mean - f64::from(expected[channel]);
            variance += spread;
            // The mean itself is noisy, and its square would count that as bias.
            squared += off * off - spread / count;
            off as f32
        }));
    }
    let values = (3 * reference.pixels.len()) as f64;
    Ok(BiasVariance { bias_squared: squared / values, variance: variance / values, bias })
}

/// Flicker: the mean over frames, pixels and channels of `|(I_t - I_{t-1}) - (R_t - R_{t-1})|` over the mean of the reference sequence. What changes as the reference
/// does counts nothing. Comes with the mean over frames and channels for every pixel, in radiance.
///
/// At least two frames of each; a black reference makes any flicker infinite.
pub fn temporal_error(reference: &[Image], test: &[Image]) -> Result<(f64, Vec<f32>), MeasureError> {
    let (steps, map) = temporal_errors(reference, test)?;
    Ok((steps.iter().sum::<f64>() / steps.len() as f64, map))
}

/// As [`temporal_error`], with one value for each step from a frame to the next, whose mean it is.
pub fn temporal_errors(reference: &[Image], test: &[Image]) -> Result<(Vec<f64>, Vec<f32>), MeasureError> {
    if reference.len() < 2 || reference.len() != test.len() {
        let what =
            format!("flicker needs two sequences of one length, at least 2 frames; they have {} and {}", reference.len(), test.len());
        return Err(MeasureError::Sequence(what));
    }
    for (expected, found) in reference.iter().zip(test) {
        check_pair(expected, found)?;
        check_pair(&reference[0], expected)?;
    }
    let pixels = reference[0].pixels.len();
    let total: f64 = reference.iter().flat_map(|frame| frame.pixels.as_flattened()).map(|value| f64::from(*value)).sum();
    let mean = total / (3 * pixels * reference.len()) as f64;
    let (mut map, mut steps) = (vec![0.0f64; pixels], Vec::new());
    for frame in 1..reference.len() {
        let mut step = 0.0;
        for (index, sum) in map.iter_mut().enumerate() {
            for channel in 0..3 {
                let change = |frames: &[Image]| {
                    f64::from(frames[frame].pixels[index][channel]) - f64::from(frames[frame - 1].pixels[index][channel])
                };
                let off = (change(test) - change(reference)).abs() / 3.0;
                *sum += off;
                step += off;
            }
        }
        let flicker = step / pixels as f64;
        steps.push(if flicker == 0.0 { 0.0 } else { flicker / mean });
    }
    let count = (reference.len() - 1) as f64;
    Ok((steps, map.iter().map(|sum| (sum / count) as f32).collect()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn image(values: &[f32]) -> Image {
        Image { width: values.len(), height: 1, pixels: values.iter().map(|value| [*value; 3]).collect() }
    }

    #[test]
    fn bias_and_variance_by_hand() {
        let reference = image(&[1.0, 2.0]);
        let found = bias_variance(&reference, &[image(&[1.5, 2.0]), image(&[2.5, 2.0])]).unwrap();
        // The first pixel: mean 2, variance 1/2, squared offset 1 less 1/4.
        assert!((found.variance - 0.25).abs() < 1e-12 && (found.bias_squared - 0.375).abs() < 1e-12, "{found:?}");
        assert_eq!(found.bias, [[1.0; 3], [0.0; 3]]);
        // Noise about the truth has no bias.
        let noisy: Vec<Image> = (0..1000u32).map(|index| image(&[1.0 + if index % 2 == 0 { 0.3 } else { -0.3 }, 2.0])).collect();
        let found = bias_variance(&reference, &noisy).unwrap();
        assert!(found.bias_squared < 1e-9 && (found.variance - 0.045).abs() < 1e-3, "{found:?}");
        // The sum is the mean squared error of one picture, also where the estimate of the bias is below 0.
        let found = bias_variance(&reference, &noisy[..2]).unwrap();
        assert!((found.bias_squared + 0.045).abs() < 1e-6 && (found.bias_squared + found.variance - 0.045).abs() < 1e-6, "{found:?}");
        assert!(bias_variance(&reference, &noisy[..1]).is_err() && bias_variance(&image(&[1.0]), &noisy).is_err());
    }

    #[test]
    fn only_what_the_reference_does_not_do_is_flicker() {
        let moving: Vec<Image> = [1.0, 2.0, 4.0].map(|value| image(&[value, 1.0])).to_vec();
        assert_eq!(temporal_error(&moving, &moving).unwrap().0, 0.0);
        // A constant offset is an error, not flicker.
        let offset: Vec<Image> = [2.0, 3.0, 5.0].map(|value| image(&[value, 1.0])).to_vec();
        assert_eq!(temporal_error(&moving, &offset).unwrap().0, 0.0);
        let still: Vec<Image> = vec![image(&[1.0, 1.0]); 3];
        let flickering: Vec<Image> = [1.0, 1.5, 1.0].map(|value| image(&[value, 1.0])).to_vec();
        let (value, map) = temporal_error(&still, &flickering).unwrap();
        assert!((value - 0.25).abs() < 1e-12, "{value}");
        assert_eq!(map, [0.5, 0.0]);
        // A picture that stands still while the truth moves is as wrong.
        assert!((temporal_error(&moving, &still).unwrap().0 - 0.75 / (5.0 / 3.0)).abs() < 1e-6);
        assert!(temporal_error(&still[..1], &still[..1]).is_err() && temporal_error(&still, &moving[..2]).is_err());
    }
}
