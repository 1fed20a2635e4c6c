//! The `brsm` pass.

use lobelia_frame::{
    GBuffer, ReflectiveShadowMap, SamplingDensity, SamplingDensityBindings, SamplingDensityLevels, SamplingDensityShape, SceneWorld,
};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, MAX_STORAGE_BINDING, Need, OutputShapes, ParamValue, Params,
    Pass, PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Weighs texels by what they send to the camera.
pub struct BrsmPass {
    pipelines: Pipelines,
    levels: SamplingDensityLevels,
    buffers: Buffers,
    shape: SamplingDensityShape,
    cells: u32,
    params: BrsmParams,
    rate: WorkRate,
}

struct Pipelines {
    weigh: ComputePipeline,
    estimate: ComputePipeline,
    blur: ComputePipeline,
    add_up: ComputePipeline,
    combine: ComputePipeline,
}

struct Buffers {
    estimate_settings: wgpu::Buffer,
    mix_settings: wgpu::Buffer,
    range: wgpu::Buffer,
    ratios: wgpu::Buffer,
    blurred: wgpu::Buffer,
    partial_sums: wgpu::Buffer,
    mean_ratio: wgpu::Buffer,
}

/// How a texel shines on a view sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lights {
    /// As a disk with lobes of spherical Gaussians: no singularity, and a glossy surface that mirrors the disk's rim is not missed.
    #[default]
    Gaussian,
    /// As a point; a distance below the disk's radius counts as that.
    Point,
}

impl ParamValue for Lights {
    fn kind() -> String {
        "gaussian or point".into()
    }
}

/// What the contributions of a texel to the view samples come to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Importance {
    /// Their mean: the flux of light that reaches the camera.
    Mean,
    /// The root of the mean square of each over the brightness of the pixel, with which the mean relative squared error of pixels is least.
    #[default]
    Relative,
}

impl ParamValue for Importance {
    fn kind() -> String {
        "mean or relative".into()
    }
}

/// Parameters of `brsm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct BrsmParams {
    /// How a texel shines on a view sample: `gaussian`, as a disk with lobes of spherical Gaussians, or `point`.
    pub lights: Lights,
    /// What the contributions of a texel to the view samples come to: `mean`, or `relative`, the root mean square of each over
    /// the brightness of its pixel.
    pub importance: Importance,
    /// Most cells a side of a face, rounded up to a power of two. Contributions are estimated once per cell, so the cost does not grow with the resolution of the
    /// map; texels of a cell share their contribution per reflected flux. As many as texels: every texel by itself.
    #[param(unit = "cells", range = 8..=1024)]
    pub cells: u32,
    /// View samples in all, spread over the screen. Each cell is held against a run of `subset` of them.
    #[param(unit = "samples", range = 1..=1048576)]
    pub samples: u32,
    /// View samples that each cell is held against; at most `samples` count. The cost grows with it.
    #[param(unit = "samples", range = 1..=4096)]
    pub subset: u32,
    /// Share of the lights that reflected flux alone places. It bounds what a texel that was thought unimportant can do: no light is brighter than
    /// `1 / flux_share` times what picking by flux would make it. 1 is `flux-density`.
    #[param(range = 0.001..=1.0)]
    pub flux_share: f32,
    /// Each texel is taken for a disk as large as one of so many patches that reflect equal flux, but no smaller than its cell and at most 64 times as wide. Fewer
    /// patches: larger disks, which a glossy surface is less likely to miss, and less weight where surfaces meet.
    #[param(unit = "patches", range = 1..=65536)]
    pub patches: u32,
    /// Whether a tent of 3 x 3 cells brings contributions per flux together.
    pub blur: bool,
    /// Added to the run's seed, to try other view samples with everything else equal.
    pub seed: u32,
}

impl Default for BrsmParams {
    fn default() -> Self {
        Self {
            lights: Lights::Gaussian,
            importance: Importance::Relative,
            cells: 64,
            samples: 16384,
            subset: 256,
            flux_share: 0.2,
            patches: 16,
            blur: true,
            seed: 0,
        }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What the camera sees.
    pub gbuffer: GBuffer,
    /// The patches.
    pub rsm: ReflectiveShadowMap,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Weights in proportion to what texels send to the camera, mixed with reflected flux.
    pub density: SamplingDensity,
}

/// Groups of all steps.
pub struct Bindings {
    weigh: wgpu::BindGroup,
    estimate: wgpu::BindGroup,
    blur: wgpu::BindGroup,
    add_up: wgpu::BindGroup,
    combine: wgpu::BindGroup,
    levels: SamplingDensityBindings,
}

/// Cells a side of each face.
fn cells(most: u32, shape: &SamplingDensityShape) -> u32 {
    most.next_power_of_two().min(shape.side()).max(8)
}

fn ratio_bytes(cells: u32, faces: u32) -> u64 {
    4 * u64::from(cells) * u64::from(cells) * u64::from(faces.max(1))
}

impl Pass for BrsmPass {
    const NAME: &'static str = "brsm";
    const DOC: &'static str = "Weighs the texels of reflective shadow maps by what they send to the camera: bidirectional reflective shadow maps.\n\
        Ritschel et al. 2011; Tokuyoshi 2014, section 3.2. Lights go where they count in the picture, a fifth by flux alone. Knows nothing of what \
        stands between, and every texel that reflects light has a weight.";
    type World = SceneWorld;
    type Params = BrsmParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &BrsmParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let mut found = inputs.rsm.flags.reflectance(context.traits.ndf);
        let gaussian = context.params.lights == Lights::Gaussian;
        found.push(Specialisation::new("GAUSSIAN", gaussian, format!("lights is {}", if gaussian { "gaussian" } else { "point" })));
        let relative = context.params.importance == Importance::Relative;
        found.push(Specialisation::new("RELATIVE", relative, format!("importance is {}", if relative { "relative" } else { "mean" })));
        found
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let (seen, lit) = (inputs.gbuffer.flags, inputs.rsm.flags);
        if (seen.specular, seen.normal_map) != (lit.specular, lit.normal_map) {
            return Err(PortError::at("gbuffer", "its surfaces have other parts than those of the reflective shadow map")
                .help("connect both to passes that draw the same scene"));
        }
        let shape = SamplingDensityShape { resolution: inputs.rsm.resolution, faces: inputs.rsm.faces };
        let cells = cells(context.params.cells, &shape);
        if ratio_bytes(cells, shape.faces) > MAX_STORAGE_BINDING {
            let message = format!(
                "{} faces of {cells} x {cells} cells need {} MiB; at most {} MiB can be bound",
                shape.faces,
                ratio_bytes(cells, shape.faces) >> 20,
                MAX_STORAGE_BINDING >> 20
            );
            return Err(PortError::at("rsm", message).help("set fewer cells"));
        }
        Ok(OutputsShapes { density: shape })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let gpu = context.gpu;
        let contribution = Source { path: "crates/brsm/src/contribution.wgsl", text: include_str!("contribution.wgsl") };
        let mix = Source { path: "crates/brsm/src/mix.wgsl", text: include_str!("mix.wgsl") };
        let buffer = |label: &str, size: u64, usage: wgpu::BufferUsages| {
            gpu.device().create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let uniform = |label: &str, size| buffer(label, size, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        let storage = |label: &str, size| buffer(label, size, wgpu::BufferUsages::STORAGE);
        let shape = context.outputs.density;
        let cells = cells(context.params.cells, &shape);
        let ratios = ratio_bytes(cells, shape.faces);
        let pipelines = Pipelines {
            weigh: gpu.compute_pipeline(context.name, contribution, "weigh", context.flags)?,
            estimate: gpu.compute_pipeline(context.name, contribution, "estimate", context.flags)?,
            blur: gpu.compute_pipeline(context.name, mix, "blur", context.flags)?,
            add_up: gpu.compute_pipeline(context.name, mix, "add_up", context.flags)?,
            combine: gpu.compute_pipeline(context.name, mix, "combine", context.flags)?,
        };
        let buffers = Buffers {
            estimate_settings: uniform("contribution settings", 32),
            mix_settings: uniform("mix settings", 16),
            range: uniform("workgroups", 16),
            ratios: storage("contribution over flux", ratios),
            blurred: storage("contribution over flux, blurred", ratios),
            // Two floats for every 64 cells.
            partial_sums: storage("sums of workgroups", ratios / 32),
            mean_ratio: storage("mean contribution over flux", 16),
        };
        let level = (shape.side() / cells).max(1).ilog2();
        let settings = [cells, level, context.params.flux_share.to_bits(), u32::from(context.params.blur)];
        gpu.queue().write_buffer(&buffers.mix_settings, 0, bytemuck::cast_slice(&settings));
        let levels = SamplingDensityLevels::new(gpu)?;
        Ok(Self { pipelines, levels, buffers, shape, cells, params: context.params.clone(), rate: WorkRate::default() })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let (gbuffer, rsm, density) = (&inputs.gbuffer, &inputs.rsm, &outputs.density);
        let finest = density.weights.mip_view(0);
        let contribution = |pipeline: &ComputePipeline| {
            pipeline
                .bindings(0)
                .raw_buffer("view", &context.world.view)
                .raw_buffer("settings", &self.buffers.estimate_settings)
                .raw_buffer("range", &self.buffers.range)
                .buffer("faces", &rsm.faces)
                .raw_buffer("lights", &context.world.lights)
                .texture("rsm_depth", &rsm.depth)
                .texture("rsm_core", &rsm.core)
                .texture_if("rsm_specular", rsm.specular.as_ref())
                .texture_if("rsm_geometric_normal", rsm.geometric_normal.as_ref())
                .texture("gbuffer_depth", &gbuffer.depth)
                .texture("gbuffer_core", &gbuffer.core)
                .texture_if("gbuffer_specular", gbuffer.specular.as_ref())
                .texture_if("gbuffer_geometric_normal", gbuffer.geometric_normal.as_ref())
                .view("weights", &finest)
                .texture("flux_sums", &density.weights)
                .raw_buffer("ratios", &self.buffers.ratios)
                .build(context.gpu)
        };
        let mix = |pipeline: &ComputePipeline| {
            pipeline
                .bindings(0)
                .raw_buffer("settings", &self.buffers.mix_settings)
                .texture("flux_sums", &density.weights)
                .raw_buffer("ratios", &self.buffers.ratios)
                .raw_buffer("blurred", &self.buffers.blurred)
                .raw_buffer("partial_sums", &self.buffers.partial_sums)
                .raw_buffer("mean_ratio", &self.buffers.mean_ratio)
                .view("weights", &finest)
                .build(context.gpu)
        };
        Ok(Bindings {
            weigh: contribution(&self.pipelines.weigh)?,
            estimate: contribution(&self.pipelines.estimate)?,
            blur: mix(&self.pipelines.blur)?,
            add_up: mix(&self.pipelines.add_up)?,
            combine: mix(&self.pipelines.combine)?,
            levels: self.levels.bind(context.gpu, density)?,
        })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let BrsmParams { samples, subset, patches, seed, .. } = self.params;
        let subset = subset.min(samples);
        let faces = self.shape.faces.max(1);
        let level = (self.shape.side() / self.cells).max(1).ilog2();
        let seed = frame.info().seed.wrapping_add(seed);
        let words = [self.cells, level, samples, subset, seed, (patches as f32).to_bits(), 0, 0];
        frame.write_buffer(&self.buffers.estimate_settings, bytemuck::cast_slice(&words));

        let (texels, layers) = (self.shape.layer_side().div_ceil(8), self.shape.layers());
        dispatch(frame, "weigh by flux", &self.pipelines.weigh, &bindings.weigh, [texels, texels, layers]);
        self.levels.record(frame, &bindings.levels);

        let groups = (self.cells / 8) * (self.cells / 8) * faces;
        let (pipeline, range) = (&self.pipelines.estimate, &self.buffers.range);
        // A view sample costs about what sixteen lights cost a pixel; a workgroup is 64 cells.
        let cost = f64::from(subset) * 64.0 * 16.0;
        frame.ranges(groups, 1, cost, &mut self.rate, |frame, part| {
            frame.write_buffer(range, bytemuck::cast_slice(&[part.start, part.end, 0, 0]));
            let count = part.end - part.start;
            let across = count.min(32768);
            dispatch(frame, "estimate contributions", pipeline, &bindings.estimate, [across, count.div_ceil(across), 1]);
            Ok(())
        })?;

        let cells = self.cells / 8;
        dispatch(frame, "blur", &self.pipelines.blur, &bindings.blur, [cells, cells, faces]);
        dispatch(frame, "add up contributions", &self.pipelines.add_up, &bindings.add_up, [1, 1, 1]);
        dispatch(frame, "combine", &self.pipelines.combine, &bindings.combine, [texels, texels, layers]);
        self.levels.record(frame, &bindings.levels);
        Ok(())
    }
}

fn dispatch(frame: &mut Frame<'_>, label: &str, pipeline: &ComputePipeline, group: &wgpu::BindGroup, [x, y, z]: [u32; 3]) {
    frame.compute(label, |pass| {
        pass.set_pipeline(pipeline.raw());
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(x, y, z);
    });
}
