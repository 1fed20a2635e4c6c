//! The nets that the graph stretches under every pass: poison, counting, rights, history, and specialising that changes no pixel.
#![allow(clippy::unwrap_used, missing_docs)]

use lobelia::{
    Session, SessionOptions, Shot,
    frame::{GBuffer, ImageShape, Radiance, SceneWorld},
    graph::{
        BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, GraphFile, History, InputShapes, OutputShapes, ParamValue, Params,
        Pass, PlanContext, PlanOptions, PortError, Ports, Registry, RunError, RunOptions, Runner,
    },
    scene::device::ViewUniform,
    shaders::{Flags, Source},
};
use serde::{Deserialize, Serialize};

/// What the planted pass does wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    #[default]
    Nothing,
    Nan,
    Infinity,
    Negative,
    /// Leaves a texel unwritten.
    Hole,
    /// Reaches for a resource that it did not declare.
    Reach,
    /// Binds its input for writing.
    WriteInput,
}

impl ParamValue for Fault {
    fn kind() -> String {
        "a fault".into()
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct PlantParams {
    pub fault: Fault,
}

#[derive(Ports)]
pub struct PlantIn {
    pub radiance: Radiance,
}

#[derive(Ports)]
pub struct Out {
    pub radiance: Radiance,
}

pub struct Plant {
    pipeline: ComputePipeline,
    fault: Fault,
}

fn plant_wgsl(fault: Fault) -> String {
    let value = match fault {
        // The bits come through a buffer-free detour, so that no compiler can fold them.
        Fault::Nan => "bitcast<f32>(0x7fc00000u + select(0u, 1u, id.x > 1000000u))",
        Fault::Infinity => "bitcast<f32>(0x7f800000u + select(0u, 1u, id.x > 1000000u))",
        Fault::Negative => "-1.0",
        _ => "1.0",
    };
    let condition = if fault == Fault::Hole { "any(id.xy != vec2u(3u, 2u)) && " } else { "" };
    format!(
        "@group(0) @binding(0) var source: texture_2d<f32>;\n@group(0) @binding(1) var radiance: texture_storage_2d<rgba16float, write>;\n\
         @compute @workgroup_size(8, 8)\nfn plant(@builtin(global_invocation_id) id: vec3u) {{\n\
         var value = textureLoad(source, id.xy, 0);\nif all(id.xy == vec2u(5u, 5u)) {{ value.x = {value}; }}\n\
         if {condition}all(id.xy < textureDimensions(radiance)) {{ textureStore(radiance, id.xy, value); }}\n}}\n"
    )
}

impl Pass for Plant {
    const NAME: &'static str = "plant";
    const DOC: &'static str = "Does one thing wrong.";
    type World = SceneWorld;
    type Params = PlantParams;
    type Inputs = PlantIn;
    type Outputs = Out;
    type Bindings = (wgpu::BindGroup, [u32; 2]);

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutShapes { radiance: ImageShape { extent: inputs.radiance.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let text = plant_wgsl(context.params.fault);
        let pipeline = context.gpu.compute_pipeline("plant", Source { path: "plant.wgsl", text: &text }, "plant", &Flags::new())?;
        Ok(Self { pipeline, fault: context.params.fault })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &PlantIn, outputs: &Out) -> Result<Self::Bindings, BuildError> {
        let written = if self.fault == Fault::WriteInput { &inputs.radiance.image } else { &outputs.radiance.image };
        let group = self.pipeline.bindings(0).texture("source", &inputs.radiance.image).texture("radiance", written).build(context.gpu)?;
        Ok((group, self.pipeline.workgroups_2d(outputs.radiance.shape.extent)))
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, (group, [x, y]): &Self::Bindings) -> Result<(), RunError> {
        if self.fault == Fault::Reach {
            frame.resource::<GBuffer>("gbuffer.gbuffer")?;
        }
        frame.resource::<Radiance>("direct.radiance")?;
        frame.compute("plant", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        });
        Ok(())
    }
}

/// Adds `step` to its own result of the frame before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct CountParams {
    #[param(range = 1..=10)]
    pub step: u32,
}

impl Default for CountParams {
    fn default() -> Self {
        Self { step: 1 }
    }
}

#[derive(Ports)]
pub struct CountIn {
    pub previous: History<Radiance>,
}

pub struct Count {
    pipeline: ComputePipeline,
    valid: Vec<bool>,
}

impl Pass for Count {
    const NAME: &'static str = "count";
    const DOC: &'static str = "Counts frames in its own history.";
    type World = SceneWorld;
    type Params = CountParams;
    type Inputs = CountIn;
    type Outputs = Out;
    type Bindings = wgpu::BindGroup;

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutShapes { radiance: ImageShape { extent: context.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let text = format!(
            "@group(0) @binding(0) var previous: texture_2d<f32>;\n@group(0) @binding(1) var now: texture_storage_2d<rgba16float, write>;\n\
             @compute @workgroup_size(8, 8) fn count(@builtin(global_invocation_id) id: vec3u) {{\n\
             if all(id.xy < textureDimensions(now)) {{ textureStore(now, id.xy, textureLoad(previous, id.xy, 0) + vec4f({}.0)); }}\n}}\n",
            context.params.step
        );
        let pipeline = context.gpu.compute_pipeline("count", Source { path: "count.wgsl", text: &text }, "count", &Flags::new())?;
        Ok(Self { pipeline, valid: Vec::new() })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &CountIn, outputs: &Out) -> Result<wgpu::BindGroup, BuildError> {
        self.pipeline.bindings(0).texture("previous", &inputs.previous.0.image).texture("now", &outputs.radiance.image).build(context.gpu)
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &wgpu::BindGroup) -> Result<(), RunError> {
        self.valid.push(frame.history_is_valid());
        if frame.history_is_valid() != (self.valid.len() > 1) {
            return Err(RunError::Pass { pass: frame.pass_name().into(), message: format!("history is valid: {:?}", self.valid) });
        }
        frame.compute("count", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(2, 2, 1);
        });
        Ok(())
    }
}

fn registry() -> Registry<SceneWorld> {
    let mut registry = lobelia::registry();
    registry.add::<Plant>().add::<Count>();
    registry
}

fn session(scene: &str) -> Session {
    Session::new(scene, &SessionOptions { baseline: true, ..SessionOptions::default() }).unwrap()
}

const PLANTED: &str = r#"(
    passes: {
        "gbuffer": gbuffer(), "rsm": rsm(resolution: 64), "direct": direct(),
        "odd": plant(from: {"radiance": "direct.radiance"}),
        "after": compose(from: {"terms": "odd.radiance"}),
        "tonemap": tonemap(from: {"radiance": "after.radiance"}),
    },
    output: "tonemap.image",
)"#;

fn run_planted(fault: &str, check: bool) -> Result<(), String> {
    let graph = GraphFile::parse(PLANTED, "planted.ron").unwrap();
    let wired = graph.wire(&registry(), &[], &[format!("odd.fault={fault}").parse().unwrap()]).unwrap();
    let mut session = session("builtin:cornell-glossy");
    let shot = Shot { extent: [16, 16], run: RunOptions { check, ..RunOptions::default() }, ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).map_err(|error| error.to_string())?;
    rendering.run(&mut |_| true).map(|_| ()).map_err(|error| error.to_string())
}

#[test]
fn the_first_pass_that_writes_a_bad_value_is_named() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    run_planted("nothing", true).unwrap();
    for (fault, counts) in
        [("nan", "1 non-finite and 0 negative"), ("infinity", "1 non-finite and 0 negative"), ("negative", "0 non-finite and 1 negative")]
    {
        let error = run_planted(fault, true).unwrap_err();
        assert!(error.contains("pass `odd` (plant)") && error.contains(counts) && error.contains("odd.radiance/image"), "{fault}: {error}");
        // Without the net nobody notices, which is why it is there.
        run_planted(fault, false).unwrap();
    }
}

#[test]
fn a_texel_that_is_not_written_shows_as_poison() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let error = run_planted("hole", true).unwrap_err();
    // All four channels of one texel.
    assert!(error.contains("pass `odd`") && error.contains("4 non-finite"), "{error}");
}

#[test]
fn undeclared_resources_are_out_of_reach() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let reach = run_planted("reach", false).unwrap_err();
    assert!(reach.contains("pass `odd` reached for `gbuffer.gbuffer: GBuffer`") && reach.contains("direct.radiance: Radiance"), "{reach}");
    let write = run_planted("write_input", false).unwrap_err();
    assert!(write.contains("pass `odd` (plant)") && write.contains("`direct.radiance/image` came through an input port"), "{write}");
}

#[test]
fn history_lives_from_frame_to_frame_and_ends_with_a_change() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let text = r#"(passes: {"a": count(from: {"previous": "a.radiance"})}, output: "a.radiance", variants: {"two": {"a": count(step: 2, from: {"previous": "a.radiance"})}})"#;
    let graph = GraphFile::parse(text, "count.ron").unwrap();
    let session = session("builtin:cornell-diffuse");
    let traits = session.scene().traits();
    let plan = |variants: &[String], set: &[&str], extent| {
        let set: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
        graph.wire(&registry(), variants, &set).unwrap().plan(&traits, &PlanOptions::new(extent)).unwrap()
    };
    let (gpu, device) = (session.gpu(), session.device());
    let mut runner = Runner::new(gpu, plan(&[], &[], [16, 16]), device, RunOptions { check: true, ..RunOptions::default() }).unwrap();
    let frame = |runner: &mut Runner<SceneWorld>| {
        runner.run(gpu, device, 0, &mut |_, _| true).unwrap();
        runner.read_image(gpu, "a.radiance").unwrap().to_f32_rgba()[37][0]
    };
    assert_eq!([frame(&mut runner), frame(&mut runner), frame(&mut runner)], [1.0, 2.0, 3.0]);
    // The same plan again changes nothing.
    runner.update(gpu, plan(&[], &["a.step=1"], [16, 16]), device).unwrap();
    assert_eq!(frame(&mut runner), 4.0);
    // A parameter, a variant, a size, or a call resets it.
    runner.update(gpu, plan(&[], &["a.step=3"], [16, 16]), device).unwrap();
    assert_eq!([frame(&mut runner), frame(&mut runner)], [3.0, 6.0]);
    runner.update(gpu, plan(&["two".into()], &[], [16, 16]), device).unwrap();
    assert_eq!([frame(&mut runner), frame(&mut runner)], [2.0, 4.0]);
    runner.update(gpu, plan(&["two".into()], &[], [8, 16]), device).unwrap();
    assert_eq!(frame(&mut runner), 2.0);
}

#[test]
fn resetting_by_hand_starts_from_zero() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let graph = GraphFile::parse(r#"(passes: {"a": count(from: {"previous": "a"})}, output: "a")"#, "count.ron").unwrap();
    let session = session("builtin:cornell-diffuse");
    let plan = graph.wire(&registry(), &[], &[]).unwrap().plan(&session.scene().traits(), &PlanOptions::new([16, 16])).unwrap();
    let mut runner = Runner::new(session.gpu(), plan, session.device(), RunOptions::default()).unwrap();
    let run = |runner: &mut Runner<SceneWorld>| runner.run(session.gpu(), session.device(), 0, &mut |_, _| true).map(|_| ());
    for _ in 0..5 {
        run(&mut runner).unwrap();
    }
    let value = |runner: &Runner<SceneWorld>| runner.read_image(session.gpu(), "a").unwrap().to_f32_rgba()[0][0];
    assert_eq!(value(&runner), 5.0);
    runner.reset_history();
    // The pass holds that only its very first frame lacks a history; a reset makes another.
    assert!(run(&mut runner).unwrap_err().to_string().contains("[false, true, true, true, true, false]"));
}

/// Specialising to a scene leaves every pixel as it was; it only leaves out what could not matter.
#[test]
fn the_specialised_picture_is_the_general_one() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let graph = GraphFile::load(&lobelia_tests::root().join("graphs/indirect.ron")).unwrap();
    let set = ["rsm.resolution=128".parse().unwrap(), "lights.count=64".parse().unwrap()];
    let wired = graph.wire(&lobelia::registry(), &[], &set).unwrap();
    for scene in ["builtin:cornell-diffuse", "builtin:spheres"] {
        let mut session = session(scene);
        let mut picture = |specialise: bool| {
            let shot = Shot { extent: [48, 32], specialise, run: RunOptions { check: true, ..RunOptions::default() }, ..Shot::default() };
            let mut rendering = session.start(&wired, &shot).unwrap();
            let bytes = rendering.plan().bytes();
            (rendering.run(&mut |_| true).unwrap(), bytes)
        };
        let ((special, less), (general, more)) = (picture(true), picture(false));
        assert!(less < more, "{scene}: {less} {more}");
        let off = special
            .pixels
            .iter()
            .zip(&general.pixels)
            .map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs() / (a[c].abs() + 1e-3)).fold(0.0, f32::max));
        let worst = off.fold(0.0, f32::max);
        assert!(worst < 4e-3, "{scene}: a pixel differs by {worst}");
    }
}

/// Random finite cameras, seeds and clamps: nothing that a pass writes is NaN, infinite or negative.
#[test]
fn extremes_leave_no_bad_value() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let graph = GraphFile::load(&lobelia_tests::root().join("graphs/indirect.ron")).unwrap();
    for scene in ["builtin:cornell-glossy", "builtin:spheres"] {
        let mut session = session(scene);
        let set = ["rsm.resolution=64", "lights.count=256", "indirect.clamp=none"].map(|text| text.parse().unwrap());
        let wired = graph.wire(&lobelia::registry(), &[], &set).unwrap();
        for seed in [0, 1, u32::MAX] {
            let shot =
                Shot { extent: [33, 17], seed, samples: 2, run: RunOptions { check: true, ..RunOptions::default() }, ..Shot::default() };
            session.start(&wired, &shot).unwrap().run(&mut |_| true).unwrap();
        }
        // A camera that touches a surface, and one that looks along it.
        let wired = graph.wire(&lobelia::registry(), &[], &set).unwrap();
        let plan = wired.plan(&session.scene().traits(), &PlanOptions::new([16, 16])).unwrap();
        let mut runner = Runner::new(session.gpu(), plan, session.device(), RunOptions { check: true, ..RunOptions::default() }).unwrap();
        for (from, to) in
            [([0.0, 1e-4, 0.0], [0.0, 1e-4, -1.0]), ([0.9, 0.0, 0.0], [-0.9, 0.0, 0.0]), ([0.0, 900.0, 0.0], [0.0, 0.0, -1e-3])]
        {
            let (from, to) = (glam::DVec3::from_array(from), glam::DVec3::from_array(to));
            let camera = lobelia::scene::Camera::look_at("odd", from, to, glam::DVec3::Y, 1.0, 1e-5).unwrap();
            let view = ViewUniform::new(&camera, session.scene().origin(), [16, 16], glam::Vec2::ZERO, 0, 0, None);
            session.device().set_view(session.gpu().queue(), &view);
            runner.run(session.gpu(), session.device(), 0, &mut |_, _| true).unwrap();
        }
    }
}
