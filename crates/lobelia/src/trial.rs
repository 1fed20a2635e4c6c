//! Several techniques on one scene, rendered and timed in turn.

use crate::{Rendering, Session, SessionError, Shot, Step};
use lobelia_frame::{Radiance, SceneWorld};
use lobelia_graph::{FrameReport, Gpu, GpuOptions, PassTime, Problems, Resource, Timing, Wired};
use lobelia_measure::{Image, timing::Summary};
use lobelia_scene::Scene;

/// A graph with its variants and overrides applied.
pub struct Technique {
    /// What it is called in tables.
    pub name: String,
    /// The graph.
    pub wired: Wired<SceneWorld>,
}

/// How techniques are rendered.
#[derive(Clone, Debug)]
pub struct TrialOptions {
    /// Part of an adapter's name; `None` takes the best.
    pub adapter: Option<String>,
    /// Only what every WebGPU device has.
    pub baseline: bool,
    /// Times that every technique is rendered, one after another in each round. The first round warms up and is not counted if there are more.
    pub rounds: u32,
    /// What is compared: `pass.port` of a radiance; `None` takes the radiance that the graph ends in, before tone mapping.
    pub output: Option<String>,
    /// Time of animations in the first frame, seconds.
    pub time: f32,
}

/// What one pass took.
#[derive(Clone, Debug)]
pub struct PassMeasured {
    /// Name in the graph.
    pub name: String,
    /// Registered name.
    pub kind: &'static str,
    /// Parameters as RON.
    pub params: String,
    /// On the device, milliseconds a frame.
    pub gpu_ms: Option<Summary>,
    /// Recording on the CPU, milliseconds a frame.
    pub cpu_ms: Option<Summary>,
    /// Bytes of what it makes.
    pub bytes: u64,
}

/// What one technique made and took.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Name of the technique.
    pub name: String,
    /// What is compared, linear radiance; of a sequence, its last frame.
    pub image: Image,
    /// All frames, if there are several.
    pub frames: Vec<Image>,
    /// `pass.port` of that.
    pub output: String,
    /// In order of execution.
    pub passes: Vec<PassMeasured>,
    /// Passes that the scene does not need, and why.
    pub dropped: Vec<(String, String)>,
    /// Milliseconds on the device, a value for each counted round: the mean over its frames.
    pub round_ms: Vec<f64>,
    /// Milliseconds on the device over all frames of counted rounds.
    pub frame_ms: Option<Summary>,
    /// Bytes of all resources, shared memory counted once.
    pub bytes: u64,
    /// Seconds that making pipelines took.
    pub compile_seconds: f64,
    /// The device.
    pub device: String,
    /// How time was taken.
    pub timing: Timing,
}

/// How far a trial is.
#[derive(Clone, Debug)]
pub struct TrialStep<'a> {
    /// Name of the technique.
    pub technique: &'a str,
    /// Renderings done, of all rounds and techniques.
    pub done: usize,
    /// Renderings in all.
    pub total: usize,
    /// Within the rendering.
    pub step: &'a Step,
}

/// Renders every technique `rounds` times, in turn, so that what slows the machine for a while slows all of them. Each has a device of its own.
pub fn run(
    scene: &Scene,
    techniques: &[Technique],
    shot: &Shot,
    options: &TrialOptions,
    step: &mut dyn FnMut(&TrialStep<'_>) -> bool,
) -> Result<Vec<Measured>, SessionError> {
    let mut shot = shot.clone();
    shot.keep.extend(options.output.clone());
    let mut sessions = Vec::new();
    for _ in techniques {
        let gpu = Gpu::new(&GpuOptions { adapter: options.adapter.clone(), baseline: options.baseline })?;
        // Software devices run work when they please; the wall clock is right there.
        let software = gpu.info().is_some_and(|info| info.device_type == wgpu::DeviceType::Cpu);
        shot.run.timing = if gpu.has_timestamps() && !software { Timing::Timestamps } else { Timing::Isolated };
        sessions.push(Session::with(gpu, scene.clone(), options.time)?);
    }
    let mut frames: Vec<Vec<Image>> = vec![Vec::new(); techniques.len()];
    let mut renderings = Vec::new();
    for (session, technique) in sessions.iter_mut().zip(techniques) {
        renderings.push(session.start(&technique.wired, &shot)?);
    }
    let rounds = options.rounds.max(1);
    let total = rounds as usize * techniques.len();
    // For each technique, how many frames had been run at the end of each round.
    let mut ends: Vec<Vec<usize>> = vec![Vec::new(); techniques.len()];
    for round in 0..rounds as usize {
        for (index, (rendering, technique)) in renderings.iter_mut().zip(techniques).enumerate() {
            let done = round * techniques.len() + index;
            // The first round of a sequence is kept: all rounds are of the same pictures.
            let keep = (round == 0 && shot.frames > 1).then(|| output_of(rendering, technique, options)).transpose()?;
            let kept = &mut frames[index];
            let mut seen = |rendering: &Rendering<'_>| match &keep {
                Some(output) => rendering.radiance(output).map(|image| kept.push(image)),
                None => Ok(()),
            };
            rendering.run_frames(&mut |inner| step(&TrialStep { technique: &technique.name, done, total, step: inner }), &mut seen)?;
            ends[index].push(rendering.reports().len());
        }
    }
    renderings
        .iter()
        .zip(techniques)
        .zip(&ends)
        .zip(frames)
        .map(|(((rendering, technique), ends), frames)| {
            Ok(Measured { frames, ..measured(rendering, technique, ends, options, shot.run.timing)? })
        })
        .collect()
}

/// `pass.port` of the radiance that is compared.
fn output_of(rendering: &Rendering<'_>, technique: &Technique, options: &TrialOptions) -> Result<String, SessionError> {
    let plan = rendering.plan();
    match &options.output {
        Some(port) => match plan.find(port) {
            Some(index) if plan.resources[index].type_name == Radiance::NAME => Ok(plan.resources[index].name.clone()),
            Some(index) => {
                let what = format!("--output {port} is {}, but only radiance can be compared", plan.resources[index].type_name);
                Err(SessionError::Argument(what))
            }
            None => Err(SessionError::Argument(format!("`{}` makes no `{port}` on this scene", technique.name))),
        },
        None => rendering.linear_output().ok_or_else(|| {
            let what = format!(
                "`{}` ends in {}, which is no picture; name what is compared with --output",
                technique.name, plan.resources[plan.output].name
            );
            SessionError::Argument(what)
        }),
    }
}

fn measured(
    rendering: &Rendering<'_>,
    technique: &Technique,
    ends: &[usize],
    options: &TrialOptions,
    timing: Timing,
) -> Result<Measured, SessionError> {
    let plan = rendering.plan();
    let output = output_of(rendering, technique, options)?;
    // The first round warms up where there are others.
    let first = if ends.len() > 1 { ends[0] } else { 0 };
    let counted = &rendering.reports()[first..];
    let frame_ms = |report: &FrameReport| report.passes.iter().map(|pass| pass.gpu_ms).sum::<Option<f64>>();
    let rounds = ends.windows(2).map(|pair| &rendering.reports()[pair[0]..pair[1]]);
    let single = (ends.len() == 1).then_some(counted);
    let mean = |reports: &[FrameReport]| {
        reports.iter().map(|report| frame_ms(report).unwrap_or(f64::NAN)).sum::<f64>() / reports.len().max(1) as f64
    };
    let passes = plan.passes.iter().map(|pass| {
        let times = || counted.iter().flat_map(|report| &report.passes).filter(|time: &&PassTime| time.pass == pass.name);
        PassMeasured {
            name: pass.name.clone(),
            kind: pass.kind_name(),
            params: pass.params_ron(),
            gpu_ms: Summary::of(times().filter_map(|time| time.gpu_ms)),
            cpu_ms: Summary::of(times().map(|time| time.cpu_ms)),
            bytes: pass.outputs.iter().map(|index| plan.resources[*index].bytes()).sum(),
        }
    });
    Ok(Measured {
        name: technique.name.clone(),
        image: rendering.radiance(&output)?,
        frames: Vec::new(),
        passes: passes.collect(),
        dropped: plan.dropped.iter().map(|dropped| (dropped.pass.clone(), dropped.reason.clone())).collect(),
        round_ms: rounds.chain(single).map(mean).collect(),
        frame_ms: Summary::of(counted.iter().filter_map(frame_ms)),
        bytes: plan.bytes(),
        compile_seconds: rendering.gpu().pipeline_statistics().seconds,
        device: rendering.gpu().info().map_or_else(|| "unknown".to_owned(), |info| info.name.clone()),
        timing,
        output,
    })
}

/// A pass of two techniques that is not the same in both.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Name in the graphs.
    pub pass: String,
    /// What differs, in words: it is missing on one side, of another kind, or has other parameters.
    pub what: String,
    /// Change of its time on the device, as a share of the first's; NaN where one side has none.
    pub change: f64,
}

/// Which passes differ between two techniques, in the order of the first and then of the second.
pub fn differences(a: &Measured, b: &Measured) -> Vec<Difference> {
    let find = |measured: &'_ Measured, name: &str| measured.passes.iter().position(|pass| pass.name == name);
    let ms = |pass: &PassMeasured| pass.gpu_ms.map_or(f64::NAN, |summary| summary.median);
    let text = |pass: &PassMeasured| format!("{:.2} ms", ms(pass));
    let mut found = Vec::new();
    for left in &a.passes {
        match find(b, &left.name).map(|index| &b.passes[index]) {
            None => found.push(Difference {
                pass: left.name.clone(),
                what: format!("only in {} ({}, {})", a.name, left.kind, text(left)),
                change: f64::NAN,
            }),
            Some(right) if left.kind != right.kind || left.params != right.params => {
                let what = if left.kind == right.kind {
                    "other parameters".to_owned()
                } else {
                    format!("{} instead of {}", right.kind, left.kind)
                };
                let what = format!("{what}; {} against {}", text(right), text(left));
                found.push(Difference { pass: left.name.clone(), what, change: ms(right) / ms(left) - 1.0 });
            }
            Some(_) => {}
        }
    }
    for right in &b.passes {
        if find(a, &right.name).is_none() {
            found.push(Difference {
                pass: right.name.clone(),
                what: format!("only in {} ({}, {})", b.name, right.kind, text(right)),
                change: f64::NAN,
            });
        }
    }
    found
}

/// Reads and wires `FILE[:VARIANT[+VARIANT]]...` as a user writes it.
pub fn technique(
    text: &str,
    overrides: &[lobelia_graph::Override],
    registry: &lobelia_graph::Registry<SceneWorld>,
) -> Result<Technique, Problems> {
    let (file, variants) = split_variants(text);
    let wired = lobelia_graph::GraphFile::load(file.as_ref())?.wire(registry, &variants, overrides)?;
    let stem = std::path::Path::new(file).file_stem().map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned());
    let name = if variants.is_empty() { stem } else { format!("{stem}:{}", variants.join("+")) };
    Ok(Technique { name, wired })
}

/// The file and the variants of `FILE:VARIANT+VARIANT`. A colon within a path (as in `C:\graphs`) belongs to the path.
fn split_variants(text: &str) -> (&str, Vec<String>) {
    match text.rsplit_once(':') {
        Some((file, variants)) if !variants.contains(['/', '\\', '.']) && !file.is_empty() && !variants.is_empty() => {
            (file, variants.split('+').map(str::to_owned).collect())
        }
        _ => (text, Vec::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn graphs_are_named_with_their_variants() {
        assert_eq!(split_variants("graphs/a.ron"), ("graphs/a.ron", vec![]));
        assert_eq!(split_variants("graphs/a.ron:b+c"), ("graphs/a.ron", vec!["b".into(), "c".into()]));
        assert_eq!(split_variants("C:\\graphs\\a.ron"), ("C:\\graphs\\a.ron", vec![]));
        assert_eq!(split_variants("C:\\a.ron:b"), ("C:\\a.ron", vec!["b".into()]));
    }
}
