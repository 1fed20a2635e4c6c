//! The `gbuffer` pass.

use lobelia_frame::{GBuffer, GBufferShape, SceneWorld, SurfaceFlags, SurfaceFormats};
use lobelia_graph::{
    BuildError, CreateContext, DeviceOf, Frame, InputShapes, NoParams, NoPorts, OutputShapes, Pass, PlanContext, PortError, Ports,
    RasterDescription, RasterPipeline, RunError, Specialisation,
};
use lobelia_shaders::Source;

/// Draws the scene from the camera.
pub struct GBufferPass {
    pipeline: RasterPipeline,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// What the camera sees.
    pub gbuffer: GBuffer,
}

/// Views to render into, and the group that holds camera and instances.
pub struct Bindings {
    group: wgpu::BindGroup,
    depth: wgpu::TextureView,
    colors: [Option<wgpu::TextureView>; 4],
}

impl Pass for GBufferPass {
    const NAME: &'static str = "gbuffer";
    const DOC: &'static str = "Draws the surface that the camera sees at every pixel centre.\n\
        Reverse-Z depth, octahedral normals, base colour, and what else the scene's materials have, in 12 to 24 bytes a pixel. \
        Targets that no material of the scene needs are dropped.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = NoPorts;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn specialise(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Vec<Specialisation> {
        let mut flags = SurfaceFlags::of(context.traits).specialisations();
        flags.extend(SurfaceFlags::drawing(context.traits));
        flags
    }

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { gbuffer: GBufferShape { extent: context.extent, flags: SurfaceFlags::of(context.traits) } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let flags = context.outputs.gbuffer.flags;
        let target = |on: bool, format: wgpu::TextureFormat| on.then_some(wgpu::ColorTargetState::from(format));
        let pipeline = context.gpu.raster_pipeline(&RasterDescription {
            label: context.name,
            source: Source { path: "crates/gbuffer/src/gbuffer.wgsl", text: include_str!("gbuffer.wgsl") },
            vertex_entry: "vertex",
            fragment_entry: Some("fragment"),
            flags: context.flags,
            vertex_buffers: &context.world.vertex_layouts(),
            targets: &[
                target(true, SurfaceFormats::CORE),
                target(flags.specular, SurfaceFormats::specular(flags)),
                target(flags.normal_map, SurfaceFormats::GEOMETRIC_NORMAL),
                target(flags.emissive, SurfaceFormats::EMISSIVE),
            ],
            depth: Some(wgpu::DepthStencilState {
                format: SurfaceFormats::DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            primitive: wgpu::PrimitiveState::default(),
            layouts: &[(1, context.world.material_layout.clone())],
        })?;
        Ok(Self { pipeline })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let group = self
            .pipeline
            .bindings(0)
            .raw_buffer("view", &context.world.view)
            .raw_buffer("instances", &context.world.instances)
            .build(context.gpu)?;
        let out = &outputs.gbuffer;
        let optional = [&out.specular, &out.geometric_normal, &out.emissive].map(|part| part.as_ref().map(|part| part.view().clone()));
        let [specular, geometric_normal, emissive] = optional;
        Ok(Bindings {
            group,
            depth: out.depth.view().clone(),
            colors: [Some(out.core.view().clone()), specular, geometric_normal, emissive],
        })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let clear = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        let colors = bindings.colors.each_ref().map(|view| {
            view.as_ref().map(|view| wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops: clear })
        });
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &bindings.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        frame.render("draw surfaces", &colors, Some(depth), |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            world.draw(pass, 1);
        });
        Ok(())
    }
}
