use crate::{ReflectiveShadowMapShape, reflective_shadow_map::tiles_for};
use lobelia_graph::{BuildError, ComputePipeline, Frame, Gpu, Part, PartSet, PortError, Resource, TexturePart, Values};
use lobelia_shaders::{Flags, Source};
use wgpu::{TextureFormat, TextureUsages};

/// Shape of a [`SamplingDensity`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SamplingDensityShape {
    /// Side of each face of the reflective shadow map in texels.
    pub resolution: u32,
    /// Faces of that map.
    pub faces: u32,
}

impl SamplingDensityShape {
    /// Side of the finest level: `resolution`, rounded up to a power of two.
    pub fn side(&self) -> u32 {
        self.resolution.max(1).next_power_of_two()
    }

    /// Number of levels; the last has one texel a face.
    pub fn levels(&self) -> u32 {
        self.side().ilog2() + 1
    }

    /// Faces along each side of a layer, as in the map.
    pub fn tiles(&self) -> u32 {
        tiles_for(self.faces)
    }

    /// Side of the finest level of a layer.
    pub fn layer_side(&self) -> u32 {
        self.side() * self.tiles()
    }

    /// Layers, as in the map.
    pub fn layers(&self) -> u32 {
        self.faces.max(1).div_ceil(self.tiles().pow(2))
    }

    /// Refuses a density of another map than the one that lights are picked from.
    pub fn check(&self, rsm: &ReflectiveShadowMapShape) -> Result<(), PortError> {
        if (self.resolution, self.faces) == (rsm.resolution, rsm.faces) {
            return Ok(());
        }
        let message = format!(
            "it is of {} faces of {} texels a side, not of the {} faces of {} of the map that lights are picked from",
            self.faces, self.resolution, rsm.faces, rsm.resolution
        );
        Err(PortError::at("density", message).help("connect both to the same reflective shadow map"))
    }
}

/// How likely each texel of a reflective shadow map is to become a virtual light: weights in proportion to probabilities, of any scale, with the sums
/// over 2 x 2 texels, 4 x 4 and so on up to whole faces, so that a sample is found by descending through them.
///
/// A weight must be positive wherever the texel reflects light that may count: a texel of weight 0 is never picked. The accessor is
/// `lobelia::sampling_density`; [`SamplingDensityLevels`] makes the sums.
#[derive(Clone, Debug)]
pub struct SamplingDensity {
    /// `r32float`, faces in the layers and tiles that they have in the map, with mip levels down to one texel a face. Level 0 is padded with zeros to a
    /// power of two. Weights are at most 1e28, so that no sum overflows.
    pub weights: TexturePart,
    /// Size.
    pub shape: SamplingDensityShape,
}

impl Resource for SamplingDensity {
    const NAME: &'static str = "SamplingDensity";
    const DOC: &'static str =
        "How likely each texel of a reflective shadow map is to become a virtual light: weights and the sums over blocks of texels.";
    type Shape = SamplingDensityShape;

    fn parts(shape: &SamplingDensityShape) -> Vec<Part> {
        let usage = TextureUsages::STORAGE_BINDING;
        let weights = Part::layered_texture("weights", TextureFormat::R32Float, [shape.layer_side(); 2], shape.layers(), usage);
        vec![weights.always_array().mips(shape.levels()).values(Values::NonNegative)]
    }

    fn assemble(shape: &SamplingDensityShape, parts: &PartSet) -> Self {
        Self { weights: parts.texture("weights"), shape: *shape }
    }
}

/// Makes the upper levels of a [`SamplingDensity`] from its finest one. Every pass that makes such a density keeps one.
pub struct SamplingDensityLevels {
    pipeline: ComputePipeline,
}

/// One group for each level above the finest, with its number of texels along each side of a layer.
pub struct SamplingDensityBindings {
    levels: Vec<(wgpu::BindGroup, u32)>,
    layers: u32,
}

impl SamplingDensityLevels {
    /// Creates the pipeline.
    pub fn new(gpu: &Gpu) -> Result<Self, BuildError> {
        let source = Source { path: "crates/frame/src/sampling_density.wgsl", text: include_str!("sampling_density.wgsl") };
        Ok(Self { pipeline: gpu.compute_pipeline("sampling density", source, "add_up", &Flags::default())? })
    }

    /// Binds the levels of an output.
    pub fn bind(&self, gpu: &Gpu, density: &SamplingDensity) -> Result<SamplingDensityBindings, BuildError> {
        let shape = density.shape;
        let level = |upper: u32| {
            let group = self
                .pipeline
                .bindings(0)
                .view("finer", &density.weights.mip_view(upper - 1))
                .view("coarser", &density.weights.mip_view(upper))
                .build(gpu)?;
            Ok::<_, BuildError>((group, shape.layer_side() >> upper))
        };
        Ok(SamplingDensityBindings { levels: (1..shape.levels()).map(level).collect::<Result<_, _>>()?, layers: shape.layers() })
    }

    /// Records the sums. The finest level must have been written.
    pub fn record(&self, frame: &mut Frame<'_>, bindings: &SamplingDensityBindings) {
        for (group, side) in &bindings.levels {
            frame.compute("add up weights", |pass| {
                pass.set_pipeline(self.pipeline.raw());
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(side.div_ceil(8), side.div_ceil(8), bindings.layers);
            });
        }
    }
}
