//! Pictures of 8 or 16 bits per channel as radiance: their transfer is undone.

use super::{Primaries, Radiance, broken, check_size};
use image::{DynamicImage, ImageFormat, ImageReader};
use lobelia_lobes::tonemap::srgb_decode;
use std::io::Cursor;

/// How a number in [0, 1] stands for light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Transfer {
    /// IEC 61966-2-1.
    Srgb,
    /// The number to this power.
    Power(f64),
}

impl Transfer {
    fn decode(self, encoded: f64) -> f64 {
        match self {
            Self::Srgb => srgb_decode(encoded),
            Self::Power(power) => encoded.powf(power),
        }
    }

    fn words(self) -> String {
        match self {
            Self::Srgb => "sRGB".into(),
            Self::Power(1.0) => "linear numbers".into(),
            Self::Power(power) => format!("a power of {power:.3}"),
        }
    }
}

pub(super) fn decode(bytes: &[u8]) -> Result<Radiance, String> {
    let broken = |error: image::ImageError| broken(bytes, "picture", error);
    let reader = || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| format!("it cannot be decoded: {error}"));
    let format = reader()?.format();
    let (width, height) = reader()?.into_dimensions().map_err(broken)?;
    check_size(width.into(), height.into())?;
    let mut reader = reader()?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(4 << 30);
    reader.limits(limits);
    let picture = reader.decode().map_err(broken)?;
    let mut radiance = Radiance { width: width as usize, height: height as usize, pixels: Vec::new(), notes: Vec::new() };
    if let DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) = picture {
        radiance.pixels = picture.into_rgb32f().pixels().map(|pixel| pixel.0).collect();
        return Ok(radiance);
    }
    let (transfer, primaries) = if format == Some(ImageFormat::Png) { png(bytes, &mut radiance)? } else { (Transfer::Srgb, None) };
    let wide = picture.color().bytes_per_pixel() / picture.color().channel_count() > 1;
    let (bits, most) = if wide { (16, 65535) } else { (8, 255) };
    let table: Vec<f32> = (0..=most).map(|code| transfer.decode(f64::from(code) / f64::from(most)) as f32).collect();
    radiance.pixels = if wide {
        picture.into_rgb16().pixels().map(|pixel| pixel.0.map(|code| table[usize::from(code)])).collect()
    } else {
        picture.into_rgb8().pixels().map(|pixel| pixel.0.map(|code| table[usize::from(code)])).collect()
    };
    if let Some(primaries) = primaries {
        radiance.convert(&primaries, "primaries");
    }
    let words = transfer.words();
    radiance.note(format!("a picture of {bits} bits, decoded from {words}: it has no range above 1, so a sun or lamps in it are too dim"));
    Ok(radiance)
}

/// Transfer and primaries of a PNG, by the chunks that say so: cICP before iCCP before sRGB before gAMA and cHRM (PNG, third edition, section 4.3); sRGB
/// where there are none.
fn png(bytes: &[u8], radiance: &mut Radiance) -> Result<(Transfer, Option<Primaries>), String> {
    let reader = png::Decoder::new(Cursor::new(bytes)).read_info();
    let reader = reader.map_err(|error| format!("it cannot be decoded: {error}"))?;
    let info = reader.info();
    if let Some(code) = info.coding_independent_code_points {
        let transfer = match code.transfer_function {
            8 => Transfer::Power(1.0),
            4 => Transfer::Power(2.2),
            5 => Transfer::Power(2.8),
            // A camera's curve is shown with BT.1886.
            1 | 6 | 14 | 15 => Transfer::Power(2.4),
            16 => return Err("its transfer is PQ (SMPTE ST 2084), which is not read; save it as OpenEXR or Radiance HDR".into()),
            18 => return Err("its transfer is HLG (ARIB STD-B67), which is not read; save it as OpenEXR or Radiance HDR".into()),
            _ => Transfer::Srgb,
        };
        let d65 = Primaries::REC709.white;
        let primaries = match code.color_primaries {
            9 => Some(Primaries { rgb: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], white: d65 }),
            11 => Some(Primaries { rgb: [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], white: [0.314, 0.351] }),
            12 => Some(Primaries { rgb: [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060]], white: d65 }),
            _ => None,
        };
        return Ok((transfer, primaries));
    }
    if info.icc_profile.is_some() {
        radiance.note("its ICC profile is not applied; it is taken for sRGB");
        return Ok((Transfer::Srgb, None));
    }
    if info.srgb.is_some() {
        return Ok((Transfer::Srgb, None));
    }
    let primaries = info.chrm_chunk.map(|points| {
        let point = |(x, y): (png::ScaledFloat, png::ScaledFloat)| [f64::from(x.into_value()), f64::from(y.into_value())];
        Primaries { rgb: [point(points.red), point(points.green), point(points.blue)], white: point(points.white) }
    });
    let gamma = info.gama_chunk.map(|gamma| f64::from(gamma.into_value())).filter(|gamma| *gamma > 0.01 && *gamma < 100.0);
    let transfer = match gamma {
        // What writers of sRGB put there, rounded.
        Some(gamma) if (gamma - 1.0 / 2.2).abs() < 1e-3 => Transfer::Srgb,
        Some(gamma) => Transfer::Power(1.0 / gamma),
        None => Transfer::Srgb,
    };
    Ok((transfer, primaries))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn written(bits: png::BitDepth, data: &[u8], chunks: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>)) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(bits);
        chunks(&mut encoder);
        encoder.write_header().unwrap().write_image_data(data).unwrap();
        bytes
    }

    fn near(found: f32, expected: f64) -> bool {
        (f64::from(found) - expected).abs() < 1e-4
    }

    #[test]
    fn eight_bits_are_decoded_from_srgb() {
        let picture = decode(&written(png::BitDepth::Eight, &[188, 0, 255], |_| {})).unwrap();
        let [red, green, blue] = picture.pixels[0];
        assert!(near(red, 0.5029) && green == 0.0 && blue == 1.0, "{red} {green} {blue}");
        assert!(picture.notes[0].contains("8 bits") && picture.notes[0].contains("no range above 1"), "{:?}", picture.notes);
        let grey = image::GrayImage::from_raw(1, 1, vec![188]).unwrap();
        for format in [ImageFormat::Png, ImageFormat::Jpeg] {
            let mut bytes = Cursor::new(Vec::new());
            grey.write_to(&mut bytes, format).unwrap();
            let pixel = decode(&bytes.into_inner()).unwrap().pixels[0];
            assert!(pixel.iter().all(|value| near(*value, 0.5029)), "{format:?} {pixel:?}");
        }
    }

    #[test]
    fn sixteen_bits_keep_their_precision() {
        let data: Vec<u8> = [48317u16, 1, 65535].iter().flat_map(|code| code.to_be_bytes()).collect();
        let picture = decode(&written(png::BitDepth::Sixteen, &data, |_| {})).unwrap();
        let [red, green, blue] = picture.pixels[0];
        assert!(near(red, srgb_decode(48317.0 / 65535.0)) && (green * 65535.0 * 12.92 - 1.0).abs() < 1e-4 && blue == 1.0);
        assert!(picture.notes[0].contains("16 bits"));
    }

    #[test]
    fn chunks_say_how_numbers_are_meant() {
        let code = |gamma: f32| {
            let bytes = written(png::BitDepth::Eight, &[128, 128, 128], |encoder| encoder.set_source_gamma(png::ScaledFloat::new(gamma)));
            decode(&bytes).unwrap().pixels[0][0]
        };
        let half: f64 = 128.0 / 255.0;
        assert!(near(code(1.0), half) && near(code(0.5), half.powi(2)) && near(code(0.45455), srgb_decode(half)));
        let wide = written(png::BitDepth::Eight, &[0, 255, 0], |encoder| {
            let point = |x: f32, y: f32| (png::ScaledFloat::new(x), png::ScaledFloat::new(y));
            encoder.set_source_chromaticities(png::SourceChromaticities {
                white: point(0.3127, 0.3290),
                red: point(0.708, 0.292),
                green: point(0.170, 0.797),
                blue: point(0.131, 0.046),
            });
        });
        let green = decode(&wide).unwrap();
        assert!((green.pixels[0][1] - 1.1329).abs() < 1e-3 && green.pixels[0][0] < 0.0, "{:?}", green.pixels);
    }

    #[test]
    fn what_is_no_picture_is_told() {
        assert!(decode(b"404: Not Found").unwrap_err().contains("it is text that begins with `404: Not Found`"));
        assert!(decode(b"BLENDER-v404").unwrap_err().contains("it is a Blender file"));
        let whole = written(png::BitDepth::Eight, &[1, 2, 3], |_| {});
        assert!(decode(&whole[..whole.len() / 2]).unwrap_err().contains("it cannot be decoded"));
    }
}
