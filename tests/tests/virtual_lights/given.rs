//! Passes that hand on given words, and what else the tests of this folder share.

use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use lobelia::{
    frame::{
        GBuffer, GBufferShape, LightVisibility, LightVisibilityShape, SceneWorld, SurfaceFlags, SurfaceFormats, VirtualLight,
        VirtualLights, VirtualLightsShape,
    },
    graph::{
        BufferPart, BuildError, CreateContext, DeviceOf, Frame, Gpu, GraphFile, InputShapes, NoPorts, OutputShapes, Params, Pass, Plan,
        PlanContext, PlanOptions, PortError, Ports, Problems, RasterDescription, RasterPipeline, Registry, RunError, RunOptions, Runner,
        Specialisation, TexturePart,
    },
    scene::{Camera, Scene, device::GpuScene, device::ViewUniform},
    shaders::Source,
};
use lobelia_lobes::octahedral::{octahedral_decode, octahedral_encode};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub const EXTENT: [u32; 2] = [32, 24];
pub const PIXELS: usize = (EXTENT[0] * EXTENT[1]) as usize;

/// A pixel as the G-buffer holds it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Pixel {
    pub depth: f32,
    pub core: [u32; 2],
    pub specular: u32,
    pub geometric_normal: u32,
}

/// What the `given-...` passes of the next run hand on. Parameters are too small for it.
#[derive(Clone, Debug, Default)]
pub struct Given {
    pub pixels: Vec<Pixel>,
    pub lights: Vec<VirtualLight>,
    /// Words in the order of one chunk.
    pub visibility: Vec<u32>,
}

static GIVEN: Mutex<Option<Given>> = Mutex::new(None);

fn given() -> Given {
    GIVEN.lock().unwrap_or_else(PoisonError::into_inner).clone().unwrap_or_default()
}

/// One device, one test at a time: reading back takes it that nobody else polls meanwhile.
pub fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceParams {
    pub specular: bool,
    pub normal_map: bool,
    /// Added to the width of the picture.
    pub wider: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct LightsParams {
    pub count: u32,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct VisibilityParams {
    pub lights: u32,
    pub interleave: u32,
    /// Added to the width of the picture.
    pub wider: u32,
}

impl Default for VisibilityParams {
    fn default() -> Self {
        Self { lights: 0, interleave: 1, wider: 0 }
    }
}

#[derive(Ports)]
pub struct GBufferOut {
    pub gbuffer: GBuffer,
}

#[derive(Ports)]
pub struct LightsOut {
    pub lights: VirtualLights,
}

#[derive(Ports)]
pub struct VisibilityOut {
    pub visibility: LightVisibility,
}

pub struct GivenGBuffer {
    pipeline: RasterPipeline,
    pixels: wgpu::Buffer,
}

pub struct GivenBindings {
    group: wgpu::BindGroup,
    depth: wgpu::TextureView,
    colors: [Option<wgpu::TextureView>; 3],
}

const GIVEN_WGSL: &str = "
struct Pixel { depth: f32, core_x: u32, core_y: u32, specular: u32, geometric_normal: u32 }
@group(0) @binding(0) var<storage, read> pixels: array<Pixel>;
@vertex fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index % 2u) * 4.0 - 1.0, f32(index / 2u) * 4.0 - 1.0, 0.5, 1.0);
}
struct Targets {
    @builtin(frag_depth) depth: f32,
    @location(0) core: vec2u,
#ifdef SPECULAR
    @location(1) specular: u32,
#endif
#ifdef NORMAL_MAP
    @location(2) geometric_normal: u32,
#endif
}
@fragment fn fragment(@builtin(position) at: vec4f) -> Targets {
    let pixel = pixels[u32(at.y) * 32u + u32(at.x)];
    var out: Targets;
    out.depth = pixel.depth;
    out.core = vec2u(pixel.core_x, pixel.core_y);
#ifdef SPECULAR
    out.specular = pixel.specular;
#endif
#ifdef NORMAL_MAP
    out.geometric_normal = pixel.geometric_normal;
#endif
    return out;
}";

fn surface_flags(params: &SurfaceParams) -> SurfaceFlags {
    SurfaceFlags { specular: params.specular, normal_map: params.normal_map, emissive: false, dielectric: false }
}

impl Pass for GivenGBuffer {
    const NAME: &'static str = "given-gbuffer";
    const DOC: &'static str = "A G-buffer of given words.";
    type World = SceneWorld;
    type Params = SurfaceParams;
    type Inputs = NoPorts;
    type Outputs = GBufferOut;
    type Bindings = GivenBindings;

    fn specialise(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Vec<Specialisation> {
        surface_flags(context.params).specialisations()
    }

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let extent = [context.extent[0] + context.params.wider, context.extent[1]];
        Ok(GBufferOutShapes { gbuffer: GBufferShape { extent, flags: surface_flags(context.params) } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let flags = surface_flags(context.params);
        let target = |on: bool, format: wgpu::TextureFormat| on.then_some(wgpu::ColorTargetState::from(format));
        let pipeline = context.gpu.raster_pipeline(&RasterDescription {
            label: context.name,
            source: Source { path: "given.wgsl", text: GIVEN_WGSL },
            vertex_entry: "vertex",
            fragment_entry: Some("fragment"),
            flags: context.flags,
            vertex_buffers: &[],
            targets: &[
                target(true, SurfaceFormats::CORE),
                target(flags.specular, SurfaceFormats::specular(flags)),
                target(flags.normal_map, SurfaceFormats::GEOMETRIC_NORMAL),
            ],
            depth: Some(wgpu::DepthStencilState {
                format: SurfaceFormats::DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            primitive: wgpu::PrimitiveState::default(),
            layouts: &[],
        })?;
        Ok(Self { pipeline, pixels: uploaded(context.gpu, bytemuck::cast_slice(&given().pixels)) })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &GBufferOut) -> Result<GivenBindings, BuildError> {
        let out = &outputs.gbuffer;
        let group = self.pipeline.bindings(0).raw_buffer("pixels", &self.pixels).build(context.gpu)?;
        let view = |part: &Option<TexturePart>| part.as_ref().map(|part| part.view().clone());
        let colors = [Some(out.core.view().clone()), view(&out.specular), view(&out.geometric_normal)];
        Ok(GivenBindings { group, depth: out.depth.view().clone(), colors })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &GivenBindings) -> Result<(), RunError> {
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        let attachment = |view| wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops };
        let colors = bindings.colors.each_ref().map(|view| view.as_ref().map(attachment));
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &bindings.depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        frame.render("given pixels", &colors, Some(depth), |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            pass.draw(0..3, 0..1);
        });
        Ok(())
    }
}

fn uploaded(gpu: &Gpu, bytes: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
    let size = (bytes.len() as u64).max(16);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor { label: Some("given"), size, usage, mapped_at_creation: false });
    gpu.queue().write_buffer(&buffer, 0, bytes);
    buffer
}

fn copy(frame: &mut Frame<'_>, from: &wgpu::Buffer, to: &BufferPart) {
    let bytes = from.size().min(to.buffer().size());
    frame.encoder().copy_buffer_to_buffer(from, 0, to.buffer(), 0, bytes);
}

pub struct GivenLights(wgpu::Buffer);

impl Pass for GivenLights {
    const NAME: &'static str = "given-lights";
    const DOC: &'static str = "Given virtual lights.";
    type World = SceneWorld;
    type Params = LightsParams;
    type Inputs = NoPorts;
    type Outputs = LightsOut;
    type Bindings = BufferPart;

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(LightsOutShapes { lights: VirtualLightsShape { count: context.params.count, specular: true, lobes: false } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let mut bytes = encase::StorageBuffer::new(Vec::<u8>::new());
        bytes.write(&given().lights).unwrap();
        Ok(Self(uploaded(context.gpu, bytes.as_ref())))
    }

    fn bind(&self, _: &CreateContext<'_, Self>, _: &NoPorts, outputs: &LightsOut) -> Result<BufferPart, BuildError> {
        Ok(outputs.lights.lights.clone())
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, to: &BufferPart) -> Result<(), RunError> {
        copy(frame, &self.0, to);
        Ok(())
    }
}

pub struct GivenVisibility(wgpu::Buffer);

impl Pass for GivenVisibility {
    const NAME: &'static str = "given-visibility";
    const DOC: &'static str = "Given visibility, one chunk.";
    type World = SceneWorld;
    type Params = VisibilityParams;
    type Inputs = NoPorts;
    type Outputs = VisibilityOut;
    type Bindings = BufferPart;

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let VisibilityParams { lights, interleave, wider } = *context.params;
        let extent = [context.extent[0] + wider, context.extent[1]];
        Ok(VisibilityOutShapes { visibility: LightVisibilityShape { extent, lights, interleave } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        Ok(Self(uploaded(context.gpu, bytemuck::cast_slice(&given().visibility))))
    }

    fn bind(&self, _: &CreateContext<'_, Self>, _: &NoPorts, outputs: &VisibilityOut) -> Result<BufferPart, BuildError> {
        Ok(outputs.visibility.chunks[0].clone())
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, to: &BufferPart) -> Result<(), RunError> {
        copy(frame, &self.0, to);
        Ok(())
    }
}

pub fn registry() -> Registry<SceneWorld> {
    let mut registry = lobelia::registry();
    registry.add::<GivenGBuffer>().add::<GivenLights>().add::<GivenVisibility>();
    registry
}

pub fn plan(text: &str, scene: &Scene, keep: &[&str]) -> Result<Plan<SceneWorld>, Problems> {
    let wired = GraphFile::parse(text, "test.ron")?.wire(&registry(), &[], &[])?;
    wired.plan(&scene.traits(), &PlanOptions { keep: keep.iter().map(|name| (*name).to_owned()).collect(), ..PlanOptions::new(EXTENT) })
}

/// Runs a graph once with the safety net up.
pub fn run(gpu: &Gpu, text: &str, scene: &Scene, given: &Given, keep: &[&str], seed: u32) -> Result<Runner<SceneWorld>, RunError> {
    *GIVEN.lock().unwrap_or_else(PoisonError::into_inner) = Some(given.clone());
    let plan = plan(text, scene, keep).unwrap();
    let device = GpuScene::new(gpu.device(), gpu.queue(), Arc::new(scene.clone())).unwrap();
    device.set_view(gpu.queue(), &view(scene));
    let mut runner = Runner::new(gpu, plan, &device, RunOptions { check: true, ..RunOptions::default() })?;
    runner.run(gpu, &device, seed, &mut |_, _| true)?;
    Ok(runner)
}

/// A camera that looks along -Z from the middle of scene space.
pub fn view(scene: &Scene) -> ViewUniform {
    let origin = scene.origin();
    let camera = Camera::look_at("test", origin, origin - DVec3::Z, DVec3::Y, 1.0, 0.01).unwrap();
    ViewUniform::new(&camera, origin, EXTENT, Vec2::ZERO, 0, 0, None)
}

/// Scene-space position of a pixel.
pub fn position(view: &ViewUniform, index: usize, depth: f32) -> DVec3 {
    let [width, height] = EXTENT.map(f64::from);
    let (x, y) = (index as u32 % EXTENT[0], index as u32 / EXTENT[0]);
    let ndc = DVec2::new(2.0 * (f64::from(x) + 0.5) / width - 1.0, 1.0 - 2.0 * (f64::from(y) + 0.5) / height);
    let ray = view.forward.as_dvec3() + view.right.as_dvec3() * ndc.x + view.up.as_dvec3() * ndc.y;
    view.position.as_dvec3() + ray * (f64::from(view.near) / f64::from(depth))
}

/// Repeatable random numbers in [0, 1).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (std::f64::consts::TAU * self.next()).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cosine, radius * sine, z)
    }

    /// Base colour and specular word of any material, none of the sharpest.
    pub fn material(&mut self) -> (u32, u32) {
        let unorm = |value: f64, most: f64| (value * most).round() as u32;
        let color = unorm(self.next(), 2047.0) | (unorm(self.next(), 2047.0) << 11) | (unorm(self.next(), 1023.0) << 22);
        let roughness = [0.15, 0.25, 0.5, 0.8, 1.0][(self.next() * 5.0) as usize];
        let share = |value: f64| if value < 0.3 { 0.0 } else { value };
        let specular = unorm(roughness, 65535.0) | (unorm(share(self.next()), 255.0) << 16) | (unorm(share(self.next()), 255.0) << 24);
        (color, specular)
    }

    pub fn word(&mut self) -> u32 {
        (self.next() * 4_294_967_296.0) as u32
    }
}

pub fn pack_unit(direction: DVec3) -> u32 {
    let snorm = |value: f64| u32::from((value * 32767.0).round() as i16 as u16);
    let p = octahedral_encode(direction);
    snorm(p.x) | (snorm(p.y) << 16)
}

pub fn unpack_unit(word: u32) -> DVec3 {
    let snorm = |bits: u32| f64::from(bits as u16 as i16).max(-32767.0) / 32767.0;
    octahedral_decode(DVec2::new(snorm(word), snorm(word >> 16)))
}

/// A light that faces `towards` and is lit from there, more or less.
pub fn light(random: &mut Random, position: DVec3, towards: DVec3) -> VirtualLight {
    let normal = (towards + random.direction() * 0.5).normalize();
    let (color, specular) = random.material();
    VirtualLight {
        position: position.as_vec3(),
        radius: 0.0,
        flux: Vec3::new(random.next() as f32, random.next() as f32, random.next() as f32) * 3.0,
        geometric_normal: pack_unit((normal + random.direction() * 0.2).normalize()),
        direction_to_source: (normal + random.direction() * 0.7).normalize().as_vec3(),
        specular,
        core: UVec2::new(pack_unit(normal), color),
        source: 0,
    }
}
