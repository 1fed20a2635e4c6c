//! The hierarchy, as the device reads it.

use glam::Vec3A;
use lobelia_scene::Triangle;
use obvhs::{BvhBuildParams, bvh2::Bvh2, bvh2::builder::build_bvh2_from_tris};
use std::time::Duration;

/// Nodes and triangles, four words a row.
///
/// A node is two rows: `min, skip` and `max, leaf`, corners as the bits of floats. `skip` is the node to go on with when this one is missed; `leaf` is 0
/// for inner nodes, else `first triangle * 16 + count`. The node that follows an inner node that is hit is simply the next. A triangle is three rows: a
/// corner and two edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hierarchy {
    /// Two rows a node.
    pub nodes: Vec<[u32; 4]>,
    /// Three rows a triangle.
    pub triangles: Vec<[f32; 4]>,
}

/// Most triangles of a leaf.
const MAX_LEAF: u32 = 4;

fn row(corner: Vec3A, word: u32) -> [u32; 4] {
    let [x, y, z] = corner.to_array().map(f32::to_bits);
    [x, y, z, word]
}

impl Hierarchy {
    /// Builds the hierarchy. An empty scene gives one that no ray hits.
    pub fn build(triangles: &[Triangle]) -> Self {
        let corners: Vec<obvhs::triangle::Triangle> = triangles
            .iter()
            .map(|triangle| {
                let [v0, v1, v2] = triangle.positions.map(Vec3A::from);
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
            out.nodes = vec![row(Vec3A::splat(1e30), 1), row(Vec3A::splat(-1e30), 0)];
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
                Step::Close(position) => self.nodes[2 * position][3] = (self.nodes.len() / 2) as u32,
                Step::Enter(index) => {
                    let node = &tree.nodes[index];
                    let position = self.nodes.len() / 2;
                    let first = node.first_index as usize;
                    let leaf = if node.prim_count > 0 { self.add_leaf(tree, triangles, first, node.prim_count as usize) } else { 0 };
                    self.nodes.extend([row(node.aabb().min, 0), row(node.aabb().max, leaf)]);
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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn soup(count: usize) -> Vec<Triangle> {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut point = || Vec3::new(next(), next(), next());
        (0..count).map(|_| Triangle { positions: [point(), point(), point()], instance: 0, material: 0 }).collect()
    }

    /// Walks as the device does when every box is hit, or when none is.
    fn walk(hierarchy: &Hierarchy, hit: bool) -> Vec<u32> {
        let (mut index, mut leaves) = (0, Vec::new());
        while index < hierarchy.nodes.len() / 2 {
            let next = if hit { index + 1 } else { hierarchy.nodes[2 * index][3] as usize };
            assert!(next > index, "a link that leads back would never end");
            leaves.extend(hit.then_some(hierarchy.nodes[2 * index + 1][3]).filter(|leaf| *leaf > 0));
            index = next;
        }
        leaves
    }

    #[test]
    fn every_triangle_is_in_one_leaf_and_in_its_boxes() {
        for count in [1, 2, 5, 400] {
            let triangles = soup(count);
            let hierarchy = Hierarchy::build(&triangles);
            let leaves = walk(&hierarchy, true);
            assert!(walk(&hierarchy, false).is_empty());
            let ranges: Vec<_> = leaves.iter().map(|leaf| (leaf / 16)..(leaf / 16 + leaf % 16)).collect();
            assert!(ranges.iter().all(|range| !range.is_empty() && range.len() as u32 <= MAX_LEAF));
            assert_eq!(ranges.into_iter().flatten().collect::<Vec<_>>(), (0..count as u32).collect::<Vec<_>>(), "in order, each once");
            assert_eq!(hierarchy.triangles.len(), 3 * count);
            for node in 0..hierarchy.nodes.len() / 2 {
                let [low, high] = [0, 1].map(|side| {
                    let [x, y, z, _] = hierarchy.nodes[2 * node + side];
                    Vec3::from_array([x, y, z].map(f32::from_bits))
                });
                let inside = (node..hierarchy.nodes[2 * node][3] as usize).map(|below| hierarchy.nodes[2 * below + 1][3]);
                for triangle in inside.flat_map(|leaf| (leaf / 16)..(leaf / 16 + leaf % 16)) {
                    let rows = &hierarchy.triangles[3 * triangle as usize..][..3];
                    let [a, ab, ac] = [0, 1, 2].map(|row| Vec3::from_slice(&rows[row][..3]));
                    for corner in [a, a + ab, a + ac] {
                        assert!(
                            corner.cmpge(low - 1e-6).all() && corner.cmple(high + 1e-6).all(),
                            "{corner} is not within {low} and {high}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn an_empty_scene_has_a_box_that_nothing_enters() {
        let hierarchy = Hierarchy::build(&[]);
        assert_eq!((walk(&hierarchy, true), hierarchy.triangles.len()), (vec![], 3));
        assert!(f32::from_bits(hierarchy.nodes[0][0]) > f32::from_bits(hierarchy.nodes[1][0]));
    }
}
