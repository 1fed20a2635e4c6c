//! Keyframe animation of nodes (glTF 2.0, appendix C).

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
        let next = self.times.partition_point(|time| *time <= seconds);
        if next == 0 {
            return self.value(0);
        }
        if next == self.times.len() {
            return self.value(next - 1);
        }
        let key = next - 1;
        let length = f64::from(self.times[next]) - f64::from(self.times[key]);
        let t = (f64::from(seconds) - f64::from(self.times[key])) / length;
        let (from, to) = (self.value(key), self.value(next));
        match self.interpolation {
            Interpolation::Step => from,
            Interpolation::Linear if self.property == Property::Rotation => {
                let quaternion = |value: DVec4| DQuat::from_vec4(value).normalize();
                quaternion(from).slerp(quaternion(to), t).into()
            }
            Interpolation::Linear => from.lerp(to, t),
            Interpolation::CubicSpline => {
                let (t2, t3) = (t * t, t * t * t);
                let (out, into) = (self.values[3 * key + 2] * length, self.values[3 * next] * length);
                from * (2.0 * t3 - 3.0 * t2 + 1.0) + out * (t3 - 2.0 * t2 + t) + to * (3.0 * t2 - 2.0 * t3) + into * (t3 - t2)
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
