//! Vertex colours, texture coordinates, and extensions of materials.

use crate::glb::{Glb, png};
use glam::{DVec2, Vec2, Vec3, Vec4};
use lobelia_scene::{Material, Scene, TextureRef, UvSet};
use serde_json::{Value, json};

/// The square with a texture in each of four places, all written as `info`.
fn textured(info: Value) -> Glb {
    let mut glb = Glb::square(json!({
        "pbrMetallicRoughness": {"baseColorTexture": info, "metallicRoughnessTexture": info},
        "normalTexture": info, "emissiveTexture": info, "emissiveFactor": [1, 1, 1],
    }));
    glb.texture(&png(1, 1, &[128, 128, 255, 255]), json!({}));
    glb
}

fn with_second_uvs(mut glb: Glb) -> Glb {
    let uvs = glb.floats("VEC2", &[0.5, 0.0, 0.5, 0.25, 0.5, 0.5, 0.5, 0.75]);
    glb.attribute("TEXCOORD_1", uvs);
    glb
}

fn textures(scene: &Scene) -> [TextureRef; 4] {
    scene.materials[0].textures().map(Option::unwrap)
}

#[test]
fn colours_of_every_kind_are_read() {
    let colors = |read: &dyn Fn(&mut Glb) -> usize| {
        let mut glb = Glb::square(json!({}));
        let accessor = read(&mut glb);
        glb.attribute("COLOR_0", accessor);
        let scene = glb.load().unwrap();
        assert!(scene.traits().vertex_colors && scene.warnings.is_empty());
        scene.meshes[0].colors.clone()
    };
    assert_eq!(colors(&|glb| glb.floats("VEC3", &[0.25, 0.5, 1.0].repeat(4))), [Vec4::new(0.25, 0.5, 1.0, 1.0); 4]);
    // Beyond [0, 1] is cut off.
    assert_eq!(colors(&|glb| glb.floats("VEC4", &[2.0, -0.5, 1.0, 0.5].repeat(4))), [Vec4::new(1.0, 0.0, 1.0, 0.5); 4]);
    let bytes = |glb: &mut Glb| {
        let accessor = glb.joints(&[255, 51, 0, 102].repeat(4));
        glb.json["accessors"][accessor]["normalized"] = json!(true);
        accessor
    };
    assert_eq!(colors(&bytes), [Vec4::new(1.0, 0.2, 0.0, 0.4); 4]);
    let shorts = |glb: &mut Glb| {
        let view = glb.view(&[0x33, 0x33, 0xff, 0xff, 0, 0, 0, 0].repeat(4));
        glb.json["bufferViews"][view]["byteStride"] = json!(8);
        glb.push("accessors", json!({"bufferView": view, "componentType": 5123, "normalized": true, "count": 4, "type": "VEC3"}))
    };
    assert_eq!(colors(&shorts), [Vec4::new(0.2, 1.0, 0.0, 1.0); 4]);
    let plain = Glb::square(json!({})).load().unwrap();
    assert!(plain.meshes[0].colors.is_empty() && !plain.traits().vertex_colors);
    let mut glb = Glb::square(json!({}));
    let few = glb.floats("VEC3", &[1.0; 9]);
    glb.attribute("COLOR_0", few);
    assert!(glb.error().contains("COLOR_0 has 3 elements, POSITION has 4"));
}

#[test]
fn only_the_sets_that_are_read_are_kept() {
    let first = [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO];
    let second = [0.0, 0.25, 0.5, 0.75].map(|v| Vec2::new(0.5, v));
    // All textures read set 1: it is the only one.
    let scene = with_second_uvs(textured(json!({"index": 0, "texCoord": 1}))).load().unwrap();
    assert!(scene.meshes[0].uvs.iter().all(|uv| second.contains(uv)) && scene.meshes[0].second_uvs.is_empty());
    assert!(!scene.traits().second_uvs && !scene.traits().texture_transforms);
    // Two sets.
    let mut glb = with_second_uvs(textured(json!({"index": 0})));
    glb.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(1);
    let scene = glb.load().unwrap();
    assert!(scene.traits().second_uvs && scene.traits().texture_transforms && scene.warnings.is_empty());
    assert_eq!(textures(&scene).map(|texture| texture.uv_set), [UvSet::Second, UvSet::First, UvSet::First, UvSet::First]);
    let mesh = &scene.meshes[0];
    // Tangents were made, which gave every corner its own vertex: both sets went along.
    for (uv, other) in mesh.uvs.iter().zip(&mesh.second_uvs) {
        let place = first.iter().position(|first| first == uv).unwrap();
        assert_eq!(*other, second[place]);
    }
    // A third set is one too many.
    glb.json["materials"][0]["emissiveTexture"]["texCoord"] = json!(2);
    let warnings = glb.load().unwrap().warnings;
    assert!(warnings[0].contains("reads more than two sets of texture coordinates: what reads set 2 reads set 0"), "{warnings:?}");
    // One that the mesh does not have.
    let missing = textured(json!({"index": 0, "texCoord": 3})).load().unwrap();
    assert!(missing.warnings[0].contains("its material reads TEXCOORD_3, which it does not have"), "{:?}", missing.warnings);
}

#[test]
fn transforms_of_textures_scale_turn_and_move() {
    let extension = json!({"offset": [0.25, -1.0], "rotation": 0.4, "scale": [2.0, 3.0], "texCoord": 1});
    let mut glb = with_second_uvs(textured(json!({"index": 0, "extensions": {"KHR_texture_transform": extension}})));
    glb.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
    let scene = glb.load().unwrap();
    assert!(scene.warnings.is_empty() && scene.traits().texture_transforms && !scene.traits().second_uvs);
    let (sine, cosine) = 0.4f64.sin_cos();
    for texture in textures(&scene) {
        for uv in [DVec2::ZERO, DVec2::new(0.3, 0.8)] {
            let scaled = uv * DVec2::new(2.0, 3.0);
            // Counter-clockwise where v points down.
            let expected = DVec2::new(0.25 + cosine * scaled.x + sine * scaled.y, -1.0 - sine * scaled.x + cosine * scaled.y);
            assert!((texture.uv(uv, DVec2::NAN) - expected).length() < 1e-6);
        }
    }
    // Set 1 is the only one that is read.
    assert_eq!(scene.meshes[0].uvs[0].x, 0.5);
    for (broken, expected) in [
        (json!({"offset": [1]}), "KHR_texture_transform: `offset` is not two finite numbers"),
        (json!({"scale": [1, "x"]}), "`scale` is not two finite numbers"),
        (json!({"rotation": 1e300}), "`rotation` is not a finite number"),
        (json!({"texCoord": -1}), "`texCoord` is not a whole number"),
    ] {
        let error = textured(json!({"index": 0, "extensions": {"KHR_texture_transform": broken}})).error();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn made_tangents_follow_the_normal_map_as_it_lies() {
    let quarter = std::f32::consts::FRAC_PI_2;
    let turned = textured(json!({"index": 0, "extensions": {"KHR_texture_transform": {"rotation": quarter}}})).load().unwrap();
    // u' is v, and v points down: u' grows along -Y.
    let tangents = &turned.meshes[0].tangents;
    assert!(tangents.iter().all(|tangent| (*tangent - Vec4::new(0.0, -1.0, 0.0, 1.0)).length() < 1e-5), "{tangents:?}");
}

#[test]
fn quantised_attributes_are_read_whether_required_or_not() {
    for list in ["extensionsUsed", "extensionsRequired"] {
        let mut glb = Glb::empty();
        let mut accessor = |bytes: &[u8], stride: usize, kind: u32, normalized: bool, shape: &str, range: Option<Value>| {
            let view = glb.view(bytes);
            glb.json["bufferViews"][view]["byteStride"] = json!(stride);
            let mut accessor = json!({"bufferView": view, "componentType": kind, "normalized": normalized, "count": 3, "type": shape});
            if let Some(range) = range {
                (accessor["min"], accessor["max"]) = (range[0].clone(), range[1].clone());
            }
            glb.push("accessors", accessor)
        };
        let shorts = |numbers: &[i16]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        // Positions in whole steps, normals and tangents in normalised bytes, texture coordinates in whole shorts and normalised ones.
        let bytes = shorts(&[0, 0, 0, 0, 100, 0, 0, 0, 0, -50, 0, 0]);
        let positions = accessor(&bytes, 8, 5122, false, "VEC3", Some(json!([[0, -50, 0], [100, 0, 0]])));
        let normals = accessor(&[0, 0, 0x81, 0].repeat(3), 4, 5120, true, "VEC3", None);
        let tangents = accessor(&[127, 0, 0, 0x81].repeat(3), 4, 5120, true, "VEC4", None);
        let uvs = accessor(&shorts(&[0, 0, 300, 7, -2, 1]), 4, 5122, false, "VEC2", None);
        let material = json!({"normalTexture": {"index": 0}});
        glb.json["materials"] = json!([material]);
        glb.texture(&png(1, 1, &[128, 128, 255, 255]), json!({}));
        let attributes = json!({"POSITION": positions, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": uvs});
        let mesh = glb.mesh(json!({"attributes": attributes, "material": 0}));
        glb.node(json!({"mesh": mesh, "scale": [0.01, 0.01, 0.01]}));
        glb.json[list] = json!(["KHR_mesh_quantization"]);
        let scene = glb.load().unwrap();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let mesh = &scene.meshes[0];
        assert_eq!(mesh.positions, [Vec3::ZERO, 100.0 * Vec3::X, -50.0 * Vec3::Y]);
        assert_eq!((mesh.normals[0], mesh.tangents[0]), (Vec3::NEG_Z, Vec4::new(1.0, 0.0, 0.0, -1.0)));
        assert_eq!(mesh.uvs, [Vec2::ZERO, Vec2::new(300.0, 7.0), Vec2::new(-2.0, 1.0)]);
        assert!((scene.bounds().max.x - 1.0).abs() < 1e-7);
    }
}

fn material(material: Value) -> (Material, Scene) {
    let scene = Glb::square(material).load().unwrap();
    (scene.materials[0].clone(), scene)
}

fn near(found: Vec4, expected: Vec4) {
    assert!((found - expected).length() < 1e-6, "{found} is not {expected}");
}

#[test]
fn indices_of_refraction_and_specular_factors_give_the_reflectance_of_dielectrics() {
    let dielectric = |extensions: Value| {
        let (read, scene) = material(json!({"extensions": extensions}));
        assert!(scene.warnings.is_empty());
        assert_eq!(scene.traits().dielectric, read.dielectric != Material::DIELECTRIC);
        read.dielectric
    };
    assert_eq!(dielectric(json!({})), Material::DIELECTRIC);
    near(dielectric(json!({"KHR_materials_ior": {"ior": 1.5}})), Material::DIELECTRIC);
    // Water, diamond, and what stands for a mirror.
    near(dielectric(json!({"KHR_materials_ior": {"ior": 1.33}})), Vec4::new(0.020059, 0.020059, 0.020059, 1.0));
    near(dielectric(json!({"KHR_materials_ior": {"ior": 2.42}})), Vec4::new(0.172395, 0.172395, 0.172395, 1.0));
    assert_eq!(dielectric(json!({"KHR_materials_ior": {"ior": 0.0}})), Vec4::ONE);
    let half = json!({"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 0.5, 50.0]}});
    near(dielectric(half), Vec4::new(0.02, 0.01, 0.5, 0.5));
    let error = Glb::square(json!({"name": "m", "extensions": {"KHR_materials_specular": {"specularFactor": 2.0}}})).error();
    assert!(error.contains("material `m`: its index of refraction is 1.5, its specularFactor 2"), "{error}");
    let mut glb = Glb::square(json!({"extensions": {"KHR_materials_specular": {"specularTexture": {"index": 0}}}}));
    glb.texture(&png(1, 1, &[9; 4]), json!({}));
    assert_eq!(glb.load().unwrap().warnings, ["textures of KHR_materials_specular are not read: its factors hold alone"]);
}

#[test]
fn unlit_surfaces_keep_their_colour_and_nothing_else() {
    let (read, scene) = material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.1, 0.2, 1.0]}, "emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_unlit": {}},
    }));
    assert!(read.unlit && !read.emits());
    assert_eq!((read.base_color, read.emissive), (Vec3::new(0.9, 0.1, 0.2), Vec3::ZERO));
    let traits = scene.traits();
    assert!(traits.unlit && !traits.emissive && !traits.specular && !traits.metallic && traits.sharpest_alpha.is_none());
    assert!(scene.warnings.is_empty());
}

#[test]
fn specular_and_glossiness_become_a_dielectric_of_that_colour() {
    let glossy = json!({"diffuseFactor": [0.2, 0.4, 0.8, 1.0], "specularFactor": [0.1, 0.2, 0.5], "glossinessFactor": 0.75});
    let (read, scene) = material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": glossy}}));
    assert!((read.base_color - Vec3::new(0.1, 0.2, 0.4)).length() < 1e-6);
    assert_eq!((read.metallic, read.roughness, read.dielectric), (0.0, 0.25, Vec4::new(0.1, 0.2, 0.5, 1.0)));
    assert!(scene.warnings.is_empty());
    let mut glb = Glb::square(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1}, "glossinessFactor": 0.5,
    }}}));
    glb.texture(&png(1, 1, &[0, 0, 0, 255]), json!({}));
    // A white mirror.
    glb.texture(&png(1, 1, &[255; 4]), json!({}));
    let scene = glb.load().unwrap();
    let [base, rough, ..] = scene.materials[0].textures();
    assert_eq!(scene.textures[base.unwrap().texture].rgba, [255; 4]);
    assert_eq!(scene.textures[rough.unwrap().texture].rgba, [0, 128, 255, 255]);
    assert!(scene.warnings[0].contains("specular-glossiness textures are converted"), "{:?}", scene.warnings);
}

#[test]
fn other_extensions_leave_the_base_material_and_say_what_is_lost() {
    let (_, scene) = material(json!({"extensions": {
        "KHR_materials_clearcoat": {"clearcoatFactor": 1.0}, "KHR_materials_sheen": {"sheenColorFactor": [0, 0, 0], "sheenRoughnessFactor": 0.5},
        "KHR_materials_transmission": {"transmissionFactor": 0.5},
    }}));
    // A sheen of black is none.
    assert_eq!(
        scene.warnings,
        ["KHR_materials_clearcoat is not drawn: surfaces have no coat", "KHR_materials_transmission is not drawn: surfaces are opaque"]
    );
    let mut glb = Glb::triangle();
    glb.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    glb.json["extensionsRequired"] = json!(["KHR_materials_variants"]);
    assert_eq!(glb.load().unwrap().warnings, ["KHR_materials_variants is not read: surfaces have their default materials"]);
}
