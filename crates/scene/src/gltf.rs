//! Reading glTF 2.0.
//!
//! The `gltf` crate holds the document of what is drawn; everything that touches bytes is checked here against what is really there before anything is
//! allocated, so that a hostile file ends in a message. Buffers and images are read when something asks for them.

mod accessor;
pub(crate) mod area_light;
mod compressed;
mod extensions;
mod image;
mod instancing;
mod material;
mod open;
mod primitive;
mod reach;
mod round;
mod skin;
mod specular_glossiness;
mod tree;

use crate::{
    Camera, Instance, LightKind, LoadOptions, Mesh, PunctualLight, Scene, SceneError,
    pose::{Pose, Poses, Rest, Skin},
};
use accessor::Buffers;
use base64::Engine;
use glam::{DMat4, DVec3, Vec3};
use gltf::khr_lights_punctual::Kind;
use image::Images;
use std::{collections::HashMap, path::Path, sync::Arc};

/// Most vertices and most triangles that all meshes together may have. A file can use the same numbers many times over, so its own size is no bound.
const MAX_MESH_ELEMENTS: usize = 1 << 24;

/// Most area lights: each brings a surface of its own.
const MAX_AREA_LIGHTS: usize = 4096;

/// Loads a `.glb` or `.gltf` file.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, SceneError> {
    let shown = path.display().to_string();
    let bytes = lobelia_files::read(path).map_err(|reason| SceneError::Unreadable { file: shown.clone(), reason })?;
    parse(&bytes, &shown, path.parent(), options)
}

/// Reads a file's bytes; `folder` is where its external files lie.
pub(crate) fn parse(bytes: &[u8], shown: &str, folder: Option<&Path>, options: &LoadOptions) -> Result<Scene, SceneError> {
    let open::Opened { gltf, blob, raw, warnings } = open::open(bytes, shown, options.allow_unsupported)?;
    let mut loader = Loader {
        shown,
        scene: Scene::default(),
        buffers: Buffers::new(raw, blob, folder),
        images: Images::new(folder),
        allow_unsupported: options.allow_unsupported,
        uv_sets: Vec::new(),
        primitives: HashMap::new(),
        meshes: Vec::new(),
        rests: Vec::new(),
        skins: Vec::new(),
        poses: Vec::new(),
        posed: HashMap::new(),
        mesh_elements: 0,
        dropped: None,
    };
    warnings.into_iter().for_each(|warning| loader.warn(warning));
    loader.materials(&gltf)?;
    let (order, in_scene) = loader.nodes(&gltf)?;
    let place: HashMap<usize, usize> = order.iter().enumerate().map(|(place, node)| (*node, place)).collect();
    loader.animations(&gltf, &place)?;
    loader.skins(&gltf, &place)?;
    loader.contents(&gltf, &order[..in_scene])?;
    if let Some((count, at)) = loader.dropped.take() {
        loader.warn(format!("triangles without area are dropped: {count}, first in {at}"));
    }
    for warning in loader.images.warnings.split_off(0).into_iter().chain(loader.buffers.take_warnings()).chain(loader.buffers.unread()) {
        loader.warn(warning);
    }
    let Loader { mut scene, meshes, rests, skins, poses, images, .. } = loader;
    scene.textures = Arc::new(images.textures);
    scene.meshes = Arc::new(meshes);
    if !poses.is_empty() {
        scene.poses = Poses { rests: Arc::new(rests), skins: Arc::new(skins), poses };
    }
    scene.place_nodes();
    if let (_, Some(mesh)) = scene.pose() {
        let name = scene.instances.iter().find(|instance| instance.mesh == mesh).map_or("", |instance| &instance.name);
        let what = format!("node `{name}`: its joints or morph targets put it beyond the range of 32-bit floats");
        return Err(SceneError::content(shown, what));
    }
    for index in 0..scene.area_lights.len() {
        area_light::add_surface(&mut scene, index);
    }
    scene.place_nodes();
    scene.fix_origin();
    Ok(scene)
}

/// Bytes behind a URI: `data:` or a file beside the glTF file.
fn read_uri(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, encoded) = data.split_once(";base64,").ok_or("a data URI without base64 data")?;
        return base64::engine::general_purpose::STANDARD
            .decode(encoded)
            .map_err(|error| format!("a data URI with broken base64: {error}"));
    }
    let folder = folder.unwrap_or(Path::new("."));
    let decoded = folder.join(percent_decoded(uri));
    // A name with a percent sign that nobody encoded.
    let path = if decoded.exists() { decoded } else { Some(folder.join(uri)).filter(|plain| plain.exists()).unwrap_or(decoded) };
    lobelia_files::read_raw(&path).map_err(|reason| format!("{}: {reason}", path.display()))
}

fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = tail.get(..2).and_then(|digits| std::str::from_utf8(digits).ok()).and_then(|digits| u8::from_str_radix(digits, 16).ok());
        match (first, code) {
            (b'%', Some(byte)) => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

struct Loader<'a> {
    shown: &'a str,
    scene: Scene,
    buffers: Buffers,
    images: Images,
    allow_unsupported: bool,
    /// Which texture coordinates each material reads.
    uv_sets: Vec<material::UvSets>,
    /// What each glTF primitive that has been read is.
    primitives: HashMap<(usize, usize), Known>,
    meshes: Vec<Mesh>,
    /// Meshes that joints or morph targets can move, and their posed copies.
    rests: Vec<Rest>,
    skins: Vec<Skin>,
    poses: Vec<Pose>,
    posed: HashMap<skin::PoseKey, usize>,
    /// Vertices and triangles read so far.
    mesh_elements: usize,
    /// How many triangles had no area, and where the first was.
    dropped: Option<(usize, String)>,
}

/// What a primitive is: nothing to draw, a mesh, or what posed copies are made of.
#[derive(Clone, Copy)]
enum Known {
    Nothing,
    Still(usize),
    Rest(usize),
}

impl Loader<'_> {
    fn fail(&self, message: impl Into<String>) -> SceneError {
        SceneError::content(self.shown, message)
    }

    fn warn(&mut self, message: impl Into<String>) {
        let message = message.into();
        if !self.scene.warnings.contains(&message) {
            self.scene.warnings.push(message);
        }
    }

    /// Meshes, lights and cameras that hang on nodes.
    fn contents(&mut self, gltf: &gltf::Gltf, order: &[usize]) -> Result<(), SceneError> {
        let all: Vec<gltf::Node<'_>> = gltf.nodes().collect();
        let moving = self.scene.nodes.moving();
        for (place, index) in order.iter().enumerate() {
            let node = &all[*index];
            let name = node.name().map_or_else(|| format!("node {index}"), str::to_owned);
            if let Some(mesh) = node.mesh() {
                self.mesh(gltf, node, &mesh, place, &name)?;
            }
            if let Some(light) = node.light() {
                self.light(&light, place, moving[place], &name)?;
            }
            if let Some(camera) = node.camera() {
                self.camera(&camera, place, &name)?;
            }
            if let Some(extras) = node.extras().as_ref() {
                let light = area_light::parse(extras.get(), &name, place);
                if let Some(light) = light.map_err(|message| self.fail(format!("node {index} (`{name}`): {message}")))? {
                    if self.scene.area_lights.len() == MAX_AREA_LIGHTS {
                        return Err(self.fail(format!("it has more than {MAX_AREA_LIGHTS} area lights")));
                    }
                    self.scene.area_lights.push(light);
                }
            }
        }
        Ok(())
    }

    /// Places a node's mesh, for its skin, its weights and its instances.
    fn mesh(
        &mut self,
        gltf: &gltf::Gltf,
        at_node: &gltf::Node<'_>,
        mesh: &gltf::Mesh<'_>,
        node: usize,
        name: &str,
    ) -> Result<(), SceneError> {
        let places = self.instances(gltf, at_node)?;
        let skin = at_node.skin().map(|skin| skin.index());
        let weights = at_node.weights().or_else(|| mesh.weights()).unwrap_or_default();
        for primitive in mesh.primitives() {
            let key = (mesh.index(), primitive.index());
            let read = match self.primitives.get(&key) {
                Some(known) => *known,
                None => {
                    let read = self.primitive(mesh, &primitive)?;
                    self.primitives.insert(key, read);
                    read
                }
            };
            let at = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
            let (mesh, skinned) = match read {
                Known::Nothing => continue,
                Known::Still(mesh) => (mesh, false),
                Known::Rest(rest) => {
                    let skinned = skin.is_some() && self.rests[rest].influences.is_some();
                    (self.posed_mesh(rest, node, skin, weights, &at)?, skinned)
                }
            };
            if skin.is_some() && !skinned {
                self.warn(format!("{at}: it has a skin, but no joints and weights, and stays at its node"));
            }
            for node_from_local in &places {
                self.scene.instances.push(Instance {
                    mesh,
                    world_from_local: DMat4::IDENTITY,
                    name: name.to_owned(),
                    area_light: None,
                    // Joints put it into the world, not its node.
                    node: (!skinned).then_some(node),
                    node_from_local: *node_from_local,
                });
            }
        }
        Ok(())
    }

    fn primitive(&mut self, mesh: &gltf::Mesh<'_>, primitive: &gltf::Primitive<'_>) -> Result<Known, SceneError> {
        let at = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
        let index = primitive.material().index().unwrap_or(self.scene.materials.len() - 1);
        let material = &self.scene.materials[index];
        let reading = primitive::Reading {
            uv_sets: self.uv_sets[index],
            textured: material.textures().iter().any(Option::is_some),
            normal_map: material.normal_texture.as_ref(),
        };
        let read = primitive::read(&self.buffers, self.shown, &at, primitive, &reading)?;
        for warning in read.warnings {
            self.warn(warning);
        }
        if read.dropped > 0 {
            self.dropped.get_or_insert((0, at.clone())).0 += read.dropped;
        }
        let Some(mut rest) = read.rest else { return Ok(Known::Nothing) };
        self.mesh_elements += rest.size();
        if self.mesh_elements > MAX_MESH_ELEMENTS {
            return Err(self.fail(format!("{at}: the meshes have more than {MAX_MESH_ELEMENTS} vertices and triangles")));
        }
        rest.mesh.material = index;
        if rest.can_move() {
            self.rests.push(rest);
            Ok(Known::Rest(self.rests.len() - 1))
        } else {
            self.meshes.push(rest.mesh);
            Ok(Known::Still(self.meshes.len() - 1))
        }
    }

    fn light(&mut self, light: &gltf::khr_lights_punctual::Light<'_>, node: usize, animated: bool, name: &str) -> Result<(), SceneError> {
        let kind = match light.kind() {
            Kind::Point => LightKind::Point,
            Kind::Directional => LightKind::Directional,
            Kind::Spot { inner_cone_angle, outer_cone_angle } => LightKind::Spot { inner: inner_cone_angle, outer: outer_cone_angle },
        };
        if light.range().is_some() {
            self.warn("ranges of lights are ignored: intensity falls with the square of the distance, without end");
        }
        let intensity = Vec3::from_array(light.color()) * light.intensity();
        check_light(kind, intensity).map_err(|message| self.fail(format!("light `{name}`: {message}")))?;
        let light = PunctualLight {
            name: name.to_owned(),
            kind,
            position: DVec3::ZERO,
            direction: DVec3::NEG_Z,
            intensity,
            animated,
            node: Some(node),
        };
        self.scene.lights.push(light);
        Ok(())
    }

    fn camera(&mut self, camera: &gltf::Camera<'_>, node: usize, name: &str) -> Result<(), SceneError> {
        let (yfov, near, unusable) = match camera.projection() {
            gltf::camera::Projection::Perspective(perspective) => (f64::from(perspective.yfov()), f64::from(perspective.znear()), None),
            gltf::camera::Projection::Orthographic(_) => {
                (1.0, 1.0, Some("it is orthographic; only perspective cameras are supported".to_owned()))
            }
        };
        let unusable = unusable.or_else(|| {
            let fine = yfov > 1e-4 && yfov < std::f64::consts::PI - 1e-4 && near > 0.0 && near.is_finite();
            (!fine).then(|| format!("yfov is {yfov} and znear {near}; yfov must lie in (0, pi) and znear be positive"))
        });
        if let Some(reason) = &unusable {
            self.warn(format!("camera `{name}` cannot be used: {reason}"));
        }
        let (position, forward, up, right) = (DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, DVec3::X);
        self.scene.cameras.push(Camera { name: name.to_owned(), position, forward, up, right, yfov, near, unusable, node: Some(node) });
        Ok(())
    }
}

/// What must hold of any punctual light, wherever it is written.
pub(crate) fn check_light(kind: LightKind, intensity: Vec3) -> Result<(), String> {
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        return Err(format!("its intensity is {intensity}, but must be finite and not negative"));
    }
    if let LightKind::Spot { inner, outer } = kind
        && !(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= std::f32::consts::FRAC_PI_2)
    {
        return Err(format!("its cone angles are {inner} and {outer}, but 0 <= inner <= outer <= pi/2 must hold"));
    }
    Ok(())
}
