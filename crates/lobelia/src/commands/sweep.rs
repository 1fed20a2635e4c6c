use super::{
    LoadArguments,
    compare::{Known, ShotArguments, TruthArguments, compared_light, make_folder, reference, trial_bar, write_text},
    compare_report::{floor, metrics},
};
use crate::failure::Failure;
use comfy_table::{CellAlignment, Table, presets};
use indicatif::ProgressBar;
use lobelia::{
    Session,
    graph::GraphFile,
    light::{self, Claim},
    measure::sampled::Interval,
    reference::LightPaths,
    report::{self, Choice, Configuration, Light, SweepRow, cheapest_under_error, most_accurate_under_time, plotted_error, sweep_page},
    scene::Scene,
    sweep::{Cell, Row, Shard, Store, Sweep, SweepError, merge},
    trial::{self, Technique},
};
use std::{
    collections::BTreeMap,
    io::Write,
    path::{Path, PathBuf},
};

/// Run every combination of scenes, variants, parameters and seeds, and plot error against time.
///
/// DIR gets rows.jsonl, one line a run, and report.html. A sweep that was killed goes on where it was: no run is lost, none is repeated. A run that fails is recorded
/// as failed and the rest goes on. --shard runs a part, so that many machines can share a sweep; --merge joins their folders.
#[derive(clap::Args, Clone, Debug)]
#[command(
    about = "Run every combination of scenes, variants, parameters and seeds, and plot error against time",
    after_help = "\
Examples:
  lobelia sweep sweeps/lights.ron --report out
  lobelia sweep sweeps/lights.ron --report out --target-error 0.01
  lobelia sweep sweeps/lights.ron --report out/3 --shard 3/8
  lobelia sweep --merge out/1 out/2 out/3 --report out/all

A sweep file:
  (
      graph: \"graphs/indirect.ron\",
      scenes: [\"builtin:cornell-glossy\", \"builtin:ring-caustic\"],
      variants: [\"vpl\", \"interleaved\"],
      parameters: {\"lights.count\": [256, 1024, 4096]},
      seeds: [0, 1],
  )
See docs/sweeps.md for all of its fields, and for Slurm and Kubernetes."
)]
pub struct Arguments {
    /// Sweep file (RON).
    #[arg(value_name = "SWEEP.ron", required_unless_present = "merge", conflicts_with = "merge")]
    sweep: Option<PathBuf>,
    /// Join the rows of these folders instead of running anything.
    #[arg(long, value_name = "DIR", num_args = 1..)]
    merge: Vec<PathBuf>,
    /// Run only every N-th combination, beginning with the I-th.
    #[arg(long, value_name = "I/N", conflicts_with = "merge")]
    shard: Option<Shard>,
    /// Folder for the rows and the report; made if it does not exist.
    #[arg(long, value_name = "DIR")]
    report: PathBuf,
    /// Metric on the vertical axis.
    #[arg(long, value_name = "METRIC", default_value = "relative_mse")]
    metric: String,
    /// Name the cheapest setting whose error is at most this.
    #[arg(long, value_name = "E")]
    target_error: Option<f64>,
    /// Name the most accurate setting that takes at most this many milliseconds.
    #[arg(long, value_name = "MS")]
    target_ms: Option<f64>,
    /// Use the device whose name contains this.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Use only what every WebGPU device has.
    #[arg(long)]
    baseline: bool,
    #[command(flatten)]
    load: LoadArguments,
    /// Print nothing but errors.
    #[arg(short, long)]
    quiet: bool,
}

impl From<SweepError> for Failure {
    fn from(error: SweepError) -> Self {
        match error {
            SweepError::File { .. } | SweepError::Write(_) => Failure::Run(error.to_string()),
            error => Failure::Input(error.to_string()),
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    make_folder(&arguments.report)?;
    if !arguments.merge.is_empty() {
        let merged = merge(&arguments.merge)?;
        let lines: String = merged.lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect();
        write_text(&arguments.report.join("rows.jsonl"), &lines)?;
        let sweep = serde_json::to_string_pretty(&merged.sweep).map_err(|error| Failure::Run(error.to_string()))?;
        write_text(&arguments.report.join("sweep.json"), &sweep)?;
        let missing = merged.missing.len();
        if let (Some(first), false) = (merged.missing.first(), arguments.quiet) {
            eprintln!(
                "warning: {missing} of {} runs are in none of the folders, the first: {}",
                missing + merged.rows.len(),
                first.label()
            );
        }
        return conclude(arguments, &merged.rows);
    }
    // clap asks for one of the two.
    let Some(file) = &arguments.sweep else { return Ok(()) };
    let sweep = Sweep::load(file)?;
    let mut store = Store::open(&arguments.report, &sweep)?;
    let cells = sweep.share(arguments.shard);
    let left: Vec<&Cell> = cells.iter().filter(|cell| !store.has(cell)).collect();
    if left.len() < cells.len() && !arguments.quiet {
        eprintln!("{} of {} runs are done; going on", cells.len() - left.len(), cells.len());
    }
    let bar = trial_bar(arguments.quiet);
    bar.set_length(cells.len() as u64);
    bar.set_position((cells.len() - left.len()) as u64);
    let mut references = References::default();
    for cell in left {
        bar.set_message(cell.label());
        let row = run_cell(arguments, &sweep, cell, &mut references, &bar);
        store.add(row)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    conclude(arguments, store.rows())
}

/// The reference of one scene. Scenes come one after another, so one is kept.
#[derive(Default)]
struct References(Option<SceneTruth>);

/// The truth of a scene, and what was said of the light of its techniques.
struct SceneTruth {
    scene: String,
    known: Known,
    floor: BTreeMap<String, f64>,
    paths: LightPaths,
    lights: Vec<(String, Claim, Light)>,
}

impl References {
    /// The truth of the scene of a run: its light is what all settings of the sweep cast together, whichever share they are in.
    fn of(&mut self, sweep: &Sweep, address: &str, scene: &Scene, shot: &ShotArguments) -> Result<&mut SceneTruth, Failure> {
        let kept = self.0.take().filter(|truth| truth.scene == address);
        let truth = match kept {
            Some(truth) => truth,
            None => {
                let graph = GraphFile::load(Path::new(&sweep.graph))?;
                let mut options = shot.shot().plan_options();
                options.keep.extend(sweep.output.clone());
                // A setting that cannot be planned fails in its own row.
                let claim = |cell: &Cell| {
                    let wired = graph.wire(&lobelia::registry(), &cell.variants(), &cell.overrides()).ok()?;
                    let plan = wired.plan(&scene.traits(), &options).ok()?;
                    Some(Claim::of_output(&plan, sweep.output.as_deref()))
                };
                let claims: Vec<Claim> = sweep.settings().iter().filter_map(claim).collect();
                let truth = TruthArguments::for_sweep(sweep);
                let paths = light::truth_paths(truth.asked(), &claims);
                let known = reference(scene, &truth, &paths, shot, true)?;
                SceneTruth { scene: address.to_owned(), floor: floor(&known)?, known, paths, lights: Vec::new() }
            }
        };
        Ok(self.0.insert(truth))
    }
}

impl SceneTruth {
    fn light(&mut self, scene: &Scene, name: &str, claim: Claim, shot: &ShotArguments) -> Result<Light, Failure> {
        if let Some((_, _, light)) = self.lights.iter().find(|(other, known, _)| other == name && *known == claim) {
            return Ok(light.clone());
        }
        let light = compared_light(scene, Some(&self.paths), &[(name, &claim)], shot)?;
        self.lights.push((name.to_owned(), claim, light.clone()));
        Ok(light)
    }
}

/// The light of several runs of one scene, taken together.
fn joined(lights: &[&Light]) -> Light {
    let mut all = Light::default();
    for light in lights {
        all.held = all.held.or_else(|| light.held.clone());
        let new = |one: &&report::TechniqueLight| !all.techniques.contains(one);
        let techniques: Vec<_> = light.techniques.iter().filter(new).cloned().collect();
        all.techniques.extend(techniques);
        for (from, to) in [(&light.missing, &mut all.missing), (&light.extra, &mut all.extra)] {
            for one in from {
                if !to.iter().any(|other| other.technique == one.technique && other.what == one.what) {
                    to.push(one.clone());
                }
            }
        }
    }
    // Only what all of them leave out is left out.
    if let Some((first, rest)) = lights.split_first() {
        let by_all = |part: &&report::LeftOut| rest.iter().all(|light| light.left_out.iter().any(|other| other.what == part.what));
        all.left_out = first.left_out.iter().filter(by_all).cloned().collect();
    }
    all
}

/// A run; whatever goes wrong in it is its row.
fn run_cell(arguments: &Arguments, sweep: &Sweep, cell: &Cell, references: &mut References, bar: &ProgressBar) -> Row {
    let mut row = Row::new(cell);
    if let Err(failure) = fill(arguments, sweep, cell, references, &mut row) {
        let message = failure.message();
        bar.suspend(|| eprintln!("failed: {}: {message}", cell.label()));
        row.failed = Some(message);
    }
    row
}

fn fill(arguments: &Arguments, sweep: &Sweep, cell: &Cell, references: &mut References, row: &mut Row) -> Result<(), Failure> {
    let wired = GraphFile::load(Path::new(&sweep.graph))?.wire(&lobelia::registry(), &cell.variants(), &cell.overrides())?;
    let scene = Session::load(&cell.scene, &arguments.load.options())?;
    let shot_arguments = ShotArguments {
        output: sweep.output.clone(),
        camera: sweep.camera.clone(),
        size: [sweep.size.0, sweep.size.1],
        samples: sweep.samples,
        seed: cell.seed,
        rounds: sweep.rounds,
        adapter: arguments.adapter.clone(),
        baseline: arguments.baseline,
    };
    let shot = shot_arguments.shot();
    // What is wrong with the graph on this scene is found before the reference is traced.
    let mut options = shot.plan_options();
    options.keep.extend(sweep.output.clone());
    let claim = Claim::of_output(&wired.plan(&scene.traits(), &options)?, sweep.output.as_deref());
    let truth = references.of(sweep, &cell.scene, &scene, &shot_arguments)?;
    row.light = Some(truth.light(&scene, variant_name(&cell.variant), claim, &shot_arguments)?);
    let technique = Technique { name: cell.variant.clone(), wired };
    let measured = trial::run(&scene, &[technique], &shot, &shot_arguments.trial(), &mut |_| true)?;
    let [one] = measured.as_slice() else { return Ok(()) };
    row.device = one.device.clone();
    row.ms = one.frame_ms.as_ref().map(|time| time.summary.median);
    row.round_ms = one.frame_ms.iter().flat_map(|time| time.logarithm.replicates.iter().map(|logarithm| logarithm.exp())).collect();
    row.mebibytes = Some(one.bytes as f64 / (1u64 << 20) as f64);
    row.passes = one.passes.iter().map(|pass| (pass.name.clone(), pass.gpu_ms.as_ref().map(|time| time.summary.median))).collect();
    row.floor = truth.floor.clone();
    row.replication = Some(one.pictures.replication.clone());
    for (name, found) in metrics(&truth.known, &measured)?.into_iter().flatten() {
        row.metrics.insert(name.clone(), found.value);
        if !found.replicates.is_empty() && found.replicates.iter().all(|value| value.is_finite()) {
            row.replicates.insert(name, found.replicates);
        }
    }
    Ok(())
}

/// Variants for people.
fn variant_name(variant: &str) -> &str {
    if variant.is_empty() { "the graph as it is" } else { variant }
}

/// A parameter as the sweep file has it: a number or a bool where it is one.
fn typed(text: &str) -> serde_json::Value {
    serde_json::from_str(text)
        .ok()
        .filter(|value: &serde_json::Value| value.is_number() || value.is_boolean())
        .unwrap_or_else(|| text.into())
}

/// A row as the page has it, its error that of the metric.
fn shown(row: &Row, metric: &str) -> SweepRow {
    let plotted = |value: f64| plotted_error(metric, value);
    SweepRow {
        scene: row.scene.clone(),
        variant: variant_name(&row.variant).to_owned(),
        parameters: row.parameters.iter().map(|(name, value)| (name.clone(), typed(value))).collect(),
        seed: row.seed.into(),
        ms: row.ms.unwrap_or(f64::NAN),
        round_ms: row.round_ms.clone(),
        error: row.sampled(metric).map(|found| found.map(plotted)),
        floor: row.floor.get(metric).copied().map(plotted).filter(|floor| floor.is_finite()),
        failed: row.failed.clone(),
    }
}

/// The page, and what it answers.
fn conclude(arguments: &Arguments, rows: &[Row]) -> Result<(), Failure> {
    if let Some(known) = rows.iter().find(|row| row.failed.is_none())
        && !known.metrics.contains_key(&arguments.metric)
    {
        let names: Vec<&str> = known.metrics.keys().map(String::as_str).collect();
        return Err(Failure::Input(format!("--metric {}: the rows have {}", arguments.metric, names.join(", "))));
    }
    let devices: std::collections::BTreeSet<&str> = rows.iter().map(|row| row.device.as_str()).filter(|name| !name.is_empty()).collect();
    let mut light: Vec<(String, Light)> = Vec::new();
    for row in rows {
        if !light.iter().any(|(scene, _)| *scene == row.scene) {
            let of_scene: Vec<&Light> = rows.iter().filter(|other| other.scene == row.scene).filter_map(|row| row.light.as_ref()).collect();
            if !of_scene.is_empty() {
                light.push((row.scene.clone(), joined(&of_scene)));
            }
        }
    }
    let sweep = report::Sweep {
        version: report::VERSION,
        title: format!("{} runs", rows.len()),
        devices: devices.into_iter().map(str::to_owned).collect(),
        rows: rows.iter().map(|row| shown(row, &arguments.metric)).collect(),
        light,
        metric: arguments.metric.clone(),
        target_error: arguments.target_error,
        target_ms: arguments.target_ms,
    };
    write_text(&arguments.report.join("report.html"), &sweep_page(&sweep))?;
    write_text(
        &arguments.report.join("report.json"),
        &serde_json::to_string_pretty(&sweep).map_err(|error| Failure::Run(error.to_string()))?,
    )?;
    if arguments.quiet {
        return Ok(());
    }
    let overall = report::overall(&sweep.rows);
    let mut out = std::io::stdout().lock();
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["setting on the front", "ms", arguments.metric.as_str()]);
    for column in 1..3 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let name = |index: usize| {
        let one = &overall[index];
        let parameters = one
            .parameters
            .iter()
            .map(|(name, value)| format!(" {name}={}", value.as_str().map_or_else(|| value.to_string(), str::to_owned)));
        std::iter::once(one.variant.clone()).chain(parameters).collect::<String>()
    };
    for index in report::pareto_front(&overall) {
        table.add_row([name(index), ms(&overall[index]), error(&overall[index])]);
    }
    writeln!(out, "{table}")?;
    if overall.iter().any(|one| one.ms_interval().is_some() || one.error_interval().is_some()) {
        writeln!(out, "± is half of the 95 % interval")?;
    }
    let answer = |choice: Choice| match choice {
        Choice::Found { index, ties } => {
            let ties: Vec<String> = ties.into_iter().map(name).collect();
            let ties = if ties.is_empty() { String::new() } else { format!("; no difference is shown to {}", ties.join(", ")) };
            format!("{}, {} ms, {}{ties}", name(index), ms(&overall[index]), error(&overall[index]))
        }
        Choice::Perhaps(index) => format!("none is shown to; {} may", name(index)),
        Choice::Nothing => "none".to_owned(),
    };
    if let Some(target) = arguments.target_error {
        writeln!(out, "cheapest with {} at most {target}: {}", arguments.metric, answer(cheapest_under_error(&overall, target)))?;
    }
    if let Some(target) = arguments.target_ms {
        writeln!(out, "most accurate within {target} ms: {}", answer(most_accurate_under_time(&overall, target)))?;
    }
    for (scene, light) in &sweep.light {
        for sentence in light.sentences() {
            writeln!(out, "{scene}: {sentence}")?;
        }
    }
    let failed = rows.iter().filter(|row| row.failed.is_some()).count();
    if failed > 0 {
        writeln!(out, "{failed} of {} runs failed; report.html says why", rows.len())?;
    }
    writeln!(out, "wrote {}", arguments.report.join("report.html").display())?;
    Ok(())
}

/// Half the width of an interval, in words.
fn reach(interval: Option<Interval>, show: impl Fn(f64) -> String) -> String {
    interval.map_or_else(String::new, |interval| format!(" ±{}", show(0.5 * (interval.high - interval.low))))
}

fn ms(one: &Configuration) -> String {
    format!("{:.2}{}", one.ms, reach(one.ms_interval(), |half| format!("{half:.2}")))
}

fn error(one: &Configuration) -> String {
    format!("{:.3e}{}", one.error.value, reach(one.error_interval(), |half| format!("{half:.0e}")))
}
