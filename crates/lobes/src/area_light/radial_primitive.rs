//! Microfacet distributions integrated along meridians, from their pole to an angle.

use crate::quadrature::integrate;
use crate::special::erf;
use std::f64::consts::{PI, TAU};

/// A distribution of microfacet normals that depends on the angle to the normal alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Microfacets {
    /// Trowbridge-Reitz (Walter et al. 2007, equation 33): `alpha^2 / (pi (1 - (1 - alpha^2) z^2)^2)`, alpha in (0, 1].
    Ggx {
        /// Roughness squared.
        alpha: f64,
    },
    /// Walter et al. 2007, equation 25: `e^(-tan^2 / m^2) / (pi m^2 z^4)`, m > 0.
    Beckmann {
        /// Slope, alpha.
        m: f64,
    },
    /// `(n+2) / (2 pi) z^n`, n >= 0.
    Blinn {
        /// Exponent.
        n: f64,
    },
}

impl Microfacets {
    /// Density at `z = n.h = 1 - om`, in [0, 1]; the projected distribution integrates to 1.
    pub fn density(&self, om: f64) -> f64 {
        let z = 1.0 - om;
        match *self {
            Self::Ggx { alpha } => {
                let q = alpha * alpha + (1.0 - alpha) * (1.0 + alpha) * om * (1.0 + z);
                alpha * alpha / (PI * q * q)
            }
            Self::Beckmann { m } => {
                let tangent_squared = om * (1.0 + z) / (z * z);
                if z <= 0.0 { 0.0 } else { (-tangent_squared / (m * m)).exp() / (PI * m * m * z.powi(4)) }
            }
            Self::Blinn { n } => (n + 2.0) / TAU * (n * (-om).ln_1p()).exp(),
        }
    }

    /// Angle over which the density falls off, as a sine: alpha or its like.
    pub fn width(&self) -> f64 {
        match *self {
            Self::Ggx { alpha } => alpha,
            Self::Beckmann { m } => m.min(1.0),
            Self::Blinn { n } => (2.0 / (n + 2.0)).sqrt(),
        }
    }

    /// The primitives at `z = 1 - om`, om in [0, 1].
    pub fn radial_primitive(&self, om: f64) -> RadialPrimitive {
        match *self {
            Self::Ggx { alpha } => ggx(alpha, om),
            Self::Beckmann { m } => beckmann(m, om),
            Self::Blinn { n } => blinn(n, om),
        }
    }
}

/// Integrals of a distribution D over [z, 1] in z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RadialPrimitive {
    /// Of D.
    pub whole: f64,
    /// Of D z.
    pub along: f64,
    /// Of D sqrt(1 - z^2).
    pub across: f64,
}

/// `whole = (om (1 + k^2 z) / (2 q) + alpha^2 artanh(k om / (1 - k^2 z)) / (2 k)) / pi`, `k^2 = 1 - alpha^2`, `q = 1 - k^2 z^2`;
/// `along = (1 - z^2) / (2 pi q)`; `across = alpha (atan t - t / (1 + t^2)) / (2 pi)`, `t = tan / alpha`.
fn ggx(alpha: f64, om: f64) -> RadialPrimitive {
    let z = 1.0 - om;
    let k_squared = (1.0 - alpha) * (1.0 + alpha);
    let k = k_squared.sqrt();
    let q = alpha * alpha + k_squared * om * (1.0 + z);
    // artanh x = ln(1 + 2 x / (1 - x)) / 2, and 1 - k = alpha^2 / (1 + k). In the limit k = 0 the quotient is om.
    let artanh_over_k =
        if k < 1e-8 { om / (alpha * alpha) } else { 0.5 / k * (2.0 * k * om / (alpha * alpha * (1.0 - k * om / (1.0 + k)))).ln_1p() };
    let t = (om * (1.0 + z)).sqrt() / (z.max(1e-300) * alpha);
    RadialPrimitive {
        whole: (om * (1.0 + k_squared * z) / q + alpha * alpha * artanh_over_k) / TAU,
        along: om * (1.0 + z) / (TAU * q),
        across: alpha / TAU * arc_rest(t),
    }
}

/// `atan t - t / (1 + t^2)`.
fn arc_rest(t: f64) -> f64 {
    let s = t * t;
    if s < 0.04 {
        // 2/3 t^3 - 4/5 t^5 + 6/7 t^7 - ...
        let term = |index: i32| f64::from(2 * index) / f64::from(2 * index + 1) * (-s).powi(index - 1);
        return t * s * (1..16).map(term).sum::<f64>();
    }
    t.atan() - t / (1.0 + s)
}

/// `sqrt(pi)/2 erf t - t e^(-t^2)`.
fn gauss_rest(t: f64) -> f64 {
    let s = t * t;
    if s < 0.04 {
        // 2/3 t^3 - 2/5 t^5 + 1/7 t^7 - 1/27 t^9 + ...: 2 (-s)^(k-1) / ((2k+1) (k-1)!).
        let mut factor = 2.0;
        let mut sum = 0.0;
        for index in 1..16 {
            sum += factor / f64::from(2 * index + 1);
            factor *= -s / f64::from(index);
        }
        return t * s * sum;
    }
    0.5 * PI.sqrt() * erf(t) - t * (-s).exp()
}

/// With `u = tan^2 / m^2`: `whole` is the integral of `sqrt(1 + m^2 u) e^(-u) / (2 pi)`, by quadrature; `along = (1 - e^(-u)) / (2 pi)`;
/// `across = m (sqrt(pi)/2 erf t - t e^(-t^2)) / (2 pi)`, `t = tan / m`.
fn beckmann(m: f64, om: f64) -> RadialPrimitive {
    let z = 1.0 - om;
    let u = om * (1.0 + z) / (z * z * m * m);
    // Beyond 60 nothing is left in 16 digits, unless sqrt(1 + m^2 u) grows, which it does slowly.
    let end = if u < 60.0 { u } else { 60.0 };
    let integral = integrate(0.0, end, 8, |u| (1.0 + m * m * u).sqrt() * (-u).exp());
    RadialPrimitive { whole: integral / TAU, along: -(-end).exp_m1() / TAU, across: m / TAU * gauss_rest(end.sqrt()) }
}

/// `whole = (n+2) (1 - z^(n+1)) / (2 pi (n+1))`, `along = (1 - z^(n+2)) / (2 pi)`; `across` by quadrature.
fn blinn(n: f64, om: f64) -> RadialPrimitive {
    let log_z = (-om).ln_1p().max(-1e9);
    let z = 1.0 - om;
    let angle = (om * (1.0 + z)).sqrt().atan2(z);
    // In the angle: sin^2 cos^n.
    let integrand = |angle: f64| angle.sin().powi(2) * (n * (-2.0 * (0.5 * angle).sin().powi(2)).ln_1p()).exp();
    let end = angle.min(9.0 / (n + 1.0).sqrt());
    RadialPrimitive {
        whole: -(n + 2.0) / (TAU * (n + 1.0)) * ((n + 1.0) * log_z).exp_m1(),
        along: -((n + 2.0) * log_z).exp_m1() / TAU,
        across: (n + 2.0) / TAU * integrate(0.0, end, 4, integrand),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const ALL: [Microfacets; 7] = [
        Microfacets::Ggx { alpha: 1.0 },
        Microfacets::Ggx { alpha: 0.3 },
        Microfacets::Ggx { alpha: 0.002 },
        Microfacets::Beckmann { m: 0.6 },
        Microfacets::Beckmann { m: 0.01 },
        Microfacets::Blinn { n: 0.0 },
        Microfacets::Blinn { n: 3000.0 },
    ];

    /// By quadrature in the angle, in panels that grow from the lobe's width.
    fn by_quadrature(microfacets: Microfacets, om: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let end = (om * (2.0 - om)).sqrt().atan2(1.0 - om);
        let (mut low, mut high, mut sum) = (0.0, 0.2 * microfacets.width(), 0.0);
        while low < end {
            sum += integrate(low, end.min(high), 1, |angle| {
                microfacets.density(2.0 * (0.5 * angle).sin().powi(2)) * angle.sin() * weight(angle)
            });
            (low, high) = (high, 1.5 * high);
        }
        sum
    }

    #[test]
    fn primitives_are_integrals_of_the_density() {
        for microfacets in ALL {
            for om in [1e-12, 1e-7, 1e-4, 0.01, 0.2, 0.6, 0.97] {
                let found = microfacets.radial_primitive(om);
                let expected = [|_: f64| 1.0, f64::cos, f64::sin].map(|weight| by_quadrature(microfacets, om, weight));
                for (found, expected) in [found.whole, found.along, found.across].into_iter().zip(expected) {
                    assert!((found - expected).abs() <= 1e-11 * expected, "{microfacets:?} at {om}: {found} is not {expected}");
                }
            }
        }
    }

    #[test]
    fn projected_distributions_integrate_to_one() {
        for microfacets in ALL {
            let all = microfacets.radial_primitive(1.0 - 1e-15).along * TAU;
            assert!((all - 1.0).abs() < 1e-9, "{microfacets:?}: {all}");
        }
    }
}
