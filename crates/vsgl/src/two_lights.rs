//! The `two-vsgl` pass.

use lobelia_frame::{PatchMoments, ReflectiveShadowMap, SceneWorld, VirtualLights, VirtualLightsShape};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, NoParams, OutputShapes, Pass, PlanContext, PortError,
    Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;

/// All reflected light as two lights.
pub struct TwoVsglPass {
    reduce: ComputePipeline,
    settings: wgpu::Buffer,
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// Where the lights' sources are.
    pub rsm: ReflectiveShadowMap,
    /// The averages of its patches.
    pub moments: PatchMoments,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The two lights (one in a scene without specular lobes), with lobes.
    pub lights: VirtualLights,
}

impl Pass for TwoVsglPass {
    const NAME: &'static str = "two-vsgl";
    const DOC: &'static str = "Sums all reflected light up as two virtual spherical Gaussian lights, one diffuse and one glossy.\n\
        Tokuyoshi 2015, Fast Indirect Illumination Using Two Virtual Spherical Gaussian Lights. The cheapest tier: two lights a pixel, soft and steady, without \
        any detail of where light comes from. Their positions are means and may lie in the middle of a room, so gather them without visibility. Right where one \
        light source lights one region; with several, the two lights lie between them.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = wgpu::BindGroup;

    fn need(_: &NoParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let mut found = inputs.rsm.flags.reflectance(context.traits.ndf);
        found.extend(inputs.moments.lobe_length.specialisations());
        found
    }

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        inputs.moments.check(&inputs.rsm)?;
        let specular = inputs.rsm.flags.specular;
        Ok(OutputsShapes { lights: VirtualLightsShape { count: if specular { 2 } else { 1 }, specular, lobes: true } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/vsgl/src/two_lights.wgsl", text: include_str!("two_lights.wgsl") };
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("two lights"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let moments = context.inputs.moments;
        context.gpu.queue().write_buffer(&settings, 0, bytemuck::cast_slice(&[moments.side(), moments.faces.max(1), 0, 0]));
        Ok(Self { reduce: context.gpu.compute_pipeline(context.name, source, "reduce", context.flags)?, settings })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<wgpu::BindGroup, BuildError> {
        self.reduce
            .bindings(0)
            .raw_buffer("settings", &self.settings)
            .buffer("faces", &inputs.rsm.faces)
            .buffer("moments", &inputs.moments.moments)
            .buffer("virtual_lights", &outputs.lights.lights)
            .buffer_if("lobes", outputs.lights.lobes.as_ref())
            .build(context.gpu)
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &wgpu::BindGroup) -> Result<(), RunError> {
        frame.compute("sum up lights", |pass| {
            pass.set_pipeline(self.reduce.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        });
        Ok(())
    }
}
