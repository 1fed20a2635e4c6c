//! The surface of a scene as a curve.

use glam::DVec3;
use lobelia_scene::Triangle;

/// The triangles of a scene laid out along [0, 2^32) by area, so that one integer names a place on the surface.
///
/// Triangles stand in the order of a space-filling curve, and within a triangle places follow its subdivision into four (Basu and Owen 2015, *Low
/// Discrepancy Constructions in the Triangle*): an interval of integers is a patch of surface that lies together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceCurve {
    /// Three rows a triangle: a corner and two edges.
    pub triangles: Vec<[f32; 4]>,
    /// End of each triangle's interval; the last is 2^32 - 1. A triangle whose interval is empty (below 2^-32 of the area) is never met.
    pub ends: Vec<u32>,
    /// Square metres.
    pub area: f64,
}

/// Spreads the lower 21 bits of a number to every third bit.
fn spread_bits(value: u64) -> u64 {
    (0..21).fold(0, |bits, place| bits | (value >> place & 1) << (3 * place))
}

impl SurfaceCurve {
    /// Lays triangles out. Those without area, or with a corner that is not finite, are left out.
    pub fn new(triangles: &[Triangle]) -> Self {
        struct Placed {
            code: u64,
            area: f64,
            corners: [DVec3; 3],
        }
        let mut placed: Vec<Placed> = triangles
            .iter()
            .map(|triangle| triangle.positions.map(|corner| corner.as_dvec3()))
            .map(|corners| Placed { code: 0, area: (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() / 2.0, corners })
            .filter(|placed| placed.area > 0.0 && placed.area.is_finite())
            .collect();
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in placed.iter().flat_map(|placed| placed.corners) {
            (low, high) = (low.min(corner), high.max(corner));
        }
        let size = (high - low).max_element().max(f64::MIN_POSITIVE);
        for placed in &mut placed {
            let place = (placed.corners.iter().sum::<DVec3>() / 3.0 - low) / size * f64::from((1u32 << 21) - 1);
            placed.code = place.to_array().iter().enumerate().fold(0, |code, (axis, part)| code | spread_bits(*part as u64) << axis);
        }
        placed.sort_by_key(|placed| placed.code);
        let area = placed.iter().map(|placed| placed.area).sum::<f64>();
        let mut out = Self { area, ..Self::default() };
        let mut sum = 0.0;
        for Placed { area: own, corners: [a, b, c], .. } in &placed {
            sum += own;
            // Casting saturates, and the last end has to be the last integer whatever rounding says.
            out.ends.push((sum / area * 4_294_967_296.0) as u32);
            out.triangles.extend([*a, *b - *a, *c - *a].map(|row| row.as_vec3().extend(0.0).to_array()));
        }
        if let Some(last) = out.ends.last_mut() {
            *last = u32::MAX;
        }
        out
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is no surface.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn triangle(size: f32, at: f32) -> Triangle {
        let start = Vec3::new(at, 0.0, 0.0);
        Triangle { positions: [start, start + Vec3::X * size, start + Vec3::Y * size], instance: 0, material: 0 }
    }

    #[test]
    fn intervals_are_in_proportion_to_areas() {
        let curve = SurfaceCurve::new(&[triangle(2.0, 0.0), triangle(0.0, 1.0), triangle(1.0, 50.0), triangle(f32::NAN, 3.0)]);
        assert_eq!((curve.len(), curve.triangles.len(), curve.area), (2, 6, 2.5));
        assert_eq!(curve.ends, [3_435_973_836, u32::MAX]);
        let tiny = SurfaceCurve::new(&[triangle(1e-6, 0.0), triangle(1e-6, 1e-6)]);
        assert_eq!(tiny.ends, [1 << 31, u32::MAX], "small scenes are no different");
        let mixed = SurfaceCurve::new(&[triangle(1e-6, 0.0), triangle(1e4, 0.0), triangle(1e-6, 1e4)]);
        assert!(mixed.ends.is_sorted() && mixed.ends.last() == Some(&u32::MAX), "{:?}", mixed.ends);
    }

    #[test]
    fn what_is_near_on_the_curve_is_near_in_space() {
        let triangles: Vec<_> = (0..512u32).map(|index| triangle(0.01, (index.wrapping_mul(269) % 512) as f32)).collect();
        let curve = SurfaceCurve::new(&triangles);
        assert!(curve.triangles.chunks(3).map(|rows| rows[0][0]).is_sorted(), "along an axis, the curve runs along it");
    }

    #[test]
    fn no_surface_is_an_empty_curve() {
        assert!(SurfaceCurve::new(&[]).is_empty() && SurfaceCurve::new(&[triangle(0.0, 1.0)]).is_empty());
    }
}
