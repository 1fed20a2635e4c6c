//! Writes demo pages with made-up pictures and numbers: `cargo run -p lobelia-report --example demo -- FOLDER`.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::PathBuf;

use image::{ImageFormat, Rgb, RgbImage};
use lobelia_report::{Comparison, PassCost, PassDifference, Picture, Sweep, SweepRow, Variant, comparison_page, sweep_page};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder")?);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("comparison.html"), comparison_page(&comparison()?))?;
    std::fs::write(folder.join("sweep.html"), sweep_page(&sweep()))?;
    Ok(())
}

fn encode(colour: impl Fn(f64, f64) -> [f64; 3]) -> Result<Picture, image::ImageError> {
    let picture = RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let colour = colour((f64::from(x) + 0.5) / f64::from(WIDTH), (f64::from(y) + 0.5) / f64::from(HEIGHT));
        Rgb(colour.map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8))
    });
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, ImageFormat::Png)?;
    Ok(Picture { width: WIDTH, height: HEIGHT, png: png.into_inner() })
}

/// A warm wall, a cold floor, a glossy blob.
fn scene(x: f64, y: f64) -> [f64; 3] {
    let lobe = 0.8 * (-60.0 * ((x - 0.62).powi(2) + 0.32 * (y - 0.45).powi(2))).exp();
    let shade = if y > 0.7 { 0.25 + 0.2 * x } else { 0.35 + 0.3 * (1.0 - x) };
    let tint = if y > 0.7 { [0.6, 0.8, 1.0] } else { [1.0, 0.8, 0.55] };
    tint.map(|tint| shade * tint + lobe)
}

/// Error of a variant: too dark in one corner, noise everywhere.
fn error(x: f64, y: f64, corner: (f64, f64), size: f64, noise: f64) -> f64 {
    let bump = (-14.0 * ((x - corner.0).powi(2) + (y - corner.1).powi(2))).exp();
    let hash = ((x * 640.0).floor() * 12.9898 + (y * 360.0).floor() * 78.233).sin() * 43_758.547;
    -size * bump + noise * (hash - hash.floor() - 0.5)
}

fn variant(name: &str, corner: (f64, f64), size: f64, noise: f64, scale: f64) -> Result<Variant, image::ImageError> {
    let off = move |x: f64, y: f64| error(x, y, corner, size, noise);
    let heat = |value: f64| [3.0 * value, 3.0 * value - 1.0, 3.0 * value - 2.0];
    let cost = |name: &str, ms: f64, mebibytes: f64| PassCost {
        name: name.to_owned(),
        median_ms: ms * scale,
        p5_ms: ms * scale * 0.94,
        p95_ms: ms * scale * 1.13,
        mebibytes,
        cpu_ms: 0.02 + ms * 0.01,
    };
    let mut passes =
        vec![cost("G-buffer", 0.42, 31.6), cost("RSM", 0.31, 12.0), cost("gather", 1.9 * scale, 7.9 * scale), cost("compose", 0.11, 7.9)];
    let mut pruned = Vec::new();
    if scale < 1.0 {
        pruned.push(("visibility".to_owned(), "nothing reads its output: shadows of indirect light are off".to_owned()));
    } else {
        passes.insert(2, cost("visibility", 0.77, 64.0));
    }
    let text = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    Ok(Variant {
        name: name.to_owned(),
        settings: vec![text("gather.lobes", if scale < 1.0 { "64" } else { "256" }), text("gather.filter", "bilateral")],
        metrics: BTreeMap::from([
            ("FLIP".to_owned(), 0.18 * size + 0.3 * noise),
            ("relative MSE".to_owned(), size * size * 0.2 + noise * noise * 2.0),
            ("mean ratio".to_owned(), 1.0 - 0.1 * size),
            ("PSNR [dB]".to_owned(), -20.0 * (0.2 * size + 0.3 * noise).log10()),
        ]),
        picture: encode(|x, y| scene(x, y).map(|value| value + off(x, y)))?,
        error: encode(|x, y| heat(off(x, y).abs() / scene(x, y)[1]))?,
        flip: Some(encode(|x, y| heat(off(x, y).abs().sqrt() * 0.7))?),
        total_ms: passes.iter().map(|pass| pass.median_ms).sum(),
        total_mebibytes: passes.iter().map(|pass| pass.mebibytes).sum(),
        passes,
        pruned,
    })
}

fn comparison() -> Result<Comparison, image::ImageError> {
    let text = |a: &str, b: &str| (a.to_owned(), b.to_owned());
    let change = |pass: &str, what: &str, change: f64| PassDifference {
        pass: pass.to_owned(),
        a: "256 lobes".to_owned(),
        b: "64 lobes".to_owned(),
        change,
        what: what.to_owned(),
    };
    Ok(Comparison {
        light: None,
        title: "Warm wall: 256 lobes against 64 lobes".to_owned(),
        device: "Made-up device, driver 1.2.3".to_owned(),
        scene: vec![text("triangles", "12 345"), text("lights", "2"), text("size", "640 x 360 pixels"), text("seed", "7")],
        command: "lobelia compare scenes/warm-wall.ron --variants 256,64 --reference path-traced.exr".to_owned(),
        reference: encode(scene)?,
        variants: vec![
            variant("256 lobes", (0.15, 0.85), 0.10, 0.02, 1.0)?,
            variant("64 lobes", (0.85, 0.2), 0.35, 0.06, 0.6)?,
            variant("64 lobes, no filter", (0.85, 0.2), 0.35, 0.25, 0.5)?,
        ],
        differences: vec![
            change("gather", "relative difference of radiance", 0.126),
            change("compose", "relative difference of colour", 0.094),
            change("visibility", "time", -1.0),
            change("RSM", "flux", 0.0),
        ],
    })
}

fn sweep() -> Sweep {
    let mut rows = Vec::new();
    for (scene, difficulty) in [("warm wall", 1.0), ("hall", 6.0), ("yard", 0.2)] {
        for (variant, speed, floor) in [("clustered", 1.0, 0.004), ("hierarchical", 0.55, 0.02), ("brute force", 3.0, 0.0005)] {
            for step in 0..5u32 {
                for seed in 0..2u64 {
                    let lobes = 16.0 * 4.0f64.powi(step as i32);
                    let wobble = 1.0 + 0.06 * (seed as f64 - 0.5);
                    let failed = variant == "brute force" && step == 4 && scene == "hall";
                    rows.push(SweepRow {
                        scene: scene.to_owned(),
                        variant: variant.to_owned(),
                        parameters: vec![("lobes".to_owned(), lobes.to_string())],
                        seed,
                        ms: if failed { f64::NAN } else { (0.4 + speed * lobes / 300.0) * wobble },
                        error: if failed { f64::NAN } else { difficulty * (floor + 0.6 / lobes) / wobble },
                        failed: failed.then(|| "the device was lost: out of memory for 4096 lobes".to_owned()),
                    });
                }
            }
        }
    }
    Sweep {
        light: Vec::new(),
        title: "Lobes against error and time".to_owned(),
        device: "Made-up device, driver 1.2.3".to_owned(),
        rows,
        metric: "relative MSE".to_owned(),
        target_error: Some(0.02),
        target_ms: Some(2.0),
    }
}
