//! The `compose` pass.

use lobelia_frame::{ImageShape, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, NoParams, OutputShapes, Pass, PlanContext, PortError, Ports,
    RunError,
};
use lobelia_shaders::Source;

/// Adds up radiance.
pub struct ComposePass {
    pipeline: ComputePipeline,
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What is summed, at most eight; without `from`, every radiance of the graph that does not depend on the sum. None: black.
    pub terms: Vec<Radiance>,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The sum.
    pub radiance: Radiance,
}

/// Group and workgroups.
pub struct Bindings {
    group: wgpu::BindGroup,
    workgroups: [u32; 2],
}

const TERMS: [&str; 8] = ["term_a", "term_b", "term_c", "term_d", "term_e", "term_f", "term_g", "term_h"];

impl Pass for ComposePass {
    const NAME: &'static str = "compose";
    const DOC: &'static str = "Adds up radiance.\nTerms that the scene does not need are simply not in the sum.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let extent = inputs.terms.first().map_or(context.extent, |first| first.extent);
        if let Some(other) = inputs.terms.iter().find(|term| term.extent != extent) {
            let message =
                format!("its terms differ in size: {} x {} and {} x {} pixels", extent[0], extent[1], other.extent[0], other.extent[1]);
            return Err(PortError::at("terms", message));
        }
        if inputs.terms.len() > TERMS.len() {
            return Err(PortError::at("terms", format!("it sums {} terms; at most {} fit one pass", inputs.terms.len(), TERMS.len()))
                .help("sum some of them in a compose pass of their own"));
        }
        Ok(OutputsShapes { radiance: ImageShape { extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let flags = context.flags.clone().with("TERMS", context.inputs.terms.len() as u32);
        let source = Source { path: "crates/compose/src/compose.wgsl", text: include_str!("compose.wgsl") };
        Ok(Self { pipeline: context.gpu.compute_pipeline(context.name, source, "sum", &flags)? })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let mut bindings = self.pipeline.bindings(0).texture("radiance", &outputs.radiance.image);
        for (name, term) in TERMS.into_iter().zip(&inputs.terms) {
            bindings = bindings.texture(name, &term.image);
        }
        Ok(Bindings { group: bindings.build(context.gpu)?, workgroups: self.pipeline.workgroups_2d(outputs.radiance.shape.extent) })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        frame.compute("sum", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            pass.dispatch_workgroups(bindings.workgroups[0], bindings.workgroups[1], 1);
        });
        Ok(())
    }
}
