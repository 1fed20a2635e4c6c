//! The mean over frames, against `f64`, on frames that are given.
#![allow(clippy::unwrap_used, missing_docs)]

use glam::{DVec3, Vec2};
use half::f16;
use lobelia::{
    Session, SessionOptions, Shot,
    frame::{ImageShape, Radiance, SceneWorld},
    graph::{
        BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, GraphFile, InputShapes, NoParams, NoPorts, OutputShapes, Pass,
        PlanContext, PlanOptions, PortError, Ports, RunError, RunOptions, Runner,
    },
    scene::{
        Scene,
        device::{GpuScene, ViewUniform},
    },
    shaders::Source,
};
use std::sync::Arc;

const EXTENT: [u32; 2] = [5, 3];
const VALUES: usize = 15 * 3;

/// What frame `frame` holds in each channel of each pixel: constants that carry through both words of the sum, noise over the whole range of half floats,
/// and what should not be there.
fn value(frame: u32, index: usize) -> f32 {
    let hash = hash_of(frame.wrapping_mul(977) ^ (index as u32) << 20);
    match index {
        0 => 65504.0,
        1 => 1.0,
        2 => 5.960_464_5e-8,
        3 => [1.0, f32::NAN][(frame % 2) as usize],
        4 => [1.0, f32::INFINITY][(frame % 2) as usize],
        5 => [1.0, -7.0][(frame % 2) as usize],
        6 => f32::from(frame == 0) * 60000.0,
        // Exponents from the smallest to the largest half float.
        _ => f16::from_bits((hash % 0x7bff) as u16).to_f32(),
    }
}

fn hash_of(mut x: u32) -> u32 {
    for _ in 0..3 {
        x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    }
    x ^ (x >> 15)
}

/// The value as it should count.
fn counted(frame: u32, index: usize) -> f64 {
    let value = value(frame, index);
    if value > 0.0 { f64::from(value.min(65504.0)) } else { 0.0 }
}

#[derive(Ports)]
pub struct GivenOut {
    /// The frame.
    pub radiance: Radiance,
}

pub struct Given {
    pipeline: ComputePipeline,
    values: wgpu::Buffer,
}

const WGSL: &str = "@group(0) @binding(0) var<storage, read> values: array<f32>;
@group(0) @binding(1) var radiance: texture_storage_2d<rgba16float, write>;
@compute @workgroup_size(8, 8)
fn give(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(radiance);
    if all(id.xy < size) {
        let first = 3u * (id.y * size.x + id.x);
        textureStore(radiance, id.xy, vec4f(values[first], values[first + 1u], values[first + 2u], 1.0));
    }
}";

impl Pass for Given {
    const NAME: &'static str = "given-frames";
    const DOC: &'static str = "Hands on what the test says.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = NoPorts;
    type Outputs = GivenOut;
    type Bindings = wgpu::BindGroup;

    fn shape(_: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(GivenOutShapes { radiance: ImageShape { extent: EXTENT } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let pipeline = context.gpu.compute_pipeline(context.name, Source { path: "given.wgsl", text: WGSL }, "give", context.flags)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let size = 4 * VALUES as u64;
        let values = context.gpu.device().create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
        Ok(Self { pipeline, values })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &GivenOut) -> Result<Self::Bindings, BuildError> {
        self.pipeline.bindings(0).raw_buffer("values", &self.values).texture("radiance", &outputs.radiance.image).build(context.gpu)
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &Self::Bindings) -> Result<(), RunError> {
        let values: Vec<f32> = (0..VALUES).map(|index| value(frame.info().index as u32, index)).collect();
        frame.write_buffer(&self.values, bytemuck::cast_slice(&values));
        frame.compute("give", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        });
        Ok(())
    }
}

/// A graph that averages given frames, a scene, and how its camera stands.
struct Bench {
    gpu: &'static lobelia::graph::Gpu,
    runner: Runner<SceneWorld>,
    device: GpuScene,
    scene: Arc<Scene>,
    frame: u32,
}

impl Bench {
    fn new(params: &str) -> Option<Self> {
        let gpu = lobelia::graph::testing::gpu()?;
        let mut registry = lobelia::registry();
        registry.add::<Given>();
        let text = format!(r#"(passes: {{"given": given_frames(), "mean": progressive({params})}}, output: "mean.radiance")"#);
        let wired = GraphFile::parse(&text, "mean.ron").unwrap().wire(&registry, &[], &[]).unwrap();
        let scene = Arc::new(Scene::load("builtin:cornell-diffuse").unwrap());
        let device = GpuScene::new(gpu.device(), gpu.queue(), scene.clone()).unwrap();
        let plan = wired.plan(&scene.traits(), &PlanOptions::new(EXTENT)).unwrap();
        let runner = Runner::new(gpu, plan, &device, RunOptions::default()).unwrap();
        let bench = Self { gpu, runner, device, scene, frame: 0 };
        bench.look(DVec3::ZERO, Vec2::ZERO);
        Some(bench)
    }

    fn look(&self, moved: DVec3, jitter: Vec2) {
        let mut camera = self.scene.camera(None).unwrap().clone();
        camera.position += moved;
        let view = ViewUniform::new(&camera, self.scene.origin(), EXTENT, jitter, self.frame, self.frame, None);
        self.device.set_view(self.gpu.queue(), &view);
    }

    fn run(&mut self, frames: u32) {
        for _ in 0..frames {
            self.runner.run(self.gpu, &self.device, 0, &mut |_, _| true).unwrap();
            self.frame += 1;
        }
    }

    /// The picture must be the mean of the frames from `first` up to `end`, rounded to half floats once.
    fn check(&self, first: u32, end: u32) {
        let pixels = self.runner.read_image(self.gpu, "mean.radiance").unwrap().to_f32_rgba();
        for index in 0..VALUES {
            let found = f64::from(pixels[index / 3][index % 3]);
            let mean = (first..end).map(|frame| counted(frame, index)).sum::<f64>() / f64::from(end - first);
            // Half a step of half floats, and what `f32` may move a tie.
            let step = 2f64.powi((mean.log2().floor() as i32).max(-14) - 10);
            assert!((found - mean).abs() <= 0.5001 * step, "frames {first} to {end}, value {index}: {found} for {mean}");
        }
    }
}

#[test]
fn the_mean_is_that_of_all_frames() {
    let Some(mut bench) = Bench::new("") else { return };
    bench.run(1);
    bench.check(0, 1);
    for frames in [1, 5, 300, 1000] {
        bench.run(frames);
        bench.check(0, bench.frame);
    }
}

#[test]
fn a_comparison_with_other_frames_fails() {
    let Some(mut bench) = Bench::new("") else { return };
    bench.run(7);
    for (first, end) in [(0, 6), (1, 7)] {
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| bench.check(first, end))).is_err());
    }
}

#[test]
fn after_so_many_frames_the_picture_stands_still() {
    let Some(mut bench) = Bench::new("frames: 4") else { return };
    bench.run(3);
    bench.check(0, 3);
    bench.run(9);
    bench.check(0, 4);
    assert!(problem("frames: 16777217").contains("frames"), "{}", problem("frames: 16777217"));
}

fn problem(params: &str) -> String {
    let text = format!(r#"(passes: {{"mean": progressive({params})}}, output: "mean.radiance")"#);
    GraphFile::parse(&text, "mean.ron").unwrap().wire(&lobelia::registry(), &[], &[]).err().unwrap().to_string()
}

#[test]
fn what_changes_the_picture_begins_the_mean_anew() {
    let Some(mut bench) = Bench::new("") else { return };
    bench.run(3);
    // Other points within pixels are the same picture.
    bench.look(DVec3::ZERO, Vec2::new(0.3, -0.2));
    bench.run(2);
    bench.check(0, 5);
    bench.look(DVec3::new(0.0, 0.01, 0.0), Vec2::ZERO);
    bench.run(2);
    bench.check(5, 7);
    bench.device.update(bench.gpu.queue(), bench.scene.clone());
    bench.run(3);
    bench.check(7, 10);
    bench.runner.reset_history();
    bench.run(2);
    bench.check(10, 12);
}

/// Means of 64 frames with 16 virtual lights each come near the picture of many.
#[test]
fn a_progressive_rendering_converges() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let text = r#"(
        passes: {
            "gbuffer": gbuffer(), "rsm": rsm(resolution: 128), "density": flux_density(), "lights": vpl_lights(count: 16),
            "indirect": vpl_gather(clamp: 10.0, clamp_unit: metre), "mean": progressive(from: {"radiance": "indirect.radiance"}),
        },
        output: "mean.radiance",
    )"#;
    let graph = GraphFile::parse(text, "converge.ron").unwrap();
    let options = SessionOptions { baseline: true, ..SessionOptions::default() };
    let mut session = Session::new("builtin:cornell-diffuse", &options).unwrap();
    let mut picture = |count: u32, frames: u32, seed: u32, progressive: bool| {
        let overrides = [format!("lights.count={count}").parse().unwrap()];
        let wired = graph.wire(&lobelia::registry(), &[], &overrides).unwrap();
        let shot = Shot { extent: [24, 24], frames, seed, progressive, ..Shot::default() };
        let mut rendering = session.start(&wired, &shot).unwrap();
        let picture = rendering.run(&mut |_| true).unwrap().image();
        // A second run of the same rendering is the same picture, not a longer mean.
        assert_eq!(rendering.run(&mut |_| true).unwrap().image(), picture);
        picture
    };
    let truth = picture(4096, 16, 77, true);
    let mut error = |count, frames, progressive| {
        let found = lobelia::measure::measure(&truth, &picture(count, frames, 3, progressive)).unwrap();
        found.relative_mse
    };
    let (one, many, stuck) = (error(16, 1, true), error(16, 64, true), error(16, 64, false));
    assert!(many < one / 20.0, "{one} {many}");
    // Frames that draw the same numbers have nothing to average.
    assert!(stuck > one / 2.0, "{one} {stuck}");
}
