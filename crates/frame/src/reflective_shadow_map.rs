use crate::gbuffer::{SurfaceFlags, surface_parts};
use encase::ShaderType;
use glam::{Mat4, UVec2, Vec3, Vec4};
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

/// Most layers of a texture array at the WebGPU baseline.
pub const MAX_LAYERS: u32 = 256;

/// How many faces lie side by side in each layer, along each side: 1 as long as every face can have a layer of its own, else the smallest power of two with
/// which they all find a place. Faces fill a layer row by row.
pub fn tiles_for(faces: u32) -> u32 {
    let mut tiles: u32 = 1;
    while u64::from(tiles).pow(2) * u64::from(MAX_LAYERS) < u64::from(faces) {
        tiles *= 2;
    }
    tiles
}

impl ReflectiveShadowMapShape {
    /// Faces along each side of a layer, see [`tiles_for`].
    pub fn tiles(&self) -> u32 {
        tiles_for(self.faces)
    }

    /// Layers of the textures.
    pub fn layers(&self) -> u32 {
        self.faces.max(1).div_ceil(self.tiles().pow(2))
    }

    /// Layer of a face, and its first texel there.
    pub fn place(&self, face: u32) -> (u32, [u32; 2]) {
        let tiles = self.tiles();
        let (layer, tile) = (face / tiles.pow(2), face % tiles.pow(2));
        (layer, [tile % tiles, tile / tiles].map(|tile| tile * self.resolution))
    }
}

/// One face of a reflective shadow map, as WGSL sees it (`lobelia::reflective_shadow_map::RsmFace`).
#[derive(Clone, Copy, Debug, ShaderType)]
pub struct RsmFace {
    /// Clip space (x, y in [-1, 1], reverse Z) from scene space.
    pub clip_from_scene: Mat4,
    /// Light position (perspective) or centre of the near plane (orthographic), scene space, metres.
    pub position: Vec3,
    /// Near distance in metres. For orthographic views it is measured along `forward` from `position` and may be negative.
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
    /// Faces of this light: 1; 6 for a cube in the order +X -X +Y -Y +Z -Z; any number for a directional light whose faces lie in each other, the
    /// finest first.
    pub face_count: u32,
    /// Side in texels.
    pub resolution: u32,
    /// Layer of the textures.
    pub layer: u32,
    /// How likely a virtual light is placed here for the flux that is reflected, relative to the finest face of the same light.
    pub weight: f32,
    /// Texture coordinates of what a finer face of the same light covers: least x and y, greatest x and y. That flux is counted there. Empty if the
    /// greatest lie below the least.
    pub hole: Vec4,
    /// First texel in the layer.
    pub corner: UVec2,
    /// What rounding makes of positions in a scene of this size, metres.
    pub rounding: f32,
}

impl RsmFace {
    /// A [`RsmFace::hole`] that holds nothing.
    pub const NO_HOLE: Vec4 = Vec4::new(2.0, 2.0, -1.0, -1.0);
}

/// What each punctual light sees: an array of square faces, one for a narrow spot light, six for a point or wide spot light, one or more nested ones for a
/// directional light. Each has a layer of its own, or, where they are more than a texture has layers, a tile of one.
///
/// Each texel is a small patch that reflects the flux `intensity * solid angle` (or `illuminance * area`) falling through it;
/// `lobelia::reflective_shadow_map` gives position, normals, material and that flux in watts.
/// The faces of a light follow each other; the accessor finds the face of a direction, so the same resource is the shadow map of direct light.
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
    /// Storage array of [`RsmFace`].
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
        let mut parts = surface_parts([shape.resolution * shape.tiles(); 2], shape.layers(), flags, true);
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
