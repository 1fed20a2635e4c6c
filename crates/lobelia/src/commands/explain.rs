use super::{GraphArguments, SceneArguments, parse_size};
use crate::failure::Failure;
use lobelia::{Session, explain, graph::PlanOptions};
use std::io::Write;

/// Show what a scene requires of a graph: order, kept, dropped and why, specialisations, memory. Needs no device.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  lobelia explain graphs/indirect.ron --scene builtin:cornell-diffuse
  lobelia explain graphs/indirect.ron --scene room.glb --dot | dot -Tsvg > graph.svg")]
pub struct Arguments {
    #[command(flatten)]
    graph: GraphArguments,
    #[command(flatten)]
    scene: SceneArguments,
    /// Size of the picture in pixels, each side at most 8192.
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "960x540")]
    size: [u32; 2],
    /// Keep a further resource, as `render --save` does.
    #[arg(long, value_name = "PASS.PORT")]
    keep: Vec<String>,
    /// Print Graphviz instead of text.
    #[arg(long)]
    dot: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let wired = arguments.graph.wire()?;
    let scene = Session::load(&arguments.scene.scene, &arguments.scene.options())?;
    let options = PlanOptions { keep: arguments.keep.clone(), ..PlanOptions::new(arguments.size) };
    let plan = wired.plan(&scene.traits(), &options)?;
    let mut out = std::io::stdout().lock();
    if arguments.dot {
        return Ok(out.write_all(explain::dot(&plan).as_bytes())?);
    }
    // The yardstick may not exist: a scene can be fit for the graph only because something was left out.
    let general = wired.plan(&scene.traits(), &PlanOptions { specialise: false, ..options }).ok();
    writeln!(out, "{} on {}", arguments.graph.graph.display(), scene.name)?;
    Ok(out.write_all(explain::text(&plan, general.as_ref()).as_bytes())?)
}
