//! The `vpl-lights` pass.

use lobelia_frame::{ReflectiveShadowMap, SamplingDensity, SceneWorld, VirtualLights, VirtualLightsShape};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, Params, Pass, PlanContext, PortError,
    Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Picks virtual point lights from reflective shadow maps.
pub struct VplLightsPass {
    pick: ComputePipeline,
    settings: wgpu::Buffer,
    count: u32,
    seed_offset: u32,
}

/// Parameters of `vpl-lights`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct VplLightsParams {
    /// Number of lights N. The relative MSE of the gathered light falls as about 1/N, its cost grows as N.
    #[param(unit = "lights", range = 1..=65536)]
    pub count: u32,
    /// Added to the run's seed, to try another set of lights with everything else equal.
    pub seed: u32,
}

impl Default for VplLightsParams {
    fn default() -> Self {
        Self { count: 1024, seed: 0 }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// The patches to pick from.
    pub rsm: ReflectiveShadowMap,
    /// How likely each of them is.
    pub density: SamplingDensity,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The lights.
    pub lights: VirtualLights,
}

impl Pass for VplLightsPass {
    const NAME: &'static str = "vpl-lights";
    const DOC: &'static str = "Picks virtual point lights from reflective shadow maps, as likely as a sampling density says.\n\
        Keller 1997; Dachsbacher and Stamminger 2006. Positions follow the R2 sequence and depend on the density and the seed alone, so equal seeds \
        give equal lights.";
    type World = SceneWorld;
    type Params = VplLightsParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = wgpu::BindGroup;

    fn need(_: &VplLightsParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        inputs.rsm.flags.reflectance(context.traits.ndf)
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        inputs.density.check(&inputs.rsm)?;
        Ok(OutputsShapes { lights: VirtualLightsShape { count: context.params.count, specular: inputs.rsm.flags.specular, lobes: false } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/vpl/src/lights.wgsl", text: include_str!("lights.wgsl") };
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("light picking"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self {
            pick: context.gpu.compute_pipeline(context.name, source, "pick", context.flags)?,
            settings,
            count: context.params.count,
            seed_offset: context.params.seed,
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<wgpu::BindGroup, BuildError> {
        let rsm = &inputs.rsm;
        self.pick
            .bindings(0)
            .raw_buffer("settings", &self.settings)
            .buffer("faces", &rsm.faces)
            .raw_buffer("lights", &context.world.lights)
            .texture("rsm_depth", &rsm.depth)
            .texture("rsm_core", &rsm.core)
            .texture_if("rsm_specular", rsm.specular.as_ref())
            .texture_if("rsm_geometric_normal", rsm.geometric_normal.as_ref())
            .texture("weights", &inputs.density.weights)
            .buffer("virtual_lights", &outputs.lights.lights)
            .build(context.gpu)
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &wgpu::BindGroup) -> Result<(), RunError> {
        let seed = frame.info().seed.wrapping_add(self.seed_offset);
        frame.write_buffer(&self.settings, bytemuck::cast_slice(&[self.count, seed, 0, 0]));
        frame.compute("pick lights", |pass| {
            pass.set_pipeline(self.pick.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(self.count.div_ceil(64), 1, 1);
        });
        Ok(())
    }
}
