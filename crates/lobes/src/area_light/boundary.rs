//! Outlines of lights as seen from the origin, and how planes through the origin cut them.

use glam::DVec3;
use std::f64::consts::TAU;

/// An ellipse in space, `center + axis_a cos f + axis_b sin f`: a disk under a linear map, or the rim at which a sphere or an ellipsoid is seen.
///
/// The half axes need be neither perpendicular nor of equal length: any pair of conjugate half diameters describes the same ellipse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Centre, relative to the shading point.
    pub center: DVec3,
    /// Where the rim is at f = 0, relative to the centre.
    pub axis_a: DVec3,
    /// Where the rim is at f = pi/2, relative to the centre.
    pub axis_b: DVec3,
}

impl Ellipse {
    /// Point of the rim.
    pub fn point(&self, f: f64) -> DVec3 {
        self.center + self.axis_a * f.cos() + self.axis_b * f.sin()
    }

    /// Derivative of [`Ellipse::point`].
    pub fn tangent(&self, f: f64) -> DVec3 {
        self.axis_b * f.cos() - self.axis_a * f.sin()
    }

    /// The same ellipse with the rim running counter-clockwise as seen from the origin.
    pub fn facing(&self) -> Self {
        // Seen from the origin, counter-clockwise is left-handed about the direction of sight.
        if self.center.dot(self.axis_a.cross(self.axis_b)) > 0.0 { Self { axis_b: -self.axis_b, ..*self } } else { *self }
    }
}

/// A part of an outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A straight line between two points.
    Segment {
        /// Where it begins.
        from: DVec3,
        /// Where it ends.
        to: DVec3,
        /// Whether the last cut made it: it lies in the cutting plane.
        cut: bool,
    },
    /// The rim of an ellipse between two angles.
    Arc {
        /// Whose rim.
        ellipse: Ellipse,
        /// First angle.
        from: f64,
        /// Last angle, above the first.
        to: f64,
    },
}

impl Piece {
    fn ends(&self) -> (DVec3, DVec3) {
        match self {
            Self::Segment { from, to, .. } => (*from, *to),
            Self::Arc { ellipse, from, to } => (ellipse.point(*from), ellipse.point(*to)),
        }
    }

    /// What lies on the positive side of the plane through the origin with this normal, in order.
    fn clip(&self, normal: DVec3) -> Vec<Self> {
        match *self {
            Self::Segment { from, to, .. } => {
                let (a, b) = (from.dot(normal), to.dot(normal));
                let cross = || from + (to - from) * (a / (a - b));
                match (a > 0.0, b > 0.0) {
                    (true, true) => vec![Self::Segment { from, to, cut: false }],
                    (true, false) => vec![Self::Segment { from, to: cross(), cut: false }],
                    (false, true) => vec![Self::Segment { from: cross(), to, cut: false }],
                    (false, false) => vec![],
                }
            }
            Self::Arc { ellipse, from, to } => {
                let (a, b, c) = (ellipse.axis_a.dot(normal), ellipse.axis_b.dot(normal), ellipse.center.dot(normal));
                let reach = a.hypot(b);
                if c >= reach {
                    return vec![*self];
                }
                if c <= -reach {
                    return vec![];
                }
                // Height above the plane is c + reach cos(f - middle).
                let (middle, half) = (b.atan2(a), (-c / reach).acos());
                let mut parts = Vec::new();
                let first = ((from - middle - half) / TAU).floor();
                for turn in 0..3 {
                    let center = middle + TAU * (first + f64::from(turn));
                    let (low, high) = ((center - half).max(from), (center + half).min(to));
                    if high > low {
                        parts.push(Self::Arc { ellipse, from: low, to: high });
                    }
                }
                parts
            }
        }
    }
}

/// A closed outline. Empty if nothing is seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Boundary {
    /// Parts in order; each begins where the one before ends.
    pub pieces: Vec<Piece>,
    /// A direction less than 90 degrees from every point of the region: from the origin to the nearest point of the light's plane.
    pub facing: DVec3,
}

impl Boundary {
    /// A planar polygon, convex or not, without holes, whose edges do not cross each other. Empty where the origin lies in its plane (the light is seen
    /// edge-on, or the point lies on it) and for fewer than three vertices.
    pub fn polygon(vertices: &[DVec3]) -> Self {
        let Some(first) = vertices.first() else { return Self::default() };
        let next = |index: usize| vertices[(index + 1) % vertices.len()];
        let area: DVec3 = (0..vertices.len()).map(|index| (vertices[index] - first).cross(next(index) - first)).sum();
        let size = vertices.iter().map(|vertex| (vertex - first).length()).fold(0.0, f64::max);
        let normal = area.normalize_or_zero();
        let height = first.dot(normal);
        if height.abs() <= 1e-14 * (size + first.length()) {
            return Self::default();
        }
        let pieces = (0..vertices.len()).map(|index| Piece::Segment { from: vertices[index], to: next(index), cut: false }).collect();
        Self { pieces, facing: normal * height.signum() }
    }

    /// A whole ellipse, turned towards the origin. Empty where the origin lies in its plane.
    pub fn ellipse(ellipse: &Ellipse) -> Self {
        let ellipse = ellipse.facing();
        let normal = ellipse.axis_a.cross(ellipse.axis_b).normalize_or_zero();
        let height = ellipse.center.dot(normal);
        if height.abs() <= 1e-14 * (ellipse.axis_a.length() + ellipse.axis_b.length() + ellipse.center.length()) {
            return Self::default();
        }
        Self { pieces: vec![Piece::Arc { ellipse, from: 0.0, to: TAU }], facing: normal * height.signum() }
    }

    /// The part above the plane through the origin with this normal: the cut pieces, and the straight lines between where the outline leaves and comes
    /// back. For an outline that is not convex the lines may cover each other; what is covered twice in opposite directions cancels in every integral.
    pub fn clip(&self, normal: DVec3) -> Self {
        let kept: Vec<Piece> = self.pieces.iter().flat_map(|piece| piece.clip(normal)).collect();
        let mut pieces = Vec::new();
        for (index, piece) in kept.iter().enumerate() {
            pieces.push(*piece);
            let (from, to) = (piece.ends().1, kept[(index + 1) % kept.len()].ends().0);
            // Pieces that follow each other share their ends to the last digit, arcs up to rounding.
            let open = (from - to).length() > 1e-13 * (from.length() + to.length());
            if open && from.dot(normal).abs() <= 1e-9 * from.length() && to.dot(normal).abs() <= 1e-9 * to.length() {
                pieces.push(Piece::Segment { from, to, cut: true });
            }
        }
        Self { pieces, facing: self.facing }
    }

    /// The same outline, for an axis other than that of the last cut.
    pub fn uncut(&self) -> Self {
        let plain = |piece: &Piece| match *piece {
            Piece::Segment { from, to, .. } => Piece::Segment { from, to, cut: false },
            arc => arc,
        };
        Self { pieces: self.pieces.iter().map(plain).collect(), facing: self.facing }
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }
}
