//! The mix with reflected flux, what stands in for it, and what is refused.

use crate::{
    given::{Given, Pixel, Random, plan},
    maps::{both, pixels},
};
use lobelia::{graph::testing::gpu, scene::Scene};

fn scene() -> Scene {
    Scene::load("builtin:spheres").unwrap()
}

#[test]
fn the_mix_is_linear_and_keeps_the_mean() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let given = pixels(&scene, 2.0, &mut Random(1));
    let mixed = |share: f64, more: &str| both(gpu, &scene, &given, 64, &format!("flux_share: {share:?}, cells: 32{more}"), 0);
    let ((low, flux), (middle, _), (high, _), (all, _)) = (mixed(0.2, ""), mixed(0.4, ""), mixed(0.6, ""), mixed(1.0, ""));
    assert_eq!(all, flux, "a share of 1 is flux");
    assert!(low.iter().zip(&flux).any(|(mixed, flux)| *mixed > 2.0 * flux), "the rest is something else");
    let total: f64 = flux.iter().sum();
    for weights in [&low, &middle, &high] {
        assert!((weights.iter().sum::<f64>() / total - 1.0).abs() < 1e-4);
    }
    for ((low, high), (middle, flux)) in low.iter().zip(&high).zip(middle.iter().zip(&flux)) {
        assert!((0.5 * (low + high) - middle).abs() <= 1e-5 * high, "{low}, {middle}, {high}");
        assert!(*low >= 0.2 * flux * (1.0 - 1e-5));
    }
    let (sharp, _) = mixed(0.2, ", blur: false");
    assert!(sharp != low && (sharp.iter().sum::<f64>() / total - 1.0).abs() < 1e-4);
}

#[test]
fn with_nothing_to_weigh_weights_are_those_of_flux() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let seen = pixels(&scene, 2.0, &mut Random(2));
    let change = |change: fn(&mut Pixel)| {
        let mut given = seen.clone();
        given.pixels.iter_mut().for_each(change);
        given
    };
    let weigh = |given: &Given, scene: &Scene| both(gpu, scene, given, 32, "cells: 32", 0);
    let (mixed, flux) = weigh(&seen, &scene);
    assert!(mixed != flux && flux.iter().any(|weight| *weight > 0.0));
    let (nothing_seen, flux) = weigh(&change(|pixel| pixel.depth = 0.0), &scene);
    assert_eq!(nothing_seen, flux);
    let (black, flux) = weigh(&change(|pixel| (pixel.core[1], pixel.specular) = (0, 0)), &scene);
    assert_eq!(black, flux);
    // One pixel in 768 is enough to know.
    let mut one = change(|pixel| pixel.depth = 0.0);
    one.pixels[401] = seen.pixels[401];
    let (few, flux) = weigh(&one, &scene);
    assert!(few != flux && few.iter().zip(&flux).all(|(few, flux)| (*few > 0.0) == (*flux > 0.0)));
    let mut dark = scene.clone();
    dark.lights.iter_mut().for_each(|light| light.intensity *= 0.0);
    let (unlit, flux) = weigh(&seen, &dark);
    assert!(unlit == flux && flux.iter().all(|weight| *weight == 0.0));
}

#[test]
fn equal_seeds_give_equal_weights() {
    let Some(gpu) = gpu() else { return };
    let scene = scene();
    let given = pixels(&scene, 2.0, &mut Random(3));
    let weigh = |offset: u32, seed: u32| both(gpu, &scene, &given, 32, &format!("seed: {offset}"), seed).0;
    let first = weigh(0, 5);
    assert_eq!(first, weigh(0, 5));
    assert_eq!(first, weigh(2, 3), "the parameter is added to the run's seed");
    assert_ne!(first, weigh(0, 6));
}

#[test]
fn what_cannot_be_is_refused() {
    let scene = scene();
    let refusal = |specular: bool, parameters: &str, scene: &Scene| {
        let text = format!(
            r#"(passes: {{"surfaces": given_gbuffer(specular: {specular}), "rsm": rsm(resolution: 1024), "density": brsm({parameters})}}, output: "density.density")"#
        );
        plan(&text, scene, &[]).err().map(|problems| problems.to_string())
    };
    assert_eq!(refusal(true, "", &scene), None);
    let other_parts = refusal(false, "", &scene).unwrap();
    assert!(other_parts.contains("other parts") && other_parts.contains("same scene"), "{other_parts}");
    for (parameters, name) in [
        ("flux_share: 0.0", "flux_share"),
        ("flux_share: 1.1", "flux_share"),
        ("subset: 0", "subset"),
        ("samples: 0", "samples"),
        ("cells: 4", "cells"),
        ("patches: 0", "patches"),
        ("lights: disk", "lights"),
    ] {
        let refused = refusal(true, parameters, &scene).unwrap();
        assert!(refused.contains(name), "{parameters}: {refused}");
    }
    let mut many = scene.clone();
    let point = many.lights.iter().find(|light| light.kind == lobelia::scene::LightKind::Point).unwrap().clone();
    many.lights = vec![point; 6];
    let too_many = refusal(true, "cells: 1024", &many).unwrap();
    assert!(too_many.contains("36 faces") && too_many.contains("144 MiB") && too_many.contains("fewer cells"), "{too_many}");
    assert_eq!(refusal(true, "cells: 512", &many), None, "as the help says");
}

#[test]
fn without_lights_nothing_is_weighed() {
    let mut scene = scene();
    scene.lights.clear();
    let text = r#"(passes: {"gbuffer": gbuffer(), "rsm": rsm(), "density": brsm(), "lights": vpl_lights(), "indirect": vpl_gather(),
        "sum": compose(from: {"terms": ["indirect.radiance"]})}, output: "sum.radiance")"#;
    let plan = plan(text, &scene, &[]).unwrap();
    let reason = plan.dropped.iter().find(|dropped| dropped.pass == "density").map(|dropped| dropped.reason.clone()).unwrap();
    assert!(reason.contains("no point, spot or directional light"), "{reason}");
}
