//! CPU cost of running a compiled graph (record and submit) beside the same passes written by hand on raw wgpu.
//!
//! Sixteen compute passes in a row over a picture of 8 x 8 pixels, so that the device has next to nothing to do. Both sides use the same shader, the
//! same pipelines, a texture per pass, and a label per pass. The two are timed in turn within one run; the ratio of their medians is printed last.
#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use lobelia::{
    frame::{ImageShape, Radiance, SceneWorld},
    graph::{
        BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, Gpu, GraphFile, InputShapes, NoParams, NoPorts, OutputShapes, Pass,
        PlanContext, PlanOptions, PortError, Ports, RunError, RunOptions, Runner, testing,
    },
    scene::{Scene, device::GpuScene},
    shaders::{Flags, Source},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

const PASSES: usize = 16;
const EXTENT: [u32; 2] = [8, 8];

const SOURCE: &str = "@group(0) @binding(0) var made: texture_storage_2d<rgba16float, write>;
@compute @workgroup_size(8, 8) fn make(@builtin(global_invocation_id) id: vec3u) { textureStore(made, id.xy, vec4f(1.0)); }";

const STEP: &str = "@group(0) @binding(0) var before: texture_2d<f32>;
@group(0) @binding(1) var after: texture_storage_2d<rgba16float, write>;
@compute @workgroup_size(8, 8) fn step_once(@builtin(global_invocation_id) id: vec3u) {
    textureStore(after, id.xy, textureLoad(before, id.xy, 0) * 0.5);
}";

#[derive(Ports)]
struct StepIn {
    radiance: Radiance,
}

#[derive(Ports)]
struct StepOut {
    radiance: Radiance,
}

struct Make(ComputePipeline);
struct Step(ComputePipeline);

fn source_pipeline(gpu: &Gpu) -> Result<ComputePipeline, BuildError> {
    gpu.compute_pipeline("make", Source { path: "make.wgsl", text: SOURCE }, "make", &Flags::new())
}

fn step_pipeline(gpu: &Gpu) -> Result<ComputePipeline, BuildError> {
    gpu.compute_pipeline("step", Source { path: "step.wgsl", text: STEP }, "step_once", &Flags::new())
}

impl Pass for Make {
    const NAME: &'static str = "make";
    const DOC: &'static str = "Starts the chain.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = NoPorts;
    type Outputs = StepOut;
    type Bindings = wgpu::BindGroup;
    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(StepOutShapes { radiance: ImageShape { extent: context.extent } })
    }
    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        source_pipeline(context.gpu).map(Self)
    }
    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &StepOut) -> Result<wgpu::BindGroup, BuildError> {
        self.0.bindings(0).texture("made", &outputs.radiance.image).build(context.gpu)
    }
    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &wgpu::BindGroup) -> Result<(), RunError> {
        frame.compute("make", |pass| {
            pass.set_pipeline(self.0.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        });
        Ok(())
    }
}

impl Pass for Step {
    const NAME: &'static str = "step";
    const DOC: &'static str = "A link of the chain.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = StepIn;
    type Outputs = StepOut;
    type Bindings = wgpu::BindGroup;
    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(StepOutShapes { radiance: inputs.radiance })
    }
    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        step_pipeline(context.gpu).map(Self)
    }
    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &StepIn, outputs: &StepOut) -> Result<wgpu::BindGroup, BuildError> {
        self.0.bindings(0).texture("before", &inputs.radiance.image).texture("after", &outputs.radiance.image).build(context.gpu)
    }
    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &wgpu::BindGroup) -> Result<(), RunError> {
        frame.compute("step", |pass| {
            pass.set_pipeline(self.0.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        });
        Ok(())
    }
}

/// The graph side.
fn graph(gpu: &Gpu, world: &GpuScene) -> Runner<SceneWorld> {
    let mut registry = lobelia::registry();
    registry.add::<Make>().add::<Step>();
    let mut text = String::from("(passes: {\"p0\": make(), ");
    for index in 1..PASSES {
        text.push_str(&format!("\"p{index}\": step(from: {{\"radiance\": \"p{}\"}}), ", index - 1));
    }
    text.push_str(&format!("}}, output: \"p{}\")", PASSES - 1));
    let wired = GraphFile::parse(&text, "chain.ron").unwrap().wire(&registry, &[], &[]).unwrap();
    // No sharing, as the side written by hand has none: a texture per pass.
    let plan = wired.plan(&world.traits, &PlanOptions { reuse: false, ..PlanOptions::new(EXTENT) }).unwrap();
    Runner::new(gpu, plan, world, RunOptions::default()).unwrap()
}

/// The same by hand: pipelines, textures and bind groups made once, a plain loop to record.
struct ByHand {
    steps: Vec<(wgpu::ComputePipeline, wgpu::BindGroup, String)>,
}

impl ByHand {
    fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let texture = || {
            let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
            let size = wgpu::Extent3d { width: EXTENT[0], height: EXTENT[1], depth_or_array_layers: 1 };
            let descriptor = wgpu::TextureDescriptor {
                label: None,
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: Radiance::FORMAT,
                usage,
                view_formats: &[],
            };
            device.create_texture(&descriptor).create_view(&wgpu::TextureViewDescriptor::default())
        };
        let (make, step) = (source_pipeline(gpu).unwrap(), step_pipeline(gpu).unwrap());
        let views: Vec<_> = (0..PASSES).map(|_| texture()).collect();
        let group = |pipeline: &wgpu::ComputePipeline, views: &[&wgpu::TextureView]| {
            let entries: Vec<_> = views
                .iter()
                .enumerate()
                .map(|(binding, view)| wgpu::BindGroupEntry { binding: binding as u32, resource: wgpu::BindingResource::TextureView(view) })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            })
        };
        let mut steps = vec![(make.raw().clone(), group(make.raw(), &[&views[0]]), "p0".to_owned())];
        for index in 1..PASSES {
            steps.push((step.raw().clone(), group(step.raw(), &[&views[index - 1], &views[index]]), format!("p{index}")));
        }
        Self { steps }
    }

    fn run(&self, gpu: &Gpu) {
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        for (pipeline, group, label) in &self.steps {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("step"), timestamp_writes: None });
            pass.push_debug_group(label);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
            pass.pop_debug_group();
        }
        gpu.queue().submit([encoder.finish()]);
    }
}

fn median(mut times: Vec<Duration>) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e6
}

fn overhead(criterion: &mut Criterion) {
    let gpu = testing::gpu().expect("this benchmark needs a device");
    let scene = Arc::new(Scene::load("builtin:cornell-diffuse").unwrap());
    let world = GpuScene::new(gpu.device(), gpu.queue(), scene).unwrap();
    let mut runner = graph(gpu, &world);
    let by_hand = ByHand::new(gpu);
    let mut timed = |graph_side: bool| {
        let clock = Instant::now();
        if graph_side {
            runner.run(gpu, &world, 0, &mut |_, _| true).unwrap();
        } else {
            by_hand.run(gpu);
        }
        let elapsed = clock.elapsed();
        // The device's own work is waited for outside of the measurement.
        gpu.wait().unwrap();
        elapsed
    };
    let mut group = criterion.benchmark_group("record and submit 16 passes");
    for (name, side) in [("graph", true), ("by hand", false)] {
        group.bench_function(name, |bencher| bencher.iter_custom(|count| (0..count).map(|_| timed(side)).sum()));
    }
    group.finish();
    let (mut graph_times, mut hand_times) = (Vec::new(), Vec::new());
    for _ in 0..3000 {
        graph_times.push(timed(true));
        hand_times.push(timed(false));
    }
    let (graph_median, hand_median) = (median(graph_times), median(hand_times));
    let device = gpu.info().map_or("host device", |info| info.name.as_str());
    println!("interleaved on {device}: graph {graph_median:.1} us, by hand {hand_median:.1} us, ratio {:.3}", graph_median / hand_median);
}

criterion_group!(benches, overhead);
criterion_main!(benches);
