//! Directions drawn from the densities that integrals over the sphere need, and those densities (1/sr).
//!
//! Every `sample_x` maps a point `u` of the unit square, both coordinates in [0, 1), to a unit vector. `u[0]` chooses the angle to the axis and is 0 there,
//! `u[1]` the azimuth in turns, about a tangent that depends on the axis alone. Axes, normals and views are unit vectors.
//!
//! Polar angles are drawn as versines, 1 - cos, or as sines and cosines side by side, never as cosines alone: 1 - cos of a lobe of sharpness 1e8 is 1e-8,
//! which a cosine in 32 bits does not hold.

use crate::{
    brdf::{Brdf, Distribution, ggx_distribution, phong_distribution, sin_squared},
    luminance,
    sg::{sg_evaluate, sg_integral},
    special::decay_mean,
};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Smallest v.h that [`phong_reflection_pdf`] divides by; directions below it, a share of about 1e-12 of all, get a density that is too small.
const MIN_V_DOT_H: f64 = 1e-6;

/// Cosine and sine of an angle in turns, for any number.
pub fn unit_circle(turns: f64) -> DVec2 {
    let (sine, cosine) = (TAU * turns).sin_cos();
    DVec2::new(cosine, sine)
}

/// The unit vector with the given cosine and sine to `axis`, at an azimuth in turns.
fn around(axis: DVec3, cosine: f64, sine: f64, turns: f64) -> DVec3 {
    axis * cosine + across(axis, turns) * sine
}

/// The unit vector perpendicular to `axis` at an azimuth in turns about the tangent of Duff et al. 2017 (Building an Orthonormal Basis, Revisited).
fn across(axis: DVec3, turns: f64) -> DVec3 {
    let sign = if axis.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (sign + axis.z);
    let tangent = DVec3::new(1.0 + sign * axis.x * axis.x * a, sign * axis.x * axis.y * a, -sign * axis.x);
    let circle = unit_circle(turns);
    tangent * circle.x + axis.cross(tangent) * circle.y
}

/// The unit vector whose cosine to `axis` is `1 - versine`, at an azimuth in turns; versine in [0, 2]. Its angle to the axis is exact however small.
pub fn direction_about(axis: DVec3, versine: f64, turns: f64) -> DVec3 {
    around(axis, 1.0 - versine, (versine * (2.0 - versine)).max(0.0).sqrt(), turns)
}

/// Uniform over the sphere; `u[0]` 0 is +Z.
pub fn sample_sphere(u: [f64; 2]) -> DVec3 {
    // versine (2 - versine) in this form keeps the digits of 1 - u.
    around(DVec3::Z, 1.0 - 2.0 * u[0], 2.0 * (u[0] * (1.0 - u[0])).sqrt(), u[1])
}

/// Density of [`sample_sphere`].
pub fn sphere_pdf() -> f64 {
    0.25 / PI
}

/// Uniform over the hemisphere about `normal`.
pub fn sample_hemisphere(normal: DVec3, u: [f64; 2]) -> DVec3 {
    direction_about(normal, u[0], u[1])
}

/// Density of [`sample_hemisphere`]: 0 unless n.direction > 0.
pub fn hemisphere_pdf(normal: DVec3, direction: DVec3) -> f64 {
    if normal.dot(direction) > 0.0 { 0.5 / PI } else { 0.0 }
}

/// Proportional to the cosine to `normal` (Malley's method: a disk, lifted).
pub fn sample_cosine_hemisphere(normal: DVec3, u: [f64; 2]) -> DVec3 {
    around(normal, (1.0 - u[0]).sqrt(), u[0].sqrt(), u[1])
}

/// Density of [`sample_cosine_hemisphere`]: cos / pi, 0 below the horizon.
pub fn cosine_hemisphere_pdf(normal: DVec3, direction: DVec3) -> f64 {
    normal.dot(direction).max(0.0) / PI
}

/// Uniform over the cone about `axis` whose half angle has the cosine `1 - versine`, versine in (0, 2]. For a sphere that covers the squared sine s of
/// its angular radius, the versine is `s / (1 + sqrt(1 - s))`, without cancellation. Versine 0 gives the axis.
pub fn sample_cone(axis: DVec3, versine: f64, u: [f64; 2]) -> DVec3 {
    direction_about(axis, versine * u[0], u[1])
}

/// Density of [`sample_cone`]: `1 / (2 pi versine)` within, 0 outside. The test is `|direction - axis|^2 <= 2 versine`; what the direction's own rounding
/// does to a sample on the rim is for the caller, who knows the density without asking where the direction is his own sample.
pub fn cone_pdf(axis: DVec3, versine: f64, direction: DVec3) -> f64 {
    if (direction - axis).length_squared() <= 2.0 * versine { 0.5 / (PI * versine) } else { 0.0 }
}

/// `1 - cos` of the angle between a direction drawn from an SG and its axis, in [0, 2], for sharpness in [0, 1e8] and u in [0, 1].
///
/// The inverse of the distribution `(1 - e^{-sharpness x}) / (1 - e^{-2 sharpness})` of x = 1 - cos: `-log(1 - u (1 - e^{-2 sharpness})) / sharpness`
/// (Jakob 2012, Numerically Stable Sampling of the von Mises Fisher Distribution on S2, gives the cosine; the form without cancellation and without
/// 0/0 at sharpness 0 is of this project).
pub fn sample_sg_versine(sharpness: f64, u: f64) -> f64 {
    let mean = decay_mean(2.0 * sharpness);
    // u (1 - e^{-2 sharpness}).
    let share = 2.0 * sharpness * u * mean;
    if share > 0.5 {
        // 1 - share, with the digits of 1 - u. At u = 1 this is the logarithm of 0 for a sharp lobe, and the minimum the right answer.
        let rest = (1.0 - u) + u * (-2.0 * sharpness).exp();
        return (-rest.ln() / sharpness).min(2.0);
    }
    let stretch = if share < 1e-16 { 1.0 } else { -(-share).ln_1p() / share };
    (2.0 * u * mean * stretch).min(2.0)
}

/// Proportional to the SG `exp(sharpness (w.axis - 1))`: the von Mises-Fisher distribution. Sharpness in [0, 1e8]; 0 is uniform over the sphere.
pub fn sample_sg(axis: DVec3, sharpness: f64, u: [f64; 2]) -> DVec3 {
    direction_about(axis, sample_sg_versine(sharpness, u[0]), u[1])
}

/// Density of [`sample_sg`].
pub fn sg_pdf(axis: DVec3, sharpness: f64, direction: DVec3) -> f64 {
    sg_evaluate(axis, sharpness, direction) / sg_integral(sharpness)
}

/// Half vector of a Phong distribution, proportional to `cos^(exponent + 1)`, exponent in [0, 2e6] (Walter et al. 2007, Microfacet Models for Refraction
/// through Rough Surfaces, equation 38).
pub fn sample_phong_half_vector(exponent: f64, normal: DVec3, u: [f64; 2]) -> DVec3 {
    let log_cosine = (-u[0]).ln_1p() / (exponent + 2.0);
    let (cosine, versine) = (log_cosine.exp(), -log_cosine.exp_m1());
    around(normal, cosine, (versine * (1.0 + cosine)).sqrt(), u[1])
}

/// Density of [`sample_phong_half_vector`]: `(exponent + 2) / (2 pi) (n.h)^(exponent + 1)`, 0 below the horizon.
pub fn phong_half_vector_pdf(exponent: f64, normal: DVec3, h: DVec3) -> f64 {
    let n_dot_h = normal.dot(h);
    if n_dot_h <= 0.0 {
        return 0.0;
    }
    // The logarithm of the cosine, from the sine near the axis and from the cosine near the horizon.
    let s2 = sin_squared(normal, h);
    let log_cosine = if s2 < 0.5 { 0.5 * (-s2).ln_1p() } else { n_dot_h.ln() };
    (exponent + 2.0) / TAU * ((exponent + 1.0) * log_cosine).exp()
}

/// Half vector of GGX, proportional to `D(h) (n.h)`, alpha in [0.001, 1] (Walter et al. 2007, equation 35, as sine and cosine).
pub fn sample_ggx_half_vector(alpha: f64, normal: DVec3, u: [f64; 2]) -> DVec3 {
    let (cosine, sine) = ((1.0 - u[0]).sqrt(), alpha * u[0].sqrt());
    let length = ((1.0 - u[0]) + alpha * alpha * u[0]).sqrt();
    around(normal, cosine / length, sine / length, u[1])
}

/// Density of [`sample_ggx_half_vector`]: `D(h) (n.h)`, 0 below the horizon.
pub fn ggx_half_vector_pdf(alpha: f64, normal: DVec3, h: DVec3) -> f64 {
    ggx_distribution(alpha, normal, h) * normal.dot(h).max(0.0)
}

/// Half vector of GGX among those that the viewer sees, proportional to `D(h) max(v.h, 0)`, alpha in [0.001, 1] (Dupuy and Benyoub 2023, Sampling Visible
/// GGX Normals with Spherical Caps). For n.v >= 0; a view below the horizon counts as one on it.
///
/// Heights are products and never differences (the paper's z, plus v's, is `(1 - u)(1 + v_z)`): form of this project.
pub fn sample_ggx_visible_normal(alpha: f64, normal: DVec3, v: DVec3, u: [f64; 2]) -> DVec3 {
    let n_dot_v = normal.dot(v);
    // The view where the microsurface is stretched to a hemisphere: a part along the normal and one across.
    let (along, part) = (n_dot_v.max(0.0), (v - normal * n_dot_v) * alpha);
    let length = (along * along + part.length_squared()).sqrt();
    let (along, part) = (along / length, part / length);
    // A point of the cap from the pole down to -along, plus the view: the height of the sum, and what it has across.
    let height = (1.0 - u[0]) * (1.0 + along);
    let sine = (u[0] * (1.0 + along) * (height + part.length_squared() / (1.0 + along))).sqrt();
    let sum = part + across(normal, u[1]) * sine;
    (sum * alpha + normal * height).normalize()
}

/// Density of [`sample_ggx_visible_normal`]: `G1(v) D(h) max(v.h, 0) / (n.v)`, written without that division; 0 for h below the horizon.
pub fn ggx_visible_normal_pdf(alpha: f64, normal: DVec3, v: DVec3, h: DVec3) -> f64 {
    if normal.dot(h) <= 0.0 {
        0.0
    } else {
        ggx_distribution(alpha, normal, h) * v.dot(h).max(0.0) * masking_over_cosine(alpha, normal.dot(v))
    }
}

/// Smith's `G1(v) / (n.v)` for GGX: `2 / (n.v + sqrt(alpha^2 + (1 - alpha^2) (n.v)^2))`.
fn masking_over_cosine(alpha: f64, n_dot_v: f64) -> f64 {
    let (a2, c) = (alpha * alpha, n_dot_v.max(0.0));
    2.0 / (c + (a2 + (1.0 - a2) * c * c).sqrt())
}

/// Density of the reflection of `v` about [`sample_ggx_visible_normal`]: that of the half vector over `4 v.h`. Not 0 for l below the horizon, where 1 % of
/// the reflections go at alpha 0.09, 6 % at 0.25 and a half at 1, seen from the normal; fewer at grazing views.
pub fn ggx_reflection_pdf(alpha: f64, normal: DVec3, v: DVec3, l: DVec3) -> f64 {
    let h = (l + v).normalize_or(normal);
    if normal.dot(h) <= 0.0 { 0.0 } else { 0.25 * ggx_distribution(alpha, normal, h) * masking_over_cosine(alpha, normal.dot(v)) }
}

/// Density of the reflection of `v` about [`sample_phong_half_vector`] with the exponent of `alpha`: `D(h) (n.h) / (4 v.h)`. Not 0 for l below the
/// horizon. Half vectors that the viewer does not see have no reflection, so the integral is their complement.
pub fn phong_reflection_pdf(alpha: f64, normal: DVec3, v: DVec3, l: DVec3) -> f64 {
    let sum = l + v;
    let h = sum.normalize_or(normal);
    // v.h is half the length of the sum.
    let v_dot_h = (0.5 * sum.length()).max(MIN_V_DOT_H);
    0.25 * phong_distribution(alpha, normal, h) * normal.dot(h).max(0.0) / v_dot_h
}

/// A direction to the light, drawn for a surface's reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrdfSample {
    /// Unit vector above the horizon.
    pub direction: DVec3,
    /// Density, 1/sr: [`brdf_pdf`] there.
    pub pdf: f64,
    /// `f(l, v) (n.l) / pdf`; its mean over u, with 0 where there is no sample, is the share of a white sky's light that is reflected to the viewer.
    pub weight: DVec3,
}

/// How often [`sample_brdf`] takes the specular lobe: the luminance of the specular part of [`Brdf::albedo_estimate`] over that of the whole; 0 for
/// a black surface. What the estimate gets wrong costs variance only.
pub fn specular_probability(brdf: &Brdf, n_dot_v: f64) -> f64 {
    let total = brdf.albedo_estimate(n_dot_v.max(0.0));
    let (all, specular) = (luminance(total), luminance(total - brdf.diffuse * PI));
    if all > 0.0 { (specular / all).clamp(0.0, 1.0) } else { 0.0 }
}

/// One direction for the whole of a BRDF: cosine-weighted, or a reflection about a (GGX: visible) half vector, `u[0]` choosing which and then used up
/// to 1 again. None for n.v <= 0, and where a reflection goes below the horizon. About the shading normal alone: where a map has bent it, the caller
/// drops directions that the geometric normal forbids.
pub fn sample_brdf(brdf: &Brdf, n: DVec3, v: DVec3, u: [f64; 2]) -> Option<BrdfSample> {
    let n_dot_v = n.dot(v);
    if n_dot_v <= 0.0 {
        return None;
    }
    let probability = specular_probability(brdf, n_dot_v);
    let direction = if u[0] < probability {
        let u = [u[0] / probability, u[1]];
        let h = match brdf.distribution {
            Distribution::Ggx => sample_ggx_visible_normal(brdf.alpha, n, v, u),
            Distribution::Phong => sample_phong_half_vector(crate::brdf::phong_exponent(brdf.alpha), n, u),
        };
        let v_dot_h = v.dot(h);
        if v_dot_h <= 0.0 {
            return None;
        }
        h * (2.0 * v_dot_h) - v
    } else {
        sample_cosine_hemisphere(n, [((u[0] - probability) / (1.0 - probability)).min(1.0 - f64::EPSILON), u[1]])
    };
    let pdf = brdf_pdf(brdf, n, v, direction);
    (pdf > 0.0).then(|| BrdfSample { direction, pdf, weight: brdf.evaluate(n, direction, v) * (n.dot(direction) / pdf) })
}

/// Density of [`sample_brdf`], 1/sr: 0 unless n.l > 0 and n.v > 0. Its integral is 1 less the share of draws without a sample.
pub fn brdf_pdf(brdf: &Brdf, n: DVec3, v: DVec3, l: DVec3) -> f64 {
    let (n_dot_l, n_dot_v) = (n.dot(l), n.dot(v));
    if n_dot_l <= 0.0 || n_dot_v <= 0.0 {
        return 0.0;
    }
    let probability = specular_probability(brdf, n_dot_v);
    let specular = match brdf.distribution {
        _ if probability == 0.0 => 0.0,
        Distribution::Ggx => ggx_reflection_pdf(brdf.alpha, n, v, l),
        Distribution::Phong => phong_reflection_pdf(brdf.alpha, n, v, l),
    };
    (1.0 - probability) * n_dot_l / PI + probability * specular
}
