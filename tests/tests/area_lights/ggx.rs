//! GGX over half vectors as vector irradiance: polygons and round lights, one alpha and two.

use super::outlines::{Numbers, Row, WALK, outline, row};
use glam::{DVec2, DVec3};
use lobelia::{
    graph::testing::{evaluate, gpu},
    lobes::{
        anisotropic_ggx::stretch,
        area_light::{
            boundary::{Boundary, Ellipse, Piece},
            circular_arc::{CircularArc, arcs_of},
            ggx_half_vector::{Fineness, ggx_half_vector_mean},
            lambert::{irradiance, irradiance_of_sphere},
            round::{Silhouette, ellipsoid, sphere},
        },
    },
    shaders::Flags,
};
use std::f64::consts::PI;

const POLYGONS: &str = "#import lobelia::circular_arc::{arc_of_great_circle, irradiance_along}
#import lobelia::ggx_half_vector::{add_ggx_arc, ggx_mean}
#import lobelia::light_outline::{GreatArc, OutlineLine, OutlineWalk, great_arc, take_horizon, walk_outline}
var<private> viewer: vec3f;
var<private> stretch: vec3f;
var<private> sum: vec3f;
var<private> cosine: f32;
fn piece(arc: GreatArc) {
    var ggx = sum;
    add_ggx_arc(&ggx, arc_of_great_circle(arc), viewer, stretch);
    sum = ggx;
    cosine += irradiance_along(arc_of_great_circle(arc));
}
struct Input { row: Row, viewer: vec4f, stretch: vec4f }
struct Output { mean: vec4f }
fn evaluate(input: Input) -> Output {
    viewer = input.viewer.xyz;
    stretch = vec3f(input.stretch.xy, input.viewer.w);
    walk_row(input.row);
    return Output(vec4f(ggx_mean(sum, stretch), cosine));
}";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct PolygonInput {
    row: Row,
    viewer: [f32; 4],
    stretch: [f32; 4],
}

const ROUND: &str = "#import lobelia::circular_arc::{irradiance_along, rim_arc, rim_arc_count}
#import lobelia::ggx_half_vector::{add_ggx_arc, ggx_mean}
#import lobelia::light_outline::{rim_of_disk, visible_rim}
struct Input { center: vec4f, a: vec4f, b: vec4f, viewer: vec4f, stretch: vec4f }
struct Output { mean: vec4f }
fn evaluate(input: Input) -> Output {
    let rim = rim_of_disk(input.center.xyz, input.a.xyz, input.b.xyz);
    let stretch = vec3f(input.stretch.xy, input.viewer.w);
    let visible = visible_rim(rim);
    let count = u32(input.center.w);
    var sum = vec3f(0.0);
    var cosine = 0.0;
    for (var place = 0u; place < rim_arc_count(visible, count); place++) {
        let arc = rim_arc(rim, visible, place, count);
        add_ggx_arc(&sum, arc, input.viewer.xyz, stretch);
        cosine += irradiance_along(arc);
    }
    return Output(vec4f(ggx_mean(sum, stretch), cosine));
}";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct RoundInput {
    center: [f32; 4],
    a: [f32; 4],
    b: [f32; 4],
    viewer: [f32; 4],
    stretch: [f32; 4],
}

struct Case<Input> {
    light: Boundary,
    view: DVec3,
    alpha: f64,
    stretch: DVec2,
    input: Input,
}

/// Viewers of all azimuths, each fourth one up to the horizon, and the rest up to 85 degrees; alphas from 0.001 to 1; anisotropy up to 0.95 either way if asked for.
struct Surface {
    view: DVec3,
    alpha: f64,
    stretch: DVec2,
}

fn surface(numbers: &mut Numbers, index: u32, anisotropic: bool) -> Surface {
    let steepest = if index.is_multiple_of(4) { 89.9f64 } else { 85.0 };
    let (angle, azimuth) = (numbers.between(0.0, steepest.to_radians()), numbers.between(0.0, std::f64::consts::TAU));
    let view = DVec3::new(angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin(), angle.cos()).as_vec3();
    let alpha = f64::from(10f64.powf(numbers.between(-3.0, 0.0)) as f32);
    let anisotropy = if anisotropic { numbers.between(-0.95, 0.95) } else { 0.0 };
    Surface { view: view.as_dvec3().normalize(), alpha, stretch: stretch(anisotropy).as_vec2().as_dvec2() }
}

fn polygon_case(index: u32, anisotropic: bool) -> Case<PolygonInput> {
    let mut numbers = Numbers::new(index);
    let Surface { view, alpha, stretch } = surface(&mut numbers, index, anisotropic);
    let spread = 10f64.powf(numbers.between(-2.0, 0.5));
    let corners = outline(&mut numbers, DVec3::new(-view.x, -view.y, view.z), spread);
    let viewer = view.as_vec3().extend(alpha as f32).to_array();
    let input = PolygonInput { row: row(&corners), viewer, stretch: [stretch.x as f32, stretch.y as f32, 0.0, 0.0] };
    Case { light: Boundary::polygon(&corners), view, alpha, stretch, input }
}

/// Disks and ellipses, and every other time the rim of a sphere.
fn round_case(index: u32, arcs: u32, anisotropic: bool) -> Case<RoundInput> {
    let mut numbers = Numbers::new(index);
    let Surface { view, alpha, stretch } = surface(&mut numbers, index / 2, anisotropic);
    let spread = 10f64.powf(numbers.between(-2.0, 0.5));
    let towards = (DVec3::new(-view.x, -view.y, view.z) + numbers.direction() * spread).normalize_or(DVec3::Z);
    let center = towards * 10f64.powf(numbers.between(-1.0, 1.0));
    let size = center.length() * 10f64.powf(numbers.between(-3.0, -0.05));
    let rim = if index % 2 == 1 {
        let Silhouette::Rim(rim) = sphere(center, size) else { unreachable!("the point is outside") };
        rim
    } else {
        let (a, b) = numbers.direction().any_orthonormal_pair();
        Ellipse { center, axis_a: a * size, axis_b: b * size * numbers.between(0.2, 1.0) }.facing()
    };
    case_of_rim(&rim, arcs, Surface { view, alpha, stretch })
}

fn case_of_rim(rim: &Ellipse, arcs: u32, Surface { view, alpha, stretch }: Surface) -> Case<RoundInput> {
    let round = |v: DVec3| v.as_vec3().as_dvec3();
    let rim = Ellipse { center: round(rim.center), axis_a: round(rim.axis_a), axis_b: round(rim.axis_b) };
    let input = RoundInput {
        center: rim.center.as_vec3().extend(arcs as f32).to_array(),
        a: rim.axis_a.as_vec3().extend(0.0).to_array(),
        b: rim.axis_b.as_vec3().extend(0.0).to_array(),
        viewer: view.as_vec3().extend(alpha as f32).to_array(),
        stretch: [stretch.x as f32, stretch.y as f32, 0.0, 0.0],
    };
    // From the lowest point on, as on the device.
    let highest = rim.axis_b.z.atan2(rim.axis_a.z);
    let whole = Piece::Arc { ellipse: rim, from: highest - PI, to: highest + PI };
    let light = Boundary { pieces: vec![whole], ..Boundary::ellipse(&rim) };
    Case { light, view, alpha, stretch, input }
}

/// Mean half vectors and irradiance.
fn on_device<Input: bytemuck::Pod>(wgsl: &str, cases: &[Case<Input>], anisotropic: bool) -> Option<Vec<(DVec3, f64)>> {
    on_device_with(wgsl, cases, &if anisotropic { Flags::new().with("ANISOTROPIC", true) } else { Flags::new() })
}

fn on_device_with<Input: bytemuck::Pod>(wgsl: &str, cases: &[Case<Input>], flags: &Flags) -> Option<Vec<(DVec3, f64)>> {
    let inputs: Vec<Input> = cases.iter().map(|case| case.input).collect();
    let found: Vec<[f32; 4]> = evaluate(gpu()?, wgsl, flags, &inputs).unwrap();
    Some(found.iter().map(|[x, y, z, cosine]| (DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z)), f64::from(*cosine))).collect())
}

/// Rounding of directions to 32 bits turns half vectors by 2^-24 over their length, which is about twice the cosine of the view at grazing angles; relative to the width of the lobe (the
/// narrower one) that is the error, times a few for the sums.
fn allowed<Input>(case: &Case<Input>) -> f64 {
    2e-6 + 24.0 * 2f64.powi(-24) / (case.alpha * case.stretch.min_element() * case.view.z)
}

/// The same quadrature in 64 bits, for a lobe whose alpha is `factor` times as wide.
fn twin<Input>(case: &Case<Input>, factor: f64, arcs: u32) -> DVec3 {
    let alphas = DVec2::splat(factor * case.alpha) / case.stretch;
    ggx_half_vector_mean(&case.light, case.view, alphas, Fineness { nodes: 3, arcs })
}

/// How many are further off than allowed, and the largest error in units of what is allowed. What is not a number is infinitely far off.
fn misses<Input>(cases: &[Case<Input>], found: &[(DVec3, f64)], factor: f64, arcs: u32) -> (usize, f64) {
    let over = |(case, (found, _)): (&Case<Input>, &(DVec3, f64))| {
        let over = (*found - twin(case, factor, arcs)).length() / allowed(case);
        if over.is_nan() { f64::INFINITY } else { over }
    };
    let over: Vec<f64> = cases.iter().zip(found).map(over).collect();
    (over.iter().filter(|over| **over > 1.0).count(), over.iter().fold(0.0, |most, over| over.max(most)))
}

fn holds<Input: bytemuck::Pod>(what: &str, wgsl: &str, cases: &[Case<Input>], anisotropic: bool, arcs: u32) {
    let Some(found) = on_device(wgsl, cases, anisotropic) else { return };
    let (count, most) = misses(cases, &found, 1.0, arcs);
    println!("{what}: largest error {most:.2} of what is allowed");
    assert_eq!(count, 0, "{what}: further off than rounding explains, by up to {most} times");
    let (narrower, _) = misses(cases, &found, 0.97, arcs);
    assert!(narrower > cases.len() / 8, "{what}: only {narrower} of {} see that the lobe is 3 % narrower", cases.len());
}

#[test]
fn polygons_hold_in_32_bits() {
    for (anisotropic, count) in [(false, 100_000), (true, 50_000)] {
        let cases: Vec<_> = (0..count).map(|index| polygon_case(index, anisotropic)).collect();
        holds(&format!("polygons, anisotropic: {anisotropic}"), &format!("{POLYGONS}{WALK}"), &cases, anisotropic, 1);
    }
}

#[test]
fn round_lights_hold_in_32_bits() {
    for (anisotropic, count) in [(false, 100_000), (true, 20_000)] {
        let cases: Vec<_> = (0..count).map(|index| round_case(index, 8, anisotropic)).collect();
        holds(&format!("round, anisotropic: {anisotropic}"), ROUND, &cases, anisotropic, 8);
    }
}

/// Edges of a small light cancel, and what is left keeps the digits that directions in 32 bits have over the light's size: no other form is needed for small lights.
#[test]
fn small_lights_keep_their_digits() {
    for size in [1e-1, 1e-2, 1e-3, 1e-4] {
        let lights: Vec<(Vec<DVec3>, DVec3, f64)> = (0..4000)
            .map(|index| {
                let mut numbers = Numbers::new(index);
                let Surface { view, alpha, .. } = surface(&mut numbers, 1, false);
                let alpha = alpha.max(0.05);
                let center = (DVec3::new(-view.x, -view.y, view.z) + numbers.direction() * (0.5 * alpha)).normalize();
                let center = center.with_z(center.z.abs() + 0.1);
                let (a, b) = center.normalize().any_orthonormal_pair();
                let corners = [a + b, a - b, -a - b, b - a].map(|corner| (center + corner * size).as_vec3().as_dvec3());
                (corners.to_vec(), view, alpha)
            })
            .collect();
        let Some(means) = mean_of_polygons(&lights) else { return };
        let off = |factor: f64| {
            let mut relative: Vec<f64> =
                means.iter().map(|(found, exact, _)| (*found - *exact * factor).length() / exact.length()).collect();
            relative.sort_by(f64::total_cmp);
            (relative[relative.len() / 2], relative[relative.len() * 99 / 100])
        };
        let (median, most) = off(1.0);
        println!("size {size}: relative error {median:.1e} in the median, {most:.1e} in 99 of 100");
        let (median_allowed, most_allowed) = (4e-5 + 2e-8 / size, 2e-4 + 4e-7 / size);
        assert!(median < median_allowed && most < most_allowed, "size {size}: {median}, {most}");
        assert!(off(1.0 + 2.0 * median_allowed).0 > median_allowed, "size {size}: a brighter light must not pass");
    }
}

/// Of at most pi. Along circles the integral is exact: that of a sphere is so with four arcs.
#[test]
fn irradiance_along_circles() {
    let cases: Vec<_> = (0..20_000).map(|index| round_case(2 * index + 1, 4, false)).collect();
    let Some(found) = on_device(ROUND, &cases, false) else { return };
    let off = |normal: DVec3| {
        let error = |(case, (_, cosine)): (&Case<RoundInput>, &(DVec3, f64))| (cosine - irradiance(&case.light, normal)).abs();
        cases.iter().zip(&found).map(error).fold(0.0, |most: f64, error| if error.is_nan() { f64::INFINITY } else { most.max(error) })
    };
    assert!(off(DVec3::Z) < 1e-5, "off by {}", off(DVec3::Z));
    assert!(off(DVec3::new(1e-3, 0.0, 1.0).normalize()) > 1e-4, "a normal that is off by 1e-3 must not pass");
    // The closed form of the literature.
    for (elevation, sine) in [(0.9, 0.3), (0.1, 0.3), (-0.1, 0.3), (0.5, 0.05)] {
        let Silhouette::Rim(rim) = sphere(DVec3::new(f64::sqrt(1.0 - elevation * elevation), 0.0, elevation), sine) else {
            panic!("outside")
        };
        let own = irradiance(&Boundary::ellipse(&rim), DVec3::Z);
        assert!((own - irradiance_of_sphere(elevation, sine)).abs() < 1e-9, "{elevation}, {sine}");
    }
}

/// Ellipses are taken for arcs of circles: with 8 arcs within 1 % of the largest irradiance that such a light has, with 32 within 1e-4.
#[test]
fn irradiance_of_ellipses() {
    let turned = glam::DMat3::from_axis_angle(DVec3::new(0.3, 0.8, 0.5).normalize(), 1.0);
    for (arcs, most) in [(8, 1e-2), (32, 1e-4)] {
        for index in 0..500 {
            let mut numbers = Numbers::new(index);
            let center = numbers.direction() * numbers.between(1.0, 3.0);
            let axes = turned * glam::DMat3::from_diagonal(DVec3::new(0.5, numbers.between(0.1, 0.5), 0.3));
            let Silhouette::Rim(rim) = ellipsoid(center, axes) else { continue };
            let whole = Boundary::ellipse(&rim);
            let exact = irradiance(&whole, DVec3::Z);
            let own: f64 = whole
                .clip(DVec3::Z)
                .pieces
                .iter()
                .map(|piece| match piece {
                    Piece::Arc { ellipse, from, to } => {
                        arcs_of(ellipse, *from, *to, arcs).iter().map(|arc| -arc.vector_irradiance().z).sum::<f64>()
                    }
                    // In the horizon's plane.
                    Piece::Segment { from, to, .. } => CircularArc::great(*from, *to).map_or(0.0, |arc| -arc.vector_irradiance().z),
                })
                .sum();
            let largest = irradiance(&whole, center.normalize());
            assert!((own - exact).abs() < most * largest, "{arcs} arcs: {own} for {exact} of {largest}");
        }
    }
}

/// An isotropic surface under a polygon: the mean half vector with six nodes on the device, the same with 64 in 64 bits, and what 32 bits may be off by.
pub fn mean_of_polygons(lights: &[(Vec<DVec3>, DVec3, f64)]) -> Option<Vec<(DVec3, DVec3, f64)>> {
    let cases: Vec<Case<PolygonInput>> = lights.iter().map(|(corners, view, alpha)| isotropic_case(corners, *view, *alpha)).collect();
    let found = on_device_with(&format!("{POLYGONS}{WALK}"), &cases, &Flags::new().with("HALF_VECTOR_NODES_SIX", true))?;
    let exact =
        |case: &Case<PolygonInput>| ggx_half_vector_mean(&case.light, case.view, DVec2::splat(case.alpha), Fineness { nodes: 64, arcs: 1 });
    Some(cases.iter().zip(&found).map(|(case, (mean, _))| (*mean, exact(case), allowed(case))).collect())
}

fn isotropic_case(corners: &[DVec3], view: DVec3, alpha: f64) -> Case<PolygonInput> {
    Case {
        light: Boundary::polygon(corners),
        view,
        alpha,
        stretch: DVec2::ONE,
        input: PolygonInput { row: row(corners), viewer: view.as_vec3().extend(alpha as f32).to_array(), stretch: [1.0; 4] },
    }
}

/// Irradiance and lobe step by step.
pub struct Track {
    /// On the device with three nodes.
    pub found: [Vec<f64>; 2],
    pub exact: [Vec<f64>; 2],
}

/// For lights seen from the origin; the lobe is the light that it reflects before masking and Fresnel.
pub fn light_of(lights: &[Vec<DVec3>], view_degrees: f64, alpha: f64) -> Option<Track> {
    let angle = view_degrees.to_radians();
    let view = DVec3::new(angle.sin(), 0.0, angle.cos()).as_vec3().as_dvec3().normalize();
    let cases: Vec<Case<PolygonInput>> = lights.iter().map(|corners| isotropic_case(corners, view, alpha)).collect();
    track(&format!("{POLYGONS}{WALK}"), &cases)
}

/// The same for rims, of 8 arcs on the device.
pub fn round_light_of(rims: &[Ellipse], view_degrees: f64, alpha: f64) -> Option<Track> {
    let angle = view_degrees.to_radians();
    let view = DVec3::new(angle.sin(), 0.0, angle.cos());
    let cases: Vec<Case<RoundInput>> =
        rims.iter().map(|rim| case_of_rim(rim, 8, Surface { view: view.as_vec3().as_dvec3(), alpha, stretch: DVec2::ONE })).collect();
    track(ROUND, &cases)
}

fn track<Input: bytemuck::Pod>(wgsl: &str, cases: &[Case<Input>]) -> Option<Track> {
    let found = on_device(wgsl, cases, false)?;
    let exact = |case: &Case<Input>| {
        ggx_half_vector_mean(&case.light, case.view, DVec2::splat(case.alpha), Fineness { nodes: 48, arcs: 128 }).dot(case.view)
    };
    let lobe = cases.iter().zip(&found).map(|(case, (mean, _))| mean.dot(case.view)).collect();
    let device = [found.iter().map(|(_, cosine)| *cosine).collect(), lobe];
    let truth = [cases.iter().map(|case| irradiance(&case.light, DVec3::Z)).collect(), cases.iter().map(exact).collect()];
    Some(Track { found: device, exact: truth })
}
