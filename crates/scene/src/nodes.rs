//! The node tree: who hangs below whom, and where that puts them.

use crate::animation::{Channel, WeightChannel};
use glam::{DMat4, DQuat, DVec3};

/// Translation, rotation and scale, or a matrix that no animation touches.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Transform {
    Matrix(DMat4),
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

impl Transform {
    pub fn matrix(&self) -> DMat4 {
        match self {
            Transform::Matrix(matrix) => *matrix,
            Transform::Parts { translation, rotation, scale } => DMat4::from_scale_rotation_translation(*scale, *rotation, *translation),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Comes before this node in the list.
    pub parent: Option<usize>,
    pub rest: Transform,
    pub now: Transform,
}

/// Nodes, parents first.
#[derive(Clone, Debug, Default)]
pub(crate) struct NodeTree {
    pub nodes: Vec<Node>,
    pub channels: Vec<Channel>,
    pub weight_channels: Vec<WeightChannel>,
    /// What the channels above give now, in their order; empty before the first moment is set.
    pub weights: Vec<Vec<f64>>,
    pub origin: Option<DVec3>,
}

impl NodeTree {
    pub fn is_animated(&self) -> bool {
        !(self.channels.is_empty() && self.weight_channels.is_empty())
    }

    pub fn animation_seconds(&self) -> f32 {
        let ends = self.channels.iter().map(Channel::end).chain(self.weight_channels.iter().map(WeightChannel::end));
        ends.fold(0.0, f32::max)
    }

    pub fn animate(&mut self, seconds: f32) {
        for node in &mut self.nodes {
            node.now = node.rest;
        }
        for channel in &self.channels {
            channel.apply(seconds, &mut self.nodes[channel.node].now);
        }
        self.weights = self.weight_channels.iter().map(|channel| channel.sample(seconds)).collect();
    }

    /// The animated weights of a node's morph targets; `None` where no animation drives them, or none has been played. Of several animations the last
    /// holds, as it does for transforms.
    pub fn weights_of(&self, node: usize) -> Option<&[f64]> {
        let channels = self.weight_channels.iter().zip(&self.weights);
        channels.rev().find(|(channel, _)| channel.node == node).map(|(_, weights)| weights.as_slice())
    }

    pub fn world_matrices(&self) -> Vec<DMat4> {
        let mut world: Vec<DMat4> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let local = node.now.matrix();
            world.push(match node.parent {
                Some(parent) => world[parent] * local,
                None => local,
            });
        }
        world
    }

    /// For each node, whether an animation moves it, itself or through what it hangs below.
    pub fn moving(&self) -> Vec<bool> {
        let mut moving = vec![false; self.nodes.len()];
        for channel in &self.channels {
            moving[channel.node] = true;
        }
        for (index, node) in self.nodes.iter().enumerate() {
            moving[index] |= node.parent.is_some_and(|parent| moving[parent]);
        }
        moving
    }
}
