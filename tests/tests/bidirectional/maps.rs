//! Weights and reflective shadow maps, read back.

use crate::given::{Given, Pixel, Random, pack_unit, run, turn, view};
use glam::{DVec2, DVec3};
use lobelia::{
    frame::{RsmFace, SceneWorld},
    graph::{Gpu, PartData, Runner, TextureData},
    scene::{LightKind, Scene},
};
use lobelia_lobes::light::spot_falloff;

pub fn layers(runner: &Runner<SceneWorld>, gpu: &Gpu, name: &str, part: &str) -> Vec<TextureData> {
    let parts = runner.read(gpu, name).unwrap();
    match parts.into_iter().find(|(found, _)| found.name == part) {
        Some((_, PartData::Texture(layers))) => layers,
        _ => panic!("{name} has no texture {part}"),
    }
}

/// The finest level of a sampling density: all faces, row by row.
pub fn weights(runner: &Runner<SceneWorld>, gpu: &Gpu, name: &str) -> Vec<f64> {
    let layers = layers(runner, gpu, name, "weights");
    layers.iter().flat_map(|layer| layer.to_f32_rgba()).map(|texel| f64::from(texel[0])).collect()
}

/// Weights of `brsm` with the given parameters and of `flux-density`, on given pixels.
pub fn both(gpu: &Gpu, scene: &Scene, given: &Given, side: u32, parameters: &str, seed: u32) -> (Vec<f64>, Vec<f64>) {
    let _turn = turn();
    let specular = scene.traits().specular;
    let text = format!(
        r#"(passes: {{
            "surfaces": given_gbuffer(specular: {specular}),
            "rsm": rsm(resolution: {side}),
            "flux": flux_density(),
            "density": brsm({parameters}),
        }}, output: "density.density")"#
    );
    let runner = run(gpu, &text, scene, given, &["flux.density"], seed).unwrap();
    (weights(&runner, gpu, "density.density"), weights(&runner, gpu, "flux.density"))
}

/// Surfaces of any material that more or less face the camera, `nearest` to twice as many metres away; every ninth pixel sees nothing.
pub fn pixels(scene: &Scene, nearest: f64, random: &mut Random) -> Given {
    let near = f64::from(view(scene).near);
    let pixels = (0..crate::given::PIXELS).map(|index| {
        let normal = pack_unit((DVec3::Z + random.direction() * 0.5).normalize());
        let (color, specular) = random.material();
        let depth = if index % 9 == 4 { 0.0 } else { (near / (nearest * (1.0 + random.next()))) as f32 };
        Pixel { depth, core: [normal, color], specular, geometric_normal: normal }
    });
    Given { pixels: pixels.collect(), ..Given::default() }
}

/// A reflective shadow map as the device has drawn it.
pub struct Map {
    pub side: usize,
    pub faces: Vec<RsmFace>,
    pub depth: Vec<f64>,
    pub core: Vec<u32>,
    pub specular: Vec<u32>,
}

impl Map {
    pub fn read(runner: &Runner<SceneWorld>, gpu: &Gpu, side: usize) -> Self {
        let words = |part: &str| layers(runner, gpu, "rsm.rsm", part).iter().flat_map(TextureData::to_u32).collect();
        let parts = runner.read(gpu, "rsm.rsm").unwrap();
        let Some((_, PartData::Buffer(faces))) = parts.iter().find(|(part, _)| part.name == "faces") else { panic!("no faces") };
        let depth = layers(runner, gpu, "rsm.rsm", "depth");
        Self {
            side,
            faces: encase::StorageBuffer::new(faces.clone()).create().unwrap(),
            depth: depth.iter().flat_map(|layer| layer.to_f32_rgba()).map(|texel| f64::from(texel[0])).collect(),
            core: words("core"),
            specular: words("specular"),
        }
    }

    /// Face, column and row of a texel.
    pub fn place(&self, index: usize) -> (&RsmFace, usize, usize) {
        let in_face = index % (self.side * self.side);
        (&self.faces[index / (self.side * self.side)], in_face % self.side, in_face / self.side)
    }

    pub fn ray(&self, index: usize) -> DVec3 {
        let (face, x, y) = self.place(index);
        let side = self.side as f64;
        let ndc = DVec2::new(2.0 * (x as f64 + 0.5) / side - 1.0, 1.0 - 2.0 * (y as f64 + 0.5) / side);
        face.forward.as_dvec3() + face.right.as_dvec3() * ndc.x + face.up.as_dvec3() * ndc.y
    }

    /// Distance along the view of the face.
    pub fn distance(&self, index: usize) -> f64 {
        f64::from(self.place(index).0.near) / self.depth[index]
    }

    /// Width of a texel across the view.
    pub fn footprint(&self, index: usize) -> f64 {
        2.0 * f64::from(self.place(index).0.right.length()) / self.side as f64 * self.distance(index)
    }

    /// Where a light on the texel stands.
    pub fn position(&self, index: usize, normal: DVec3) -> DVec3 {
        let centre = self.place(index).0.position.as_dvec3() + self.ray(index) * self.distance(index);
        centre + normal * (self.footprint(index) / 256.0)
    }

    /// Flux through a texel of a perspective face, W.
    pub fn flux(&self, scene: &Scene, index: usize) -> DVec3 {
        let face = self.place(index).0;
        let light = &scene.lights[face.light as usize];
        let ray = self.ray(index);
        let area = 4.0 * f64::from(face.right.length()) * f64::from(face.up.length()) / (self.side * self.side) as f64;
        let falloff = match light.kind {
            LightKind::Spot { inner, outer } => spot_falloff(ray.normalize().dot(light.direction), inner.into(), outer.into()),
            _ => 1.0,
        };
        light.intensity.as_dvec3() * falloff * area / ray.length().powi(3)
    }
}
