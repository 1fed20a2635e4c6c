//! Reflectance and the octahedral map.

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::{DVec2, DVec3};
use lobelia_lobes::{anisotropic_ggx, brdf::*, octahedral::*, specular_albedo::specular_albedo_fit};

/// A normal in `a`, alpha beside it, and a half vector in `b`, mostly where a lobe of that alpha is.
fn normal_and_half_vector(index: u32) -> Row {
    let mut draw = Draw::new(index, 100);
    let normal = draw.direction();
    let alpha = draw.log_between(1e-3, 1.0);
    let angle = if draw.one_in(3) { draw.angle().min(1.57) } else { (alpha * draw.between(0.0, 5.0)).atan() };
    row([group(normal, alpha), group(draw.direction_at(normal, angle), 0.0), [0.0; 4], [0.0; 4]])
}

/// Alpha and two cosines in (0, 1] in `a`, grazing ones among them.
fn cosines(index: u32) -> Row {
    let mut draw = Draw::new(index, 101);
    let cosine = |draw: &mut Draw| if draw.one_in(3) { draw.log_between(1e-6, 1.0) } else { 1.0 - draw.unit() };
    let (l, v) = (cosine(&mut draw), cosine(&mut draw));
    row([[draw.log_between(1e-3, 1.0), l, v, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// Alpha and anisotropy up to 0.95 in `a`; two directions above the horizon in `b` and `c`, grazing ones among them.
fn anisotropic_surface(index: u32) -> Row {
    let mut draw = Draw::new(index, 106);
    let surface = [draw.log_between(1e-3, 1.0), draw.between(-0.95, 0.95), 0.0, 0.0];
    let mut upper = || {
        let direction = draw.direction();
        let height = if draw.one_in(3) { draw.log_between(1e-6, 1.0) } else { direction.z.abs().max(1e-6) };
        group(direction.with_z(0.0).normalize_or(DVec3::X) * (1.0 - height * height).sqrt() + DVec3::Z * height, 0.0)
    };
    row([surface, upper(), upper(), [0.0; 4]])
}

/// A direction above the horizon in `a`.
fn upper_direction(index: u32) -> Row {
    let direction = Draw::new(index, 104).direction();
    row([group(direction.with_z(direction.z.abs()), 0.0), [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// What rounding leaves of sin^2 of the angle between two directions: the parts of the cross product are off by their last places.
fn sine_error(row: &[f64; 16]) -> f64 {
    4e-7 * direction_of(row, 0).cross(direction_of(row, 1)).length() + 2e-13
}

/// Alpha in `a.x` and a cosine in `a.y`, the ends of both and cosines as small as alpha among them; reflectance at normal incidence in `b`, at grazing
/// incidence in `b.w`.
fn alpha_and_cosine(index: u32) -> Row {
    let mut draw = Draw::new(index, 104);
    let alpha = match index % 8 {
        0 => 1e-3,
        1 => 1.0,
        _ => draw.log_between(1e-3, 1.0),
    };
    let cosine = match index % 9 {
        0 => 0.0,
        1 => 1.0,
        2 | 3 => (alpha * draw.log_between(1e-3, 1e3)).min(1.0),
        _ => draw.unit(),
    };
    let color = [draw.unit(), draw.unit(), draw.unit(), draw.unit()];
    row([[alpha, cosine, 0.0, 0.0], color, [0.0; 4], [0.0; 4]])
}

macro_rules! albedo_twin {
    ($lobe:literal, $flags:literal, $distribution:expr) => {
        Twin {
            name: concat!("brdf::specular_albedo (", $lobe, ")"),
            wgsl: concat!(
                "#define SPECULAR\n",
                $flags,
                "#import lobelia::brdf::{Brdf, specular_albedo, specular_albedo_fit}\nfn value(input: Input) -> vec4f {\n",
                "    let brdf = Brdf(vec3f(0.0), input.b.xyz, input.b.w, input.a.x);\n",
                "    return vec4f(specular_albedo_fit(input.a.x, input.a.y), specular_albedo(brdf, input.a.y).xy);\n}"
            ),
            domain: "alpha 1e-3 to 1; cosine 0 to 1; all reflectances",
            input: alpha_and_cosine,
            expected: |row| {
                let (all, schlick) = specular_albedo_fit(row[0], row[1], $distribution);
                let brdf = Brdf {
                    diffuse: DVec3::ZERO,
                    reflectance_normal: DVec3::new(row[4], row[5], row[6]),
                    reflectance_grazing: row[7],
                    alpha: row[0],
                    distribution: $distribution,
                };
                let albedo = brdf.specular_albedo(row[1]);
                // Terms of the fit are up to 80 times what they add up to.
                [all, schlick, albedo.x, albedo.y].map(|value| Expected::absolute(value, 1e-5).non_negative()).to_vec()
            },
        }
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        Twin {
            name: "brdf::ggx_distribution",
            wgsl: "#import lobelia::brdf::ggx_distribution
fn value(input: Input) -> vec4f { return vec4f(ggx_distribution(input.a.w, input.a.xyz, input.b.xyz)); }",
            domain: "alpha 1e-3 to 1; all half vectors",
            input: normal_and_half_vector,
            expected: |row| {
                let (alpha, n, h) = (row[3], direction_of(row, 0), direction_of(row, 1));
                let s2 = sin_squared(n, h);
                let bracket = (1.0 - s2) * alpha * alpha + s2;
                vec![Expected::relative(ggx_distribution(alpha, n, h), 2e-6 + 2.0 * sine_error(row) / bracket).non_negative()]
            },
        },
        Twin {
            name: "brdf::phong_distribution",
            wgsl: "#import lobelia::brdf::phong_distribution
fn value(input: Input) -> vec4f { return vec4f(phong_distribution(input.a.w, input.a.xyz, input.b.xyz)); }",
            domain: "alpha 1e-3 to 1 (exponent 0 to 2e6); all half vectors",
            input: normal_and_half_vector,
            expected: |row| {
                let (alpha, n, h) = (row[3], direction_of(row, 0), direction_of(row, 1));
                let (exponent, s2) = (phong_exponent(alpha), sin_squared(n, h));
                let log = -0.5 * exponent * (-s2).ln_1p().max(-69.0);
                // The exponent itself is a difference near alpha 1.
                let bound =
                    3e-6 + 1e-6 * log + 0.5 * exponent * sine_error(row) / (1.0 - s2).max(1e-7) + 3e-7 * (-s2).ln_1p().abs().min(69.0);
                let value = phong_distribution(alpha, n, h);
                // Next to the surface all that is left of cos^2 is a rounding error, or nothing (e^-69): the value is that of any cosine as small.
                let bound = bound + if s2 > 0.9999 { 35.0 * exponent } else { 0.0 };
                let cosine_squared = (1.0 - s2).max(0.0) + if s2 > 0.9999 { 1e-6 } else { 0.0 };
                let scale = (exponent + 2.0) / (2.0 * std::f64::consts::PI) * cosine_squared.powf(0.5 * exponent);
                vec![Expected::scaled(value, value.max(scale).max(1e-30), bound).non_negative()]
            },
        },
        Twin {
            name: "brdf::ggx_visibility",
            wgsl: "#import lobelia::brdf::ggx_visibility\nfn value(input: Input) -> vec4f { return vec4f(ggx_visibility(input.a.x, input.a.y, input.a.z)); }",
            domain: "alpha 1e-3 to 1; both cosines 1e-6 to 1",
            input: cosines,
            expected: |row| vec![Expected::relative(ggx_visibility(row[0], row[1], row[2]), 2e-6).non_negative()],
        },
        Twin {
            name: "brdf::phong_visibility",
            wgsl: "#import lobelia::brdf::phong_visibility\nfn value(input: Input) -> vec4f { return vec4f(phong_visibility(input.a.x, input.a.y, input.a.z)); }",
            domain: "alpha 1e-3 to 1; both cosines 1e-6 to 1",
            input: cosines,
            expected: |row| {
                // The masking of Beckmann's fit ends with a step of 7e-5, and 1 - cos^2 is a difference near normal incidence.
                let near = |c: f64| {
                    let sine = (1.0 - c * c).max(1e-12).sqrt();
                    let a = (0.5 * phong_exponent(row[0]) + 1.0).sqrt() * c / sine;
                    if (a - 1.6).abs() < 1e-3 { 1e-4 } else { 0.0 }
                };
                let value = phong_visibility(row[0], row[1], row[2]);
                vec![Expected::relative(value, 5e-6 + near(row[1]) + near(row[2])).non_negative()]
            },
        },
        Twin {
            name: "anisotropic_ggx::anisotropic_ggx_distribution",
            wgsl: "#import lobelia::anisotropic_ggx::{anisotropic_alphas, anisotropic_ggx_distribution}
fn value(input: Input) -> vec4f { return vec4f(anisotropic_ggx_distribution(anisotropic_alphas(input.a.x, input.a.y), input.b.xyz)); }",
            domain: "alpha 1e-3 to 1, anisotropy -0.95 to 0.95; half vectors above the horizon",
            input: anisotropic_surface,
            expected: |row| {
                let alphas = anisotropic_ggx::alphas(row[0], row[1]);
                // Twice that of 1 - anisotropy, and as much of the rest.
                vec![Expected::relative(anisotropic_ggx::distribution(alphas, direction_of(row, 1)), 6e-6).non_negative()]
            },
        },
        Twin {
            name: "anisotropic_ggx::anisotropic_ggx_visibility",
            wgsl: "#import lobelia::anisotropic_ggx::{anisotropic_alphas, anisotropic_ggx_visibility}
fn value(input: Input) -> vec4f { return vec4f(anisotropic_ggx_visibility(anisotropic_alphas(input.a.x, input.a.y), input.b.xyz, input.c.xyz)); }",
            domain: "alpha 1e-3 to 1, anisotropy -0.95 to 0.95; both directions above the horizon",
            input: anisotropic_surface,
            expected: |row| {
                let alphas = anisotropic_ggx::alphas(row[0], row[1]);
                let value = anisotropic_ggx::visibility(alphas, direction_of(row, 1), direction_of(row, 2));
                vec![Expected::relative(value, 5e-6).non_negative()]
            },
        },
        albedo_twin!("GGX", "", Distribution::Ggx),
        albedo_twin!("Phong", "#define NDF_PHONG\n", Distribution::Phong),
        Twin {
            name: "octahedral::octahedral_encode",
            wgsl: "#import lobelia::octahedral::octahedral_encode
fn value(input: Input) -> vec4f { return vec4f(octahedral_encode(input.a.xyz), 0.0, 0.0); }",
            domain: "all directions",
            input: |index| row([group(Draw::new(index, 102).direction(), 0.0), [0.0; 4], [0.0; 4], [0.0; 4]]),
            expected: |row| octahedral_encode(direction_of(row, 0)).to_array().map(|part| Expected::absolute(part, 5e-7)).to_vec(),
        },
        Twin {
            name: "octahedral::octahedral_decode",
            wgsl: "#import lobelia::octahedral::octahedral_decode
fn value(input: Input) -> vec4f { return vec4f(octahedral_decode(input.a.xy), 0.0); }",
            domain: "[-1, 1]^2",
            input: |index| {
                let mut draw = Draw::new(index, 103);
                row([[draw.between(-1.0, 1.0), draw.between(-1.0, 1.0), 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
            },
            expected: |row| octahedral_decode(DVec2::new(row[0], row[1])).to_array().map(|part| Expected::absolute(part, 5e-7)).to_vec(),
        },
        Twin {
            name: "hemi_octahedral::hemi_octahedral_norm",
            wgsl: "#import lobelia::hemi_octahedral::hemi_octahedral_norm
fn value(input: Input) -> vec4f { return vec4f(hemi_octahedral_norm(input.a.xyz)); }",
            domain: "directions with z >= 0",
            input: upper_direction,
            expected: |row| vec![Expected::relative(hemi_octahedral_norm(direction_of(row, 0)), 5e-7)],
        },
        Twin {
            name: "hemi_octahedral::hemi_octahedral_encode",
            wgsl: "#import lobelia::hemi_octahedral::hemi_octahedral_encode
fn value(input: Input) -> vec4f { return vec4f(hemi_octahedral_encode(input.a.xyz), 0.0, 0.0); }",
            domain: "directions with z >= 0",
            input: upper_direction,
            expected: |row| hemi_octahedral_encode(direction_of(row, 0)).to_array().map(|part| Expected::absolute(part, 1e-6)).to_vec(),
        },
        Twin {
            name: "hemi_octahedral::hemi_octahedral_decode",
            wgsl: "#import lobelia::hemi_octahedral::hemi_octahedral_decode
fn value(input: Input) -> vec4f { return vec4f(hemi_octahedral_decode(input.a.xy), 0.0); }",
            domain: "[-1, 1]^2",
            input: |index| {
                let mut draw = Draw::new(index, 105);
                row([[draw.between(-1.0, 1.0), draw.between(-1.0, 1.0), 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
            },
            expected: |row| {
                hemi_octahedral_decode(DVec2::new(row[0], row[1])).to_array().map(|part| Expected::absolute(part, 5e-7)).to_vec()
            },
        },
    ]
}
