// Directions of a hemisphere in a square: the hemi-octahedral map (Cigolle et al. 2014, A Survey of Efficient Representations for Independent Unit
// Vectors).
//
// Points on the map's half octahedron have |x| + |y| + z = 1. Measuring distance by that norm too makes planes easy: on each of the four faces, the
// reciprocal of the distance at which the ray through a point of the square meets a plane is linear in the square's coordinates.
#define_import_path lobelia::hemi_octahedral

// |x| + |y| + z: the distance to the origin that belongs to the map. Lies in [1, sqrt 3] times the usual one.
fn hemi_octahedral_norm(v: vec3f) -> f32 {
    return abs(v.x) + abs(v.y) + v.z;
}

// Direction with z >= 0 (not zero, of any length) to [-1, 1]^2.
fn hemi_octahedral_encode(v: vec3f) -> vec2f {
    let p = v.xy / hemi_octahedral_norm(v);
    return vec2f(p.x + p.y, p.x - p.y);
}

// [-1, 1]^2 to the point of the half octahedron, whose norm is 1.
fn hemi_octahedral_decode(uv: vec2f) -> vec3f {
    let p = 0.5 * vec2f(uv.x + uv.y, uv.x - uv.y);
    return vec3f(p, 1.0 - abs(p.x) - abs(p.y));
}
