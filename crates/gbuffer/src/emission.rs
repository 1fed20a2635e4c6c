//! The `emission` pass.

use lobelia_frame::{GBuffer, ImageShape, LightTransport, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, NoParams, OutputShapes, Pass, PlanContext,
    PortError, Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;

/// Light sources and background as the camera sees them.
pub struct EmissionPass {
    pipeline: ComputePipeline,
    sampler: wgpu::Sampler,
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What the camera sees.
    pub gbuffer: GBuffer,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Emission of surfaces (front faces) and, where there is none, the environment.
    pub radiance: Radiance,
}

/// Group and workgroups.
pub struct Bindings {
    group: wgpu::BindGroup,
    workgroups: [u32; 2],
}

impl Pass for EmissionPass {
    const NAME: &'static str = "emission";
    const DOC: &'static str = "Radiance of light sources and background that the camera sees directly.\n\
        Emission leaves front faces only; the environment map is seen where there is no surface.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &NoParams, traits: &TraitsOf<Self>) -> Need {
        if traits.emissive || traits.unlit || traits.environment {
            Need::Run
        } else {
            Need::Omit("the scene has no emissive material and no environment map".into())
        }
    }

    fn claim(_: &NoParams, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
        Some(LightTransport::of_all([0]))
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let (emissive, environment) = (inputs.gbuffer.flags.emissive, context.traits.environment);
        vec![
            Specialisation::new("EMISSIVE", emissive, if emissive { "a material emits" } else { "no material emits" }),
            Specialisation::new(
                "ENVIRONMENT",
                environment,
                if environment { "the scene has an environment map" } else { "the scene has no environment map" },
            ),
        ]
    }

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { radiance: ImageShape { extent: inputs.gbuffer.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/gbuffer/src/emission.wgsl", text: include_str!("emission.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "emission", context.flags)?;
        let sampler = context.gpu.device().create_sampler(&wgpu::SamplerDescriptor {
            label: Some("environment"),
            address_mode_u: wgpu::AddressMode::Repeat,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(Self { pipeline, sampler })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let environment = context.traits.environment;
        let mut bindings = self
            .pipeline
            .bindings(0)
            .texture("gbuffer_depth", &inputs.gbuffer.depth)
            .texture_if("gbuffer_emissive", inputs.gbuffer.emissive.as_ref())
            .texture("radiance", &outputs.radiance.image)
            .raw_buffer("view", &context.world.view);
        if environment {
            bindings = bindings.view("environment", &context.world.environment).sampler("environment_sampler", &self.sampler);
        }
        Ok(Bindings { group: bindings.build(context.gpu)?, workgroups: self.pipeline.workgroups_2d(outputs.radiance.shape.extent) })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        frame.compute("emission", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            pass.dispatch_workgroups(bindings.workgroups[0], bindings.workgroups[1], 1);
        });
        Ok(())
    }
}
