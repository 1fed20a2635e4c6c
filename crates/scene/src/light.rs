//! Lights: without extent, with extent, and infinitely far.

use glam::{DMat4, DVec3, Vec3};
use std::fmt;

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// Name of the node or light.
    pub name: String,
    /// Point, spot or directional.
    pub kind: LightKind,
    /// World space, metres.
    pub position: DVec3,
    /// Unit; where its light travels (local -Z).
    pub direction: DVec3,
    /// Radiant intensity, W/sr (point, spot), or irradiance on a facing surface, W/m^2 (directional), per channel, colour included.
    pub intensity: Vec3,
    /// Whether an animation moves it.
    pub animated: bool,
    pub(crate) node: Option<usize>,
}

/// Kind of a [`PunctualLight`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// All directions alike.
    Point,
    /// A cone with a soft rim.
    Spot {
        /// Half angle of the full-intensity cone, radians.
        inner: f32,
        /// Half angle beyond which it is dark, radians.
        outer: f32,
    },
    /// Parallel rays.
    Directional,
}

/// A light with extent.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaLight {
    /// Name of the node.
    pub name: String,
    /// Shape in local coordinates.
    pub shape: AreaShape,
    /// World from local coordinates. Quad and disk lie in local XY and emit towards local -Z.
    pub world_from_local: DMat4,
    /// Radiance of its surface, W/(sr m^2).
    pub radiance: Vec3,
    pub(crate) node: Option<usize>,
}

/// Shape of an [`AreaLight`], metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AreaShape {
    /// Rectangle: width along local X, height along local Y.
    Quad {
        /// Metres.
        width: f32,
        /// Metres.
        height: f32,
    },
    /// Disk about the origin.
    Disk {
        /// Metres.
        radius: f32,
    },
    /// Sphere about the origin, emitting outwards.
    Sphere {
        /// Metres.
        radius: f32,
    },
}

/// Light from infinitely far, as an equirectangular map: pixel (u, v), v down, lies in direction
/// `(sin 2 pi u sin pi v, cos pi v, -cos 2 pi u sin pi v)`; the middle of the picture is +Z.
#[derive(Clone, PartialEq)]
pub struct Environment {
    /// File.
    pub name: String,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Linear radiance, row 0 at the top.
    pub pixels: Vec<Vec3>,
    /// Multiplies the pixels.
    pub scale: f32,
}

impl fmt::Debug for Environment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Environment({}, {} x {}, scale {})", self.name, self.width, self.height, self.scale)
    }
}
