use super::{
    SceneArguments, compare_report, parse_size,
    reference::{Paths, growth_bar, parse_error, show_growth},
    sequence,
    sequence::{Expected, FlickerAgainst, OWN_SAMPLES, SequenceArguments},
};
use crate::{failure::Failure, files, progress};
use indicatif::ProgressBar;
use lobelia::{
    Session, Shot,
    frame::LightTransport,
    graph::Override,
    light::{self, Claim, Lights},
    measure::{self, Image, read_exr, read_picture},
    reference::{LightPaths, Settings},
    report::{self, Light},
    trial::{self, Technique, TrialOptions},
    truth::{self, Goal},
};
use std::path::{Path, PathBuf};

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
    pub(super) scene: SceneArguments,
    /// Override a parameter in every graph that has it: PASS.PARAM=VALUE.
    #[arg(long = "set", value_name = "PASS.PARAM=VALUE")]
    overrides: Vec<Override>,
    #[command(flatten)]
    truth: TruthArguments,
    #[command(flatten)]
    pub(super) shot: ShotArguments,
    #[command(flatten)]
    pub(super) sequence: SequenceArguments,
    /// Folder for the report; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    pub(super) report: PathBuf,
    /// Print nothing but errors.
    #[arg(short, long)]
    pub(super) quiet: bool,
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
    /// Average this many sub-pixel-jittered frames in linear radiance; edges need 16 to be compared with a reference. Intervals of metrics are over groups of
    /// them; with fewer than 4, over six pictures with other seeds.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Seed of everything random in the techniques.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// Render every technique this many times, in turn, for its times and their intervals; the first round warms up.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
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
    /// Where it comes from, for the report; its picture and the floor are filled in there.
    pub about: report::Reference,
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
    compare_report::write(arguments, &scene, &known, &expected, &shot, &measured, light)
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
        let variance = variance_beside(file, &image)?;
        let about = report::Reference { file: Some(file.display().to_string()), ..Default::default() };
        return Ok(Known { image, variance, about });
    }
    let camera = scene.camera(shot.camera.as_deref()).map_err(lobelia::SessionError::from)?;
    let goal = truth.goal();
    let bar = growth_bar(quiet, 1);
    let cache = truth::cache_folder();
    let settings = Settings { size: shot.size, paths: *paths, samples: goal.samples, seed: REFERENCE_SEED };
    let found = truth::truth(scene, &camera, settings, goal.error, cache.as_deref(), &mut |growth| show_growth(&bar, growth))?;
    bar.finish_and_clear();
    let (paths, depth) = match paths {
        LightPaths::Full { depth } => ("full", Some(*depth)),
        LightPaths::OneBounce => ("one-bounce", None),
        LightPaths::Direct => ("direct", None),
        // Which it is stands in `light` of the report.
        LightPaths::Only(_) => ("only", None),
    };
    let about = report::Reference {
        paths: Some(paths.to_owned()),
        depth,
        samples_per_pixel: Some(found.samples),
        relative_noise: Some(found.relative_noise),
        ..Default::default()
    };
    Ok(Known { image: found.image, variance: found.variance, about })
}

/// The variance that `lobelia reference` and this command write beside a picture `R.exr`, as `R.variance.exr`; empty where it is not there.
fn variance_beside(file: &Path, image: &Image) -> Result<Vec<[f32; 3]>, Failure> {
    let beside = file.with_extension("variance.exr");
    if !beside.is_file() {
        return Ok(Vec::new());
    }
    let variance = read_exr(&beside).map_err(|error| Failure::Input(error.to_string()))?;
    if (variance.width, variance.height) != (image.width, image.height) {
        let what = format!("{}: it has another size than {}", beside.display(), file.display());
        return Err(Failure::Input(what));
    }
    Ok(variance.pixels)
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
    progress::bar(quiet, 1)
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

/// Writes text so that it is whole or absent.
pub fn write_text(path: &Path, text: &str) -> Result<(), Failure> {
    use std::io::Write as _;
    files::atomically(path, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))
}
