//! Installs Mesa's software Vulkan driver with the system's package manager.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::Command;

/// A package manager and what it calls the loader and Mesa's software driver.
struct PackageManager {
    program: &'static str,
    /// Arguments that fetch the lists of packages, where that is a step of its own.
    refresh: Option<&'static [&'static str]>,
    /// Arguments that install without asking back; the packages follow.
    install: &'static [&'static str],
    packages: [&'static str; 2],
    /// What becomes of a package of these that is there in an older version.
    upgrades: &'static str,
}

const PACKAGE_MANAGERS: [PackageManager; 3] = [
    PackageManager {
        program: "apt-get",
        refresh: Some(&["update"]),
        install: &["install", "-y", "--no-install-recommends"],
        packages: ["mesa-vulkan-drivers", "libvulkan1"],
        upgrades: "A package of these that is there in an older version is upgraded.",
    },
    PackageManager {
        program: "dnf",
        refresh: None,
        install: &["install", "-y"],
        packages: ["mesa-vulkan-drivers", "vulkan-loader"],
        upgrades: "A package of these that is there in an older version may be upgraded.",
    },
    PackageManager {
        program: "pacman",
        // Fresh lists without a full upgrade would leave an Arch system half upgraded.
        refresh: None,
        install: &["-S", "--needed", "--noconfirm"],
        packages: ["vulkan-swrast", "vulkan-icd-loader"],
        upgrades: "A package of these that is there in an older version is upgraded.",
    },
];

/// Installs loader and driver, asking first unless `agreed`. `problem` says what is missing and opens every message.
pub fn install(problem: &str, agreed: bool) -> Result<(), String> {
    let Some(manager) = PACKAGE_MANAGERS.iter().find(|manager| on_path(manager.program).is_some()) else {
        return Err(format!(
            "{problem}, and none of apt-get, dnf and pacman is here to install one; install a Vulkan loader and a driver \
             (Mesa's software driver is called lavapipe), then run this again"
        ));
    };
    let prefix = privileges().map_err(|reason| format!("{problem}, and {reason}"))?;
    let commands = commands(manager, prefix);
    let typed: Vec<String> = commands.iter().map(|words| words.join(" ")).collect();
    if !agreed {
        ask(problem, &typed, manager.upgrades)?;
    }
    for (words, typed) in commands.iter().zip(&typed) {
        println!("Running: {typed}");
        let status = Command::new(words[0]).args(&words[1..]).status().map_err(|error| format!("cannot start `{typed}`: {error}"))?;
        if !status.success() {
            return Err(format!("{problem}, and `{typed}` failed ({status}); refresh the lists of packages and run it by hand"));
        }
    }
    Ok(())
}

/// The commands that install loader and driver, each behind `prefix`.
fn commands(manager: &PackageManager, prefix: &[&'static str]) -> Vec<Vec<&'static str>> {
    // sudo drops the environment, so `env` has to stand behind it. Only Debian's tools heed the variable.
    let program = ["env", "DEBIAN_FRONTEND=noninteractive", manager.program];
    let install = [manager.install, &manager.packages].concat();
    manager.refresh.into_iter().chain([install.as_slice()]).map(|arguments| [prefix, &program, arguments].concat()).collect()
}

/// Asks on the terminal; anything but a yes is an error that says what to do instead.
fn ask(problem: &str, commands: &[String], upgrades: &str) -> Result<(), String> {
    let by_hand = commands.join(" && ");
    if !std::io::stdin().is_terminal() {
        return Err(format!("{problem}; run again with --yes to install Mesa's software driver, or run: {by_hand} ({upgrades})"));
    }
    println!("Lobelia needs one: {problem}.\nMesa's software driver can be installed with:\n  {by_hand}\n{upgrades}");
    print!("Install it now? [y/N] ");
    let mut answer = String::new();
    std::io::stdout().flush().and_then(|()| std::io::stdin().read_line(&mut answer)).map_err(|error| format!("cannot ask: {error}"))?;
    if matches!(answer.trim().to_lowercase().as_str(), "y" | "yes") {
        Ok(())
    } else {
        Err(format!("{problem}, and nothing was installed; to install Mesa's software driver later, run: {by_hand}"))
    }
}

/// What has to stand before a command that needs to be run as root: nothing for root, else sudo.
fn privileges() -> Result<&'static [&'static str], &'static str> {
    let is_root = Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0");
    if is_root {
        Ok(&[])
    } else if on_path("sudo").is_some() {
        Ok(&["sudo"])
    } else {
        Err("installing one takes root, yet this user is not root and sudo is not here")
    }
}

/// Where a program is, if `PATH` leads to it.
fn on_path(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|candidate| candidate.is_file())
}

#[cfg(test)]
mod tests {
    use super::{PACKAGE_MANAGERS, commands};

    #[test]
    fn debian_refreshes_its_lists_first() {
        let typed: Vec<String> = commands(&PACKAGE_MANAGERS[0], &["sudo"]).iter().map(|words| words.join(" ")).collect();
        let apt = "sudo env DEBIAN_FRONTEND=noninteractive apt-get";
        let install = format!("{apt} install -y --no-install-recommends mesa-vulkan-drivers libvulkan1");
        assert_eq!(typed, [format!("{apt} update"), install]);
    }

    #[test]
    fn a_prompt_says_what_is_upgraded() {
        let [apt, dnf, pacman] = &PACKAGE_MANAGERS;
        assert!(apt.upgrades.ends_with("is upgraded.") && pacman.upgrades.ends_with("is upgraded."));
        assert!(dnf.upgrades.ends_with("may be upgraded."));
    }

    #[test]
    fn root_needs_no_sudo() {
        for manager in &PACKAGE_MANAGERS {
            assert!(commands(manager, &[]).iter().all(|words| words[0] == "env" && words[2] == manager.program));
        }
    }
}
