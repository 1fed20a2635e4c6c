// Constants and small functions whose naive forms fail at the edges of 32-bit floats.
#define_import_path lobelia::math

const PI: f32 = 3.14159265358979;
const INV_PI: f32 = 0.318309886183791;
const TAU: f32 = 6.28318530717959;
// Largest half float: what a radiance texture can hold.
const HALF_MAX: f32 = 65504.0;

fn square(x: f32) -> f32 {
    return x * x;
}

fn fifth_power(x: f32) -> f32 {
    let squared = x * x;
    return squared * squared * x;
}

// e^x - 1 for x below 80, without cancellation: relative error 3e-7. (C's name for it ends in a digit, which names here may not.)
fn exp_minus_one(x: f32) -> f32 {
    if abs(x) < 1.0 {
        return x * decay_mean_series(x);
    }
    return exp(x) - 1.0;
}

// log(1 + x) for x > -1, without cancellation: relative error 4e-7; -69 (the logarithm of 1e-30) from there down. Near 1 the language allows `log` an
// absolute error of 2^-21 only.
fn log_one_plus(x: f32) -> f32 {
    if abs(x) < 0.5 {
        // 2 artanh(s).
        let s = x / (2.0 + x);
        let s2 = s * s;
        return 2.0 * s * (1.0 + s2 * (0.333333333 + s2 * (0.2 + s2 * (0.142857143 + s2 * (0.111111111 + s2 * (0.0909090909 + s2 * (0.0769230769 + s2 * 0.0666666667)))))));
    }
    return log(max(1.0 + x, 1e-30));
}

// Sum of y^k / (k + 1)! for |y| <= 1.
fn decay_mean_series(y: f32) -> f32 {
    return 1 + y * (0.5 + y * (0.166666667 + y * (0.0416666667 + y * (0.00833333333 + y * (0.00138888889 + y * (0.000198412698 + y * (2.48015873e-05 + y * (2.75573192e-06 + y * (2.75573192e-07)))))))));
}

// Mean of e^(-x t) over t in [0, 1]: (1 - e^-x) / x, 1 at 0. For x >= 0; relative error 3e-7.
fn decay_mean(x: f32) -> f32 {
    if x < 1.0 {
        return decay_mean_series(-x);
    }
    return (1.0 - exp(-x)) / x;
}

// Integral of (1 - t) e^(-x t) over t in [0, 1]: (1 - decay_mean(x)) / x, 1/2 at 0. For x >= 0; relative error 5e-7.
fn decay_mean_upper(x: f32) -> f32 {
    if x < 1.0 {
        let y = -x;
        return 0.5 + y * (0.166666667 + y * (0.0416666667 + y * (0.00833333333 + y * (0.00138888889 + y * (0.000198412698 + y * (2.48015873e-05 + y * (2.75573192e-06 + y * (2.75573192e-07 + y * (2.50521084e-08)))))))));
    }
    return (1.0 - decay_mean(x)) / x;
}

// e^-x times the integral of t e^(-x t) over t in [0, 1]: e^-x (decay_mean(x) - e^-x) / x, 1/2 at 0. For x >= 0; relative error 5e-7 + 3e-7 x.
fn decay_mean_lower(x: f32) -> f32 {
    let e = exp(-x);
    if x < 1.0 {
        let y = -x;
        return e * (0.5 + y * (0.333333333 + y * (0.125 + y * (0.0333333333 + y * (0.00694444444 + y * (0.00119047619 + y * (0.000173611111 + y * (2.20458554e-05 + y * (2.48015873e-06 + y * (2.50521084e-07))))))))));
    }
    return e * (decay_mean(x) - e) / x;
}

// Complement of the error function. Relative error 3e-7 + 3e-7 x^2 for x >= 0 (the exponent's rounding), 2e-7 for x < 0.
// The fit t exp(-x^2 + P(t)) is Press et al., Numerical Recipes, section 6.2; 1 - erf(x) would have no correct digit above 4.
fn erfc(x: f32) -> f32 {
    let z = abs(x);
    let t = 1.0 / (1.0 + 0.5 * z);
    let p = -1.26551223 + t * (1.00002368 + t * (0.37409196 + t * (0.09678418 + t * (-0.18628806 + t * (0.27886807 + t * (-1.13520398 + t * (1.48851587 + t * (-0.82215223 + t * 0.17087277))))))));
    let upper = t * exp(p - z * z);
    return select(2.0 - upper, upper, x >= 0.0);
}

// sqrt(pi)/2 erf(x)/x, the mean of e^(-x^2 t^2) over t in [0, 1]; 1 at 0. For x >= 0; relative error 5e-7.
fn erf_mean(x: f32) -> f32 {
    if x < 0.75 {
        let y = -x * x;
        return 1 + y * (0.333333333 + y * (0.1 + y * (0.0238095238 + y * (0.00462962963 + y * (0.000757575758 + y * (0.000106837607 + y * (1.32275132e-05 + y * (1.4589169e-06))))))));
    }
    return 0.886226925 * (1.0 - erfc(x)) / x;
}

// Error function. Relative error 5e-7.
fn erf(x: f32) -> f32 {
    if abs(x) < 0.75 {
        return 1.12837917 * x * erf_mean(abs(x));
    }
    return sign(x) * (1.0 - erfc(abs(x)));
}

// Unit vector along `v`, or `fallback` where `v` is too short (or too long) to have a direction.
// Scaled by the largest component first, so lengths from 1e-30 to 1e30 work.
fn safe_normalize(v: vec3f, fallback: vec3f) -> vec3f {
    let largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if !(largest > 1e-30 && largest < 1e30) {
        return fallback;
    }
    let scaled = v / largest;
    return scaled * inverseSqrt(dot(scaled, scaled));
}

// Relative luminance of linear Rec. 709 colour.
fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}

// Radiance as it is stored: not below zero, not above what a half float holds.
fn storable(radiance: vec3f) -> vec3f {
    return clamp(radiance, vec3f(0.0), vec3f(HALF_MAX));
}

// Any unit vector perpendicular to the unit vector `n` (Duff et al. 2017, Building an Orthonormal Basis, Revisited).
fn perpendicular(n: vec3f) -> vec3f {
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    return vec3f(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x);
}
