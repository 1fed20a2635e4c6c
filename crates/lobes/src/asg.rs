//! Anisotropic spherical Gaussians (ASG), `max(w.axis, 0) exp(-eta_x (w.tangent)^2 - eta_y (w.bitangent)^2)` (Xu et al. 2013, Anisotropic Spherical
//! Gaussians): their value and their integral. Both bandwidths are in [0, 1e8]; with both 0 the lobe is the clamped cosine.
//!
//! Near its axis an ASG with `eta_x = eta_y = sharpness / 2` is an SG of that sharpness.

use crate::{
    quadrature::integrate,
    special::{bessel_i0_scaled, decay_mean, erf_mean},
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// A lobe with two bandwidths. Tangent, bitangent and axis are an orthonormal frame of either handedness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnisotropicSphericalGaussian {
    /// Direction along which the lobe falls off with `eta_x`.
    pub tangent: DVec3,
    /// Direction along which the lobe falls off with `eta_y`.
    pub bitangent: DVec3,
    /// Unit direction of the peak.
    pub axis: DVec3,
    /// Bandwidth along the tangent, 0 to 1e8.
    pub eta_x: f64,
    /// Bandwidth along the bitangent, 0 to 1e8.
    pub eta_y: f64,
    /// Value at the axis.
    pub amplitude: f64,
}

impl AnisotropicSphericalGaussian {
    /// A direction in the lobe's frame: tangent, bitangent, axis.
    pub fn to_local(&self, direction: DVec3) -> DVec3 {
        DVec3::new(self.tangent.dot(direction), self.bitangent.dot(direction), self.axis.dot(direction))
    }

    /// A direction of the lobe's frame in the world.
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.tangent * local.x + self.bitangent * local.y + self.axis * local.z
    }

    /// Value in a direction; 0 below the horizon of the axis.
    pub fn evaluate(&self, direction: DVec3) -> f64 {
        self.amplitude * asg_evaluate(self.eta_x, self.eta_y, self.to_local(direction))
    }

    /// Integral over the sphere by [`asg_integral`].
    pub fn integral(&self) -> f64 {
        self.amplitude * asg_integral(self.eta_x, self.eta_y)
    }
}

/// Value in a direction of the lobe's frame.
pub fn asg_evaluate(eta_x: f64, eta_y: f64, local: DVec3) -> f64 {
    local.z.max(0.0) * (-eta_x * local.x * local.x - eta_y * local.y * local.y).exp()
}

/// Integral over the sphere, accurate: the unit disk that the hemisphere projects to is taken for a shape between a square and a slab, over which the
/// integral is a product of error functions. A form of this project.
///
/// Within 1.4 % for all bandwidths, 0.34 % where both are above 5, exact where both are 0 or large; `pi` at 0, 0.
pub fn asg_integral(eta_x: f64, eta_y: f64) -> f64 {
    let (larger, smaller) = (eta_x.max(eta_y), eta_x.min(eta_y));
    let [half_x, half_y] = half_sides(larger, smaller);
    PI * erf_mean(half_x * larger.sqrt()) * erf_mean(half_y * smaller.sqrt())
}

/// Half sides of the rectangle of area pi that stands for the unit disk under a Gaussian, along the larger bandwidth and along the smaller one.
pub(crate) fn half_sides(larger: f64, smaller: f64) -> [f64; 2] {
    let square = 0.5 * PI.sqrt();
    let t = larger - smaller;
    let half_y = square + (1.0 - square) * t / (t + 4.0);
    [PI / (4.0 * half_y), half_y]
}

/// Integral over the sphere, fast: `pi / sqrt(eta_x eta_y)`, for bandwidths of at least 8 (0.034 %); infinite where one is 0.
pub fn asg_integral_fast(eta_x: f64, eta_y: f64) -> f64 {
    PI / (eta_x.sqrt() * eta_y.sqrt())
}

/// Integral over the sphere by quadrature, to about 1e-13: `2` times the integral of `decay_mean(eta_x cos^2 + eta_y sin^2)` over a quarter turn.
///
/// The azimuth is stretched by `sqrt((eta_x + 1) / (eta_y + 1))`, which makes the integrand flat for any bandwidths.
pub fn asg_integral_exact(eta_x: f64, eta_y: f64) -> f64 {
    let (a, b) = (eta_x + 1.0, eta_y + 1.0);
    let (a, b) = (a.max(b), a.min(b));
    let stretch = a / b;
    let integrand = |angle: f64| {
        let weight = angle.cos().powi(2) + stretch * angle.sin().powi(2);
        decay_mean((a / weight - 1.0).max(0.0)) / weight
    };
    2.0 * stretch.sqrt() * integrate(0.0, FRAC_PI_2, 32, integrand)
}

/// `F(t)`, the integral of `exp(-t cos^2 phi)` over a turn: `2 pi e^{-t/2} I_0(t/2)`, for t >= 0. To rounding.
pub fn asg_azimuth_integral(t: f64) -> f64 {
    2.0 * PI * bessel_i0_scaled(0.5 * t)
}

/// Integral over the sphere as Xu et al. print it, with the exact F: for both bandwidths above 0.
///
/// Within 5.2 % where the smaller bandwidth is above 1, 0.027 % above 5; ten times too large and worse below 0.1, and negative in places there. The sign
/// between the two terms is a plus; one later paper prints a minus, which is off by 36 % at 1.
pub fn asg_integral_printed(eta_x: f64, eta_y: f64) -> f64 {
    let (larger, smaller) = (eta_x.max(eta_y), eta_x.min(eta_y));
    let t = larger - smaller;
    let ratio = t / smaller;
    let ring = asg_azimuth_integral(t) + ratio * asg_azimuth_integral(t + ratio);
    PI / (larger.sqrt() * smaller.sqrt()) - (-smaller).exp() / (2.0 * larger) * ring
}
