//! What is decided without a device.

use crate::{EXTENT, plan};

#[track_caller]
fn assert_refused(text: &str, parts: &[&str]) {
    let refused = plan(text).err().unwrap();
    for part in parts {
        assert!(refused.contains(part), "`{part}` is not in: {refused}");
    }
}

#[test]
fn terms_wire_themselves_and_absent_ones_are_left_out() {
    let text = r#"(passes: {"a": source(), "b": source(absent: true), "c": source(), "sum": compose()}, output: "sum.radiance")"#;
    let plan = plan(text).unwrap();
    let sum = plan.passes.iter().find(|pass| pass.name == "sum").unwrap();
    let names: Vec<_> = sum.inputs[0].iter().map(|index| plan.resources[*index].name.as_str()).collect();
    assert_eq!(names, ["a.radiance", "c.radiance"]);
}

#[test]
fn a_sum_of_nothing_is_planned() {
    let text = r#"(passes: {"a": source(absent: true), "sum": compose()}, output: "sum.radiance")"#;
    let plan = plan(text).unwrap();
    assert_eq!(plan.passes.len(), 1);
    assert_eq!(plan.resources[plan.output].bytes(), u64::from(EXTENT[0] * EXTENT[1]) * 8);
}

#[test]
fn terms_of_different_size_are_refused() {
    assert_refused(
        r#"(passes: {"a": source(), "b": source(excess: 3), "sum": compose()}, output: "sum.radiance")"#,
        &["`sum`", "terms", "256 x 124", "259 x 127"],
    );
    plan(r#"(passes: {"a": source(excess: 3), "b": source(excess: 3), "sum": compose()}, output: "sum.radiance")"#).unwrap();
}

#[test]
fn parameters_out_of_range_are_refused() {
    let graph = |settings: &str| format!(r#"(passes: {{"a": source(), "b": tonemap({settings})}}, output: "b.image")"#);
    for settings in ["exposure: 33.0", "exposure: -32.5", "exposure: NaN", "exposure: inf"] {
        assert_refused(&graph(settings), &["exposure", "-32", "32"]);
    }
    assert_refused(&graph("curve: acse"), &["curve", "aces, agx or none"]);
    assert_refused(&graph("contrast: 1.0"), &["contrast"]);
    for settings in ["", "exposure: 32.0", "exposure: -32.0, curve: aces", "curve: none"] {
        plan(&graph(settings)).unwrap();
    }
}
