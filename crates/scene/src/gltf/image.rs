//! Images, read when a material first samples them and decoded under a limit on what they may claim.

use super::{accessor::Buffers, read_uri};
use crate::Texture;
use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use serde_json::Value;
use std::{
    collections::HashMap,
    io::Cursor,
    path::{Path, PathBuf},
};

/// Largest side that every WebGPU device takes.
const MAX_SIDE: u32 = 8192;

/// Most bytes that decoding one image may take: 16 bits per channel at the largest size.
const MAX_ALLOCATION: u64 = 8 * (MAX_SIDE as u64) * (MAX_SIDE as u64) + (64 << 20);

/// Most texels that all images together may have: 1 GiB.
const MAX_TEXELS: u64 = 1 << 28;

const KTX2: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// The images that have been read.
pub(crate) struct Images {
    folder: Option<PathBuf>,
    /// By index in the file: where it is among `textures`, or why it is not.
    read: HashMap<usize, Result<usize, String>>,
    texels: u64,
    /// In the order in which they were first sampled.
    pub textures: Vec<Texture>,
    /// What was not read as it stands.
    pub warnings: Vec<String>,
}

impl Images {
    /// None yet; `folder` is where images of their own files lie.
    pub fn new(folder: Option<&Path>) -> Self {
        Self { folder: folder.map(Path::to_owned), read: HashMap::new(), texels: 0, textures: Vec::new(), warnings: Vec::new() }
    }

    /// The image of a texture, as an index into [`Images::textures`]: the first of those that can serve it that can be read.
    pub fn of_texture(&mut self, buffers: &Buffers, texture: usize) -> Result<usize, String> {
        let candidates = buffers.raw().texture_images.get(texture).cloned().unwrap_or_default();
        let mut failed: Vec<String> = Vec::new();
        for image in candidates {
            match self.image(buffers, image) {
                Ok(place) => {
                    if let [first, ..] = &failed[..] {
                        let warning = format!("{first}; image {image}, its fallback, is used");
                        if !self.warnings.contains(&warning) {
                            self.warnings.push(warning);
                        }
                    }
                    return Ok(place);
                }
                Err(message) => failed.push(message),
            }
        }
        Err(if failed.is_empty() { format!("texture {texture}: it has no image") } else { failed.join("; nor can its fallback: ") })
    }

    fn image(&mut self, buffers: &Buffers, index: usize) -> Result<usize, String> {
        if let Some(known) = self.read.get(&index) {
            return known.clone();
        }
        let read = self.read_image(buffers, index).map_err(|message| format!("image {index}: {message}"));
        let read = read.map(|texture| {
            self.textures.push(texture);
            self.textures.len() - 1
        });
        self.read.insert(index, read.clone());
        read
    }

    fn read_image(&mut self, buffers: &Buffers, index: usize) -> Result<Texture, String> {
        let written = buffers.raw().images.get(index).ok_or("there is no such image")?;
        let name = written.get("name").and_then(Value::as_str).map_or_else(|| format!("image {index}"), str::to_owned);
        let uri = written.get("uri").and_then(Value::as_str);
        let read;
        let (name, bytes) = match (written.get("bufferView"), uri) {
            (Some(view), _) => {
                let view = view.as_u64().and_then(|view| usize::try_from(view).ok()).ok_or("its bufferView is no index")?;
                (name, buffers.view(view)?)
            }
            (None, Some(uri)) => {
                read = read_uri(uri, self.folder.as_deref())?;
                (if uri.starts_with("data:") { format!("image {index}") } else { uri.to_owned() }, read.as_slice())
            }
            (None, None) => return Err("it has neither a uri nor a bufferView".into()),
        };
        let decoded = decode(bytes, MAX_TEXELS - self.texels).map_err(|message| format!("`{name}`: {message}"))?;
        let (width, height) = decoded.dimensions();
        self.texels += u64::from(width) * u64::from(height);
        Ok(Texture { name, width, height, rgba: decoded.into_raw() })
    }
}

fn check_size(width: u32, height: u32, texels: u64) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("it has {width} x {height} texels"));
    }
    if width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!("it has {width} x {height} texels; each side may have at most {MAX_SIDE}"));
    }
    if u64::from(width) * u64::from(height) > texels {
        return Err(format!("with its {width} x {height} texels the images have more than {MAX_TEXELS}"));
    }
    Ok(())
}

/// An image of at most `texels` texels. Its claimed size is looked at before anything is allocated.
fn decode(bytes: &[u8], texels: u64) -> Result<image::RgbaImage, String> {
    if let Some(what) = lobelia_files::stand_in(bytes) {
        return Err(what);
    }
    if bytes.starts_with(KTX2) {
        return transcode(bytes, texels);
    }
    let reader = || image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string());
    let broken = |error: image::ImageError| {
        let what = match error {
            image::ImageError::Unsupported(_) => lobelia_files::describe(bytes),
            _ => None,
        };
        let convert = match what.as_deref() {
            Some("it is an AVIF picture") => "; `npx @gltf-transform/cli png IN.glb OUT.glb --formats \"*\"` makes a file that can be read",
            _ => "",
        };
        format!("it cannot be decoded: {}{convert}", what.unwrap_or_else(|| error.to_string()))
    };
    let (width, height) = reader()?.into_dimensions().map_err(broken)?;
    check_size(width, height, texels)?;
    let mut reader = reader()?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_ALLOCATION);
    reader.limits(limits);
    Ok(reader.decode().map_err(broken)?.to_rgba8())
}

/// The finest level of a KTX2 texture of Basis Universal.
fn transcode(bytes: &[u8], texels: u64) -> Result<image::RgbaImage, String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let (Some(format), Some(width), Some(height)) = (word(12), word(20), word(24)) else {
        return Err("it cannot be decoded: its KTX2 header is cut short".into());
    };
    check_size(width, height, texels)?;
    if format != 0 {
        let convert = "`ktx encode --codec uastc IN.ktx2 OUT.ktx2` makes one, if its texels are not compressed";
        return Err(format!("it cannot be decoded: it is a KTX2 texture of Vulkan format {format}, not of Basis Universal; {convert}"));
    }
    let broken = |error: basisu::Error| format!("it cannot be decoded as a KTX2 texture of Basis Universal: {error:?}");
    let texture = Transcoder::new(bytes).map_err(broken)?;
    if !texture.supports(TargetFormat::Rgba32) {
        return Err(match texture.source_format() {
            SourceFormat::UastcHdr4x4 | SourceFormat::AstcHdr6x6 | SourceFormat::UastcHdr6x6 => {
                "it is a KTX2 texture of high dynamic range, which no material of glTF samples".into()
            }
            other => format!("it is a KTX2 texture of {other:?}, which is not read"),
        });
    }
    let rgba = texture.transcode_image(0, 0, 0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(broken)?;
    image::RgbaImage::from_raw(width, height, rgba).ok_or_else(|| "it cannot be decoded: its texels are not those of its size".into())
}
