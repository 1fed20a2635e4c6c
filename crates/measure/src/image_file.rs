//! EXR files (channels R, G, B, row 0 at the top) and PNG files. Whatever is written appears whole or not at all.

use crate::{Image, MeasureError};
use exr::prelude::{self as files, WritableImage as _, f16};
use lobelia_files::radiance::{Radiance, split_layer};
use std::{
    io::{BufWriter, Seek, Write},
    path::Path,
};

/// What an EXR file stores for each channel of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits: relative precision 2^-11 down to 6.1e-5, largest value 65504.
    Half,
    /// 32 bits: bit for bit what [`Image`] holds.
    #[default]
    Float,
}

fn failure(path: &Path, reason: impl std::fmt::Display) -> MeasureError {
    MeasureError::File { file: path.display().to_string(), reason: reason.to_string() }
}

/// Reads the picture of an OpenEXR file: its display window, in linear Rec. 709. `truth.exr#Beauty` names a layer; without a name it is the one without
/// a name, else the only one, and otherwise the message lists what is there.
pub fn read_exr(path: &Path) -> Result<Image, MeasureError> {
    read_picture(path).map(|(image, _)| image)
}

/// As [`read_exr`], for a Radiance HDR file too, with what a user should know of how it was read. A picture of 8 or 16 bits is refused: its numbers have
/// been through a tone curve and end at 1.
pub fn read_picture(path: &Path) -> Result<(Image, Vec<String>), MeasureError> {
    let (file, layer) = split_layer(path);
    let bytes = lobelia_files::read(&file).map_err(|reason| failure(path, reason))?;
    if !matches!(lobelia_files::kind(&bytes), Some("an OpenEXR picture" | "a Radiance HDR picture")) {
        let what = lobelia_files::describe(&bytes).map(|what| format!(": {what}")).unwrap_or_default();
        return Err(failure(path, format!("cannot be read as an OpenEXR or Radiance HDR picture{what}")));
    }
    let read = Radiance::decode(&bytes, layer.as_deref()).map_err(|reason| failure(&file, reason))?;
    Ok((Image { width: read.width, height: read.height, pixels: read.pixels }, read.notes))
}

/// Writes an EXR file of [`Precision::Float`].
pub fn write_exr(path: &Path, image: &Image) -> Result<(), MeasureError> {
    write_exr_with(path, image, Precision::Float)
}

/// Writes an EXR file. NaN and infinity are written as they are; a finite value that would become infinite as a half float is refused by its place.
pub fn write_exr_with(path: &Path, image: &Image, precision: Precision) -> Result<(), MeasureError> {
    image.check_size().map_err(|error| failure(path, error))?;
    let pixel = |position: files::Vec2<usize>| image.pixels[position.y() * image.width + position.x()];
    match precision {
        Precision::Float => write_channels(path, image, |position: files::Vec2<usize>| pixel(position).into()),
        Precision::Half => {
            let overflows = |value: &f32| value.is_finite() && f16::from_f32(*value).is_infinite();
            if let Some(place) = image.pixels.iter().position(|pixel| pixel.iter().any(overflows)) {
                let (x, y) = (place % image.width, place / image.width);
                return Err(failure(path, format!("pixel ({x}, {y}) is beyond 65504, the largest half float; write 32-bit floats")));
            }
            write_channels(path, image, |position: files::Vec2<usize>| pixel(position).map(f16::from_f32).into())
        }
    }
}

fn write_channels<S: files::IntoSample>(
    path: &Path,
    image: &Image,
    pixel: impl Fn(files::Vec2<usize>) -> (S, S, S) + Sync,
) -> Result<(), MeasureError> {
    let picture = files::Image::from_channels((image.width, image.height), files::SpecificChannels::rgb(pixel));
    replace_file(path, |file| picture.write().to_buffered(file).map_err(|error| error.to_string()))
}

/// Writes an 8-bit picture; `rgba` holds sRGB-encoded colours and alpha, row 0 at the top.
pub fn write_png(path: &Path, width: u32, height: u32, rgba: &[u8]) -> Result<(), MeasureError> {
    let bytes = (u64::from(width) * u64::from(height)).checked_mul(4);
    if rgba.is_empty() || bytes != Some(rgba.len() as u64) {
        return Err(failure(path, format!("{} bytes are no picture of {width} x {height} pixels of 4 bytes", rgba.len())));
    }
    replace_file(path, |file| {
        let encoder = image::codecs::png::PngEncoder::new(file);
        image::ImageEncoder::write_image(encoder, rgba, width, height, image::ExtendedColorType::Rgba8).map_err(|error| error.to_string())
    })
}

/// Gives a file new contents through a temporary file in the same folder, renamed when all is written: readers see the old file or the new one, and
/// a failure leaves the old one untouched and nothing beside it. Links and rights are respected as [`lobelia_base::replace_file`] says.
pub fn replace_file<F>(path: &Path, write: F) -> Result<(), MeasureError>
where
    F: FnOnce(&mut (dyn WriteSeek + '_)) -> Result<(), String>,
{
    lobelia_base::replace_file(path, |file| {
        let mut buffered = BufWriter::new(file);
        write(&mut buffered)?;
        buffered.flush().map_err(|error| error.to_string())
    })
    .map_err(|error| failure(path, format!("cannot be written: {error}")))
}

/// A place that bytes can be written to in any order.
pub trait WriteSeek: Write + Seek {}
impl<T: Write + Seek> WriteSeek for T {}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn picture() -> Image {
        let pixels = (0..15).map(|index| [index as f32 * 0.37, 1e-6 * index as f32, 65504.0]).collect();
        Image { width: 5, height: 3, pixels }
    }

    fn files_in(folder: &Path) -> usize {
        std::fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn comes_back_bit_for_bit_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_exr(&path, &picture()).unwrap();
        assert_eq!(read_exr(&path).unwrap(), picture());
        let turned = Image { pixels: picture().pixels.into_iter().rev().collect(), ..picture() };
        write_exr(&path, &turned).unwrap();
        assert_eq!(read_exr(&path).unwrap(), turned, "it replaces what was there");
        assert_eq!(files_in(folder.path()), 1);
    }

    #[test]
    fn half_floats_round_to_nearest() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("half.exr");
        write_exr_with(&path, &picture(), Precision::Half).unwrap();
        let back = read_exr(&path).unwrap();
        let rounded = picture().pixels.iter().map(|pixel| pixel.map(|value| f16::from_f32(value).to_f32())).collect();
        assert_eq!(back, Image { pixels: rounded, ..picture() });
        assert_ne!(back, picture(), "16 bits do not hold all of it");
    }

    #[test]
    fn what_half_floats_cannot_hold_is_refused_by_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("half.exr");
        let mut bright = picture();
        bright.pixels[7][1] = 65520.0;
        let refused = write_exr_with(&path, &bright, Precision::Half).unwrap_err().to_string();
        assert!(refused.contains("half.exr") && refused.contains("pixel (2, 1)"), "{refused}");
        assert_eq!(files_in(folder.path()), 0);
        write_exr(&path, &bright).unwrap();
        // The largest that still rounds down.
        bright.pixels[7][1] = 65519.0;
        write_exr_with(&path, &bright, Precision::Half).unwrap();
        assert_eq!(read_exr(&path).unwrap().pixels[7][1], 65504.0);
    }

    #[test]
    fn a_png_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let rgba: Vec<u8> = (0..24).map(|index| index * 10).collect();
        write_png(&path, 3, 2, &rgba).unwrap();
        let back = image::open(&path).unwrap();
        assert_eq!((back.width(), back.height(), back.color()), (3, 2, image::ColorType::Rgba8));
        assert_eq!(back.to_rgba8().into_raw(), rgba);
        assert_eq!(files_in(folder.path()), 1);
        for (width, height) in [(2, 2), (0, 0), (u32::MAX, u32::MAX)] {
            assert!(write_png(&path, width, height, &rgba).is_err());
        }
    }

    #[test]
    fn a_layer_is_named_after_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("layers.exr");
        let channels = ["Beauty.R", "Beauty.G", "Beauty.B", "Albedo.R", "Albedo.G", "Albedo.B"];
        let list =
            channels.iter().zip(1..).map(|(name, value)| files::AnyChannel::new(*name, files::FlatSamples::F32(vec![value as f32; 2])));
        let channels = files::AnyChannels::sort(list.collect());
        files::Image::from_channels((2, 1), channels).write().to_file(&path).unwrap();
        let read = |layer: &str| read_exr(&folder.path().join(format!("layers.exr{layer}")));
        assert_eq!(read("#Albedo").unwrap().pixels, [[4.0, 5.0, 6.0]; 2]);
        assert_eq!(read("#Beauty").unwrap(), Image { width: 2, height: 1, pixels: vec![[1.0, 2.0, 3.0]; 2] });
        // The whole picture, by its name.
        assert_eq!(read("").unwrap(), read("#Beauty").unwrap());
        let message = read("#Betty").unwrap_err().to_string();
        assert!(message.contains("layers.exr: it has no layer `Betty`") && message.contains("`Albedo`, `Beauty`"), "{message}");
        assert!(read_exr(&folder.path().join("none.exr#Beauty")).unwrap_err().to_string().contains("none.exr"));
    }

    #[test]
    fn what_is_no_picture_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("b.exr");
        std::fs::write(&path, b"not a picture").unwrap();
        assert!(read_exr(&path).unwrap_err().to_string().contains("b.exr"));
        std::fs::write(&path, b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 7\n").unwrap();
        assert!(read_exr(&path).unwrap_err().to_string().contains("b.exr: it is a Git LFS pointer"));
        write_png(&path, 1, 1, &[7; 4]).unwrap();
        let refused = read_exr(&path).unwrap_err().to_string();
        assert!(refused.contains("cannot be read as an OpenEXR or Radiance HDR picture: it is a PNG picture"), "{refused}");
        assert!(read_exr(&folder.path().join("missing.exr")).is_err());
        write_exr(&path, &picture()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in [4, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(read_exr(&path).is_err(), "cut to {length} of {} bytes", whole.len());
        }
        assert!(write_exr(&path, &Image { width: 4, ..picture() }).unwrap_err().to_string().contains("15 pixels"));
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.txt");
        std::fs::write(&path, "old").unwrap();
        let failed = replace_file(&path, |file| {
            file.write_all(b"half of the new").unwrap();
            Err("the disk is full".into())
        });
        assert!(failed.unwrap_err().to_string().contains("the disk is full"));
        assert_eq!((std::fs::read_to_string(&path).unwrap().as_str(), files_in(folder.path())), ("old", 1));
        assert!(write_exr(&folder.path().join("missing").join("a.exr"), &picture()).is_err());
    }

    /// Others may read a picture as they may any new file.
    #[cfg(unix)]
    #[test]
    fn rights_are_those_of_any_new_file() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let rights = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
        std::fs::write(folder.path().join("plain"), "").unwrap();
        replace_file(&folder.path().join("replaced"), |_| Ok(())).unwrap();
        assert_eq!(rights("replaced"), rights("plain"));
    }
}
