//! Lights and cameras that a RON scene moves along key frames.

use crate::Camera;
use glam::{DQuat, DVec3};

/// Where a light is at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Key {
    pub seconds: f32,
    /// World space, metres.
    pub position: Option<DVec3>,
    /// Unit.
    pub direction: Option<DVec3>,
}

/// The way of one light.
#[derive(Clone, Debug)]
pub(crate) struct LightMotion {
    /// Name of the light.
    pub light: String,
    /// At least one; seconds rise. All give a position or none does, and the same for directions; no direction is opposite to the one before.
    pub keys: Vec<Key>,
}

impl LightMotion {
    pub fn end(&self) -> f32 {
        self.keys.last().map_or(0.0, |key| key.seconds)
    }

    /// Position and direction, those that the keys give: on straight lines and great circles between keys at an even speed, and standing still before the
    /// first and after the last.
    pub fn at(&self, seconds: f32) -> (Option<DVec3>, Option<DVec3>) {
        let (from, to, t) = between(&self.keys, |key| key.seconds, seconds);
        let position = from.position.zip(to.position).map(|(from, to)| from.lerp(to, t));
        let direction = from.direction.zip(to.direction).map(|(from, to)| {
            let turn = DQuat::IDENTITY.slerp(DQuat::from_rotation_arc(from, to), t);
            (turn * from).normalize_or(from)
        });
        (position, direction)
    }
}

/// The keys, at least one, before and after a moment, and how far it is from one to the other, in [0, 1].
fn between<K>(keys: &[K], seconds_of: impl Fn(&K) -> f32, seconds: f32) -> (&K, &K, f64) {
    let next = keys.partition_point(|key| seconds_of(key) <= seconds).min(keys.len() - 1);
    let (from, to) = (&keys[next.saturating_sub(1)], &keys[next]);
    let (start, end) = (f64::from(seconds_of(from)), f64::from(seconds_of(to)));
    let t = if end > start { ((f64::from(seconds) - start) / (end - start)).clamp(0.0, 1.0) } else { 0.0 };
    (from, to, t)
}

/// Where a camera is at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraKey {
    pub seconds: f32,
    /// World space, metres.
    pub origin: DVec3,
    /// World space, metres.
    pub target: DVec3,
}

/// The way of one camera.
#[derive(Clone, Debug)]
pub(crate) struct CameraMotion {
    /// Name of the camera.
    pub camera: String,
    /// Upwards in the picture, not along the view at any moment.
    pub up: DVec3,
    /// At least one; seconds rise.
    pub keys: Vec<CameraKey>,
}

impl CameraMotion {
    pub fn end(&self) -> f32 {
        self.keys.last().map_or(0.0, |key| key.seconds)
    }

    /// Puts a camera where it is at a moment: origin and target go straight from key to key at an even speed, and stand still before the first and
    /// after the last.
    pub fn place(&self, camera: &mut Camera, seconds: f32) {
        let (from, to, t) = between(&self.keys, |key| key.seconds, seconds);
        let (origin, target) = (from.origin.lerp(to.origin, t), from.target.lerp(to.target, t));
        if let Some(placed) = Camera::look_at("", origin, target, self.up, camera.yfov, camera.near) {
            let Camera { position, forward, up, right, .. } = placed;
            (camera.position, camera.forward, camera.up, camera.right) = (position, forward, up, right);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(seconds: f32, position: DVec3, direction: DVec3) -> Key {
        Key { seconds, position: Some(position), direction: Some(direction) }
    }

    #[test]
    fn lights_go_straight_turn_evenly_and_stop() {
        let keys = vec![key(1.0, DVec3::ZERO, DVec3::X), key(3.0, DVec3::new(4.0, 0.0, 2.0), DVec3::Y), key(4.0, DVec3::ZERO, DVec3::Y)];
        let motion = LightMotion { light: "a".into(), keys };
        let near = |seconds: f32, position: DVec3, direction: DVec3| {
            let (found, turned) = motion.at(seconds);
            assert!((found.unwrap_or_default() - position).length() < 1e-9, "{seconds} s: {found:?}");
            assert!((turned.unwrap_or_default() - direction).length() < 1e-9, "{seconds} s: {turned:?}");
        };
        near(-1.0, DVec3::ZERO, DVec3::X);
        near(1.0, DVec3::ZERO, DVec3::X);
        // A quarter of the way, a quarter of the angle.
        near(1.5, DVec3::new(1.0, 0.0, 0.5), DVec3::new(22.5f64.to_radians().cos(), 22.5f64.to_radians().sin(), 0.0));
        near(3.0, DVec3::new(4.0, 0.0, 2.0), DVec3::Y);
        near(3.5, DVec3::new(2.0, 0.0, 1.0), DVec3::Y);
        near(9.0, DVec3::ZERO, DVec3::Y);
        assert_eq!(motion.end(), 4.0);
    }

    #[test]
    fn one_key_is_a_place() {
        let motion = LightMotion { light: "a".into(), keys: vec![Key { seconds: 2.0, position: Some(DVec3::ONE), direction: None }] };
        assert_eq!(motion.at(0.0), (Some(DVec3::ONE), None));
        assert_eq!(motion.at(5.0), (Some(DVec3::ONE), None));
    }
}
