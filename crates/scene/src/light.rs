//! Lights: without extent, with extent, and infinitely far.

use glam::{DMat4, DVec3, Vec2, Vec3};
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
    /// World from local coordinates. Flat shapes lie in local XY and emit towards local -Z. Any linear map: a disk becomes an ellipse, a sphere an ellipsoid.
    pub world_from_local: DMat4,
    /// Radiance of its surface, W/(sr m^2).
    pub radiance: Vec3,
    /// Whether a flat shape emits towards local +Z as well. Nothing changes for a sphere.
    pub two_sided: bool,
    pub(crate) node: Option<usize>,
}

/// Shape of an [`AreaLight`], metres.
#[derive(Clone, Debug, PartialEq)]
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
    /// Polygon in local XY, convex or not, without holes. Its edges do not cross each other; they may run either way around.
    Polygon {
        /// Corners in order, metres: 3 to [`AreaShape::MAX_VERTICES`].
        vertices: Vec<Vec2>,
    },
}

impl AreaShape {
    /// Most corners of a polygon.
    pub const MAX_VERTICES: usize = 64;

    /// Corners of a quad or polygon, running counter-clockwise as seen from local -Z, the side that emits; none for the round shapes.
    pub fn outline(&self) -> Option<Vec<Vec2>> {
        match self {
            Self::Quad { width, height } => {
                let (x, y) = (width / 2.0, height / 2.0);
                Some(vec![Vec2::new(-x, -y), Vec2::new(-x, y), Vec2::new(x, y), Vec2::new(x, -y)])
            }
            Self::Polygon { vertices } => {
                let mut outline = vertices.clone();
                if twice_signed_area(vertices) > 0.0 {
                    outline.reverse();
                }
                Some(outline)
            }
            Self::Disk { .. } | Self::Sphere { .. } => None,
        }
    }
}

/// Positive where the outline runs counter-clockwise as seen from local +Z.
pub(crate) fn twice_signed_area(vertices: &[Vec2]) -> f64 {
    let edges = vertices.iter().zip(vertices.iter().cycle().skip(1));
    edges.map(|(from, to)| from.as_dvec2().perp_dot(to.as_dvec2())).sum()
}

/// Why these corners are no polygon that a light can have; nothing if they are one.
pub(crate) fn polygon_fault(vertices: &[Vec2]) -> Option<String> {
    let count = vertices.len();
    let most = AreaShape::MAX_VERTICES;
    if !(3..=most).contains(&count) {
        return Some(format!("`vertices` has {count} corners, but a polygon has 3 to {most}"));
    }
    if let Some(index) = vertices.iter().position(|vertex| !vertex.is_finite()) {
        return Some(format!("`vertices[{index}]` is not finite"));
    }
    let at = |index: usize| vertices[index % count].as_dvec2();
    if let Some(index) = (0..count).find(|index| at(*index) == at(index + 1)) {
        return Some(format!("`vertices[{index}]` and the next are the same point"));
    }
    let side = |edge: usize, point: usize| (at(edge + 1) - at(edge)).perp_dot(at(point) - at(edge));
    for first in 0..count {
        for second in first + 2..count {
            if first == 0 && second == count - 1 {
                continue;
            }
            let apart = |edge: usize, other: usize| side(edge, other) * side(edge, other + 1) > 0.0;
            let (a, b) = (at(first).min(at(first + 1)), at(first).max(at(first + 1)));
            let (c, d) = (at(second).min(at(second + 1)), at(second).max(at(second + 1)));
            let boxes_meet = a.cmple(d).all() && c.cmple(b).all();
            if boxes_meet && !apart(first, second) && !apart(second, first) {
                return Some(format!("the edges from `vertices[{first}]` and from `vertices[{second}]` meet"));
            }
        }
    }
    let size = vertices.iter().fold(0.0, |size, vertex| f64::max(size, (vertex.as_dvec2() - at(0)).length()));
    (twice_signed_area(vertices).abs() <= 1e-6 * size * size).then(|| "`vertices` has no area".into())
}

/// Triangles that cover a polygon, as indices of its corners.
pub fn triangulate(outline: &[Vec2]) -> Vec<[usize; 3]> {
    let mut indices: Vec<usize> = Vec::new();
    earcut::Earcut::new().earcut(outline.iter().map(|vertex| vertex.to_array()), &[], &mut indices);
    indices.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect()
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

/// What is out of range by no more than this is out by rounding: factors written with three digits, pi / 2 as 1.571.
pub(crate) const ROUNDING: f64 = 1e-3;

/// Cone angles, radians, with rounding undone: an outer angle just beyond pi / 2 and an inner one just below 0 are clamped, and an inner angle beyond
/// the outer one is the outer one, for then the cone has a hard edge.
pub(crate) fn rounded_cone(inner: f64, outer: f64) -> (f64, f64) {
    let most = f64::from(std::f32::consts::FRAC_PI_2);
    let outer = if outer > most && outer <= most + ROUNDING { most } else { outer };
    let inner = if (-ROUNDING..0.0).contains(&inner) { 0.0 } else { inner };
    (if inner > outer && outer > 0.0 { outer } else { inner }, outer)
}
