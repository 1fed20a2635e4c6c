//! What holds for all lobes, whatever their parameters.
#![allow(clippy::unwrap_used)]

use glam::{DQuat, DVec3};
use lobelia_lobes::{asg::*, asg_product::*, cosine_lobe::*, lobe_similarity::*, quadrature::*, sg::*, sg_cosine::*};
use proptest::prelude::*;
use std::f64::consts::PI;

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0f64, 0.0..2.0 * PI).prop_map(|(z, azimuth)| {
        let s = (1.0 - z * z).sqrt();
        DVec3::new(s * azimuth.cos(), s * azimuth.sin(), z)
    })
}

/// Log-uniform in [1e-6, 1e8], and 0.
fn sharpness() -> impl Strategy<Value = f64> {
    prop_oneof![8 => (-6.0..8.0f64).prop_map(|exponent| 10f64.powf(exponent)), 1 => Just(0.0)]
}

fn rotation() -> impl Strategy<Value = DQuat> {
    (direction(), 0.0..2.0 * PI).prop_map(|(axis, angle)| DQuat::from_axis_angle(axis, angle))
}

fn asg() -> impl Strategy<Value = AnisotropicSphericalGaussian> {
    (rotation(), sharpness(), sharpness()).prop_map(|(turn, eta_x, eta_y)| AnisotropicSphericalGaussian {
        tangent: turn * DVec3::X,
        bitangent: turn * DVec3::Y,
        axis: turn * DVec3::Z,
        eta_x,
        eta_y,
        amplitude: 1.0,
    })
}

/// Equal to 1e-9, as logarithms relative to their size.
fn same(left: f64, right: f64) -> bool {
    left == right || (left - right).abs() <= 1e-9 * (1.0 + left.abs().max(right.abs()))
}

/// Something of two lobes.
type Form = fn(DVec3, f64, DVec3, f64) -> f64;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn products_of_gaussians_commute(a in direction(), b in direction(), x in sharpness(), y in sharpness()) {
        let (left, right) = (sg_product(a, x, b, y), sg_product(b, y, a, x));
        prop_assert!(same(left.log_amplitude, right.log_amplitude) && same(left.sharpness, right.sharpness));
        prop_assert!(left.sharpness <= 1e-6 * (x + y) || (left.axis - right.axis).length() < 1e-9);
    }

    #[test]
    fn a_product_has_the_value_of_its_factors(a in direction(), b in direction(), w in direction(), x in sharpness(), y in sharpness()) {
        let product = sg_product(a, x, b, y);
        let log = product.log_amplitude + sg_log_evaluate(product.axis, product.sharpness, w);
        let factors = sg_log_evaluate(a, x, w) + sg_log_evaluate(b, y, w);
        prop_assert!((log - factors).abs() <= 1e-9 * (1.0 + x + y), "{} {}", log, factors);
    }

    #[test]
    fn a_product_integral_is_bounded_by_its_factors(a in direction(), b in direction(), x in sharpness(), y in sharpness()) {
        let integral = sg_product_integral(a, x, b, y);
        let slack = 1.0 + 1e-12;
        // Of a product: its largest value times the sphere; and either factor's integral, since the other is at most 1.
        prop_assert!(integral <= sg_product(a, x, b, y).log_amplitude.exp() * 4.0 * PI * slack);
        prop_assert!(integral <= sg_integral(x).min(sg_integral(y)) * slack);
        // Cauchy and Schwarz, for logarithms.
        prop_assert!(log_sg_product_integral(a, x, b, y) <= 0.5 * (sg_integral(2.0 * x).ln() + sg_integral(2.0 * y).ln()) + 1e-12);
    }

    #[test]
    fn integrals_turn_with_their_lobes(a in direction(), b in direction(), x in sharpness(), y in sharpness(), turn in rotation()) {
        let (still, turned) = (log_sg_product_integral(a, x, b, y), log_sg_product_integral(turn * a, x, turn * b, y));
        // Turning rounds the axes, which a sharp lobe feels.
        prop_assert!((still - turned).abs() <= 1e-9 + 1e-14 * (x + y), "{} {}", still, turned);
    }

    #[test]
    fn similarity_is_mutual_and_turns_with_the_lobes(a in direction(), b in direction(), x in sharpness(), y in sharpness(), turn in rotation()) {
        let forms: [Form; 3] = [
            lobe_similarity, lobe_similarity_exact, |a, x, b, y| lobe_similarity_weight(a, x, b, y, 20.0),
        ];
        for form in forms {
            let value = form(a, x, b, y);
            prop_assert!((0.0..=1.0 + 1e-12).contains(&value), "{}", value);
            prop_assert!((value - form(b, y, a, x)).abs() <= 1e-12);
            // Turning rounds the axes.
            prop_assert!((value - form(turn * a, x, turn * b, y)).abs() <= 1e-12 + 1e-14 * (x + y));
            prop_assert!((form(a, x, a, x) - 1.0).abs() <= 1e-12);
        }
        prop_assert!((diffuse_similarity(a, b) - diffuse_similarity(b, a)).abs() <= 1e-12 && (diffuse_similarity(a, a) - 1.0).abs() <= 1e-12);
    }

    #[test]
    fn hemispheres_are_whole(x in sharpness(), angle in 0.0..PI) {
        let c = angle.cos();
        let whole = sg_integral(x);
        // What is above the horizon and what is below it make a sphere; the cosine over both is the mean cosine's.
        let both = hemisphere_integral_exact(x, angle) + hemisphere_integral_exact(x, PI - angle);
        prop_assert!((both / whole - 1.0).abs() < 1e-9, "{} {}", both, whole);
        let mean = clamped_cosine_integral_exact(x, 0.0) - clamped_cosine_integral_exact(x, PI);
        let difference = clamped_cosine_integral_exact(x, angle) - clamped_cosine_integral_exact(x, PI - angle);
        prop_assert!((difference - c * mean).abs() < 1e-9 * whole);
        for form in [clamped_cosine_integral(x, c, 1.0 - c * c), clamped_cosine_integral_fast(x, c), clamped_cosine_integral_constant_cosine(x, c)] {
            prop_assert!(form >= 0.0 && form <= whole * (1.0 + 1e-12), "{}", form);
        }
        for form in [hemisphere_integral(x, c), hemisphere_integral_fast(x, c), hemisphere_integral_meder(x, c)] {
            prop_assert!(form >= 0.0 && form <= whole * (1.0 + 1e-12), "{}", form);
        }
    }

    #[test]
    fn a_fast_irradiance_rises_with_the_cosine(x in sharpness(), angle in 0.0..PI, step in 1e-3..0.5f64) {
        let (low, high) = (clamped_cosine_integral_fast(x, (angle + step).min(PI).cos()), clamped_cosine_integral_fast(x, angle.cos()));
        prop_assert!(high >= low * (1.0 - 1e-12));
    }

    #[test]
    fn products_of_anisotropic_gaussians_commute_and_turn(a in asg(), b in asg(), turn in rotation()) {
        let turned = |lobe: &AnisotropicSphericalGaussian| AnisotropicSphericalGaussian {
            tangent: turn * lobe.tangent, bitangent: turn * lobe.bitangent, axis: turn * lobe.axis, ..*lobe
        };
        // Where the second and third eigenvalue are close, the axis is not determined.
        let (product, log) = asg_product(&a, &b);
        if !(product.eta_y > 1e-3 * product.eta_x && log > -1e6) {
            return Ok(());
        }
        for (c, d) in [(b, a), (turned(&a), turned(&b))] {
            let other = asg_product(&c, &d).1;
            prop_assert!((log - other).abs() <= 1e-9 * (1.0 + log.abs()) + 1e-13 * (product.eta_x + product.eta_y), "{} {}", log, other);
        }
    }

    #[test]
    fn a_peak_is_a_peak(x in sharpness(), y in sharpness(), axis in direction(), sharpness in sharpness(), near in direction()) {
        if axis.z < 1e-3 {
            return Ok(());
        }
        let peak = asg_sg_peak(x, y, axis, sharpness);
        if peak.log_amplitude < -50.0 {
            return Ok(());
        }
        let exponent = |w: DVec3| -0.5 * sharpness * (w - axis).length_squared() - x * w.x * w.x - y * w.y * w.y;
        let width = 1.0 / (1.0 + sharpness + x + y).sqrt();
        let beside = (peak.local + near * width).normalize();
        // Two Newton steps leave the peak lower than the highest point by a part of the exponent's unit.
        prop_assert!(exponent(beside) <= peak.log_amplitude + 0.5, "{} {}", exponent(beside), peak.log_amplitude);
    }

    #[test]
    fn cosine_lobes_and_gaussians_of_equal_half_width(exponent in 1e-2..1e7f64) {
        let sharpness = cosine_lobe_sharpness_half_maximum(exponent);
        prop_assert!((cosine_lobe_exponent_half_maximum(sharpness) / exponent - 1.0).abs() < 1e-7);
        // Where one is a half, so is the other.
        let cosine = 0.5f64.powf(1.0 / exponent);
        let w = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
        prop_assert!((sg_evaluate(DVec3::Z, sharpness, w) - 0.5).abs() < 1e-6);
        prop_assert!((cosine_lobe_evaluate(DVec3::Z, exponent, w) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn products_of_cosine_lobes_are_exact_at_their_axis(a in direction(), b in direction(), n in 0.1..1e4f64, m in 0.1..1e4f64) {
        let (a, b) = (CosineLobe { axis: a, exponent: n, amplitude: 2.0 }, CosineLobe { axis: b, exponent: m, amplitude: 0.5 });
        for product in [cosine_lobe_product(&a, &b), cosine_lobe_product_refined(&a, &b)] {
            let value = a.evaluate(product.axis) * b.evaluate(product.axis);
            prop_assert!((product.amplitude - value).abs() <= 1e-9 * value.max(1e-300), "{:?} {}", product, value);
        }
        // No direction beats the refined peak.
        let refined = cosine_lobe_product_refined(&a, &b);
        for t in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let w = a.axis.lerp(b.axis, t).normalize_or(DVec3::Z);
            prop_assert!(a.evaluate(w) * b.evaluate(w) <= refined.amplitude * (1.0 + 1e-9) + 1e-300);
        }
    }
}

#[test]
fn normalised_lobes_integrate_to_one() {
    let axis = DVec3::new(-0.2, 0.7, 0.4).normalize();
    for sharpness in [0.0, 1e-6, 0.1, 1.0, 40.0, 1e5, 1e8] {
        let lobe = SphericalGaussian::normalized(axis, sharpness);
        let (scale, value) = integrate_lobes(&Exponent { gaussians: vec![(axis, sharpness)], squares: vec![] }, None, None);
        assert!((lobe.amplitude * scale.exp() * value - 1.0).abs() < 1e-11, "{sharpness}");
        let cosine = CosineLobe::normalized(axis, sharpness);
        assert!((cosine.integral() - 1.0).abs() < 1e-14);
        assert!((cosine.to_spherical_gaussian().integral() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn flat_and_sharp_limits() {
    assert!((sg_integral(0.0) - 4.0 * PI).abs() < 1e-14);
    assert!((sg_product_integral(DVec3::X, 0.0, DVec3::Y, 0.0) - 4.0 * PI).abs() < 1e-12);
    for c in [-1.0, -0.4, 0.0, 0.4, 1.0] {
        let s2 = 1.0 - c * c;
        assert!((hemisphere_integral(0.0, c) - 2.0 * PI).abs() < 1e-6 && (clamped_cosine_integral(0.0, c, s2) - PI).abs() < 1e-12);
        // The hyperbola is off by 6e-4 of pi at most there.
        assert!((clamped_cosine_integral_fast(0.0, c) / PI - 1.0).abs() < 1e-3);
        // A lobe that is a point: all of it counts, with its cosine, or none.
        let sharp = sg_integral(1e8);
        assert!((clamped_cosine_integral(1e8, c, s2) / sharp - c.max(0.0)).abs() < 5e-5, "{c}");
        assert!((clamped_cosine_integral_fast(1e8, c) / sharp - c.max(0.0)).abs() < 5e-5, "{c}");
        if c != 0.0 {
            assert!((hemisphere_integral(1e8, c) / sharp - if c > 0.0 { 1.0 } else { 0.0 }).abs() < 1e-6, "{c}");
        }
    }
    for horizon in [1e-3, 1.0, 50.0, 1e4] {
        let exact = clamped_cosine_integral_at_horizon(horizon);
        assert!((clamped_cosine_integral_exact(horizon, 0.5 * PI) / exact - 1.0).abs() < 1e-10);
        assert!((clamped_cosine_integral_fast(horizon, 0.0) / exact - 1.0).abs() < 2e-3, "{horizon}");
    }
    assert!((asg_integral(0.0, 0.0) - PI).abs() < 1e-14 && (asg_integral(1e8, 1e8) / asg_integral_fast(1e8, 1e8) - 1.0).abs() < 1e-12);
}

/// The L1 distances that the documentation gives for products of cosine lobes, over the product's integral.
#[test]
fn products_of_cosine_lobes_are_as_near_as_they_say() {
    let distance = |n: f64, degrees: f64, refined: bool| {
        let (s, c) = degrees.to_radians().sin_cos();
        let (a, b) = (CosineLobe::normalized(DVec3::Z, n), CosineLobe::normalized(DVec3::new(s, 0.0, c), n));
        let product = if refined { cosine_lobe_product_refined(&a, &b) } else { cosine_lobe_product(&a, &b) };
        let (x, y) = product.axis.any_orthonormal_pair();
        let (mut total, mut off) = (0.0, 0.0);
        for i in 0..600 {
            // Cells of equal area about the product's axis, drawn together where it is sharp.
            let share = (f64::from(i) + 0.5) / 600.0;
            let scale = 1.0 / (n + 1.0);
            let versine = 2.0 * scale * share / (1.0 + scale - share);
            let weight = 2.0 * scale * (1.0 + scale) / (1.0 + scale - share).powi(2);
            for j in 0..200 {
                let azimuth = 2.0 * PI * (f64::from(j) + 0.5) / 200.0;
                let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
                let w = product.axis * (1.0 - versine) + (x * azimuth.cos() + y * azimuth.sin()) * sine;
                let value = a.evaluate(w) * b.evaluate(w);
                total += value * weight;
                off += (product.evaluate(w) - value).abs() * weight;
            }
        }
        off / total
    };
    for (n, degrees, single, refined) in [
        (1.0, 0.0, 0.12, 0.0),
        (1.0, 60.0, 0.219, 0.164),
        (20.0, 60.0, 0.323, 0.094),
        (20.0, 80.0, 0.69, 0.174),
        (1000.0, 60.0, 0.333, 0.092),
    ] {
        let (got, got_refined) = (distance(n, degrees, false), distance(n, degrees, true));
        assert!((got - single).abs() < 0.002 && (got_refined - refined).abs() < 0.002, "{n} {degrees}: {got} {got_refined}");
    }
}
