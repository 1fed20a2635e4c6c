//! Reflective shadow maps of a closed room: what they hold is where the walls are, and all the light of a lamp falls through their texels.
// A scene has private fields, so it cannot be written in one expression.
#![allow(clippy::unwrap_used, clippy::field_reassign_with_default)]

use glam::{DMat4, DVec2, DVec3, Vec2, Vec3, Vec4};
use lobelia_frame::SceneWorld;
use lobelia_graph::{
    Gpu, GraphFile, PartData, Plan, PlanOptions, Registry, RunOptions, Runner, TextureData,
    testing::{evaluate, gpu},
};
use lobelia_lobes::{light::spot_falloff, octahedral::octahedral_decode};
use lobelia_scene::{Camera, LightKind, Material, Mesh, PunctualLight, Scene, device::GpuScene};
use lobelia_shaders::Flags;
use std::{
    f64::consts::{PI, TAU},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Half sizes of the room, metres.
const HALF: DVec3 = DVec3::new(2.0, 1.5, 2.5);

/// One device, one test at a time: reading back takes it that nobody else polls meanwhile.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The room stands askew, and not at the world's origin.
fn world_from_room() -> DMat4 {
    DMat4::from_translation(DVec3::new(100.3, -7.6, 40.9)) * DMat4::from_rotation_y(0.4) * DMat4::from_rotation_x(0.2)
}

/// Six walls. Their fronts are outside: lights inside see the backs.
fn room() -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [-1.0f32, 1.0] {
            let normal = Vec3::AXES[axis] * sign;
            let (u, v) = (Vec3::AXES[(axis + 1) % 3], Vec3::AXES[(axis + 2) % 3] * sign);
            let start = mesh.positions.len() as u32;
            for [a, b] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
                mesh.positions.push((normal + u * a + v * b) * HALF.as_vec3());
                mesh.normals.push(normal);
                mesh.tangents.push(Vec4::ZERO);
                mesh.uvs.push(Vec2::ZERO);
            }
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| start + corner));
        }
    }
    mesh
}

fn scene(meshes: Vec<Mesh>, lights: Vec<PunctualLight>) -> Scene {
    let mut instance = Scene::load("builtin:cornell-diffuse").unwrap().instances[0].clone();
    let mut scene = Scene::default();
    scene.materials = vec![Material { base_color: Vec3::new(0.5, 0.25, 0.75), roughness: 0.3, metallic: 0.5, ..Material::default() }];
    for mesh in 0..meshes.len() {
        (instance.mesh, instance.world_from_local) = (mesh, world_from_room());
        scene.instances.push(instance.clone());
    }
    scene.meshes = Arc::new(meshes);
    scene.lights = lights;
    scene
}

/// A light at a place of the room, with a direction in room coordinates.
fn light(kind: LightKind, at: DVec3, direction: DVec3, intensity: Vec3) -> PunctualLight {
    let mut light = Scene::load("builtin:cornell-diffuse").unwrap().lights[0].clone();
    (light.kind, light.intensity) = (kind, intensity);
    light.position = world_from_room().transform_point3(at);
    light.direction = world_from_room().transform_vector3(direction).normalize();
    light
}

fn spot(inner: f32, outer: f32) -> PunctualLight {
    let kind = LightKind::Spot { inner: inner.to_radians(), outer: outer.to_radians() };
    light(kind, DVec3::new(0.3, 0.4, -0.7), DVec3::new(0.5, -0.3, 0.8), Vec3::new(10.0, 5.0, 1.0))
}

fn point() -> PunctualLight {
    light(LightKind::Point, DVec3::new(-0.8, 0.6, 1.1), DVec3::Z, Vec3::new(2.0, 3.0, 4.0))
}

fn sun() -> PunctualLight {
    light(LightKind::Directional, DVec3::ZERO, DVec3::new(0.3, -1.0, 0.2), Vec3::new(5.0, 4.0, 3.0))
}

fn plan(scene: &Scene, resolution: u32) -> Result<Plan<SceneWorld>, String> {
    let mut registry = Registry::new();
    lobelia_rsm::register(&mut registry);
    let text = format!(r#"(passes: {{"rsm": rsm(resolution: {resolution})}}, output: "rsm.rsm")"#);
    let wired = GraphFile::parse(&text, "test.ron").unwrap().wire(&registry, &[], &[]).map_err(|problems| problems.to_string())?;
    wired.plan(&scene.traits(), &PlanOptions::new([8, 8])).map_err(|problems| problems.to_string())
}

/// What one frame drew, with memory poisoned before.
struct Map {
    resolution: u32,
    depth: Vec<TextureData>,
    core: Vec<TextureData>,
    /// 32-bit words of one face: those of `RsmFace`.
    faces: Vec<Vec<u32>>,
    /// Of the scene's lights, likewise.
    lights: Vec<Vec<u32>>,
    scene: Arc<Scene>,
}

const FACE_WORDS: usize = 44;
const LIGHT_WORDS: usize = 12;

fn records(bytes: &[u8], words: usize) -> Vec<Vec<u32>> {
    bytemuck::pod_collect_to_vec::<u8, u32>(bytes).chunks_exact(words).map(<[u32]>::to_vec).collect()
}

fn read(gpu: &Gpu, runner: &Runner<SceneWorld>, device: &GpuScene, resolution: u32) -> Map {
    let parts = runner.read(gpu, "rsm.rsm").unwrap();
    let layers = |name: &str| {
        let found = parts.iter().find_map(|(part, data)| match data {
            PartData::Texture(layers) if part.name == name => Some(layers.clone()),
            _ => None,
        });
        found.unwrap()
    };
    let faces = parts.iter().find_map(|(_, data)| match data {
        PartData::Buffer(bytes) => Some(records(bytes, FACE_WORDS)),
        PartData::Texture(_) => None,
    });
    let lights = records(&gpu.read_buffer(&copyable(gpu, &device.lights)).unwrap(), LIGHT_WORDS);
    Map { resolution, depth: layers("depth"), core: layers("core"), faces: faces.unwrap(), lights, scene: device.scene.clone() }
}

/// The scene's lights as the device has them; their buffer can be bound but not copied, so a shader copies it.
fn copyable(gpu: &Gpu, lights: &wgpu::Buffer) -> wgpu::Buffer {
    let text = "@group(0) @binding(0) var<storage, read> source: array<u32>;\n\
        @group(0) @binding(1) var<storage, read_write> copied: array<u32>;\n\
        @compute @workgroup_size(64) fn copy(@builtin(global_invocation_id) id: vec3u) {\n\
        for (var i = id.x; i < arrayLength(&source); i += 64u) { copied[i] = source[i]; } }";
    let pipeline = gpu.compute_pipeline("copy", lobelia_shaders::Source { path: "copy.wgsl", text }, "copy", &Flags::new()).unwrap();
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let copied = gpu.device().create_buffer(&wgpu::BufferDescriptor { label: None, size: lights.size(), usage, mapped_at_creation: false });
    let group = pipeline.bindings(0).raw_buffer("source", lights).raw_buffer("copied", &copied).build(gpu).unwrap();
    let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(pipeline.raw());
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(1, 1, 1);
    drop(pass);
    gpu.queue().submit([encoder.finish()]);
    copied
}

fn draw(gpu: &Gpu, scene: Scene, resolution: u32) -> Map {
    let plan = plan(&scene, resolution).unwrap();
    let device = GpuScene::new(gpu.device(), gpu.queue(), Arc::new(scene)).unwrap();
    let mut runner = Runner::new(gpu, plan, &device, RunOptions { check: true, ..RunOptions::default() }).unwrap();
    runner.run(gpu, &device, 0, &mut |_, _| true).unwrap();
    read(gpu, &runner, &device, resolution)
}

/// A texel through the accessor module.
#[derive(Clone, Copy, Debug)]
struct Texel {
    face: usize,
    uv: DVec2,
    depth: f64,
    flux: DVec3,
    position: DVec3,
    /// What [`Texel::position`] projects back to: texture coordinates and distance.
    projected: DVec3,
    /// Where the matrix that draws puts it: texture coordinates and depth.
    drawn: DVec3,
}

const ACCESSOR: &str = "#import lobelia::reflective_shadow_map::{RsmFace, rsm_flux, rsm_position, rsm_project}
#import lobelia::scene::PunctualLight
struct Input { face: RsmFace, light: PunctualLight, uv: vec2f, depth: f32, resolution: f32 }
struct Output { flux: vec4f, position: vec4f, projected: vec4f, clip: vec4f }
fn evaluate(input: Input) -> Output {
    let position = rsm_position(input.face, input.uv, input.depth);
    return Output(
        vec4f(rsm_flux(input.face, input.light, input.uv, input.resolution), 0.0),
        vec4f(position, 0.0),
        vec4f(rsm_project(input.face, position), 0.0),
        input.face.clip_from_scene * vec4f(position, 1.0),
    );
}";

impl Map {
    /// All texels of all faces.
    fn texels(&self, gpu: &Gpu) -> Vec<Texel> {
        let side = self.resolution as usize;
        let mut places = Vec::new();
        let mut rows: Vec<[u32; FACE_WORDS + LIGHT_WORDS + 4]> = Vec::new();
        for (face, words) in self.faces.iter().enumerate() {
            let light = &self.lights[words[27] as usize];
            for (index, [depth, ..]) in self.depth[face].to_f32_rgba().into_iter().enumerate() {
                let uv = DVec2::new((index % side) as f64 + 0.5, (index / side) as f64 + 0.5) / side as f64;
                let tail = [uv.x as f32, uv.y as f32, depth, side as f32].map(f32::to_bits);
                rows.push([&words[..], &light[..], &tail[..]].concat().try_into().unwrap());
                places.push((face, uv, depth));
            }
        }
        let found: Vec<[f32; 16]> = evaluate(gpu, ACCESSOR, &Flags::new(), &rows).unwrap();
        let texel = |((face, uv, depth), values): (&(usize, DVec2, f32), &[f32; 16])| {
            let vector = |start: usize| DVec3::new(values[start].into(), values[start + 1].into(), values[start + 2].into());
            let (clip, w) = (vector(12), f64::from(values[15]));
            Texel {
                face: *face,
                uv: *uv,
                depth: f64::from(*depth),
                flux: vector(0),
                position: vector(4),
                projected: vector(8),
                drawn: DVec3::new(0.5 + 0.5 * clip.x / w, 0.5 - 0.5 * clip.y / w, clip.z / w),
            }
        };
        places.iter().zip(&found).map(texel).collect()
    }

    /// A position of scene space in the room.
    fn in_room(&self, position: DVec3) -> DVec3 {
        world_from_room().inverse().transform_point3(position + self.scene.origin())
    }

    fn total_flux(&self, gpu: &Gpu) -> DVec3 {
        self.texels(gpu).iter().filter(|texel| texel.depth > 0.0).map(|texel| texel.flux).sum()
    }
}

/// Flux of a spot in units of its intensity: the falloff integrated over its cone.
fn cone(inner: f64, outer: f64) -> f64 {
    const STEPS: usize = 200_000;
    let step = outer / STEPS as f64;
    (0..STEPS)
        .map(|index| (index as f64 + 0.5) * step)
        .map(|angle| spot_falloff(angle.cos(), inner, outer) * TAU * angle.sin() * step)
        .sum()
}

fn close(found: DVec3, expected: DVec3, relative: f64) {
    assert!((found - expected).abs().max_element() <= relative * expected.abs().max_element(), "expected {expected}, found {found}");
}

#[test]
fn faces_are_counted_in_the_plan() {
    let faces = |lights: Vec<PunctualLight>| plan(&scene(vec![room()], lights), 16).unwrap().resources[0].parts[0].bytes() / (16 * 16 * 4);
    assert_eq!(faces(vec![spot(10.0, 64.9)]), 1);
    assert_eq!(faces(vec![spot(10.0, 65.1)]), 6);
    assert_eq!(faces(vec![point(), spot(5.0, 20.0), sun()]), 8);
    let error = plan(&scene(vec![room()], vec![point(); 16385]), 16).err().unwrap();
    assert!(error.contains("98310 faces") && error.contains("use fewer of them"), "{error}");
    let error = plan(&scene(vec![room()], vec![]), 16).err().unwrap();
    assert!(error.contains("the scene has no point, spot or directional light"), "{error}");
    assert!(plan(&scene(vec![room()], vec![sun()]), 15).err().unwrap().contains("resolution"));
}

/// More faces than a texture has layers share layers, and are smaller where they would take too much memory, with a word; fewer keep what was asked for.
#[test]
fn many_faces_share_layers_and_memory() {
    let planned = |lights: usize, resolution: u32| {
        let plan = plan(&scene(vec![room()], vec![point(); lights]), resolution).unwrap();
        let bytes = plan.resources[0].parts[0].bytes();
        (bytes / 4, plan.warnings().collect::<Vec<_>>().join(" "))
    };
    assert_eq!(planned(10, 1024), (60 << 20, String::new()));
    assert_eq!(planned(42, 128), (252 << 14, String::new()));
    // Four faces a layer: 258 faces in 65 layers.
    assert_eq!(planned(43, 64), ((65 * 4) << 12, String::new()));
    for (lights, side) in [(11, 512), (64, 256), (200, 128), (2000, 32)] {
        let (texels, warnings) = planned(lights, 1024);
        assert!(texels <= 25 << 20, "{lights} lights: {texels} texels");
        assert!(texels >= lights as u64 * 6 * side * side, "{lights} lights: {texels} texels");
        assert!(warnings.contains(&format!("{} faces; each has {side} texels", 6 * lights)), "{warnings}");
    }
}

/// A lamp among fifty, whose faces lie in tiles, sees what it sees alone.
#[test]
fn a_tile_holds_what_a_layer_would() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let mut lights = vec![point(); 50];
    lights[37] = light(LightKind::Point, DVec3::new(0.9, -0.4, 0.2), DVec3::Z, Vec3::ONE);
    let many = draw(gpu, scene(vec![room()], lights.clone()), 32);
    let alone = draw(gpu, scene(vec![room()], vec![lights[37].clone()]), 32);
    for face in 0..6 {
        let words = &many.faces[37 * 6 + face];
        let (layer, x, y) = (words[34] as usize, words[40] as usize, words[41] as usize);
        assert_eq!(words[33], 32, "texels a side");
        assert!((x, y) == (0, 0) || (x, y) == (32, 0) || (x, y) == (0, 32) || (x, y) == (32, 32), "{x} {y}");
        let depths = many.depth[layer].to_f32_rgba();
        let expected = alone.depth[face].to_f32_rgba();
        // Rasterisers interpolate from the corner of the layer.
        let differs = |index: &usize| (depths[(y + index / 32) * 64 + x + index % 32][0] / expected[*index][0] - 1.0).abs() > 1e-5;
        assert_eq!((0..32 * 32).filter(differs).count(), 0, "face {face}");
    }
}

/// Near planes keep before what is near, whatever lies far away.
#[test]
fn a_far_away_thing_does_not_cut_off_what_is_near() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    for far in [1.0f32, 1e2, 1e4] {
        let mut away = room();
        away.positions.iter_mut().for_each(|position| *position *= 2.0 * far);
        for lamp in [point(), spot(10.0, 40.0)] {
            let map = draw(gpu, scene(vec![room(), away.clone()], vec![lamp]), 32);
            for texel in map.texels(gpu) {
                let beyond = (map.in_room(texel.position).abs() - HALF).max_element();
                assert!(texel.depth > 0.0 && beyond.abs() < 1e-5 * f64::from(far).max(1.0), "{far}: {texel:?} is {beyond} off the walls");
            }
        }
    }
}

/// The faces of a sun over a large ground, with a camera that sees little of it: what all of them hold together is what a single one would.
#[test]
fn nested_faces_hold_every_flux_once() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let mut ground = room();
    // A slab as wide as a town.
    ground
        .positions
        .iter_mut()
        .for_each(|position| *position = Vec3::new(position.x * 2000.0, position.y * 0.1 - 4.0, position.z * 2000.0));
    let mut of = scene(vec![room(), ground], vec![sun()]);
    let at = |room: DVec3| world_from_room().transform_point3(room);
    let camera = Camera::look_at("near", at(DVec3::new(0.0, 3.0, 9.0)), at(DVec3::ZERO), DVec3::Y, 0.7, 0.01);
    let single = draw(gpu, of.clone(), 256);
    of.cameras.extend(camera);
    let nested = draw(gpu, of, 256);
    assert!(single.faces.len() == 1 && nested.faces.len() > 3, "{} faces", nested.faces.len());
    close(nested.total_flux(gpu), single.total_flux(gpu), 1e-3);
    // The finest sees the room in texels of a few centimetres; the widest does not see it at all.
    let texels = nested.texels(gpu);
    let on_room = |face: usize| {
        let on_it = |texel: &&Texel| {
            let local = nested.in_room(texel.position);
            texel.face == face && texel.depth > 0.0 && texel.flux != DVec3::ZERO && (local.abs() - HALF).max_element().abs() < 1e-2
        };
        texels.iter().filter(on_it).count()
    };
    assert!(on_room(0) > 1000, "{} texels", on_room(0));
    assert!((1..nested.faces.len()).all(|face| on_room(face) == 0));
}

/// The sum of flux over texels is the flux of the cone, for one face and for six.
#[test]
fn all_of_a_spots_flux_falls_through_its_texels() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    for (inner, outer) in [(0.0, 20.0), (15.0, 40.0), (30.0, 65.0), (20.0, 66.0), (60.0, 89.0)] {
        let total = draw(gpu, scene(vec![room()], vec![spot(inner, outer)]), 128).total_flux(gpu);
        let expected = DVec3::new(10.0, 5.0, 1.0) * cone(f64::from(inner).to_radians(), f64::from(outer).to_radians());
        close(total, expected, 1e-3);
    }
}

#[test]
fn all_of_a_points_flux_falls_through_its_texels() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let total = draw(gpu, scene(vec![room()], vec![point()]), 64).total_flux(gpu);
    close(total, DVec3::new(2.0, 3.0, 4.0) * 4.0 * PI, 1e-4);
}

/// A directional light sees the silhouette of the room: the sum of its walls' areas, each times its cosine.
#[test]
fn a_suns_flux_is_illuminance_times_projected_area() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let total = draw(gpu, scene(vec![room()], vec![sun()]), 512).total_flux(gpu);
    let direction = DVec3::new(0.3, -1.0, 0.2).normalize().abs();
    let area = 4.0 * (direction.x * HALF.y * HALF.z + direction.y * HALF.z * HALF.x + direction.z * HALF.x * HALF.y);
    close(total, DVec3::new(5.0, 4.0, 3.0) * area, 2e-3);
}

/// Every texel of a lamp inside the room lies on a wall; what projects looks up what was drawn.
#[test]
fn positions_lie_on_the_walls_and_normals_turn_to_the_light() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    for lamp in [spot(10.0, 40.0), point(), spot(10.0, 80.0)] {
        let map = draw(gpu, scene(vec![room()], vec![lamp]), 64);
        let cores: Vec<Vec<u32>> = map.core.iter().map(TextureData::to_u32).collect();
        for (index, texel) in map.texels(gpu).iter().enumerate() {
            assert!(texel.depth > 0.0, "the room is closed: {texel:?}");
            let local = map.in_room(texel.position);
            let beyond = local.abs() - HALF;
            assert!(beyond.max_element().abs() < 3e-6, "{local} is not on a wall");
            assert!((texel.projected.truncate() - texel.uv).abs().max_element() < 1e-5, "{texel:?}");
            assert!((texel.drawn.truncate() - texel.uv).abs().max_element() < 1e-5, "{texel:?}");
            assert!((texel.drawn.z - texel.depth).abs() < 1e-5 * texel.depth, "{texel:?}");
            // In the corners two walls are equally near.
            let mut sizes = beyond.to_array();
            sizes.sort_by(f64::total_cmp);
            if sizes[1] < -0.05 {
                let axis = beyond.to_array().iter().position(|size| *size == sizes[2]).unwrap();
                let inwards = DVec3::AXES[axis] * -local[axis].signum();
                let word = cores[texel.face][2 * (index % (64 * 64))];
                let snorm = |bits: u32| f64::from(bits as u16 as i16).max(-32767.0) / 32767.0;
                let normal = octahedral_decode(DVec2::new(snorm(word), snorm(word >> 16)));
                close(normal, world_from_room().transform_vector3(inwards), 1e-4);
            }
        }
    }
}

#[test]
fn a_suns_texels_lie_on_the_outside() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let map = draw(gpu, scene(vec![room()], vec![sun()]), 64);
    let seen: Vec<Texel> = map.texels(gpu).into_iter().filter(|texel| texel.depth > 0.0).collect();
    assert!(seen.len() > 500);
    for texel in seen {
        let beyond = (map.in_room(texel.position).abs() - HALF).max_element();
        // Depth is linear here: its step is 2^-24 of three radii.
        assert!(beyond.abs() < 5e-6, "{texel:?}: {beyond}");
        assert!((texel.projected.truncate() - texel.uv).abs().max_element() < 1e-5, "{texel:?}");
        assert!((texel.drawn - texel.uv.extend(texel.depth)).abs().max_element() < 1e-5, "{texel:?}");
    }
}

/// Half a texel past the rim of a cube's face another face goes on, at its own rim, with a neighbouring place of the wall.
#[test]
fn faces_of_a_cube_meet_without_a_seam() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    const SIDE: usize = 64;
    let map = draw(gpu, scene(vec![room()], vec![point()]), SIDE as u32);
    let texels = map.texels(gpu);
    let wgsl = "#import lobelia::reflective_shadow_map::{RsmFace, rsm_cube_face, rsm_project, rsm_ray}
        struct Input { face: RsmFace, uv: vec2f, unused: vec2f }
        struct Output { ray: vec4f, face: vec4u }
        fn evaluate(input: Input) -> Output {
            let ray = rsm_ray(input.face, input.uv);
            return Output(vec4f(ray, 0.0), vec4u(rsm_cube_face(ray)));
        }";
    let mut rims = Vec::new();
    for face in 0..6 {
        for step in 0..SIDE {
            for (x, y, out) in [(0, step, DVec2::NEG_X), (SIDE - 1, step, DVec2::X), (step, 0, DVec2::NEG_Y), (step, SIDE - 1, DVec2::Y)] {
                rims.push((texels[(face * SIDE + y) * SIDE + x], out));
            }
        }
    }
    let rows: Vec<[u32; FACE_WORDS + 4]> = rims
        .iter()
        .map(|(texel, out)| {
            let past = texel.uv + *out * (0.9 / SIDE as f64);
            let tail = [past.x as f32, past.y as f32, 0.0, 0.0].map(f32::to_bits);
            [&map.faces[texel.face][..], &tail[..]].concat().try_into().unwrap()
        })
        .collect();
    let found: Vec<[u32; 8]> = evaluate(gpu, wgsl, &Flags::new(), &rows).unwrap();
    let light = map.scene.lights[0].position - map.scene.origin();
    for ((rim, _), row) in rims.iter().zip(&found) {
        let ray = DVec3::new(f32::from_bits(row[0]).into(), f32::from_bits(row[1]).into(), f32::from_bits(row[2]).into()).normalize();
        let other = row[4] as usize;
        assert_ne!(other, rim.face);
        let nearest = texels[other * SIDE * SIDE..][..SIDE * SIDE].iter().max_by(|a, b| {
            let cosine = |texel: &&Texel| (texel.position - light).normalize().dot(ray);
            cosine(a).total_cmp(&cosine(b))
        });
        let nearest = nearest.unwrap();
        let from_rim = nearest.uv.min(DVec2::ONE - nearest.uv).min_element();
        assert!(from_rim < 1.0 / SIDE as f64, "{rim:?} goes on in the middle of another face: {nearest:?}");
        // A texel is at most 2 / SIDE wide at distance 1; walls are met no flatter than in a corner 3 m away.
        let gap = (nearest.position - rim.position).length();
        assert!(gap < 0.5, "{rim:?} {nearest:?}: {gap} m");
    }
}

/// The faces follow a light that moves, in the frame in which it moved.
#[test]
fn faces_follow_an_animated_light() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let floats =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, /* times */ 0.0, 1.0, /* places */ 0.0, 2.0, 0.0, 3.0, 2.0, 1.0];
    std::fs::write(folder.join("moving.bin"), bytemuck::cast_slice(&floats)).unwrap();
    let text = r#"{
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5}]}},
        "nodes": [{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"uri": "moving.bin", "byteLength": 68}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 8}, {"buffer": 0, "byteOffset": 44, "byteLength": 24}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, -1], "max": [1, 0, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
            {"bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3"}
        ],
        "animations": [{"samplers": [{"input": 1, "output": 2}], "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}]
    }"#;
    let file = folder.join("moving.gltf");
    std::fs::write(&file, text).unwrap();
    let mut scene = Scene::load(&file.display().to_string()).unwrap();
    let mut device = GpuScene::new(gpu.device(), gpu.queue(), Arc::new(scene.clone())).unwrap();
    let mut runner = Runner::new(gpu, plan(&scene, 16).unwrap(), &device, RunOptions { check: true, ..RunOptions::default() }).unwrap();
    for (time, expected) in [(0.0, [0.0, 2.0, 0.0]), (0.0, [0.0, 2.0, 0.0]), (0.5, [1.5, 2.0, 0.5]), (1.0, [3.0, 2.0, 1.0])] {
        scene.set_time(time);
        device.update(gpu.queue(), Arc::new(scene.clone()));
        runner.run(gpu, &device, 0, &mut |_, _| true).unwrap();
        let map = read(gpu, &runner, &device, 16);
        assert_eq!(map.faces.len(), 6);
        let position = [16, 17, 18].map(|word| f64::from(f32::from_bits(map.faces[5][word])));
        close(DVec3::from(position) + scene.origin(), DVec3::from(expected), 1e-6);
    }
}

/// The safety net of [`draw`] finds nothing wrong in maps of extreme lights, and every flux is finite and not negative.
#[test]
fn extreme_lights_stay_finite() {
    let Some(gpu) = gpu() else { return };
    let _turn = turn();
    let kinds = [
        LightKind::Spot { inner: 0.0, outer: 0.0 },
        LightKind::Spot { inner: 0.0, outer: 1e-4 },
        LightKind::Spot { inner: 1.5, outer: std::f32::consts::FRAC_PI_2 },
        LightKind::Point,
        LightKind::Directional,
    ];
    for kind in kinds {
        // In the middle, on a wall, in a corner, far outside.
        for at in [DVec3::ZERO, DVec3::new(0.0, HALF.y, 0.0), HALF, HALF * 1e4] {
            for direction in [DVec3::Y, DVec3::NEG_Y, DVec3::new(1e-9, 1.0, 0.0)] {
                let map = draw(gpu, scene(vec![room()], vec![light(kind, at, direction, Vec3::splat(1e30))]), 16);
                for texel in map.texels(gpu) {
                    assert!(texel.flux.is_finite() && texel.flux.min_element() >= 0.0, "{kind:?} at {at}: {texel:?}");
                    assert!(texel.depth == 0.0 || texel.position.is_finite(), "{kind:?} at {at}: {texel:?}");
                }
            }
        }
    }
}
