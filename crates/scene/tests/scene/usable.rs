//! Files that could be used: what nobody draws stops none, and what is valid, rounded or common is read.

use crate::glb::{Glb, container, folder, load, load_in, message, png};
use glam::{DVec3, Vec3};
use lobelia_scene::{LightKind, LoadOptions, Scene};
use serde_json::{Value, json};

#[track_caller]
fn warned(scene: &Scene, expected: &str) {
    assert!(scene.warnings.iter().any(|warning| warning.contains(expected)), "`{expected}` is not in {:?}", scene.warnings);
}

/// A square with a base colour that is there.
fn painted() -> Glb {
    let mut glb = Glb::square(json!({"name": "paint", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    glb.texture(&png(1, 1, &[10, 20, 30, 255]), json!({}));
    glb
}

#[test]
fn what_nobody_draws_stops_nothing() {
    let whole = painted().load().unwrap();
    let unused: [(&str, Value); 16] = [
        ("images", json!({"uri": "nowhere.png"})),
        ("images", json!({})),
        ("images", json!({"bufferView": 77, "mimeType": 5})),
        ("textures", json!({"source": 99, "sampler": 99})),
        ("textures", json!({})),
        ("samplers", json!({"wrapS": 1})),
        ("materials", json!({"name": "other", "emissiveTexture": {"index": 50}, "alphaMode": "HIDE", "emissiveFactor": "red"})),
        ("meshes", json!({"primitives": [{"attributes": {"POSITION": 99}, "material": 99}]})),
        ("accessors", json!({"bufferView": 99, "componentType": 1, "count": -1, "type": "VEC9"})),
        ("bufferViews", json!({"buffer": 99, "byteOffset": 1e30, "byteLength": "long"})),
        ("buffers", json!({"uri": "nowhere.bin", "byteLength": 99})),
        ("animations", json!({"channels": [{"sampler": 7, "target": {"node": 1, "path": "scale"}}], "samplers": []})),
        ("animations", json!({})),
        ("skins", json!({"joints": [99], "inverseBindMatrices": 99})),
        ("cameras", json!({"type": "fisheye"})),
        (
            "nodes",
            json!({"mesh": 99, "skin": 99, "camera": 99, "rotation": [0, 0, 0, 0], "extensions": {"KHR_lights_punctual": {"light": 99}}}),
        ),
    ];
    let mut all = painted();
    for (list, value) in &unused {
        let mut glb = painted();
        for glb in [&mut glb, &mut all] {
            if *list == "animations" && glb.json["nodes"].as_array().unwrap().len() == 1 {
                glb.child(json!({"name": "not in the scene"}));
            }
            glb.push(list, value.clone());
        }
        let scene = glb.load().unwrap_or_else(|error| panic!("{list} {value}: {error}"));
        assert_eq!((scene.triangles().len(), &scene.textures, &scene.meshes), (2, &whole.textures, &whole.meshes), "{list} {value}");
    }
    warned(&all.load().unwrap(), "buffers that nothing drawn uses are not read: 1");
    // An attribute of another program, a morph target of another kind, and another scene.
    let mut glb = painted();
    glb.json["meshes"][0]["primitives"][0]["attributes"]["_MINE"] = json!(99);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["WHATEVER"] = json!(99);
    glb.push("scenes", json!({"nodes": [99]}));
    glb.push("scenes", json!({}));
    assert_eq!(glb.load().unwrap().triangles().len(), 2);
}

#[test]
fn occlusion_is_not_read() {
    let mut glb = Glb::square(json!({"occlusionTexture": {"index": 0, "strength": 7.0}}));
    glb.texture(b"no image", json!({}));
    warned(&glb.load().unwrap(), "occlusion textures are ignored");
    glb.json["materials"][0]["occlusionTexture"]["index"] = json!(99);
    warned(&glb.load().unwrap(), "occlusion textures are ignored");
}

#[test]
fn one_image_serves_two_textures_and_materials_keep_their_names() {
    let mut glb = painted();
    glb.push("textures", json!({"source": 0}));
    glb.json["materials"][0]["emissiveTexture"] = json!({"index": 1});
    glb.push("materials", json!({"name": "unused"}));
    let scene = glb.load().unwrap();
    assert_eq!((scene.textures.len(), scene.textures[0].rgba.as_slice()), (1, &[10, 20, 30, 255][..]));
    let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["paint", "unused", "default"]);
}

#[test]
fn extensions_are_read_ignored_or_refused() {
    let with = |list: &str, name: &str| {
        let mut glb = Glb::triangle();
        glb.json[list] = json!([name]);
        glb
    };
    for harmless in ["KHR_materials_variants", "KHR_audio", "VRMC_vrm"] {
        warned(&with("extensionsRequired", harmless).load().unwrap(), &format!("{harmless} is not read: "));
    }
    for read in [
        "KHR_mesh_quantization",
        "KHR_materials_clearcoat",
        "KHR_xmp_json_ld",
        "EXT_texture_webp",
        "KHR_texture_basisu",
        "KHR_draco_mesh_compression",
        "EXT_meshopt_compression",
    ] {
        assert!(with("extensionsRequired", read).load().unwrap().warnings.is_empty(), "{read}");
    }
    assert_eq!(with("extensionsUsed", "ACME_clay").load().unwrap().warnings, ["extensions ACME_clay are ignored"]);
    let required = with("extensionsRequired", "ACME_clay");
    assert!(required.error().contains("it requires ACME_clay, which this program cannot read; `--allow-unsupported`"));
    let files = folder(&[("scene.glb", &required.bytes()), ("scene.ron", b"(gltf: \"scene.glb\")")]);
    let options = LoadOptions { allow_unsupported: true };
    for name in ["scene.glb", "scene.ron"] {
        let scene = Scene::load_with(files.path().join(name).to_str().unwrap(), &options).unwrap();
        warned(&scene, "it requires ACME_clay, which this program cannot read: the picture may be wrong");
        assert!(load_in(&files, name).is_err());
    }
    assert!(with("extensionsRequired", "EXT_texture_avif").error().contains("`npx @gltf-transform/cli png IN.glb OUT.glb"));
}

#[test]
fn an_image_that_cannot_be_read_is_none_where_that_is_allowed() {
    let mut glb = Glb::square(json!({"emissiveTexture": {"index": 0}, "emissiveFactor": [1, 2, 3]}));
    glb.texture(b"\0\0\0\x1cftypavif", json!({}));
    let error = glb.error();
    assert!(error.contains("it is an AVIF picture; `npx @gltf-transform/cli png"), "{error}");
    let files = folder(&[("scene.glb", &glb.bytes())]);
    let scene = Scene::load_with(files.path().join("scene.glb").to_str().unwrap(), &LoadOptions { allow_unsupported: true }).unwrap();
    assert!(scene.materials[0].emissive_texture.is_none() && scene.materials[0].emissive == Vec3::new(1.0, 2.0, 3.0));
    warned(&scene, "goes without it");
}

#[test]
fn accessors_without_a_view_are_zeros() {
    let mut glb = Glb::triangle();
    let (places, values) = (glb.view(&[1, 2]), glb.view(&[1f32, 0.0, 0.0, 0.0, 2.0, 0.0].map(f32::to_le_bytes).concat()));
    let sparse = json!({"count": 2, "indices": {"bufferView": places, "componentType": 5121}, "values": {"bufferView": values}});
    glb.json["accessors"][0] = json!({"componentType": 5126, "count": 3, "type": "VEC3", "sparse": sparse});
    let scene = glb.load().unwrap();
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, 2.0 * Vec3::Y]);
    // Texture coordinates of zeros.
    let mut glb = Glb::square(json!({}));
    glb.json["accessors"][2] = json!({"componentType": 5126, "count": 4, "type": "VEC2"});
    assert!(glb.load().unwrap().meshes[0].uvs.iter().all(|uv| *uv == glam::Vec2::ZERO));
}

#[test]
fn ranges_of_positions_are_not_needed() {
    for (key, value) in [("min", Value::Null), ("max", Value::Null), ("min", json!([0])), ("max", json!("far"))] {
        let mut glb = Glb::triangle();
        glb.json["accessors"][0][key] = value;
        assert_eq!(glb.load().unwrap().bounds().max, DVec3::new(1.0, 1.0, 0.0));
    }
}

#[test]
fn scenes_in_every_valid_form() {
    let changes: [&dyn Fn(&mut Value); 6] = [
        &|json| _ = json.as_object_mut().unwrap().remove("scene"),
        &|json| {
            json.as_object_mut().unwrap().remove("scene");
            json.as_object_mut().unwrap().remove("scenes");
        },
        &|json| json["scenes"] = json!([]),
        &|json| (json["scenes"], json["scene"]) = (json!([{}, {"nodes": [0]}]), json!(1)),
        &|json| (json["scenes"], json["scene"]) = (json!([{"name": "empty"}, {"nodes": [0]}]), Value::Null),
        &|json| json["meshes"].as_array_mut().unwrap().push(json!({})),
    ];
    for (index, change) in changes.iter().enumerate() {
        let mut glb = Glb::triangle();
        change(&mut glb.json);
        if index == 2 {
            glb.json.as_object_mut().unwrap().remove("scene");
        }
        let scene = glb.load().unwrap_or_else(|error| panic!("change {index}: {error}"));
        assert_eq!(scene.triangles().len(), 1, "change {index}");
    }
}

#[test]
fn unknown_animation_channels_are_skipped() {
    let mut glb = Glb::triangle();
    glb.animate(0, "translation", "LINEAR", &[0.0, 1.0], &[0., 0., 0., 2., 0., 0.]);
    let pointer = json!({"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}});
    let channels = glb.json["animations"][0]["channels"].as_array_mut().unwrap();
    channels.insert(0, json!({"sampler": 1, "target": {"path": "pointer", "extensions": pointer}}));
    channels.push(json!({"sampler": 1, "target": {"node": 0, "path": "colour"}}));
    glb.json["animations"][0]["samplers"].as_array_mut().unwrap().push(json!({"input": 99, "output": 99}));
    let mut scene = glb.load().unwrap();
    warned(&scene, "animation channels that move no transform of a node are skipped: 2, first `/materials/0/alphaCutoff`");
    scene.set_time(1.0);
    assert_eq!(scene.instances[0].world_from_local.w_axis.x, 2.0);
}

#[test]
fn odd_strides() {
    for stride in [json!(0), json!(12)] {
        let mut glb = Glb::triangle();
        glb.json["bufferViews"][0]["byteStride"] = stride;
        assert_eq!(glb.load().unwrap().meshes[0].positions[1], Vec3::X);
    }
    // Far apart, and of a size that no device takes.
    let mut bytes = vec![0; 3 * 300];
    for (vertex, position) in [[0f32, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 6.0, 0.0]].iter().enumerate() {
        bytes[vertex * 300..vertex * 300 + 12].copy_from_slice(&position.map(f32::to_le_bytes).concat());
    }
    let mut glb = Glb::triangle();
    let view = glb.view(&bytes);
    glb.json["bufferViews"][view]["byteStride"] = json!(300);
    glb.json["accessors"][0]["bufferView"] = json!(view);
    assert_eq!(glb.load().unwrap().meshes[0].positions, [Vec3::ZERO, 5.0 * Vec3::X, 6.0 * Vec3::Y]);
}

#[test]
fn rounding_is_clamped_with_a_word_and_no_more() {
    let mut glb = Glb::square(json!({
        "name": "m", "emissiveFactor": [-1e-9, 4.0, 0], "alphaMode": "MASK", "alphaCutoff": -1e-9,
        "pbrMetallicRoughness": {"baseColorFactor": [1.0000001192, 0.3, -1e-7, 1.0000001], "roughnessFactor": 1.0000001, "metallicFactor": -1e-12},
    }));
    let spot = glb.light(json!({"type": "spot", "spot": {"innerConeAngle": -1e-9, "outerConeAngle": 1.571}}));
    glb.node(json!({"extensions": {"KHR_lights_punctual": {"light": spot}}}));
    let swapped = glb.light(json!({"type": "spot", "intensity": -1e-9, "spot": {"innerConeAngle": 0.8, "outerConeAngle": 0.5}}));
    glb.node(json!({"extensions": {"KHR_lights_punctual": {"light": swapped}}}));
    let scene = glb.load().unwrap();
    let material = &scene.materials[0];
    assert_eq!((material.base_color, material.roughness, material.metallic), (Vec3::new(1.0, 0.3, 0.0), 1.0, 0.0));
    assert_eq!(material.emissive, Vec3::new(0.0, 4.0, 0.0));
    assert_eq!(scene.lights[0].kind, LightKind::Spot { inner: 0.0, outer: std::f32::consts::FRAC_PI_2 });
    assert_eq!((scene.lights[1].kind, scene.lights[1].intensity), (LightKind::Spot { inner: 0.5, outer: 0.5 }, Vec3::ZERO));
    warned(&scene, "numbers out of range by rounding are clamped: 10, first in material `m`: baseColorFactor of 1.0000001192 to 1");
    glb.json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(1.01);
    assert!(glb.error().contains("base colour, metallic and roughness must lie in [0, 1]"));
}

#[test]
fn byte_order_marks_are_skipped_and_other_encodings_named() {
    let mut glb = Glb::triangle();
    let uri = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": uri}]);
    let text = serde_json::to_vec(&glb.json).unwrap();
    let marked = [b"\xef\xbb\xbf".as_slice(), &text].concat();
    assert_eq!(load(&marked, "scene.gltf").unwrap().meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert!(load(&container(&marked, b""), "scene.glb").is_ok());
    // Padded with zeros, and with a chunk of another kind.
    let mut padded = container(&[&text[..], b"\0\0\0"].concat(), b"");
    padded.extend([4, 0, 0, 0, b'A', b'C', b'M', b'E', 1, 2, 3, 4]);
    let length = u32::try_from(padded.len()).unwrap();
    padded[8..12].copy_from_slice(&length.to_le_bytes());
    assert!(load(&padded, "scene.glb").is_ok());
    let wide: Vec<u8> = String::from_utf8(marked).unwrap().encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(message(load(&wide, "scene.gltf")).contains("it is UTF-16 text; save it as UTF-8"));
}

const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935c943f9e0ff69d22eadbb8f32b1258daaa5e2ca24d17e2393\nsize 12345\n";

#[test]
fn what_stands_in_for_a_file_is_told() {
    let stand_ins: [(&[u8], &str); 5] = [
        (POINTER, "it is a Git LFS pointer, not the data of 12345 bytes; `git lfs pull`"),
        (b"<!DOCTYPE html><html><body>404</body></html>", "it is a web page (HTML)"),
        (b"<?xml version=\"1.0\"?><Error/>", "it is an XML document"),
        (b"PK\x03\x04\x14\0\0\0", "it is a zip archive"),
        (b"", "the file is empty"),
    ];
    for (bytes, expected) in stand_ins {
        for name in ["scene.glb", "scene.gltf", "scene.ron"] {
            let error = message(load(bytes, name));
            assert!(error.contains(expected), "{name}: `{expected}` is not in {error}");
        }
        // A buffer of its own, declared short enough that the pointer would do for it.
        let mut glb = Glb::triangle();
        glb.json["buffers"] = json!([{"byteLength": 36, "uri": "scene.bin"}]);
        let text = serde_json::to_vec(&glb.json).unwrap();
        let error = message(load_in(&folder(&[("scene.gltf", &text), ("scene.bin", bytes)]), "scene.gltf"));
        assert!(error.contains("buffer 0: ") && error.contains(expected), "`{expected}` is not in {error}");
        let mut glb = painted();
        glb.json["images"][0] = json!({"uri": "scene.png"});
        let error = message(load_in(&folder(&[("scene.glb", &glb.bytes()), ("scene.png", bytes)]), "scene.glb"));
        assert!(error.contains("image 0: `scene.png`: ") && error.contains(expected), "`{expected}` is not in {error}");
        let ron = b"(gltf: \"builtin:spheres\", environment: (file: \"scene.hdr\"))";
        let error = load_in(&folder(&[("scene.ron", ron), ("scene.hdr", bytes)]), "scene.ron").unwrap_err().to_string();
        assert!(error.contains("scene.hdr: ") && error.contains(expected), "`{expected}` is not in {error}");
    }
    // Numbers that happen to begin like an archive are numbers.
    let mut glb = Glb::triangle();
    let view = glb.view(&[&b"PK\x03\x04"[..], &[0; 32]].concat());
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": "scene.bin"}]);
    glb.json["bufferViews"][0]["byteOffset"] = json!(0);
    let bytes = [&b"PK\x03\x04"[..], &glb.bin[4..36]].concat();
    let text = serde_json::to_vec(&glb.json).unwrap();
    assert!(view > 0 && load_in(&folder(&[("scene.gltf", &text), ("scene.bin", &bytes)]), "scene.gltf").is_ok());
}
