//! The integral of a cosine lobe along an edge at a cost that does not depend on the exponent: Owen's T function, and the peak functions of the paper.

use super::axial_moment::{Edge, log_c};
use super::boundary::{Boundary, Piece};
use crate::{
    quadrature::gauss_legendre,
    special::{erf, erfc},
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// How an edge is integrated. Below n = 2, where there is no peak, all take the integrand itself by six nodes. Root mean square errors are in lobe fractions over the scenes of the specification, at exponents 100 and 5000.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeModel {
    /// `1 / (1 + a phi^2)` fitted to height and half width: 7.5e-3, 3.0e-3.
    Lorentzian,
    /// A blend with `1 / (1 + b phi^2)^2`: 2.9e-3, 1.8e-3.
    LorentzianPearson,
    /// A blend of `a / (1 + (a-1) cos^2 phi)` with the square of its like: 2.7e-3, 1.0e-3.
    Ellipsoid,
    /// The uniform expansion for large exponents, whose first term is Owen's T function, by so many Gauss-Legendre nodes: with three 7.4e-6, 4.2e-7.
    ///
    /// An edge is off by at most 5e-4 of a lobe with two nodes, 4.5e-5 with three, 2.7e-5 (at n = 6, less above) with four and more; a polygon, and what planes
    /// leave of it, by at most the sum over its edges. Below n = 6 the integrand itself by six nodes: 2e-5 of a lobe at n = 5, 1.2e-4 just below 6.
    Owen {
        /// 2 to 8.
        nodes: u32,
    },
}

/// Azimuth about the axis from the foot to phi within [-pi/2, pi/2].
fn azimuth(s: f64, phi: f64) -> f64 {
    phi.sin().atan2(s * phi.cos().max(0.0))
}

/// `(1 - z^order) / (1 - z^2)` at `z = c cos phi`.
fn integrand(s: f64, phi: f64, order: f64) -> f64 {
    let versine = (s * s + (1.0 - s * s) * phi.sin().powi(2)).min(1.0);
    if versine == 0.0 { 0.5 * order } else { -(0.5 * order * (-versine).ln_1p().max(-1e9)).exp_m1() / versine }
}

/// -log(1 - x^2), at most 745.
fn bend(x: f64) -> f64 {
    (-(-x * x).ln_1p()).min(745.0)
}

/// `J = integral of z^(n+1) d theta` over [low, high] within [-pi/2, pi/2], s in [0, 1], n > -1. Of sign 0 at s = 0: 0 there by convention.
pub fn edge_j_model(model: EdgeModel, s: f64, low: f64, high: f64, n: f64) -> f64 {
    let order = n + 1.0;
    if s >= 1.0 || high <= low {
        return 0.0;
    }
    let turn = azimuth(s, high) - azimuth(s, low);
    match model {
        _ if n < 2.0 || (n < 6.0 && matches!(model, EdgeModel::Owen { .. })) => {
            let node = |(place, weight): &(f64, f64)| weight * integrand(s, low + (high - low) * place, order);
            turn - s * (high - low) * gauss_legendre(6).iter().map(node).sum::<f64>()
        }
        EdgeModel::Owen { nodes: count } => {
            let rule = gauss_legendre(count as usize);
            high.signum() * owen_end(s, order, high.abs(), &rule) - low.signum() * owen_end(s, order, low.abs(), &rule)
        }
        _ => turn - peak(model, s, low, high, order),
    }
}

/// J from the foot: `2 pi T(h, a) + k E_0 c^N - s (1 + 3 sigma/4) c^N (E_0 - y e^(-N y^2 / 2)) / (32 N)`.
fn owen_end(s: f64, order: f64, phi: f64, rule: &[(f64, f64)]) -> f64 {
    let sigma = bend(s);
    let square = bend(phi.sin());
    let (y, h_squared) = (square.sqrt(), order * sigma);
    let quadrature = |h_squared: f64, a: f64| {
        let node = |(place, weight): &(f64, f64)| {
            let x = 1.0 + (a * place).powi(2);
            weight * (-0.5 * h_squared * x).exp() / x
        };
        a * rule.iter().map(node).sum::<f64>()
    };
    let a = y / sigma.sqrt().max(1e-300);
    let own_tail = erfc((0.5 * order).sqrt() * y);
    let owen = if a <= 1.0 {
        quadrature(h_squared, a)
    } else {
        let tail = erfc((0.5 * h_squared).sqrt());
        FRAC_PI_2 * (tail + own_tail - tail * own_tail) - quadrature(order * square, 1.0 / a)
    };
    let k = if sigma < 0.02 { s * (0.25 + 7.0 / 96.0 * sigma) } else { 1.0 / s - 1.0 / sigma.sqrt() };
    let e = (FRAC_PI_2 / order).sqrt() * erf((0.5 * order).sqrt() * y);
    let correction = s * (1.0 + 0.75 * sigma) / (32.0 * order) * (e - y * (-0.5 * order * square).exp());
    owen + (order * log_c(s)).exp() * (k * e - correction)
}

/// Least value, value at a test point, integral.
type Peak = [f64; 3];

fn ellipsoid_turn(a: f64, low: f64, high: f64) -> f64 {
    (a.sqrt() * (high - low).sin()).atan2(a * low.cos() * high.cos() + low.sin() * high.sin())
}

fn first_peak(model: EdgeModel, a: f64, test: f64, low: f64, high: f64) -> Peak {
    if model == EdgeModel::Ellipsoid {
        return [a, a / (1.0 + (a - 1.0) * test.cos().powi(2)), a.sqrt() * ellipsoid_turn(a, low, high)];
    }
    let root = a.sqrt();
    [1.0 / (1.0 + a * FRAC_PI_2.powi(2)), 1.0 / (1.0 + a * test * test), ((root * high).atan() - (root * low).atan()) / root]
}

fn second_peak(model: EdgeModel, b: f64, test: f64, low: f64, high: f64) -> Peak {
    if model == EdgeModel::Ellipsoid {
        let end = |phi: f64| b * (b - 1.0) * (2.0 * phi).sin() / (4.0 * (1.0 + (b - 1.0) * phi.cos().powi(2)));
        let value = b / (1.0 + (b - 1.0) * test.cos().powi(2));
        return [b * b, value * value, 0.5 * b.sqrt() * (b + 1.0) * ellipsoid_turn(b, low, high) - end(high) + end(low)];
    }
    let root = b.sqrt();
    let end = |phi: f64| 0.5 * (phi / (1.0 + b * phi * phi) + (root * phi).atan() / root);
    let square = |x: f64| (1.0 + b * x * x).powi(-2);
    [square(FRAC_PI_2), square(test), end(high) - end(low)]
}

/// E from a peak fitted to the integrand's height, half width (Lecocq et al., equation 7) and value 1 at pi/2; the blend, where there are two, is right at
/// a test point.
fn peak(model: EdgeModel, s: f64, low: f64, high: f64, order: f64) -> f64 {
    let c = ((1.0 - s) * (1.0 + s)).max(0.0).sqrt();
    let most = integrand(s, 0.0, order);
    if most < 1.0 + 1e-5 {
        return s * (high - low);
    }
    let missing = (s * s / (1.0 + c) + c / (order - 3.0).max(1.0)).min(1.0 - 1e-16);
    let relative = (-(2.5 * (-missing).ln_1p()).exp_m1()).max(1e-12).powf(0.45);
    let half_width = FRAC_PI_4 * relative;
    let share = ((integrand(s, half_width, order) - 1.0) / (most - 1.0)).clamp(1e-6, 1.0 - 1e-6);
    let (a, b) = if model == EdgeModel::Ellipsoid {
        let a = (half_width.tan().powi(2) * share / (1.0 - share)).clamp(1e-12, 0.99);
        (a, (a * (2.1 - 1.28 * relative)).min(0.99))
    } else {
        let a = ((1.0 - share - 4.0 * half_width * half_width / (PI * PI)) / (share * half_width * half_width)).max(0.04);
        (a, 0.5 * a)
    };
    let test = half_width + 0.3946 * FRAC_PI_4 * (1.0 - (1.0 - relative).powi(12));
    let fitted = |[least, at_test, area]: Peak| {
        let scale = (most - 1.0) / (1.0 - least);
        (1.0 + scale * (at_test - least), scale * area + (1.0 - scale * least) * (high - low))
    };
    let (first_test, first) = fitted(first_peak(model, a, test, low, high));
    if model == EdgeModel::Lorentzian {
        return s * first;
    }
    let (second_test, second) = fitted(second_peak(model, b, test, low, high));
    let difference = second_test - first_test;
    let difference = if difference.abs() < 1e-12 { 1e-12 } else { difference };
    let blend = ((second_test - integrand(s, test, order)) / difference).clamp(0.0, 1.0);
    s * (second + (first - second) * blend)
}

/// The lobe fraction `(n+1)/(2 pi) integral of max(u.axis, 0)^n` of a polygon's part above the plane of `normal`, for any simple outline that runs counter-clockwise.
///
/// `W - sum of J`: J is 0 at the lobe's own horizon and beyond, so the polygon is not cut there; W is 2 pi where the axis is inside. Both know on which side
/// of an edge the axis is by the same number. A design of this project.
pub fn lobe_fraction_model(model: EdgeModel, light: &Boundary, normal: Option<DVec3>, axis: DVec3, n: f64) -> f64 {
    let above = normal.map_or_else(|| light.uncut(), |normal| light.clip(normal).uncut());
    let (mut walked, mut sum) = (0.0, 0.0);
    for piece in &above.pieces {
        let Piece::Segment { from, to, .. } = *piece else { continue };
        let Some(edge) = Edge::new(from, to, axis) else { continue };
        // An axis on the edge is on its inner side; azimuth and J then see the same thing.
        let nearness = edge.s.max(1e-12);
        let shift = if edge.phi_to > 1.5 * PI { TAU } else { 0.0 };
        let [low, high] = [edge.phi_from, edge.phi_to].map(|phi| (phi - shift).clamp(-FRAC_PI_2, FRAC_PI_2));
        sum += edge.sign * edge_j_model(model, nearness, low, high, n);
        let [(sine_from, cosine_from), (sine_to, cosine_to)] = [edge.phi_from.sin_cos(), edge.phi_to.sin_cos()];
        let turn = (nearness * edge.length().sin()).atan2(sine_from * sine_to + nearness * nearness * cosine_from * cosine_to);
        walked += edge.sign * turn;
    }
    // Once around the axis, not at all, or around the opposite direction; in between only with the axis on a corner.
    let turns = walked / TAU;
    let inside = if (turns - turns.round()).abs() < 1e-6 { TAU * turns.round().max(0.0) } else { walked };
    (inside - sum).max(0.0) / TAU
}
