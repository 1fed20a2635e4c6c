//! How alike two lobes are, as the weight of a filter (Tokuyoshi 2015, Specular Lobe-Aware Filtering and Upsampling for Interactive
//! Indirect Illumination): both lobes are smoothed by a kernel, normalised in L2 and multiplied; the similarity is the integral, 1 for
//! equal lobes, and the weight a power of it.
//!
//! The kernel's sharpness bounds how narrow a mirror's lobe can get, the exponent beta sets the strictness. Sharpnesses in [0, 1e8]; a
//! kernel of [`INFINITE_KERNEL`] or above (or `f64::INFINITY`) does not smooth.

use crate::{
    asg::AnisotropicSphericalGaussian,
    sg::{SphericalGaussian, sg_integral, sg_product, sg_product_integral},
    special::decay_mean,
};
use glam::DVec3;
use std::f64::consts::PI;

/// A kernel of this sharpness leaves lobes as they are.
pub const INFINITE_KERNEL: f64 = 1e30;

/// Sharpness of the SG that stands for the similarity of diffuse lobes, as printed: it belongs to `exp(-sharpness angle^2 / 2)`, and is
/// near the best value for an SG raised to a power of 5 and above.
pub const DIFFUSE_SIMILARITY_SHARPNESS: f64 = 0.9426;

/// The least-squares value (over the angle) for an SG raised to a power of 20 without smoothing. With a kernel the printed one is nearer:
/// at 100 the weight is off by 0.005 with it and by 0.010 with this.
pub const DIFFUSE_SIMILARITY_SHARPNESS_BEST: f64 = 0.955;

/// Sharpness of an SG smoothed by a normalised SG kernel: `1 / (1/sharpness + 1/kernel_sharpness)`, at most the smaller of both, 0 where
/// one is 0. Good for kernels of 20 and above; the L1 distance to the exact smoothing is 0.10 where both are 1, 0.029 where both are 10,
/// 0.003 where both are 100.
pub fn smoothed_sharpness(sharpness: f64, kernel_sharpness: f64) -> f64 {
    let (smaller, larger) = (sharpness.min(kernel_sharpness), sharpness.max(kernel_sharpness));
    if smaller <= 0.0 { 0.0 } else { smaller / (1.0 + smaller / larger) }
}

/// An SG of amplitude 1 smoothed by a normalised SG kernel, as an SG of equal integral with the [`smoothed_sharpness`].
pub fn smoothed_sg(axis: DVec3, sharpness: f64, kernel_sharpness: f64) -> SphericalGaussian {
    let smoothed = smoothed_sharpness(sharpness, kernel_sharpness);
    SphericalGaussian { axis, sharpness: smoothed, amplitude: sg_integral(sharpness) / sg_integral(smoothed) }
}

/// Value in a direction of an SG of amplitude 1 smoothed by a normalised SG kernel, exact: the integral of two SGs over that of the kernel.
pub fn smoothed_sg_value_exact(axis: DVec3, sharpness: f64, kernel_sharpness: f64, direction: DVec3) -> f64 {
    sg_product_integral(axis, sharpness, direction, kernel_sharpness) / sg_integral(kernel_sharpness)
}

/// Similarity of two Gaussians in `dimension` dimensions with the given variances and squared distance of their means:
/// `(2 t_i t_j / (t_i^2 + t_j^2))^(dimension/2) exp(-distance^2 / (2 (t_i^2 + t_j^2)))` for variances `t^2 > 0`. Exact.
pub fn gaussian_similarity(variance_i: f64, variance_j: f64, distance_squared: f64, dimension: f64) -> f64 {
    let ratio = variance_i.min(variance_j) / variance_i.max(variance_j);
    let width = 2.0 * ratio.sqrt() / (1.0 + ratio);
    width.powf(0.5 * dimension) * (-0.5 * distance_squared / (variance_i + variance_j)).exp()
}

/// The two exponents of [`lobe_similarity`]: logarithm of the factor of widths, and of the factor of axes.
fn log_similarity(axis_i: DVec3, smoothed_i: f64, axis_j: DVec3, smoothed_j: f64) -> (f64, f64) {
    let (smallest, largest) = (smoothed_i.min(smoothed_j), smoothed_i.max(smoothed_j));
    if largest <= 0.0 {
        return (0.0, 0.0);
    }
    let ratio = smallest / largest;
    let widths = 0.5 * (4.0 * ratio / (1.0 + ratio).powi(2)).ln();
    (widths, -0.5 * smallest / (1.0 + ratio) * (axis_i - axis_j).length_squared())
}

/// Similarity of two SGs of (smoothed) sharpness `a` and `b`: `2 sqrt(a b) / (a + b) exp(-a b / (a + b) |axis_i - axis_j|^2 / 2)`, the form
/// of the paper's equation 12. 1 where both are 0.
///
/// Exact for large sharpnesses. Broad lobes it takes for planar Gaussians: a flat lobe and one of sharpness 1 are alike to 0.87, and it
/// says 0.06 ([`lobe_similarity_exact`] does not).
pub fn lobe_similarity(axis_i: DVec3, smoothed_i: f64, axis_j: DVec3, smoothed_j: f64) -> f64 {
    let (widths, axes) = log_similarity(axis_i, smoothed_i, axis_j, smoothed_j);
    (widths + axes).exp()
}

/// Similarity of two SGs, exact: the integral of their product over the square root of the integrals of their squares.
pub fn lobe_similarity_exact(axis_i: DVec3, smoothed_i: f64, axis_j: DVec3, smoothed_j: f64) -> f64 {
    let product = sg_product(axis_i, smoothed_i, axis_j, smoothed_j);
    let widths = decay_mean(4.0 * smoothed_i).sqrt() * decay_mean(4.0 * smoothed_j).sqrt();
    product.log_amplitude.exp() * decay_mean(2.0 * product.sharpness) / widths
}

/// `lobe_similarity^beta` for beta > 0, at most 1, with one logarithm and one exponential: `exp(beta/2 log(4 r / (1 + r)^2) - beta min/(1 +
/// r) |axis_i - axis_j|^2 / 2)` with r the smaller over the larger sharpness. 1 where both are 0, 0 where one is.
pub fn lobe_similarity_weight(axis_i: DVec3, smoothed_i: f64, axis_j: DVec3, smoothed_j: f64, beta: f64) -> f64 {
    let (widths, axes) = log_similarity(axis_i, smoothed_i, axis_j, smoothed_j);
    (beta * widths + beta * axes).exp().min(1.0)
}

/// `lobe_similarity_exact^beta` for beta > 0, at most 1.
pub fn lobe_similarity_weight_exact(axis_i: DVec3, smoothed_i: f64, axis_j: DVec3, smoothed_j: f64, beta: f64) -> f64 {
    lobe_similarity_exact(axis_i, smoothed_i, axis_j, smoothed_j).powf(beta).min(1.0)
}

/// The weight as papers print it for shaders, with `u = a b` and `v = a + b`: `exp(beta/2 log(4u/v^2) - beta u/v |axis_i - axis_j|^2 / 2)`.
/// In 32 bits it is not a number outside [1e-18, 1e18]. Kept for the test that shows it.
pub fn lobe_similarity_weight_printed(axis_i: DVec3, smoothed_i: f64, axis_j: DVec3, smoothed_j: f64, beta: f64) -> f64 {
    let (u, v) = (smoothed_i * smoothed_j, smoothed_i + smoothed_j);
    (0.5 * beta * (4.0 * u / (v * v)).ln() - 0.5 * beta * u / v * (axis_i - axis_j).length_squared()).exp()
}

/// Similarity of two diffuse lobes without smoothing, exact: `(sin + (pi - angle) cos) / pi` of the angle between the normals, 1 to 0.
pub fn diffuse_similarity(normal_i: DVec3, normal_j: DVec3) -> f64 {
    let (sine, cosine) = (normal_i.cross(normal_j).length(), normal_i.dot(normal_j));
    diffuse_similarity_of_angle(sine.atan2(cosine))
}

/// [`diffuse_similarity`] of an angle in [0, pi].
pub fn diffuse_similarity_of_angle(angle: f64) -> f64 {
    let rest = PI - angle;
    if rest < 0.1 {
        // sin(rest) - rest cos(rest), which cancels.
        let square = rest * rest;
        return rest * square * (1.0 / 3.0 - square * (1.0 / 30.0 - square * (1.0 / 840.0 - square / 45360.0))) / PI;
    }
    (angle.sin() + rest * angle.cos()) / PI
}

/// The SG form of [`diffuse_similarity`]: `exp(-sharpness |normal_i - normal_j|^2 / 2)` with [`DIFFUSE_SIMILARITY_SHARPNESS`] or another
/// sharpness. Off by up to 0.16; good near equal normals, which is what counts once it is raised to a power.
pub fn diffuse_similarity_fast(normal_i: DVec3, normal_j: DVec3, sharpness: f64) -> f64 {
    (-0.5 * sharpness * (normal_i - normal_j).length_squared()).exp()
}

/// Variance of the Gaussian of normals that the SG form makes of the weight of smoothed diffuse lobes:
/// `(2 sharpness + kernel_sharpness) / (beta sharpness kernel_sharpness)`; 0.0540447698 for 0.9426, 100 and beta 20. Kernels above 0.
pub fn diffuse_weight_variance(sharpness: f64, kernel_sharpness: f64, beta: f64) -> f64 {
    (2.0 * sharpness / kernel_sharpness + 1.0) / (beta * sharpness)
}

/// Weight of two diffuse lobes: `exp(-|normal_i - normal_j|^2 / (2 variance))` with [`diffuse_weight_variance`], the same as
/// [`lobe_similarity_weight`] of two SGs of sharpness `2 sharpness` smoothed. For beta 20 off by up to 0.005 with a kernel of 100, 0.023
/// with 20, 0.061 with 5.
pub fn diffuse_weight(normal_i: DVec3, normal_j: DVec3, variance: f64) -> f64 {
    (-0.5 * (normal_i - normal_j).length_squared() / variance).exp()
}

/// Similarity of two ASGs smoothed by a kernel, the cosines of the ASGs left out: planar Gaussians of covariance `S = diag(1/(2 eta)) +
/// 1/kernel_sharpness` in the plane perpendicular to the mean axis, into which each lobe's frame is turned along the shortest way: `2
/// (|S_i| |S_j|)^(1/4) / |S_i + S_j|^(1/2) exp(-d^T (S_i + S_j)^-1 d / 2)` with d the difference of the axes.
///
/// A form of this project. Equal to [`lobe_similarity`] where both lobes are isotropic with `eta = sharpness / 2`. Bandwidths below 1e-6
/// count as that. Opposite axes have no shortest way: any is taken.
pub fn asg_similarity(i: &AnisotropicSphericalGaussian, j: &AnisotropicSphericalGaussian, kernel_sharpness: f64) -> f64 {
    asg_similarity_weight(i, j, kernel_sharpness, 1.0)
}

/// `asg_similarity^beta` for beta > 0, at most 1.
pub fn asg_similarity_weight(i: &AnisotropicSphericalGaussian, j: &AnisotropicSphericalGaussian, kernel_sharpness: f64, beta: f64) -> f64 {
    let mean = (i.axis + j.axis).normalize_or(i.tangent);
    let turned = |lobe: &AnisotropicSphericalGaussian| {
        let sum = lobe.axis + mean;
        lobe.tangent - sum * (lobe.tangent.dot(mean) / (1.0 + lobe.axis.dot(mean)))
    };
    let variance = |eta: f64| 0.5 / eta.max(1e-6) + 1.0 / kernel_sharpness;
    let (x_i, y_i) = (turned(i), mean.cross(turned(i)));
    let (x_j, y_j) = (turned(j), mean.cross(turned(j)));
    let (a_i, b_i) = (variance(i.eta_x), variance(i.eta_y));
    let (a_j, b_j) = (variance(j.eta_x), variance(j.eta_y));
    // Squares of the cosine and sine of the turn from one frame to the other.
    let (along, across) = (x_j.dot(x_i).powi(2), x_j.dot(y_i).powi(2));
    // Determinant and adjugate of the sum as sums of positive terms.
    let determinant = a_i * b_i + a_j * b_j + a_i * (a_j * across + b_j * along) + b_i * (a_j * along + b_j * across);
    let d = i.axis - j.axis;
    let square = |direction: DVec3| direction.dot(d).powi(2);
    let distance = (b_i * square(x_i) + a_i * square(y_i) + b_j * square(x_j) + a_j * square(y_j)) / determinant;
    let widths = 4.0 * ((a_i * b_i).sqrt() * (a_j * b_j).sqrt()) / determinant;
    (0.5 * beta * widths.ln() - 0.5 * beta * distance).exp().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate;

    fn at(angle: f64) -> DVec3 {
        DVec3::new(angle.sin(), 0.0, angle.cos())
    }

    const DEGREES: usize = 120;

    fn legendre(x: f64) -> Vec<f64> {
        let mut values = vec![1.0, x];
        for l in 1..DEGREES {
            let k = l as f64;
            values.push(((2.0 * k + 1.0) * x * values[l] - k * values[l - 1]) / (k + 1.0));
        }
        values
    }

    /// Similarity of two diffuse lobes smoothed by an SG kernel as a series of Legendre polynomials, exact: the squares of the lobe's
    /// coefficients times the kernel's.
    fn smoothed_diffuse_series(kernel: f64) -> Vec<f64> {
        // Ratios of modified Bessel functions, downwards.
        let start = DEGREES + (10.0 * kernel.sqrt()) as usize;
        let mut ratios = vec![0.0; start + 1];
        for l in (1..start).rev() {
            ratios[l] = 1.0 / ((2 * l + 1) as f64 / kernel + ratios[l + 1]);
        }
        let mut smoothing = 1.0;
        let series: Vec<f64> = (0..DEGREES)
            .map(|l| {
                smoothing *= if l > 0 { ratios[l] } else { 1.0 };
                let cosine = integrate(0.0, 1.0, 8, |x| x * legendre(x)[l]);
                (2 * l + 1) as f64 * (cosine * smoothing).powi(2)
            })
            .collect();
        let norm: f64 = series.iter().sum();
        series.iter().map(|term| term / norm).collect()
    }

    fn sum_series(series: &[f64], angle: f64) -> f64 {
        series.iter().zip(legendre(angle.cos())).map(|(term, value)| term * value).sum()
    }

    #[test]
    fn the_diffuse_form_is_as_far_off_as_stated() {
        assert!((sum_series(&smoothed_diffuse_series(1e6), 1.0) - diffuse_similarity(DVec3::Z, at(1.0))).abs() < 1e-4);
        for (kernel, stated) in [(100.0, 0.005), (20.0, 0.023), (5.0, 0.061), (2.0, 0.17)] {
            let series = smoothed_diffuse_series(kernel);
            let worst = |sharpness: f64| {
                let variance = diffuse_weight_variance(sharpness, kernel, 20.0);
                (0..=60)
                    .map(|step| {
                        let angle = f64::from(step) * PI / 60.0;
                        let exact = sum_series(&series, angle).max(0.0).powf(20.0);
                        (diffuse_weight(DVec3::Z, at(angle), variance) - exact).abs()
                    })
                    .fold(0.0, f64::max)
            };
            let (printed, best) = (worst(DIFFUSE_SIMILARITY_SHARPNESS), worst(DIFFUSE_SIMILARITY_SHARPNESS_BEST));
            println!("kernel {kernel}: {printed} with .9426, {best} with .955");
            assert!((printed / stated - 1.0).abs() < 0.12, "{kernel}: {printed}");
            // The constant that is best without a kernel is not so with one.
            assert!(best > printed && best < printed + 0.006, "{kernel}: {best}");
        }
    }

    #[test]
    fn the_constants_of_the_diffuse_form_are_the_best_where_stated() {
        // Least squares over the angle, or over solid angle.
        let distance = |sharpness: f64, beta: f64, solid: bool| {
            integrate(0.0, PI, 40, |angle| {
                let form = diffuse_similarity_fast(DVec3::Z, at(angle), sharpness).powf(beta);
                (form - diffuse_similarity_of_angle(angle).powf(beta)).powi(2) * if solid { angle.sin() } else { 1.0 }
            })
        };
        for (beta, best, solid) in [
            (1.0, 1.2029, true),
            (2.0, 1.048, false),
            (5.0, 0.962, false),
            (10.0, 0.952, false),
            (20.0, DIFFUSE_SIMILARITY_SHARPNESS_BEST, false),
        ] {
            let at_best = distance(best, beta, solid);
            assert!(at_best < distance(best - 0.002, beta, solid) && at_best < distance(best + 0.002, beta, solid), "{beta}");
        }
        // The printed constant is that of the Gaussian of the angle.
        let geodesic = |sharpness: f64| {
            integrate(0.0, PI, 40, |angle: f64| {
                ((-0.5 * sharpness * angle * angle).exp() - diffuse_similarity_of_angle(angle)).powi(2) * angle.sin()
            })
        };
        let printed = DIFFUSE_SIMILARITY_SHARPNESS;
        assert!(geodesic(printed) < geodesic(printed - 1e-3) && geodesic(printed) < geodesic(printed + 1e-3));
    }

    #[test]
    fn the_diffuse_similarity_has_its_digits_at_opposite_normals() {
        for rest in [1e-6f64, 1e-3, 0.05, 0.0999, 0.1001, 0.5] {
            let leading = rest.powi(3) * (1.0 / 3.0 - rest * rest / 30.0 + rest.powi(4) / 840.0) / PI;
            assert!((diffuse_similarity_of_angle(PI - rest) / leading - 1.0).abs() < 1e-6 + rest.powi(6) / 1e4, "{rest}");
        }
        assert_eq!(diffuse_similarity(DVec3::Z, DVec3::Z), 1.0);
    }

    #[test]
    fn smoothing_is_as_far_off_as_stated() {
        for (sharpness, kernel, stated) in
            [(1.0, 1.0, 0.10), (2.0, 5.0, 0.034), (10.0, 10.0, 0.029), (10.0, 100.0, 0.005), (100.0, 100.0, 0.003)]
        {
            let smoothed = smoothed_sg(DVec3::Z, sharpness, kernel);
            let ring = |angle: f64| {
                let difference = smoothed.evaluate(at(angle)) - smoothed_sg_value_exact(DVec3::Z, sharpness, kernel, at(angle));
                2.0 * PI * angle.sin() * difference.abs()
            };
            let distance = integrate(0.0, PI, 400, ring) / sg_integral(sharpness);
            println!("{sharpness} {kernel}: {distance}");
            assert!((distance / stated - 1.0).abs() < 0.17, "{sharpness} {kernel}: {distance}");
        }
    }

    fn asg(axis: DVec3, turn: f64, eta_x: f64, eta_y: f64) -> AnisotropicSphericalGaussian {
        let (x, y) = axis.any_orthonormal_pair();
        let tangent = x * turn.cos() + y * turn.sin();
        AnisotropicSphericalGaussian { tangent, bitangent: axis.cross(tangent), axis, eta_x, eta_y, amplitude: 1.0 }
    }

    #[test]
    fn isotropic_lobes_of_both_kinds_are_alike() {
        for (angle, i, j, kernel) in [(0.0, 3.0, 3.0, 1e30), (0.4, 30.0, 8.0, 100.0), (2.5, 2.0, 0.5, 20.0), (3.1, 0.3, 0.2, 5.0)] {
            let (axis_i, axis_j) = (at(0.3), at(0.3 + angle));
            let found = asg_similarity(&asg(axis_i, 0.3, 0.5 * i, 0.5 * i), &asg(axis_j, 1.1, 0.5 * j, 0.5 * j), kernel);
            let want = lobe_similarity(axis_i, smoothed_sharpness(i, kernel), axis_j, smoothed_sharpness(j, kernel));
            assert!((found - want).abs() < 1e-12, "{angle}: {found} {want}");
        }
    }

    /// For narrow lobes the cosines are constant and the sphere is a plane: the integral of the product over the roots of those of the
    /// squares.
    #[test]
    fn narrow_anisotropic_lobes_are_as_alike_as_their_integrals_say() {
        use crate::asg_product::asg_asg_integral_exact;
        for (angle, turn, eta) in [
            (0.0, 0.0, [900.0, 100.0, 300.0, 300.0]),
            (0.05, 0.7, [4000.0, 400.0, 2000.0, 900.0]),
            (0.02, 1.5, [4000.0, 90.0, 4000.0, 90.0]),
        ] {
            let (i, j) = (asg(at(0.0), 0.2, eta[0], eta[1]), asg(at(angle), 0.2 + turn, eta[2], eta[3]));
            let exact = asg_asg_integral_exact(&i, &j) / (asg_asg_integral_exact(&i, &i) * asg_asg_integral_exact(&j, &j)).sqrt();
            let found = asg_similarity(&i, &j, INFINITE_KERNEL);
            println!("{angle} {turn}: {found} {exact}");
            assert!((found - exact).abs() < 5e-3 && exact > 0.05, "{angle} {turn}: {found} {exact}");
            assert!((asg_similarity_weight(&i, &j, INFINITE_KERNEL, 20.0) - found.powi(20)).abs() < 1e-12);
            assert!((asg_similarity(&j, &i, INFINITE_KERNEL) - found).abs() < 1e-12);
        }
    }
}
