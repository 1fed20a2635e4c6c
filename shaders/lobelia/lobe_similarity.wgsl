// How alike two lobes are, as the weight of a filter: both smoothed by a kernel, normalised in L2, multiplied and integrated; 1 for equal
// lobes. Sharpnesses in [0, 1e8]; a kernel of INFINITE_KERNEL does not smooth. The twins in `f64`, with sources and the errors of
// approximations: `crates/lobes/src/lobe_similarity.rs`.
#define_import_path lobelia::lobe_similarity

#import lobelia::math::{INV_PI, PI, decay_mean, log_one_plus, safe_normalize}
#import lobelia::sg::{SphericalGaussian, sg_integral, sg_product, sg_product_integral}
#import lobelia::asg::AnisotropicSphericalGaussian

const INFINITE_KERNEL: f32 = 1e30;
// Sharpness of the SG that stands for the similarity of diffuse lobes: as printed, and the best for a power of 20.
const DIFFUSE_SIMILARITY_SHARPNESS: f32 = 0.9426;
const DIFFUSE_SIMILARITY_SHARPNESS_BEST: f32 = 0.955;

// Sharpness of an SG smoothed by a normalised SG kernel: 1 / (1/sharpness + 1/kernel_sharpness). Good for kernels of 20 and above.
fn smoothed_sharpness(sharpness: f32, kernel_sharpness: f32) -> f32 {
    let smaller = min(sharpness, kernel_sharpness);
    let larger = max(sharpness, kernel_sharpness);
    return smaller / (1.0 + smaller / max(larger, 1e-30));
}

// An SG of amplitude 1 smoothed by a normalised SG kernel, as an SG of equal integral.
fn smoothed_sg(axis: vec3f, sharpness: f32, kernel_sharpness: f32) -> SphericalGaussian {
    let smoothed = smoothed_sharpness(sharpness, kernel_sharpness);
    return SphericalGaussian(axis, smoothed, sg_integral(sharpness) / sg_integral(smoothed));
}

// Value in a direction of an SG of amplitude 1 smoothed by a normalised SG kernel of at most 1e8, exact.
fn smoothed_sg_value_exact(axis: vec3f, sharpness: f32, kernel_sharpness: f32, direction: vec3f) -> f32 {
    return sg_product_integral(axis, sharpness, direction, kernel_sharpness) / sg_integral(kernel_sharpness);
}

// Similarity of two Gaussians in `dimension` dimensions with variances > 0, exact.
fn gaussian_similarity(variance_i: f32, variance_j: f32, mean_distance_squared: f32, dimension: f32) -> f32 {
    let ratio = min(variance_i, variance_j) / max(variance_i, variance_j);
    return exp(0.5 * dimension * log_width_overlap(ratio) - 0.5 * mean_distance_squared / (variance_i + variance_j));
}

// log(2 sqrt(r) / (1 + r)) for r in (0, 1]: log(1 - t^2) / 2 with t = (1 - r)/(1 + r), which has all digits near r = 1, where
// log(4r/(1+r)^2) has none.
fn log_width_overlap(ratio: f32) -> f32 {
    let t = (1.0 - ratio) / (1.0 + ratio);
    if t < 0.6 {
        return 0.5 * log_one_plus(-t * t);
    }
    let sum = 1.0 + ratio;
    return 0.5 * log(4.0 * ratio / (sum * sum));
}

// log x for x > 0: near 1, where the language promises `log` few digits, by the series.
fn log_of_ratio(x: f32) -> f32 {
    if abs(x - 1.0) < 0.5 {
        return log_one_plus(x - 1.0);
    }
    return log(max(x, 1e-37));
}

// Logarithm of the similarity of two SGs of (smoothed) sharpness, for both above 0.
fn log_lobe_similarity(axis_i: vec3f, smoothed_i: f32, axis_j: vec3f, smoothed_j: f32) -> f32 {
    let smallest = min(smoothed_i, smoothed_j);
    let ratio = smallest / max(smoothed_i, smoothed_j);
    let d = axis_i - axis_j;
    return log_width_overlap(ratio) - 0.5 * smallest / (1.0 + ratio) * dot(d, d);
}

// Similarity of two SGs of (smoothed) sharpness a and b: 2 sqrt(a b) / (a + b) exp(-a b / (a + b) |axis_i - axis_j|^2 / 2); 1 where both
// are 0. Takes lobes below a sharpness of 1 for planar Gaussians, which lobe_similarity_exact does not.
fn lobe_similarity(axis_i: vec3f, smoothed_i: f32, axis_j: vec3f, smoothed_j: f32) -> f32 {
    return lobe_similarity_weight(axis_i, smoothed_i, axis_j, smoothed_j, 1.0);
}

// Similarity of two SGs, exact. Absolute error 3e-6.
fn lobe_similarity_exact(axis_i: vec3f, smoothed_i: f32, axis_j: vec3f, smoothed_j: f32) -> f32 {
    let product = sg_product(axis_i, smoothed_i, axis_j, smoothed_j);
    let widths = sqrt(decay_mean(4.0 * smoothed_i)) * sqrt(decay_mean(4.0 * smoothed_j));
    return min(exp(product.log_amplitude) * decay_mean(2.0 * product.sharpness) / widths, 1.0);
}

// lobe_similarity^beta for beta > 0, at most 1. Absolute error 1e-5 for beta up to 20. 1 where both sharpnesses are 0, 0 where one is.
fn lobe_similarity_weight(axis_i: vec3f, smoothed_i: f32, axis_j: vec3f, smoothed_j: f32, beta: f32) -> f32 {
    if !(min(smoothed_i, smoothed_j) > 0.0) {
        return select(0.0, 1.0, max(smoothed_i, smoothed_j) <= 0.0);
    }
    return min(exp(beta * log_lobe_similarity(axis_i, smoothed_i, axis_j, smoothed_j)), 1.0);
}

// lobe_similarity_exact^beta for beta > 0, at most 1. Absolute error 5e-5 for beta up to 20.
fn lobe_similarity_weight_exact(axis_i: vec3f, smoothed_i: f32, axis_j: vec3f, smoothed_j: f32, beta: f32) -> f32 {
    let product = sg_product(axis_i, smoothed_i, axis_j, smoothed_j);
    let widths = sqrt(decay_mean(4.0 * smoothed_i)) * sqrt(decay_mean(4.0 * smoothed_j));
    return min(exp(beta * (product.log_amplitude + log_of_ratio(decay_mean(2.0 * product.sharpness) / widths))), 1.0);
}

// Arc tangent of y/x for y >= 0 in [0, pi]; absolute error 3e-7, 0 for (0, 0). The language allows its own 4096 units in the last place.
// Coefficients: Abramowitz and Stegun 1964, equation 4.4.49.
fn half_turn_angle(y: f32, x: f32) -> f32 {
    let t = min(y, abs(x)) / max(max(y, abs(x)), 1e-30);
    let z = t * t;
    var angle = t * (1.0 + z * (-0.3333314528 + z * (0.1999355085 + z * (-0.1420889944 + z * (0.1065626393 + z * (-0.0752896400 + z * (0.0429096138 + z * (-0.0161657367 + z * 0.0028662257))))))));
    angle = select(angle, 0.5 * PI - angle, y > abs(x));
    return select(angle, PI - angle, x < 0.0);
}

// Similarity of two diffuse lobes without smoothing, exact: (sin + (pi - angle) cos) / pi, 1 to 0. Absolute error 1e-6.
fn diffuse_similarity(normal_i: vec3f, normal_j: vec3f) -> f32 {
    let sine = length(cross(normal_i, normal_j));
    let cosine = dot(normal_i, normal_j);
    // The rest to a half turn, which is the angle with the opposite normal.
    let rest = half_turn_angle(sine, -cosine);
    return clamp((sine + rest * cosine) * INV_PI, 0.0, 1.0);
}

// The SG form of diffuse_similarity: off by up to 0.16, good near equal normals, which is what counts once it is raised to a power.
fn diffuse_similarity_fast(normal_i: vec3f, normal_j: vec3f, sharpness: f32) -> f32 {
    let d = normal_i - normal_j;
    return exp(-0.5 * sharpness * dot(d, d));
}

// Variance of the Gaussian of normals that the SG form makes of the weight of smoothed diffuse lobes: (2 sharpness + kernel) / (beta
// sharpness kernel).
fn diffuse_weight_variance(sharpness: f32, kernel_sharpness: f32, beta: f32) -> f32 {
    return (2.0 * sharpness / kernel_sharpness + 1.0) / (beta * sharpness);
}

// Weight of two diffuse lobes with diffuse_weight_variance.
fn diffuse_weight(normal_i: vec3f, normal_j: vec3f, variance: f32) -> f32 {
    let d = normal_i - normal_j;
    return exp(-0.5 * dot(d, d) / variance);
}

// The lobe's tangent turned along the shortest way that takes its axis to `mean`.
fn turned_tangent(lobe: AnisotropicSphericalGaussian, mean: vec3f) -> vec3f {
    return lobe.tangent - (lobe.axis + mean) * (dot(lobe.tangent, mean) / max(1.0 + dot(lobe.axis, mean), 1e-6));
}

// Similarity of two ASGs smoothed by a kernel, the cosines left out: planar Gaussians of covariance diag(1/(2 eta)) + 1/kernel_sharpness
// about the mean axis. A form of this project, equal to lobe_similarity for isotropic lobes. Bandwidths below 1e-6 count as that.
fn asg_similarity(i: AnisotropicSphericalGaussian, j: AnisotropicSphericalGaussian, kernel_sharpness: f32) -> f32 {
    return asg_similarity_weight(i, j, kernel_sharpness, 1.0);
}

// asg_similarity^beta for beta > 0, at most 1. Absolute error 1e-6 beta times the ratio of the widest to the narrowest standard deviation.
fn asg_similarity_weight(i: AnisotropicSphericalGaussian, j: AnisotropicSphericalGaussian, kernel_sharpness: f32, beta: f32) -> f32 {
    let mean = safe_normalize(i.axis + j.axis, i.tangent);
    let floor_i = max(vec2f(i.eta_x, i.eta_y), vec2f(1e-6));
    let floor_j = max(vec2f(j.eta_x, j.eta_y), vec2f(1e-6));
    let v_i = 0.5 / floor_i + 1.0 / kernel_sharpness;
    let v_j = 0.5 / floor_j + 1.0 / kernel_sharpness;
    let x_i = turned_tangent(i, mean);
    let y_i = cross(mean, x_i);
    let x_j = turned_tangent(j, mean);
    let y_j = cross(mean, x_j);
    let along_root = dot(x_j, x_i);
    let across_root = dot(x_j, y_i);
    let along = along_root * along_root;
    let across = across_root * across_root;
    // Determinant and adjugate of the sum as sums of positive terms.
    let determinant = v_i.x * v_i.y + v_j.x * v_j.y + v_i.x * (v_j.x * across + v_j.y * along) + v_i.y * (v_j.x * along + v_j.y * across);
    let d = i.axis - j.axis;
    let on_i = vec2f(dot(x_i, d), dot(y_i, d));
    let on_j = vec2f(dot(x_j, d), dot(y_j, d));
    let separation = (dot(v_i.yx, on_i * on_i) + dot(v_j.yx, on_j * on_j)) / determinant;
    let widths = 4.0 * (sqrt(v_i.x * v_i.y) * sqrt(v_j.x * v_j.y)) / determinant;
    return min(exp(0.5 * beta * (log_of_ratio(widths) - separation)), 1.0);
}
