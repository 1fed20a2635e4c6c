//! The `vpl-lights` pass.

use crate::reflectance_flags;
use lobelia_frame::{ReflectiveShadowMap, SceneWorld, VirtualLights, VirtualLightsShape};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, Params, Pass, PlanContext, PortError,
    Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Picks virtual point lights from reflective shadow maps.
pub struct VplLightsPass {
    sum_rows: ComputePipeline,
    sum_totals: ComputePipeline,
    pick: ComputePipeline,
    settings: wgpu::Buffer,
    row_sums: wgpu::Buffer,
    total_sums: wgpu::Buffer,
    fixed: [u32; 3],
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
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The lights.
    pub lights: VirtualLights,
}

/// One group per entry point.
pub struct Bindings {
    sum_rows: wgpu::BindGroup,
    sum_totals: wgpu::BindGroup,
    pick: wgpu::BindGroup,
}

/// Largest storage binding at the WebGPU baseline.
const MAX_BINDING: u64 = 128 << 20;

impl Pass for VplLightsPass {
    const NAME: &'static str = "vpl-lights";
    const DOC: &'static str = "Picks virtual point lights from reflective shadow maps, in proportion to reflected flux.\n\
        Keller 1997; Dachsbacher and Stamminger 2006. Every texel that reflects light has a chance; positions follow the R2 sequence and depend on the \
        seed alone, so equal seeds give equal lights.";
    type World = SceneWorld;
    type Params = VplLightsParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &VplLightsParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        reflectance_flags(inputs.rsm.flags.specular, inputs.rsm.flags.normal_map, context.traits.ndf)
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let texels = u64::from(inputs.rsm.resolution).pow(2) * u64::from(inputs.rsm.faces);
        if texels * 4 > MAX_BINDING {
            let message = format!("the maps have {texels} texels in all; at most {} can be summed", MAX_BINDING / 4);
            return Err(PortError::at("rsm", message).help("lower the resolution of the reflective shadow maps, or use fewer point lights"));
        }
        Ok(OutputsShapes { lights: VirtualLightsShape { count: context.params.count, specular: inputs.rsm.flags.specular } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/vpl/src/lights.wgsl", text: include_str!("lights.wgsl") };
        let pipeline = |entry: &str| context.gpu.compute_pipeline(context.name, source, entry, context.flags);
        let rsm = &context.inputs.rsm;
        let buffer = |label: &str, bytes: u64, usage: wgpu::BufferUsages| {
            context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        let rows = u64::from(rsm.resolution) * u64::from(rsm.faces);
        Ok(Self {
            sum_rows: pipeline("sum_rows")?,
            sum_totals: pipeline("sum_totals")?,
            pick: pipeline("pick")?,
            settings: buffer("light picking", 16, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            row_sums: buffer("running sums", rows * u64::from(rsm.resolution) * 4, wgpu::BufferUsages::STORAGE),
            total_sums: buffer("running totals", rows * 4, wgpu::BufferUsages::STORAGE),
            fixed: [rsm.resolution, rsm.faces, context.params.count],
            seed_offset: context.params.seed,
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let rsm = &inputs.rsm;
        let group = |pipeline: &ComputePipeline| {
            pipeline
                .bindings(0)
                .raw_buffer("settings", &self.settings)
                .buffer("faces", &rsm.faces)
                .raw_buffer("lights", &context.world.lights)
                .texture("rsm_depth", &rsm.depth)
                .texture("rsm_core", &rsm.core)
                .texture_if("rsm_specular", rsm.specular.as_ref())
                .texture_if("rsm_geometric_normal", rsm.geometric_normal.as_ref())
                .raw_buffer("row_sums", &self.row_sums)
                .raw_buffer("total_sums", &self.total_sums)
                .buffer("virtual_lights", &outputs.lights.lights)
                .build(context.gpu)
        };
        Ok(Bindings { sum_rows: group(&self.sum_rows)?, sum_totals: group(&self.sum_totals)?, pick: group(&self.pick)? })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let [resolution, faces, count] = self.fixed;
        let seed = frame.info().seed.wrapping_add(self.seed_offset);
        frame.write_buffer(&self.settings, bytemuck::cast_slice(&[resolution, faces, count, seed]));
        frame.compute("sum rows", |pass| {
            pass.set_pipeline(self.sum_rows.raw());
            pass.set_bind_group(0, &bindings.sum_rows, &[]);
            pass.dispatch_workgroups(resolution, faces, 1);
        });
        frame.compute("sum totals", |pass| {
            pass.set_pipeline(self.sum_totals.raw());
            pass.set_bind_group(0, &bindings.sum_totals, &[]);
            pass.dispatch_workgroups(1, 1, 1);
        });
        frame.compute("pick lights", |pass| {
            pass.set_pipeline(self.pick.raw());
            pass.set_bind_group(0, &bindings.pick, &[]);
            pass.dispatch_workgroups(count.div_ceil(64), 1, 1);
        });
        Ok(())
    }
}
