//! The hierarchy, as the device reads it.

use lobelia_scene::Triangle;
use obvhs::{BvhBuildParams, bvh2::Bvh2, bvh2::builder::build_bvh2_from_tris};
use std::time::Duration;

/// Nodes and triangles, four floats a row.
///
/// A node is two rows: `min, skip` and `max, leaf`. `skip` (bits of an integer) is the node to go on with when this one is missed; `leaf` is 0 for inner
/// nodes, else `first triangle * 16 + count`. The node that follows an inner node that is hit is simply the next. A triangle is three rows: a
/// corner and two edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hierarchy {
    /// Two rows a node.
    pub nodes: Vec<[f32; 4]>,
    /// Three rows a triangle.
    pub triangles: Vec<[f32; 4]>,
}

/// Most triangles of a leaf.
const MAX_LEAF: u32 = 4;

impl Hierarchy {
    /// Builds the hierarchy. An empty scene gives one that no ray hits.
    pub fn build(triangles: &[Triangle]) -> Self {
        let corners: Vec<obvhs::triangle::Triangle> = triangles
            .iter()
            .map(|triangle| {
                let [v0, v1, v2] = triangle.positions.map(glam::Vec3A::from);
                obvhs::triangle::Triangle { v0, v1, v2 }
            })
            .collect();
        let mut out = Self::default();
        if !corners.is_empty() {
            let params = BvhBuildParams { max_prims_per_leaf: MAX_LEAF, ..BvhBuildParams::medium_build() };
            let tree = build_bvh2_from_tris(&corners, params, &mut Duration::default());
            out.lay_out(&tree, triangles);
        }
        if out.nodes.is_empty() {
            // Bounds that nothing can be inside of.
            out.nodes = vec![[1e30, 1e30, 1e30, f32::from_bits(1)], [-1e30, -1e30, -1e30, 0.0]];
        }
        if out.triangles.is_empty() {
            out.triangles = vec![[0.0; 4]; 3];
        }
        out
    }

    /// Depth-first, without recursion: trees of degenerate scenes can be deep.
    fn lay_out(&mut self, tree: &Bvh2, triangles: &[Triangle]) {
        enum Step {
            Enter(usize),
            /// Sets the skip link of the node at this position: its subtree is complete.
            Close(usize),
        }
        let mut open = vec![Step::Enter(0)];
        while let Some(step) = open.pop() {
            match step {
                Step::Close(position) => self.nodes[2 * position][3] = f32::from_bits((self.nodes.len() / 2) as u32),
                Step::Enter(index) => {
                    let node = &tree.nodes[index];
                    let position = self.nodes.len() / 2;
                    let (min, max) = (node.aabb().min, node.aabb().max);
                    let first = node.first_index as usize;
                    let leaf = if node.prim_count > 0 { self.add_leaf(tree, triangles, first, node.prim_count as usize) } else { 0 };
                    self.nodes.push([min.x, min.y, min.z, 0.0]);
                    self.nodes.push([max.x, max.y, max.z, f32::from_bits(leaf)]);
                    open.push(Step::Close(position));
                    if node.prim_count == 0 {
                        open.push(Step::Enter(first + 1));
                        open.push(Step::Enter(first));
                    }
                }
            }
        }
    }

    fn add_leaf(&mut self, tree: &Bvh2, triangles: &[Triangle], first: usize, count: usize) -> u32 {
        let start = self.triangles.len() / 3;
        for place in first..first + count {
            let [a, b, c] = triangles[tree.primitive_indices[place] as usize].positions;
            let (ab, ac) = (b - a, c - a);
            self.triangles.extend([[a.x, a.y, a.z, 0.0], [ab.x, ab.y, ab.z, 0.0], [ac.x, ac.y, ac.z, 0.0]]);
        }
        (start * 16 + count) as u32
    }
}
