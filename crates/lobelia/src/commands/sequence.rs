//! Sequences: what is compared over time.

use super::compare::{Known, ShotArguments, TruthArguments, reference};
use crate::failure::Failure;
use lobelia::{
    Shot, frame_time,
    measure::{
        self, Image,
        sampled::{Replication, Sampled},
    },
    reference::LightPaths,
    report::SequenceSettings,
    scene::Scene,
    trial::Measured,
};

/// Frames of an animated scene.
#[derive(clap::Args, Clone, Debug)]
pub struct SequenceArguments {
    /// Render this many frames of the scene's animation and report what flickers, as `temporal_error`: how much more or less a picture changes from frame to frame
    /// than it should, over the mean radiance. Pictures and all other metrics are of the last frame.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub frames: u32,
    /// Frames per second of a sequence; 24 if it is not given.
    #[arg(long, value_name = "F", value_parser = parse_fps)]
    pub fps: Option<f32>,
    /// Give every frame of a sequence random numbers of its own. Without, frames differ by what moves alone.
    #[arg(long)]
    pub new_seeds: bool,
    /// What a sequence is held against: `truth` path-traces every frame; `own` takes each technique's own mean over 16 times the samples, which knows its noise but
    /// not its bias.
    #[arg(long, value_name = "truth|own", value_enum)]
    pub flicker_against: Option<FlickerAgainst>,
}

/// What should change from frame to frame.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlickerAgainst {
    /// What path-traced frames do.
    Truth,
    /// What the technique does with many more samples.
    Own,
}

/// How many times the samples of a technique make its own reference.
pub const OWN_SAMPLES: u32 = 16;

/// Frames per second.
pub fn parse_fps(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(fps) if fps.is_finite() && (1e-3..=1e6).contains(&fps) => Ok(fps),
        _ => Err(format!("`{text}` is no number of frames per second in [0.001, 1000000]")),
    }
}

impl SequenceArguments {
    /// Whether there is more than one frame.
    pub fn is_sequence(&self) -> bool {
        self.frames > 1
    }

    /// What frames are held against.
    pub fn against(&self) -> FlickerAgainst {
        self.flicker_against.unwrap_or(FlickerAgainst::Truth)
    }

    /// Arguments that contradict each other.
    pub fn check(&self, truth: &TruthArguments) -> Result<(), Failure> {
        let idle = [("--fps", self.fps.is_some()), ("--new-seeds", self.new_seeds), ("--flicker-against", self.flicker_against.is_some())];
        if let Some((name, _)) = idle.iter().find(|(_, given)| *given && !self.is_sequence()) {
            return Err(Failure::Input(format!("{name} is about sequences; ask for one with --frames 2 or more")));
        }
        if let (Some(file), true, FlickerAgainst::Truth) = (&truth.reference, self.is_sequence(), self.against()) {
            let what = "is one picture, but a sequence needs one for each frame; leave --reference out, or add --flicker-against own";
            return Err(Failure::Input(format!("--reference {}: {what}", file.display())));
        }
        Ok(())
    }

    /// The shot with its frames.
    pub fn shot(&self, shot: Shot) -> Shot {
        Shot { frames: self.frames, frame_seconds: 1.0 / self.fps.unwrap_or(24.0), new_seeds: self.new_seeds, ..shot }
    }
}

/// What frames are held against.
pub enum Expected {
    /// There is one frame only.
    Nothing,
    /// The same for all techniques, with the flicker that its own noise makes.
    Truth(Vec<Image>, f64),
    /// For each technique.
    Own(Vec<Vec<Image>>),
}

/// The reference of the last frame, and those of all frames where they are path-traced.
pub fn references(
    scene: &Scene,
    start: f32,
    shot: &Shot,
    sequence: &SequenceArguments,
    (truth, paths): (&TruthArguments, &LightPaths),
    arguments: &ShotArguments,
    quiet: bool,
) -> Result<(Known, Expected), Failure> {
    let mut scene = scene.clone();
    let mut at = |frame: u32| {
        if sequence.is_sequence() {
            scene.set_time(frame_time(start, shot, frame));
        }
        reference(&scene, truth, paths, arguments, quiet)
    };
    if !sequence.is_sequence() || sequence.against() == FlickerAgainst::Own {
        return Ok((at(shot.frames - 1)?, Expected::Nothing));
    }
    let known = (0..shot.frames).map(at).collect::<Result<Vec<_>, _>>()?;
    let noise = noise_flicker(&known);
    let frames = known.iter().map(|known| known.image.clone()).collect();
    let last = known.into_iter().next_back().ok_or_else(|| Failure::Run("a sequence has no frame".into()))?;
    Ok((last, Expected::Truth(frames, noise)))
}

/// The flicker of path-traced frames if their noise were normal and independent: the mean of `|a - b|` is `sqrt(2 (var a + var b) / pi)`. Frames share their random
/// numbers, so that it is less where nothing changes.
fn noise_flicker(known: &[Known]) -> f64 {
    let (mut change, mut total, mut values) = (0.0, 0.0, 0usize);
    for pair in known.windows(2) {
        for (before, after) in pair[0].variance.as_flattened().iter().zip(pair[1].variance.as_flattened()) {
            change += ((f64::from(*before) + f64::from(*after)) * std::f64::consts::FRAC_2_PI).sqrt();
            values += 1;
        }
    }
    let mut pixels = 0usize;
    for value in known.iter().flat_map(|known| known.image.pixels.as_flattened()) {
        total += f64::from(*value);
        pixels += 1;
    }
    if change == 0.0 { 0.0 } else { (change / values as f64) / (total / pixels as f64) }
}

/// Flicker of one technique, with a value for each step; `None` where there is one frame.
pub fn temporal_error(expected: &Expected, index: usize, measured: &Measured) -> Result<Option<Sampled>, Failure> {
    let frames = match expected {
        Expected::Nothing => return Ok(None),
        Expected::Truth(frames, _) => frames,
        Expected::Own(frames) => &frames[index],
    };
    let (steps, _) = measure::temporal_errors(frames, &measured.frames).map_err(|error| Failure::Run(error.to_string()))?;
    let value = steps.iter().sum::<f64>() / steps.len() as f64;
    Ok(Some(Sampled { value, replicates: steps, replication: Replication::Steps }))
}

/// What was done; `None` where there is one frame.
pub fn settings(expected: &Expected, shot: &Shot) -> Option<SequenceSettings> {
    let (against, own_samples, reference_flicker) = match expected {
        Expected::Nothing => return None,
        Expected::Truth(_, noise) => ("truth", None, Some(*noise)),
        Expected::Own(_) => ("own", Some(shot.samples.saturating_mul(OWN_SAMPLES)), None),
    };
    Some(SequenceSettings {
        frames: shot.frames,
        // What was asked for is a single float.
        frames_per_second: f64::from((1.0 / shot.frame_seconds * 1e4).round() / 1e4),
        new_seeds: shot.new_seeds,
        flicker_against: against.to_owned(),
        own_samples,
        reference_flicker,
    })
}
