//! Samples of whole BRDFs: Lambert alone, with GGX and with Phong, as the flags of the shader say.

use super::{COSINE, anything, density, directions, spread, surface, u_of};
use crate::{
    draw::direction_of,
    twin::{Expected, Twin},
};
use glam::DVec3;
use lobelia_lobes::{
    brdf::{Brdf, Distribution},
    sampling::*,
};

fn brdf_of(row: &[f64; 16], distribution: Option<Distribution>) -> Brdf {
    let base = DVec3::new(1.0, 0.6, 0.3) * row[10];
    let specular = if distribution.is_some() { row[11] } else { 0.0 };
    Brdf { alpha: row[3], ..Brdf::new(base, row[7], 0.0, specular, distribution.unwrap_or(Distribution::Ggx)) }
}

/// How far specular_probability may be off: the estimate's specular part is rounded by up to 1e-5 of the larger reflectance; the whole divides.
fn probability_error(brdf: &Brdf, n_dot_v: f64) -> f64 {
    let all = lobelia_lobes::luminance(brdf.albedo_estimate(n_dot_v.max(0.0)));
    let larger = brdf.reflectance_normal.max_element().max(brdf.reflectance_grazing);
    if all > 0.0 { (1e-5 * larger / all).min(1.0) } else { 0.0 }
}

/// How much a BRDF's density changes with the probability of its lobes, at the most: by the sum of both densities.
fn density_by_choice(row: &[f64; 16], distribution: Option<Distribution>) -> f64 {
    let (n, v, l) = (direction_of(row, 0), direction_of(row, 1), direction_of(row, 3));
    let specular = if distribution == Some(Distribution::Phong) { phong_reflection_pdf } else { ggx_reflection_pdf };
    specular(row[3], n, v, l) + cosine_hemisphere_pdf(n, l)
}

fn sample_of(row: &[f64; 16], brdf: &Brdf) -> Option<[f64; 7]> {
    let sample = sample_brdf(brdf, direction_of(row, 0), direction_of(row, 1), u_of(row, 2))?;
    let (d, w) = (sample.direction, sample.weight);
    Some([d.x, d.y, d.z, sample.pdf, w.x, w.y, w.z])
}

/// Direction, density and weight of a BRDF's sample. Where rounding decides between the lobes, or between a sample and none, they only have to be finite.
fn brdf_sample(row: &[f64; 16], distribution: Option<Distribution>) -> [Expected; 7] {
    let brdf = brdf_of(row, distribution);
    let (n, v) = (direction_of(row, 0), direction_of(row, 1));
    let probability = specular_probability(&brdf, n.dot(v));
    // u is rounded once it is used up, too.
    let used = probability_error(&brdf, n.dot(v)) + COSINE * (1.0 - probability);
    let mut moves = directions(&[1]);
    // What is smaller than the largest move, such as the last of u before the horizon, takes smaller moves to be seen.
    moves.extend([(8, used), (8, 0.03 * used), (8, 1e-3 * used), (3, 1.2e-7 * row[3])]);
    let rounding = spread(row, &moves, |row| sample_of(row, &brdf_of(row, distribution)));
    let Some(found) = sample_of(row, &brdf) else {
        return std::array::from_fn(|_| if rounding.is_some() { Expected::absolute(0.0, 1e-30) } else { anything() });
    };
    let crossed = (row[8] - probability).abs() <= used;
    let Some(rounding) = rounding.filter(|_| !crossed) else { return std::array::from_fn(|_| anything()) };
    // Density and weight are those of the direction as it was rounded.
    let mut at = *row;
    at[12..15].copy_from_slice(&found[..3]);
    let at_direction = |row: &[f64; 16]| {
        let (n, v, l, brdf) = (direction_of(row, 0), direction_of(row, 1), direction_of(row, 3), brdf_of(row, distribution));
        let pdf = brdf_pdf(&brdf, n, v, l);
        let weight = brdf.evaluate(n, l, v) * n.dot(l) / pdf;
        (pdf > 0.0).then_some([pdf, weight.x, weight.y, weight.z])
    };
    let Some(turned) = spread(&at, &directions(&[0, 3]), at_direction) else { return std::array::from_fn(|_| anything()) };
    // The choice between the lobes weighs their densities, and with them the weight.
    let chosen = density_by_choice(&at, distribution) * probability_error(&brdf, n.dot(v)) / found[3];
    std::array::from_fn(|index| {
        let bound = if index < 3 { 1.5e-6 } else { turned[index - 3] + (1e-5 + chosen) * found[index] };
        let expected = Expected::scaled(found[index], 1.0, bound + rounding[index]);
        if index < 3 { expected } else { expected.non_negative() }
    })
}

/// The direction's three numbers and the density; or the weight's three.
fn part_of_sample(row: &[f64; 16], distribution: Option<Distribution>, weight: bool) -> Vec<Expected> {
    let all = brdf_sample(row, distribution);
    // Without a sample the direction is the normal, which says nothing.
    let none = all[3].value == 0.0;
    let direction = all[..3].iter().map(|part| if none { anything() } else { *part });
    if weight { all[4..].to_vec() } else { direction.chain([all[3]]).collect() }
}

macro_rules! brdf_twin {
    ($name:expr, $flags:literal, $imports:literal, $value:literal, $expected:expr) => {
        Twin {
            name: concat!("direction_sampling::", $name),
            wgsl: concat!(
                $flags,
                "#import lobelia::brdf::Brdf\n#import lobelia::direction_sampling::{",
                $imports,
                "}\nfn value(input: Input) -> vec4f {\n    let base = vec3f(1.0, 0.6, 0.3) * input.c.z;\n",
                "    let brdf = Brdf(base * ((1.0 - input.b.w) * 0.318309886183791), input.c.w * mix(vec3f(0.04), base, input.b.w), input.c.w, input.a.w);\n",
                "    return ",
                $value,
                ";\n}"
            ),
            domain: "alpha 0.001 to 1; views down to the horizon; u 0 to 1 - 2^-24",
            input: surface,
            expected: $expected,
        }
    };
}

macro_rules! brdf_twins {
    ($lobe:literal, $flags:literal, $distribution:expr) => {
        [
            brdf_twin!(
                concat!("specular_probability (", $lobe, ")"),
                $flags,
                "specular_probability",
                "vec4f(specular_probability(brdf, dot(input.a.xyz, input.b.xyz)))",
                |row| {
                    let (brdf, n_dot_v) = (brdf_of(row, $distribution), direction_of(row, 0).dot(direction_of(row, 1)));
                    vec![Expected::absolute(specular_probability(&brdf, n_dot_v), 1e-6 + probability_error(&brdf, n_dot_v)).non_negative()]
                }
            ),
            brdf_twin!(
                concat!("brdf_pdf (", $lobe, ")"),
                $flags,
                "brdf_pdf",
                "vec4f(brdf_pdf(brdf, input.a.xyz, input.b.xyz, input.d.xyz))",
                |row| {
                    let brdf = brdf_of(row, $distribution);
                    let n_dot_v = direction_of(row, 0).dot(direction_of(row, 1));
                    let extra = density_by_choice(row, $distribution) * probability_error(&brdf, n_dot_v);
                    let pdf = |row: &[f64; 16]| {
                        brdf_pdf(&brdf_of(row, $distribution), direction_of(row, 0), direction_of(row, 1), direction_of(row, 3))
                    };
                    density(row, &[0, 1, 3], 1e-5, pdf)
                        .into_iter()
                        .map(|expected| Expected { bound: expected.bound + extra, ..expected })
                        .collect()
                }
            ),
            brdf_twin!(
                concat!("sample_brdf (", $lobe, "; direction, density)"),
                $flags,
                "sample_brdf, BrdfSample",
                "packed(sample_brdf(brdf, input.a.xyz, input.b.xyz, input.c.xy));\n}\nfn packed(sample: BrdfSample) -> vec4f {\n    return vec4f(sample.direction, sample.pdf)",
                |row| part_of_sample(row, $distribution, false)
            ),
            brdf_twin!(
                concat!("sample_brdf (", $lobe, "; weight)"),
                $flags,
                "sample_brdf",
                "vec4f(sample_brdf(brdf, input.a.xyz, input.b.xyz, input.c.xy).weight, 0.0)",
                |row| part_of_sample(row, $distribution, true)
            ),
        ]
    };
}

/// Twins of this module.
pub(super) fn twins() -> Vec<Twin> {
    let lambert = brdf_twins!("Lambert", "", None);
    let ggx = brdf_twins!("GGX", "#define SPECULAR\n", Some(Distribution::Ggx));
    let phong = brdf_twins!("Phong", "#define SPECULAR\n#define NDF_PHONG\n", Some(Distribution::Phong));
    lambert.into_iter().chain(ggx).chain(phong).collect()
}
