// Unit vectors in two numbers: the octahedral map (Cigolle et al. 2014, A Survey of Efficient Representations for Independent Unit Vectors).
#define_import_path lobelia::octahedral

#import lobelia::math::safe_normalize

// Unit vector to [-1, 1]^2. A zero vector maps to +Z.
fn octahedral_encode(direction: vec3f) -> vec2f {
    let sum = abs(direction.x) + abs(direction.y) + abs(direction.z);
    if !(sum > 0.0) {
        return vec2f(0.0);
    }
    let p = direction.xy / sum;
    let sign = select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(p, (vec2f(1.0) - abs(p.yx)) * sign, direction.z < 0.0);
}

// [-1, 1]^2 to unit vector.
fn octahedral_decode(p: vec2f) -> vec3f {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let sign = select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    let xy = select(p, (vec2f(1.0) - abs(p.yx)) * sign, z < 0.0);
    return safe_normalize(vec3f(xy, z), vec3f(0.0, 0.0, 1.0));
}

// Unit vector in 2 x 16 bits; the error is below 6.5e-5 rad (3 sqrt(2) half steps, in the middle of a face).
fn octahedral_pack(direction: vec3f) -> u32 {
    return pack2x16snorm(octahedral_encode(direction));
}

fn octahedral_unpack(packed: u32) -> vec3f {
    return octahedral_decode(unpack2x16snorm(packed));
}
