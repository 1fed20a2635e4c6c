//! Linearly transformed cosines (Heitz, Dupuy, Hill and Neubelt 2016, Real-Time Polygonal-Light Shading with Linearly Transformed Cosines): the clamped cosine
//! under a linear map of directions, which integrates over a polygon as the cosine does over the polygon mapped back.

use crate::area_light::{
    boundary::{Boundary, Ellipse, Piece},
    lambert::irradiance,
};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// The lobe, by the inverse of its map, in the frame with z along the normal and the viewer in the half plane y = 0, x >= 0. Integrates to 1 over the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearlyTransformedCosine {
    /// Takes directions to those of the clamped cosine about z. Any multiple of it means the same.
    pub inverse: DMat3,
}

impl LinearlyTransformedCosine {
    /// From the four numbers that symmetric lobes have: `inverse` has the rows (xx, 0, xz), (0, 1, 0), (zx, 0, zz).
    pub fn new([xx, xz, zx, zz]: [f64; 4]) -> Self {
        Self { inverse: DMat3::from_cols(DVec3::new(xx, 0.0, zx), DVec3::Y, DVec3::new(xz, 0.0, zz)) }
    }

    /// Density in a unit direction, 1/sr: `cos / pi` of what the direction is mapped back to, times how much the map stretches there.
    pub fn evaluate(&self, direction: DVec3) -> f64 {
        let back = self.inverse * direction;
        let length = back.length();
        if length == 0.0 { 0.0 } else { (back.z / length).max(0.0) / PI * self.inverse.determinant().abs() / length.powi(3) }
    }

    /// Integral over the solid angle of a light, 0 to 1: exact.
    pub fn integral(&self, light: &Boundary) -> f64 {
        let map = |point: DVec3| self.inverse * point;
        let pieces = light.pieces.iter().map(|piece| match *piece {
            Piece::Segment { from, to, cut } => Piece::Segment { from: map(from), to: map(to), cut },
            Piece::Arc { ellipse, from, to } => Piece::Arc {
                ellipse: Ellipse { center: map(ellipse.center), axis_a: map(ellipse.axis_a), axis_b: map(ellipse.axis_b) },
                from,
                to,
            },
        });
        irradiance(&Boundary { pieces: pieces.collect(), facing: map(light.facing) }, DVec3::Z) / PI
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::sampling::{r2_point, sample_sphere};

    #[test]
    fn integrates_to_one_and_over_a_polygon_to_its_own_mean() {
        let lobe = LinearlyTransformedCosine::new([2.1, -0.4, 0.7, 1.3]);
        let corners = [(0.9, -0.2, 0.6), (0.4, 0.8, 0.9), (-0.7, 0.3, 0.8), (0.1, -0.6, 1.1)].map(|(x, y, z)| DVec3::new(x, y, z));
        // On one plane, z = 1 seen from the origin, counter-clockwise from there.
        let corners: Vec<DVec3> = corners.iter().rev().map(|corner| *corner / corner.z).collect();
        let light = Boundary::polygon(&corners);
        let side = |from: DVec3, to: DVec3, at: DVec3| from.cross(to).dot(at);
        let (mut all, mut part) = (0.0, 0.0);
        let count = 400_000;
        for index in 0..count {
            let direction = sample_sphere(r2_point(index, 5));
            let value = lobe.evaluate(direction) * 4.0 * PI / f64::from(count);
            all += value;
            let inside = direction.z > 0.0 && (0..4).all(|index| side(corners[index], corners[(index + 1) % 4], direction) < 0.0);
            part += if inside { value } else { 0.0 };
        }
        assert!((all - 1.0).abs() < 1e-3, "{all}");
        let found = lobe.integral(&light);
        assert!((found - part).abs() < 2e-3, "{found} is not {part}");
    }
}
