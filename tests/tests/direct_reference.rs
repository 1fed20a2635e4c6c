//! G-buffer and direct light against path-traced reference images. The images are large optional material: `LOBELIA_SHARED`, or `../shared` beside the
//! workspace; without them these tests say so and pass.
#![allow(clippy::unwrap_used)]

use lobelia::{
    Session, Shot,
    graph::{Gpu, GpuOptions, GraphFile, testing},
    measure::{Image, Mask, compare, read_exr},
    scene::Scene,
};
use std::path::{Path, PathBuf};

fn shared() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let folder = std::env::var_os("LOBELIA_SHARED").map_or_else(beside, PathBuf::from);
    let there = folder.join("reference").is_dir();
    if !there {
        eprintln!("skipped: no reference images in {}", folder.display());
    }
    there.then_some(folder)
}

fn render(address: &str, extent: [u32; 2], samples: u32, resolution: u32, direct: &str) -> Image {
    let text = format!(r#"(passes: {{"gbuffer": gbuffer(), "rsm": rsm(resolution: {resolution}), "direct": direct({direct})}}, output: "direct.radiance")"#);
    let wired = GraphFile::parse(&text, "direct.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let gpu = Gpu::new(&GpuOptions { adapter: None, baseline: true }).unwrap();
    let mut session = Session::with(gpu, Scene::load(address).unwrap(), 0.0).unwrap();
    let shot = Shot { extent, samples, camera: Some("main".into()), ..Shot::default() };
    session.start(&wired, &shot).unwrap().run(&mut |_| true).unwrap().image()
}

#[test]
fn explore() {
    let Some(folder) = shared() else { return };
    for (name, extent) in [("cornell-glossy", [240, 240]), ("ring-caustic", [320, 180])] {
        let reference = read_exr(&folder.join(format!("reference/{name}-main_direct.exr"))).unwrap();
        for res in [256, 512, 1024, 2048] {
            for direct in ["", "bias: 0.0", "bias: 1.0", "filter_width: 2", "comparison: depth", "comparison: depth, bias: 1.0", "comparison: depth, bias: 2.0"] {
                let image = render(&format!("builtin:{name}"), extent, 16, res, direct);
                let s = compare(&reference, &image, &Mask::all(&reference)).unwrap();
                println!("{name} {res} {direct}: {:.3e} ratio {:.5}", s.relative_mse, s.mean_ratio);
                if res == 1024 { lobelia::measure::write_exr(Path::new(&format!("/tmp/{name}-{}.exr", direct.replace(|c: char| !c.is_alphanumeric(), "_"))), &image).unwrap(); }
            }
        }
    }
}
