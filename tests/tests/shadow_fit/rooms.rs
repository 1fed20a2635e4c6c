//! Scenes of boxes, made in code.

use glam::{DMat4, DVec3, Vec2, Vec3, Vec4};
use lobelia::scene::{Camera, LightKind, Material, Mesh, PunctualLight, Scene};
use std::sync::Arc;

/// Corners of flat pieces, each with its normal.
#[derive(Default)]
pub struct Solid(Mesh);

impl Solid {
    /// A flat quadrilateral, corners counter-clockwise as seen from its front.
    pub fn quad(&mut self, corners: [DVec3; 4]) {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(DVec3::Y).as_vec3();
        let start = self.0.positions.len() as u32;
        for corner in corners {
            self.0.positions.push(corner.as_vec3());
            self.0.normals.push(normal);
            self.0.tangents.push(Vec4::new(1.0, 0.0, 0.0, 1.0));
            self.0.uvs.push(Vec2::ZERO);
        }
        self.0.indices.extend([0, 1, 2, 0, 2, 3].map(|corner| start + corner));
    }

    pub fn cuboid(&mut self, least: DVec3, greatest: DVec3) {
        let (middle, half) = ((least + greatest) / 2.0, (greatest - least) / 2.0);
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let (u, v) = (DVec3::AXES[(axis + 1) % 3], DVec3::AXES[(axis + 2) % 3] * sign);
                let at = |a: f64, b: f64| middle + (DVec3::AXES[axis] * sign + u * a + v * b) * half;
                self.quad([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]);
            }
        }
    }

    /// A level square, seen from above.
    pub fn ground(&mut self, half: f64, height: f64) {
        let at = |x: f64, z: f64| DVec3::new(x * half, height, z * half);
        self.quad([at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0), at(-1.0, -1.0)]);
    }

    /// A sphere about the origin, seen from inside.
    pub fn dome(&mut self, radius: f64) {
        const ACROSS: usize = 24;
        const DOWN: usize = 12;
        let at = |down: usize, across: usize| {
            let (theta, phi) = (down as f64 / DOWN as f64 * std::f64::consts::PI, across as f64 / ACROSS as f64 * std::f64::consts::TAU);
            radius * DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
        };
        for down in 0..DOWN {
            for across in 0..ACROSS {
                self.quad([at(down, across), at(down, across + 1), at(down + 1, across + 1), at(down + 1, across)]);
            }
        }
    }
}

/// A grey scene.
pub fn scene(solids: Vec<Solid>, lights: Vec<PunctualLight>, camera: Camera) -> Scene {
    let mut scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let mut instance = scene.instances[0].clone();
    instance.world_from_local = DMat4::IDENTITY;
    scene.materials = vec![Material { base_color: Vec3::splat(0.5), roughness: 1.0, metallic: 0.0, specular: 0.0, ..Material::default() }];
    scene.instances.clear();
    for mesh in 0..solids.len() {
        instance.mesh = mesh;
        scene.instances.push(instance.clone());
    }
    scene.meshes = Arc::new(solids.into_iter().map(|solid| solid.0).collect());
    scene.lights = lights;
    scene.cameras = vec![camera];
    scene
}

pub fn light(kind: LightKind, at: DVec3, to: DVec3, intensity: f32) -> PunctualLight {
    let mut light = Scene::load("builtin:cornell-diffuse").unwrap().lights[0].clone();
    (light.kind, light.position, light.direction) = (kind, at, (to - at).normalize());
    light.intensity = Vec3::splat(intensity);
    light
}

pub const SPOT: LightKind = LightKind::Spot { inner: 0.3, outer: 0.6 };
