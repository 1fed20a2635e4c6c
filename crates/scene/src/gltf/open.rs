//! From a file's bytes to a document that can be walked.
//!
//! A file is read for what it draws: what nothing drawn reaches is replaced by a harmless stand-in before anything is validated ([`reach`]), and what is
//! only rounded is clamped ([`round`]). The `gltf` crate's validation trusts a few things that a hostile file can break, and panics on them; those are
//! checked here first.

use super::{extensions, reach, round};
use crate::SceneError;
use gltf::json::{
    Path, Root,
    mesh::Semantic,
    validation::{Checked, Error as Problem, Validate},
};
use serde_json::Value;

/// Size of a GLB header, bytes.
const GLB_HEADER: usize = 12;

/// Most problems that one message lists.
const MAX_LISTED: usize = 5;

/// A file, taken apart.
pub(crate) struct Opened {
    /// The document of what is drawn; its binary chunk is taken out.
    pub gltf: gltf::Gltf,
    /// The binary chunk.
    pub blob: Option<Vec<u8>>,
    /// What the document does not hold.
    pub raw: reach::Raw,
    /// What is not read or not as it stands.
    pub warnings: Vec<String>,
}

/// Opens a file; with `allow`, extensions that are required and cannot be read are a warning.
pub(crate) fn open(bytes: &[u8], shown: &str, allow: bool) -> Result<Opened, SceneError> {
    open_or_tell(bytes, allow).map_err(|message| SceneError::content(shown, message))
}

fn open_or_tell(bytes: &[u8], allow: bool) -> Result<Opened, String> {
    let (json, blob) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
    let text = lobelia_files::text(json).map_err(|error| match error {
        lobelia_files::NoText::Other(what) => what,
        error @ lobelia_files::NoText::NotUtf8 { .. } => {
            let what = lobelia_files::describe(json).unwrap_or_else(|| error.to_string());
            format!("not a valid glTF 2.0 file: {what}")
        }
    })?;
    // Chunks are padded, by some writers with zeros.
    let mut root: Value = serde_json::from_str(
        text.trim_end_matches(|character: char| character == '\0' || character.is_ascii_whitespace()),
    )
    .map_err(|error| {
        let what = if text.trim_start().starts_with('{') { None } else { lobelia_files::describe(text.as_bytes()) };
        format!("not a valid glTF 2.0 file: {}", what.unwrap_or_else(|| error.to_string()))
    })?;
    let mut warnings = extensions::check(&root, allow)?;
    warnings.extend(round::round(&mut root));
    let (raw, words) = reach::reduce(&mut root);
    warnings.extend(words);
    let root: Root = serde_json::from_value(root).map_err(|error| format!("not a valid glTF 2.0 file: {error}"))?;
    check_what_validation_trusts(&root)?;
    validate(&root)?;
    let gltf = gltf::Gltf { document: gltf::Document::from_json_without_validation(root), blob: None };
    Ok(Opened { gltf, blob, raw, warnings })
}

/// The JSON and the binary chunk of a GLB container; chunks of other kinds are skipped, as glTF 2.0 asks in section 4.4.3.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<Vec<u8>>), String> {
    let word = |at: usize| bytes.get(at..at + 4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let (Some(version), Some(declared)) = (word(4), word(8)) else {
        return Err(format!("a GLB header has {GLB_HEADER} bytes, but the file ends after {}", bytes.len()));
    };
    if version != 2 {
        return Err(format!("not a valid glTF 2.0 file: unsupported version {version}"));
    }
    let declared = declared as usize;
    if declared < GLB_HEADER || declared > bytes.len() {
        return Err(format!(
            "its header declares {declared} bytes, but the file has {}: it is truncated or damaged, as by a download that ended early",
            bytes.len()
        ));
    }
    let (mut json, mut blob) = (None, None);
    let mut at = GLB_HEADER;
    while let (Some(length), Some(kind)) = (word(at), bytes.get(at + 4..at + 8)) {
        if at >= declared {
            break;
        }
        let end = (at + 8).checked_add(length as usize).filter(|end| *end <= bytes.len());
        let end =
            end.ok_or_else(|| format!("its chunk at byte {at} declares {length} bytes, which are not there: it is truncated or damaged"))?;
        let chunk = &bytes[at + 8..end];
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if blob.is_none() => blob = Some(chunk.to_vec()),
            _ => {}
        }
        at = end.next_multiple_of(4);
    }
    Ok((json.ok_or("not a valid glTF 2.0 file: a GLB container without a JSON chunk")?, blob))
}

fn check_what_validation_trusts(root: &Root) -> Result<(), String> {
    for (mesh_index, mesh) in root.meshes.iter().enumerate() {
        for (primitive_index, primitive) in mesh.primitives.iter().enumerate() {
            let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions)).map(|index| index.value());
            if let Some(index) = position.filter(|index| *index >= root.accessors.len()) {
                return Err(format!(
                    "mesh {mesh_index}, primitive {primitive_index}: POSITION is accessor {index}, but there are {} accessors",
                    root.accessors.len()
                ));
            }
        }
    }
    for (animation_index, animation) in root.animations.iter().enumerate() {
        for (channel_index, channel) in animation.channels.iter().enumerate() {
            let at = format!("animation {animation_index}, channel {channel_index}");
            let node = channel.target.node.value();
            if node >= root.nodes.len() {
                return Err(format!("{at}: it moves node {node}, but there are {} nodes", root.nodes.len()));
            }
            if channel.target.path == Checked::Invalid {
                return Err(format!("{at}: its path is none of translation, rotation, scale, weights"));
            }
        }
    }
    for (index, camera) in root.cameras.iter().enumerate() {
        let (kind, there) = match camera.type_ {
            Checked::Valid(gltf::json::camera::Type::Perspective) => ("perspective", camera.perspective.is_some()),
            Checked::Valid(gltf::json::camera::Type::Orthographic) => ("orthographic", camera.orthographic.is_some()),
            Checked::Invalid => continue,
        };
        if !there {
            return Err(format!("camera {index}: its type is {kind}, but it has no `{kind}`"));
        }
    }
    Ok(())
}

/// The crate's validation, but for what is looked at elsewhere or not needed: extensions, accessors without a view, and the range of positions.
fn validate(root: &Root) -> Result<(), String> {
    let mut problems = Vec::new();
    root.validate(root, Path::new, &mut |path, problem| {
        let path = path();
        let place = path.as_str();
        let needless = place.starts_with("extensionsRequired")
            || (problem == Problem::Missing && place.starts_with("accessors[") && place.ends_with("].bufferView"))
            || (problem != Problem::IndexOutOfBounds && place.contains("POSITION"));
        if !needless {
            problems.push(format!("{place}: {problem}"));
        }
    });
    if problems.is_empty() {
        return Ok(());
    }
    if problems.len() > MAX_LISTED {
        let more = problems.len() - MAX_LISTED;
        problems.truncate(MAX_LISTED);
        problems.push(format!("and {more} more"));
    }
    Err(format!("not a valid glTF 2.0 file: {}", problems.join("; ")))
}
