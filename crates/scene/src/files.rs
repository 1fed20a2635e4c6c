//! Reading whole files.

use std::path::Path;

/// Most bytes of one file.
const MAX_BYTES: u64 = 1 << 30;

/// A whole regular file: devices and pipes may have no end.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, String> {
    let about = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !about.is_file() {
        return Err("it is not a file".into());
    }
    if about.len() > MAX_BYTES {
        return Err(format!("it has {} bytes; at most {MAX_BYTES} are read", about.len()));
    }
    std::fs::read(path).map_err(|error| error.to_string())
}
