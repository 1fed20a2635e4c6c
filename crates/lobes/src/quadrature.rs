//! Integrals over parts of the sphere to rounding, as references for every approximation in this crate. Slow: thousands to millions of evaluations.

use gauss_quad::GaussLegendre;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::num::NonZeroUsize;
use std::sync::OnceLock;

const POINTS: usize = 20;

/// Nodes and weights of the Gauss-Legendre rule on [-1, 1].
pub(crate) fn rule() -> &'static [(f64, f64)] {
    static RULE: OnceLock<Vec<(f64, f64)>> = OnceLock::new();
    RULE.get_or_init(|| {
        let points = NonZeroUsize::new(POINTS).unwrap_or(NonZeroUsize::MIN);
        GaussLegendre::new(points).iter().copied().collect()
    })
}

/// Nodes and weights of the Gauss-Legendre rule of so many nodes, at least one, on [0, 1].
pub(crate) fn gauss_legendre(nodes: usize) -> Vec<(f64, f64)> {
    let rule = GaussLegendre::new(NonZeroUsize::new(nodes).unwrap_or(NonZeroUsize::MIN));
    rule.iter().map(|(node, weight)| (0.5 + 0.5 * node, 0.5 * weight)).collect()
}

/// Integral of `f` over [low, high] by `panels` equal panels of twenty Gauss-Legendre points each.
pub fn integrate(low: f64, high: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let width = (high - low) / panels as f64;
    let panel = |index: usize| {
        let middle = low + (index as f64 + 0.5) * width;
        rule().iter().map(|(node, weight)| weight * f(middle + 0.5 * width * node)).sum::<f64>()
    };
    0.5 * width * (0..panels).map(panel).sum::<f64>()
}

/// Integral of `f` over [low, high], panels halved until a panel and its halves agree to `tolerance` times the integral of |f|, or 40 times over.
pub fn integrate_adaptive(low: f64, high: f64, tolerance: f64, f: impl Fn(f64) -> f64) -> f64 {
    let panel = |low: f64, high: f64| {
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let terms = rule().iter().map(|(node, weight)| half * weight * f(middle + half * node));
        terms.fold((0.0, 0.0), |(sum, size), term| (sum + term, size + term.abs()))
    };
    let (whole, mut scale) = panel(low, high);
    let (mut total, mut open) = (0.0, vec![(low, high, whole, 0)]);
    while let Some((low, high, coarse, depth)) = open.pop() {
        let middle = 0.5 * (low + high);
        let ((left, left_size), (right, right_size)) = (panel(low, middle), panel(middle, high));
        scale = f64::max(scale, left_size + right_size);
        if depth >= 3 && (left + right - coarse).abs() <= tolerance * scale || depth >= 40 {
            total += left + right;
        } else {
            open.extend([(low, middle, left, depth + 1), (middle, high, right, depth + 1)]);
        }
    }
    total
}

/// The exponent `-sharpness (1 - w.axis) - eta_x (w.x)^2 - eta_y (w.y)^2 - ...` of a product of Gaussian lobes on the sphere.
#[derive(Clone, Debug, Default)]
pub struct Exponent {
    /// Axes and sharpnesses of SGs.
    pub gaussians: Vec<(DVec3, f64)>,
    /// Unit directions and bandwidths of squared cosines, two for each ASG.
    pub squares: Vec<(DVec3, f64)>,
}

impl Exponent {
    /// Value in a unit direction.
    pub fn evaluate(&self, w: DVec3) -> f64 {
        let gaussians: f64 = self.gaussians.iter().map(|(axis, sharpness)| 0.5 * sharpness * (w - axis).length_squared()).sum();
        let squares: f64 = self.squares.iter().map(|(axis, eta)| eta * axis.dot(w).powi(2)).sum();
        -gaussians - squares
    }

    /// Gradient in space; its part along the sphere is what counts.
    fn gradient(&self, w: DVec3) -> DVec3 {
        let gaussians: DVec3 = self.gaussians.iter().map(|(axis, sharpness)| *axis * *sharpness).sum();
        let squares: DVec3 = self.squares.iter().map(|(axis, eta)| *axis * (2.0 * eta * axis.dot(w))).sum();
        gaussians - squares
    }

    /// No second derivative along a great circle is larger.
    fn curvature(&self) -> f64 {
        self.gaussians.iter().map(|(_, sharpness)| sharpness).sum::<f64>() + 2.0 * self.squares.iter().map(|(_, eta)| eta).sum::<f64>()
    }
}

/// Where the first factor has the cosine of a hemisphere and the second one of another: the integral of
/// `max(w.first, 0) max(w.second, 0) exp(exponent(w))`, or of fewer cosines, over the sphere.
///
/// The answer is (scale, value) with the integral equal to `exp(scale) value`, so that it does not underflow. Panels are split until bounds on the
/// derivatives say that the exponent changes by 6 or less from the middle to a side, and left out where the exponent can only be far below its
/// largest value; the result is good to about 1e-12. Opposite `first` and `second` have an empty common hemisphere: 0.
pub fn integrate_lobes(exponent: &Exponent, first: Option<DVec3>, second: Option<DVec3>) -> (f64, f64) {
    let (Some(a), b) = (first.or(second), first.and(second)) else {
        // The sphere is two hemispheres.
        let halves = [DVec3::Z, DVec3::NEG_Z].map(|pole| Lune::new(pole, pole).map(|lune| lune.integrate(exponent, |_| 1.0)));
        return halves.into_iter().flatten().reduce(add).unwrap_or((0.0, 0.0));
    };
    match b {
        None => Lune::new(a, a).map_or((0.0, 0.0), |lune| lune.integrate(exponent, |w| a.dot(w).max(0.0))),
        Some(b) => Lune::new(a, b).map_or((0.0, 0.0), |lune| lune.integrate(exponent, |w| a.dot(w).max(0.0) * b.dot(w).max(0.0))),
    }
}

/// As [`integrate_lobes`] without the cosine: the exponential alone over the hemisphere about `normal`.
pub fn integrate_hemisphere(exponent: &Exponent, normal: DVec3) -> (f64, f64) {
    Lune::new(normal, normal).map_or((0.0, 0.0), |lune| lune.integrate(exponent, |_| 1.0))
}

fn add(left: (f64, f64), right: (f64, f64)) -> (f64, f64) {
    let scale = left.0.max(right.0);
    (scale, left.1 * (left.0 - scale).exp() + right.1 * (right.0 - scale).exp())
}

/// What two hemispheres share: the azimuths [low, high] about an edge axis, all polar angles.
struct Lune {
    edge: DVec3,
    x: DVec3,
    y: DVec3,
    low: f64,
    high: f64,
}

/// A rectangle of polar angle and azimuth.
#[derive(Clone, Copy)]
struct Panel {
    theta: (f64, f64),
    phi: (f64, f64),
}

impl Panel {
    fn middle(&self) -> (f64, f64) {
        (0.5 * (self.theta.0 + self.theta.1), 0.5 * (self.phi.0 + self.phi.1))
    }

    /// Half the sides as lengths on the sphere; no point is farther from the middle, side by side.
    fn half_sides(&self) -> (f64, f64) {
        let (theta, _) = self.middle();
        let half = 0.5 * (self.theta.1 - self.theta.0);
        let widest = if (theta - FRAC_PI_2).abs() <= half { 1.0 } else { (theta - half).sin().max((theta + half).sin()) };
        (half, widest * 0.5 * (self.phi.1 - self.phi.0))
    }

    fn halves(&self, across_phi: bool) -> [Self; 2] {
        let (theta, phi) = self.middle();
        if across_phi {
            [Self { phi: (self.phi.0, phi), ..*self }, Self { phi: (phi, self.phi.1), ..*self }]
        } else {
            [Self { theta: (self.theta.0, theta), ..*self }, Self { theta: (theta, self.theta.1), ..*self }]
        }
    }
}

impl Lune {
    fn new(a: DVec3, b: DVec3) -> Option<Self> {
        let cross = a.cross(b);
        let edge = if cross.length() > 1e-9 { cross.normalize() } else { a.any_orthonormal_vector() };
        let (x, y) = (a, edge.cross(a));
        // b stands at this azimuth; a at 0.
        let turn = b.dot(y).atan2(b.dot(x));
        let (low, high) = ((turn - FRAC_PI_2).max(-FRAC_PI_2), (turn + FRAC_PI_2).min(FRAC_PI_2));
        (high > low).then_some(Self { edge, x, y, low, high })
    }

    fn direction(&self, theta: f64, phi: f64) -> DVec3 {
        self.edge * theta.cos() + (self.x * phi.cos() + self.y * phi.sin()) * theta.sin()
    }

    fn integrate(&self, exponent: &Exponent, weight: impl Fn(DVec3) -> f64) -> (f64, f64) {
        const DEPTH: f64 = 45.0;
        let curvature = exponent.curvature();
        let mut best = f64::NEG_INFINITY;
        let mut open = vec![Panel { theta: (0.0, PI), phi: (self.low, self.high) }];
        let mut kept: Vec<(Panel, f64)> = Vec::new();
        // Breadth first, so that the largest value is known early and most panels are dropped while they are large.
        while !open.is_empty() {
            let mut next = Vec::new();
            for panel in &open {
                let (theta, phi) = panel.middle();
                best = best.max(exponent.evaluate(self.direction(theta, phi)));
            }
            for panel in open {
                let (theta, phi) = panel.middle();
                let w = self.direction(theta, phi);
                let (half_theta, half_phi) = panel.half_sides();
                let along_phi = self.y * phi.cos() - self.x * phi.sin();
                let along_theta = along_phi.cross(w);
                let gradient = exponent.gradient(w);
                // How much the exponent can change from the middle to a side; the square is a bound on the curved part.
                let change = |along: DVec3, half: f64| gradient.dot(along).abs() * half + curvature * half * half;
                let (change_theta, change_phi) = (change(along_theta, half_theta), change(along_phi, half_phi));
                let highest = exponent.evaluate(w) + change_theta + change_phi;
                if highest < best - DEPTH {
                    continue;
                }
                if change_theta.max(change_phi) > 6.0 || half_theta.max(half_phi) > 0.5 {
                    next.extend(panel.halves(change_phi + half_phi > change_theta + half_theta));
                } else {
                    kept.push((panel, highest));
                }
            }
            open = next;
        }
        let mut total = 0.0;
        for (panel, highest) in kept {
            if highest < best - DEPTH {
                continue;
            }
            let (theta, phi) = panel.middle();
            let (half_theta, half_phi) = (0.5 * (panel.theta.1 - panel.theta.0), 0.5 * (panel.phi.1 - panel.phi.0));
            let mut sum = 0.0;
            for (node, node_weight) in rule() {
                let theta = theta + half_theta * node;
                let ring: f64 = rule()
                    .iter()
                    .map(|(node, node_weight)| {
                        let w = self.direction(theta, phi + half_phi * node);
                        node_weight * weight(w) * (exponent.evaluate(w) - best).exp()
                    })
                    .sum();
                sum += node_weight * ring * theta.sin();
            }
            total += sum * half_theta * half_phi;
        }
        (best, total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::special::{decay_mean, decay_mean_lower, decay_mean_upper};

    fn value((scale, value): (f64, f64)) -> f64 {
        scale.exp() * value
    }

    #[test]
    fn integrals_with_closed_forms() {
        let normal = DVec3::new(0.3, -0.5, 0.8).normalize();
        for sharpness in [0.0, 1e-3, 1.0, 30.0, 1e4, 1e8] {
            let lobe = |axis| Exponent { gaussians: vec![(axis, sharpness)], squares: vec![] };
            let check =
                |got: f64, want: f64| assert!((got - want).abs() <= 1e-12 * want + 1e-300, "sharpness {sharpness}: {got:e} {want:e}");
            check(value(integrate_lobes(&lobe(normal), None, None)), 4.0 * PI * decay_mean(2.0 * sharpness));
            check(value(integrate_hemisphere(&lobe(normal), normal)), 2.0 * PI * decay_mean(sharpness));
            check(value(integrate_lobes(&lobe(normal), Some(normal), None)), 2.0 * PI * decay_mean_upper(sharpness));
            if sharpness < 200.0 {
                check(value(integrate_lobes(&lobe(normal), Some(-normal), None)), 2.0 * PI * decay_mean_lower(sharpness));
            }
        }
        // Two clamped cosines at an angle: (sin + (pi - angle) cos) times 2/3.
        for angle in [0.0, 0.3, 1.5, 3.0] {
            let other = normal * f64::cos(angle) + normal.any_orthonormal_vector() * f64::sin(angle);
            let got = value(integrate_lobes(&Exponent::default(), Some(normal), Some(other)));
            assert!((got - 2.0 / 3.0 * (angle.sin() + (PI - angle) * angle.cos())).abs() < 1e-13, "{angle}: {got}");
        }
        assert!((integrate(0.0, PI, 3, f64::sin) - 2.0).abs() < 1e-14);
    }
}
