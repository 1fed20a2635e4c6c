//! Draws the error atlas of `docs/lobes/`: `cargo xtask atlas`.

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use lobelia_atlas::{
    figures,
    heat_map::draw,
    table::{replace_between, twin_table},
    twin::check,
    twins,
};
use lobelia_graph::{Gpu, GpuOptions};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Draw how far each lobe formula is off over its domain, and refresh the table of what the device makes of it.
#[derive(Parser)]
#[command(
    name = "lobelia-atlas",
    after_help = "\
Examples:
  cargo xtask atlas
  cargo xtask atlas -- --only clamped-cosine
  cargo xtask atlas -- --output /tmp/lobes --skip-device

What the forms cost is measured apart: LOBELIA_WRITE_COSTS=1 cargo bench -p lobelia-atlas"
)]
struct Arguments {
    /// Folder of the pictures and of README.md, the page with the tables.
    #[arg(long, value_name = "FOLDER", default_value = "docs/lobes")]
    output: PathBuf,
    /// Draw only this figure.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Leave the table of the WGSL functions as it is.
    #[arg(long)]
    skip_device: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let figures: Vec<_> =
        figures::all().into_iter().filter(|figure| arguments.only.as_deref().is_none_or(|only| only == figure.name)).collect();
    if figures.is_empty() {
        let names: Vec<_> = figures::all().iter().map(|figure| figure.name).collect();
        return Err(format!("there is no such figure; there are {}", names.join(", ")));
    }
    let fail = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
    std::fs::create_dir_all(&arguments.output).map_err(|error| fail(&arguments.output, error))?;
    let device = !arguments.skip_device && arguments.only.is_none();
    let twins = if device { twins::all() } else { Vec::new() };
    let bar = ProgressBar::new((figures.len() + twins.len()) as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {pos}/{len}  {elapsed_precise}  {msg}") {
        bar.set_style(style);
    }
    for figure in &figures {
        bar.set_message(figure.name);
        let file = arguments.output.join(format!("{}.png", figure.name));
        draw(&(figure.panels)(), &file).map_err(|error| error.to_string())?;
        bar.inc(1);
    }
    if device {
        let gpu = Gpu::new(&GpuOptions { adapter: None, baseline: true }).map_err(|error| error.to_string())?;
        let mut reports = Vec::new();
        for twin in &twins {
            bar.set_message(twin.name);
            reports.push(check(&gpu, twin).map_err(|error| format!("{}: {error}", twin.name))?);
            bar.inc(1);
        }
        let name = gpu.info().map_or("unknown", |info| &info.name);
        let table = format!("Device: {name}.\n\n{}", twin_table(&twins, &reports));
        let page = arguments.output.join("README.md");
        let text = std::fs::read_to_string(&page).map_err(|error| fail(&page, error))?;
        let text = replace_between(&text, "twins", &table).map_err(|error| format!("{}: {error}", page.display()))?;
        let part = page.with_extension("md.part");
        std::fs::write(&part, text).and_then(|()| std::fs::rename(&part, &page)).map_err(|error| fail(&page, error))?;
    }
    bar.finish_and_clear();
    println!("Drawn: {} figure(s) in {}", figures.len(), arguments.output.display());
    Ok(())
}
