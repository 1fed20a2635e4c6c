//! Input at the ends of what is allowed: right, never garbage.

use crate::{
    geometry::{LIGHTS, bits, errors, given, rectangles, scene},
    given::{Given, PIXELS, Random, light, pack_unit},
};
use glam::DVec3;
use lobelia::{graph::testing::gpu, scene::Scene};

#[test]
fn batches_and_interleaving_change_no_bit() {
    let Some(gpu) = gpu() else { return };
    let (scene, mut given) = (scene(1.0), given(1.0));
    // More lights than maps of 256^2 texels fit at once.
    let mut random = Random(9);
    for _ in LIGHTS..420 {
        given.lights.push(light(&mut random, DVec3::new(0.3, 0.1, -1.0), DVec3::NEG_Z));
    }
    let settings = "resolution: 256, points: 256, candidates: 256";
    let whole = bits(gpu, &scene, &given, 1, settings, 0);
    let small = bits(gpu, &scene, &Given { lights: given.lights[..LIGHTS as usize].to_vec(), ..given.clone() }, 1, settings, 0);
    for interleave in [3, 8] {
        let part = bits(gpu, &scene, &given, interleave, settings, 0);
        let (mut seen, mut known) = (0, 0);
        for pixel in 0..PIXELS {
            for light in 0..420 {
                if let Some(bit) = part.sees(pixel, light) {
                    assert_eq!(whole.sees(pixel, light), Some(bit), "interleave {interleave}, pixel {pixel}, light {light}");
                    (seen, known) = (seen + usize::from(bit), known + 1);
                }
            }
        }
        assert!(seen > known / 4 && seen < known, "{seen} of {known}");
    }
    assert!((0..PIXELS).all(|pixel| (0..LIGHTS).all(|light| whole.sees(pixel, light) == small.sees(pixel, light))));
}

#[test]
fn size_of_the_scene_does_not_matter() {
    let Some(gpu) = gpu() else { return };
    let reference = given(1.0);
    // The largest map has one texel a point, and more gaps than the others.
    for (scale, settings, share) in
        [(4e-3, "", 1000), (3e3, "", 1000), (1.0, "resolution: 256, points: 65536", 60), (1.0, "points: 65536", 1000)]
    {
        let bits = bits(gpu, &scene(scale), &given(scale), 1, settings, 0);
        let found = errors(&bits, &reference, 0.15, DVec3::ZERO);
        println!("scale {scale}, {settings}: {found:?}");
        assert!(found.hidden > 7000 && found.seen > 30_000);
        assert!(found.leaks * share <= found.hidden && found.dark == 0, "scale {scale}, {settings}: {found:?}");
    }
}

/// Pixels that see one light.
fn lit(scene: &Scene, lights: &Given, settings: &str) -> usize {
    let bits = bits(gpu().unwrap(), scene, lights, 1, settings, 0);
    (0..PIXELS).filter(|pixel| bits.sees(*pixel, 0) == Some(true)).count()
}

#[test]
fn what_is_not_there_hides_nothing() {
    if gpu().is_none() {
        return;
    }
    let mut one = given(1.0);
    one.lights.truncate(1);
    one.lights[0].position = glam::Vec3::new(0.0, 0.0, -1.0);
    let mut dark = one.clone();
    dark.lights[0].flux = glam::Vec3::ZERO;
    // Of no area: a line and a point.
    let degenerate = rectangles(&[(0.5, 0.0, -2.0), (0.0, 0.0, -1.5)]);
    let mut empty = scene(1.0);
    empty.instances.clear();
    for settings in ["", "sampling: uniform", "pull_push: false", "resolution: 8", "points: 16"] {
        assert_eq!(lit(&empty, &one, settings), PIXELS - 1, "no triangles, {settings}");
        assert_eq!(lit(&degenerate, &one, settings), PIXELS - 1, "no area, {settings}");
        assert_eq!(lit(&rectangles(&[(3.0, 3.0, -4.0)]), &one, settings), PIXELS - 1, "only the wall itself, {settings}");
    }
    let shaded = lit(&scene(1.0), &one, "");
    assert!(shaded > 0 && shaded < PIXELS * 3 / 4, "{shaded}");
    assert_eq!(lit(&scene(1.0), &dark, ""), shaded, "what a light sends is nothing to its map");
    assert_eq!(
        lit(&rectangles(&[(0.5, 0.5, -2.0), (0.5, 0.0, -1.5), (3.0, 3.0, -4.0)]), &one, ""),
        shaded,
        "beside triangles without area"
    );
}

#[test]
fn lights_upon_and_inside_surfaces_leave_bits_that_can_be() {
    let Some(gpu) = gpu() else { return };
    let mut at = given(1.0);
    at.lights.truncate(4);
    // In the square's plane, on the wall where a pixel is, behind the wall, nowhere.
    for (light, z) in at.lights.iter_mut().zip([-2.0, -4.0, -4.5, 0.0]) {
        light.position = glam::Vec3::new(0.05, 0.05, z);
    }
    at.lights[0].geometric_normal = pack_unit(DVec3::NEG_Z);
    at.lights[1].geometric_normal = pack_unit(DVec3::Z);
    at.lights[3].geometric_normal = pack_unit(DVec3::Z);
    for settings in ["", "sampling: uniform", "resolution: 8"] {
        let bits = bits(gpu, &scene(1.0), &at, 1, settings, 0);
        let seen = |light| (0..PIXELS).filter(|pixel| bits.sees(*pixel, light) == Some(true)).count();
        assert_eq!(seen(0), PIXELS - 1, "the square does not hide a light on it, {settings}");
        assert_eq!((seen(1), seen(2), seen(3)), (0, 0, 0), "in the plane of receivers, behind them, turned away: {settings}");
    }
}

#[test]
fn as_many_lights_as_there_may_be() {
    let Some(gpu) = gpu() else { return };
    let mut many = given(1.0);
    let lights = many.lights.clone();
    many.lights = lights.iter().cycle().take(65_536).cloned().collect();
    let bits = bits(gpu, &scene(1.0), &many, 8, "points: 16, resolution: 8, candidates: 256, view_samples: 64", 0);
    let seen = (0..PIXELS).flat_map(|pixel| (0..65_536).map(move |light| (pixel, light))).filter_map(|(p, l)| bits.sees(p, l));
    let (count, lit) = seen.fold((0, 0), |(count, lit), bit| (count + 1, lit + usize::from(bit)));
    assert_eq!(count, PIXELS * 1024);
    assert!(lit > count / 4 && lit < count, "{lit} of {count}");
}
