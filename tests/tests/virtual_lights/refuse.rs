//! What a plan refuses and leaves out. No device is needed.

use crate::given::plan;
use lobelia::scene::Scene;

fn scene() -> Scene {
    Scene::load("builtin:cornell-glossy").unwrap()
}

fn gathering(visibility: &str, interleave: u32) -> String {
    format!(
        r#"(passes: {{
            "surfaces": given_gbuffer(specular: true),
            "lights": given_lights(count: 1000),
            "visibility": {visibility},
            "indirect": vpl_gather(interleave: {interleave}),
        }}, output: "indirect.radiance")"#
    )
}

#[test]
fn visibility_of_something_else_is_refused_with_a_way_out() {
    let refused =
        |visibility: &str, interleave| plan(&gathering(visibility, interleave), &scene(), &[]).err().map(|problems| problems.to_string());
    assert_eq!(refused("given_visibility(lights: 1000)", 1), None);
    assert_eq!(refused("given_visibility(lights: 1000, interleave: 4)", 4), None);
    assert_eq!(refused("given_visibility(lights: 1000)", 4), None, "whole visibility serves any pattern");
    let other_lights = refused("given_visibility(lights: 999)", 1).unwrap();
    assert!(other_lights.contains("999") && other_lights.contains("1000"), "{other_lights}");
    let other_pattern = refused("given_visibility(lights: 1000, interleave: 2)", 4).unwrap();
    assert!(other_pattern.contains("2 x 2") && other_pattern.contains("set interleave"), "{other_pattern}");
    let other_picture = refused("given_visibility(lights: 1000, wider: 1)", 1).unwrap();
    assert!(other_picture.contains("33 x 24") && other_picture.contains("32 x 24"), "{other_picture}");
}

#[test]
fn visibility_without_bounds_is_refused_in_mebibytes() {
    let text = |count: u32, interleave: u32| {
        format!(
            r#"(passes: {{
                "surfaces": given_gbuffer(wider: 8000),
                "lights": given_lights(count: {count}),
                "visibility": visibility(interleave: {interleave}),
                "indirect": vpl_gather(interleave: {interleave}),
            }}, output: "indirect.radiance")"#
        )
    };
    // 8032 x 24 pixels: 4 GiB are 178,000 lights.
    assert!(plan(&text(178_000, 1), &scene(), &[]).is_ok());
    let refused = plan(&text(180_000, 1), &scene(), &[]).err().unwrap().to_string();
    assert!(refused.contains("4136 MiB") && refused.contains("4096 MiB") && refused.contains("fewer lights"), "{refused}");
    assert!(plan(&text(180_000, 2), &scene(), &[]).is_ok(), "as the help says");
}

#[test]
fn a_density_of_another_map_is_refused() {
    let text = |of: &str| {
        format!(
            r#"(passes: {{"rsm": rsm(resolution: 64), "small": rsm(resolution: 32), "density": flux_density(from: {{"rsm": "{of}.rsm"}}),
            "lights": vpl_lights(from: {{"rsm": "rsm.rsm"}})}}, output: "lights.lights")"#
        )
    };
    assert!(plan(&text("rsm"), &scene(), &[]).is_ok());
    let refused = plan(&text("small"), &scene(), &[]).err().unwrap().to_string();
    assert!(refused.contains("32 texels a side") && refused.contains("64") && refused.contains("same reflective shadow map"), "{refused}");
}

#[test]
fn without_lights_nothing_is_gathered_and_the_reason_is_given() {
    let mut scene = scene();
    scene.lights.clear();
    let text = r#"(passes: {
        "gbuffer": gbuffer(), "rsm": rsm(), "density": flux_density(), "lights": vpl_lights(), "visibility": visibility(), "indirect": vpl_gather(),
        "sum": compose(from: {"terms": ["indirect.radiance"]}),
    }, output: "sum.radiance")"#;
    let plan = plan(text, &scene, &[]).unwrap();
    let left: Vec<&str> = plan.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert!(!left.iter().any(|name| ["rsm", "lights", "visibility", "indirect"].contains(name)), "{left:?}");
    let reason = plan.dropped.iter().find(|dropped| dropped.pass == "indirect").map(|dropped| dropped.reason.clone()).unwrap();
    assert!(reason.contains("no point, spot or directional light"), "{reason}");
}
