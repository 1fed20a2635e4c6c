//! Several techniques on one scene, rendered and timed in turn.

use crate::{Rendering, Session, SessionError, Shot, Step};
use lobelia_frame::{Radiance, SceneWorld};
use lobelia_graph::{FrameReport, Gpu, GpuOptions, GraphFile, Override, Problems, Registry, Resource, Timing, Wired};
use lobelia_measure::{
    Image, Pictures,
    sampled::Replication,
    timing::{Summary, Timed},
};
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
    /// Parameters by name.
    pub params: serde_json::Value,
    /// On the device, milliseconds a frame.
    pub gpu_ms: Option<Timed>,
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
    /// What is compared, linear radiance, and what tells its noise; of a sequence, its last frame.
    pub pictures: Pictures,
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
    pub frame_ms: Option<Timed>,
    /// How the graph itself brings radiance to a display: the `curve` of its last `tonemap` pass, and its exposure in stops.
    pub tone: Option<(String, f64)>,
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

/// The fewest groups of samples that tell the noise of a picture. Of a picture with fewer samples, whole pictures with other seeds do.
const LEAST_GROUPS: u32 = 4;
/// The most groups: more would cost more work and tell little more.
const MOST_GROUPS: u32 = 8;
/// Pictures with other seeds, the shown one counted, where samples are too few for groups.
const REPEATS: u32 = 6;

/// In how many groups the samples of a picture are summed.
fn groups(samples: u32) -> u32 {
    if samples < LEAST_GROUPS { 1 } else { samples.min(MOST_GROUPS) }
}

/// Renders every technique `rounds` times, in turn, so that what slows the machine for a while slows all of them. Each has a device of its own.
///
/// The noise of a picture is told by groups of its samples, at most eight. With fewer than four samples it is told by six pictures with other seeds: rounds after the
/// first take other seeds then, and where there are fewer than six rounds, some follow that are not timed.
pub fn run(
    scene: &Scene,
    techniques: &[Technique],
    shot: &Shot,
    options: &TrialOptions,
    step: &mut dyn FnMut(&TrialStep<'_>) -> bool,
) -> Result<Vec<Measured>, SessionError> {
    let mut shot = shot.clone();
    shot.keep.extend(options.output.clone());
    shot.groups = groups(shot.samples);
    let mut sessions = Vec::new();
    for _ in techniques {
        let gpu = Gpu::new(&GpuOptions { adapter: options.adapter.clone(), baseline: options.baseline })?;
        // Software devices run work when they please; the wall clock is right there.
        let software = gpu.info().is_some_and(|info| info.device_type == wgpu::DeviceType::Cpu);
        shot.run.timing = if gpu.has_timestamps() && !software { Timing::Timestamps } else { Timing::Isolated };
        sessions.push(Session::with(gpu, scene.clone(), options.time)?);
    }
    let mut renderings = Vec::new();
    for (session, technique) in sessions.iter_mut().zip(techniques) {
        renderings.push(session.start(&technique.wired, &shot)?);
    }
    let timed = options.rounds.max(1) as usize;
    let rounds = if shot.groups > 1 { timed } else { timed.max(REPEATS as usize) };
    let total = rounds * techniques.len();
    let mut frames: Vec<Vec<Image>> = vec![Vec::new(); techniques.len()];
    let mut pictures: Vec<Pictures> = Vec::new();
    // For each technique, how many frames had been run at the end of each timed round.
    let mut ends: Vec<Vec<usize>> = vec![Vec::new(); techniques.len()];
    for round in 0..rounds {
        for (index, (rendering, technique)) in renderings.iter_mut().zip(techniques).enumerate() {
            let done = round * techniques.len() + index;
            let output = output_of(rendering, technique, options)?;
            if shot.groups == 1 {
                // The seeds of samples are multiples of another number away from that of the picture.
                rendering.set_seed(shot.seed.wrapping_add((round as u32).wrapping_mul(0x85eb_ca6b)));
            }
            // The first round of a sequence is kept.
            let keep = round == 0 && shot.frames > 1;
            let kept = &mut frames[index];
            let mut seen = |rendering: &Rendering<'_>| {
                if keep {
                    kept.push(rendering.radiance(&output)?);
                }
                Ok(())
            };
            rendering.run_frames(&mut |inner| step(&TrialStep { technique: &technique.name, done, total, step: inner }), &mut seen)?;
            if round < timed {
                ends[index].push(rendering.reports().len());
            }
            if round == 0 {
                let image = rendering.radiance(&output)?;
                let (shares, parts): (Vec<f64>, Vec<Image>) = rendering.groups(&output).into_iter().unzip();
                let replication = if shares.is_empty() { Replication::Repeats } else { Replication::LeaveOut(shares) };
                let parts = if parts.is_empty() { vec![image.clone()] } else { parts };
                pictures.push(Pictures { image, replication, parts });
            } else if shot.groups == 1 && round < REPEATS as usize {
                pictures[index].parts.push(rendering.radiance(&output)?);
            }
        }
    }
    let parts = renderings.iter().zip(techniques).zip(&ends).zip(frames.into_iter().zip(pictures));
    parts
        .map(|(((rendering, technique), ends), (frames, pictures))| {
            measured(rendering, technique, ends, options, shot.run.timing, frames, pictures)
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
    frames: Vec<Image>,
    pictures: Pictures,
) -> Result<Measured, SessionError> {
    let plan = rendering.plan();
    let output = output_of(rendering, technique, options)?;
    // The first round warms up where there are others.
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let mut rounds: Vec<&[FrameReport]> = starts.zip(ends).map(|(start, end)| &rendering.reports()[start..*end]).collect();
    if rounds.len() > 1 {
        rounds.remove(0);
    }
    let frame_ms = |report: &FrameReport| report.passes.iter().map(|pass| pass.gpu_ms).sum::<Option<f64>>();
    let mean = |reports: &&[FrameReport]| {
        reports.iter().map(|report| frame_ms(report).unwrap_or(f64::NAN)).sum::<f64>() / reports.len().max(1) as f64
    };
    let passes = plan.passes.iter().map(|pass| {
        let of = |report: &FrameReport| report.passes.iter().filter(|time| time.pass == pass.name).cloned().collect::<Vec<_>>();
        let gpu = |reports: &&[FrameReport]| reports.iter().flat_map(of).filter_map(|time| time.gpu_ms).collect::<Vec<f64>>();
        PassMeasured {
            name: pass.name.clone(),
            kind: pass.kind_name(),
            params: pass.params_json(),
            gpu_ms: Timed::of(&rounds.iter().map(gpu).collect::<Vec<_>>()),
            cpu_ms: Summary::of(rounds.iter().flat_map(|reports| reports.iter()).flat_map(of).map(|time| time.cpu_ms)),
            bytes: pass.outputs.iter().map(|index| plan.resources[*index].bytes()).sum(),
        }
    });
    let tonemap = plan.passes.iter().rev().find(|pass| pass.kind_name() == "tonemap").map(|pass| pass.params_json());
    let tone = tonemap.and_then(|params| Some((params["curve"].as_str()?.to_owned(), params["exposure"].as_f64()?)));
    Ok(Measured {
        name: technique.name.clone(),
        pictures,
        frames,
        passes: passes.collect(),
        dropped: plan.dropped.iter().map(|dropped| (dropped.pass.clone(), dropped.reason.clone())).collect(),
        round_ms: rounds.iter().map(mean).collect(),
        frame_ms: Timed::of(&rounds.iter().map(|reports| reports.iter().filter_map(frame_ms).collect()).collect::<Vec<_>>()),
        tone,
        bytes: plan.bytes(),
        compile_seconds: rendering.gpu().pipeline_statistics().seconds,
        device: rendering.gpu().info().map_or_else(|| "unknown".to_owned(), |info| info.name.clone()),
        timing,
        output,
    })
}

/// What differs in a pass of two techniques.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Only the first technique has it.
    OnlyFirst,
    /// Only the second technique has it.
    OnlySecond,
    /// Another kind of pass.
    Kind,
    /// Other parameters.
    Parameters,
}

/// Which passes differ between two techniques, in the order of the first and then of the second: its name, and what differs.
pub fn differences(a: &Measured, b: &Measured) -> Vec<(String, Change)> {
    let find = |measured: &'_ Measured, name: &str| measured.passes.iter().position(|pass| pass.name == name);
    let mut found = Vec::new();
    for left in &a.passes {
        let change = match find(b, &left.name).map(|index| &b.passes[index]) {
            None => Change::OnlyFirst,
            Some(right) if left.kind != right.kind => Change::Kind,
            Some(right) if left.params != right.params => Change::Parameters,
            Some(_) => continue,
        };
        found.push((left.name.clone(), change));
    }
    let new = b.passes.iter().filter(|right| find(a, &right.name).is_none());
    found.extend(new.map(|right| (right.name.clone(), Change::OnlySecond)));
    found
}

/// A technique as a user writes it: `FILE[:VARIANT[+VARIANT]...][@PASS.PARAM=VALUE[,PASS.PARAM=VALUE]...]`.
#[derive(Clone, Debug, PartialEq)]
struct Written {
    file: String,
    variants: Vec<String>,
    settings: Vec<Override>,
    /// The settings as they were written.
    text: String,
}

/// Several techniques, and what is worth a warning.
pub struct Techniques {
    /// In the order in which they were named.
    pub techniques: Vec<Technique>,
    /// Overrides that do not fit some of them.
    pub warnings: Vec<String>,
}

/// Reads and wires techniques. `overrides` are for all of them: one that fits none is an error, one that fits some is applied to those and the others are named in
/// a warning. The settings of a technique itself come after them and must fit it.
pub fn techniques(texts: &[String], overrides: &[Override], registry: &Registry<SceneWorld>) -> Result<Techniques, SessionError> {
    let mut graphs = Vec::new();
    for text in texts {
        let written = Written::read(text).map_err(SessionError::Argument)?;
        graphs.push((GraphFile::load(written.file.as_ref())?, written));
    }
    let lacks = |item: &Override| graphs.iter().map(|(graph, written)| graph.lacks(registry, &written.variants, item)).collect::<Vec<_>>();
    let lacking: Vec<Vec<Option<String>>> = overrides.iter().map(lacks).collect();
    // What no graph has is refused by the graph that has the nearest name.
    for (item, lacking) in overrides.iter().zip(&lacking) {
        if !lacking.is_empty() && lacking.iter().all(Option::is_some) {
            let wire = |(graph, written): &(GraphFile, Written)| graph.wire(registry, &written.variants, std::slice::from_ref(item)).err();
            let refusals: Vec<Problems> = graphs.iter().filter_map(wire).collect();
            let suggests = |problems: &Problems| {
                problems.problems.iter().any(|problem| problem.help.as_ref().is_some_and(|help| help.starts_with("did you mean")))
            };
            let nearest = refusals.iter().position(suggests).unwrap_or(0);
            if let Some(problems) = refusals.into_iter().nth(nearest) {
                return Err(problems.into());
            }
        }
    }
    let mut found = Techniques { techniques: Vec::new(), warnings: Vec::new() };
    for (index, (graph, written)) in graphs.iter().enumerate() {
        let name = written.name();
        let mut fitting = Vec::new();
        for (item, lacking) in overrides.iter().zip(&lacking) {
            match &lacking[index] {
                None => fitting.push(item.clone()),
                Some(why) => {
                    found.warnings.push(format!("--set {}.{}={}: {name} {why}; it stays as it is", item.pass, item.param, item.value));
                }
            }
        }
        fitting.extend(written.settings.iter().cloned());
        found.techniques.push(Technique { name, wired: graph.wire(registry, &written.variants, &fitting)? });
    }
    Ok(found)
}

impl Written {
    fn read(text: &str) -> Result<Self, String> {
        // Whatever its name looks like, a file that is there is meant.
        let (graph, settings) = if std::path::Path::new(text).is_file() { (text, "") } else { split_settings(text) };
        let (file, variants) = split_variants(graph);
        let parse = |setting: &&str| setting.parse::<Override>().map_err(|error| format!("`{text}`: {error}"));
        let parsed = split_list(settings).iter().map(parse).collect::<Result<_, _>>()?;
        Ok(Self { file: file.to_owned(), variants, settings: parsed, text: settings.to_owned() })
    }

    fn name(&self) -> String {
        let stem =
            std::path::Path::new(&self.file).file_stem().map_or_else(|| self.file.clone(), |stem| stem.to_string_lossy().into_owned());
        let variants = if self.variants.is_empty() { String::new() } else { format!(":{}", self.variants.join("+")) };
        let settings = if self.text.is_empty() { String::new() } else { format!("@{}", self.text) };
        format!("{stem}{variants}{settings}")
    }
}

/// The graph and the settings of `GRAPH@SETTINGS`. Settings begin at the first `@` that `NAME.NAME=` follows; any other belongs to the path or to a value.
fn split_settings(text: &str) -> (&str, &str) {
    let begins = |rest: &str| {
        let name = rest.split_once('=').map(|(name, _)| name);
        name.and_then(|name| name.split_once('.')).is_some_and(|(pass, param)| {
            let plain = |name: &str| !name.is_empty() && !name.contains(['/', '\\', ':', '@', ',', '.']);
            plain(pass) && plain(param)
        })
    };
    let at = text.match_indices('@').map(|(at, _)| at).find(|at| *at > 0 && begins(&text[at + 1..]));
    at.map_or((text, ""), |at| (&text[..at], &text[at + 1..]))
}

/// The pieces between commas that stand in no bracket and no quotes.
fn split_list(text: &str) -> Vec<&str> {
    let (mut pieces, mut start, mut depth, mut quoted, mut escaped) = (Vec::new(), 0, 0i32, false, false);
    for (at, letter) in text.char_indices() {
        match letter {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            _ if quoted => {}
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth <= 0 => {
                pieces.push(&text[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    if !text.is_empty() {
        pieces.push(&text[start..]);
    }
    pieces
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
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn graphs_are_named_with_their_variants() {
        assert_eq!(split_variants("graphs/a.ron"), ("graphs/a.ron", vec![]));
        assert_eq!(split_variants("graphs/a.ron:b+c"), ("graphs/a.ron", vec!["b".into(), "c".into()]));
        assert_eq!(split_variants("C:\\graphs\\a.ron"), ("C:\\graphs\\a.ron", vec![]));
        assert_eq!(split_variants("C:\\a.ron:b"), ("C:\\a.ron", vec!["b".into()]));
    }

    #[test]
    fn settings_follow_the_graph() {
        let read = |text: &str| {
            let written = Written::read(text).unwrap();
            let settings: Vec<String> =
                written.settings.iter().map(|item| format!("{}.{}={}", item.pass, item.param, item.value)).collect();
            (written.file.clone(), written.variants.join("+"), settings.join(" "), written.name())
        };
        let expect = |text: &str, file: &str, variants: &str, settings: &str, name: &str| {
            assert_eq!(read(text), (file.to_owned(), variants.to_owned(), settings.to_owned(), name.to_owned()), "{text}");
        };
        expect("g/a.ron:b+c@x.y=1,z.w=2", "g/a.ron", "b+c", "x.y=1 z.w=2", "a:b+c@x.y=1,z.w=2");
        expect("g/a.ron@x.y=1.5", "g/a.ron", "", "x.y=1.5", "a@x.y=1.5");
        // Commas, colons and more at-signs within values.
        expect("a.ron@x.y=[1,(2,3)],z.w={\"k\":1}", "a.ron", "", "x.y=[1,(2,3)] z.w={\"k\":1}", "a@x.y=[1,(2,3)],z.w={\"k\":1}");
        expect(r#"a.ron:v@x.y="a,b@c.d=\",",z.w=2"#, "a.ron", "v", r#"x.y="a,b@c.d=\"," z.w=2"#, r#"a:v@x.y="a,b@c.d=\",",z.w=2"#);
        // At-signs and drives of paths.
        expect("C:\\me@home\\a.ron:v@x.y=1", "C:\\me@home\\a.ron", "v", "x.y=1", &read("C:\\me@home\\a.ron:v@x.y=1").3);
        expect("me@home.org/a.ron@x.y=none", "me@home.org/a.ron", "", "x.y=none", "a@x.y=none");
        expect("a@2x.ron", "a@2x.ron", "", "", "a@2x");
        assert!(Written::read("a.ron@x.y=1,2").unwrap_err().contains("`2` is not of the form"));
        assert!(Written::read("a.ron@x.y=1,").unwrap_err().contains("is not of the form"));
    }

    #[test]
    fn a_file_that_is_there_is_meant_whatever_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a@b.c=d.ron");
        std::fs::write(&file, "()").unwrap();
        let text = file.to_str().unwrap();
        assert_eq!(Written::read(text).unwrap().file, text);
    }
}
