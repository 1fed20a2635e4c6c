//! The `direct` pass.

use lobelia_frame::{GBuffer, ImageShape, LightClass, LightTransport, Radiance, ReflectiveShadowMap, SceneWorld};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, ParamValue, Pass, PlanContext,
    PortError, Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Lights every pixel by all punctual lights.
pub struct DirectPass {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
}

/// What a texel of a shadow map stands for when a point is compared against it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Comparison {
    /// A piece of the plane through the texel's surface: its depth where the ray to the point meets it.
    #[default]
    Plane,
    /// Its depth everywhere, as in plain percentage-closer filtering; the bias grows with the slope of the receiver.
    Depth,
}

impl ParamValue for Comparison {
    fn kind() -> String {
        "plane or depth".into()
    }
}

/// Parameters of `direct`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Width of the shadow filter. 1 blends 2 x 2 texels, the least that hides the map's grid; wider is softer and costs the square.
    #[param(unit = "texels", range = 1..=8)]
    pub filter_width: u32,
    /// Distance by which a caster must stand before a surface to shade it. Flat surfaces need none; it covers curvature within a texel.
    #[param(unit = "texels", range = 0.0..=16.0)]
    pub bias: f32,
    /// How a texel shades: `plane` needs next to no bias; `depth` is the plain test, for comparison.
    pub comparison: Comparison,
}

impl Default for Params {
    fn default() -> Self {
        Self { filter_width: 1, bias: 0.5, comparison: Comparison::Plane }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What the camera sees.
    pub gbuffer: GBuffer,
    /// What the lights see; without it nothing casts a shadow.
    pub rsm: Option<ReflectiveShadowMap>,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Light that scattered exactly once.
    pub radiance: Radiance,
}

/// Group and workgroups.
pub struct Bindings {
    group: wgpu::BindGroup,
    workgroups: [u32; 2],
}

impl Pass for DirectPass {
    const NAME: &'static str = "direct";
    const DOC: &'static str = "Direct light of point, spot and directional lights, shadowed by their maps.\n\
        Light that scatters exactly once. glTF reflectance (Lambert and GGX or Phong, height-correlated Smith, Schlick); shadows compare against \
        each texel's own plane, so flat surfaces need no bias.";
    type World = SceneWorld;
    type Params = Params;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &Params, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn claim(_: &Params, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
        Some(LightTransport::of(LightClass::Punctual, [1]))
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let flags = inputs.gbuffer.flags;
        let mut found = flags.reflectance(context.traits.ndf);
        let shadows = inputs.rsm.is_some();
        found.push(Specialisation::new(
            "SHADOWS",
            shadows,
            if shadows { "a shadow map is connected" } else { "no shadow map is connected" },
        ));
        let depth = shadows && context.params.comparison == Comparison::Depth;
        found.push(Specialisation::new(
            "DEPTH_COMPARISON",
            depth,
            if depth { "comparison: depth" } else { "texels count as planes, or not at all" },
        ));
        found
    }

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { radiance: ImageShape { extent: inputs.gbuffer.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/direct/src/direct.wgsl", text: include_str!("direct.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "direct", context.flags)?;
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("direct settings"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let faces = context.inputs.rsm.map_or(0, |rsm| rsm.faces);
        let words = [context.world.light_count, faces, context.params.filter_width, context.params.bias.to_bits()];
        context.gpu.queue().write_buffer(&settings, 0, bytemuck::cast_slice(&words));
        Ok(Self { pipeline, settings })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let gbuffer = &inputs.gbuffer;
        let mut bindings = self
            .pipeline
            .bindings(0)
            .raw_buffer("view", &context.world.view)
            .raw_buffer("settings", &self.settings)
            .raw_buffer("lights", &context.world.lights)
            .texture("gbuffer_depth", &gbuffer.depth)
            .texture("gbuffer_core", &gbuffer.core)
            .texture_if("gbuffer_specular", gbuffer.specular.as_ref())
            .texture_if("gbuffer_geometric_normal", gbuffer.geometric_normal.as_ref())
            .texture("radiance", &outputs.radiance.image);
        if let Some(rsm) = &inputs.rsm {
            bindings = bindings.buffer("faces", &rsm.faces).texture("rsm_depth", &rsm.depth);
            bindings = match &rsm.geometric_normal {
                Some(normal) => bindings.texture("rsm_normal", normal),
                None => bindings.texture("rsm_core", &rsm.core),
            };
        }
        Ok(Bindings { group: bindings.build(context.gpu)?, workgroups: self.pipeline.workgroups_2d(outputs.radiance.shape.extent) })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        frame.compute("light pixels", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            pass.dispatch_workgroups(bindings.workgroups[0], bindings.workgroups[1], 1);
        });
        Ok(())
    }
}
