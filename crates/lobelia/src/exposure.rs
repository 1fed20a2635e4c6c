//! Whether a picture can be seen: a hint where most of it is white or black.

#[cfg(test)]
use lobelia_lobes::tonemap::srgb_encode;
use lobelia_measure::Image;

/// Share of a picture that is white, or black, from which on a hint is worth giving.
const MOSTLY: f64 = 0.6;

/// Radiance, after exposure, that most of a well exposed picture lies around: middle grey.
const MIDDLE: f64 = 0.18;

/// sRGB value from which on a pixel is white if all its channels are, and up to which it is black.
const WHITE: f64 = 0.98;
const BLACK: f64 = 0.02;

/// What is wrong with a picture's exposure, and what would be right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hint {
    /// Share of the pixels that are white (else: black), in [0, 1].
    pub share: f64,
    /// Whether they are white.
    pub white: bool,
    /// Exposure, stops, that brings the geometric mean of the luminance that is not 0 to middle grey; a whole number of halves.
    pub stops: f64,
}

/// A hint for a picture whose `display` (sRGB-encoded RGBA, row by row) shows `radiance` at an exposure, in stops; `None` where it can be seen, or where no other
/// exposure would help: nothing is lit, or what is lit is well exposed before a black background.
pub fn hint(display: &[u8], radiance: &Image, exposure: f64) -> Option<Hint> {
    let count = display.len() / 4;
    if count == 0 || count != radiance.pixels.len() {
        return None;
    }
    let share = |fits: &dyn Fn(&[u8]) -> bool| display.chunks_exact(4).filter(|pixel| fits(&pixel[..3])).count() as f64 / count as f64;
    let level = |value: f64| (value * 255.0).round() as u8;
    let white = share(&|pixel| pixel.iter().all(|value| *value >= level(WHITE)));
    let black = share(&|pixel| pixel.iter().all(|value| *value <= level(BLACK)));
    let (share, white) = if white >= black { (white, true) } else { (black, false) };
    if share < MOSTLY {
        return None;
    }
    let mut sum = 0.0;
    let mut lit = 0usize;
    for [red, green, blue] in &radiance.pixels {
        let luminance = 0.2126 * f64::from(*red) + 0.7152 * f64::from(*green) + 0.0722 * f64::from(*blue);
        if luminance > 0.0 && luminance.is_finite() {
            sum += luminance.log2();
            lit += 1;
        }
    }
    // A few lit pixels in the dark are as they should be.
    if (lit as f64) < (1.0 - MOSTLY) / 2.0 * count as f64 {
        return None;
    }
    let stops = ((MIDDLE.log2() - sum / lit as f64) * 2.0).round() / 2.0;
    let change = stops - exposure;
    (if white { change <= -1.0 } else { change >= 1.0 }).then_some(Hint { share, white, stops })
}

/// A picture of one radiance as a display without a tone curve shows it, for tests of hints.
#[cfg(test)]
fn shown(radiance: &Image, exposure: f64) -> Vec<u8> {
    let encode = |value: f32| (srgb_encode((f64::from(value) * exposure.exp2()).clamp(0.0, 1.0)) * 255.0).round() as u8;
    radiance.pixels.iter().flat_map(|[r, g, b]| [encode(*r), encode(*g), encode(*b), 255]).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn ramp(scale: f32) -> Image {
        let pixels = (0..64).map(|index| [scale * (0.5 + index as f32 / 64.0); 3]).collect();
        Image { width: 8, height: 8, pixels }
    }

    #[test]
    fn what_is_too_bright_or_too_dark_gets_an_exposure_at_which_it_is_seen() {
        for scale in [1e-5, 1e-3, 0.2, 40.0, 1e5] {
            let radiance = ramp(scale);
            let found = hint(&shown(&radiance, 0.0), &radiance, 0.0);
            if scale == 0.2 {
                assert_eq!(found, None);
                continue;
            }
            let found = found.unwrap();
            assert_eq!(found.white, scale > 1.0, "{scale}");
            assert!(found.share > 0.9, "{scale}: {found:?}");
            // With the exposure that it names, there is no hint.
            assert_eq!(hint(&shown(&radiance, found.stops), &radiance, found.stops), None, "{scale}: {found:?}");
        }
    }

    #[test]
    fn darkness_itself_is_no_fault_of_the_exposure() {
        let mut radiance = ramp(0.0);
        assert_eq!(hint(&shown(&radiance, 0.0), &radiance, 0.0), None);
        radiance.pixels[3] = [1.0; 3];
        assert_eq!(hint(&shown(&radiance, 0.0), &radiance, 0.0), None, "a lamp in the dark");
        assert_eq!(hint(&[], &Image { width: 0, height: 0, pixels: Vec::new() }, 0.0), None);
        // Half of the picture is well exposed, before a black background.
        radiance.pixels[..24].fill([0.2; 3]);
        assert_eq!(hint(&shown(&radiance, 0.0), &radiance, 0.0), None);
        radiance.pixels.fill([f32::NAN; 3]);
        assert_eq!(hint(&[255; 64 * 4], &radiance, 0.0), None);
    }
}
