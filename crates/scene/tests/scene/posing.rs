//! Meshes that joints and morph targets move.

use crate::glb::{Glb, png};
use glam::{DMat4, DQuat, DVec3, Vec3, Vec4};
use lobelia_scene::Scene;
use serde_json::{Value, json};

const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// World positions of an instance's vertices.
fn world(scene: &Scene, instance: usize) -> Vec<DVec3> {
    let placed = &scene.instances[instance];
    let positions = &scene.meshes[placed.mesh].positions;
    positions.iter().map(|position| placed.world_from_local.transform_point3(position.as_dvec3())).collect()
}

/// World normals of an instance's vertices.
fn normals(scene: &Scene, instance: usize) -> Vec<DVec3> {
    let placed = &scene.instances[instance];
    let matrix = placed.world_from_local.inverse().transpose();
    scene.meshes[placed.mesh].normals.iter().map(|normal| matrix.transform_vector3(normal.as_dvec3()).normalize()).collect()
}

#[track_caller]
fn close(found: &[DVec3], expected: &[DVec3]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(expected) {
        assert!((*found - *expected).length() < 2e-6 * (1.0 + expected.length()), "{found} is not {expected}");
    }
}

fn columns(matrix: DMat4) -> Vec<f32> {
    matrix.to_cols_array().map(|number| number as f32).to_vec()
}

/// The unit square in XY as `square`, moved by two joints under a node of another scale; the mesh's own node stands elsewhere. Each row of `weights`
/// belongs to a vertex.
struct Skinned {
    glb: Glb,
    /// World from joint, and joint from mesh, of both joints.
    joints: [DMat4; 2],
    inverse_bind: [DMat4; 2],
}

fn skinned(weights: &[f32; 16]) -> Skinned {
    let mut glb = Glb::square(json!({}));
    let joints = glb.joints(&[0, 1, 0, 0].repeat(4));
    let weights = glb.floats("VEC4", weights);
    glb.attribute("JOINTS_0", joints);
    glb.attribute("WEIGHTS_0", weights);
    let (first, second) = (DVec3::new(0.5, 3.0, -1.0), DVec3::new(-2.0, 0.25, 4.0));
    let turn = DQuat::from_xyzw(0.0, 0.0, f64::from(HALF), f64::from(HALF));
    let lower = glb.child(json!({"name": "lower", "translation": [-2.0, 0.25, 4.0], "rotation": [0, 0, HALF, HALF], "scale": [1, 2, 0.5]}));
    let upper = glb.child(json!({"name": "upper", "translation": [0.5, 3.0, -1.0]}));
    glb.node(json!({"name": "armature", "scale": [0.01, 0.01, 0.01], "translation": [0, 1, 0], "children": [upper, lower]}));
    let armature = DMat4::from_scale_rotation_translation(DVec3::splat(0.01), DQuat::IDENTITY, DVec3::Y);
    let joints = [
        armature * DMat4::from_translation(first),
        armature * DMat4::from_scale_rotation_translation(DVec3::new(1.0, 2.0, 0.5), turn, second),
    ];
    // From metres to centimetres, and somewhere else.
    let inverse_bind = [
        DMat4::from_scale_rotation_translation(DVec3::splat(100.0), DQuat::IDENTITY, DVec3::new(1.0, 0.0, 2.0)),
        DMat4::from_scale_rotation_translation(DVec3::splat(50.0), DQuat::from_rotation_y(0.5), DVec3::new(0.0, -3.0, 0.0)),
    ];
    let matrices = glb.matrices(&inverse_bind.map(columns).concat());
    glb.push("skins", json!({"joints": [upper, lower], "inverseBindMatrices": matrices}));
    glb.json["nodes"][0]["skin"] = json!(0);
    glb.json["nodes"][0]["translation"] = json!([30, 40, 50]);
    glb.json["nodes"][0]["scale"] = json!([7, 8, 9]);
    Skinned { glb, joints, inverse_bind }
}

const SQUARE: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];

/// Weights that do not add up to 1; the last row has none.
const WEIGHTS: [f32; 16] = [2.0, 0.0, 0.0, 0.0, 0.25, 0.75, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// The first joint's share, for each vertex.
const SHARES: [f64; 4] = [1.0, 0.25, 0.25, 1.0];

/// What joints do to the square's vertices, by the definition.
fn expected(joints: [DMat4; 2], inverse_bind: [DMat4; 2]) -> (Vec<DVec3>, Vec<DVec3>) {
    let [first, second] = [joints[0] * inverse_bind[0], joints[1] * inverse_bind[1]];
    let blended = |share: f64| first * share + second * (1.0 - share);
    let place = |(vertex, share): (&DVec3, f64)| (blended(share) * vertex.extend(1.0)).truncate();
    let normal = |share: f64| (glam::DMat3::from_mat4(blended(share)).inverse().transpose() * DVec3::Z).normalize();
    (SQUARE.iter().zip(SHARES).map(place).collect(), SHARES.map(normal).to_vec())
}

#[test]
fn joints_put_vertices_into_the_world_whatever_the_mesh_node_says() {
    let Skinned { glb, joints, inverse_bind } = skinned(&WEIGHTS);
    let scene = glb.load().unwrap();
    let (positions, turned) = expected(joints, inverse_bind);
    close(&world(&scene, 0), &positions);
    close(&normals(&scene, 0), &turned);
    assert_eq!(scene.warnings, ["mesh 0, primitive 0: 1 vertices have no weight and follow the first joint that they name"]);
    // What asks for the geometry gets the pose.
    let bounds = scene.bounds();
    assert!(positions.iter().all(|p| p.cmpge(bounds.min - 1e-6).all() && p.cmple(bounds.max + 1e-6).all()));
    assert!((bounds.max - bounds.min).max_element() < 5.0);
}

#[test]
fn animated_joints_move_the_mesh() {
    let Skinned { mut glb, mut joints, inverse_bind } = skinned(&WEIGHTS);
    let upper = glb.json["skins"][0]["joints"][0].as_u64().unwrap() as usize;
    glb.animate(upper, "translation", "LINEAR", &[1.0, 3.0], &[0.5, 3.0, -1.0, 100.5, 3.0, -1.0]);
    let mut scene = glb.load().unwrap();
    scene.set_time(0.0);
    let version = scene.geometry_version();
    close(&world(&scene, 0), &expected(joints, inverse_bind).0);
    let still = scene.clone();
    scene.set_time(2.0);
    // Half of 100 centimetres.
    joints[0] = DMat4::from_translation(DVec3::new(0.5, 0.0, 0.0)) * joints[0];
    close(&world(&scene, 0), &expected(joints, inverse_bind).0);
    assert_eq!(scene.geometry_version(), version + 1);
    scene.set_time(2.0);
    assert_eq!(scene.geometry_version(), version + 1);
    // Copies of the scene do not share what moved.
    assert!(world(&still, 0)[0].x < world(&scene, 0)[0].x - 0.4);
}

#[test]
fn a_skin_far_from_the_origin_is_as_precise() {
    let Skinned { mut glb, joints, inverse_bind } = skinned(&WEIGHTS);
    let far = DVec3::new(10_000.0, -3000.0, 7000.0);
    let armature = glb.json["nodes"].as_array().unwrap().len() - 1;
    glb.json["nodes"][armature]["translation"] = json!([10_000, -2999, 7000]);
    let scene = glb.load().unwrap();
    for (found, expected) in world(&scene, 0).iter().zip(expected(joints, inverse_bind).0) {
        assert!((*found - far - expected).length() < 1e-6, "{found}");
    }
}

#[test]
fn eight_joints_and_byte_weights_are_read() {
    let mut glb = Glb::square(json!({}));
    let mut list = Vec::new();
    for joint in 0..8 {
        list.push(glb.node(json!({"translation": [0, 0, joint]})));
    }
    let (first, second) = (glb.joints(&[0, 1, 2, 3].repeat(4)), glb.joints(&[4, 5, 6, 7].repeat(4)));
    let byte = |glb: &mut Glb, row: [u8; 4]| {
        let accessor = glb.joints(&row.repeat(4));
        glb.json["accessors"][accessor]["normalized"] = json!(true);
        accessor
    };
    let (low, high) = (byte(&mut glb, [0, 0, 51, 0]), byte(&mut glb, [0, 0, 0, 153]));
    for (name, accessor) in [("JOINTS_0", first), ("WEIGHTS_0", low), ("JOINTS_1", second), ("WEIGHTS_1", high)] {
        glb.attribute(name, accessor);
    }
    glb.push("skins", json!({"joints": list}));
    glb.json["nodes"][0]["skin"] = json!(0);
    let scene = glb.load().unwrap();
    // A quarter of joint 2 and three of joint 7.
    close(&world(&scene, 0), &SQUARE.map(|vertex| vertex + DVec3::Z * (0.25 * 2.0 + 0.75 * 7.0)));
}

#[test]
fn one_mesh_with_two_skins_is_two_meshes() {
    let Skinned { mut glb, joints, inverse_bind } = skinned(&WEIGHTS);
    let elsewhere = glb.node(json!({"translation": [0, 5, 0]}));
    let other = glb.push("skins", json!({"joints": [elsewhere, elsewhere]}));
    glb.node(json!({"mesh": 0, "skin": other}));
    glb.node(json!({"mesh": 0, "translation": [0, 0, 3]}));
    let mut scene = glb.load().unwrap();
    scene.set_time(0.0);
    close(&world(&scene, 0), &expected(joints, inverse_bind).0);
    close(&world(&scene, 1), &SQUARE.map(|vertex| vertex + 5.0 * DVec3::Y));
    // Without a skin it stands at its node.
    close(&world(&scene, 2), &SQUARE.map(|vertex| vertex + 3.0 * DVec3::Z));
}

#[test]
fn a_skeleton_that_mirrors_keeps_fronts_outside() {
    let mut glb = Glb::square(json!({}));
    let joints = glb.joints(&[0; 16]);
    let weights = glb.floats("VEC4", &[1., 0., 0., 0.].repeat(4));
    glb.attribute("JOINTS_0", joints);
    glb.attribute("WEIGHTS_0", weights);
    let joint = glb.node(json!({"scale": [-2, 1, 1]}));
    glb.push("skins", json!({"joints": [joint]}));
    glb.json["nodes"][0]["skin"] = json!(0);
    let scene = glb.load().unwrap();
    close(&world(&scene, 0), &SQUARE.map(|vertex| vertex * DVec3::new(-2.0, 1.0, 1.0)));
    close(&normals(&scene, 0), &[DVec3::Z; 4]);
    for triangle in scene.triangles() {
        let [a, b, c] = triangle.positions;
        assert!((b - a).cross(c - a).z > 0.0);
    }
}

#[test]
fn joints_need_not_be_in_the_scene_that_is_drawn() {
    let Skinned { mut glb, joints, inverse_bind } = skinned(&WEIGHTS);
    glb.json["scenes"][0]["nodes"] = json!([0]);
    let lamp = glb.light(json!({"type": "point"}));
    let armature = glb.json["nodes"].as_array().unwrap().len() - 1;
    glb.json["nodes"][armature]["extensions"] = json!({"KHR_lights_punctual": {"light": lamp}});
    let scene = glb.load().unwrap();
    close(&world(&scene, 0), &expected(joints, inverse_bind).0);
    assert!(scene.lights.is_empty());
}

/// The square with two morph targets: one lifts it and tilts its normals, one widens it.
fn morphed() -> Glb {
    let mut glb = Glb::square(json!({}));
    let lift = glb.floats("VEC3", &[0., 0., 1.].repeat(4));
    let tilt = glb.floats("VEC3", &[1., 0., 0.].repeat(4));
    let widen = glb.floats("VEC3", &[0., 0., 0., 2., 0., 0., 2., 0., 0., 0., 0., 0.]);
    glb.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": lift, "NORMAL": tilt}, {"POSITION": widen}]);
    glb
}

fn moved(lift: f64, widen: f64) -> [DVec3; 4] {
    SQUARE.map(|vertex| vertex + DVec3::new(2.0 * widen * vertex.x, 0.0, lift))
}

#[test]
fn morph_targets_have_default_weights_of_the_mesh_and_of_the_node() {
    let mut glb = morphed();
    close(&world(&glb.load().unwrap(), 0), &SQUARE);
    glb.json["meshes"][0]["weights"] = json!([0.5, 0.25]);
    let scene = glb.load().unwrap();
    close(&world(&scene, 0), &moved(0.5, 0.25));
    close(&normals(&scene, 0), &[DVec3::new(0.5, 0.0, 1.0).normalize(); 4]);
    // A second node with its own weights, and a third with those of the mesh, which shares the first copy.
    glb.node(json!({"mesh": 0, "weights": [-1.0, 2.0], "translation": [0, 0, 4]}));
    glb.node(json!({"mesh": 0}));
    let scene = glb.load().unwrap();
    close(&world(&scene, 0), &moved(0.5, 0.25));
    close(&world(&scene, 1), &moved(3.0, 2.0));
    assert_eq!(scene.instances[0].mesh, scene.instances[2].mesh);
    assert_eq!(scene.meshes.len(), 2);
}

#[test]
fn morph_weights_are_animated() {
    let at = |interpolation: &str, values: &[f32], seconds: f32| {
        let mut glb = morphed();
        glb.json["meshes"][0]["weights"] = json!([9, 9]);
        glb.animate(0, "weights", interpolation, &[1.0, 3.0], values);
        let mut scene = glb.load().unwrap();
        scene.set_time(seconds);
        assert_eq!(scene.traits().animation_seconds, 3.0);
        world(&scene, 0)
    };
    let linear = [0.0, 1.0, 1.0, 3.0];
    close(&at("LINEAR", &linear, 0.0), &moved(0.0, 1.0));
    close(&at("LINEAR", &linear, 1.5), &moved(0.25, 1.5));
    close(&at("STEP", &linear, 2.9), &moved(0.0, 1.0));
    close(&at("LINEAR", &linear, 9.0), &moved(1.0, 3.0));
    // In-tangents, values and out-tangents of both targets. Half way: (0 + 4) / 2 + (3 - 1) * 2 / 8 = 2.5 for the first, (1 + 1) / 2 for the second.
    let spline = [9., 9., 0., 1., 3., 0., 1., 0., 4., 1., 9., 9.];
    close(&at("CUBICSPLINE", &spline, 2.0), &moved(2.5, 1.0));
}

#[test]
fn targets_come_before_joints() {
    let mut glb = morphed();
    glb.json["meshes"][0]["weights"] = json!([1.0, 0.0]);
    let joints = glb.joints(&[0; 16]);
    let weights = glb.floats("VEC4", &[1., 0., 0., 0.].repeat(4));
    glb.attribute("JOINTS_0", joints);
    glb.attribute("WEIGHTS_0", weights);
    // A quarter turn about X, twice as large along Z before it.
    let joint = glb.node(json!({"rotation": [HALF, 0, 0, HALF], "scale": [1, 1, 2]}));
    glb.push("skins", json!({"joints": [joint]}));
    glb.json["nodes"][0]["skin"] = json!(0);
    let scene = glb.load().unwrap();
    // (x, y, 1) to (x, -2, y).
    close(&world(&scene, 0), &SQUARE.map(|vertex| DVec3::new(vertex.x, -2.0, vertex.y)));
    // The tilted normal (1, 0, 1) by the inverse transpose: (1, 0, 1/2) turned to (1, -1/2, 0).
    close(&normals(&scene, 0), &[DVec3::new(1.0, -0.5, 0.0).normalize(); 4]);
}

#[test]
fn flat_normals_and_made_tangents_follow_the_pose() {
    // No normals in the file; the target turns the triangle out of its plane, from one without area.
    let mut glb = Glb::empty();
    let positions = glb.floats("VEC3", &[0., 0., 0., 1., 0., 0., 2., 0., 0.]);
    let lift = glb.floats("VEC3", &[0., 0., 0., 0., 0., 0., 0., 0., 1.]);
    let mesh = glb.mesh(json!({"attributes": {"POSITION": positions}, "targets": [{"POSITION": lift}]}));
    glb.node(json!({"mesh": mesh, "weights": [1.0]}));
    let scene = glb.load().unwrap();
    assert_eq!(scene.meshes[0].normals, [Vec3::NEG_Y; 3]);
    assert_eq!(scene.triangles().len(), 1);
    // A normal map without tangents on a square that a target turns about X.
    let mut glb = Glb::square(json!({"normalTexture": {"index": 0}}));
    glb.texture(&png(1, 1, &[128, 128, 255, 255]), json!({}));
    let turn = glb.floats("VEC3", &[0., 0., 0., -1., 1., 0., -2., 0., 0., -1., -1., 0.]);
    glb.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": turn}]);
    glb.json["meshes"][0]["weights"] = json!([1.0]);
    let scene = glb.load().unwrap();
    // The corner (1, 0) is at (0, 1) now: u runs along +Y.
    assert_eq!(scene.meshes[0].positions.len(), 6);
    assert!(
        scene.meshes[0].tangents.iter().all(|t| (*t - Vec4::new(0.0, 1.0, 0.0, 1.0)).length() < 1e-5),
        "{:?}",
        scene.meshes[0].tangents
    );
}

#[test]
fn broken_skins_are_refused_or_said() {
    let refused = |change: &dyn Fn(&mut Glb), expected: &str| {
        let Skinned { mut glb, .. } = skinned(&WEIGHTS);
        change(&mut glb);
        let error = glb.error();
        assert!(error.contains(expected), "`{expected}` is not in: {error}");
    };
    refused(
        &|glb| {
            let wild = glb.joints(&[0, 2, 0, 0].repeat(4));
            glb.attribute("JOINTS_0", wild);
        },
        "mesh 0, primitive 0: a vertex is moved by joint 2, but skin 0 has 2 joints",
    );
    refused(
        &|glb| {
            let matrices = glb.matrices(&columns(DMat4::IDENTITY));
            glb.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
        },
        "skin 0: 2 joints, but only 1 inverse bind matrices",
    );
    refused(
        &|glb| {
            let matrices = glb.matrices(&[f32::NAN; 32]);
            glb.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
        },
        "skin 0: inverse bind matrix 0 holds NaN",
    );
    refused(
        &|glb| {
            let matrices = glb.matrices(&[1e38; 32]);
            glb.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
        },
        "",
    );
    refused(
        &|glb| drop(glb.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("WEIGHTS_0")),
        "of JOINTS_0 and WEIGHTS_0 only one is there",
    );
    refused(&|glb| glb.json["skins"][0]["joints"] = json!([77, 1]), "out of bounds");
    refused(&|glb| glb.json["nodes"][0]["skin"] = json!(7), "out of bounds");
    refused(
        &|glb| {
            let short = glb.joints(&[0, 1, 0, 0].repeat(3));
            glb.attribute("JOINTS_0", short);
        },
        "JOINTS_0 has 3 elements, POSITION has 4",
    );
    // A joint that does not count may be anything.
    let Skinned { mut glb, joints, inverse_bind } = skinned(&WEIGHTS);
    let wild = glb.joints(&[0, 1, 200, 99].repeat(4));
    glb.attribute("JOINTS_0", wild);
    close(&world(&glb.load().unwrap(), 0), &expected(joints, inverse_bind).0);
    // Joints in a ring are a tree that is none.
    let Skinned { mut glb, .. } = skinned(&WEIGHTS);
    glb.json["nodes"][1]["children"] = json!([2]);
    glb.json["nodes"][2]["children"] = json!([1]);
    assert!(glb.error().contains("nodes must form a tree"));
    // A skin without joints in the mesh.
    let Skinned { mut glb, .. } = skinned(&WEIGHTS);
    for name in ["JOINTS_0", "WEIGHTS_0"] {
        glb.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove(name);
    }
    let scene = glb.load().unwrap();
    assert_eq!(scene.warnings, ["mesh 0, primitive 0: it has a skin, but no joints and weights, and stays at its node"]);
    close(&world(&scene, 0)[..1], &[DVec3::new(30.0, 40.0, 50.0)]);
}

#[test]
fn broken_targets_are_refused_or_said() {
    let mut glb = morphed();
    let short = glb.floats("VEC3", &[0.0; 9]);
    let whole: Value = glb.json["meshes"][0]["primitives"][0]["targets"].clone();
    glb.json["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = json!(short);
    assert!(glb.error().contains("POSITION of morph target 1 has 3 elements, POSITION has 4"));
    glb.json["meshes"][0]["primitives"][0]["targets"] = whole;
    glb.json["meshes"][0]["weights"] = json!([1.0]);
    let scene = glb.load().unwrap();
    assert_eq!(scene.warnings, ["mesh 0, primitive 0: 2 morph targets, but 1 weights; those that are missing are 0"]);
    close(&world(&scene, 0), &moved(1.0, 0.0));
    glb.json["meshes"][0]["weights"] = json!([1e38, 1e38]);
    assert!(!glb.error().is_empty());
    let mut glb = morphed();
    glb.animate(0, "weights", "LINEAR", &[0.0, 1.0], &[0.0; 3]);
    assert!(glb.error().contains("animation 0, channel 0: 2 keys of 2 morph targets do not go with 3 weights"));
    // An animation that shoots beyond floats leaves the mesh as it was.
    let mut glb = morphed();
    glb.animate(0, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 3e38, 3e38]);
    let mut scene = glb.load().unwrap();
    scene.set_time(1.0);
    assert!(scene.bounds().is_finite());
}
