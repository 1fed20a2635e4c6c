//! Every WGSL lobe function on the device against its form in `f64`, over the whole domain.
#![allow(clippy::unwrap_used)]

use lobelia_atlas::{
    twin::{Expected, Twin, check},
    twins,
};
use lobelia_graph::testing::gpu;

/// `LOBELIA_TWIN=sg:: cargo test -p lobelia-atlas --test twins -- --nocapture` checks those whose names contain the text.
#[test]
fn every_function_agrees_with_its_twin() {
    let Some(gpu) = gpu() else { return };
    let only = std::env::var("LOBELIA_TWIN").unwrap_or_default();
    let mut failed = Vec::new();
    println!("{:<52} {:>7} {:>10} {:>10}  worst input", "function", "rows", "error", "bound");
    for twin in twins::all().iter().filter(|twin| twin.name.contains(&only)) {
        let report = check(gpu, twin).unwrap_or_else(|error| panic!("{}: {error}", twin.name));
        let line = format!(
            "{:<52} {:>7} {:>10.1e} {:>10.1e}  {:?}: {:e} expected, {:e} found, {} broken",
            report.name, report.rows, report.error, report.bound, report.row, report.values.0, report.values.1, report.broken
        );
        println!("{line}");
        if !report.passes() {
            failed.push(line);
        }
    }
    assert!(failed.is_empty(), "{} functions failed:\n{}", failed.len(), failed.join("\n"));
}

/// Planted faults: a term lost, a NaN, an infinity, a sign.
#[test]
fn what_is_wrong_does_not_pass() {
    let Some(gpu) = gpu() else { return };
    let right = Twin {
        name: "test::right",
        wgsl: "fn value(input: Input) -> vec4f { return vec4f(input.a.x * input.a.x); }",
        domain: "",
        input: |index| {
            let mut row = [0.0; 16];
            row[0] = index as f32;
            row
        },
        expected: |row| vec![Expected::relative(row[0] * row[0], 1e-6).non_negative()],
    };
    assert!(check(gpu, &right).unwrap().passes());
    for (what, wgsl) in [
        ("one row", "fn value(input: Input) -> vec4f { return vec4f(select(input.a.x * input.a.x, 0.0, input.a.x == 77.0)); }"),
        ("a small error", "fn value(input: Input) -> vec4f { return vec4f(input.a.x * input.a.x * 1.00001); }"),
        (
            "not a number",
            "fn value(input: Input) -> vec4f { return vec4f(select(input.a.x * input.a.x, bitcast<f32>(0x7fc00000u | u32(input.a.y)), input.a.x == 77.0)); }",
        ),
        (
            "infinite",
            "fn value(input: Input) -> vec4f { return vec4f(select(input.a.x * input.a.x, bitcast<f32>(0x7f800000u | u32(input.a.y)), input.a.x == 77.0)); }",
        ),
        (
            "negative zero's neighbour",
            "fn value(input: Input) -> vec4f { return vec4f(select(input.a.x * input.a.x, -1e-37, input.a.x == 0.0)); }",
        ),
    ] {
        let report = check(gpu, &Twin { wgsl, ..right }).unwrap();
        assert!(!report.passes(), "{what}: {report:?}");
    }
    // An f64 form that is not a number passes nothing either.
    assert!(!check(gpu, &Twin { expected: |_| vec![Expected::relative(f64::NAN, 1.0)], ..right }).unwrap().passes());
}
