//! Microfacet lobes integrated over lights, along their outlines.
//!
//! Over a region of light directions i the integral of `D(h) / (4 h.v) di` is that of `D(h) dh` over their half vectors, and by polar integration about the
//! normal the one of `H(z) d theta` along the region's edge, with the [radial primitive](super::radial_primitive) H of D and the azimuth theta of the half
//! vector about the normal. Nothing is fitted, and any isotropic distribution will do.

use super::{
    boundary::{Boundary, Piece},
    radial_primitive::{Microfacets, RadialPrimitive},
};
use crate::quadrature::{gauss_legendre, integrate_adaptive};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A microfacet lobe integrated over the half vectors of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HalfVectorIntegral {
    /// Integral of `D(h) dh`: that of `D / (4 h.v)` over light directions.
    pub whole: f64,
    /// Integral of `D(h) h dh` in the coordinates of the caller. Its direction is the mean half vector; its cosine to the viewer is the integral of
    /// `D(h) (h.v) dh`.
    pub mean: DVec3,
}

/// Where a half vector is: in the frame with z along the normal and the viewer in the half plane y = 0, x >= 0.
struct Placed {
    p: DVec3,
    across: DVec2,
    om: f64,
}

impl Placed {
    fn new(direction: DVec3, view: DVec3) -> Self {
        let p = direction + view;
        let across = p.truncate();
        let sine_squared = across.length_squared() / p.length_squared().max(1e-300);
        Self { p, across, om: sine_squared / (1.0 + (1.0 - sine_squared).max(0.0).sqrt()) }
    }

    /// d theta / d phi, for the derivative of the direction.
    fn turn(&self, derivative: DVec3) -> f64 {
        self.across.perp_dot(derivative.truncate()) / self.across.length_squared().max(1e-300)
    }
}

struct Arc {
    from: DVec3,
    tangent: DVec3,
    length: f64,
}

impl Arc {
    fn new(from: DVec3, to: DVec3) -> Option<Self> {
        let cross = from.cross(to - from);
        let normal = cross.try_normalize()?;
        let start = from.try_normalize()?;
        Some(Self { from: start, tangent: normal.cross(start), length: cross.length().atan2(from.dot(to)) })
    }

    fn at(&self, phi: f64) -> (DVec3, DVec3) {
        let (sine, cosine) = phi.sin_cos();
        (self.from * cosine + self.tangent * sine, self.tangent * cosine - self.from * sine)
    }

    /// Where the half vector is nearest to the normal: Newton steps from where the mirror direction is nearest.
    fn foot(&self, view: DVec3) -> f64 {
        let mirror = DVec3::new(-view.x, -view.y, view.z);
        let mut foot = mirror.dot(self.tangent).atan2(mirror.dot(self.from));
        let (below, above) = (-foot, foot - self.length);
        if (foot < 0.0 && below > TAU - self.length - below) || (above > 0.0 && above <= TAU - foot) {
            foot = self.length;
        }
        foot = foot.clamp(0.0, self.length);
        for _ in 0..2 {
            let (q, d) = self.at(foot);
            let (square, height) = (2.0 + 2.0 * q.dot(view), q.z + view.z);
            let slope = d.z * square - height * view.dot(d);
            let bend = -q.z * square + d.z * view.dot(d) + height * view.dot(q);
            foot += if bend < 0.0 { -(slope / bend).clamp(-0.5, 0.5) } else { 0.3 * slope.signum() };
        }
        foot.clamp(0.0, self.length)
    }
}

/// The outline integral with `nodes` Gauss-Legendre nodes on either side of each edge's foot, spaced by `phi = foot + w sinh nu`; half vectors of elliptical arcs
/// by adaptive quadrature. `normal` and `view` are unit, and `view` is above the horizon.
///
/// Relative root mean square error over random quads, up to 70 degrees and at 85: three nodes 0.2 % and 1 %, four 0.05 % and 0.1 %, six 1e-5 and 1e-4;
/// thirty and more are exact to rounding. The width w joins the distance of the foot from the normal and the lobe's own; what is constant along an edge is
/// integrated in closed form, which keeps the tails. Both are designs of this project.
pub fn half_vector_integral(light: &Boundary, normal: DVec3, view: DVec3, microfacets: Microfacets, nodes: usize) -> HalfVectorIntegral {
    let axis_x = (view - normal * view.dot(normal)).try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    let axis_y = normal.cross(axis_x);
    let local = |v: DVec3| DVec3::new(v.dot(axis_x), v.dot(axis_y), v.dot(normal));
    let view = local(view);
    let rule = gauss_legendre(nodes);
    let mut sum = HalfVectorIntegral::default();
    for piece in &light.clip(normal).pieces {
        match *piece {
            Piece::Segment { from, to, .. } => {
                if let Some(arc) = Arc::new(local(from), local(to)) {
                    add_edge(&mut sum, &arc, view, microfacets, &rule);
                }
            }
            Piece::Arc { ellipse, from, to } => {
                let term = |pick: &dyn Fn(RadialPrimitive, DVec2) -> f64| {
                    integrate_adaptive(from, to, 1e-13, |f| {
                        let (p, tangent) = (local(ellipse.point(f)), local(ellipse.tangent(f)));
                        let inverse = 1.0 / p.length();
                        let direction = p * inverse;
                        let derivative = (tangent - direction * direction.dot(tangent)) * inverse;
                        let placed = Placed::new(direction, view);
                        pick(microfacets.radial_primitive(placed.om), placed.across.normalize_or_zero()) * placed.turn(derivative)
                    })
                };
                sum.whole -= term(&|primitive, _| primitive.whole);
                let across = |axis: usize| term(&move |primitive, towards: DVec2| primitive.across * towards[axis]);
                sum.mean -= DVec3::new(across(0), across(1), term(&|primitive, _| primitive.along));
            }
        }
    }
    HalfVectorIntegral { mean: axis_x * sum.mean.x + axis_y * sum.mean.y + normal * sum.mean.z, ..sum }
}

fn add_edge(sum: &mut HalfVectorIntegral, arc: &Arc, view: DVec3, microfacets: Microfacets, rule: &[(f64, f64)]) {
    let middle = arc.foot(view);
    let (direction, derivative) = arc.at(middle);
    let foot = Placed::new(direction, view);
    let alpha = microfacets.width();
    let reach = foot.across.length_squared() + alpha * alpha * foot.p.length_squared();
    let width = (reach / derivative.truncate().length_squared().max(1e-24)).sqrt().clamp(1e-9, 1e3);
    let ratio = foot.om / (4.0 * alpha * alpha);
    let share = ratio * ratio / (1.0 + ratio * ratio);
    let at_foot = microfacets.radial_primitive(foot.om);
    let constant = RadialPrimitive { whole: share * at_foot.whole, along: share * at_foot.along, across: share * at_foot.across };
    for (end, sign) in [(0.0, -1.0), (arc.length, 1.0)] {
        let to = ((end - middle) / width).asinh();
        for (place, weight) in rule {
            let nu = place * to;
            let (direction, derivative) = arc.at(middle + width * nu.sinh());
            let h = Placed::new(direction, view);
            let primitive = microfacets.radial_primitive(h.om);
            let turn = h.turn(derivative) * weight * to.abs() * width * nu.cosh();
            let across = h.across.normalize_or_zero() * (primitive.across - constant.across);
            sum.whole -= (primitive.whole - constant.whole) * turn;
            sum.mean -= across.extend(primitive.along - constant.along) * turn;
        }
        if to != 0.0 {
            let (a, b) = (foot.across.normalize_or_zero(), Placed::new(arc.at(end).0, view).across.normalize_or_zero());
            let turn = sign * a.perp_dot(b).atan2(a.dot(b));
            sum.whole -= constant.whole * turn;
            sum.mean -= DVec3::new(sign * constant.across * (b.y - a.y), sign * constant.across * (a.x - b.x), constant.along * turn);
        }
    }
}
