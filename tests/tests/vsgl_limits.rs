//! One virtual spherical Gaussian light, one surface: the limits of its closed forms, and ten million random pairs.
#![allow(clippy::unwrap_used)]

use lobelia::graph::{Gpu, testing::evaluate, testing::gpu};
use lobelia::shaders::Flags;

fn flags(names: &[&str]) -> Flags {
    names.iter().fold(Flags::default(), |flags, name| flags.with(name, true))
}

/// A receiver at the origin with normal +Z, a light at `place` that is lit from `to_source`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Pair {
    place: [f32; 4],
    light_normal: [f32; 4],
    to_source: [f32; 4],
    to_viewer: [f32; 4],
    /// Radius, roughness of the light, of the receiver, scale of both specular lobes.
    numbers: [f32; 4],
}

const SETTING: &str = "
#import lobelia::brdf::{brdf_from_surface, evaluate_brdf}
#import lobelia::octahedral::octahedral_pack
#import lobelia::surface::{Surface, pack_surface}
#import lobelia::virtual_lights::{VirtualLight, virtual_light_surface}
#import lobelia::vsgl::{SgLight, sg_light_of_lobes, sg_light_of_point, sg_receiver, vsgl_accurate, vsgl_fast, vsgl_gaussian, vsgl_printed}

struct Input { place: vec4f, light_normal: vec4f, to_source: vec4f, to_viewer: vec4f, numbers: vec4f }

fn surface_of(normal: vec3f, roughness: f32, specular: f32) -> Surface {
    var surface: Surface;
    surface.normal = normal;
    surface.geometric_normal = normal;
    surface.base_color = vec3f(0.6, 0.4, 0.2);
    surface.roughness = roughness;
    surface.metallic = 0.5;
    surface.specular = specular;
    return surface;
}

fn point_of(input: Input) -> VirtualLight {
    let surface = surface_of(input.light_normal.xyz, input.numbers.y, input.numbers.w);
    var point: VirtualLight;
    point.position = input.place.xyz;
    point.flux = vec3f(3.0, 2.0, 1.0);
    point.geometric_normal = octahedral_pack(surface.normal);
    point.direction_to_source = input.to_source.xyz;
    let packed = pack_surface(surface);
    point.core = packed.core;
    point.specular = packed.specular;
    return point;
}

fn light_of(input: Input) -> SgLight {
    var light = sg_light_of_point(point_of(input));
    light.radius = input.numbers.x;
    return light;
}
";

/// x, y, z: the form; w of each: nothing.
fn shaded(gpu: &Gpu, form: &str, flags: &Flags, pairs: &[Pair]) -> Vec<[f32; 4]> {
    let body = format!(
        "{SETTING}
        struct Output {{ value: vec4f }}
        fn evaluate(input: Input) -> Output {{
            let surface = surface_of(vec3f(0.0, 0.0, 1.0), input.numbers.z, input.numbers.w);
            let receiver = sg_receiver(vec3f(0.0), surface, brdf_from_surface(surface), input.to_viewer.xyz);
            return Output(vec4f({form}(receiver, light_of(input)), 0.0));
        }}"
    );
    evaluate(gpu, &body, flags, pairs).unwrap()
}

/// The virtual point light, with the reflectance of both ends.
fn as_point(gpu: &Gpu, flags: &Flags, pairs: &[Pair]) -> Vec<[f32; 4]> {
    let body = format!(
        "{SETTING}
        struct Output {{ value: vec4f }}
        fn evaluate(input: Input) -> Output {{
            let surface = surface_of(vec3f(0.0, 0.0, 1.0), input.numbers.z, input.numbers.w);
            // As the record holds it: normals in 16 bits.
            let other = virtual_light_surface(point_of(input));
            let d = length(input.place.xyz);
            let w = input.place.xyz / d;
            let emitted = evaluate_brdf(brdf_from_surface(other), other.normal, other.normal, input.to_source.xyz, -w) * max(-dot(other.normal, w), 0.0);
            let reflected = evaluate_brdf(brdf_from_surface(surface), surface.normal, surface.normal, w, input.to_viewer.xyz) * max(w.z, 0.0);
            return Output(vec4f(vec3f(3.0, 2.0, 1.0) * emitted * reflected / (d * d), 0.0));
        }}"
    );
    evaluate(gpu, &body, flags, pairs).unwrap()
}

fn unit(v: [f32; 3]) -> [f32; 4] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    [v[0] / length, v[1] / length, v[2] / length, 0.0]
}

fn pairs(radius_over_distance: f32, specular: f32) -> Vec<Pair> {
    let mut all = Vec::new();
    for distance in [1e-3f32, 0.3, 10.0, 3000.0] {
        for height in [0.05f32, 0.4, 0.9] {
            for roughness in [0.15f32, 0.4, 0.7, 1.0] {
                for other in [0.2f32, 0.6, 1.0] {
                    for turn in 0..4 {
                        let angle = turn as f32 * 1.3 + height;
                        let w = unit([angle.cos(), angle.sin(), height * 2.0]);
                        let place = [w[0] * distance, w[1] * distance, w[2] * distance, 0.0];
                        let light_normal = unit([-w[0] + 0.4, -w[1] - 0.2, -w[2] + 0.3]);
                        let to_source = unit([light_normal[0] + 0.5, light_normal[1] - 0.3, light_normal[2] + 0.1]);
                        let to_viewer = unit([-0.7 * angle.sin(), 0.6, 0.2 + height]);
                        all.push(Pair {
                            place,
                            light_normal,
                            to_source,
                            to_viewer,
                            numbers: [radius_over_distance * distance, other, roughness, specular],
                        });
                    }
                }
            }
        }
    }
    all
}

/// Largest relative difference of green, where anything is seen.
fn worst(expected: &[[f32; 4]], found: &[[f32; 4]]) -> f64 {
    assert_eq!(expected.len(), found.len());
    let seen: Vec<_> = expected.iter().zip(found).filter(|(expected, _)| expected[1] > 0.0).collect();
    assert!(seen.len() > expected.len() / 3, "most pairs see nothing of each other");
    seen.iter().map(|(expected, found)| (f64::from(found[1]) / f64::from(expected[1]) - 1.0).abs()).fold(0.0, f64::max)
}

#[test]
fn a_light_without_extent_is_a_point() {
    let Some(gpu) = gpu() else { return };
    let flags = flags(&["SPECULAR"]);
    for radius in [0.0, 1e-5] {
        let pairs = pairs(radius, 1.0);
        let expected = as_point(gpu, &flags, &pairs);
        for form in ["vsgl_fast", "vsgl_accurate"] {
            let error = worst(&expected, &shaded(gpu, form, &flags, &pairs));
            println!("{form}, radius {radius} of the distance: {error:.2e}");
            assert!(error < 1e-3, "{form} {radius}: {error}");
        }
    }
    // A light as wide as it is far is none.
    let wide = pairs(1.0, 1.0);
    assert!(worst(&as_point(gpu, &flags, &wide), &shaded(gpu, "vsgl_fast", &flags, &wide)) > 0.1);
}

/// Form factor between the receiver and a disk, by quadrature over the disk in f64.
fn disk_pair(pair: &Pair) -> f64 {
    let vector = |v: [f32; 4]| glam::DVec3::new(v[0].into(), v[1].into(), v[2].into());
    let (centre, normal, radius) = (vector(pair.place), vector(pair.light_normal), f64::from(pair.numbers[0]));
    let (t, b) = normal.any_orthonormal_pair();
    let (rings, turns) = (200, 200);
    let mut sum = 0.0;
    for ring in 0..rings {
        let r = radius * ((f64::from(ring) + 0.5) / f64::from(rings)).sqrt();
        for turn in 0..turns {
            let angle = (f64::from(turn) + 0.5) / f64::from(turns) * std::f64::consts::TAU;
            let y = centre + (t * angle.cos() + b * angle.sin()) * r;
            let d = y.length();
            sum += (y.z / d).max(0.0) * (-normal.dot(y) / d).max(0.0) / (d * d);
        }
    }
    sum / f64::from(rings * turns)
}

#[test]
fn without_lobes_it_is_a_lambertian_disk() {
    let Some(gpu) = gpu() else { return };
    for radius in [0.1f32, 0.5, 2.0] {
        let pairs: Vec<Pair> = pairs(radius, 0.0)
            .into_iter()
            .filter(|pair| {
                // Disks that are wholly above the horizon: only those are exact.
                let tilt = (1.0 - pair.light_normal[2] * pair.light_normal[2]).sqrt();
                pair.place[2] > 1.05 * pair.numbers[0] * tilt
            })
            .step_by(12)
            .collect();
        if pairs.is_empty() {
            continue;
        }
        let found = shaded(gpu, "vsgl_fast", &flags(&[]), &pairs);
        let mut worst: f64 = 0.0;
        for (pair, found) in pairs.iter().zip(&found) {
            // Green: flux 2, albedo 0.4 at the light (packed without lobes it has no metal) and half of that at the receiver.
            let expected = 2.0 * 0.4 * 0.2 / std::f64::consts::PI.powi(2) * disk_pair(pair);
            worst = worst.max((f64::from(found[1]) / expected - 1.0).abs());
        }
        println!("radius {radius} of the distance, {} pairs: {worst:.2e}", pairs.len());
        assert!(worst < 3e-3, "{radius}: {worst}");
    }
}

#[test]
fn at_no_distance_it_is_finite_and_steady() {
    let Some(gpu) = gpu() else { return };
    for form in ["vsgl_fast", "vsgl_accurate", "vsgl_gaussian", "vsgl_printed"] {
        let at = |distance: f32| {
            let pairs: Vec<Pair> = pairs(0.0, 1.0)
                .into_iter()
                .map(|pair| {
                    let w = unit([pair.place[0], pair.place[1], pair.place[2]]);
                    let down = [0.0, 0.0, -1.0, 0.0];
                    Pair {
                        place: w.map(|x| x * distance),
                        light_normal: down,
                        to_source: unit([0.3, 0.2, -1.0]),
                        numbers: [0.5, pair.numbers[1], pair.numbers[2], 1.0],
                        ..pair
                    }
                })
                .collect();
            shaded(gpu, form, &flags(&["SPECULAR"]), &pairs)
        };
        let (near, nearer, none) = (at(1e-4), at(1e-6), at(0.0));
        assert!(none.iter().chain(&near).flatten().all(|value| value.is_finite() && *value >= 0.0), "{form}");
        for (near, nearer) in near.iter().zip(&nearer) {
            assert!((near[1] - nearer[1]).abs() <= 2e-2 * near[1].max(nearer[1]), "{form}: {near:?} {nearer:?}");
        }
    }
}

/// Counts what must not be over pairs that a hash draws on the device, extremes among them. Bits are counted, since shaders may assume finite maths.
fn bad_values(gpu: &Gpu, form: &str, flags: &Flags, rows: usize, spoil: &str) -> u64 {
    let body = format!(
        "{SETTING}
        #import lobelia::sampling::{{hash, unit_float}}
        struct Row {{ seed: u32 }}
        struct Output {{ bad: u32 }}
        var<private> state: u32;
        fn next() -> f32 {{ state = hash(state); return unit_float(state); }}
        fn pick(values: array<f32, 8>) -> f32 {{ var all = values; return all[u32(next() * 8.0)]; }}
        fn direction() -> vec3f {{
            let z = 2.0 * next() - 1.0;
            let angle = 6.2831853 * next();
            let r = sqrt(max(1.0 - z * z, 0.0));
            return vec3f(r * cos(angle), r * sin(angle), z);
        }}
        // NaN or below zero. The pass bounds what a light adds, so it may be infinite here; what is not a number cannot be bounded.
        fn bad_bits(value: vec3f) -> u32 {{
            let bits = bitcast<vec3u>(value);
            let size = bits & vec3u(0x7fffffffu);
            return select(0u, 1u, any(size > vec3u(0x7f800000u)) || any((bits != size) & (size != vec3u(0u))));
        }}
        fn evaluate(row: Input) -> Output {{
            state = hash(row.seed);
            var bad = 0u;
            for (var pair = 0u; pair < 100u; pair++) {{
                let scale = pick(array<f32, 8>(1e-4, 1e-2, 1.0, 1.0, 1.0, 10.0, 1e3, 1e4));
                let ratio = pick(array<f32, 8>(0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e2, 1e4));
                let rough = array<f32, 8>(0.0, 0.02, 0.1, 0.2, 0.4, 0.7, 0.95, 1.0);
                let normal = direction();
                let light_normal = select(direction(), -normal, next() < 0.1);
                let surface = surface_of(normal, pick(rough), select(next(), 0.0, next() < 0.2));
                var other = surface_of(light_normal, pick(rough), select(next(), 0.0, next() < 0.2));
                var point: VirtualLight;
                point.position = direction() * scale * select(next(), 0.0, next() < 0.02);
                point.flux = vec3f(next(), next(), 0.0) * pick(array<f32, 8>(0.0, 1e-20, 1e-3, 1.0, 1.0, 1e6, 1e12, 1e20));
                point.geometric_normal = octahedral_pack(light_normal);
                point.direction_to_source = select(direction(), light_normal, next() < 0.1);
                let packed = pack_surface(other);
                point.core = packed.core;
                point.specular = packed.specular;
                var light = sg_light_of_point(point);
                light.radius = scale * ratio;
                light.spread = pick(array<f32, 8>(0.0, 0.0, 0.0, 1e-6, 1e-3, 0.1, 0.7, 1.0));
                light.sharpness = pick(array<f32, 8>(0.0, 1e-6, 0.1, 1.0, 30.0, 1e4, 1e6, 1e8));
                light.widening = 0.5 * next() * next() * next();
                let to_viewer = select(direction(), normal, next() < 0.1);
                let receiver = sg_receiver(vec3f(0.0), surface, brdf_from_surface(surface), to_viewer);
                var value = {form}(receiver, light);
                {spoil}
                bad += bad_bits(value);
            }}
            return Output(bad);
        }}"
    )
    .replace(
        "struct Input { place: vec4f, light_normal: vec4f, to_source: vec4f, to_viewer: vec4f, numbers: vec4f }",
        "struct Input { seed: u32 }",
    );
    // The setting's helpers of the other layout are not used here.
    let start = body.find("fn point_of").unwrap();
    let end = body.find("#import lobelia::sampling").unwrap();
    let text = format!("{}{}", &body[..start], &body[end..]).replace("struct Row { seed: u32 }", "");
    let seeds: Vec<u32> = (0..rows as u32).collect();
    evaluate::<u32, u32>(gpu, &text, flags, &seeds).unwrap().into_iter().map(u64::from).sum()
}

#[test]
fn ten_million_pairs_have_no_value_that_must_not_be() {
    let Some(gpu) = gpu() else { return };
    let glossy = flags(&["SPECULAR"]);
    assert_eq!(bad_values(gpu, "vsgl_fast", &glossy, 100_000, ""), 0);
    for form in ["vsgl_accurate", "vsgl_printed", "vsgl_gaussian"] {
        assert_eq!(bad_values(gpu, form, &glossy, 10_000, ""), 0, "{form}");
    }
    let phong = flags(&["SPECULAR", "NDF_PHONG"]);
    for form in ["vsgl_fast", "vsgl_accurate", "vsgl_printed"] {
        assert_eq!(bad_values(gpu, form, &phong, 10_000, ""), 0, "{form} of Phong");
    }
    // The counter counts.
    for spoil in ["if pair == 7u { value.y = -1e-30; }", "if pair == 7u { value.x = bitcast<f32>(0x7fc00000u + pair); }"] {
        assert!(bad_values(gpu, "vsgl_fast", &glossy, 100, spoil) >= 100, "{spoil}");
    }
}
