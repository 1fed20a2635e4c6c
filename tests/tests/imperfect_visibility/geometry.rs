//! A square between lights and a wall: whether a segment crosses it is known.

use crate::{
    Bits,
    given::{Given, PIXELS, Pixel, Random, light, pack_unit, position, run, turn, view},
};
use glam::{DMat4, DVec3, Vec2, Vec3, Vec4};
use lobelia::{
    graph::{Gpu, testing::gpu},
    scene::{Mesh, Scene},
};
use std::sync::Arc;

pub const LIGHTS: u32 = 70;

/// A scene of upright rectangles: half width, half height, z. Scene space is world space.
pub fn rectangles(list: &[(f32, f32, f32)]) -> Scene {
    let mut scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let mut mesh = Mesh::default();
    for (half_x, half_y, z) in list {
        let start = mesh.positions.len() as u32;
        for [x, y] in [[-half_x, -half_y], [*half_x, -half_y], [*half_x, *half_y], [-half_x, *half_y]] {
            mesh.positions.push(Vec3::new(x, y, *z));
            mesh.normals.push(Vec3::Z);
            mesh.tangents.push(Vec4::ZERO);
            mesh.uvs.push(Vec2::ZERO);
        }
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| start + corner));
    }
    scene.meshes = Arc::new(vec![mesh]);
    scene.instances.truncate(1);
    scene.instances[0].mesh = 0;
    scene.instances[0].world_from_local = DMat4::IDENTITY;
    let origin = scene.origin();
    scene.instances[0].world_from_local = DMat4::from_translation(origin);
    assert_eq!(scene.origin(), origin);
    scene
}

/// A square of one metre at z = -2 and a wall at z = -4, both `scale` times as large.
pub fn scene(scale: f32) -> Scene {
    rectangles(&[(0.5 * scale, 0.5 * scale, -2.0 * scale), (3.0 * scale, 3.0 * scale, -4.0 * scale)])
}

/// Every pixel sees the wall; lights are spread before the square, facing it.
pub fn given(scale: f32) -> Given {
    let mut random = Random(5);
    // The camera's near plane is at 0.01.
    let pixel = Pixel { depth: 0.01 / (4.0 * scale), core: [pack_unit(DVec3::Z), 0], specular: 0, geometric_normal: pack_unit(DVec3::Z) };
    let mut given = Given { pixels: vec![pixel; PIXELS], ..Given::default() };
    given.pixels[7].depth = 0.0;
    for _ in 0..LIGHTS {
        let place = DVec3::new(2.4 * random.next() - 1.2, 2.4 * random.next() - 1.2, -1.0) * f64::from(scale);
        let mut light = light(&mut random, place, DVec3::NEG_Z);
        light.geometric_normal = pack_unit(DVec3::NEG_Z);
        given.lights.push(light);
    }
    given
}

pub fn bits(gpu: &Gpu, scene: &Scene, given: &Given, interleave: u32, settings: &str, seed: u32) -> Bits {
    let count = given.lights.len();
    let text = format!(
        r#"(passes: {{
            "surfaces": given_gbuffer(),
            "lights": given_lights(count: {count}),
            "visibility": aism(interleave: {interleave}, {settings}),
        }}, output: "visibility.visibility")"#
    );
    let _turn = turn();
    Bits::read(&run(gpu, &text, scene, given, &[], seed).unwrap(), gpu, interleave)
}

/// By how much a segment passes inside (positive) or outside of the square at `scale` 1.
fn margin(from: DVec3, to: DVec3) -> f64 {
    let place = from + (to - from) * ((-2.0 - from.z) / (to.z - from.z));
    0.5 - place.x.abs().max(place.y.abs())
}

#[derive(Debug, Default, PartialEq)]
pub struct Errors {
    /// Seen, but hidden.
    pub leaks: usize,
    /// Hidden, but seen.
    pub dark: usize,
    pub hidden: usize,
    pub seen: usize,
}

/// Errors of segments that pass the square's rim at a distance of `clear` or more; `shift` moves the square that is expected.
pub fn errors(bits: &Bits, given: &Given, clear: f64, shift: DVec3) -> Errors {
    let camera = view(&scene(1.0));
    let mut errors = Errors::default();
    for pixel in (0..PIXELS).filter(|pixel| *pixel != 7) {
        for light in 0..LIGHTS {
            let (from, to) = (position(&camera, pixel, given.pixels[pixel].depth), given.lights[light as usize].position.as_dvec3());
            let margin = margin(from + shift, to + shift);
            match bits.sees(pixel, light) {
                Some(seen) if margin.abs() > clear => match (seen, margin > 0.0) {
                    (seen, true) => (errors.hidden, errors.leaks) = (errors.hidden + 1, errors.leaks + usize::from(seen)),
                    (seen, false) => (errors.seen, errors.dark) = (errors.seen + 1, errors.dark + usize::from(!seen)),
                },
                _ => {}
            }
        }
    }
    errors
}

#[test]
fn away_from_silhouettes_bits_are_right() {
    let Some(gpu) = gpu() else { return };
    let (scene, given) = (scene(1.0), given(1.0));
    for settings in ["sampling: adaptive", "sampling: uniform, points: 65536, spread: 2.0", "sampling: adaptive, view_samples: 0"] {
        for interleave in [1, 3] {
            let bits = bits(gpu, &scene, &given, interleave, settings, 0);
            // Of texels 2.5 / 64 wide, seen at up to 2 m, the two next to the rim.
            let found = errors(&bits, &given, 0.15, DVec3::ZERO);
            println!("{settings}, interleave {interleave}: {found:?}");
            assert!(found.hidden > 700 && found.seen > 3000, "{found:?}");
            assert_eq!(found.dark, 0, "{settings}, interleave {interleave}: {found:?}");
            // Points are random: two gaps next to each other are rare, but no accident.
            assert!(found.leaks * 400 <= found.hidden, "{settings}, interleave {interleave}: {found:?}");
            assert!((0..LIGHTS).all(|light| bits.sees(7, light) != Some(true)), "nothing is there");
            // What the comparison is worth: a square elsewhere is noticed.
            let elsewhere = errors(&bits, &given, 0.15, DVec3::new(0.3, 0.0, 0.0));
            assert!(elsewhere.leaks * 20 > elsewhere.hidden && elsewhere.dark * 50 > elsewhere.seen, "{elsewhere:?}");
        }
    }
}

#[test]
fn holes_leak_and_pull_push_closes_them() {
    let Some(gpu) = gpu() else { return };
    let (scene, given) = (scene(1.0), given(1.0));
    // Uniform points go to the wall mostly, so that as few hit the square as here with eight times fewer adaptive ones.
    for (sampling, points) in [("adaptive", 1024), ("uniform", 8192)] {
        let found = |pull_push: bool, spread: f32| {
            let settings = format!("sampling: {sampling}, points: {points}, spread: {spread}, pull_push: {pull_push}");
            errors(&bits(gpu, &scene, &given, 1, &settings, 0), &given, 0.15, DVec3::ZERO)
        };
        let (narrow, narrow_closed) = (found(false, 0.7), found(true, 0.7));
        let (wide, wide_closed) = (found(false, 1.25), found(true, 1.25));
        println!("{sampling}: {narrow:?} {narrow_closed:?} {wide:?} {wide_closed:?}");
        assert!(narrow.leaks > narrow_closed.leaks + 200, "{sampling}: {narrow:?} without, {narrow_closed:?} with pull-push");
        assert!(wide.leaks > 2 * wide_closed.leaks, "{sampling}: {wide:?} without, {wide_closed:?} with pull-push");
        assert!(narrow.leaks > 3 * wide.leaks, "disks that do not meet leak more: {narrow:?} {wide:?}");
        for closed in [narrow_closed, wide_closed] {
            assert!(closed.dark * 1000 < closed.seen, "what closes holes darkens nothing far from shadows: {closed:?}");
        }
    }
}

#[test]
fn equal_seeds_give_equal_bits() {
    let Some(gpu) = gpu() else { return };
    let (scene, given) = (scene(1.0), given(1.0));
    for sampling in ["adaptive", "uniform"] {
        let words =
            |run: u32, own: u32| bits(gpu, &scene, &given, 1, &format!("sampling: {sampling}, points: 512, seed: {own}"), run).words;
        let first = words(0, 0);
        assert!(first == words(0, 0), "{sampling}: one seed, one answer");
        assert!(first != words(1, 0) && first != words(0, 1), "{sampling}: other seeds choose other points");
        assert!(words(1, 2) == words(3, 0), "the pass's seed is added to the run's");
    }
}
