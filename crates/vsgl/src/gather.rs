//! The `vsgl-gather` pass.

use lobelia_frame::{GBuffer, GatheredSums, ImageShape, LightClass, LightTransport, LightVisibility, Radiance, SceneWorld, VirtualLights};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OrNone, OutputShapes, ParamValue, Params,
    Pass, PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Adds up what virtual spherical Gaussian lights send to every pixel.
pub struct VsglGatherPass {
    gather: ComputePipeline,
    resolve: ComputePipeline,
    settings: wgpu::Buffer,
    sums: GatheredSums,
    extent: [u32; 2],
    interleave: u32,
    words: u32,
    rate: WorkRate,
}

/// Closed form of what a light sends to the viewer by way of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Form {
    /// Tokuyoshi 2014: SGs and ASGs with doubled peaks, cosines pulled out.
    Printed,
    /// Cone energy, smoothed cosines, GGX filtered by the light's extent (a form of this project).
    #[default]
    Fast,
    /// Gaussian position times SG intensity, the accurate clamped cosine, GGX filtered or as two peaks.
    Accurate,
    /// A Gaussian cloud of positions times SGs of intensity (Tokuyoshi 2015, 2024): soft everywhere, for lights as large as what they light.
    Gaussian,
}

impl ParamValue for Form {
    fn kind() -> String {
        "printed, fast, accurate or gaussian".into()
    }
}

/// What a gathering pass writes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Show {
    /// Radiance.
    #[default]
    Radiance,
    /// The share of lights that are taken for points.
    Points,
}

impl ParamValue for Show {
    fn kind() -> String {
        "radiance or points".into()
    }
}

/// Parameters of `vsgl-gather`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct VsglGatherParams {
    /// Which closed form: `fast` (the cheapest that is sound everywhere), `accurate` (both lobes of a light
    /// by themselves, broad lights with the two-peak form), `gaussian` (soft, for lights as large as what they light), or `printed` (as the 2014 brief has it).
    pub form: Form,
    /// Threshold of consistent bias reduction, or `none`: a light whose lobes are flatter than its cone times this is gathered as a point with the true
    /// reflectance at both ends, so that more lights, which are smaller, converge to the truth. Larger: less bias, more of a point light's noise. The
    /// brief's own is 0.001.
    #[param(range = 0.0..)]
    pub bias_reduction: OrNone<f32>,
    /// `radiance`, or `points`: the share of lights that bias reduction takes for points, as a grey picture.
    pub show: Show,
    /// Side k of the blocks in which each pixel gathers one k^2-th of the lights. A joint tent filter 2k - 1 pixels wide, which stops at edges of normal and
    /// depth, then brings the lights of the block together; detail smaller than that is blurred. 1 gathers every light at every pixel.
    #[param(unit = "pixels", range = 1..=8)]
    pub interleave: u32,
}

impl Default for VsglGatherParams {
    fn default() -> Self {
        Self { form: Form::Fast, bias_reduction: OrNone::None, show: Show::Radiance, interleave: 1 }
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

impl Pass for VsglGatherPass {
    const NAME: &'static str = "vsgl-gather";
    const DOC: &'static str = "Gathers virtual spherical Gaussian lights at every pixel: one bounce of indirect light.\n\
        Tokuyoshi 2014, section 3. Products of the surface's and the light's lobes over the cone in which the light's patch is seen, in closed form: finite at \
        every distance and smooth for every gloss. Lights without lobes are gathered as if each were a patch of no extent.";
    type World = SceneWorld;
    type Params = VsglGatherParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &VsglGatherParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn claim(_: &VsglGatherParams, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
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
        let lobes = inputs.lights.lobes;
        found.push(Specialisation::new(
            "LOBES",
            lobes,
            if lobes { "lights come with lobes" } else { "lights are points: their lobes are made here" },
        ));
        let VsglGatherParams { form, bias_reduction, show, interleave: k } = *context.params;
        found.push(Specialisation::new(
            "FORM_PRINTED",
            form == Form::Printed,
            format!("form is {}", ["printed", "fast", "accurate", "gaussian"][form as usize]),
        ));
        found.push(Specialisation::new(
            "FORM_ACCURATE",
            form == Form::Accurate,
            format!("form is {}", ["printed", "fast", "accurate", "gaussian"][form as usize]),
        ));
        found.push(Specialisation::new(
            "FORM_GAUSSIAN",
            form == Form::Gaussian,
            format!("form is {}", ["printed", "fast", "accurate", "gaussian"][form as usize]),
        ));
        let reduce = bias_reduction.value().is_some();
        found.push(Specialisation::new("BIAS_REDUCTION", reduce, if reduce { "bias_reduction is on" } else { "bias_reduction is none" }));
        found.push(Specialisation::new("SHOW_POINTS", show == Show::Points, format!("show is {}", ["radiance", "points"][show as usize])));
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
        let source = Source { path: "crates/vsgl/src/gather.wgsl", text: include_str!("gather.wgsl") };
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
        let threshold = context.params.bias_reduction.value().unwrap_or(0.0);
        let words = [count, interleave, u32::from(visibility_interleaved), threshold.to_bits(), least.to_bits(), 0, 0, 0];
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
                .buffer_if("lobes", inputs.lights.lobes.as_ref())
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
        match &inputs.visibility {
            None => {
                let range = range_buffer();
                let group = group(&self.gather, &range, None)?;
                chunks.push(Chunk { words: 0..self.words, range, group });
            }
            Some(visibility) => {
                for (buffer, words) in visibility.chunks.iter().zip(visibility.shape.gathered_words(self.words)) {
                    let range = range_buffer();
                    let group = group(&self.gather, &range, Some(buffer))?;
                    chunks.push(Chunk { words, range, group });
                }
            }
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
