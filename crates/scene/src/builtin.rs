//! Scenes made in code, so that nothing need be downloaded to start.

mod area_lights;

use crate::{Camera, Instance, LightKind, Material, Mesh, PunctualLight, Scene, SceneError, error::suggestion, gltf::area_light::sphere};
use glam::{DMat4, DVec3, Vec3};
use std::sync::Arc;

/// Names behind `builtin:` and what they show.
pub fn builtin_names() -> &'static [(&'static str, &'static str)] {
    &[
        ("cornell-glossy", "Cornell box, 2 m: metal floor, gold box, blue dielectric box, one spot light"),
        ("cornell-diffuse", "the same box with every surface Lambertian"),
        ("ring-caustic", "gold ring on a diffuse floor, one spot light: a glossy caustic"),
        ("area-lights", "seven area lights, one of every shape, over a floor of strips of rising roughness"),
        ("spheres", "ten spheres of rising roughness, metal and dielectric, under a spot and a point light"),
    ]
}

pub(crate) fn load(name: &str) -> Result<Scene, SceneError> {
    let mut scene = match name {
        "cornell-glossy" => cornell(1.0),
        "cornell-diffuse" => cornell(0.0),
        "ring-caustic" => ring(),
        "area-lights" => area_lights::area_lights(),
        "spheres" => spheres(),
        _ => {
            let known: Vec<&str> = builtin_names().iter().map(|(name, _)| *name).collect();
            let help = suggestion(name, &known);
            return Err(SceneError::UnknownName { file: format!("builtin:{name}"), what: "built-in scene", name: name.into(), help });
        }
    };
    scene.fix_origin();
    Ok(scene)
}

/// Collects meshes, each placed once.
#[derive(Default)]
struct Builder {
    scene: Scene,
    meshes: Vec<Mesh>,
}

impl Builder {
    fn material(&mut self, name: &str, base_color: [f32; 3], metallic: f32, roughness: f32) -> usize {
        let base_color = Vec3::from_array(base_color);
        self.scene.materials.push(Material { name: name.into(), base_color, metallic, roughness, ..Material::default() });
        self.scene.materials.len() - 1
    }

    fn place(&mut self, name: &str, mut mesh: Mesh, material: usize, at: DVec3) {
        mesh.material = material;
        mesh.fill();
        self.meshes.push(mesh);
        let (mesh, world_from_local) = (self.meshes.len() - 1, DMat4::from_translation(at));
        self.scene.instances.push(Instance {
            mesh,
            world_from_local,
            name: name.into(),
            area_light: None,
            node: None,
            node_from_local: DMat4::IDENTITY,
        });
    }

    fn quad(&mut self, name: &str, material: usize, corners: [[f32; 3]; 4]) {
        let mut mesh = Mesh::default();
        add_quad(&mut mesh, corners.map(Vec3::from_array));
        self.place(name, mesh, material, DVec3::ZERO);
    }

    /// A box of size 2 `half` that stands on y = 0, turned about +Y.
    fn standing_box(&mut self, name: &str, material: usize, centre: [f32; 2], half: [f32; 2], height: f32, turn: f32) {
        let (sine, cosine) = turn.sin_cos();
        let at = |x: f32, y: f32, z: f32| {
            Vec3::new(
                centre[0] + cosine * x * half[0] + sine * z * half[1],
                y * height,
                centre[1] - sine * x * half[0] + cosine * z * half[1],
            )
        };
        let mut mesh = Mesh::default();
        add_quad(&mut mesh, [at(1.0, 0.0, -1.0), at(1.0, 1.0, -1.0), at(1.0, 1.0, 1.0), at(1.0, 0.0, 1.0)]);
        add_quad(&mut mesh, [at(-1.0, 0.0, 1.0), at(-1.0, 1.0, 1.0), at(-1.0, 1.0, -1.0), at(-1.0, 0.0, -1.0)]);
        add_quad(&mut mesh, [at(-1.0, 1.0, -1.0), at(-1.0, 1.0, 1.0), at(1.0, 1.0, 1.0), at(1.0, 1.0, -1.0)]);
        add_quad(&mut mesh, [at(1.0, 0.0, -1.0), at(1.0, 0.0, 1.0), at(-1.0, 0.0, 1.0), at(-1.0, 0.0, -1.0)]);
        add_quad(&mut mesh, [at(-1.0, 0.0, 1.0), at(1.0, 0.0, 1.0), at(1.0, 1.0, 1.0), at(-1.0, 1.0, 1.0)]);
        add_quad(&mut mesh, [at(-1.0, 1.0, -1.0), at(1.0, 1.0, -1.0), at(1.0, 0.0, -1.0), at(-1.0, 0.0, -1.0)]);
        self.place(name, mesh, material, DVec3::ZERO);
    }

    fn spot(&mut self, position: [f64; 3], target: [f64; 3], intensity: Vec3, inner_degrees: f32, outer_degrees: f32) {
        let (position, target) = (DVec3::from_array(position), DVec3::from_array(target));
        let kind = LightKind::Spot { inner: inner_degrees.to_radians(), outer: outer_degrees.to_radians() };
        self.light("spot", kind, position, (target - position).normalize_or(DVec3::NEG_Y), intensity);
    }

    fn light(&mut self, name: &str, kind: LightKind, position: DVec3, direction: DVec3, intensity: Vec3) {
        self.scene.lights.push(PunctualLight { name: name.into(), kind, position, direction, intensity, animated: false, node: None });
    }

    fn camera(&mut self, name: &str, origin: [f64; 3], target: [f64; 3], yfov: f64) {
        let camera = Camera::look_at(name, DVec3::from_array(origin), DVec3::from_array(target), DVec3::Y, yfov, 0.01);
        self.scene.cameras.extend(camera);
    }

    fn finish(mut self) -> Scene {
        self.scene.meshes = Arc::new(self.meshes);
        self.scene
    }
}

/// Counter-clockwise seen from the front.
fn add_quad(mesh: &mut Mesh, corners: [Vec3; 4]) {
    let start = mesh.positions.len() as u32;
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    mesh.positions.extend(corners);
    mesh.normals.extend([normal; 4]);
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| start + corner));
}

fn cornell(specular: f32) -> Scene {
    let mut build = Builder::default();
    let white = build.material("white", [0.725, 0.71, 0.68], 0.0, 1.0);
    let floor = build.material("glossy-floor", [0.7, 0.7, 0.7], 1.0, 0.35);
    let left = build.material("left", [0.63, 0.065, 0.05], 0.0, 1.0);
    let right = build.material("right", [0.14, 0.45, 0.091], 0.0, 1.0);
    let tall = build.material("tall-box", [1.0, 0.77, 0.34], 1.0, 0.4);
    let short = build.material("short-box", [0.3, 0.4, 0.75], 0.0, 0.5);
    build.quad("floor", floor, [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]]);
    build.quad("ceiling", white, [[-1.0, 2.0, -1.0], [1.0, 2.0, -1.0], [1.0, 2.0, 1.0], [-1.0, 2.0, 1.0]]);
    build.quad("back", white, [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 2.0, -1.0], [-1.0, 2.0, -1.0]]);
    build.quad("left", left, [[-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0], [-1.0, 2.0, -1.0], [-1.0, 2.0, 1.0]]);
    build.quad("right", right, [[1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [1.0, 2.0, 1.0], [1.0, 2.0, -1.0]]);
    build.standing_box("tall-box", tall, [-0.36, -0.35], [0.29, 0.29], 1.2, 18f32.to_radians());
    build.standing_box("short-box", short, [0.38, 0.3], [0.29, 0.29], 0.6, (-16f32).to_radians());
    let direction = DVec3::new(-0.477_359_340_263_020_9, -0.737_737_162_224_668_6, -0.477_359_340_263_020_9);
    let kind = LightKind::Spot { inner: 0.349_065_85, outer: 0.663_225_1 };
    build.light("spot", kind, DVec3::new(0.35, 1.95, 0.75), direction, 14.0 * Vec3::new(1.0, 0.95, 0.85));
    build.camera("main", [0.0, 1.0, 3.6], [0.0, 0.986_112_450_509_242_2, 2.600_096_436_665_444_5], 0.698_131_700_797_731_8);
    let ahead = |origin: [f64; 3], back: [f64; 3]| [origin[0] - back[0], origin[1] - back[1], origin[2] - back[2]];
    let (side, low) = ([0.85, 1.5, 0.95], [-0.7, 0.25, 0.95]);
    build.camera(
        "side",
        side,
        ahead(side, [0.567_196_851_467_116_4, 0.504_174_979_081_881_9, 0.651_226_014_647_429_8]),
        1.047_197_551_196_597_6,
    );
    build.camera(
        "low",
        low,
        ahead(low, [-0.612_655_718_514_155_4, -0.141_382_088_887_881_95, 0.777_601_488_883_350_6]),
        1.134_464_013_796_314_2,
    );
    let mut scene = build.finish();
    for material in &mut scene.materials {
        material.specular = specular;
        if specular == 0.0 {
            // Metals reflect by their specular lobe alone; as Lambertian surfaces they show their colour.
            material.metallic = 0.0;
        }
    }
    scene
}

/// Turns a profile (radius, height) about +Y. Each strip has its own normals.
fn lathe(strips: &[Vec<[f32; 2]>], segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for strip in strips {
        let start = mesh.positions.len() as u32;
        let (first, last) = (strip[0], strip[strip.len() - 1]);
        // To the right of the profile's direction of travel, which is outwards for profiles that go up on the outside.
        let normal = glam::Vec2::new(last[1] - first[1], first[0] - last[0]).normalize_or_zero();
        for segment in 0..=segments {
            let (sine, cosine) = (std::f32::consts::TAU * segment as f32 / segments as f32).sin_cos();
            for [radius, height] in strip {
                mesh.positions.push(Vec3::new(radius * cosine, *height, -radius * sine));
                mesh.normals.push(Vec3::new(normal.x * cosine, normal.y, -normal.x * sine));
            }
        }
        let rows = strip.len() as u32;
        for [second, third] in [[rows, rows + 1], [rows + 1, 1]] {
            for segment in 0..segments {
                for row in 0..rows - 1 {
                    let first = start + segment * rows + row;
                    mesh.indices.extend([first, first + second, first + third]);
                }
            }
        }
    }
    mesh
}

fn ring() -> Scene {
    let mut build = Builder::default();
    let floor = build.material("floor", [0.75, 0.75, 0.75], 0.0, 1.0);
    let gold = build.material("ring", [1.0, 0.77, 0.34], 1.0, 0.25);
    build.quad("floor", floor, [[-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0], [-4.0, 0.0, -4.0]]);
    let wall = |radius: f32, down: bool| -> Vec<[f32; 2]> {
        (0..=8).map(|row| [radius, 0.061 * (if down { 8 - row } else { row }) as f32]).collect()
    };
    let strips = [
        wall(1.0, false),
        vec![[1.0, 0.488], [0.988, 0.5]],
        vec![[0.988, 0.5], [0.932, 0.5]],
        vec![[0.932, 0.5], [0.92, 0.488]],
        wall(0.92, true),
    ];
    build.place("ring", lathe(&strips, 256), gold, DVec3::ZERO);
    let direction = DVec3::new(0.714_005_547_295_416_6, -0.686_543_795_476_362_2, -0.137_308_759_095_272_46);
    let kind = LightKind::Spot { inner: 0.209_439_51, outer: 0.418_879_02 };
    build.light("spot", kind, DVec3::new(-2.6, 2.6, 0.5), direction, Vec3::splat(60.0));
    build.camera(
        "main",
        [0.6, 3.0, 2.9],
        [0.455_242_967_803_985_77, 2.300_341_011_052_598, 2.200_341_011_052_598],
        0.663_225_115_757_845_3,
    );
    let (low, back) = ([1.9, 1.1, 2.2], [0.618_070_046_200_737_7, 0.325_300_024_316_177_7, 0.715_660_053_495_591]);
    build.camera("low", low, [low[0] - back[0], low[1] - back[1], low[2] - back[2]], 0.698_131_700_797_731_8);
    build.finish()
}

fn spheres() -> Scene {
    let mut build = Builder::default();
    let grey = build.material("floor", [0.5, 0.5, 0.5], 0.0, 0.6);
    let wall = build.material("wall", [0.6, 0.58, 0.55], 0.0, 1.0);
    build.quad("floor", grey, [[-3.0, 0.0, 2.0], [3.0, 0.0, 2.0], [3.0, 0.0, -1.6], [-3.0, 0.0, -1.6]]);
    build.quad("wall", wall, [[-3.0, 0.0, -1.6], [3.0, 0.0, -1.6], [3.0, 2.4, -1.6], [-3.0, 2.4, -1.6]]);
    for row in 0..2 {
        for column in 0..5 {
            let roughness = 0.1 + 0.2 * column as f32;
            let metal = row == 0;
            let color = if metal { [0.95, 0.8, 0.5] } else { [0.2, 0.35, 0.7] };
            let name = format!("{} {roughness:.1}", if metal { "metal" } else { "dielectric" });
            let material = build.material(&name, color, f32::from(u8::from(metal)), roughness);
            let at = DVec3::new(-1.8 + 0.9 * f64::from(column), 0.36, if metal { -0.7 } else { 0.4 });
            build.place(&name, sphere(0.36, 48, 24), material, at);
        }
    }
    build.spot([2.2, 3.0, 2.6], [0.0, 0.2, -0.3], Vec3::new(60.0, 56.0, 50.0), 18.0, 34.0);
    build.light("point", LightKind::Point, DVec3::new(-2.2, 1.9, 0.9), DVec3::NEG_Y, Vec3::new(3.0, 4.0, 6.0));
    build.camera("main", [0.0, 2.0, 4.6], [0.0, 0.45, -0.2], 0.62);
    build.finish()
}
