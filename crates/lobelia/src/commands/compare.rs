use super::{
    SceneArguments, parse_size,
    reference::{Paths, growth_bar, parse_error, show_growth},
    sequence,
    sequence::{Expected, FlickerAgainst, OWN_SAMPLES, SequenceArguments},
};
use crate::{failure::Failure, files};
use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use lobelia::{
    Session, Shot,
    frame::LightTransport,
    graph::{Override, Timing},
    light::{self, Claim, Lights},
    measure::{self, Image, read_picture, timing::Ratio},
    reference::LightPaths,
    reference::Settings,
    report::{Comparison, Light, PassCost, PassDifference, Picture, Variant, comparison_page},
    trial::{self, Measured, Technique, TrialOptions},
    truth::{self, Goal},
};
use std::{
    collections::BTreeMap,
    io::Write,
    path::{Path, PathBuf},
};

/// Render several techniques, measure each against the truth, and write a page about it.
///
/// Every technique is a graph, a variant of one (graphs/indirect.ron:vpl+no-visibility), or either with settings (graphs/indirect.ron:vpl@lights.count=256,rsm.resolution=512). They are rendered in turn, so that a machine that is busy for a while is
/// busy for all of them. The truth is path-traced and holds the light that the
/// passes of the graphs cast, no more (--lights all asks for the rest); it is kept in the user's cache folder and never rendered twice (LOBELIA_CACHE names another folder); --reference takes
/// a file instead. DIR gets report.html (one file, works without a network), report.json, and the pictures as EXR.
#[derive(clap::Args, Clone, Debug)]
#[command(
    about = "Render several techniques, measure each against the truth, and write a page about it",
    after_help = "\
Examples:
  lobelia compare graphs/indirect.ron graphs/indirect.ron:no-visibility --scene builtin:cornell-glossy --report out
  lobelia compare graphs/indirect.ron:vpl@lights.count=256 graphs/indirect.ron:vpl@lights.count=4096 --output indirect.radiance --report out
  lobelia compare graphs/area-lights.ron graphs/area-lights.ron:ltc --scene builtin:area-lights --lights all --report out
  lobelia compare graphs/indirect.ron:vpl graphs/indirect.ron:interleaved --scene scenes/cornell-moving-light.ron --frames 12 --fps 12 --report out
  lobelia compare graphs/direct.ron --scene room.glb --reference truth.exr --size 640x360 --report out"
)]
pub struct Arguments {
    /// Graph file, with variants after a colon and settings after an at sign: FILE[:VARIANT[+VARIANT]][@PASS.PARAM=VALUE[,PASS.PARAM=VALUE]].
    #[arg(value_name = "GRAPH", required = true)]
    techniques: Vec<String>,
    #[command(flatten)]
    scene: SceneArguments,
    /// Override a parameter in every graph that has it: PASS.PARAM=VALUE.
    #[arg(long = "set", value_name = "PASS.PARAM=VALUE")]
    overrides: Vec<Override>,
    #[command(flatten)]
    truth: TruthArguments,
    #[command(flatten)]
    shot: ShotArguments,
    #[command(flatten)]
    sequence: SequenceArguments,
    /// Folder for the report; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    report: PathBuf,
    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

/// What is the truth.
#[derive(clap::Args, Clone, Debug)]
pub struct TruthArguments {
    /// Picture to compare with (.exr or .hdr, linear light) instead of a path-traced one; R.exr#LAYER names a layer.
    #[arg(long, value_name = "R.exr")]
    pub reference: Option<PathBuf>,
    /// Light in the path-traced reference instead of what the graphs cast: of these classes of lights (punctual, area, emissive, environment, separated by commas), or of
    /// `all`. What of it a graph does not cast is said with its share.
    #[arg(long, value_name = "all|CLASS,...")]
    pub lights: Option<Lights>,
    /// Paths in the reference instead of those that the graphs cast; `full` goes up to --depth.
    #[arg(long, value_enum)]
    pub paths: Option<Paths>,
    /// Most scattering events of the reference's paths, for --paths full, instead of what the graphs cast. 2, direct light and one bounce, if only --lights or --paths
    /// is given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub depth: Option<u32>,
    /// Samples per pixel of the reference; with --reference-error, the most that are taken.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=u64::from(u32::MAX)))]
    pub reference_spp: Option<u64>,
    /// Relative error at which the reference is good enough; 0.1 if neither this nor --reference-spp is given.
    #[arg(long, value_name = "E", value_parser = parse_error)]
    pub reference_error: Option<f64>,
}

impl TruthArguments {
    /// What a sweep asks for.
    pub fn for_sweep(sweep: &lobelia::sweep::Sweep) -> Self {
        let paths = sweep.paths.map(|paths| match paths {
            lobelia::sweep::Paths::Direct => Paths::Direct,
            lobelia::sweep::Paths::OneBounce => Paths::OneBounce,
            lobelia::sweep::Paths::Full => Paths::Full,
        });
        let lights = sweep.lights.clone();
        Self { reference: None, lights, paths, depth: None, reference_spp: None, reference_error: Some(sweep.reference_error) }
    }

    /// The light that is asked for; `None` where the graphs decide.
    pub fn asked(&self) -> Option<LightPaths> {
        if self.lights.is_none() && self.paths.is_none() && self.depth.is_none() {
            return None;
        }
        let paths = self.paths.unwrap_or(Paths::Full).with_depth(self.depth.unwrap_or(light::DEPTH));
        Some(self.lights.as_ref().map_or(paths, |lights| lights.of(paths)))
    }

    /// When the path-traced reference is good enough.
    pub fn goal(&self) -> Goal {
        let neither = self.reference_spp.is_none() && self.reference_error.is_none();
        Goal::new(self.reference_spp, self.reference_error.or(neither.then_some(0.1)))
    }
}

/// What is rendered.
#[derive(clap::Args, Clone, Debug)]
pub struct ShotArguments {
    /// Compare this radiance of the graphs instead of what they end in.
    #[arg(long, value_name = "PASS.PORT")]
    pub output: Option<String>,
    /// Camera of the scene; its first if none is named.
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Size of the pictures in pixels, each side at most 8192.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "480x270")]
    pub size: [u32; 2],
    /// Average this many sub-pixel-jittered frames in linear radiance; edges need 16 to be compared with a reference.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Seed of everything random in the techniques.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// Render every technique this many times, in turn, for its times; the first round warms up.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub rounds: u32,
    /// Use the device whose name contains this.
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Use only what every WebGPU device has.
    #[arg(long)]
    pub baseline: bool,
}

impl ShotArguments {
    /// The shot without timing, which the trial decides.
    pub fn shot(&self) -> Shot {
        Shot { extent: self.size, camera: self.camera.clone(), samples: self.samples, seed: self.seed, ..Shot::default() }
    }

    /// How a trial is run.
    pub fn trial(&self) -> TrialOptions {
        TrialOptions { adapter: self.adapter.clone(), baseline: self.baseline, rounds: self.rounds, output: self.output.clone(), time: 0.0 }
    }
}

/// A reference, and what is known of its noise.
pub struct Known {
    pub image: Image,
    /// Of each value; empty where it is not known.
    pub variance: Vec<[f32; 3]>,
    pub note: String,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    arguments.sequence.check(&arguments.truth)?;
    make_folder(&arguments.report)?;
    let registry = lobelia::registry();
    let trial::Techniques { mut techniques, mut warnings } = trial::techniques(&arguments.techniques, &arguments.overrides, &registry)?;
    name_apart(&mut techniques);
    let scene = Session::load(&arguments.scene.scene, &arguments.scene.options())?;
    // Everything that can be wrong with the input is found before the long work.
    let shot = arguments.sequence.shot(arguments.shot.shot());
    scene.camera(shot.camera.as_deref()).map_err(lobelia::SessionError::from)?;
    let mut options = shot.plan_options();
    options.keep.extend(arguments.shot.output.clone());
    let mut claims = Vec::new();
    for technique in &techniques {
        let plan = technique.wired.plan(&scene.traits(), &options)?;
        claims.push(Claim::of_output(&plan, arguments.shot.output.as_deref()));
        warnings.extend(plan.warnings().map(|warning| format!("{}: {warning}", technique.name)));
    }
    let paths = light::truth_paths(arguments.truth.asked(), &claims);
    if !arguments.quiet {
        for warning in warnings.iter().chain(&scene.warnings) {
            eprintln!("warning: {warning}");
        }
    }
    let start = arguments.scene.time;
    if arguments.sequence.is_sequence() && !scene.traits().animated && !arguments.quiet {
        eprintln!("warning: nothing moves in the scene; only --new-seeds makes its frames differ");
    }
    let (known, mut expected) =
        sequence::references(&scene, start, &shot, &arguments.sequence, (&arguments.truth, &paths), &arguments.shot, arguments.quiet)?;
    let names: Vec<(&str, &Claim)> = techniques.iter().map(|technique| technique.name.as_str()).zip(&claims).collect();
    let traced = arguments.truth.reference.is_none().then_some(&paths);
    let light = compared_light(&scene, traced, &names, &arguments.shot)?;
    let options = TrialOptions { time: start, ..arguments.shot.trial() };
    let bar = trial_bar(arguments.quiet);
    let measured = trial::run(&scene, &techniques, &shot, &options, &mut |step| show_trial(&bar, step, &shot))?;
    if arguments.sequence.is_sequence() && arguments.sequence.against() == FlickerAgainst::Own {
        let many = Shot { samples: shot.samples.saturating_mul(OWN_SAMPLES), ..shot.clone() };
        let once = TrialOptions { rounds: 1, ..options };
        let own = trial::run(&scene, &techniques, &many, &once, &mut |step| show_trial(&bar, step, &many))?;
        expected = Expected::Own(own.into_iter().map(|one| one.frames).collect());
    }
    bar.finish_and_clear();
    write(arguments, &scene, &known, &expected, &shot, &measured, light)
}

/// Techniques of the same name would be one row; later ones get a number.
fn name_apart(techniques: &mut [Technique]) {
    for index in 1..techniques.len() {
        let taken = |name: &str, before: &[Technique]| before.iter().any(|technique| technique.name == name);
        let own = techniques[index].name.clone();
        let mut number = 2;
        while taken(&techniques[index].name, &techniques[..index]) {
            techniques[index].name = format!("{own} ({number})");
            number += 1;
        }
    }
}

/// Makes a folder and refuses one that cannot be written, before any work.
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    let fail = |error: std::io::Error| Failure::Input(format!("{}: {error}", folder.display()));
    std::fs::create_dir_all(folder).map_err(fail)?;
    tempfile::Builder::new().prefix(".lobelia-").tempfile_in(folder).map_err(fail)?;
    Ok(())
}

/// The reference: a file, or path-traced.
pub fn reference(
    scene: &lobelia::scene::Scene,
    truth: &TruthArguments,
    paths: &LightPaths,
    shot: &ShotArguments,
    quiet: bool,
) -> Result<Known, Failure> {
    if let Some(file) = &truth.reference {
        let (image, notes) = read_picture(file).map_err(|error| Failure::Input(error.to_string()))?;
        if !quiet {
            for note in &notes {
                eprintln!("warning: {}: {note}", file.display());
            }
        }
        let size = [image.width, image.height];
        if size != shot.size.map(|side| side as usize) {
            let what =
                format!("{}: it has {} x {} pixels, but --size is {} x {}", file.display(), size[0], size[1], shot.size[0], shot.size[1]);
            return Err(Failure::Input(what));
        }
        return Ok(Known { image, variance: Vec::new(), note: format!("{}", file.display()) });
    }
    let camera = scene.camera(shot.camera.as_deref()).map_err(lobelia::SessionError::from)?;
    let goal = truth.goal();
    let bar = growth_bar(quiet, 1);
    let cache = truth::cache_folder();
    let settings = Settings { size: shot.size, paths: *paths, samples: goal.samples, seed: REFERENCE_SEED };
    let found = truth::truth(scene, &camera, settings, goal.error, cache.as_deref(), &mut |growth| show_growth(&bar, growth))?;
    bar.finish_and_clear();
    let note =
        format!("path-traced ({paths}), {} samples per pixel, relative MSE of its own noise {:.1e}", found.samples, found.relative_noise);
    Ok(Known { image: found.image, variance: found.variance, note })
}

/// Which light is compared, and the shares of what is not. `paths` is that of the truth, `None` where it is a file. Shares are means over small pictures of few samples:
/// a noise of some hundredths of themselves.
pub fn compared_light(
    scene: &lobelia::scene::Scene,
    paths: Option<&LightPaths>,
    techniques: &[(&str, &Claim)],
    shot: &ShotArguments,
) -> Result<Light, Failure> {
    let camera = scene.camera(shot.camera.as_deref()).map_err(lobelia::SessionError::from)?;
    let longer = shot.size[0].max(shot.size[1]);
    let size = shot.size.map(|side| (side * SHARE_SIDE.min(longer)).div_ceil(longer).max(1));
    let mut known: Vec<(LightTransport, f64)> = Vec::new();
    light::compare(paths, techniques, &scene.traits(), &mut |part| {
        if let Some((_, mean)) = known.iter().find(|(other, _)| other == part) {
            return Ok(*mean);
        }
        let settings = Settings { size, paths: LightPaths::Only(*part), samples: SHARE_SAMPLES, seed: REFERENCE_SEED };
        let mean = match part.is_nothing() {
            true => 0.0,
            false => measure::mean(&truth::truth(scene, &camera, settings, None, None, &mut |_| true)?.image).iter().sum(),
        };
        known.push((*part, mean));
        Ok(mean)
    })
}

/// Longer side of the pictures that shares of light are measured on, pixels, and their samples per pixel.
const SHARE_SIDE: u32 = 96;
const SHARE_SAMPLES: u64 = 64;

/// The techniques' seed must not choose another reference.
const REFERENCE_SEED: u32 = 1;

/// A bar for a trial.
pub fn trial_bar(quiet: bool) -> ProgressBar {
    let bar = if quiet { ProgressBar::hidden() } else { ProgressBar::new(1) };
    if let Ok(style) = ProgressStyle::with_template("{bar:32} {percent:>3} %  {elapsed_precise} (left {eta})  {msg}") {
        bar.set_style(style);
    }
    bar
}

/// Shows how far a trial is.
pub fn show_trial(bar: &ProgressBar, step: &trial::TrialStep<'_>, shot: &Shot) -> bool {
    let within = step.step.pass.as_ref().map_or(0.0, |(_, done)| f64::from(*done));
    let samples = f64::from(shot.samples);
    let of_frame = (f64::from(step.step.sample) + within) / samples;
    let done = step.done as f64 + (f64::from(step.step.frame) + of_frame) / f64::from(shot.frames);
    bar.set_length(step.total as u64 * 1000);
    bar.set_position((done * 1000.0) as u64);
    let pass = step.step.pass.as_ref().map(|(name, _)| format!(", {name}")).unwrap_or_default();
    bar.set_message(format!("{}{pass}", step.technique));
    true
}

/// Metrics by name, for tables and files.
pub fn metrics(image: &Image, reference: &Image) -> Result<BTreeMap<String, f64>, Failure> {
    let found = measure::measure(reference, image).map_err(measured_wrong)?;
    let value = serde_json::to_value(found).map_err(|error| Failure::Run(error.to_string()))?;
    let numbers = value.as_object().into_iter().flatten().map(|(name, value)| {
        // JSON has no infinity: the PSNR of equal pictures.
        (name.clone(), value.as_f64().unwrap_or(f64::INFINITY))
    });
    Ok(numbers.collect())
}

fn measured_wrong(error: measure::MeasureError) -> Failure {
    Failure::Run(error.to_string())
}

/// A picture as every picture of a report is displayed: at one exposure, chosen from the reference.
fn displayed(reference: &Image, image: &Image) -> Result<Picture, Failure> {
    let bytes: Vec<u8> = measure::display(reference, image)
        .pixels
        .as_flattened()
        .iter()
        .map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
        .collect();
    encode(image.width, image.height, &bytes)
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

const MEBIBYTE: f64 = (1u64 << 20) as f64;

fn write(
    arguments: &Arguments,
    scene: &lobelia::scene::Scene,
    known: &Known,
    expected: &Expected,
    shot: &Shot,
    measured: &[Measured],
    light: Light,
) -> Result<(), Failure> {
    let folder = &arguments.report;
    files::write_exr(&folder.join("reference.exr"), &known.image)?;
    let mut variants = Vec::new();
    for (index, one) in measured.iter().enumerate() {
        files::write_exr(&folder.join(format!("{}.exr", file_name(&one.name))), &one.image)?;
        let mut variant = variant(one, &measured[0], known)?;
        if let Some(flicker) = sequence::temporal_error(expected, index, one)? {
            variant.metrics.insert("temporal_error".to_owned(), flicker);
        }
        variants.push(variant);
    }
    let differences = measured[1..].iter().flat_map(|other| {
        trial::differences(&measured[0], other).into_iter().map(|difference| PassDifference {
            pass: difference.pass,
            a: measured[0].name.clone(),
            b: other.name.clone(),
            change: difference.change,
            what: difference.what,
        })
    });
    let comparison = Comparison {
        title: format!("{} on {}", measured.iter().map(|one| one.name.as_str()).collect::<Vec<_>>().join(", "), arguments.scene.scene),
        device: measured[0].device.clone(),
        scene: facts(arguments, scene, known, measured)
            .into_iter()
            .chain(sequence::fact(expected, arguments.scene.time, shot).map(|fact| ("sequence".to_owned(), fact)))
            .collect(),
        command: std::iter::once("lobelia".to_owned()).chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" "),
        reference: displayed(&known.image, &known.image)?,
        light: Some(light),
        differences: differences.collect(),
        variants,
    };
    let page = comparison_page(&comparison);
    write_text(&folder.join("report.html"), &page)?;
    let json = serde_json::to_string_pretty(&comparison).map_err(|error| Failure::Run(error.to_string()))?;
    write_text(&folder.join("report.json"), &json)?;
    if !arguments.quiet {
        print_table(&comparison, measured, known)?;
        writeln!(std::io::stdout(), "wrote {}", folder.join("report.html").display())?;
    }
    Ok(())
}

/// Writes text so that it is whole or absent.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    files::atomically(path, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))
}

/// A name without what file systems dislike.
fn file_name(name: &str) -> String {
    name.chars().map(|letter| if letter.is_ascii_alphanumeric() || "-_+.@=,".contains(letter) { letter } else { '_' }).collect()
}

fn variant(one: &Measured, first: &Measured, known: &Known) -> Result<Variant, Failure> {
    let mut settings = vec![("compared".to_owned(), one.output.clone())];
    settings.extend(
        one.passes.iter().filter(|pass| pass.params != "()").map(|pass| (format!("{} ({})", pass.name, pass.kind), pass.params.clone())),
    );
    settings.push(("pipelines compiled in".to_owned(), format!("{:.2} s", one.compile_seconds)));
    if one.name != first.name
        && let Some(ratio) = Ratio::paired(&one.round_ms, &first.round_ms)
    {
        settings.push((format!("time over {}", first.name), ratio_text(&ratio)));
    }
    let passes = one.passes.iter().map(|pass| {
        let gpu = pass.gpu_ms;
        PassCost {
            name: pass.name.clone(),
            median_ms: gpu.map_or(f64::NAN, |summary| summary.median),
            p5_ms: gpu.map_or(f64::NAN, |summary| summary.p5),
            p95_ms: gpu.map_or(f64::NAN, |summary| summary.p95),
            mebibytes: pass.bytes as f64 / MEBIBYTE,
            cpu_ms: pass.cpu_ms.map_or(f64::NAN, |summary| summary.median),
        }
    });
    let relative = measure::relative_error_map(&known.image, &one.image).map_err(measured_wrong)?;
    let flip = measure::flip_hdr(&known.image, &one.image, measure::flip::PIXELS_PER_DEGREE).map_err(measured_wrong)?;
    Ok(Variant {
        name: one.name.clone(),
        settings,
        metrics: metrics(&one.image, &known.image)?,
        picture: displayed(&known.image, &one.image)?,
        error: map_picture(&one.image, &relative, 1e-3, 1.0)?,
        flip: Some(map_picture(&one.image, &flip.map, 0.0, 1.0)?),
        passes: passes.collect(),
        pruned: one.dropped.clone(),
        total_ms: one.frame_ms.map_or(f64::NAN, |summary| summary.median),
        total_mebibytes: one.bytes as f64 / MEBIBYTE,
    })
}

fn ratio_text(ratio: &Ratio) -> String {
    if ratio.count < 2 {
        return format!("{:.2} (one round: no interval)", ratio.ratio);
    }
    format!("{:.2} (95 % between {:.2} and {:.2}, {} rounds)", ratio.ratio, ratio.interval.0, ratio.interval.1, ratio.count)
}

fn facts(arguments: &Arguments, scene: &lobelia::scene::Scene, known: &Known, measured: &[Measured]) -> Vec<(String, String)> {
    let traits = scene.traits();
    let size = arguments.shot.size;
    let how = match measured[0].timing {
        Timing::Off => "not taken",
        Timing::Timestamps => "timestamps on the device",
        Timing::Isolated => "wall clock, each pass alone",
    };
    [
        ("scene", arguments.scene.scene.clone()),
        ("camera", arguments.shot.camera.clone().unwrap_or_else(|| "the first".to_owned())),
        ("size", format!("{} x {} pixels, {} sub-pixel samples", size[0], size[1], arguments.shot.samples)),
        ("triangles", traits.triangles.to_string()),
        ("lights", format!("{} without extent, {} with extent", traits.punctual_lights(), traits.area_lights())),
        ("distribution of normals", scene.ndf.to_string()),
        ("reference", known.note.clone()),
        ("maps", "relative error from 0.1 % (black) to 100 % (yellow), logarithmic; FLIP (HDR) from 0 to 1".to_owned()),
        ("times", format!("{how}; {} rounds in turn, the first not counted", arguments.shot.rounds)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

fn print_table(comparison: &Comparison, measured: &[Measured], known: &Known) -> Result<(), Failure> {
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
        let mut row = vec![variant.name.clone(), format!("{:.2}", variant.total_ms), ratio, format!("{:.2}", variant.total_mebibytes)];
        row.extend(names.iter().map(|name| variant.metrics.get(*name).map_or_else(String::new, |value| format!("{value:.3e}"))));
        table.add_row(row);
    }
    let mut out = std::io::stdout().lock();
    writeln!(out, "{table}")?;
    writeln!(out, "device: {}; reference: {}", comparison.device, known.note)?;
    for sentence in comparison.light.iter().flat_map(Light::sentences) {
        writeln!(out, "light: {sentence}")?;
    }
    if let Some((_, sequence)) = comparison.scene.iter().find(|(name, _)| name == "sequence") {
        writeln!(out, "sequence: {sequence}")?;
    }
    Ok(())
}
