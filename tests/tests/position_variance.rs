//! The variance of positions far from the origin: merged, and as the textbook's difference of squares, both in 32 bits on the device.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia::graph::testing::{evaluate, gpu};
use lobelia::shaders::Flags;

/// Sixteen points of a patch, merged four by four; and E|x|^2 - |E x|^2.
const BODY: &str = "
#import lobelia::averaged_direction::{PositionVariance, merge_position_variance}
struct Input { origin: vec4f, size: vec4f }
struct Output { merged: f32, difference: f32 }
fn point(input: Input, index: u32) -> vec3f {
    let x = f32(index % 4u) / 3.0 - 0.5;
    let y = f32(index / 4u) / 3.0 - 0.5;
    return input.origin.xyz + vec3f(x, y, 0.3 * x * y) * input.size.x;
}
fn evaluate(input: Input) -> Output {
    var quarters: array<PositionVariance, 4>;
    var sum = vec3f(0.0);
    var squares = 0.0;
    for (var quarter = 0u; quarter < 4u; quarter++) {
        var parts: array<PositionVariance, 4>;
        for (var index = 0u; index < 4u; index++) {
            let place = point(input, quarter * 4u + index);
            parts[index] = PositionVariance(place, 0.0);
            sum += place;
            squares += dot(place, place);
        }
        quarters[quarter] = merge_position_variance(parts, vec4f(1.0));
    }
    let mean = sum / 16.0;
    return Output(merge_position_variance(quarters, vec4f(1.0)).variance, squares / 16.0 - dot(mean, mean));
}";

/// The same of the points as 32 bits hold them.
fn exact(origin: f32, size: f32) -> f64 {
    let points: Vec<DVec3> = (0..16)
        .map(|index| {
            let (x, y) = ((index % 4) as f32 / 3.0 - 0.5, (index / 4) as f32 / 3.0 - 0.5);
            let at = [x, y, 0.3 * x * y].map(|part| origin + part * size);
            DVec3::new(at[0].into(), at[1].into(), at[2].into())
        })
        .collect();
    let mean = points.iter().sum::<DVec3>() / 16.0;
    points.iter().map(|point| point.distance_squared(mean)).sum::<f64>() / 16.0
}

#[test]
fn merging_keeps_its_digits_where_the_difference_loses_them() {
    let Some(gpu) = gpu() else { return };
    for size in [0.1f32, 1.0] {
        for (origin, most, least_of_difference) in [(0.0f32, 1e-6, 0.0), (100.0, 1e-6, 1e-2), (10_000.0, 1e-5, 0.9)] {
            let found: Vec<[f32; 2]> =
                evaluate(gpu, BODY, &Flags::default(), &[[origin, origin, origin, 0.0, size, 0.0, 0.0, 0.0f32]]).unwrap();
            let truth = exact(origin, size);
            let error = |value: f32| (f64::from(value) / truth - 1.0).abs();
            println!(
                "patch {size} m, {origin} m away: merged {:.1e}, difference of squares {:.1e}",
                error(found[0][0]),
                error(found[0][1])
            );
            assert!(error(found[0][0]) < most, "merged, {origin}: {}", error(found[0][0]));
            assert!(size > 0.5 || error(found[0][1]) >= least_of_difference, "difference, {origin}: {}", error(found[0][1]));
        }
    }
}
