//! Products of an ASG with an SG and with another ASG: where they peak, how wide they are, and their integrals.

use crate::{
    asg::{AnisotropicSphericalGaussian, asg_integral},
    quadrature::{Exponent, integrate_lobes},
};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// The product of an ASG and an SG of amplitude 1 as a lobe about its true peak.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AsgPeak {
    /// Unit direction of the peak, in the ASG's frame.
    pub local: DVec3,
    /// Logarithm of the value there, without the ASG's cosine.
    pub log_amplitude: f64,
    /// Larger bandwidth of the tangent Gaussian; `2 eta_larger` is the sharpness of the product where it is sharpest.
    pub eta_larger: f64,
    /// Smaller bandwidth.
    pub eta_smaller: f64,
}

/// Where `-eta_x x^2 - eta_y y^2 - sharpness |w - axis|^2 / 2` is largest on the sphere, and how it curves there. A form of this project.
///
/// The peak solves `(diag(2 eta_x, 2 eta_y, 0) + mu) w = sharpness axis` with the mu that makes w a unit vector; two Newton steps on mu find it.
/// Bandwidths and sharpness in [0, 1e8]; the axis is in the ASG's frame. Where everything is 0, the peak is the ASG's axis.
pub fn asg_sg_peak(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> AsgPeak {
    let v = axis_local * sharpness;
    let lowest = v.z.abs();
    let mut mu = lowest.max(1e-6 * sharpness).max(1e-12);
    let diagonal = |mu: f64| DVec3::new(mu + 2.0 * eta_x, mu + 2.0 * eta_y, mu);
    for _ in 0..2 {
        let m = diagonal(mu);
        let w = v / m;
        let n = w.length();
        let slope = (w * w / m).element_sum();
        if slope > 0.0 {
            mu = (mu + (n - 1.0) * n * n / slope).max(lowest);
        }
    }
    let m = diagonal(mu.max(1e-12));
    let local = (v / m).normalize_or(DVec3::Z);
    let log_amplitude = -0.5 * sharpness * (local - axis_local).length_squared() - eta_x * local.x * local.x - eta_y * local.y * local.y;
    // Eigenvalues of diag(m) on the plane perpendicular to the peak, in units of the largest entry.
    let scale = m.max_element();
    let m = m / scale;
    let square = local * local;
    let determinant = m.y * m.z * square.x + m.x * m.z * square.y + m.x * m.y * square.z;
    let trace = (m * (DVec3::ONE - square)).element_sum();
    let larger = 0.5 * (0.5 * trace + (0.25 * trace * trace - determinant).max(0.0).sqrt());
    AsgPeak { local, log_amplitude, eta_larger: scale * larger, eta_smaller: scale * determinant / (4.0 * larger) }
}

/// Integral of an ASG of amplitude 1 times an SG of amplitude 1, accurate: the tangent Gaussian at the true peak, integrated by
/// [`asg_integral`]. A form of this project.
///
/// Error over the product's largest value: up to 7.3 % at bandwidths of 1 and a sharpness of 10, 5 % elsewhere for all of them at 0.3 and above, 2.7 %
/// for bandwidths above 5; 12 % too high where all are 0.01, and 0 for an SG axis below the ASG's horizon.
pub fn asg_sg_integral(eta_x: f64, eta_y: f64, axis_local: DVec3, sharpness: f64) -> f64 {
    let peak = asg_sg_peak(eta_x, eta_y, axis_local, sharpness);
    peak.local.z.max(0.0) * peak.log_amplitude.exp() * asg_integral(peak.eta_larger, peak.eta_smaller)
}

/// The same integral as Xu et al. 2013 print it: planar, and with the ASG's cosine at the SG's axis.
///
/// Within 5 % for a sharpness of at least 10 and narrow ASGs; wrong for broad SGs (0.4 to 0.9 of the largest value at sharpness 1 and below), since it tends to
/// `axis.z pi / sqrt(eta_x eta_y)` there and not to the ASG's integral. Undefined where a bandwidth and the sharpness are both 0.
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
