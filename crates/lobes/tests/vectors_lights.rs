//! Averaged directions, lights and similarities against reference values of 14 digits.
#![allow(clippy::unwrap_used)]

mod common;

use common::{agrees, close, given, number, records, triple, vector};
use glam::DVec3;
use lobelia_lobes::{averaged_direction::*, lobe_similarity::*, sg::sg_integral, sg_light::*};

#[test]
fn vectors_cone() {
    for r in records("cone") {
        let (distance, radius) = (given(&r, "distance"), given(&r, "radius"));
        // Solid angles of 1e-24 sr count too: no absolute tolerance.
        let equal = |got: f64, key: &str| {
            let want = given(&r, key);
            assert!((got - want).abs() <= 1e-10 * want, "{key} of {r}: {got:e}");
        };
        equal(cone_solid_angle(distance, radius), "solid_angle");
        match number(&r, "sharpness") {
            Some(_) => equal(cone_sharpness(distance, radius), "sharpness"),
            // Infinite for a point.
            None => assert!(cone_sharpness(distance, radius) > 1e30, "{r}"),
        }
        equal(solid_angle_over_disk_area(distance, radius), "solid_angle_over_disk_area");
        equal(cone_energy_ratio(distance, radius), "energy_ratio");
        let visibility = cone_visibility(DVec3::Z, distance, radius);
        if radius > 0.0 {
            equal(visibility.integral() / cone_solid_angle(distance, radius), "energy_ratio");
        }
        // exp(-2 sharpness): 1.17e-6 at a half angle of 45 degrees, 1.8 % at 90.
        let energy = given(&r, "energy_ratio");
        assert!((energy - 1.0).abs() < if radius <= distance { 1.2e-6 } else { 0.0187 }, "{r}");
    }
}

#[test]
fn vectors_vsgl() {
    for r in records("vsgl") {
        let (eta, sharpness) = ([given(&r, "eta_x"), given(&r, "eta_y")], given(&r, "lobe_sharpness"));
        let (lobe_axis, direction) = (vector(&r, "lobe_axis_local"), vector(&r, "light_direction_local"));
        let (distance, radius) = (given(&r, "distance"), given(&r, "radius"));
        close(vsgl_kernel_fast(eta, lobe_axis, sharpness, direction, distance, radius), number(&r, "value").unwrap_or(0.0), &r);
        if let Some(log) = number(&r, "log_value") {
            close(log_vsgl_kernel_fast(eta, lobe_axis, sharpness, direction, distance, radius), log, &r);
        }
        let Some(point) = number(&r, "vpl_value") else { continue };
        close(vsgl_kernel_point(eta, lobe_axis, sharpness, direction, distance, 0.0), point, &r);
        close(vsgl_kernel(eta, lobe_axis, sharpness, direction, distance, 0.0), point, &r);
    }
}

#[test]
fn vectors_position_variance() {
    for r in records("position_variance") {
        let positions: Vec<DVec3> = r["positions"].as_array().unwrap().iter().map(triple).collect();
        let parts = |positions: &[DVec3]| -> Vec<(f64, PositionVariance)> {
            positions.iter().map(|mean| (1.0, PositionVariance { mean: *mean, variance: 0.0 })).collect()
        };
        let merged = merge_position_variance(&parts(&positions));
        let (mean, variance) = (triple(&r["mean"]), given(&r, "variance"));
        assert!((merged.mean - mean).length() <= 1e-12 + 1e-10 * mean.length(), "{r}: {merged:?}");
        let equal = |got: f64, want: f64| assert!((got / want - 1.0).abs() < 1e-10, "{r}: {got:e}");
        equal(merged.variance, variance);
        equal(radius_from_variance(merged.variance), given(&r, "radius"));
        // The same by two levels of a mip chain.
        let blocks: Vec<(f64, PositionVariance)> =
            positions.chunks(4).map(|block| (block.len() as f64, merge_position_variance(&parts(block)))).collect();
        equal(merge_position_variance(&blocks).variance, variance);
    }
}

#[test]
fn vectors_mean_length() {
    for r in records("mean_length") {
        let sharpness = given(&r, "sharpness");
        let equal = |got: f64, key: &str| assert!((got / given(&r, key) - 1.0).abs() < 1e-10, "{key} of {r}: {got:e}");
        equal(mean_cosine(sharpness), "length");
        equal(one_minus_mean_cosine(sharpness), "one_minus_length");
        equal(one_minus_mean_cosine_squared(sharpness), "one_minus_length_squared");
        equal(mean_cosine_toksvig(sharpness), "length_toksvig");
        equal(mean_cosine_banerjee(sharpness), "length_banerjee");
        let (length, q) = (given(&r, "length"), given(&r, "one_minus_length_squared"));
        equal(sharpness_from_averaged_direction_toksvig(length, q), "sharpness_toksvig");
        equal(sharpness_from_averaged_direction_banerjee(length, q), "sharpness_banerjee");
        equal(sharpness_from_averaged_direction(length, q), "sharpness_corrected");
        equal(sharpness_from_averaged_direction_exact(length, q), "sharpness");
        let off = |got: f64| (got / sharpness - 1.0).abs();
        assert!(off(sharpness_from_averaged_direction(length, q)) < 1.05e-3, "{r}");
        assert!(off(sharpness_from_averaged_direction_banerjee(length, q)) < 0.0495, "{r}");
        assert!(off(sharpness_from_averaged_direction_toksvig(length, q)) < 0.67, "{r}");
        // From q alone; the length is lost where q is near 1.
        let stored = AveragedDirection { axis: DVec3::Z, one_minus_length_squared: q };
        assert!(sharpness < 1e-3 || off(stored.sharpness()) < 1.1e-3, "{r}: {}", stored.sharpness());
    }
}

fn pair(angle: f64) -> (DVec3, DVec3) {
    (DVec3::Z, DVec3::new(angle.sin(), 0.0, angle.cos()))
}

#[test]
fn vectors_lobe_similarity() {
    for r in records("lobe_similarity") {
        let kernel = number(&r, "kernel_sharpness").unwrap_or(f64::INFINITY);
        let (i, j) = (smoothed_sharpness(given(&r, "sharpness_i"), kernel), smoothed_sharpness(given(&r, "sharpness_j"), kernel));
        let (axis_i, axis_j) = pair(given(&r, "angle"));
        close(i, given(&r, "smoothed_i"), &r);
        close(j, given(&r, "smoothed_j"), &r);
        let similarity = number(&r, "similarity").unwrap_or(0.0);
        let exact = number(&r, "similarity_exact").unwrap_or(0.0);
        close(lobe_similarity(axis_i, i, axis_j, j), similarity, &r);
        close(lobe_similarity_exact(axis_i, i, axis_j, j), exact, &r);
        let weight = number(&r, "weight").unwrap_or(0.0);
        let beta = given(&r, "beta");
        close(lobe_similarity_weight(axis_i, i, axis_j, j, beta), weight, &r);
        close(lobe_similarity_weight_exact(axis_i, i, axis_j, j, beta), exact.powf(beta), &r);
        close(lobe_similarity_weight_printed(axis_i, i, axis_j, j, beta), weight, &r);
        if i > 0.0 && j > 0.0 {
            // In the plane they are Gaussians of variance 1/sharpness.
            close(gaussian_similarity(1.0 / i, 1.0 / j, (axis_i - axis_j).length_squared(), 2.0), similarity, &r);
        }
        // Exact for sharp lobes, where the chord is the distance in the plane.
        if i.min(j) > 100.0 {
            assert!((similarity - exact).abs() < 3e-3, "{r}");
        }
    }
}

#[test]
fn vectors_diffuse_similarity() {
    let variance = diffuse_weight_variance(DIFFUSE_SIMILARITY_SHARPNESS, 100.0, 20.0);
    assert!((variance - 0.0540447698).abs() < 1e-10, "{variance}");
    for r in records("diffuse_similarity") {
        let (i, j) = pair(given(&r, "angle"));
        close(diffuse_similarity(i, j), given(&r, "similarity"), &r);
        close(diffuse_similarity_of_angle(given(&r, "angle")), given(&r, "similarity"), &r);
        let form = diffuse_similarity_fast(i, j, DIFFUSE_SIMILARITY_SHARPNESS);
        close(form, given(&r, "sg_form"), &r);
        assert!((form - given(&r, "similarity")).abs() < 0.158, "{r}");
        close(diffuse_weight(i, j, variance), given(&r, "weight_beta20_kappa100"), &r);
        let smoothed = smoothed_sharpness(2.0 * DIFFUSE_SIMILARITY_SHARPNESS, 100.0);
        close(lobe_similarity_weight(i, smoothed, j, smoothed, 20.0), given(&r, "weight_beta20_kappa100"), &r);
    }
}

#[test]
fn vectors_sg_smoothing() {
    for r in records("sg_smoothing") {
        let (sharpness, kernel) = (given(&r, "sharpness"), given(&r, "kernel_sharpness"));
        let (axis, direction) = pair(given(&r, "angle"));
        let value = number(&r, "value").unwrap_or(0.0);
        close(smoothed_sg_value_exact(axis, sharpness, kernel, direction), value, &r);
        let smoothed = smoothed_sg(axis, sharpness, kernel);
        close(smoothed.sharpness, given(&r, "approximate_sharpness"), &r);
        assert!(agrees(smoothed.integral(), sg_integral(sharpness), 1e-12), "{r}");
        // Fine for kernels from 20 up: a few percent of the peak.
        if kernel >= 20.0 {
            let peak = smoothed_sg_value_exact(axis, sharpness, kernel, axis);
            assert!((smoothed.evaluate(direction) - value).abs() < 0.05 * peak, "{r}: {}", smoothed.evaluate(direction));
        }
    }
}

#[test]
fn vectors_combined_sharpness_bound() {
    for r in records("combined_sharpness") {
        let bound = combined_sharpness_bound(given(&r, "eta_x"), given(&r, "eta_y"), given(&r, "sharpness"));
        close(bound, given(&r, "bound"), &r);
        let exact = given(&r, "peak_sharpness");
        assert!(bound >= exact * (1.0 - 1e-12) && bound < 5.4 * exact, "{r}");
    }
}

#[test]
fn the_comparison_rejects_a_wrong_value() {
    assert!(std::panic::catch_unwind(|| close(mean_cosine_toksvig(3.0), mean_cosine(3.0), &"Toksvig is not exact")).is_err());
    assert!(!agrees(mean_cosine_banerjee(3.0), mean_cosine(3.0), 1e-10));
    assert!(std::panic::catch_unwind(|| close(f64::NAN, 0.0, &"not a number")).is_err());
}
