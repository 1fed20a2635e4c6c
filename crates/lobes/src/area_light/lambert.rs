//! Irradiance from lights of uniform radiance: Lambert's formula.

use super::boundary::{Boundary, Piece};
use crate::quadrature::integrate_adaptive;
use glam::DVec3;

/// Integral of `max(n.u, 0)` over the solid angle of a light of radiance 1, above the plane of `normal`: irradiance, at most pi. Negative for an outline that
/// runs clockwise.
///
/// Exact: half the sum over edges of their angle times the cosine between `normal` and that of the edge's plane (Lambert 1760), by quadrature along
/// elliptical arcs.
pub fn irradiance(light: &Boundary, normal: DVec3) -> f64 {
    let piece = |piece: &Piece| match *piece {
        Piece::Segment { from, to, .. } => {
            let cross = from.cross(to - from);
            let size = cross.length();
            if size == 0.0 { 0.0 } else { -0.5 * size.atan2(from.dot(to)) * cross.dot(normal) / size }
        }
        Piece::Arc { ellipse, from, to } => integrate_adaptive(from, to, 1e-14, |f| {
            let (p, tangent) = (ellipse.point(f), ellipse.tangent(f));
            -0.5 * p.cross(tangent).dot(normal) / p.length_squared()
        }),
    };
    light.clip(normal).pieces.iter().map(piece).sum()
}

/// The same for a sphere of unit radiance in closed form: `elevation` is the cosine between `normal` and the direction to its centre, `sine` that of
/// half the angle it fills, in (0, 1]. Known as the form factor of a sphere (Snyder 1996, Area Light Sources for Real-Time Graphics).
pub fn irradiance_of_sphere(elevation: f64, sine: f64) -> f64 {
    use std::f64::consts::PI;
    let square = sine * sine;
    if elevation >= sine {
        return PI * square * elevation;
    }
    if elevation <= -sine {
        return 0.0;
    }
    let across = (1.0 - elevation * elevation).max(0.0).sqrt();
    let spread = (1.0 - square).max(0.0).sqrt();
    // Half the width, in angle, of what the horizon cuts off.
    let x = (spread * elevation / (sine * across)).clamp(-1.0, 1.0);
    let y = (square - elevation * elevation).max(0.0).sqrt();
    let cut = (-x).acos();
    elevation * square * cut + (y / across).atan2(spread / across) - spread * y
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::round::sphere;
    use super::*;

    #[test]
    fn half_the_sky_and_a_quad_overhead() {
        let far = 1e7;
        let sky = Boundary::polygon(&[(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(far * x, far * y, 1.0)));
        let found = irradiance(&sky, DVec3::Z);
        assert!((found - std::f64::consts::PI).abs() < 1e-6, "{found}");
    }

    #[test]
    fn the_closed_form_of_spheres_is_that_of_their_outlines() {
        for elevation in [-0.9, -0.3, 0.0, 0.2, 0.5, 0.77, 0.95, 1.0f64] {
            for sine in [0.01, 0.3, 0.6, 0.9, 0.999f64] {
                let center = DVec3::new((1.0 - elevation * elevation).sqrt(), 0.0, elevation);
                let expected = irradiance(&sphere(center, sine).boundary().unwrap(), DVec3::Z);
                let found = irradiance_of_sphere(elevation, sine);
                assert!((found - expected).abs() < 1e-10, "{elevation} {sine}: {found} is not {expected}");
            }
        }
    }
}
