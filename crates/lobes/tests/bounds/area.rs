//! Edges of area lights and small lights.

use crate::search::{Bound, direction, log_uniform};
use glam::DVec3;
use lobelia_lobes::area_light::{axial_moment::*, boundary::Boundary, edge_models::*};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Of an edge, in lobe fractions.
fn owen_error(p: &[f64], nodes: u32) -> f64 {
    edge_error(p, log_uniform(p[3], 6.0, 1e6), nodes)
}

fn edge_error(p: &[f64], n: f64, nodes: u32) -> f64 {
    let s = log_uniform(p[0], 1e-7, 1.0);
    let (mut low, mut high) = (FRAC_PI_2 * (2.0 * p[1] - 1.0), FRAC_PI_2 * (2.0 * p[2] - 1.0));
    if low > high {
        (low, high) = (high, low);
    }
    (edge_j_model(EdgeModel::Owen { nodes }, s, low, high, n) - edge_j(s, low, high, n)).abs() / TAU
}

/// A triangle of a size of 1e-8 to 1, at a height above its plane of 1e-3 to 1, in double precision against its own expansion: all of a right triangle's
/// solid angle by the formula for a corner above the right angle is `atan` of known sides.
fn solid_angle_error(p: &[f64]) -> f64 {
    let (a, b) = (log_uniform(p[0], 1e-8, 1.0), log_uniform(p[1], 1e-8, 1.0));
    // The rectangle [0, a] x [0, b] at height 1: asin(a b / sqrt((1 + a^2) (1 + b^2))).
    let exact = (a * b / ((1.0 + a * a) * (1.0 + b * b)).sqrt()).asin();
    let turn = glam::DQuat::from_axis_angle(direction(p[2], p[3]), TAU * p[4]);
    let corners = [(0.0, 0.0), (0.0, b), (a, b), (a, 0.0)].map(|(x, y)| turn * DVec3::new(x, y, 1.0));
    let found = solid_angle(&Boundary::polygon(&corners), None);
    // Corners themselves are rounded to 1e-16 of their distance.
    (found.abs() / exact - 1.0).abs() / (1.0 + 1.0 / a.min(b))
}

/// Arvo's recurrence of an order up to 40 against the integral, relative.
fn recurrence_error(p: &[f64]) -> f64 {
    let (length, c, foot) = (log_uniform(p[0], 1e-12, 1.5), p[1].max(1e-3), 1.5 * (2.0 * p[2] - 1.0));
    let foot = if foot - length < -1.5 { length - 1.5 } else { foot };
    let order = (40.0 * p[3]) as u32;
    let exact = arvo_integral(length, c, foot, f64::from(order), order % 2 == 1);
    (arvo_recurrence(length, c, foot, order) - exact).abs() / exact.abs().max(1e-300).max(1e-3 * length * c)
}

macro_rules! bound {
    ($name:literal, $domain:literal, $reference:literal, $stated:literal, $dimensions:literal, $error:expr) => {
        Bound { name: $name, domain: $domain, reference: $reference, stated: $stated, dimensions: $dimensions, error: $error, worst: &[] }
    };
}

/// All of them.
pub fn bounds() -> Vec<Bound> {
    vec![
        bound!("Owen, 2 nodes", "an edge; n 6 to 1e6", "quadrature, in lobe fractions", 5e-4, 4, |p| owen_error(p, 2))
            .at(&[&[0.81876, 0.48285, 0.51715, 0.19936]]),
        bound!("Owen, 3 nodes", "an edge; n 6 to 1e6", "quadrature, in lobe fractions", 4.5e-5, 4, |p| owen_error(p, 3))
            .at(&[&[0.81876, 0.48285, 0.51715, 0.19936]]),
        bound!("Owen, 4 nodes", "an edge; n 6 to 1e6", "quadrature, in lobe fractions", 2.7e-5, 4, |p| owen_error(p, 4))
            .at(&[&[0.93854, 0.9935, 0.00215, 0.0]]),
        bound!("Owen, 6 nodes", "an edge; n 6 to 1e6", "quadrature, in lobe fractions", 2.7e-5, 4, |p| owen_error(p, 6))
            .at(&[&[0.93854, 0.9935, 0.00215, 0.0]]),
        bound!("Owen, any nodes", "an edge; n 0 to 6", "quadrature, in lobe fractions", 1.2e-4, 4, |p| edge_error(p, 5.999 * p[3], 3))
            .at(&[&[0.9446, 1.0, 0.0, 1.0]]),
        bound!(
            "solid_angle",
            "rectangles of sides 1e-8 to 1 at distance 1, turned",
            "closed form, over what rounded corners leave",
            2e-15,
            5,
            solid_angle_error
        ),
        bound!("arvo_recurrence", "arcs of 1e-12 to 1.5, c 1e-3 to 1, order 0 to 40", "quadrature", 1e-10, 4, recurrence_error),
    ]
}
