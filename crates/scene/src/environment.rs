//! Environment maps from files.

use crate::Environment;
use glam::Vec3;
use lobelia_files::radiance::{Radiance, split_layer};
use std::path::Path;

/// Largest side of an environment map: the largest texture that every WebGPU device takes.
const MAX_SIDE: usize = 8192;

/// Reads a map, and what a user should know of how it was read. `sky.exr#Layer` names a layer. A pixel that is no radiance is clamped.
pub(crate) fn load(path: &Path, scale: f32) -> Result<(Environment, Vec<String>), String> {
    let mut picture = Radiance::load(path)?;
    let name = path.display().to_string();
    let (width, height) = (picture.width, picture.height);
    if width > MAX_SIDE || height > MAX_SIDE {
        let file = split_layer(path).0;
        return Err(format!("{}: it has {width} x {height} pixels; each side may have at most {MAX_SIDE}", file.display()));
    }
    let mended = picture.mend();
    let notes = picture.notes.iter().cloned().chain(mended.words()).map(|note| format!("environment {name}: {note}")).collect();
    let pixels = picture.pixels.into_iter().map(Vec3::from_array).collect();
    Ok((Environment { name, width: width as u32, height: height as u32, pixels, scale }, notes))
}
