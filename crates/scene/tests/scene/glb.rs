//! Small glTF files made in memory.

use serde_json::{Value, json};
use std::path::PathBuf;
use tempfile::TempDir;

/// A glTF file under construction.
#[derive(Clone)]
pub struct Glb {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Glb {
    /// No node, no mesh.
    pub fn empty() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
            "buffers": [{"byteLength": 0}],
        });
        Self { json, bin: Vec::new() }
    }

    /// One node with the triangle (0,0,0), (1,0,0), (0,1,0), which has no normals and no material.
    pub fn triangle() -> Self {
        let mut glb = Self::empty();
        let positions = glb.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
        let mesh = glb.mesh(json!({"attributes": {"POSITION": positions}}));
        glb.node(json!({"name": "triangle", "mesh": mesh}));
        glb
    }

    /// One node with the unit square in XY that faces +Z, in a material; `uv` has v down.
    pub fn square(material: Value) -> Self {
        let mut glb = Self::empty();
        let positions = glb.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        let normals = glb.floats("VEC3", &[0., 0., 1.].repeat(4));
        let uvs = glb.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
        let indices = glb.shorts(&[0, 1, 2, 0, 2, 3]);
        glb.json["materials"] = json!([material]);
        let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs});
        let mesh = glb.mesh(json!({"attributes": attributes, "indices": indices, "material": 0}));
        glb.node(json!({"name": "square", "mesh": mesh}));
        glb
    }

    /// Adds to a top-level list and returns the index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Adds a node that is a root.
    pub fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(index));
        index
    }

    /// Adds a node that the caller hangs below another.
    pub fn child(&mut self, node: Value) -> usize {
        self.push("nodes", node)
    }

    pub fn mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    pub fn light(&mut self, light: Value) -> usize {
        self.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        if self.json["extensions"].is_null() {
            self.json["extensions"] = json!({"KHR_lights_punctual": {"lights": []}});
        }
        let lights = self.json["extensions"]["KHR_lights_punctual"]["lights"].as_array_mut().unwrap();
        lights.push(light);
        lights.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    pub fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].iter().position(|name| *name == kind).unwrap();
        let view = self.view(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
        let mut accessor = json!({"bufferView": view, "componentType": 5126, "count": numbers.len() / width, "type": kind});
        // Validation asks for the range of positions; that of NaN is nothing.
        let range = |fold: fn(f32, f32) -> f32, from: f32| -> Vec<f32> {
            (0..width)
                .map(|axis| numbers.iter().skip(axis).step_by(width).copied().fold(from, fold))
                .map(|x| x.clamp(-1e38, 1e38))
                .collect()
        };
        accessor["min"] = json!(range(f32::min, f32::INFINITY));
        accessor["max"] = json!(range(f32::max, f32::NEG_INFINITY));
        self.push("accessors", accessor)
    }

    pub fn shorts(&mut self, numbers: &[u16]) -> usize {
        let view = self.view(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
        self.push("accessors", json!({"bufferView": view, "componentType": 5123, "count": numbers.len(), "type": "SCALAR"}))
    }

    /// One row of four joints for each vertex.
    pub fn joints(&mut self, numbers: &[u8]) -> usize {
        let view = self.view(numbers);
        self.push("accessors", json!({"bufferView": view, "componentType": 5121, "count": numbers.len() / 4, "type": "VEC4"}))
    }

    /// Column-major matrices.
    pub fn matrices(&mut self, numbers: &[f32]) -> usize {
        let view = self.view(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
        self.push("accessors", json!({"bufferView": view, "componentType": 5126, "count": numbers.len() / 16, "type": "MAT4"}))
    }

    /// Sets an attribute of the first primitive.
    pub fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    /// An image with a texture and a sampler of its own; returns the texture.
    pub fn texture(&mut self, png: &[u8], sampler: Value) -> usize {
        let view = self.view(png);
        let image = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.push("samplers", sampler);
        self.push("textures", json!({"source": image, "sampler": sampler}))
    }

    /// Animates a node.
    pub fn animate(&mut self, node: usize, path: &str, interpolation: &str, times: &[f32], values: &[f32]) {
        let kind = match path {
            "rotation" => "VEC4",
            "weights" => "SCALAR",
            _ => "VEC3",
        };
        let (input, output) = (self.floats("SCALAR", times), self.floats(kind, values));
        self.push(
            "animations",
            json!({
                "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
                "channels": [{"sampler": 0, "target": {"node": node, "path": path}}],
            }),
        );
    }

    /// The file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if self.bin.is_empty() {
            json["buffers"] = json!([]);
        } else if json["buffers"][0]["byteLength"] == json!(0) {
            json["buffers"][0]["byteLength"] = json!(self.bin.len());
        }
        container(&serde_json::to_vec(&json).unwrap(), &self.bin)
    }

    /// Loads it, by way of a file.
    pub fn load(&self) -> Result<lobelia_scene::Scene, lobelia_scene::SceneError> {
        load(&self.bytes(), "scene.glb")
    }

    /// The message with which loading it fails.
    pub fn error(&self) -> String {
        message(self.load())
    }
}

/// JSON and binary chunk in a GLB container.
pub fn container(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    let length = |length: usize| u32::try_from(length).unwrap().to_le_bytes();
    bytes.extend(2u32.to_le_bytes());
    bytes.extend(length(12 + 8 + json.len() + if bin.is_empty() { 0 } else { 8 + bin.len() }));
    bytes.extend(length(json.len()));
    bytes.extend(b"JSON");
    bytes.extend(&json);
    if !bin.is_empty() {
        bytes.extend(length(bin.len()));
        bytes.extend(b"BIN\0");
        bytes.extend(&bin);
    }
    bytes
}

/// A folder with files in it.
pub fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

/// Loads bytes as a file of a name.
pub fn load(bytes: &[u8], name: &str) -> Result<lobelia_scene::Scene, lobelia_scene::SceneError> {
    load_in(&folder(&[(name, bytes)]), name)
}

/// Loads a file of a folder.
pub fn load_in(folder: &TempDir, name: &str) -> Result<lobelia_scene::Scene, lobelia_scene::SceneError> {
    lobelia_scene::Scene::load(folder.path().join(name).to_str().unwrap())
}

/// The message of a failure, which must start with the file; that is cut off.
pub fn message(result: Result<lobelia_scene::Scene, lobelia_scene::SceneError>) -> String {
    let text = result.expect_err("it should be refused").to_string();
    let (_, after) = text.split_once("/scene.").unwrap_or_else(|| panic!("no file in: {text}"));
    after.to_owned()
}

/// A PNG of RGBA texels.
pub fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, height, rgba.to_vec()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The large shared scenes, if they are here; says so if not.
pub fn shared_scenes() -> Option<PathBuf> {
    let root = std::env::var_os("LOBELIA_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared")), PathBuf::from);
    let scenes = root.join("scenes");
    if scenes.is_dir() {
        return Some(scenes);
    }
    eprintln!("skipped: {} is not there (LOBELIA_SHARED names another place)", scenes.display());
    None
}
