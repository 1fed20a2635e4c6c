//! Reading glTF 2.0.
//!
//! The `gltf` crate parses and validates the JSON; everything that touches bytes is checked here against what is really there before anything is
//! allocated, so that a hostile file ends in a message.

mod accessor;
pub(crate) mod area_light;
mod image;
mod primitive;

use crate::{
    AlphaMode, AreaLight, Camera, Instance, LightKind, Material, Mesh, PunctualLight, Sampler, Scene, SceneError, TextureRef, Wrap,
    animation::{Channel, Interpolation, Property},
    nodes::{Node, NodeTree, Transform},
};
use accessor::Buffers;
use base64::Engine;
use glam::{DMat4, DQuat, DVec3, DVec4, Vec3};
use gltf::khr_lights_punctual::Kind;
use std::{collections::HashMap, path::Path, sync::Arc};

/// Deepest node tree that is followed. Real files stay below a hundred.
const MAX_NODES: usize = 1_000_000;

/// Loads a `.glb` or `.gltf` file.
pub(crate) fn load(path: &Path) -> Result<Scene, SceneError> {
    let shown = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| SceneError::Unreadable { file: shown.clone(), reason: error.to_string() })?;
    parse(&bytes, &shown, path.parent())
}

/// Reads a file's bytes; `folder` is where its external files lie.
pub(crate) fn parse(bytes: &[u8], shown: &str, folder: Option<&Path>) -> Result<Scene, SceneError> {
    let fail = |message: String| SceneError::content(shown, message);
    let gltf = gltf::Gltf::from_slice(bytes).map_err(|error| fail(format!("not a valid glTF 2.0 file: {error}")))?;
    let buffers = Buffers::load(&gltf, shown, folder)?;
    let mut loader = Loader { shown, scene: Scene::default(), buffers, primitives: HashMap::new(), meshes: Vec::new() };
    loader.extensions(&gltf);
    loader.scene.textures = Arc::new(image::load(&gltf, &loader.buffers, shown, folder)?);
    loader.materials(&gltf)?;
    let order = loader.nodes(&gltf)?;
    loader.animations(&gltf, &order)?;
    loader.contents(&gltf, &order)?;
    let Loader { mut scene, meshes, .. } = loader;
    scene.meshes = Arc::new(meshes);
    scene.place_nodes();
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
        return base64::engine::general_purpose::STANDARD.decode(encoded).map_err(|error| format!("a data URI with broken base64: {error}"));
    }
    let name = percent_decoded(uri);
    let path = folder.unwrap_or(Path::new(".")).join(&name);
    std::fs::read(&path).map_err(|error| format!("{}: cannot be read: {error}", path.display()))
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
    /// Mesh index of each glTF primitive that has been read; `None` for those that draw nothing.
    primitives: HashMap<(usize, usize), Option<usize>>,
    meshes: Vec<Mesh>,
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

    fn extensions(&mut self, gltf: &gltf::Gltf) {
        let known = ["KHR_lights_punctual", "KHR_materials_emissive_strength"];
        let other: Vec<String> = gltf.extensions_used().filter(|name| !known.contains(name)).map(str::to_owned).collect();
        if !other.is_empty() {
            self.warn(format!("extensions {} are ignored", other.join(", ")));
        }
        if gltf.skins().len() > 0 {
            self.warn("skins are ignored: meshes stand in their rest pose");
        }
    }

    fn materials(&mut self, gltf: &gltf::Gltf) -> Result<(), SceneError> {
        for material in gltf.materials() {
            let read = self.material(&material)?;
            self.scene.materials.push(read);
        }
        // What primitives without a material get.
        self.scene.materials.push(Material { name: "default".into(), ..Material::default() });
        Ok(())
    }

    fn material(&mut self, material: &gltf::Material<'_>) -> Result<Material, SceneError> {
        let pbr = material.pbr_metallic_roughness();
        let name = material.name().map_or_else(|| format!("material {}", material.index().unwrap_or(0)), str::to_owned);
        let [red, green, blue, _] = pbr.base_color_factor();
        let emissive = Vec3::from_array(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        let read = Material {
            base_color: Vec3::new(red, green, blue),
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            emissive,
            normal_scale: material.normal_texture().map_or(1.0, |texture| texture.scale()),
            base_color_texture: pbr.base_color_texture().map(|info| self.texture(&name, &info.texture(), info.tex_coord())),
            metallic_roughness_texture: pbr.metallic_roughness_texture().map(|info| self.texture(&name, &info.texture(), info.tex_coord())),
            normal_texture: material.normal_texture().map(|info| self.texture(&name, &info.texture(), info.tex_coord())),
            emissive_texture: material.emissive_texture().map(|info| self.texture(&name, &info.texture(), info.tex_coord())),
            alpha_mode: match material.alpha_mode() {
                gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
                gltf::material::AlphaMode::Mask => AlphaMode::Mask { cutoff: material.alpha_cutoff().unwrap_or(0.5) },
                gltf::material::AlphaMode::Blend => {
                    self.warn("blended materials are drawn opaque");
                    AlphaMode::Opaque
                }
            },
            double_sided: material.double_sided(),
            name,
            ..Material::default()
        };
        let numbers = [read.metallic, read.roughness, read.normal_scale].into_iter().chain(read.base_color.to_array()).chain(read.emissive.to_array());
        if numbers.clone().any(|number| !number.is_finite()) || read.emissive.min_element() < 0.0 {
            return Err(self.fail(format!("material `{}`: factors must be finite and emission not negative", read.name)));
        }
        let in_unit = |value: f32| (0.0..=1.0).contains(&value);
        if !read.base_color.to_array().into_iter().chain([read.metallic, read.roughness]).all(in_unit) {
            return Err(self.fail(format!("material `{}`: base colour, metallic and roughness must lie in [0, 1]", read.name)));
        }
        Ok(read)
    }

    fn texture(&mut self, material: &str, texture: &gltf::Texture<'_>, set: u32) -> TextureRef {
        if set != 0 {
            self.warn(format!("material `{material}` reads texture coordinates {set}; set 0 is used"));
        }
        let wrap = |mode: gltf::texture::WrappingMode| match mode {
            gltf::texture::WrappingMode::Repeat => Wrap::Repeat,
            gltf::texture::WrappingMode::MirroredRepeat => Wrap::Mirror,
            gltf::texture::WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let sampler = texture.sampler();
        let nearest = sampler.mag_filter() == Some(gltf::texture::MagFilter::Nearest);
        TextureRef { texture: texture.source().index(), sampler: Sampler { wrap_u: wrap(sampler.wrap_s()), wrap_v: wrap(sampler.wrap_t()), nearest } }
    }

    /// Builds the node tree and returns the glTF index of each of its nodes, parents first.
    fn nodes(&mut self, gltf: &gltf::Gltf) -> Result<Vec<usize>, SceneError> {
        let count = gltf.nodes().len();
        if count > MAX_NODES {
            return Err(self.fail(format!("{count} nodes; at most {MAX_NODES} are read")));
        }
        let all: Vec<gltf::Node<'_>> = gltf.nodes().collect();
        let mut parents: Vec<Option<usize>> = vec![None; count];
        for node in &all {
            for child in node.children() {
                if let Some(other) = parents[child.index()].replace(node.index()) {
                    return Err(self.fail(format!(
                        "node {}: it is a child of node {other} and of node {}; nodes must form a tree",
                        child.index(),
                        node.index()
                    )));
                }
            }
        }
        self.refuse_cycles(&parents)?;
        let scene = gltf.default_scene().or_else(|| gltf.scenes().next());
        let roots: Vec<usize> = match &scene {
            Some(scene) => scene.nodes().map(|node| node.index()).collect(),
            None => (0..count).filter(|node| parents[*node].is_none()).collect(),
        };
        if let Some(root) = roots.iter().find(|root| parents[**root].is_some()) {
            return Err(self.fail(format!("node {root}: it is a root of the scene and a child of another node")));
        }
        let mut order = Vec::new();
        let mut tree = NodeTree::default();
        let mut open: Vec<(usize, Option<usize>)> = roots.into_iter().rev().map(|root| (root, None)).collect();
        let mut placed = vec![false; count];
        while let Some((index, parent)) = open.pop() {
            if std::mem::replace(&mut placed[index], true) {
                return Err(self.fail(format!("node {index}: it is listed twice as a root")));
            }
            let transform = self.transform(&all[index])?;
            let mut children: Vec<_> = all[index].children().map(|child| (child.index(), Some(order.len()))).collect();
            children.reverse();
            open.append(&mut children);
            order.push(index);
            tree.nodes.push(Node { parent, rest: transform, now: transform });
        }
        self.scene.nodes = tree;
        Ok(order)
    }

    fn refuse_cycles(&self, parents: &[Option<usize>]) -> Result<(), SceneError> {
        // 0 unseen, otherwise the walk in which a node was seen.
        let mut seen = vec![0usize; parents.len()];
        for start in 0..parents.len() {
            let walk = start + 1;
            let mut current = start;
            loop {
                if seen[current] == walk {
                    return Err(self.fail(format!("node {current}: it is its own ancestor; nodes must form a tree")));
                }
                if seen[current] != 0 {
                    break;
                }
                seen[current] = walk;
                match parents[current] {
                    Some(parent) => current = parent,
                    None => break,
                }
            }
        }
        Ok(())
    }

    fn transform(&self, node: &gltf::Node<'_>) -> Result<Transform, SceneError> {
        let transform = match node.transform() {
            gltf::scene::Transform::Matrix { matrix } => Transform::Matrix(DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))),
            gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
                let rotation = DQuat::from_array(rotation.map(f64::from));
                if rotation.length_squared() <= 0.0 {
                    return Err(self.fail(format!("node {}: its rotation is the zero quaternion", node.index())));
                }
                Transform::Parts {
                    translation: DVec3::from_array(translation.map(f64::from)),
                    rotation: rotation.normalize(),
                    scale: DVec3::from_array(scale.map(f64::from)),
                }
            }
        };
        if transform.matrix().is_finite() {
            Ok(transform)
        } else {
            Err(self.fail(format!("node {}: its transform has NaN or infinite numbers", node.index())))
        }
    }

    fn animations(&mut self, gltf: &gltf::Gltf, order: &[usize]) -> Result<(), SceneError> {
        let mut place: HashMap<usize, usize> = order.iter().enumerate().map(|(place, node)| (*node, place)).collect();
        place.shrink_to_fit();
        for animation in gltf.animations() {
            for (index, channel) in animation.channels().enumerate() {
                let Some(node) = place.get(&channel.target().node().index()) else { continue };
                let at = format!("animation {}, channel {index}", animation.index());
                if let Some(channel) = self.channel(&channel, *node, &at)? {
                    self.scene.nodes.channels.push(channel);
                }
            }
        }
        Ok(())
    }

    fn channel(&mut self, channel: &gltf::animation::Channel<'_>, node: usize, at: &str) -> Result<Option<Channel>, SceneError> {
        let property = match channel.target().property() {
            gltf::animation::Property::Translation => Property::Translation,
            gltf::animation::Property::Rotation => Property::Rotation,
            gltf::animation::Property::Scale => Property::Scale,
            gltf::animation::Property::MorphTargetWeights => {
                self.warn("morph targets are ignored");
                return Ok(None);
            }
        };
        if matches!(self.scene.nodes.nodes[node].rest, Transform::Matrix(_)) {
            return Err(self.fail(format!("{at}: it animates a node that has a matrix")));
        }
        let sampler = channel.sampler();
        let times = self.buffers.floats(self.shown, &sampler.input(), 1)?;
        let width = if property == Property::Rotation { 4 } else { 3 };
        let numbers = self.buffers.floats(self.shown, &sampler.output(), width)?;
        let interpolation = match sampler.interpolation() {
            gltf::animation::Interpolation::Step => Interpolation::Step,
            gltf::animation::Interpolation::Linear => Interpolation::Linear,
            gltf::animation::Interpolation::CubicSpline => Interpolation::CubicSpline,
        };
        let per_key = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if times.is_empty() || numbers.len() != times.len() * width * per_key {
            return Err(self.fail(format!("{at}: {} keys do not go with {} values", times.len(), numbers.len() / width)));
        }
        if times.iter().chain(&numbers).any(|number| !number.is_finite()) || times.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(self.fail(format!("{at}: key times must rise and all numbers be finite")));
        }
        let value = |numbers: &[f32]| DVec4::new(numbers[0].into(), numbers[1].into(), numbers[2].into(), numbers.get(3).map_or(0.0, |w| f64::from(*w)));
        let values = numbers.chunks_exact(width).map(value).collect();
        Ok(Some(Channel { node, property, interpolation, times, values }))
    }

    /// Meshes, lights and cameras that hang on nodes.
    fn contents(&mut self, gltf: &gltf::Gltf, order: &[usize]) -> Result<(), SceneError> {
        let all: Vec<gltf::Node<'_>> = gltf.nodes().collect();
        for (place, index) in order.iter().enumerate() {
            let node = &all[*index];
            let name = node.name().map_or_else(|| format!("node {index}"), str::to_owned);
            if let Some(mesh) = node.mesh() {
                self.mesh(&mesh, place, &name)?;
            }
            if let Some(light) = node.light() {
                self.light(&light, place, &name)?;
            }
            if let Some(camera) = node.camera() {
                self.camera(&camera, place, &name)?;
            }
            if let Some(extras) = node.extras().as_ref() {
                let light = area_light::parse(extras.get()).map_err(|message| self.fail(format!("node {index} (`{name}`): {message}")))?;
                if let Some((shape, radiance)) = light {
                    self.scene.area_lights.push(AreaLight { name, shape, world_from_local: DMat4::IDENTITY, radiance, node: Some(place) });
                }
            }
        }
        Ok(())
    }

    fn mesh(&mut self, mesh: &gltf::Mesh<'_>, node: usize, name: &str) -> Result<(), SceneError> {
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
            if let Some(mesh) = read {
                self.scene.instances.push(Instance { mesh, world_from_local: DMat4::IDENTITY, name: name.to_owned(), area_light: None, node: Some(node) });
            }
        }
        Ok(())
    }

    fn primitive(&mut self, mesh: &gltf::Mesh<'_>, primitive: &gltf::Primitive<'_>) -> Result<Option<usize>, SceneError> {
        let at = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
        let material = primitive.material().index().unwrap_or(self.scene.materials.len() - 1);
        let needs_tangents = self.scene.materials[material].normal_texture.is_some();
        let (read, warnings) = primitive::read(&self.buffers, self.shown, &at, primitive, needs_tangents)?;
        for warning in warnings {
            self.warn(warning);
        }
        let Some(mut mesh) = read else { return Ok(None) };
        mesh.material = material;
        self.meshes.push(mesh);
        Ok(Some(self.meshes.len() - 1))
    }

    fn light(&mut self, light: &gltf::khr_lights_punctual::Light<'_>, node: usize, name: &str) -> Result<(), SceneError> {
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
        let animated = self.scene.nodes.moves(node);
        let light = PunctualLight { name: name.to_owned(), kind, position: DVec3::ZERO, direction: DVec3::NEG_Z, intensity, animated, node: Some(node) };
        self.scene.lights.push(light);
        Ok(())
    }

    fn camera(&mut self, camera: &gltf::Camera<'_>, node: usize, name: &str) -> Result<(), SceneError> {
        let (yfov, near, unusable) = match camera.projection() {
            gltf::camera::Projection::Perspective(perspective) => (f64::from(perspective.yfov()), f64::from(perspective.znear()), None),
            gltf::camera::Projection::Orthographic(_) => (1.0, 0.01, Some("it is orthographic; only perspective cameras are supported".to_owned())),
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
        && !(inner >= 0.0 && inner <= outer && outer > 0.0 && outer <= std::f32::consts::FRAC_PI_2 + 1e-6)
    {
        return Err(format!("its cone angles are {inner} and {outer}, but 0 <= inner <= outer <= pi/2 must hold"));
    }
    Ok(())
}

