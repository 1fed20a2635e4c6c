//! Virtual spherical Gaussian lights at the ends of their parameters, with the safety net up: right, or refused in words.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use lobelia::{
    Session, Shot,
    graph::{Gpu, GpuOptions, GraphFile, RunOptions},
    measure::{Image, mean},
    scene::{Ndf, Scene},
};
use lobelia_tests::{has_gpu, root};

/// Renders a variant with every resource poisoned before and counted after its pass.
fn checked(scene: &Scene, extent: [u32; 2], variant: &str, set: &[&str]) -> Result<Image, String> {
    let graph = GraphFile::load(&root().join("graphs/indirect.ron")).map_err(|error| error.to_string())?;
    let variants: Vec<String> = variant.split('+').map(str::to_owned).collect();
    let overrides = set.iter().map(|text| text.parse()).collect::<Result<Vec<_>, String>>()?;
    let wired = graph.wire(&lobelia::registry(), &variants, &overrides).map_err(|error| error.to_string())?;
    let gpu = Gpu::new(&GpuOptions { adapter: None, baseline: true }).map_err(|error| error.to_string())?;
    let mut session = Session::with(gpu, scene.clone(), 0.0).map_err(|error| error.to_string())?;
    let shot = Shot {
        extent,
        keep: vec!["indirect.radiance".into()],
        run: RunOptions { check: true, ..RunOptions::default() },
        ..Shot::default()
    };
    let mut rendering = session.start(&wired, &shot).map_err(|error| error.to_string())?;
    rendering.run(&mut |_| true).map_err(|error| error.to_string())?;
    rendering.radiance("indirect.radiance").map_err(|error| error.to_string())
}

fn brightness(image: &Image) -> f64 {
    mean(image).iter().sum()
}

fn of_roughness(roughness: f32) -> Scene {
    let mut scene = Scene::load("builtin:cornell-glossy").unwrap();
    for material in &mut scene.materials {
        material.roughness = roughness;
    }
    scene
}

#[test]
fn numbers_of_lights_and_sizes_of_maps() {
    if !has_gpu() {
        return;
    }
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let usual = brightness(&checked(&scene, [24, 24], "vsgl+no-visibility", &["rsm.resolution=256"]).unwrap());
    for (set, near) in [
        (["lights.count=65536", "rsm.resolution=256"], 0.2),
        (["lights.count=256", "rsm.resolution=16"], 0.4),
        (["lights.count=1024", "rsm.resolution=2048"], 0.2),
        (["lights.count=1024", "rsm.resolution=100"], 0.2),
        (["lights.count=1", "rsm.resolution=256"], 2.0),
    ] {
        let found = brightness(&checked(&scene, [24, 24], "vsgl+no-visibility", &set).unwrap());
        println!("{set:?}: {:.3} of the usual", found / usual);
        assert!(found > 0.0 && (found / usual - 1.0).abs() < near, "{set:?}: {found} {usual}");
    }
    let refused = checked(&scene, [24, 24], "vsgl", &["lights.count=0"]).unwrap_err();
    assert!(refused.contains("count"), "{refused}");
}

#[test]
fn every_roughness_distribution_and_form() {
    if !has_gpu() {
        return;
    }
    // The third is Phong's exponent 65,535.
    for (roughness, ndf) in [(0.0, Ndf::Ggx), (1.0, Ndf::Ggx), (0.0743, Ndf::Phong), (0.0, Ndf::Phong), (1.0, Ndf::Phong)] {
        let mut scene = of_roughness(roughness);
        scene.ndf = ndf;
        for (form, reduction) in [("fast", "none"), ("fast", "0.1"), ("accurate", "none"), ("printed", "none"), ("gaussian", "none")] {
            let (form, reduction) = (format!("indirect.form={form}"), format!("indirect.bias_reduction={reduction}"));
            let set = [form.as_str(), reduction.as_str(), "rsm.resolution=128", "lights.count=128"];
            let found = brightness(&checked(&scene, [16, 16], "vsgl+no-visibility", &set).unwrap());
            assert!(found > 0.0 && found < 100.0, "{roughness} {ndf} {set:?}: {found}");
        }
    }
}

#[test]
fn nothing_to_reflect_and_nothing_to_see() {
    if !has_gpu() {
        return;
    }
    let dim = ["rsm.resolution=64", "lights.count=64"];
    let mut black = Scene::load("builtin:cornell-glossy").unwrap();
    for material in &mut black.materials {
        (material.base_color, material.specular) = (Vec3::ZERO, 0.0);
    }
    let mut away = Scene::load("builtin:cornell-glossy").unwrap();
    // A light that shines out of the box sees nothing.
    away.lights[0].position.y += 100.0;
    away.lights[0].direction = glam::DVec3::Y;
    let mut inside = Scene::load("builtin:cornell-glossy").unwrap();
    // In the middle of the floor's slab: whatever it sees, numbers stay numbers.
    inside.lights[0].position.y = -1.0;
    for variant in ["vsgl", "vsgl-accurate", "two-vsgl", "vsgl+bidirectional", "vsgl+imperfect-visibility"] {
        for (name, scene) in [("black", &black), ("away", &away)] {
            let set = if variant == "two-vsgl" { &dim[..1] } else { &dim[..] };
            assert_eq!(brightness(&checked(scene, [16, 16], variant, set).unwrap()), 0.0, "{name} {variant}");
        }
        let set = if variant == "two-vsgl" { &dim[..1] } else { &dim[..] };
        checked(&inside, [16, 16], variant, set).unwrap();
    }
}

#[test]
fn brightness_goes_with_the_source_and_not_with_the_scale() {
    if !has_gpu() {
        return;
    }
    let set = ["rsm.resolution=128", "lights.count=128"];
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let usual = brightness(&checked(&scene, [16, 16], "vsgl+no-visibility", &set).unwrap());
    let mut bright = scene.clone();
    bright.lights[0].intensity *= 1000.0;
    let ratio = brightness(&checked(&bright, [16, 16], "vsgl+no-visibility", &set).unwrap()) / usual;
    assert!((ratio / 1000.0 - 1.0).abs() < 0.01, "{ratio}");
    let mut absurd = scene;
    for intensity in [1e-20, 1e20, 1e30] {
        absurd.lights[0].intensity = Vec3::splat(intensity);
        checked(&absurd, [16, 16], "vsgl+no-visibility", &set).unwrap();
    }
}
