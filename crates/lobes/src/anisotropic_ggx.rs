//! GGX with an alpha along the tangent and one across it, for brushed surfaces.
//!
//! Directions are in the frame of the surface: x along the tangent, z along the normal. The twin on the device is `lobelia::anisotropic_ggx`.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Scale of half vectors, along the tangent and across it, that makes the anisotropic distribution the isotropic one of `alpha` (the geometric mean of its alphas), for anisotropy in
/// (-1, 1): alphas are in the ratio (1 + anisotropy) : (1 - anisotropy).
pub fn stretch(anisotropy: f64) -> DVec2 {
    let along = f64::sqrt((1.0 - anisotropy) / (1.0 + anisotropy));
    DVec2::new(along, 1.0 / along)
}

/// Alphas along the tangent and across it, `alpha (1 + anisotropy)` and `alpha (1 - anisotropy)`; their geometric mean at least [`crate::brdf::MIN_ALPHA`].
pub fn alphas(alpha: f64, anisotropy: f64) -> DVec2 {
    let mean = alpha * f64::sqrt((1.0 - anisotropy) * (1.0 + anisotropy));
    mean.max(crate::brdf::MIN_ALPHA) / stretch(anisotropy)
}

/// `1 / (pi a b ((h.x / a)^2 + (h.y / b)^2 + h.z^2)^2)`, 1/sr, for a unit h with h.z >= 0 (Burley 2012, Physically Based Shading at Disney, equation 13).
pub fn distribution(alphas: DVec2, h: DVec3) -> f64 {
    let bracket = (h.truncate() / alphas).length_squared() + h.z * h.z;
    1.0 / (PI * alphas.x * alphas.y * bracket * bracket)
}

/// `G2 / (4 (n.l) (n.v))`, height-correlated (Heitz 2014, Understanding the Masking-Shadowing Function, equations 86 and 99), for unit l and v with l.z and v.z in (0, 1].
pub fn visibility(alphas: DVec2, l: DVec3, v: DVec3) -> f64 {
    let length = |w: DVec3| (w.truncate() * alphas).extend(w.z).length();
    0.5 / (l.z * length(v) + v.z * length(l))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{ggx_distribution, ggx_visibility};

    #[test]
    fn without_anisotropy_it_is_ggx() {
        let (h, l, v) =
            (DVec3::new(0.1, -0.2, 0.9).normalize(), DVec3::new(0.7, 0.1, 0.3).normalize(), DVec3::new(-0.2, 0.4, 0.5).normalize());
        for alpha in [0.001, 0.1, 1.0] {
            let same = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b, "{a} is not {b}");
            same(distribution(alphas(alpha, 0.0), h), ggx_distribution(alpha, DVec3::Z, h));
            same(visibility(alphas(alpha, 0.0), l, v), ggx_visibility(alpha, l.z, v.z));
        }
    }

    /// The projected distribution integrates to 1, and masking to the share of facets that a viewer sees: the visible ones project to n.v (Heitz 2014, equation 14).
    #[test]
    fn normalised_for_every_viewer() {
        let alphas = alphas(0.4, 0.6);
        assert!((alphas - DVec2::new(0.64, 0.16)).length() < 1e-12);
        for v in [DVec3::Z, DVec3::new(0.8, 0.0, 0.6), DVec3::new(0.0, 0.8, 0.6), DVec3::new(0.6, 0.7, 0.1).normalize()] {
            // G1 is visibility times 4 (n.l) (n.v) with the light at the normal, where nothing is masked.
            let masking = 4.0 * v.z * visibility(alphas, DVec3::Z, v);
            let (mut projected, mut seen) = (0.0, 0.0);
            let count = 1500;
            for place in 0..count * count {
                let [r, t] = [place % count, place / count].map(|cell| (f64::from(cell) + 0.5) / f64::from(count));
                // Uniform in the projected hemisphere.
                let (radius, turn) = (r.sqrt(), t * std::f64::consts::TAU);
                let h = DVec3::new(radius * turn.cos(), radius * turn.sin(), (1.0 - r).sqrt());
                let density = distribution(alphas, h) * PI / f64::from(count * count);
                projected += density;
                seen += density / h.z * h.dot(v).max(0.0);
            }
            assert!((projected - 1.0).abs() < 1e-3, "{projected}");
            assert!((masking * seen - v.z).abs() < 5e-3 * v.z, "{v}: {} is not {}", masking * seen, v.z);
        }
    }
}
