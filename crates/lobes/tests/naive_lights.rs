//! Why the forms for lights, averages and weights are not simplified: what papers print, in the arithmetic of a shader, beside what stands
//! here instead.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use lobelia_lobes::{averaged_direction::*, lobe_similarity::*, sampling::r2_point, sg_light::*};
use std::f32::consts::PI;

/// Sharpnesses log-uniform in [1e-6, 1e8].
fn sharpness(index: u32, count: u32) -> f32 {
    10f64.powf(14.0 * f64::from(index) / f64::from(count) - 6.0) as f32
}

fn direction([u, v]: [f64; 2]) -> DVec3 {
    let z = 2.0 * u - 1.0;
    let s = (1.0 - z * z).max(0.0).sqrt();
    let azimuth = 2.0 * std::f64::consts::PI * v;
    DVec3::new(s * azimuth.cos(), s * azimuth.sin(), z)
}

fn relative(got: f32, want: f64) -> f64 {
    (f64::from(got) / want - 1.0).abs()
}

/// Rounds to 16-bit floats, to even, with subnormal numbers and infinity.
fn half(x: f32) -> f32 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let exponent = ((x.to_bits() >> 23) & 0xff) as i32 - 127;
    let step = 2f32.powi(exponent.max(-14) - 10);
    let rounded = (x / step).round_ties_even() * step;
    if rounded.abs() > 65504.0 { f32::INFINITY.copysign(x) } else { rounded }
}

fn half_vector(v: Vec3) -> Vec3 {
    Vec3::new(half(v.x), half(v.y), half(v.z))
}

#[test]
fn halves_round_as_they_should() {
    assert_eq!([half(1.0), half(-65504.0), half(0.1)], [1.0, -65504.0, 0.099_975_586]);
    assert_eq!([half(65519.0), half(65520.0), half(-1e6)], [65504.0, f32::INFINITY, f32::NEG_INFINITY]);
    // Ties to even; the least subnormal number is 2^-24.
    assert_eq!([half(1.0 + 2f32.powi(-11)), half(1.0 + 3.0 * 2f32.powi(-11))], [1.0, 1.0 + 2f32.powi(-9)]);
    assert_eq!([half(2f32.powi(-24)), half(0.49 * 2f32.powi(-24)), half(6e-5)], [2f32.powi(-24), 0.0, 1007.0 * 2f32.powi(-24)]);
}

/// R, 1 - R and q in 32 bits, as the shader has them.
fn mean_cosine_32(x: f32) -> (f32, f32, f32) {
    let (length, rest) = if x >= 1.0 {
        let e = (-2.0 * x).exp();
        ((1.0 + e) / (1.0 - e) - 1.0 / x, 1.0 / x - 2.0 * e / (1.0 - e))
    } else {
        let y = x * x;
        let odd = [0.333_333_33, -0.022_222_223, 0.002_116_402, -0.000_211_640_2, 2.137_78e-5, -2.164_404_3e-6, 2.192_594_8e-7];
        let length = x * odd.iter().rev().fold(0.0, |sum, term| sum * y + term);
        (length, 1.0 - length)
    };
    (length, rest, rest * (1.0 + length))
}

fn sharpness_32(length: f32, q: f32) -> f32 {
    let square = length * length;
    length * (3.0 - square + square * q * (-0.128827 + square * (-0.751718 + square * 0.336101))) / q
}

#[test]
fn a_hyperbolic_cotangent_cancels() {
    const COUNT: u32 = 20_000;
    let (mut naive, mut naive_rest, mut stable, mut stable_rest) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
    for index in 0..COUNT {
        let x = sharpness(index, COUNT);
        let exact = (mean_cosine(f64::from(x)), one_minus_mean_cosine(f64::from(x)));
        let cotangent = 1.0 / x.tanh() - 1.0 / x;
        naive = naive.max(relative(cotangent, exact.0));
        naive_rest = naive_rest.max(relative(1.0 - cotangent, exact.1));
        let (length, rest, _) = mean_cosine_32(x);
        stable = stable.max(relative(length, exact.0));
        stable_rest = stable_rest.max(relative(rest, exact.1));
    }
    assert!(naive > 1.0, "{naive}");
    assert!(naive_rest > 0.5, "{naive_rest}");
    assert!(stable < 1.2e-6 && stable_rest < 5e-7, "{stable:e} {stable_rest:e}");
}

/// Only the length subtracted from 1 is needed to lose every sharp lobe.
#[test]
fn a_sharpness_from_the_length_alone_is_lost() {
    const COUNT: u32 = 5000;
    let (mut stored, mut subtracted) = (0.0f64, 0.0f64);
    for index in 0..COUNT {
        let x = sharpness(index, COUNT);
        let (length, _, q) = mean_cosine_32(x);
        stored = stored.max(relative(sharpness_32(length, q), f64::from(x)));
        subtracted = subtracted.max(relative(sharpness_32(length, 1.0 - length * length), f64::from(x)));
    }
    assert!(stored < 1.05e-3, "{stored}");
    assert!(subtracted > 0.5, "{subtracted}");
}

#[test]
fn a_mean_vector_in_halves_loses_its_sharpness() {
    // The recovered sharpness is this far off, as a share: 3 % at 100, 38 % at 1000, nothing left at 10 000.
    for (x, at_least, at_most) in [(100.0f64, 0.005, 0.1), (1e3, 0.1, 2.0)] {
        let mut worst = [0.0f64; 2];
        for index in 0..2000 {
            let axis = direction(r2_point(index, 1));
            let (length, q) = (mean_cosine(x), one_minus_mean_cosine_squared(x));
            let stored = half_vector((axis * length).as_vec3()).as_dvec3().length();
            let from_vector = sharpness_from_averaged_direction(stored, 1.0 - stored * stored);
            let from_q = AveragedDirection { axis, one_minus_length_squared: f64::from(half(q as f32)) }.sharpness();
            worst[0] = worst[0].max((from_vector / x - 1.0).abs());
            worst[1] = worst[1].max((from_q / x - 1.0).abs());
        }
        assert!(worst[0] > at_least && worst[0] < at_most, "{x}: {worst:?}");
        assert!(worst[1] < 1.6e-3, "{x}: {worst:?}");
    }
    let lost = (0..2000).filter(|index| {
        let vector = half_vector((direction(r2_point(*index, 1)) * mean_cosine(1e4)).as_vec3());
        vector.length() >= 1.0
    });
    assert!(lost.count() > 400);
    // Beyond 3.2e4 q is below what halves hold in full; the floor keeps it from becoming 0.
    let q = one_minus_mean_cosine_squared(1e8);
    assert_eq!(half(q as f32), 0.0);
    let floor = AveragedDirection { axis: DVec3::Z, one_minus_length_squared: HALF_LEAST_ONE_MINUS_LENGTH_SQUARED };
    assert!((floor.sharpness() / 3.2e4 - 1.0).abs() < 0.01);
    assert!(f64::from(half(HALF_LEAST_ONE_MINUS_LENGTH_SQUARED as f32)) > 2f64.powi(-14));
}

/// How far the sharpness of the mean of 64 lobes about an axis is off after three levels of a mip chain in halves: as mean vectors, and as
/// axis and q.
fn mip_chain(x: f64, axis: DVec3) -> (f64, f64) {
    let lobe = |index: u32| {
        let across = direction(r2_point(index, 2)).cross(axis).normalize();
        (axis + across * (0.5 / x.sqrt()) * f64::from(index % 8) / 8.0).normalize()
    };
    let parts: Vec<_> = (0..64).map(|index| (1.0, AveragedDirection::of_lobe(lobe(index), x))).collect();
    let exact = merge_averaged_directions(&parts).sharpness();
    let store = |part: AveragedDirection| AveragedDirection {
        axis: half_vector(part.axis.as_vec3()).as_dvec3().normalize(),
        one_minus_length_squared: f64::from(half(part.one_minus_length_squared as f32)),
    };
    let merge = |four: &[AveragedDirection]| merge_averaged_directions(&four.iter().map(|part| (1.0, *part)).collect::<Vec<_>>());
    let mut pairs: Vec<AveragedDirection> = parts.iter().map(|(_, part)| store(*part)).collect();
    let mut vectors: Vec<Vec3> = parts.iter().map(|(_, part)| half_vector((part.axis * part.length()).as_vec3())).collect();
    while pairs.len() > 1 {
        pairs = pairs.chunks(4).map(|four| store(merge(four))).collect();
        vectors = vectors.chunks(4).map(|four| half_vector(four.iter().sum::<Vec3>() / 4.0)).collect();
    }
    let length = vectors[0].as_dvec3().length().min(1.0);
    let from_vector = sharpness_from_averaged_direction(length, 1.0 - length * length);
    ((from_vector / exact - 1.0).abs(), (pairs[0].sharpness() / exact - 1.0).abs())
}

#[test]
fn a_mip_chain_of_halves_keeps_axis_and_q() {
    for (x, vector_at_least, pair_at_most) in [(10.0f64, 1e-3, 1e-3), (100.0, 0.01, 1.5e-3), (1e3, 0.2, 2e-3), (1e4, 0.9, 4e-3)] {
        let (mut vector, mut pair) = (0.0f64, 0.0f64);
        for index in 0..40 {
            let found = mip_chain(x, direction(r2_point(index, 9)));
            vector = vector.max(found.0);
            pair = pair.max(found.1);
        }
        println!("{x}: {vector} {pair}");
        assert!(vector > vector_at_least, "{x}: {vector}");
        assert!(pair < pair_at_most, "{x}: {pair}");
    }
}

#[test]
fn a_difference_of_squares_has_no_variance() {
    // Distance from the origin, and how wrong the printed difference is at least: in 32 bits and in 16 (relative, or not a number).
    for (origin, single, narrow) in [(10.0f32, 3e-4, 3.0), (100.0, 0.03, 100.0), (1000.0, 3.0, f64::INFINITY)] {
        let mut worst = [0.0f64; 4];
        let mut negative = 0;
        for trial in 0..200u32 {
            let at = |index: u32| {
                let [u, v] = r2_point(index, trial);
                let (radius, angle) = (0.1 * u.sqrt(), 2.0 * std::f64::consts::PI * v);
                Vec3::new(0.947 * origin, 0.291 * origin, 0.137 * origin)
                    + Vec3::new((radius * angle.cos()) as f32, (radius * angle.sin()) as f32, 0.0)
            };
            let points: Vec<Vec3> = (0..16).map(at).collect();
            let set = |points: &[Vec3]| -> f64 {
                let parts: Vec<_> = points.iter().map(|x| (1.0, PositionVariance { mean: x.as_dvec3(), variance: 0.0 })).collect();
                merge_position_variance(&parts).variance
            };
            let exact = set(&points);
            let mean = |points: &[Vec3]| points.iter().sum::<Vec3>() / points.len() as f32;
            let squares = |points: &[Vec3]| points.iter().map(|x| x.length_squared()).sum::<f32>() / points.len() as f32;
            worst[0] = worst[0].max(relative(squares(&points) - mean(&points).length_squared(), exact));
            // Halves: both means are stored.
            let halves: Vec<Vec3> = points.iter().map(|x| half_vector(*x)).collect();
            let stored = half(squares(&halves)) - half_vector(mean(&halves)).length_squared();
            worst[1] = worst[1].max(relative(stored, exact));
            negative += u32::from(stored < 0.0);
            // Merged, in 32 bits as they stand, and as halves from a local origin.
            let merged = |points: &[Vec3]| {
                let center = mean(&points.iter().map(|x| *x - points[0]).collect::<Vec<_>>());
                points.iter().map(|x| (*x - points[0] - center).length_squared()).sum::<f32>() / points.len() as f32
            };
            worst[2] = worst[2].max(relative(merged(&points), exact));
            let local: Vec<Vec3> = points.iter().map(|x| half_vector(*x - points[0])).collect();
            worst[3] = worst[3].max(relative(half(merged(&local)), exact));
        }
        assert!(worst[0] > single && worst[1] >= narrow, "{origin}: {worst:?}");
        assert!(worst[2] < 1e-6 && worst[3] < 3e-3, "{origin}: {worst:?}");
        assert!(origin != 100.0 || negative > 20, "{origin}: {negative}");
    }
}

#[test]
fn one_minus_a_cosine_has_no_solid_angle() {
    for (radius, wrong) in [(1e-2f32, 1e-4), (1e-3, 0.01), (1e-5, 0.99)] {
        let h = (1.0 + radius * radius).sqrt();
        let want = cone_solid_angle(1.0, f64::from(radius));
        assert!(relative(2.0 * PI * (1.0 - 1.0 / h), want) > wrong, "{radius}");
        assert!(relative(2.0 * PI * (radius / h) * (radius / (h + 1.0)), want) < 1e-6, "{radius}");
    }
}

/// The chain of a paper: the cone as an SG, its product with the lobe, that with the ASG, over the area of the disk; in 32 bits.
fn vsgl_chain_32(eta: [f32; 2], lobe_axis: Vec3, lobe_sharpness: f32, light: Vec3, distance: f32, radius: f32) -> f32 {
    let h = (distance * distance + radius * radius).sqrt();
    let cone = 2.0 / (1.0 - distance / h);
    let p = lobe_axis * lobe_sharpness + light * cone;
    let sharpness = p.length();
    let (axis, nu) = (p / sharpness, 0.5 * sharpness);
    let amplitude = 2.0 * (sharpness - lobe_sharpness - cone).exp() / (PI * radius * radius);
    let (x, y) = (eta[0] + nu, eta[1] + nu);
    amplitude * PI / (x * y).sqrt() * axis.z.max(0.0) * (-eta[0] * nu / x * axis.x * axis.x - eta[1] * nu / y * axis.y * axis.y).exp()
}

/// The same scaled by the square of the radius.
fn vsgl_scaled_32(eta: [f32; 2], lobe_axis: Vec3, lobe_sharpness: f32, light: Vec3, distance: f32, radius: f32) -> f32 {
    let h = (distance * distance + radius * radius).sqrt();
    let s = 2.0 * h * (h + distance);
    let lobe = lobe_sharpness * radius * radius;
    let p = (lobe_axis * lobe + light * s) / (lobe + s);
    let n = (lobe + s) * p.length();
    let axis = p.normalize();
    let log = -lobe_sharpness * (s / (lobe + s)) * (lobe_axis - light).length_squared() / (1.0 + p.length());
    let (x, y) = (2.0 * eta[0] * radius * radius + n, 2.0 * eta[1] * radius * radius + n);
    let exponent = log - eta[0] * (n / x) * axis.x * axis.x - eta[1] * (n / y) * axis.y * axis.y;
    4.0 * axis.z.max(0.0) / (x.sqrt() * y.sqrt()) * exponent.exp()
}

#[test]
fn dividing_by_the_area_of_a_point_is_no_light() {
    let (lobe_axis, light) = (Vec3::new(0.1, 0.25, 0.9).normalize(), Vec3::new(0.05, 0.3, 0.95).normalize());
    let eta = [40.0, 8.0];
    let want = |radius: f32| vsgl_kernel_fast(eta.map(f64::from), lobe_axis.as_dvec3(), 30.0, light.as_dvec3(), 2.0, f64::from(radius));
    assert!(!vsgl_chain_32(eta, lobe_axis, 30.0, light, 2.0, 0.0).is_finite());
    for (radius, wrong) in [(1e-3, 0.01), (1e-4, 0.5)] {
        let found = vsgl_chain_32(eta, lobe_axis, 30.0, light, 2.0, radius);
        assert!(found.is_nan() || relative(found, want(radius)) > wrong, "{radius}: {found}");
    }
    // With a large radius the chain holds: it is the same formula.
    assert!(relative(vsgl_chain_32(eta, lobe_axis, 30.0, light, 2.0, 3.0), want(3.0)) < 1e-4);
    for radius in [0.0, 1e-12, 1e-4, 1e-3, 0.1, 3.0, 60.0] {
        assert!(relative(vsgl_scaled_32(eta, lobe_axis, 30.0, light, 2.0, radius), want(radius)) < 5e-6, "{radius}");
    }
}

/// What a device may do with subnormal numbers.
fn flushed(x: f32) -> f32 {
    if x.is_subnormal() { 0.0 } else { x }
}

/// The code form of the weight, in 32 bits.
fn weight_printed_32(i: f32, j: f32, squared: f32, beta: f32) -> f32 {
    let (u, v) = (flushed(i * j), i + j);
    (0.5 * beta * (4.0 * u / flushed(v * v)).ln() - 0.5 * beta * (u / v) * squared).exp()
}

/// The same by the ratio of the sharpnesses.
fn weight_32(i: f32, j: f32, squared: f32, beta: f32) -> f32 {
    let (smallest, largest) = (i.min(j), i.max(j));
    let ratio = smallest / largest;
    let t = (1.0 - ratio) / (1.0 + ratio);
    let widths = if t < 0.6 { (-t * t).ln_1p() } else { (4.0 * ratio / ((1.0 + ratio) * (1.0 + ratio))).ln() };
    (0.5 * beta * widths - 0.5 * beta * smallest / (1.0 + ratio) * squared).exp().min(1.0)
}

#[test]
fn the_code_form_of_the_weight_over_and_underflows() {
    for scale in [2e-38f32, 1e-25, 1e-20, 1e20, 1e30] {
        let (i, j) = (scale, 1.5 * scale);
        let want = lobe_similarity_weight(DVec3::Z, f64::from(i), DVec3::Z, f64::from(j), 20.0);
        let printed = weight_printed_32(i, j, 0.0, 20.0);
        assert!(!(f64::from(printed) - want).abs().is_finite() || (f64::from(printed) - want).abs() > 0.1, "{scale}: {printed} {want}");
        assert!((f64::from(weight_32(i, j, 0.0, 20.0)) - want).abs() < 1.5e-6, "{scale}");
    }
    // Between, both hold, but the printed one exceeds 1.
    let (mut above, mut worst) = (0, 0.0f64);
    for index in 0..5000 {
        let i = 10f64.powf(10.0 * f64::from(index) / 5000.0 - 3.0) as f32;
        let j = i * (1.0 + f64::from(index % 7) * 3e-4) as f32;
        let want = lobe_similarity_weight(DVec3::Z, f64::from(i), DVec3::Z, f64::from(j), 20.0);
        above += u32::from(weight_printed_32(i, j, 0.0, 20.0) > 1.0);
        worst = worst.max((f64::from(weight_32(i, j, 0.0, 20.0)) - want).abs());
        assert!((f64::from(weight_printed_32(i, j, 0.0, 20.0)) - want).abs() < 1e-5);
    }
    assert!(above > 100 && worst < 1.5e-6, "{above} {worst:e}");
    assert!(weight_printed_32(0.0, 0.0, 0.0, 20.0).is_nan());
    assert_eq!(lobe_similarity_weight(DVec3::Z, 0.0, DVec3::X, 0.0, 20.0), 1.0);
}

/// The planar form separates a flat lobe from a broad one, which are alike.
#[test]
fn broad_lobes_are_no_planar_gaussians() {
    for (i, j, planar, exact) in [(1.0, 4.0, 0.800, 0.807), (0.1, 10.0, 0.198, 0.345), (1e-3, 1.0, 0.063, 0.873)] {
        assert!((lobe_similarity(DVec3::Z, i, DVec3::Z, j) - planar).abs() < 6e-4);
        assert!((lobe_similarity_exact(DVec3::Z, i, DVec3::Z, j) - exact).abs() < 6e-4);
    }
}
