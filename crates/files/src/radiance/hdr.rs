//! Radiance HDR files, with what their header says of exposure and primaries.

use super::{Primaries, Radiance, broken, check_size};
use image::{DynamicImage, codecs::hdr::HdrDecoder};
use std::io::Cursor;

pub(super) fn decode(bytes: &[u8]) -> Result<Radiance, String> {
    let broken = |error: image::ImageError| broken(bytes, "Radiance HDR", error);
    let (bytes, xyz) = as_rgbe(bytes);
    let decoder = HdrDecoder::with_strictness(Cursor::new(&*bytes), false).map_err(broken)?;
    let header = decoder.metadata();
    check_size(header.width.into(), header.height.into())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgb32f();
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let pixels = picture.as_raw().chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let mut radiance = Radiance { width, height, pixels, notes: Vec::new() };
    let (red, green, blue) = header.color_correction.unwrap_or((1.0, 1.0, 1.0));
    // Both have been multiplied into the pixels already (Ward, filefmts).
    let factors = [red, green, blue].map(|correction| correction * header.exposure.unwrap_or(1.0));
    if factors != [1.0; 3] {
        if factors.iter().all(|factor| factor.is_finite() && *factor > 0.0) {
            for pixel in &mut radiance.pixels {
                *pixel = [0, 1, 2].map(|channel| pixel[channel] / factors[channel]);
            }
            let [red, green, blue] = factors;
            radiance.note(format!("its EXPOSURE and COLORCORR of {red}, {green}, {blue} are divided out"));
        } else {
            radiance.note("its EXPOSURE or COLORCORR is not positive and is ignored");
        }
    }
    if xyz {
        radiance.convert(&Primaries::XYZ, "colours");
    } else if let Some((_, text)) = header.custom_attributes.iter().rfind(|(key, _)| key == "PRIMARIES") {
        let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        match numbers[..] {
            // Photoshop writes zeros.
            [a, b, c, d, e, f, g, h] if numbers.iter().any(|number| *number != 0.0) => {
                radiance.convert(&Primaries { rgb: [[a, b], [c, d], [e, f]], white: [g, h] }, "PRIMARIES");
            }
            _ => {}
        }
    }
    Ok(radiance)
}

/// The same file with a format that the decoder takes, and whether its colours are CIE XYZ: the numbers are stored alike.
fn as_rgbe(bytes: &[u8]) -> (std::borrow::Cow<'_, [u8]>, bool) {
    const XYZE: &[u8] = b"32-bit_rle_xyze";
    let header = &bytes[..bytes.windows(2).position(|pair| pair == b"\n\n").unwrap_or(0)];
    match header.windows(XYZE.len()).position(|word| word == XYZE) {
        Some(place) => {
            let mut copy = bytes.to_vec();
            copy[place..place + XYZE.len()].copy_from_slice(b"32-bit_rle_rgbe");
            (copy.into(), true)
        }
        None => (bytes.into(), false),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Two flat pixels: (1, 0.5, 0.25) and (2, 1, 0.5).
    fn file(header: &str) -> Vec<u8> {
        let mut bytes = format!("#?RADIANCE\n{header}\n-Y 1 +X 2\n").into_bytes();
        bytes.extend([128, 64, 32, 129, 128, 64, 32, 130]);
        bytes
    }

    fn first(header: &str) -> ([f32; 3], Vec<String>) {
        let picture = decode(&file(header)).unwrap();
        (picture.pixels[0], picture.notes)
    }

    #[test]
    fn header_lines_are_honoured() {
        let plain = "FORMAT=32-bit_rle_rgbe\n";
        assert_eq!(first(plain), ([1.0, 0.5, 0.25], vec![]));
        let (pixel, notes) = first(&format!("{plain}EXPOSURE=2\nEXPOSURE= 4\n"));
        assert_eq!(pixel, [0.125, 0.0625, 0.03125]);
        assert!(notes[0].contains("EXPOSURE"), "{notes:?}");
        assert_eq!(first(&format!("{plain}COLORCORR= 2 1 0.5\n")).0, [0.5, 0.5, 0.5]);
        for nothing in ["EXPOSURE=1\n", "PRIMARIES=0 0 0 0 0 0 0 0\n", "PRIMARIES=0.64 0.33 0.30 0.60 0.15 0.06 0.3127 0.3290\n"] {
            assert_eq!(first(&format!("{plain}{nothing}")), ([1.0, 0.5, 0.25], vec![]), "{nothing}");
        }
        let (pixel, notes) = first(&format!("{plain}EXPOSURE=-1\n"));
        assert_eq!((pixel, notes.len()), ([1.0, 0.5, 0.25], 1));
    }

    #[test]
    fn primaries_are_converted() {
        // Rec. 2020, whose red lies outside of Rec. 709's.
        let (pixel, notes) = first("FORMAT=32-bit_rle_rgbe\nPRIMARIES= .708 .292 .170 .797 .131 .046 .3127 .3290\n");
        let expected =
            [1.6605 - 0.5876 * 0.5 - 0.0728 * 0.25, -0.1246 + 1.1329 * 0.5 - 0.0083 * 0.25, -0.0182 - 0.1006 * 0.5 + 1.1187 * 0.25];
        assert!(pixel.iter().zip(expected).all(|(found, expected)| (f64::from(*found) - expected).abs() < 1e-3), "{pixel:?}");
        assert!(notes[0].contains("PRIMARIES are red (0.7080, 0.2920)"), "{notes:?}");
        let (pixel, notes) = first("FORMAT=32-bit_rle_xyze\n");
        assert!(pixel[0] > 1.5 && pixel[1] < 0.4 && notes.len() == 1, "{pixel:?}");
    }

    #[test]
    fn what_is_broken_is_told() {
        let whole = file("FORMAT=32-bit_rle_rgbe\n");
        for length in 2..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "cut to {length}");
        }
        let mut claim = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000000 +X 2000000\n".to_vec();
        claim.extend([0; 40]);
        assert!(decode(&claim).unwrap_err().contains("at most"));
    }
}
