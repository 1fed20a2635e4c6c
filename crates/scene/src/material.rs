//! Surfaces: how they reflect and emit, and the textures that say so.

use glam::Vec3;
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
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
