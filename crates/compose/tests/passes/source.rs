//! A pass that makes radiance known to the test.

use half::f16;
use lobelia_frame::{ImageShape, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, NoPorts, OutputShapes, ParamValue, Params, Pass,
    PlanContext, PortError, Ports, RunError, TraitsOf,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};
use wgpu::util::DeviceExt as _;

/// Which radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Every half float from 0 to 65504 in rising order, as grey.
    #[default]
    Grey,
    /// Half floats drawn from all bit patterns, channel by channel: every order of magnitude is as likely, zero and the extremes are among them.
    Random,
    /// Random as well, but in [0, 1]: sums of many stay far from the largest half float.
    Dim,
}

impl ParamValue for Pattern {
    fn kind() -> String {
        "grey, random or dim".into()
    }
}

/// Number of half floats from 0 to 65504.
const FINITE: u32 = 0x7c00;
/// Number of half floats from 0 to 1.
const UP_TO_ONE: u32 = 0x3c01;

/// Radiance of every texel; every value is a half float.
pub fn radiance(pattern: Pattern, seed: u32, extent: [u32; 2]) -> Vec<[f32; 3]> {
    let texel = |index: u32| match pattern {
        Pattern::Grey => [index % FINITE; 3],
        Pattern::Random => [0, 1, 2].map(|channel| random_bits(seed, 3 * index + channel)),
        Pattern::Dim => [0, 1, 2].map(|channel| hash(seed, 3 * index + channel) % UP_TO_ONE),
    };
    (0..extent[0] * extent[1]).map(|index| texel(index).map(|bits| f16::from_bits(bits as u16).to_f32())).collect()
}

fn random_bits(seed: u32, index: u32) -> u32 {
    match hash(seed, index) {
        // One in eight: zero, the smallest, the largest subnormal, the smallest normal, and the largest.
        word if word % 8 == 0 => [0, 1, 0x03ff, 0x0400, FINITE - 1][(word >> 8) as usize % 5],
        word => (word >> 8) % FINITE,
    }
}

/// Jarzynski and Olano 2020, Hash Functions for GPU Rendering: pcg.
fn hash(seed: u32, index: u32) -> u32 {
    let step = |input: u32| {
        let state = input.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    step(index ^ step(seed))
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct SourceParams {
    /// What it makes.
    pub pattern: Pattern,
    /// Of the random patterns.
    pub seed: u32,
    /// Rows and columns that the image has too many.
    pub excess: u32,
    /// The scene does not need it.
    pub absent: bool,
}

#[derive(Ports)]
pub struct Outputs {
    /// Radiance.
    pub radiance: Radiance,
}

pub struct SourcePass {
    pipeline: ComputePipeline,
    texels: wgpu::Buffer,
}

const WGSL: &str = "@group(0) @binding(0) var<storage, read> texels: array<vec4f>;
@group(0) @binding(1) var radiance: texture_storage_2d<rgba16float, write>;
@compute @workgroup_size(8, 8)
fn source(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(radiance);
    if all(id.xy < size) {
        textureStore(radiance, id.xy, texels[id.y * size.x + id.x]);
    }
}";

impl Pass for SourcePass {
    const NAME: &'static str = "source";
    const DOC: &'static str = "Radiance known to the test.";
    type World = SceneWorld;
    type Params = SourceParams;
    type Inputs = NoPorts;
    type Outputs = Outputs;
    type Bindings = (wgpu::BindGroup, [u32; 2]);

    fn need(params: &SourceParams, _: &TraitsOf<Self>) -> Need {
        if params.absent { Need::Omit("the test says so".into()) } else { Need::Run }
    }

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { radiance: ImageShape { extent: context.extent.map(|side| side + context.params.excess) } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let radiance = radiance(context.params.pattern, context.params.seed, context.outputs.radiance.extent);
        let texels: Vec<[f32; 4]> = radiance.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect();
        let contents = bytemuck::cast_slice(&texels);
        let description = wgpu::util::BufferInitDescriptor { label: None, contents, usage: wgpu::BufferUsages::STORAGE };
        let source = Source { path: "source.wgsl", text: WGSL };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "source", context.flags)?;
        Ok(Self { pipeline, texels: context.gpu.device().create_buffer_init(&description) })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &Outputs) -> Result<Self::Bindings, BuildError> {
        let bindings = self.pipeline.bindings(0).raw_buffer("texels", &self.texels).texture("radiance", &outputs.radiance.image);
        Ok((bindings.build(context.gpu)?, self.pipeline.workgroups_2d(outputs.radiance.shape.extent)))
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, (group, [x, y]): &Self::Bindings) -> Result<(), RunError> {
        frame.compute("source", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(*x, *y, 1);
        });
        Ok(())
    }
}
