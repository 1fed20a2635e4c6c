//! Meshes that joints and morph targets move, posed on the CPU at the scene's time.
//!
//! Morph targets come first, joints after them (glTF 2.0, section 3.7.3). A skinned mesh ignores the transform of its node: joints put its vertices
//! into the world. The posed copy is kept in a frame near its first vertex, so that 32-bit floats are as precise far from the world's origin as near it.

use crate::{Mesh, TextureRef, tangents};
use glam::{DMat3, DMat4, DVec3, DVec4, Vec3};
use std::sync::Arc;

/// What one morph target adds for a weight of 1. Arrays are empty, or have one element per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Target {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec3>,
}

/// Which joints move a vertex, and how much: as many pairs for each vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Influences {
    pub per_vertex: usize,
    pub joints: Vec<u32>,
    /// Not negative; those of a vertex add up to 1.
    pub weights: Vec<f32>,
}

/// A mesh as the file has it, and what can move it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rest {
    pub mesh: Mesh,
    pub targets: Vec<Target>,
    pub influences: Option<Influences>,
    /// The file has no normals: every triangle gets its own, after it has been moved.
    pub flat: bool,
    /// The normal map that tangents are computed for, if they are computed rather than read.
    pub normal_map: Option<TextureRef>,
}

/// Joints, as places in the node tree, and what takes vertices from the mesh to each.
#[derive(Clone, Debug)]
pub(crate) struct Skin {
    pub joints: Vec<usize>,
    pub inverse_bind: Vec<DMat4>,
}

/// A posed copy of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Pose {
    /// Index into the scene's meshes: where the copy is.
    pub mesh: usize,
    pub rest: usize,
    pub skin: Option<usize>,
    /// The node whose animated weights count.
    pub node: usize,
    /// Weights of the morph targets where no animation drives them, one for each.
    pub weights: Vec<f64>,
    /// Weights and joint matrices of the pose that the copy has.
    pub has: Option<(Vec<f64>, Vec<DMat4>)>,
}

/// All posed copies of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Poses {
    pub rests: Arc<Vec<Rest>>,
    pub skins: Arc<Vec<Skin>>,
    pub poses: Vec<Pose>,
}

/// A copy that [`Poses::update`] made anew.
pub(crate) struct Posed {
    /// Index into the scene's meshes.
    pub index: usize,
    pub mesh: Mesh,
    /// Where it is in the world; `None` if it hangs on its node.
    pub world_from_local: Option<DMat4>,
}

impl Poses {
    /// The copies that differ from what they are now, for nodes that are at `world` and have animated `weights`. A pose beyond the range of floats is
    /// an `Err` with the index of its mesh, and changes nothing.
    pub fn update<'a>(&mut self, world: &[DMat4], weights: impl Fn(usize) -> Option<&'a [f64]>) -> Vec<Result<Posed, usize>> {
        let mut made = Vec::new();
        for pose in &mut self.poses {
            let rest = &self.rests[pose.rest];
            let weights = weights(pose.node).unwrap_or(&pose.weights);
            let joints = pose.skin.map_or_else(Vec::new, |skin| {
                let Skin { joints, inverse_bind } = &self.skins[skin];
                joints.iter().zip(inverse_bind).map(|(joint, inverse)| world[*joint] * *inverse).collect()
            });
            if pose.has.as_ref().is_some_and(|has| has.0 == weights && has.1 == joints) {
                continue;
            }
            let (mesh, world_from_local) = rest.posed(weights, &joints);
            let in_range =
                mesh.positions.iter().all(|position| position.is_finite()) && world_from_local.is_none_or(|matrix| matrix.is_finite());
            if in_range {
                pose.has = Some((weights.to_vec(), joints));
                made.push(Ok(Posed { index: pose.mesh, mesh, world_from_local }));
            } else {
                made.push(Err(pose.mesh));
            }
        }
        made
    }
}

impl Rest {
    /// Whether joints or morph targets can move it.
    pub fn can_move(&self) -> bool {
        !self.targets.is_empty() || self.influences.is_some()
    }

    /// How many numbers of vertices it holds and a pose reads.
    pub fn size(&self) -> usize {
        let influences = self.influences.as_ref().map_or(0, |influences| influences.per_vertex / 4);
        self.mesh.positions.len() * (1 + self.targets.len() + influences) + self.mesh.indices.len() / 3
    }

    /// Takes what moves vertices in the order of `from`, the indices of the vertices as they were.
    pub fn pick(&mut self, from: &[u32]) {
        let pick = |values: &mut Vec<Vec3>| {
            if !values.is_empty() {
                *values = from.iter().map(|vertex| values[*vertex as usize]).collect();
            }
        };
        for target in &mut self.targets {
            pick(&mut target.positions);
            pick(&mut target.normals);
            pick(&mut target.tangents);
        }
        if let Some(influences) = &mut self.influences {
            let count = influences.per_vertex;
            let row = |vertex: &u32| *vertex as usize * count..(*vertex as usize + 1) * count;
            influences.joints = from.iter().flat_map(|vertex| &influences.joints[row(vertex)]).copied().collect();
            influences.weights = from.iter().flat_map(|vertex| &influences.weights[row(vertex)]).copied().collect();
        }
    }

    /// The mesh with morph targets at `weights` and joints at matrices `joints` (world from mesh), and where it is in the world. Without joints it stays
    /// in the coordinates of its node.
    fn posed(&self, weights: &[f64], joints: &[DMat4]) -> (Mesh, Option<DMat4>) {
        let mut mesh = self.morphed(weights);
        let frame = match &self.influences {
            Some(influences) if !joints.is_empty() => Some(self.skin(&mut mesh, influences, joints)),
            _ => None,
        };
        if self.flat {
            mesh.set_flat_normals();
        }
        (mesh, frame)
    }

    fn morphed(&self, weights: &[f64]) -> Mesh {
        let mut mesh = self.mesh.clone();
        let active: Vec<(&Target, f64)> = self.targets.iter().zip(weights.iter().copied()).filter(|(_, weight)| *weight != 0.0).collect();
        if active.is_empty() {
            return mesh;
        }
        let moved = |from: Vec3, index: usize, deltas: fn(&Target) -> &[Vec3]| {
            let delta =
                |(target, weight): &(&Target, f64)| deltas(target).get(index).map_or(DVec3::ZERO, |delta| delta.as_dvec3() * *weight);
            from.as_dvec3() + active.iter().map(delta).sum::<DVec3>()
        };
        for index in 0..mesh.positions.len() {
            mesh.positions[index] = moved(mesh.positions[index], index, |target| &target.positions).as_vec3();
            let normal = moved(mesh.normals[index], index, |target| &target.normals);
            mesh.normals[index] = unit_or(normal, mesh.normals[index]);
            let tangent = mesh.tangents[index];
            let turned = moved(tangent.truncate(), index, |target| &target.tangents);
            mesh.tangents[index] = unit_or(turned, tangent.truncate()).extend(tangent.w);
        }
        if self.flat {
            mesh.set_flat_normals();
        }
        if let Some(map) = &self.normal_map {
            // Triangles share no vertices already, so that their order stays.
            tangents::generate(&mut mesh, map);
        }
        mesh
    }

    /// Moves a mesh by its joints; returns where it is then.
    fn skin(&self, mesh: &mut Mesh, influences: &Influences, joints: &[DMat4]) -> DMat4 {
        let count = influences.per_vertex;
        let blended = |vertex: usize| {
            let range = vertex * count..(vertex + 1) * count;
            let pairs = influences.joints[range.clone()].iter().zip(&influences.weights[range]);
            let mut columns = [DVec4::ZERO; 4];
            for (joint, weight) in pairs.filter(|(_, weight)| **weight > 0.0) {
                let matrix = &joints[*joint as usize];
                for (column, of_joint) in columns.iter_mut().zip([matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis]) {
                    *column += of_joint * f64::from(*weight);
                }
            }
            DMat4::from_cols(columns[0], columns[1], columns[2], columns[3])
        };
        let Some(first) = mesh.positions.first() else { return DMat4::IDENTITY };
        let anchor = blended(0).transform_point3(first.as_dvec3());
        // A skeleton that mirrors turns the triangles' winding, as an instance that mirrors does.
        let turns: f64 = joints.iter().map(|joint| DMat3::from_mat4(*joint).determinant()).map(|d| if d < 0.0 { -1.0 } else { 1.0 }).sum();
        let mirror = DVec3::new(if turns < 0.0 { -1.0 } else { 1.0 }, 1.0, 1.0);
        let world_from_local = DMat4::from_translation(anchor) * DMat4::from_scale(mirror);
        let local_from_world = DMat4::from_scale(mirror) * DMat4::from_translation(-anchor);
        for vertex in 0..mesh.positions.len() {
            let matrix = local_from_world * blended(vertex);
            let linear = DMat3::from_mat4(matrix);
            let side = if linear.determinant() < 0.0 { -1.0 } else { 1.0 };
            mesh.positions[vertex] = matrix.transform_point3(mesh.positions[vertex].as_dvec3()).as_vec3();
            // The cofactor matrix is the inverse transpose times the determinant: it exists for flattened joints too.
            let cofactor = DMat3::from_cols(
                linear.y_axis.cross(linear.z_axis),
                linear.z_axis.cross(linear.x_axis),
                linear.x_axis.cross(linear.y_axis),
            );
            mesh.normals[vertex] = unit_or(cofactor * mesh.normals[vertex].as_dvec3() * side, mesh.normals[vertex]);
            let tangent = mesh.tangents[vertex];
            let along = (linear * tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3();
            mesh.tangents[vertex] = along.extend(tangent.w * side as f32);
        }
        world_from_local
    }
}

fn unit_or(vector: DVec3, otherwise: Vec3) -> Vec3 {
    vector.try_normalize().map_or(otherwise, |unit| unit.as_vec3())
}
