//! `vpl-lights` on real reflective shadow maps of a point and a spot light: seven faces.

use crate::given::{Given, run, turn, unpack_unit};
use glam::{DVec2, DVec3, Vec3};
use lobelia::{
    frame::{RsmFace, VirtualLight},
    graph::{Gpu, PartData, TextureData, testing::gpu},
    scene::{LightKind, Scene},
};
use lobelia_lobes::light::spot_falloff;

const SIDE: usize = 48;

struct Picked {
    lights: Vec<VirtualLight>,
    faces: Vec<RsmFace>,
    /// Per face, row by row: depth, core words, specular word.
    depth: Vec<Vec<f64>>,
    core: Vec<Vec<u32>>,
    specular: Vec<Vec<u32>>,
}

fn scene() -> Scene {
    Scene::load("builtin:spheres").unwrap()
}

fn pick(gpu: &Gpu, scene: &Scene, count: u32, offset: u32, seed: u32) -> Picked {
    let _turn = turn();
    let text = format!(
        r#"(passes: {{"rsm": rsm(resolution: {SIDE}), "density": flux_density(), "lights": vpl_lights(count: {count}, seed: {offset})}}, output: "lights.lights")"#
    );
    let runner = run(gpu, &text, scene, &Given::default(), &["rsm.rsm"], seed).unwrap();
    let parts = |name: &str| runner.read(gpu, name).unwrap();
    let maps = parts("rsm.rsm");
    let part = |name: &str| maps.iter().find(|(part, _)| part.name == name).map(|(_, data)| data.clone()).unwrap();
    let layers = |name: &str| match part(name) {
        PartData::Texture(layers) => layers,
        PartData::Buffer(_) => panic!("{name} is a texture"),
    };
    let bytes = |data: &PartData| match data {
        PartData::Buffer(bytes) => bytes.clone(),
        PartData::Texture(_) => panic!("a buffer"),
    };
    let words = |layers: Vec<TextureData>| layers.iter().map(TextureData::to_u32).collect();
    Picked {
        lights: encase::StorageBuffer::new(bytes(&parts("lights.lights")[0].1)).create().unwrap(),
        faces: encase::StorageBuffer::new(bytes(&part("faces"))).create().unwrap(),
        depth: layers("depth").iter().map(|layer| layer.to_f32_rgba().iter().map(|texel| f64::from(texel[0])).collect()).collect(),
        core: words(layers("core")),
        specular: words(layers("specular")),
    }
}

fn ray(face: &RsmFace, x: usize, y: usize) -> DVec3 {
    let ndc = DVec2::new(2.0 * (x as f64 + 0.5) / SIDE as f64 - 1.0, 1.0 - 2.0 * (y as f64 + 0.5) / SIDE as f64);
    face.forward.as_dvec3() + face.right.as_dvec3() * ndc.x + face.up.as_dvec3() * ndc.y
}

/// Flux through a texel, W: intensity times the solid angle of the square, cos^3 / area on the plane at distance 1.
fn flux(scene: &Scene, face: &RsmFace, x: usize, y: usize) -> DVec3 {
    let light = &scene.lights[face.light as usize];
    let ray = ray(face, x, y);
    let area = 4.0 * f64::from(face.right.length()) * f64::from(face.up.length()) / (SIDE * SIDE) as f64;
    let falloff = match light.kind {
        LightKind::Spot { inner, outer } => spot_falloff(ray.normalize().dot(light.direction), inner.into(), outer.into()),
        _ => 1.0,
    };
    light.intensity.as_dvec3() * falloff * area / ray.length().powi(3)
}

impl Picked {
    /// Face and texel that a light stands on: the one that its direction from the source passes through.
    fn texel(&self, light: &VirtualLight) -> (usize, usize, usize) {
        let find = |(index, face): (usize, &RsmFace)| {
            let offset = (light.position - face.position).as_dvec3();
            let distance = offset.dot(face.forward.as_dvec3());
            let along = |axis: Vec3| offset.dot(axis.as_dvec3()) / axis.as_dvec3().length_squared() / distance;
            let (u, v) = (0.5 + 0.5 * along(face.right), 0.5 - 0.5 * along(face.up));
            let inside = face.light == light.source && distance > 0.0 && (0.0..1.0).contains(&u) && (0.0..1.0).contains(&v);
            inside.then_some((index, (u * SIDE as f64) as usize, (v * SIDE as f64) as usize))
        };
        self.faces.iter().enumerate().find_map(find).unwrap_or_else(|| panic!("{light:?} is in no face"))
    }

    /// Flux of a texel per light, weighted: an estimate of its sum over all texels.
    fn estimate(&self, weight: impl Fn(DVec3, u32) -> f64) -> DVec3 {
        self.lights.iter().map(|light| light.flux.as_dvec3() * weight(light.position.as_dvec3(), light.core.y)).sum()
    }

    /// That sum itself.
    fn truth(&self, scene: &Scene, weight: impl Fn(DVec3, u32) -> f64) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (index, face) in self.faces.iter().enumerate() {
            for (x, y) in (0..SIDE * SIDE).map(|texel| (texel % SIDE, texel / SIDE)) {
                let depth = self.depth[index][y * SIDE + x];
                if depth > 0.0 {
                    let position = face.position.as_dvec3() + ray(face, x, y) * (f64::from(face.near) / depth);
                    sum += flux(scene, face, x, y) * weight(position, self.core[index][2 * (y * SIDE + x) + 1]);
                }
            }
        }
        sum
    }
}

#[test]
fn lights_stand_on_texels_and_reflect_as_they_do() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let picked = pick(gpu, &scene, 500, 0, 1);
    let mut faces_met = [false; 7];
    for light in &picked.lights {
        let (index, x, y) = picked.texel(light);
        let (face, texel) = (&picked.faces[index], y * SIDE + x);
        faces_met[index] = true;
        assert_eq!([light.core.x, light.core.y], [picked.core[index][2 * texel], picked.core[index][2 * texel + 1]]);
        assert_eq!(light.specular, picked.specular[index][texel]);
        let distance = f64::from(face.near) / picked.depth[index][texel];
        let centre = face.position.as_dvec3() + ray(face, x, y) * distance;
        // A 256th of a texel above the surface, and no farther.
        let footprint = 2.0 * f64::from(face.right.length()) / SIDE as f64 * distance;
        let normal = unpack_unit(light.geometric_normal);
        let lifted = light.position.as_dvec3() - centre;
        assert!((lifted - normal * footprint / 256.0).length() < 2e-6 * (1.0 + distance), "{lifted} at {centre}");
        let to_source = (face.position.as_dvec3() - light.position.as_dvec3()).normalize();
        assert!((to_source - light.direction_to_source.as_dvec3()).length() < 1e-5);
        assert!(normal.dot(to_source) > 0.0, "turned to the source");
        assert_eq!(light.radius, 0.0);
        // The colour of what the texel receives.
        let expected = flux(&scene, face, x, y);
        let ratio = light.flux.as_dvec3() / expected;
        assert!((ratio / ratio.x - 1.0).abs().max_element() < 1e-4, "{ratio}");
    }
    assert!(faces_met.iter().filter(|met| **met).count() >= 3, "{faces_met:?}");
}

/// Flux over probability is an unbiased estimate of any sum over texels.
#[test]
fn sums_over_lights_are_sums_over_texels() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let picked = pick(gpu, &scene, 65536, 0, 2);
    let blue = |word: u32| (f64::from(word >> 22) / 1023.0).powi(2);
    let one = |_: DVec3, _: u32| 1.0;
    let albedo = |_: DVec3, word: u32| blue(word);
    let left = |position: DVec3, _: u32| f64::from(position.x < 0.3);
    let height = |position: DVec3, _: u32| position.y.abs();
    let near = |estimate: DVec3, truth: DVec3| (estimate / truth - 1.0).abs().max_element();
    let errors = [
        near(picked.estimate(one), picked.truth(&scene, one)),
        near(picked.estimate(albedo), picked.truth(&scene, albedo)),
        near(picked.estimate(left), picked.truth(&scene, left)),
        near(picked.estimate(height), picked.truth(&scene, height)),
    ];
    println!("relative errors with 65536 lights: {errors:?}");
    assert!(errors.iter().all(|error| *error < 5e-3), "{errors:?}");
    // A sum over other texels is told apart.
    assert!(near(picked.estimate(one), picked.truth(&scene, left)) > 0.05);
    let mut brighter = scene.clone();
    brighter.lights[1].intensity *= 1.05;
    assert!(near(picked.estimate(one), picked.truth(&brighter, one)) > 1e-2);
}

#[test]
fn equal_seeds_give_equal_lights() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let positions =
        |offset: u32, seed: u32| pick(gpu, &scene, 64, offset, seed).lights.iter().map(|light| light.position).collect::<Vec<Vec3>>();
    let first = positions(0, 5);
    assert_eq!(first, positions(0, 5));
    assert_eq!(first, positions(2, 3), "the parameter is added to the run's seed");
    assert_ne!(first, positions(0, 6));
}

#[test]
fn dark_and_absurd_sources() {
    let Some(gpu) = gpu() else { return };
    let mut scene = scene();
    // Below and above, sums of flux leave the range of floats, and all lights are dark. The safety net in `run` counts what is not finite.
    for (strength, least_lit) in [(0.0, 0), (1e-38, 0), (1e-20, 99), (1e20, 99), (1e37, 99), (f32::MAX, 0)] {
        for light in &mut scene.lights {
            light.intensity = Vec3::new(strength, 0.0, strength * 0.5);
        }
        let picked = pick(gpu, &scene, 100, 0, 0);
        let lit = picked.lights.iter().filter(|light| light.flux != Vec3::ZERO).count();
        assert!(lit >= least_lit && (strength > 0.0 || lit == 0), "{strength}: {lit} of 100 are lit");
    }
}
