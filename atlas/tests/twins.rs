//! Every WGSL lobe function on the device against its form in `f64`, over the whole domain.
#![allow(clippy::unwrap_used)]

use lobelia_atlas::{twin::check, twins};
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
