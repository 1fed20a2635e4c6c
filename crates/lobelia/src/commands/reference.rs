use super::{SceneArguments, parse_size};
use crate::{
    failure::Failure,
    files::{self, Kind},
    progress,
};
use indicatif::ProgressBar;
use lobelia::{
    Session,
    light::Lights,
    measure::Image,
    reference::{LightPaths, Picture, ReferenceError, Render, Settings},
    truth::{self, Goal, Growth, Keep},
};
use std::{
    io::Write,
    path::{Path, PathBuf},
    time::Duration,
};

/// Path-trace the truth on the CPU.
///
/// The picture grows pass by pass until the wanted samples or error are reached. While it grows it is kept in a checkpoint beside the output; a run that
/// was killed goes on from there, and the picture is the same bit for bit as that of an unbroken run. Beside R.exr, R.variance.exr holds the variance of
/// each pixel's value.
#[derive(clap::Args, Clone, Debug)]
#[command(
    about = "Path-trace the truth on the CPU",
    after_help = "\
Examples:
  lobelia reference --scene builtin:cornell-glossy --paths one-bounce --spp 256 -o truth.exr
  lobelia reference --scene room.glb --camera sofa --size 1280x720 --paths full --error 0.02 -o room.exr
  lobelia reference --scene room.glb --paths direct --lights area,environment --error 0.05 -o sky.exr
  lobelia reference --scene room.glb --paths direct --spp 64 --threads 4 --seed 7 -o direct.exr"
)]
pub struct Arguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Which light: scattered once (direct), exactly twice (one-bounce), or all of it (full).
    #[arg(long, value_enum, default_value_t = Paths::Full)]
    paths: Paths,
    /// Most scattering events of a path, for --paths full.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=1000))]
    depth: u32,
    /// Only the light of these classes, separated by commas: punctual, area, emissive, environment. The other lights stay where they are, and are black.
    #[arg(long, value_name = "CLASS,...", default_value = "all")]
    lights: Lights,
    /// Samples per pixel; rounded up to a multiple of 16 above 16. With --error, the most that are taken.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=u64::from(u32::MAX)))]
    spp: Option<u64>,
    /// Stop once the relative error is estimated to be below this: root of the mean of variance / (value^2 + (0.1 mean)^2).
    #[arg(long, value_name = "E", value_parser = parse_error)]
    error: Option<f64>,
    /// Camera of the scene; its first if none is named.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Size of the picture in pixels, each side at most 8192.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "960x540")]
    size: [u32; 2],
    /// Chooses the noise; equal seeds give equal pictures on any number of threads.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Threads; all cores if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Seconds between checkpoints.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = parse_seconds)]
    checkpoint: f64,
    /// Picture to write: .exr, linear RGB.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

/// Names of [`LightPaths`].
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paths {
    /// Light that scatters exactly once; lights seen directly are not in it.
    Direct,
    /// Light that scatters exactly twice: one-bounce indirect light.
    OneBounce,
    /// Everything up to --depth scattering events, lights and background included.
    Full,
}

impl Paths {
    /// With a depth for `full`.
    pub fn with_depth(self, depth: u32) -> LightPaths {
        match self {
            Self::Direct => LightPaths::Direct,
            Self::OneBounce => LightPaths::OneBounce,
            Self::Full => LightPaths::Full { depth },
        }
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=1e9).contains(&seconds) => Ok(seconds),
        _ => Err("it must be a number from 0 on".into()),
    }
}

/// A relative error.
pub fn parse_error(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(error) if error.is_finite() && error > 0.0 => Ok(error),
        _ => Err("it must be a number above 0, such as 0.02 for 2 %".into()),
    }
}

impl From<ReferenceError> for Failure {
    fn from(error: ReferenceError) -> Self {
        match error {
            ReferenceError::Settings(_) => Failure::Input(error.to_string()),
            error => Failure::Run(error.to_string()),
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    files::kind_of(&arguments.output, &[Kind::Exr])?;
    files::check_goal(&arguments.output)?;
    let scene = Session::load(&arguments.scene.scene, &arguments.scene.options())?;
    if !arguments.quiet {
        for warning in &scene.warnings {
            eprintln!("warning: {warning}");
        }
    }
    let camera = scene.camera(arguments.camera.as_deref()).map_err(lobelia::SessionError::from)?;
    let goal = Goal::new(arguments.spp, arguments.error);
    let paths = arguments.lights.of(arguments.paths.with_depth(arguments.depth));
    let settings = Settings { size: arguments.size, paths, samples: goal.samples, seed: arguments.seed };
    let mut render = Render::new(&scene, &camera, settings)?;
    let checkpoint = arguments.output.with_extension("checkpoint");
    resume(&mut render, &checkpoint, arguments.quiet)?;
    if render.done() > render.passes() {
        let what = format!("{} holds more samples than --spp asks for; remove it to begin anew", checkpoint.display());
        return Err(Failure::Input(what));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.unwrap_or(0).into()).build();
    let pool = pool.map_err(|error| Failure::Run(format!("cannot start threads: {error}")))?;
    let bar = growth_bar(arguments.quiet, render.passes());
    let keep = Keep { file: &checkpoint, every: Duration::from_secs_f64(arguments.checkpoint) };
    let picture = pool.install(|| truth::grow(&mut render, &goal, Some(keep), &mut |growth| show_growth(&bar, growth)))?;
    bar.finish_and_clear();
    files::write_exr(&arguments.output, &image(&picture, &picture.pixels))?;
    files::write_exr(&arguments.output.with_extension("variance.exr"), &image(&picture, &picture.variance))?;
    if checkpoint.exists() {
        std::fs::remove_file(&checkpoint).map_err(|error| Failure::Run(format!("{}: {error}", checkpoint.display())))?;
    }
    if !arguments.quiet {
        let error = match render.passes() {
            // One pass has nothing to vary from.
            0 | 1 => "error unknown: more than 16 samples are needed to estimate it".to_owned(),
            _ => format!("estimated relative error {:.2} %", 100.0 * picture.relative_noise().sqrt()),
        };
        writeln!(std::io::stdout(), "wrote {} ({} samples per pixel, {error}, {})", arguments.output.display(), picture.samples, paths)?;
        if picture.dropped > 0 {
            eprintln!("warning: {} samples were not finite and count as black", picture.dropped);
        }
    }
    Ok(())
}

/// Goes on from a checkpoint of the same picture; one of another picture is refused, so that it is not overwritten unseen.
fn resume(render: &mut Render, checkpoint: &Path, quiet: bool) -> Result<(), Failure> {
    truth::resume(render, checkpoint).map_err(|error| Failure::Input(format!("{error}; remove the file to begin anew")))?;
    if render.done() > 0 && !quiet {
        eprintln!("going on from {} after {} passes", checkpoint.display(), render.done());
    }
    Ok(())
}

/// A bar for a growing reference.
pub fn growth_bar(quiet: bool, passes: u64) -> ProgressBar {
    progress::bar(quiet, passes)
}

/// Shows how far a reference is.
pub fn show_growth(bar: &ProgressBar, growth: &Growth) -> bool {
    bar.set_length(growth.expected);
    bar.set_position(growth.done);
    let error = growth.error.map(|error| format!(", relative error {:.2} %", 100.0 * error)).unwrap_or_default();
    bar.set_message(format!("reference: {} samples{error}", growth.samples));
    true
}

fn image(picture: &Picture, pixels: &[[f32; 3]]) -> Image {
    Image { width: picture.size[0] as usize, height: picture.size[1] as usize, pixels: pixels.to_vec() }
}
