//! The G-buffer and direct light against path-traced reference images.
#![allow(clippy::unwrap_used)]

use exr::prelude::{AnyChannels, FlatSamples, Layer, read_all_flat_layers_from_file};
use glam::{DVec2, DVec3};
use lobelia::{
    Session, SessionOptions, Shot,
    graph::{GraphFile, PartData},
    lobes::octahedral::octahedral_decode,
    measure::{Image, Mask, Statistics, compare, read_exr},
    scene::Ndf,
};
use lobelia_tests::{Render, has_gpu, shared};
use std::path::Path;

/// A reference setup: name, scene, size, distribution.
struct Setup {
    name: &'static str,
    scene: &'static str,
    extent: [u32; 2],
    ndf: Ndf,
}

const BOX: Setup = Setup { name: "cornell-glossy-main", scene: "builtin:cornell-glossy", extent: [240, 240], ndf: Ndf::Ggx };
const PHONG_BOX: Setup = Setup { name: "cornell-glossy-main-phong", ndf: Ndf::Phong, ..BOX };
const RING: Setup = Setup { name: "ring-caustic-main", scene: "builtin:ring-caustic", extent: [320, 180], ndf: Ndf::Ggx };
/// Brick and tile with normal maps, in the folder of optional material.
const ATRIUM: Setup = Setup { name: "atrium-main", scene: "atrium/atrium.glb", extent: [320, 180], ndf: Ndf::Ggx };

impl Setup {
    fn scene(&self, shared: &Path) -> String {
        if self.scene.starts_with("builtin:") { self.scene.into() } else { shared.join("scenes").join(self.scene).display().to_string() }
    }

    /// Direct light averaged over 16 sub-pixel positions.
    fn render(&self, shared: &Path, variants: &[&str], set: &[&str]) -> Image {
        let shot = Shot { extent: self.extent, samples: 16, camera: Some("main".into()), ..Shot::default() };
        let scene = self.scene(shared);
        Render { graph: "direct.ron", scene: &scene, variants, set, ndf: self.ndf, shot }.radiance("direct.radiance").unwrap()
    }

    fn direct(&self, shared: &Path) -> Image {
        read_exr(&shared.join(format!("reference/{}_direct.exr", self.name))).unwrap()
    }

    fn seen(&self, shared: &Path) -> Seen {
        Seen::read(&shared.join(format!("reference/{}_gbuffer.exr", self.name)))
    }
}

/// What the reference sees through pixel centres.
struct Seen {
    width: usize,
    /// Turned to the viewer; zero where nothing is hit.
    normals: Vec<DVec3>,
    /// Along the ray, metres; zero where nothing is hit.
    distances: Vec<f64>,
}

impl Seen {
    fn read(path: &Path) -> Self {
        let file = read_all_flat_layers_from_file(path).unwrap();
        let channel = |wanted: &str| -> Vec<f64> {
            // `N.X` is read as channel X of layer N.
            let is_wanted = |layer: &Layer<AnyChannels<FlatSamples>>, channel: &str| match &layer.attributes.layer_name {
                Some(layer) => format!("{layer}.{channel}") == wanted,
                None => channel == wanted,
            };
            let find = |layer: &Layer<AnyChannels<FlatSamples>>| {
                let found = layer.channel_data.list.iter().find(|channel| is_wanted(layer, &channel.name.to_string()));
                found.map(|channel| channel.sample_data.values_as_f32().map(f64::from).collect())
            };
            file.layer_data.iter().find_map(find).unwrap()
        };
        let [x, y, z] = ["N.X", "N.Y", "N.Z"].map(channel);
        let normals = (0..x.len()).map(|index| DVec3::new(x[index], y[index], z[index])).collect();
        Self { width: file.layer_data[0].size.width(), normals, distances: channel("Z") }
    }

    /// Pixels away from outlines, creases and, where direct light is given, shadow edges: a pixel counts unless one within `margin` pixels differs
    /// abruptly from its neighbour.
    fn smooth(&self, direct: Option<&Image>, margin: usize) -> Mask {
        let mean = |pixel: &[f32; 3]| pixel.iter().map(|value| f64::from(*value)).sum::<f64>() / 3.0;
        let light: Vec<f64> = direct.map_or_else(|| vec![0.0; self.distances.len()], |image| image.pixels.iter().map(mean).collect());
        let floor = 0.1 * light.iter().sum::<f64>() / light.len() as f64;
        let abrupt = |a: usize, b: usize| {
            let (near, far) = (self.distances[a].min(self.distances[b]), self.distances[a].max(self.distances[b]));
            let (dark, bright) = (light[a].min(light[b]), light[a].max(light[b]));
            far > 1.05 * near || self.normals[a].dot(self.normals[b]) < 0.9 || bright - dark > 0.2 * bright + floor
        };
        let height = self.distances.len() / self.width;
        let counts = (0..self.distances.len()).map(|index| {
            let (x, y) = (index % self.width, index / self.width);
            !((x + 1 < self.width && abrupt(index, index + 1)) || (y + 1 < height && abrupt(index, index + self.width)))
        });
        Mask { counts: counts.collect() }.eroded(self.width, margin)
    }
}

/// Angles to the reference's normals and relative errors of distance, for every pixel of the mask.
fn gbuffer_errors(setup: &Setup, shared: &Path) -> Vec<[f64; 2]> {
    let text = r#"(passes: {"gbuffer": gbuffer()}, output: "gbuffer.gbuffer")"#;
    let wired = GraphFile::parse(text, "gbuffer.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let options = SessionOptions { baseline: true, ..SessionOptions::default() };
    let mut session = Session::new(&setup.scene(shared), &options).unwrap();
    let camera = session.scene().camera(Some("main")).unwrap();
    let shot = Shot { extent: setup.extent, camera: Some("main".into()), ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).unwrap();
    rendering.run(&mut |_| true).unwrap();
    let parts = rendering.runner().read(rendering.gpu(), "gbuffer.gbuffer").unwrap();
    let texture = |name: &str| {
        parts.iter().find_map(|(part, data)| match data {
            PartData::Texture(layers) if part.name == name => Some(layers[0].clone()),
            _ => None,
        })
    };
    let depth = texture("depth").unwrap().to_f32_rgba();
    // The reference shows the interpolated normal, which is apart only where there are normal maps.
    let (packed, stride) = match texture("geometric_normal") {
        Some(normal) => (normal.to_u32(), 1),
        None => (texture("core").unwrap().to_u32(), 2),
    };
    let seen = setup.seen(shared);
    let mask = seen.smooth(None, 1);
    let [width, height] = setup.extent.map(|side| side as usize);
    let tangent = (camera.yfov / 2.0).tan();
    let mut errors = Vec::new();
    for index in (0..width * height).filter(|index| mask.counts[*index]) {
        let (x, y) = ((index % width) as f64, (index / width) as f64);
        let ndc = DVec2::new(2.0 * (x + 0.5) / width as f64 - 1.0, 1.0 - 2.0 * (y + 0.5) / height as f64);
        let ray = DVec3::new(ndc.x * tangent * width as f64 / height as f64, ndc.y * tangent, 1.0).length();
        let depth = f64::from(depth[index][0]);
        assert_eq!(depth > 0.0, seen.distances[index] > 0.0, "{} ({x}, {y})", setup.name);
        if depth > 0.0 {
            let snorm = |bits: u32| f64::from(bits as u16 as i16).max(-32767.0) / 32767.0;
            let word = packed[index * stride];
            let normal = octahedral_decode(DVec2::new(snorm(word), snorm(word >> 16)));
            let angle = normal.angle_between(seen.normals[index].normalize());
            errors.push([angle, (camera.near / depth * ray / seen.distances[index] - 1.0).abs()]);
        }
    }
    errors
}

#[test]
fn surfaces_lie_where_rays_meet_them() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    for setup in [&BOX, &RING, &ATRIUM] {
        let errors = gbuffer_errors(setup, &shared);
        assert!(errors.len() > 30_000, "{}: {} pixels", setup.name, errors.len());
        // A crease narrower than the distance of two rays escapes the mask: one pixel in ten thousand may see its other side.
        let outliers = errors.iter().filter(|[angle, distance]| *angle > 1e-4 || *distance > 3e-6).count();
        println!("{}: {outliers} of {} pixels are not within 1e-4 rad and 3e-6 of the distance", setup.name, errors.len());
        assert!(outliers * 10_000 <= errors.len(), "{}: {outliers}", setup.name);
    }
}

/// Over the whole picture, and away from outlines and shadow edges.
fn errors(setup: &Setup, shared: &Path, variants: &[&str], set: &[&str]) -> [Statistics; 2] {
    let (reference, image) = (setup.direct(shared), setup.render(shared, variants, set));
    let smooth = setup.seen(shared).smooth(Some(&reference), 2);
    let found = [Mask::all(&reference), smooth.clone()].map(|mask| compare(&reference, &image, &mask).unwrap());
    let (name, share) = (setup.name, 100.0 * smooth.share());
    let [whole, away] = [found[0].relative_mse, found[1].relative_mse];
    println!(
        "{name} {variants:?} {set:?}: relative MSE {whole:.2e}; {away:.2e} in the {share:.0} % away from edges; mean {:.4}",
        found[0].mean_ratio
    );
    assert!(smooth.share() > 0.4, "the mask leaves too little to mean anything");
    found
}

#[test]
fn direct_light_is_that_of_the_reference() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    // The default map of 512 texels, and the finer one of the graphs.
    for resolution in ["rsm.resolution=512", "rsm.resolution=1024"] {
        for setup in [&BOX, &PHONG_BOX, &RING] {
            let [whole, away] = errors(setup, &shared, &[], &[resolution]);
            assert!(whole.relative_mse < 1e-2 && away.relative_mse < 1e-4, "{}", setup.name);
            assert!((whole.mean_ratio - 1.0).abs() < 2e-3, "{}", setup.name);
        }
    }
    // Half of what the light sees here are edges of columns and curtains, and of bricks in the normal maps.
    let [whole, away] = errors(&ATRIUM, &shared, &[], &["rsm.resolution=1024"]);
    assert!(away.relative_mse < 1e-4 && (whole.mean_ratio - 1.0).abs() < 2e-3, "{}", ATRIUM.name);
}

#[test]
fn what_is_wrong_is_seen() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    let [whole, _] = errors(&BOX, &shared, &["unshadowed"], &[]);
    assert!(whole.relative_mse > 5e-2, "no shadows");
    let [_, away] = errors(&Setup { ndf: Ndf::Phong, ..BOX }, &shared, &[], &[]);
    assert!(away.relative_mse > 1e-3, "another distribution");
}

/// Planes shade without a bias. Plain depth comparison without one covers every surface with acne.
#[test]
fn planes_need_no_bias() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    for setup in [&BOX, &RING] {
        let away = |set: &[&str]| errors(setup, &shared, &[], set)[1].relative_mse;
        assert!(away(&["direct.bias=0"]) < 1e-4);
        assert!(away(&["direct.bias=0", "direct.comparison=depth"]) > 1e-2);
        assert!(away(&["direct.bias=1", "direct.comparison=depth"]) < 1e-4);
    }
}
