//! SGs and their building blocks. Bounds: what 32-bit arithmetic and the errors that the language allows `exp` and `log` leave of the stable forms
//! (relative, x: exponent of the value).

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use lobelia_lobes::{sg::*, special::*};

/// A number of [0, 1e8] in `a.x`.
fn sharpness(index: u32) -> Row {
    row([[Draw::new(index, 1).sharpness(), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// A number of either sign in `a.x`, at most 80.
fn signed(index: u32) -> Row {
    let mut draw = Draw::new(index, 2);
    let x = draw.log_between(1e-30, 80.0);
    row([[if draw.one_in(2) { x } else { -x }, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]])
}

/// Two axes and two sharpnesses in `a` and `b`.
pub(super) fn pair(index: u32) -> Row {
    let mut draw = Draw::new(index, 3);
    let a = draw.direction();
    let b = match draw.bits() % 16 {
        0 => a,
        1 => -a,
        _ => draw.direction_near(a),
    };
    let (left, right) = (draw.sharpness(), draw.sharpness());
    // Equal lobes too, which can cancel.
    row([group(a, left), group(b, if draw.one_in(4) { left } else { right }), [0.0; 4], [0.0; 4]])
}

/// As [`pair`], with at least one lobe that is not constant.
fn pair_not_flat(index: u32) -> Row {
    let mut row = pair(index);
    if row[3] + row[7] < 1e-6 {
        row[7] = 1e-6;
    }
    row
}

/// An axis and sharpness in `a`, a direction in `b`, half of them where the lobe is.
fn lobe_and_direction(index: u32) -> Row {
    let mut draw = Draw::new(index, 4);
    let axis = draw.direction();
    let sharpness = draw.sharpness();
    let angle = if draw.one_in(2) { draw.angle() } else { (draw.between(0.0, 6.0) / sharpness.max(0.1).sqrt()).min(3.0) };
    row([group(axis, sharpness), group(draw.direction_at(axis, angle), 0.0), [0.0; 4], [0.0; 4]])
}

macro_rules! scalar {
    ($name:literal, $domain:literal, $input:expr, $expected:expr) => {
        Twin {
            name: concat!("math::", $name),
            wgsl: concat!("#import lobelia::math::", $name, "\nfn value(input: Input) -> vec4f { return vec4f(", $name, "(input.a.x)); }"),
            domain: $domain,
            input: $input,
            expected: $expected,
        }
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![
        scalar!("exp_minus_one", "|x| <= 80", signed, |row| vec![Expected::relative(exp_minus_one(row[0]), 5e-7 + 3e-7 * row[0].abs())]),
        scalar!(
            "log_one_plus",
            "x >= -0.9999",
            |index| row([[signed(index)[0].max(-0.9999).into(), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]]),
            |row| {
                // 2^-21 is what `log` may be off between 1/2 and 2; 3 units in the last place elsewhere.
                let value = log_one_plus(row[0]);
                vec![Expected::relative(value, 6e-7 + if row[0].abs() < 0.5 { 0.0 } else { 4.8e-7 / value.abs() })]
            }
        ),
        scalar!("decay_mean", "x in [0, 1e8]", sharpness, |row| vec![Expected::relative(decay_mean(row[0]), 1.5e-6).non_negative()]),
        scalar!("decay_mean_upper", "x in [0, 1e8]", sharpness, |row| vec![
            Expected::relative(decay_mean_upper(row[0]), 1.5e-6).non_negative()
        ]),
        scalar!("decay_mean_lower", "x in [0, 1e8]", sharpness, |row| {
            vec![Expected::relative(decay_mean_lower(row[0]), 1.5e-6 + 3e-7 * row[0]).non_negative()]
        }),
        scalar!("erf", "|x| <= 80", signed, |row| vec![Expected::relative(erf(row[0]), 1e-6)]),
        scalar!("erf_mean", "x in [0, 1e8]", sharpness, |row| vec![Expected::relative(erf_mean(row[0]), 1e-6).non_negative()]),
        // The exponent -x^2 is rounded: a unit in its last place is 6e-8 x^2, and `exp` may add 3e-7 x^2.
        scalar!("erfc", "|x| <= 80", signed, |row| {
            let x = row[0].max(0.0);
            vec![Expected::relative(erfc(row[0]), 1e-6 + 4e-7 * x * x).non_negative()]
        }),
        Twin {
            name: "sg::sg_evaluate",
            wgsl: "#import lobelia::sg::sg_evaluate
fn value(input: Input) -> vec4f { return vec4f(sg_evaluate(input.a.xyz, input.a.w, input.b.xyz)); }",
            domain: "sharpness 0, 1e-6 to 1e8; all angles",
            input: lobe_and_direction,
            expected: |row| {
                let log = sg_log_evaluate(direction_of(row, 0), row[3], direction_of(row, 1));
                vec![Expected::relative(log.exp(), 2e-6 - 3e-7 * log).non_negative()]
            },
        },
        Twin {
            name: "sg::sg_normalized, sg_value",
            wgsl: "#import lobelia::sg::{sg_normalized, sg_value}
fn value(input: Input) -> vec4f { return vec4f(sg_value(sg_normalized(input.a.xyz, input.a.w), input.b.xyz)); }",
            domain: "sharpness 0, 1e-6 to 1e8; all angles",
            input: lobe_and_direction,
            expected: |row| {
                let lobe = SphericalGaussian::normalized(direction_of(row, 0), row[3]);
                let log = sg_log_evaluate(lobe.axis, lobe.sharpness, direction_of(row, 1));
                // Values of the lobe itself below 1e-30 count as 0.
                let value = lobe.evaluate(direction_of(row, 1));
                vec![Expected::scaled(value, value.max(1e-30 * lobe.amplitude), 3e-6 - 3e-7 * log).non_negative()]
            },
        },
        Twin {
            name: "sg::sg_integral",
            wgsl: "#import lobelia::sg::sg_integral\nfn value(input: Input) -> vec4f { return vec4f(sg_integral(input.a.x)); }",
            domain: "sharpness 0, 1e-6 to 1e8",
            input: sharpness,
            expected: |row| vec![Expected::relative(sg_integral(row[0]), 1.5e-6).non_negative()],
        },
        Twin {
            name: "sg::sg_integral_fast",
            wgsl: "#import lobelia::sg::sg_integral_fast\nfn value(input: Input) -> vec4f { return vec4f(sg_integral_fast(input.a.x)); }",
            domain: "sharpness 1e-6 to 1e8",
            input: |index| row([[Draw::new(index, 5).log_between(1e-6, 1e8), 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4], [0.0; 4]]),
            expected: |row| vec![Expected::relative(sg_integral_fast(row[0]), 5e-7).non_negative()],
        },
        Twin {
            name: "sg::sg_product (log amplitude, sharpness)",
            wgsl: "#import lobelia::sg::sg_product
fn value(input: Input) -> vec4f {
    let product = sg_product(input.a.xyz, input.a.w, input.b.xyz, input.b.w);
    return vec4f(product.log_amplitude, product.sharpness, 0.0, 0.0);
}",
            domain: "both sharpnesses 0, 1e-6 to 1e8; parallel to opposite",
            input: pair,
            expected: |row| {
                let product = sg_product(direction_of(row, 0), row[3], direction_of(row, 1), row[7]);
                vec![
                    Expected::absolute(product.log_amplitude, 2e-6 + 5e-7 * product.log_amplitude.abs()),
                    Expected::scaled(product.sharpness, row[3] + row[7], 1.5e-6).non_negative(),
                ]
            },
        },
        Twin {
            name: "sg::sg_product (axis)",
            wgsl: "#import lobelia::sg::sg_product
fn value(input: Input) -> vec4f { return vec4f(sg_product(input.a.xyz, input.a.w, input.b.xyz, input.b.w).axis, 0.0); }",
            domain: "both sharpnesses 0, 1e-6 to 1e8; parallel to opposite",
            input: pair,
            expected: |row| {
                let product = sg_product(direction_of(row, 0), row[3], direction_of(row, 1), row[7]);
                // Where opposite lobes nearly cancel, what is left of their sum carries the rounding of both.
                let sum = row[3] + row[7];
                let scale = if product.sharpness > 0.0 { sum / product.sharpness } else { 1.0 };
                product.axis.to_array().map(|part| Expected::scaled(part, scale, 5e-7)).to_vec()
            },
        },
        Twin {
            name: "sg::sg_product_integral",
            wgsl: "#import lobelia::sg::sg_product_integral
fn value(input: Input) -> vec4f { return vec4f(sg_product_integral(input.a.xyz, input.a.w, input.b.xyz, input.b.w)); }",
            domain: "both sharpnesses 0, 1e-6 to 1e8; parallel to opposite",
            input: pair,
            expected: |row| {
                let product = sg_product(direction_of(row, 0), row[3], direction_of(row, 1), row[7]);
                vec![Expected::relative(product.integral(), 2e-6 + 5e-7 * product.log_amplitude.abs()).non_negative()]
            },
        },
        Twin {
            name: "sg::log_sg_product_integral",
            wgsl: "#import lobelia::sg::log_sg_product_integral
fn value(input: Input) -> vec4f { return vec4f(log_sg_product_integral(input.a.xyz, input.a.w, input.b.xyz, input.b.w)); }",
            domain: "both sharpnesses 0, 1e-6 to 1e8; parallel to opposite",
            input: pair,
            expected: |row| {
                let log = log_sg_product_integral(direction_of(row, 0), row[3], direction_of(row, 1), row[7]);
                vec![Expected::absolute(log, 2e-6 + 5e-7 * log.abs())]
            },
        },
        Twin {
            name: "sg::sg_product_integral_fast",
            wgsl: "#import lobelia::sg::sg_product_integral_fast
fn value(input: Input) -> vec4f { return vec4f(sg_product_integral_fast(input.a.xyz, input.a.w, input.b.xyz, input.b.w)); }",
            domain: "sum of sharpnesses 1e-6 to 2e8; parallel to opposite",
            input: pair_not_flat,
            expected: |row| {
                let (a, b) = (direction_of(row, 0), direction_of(row, 1));
                let value = sg_product_integral_fast(a, row[3], b, row[7]);
                let exponent = 0.5 * row[3] * (row[7] / (row[3] + row[7])) * (a - b).length_squared();
                vec![Expected::relative(value, 2e-6 + 5e-7 * exponent).non_negative()]
            },
        },
    ]
}
