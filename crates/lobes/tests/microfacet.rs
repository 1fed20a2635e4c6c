//! How well lobes stand for normal distributions, for what the view makes of them, and for glossy shading by an SG light. Published figures are given
//! to their last digit, of which one more or less is allowed.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia_lobes::{brdf::*, microfacet_lobe::*, quadrature::integrate, sg::sg_evaluate};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

type Distribution = fn(f64, DVec3, DVec3) -> f64;
type Glossy = fn(f64, DVec3, DVec3, DVec3, f64) -> f64;

const N: DVec3 = DVec3::Z;

fn direction(angle: f64, azimuth: f64) -> DVec3 {
    DVec3::new(angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin(), angle.cos())
}

fn view(degrees: f64) -> DVec3 {
    direction(degrees.to_radians(), 0.0)
}

/// Whether a value is that of a table, give or take one in its last digit: `digit` is the worth of that.
fn as_printed(got: f64, printed: f64, digit: f64) -> bool {
    (got - printed).abs() <= 1.5 * digit
}

/// Integral over the hemisphere of `|f - g|` as a share of that of f, both functions of the angle to the normal, weighted by a power of the cosine.
fn round_l1(width: f64, power: i32, f: impl Fn(f64) -> f64, g: impl Fn(f64) -> f64) -> f64 {
    let ring = |angle: f64| TAU * angle.sin() * angle.cos().powi(power);
    let (mut difference, mut whole, mut low) = (0.0, 0.0, 0.0);
    while low < FRAC_PI_2 {
        // Panels that grow from the lobe's width.
        let high = (low + 0.1 * width + 0.1 * low).min(FRAC_PI_2);
        difference += integrate(low, high, 4, |angle| (f(angle) - g(angle)).abs() * ring(angle));
        whole += integrate(low, high, 1, |angle| f(angle) * ring(angle));
        low = high;
    }
    difference / whole
}

fn ndf_l1(alpha: f64, power: i32, distribution: Distribution, lobes: &[NdfLobe]) -> f64 {
    let sum = |angle: f64| lobes.iter().map(|lobe| lobe.about(N).evaluate(direction(angle, 0.0))).sum::<f64>();
    round_l1(alpha, power, |angle| distribution(alpha, N, direction(angle, 0.0)), sum)
}

/// The lobe with the energy that its amplitude has for small alpha, against the projected solid angle.
fn projected(lobe: NdfLobe) -> NdfLobe {
    let energy = lobe.amplitude * TAU / lobe.sharpness;
    NdfLobe { amplitude: energy * ndf_amplitude_projected(lobe.sharpness), ..lobe }
}

#[test]
fn normal_distributions_as_one_lobe_are_as_far_off_as_published() {
    for (alpha, plain, of_projected) in [(0.1, 0.010, 0.007), (0.2, 0.039, 0.027), (0.3, 0.087, 0.058)] {
        let lobe = beckmann_lobe(alpha);
        let (got, against) =
            (ndf_l1(alpha, 0, beckmann_distribution, &[lobe]), ndf_l1(alpha, 1, beckmann_distribution, &[projected(lobe)]));
        assert!(as_printed(got, plain, 1e-3) && as_printed(against, of_projected, 1e-3), "alpha {alpha}: {got}, {against}");
    }
    for (alpha, plain, of_projected) in [(0.5, 0.23, 0.14), (0.7, 0.40, 0.23), (1.0, 0.60, 0.35)] {
        let lobe = beckmann_lobe(alpha);
        let (got, against) =
            (ndf_l1(alpha, 0, beckmann_distribution, &[lobe]), ndf_l1(alpha, 1, beckmann_distribution, &[projected(lobe)]));
        assert!(as_printed(got, plain, 1e-2) && as_printed(against, of_projected, 1e-2), "alpha {alpha}: {got}, {against}");
    }
    assert!(as_printed(ndf_l1(0.05, 0, beckmann_distribution, &[beckmann_lobe(0.05)]), 0.002, 1e-3));
    for (alpha, plain, of_projected) in [(0.05, 0.41, 0.41), (0.1, 0.41, 0.40), (0.2, 0.41, 0.39), (0.3, 0.40, 0.36), (0.5, 0.36, 0.30)] {
        let lobe = ggx_lobe_one(alpha);
        let (got, against) = (ndf_l1(alpha, 0, ggx_distribution, &[lobe]), ndf_l1(alpha, 1, ggx_distribution, &[projected(lobe)]));
        assert!(as_printed(got, plain, 1e-2) && as_printed(against, of_projected, 1e-2), "alpha {alpha}: {got}, {against}");
    }
    // Broad distributions have a sharpness of their own.
    let got = ndf_l1(0.7, 0, ggx_distribution, &[ggx_lobe_one(0.7)]);
    assert!(as_printed(got, 0.18, 1e-2), "{got}");
    assert!(ndf_l1(1.0, 0, ggx_distribution, &[ggx_lobe_one(1.0)]) < 1e-12);
    for (exponent, with_n, with_n_plus_one) in [(1.0, 0.26, 0.19), (5.0, 0.19, 0.09), (10.0, 0.100, 0.051)] {
        let l1 = |sharpness: f64| round_l1(0.3, 0, |t: f64| t.cos().powf(exponent), |t| sg_evaluate(N, sharpness, direction(t, 0.0)));
        let (plain, better) = (l1(exponent), l1(ndf_sharpness_phong(exponent)));
        assert!(as_printed(plain, with_n, 1e-2) && as_printed(better, with_n_plus_one, 1e-2), "exponent {exponent}: {plain}, {better}");
        // The peak is that of a distribution that integrates to 1 against the projected solid angle.
        let whole = integrate(0.0, FRAC_PI_2, 8, |t| TAU * t.sin() * t.cos() * phong_lobe(exponent).amplitude * t.cos().powf(exponent));
        assert!((whole - 1.0).abs() < 1e-12, "exponent {exponent}: {whole}");
    }
}

#[test]
fn ggx_as_two_and_three_lobes_is_as_far_off_as_published() {
    for (alpha, two, three) in [(0.1, 0.108, 0.038), (0.2, 0.085, 0.024), (0.3, 0.064, 0.029)] {
        let (got_two, got_three) = (
            ndf_l1(alpha, 1, ggx_distribution, &ggx_lobes_two(alpha).map(projected)),
            ndf_l1(alpha, 1, ggx_distribution, &ggx_lobes_three(alpha).map(projected)),
        );
        assert!(as_printed(got_two, two, 1e-3) && as_printed(got_three, three, 1e-3), "alpha {alpha}: {got_two}, {got_three}");
    }
    // The limit for small alpha, the tail included.
    let (two, three) = (ndf_l1(1e-3, 0, ggx_distribution, &ggx_lobes_two(1e-3)), ndf_l1(1e-3, 0, ggx_distribution, &ggx_lobes_three(1e-3)));
    assert!(as_printed(two, 0.117, 1e-3) && as_printed(three, 0.047, 1e-3), "{two}, {three}");
    for lobes in [&ggx_lobes_two(1e-3)[..], &ggx_lobes_three(1e-3)[..]] {
        let energy: f64 = lobes.iter().map(|lobe| lobe.amplitude / ndf_amplitude_projected(lobe.sharpness)).sum();
        assert!((energy - 1.0).abs() < 1e-5, "{energy}");
    }
}

#[test]
fn beckmanns_distribution_is_normalised_and_stable() {
    let naive = |a: f64, c: f64| (-(1.0 - c * c) / (c * a).powi(2)).exp() / (PI * a * a * c.powi(4));
    for alpha in [0.001, 0.05, 0.3, 1.0] {
        let whole = round_l1(alpha, 1, |t| beckmann_distribution(alpha, N, direction(t, 0.0)), |_| 0.0);
        assert!((whole - 1.0).abs() < 1e-12);
        let mut low = 0.0;
        let mut total = 0.0;
        while low < FRAC_PI_2 {
            let high = (low + 0.1 * alpha + 0.1 * low).min(FRAC_PI_2);
            total += integrate(low, high, 2, |t| TAU * t.sin() * t.cos() * beckmann_distribution(alpha, N, direction(t, 0.7)));
            low = high;
        }
        assert!((total - 1.0).abs() < 1e-9, "alpha {alpha}: {total}");
        for c in [0.9f64, 0.5, 0.2] {
            let (got, want) = (beckmann_distribution(alpha, N, direction(c.acos(), 0.3)), naive(alpha, c));
            assert!((got - want).abs() <= 1e-12 * want + 1e-300, "{alpha} {c}: {got:e} {want:e}");
        }
        assert_eq!(beckmann_distribution(alpha, N, DVec3::X), 0.0);
    }
    // Masking: Lambda = 0 seen from above, and 1 / (4 n.l n.v) is left.
    assert!((beckmann_visibility(0.1, 1.0, 0.9) - 0.25 / 0.9).abs() < 1e-12);
    let grazing = beckmann_visibility(0.5, 0.01, 0.02);
    let lambda = |c: f64| {
        let a = c / (0.5 * (1.0 - c * c).sqrt());
        (1.0 + 2.276 * a + 2.577 * a * a) / (3.535 * a + 2.181 * a * a) - 1.0
    };
    assert!((grazing / (0.25 / (0.01 * 0.02 * (1.0 + lambda(0.01) + lambda(0.02)))) - 1.0).abs() < 1e-9, "{grazing}");
}

/// L1 error of a lobe as D(h) over the directions of the upper hemisphere, the peak of both 1; and the lobe's share of D's energy.
fn warp_l1(alpha: f64, distribution: Distribution, view: DVec3, lobe: impl Fn(DVec3) -> f64) -> (f64, f64) {
    let (steps, azimuths) = (400, 160);
    let (low, high) = ((1e-4 * alpha).ln(), 1e4f64.ln());
    let step = (high - low) / f64::from(steps);
    let peak = distribution(alpha, N, N);
    let (mut difference, mut whole, mut share) = (0.0, 0.0, 0.0);
    for i in 0..steps {
        let tangent = (low + (f64::from(i) + 0.5) * step).exp();
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        let sine = tangent * cosine;
        for j in 0..azimuths {
            // The plane of incidence mirrors the lobe, so half a turn is enough.
            let azimuth = PI * (f64::from(j) + 0.5) / f64::from(azimuths);
            let h = DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine);
            let v_dot_h = view.dot(h);
            let l = h * (2.0 * v_dot_h) - view;
            if v_dot_h > 0.0 && l.z > 0.0 {
                // d l = 4 v.h d h, over the logarithm of the tangent.
                let measure = sine * sine * cosine * 4.0 * v_dot_h;
                let (d, value) = (distribution(alpha, N, h) / peak, lobe(l));
                difference += (d - value).abs() * measure;
                whole += d * measure;
                share += value * measure;
            }
        }
    }
    (difference / whole, share / whole)
}

#[test]
fn reflection_lobes_are_as_far_off_as_published() {
    // Distribution, alpha, angle, and L1 of: printed SG, printed ASG, regularised ASG.
    let table: [(Distribution, f64, f64, [f64; 3]); 13] = [
        (beckmann_distribution, 0.05, 0.0, [0.00, 0.01, 0.01]),
        (beckmann_distribution, 0.05, 45.0, [0.22, 0.02, 0.02]),
        (beckmann_distribution, 0.05, 80.0, [0.99, 0.15, 0.15]),
        (beckmann_distribution, 0.05, 88.0, [1.5, 0.43, 0.38]),
        (beckmann_distribution, 0.4, 0.0, [0.13, 0.21, 0.21]),
        (beckmann_distribution, 0.4, 80.0, [0.83, 0.55, 0.43]),
        (beckmann_distribution, 0.4, 88.0, [1.0, 0.87, 0.55]),
        (ggx_distribution, 0.1, 0.0, [0.39, 0.38, 0.38]),
        (ggx_distribution, 0.1, 45.0, [0.43, 0.38, 0.38]),
        (ggx_distribution, 0.1, 80.0, [1.0, 0.51, 0.53]),
        (ggx_distribution, 0.1, 88.0, [1.2, 0.77, 0.73]),
        (ggx_distribution, 0.7, 45.0, [0.17, 0.44, 0.43]),
        (ggx_distribution, 0.7, 88.0, [0.96, 0.97, 0.75]),
    ];
    for (distribution, alpha, angle, printed) in table {
        let (sharpness, view) = (ndf_sharpness_ggx(alpha), view(angle));
        let round = reflection_lobe_sg_printed(sharpness, N, view);
        let slabs = [reflection_lobe_asg_printed(sharpness, N, view), reflection_lobe_asg(sharpness, N, view)];
        let got = [
            warp_l1(alpha, distribution, view, |l| round.evaluate(l)).0,
            warp_l1(alpha, distribution, view, |l| slabs[0].evaluate(l)).0,
            warp_l1(alpha, distribution, view, |l| slabs[1].evaluate(l)).0,
        ];
        for (got, printed) in got.into_iter().zip(printed) {
            let digit = if printed >= 1.0 { 0.1 } else { 0.01 };
            assert!(as_printed(got, printed, digit), "alpha {alpha}, {angle} degrees: {got}, not {printed}");
        }
    }
    assert!(!as_printed(0.12, 0.10, 0.01) && !as_printed(f64::NAN, 0.1, 0.01));
}

#[test]
fn the_printed_warp_loses_its_energy_at_grazing_and_the_regularised_one_keeps_it() {
    let (alpha, sharpness) = (0.2, ndf_sharpness_beckmann(0.2));
    let energy = |angle: f64| {
        let view = view(angle);
        let (printed, regularised) = (reflection_lobe_asg_printed(sharpness, N, view), reflection_lobe_asg(sharpness, N, view));
        let share =
            |lobe: &lobelia_lobes::asg::AnisotropicSphericalGaussian| warp_l1(alpha, beckmann_distribution, view, |l| lobe.evaluate(l)).1;
        (share(&printed), share(&regularised))
    };
    let (printed, regularised) = energy(45.0);
    assert!((printed - 1.0).abs() < 0.1 && (regularised - 1.0).abs() < 0.1, "{printed}, {regularised}");
    let (printed, regularised) = energy(89.5);
    assert!(printed < 0.1 && regularised > 0.4 && regularised < 1.0, "{printed}, {regularised}");
    // In the horizon the printed lobe is no lobe at all.
    let horizon = DVec3::X;
    assert_eq!(reflection_lobe_sg_printed(sharpness, N, horizon).sharpness, f64::INFINITY);
    let printed = reflection_lobe_asg_printed(sharpness, N, horizon);
    assert!(printed.eta_x == f64::INFINITY && printed.integral().is_nan() || printed.integral() == 0.0);
    for alpha in [1e-3, 0.02, 0.5, 1.0] {
        let sharpness = ndf_sharpness_ggx(alpha);
        let (round, slab) = (reflection_lobe_sg(sharpness, N, horizon), reflection_lobe_asg(sharpness, N, horizon));
        // c_e is alpha / 2.
        assert!((round.sharpness * 2.0 * alpha / sharpness - 1.0).abs() < 1e-12);
        assert!((slab.eta_x * 2.0 * alpha * alpha / sharpness - 1.0).abs() < 1e-12 && slab.integral() > 0.0);
    }
}

#[test]
fn frames_are_orthonormal_from_the_normal_to_the_horizon() {
    let normals = [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.3, -0.5, 0.8).normalize()];
    for normal in normals {
        let across = normal.any_orthonormal_vector();
        for angle in [0.0, 1e-12, 1e-9, 1e-6, 1.1e-6, 1e-4, 0.3, 1.5, FRAC_PI_2] {
            let view = (normal * f64::cos(angle) + across * f64::sin(angle)).normalize();
            let lobe = reflection_lobe_asg(200.0, normal, view);
            for (one, other) in [(lobe.tangent, lobe.bitangent), (lobe.tangent, lobe.axis), (lobe.bitangent, lobe.axis)] {
                assert!(one.dot(other).abs() < 1e-12 && (one.length() - 1.0).abs() < 1e-12, "{angle}: {lobe:?}");
            }
            if angle > 1e-5 {
                assert!(lobe.tangent.dot(normal).abs() < 1e-9 && lobe.eta_x > lobe.eta_y, "{angle}: {lobe:?}");
            }
        }
    }
    // A constant distribution stays one.
    let flat = reflection_lobe_asg(0.0, N, DVec3::X);
    assert_eq!((flat.eta_x, flat.eta_y, reflection_lobe_sg(0.0, N, N).sharpness), (0.0, 0.0, 0.0));
}

/// The integral by brute force over directions.
fn glossy_brute_force(alpha: f64, view: DVec3, axis: DVec3, sharpness: f64) -> f64 {
    integrate(0.0, FRAC_PI_2, 12, |theta| {
        integrate(0.0, TAU, 12, |phi| {
            let l = direction(theta, phi);
            let h = (l + view).normalize();
            ggx_distribution(alpha, N, h) * ggx_visibility(alpha, l.z, view.z) * sg_evaluate(axis, sharpness, l) * l.z
        }) * theta.sin()
    })
}

#[test]
fn the_exact_integral_is_that() {
    // On both sides of where it changes its variables (2 sharpness alpha^2 = 1), with axes above and below the horizon.
    for (alpha, degrees, axis, sharpness) in [
        (0.4, 30.0, direction(0.9, 2.5), 3.0),
        (0.4, 30.0, direction(0.9, 2.5), 3.3),
        (0.4, 75.0, direction(1.2, 3.0), 20.0),
        (0.7, 60.0, direction(1.8, 3.0), 5.0),
        (0.7, 10.0, direction(0.5, 1.0), 0.0),
        (0.9, 85.0, direction(0.2, 0.0), 0.5),
        (0.3, 50.0, direction(0.8, 3.0), 60.0),
    ] {
        let want = glossy_brute_force(alpha, view(degrees), axis, sharpness);
        let got = glossy_sg_light_exact(alpha, N, view(degrees), axis, sharpness, 1e-7);
        assert!((got / want - 1.0).abs() < 1e-6, "alpha {alpha}, {degrees} degrees, sharpness {sharpness}: {got} {want}");
    }
    // A sharp light is a point: the integrand at its axis times its integral.
    let (alpha, axis, sharpness) = (0.3, direction(0.7, 2.9), 1e7);
    let h = (axis + view(40.0)).normalize();
    let point = ggx_distribution(alpha, N, h) * ggx_visibility(alpha, axis.z, view(40.0).z) * axis.z * TAU / sharpness;
    assert!((glossy_sg_light_exact(alpha, N, view(40.0), axis, sharpness, 1e-7) / point - 1.0).abs() < 1e-4);
}

/// RMS error over light axes out to two standard deviations of lobe and light together, as a share of the RMS value.
fn rms<const K: usize>(alpha: f64, degrees: f64, sharpness: f64, forms: [Glossy; K]) -> [f64; K] {
    const STEPS: i32 = 4;
    let view = view(degrees);
    let lobe = reflection_lobe_asg(ndf_sharpness_ggx(alpha), N, view);
    let (mut errors, mut squares) = ([0.0; K], 0.0);
    for i in -STEPS..=STEPS {
        // The other half is the mirror image of this one.
        for j in -STEPS..=0 {
            let at = |k: i32, eta: f64| 2.0 * f64::from(k) / f64::from(STEPS) * (0.5 / eta + 1.0 / sharpness).sqrt();
            let (x, y) = (at(j, lobe.eta_x), at(i, lobe.eta_y));
            let angle = x.hypot(y);
            let aside = (lobe.tangent * x + lobe.bitangent * y) / angle.max(1e-300);
            let axis = lobe.axis * angle.cos() + aside * angle.sin();
            if angle > PI || axis.z <= 0.0 {
                continue;
            }
            let weight = if j == 0 { 1.0 } else { 2.0 };
            let exact = glossy_sg_light_exact(alpha, N, view, axis, sharpness, 1e-4);
            squares += weight * exact * exact;
            for (error, form) in errors.iter_mut().zip(forms) {
                *error += weight * (form(alpha, N, view, axis, sharpness) - exact).powi(2);
            }
        }
    }
    errors.map(|error| (error / squares).sqrt())
}

#[test]
fn glossy_forms_are_as_far_off_as_they_say() {
    let forms: [Glossy; 5] = [glossy_sg_light_fast, glossy_sg_light_one, glossy_sg_light_two, glossy_sg_light_three, filtered_ndf_shading];
    // Measured over the axes of `rms`.
    let table: [(f64, f64, f64, [f64; 5]); 13] = [
        (0.02, 10.0, 3.0, [0.148, 0.007, 0.005, 0.003, 0.134]),
        (0.02, 10.0, 30.0, [0.037, 0.043, 0.022, 0.012, 0.193]),
        (0.02, 10.0, 300.0, [0.155, 0.156, 0.036, 0.010, 0.166]),
        (0.02, 10.0, 1e4, [0.259, 0.259, 0.035, 0.007, 0.046]),
        (0.05, 60.0, 3.0, [0.138, 0.026, 0.019, 0.014, 0.132]),
        (0.05, 60.0, 300.0, [0.214, 0.216, 0.037, 0.023, 0.140]),
        (0.15, 60.0, 30.0, [0.212, 0.224, 0.078, 0.077, 0.149]),
        (0.15, 60.0, 1e4, [0.258, 0.258, 0.079, 0.065, 0.027]),
        (0.15, 87.0, 30.0, [0.448, 0.381, 0.264, 0.266, 0.495]),
        (0.15, 87.0, 1e4, [0.348, 0.349, 0.273, 0.267, 0.362]),
        (0.3, 60.0, 300.0, [0.195, 0.192, 0.134, 0.138, 0.136]),
        (0.6, 60.0, 3.0, [0.583, 0.312, 0.481, 0.493, 0.169]),
        (0.6, 60.0, 1e4, [0.337, 0.337, 0.476, 0.489, 0.286]),
    ];
    for (alpha, degrees, sharpness, measured) in table {
        let got = rms(alpha, degrees, sharpness, forms);
        for (got, measured) in got.into_iter().zip(measured) {
            assert!((got - measured).abs() <= 0.0006, "alpha {alpha}, {degrees} degrees, sharpness {sharpness}: {got} not {measured}");
        }
    }
}

#[test]
fn glossy_forms_agree_with_the_published_errors() {
    // The published axes are "around the lobe" and no more is said of them; so 15 % and 0.003. Broad lights are integrated better here than there.
    let forms: [Glossy; 3] = [glossy_sg_light_two, glossy_sg_light_three, filtered_ndf_shading];
    for (alpha, degrees, sharpness, published) in [
        (0.02, 10.0, 3.0, [0.018, 0.017, 0.13]),
        (0.02, 10.0, 30.0, [0.023, 0.013, 0.19]),
        (0.05, 60.0, 3.0, [0.028, 0.025, 0.14]),
        (0.05, 60.0, 30.0, [0.041, 0.025, 0.17]),
        (0.05, 60.0, 300.0, [0.036, 0.022, 0.14]),
        (0.15, 60.0, 300.0, [0.068, 0.064, f64::NAN]),
        (0.15, 87.0, 30.0, [0.25, 0.26, f64::NAN]),
    ] {
        let got = rms(alpha, degrees, sharpness, forms);
        for (got, published) in got.into_iter().zip(published).filter(|(_, published)| !published.is_nan()) {
            assert!(
                got < 1.15 * published + 0.003 && (sharpness < 10.0 || got > 0.85 * published - 0.003),
                "alpha {alpha}, {degrees} degrees, sharpness {sharpness}: {got}, {published}"
            );
        }
    }
}

#[test]
fn glossy_forms_are_finite_and_not_negative_everywhere() {
    let forms: [Glossy; 5] = [glossy_sg_light_fast, glossy_sg_light_one, glossy_sg_light_two, glossy_sg_light_three, filtered_ndf_shading];
    for alpha in [0.001, 0.05, 0.5, 0.500_001, 1.0] {
        for degrees in [0.0, 45.0, 89.999, 90.0, 95.0] {
            for sharpness in [0.0, 1e-6, 1.0, 1e4, 1e8] {
                let view = view(degrees);
                for axis in [N, -N, DVec3::X, DVec3::NEG_X, DVec3::Y, -view, reflection_axis(N, view), direction(1.0, 2.0)] {
                    for form in forms {
                        let value = form(alpha, N, view, axis, sharpness);
                        assert!(value.is_finite() && value >= 0.0, "{alpha} {degrees} {sharpness} {axis}: {value}");
                    }
                }
            }
        }
    }
    // A white sky, reflected by a smooth surface, is white.
    for form in [glossy_sg_light_two as Glossy, glossy_sg_light_three, filtered_ndf_shading] {
        let value = form(0.01, N, view(30.0), N, 1e-6);
        assert!((value - 1.0).abs() < 0.02, "{value}");
    }
}
