//! What `lobelia compare` writes and prints.

use super::{
    compare::{Arguments, Known, write_text},
    sequence::{self, Expected},
};
use crate::{failure::Failure, files};
use comfy_table::{CellAlignment, Table, presets};
use lobelia::{
    Shot,
    comparison::{Metrics, clock, compare_all, first_view, measurement, pass_differences, radiance, replicated, time, where_closest},
    measure::{self, Image, Pictures, timing::Ratio},
    report::{
        self, Better, Comparison, Device, Light, Measurement, PassCost, Picture, Pruned, Reference, SceneFacts, Settings, Variant, View,
        comparison_page,
    },
    scene::Scene,
    trial::Measured,
};
use std::{collections::BTreeMap, io::Write};

fn measured_wrong(error: measure::MeasureError) -> Failure {
    Failure::Run(error.to_string())
}

/// Metrics of techniques with their replicates.
pub fn metrics(known: &Known, measured: &[Measured]) -> Result<Vec<Metrics>, Failure> {
    let pictures: Vec<Pictures> = measured.iter().map(|one| one.pictures.clone()).collect();
    let found = measure::measure_replicates(&known.image, &known.variance, &pictures).map_err(measured_wrong)?;
    Ok(found.into_iter().map(|metrics| metrics.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()).collect())
}

/// What a picture without error would score for the noise of the reference alone; empty where that is not known.
pub fn floor(known: &Known) -> Result<BTreeMap<String, f64>, Failure> {
    if known.variance.is_empty() {
        return Ok(BTreeMap::new());
    }
    let floor = measure::noise_floor(&known.image, &known.variance).map_err(measured_wrong)?;
    Ok(floor.by_name().into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
}

fn encode(width: usize, height: usize, rgb: &[u8]) -> Result<Picture, Failure> {
    let mut png = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut png);
    image::ImageEncoder::write_image(encoder, rgb, width as u32, height as u32, image::ExtendedColorType::Rgb8)
        .map_err(|error| Failure::Run(format!("a picture cannot be encoded: {error}")))?;
    Ok(Picture { width: width as u32, height: height as u32, png })
}

/// A map in colours, from `low` (black) to `high`.
fn map_picture(image: &Image, map: &[f32], low: f32, high: f32) -> Result<Picture, Failure> {
    encode(image.width, image.height, measure::false_colour(map, low, high).as_flattened())
}

/// Writes the pictures, the page and its data, and prints a table.
pub fn write(
    arguments: &Arguments,
    scene: &Scene,
    known: &Known,
    expected: &Expected,
    shot: &Shot,
    measured: &[Measured],
    light: Light,
) -> Result<(), Failure> {
    let folder = &arguments.report;
    files::write_exr(&folder.join("reference.exr"), &known.image)?;
    if !known.variance.is_empty() {
        files::write_exr(&folder.join("reference.variance.exr"), &Image { pixels: known.variance.clone(), ..known.image.clone() })?;
    }
    let mut metrics = metrics(known, measured)?;
    for (index, (one, metrics)) in measured.iter().zip(&mut metrics).enumerate() {
        files::write_exr(&folder.join(format!("{}.exr", file_name(&one.name))), &one.pictures.image)?;
        if let Some(flicker) = sequence::temporal_error(expected, index, one)? {
            metrics.insert("temporal_error".to_owned(), flicker);
        }
    }
    let comparison = Comparison { light: Some(light), ..comparison(arguments, scene, known, expected, shot, measured, &metrics)? };
    write_text(&folder.join("report.html"), &comparison_page(&comparison))?;
    let json = serde_json::to_string_pretty(&comparison).map_err(|error| Failure::Run(error.to_string()))?;
    write_text(&folder.join("report.json"), &json)?;
    if !arguments.quiet {
        print_table(&comparison, measured)?;
        writeln!(std::io::stdout(), "wrote {}", folder.join("report.html").display())?;
    }
    Ok(())
}

fn comparison(
    arguments: &Arguments,
    scene: &Scene,
    known: &Known,
    expected: &Expected,
    shot: &Shot,
    measured: &[Measured],
    metrics: &[Metrics],
) -> Result<Comparison, Failure> {
    let names: Vec<&str> = measured.iter().map(|one| one.name.as_str()).collect();
    let times: Vec<_> = measured.iter().map(|one| one.frame_ms.as_ref()).collect();
    let variants: Vec<Variant> =
        measured.iter().zip(metrics).map(|(one, metrics)| variant(one, known, metrics)).collect::<Result<_, _>>()?;
    let pictures: Vec<Pictures> = measured.iter().map(|one| one.pictures.clone()).collect();
    let traits = scene.traits();
    let address = &arguments.scene.scene;
    Ok(Comparison {
        version: report::VERSION,
        title: format!("{} on {address}", names.join(", ")),
        command: std::iter::once("lobelia".to_owned()).chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" "),
        device: Device { name: measured[0].device.clone(), timing: clock(measured[0].timing) },
        scene: SceneFacts {
            address: address.clone(),
            camera: arguments.shot.camera.clone(),
            // The shortest digits of the single float, not those of the double next to it.
            time: arguments.scene.time.to_string().parse().unwrap_or_default(),
            triangles: traits.triangles as u64,
            punctual_lights: traits.punctual_lights() as u64,
            area_lights: traits.area_lights() as u64,
            ndf: scene.ndf.to_string(),
        },
        settings: Settings {
            size: arguments.shot.size,
            samples: shot.samples,
            seed: shot.seed,
            rounds: arguments.shot.rounds,
            sequence: sequence::settings(expected, shot),
        },
        reference: Reference { floor: floor(known)?, picture: radiance(&known.image), ..known.about.clone() },
        replication: replicated(&measured[0]),
        light: None,
        view: first_view(&known.image, variants.iter().filter_map(|variant| variant.tone.as_ref())),
        comparisons: compare_all(&names, metrics, &times),
        differences: pass_differences(measured),
        map: where_closest(&known.image, &known.variance, &pictures),
        variants,
    })
}

/// A name without what file systems dislike.
fn file_name(name: &str) -> String {
    name.chars().map(|letter| if letter.is_ascii_alphanumeric() || "-_+.@=,".contains(letter) { letter } else { '_' }).collect()
}

fn variant(one: &Measured, known: &Known, metrics: &Metrics) -> Result<Variant, Failure> {
    let passes = one.passes.iter().map(|pass| PassCost {
        name: pass.name.clone(),
        kind: pass.kind.to_owned(),
        parameters: pass.params.clone(),
        gpu_ms: pass.gpu_ms.as_ref().map(time),
        cpu_ms: pass.cpu_ms.map(|summary| summary.median),
        bytes: pass.bytes,
    });
    let image = &one.pictures.image;
    let relative = measure::relative_error_map(&known.image, image).map_err(measured_wrong)?;
    let flip = measure::flip_hdr(&known.image, image, measure::flip::PIXELS_PER_DEGREE).map_err(measured_wrong)?;
    Ok(Variant {
        name: one.name.clone(),
        output: one.output.clone(),
        metrics: metrics.iter().map(|(name, found)| (name.clone(), measurement(name, found))).collect(),
        frame_ms: one.frame_ms.as_ref().map(time),
        bytes: one.bytes,
        compile_seconds: one.compile_seconds,
        tone: one.tone.clone().map(|(curve, exposure)| View { curve, exposure }),
        passes: passes.collect(),
        pruned: one.dropped.iter().map(|(pass, reason)| Pruned { pass: pass.clone(), reason: reason.clone() }).collect(),
        picture: radiance(image),
        error: map_picture(image, &relative, 1e-3, 1.0)?,
        flip: Some(map_picture(image, &flip.map, 0.0, 1.0)?),
    })
}

/// A value with half the width of its interval.
fn with_reach(found: &Measurement) -> String {
    match found.low.zip(found.high) {
        Some((low, high)) if high > low => format!("{:.3e} ±{:.0e}", found.value, 0.5 * (high - low)),
        _ => format!("{:.3e}", found.value),
    }
}

fn print_table(comparison: &Comparison, measured: &[Measured]) -> Result<(), Failure> {
    let mut table = Table::new();
    // What a terminal has room for; the page has all of them.
    let names = ["relative_mse", "flip_hdr", "ssim", "fireflies", "temporal_error"];
    let names: Vec<&str> = names.into_iter().filter(|name| comparison.variants.iter().any(|one| one.metrics.contains_key(*name))).collect();
    let mut header = vec!["technique".to_owned(), "device ms".to_owned(), "over the first".to_owned(), "MiB".to_owned()];
    header.extend(names.iter().map(|name| (*name).to_owned()));
    let columns = header.len();
    table.load_style(presets::NOTHING).set_header(header);
    for column in 1..columns {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for (variant, one) in comparison.variants.iter().zip(measured) {
        let ratio =
            Ratio::paired(&one.round_ms, &measured[0].round_ms).map_or_else(|| "-".to_owned(), |ratio| format!("{:.2}", ratio.ratio));
        let ms = variant.frame_ms.map_or_else(
            || "-".to_owned(),
            |time| match time.low.zip(time.high) {
                Some((low, high)) => format!("{:.2} ({low:.2} to {high:.2})", time.median),
                None => format!("{:.2}", time.median),
            },
        );
        let mut row = vec![variant.name.clone(), ms, ratio, format!("{:.2}", variant.bytes as f64 / f64::from(1u32 << 20))];
        row.extend(names.iter().map(|name| variant.metrics.get(*name).map_or_else(String::new, with_reach)));
        table.add_row(row);
    }
    let mut out = std::io::stdout().lock();
    writeln!(out, "{table}")?;
    writeln!(
        out,
        "± is half of the 95 % interval, over samples or seeds and the noise of the reference; of times it stands in brackets, over rounds"
    )?;
    for names in [&names[..], &["frame_ms"]].concat() {
        for one in comparison.comparisons.iter().filter(|one| one.metric == names && one.better == Better::Tie) {
            // Without a known noise nothing was compared.
            let what = if one.low.is_some() { "no difference is shown" } else { "the noise is not known, so no difference is claimed" };
            writeln!(out, "{}: {what} between {} and {}", one.metric, one.a, one.b)?;
        }
    }
    writeln!(out, "device: {}; reference: {}", comparison.device.name, reference_note(&comparison.reference))?;
    for sentence in comparison.light.iter().flat_map(Light::sentences) {
        writeln!(out, "light: {sentence}")?;
    }
    if let Some(sequence) = &comparison.settings.sequence {
        writeln!(out, "sequence: {}", sequence.words(comparison.scene.time))?;
    }
    Ok(())
}

fn reference_note(about: &Reference) -> String {
    let mut parts = vec![about.file.clone().unwrap_or_else(|| "path-traced".to_owned())];
    // The light of `only` is said below.
    parts.extend(about.paths.iter().filter(|paths| *paths != "only").map(|paths| match about.depth {
        Some(depth) => format!("{paths} up to depth {depth}"),
        None => paths.clone(),
    }));
    parts.extend(about.samples_per_pixel.map(|samples| format!("{samples} samples per pixel")));
    parts.extend(about.floor.get("relative_mse").map(|noise| format!("its noise alone makes a relative MSE of {noise:.1e}")));
    parts.join(", ")
}
