// Well-spread points, the same on every device: all arithmetic is on integers.
#define_import_path lobelia::sampling

// PCG hash (Jarzynski and Olano 2020, Hash Functions for GPU Rendering).
fn hash(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Integer to [0, 1), 24 bits kept so that 1 is never reached.
fn unit_float(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604644775390625e-8;
}

// Point `index` of the R2 sequence (Roberts 2018), shifted by a random vector that `seed` chooses (Cranley-Patterson rotation).
// The multiples of the generators are taken modulo 2^32, so any index keeps all its digits.
fn r2_point(index: u32, seed: u32) -> vec2f {
    let shift = vec2u(hash(seed), hash(seed ^ 0x9e3779b9u));
    return vec2f(unit_float(index * 3242174889u + shift.x), unit_float(index * 2447445413u + shift.y));
}

// Van der Corput sequence in base 2: the bits of `index` mirrored.
fn radical_inverse(index: u32) -> f32 {
    return unit_float(reverseBits(index));
}
