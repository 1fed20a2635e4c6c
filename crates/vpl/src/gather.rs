//! The `vpl-gather` pass.

use lobelia_frame::{GBuffer, GatheredSums, ImageShape, LightClass, LightTransport, LightVisibility, Radiance, SceneWorld, VirtualLights};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OrNone, OutputShapes, ParamValue, Params,
    Pass, PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Adds up what virtual point lights send to every pixel.
pub struct VplGatherPass {
    gather: ComputePipeline,
    resolve: ComputePipeline,
    settings: wgpu::Buffer,
    sums: GatheredSums,
    extent: [u32; 2],
    interleave: u32,
    words: u32,
    rate: WorkRate,
}

/// Parameters of `vpl-gather`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct VplGatherParams {
    /// Upper bound of the geometry term `cos cos / d^2` of each light, or `none`, in the unit that `clamp_unit` names. A light nearer than `1/sqrt(clamp)`
    /// lengths adds less than it should: no bright spots, but dark corners. A scene that is k times as large looks the same. `none` is unbiased; a pixel upon a light stays finite all the same, since distances
    /// below 1e-5 of the size of what is seen count as that.
    #[param(range = 0.0..)]
    pub clamp: OrNone<f32>,
    /// The length that `clamp` is one over the square of.
    pub clamp_unit: ClampUnit,
    /// Side k of the blocks in which each pixel gathers one k^2-th of the lights. A joint tent filter 2k - 1 pixels wide, which stops at edges of normal and
    /// depth, then brings the lights of the block together; detail smaller than that is blurred. 1 gathers every light at every pixel.
    #[param(unit = "pixels", range = 1..=8)]
    pub interleave: u32,
}

impl Default for VplGatherParams {
    fn default() -> Self {
        Self { clamp: OrNone::Value(DEFAULT_CLAMP), clamp_unit: ClampUnit::Size, interleave: 1 }
    }
}

/// Bound of the geometry term by default, over the square of the size of what is seen: 69 per square metre in the glossy box, 19 in a living room, 2.4 in an
/// atrium, 40 million for things of a millimetre.
const DEFAULT_CLAMP: f32 = 40.0;

/// The length that the bound of the geometry term is told in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClampUnit {
    /// How large what the scene's cameras see is: half of the nearer half of it lies within one such length of its middle. A scene that is k times as large
    /// looks the same.
    #[default]
    Size,
    /// The metre.
    Metre,
}

impl ParamValue for ClampUnit {
    fn kind() -> String {
        "size or metre".into()
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What the camera sees.
    pub gbuffer: GBuffer,
    /// The lights.
    pub lights: VirtualLights,
    /// Which of them each pixel sees; without it, all.
    pub visibility: Option<LightVisibility>,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Light that scattered exactly twice: one bounce of indirect light.
    pub radiance: Radiance,
}

/// A run of visibility words in one buffer, with the uniform that names it.
struct Chunk {
    words: std::ops::Range<u32>,
    range: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Groups and workgroups.
pub struct Bindings {
    chunks: Vec<Chunk>,
    resolve: wgpu::BindGroup,
    gather_workgroups: [u32; 2],
    resolve_workgroups: [u32; 2],
}

/// Least distance to a light, as a fraction of the size of what is seen: keeps a pixel on a light finite with the clamp off.
const LEAST_DISTANCE: f64 = 1e-5;

impl Pass for VplGatherPass {
    const NAME: &'static str = "vpl-gather";
    const DOC: &'static str = "Gathers virtual point lights at every pixel: one bounce of indirect light.\n\
        Keller 1997. The full glTF reflectance at both ends; an unbiased estimate of light that scatters exactly twice when `clamp` is none. \
        Distances below 1e-5 of the size of what is seen count as that.";
    type World = SceneWorld;
    type Params = VplGatherParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &VplGatherParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn claim(_: &VplGatherParams, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
        Some(LightTransport::of(LightClass::Punctual, [2]))
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let flags = inputs.gbuffer.flags;
        let mut found = flags.reflectance(context.traits.ndf);
        let visibility = inputs.visibility.is_some();
        found.push(Specialisation::new(
            "VISIBILITY",
            visibility,
            if visibility { "visibility is connected" } else { "no visibility is connected" },
        ));
        let k = context.params.interleave;
        found.push(Specialisation::new("INTERLEAVED", k > 1, format!("interleave is {k}")));
        found
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let extent = inputs.gbuffer.extent;
        if let Some(visibility) = &inputs.visibility {
            visibility.check_gathering(extent, inputs.lights.count, context.params.interleave)?;
        }
        Ok(OutputsShapes { radiance: ImageShape { extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/vpl/src/gather.wgsl", text: include_str!("gather.wgsl") };
        let pipeline = |entry: &str| context.gpu.compute_pipeline(context.name, source, entry, context.flags);
        let buffer = |label: &str, bytes: u64, usage: wgpu::BufferUsages| {
            context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let (extent, interleave) = (context.inputs.gbuffer.extent, context.params.interleave);
        let count = context.inputs.lights.count;
        let settings = buffer("gather settings", 32, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        let visibility_interleaved = context.inputs.visibility.is_some_and(|visibility| visibility.interleave == interleave);
        let least = (LEAST_DISTANCE * context.world.seen_size()).powi(2).clamp(1e-20, 1e20) as f32;
        // The largest float stands for "no bound".
        let per_square_metre = match context.params.clamp_unit {
            ClampUnit::Size => context.world.seen_size().powi(-2),
            ClampUnit::Metre => 1.0,
        };
        let bound = |clamp: f32| (f64::from(clamp) * per_square_metre).min(f64::from(f32::MAX)) as f32;
        let clamp = context.params.clamp.value().map_or(f32::MAX, bound);
        let words = [count, interleave, u32::from(visibility_interleaved), clamp.to_bits(), least.to_bits(), 0, 0, 0];
        context.gpu.queue().write_buffer(&settings, 0, bytemuck::cast_slice(&words));
        let sums = GatheredSums::new(context.gpu, extent);
        Ok(Self {
            gather: pipeline("gather")?,
            resolve: pipeline("resolve")?,
            settings,
            sums,
            extent,
            interleave,
            words: count.div_ceil(interleave * interleave).div_ceil(32),
            rate: WorkRate::default(),
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let gbuffer = &inputs.gbuffer;
        let group = |pipeline: &ComputePipeline, range: &wgpu::Buffer, visibility| {
            pipeline
                .bindings(0)
                .raw_buffer("view", &context.world.view)
                .raw_buffer("settings", &self.settings)
                .raw_buffer("range", range)
                .buffer("virtual_lights", &inputs.lights.lights)
                .texture("gbuffer_depth", &gbuffer.depth)
                .texture("gbuffer_core", &gbuffer.core)
                .texture_if("gbuffer_specular", gbuffer.specular.as_ref())
                .texture_if("gbuffer_geometric_normal", gbuffer.geometric_normal.as_ref())
                .buffer_if("visibility", visibility)
                .view("red", &self.sums.red)
                .view("green", &self.sums.green)
                .view("blue", &self.sums.blue)
                .view("gathered_red", &self.sums.red)
                .view("gathered_green", &self.sums.green)
                .view("gathered_blue", &self.sums.blue)
                .texture("radiance", &outputs.radiance.image)
                .build(context.gpu)
        };
        let range_buffer = || {
            let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
            context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("light range"),
                size: 16,
                usage,
                mapped_at_creation: false,
            })
        };
        let mut chunks = Vec::new();
        let buffers: Vec<_> = match &inputs.visibility {
            None => vec![(None, 0..self.words)],
            Some(visibility) => {
                let words = visibility.shape.gathered_words(self.words);
                visibility.chunks.iter().map(Some).zip(words).collect()
            }
        };
        for (buffer, words) in buffers {
            let range = range_buffer();
            let group = group(&self.gather, &range, buffer)?;
            chunks.push(Chunk { words, range, group });
        }
        let unused = range_buffer();
        // Sub-pictures are padded to whole workgroups; see `lobelia::light_visibility`.
        let k = self.interleave;
        let gather_workgroups = self.extent.map(|side| side.div_ceil(k).div_ceil(8) * k);
        Ok(Bindings {
            chunks,
            resolve: group(&self.resolve, &unused, None)?,
            gather_workgroups,
            resolve_workgroups: self.resolve.workgroups_2d(self.extent),
        })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let cost = f64::from(self.extent[0]) * f64::from(self.extent[1]) * 32.0;
        let [x, y] = bindings.gather_workgroups;
        for (index, chunk) in bindings.chunks.iter().enumerate() {
            let (pipeline, first_word) = (&self.gather, chunk.words.start);
            frame.ranges(chunk.words.len() as u32, 1, cost, &mut self.rate, |frame, words| {
                let first = index == 0 && words.start == 0;
                let range = [first_word + words.start, first_word + words.end, first_word, u32::from(first)];
                frame.write_buffer(&chunk.range, bytemuck::cast_slice(&range));
                frame.compute("gather lights", |pass| {
                    pass.set_pipeline(pipeline.raw());
                    pass.set_bind_group(0, &chunk.group, &[]);
                    pass.dispatch_workgroups(x, y, 1);
                });
                Ok(())
            })?;
        }
        frame.compute("resolve", |pass| {
            pass.set_pipeline(self.resolve.raw());
            pass.set_bind_group(0, &bindings.resolve, &[]);
            pass.dispatch_workgroups(bindings.resolve_workgroups[0], bindings.resolve_workgroups[1], 1);
        });
        Ok(())
    }
}
