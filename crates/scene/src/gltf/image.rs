//! Images, decoded under a limit on what they may claim.

use super::{accessor::Buffers, read_uri};
use crate::{SceneError, Texture};
use std::{io::Cursor, path::Path};

/// Largest side that every WebGPU device takes.
const MAX_SIDE: u32 = 8192;

/// Most bytes that decoding one image may take: 16 bits per channel at the largest size.
const MAX_ALLOCATION: u64 = 8 * (MAX_SIDE as u64) * (MAX_SIDE as u64) + (64 << 20);

/// Most texels that all images together may have: 1 GiB.
const MAX_TEXELS: u64 = 1 << 28;

pub(crate) fn load(gltf: &gltf::Gltf, buffers: &Buffers, shown: &str, folder: Option<&Path>) -> Result<Vec<Texture>, SceneError> {
    let mut texels = 0;
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
            let decoded = decode(&bytes, MAX_TEXELS - texels).map_err(|message| fail(format!("`{name}`: {message}")))?;
            let (width, height) = decoded.dimensions();
            texels += u64::from(width) * u64::from(height);
            Ok(Texture { name, width, height, rgba: decoded.into_raw() })
        })
        .collect()
}

/// An image of at most `texels` texels. Its claimed size is looked at before anything is allocated.
fn decode(bytes: &[u8], texels: u64) -> Result<image::RgbaImage, String> {
    let reader = || image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string());
    let broken = |error: image::ImageError| format!("it cannot be decoded: {error}");
    let (width, height) = reader()?.into_dimensions().map_err(broken)?;
    if width == 0 || height == 0 {
        return Err(format!("it has {width} x {height} texels"));
    }
    if width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!("it has {width} x {height} texels; each side may have at most {MAX_SIDE}"));
    }
    if u64::from(width) * u64::from(height) > texels {
        return Err(format!("with its {width} x {height} texels the images have more than {MAX_TEXELS}"));
    }
    let mut reader = reader()?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_ALLOCATION);
    reader.limits(limits);
    Ok(reader.decode().map_err(broken)?.to_rgba8())
}
