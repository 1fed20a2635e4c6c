//! Scenes: glTF files, RON scenes that wrap one, and scenes built in.
//!
//! Geometry is kept in world space in `f64` transforms; what goes to the device is *scene space*, world minus a whole-metre [`Scene::origin`], so
//! that 32-bit floats keep their precision ten kilometres from the world's origin. Conventions: right-handed, +Y up, metres, linear Rec. 709
//! colour, no photometric factors (a candela is a watt per steradian, per channel).
//!
//! An address given to [`Scene::load`] is `builtin:NAME` (see [`builtin_names`]), a `.glb` or `.gltf` file, or a RON scene, which wraps one of these:
//!
//! ```ron
//! (
//!     gltf: "atrium.glb",                          // beside this file, or "builtin:cornell-glossy"
//!     ndf: phong,                                  // ggx (default) or phong
//!     environment: (file: "sky.hdr", scale: 0.5),  // .hdr, .exr (a layer: "sky.exr#Sky"), or a picture, which has no range above 1
//!     cameras: {                                   // added, or replacing one of that name; the first is the default
//!         "close": (origin: (0, 1, 3), target: (0, 1, 0), up: (0, 1, 0), yfov: 0.7, near: 0.01),
//!     },
//!     keep_lights: false,                          // drops the file's lights, area lights with their surfaces
//!     lights: {                                    // added, or replacing one of that name; angles are radians
//!         "key": spot(position: (0, 2, 0), direction: (0, -1, 0), intensity: (9, 9, 9), inner: 0.3, outer: 0.6),
//!         "bulb": point(position: (1, 1, 1), intensity: (2, 2, 2)),
//!         "sun": directional(direction: (0, -1, -1), illuminance: (3, 3, 3)),
//!     },
//!     light_motion: {                              // key frames of any light of the scene, instead of the file's animation of it; seconds rise
//!         "key": [(seconds: 0, position: (0, 2, 0), direction: (0, -1, 0)), (seconds: 2, position: (1, 2, 0), direction: (1, -1, 0))],
//!         "bulb": [(seconds: 0.5, position: (1, 1, 1)), (seconds: 1, position: (1, 1, 2))],
//!     },
//!     camera_motion: {                             // key frames of any camera of the scene; origin and target go straight from key to key
//!         "close": [(seconds: 0, origin: (0, 1, 3), target: (0, 1, 0)), (seconds: 2, origin: (1, 1, 3), target: (0, 1, 0))],
//!     },
//!     materials: {                                 // in this order; "*" is every surface that is not an area light's
//!         "*": (specular: 0.0),
//!         "Gold": (roughness: 0.2, base_color: (1, 0.8, 0.3), metallic: 1, emissive: (0, 0, 0), normal_map: false),
//!     },
//! )
//! ```
//!
//! A glTF node with `extras.area_light` is a light with extent: `{"shape": "quad", "width", "height"}`, `{"shape": "disk", "radius"}` or
//! `{"shape": "sphere", "radius"}`, each with `"radiance": [r, g, b]`; quad and disk emit towards local -Z.
//!
//! Of a glTF file only what the scene draws is read; what nothing reaches may be broken or absent. Meshes may be compressed
//! (`KHR_draco_mesh_compression`, `EXT_meshopt_compression`), images may be PNG, JPEG, WebP or KTX2 of Basis Universal. A file that requires an extension
//! which is not read is refused, unless [`LoadOptions::allow_unsupported`] is set.
//!
//! Not drawn as the file says, with a word in [`Scene::warnings`]: blended surfaces (opaque here), occlusion textures, points and lines, ranges of
//! lights, and what the table in `docs/gltf.md` says of extensions. Numbers that are
//! out of range by rounding, up to 0.001, are clamped with a word too, and so are pixels of an environment that are no radiance.

mod animation;
mod builtin;
mod camera;
pub mod device;
mod environment;
mod error;
mod exposure;
mod gltf;
mod light;
mod material;
mod mesh;
mod motion;
mod ndf;
mod nodes;
mod pose;
mod seen;
mod sight;
mod tangents;
mod traits;
mod transport;
mod wrapper;

pub use builtin::builtin_names;
pub use camera::Camera;
pub use error::SceneError;
pub use light::{AreaLight, AreaShape, Environment, LightKind, PunctualLight, triangulate};
pub use material::{AlphaMode, MIN_ALPHA, Material, Sampler, Texture, TextureRef, UvSet, Wrap};
pub use mesh::{Mesh, Triangle};
pub use ndf::Ndf;
pub use sight::{Lookout, Sight};
pub use traits::{Bounds, CUBE_FACE_OUTER, CoarseLight, SceneTraits};
pub use transport::{LightClass, LightTransport};

use glam::{DMat4, DVec3};
use nodes::NodeTree;
use std::{collections::HashMap, sync::Arc};

/// Most triangles that all instances together may have, so that a small file with many instances cannot ask for unbounded memory.
const MAX_TRIANGLES: usize = 1 << 25;

/// Farthest that things may lie from each other, metres: beyond it 32-bit floats are too coarse for anything.
const MAX_REACH: f64 = 1e9;

/// A scene at one moment.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Where it came from.
    pub name: String,
    /// One per glTF primitive, shared by instances.
    pub meshes: Arc<Vec<Mesh>>,
    /// What is placed where.
    pub instances: Vec<Instance>,
    /// How surfaces reflect and emit.
    pub materials: Vec<Material>,
    /// Images that materials use.
    pub textures: Arc<Vec<Texture>>,
    /// Point, spot and directional lights.
    pub lights: Vec<PunctualLight>,
    /// Quad, disk and sphere lights. Their surfaces are also among the instances.
    pub area_lights: Vec<AreaLight>,
    /// Cameras; the first is the default.
    pub cameras: Vec<Camera>,
    /// Light from infinitely far.
    pub environment: Option<Environment>,
    /// Normal distribution function of every specular lobe.
    pub ndf: Ndf,
    /// What the file asked for that is not done, in words.
    pub warnings: Vec<String>,
    nodes: NodeTree,
    poses: pose::Poses,
    motions: Vec<motion::LightMotion>,
    camera_motions: Vec<motion::CameraMotion>,
    version: u64,
}

/// How a scene is loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadOptions {
    /// Go on, with a word in [`Scene::warnings`], where a glTF file requires an extension that is not read or samples an image that cannot be: the
    /// picture may be wrong then.
    pub allow_unsupported: bool,
}

/// A mesh in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// World from local coordinates; may mirror.
    pub world_from_local: DMat4,
    /// Name of the node.
    pub name: String,
    /// The area light whose surface this is.
    pub area_light: Option<usize>,
    pub(crate) node: Option<usize>,
    /// Coordinates of the node from local ones: where an instance of `EXT_mesh_gpu_instancing` is at its node.
    pub(crate) node_from_local: DMat4,
}

impl Scene {
    /// Loads `builtin:NAME`, a `.glb` or `.gltf` file, or a RON scene.
    pub fn load(address: &str) -> Result<Self, SceneError> {
        Self::load_with(address, &LoadOptions::default())
    }

    /// As [`Scene::load`], with options.
    pub fn load_with(address: &str, options: &LoadOptions) -> Result<Self, SceneError> {
        let mut scene = match address.strip_prefix("builtin:") {
            Some(name) => builtin::load(name)?,
            None => {
                let path = std::path::Path::new(address);
                let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
                match ending.as_str() {
                    "glb" | "gltf" => gltf::load(path, options)?,
                    "ron" => wrapper::load(path, options)?,
                    _ => return Err(SceneError::UnknownKind { file: address.into() }),
                }
            }
        };
        scene.name = address.to_owned();
        scene.check()?;
        Ok(scene)
    }

    /// What must hold however a scene was made.
    fn check(&self) -> Result<(), SceneError> {
        if self.instances.is_empty() {
            return Err(SceneError::Empty { file: self.name.clone() });
        }
        let triangles: usize = self.instances.iter().map(|instance| self.meshes[instance.mesh].indices.len() / 3).sum();
        if triangles > MAX_TRIANGLES {
            let what = format!("all instances together have {triangles} triangles; at most {MAX_TRIANGLES} are drawn");
            return Err(SceneError::content(&self.name, what));
        }
        let within_floats = |instance: &Instance| instance.world_from_local.to_cols_array().iter().all(|number| number.abs() < 1e30);
        if let Some(instance) = self.instances.iter().find(|instance| !within_floats(instance)) {
            return Err(SceneError::content(
                &self.name,
                format!("node `{}`: its transform is beyond the range of 32-bit floats", instance.name),
            ));
        }
        let bounds = self.bounds();
        if !bounds.is_finite() || (bounds.max - bounds.min).max_element() > MAX_REACH {
            let what = format!(
                "the scene reaches from {} to {}; positions must be finite and within {MAX_REACH:e} m of each other",
                bounds.min, bounds.max
            );
            return Err(SceneError::content(&self.name, what));
        }
        let lights = self.lights.iter().map(|light| ("light", &light.name, light.position));
        let cameras = self.cameras.iter().map(|camera| ("camera", &camera.name, camera.position));
        let ways = self.motions.iter().flat_map(|motion| motion.keys.iter().map(|key| ("light", &motion.light, key.position)));
        let ways = ways.filter_map(|(kind, name, position)| Some((kind, name, position?)));
        let views = self.camera_motions.iter().flat_map(|motion| motion.keys.iter().map(|key| ("camera", &motion.camera, key.origin)));
        let origin = self.origin();
        for (kind, name, position) in lights.chain(cameras).chain(ways).chain(views) {
            if !position.is_finite() || (position - origin).abs().max_element() > MAX_REACH {
                let what =
                    format!("{kind} `{name}` is at {position}; it must be within {MAX_REACH:e} m of the scene, which is at {origin}");
                return Err(SceneError::content(&self.name, what));
            }
        }
        Ok(())
    }

    /// Moves animated nodes to a time in seconds; before the start and after the end of an animation its first and last values hold. All
    /// animations of a file play at once.
    pub fn set_time(&mut self, seconds: f32) {
        let mut moved = false;
        if self.nodes.is_animated() {
            self.nodes.animate(seconds);
            moved = self.place_nodes();
            // A pose beyond the range of floats leaves the mesh as it was.
            moved |= self.pose().0;
        }
        moved |= self.move_lights(seconds);
        moved |= self.move_cameras(seconds);
        self.version += u64::from(moved);
    }

    /// Puts cameras where their key frames say; whether anything moved.
    fn move_cameras(&mut self, seconds: f32) -> bool {
        let mut moved = false;
        for motion in &self.camera_motions {
            for camera in self.cameras.iter_mut().filter(|camera| camera.name == motion.camera) {
                let before = (camera.position, camera.forward, camera.up);
                motion.place(camera, seconds);
                moved |= before != (camera.position, camera.forward, camera.up);
            }
        }
        moved
    }

    /// Puts lights where their key frames say; whether anything moved.
    fn move_lights(&mut self, seconds: f32) -> bool {
        let mut moved = false;
        for motion in &self.motions {
            let (position, direction) = motion.at(seconds);
            for light in self.lights.iter_mut().filter(|light| light.name == motion.light) {
                let (position, direction) = (position.unwrap_or(light.position), direction.unwrap_or(light.direction));
                moved |= (light.position, light.direction) != (position, direction);
                (light.position, light.direction) = (position, direction);
            }
        }
        moved
    }

    /// Puts instances, lights and cameras where their nodes are; whether anything moved.
    pub(crate) fn place_nodes(&mut self) -> bool {
        let world = self.nodes.world_matrices();
        // A spline may shoot to where floats end; what it moves then stays where it was.
        let of = |node: Option<usize>| node.and_then(|node| world.get(node)).copied().filter(|matrix| matrix.is_finite());
        let mut moved = false;
        for instance in &mut self.instances {
            if let Some(matrix) = of(instance.node).map(|matrix| matrix * instance.node_from_local) {
                moved |= instance.world_from_local != matrix;
                instance.world_from_local = matrix;
            }
        }
        for light in &mut self.lights {
            if let Some(matrix) = of(light.node) {
                let position = matrix.transform_point3(DVec3::ZERO);
                let direction = matrix.transform_vector3(DVec3::NEG_Z).try_normalize().unwrap_or(light.direction);
                moved |= (light.position, light.direction) != (position, direction);
                (light.position, light.direction) = (position, direction);
            }
        }
        for light in &mut self.area_lights {
            if let Some(matrix) = of(light.node) {
                moved |= light.world_from_local != matrix;
                light.world_from_local = matrix;
            }
        }
        for camera in &mut self.cameras {
            if let Some(matrix) = of(camera.node) {
                moved |= camera.place(matrix);
            }
        }
        moved
    }

    /// Poses meshes by their joints and morph targets; whether anything moved, and the mesh of a pose that is beyond the range of floats.
    pub(crate) fn pose(&mut self) -> (bool, Option<usize>) {
        let world = self.nodes.world_matrices();
        let nodes = &self.nodes;
        let (mut placed, mut failed) = (HashMap::new(), None);
        for posed in self.poses.update(&world, |node| nodes.weights_of(node)) {
            match posed {
                Ok(pose::Posed { index, mesh, world_from_local }) => {
                    Arc::make_mut(&mut self.meshes)[index] = mesh;
                    placed.insert(index, world_from_local);
                }
                Err(mesh) => failed = failed.or(Some(mesh)),
            }
        }
        if !placed.is_empty() {
            for instance in &mut self.instances {
                instance.world_from_local = placed.get(&instance.mesh).copied().flatten().unwrap_or(instance.world_from_local);
            }
        }
        (!placed.is_empty(), failed)
    }

    /// The meshes that joints or morph targets moved since `before`, the same scene at another time.
    pub(crate) fn moved_meshes(&self, before: &Scene) -> Vec<usize> {
        if Arc::ptr_eq(&self.meshes, &before.meshes) {
            return Vec::new();
        }
        let poses = self.poses.poses.iter().map(|pose| pose.mesh);
        poses.filter(|mesh| self.meshes.get(*mesh) != before.meshes.get(*mesh)).collect()
    }

    /// Takes all lights away, area lights with their surfaces. Emissive materials and the environment stay.
    pub(crate) fn drop_lights(&mut self) {
        self.lights.clear();
        self.area_lights.clear();
        self.instances.retain(|instance| instance.area_light.is_none());
    }

    /// A camera by name, or the first one. A scene without cameras gets one that sees everything, named `whole-scene`.
    pub fn camera(&self, name: Option<&str>) -> Result<Camera, SceneError> {
        let found = match name {
            Some(name) => self.cameras.iter().find(|camera| camera.name == name),
            None => self.cameras.iter().find(|camera| camera.unusable.is_none()),
        };
        match (found, name) {
            (Some(Camera { unusable: Some(reason), name, .. }), _) => {
                Err(SceneError::content(&self.name, format!("camera `{name}` cannot be used: {reason}")))
            }
            (Some(camera), _) => Ok(camera.clone()),
            (None, None | Some("whole-scene")) => Ok(self.whole_scene_camera()),
            (None, Some(name)) => {
                let known: Vec<&str> = self.cameras.iter().map(|camera| camera.name.as_str()).collect();
                Err(SceneError::UnknownName {
                    file: self.name.clone(),
                    what: "camera",
                    name: name.into(),
                    help: error::suggestion(name, &known),
                })
            }
        }
    }

    fn whole_scene_camera(&self) -> Camera {
        let bounds = self.bounds();
        let radius = (bounds.max - bounds.min).length().max(1e-6) / 2.0;
        let yfov: f64 = 0.7;
        let from = DVec3::new(0.55, 0.4, 1.0).normalize() * (radius / (yfov / 2.0).sin() * 0.95);
        let centre = bounds.centre();
        let near = self.usual_near();
        let camera = Camera::look_at("whole-scene", centre + from, centre, DVec3::Y, yfov, near);
        camera.unwrap_or_else(|| unreachable!("the view is neither zero nor vertical"))
    }

    /// Near plane where nobody gives one, metres: a thousandth of the scene's diagonal, at most 0.1 m, however small the scene is.
    pub(crate) fn usual_near(&self) -> f64 {
        (2.0 * self.bounds().radius() * 1e-3).clamp(1e-9, 0.1)
    }

    /// Bounds of all geometry in world space.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for instance in &self.instances {
            for position in &self.meshes[instance.mesh].positions {
                bounds.include(instance.world_from_local.transform_point3(position.as_dvec3()));
            }
        }
        bounds
    }

    /// Origin of scene space in the world: the centre of the scene at load, in whole metres. It does not move with animations.
    pub fn origin(&self) -> DVec3 {
        self.nodes.origin.unwrap_or_else(|| self.bounds().centre().round())
    }

    /// Fixes the origin, so that animations do not move it.
    pub(crate) fn fix_origin(&mut self) {
        self.nodes.origin = Some(self.bounds().centre().round());
    }

    /// All triangles in scene space, `f32`; the origin is taken away in `f64`. Corners run counter-clockwise seen from the front, in mirrored
    /// instances too.
    pub fn triangles(&self) -> Vec<Triangle> {
        let scene_from_world = DMat4::from_translation(-self.origin());
        let mut triangles = Vec::new();
        for (index, instance) in self.instances.iter().enumerate() {
            let matrix = scene_from_world * instance.world_from_local;
            let mesh = &self.meshes[instance.mesh];
            let at = |vertex: u32| matrix.transform_point3(mesh.positions[vertex as usize].as_dvec3()).as_vec3();
            let [second, third] = if matrix.determinant() < 0.0 { [2, 1] } else { [1, 2] };
            for corners in mesh.indices.chunks_exact(3) {
                let positions = [at(corners[0]), at(corners[second]), at(corners[third])];
                triangles.push(Triangle { positions, instance: index, material: mesh.material });
            }
        }
        triangles
    }

    /// Grows whenever [`Scene::set_time`] moved something.
    pub fn geometry_version(&self) -> u64 {
        self.version
    }

    /// The facts that passes ask.
    pub fn traits(&self) -> SceneTraits {
        traits::of(self)
    }

    pub(crate) fn animation_seconds(&self) -> f32 {
        let ends = self.motions.iter().map(motion::LightMotion::end).chain(self.camera_motions.iter().map(motion::CameraMotion::end));
        ends.fold(self.nodes.animation_seconds(), f32::max)
    }

    pub(crate) fn is_animated(&self) -> bool {
        self.nodes.is_animated() || !self.motions.is_empty() || !self.camera_motions.is_empty()
    }
}
