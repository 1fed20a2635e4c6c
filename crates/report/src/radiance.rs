//! Radiance inside a page: an opaque PNG twice as high as the picture, RGB of a shared exponent (Ward 1991, Real Pixels) above and the exponent below.
//!
//! Alpha would be the natural place for the exponent, but browsers multiply colours by it and round. A value keeps eight bits relative to the largest channel of its pixel,
//! which is enough to look at over all exposures; `report.json` and the EXR files have numbers.

use crate::data::Radiance;
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

/// Largest exponent that is written, and the offset that makes it a byte: values from 2^-128 to 2^127.
pub(crate) const OFFSET: i32 = 128;

/// Bytes of a pixel: mantissas and exponent. What is not above 0 is 0; NaN is 0, infinity the largest.
fn encode(pixel: [f32; 3]) -> ([u8; 3], u8) {
    let pixel = pixel.map(|value| if value.is_nan() { 0.0 } else { f64::from(value).clamp(0.0, f64::from(f32::MAX) / 4.0) });
    let largest = pixel.iter().copied().fold(0.0, f64::max);
    if largest < 1e-37 {
        return ([0; 3], 0);
    }
    // largest = m 2^e with m in [1/2, 1).
    let mut exponent = largest.log2().floor() as i32 + 1;
    let byte = |value: f64, exponent: i32| (value * 256.0 / f64::from(exponent).exp2()).round();
    if byte(largest, exponent) > 255.0 {
        exponent += 1;
    }
    (pixel.map(|value| byte(value, exponent) as u8), (exponent + OFFSET).clamp(1, 255) as u8)
}

/// The PNG of a picture; none where its pixels do not fill it.
pub(crate) fn png(picture: &Radiance) -> Option<Vec<u8>> {
    if picture.pixels.is_empty() || picture.pixels.len() != picture.width as usize * picture.height as usize {
        return None;
    }
    let (mut above, mut below) = (Vec::with_capacity(6 * picture.pixels.len()), Vec::with_capacity(3 * picture.pixels.len()));
    for pixel in &picture.pixels {
        let (mantissas, exponent) = encode(*pixel);
        above.extend(mantissas);
        below.extend([exponent; 3]);
    }
    above.extend(below);
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(&above, picture.width, 2 * picture.height, ExtendedColorType::Rgb8).ok()?;
    Some(png)
}

#[cfg(test)]
mod tests {
    use super::{OFFSET, encode};

    #[test]
    fn radiance_comes_back() {
        let decode =
            |(mantissas, exponent): ([u8; 3], u8)| mantissas.map(|m| f64::from(m) * f64::from(i32::from(exponent) - OFFSET - 8).exp2());
        for scale in [1e-30f32, 1e-4, 0.5, 0.999, 1.0, 3.0, 65504.0, 1e30] {
            let pixel = [scale, 0.3 * scale, 0.0];
            let back = decode(encode(pixel));
            for (value, back) in pixel.iter().zip(back) {
                assert!((f64::from(*value) - back).abs() <= f64::from(scale) / 255.0, "{scale}: {value} {back}");
            }
        }
        assert_eq!(encode([f32::NAN, -1.0, 0.0]), ([0; 3], 0));
        assert_eq!(encode([1e-42; 3]), ([0; 3], 0));
        let bright = decode(encode([f32::INFINITY, 1.0, 0.0]));
        assert!(bright[0] > 1e37 && bright[1] == 0.0);
    }
}
