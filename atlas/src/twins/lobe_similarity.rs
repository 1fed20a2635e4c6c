//! Similarities and the weights they make. Weights are compared as absolute values: a filter adds them up.

use super::sg::pair;
use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::DVec3;
use lobelia_lobes::{asg::AnisotropicSphericalGaussian, lobe_similarity::*};
use std::f64::consts::FRAC_PI_2;

/// The largest exponent of a weight.
const BETA: f64 = 20.0;

/// Two numbers of [0, 1e8] and, as the second, sometimes an infinite kernel.
fn sharpness_and_kernel(index: u32) -> Row {
    let mut draw = Draw::new(index, 70);
    let sharpness = draw.sharpness();
    let kernel = if draw.one_in(16) { INFINITE_KERNEL } else { draw.sharpness() };
    row([[sharpness, kernel, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// Two lobes in `a` and `b`, an exponent in `c.x`. Half of them are alike: sharpnesses within a factor of two, axes within a few widths.
fn lobes(index: u32) -> Row {
    let mut row = pair(index);
    let mut draw = Draw::new(index, 71);
    if draw.one_in(2) {
        let sharpness = draw.sharpness();
        let axis = direction_of(&row.map(f64::from), 0).normalize();
        let angle = (draw.between(0.0, 2.0) / (sharpness + 0.5).sqrt()).min(3.0);
        let other = draw.direction_at(axis, angle);
        let ratio = if draw.one_in(4) { 1.0 } else { draw.log_between(0.5, 2.0) };
        row[3] = sharpness as f32;
        row[4..8].copy_from_slice(&group(other, sharpness * ratio).map(|number| number as f32));
    }
    row[8] = if draw.one_in(4) { BETA } else { draw.log_between(0.1, BETA) } as f32;
    row
}

/// Two normals in `a` and `b`, an exponent in `c.x`, sharpness and kernel in `c.y` and `c.z`.
fn normals(index: u32) -> Row {
    let mut row = pair(index);
    let mut draw = Draw::new(index, 72);
    row[8] = draw.log_between(0.1, BETA) as f32;
    row[9] = draw.between(0.5, 2.0) as f32;
    row[10] = if draw.one_in(8) { INFINITE_KERNEL } else { draw.log_between(0.1, 1e8) } as f32;
    row
}

/// Two ASGs: tangent and eta_x in `a`, axis and eta_y in `b`; the second in `c` and `d`. Bandwidths within a factor of 1e4 of each other,
/// axes mostly within a few widths.
fn anisotropic(index: u32) -> Row {
    let mut draw = Draw::new(index, 73);
    let middle = draw.log_between(1e-4, 1e6);
    let eta = [(); 4].map(|()| if draw.one_in(64) { 0.0 } else { middle * draw.log_between(0.01, 100.0) });
    let lobe = |axis: DVec3, x: f64, y: f64, draw: &mut Draw| [group(draw.direction_at(axis, FRAC_PI_2), x), group(axis, y)];
    let axis = draw.direction();
    let angle = if draw.one_in(4) { draw.angle() } else { (draw.between(0.0, 3.0) / (middle + 0.5).sqrt()).min(3.0) };
    let other = if draw.one_in(16) { axis } else { draw.direction_at(axis, angle) };
    let [a, b] = lobe(axis, eta[0], eta[1], &mut draw);
    let [c, d] = lobe(other, eta[2], eta[3], &mut draw);
    row([a, b, c, d])
}

fn anisotropic_of(row: &[f64; 16], at: usize) -> AnisotropicSphericalGaussian {
    let (tangent, axis) = (direction_of(row, at), direction_of(row, at + 1));
    let (eta_x, eta_y) = (row[4 * at + 3], row[4 * at + 7]);
    AnisotropicSphericalGaussian { tangent, bitangent: axis.cross(tangent), axis, eta_x, eta_y, amplitude: 1.0 }
}

/// What rounding leaves of a weight of two ASGs: 3e-7 of a direction against the ratio of the widest to the narrowest standard deviation,
/// and the direction of the mean axis where both axes are nearly opposite.
fn anisotropic_bound(row: &[f64; 16], kernel: f64) -> f64 {
    let (a, b) = (anisotropic_of(row, 0), anisotropic_of(row, 2));
    let variances = [a.eta_x, a.eta_y, b.eta_x, b.eta_y].map(|eta| 0.5 / eta.max(1e-6) + 1.0 / kernel);
    let ratio = variances.iter().fold(0.0f64, |x, y| x.max(*y)) / variances.iter().fold(f64::INFINITY, |x, y| x.min(*y));
    let mean = (a.axis + b.axis).length().max(1e-8);
    1e-5 + BETA * 1e-6 * ratio.sqrt() * (2.0 / mean)
}

macro_rules! of_lobes {
    ($name:literal, $arguments:literal, $bound:expr, $value:expr) => {
        Twin {
            name: concat!("lobe_similarity::", $name),
            wgsl: concat!(
                "#import lobelia::lobe_similarity::",
                $name,
                "\nfn value(input: Input) -> vec4f {\n    let found = ",
                $name,
                "(",
                $arguments,
                ");\n    return vec4f(found, max(found - 1.0, 0.0), 0.0, 0.0);\n}"
            ),
            domain: "both sharpnesses 0, 1e-6 to 1e8; parallel to opposite; beta 0.1 to 20",
            input: lobes,
            expected: |row| {
                let value: fn(DVec3, f64, DVec3, f64, f64) -> f64 = $value;
                let value = value(direction_of(row, 0), row[3], direction_of(row, 1), row[7], row[8]);
                // What exceeds 1 is the second output.
                vec![Expected::absolute(value, $bound).non_negative(), Expected::absolute(0.0, 1e-30)]
            },
        }
    };
}

macro_rules! of_normals {
    ($name:literal, $arguments:literal, $bound:expr, $value:expr) => {
        Twin {
            name: concat!("lobe_similarity::", $name),
            wgsl: concat!(
                "#import lobelia::lobe_similarity::",
                $name,
                "\nfn value(input: Input) -> vec4f { return vec4f(",
                $name,
                "(",
                $arguments,
                ")); }"
            ),
            domain: "parallel to opposite",
            input: normals,
            expected: |row| {
                let value: fn(DVec3, DVec3, &[f64; 16]) -> f64 = $value;
                vec![Expected::absolute(value(direction_of(row, 0), direction_of(row, 1), row), $bound).non_negative()]
            },
        }
    };
}

macro_rules! two_lobes {
    ($name:literal, $arguments:literal) => {
        concat!(
            "#import lobelia::asg::AnisotropicSphericalGaussian\n#import lobelia::lobe_similarity::",
            $name,
            "\nfn lobe(a: vec4f, b: vec4f) -> AnisotropicSphericalGaussian {\n",
            "    return AnisotropicSphericalGaussian(a.xyz, cross(b.xyz, a.xyz), b.xyz, a.w, b.w, 1.0);\n}\n",
            "fn value(input: Input) -> vec4f { return vec4f(",
            $name,
            "(lobe(input.a, input.b), lobe(input.c, input.d), ",
            $arguments,
            ")); }"
        )
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        Twin {
            name: "lobe_similarity::smoothed_sharpness",
            wgsl: "#import lobelia::lobe_similarity::smoothed_sharpness
fn value(input: Input) -> vec4f { return vec4f(smoothed_sharpness(input.a.x, input.a.y)); }",
            domain: "sharpness and kernel 0, 1e-6 to 1e8; kernel infinite",
            input: sharpness_and_kernel,
            expected: |row| vec![Expected::relative(smoothed_sharpness(row[0], row[1]), 1e-6).non_negative()],
        },
        Twin {
            name: "lobe_similarity::smoothed_sg",
            wgsl: "#import lobelia::lobe_similarity::smoothed_sg
fn value(input: Input) -> vec4f {
    let lobe = smoothed_sg(vec3f(0.0, 0.0, 1.0), input.a.x, input.a.y);
    return vec4f(lobe.amplitude, lobe.sharpness, lobe.axis.z, 0.0);
}",
            domain: "sharpness and kernel 0, 1e-6 to 1e8; kernel infinite",
            input: sharpness_and_kernel,
            expected: |row| {
                let lobe = smoothed_sg(DVec3::Z, row[0], row[1]);
                [lobe.amplitude, lobe.sharpness, lobe.axis.z].map(|value| Expected::relative(value, 3e-6).non_negative()).to_vec()
            },
        },
        Twin {
            name: "lobe_similarity::smoothed_sg_value_exact",
            wgsl: "#import lobelia::lobe_similarity::smoothed_sg_value_exact
fn value(input: Input) -> vec4f { return vec4f(smoothed_sg_value_exact(input.a.xyz, input.a.w, input.b.w, input.b.xyz)); }",
            domain: "sharpness and kernel 0, 1e-6 to 1e8; parallel to opposite",
            input: lobes,
            // The value is at most 1.
            expected: |row| {
                let value = smoothed_sg_value_exact(direction_of(row, 0), row[3], row[7], direction_of(row, 1));
                vec![Expected::absolute(value, 4e-6).non_negative()]
            },
        },
        Twin {
            name: "lobe_similarity::gaussian_similarity",
            wgsl: "#import lobelia::lobe_similarity::gaussian_similarity
fn value(input: Input) -> vec4f { return vec4f(gaussian_similarity(input.a.x, input.a.y, input.a.z, input.a.w)); }",
            domain: "variances 1e-12 to 1e12, squared distance 0, 1e-6 to 1e8, dimensions 1 to 3",
            input: |index| {
                let mut draw = Draw::new(index, 74);
                let variance = draw.log_between(1e-12, 1e12);
                let other = if draw.one_in(2) { variance * draw.log_between(0.1, 10.0) } else { draw.log_between(1e-12, 1e12) };
                let (dimension, distance) = (draw.bits() % 3 + 1, draw.sharpness());
                row([[variance, other.clamp(1e-12, 1e12), distance, f64::from(dimension)], [0.0; 4], [0.0; 4], [0.0; 4]])
            },
            expected: |row| vec![Expected::absolute(gaussian_similarity(row[0], row[1], row[2], row[3]), 2e-6).non_negative()],
        },
        of_lobes!("lobe_similarity", "input.a.xyz, input.a.w, input.b.xyz, input.b.w", 2e-6, |a, x, b, y, _| lobe_similarity(a, x, b, y)),
        of_lobes!("lobe_similarity_exact", "input.a.xyz, input.a.w, input.b.xyz, input.b.w", 3e-6, |a, x, b, y, _| {
            lobe_similarity_exact(a, x, b, y)
        }),
        of_lobes!("lobe_similarity_weight", "input.a.xyz, input.a.w, input.b.xyz, input.b.w, input.c.x", 1e-5, lobe_similarity_weight),
        of_lobes!(
            "lobe_similarity_weight_exact",
            "input.a.xyz, input.a.w, input.b.xyz, input.b.w, input.c.x",
            5e-5,
            lobe_similarity_weight_exact
        ),
        of_normals!("diffuse_similarity", "input.a.xyz, input.b.xyz", 1e-6, |a, b, _| diffuse_similarity(a, b)),
        of_normals!("diffuse_similarity_fast", "input.a.xyz, input.b.xyz, input.c.y", 2e-6, |a, b, row| {
            diffuse_similarity_fast(a, b, row[9])
        }),
        Twin {
            name: "lobe_similarity::diffuse_weight_variance",
            wgsl: "#import lobelia::lobe_similarity::diffuse_weight_variance
fn value(input: Input) -> vec4f { return vec4f(diffuse_weight_variance(input.c.y, input.c.z, input.c.x)); }",
            domain: "sharpness 0.5 to 2, kernel 0.1 to 1e8 and infinite, beta 0.1 to 20",
            input: normals,
            expected: |row| vec![Expected::relative(diffuse_weight_variance(row[9], row[10], row[8]), 1.5e-6).non_negative()],
        },
        of_normals!("diffuse_weight", "input.a.xyz, input.b.xyz, 0.05 * input.c.y", 2e-6, |a, b, row| diffuse_weight(a, b, 0.05 * row[9])),
        Twin {
            name: "lobe_similarity::asg_similarity",
            wgsl: two_lobes!("asg_similarity", "100.0"),
            domain: "bandwidths 0, 1e-6 to 1e8 within 1e4 of each other, kernel 100; parallel to opposite",
            input: anisotropic,
            expected: |row| {
                let value = asg_similarity(&anisotropic_of(row, 0), &anisotropic_of(row, 2), 100.0);
                vec![Expected::absolute(value, anisotropic_bound(row, 100.0)).non_negative()]
            },
        },
        Twin {
            name: "lobe_similarity::asg_similarity_weight",
            wgsl: two_lobes!("asg_similarity_weight", "1e30, 20.0"),
            domain: "bandwidths 0, 1e-6 to 1e8 within 1e4 of each other, no kernel; parallel to opposite",
            input: anisotropic,
            expected: |row| {
                let value = asg_similarity_weight(&anisotropic_of(row, 0), &anisotropic_of(row, 2), INFINITE_KERNEL, BETA);
                vec![Expected::absolute(value, anisotropic_bound(row, INFINITE_KERNEL)).non_negative()]
            },
        },
    ]
}
