//! Pipelines are made once. A process of its own: the statistics count for the whole device, and tests beside it would add to them.
#![allow(clippy::unwrap_used)]

use lobelia_graph::testing::gpu;
use lobelia_shaders::{Flags, Source};

#[test]
fn pipelines_are_cached_by_shader_flags_and_entry() {
    let Some(gpu) = gpu() else { return };
    let text = "@group(0) @binding(0) var<storage, read_write> values: array<f32>;\n\
        @compute @workgroup_size(64) fn double(@builtin(global_invocation_id) id: vec3u) { values[id.x] = 2.0 * values[id.x]; }\n\
        @compute @workgroup_size(64) fn halve(@builtin(global_invocation_id) id: vec3u) { values[id.x] = 0.5 * values[id.x]; }\n";
    let make = |entry: &str, flags: &Flags| gpu.compute_pipeline("cached", Source { path: "cached.wgsl", text }, entry, flags).unwrap();
    let count = || {
        let statistics = gpu.pipeline_statistics();
        (statistics.created, statistics.cache_hits)
    };
    make("double", &Flags::new());
    assert_eq!(count(), (1, 0));
    make("double", &Flags::new());
    assert_eq!(count(), (1, 1));
    make("double", &Flags::new().with("OTHER", true));
    assert_eq!(count(), (2, 1));
    make("halve", &Flags::new());
    assert_eq!(count(), (3, 1));
}
