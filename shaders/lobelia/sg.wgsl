// Spherical Gaussians (SG), G(w; axis, sharpness) = exp(sharpness (w.axis - 1)), for sharpness in [0, 1e8]; 0 is the constant lobe.
// The twins in `f64`, with sources and the errors of approximations: `crates/lobes/src/sg.rs`.
//
// Angles enter as |w - axis|^2 = 2 (1 - w.axis), which does not cancel and forgives axes that are not quite of unit length. Amplitudes of products are
// logarithms: the product of opposite sharp lobes has an amplitude of exp(-4e8).
#define_import_path lobelia::sg

#import lobelia::math::{PI, TAU, decay_mean}

struct SphericalGaussian {
    axis: vec3f,
    sharpness: f32,
    // Value at the axis.
    amplitude: f32,
}

struct SphericalGaussianProduct {
    axis: vec3f,
    sharpness: f32,
    // Natural logarithm of the value at the axis, at most 0 for lobes of amplitude 1.
    log_amplitude: f32,
}

// Logarithm of sg_evaluate.
fn sg_log_evaluate(axis: vec3f, sharpness: f32, direction: vec3f) -> f32 {
    let d = direction - axis;
    return -0.5 * sharpness * dot(d, d);
}

// exp(-sharpness |direction - axis|^2 / 2). Relative error 2e-6 + 3e-7 x for a value of exp(-x), directions taken as they are; rounding them to 32
// bits costs another 2e-7 sqrt(sharpness).
fn sg_evaluate(axis: vec3f, sharpness: f32, direction: vec3f) -> f32 {
    return exp(sg_log_evaluate(axis, sharpness, direction));
}

// Integral over the sphere, sr: 4 pi at sharpness 0. Relative error 5e-7.
fn sg_integral(sharpness: f32) -> f32 {
    return 4.0 * PI * decay_mean(2.0 * sharpness);
}

// The fast form 2 pi / sharpness, too large by 1/(exp(2 sharpness) - 1): 0.25 % at 3, 16 % at 1. For sharpness > 0.
fn sg_integral_fast(sharpness: f32) -> f32 {
    return TAU / sharpness;
}

// Value of a lobe.
fn sg_value(lobe: SphericalGaussian, direction: vec3f) -> f32 {
    return lobe.amplitude * sg_evaluate(lobe.axis, lobe.sharpness, direction);
}

// The lobe of this shape that integrates to 1 over the sphere.
fn sg_normalized(axis: vec3f, sharpness: f32) -> SphericalGaussian {
    return SphericalGaussian(axis, sharpness, 1.0 / sg_integral(sharpness));
}

// Product of two lobes of amplitude 1. Logarithm of the amplitude x: error 2e-6 + 5e-7 |x|. Sharpness: error 3e-7 of the sum of both.
// The axis is axis_a where the product is constant.
fn sg_product(axis_a: vec3f, sharpness_a: f32, axis_b: vec3f, sharpness_b: f32) -> SphericalGaussianProduct {
    let largest = max(sharpness_a, sharpness_b);
    if !(largest > 0.0) {
        return SphericalGaussianProduct(axis_a, 0.0, 0.0);
    }
    // In units of the larger sharpness, so that nothing overflows.
    let p = axis_a * (sharpness_a / largest) + axis_b * (sharpness_b / largest);
    let p_length = length(p);
    let smallest = min(sharpness_a, sharpness_b);
    let d = axis_a - axis_b;
    let log_amplitude = -smallest * dot(d, d) / (1.0 + smallest / largest + p_length);
    return SphericalGaussianProduct(select(axis_a, p / max(p_length, 1e-30), p_length > 0.0), largest * p_length, log_amplitude);
}

// Logarithm of the integral of the product of two lobes of amplitude 1 over the sphere. Error 2e-6 + 5e-7 |x| for an amplitude of exp(x).
fn log_sg_product_integral(axis_a: vec3f, sharpness_a: f32, axis_b: vec3f, sharpness_b: f32) -> f32 {
    let product = sg_product(axis_a, sharpness_a, axis_b, sharpness_b);
    return product.log_amplitude + log(sg_integral(product.sharpness));
}

// Integral of the product of two lobes of amplitude 1 over the sphere, sr. Exact; relative error 2e-6 + 5e-7 |x|.
fn sg_product_integral(axis_a: vec3f, sharpness_a: f32, axis_b: vec3f, sharpness_b: f32) -> f32 {
    let product = sg_product(axis_a, sharpness_a, axis_b, sharpness_b);
    return exp(product.log_amplitude) * sg_integral(product.sharpness);
}

// The fast form, an SG of either axis: within 2.5 % of the peak over all axes where the sum of sharpnesses is above 10. For a sum > 0.
fn sg_product_integral_fast(axis_a: vec3f, sharpness_a: f32, axis_b: vec3f, sharpness_b: f32) -> f32 {
    let sum = sharpness_a + sharpness_b;
    let d = axis_a - axis_b;
    return TAU / sum * exp(-0.5 * sharpness_a * (sharpness_b / sum) * dot(d, d));
}
