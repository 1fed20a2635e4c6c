//! The `aism` pass.

use crate::surface::SurfaceCurve;
use lobelia_frame::{GBuffer, LightVisibility, LightVisibilityShape, SceneWorld, VirtualLights};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, MAX_STORAGE_BINDING, Need, OutputShapes, ParamValue, Pass,
    PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_scene::Scene;
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Draws an imperfect shadow map for every virtual light and looks every pixel up in them.
pub struct AismPass {
    clear: ComputePipeline,
    weigh: ComputePipeline,
    splat: ComputePipeline,
    mark_gaps: ComputePipeline,
    pull: ComputePipeline,
    push: ComputePipeline,
    look_up: ComputePipeline,
    settings: wgpu::Buffer,
    range: wgpu::Buffer,
    levels: Vec<wgpu::Buffer>,
    triangles: wgpu::Buffer,
    ends: wgpu::Buffer,
    weights: wgpu::Buffer,
    maps: wgpu::Buffer,
    params: Params,
    shape: LightVisibilityShape,
    surface: Surface,
    rate: WorkRate,
}

/// What is known of the scene's surface once it is on the device.
struct Surface {
    version: u64,
    triangles: u32,
    area: f32,
}

/// Where points go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// Where a light's map has texels and the camera sees receivers: patches of surface are weighed for each light, then resampled.
    #[default]
    Adaptive,
    /// Anywhere on the surface, evenly by area, other places for each light: imperfect shadow maps as of 2008.
    Uniform,
}

impl ParamValue for Sampling {
    fn kind() -> String {
        "adaptive or uniform".into()
    }
}

/// Parameters of `aism`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Points in each light's map. Two to a texel are about enough; with fewer, gaps are wide and edges coarse. Time grows linearly.
    #[param(unit = "points", range = 16..=65536)]
    pub points: u32,
    /// Side of each light's map, a power of two. Shadow edges are good to about half a texel, which is 1.25 / resolution radians; memory, and the points
    /// that fill the map, grow with the square.
    #[param(unit = "texels", range = 8..=256)]
    pub resolution: u32,
    /// `adaptive` chooses points for each light; `uniform` spreads them over all surface, which is quicker for each point and needs several times as many
    /// in scenes that are large beside what a light or the camera sees.
    pub sampling: Sampling,
    /// Patches of equal area that each light weighs before points are chosen (adaptive sampling); rounded up to a multiple of 256. A patch should not
    /// be larger than what a light can see as one: more for scenes with much surface. Time grows linearly.
    #[param(unit = "patches", range = 256..=65536)]
    pub candidates: u32,
    /// Pixels that each light looks at to learn where receivers are (adaptive sampling). Patches with no receiver behind them get a tenth of the
    /// points. 0 does not look: points then fill the whole map evenly, and do not depend on the camera.
    #[param(unit = "pixels", range = 0..=16384)]
    pub view_samples: u32,
    /// Radius of the disk that stands for a point, in radii of the disk that has the point's share of the area. Below 1 there are holes even where points lie
    /// evenly; far above, shadows grow at their edges.
    #[param(unit = "radii", range = 0.25..=4.0)]
    pub spread: f32,
    /// Whether texels that no point reached refer to the nearest that one did, found by pulling and pushing through the levels of the map. Without it, light
    /// leaks through the gaps between points; with it, some corners and edges are darker.
    pub pull_push: bool,
    /// Length by which a receiver is moved off its surface before it is compared, in widths of a map's texel where the receiver is: in metres
    /// `bias * 2.5 / resolution * distance to the light`. So it follows the error of the map, which grows likewise, in scenes of any size. More hides acne on curved
    /// surfaces; less keeps shadows attached to what casts them.
    #[param(unit = "texels", range = 0.0..=8.0)]
    pub bias: f32,
    /// Side k of the blocks in which each pixel knows one k^2-th of the lights. Set it to that of the gathering pass, or leave it at 1.
    #[param(unit = "pixels", range = 1..=8)]
    pub interleave: u32,
    /// Added to the run's seed, to try other points with everything else equal.
    pub seed: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            points: 8192,
            resolution: 64,
            sampling: Sampling::Adaptive,
            candidates: 8192,
            view_samples: 1024,
            spread: 1.25,
            pull_push: true,
            bias: 0.5,
            interleave: 1,
            seed: 0,
        }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// The receivers.
    pub gbuffer: GBuffer,
    /// The lights; of each, position and geometric normal count.
    pub lights: VirtualLights,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Which lights are seen.
    pub visibility: LightVisibility,
}

/// Groups of each entry point; those of levels from the finest.
pub struct Bindings {
    clear: wgpu::BindGroup,
    weigh: wgpu::BindGroup,
    splat: wgpu::BindGroup,
    mark_gaps: wgpu::BindGroup,
    pull: Vec<wgpu::BindGroup>,
    push: Vec<wgpu::BindGroup>,
    look_up: Vec<wgpu::BindGroup>,
}

/// Most memory that bits may take. More is a slip of the pen more often than a wish.
const MAX_BYTES: u64 = 4 << 30;

/// Most memory that maps, or weights of patches, may take: lights come in batches that fit.
const BATCH_BYTES: u64 = 64 << 20;

impl Params {
    fn candidates(&self) -> u32 {
        self.candidates.next_multiple_of(256)
    }

    /// Texels of a light's pyramid.
    fn stride(&self) -> u32 {
        (4 * self.resolution * self.resolution - 1) / 3
    }

    /// Most lights of one batch.
    fn batch(&self, lights: u32) -> u32 {
        let each = u64::from(self.stride().max(self.candidates())) * 4;
        ((BATCH_BYTES / each) as u32).clamp(1, 65_535).min(lights.max(1))
    }
}

impl Pass for AismPass {
    const NAME: &'static str = "aism";
    const DOC: &'static str = "Approximate visibility between pixels and virtual lights, by adaptive imperfect shadow maps.\n\
        Ritschel et al. 2008 and 2011. Every light has a tiny map of its hemisphere, drawn from a few thousand points that are chosen anew each frame and closed by \
        pull-push. Its cost grows with lights x (points + pixels), not with rays: cheaper than `visibility` in large scenes and pictures, with wrong bits at edges.";
    type World = SceneWorld;
    type Params = Params;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &Params, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let normal_map = inputs.gbuffer.flags.normal_map;
        let reason = if normal_map { "receivers are geometric planes" } else { "shading and geometric normal are the same" };
        let adaptive = context.params.sampling == Sampling::Adaptive;
        let sampling = format!("sampling is {}", if adaptive { "adaptive" } else { "uniform" });
        vec![Specialisation::new("NORMAL_MAP", normal_map, reason), Specialisation::new("ADAPTIVE", adaptive, sampling)]
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let resolution = context.params.resolution;
        if !resolution.is_power_of_two() {
            let near = [resolution.next_power_of_two() / 2, resolution.next_power_of_two()];
            return Err(PortError::new(format!("`resolution` is {resolution}, but must be a power of two"))
                .help(format!("set it to {} or {}", near[0], near[1])));
        }
        let shape =
            LightVisibilityShape { extent: inputs.gbuffer.extent, lights: inputs.lights.count, interleave: context.params.interleave };
        let pixels = u64::from(shape.extent[0]) * u64::from(shape.extent[1]);
        let bytes = pixels * 4 * u64::from(shape.words_per_pixel());
        if bytes > MAX_BYTES || shape.chunks() > LightVisibility::MAX_CHUNKS {
            let message = format!(
                "{} lights seen from {pixels} pixels take {} MiB; at most {} MiB are given",
                shape.lights,
                bytes >> 20,
                MAX_BYTES >> 20
            );
            return Err(
                PortError::new(message).help("use fewer lights or a smaller picture, or raise `interleave` here and in the gathering pass")
            );
        }
        Ok(OutputsShapes { visibility: shape })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let maps = Source { path: "crates/aism/src/maps.wgsl", text: include_str!("maps.wgsl") };
        let look_up = Source { path: "crates/aism/src/look_up.wgsl", text: include_str!("look_up.wgsl") };
        let pipeline = |source, entry: &str| context.gpu.compute_pipeline(context.name, source, entry, context.flags);
        let buffer = |label: &str, size: u64, usage: wgpu::BufferUsages| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            context.gpu.device().create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let (storage, uniform) = (wgpu::BufferUsages::STORAGE, wgpu::BufferUsages::UNIFORM);
        let scene = &context.world.scene;
        let curve = SurfaceCurve::new(&scene.triangles());
        // Triangles of an animated scene can lose their area and find it again.
        let room = if context.traits.animated { context.traits.triangles } else { curve.len() }.max(1) as u64;
        if 48 * room > MAX_STORAGE_BINDING {
            let size = (48 * room) >> 20;
            return Err(BuildError::Other(format!(
                "the triangles of the scene take {size} MiB; at most {} can be bound",
                MAX_STORAGE_BINDING >> 20
            )));
        }
        let (triangles, ends) = (buffer("triangles", 48 * room, storage), buffer("ends of triangles", 4 * room.max(4), storage));
        context.gpu.queue().write_buffer(&triangles, 0, bytemuck::cast_slice(&curve.triangles));
        context.gpu.queue().write_buffer(&ends, 0, bytemuck::cast_slice(&curve.ends));
        let (params, shape) = (context.params.clone(), context.outputs.visibility);
        let batch = u64::from(params.batch(shape.lights));
        let levels = (0..params.resolution.ilog2())
            .map(|index| {
                let level = buffer("map level", 16, uniform);
                context.gpu.queue().write_buffer(&level, 0, bytemuck::cast_slice(&[index, 0, 0, 0]));
                level
            })
            .collect();
        Ok(Self {
            clear: pipeline(maps, "clear")?,
            weigh: pipeline(maps, "weigh")?,
            splat: pipeline(maps, "splat")?,
            mark_gaps: pipeline(maps, "mark_gaps")?,
            pull: pipeline(maps, "pull")?,
            push: pipeline(maps, "push")?,
            look_up: pipeline(look_up, "look_up")?,
            settings: buffer("imperfect shadow map settings", 48, uniform),
            range: buffer("range of lights", 16, uniform),
            levels,
            triangles,
            ends,
            weights: buffer("weights of patches", batch * u64::from(params.candidates()) * 4, storage),
            maps: buffer("imperfect shadow maps", batch * u64::from(params.stride()) * 4, storage),
            params,
            shape,
            surface: Surface { version: scene.geometry_version(), triangles: curve.len() as u32, area: curve.area as f32 },
            rate: WorkRate::default(),
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let gbuffer = &inputs.gbuffer;
        let group = |pipeline: &ComputePipeline, level: &wgpu::Buffer| {
            let bindings = pipeline
                .bindings(0)
                .raw_buffer("view", &context.world.view)
                .raw_buffer("settings", &self.settings)
                .raw_buffer("range", &self.range)
                .raw_buffer("level", level)
                .raw_buffer("triangles", &self.triangles)
                .raw_buffer("ends", &self.ends)
                .buffer("virtual_lights", &inputs.lights.lights)
                .raw_buffer("weights", &self.weights)
                .raw_buffer("maps", &self.maps)
                .texture("gbuffer_depth", &gbuffer.depth);
            match &gbuffer.geometric_normal {
                Some(normal) => bindings.texture("gbuffer_geometric_normal", normal),
                None => bindings.texture("gbuffer_core", &gbuffer.core),
            }
            .build(context.gpu)
        };
        let look_up = |buffer| {
            let bindings = self
                .look_up
                .bindings(0)
                .raw_buffer("view", &context.world.view)
                .raw_buffer("settings", &self.settings)
                .raw_buffer("range", &self.range)
                .buffer("virtual_lights", &inputs.lights.lights)
                .raw_buffer("maps", &self.maps)
                .texture("gbuffer_depth", &gbuffer.depth)
                .buffer("visibility", buffer);
            match &gbuffer.geometric_normal {
                Some(normal) => bindings.texture("gbuffer_geometric_normal", normal),
                None => bindings.texture("gbuffer_core", &gbuffer.core),
            }
            .build(context.gpu)
        };
        let each_level =
            |pipeline: &ComputePipeline| -> Result<Vec<_>, BuildError> { self.levels.iter().map(|level| group(pipeline, level)).collect() };
        Ok(Bindings {
            clear: group(&self.clear, &self.levels[0])?,
            weigh: group(&self.weigh, &self.levels[0])?,
            splat: group(&self.splat, &self.levels[0])?,
            mark_gaps: group(&self.mark_gaps, &self.levels[0])?,
            pull: each_level(&self.pull)?,
            push: each_level(&self.push)?,
            look_up: outputs.visibility.chunks.iter().map(look_up).collect::<Result<_, _>>()?,
        })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        self.follow(frame, &world.scene)?;
        self.write_settings(frame);
        let Params { points, interleave, .. } = self.params;
        let pixels = f64::from(self.shape.extent[0]) * f64::from(self.shape.extent[1]);
        // In units of one light at one pixel.
        let cost = f64::from(8 * points + 8 * self.params.candidates() + self.params.stride()) + pixels / f64::from(interleave.pow(2));
        let mut rate = std::mem::take(&mut self.rate);
        let batches = self.batches();
        for (index, (chunk, lights)) in batches.iter().enumerate() {
            if index > 0 {
                // The range of the next batch must not be written before this one's work.
                frame.split(index as f32 / batches.len() as f32)?;
            }
            frame.ranges(lights.len() as u32, 1, cost, &mut rate, |frame, part| {
                self.draw_and_look_up(frame, bindings, *chunk, lights.start + part.start..lights.start + part.end);
                Ok(())
            })?;
        }
        self.rate = rate;
        Ok(())
    }
}

impl AismPass {
    /// Chunks of visibility with ranges of lights that have their bits there and fit the maps.
    fn batches(&self) -> Vec<(u32, Range<u32>)> {
        let per_word = 32 * self.shape.interleave.pow(2);
        let most = self.params.batch(self.shape.lights);
        let mut batches = Vec::new();
        for chunk in 0..self.shape.chunks() {
            let first = chunk * self.shape.words_per_chunk() * per_word;
            let end = (first + self.shape.words_in_chunk(chunk) * per_word).min(self.shape.lights);
            batches.extend((first..end).step_by(most as usize).map(|start| (chunk, start..end.min(start + most))));
        }
        batches
    }

    fn draw_and_look_up(&self, frame: &mut Frame<'_>, bindings: &Bindings, chunk: u32, lights: Range<u32>) {
        let count = lights.len() as u32;
        let orders = self.shape.interleave.pow(2);
        let words = lights.start / orders / 32..lights.end.div_ceil(orders).div_ceil(32);
        let chunk_word = chunk * self.shape.words_per_chunk();
        frame.write_buffer(&self.range, bytemuck::cast_slice(&[lights.start, lights.end, words.start, chunk_word]));
        let run = |frame: &mut Frame<'_>, label: &str, pipeline: &ComputePipeline, group: &wgpu::BindGroup, size: [u32; 3]| {
            frame.compute(label, |pass| {
                pass.set_pipeline(pipeline.raw());
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(size[0], size[1], size[2]);
            });
        };
        run(frame, "clear maps", &self.clear, &bindings.clear, [self.params.stride().div_ceil(256), count, 1]);
        if self.surface.triangles > 0 {
            if self.params.sampling == Sampling::Adaptive {
                run(frame, "weigh patches", &self.weigh, &bindings.weigh, [count, 1, 1]);
            }
            run(frame, "splat points", &self.splat, &bindings.splat, [self.params.points.div_ceil(64), count, 1]);
        }
        if self.params.pull_push {
            let texels = |level: usize| (self.params.resolution >> level).pow(2);
            run(frame, "mark gaps", &self.mark_gaps, &bindings.mark_gaps, [texels(0).div_ceil(256), count, 1]);
            for (level, group) in bindings.pull.iter().enumerate() {
                run(frame, "pull", &self.pull, group, [texels(level + 1).div_ceil(256), count, 1]);
            }
            for (level, group) in bindings.push.iter().enumerate().rev() {
                run(frame, "push", &self.push, group, [texels(level).div_ceil(256), count, 1]);
            }
        }
        let k = self.shape.interleave;
        let [x, y] = self.shape.extent.map(|side| side.div_ceil(k).div_ceil(8) * k);
        run(frame, "look up", &self.look_up, &bindings.look_up[chunk as usize], [x, y, words.len() as u32]);
    }

    fn write_settings(&self, frame: &Frame<'_>) {
        let (params, surface) = (&self.params, &self.surface);
        let words = [
            self.shape.lights,
            params.interleave,
            params.resolution,
            params.points,
            surface.triangles,
            params.candidates(),
            frame.info().seed.wrapping_add(params.seed),
            params.view_samples,
            surface.area.to_bits(),
            params.spread.to_bits(),
            params.bias.to_bits(),
            0,
        ];
        frame.write_buffer(&self.settings, bytemuck::cast_slice(&words));
    }

    /// Takes the surface anew after the scene moved.
    fn follow(&mut self, frame: &Frame<'_>, scene: &Scene) -> Result<(), RunError> {
        if scene.geometry_version() == self.surface.version {
            return Ok(());
        }
        let curve = SurfaceCurve::new(&scene.triangles());
        if (curve.triangles.len() * 16) as u64 > self.triangles.size() {
            return Err(RunError::Pass { pass: frame.pass_name().into(), message: "the scene grew after the graph was created".into() });
        }
        frame.write_buffer(&self.triangles, bytemuck::cast_slice(&curve.triangles));
        frame.write_buffer(&self.ends, bytemuck::cast_slice(&curve.ends));
        self.surface = Surface { version: scene.geometry_version(), triangles: curve.len() as u32, area: curve.area as f32 };
        Ok(())
    }
}
