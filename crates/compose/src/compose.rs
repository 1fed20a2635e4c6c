//! The `compose` pass.
//!
//! One dispatch sums at most [`TERMS`]`.len()` images. More are summed in stages, each of which starts from the total of the one before. That total
//! alternates between the output and one image of the pass's own, so that the last stage writes the output.

use lobelia_frame::{ImageShape, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, NoParams, OutputShapes, Pass, PlanContext, PortError, Ports,
    RunError,
};
use lobelia_shaders::Source;

/// Adds up radiance.
pub struct ComposePass {
    /// One for each stage.
    pipelines: Vec<ComputePipeline>,
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What is summed, any number, all of one size; without `from`, every radiance of the graph that does not depend on the sum. None: black.
    pub terms: Vec<Radiance>,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The sum, cut off at 65504. It is rounded to half floats after the first eight terms and after each further seven.
    pub radiance: Radiance,
}

/// Groups and workgroups.
pub struct Bindings {
    /// One for each stage.
    groups: Vec<wgpu::BindGroup>,
    workgroups: [u32; 2],
}

/// What one dispatch can read; the names are those of `compose.wgsl`.
const TERMS: [&str; 8] = ["term_a", "term_b", "term_c", "term_d", "term_e", "term_f", "term_g", "term_h"];

/// How many images each stage reads. Every stage but the first reads the total so far as its first image.
fn stages(terms: usize) -> Vec<usize> {
    let first = terms.min(TERMS.len());
    let mut stages = vec![first];
    let mut left = terms - first;
    while left > 0 {
        let added = left.min(TERMS.len() - 1);
        stages.push(added + 1);
        left -= added;
    }
    stages
}

/// An image that holds totals between stages, as [`Radiance`] does.
fn scratch(gpu: &wgpu::Device, extent: [u32; 2]) -> wgpu::TextureView {
    let texture = gpu.create_texture(&wgpu::TextureDescriptor {
        label: Some("total so far"),
        size: wgpu::Extent3d { width: extent[0], height: extent[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: Radiance::FORMAT,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

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
        Ok(OutputsShapes { radiance: ImageShape { extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/compose/src/compose.wgsl", text: include_str!("compose.wgsl") };
        let create = |count| {
            let flags = context.flags.clone().with("TERMS", count as u32);
            context.gpu.compute_pipeline(context.name, source, "sum", &flags)
        };
        Ok(Self { pipelines: stages(context.inputs.terms.len()).into_iter().map(create).collect::<Result<_, _>>()? })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let (extent, counts) = (outputs.radiance.shape.extent, stages(inputs.terms.len()));
        let scratch = (counts.len() > 1).then(|| scratch(context.gpu.device(), extent));
        let output = outputs.radiance.image.view();
        // Counted from the end: the last stage writes the output, the one before it the other image.
        let total = |from_last: usize| scratch.as_ref().filter(|_| from_last % 2 == 1).unwrap_or(output);
        let mut terms = inputs.terms.iter().map(|term| term.image.view());
        let mut groups = Vec::with_capacity(counts.len());
        for (stage, (pipeline, count)) in self.pipelines.iter().zip(&counts).enumerate() {
            let from_last = counts.len() - 1 - stage;
            let so_far = (stage > 0).then(|| total(from_last + 1));
            let mut bindings = pipeline.bindings(0).view("radiance", total(from_last));
            for (name, view) in TERMS.into_iter().zip(so_far.into_iter().chain(terms.by_ref()).take(*count)) {
                bindings = bindings.view(name, view);
            }
            groups.push(bindings.build(context.gpu)?);
        }
        let workgroups = self.pipelines.first().map_or([0; 2], |pipeline| pipeline.workgroups_2d(extent));
        Ok(Bindings { groups, workgroups })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        frame.compute("sum", |pass| {
            for (pipeline, group) in self.pipelines.iter().zip(&bindings.groups) {
                pass.set_pipeline(pipeline.raw());
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(bindings.workgroups[0], bindings.workgroups[1], 1);
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{TERMS, stages};

    #[test]
    fn every_term_is_read_once() {
        assert_eq!(stages(0), [0], "black is written too");
        assert_eq!((stages(1), stages(8)), (vec![1], vec![8]));
        assert_eq!((stages(9), stages(15), stages(16)), (vec![8, 2], vec![8, 8], vec![8, 8, 2]));
        for terms in 0..100 {
            let stages = stages(terms);
            assert_eq!(stages.iter().sum::<usize>(), terms + stages.len() - 1, "{terms}");
            assert!(stages.iter().all(|count| *count <= TERMS.len()), "{terms}");
        }
    }
}
