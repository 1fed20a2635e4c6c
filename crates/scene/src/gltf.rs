//! Reading glTF 2.0.
//!
//! The `gltf` crate holds the document of what is drawn; everything that touches bytes is checked here against what is really there before anything is
//! allocated, so that a hostile file ends in a message. Buffers and images are read when something asks for them.

mod accessor;
pub(crate) mod area_light;
mod compressed;
mod extensions;
mod image;
mod open;
mod primitive;
mod reach;
mod round;
mod tree;

use crate::{
    AlphaMode, Camera, Instance, LightKind, LoadOptions, Material, Mesh, PunctualLight, Sampler, Scene, SceneError, TextureRef, Wrap,
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
        primitives: HashMap::new(),
        meshes: Vec::new(),
        mesh_elements: 0,
        dropped: None,
    };
    warnings.into_iter().for_each(|warning| loader.warn(warning));
    if gltf.skins().any(|skin| skin.joints().len() > 0) {
        loader.warn("skins are ignored: meshes stand in their rest pose");
    }
    loader.materials(&gltf)?;
    let order = loader.nodes(&gltf)?;
    loader.animations(&gltf, &order)?;
    loader.contents(&gltf, &order)?;
    if let Some((count, at)) = loader.dropped.take() {
        loader.warn(format!("triangles without area are dropped: {count}, first in {at}"));
    }
    for warning in loader.images.warnings.split_off(0).into_iter().chain(loader.buffers.take_warnings()).chain(loader.buffers.unread()) {
        loader.warn(warning);
    }
    let Loader { mut scene, meshes, images, .. } = loader;
    scene.textures = Arc::new(images.textures);
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
    /// Mesh index of each glTF primitive that has been read; `None` for those that draw nothing.
    primitives: HashMap<(usize, usize), Option<usize>>,
    meshes: Vec<Mesh>,
    /// Vertices and triangles read so far.
    mesh_elements: usize,
    /// How many triangles had no area, and where the first was.
    dropped: Option<(usize, String)>,
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
        let [red, green, blue, opacity] = pbr.base_color_factor();
        let emissive = Vec3::from_array(material.emissive_factor()) * material.emissive_strength().unwrap_or(1.0);
        let read = Material {
            base_color: Vec3::new(red, green, blue),
            metallic: pbr.metallic_factor(),
            roughness: pbr.roughness_factor(),
            emissive,
            normal_scale: material.normal_texture().map_or(1.0, |texture| texture.scale()),
            base_color_texture: self.texture(&name, pbr.base_color_texture().map(|info| (info.texture(), info.tex_coord())))?,
            metallic_roughness_texture: self
                .texture(&name, pbr.metallic_roughness_texture().map(|info| (info.texture(), info.tex_coord())))?,
            normal_texture: self.texture(&name, material.normal_texture().map(|info| (info.texture(), info.tex_coord())))?,
            emissive_texture: self.texture(&name, material.emissive_texture().map(|info| (info.texture(), info.tex_coord())))?,
            alpha_mode: match material.alpha_mode() {
                gltf::material::AlphaMode::Opaque => AlphaMode::Opaque,
                gltf::material::AlphaMode::Mask => {
                    AlphaMode::Mask { cutoff: texture_cutoff(material.alpha_cutoff().unwrap_or(0.5), opacity) }
                }
                gltf::material::AlphaMode::Blend => {
                    self.warn("blended materials are drawn opaque");
                    AlphaMode::Opaque
                }
            },
            double_sided: material.double_sided(),
            name,
            ..Material::default()
        };
        if !(0.0..=1.0).contains(&opacity) {
            return Err(self.fail(format!("material `{}`: the alpha of its base colour is {opacity}, but must lie in [0, 1]", read.name)));
        }
        if let AlphaMode::Mask { cutoff } = read.alpha_mode
            && cutoff < 0.0
        {
            return Err(self.fail(format!("material `{}`: its alphaCutoff is negative", read.name)));
        }
        let numbers = [read.metallic, read.roughness, read.normal_scale]
            .into_iter()
            .chain(read.base_color.to_array())
            .chain(read.emissive.to_array());
        if numbers.clone().any(|number| !number.is_finite()) || read.emissive.min_element() < 0.0 {
            return Err(self.fail(format!("material `{}`: factors must be finite and emission not negative", read.name)));
        }
        let in_unit = |value: f32| (0.0..=1.0).contains(&value);
        if !read.base_color.to_array().into_iter().chain([read.metallic, read.roughness]).all(in_unit) {
            return Err(self.fail(format!("material `{}`: base colour, metallic and roughness must lie in [0, 1]", read.name)));
        }
        Ok(read)
    }

    /// A texture and its set of coordinates. One whose image cannot be read is an error, or none where unsupported files are allowed.
    fn texture(&mut self, material: &str, info: Option<(gltf::Texture<'_>, u32)>) -> Result<Option<TextureRef>, SceneError> {
        let Some((texture, set)) = info else { return Ok(None) };
        let image = match self.images.of_texture(&self.buffers, texture.index()) {
            Ok(image) => image,
            Err(message) if self.allow_unsupported => {
                self.warn(format!("{message}; material `{material}` goes without it"));
                return Ok(None);
            }
            Err(message) => return Err(self.fail(message)),
        };
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
        let sampler = Sampler { wrap_u: wrap(sampler.wrap_s()), wrap_v: wrap(sampler.wrap_t()), nearest };
        Ok(Some(TextureRef { texture: image, sampler }))
    }

    /// Meshes, lights and cameras that hang on nodes.
    fn contents(&mut self, gltf: &gltf::Gltf, order: &[usize]) -> Result<(), SceneError> {
        let all: Vec<gltf::Node<'_>> = gltf.nodes().collect();
        let moving = self.scene.nodes.moving();
        for (place, index) in order.iter().enumerate() {
            let node = &all[*index];
            let name = node.name().map_or_else(|| format!("node {index}"), str::to_owned);
            if let Some(mesh) = node.mesh() {
                self.mesh(&mesh, place, &name)?;
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
                self.scene.instances.push(Instance {
                    mesh,
                    world_from_local: DMat4::IDENTITY,
                    name: name.to_owned(),
                    area_light: None,
                    node: Some(node),
                });
            }
        }
        Ok(())
    }

    fn primitive(&mut self, mesh: &gltf::Mesh<'_>, primitive: &gltf::Primitive<'_>) -> Result<Option<usize>, SceneError> {
        let at = format!("mesh {}, primitive {}", mesh.index(), primitive.index());
        let material = primitive.material().index().unwrap_or(self.scene.materials.len() - 1);
        let needs_tangents = self.scene.materials[material].normal_texture.is_some();
        let read = primitive::read(&self.buffers, self.shown, &at, primitive, needs_tangents)?;
        for warning in read.warnings {
            self.warn(warning);
        }
        if read.dropped > 0 {
            self.dropped.get_or_insert((0, at.clone())).0 += read.dropped;
        }
        let Some(mut mesh) = read.mesh else { return Ok(None) };
        self.mesh_elements += mesh.positions.len() + mesh.indices.len() / 3;
        if self.mesh_elements > MAX_MESH_ELEMENTS {
            return Err(self.fail(format!("{at}: the meshes have more than {MAX_MESH_ELEMENTS} vertices and triangles")));
        }
        mesh.material = material;
        self.meshes.push(mesh);
        Ok(Some(self.meshes.len() - 1))
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

/// The cutoff for the texture's alpha alone: glTF compares its product with the factor's alpha. Above 1 nothing is left.
fn texture_cutoff(cutoff: f32, opacity: f32) -> f32 {
    if cutoff <= opacity { cutoff / opacity.max(f32::MIN_POSITIVE) } else { AlphaMode::NOTHING_LEFT }
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
