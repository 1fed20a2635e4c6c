//! Directions and their densities. u: 0, the largest number below 1, near both, and all between.
//!
//! A direction about an axis is held in every component: against what the axis' component may round to, and against the lobe's width. Where the axis is a
//! coordinate axis nothing but the width counts, so that a sharp lobe's samples show every digit.
//!
//! What rounding does to a function of directions depends on the place; its part of the bound is found by moving the inputs, in `f64`, by what a cosine or
//! a component is rounded ([`spread`]). A density is held at the direction as it is given.

mod brdf;

use crate::{
    draw::{Draw, direction_of, group, row},
    twin::{Expected, Row, Twin},
};
use glam::DVec3;
use lobelia_lobes::{brdf::phong_exponent, sampling::*, sg::sg_log_evaluate};
use std::f64::consts::{FRAC_PI_2, PI};

/// Rounding of a cosine, and of a component of a direction in another frame.
const COSINE: f64 = 2e-7;

/// The largest number below 1 in 32 bits.
const LAST: f64 = 1.0 - 1.0 / 16_777_216.0;

fn unit(draw: &mut Draw) -> f64 {
    let u = match draw.bits() % 16 {
        0 => 0.0,
        1 => LAST,
        2 => draw.log_between(1e-12, 0.5),
        3 => 1.0 - draw.log_between(1.0 / 16_777_216.0, 0.5),
        _ => draw.unit(),
    };
    u.min(LAST)
}

fn pair(draw: &mut Draw) -> [f64; 2] {
    [unit(draw), unit(draw)]
}

/// An angle from 0 to the horizon, both among the values.
fn view_angle(draw: &mut Draw) -> f64 {
    let angle = draw.angle();
    if angle > FRAC_PI_2 { PI - angle } else { angle }
}

/// An axis in `a` with a parameter, u in `b`.
fn lobe(index: u32, seed: u32, parameter: fn(&mut Draw) -> f64) -> Row {
    let mut draw = Draw::new(index, seed);
    let axis = draw.direction();
    let parameter = parameter(&mut draw);
    let [x, y] = pair(&mut draw);
    row([group(axis, parameter), [x, y, 0.0, 0.0], [0.0; 4], [0.0; 4]])
}

/// An axis in `a` with a parameter, a direction in `b`, half of them within a few times the width of the lobe.
fn lobe_and_direction(index: u32, seed: u32, parameter: fn(&mut Draw) -> f64, width: fn(f64) -> f64) -> Row {
    let mut draw = Draw::new(index, seed);
    let axis = draw.direction();
    let parameter = parameter(&mut draw);
    let angle = if draw.one_in(2) { draw.angle() } else { (draw.between(0.0, 4.0) * width(parameter)).min(3.0) };
    row([group(axis, parameter), group(draw.direction_at(axis, angle), 0.0), [0.0; 4], [0.0; 4]])
}

fn none(_: &mut Draw) -> f64 {
    0.0
}

fn sharpness(draw: &mut Draw) -> f64 {
    draw.sharpness()
}

fn versine(draw: &mut Draw) -> f64 {
    draw.log_between(1e-12, 2.0)
}

fn alpha(draw: &mut Draw) -> f64 {
    draw.log_between(1e-3, 1.0)
}

fn exponent(draw: &mut Draw) -> f64 {
    if draw.one_in(32) { 0.0 } else { draw.log_between(1e-3, 2e6) }
}

/// A surface: normal and alpha in `a`, view and metalness in `b`, u, base colour and specular factor in `c`, a direction to the light in `d`, half of them
/// where the reflection is.
fn surface(index: u32) -> Row {
    let mut draw = Draw::new(index, 70);
    let (n, alpha) = (draw.direction(), alpha(&mut draw));
    let angle = view_angle(&mut draw);
    let v = draw.direction_at(n, angle);
    let metallic = [0.0, 1.0, draw.unit()][draw.bits() as usize % 3];
    let specular = if draw.one_in(8) { 0.0 } else { draw.between(0.1, 1.0) };
    let [x, y] = pair(&mut draw);
    let h = draw_half_vector(&mut draw, n, alpha);
    let reflected = 2.0 * v.dot(h) * h - v;
    let l = if draw.one_in(2) { draw.direction() } else { reflected.normalize() };
    row([group(n, alpha), group(v, metallic), [x, y, draw.between(0.05, 1.0), specular], group(l, 0.0)])
}

fn draw_half_vector(draw: &mut Draw, n: DVec3, alpha: f64) -> DVec3 {
    let angle = (alpha * draw.between(0.0, 5.0)).atan();
    draw.direction_at(n, angle)
}

/// As [`surface`], with a half vector in `d`.
fn half_vector_surface(index: u32) -> Row {
    let mut row = surface(index);
    let mut draw = Draw::new(index, 71);
    let n = DVec3::from_array([0, 1, 2].map(|place| row[place].into()));
    let angle = view_angle(&mut draw);
    let h = if draw.one_in(2) { draw_half_vector(&mut draw, n, row[3].into()) } else { draw.direction_at(n, angle) };
    row[12..15].copy_from_slice(&h.to_array().map(|part| part as f32));
    row
}

fn u_of(row: &[f64; 16], group: usize) -> [f64; 2] {
    [row[4 * group], row[4 * group + 1]]
}

/// Sum of what moving single numbers of the row, each by its own amount to both sides, changes of the outputs. None where a move decides whether there are
/// any. u stays in [0, 1).
fn spread<const N: usize>(row: &[f64; 16], moves: &[(usize, f64)], f: impl Fn(&[f64; 16]) -> Option<[f64; N]>) -> Option<[f64; N]> {
    let middle = f(row);
    let mut total = [0.0f64; N];
    for (place, amount) in moves {
        let mut largest = [0.0f64; N];
        for sign in [-1.0, 1.0] {
            let mut moved = *row;
            moved[*place] += sign * amount;
            if *place == 8 {
                moved[8] = moved[8].clamp(0.0, LAST);
            }
            match (middle, f(&moved)) {
                (Some(middle), Some(other)) => {
                    for ((largest, middle), other) in largest.iter_mut().zip(middle).zip(other) {
                        *largest = largest.max((other - middle).abs());
                    }
                }
                (None, None) => {}
                _ => return None,
            }
        }
        for (total, largest) in total.iter_mut().zip(largest) {
            *total += largest;
        }
    }
    Some(total)
}

/// Moves of the directions in the given groups of a row.
fn directions(groups: &[usize]) -> Vec<(usize, f64)> {
    groups.iter().flat_map(|group| [0, 1, 2].map(|part| (4 * group + part, COSINE))).collect()
}

/// Only finite, and not negative.
fn anything() -> Expected {
    Expected::absolute(0.0, 1e38)
}

/// A density known up to a share of itself and what rounding of the directions in the given groups does to it.
fn density(row: &[f64; 16], groups: &[usize], relative: f64, f: impl Fn(&[f64; 16]) -> f64) -> Vec<Expected> {
    let mut moves = directions(groups);
    // alpha, or an exponent, or a sharpness, which formulas square or take 1 from.
    moves.push((3, 1.2e-7 * row[3]));
    let value = f(row);
    let [rounding] = spread(row, &moves, |row| Some([f(row)])).unwrap_or([f64::INFINITY]);
    vec![Expected::scaled(value, 1.0, rounding + relative * value + 1e-30).non_negative()]
}

/// A direction of which sine and cosine to `axis` are off by the given amounts. The frame's and the azimuth's vectors are off by 5e-7, all told.
fn about(axis: DVec3, direction: DVec3, cosine_error: f64, sine_error: f64) -> Vec<Expected> {
    let sine = axis.cross(direction).length();
    let part =
        |(value, axis): (f64, f64)| Expected::absolute(value, (COSINE + cosine_error) * axis.abs() + 7e-7 * sine + sine_error + 1e-30);
    direction.to_array().into_iter().zip(axis.to_array()).map(part).collect()
}

/// As [`about`], from the relative error of a versine.
fn about_versine(axis: DVec3, direction: DVec3, versine: f64, relative: f64) -> Vec<Expected> {
    let (error, sine) = (versine * relative, (versine * (2.0 - versine)).max(0.0).sqrt());
    // The slope of the root ends where it is steepest, opposite to the axis.
    about(axis, direction, error, (error / sine.max(1e-30)).min((2.0 * error).sqrt()))
}

macro_rules! twin {
    ($name:literal, $imports:literal, $value:literal, $domain:literal, $input:expr, $expected:expr) => {
        Twin {
            name: concat!("direction_sampling::", $name),
            wgsl: concat!(
                "#import lobelia::direction_sampling::{",
                $imports,
                "}\nfn value(input: Input) -> vec4f { return ",
                $value,
                "; }"
            ),
            domain: $domain,
            input: $input,
            expected: $expected,
        }
    };
}

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    let mut twins = vec![
        twin!("unit_circle", "unit_circle", "vec4f(unit_circle(input.b.x), 0.0, 0.0)", "0 to 1", |index| lobe(index, 60, none), |row| {
            // A turn of 2^-24 and more leaves sines of 4e-7 and more, which keep their digits.
            let circle = unit_circle(row[4]);
            vec![Expected::scaled(circle.x, circle.x.abs() + 1e-9, 3e-7), Expected::scaled(circle.y, circle.y.abs() + 1e-9, 3e-7)]
        }),
        twin!(
            "direction_about",
            "direction_about",
            "vec4f(direction_about(input.a.xyz, input.a.w, input.b.x), 0.0)",
            "versine 1e-12 to 2",
            |index| lobe(index, 61, versine),
            |row| about_versine(direction_of(row, 0), direction_about(direction_of(row, 0), row[3], row[4]), row[3], 1e-7)
        ),
        twin!("sample_sphere", "sample_sphere", "vec4f(sample_sphere(input.b.xy), 0.0)", "u", |index| lobe(index, 62, none), |row| {
            about(DVec3::Z, sample_sphere(u_of(row, 1)), 0.0, 0.0)
        }),
        twin!("sphere_pdf", "sphere_pdf", "vec4f(sphere_pdf())", "constant", |index| lobe(index, 62, none), |_| {
            vec![Expected::relative(sphere_pdf(), 2e-7).non_negative()]
        }),
        twin!(
            "sample_hemisphere",
            "sample_hemisphere",
            "vec4f(sample_hemisphere(input.a.xyz, input.b.xy), 0.0)",
            "u; all normals",
            |index| lobe(index, 63, none),
            |row| about_versine(direction_of(row, 0), sample_hemisphere(direction_of(row, 0), u_of(row, 1)), row[4], 1e-7)
        ),
        twin!(
            "hemisphere_pdf",
            "hemisphere_pdf",
            "vec4f(hemisphere_pdf(input.a.xyz, input.b.xyz))",
            "all angles",
            |index| lobe_and_direction(index, 63, none, |_| 1.0),
            |row| density(row, &[0, 1], 3e-7, |row| hemisphere_pdf(direction_of(row, 0), direction_of(row, 1)))
        ),
        twin!(
            "sample_cosine_hemisphere",
            "sample_cosine_hemisphere",
            "vec4f(sample_cosine_hemisphere(input.a.xyz, input.b.xy), 0.0)",
            "u; all normals",
            |index| lobe(index, 64, none),
            |row| about(direction_of(row, 0), sample_cosine_hemisphere(direction_of(row, 0), u_of(row, 1)), 0.0, 0.0)
        ),
        twin!(
            "cosine_hemisphere_pdf",
            "cosine_hemisphere_pdf",
            "vec4f(cosine_hemisphere_pdf(input.a.xyz, input.b.xyz))",
            "all angles",
            |index| lobe_and_direction(index, 64, none, |_| 1.0),
            |row| vec![Expected::absolute(cosine_hemisphere_pdf(direction_of(row, 0), direction_of(row, 1)), COSINE).non_negative()]
        ),
        twin!(
            "sample_cone",
            "sample_cone",
            "vec4f(sample_cone(input.a.xyz, input.a.w, input.b.xy), 0.0)",
            "versine 1e-12 to 2",
            |index| lobe(index, 65, versine),
            |row| about_versine(direction_of(row, 0), sample_cone(direction_of(row, 0), row[3], u_of(row, 1)), row[3] * row[4], 2e-7)
        ),
        twin!(
            "cone_pdf",
            "cone_pdf",
            "vec4f(cone_pdf(input.a.xyz, input.a.w, input.b.xyz))",
            "versine 1e-12 to 2",
            |index| lobe_and_direction(index, 65, versine, |versine| (0.5 * versine).sqrt()),
            |row| {
                // The square of the distance is rounded: on the rim, a direction may be on either side.
                let square = (direction_of(row, 1) - direction_of(row, 0)).length_squared();
                let value = cone_pdf(direction_of(row, 0), row[3], direction_of(row, 1));
                let rim = (square - 2.0 * row[3]).abs() <= 1e-6 * row[3];
                vec![if rim { anything() } else { Expected::relative(value, 5e-7) }.non_negative()]
            }
        ),
        twin!(
            "sample_sg_versine",
            "sample_sg_versine",
            "vec4f(sample_sg_versine(input.a.w, input.b.x))",
            "sharpness 0, 1e-6 to 1e8; u 0 to 1 - 2^-24",
            |index| lobe(index, 66, sharpness),
            // log_one_plus and decay_mean are good to 1e-6 each, and near 1 the logarithm to 2^-21 over its value of 0.69.
            |row| vec![Expected::relative(sample_sg_versine(row[3], row[4]), 2e-6).non_negative()]
        ),
        twin!(
            "sample_sg",
            "sample_sg",
            "vec4f(sample_sg(input.a.xyz, input.a.w, input.b.xy), 0.0)",
            "sharpness 0, 1e-6 to 1e8",
            |index| lobe(index, 66, sharpness),
            |row| {
                let direction = sample_sg(direction_of(row, 0), row[3], u_of(row, 1));
                about_versine(direction_of(row, 0), direction, sample_sg_versine(row[3], row[4]), 2e-6)
            }
        ),
        twin!(
            "sg_pdf",
            "sg_pdf",
            "vec4f(sg_pdf(input.a.xyz, input.a.w, input.b.xyz))",
            "sharpness 0, 1e-6 to 1e8; all angles",
            |index| lobe_and_direction(index, 67, sharpness, |sharpness| 1.0 / (sharpness + 0.1).sqrt()),
            |row| {
                // That of sg_evaluate, and another 1.5e-6 of the integral; values of the lobe below 1e-30 count as 0.
                let log = sg_log_evaluate(direction_of(row, 0), row[3], direction_of(row, 1));
                let value = sg_pdf(direction_of(row, 0), row[3], direction_of(row, 1));
                let peak = sg_pdf(direction_of(row, 0), row[3], direction_of(row, 0));
                vec![Expected::scaled(value, value.max(1e-30 * peak), 3.5e-6 - 3e-7 * log).non_negative()]
            }
        ),
        twin!(
            "sample_phong_half_vector",
            "sample_phong_half_vector",
            "vec4f(sample_phong_half_vector(input.a.w, input.a.xyz, input.b.xy), 0.0)",
            "exponent 0, 1e-3 to 2e6",
            |index| lobe(index, 68, exponent),
            |row| {
                let direction = sample_phong_half_vector(row[3], direction_of(row, 0), u_of(row, 1));
                let versine = -((-row[4]).ln_1p() / (row[3] + 2.0)).exp_m1();
                about_versine(direction_of(row, 0), direction, versine, 2e-6)
            }
        ),
        twin!(
            "phong_half_vector_pdf",
            "phong_half_vector_pdf",
            "vec4f(phong_half_vector_pdf(input.a.w, input.a.xyz, input.b.xyz))",
            "exponent 0, 1e-3 to 2e6; all angles",
            |index| lobe_and_direction(index, 68, exponent, |exponent| 1.0 / (exponent + 1.0).sqrt()),
            |row| {
                let pdf = |row: &[f64; 16]| phong_half_vector_pdf(row[3], direction_of(row, 0), direction_of(row, 1));
                // The exponent of the value is rounded, and `exp` errs in proportion to it.
                let x = ((row[3] + 2.0) / (2.0 * PI) / pdf(row).max(1e-300)).ln();
                density(row, &[0, 1], 3e-6 + 1e-6 * x, pdf)
            }
        ),
        twin!(
            "sample_ggx_half_vector",
            "sample_ggx_half_vector",
            "vec4f(sample_ggx_half_vector(input.a.w, input.a.xyz, input.b.xy), 0.0)",
            "alpha 0.001 to 1",
            |index| lobe(index, 69, alpha),
            |row| {
                // Sine and cosine are products of rounded roots: half a dozen roundings.
                let (n, h) = (direction_of(row, 0), sample_ggx_half_vector(row[3], direction_of(row, 0), u_of(row, 1)));
                about(n, h, 3e-7, 3e-7 * n.cross(h).length())
            }
        ),
        twin!(
            "ggx_half_vector_pdf",
            "ggx_half_vector_pdf",
            "vec4f(ggx_half_vector_pdf(input.a.w, input.a.xyz, input.b.xyz))",
            "alpha 0.001 to 1; all angles",
            |index| lobe_and_direction(index, 69, alpha, |alpha| alpha),
            |row| density(row, &[0, 1], 2e-6, |row| ggx_half_vector_pdf(row[3], direction_of(row, 0), direction_of(row, 1)))
        ),
        twin!(
            "sample_ggx_visible_normal",
            "sample_ggx_visible_normal",
            "vec4f(sample_ggx_visible_normal(input.a.w, input.a.xyz, input.b.xyz, input.c.xy), 0.0)",
            "alpha 0.001 to 1; views down to the horizon",
            surface,
            |row| {
                let (n, v, u) = (direction_of(row, 0), direction_of(row, 1), u_of(row, 2));
                let sample = |row: &[f64; 16]| {
                    Some(sample_ggx_visible_normal(row[3], direction_of(row, 0), direction_of(row, 1), u_of(row, 2)).to_array())
                };
                let rounding = spread(row, &directions(&[1]), sample).unwrap_or_default();
                let h = sample_ggx_visible_normal(row[3], n, v, u);
                // Of the sum of the cap's point and the view, both of them rounded: what is across, times alpha, over the length.
                let along = n.dot(v).max(0.0);
                let height = (1.0 - u[0]) * (1.0 + along / along.hypot(row[3] * n.cross(v).length()));
                let turned = 1e-6 * row[3] * n.dot(h) / height;
                // Normalising a vector takes a quotient, a root and their product, which its length shows.
                let mut expected = about(n, h, turned + 2e-7, turned + 2e-7);
                for (expected, rounding) in expected.iter_mut().zip(rounding) {
                    expected.bound += rounding;
                }
                expected
            }
        ),
        twin!(
            "ggx_visible_normal_pdf",
            "ggx_visible_normal_pdf",
            "vec4f(ggx_visible_normal_pdf(input.a.w, input.a.xyz, input.b.xyz, input.d.xyz))",
            "alpha 0.001 to 1; views down to the horizon",
            half_vector_surface,
            |row| density(row, &[0, 1, 3], 3e-6, |row| {
                ggx_visible_normal_pdf(row[3], direction_of(row, 0), direction_of(row, 1), direction_of(row, 3))
            })
        ),
        twin!(
            "ggx_reflection_pdf",
            "ggx_reflection_pdf",
            "vec4f(ggx_reflection_pdf(input.a.w, input.a.xyz, input.b.xyz, input.d.xyz))",
            "alpha 0.001 to 1; views down to the horizon",
            surface,
            |row| density(row, &[0, 1, 3], 3e-6, |row| {
                ggx_reflection_pdf(row[3], direction_of(row, 0), direction_of(row, 1), direction_of(row, 3))
            })
        ),
        twin!(
            "phong_reflection_pdf",
            "phong_reflection_pdf",
            "vec4f(phong_reflection_pdf(input.a.w, input.a.xyz, input.b.xyz, input.d.xyz))",
            "alpha 0.001 to 1; views down to the horizon",
            surface,
            |row| {
                let pdf = |row: &[f64; 16]| phong_reflection_pdf(row[3], direction_of(row, 0), direction_of(row, 1), direction_of(row, 3));
                let x = ((0.5 * phong_exponent(row[3]) + 1.0) / PI / pdf(row).max(1e-300)).ln().abs();
                density(row, &[0, 1, 3], 3e-6 + 1e-6 * x, pdf)
            }
        ),
    ];
    twins.extend(brdf::twins());
    twins
}
