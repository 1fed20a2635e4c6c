//! An SG over the upper hemisphere of a surface, plain and weighted by the cosine: visibility by the horizon, and irradiance from an SG light.
//!
//! No closed form is known. Of each integral there is an exact form by quadrature, an accurate approximation (the default), a fast one, and those that
//! papers use, to be compared with. `angle` is the angle between the lobe's axis and the normal; approximations take its cosine `c` and squared sine
//! `s2`, of which `s2` should come from `|normal x axis|^2`. Errors are given as a share of A, the lobe's integral over the sphere, over all angles.

use crate::{
    quadrature::integrate,
    sg::{sg_integral, sg_product},
    special::{bessel_i0_scaled, bessel_i1_scaled, decay_mean, decay_mean_lower, decay_mean_lower_scaled, decay_mean_upper, erf, erfc},
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// How much of a lobe is above the horizon: logarithm of the integral of G over the hemisphere, exact to about 1e-13.
pub fn log_hemisphere_integral_exact(sharpness: f64, angle: f64) -> f64 {
    log_integral_exact(sharpness, angle, 0)
}

/// As [`log_hemisphere_integral_exact`], of `G max(cos, 0)`.
pub fn log_clamped_cosine_integral_exact(sharpness: f64, angle: f64) -> f64 {
    log_integral_exact(sharpness, angle, 1)
}

/// Integral of G over the upper hemisphere, sr, exact to about 1e-13. Slow.
pub fn hemisphere_integral_exact(sharpness: f64, angle: f64) -> f64 {
    log_hemisphere_integral_exact(sharpness, angle).exp()
}

/// Integral of `G max(cos, 0)`, sr, exact to about 1e-13. Slow.
pub fn clamped_cosine_integral_exact(sharpness: f64, angle: f64) -> f64 {
    log_clamped_cosine_integral_exact(sharpness, angle).exp()
}

/// `2 pi` times the integral over theta of `cos^power exp(-2 sharpness sin^2((theta - angle)/2)) i0e(sharpness sin(angle) sin(theta)) sin(theta)`: the
/// azimuth is done by the Bessel function.
fn log_integral_exact(sharpness: f64, angle: f64, power: i32) -> f64 {
    let exponent = |theta: f64| -2.0 * sharpness * (0.5 * (theta - angle)).sin().powi(2);
    let scale = exponent(angle.min(FRAC_PI_2));
    // Farther from the axis than this the integrand is below e^-50 of its largest.
    let nearest = (0.5 * (angle - angle.min(FRAC_PI_2))).sin().powi(2);
    let reach = 2.0 * (nearest + 25.0 / sharpness.max(1e-3)).sqrt().min(1.0).asin();
    let (low, high) = ((angle - reach).max(0.0), (angle + reach).min(FRAC_PI_2));
    let integrand = |theta: f64| {
        let lobe = (exponent(theta) - scale).exp() * bessel_i0_scaled(sharpness * angle.sin() * theta.sin()) * theta.sin();
        // The sine of the complement keeps the digits at the horizon.
        lobe * (FRAC_PI_2 - theta).sin().powi(power)
    };
    scale + (2.0 * PI * integrate(low, high, 24, integrand)).ln()
}

/// The clamped cosine integral for an axis in the horizon, exactly: `2 pi e^-sharpness I_1(sharpness) / sharpness`; pi at 0.
pub fn clamped_cosine_integral_at_horizon(sharpness: f64) -> f64 {
    if sharpness < 1e-8 { PI } else { 2.0 * PI * bessel_i1_scaled(sharpness) / sharpness }
}

/// Hemisphere integral, accurate (Tokuyoshi 2022, Accurate Diffuse Lighting from Spherical Gaussian Lights): interpolation between the exact values
/// for an axis up and down by an error function. Within 0.005 A (measured; worst at sharpness 7.6, 48 degrees), 0.52 % of the value above the horizon.
///
/// Below the horizon the difference of error functions is written with their complements, so that it neither cancels nor turns negative.
pub fn hemisphere_integral(sharpness: f64, c: f64) -> f64 {
    let steepness = hemisphere_steepness(sharpness).max(1e-6);
    let whole = erf(steepness);
    let share = if c >= 0.0 || steepness < 1.0 {
        0.5 + 0.5 * erf(steepness * c) / whole
    } else {
        0.5 * (erfc(-steepness * c) - erfc(steepness)) / whole
    };
    let e = (-sharpness).exp();
    2.0 * PI * decay_mean(sharpness) * (e + (1.0 - e) * share.clamp(0.0, 1.0))
}

/// Numerator and denominator divided by the square above 1, so that it does not overflow.
fn hemisphere_steepness(sharpness: f64) -> f64 {
    const N: f64 = 0.6517328827;
    const D: [f64; 2] = [1.3418280033, 7.2216687799];
    let squared = if sharpness > 1.0 {
        let r = 1.0 / sharpness;
        r * (0.5 + N * r) / ((D[1] * r + D[0]) * r + 1.0)
    } else {
        (0.5 * sharpness + N) / ((sharpness + D[0]) * sharpness + D[1])
    };
    sharpness * squared.sqrt()
}

/// Hemisphere integral, fast: `A (1 + erf(c sqrt(sharpness / 2))) / 2`, the limit for sharp lobes. Within 0.0074 A above sharpness 10, 0.14 A below.
pub fn hemisphere_integral_fast(sharpness: f64, c: f64) -> f64 {
    0.5 * sg_integral(sharpness) * erfc(-c * (0.5 * sharpness).sqrt())
}

/// Hemisphere integral by a logistic curve (Meder and Bruederlin 2018, Hemispherical Gaussians for Accurate Light Integration). Within 0.012 A, not
/// better for sharp lobes; below the horizon off by orders of magnitude above sharpness 10.
pub fn hemisphere_integral_meder(sharpness: f64, c: f64) -> f64 {
    let t = sharpness.sqrt() * (1.6988 * sharpness + 10.8438) * sharpness / ((sharpness + 6.2201) * sharpness + 10.2415);
    // (e^t e^(tc) - 1) / ((e^t - 1)(e^(tc) + 1)), with the growing exponentials divided out.
    let share = if t < 1e-6 {
        0.5 * (1.0 + c)
    } else {
        let logistic = |x: f64| 1.0 / (1.0 + (-x).exp());
        (logistic(t * c) - logistic(-t)) / (logistic(t) - logistic(-t))
    };
    let e = (-sharpness).exp();
    2.0 * PI * decay_mean(sharpness) * (e + (1.0 - e) * share.clamp(0.0, 1.0))
}

/// Clamped cosine integral, accurate (Tokuyoshi et al. 2024, Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting, supplement), sr.
/// Exact for an axis up or down, within 0.0013 A and 0.65 % of the value above the horizon; below it the relative error grows.
pub fn clamped_cosine_integral(sharpness: f64, c: f64, s2: f64) -> f64 {
    let lower = decay_mean_lower(sharpness);
    2.0 * PI * (lower + (decay_mean_upper(sharpness) - lower) * clamped_cosine_share(sharpness, c, s2))
}

fn clamped_cosine_share(sharpness: f64, c: f64, s2: f64) -> f64 {
    let t = clamped_cosine_steepness(sharpness);
    let t2 = t * t;
    let tail = (-t2 * c * c).exp() * t * s2 * decay_mean(t2 * s2) / (2.0 * PI.sqrt());
    (0.5 * (c * erfc(-t * c) + erfc(t)) + tail).clamp(0.0, 1.0)
}

/// Numerator and denominator divided by sharpness^3 above 1: the cube overflows `f32` above 7e12, which lobes of near lights reach.
fn clamped_cosine_steepness(sharpness: f64) -> f64 {
    const N: [f64; 2] = [2.7360831611, 17.0212977817];
    const D: [f64; 3] = [4.0100826729, 15.2191562631, 76.0878962724];
    let squared = if sharpness > 1.0 {
        let r = 1.0 / sharpness;
        r * ((N[1] * r + N[0]) * r + 1.0) / (((D[2] * r + D[1]) * r + D[0]) * r + 1.0)
    } else {
        let x = sharpness;
        ((x + N[0]) * x + N[1]) / (((x + D[0]) * x + D[1]) * x + D[2])
    };
    sharpness * (0.5 * squared).sqrt()
}

/// Clamped cosine integral, fast: a hyperbola without an error function. A form of this project.
///
/// Exact for an axis up or down, within 0.15 % in the horizon, always positive and monotone in `c`; within 0.0156 A elsewhere (worst at sharpness 9,
/// 62 and 118 degrees), 5.3 % of the value above the horizon.
pub fn clamped_cosine_integral_fast(sharpness: f64, c: f64) -> f64 {
    let integral = sg_integral(sharpness);
    let fit = if sharpness > 1.0 {
        let r = 1.0 / sharpness;
        ((16.0 * r + 2.16346892) * r + 1.19899548) / ((r + 0.50991473) * r + 0.25443469)
    } else {
        (16.0 + 2.16346892 * sharpness + 1.19899548 * sharpness * sharpness)
            / (1.0 + 0.50991473 * sharpness + 0.25443469 * sharpness * sharpness)
    };
    // The square of the value in the horizon.
    let g2 = integral * integral / (2.0 * PI * sharpness + fit);
    let (upper, lower) = (decay_mean_upper(sharpness), decay_mean_lower(sharpness));
    let mean = PI * (upper + lower);
    let root = (g2 + c * c * (mean * mean - g2)).max(0.0).sqrt();
    let slope = PI * (upper - lower);
    (slope * c + root).max(2.0 * PI * lower)
}

/// Clamped cosine integral with the cosine pulled out of the integral at the axis, `A max(c, 0)` (Tokuyoshi 2015, Virtual Spherical Gaussian Lights,
/// appendix B): the cheapest form, for sharpness above 100 (0.04 A) and away from the horizon, where it is 0 and the truth is `A / sqrt(2 pi sharpness)`.
pub fn clamped_cosine_integral_constant_cosine(sharpness: f64, c: f64) -> f64 {
    sg_integral(sharpness) * c.max(0.0)
}

/// Clamped cosine integral by Hill's fit (in Pettineo 2016, SG series, part 3). Within 0.04 A above sharpness 1; diverges towards 0.
pub fn clamped_cosine_integral_hill(sharpness: f64, c: f64) -> f64 {
    let e = (-sharpness).exp();
    let (e2, r) = (e * e, 1.0 / sharpness);
    let scale = 1.0 + 2.0 * e2 - r;
    let bias = (e - e2) * r - e2;
    let x = (1.0 - scale).max(0.0).sqrt();
    let (x0, x1) = (0.36 * c, x / (4.0 * 0.36));
    let n = x0 + x1;
    let y = if x0.abs() <= x1 { n * n / x } else { c.clamp(0.0, 1.0) };
    (scale * y + bias) * 2.0 * PI * r
}

/// Clamped cosine integral by writing the cosine as `a exp(d cos) - a` for a tiny d, under [`hemisphere_integral`] (Tokuyoshi 2022). Within 0.004 A.
/// The difference of two numbers 1182 times the result is no form for `f32`; [`clamped_cosine_integral`] is better in every way.
pub fn clamped_cosine_integral_difference(sharpness: f64, c: f64) -> f64 {
    const SHARPNESS: f64 = 0.000_845_608_722_414_801_2;
    const AMPLITUDE: f64 = 1_182.246_733_967_815_3;
    gaussian_difference(sharpness, c, SHARPNESS, AMPLITUDE * SHARPNESS.exp(), AMPLITUDE, hemisphere_integral)
}

/// Clamped cosine integral by the fit `32.708 G(0.0315) - 31.7003` of the cosine, under [`hemisphere_integral_meder`] (Meder and Bruederlin 2018).
/// Within 0.0112 A and negative in places: two numbers 32 times the result are subtracted.
pub fn clamped_cosine_integral_meder(sharpness: f64, c: f64) -> f64 {
    gaussian_difference(sharpness, c, 0.0315, 32.7080, 31.7003, hemisphere_integral_meder)
}

/// Clamped cosine integral by the same fit over the whole sphere, as a widely read article prints it: the fit holds on the upper hemisphere only, and
/// the result is off by up to A and negative below the horizon. Kept for the test that shows it.
pub fn clamped_cosine_integral_unclamped(sharpness: f64, c: f64) -> f64 {
    gaussian_difference(sharpness, c, 0.0315, 32.7080, 31.7003, |sharpness, _| sg_integral(sharpness))
}

/// `amplitude integral(G G') - constant integral(G)` for a lobe G' of sharpness `inner` about the normal.
fn gaussian_difference(sharpness: f64, c: f64, inner: f64, amplitude: f64, constant: f64, integral: impl Fn(f64, f64) -> f64) -> f64 {
    let axis = DVec3::new((1.0 - c * c).max(0.0).sqrt(), 0.0, c);
    let product = sg_product(axis, sharpness, DVec3::Z, inner);
    amplitude * product.log_amplitude.exp() * integral(product.sharpness, product.axis.z) - constant * integral(sharpness, c)
}

/// Logarithm of the exact clamped cosine integral of an axis opposite to the normal, for lobes so sharp that it underflows.
pub fn log_clamped_cosine_integral_opposite(sharpness: f64) -> f64 {
    (2.0 * PI * decay_mean_lower_scaled(sharpness)).ln() - sharpness
}
