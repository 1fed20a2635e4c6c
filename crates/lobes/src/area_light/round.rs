//! Disks, spheres, ellipses and ellipsoids: how they look from the shading point (always an ellipse), and which polygons stand in for them.

use super::boundary::{Boundary, Ellipse};
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// What is seen of a round solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Silhouette {
    /// The rim of the cone under which it is seen.
    Rim(Ellipse),
    /// The shading point is inside or on the surface: it is all around.
    Everywhere,
}

/// A sphere seen from the origin: its rim lies at `(1 - R^2/d^2)` of the way to the centre and has the radius `R sqrt(1 - R^2/d^2)`.
pub fn sphere(center: DVec3, radius: f64) -> Silhouette {
    ellipsoid(center, DMat3::from_diagonal(DVec3::splat(radius)))
}

/// The ellipsoid `center + axes q`, |q| = 1. `axes` holds the half axes as columns, or any linear map of the unit sphere that has an inverse; scale it
/// by different amounts, turn and shear it as you like.
///
/// Seen from inside, or through a map without an inverse, it is [`Silhouette::Everywhere`].
pub fn ellipsoid(center: DVec3, axes: DMat3) -> Silhouette {
    // Where the ellipsoid is a unit sphere, it is seen as a circle; linear maps keep what is seen.
    let to = axes.inverse() * center;
    let square = to.length_squared();
    if square.is_nan() || square <= 1.0 {
        return Silhouette::Everywhere;
    }
    let near = (square - 1.0) / square;
    let (a, b) = to.normalize().any_orthonormal_pair();
    let ellipse = Ellipse { center: center * near, axis_a: axes * a * near.sqrt(), axis_b: axes * b * near.sqrt() };
    Silhouette::Rim(ellipse.facing())
}

impl Silhouette {
    /// The outline, or none for light from everywhere.
    pub fn boundary(&self) -> Option<Boundary> {
        match self {
            Self::Rim(ellipse) => Some(Boundary::ellipse(ellipse)),
            Self::Everywhere => None,
        }
    }
}

/// The regular polygon of `sides` vertices about an ellipse that has its area: inscribed ones lose light, up to 36 % for four vertices.
///
/// Exact in the limit of many sides. For Phong lobes eight are right to 0.3 % of the value up to n = 100, sixteen to 0.6 % at 5000.
pub fn equal_area_polygon(ellipse: &Ellipse, sides: u32) -> Vec<DVec3> {
    let turn = TAU / f64::from(sides);
    let scale = (turn / turn.sin()).sqrt();
    let facing = ellipse.facing();
    (0..sides).map(|index| facing.center + (facing.point(turn * f64::from(index)) - facing.center) * scale).collect()
}

/// The quad that spins with the reflected ray: Lecocq et al., algorithm 3 with its errata, for a disk and, with `distance` above 1, for a sphere.
///
/// In the frame where the disk is the unit disk in the plane z = 0, `point` is the shading point and `reflected` the direction of the reflected ray.
/// `spread` is `m = sqrt(2/(n+2))`. Error 0.09 to 0.2 of the value: the area is not kept. Kept as the reference of the paper's method.
pub fn spinning_quad(point: DVec3, reflected: DVec3, spread: f64, sphere_distance: Option<f64>) -> [DVec3; 4] {
    let height = point.z.abs() / point.length();
    let blend = spread * height;
    let rim = sphere_distance.map_or(1.0, |d| d / (d * d - 1.0).max(1e-12).sqrt());
    let size = (1.0 - blend + blend * (TAU / 4.0).sqrt()) * rim;
    // (1-m) times the hit of the ray plus m times the foot of the point, scaled so that a ray that misses gives its own direction instead of infinity.
    let towards = (-reflected.z * point.z.signum()).max(0.0);
    let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
    let direction = flat(point) * towards + flat(reflected) * ((1.0 - spread) * point.z.abs());
    let first = direction.normalize_or(DVec3::X) * size;
    let second = first.cross(DVec3::Z);
    [first, second, -first, -second]
}
