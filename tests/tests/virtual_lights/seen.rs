//! `visibility` of a screen between two planes: whether a segment crosses a rectangle is known.

use crate::given::{EXTENT, Given, PIXELS, Pixel, Random, light, pack_unit, position, run, turn, view};
use glam::{DMat4, DVec3, Vec2, Vec3, Vec4};
use lobelia::{
    graph::{PartData, testing::gpu},
    scene::{Mesh, Scene},
};
use std::sync::Arc;

/// A rectangle x, y in [-0.5, 0.5] at z = -2, and the wall at z = -4 that pixels see. Scene space is world space: its origin is rounded away.
fn scene() -> Scene {
    let mut scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let mut mesh = Mesh::default();
    for (half, z) in [(0.5, -2.0), (8.0, -4.0)] {
        let start = mesh.positions.len() as u32;
        for [x, y] in [[-half, -half], [half, -half], [half, half], [-half, half]] {
            mesh.positions.push(Vec3::new(x, y, z));
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
    // Moving the mesh moved the origin, unless the scene's was fixed when it was loaded.
    assert_eq!(scene.origin(), origin);
    scene
}

/// By how much a segment passes inside (positive) or outside of the rectangle; negative infinity if it does not reach its plane.
fn margin(from: DVec3, to: DVec3) -> f64 {
    let t = (-2.0 - from.z) / (to.z - from.z);
    let place = from + (to - from) * t;
    if (0.0..=1.0).contains(&t) { 0.5 - place.x.abs().max(place.y.abs()) } else { f64::NEG_INFINITY }
}

#[test]
fn bits_are_those_of_the_rectangle() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let camera = view(&scene);
    let mut random = Random(21);
    let count = 70u32;
    let pixel = Pixel { depth: camera.near / 4.0, core: [pack_unit(DVec3::Z), 0], specular: 0, geometric_normal: pack_unit(DVec3::Z) };
    let mut given = Given { pixels: vec![pixel; PIXELS], ..Given::default() };
    // What is not there sees nothing.
    given.pixels[7].depth = 0.0;
    for index in 0..count {
        let spread = |random: &mut Random| 3.0 * random.next() - 1.5;
        // Every fourth lies between the rectangle and the wall; a few lie on the wall itself.
        let z = if index % 16 == 3 {
            -4.0
        } else if index % 4 == 3 {
            -3.0
        } else {
            -1.0
        };
        let place = DVec3::new(spread(&mut random), spread(&mut random), z);
        let mut light = light(&mut random, place, DVec3::NEG_Z);
        light.geometric_normal = pack_unit(if z == -4.0 { DVec3::Z } else { DVec3::NEG_Z });
        given.lights.push(light);
    }
    for interleave in [1u32, 3] {
        let text = format!(
            r#"(passes: {{
                "surfaces": given_gbuffer(),
                "lights": given_lights(count: {count}),
                "visibility": visibility(interleave: {interleave}),
            }}, output: "visibility.visibility")"#
        );
        let _turn = turn();
        let runner = run(gpu, &text, &scene, &given, &[], 0).unwrap();
        let read = runner.read(gpu, "visibility.visibility").unwrap();
        let [(_, PartData::Buffer(bytes))] = &read[..] else { panic!("one chunk") };
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytes);
        let (mut seen, mut hidden) = (0, 0);
        for index in 0..PIXELS {
            let (x, y) = (index as u32 % EXTENT[0], index as u32 / EXTENT[0]);
            let subset = x % interleave + interleave * (y % interleave);
            for number in (0..count).filter(|number| number % (interleave * interleave) == subset) {
                let order = number / (interleave * interleave);
                let bit = words[order as usize / 32 * PIXELS + index] >> (order % 32) & 1 == 1;
                if index == 7 {
                    assert!(!bit, "nothing is there");
                    continue;
                }
                let (from, to) = (position(&camera, index, pixel.depth), given.lights[number as usize].position.as_dvec3());
                let margin = margin(from, to);
                if to.z == -4.0 || margin.abs() < 1e-3 {
                    // In the wall's own plane nothing is reflected; at the rim it counts that rays start a 256th of a pixel, 0.7 mm, off the wall.
                    continue;
                }
                assert_eq!(bit, margin < 0.0, "interleave {interleave}, pixel {x}, {y}, light {number}: {from} to {to}, margin {margin}");
                *(if bit { &mut seen } else { &mut hidden }) += 1;
            }
        }
        let all = PIXELS * count as usize / (interleave * interleave) as usize;
        assert!(seen > all / 2 && hidden > all / 20, "{seen} seen and {hidden} hidden of {all}");
    }
}
