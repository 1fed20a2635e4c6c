use crate::gbuffer::{SurfaceFlags, surface_parts};
use encase::ShaderType;
use glam::{Mat4, Vec3};
use lobelia_graph::{BufferPart, Part, PartSet, Resource, TexturePart};
use wgpu::BufferUsages;

/// Shape of a [`ReflectiveShadowMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReflectiveShadowMapShape {
    /// Side of each square face in texels.
    pub resolution: u32,
    /// Number of faces of all lights together; at least 1.
    pub faces: u32,
    /// Optional parts. `emissive` is always off: emission does not reflect.
    pub flags: SurfaceFlags,
}

/// One face of a reflective shadow map, as WGSL sees it (`lobelia::reflective_shadow_map::RsmFace`).
#[derive(Clone, Copy, Debug, ShaderType)]
pub struct RsmFace {
    /// Clip space (x, y in [-1, 1], reverse Z) from scene space.
    pub clip_from_scene: Mat4,
    /// Light position (perspective) or centre of the near plane (orthographic), scene space, metres.
    pub position: Vec3,
    /// Near distance in metres, both projections.
    pub near: f32,
    /// Unit view direction.
    pub forward: Vec3,
    /// Perspective: 0. Orthographic: far distance minus near distance in metres.
    pub depth_range: f32,
    /// View right vector times the half width at distance 1 (perspective) or the half width in metres (orthographic).
    pub right: Vec3,
    /// Index of the light in the scene's light list.
    pub light: u32,
    /// As `right`, upwards.
    pub up: Vec3,
    /// First face of this light.
    pub first_face: u32,
    /// Faces of this light: 1, or 6 for a cube in the order +X -X +Y -Y +Z -Z.
    pub face_count: u32,
}

/// What each punctual light sees: an array of square faces, one for a directional or narrow spot light, six for a point or wide spot light.
///
/// Each texel is a small patch that reflects the flux `intensity * solid angle` (or `illuminance * area`) falling through it;
/// `lobelia::reflective_shadow_map` gives position, normals, material and that flux in watts.
/// Every light occupies as many layers as it has faces; the accessor finds the face of a direction, so the same resource is the shadow map of direct light.
#[derive(Clone, Debug)]
pub struct ReflectiveShadowMap {
    /// Reverse-Z depth, array of faces; 0 where nothing is seen.
    pub depth: TexturePart,
    /// See [`crate::SurfaceFormats::CORE`].
    pub core: TexturePart,
    /// If `SPECULAR`.
    pub specular: Option<TexturePart>,
    /// If `NORMAL_MAP`.
    pub geometric_normal: Option<TexturePart>,
    /// Storage array of [`RsmFace`], one per layer.
    pub faces: BufferPart,
    /// Size and options.
    pub shape: ReflectiveShadowMapShape,
}

impl Resource for ReflectiveShadowMap {
    const NAME: &'static str = "ReflectiveShadowMap";
    const DOC: &'static str =
        "What each punctual light sees: depth, normals, material and reflected flux (W) per texel; also its shadow map.";
    type Shape = ReflectiveShadowMapShape;

    fn parts(shape: &ReflectiveShadowMapShape) -> Vec<Part> {
        let flags = SurfaceFlags { emissive: false, ..shape.flags };
        let mut parts = surface_parts([shape.resolution; 2], shape.faces, flags, true);
        let bytes = RsmFace::min_size().get() * u64::from(shape.faces.max(1));
        parts.push(Part::buffer("faces", bytes, BufferUsages::STORAGE));
        parts
    }

    fn assemble(shape: &ReflectiveShadowMapShape, parts: &PartSet) -> Self {
        Self {
            depth: parts.texture("depth"),
            core: parts.texture("core"),
            specular: parts.find_texture("specular"),
            geometric_normal: parts.find_texture("geometric_normal"),
            faces: parts.buffer("faces"),
            shape: *shape,
        }
    }
}
