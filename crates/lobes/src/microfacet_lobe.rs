//! Microfacet reflectance as lobes: normal distribution functions (NDF) as SGs, what the view makes of them (reflection lobes), and the radiance that a
//! glossy surface reflects of an SG light ([`glossy`]).
//!
//! alpha is in [0.001, 1] throughout. n: shading normal, o: to the viewer, h: half vector; all unit vectors.

pub mod glossy;

pub use glossy::*;

use crate::{asg::AnisotropicSphericalGaussian, brdf::phong_visibility, sg::SphericalGaussian, special::decay_mean_upper};
use glam::DVec3;
use std::f64::consts::PI;

/// An SG about the normal that stands for a normal distribution, or for a part of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NdfLobe {
    /// At least 0; 0 where [`ndf_sharpness_ggx_broad`] has alpha 1.
    pub sharpness: f64,
    /// Value where the half vector is the normal, 1/sr.
    pub amplitude: f64,
}

impl NdfLobe {
    /// The lobe about a normal.
    pub fn about(self, normal: DVec3) -> SphericalGaussian {
        SphericalGaussian { axis: normal, sharpness: self.sharpness, amplitude: self.amplitude }
    }
}

/// Beckmann's distribution, `exp(-tan^2 / alpha^2) / (pi alpha^2 cos^4)`, 1/sr, for n.h >= 0 (Walter et al. 2007, Microfacet Models for Refraction through
/// Rough Surfaces, equation 25). Integrates to 1 against the projected solid angle.
///
/// sin^2 is `d (1 - d/4)` with `d = |h - n|^2`: the cross product of nearly parallel vectors has lost the digits that a sharp lobe needs.
pub fn beckmann_distribution(alpha: f64, n: DVec3, h: DVec3) -> f64 {
    let d = (h - n).length_squared();
    let cosine_squared = n.dot(h).powi(2).max(1e-6);
    let tangent_squared = (d * (1.0 - 0.25 * d)).max(0.0) / cosine_squared;
    let width = alpha * cosine_squared;
    (-tangent_squared / (alpha * alpha)).exp() / (PI * width * width)
}

/// `G2 / (4 (n.l) (n.v))` for Beckmann's distribution, height-correlated Smith with the rational fit for Lambda (Walter et al. 2007, equation 27;
/// within 0.35 %), for cosines in (0, 1]. The Phong distribution of the same alpha borrows its masking from here, so this is [`phong_visibility`].
pub fn beckmann_visibility(alpha: f64, n_dot_l: f64, n_dot_v: f64) -> f64 {
    phong_visibility(alpha, n_dot_l, n_dot_v)
}

/// Sharpness of the SG with the curvature of Beckmann's distribution at the normal, `2 / alpha^2` (Wang et al. 2009, All-Frequency Rendering of Dynamic,
/// Spatially-Varying Reflectance, section 3).
///
/// With the true peak the L1 error is 0.002 of the integral at alpha 0.05, 0.010 at 0.1, 0.039 at 0.2, 0.087 at 0.3, 0.23 at 0.5, 0.60 at 1.
pub fn ndf_sharpness_beckmann(alpha: f64) -> f64 {
    2.0 / (alpha * alpha)
}

/// Sharpness of the SG with the curvature of the GGX distribution at the normal for small alpha, `2 / alpha^2`.
///
/// L1 error with the true peak: 0.41 of the integral at small alpha, 0.36 at 0.5, 0.57 at 1. No single SG does better than 0.36 at small alpha, for
/// it has no tail; see [`ggx_lobes_two`].
pub fn ndf_sharpness_ggx(alpha: f64) -> f64 {
    2.0 / (alpha * alpha)
}

/// Sharpness for broad GGX distributions, `2 / alpha^2 - 2`, 0 at alpha 1, where GGX is constant. For alpha above 0.5: L1 error 0.35 at 0.5, 0.18 at 0.7,
/// 0 at 1. 0 for alpha above 1.
pub fn ndf_sharpness_ggx_broad(alpha: f64) -> f64 {
    (2.0 * (1.0 - alpha) * (1.0 + alpha) / (alpha * alpha)).max(0.0)
}

/// Sharpness of a Phong distribution `(n.h)^exponent`: `exponent + 1`, for exponents from 0.
///
/// L1 error 0.19 of the integral at exponent 1, 0.09 at 5, 0.051 at 10, 0.005 at 100; with `exponent` itself it is twice that.
pub fn ndf_sharpness_phong(exponent: f64) -> f64 {
    exponent + 1.0
}

/// Amplitude, 1/sr, with which an SG about the normal integrates to 1 against the projected solid angle, as a microfacet NDF has to:
/// `1 / (2 pi decay_mean_upper(sharpness))`. Sharpness in [0, 1e8]; 1/pi at 0.
pub fn ndf_amplitude_projected(sharpness: f64) -> f64 {
    0.5 / (PI * decay_mean_upper(sharpness))
}

/// Beckmann's distribution as one SG with its curvature and its peak.
pub fn beckmann_lobe(alpha: f64) -> NdfLobe {
    NdfLobe { sharpness: ndf_sharpness_beckmann(alpha), amplitude: 1.0 / (PI * alpha * alpha) }
}

/// The Phong distribution `(exponent + 2) / (2 pi) (n.h)^exponent` as one SG with its peak. (`(exponent + 1) / (2 pi)`, which is also in print,
/// integrates to 1 against the plain solid angle and loses 8 % at exponent 10.)
pub fn phong_lobe(exponent: f64) -> NdfLobe {
    NdfLobe { sharpness: ndf_sharpness_phong(exponent), amplitude: (exponent + 2.0) / (2.0 * PI) }
}

/// GGX as one SG with its peak; for alpha above 0.5 with [`ndf_sharpness_ggx_broad`], else with [`ndf_sharpness_ggx`]. L1 error about 0.41 up to
/// alpha 0.3, less above 0.5.
pub fn ggx_lobe_one(alpha: f64) -> NdfLobe {
    let sharpness = if alpha > 0.5 { ndf_sharpness_ggx_broad(alpha) } else { ndf_sharpness_ggx(alpha) };
    NdfLobe { sharpness, amplitude: 1.0 / (PI * alpha * alpha) }
}

/// Energies and sharpnesses (in units of `2 / alpha^2`) of two SGs whose sum is GGX.
pub const GGX_LOBES_TWO: [(f64, f64); 2] = [(0.554678, 1.469881), (0.445322, 0.224401)];

/// As [`GGX_LOBES_TWO`], of three SGs.
pub const GGX_LOBES_THREE: [(f64, f64); 3] = [(0.289911, 2.291398), (0.497579, 0.593012), (0.212510, 0.094761)];

/// GGX as a sum of two SGs: L1 error 0.117 of the integral for small alpha. For alpha up to 0.5; above, [`ggx_lobe_one`] is better. A form of this
/// project.
pub fn ggx_lobes_two(alpha: f64) -> [NdfLobe; 2] {
    GGX_LOBES_TWO.map(|share| part_of_ggx(alpha, share))
}

/// GGX as a sum of three SGs: L1 error 0.047 of the integral for small alpha. For alpha up to 0.5. A form of this project.
pub fn ggx_lobes_three(alpha: f64) -> [NdfLobe; 3] {
    GGX_LOBES_THREE.map(|share| part_of_ggx(alpha, share))
}

fn part_of_ggx(alpha: f64, (energy, factor): (f64, f64)) -> NdfLobe {
    let sharpness = factor * ndf_sharpness_ggx(alpha);
    NdfLobe { sharpness, amplitude: 0.5 * energy * sharpness / PI }
}

/// The mirror direction of the view, `2 (n.o) n - o`.
pub fn reflection_axis(normal: DVec3, view: DVec3) -> DVec3 {
    normal * (2.0 * normal.dot(view)) - view
}

/// `1 / c_e^2`, where `c_e^2 = c^2 + s^2 / (2 ndf_sharpness)` is the regularised squared cosine of the view, s^2 = |n x o|^2. 0 for a sharpness of 0.
///
/// The product with the sharpness above and below the bar keeps it finite at 0; c_e is that of the view where the view is well above the horizon and
/// `alpha / 2` in the horizon. A form of this project.
fn regularized_stretch(ndf_sharpness: f64, normal: DVec3, view: DVec3) -> f64 {
    let c = normal.dot(view);
    let s2 = normal.cross(view).length_squared();
    ndf_sharpness / (ndf_sharpness * c * c + 0.5 * s2).max(1e-30)
}

/// The reflection lobe of an SG NDF as an SG of amplitude 1, sharpness `ndf_sharpness / (4 |n.o|)` (Wang et al. 2009, section 4): infinite for a view in the horizon,
/// and with it the energy goes to 0 there. Kept for comparison; n.o must not be 0.
pub fn reflection_lobe_sg_printed(ndf_sharpness: f64, normal: DVec3, view: DVec3) -> SphericalGaussian {
    let sharpness = ndf_sharpness / (4.0 * normal.dot(view).abs());
    SphericalGaussian { axis: reflection_axis(normal, view), sharpness, amplitude: 1.0 }
}

/// The reflection lobe of an SG NDF as an SG of amplitude 1, finite for every view: [`reflection_lobe_sg_printed`] with the regularised cosine. A
/// form of this project.
///
/// An SG is round and the true lobe is not: L1 error 0.22 of the integral at 45 degrees and about 1 at 80 degrees for any alpha (Beckmann). Use
/// [`reflection_lobe_asg`] from there on.
pub fn reflection_lobe_sg(ndf_sharpness: f64, normal: DVec3, view: DVec3) -> SphericalGaussian {
    let sharpness = 0.25 * ndf_sharpness * regularized_stretch(ndf_sharpness, normal, view).sqrt();
    SphericalGaussian { axis: reflection_axis(normal, view), sharpness, amplitude: 1.0 }
}

/// The reflection lobe as an ASG of amplitude 1: `eta_x = ndf_sharpness / (8 (n.o)^2)` along n x axis, `eta_y = ndf_sharpness / 8` in the plane of
/// incidence (Xu et al. 2013, Anisotropic Spherical Gaussians, section 5). Infinite for a view in the horizon. Kept for comparison; n.o must not be
/// 0.
pub fn reflection_lobe_asg_printed(ndf_sharpness: f64, normal: DVec3, view: DVec3) -> AnisotropicSphericalGaussian {
    let stretch = normal.dot(view).powi(2).recip();
    reflection_lobe_of_stretch(ndf_sharpness, stretch, normal, view)
}

/// The reflection lobe as an ASG of amplitude 1, finite for every view: [`reflection_lobe_asg_printed`] with the regularised cosine. A form of this
/// project.
///
/// L1 error of a Beckmann lobe of alpha 0.05: 0.02 of the integral at 45 degrees, 0.15 at 80, 0.38 at 88; of alpha 0.4: 0.20, 0.43, 0.55. `eta_x` is
/// at most `ndf_sharpness^2 / 4`, which is 1e12 for alpha 0.001. Multiply by the NDF's amplitude for D(h).
pub fn reflection_lobe_asg(ndf_sharpness: f64, normal: DVec3, view: DVec3) -> AnisotropicSphericalGaussian {
    reflection_lobe_of_stretch(ndf_sharpness, regularized_stretch(ndf_sharpness, normal, view), normal, view)
}

fn reflection_lobe_of_stretch(ndf_sharpness: f64, stretch: f64, normal: DVec3, view: DVec3) -> AnisotropicSphericalGaussian {
    let axis = reflection_axis(normal, view);
    let (tangent, bitangent) = reflection_frame(normal, axis);
    let eta_y = 0.125 * ndf_sharpness;
    AnisotropicSphericalGaussian { tangent, bitangent, axis, eta_x: eta_y * stretch, eta_y, amplitude: 1.0 }
}

/// Unit vectors along n x axis and in the plane of incidence, orthogonal to the axis. Where the cross product is shorter than 1e-6 any pair: the
/// bandwidths are equal there.
///
/// The cross product of nearly parallel vectors is rounded in every direction, so its part along the axis is taken out.
fn reflection_frame(normal: DVec3, axis: DVec3) -> (DVec3, DVec3) {
    let cross = normal.cross(axis);
    let across = cross - axis * axis.dot(cross);
    let tangent = if across.length_squared() > 1e-12 { across.normalize() } else { axis.any_orthonormal_vector() };
    (tangent, axis.cross(tangent))
}
