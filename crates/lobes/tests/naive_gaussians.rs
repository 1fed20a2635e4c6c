//! Why the forms of this crate are not simplified: what papers print, in the arithmetic of a shader, beside what stands here instead.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use lobelia_lobes::{asg::*, asg_product::*, quadrature::integrate_hemisphere, sampling::r2_point, sg::*, sg_cosine::*, special::*};
use std::f64::consts::PI;

/// Sharpnesses log-uniform in [1e-6, 1e8].
fn sharpness(share: f64) -> f64 {
    10f64.powf(14.0 * share - 6.0)
}

fn directions(index: u32, seed: u32) -> (Vec3, Vec3) {
    let direction = |[u, v]: [f64; 2]| {
        let z = 2.0 * u - 1.0;
        let s = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(s * (2.0 * PI * v).cos(), s * (2.0 * PI * v).sin(), z)
    };
    (direction(r2_point(index, seed)).as_vec3(), direction(r2_point(index, seed + 1)).as_vec3())
}

fn relative(got: f32, want: f64) -> f64 {
    (f64::from(got) / want - 1.0).abs()
}

/// `decay_mean` in 32 bits, as the shader has it.
fn decay_mean_32(x: f32) -> f32 {
    if x >= 1.0 {
        return (1.0 - (-x).exp()) / x;
    }
    (0..10).rev().fold(0.0, |sum, k| (1.0 + sum * -x) / (k as f32 + 1.0))
}

#[test]
fn a_dot_product_loses_sharp_lobes() {
    let (mut dot_form, mut stable) = ([0.0f64; 2], [0.0f64; 2]);
    for index in 0..20_000 {
        let (axis, towards) = directions(index, 1);
        for (place, sharpness) in [1e4f32, 1e8].into_iter().enumerate() {
            let across = (towards - axis * axis.dot(towards)).normalize();
            let direction = (axis + across * (3.0 / sharpness.sqrt()) * (index as f32 / 20_000.0)).normalize();
            let want = sg_evaluate(axis.as_dvec3(), f64::from(sharpness), direction.as_dvec3());
            let squared = (direction - axis).length_squared();
            dot_form[place] = dot_form[place].max(relative((sharpness * (axis.dot(direction) - 1.0)).exp(), want));
            stable[place] = stable[place].max(relative((-0.5 * sharpness * squared).exp(), want));
        }
    }
    assert!(dot_form[0] > 5e-4 && dot_form[1] > 1e3, "{dot_form:?}");
    assert!(stable.iter().all(|error| *error < 4e-6), "{stable:?}");
}

#[test]
fn direct_quotients_of_integrals_cancel() {
    let (mut direct, mut upper, mut stable) = (0.0f64, 0.0f64, 0.0f64);
    for index in 0..20_000 {
        let x = sharpness(f64::from(index) / 20_000.0) as f32;
        let exact = f64::from(x);
        direct = direct.max(relative(2.0 * std::f32::consts::PI * (1.0 - (-2.0 * x).exp()) / x, sg_integral(exact)));
        let e = (1.0 - (-x).exp()) / x;
        upper = upper.max(relative((1.0 - e) / x, decay_mean_upper(exact)));
        stable = stable.max(relative(4.0 * std::f32::consts::PI * decay_mean_32(2.0 * x), sg_integral(exact)));
    }
    assert!(direct > 0.01 && upper > 1e3, "{direct:e} {upper:e}");
    assert!(stable < 3e-7, "{stable:e}");
}

/// `(u - 1) x / log u` with `u = exp x` is exact on a machine whose logarithm is; a shading language may be off by 2^-21 there.
#[test]
fn the_classic_expm1_is_not_portable() {
    for (x, least) in [(1e-2f64, 4e-5), (1e-6, 0.3)] {
        let u = x.exp();
        let allowed = u.ln() + 2f64.powi(-21);
        let portable = x * decay_mean(-x);
        assert!(((u - 1.0) * x / allowed / x.exp_m1() - 1.0).abs() > least);
        assert!((portable / x.exp_m1() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_closed_product_integral_overflows() {
    const PAIRS: u32 = 20_000;
    let (mut broken, mut difference, mut stable) = (0, Vec::new(), 0.0f64);
    for index in 0..PAIRS {
        let (a, b) = directions(index, 3);
        let [u, v] = r2_point(index, 5);
        let (x, y) = (sharpness(u) as f32, sharpness(v) as f32);
        let product = sg_product(a.as_dvec3(), f64::from(x), b.as_dvec3(), f64::from(y));
        let r = (a * x + b * y).length();
        let closed = 4.0 * std::f32::consts::PI * r.sinh() / (r * (x + y).exp());
        broken += u32::from(!closed.is_finite());
        if product.log_amplitude > -60.0 {
            difference.push(relative((r - x - y).exp() * 4.0 * std::f32::consts::PI * decay_mean_32(2.0 * r), product.integral()));
            let squared = (a - b).length_squared();
            let log = -x * y * squared / (x + y + r);
            let error = relative(log.exp() * 4.0 * std::f32::consts::PI * decay_mean_32(2.0 * r), product.integral());
            stable = stable.max(error / (1.0 + product.log_amplitude.abs()));
        }
    }
    difference.sort_by(f64::total_cmp);
    let share = f64::from(broken) / f64::from(PAIRS);
    assert!((share - 0.68).abs() < 0.03, "{share}");
    let worst = difference[difference.len() - difference.len() / 100];
    assert!(worst > 0.5, "{worst}");
    assert!(stable < 1e-6, "{stable:e}");
    // The printed form is right in arithmetic that holds it.
    let printed = sg_product_integral_printed(DVec3::X, 3.0, DVec3::Y, 5.0);
    assert!((printed / sg_product_integral(DVec3::X, 3.0, DVec3::Y, 5.0) - 1.0).abs() < 1e-13);
}

/// The difference of amplitudes of opposite equal lobes: `sqrt((1-rho)^2 + rho (4 - |d|^2))` for the length of the sum keeps half the digits.
#[test]
fn the_length_of_a_sum_comes_from_the_vectors() {
    let a = Vec3::new(0.36, 0.48, 0.8).normalize();
    let b = (-a + a.any_orthonormal_vector() * 1e-4).normalize();
    let want = (a.as_dvec3() + b.as_dvec3()).length();
    let squared = (a - b).length_squared();
    assert!(relative((4.0 - squared).max(0.0).sqrt(), want) > 0.1);
    assert!(relative((a + b).length(), want) < 1e-3);
}

#[test]
fn one_minus_erf_turns_irradiance_negative() {
    let erf = |x: f32| libm::erff(x);
    let (mut negative, mut stable_negative) = (0, 0);
    for index in 0..50_000u32 {
        let [u, v] = r2_point(index, 7);
        let (sharpness, angle) = (sharpness(u) as f32, (PI * v) as f32);
        let (s, c) = angle.sin_cos();
        let t = sharpness
            * (0.5 * ((sharpness + 2.736_083_2) * sharpness + 17.021_298)
                / (((sharpness + 4.010_082_7) * sharpness + 15.219_156) * sharpness + 76.087_9))
                .sqrt();
        let t = t.max(1e-4);
        let complement = |x: f32| 1.0 - erf(x);
        let tail = -(-t * t * c * c).exp() * (-t * t * s * s).exp_m1() / (2.0 * std::f32::consts::PI.sqrt() * t);
        negative += u32::from(0.5 * (c * complement(-t * c) + complement(t)) + tail < 0.0);
        stable_negative += u32::from(clamped_cosine_integral(f64::from(sharpness), f64::from(c), f64::from(s * s)) < 0.0);
    }
    assert!(negative > 10, "{negative}");
    assert_eq!(stable_negative, 0);
}

#[test]
fn the_cube_of_a_sharpness_overflows() {
    let x = 1e13f32;
    assert!(!(((x + 4.0) * x + 15.2) * x + 76.0).is_finite());
    assert!((clamped_cosine_integral(1e13, 0.7, 0.51) / (0.7 * sg_integral(1e13)) - 1.0).abs() < 1e-6);
    assert!((clamped_cosine_integral_fast(1e30, 0.7) / (0.7 * sg_integral(1e30)) - 1.0).abs() < 1e-6);
}

#[test]
fn a_cosine_fit_for_the_hemisphere_is_no_fit_for_the_sphere() {
    let whole = sg_integral(30.0);
    // Straight down, the unclamped fit is -1 times the lobe.
    assert!((clamped_cosine_integral_unclamped(30.0, -1.0) / whole + 0.93).abs() < 0.05);
    assert!(clamped_cosine_integral(30.0, -1.0, 0.0) / whole < 1e-10);
    assert!((clamped_cosine_integral_meder(30.0, 0.8) - clamped_cosine_integral_exact(30.0, 0.8f64.acos())).abs() < 0.011 * whole);
}

#[test]
fn a_minus_in_the_printed_asg_integral_is_an_error_of_print() {
    let (x, y) = (1000.0, 1.0);
    let exact = asg_integral_exact(x, y);
    let t = x - y;
    let (near, far) = (asg_azimuth_integral(t), t / y * asg_azimuth_integral(t + t / y));
    let with = |sign: f64| PI / (x * y).sqrt() - (-y).exp() / (2.0 * x) * (near + sign * far);
    assert!((with(-1.0) / exact - 1.0).abs() > 0.3 && (with(1.0) / exact - 1.0).abs() < 0.02);
    assert!((asg_integral_printed(x, y) - with(1.0)).abs() < 1e-15);
    assert!((asg_integral(x, y) / exact - 1.0).abs() < 0.014);
    // Both printed forms diverge for a slab; with a plus the value can even be negative.
    let slab = asg_integral_exact(1e5, 1e-3);
    assert!((asg_integral_printed(1e5, 1e-3) / slab - 1.0).abs() > 5.0);
    assert!((asg_integral(1e5, 1e-3) / slab - 1.0).abs() < 0.014);
    assert!(asg_integral(1e5, 0.0).is_finite());
}

#[test]
fn a_scaled_bessel_function_is_not_the_product_of_its_factors() {
    let t = 400f32;
    let growth = (0.5 * t).exp();
    assert!(!growth.is_finite() && (-0.5 * t).exp() * growth != 1.0);
    assert!((asg_azimuth_integral(400.0) / (2.0 * PI / (200.0 * 2.0 * PI).sqrt()) - 1.0).abs() < 1e-3);
}

#[test]
fn the_printed_product_with_a_broad_lobe_is_wrong_or_undefined() {
    let axis = DVec3::new(0.3, 0.2, 0.93).normalize();
    assert!(asg_sg_integral_printed(0.0, 0.0, axis, 0.0).is_nan());
    assert!((asg_sg_integral(0.0, 0.0, axis, 0.0) / PI - 1.0).abs() < 1e-9);
    // A constant lobe changes nothing; printed, it takes the cosine of an axis that it does not have.
    let tilted = DVec3::new(0.9, 0.0, 0.19f64.sqrt());
    let want = asg_sg_integral_exact(50.0, 5.0, tilted, 0.1);
    assert!(asg_sg_integral_printed(50.0, 5.0, tilted, 0.1) / want < 0.5);
    assert!((asg_sg_integral(50.0, 5.0, tilted, 0.1) / want - 1.0).abs() < 0.01);
}

#[test]
fn the_other_sign_of_an_eigenvector_is_no_product() {
    let lobe = |axis: DVec3, eta_x: f64| {
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        AnisotropicSphericalGaussian { tangent, bitangent, axis, eta_x, eta_y: 20.0, amplitude: 1.0 }
    };
    let (a, b) = (lobe(DVec3::Z, 100.0), lobe(DVec3::new(0.3, 0.1, 1.0).normalize(), 60.0));
    let (product, log_amplitude) = asg_product(&a, &b);
    let wrong = -product.axis;
    assert_eq!(a.axis.dot(wrong).max(0.0) * b.axis.dot(wrong).max(0.0), 0.0);
    let exact = asg_asg_integral_exact(&a, &b);
    assert!((log_amplitude.exp() * product.integral() / exact - 1.0).abs() < 0.1);
    // Either sign of either factor's frame gives the same product.
    let turned = AnisotropicSphericalGaussian { tangent: -a.tangent, bitangent: -a.bitangent, ..a };
    assert!((asg_asg_integral(&turned, &b) / asg_asg_integral(&a, &b) - 1.0).abs() < 1e-12);
}

/// "About 2" for the sharpness of the cosine is a rounding: the integral of the clamped cosine against an SG is nearer with 2.29251.
#[test]
fn the_cosine_is_no_lobe_of_sharpness_two() {
    let distance = |sharpness: f64| {
        let amplitude = PI / sg_integral(sharpness);
        // |cos - a G|^2 over the sphere = 2 pi / 3 - 2 a int(cos G) + a^2 int(G^2).
        (2.0 / 3.0 * PI - 2.0 * amplitude * 2.0 * PI * decay_mean_upper(sharpness) + amplitude * amplitude * sg_integral(2.0 * sharpness))
            / (2.0 / 3.0 * PI)
    };
    let best = lobelia_lobes::cosine_lobe::cosine_lobe_sharpness(1.0);
    assert!((best - 2.29251).abs() < 1e-3, "{best}");
    assert!(distance(best) < distance(best - 0.01) && distance(best) < distance(best + 0.01));
    assert!(distance(2.0) > 1.2 * distance(best) && distance(best) > 0.03, "{} {}", distance(2.0), distance(best));
    let (scale, value) =
        integrate_hemisphere(&lobelia_lobes::quadrature::Exponent { gaussians: vec![(DVec3::Z, best)], squares: vec![] }, DVec3::Z);
    assert!((scale.exp() * value / (2.0 * PI * decay_mean(best)) - 1.0).abs() < 1e-12);
}
