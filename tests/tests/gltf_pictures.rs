//! What a glTF scene shows: the device's picture against the path tracer's, of cards that differ in one thing each.
#![allow(clippy::unwrap_used)]

use glam::Vec4;
use lobelia::{
    measure::Image,
    reference::{LightPaths, Render as Tracing, Settings},
    scene::{Ndf, Scene},
};
use lobelia_tests::{Render, has_gpu};
use serde_json::{Value, json};
use std::{io::Cursor, sync::Arc};

const EXTENT: [u32; 2] = [128, 32];

/// A GLB file under construction.
#[derive(Default)]
struct Glb {
    json: Value,
    bin: Vec<u8>,
}

impl Glb {
    fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let range = json!([-9.0, -9.0, -9.0]);
        let mut accessor = json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        if kind == "VEC3" {
            (accessor["min"], accessor["max"]) = (range, json!([9.0, 9.0, 9.0]));
        }
        self.push("accessors", accessor)
    }

    fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = kind.strip_prefix("VEC").map_or(16, |width| width.parse().unwrap());
        self.accessor(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>(), 5126, kind, numbers.len() / width)
    }

    fn bytes(mut self) -> Vec<u8> {
        self.json["buffers"] = json!([{"byteLength": self.bin.len()}]);
        let mut text = serde_json::to_vec(&self.json).unwrap();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let word = |length: usize| u32::try_from(length).unwrap().to_le_bytes();
        let chunks = [&word(text.len())[..], b"JSON", &text, &word(self.bin.len()), b"BIN\0", &self.bin].concat();
        [b"glTF".to_vec(), word(2).to_vec(), word(12 + chunks.len()).to_vec(), chunks].concat()
    }
}

/// Cards of one metre beside each other, lit by a lamp behind the camera. From the left: vertex colours; a texture that is scaled, turned and moved; two
/// sets of texture coordinates; unlit; a dielectric of high reflectance; two small instances; a skin; a morph target.
fn cards() -> Vec<u8> {
    let mut glb = Glb { json: json!({"asset": {"version": "2.0"}, "scene": 0}), ..Glb::default() };
    let positions = glb.floats("VEC3", &[-0.5, -0.5, 0., 0.5, -0.5, 0., 0.5, 0.5, 0., -0.5, 0.5, 0.]);
    let normals = glb.floats("VEC3", &[0., 0., 1.].repeat(4));
    let first = glb.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    let second = glb.floats("VEC2", &[0.1, 0.9, 0.4, 0.9, 0.4, 0.6, 0.1, 0.6]);
    let colors = glb.floats("VEC4", &[1., 0., 0., 1., 0., 1., 0., 1., 0., 0., 1., 1., 1., 1., 0., 0.]);
    let joints = glb.accessor(&[0; 16], 5121, "VEC4", 4);
    let weights = glb.floats("VEC4", &[1., 0., 0., 0.].repeat(4));
    let lift = glb.floats("VEC3", &[0., 0., 0., 0., 0., 0., 0., 0.3, 0., 0., 0.3, 0.]);
    let places = glb.floats("VEC3", &[0., -0.25, 0., 0., 0.25, 0.]);
    let sizes = glb.floats("VEC3", &[0.8, 0.4, 1., 0.4, 0.4, 1.]);
    let indices = glb.accessor(&[0u16, 1, 2, 0, 2, 3].map(u16::to_le_bytes).concat(), 5123, "SCALAR", 6);
    let texels = [[230, 40, 40, 255], [40, 200, 40, 255], [60, 60, 240, 255], [220, 220, 60, 255]].concat();
    let mut png = Cursor::new(Vec::new());
    image::RgbaImage::from_raw(2, 2, texels).unwrap().write_to(&mut png, image::ImageFormat::Png).unwrap();
    let view = glb.view(&png.into_inner());
    glb.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    glb.push("textures", json!({"source": 0}));
    let transform = json!({"scale": [1.5, 2.5], "rotation": 0.5, "offset": [0.3, 0.1]});
    let rough = |more: Value| {
        let mut pbr = json!({"metallicFactor": 0, "roughnessFactor": 1});
        more.as_object().unwrap().iter().for_each(|(key, value)| pbr[key] = value.clone());
        json!({"pbrMetallicRoughness": pbr})
    };
    let mut materials = vec![
        rough(json!({"baseColorFactor": [0.9, 0.9, 0.9, 1.0]})),
        rough(json!({"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": transform}}})),
        rough(json!({"baseColorTexture": {"index": 0, "texCoord": 1}, "metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 0.8})),
        rough(json!({"baseColorFactor": [0.9, 0.2, 0.1, 1.0]})),
        rough(json!({"baseColorFactor": [0.05, 0.05, 0.05, 1.0], "roughnessFactor": 0.6})),
        rough(json!({"baseColorFactor": [0.2, 0.6, 0.8, 1.0]})),
    ];
    (materials[0]["alphaMode"], materials[0]["alphaCutoff"]) = (json!("MASK"), json!(0.3));
    materials[3]["extensions"] = json!({"KHR_materials_unlit": {}});
    materials[4]["extensions"] = json!({"KHR_materials_ior": {"ior": 2.4}, "KHR_materials_specular": {"specularFactor": 0.9, "specularColorFactor": [1.0, 0.6, 0.2]}});
    glb.json["materials"] = json!(materials);
    let mut nodes = Vec::new();
    for card in 0..8usize {
        let mut attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": first});
        let mut node = json!({"translation": [card as f32 * 1.2 - 4.2, 0, 0]});
        match card {
            0 => attributes["COLOR_0"] = json!(colors),
            2 => attributes["TEXCOORD_1"] = json!(second),
            5 => node["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places, "SCALE": sizes}}}),
            6 => (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights)),
            _ => {}
        }
        let mut primitive = json!({"attributes": attributes, "indices": indices, "material": card.min(5)});
        if card == 7 {
            primitive["targets"] = json!([{"POSITION": lift}]);
            node["weights"] = json!([-1.0]);
        }
        node["mesh"] = json!(glb.push("meshes", json!({"primitives": [primitive]})));
        if card == 6 {
            // The joint stands where the card should be; the node of the mesh does not.
            let joint = glb.push("nodes", json!({"translation": node["translation"], "scale": [0.8, 0.5, 1.0]}));
            (node["translation"], node["skin"]) = (json!([0, 50, 0]), json!(0));
            glb.push("skins", json!({"joints": [joint]}));
            nodes.push(joint);
        }
        nodes.push(glb.push("nodes", node));
    }
    glb.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 60.0}]}});
    nodes.push(glb.push("nodes", json!({"camera": 0, "translation": [0, 0, 5]})));
    nodes.push(glb.push("nodes", json!({"translation": [0, 1, 6], "extensions": {"KHR_lights_punctual": {"light": 0}}})));
    glb.json["scenes"] = json!([{"nodes": nodes}]);
    let used = ["KHR_texture_transform", "EXT_mesh_gpu_instancing", "KHR_materials_unlit", "KHR_materials_ior", "KHR_materials_specular"];
    glb.json["extensionsRequired"] = json!(used);
    glb.json["extensionsUsed"] = json!([&used[..], &["KHR_lights_punctual"]].concat());
    glb.bytes()
}

fn traced(scene: &Scene) -> Image {
    let camera = scene.camera(None).unwrap();
    let settings = Settings { size: EXTENT, paths: LightPaths::Full { depth: 1 }, samples: 64, seed: 5 };
    let mut render = Tracing::new(scene, &camera, settings).unwrap();
    while render.done() < render.passes() {
        render.step();
    }
    Image { width: EXTENT[0] as usize, height: EXTENT[1] as usize, pixels: render.picture().pixels }
}

/// The largest difference of the means of each card, over the mean of the picture, and the mean absolute difference of pixels, over the same.
fn difference(left: &Image, right: &Image) -> (f64, f64) {
    let value = |image: &Image, pixel: usize, channel: usize| f64::from(image.pixels[pixel][channel]);
    let count = left.pixels.len() as f64 * 3.0;
    let mean = left.pixels.as_flattened().iter().map(|value| f64::from(*value)).sum::<f64>() / count;
    let (mut worst, mut total) = (0f64, 0.0);
    for card in 0..8 {
        for channel in 0..3 {
            let pixels: Vec<usize> = (0..left.pixels.len()).filter(|pixel| pixel % EXTENT[0] as usize / 16 == card).collect();
            let differences = pixels.iter().map(|pixel| value(left, *pixel, channel) - value(right, *pixel, channel));
            worst = worst.max(differences.clone().sum::<f64>().abs() / pixels.len() as f64 / mean);
            total += differences.map(f64::abs).sum::<f64>();
        }
    }
    (worst, total / count / mean)
}

#[test]
fn the_device_and_the_path_tracer_agree_about_every_card() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cards.glb");
    std::fs::write(&path, cards()).unwrap();
    let address = path.to_str().unwrap();
    let scene = Scene::load(address).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let traits = scene.traits();
    assert!(traits.unlit && traits.dielectric && traits.vertex_colors && traits.second_uvs && traits.texture_transforms);
    let shot = lobelia::Shot { extent: EXTENT, samples: 16, ..lobelia::Shot::default() };
    let render = Render { graph: "direct.ron", scene: address, variants: &[], set: &[], ndf: Ndf::Ggx, shot };
    let drawn = render.radiance("sum.radiance").unwrap();
    let truth = traced(&scene);
    for card in 0..8 {
        let mean = |image: &Image| {
            let pixels: Vec<usize> = (0..image.pixels.len()).filter(|pixel| pixel % EXTENT[0] as usize / 16 == card).collect();
            [0, 1, 2].map(|channel| pixels.iter().map(|pixel| image.pixels[*pixel][channel]).sum::<f32>() / pixels.len() as f32)
        };
        println!("card {card}: {:.4?} {:.4?}", mean(&truth), mean(&drawn));
    }
    let (card, pixel) = difference(&truth, &drawn);
    println!("cards differ by {card:.4}, pixels by {pixel:.4} of the mean");
    assert!(card < 0.02 && pixel < 0.03, "cards differ by {card:.4}, pixels by {pixel:.4} of the mean");
    // The bounds are no formality: a scene that lacks any one of these things is told apart.
    type Change<'a> = &'a dyn Fn(&mut Scene);
    let changes: [(&str, Change<'_>); 6] = [
        ("vertex colours", &|scene| Arc::make_mut(&mut scene.meshes)[0].colors = vec![Vec4::ONE; 4]),
        ("transform", &|scene| scene.materials[1].base_color_texture.as_mut().unwrap().uv_transform = glam::Affine2::IDENTITY),
        ("second set", &|scene| scene.materials[2].base_color_texture.as_mut().unwrap().uv_set = lobelia::scene::UvSet::First),
        ("unlit", &|scene| scene.materials[3].unlit = false),
        ("dielectric", &|scene| scene.materials[4].dielectric = lobelia::scene::Material::DIELECTRIC),
        ("second instance", &|scene| drop(scene.instances.remove(6))),
    ];
    for (name, change) in changes {
        let mut other = scene.clone();
        change(&mut other);
        let (card, pixel) = difference(&traced(&other), &drawn);
        println!("without {name}: cards {card:.4}, pixels {pixel:.4}");
        assert!(card > 0.02 || pixel > 0.03, "{name}: cards differ by {card:.4}, pixels by {pixel:.4} only");
    }
}
