//! `EXT_mesh_gpu_instancing`: many instances of a mesh at one node.

use super::Loader;
use crate::SceneError;
use glam::{DMat4, DQuat, DVec3, DVec4};
use serde_json::Value;

/// Most instances at one node: the storage buffer that holds them is full sooner.
const MAX_INSTANCES: usize = 1 << 21;

impl Loader<'_> {
    /// Where the instances of a node's mesh are, in the node's coordinates: one at the node itself unless the node lists others.
    pub(super) fn instances(&mut self, gltf: &gltf::Gltf, node: &gltf::Node<'_>) -> Result<Vec<DMat4>, SceneError> {
        let Some(extension) = node.extension_value("EXT_mesh_gpu_instancing") else { return Ok(vec![DMat4::IDENTITY]) };
        let at = format!("node {}: EXT_mesh_gpu_instancing", node.index());
        if node.skin().is_some() {
            self.warn("instances of skinned meshes are not drawn: joints put the mesh into the world, once");
            return Ok(vec![DMat4::IDENTITY]);
        }
        let attributes = extension.get("attributes").and_then(Value::as_object);
        let attributes = attributes.ok_or_else(|| self.fail(format!("{at}: it has no attributes")))?;
        let mut count = None;
        let mut numbers = |name: &str, width: usize| -> Result<Option<Vec<f64>>, SceneError> {
            let Some(index) = attributes.get(name) else { return Ok(None) };
            let accessor = index.as_u64().and_then(|index| gltf.accessors().nth(usize::try_from(index).ok()?));
            let accessor = accessor.ok_or_else(|| self.fail(format!("{at}: {name} is accessor {index}, which is not there")))?;
            if accessor.count() > MAX_INSTANCES {
                return Err(self.fail(format!("{at}: {} instances; at most {MAX_INSTANCES} are read", accessor.count())));
            }
            let numbers = self.buffers.floats(self.shown, &accessor, width)?;
            if let Some(place) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(self.fail(format!("{at}: {name} of instance {} is {}", place / width, numbers[place])));
            }
            let rows = numbers.len() / width;
            match count.replace(rows) {
                Some(other) if other != rows => Err(self.fail(format!("{at}: {name} has {rows} elements, another attribute has {other}"))),
                _ => Ok(Some(numbers.into_iter().map(f64::from).collect())),
            }
        };
        let (translations, rotations, scales) = (numbers("TRANSLATION", 3)?, numbers("ROTATION", 4)?, numbers("SCALE", 3)?);
        let Some(count) = count else { return Ok(vec![DMat4::IDENTITY]) };
        let triple = |values: &Option<Vec<f64>>, index: usize, otherwise: DVec3| {
            values.as_ref().map_or(otherwise, |values| DVec3::from_slice(&values[3 * index..]))
        };
        (0..count)
            .map(|index| {
                let rotation = match &rotations {
                    None => DQuat::IDENTITY,
                    Some(values) => {
                        let turn = DVec4::from_slice(&values[4 * index..]);
                        let turn = turn.try_normalize().ok_or_else(|| self.fail(format!("{at}: ROTATION of instance {index} is zero")))?;
                        DQuat::from_vec4(turn)
                    }
                };
                let (scale, translation) = (triple(&scales, index, DVec3::ONE), triple(&translations, index, DVec3::ZERO));
                Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation))
            })
            .collect()
    }
}
