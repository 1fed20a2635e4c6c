//! Small functions that lobe formulas are built from, in forms that keep their digits at the ends of the domain.

use std::f64::consts::{FRAC_2_SQRT_PI, PI};

/// Below this the power series of the `decay_mean` family is used.
const SERIES_END: f64 = 1.0;

/// `e^x - 1` without cancellation.
pub fn exp_minus_one(x: f64) -> f64 {
    x.exp_m1()
}

/// `log(1 + x)` for x > -1 without cancellation.
pub fn log_one_plus(x: f64) -> f64 {
    x.ln_1p()
}

/// Mean of `e^{-x t}` over t in [0, 1]: `(1 - e^{-x}) / x`, 1 at 0, for x >= 0.
///
/// The integral of an SG over the sphere is `4 pi` times this at twice its sharpness; the quotient as written is 0/0 at 0.
pub fn decay_mean(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}

/// Integral of `(1 - t) e^{-x t}` over t in [0, 1]: `(1 - decay_mean(x)) / x`, 1/2 at 0, for x >= 0.
///
/// `2 pi` times this is the cosine-weighted integral of an SG whose axis is the normal.
pub fn decay_mean_upper(x: f64) -> f64 {
    if x < SERIES_END { series(x, |k| (k + 1.0) * (k + 2.0)) } else { (1.0 - decay_mean(x)) / x }
}

/// `e^{-x}` times the integral of `t e^{-x t}` over t in [0, 1]: `e^{-x} (decay_mean(x) - e^{-x}) / x`, 1/2 at 0, for x >= 0.
///
/// `2 pi` times this is the cosine-weighted integral of an SG whose axis is opposite to the normal.
pub fn decay_mean_lower(x: f64) -> f64 {
    (-x).exp() * decay_mean_lower_scaled(x)
}

/// [`decay_mean_lower`] without its factor `e^{-x}`, for logarithms.
pub fn decay_mean_lower_scaled(x: f64) -> f64 {
    if x < SERIES_END { series(x, |k| k + 2.0) } else { (decay_mean(x) - (-x).exp()) / x }
}

/// Sum of `(-x)^k / (k! divisor(k))`; twenty terms leave nothing below 1.
fn series(x: f64, divisor: impl Fn(f64) -> f64) -> f64 {
    let mut power = 1.0;
    let mut sum = 0.0;
    for k in 0..20 {
        let k = f64::from(k);
        sum += power / divisor(k);
        power *= -x / (k + 1.0);
    }
    sum
}

/// Error function.
pub fn erf(x: f64) -> f64 {
    libm::erf(x)
}

/// Complement of the error function, relative accuracy kept for large x.
pub fn erfc(x: f64) -> f64 {
    libm::erfc(x)
}

/// `sqrt(pi)/2 erf(x)/x`, the mean of `e^{-x^2 t^2}` over t in [0, 1]; 1 at 0.
pub fn erf_mean(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { erf(x) / (x * FRAC_2_SQRT_PI) }
}

/// `e^{-x} I_0(x)`, the modified Bessel function of order 0 scaled, for x >= 0. To rounding.
pub fn bessel_i0_scaled(x: f64) -> f64 {
    bessel_scaled(x, 0.0)
}

/// `e^{-x} I_1(x)`, for x >= 0. To rounding.
pub fn bessel_i1_scaled(x: f64) -> f64 {
    bessel_scaled(x, 1.0)
}

/// Up to 50 the trapezoid rule on Bessel's integral, whose error with N points is about `e^{-N^2 / 2x}`; above, Hankel's expansion.
fn bessel_scaled(x: f64, order: f64) -> f64 {
    if x < 50.0 {
        const POINTS: u32 = 80;
        let term = |k: u32| {
            let angle = PI * f64::from(k) / f64::from(POINTS);
            (order * angle).cos() * (-2.0 * x * (0.5 * angle).sin().powi(2)).exp()
        };
        let inner: f64 = (1..POINTS).map(term).sum();
        return (inner + 0.5 * (term(0) + term(POINTS))) / f64::from(POINTS);
    }
    let mu = 4.0 * order * order;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..20 {
        let k = f64::from(k);
        term *= -(mu - (2.0 * k - 1.0).powi(2)) / (8.0 * x * k);
        sum += term;
    }
    sum / (2.0 * PI * x).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(left: f64, right: f64, bound: f64) {
        assert!((left - right).abs() <= bound * right.abs(), "{left:e} {right:e}");
    }

    #[test]
    fn series_and_quotients_meet() {
        let below = SERIES_END * (1.0 - 1e-15);
        for f in [decay_mean, decay_mean_upper, decay_mean_lower, decay_mean_lower_scaled] {
            close(f(below), f(SERIES_END), 1e-14);
        }
        assert_eq!((decay_mean(0.0), decay_mean_upper(0.0), decay_mean_lower(0.0)), (1.0, 0.5, 0.5));
        // C(c) - C(-c) at c = 1: the upper and lower halves differ by the mean cosine's share.
        for x in [1e-6f64, 0.3, 1.0, 7.0, 300.0] {
            let mean_cosine = 1.0 / x.tanh() - 1.0 / x;
            if x > 0.1 {
                close(decay_mean_upper(x) - decay_mean_lower(x), 2.0 * decay_mean(2.0 * x) * mean_cosine, 1e-12);
            }
        }
    }

    #[test]
    fn bessel_functions_are_those_of_the_tables() {
        // Abramowitz and Stegun, tables 9.8 and 9.11.
        close(bessel_i0_scaled(0.0), 1.0, 1e-15);
        close(bessel_i0_scaled(1.0), 0.465_759_607_7, 1e-9);
        close(bessel_i0_scaled(10.0), 0.127_833_337_2, 1e-9);
        close(bessel_i1_scaled(1.0), 0.207_910_415_4, 1e-9);
        close(bessel_i1_scaled(10.0), 0.121_262_681_4, 1e-9);
        assert!(bessel_i1_scaled(0.0).abs() < 1e-16);
        for f in [bessel_i0_scaled, bessel_i1_scaled] {
            close(f(50.0 * (1.0 - 1e-15)), f(50.0), 1e-13);
        }
    }
}
