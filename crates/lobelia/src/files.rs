//! Files that the program writes, whole or not at all.

use crate::failure::Failure;
use lobelia::{
    graph::{Part, PartData, PartKind},
    measure::Image,
};
use std::path::Path;

/// Writes `path` whole or not at all, see [`lobelia_base::replace_file`].
pub fn atomically(path: &Path, write: impl FnOnce(&mut std::fs::File) -> Result<(), String>) -> Result<(), Failure> {
    lobelia_base::replace_file(path, write).map_err(|error| Failure::Run(format!("{}: {error}", path.display())))
}

/// What a file name's ending asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// 8-bit sRGB picture.
    Png,
    /// Linear radiance as half-float RGB.
    Exr,
    /// NumPy arrays, one per part.
    Npz,
}

/// The kind of a file to write, or which endings there are.
pub fn kind_of(path: &Path, allowed: &[Kind]) -> Result<Kind, Failure> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    let kind = match ending.as_str() {
        "png" => Some(Kind::Png),
        "exr" => Some(Kind::Exr),
        "npz" => Some(Kind::Npz),
        _ => None,
    };
    kind.filter(|kind| allowed.contains(kind)).ok_or_else(|| {
        let names = allowed.iter().map(|kind| format!(".{}", format!("{kind:?}").to_lowercase())).collect::<Vec<_>>().join(", ");
        Failure::Input(format!("{}: this cannot be written in that format; name the file with {names}", path.display()))
    })
}

/// Refuses a goal that could not be written before any work is done: a folder, a read-only file, a place in a folder that is not there.
pub fn check_goal(path: &Path) -> Result<(), Failure> {
    lobelia_base::check_goal(path).map_err(|error| Failure::Input(format!("{}: {error}", path.display())))
}

/// Writes an 8-bit RGBA picture.
pub fn write_png(path: &Path, extent: [u32; 2], rgba: &[u8]) -> Result<(), Failure> {
    atomically(path, |file| {
        let encoder = image::codecs::png::PngEncoder::new(std::io::BufWriter::new(file));
        image::ImageEncoder::write_image(encoder, rgba, extent[0], extent[1], image::ExtendedColorType::Rgba8)
            .map_err(|error| error.to_string())
    })
}

/// Writes linear radiance as an sRGB picture without a tone curve, for a quick look.
pub fn write_linear_png(path: &Path, picture: &Image) -> Result<(), Failure> {
    let encode = |value: f32| (lobelia::lobes::tonemap::srgb_encode(f64::from(value).clamp(0.0, 1.0)) * 255.0).round() as u8;
    let rgba: Vec<u8> = picture.pixels.iter().flat_map(|[r, g, b]| [encode(*r), encode(*g), encode(*b), 255]).collect();
    write_png(path, [picture.width as u32, picture.height as u32], &rgba)
}

/// Writes linear radiance: channels R, G, B, 32-bit float, row 0 at the top.
pub fn write_exr(path: &Path, picture: &Image) -> Result<(), Failure> {
    lobelia::measure::write_exr(path, picture).map_err(|error| Failure::Run(error.to_string()))
}

/// Writes all parts of a resource as NumPy arrays: textures as `[layers,] height, width, channels`, buffers as 32-bit words.
pub fn write_npz(path: &Path, parts: &[(Part, PartData)]) -> Result<(), Failure> {
    atomically(path, |file| {
        let mut archive = npyz::npz::NpzWriter::new(std::io::BufWriter::new(file));
        for (part, data) in parts {
            write_array(&mut archive, part, data).map_err(|error| format!("part `{}`: {error}", part.name))?;
        }
        Ok(())
    })
}

/// Writes a radiance as a NumPy array `image` of height, width and four channels, the last of which is 1.
pub fn write_radiance_npz(path: &Path, picture: &Image) -> Result<(), Failure> {
    let values = picture.pixels.iter().flat_map(|[r, g, b]| [*r, *g, *b, 1.0]).collect();
    atomically(path, |file| {
        let mut archive = npyz::npz::NpzWriter::new(std::io::BufWriter::new(file));
        append(&mut archive, "image", &[picture.height as u64, picture.width as u64, 4], values).map_err(|error| error.to_string())
    })
}

/// Writes a layer as a NumPy array of height, width and, where there is more than one, channels.
pub fn write_layer_npz(path: &Path, name: &str, layer: &lobelia::layers::LayerImage) -> Result<(), Failure> {
    let mut dimensions = vec![u64::from(layer.extent[1]), u64::from(layer.extent[0])];
    dimensions.extend((layer.values.len() > 1).then_some(layer.values.len() as u64));
    atomically(path, |file| {
        let mut archive = npyz::npz::NpzWriter::new(std::io::BufWriter::new(file));
        append(&mut archive, name, &dimensions, layer.interleaved()).map_err(|error| error.to_string())
    })
}

type Archive<'a> = npyz::npz::NpzWriter<std::io::BufWriter<&'a mut std::fs::File>>;

fn write_array(archive: &mut Archive<'_>, part: &Part, data: &PartData) -> std::io::Result<()> {
    match data {
        PartData::Buffer(bytes) => {
            let words: Vec<u32> = bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect();
            append(archive, part.name, &[words.len() as u64], words)
        }
        PartData::Texture(layers) => {
            let PartKind::Texture(shape) = &part.kind else { return Ok(()) };
            let [width, height] = shape.extent.map(u64::from);
            let mut dimensions = if shape.array { vec![layers.len() as u64] } else { Vec::new() };
            let integers = shape.format.sample_type(None, None) == Some(wgpu::TextureSampleType::Uint);
            if integers {
                let words: Vec<u32> = layers.iter().flat_map(lobelia::graph::TextureData::to_u32).collect();
                let channels = (words.len() as u64 / (width * height * layers.len().max(1) as u64)).max(1);
                dimensions.extend([height, width, channels]);
                append(archive, part.name, &dimensions, words)
            } else {
                let channels = u64::from(shape.format.components());
                let texels = layers.iter().flat_map(|layer| layer.to_f32_rgba());
                let values: Vec<f32> = texels.flat_map(|texel| texel.into_iter().take(channels as usize)).collect();
                dimensions.extend([height, width, channels]);
                append(archive, part.name, &dimensions, values)
            }
        }
    }
}

fn append<T: npyz::AutoSerialize + Copy>(archive: &mut Archive<'_>, name: &str, dimensions: &[u64], values: Vec<T>) -> std::io::Result<()> {
    use npyz::WriterBuilder;
    let mut writer = archive.array(name, Default::default())?.default_dtype().shape(dimensions).begin_nd()?;
    writer.extend(values)?;
    writer.finish()
}
