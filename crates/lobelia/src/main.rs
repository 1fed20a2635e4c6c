//! The `lobelia` program.

mod commands;
mod console;
mod failure;
mod files;
mod progress;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Compose, swap and measure real-time glossy lighting techniques.
///
/// A pipeline is a RON file of passes; a technique is a pass. Scenes are glTF files, RON scenes that wrap one, or built in (`builtin:cornell-glossy`).
#[derive(Parser)]
#[command(name = "lobelia", version, propagate_version = true, max_term_width = 110)]
#[command(after_help = "\
Examples:
  lobelia render graphs/indirect.ron --scene builtin:cornell-glossy -o out.png
  lobelia render graphs/indirect.ron --scene room.glb --variant no-visibility --set lights.count=4096 -o out.exr
  lobelia compare graphs/indirect.ron graphs/indirect.ron:no-visibility --report out
  lobelia reference --scene builtin:cornell-glossy --paths one-bounce --error 0.02 -o truth.exr
  lobelia explain graphs/indirect.ron --scene builtin:cornell-diffuse
  lobelia passes vpl-gather
  lobelia variants graphs/indirect.ron

Exit codes: 0 done, 1 the run failed, 2 the input is wrong.")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene through a graph.
    Render(Box<commands::render::Arguments>),
    Compare(Box<commands::compare::Arguments>),
    Sweep(commands::sweep::Arguments),
    Reference(commands::reference::Arguments),
    /// List passes, or describe one: ports, parameters, units, ranges, defaults.
    Passes(commands::passes::Arguments),
    Variants(commands::variants::Arguments),
    /// Show what a scene requires of a graph: order, kept, dropped and why, specialisations, memory.
    Explain(commands::explain::Arguments),
    /// Check graph files, every variant of each. Needs no device.
    Check(commands::check::Arguments),
    /// Print the facts of a scene that passes ask for.
    SceneInfo(commands::scene_info::Arguments),
    /// List the devices that could be used.
    Adapters(commands::adapters::Arguments),
    /// Print a completion script for a shell.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
}

fn main() -> ExitCode {
    console::silence_device_selection();
    let filter = tracing_subscriber::EnvFilter::try_from_env("LOBELIA_LOG").unwrap_or_else(|_| "error,naga_oil=off".into());
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    // A reader that goes away (`lobelia passes | head`) is no reason to panic.
    let outcome = match Arguments::parse().command {
        Command::Render(arguments) => commands::render::run(&arguments),
        Command::Compare(arguments) => commands::compare::run(&arguments),
        Command::Sweep(arguments) => commands::sweep::run(&arguments),
        Command::Reference(arguments) => commands::reference::run(&arguments),
        Command::Passes(arguments) => commands::passes::run(&arguments),
        Command::Variants(arguments) => commands::variants::run(&arguments),
        Command::Explain(arguments) => commands::explain::run(&arguments),
        Command::Check(arguments) => commands::check::run(&arguments),
        Command::SceneInfo(arguments) => commands::scene_info::run(&arguments),
        Command::Adapters(arguments) => commands::adapters::run(&arguments),
        Command::Completions { shell } => commands::completions::<Arguments>(shell),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
