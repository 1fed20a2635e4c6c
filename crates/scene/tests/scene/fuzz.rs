//! Damaged files must end in a scene or in a message, never in a panic.

use crate::glb::{Glb, container, load, png};
use lobelia_scene::Scene;
use proptest::prelude::*;
use serde_json::{Value, json};

/// A small file with something of everything.
fn rich() -> Glb {
    let mut glb = Glb::square(json!({
        "name": "paint", "normalTexture": {"index": 0}, "alphaMode": "MASK", "emissiveFactor": [1, 1, 1],
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 1, 0.5]},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}},
    }));
    glb.texture(&png(2, 2, &[200; 16]), json!({"wrapS": 33071, "magFilter": 9729}));
    let (places, values) = (glb.view(&[1, 0]), glb.view(&[2f32, 0.0, 0.0].map(f32::to_le_bytes).concat()));
    glb.json["accessors"][0]["sparse"] =
        json!({"count": 1, "indices": {"bufferView": places, "componentType": 5123}, "values": {"bufferView": values}});
    let spot = glb.light(json!({"type": "spot", "intensity": 20.0, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}}));
    glb.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1}}));
    glb.push("cameras", json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}));
    let lamp = glb.child(json!({"rotation": [0, 0, 0, 1], "extensions": {"KHR_lights_punctual": {"light": spot}}}));
    let eye = glb.child(json!({"scale": [1, 2, 1], "camera": 0}));
    glb.node(json!({"children": [lamp, eye], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 7, 1]}));
    glb.node(json!({"camera": 1, "extras": {"area_light": {"shape": "quad", "width": 1, "height": 2, "radiance": [1, 1, 1]}}}));
    glb.animate(0, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 8., 0., 4.]);
    move_it(&mut glb, lamp);
    glb.animate(lamp, "rotation", "STEP", &[0.0, 1.0], &[0., 0., 0., 1., 0., 1., 0., 0.]);
    glb.json["buffers"][0]["byteLength"] = json!(glb.bin.len());
    glb
}

/// Joints, morph targets, instances, colours and transforms of textures.
fn move_it(glb: &mut Glb, joint: usize) {
    let joints = glb.joints(&[0, 1, 0, 1].repeat(4));
    let weights = glb.floats("VEC4", &[0.5, 0.5, 0., 0.].repeat(4));
    let colors = glb.floats("VEC3", &[0.5; 12]);
    let second = glb.floats("VEC2", &[0.5; 8]);
    for (name, accessor) in [("JOINTS_0", joints), ("WEIGHTS_0", weights), ("COLOR_0", colors), ("TEXCOORD_1", second)] {
        glb.attribute(name, accessor);
    }
    let lift = glb.floats("VEC3", &[0., 0., 1.].repeat(4));
    glb.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": lift, "NORMAL": lift}]);
    glb.json["meshes"][0]["weights"] = json!([0.5]);
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let matrices = glb.matrices(&identity.repeat(2));
    let skin = glb.push("skins", json!({"joints": [joint, 0], "inverseBindMatrices": matrices}));
    let places = glb.floats("VEC3", &[0., 0., 0., 1., 2., 3.]);
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    let skinned = glb.node(json!({"mesh": 0, "skin": skin, "weights": [1.0]}));
    glb.node(json!({"mesh": 0, "extensions": instancing}));
    glb.animate(skinned, "weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    let transform = json!({"KHR_texture_transform": {"offset": [0.5, 0], "rotation": 1.0, "scale": [2, 2], "texCoord": 1}});
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = transform;
    glb.json["materials"][0]["extensions"]["KHR_materials_ior"] = json!({"ior": 1.3});
}

/// Everything that a loaded scene is asked for.
fn use_it(mut scene: Scene) {
    for seconds in [0.0, 0.4, 9.0] {
        scene.set_time(seconds);
        let camera = scene.camera(None);
        assert!(camera.is_ok_and(|camera| camera.position.is_finite() && camera.forward.is_finite() && camera.up.is_finite()));
        assert!(scene.lights.iter().all(|light| light.position.is_finite() && (light.direction.length() - 1.0).abs() < 1e-6));
        assert!(!scene.triangles().is_empty());
        assert!(scene.bounds().is_finite());
        assert!(scene.meshes.iter().all(|mesh| mesh.tangents.iter().all(|tangent| tangent.is_finite())));
        assert!(!scene.traits().facts().is_empty());
    }
}

#[test]
fn undamaged_it_loads() {
    let scene = rich().load().unwrap();
    let traits = scene.traits();
    assert!(traits.vertex_colors && traits.second_uvs && traits.texture_transforms && traits.dielectric && traits.triangles > 8);
    assert!(traits.animated && traits.alpha_mask && traits.normal_maps && traits.quad_lights == 1 && traits.spot_lights == 1);
    use_it(scene);
}

fn try_it(bytes: &[u8]) {
    if let Ok(scene) = load(bytes, "scene.glb") {
        use_it(scene);
    }
}

/// How many values there are in a tree.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(list) => list.iter().map(count).sum(),
        Value::Object(map) => map.values().map(count).sum(),
        _ => 0,
    }
}

/// Replaces the value that is `place` steps into the tree, or takes it away.
fn damage(value: &mut Value, place: &mut usize, with: &Option<Value>) {
    fn here(place: &mut usize) -> bool {
        *place = place.wrapping_sub(1);
        *place == usize::MAX
    }
    match value {
        Value::Array(list) => {
            for index in 0..list.len() {
                if here(place) {
                    match with {
                        Some(with) => list[index] = with.clone(),
                        None => drop(list.remove(index)),
                    }
                    return;
                }
                damage(&mut list[index], place, with);
                if *place > usize::MAX / 2 {
                    return;
                }
            }
        }
        Value::Object(map) => {
            for key in map.keys().cloned().collect::<Vec<_>>() {
                if here(place) {
                    match with {
                        Some(with) => drop(map.insert(key, with.clone())),
                        None => drop(map.remove(&key)),
                    }
                    return;
                }
                if let Some(inner) = map.get_mut(&key) {
                    damage(inner, place, with);
                }
                if *place > usize::MAX / 2 {
                    return;
                }
            }
        }
        _ => {}
    }
}

fn replacement() -> impl Strategy<Value = Option<Value>> {
    let values = [
        json!(null),
        json!(0),
        json!(1),
        json!(2),
        json!(-1),
        json!(3),
        json!(0.5),
        json!(1e38),
        json!(-1e300),
        json!(u32::MAX),
        json!(u64::MAX),
        json!(5121),
        json!(5125),
        json!(5126),
        json!(""),
        json!("VEC4"),
        json!("SCALAR"),
        json!("data:,"),
        json!([]),
        json!([0]),
        json!([0, 0, 0, 0]),
        json!({}),
        json!(true),
    ];
    prop_oneof![1 => Just(None), 4 => prop::sample::select(values.to_vec()).prop_map(Some)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6), cut in prop::option::weighted(0.1, any::<prop::sample::Index>())) {
        let mut bytes = rich().bytes();
        for (place, byte) in &changes {
            let place = place.index(bytes.len());
            bytes[place] = *byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        try_it(&bytes);
    }

    #[test]
    fn changed_numbers(changes in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(vec![0u32, 1, 0x7f80_0000, 0x7fc0_0000, 0xff80_0000, 0x7f7f_ffff, 1 << 31, u32::MAX])), 1..4)) {
        let mut glb = rich();
        for (place, bits) in &changes {
            let place = 4 * place.index(glb.bin.len() / 4);
            glb.bin[place..place + 4].copy_from_slice(&bits.to_le_bytes());
        }
        try_it(&glb.bytes());
    }

    #[test]
    fn changed_structure(changes in prop::collection::vec((any::<prop::sample::Index>(), replacement()), 1..4)) {
        let mut glb = rich();
        for (place, with) in &changes {
            let mut place = place.index(count(&glb.json));
            damage(&mut glb.json, &mut place, with);
        }
        try_it(&container(&serde_json::to_vec(&glb.json).unwrap(), &glb.bin));
    }
}
