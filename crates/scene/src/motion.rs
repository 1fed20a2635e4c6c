//! Lights that a RON scene moves along key frames.

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
        let next = self.keys.partition_point(|key| key.seconds <= seconds).min(self.keys.len() - 1);
        let (from, to) = (&self.keys[next.saturating_sub(1)], &self.keys[next]);
        let length = f64::from(to.seconds) - f64::from(from.seconds);
        let t = if length > 0.0 { ((f64::from(seconds) - f64::from(from.seconds)) / length).clamp(0.0, 1.0) } else { 0.0 };
        let position = from.position.zip(to.position).map(|(from, to)| from.lerp(to, t));
        let direction = from.direction.zip(to.direction).map(|(from, to)| {
            let turn = DQuat::IDENTITY.slerp(DQuat::from_rotation_arc(from, to), t);
            (turn * from).normalize_or(from)
        });
        (position, direction)
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
