//! What the modules promise, on the device, at the edges of their domains. The twins in `f64` are compared over the whole domain in `tests/`.
#![allow(clippy::unwrap_used)]

use glam::{DMat3, DVec2, DVec3, Vec3};
use lobelia_graph::testing::{compare, evaluate, gpu};
use lobelia_lobes::brdf::{Brdf, Distribution};
use lobelia_lobes::sampling::r2_point;
use lobelia_shaders::Flags;

fn direction(index: u32, seed: u32) -> DVec3 {
    let [u, v] = r2_point(index, seed);
    let z = 2.0 * u - 1.0;
    let (radius, angle) = ((1.0 - z * z).max(0.0).sqrt(), std::f64::consts::TAU * v);
    DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
}

fn xyz(row: &[f32]) -> DVec3 {
    DVec3::new(row[0].into(), row[1].into(), row[2].into())
}

fn row(v: DVec3, w: f64) -> [f32; 4] {
    v.as_vec3().extend(w as f32).to_array()
}

#[test]
fn shared_exponents_at_powers_of_two_and_at_both_ends() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::packing::{pack_shared_exponent, unpack_shared_exponent}
struct Input { color: vec4f }
struct Output { color: vec4f }
fn evaluate(input: Input) -> Output {
    return Output(vec4f(unpack_shared_exponent(pack_shared_exponent(input.color.xyz)), 0.0));
}";
    let mut rows: Vec<[f32; 4]> = Vec::new();
    for exponent in -40..16 {
        let power = 2f32.powi(exponent);
        // Just below, at, and above; and where nine bits carry into a tenth.
        for value in [power.next_down(), power, power.next_up(), power * (511.4 / 256.0), power * (511.6 / 256.0)] {
            rows.push([value, 0.3 * value, 0.0, 0.0]);
        }
    }
    rows.extend([
        [0.0; 4],
        [-0.0, -0.0, -0.0, 0.0],
        [-1.0, 2.0, -3.0, 0.0],
        [65408.0, 1.0, 0.0, 0.0],
        [1e30, 1e30, 3.0, 0.0],
        [1e-45, 0.0, 0.0, 0.0],
    ]);
    let found: Vec<[f32; 4]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for (given, back) in rows.iter().zip(&found) {
        let clamped = [0, 1, 2].map(|channel| given[channel].clamp(0.0, 65408.0));
        let largest = clamped.into_iter().fold(0.0, f32::max);
        for channel in 0..3 {
            let error = (back[channel] - clamped[channel]).abs();
            assert!(error <= (largest / 512.0).max(2f32.powi(-25)), "{given:?} {back:?}");
        }
    }
    let whole = rows.iter().position(|given| *given == [1.0, 0.3, 0.0, 0.0]).unwrap();
    assert_eq!(found[whole][0], 1.0, "powers of two are exact");
}

#[test]
fn projection_is_the_inverse_of_position() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::scene::{View, project, scene_position}
struct Input { camera: vec4f, forward: vec4f, right: vec4f, up: vec4f, extent: vec2f, jitter: vec2f, pixel: vec2f, depth: f32, padding: f32 }
struct Output { position: vec4f, back: vec4f }
fn evaluate(input: Input) -> Output {
    let none = mat4x4f();
    let view = View(none, none, input.camera.xyz, input.camera.w, input.forward.xyz, 0u, input.right.xyz, 0u, input.up.xyz, 1.0, input.extent, input.jitter);
    let position = scene_position(view, input.pixel, input.depth);
    return Output(vec4f(position, 0.0), vec4f(project(view, position), 0.0));
}";
    let (mut rows, mut positions, mut pixels) = (Vec::<[f32; 24]>::new(), Vec::new(), Vec::new());
    for index in 0..4000 {
        let ([a, b], [c, d]) = (r2_point(index, 1), r2_point(index, 2));
        let forward = direction(index, 3);
        let right = forward.cross(if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::X }).normalize();
        let up = right.cross(forward);
        let (extent, jitter, near) = (DVec2::new(480.0, 270.0), DVec2::new(c - 0.5, d - 0.5), 0.05);
        let tangent = 0.1 + 1.5 * a;
        let (right, up) = (right * tangent * extent.x / extent.y, up * tangent);
        let camera = direction(index, 4) * 30.0;
        let pixel = (DVec2::new(b, c) * extent).floor();
        let distance = near * 10f64.powf(4.0 * d);
        let depth = near / distance;
        let mut packed = Vec::new();
        packed.extend(row(camera, near));
        packed.extend(row(forward, 0.0));
        packed.extend(row(right, 0.0));
        packed.extend(row(up, 0.0));
        packed.extend([extent.x, extent.y, jitter.x, jitter.y, pixel.x, pixel.y, depth, 0.0].map(|value| value as f32));
        rows.push(packed.try_into().unwrap());
        let ndc = (pixel + 0.5 + jitter) / extent * 2.0 - 1.0;
        positions.push((camera + (forward + ndc.x * right - ndc.y * up) * distance, distance));
        pixels.push(pixel);
    }
    let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for (((found, (position, distance)), pixel), given) in found.iter().zip(&positions).zip(&pixels).zip(&rows) {
        // A few units in the last place of the numbers that are added up.
        let rounding = 2f64.powi(-21) * (30.0 + 4.0 * distance);
        assert!((xyz(&found[..3]) - position).length() < rounding, "{position}");
        let off = (xyz(&found[4..7]).truncate() - pixel).length();
        // Close to the camera the rounding of its own position shows.
        assert!(off < 0.01 + 480.0 * 4.0 * 2f64.powi(-21) * 30.0 / distance, "{pixel}: {off} pixels off at {distance} m");
        let depth = f64::from(found[6]) / f64::from(given[22]) - 1.0;
        assert!(depth.abs() < 1e-5 + 4.0 * 2f64.powi(-21) * 30.0 / distance, "{depth}");
    }
    assert!(found.iter().all(|row| row.iter().all(|value| value.is_finite())));
}

#[test]
fn points_level_with_the_camera_or_behind_it_are_told_by_their_depth() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::scene::{View, project}
struct Input { position: vec4f }
struct Output { back: vec4f }
fn evaluate(input: Input) -> Output {
    let view = View(mat4x4f(), mat4x4f(), vec3f(0.0), 0.1, vec3f(0.0, 0.0, -1.0), 0u, vec3f(1.0, 0.0, 0.0), 0u, vec3f(0.0, 1.0, 0.0), 1.0, vec2f(64.0), vec2f(0.0));
    return Output(vec4f(project(view, input.position.xyz), 0.0));
}";
    let rows = [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 3.0, 0.0], [0.0, 0.0, -0.05, 0.0], [0.0, 0.0, -0.2, 0.0f32]];
    let found: Vec<[f32; 4]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    let seen: Vec<bool> = found.iter().map(|row| row[2] > 0.0 && row[2] <= 1.0).collect();
    assert_eq!(seen, [false, false, false, false, true], "{found:?}");
    assert_eq!(found[4][..2], [31.5, 31.5]);
}

#[test]
fn vectors_of_any_length_get_a_direction_and_no_length_gets_the_fallback() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::math::{perpendicular, safe_normalize}
struct Input { v: vec4f }
struct Output { unit: vec4f, across: vec4f }
fn evaluate(input: Input) -> Output {
    let unit = safe_normalize(input.v.xyz, vec3f(0.0, 0.0, -1.0));
    return Output(vec4f(unit, 0.0), vec4f(perpendicular(unit), 0.0));
}";
    let lengths = [1e-29, 1e-20, 1e-5, 1.0, 1e10, 1e25, 9e29];
    let mut directions: Vec<DVec3> = (0..500).map(|index| direction(index, 0)).collect();
    directions.extend([DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z, DVec3::new(1e-7, -1e-7, -1.0).normalize()]);
    let mut rows: Vec<[f32; 4]> = directions.iter().enumerate().map(|(index, d)| row(*d * lengths[index % lengths.len()], 0.0)).collect();
    rows.extend([[0.0; 4], [1e-38, 0.0, 0.0, 0.0], [3e38, 0.0, 0.0, 0.0]]);
    let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for (given, got) in rows.iter().zip(&found) {
        let largest = given[..3].iter().fold(0.0f32, |largest, value| largest.max(value.abs()));
        let expected = if largest > 1e-30 && largest < 1e30 { (xyz(given) / f64::from(largest)).normalize() } else { DVec3::NEG_Z };
        let (unit, across) = (xyz(&got[..3]), xyz(&got[4..7]));
        assert!((unit - expected).length() < 1e-6, "{given:?}: {unit}");
        assert!(across.dot(unit).abs() < 1e-6 && (across.length() - 1.0).abs() < 1e-6, "{unit} {across}");
    }
}

#[test]
fn light_falls_off_with_the_square_and_stays_finite_on_the_light() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::light::light_sample
#import lobelia::scene::PunctualLight
struct Input { light: vec4f, axis: vec4f, point: vec4f, kind: u32, cos_outer: f32, scale: f32, padding: f32 }
struct Output { direction: vec4f, irradiance: vec4f }
fn evaluate(input: Input) -> Output {
    let light = PunctualLight(input.light.xyz, input.kind, input.axis.xyz, input.cos_outer, vec3f(10.0, 5.0, 0.0), input.scale);
    let lit = light_sample(light, input.point.xyz);
    return Output(vec4f(lit.direction, lit.distance), vec4f(lit.irradiance, 0.0));
}";
    let (outer, inner) = (0.6f64, 0.3f64);
    let (mut rows, mut expected, mut got) = (Vec::<[f32; 16]>::new(), Vec::new(), Vec::new());
    for index in 0..6000u32 {
        let (light, axis) = (direction(index, 0) * 3.0, direction(index, 1));
        let [a, b] = r2_point(index, 5);
        // Half of the points in the neighbourhood of the axis, so that cones matter.
        let towards = if index % 2 == 0 { direction(index, 2) } else { (axis + direction(index, 2) * a).normalize_or(axis) };
        let point = light + towards * 0.05 * 10f64.powf(4.0 * b);
        let kind = index % 3;
        let mut packed = Vec::new();
        packed.extend(row(light, 0.0));
        packed.extend(row(axis, 0.0));
        packed.extend(row(point, 0.0));
        packed.extend([f32::from_bits(kind), outer.cos() as f32, (1.0 / (inner.cos() - outer.cos())) as f32, 0.0]);
        let packed: [f32; 16] = packed.try_into().unwrap();
        // The twin sees the rounded numbers.
        let offset = xyz(&packed[8..11]) - xyz(&packed[..3]);
        let (distance, axis) = (offset.length(), xyz(&packed[4..7]));
        let (from_light, power) = match kind {
            0 => (offset / distance, 1.0 / (distance * distance)),
            1 => {
                let cosine = axis.dot(offset / distance);
                (offset / distance, lobelia_lobes::light::spot_falloff(cosine, inner, outer) / (distance * distance))
            }
            _ => (axis, 1.0),
        };
        expected.extend((-from_light).to_array());
        expected.extend([10.0 * power, 5.0 * power]);
        rows.push(packed);
    }
    let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for found in &found {
        got.extend([found[0], found[1], found[2], found[4], found[5]].map(f64::from));
    }
    compare(&expected, &got, 1e-4, 1e-5).unwrap();
    // On the light itself, and as near as no number can tell.
    let mut here = rows[0];
    for kind in 0..3 {
        for nudge in [0.0, 1e-30, 1e-12] {
            here[..3].copy_from_slice(&[0.0; 3]);
            here[8..11].copy_from_slice(&[nudge, 0.0, 0.0]);
            here[12] = f32::from_bits(kind);
            let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &[here]).unwrap();
            assert!(found[0].iter().all(|value| value.is_finite()), "{found:?}");
            assert!((xyz(&found[0][..3]).length() - 1.0).abs() < 1e-5, "{found:?}");
        }
    }
}

const SURFACE: &str = "#import lobelia::scene::Material
#import lobelia::surface::{MaterialTexels, material_surface}
struct Input { normal: vec4f, tangent: vec4f, viewer: vec4f, texel: vec4f, scale: f32, front: u32, padding_a: f32, padding_b: f32 }
struct Output { normal: vec4f, geometric: vec4f, emissive: vec4f }
fn evaluate(input: Input) -> Output {
    let material = Material(vec3f(1.0), 0.5, vec3f(3.0), 0.5, 1.0, input.scale, 0.0, 0u, vec4f(0.04, 0.04, 0.04, 1.0));
    let texels = MaterialTexels(vec4f(1.0), vec4f(0.0, 1.0, 1.0, 0.0), input.texel, vec4f(1.0));
    let surface = material_surface(material, texels, input.normal.xyz, input.tangent, input.viewer.xyz, input.front != 0u);
    return Output(vec4f(surface.normal, surface.roughness), vec4f(surface.geometric_normal, surface.metallic), vec4f(surface.emissive, surface.specular));
}";

fn surface_row(normal: DVec3, tangent: DVec3, sign: f64, viewer: DVec3, texel: DVec3, scale: f64, front: bool) -> [f32; 20] {
    let mut packed = Vec::new();
    packed.extend(row(normal, 0.0));
    packed.extend(row(tangent, sign));
    packed.extend(row(viewer, 0.0));
    packed.extend(row(texel, 0.0));
    packed.extend([scale as f32, f32::from_bits(front.into()), 0.0, 0.0]);
    packed.try_into().unwrap()
}

#[test]
fn normal_maps_and_two_sided_normals_follow_the_convention() {
    let Some(gpu) = gpu() else { return };
    let flags = Flags::new().with("NORMAL_MAP", true).with("SPECULAR", true).with("EMISSIVE", true);
    let (mut rows, mut expected, mut got) = (Vec::new(), Vec::new(), Vec::new());
    for index in 0..4000u32 {
        let (n, other, viewer) = (direction(index, 0), direction(index, 1), direction(index, 2));
        let tangent = n.cross(other).normalize();
        if n.dot(viewer).abs() < 1e-4 {
            continue;
        }
        let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
        let [a, b] = r2_point(index, 3);
        let (texel, scale) = (DVec3::new(a, b, 0.5 + 0.5 * a), 0.2 + 1.3 * b);
        let length = 10f64.powf(6.0 * a - 3.0);
        rows.push(surface_row(n * length, tangent * length, sign, viewer * length, texel, scale, index % 3 == 0));
        let t = (2.0 * texel - 1.0) * DVec3::new(scale, scale, 1.0);
        let shading = (DMat3::from_cols(tangent, n.cross(tangent) * sign, n) * t).normalize();
        let side = n.dot(viewer).signum();
        expected.extend((shading * side).to_array());
        expected.extend((n * side).to_array());
        expected.push(if index % 3 == 0 { 3.0 } else { 0.0 });
    }
    let found: Vec<[f32; 12]> = evaluate(gpu, SURFACE, &flags, &rows).unwrap();
    for found in &found {
        got.extend([0, 1, 2, 4, 5, 6, 8].map(|place| f64::from(found[place])));
    }
    compare(&expected, &got, 0.0, 2e-5).unwrap();
    // Without the flag, the map is not there.
    let plain: Vec<[f32; 12]> = evaluate(gpu, SURFACE, &Flags::new(), &rows).unwrap();
    assert!(plain.iter().all(|found| found[..3] == found[4..7]));
}

#[test]
fn degenerate_normals_and_tangents_give_unit_normals() {
    let Some(gpu) = gpu() else { return };
    let flags = Flags::new().with("NORMAL_MAP", true);
    let (zero, x, z) = (DVec3::ZERO, DVec3::X, DVec3::Z);
    let rows = [
        surface_row(zero, x, 1.0, z, DVec3::new(0.5, 0.5, 1.0), 1.0, true),
        surface_row(z, zero, 1.0, z, DVec3::new(1.0, 0.0, 0.5), 1.0, true),
        surface_row(zero, zero, 1.0, zero, DVec3::splat(0.5), 1.0, true),
        surface_row(z, x, 1.0, z, DVec3::splat(0.5), 1.0, true),
        surface_row(z, x, 1.0, z, DVec3::new(1.0, 1.0, 0.5), 0.0, true),
        surface_row(z, z, 1.0, z, DVec3::new(1.0, 1.0, 0.5), 1.0, true),
        surface_row(z, x, 0.0, z, DVec3::new(1.0, 1.0, 0.5), 1.0, true),
        surface_row(z * 1e-20, x * 1e-20, 1.0, z * 1e-20, DVec3::new(0.5, 0.5, 1.0), 1.0, true),
    ];
    let found: Vec<[f32; 12]> = evaluate(gpu, SURFACE, &flags, &rows).unwrap();
    for (index, found) in found.iter().enumerate() {
        for normal in [xyz(&found[..3]), xyz(&found[4..7])] {
            assert!((normal.length() - 1.0).abs() < 1e-5, "row {index}: {normal}");
        }
    }
    // A tangent of sign 0 means that there is none: the texel is not read.
    assert_eq!(xyz(&found[6][..3]), z);
}

#[test]
fn packed_surfaces_come_back_and_flags_leave_their_parts_out() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::surface::{Surface, pack_surface, unpack_surface}
struct Input { normal: vec4f, geometric: vec4f, color: vec4f, emissive: vec4f }
struct Output { normal: vec4f, geometric: vec4f, color: vec4f, emissive: vec4f }
fn evaluate(input: Input) -> Output {
    let given = Surface(input.normal.xyz, input.geometric.xyz, input.color.xyz, input.normal.w, input.geometric.w, input.color.w, input.emissive.xyz);
    let back = unpack_surface(pack_surface(given));
    return Output(vec4f(back.normal, back.roughness), vec4f(back.geometric_normal, back.metallic), vec4f(back.base_color, back.specular), vec4f(back.emissive, 0.0));
}";
    let rows: Vec<[f32; 16]> = (0..3000)
        .map(|index| {
            let ([a, b], [c, d]) = (r2_point(index, 1), r2_point(index, 2));
            let mut packed = Vec::new();
            packed.extend(row(direction(index, 3), a));
            packed.extend(row(direction(index, 4), b));
            packed.extend(row(DVec3::new(a, b, c), d));
            packed.extend(row(DVec3::new(c, d, a) * 50.0, 0.0));
            packed.try_into().unwrap()
        })
        .collect();
    for bits in 0..8 {
        let [specular, normal_map, emissive] = [1, 2, 4].map(|bit| bits & bit != 0);
        let flags = Flags::new().with("SPECULAR", specular).with("NORMAL_MAP", normal_map).with("EMISSIVE", emissive);
        let found: Vec<[f32; 16]> = evaluate(gpu, wgsl, &flags, &rows).unwrap();
        for (given, back) in rows.iter().zip(&found) {
            let geometric = if normal_map { &given[4..7] } else { &given[..3] };
            assert!(xyz(&back[..3]).dot(xyz(&given[..3])) > 1.0 - 1e-6);
            assert!(xyz(&back[4..7]).dot(xyz(geometric)) > 1.0 - 1e-6);
            assert!((xyz(&back[8..11]).map(f64::sqrt) - xyz(&given[8..11]).map(f64::sqrt)).abs().max_element() < 5e-4);
            let [roughness, metallic, scale] = if specular { [given[3], given[7], given[11]] } else { [1.0, 0.0, 0.0] };
            assert!((back[3] - roughness).abs() <= 0.51 / 65535.0 && (back[7] - metallic).abs() <= 0.51 / 255.0);
            assert!((back[11] - scale).abs() <= 0.51 / 255.0);
            let light = if emissive { xyz(&given[12..15]) } else { DVec3::ZERO };
            assert!((xyz(&back[12..15]) - light).abs().max_element() <= light.max_element() / 512.0);
        }
    }
}

#[test]
fn reflectance_is_finite_everywhere_and_respects_the_true_surface() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::brdf::{albedo_estimate, brdf_from_surface, evaluate_brdf}
#import lobelia::surface::Surface
struct Input { n: vec4f, geometric: vec4f, l: vec4f, v: vec4f }
struct Output { f: vec4f, albedo: vec4f }
fn evaluate(input: Input) -> Output {
    let surface = Surface(input.n.xyz, input.geometric.xyz, vec3f(0.9, 0.5, 0.1), input.n.w, input.geometric.w, input.l.w, vec3f(0.0));
    let brdf = brdf_from_surface(surface);
    return Output(vec4f(evaluate_brdf(brdf, input.n.xyz, input.geometric.xyz, input.l.xyz, input.v.xyz), 0.0), vec4f(albedo_estimate(brdf, input.v.w), 0.0));
}";
    let mut rows = Vec::<[f32; 16]>::new();
    for index in 0..40_000u32 {
        let ([a, b], [c, d]) = (r2_point(index, 1), r2_point(index, 2));
        let (n, bend) = (direction(index, 3), direction(index, 4));
        let geometric = (n + bend * 0.8 * a).normalize();
        let l = direction(index, 5);
        let v = match index % 4 {
            0 => direction(index, 6),
            // Opposite to the light: no half vector.
            1 => -l,
            // Grazing.
            2 => (n.cross(bend).normalize() + n * 10f64.powf(-8.0 * b)).normalize(),
            _ => (2.0 * n.dot(l) * n - l + direction(index, 6) * 10f64.powf(-6.0 * c)).normalize(),
        };
        let mut packed = Vec::new();
        packed.extend(row(n, if index % 5 == 0 { 0.0 } else { b }));
        packed.extend(row(geometric, c));
        packed.extend(row(l, if index % 7 == 0 { 0.0 } else { 1.0 }));
        packed.extend(row(v, d));
        rows.push(packed.try_into().unwrap());
    }
    for (distribution, phong) in [(Distribution::Ggx, false), (Distribution::Phong, true)] {
        let flags = Flags::new().with("SPECULAR", true).with("NORMAL_MAP", true).with("NDF_PHONG", phong);
        let found: Vec<[f32; 8]> = evaluate(gpu, wgsl, &flags, &rows).unwrap();
        let (mut dark, mut expected, mut got) = (0, Vec::new(), Vec::new());
        for (given, found) in rows.iter().zip(&found) {
            assert!(found.iter().all(|value| value.is_finite() && *value >= 0.0), "{given:?} {found:?}");
            let (n, geometric, l, v) = (xyz(&given[..3]), xyz(&given[4..7]), xyz(&given[8..11]), xyz(&given[12..15]));
            let brdf = Brdf::new(DVec3::new(0.9, 0.5, 0.1), given[7].into(), given[3].into(), given[11].into(), distribution);
            let f = brdf.evaluate_brdf(n, geometric, l, v);
            // Which side a direction is on is a matter of rounding within 1e-6 of the horizon.
            let clear = [n.dot(l), n.dot(v), geometric.dot(l), geometric.dot(v)].iter().all(|cosine| cosine.abs() > 1e-6);
            if clear {
                assert_eq!(f == DVec3::ZERO, xyz(&found[..3]) == DVec3::ZERO, "{given:?}");
                dark += u32::from(f == DVec3::ZERO);
            }
            expected.extend(brdf.albedo_estimate(given[15].into()).to_array());
            got.extend([found[4], found[5], found[6]].map(f64::from));
        }
        assert!((4000..36_000).contains(&dark), "{dark}");
        compare(&expected, &got, 1e-4, 1e-5).unwrap();
    }
    // Without NORMAL_MAP the geometric normal plays no part, without SPECULAR only Lambert is left.
    let lambert: Vec<[f32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for (given, found) in rows.iter().zip(&lambert) {
        let lit = xyz(&given[..3]).dot(xyz(&given[8..11])) > 1e-6 && xyz(&given[..3]).dot(xyz(&given[12..15])) > 1e-6;
        if lit {
            let expected = 0.9 * (1.0 - given[7]) / std::f32::consts::PI;
            assert!((found[0] - expected).abs() < 1e-6, "{given:?} {found:?}");
        }
    }
}

#[test]
fn ray_origins_leave_the_surface_and_not_much_more() {
    let Some(gpu) = gpu() else { return };
    let wgsl = "#import lobelia::ray::offset_ray_origin
struct Input { position: vec4f, normal: vec4f }
struct Output { origin: vec4f }
fn evaluate(input: Input) -> Output {
    return Output(vec4f(offset_ray_origin(input.position.xyz, input.normal.xyz, 0.0), 0.0));
}";
    let rows: Vec<[f32; 8]> = (0..20_000u32)
        .map(|index| {
            let [a, _] = r2_point(index, 1);
            let position = direction(index, 2) * 10f64.powf(9.0 * a - 5.0);
            let normal = match index % 8 {
                0 => Vec3::AXES[index as usize / 8 % 3].as_dvec3(),
                1 => -Vec3::AXES[index as usize / 8 % 3].as_dvec3(),
                _ => direction(index, 3),
            };
            [row(position, 0.0), row(normal, 0.0)].concat().try_into().unwrap()
        })
        .collect();
    let found: Vec<[f32; 4]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    for (given, found) in rows.iter().zip(&found) {
        let (position, normal) = (xyz(&given[..3]), xyz(&given[4..7]));
        let moved = xyz(&found[..3]) - position;
        let size = position.abs().max_element();
        assert!(moved.dot(normal) > 0.0, "{given:?} {found:?}");
        // At most 256 units in the last place of an axis, or 2^-16 m.
        assert!(moved.abs().max_element() <= 257.0 * size * 2f64.powi(-23) + 2f64.powi(-15), "{given:?} {found:?}");
    }
}
