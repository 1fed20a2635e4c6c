// Colours in 32 bits.
#define_import_path lobelia::packing

// Colour in [0, 1], 11-11-10 bits, square-root encoded, so that dark colours keep their precision: the square root is off by at most half a step,
// 1/4094 (blue 1/2046). Colours outside are clamped.
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

// 2^exponent for exponents of normal numbers, -126 to 127. exp2 and log2 may be off by some units in the last place; bits are not.
fn power_of_two(exponent: i32) -> f32 {
    return bitcast<f32>(u32(exponent + 127) << 23u);
}

// Non-negative colour with a shared 5-bit exponent and 9-bit mantissas, up to 65408: the rgb9e5 format of OpenGL's EXT_texture_shared_exponent.
// The error of every channel is at most 2^-9 of the largest one, or 2^-25 if that is more.
fn pack_shared_exponent(color: vec3f) -> u32 {
    let clamped = clamp(color, vec3f(0.0), vec3f(65408.0));
    let largest = max(max(clamped.x, clamped.y), clamped.z);
    var exponent = max(i32((bitcast<u32>(largest) >> 23u) & 255u) - 127, -16) + 16;
    // Rounding may carry the largest mantissa to 512, which takes a tenth bit. It cannot at the highest exponent: 65408 is 511 there.
    if u32(largest * power_of_two(24 - exponent) + 0.5) > 511u {
        exponent += 1;
    }
    let mantissa = vec3u(clamped * power_of_two(24 - exponent) + vec3f(0.5));
    return mantissa.x | (mantissa.y << 9u) | (mantissa.z << 18u) | (u32(exponent) << 27u);
}

fn unpack_shared_exponent(packed: u32) -> vec3f {
    let mantissa = vec3f(f32(packed & 511u), f32((packed >> 9u) & 511u), f32((packed >> 18u) & 511u));
    return mantissa * power_of_two(i32(packed >> 27u) - 24);
}
