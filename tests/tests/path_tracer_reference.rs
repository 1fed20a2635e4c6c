//! The path tracer against the images of an independent renderer: every setup, all three light paths.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia::{
    measure::{Image, mean, read_exr, relative_mse},
    reference::{LightPaths, Picture, Render, Settings},
    scene::{Camera, Scene},
};
use lobelia_tests::shared;
use serde_json::Value;
use std::path::Path;

/// Samples per pixel: enough passes for an estimate of the noise, few enough for a test.
const SAMPLES: u64 = 32;

fn triple(value: &Value) -> DVec3 {
    let at = |index: usize| value[index].as_f64().unwrap();
    DVec3::new(at(0), at(1), at(2))
}

/// The scene of a setup as its description says; environments are added by a wrapper, which also takes the file's own lights away.
fn scene(shared: &Path, setup: &Value) -> Scene {
    let file = shared.join("scenes").join(setup["scene"].as_str().unwrap());
    let sky = setup["lights"].as_array().unwrap().iter().find(|light| light["type"] == "environment");
    let environment = sky.map_or_else(String::new, |light| {
        let picture = shared.join("scenes/environments").join(light["file"].as_str().unwrap());
        format!("environment: (file: {:?}, scale: {}), keep_lights: false,", picture, light["scale"])
    });
    let folder = tempfile::tempdir().unwrap();
    let wrapper = folder.path().join("scene.ron");
    std::fs::write(&wrapper, format!("(gltf: {:?}, ndf: {}, {environment})", file, setup["ndf"].as_str().unwrap())).unwrap();
    Scene::load(wrapper.to_str().unwrap()).unwrap()
}

fn render(scene: &Scene, setup: &Value, paths: LightPaths) -> Picture {
    let camera = &setup["camera"];
    let [origin, target, up] = ["origin", "target", "up"].map(|key| triple(&camera[key]));
    let camera = Camera::look_at("reference", origin, target, up, camera["yfov"].as_f64().unwrap(), 0.01).unwrap();
    let size = ["width", "height"].map(|key| setup[key].as_u64().unwrap() as u32);
    let mut render = Render::new(scene, &camera, Settings { size, paths, samples: SAMPLES, seed: 11 }).unwrap();
    while render.done() < render.passes() {
        render.step();
    }
    render.picture()
}

/// What a picture may be off by, from its noise and that of the reference: relative MSE twice their sum, means of channels five standard errors of both.
struct Bound {
    relative_mse: f64,
    mean: [f64; 3],
}

fn bound(picture: &Picture, reference: &Image, statistics: &Value) -> Bound {
    let count = picture.pixels.len() as f64;
    let theirs = triple(&statistics["standard_error_of_mean"]).to_array();
    let mean_of_all = mean(reference).iter().sum::<f64>() / 3.0;
    // Against the reference's values: a bright speck would hide its own variance behind its own square.
    let values = reference.pixels.as_flattened().iter().zip(picture.variance.as_flattened());
    let noise =
        values.map(|(value, variance)| f64::from(*variance) / (f64::from(*value).powi(2) + (0.1 * mean_of_all).powi(2))).sum::<f64>()
            / (3.0 * count);
    let mean = [0, 1, 2].map(|channel| {
        let variance: f64 = picture.variance.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>() / (count * count);
        5.0 * (variance + theirs[channel] * theirs[channel]).sqrt()
    });
    Bound { relative_mse: 2.0 * (noise + statistics["relmse_noise"].as_f64().unwrap()), mean }
}

#[test]
fn every_reference_image_is_met_within_its_noise() {
    let Some(shared) = shared() else { return };
    let mut setups = 0;
    let mut failed = Vec::new();
    let mut names: Vec<_> = std::fs::read_dir(shared.join("reference")).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.retain(|path| path.extension().is_some_and(|ending| ending == "json"));
    names.sort();
    for description in names {
        let setup: Value = serde_json::from_str(&std::fs::read_to_string(&description).unwrap()).unwrap();
        let name = setup["name"].as_str().unwrap().to_owned();
        let scene = scene(&shared, &setup);
        setups += 1;
        // The reference renderer stretches an environment so that the centres of its first and last row of pixels are the poles; here the rows' edges are, as the
        // centres of columns and the images of other programs have it. That is half a pixel near the poles: means of light from skies differ by up to 0.2 %.
        let sky = if scene.environment.is_some() { 2.5e-3 } else { 0.0 };
        for (file, paths) in [("direct", LightPaths::Direct), ("indirect1", LightPaths::OneBounce), ("full", LightPaths::Full { depth: 6 })]
        {
            let reference = read_exr(&shared.join(format!("reference/{name}_{file}.exr"))).unwrap();
            let picture = render(&scene, &setup, paths);
            assert_eq!(picture.dropped, 0, "{name} {file}");
            let image = Image { width: reference.width, height: reference.height, pixels: picture.pixels.clone() };
            let bound = bound(&picture, &reference, &setup["statistics"][file]);
            let found = relative_mse(&reference, &image).unwrap();
            let (ours, theirs) = (mean(&image), mean(&reference));
            let ratios = [0, 1, 2].map(|channel| ours[channel] / theirs[channel]);
            println!(
                "{name:26} {file:9} relative MSE {found:.2e} (allowed {:.2e}), means over the reference {ratios:.4?}",
                bound.relative_mse
            );
            let wrong = (0..3).any(|channel| (ours[channel] - theirs[channel]).abs() > bound.mean[channel] + sky * theirs[channel]);
            if found > bound.relative_mse || wrong {
                failed.push(format!("{name} {file}: {found:.2e} of {:.2e}, {ratios:.4?}, {:.6?}", bound.relative_mse, bound.mean));
            }
            // The bound is no formality: two percent more light does not pass on the setups whose means are known that well.
            if file == "direct" && sky == 0.0 {
                assert!((0..3).all(|channel| 0.02 * theirs[channel] > bound.mean[channel]), "{name}: {:.6?}", bound.mean);
            }
        }
    }
    assert_eq!(setups, 9);
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
