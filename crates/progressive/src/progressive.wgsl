// The mean of all frames so far, from sums in integers.

#import lobelia::math::HALF_MAX

struct Settings {
    // Frames in the sum once this one is in it.
    frames: u32,
    // 1 if this frame is added, 0 if the sum stands still.
    added: u32,
    // 1 if the sum starts with this frame.
    first: u32,
    // Row of the picture where this part of it begins.
    row: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var source: texture_2d<f32>;
// Three for each pixel of this part, in units of 2^-24; the low word first.
@group(0) @binding(2) var<storage, read_write> sums: array<vec2u>;
@group(0) @binding(3) var radiance: texture_storage_2d<rgba16float, write>;

// A half float in [0, 65504] in units of 2^-24. What is negative or no number counts as 0.
fn units(value: f32) -> vec2u {
    let clamped = select(0.0, min(value, HALF_MAX), value > 0.0);
    let whole = floor(clamped);
    let part = u32((clamped - whole) * 16777216.0);
    return vec2u((u32(whole) << 24u) | part, u32(whole) >> 8u);
}

// The half float next to a value in [0, 65504]. A device may round as it likes when it stores, and one that cuts off would darken the limit by 2^-12.
fn nearest_half(value: f32) -> f32 {
    if value < 6.103515625e-5 {
        return floor(value * 16777216.0 + 0.5) * 5.9604644775390625e-8;
    }
    return min(bitcast<f32>((bitcast<u32>(value) + 0x1000u) & 0xffffe000u), HALF_MAX);
}

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(radiance);
    let place = vec2u(id.x, id.y + settings.row);
    let first = 3u * (id.y * size.x + id.x);
    if any(place >= size) || first >= arrayLength(&sums) {
        return;
    }
    let color = textureLoad(source, place, 0).rgb;
    var mean = vec3f(0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        var sum = vec2u(0u);
        if settings.first == 0u {
            sum = sums[first + channel];
        }
        if settings.added != 0u {
            let term = units(color[channel]);
            let low = sum.x + term.x;
            sum = vec2u(low, sum.y + term.y + u32(low < term.x));
            sums[first + channel] = sum;
        }
        mean[channel] = (f32(sum.y) * 256.0 + f32(sum.x) * 5.9604644775390625e-8) / f32(settings.frames);
    }
    textureStore(radiance, place, vec4f(nearest_half(mean.r), nearest_half(mean.g), nearest_half(mean.b), 1.0));
}
