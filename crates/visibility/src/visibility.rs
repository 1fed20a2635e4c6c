//! The `visibility` pass.

use crate::hierarchy::Hierarchy;
use lobelia_frame::{GBuffer, LightVisibility, LightVisibilityShape, SceneWorld, VirtualLights};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, Pass, PlanContext, PortError, Ports,
    RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_scene::Scene;
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Traces shadow rays from every pixel to every virtual light.
pub struct VisibilityPass {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
    nodes: wgpu::Buffer,
    triangles: wgpu::Buffer,
    /// Of the scene that the hierarchy was built for.
    version: u64,
    fixed: [u32; 2],
    extent: [u32; 2],
    rate: WorkRate,
}

/// Parameters of `visibility`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Side k of the blocks in which each pixel knows one k^2-th of the lights. Set it to that of the gathering pass, or leave it at 1.
    #[param(unit = "pixels", range = 1..=8)]
    pub interleave: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self { interleave: 1 }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// Where rays start.
    pub gbuffer: GBuffer,
    /// Where they go.
    pub lights: VirtualLights,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Which lights are seen.
    pub visibility: LightVisibility,
}

struct Chunk {
    first_word: u32,
    words: u32,
    range: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// One group per chunk of words.
pub struct Bindings {
    chunks: Vec<Chunk>,
    workgroups: [u32; 2],
}

/// Most memory that bits may take. More is a slip of the pen more often than a wish.
const MAX_BYTES: u64 = 4 << 30;

/// Rays cost about this many times what gathering one light does; only how work is split depends on it.
const RAY_COST: f64 = 6.0;

impl Pass for VisibilityPass {
    const NAME: &'static str = "visibility";
    const DOC: &'static str = "Exact visibility between pixels and virtual lights, by shadow rays.\n\
        Rays against a bounding volume hierarchy of the scene's triangles (stackless, any hit), one bit each. Costs pixels x lights rays: the yardstick for faster \
        approximations, or their replacement where quality counts.";
    type World = SceneWorld;
    type Params = Params;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &Params, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let normal_map = inputs.gbuffer.flags.normal_map;
        let reason = if normal_map { "rays start off the geometric normal" } else { "shading and geometric normal are the same" };
        vec![Specialisation::new("NORMAL_MAP", normal_map, reason)]
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
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
            let chunk_words = (LightVisibilityShape::CHUNK_BYTES / (4 * pixels)).max(1);
            let words = (MAX_BYTES / (4 * pixels)).min(u64::from(LightVisibility::MAX_CHUNKS) * chunk_words);
            let most = words * 32 * u64::from(shape.interleave).pow(2);
            let help = if most > 0 {
                format!("use fewer lights (at most {most}) or a smaller picture, or raise `interleave` here and in the gathering pass")
            } else {
                "use a smaller picture".to_owned()
            };
            return Err(PortError::new(message).help(help));
        }
        Ok(OutputsShapes { visibility: shape })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/visibility/src/visibility.wgsl", text: include_str!("visibility.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "trace", context.flags)?;
        let hierarchy = Hierarchy::build(&context.world.scene.triangles());
        let storage = |label: &str, bytes: &[u8]| -> Result<wgpu::Buffer, BuildError> {
            let size = bytes.len() as u64;
            if size > LightVisibilityShape::CHUNK_BYTES {
                return Err(BuildError::Other(format!(
                    "the {label} of the scene's hierarchy take {} MiB; at most 128 can be bound",
                    size >> 20
                )));
            }
            // An animated scene is rebuilt, and its tree may have more nodes; there are never more than two per triangle.
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
            let buffer =
                context.gpu.device().create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
            context.gpu.queue().write_buffer(&buffer, 0, bytes);
            Ok(buffer)
        };
        let most_nodes = 4 * context.traits.triangles.max(1);
        let mut padded = hierarchy.nodes.clone();
        if context.traits.animated {
            padded.resize(most_nodes.max(padded.len()), [0; 4]);
        }
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("visibility settings"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let fixed = [context.inputs.lights.count, context.params.interleave];
        write_settings(context.gpu.queue(), &settings, fixed, &hierarchy);
        Ok(Self {
            pipeline,
            settings,
            nodes: storage("nodes", bytemuck::cast_slice(&padded))?,
            triangles: storage("triangles", bytemuck::cast_slice(&hierarchy.triangles))?,
            version: context.world.scene.geometry_version(),
            fixed,
            extent: context.inputs.gbuffer.extent,
            rate: WorkRate::default(),
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let (gbuffer, out) = (&inputs.gbuffer, &outputs.visibility);
        let mut chunks = Vec::new();
        for (index, buffer) in out.chunks.iter().enumerate() {
            let range = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("word range"),
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let mut bindings = self
                .pipeline
                .bindings(0)
                .raw_buffer("view", &context.world.view)
                .raw_buffer("settings", &self.settings)
                .raw_buffer("range", &range)
                .raw_buffer("nodes", &self.nodes)
                .raw_buffer("triangles", &self.triangles)
                .buffer("virtual_lights", &inputs.lights.lights)
                .texture("gbuffer_depth", &gbuffer.depth)
                .buffer("visibility", buffer);
            bindings = match &gbuffer.geometric_normal {
                Some(normal) => bindings.texture("gbuffer_geometric_normal", normal),
                None => bindings.texture("gbuffer_core", &gbuffer.core),
            };
            let group = bindings.build(context.gpu)?;
            let index = index as u32;
            chunks.push(Chunk { first_word: index * out.shape.words_per_chunk(), words: out.shape.words_in_chunk(index), range, group });
        }
        let k = self.fixed[1];
        Ok(Bindings { chunks, workgroups: self.extent.map(|side| side.div_ceil(k).div_ceil(8) * k) })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        self.follow(frame, &world.scene)?;
        let cost = f64::from(self.extent[0]) * f64::from(self.extent[1]) * 32.0 * RAY_COST;
        let [x, y] = bindings.workgroups;
        let pipeline = &self.pipeline;
        for chunk in &bindings.chunks {
            frame.ranges(chunk.words, 1, cost, &mut self.rate, |frame, words| {
                frame.write_buffer(&chunk.range, bytemuck::cast_slice(&[chunk.first_word + words.start, chunk.first_word, 0, 0]));
                frame.compute("trace shadow rays", |pass| {
                    pass.set_pipeline(pipeline.raw());
                    pass.set_bind_group(0, &chunk.group, &[]);
                    pass.dispatch_workgroups(x, y, words.len() as u32);
                });
                Ok(())
            })?;
        }
        Ok(())
    }
}

impl VisibilityPass {
    /// Rebuilds the hierarchy after the scene moved.
    fn follow(&mut self, frame: &Frame<'_>, scene: &Scene) -> Result<(), RunError> {
        if scene.geometry_version() == self.version {
            return Ok(());
        }
        let hierarchy = Hierarchy::build(&scene.triangles());
        let fits = |rows: usize, buffer: &wgpu::Buffer| (rows * 16) as u64 <= buffer.size();
        if !fits(hierarchy.nodes.len(), &self.nodes) || !fits(hierarchy.triangles.len(), &self.triangles) {
            return Err(RunError::Pass { pass: frame.pass_name().into(), message: "the scene grew after the graph was created".into() });
        }
        frame.write_buffer(&self.nodes, bytemuck::cast_slice(&hierarchy.nodes));
        frame.write_buffer(&self.triangles, bytemuck::cast_slice(&hierarchy.triangles));
        write_settings(frame.gpu().queue(), &self.settings, self.fixed, &hierarchy);
        self.version = scene.geometry_version();
        Ok(())
    }
}

fn write_settings(queue: &wgpu::Queue, settings: &wgpu::Buffer, [count, interleave]: [u32; 2], hierarchy: &Hierarchy) {
    let nodes = (hierarchy.nodes.len() / 2) as u32;
    queue.write_buffer(settings, 0, bytemuck::cast_slice(&[count, interleave, nodes, 0]));
}
