//! Images, decoded under a limit on what they may claim.

use super::{accessor::Buffers, read_uri};
use crate::{SceneError, Texture};
use std::{io::Cursor, path::Path};

/// Largest side that every WebGPU device takes.
const MAX_SIDE: u32 = 8192;

pub(crate) fn load(gltf: &gltf::Gltf, buffers: &Buffers, shown: &str, folder: Option<&Path>) -> Result<Vec<Texture>, SceneError> {
    gltf.images()
        .map(|image| {
            let index = image.index();
            let fail = |message: String| SceneError::content(shown, format!("image {index}: {message}"));
            let (name, bytes) = match image.source() {
                gltf::image::Source::View { view, .. } => {
                    (image.name().map_or_else(|| format!("image {index}"), str::to_owned), buffers.view(shown, &view)?.to_vec())
                }
                gltf::image::Source::Uri { uri, .. } => {
                    let short = if uri.starts_with("data:") { format!("image {index}") } else { uri.to_owned() };
                    (short, read_uri(uri, folder).map_err(fail)?)
                }
            };
            let decoded = decode(&bytes).map_err(|message| fail(format!("`{name}`: {message}")))?;
            let (width, height) = decoded.dimensions();
            Ok(Texture { name, width, height, rgba: decoded.into_raw() })
        })
        .collect()
}

fn decode(bytes: &[u8]) -> Result<image::RgbaImage, String> {
    let mut reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height, limits.max_alloc) = (Some(MAX_SIDE), Some(MAX_SIDE), Some(1 << 30));
    reader.limits(limits);
    let image = reader.decode().map_err(|error| format!("it cannot be decoded: {error} (each side may have at most {MAX_SIDE} texels)"))?;
    if image.width() == 0 || image.height() == 0 {
        return Err("it has no texels".into());
    }
    Ok(image.to_rgba8())
}
