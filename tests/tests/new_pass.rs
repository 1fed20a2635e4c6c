//! A pass written outside of every crate of the workspace: registered, wired by RON, swapped by a variant. Nothing else knows of it.
#![allow(clippy::unwrap_used, missing_docs)]

use lobelia::{
    Session, SessionOptions, Shot,
    frame::{ImageShape, Radiance, SceneWorld},
    graph::{
        BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, GraphFile, InputShapes, OutputShapes, Params, Pass, PlanContext,
        PortError, Ports, RunError,
    },
    shaders::Source,
};
use serde::{Deserialize, Serialize};

// What follows is the whole pass.

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct FogParams {
    /// Share of the radiance that comes through.
    #[param(range = 0.0..=1.0)]
    pub transmittance: f32,
}

impl Default for FogParams {
    fn default() -> Self {
        Self { transmittance: 0.5 }
    }
}

#[derive(Ports)]
pub struct FogIn {
    /// What is dimmed.
    pub radiance: Radiance,
}

#[derive(Ports)]
pub struct FogOut {
    /// The dimmed radiance.
    pub radiance: Radiance,
}

pub struct Fog {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
}

const WGSL: &str = "@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var dimmed: texture_storage_2d<rgba16float, write>;
@group(0) @binding(2) var<uniform> transmittance: vec4f;
@compute @workgroup_size(8, 8)
fn fog(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(dimmed)) {
        textureStore(dimmed, id.xy, vec4f(textureLoad(source, id.xy, 0).rgb * transmittance.x, 1.0));
    }
}";

impl Pass for Fog {
    const NAME: &'static str = "fog";
    const DOC: &'static str = "Dims radiance.";
    type World = SceneWorld;
    type Params = FogParams;
    type Inputs = FogIn;
    type Outputs = FogOut;
    type Bindings = (wgpu::BindGroup, [u32; 2]);

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(FogOutShapes { radiance: ImageShape { extent: inputs.radiance.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let pipeline = context.gpu.compute_pipeline(context.name, Source { path: "fog.wgsl", text: WGSL }, "fog", context.flags)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let settings =
            context.gpu.device().create_buffer(&wgpu::BufferDescriptor { label: None, size: 16, usage, mapped_at_creation: false });
        context.gpu.queue().write_buffer(&settings, 0, &context.params.transmittance.to_le_bytes());
        Ok(Self { pipeline, settings })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &FogIn, outputs: &FogOut) -> Result<Self::Bindings, BuildError> {
        let bindings = self.pipeline.bindings(0).texture("source", &inputs.radiance.image).texture("dimmed", &outputs.radiance.image);
        let group = bindings.raw_buffer("transmittance", &self.settings).build(context.gpu)?;
        Ok((group, self.pipeline.workgroups_2d(outputs.radiance.shape.extent)))
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, (group, [x, y]): &Self::Bindings) -> Result<(), RunError> {
        frame.compute("fog", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        });
        Ok(())
    }
}

// And this is its use.

const GRAPH: &str = r#"(
    passes: {
        "gbuffer": gbuffer(),
        "direct": direct(),
        "weather": fog(from: {"radiance": "direct.radiance"}),
    },
    output: "weather.radiance",
    variants: {
        "dense": {"weather": fog(transmittance: 0.25, from: {"radiance": "direct.radiance"})},
        "clear": {"weather": compose(from: {"terms": "direct.radiance"})},
    },
)"#;

#[test]
fn a_new_pass_is_wired_and_swapped_without_touching_anything() {
    if lobelia::graph::testing::gpu().is_none() {
        return;
    }
    let mut registry = lobelia::registry();
    registry.add::<Fog>();
    assert_eq!(registry.info("fog").unwrap().params[0].range, "[0.0, 1.0]");
    let graph = GraphFile::parse(GRAPH, "weather.ron").unwrap();
    let options = SessionOptions { baseline: true, ..SessionOptions::default() };
    let mut session = Session::new("builtin:cornell-glossy", &options).unwrap();
    let mut mean = |variants: &[&str]| {
        let variants: Vec<String> = variants.iter().map(|name| (*name).to_owned()).collect();
        let wired = graph.wire(&registry, &variants, &[]).unwrap();
        let shot = Shot { extent: [32, 32], ..Shot::default() };
        let picture = session.start(&wired, &shot).unwrap().run(&mut |_| true).unwrap();
        lobelia::measure::mean(&picture.image())[0]
    };
    let (base, dense, clear) = (mean(&[]), mean(&["dense"]), mean(&["clear"]));
    assert!(clear > 0.01);
    assert!((base / clear - 0.5).abs() < 1e-3, "{base} {clear}");
    assert!((dense / clear - 0.25).abs() < 1e-3, "{dense} {clear}");
    let unknown = graph.wire(&lobelia::registry(), &[], &[]).err().unwrap().to_string();
    assert!(unknown.contains("no kind of pass is called `fog`"), "{unknown}");
}
