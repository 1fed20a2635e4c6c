//! Colours and roughness in 32 bits, as the G-buffer and the reflective shadow map store them: the twin of what `lobelia::packing` and
//! `lobelia::surface` unpack.

use glam::DVec3;

/// Colour in [0, 1] of 11-11-10 bits, square-root encoded: each square root is off by at most half a step, 1/4094 (blue 1/2046).
pub fn unpack_color(packed: u32) -> DVec3 {
    let bits = DVec3::new(f64::from(packed & 2047), f64::from(packed >> 11 & 2047), f64::from(packed >> 22));
    let encoded = bits / DVec3::new(2047.0, 2047.0, 1023.0);
    encoded * encoded
}

/// Non-negative colour with a shared 5-bit exponent and 9-bit mantissas (rgb9e5), up to 65408.
pub fn unpack_shared_exponent(packed: u32) -> DVec3 {
    let mantissa = DVec3::new(f64::from(packed & 511), f64::from(packed >> 9 & 511), f64::from(packed >> 18 & 511));
    mantissa * f64::from(packed >> 27).exp2() * 2f64.powi(-24)
}

/// Roughness (16 bits), metallic (8 bits) and specular scale (8 bits), each in [0, 1].
pub fn unpack_specular(packed: u32) -> [f64; 3] {
    [f64::from(packed & 65535) / 65535.0, f64::from(packed >> 16 & 255) / 255.0, f64::from(packed >> 24) / 255.0]
}
