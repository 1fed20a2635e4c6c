//! The `tonemap` pass.

use lobelia_frame::{DisplayImage, ImageShape, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, OutputShapes, ParamValue, Params, Pass, PlanContext,
    PortError, Ports, RunError,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Turns radiance into a picture.
pub struct TonemapPass {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
    /// 2 to the power of the parameter.
    exposure: f32,
}

/// How radiance beyond what a screen shows is brought into its range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// The film-like curve of the Academy Color Encoding System, fitted by Stephen Hill.
    Aces,
    /// AgX by Troy Sobotka: keeps hue in highlights, fit by Benjamin Wrensch.
    #[default]
    Agx,
    /// None: what exceeds 1 is cut off.
    None,
}

impl ParamValue for Curve {
    fn kind() -> String {
        "aces, agx or none".into()
    }
}

/// Parameters of `tonemap`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct TonemapParams {
    /// The curve.
    pub curve: Curve,
    /// Exposure: radiance is multiplied by 2 to this power.
    #[param(unit = "stops", range = -32.0..=32.0)]
    pub exposure: f32,
}

impl Default for TonemapParams {
    fn default() -> Self {
        Self { curve: Curve::Agx, exposure: 0.0 }
    }
}

/// Largest factor: the smallest half float is white with it, and the largest stays below 1e30.
const MOST_FACTOR: f32 = 1e25;

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What is shown.
    pub radiance: Radiance,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The picture.
    pub image: DisplayImage,
}

/// Group and workgroups.
pub struct Bindings {
    group: wgpu::BindGroup,
    workgroups: [u32; 2],
}

impl Pass for TonemapPass {
    const NAME: &'static str = "tonemap";
    const DOC: &'static str = "Turns linear radiance into display colours: exposure, tone curve, sRGB encoding.";
    type World = SceneWorld;
    type Params = TonemapParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { image: ImageShape { extent: inputs.radiance.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let curve = match context.params.curve {
            Curve::None => 0u32,
            Curve::Aces => 1,
            Curve::Agx => 2,
        };
        let source = Source { path: "crates/compose/src/tonemap.wgsl", text: include_str!("tonemap.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "tonemap", &context.flags.clone().with("CURVE", curve))?;
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("tonemap settings"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self { pipeline, settings, exposure: context.params.exposure.exp2() })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let group = self
            .pipeline
            .bindings(0)
            .raw_buffer("settings", &self.settings)
            .texture("radiance", &inputs.radiance.image)
            .texture("picture", &outputs.image.image)
            .build(context.gpu)?;
        Ok(Bindings { group, workgroups: self.pipeline.workgroups_2d(outputs.image.shape.extent) })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        // Exposure is of radiance as the scene has it, not as it is stored.
        let factor = (self.exposure / world.pre_exposure()).min(MOST_FACTOR);
        frame.write_buffer(&self.settings, bytemuck::cast_slice(&[factor, 0.0, 0.0, 0.0]));
        frame.compute("tonemap", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            pass.dispatch_workgroups(bindings.workgroups[0], bindings.workgroups[1], 1);
        });
        Ok(())
    }
}
