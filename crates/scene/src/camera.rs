//! Cameras.

use glam::{DMat4, DVec3};

/// A perspective camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name.
    pub name: String,
    /// World space, metres.
    pub position: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Unit, upwards in the picture, perpendicular to `forward`.
    pub up: DVec3,
    /// Unit, to the right in the picture: `forward` x `up`.
    pub right: DVec3,
    /// Full vertical angle of view, radians, in (0, pi).
    pub yfov: f64,
    /// Distance of the near plane, metres, > 0.
    pub near: f64,
    /// What makes it unusable, if it is: orthographic cameras are kept so that choosing one gives a clear error.
    pub(crate) unusable: Option<String>,
    pub(crate) node: Option<usize>,
}

impl Camera {
    /// A camera that looks from `origin` to `target`. `None` where these coincide or `up` is parallel to the view.
    pub fn look_at(name: &str, origin: DVec3, target: DVec3, up: DVec3, yfov: f64, near: f64) -> Option<Self> {
        let forward = (target - origin).try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        Some(Self { name: name.into(), position: origin, forward, up: right.cross(forward), right, yfov, near, unusable: None, node: None })
    }

    /// Puts it where its node is; whether that moved it.
    pub(crate) fn place(&mut self, world_from_local: DMat4) -> bool {
        let axis = |local: DVec3| world_from_local.transform_vector3(local).try_normalize();
        let before = (self.position, self.forward, self.up);
        self.position = world_from_local.transform_point3(DVec3::ZERO);
        self.forward = axis(DVec3::NEG_Z).unwrap_or(self.forward);
        let up = axis(DVec3::Y).unwrap_or(self.up);
        // Scaled or sheared nodes would skew the view; the frame is made square about the view direction.
        self.right = self.forward.cross(up).try_normalize().unwrap_or_else(|| self.forward.any_orthonormal_vector());
        self.up = self.right.cross(self.forward);
        before != (self.position, self.forward, self.up)
    }
}
