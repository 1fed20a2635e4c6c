//! One module per command.

pub mod adapters;
pub mod check;
pub mod compare;
mod compare_report;
pub mod explain;
pub mod layer_files;
pub mod numbered;
pub mod passes;
pub mod reference;
pub mod render;
pub mod scene_info;
pub mod sequence;
pub mod sweep;
pub mod variants;

use crate::failure::Failure;
use clap::Args;
use lobelia::{
    SessionOptions,
    frame::SceneWorld,
    graph::{GraphFile, Override, Wired},
    scene::{LoadOptions, Ndf},
};
use std::path::{Path, PathBuf};

/// A graph with its variants and overrides.
#[derive(Args, Clone, Debug)]
pub struct GraphArguments {
    /// Graph file (RON).
    #[arg(value_name = "GRAPH")]
    pub graph: PathBuf,
    /// Apply a variant of the graph; several are applied in order.
    #[arg(long = "variant", value_name = "NAME", value_delimiter = '+')]
    pub variants: Vec<String>,
    /// Override a parameter: PASS.PARAM=VALUE, such as lights.count=4096 or indirect.clamp=none.
    #[arg(long = "set", value_name = "PASS.PARAM=VALUE")]
    pub overrides: Vec<Override>,
}

impl GraphArguments {
    /// Reads, wires and checks the graph.
    pub fn wire(&self) -> Result<Wired<SceneWorld>, Failure> {
        Ok(GraphFile::load(&self.graph)?.wire(&lobelia::registry(), &self.variants, &self.overrides)?)
    }
}

/// How a scene is loaded.
#[derive(Args, Clone, Copy, Debug)]
pub struct LoadArguments {
    /// Go on with a warning where a glTF scene requires an extension that is not read or samples an image that cannot be: the picture may be wrong.
    #[arg(long)]
    pub allow_unsupported: bool,
}

impl LoadArguments {
    /// Session options with nothing else.
    pub fn options(self) -> SessionOptions {
        SessionOptions { load: LoadOptions { allow_unsupported: self.allow_unsupported }, ..SessionOptions::default() }
    }
}

/// A scene and the moment at which it is seen.
#[derive(Args, Clone, Debug)]
pub struct SceneArguments {
    /// Scene: a .glb, .gltf or RON scene file, or builtin:NAME (cornell-glossy, cornell-diffuse, ring-caustic, area-lights, spheres).
    #[arg(long, value_name = "SCENE", default_value = "builtin:cornell-glossy")]
    pub scene: String,
    /// Normal distribution function of specular lobes, instead of the scene's own (ggx if it names none).
    #[arg(long, value_name = "ggx|phong")]
    pub ndf: Option<Ndf>,
    /// Time of animations in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub time: f32,
    #[command(flatten)]
    pub load: LoadArguments,
}

impl SceneArguments {
    /// Session options without a device choice.
    pub fn options(&self) -> SessionOptions {
        SessionOptions { ndf: self.ndf, time: self.time, ..self.load.options() }
    }
}

/// `WxH` in pixels.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some([width.trim().parse().ok()?, height.trim().parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| (1..=lobelia::MAX_SIDE).contains(side)) => Ok(sides),
        Some(_) => Err(format!("each side must lie in [1, {}] pixels", lobelia::MAX_SIDE)),
        None => Err(format!("`{text}` is not of the form WIDTHxHEIGHT, such as 960x540")),
    }
}

/// `PASS.PORT=FILE`.
pub fn parse_save(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((port, file)) if !port.is_empty() && !file.is_empty() => Ok((port.to_owned(), Path::new(file).to_owned())),
        _ => {
            Err(format!("`{text}` is not of the form PASS.PORT=FILE, such as indirect.radiance=indirect.exr or gbuffer.normal=normal.exr"))
        }
    }
}

/// Prints a completion script.
pub fn completions<C: clap::CommandFactory>(shell: clap_complete::Shell) -> Result<(), Failure> {
    use std::io::Write;
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut C::command(), "lobelia", &mut script);
    Ok(std::io::stdout().write_all(&script)?)
}
