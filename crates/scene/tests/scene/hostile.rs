//! Files that are broken, or that mean harm: each ends in a message that says where and what.

use crate::glb::{Glb, container, folder, load, load_in, message, png, shared_scenes};
use lobelia_scene::Scene;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

#[track_caller]
fn refused(glb: &Glb, expected: &str) {
    let error = glb.error();
    assert!(error.contains(expected), "`{expected}` is not in: {error}");
}

#[track_caller]
fn refused_bytes(bytes: &[u8], expected: &str) {
    let error = message(load(bytes, "scene.glb"));
    assert!(error.contains(expected), "`{expected}` is not in: {error}");
}

#[test]
fn truncated_at_every_length() {
    let whole = Glb::square(json!({})).bytes();
    assert!(load(&whole, "scene.glb").is_ok());
    for length in 0..whole.len() {
        load(&whole[..length], "scene.glb").expect_err("a truncated file must not load");
    }
    refused_bytes(&whole[..10], "a GLB header has 12 bytes, but the file ends after 10");
    refused_bytes(&whole[..whole.len() - 1], "it is truncated or damaged");
}

#[test]
fn wrong_containers() {
    refused_bytes(b"", "the file is empty");
    refused_bytes(b"hello", "not a valid glTF 2.0 file");
    refused_bytes(b"glTF\x02\0\0\0\x03\0\0\0", "its header declares 3 bytes");
    refused_bytes(b"glTF\x01\0\0\0\x0c\0\0\0", "unsupported version");
    refused_bytes(&container(b"{", b""), "not a valid glTF 2.0 file");
    refused_bytes(&container(b"{}", b""), "missing field `asset`");
    let deep = [b"{\"asset\":{\"version\":\"2.0\"},\"extras\":".to_vec(), vec![b'['; 100_000]].concat();
    refused_bytes(&container(&deep, b""), "not a valid glTF 2.0 file");
}

#[test]
fn a_scene_must_have_something_to_draw() {
    refused(&Glb::empty(), "the scene is empty");
    let mut unplaced = Glb::triangle();
    unplaced.json["scenes"][0]["nodes"] = json!([]);
    assert!(unplaced.error().contains("the scene is empty"));
}

#[test]
fn required_extensions_are_named() {
    let mut glb = Glb::triangle();
    glb.json["extensionsRequired"] = json!(["ACME_clay", "KHR_lights_punctual"]);
    refused(&glb, "it requires ACME_clay, which this program cannot read; `--allow-unsupported` reads it without");
}

#[test]
fn accessors_beyond_their_buffers() {
    let set = |accessor: usize, key: &str, value: Value| {
        let mut glb = Glb::square(json!({}));
        glb.json["accessors"][accessor][key] = value;
        glb
    };
    refused(&set(0, "count", json!(5)), "accessor 0: 5 elements of 12 bytes do not fit into the 48 bytes of buffer view 0");
    let start = Instant::now();
    refused(&set(0, "count", json!(u64::MAX / 2)), "do not fit into the 48 bytes");
    refused(&set(3, "count", json!(4_000_000_000u64)), "do not fit into the 12 bytes");
    assert!(start.elapsed() < Duration::from_secs(1), "it must not allocate for what is not there");
    refused(&set(0, "byteOffset", json!(4)), "do not fit");
    refused(&set(0, "byteOffset", json!(u64::MAX)), "do not fit");
    refused(&set(0, "type", json!("VEC2")), "accessor 0: it has 2 numbers per element, but 3 are needed");
    refused(&set(3, "componentType", json!(5126)), "accessor 3: indices must be unsigned integers");
    refused(&set(0, "bufferView", json!(77)), "Index out of bounds");
    // Zeros, all in one point.
    refused(&set(0, "bufferView", Value::Null), "the scene is empty");
    let mut zeros = set(0, "bufferView", Value::Null);
    zeros.json["accessors"][0]["count"] = json!(4_000_000_000u64);
    refused(&zeros, "accessor 0: it has 4000000000 elements and no buffer view; at most 16777216 are read");
    let mut glb = Glb::square(json!({}));
    glb.json["bufferViews"][0]["byteStride"] = json!(4);
    refused(&glb, "accessor 0: its stride of 4 bytes is less than an element of 12");
    glb.json["bufferViews"][0]["byteStride"] = json!(252);
    refused(&glb, "do not fit");
    glb.json["bufferViews"][0]["byteStride"] = json!(u64::MAX);
    refused(&glb, "do not fit");
    let mut glb = Glb::square(json!({}));
    glb.json["bufferViews"][1]["byteOffset"] = json!(100_000);
    refused(&glb, "buffer view 1: bytes 100000 to 100048 lie outside of buffer 0");
    glb.json["bufferViews"][1]["byteOffset"] = json!(u64::MAX);
    refused(&glb, "buffer view 1");
}

#[test]
fn indices_out_of_range() {
    let mut glb = Glb::square(json!({}));
    let wild = glb.shorts(&[0, 1, 4]);
    glb.json["meshes"][0]["primitives"][0]["indices"] = json!(wild);
    refused(&glb, "mesh 0, primitive 0: index 4 is out of range: it has 4 vertices");
    for (pointer, value) in [
        ("/scenes/0/nodes/0", json!(9)),
        ("/nodes/0/mesh", json!(9)),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9)),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(9)),
        ("/meshes/0/primitives/0/indices", json!(9)),
        ("/meshes/0/primitives/0/material", json!(9)),
        ("/scene", json!(9)),
        ("/bufferViews/0/buffer", json!(9)),
    ] {
        let mut glb = Glb::square(json!({}));
        *glb.json.pointer_mut(pointer).unwrap() = value;
        let error = glb.error();
        assert!(
            ["out of bounds", "accessor 9, but there are 4", "no buffer 9"].iter().any(|words| error.contains(words)),
            "{pointer}: {error}"
        );
    }
    let mut glb = Glb::triangle();
    glb.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 3}});
    refused(&glb, "out of bounds");
}

#[test]
fn attributes_of_different_lengths() {
    let mut glb = Glb::square(json!({}));
    glb.json["accessors"][1]["count"] = json!(3);
    refused(&glb, "mesh 0, primitive 0: NORMAL has 3 elements, POSITION has 4");
    let mut glb = Glb::square(json!({}));
    glb.json["accessors"][2]["count"] = json!(3);
    refused(&glb, "mesh 0, primitive 0: TEXCOORD_0 has 3 elements, POSITION has 4");
}

#[test]
fn numbers_that_are_none() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut glb = Glb::empty();
        let positions = glb.floats("VEC3", &[0., 0., 0., 1., bad, 0., 0., 1., 0.]);
        let mesh = glb.mesh(json!({"attributes": {"POSITION": positions}}));
        glb.node(json!({"mesh": mesh}));
        refused(&glb, &format!("mesh 0, primitive 0: POSITION of vertex 1 is {bad}"));
    }
    let mut glb = Glb::triangle();
    glb.json["nodes"][0]["translation"] = json!([0, 1e300, 0]);
    refused(&glb, "node 0: its transform has NaN or infinite numbers");
    glb.json["nodes"][0]["translation"] = json!([0, 0, 0]);
    glb.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]);
    refused(&glb, "node 0: its rotation is the zero quaternion");
    // Nothing far away may hide that the scene is there.
    let mut glb = Glb::triangle();
    glb.node(json!({"mesh": 0, "translation": [1e20, 0, 0]}));
    refused(&glb, "positions must be finite and within 1e9 m of each other");
    let mut glb = Glb::triangle();
    let light = glb.light(json!({"type": "point"}));
    glb.node(json!({"name": "moon", "translation": [0, 3e9, 0], "extensions": {"KHR_lights_punctual": {"light": light}}}));
    refused(&glb, "light `moon` is at [0, 3000000000, 0]; it must be within 1e9 m of the scene");
}

#[test]
fn transforms_beyond_floats() {
    let mut glb = Glb::triangle();
    let mut node = 0;
    for _ in 0..9 {
        node = glb.child(json!({"scale": [1e38, 1e38, 1e38], "children": [node]}));
    }
    glb.json["scenes"][0]["nodes"] = json!([node]);
    refused(&glb, "it and the nodes above it put it beyond the range of floats");
    let mut glb = Glb::triangle();
    let tiny = glb.floats("VEC3", &[0., 0., 0., 1e-38, 0., 0., 0., 1e-38, 0.]);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(tiny);
    glb.json["nodes"][0]["scale"] = json!([1e38, 1e38, 1e38]);
    refused(&glb, "node `triangle`: its transform is beyond the range of 32-bit floats");
}

#[test]
fn triangles_without_area_are_dropped_and_counted() {
    let mut glb = Glb::square(json!({}));
    let indices = glb.shorts(&[0, 1, 2, 0, 0, 1, 3, 3, 3, 0, 2, 3]);
    glb.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let scene = glb.load().unwrap();
    assert_eq!(scene.triangles().len(), 2);
    assert_eq!(scene.warnings, ["triangles without area are dropped: 2, first in mesh 0, primitive 0"]);
    let indices = glb.shorts(&[0, 0, 1]);
    glb.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    refused(&glb, "the scene is empty");
}

#[test]
fn nodes_that_are_no_tree() {
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!([{"children": [1]}, {"children": [2]}, {"children": [1]}]);
    refused(&glb, "node 1: it is a child of node 0 and of node 2; nodes must form a tree");
    glb.json["nodes"] = json!([{}, {"children": [2]}, {"children": [1]}]);
    refused(&glb, "it is its own ancestor; nodes must form a tree");
    glb.json["nodes"] = json!([{"children": [0]}]);
    refused(&glb, "node 0: it is its own ancestor");
    glb.json["nodes"] = json!([{"children": [1]}, {}]);
    glb.json["scenes"][0]["nodes"] = json!([0, 1]);
    refused(&glb, "node 1: it is a root of the scene and a child of another node");
    glb.json["scenes"][0]["nodes"] = json!([0, 0]);
    refused(&glb, "node 0: it is listed twice as a root");
}

#[test]
fn deep_trees_overflow_no_stack() {
    const DEPTH: usize = 100_000;
    let mut glb = Glb::triangle();
    let mesh = glb.json["nodes"][0].take();
    let mut nodes: Vec<Value> = (0..DEPTH).map(|index| json!({"children": [index + 1]})).collect();
    nodes.push(mesh);
    glb.json["nodes"] = Value::Array(nodes);
    glb.animate(0, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 2., 0., 0.]);
    let mut scene = glb.load().unwrap();
    scene.set_time(1.0);
    assert_eq!(scene.instances[0].world_from_local.w_axis.x, 2.0);
}

#[test]
fn small_files_cannot_ask_for_unbounded_memory() {
    // One mesh of 20 thousand triangles, placed 2000 times: 40 million.
    let mut glb = Glb::triangle();
    let many = glb.shorts(&[0, 1, 2].repeat(20_000));
    glb.json["meshes"][0]["primitives"][0]["indices"] = json!(many);
    for _ in 0..2000 {
        glb.node(json!({"mesh": 0}));
    }
    refused(&glb, "all instances together have 40020000 triangles; at most 33554432 are drawn");
    // The same accessors in many meshes.
    let normals = glb.floats("VEC3", &[0., 0., 1.].repeat(3));
    let mut primitive = glb.json["meshes"][0]["primitives"][0].clone();
    primitive["attributes"]["NORMAL"] = json!(normals);
    glb.json["meshes"] = (0..900).map(|_| json!({"primitives": [primitive]})).collect();
    glb.json["nodes"] = (0..900).map(|mesh| json!({"mesh": mesh})).collect();
    glb.json["scenes"][0]["nodes"] = (0..900).collect();
    refused(&glb, "the meshes have more than 16777216 vertices and triangles");
    let lamp = json!({"extras": {"area_light": {"shape": "sphere", "radius": 1, "radiance": [1, 1, 1]}}});
    let mut glb = Glb::triangle();
    for _ in 0..4097 {
        glb.node(lamp.clone());
    }
    refused(&glb, "it has more than 4096 area lights");
}

#[test]
fn buffers_that_are_not_there() {
    let mut glb = Glb::triangle();
    glb.json["buffers"] = json!([{"byteLength": 1_000_000}]);
    refused(&glb, "buffer 0: 1000000 bytes are declared, but only");
    glb.json["buffers"] = json!([{"byteLength": 36}, {"byteLength": 36}]);
    glb.json["bufferViews"][0]["buffer"] = json!(1);
    refused(&glb, "buffer 1: it has no uri; only buffer 0 may be the binary chunk");
    glb.json["bufferViews"][0]["buffer"] = json!(0);
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": "nowhere.bin"}]);
    refused(&glb, "nowhere.bin: cannot be read");
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": "data:base64,AAAA"}]);
    refused(&glb, "buffer 0: a data URI without base64 data");
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": "data:;base64,?"}]);
    refused(&glb, "buffer 0: a data URI with broken base64");
    // A file that never ends.
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": "/dev/zero"}]);
    refused(&glb, "/dev/zero: cannot be read");
    let text = serde_json::to_vec(&Glb::triangle().json).unwrap();
    let error = message(load(&text, "scene.gltf"));
    assert!(error.contains("buffer 0: it has no uri and the file no binary chunk"), "{error}");
}

/// A PNG that claims a size and holds nothing.
fn claim(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(1, 1, &[0; 4]);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    // CRC-32 of the chunk's type and data, as PNG has it.
    let crc = bytes[12..29].iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    });
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    bytes
}

#[test]
fn images_that_are_none() {
    let with = |bytes: &[u8]| {
        let mut glb = Glb::square(json!({"emissiveTexture": {"index": 0}}));
        glb.texture(bytes, json!({}));
        glb
    };
    refused(&with(b"not an image at all"), "image 0: `image 0`: it cannot be decoded");
    let whole = png(2, 2, &[7; 16]);
    refused(&with(&whole[..whole.len() - 20]), "image 0: `image 0`: it cannot be decoded");
    let start = Instant::now();
    refused(&with(&claim(2_000_000_000, 2_000_000_000)), "image 0");
    refused(&with(&claim(8193, 1)), "it has 8193 x 1 texels; each side may have at most 8192");
    refused(&with(&claim(0, 5)), "image 0");
    assert!(start.elapsed() < Duration::from_secs(1), "it must not allocate for what is not there");
    let mut glb = with(&whole);
    glb.json["images"] = json!([{"uri": "nowhere.png"}]);
    refused(&glb, "image 0: ");
    refused(&glb, "nowhere.png: cannot be read");
    glb.json["images"] = json!([{}]);
    refused(&glb, "image 0: it has neither a uri nor a bufferView");
    glb.json["images"] = json!([{"bufferView": 0}]);
    refused(&glb, "image 0: `image 0`: it cannot be decoded");
}

#[test]
fn many_large_images_are_refused_before_they_are_decoded() {
    // A real image of the largest size would take long to make; its claim is enough, for the sum is looked at first.
    let mut glb = Glb::square(json!({"emissiveTexture": {"index": 1}, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    glb.texture(&png(1, 1, &[0; 4]), json!({}));
    glb.texture(&claim(8192, 8192), json!({}));
    refused(&glb, "image 1: `image 1`: it cannot be decoded");
}

#[test]
fn factors_out_of_range() {
    for (material, expected) in [
        (json!({"name": "m", "pbrMetallicRoughness": {"roughnessFactor": 1.5}}), ""),
        (json!({"name": "m", "pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 1]}}), "material `m`: base colour"),
        (
            json!({"name": "m", "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, -1]}}),
            "material `m`: the alpha of its base colour is -1",
        ),
        (json!({"name": "m", "emissiveFactor": [-1, 0, 0]}), ""),
        (json!({"name": "m", "alphaMode": "MASK", "alphaCutoff": -0.5}), ""),
        (json!({"name": "m", "alphaMode": "HIDE"}), ""),
    ] {
        refused(&Glb::square(material), expected);
    }
}

#[test]
fn lights_out_of_range() {
    for (light, expected) in [
        (json!({"type": "point", "intensity": -1}), "light `lamp`: its intensity is [-1, -1, -1]"),
        (json!({"type": "point", "intensity": 1e300}), "must be finite"),
        (json!({"type": "spot", "spot": {"innerConeAngle": 0.0, "outerConeAngle": 0.0}}), "light `lamp`: its cone angles are 0 and 0"),
        (json!({"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 2.0}}), "0 <= inner <= outer <= pi/2 must hold"),
        (json!({"type": "spot"}), "spot"),
        (json!({"type": "laser"}), "type"),
    ] {
        let mut glb = Glb::triangle();
        let light = glb.light(light);
        glb.node(json!({"name": "lamp", "extensions": {"KHR_lights_punctual": {"light": light}}}));
        refused(&glb, expected);
    }
}

#[test]
fn cameras_that_are_none() {
    let mut glb = Glb::triangle();
    glb.push("cameras", json!({"type": "perspective", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}));
    glb.node(json!({"camera": 0}));
    refused(&glb, "camera 0: its type is perspective, but it has no `perspective`");
    glb.json["cameras"] = json!([{"type": "orthographic", "perspective": {"yfov": 1, "znear": 0.1}}]);
    refused(&glb, "camera 0: its type is orthographic, but it has no `orthographic`");
    // A bad lens spoils the camera, not the scene.
    glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 4.0, "znear": 0.1}}]);
    let scene = glb.load().unwrap();
    assert!(scene.camera(Some("node 1")).unwrap_err().to_string().contains("yfov is 4 and znear 0.1"));
    assert_eq!(scene.camera(None).unwrap().name, "whole-scene");
}

#[test]
fn addresses_that_are_none() {
    let folder = folder(&[("scene.obj", b"")]);
    let error = message(load_in(&folder, "scene.obj"));
    assert!(error.contains("expected a .glb, .gltf or .ron file or builtin:NAME"), "{error}");
    let error = message(load_in(&folder, "scene.glb"));
    assert!(error.contains("cannot be read"), "{error}");
    std::fs::create_dir(folder.path().join("scene.gltf")).unwrap();
    let error = message(load_in(&folder, "scene.gltf"));
    assert!(error.contains("it is not a file"), "{error}");
    let error = Scene::load("builtin:cornel-glossy").unwrap_err().to_string();
    assert!(error.contains("no built-in scene is called `cornel-glossy`; did you mean `cornell-glossy`?"), "{error}");
    let error = Scene::load("builtin:").unwrap_err().to_string();
    assert!(error.contains("there are cornell-glossy"), "{error}");
}

#[test]
fn a_truncated_large_file() {
    let Some(scenes) = shared_scenes() else { return };
    let bytes = std::fs::read(scenes.join("ring-caustic/ring-caustic.glb")).unwrap();
    refused_bytes(&bytes[..bytes.len() / 2], "it is truncated or damaged");
}
