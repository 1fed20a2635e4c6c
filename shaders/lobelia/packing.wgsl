// Colours in 32 bits.
#define_import_path lobelia::packing

// Colour in [0, 1], 11-11-10 bits, square-root encoded, so that dark colours keep their precision: an error of at most 2^-11 (blue 2^-10) in the
// square root.
fn pack_color(color: vec3f) -> u32 {
    let encoded = sqrt(clamp(color, vec3f(0.0), vec3f(1.0)));
    let bits = vec3u(encoded * vec3f(2047.0, 2047.0, 1023.0) + vec3f(0.5));
    return bits.x | (bits.y << 11u) | (bits.z << 22u);
}

fn unpack_color(packed: u32) -> vec3f {
    let bits = vec3f(f32(packed & 2047u), f32((packed >> 11u) & 2047u), f32(packed >> 22u));
    let encoded = bits / vec3f(2047.0, 2047.0, 1023.0);
    return encoded * encoded;
}

// Non-negative colour with a shared 5-bit exponent and 9-bit mantissas, up to 65408; relative error of the largest channel at most 2^-9
// (the rgb9e5 format of OpenGL's EXT_texture_shared_exponent).
fn pack_shared_exponent(color: vec3f) -> u32 {
    let clamped = clamp(color, vec3f(0.0), vec3f(65408.0));
    let largest = max(max(clamped.x, clamped.y), clamped.z);
    var exponent = max(-16.0, floor(log2(max(largest, 1e-30)))) + 16.0;
    if floor(largest / exp2(exponent - 24.0) + 0.5) >= 512.0 {
        exponent += 1.0;
    }
    exponent = clamp(exponent, 0.0, 31.0);
    let mantissa = min(vec3u(clamped / exp2(exponent - 24.0) + vec3f(0.5)), vec3u(511u));
    return mantissa.x | (mantissa.y << 9u) | (mantissa.z << 18u) | (u32(exponent) << 27u);
}

fn unpack_shared_exponent(packed: u32) -> vec3f {
    let mantissa = vec3f(f32(packed & 511u), f32((packed >> 9u) & 511u), f32((packed >> 18u) & 511u));
    return mantissa * exp2(f32(packed >> 27u) - 24.0);
}
