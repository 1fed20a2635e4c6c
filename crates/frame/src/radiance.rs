use lobelia_graph::{Part, PartSet, Resource, TexturePart, Values};
use wgpu::{TextureFormat, TextureUsages};

/// Size of an image that covers the camera's view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageShape {
    /// Width and height in pixels.
    pub extent: [u32; 2],
}

/// Radiance leaving the visible surface towards the camera, W/(sr m^2) per linear Rec. 709 channel; 0 where nothing is seen. Alpha is unused (1).
///
/// Half floats: relative precision 2^-11, largest value 65504; producers clamp to it. On the device the radiance is multiplied by
/// [`lobelia_scene::device::GpuScene::pre_exposure`], which is 1 for ordinary scenes and brings others into that range; what is read back through
/// [`lobelia_graph::Runner::read`] is without it.
#[derive(Clone, Debug)]
pub struct Radiance {
    /// `rgba16float`, one texel per pixel, row 0 at the top.
    pub image: TexturePart,
    /// Size.
    pub shape: ImageShape,
}

impl Radiance {
    /// Texel format.
    pub const FORMAT: TextureFormat = TextureFormat::Rgba16Float;
}

impl Resource for Radiance {
    const NAME: &'static str = "Radiance";
    const DOC: &'static str = "Radiance leaving the visible surface towards the camera, W/(sr m^2), linear Rec. 709; never negative.";
    type Shape = ImageShape;

    fn parts(shape: &ImageShape) -> Vec<Part> {
        let usage = TextureUsages::STORAGE_BINDING | TextureUsages::RENDER_ATTACHMENT;
        vec![Part::texture("image", Self::FORMAT, shape.extent, usage).values(Values::NonNegative).light(0b0111)]
    }

    fn assemble(shape: &ImageShape, parts: &PartSet) -> Self {
        Self { image: parts.texture("image"), shape: *shape }
    }
}

/// A picture ready for a display: tone-mapped and sRGB-encoded, 8 bits per channel, opaque.
#[derive(Clone, Debug)]
pub struct DisplayImage {
    /// `rgba8unorm` holding sRGB-encoded values, row 0 at the top.
    pub image: TexturePart,
    /// Size.
    pub shape: ImageShape,
}

impl DisplayImage {
    /// Texel format. Not an `-srgb` format: those cannot be written as storage, so the encoding is done in the shader.
    pub const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;
}

impl Resource for DisplayImage {
    const NAME: &'static str = "DisplayImage";
    const DOC: &'static str = "A tone-mapped picture, sRGB-encoded in 8 bits per channel.";
    type Shape = ImageShape;

    fn parts(shape: &ImageShape) -> Vec<Part> {
        vec![Part::texture("image", Self::FORMAT, shape.extent, TextureUsages::STORAGE_BINDING | TextureUsages::RENDER_ATTACHMENT)]
    }

    fn assemble(shape: &ImageShape, parts: &PartSet) -> Self {
        Self { image: parts.texture("image"), shape: *shape }
    }
}
