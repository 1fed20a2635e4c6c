//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004, Image Quality Assessment: From Error Visibility to Structural Similarity).

use crate::{Image, MeasureError, metric::check_pair};

/// Half the width of the window, 11 pixels.
const REACH: i64 = 5;
const DEVIATION: f64 = 1.5;
const STABILISERS: [f64; 2] = [0.01 * 0.01, 0.03 * 0.03];

/// Mean SSIM of the luma of two displayed pictures: sRGB-encoded values in [0, 1], of which what is outside is clamped. 1 for equal pictures, down to -1.
///
/// A Gaussian window of 11 x 11 pixels and standard deviation 1.5, K1 = 0.01, K2 = 0.03; the window is cut and weighed anew at the edges, so that every pixel
/// counts. Luma is Rec. 709's, of encoded values. Comes with the value of every pixel.
pub fn ssim(reference: &Image, test: &Image) -> Result<(f64, Vec<f32>), MeasureError> {
    check_pair(reference, test)?;
    let luma = |image: &Image| -> Vec<f64> {
        let of = |pixel: &[f32; 3]| {
            let [r, g, b] = pixel.map(|value| f64::from(value).clamp(0.0, 1.0));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        image.pixels.iter().map(of).collect()
    };
    let (a, b) = (luma(reference), luma(test));
    let size = [reference.width, reference.height];
    let product = |left: &[f64], right: &[f64]| left.iter().zip(right).map(|(x, y)| x * y).collect::<Vec<f64>>();
    let (mean_a, mean_b) = (blurred(size, &a), blurred(size, &b));
    let (aa, bb, ab) = (blurred(size, &product(&a, &a)), blurred(size, &product(&b, &b)), blurred(size, &product(&a, &b)));
    let [c1, c2] = STABILISERS;
    let map: Vec<f32> = (0..a.len())
        .map(|index| {
            let (x, y) = (mean_a[index], mean_b[index]);
            // Differences of means of squares; rounding may leave them just below 0.
            let (var_a, var_b, cov) = ((aa[index] - x * x).max(0.0), (bb[index] - y * y).max(0.0), ab[index] - x * y);
            let value = (2.0 * x * y + c1) * (2.0 * cov + c2) / ((x * x + y * y + c1) * (var_a + var_b + c2));
            value as f32
        })
        .collect();
    Ok((map.iter().map(|value| f64::from(*value)).sum::<f64>() / map.len() as f64, map))
}

fn blurred([width, height]: [usize; 2], values: &[f64]) -> Vec<f64> {
    let along = |values: &[f64], count: usize, at: &dyn Fn(usize, usize) -> usize, lines: usize| {
        let mut out = vec![0.0; values.len()];
        for line in 0..lines {
            for place in 0..count {
                let (mut sum, mut whole) = (0.0, 0.0);
                for offset in -REACH..=REACH {
                    let from = place as i64 + offset;
                    if (0..count as i64).contains(&from) {
                        let weight = (-0.5 * (offset as f64 / DEVIATION).powi(2)).exp();
                        sum += weight * values[at(line, from as usize)];
                        whole += weight;
                    }
                }
                out[at(line, place)] = sum / whole;
            }
        }
        out
    };
    let rows = along(values, width, &|line, place| line * width + place, height);
    along(&rows, height, &|line, place| place * width + line, width)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn noise(seed: u32, mean: f32, spread: f32) -> Image {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / 16_777_216.0 - 0.5
        };
        Image { width: 40, height: 30, pixels: (0..1200).map(|_| [mean + spread * next(); 3]).collect() }
    }

    #[test]
    fn known_answers() {
        let a = noise(1, 0.5, 0.4);
        assert!((ssim(&a, &a).unwrap().0 - 1.0).abs() < 1e-6);
        // Two even greys: only the means count.
        let (x, y) = (0.3, 0.6);
        let flat = |value: f32| Image { width: 20, height: 20, pixels: vec![[value; 3]; 400] };
        let want = (2.0 * x * y + 1e-4) / (x * x + y * y + 1e-4);
        assert!((ssim(&flat(x as f32), &flat(y as f32)).unwrap().0 - want).abs() < 1e-5);
        // Unrelated noise has no structure in common, negated noise the opposite one.
        let unrelated = ssim(&a, &noise(2, 0.5, 0.4)).unwrap().0;
        assert!(unrelated.abs() < 0.2, "{unrelated}");
        let negated = Image { pixels: a.pixels.iter().map(|pixel| pixel.map(|value| 1.0 - value)).collect(), ..a.clone() };
        assert!(ssim(&a, &negated).unwrap().0 < -0.7);
        // A small change is worth little, a blow to one corner shows there.
        let mut hit = a.clone();
        hit.pixels[0] = [1.0; 3];
        let (mean, map) = ssim(&a, &hit).unwrap();
        assert!(mean > 0.98 && mean < 1.0 && map[0] < 0.9 && map[1199] == 1.0, "{mean} {}", map[0]);
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let a = noise(1, 0.5, 0.4);
        let other = Image { width: 30, height: 40, pixels: a.pixels.clone() };
        assert!(matches!(ssim(&a, &other), Err(MeasureError::Size(_))));
        let mut broken = a.clone();
        broken.pixels[5] = [f32::INFINITY; 3];
        assert!(matches!(ssim(&a, &broken), Err(MeasureError::NotFinite { x: 5, y: 0, .. })));
    }
}
