//! What specialising to a scene saves: time and memory of graphs on scenes that have less than they could serve, with and without, in turn within one run.
#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use lobelia::{
    frame::SceneWorld,
    graph::{Gpu, GraphFile, PlanOptions, RunOptions, Runner, testing},
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

/// A graph on a scene that has less than the graph could serve.
struct Case {
    name: &'static str,
    graph: &'static str,
    variants: &'static [&'static str],
    set: &'static [&'static str],
    scene: Scene,
}

fn cases() -> [Case; 2] {
    let mut polygons = Scene::load("builtin:area-lights").unwrap();
    // The quad, the triangle and the star come first.
    polygons.area_lights.truncate(3);
    polygons.instances.retain(|instance| instance.area_light.is_none_or(|light| light < 3));
    [
        Case {
            name: "indirect light of the diffuse box",
            graph: "indirect.ron",
            variants: &["no-visibility"],
            set: &["lights.count=256"],
            scene: Scene::load("builtin:cornell-diffuse").unwrap(),
        },
        Case { name: "area lights, polygons alone", graph: "area-lights.ron", variants: &["no-visibility"], set: &[], scene: polygons },
    ]
}

fn specialising(criterion: &mut Criterion) {
    let gpu = testing::gpu().expect("this benchmark needs a device");
    for case in cases() {
        measure(criterion, gpu, case);
    }
}

fn measure(criterion: &mut Criterion, gpu: &Gpu, case: Case) {
    let scene = Arc::new(case.scene);
    let world = GpuScene::new(gpu.device(), gpu.queue(), scene.clone()).unwrap();
    let view = ViewUniform::new(&scene.camera(None).unwrap(), scene.origin(), EXTENT, glam::Vec2::ZERO, 0, 0, None);
    world.set_view(gpu.queue(), &view);
    let graph = GraphFile::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs").join(case.graph)).unwrap();
    let set: Vec<_> = case.set.iter().map(|text| text.parse().unwrap()).collect();
    let variants: Vec<String> = case.variants.iter().map(|variant| (*variant).to_owned()).collect();
    let wired = graph.wire(&lobelia::registry(), &variants, &set).unwrap();
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
    let mut group = criterion.benchmark_group(case.name);
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
        "{}: interleaved on {device}: specialised {with:.1} ms and {:.2} MiB, general {without:.1} ms and {:.2} MiB; time ratio {:.3}, memory ratio {:.3}",
        case.name,
        mebibytes(special_bytes),
        mebibytes(general_bytes),
        with / without,
        special_bytes as f64 / general_bytes as f64
    );
}

criterion_group!(benches, specialising);
criterion_main!(benches);
