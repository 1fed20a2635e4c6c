//! FLIP, the difference that a viewer sees who flips between two pictures (Andersson et al. 2020, FLIP: A Difference Evaluator for Alternating Images;
//! 2021, Visualizing Errors in Rendered High Dynamic Range Images).

use crate::{Image, MeasureError, metric::check_pair};
use lobelia_lobes::tonemap::srgb_decode;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of visual angle where nobody says: 0.7 m from a display of 0.7 m and 3840 pixels.
pub const PIXELS_PER_DEGREE: f64 = 67.020_645_141_601_56;

/// A value for every pixel, in [0, 1], row by row from the top, and their mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean over pixels.
    pub mean: f64,
    /// Each pixel's.
    pub map: Vec<f32>,
}

impl Flip {
    fn new(map: Vec<f64>) -> Self {
        Self { mean: map.iter().sum::<f64>() / map.len() as f64, map: map.into_iter().map(|value| value as f32).collect() }
    }
}

/// FLIP of pictures as they are displayed: sRGB-encoded values in [0, 1]; what is outside is clamped.
pub fn flip_ldr(reference: &Image, test: &Image, pixels_per_degree: f64) -> Result<Flip, MeasureError> {
    only(flip_ldr_each(reference, &[test], pixels_per_degree)?)
}

/// FLIP of linear radiance: the largest LDR-FLIP of each pixel over a range of exposures, chosen from the reference, under a fit of the ACES curve.
///
/// A reference that is black has no exposures: its FLIP is that of the pictures as they are. Negative values count as 0.
pub fn flip_hdr(reference: &Image, test: &Image, pixels_per_degree: f64) -> Result<Flip, MeasureError> {
    only(flip_hdr_each(reference, &[test], pixels_per_degree)?)
}

fn only(mut found: Vec<Flip>) -> Result<Flip, MeasureError> {
    found.pop().ok_or(MeasureError::EmptyMask)
}

/// As [`flip_ldr`], of several pictures against one reference, whose part of the work is done once.
pub(crate) fn flip_ldr_each(reference: &Image, tests: &[&Image], pixels_per_degree: f64) -> Result<Vec<Flip>, MeasureError> {
    for test in tests {
        check_pair(reference, test)?;
    }
    let decode = |value: f32| srgb_decode(f64::from(value).clamp(0.0, 1.0));
    let linear = |image: &Image| image.pixels.iter().map(|pixel| pixel.map(decode)).collect::<Vec<_>>();
    let filters = Filters::new(pixels_per_degree)?;
    let size = [reference.width, reference.height];
    let expected = Seen::new(&filters, size, &linear(reference));
    let of = |test: &&Image| Flip::new(difference(&filters, &expected, &Seen::new(&filters, size, &linear(test))));
    Ok(tests.par_iter().map(of).collect())
}

/// As [`flip_hdr`], of several pictures against one reference, whose part of the work is done once.
pub(crate) fn flip_hdr_each(reference: &Image, tests: &[&Image], pixels_per_degree: f64) -> Result<Vec<Flip>, MeasureError> {
    for test in tests {
        check_pair(reference, test)?;
    }
    let filters = Filters::new(pixels_per_degree)?;
    let size = [reference.width, reference.height];
    let mut maps = vec![vec![0.0f64; reference.pixels.len()]; tests.len()];
    for exposure in Exposures::of(reference).each() {
        let shown = |image: &Image| {
            let scale = exposure.exp2();
            image.pixels.iter().map(|pixel| pixel.map(|value| aces(f64::from(value).max(0.0) * scale))).collect::<Vec<_>>()
        };
        let expected = Seen::new(&filters, size, &shown(reference));
        maps.par_iter_mut().zip(tests).for_each(|(map, test)| {
            let here = difference(&filters, &expected, &Seen::new(&filters, size, &shown(test)));
            for (largest, value) in map.iter_mut().zip(here) {
                *largest = largest.max(value);
            }
        });
    }
    Ok(maps.into_iter().map(Flip::new).collect())
}

/// Exposures, in stops, at which pictures are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The brightest pixel of the reference is nearly white.
    pub start: f64,
    /// Its median pixel is.
    pub stop: f64,
    /// How many, both ends counted.
    pub count: usize,
}

impl Exposures {
    /// From the reference's largest and median luminance.
    pub fn of(reference: &Image) -> Self {
        let mut luminance: Vec<f64> = reference
            .pixels
            .iter()
            .map(|[r, g, b]| {
                let row = rgb_to_xyz([f64::from(*r), f64::from(*g), f64::from(*b)])[1];
                if row.is_finite() { row.max(0.0) } else { 0.0 }
            })
            .collect();
        luminance.sort_by(f64::total_cmp);
        let middle = luminance.len() / 2;
        let median = if luminance.len() % 2 == 1 { luminance[middle] } else { 0.5 * (luminance[middle - 1] + luminance[middle]) };
        let largest = luminance.last().copied().unwrap_or(0.0);
        if largest <= 0.0 {
            return Self { start: 0.0, stop: 0.0, count: 1 };
        }
        // Where the curve reaches 0.85.
        let [a, b, c] = [0, 1, 2].map(|power| ACES[power] - 0.85 * ACES[power + 3]);
        let bright = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
        // A median of 0 has no exposure; nor may the floor lie above the largest of a dim picture.
        let floor = f64::from(f32::EPSILON) * largest.min(1.0);
        let (start, stop) = ((bright / largest).log2(), (bright / median.max(floor)).log2());
        Self { start, stop, count: ((stop - start).ceil() as usize).clamp(2, 1000) }
    }

    fn each(self) -> impl Iterator<Item = f64> {
        let step = if self.count > 1 { (self.stop - self.start) / (self.count - 1) as f64 } else { 0.0 };
        (0..self.count).map(move |index| self.start + step * index as f64)
    }
}

/// Numerator and denominator of Narkowicz' fit of the ACES curve, highest powers first, for an exposure of 0.6.
const ACES: [f64; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

pub(crate) fn aces(x: f64) -> f64 {
    // So that squares stay finite.
    let x = x.min(1e150);
    (((ACES[0] * x + ACES[1]) * x + ACES[2]) / ((ACES[3] * x + ACES[4]) * x + ACES[5])).clamp(0.0, 1.0)
}

type Colour = [f64; 3];

/// Linear Rec. 709 to XYZ of D65, in the exact fractions of the primaries.
const RGB_TO_XYZ: [Colour; 3] = [
    [10_135_552.0 / 24_577_794.0, 8_788_810.0 / 24_577_794.0, 4_435_075.0 / 24_577_794.0],
    [2_613_072.0 / 12_288_897.0, 8_788_810.0 / 12_288_897.0, 887_015.0 / 12_288_897.0],
    [1_425_312.0 / 73_733_382.0, 8_788_810.0 / 73_733_382.0, 70_074_185.0 / 73_733_382.0],
];

fn rows(matrix: &[Colour; 3], colour: Colour) -> Colour {
    matrix.map(|row| row[0] * colour[0] + row[1] * colour[1] + row[2] * colour[2])
}

fn rgb_to_xyz(colour: Colour) -> Colour {
    rows(&RGB_TO_XYZ, colour)
}

fn xyz_to_rgb(colour: Colour) -> Colour {
    use glam::{DMat3, DVec3};
    let matrix = DMat3::from_cols_array_2d(&RGB_TO_XYZ).transpose();
    (matrix.inverse() * DVec3::from_array(colour)).to_array()
}

/// XYZ over that of white.
fn relative(xyz: Colour) -> Colour {
    let white = rgb_to_xyz([1.0; 3]);
    [0, 1, 2].map(|channel| xyz[channel] / white[channel])
}

/// The linear opponent space in which contrast sensitivity is applied.
fn rgb_to_opponent(colour: Colour) -> Colour {
    let [x, y, z] = relative(rgb_to_xyz(colour));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn opponent_to_rgb([luminance, red_green, yellow_blue]: Colour) -> Colour {
    let y = (luminance + 16.0) / 116.0;
    let white = rgb_to_xyz([1.0; 3]);
    xyz_to_rgb([(y + red_green / 500.0) * white[0], y * white[1], (y - yellow_blue / 200.0) * white[2]])
}

/// CIELAB with the Hunt effect: chroma counts as much as there is light to see it.
fn rgb_to_hunt_lab(colour: Colour) -> Colour {
    const DELTA: f64 = 6.0 / 29.0;
    let [x, y, z] = relative(rgb_to_xyz(colour)).map(|t| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// City-block distance of lightness and Euclidean distance of chroma.
fn hyab(a: Colour, b: Colour) -> f64 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// What depends on the viewing distance alone.
struct Filters {
    /// For each opponent channel, Gaussians along a line with their shares.
    contrast: [Vec<(f64, Vec<f64>)>; 3],
    /// Along a line: a Gaussian and its first and second derivative.
    feature: [Vec<f64>; 3],
    /// The colour difference that counts as 1 before it is spread: between green and blue.
    largest: f64,
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Result<Self, MeasureError> {
        if !(1.0..=2000.0).contains(&pixels_per_degree) {
            return Err(MeasureError::PixelsPerDegree(pixels_per_degree));
        }
        // Amplitudes and widths of the contrast sensitivity of the three channels (2020, section 4.1.1).
        const SENSITIVITY: [[(f64, f64); 2]; 3] =
            [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i64;
        let contrast = SENSITIVITY.map(|parts| {
            let lines = parts.map(|(amplitude, width)| {
                let line: Vec<f64> =
                    (-radius..=radius).map(|x| (-PI * PI * (x as f64 / pixels_per_degree).powi(2) / width).exp()).collect();
                (amplitude * (PI / width).sqrt(), line)
            });
            // The two-dimensional filter sums to 1; each part's share is its own sum.
            let sums = lines.clone().map(|(amplitude, line)| amplitude * line.iter().sum::<f64>().powi(2));
            let whole: f64 = sums.iter().sum();
            let part = |((_, line), sum): ((f64, Vec<f64>), f64)| {
                let total: f64 = line.iter().sum();
                (sum / whole, line.iter().map(|value| value / total).collect())
            };
            lines.into_iter().zip(sums).filter(|(_, sum)| *sum > 0.0).map(part).collect()
        });
        let deviation = 0.5 * 0.082 * pixels_per_degree;
        let reach = (3.0 * deviation).ceil() as i64;
        let line = |f: &dyn Fn(f64) -> f64| (-reach..=reach).map(|x| f(x as f64)).collect::<Vec<f64>>();
        let bell = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let smooth = normalised(&line(&bell));
        let first = balanced(&line(&|x| -x * bell(x)));
        let second = balanced(&line(&|x| (x * x / (deviation * deviation) - 1.0) * bell(x)));
        let largest = hyab(rgb_to_hunt_lab([0.0, 1.0, 0.0]), rgb_to_hunt_lab([0.0, 0.0, 1.0])).powf(COLOUR_POWER);
        Ok(Self { contrast, feature: [smooth, first, second], largest })
    }
}

const COLOUR_POWER: f64 = 0.7;
const FEATURE_POWER: f64 = 0.5;

fn normalised(line: &[f64]) -> Vec<f64> {
    let sum: f64 = line.iter().sum();
    line.iter().map(|value| value / sum).collect()
}

/// Positive values sum to 1 and negative ones to -1.
fn balanced(line: &[f64]) -> Vec<f64> {
    let positive: f64 = line.iter().filter(|value| **value > 0.0).sum();
    let negative: f64 = line.iter().filter(|value| **value < 0.0).sum::<f64>().abs();
    line.iter().map(|value| if *value > 0.0 { value / positive } else { value / negative }).collect()
}

/// A picture of one number a pixel filtered along rows and columns; beyond its edge it goes on as it ends.
fn filtered([width, height]: [usize; 2], values: &[f64], along_x: &[f64], along_y: &[f64]) -> Vec<f64> {
    let reach = (along_x.len() / 2) as i64;
    let mut rows = vec![0.0; values.len()];
    for y in 0..height {
        let row = &values[y * width..(y + 1) * width];
        for x in 0..width {
            let at = |offset: i64| row[(x as i64 + offset).clamp(0, width as i64 - 1) as usize];
            rows[y * width + x] = along_x.iter().enumerate().map(|(index, weight)| weight * at(index as i64 - reach)).sum();
        }
    }
    let mut out = vec![0.0; values.len()];
    for y in 0..height {
        let target = &mut out[y * width..(y + 1) * width];
        for (index, weight) in along_y.iter().enumerate() {
            let from = (y as i64 + index as i64 - reach).clamp(0, height as i64 - 1) as usize;
            for (sum, value) in target.iter_mut().zip(&rows[from * width..(from + 1) * width]) {
                *sum += weight * value;
            }
        }
    }
    out
}

/// LDR-FLIP of what is seen of two pictures.
fn difference(filters: &Filters, reference: &Seen, test: &Seen) -> Vec<f64> {
    let colours = reference.colours.iter().zip(&test.colours).map(|(a, b)| {
        // Differences up to 0.4 of the largest are spread over [0, 0.95].
        let power = hyab(*a, *b).powf(COLOUR_POWER);
        let knee = 0.4 * filters.largest;
        if power < knee { 0.95 / knee * power } else { 0.95 + (power - knee) / (filters.largest - knee) * 0.05 }
    });
    let features = reference.features.iter().zip(&test.features).map(|(a, b)| {
        let [edges, points] = [0, 1].map(|kind| (a[kind] - b[kind]).abs());
        (edges.max(points) / std::f64::consts::SQRT_2).powf(FEATURE_POWER)
    });
    colours.zip(features).map(|(colour, feature)| colour.clamp(0.0, 1.0).powf(1.0 - feature)).collect()
}

/// What of a linear picture in [0, 1] reaches the viewer.
struct Seen {
    colours: Vec<Colour>,
    /// Strength of edges and of points.
    features: Vec<[f64; 2]>,
}

impl Seen {
    fn new(filters: &Filters, size: [usize; 2], pixels: &[Colour]) -> Self {
        let opponent: Vec<Colour> = pixels.iter().map(|pixel| rgb_to_opponent(*pixel)).collect();
        let channels: [Vec<f64>; 3] = std::array::from_fn(|channel| {
            let values: Vec<f64> = opponent.iter().map(|colour| colour[channel]).collect();
            let mut sum = vec![0.0; values.len()];
            for (share, line) in &filters.contrast[channel] {
                for (sum, value) in sum.iter_mut().zip(filtered(size, &values, line, line)) {
                    *sum += share * value;
                }
            }
            sum
        });
        let colour = |index: usize| {
            let rgb = opponent_to_rgb([channels[0][index], channels[1][index], channels[2][index]]);
            rgb_to_hunt_lab(rgb.map(|value| value.clamp(0.0, 1.0)))
        };
        // Features are looked for in what is light and dark alone.
        let grey: Vec<f64> = opponent.iter().map(|colour| (colour[0] + 16.0) / 116.0).collect();
        let [smooth, first, second] = &filters.feature;
        let strength = |derivative: &[f64]| {
            let (x, y) = (filtered(size, &grey, derivative, smooth), filtered(size, &grey, smooth, derivative));
            x.into_iter().zip(y).map(|(x, y)| (x * x + y * y).sqrt()).collect::<Vec<f64>>()
        };
        let (edges, points) = (strength(first), strength(second));
        Self { colours: (0..pixels.len()).map(colour).collect(), features: edges.into_iter().zip(points).map(|(a, b)| [a, b]).collect() }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn flat(value: [f32; 3]) -> Image {
        Image { width: 24, height: 16, pixels: vec![value; 24 * 16] }
    }

    #[test]
    fn colour_spaces_go_back_and_forth() {
        for colour in [[0.1, 0.5, 0.9], [1.0, 0.0, 0.0], [1.0; 3]] {
            let back = opponent_to_rgb(rgb_to_opponent(colour));
            assert!((0..3).all(|channel| (back[channel] - colour[channel]).abs() < 1e-12), "{back:?}");
        }
        let white = rgb_to_hunt_lab([1.0; 3]);
        assert!((white[0] - 100.0).abs() < 1e-9 && white[1].abs() < 1e-9 && white[2].abs() < 1e-9);
    }

    #[test]
    fn known_answers() {
        let same = flip_ldr(&flat([0.3; 3]), &flat([0.3; 3]), PIXELS_PER_DEGREE).unwrap();
        assert_eq!((same.mean, same.map.len()), (0.0, 24 * 16));
        // Green and blue are the ends of the scale.
        let far = flip_ldr(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]), PIXELS_PER_DEGREE).unwrap();
        assert!((far.mean - 1.0).abs() < 1e-9, "{}", far.mean);
        // Which is the reference does not matter for LDR.
        let (a, b) = (flat([0.2, 0.4, 0.1]), flat([0.25, 0.3, 0.15]));
        let one = flip_ldr(&a, &b, PIXELS_PER_DEGREE).unwrap();
        assert_eq!(one, flip_ldr(&b, &a, PIXELS_PER_DEGREE).unwrap());
        assert!(one.mean > 0.05 && one.mean < 0.5);
        // A single changed pixel is seen where it is, and more so than at a distance.
        let mut spot = a.clone();
        spot.pixels[8 * 24 + 12] = [1.0; 3];
        let seen = flip_ldr(&a, &spot, PIXELS_PER_DEGREE).unwrap();
        assert!(seen.map[8 * 24 + 12] > 0.3 && seen.map[0] < 0.05, "{} {}", seen.map[8 * 24 + 12], seen.map[0]);
    }

    #[test]
    fn high_dynamic_range() {
        let reference = Image { width: 4, height: 1, pixels: vec![[0.01; 3], [0.1; 3], [1.0; 3], [100.0; 3]] };
        let scaled = Image { pixels: reference.pixels.iter().map(|pixel| pixel.map(|value| value * 1.5)).collect(), ..reference.clone() };
        let off = flip_hdr(&reference, &scaled, PIXELS_PER_DEGREE).unwrap();
        assert!(off.mean > 0.03, "{}", off.mean);
        assert_eq!(flip_hdr(&reference, &reference, PIXELS_PER_DEGREE).unwrap().mean, 0.0);
        let black = flat([0.0; 3]);
        assert_eq!(flip_hdr(&black, &black, PIXELS_PER_DEGREE).unwrap().mean, 0.0);
        assert!(flip_hdr(&black, &flat([1.0; 3]), PIXELS_PER_DEGREE).unwrap().mean > 0.5);
        // How dim both are does not matter.
        let dim = |scale: f32, factor: f32| Image {
            pixels: reference.pixels.iter().map(|p| p.map(|v| v * factor * scale)).collect(),
            ..reference.clone()
        };
        for scale in [1e-6, 1e-10, 1e-14] {
            let exposures = Exposures::of(&dim(scale, 1.0));
            assert!(exposures.start < exposures.stop && exposures.count == Exposures::of(&reference).count, "{scale}: {exposures:?}");
            let found = flip_hdr(&dim(scale, 1.0), &dim(scale, 1.5), PIXELS_PER_DEGREE).unwrap().mean;
            assert!((found - off.mean).abs() < 1e-5, "{scale}: {found} {}", off.mean);
        }
        let huge = flat([f32::MAX; 3]);
        assert!(flip_hdr(&flat([1.0; 3]), &huge, PIXELS_PER_DEGREE).unwrap().mean.is_finite());
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let small = Image { width: 1, height: 1, pixels: vec![[0.0; 3]] };
        let broken = Image { pixels: vec![[f32::NAN; 3]; 24 * 16], ..flat([0.0; 3]) };
        for flip in [flip_ldr, flip_hdr] {
            assert!(matches!(flip(&flat([0.0; 3]), &small, PIXELS_PER_DEGREE), Err(MeasureError::Size(_))));
            assert!(matches!(flip(&broken, &flat([0.0; 3]), PIXELS_PER_DEGREE), Err(MeasureError::NotFinite { .. })));
            assert!(matches!(flip(&small, &small, f64::NAN), Err(MeasureError::PixelsPerDegree(_))));
            // Smaller than the filters: still a picture.
            assert_eq!(flip(&small, &small, PIXELS_PER_DEGREE).unwrap().mean, 0.0);
        }
    }
}
