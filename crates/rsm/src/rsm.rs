//! The `rsm` pass.

use crate::faces::{self, Layout};
use lobelia_frame::{MAX_LAYERS, ReflectiveShadowMap, ReflectiveShadowMapShape, SceneWorld, SurfaceFlags, SurfaceFormats};
use lobelia_graph::{
    BuildError, CreateContext, DeviceOf, Frame, InputShapes, Need, NoPorts, OutputShapes, Pass, PlanContext, PortError, Ports,
    RasterDescription, RasterPipeline, RunError, Specialisation, TraitsOf,
};
use lobelia_scene::{CoarseLight, device::ViewUniform};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Draws the scene from every punctual light.
pub struct RsmPass {
    pipeline: RasterPipeline,
    /// The faces of the scene as it was at `version`. They are copied into the output in its place among the frame's commands: a direct write
    /// would come before all of them, and another resource may still be using the memory then.
    described: wgpu::Buffer,
    layout: Layout,
    /// The scene, and, where it matters, the camera that the faces are of.
    version: u64,
    camera: Option<ViewUniform>,
}

/// Parameters of `rsm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Side of each square face. Shadow edges are sharp to one texel; memory and the cost of choosing virtual lights grow with its square. Where all faces
    /// together would have more than 64 Mi texels, or are more than 256 and have more than 24 Mi, every face is smaller, with a word.
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

/// Group of one face, and its first texel.
struct Face {
    group: wgpu::BindGroup,
    corner: [u32; 2],
}

/// Views of one layer, and what is drawn there.
struct Layer {
    faces: Vec<Face>,
    depth: wgpu::TextureView,
    colors: [Option<wgpu::TextureView>; 3],
    label: String,
}

/// Every layer, and the output that describes the faces.
pub struct Bindings {
    layers: Vec<Layer>,
    descriptions: wgpu::Buffer,
}

/// Most texels of all faces that have as many as was asked for: about 1 GiB with specular lobes.
const MOST_TEXELS: u64 = 1 << 26;

/// Most texels of all faces that have fewer: their averages (`patch-moments`) fit one storage binding of the WebGPU baseline.
const REDUCED_TEXELS: u64 = 24 << 20;

/// Least side of a face.
const LEAST_RESOLUTION: u32 = 16;

/// Side of each of so many faces; `None` if they are too many.
fn resolution(asked: u32, faces: u64) -> Option<u32> {
    let texels = |side: u32| u64::from(side).pow(2) * faces;
    let most = if faces <= u64::from(MAX_LAYERS) { MOST_TEXELS } else { REDUCED_TEXELS };
    if texels(asked) <= most {
        return Some(asked);
    }
    let mut side = 4096;
    while texels(side) > REDUCED_TEXELS {
        side /= 2;
    }
    (side >= LEAST_RESOLUTION).then_some(side.min(asked))
}

/// A light whose map shows less than this many texels of what a camera sees is one that cannot be resolved.
const FEWEST_TEXELS: f64 = 32.0;

impl Pass for RsmPass {
    const NAME: &'static str = "rsm";
    const DOC: &'static str = "Draws what every punctual light sees: a reflective shadow map.\n\
        Dachsbacher and Stamminger 2005. Depth, normals and material of the patch behind each texel; one square face for spots and directional lights, \
        six for points and for spots wider than 65 degrees; several nested ones for directional lights where cameras see a small part of a large scene. Serves as the shadow map of direct light and as the store that virtual lights are picked from.";
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
        flags.extend(SurfaceFlags::drawing(context.traits));
        flags
    }

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let count = faces::count(context.traits);
        let Some(resolution) = resolution(context.params.resolution, count as u64) else {
            let most = REDUCED_TEXELS / u64::from(LEAST_RESOLUTION).pow(2);
            return Err(PortError::new(format!("the scene's lights take {count} faces; at most {most} can be drawn"))
                .help("a point light, or a spot wider than 65 degrees, takes six faces: use fewer of them, or narrower spots; without this pass nothing casts shadows"));
        };
        let flags = SurfaceFlags { emissive: false, ..SurfaceFlags::of(context.traits) };
        Ok(OutputsShapes { rsm: ReflectiveShadowMapShape { resolution, faces: count as u32, flags } })
    }

    fn warnings(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Vec<String> {
        let asked = context.params.resolution;
        let count = faces::count(context.traits);
        let Some(found) = resolution(asked, count as u64) else { return Vec::new() };
        let mut warnings = Vec::new();
        if found < asked {
            let lights = context.traits.punctual_lights();
            warnings.push(format!(
                "the {lights} lights take {count} faces; each has {found} texels a side instead of {asked}, so that memory and bindings suffice: shadows \
                 are coarser and virtual lights fewer to choose from"
            ));
        }
        let texel = |light: &CoarseLight| light.face_width / f64::from(found);
        let coarse: Vec<&CoarseLight> =
            context.traits.coarse_lights.iter().filter(|light| light.sight_width < FEWEST_TEXELS * texel(light)).collect();
        if let Some(light) = coarse.iter().max_by(|left, right| texel(left).total_cmp(&texel(right))) {
            let others = if coarse.len() > 1 { format!(" (so it is with {} lights)", coarse.len()) } else { String::new() };
            warnings.push(format!(
                "a texel of light `{}` covers {:.3} m where camera `{}` looks, which sees {:.3} m across{others}: shadows and indirect light are not \
                 resolved there; a higher resolution or a narrower cone makes texels smaller",
                light.light,
                texel(light),
                light.camera,
                light.sight_width
            ));
        }
        warnings
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
            vertex_buffers: &context.world.vertex_layouts(),
            targets: &[
                target(true, SurfaceFormats::CORE),
                target(flags.specular, SurfaceFormats::specular(flags)),
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
        let layout = Layout { shape: context.outputs.rsm, directional: context.traits.directional_faces };
        let camera = if layout.directional > 1 { context.world.camera() } else { None };
        let bytes = faces::bytes(&context.world.scene, &layout, camera.as_ref());
        let described = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("described faces"),
            size: bytes.len() as u64,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        context.gpu.queue().write_buffer(&described, 0, &bytes);
        Ok(Self { pipeline, described, layout, version: context.world.scene.geometry_version(), camera })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let out = &outputs.rsm;
        let mut layers: Vec<Layer> = Vec::new();
        for face in 0..out.shape.faces {
            let (layer, corner) = out.shape.place(face);
            let drawn = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("drawn face"),
                size: 16,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            context.gpu.queue().write_buffer(&drawn, 0, bytemuck::cast_slice(&[face, 0, 0, 0]));
            let group = self
                .pipeline
                .bindings(0)
                .buffer("faces", &out.faces)
                .raw_buffer("instances", &context.world.instances)
                .raw_buffer("drawn_face", &drawn)
                .build(context.gpu)?;
            if layers.len() as u32 == layer {
                let colors = [Some(&out.core), out.specular.as_ref(), out.geometric_normal.as_ref()];
                layers.push(Layer {
                    faces: Vec::new(),
                    depth: out.depth.layer_view(layer, 0),
                    colors: colors.map(|part| part.map(|part| part.layer_view(layer, 0))),
                    label: if out.shape.tiles() == 1 { format!("face {face}") } else { format!("faces from {face}") },
                });
            }
            if let Some(last) = layers.last_mut() {
                last.faces.push(Face { group, corner });
            }
        }
        Ok(Bindings { layers, descriptions: out.faces.buffer().clone() })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        let version = world.scene.geometry_version();
        let camera = if self.layout.directional > 1 { world.camera() } else { None };
        if version != self.version || camera != self.camera {
            frame.write_buffer(&self.described, &faces::bytes(&world.scene, &self.layout, camera.as_ref()));
            (self.version, self.camera) = (version, camera);
        }
        frame.encoder().copy_buffer_to_buffer(&self.described, 0, &bindings.descriptions, 0, self.described.size());
        let clear = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        let side = self.layout.shape.resolution;
        for layer in &bindings.layers {
            let colors = layer.colors.each_ref().map(|view| {
                view.as_ref().map(|view| wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops: clear })
            });
            let depth = wgpu::RenderPassDepthStencilAttachment {
                view: &layer.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            };
            frame.render(&layer.label, &colors, Some(depth), |pass| {
                pass.set_pipeline(self.pipeline.raw());
                for Face { group, corner: [x, y] } in &layer.faces {
                    pass.set_viewport(*x as f32, *y as f32, side as f32, side as f32, 0.0, 1.0);
                    pass.set_scissor_rect(*x, *y, side, side);
                    pass.set_bind_group(0, group, &[]);
                    world.draw(pass, 1);
                }
            });
        }
        Ok(())
    }
}
