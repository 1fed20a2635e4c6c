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
