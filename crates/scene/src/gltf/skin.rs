//! Skins, and the posed copies that skinned and morphed nodes get.

use super::{Loader, MAX_MESH_ELEMENTS};
use crate::{
    SceneError,
    pose::{Pose, Skin},
};
use glam::{DMat4, DVec4};
use std::collections::HashMap;

/// What makes two posed copies of a mesh the same: the mesh, the skin, and what the weights of the morph targets are: the node that animates them, or their
/// bits.
pub(super) type PoseKey = (usize, Option<usize>, Option<usize>, Vec<u64>);

impl Loader<'_> {
    /// Reads all skins. `place` gives the place in the node tree of a node of the file.
    pub(super) fn skins(&mut self, gltf: &gltf::Gltf, place: &HashMap<usize, usize>) -> Result<(), SceneError> {
        for skin in gltf.skins() {
            let at = format!("skin {}", skin.index());
            // A joint that no scene and no node holds stands at its own transform; all joints are in the tree.
            let joints: Vec<usize> = skin.joints().filter_map(|joint| place.get(&joint.index()).copied()).collect();
            let inverse_bind = match skin.inverse_bind_matrices() {
                None => vec![DMat4::IDENTITY; joints.len()],
                Some(accessor) => {
                    let numbers = self.buffers.floats(self.shown, &accessor, 16)?;
                    if let Some(place) = numbers.iter().position(|number| !number.is_finite()) {
                        return Err(self.fail(format!("{at}: inverse bind matrix {} holds {}", place / 16, numbers[place])));
                    }
                    numbers.chunks_exact(16).map(matrix).collect()
                }
            };
            if inverse_bind.len() < joints.len() {
                return Err(self.fail(format!("{at}: {} joints, but only {} inverse bind matrices", joints.len(), inverse_bind.len())));
            }
            self.skins.push(Skin { joints, inverse_bind });
        }
        Ok(())
    }

    /// The mesh for a primitive at a node whose joints or morph targets move it: a posed copy, or one that is there already.
    pub(super) fn posed_mesh(
        &mut self,
        rest: usize,
        node: usize,
        skin: Option<usize>,
        written_weights: &[f32],
        at: &str,
    ) -> Result<usize, SceneError> {
        let found = &self.rests[rest];
        let skin = skin.filter(|_| found.influences.is_some());
        if let (Some(skin), Some(influences)) = (skin, &found.influences) {
            let joints = self.skins[skin].joints.len();
            if let Some(joint) = influences.joints.iter().find(|joint| **joint as usize >= joints) {
                return Err(self.fail(format!("{at}: a vertex is moved by joint {joint}, but skin {skin} has {joints} joints")));
            }
        }
        let targets = found.targets.len();
        if !written_weights.is_empty() && written_weights.len() != targets {
            self.warn(format!("{at}: {targets} morph targets, but {} weights; those that are missing are 0", written_weights.len()));
        }
        let found = &self.rests[rest];
        if let Some(weight) = written_weights.iter().find(|weight| !weight.is_finite()) {
            return Err(self.fail(format!("{at}: a weight of its morph targets is {weight}")));
        }
        let animated = targets > 0 && self.scene.nodes.weight_channels.iter().any(|channel| channel.node == node);
        let weights: Vec<f64> = (0..targets).map(|target| written_weights.get(target).map_or(0.0, |weight| f64::from(*weight))).collect();
        let key = (rest, skin, animated.then_some(node), weights.iter().map(|weight| weight.to_bits()).collect());
        if let Some(known) = self.posed.get(&key) {
            return Ok(*known);
        }
        let moves = skin.is_some() || animated || weights.iter().any(|weight| *weight != 0.0);
        let mut mesh = found.mesh.clone();
        self.mesh_elements += found.size();
        if self.mesh_elements > MAX_MESH_ELEMENTS {
            return Err(self.fail(format!("{at}: the meshes have more than {MAX_MESH_ELEMENTS} vertices and triangles")));
        }
        if !moves {
            mesh.drop_degenerate();
        }
        self.meshes.push(mesh);
        let mesh = self.meshes.len() - 1;
        if moves {
            self.poses.push(Pose { mesh, rest, skin, node, weights, has: None });
        }
        self.posed.insert(key, mesh);
        Ok(mesh)
    }
}

fn matrix(numbers: &[f32]) -> DMat4 {
    let column = |column: usize| DVec4::from_array([0, 1, 2, 3].map(|row| f64::from(numbers[4 * column + row])));
    // What is written in the last row is 0, 0, 0, 1, or means nothing.
    let affine = |column: DVec4, last: f64| column.truncate().extend(last);
    DMat4::from_cols(affine(column(0), 0.0), affine(column(1), 0.0), affine(column(2), 0.0), affine(column(3), 1.0))
}
