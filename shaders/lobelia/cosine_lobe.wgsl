// Cosine lobes, max(w.axis, 0)^exponent, for exponents 0 to 1e8: Phong's lobe and, with exponent 1, the clamped cosine of Lambert's law.
// The twins in `f64` and sources: `crates/lobes/src/cosine_lobe.rs`.
#define_import_path lobelia::cosine_lobe

#import lobelia::math::{TAU, exp_minus_one, log_one_plus, safe_normalize}

const LN_TWO: f32 = 0.693147181;

struct CosineLobe {
    axis: vec3f,
    exponent: f32,
    // Value at the axis.
    amplitude: f32,
}

// max(direction.axis, 0)^exponent. Relative error 2e-6 + 6e-7 x for a value of exp(-x), away from the horizon.
fn cosine_lobe_evaluate(axis: vec3f, exponent: f32, direction: vec3f) -> f32 {
    let d = direction - axis;
    let versine = 0.5 * dot(d, d);
    return select(exp(exponent * log_one_plus(-versine)), 0.0, versine >= 1.0);
}

// Integral over the sphere, sr.
fn cosine_lobe_integral(exponent: f32) -> f32 {
    return TAU / (exponent + 1.0);
}

// The lobe that integrates to 1 over the sphere.
fn cosine_lobe_normalized(axis: vec3f, exponent: f32) -> CosineLobe {
    return CosineLobe(axis, exponent, 1.0 / cosine_lobe_integral(exponent));
}

// Sharpness of the nearest SG of equal integral, a fit of this project to 0.003 (0.03 at exponent 0).
fn cosine_lobe_sharpness(exponent: f32) -> f32 {
    let x = min(exponent, 1e9);
    return exponent + 1.25 + 0.109 * x / (x * x - 0.155 * x + 1.72);
}

// Sharpness of the SG that falls to one half at the same angle. ln 2 at 0.
fn cosine_lobe_sharpness_half_maximum(exponent: f32) -> f32 {
    return -LN_TWO / exp_minus_one(-LN_TWO / max(exponent, 1e-3));
}

// Exponent of the cosine lobe that falls to one half where an SG of this sharpness does; 0 up to ln 2.
fn cosine_lobe_exponent_half_maximum(sharpness: f32) -> f32 {
    if sharpness <= LN_TWO {
        return 0.0;
    }
    return -LN_TWO / log_one_plus(-LN_TWO / sharpness);
}

// Product of two lobes as one, through SGs of equal half width; exact at the new axis.
fn cosine_lobe_product(a: CosineLobe, b: CosineLobe) -> CosineLobe {
    let p = a.axis * cosine_lobe_sharpness_half_maximum(a.exponent) + b.axis * cosine_lobe_sharpness_half_maximum(b.exponent);
    let axis = safe_normalize(p, a.axis);
    let value = cosine_lobe_evaluate(a.axis, a.exponent, axis) * cosine_lobe_evaluate(b.axis, b.exponent, axis);
    return CosineLobe(axis, cosine_lobe_exponent_half_maximum(length(p)), a.amplitude * b.amplitude * value);
}
