//! Cosine lobes, about one axis and about two.

use super::outlines::{Numbers, Row, WALK, outline, row};
use glam::DVec3;
use lobelia::{
    graph::testing::{evaluate, gpu},
    lobes::area_light::{
        axial_moment::{axial_moment, lobe_fraction, two_axis_moment},
        boundary::Boundary,
        edge_models::{EdgeModel, lobe_fraction_model},
    },
    shaders::Flags,
};
use std::f64::consts::TAU;

const WGSL: &str = "#import lobelia::axial_moment::{AxialMoment, add_moment_edge, add_power_edge, lobe_fraction, two_axis_moment}
#import lobelia::light_outline::{GreatArc, OutlineLine, OutlineWalk, great_arc, take_horizon, walk_outline}
var<private> axis: vec3f;
var<private> n: f32;
var<private> one: AxialMoment;
var<private> two: AxialMoment;
fn piece(arc: GreatArc) {
    var first = one;
    add_moment_edge(&first, arc, axis, n);
    one = first;
    var second = two;
    add_moment_edge(&second, arc, axis, n + 1.0);
    add_power_edge(&second, arc, axis, n);
    two = second;
}
struct Input { row: Row, axis: vec4f }
struct Output { values: vec4f }
fn evaluate(input: Input) -> Output {
    axis = input.axis.xyz;
    n = input.axis.w;
    walk_row(input.row);
    return Output(vec4f(lobe_fraction(one), two_axis_moment(two, axis, vec3f(0.0, 0.0, 1.0), n) * (n + 2.0) / 6.28318531, 0.0, 0.0));
}";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Input {
    row: Row,
    axis: [f32; 4],
}

/// An outline and a lobe about an axis.
pub struct Case {
    pub light: Boundary,
    pub axis: DVec3,
    pub n: f64,
    input: Input,
}

impl Case {
    /// With what the device gets rounded to 32 bits.
    pub fn new(corners: &[DVec3], axis: DVec3, n: f64) -> Self {
        let (seen, n) = (axis.as_vec3(), n as f32);
        let input = Input { row: row(corners), axis: seen.extend(n).to_array() };
        Self { light: Boundary::polygon(corners), axis: seen.as_dvec3().normalize(), n: f64::from(n), input }
    }
}

/// Exponents from 0 to 1e6, axes anywhere above the horizon, outlines from within the lobe to behind it; every eighth axis points exactly at a corner.
fn case(index: u32) -> Case {
    let mut numbers = Numbers::new(index);
    let mut axis = numbers.direction();
    axis.z = axis.z.abs();
    let n = match index % 8 {
        0 => 0.0,
        1 => numbers.between(0.0, 8.0),
        _ => 10f64.powf(numbers.between(0.0, 6.0)),
    };
    let spread = 10f64.powf(numbers.between(-2.0, 0.5));
    let corners = outline(&mut numbers, axis, spread);
    if index % 8 == 3 && corners[0].z > 0.0 {
        axis = corners[0].normalize();
    }
    // The device gets an axis that is unit but for rounding; so does the twin.
    Case::new(&corners, axis, n)
}

/// Lobe fractions about one axis and about two.
pub fn on_device(cases: &[Case], flags: &[&str]) -> Option<Vec<[f32; 4]>> {
    let inputs: Vec<Input> = cases.iter().map(|case| case.input).collect();
    let flags = flags.iter().fold(Flags::new(), |flags, flag| flags.with(flag, true));
    Some(evaluate(gpu()?, &format!("{WGSL}{WALK}"), &flags, &inputs).unwrap())
}

/// 5e-5 of the lobe in 32 bits for lights down to a thousandth of their distance, and what the rounding of directions moves it: 2^-24 sqrt(n) of its width, times a few.
fn allowed(case: &Case, model: f64) -> f64 {
    5e-5 + model + 3e-7 * case.n.sqrt()
}

/// The largest error in units of what is allowed, and how many are further off. What is not a number is infinitely far off.
pub fn misses(cases: &[Case], found: impl Iterator<Item = f64>, expected: impl Iterator<Item = f64>, model: f64) -> (f64, usize) {
    let (mut worst, mut count) = (0f64, 0);
    for (case, (found, expected)) in cases.iter().zip(found.zip(expected)) {
        let over = (found - expected).abs() / allowed(case, model);
        let over = if over.is_nan() || found < 0.0 { f64::INFINITY } else { over };
        worst = worst.max(over);
        count += usize::from(over > 1.0);
    }
    (worst, count)
}

#[test]
fn edge_models_hold_in_32_bits() {
    // Whether an edge is on one side of the switch of Owen's function or on the other may differ; there three nodes step by 2e-5, two by 2e-4, on two edges.
    // The blend of two peaks is a quotient of differences, whose rounding is a tenth of the models' own error of 1e-2.
    let models: [(EdgeModel, &[&str], f64); 6] = [
        (EdgeModel::Owen { nodes: 3 }, &[], 4e-5),
        (EdgeModel::Owen { nodes: 2 }, &["EDGE_NODES_TWO"], 4e-4),
        (EdgeModel::Owen { nodes: 4 }, &["EDGE_NODES_FOUR"], 0.0),
        (EdgeModel::Ellipsoid, &["EDGE_PEAK", "EDGE_ELLIPSOID"], 1e-3),
        (EdgeModel::LorentzianPearson, &["EDGE_PEAK"], 1e-3),
        (EdgeModel::Lorentzian, &["EDGE_PEAK", "EDGE_LORENTZIAN"], 0.0),
    ];
    let cases: Vec<Case> = (0..100_000).map(case).collect();
    for (model, flags, step) in models {
        let Some(found) = on_device(&cases, flags) else { return };
        let of = |case: &Case| lobe_fraction_model(model, &case.light, Some(DVec3::Z), case.axis, case.n);
        let (worst, count) = misses(&cases, found.iter().map(|found| f64::from(found[0])), cases.iter().map(of), step);
        assert_eq!(count, 0, "{model:?}: off by up to {worst} times what is allowed");
        // What the comparison must reject: exponents that are 1 % off.
        let other = |case: &Case| lobe_fraction_model(model, &case.light, Some(DVec3::Z), case.axis, 1.01 * case.n);
        let wrong = misses(&cases, found.iter().map(|found| f64::from(found[0])), cases.iter().map(other), step);
        assert!(wrong.1 > cases.len() / 50, "{model:?}: only {} of {} see the wrong exponent", wrong.1, cases.len());
    }
}

#[test]
fn moments_are_those_of_the_exact_forms() {
    let cases: Vec<Case> = (0..4_000).map(case).collect();
    let Some(found) = on_device(&cases, &[]) else { return };
    let one = |case: &Case| lobe_fraction(axial_moment(&case.light, Some(DVec3::Z), case.axis, case.n), case.n);
    // The model's own error, at most 3.9e-5 for an edge, twice.
    let (worst, count) = misses(&cases, found.iter().map(|found| f64::from(found[0])), cases.iter().map(one), 8e-5);
    assert_eq!(count, 0, "one axis: off by up to {worst} times what is allowed");
    let two = |case: &Case| (case.n + 2.0) / TAU * two_axis_moment(&case.light, DVec3::Z, case.axis, DVec3::Z, case.n);
    let (worst, count) = misses(&cases, found.iter().map(|found| f64::from(found[1])), cases.iter().map(two), 8e-5);
    assert_eq!(count, 0, "two axes: off by up to {worst} times what is allowed");
    let wrong = misses(&cases, found.iter().map(|found| f64::from(found[0])), cases.iter().map(two), 8e-5);
    assert!(wrong.1 > cases.len() / 10, "one axis passes for two");
}
