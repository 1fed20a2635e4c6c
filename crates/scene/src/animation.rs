//! Keyframe animation of nodes and of the weights of their morph targets (glTF 2.0, appendix C).

use crate::nodes::Transform;
use glam::{DQuat, DVec4};

/// What a channel drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Property {
    Translation,
    Rotation,
    Scale,
}

/// How values between keys are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// Where a moment lies among key times.
enum Span {
    /// At a key, or beyond the first or last.
    At(usize),
    /// At a part `t` of the way from a key to the next, `length` seconds long.
    After { key: usize, t: f64, length: f64 },
}

fn span(times: &[f32], seconds: f32) -> Span {
    let next = times.partition_point(|time| *time <= seconds);
    if next == 0 {
        return Span::At(0);
    }
    let key = next - 1;
    if next == times.len() {
        return Span::At(key);
    }
    let length = f64::from(times[next]) - f64::from(times[key]);
    Span::After { key, t: (f64::from(seconds) - f64::from(times[key])) / length, length }
}

/// Weights of value and out-tangent at the start of a span and of value and in-tangent at its end (glTF 2.0, appendix C.4).
fn hermite(t: f64, length: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, length * (t3 - 2.0 * t2 + t), 3.0 * t2 - 2.0 * t3, length * (t3 - t2)]
}

/// The animated weights of a node's morph targets.
#[derive(Clone, Debug)]
pub(crate) struct WeightChannel {
    pub node: usize,
    pub interpolation: Interpolation,
    /// Seconds, rising, at least one.
    pub times: Vec<f32>,
    /// One row of weights per key; three rows (in-tangents, values, out-tangents) for cubic splines.
    pub rows: Vec<Vec<f64>>,
}

impl WeightChannel {
    pub fn end(&self) -> f32 {
        self.times.last().copied().unwrap_or(0.0)
    }

    pub fn sample(&self, seconds: f32) -> Vec<f64> {
        let row = |key: usize| &self.rows[if self.interpolation == Interpolation::CubicSpline { 3 * key + 1 } else { key }];
        let (key, t, length) = match span(&self.times, seconds) {
            Span::At(key) => return row(key).clone(),
            Span::After { key, t, length } => (key, t, length),
        };
        let pairs = row(key).iter().zip(row(key + 1));
        match self.interpolation {
            Interpolation::Step => row(key).clone(),
            Interpolation::Linear => pairs.map(|(from, to)| from + (to - from) * t).collect(),
            Interpolation::CubicSpline => {
                let [a, b, c, d] = hermite(t, length);
                let tangents = self.rows[3 * key + 2].iter().zip(&self.rows[3 * key + 3]);
                pairs.zip(tangents).map(|((from, to), (out, into))| from * a + out * b + to * c + into * d).collect()
            }
        }
    }
}

/// One animated property of one node.
#[derive(Clone, Debug)]
pub(crate) struct Channel {
    pub node: usize,
    pub property: Property,
    pub interpolation: Interpolation,
    /// Seconds, rising, at least one.
    pub times: Vec<f32>,
    /// One per key; three (in-tangent, value, out-tangent) for cubic splines.
    pub values: Vec<DVec4>,
}

impl Channel {
    pub fn end(&self) -> f32 {
        self.times.last().copied().unwrap_or(0.0)
    }

    fn value(&self, key: usize) -> DVec4 {
        match self.interpolation {
            Interpolation::CubicSpline => self.values[3 * key + 1],
            _ => self.values[key],
        }
    }

    fn sample(&self, seconds: f32) -> DVec4 {
        let (key, t, length) = match span(&self.times, seconds) {
            Span::At(key) => return self.value(key),
            Span::After { key, t, length } => (key, t, length),
        };
        let (from, to) = (self.value(key), self.value(key + 1));
        match self.interpolation {
            Interpolation::Step => from,
            Interpolation::Linear if self.property == Property::Rotation => {
                let quaternion = |value: DVec4| DQuat::from_vec4(value).normalize();
                quaternion(from).slerp(quaternion(to), t).into()
            }
            Interpolation::Linear => from.lerp(to, t),
            Interpolation::CubicSpline => {
                let [a, b, c, d] = hermite(t, length);
                from * a + self.values[3 * key + 2] * b + to * c + self.values[3 * key + 3] * d
            }
        }
    }

    pub fn apply(&self, seconds: f32, transform: &mut Transform) {
        let value = self.sample(seconds);
        // An animated node has no matrix: the loader refuses that.
        if let Transform::Parts { translation, rotation, scale } = transform {
            match self.property {
                Property::Translation => *translation = value.truncate(),
                Property::Scale => *scale = value.truncate(),
                Property::Rotation => {
                    let quaternion = DQuat::from_vec4(value);
                    *rotation = if quaternion.length_squared() > 0.0 { quaternion.normalize() } else { DQuat::IDENTITY };
                }
            }
        }
    }
}
