//! `EXT_mesh_gpu_instancing`.

use crate::glb::Glb;
use glam::DVec3;
use serde_json::json;

const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// The triangle at a node, with instances.
fn instanced(attributes: impl Fn(&mut Glb) -> serde_json::Value) -> Glb {
    let mut glb = Glb::triangle();
    let attributes = attributes(&mut glb);
    glb.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    glb.json["nodes"][0]["translation"] = json!([0, 10, 0]);
    glb.json["nodes"][0]["scale"] = json!([2, 2, 2]);
    glb.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    glb.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    glb
}

/// Where the triangle's corner (1, 0, 0) is in each instance.
fn corners(glb: &Glb) -> Vec<DVec3> {
    let scene = glb.load().unwrap();
    assert_eq!((scene.meshes.len(), scene.warnings.len()), (1, 0));
    scene.instances.iter().map(|instance| instance.world_from_local.transform_point3(DVec3::X)).collect()
}

#[track_caller]
fn close(found: &[DVec3], expected: &[DVec3]) {
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().zip(expected).all(|(found, expected)| (*found - *expected).length() < 1e-5), "{found:?} is not {expected:?}");
}

#[test]
fn instances_are_placed_below_their_node() {
    let all = instanced(|glb| {
        let translation = glb.floats("VEC3", &[0., 0., 0., 1., 2., 3.]);
        let rotation = glb.floats("VEC4", &[0., 0., 0., 1., 0., 0., 3. * HALF, 3. * HALF]);
        let scale = glb.floats("VEC3", &[1., 1., 1., 5., 1., 1.]);
        let ids = glb.floats("SCALAR", &[7.0, 8.0]);
        json!({"TRANSLATION": translation, "ROTATION": rotation, "SCALE": scale, "_ID": ids})
    });
    // 10 + 2 (2 + 5): scaled along X first, turned to Y, moved, and put at the node.
    close(&corners(&all), &[DVec3::new(2.0, 10.0, 0.0), DVec3::new(2.0, 24.0, 6.0)]);
    let moved = instanced(|glb| json!({"TRANSLATION": glb.floats("VEC3", &[1., 0., 0., 2., 0., 0., 3., 0., 0.])}));
    close(&corners(&moved), &[4.0, 6.0, 8.0].map(|x| DVec3::new(x, 10.0, 0.0)));
    // Turns of normalised bytes.
    let turned = instanced(|glb| {
        let view = glb.view(&[0, 0, 90, 90]);
        json!({"ROTATION": glb.push("accessors", json!({"bufferView": view, "componentType": 5120, "normalized": true, "count": 1, "type": "VEC4"}))})
    });
    close(&corners(&turned), &[DVec3::new(0.0, 12.0, 0.0)]);
}

#[test]
fn instances_follow_their_node() {
    let mut glb = instanced(|glb| json!({"TRANSLATION": glb.floats("VEC3", &[1., 0., 0., 2., 0., 0.])}));
    glb.animate(0, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 0., 0., 9.]);
    let mut scene = glb.load().unwrap();
    scene.set_time(1.0);
    let found: Vec<DVec3> = scene.instances.iter().map(|instance| instance.world_from_local.transform_point3(DVec3::ZERO)).collect();
    close(&found, &[DVec3::new(2.0, 0.0, 9.0), DVec3::new(4.0, 0.0, 9.0)]);
}

#[test]
fn broken_instances_are_refused() {
    let refused = |attributes: fn(&mut Glb) -> serde_json::Value, expected: &str| {
        let error = instanced(attributes).error();
        assert!(error.contains(expected), "`{expected}` is not in: {error}");
    };
    refused(|_| json!({"TRANSLATION": 99}), "node 0: EXT_mesh_gpu_instancing: TRANSLATION is accessor 99, which is not there");
    refused(|_| json!({"TRANSLATION": -1}), "which is not there");
    refused(|_| json!(null), "node 0: EXT_mesh_gpu_instancing: it has no attributes");
    refused(
        |glb| json!({"TRANSLATION": glb.floats("VEC3", &[0.0; 6]), "SCALE": glb.floats("VEC3", &[1.0; 3])}),
        "SCALE has 1 elements, another attribute has 2",
    );
    refused(|glb| json!({"ROTATION": glb.floats("VEC4", &[0.0; 4])}), "ROTATION of instance 0 is zero");
    refused(|glb| json!({"SCALE": glb.floats("VEC3", &[1.0, f32::NAN, 1.0])}), "SCALE of instance 0 is NaN");
    refused(|glb| json!({"SCALE": glb.floats("VEC4", &[1.0; 4])}), "it has 4 numbers per element, but 3 are needed");
}
