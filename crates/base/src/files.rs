//! Files that appear whole or not at all.

use std::{
    fs::{File, Metadata},
    io::{Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Why a file was not written. The path is for the caller to add.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// A folder stands there.
    #[error("this is a folder; name a file")]
    Folder,
    /// The folder that it should lie in is not there.
    #[error("the folder {} does not exist", .0.display())]
    NoFolder(PathBuf),
    /// Somebody protected it.
    #[error("the file is read-only; choose another name, or make it writable")]
    ReadOnly,
    /// The system refused.
    #[error("cannot write there: {0}")]
    System(#[from] std::io::Error),
    /// Whoever makes the contents could not.
    #[error("{0}")]
    Contents(String),
}

/// Links followed before a chain of them is called endless.
const MOST_LINKS: usize = 40;

/// The file that stands behind a chain of symbolic links, whether it exists or not.
fn behind_links(path: &Path) -> Result<PathBuf, WriteError> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match std::fs::read_link(&path) {
            Ok(next) => path = folder_of(&path).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(WriteError::Contents("the symbolic links there lead to each other".into()))
}

/// The parent of a bare file name is the empty path.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where the contents will go, and what stands there now.
fn goal(path: &Path) -> Result<(PathBuf, Option<Metadata>), WriteError> {
    let goal = behind_links(path)?;
    let folder = folder_of(&goal);
    if !folder.is_dir() {
        return Err(WriteError::NoFolder(folder.to_owned()));
    }
    let now = match std::fs::metadata(&goal) {
        Ok(now) => Some(now),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => return Err(error.into()),
    };
    match &now {
        Some(now) if now.is_dir() => Err(WriteError::Folder),
        Some(now) if now.permissions().readonly() => Err(WriteError::ReadOnly),
        _ => Ok((goal, now)),
    }
}

/// Whether [`replace_file`] would refuse `path`, to be asked before long work. A full disk, say, shows only later.
pub fn check_goal(path: &Path) -> Result<(), WriteError> {
    goal(path).map(|_| ())
}

/// Gives a file new contents through a temporary file in the same folder, renamed when all is written: readers see the old file or the new one, and a
/// failure leaves the old one untouched and nothing beside it.
///
/// A symbolic link stays: the file behind it is replaced. The rights of a file that is replaced stay too, and a read-only one is refused, also where the
/// user's rights would do. What is no file, such as a pipe or `/dev/null`, is written to.
pub fn replace_file(path: &Path, write: impl FnOnce(&mut File) -> Result<(), String>) -> Result<(), WriteError> {
    let (goal, now) = goal(path)?;
    if now.as_ref().is_some_and(|now| !now.is_file()) {
        // It cannot be renamed over, and may not be sought in.
        let mut whole = tempfile::tempfile()?;
        write(&mut whole).map_err(WriteError::Contents)?;
        whole.seek(SeekFrom::Start(0))?;
        let mut out = std::fs::OpenOptions::new().write(true).open(&goal)?;
        std::io::copy(&mut whole, &mut out)?;
        return Ok(out.flush()?);
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".lobelia-").suffix(".tmp");
    // Temporary files are private; what comes of this one is like any new file, so the user's mask decides.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder_of(&goal))?;
    write(file.as_file_mut()).map_err(WriteError::Contents)?;
    file.as_file_mut().flush()?;
    if let Some(now) = now {
        file.as_file().set_permissions(now.permissions())?;
    }
    file.persist(&goal).map_err(|error| error.error)?;
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{WriteError, check_goal, replace_file};
    use std::{io::Write, path::Path};

    fn put(path: &Path, text: &str) -> Result<(), WriteError> {
        replace_file(path, |file| file.write_all(text.as_bytes()).map_err(|error| error.to_string()))
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn files_are_replaced_whole_or_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        put(&file, "one").unwrap();
        put(&file, "two").unwrap();
        let broken = replace_file(&file, |file| {
            file.write_all(b"half").unwrap();
            Err("no more".into())
        });
        assert_eq!(broken.unwrap_err().to_string(), "no more");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "two");
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[test]
    fn folders_and_places_that_are_not_there_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(put(folder.path(), "x"), Err(WriteError::Folder)));
        let missing = folder.path().join("no").join("a");
        assert!(matches!(put(&missing, "x"), Err(WriteError::NoFolder(_))));
        assert!(matches!(check_goal(&missing), Err(WriteError::NoFolder(_))));
        assert!(check_goal(&folder.path().join("new")).is_ok());
    }

    #[test]
    fn a_read_only_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a");
        put(&file, "kept").unwrap();
        let mut rights = std::fs::metadata(&file).unwrap().permissions();
        rights.set_readonly(true);
        std::fs::set_permissions(&file, rights).unwrap();
        assert!(matches!(check_goal(&file), Err(WriteError::ReadOnly)));
        assert!(matches!(put(&file, "lost"), Err(WriteError::ReadOnly)));
        assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
        assert_eq!(names(folder.path()), ["a"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir(at("far")).unwrap();
        put(&at("far/file"), "old").unwrap();
        std::fs::set_permissions(at("far/file"), PermissionsExt::from_mode(0o640)).unwrap();
        symlink("far/file", at("link")).unwrap();
        symlink("link", at("second")).unwrap();
        symlink("far/new", at("dangling")).unwrap();
        put(&at("second"), "new").unwrap();
        put(&at("dangling"), "made").unwrap();
        assert_eq!(std::fs::read_to_string(at("far/file")).unwrap(), "new");
        assert_eq!(std::fs::metadata(at("far/file")).unwrap().permissions().mode() & 0o777, 0o640);
        assert_eq!(std::fs::read_to_string(at("far/new")).unwrap(), "made");
        for link in ["link", "second", "dangling"] {
            assert!(std::fs::symlink_metadata(at(link)).unwrap().is_symlink(), "{link}");
        }
        symlink("round", at("round")).unwrap();
        assert!(put(&at("round"), "x").is_err());
        assert_eq!(names(&at("far")), ["file", "new"]);
    }

    #[cfg(unix)]
    #[test]
    fn devices_are_written_to() {
        put(Path::new("/dev/null"), "gone").unwrap();
        assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    }
}
