//! Specular directional albedo: the share of the light from one direction that the specular lobe reflects into the hemisphere.
//!
//! ```text
//!   a(l) = integral of D G2 F / (4 (n.l) (n.v)) (n.v) dv = f0 A + (f90 - f0) S,     F = f0 + (f90 - f0) (1 - l.h)^5
//!   A = integral of D G2 / (4 n.l) dv,     S = integral of D G2 (1 - l.h)^5 / (4 n.l) dv
//! ```
//!
//! A and S depend on alpha and n.l alone. What is lost to masking is lost: light is scattered once.

use crate::{
    brdf::{Distribution, ggx_visibility, phong_exponent, phong_visibility},
    quadrature::integrate,
};
use std::f64::consts::{FRAC_PI_2, PI};

/// (A, S) for alpha in [0.001, 1] and n.l in [0, 1], to about 1e-4. A of the Phong distribution exceeds 1 where it is rough and
/// grazed, up to 1.77.
///
/// Over half vectors (dv = 4 l.h dh), with the area that the distribution projects as one variable, so that the lobe is flat in it; the azimuths that put v
/// above the horizon are known, and panels end where they begin to be cut off.
pub fn specular_albedo_integrals(alpha: f64, n_dot_l: f64, distribution: Distribution) -> (f64, f64) {
    let c = n_dot_l.clamp(1e-7, 1.0);
    let (sine, tilt) = ((1.0 - c * c).sqrt(), c.acos());
    let power = phong_exponent(alpha) + 2.0;
    // Share of the distribution that lies farther from the normal than theta.
    let beyond = |theta: f64| match distribution {
        Distribution::Ggx => 1.0 / (1.0 + (theta.tan() / alpha).powi(2)),
        Distribution::Phong => theta.cos().powf(power),
    };
    // Sine and cosine of the angle beyond which a share lies.
    let half_vector = |share: f64| match distribution {
        Distribution::Ggx => {
            let tangent_squared = alpha * alpha * (1.0 - share) / share;
            ((tangent_squared / (1.0 + tangent_squared)).sqrt(), (1.0 + tangent_squared).sqrt().recip())
        }
        Distribution::Phong => ((-(2.0 * share.ln() / power).exp_m1()).sqrt(), share.powf(power.recip())),
    };
    let part = |schlick: bool| {
        let at = |share: f64| {
            let (h_sine, h_cosine) = half_vector(share);
            let widest = ((c / (2.0 * h_cosine) - c * h_cosine) / (sine * h_sine).max(1e-300)).clamp(-1.0, 1.0).acos();
            let ring = smooth_ends(0.0, widest, |azimuth| {
                let l_dot_h = sine * h_sine * azimuth.cos() + c * h_cosine;
                let n_dot_v = (2.0 * l_dot_h * h_cosine - c).min(1.0);
                if n_dot_v <= 0.0 {
                    return 0.0;
                }
                let visibility = match distribution {
                    Distribution::Ggx => ggx_visibility(alpha, c, n_dot_v),
                    Distribution::Phong => phong_visibility(alpha, c, n_dot_v),
                };
                visibility * n_dot_v * 4.0 * l_dot_h * if schlick { (1.0 - l_dot_h.min(1.0)).powi(5) } else { 1.0 }
            });
            ring / (PI * h_cosine)
        };
        let ends = [0.0, 0.5 * (FRAC_PI_2 - tilt), 0.5 * (FRAC_PI_2 + tilt)].map(beyond);
        smooth_ends(ends[1], ends[0], at) + smooth_ends(ends[2], ends[1], at)
    };
    (part(false), part(true))
}

/// Integral of a function that may begin and end like a square root.
fn smooth_ends(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    if high <= low {
        return 0.0;
    }
    integrate(0.0, 1.0, 2, |s| 6.0 * s * (1.0 - s) * f(low + (high - low) * s * s * (3.0 - 2.0 * s))) * (high - low)
}

/// `P(alpha, s) / Q(alpha, s)` with the coefficients of 1, s, s^2, s^3, alpha, alpha s, alpha s^2, alpha^2, alpha^2 s, alpha^3 in P and of s, s^2, alpha,
/// alpha s, alpha^2 in Q, which begins with 1.
struct Rational {
    above: [f64; 10],
    below: [f64; 5],
}

impl Rational {
    fn at(&self, alpha: f64, s: f64) -> f64 {
        let (p, q) = (&self.above, &self.below);
        let above =
            p[0] + s * (p[1] + s * (p[2] + s * p[3])) + alpha * (p[4] + s * (p[5] + s * p[6]) + alpha * (p[7] + s * p[8] + alpha * p[9]));
        above / (1.0 + s * (q[0] + s * q[1]) + alpha * (q[2] + s * q[3] + alpha * q[4]))
    }
}

const GGX: [Rational; 2] = [
    Rational {
        above: [0.99306, 1.22247, -2.23416, 0.527537, -1.10864, 0.161537, 0.634634, 0.403376, -0.606537, 0.0411019],
        below: [1.33293, -1.82067, -1.14555, 0.73785, 0.47553],
    },
    Rational {
        above: [0.976585, -0.490827, -0.333969, 0.154412, -0.482999, 0.666946, 0.0, -0.107508, 0.0, 0.0],
        below: [-0.320595, -0.370928, 14.5281, -13.5666, -5.2135],
    },
];

const PHONG: [Rational; 2] = [
    Rational {
        above: [0.997736, -0.968412, 0.317288, -0.0929721, -1.31369, 0.551209, 0.00188316, 0.681277, -0.0274519, -0.135508],
        below: [-0.728012, -0.0197746, -1.43441, 0.668922, 0.594364],
    },
    Rational {
        above: [1.00669, -0.561109, -0.174035, 0.269014, -1.57555, 0.506553, 0.0, 0.852314, 0.0, 0.0],
        below: [-0.429838, -0.0352457, 3.48862, -4.35659, -0.740597],
    },
];

/// About (A, S), with 0 <= S <= A <= 1, for alpha in [0.001, 1]; n.l is clamped to [0, 1].
///
/// Rational functions of alpha and `s = n.l / sqrt((n.l)^2 + alpha^2)`, S with the factor `(1 - n.l)^5` of a mirror: near the horizon both change with
/// n.l / alpha, which s resolves. Fitted to [`specular_albedo_integrals`] for the least largest error (a design of this project), which is 0.0070 for
/// A and 0.0106 for S with GGX; 0.0101 and 0.0094 with Phong, whose A is taken as 1 where it exceeds 1.
pub fn specular_albedo_fit(alpha: f64, n_dot_l: f64, distribution: Distribution) -> (f64, f64) {
    let c = n_dot_l.clamp(0.0, 1.0);
    let s = c / (c * c + alpha * alpha).sqrt();
    let [all, schlick] = match distribution {
        Distribution::Ggx => &GGX,
        Distribution::Phong => &PHONG,
    };
    let all = all.at(alpha, s).clamp(0.0, 1.0);
    (all, ((1.0 - c).powi(5) * schlick.at(alpha, s)).clamp(0.0, all))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_have_their_known_values() {
        // GGX of alpha 1 seen from above: half vectors are cosine-distributed, and all that is lost is masked.
        let (all, _) = specular_albedo_integrals(1.0, 1.0, Distribution::Ggx);
        assert!((all - (1.0 - std::f64::consts::LN_2)).abs() < 1e-8, "{all}");
        for distribution in [Distribution::Ggx, Distribution::Phong] {
            for n_dot_l in [0.1, 0.5, 0.9] {
                let (all, schlick) = specular_albedo_integrals(0.001, n_dot_l, distribution);
                // Lobes have a width, and the long tail of GGX reaches the horizon.
                let tail = if distribution == Distribution::Ggx { 2.5e-5 / n_dot_l } else { 2e-6 / n_dot_l };
                assert!((all - 1.0).abs() < tail && (schlick - (1.0 - n_dot_l).powi(5)).abs() < tail, "{all} {schlick}");
            }
        }
    }

    #[test]
    fn the_fit_is_as_good_as_it_says() {
        for (distribution, bounds) in [(Distribution::Ggx, [0.0070, 0.0106]), (Distribution::Phong, [0.0101, 0.0094])] {
            let mut worst = [0.0f64; 2];
            for i in 0..=16 {
                let alpha = (f64::from(i) / 16.0).powi(2).max(0.001);
                for j in 0..=25 {
                    let n_dot_l = if j < 10 { 10f64.powf(-0.4 * f64::from(j) - 1.0) } else { f64::from(j - 10) / 15.0 };
                    let (all, schlick) = specular_albedo_integrals(alpha, n_dot_l, distribution);
                    let fit = specular_albedo_fit(alpha, n_dot_l, distribution);
                    assert!(0.0 <= fit.1 && fit.1 <= fit.0 && fit.0 <= 1.0);
                    worst = [worst[0].max((fit.0 - all.min(1.0)).abs()), worst[1].max((fit.1 - schlick).abs())];
                }
            }
            for (worst, bound) in worst.into_iter().zip(bounds) {
                assert!(worst < bound && worst > 0.8 * bound, "{distribution:?}: {worst} of {bound}");
            }
        }
    }

    #[test]
    fn the_fit_stands_at_the_ends_of_its_domain() {
        for distribution in [Distribution::Ggx, Distribution::Phong] {
            for alpha in [0.001, 1.0] {
                for n_dot_l in [-1.0, 0.0, 1.0, 1.0 + 1e-9] {
                    let (all, schlick) = specular_albedo_fit(alpha, n_dot_l, distribution);
                    assert!((0.0..=1.0).contains(&all) && (0.0..=all).contains(&schlick), "{all} {schlick}");
                }
                assert_eq!(specular_albedo_fit(alpha, -1.0, distribution), specular_albedo_fit(alpha, 0.0, distribution));
                assert_eq!(specular_albedo_fit(alpha, 1.0, distribution).1, 0.0);
            }
        }
    }
}
