//! The `flux-density` pass.

use lobelia_frame::{
    ReflectiveShadowMap, SamplingDensity, SamplingDensityBindings, SamplingDensityLevels, SamplingDensityShape, SceneWorld,
};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, NoParams, OutputShapes, Pass, PlanContext, PortError,
    Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;

/// Weighs texels by the flux that they reflect.
pub struct FluxDensityPass {
    weigh: ComputePipeline,
    levels: SamplingDensityLevels,
    /// Of a layer, in texels.
    side: u32,
    layers: u32,
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// The patches.
    pub rsm: ReflectiveShadowMap,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Weights in proportion to reflected flux.
    pub density: SamplingDensity,
}

/// Groups of both steps.
pub struct Bindings {
    weigh: wgpu::BindGroup,
    levels: SamplingDensityBindings,
}

impl Pass for FluxDensityPass {
    const NAME: &'static str = "flux-density";
    const DOC: &'static str = "Weighs the texels of reflective shadow maps by the flux that they reflect, to pick virtual lights.\n\
        Dachsbacher and Stamminger 2006. Knows nothing of what the camera sees: cheap and steady, but spends lights on what is out of view. Every texel that \
        reflects light has a weight.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &NoParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        inputs.rsm.flags.reflectance(context.traits.ndf)
    }

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { density: SamplingDensityShape { resolution: inputs.rsm.resolution, faces: inputs.rsm.faces } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/rsm/src/flux_density.wgsl", text: include_str!("flux_density.wgsl") };
        let shape = context.outputs.density;
        Ok(Self {
            weigh: context.gpu.compute_pipeline(context.name, source, "weigh", context.flags)?,
            levels: SamplingDensityLevels::new(context.gpu)?,
            side: shape.layer_side(),
            layers: shape.layers(),
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let (rsm, density) = (&inputs.rsm, &outputs.density);
        let weigh = self
            .weigh
            .bindings(0)
            .buffer("faces", &rsm.faces)
            .raw_buffer("lights", &context.world.lights)
            .texture("rsm_depth", &rsm.depth)
            .texture("rsm_core", &rsm.core)
            .texture_if("rsm_specular", rsm.specular.as_ref())
            .texture_if("rsm_geometric_normal", rsm.geometric_normal.as_ref())
            .view("weights", &density.weights.mip_view(0))
            .build(context.gpu)?;
        Ok(Bindings { weigh, levels: self.levels.bind(context.gpu, density)? })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let groups = self.side.div_ceil(8);
        frame.compute("weigh texels", |pass| {
            pass.set_pipeline(self.weigh.raw());
            pass.set_bind_group(0, &bindings.weigh, &[]);
            pass.dispatch_workgroups(groups, groups, self.layers);
        });
        self.levels.record(frame, &bindings.levels);
        Ok(())
    }
}
