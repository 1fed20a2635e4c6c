//! The node tree and the animations that move it.

use super::Loader;
use crate::{
    SceneError,
    animation::{Channel, Interpolation, Property, WeightChannel},
    nodes::{Node, NodeTree, Transform},
};
use glam::{DMat4, DQuat, DVec3, DVec4};
use std::collections::HashMap;

/// Most nodes that are read. Real files stay far below.
const MAX_NODES: usize = 1_000_000;

impl Loader<'_> {
    /// Builds the node tree; returns the glTF index of each of its nodes, parents first, and how many of them belong to the scene. The rest holds joints
    /// that the scene lacks.
    pub(super) fn nodes(&mut self, gltf: &gltf::Gltf) -> Result<(Vec<usize>, usize), SceneError> {
        let count = gltf.nodes().len();
        if count > MAX_NODES {
            return Err(self.fail(format!("{count} nodes; at most {MAX_NODES} are read")));
        }
        let all: Vec<gltf::Node<'_>> = gltf.nodes().collect();
        let mut parents: Vec<Option<usize>> = vec![None; count];
        for node in &all {
            for child in node.children() {
                if let Some(other) = parents[child.index()].replace(node.index()) {
                    return Err(self.fail(format!(
                        "node {}: it is a child of node {other} and of node {}; nodes must form a tree",
                        child.index(),
                        node.index()
                    )));
                }
            }
        }
        self.refuse_cycles(&parents)?;
        let scene = gltf.default_scene().or_else(|| gltf.scenes().next());
        let roots: Vec<usize> = match &scene {
            Some(scene) => scene.nodes().map(|node| node.index()).collect(),
            None => (0..count).filter(|node| parents[*node].is_none()).collect(),
        };
        if let Some(root) = roots.iter().find(|root| parents[**root].is_some()) {
            return Err(self.fail(format!("node {root}: it is a root of the scene and a child of another node")));
        }
        let mut order = Vec::new();
        let mut tree = NodeTree::default();
        let mut open: Vec<(usize, Option<usize>)> = roots.into_iter().rev().map(|root| (root, None)).collect();
        let mut placed = vec![false; count];
        let mut in_scene = None;
        let mut joints = gltf.skins().flat_map(|skin| skin.joints().map(|joint| joint.index()).collect::<Vec<_>>());
        loop {
            let Some((index, parent)) = open.pop() else {
                in_scene = in_scene.or(Some(order.len()));
                // Joints need not be in the scene that is drawn; the trees that hold them move them all the same.
                let Some(mut root) = joints.find(|joint| !placed[*joint]) else { break };
                while let Some(parent) = parents[root] {
                    root = parent;
                }
                open.push((root, None));
                continue;
            };
            if std::mem::replace(&mut placed[index], true) {
                return Err(self.fail(format!("node {index}: it is listed twice as a root")));
            }
            let transform = self.transform(&all[index])?;
            let mut children: Vec<_> = all[index].children().map(|child| (child.index(), Some(order.len()))).collect();
            children.reverse();
            open.append(&mut children);
            order.push(index);
            tree.nodes.push(Node { parent, rest: transform, now: transform });
        }
        if let Some(place) = tree.world_matrices().iter().position(|matrix| !matrix.is_finite()) {
            return Err(self.fail(format!("node {}: it and the nodes above it put it beyond the range of floats", order[place])));
        }
        self.scene.nodes = tree;
        let in_scene = in_scene.unwrap_or(order.len());
        Ok((order, in_scene))
    }

    fn refuse_cycles(&self, parents: &[Option<usize>]) -> Result<(), SceneError> {
        // 0 unseen, otherwise the walk in which a node was seen.
        let mut seen = vec![0usize; parents.len()];
        for start in 0..parents.len() {
            let walk = start + 1;
            let mut current = start;
            loop {
                if seen[current] == walk {
                    return Err(self.fail(format!("node {current}: it is its own ancestor; nodes must form a tree")));
                }
                if seen[current] != 0 {
                    break;
                }
                seen[current] = walk;
                match parents[current] {
                    Some(parent) => current = parent,
                    None => break,
                }
            }
        }
        Ok(())
    }

    fn transform(&self, node: &gltf::Node<'_>) -> Result<Transform, SceneError> {
        let transform = match node.transform() {
            gltf::scene::Transform::Matrix { matrix } => {
                Transform::Matrix(DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from))))
            }
            gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
                let rotation = DQuat::from_array(rotation.map(f64::from));
                if rotation.length_squared() <= 0.0 {
                    return Err(self.fail(format!("node {}: its rotation is the zero quaternion", node.index())));
                }
                Transform::Parts {
                    translation: DVec3::from_array(translation.map(f64::from)),
                    rotation: rotation.normalize(),
                    scale: DVec3::from_array(scale.map(f64::from)),
                }
            }
        };
        if transform.matrix().is_finite() {
            Ok(transform)
        } else {
            Err(self.fail(format!("node {}: its transform has NaN or infinite numbers", node.index())))
        }
    }

    /// Reads all animations. `place` gives the place in the node tree of a node of the file.
    pub(super) fn animations(&mut self, gltf: &gltf::Gltf, place: &HashMap<usize, usize>) -> Result<(), SceneError> {
        for animation in gltf.animations() {
            for (index, channel) in animation.channels().enumerate() {
                let Some(node) = place.get(&channel.target().node().index()) else { continue };
                let at = format!("animation {}, channel {index}", animation.index());
                if channel.target().property() == gltf::animation::Property::MorphTargetWeights {
                    let channel = self.weight_channel(&channel, *node, &at)?;
                    self.scene.nodes.weight_channels.extend(channel);
                    continue;
                }
                if let Some(channel) = self.channel(&channel, *node, &at)? {
                    self.scene.nodes.channels.push(channel);
                }
            }
        }
        Ok(())
    }

    fn channel(&mut self, channel: &gltf::animation::Channel<'_>, node: usize, at: &str) -> Result<Option<Channel>, SceneError> {
        let property = match channel.target().property() {
            gltf::animation::Property::Translation => Property::Translation,
            gltf::animation::Property::Rotation => Property::Rotation,
            gltf::animation::Property::Scale => Property::Scale,
            gltf::animation::Property::MorphTargetWeights => return Ok(None),
        };
        if matches!(self.scene.nodes.nodes[node].rest, Transform::Matrix(_)) {
            return Err(self.fail(format!("{at}: it animates a node that has a matrix")));
        }
        let sampler = channel.sampler();
        let width = if property == Property::Rotation { 4 } else { 3 };
        let numbers = self.buffers.floats(self.shown, &sampler.output(), width)?;
        let (times, interpolation) = self.keys(&sampler, &numbers, at)?;
        let per_key = per_key(interpolation);
        if numbers.len() != times.len() * width * per_key {
            return Err(self.fail(format!("{at}: {} keys do not go with {} values", times.len(), numbers.len() / width)));
        }
        let value = |numbers: &[f32]| {
            DVec4::new(numbers[0].into(), numbers[1].into(), numbers[2].into(), numbers.get(3).map_or(0.0, |w| f64::from(*w)))
        };
        let values: Vec<DVec4> = numbers.chunks_exact(width).map(value).collect();
        // Of a spline's triples only the middle one is a rotation, the others are tangents.
        let mut rotations = values.iter().skip(usize::from(per_key == 3)).step_by(per_key);
        if property == Property::Rotation && rotations.any(|rotation| *rotation == DVec4::ZERO) {
            return Err(self.fail(format!("{at}: a rotation is the zero quaternion")));
        }
        Ok(Some(Channel { node, property, interpolation, times, values }))
    }

    /// Key times and interpolation of a sampler with `numbers` for its values.
    fn keys(&self, sampler: &gltf::animation::Sampler<'_>, numbers: &[f32], at: &str) -> Result<(Vec<f32>, Interpolation), SceneError> {
        let times = self.buffers.floats(self.shown, &sampler.input(), 1)?;
        let interpolation = match sampler.interpolation() {
            gltf::animation::Interpolation::Step => Interpolation::Step,
            gltf::animation::Interpolation::Linear => Interpolation::Linear,
            gltf::animation::Interpolation::CubicSpline => Interpolation::CubicSpline,
        };
        if times.is_empty() {
            return Err(self.fail(format!("{at}: it has no keys")));
        }
        if times.iter().chain(numbers).any(|number| !number.is_finite()) || times.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(self.fail(format!("{at}: key times must rise and all numbers be finite")));
        }
        Ok((times, interpolation))
    }

    /// Weights of morph targets; `None` for a node that has none to weigh.
    fn weight_channel(
        &mut self,
        channel: &gltf::animation::Channel<'_>,
        node: usize,
        at: &str,
    ) -> Result<Option<WeightChannel>, SceneError> {
        let mesh = channel.target().node().mesh();
        let targets = mesh.and_then(|mesh| mesh.primitives().map(|primitive| primitive.morph_targets().len()).max()).unwrap_or(0);
        if targets == 0 {
            self.warn(format!("{at}: it animates morph targets of a node that has none"));
            return Ok(None);
        }
        let sampler = channel.sampler();
        let numbers = self.buffers.floats(self.shown, &sampler.output(), 1)?;
        let (times, interpolation) = self.keys(&sampler, &numbers, at)?;
        if numbers.len() != times.len() * targets * per_key(interpolation) {
            let what = format!("{at}: {} keys of {targets} morph targets do not go with {} weights", times.len(), numbers.len());
            return Err(self.fail(what));
        }
        let rows = numbers.chunks_exact(targets).map(|row| row.iter().map(|weight| f64::from(*weight)).collect()).collect();
        Ok(Some(WeightChannel { node, interpolation, times, rows }))
    }
}

/// How many values a key has.
fn per_key(interpolation: Interpolation) -> usize {
    if interpolation == Interpolation::CubicSpline { 3 } else { 1 }
}
