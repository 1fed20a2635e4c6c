//! Microfacet lobes and Lambert's formula.

use super::outlines::{Numbers, Row, WALK, outline, row};
use glam::DVec3;
use lobelia::{
    graph::testing::{compare, evaluate, gpu},
    lobes::area_light::{
        boundary::Boundary,
        half_vector::{HalfVectorIntegral, half_vector_integral},
        lambert::irradiance,
        radial_primitive::Microfacets,
    },
    shaders::Flags,
};

const WGSL: &str = "#import lobelia::half_vector_integral::{HalfVectorSum, add_half_vector_edge}
#import lobelia::light_outline::{GreatArc, OutlineLine, OutlineWalk, great_arc, lambert_edge, take_horizon, walk_outline}
var<private> viewer: vec3f;
var<private> alpha: f32;
var<private> whole: f32;
var<private> mean: vec3f;
var<private> cosine: f32;
fn piece(arc: GreatArc) {
    var sum: HalfVectorSum;
    add_half_vector_edge(&sum, arc, viewer, alpha);
    whole += sum.whole;
    mean += sum.mean;
    cosine += lambert_edge(arc);
}
struct Input { row: Row, viewer: vec4f }
struct Output { sums: vec4f, cosine: vec4f }
fn evaluate(input: Input) -> Output {
    viewer = input.viewer.xyz;
    alpha = input.viewer.w;
    walk_row(input.row);
    return Output(vec4f(mean, whole), vec4f(cosine, 0.0, 0.0, 0.0));
}";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Input {
    row: Row,
    viewer: [f32; 4],
}

/// An outline, a viewer in the half plane y = 0, x >= 0, and a surface.
pub struct Case {
    pub light: Boundary,
    pub view: DVec3,
    pub alpha: f64,
    input: Input,
}

/// Lights around the mirror direction, from within the lobe to far outside it and below the horizon; views up to 89.9 degrees; alpha from 0.001.
fn case(index: u32) -> Case {
    let mut numbers = Numbers::new(index);
    let angle = match index % 4 {
        0 => numbers.between(0.0, 70f64.to_radians()),
        1 => 85f64.to_radians(),
        _ => numbers.between(0.0, 89.9f64.to_radians()),
    };
    let view = DVec3::new(angle.sin(), 0.0, angle.cos()).as_vec3().as_dvec3();
    let alpha = f64::from(10f64.powf(numbers.between(-3.0, 0.0)) as f32);
    let spread = 10f64.powf(numbers.between(-2.0, 0.5));
    let corners = outline(&mut numbers, DVec3::new(-view.x, 0.0, view.z), spread);
    Case::new(&corners, view, alpha)
}

impl Case {
    /// With what the device gets rounded to 32 bits.
    pub fn new(corners: &[DVec3], view: DVec3, alpha: f64) -> Self {
        let input = Input { row: row(corners), viewer: [view.x as f32, 0.0, view.z as f32, alpha as f32] };
        Self { light: Boundary::polygon(corners), view, alpha, input }
    }
}

pub fn microfacets(alpha: f64, flag: &str) -> Microfacets {
    match flag {
        "NDF_BECKMANN" => Microfacets::Beckmann { m: alpha },
        _ => Microfacets::Blinn { n: (2.0 / (alpha * alpha) - 2.0).max(0.0) },
    }
}

/// Lobes and irradiance.
pub fn on_device(cases: &[Case], flags: &Flags) -> Option<Vec<(HalfVectorIntegral, f64)>> {
    let inputs: Vec<Input> = cases.iter().map(|case| case.input).collect();
    let found: Vec<[[f32; 4]; 2]> = evaluate(gpu()?, &format!("{WGSL}{WALK}"), flags, &inputs).unwrap();
    let read = |[sums, cosine]: &[[f32; 4]; 2]| {
        let [x, y, z, whole] = sums.map(f64::from);
        (HalfVectorIntegral { whole, mean: DVec3::new(x, y, z) }, f64::from(cosine[0]))
    };
    Some(found.iter().map(read).collect())
}

/// Rounding of directions to 32 bits turns half vectors by 2^-24 over their length, which is about twice the cosine of the view at grazing angles; relative to the
/// lobe's width that is the error, times a few for the sums. Beyond 85 degrees the search for the nearest half vector may end elsewhere.
pub fn allowed(case: &Case, rounding: f64) -> f64 {
    let steep = if case.view.z > 0.08 { 10.0 } else { 40.0 };
    rounding + steep * 2f64.powi(-24) / (case.alpha * case.view.z)
}

/// How many of the values are further off than allowed, and the largest error in units of what is allowed. What is not a number is infinitely far off.
fn misses(cases: &[Case], rounding: f64, pairs: impl Iterator<Item = (f64, f64)>) -> (usize, f64) {
    let excess: Vec<f64> = cases
        .iter()
        .zip(pairs)
        .map(|(case, (found, expected))| {
            let over = (found - expected).abs() / allowed(case, rounding);
            if over.is_nan() { f64::INFINITY } else { over }
        })
        .collect();
    (excess.iter().filter(|over| **over > 1.0).count(), excess.iter().fold(0.0, |most, over| over.max(most)))
}

#[test]
fn microfacet_lobes_hold_in_32_bits() {
    for (flag, count) in [("", 100_000), ("NDF_BECKMANN", 20_000)] {
        let cases: Vec<Case> = (0..count).map(case).collect();
        let flags = if flag.is_empty() { Flags::new() } else { Flags::new().with(flag, true) };
        let Some(found) = on_device(&cases, &flags) else { return };
        // The same quadrature in 64 bits.
        let of = |case: &Case, alpha: f64| half_vector_integral(&case.light, DVec3::Z, case.view, microfacets(alpha, flag), 3);
        let twins: Vec<HalfVectorIntegral> = cases.iter().map(|case| of(case, case.alpha)).collect();
        let pairs = || found.iter().zip(&twins);
        let whole = misses(&cases, 2e-6, pairs().map(|((found, _), twin)| (found.whole, twin.whole)));
        assert_eq!(whole.0, 0, "{flag}: the integral is off by up to {} times what is allowed", whole.1);
        let along = misses(&cases, 2e-6, pairs().map(|((found, _), twin)| (found.mean.z, twin.mean.z)));
        assert_eq!(along.0, 0, "{flag}: the mean half vector along the normal, by {}", along.1);
        if flag == "NDF_BECKMANN" {
            // That of Blinn's distribution is a fit.
            for axis in [0, 1] {
                // Series of 5e-6.
                let across = misses(&cases, 7e-6, pairs().map(|((found, _), twin)| (found.mean[axis], twin.mean[axis])));
                assert_eq!(across.0, 0, "{flag}: the mean half vector across, by {}", across.1);
            }
        }
        // What the comparison must reject: a lobe that is 1 % narrower.
        let others: Vec<HalfVectorIntegral> = cases.iter().map(|case| of(case, 0.99 * case.alpha)).collect();
        let wrong = misses(&cases, 2e-6, found.iter().zip(&others).map(|((found, _), twin)| (found.whole, twin.whole)));
        assert!(wrong.0 > cases.len() / 4, "{flag}: only {} of {} see that the lobe is narrower", wrong.0, cases.len());
    }
}

/// Irradiance, at most pi, to 5e-6, whatever the light's size and place.
#[test]
fn irradiance_holds_in_32_bits() {
    let cases: Vec<Case> = (0..100_000).map(case).collect();
    let Some(found) = on_device(&cases, &Flags::new()) else { return };
    let expected: Vec<f64> = cases.iter().map(|case| irradiance(&case.light, DVec3::Z)).collect();
    let found: Vec<f64> = found.iter().map(|(_, cosine)| *cosine).collect();
    compare(&expected, &found, 0.0, 5e-6).unwrap();
    let tilted: Vec<f64> = cases.iter().map(|case| irradiance(&case.light, DVec3::new(1e-4, 0.0, 1.0).normalize())).collect();
    assert!(compare(&tilted, &found, 0.0, 5e-6).is_err(), "a normal that is off by 1e-4 must not pass");
}
