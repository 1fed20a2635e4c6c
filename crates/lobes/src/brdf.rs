//! Reflectance of glTF surfaces: Lambert plus a microfacet lobe (glTF 2.0 appendix B, with height-correlated Smith masking; the diffuse part is not
//! scaled by 1 - F).
//!
//! ```text
//!   f = base (1 - metallic) / pi + D G2 F / (4 (n.l) (n.v)),     alpha = max(roughness^2, 0.001)
//! ```
//!
//! n: shading normal, l: to the light, v: to the viewer, h: half vector, D: distribution, G2: masking and shadowing, F: Fresnel term. All directions are
//! unit vectors. GGX never reflects more than it receives; the Phong distribution with this masking does when it is rough and grazed (a white metal of
//! roughness 1 reflects 1.6 times what arrives from 1 degree above the horizon), and so does a bright dielectric's sum of both parts.

use crate::specular_albedo::{specular_albedo_fit, specular_albedo_integrals};
use glam::{DVec3, DVec4};
use std::f64::consts::PI;

/// Smallest alpha; smaller roughness counts as this.
pub const MIN_ALPHA: f64 = 0.001;

/// Reflectance of a dielectric of index of refraction 1.5 at normal incidence (xyz) and at grazing incidence (w).
const DIELECTRIC: DVec4 = DVec4::new(0.04, 0.04, 0.04, 1.0);

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
        Self::with_dielectric(base_color, metallic, roughness, specular, DIELECTRIC, distribution)
    }

    /// As [`Brdf::new`], for a dielectric part that reflects `dielectric` at normal incidence (xyz) and at grazing incidence (w), each in [0, 1].
    pub fn with_dielectric(
        base_color: DVec3,
        metallic: f64,
        roughness: f64,
        specular: f64,
        dielectric: DVec4,
        distribution: Distribution,
    ) -> Self {
        Self {
            diffuse: base_color * (1.0 - metallic) / PI,
            reflectance_normal: specular * dielectric.truncate().lerp(base_color, metallic),
            reflectance_grazing: specular * (dielectric.w + (1.0 - dielectric.w) * metallic),
            alpha: (roughness * roughness).max(MIN_ALPHA),
            distribution,
        }
    }

    /// f(l, v), 1/sr, without the cosine. Zero unless n.l > 0 and n.v > 0.
    pub fn evaluate(&self, n: DVec3, l: DVec3, v: DVec3) -> DVec3 {
        self.evaluate_brdf(n, n, l, v)
    }

    /// As [`Brdf::evaluate`] for a normal `n` that a map has bent away from the geometric one: zero also where l and v lie on different sides of the
    /// surface.
    pub fn evaluate_brdf(&self, n: DVec3, geometric_normal: DVec3, l: DVec3, v: DVec3) -> DVec3 {
        let (n_dot_l, n_dot_v) = (n.dot(l), n.dot(v));
        let sides = geometric_normal.dot(l) * geometric_normal.dot(v);
        if n_dot_l <= 0.0 || n_dot_v <= 0.0 || sides <= 0.0 {
            return DVec3::ZERO;
        }
        if self.reflectance_grazing == 0.0 && self.reflectance_normal == DVec3::ZERO {
            return self.diffuse;
        }
        let h = (l + v).normalize_or(n);
        let lobe = match self.distribution {
            Distribution::Ggx => ggx_distribution(self.alpha, n, h) * ggx_visibility(self.alpha, n_dot_l, n_dot_v),
            Distribution::Phong => phong_distribution(self.alpha, n, h) * phong_visibility(self.alpha, n_dot_l, n_dot_v),
        };
        self.diffuse + lobe * self.fresnel(v.dot(h).clamp(0.0, 1.0))
    }

    /// Schlick's approximation between the two reflectances (Schlick 1994, equation 15), for v.h in [0, 1].
    pub fn fresnel(&self, v_dot_h: f64) -> DVec3 {
        self.reflectance_normal + (DVec3::splat(self.reflectance_grazing) - self.reflectance_normal) * (1.0 - v_dot_h).powi(5)
    }

    /// Share of the light from a direction that the specular lobe reflects, scattered once, in [0, 1] for reflectances in [0, 1]: the fit of
    /// [`crate::specular_albedo`], off by 0.011 of the larger reflectance at the most, for any n.l. Where the Phong distribution reflects more than it
    /// receives under F = 1, its integral counts as 1 there.
    pub fn specular_albedo(&self, n_dot_l: f64) -> DVec3 {
        self.schlick_weighted(specular_albedo_fit(self.alpha, n_dot_l, self.distribution))
    }

    /// As [`Brdf::specular_albedo`], integrated ([`specular_albedo_integrals`]), and nothing cut off.
    pub fn specular_albedo_integral(&self, n_dot_l: f64) -> DVec3 {
        self.schlick_weighted(specular_albedo_integrals(self.alpha, n_dot_l, self.distribution))
    }

    fn schlick_weighted(&self, (all, schlick): (f64, f64)) -> DVec3 {
        self.reflectance_normal * (all - schlick) + DVec3::splat(self.reflectance_grazing * schlick)
    }

    /// About the share of the light from a direction that the surface reflects, diffuse and specular.
    pub fn albedo_estimate(&self, n_dot_l: f64) -> DVec3 {
        self.diffuse * PI + self.specular_albedo(n_dot_l)
    }
}

/// sin^2 of the angle between unit vectors: where 1 - (n.h)^2 would cancel, this keeps its digits.
pub fn sin_squared(n: DVec3, h: DVec3) -> f64 {
    n.cross(h).length_squared().min(1.0)
}

/// GGX, `alpha^2 / (pi ((n.h)^2 (alpha^2 - 1) + 1)^2)`, 1/sr, for n.h >= 0 (Walter et al. 2007, Microfacet Models for Refraction through Rough Surfaces,
/// equation 33). Integrates to 1 against the projected solid angle.
pub fn ggx_distribution(alpha: f64, n: DVec3, h: DVec3) -> f64 {
    let s2 = sin_squared(n, h);
    let bracket = (1.0 - s2) * alpha * alpha + s2;
    (alpha / bracket).powi(2) / PI
}

/// `G2 / (4 (n.l) (n.v))`, height-correlated Smith (Heitz 2014, Understanding the Masking-Shadowing Function, equation 99), for cosines in (0, 1].
pub fn ggx_visibility(alpha: f64, n_dot_l: f64, n_dot_v: f64) -> f64 {
    let a2 = alpha * alpha;
    let lambda = |near: f64, far: f64| near * (far * far * (1.0 - a2) + a2).sqrt();
    0.5 / (lambda(n_dot_l, n_dot_v) + lambda(n_dot_v, n_dot_l)).max(1e-20)
}

/// Exponent of the Phong distribution that matches alpha: `max(2 / alpha^2 - 2, 0)`, so 0 to 2e6 for alpha in [0.001, 1].
pub fn phong_exponent(alpha: f64) -> f64 {
    (2.0 / (alpha * alpha) - 2.0).max(0.0)
}

/// `(e + 2) / (2 pi) (n.h)^e`, 1/sr, for n.h >= 0 (Walter et al. 2007, equation 30). The power is exp(e/2 log(1 - sin^2)), exact for sharp lobes.
pub fn phong_distribution(alpha: f64, n: DVec3, h: DVec3) -> f64 {
    let e = phong_exponent(alpha);
    (e + 2.0) / (2.0 * PI) * (0.5 * e * (-sin_squared(n, h)).ln_1p().max(1e-30f64.ln())).exp()
}

/// Smith's Lambda = 1/G1 - 1 for the Phong distribution: the rational fit for Beckmann's (Walter et al. 2007, equation 27) at a = sqrt(e/2 + 1) / tan,
/// good to 0.35 % of G1 there. Just below a = 1.6 the fit passes 1, and this is down to -7e-5.
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

    const DISTRIBUTIONS: [Distribution; 2] = [Distribution::Ggx, Distribution::Phong];
    const ROUGHNESS: [f64; 7] = [0.0, 0.1, 0.2, 0.35, 0.6, 0.8, 1.0];

    fn direction(cosine: f64, azimuth: f64) -> DVec3 {
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
    }

    /// Integral over the hemisphere of `f(direction)`, by the midpoint rule in azimuth and in the logarithm of the angle's tangent, which resolves any
    /// lobe about +Z.
    fn integral(steps: usize, azimuths: usize, f: impl Fn(DVec3) -> f64) -> f64 {
        let (low, high) = ((1e-9f64).ln(), (1e9f64).ln());
        let step = (high - low) / steps as f64;
        let turn = 2.0 * PI / azimuths as f64;
        let mut total = 0.0;
        for index in 0..steps {
            let tangent = (low + (index as f64 + 0.5) * step).exp();
            let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
            // d omega = sin d theta d phi, d theta = tan cos^2 d log tan.
            let measure = tangent * cosine * tangent * cosine * cosine * step * turn;
            total += (0..azimuths).map(|j| f(direction(cosine, (j as f64 + 0.5) * turn))).sum::<f64>() * measure;
        }
        total
    }

    /// Share of the light from all directions of a white sky that is reflected to `v`, integrated over half vectors (d l = 4 v.h d h), where lobes are.
    fn specular_albedo(brdf: &Brdf, v: DVec3) -> f64 {
        specular_albedo_of(400, 96, brdf, v)
    }

    fn specular_albedo_of(steps: usize, azimuths: usize, brdf: &Brdf, v: DVec3) -> f64 {
        integral(steps, azimuths, |h| {
            let v_dot_h = v.dot(h);
            let l = 2.0 * v_dot_h * h - v;
            if v_dot_h <= 0.0 || l.z <= 0.0 { 0.0 } else { (brdf.evaluate(DVec3::Z, l, v) - brdf.diffuse).x * l.z * 4.0 * v_dot_h }
        })
    }

    fn white_metal(roughness: f64, distribution: Distribution) -> Brdf {
        Brdf::new(DVec3::ONE, 1.0, roughness, 1.0, distribution)
    }

    #[test]
    fn distributions_are_normalised() {
        for alpha in [0.001, 0.01, 0.1, 0.35 * 0.35, 0.5, 1.0] {
            for d in [ggx_distribution as fn(f64, DVec3, DVec3) -> f64, phong_distribution] {
                let total = integral(20_000, 1, |h| d(alpha, DVec3::Z, h) * h.z);
                assert!((total - 1.0).abs() < 1e-6, "alpha {alpha}: {total}");
            }
        }
    }

    #[test]
    fn stable_forms_equal_the_textbook_ones_where_those_can_be_computed() {
        let naive_ggx = |a: f64, c: f64| a * a / (PI * (c * c * (a * a - 1.0) + 1.0).powi(2));
        let naive_phong = |a: f64, c: f64| (2.0 / (a * a)) / (2.0 * PI) * c.powf(2.0 / (a * a) - 2.0);
        let ggx_lambda = |a: f64, c: f64| ((1.0 + a * a * (1.0 - c * c) / (c * c)).sqrt() - 1.0) / 2.0;
        let phong_lambda_naive = |a: f64, c: f64| {
            let t = (a.powi(-2)).sqrt() * c / (1.0 - c * c).sqrt();
            let g1 = if t < 1.6 { (3.535 * t + 2.181 * t * t) / (1.0 + 2.276 * t + 2.577 * t * t) } else { 1.0 };
            1.0 / g1 - 1.0
        };
        let close = |x: f64, y: f64| assert!((x - y).abs() <= 1e-9 * y.abs() + 1e-300, "{x} {y}");
        for alpha in [0.05, 0.2, 0.5, 0.9, 1.0] {
            for c in [0.999, 0.9, 0.5, 0.1, 0.01] {
                let h = direction(c, 1.0);
                close(ggx_distribution(alpha, DVec3::Z, h), naive_ggx(alpha, c));
                close(phong_distribution(alpha, DVec3::Z, h), naive_phong(alpha, c));
                for d in [0.9, 0.2, 0.03] {
                    close(ggx_visibility(alpha, c, d), 1.0 / (1.0 + ggx_lambda(alpha, c) + ggx_lambda(alpha, d)) / (4.0 * c * d));
                    close(
                        phong_visibility(alpha, c, d),
                        1.0 / (1.0 + phong_lambda_naive(alpha, c) + phong_lambda_naive(alpha, d)) / (4.0 * c * d),
                    );
                }
            }
        }
    }

    #[test]
    fn phong_masking_joins_at_the_end_of_its_fit() {
        // At alpha 1, a = 1 / tan; 1.6 is the end.
        let lambda = |a: f64| phong_lambda(1.0, a / (1.0 + a * a).sqrt());
        let lowest = (1..160_000).map(|index| lambda(f64::from(index) * 1e-5)).fold(f64::INFINITY, f64::min);
        assert!(lowest > -7e-5 && lowest < -5e-5, "{lowest:e}");
        assert!((lambda(1.6 - 1e-9) - lambda(1.6 + 1e-9)).abs() < 7e-5);
        assert!(lambda(0.01) > 25.0);
    }

    #[test]
    fn limits_are_those_of_a_mirror_and_of_a_uniform_distribution() {
        assert_eq!((phong_exponent(0.001), phong_exponent(1.0)), (2.0 / (0.001 * 0.001) - 2.0, 0.0));
        for d in [ggx_distribution as fn(f64, DVec3, DVec3) -> f64, phong_distribution] {
            let peak = d(MIN_ALPHA, DVec3::Z, DVec3::Z);
            assert!((peak * PI * MIN_ALPHA * MIN_ALPHA - 1.0).abs() < 1e-12, "{peak}");
            for cosine in [1.0, 0.5, 1e-6] {
                assert!((d(1.0, DVec3::Z, direction(cosine, 0.0)) * PI - 1.0).abs() < 1e-9);
            }
            // A degree off, nothing is left of the sharpest Phong lobe and 1e-5 of GGX's.
            assert!(d(MIN_ALPHA, DVec3::Z, direction(0.9998477, 0.0)) < 2e-5 * peak);
        }
        assert_eq!(Brdf::new(DVec3::ONE, 0.0, 0.0, 1.0, Distribution::Ggx).alpha, MIN_ALPHA);
    }

    #[test]
    fn reflectance_at_both_ends_of_the_fresnel_term() {
        let gold = Brdf::new(DVec3::new(1.0, 0.8, 0.3), 1.0, 0.3, 0.5, Distribution::Ggx);
        assert!((gold.fresnel(1.0) - DVec3::new(0.5, 0.4, 0.15)).length() < 1e-12);
        assert!((gold.fresnel(0.0) - DVec3::splat(0.5)).length() < 1e-12);
        let plastic = Brdf::new(DVec3::new(1.0, 0.8, 0.3), 0.0, 0.3, 1.0, Distribution::Ggx);
        assert!((plastic.fresnel(1.0) - DVec3::splat(0.04)).length() < 1e-12);
    }

    #[test]
    fn reflectance_is_reciprocal_finite_and_not_negative() {
        for distribution in DISTRIBUTIONS {
            for roughness in ROUGHNESS {
                let brdf = Brdf::new(DVec3::new(0.9, 0.5, 0.1), 0.5, roughness, 1.0, distribution);
                for (a, b) in [(0.9, 0.2), (1e-4, 0.7), (0.5, 0.5), (1e-6, 1e-6), (1.0, 1.0), (1e-9, 1.0)] {
                    for azimuth in [0.0, 2.0, PI] {
                        let (l, v) = (direction(a, 0.0), direction(b, azimuth));
                        let (forth, back) = (brdf.evaluate(DVec3::Z, l, v), brdf.evaluate(DVec3::Z, v, l));
                        assert!(forth.is_finite() && forth.min_element() >= 0.0, "{forth}");
                        // The half vector of opposite grazing directions is itself rounded to 1e-10.
                        assert!((forth - back).abs().max_element() <= 1e-6 * forth.max_element(), "{forth} {back}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_white_metal_in_a_furnace_reflects_no_more_than_it_receives() {
        for roughness in ROUGHNESS {
            for n_dot_v in [0.02, 0.1, 0.3, 0.7, 1.0] {
                let total = specular_albedo(&white_metal(roughness, Distribution::Ggx), direction(n_dot_v, 0.0));
                assert!(total < 1.0 + 1e-4, "roughness {roughness}, n.v {n_dot_v}: {total}");
                // What masking takes is less than alpha, away from the horizon.
                if n_dot_v >= 0.3 {
                    assert!(total > 1.0 - (roughness * roughness).max(MIN_ALPHA), "roughness {roughness}, n.v {n_dot_v}: {total}");
                }
            }
        }
    }

    #[test]
    fn the_phong_distribution_gains_energy_only_where_it_is_said_to() {
        for roughness in ROUGHNESS {
            for n_dot_v in [0.7, 1.0] {
                let total = specular_albedo(&white_metal(roughness, Distribution::Phong), direction(n_dot_v, 0.0));
                assert!(total < 1.01, "roughness {roughness}, n.v {n_dot_v}: {total}");
            }
        }
        let grazed = specular_albedo(&white_metal(1.0, Distribution::Phong), direction(0.02, 0.0));
        assert!((grazed - 1.62).abs() < 0.01, "{grazed}");
    }

    #[test]
    fn the_specular_albedo_is_what_the_reflectance_integrates_to() {
        for distribution in DISTRIBUTIONS {
            for (base, metallic) in [(DVec3::ZERO, 0.0), (DVec3::ONE, 1.0), (DVec3::new(0.9, 0.5, 0.1), 0.7)] {
                for roughness in ROUGHNESS {
                    for n_dot_l in [0.1, 0.2, 0.5, 1.0] {
                        let brdf = Brdf::new(base, metallic, roughness, 1.0, distribution);
                        // Where the horizon cuts half vectors off, the rule of this module is good to one of its steps.
                        let sum = specular_albedo_of(1600, 32, &brdf, direction(n_dot_l, 0.0));
                        let exact = brdf.specular_albedo_integral(n_dot_l).x;
                        assert!((sum - exact).abs() < 5e-4, "roughness {roughness}, n.l {n_dot_l}: {sum} {exact}");
                        // Where the Phong lobe reflects more than it receives, the fit is of what it receives.
                        let (all, schlick) = specular_albedo_integrals(brdf.alpha, n_dot_l, distribution);
                        let error = (brdf.specular_albedo(n_dot_l) - brdf.schlick_weighted((all.min(1.0), schlick))).x;
                        assert!(error.abs() < 0.011, "roughness {roughness}, n.l {n_dot_l}: {error}");
                        assert_eq!(brdf.albedo_estimate(n_dot_l), brdf.diffuse * PI + brdf.specular_albedo(n_dot_l));
                    }
                }
            }
        }
        let lambert = Brdf::new(DVec3::splat(0.3), 0.0, 0.5, 0.0, Distribution::Ggx);
        assert!((lambert.albedo_estimate(0.5).x - 0.3).abs() < 1e-12);
        assert_eq!(lambert.specular_albedo(0.5), DVec3::ZERO);
    }

    #[test]
    fn light_from_below_is_not_reflected() {
        let brdf = Brdf::new(DVec3::ONE, 0.0, 0.5, 1.0, Distribution::Ggx);
        assert_eq!(brdf.evaluate(DVec3::Z, DVec3::NEG_Z, DVec3::Z), DVec3::ZERO);
        assert_eq!(brdf.evaluate(DVec3::Z, DVec3::Z, DVec3::X), DVec3::ZERO);
    }

    #[test]
    fn light_through_the_surface_is_not_reflected() {
        let brdf = Brdf::new(DVec3::ONE, 0.0, 0.5, 1.0, Distribution::Ggx);
        // A bent normal that both directions see, of a surface that they see from different sides.
        let (geometric_normal, n) = (DVec3::Z, DVec3::new(1.0, 0.0, 0.2).normalize());
        let (above, below) = (DVec3::new(1.0, 0.0, 0.5).normalize(), DVec3::new(1.0, 0.0, -0.1).normalize());
        assert!(brdf.evaluate(n, above, below).x > 0.0);
        assert_eq!(brdf.evaluate_brdf(n, geometric_normal, above, below), DVec3::ZERO);
        assert_eq!(brdf.evaluate_brdf(n, geometric_normal, above, above), brdf.evaluate(n, above, above));
        // From below, both on one side: reflected.
        assert!(brdf.evaluate_brdf(n, geometric_normal, below, below).x > 0.0);
    }

    #[test]
    fn specular_zero_is_lambert() {
        let brdf = Brdf::new(DVec3::splat(0.5), 0.0, 0.3, 0.0, Distribution::Ggx);
        let f = brdf.evaluate(DVec3::Z, direction(0.8, 0.0), direction(0.8, PI));
        assert!((f.x - 0.5 / PI).abs() < 1e-12);
    }
}
