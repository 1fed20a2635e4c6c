//! The axial moment `M = integral of max(u.r, 0)^n du` over the solid angle of a light, for any real n > -1, to about 1e-13: what every
//! approximation is measured against.
//!
//! Polar integration about r turns it into `(n+1) M = sum of E` over the edges, `E = integral of (1 - z^(n+1)) d theta` with the azimuth theta about r.
//! There is no parity of n and no solid angle in it. `(n+1) M / 2 pi` is the *lobe fraction*: 1 where the light covers the hemisphere about r.

use super::boundary::{Boundary, Piece};
use crate::quadrature::{integrate, integrate_adaptive};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// An edge as a great-circle arc, in the terms of its integral.
///
/// The cosine to the axis is `z = c cos phi` with `c = sqrt(1 - s^2)`, phi counted from the point of the great circle that is nearest to the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Distance of the axis from the edge's great circle: |n.r|, in [0, 1].
    pub s: f64,
    /// Cosine of the angle between the axis and the great circle, in [0, 1].
    pub c: f64,
    /// First angle.
    pub phi_from: f64,
    /// Last angle, not below the first.
    pub phi_to: f64,
    /// +1 where the axis is on the inner side, -1 where it is on the outer one; the edge's share of the sum has this sign.
    pub sign: f64,
    /// The unit normal of the great circle, pointing out of the region.
    pub normal: DVec3,
}

impl Edge {
    /// The edge between two points as seen from the origin; none if they are seen in one direction.
    pub fn new(from: DVec3, to: DVec3, axis: DVec3) -> Option<Self> {
        let (from, to) = (from.try_normalize()?, to.try_normalize()?);
        let cross = from.cross(to - from);
        let normal = cross.try_normalize()?;
        let tangent = normal.cross(from);
        let length = cross.length().atan2(from.dot(to));
        let (along, across) = (from.dot(axis), tangent.dot(axis));
        let foot = across.atan2(along);
        let side = normal.dot(axis);
        Some(Self {
            s: side.abs().min(1.0),
            c: along.hypot(across).min(1.0),
            phi_from: -foot,
            phi_to: length - foot,
            sign: if side > 0.0 { -1.0 } else { 1.0 },
            normal,
        })
    }

    /// Its length, rad.
    pub fn length(&self) -> f64 {
        self.phi_to - self.phi_from
    }
}

/// Logarithm of `sqrt(1 - s^2)`.
pub fn log_c(s: f64) -> f64 {
    if s < 0.7 { 0.5 * (-s * s).ln_1p() } else { 0.5 * ((1.0 - s) * (1.0 + s)).max(1e-300).ln() }
}

/// `E = integral of s (1 - z^(n+1)) / (1 - z^2) d phi` over [phi_from, phi_to] within [-pi/2, pi/2], for s in [0, 1] and n > -1; 0 at s = 0.
pub fn edge_e(s: f64, phi_from: f64, phi_to: f64, n: f64) -> f64 {
    let (order, log_c) = (n + 1.0, log_c(s));
    over_tangent(s, phi_from, phi_to, order, |log_bent| -(order * log_c - 0.5 * order * log_bent).exp_m1())
}

/// `J = integral of z^(n+1) d theta` over the same edge: the azimuth it covers, less [`edge_e`]. Keeps its digits where it is small.
pub fn edge_j(s: f64, phi_from: f64, phi_to: f64, n: f64) -> f64 {
    let (order, log_c) = (n + 1.0, log_c(s));
    over_tangent(s, phi_from, phi_to, order, |log_bent| (order * log_c - 0.5 * order * log_bent).exp())
}

/// Integral of `f(log(1 + s^2 x^2)) / (1 + x^2)` over `x = tan theta = tan phi / s`: there `z^2 = c^2 / (1 + s^2 x^2)`. Panels grow by factors of two
/// from a fraction of the narrowest feature, 1 or the lobe's width.
fn over_tangent(s: f64, phi_from: f64, phi_to: f64, order: f64, f: impl Fn(f64) -> f64) -> f64 {
    if s <= 0.0 {
        return 0.0;
    }
    let tangent = |phi: f64| phi.clamp(-FRAC_PI_2, FRAC_PI_2).tan() / s;
    let integrand = |x: f64| f((s * x).powi(2).ln_1p()) / (1.0 + x * x);
    let half_line = |low: f64, high: f64| {
        let mut end = 0.25 * (1.0 / (s * order.max(1e-3).sqrt())).min(1.0);
        let (mut start, mut sum) = (0.0, 0.0);
        while start < high {
            let (a, b) = (f64::max(start, low), end.min(high));
            if b > a {
                sum += integrate(a, b, 1, integrand);
            }
            (start, end) = (end, 2.0 * end);
        }
        sum
    };
    let (from, to) = (tangent(phi_from), tangent(phi_to));
    match (from < 0.0, to < 0.0) {
        (true, true) => half_line(-to, -from),
        (true, false) => half_line(0.0, -from) + half_line(0.0, to),
        _ => half_line(from, to),
    }
}

/// `(n+1) M` over a region that lies within the hemisphere about `axis`, as made by [`Boundary::clip`] with that axis last.
pub fn scaled_moment(region: &Boundary, axis: DVec3, n: f64) -> f64 {
    region.pieces.iter().map(|piece| piece_e(piece, axis, n)).sum()
}

/// E of a piece, with its sign.
fn piece_e(piece: &Piece, axis: DVec3, n: f64) -> f64 {
    match *piece {
        Piece::Segment { from, to, cut } => Edge::new(from, to, axis).map_or(0.0, |edge| {
            // In the plane perpendicular to the axis z is 0; where along the edge its largest value would be is rounding noise.
            let flat = cut || edge.c < 1e-13;
            edge.sign * if flat { edge.length() } else { edge_e(edge.s, edge.phi_from, edge.phi_to, n) }
        }),
        Piece::Arc { ellipse, from, to } => {
            let integrand = |f: f64| {
                let (p, tangent) = (ellipse.point(f), ellipse.tangent(f));
                let across = p - axis * p.dot(axis);
                let square = across.length_squared();
                if square == 0.0 {
                    return 0.0;
                }
                let log_z = if p.dot(axis) <= 0.0 { -1e9 } else { 0.5 * (-square / p.length_squared()).max(-1.0 + 1e-300).ln_1p() };
                -axis.dot(across.cross(tangent)) / square * -((n + 1.0) * log_z).exp_m1()
            };
            integrate_adaptive(from, to, 1e-14, integrand)
        }
    }
}

/// The moment `M` of a light: the part of its solid angle above the plane of `normal` (all of it without one), clamped at the plane of `axis`, a unit
/// vector. Negative for an outline that runs clockwise.
///
/// For n > -1. Both directions of cutting happen here: light below the surface, and the lobe's own horizon.
pub fn axial_moment(light: &Boundary, normal: Option<DVec3>, axis: DVec3, n: f64) -> f64 {
    let above = normal.map_or_else(|| light.clone(), |normal| light.clip(normal));
    scaled_moment(&above.clip(axis), axis, n) / (n + 1.0)
}

/// Integral of `max(u.axis, 0)^n (u.w)` over the part of a polygon above the plane of `normal`, for unit vectors and n >= 0: the cosine lobe about two axes,
/// with `w` the normal.
///
/// `(w.axis) M^(n+1) - 1/(n+2) sum over edges of (n_i.w') times the integral of z^n d phi`, w' the part of w across the axis: exact, where Lecocq et al. 2017 take
/// one lobe for the product (a design of this project).
pub fn two_axis_moment(light: &Boundary, normal: DVec3, axis: DVec3, w: DVec3, n: f64) -> f64 {
    let region = light.clip(normal).clip(axis);
    let across = w - axis * w.dot(axis);
    let edge = |piece: &Piece| match *piece {
        Piece::Segment { from, to, .. } => Edge::new(from, to, axis).map_or(0.0, |edge| {
            let width = 1.0 / (n + 1.0).sqrt();
            let panels = (edge.length() / width).ceil().clamp(1.0, 400.0) as usize;
            let integrand = |phi: f64| (n * ((edge.c * phi.cos()).max(1e-300)).ln()).exp();
            // Beyond this the lobe is below 1e-20 of its peak.
            let reach = (10.0 * width).min(FRAC_PI_2);
            let (low, high) = (edge.phi_from.clamp(-reach, reach), edge.phi_to.clamp(-reach, reach));
            edge.normal.dot(across) * integrate(low, high, panels.min(40), integrand)
        }),
        Piece::Arc { ellipse, from, to } => integrate_adaptive(from, to, 1e-14, |f| {
            let (p, tangent) = (ellipse.point(f), ellipse.tangent(f));
            let z = (p.dot(axis) / p.length()).max(1e-300);
            p.cross(tangent).dot(across) / p.length_squared() * (n * z.ln()).exp()
        }),
    };
    let edges: f64 = region.pieces.iter().map(edge).sum();
    (w.dot(axis) * scaled_moment(&region, axis, n + 1.0) - edges) / (n + 2.0)
}

/// Solid angle, sr, of the part above the plane of `normal`, or of all: that of a polygon as the sum of triangles about its first corner (Van Oosterom and
/// Strackee 1983, The Solid Angle of a Plane Triangle), to rounding however small it is. Positive for an outline that runs counter-clockwise.
pub fn solid_angle(light: &Boundary, normal: Option<DVec3>) -> f64 {
    if light.is_empty() {
        return 0.0;
    }
    let above = normal.map_or_else(|| light.clone(), |normal| light.clip(normal));
    let corner = |piece: &Piece| match *piece {
        Piece::Segment { from, .. } => Some(from),
        Piece::Arc { .. } => None,
    };
    let Some(corners) = above.pieces.iter().map(corner).collect::<Option<Vec<DVec3>>>() else {
        return axial_moment(light, normal, light.facing, 0.0);
    };
    let triangle = |a: DVec3, b: DVec3, c: DVec3| {
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        // The triple product from differences: the corners of a small triangle are nearly parallel.
        let volume = -a.dot((b - a).cross(c - a));
        2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    let Some(first) = corners.first() else { return 0.0 };
    corners.windows(2).skip(1).map(|pair| triangle(*first, pair[0], pair[1])).sum()
}

/// Lobe fraction: `(n+1) M / 2 pi`.
pub fn lobe_fraction(moment: f64, n: f64) -> f64 {
    (n + 1.0) * moment / TAU
}

/// Arvo's integral over an edge, `F = integral of (f - z^(m+2)) / (1 - z^2) d phi` with f = z for an odd `order` m and 1 for an even one; any real m.
pub fn arvo_integral(length: f64, c: f64, foot: f64, order: f64, odd: bool) -> f64 {
    let s_squared = (1.0 - c) * (1.0 + c);
    let integrand = |phi: f64| {
        let (sine, cosine) = phi.sin_cos();
        let z = c * cosine;
        let versine = s_squared + (c * sine).powi(2);
        if odd {
            // z (1 - z^(m+1)), also where z is negative: m is whole then.
            let power = if z > 0.0 { -((order + 1.0) * 0.5 * (-versine).ln_1p()).exp_m1() } else { 1.0 - z.abs().powf(order + 1.0) };
            z * if versine == 0.0 { 0.5 * (order + 1.0) } else { power / versine }
        } else {
            let log = if versine < 1.0 { 0.5 * (-versine).ln_1p() } else { -1e9 };
            if versine == 0.0 { 0.5 * (order + 2.0) } else { -((order + 2.0) * log).exp_m1() / versine }
        }
    };
    // From 0, since the ends of a short arc far from the foot are equal but for rounding.
    integrate_adaptive(0.0, length, 1e-14, |along| integrand(along - foot))
}

/// The same for a whole order by Arvo's recurrence, at a cost that grows with it (Arvo 1995, Applications of Irradiance Tensors).
pub fn arvo_recurrence(length: f64, c: f64, foot: f64, order: u32) -> f64 {
    let (low, high) = (-foot, length - foot);
    // The difference of cos^k sin at both ends, which are nearly equal for a short arc: that of the sines and that of the cosines' powers.
    let half = (0.5 * length).sin();
    let (sines, cosines) = (2.0 * half * (0.5 * length - foot).cos(), -2.0 * half * (0.5 * length - foot).sin());
    let growth = cosines / low.cos();
    let ends = |power: i32| {
        let log_growth = f64::from(power) * growth.max(-0.5).ln_1p();
        if growth.abs() < 0.5 && log_growth.abs() < 1.0 {
            (c * low.cos()).powi(power) * c * (log_growth.exp_m1() * high.sin() + sines)
        } else {
            (c * high.cos()).powi(power) * c * high.sin() - (c * low.cos()).powi(power) * c * low.sin()
        }
    };
    let odd = order % 2 == 1;
    // Integrals of z^k: k z_k = [z^(k-1) c sin] + (k-1) c^2 z_(k-2).
    let mut power = if odd { ends(0) } else { length };
    let (mut sum, mut k) = (power, if odd { 1 } else { 0 });
    while k + 2 <= order {
        k += 2;
        power = (ends(k as i32 - 1) + f64::from(k - 1) * c * c * power) / f64::from(k);
        sum += power;
    }
    sum
}

/// The moment for a whole exponent by Arvo's sum: `(n+1) M = [n even] solid angle - sum of (n_i.r) F(n-1)`. The reference of linear cost.
pub fn axial_moment_arvo(light: &Boundary, normal: Option<DVec3>, axis: DVec3, n: u32) -> f64 {
    let above = normal.map_or_else(|| light.clone(), |normal| light.clip(normal)).clip(axis);
    let edge = |piece: &Piece| match *piece {
        Piece::Segment { from, to, cut } => {
            let Some(edge) = Edge::new(from, to, axis) else { return 0.0 };
            let c = if cut { 0.0 } else { edge.c };
            if n == 0 { 0.0 } else { edge.sign * edge.s * arvo_recurrence(edge.length(), c, -edge.phi_from, n - 1) }
        }
        Piece::Arc { .. } => piece_e(piece, axis, f64::from(n)),
    };
    let sum: f64 = above.pieces.iter().map(edge).sum();
    let area = if n.is_multiple_of(2) && !above.is_empty() { scaled_moment(&above.uncut(), above.facing, 0.0) } else { 0.0 };
    (sum + area) / f64::from(n + 1)
}
