//! Reflectance of glTF surfaces: Lambert plus a microfacet lobe (glTF 2.0 appendix B, with height-correlated Smith masking; the diffuse part is not
//! scaled by 1 - F).
//!
//! ```text
//!   f = base (1 - metallic) / pi + D G2 F / (4 (n.l) (n.v)),     alpha = max(roughness^2, 0.001)
//! ```

use glam::DVec3;
use std::f64::consts::PI;

/// Smallest alpha; smaller roughness counts as this.
pub const MIN_ALPHA: f64 = 0.001;

/// Normal distribution function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Trowbridge-Reitz.
    Ggx,
    /// Phong, with exponent [`phong_exponent`].
    Phong,
}

/// A surface's reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brdf {
    /// Diffuse albedo over pi, 1/sr.
    pub diffuse: DVec3,
    /// Specular reflectance at normal incidence.
    pub reflectance_normal: DVec3,
    /// Specular reflectance at grazing incidence.
    pub reflectance_grazing: f64,
    /// Roughness squared, in [0.001, 1].
    pub alpha: f64,
    /// Which lobe.
    pub distribution: Distribution,
}

impl Brdf {
    /// From glTF parameters, each in [0, 1]; `specular` scales the whole specular lobe.
    pub fn new(base_color: DVec3, metallic: f64, roughness: f64, specular: f64, distribution: Distribution) -> Self {
        Self {
            diffuse: base_color * (1.0 - metallic) / PI,
            reflectance_normal: specular * DVec3::splat(0.04).lerp(base_color, metallic),
            reflectance_grazing: specular,
            alpha: (roughness * roughness).max(MIN_ALPHA),
            distribution,
        }
    }

    /// f(l, v), 1/sr, without the cosine; all vectors unit. Zero unless n.l > 0 and n.v > 0.
    pub fn evaluate(&self, n: DVec3, l: DVec3, v: DVec3) -> DVec3 {
        let (n_dot_l, n_dot_v) = (n.dot(l), n.dot(v));
        if n_dot_l <= 0.0 || n_dot_v <= 0.0 {
            return DVec3::ZERO;
        }
        let h = (l + v).normalize_or(n);
        let lobe = match self.distribution {
            Distribution::Ggx => ggx_distribution(self.alpha, n, h) * ggx_visibility(self.alpha, n_dot_l, n_dot_v),
            Distribution::Phong => phong_distribution(self.alpha, n, h) * phong_visibility(self.alpha, n_dot_l, n_dot_v),
        };
        self.diffuse + lobe * self.fresnel(v.dot(h).clamp(0.0, 1.0))
    }

    /// Schlick's approximation.
    pub fn fresnel(&self, v_dot_h: f64) -> DVec3 {
        self.reflectance_normal + (DVec3::splat(self.reflectance_grazing) - self.reflectance_normal) * (1.0 - v_dot_h).powi(5)
    }
}

/// sin^2 of the angle between unit vectors, exact for small angles.
pub fn sin_squared(n: DVec3, h: DVec3) -> f64 {
    n.cross(h).length_squared().min(1.0)
}

/// `alpha^2 / (pi ((n.h)^2 (alpha^2 - 1) + 1)^2)`; integrates to 1 against the projected solid angle.
pub fn ggx_distribution(alpha: f64, n: DVec3, h: DVec3) -> f64 {
    let s2 = sin_squared(n, h);
    let bracket = (1.0 - s2) * alpha * alpha + s2;
    (alpha / bracket).powi(2) / PI
}

/// `G2 / (4 (n.l) (n.v))`, height-correlated Smith.
pub fn ggx_visibility(alpha: f64, n_dot_l: f64, n_dot_v: f64) -> f64 {
    let a2 = alpha * alpha;
    let lambda = |near: f64, far: f64| near * (far * far * (1.0 - a2) + a2).sqrt();
    0.5 / (lambda(n_dot_l, n_dot_v) + lambda(n_dot_v, n_dot_l)).max(1e-20)
}

/// Exponent of the Phong distribution that matches alpha: `max(2 / alpha^2 - 2, 0)`.
pub fn phong_exponent(alpha: f64) -> f64 {
    (2.0 / (alpha * alpha) - 2.0).max(0.0)
}

/// `(e + 2) / (2 pi) (n.h)^e`.
pub fn phong_distribution(alpha: f64, n: DVec3, h: DVec3) -> f64 {
    let e = phong_exponent(alpha);
    (e + 2.0) / (2.0 * PI) * (0.5 * e * (-sin_squared(n, h)).ln_1p().max(1e-30f64.ln())).exp()
}

/// `1/G1 - 1`, rational fit of Walter et al. 2007.
pub fn phong_lambda(alpha: f64, n_dot_w: f64) -> f64 {
    let sine = (1.0 - n_dot_w * n_dot_w).max(1e-12).sqrt();
    let a = (0.5 * phong_exponent(alpha) + 1.0).sqrt() * n_dot_w / sine;
    if a >= 1.6 { 0.0 } else { (1.0 + 2.276 * a + 2.577 * a * a) / (3.535 * a + 2.181 * a * a).max(1e-12) - 1.0 }
}

/// `G2 / (4 (n.l) (n.v))` for the Phong distribution.
pub fn phong_visibility(alpha: f64, n_dot_l: f64, n_dot_v: f64) -> f64 {
    let masking = 1.0 + phong_lambda(alpha, n_dot_l) + phong_lambda(alpha, n_dot_v);
    0.25 / (masking * n_dot_l * n_dot_v).max(1e-20)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn direction(cosine: f64, azimuth: f64) -> DVec3 {
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
    }

    /// Integral over the hemisphere of `f(cosine)` times the cosine, by the midpoint rule in log(tan) of the angle, which resolves any lobe.
    fn projected_integral(f: impl Fn(f64) -> f64) -> f64 {
        const STEPS: usize = 20_000;
        let (low, high) = ((1e-9f64).ln(), (1e9f64).ln());
        let step = (high - low) / STEPS as f64;
        (0..STEPS)
            .map(|index| {
                let tangent = (low + (index as f64 + 0.5) * step).exp();
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                // d omega = 2 pi sin d theta, d theta = tan cos^2 d log tan.
                let sine = tangent * cosine;
                f(cosine) * cosine * 2.0 * PI * sine * tangent * cosine * cosine * step
            })
            .sum()
    }

    #[test]
    fn distributions_are_normalised() {
        for alpha in [0.001, 0.01, 0.1, 0.35 * 0.35, 0.5, 1.0] {
            for d in [ggx_distribution as fn(f64, DVec3, DVec3) -> f64, phong_distribution] {
                let total = projected_integral(|cosine| d(alpha, DVec3::Z, direction(cosine, 0.3)));
                assert!((total - 1.0).abs() < 1e-4, "alpha {alpha}: {total}");
            }
        }
    }

    #[test]
    fn reflectance_is_reciprocal_and_not_negative() {
        for distribution in [Distribution::Ggx, Distribution::Phong] {
            for roughness in [0.0, 0.1, 0.4, 1.0] {
                let brdf = Brdf::new(DVec3::new(0.9, 0.5, 0.1), 0.5, roughness, 1.0, distribution);
                for (a, b) in [(0.9, 0.2), (1e-4, 0.7), (0.5, 0.5), (1e-6, 1e-6)] {
                    let (l, v) = (direction(a, 0.0), direction(b, 2.0));
                    let (forth, back) = (brdf.evaluate(DVec3::Z, l, v), brdf.evaluate(DVec3::Z, v, l));
                    assert!(forth.is_finite() && forth.min_element() >= 0.0);
                    assert!((forth - back).abs().max_element() <= 1e-9 * forth.max_element(), "{forth} {back}");
                }
            }
        }
    }

    #[test]
    fn a_white_metal_reflects_no_more_than_it_receives() {
        // The furnace: the specular lobe alone never gains energy, and at low roughness loses little.
        for (roughness, least) in [(0.1, 0.98), (0.35, 0.95), (1.0, 0.3)] {
            let brdf = Brdf::new(DVec3::ONE, 1.0, roughness, 1.0, Distribution::Ggx);
            let v = direction(0.7, 0.0);
            let steps = 1500;
            let mut total = 0.0;
            for i in 0..steps {
                for j in 0..steps {
                    let cosine = (i as f64 + 0.5) / steps as f64;
                    let l = direction(cosine, 2.0 * PI * (j as f64 + 0.5) / steps as f64);
                    total += brdf.evaluate(DVec3::Z, l, v).x * cosine;
                }
            }
            total *= 2.0 * PI / (steps * steps) as f64;
            assert!(total < 1.001 && total > least, "roughness {roughness}: {total}");
        }
    }

    #[test]
    fn light_from_below_is_not_reflected() {
        let brdf = Brdf::new(DVec3::ONE, 0.0, 0.5, 1.0, Distribution::Ggx);
        assert_eq!(brdf.evaluate(DVec3::Z, DVec3::NEG_Z, DVec3::Z), DVec3::ZERO);
        assert_eq!(brdf.evaluate(DVec3::Z, DVec3::Z, DVec3::X), DVec3::ZERO);
    }

    #[test]
    fn specular_zero_is_lambert() {
        let brdf = Brdf::new(DVec3::splat(0.5), 0.0, 0.3, 0.0, Distribution::Ggx);
        let f = brdf.evaluate(DVec3::Z, direction(0.8, 0.0), direction(0.8, PI));
        assert!((f.x - 0.5 / PI).abs() < 1e-12);
    }
}
