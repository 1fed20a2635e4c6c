//! Chores of the workspace: `cargo xtask render`, `cargo xtask test`, `cargo xtask atlas`, `cargo xtask fit-ltc`,
//! `cargo xtask check-driver`.
//!
//! Rendering and the tests need a Vulkan driver on Linux. A machine without a graphics card can use Mesa's software driver, which the
//! chores offer to install.

mod driver;
mod install;
mod picture;

use clap::{Args, Parser, Subcommand};
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, ExitStatus};

/// Exit code of a chore that failed before the command it was to run had started.
const FAILED: u8 = 1;

const EXAMPLES: &str = "\
Examples:
  cargo xtask render
      Indirect light in the built-in Cornell box, to out.png.
  cargo xtask render -- --scene room.gltf -o room.png
      The same graph, another scene and another picture.
  cargo xtask render --yes
      Install a missing driver without asking.
  cargo xtask test
      Every test of the workspace.
  cargo xtask atlas
      The figures and tables of docs/lobes.
  cargo xtask fit-ltc
      The table of linearly transformed cosines, fitted anew in a minute or two.
  cargo xtask check-driver
      Say whether a Vulkan driver is there.

With the environment variable CI set, a missing driver is installed without asking,
and a test that finds no device fails instead of skipping.";

/// Chores of the Lobelia workspace.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

/// One chore.
#[derive(Subcommand)]
enum Chore {
    /// Render graphs/indirect.ron to a picture, after making sure that there is a Vulkan driver.
    Render {
        #[command(flatten)]
        consent: Consent,
        /// Arguments for `lobelia render`; -o, --scene and --size replace the defaults. Paths are relative to the workspace root.
        #[arg(last = true, value_name = "ARGUMENTS")]
        extra: Vec<OsString>,
    },
    /// Run every test of the workspace, after making sure that there is a Vulkan driver.
    Test {
        #[command(flatten)]
        consent: Consent,
    },
    /// Draw the error atlas of docs/lobes anew, and refresh its table of the WGSL functions.
    Atlas {
        #[command(flatten)]
        consent: Consent,
        /// Arguments for the atlas program; `-- --help` lists them.
        #[arg(last = true, value_name = "ARGUMENTS")]
        extra: Vec<OsString>,
    },
    /// Fit linearly transformed cosines to the reflectance anew, to crates/arealight-peers/data/ltc-ggx.bin. Needs no device.
    FitLtc {
        /// Arguments for the fitting program; `-- --help` lists them. Paths are relative to the workspace root.
        #[arg(last = true, value_name = "ARGUMENTS")]
        extra: Vec<OsString>,
    },
    /// Say whether a Vulkan loader and driver are there; exit code 1 if not. Installs nothing.
    CheckDriver,
}

/// Whether a missing driver may be installed without asking.
#[derive(Args)]
struct Consent {
    /// Install a missing Vulkan driver without asking. Of the packages of loader and driver, apt-get and
    /// pacman also upgrade those that are there in an older version than their lists have; dnf may.
    #[arg(long, short)]
    yes: bool,
}

fn main() -> ExitCode {
    let outcome = match Arguments::parse().chore {
        Chore::Render { consent, extra } => render(&consent, &extra),
        Chore::Test { consent } => test(&consent),
        Chore::Atlas { consent, extra } => atlas(&consent, &extra),
        Chore::FitLtc { extra } => fit_ltc(&extra),
        Chore::CheckDriver => check_driver(),
    };
    outcome.unwrap_or_else(|message| {
        eprintln!("error: {message}");
        ExitCode::from(FAILED)
    })
}

/// What rendering is about to do, said before the first step.
fn plan(picture: Option<&Path>) -> String {
    let place = picture.map(|picture| format!(", to {}", picture.display())).unwrap_or_default();
    format!("1. Look for a Vulkan driver.\n2. Build Lobelia: minutes the first time, seconds later.\n3. Render{place}.")
}

/// Renders the default picture, or what `extra` makes of it, and prints where it is.
fn render(consent: &Consent, extra: &[OsString]) -> Result<ExitCode, String> {
    let root = workspace_root()?;
    println!("{}", plan(picture::output(extra).map(|output| root.join(output)).as_deref()));
    ensure_driver(consent)?;
    let mut command = cargo(&root);
    command.args(["run", "-p", "lobelia-lobelia", "--bin", "lobelia", "--", "render"]);
    command.args(picture::arguments(extra));
    let status = run(&mut command)?;
    if status.success()
        && let Some(output) = picture::output(extra)
    {
        println!("Picture: {}", root.join(output).display());
    }
    Ok(exit_code(status))
}

/// Runs plain `cargo test`, which includes doc tests and whose closing lines can be read as they are.
fn test(consent: &Consent) -> Result<ExitCode, String> {
    ensure_driver(consent)?;
    let mut command = cargo(&workspace_root()?);
    command.args(["test", "--workspace"]);
    if in_ci() {
        command.env("LOBELIA_REQUIRE_GPU", "1");
        // Mesa's device-selection layer prints an error where there is no desktop session.
        command.env("NODEVICE_SELECT", "1");
    }
    run(&mut command).map(exit_code)
}

/// Draws the atlas; its table needs a device.
fn atlas(consent: &Consent, extra: &[OsString]) -> Result<ExitCode, String> {
    ensure_driver(consent)?;
    let mut command = cargo(&workspace_root()?);
    command.args(["run", "-p", "lobelia-atlas", "--"]).args(extra);
    run(&mut command).map(exit_code)
}

/// Fits the table; numbers only.
fn fit_ltc(extra: &[OsString]) -> Result<ExitCode, String> {
    let root = workspace_root()?;
    let mut command = cargo(&root);
    command.current_dir(&root).args(["run", "-p", "lobelia-fit-ltc", "--"]).args(extra);
    run(&mut command).map(exit_code)
}

/// Reports on the driver; an incomplete one is an error.
fn check_driver() -> Result<ExitCode, String> {
    match driver::find() {
        driver::Driver::NotNeeded => println!("No Vulkan driver is needed: this system brings its own graphics interface."),
        driver::Driver::Ready { manifests } => {
            println!("Vulkan loader: present\nVulkan drivers:");
            for manifest in manifests {
                println!("  {}", manifest.display());
            }
        }
        driver::Driver::Missing(missing) => return Err(format!("{missing}; `cargo xtask test` and `cargo xtask render` can install one")),
        driver::Driver::Misdirected(message) => return Err(message),
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns once a driver is there, installing one if that is allowed.
fn ensure_driver(consent: &Consent) -> Result<(), String> {
    match driver::find() {
        driver::Driver::NotNeeded | driver::Driver::Ready { .. } => return Ok(()),
        driver::Driver::Misdirected(message) => return Err(message),
        driver::Driver::Missing(missing) => install::install(&missing.to_string(), consent.yes || in_ci())?,
    }
    match driver::find() {
        driver::Driver::NotNeeded | driver::Driver::Ready { .. } => Ok(()),
        driver::Driver::Missing(missing) => Err(format!("the packages are installed, yet {missing}")),
        driver::Driver::Misdirected(message) => Err(message),
    }
}

/// Whether this runs unattended: `CI` is set to anything but nothing, `0` or `false`.
fn in_ci() -> bool {
    std::env::var_os("CI").is_some_and(|value| !value.is_empty() && value != "0" && value != "false")
}

/// The folder above this package's; cargo says at run time where that is, so a checkout that has moved is still found.
fn workspace_root() -> Result<PathBuf, String> {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    package.parent().map(Path::to_path_buf).ok_or_else(|| format!("{} has no folder above it", package.display()))
}

/// The cargo that started this program, to be run in the workspace root.
fn cargo(root: &Path) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    // These describe this package; build scripts and tests further down must not take them for their own.
    for (name, _) in std::env::vars_os() {
        if name.to_str().is_some_and(|name| name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_")) {
            command.env_remove(name);
        }
    }
    command
}

/// Runs a command to its end with this program's terminal.
fn run(command: &mut Command) -> Result<ExitStatus, String> {
    command.status().map_err(|error| format!("cannot start {}: {error}", display(command)))
}

/// A command as it would be typed.
fn display(command: &Command) -> String {
    let words: Vec<_> = std::iter::once(command.get_program()).chain(command.get_args()).map(OsStr::to_string_lossy).collect();
    words.join(" ")
}

/// The exit code of a command that has ended; one that a signal ended has 128 plus the signal's number, as in a shell.
fn exit_code(status: ExitStatus) -> ExitCode {
    #[cfg(unix)]
    let signal = std::os::unix::process::ExitStatusExt::signal(&status).map(|signal| 128 + signal);
    #[cfg(not(unix))]
    let signal = None;
    let code = status.code().or(signal).and_then(|code| u8::try_from(code).ok());
    ExitCode::from(code.unwrap_or(FAILED))
}

#[cfg(test)]
mod tests {
    use super::plan;

    #[test]
    fn the_plan_says_where_the_picture_will_lie() {
        assert!(plan(Some("/x/out.png".as_ref())).ends_with("3. Render, to /x/out.png."));
        assert!(plan(None).ends_with("3. Render."));
    }
}
