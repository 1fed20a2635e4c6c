//! Disks, spheres, ellipses and ellipsoids as outlines.

use super::outlines::Numbers;
use glam::{DMat3, DVec3};
use lobelia::{
    graph::testing::{evaluate, gpu},
    lobes::area_light::{
        boundary::{Boundary, Ellipse},
        lambert::{irradiance, irradiance_of_sphere},
        round::{Silhouette, ellipsoid, spinning_quad},
    },
    shaders::Flags,
};

const WGSL: &str = "#import lobelia::light_outline::{OutlineLine, OutlineWalk, Rim, great_arc, lambert_edge, rim_corner, rim_of_disk, rim_of_ellipsoid, take_horizon, walk_outline}
struct Input { center: vec4f, a: vec4f, b: vec4f, c: vec4f }
struct Output { values: vec4f }
fn irradiance_of(rim: Rim, sides: u32) -> f32 {
    if all(rim.axis_a == vec3f(0.0)) { return -1.0; }
    var walk: OutlineWalk;
    var sum = 0.0;
    var previous = rim_corner(rim, sides - 1u, sides);
    var corner = 0u;
    while corner < sides || walk.waits {
        var line: OutlineLine;
        if walk.waits {
            line = take_horizon(&walk);
        } else {
            let next = rim_corner(rim, corner, sides);
            corner += 1u;
            line = walk_outline(&walk, previous, next, corner == sides);
            previous = next;
        }
        sum += lambert_edge(great_arc(line.start, line.to));
    }
    return sum;
}
fn evaluate(input: Input) -> Output {
    var rim = rim_of_disk(input.center.xyz, input.a.xyz, input.b.xyz);
    if input.center.w > 0.0 { rim = rim_of_ellipsoid(input.center.xyz, mat3x3f(input.a.xyz, input.b.xyz, input.c.xyz)); }
    return Output(vec4f(irradiance_of(rim, 16u), irradiance_of(rim, 64u), 0.0, 0.0));
}";

struct Case {
    row: [[f32; 4]; 4],
    /// None from inside.
    expected: Option<f64>,
}

/// Every kind of shape in every place: far and near, across the horizon, under non-uniform scale and shear, with the point inside.
fn case(index: u32) -> Case {
    let mut numbers = Numbers::new(index);
    let mut vector = |scale: f64| (numbers.direction() * scale).as_vec3().as_dvec3();
    let [a, b] = [vector(1.0), vector(0.6)];
    let c = vector(0.8);
    let solid = index % 2 == 1;
    let distance = [0.3, 1.5, 4.0, 50.0, 2000.0][index as usize / 2 % 5];
    let center = vector(distance);
    let axes = DMat3::from_cols(a, b, c);
    let expected = if solid {
        match ellipsoid(center, axes) {
            Silhouette::Everywhere => None,
            Silhouette::Rim(rim) => Some(irradiance(&Boundary::ellipse(&rim), DVec3::Z)),
        }
    } else {
        Some(irradiance(&Boundary::ellipse(&Ellipse { center, axis_a: a, axis_b: b }), DVec3::Z))
    };
    let row =
        [center.as_vec3().extend(if solid { 1.0 } else { 0.0 }), a.as_vec3().extend(0.0), b.as_vec3().extend(0.0), c.as_vec3().extend(0.0)];
    Case { row: row.map(|row| row.to_array()), expected }
}

#[test]
fn round_lights_are_their_polygons() {
    let Some(gpu) = gpu() else { return };
    let cases: Vec<Case> = (0..4000).map(case).collect();
    let rows: Vec<[[f32; 4]; 4]> = cases.iter().map(|case| case.row).collect();
    let found: Vec<[f32; 4]> = evaluate(gpu, WGSL, &Flags::new(), &rows).unwrap();
    let (mut worst, mut inside) = ([0f64; 2], 0);
    for (case, found) in cases.iter().zip(&found) {
        let Some(expected) = case.expected else {
            assert!(found[0] == -1.0, "a point inside sees {found:?}");
            inside += 1;
            continue;
        };
        for side in [0, 1] {
            let off = (f64::from(found[side]) - expected).abs();
            worst[side] = if off.is_nan() { f64::INFINITY } else { worst[side].max(off) };
        }
    }
    assert!(inside > 20, "only {inside} points are inside");
    // Of at most pi: where the horizon or the surface is near the rim a polygon of equal area is not the ellipse.
    assert!(worst[0] < 0.08 && worst[1] < 4e-3, "sixteen and sixty-four corners are off by up to {worst:?}");
    assert!(worst[1] < 0.2 * worst[0], "more corners are not better: {worst:?}");
}

#[test]
fn spheres_have_the_irradiance_of_their_closed_form() {
    let Some(gpu) = gpu() else { return };
    let cases: Vec<(f64, f64)> =
        (0..400).map(|index| (f64::from(index % 20) / 9.5 - 1.0, 0.02 + 0.95 * f64::from(index / 20) / 20.0)).collect();
    let rows: Vec<[[f32; 4]; 4]> = cases
        .iter()
        .map(|(elevation, sine)| {
            let (radius, x) = (*sine as f32, (1.0 - elevation * elevation).max(0.0).sqrt() as f32);
            [[x, 0.0, *elevation as f32, 1.0], [radius, 0.0, 0.0, 0.0], [0.0, radius, 0.0, 0.0], [0.0, 0.0, radius, 0.0]]
        })
        .collect();
    let found: Vec<[f32; 4]> = evaluate(gpu, WGSL, &Flags::new(), &rows).unwrap();
    for ((elevation, sine), found) in cases.iter().zip(&found) {
        let expected = irradiance_of_sphere(*elevation, *sine);
        assert!(
            (f64::from(found[1]) - expected).abs() < 2e-3 * expected + 2e-3 * sine * sine,
            "{elevation}, {sine}: {found:?} for {expected}"
        );
    }
}

/// Corners of the quad that spins, for disks that are turned, far and near, with mirror directions that meet their plane and miss it.
#[test]
fn spinning_quads_hold_in_32_bits() {
    const QUADS: &str = "#import lobelia::light_outline::{rim_of_disk, rim_point, spinning_quad}
    struct Input { center: vec4f, a: vec4f, b: vec4f, mirror: vec4f }
    struct Output { corners: array<vec4f, 4> }
    fn evaluate(input: Input) -> Output {
        let rim = spinning_quad(rim_of_disk(input.center.xyz, input.a.xyz, input.b.xyz), input.mirror.xyz, input.mirror.w);
        var output: Output;
        for (var index = 0u; index < 4u; index++) { output.corners[index] = vec4f(rim_point(rim, 1.57079633 * f32(index)), 0.0); }
        return output;
    }";
    let Some(gpu) = gpu() else { return };
    let cases: Vec<(Ellipse, DVec3, f64)> = (0..20_000)
        .map(|index| {
            let mut numbers = Numbers::new(index);
            let (a, b) = numbers.direction().any_orthonormal_pair();
            let radius = numbers.between(0.2, 3.0);
            let rim = Ellipse { center: numbers.direction() * numbers.between(0.5, 10.0), axis_a: a * radius, axis_b: b * radius }.facing();
            (rim, numbers.direction(), numbers.between(0.01, 1.0))
        })
        .collect();
    let row = |(rim, mirror, spread): &(Ellipse, DVec3, f64)| {
        [(rim.center, 0.0), (rim.axis_a, 0.0), (rim.axis_b, 0.0), (*mirror, *spread)].map(|(v, w)| v.as_vec3().extend(w as f32).to_array())
    };
    let rows: Vec<[[f32; 4]; 4]> = cases.iter().map(row).collect();
    let found: Vec<[[f32; 4]; 4]> = evaluate(gpu, QUADS, &Flags::new(), &rows).unwrap();
    let corners = |(rim, mirror, spread): &(Ellipse, DVec3, f64)| {
        let radius = rim.axis_a.length();
        let axes = [rim.axis_a, rim.axis_b, rim.axis_a.cross(rim.axis_b) / radius].map(|axis| axis / radius);
        let local = |v: DVec3| DVec3::new(v.dot(axes[0]), v.dot(axes[1]), v.dot(axes[2]));
        let quad = spinning_quad(local(-rim.center) / radius, local(*mirror), *spread, None);
        quad.map(|corner| rim.center + (axes[0] * corner.x + axes[1] * corner.y) * radius)
    };
    let far_off = |spread_factor: f64| {
        let off = |(case, found): (&(Ellipse, DVec3, f64), &[[f32; 4]; 4])| {
            let expected = corners(&(case.0, case.1, (case.2 * spread_factor).min(1.0)));
            // Both start at the corner towards the light; ours go around the other way.
            let found = found.map(|[x, y, z, _]| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
            let order = [0, 3, 2, 1];
            order.iter().zip(expected).map(|(index, corner)| (found[*index] - corner).length()).fold(0.0, f64::max) / case.0.axis_a.length()
        };
        cases.iter().zip(&found).map(off).filter(|off| off.is_nan() || *off >= 1e-3).count()
    };
    // Where the point is right below the middle or the ray has no direction along the plane, any corner is the first.
    assert!(far_off(1.0) < cases.len() / 500, "{} of {} are off", far_off(1.0), cases.len());
    assert!(far_off(0.9) > cases.len() / 2, "another spread must not pass");
}
