//! Cosine lobes, `max(w.axis, 0)^exponent`: Phong's lobe and, with exponent 1, the clamped cosine of Lambert's law. How they become SGs and back, and
//! what their product is.

use crate::{
    sg::{SphericalGaussian, sg_integral},
    special::{exp_minus_one, log_one_plus},
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

/// A lobe `amplitude max(w.axis, 0)^exponent`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CosineLobe {
    /// Unit direction of the peak.
    pub axis: DVec3,
    /// 0 (a hemisphere) to 1e8.
    pub exponent: f64,
    /// Value at the axis.
    pub amplitude: f64,
}

impl CosineLobe {
    /// The lobe that integrates to 1 over the sphere.
    pub fn normalized(axis: DVec3, exponent: f64) -> Self {
        Self { axis, exponent, amplitude: 1.0 / cosine_lobe_integral(exponent) }
    }

    /// Value in a direction.
    pub fn evaluate(&self, direction: DVec3) -> f64 {
        self.amplitude * cosine_lobe_evaluate(self.axis, self.exponent, direction)
    }

    /// Integral over the sphere.
    pub fn integral(&self) -> f64 {
        self.amplitude * cosine_lobe_integral(self.exponent)
    }

    /// The SG of equal integral that is nearest in the least-squares sense (see [`cosine_lobe_sharpness`]).
    pub fn to_spherical_gaussian(&self) -> SphericalGaussian {
        let sharpness = cosine_lobe_sharpness(self.exponent);
        SphericalGaussian { axis: self.axis, sharpness, amplitude: self.integral() / sg_integral(sharpness) }
    }
}

/// `max(direction.axis, 0)^exponent`; 1 on the whole upper hemisphere where the exponent is 0, and 0 on its rim.
///
/// The cosine is `1 - |direction - axis|^2 / 2` and the power an exponential of its logarithm, so that a lobe of exponent 1e8 keeps its digits.
pub fn cosine_lobe_evaluate(axis: DVec3, exponent: f64, direction: DVec3) -> f64 {
    let versine = 0.5 * (direction - axis).length_squared();
    if versine >= 1.0 { 0.0 } else { (exponent * log_one_plus(-versine)).exp() }
}

/// Integral over the sphere, sr: `2 pi / (exponent + 1)`.
pub fn cosine_lobe_integral(exponent: f64) -> f64 {
    2.0 * PI / (exponent + 1.0)
}

/// Sharpness of the SG of equal integral that is nearest to `max(cos, 0)^exponent` in the least-squares sense over solid angle: a fit of this project,
/// `n + 5/4 + 0.109 n / (n^2 - 0.155 n + 1.72)`, within 0.003 of the optimum for n >= 0.5 (0.03 at 0). For n = 1 the optimum is 2.29251.
///
/// What no SG can follow is the rest: the distance is 0.19 of the lobe's norm at n = 1, 0.055 at 5, 0.029 at 10, 0.003 at 100.
pub fn cosine_lobe_sharpness(exponent: f64) -> f64 {
    exponent + 1.25 + 0.109 * exponent / (exponent * exponent - 0.155 * exponent + 1.72)
}

/// Sharpness of the SG that falls to one half at the same angle, `ln 2 / (1 - 2^{-1/n})` (Lecocq et al. 2017, Analytic Approximations for Real-Time Area
/// Light Shading); `n + ln(2)/2` for large n, and `ln 2` at 0.
pub fn cosine_lobe_sharpness_half_maximum(exponent: f64) -> f64 {
    -LN_2 / exp_minus_one(-LN_2 / exponent)
}

/// Inverse of [`cosine_lobe_sharpness_half_maximum`]: exponent of the cosine lobe that falls to one half where an SG of this sharpness does. 0 up to
/// `ln 2`, where the SG has not fallen to one half on the hemisphere.
pub fn cosine_lobe_exponent_half_maximum(sharpness: f64) -> f64 {
    if sharpness <= LN_2 { 0.0 } else { -LN_2 / log_one_plus(-LN_2 / sharpness) }
}

/// Logarithm of a lobe's value in a direction, -infinity below the horizon.
fn log_value(lobe: &CosineLobe, direction: DVec3) -> f64 {
    lobe.amplitude.ln() + cosine_lobe_evaluate(lobe.axis, lobe.exponent, direction).ln()
}

/// Product of two lobes as one, through SGs of equal half width (Lecocq et al. 2017): the axis is that of the product of the SGs, the value there is
/// exact.
///
/// L1 distance from the product of equal lobes, over its integral: 0.12 for exponents of 1 at 0 degrees, 0.22 at 60; 0.32 for 20 at 60 degrees, 0.69 at 80;
/// 0.33 for 1000 at 60.
pub fn cosine_lobe_product(a: &CosineLobe, b: &CosineLobe) -> CosineLobe {
    let p = a.axis * cosine_lobe_sharpness_half_maximum(a.exponent) + b.axis * cosine_lobe_sharpness_half_maximum(b.exponent);
    let axis = p.normalize_or(a.axis);
    let amplitude = (log_value(a, axis) + log_value(b, axis)).exp();
    CosineLobe { axis, exponent: cosine_lobe_exponent_half_maximum(p.length()), amplitude }
}

/// As [`cosine_lobe_product`] about the true peak, with the width that the product has there, for exponents above 0.
///
/// L1 distance, as there: 0 for exponents of 1 at 0 degrees, 0.16 at 60; 0.094 for 20 at 60 degrees, 0.17 at 80; 0.092 for 1000 at 60. Opposite lobes
/// have no product: amplitude 0.
pub fn cosine_lobe_product_refined(a: &CosineLobe, b: &CosineLobe) -> CosineLobe {
    let cross = a.axis.cross(b.axis).length();
    let angle = cross.atan2(a.axis.dot(b.axis));
    let (n, m) = (a.exponent, b.exponent);
    // The peak is between the axes, above both horizons; the derivative of the logarithm falls steadily from one end to the other.
    let (mut low, mut high) = ((angle - FRAC_PI_2).max(0.0), angle.min(FRAC_PI_2));
    if angle > PI - 1e-9 || n + m <= 0.0 {
        return CosineLobe { amplitude: 0.0, ..*a };
    }
    let mut t = (angle * m / (n + m)).max(low).min(high);
    for _ in 0..60 {
        let (left, right) = (n * t.tan(), m * (angle - t).tan());
        if left > right {
            high = t
        } else {
            low = t
        }
        let slope = n / t.cos().powi(2) + m / (angle - t).cos().powi(2);
        let step = t + (right - left) / slope;
        t = if step > low && step < high { step } else { 0.5 * (low + high) };
    }
    let across = (b.axis - a.axis * a.axis.dot(b.axis)).normalize_or(a.axis.any_orthonormal_vector());
    let axis = a.axis * t.cos() + across * t.sin();
    let along = n / t.cos().powi(2) + m / (angle - t).cos().powi(2);
    let exponent = ((n + m) * along).sqrt();
    CosineLobe { axis, exponent, amplitude: (log_value(a, axis) + log_value(b, axis)).exp() }
}
