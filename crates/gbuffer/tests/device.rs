//! Small scenes drawn into a G-buffer, texel by texel.
// A scene has private fields, so it cannot be written in one expression.
#![allow(clippy::unwrap_used, clippy::field_reassign_with_default)]

use glam::{DMat4, DVec2, DVec3, Vec2, Vec3, Vec4};
use lobelia_frame::SceneWorld;
use lobelia_graph::{Gpu, GraphFile, PartData, Plan, PlanOptions, Registry, RunOptions, Runner, TextureData, testing::gpu};
use lobelia_lobes::octahedral::octahedral_decode;
use lobelia_scene::{
    AlphaMode, Camera, Environment, Material, Mesh, Sampler, Scene, Texture, TextureRef,
    device::{GpuScene, ViewUniform},
};
use std::sync::{Arc, Mutex, PoisonError};

const EXTENT: [u32; 2] = [32, 24];

/// Looks along -Z from `at`.
fn camera(at: DVec3) -> Camera {
    Camera::look_at("test", at, at - DVec3::Z, DVec3::Y, 0.8, 0.01).unwrap()
}

/// A square of side 2 about the origin in the XY plane, front to +Z, u to +X, v to -Y.
fn square(material: usize) -> Mesh {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Vec2::from_array);
    Mesh {
        positions: corners.map(|corner| corner.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4],
        uvs: corners.map(|corner| Vec2::new(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y)).to_vec(),
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    }
}

/// Meshes, each placed once.
fn scene(materials: Vec<Material>, placed: Vec<(Mesh, DMat4)>) -> Scene {
    let template = Scene::load("builtin:cornell-diffuse").unwrap().instances[0].clone();
    let mut scene = Scene::default();
    scene.materials = materials;
    for (index, (_, world_from_local)) in placed.iter().enumerate() {
        let mut instance = template.clone();
        (instance.mesh, instance.world_from_local) = (index, *world_from_local);
        scene.instances.push(instance);
    }
    scene.meshes = Arc::new(placed.into_iter().map(|(mesh, _)| mesh).collect());
    scene
}

fn texture(width: u32, rgba: &[[u8; 4]]) -> Texture {
    Texture { name: "test".into(), width, height: rgba.len() as u32 / width, rgba: rgba.concat() }
}

fn nearest(texture: usize) -> Option<TextureRef> {
    Some(TextureRef { texture, sampler: Sampler { nearest: true, ..Sampler::default() }, ..TextureRef::default() })
}

fn plan(scene: &Scene, text: &str) -> Result<Plan<SceneWorld>, String> {
    let mut registry = Registry::new();
    lobelia_gbuffer::register(&mut registry);
    let wired = GraphFile::parse(text, "test.ron").unwrap().wire(&registry, &[], &[]).unwrap();
    wired.plan(&scene.traits(), &PlanOptions::new(EXTENT)).map_err(|problems| problems.to_string())
}

/// The parts of one output after a frame in which poisoned memory and forbidden values would be noticed.
struct Drawn {
    parts: Vec<(String, TextureData)>,
    view: ViewUniform,
}

const GBUFFER: &str = r#"(passes: {"gbuffer": gbuffer()}, output: "gbuffer.gbuffer")"#;
const EMISSION: &str = r#"(passes: {"gbuffer": gbuffer(), "emission": emission()}, output: "emission.radiance")"#;

fn draw(gpu: &Gpu, scene: Scene, camera: &Camera, text: &str) -> Drawn {
    // One device, one test at a time: reading back takes it that nobody else polls meanwhile.
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let plan = plan(&scene, text).unwrap();
    let scene = Arc::new(scene);
    let device = GpuScene::new(gpu.device(), gpu.queue(), scene.clone()).unwrap();
    let view = ViewUniform::new(camera, scene.origin(), EXTENT, Vec2::ZERO, 0, 0, None);
    device.set_view(gpu.queue(), &view);
    let output = plan.resources[plan.output].name.clone();
    let mut runner = Runner::new(gpu, plan, &device, RunOptions { check: true, ..RunOptions::default() }).unwrap();
    runner.run(gpu, &device, 0, &mut |_, _| true).unwrap();
    let parts = runner.read(gpu, &output).unwrap().into_iter().map(|(part, data)| match data {
        PartData::Texture(layers) => (part.name.to_owned(), layers[0].clone()),
        PartData::Buffer(_) => unreachable!("these resources are textures"),
    });
    Drawn { parts: parts.collect(), view }
}

/// A texel in numbers.
#[derive(Debug)]
struct Texel {
    /// Scene space; `None` where nothing is seen.
    position: Option<DVec3>,
    normal: DVec3,
    geometric_normal: Option<DVec3>,
    base_color: DVec3,
    /// Roughness, metallic, specular scale.
    specular: Option<DVec3>,
    emissive: Option<DVec3>,
}

fn unit_vector(word: u32) -> DVec3 {
    let snorm = |bits: u32| f64::from(bits as u16 as i16).max(-32767.0) / 32767.0;
    octahedral_decode(DVec2::new(snorm(word), snorm(word >> 16)))
}

impl Drawn {
    fn find(&self, name: &str) -> Option<&TextureData> {
        self.parts.iter().find(|(part, _)| part == name).map(|(_, data)| data)
    }

    fn texel(&self, x: u32, y: u32) -> Texel {
        let index = (y * EXTENT[0] + x) as usize;
        let word = |name: &str| self.find(name).map(|data| data.to_u32()[index]);
        let core = self.find("core").unwrap().to_u32();
        let depth = f64::from(self.find("depth").unwrap().to_f32_rgba()[index][0]);
        let color = core[2 * index + 1];
        let root = DVec3::new(f64::from(color & 2047) / 2047.0, f64::from((color >> 11) & 2047) / 2047.0, f64::from(color >> 22) / 1023.0);
        let ray = self.ray(x, y);
        Texel {
            position: (depth > 0.0).then(|| self.view.position.as_dvec3() + ray * (f64::from(self.view.near) / depth)),
            normal: unit_vector(core[2 * index]),
            geometric_normal: word("geometric_normal").map(unit_vector),
            base_color: root * root,
            specular: word("specular").map(|word| {
                DVec3::new(f64::from(word & 0xffff) / 65535.0, f64::from((word >> 16) & 255) / 255.0, f64::from(word >> 24) / 255.0)
            }),
            emissive: word("emissive").map(|word| {
                let mantissa = DVec3::new(f64::from(word & 511), f64::from((word >> 9) & 511), f64::from((word >> 18) & 511));
                mantissa * f64::from(word >> 27).exp2() / 24f64.exp2()
            }),
        }
    }

    /// Through the pixel's centre; its part along the view direction is 1.
    fn ray(&self, x: u32, y: u32) -> DVec3 {
        let ndc =
            DVec2::new(2.0 * (f64::from(x) + 0.5) / f64::from(EXTENT[0]) - 1.0, 1.0 - 2.0 * (f64::from(y) + 0.5) / f64::from(EXTENT[1]));
        self.view.forward.as_dvec3() + self.view.right.as_dvec3() * ndc.x + self.view.up.as_dvec3() * ndc.y
    }
}

fn close(found: DVec3, expected: DVec3, tolerance: f64) {
    assert!((found - expected).abs().max_element() <= tolerance, "expected {expected}, found {found}");
}

#[test]
fn targets_that_no_material_needs_are_dropped() {
    let names = |material: Material| {
        let plan = plan(&scene(vec![material], vec![(square(0), DMat4::IDENTITY)]), GBUFFER).unwrap();
        plan.resources[0].parts.iter().map(|part| part.name).collect::<Vec<_>>()
    };
    let plain = Material { specular: 0.0, ..Material::default() };
    assert_eq!(names(plain.clone()), ["depth", "core"]);
    assert_eq!(names(Material::default()), ["depth", "core", "specular"]);
    assert_eq!(names(Material { emissive: Vec3::ONE, ..plain.clone() }), ["depth", "core", "emissive"]);
    assert_eq!(names(Material { normal_texture: nearest(0), ..plain }), ["depth", "core", "geometric_normal"]);
}

#[test]
fn without_emission_the_pass_is_left_out_with_its_reason() {
    let dark = scene(vec![Material::default()], vec![(square(0), DMat4::IDENTITY)]);
    let error = plan(&dark, EMISSION).err().unwrap();
    assert!(error.contains("the scene has no emissive material and no environment map"), "{error}");
}

#[test]
fn a_square_lies_where_it_is_and_has_its_material() {
    let Some(gpu) = gpu() else { return };
    let material = Material {
        base_color: Vec3::new(0.9, 0.25, 0.04),
        roughness: 0.35,
        metallic: 0.6,
        specular: 0.8,
        emissive: Vec3::new(3.0, 0.5, 40.0),
        ..Material::default()
    };
    let slope = DMat4::from_rotation_y(0.5);
    let origin = scene(vec![material.clone()], vec![(square(0), slope)]).origin();
    // The front, the back, and the front again as the back of a mirror image.
    for (placed, turned, front) in [
        (slope, 1.0, true),
        (slope * DMat4::from_rotation_y(std::f64::consts::PI), 1.0, false),
        (slope * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)), 1.0, true),
        (slope * DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0)), 1.0, false),
    ] {
        let drawn = draw(gpu, scene(vec![material.clone()], vec![(square(0), placed)]), &camera(DVec3::new(0.1, 0.0, 2.5)), GBUFFER);
        let normal = slope.transform_vector3(DVec3::Z) * turned;
        for (x, y) in [(16, 12), (13, 9), (20, 16)] {
            let texel = drawn.texel(x, y);
            let ray = drawn.ray(x, y);
            let eye = drawn.view.position.as_dvec3();
            let met = eye + ray * (normal.dot(-origin - eye) / normal.dot(ray));
            close(texel.position.unwrap(), met, 1e-6);
            close(texel.normal, normal, 6e-5);
            close(texel.base_color, DVec3::new(0.9, 0.25, 0.04), 1e-3);
            close(texel.specular.unwrap(), DVec3::new(0.35, 0.6, 0.8), 2e-3);
            let emitted = if front { DVec3::new(3.0, 0.5, 40.0) } else { DVec3::ZERO };
            close(texel.emissive.unwrap(), emitted, 40.0 / 512.0);
            assert!(texel.geometric_normal.is_none());
        }
        assert!(drawn.texel(0, 0).position.is_none());
    }
}

#[test]
fn non_uniform_scale_keeps_normals_perpendicular() {
    let Some(gpu) = gpu() else { return };
    // A slanted square, squeezed: the normal of the squeezed plane, not the squeezed normal.
    let placed = DMat4::from_scale(DVec3::new(1.0, 1.0, 0.2)) * DMat4::from_rotation_y(0.8);
    let drawn = draw(gpu, scene(vec![Material::default()], vec![(square(0), placed)]), &camera(DVec3::new(0.0, 0.0, 2.5)), GBUFFER);
    let edge = placed.transform_vector3(DVec3::X);
    let normal = DVec3::new(-edge.z, 0.0, edge.x).normalize();
    close(drawn.texel(16, 12).normal, normal, 6e-5);
}

#[test]
fn a_normal_map_tilts_the_shading_normal_only() {
    let Some(gpu) = gpu() else { return };
    // x 0.6, y 0.3 before scaling by 0.5.
    let texel = [(0.8f64 * 255.0).round() as u8, (0.65f64 * 255.0).round() as u8, 255, 255];
    let tangent_space = DVec3::new(2.0 * f64::from(texel[0]) / 255.0 - 1.0, 2.0 * f64::from(texel[1]) / 255.0 - 1.0, 1.0);
    let expected = (tangent_space * DVec3::new(0.5, 0.5, 1.0)).normalize();
    // The bitangent is cross(N, T) w; mirroring an instance turns it with the picture on the surface. Seen from behind, both normals turn.
    for (placed, shading, geometric) in [
        (DMat4::IDENTITY, expected, DVec3::Z),
        (DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)), expected * DVec3::new(-1.0, 1.0, 1.0), DVec3::Z),
        (DMat4::from_rotation_y(std::f64::consts::PI), expected * DVec3::new(1.0, -1.0, 1.0), DVec3::Z),
    ] {
        let material = Material { normal_texture: nearest(0), normal_scale: 0.5, ..Material::default() };
        let mut scene = scene(vec![material], vec![(square(0), placed)]);
        scene.textures = Arc::new(vec![texture(1, &[texel])]);
        let drawn = draw(gpu, scene, &camera(DVec3::new(0.0, 0.0, 2.5)), GBUFFER);
        let found = drawn.texel(16, 12);
        close(found.normal, shading, 1e-4);
        close(found.geometric_normal.unwrap(), geometric, 6e-5);
    }
}

#[test]
fn alpha_below_the_cutoff_is_not_there() {
    let Some(gpu) = gpu() else { return };
    let mask = Material { base_color_texture: nearest(0), alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..Material::default() };
    let opaque = Material { alpha_mode: AlphaMode::Opaque, ..mask.clone() };
    for (material, seen) in [(mask, [true, false]), (opaque, [true, true])] {
        let mut scene = scene(vec![material], vec![(square(0), DMat4::IDENTITY)]);
        scene.textures = Arc::new(vec![texture(2, &[[255, 255, 255, 128], [255, 255, 255, 127]])]);
        let drawn = draw(gpu, scene, &camera(DVec3::new(0.0, 0.0, 2.5)), GBUFFER);
        assert_eq!([drawn.texel(10, 12).position.is_some(), drawn.texel(22, 12).position.is_some()], seen);
    }
}

#[test]
fn the_nearer_surface_wins_in_any_order() {
    let Some(gpu) = gpu() else { return };
    let colored = |color: Vec3| Material { base_color: color, ..Material::default() };
    let near = (square(0), DMat4::from_translation(DVec3::new(0.0, 0.0, 1e-4)));
    let far = (square(1), DMat4::IDENTITY);
    for placed in [vec![near.clone(), far.clone()], vec![far, near]] {
        let drawn = draw(gpu, scene(vec![colored(Vec3::X), colored(Vec3::Y)], placed), &camera(DVec3::new(0.0, 0.0, 2.5)), GBUFFER);
        close(drawn.texel(16, 12).base_color, DVec3::X, 1e-3);
    }
}

/// What the documentation says about precision: the same figure at the world's origin and at 10 km.
#[test]
fn positions_are_as_precise_at_ten_kilometres() {
    let Some(gpu) = gpu() else { return };
    let turn = DMat4::from_rotation_y(0.7) * DMat4::from_rotation_x(-0.3);
    let normal = turn.transform_vector3(DVec3::Z);
    // The distance to the plane is what a pixel's position can be held against, whatever rounding moved the pixel's ray.
    let error = |shift: DVec3| {
        let built = scene(vec![Material::default()], vec![(square(0), DMat4::from_translation(shift) * turn)]);
        let origin = built.origin();
        let drawn = draw(gpu, built, &camera(shift + DVec3::new(0.1, 0.05, 2.5)), GBUFFER);
        let mut worst: f64 = 0.0;
        let mut seen = 0;
        for y in 0..EXTENT[1] {
            for x in 0..EXTENT[0] {
                if let Some(position) = drawn.texel(x, y).position {
                    worst = worst.max(normal.dot(position + origin - shift).abs());
                    seen += 1;
                }
            }
        }
        assert!(seen > 200, "{seen} pixels see the square");
        worst
    };
    let shift = DVec3::new(10_000.37, -3_333.21, 9_876.54);
    let [home, away] = [error(DVec3::ZERO), error(shift)];
    println!("distance to the plane: {home:.1e} m at the origin, {away:.1e} m at 14 km, seen from 2.5 m");
    assert!(home < 1e-6 && away < 1e-6, "{home} {away}");
}

#[test]
fn emission_is_seen_from_the_front_only() {
    let Some(gpu) = gpu() else { return };
    let material = Material { emissive: Vec3::new(2.0, 0.25, 1e6), ..Material::default() };
    for (placed, expected) in [(DMat4::IDENTITY, [2.0, 0.25, 1e6]), (DMat4::from_rotation_y(std::f64::consts::PI), [0.0; 3])] {
        let drawn = draw(gpu, scene(vec![material.clone()], vec![(square(0), placed)]), &camera(DVec3::new(0.0, 0.0, 2.5)), EMISSION);
        let pixels = drawn.find("image").unwrap().to_f32_rgba();
        let [r, g, b, _] = pixels[(12 * EXTENT[0] + 16) as usize];
        // Beyond what a half float holds, thanks to pre-exposure. The largest channel decides the shared exponent, so the others are lost beside one this bright: steps
        // are 2^-9 of the power of two below it.
        assert!((b - expected[2]).abs() <= 1024.0 && r <= expected[0] + 2048.0 && g <= expected[1] + 2048.0, "{r} {g} {b}");
        assert_eq!(pixels[0][..3], [0.0; 3], "nothing is seen in the corner");
    }
    let dim = Material { emissive: Vec3::new(2.0, 0.25, 0.5), ..Material::default() };
    let drawn = draw(gpu, scene(vec![dim], vec![(square(0), DMat4::IDENTITY)]), &camera(DVec3::new(0.0, 0.0, 2.5)), EMISSION);
    let [r, g, b, _] = drawn.find("image").unwrap().to_f32_rgba()[(12 * EXTENT[0] + 16) as usize];
    close(DVec3::new(r.into(), g.into(), b.into()), DVec3::new(2.0, 0.25, 0.5), 2.0 / 512.0);
}

/// A smooth environment against its own formula in f64, for cameras all around.
#[test]
fn the_environment_lies_where_the_conventions_say() {
    let Some(gpu) = gpu() else { return };
    // Radiance 1 + direction, at pixel centres: (sin 2 pi u sin pi v, cos pi v, -cos 2 pi u sin pi v).
    let (width, height) = (256u32, 128u32);
    let pixels = (0..width * height).map(|index| {
        let (u, v) = ((f64::from(index % width) + 0.5) / f64::from(width), (f64::from(index / width) + 0.5) / f64::from(height));
        let (around, down) = (std::f64::consts::TAU * u, std::f64::consts::PI * v);
        (DVec3::ONE + DVec3::new(around.sin() * down.sin(), down.cos(), -around.cos() * down.sin())).as_vec3()
    });
    let environment = Environment { name: "test".into(), width, height, pixels: pixels.collect(), scale: 2.0 };
    for look in [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::NEG_X, DVec3::new(0.1, 1.0, 0.2), DVec3::new(0.3, -1.0, -0.1)] {
        let mut scene = scene(vec![Material::default()], vec![(square(0), DMat4::from_translation(DVec3::new(0.0, 0.0, 0.0)))]);
        scene.environment = Some(environment.clone());
        // Far away, so that the square hides nothing.
        let camera = Camera::look_at("test", look * 1e4, look * 2e4, DVec3::new(0.3, 0.9, 0.4), 0.8, 0.01).unwrap();
        let drawn = draw(gpu, scene, &camera, EMISSION);
        let pixels = drawn.find("image").unwrap().to_f32_rgba();
        for (index, [r, g, b, _]) in pixels.into_iter().enumerate() {
            let (x, y) = (index as u32 % EXTENT[0], index as u32 / EXTENT[0]);
            let expected = 2.0 * (DVec3::ONE + drawn.ray(x, y).normalize());
            // Bilinear interpolation over a texel of 1.4 degrees, and half floats.
            close(DVec3::new(r.into(), g.into(), b.into()), expected, 6e-3);
        }
    }
}

/// Whatever finite things a scene holds, the safety net in [`draw`] finds no NaN, no infinity and no negative radiance.
#[test]
fn extreme_scenes_stay_finite() {
    let Some(gpu) = gpu() else { return };
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f32 / (1u64 << 31) as f32
    };
    for round in 0..12 {
        let extreme = |value: f32| [0.0, 1e-30, 1e-3, 1.0, 1e8, 3e38][(value * 5.99) as usize];
        let mut mesh = square(0);
        for vertex in 0..4 {
            let mut wild = || (random() - 0.5) * extreme(random());
            mesh.normals[vertex] = Vec3::new(wild(), wild(), wild());
            mesh.tangents[vertex] = Vec4::new(wild(), wild(), wild(), if round % 2 == 0 { 1.0 } else { -1.0 });
            mesh.uvs[vertex] = Vec2::new(wild(), wild()).clamp(Vec2::splat(-1e9), Vec2::splat(1e9));
        }
        let material = Material {
            emissive: Vec3::new(extreme(random()), extreme(random()), extreme(random())),
            normal_texture: nearest(0),
            normal_scale: extreme(random()).min(1e30),
            roughness: random(),
            ..Material::default()
        };
        let scale = [1.0, 1e-6, 1e6, 1.0][round % 4];
        let flat = if round % 3 == 0 { 0.0 } else { 1.0 };
        let placed = DMat4::from_scale(DVec3::new(scale, scale, scale * flat));
        let mut scene = scene(vec![material], vec![(mesh, placed)]);
        scene.textures = Arc::new(vec![texture(2, &[[0, 0, 0, 255], [128, 127, 127, 255], [255, 0, 128, 255], [127, 128, 128, 255]])]);
        let drawn = draw(gpu, scene, &camera(DVec3::new(0.0, 0.0, 2.0 * scale)), EMISSION);
        let pixels = drawn.find("image").unwrap().to_f32_rgba();
        assert!(pixels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
    }
}
