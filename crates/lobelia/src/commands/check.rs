use super::LoadArguments;
use crate::failure::Failure;
use lobelia::{
    Session,
    frame::SceneWorld,
    graph::{GraphFile, PlanOptions, Wired},
};
use std::{io::Write, path::PathBuf};

/// Check graph files: the base and every variant of each. With a scene, plan them for it too. Needs no device.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:\n  lobelia check graphs/*.ron\n  lobelia check graphs/indirect.ron --scene builtin:spheres")]
pub struct Arguments {
    /// Graph files.
    #[arg(required = true, value_name = "GRAPH")]
    graphs: Vec<PathBuf>,
    /// Plan each for this scene as well.
    #[arg(long, value_name = "SCENE")]
    scene: Option<String>,
    #[command(flatten)]
    load: LoadArguments,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let registry = lobelia::registry();
    let traits = match &arguments.scene {
        Some(address) => Some(Session::load(address, &arguments.load.options())?.traits()),
        None => None,
    };
    let mut out = std::io::stdout().lock();
    let mut failed: Option<Failure> = None;
    for path in &arguments.graphs {
        let mut plan = |wired: &Wired<SceneWorld>| match &traits {
            Some(traits) => wired.plan(traits, &PlanOptions::new([960, 540])).map(|_| ()),
            None => Ok(()),
        };
        let checked = GraphFile::load(path).and_then(|graph| graph.check(&registry, &mut plan));
        match checked {
            Ok(variants) => writeln!(out, "{}: good ({variants} variants)", path.display())?,
            Err(problems) => {
                // All files are checked; each faulty one is reported.
                if let Some(earlier) = failed.replace(problems.into()) {
                    earlier.report();
                }
            }
        }
    }
    failed.map_or(Ok(()), Err)
}
