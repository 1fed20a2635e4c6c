//! What numbers in a file mean.

use crate::glb::{Glb, folder, load, load_in, png};
use approx::assert_abs_diff_eq;
use glam::{DVec3, Vec2, Vec3, Vec4};
use lobelia_scene::{AlphaMode, LightKind, Scene, Wrap};
use serde_json::json;

/// Quarter turn about +X: -Z becomes +Y, +Y becomes +Z.
const QUARTER_ABOUT_X: [f64; 4] = [std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2];

fn close(left: DVec3, right: DVec3) {
    assert!((left - right).length() < 1e-6, "{left} is not {right}");
}

/// Corners of the scene's only triangle, in the world.
fn corners(scene: &Scene, triangle: usize) -> [DVec3; 3] {
    scene.triangles()[triangle].positions.map(|corner| corner.as_dvec3() + scene.origin())
}

#[test]
fn a_light_shines_along_local_minus_z() {
    let mut glb = Glb::triangle();
    let spot = glb.light(
        json!({"type": "spot", "intensity": 20.0, "color": [1.0, 0.5, 0.25], "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}}),
    );
    let sun = glb.light(json!({"type": "directional", "intensity": 3.0}));
    let bulb = glb.light(json!({"type": "point", "intensity": 7.0, "range": 4.0}));
    let on = |light: usize| json!({"KHR_lights_punctual": {"light": light}});
    glb.node(json!({"name": "straight", "translation": [1, 2, 3], "scale": [5, 5, 5], "extensions": on(spot)}));
    glb.node(json!({"name": "turned", "rotation": QUARTER_ABOUT_X, "extensions": on(sun)}));
    glb.node(json!({"name": "bulb", "translation": [0, 4, 0], "extensions": on(bulb)}));
    let scene = glb.load().unwrap();
    let [spot, sun, bulb] = &scene.lights[..] else { panic!("three lights") };
    assert_eq!((spot.name.as_str(), spot.kind), ("straight", LightKind::Spot { inner: 0.2, outer: 0.5 }));
    close(spot.position, DVec3::new(1.0, 2.0, 3.0));
    close(spot.direction, DVec3::NEG_Z);
    assert_eq!(spot.intensity, Vec3::new(20.0, 10.0, 5.0));
    assert_eq!(sun.kind, LightKind::Directional);
    close(sun.direction, DVec3::Y);
    assert_eq!((bulb.kind, bulb.intensity), (LightKind::Point, Vec3::splat(7.0)));
    assert!(scene.warnings.iter().any(|warning| warning.contains("ranges of lights are ignored")));
    assert!(scene.lights.iter().all(|light| !light.animated));
}

#[test]
fn a_camera_looks_along_local_minus_z() {
    let mut glb = Glb::triangle();
    let lens = json!({"yfov": 0.6, "znear": 0.02, "aspectRatio": 9.0});
    glb.push("cameras", json!({"type": "perspective", "perspective": lens}));
    glb.push("cameras", json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0.1, "zfar": 9}}));
    glb.node(json!({"name": "flat", "camera": 1}));
    glb.node(json!({"name": "upwards", "camera": 0, "translation": [3, 0, 0], "rotation": QUARTER_ABOUT_X, "scale": [1, 2, 3]}));
    let scene = glb.load().unwrap();
    // The orthographic one comes first, but is not the default.
    let camera = scene.camera(None).unwrap();
    assert_eq!(camera.name, "upwards");
    close(camera.position, DVec3::new(3.0, 0.0, 0.0));
    close(camera.forward, DVec3::Y);
    close(camera.up, DVec3::Z);
    close(camera.right, DVec3::X);
    assert_abs_diff_eq!(camera.yfov, 0.6, epsilon = 1e-6);
    assert_abs_diff_eq!(camera.near, 0.02, epsilon = 1e-6);
    let error = scene.camera(Some("flat")).unwrap_err().to_string();
    assert!(error.contains("camera `flat` cannot be used: it is orthographic"), "{error}");
    assert!(scene.warnings.iter().any(|warning| warning.contains("`flat`")));
    let error = scene.camera(Some("upward")).unwrap_err().to_string();
    assert!(error.contains("no camera is called `upward`; did you mean `upwards`?"), "{error}");
    let error = scene.camera(Some("zzz")).unwrap_err().to_string();
    assert!(error.contains("there are flat, upwards"), "{error}");
}

#[test]
fn a_scene_without_cameras_is_seen_whole() {
    let scene = Glb::triangle().load().unwrap();
    let camera = scene.camera(None).unwrap();
    assert_eq!(camera.name, "whole-scene");
    for corner in corners(&scene, 0) {
        let seen = corner - camera.position;
        let depth = seen.dot(camera.forward);
        assert!(depth > camera.near);
        let reach = depth * (camera.yfov / 2.0).tan();
        assert!(seen.dot(camera.up).abs() < reach && seen.dot(camera.right).abs() < reach, "{corner} is outside of the picture");
    }
}

#[test]
fn nodes_nest_and_share_meshes() {
    let mut glb = Glb::triangle();
    let left = glb.child(json!({"name": "left", "mesh": 0, "translation": [-1, 0, 0]}));
    let right = glb.child(json!({"name": "right", "mesh": 0, "translation": [1, 0, 0]}));
    // Column-major: twice as large, at (0, 0, 7).
    let matrix = json!([2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 7, 1]);
    glb.node(json!({"matrix": matrix, "children": [left, right]}));
    let scene = glb.load().unwrap();
    assert_eq!(scene.meshes.len(), 1);
    let names: Vec<&str> = scene.instances.iter().map(|instance| instance.name.as_str()).collect();
    assert_eq!(names, ["triangle", "left", "right"]);
    assert_eq!(corners(&scene, 1)[0], DVec3::new(-2.0, 0.0, 7.0));
    assert_eq!(corners(&scene, 2), [DVec3::new(2.0, 0.0, 7.0), DVec3::new(4.0, 0.0, 7.0), DVec3::new(2.0, 2.0, 7.0)]);
    assert_eq!(scene.traits().triangles, 3);
}

#[test]
fn mirrored_instances_keep_their_front() {
    let mut glb = Glb::triangle();
    glb.node(json!({"name": "mirrored", "mesh": 0, "scale": [-1, 1, 1]}));
    let scene = glb.load().unwrap();
    for triangle in 0..2 {
        let [a, b, c] = corners(&scene, triangle);
        close((b - a).cross(c - a), DVec3::Z);
    }
    assert_eq!(corners(&scene, 1)[0], DVec3::ZERO);
    assert!(corners(&scene, 1).contains(&DVec3::NEG_X));
    assert!(scene.instances[1].world_from_local.determinant() < 0.0);
}

#[test]
fn missing_normals_are_flat() {
    let mut glb = Glb::empty();
    // Two triangles that share an edge and meet at a right angle.
    let positions = glb.floats("VEC3", &[0., 0., 0., 0., 1., 0., 1., 0., 0., 0., 0., 1.]);
    let indices = glb.shorts(&[0, 2, 1, 0, 1, 3]);
    let mesh = glb.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    glb.node(json!({"mesh": mesh}));
    let scene = glb.load().unwrap();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.normals, [[Vec3::Z; 3], [Vec3::X; 3]].concat());
}

#[test]
fn zero_normals_are_mended() {
    let mut glb = Glb::empty();
    let positions = glb.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    let normals = glb.floats("VEC3", &[0., 0., 0., 0., 3., 4., 0., 0., 1e-30]);
    let mesh = glb.mesh(json!({"attributes": {"POSITION": positions, "NORMAL": normals}}));
    glb.node(json!({"mesh": mesh}));
    let scene = glb.load().unwrap();
    assert_eq!(scene.meshes[0].normals, [Vec3::Z, Vec3::new(0.0, 0.6, 0.8), Vec3::Z]);
    assert!(scene.warnings[0].contains("1 normals are zero"), "{:?}", scene.warnings);
}

#[test]
fn strips_and_fans_become_triangles_and_points_are_skipped() {
    let mut glb = Glb::empty();
    let positions = glb.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.]);
    let strip = glb.mesh(json!({"attributes": {"POSITION": positions}, "mode": 5}));
    let round = glb.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    let fan = glb.mesh(json!({"attributes": {"POSITION": round}, "mode": 6}));
    let points = glb.mesh(json!({"attributes": {"POSITION": positions}, "mode": 0}));
    for mesh in [strip, fan, points] {
        glb.node(json!({"mesh": mesh}));
    }
    let scene = glb.load().unwrap();
    assert_eq!(scene.instances.len(), 2);
    assert_eq!(scene.triangles().len(), 4);
    for triangle in 0..4 {
        let [a, b, c] = corners(&scene, triangle);
        close((b - a).cross(c - a), DVec3::Z);
    }
    assert_eq!(scene.warnings, ["points and lines are not drawn"]);
}

#[test]
fn factors_become_a_material() {
    let glb = Glb::square(json!({
        "name": "paint",
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1.0], "metallicFactor": 0.4, "roughnessFactor": 0.5},
        "emissiveFactor": [1.0, 0.5, 0.0], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 6.0}},
        "doubleSided": true, "occlusionTexture": {"index": 0},
    }));
    let mut glb = glb;
    glb.texture(&png(1, 1, &[9, 9, 9, 9]), json!({}));
    let scene = glb.load().unwrap();
    let paint = &scene.materials[0];
    assert_eq!((paint.name.as_str(), paint.base_color), ("paint", Vec3::new(0.1, 0.2, 0.3)));
    assert_eq!((paint.metallic, paint.roughness, paint.specular, paint.alpha()), (0.4, 0.5, 1.0, 0.25));
    assert_eq!(paint.emissive, Vec3::new(6.0, 3.0, 0.0));
    assert!(paint.double_sided && paint.alpha_mode == AlphaMode::Opaque);
    assert_eq!(scene.warnings, ["occlusion textures are ignored: light is computed, not painted"]);
    let traits = scene.traits();
    assert!(traits.emissive && traits.metallic && traits.specular && !traits.base_color_textures);
    assert_eq!(traits.sharpest_alpha, Some(0.25));
}

#[test]
fn a_primitive_without_material_is_a_rough_metal() {
    let scene = Glb::triangle().load().unwrap();
    let material = &scene.materials[scene.meshes[0].material];
    assert_eq!((material.base_color, material.metallic, material.roughness), (Vec3::ONE, 1.0, 1.0));
}

#[test]
fn alpha_modes() {
    let with = |mode: &str, cutoff: f32, factor: f32| {
        let pbr = json!({"baseColorFactor": [1.0, 1.0, 1.0, factor]});
        let scene = Glb::square(json!({"alphaMode": mode, "alphaCutoff": cutoff, "pbrMetallicRoughness": pbr})).load().unwrap();
        (scene.materials[0].alpha_mode, scene.warnings.join(""))
    };
    assert_eq!(with("MASK", 0.25, 1.0).0, AlphaMode::Mask { cutoff: 0.25 });
    // The texture's alpha is compared after the factor.
    assert_eq!(with("MASK", 0.25, 0.5).0, AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(with("MASK", 0.25, 0.125).0, AlphaMode::Mask { cutoff: AlphaMode::NOTHING_LEFT });
    assert_eq!(with("MASK", 0.0, 0.0).0, AlphaMode::Mask { cutoff: 0.0 });
    assert_eq!(with("OPAQUE", 0.25, 0.5), (AlphaMode::Opaque, String::new()));
    assert_eq!(with("BLEND", 0.25, 0.5), (AlphaMode::Opaque, "blended materials are drawn opaque".into()));
}

#[test]
fn textures_are_decoded_row_by_row_from_the_top() {
    let texels: Vec<u8> = (0..24).collect();
    let mut glb = Glb::square(json!({"pbrMetallicRoughness": {
        "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 1}, "roughnessFactor": 0.5,
    }}));
    glb.texture(&png(3, 2, &texels), json!({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}));
    glb.texture(&png(1, 2, &[0, 255, 0, 255, 0, 51, 0, 255]), json!({}));
    let scene = glb.load().unwrap();
    let texture = &scene.textures[0];
    assert_eq!((texture.width, texture.height, &texture.rgba), (3, 2, &texels));
    let sampler = scene.materials[0].base_color_texture.unwrap().sampler;
    assert_eq!((sampler.wrap_u, sampler.wrap_v, sampler.nearest), (Wrap::Clamp, Wrap::Mirror, true));
    let default = scene.materials[0].metallic_roughness_texture.unwrap().sampler;
    assert_eq!((default.wrap_u, default.wrap_v, default.nearest), (Wrap::Repeat, Wrap::Repeat, false));
    // Green 51 is 0.2, so roughness is 0.1 at its least.
    assert_abs_diff_eq!(scene.traits().sharpest_alpha.unwrap(), 0.01, epsilon = 1e-6);
}

#[test]
fn sixteen_bit_images_become_eight_bit() {
    let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![0x8080u16, 0xffff]).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let mut glb = Glb::square(json!({"emissiveTexture": {"index": 0}}));
    glb.texture(&bytes.into_inner(), json!({}));
    let scene = glb.load().unwrap();
    assert_eq!(scene.textures[0].rgba, [128, 128, 128, 255, 255, 255, 255, 255]);
}

/// The square's tangents with a normal map, for given texture coordinates.
fn tangents(uvs: Option<&[f32]>) -> (Vec<Vec4>, Vec<String>) {
    let mut glb = Glb::square(json!({"normalTexture": {"index": 0, "scale": 0.5}}));
    glb.texture(&png(1, 1, &[128, 128, 255, 255]), json!({}));
    let attributes = &mut glb.json["meshes"][0]["primitives"][0]["attributes"];
    match uvs {
        Some(uvs) => {
            let uvs = glb.floats("VEC2", uvs);
            glb.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
        }
        None => drop(attributes.as_object_mut().unwrap().remove("TEXCOORD_0")),
    }
    let scene = glb.load().unwrap();
    assert_eq!(scene.materials[0].normal_scale, 0.5);
    (scene.meshes[0].tangents.clone(), scene.warnings.clone())
}

#[test]
fn missing_tangents_follow_the_texture() {
    // u along +X, v down: the image stands upright, so up in the image is cross(N, T) = +Y.
    let (upright, warnings) = tangents(Some(&[0., 1., 1., 1., 1., 0., 0., 0.]));
    assert_eq!((upright.len(), warnings.len()), (6, 0));
    assert!(upright.iter().all(|tangent| (*tangent - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6), "{upright:?}");
    // Mirrored in u: T turns over and up stays up.
    let (mirrored, _) = tangents(Some(&[1., 1., 0., 1., 0., 0., 1., 0.]));
    assert!(mirrored.iter().all(|tangent| (*tangent - Vec4::new(-1.0, 0.0, 0.0, -1.0)).length() < 1e-6), "{mirrored:?}");
    // Turned by a quarter: u along +Y.
    let (turned, _) = tangents(Some(&[0., 0., 0., 1., 1., 1., 1., 0.]));
    assert!(turned.iter().all(|tangent| (tangent.truncate() - Vec3::Y).length() < 1e-6), "{turned:?}");
}

#[test]
fn without_texture_coordinates_there_is_no_normal_map() {
    let (none, warnings) = tangents(None);
    assert!(none.iter().all(|tangent| *tangent == Vec4::ZERO));
    assert!(warnings[0].contains("its normal map is ignored"), "{warnings:?}");
    let (collapsed, _) = tangents(Some(&[0.5; 8]));
    assert!(collapsed.iter().all(|tangent| tangent.is_finite()), "{collapsed:?}");
}

#[test]
fn tangents_of_the_file_are_kept_and_need_normals() {
    let mut glb = Glb::square(json!({"normalTexture": {"index": 0}}));
    glb.texture(&png(1, 1, &[128, 128, 255, 255]), json!({}));
    let tangents = glb.floats("VEC4", &[0., 2., 0., -1.].repeat(4));
    glb.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(tangents);
    assert_eq!(glb.load().unwrap().meshes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]);
    glb.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let scene = glb.load().unwrap();
    assert!((scene.meshes[0].tangents[0] - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6);
}

#[test]
fn integers_sparse_elements_and_strides_are_read() {
    let mut glb = Glb::triangle();
    // Texture coordinates as normalised bytes, four bytes apart.
    let view = glb.view(&[0, 255, 9, 9, 255, 51, 9, 9, 0, 0, 9, 9]);
    glb.json["bufferViews"][view]["byteStride"] = json!(4);
    let uvs = glb.push("accessors", json!({"bufferView": view, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"}));
    glb.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    // The second corner moves to (2, 0, 0).
    let (places, values) = (glb.view(&[1, 0]), glb.view(&[2f32, 0.0, 0.0].map(f32::to_le_bytes).concat()));
    glb.json["accessors"][0]["sparse"] =
        json!({"count": 1, "indices": {"bufferView": places, "componentType": 5123}, "values": {"bufferView": values}});
    let scene = glb.load().unwrap();
    assert_eq!(scene.meshes[0].uvs, [Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.2), Vec2::ZERO]);
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, 2.0 * Vec3::X, Vec3::Y]);
    glb.bin[usize::try_from(glb.json["bufferViews"][places]["byteOffset"].as_u64().unwrap()).unwrap()] = 3;
    assert!(glb.error().contains("accessor 0: it is sparse and replaces element 3 of 3"));
}

#[test]
fn buffers_and_images_may_lie_beside_the_file_or_inside_its_json() {
    let mut glb = Glb::square(json!({"emissiveTexture": {"index": 0}}));
    let dot = png(1, 1, &[1, 2, 3, 255]);
    glb.push("images", json!({"uri": "a%20dot.png"}));
    glb.push("textures", json!({"source": 0}));
    glb.json["buffers"] = json!([{"uri": "numbers.bin", "byteLength": glb.bin.len()}]);
    let text = serde_json::to_vec(&glb.json).unwrap();
    let beside = folder(&[("scene.gltf", &text), ("numbers.bin", &glb.bin), ("a dot.png", &dot)]);
    let from_files = load_in(&beside, "scene.gltf").unwrap();

    use base64::{Engine, engine::general_purpose::STANDARD};
    glb.json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{}", STANDARD.encode(&glb.bin)));
    glb.json["images"][0]["uri"] = json!(format!("data:image/png;base64,{}", STANDARD.encode(&dot)));
    let inside = load(&serde_json::to_vec(&glb.json).unwrap(), "scene.gltf").unwrap();
    for scene in [&from_files, &inside] {
        assert_eq!(scene.textures[0].rgba, [1, 2, 3, 255]);
        assert_eq!(scene.triangles().len(), 2);
    }
    assert_eq!(from_files.meshes, inside.meshes);
}

#[test]
fn a_scene_ten_kilometres_away_is_as_precise() {
    let far = DVec3::new(10_000.0, -3000.0, 7000.0);
    let mut glb = Glb::square(json!({}));
    glb.json["nodes"][0]["translation"] = json!([10_000.25, -3000.5, 7000.125]);
    glb.json["nodes"][0]["rotation"] = json!([0.18257419, 0.36514837, 0.5477226, 0.73029674]);
    let mut here = glb.clone();
    here.json["nodes"][0]["translation"] = json!([0.25, -0.5, 0.125]);
    let (there, here) = (glb.load().unwrap(), here.load().unwrap());
    assert_eq!(there.origin() - here.origin(), far);
    assert_eq!(there.origin(), there.origin().round());
    for (there, here) in there.triangles().iter().zip(here.triangles()) {
        for (left, right) in there.positions.iter().zip(here.positions) {
            // Half an f32 step at 1 m. In 32-bit world coordinates it would be half a millimetre.
            assert!((*left - right).abs().max_element() <= f32::EPSILON, "{left} is not {right}");
        }
    }
}

#[test]
fn an_unknown_optional_extension_is_a_warning() {
    let mut glb = Glb::triangle();
    glb.json["extensionsUsed"] = json!(["KHR_texture_transform", "KHR_lights_punctual"]);
    assert_eq!(glb.load().unwrap().warnings, ["extension KHR_texture_transform is ignored: textures lie untransformed"]);
}

#[test]
fn vertex_colours_and_skins_are_ignored_aloud() {
    let mut glb = Glb::triangle();
    let colors = glb.floats("VEC3", &[1.0; 9]);
    glb.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    glb.json["skins"] = json!([{"joints": [0]}]);
    glb.json["nodes"][0]["skin"] = json!(0);
    let warnings = glb.load().unwrap().warnings;
    assert!(warnings.iter().any(|warning| warning == "vertex colours are ignored"), "{warnings:?}");
    assert!(warnings.iter().any(|warning| warning.starts_with("skins are ignored")), "{warnings:?}");
}
