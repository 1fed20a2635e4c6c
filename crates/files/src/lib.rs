//! Reading files as people have them.
//!
//! A file is not always what its name says: a clone without Git LFS holds pointers, a download ends early or is a server's error page, an editor puts
//! a byte-order mark in front. [`stand_in`] knows what stands in a file's place, [`text`] reads text past a byte-order mark, and `radiance`
//! (a feature of that name) reads pictures of light: which layer, which window, which primaries, which transfer.

mod kind;
#[cfg(feature = "radiance")]
pub mod radiance;
mod text;

pub use kind::{describe, kind, placeholder, stand_in};
pub use text::{NoText, text, without_mark};

use std::path::Path;

/// Most bytes of one file that is read whole.
pub const MAX_BYTES: u64 = 1 << 30;

/// A whole regular file of at most [`MAX_BYTES`]: devices and pipes may have no end. What stands in for the data ([`stand_in`]) is an error.
pub fn read(path: &Path) -> Result<Vec<u8>, String> {
    let bytes = read_raw(path)?;
    match stand_in(&bytes) {
        Some(what) => Err(what),
        None => Ok(bytes),
    }
}

/// As [`read`], but an empty file is no error and archives are data: any bytes may be what the file is for.
pub fn read_raw(path: &Path) -> Result<Vec<u8>, String> {
    let cannot = |error: std::io::Error| format!("cannot be read: {error}");
    let about = std::fs::metadata(path).map_err(cannot)?;
    if !about.is_file() {
        return Err("cannot be read: it is not a file".into());
    }
    if about.len() > MAX_BYTES {
        return Err(format!("cannot be read: it has {} bytes; at most {MAX_BYTES} are read", about.len()));
    }
    std::fs::read(path).map_err(cannot)
}

/// The text of a file, past a byte-order mark.
pub fn read_text(path: &Path) -> Result<String, String> {
    let bytes = read_raw(path)?;
    text(&bytes).map(str::to_owned).map_err(|error| error.to_string())
}
