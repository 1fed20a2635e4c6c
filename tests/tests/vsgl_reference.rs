//! Virtual spherical Gaussian lights against the truth, and beside point lights: the glossy box and the ring.
#![allow(clippy::unwrap_used)]

use lobelia::{
    Shot,
    measure::{Image, Mask, compare, read_exr},
    scene::{Ndf, Scene},
};
use lobelia_tests::{Render, has_gpu, shared};

fn gathered(scene: &str, extent: [u32; 2], variant: &str, count: u32, seed: u32, set: &[&str]) -> Image {
    let lights = format!("lights.count={count}");
    let shot = Shot { extent, samples: 2, seed, ..Shot::default() };
    let mut all = vec![lights.as_str(), "rsm.resolution=512"];
    all.extend(set);
    let render = Render { graph: "indirect.ron", scene, variants: &[variant], set: &all, ndf: Ndf::Ggx, shot };
    render.radiance("indirect.radiance").unwrap()
}

fn error(reference: &Image, test: &Image) -> f64 {
    compare(reference, test, &Mask::all(reference)).unwrap().relative_mse
}

/// Mean over seeds of the relative MSE.
fn mean_error(reference: &Image, scene: &str, extent: [u32; 2], variant: &str, count: u32, set: &[&str]) -> f64 {
    (1..=3).map(|seed| error(reference, &gathered(scene, extent, variant, count, seed, set))).sum::<f64>() / 3.0
}

#[test]
fn fewer_errors_than_point_lights_on_the_glossy_box() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    let reference = read_exr(&shared.join("reference/cornell-glossy-main_indirect1.exr")).unwrap().downsampled(4).unwrap();
    let of = |variant: &str, set: &[&str]| mean_error(&reference, "builtin:cornell-glossy", [60, 60], variant, 256, set);
    let (clamped, points, patches) = (of("vpl", &[]), of("vpl", &["indirect.clamp=none"]), of("vsgl", &[]));
    println!("256 lights: patches {patches:.4}, clamped points {clamped:.4}, points {points:.4}");
    assert!(patches < 0.8 * clamped && patches < 0.8 * points, "{patches} {clamped} {points}");
    // A picture of half the light is told apart from any of them.
    let dark = gathered("builtin:cornell-glossy", [60, 60], "vsgl", 256, 1, &["lights.count=256"]);
    let halved = Image { pixels: dark.pixels.iter().map(|pixel| pixel.map(|value| 0.5 * value)).collect(), ..dark };
    assert!(error(&reference, &halved) > 2.0 * patches);
}

/// With bias reduction more lights, which are smaller, come nearer to the truth; patches that never shrink do not.
#[test]
fn more_lights_converge() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    let reference = read_exr(&shared.join("reference/cornell-glossy-main_indirect1.exr")).unwrap().downsampled(4).unwrap();
    let of = |count: u32, set: &[&str]| mean_error(&reference, "builtin:cornell-glossy", [60, 60], "vsgl-consistent", count, set);
    let errors = [of(128, &[]), of(512, &[]), of(2048, &[])];
    let stuck = of(2048, &["lights.overlap=64", "lights.least_radius=4"]);
    println!("relative MSE of 128, 512, 2048 lights: {errors:?}; of 2048 that are eight times as wide: {stuck:.4}");
    assert!(errors[1] < errors[0] && errors[2] < errors[1], "{errors:?}");
    assert!(stuck > 2.0 * errors[2], "{stuck} {errors:?}");
}

/// What flickers: the difference between pictures of independent sets of lights, over their mean. In the glossy box the clouds of `vsgl-steady` change 2.7 times less than points and patches 2.1 times.
#[test]
fn steady_lights_change_less_than_points_from_set_to_set() {
    if !has_gpu() {
        return;
    }
    let change = |variant: &str, set: &[&str]| {
        let variants = [variant, "no-visibility"];
        let of = |seed: u32| {
            let shot = Shot { extent: [60, 60], samples: 1, seed, ..Shot::default() };
            let all = [&["lights.count=256", "rsm.resolution=512"], set].concat();
            let render =
                Render { graph: "indirect.ron", scene: "builtin:cornell-glossy", variants: &variants, set: &all, ndf: Ndf::Ggx, shot };
            render.radiance("indirect.radiance").unwrap()
        };
        let (first, second) = (of(1), of(2));
        let sum = |image: &Image| image.pixels.iter().flatten().map(|value| f64::from(*value)).sum::<f64>();
        let off = first.pixels.iter().flatten().zip(second.pixels.iter().flatten()).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>();
        2.0 * off / (sum(&first) + sum(&second))
    };
    let (points, patches, steady) = (change("vpl", &["indirect.clamp=none"]), change("vsgl", &[]), change("vsgl-steady", &[]));
    println!("256 lights, mean change from set to set: points {points:.4}, patches {patches:.4}, steady {steady:.4}");
    assert!(steady < points / 2.4 && steady < 0.85 * patches && patches < points / 1.8, "{points} {patches} {steady}");
}

/// What no scene without specular lobes needs is left out.
#[test]
fn a_diffuse_scene_has_no_lobes_and_less_memory() {
    let graph = lobelia::graph::GraphFile::load(&lobelia_tests::root().join("graphs/indirect.ron")).unwrap();
    let bytes = |scene: &str| {
        let wired = graph.wire(&lobelia::registry(), &["vsgl".into()], &[]).unwrap();
        let traits = Scene::load(scene).unwrap().traits();
        let plan = wired.plan(&traits, &lobelia::graph::PlanOptions::new([60, 60])).unwrap();
        let flags: Vec<String> = plan
            .passes
            .iter()
            .flat_map(|pass| pass.specialisations.iter())
            .filter(|flag| flag.on)
            .map(|flag| flag.flag.to_owned())
            .collect();
        (flags.iter().any(|flag| flag == "SPECULAR"), plan.passes.iter().any(|pass| pass.name == "moments"))
    };
    assert_eq!(bytes("builtin:cornell-glossy"), (true, true));
    assert_eq!(bytes("builtin:cornell-diffuse"), (false, true));
    let points = graph.wire(&lobelia::registry(), &["vpl".into()], &[]).unwrap();
    let plan = points.plan(&Scene::load("builtin:cornell-glossy").unwrap().traits(), &lobelia::graph::PlanOptions::new([60, 60])).unwrap();
    assert!(!plan.passes.iter().any(|pass| pass.name == "moments"), "point lights read no averages");
}
