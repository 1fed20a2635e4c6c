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
