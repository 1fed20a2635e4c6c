//! EXR files: channels R, G, B, row 0 at the top.

use crate::{Image, MeasureError};
use exr::prelude::{self as files, WritableImage as _};
use std::path::Path;

/// Reads the R, G, B channels of the first layer that has them; half or float.
pub fn read_exr(path: &Path) -> Result<Image, MeasureError> {
    let fail = |reason: String| MeasureError::File { file: path.display().to_string(), reason };
    let read = files::read_first_rgba_layer_from_file(
        path,
        |resolution, _| (resolution.width(), vec![[0.0f32; 3]; resolution.width() * resolution.height()]),
        |(width, pixels): &mut (usize, Vec<[f32; 3]>), position, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[position.y() * *width + position.x()] = [r, g, b];
        },
    )
    .map_err(|error| fail(format!("cannot be read as an EXR picture: {error}")))?;
    let size = read.layer_data.size;
    let (_, pixels) = read.layer_data.channel_data.pixels;
    Ok(Image { width: size.width(), height: size.height(), pixels })
}

/// Writes 32-bit floats through a temporary file in the same folder.
pub fn write_exr(path: &Path, image: &Image) -> Result<(), MeasureError> {
    let fail = |reason: String| MeasureError::File { file: path.display().to_string(), reason };
    let name = path.file_name().and_then(|name| name.to_str()).ok_or_else(|| fail("not a file name".into()))?;
    let temporary = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
    let channels = files::SpecificChannels::rgb(|position: files::Vec2<usize>| {
        let [r, g, b] = image.pixels[position.y() * image.width + position.x()];
        (r, g, b)
    });
    let written = files::Image::from_channels((image.width, image.height), channels).write().to_file(&temporary);
    let renamed = written.map_err(|error| error.to_string()).and_then(|()| std::fs::rename(&temporary, path).map_err(|error| error.to_string()));
    renamed.map_err(|reason| {
        // Nothing half-written stays behind; if it cannot be removed, the first error still says why.
        let _ = std::fs::remove_file(&temporary);
        fail(format!("cannot be written: {reason}"))
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn comes_back_bit_for_bit_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let pixels = (0..15).map(|index| [index as f32 * 0.37, 1e-6 * index as f32, 65504.0]).collect();
        let image = Image { width: 5, height: 3, pixels };
        let path = folder.path().join("a.exr");
        write_exr(&path, &image).unwrap();
        assert_eq!(read_exr(&path).unwrap(), image);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_is_no_picture_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("b.exr");
        std::fs::write(&path, b"not a picture").unwrap();
        assert!(read_exr(&path).unwrap_err().to_string().contains("b.exr"));
        assert!(read_exr(&folder.path().join("missing.exr")).is_err());
    }
}
