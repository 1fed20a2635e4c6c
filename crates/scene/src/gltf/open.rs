//! Parsing and validating a file's structure.
//!
//! The `gltf` crate's validation trusts a few things that a hostile file can break, and panics on them; those are checked here first.

use crate::SceneError;
use gltf::json::{Root, mesh::Semantic, validation::Checked};

/// Size of a GLB header, bytes.
const GLB_HEADER: usize = 12;

/// Most problems that one message lists.
const MAX_LISTED: usize = 5;

/// The document and its binary chunk.
pub(crate) fn open(bytes: &[u8], shown: &str) -> Result<gltf::Gltf, SceneError> {
    let fail = |message: String| SceneError::content(shown, message);
    if bytes.starts_with(b"glTF") {
        check_glb_length(bytes).map_err(fail)?;
    }
    let unchecked =
        gltf::Gltf::from_slice_without_validation(bytes).map_err(|error| fail(format!("not a valid glTF 2.0 file: {error}")))?;
    check_required_extensions(unchecked.document.as_json()).map_err(fail)?;
    check_what_validation_trusts(unchecked.document.as_json()).map_err(fail)?;
    let mut root = unchecked.document.into_json();
    // What is required has been looked at; the validation knows fewer extensions.
    root.extensions_required.clear();
    let document = gltf::Document::from_json(root).map_err(|error| fail(explain(&error)))?;
    Ok(gltf::Gltf { document, blob: unchecked.blob })
}

fn check_glb_length(bytes: &[u8]) -> Result<(), String> {
    let Some(&[a, b, c, d]) = bytes.get(8..GLB_HEADER) else {
        return Err(format!("a GLB header has {GLB_HEADER} bytes, but the file ends after {}", bytes.len()));
    };
    let declared = u32::from_le_bytes([a, b, c, d]) as usize;
    if declared < GLB_HEADER || declared > bytes.len() {
        return Err(format!("its header declares {declared} bytes, but the file has {}: it is truncated or damaged", bytes.len()));
    }
    Ok(())
}

fn check_required_extensions(root: &Root) -> Result<(), String> {
    let unknown: Vec<&str> =
        root.extensions_required.iter().map(String::as_str).filter(|name| !super::extensions::is_known(name)).collect();
    if unknown.is_empty() {
        return Ok(());
    }
    let known = super::extensions::known().join(", ");
    Err(format!("it requires {}, which this program cannot read; of extensions it reads {known}", unknown.join(", ")))
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
    for (index, image) in root.images.iter().enumerate() {
        match (&image.buffer_view, &image.uri) {
            (Some(_), _) if image.mime_type.is_none() => return Err(format!("image {index}: it is in a buffer view, but has no mimeType")),
            (None, None) => return Err(format!("image {index}: it has neither a uri nor a bufferView")),
            _ => {}
        }
    }
    Ok(())
}

fn explain(error: &gltf::Error) -> String {
    let gltf::Error::Validation(problems) = error else { return format!("not a valid glTF 2.0 file: {error}") };
    let mut listed: Vec<String> = problems.iter().take(MAX_LISTED).map(|(path, problem)| format!("{path}: {problem}")).collect();
    if problems.len() > MAX_LISTED {
        listed.push(format!("and {} more", problems.len() - MAX_LISTED));
    }
    format!("not a valid glTF 2.0 file: {}", listed.join("; "))
}
