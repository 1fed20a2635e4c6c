//! Both passes between a test's own source of radiance and a comparator, in graphs as users write them.
#![allow(clippy::unwrap_used)]

mod compose;
mod plan;
mod source;
mod tonemap;

use lobelia_frame::SceneWorld;
use lobelia_graph::{Gpu, GraphFile, Plan, PlanOptions, Registry, RunOptions, Runner, TextureData};
use lobelia_scene::{Scene, device::GpuScene};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One texel for each half float that is neither negative nor infinite nor NaN.
const EXTENT: [u32; 2] = [256, 124];

fn plan(text: &str) -> Result<Plan<SceneWorld>, String> {
    let mut registry = Registry::new();
    lobelia_compose::register(&mut registry);
    registry.add::<source::SourcePass>();
    let scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let wired =
        GraphFile::parse(text, "test.ron").and_then(|file| file.wire(&registry, &[], &[])).map_err(|problems| problems.to_string())?;
    wired.plan(&scene.traits(), &PlanOptions::new(EXTENT)).map_err(|problems| problems.to_string())
}

/// One device, one test at a time: reading back takes it that nobody else polls meanwhile.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The output of a graph after a frame in which poisoned memory and forbidden values would be noticed.
fn draw(gpu: &Gpu, text: &str) -> TextureData {
    let _turn = turn();
    let plan = plan(text).unwrap();
    let output = plan.resources[plan.output].name.clone();
    let scene = GpuScene::new(gpu.device(), gpu.queue(), Arc::new(Scene::load("builtin:cornell-diffuse").unwrap())).unwrap();
    let mut runner = Runner::new(gpu, plan, &scene, RunOptions { check: true, ..RunOptions::default() }).unwrap();
    runner.run(gpu, &scene, 0, &mut |_, _| true).unwrap();
    runner.read_image(gpu, &output).unwrap()
}
