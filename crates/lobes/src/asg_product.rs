//! Products of an ASG with an SG and with another ASG: where they peak, how wide they are, and their integrals.

use crate::{
    asg::{AnisotropicSphericalGaussian, asg_integral, half_sides},
    quadrature::{Exponent, integrate_lobes},
    special::erf,
};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// The product of an ASG and an SG of amplitude 1 as a lobe about its true peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AsgPeak {
    /// Unit direction of the peak, in the ASG's frame, at or above its horizon.
    pub local: DVec3,
    /// Logarithm of the value there, without the ASG's cosine.
    pub log_amplitude: f64,
    /// Larger bandwidth of the tangent Gaussian; `2 eta_larger` is the sharpness of the product where it is sharpest.
    pub eta_larger: f64,
    /// Smaller bandwidth.
    pub eta_smaller: f64,
    /// Variance, under the tangent Gaussian, of the cosine to the ASG's axis.
    pub cosine_variance: f64,
}

/// Where `-eta_x x^2 - eta_y y^2 - sharpness |w - axis|^2 / 2` is largest on the ASG's hemisphere, and how it curves there. A form of this project.
///
/// The peak solves `(diag(2 eta_x, 2 eta_y, 0) + mu) w = sharpness axis` with the mu that makes w a unit vector; three Newton steps on mu find it. An axis
/// below the ASG's horizon counts as one in it there, so that mu is not negative; the value at the peak is that for the axis as given.
/// Bandwidths and sharpness in [0, 1e8]; the axis is in the ASG's frame. Where everything is 0, the peak is the ASG's axis.
pub fn asg_sg_peak(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> AsgPeak {
    let v = DVec3::new(axis_local.x, axis_local.y, axis_local.z.max(1e-6)) * sharpness;
    let lowest = v.z.max(1e-12);
    let mut mu = lowest;
    let diagonal = |mu: f64| DVec3::new(mu + 2.0 * eta_x, mu + 2.0 * eta_y, mu);
    for _ in 0..3 {
        let m = diagonal(mu);
        let w = v / m;
        let n = w.length();
        let slope = (w * w / m).element_sum();
        if slope > 0.0 {
            mu = (mu + (n - 1.0) * n * n / slope).max(lowest);
        }
    }
    let m = diagonal(mu);
    let local = (v / m).normalize_or(DVec3::Z);
    let log_amplitude = -0.5 * sharpness * (local - axis_local).length_squared() - eta_x * local.x * local.x - eta_y * local.y * local.y;
    let square = local * local;
    let spread = square.x / m.x + square.y / m.y;
    let cosine_variance = spread / (square.z + mu * spread).max(1e-300);
    // Eigenvalues of diag(m) on the plane perpendicular to the peak, in units of the largest entry.
    let scale = m.max_element();
    let m = m / scale;
    let determinant = m.y * m.z * square.x + m.x * m.z * square.y + m.x * m.y * square.z;
    let trace = (m * (DVec3::ONE - square)).element_sum();
    let larger = 0.5 * (0.5 * trace + (0.25 * trace * trace - determinant).max(0.0).sqrt());
    let [eta_larger, eta_smaller] = [scale * larger, scale * determinant / (4.0 * larger)];
    AsgPeak { local, log_amplitude, eta_larger, eta_smaller, cosine_variance }
}

/// Integral of an ASG of amplitude 1 times an SG of amplitude 1, accurate. A form of this project.
///
/// Error over the product's largest value, that of an SG along the ASG's axis: 5 % at the most for bandwidths and sharpness in [0, 1e8] and all axes, those below
/// the ASG's horizon too; 2 % from a sharpness of 10 on. Relative to the value itself there is no bound: what little an axis far below the horizon leaves may be off by any factor.
///
/// Up to a sharpness of 4 it is [`asg_sg_integral_over_disk`], from 8 on [`asg_sg_integral_about_peak`], and a blend in between.
pub fn asg_sg_integral(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> f64 {
    asg_sg_integral_of_peak(eta_x, eta_y, axis_local, sharpness, &asg_sg_peak(eta_x, eta_y, axis_local, sharpness))
}

/// [`asg_sg_integral`] for callers that have the [`asg_sg_peak`] of the same lobes.
pub fn asg_sg_integral_of_peak(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64, peak: &AsgPeak) -> f64 {
    let t = (0.25 * (sharpness - BROADEST)).clamp(0.0, 1.0);
    let share = t * t * (3.0 - 2.0 * t);
    let narrow = if share > 0.0 { share * asg_sg_integral_about_peak(axis_local, sharpness, peak) } else { 0.0 };
    let broad = if share < 1.0 { (1.0 - share) * asg_sg_integral_over_disk(eta_x, eta_y, axis_local, sharpness) } else { 0.0 };
    narrow + broad
}

/// Up to this sharpness an SG is taken over the whole disk; from twice as much on about the peak of the product.
const BROADEST: f64 = 4.0;

/// The integral for an SG of sharpness 8 and above: the tangent Gaussian at the peak by [`asg_integral`], times the mean of the ASG's clamped cosine under it,
/// and what the sphere's curvature takes from it to first order.
fn asg_sg_integral_about_peak(axis_local: DVec3, sharpness: f64, peak: &AsgPeak) -> f64 {
    // The mean of a cosine that is 0 below the horizon as a hyperbola, right far above the horizon and on it, where an axis below makes the lobe fall off.
    let slope = (-sharpness * axis_local.z).max(0.0) * peak.cosine_variance.sqrt();
    let fall = 1.0 + 1.2533 * slope + slope * slope;
    let cosine = 0.5 * (peak.local.z + (peak.local.z * peak.local.z + 2.0 / PI * peak.cosine_variance / (fall * fall)).sqrt());
    // sqrt(1 - r^2) is 1 - r^2/2 - r^4/8: the mean of r^4, with variances as the disk cuts them off.
    let variance = |eta: f64| 0.5 / eta * (1.0 - (-eta).exp()).powi(2).max(0.5);
    let [a, b] = [variance(peak.eta_larger), variance(peak.eta_smaller)];
    let pull = (sharpness * axis_local.dot(peak.local)).max(0.0);
    let curvature = 1.0 + pull / 8.0 * (3.0 * a * a + 3.0 * b * b + 2.0 * a * b);
    cosine / curvature * peak.log_amplitude.exp() * asg_integral(peak.eta_larger, peak.eta_smaller)
}

/// The integral for an SG of a sharpness up to 8. Projected along the ASG's axis, which takes the clamped cosine away, it is that of
/// `exp(-eta_x x^2 - eta_y y^2 + sharpness (axis.x x + axis.y y + axis.z sqrt(1 - r^2) - 1))` over the unit disk: the root becomes its tangent in r^2 at the
/// mean of r^2, and the disk the rectangle of [`asg_integral`].
///
/// Its four constants were fitted for the least largest error.
fn asg_sg_integral_over_disk(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> f64 {
    let height = sharpness * axis_local.z;
    let slopes = [sharpness * axis_local.x.abs(), sharpness * axis_local.y.abs()];
    // About the variance of a coordinate within the disk.
    let variance = |c: f64| 1.0 / (2.0 * c + 3.5808);
    let mean_square = |c: f64, slope: f64| {
        let v = variance(c);
        let square = (0.76722 * slope * v).powi(2);
        let square = square / (1.0 + square * square).sqrt();
        v * (1.0 - square) + square
    };
    let smaller = eta_x.min(eta_y);
    let bandwidths = |bend: f64| [eta_x + height * bend, eta_y + height * bend].map(|c| c.max(0.0));
    let (mut bend, mut at) = (0.7, 0.0);
    for _ in 0..2 {
        let [x, y] = bandwidths(bend);
        at = (mean_square(x, slopes[0]) + mean_square(y, slopes[1])).min(0.71197);
        bend = 0.5 / f64::sqrt(1.0 - at);
    }
    if smaller + height * bend < 0.0 {
        // A Gaussian that grows outwards is taken for a constant.
        bend = -smaller / height;
    }
    // The mean of a root is below the root of the mean.
    let root = (1.0 - at).sqrt() + bend * at - at * (0.025404 + 0.13777 * at);
    let [x, y] = bandwidths(bend);
    // Where the lobe is round, so is the disk: most of the slope goes to one side of the rectangle, and none to its corners.
    let difference = 1.4251 * (x - y);
    let round = 1.0 / (1.0 + difference * difference);
    let [v_x, v_y] = [variance(x), variance(y)];
    let [p_x, p_y] = [slopes[0] * slopes[0] * v_x, slopes[1] * slopes[1] * v_y];
    let kept = 1.0 - round;
    let [q_x, q_y] = if p_x >= p_y { [p_x + round * p_y, kept * p_y] } else { [kept * p_x, p_y + round * p_x] };
    let [half_larger, half_smaller] = half_sides(x.max(y), x.min(y));
    let [h_x, h_y] = if x >= y { [half_larger, half_smaller] } else { [half_smaller, half_larger] };
    (height * root - sharpness).exp() * bounded_gaussian(x, (q_x / v_x).sqrt(), h_x) * bounded_gaussian(y, (q_y / v_y).sqrt(), h_y)
}

/// Integral of `exp(slope x - eta x^2)` over [-half, half], for eta >= 0 and slopes of 0 to 9: by four Gauss-Legendre nodes on either side where the Gaussian is
/// broad, by error functions where it is not. Within 0.1 %.
fn bounded_gaussian(eta: f64, slope: f64, half: f64) -> f64 {
    const NODES: [(f64, f64); 4] = [
        (0.069_431_844_203, 0.173_927_422_569),
        (0.330_009_478_208, 0.326_072_577_431),
        (0.669_990_521_792, 0.326_072_577_431),
        (0.930_568_155_797, 0.173_927_422_569),
    ];
    if eta * half * half < 3.0 {
        let node = |(place, weight): (f64, f64)| {
            let x = half * place;
            weight * ((slope * x - eta * x * x).exp() + (-slope * x - eta * x * x).exp())
        };
        return half * NODES.into_iter().map(node).sum::<f64>();
    }
    let root = eta.sqrt();
    let shift = 0.5 * slope / root;
    0.5 * PI.sqrt() / root * (shift * shift).exp() * (erf(root * half - shift) + erf(root * half + shift))
}

/// The same integral as Xu et al. 2013 print it: planar, and with the ASG's cosine at the SG's axis.
///
/// Within 5.4 % of the largest value over axes for a sharpness of at least 10 and bandwidths of at least 1; 13 % for all bandwidths, with an axis in the horizon, and
/// 4 % from a sharpness of 100. Wrong for broad SGs without a bound, since it tends to `axis.z pi / sqrt(eta_x eta_y)` there and not to the ASG's integral. Undefined
/// where a bandwidth and the sharpness are both 0.
pub fn asg_sg_integral_printed(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> f64 {
    let nu = 0.5 * sharpness;
    let (x, y) = (eta_x + nu, eta_y + nu);
    // nu (eta / (eta + nu)): the product eta nu may overflow 32 bits.
    let exponent = -nu * (eta_x / x) * axis_local.x * axis_local.x - nu * (eta_y / y) * axis_local.y * axis_local.y;
    PI / (x.sqrt() * y.sqrt()) * axis_local.z.max(0.0) * exponent.exp()
}

/// The same integral by quadrature, to about 1e-12. Slow.
pub fn asg_sg_integral_exact(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> f64 {
    let exponent = Exponent { gaussians: vec![(axis_local.normalize(), sharpness)], squares: vec![(DVec3::X, eta_x), (DVec3::Y, eta_y)] };
    let (scale, value) = integrate_lobes(&exponent, Some(DVec3::Z), None);
    scale.exp() * value
}

/// Eigenvalues of a symmetric matrix, largest first, and their unit eigenvectors as columns in the same order.
///
/// Jacobi rotations: the trigonometric solution of the cubic loses half the digits where eigenvalues are close, and shading languages promise little of
/// its functions. Five sweeps reach rounding for any 3 x 3 matrix.
pub fn symmetric_eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..5 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a[p][q];
            if off == 0.0 {
                continue;
            }
            let theta = 0.5 * (a[q][q] - a[p][p]) / off;
            let t = if theta >= 0.0 { 1.0 } else { -1.0 } / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            let r = 3 - p - q;
            a[p][p] -= t * off;
            a[q][q] += t * off;
            a[p][q] = 0.0;
            a[q][p] = 0.0;
            let (rp, rq) = (a[r][p], a[r][q]);
            a[r][p] = c * rp - s * rq;
            a[r][q] = s * rp + c * rq;
            a[p][r] = a[r][p];
            a[q][r] = a[r][q];
            let (vp, vq) = (DVec3::from(v[p]), DVec3::from(v[q]));
            v[p] = (vp * c - vq * s).to_array();
            v[q] = (vp * s + vq * c).to_array();
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|left, right| a[*right][*right].total_cmp(&a[*left][*left]));
    let [x, y, z] = order;
    (DVec3::new(a[x][x], a[y][y], a[z][z]), DMat3::from_cols_array_2d(&[v[x], v[y], v[z]]))
}

/// The matrix M of an ASG, whose exponent is `-w^T M w`.
pub fn asg_matrix(lobe: &AnisotropicSphericalGaussian) -> DMat3 {
    let square = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
    square(lobe.tangent) * lobe.eta_x + square(lobe.bitangent) * lobe.eta_y
}

/// Product of two ASGs as one ASG (Xu et al. 2013, section 4): frame and bandwidths from the eigenvectors of the sum of both matrices, the cosines of
/// both factors taken at the new axis. The amplitude is given apart as a logarithm; it is -infinity where the axis is below a factor's horizon.
///
/// The axis is the eigenvector of the smallest eigenvalue with the sign that faces the sum of both axes (the other sign gives 0). As an integral it is
/// off by 0.4 to 0.5 for bandwidths around 1, 10 % around 10, 1 % above 100.
pub fn asg_product(a: &AnisotropicSphericalGaussian, b: &AnisotropicSphericalGaussian) -> (AnisotropicSphericalGaussian, f64) {
    let (values, vectors) = symmetric_eigen(asg_matrix(a) + asg_matrix(b));
    let axis = if vectors.z_axis.dot(a.axis + b.axis) < 0.0 { -vectors.z_axis } else { vectors.z_axis };
    let exponent = |lobe: &AnisotropicSphericalGaussian| {
        let local = lobe.to_local(axis);
        lobe.eta_x * local.x * local.x + lobe.eta_y * local.y * local.y
    };
    let cosines = a.axis.dot(axis).max(0.0) * b.axis.dot(axis).max(0.0);
    // The exponent at the axis is the smallest eigenvalue, but has digits that the eigenvalue has lost to the largest one.
    let log_amplitude = (a.amplitude * b.amplitude * cosines).ln() - exponent(a) - exponent(b);
    let lobe = AnisotropicSphericalGaussian {
        tangent: vectors.x_axis,
        bitangent: vectors.y_axis,
        axis,
        eta_x: values.x - values.z,
        eta_y: values.y - values.z,
        amplitude: 1.0,
    };
    (lobe, log_amplitude)
}

/// Integral of the product of two ASGs by [`asg_product`] and [`asg_integral`].
pub fn asg_asg_integral(a: &AnisotropicSphericalGaussian, b: &AnisotropicSphericalGaussian) -> f64 {
    let (lobe, log_amplitude) = asg_product(a, b);
    log_amplitude.exp() * lobe.integral()
}

/// The same integral by quadrature, to about 1e-12. Slow.
pub fn asg_asg_integral_exact(a: &AnisotropicSphericalGaussian, b: &AnisotropicSphericalGaussian) -> f64 {
    let squares = vec![(a.tangent, a.eta_x), (a.bitangent, a.eta_y), (b.tangent, b.eta_x), (b.bitangent, b.eta_y)];
    let (scale, value) = integrate_lobes(&Exponent { gaussians: vec![], squares }, Some(a.axis), Some(b.axis));
    a.amplitude * b.amplitude * scale.exp() * value
}
