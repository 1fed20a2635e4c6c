// Counts bit patterns that must not be there. Everything is integer arithmetic.

struct Settings {
    // 32-bit words in a row, rows, words from the start of one row to the next.
    width: u32,
    height: u32,
    pitch: u32,
    // Words per record.
    stride: u32,
    // Which words (or halves) of a record are floats, and which of these must not be negative.
    floats: vec2u,
    non_negative: vec2u,
    // 1: each word holds two half floats.
    halves: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> words: array<u32>;
@group(0) @binding(2) var<storage, read_write> counts: array<atomic<u32>, 4>;

fn has(mask: vec2u, index: u32) -> bool {
    return ((select(mask.x, mask.y, index >= 32u) >> (index & 31u)) & 1u) == 1u;
}

fn count_one(non_finite: bool, negative: bool, saturated: bool, index: u32) {
    if has(settings.floats, index) {
        if non_finite {
            atomicAdd(&counts[0], 1u);
        } else if negative && has(settings.non_negative, index) {
            atomicAdd(&counts[1], 1u);
        } else if saturated {
            atomicAdd(&counts[2], 1u);
        }
    }
}

fn count_half(bits: u32, index: u32) {
    // 65504 of either sign, the largest half float: what is stored there was cut off.
    count_one((bits & 0x7c00u) == 0x7c00u, bits > 0x8000u, (bits & 0x7fffu) == 0x7bffu, index);
}

@compute @workgroup_size(256)
fn count(@builtin(global_invocation_id) invocation: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let total = settings.width * settings.height;
    for (var at = invocation.x; at < total; at += groups.x * 256u) {
        let column = at % settings.width;
        let word = words[at / settings.width * settings.pitch + column];
        let index = column % settings.stride;
        if settings.halves == 1u {
            count_half(word & 0xffffu, 2u * index);
            count_half(word >> 16u, 2u * index + 1u);
        } else {
            count_one((word & 0x7f800000u) == 0x7f800000u, word > 0x80000000u, false, index);
        }
    }
}
