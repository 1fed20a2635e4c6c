use lobelia_graph::{Part, PartSet, PortError, Resource, TexturePart, Values};
use wgpu::{TextureFormat, TextureUsages};

/// Shape of [`AreaLightVisibility`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AreaLightVisibilityShape {
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Area lights of the scene.
    pub lights: u32,
}

impl AreaLightVisibilityShape {
    /// Most lights: WebGPU's default limit on layers.
    pub const MAX_LIGHTS: u32 = 256;

    /// Whether it fits a pass that lights a picture of this size.
    pub fn check(&self, extent: [u32; 2]) -> Result<(), PortError> {
        if self.extent == extent {
            return Ok(());
        }
        let ([width, height], [wanted_width, wanted_height]) = (self.extent, extent);
        let message = format!("visibility is of {width} x {height} pixels, but the G-buffer of {wanted_width} x {wanted_height}");
        Err(PortError::at("visibility", message))
    }
}

/// How much of every area light each pixel sees.
///
/// From 0 (nothing) to 1 (all): the share of the irradiance that the light would send to the surface if nothing stood in between. 1 where none would come. As a
/// factor on what a pass integrates over the whole light it is exact for diffuse surfaces, and takes the specular lobe to see the same share.
#[derive(Clone, Debug)]
pub struct AreaLightVisibility {
    /// `r32float`, an array with a layer for every area light of the scene, one texel per pixel.
    pub share: TexturePart,
    /// Size.
    pub shape: AreaLightVisibilityShape,
}

impl Resource for AreaLightVisibility {
    const NAME: &'static str = "AreaLightVisibility";
    const DOC: &'static str = "How much of every area light each pixel sees, 0 to 1: a share of irradiance.";
    type Shape = AreaLightVisibilityShape;

    fn parts(shape: &AreaLightVisibilityShape) -> Vec<Part> {
        let share =
            Part::layered_texture("share", TextureFormat::R32Float, shape.extent, shape.lights.max(1), TextureUsages::STORAGE_BINDING);
        vec![share.always_array().values(Values::NonNegative)]
    }

    fn assemble(shape: &AreaLightVisibilityShape, parts: &PartSet) -> Self {
        Self { share: parts.texture("share"), shape: *shape }
    }
}
