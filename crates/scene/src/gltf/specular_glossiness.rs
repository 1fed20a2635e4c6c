//! Diffuse and specular colours as base colour, metallic and roughness.
//!
//! The metallic-roughness model reflects `0.04 (1 - m) + base m` at normal incidence and scatters `base (1 - m)`; a specular-glossiness surface reflects
//! `specular` and scatters `diffuse (1 - max specular)`. Both conditions on luminances give a quadratic equation for m, and with m a base colour
//! follows from either: from the scattered light where m is small, from the reflected light where it is large (the conversion that
//! `KHR_materials_pbrSpecularGlossiness` suggests).

use crate::Texture;
use glam::Vec3;
use lobelia_lobes::tonemap::{srgb_decode, srgb_encode};

/// Factors of a specular-glossiness material, each in [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Factors {
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub gloss: f32,
}

/// Reflectance of dielectrics at normal incidence.
const DIELECTRIC: f32 = 0.04;

/// How bright a colour looks.
fn brightness(color: Vec3) -> f32 {
    (color * color).dot(Vec3::new(0.299, 0.587, 0.114)).sqrt()
}

/// Base colour and metallic.
pub(super) fn base_and_metallic(diffuse: Vec3, specular: Vec3) -> (Vec3, f32) {
    let rest = 1.0 - specular.max_element();
    let (scattered, reflected) = (brightness(diffuse) * rest, brightness(specular));
    let metallic = if reflected <= DIELECTRIC {
        0.0
    } else {
        let b = scattered + reflected - 2.0 * DIELECTRIC;
        let c = DIELECTRIC - reflected;
        let root = (b * b - 4.0 * DIELECTRIC * c).max(0.0).sqrt();
        // c < 0: this root is not negative, and its larger form does not cancel.
        (if b > 0.0 { -2.0 * c / (b + root) } else { (root - b) / (2.0 * DIELECTRIC) }).clamp(0.0, 1.0)
    };
    let by_diffuse = diffuse * (rest / (1.0 - metallic).max(1e-6));
    let by_specular = (specular - Vec3::splat(DIELECTRIC * (1.0 - metallic))) / metallic.max(1e-6);
    (by_diffuse.lerp(by_specular, metallic * metallic).clamp(Vec3::ZERO, Vec3::ONE), metallic)
}

fn decoded(byte: u8) -> f32 {
    srgb_decode(f64::from(byte) / 255.0) as f32
}

fn encoded(value: f32) -> u8 {
    (srgb_encode(value.into()) * 255.0).round() as u8
}

/// Textures of base colour and of metallic and roughness, factors included, with as many texels as the larger of both.
pub(super) fn converted(factors: Factors, diffuse: Option<&Texture>, glossy: &Texture, name: &str) -> [Texture; 2] {
    let (width, height) = diffuse.map_or((glossy.width, glossy.height), |other| {
        if other.width * other.height > glossy.width * glossy.height { (other.width, other.height) } else { (glossy.width, glossy.height) }
    });
    let at = |texture: &Texture, x: u32, y: u32| -> [u8; 4] {
        let (x, y) =
            (u64::from(x) * u64::from(texture.width) / u64::from(width), u64::from(y) * u64::from(texture.height) / u64::from(height));
        let start = 4 * (y * u64::from(texture.width) + x) as usize;
        [0, 1, 2, 3].map(|channel| texture.rgba[start + channel])
    };
    let color = |[r, g, b, _]: [u8; 4]| Vec3::new(decoded(r), decoded(g), decoded(b));
    let empty =
        |what: &str| Texture { name: format!("{name} ({what})"), width, height, rgba: Vec::with_capacity(4 * (width * height) as usize) };
    let (mut base, mut rough) = (empty("base colour"), empty("metallic and roughness"));
    for y in 0..height {
        for x in 0..width {
            let diffuse = diffuse.map_or([255; 4], |texture| at(texture, x, y));
            let shiny = at(glossy, x, y);
            let (color, metallic) = base_and_metallic(factors.diffuse * color(diffuse), factors.specular * color(shiny));
            let roughness = 1.0 - factors.gloss * f32::from(shiny[3]) / 255.0;
            base.rgba.extend(color.to_array().map(encoded));
            base.rgba.push(diffuse[3]);
            rough.rgba.extend([0, (roughness * 255.0).round() as u8, (metallic * 255.0).round() as u8, 255]);
        }
    }
    [base, rough]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn converted_surfaces_reflect_and_scatter_what_they_did() {
        for (diffuse, specular) in [
            (Vec3::new(0.5, 0.3, 0.2), Vec3::splat(0.04)),
            (Vec3::new(0.4, 0.1, 0.7), Vec3::splat(0.04)),
            (Vec3::ZERO, Vec3::new(1.0, 0.77, 0.34)),
            (Vec3::ZERO, Vec3::splat(0.9)),
        ] {
            let (base, metallic) = base_and_metallic(diffuse, specular);
            let reflected = Vec3::splat(DIELECTRIC).lerp(base, metallic);
            let scattered = base * (1.0 - metallic);
            assert!((reflected - specular).abs().max_element() < 1e-3, "{diffuse} {specular}: {reflected}");
            assert!((scattered - diffuse * (1.0 - specular.max_element())).abs().max_element() < 1e-3, "{diffuse} {specular}: {scattered}");
        }
        // In between, the brightness of both is kept.
        let (diffuse, specular) = (Vec3::splat(0.3), Vec3::splat(0.3));
        let (base, metallic) = base_and_metallic(diffuse, specular);
        assert!(metallic > 0.1 && metallic < 0.9);
        assert!((DIELECTRIC * (1.0 - metallic) + base.x * metallic - 0.3).abs() < 0.02);
    }

    #[test]
    fn textures_are_converted_texel_by_texel() {
        let texture = |rgba: &[u8]| Texture { name: "t".into(), width: rgba.len() as u32 / 4, height: 1, rgba: rgba.to_vec() };
        let factors = Factors { diffuse: Vec3::ONE, specular: Vec3::ONE, gloss: 0.5 };
        // The diffuse texture is half as wide: left black, and right grey with half the alpha.
        let diffuse = texture(&[0, 0, 0, 255, 128, 128, 128, 128]);
        let glossy = texture(&[255, 255, 255, 255, 255, 255, 255, 0, 56, 56, 56, 255, 56, 56, 56, 102]);
        let [base, rough] = converted(factors, Some(&diffuse), &glossy, "paint");
        assert_eq!((base.width, rough.width, base.rgba[3], base.rgba[15]), (4, 4, 255, 128));
        // Mirror to mirror; a dielectric of reflectance 0.0395 to a dielectric.
        assert_eq!(rough.rgba, [0, 128, 255, 255, 0, 255, 255, 255, 0, 128, 0, 255, 0, 204, 0, 255]);
        assert_eq!(&base.rgba[..3], [255; 3]);
        // 128 is 0.2159 in linear light; what is not reflected is 1 - 0.0395 of it, 0.2074, and that is 125.7 encoded.
        assert_eq!(&base.rgba[8..11], [126; 3]);
    }
}
