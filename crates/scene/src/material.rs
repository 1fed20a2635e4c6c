//! Surfaces: how they reflect and emit, and the textures that say so.

use glam::{Affine2, DVec2, Vec3, Vec4};
use std::fmt;

/// Smallest alpha (roughness squared) of a specular lobe; smaller roughness counts as this.
pub const MIN_ALPHA: f32 = 0.001;

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
    /// Whether back faces emit as well.
    pub emits_both_ways: bool,
    /// Scale of the specular lobe, [0, 1]. 1 in every glTF file; 0 makes a surface purely Lambertian, metals black.
    pub specular: f32,
    /// Reflectance of the dielectric part (what is not metallic) at normal incidence, xyz, and at grazing incidence, w; each in [0, 1]. 0.04 and 1
    /// unless the file gives an index of refraction or a specular factor.
    pub dielectric: Vec4,
    /// Whether it is drawn in its base colour whatever the light: it reflects nothing and lights nothing, but stands in the way of light.
    pub unlit: bool,
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
            emits_both_ways: false,
            specular: 1.0,
            dielectric: Material::DIELECTRIC,
            unlit: false,
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
    /// A dielectric of index of refraction 1.5: `((1.5 - 1) / (1.5 + 1))^2` at normal incidence.
    pub const DIELECTRIC: Vec4 = Vec4::new(0.04, 0.04, 0.04, 1.0);

    /// The textures that are read: base colour, metallic-roughness, normal, emission.
    pub fn textures(&self) -> [Option<TextureRef>; 4] {
        [self.base_color_texture, self.metallic_roughness_texture, self.normal_texture, self.emissive_texture]
    }

    /// Whether it lights other surfaces.
    pub fn emits(&self) -> bool {
        !self.unlit && self.emissive.max_element() > 0.0
    }

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
    /// Absent where the base-colour texture's alpha is below `cutoff`.
    Mask {
        /// In [0, 1], or [`AlphaMode::NOTHING_LEFT`]. A factor on alpha is already divided out.
        cutoff: f32,
    },
}

impl AlphaMode {
    /// A cutoff that no alpha reaches.
    pub const NOTHING_LEFT: f32 = 2.0;
}

/// A texture and how it is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
    pub texture: usize,
    /// Wrapping and filtering.
    pub sampler: Sampler,
    /// Which of the mesh's texture coordinates it is read at.
    pub uv_set: UvSet,
    /// From the mesh's texture coordinates to those of the image; finite. The identity unless the file moves, turns or scales the image.
    pub uv_transform: Affine2,
}

impl TextureRef {
    /// Where it is read for a vertex's (or an interpolated) texture coordinates of both sets.
    pub fn uv(&self, first: DVec2, second: DVec2) -> DVec2 {
        let uv = if self.uv_set == UvSet::Second { second } else { first };
        if self.uv_transform == Affine2::IDENTITY {
            return uv;
        }
        let [x, y, offset] = [self.uv_transform.matrix2.x_axis, self.uv_transform.matrix2.y_axis, self.uv_transform.translation];
        x.as_dvec2() * uv.x + y.as_dvec2() * uv.y + offset.as_dvec2()
    }
}

/// One of the two sets of texture coordinates that a mesh can have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum UvSet {
    /// [`crate::Mesh::uvs`].
    #[default]
    First,
    /// [`crate::Mesh::second_uvs`].
    Second,
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
