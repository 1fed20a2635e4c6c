//! What each form of a lobe formula costs: in Rust by criterion, and on the device side by side in one run.
//!
//! Prints the table of `docs/lobes/README.md`; with `LOBELIA_WRITE_COSTS=1` it is written there.
#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{BatchSize, Criterion};
use lobelia_atlas::cost::{cases, cost_table, forms, measure};
use lobelia_graph::testing::gpu;
use std::hint::black_box;

fn main() {
    let forms = forms();
    let cases = cases(1024);
    // Plots would be lettered by the atlas's font library, which has no font here.
    let mut criterion = Criterion::default().without_plots().configure_from_args();
    for form in &forms {
        let mut next = cases.iter().cycle();
        criterion.bench_function(&format!("{}/{}", form.operation, form.function), |bencher| {
            bencher.iter_batched_ref(|| *next.next().unwrap(), |case| black_box((form.rust)(black_box(case))), BatchSize::SmallInput);
        });
    }
    criterion.final_summary();
    let Some(gpu) = gpu() else { return };
    let device = measure(gpu, &forms, 9).unwrap();
    let rust: Vec<f64> = forms.iter().map(|form| estimate(&format!("{}/{}", form.operation, form.function))).collect();
    let table = format!("Device: {}.\n\n{}", gpu.info().map_or("unknown", |info| &info.name), cost_table(&forms, &device, &rust));
    println!("{table}");
    if std::env::var("LOBELIA_WRITE_COSTS").is_ok_and(|value| value == "1") {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/lobes/README.md");
        let text = std::fs::read_to_string(&page).unwrap();
        std::fs::write(&page, lobelia_atlas::table::replace_between(&text, "costs", &table).unwrap()).unwrap();
    }
}

/// The median that criterion has stored, in nanoseconds; NaN where the benchmark was filtered out and has never run.
fn estimate(name: &str) -> f64 {
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), Into::into);
    let folder = name.replace('/', "_");
    let read = || -> Option<f64> {
        let text = std::fs::read_to_string(target.join("criterion").join(folder).join("new/estimates.json")).ok()?;
        let estimates: serde_json::Value = serde_json::from_str(&text).ok()?;
        estimates["median"]["point_estimate"].as_f64()
    };
    read().unwrap_or(f64::NAN)
}
