//! Cosine lobes. x: exponent of the value.

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use lobelia_lobes::cosine_lobe::*;

/// Exponent, log-uniform with 0, both ends of [1e-3, 1e8], and whole numbers.
fn exponent(draw: &mut Draw) -> f64 {
    match draw.bits() % 16 {
        0 => 0.0,
        1 => 1.0,
        2 => draw.between(0.0, 1e3).round(),
        _ => draw.log_between(1e-3, 1e8),
    }
}

fn exponents(index: u32) -> Row {
    row([[exponent(&mut Draw::new(index, 30)), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// Two axes with exponents in `a` and `b`, a direction in `c`.
fn two_lobes(index: u32) -> Row {
    let mut draw = Draw::new(index, 31);
    let axis = draw.direction();
    let (n, m) = (exponent(&mut draw), exponent(&mut draw));
    let near = if draw.one_in(2) { draw.angle() } else { (draw.between(0.0, 6.0) / (n + 0.5).sqrt()).min(3.1) };
    let other = draw.direction_near(axis);
    row([group(axis, n), group(other, m), group(draw.direction_at(axis, near), 0.0), [0.0; 4]])
}

/// -d log cos: what an error of the versine by its last place does to a value, times the exponent.
fn sensitivity(cosine: f64, exponent: f64) -> f64 {
    exponent * 2e-7 * (1.0 - cosine) / cosine.max(1e-7)
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        Twin {
            name: "cosine_lobe::cosine_lobe_evaluate",
            wgsl: "#import lobelia::cosine_lobe::cosine_lobe_evaluate
fn value(input: Input) -> vec4f { return vec4f(cosine_lobe_evaluate(input.a.xyz, input.a.w, input.c.xyz)); }",
            domain: "exponent 0, 1e-3 to 1e8; all directions",
            input: two_lobes,
            expected: |row| {
                let (axis, direction, exponent) = (direction_of(row, 0), direction_of(row, 2), row[3]);
                let value = cosine_lobe_evaluate(axis, exponent, direction);
                let cosine = 1.0 - 0.5 * (direction - axis).length_squared();
                // On the horizon rounding decides on which side a direction is.
                let edge = if cosine.abs() < 4e-7 { 4e-7f64.powf(exponent) } else { 0.0 };
                let log = -value.max(1e-38).ln();
                let bound = 2e-6 + 8e-7 * log + sensitivity(cosine, exponent);
                vec![Expected::scaled(value, value.max(1e-30) + edge / 1e-6, bound).non_negative()]
            },
        },
        Twin {
            name: "cosine_lobe::cosine_lobe_normalized, cosine_lobe_integral",
            wgsl: "#import lobelia::cosine_lobe::{cosine_lobe_integral, cosine_lobe_normalized}
fn value(input: Input) -> vec4f {
    return vec4f(cosine_lobe_integral(input.a.x), cosine_lobe_normalized(vec3f(0.0, 0.0, 1.0), input.a.x).amplitude, 0.0, 0.0);
}",
            domain: "exponent 0, 1e-3 to 1e8",
            input: exponents,
            expected: |row| {
                let lobe = CosineLobe::normalized(glam::DVec3::Z, row[0]);
                vec![
                    Expected::relative(cosine_lobe_integral(row[0]), 5e-7).non_negative(),
                    Expected::relative(lobe.amplitude, 5e-7).non_negative(),
                ]
            },
        },
        Twin {
            name: "cosine_lobe::cosine_lobe_sharpness",
            wgsl: "#import lobelia::cosine_lobe::cosine_lobe_sharpness\nfn value(input: Input) -> vec4f { return vec4f(cosine_lobe_sharpness(input.a.x)); }",
            domain: "exponent 0, 1e-3 to 1e8",
            input: exponents,
            expected: |row| vec![Expected::relative(cosine_lobe_sharpness(row[0]), 5e-7).non_negative()],
        },
        Twin {
            name: "cosine_lobe::cosine_lobe_sharpness_half_maximum",
            wgsl: "#import lobelia::cosine_lobe::cosine_lobe_sharpness_half_maximum
fn value(input: Input) -> vec4f { return vec4f(cosine_lobe_sharpness_half_maximum(input.a.x)); }",
            domain: "exponent 0, 1e-3 to 1e8",
            input: exponents,
            expected: |row| vec![Expected::relative(cosine_lobe_sharpness_half_maximum(row[0]), 2e-6).non_negative()],
        },
        Twin {
            name: "cosine_lobe::cosine_lobe_exponent_half_maximum",
            wgsl: "#import lobelia::cosine_lobe::cosine_lobe_exponent_half_maximum
fn value(input: Input) -> vec4f { return vec4f(cosine_lobe_exponent_half_maximum(input.a.x)); }",
            domain: "sharpness 0, 1e-6 to 1e8",
            input: |index| row([[Draw::new(index, 32).sharpness(), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]]),
            expected: |row| {
                // Just above ln 2 the exponent is the reciprocal of a logarithm of what rounding leaves of 1 - ln 2 / sharpness.
                let value = cosine_lobe_exponent_half_maximum(row[0]);
                let left = (1.0 - std::f64::consts::LN_2 / row[0]).max(1e-7);
                vec![Expected::scaled(value, value.max(0.05), 2e-6 + 2e-7 / left).non_negative()]
            },
        },
        Twin {
            name: "cosine_lobe::cosine_lobe_product (axis, exponent)",
            wgsl: "#import lobelia::cosine_lobe::{CosineLobe, cosine_lobe_product}
fn value(input: Input) -> vec4f {
    let product = cosine_lobe_product(CosineLobe(input.a.xyz, input.a.w, 1.0), CosineLobe(input.b.xyz, input.b.w, 1.0));
    return vec4f(product.axis, product.exponent);
}",
            domain: "both exponents 0, 1e-3 to 1e8; parallel to opposite",
            input: two_lobes,
            expected: |row| {
                let product = product(row);
                let sharpness = cosine_lobe_sharpness_half_maximum;
                let sum = sharpness(row[3]) + sharpness(row[7]);
                let length = (direction_of(row, 0) * sharpness(row[3]) + direction_of(row, 1) * sharpness(row[7])).length();
                let turn = sum / length.max(1e-30);
                let left = (1.0 - std::f64::consts::LN_2 / length).max(1e-7);
                let axis = product.axis.to_array().map(|part| Expected::scaled(part, turn, 2e-6));
                let exponent = Expected::scaled(product.exponent, sum + 0.05, 2e-6 + 2e-7 / left);
                axis.into_iter().chain([exponent.non_negative()]).collect()
            },
        },
    ]
}

fn product(row: &[f64; 16]) -> CosineLobe {
    let lobe = |at: usize| CosineLobe { axis: direction_of(row, at), exponent: row[4 * at + 3], amplitude: 1.0 };
    cosine_lobe_product(&lobe(0), &lobe(1))
}
