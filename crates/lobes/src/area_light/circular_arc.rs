//! Arcs of circles on the sphere of directions: straight edges as they are seen, and what rims of round lights are taken for.
//!
//! The rim of a sphere is seen as a circle. That of a disk or an ellipsoid is not, but an arc of it lies much nearer to the circle through its ends and its middle than to a chord.
//! Irradiance along a circle has a closed form, and half vectors along one are quadratic up to their length (see [`super::ggx_half_vector`]), so nothing costs more than along
//! a straight edge. Both uses are designs of this project. The twin on the device is `lobelia::circular_arc`.

use super::boundary::Ellipse;
use glam::DVec3;

/// Unit directions `((middle + opposite t^2) + 2 tangent t) / (1 + t^2)`, with t the tangent of half the angle from the middle, an angle within `half_angle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircularArc {
    /// Middle of the arc.
    pub middle: DVec3,
    /// Opposite point of the whole circle.
    pub opposite: DVec3,
    /// Direction of travel at the middle, as long as the circle's radius.
    pub tangent: DVec3,
    /// Angle on the circle from the middle to the end, below pi.
    pub half_angle: f64,
}

impl CircularArc {
    /// The straight line between two points; none where they are seen in one direction or one is the origin.
    pub fn great(from: DVec3, to: DVec3) -> Option<Self> {
        // From the points themselves: directions of a short far edge are equal but for rounding.
        let cross = from.cross(to - from);
        let (normal, start) = (cross.try_normalize()?, from.try_normalize()?);
        let half_angle = 0.5 * cross.length().atan2(from.dot(to));
        let (sine, cosine) = half_angle.sin_cos();
        let tangent = normal.cross(start);
        let middle = start * cosine + tangent * sine;
        Some(Self { middle, opposite: -middle, tangent: tangent * cosine - start * sine, half_angle })
    }

    /// The circle through three points, of which the second lies between the others on at most a third of the circle; the straight line where they lie on one.
    pub fn through(from: DVec3, between: DVec3, to: DVec3) -> Option<Self> {
        let great = Self::great(from, to)?;
        let between = between.try_normalize()?;
        // Height above the plane of the straight line, along that line, and the middle of the line.
        let across = great.middle.cross(great.tangent);
        let (height, place) = (between.dot(across), between.dot(great.tangent));
        let (sine, cosine) = great.half_angle.sin_cos();
        // What is between cosines of small angles is known from their sines.
        let depth = (sine * sine - place * place - height * height) / (between.dot(great.middle) + cosine);
        let slope = -height / depth.max(1e-6 * sine * sine).max(1e-300);
        // Half the angle by which the arc's middle is above the straight line.
        let half_rise = -slope * (sine * sine / (1.0 + cosine)) / (1.0 + (1.0 + slope * slope * sine * sine).sqrt());
        let square = half_rise * half_rise;
        let (rise_sine, rise_cosine) = (2.0 * half_rise / (1.0 + square), (1.0 - square) / (1.0 + square));
        let middle = great.middle * rise_cosine + across * rise_sine;
        // Axis of the circle, and towards the middle across it.
        let size = (1.0 + slope * slope).sqrt();
        let axis = (great.middle * slope + across) / size;
        let radius = (rise_cosine - slope * rise_sine) / size;
        let opposite = axis * (2.0 * axis.dot(middle)) - middle;
        let half_angle = (sine / radius).clamp(0.0, 1.0).asin();
        Some(Self { middle, opposite, tangent: great.tangent * radius, half_angle })
    }

    /// What the arc adds to the integral of `w dw` over the directions that it goes around clockwise: half the integral of `w x dw` along it.
    pub fn vector_irradiance(&self) -> DVec3 {
        let (center, out) = ((self.middle + self.opposite) * 0.5, (self.middle - self.opposite) * 0.5);
        let tangent = self.tangent;
        // (center + out cos + tangent sin) x its derivative, integrated; out and tangent are as long as the radius.
        out.cross(tangent) * self.half_angle + center.cross(tangent) * self.half_angle.sin()
    }
}

/// The part of a rim between two angles as that many circular arcs of equal angle, at least three for a whole turn.
pub fn arcs_of(rim: &Ellipse, from: f64, to: f64, count: u32) -> Vec<CircularArc> {
    let at = |place: f64| rim.point(from + (to - from) * place / f64::from(count));
    (0..count).map(f64::from).filter_map(|index| CircularArc::through(at(index), at(index + 0.5), at(index + 1.0))).collect()
}
