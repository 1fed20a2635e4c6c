use super::{GraphArguments, SceneArguments, layer_files, numbered, parse_save, parse_size, sequence::parse_fps};
use crate::{
    failure::Failure,
    files::{self, Kind},
    progress,
};
use comfy_table::{CellAlignment, Table, presets};
use indicatif::ProgressBar;
use lobelia::{
    Rendering, Session, Shot, Step,
    explain::mebibytes,
    frame::{DisplayImage, Radiance, SceneWorld},
    graph::{FrameReport, Plan, Resource, RunOptions, Timing},
    layers::{LayerSet, Target},
    measure::timing::Summary,
};
use std::{
    io::Write,
    path::{Path, PathBuf},
};

/// Render a scene through a graph.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  lobelia render graphs/indirect.ron --scene builtin:cornell-glossy -o out.png
  lobelia render graphs/indirect.ron --scene room.glb --camera sofa --size 1280x720 --samples 16 -o out.exr
  lobelia render graphs/indirect.ron --variant no-visibility --set lights.count=4096 --save indirect.radiance=indirect.exr -o out.png
  lobelia render graphs/direct.ron --scene box.glb --frames 50 --profile trace.json -o out.png
  lobelia render graphs/direct.ron --scene walk.glb --frames 48 --fps 24 -o 'frame.####.png'
  lobelia render graphs/indirect.ron --aovs all.exr --save gbuffer.normal=normal.exr -o out.png
  lobelia render graphs/progressive.ron --scene builtin:cornell-glossy --frames 256 --progressive -o out.png")]
pub struct Arguments {
    #[command(flatten)]
    pub graph: GraphArguments,
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Picture to write: .png (the graph's output as it is displayed) or .exr (linear RGB before tone mapping). With #### or %04d in the name, every frame
    /// is written, numbered from 0.
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["saves", "aovs"])]
    output: Option<PathBuf>,
    /// Size of the picture in pixels, each side at most 8192.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "960x540")]
    size: [u32; 2],
    /// Camera of the scene; its first if none is named.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Average this many sub-pixel-jittered frames in linear radiance.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Run this many frames; animated scenes move on from one to the next. The last is written, and every one to names with #### or %04d.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Frames per second of an animated scene; 24 if it is not given.
    #[arg(long, value_name = "F", value_parser = parse_fps)]
    fps: Option<f32>,
    /// Let frames be samples of one picture: each has random numbers and sub-pixel offsets of its own, and animations stand still. For graphs with a
    /// `progressive` pass, which shows the mean of all frames.
    #[arg(long)]
    progressive: bool,
    /// Seed of everything random; equal seeds give equal pictures.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub seed: u32,
    /// Write any resource of the graph: .exr (radiance), .png (display image or radiance), .npz (anything), or a decoded layer of a G-buffer
    /// (gbuffer.normal, geometric_normal, base_color, roughness, metallic, specular, emissive, depth, position) as .exr, .npz or, where it makes sense, .png.
    /// Radiances are averaged over the samples; everything else, layers included, is that of the last sample.
    #[arg(long = "save", value_name = "PASS.PORT=FILE", value_parser = parse_save)]
    saves: Vec<(String, PathBuf)>,
    /// Write one EXR file of many layers: the picture, each radiance that it sums (direct.R, ...), and all layers of the G-buffer (normal.X, depth.Z, ...),
    /// with graph, scene, camera and more in its header. The picture and its terms are averaged over the samples; the rest is of the last sample.
    #[arg(long, value_name = "FILE.exr")]
    aovs: Option<PathBuf>,
    /// Write a trace of CPU and device work that Perfetto and chrome://tracing open.
    #[arg(long, value_name = "FILE")]
    profile: Option<PathBuf>,
    /// Use the device whose name contains this.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Use only what every WebGPU device has: no optional features, default limits.
    #[arg(long)]
    baseline: bool,
    /// Do not specialise shaders and resources to the scene: the yardstick for what specialising saves.
    #[arg(long)]
    no_specialise: bool,
    /// Poison resources and count non-finite and negative values after every pass; the first offender is named. Half floats at their largest, where brighter
    /// light is cut off, are counted with a warning. Slow.
    #[arg(long)]
    check: bool,
    /// Print nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
    /// Print what was done as JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let wired = arguments.graph.wire()?;
    check_goals(arguments)?;
    let scene = Session::load(&arguments.scene.scene, &arguments.scene.options())?;
    if !arguments.quiet {
        for warning in &scene.warnings {
            eprintln!("warning: {warning}");
        }
    }
    let mut shot = Shot {
        extent: arguments.size,
        camera: arguments.camera.clone(),
        samples: arguments.samples,
        frames: arguments.frames,
        progressive: arguments.progressive,
        seed: arguments.seed,
        frame_seconds: 1.0 / arguments.fps.unwrap_or(24.0),
        specialise: !arguments.no_specialise,
        ..Shot::default()
    };
    // Everything that can be wrong with the input is found before the device is started.
    scene.camera(shot.camera.as_deref()).map_err(lobelia::SessionError::from)?;
    let traits = scene.traits();
    let targets = arguments.saves.iter().map(|(port, _)| Target::resolve(&wired, &traits, &shot.plan_options(), port));
    let targets = targets.collect::<Result<Vec<_>, _>>()?;
    shot.keep = targets.iter().map(|target| target.port.clone()).collect();
    let plan = wired.plan(&traits, &shot.plan_options())?;
    check_kinds(arguments, &targets, &plan)?;
    let set = if arguments.aovs.is_some() { Some(layer_files::set(arguments, &plan)?) } else { None };
    shot.keep.extend(set.iter().flat_map(LayerSet::keep));
    warn_uncast(arguments, &plan, &scene.traits());
    if !arguments.quiet {
        for warning in plan.warnings() {
            eprintln!("warning: {warning}");
        }
    }
    drop(plan);

    let gpu = lobelia::graph::Gpu::new(&lobelia::graph::GpuOptions { adapter: arguments.adapter.clone(), baseline: arguments.baseline })?;
    // Software devices run work when they please and stamp it when they notice; the wall clock is right there.
    let software = gpu.info().is_some_and(|info| info.device_type == wgpu::DeviceType::Cpu);
    let timing = match (arguments.quiet && !arguments.json && arguments.profile.is_none(), gpu.has_timestamps() && !software) {
        (true, _) => Timing::Off,
        (false, true) => Timing::Timestamps,
        (false, false) => Timing::Isolated,
    };
    shot.run = RunOptions { check: arguments.check, timing };
    let mut session = Session::with(gpu, scene, arguments.scene.time)?;
    let mut rendering = session.start(&wired, &shot)?;
    let bar = progress_bar(arguments, &shot);
    let mut step = |step: &Step| show_step(&bar, &shot, step);
    let results = Results { arguments, targets: &targets, set: set.as_ref() };
    let picture = if results.numbered() {
        let mut last = None;
        rendering.run_each::<Failure>(&mut step, &mut |rendering, frame, picture| {
            results.write(rendering, frame, &picture)?;
            last = Some(picture);
            Ok(())
        })?;
        last.ok_or_else(|| Failure::Run("there is no frame".into()))?
    } else {
        let picture = rendering.run(&mut step)?;
        results.write(&rendering, shot.frames - 1, &picture)?;
        picture
    };
    bar.finish_and_clear();
    if shot.samples > 1 && !arguments.quiet && (set.is_some() || targets.iter().any(|target| target.layer.is_some())) {
        eprintln!("note: radiance is the mean of {} samples; layers of the G-buffer are of the last sample", shot.samples);
    }
    hint_at_exposure(arguments, rendering.plan(), &picture);
    if let Some(path) = &arguments.profile {
        write_profile(path, rendering.reports())?;
    }
    warn_saturated(arguments, &rendering);
    report(arguments, &rendering, timing)
}

/// What is to be written.
struct Results<'a> {
    arguments: &'a Arguments,
    /// Of the saves, in order.
    targets: &'a [Target],
    set: Option<&'a LayerSet>,
}

impl Results<'_> {
    /// Whether a file is written for every frame.
    fn numbered(&self) -> bool {
        !self.arguments.progressive && self.arguments.goals().any(|path| matches!(numbered::Numbered::of(path), Ok(Some(_))))
    }

    /// Writes what belongs to a frame.
    fn write(&self, rendering: &Rendering<'_>, frame: u32, picture: &lobelia::Picture) -> Result<(), Failure> {
        let arguments = self.arguments;
        let file = |path: &Path| arguments.file_of(path, frame);
        if let Some(path) = arguments.output.as_deref().and_then(file) {
            match (files::kind_of(&path, &[Kind::Png, Kind::Exr])?, &picture.display) {
                (Kind::Exr, _) => files::write_exr(&path, &picture.image())?,
                (_, Some(rgba)) => files::write_png(&path, picture.extent, rgba)?,
                (_, None) => files::write_linear_png(&path, &picture.image())?,
            }
        }
        for (target, (_, path)) in self.targets.iter().zip(&arguments.saves) {
            match (file(path), target.layer) {
                (Some(path), Some(layer)) => layer_files::write(arguments, rendering, (&target.port, layer), frame, &path)?,
                (Some(path), None) => save(rendering, &target.port, &path)?,
                (None, _) => {}
            }
        }
        if let (Some(path), Some(set)) = (arguments.aovs.as_deref().and_then(file), self.set) {
            layer_files::write_all(arguments, rendering, set, frame, &path)?;
        }
        Ok(())
    }
}

impl Arguments {
    /// Files that are made of frames.
    fn goals(&self) -> impl Iterator<Item = &PathBuf> {
        self.output.iter().chain(self.saves.iter().map(|(_, path)| path)).chain(&self.aovs)
    }

    /// The file that a frame is written to, if it is. Samples of one picture have no numbers.
    fn file_of(&self, path: &Path, frame: u32) -> Option<PathBuf> {
        let last = frame + 1 == self.frames;
        if self.progressive { last.then(|| path.to_owned()) } else { numbered::file_of(path, frame, last) }
    }
}

/// Half floats at 65504 in any frame: resource, values in the frame with the most, and the radiance that this stands for.
fn saturated(rendering: &Rendering<'_>) -> Vec<(String, u64, f64)> {
    let most = 65504.0 / f64::from(rendering.pre_exposure());
    let mut found: Vec<(String, u64, f64)> = Vec::new();
    for finding in rendering.reports().iter().flat_map(|report| &report.saturated) {
        match found.iter_mut().find(|(resource, ..)| *resource == finding.resource) {
            Some((_, count, _)) => *count = (*count).max(finding.saturated),
            None => found.push((finding.resource.clone(), finding.saturated, most)),
        }
    }
    found
}

fn warn_saturated(arguments: &Arguments, rendering: &Rendering<'_>) {
    if arguments.quiet {
        return;
    }
    for (resource, count, most) in saturated(rendering) {
        eprintln!(
            "warning: {count} value(s) of `{resource}` stand at {most:.4e}, the most that it can hold here: brighter light is cut off"
        );
    }
}

/// Refuses what could not be written, before any work.
fn check_goals(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(path) = &arguments.output {
        files::kind_of(path, &[Kind::Png, Kind::Exr])?;
    }
    if let Some(path) = &arguments.aovs {
        files::kind_of(path, &[Kind::Exr])?;
    }
    let mut goals: Vec<PathBuf> = Vec::new();
    for path in arguments.goals() {
        numbered::Numbered::of(path).map_err(Failure::Input)?;
        let mut own: Vec<PathBuf> = [0, arguments.frames - 1].into_iter().filter_map(|frame| arguments.file_of(path, frame)).collect();
        own.dedup();
        goals.extend(own);
    }
    goals.extend(arguments.profile.clone());
    for (index, file) in goals.iter().enumerate() {
        files::check_goal(file)?;
        if goals[..index].contains(file) {
            return Err(Failure::Input(format!("{}: two results cannot be written to one file", file.display())));
        }
    }
    Ok(())
}

fn allowed_kinds(type_name: &str) -> &'static [Kind] {
    match type_name {
        name if name == Radiance::NAME => &[Kind::Exr, Kind::Png, Kind::Npz],
        name if name == DisplayImage::NAME => &[Kind::Png, Kind::Npz],
        _ => &[Kind::Npz],
    }
}

fn type_of<'a>(plan: &'a Plan<SceneWorld>, port: &str) -> &'a str {
    plan.find(port).map_or("", |index| plan.resources[index].type_name)
}

fn check_kinds(arguments: &Arguments, targets: &[Target], plan: &Plan<SceneWorld>) -> Result<(), Failure> {
    for (target, (_, path)) in targets.iter().zip(&arguments.saves) {
        files::kind_of(path, target.layer.map_or_else(|| allowed_kinds(type_of(plan, &target.port)), layer_files::kinds))?;
    }
    let output = &plan.resources[plan.output];
    if let Some(path) = &arguments.output
        && allowed_kinds(output.type_name) == [Kind::Npz]
    {
        return Err(Failure::Input(format!(
            "{}: the graph's output `{}` is {}, not a picture; write it with --save {}=FILE.npz",
            path.display(),
            output.name,
            output.type_name,
            output.name
        )));
    }
    Ok(())
}

/// Lights that no pass of the graph casts: a picture would be dark, or darker than its scene, without a word.
fn warn_uncast(arguments: &Arguments, plan: &Plan<SceneWorld>, traits: &lobelia::scene::SceneTraits) {
    if arguments.quiet {
        return;
    }
    for sentence in lobelia::light::uncast(&lobelia::light::Claim::of_all(plan), traits) {
        eprintln!("warning: {sentence}");
    }
}

/// A picture that is mostly white or black says nothing; the number that would help is known.
fn hint_at_exposure(arguments: &Arguments, plan: &Plan<SceneWorld>, picture: &lobelia::Picture) {
    let Some(display) = picture.display.as_ref().filter(|_| !arguments.quiet && arguments.output.is_some()) else { return };
    let pass = &plan.passes[plan.resources[plan.output].maker];
    let exposure = pass.params_json().get("exposure").and_then(serde_json::Value::as_f64);
    let Some(hint) = lobelia::exposure::hint(display, &picture.image(), exposure.unwrap_or(0.0)) else { return };
    let colour = if hint.white { "white" } else { "black" };
    let set = match exposure {
        Some(_) => format!("--set {}.exposure={}", pass.name, hint.stops),
        None => format!("an exposure of {} stops", hint.stops),
    };
    eprintln!("hint: {:.0} % of the picture is {colour}; {set} would bring it to middle grey", 100.0 * hint.share);
}

fn progress_bar(arguments: &Arguments, shot: &Shot) -> ProgressBar {
    progress::bar(arguments.quiet || arguments.json, u64::from(shot.frames) * u64::from(shot.samples) * 1000)
}

fn show_step(bar: &ProgressBar, shot: &Shot, step: &Step) -> bool {
    let done = u64::from(step.frame) * u64::from(shot.samples) + u64::from(step.sample);
    let within = step.pass.as_ref().map_or(0.0, |(_, done)| *done);
    bar.set_position(done * 1000 + (within * 1000.0) as u64);
    let pass = step.pass.as_ref().map(|(name, done)| format!(", {name} {:.0} %", done * 100.0)).unwrap_or_default();
    bar.set_message(format!("frame {}/{}, sample {}/{}{pass}", step.frame + 1, shot.frames, step.sample + 1, shot.samples));
    true
}

fn save(rendering: &Rendering<'_>, port: &str, path: &Path) -> Result<(), Failure> {
    let type_name = type_of(rendering.plan(), port);
    match files::kind_of(path, allowed_kinds(type_name))? {
        Kind::Npz if type_name == Radiance::NAME => files::write_radiance_npz(path, &rendering.radiance(port)?),
        Kind::Npz => files::write_npz(path, &rendering.runner().read(rendering.gpu(), port)?),
        Kind::Exr => files::write_exr(path, &rendering.radiance(port)?),
        Kind::Png if type_name == Radiance::NAME => files::write_linear_png(path, &rendering.radiance(port)?),
        Kind::Png => {
            let data = rendering.runner().read_image(rendering.gpu(), port)?;
            files::write_png(path, data.extent, &data.bytes)
        }
    }
}

fn write_profile(path: &Path, reports: &[FrameReport]) -> Result<(), Failure> {
    lobelia::graph::timing::write_chrome_trace(path, reports).map_err(|error| Failure::Run(format!("{}: {error}", path.display())))
}

fn median(values: Vec<f64>) -> Option<f64> {
    Summary::of(values).map(|summary| summary.median)
}

/// A row of the table: a pass with medians over frames.
struct Row {
    pass: String,
    kind: &'static str,
    gpu_ms: Option<f64>,
    cpu_ms: Option<f64>,
    bytes: u64,
}

fn rows(rendering: &Rendering<'_>) -> Vec<Row> {
    let plan = rendering.plan();
    // The first frame compiles and warms up; it is left out where there are others.
    let reports = rendering.reports();
    let reports = if reports.len() > 1 { &reports[1..] } else { reports };
    plan.passes
        .iter()
        .map(|pass| {
            let times = || reports.iter().flat_map(|report| &report.passes).filter(|time| time.pass == pass.name);
            Row {
                pass: pass.name.clone(),
                kind: pass.kind_name(),
                gpu_ms: median(times().filter_map(|time| time.gpu_ms).collect()),
                cpu_ms: median(times().map(|time| time.cpu_ms).collect()),
                bytes: pass.outputs.iter().map(|index| plan.resources[*index].bytes()).sum(),
            }
        })
        .collect()
}

fn report(arguments: &Arguments, rendering: &Rendering<'_>, timing: Timing) -> Result<(), Failure> {
    if arguments.quiet && !arguments.json {
        return Ok(());
    }
    let rows = rows(rendering);
    let plan = rendering.plan();
    let adapter = rendering.gpu().info().map_or_else(String::new, |info| info.name.clone());
    let frames = |path: &PathBuf| (0..arguments.frames).filter_map(|frame| arguments.file_of(path, frame)).collect::<Vec<_>>();
    let written = arguments.goals().flat_map(frames).chain(arguments.profile.clone());
    let written: Vec<String> = written.map(|path| path.display().to_string()).collect();
    let how = match timing {
        Timing::Off => "off",
        Timing::Timestamps => "timestamps",
        Timing::Isolated => "wall clock, each pass alone",
    };
    let mut out = std::io::stdout().lock();
    if arguments.json {
        let passes: Vec<_> = rows
            .iter()
            .map(|row| {
                serde_json::json!({
                    "pass": row.pass, "kind": row.kind, "gpu_ms": row.gpu_ms, "cpu_ms": row.cpu_ms, "mebibytes": row.bytes as f64 / (1u64 << 20) as f64,
                })
            })
            .collect();
        let saturated: Vec<_> = saturated(rendering)
            .into_iter()
            .map(|(resource, count, most)| serde_json::json!({"resource": resource, "values": count, "most": most}))
            .collect();
        let dropped: Vec<_> = plan
            .dropped
            .iter()
            .map(|dropped| serde_json::json!({"pass": dropped.pass, "kind": dropped.kind, "reason": dropped.reason}))
            .collect();
        let value = serde_json::json!({
            "graph": arguments.graph.graph, "scene": arguments.scene.scene, "variants": arguments.graph.variants, "device": adapter,
            "size": arguments.size, "samples": arguments.samples, "frames": arguments.frames, "seed": arguments.seed, "timing": how,
            "passes": passes, "saturated": saturated, "dropped": dropped, "mebibytes": plan.bytes() as f64 / (1u64 << 20) as f64, "written": written,
        });
        writeln!(out, "{value:#}")?;
        return Ok(());
    }
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_header(["pass", "kind", "device ms", "CPU ms", "MiB"]);
    for column in 2..5 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let milliseconds = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
    for row in &rows {
        table.add_row([row.pass.clone(), row.kind.to_owned(), milliseconds(row.gpu_ms), milliseconds(row.cpu_ms), mebibytes(row.bytes)]);
    }
    let sum = |values: Vec<Option<f64>>| milliseconds(values.into_iter().flatten().reduce(|left, right| left + right));
    let total = [
        "all".to_owned(),
        String::new(),
        sum(rows.iter().map(|row| row.gpu_ms).collect()),
        sum(rows.iter().map(|row| row.cpu_ms).collect()),
        format!("{} (shared)", mebibytes(plan.bytes())),
    ];
    table.add_row(total);
    writeln!(out, "{table}")?;
    for dropped in &plan.dropped {
        writeln!(out, "left out: {} ({}): {}", dropped.pass, dropped.kind, dropped.reason)?;
    }
    writeln!(out, "device: {adapter}; times: {how}, median of {} frame(s)", rendering.reports().len())?;
    match written.as_slice() {
        [first, .., last] if written.len() > 8 => writeln!(out, "wrote {} files, {first} to {last}", written.len())?,
        _ => writeln!(out, "wrote {}", written.join(", "))?,
    }
    Ok(())
}
