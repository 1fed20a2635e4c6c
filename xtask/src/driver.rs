//! Finds out whether programs on this machine can reach a Vulkan driver.
//!
//! On Linux that takes two things: the loader `libvulkan.so.1`, and at least one driver, which makes itself known by a JSON manifest in
//! one of a few folders (Vulkan-Loader, "Loader and Driver Interface", section "Driver Discovery on Linux").

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What was found.
#[derive(Debug, PartialEq, Eq)]
pub enum Driver {
    /// The system has a graphics interface of its own (Metal, Direct3D 12).
    NotNeeded,
    /// Loader and driver are there.
    Ready {
        /// Manifests of the drivers the loader will consider.
        manifests: Vec<PathBuf>,
    },
    /// Loader or driver is not there; installing packages can mend that.
    Missing(Missing),
    /// An environment variable points the loader at drivers that are not there; no package mends that.
    Misdirected(String),
}

/// What of a driver is not there.
#[derive(Debug, PartialEq, Eq)]
pub struct Missing {
    loader: bool,
    driver: bool,
}

impl fmt::Display for Missing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match (self.loader, self.driver) {
            (true, true) => "there is neither a Vulkan loader (libvulkan.so.1) nor a Vulkan driver",
            (true, false) => "there is no Vulkan loader (libvulkan.so.1)",
            (false, _) => "there is no Vulkan driver",
        })
    }
}

/// Variables that replace the loader's search for manifests, the stronger first.
const REPLACING_VARIABLES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// Folders of manifests that all users share.
const MANIFEST_FOLDERS: [&str; 3] = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"];

/// Looks for a loader and drivers on this machine.
pub fn find() -> Driver {
    if cfg!(any(target_os = "macos", target_os = "windows")) {
        return Driver::NotNeeded;
    }
    let mut folders: Vec<PathBuf> = MANIFEST_FOLDERS.iter().map(PathBuf::from).collect();
    if let Some(home) = std::env::var_os("HOME") {
        folders.push(Path::new(&home).join(".local/share/vulkan/icd.d"));
    }
    let replacement =
        REPLACING_VARIABLES.iter().find_map(|name| std::env::var_os(name).filter(|value| !value.is_empty()).map(|value| (*name, value)));
    judge(loader_present(), &folders, replacement)
}

/// Puts together what was found: the loader, the manifests in `folders`, and the variable that replaces these folders, if one is set.
fn judge(loader: bool, folders: &[PathBuf], replacement: Option<(&str, OsString)>) -> Driver {
    let manifests: Vec<PathBuf> = match &replacement {
        Some((_, paths)) => {
            std::env::split_paths(paths).flat_map(|path| if path.is_dir() { manifests_in(&path) } else { vec![path] }).collect()
        }
        None => folders.iter().flat_map(|folder| manifests_in(folder)).collect(),
    };
    let manifests: Vec<PathBuf> = manifests.into_iter().filter(|path| path.is_file()).collect();
    match replacement {
        Some((name, paths)) if manifests.is_empty() => {
            Driver::Misdirected(format!("{name} is set to {}, where there is no Vulkan driver; unset or correct it", paths.display()))
        }
        _ if loader && !manifests.is_empty() => Driver::Ready { manifests },
        _ => Driver::Missing(Missing { loader: !loader, driver: manifests.is_empty() }),
    }
}

/// Manifests in a folder, in the order of their names; a folder that cannot be read has none.
fn manifests_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut manifests: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|it| it == "json")).collect();
    manifests.sort();
    manifests
}

/// Whether the dynamic linker will find `libvulkan.so.1`.
fn loader_present() -> bool {
    // An ordinary user's PATH may lack /sbin, where Debian keeps ldconfig.
    ["ldconfig", "/sbin/ldconfig", "/usr/sbin/ldconfig"].iter().any(|program| {
        Command::new(program).arg("-p").output().is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains("libvulkan.so.1 "))
    }) || library_folders().iter().any(|folder| folder.join("libvulkan.so.1").exists())
}

/// Where shared libraries usually lie, for systems without ldconfig: folders named by the user, /usr/lib*, and the folders for each
/// machine type below /usr/lib.
fn library_folders() -> Vec<PathBuf> {
    let named = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    let mut folders: Vec<PathBuf> = std::env::split_paths(&named).filter(|path| !path.as_os_str().is_empty()).collect();
    let usual = ["/usr/lib", "/usr/lib64", "/usr/local/lib", "/usr/local/lib64"];
    folders.extend(usual.iter().map(PathBuf::from));
    let below = std::fs::read_dir("/usr/lib").into_iter().flatten().flatten().map(|entry| entry.path());
    folders.extend(below.filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().contains("-linux-"))));
    folders
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::{Driver, Missing, judge};
    use std::path::PathBuf;

    /// A folder of the test's own with one manifest and one file that is none.
    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("lobelia-xtask-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("driver.json"), "{}").unwrap();
        std::fs::write(folder.join("notes.txt"), "").unwrap();
        folder
    }

    #[test]
    fn a_driver_takes_both_loader_and_manifest() {
        let folder = folder("both");
        let folders = [folder.clone(), folder.join("absent")];
        let ready = judge(true, &folders, None);
        let without_loader = judge(false, &folders, None);
        let without_manifest = judge(true, &folders[1..], None);
        let manifest = folder.join("driver.json");
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(ready, Driver::Ready { manifests: vec![manifest] });
        assert_eq!(without_loader, Driver::Missing(Missing { loader: true, driver: false }));
        assert_eq!(without_manifest, Driver::Missing(Missing { loader: false, driver: true }));
    }

    #[test]
    fn a_variable_replaces_the_folders() {
        let folder = folder("variable");
        let manifest = folder.join("driver.json");
        let file = judge(true, &[], Some(("VK_DRIVER_FILES", manifest.clone().into())));
        let whole_folder = judge(true, &[], Some(("VK_DRIVER_FILES", folder.clone().into())));
        let astray = judge(true, std::slice::from_ref(&folder), Some(("VK_DRIVER_FILES", folder.join("absent.json").into())));
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(file, Driver::Ready { manifests: vec![manifest.clone()] });
        assert_eq!(whole_folder, Driver::Ready { manifests: vec![manifest] });
        assert!(matches!(astray, Driver::Misdirected(message) if message.contains("VK_DRIVER_FILES")));
    }
}
