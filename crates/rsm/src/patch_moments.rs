//! The `patch-moments` pass.

use lobelia_frame::{LobeLength, PatchMoments, PatchMomentsShape, ReflectiveShadowMap, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, MAX_STORAGE_BINDING, Need, OutputShapes, Params, Pass,
    PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Averages patches over blocks of texels.
pub struct PatchMomentsPass {
    begin: ComputePipeline,
    merge: ComputePipeline,
    /// One uniform for each stored level.
    settings: Vec<wgpu::Buffer>,
    side: u32,
    faces: u32,
}

/// Parameters of `patch-moments`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct PatchMomentsParams {
    /// How the sharpness of a specular lobe is coded as the length of its mean direction, so that lobes can be averaged: `exact` (within 0.1 %), `banerjee`
    /// (the cubic of Laurijssen et al., within 5 %) or `toksvig` (linear; averages of broad lobes come out too flat).
    pub lobe_length: LobeLength,
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
    /// Their averages.
    pub moments: PatchMoments,
}

impl Pass for PatchMomentsPass {
    const NAME: &'static str = "patch-moments";
    const DOC: &'static str = "Averages the patches of reflective shadow maps over blocks of 4 x 4, 8 x 8, ... texels.\n\
        Tokuyoshi 2014. Position and variance, normal, reflected flux, and specular lobe with its width, merged level by level without differences of squares, \
        so that scenes far from the origin and sharp lobes keep their digits. Virtual spherical Gaussian lights are read from it.";
    type World = SceneWorld;
    type Params = PatchMomentsParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Vec<wgpu::BindGroup>;

    fn need(_: &PatchMomentsParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let mut found = inputs.rsm.flags.reflectance(context.traits.ndf);
        found.extend(context.params.lobe_length.specialisations());
        found
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let rsm = &inputs.rsm;
        let shape = PatchMomentsShape {
            resolution: rsm.resolution,
            faces: rsm.faces,
            specular: rsm.flags.specular,
            lobe_length: context.params.lobe_length,
        };
        if shape.bytes() > MAX_STORAGE_BINDING {
            let message = format!(
                "averages over {} faces of {} texels a side take {} MiB; at most {} MiB can be bound",
                rsm.faces,
                rsm.resolution,
                shape.bytes() >> 20,
                MAX_STORAGE_BINDING >> 20
            );
            return Err(PortError::at("rsm", message).help("lower the resolution of the reflective shadow maps, or use fewer point lights"));
        }
        Ok(OutputsShapes { moments: shape })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/rsm/src/patch_moments.wgsl", text: include_str!("patch_moments.wgsl") };
        let pipeline = |entry: &str| context.gpu.compute_pipeline(context.name, source, entry, context.flags);
        let shape = context.outputs.moments;
        let (side, faces) = (shape.side(), shape.faces.max(1));
        let settings = |level: u32| {
            let buffer = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("level of averages"),
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            context.gpu.queue().write_buffer(&buffer, 0, bytemuck::cast_slice(&[side, faces, level, 0]));
            buffer
        };
        Ok(Self {
            begin: pipeline("begin")?,
            merge: pipeline("merge")?,
            settings: (PatchMomentsShape::FIRST_LEVEL..shape.levels()).map(settings).collect(),
            side,
            faces,
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Self::Bindings, BuildError> {
        let rsm = &inputs.rsm;
        let group = |(index, settings): (usize, &wgpu::Buffer)| {
            let pipeline = if index == 0 { &self.begin } else { &self.merge };
            pipeline
                .bindings(0)
                .raw_buffer("settings", settings)
                .buffer("faces", &rsm.faces)
                .raw_buffer("lights", &context.world.lights)
                .texture("rsm_depth", &rsm.depth)
                .texture("rsm_core", &rsm.core)
                .texture_if("rsm_specular", rsm.specular.as_ref())
                .texture_if("rsm_geometric_normal", rsm.geometric_normal.as_ref())
                .buffer("moments", &outputs.moments.moments)
                .build(context.gpu)
        };
        self.settings.iter().enumerate().map(group).collect()
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Self::Bindings) -> Result<(), RunError> {
        for (index, group) in bindings.iter().enumerate() {
            let level = index as u32 + PatchMomentsShape::FIRST_LEVEL;
            let groups = (self.side >> level).div_ceil(8);
            let (pipeline, faces) = (if index == 0 { &self.begin } else { &self.merge }, self.faces);
            frame.compute(if index == 0 { "average texels" } else { "average blocks" }, |pass| {
                pass.set_pipeline(pipeline.raw());
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(groups, groups, faces);
            });
        }
        Ok(())
    }
}
