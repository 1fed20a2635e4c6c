// Averages of directions and of positions. The length R of a lobe's mean direction gives its sharpness; q = 1 - R^2 is stored beside a unit
// axis, since near R = 1 everything depends on it. The twins in `f64`, with sources and the errors of approximations:
// `crates/lobes/src/averaged_direction.rs`.
#define_import_path lobelia::averaged_direction

// Length of the mean direction of a diffuse lobe, exactly 2/3.
const DIFFUSE_MEAN_COSINE: f32 = 0.666666667;
// The least q that half floats hold with all their digits: a sharpness of 3.2e4.
const HALF_LEAST_ONE_MINUS_LENGTH_SQUARED: f32 = 6.2e-5;
// The least q that the inverses distinguish: a sharpness of 2e8.
const LEAST_ONE_MINUS_LENGTH_SQUARED: f32 = 1e-8;

// A mean direction in the form that can be stored.
struct AveragedDirection {
    // Unit direction of the mean.
    axis: vec3f,
    // One minus the square of the mean's length: 0 (a single direction) to 1 (no direction at all).
    one_minus_length_squared: f32,
}

struct PositionVariance {
    // Mean position, best relative to an origin near by.
    mean: vec3f,
    // Mean squared distance from it.
    variance: f32,
}

// R below a sharpness of 1, where coth x - 1/x cancels.
fn mean_cosine_series(x: f32) -> f32 {
    let y = x * x;
    return x * (0.333333333 + y * (-0.0222222222 + y * (0.00211640212 + y * (-0.000211640212 + y * (2.13777991e-05 + y * (-2.16440428e-06 + y * 2.19259479e-07))))));
}

// Length R of the mean direction of a normalised SG, coth(sharpness) - 1/sharpness: 0 to 1. Relative error 1e-6.
fn mean_cosine(sharpness: f32) -> f32 {
    if sharpness >= 1.0 {
        let e = exp(-2.0 * sharpness);
        return (1.0 + e) / (1.0 - e) - 1.0 / sharpness;
    }
    return mean_cosine_series(sharpness);
}

// 1 - R: 1 to 0. Relative error 1e-6.
fn one_minus_mean_cosine(sharpness: f32) -> f32 {
    if sharpness >= 1.0 {
        let e = exp(-2.0 * sharpness);
        return 1.0 / sharpness - 2.0 * e / (1.0 - e);
    }
    return 1.0 - mean_cosine_series(sharpness);
}

// q = 1 - R^2: 1 to 0. Relative error 1.5e-6.
fn one_minus_mean_cosine_squared(sharpness: f32) -> f32 {
    return one_minus_mean_cosine(sharpness) * (1.0 + mean_cosine(sharpness));
}

// R as Toksvig's inverse has it: up to 0.19 too long, three times too long for flat lobes.
fn mean_cosine_toksvig(sharpness: f32) -> f32 {
    return sharpness / (1.0 + sharpness);
}

// R as Banerjee's inverse has it (Laurijssen's cubic), up to 0.012 off; dearer than the exact mean_cosine. Relative error 2e-6.
fn mean_cosine_banerjee(sharpness: f32) -> f32 {
    // Newton steps in R for broad lobes and in u = 1 - R for sharp ones: each keeps the digits that the other loses.
    if sharpness < 1.0 {
        var r = mean_cosine_series(sharpness);
        for (var step = 0; step < 2; step++) {
            let q = 1.0 - r * r;
            r -= (r * (2.0 + q) - sharpness * q) / (3.0 * q + 2.0 * sharpness * r);
        }
        return r;
    }
    var u = one_minus_mean_cosine(sharpness);
    for (var step = 0; step < 2; step++) {
        let q = u * (2.0 - u);
        u += (2.0 - u * u * (3.0 - u) - sharpness * q) / (3.0 * q + 2.0 * sharpness * (1.0 - u));
    }
    return 1.0 - u;
}

// R of a stored q, which is clamped to [0, 1]. The length is lost as q nears 1, where the lobe is flat.
fn averaged_direction_length(one_minus_length_squared: f32) -> f32 {
    return sqrt(1.0 - clamp(one_minus_length_squared, 0.0, 1.0));
}

// Sharpness of the SG whose mean direction has the length R, given with q = 1 - R^2: Banerjee's form with a correction of this project,
// within 0.10 %. q below 1e-8 counts as that. Rounding adds 2e-6.
fn sharpness_from_averaged_direction(r: f32, one_minus_length_squared: f32) -> f32 {
    let q = max(one_minus_length_squared, LEAST_ONE_MINUS_LENGTH_SQUARED);
    let square = r * r;
    let correction = square * q * (-0.128827 + square * (-0.751718 + square * 0.336101));
    return r * (3.0 - square + correction) / q;
}

// The same by Banerjee et al. 2005: up to 4.9 % too large.
fn sharpness_from_averaged_direction_banerjee(r: f32, one_minus_length_squared: f32) -> f32 {
    return r * (3.0 - r * r) / max(one_minus_length_squared, LEAST_ONE_MINUS_LENGTH_SQUARED);
}

// The same by Toksvig 2005, R / (1 - R): 10 % too small at R = 0.9, 44 % at 0.5, 67 % for flat lobes.
fn sharpness_from_averaged_direction_toksvig(r: f32, one_minus_length_squared: f32) -> f32 {
    return r * (1.0 + r) / max(one_minus_length_squared, LEAST_ONE_MINUS_LENGTH_SQUARED);
}

// The mean direction of a normalised SG.
fn averaged_direction_of_lobe(axis: vec3f, sharpness: f32) -> AveragedDirection {
    return AveragedDirection(axis, one_minus_mean_cosine_squared(sharpness));
}

// Sharpness of the SG with this mean, the length taken from q.
fn averaged_direction_sharpness(direction: AveragedDirection) -> f32 {
    let q = direction.one_minus_length_squared;
    return sharpness_from_averaged_direction(averaged_direction_length(q), q);
}

// |R_a axis_a - R_b axis_b|^2, with the digits of 1 - R where both are sharp.
fn mean_difference_squared(a: AveragedDirection, b: AveragedDirection) -> f32 {
    let short_a = a.one_minus_length_squared / (1.0 + averaged_direction_length(a.one_minus_length_squared));
    let short_b = b.one_minus_length_squared / (1.0 + averaged_direction_length(b.one_minus_length_squared));
    let d = (a.axis - b.axis) - (short_a * a.axis - short_b * b.axis);
    return dot(d, d);
}

// Mean of four averaged directions with weights >= 0, which need not sum to 1. Exact: q is a sum of positive terms, the weighted q and the
// scatter of the means, sum over pairs of w_i w_j |m_i - m_j|^2. Merges of merges with summed weights are the merge of all. Relative error
// of q 2e-6. Without any weight q is 1.
fn merge_averaged_directions(parts: array<AveragedDirection, 4>, weights: vec4f) -> AveragedDirection {
    let a = parts[0];
    let b = parts[1];
    let c = parts[2];
    let d = parts[3];
    let largest = max(max(weights.x, weights.y), max(weights.z, weights.w));
    if !(largest > 0.0) {
        return AveragedDirection(a.axis, 1.0);
    }
    let scaled = weights / largest;
    let w = scaled / (scaled.x + scaled.y + scaled.z + scaled.w);
    let q = vec4f(a.one_minus_length_squared, b.one_minus_length_squared, c.one_minus_length_squared, d.one_minus_length_squared);
    let r = w * sqrt(1.0 - clamp(q, vec4f(0.0), vec4f(1.0)));
    let m = a.axis * r.x + b.axis * r.y + c.axis * r.z + d.axis * r.w;
    let of_a = w.y * mean_difference_squared(a, b) + w.z * mean_difference_squared(a, c) + w.w * mean_difference_squared(a, d);
    let of_b = w.z * mean_difference_squared(b, c) + w.w * mean_difference_squared(b, d);
    let scatter = w.x * of_a + w.y * of_b + w.z * w.w * mean_difference_squared(c, d);
    let m_squared = dot(m, m);
    let axis = select(a.axis, m * inverseSqrt(max(m_squared, 1e-30)), m_squared > 1e-30);
    return AveragedDirection(axis, min(dot(w, q) + scatter, 1.0));
}

fn distance_squared(a: vec3f, b: vec3f) -> f32 {
    let d = a - b;
    return dot(d, d);
}

// Mean and variance of four sets of positions with weights >= 0, which need not sum to 1. Exact: the weighted variances and the scatter of
// the means, no difference of squares. Relative error of the variance 2e-6 for positions as given. Without any weight the first part.
fn merge_position_variance(parts: array<PositionVariance, 4>, weights: vec4f) -> PositionVariance {
    let a = parts[0];
    let b = parts[1];
    let c = parts[2];
    let d = parts[3];
    let largest = max(max(weights.x, weights.y), max(weights.z, weights.w));
    if !(largest > 0.0) {
        return a;
    }
    let scaled = weights / largest;
    let w = scaled / (scaled.x + scaled.y + scaled.z + scaled.w);
    let mean = a.mean + (b.mean - a.mean) * w.y + (c.mean - a.mean) * w.z + (d.mean - a.mean) * w.w;
    let of_a = w.y * distance_squared(a.mean, b.mean) + w.z * distance_squared(a.mean, c.mean) + w.w * distance_squared(a.mean, d.mean);
    let of_b = w.z * distance_squared(b.mean, c.mean) + w.w * distance_squared(b.mean, d.mean);
    let scatter = w.x * of_a + w.y * of_b + w.z * w.w * distance_squared(c.mean, d.mean);
    return PositionVariance(mean, dot(w, vec4f(a.variance, b.variance, c.variance, d.variance)) + scatter);
}

// Radius of the uniform disk with this positional variance.
fn radius_from_variance(variance: f32) -> f32 {
    return sqrt(2.0 * max(variance, 0.0));
}
