//! The `vsl-gather` pass.

use lobelia_frame::{GBuffer, GatheredSums, ImageShape, LightClass, LightTransport, LightVisibility, Radiance, SceneWorld, VirtualLights};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, ParamValue, Params, Pass,
    PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Adds up what virtual spherical lights send to every pixel.
pub struct VslGatherPass {
    nearest: ComputePipeline,
    gather: ComputePipeline,
    resolve: ComputePipeline,
    settings: wgpu::Buffer,
    sums: GatheredSums,
    radii: wgpu::Buffer,
    fixed: [u32; 9],
    extent: [u32; 2],
    interleave: u32,
    words: u32,
    rate: WorkRate,
    nearest_rate: WorkRate,
}

/// Parameters of `vsl-gather`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct VslGatherParams {
    /// Directions drawn for each light at each pixel. 1 is enough where there are many lights; noise falls as one over the square root.
    #[param(unit = "samples", range = 1..=64)]
    pub samples: u32,
    /// Where a light's radius comes from.
    pub radius: RadiusSource,
    /// The radius is the distance to the k-th nearest light that shines; with fewer others, as though they went on as densely.
    #[param(unit = "lights", range = 1..=32)]
    pub neighbours: u32,
    /// Times every radius. 0 makes point lights of all.
    #[param(range = 0.0..)]
    pub radius_scale: f32,
    /// Added to the run's seed, to draw other directions with everything else equal.
    pub seed: u32,
    /// Side k of the blocks in which each pixel gathers one k^2-th of the lights. A joint tent filter 2k - 1 pixels wide, which stops at edges of normal and
    /// depth, then brings the lights of the block together; detail smaller than that is blurred. 1 gathers every light at every pixel.
    #[param(unit = "pixels", range = 1..=8)]
    pub interleave: u32,
}

impl Default for VslGatherParams {
    fn default() -> Self {
        Self { samples: 4, radius: RadiusSource::Nearest, neighbours: 10, radius_scale: 1.0, seed: 0, interleave: 1 }
    }
}

/// Where a light's radius comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RadiusSource {
    /// The distance to the `neighbours`-th nearest light.
    Nearest,
    /// The radius that the light's record carries; where that is 0, as `nearest`.
    Given,
}

impl ParamValue for RadiusSource {
    fn kind() -> String {
        "nearest or given".into()
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
    nearest: wgpu::BindGroup,
    nearest_range: wgpu::Buffer,
    chunks: Vec<Chunk>,
    resolve: wgpu::BindGroup,
    gather_workgroups: [u32; 2],
    resolve_workgroups: [u32; 2],
}

/// Least distance to a light, as a fraction of the size of what is seen: keeps a pixel on a light finite with the clamp off.
const LEAST_DISTANCE: f64 = 1e-5;

impl Pass for VslGatherPass {
    const NAME: &'static str = "vsl-gather";
    const DOC: &'static str = "Gathers virtual spherical lights at every pixel by Monte Carlo: one bounce of indirect light.\n\
        Hasan, Krivanek, Walter and Bala 2009. Slow and close to the truth: no bright spots, and lobes of any sharpness at both ends; lights are blurred \
        over their radius, and seen or not as their centre is.";
    type World = SceneWorld;
    type Params = VslGatherParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &VslGatherParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn claim(_: &VslGatherParams, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
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
        let source = Source { path: "crates/vsl/src/gather.wgsl", text: include_str!("gather.wgsl") };
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
        let settings = buffer("gather settings", 48, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        let visibility_interleaved = context.inputs.visibility.is_some_and(|visibility| visibility.interleave == interleave);
        let least = (LEAST_DISTANCE * context.world.seen_size()).powi(2).clamp(1e-20, 1e20) as f32;
        let params = context.params;
        let given = u32::from(params.radius == RadiusSource::Given);
        let interleaved = u32::from(visibility_interleaved);
        let fixed = [
            count,
            interleave,
            interleaved,
            params.samples,
            least.to_bits(),
            params.radius_scale.to_bits(),
            params.neighbours,
            given,
            params.seed,
        ];
        let sums = GatheredSums::new(context.gpu, extent);
        let nearest = Source { path: "crates/vsl/src/radii.wgsl", text: include_str!("radii.wgsl") };
        Ok(Self {
            nearest: context.gpu.compute_pipeline(context.name, nearest, "nearest", context.flags)?,
            radii: buffer("radii", u64::from(count.max(4)) * 4, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC),
            fixed,
            gather: pipeline("gather")?,
            resolve: pipeline("resolve")?,
            settings,
            sums,
            extent,
            interleave,
            words: count.div_ceil(interleave * interleave).div_ceil(32),
            rate: WorkRate::default(),
            nearest_rate: WorkRate::default(),
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
                .raw_buffer("radii", &self.radii)
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
        let nearest_range = range_buffer();
        let nearest = self
            .nearest
            .bindings(0)
            .raw_buffer("settings", &self.settings)
            .raw_buffer("range", &nearest_range)
            .buffer("virtual_lights", &inputs.lights.lights)
            .raw_buffer("radii", &self.radii)
            .build(context.gpu)?;
        Ok(Bindings {
            nearest,
            nearest_range,
            chunks,
            resolve: group(&self.resolve, &unused, None)?,
            gather_workgroups,
            resolve_workgroups: self.resolve.workgroups_2d(self.extent),
        })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let mut settings = [0; 12];
        settings[..9].copy_from_slice(&self.fixed);
        settings[8] = frame.info().seed.wrapping_add(settings[8]);
        frame.write_buffer(&self.settings, bytemuck::cast_slice(&settings));
        let count = settings[0];
        frame.ranges(count.div_ceil(64), 1, f64::from(count) * 64.0, &mut self.nearest_rate, |frame, groups| {
            frame.write_buffer(&bindings.nearest_range, bytemuck::cast_slice(&[groups.start, groups.end, 0, 0]));
            frame.compute("nearest lights", |pass| {
                pass.set_pipeline(self.nearest.raw());
                pass.set_bind_group(0, &bindings.nearest, &[]);
                pass.dispatch_workgroups(groups.len() as u32, 1, 1);
            });
            Ok(())
        })?;
        let cost = f64::from(self.extent[0]) * f64::from(self.extent[1]) * 32.0 * f64::from(settings[3]);
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
