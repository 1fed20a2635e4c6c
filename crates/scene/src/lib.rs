//! Scenes: glTF files, RON scenes that wrap one, and scenes built in.
//!
//! Geometry is kept in world space in `f64` transforms; what goes to the device is *scene space*, world minus a whole-metre [`Scene::origin`], so
//! that 32-bit floats keep their precision ten kilometres from the world's origin. Conventions: right-handed, +Y up, metres, linear Rec. 709
//! colour, no photometric factors (a candela is a watt per steradian, per channel).

mod animation;
mod builtin;
pub mod device;
mod error;
mod gltf;
mod mesh;
mod nodes;
mod tangents;
mod traits;
mod wrapper;

pub use builtin::builtin_names;
pub use error::SceneError;
pub use mesh::{Mesh, Triangle};
pub use traits::{Bounds, CUBE_FACE_OUTER, SceneTraits};

use glam::{DMat4, DVec3, Vec3};
use nodes::NodeTree;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr, sync::Arc};

/// Smallest alpha (roughness squared) of a specular lobe; smaller roughness counts as this.
pub const MIN_ALPHA: f32 = 0.001;

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
    version: u64,
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
}

/// How a surface reflects and emits: the metallic-roughness model of glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Base colour, linear, each in [0, 1].
    pub base_color: Vec3,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// 0 smooth to 1 rough; alpha is its square.
    pub roughness: f32,
    /// Radiance leaving the front face, W/(sr m^2), strength included.
    pub emissive: Vec3,
    /// Scale of the specular lobe, [0, 1]. 1 in every glTF file; 0 makes a surface purely Lambertian, metals black.
    pub specular: f32,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Multiplies `base_color`; sRGB.
    pub base_color_texture: Option<TextureRef>,
    /// Green multiplies `roughness`, blue `metallic`; linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normals.
    pub normal_texture: Option<TextureRef>,
    /// Multiplies `emissive`; sRGB.
    pub emissive_texture: Option<TextureRef>,
    /// Opaque, or cut out where alpha is below a value.
    pub alpha_mode: AlphaMode,
    /// Whether the file calls it double-sided. Every surface reflects on both sides here.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::ONE,
            metallic: 1.0,
            roughness: 1.0,
            emissive: Vec3::ZERO,
            specular: 1.0,
            normal_scale: 1.0,
            base_color_texture: None,
            metallic_roughness_texture: None,
            normal_texture: None,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
        }
    }
}

impl Material {
    /// Alpha of its specular lobe where the texture is white.
    pub fn alpha(&self) -> f32 {
        (self.roughness * self.roughness).max(MIN_ALPHA)
    }
}

/// Treatment of transparency.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Fully opaque.
    #[default]
    Opaque,
    /// Absent where alpha is below `cutoff`.
    Mask {
        /// In [0, 1].
        cutoff: f32,
    },
}

/// A texture and how it is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureRef {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// Wrapping and filtering.
    pub sampler: Sampler,
}

/// Wrapping and filtering. There are no mipmaps: filtering is on the full-resolution level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Across u.
    pub wrap_u: Wrap,
    /// Across v.
    pub wrap_v: Wrap,
    /// Nearest instead of bilinear.
    pub nearest: bool,
}

/// What lies beyond a texture's edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The texture again.
    #[default]
    Repeat,
    /// Its mirror image.
    Mirror,
    /// Its edge.
    Clamp,
}

/// An image, 8 bits per channel, RGBA, row 0 at the top.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    /// Name or file.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// `4 width height` bytes.
    pub rgba: Vec<u8>,
}

impl fmt::Debug for Texture {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Texture({}, {} x {})", self.name, self.width, self.height)
    }
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// Name of the node or light.
    pub name: String,
    /// Point, spot or directional.
    pub kind: LightKind,
    /// World space, metres.
    pub position: DVec3,
    /// Unit; where its light travels (local -Z).
    pub direction: DVec3,
    /// Radiant intensity, W/sr (point, spot), or irradiance on a facing surface, W/m^2 (directional), per channel, colour included.
    pub intensity: Vec3,
    /// Whether an animation moves it.
    pub animated: bool,
    pub(crate) node: Option<usize>,
}

/// Kind of a [`PunctualLight`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// All directions alike.
    Point,
    /// A cone with a soft rim.
    Spot {
        /// Half angle of the full-intensity cone, radians.
        inner: f32,
        /// Half angle beyond which it is dark, radians.
        outer: f32,
    },
    /// Parallel rays.
    Directional,
}

/// A light with extent.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaLight {
    /// Name of the node.
    pub name: String,
    /// Shape in local coordinates.
    pub shape: AreaShape,
    /// World from local coordinates. Quad and disk lie in local XY and emit towards local -Z.
    pub world_from_local: DMat4,
    /// Radiance of its surface, W/(sr m^2).
    pub radiance: Vec3,
    pub(crate) node: Option<usize>,
}

/// Shape of an [`AreaLight`], metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaShape {
    /// Rectangle: width along local X, height along local Y.
    Quad {
        /// Metres.
        width: f32,
        /// Metres.
        height: f32,
    },
    /// Disk about the origin.
    Disk {
        /// Metres.
        radius: f32,
    },
    /// Sphere about the origin, emitting outwards.
    Sphere {
        /// Metres.
        radius: f32,
    },
}

/// A perspective camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name.
    pub name: String,
    /// World space, metres.
    pub position: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Unit.
    pub up: DVec3,
    /// Unit.
    pub right: DVec3,
    /// Full vertical angle of view, radians.
    pub yfov: f64,
    /// Near plane, metres.
    pub near: f64,
    /// What makes it unusable, if it is: orthographic cameras are kept so that choosing one gives a clear error.
    pub(crate) unusable: Option<String>,
    pub(crate) node: Option<usize>,
}

impl Camera {
    /// A camera that looks from `origin` to `target`. `None` where these coincide or `up` is parallel to the view.
    pub fn look_at(name: &str, origin: DVec3, target: DVec3, up: DVec3, yfov: f64, near: f64) -> Option<Self> {
        let forward = (target - origin).try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        Some(Self { name: name.into(), position: origin, forward, up: right.cross(forward), right, yfov, near, unusable: None, node: None })
    }

    pub(crate) fn place(&mut self, world_from_local: DMat4) {
        let axis = |local: DVec3, fallback: DVec3| world_from_local.transform_vector3(local).try_normalize().unwrap_or(fallback);
        self.position = world_from_local.transform_point3(DVec3::ZERO);
        self.forward = axis(DVec3::NEG_Z, DVec3::NEG_Z);
        let up = axis(DVec3::Y, DVec3::Y);
        // Scaled or sheared nodes would skew the view; the frame is made square about the view direction.
        self.right = self.forward.cross(up).try_normalize().unwrap_or(DVec3::X);
        self.up = self.right.cross(self.forward);
    }
}

/// Light from infinitely far, as an equirectangular map: pixel (u, v), v down, lies in direction
/// `(sin 2 pi u sin pi v, cos pi v, -cos 2 pi u sin pi v)`; the middle of the picture is +Z.
#[derive(Clone, PartialEq)]
pub struct Environment {
    /// File.
    pub name: String,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Linear radiance, row 0 at the top.
    pub pixels: Vec<Vec3>,
    /// Multiplies the pixels.
    pub scale: f32,
}

impl fmt::Debug for Environment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Environment({}, {} x {}, scale {})", self.name, self.width, self.height, self.scale)
    }
}

/// Normal distribution function of specular lobes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ndf {
    /// GGX (Trowbridge-Reitz).
    #[default]
    Ggx,
    /// Phong with exponent `2 / alpha^2 - 2`.
    Phong,
}

impl FromStr for Ndf {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "ggx" => Ok(Ndf::Ggx),
            "phong" => Ok(Ndf::Phong),
            _ => Err(format!("`{text}` is neither ggx nor phong")),
        }
    }
}

impl fmt::Display for Ndf {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Ndf::Ggx => "ggx",
            Ndf::Phong => "phong",
        })
    }
}

impl Scene {
    /// Loads `builtin:NAME`, a `.glb` or `.gltf` file, or a RON scene.
    pub fn load(address: &str) -> Result<Self, SceneError> {
        let mut scene = match address.strip_prefix("builtin:") {
            Some(name) => builtin::load(name)?,
            None => {
                let path = std::path::Path::new(address);
                let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
                match ending.as_str() {
                    "glb" | "gltf" => gltf::load(path)?,
                    "ron" => wrapper::load(path)?,
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
        let bounds = self.bounds();
        if !bounds.is_finite() || (bounds.max - bounds.min).max_element() > 1e9 {
            let what = format!("the scene reaches from {} to {}; positions must be finite and within 1e9 m of each other", bounds.min, bounds.max);
            return Err(SceneError::content(&self.name, what));
        }
        Ok(())
    }

    /// Moves animated nodes to a time in seconds; before the start and after the end of an animation its first and last values hold.
    pub fn set_time(&mut self, seconds: f32) {
        if !self.nodes.is_animated() {
            return;
        }
        self.nodes.animate(seconds);
        self.place_nodes();
        self.version += 1;
    }

    /// Puts instances, lights and cameras where their nodes are.
    pub(crate) fn place_nodes(&mut self) {
        let world = self.nodes.world_matrices();
        let of = |node: Option<usize>| node.and_then(|node| world.get(node)).copied();
        for instance in &mut self.instances {
            if let Some(matrix) = of(instance.node) {
                instance.world_from_local = matrix;
            }
        }
        for light in &mut self.lights {
            if let Some(matrix) = of(light.node) {
                light.position = matrix.transform_point3(DVec3::ZERO);
                light.direction = matrix.transform_vector3(DVec3::NEG_Z).try_normalize().unwrap_or(DVec3::NEG_Z);
            }
        }
        for light in &mut self.area_lights {
            if let Some(matrix) = of(light.node) {
                light.world_from_local = matrix;
            }
        }
        for camera in &mut self.cameras {
            if let Some(matrix) = of(camera.node) {
                camera.place(matrix);
            }
        }
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
                Err(SceneError::UnknownName { file: self.name.clone(), what: "camera", name: name.into(), help: error::suggestion(name, &known) })
            }
        }
    }

    fn whole_scene_camera(&self) -> Camera {
        let bounds = self.bounds();
        let radius = (bounds.max - bounds.min).length().max(1e-6) / 2.0;
        let yfov: f64 = 0.7;
        let from = DVec3::new(0.55, 0.4, 1.0).normalize() * (radius / (yfov / 2.0).sin() * 0.95);
        let centre = bounds.centre();
        let near = (radius * 1e-3).max(1e-6);
        let camera = Camera::look_at("whole-scene", centre + from, centre, DVec3::Y, yfov, near);
        camera.unwrap_or_else(|| unreachable!("the view is neither zero nor vertical"))
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

    /// All triangles in scene space, `f32`; the origin is taken away in `f64`.
    pub fn triangles(&self) -> Vec<Triangle> {
        let scene_from_world = DMat4::from_translation(-self.origin());
        let mut triangles = Vec::new();
        for (index, instance) in self.instances.iter().enumerate() {
            let matrix = scene_from_world * instance.world_from_local;
            let mesh = &self.meshes[instance.mesh];
            let at = |vertex: u32| matrix.transform_point3(mesh.positions[vertex as usize].as_dvec3()).as_vec3();
            for corners in mesh.indices.chunks_exact(3) {
                triangles.push(Triangle { positions: [at(corners[0]), at(corners[1]), at(corners[2])], instance: index, material: mesh.material });
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
        self.nodes.animation_seconds()
    }
}
