//! What a plan refuses and leaves out. No device is needed.

use crate::given::plan;
use lobelia::scene::Scene;

fn refusal(visibility: &str, interleave: u32, wider: u32, count: u32) -> Option<String> {
    let text = format!(
        r#"(passes: {{
            "surfaces": given_gbuffer(wider: {wider}),
            "lights": given_lights(count: {count}),
            "visibility": {visibility},
            "indirect": vpl_gather(interleave: {interleave}),
        }}, output: "indirect.radiance")"#
    );
    plan(&text, &Scene::load("builtin:cornell-glossy").unwrap(), &[]).err().map(|problems| problems.to_string())
}

#[test]
fn what_does_not_fit_is_refused_with_a_way_out() {
    assert_eq!(refusal("aism()", 1, 0, 1000), None);
    assert_eq!(refusal("aism(interleave: 4)", 4, 0, 1000), None);
    assert_eq!(refusal("aism()", 4, 0, 1000), None, "whole visibility serves any pattern");
    let pattern = refusal("aism(interleave: 2)", 4, 0, 1000).unwrap();
    assert!(pattern.contains("2 x 2") && pattern.contains("set interleave"), "{pattern}");
    let side = refusal("aism(resolution: 48)", 1, 0, 1000).unwrap();
    assert!(side.contains("48") && side.contains("power of two") && side.contains("32 or 64"), "{side}");
    let bits = refusal("aism()", 1, 8000, 180_000).unwrap();
    assert!(bits.contains("4136 MiB") && bits.contains("4096 MiB") && bits.contains("fewer lights"), "{bits}");
}

#[test]
fn without_lights_no_map_is_drawn() {
    let mut scene = Scene::load("builtin:cornell-glossy").unwrap();
    scene.lights.clear();
    let text = r#"(passes: {
        "gbuffer": gbuffer(), "rsm": rsm(), "density": flux_density(), "lights": vpl_lights(), "visibility": aism(), "indirect": vpl_gather(),
        "sum": compose(from: {"terms": ["indirect.radiance"]}),
    }, output: "sum.radiance")"#;
    let plan = plan(text, &scene, &[]).unwrap();
    let reason = plan.dropped.iter().find(|dropped| dropped.pass == "visibility").map(|dropped| dropped.reason.clone()).unwrap();
    assert!(reason.contains("no point, spot or directional light"), "{reason}");
    assert!(plan.passes.iter().all(|pass| pass.name != "visibility"));
}
