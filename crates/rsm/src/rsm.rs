//! The `rsm` pass.

use crate::faces;
use lobelia_frame::{ReflectiveShadowMap, ReflectiveShadowMapShape, SceneWorld, SurfaceFlags, SurfaceFormats};
use lobelia_graph::{
    BuildError, CreateContext, DeviceOf, Frame, InputShapes, Need, NoPorts, OutputShapes, Pass, PlanContext, PortError, Ports,
    RasterDescription, RasterPipeline, RunError, Specialisation, TraitsOf,
};
use lobelia_scene::device::GpuScene;
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Draws the scene from every punctual light.
pub struct RsmPass {
    pipeline: RasterPipeline,
    /// The faces of the scene as it was at `version`. They are copied into the output in its place among the frame's commands: a direct write
    /// would come before all of them, and another resource may still be using the memory then.
    described: wgpu::Buffer,
    version: u64,
}

/// Parameters of `rsm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Side of each square face. Shadow edges are sharp to one texel; memory and the cost of choosing virtual lights grow with its square.
    #[param(unit = "texels", range = 16..=4096)]
    pub resolution: u32,
}

impl Default for Params {
    fn default() -> Self {
        Self { resolution: 512 }
    }
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// What the lights see.
    pub rsm: ReflectiveShadowMap,
}

/// Views and group of one face.
struct Face {
    group: wgpu::BindGroup,
    depth: wgpu::TextureView,
    colors: [Option<wgpu::TextureView>; 3],
    label: String,
}

/// Every face, and the output that describes them.
pub struct Bindings {
    faces: Vec<Face>,
    descriptions: wgpu::Buffer,
}

/// Most layers that a texture array has at the WebGPU baseline.
const MAX_FACES: usize = 256;

impl Pass for RsmPass {
    const NAME: &'static str = "rsm";
    const DOC: &'static str = "Draws what every punctual light sees: a reflective shadow map.\n\
        Dachsbacher and Stamminger 2005. Depth, normals and material of the patch behind each texel; one square face for spots and directional lights, \
        six for points and for spots wider than 65 degrees. Serves as the shadow map of direct light and as the store that virtual lights are picked from.";
    type World = SceneWorld;
    type Params = Params;
    type Inputs = NoPorts;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &Params, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Vec<Specialisation> {
        let mut flags = SurfaceFlags::of(context.traits).specialisations();
        flags.retain(|flag| flag.flag != "EMISSIVE");
        let mask = context.traits.alpha_mask;
        flags.push(Specialisation::new(
            "ALPHA_MASK",
            mask,
            if mask { "a material is cut out by alpha" } else { "no material is cut out by alpha" },
        ));
        flags
    }

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let count = faces::count(context.traits);
        if count > MAX_FACES {
            return Err(PortError::new(format!("the scene's lights take {count} faces; a texture array has at most {MAX_FACES}"))
                .help("a point light, or a spot wider than 65 degrees, takes six faces: use fewer of them, or narrower spots"));
        }
        let flags = SurfaceFlags { emissive: false, ..SurfaceFlags::of(context.traits) };
        Ok(OutputsShapes { rsm: ReflectiveShadowMapShape { resolution: context.params.resolution, faces: count as u32, flags } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let flags = context.outputs.rsm.flags;
        let target = |on: bool, format: wgpu::TextureFormat| on.then_some(wgpu::ColorTargetState::from(format));
        let pipeline = context.gpu.raster_pipeline(&RasterDescription {
            label: context.name,
            source: Source { path: "crates/rsm/src/rsm.wgsl", text: include_str!("rsm.wgsl") },
            vertex_entry: "vertex",
            fragment_entry: Some("fragment"),
            flags: context.flags,
            vertex_buffers: &[GpuScene::vertex_layout()],
            targets: &[
                target(true, SurfaceFormats::CORE),
                target(flags.specular, SurfaceFormats::SPECULAR),
                target(flags.normal_map, SurfaceFormats::GEOMETRIC_NORMAL),
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
        let bytes = faces::bytes(&context.world.scene);
        let described = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("described faces"),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        context.gpu.queue().write_buffer(&described, 0, &bytes);
        Ok(Self { pipeline, described, version: context.world.scene.geometry_version() })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let out = &outputs.rsm;
        let lights: Vec<_> = faces::all(&context.world.scene).iter().map(|face| (face.light, face.first_face)).collect();
        let mut faces = Vec::new();
        for (index, (light, first)) in lights.into_iter().enumerate() {
            let layer = index as u32;
            let drawn = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("drawn face"),
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            context.gpu.queue().write_buffer(&drawn, 0, bytemuck::cast_slice(&[layer, 0, 0, 0]));
            let group = self
                .pipeline
                .bindings(0)
                .buffer("faces", &out.faces)
                .raw_buffer("instances", &context.world.instances)
                .raw_buffer("drawn_face", &drawn)
                .build(context.gpu)?;
            let colors = [Some(&out.core), out.specular.as_ref(), out.geometric_normal.as_ref()];
            faces.push(Face {
                group,
                depth: out.depth.layer_view(layer, 0),
                colors: colors.map(|part| part.map(|part| part.layer_view(layer, 0))),
                label: format!("light {light}, face {}", layer - first),
            });
        }
        Ok(Bindings { faces, descriptions: out.faces.buffer().clone() })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let version = world.scene.geometry_version();
        if version != self.version {
            frame.write_buffer(&self.described, &faces::bytes(&world.scene));
            self.version = version;
        }
        frame.encoder().copy_buffer_to_buffer(&self.described, 0, &bindings.descriptions, 0, self.described.size());
        let clear = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        for face in &bindings.faces {
            let colors = face.colors.each_ref().map(|view| {
                view.as_ref().map(|view| wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops: clear })
            });
            let depth = wgpu::RenderPassDepthStencilAttachment {
                view: &face.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            };
            frame.render(&face.label, &colors, Some(depth), |pass| {
                pass.set_pipeline(self.pipeline.raw());
                pass.set_bind_group(0, &face.group, &[]);
                world.draw(pass, 1);
            });
        }
        Ok(())
    }
}
