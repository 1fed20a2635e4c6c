//! Direct light on surfaces that no scene has: every pixel its own material, normal and distance, held against an evaluation in f64.
#![allow(clippy::unwrap_used)]

use glam::{DVec2, DVec3, Vec2, Vec3};
use lobelia_frame::{GBuffer, GBufferShape, SceneWorld, SurfaceFlags, SurfaceFormats};
use lobelia_graph::{
    BuildError, CreateContext, DeviceOf, Frame, Gpu, GraphFile, InputShapes, NoPorts, OutputShapes, Params, Pass, PlanContext, PlanOptions,
    PortError, Ports, RasterDescription, RasterPipeline, Registry, RunError, RunOptions, Runner, testing::gpu,
};
use lobelia_lobes::{
    brdf::{Brdf, Distribution},
    light::spot_falloff,
    octahedral::{octahedral_decode, octahedral_encode},
};
use lobelia_scene::{
    Camera, LightKind, Ndf, PunctualLight, Scene,
    device::{GpuScene, ViewUniform},
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, PoisonError};

const EXTENT: [u32; 2] = [64, 48];

/// A pixel as the G-buffer holds it: bits of depth, core, specular, geometric normal.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct Pixel {
    depth: f32,
    core: [u32; 2],
    specular: u32,
    geometric_normal: u32,
}

/// What the next `given` pass draws. Parameters are too small for it.
static GIVEN: Mutex<Vec<Pixel>> = Mutex::new(Vec::new());

/// Draws [`GIVEN`] into a G-buffer.
struct GivenPass {
    pipeline: RasterPipeline,
    pixels: wgpu::Buffer,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
struct GivenParams {
    /// Whether there is a specular part.
    specular: bool,
    /// Whether there is a geometric normal of its own.
    normal_map: bool,
}

#[derive(Ports)]
struct GivenOutputs {
    /// What was given.
    gbuffer: GBuffer,
}

struct GivenBindings {
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
    let pixel = pixels[u32(at.y) * 64u + u32(at.x)];
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

impl Pass for GivenPass {
    const NAME: &'static str = "given";
    const DOC: &'static str = "A G-buffer of given words.";
    type World = SceneWorld;
    type Params = GivenParams;
    type Inputs = NoPorts;
    type Outputs = GivenOutputs;
    type Bindings = GivenBindings;

    fn specialise(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Vec<lobelia_graph::Specialisation> {
        flags(context.params).specialisations()
    }

    fn shape(context: &PlanContext<'_, Self>, _: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(GivenOutputsShapes { gbuffer: GBufferShape { extent: context.extent, flags: flags(context.params) } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let flags = flags(context.params);
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
        let given = GIVEN.lock().unwrap_or_else(PoisonError::into_inner);
        let pixels = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("given"),
            size: std::mem::size_of_val(&given[..]) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        context.gpu.queue().write_buffer(&pixels, 0, bytemuck::cast_slice(&given));
        Ok(Self { pipeline, pixels })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, _: &NoPorts, outputs: &GivenOutputs) -> Result<GivenBindings, BuildError> {
        let out = &outputs.gbuffer;
        let group = self.pipeline.bindings(0).raw_buffer("pixels", &self.pixels).build(context.gpu)?;
        let view = |part: &Option<lobelia_graph::TexturePart>| part.as_ref().map(|part| part.view().clone());
        let colors = [Some(out.core.view().clone()), view(&out.specular), view(&out.geometric_normal)];
        Ok(GivenBindings { group, depth: out.depth.view().clone(), colors })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &GivenBindings) -> Result<(), RunError> {
        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
        let colors = bindings
            .colors
            .each_ref()
            .map(|view| view.as_ref().map(|view| wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }));
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

fn flags(params: &GivenParams) -> SurfaceFlags {
    SurfaceFlags { specular: params.specular, normal_map: params.normal_map, emissive: false, dielectric: false }
}

/// Repeatable random numbers in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(&mut self) -> DVec3 {
        let z = 2.0 * self.next() - 1.0;
        let (sine, cosine) = (std::f64::consts::TAU * self.next()).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        DVec3::new(radius * cosine, radius * sine, z)
    }
}

fn pack_unit(direction: DVec3) -> u32 {
    let snorm = |value: f64| u32::from((value * 32767.0).round() as i16 as u16);
    let p = octahedral_encode(direction);
    snorm(p.x) | (snorm(p.y) << 16)
}

fn unpack_unit(word: u32) -> DVec3 {
    let snorm = |bits: u32| f64::from(bits as u16 as i16).max(-32767.0) / 32767.0;
    octahedral_decode(DVec2::new(snorm(word), snorm(word >> 16)))
}

/// Lights under a camera that looks along -Z from the middle of scene space.
struct Case {
    scene: Scene,
    camera: Camera,
    specular: bool,
    normal_map: bool,
}

impl Case {
    fn new(lights: &[(LightKind, DVec3, DVec3, Vec3)], ndf: Ndf, specular: bool, normal_map: bool) -> Self {
        let mut scene = Scene::load("builtin:cornell-diffuse").unwrap();
        let (template, origin) = (scene.lights[0].clone(), scene.origin());
        let light = |(kind, at, direction, intensity): &(LightKind, DVec3, DVec3, Vec3)| {
            let mut light = template.clone();
            (light.kind, light.position, light.direction, light.intensity) = (*kind, origin + *at, direction.normalize(), *intensity);
            light
        };
        scene.lights = lights.iter().map(light).collect();
        scene.ndf = ndf;
        let camera = Camera::look_at("test", origin, origin - DVec3::Z, DVec3::Y, 1.0, 0.01).unwrap();
        Self { scene, camera, specular, normal_map }
    }

    fn view(&self) -> ViewUniform {
        ViewUniform::new(&self.camera, self.scene.origin(), EXTENT, Vec2::ZERO, 0, 0, None)
    }

    fn position(&self, index: usize, depth: f32) -> DVec3 {
        let (view, [width, height]) = (self.view(), EXTENT.map(f64::from));
        let (x, y) = (index as u32 % EXTENT[0], index as u32 / EXTENT[0]);
        let ndc = DVec2::new(2.0 * (f64::from(x) + 0.5) / width - 1.0, 1.0 - 2.0 * (f64::from(y) + 0.5) / height);
        let ray = view.forward.as_dvec3() + view.right.as_dvec3() * ndc.x + view.up.as_dvec3() * ndc.y;
        view.position.as_dvec3() + ray * (f64::from(view.near) / f64::from(depth))
    }

    /// Unit direction to a light, and irradiance on a surface that faces it.
    fn incident(&self, light: &PunctualLight, position: DVec3) -> (DVec3, DVec3) {
        // As the device has them.
        let direction = light.direction.as_vec3().as_dvec3();
        if light.kind == LightKind::Directional {
            return (-direction, light.intensity.as_dvec3());
        }
        let to_light = (light.position - self.scene.origin()).as_vec3().as_dvec3() - position;
        let l = to_light.normalize_or(-direction);
        let falloff = match light.kind {
            LightKind::Spot { inner, outer } => spot_falloff((-l).dot(direction), inner.into(), outer.into()),
            _ => 1.0,
        };
        (l, light.intensity.as_dvec3() * falloff / to_light.length_squared().max(1e-10))
    }

    /// A G-buffer whose normals often lie where the first light's lobe is.
    fn pixels(&self, random: &mut Random) -> Vec<Pixel> {
        let pixel = |index: usize| {
            let depth = (f64::from(self.view().near) / (0.5 + 5.5 * random.next())) as f32;
            let position = self.position(index, depth);
            let roughness = [0.0, 0.02, 0.1, 0.35, 0.7, 1.0][(random.next() * 6.0) as usize];
            let (l, _) = self.incident(&self.scene.lights[0], position);
            let half = (l - position.normalize()).normalize_or(DVec3::Z);
            let lobe: f64 = 2.0 * f64::max(roughness * roughness, 0.001) * random.next();
            let normal = if random.next() < 0.7 { (half + random.direction() * lobe).normalize() } else { random.direction() };
            let geometric = if random.next() < 0.7 { (normal + random.direction() * 0.7).normalize() } else { random.direction() };
            let unorm = |value: f64, most: f64| (value * most).round() as u32;
            let mut share = || if random.next() < 0.3 { random.next().round() } else { random.next() };
            let color = unorm(share(), 2047.0) | (unorm(share(), 2047.0) << 11) | (unorm(share(), 1023.0) << 22);
            let specular = unorm(roughness, 65535.0) | (unorm(share(), 255.0) << 16) | (unorm(share(), 255.0) << 24);
            Pixel { depth, core: [pack_unit(normal), color], specular, geometric_normal: pack_unit(geometric) }
        };
        (0..(EXTENT[0] * EXTENT[1]) as usize).map(pixel).collect()
    }

    /// Radiance in f64, and alpha. `None` where a rounding decides on which side of a surface a direction is.
    fn expected(&self, index: usize, pixel: &Pixel) -> Option<(DVec3, f64)> {
        let normal = unpack_unit(pixel.core[0]);
        let geometric = if self.normal_map { unpack_unit(pixel.geometric_normal) } else { normal };
        let color = pixel.core[1];
        let root = DVec3::new(f64::from(color & 2047) / 2047.0, f64::from((color >> 11) & 2047) / 2047.0, f64::from(color >> 22) / 1023.0);
        let word = pixel.specular;
        let [roughness, metallic, specular] = match self.specular {
            true => [f64::from(word & 0xffff) / 65535.0, f64::from((word >> 16) & 255) / 255.0, f64::from(word >> 24) / 255.0],
            false => [1.0, 0.0, 0.0],
        };
        let distribution = if self.scene.ndf == Ndf::Phong { Distribution::Phong } else { Distribution::Ggx };
        let brdf = Brdf::new(root * root, metallic, roughness, specular, distribution);
        let position = self.position(index, pixel.depth);
        let v = -position.normalize();
        let mut total = DVec3::ZERO;
        for light in &self.scene.lights {
            let (l, irradiance) = self.incident(light, position);
            let sides = [normal.dot(l), normal.dot(v), geometric.dot(l), geometric.dot(v)];
            if sides.iter().any(|cosine| cosine.abs() < 1e-4) {
                return None;
            }
            if sides[2] * sides[3] > 0.0 {
                total += brdf.evaluate(normal, l, v) * irradiance * sides[0].max(0.0);
            }
        }
        Some((total.min(DVec3::splat(65504.0)), brdf.alpha))
    }

    /// Runs `direct` on a G-buffer with the safety net up.
    fn render(&self, gpu: &Gpu, pixels: &[Pixel]) -> Vec<DVec3> {
        // One device, one test at a time: reading back takes it that nobody else polls meanwhile.
        static TURN: Mutex<()> = Mutex::new(());
        let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        *GIVEN.lock().unwrap_or_else(PoisonError::into_inner) = pixels.to_vec();
        let mut registry = Registry::new();
        registry.add::<GivenPass>();
        lobelia_direct::register(&mut registry);
        let (specular, normal_map) = (self.specular, self.normal_map);
        let text = format!(
            r#"(passes: {{"given": given(specular: {specular}, normal_map: {normal_map}), "direct": direct()}}, output: "direct.radiance")"#
        );
        let wired = GraphFile::parse(&text, "test.ron").unwrap().wire(&registry, &[], &[]).unwrap();
        let plan = wired.plan(&self.scene.traits(), &PlanOptions::new(EXTENT)).unwrap();
        let device = GpuScene::new(gpu.device(), gpu.queue(), Arc::new(self.scene.clone())).unwrap();
        device.set_view(gpu.queue(), &self.view());
        let mut runner = Runner::new(gpu, plan, &device, RunOptions { check: true, ..RunOptions::default() }).unwrap();
        runner.run(gpu, &device, 0, &mut |_, _| true).unwrap();
        let image = runner.read_image(gpu, "direct.radiance").unwrap().to_f32_rgba();
        image.into_iter().map(|[r, g, b, _]| DVec3::new(r.into(), g.into(), b.into())).collect()
    }
}

const POINT: (LightKind, DVec3, DVec3, Vec3) = (LightKind::Point, DVec3::new(0.4, 3.0, 1.0), DVec3::NEG_Y, Vec3::new(20.0, 5.0, 80.0));
const SPOT: (LightKind, DVec3, DVec3, Vec3) =
    (LightKind::Spot { inner: 0.2, outer: 0.7 }, DVec3::new(-1.0, 2.0, 1.5), DVec3::new(0.4, -0.5, -1.0), Vec3::new(90.0, 40.0, 10.0));
const SUN: (LightKind, DVec3, DVec3, Vec3) = (LightKind::Directional, DVec3::ZERO, DVec3::new(0.5, -0.7, -0.2), Vec3::new(3.0, 2.0, 1.0));

/// Largest relative error of smooth (alpha >= 0.01) and of sharp lobes, in units of 1 + an absolute error of 2e-7, half a step of the smallest halves.
fn worst(case: &Case, pixels: &[Pixel], found: &[DVec3]) -> [f64; 2] {
    let (mut worst, mut counted, mut lit) = ([0.0f64; 2], 0, 0);
    for (index, pixel) in pixels.iter().enumerate() {
        let Some((expected, alpha)) = case.expected(index, pixel) else { continue };
        counted += 1;
        lit += u32::from(expected.max_element() > 1e-3);
        for channel in 0..3 {
            let excess = ((found[index][channel] - expected[channel]).abs() - 2e-7).max(0.0);
            let error = if excess == 0.0 { 0.0 } else { excess / expected[channel] };
            let class = usize::from(alpha < 0.01);
            worst[class] = worst[class].max(if error.is_nan() { f64::INFINITY } else { error });
        }
    }
    assert!(counted > pixels.len() * 9 / 10 && lit > 200, "{counted} pixels say something, {lit} of them are lit");
    worst
}

#[test]
fn every_kind_of_light_is_that_of_the_formula() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(7);
    let mut overall = [0.0f64; 2];
    for lights in [&[POINT][..], &[SPOT], &[SUN], &[SUN, SPOT, POINT]] {
        for ndf in [Ndf::Ggx, Ndf::Phong] {
            for (specular, normal_map) in [(true, true), (true, false), (false, true), (false, false)] {
                let case = Case::new(lights, ndf, specular, normal_map);
                let pixels = case.pixels(&mut random);
                let found = worst(&case, &pixels, &case.render(gpu, &pixels));
                overall = [overall[0].max(found[0]), overall[1].max(found[1])];
            }
        }
    }
    println!("relative errors: {:.1e} for alpha >= 0.01, {:.1e} for the sharpest lobes", overall[0], overall[1]);
    // Half floats are exact to 4.9e-4. Sharp lobes magnify the rounding of directions by 1/alpha.
    assert!(overall[0] < 2e-3 && overall[1] < 5e-3, "{overall:?}");
}

#[test]
fn a_wrong_formula_is_seen() {
    let Some(gpu) = gpu() else { return };
    let case = Case::new(&[SPOT], Ndf::Ggx, true, true);
    let pixels = case.pixels(&mut Random(11));
    let found = case.render(gpu, &pixels);
    let wrong = |case: Case| worst(&case, &pixels, &found)[0];
    assert!(wrong(Case::new(&[SPOT], Ndf::Phong, true, true)) > 0.1, "another distribution");
    assert!(wrong(Case::new(&[SPOT], Ndf::Ggx, true, false)) > 0.1, "no test of sides");
    let wider = (LightKind::Spot { inner: 0.2, outer: 0.71 }, SPOT.1, SPOT.2, SPOT.3);
    assert!(wrong(Case::new(&[wider], Ndf::Ggx, true, true)) > 0.01, "another falloff");
}

#[test]
fn a_spot_lights_nothing_behind_it() {
    let Some(gpu) = gpu() else { return };
    let away = (SPOT.0, DVec3::ZERO, DVec3::Z, SPOT.3);
    let case = Case::new(&[away], Ndf::Ggx, true, false);
    let pixels = case.pixels(&mut Random(3));
    assert!(case.render(gpu, &pixels).iter().all(|radiance| *radiance == DVec3::ZERO));
}

/// What is not there reflects nothing.
#[test]
fn nothing_is_black() {
    let Some(gpu) = gpu() else { return };
    let case = Case::new(&[POINT, SUN], Ndf::Ggx, true, true);
    let mut pixels = case.pixels(&mut Random(5));
    for pixel in &mut pixels {
        pixel.depth = 0.0;
    }
    assert!(case.render(gpu, &pixels).iter().all(|radiance| *radiance == DVec3::ZERO));
}

/// Any bits in the packed words, lights anywhere and of any strength: the safety net in [`Case::render`] finds nothing that must not be.
#[test]
fn extremes_stay_finite() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(13);
    for round in 0..24 {
        let intensity = Vec3::splat([1e30, 3e38, 1e-30, 1.0][round % 4]) * Vec3::new(1.0, 0.0, 0.5);
        let kind = match round % 5 {
            0 => LightKind::Point,
            1 => LightKind::Directional,
            2 => LightKind::Spot { inner: 0.0, outer: 0.0 },
            3 => LightKind::Spot { inner: 1.5, outer: std::f32::consts::FRAC_PI_2 },
            _ => LightKind::Spot { inner: 0.3, outer: 0.3 },
        };
        let ndf = if round % 2 == 0 { Ndf::Ggx } else { Ndf::Phong };
        let mut case = Case::new(
            &[(kind, DVec3::ZERO, random.direction(), intensity), (kind, random.direction() * 1e9, random.direction(), intensity)],
            ndf,
            true,
            true,
        );
        let bits = |random: &mut Random| (random.next() * 4294967296.0) as u32;
        let mut pixels: Vec<Pixel> = (0..EXTENT[0] * EXTENT[1])
            .map(|_| Pixel {
                depth: 10f64.powf(-11.0 * random.next()) as f32,
                core: [bits(&mut random), bits(&mut random)],
                specular: bits(&mut random),
                geometric_normal: bits(&mut random),
            })
            .collect();
        // The first light stands in the surface of one pixel, whose normal is that of a mirror towards it.
        let at = 1000;
        pixels[at].depth = 0.01;
        case.scene.lights[0].position = case.scene.origin() + case.position(at, pixels[at].depth);
        pixels[at].core[0] = pack_unit(DVec3::Z);
        for (index, radiance) in case.render(gpu, &pixels).into_iter().enumerate() {
            assert!(radiance.is_finite() && radiance.min_element() >= 0.0, "{radiance}");
            // Infinity times nothing must not become light.
            let position = case.position(index, pixels[index].depth);
            let turned_away = unpack_unit(pixels[index].core[0]).dot(position.normalize()) > 1e-3;
            assert!(!turned_away || radiance == DVec3::ZERO, "a surface that is turned away shines: {radiance}");
        }
    }
}
