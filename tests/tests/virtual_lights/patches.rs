//! `patch-moments` and `vsgl-lights` on real reflective shadow maps: averages over blocks of texels, and the lights that are read from them.

use crate::given::{Given, run, turn, unpack_unit};
use glam::{DVec2, DVec3, Vec3};
use lobelia::{
    frame::{RsmFace, VirtualLight},
    graph::{Gpu, PartData, TextureData, testing::gpu},
    scene::{LightKind, Scene},
};
use lobelia_lobes::{
    brdf::{Brdf, Distribution},
    light::spot_falloff,
    luminance,
};

const SIDE: usize = 40;
const PADDED: usize = 64;

struct Seen {
    faces: Vec<RsmFace>,
    depth: Vec<Vec<f64>>,
    core: Vec<Vec<u32>>,
    specular: Vec<Vec<u32>>,
    /// Words of all records, 16 each.
    moments: Vec<u32>,
}

fn scene() -> Scene {
    Scene::load("builtin:spheres").unwrap()
}

fn seen(gpu: &Gpu, scene: &Scene) -> Seen {
    let _turn = turn();
    let text = format!(r#"(passes: {{"rsm": rsm(resolution: {SIDE}), "moments": patch_moments()}}, output: "moments.moments")"#);
    let runner = run(gpu, &text, scene, &Given::default(), &["rsm.rsm"], 0).unwrap();
    let maps = runner.read(gpu, "rsm.rsm").unwrap();
    let part = |name: &str| maps.iter().find(|(part, _)| part.name == name).map(|(_, data)| data.clone()).unwrap();
    let layers = |name: &str| match part(name) {
        PartData::Texture(layers) => layers,
        PartData::Buffer(_) => panic!("{name} is a texture"),
    };
    let words = |layers: Vec<TextureData>| layers.iter().map(TextureData::to_u32).collect();
    let bytes = |data: &PartData| match data {
        PartData::Buffer(bytes) => bytes.clone(),
        PartData::Texture(_) => panic!("a buffer"),
    };
    Seen {
        faces: encase::StorageBuffer::new(bytes(&part("faces"))).create().unwrap(),
        depth: layers("depth").iter().map(|layer| layer.to_f32_rgba().iter().map(|texel| f64::from(texel[0])).collect()).collect(),
        core: words(layers("core")),
        specular: words(layers("specular")),
        moments: bytemuck::pod_collect_to_vec(&bytes(&runner.read(gpu, "moments.moments").unwrap()[0].1)),
    }
}

/// What one texel adds to a block, in f64.
#[derive(Clone, Copy)]
struct Texel {
    position: DVec3,
    variance: f64,
    diffuse: DVec3,
    specular: DVec3,
    normal: DVec3,
}

impl Texel {
    fn weight(&self) -> f64 {
        luminance(self.diffuse + self.specular)
    }
}

fn texel(seen: &Seen, scene: &Scene, index: usize, x: usize, y: usize) -> Option<Texel> {
    if x >= SIDE || y >= SIDE {
        return None;
    }
    let (face, place) = (&seen.faces[index], y * SIDE + x);
    let depth = seen.depth[index][place];
    if depth <= 0.0 {
        return None;
    }
    let light = &scene.lights[face.light as usize];
    let ndc = DVec2::new(2.0 * (x as f64 + 0.5) / SIDE as f64 - 1.0, 1.0 - 2.0 * (y as f64 + 0.5) / SIDE as f64);
    let [right, up, forward] = [face.right, face.up, face.forward].map(|axis| axis.as_dvec3());
    let ray = forward + right * ndc.x + up * ndc.y;
    let distance = f64::from(face.near) / depth;
    let position = face.position.as_dvec3() + ray * distance;
    let to_light = -ray.normalize();
    let falloff = match light.kind {
        LightKind::Spot { inner, outer } => spot_falloff(ray.normalize().dot(light.direction), inner.into(), outer.into()),
        _ => 1.0,
    };
    let area = 4.0 * right.length() * up.length() / (SIDE * SIDE) as f64;
    let flux = light.intensity.as_dvec3() * falloff * area / ray.length().powi(3);
    let normal = unpack_unit(seen.core[index][2 * place]);
    let color = seen.core[index][2 * place + 1];
    let channel = |shift: u32, most: u32| (f64::from(color >> shift & most) / f64::from(most)).powi(2);
    let (base, word) = (DVec3::new(channel(0, 2047), channel(11, 2047), channel(22, 1023)), seen.specular[index][place]);
    let [roughness, metallic, scale] =
        [(word & 65535, 65535.0), (word >> 16 & 255, 255.0), (word >> 24, 255.0)].map(|(bits, most)| f64::from(bits) / most);
    let brdf = Brdf::new(base, metallic, roughness, scale, Distribution::Ggx);
    let cosine = normal.dot(to_light).max(0.0);
    let footprint = 2.0 * right.length() / SIDE as f64 * distance;
    Some(Texel {
        position,
        variance: footprint * footprint / 12.0 * (1.0 + 1.0 / cosine.max(0.05).powi(2)),
        diffuse: flux * brdf.diffuse * std::f64::consts::PI,
        specular: flux * brdf.specular_albedo(cosine),
        normal,
    })
}

/// Position, variance, diffuse and specular flux, one minus the squared length of the mean normal.
type Averages = (DVec3, f64, DVec3, DVec3, f64);

fn expected(seen: &Seen, scene: &Scene, level: usize, face: usize, block: [usize; 2], weighted: bool) -> Option<Averages> {
    let size = 1 << level;
    let texels: Vec<Texel> = (0..size * size)
        .filter_map(|place| texel(seen, scene, face, block[0] * size + place % size, block[1] * size + place / size))
        .collect();
    let weight = |texel: &Texel| if weighted { texel.weight() } else { 1.0 };
    let all: f64 = texels.iter().map(weight).sum();
    if all <= 0.0 {
        return None;
    }
    let mean = |of: &dyn Fn(&Texel) -> DVec3| texels.iter().map(|texel| of(texel) * weight(texel)).sum::<DVec3>() / all;
    let position = mean(&|texel| texel.position);
    let variance =
        texels.iter().map(|texel| weight(texel) * (texel.variance + (texel.position - position).length_squared())).sum::<f64>() / all;
    let flux = |of: &dyn Fn(&Texel) -> DVec3| texels.iter().map(of).sum::<DVec3>() / (size * size) as f64;
    let normal = 1.0 - mean(&|texel| texel.normal).length_squared();
    Some((position, variance, flux(&|texel| texel.diffuse), flux(&|texel| texel.specular), normal))
}

fn stored(seen: &Seen, level: usize, face: usize, block: [usize; 2]) -> Averages {
    let faces = seen.faces.len();
    let before: usize = (2..level).map(|level| (PADDED >> level).pow(2) * faces).sum();
    let side = PADDED >> level;
    let words = &seen.moments[16 * (before + face * side * side + block[1] * side + block[0])..][..16];
    let float = |word: usize| f64::from(f32::from_bits(words[word]));
    let vector = |word: usize| DVec3::new(float(word), float(word + 1), float(word + 2));
    (vector(0), float(3), vector(4), vector(8), float(12))
}

/// Largest error relative to the block's own size and flux.
fn off(found: &Averages, expected: &Averages) -> f64 {
    let size = expected.1.sqrt();
    let flux = luminance(expected.2 + expected.3);
    [
        (found.0 - expected.0).length() / size,
        (found.1 / expected.1 - 1.0).abs(),
        (found.2 - expected.2).abs().max_element() / flux,
        (found.3 - expected.3).abs().max_element() / flux,
        (found.4 - expected.4).abs(),
    ]
    .into_iter()
    .fold(0.0, |most, error| if error.is_nan() { f64::INFINITY } else { f64::max(most, error) })
}

#[test]
fn averages_are_those_of_their_texels() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let seen = seen(gpu, &scene);
    let (mut blocks, mut worst, mut unweighted) = (0, 0f64, 0);
    for level in 2..=6 {
        for face in 0..seen.faces.len() {
            for place in 0..(PADDED >> level).pow(2) {
                let block = [place % (PADDED >> level), place / (PADDED >> level)];
                let found = stored(&seen, level, face, block);
                let Some(wanted) = expected(&seen, &scene, level, face, block, true) else {
                    assert!(found.2 + found.3 == DVec3::ZERO, "nothing is seen in block {block:?} of level {level}, but it has flux");
                    continue;
                };
                blocks += 1;
                worst = worst.max(off(&found, &wanted));
                let plain = expected(&seen, &scene, level, face, block, false).unwrap();
                unweighted += usize::from(off(&found, &plain) > 1e-2);
            }
        }
    }
    assert!(blocks > 300, "only {blocks} blocks see anything");
    assert!(worst < 2e-3, "off by up to {worst}");
    // What the comparison must reject: averages that weigh every texel alike.
    assert!(unweighted > blocks / 10, "only {unweighted} of {blocks} averages know of flux");
}

fn lights(gpu: &Gpu, scene: &Scene, set: &str, seed: u32) -> (Vec<VirtualLight>, Vec<[f32; 16]>) {
    let _turn = turn();
    let text = format!(
        r#"(passes: {{"rsm": rsm(resolution: 256), "density": flux_density(), "moments": patch_moments(), "lights": vsgl_lights({set})}}, output: "lights.lights")"#
    );
    let runner = run(gpu, &text, scene, &Given::default(), &[], seed).unwrap();
    let parts = runner.read(gpu, "lights.lights").unwrap();
    let bytes = |name: &str| match &parts.iter().find(|(part, _)| part.name == name).unwrap().1 {
        PartData::Buffer(bytes) => bytes.clone(),
        PartData::Texture(_) => panic!("a buffer"),
    };
    let lobes = bytemuck::pod_collect_to_vec(&bytes("lobes"));
    (encase::StorageBuffer::new(bytes("lights")).create().unwrap(), lobes)
}

/// Diffuse and specular flux of all lights, W.
fn total(lobes: &[[f32; 16]]) -> DVec3 {
    lobes.iter().map(|lobe| DVec3::new((lobe[4] + lobe[8]).into(), (lobe[5] + lobe[9]).into(), (lobe[6] + lobe[10]).into())).sum()
}

fn median_radius(lobes: &[[f32; 16]]) -> f64 {
    let mut radii: Vec<f32> = lobes.iter().map(|lobe| lobe[3]).collect();
    radii.sort_by(f32::total_cmp);
    radii[radii.len() / 2].into()
}

#[test]
fn lights_carry_the_flux_of_the_map_and_shrink_with_their_number() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let seen = seen(gpu, &scene);
    // Records of the last level are means over all texels of a face, padding included.
    let truth: DVec3 =
        (0..seen.faces.len()).map(|face| stored(&seen, 6, face, [0, 0])).map(|root| (root.2 + root.3) * (PADDED * PADDED) as f64).sum();
    let mean: DVec3 = (0..8).map(|seed| total(&lights(gpu, &scene, "count: 1024", seed).1)).sum::<DVec3>() / 8.0;
    let error = (mean / truth - 1.0).abs().max_element();
    // Maps of 40 and of 256 texels see edges differently.
    assert!(error < 0.03, "{mean} W instead of {truth} W");
    assert!((1.1 * mean / truth - 1.0).abs().max_element() > 0.03, "a tenth more passes");
    let radii = [64, 256, 1024, 4096].map(|count| median_radius(&lights(gpu, &scene, &format!("count: {count}"), 1).1));
    for pair in radii.windows(2) {
        assert!((pair[0] / pair[1] - 2.0).abs() < 0.5, "four times as many lights are half as wide: {radii:?}");
    }
    let [narrow, wide] = [1.0, 4.0].map(|overlap| median_radius(&lights(gpu, &scene, &format!("count: 4096, overlap: {overlap}"), 1).1));
    assert!((wide / narrow - 2.0).abs() < 0.3, "an overlap of four times as many lights is twice as wide: {narrow} to {wide}");
    let floor = median_radius(&lights(gpu, &scene, "count: 1024, least_radius: 4", 1).1);
    assert!(floor > 2.5 * radii[2], "least_radius: {floor} against {}", radii[2]);
}

#[test]
fn seeds_and_extremes_of_lights() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    // The last two words are padding.
    let of = |set: &str, seed: u32| -> Vec<[u32; 14]> {
        lights(gpu, &scene, set, seed).1.iter().map(|lobe| std::array::from_fn(|word| lobe[word].to_bits())).collect()
    };
    let first = of("count: 64", 3);
    assert_eq!(first, of("count: 64", 3));
    assert_eq!(first, of("count: 64, seed: 1", 2), "the parameter is added to the run's seed");
    assert_ne!(first, of("count: 64", 4));
    assert_eq!(of("count: 1", 0).len(), 1);
    let mut dark = scene.clone();
    dark.lights.iter_mut().for_each(|light| light.intensity = Vec3::ZERO);
    assert_eq!(total(&lights(gpu, &dark, "count: 64", 0).1), DVec3::ZERO);
    // Lights stand on the surface that they are the middle of.
    let (points, lobes) = lights(gpu, &scene, "count: 1024", 5);
    for (point, lobe) in points.iter().zip(&lobes) {
        let offset = (Vec3::new(lobe[0], lobe[1], lobe[2]) - point.position).as_dvec3();
        let radius = f64::from(lobe[3]).max(1e-3);
        let height = offset.dot(unpack_unit(point.geometric_normal)).abs();
        assert!(offset.length() < 1.5 * radius && height < 0.5 * radius, "{offset} from its middle, {height} above it, radius {radius}");
    }
}
