//! Weights stay finite and keep every reflecting texel in play, whatever the scene; and they hold still when the camera does.

use crate::{given::turn, maps::weights};
use glam::{DMat4, DVec3};
use lobelia::{
    Session, Shot,
    graph::{Gpu, GpuOptions, GraphFile, RunOptions, testing::gpu},
    scene::Scene,
};

/// Weights of `brsm` and of `flux-density` in a real picture of a scene.
fn weigh(scene: &Scene, side: u32, extent: [u32; 2], parameters: &str, seed: u32) -> (Vec<f64>, Vec<f64>) {
    let _turn = turn();
    let text = format!(
        r#"(passes: {{
            "gbuffer": gbuffer(), "rsm": rsm(resolution: {side}), "flux": flux_density(), "density": brsm({parameters}),
            "lights": vpl_lights(count: 16, from: {{"density": "density.density"}}), "indirect": vpl_gather(),
        }}, output: "indirect.radiance")"#
    );
    let wired = GraphFile::parse(&text, "test.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let gpu = Gpu::new(&GpuOptions { adapter: None, baseline: true }).unwrap();
    let mut session = Session::with(gpu, scene.clone(), 0.0).unwrap();
    let keep = ["density.density", "flux.density"].map(str::to_owned).to_vec();
    let shot = Shot { extent, seed, keep, run: RunOptions { check: true, ..RunOptions::default() }, ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).unwrap();
    rendering.run(&mut |_| true).unwrap();
    let read = |name: &str| weights(rendering.runner(), rendering.gpu(), name);
    (read("density.density"), read("flux.density"))
}

/// Positive exactly where flux is reflected, finite, and not those of flux.
fn check(name: &str, (mixed, flux): &(Vec<f64>, Vec<f64>)) {
    assert!(mixed.iter().all(|weight| weight.is_finite() && *weight >= 0.0), "{name}");
    let lost = mixed.iter().zip(flux).filter(|(mixed, flux)| (**mixed > 0.0) != (**flux > 0.0)).count();
    assert_eq!(lost, 0, "{name}");
    assert!(flux.iter().any(|weight| *weight > 0.0), "{name}");
    assert!(mixed != flux, "{name}");
}

fn scaled(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    for instance in &mut scene.instances {
        instance.world_from_local = DMat4::from_scale(DVec3::splat(factor)) * instance.world_from_local;
    }
    for light in &mut scene.lights {
        light.position *= factor;
    }
    for camera in &mut scene.cameras {
        camera.position *= factor;
        camera.near *= factor;
    }
    scene
}

#[test]
fn absurd_scenes() {
    if gpu().is_none() {
        return;
    }
    let scene = Scene::load("builtin:spheres").unwrap();
    for lights in ["gaussian", "point"] {
        let small = |scene: &Scene| weigh(scene, 16, [24, 16], &format!("lights: {lights}, subset: 16"), 0);
        for factor in [1e-3, 1.0, 1e4] {
            check(&format!("{lights}, {factor} times as large"), &small(&scaled(&scene, factor)));
        }
        for strength in [1e-20f32, 1e-5, 1e10, 1e30] {
            let mut lit = scene.clone();
            lit.lights.iter_mut().for_each(|light| light.intensity *= strength);
            check(&format!("{lights}, {strength:e} times as bright"), &small(&lit));
        }
        for roughness in [0.0, 1.0] {
            let mut coated = scene.clone();
            coated.materials.iter_mut().for_each(|material| material.roughness = roughness);
            check(&format!("{lights}, roughness {roughness}"), &small(&coated));
            let mut mirrors = scaled(&coated, 1e-3);
            mirrors.materials.iter_mut().for_each(|material| material.metallic = 1.0);
            check(&format!("{lights}, metal of roughness {roughness}, small"), &small(&mirrors));
        }
    }
}

#[test]
fn the_smallest_picture_and_the_largest_map() {
    if gpu().is_none() {
        return;
    }
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    check("one pixel", &weigh(&scene, 16, [1, 1], "samples: 1, subset: 1", 0));
    check("a map of 2048", &weigh(&scene, 2048, [8, 8], "subset: 16", 0));
    check("as many cells as texels", &weigh(&scene, 48, [8, 8], "subset: 16, cells: 1024", 0));
}

#[test]
fn a_camera_that_sees_nothing_leaves_flux() {
    if gpu().is_none() {
        return;
    }
    let mut scene = Scene::load("builtin:cornell-glossy").unwrap();
    let camera = &mut scene.cameras[0];
    (camera.forward, camera.right) = (-camera.forward, -camera.right);
    camera.position += camera.forward * 100.0;
    let (mixed, flux) = weigh(&scene, 32, [24, 16], "", 0);
    assert!(mixed == flux && flux.iter().any(|weight| *weight > 0.0));
}

#[test]
fn weights_hold_still() {
    if gpu().is_none() {
        return;
    }
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let extent = [96, 96];
    let at = |pixels: f64, seed: u32| {
        let mut moved = scene.clone();
        let camera = &mut moved.cameras[0];
        // Of the order of a pixel's width at the box.
        camera.position += camera.right * (pixels * 2.0 * (0.5 * camera.yfov).tan() / f64::from(extent[1]));
        weigh(&moved, 256, extent, "", seed).0
    };
    let first = at(0.0, 0);
    let total: f64 = first.iter().sum();
    let difference = |other: &[f64]| first.iter().zip(other).map(|(a, b)| (a - b).abs()).sum::<f64>() / total;
    let (still, reseeded) = (difference(&at(0.01, 0)), difference(&at(0.0, 1)));
    println!("a hundredth of a pixel changes {still:.5} of the weights, another seed {reseeded:.5}");
    assert!(still < 0.01 && reseeded > 5.0 * still, "{still}, {reseeded}");
}
