//! Virtual spherical Gaussian lights (Tokuyoshi 2015, Virtual Spherical Gaussian Lights for Real-Time Glossy Indirect Illumination): a
//! disk-like source of radius r, seen as a cone, whose visibility is the SG `2 G` of sharpness `4 pi / solid angle`, and the integrals of
//! lobes over it.
//!
//! Nothing here divides by `r^2`: a light of radius 0 is a virtual point light, and every kernel tends to it. Distances and radii are in
//! metres, both >= 0; kernels are "per area of the source" (1/m^2), the integral of the lobes over directions divided by `pi r^2`.

use crate::{
    asg_product::asg_sg_integral,
    quadrature::integrate,
    sg::{SphericalGaussian, sg_log_evaluate},
    sg_cosine::clamped_cosine_integral,
    special::decay_mean,
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// A smaller radius, as a share of the slant distance, counts as this where a sharpness would be infinite.
const LEAST_RADIUS: f64 = 1e-15;

/// Up to this sharpness the product of light and lobe enters the accurate kernel; above, both kernels agree.
const LARGEST_SHARPNESS: f64 = 1e8;

/// Distance from the shading point to the rim of the disk: `sqrt(distance^2 + radius^2)`.
pub fn cone_slant(distance: f64, radius: f64) -> f64 {
    distance.hypot(radius)
}

/// `s = 2 h (h + distance)` with the slant h: `s / radius^2` is the sharpness of the cone.
pub fn cone_scaled_sharpness(distance: f64, radius: f64) -> f64 {
    let h = cone_slant(distance, radius);
    2.0 * h * (h + distance)
}

/// Solid angle of the cone, sr: `2 pi r^2 / (h (h + d))`, 0 to `2 pi`; 0 for r = 0. The printed `2 pi (1 - d/h)` has no digit left below
/// r/d = 1e-3 in 32 bits.
pub fn cone_solid_angle(distance: f64, radius: f64) -> f64 {
    if radius <= 0.0 {
        return 0.0;
    }
    let h = cone_slant(distance, radius);
    2.0 * PI * (radius / h) * (radius / (h + distance))
}

/// Sharpness of the SG that stands for the cone, `4 pi / solid angle = 2 h (h + d) / r^2`: 2 (a hemisphere) upwards. r below `1e-15 h`
/// counts as that, so the largest value is 4e30.
pub fn cone_sharpness(distance: f64, radius: f64) -> f64 {
    let h = cone_slant(distance, radius);
    if h <= 0.0 {
        return 2.0;
    }
    let radius = radius.max(LEAST_RADIUS * h);
    2.0 * (h / radius) * ((h + distance) / radius)
}

/// Solid angle of the cone over the area of the disk, 1/m^2: `2 / (h (h + d))`, the kernel of a diffuse light seen by a diffuse receiver
/// (without cosines); `1/d^2` for r = 0. 0 where distance and radius are both 0.
pub fn solid_angle_over_disk_area(distance: f64, radius: f64) -> f64 {
    let h = cone_slant(distance, radius);
    if h <= 0.0 { 0.0 } else { (1.0 / h) * (2.0 / (h + distance)) }
}

/// Integral of [`cone_visibility`] over the solid angle: `1 - exp(-8 pi / solid angle)`; below 1 by 0.03 % at a half angle of 60 degrees,
/// 1.8 % at 90.
pub fn cone_energy_ratio(distance: f64, radius: f64) -> f64 {
    -(-2.0 * cone_sharpness(distance, radius)).exp_m1()
}

/// The cone's visibility as an SG: amplitude 2, sharpness [`cone_sharpness`]. Nearly conserves energy (see [`cone_energy_ratio`]) and blurs
/// the edge; its peak is twice the cone's, see [`cone_peak_correction`].
pub fn cone_visibility(direction: DVec3, distance: f64, radius: f64) -> SphericalGaussian {
    SphericalGaussian { axis: direction, sharpness: cone_sharpness(distance, radius), amplitude: 2.0 }
}

/// Irradiance from the cone's SG per radiance, sr: `2 C` with the clamped cosine integral C at the cosine between normal and direction (and
/// its squared sine). Differs from the cone's by at most 0.12 % of the facing cone's at a half angle of 5 degrees, 0.5 % at 20, 1.5 % at
/// 45, 3.4 % at 70, 12 % at 88.
pub fn cone_irradiance(cosine: f64, sine_squared: f64, distance: f64, radius: f64) -> f64 {
    2.0 * clamped_cosine_integral(cone_sharpness(distance, radius), cosine, sine_squared)
}

/// Irradiance from the cone with its sharp edge, per radiance, sr; by quadrature to about 1e-10. `angle` is between normal and direction.
pub fn cone_irradiance_exact(angle: f64, distance: f64, radius: f64) -> f64 {
    let half_angle = radius.atan2(distance);
    let ring = |polar: f64| {
        let (a, b) = (angle.cos() * polar.cos(), angle.sin() * polar.sin());
        let azimuth = if a >= b {
            PI
        } else if a <= -b {
            0.0
        } else {
            (-a / b).acos()
        };
        2.0 * (a * azimuth + b * azimuth.sin()) * polar.sin()
    };
    // The horizon crosses the cone from this polar angle on.
    let crossing = (FRAC_PI_2 - angle).abs().min(half_angle);
    integrate(0.0, crossing, 8, ring) + integrate(crossing, half_angle, 64, ring)
}

/// Product of the light's lobe and cone scaled by `r^2`: `p = lobe_sharpness r^2 lobe_axis + s direction`.
struct ScaledProduct {
    /// Axis of the product, and |p|.
    axis: DVec3,
    length: f64,
    /// Logarithm of the product's amplitude.
    log_amplitude: f64,
    /// `lobe_sharpness r^2 + s`.
    sum: f64,
}

fn scaled_product(lobe_axis: DVec3, lobe_sharpness: f64, light_direction: DVec3, distance: f64, radius: f64) -> ScaledProduct {
    let s = cone_scaled_sharpness(distance, radius);
    let lobe = lobe_sharpness * radius * radius;
    let p = lobe_axis * lobe + light_direction * s;
    let (length, sum) = (p.length(), lobe + s);
    let log_amplitude = -lobe_sharpness * s * (lobe_axis - light_direction).length_squared() / (sum + length);
    ScaledProduct { axis: p.normalize_or(light_direction), length, log_amplitude, sum }
}

/// Integral over directions of a receiver's ASG, an SG lobe of the light and the light's cone, over the area of its disk (1/m^2), accurate:
/// the product with the ASG by [`asg_sg_integral`], whose errors it has. Amplitudes of the lobes are 1; all directions
/// in the ASG's frame, the light's lobe already turned towards the receiver (its axis is the direction to the light where the light shines
/// straight at it).
///
/// Sharpness and bandwidths in [0, 1e8]. For r = 0 the value of a virtual point light, for `lobe_sharpness = 0` a diffuse light; finite for
/// distance 0, and 0 where distance and radius are both 0. A form of this project.
pub fn vsgl_kernel(eta: [f64; 2], lobe_axis: DVec3, lobe_sharpness: f64, light_direction: DVec3, distance: f64, radius: f64) -> f64 {
    let product = scaled_product(lobe_axis, lobe_sharpness, light_direction, distance, radius);
    let square = radius * radius;
    if product.length >= LARGEST_SHARPNESS * square {
        return vsgl_kernel_fast(eta, lobe_axis, lobe_sharpness, light_direction, distance, radius);
    }
    let integral = asg_sg_integral(eta[0], eta[1], product.axis, product.length / square);
    2.0 / (PI * square) * product.log_amplitude.exp() * integral
}

/// The same integral, fast: the product with the ASG as Xu et al. print it, scaled by `r^2` throughout so that no radius is too small (the
/// arrangement is this project's; it equals the chain of Tokuyoshi 2015, section 3.1). Errors of
/// [`crate::asg_product::asg_sg_integral_printed`].
pub fn vsgl_kernel_fast(eta: [f64; 2], lobe_axis: DVec3, lobe_sharpness: f64, light_direction: DVec3, distance: f64, radius: f64) -> f64 {
    log_vsgl_kernel_fast(eta, lobe_axis, lobe_sharpness, light_direction, distance, radius).exp()
}

/// Natural logarithm of [`vsgl_kernel_fast`]; -infinity where it is 0.
pub fn log_vsgl_kernel_fast(
    eta: [f64; 2],
    lobe_axis: DVec3,
    lobe_sharpness: f64,
    light_direction: DVec3,
    distance: f64,
    radius: f64,
) -> f64 {
    let product = scaled_product(lobe_axis, lobe_sharpness, light_direction, distance, radius);
    if product.sum <= 0.0 {
        return f64::NEG_INFINITY;
    }
    // Opposite equal lobes cancel; what the amplitude leaves of them does not matter.
    let n = product.length.max(1e-6 * product.sum);
    let (x, y) = (2.0 * eta[0] * radius * radius + n, 2.0 * eta[1] * radius * radius + n);
    let axis = product.axis;
    let exponent = product.log_amplitude - eta[0] * (n / x) * axis.x * axis.x - eta[1] * (n / y) * axis.y * axis.y;
    (4.0 * axis.z.max(0.0)).ln() - 0.5 * (x.ln() + y.ln()) + exponent
}

/// Integral over directions of the light's SG lobe and its cone, over the area of its disk (1/m^2): the kernel of a diffuse receiver, whose
/// cosine is pulled out. Exact for the SGs. `(4/n)(1 - exp(-2n/r^2)) exp(log amplitude)`; 0 where distance and radius are both 0.
pub fn vsgl_kernel_diffuse_receiver(lobe_axis: DVec3, lobe_sharpness: f64, light_direction: DVec3, distance: f64, radius: f64) -> f64 {
    let product = scaled_product(lobe_axis, lobe_sharpness, light_direction, distance, radius);
    if product.sum <= 0.0 {
        return 0.0;
    }
    let (n, square) = (product.length, radius * radius);
    let width = if 2.0 * n < square { 8.0 / square * decay_mean(2.0 * n / square) } else { 4.0 / n * -(-2.0 * n / square).exp_m1() };
    width * product.log_amplitude.exp()
}

/// Factor that takes the doubled peak of [`cone_visibility`] back where a receiver's lobe is narrower than the cone and looks into it:
/// `(1 + x)(1 - exp(-2x)) / (2x)` with x the lobe's sharpness over the cone's, from 1 where x is 0 down to 1/2.
///
/// It caps brightness at the price of energy; an option that is off by default.
pub fn cone_peak_correction(sharpness_ratio: f64) -> f64 {
    (1.0 + sharpness_ratio) * decay_mean(2.0 * sharpness_ratio)
}

/// Upper bound of the sharpness of the product of an ASG and an SG: `2 max(eta_x, eta_y) + lobe_sharpness`. Never below the truth (`2
/// eta_larger` of [`crate::asg_product::asg_sg_peak`]); 1.006 of it in the median, up to 5.3.
pub fn combined_sharpness_bound(eta_x: f64, eta_y: f64, lobe_sharpness: f64) -> f64 {
    2.0 * eta_x.max(eta_y) + lobe_sharpness
}

/// Whether the cone is so small against the product of the lobes that the light may be taken for a point with their values in its direction
/// times [`solid_angle_over_disk_area`]: `product_sharpness < threshold cone_sharpness`, without a division. A radius of 0 always passes.
pub fn bias_reduction_applies(product_sharpness: f64, threshold: f64, distance: f64, radius: f64) -> bool {
    product_sharpness * radius * radius < threshold * cone_scaled_sharpness(distance, radius)
}

/// The product of ASG and lobe as a point: value of the ASG times the lobe in the light's direction times [`solid_angle_over_disk_area`],
/// 1/m^2. With radius 0 this is the virtual point light.
pub fn vsgl_kernel_point(eta: [f64; 2], lobe_axis: DVec3, lobe_sharpness: f64, light_direction: DVec3, distance: f64, radius: f64) -> f64 {
    let w = light_direction;
    let log = sg_log_evaluate(lobe_axis, lobe_sharpness, w) - eta[0] * w.x * w.x - eta[1] * w.y * w.y;
    w.z.max(0.0) * log.exp() * solid_angle_over_disk_area(distance, radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{asg_product::asg_sg_peak, quadrature::Exponent, quadrature::integrate_lobes, sg_cosine::clamped_cosine_integral_exact};

    #[test]
    fn irradiance_is_as_far_off_as_stated() {
        // Stated as 0.1, 0.5, 1.3, 3 and 12 %: what rounds to that.
        for (half_angle, bound) in [(5.0f64, 0.0015), (20.0, 0.0055), (45.0, 0.0135), (70.0, 0.035), (88.0, 0.125)] {
            let radius = half_angle.to_radians().tan();
            let facing = cone_irradiance_exact(0.0, 1.0, radius);
            assert!((facing / (PI * half_angle.to_radians().sin().powi(2)) - 1.0).abs() < 1e-10);
            let (mut worst, mut of_the_lobe) = (0.0f64, 0.0f64);
            for step in 0..=180 {
                let angle = f64::from(step).to_radians();
                let (s, c) = angle.sin_cos();
                let exact = cone_irradiance_exact(angle, 1.0, radius);
                let lobe = 2.0 * clamped_cosine_integral_exact(cone_sharpness(1.0, radius), angle);
                worst = worst.max((cone_irradiance(c, s * s, 1.0, radius) - exact).abs() / facing);
                of_the_lobe = of_the_lobe.max((lobe - exact).abs() / facing);
            }
            println!("{half_angle}: {worst} {of_the_lobe}");
            assert!(of_the_lobe < bound && of_the_lobe > 0.5 * bound, "{half_angle}: {of_the_lobe}");
            // The formula for the clamped cosine adds its own 0.0013 of the lobe's integral.
            assert!(worst < of_the_lobe + 0.0014, "{half_angle}: {worst}");
        }
    }

    #[test]
    fn the_accurate_kernel_is_near_the_integral() {
        let lobe_axis = DVec3::new(0.3, 0.2, 0.9).normalize();
        let direction = DVec3::new(-0.1, 0.35, 0.9).normalize();
        for (eta, sharpness, radius) in
            [([50.0, 10.0], 5.0, 0.3), ([5.0, 5.0], 0.0, 1.0), ([200.0, 20.0], 30.0, 0.05), ([3.0, 1.0], 2.0, 3.0)]
        {
            let integral = |lobe_axis: DVec3, direction: DVec3| {
                let gaussians = vec![(lobe_axis, sharpness), (direction, cone_sharpness(1.0, radius))];
                let squares = vec![(DVec3::X, eta[0]), (DVec3::Y, eta[1])];
                let (scale, value) = integrate_lobes(&Exponent { gaussians, squares }, Some(DVec3::Z), None);
                2.0 * scale.exp() * value / (PI * radius * radius)
            };
            let (exact, peak) = (integral(lobe_axis, direction), integral(DVec3::Z, DVec3::Z));
            let error = |kernel: f64| (kernel - exact).abs() / peak;
            let kernel = error(vsgl_kernel(eta, lobe_axis, sharpness, direction, 1.0, radius));
            let fast = error(vsgl_kernel_fast(eta, lobe_axis, sharpness, direction, 1.0, radius));
            println!("{eta:?} {sharpness} {radius}: {kernel} {fast}");
            assert!(kernel < 0.073, "{eta:?} {sharpness} {radius}: {kernel}");
            assert!(fast < 0.07, "{eta:?} {sharpness} {radius}: {fast}");
        }
    }

    #[test]
    fn both_kernels_meet_where_one_takes_over() {
        let lobe_axis = DVec3::new(0.3, 0.2, 0.9).normalize();
        let direction = DVec3::new(0.02, 0.01, 1.0).normalize();
        let radius = |share: f64| 2e-4 * share;
        for eta in [[5000.0, 100.0], [1.0, 0.1]] {
            let kernel = |share: f64| vsgl_kernel(eta, lobe_axis, 3.0, direction, 1.0, radius(share));
            let fast = |share: f64| vsgl_kernel_fast(eta, lobe_axis, 3.0, direction, 1.0, radius(share));
            assert_eq!(kernel(0.999), fast(0.999));
            assert!((kernel(1.001) / fast(1.001) - 1.0).abs() < 1e-4, "{} {}", kernel(1.001), fast(1.001));
        }
    }

    #[test]
    fn radius_zero_is_a_point_light() {
        let lobe_axis = DVec3::new(0.3, 0.2, 0.9).normalize();
        let direction = DVec3::new(0.1, 0.3, 0.8).normalize();
        for eta in [[0.0, 0.0], [30.0, 3.0], [1e4, 0.0]] {
            let value = vsgl_kernel(eta, lobe_axis, 20.0, direction, 2.0, 0.0);
            assert!((value / vsgl_kernel_point(eta, lobe_axis, 20.0, direction, 2.0, 0.0) - 1.0).abs() < 1e-13);
        }
        let diffuse = vsgl_kernel_diffuse_receiver(lobe_axis, 20.0, direction, 2.0, 0.0);
        assert!((diffuse / (0.25 * (-10.0 * (lobe_axis - direction).length_squared()).exp()) - 1.0).abs() < 1e-13);
        for kernel in [vsgl_kernel, vsgl_kernel_fast, vsgl_kernel_point] {
            assert_eq!(kernel([1.0, 1.0], lobe_axis, 20.0, direction, 0.0, 0.0), 0.0);
            assert!(kernel([1.0, 1.0], lobe_axis, 20.0, direction, 0.0, 0.5).is_finite());
        }
        assert_eq!(vsgl_kernel_diffuse_receiver(lobe_axis, 20.0, direction, 0.0, 0.0), 0.0);
    }

    #[test]
    fn diffuse_kernels_are_limits_of_each_other() {
        let direction = DVec3::new(0.1, 0.3, 0.8).normalize();
        // A constant lobe: the cone's energy over the disk.
        for radius in [1e-3, 0.1, 1.0, 30.0] {
            let want = solid_angle_over_disk_area(1.0, radius) * cone_energy_ratio(1.0, radius);
            assert!((vsgl_kernel_diffuse_receiver(DVec3::X, 0.0, direction, 1.0, radius) / want - 1.0).abs() < 1e-13);
        }
        // Both branches meet where 2n = r^2.
        let with = |sharpness: f64| vsgl_kernel_diffuse_receiver(-direction, sharpness, direction, 0.0, 1.0);
        assert!((with(1.5 - 1e-12) / with(1.5 + 1e-12) - 1.0).abs() < 1e-10);
        assert!(with(2.0).is_finite() && with(2.0) > 0.0);
    }

    #[test]
    fn the_peak_of_two_is_corrected_on_the_axis() {
        for (ratio, factor) in [(0.0, 1.0), (0.3, 1.0 / 1.02), (1.0, 1.0 / 1.16), (1e9, 0.5)] {
            assert!((cone_peak_correction(ratio) / factor - 1.0).abs() < 0.005, "{ratio}");
        }
        // An isotropic lobe on the axis of the cone: its true share inside the cone against the product of both SGs. The closed form takes
        // the cone for small.
        let (radius, sharpness) = (0.1, 400.0);
        let cone = cone_sharpness(1.0, radius);
        let inside = -(-sharpness * (1.0 - 1.0 / 1.01f64.sqrt())).exp_m1() / sharpness;
        let product = 2.0 / (sharpness + cone);
        assert!((product * cone_peak_correction(sharpness / cone) / inside - 1.0).abs() < 0.005);
    }

    #[test]
    fn the_bound_of_the_product_sharpness_holds() {
        for index in 0..3000u32 {
            let [u, v] = crate::sampling::r2_point(index, 3);
            let [a, b] = crate::sampling::r2_point(index, 4);
            let sharp = |share: f64| 10f64.powf(14.0 * share - 6.0);
            let (s, z) = ((1.0 - u * u).sqrt(), u);
            let axis = DVec3::new(s * (2.0 * PI * v).cos(), s * (2.0 * PI * v).sin(), z);
            let (x, y, sharpness) = (sharp(a), sharp(b), sharp(crate::sampling::r2_point(index, 5)[0]));
            let peak = asg_sg_peak(x, y, axis, sharpness);
            assert!(
                2.0 * peak.eta_larger <= combined_sharpness_bound(x, y, sharpness) * (1.0 + 1e-9),
                "{x} {y} {sharpness} {axis}: {peak:?}"
            );
        }
    }

    #[test]
    fn a_small_cone_may_be_a_point() {
        let sharpness = cone_sharpness(1.0, 0.1);
        assert!(bias_reduction_applies(0.099 * sharpness, 0.1, 1.0, 0.1) && !bias_reduction_applies(0.101 * sharpness, 0.1, 1.0, 0.1));
        assert!(bias_reduction_applies(1e8, 1e-3, 1.0, 0.0));
    }
}
