// An SG over the upper hemisphere of a surface, plain and weighted by the cosine.
// c: cosine of the angle between axis and normal, s2: its squared sine, best taken from |normal x axis|^2. A: integral of the lobe over the sphere.
// The twins in `f64`, exact forms and sources: `crates/lobes/src/sg_cosine.rs`.
#define_import_path lobelia::sg_cosine

#import lobelia::math::{PI, TAU, decay_mean, decay_mean_lower, decay_mean_upper, erf, erfc}
#import lobelia::sg::sg_integral

fn hemisphere_steepness(sharpness: f32) -> f32 {
    if sharpness > 1.0 {
        let r = 1.0 / sharpness;
        return sharpness * sqrt(r * (0.5 + 0.6517328827 * r) / ((7.2216687799 * r + 1.3418280033) * r + 1.0));
    }
    return sharpness * sqrt((0.5 * sharpness + 0.6517328827) / ((sharpness + 1.3418280033) * sharpness + 7.2216687799));
}

// Integral of G over the hemisphere, accurate: within 0.005 A. Rounding adds 3e-6 of the value above the horizon.
fn hemisphere_integral(sharpness: f32, c: f32) -> f32 {
    let steepness = max(hemisphere_steepness(sharpness), 1e-6);
    let whole = erf(steepness);
    var share = 0.5 + 0.5 * erf(steepness * c) / whole;
    if c < 0.0 && steepness >= 1.0 {
        share = 0.5 * (erfc(-steepness * c) - erfc(steepness)) / whole;
    }
    let e = exp(-sharpness);
    return TAU * decay_mean(sharpness) * (e + (1.0 - e) * clamp(share, 0.0, 1.0));
}

// Integral of G over the hemisphere, fast: A (1 + erf(c sqrt(sharpness/2))) / 2. Within 0.0074 A above sharpness 10, 0.14 A below.
fn hemisphere_integral_fast(sharpness: f32, c: f32) -> f32 {
    return 0.5 * sg_integral(sharpness) * erfc(-c * sqrt(0.5 * sharpness));
}

fn clamped_cosine_steepness(sharpness: f32) -> f32 {
    if sharpness > 1.0 {
        let r = 1.0 / sharpness;
        let squared = r * ((17.0212977817 * r + 2.7360831611) * r + 1.0) / (((76.0878962724 * r + 15.2191562631) * r + 4.0100826729) * r + 1.0);
        return sharpness * sqrt(0.5 * squared);
    }
    let x = sharpness;
    return x * sqrt(0.5 * ((x + 2.7360831611) * x + 17.0212977817) / (((x + 4.0100826729) * x + 15.2191562631) * x + 76.0878962724));
}

// Integral of G max(cos, 0), accurate: within 0.0013 A. Rounding adds 3e-6 of the value above the horizon, 1e-6 A below.
fn clamped_cosine_integral(sharpness: f32, c: f32, s2: f32) -> f32 {
    let t = clamped_cosine_steepness(sharpness);
    let t2 = t * t;
    let tail = exp(-t2 * c * c) * t * s2 * decay_mean(t2 * s2) * 0.282094792;
    let share = clamp(0.5 * (c * erfc(-t * c) + erfc(t)) + tail, 0.0, 1.0);
    let lower = decay_mean_lower(sharpness);
    return TAU * (lower + (decay_mean_upper(sharpness) - lower) * share);
}

// Integral of G max(cos, 0), fast: no error function, within 0.0156 A, positive. A form of this project.
fn clamped_cosine_integral_fast(sharpness: f32, c: f32) -> f32 {
    var fit: f32;
    if sharpness > 1.0 {
        let r = 1.0 / sharpness;
        fit = ((16.0 * r + 2.16346892) * r + 1.19899548) / ((r + 0.50991473) * r + 0.25443469);
    } else {
        fit = (16.0 + sharpness * (2.16346892 + sharpness * 1.19899548)) / (1.0 + sharpness * (0.50991473 + sharpness * 0.25443469));
    }
    let integral = sg_integral(sharpness);
    let horizon_squared = integral * integral / (TAU * sharpness + fit);
    let upper = decay_mean_upper(sharpness);
    let lower = decay_mean_lower(sharpness);
    let mean = PI * (upper + lower);
    let root = sqrt(max(horizon_squared + c * c * (mean * mean - horizon_squared), 0.0));
    return max(PI * (upper - lower) * c + root, TAU * lower);
}

// Integral of G max(cos, 0) with the cosine pulled out at the axis: for sharpness above 100 and away from the horizon, where it is 0.
fn clamped_cosine_integral_constant_cosine(sharpness: f32, c: f32) -> f32 {
    return sg_integral(sharpness) * max(c, 0.0);
}
