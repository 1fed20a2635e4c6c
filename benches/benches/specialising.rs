//! What specialising to a scene saves: time and memory of `graphs/indirect.ron` on the diffuse box, with and without, in turn within one run.
#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use lobelia::{
    frame::SceneWorld,
    graph::{GraphFile, PlanOptions, RunOptions, Runner, testing},
    scene::{
        Scene,
        device::{GpuScene, ViewUniform},
    },
};
use std::{
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

const EXTENT: [u32; 2] = [160, 160];

fn specialising(criterion: &mut Criterion) {
    let gpu = testing::gpu().expect("this benchmark needs a device");
    let scene = Arc::new(Scene::load("builtin:cornell-diffuse").unwrap());
    let world = GpuScene::new(gpu.device(), gpu.queue(), scene.clone()).unwrap();
    let view = ViewUniform::new(&scene.camera(None).unwrap(), scene.origin(), EXTENT, glam::Vec2::ZERO, 0, 0, None);
    world.set_view(gpu.queue(), &view);
    let graph = GraphFile::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/indirect.ron")).unwrap();
    let set = ["lights.count=256".parse().unwrap()];
    let wired = graph.wire(&lobelia::registry(), &["no-visibility".into()], &set).unwrap();
    let runner = |specialise: bool| {
        let plan = wired.plan(&scene.traits(), &PlanOptions { specialise, ..PlanOptions::new(EXTENT) }).unwrap();
        (plan.bytes(), Runner::<SceneWorld>::new(gpu, plan, &world, RunOptions::default()).unwrap())
    };
    let ((special_bytes, mut special), (general_bytes, mut general)) = (runner(true), runner(false));
    let mut timed = |specialised: bool| {
        let clock = Instant::now();
        let runner = if specialised { &mut special } else { &mut general };
        runner.run(gpu, &world, 0, &mut |_, _| true).unwrap();
        gpu.wait().unwrap();
        clock.elapsed()
    };
    let mut group = criterion.benchmark_group("frame of the diffuse box");
    group.sample_size(20);
    for (name, side) in [("specialised", true), ("general", false)] {
        group.bench_function(name, |bencher| bencher.iter_custom(|count| (0..count).map(|_| timed(side)).sum()));
    }
    group.finish();
    let median = |mut times: Vec<Duration>| {
        times.sort();
        times[times.len() / 2].as_secs_f64() * 1e3
    };
    let (mut with, mut without) = (Vec::new(), Vec::new());
    for _ in 0..15 {
        with.push(timed(true));
        without.push(timed(false));
    }
    let (with, without) = (median(with), median(without));
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let device = gpu.info().map_or("host device", |info| info.name.as_str());
    println!(
        "interleaved on {device}: specialised {with:.1} ms and {:.2} MiB, general {without:.1} ms and {:.2} MiB; time ratio {:.3}, memory ratio {:.3}",
        mebibytes(special_bytes),
        mebibytes(general_bytes),
        with / without,
        special_bytes as f64 / general_bytes as f64
    );
}

criterion_group!(benches, specialising);
criterion_main!(benches);
