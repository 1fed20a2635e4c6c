use encase::ShaderType;
use glam::{UVec2, Vec3};
use lobelia_graph::{BufferPart, Part, PartSet, PortError, Resource, Values};
use wgpu::BufferUsages;

/// Shape of [`VirtualLights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VirtualLightsShape {
    /// Number of records; some may be dark (flux 0).
    pub count: u32,
    /// Whether records carry a specular lobe.
    pub specular: bool,
    /// Whether lights come with lobes ([`VirtualLightLobes`]).
    pub lobes: bool,
}

/// One virtual light, as WGSL sees it (`lobelia::virtual_lights::VirtualLight`): 64 bytes.
///
/// It reflects `flux` arriving from `direction_to_source` by the packed material at `position`; the radiant intensity towards a unit direction w is
/// `flux * brdf(direction_to_source, w) * max(geometric normal . w, 0)`, W/sr. Where a normal map turns the shading normal away, `flux` holds the ratio of
/// both normals' cosines to the source: light falls on the area that the geometric normal gives and is reflected with the shading normal's cosine.
#[derive(Clone, Copy, Debug, ShaderType)]
pub struct VirtualLight {
    /// Scene space, metres.
    pub position: Vec3,
    /// Radius in metres of the disk that the light stands for; 0 for a point.
    pub radius: f32,
    /// Flux falling on the patch that this light stands for, W per channel, divided by the sampling density, times the ratio above.
    pub flux: Vec3,
    /// Geometric normal, octahedral 2 x 16 bit, turned to the source.
    pub geometric_normal: u32,
    /// Unit direction from the light's position back to the source that lights it.
    pub direction_to_source: Vec3,
    /// Roughness, metallic, specular scale (`lobelia::surface` packing).
    pub specular: u32,
    /// Shading normal and base colour (`lobelia::surface` packing).
    pub core: UVec2,
    /// Index of the source light in the scene.
    pub source: u32,
}

/// The patch around a virtual light, with its reflected light as lobes, as WGSL sees it (`lobelia::virtual_lights::VirtualLightLobes`): 64 bytes, or 48 in a
/// scene without specular lobes, which has not the last three fields.
///
/// A disk of `radius` about `position`. Its radiant intensity towards a unit direction w is about
/// `diffuse / pi * max(normal . w, 0)` plus a spherical Gaussian about `lobe_axis` that integrates to `specular`, W/sr.
#[derive(Clone, Copy, Debug, ShaderType)]
pub struct VirtualLightLobes {
    /// Mean position, scene space, metres. Unlike that of the light it may lie off the surface.
    pub position: Vec3,
    /// Radius in metres of a uniform disk with the patch's variance of positions.
    pub radius: f32,
    /// Flux that is reflected diffusely, W.
    pub diffuse: Vec3,
    /// Mean geometric normal, octahedral 2 x 16 bit.
    pub normal: u32,
    /// Flux that the specular lobe reflects, W.
    pub specular: Vec3,
    /// Axis of that lobe, octahedral 2 x 16 bit.
    pub lobe_axis: u32,
    /// One minus the squared length of the mean normal: 0 where the patch is flat, 1 where its normals point everywhere.
    pub normal_one_minus_length_squared: f32,
    /// Sharpness of the specular lobe.
    pub lobe_sharpness: f32,
}

impl VirtualLightLobes {
    /// Bytes of a record.
    pub fn bytes(specular: bool) -> u64 {
        if specular { 64 } else { 48 }
    }
}

/// Virtual lights: patches of the scene that reflect light from the sources, so that gathering them gives one bounce of indirect light.
#[derive(Clone, Debug)]
pub struct VirtualLights {
    /// Storage array of [`VirtualLight`].
    pub lights: BufferPart,
    /// Storage array of [`VirtualLightLobes`], if the shape has them: the light is then a patch with an extent, and a pass that gathers may take it for that or
    /// for a point.
    pub lobes: Option<BufferPart>,
    /// Count and options.
    pub shape: VirtualLightsShape,
}

impl Resource for VirtualLights {
    const NAME: &'static str = "VirtualLights";
    const DOC: &'static str = "Patches of the scene that reflect light: position, normals, material, incident flux (W) and its direction.";
    type Shape = VirtualLightsShape;

    fn parts(shape: &VirtualLightsShape) -> Vec<Part> {
        let bytes = VirtualLight::min_size().get() * u64::from(shape.count.max(1));
        // Words: position 0-2, radius 3, flux 4-6, packed 7, direction 8-10, packed 11, core 12-13, source 14, padding 15.
        let lights = Part::buffer("lights", bytes, BufferUsages::STORAGE).values(Values::Records {
            stride: 16,
            mask: 0b0000_0111_0111_1111,
            non_negative: 0b0000_0000_0111_1000,
        });
        let lights = lights.light(0b0000_0000_0111_0000);
        if !shape.lobes {
            return vec![lights];
        }
        let bytes = VirtualLightLobes::bytes(shape.specular);
        // Words: position 0-2, radius 3, diffuse 4-6, packed 7; then specular 8-10, packed 11, spread 12, sharpness 13 or spread 8.
        let (mask, non_negative) =
            if shape.specular { (0b0011_0111_0111_1111, 0b0011_0111_0111_1000) } else { (0b0000_0001_0111_1111, 0b0000_0001_0111_1000) };
        let values = Values::Records { stride: (bytes / 4) as u32, mask, non_negative };
        let bytes = bytes * u64::from(shape.count.max(1));
        let flux = if shape.specular { 0b0000_0111_0111_0000 } else { 0b0000_0000_0111_0000 };
        vec![lights, Part::buffer("lobes", bytes, BufferUsages::STORAGE).values(values).light(flux)]
    }

    fn assemble(shape: &VirtualLightsShape, parts: &PartSet) -> Self {
        Self { lights: parts.buffer("lights"), lobes: parts.find_buffer("lobes"), shape: *shape }
    }
}

/// Shape of a [`LightVisibility`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightVisibilityShape {
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Number of virtual lights.
    pub lights: u32,
    /// Pixels are grouped in k x k blocks, in which pixel (x, y) knows only the lights i with `i mod k^2 = (x mod k) + k (y mod k)`; 1: every pixel knows every light.
    pub interleave: u32,
}

impl LightVisibilityShape {
    /// Most bytes that one buffer may have at the WebGPU baseline (storage binding size).
    pub const CHUNK_BYTES: u64 = lobelia_graph::MAX_STORAGE_BINDING;

    /// Most lights that one pixel knows.
    pub fn lights_per_pixel(&self) -> u32 {
        self.lights.div_ceil(self.interleave * self.interleave)
    }

    /// 32-bit words per pixel.
    pub fn words_per_pixel(&self) -> u32 {
        self.lights_per_pixel().div_ceil(32).max(1)
    }

    fn pixels(&self) -> u64 {
        u64::from(self.extent[0]) * u64::from(self.extent[1])
    }

    /// Words per pixel in each chunk but the last.
    pub fn words_per_chunk(&self) -> u32 {
        let most = Self::CHUNK_BYTES / 4 / self.pixels().max(1);
        u32::try_from(most).unwrap_or(u32::MAX).clamp(1, self.words_per_pixel())
    }

    /// Number of chunks.
    pub fn chunks(&self) -> u32 {
        self.words_per_pixel().div_ceil(self.words_per_chunk())
    }

    /// Words per pixel in chunk `index`.
    pub fn words_in_chunk(&self, index: u32) -> u32 {
        (self.words_per_pixel() - index * self.words_per_chunk()).min(self.words_per_chunk())
    }

    /// The words of each chunk in turn that a pass reads which gathers `words` words of lights a pixel; those of one chunk alone may be fewer than stored,
    /// where whole visibility is read with interleaving.
    pub fn gathered_words(&self, words: u32) -> Vec<std::ops::Range<u32>> {
        if self.chunks() == 1 {
            return std::iter::once(0..words).collect();
        }
        let first = |index: u32| index * self.words_per_chunk();
        (0..self.chunks()).map(|index| first(index)..first(index) + self.words_in_chunk(index)).collect()
    }

    /// What a pass that gathers `lights` lights at `extent` pixels with the given interleaving can read: visibility of the same lights, the same picture, and
    /// its own pattern, or any where the visibility is whole (interleave 1) and fits one chunk. Anything else is an error at port `visibility`.
    pub fn check_gathering(&self, extent: [u32; 2], lights: u32, interleave: u32) -> Result<(), PortError> {
        if self.extent != extent {
            let [w, h] = self.extent;
            return Err(PortError::at("visibility", format!("it is of a picture of {w} x {h} pixels, not {} x {}", extent[0], extent[1])));
        }
        if self.lights != lights {
            return Err(PortError::at("visibility", format!("it is of {} lights, not of the {lights} that are gathered", self.lights))
                .help("connect both to the same lights"));
        }
        if self.interleave != interleave && self.interleave != 1 {
            let message = format!("it is interleaved {0} x {0}, but lights are gathered {interleave} x {interleave}", self.interleave);
            let or_one = if interleave == 1 { "" } else { ", or to 1" };
            return Err(PortError::at("visibility", message).help(format!("set interleave of the visibility pass to {interleave}{or_one}")));
        }
        if self.interleave != interleave && self.chunks() > 1 {
            return Err(PortError::at("visibility", "it is too large to be read in another interleaving than its own")
                .help(format!("set interleave of the visibility pass to {interleave}")));
        }
        Ok(())
    }
}

const CHUNK_NAMES: [&str; 64] = [
    "chunk_0", "chunk_1", "chunk_2", "chunk_3", "chunk_4", "chunk_5", "chunk_6", "chunk_7", "chunk_8", "chunk_9", "chunk_10", "chunk_11",
    "chunk_12", "chunk_13", "chunk_14", "chunk_15", "chunk_16", "chunk_17", "chunk_18", "chunk_19", "chunk_20", "chunk_21", "chunk_22",
    "chunk_23", "chunk_24", "chunk_25", "chunk_26", "chunk_27", "chunk_28", "chunk_29", "chunk_30", "chunk_31", "chunk_32", "chunk_33",
    "chunk_34", "chunk_35", "chunk_36", "chunk_37", "chunk_38", "chunk_39", "chunk_40", "chunk_41", "chunk_42", "chunk_43", "chunk_44",
    "chunk_45", "chunk_46", "chunk_47", "chunk_48", "chunk_49", "chunk_50", "chunk_51", "chunk_52", "chunk_53", "chunk_54", "chunk_55",
    "chunk_56", "chunk_57", "chunk_58", "chunk_59", "chunk_60", "chunk_61", "chunk_62", "chunk_63",
];

/// Which virtual lights each pixel's surface sees: one bit per pixel and light, 1 = visible.
///
/// Bits are packed 32 to a word, light-major: word `w` of pixel `p` stands at `w * pixels + p` of its chunk, so neighbouring invocations read neighbouring
/// words. A chunk holds whole words of all pixels and fits a baseline storage binding; `lobelia::light_visibility` gives the addresses.
#[derive(Clone, Debug)]
pub struct LightVisibility {
    /// Storage arrays of `u32`.
    pub chunks: Vec<BufferPart>,
    /// Size.
    pub shape: LightVisibilityShape,
}

impl LightVisibility {
    /// Largest number of chunks: 8 GiB.
    pub const MAX_CHUNKS: u32 = CHUNK_NAMES.len() as u32;
}

impl Resource for LightVisibility {
    const NAME: &'static str = "LightVisibility";
    const DOC: &'static str = "One bit per pixel and virtual light: 1 where nothing stands between them.";
    type Shape = LightVisibilityShape;

    fn parts(shape: &LightVisibilityShape) -> Vec<Part> {
        CHUNK_NAMES
            .iter()
            .zip(0..shape.chunks())
            .map(|(name, index)| {
                let bytes = 4 * shape.pixels() * u64::from(shape.words_in_chunk(index));
                Part::buffer(name, bytes, BufferUsages::STORAGE)
            })
            .collect()
    }

    fn assemble(shape: &LightVisibilityShape, parts: &PartSet) -> Self {
        let chunks = CHUNK_NAMES.iter().map_while(|name| parts.find_buffer(name)).collect();
        Self { chunks, shape: *shape }
    }
}
