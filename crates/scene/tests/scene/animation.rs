//! Scenes that move.

use crate::glb::Glb;
use glam::DVec3;
use lobelia_scene::Scene;
use serde_json::json;

const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;

fn place(scene: &mut Scene, seconds: f32) -> DVec3 {
    scene.set_time(seconds);
    scene.instances[0].world_from_local.transform_point3(DVec3::X)
}

fn close(left: DVec3, right: DVec3) {
    assert!((left - right).length() < 1e-6, "{left} is not {right}");
}

#[test]
fn linear_translation_is_clamped_to_its_ends() {
    let mut glb = Glb::triangle();
    glb.animate(0, "translation", "LINEAR", &[1.0, 3.0], &[0., 0., 0., 8., 0., 4.]);
    let mut scene = glb.load().unwrap();
    close(place(&mut scene, 0.0), DVec3::new(1.0, 0.0, 0.0));
    close(place(&mut scene, 1.5), DVec3::new(3.0, 0.0, 1.0));
    close(place(&mut scene, 3.0), DVec3::new(9.0, 0.0, 4.0));
    for beyond in [99.0, f32::INFINITY] {
        close(place(&mut scene, beyond), DVec3::new(9.0, 0.0, 4.0));
    }
    for before in [-99.0, f32::NEG_INFINITY, f32::NAN] {
        close(place(&mut scene, before), DVec3::new(1.0, 0.0, 0.0));
    }
    let traits = scene.traits();
    assert!(traits.animated);
    assert_eq!(traits.animation_seconds, 3.0);
}

#[test]
fn steps_hold_and_rotations_take_the_short_way() {
    let mut glb = Glb::triangle();
    glb.animate(0, "scale", "STEP", &[0.0, 1.0], &[2., 2., 2., 3., 3., 3.]);
    // A quarter turn about Z, with its quaternion's sign turned over.
    glb.animate(0, "rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 0., -HALF, -HALF]);
    let mut scene = glb.load().unwrap();
    close(place(&mut scene, 0.0), DVec3::new(2.0, 0.0, 0.0));
    let eighth = std::f64::consts::FRAC_1_SQRT_2 * 2.0;
    close(place(&mut scene, 0.5), DVec3::new(eighth, eighth, 0.0));
    close(place(&mut scene, 1.0), DVec3::new(0.0, 3.0, 0.0));
}

#[test]
fn cubic_splines_follow_their_tangents() {
    let mut glb = Glb::triangle();
    // Over two seconds from 0 to 4, leaving with 3 m/s and arriving with 1 m/s. (in, value, out) for each key.
    let values = [[9., 9., 9.], [0., 0., 0.], [3., 0., 0.], [1., 0., 0.], [4., 0., 0.], [9., 9., 9.]].concat();
    glb.animate(0, "translation", "CUBICSPLINE", &[0.0, 2.0], &values);
    let mut scene = glb.load().unwrap();
    // At t = 1/2: (0 + 4) / 2 + (3 - 1) * 2 / 8 = 2.5.
    close(place(&mut scene, 1.0), DVec3::new(1.0 + 2.5, 0.0, 0.0));
    close(place(&mut scene, 2.0), DVec3::new(5.0, 0.0, 0.0));
    // Slope at the start, by a small step.
    let step = 1e-3;
    assert!((place(&mut scene, step).x - 1.0 - 3.0 * f64::from(step)).abs() < 1e-5);
}

#[test]
fn lights_and_cameras_follow_the_nodes_they_hang_below() {
    let mut glb = Glb::triangle();
    let light = glb.light(json!({"type": "point"}));
    let still = glb.light(json!({"type": "point"}));
    glb.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1}}));
    let lamp = glb.child(json!({"name": "lamp", "translation": [0, 1, 0], "extensions": {"KHR_lights_punctual": {"light": light}}}));
    let eye = glb.child(json!({"name": "eye", "camera": 0}));
    let area = glb.child(json!({"extras": {"area_light": {"shape": "sphere", "radius": 0.1, "radiance": [1, 1, 1]}}}));
    let arm = glb.node(json!({"children": [lamp, eye, area]}));
    glb.node(json!({"name": "still", "extensions": {"KHR_lights_punctual": {"light": still}}}));
    // Half a turn about Y.
    glb.animate(arm, "rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 1., 0., 0.]);
    glb.animate(arm, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 5., 0., 0.]);
    let mut scene = glb.load().unwrap();
    assert_eq!(scene.lights.iter().map(|light| light.animated).collect::<Vec<_>>(), [true, false]);
    let origin = scene.origin();
    scene.set_time(1.0);
    close(scene.lights[0].position, DVec3::new(5.0, 1.0, 0.0));
    close(scene.lights[0].direction, DVec3::Z);
    close(scene.lights[1].position, DVec3::ZERO);
    close(scene.camera(None).unwrap().position, DVec3::new(5.0, 0.0, 0.0));
    close(scene.camera(None).unwrap().forward, DVec3::Z);
    close(scene.area_lights[0].world_from_local.transform_point3(DVec3::ZERO), DVec3::new(5.0, 0.0, 0.0));
    let surface = scene.instances.iter().find(|instance| instance.area_light == Some(0)).unwrap();
    assert_eq!(surface.world_from_local, scene.area_lights[0].world_from_local);
    // Scene space must not jump while things move.
    assert_eq!(scene.origin(), origin);
}

#[test]
fn the_version_grows_only_when_something_moves() {
    let mut glb = Glb::triangle();
    glb.animate(0, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 8., 0., 4.]);
    let mut scene = glb.load().unwrap();
    let start = scene.geometry_version();
    scene.set_time(0.0);
    assert_eq!(scene.geometry_version(), start);
    scene.set_time(0.5);
    let moved = scene.geometry_version();
    assert!(moved > start);
    scene.set_time(0.5);
    assert_eq!(scene.geometry_version(), moved);
    let mut still = Glb::triangle().load().unwrap();
    still.set_time(0.5);
    assert_eq!(still.geometry_version(), 0);
}

#[test]
fn broken_animations_are_refused() {
    let refused = |path: &str, interpolation: &str, times: &[f32], values: &[f32]| {
        let mut glb = Glb::triangle();
        glb.animate(0, path, interpolation, times, values);
        glb.error()
    };
    let error = refused("translation", "LINEAR", &[0.0, 1.0], &[0.0; 3]);
    assert!(error.contains("animation 0, channel 0: 2 keys do not go with 1 values"), "{error}");
    let error = refused("translation", "CUBICSPLINE", &[0.0, 1.0], &[0.0; 6]);
    assert!(error.contains("2 keys do not go with 2 values"), "{error}");
    let error = refused("translation", "LINEAR", &[1.0, 1.0], &[0.0; 6]);
    assert!(error.contains("key times must rise"), "{error}");
    let error = refused("translation", "LINEAR", &[0.0, f32::NAN], &[0.0; 6]);
    assert!(error.contains("all numbers be finite"), "{error}");
    let error = refused("rotation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 1., 0., 0., 0., 0.]);
    assert!(error.contains("animation 0, channel 0: a rotation is the zero quaternion"), "{error}");
    let mut glb = Glb::triangle();
    glb.json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    glb.animate(0, "translation", "LINEAR", &[0.0], &[0.0; 3]);
    assert!(glb.error().contains("it animates a node that has a matrix"));
}

#[test]
fn channels_must_move_something_that_is_there() {
    let mut glb = Glb::triangle();
    glb.animate(7, "translation", "LINEAR", &[0.0], &[0.0; 3]);
    assert!(glb.error().contains("animation 0, channel 0: it moves node 7, but there are 1 nodes"));
    let mut glb = Glb::triangle();
    glb.animate(0, "colour", "LINEAR", &[0.0], &[0.0; 3]);
    assert_eq!(glb.load().unwrap().warnings, ["animation channels that move no transform of a node are skipped: 1, first `colour`"]);
    // Morph targets are not there to be moved.
    let mut glb = Glb::triangle();
    glb.animate(0, "weights", "LINEAR", &[0.0], &[0.0; 3]);
    assert_eq!(glb.load().unwrap().warnings, ["animation 0, channel 0: it animates morph targets of a node that has none"]);
}

#[test]
fn a_spline_beyond_floats_leaves_things_where_they_were() {
    let mut glb = Glb::triangle();
    // Nine nested scales of 1e38 pass the range of 64-bit floats.
    let mut node = 0;
    glb.json["scenes"][0]["nodes"] = json!([]);
    let mut arms = Vec::new();
    for _ in 0..9 {
        node = glb.child(json!({"children": [node]}));
        arms.push(node);
    }
    glb.json["scenes"][0]["nodes"] = json!([node]);
    for arm in arms {
        glb.animate(arm, "scale", "LINEAR", &[0.0, 1.0], &[1., 1., 1., 1e38, 1e38, 1e38]);
    }
    let mut scene = glb.load().unwrap();
    scene.set_time(1.0);
    assert!(scene.instances[0].world_from_local.is_finite());
}
