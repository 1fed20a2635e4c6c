use super::LoadArguments;
use crate::failure::Failure;
use lobelia::{Session, SessionOptions, scene::Ndf};
use std::io::Write;

/// Print the facts of a scene that passes ask for, its cameras, lights and warnings.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:\n  lobelia scene-info builtin:spheres\n  lobelia scene-info room.glb --json")]
pub struct Arguments {
    /// Scene: a file, or builtin:NAME.
    scene: String,
    /// Normal distribution function, instead of the scene's own.
    #[arg(long, value_name = "ggx|phong")]
    ndf: Option<Ndf>,
    /// Time of animations in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    time: f32,
    #[command(flatten)]
    load: LoadArguments,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let options = SessionOptions { ndf: arguments.ndf, time: arguments.time, ..arguments.load.options() };
    let scene = Session::load(&arguments.scene, &options)?;
    let traits = scene.traits();
    let casters = lobelia::light::casters(&lobelia::registry(), &traits);
    let mut out = std::io::stdout().lock();
    if arguments.json {
        let lights: Vec<_> = scene
            .lights
            .iter()
            .map(|light| {
                serde_json::json!({
                    "name": light.name,
                    "kind": format!("{:?}", light.kind),
                    "position": light.position.to_array(),
                    "direction": light.direction.to_array(),
                    "intensity": light.intensity.to_array(),
                })
            })
            .collect();
        let cameras: Vec<_> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let cast_by: std::collections::BTreeMap<_, _> = casters.iter().map(|(class, passes)| (class.name(), passes)).collect();
        let value = serde_json::json!({
            "cast_by": cast_by, "name": scene.name, "traits": traits, "lights": lights, "cameras": cameras, "warnings": scene.warnings,
        });
        writeln!(out, "{value:#}")?;
        return Ok(());
    }
    writeln!(out, "{}", scene.name)?;
    for (fact, value) in traits.facts() {
        writeln!(out, "  {fact:<28} {value}")?;
    }
    let cameras = scene.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
    writeln!(out, "  {:<28} {}", "cameras", if cameras.is_empty() { "none; one is placed to see everything" } else { &cameras })?;
    for light in &scene.lights {
        writeln!(out, "  light {:<22} {:?}, intensity {}", light.name, light.kind, light.intensity)?;
    }
    for light in &scene.area_lights {
        writeln!(out, "  area light {:<17} {:?}, radiance {}", light.name, light.shape, light.radiance)?;
    }
    for (class, passes) in &casters {
        let lights = lobelia::light::counted(*class, traits.lights_of(*class));
        if passes.is_empty() {
            writeln!(out, "  warning: no built-in pass casts the light of {lights}")?;
        } else {
            writeln!(out, "  {:<28} {}", format!("{lights} cast by"), passes.join(", "))?;
        }
    }
    for warning in &scene.warnings {
        writeln!(out, "  warning: {warning}")?;
    }
    Ok(())
}
