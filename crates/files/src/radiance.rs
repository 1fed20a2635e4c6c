//! Pictures of light: OpenEXR, Radiance HDR, and 8-bit or 16-bit pictures, as linear radiance in Rec. 709 primaries.

mod exr_layers;
mod hdr;
mod pixels;
mod primaries;
mod quantised;

pub use pixels::Mended;
pub use primaries::Primaries;

use std::path::{Path, PathBuf};

/// Largest side of a picture, pixels.
pub const MAX_SIDE: u32 = 1 << 16;

/// Most pixels of a picture.
pub const MAX_PIXELS: u64 = 1 << 28;

/// A picture of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Radiance {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Linear, in the primaries of Rec. 709; row 0 at the top. Nothing is clamped: what a file holds may be negative, infinite or NaN.
    pub pixels: Vec<[f32; 3]>,
    /// What a user should know of how the file was read, in sentences without the file's name.
    pub notes: Vec<String>,
}

impl Radiance {
    /// Reads a file. `truth.exr#Beauty` is the layer `Beauty` of `truth.exr`, unless there is a file of the whole name. The message begins with the
    /// file's name.
    pub fn load(path: &Path) -> Result<Self, String> {
        let (file, layer) = split_layer(path);
        let fail = |what: String| format!("{}: {what}", file.display());
        let bytes = crate::read(&file).map_err(fail)?;
        Self::decode(&bytes, layer.as_deref()).map_err(fail)
    }

    /// From a file's bytes; what it is, is told by its beginning and not by a name. Only OpenEXR has layers. The message completes a sentence that begins
    /// with the file's name.
    pub fn decode(bytes: &[u8], layer: Option<&str>) -> Result<Self, String> {
        if bytes.starts_with(b"\x76\x2f\x31\x01") {
            return exr_layers::decode(bytes, layer);
        }
        if let Some(layer) = layer {
            let what = crate::describe(bytes).unwrap_or_else(|| "it is something else".into());
            return Err(format!("only OpenEXR files have layers such as `{layer}`, but {what}"));
        }
        if bytes.starts_with(b"#?") { hdr::decode(bytes) } else { quantised::decode(bytes) }
    }

    fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Turns colours of other primaries into those of Rec. 709; `what` names where they stand.
    fn convert(&mut self, primaries: &Primaries, what: &str) {
        let Some(matrix) = primaries.to_rec709() else {
            self.note(format!("its {what} are no primaries and are ignored"));
            return;
        };
        if matrix == glam::DMat3::IDENTITY {
            return;
        }
        for pixel in &mut self.pixels {
            let colour = glam::DVec3::from_array(pixel.map(f64::from));
            // A matrix makes NaN of every channel beside an infinite one, so such a pixel stays what it is.
            if colour.is_finite() {
                *pixel = (matrix * colour).to_array().map(|value| value as f32);
            }
        }
        self.note(format!("its {what} are {primaries}; colours are turned into those of Rec. 709"));
    }
}

/// `truth.exr#Beauty` as file and layer. A file whose own name has a `#` is that file.
pub fn split_layer(path: &Path) -> (PathBuf, Option<String>) {
    if path.exists() {
        return (path.to_owned(), None);
    }
    let split = path.to_str().and_then(|text| text.rsplit_once('#')).filter(|(file, _)| !file.is_empty());
    match split {
        Some((file, layer)) => (file.into(), Some(layer.to_owned())),
        None => (path.to_owned(), None),
    }
}

/// Refuses a size before anything is allocated for it.
fn check_size(width: u64, height: u64) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err("it has no pixels".into());
    }
    if width > MAX_SIDE.into() || height > MAX_SIDE.into() || width * height > MAX_PIXELS {
        return Err(format!("it has {width} x {height} pixels; at most {MAX_SIDE} per side and {MAX_PIXELS} in all are read"));
    }
    Ok(())
}

/// The message for what a decoder refuses, with what the file is instead where that can be told.
fn broken(bytes: &[u8], expected: &str, error: impl std::fmt::Display) -> String {
    match crate::describe(bytes).filter(|what| !what.contains(expected)) {
        Some(what) => format!("it cannot be decoded: {what}"),
        None => format!("it cannot be decoded: {error}"),
    }
}
