// Rays against boxes and triangles.
#define_import_path lobelia::intersect

// Whether the segment from `origin` along `direction` (not unit; the segment ends at t = 1) passes the box. `inverse` is 1 / direction with
// zeros replaced by a tiny number, so that no 0 * infinity arises.
fn segment_hits_box(origin: vec3f, inverse: vec3f, box_min: vec3f, box_max: vec3f) -> bool {
    let a = (box_min - origin) * inverse;
    let b = (box_max - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, near.y), max(near.z, 0.0));
    let leave = min(min(far.x, far.y), min(far.z, 1.0));
    // Slack for the rounding of differences, quotients (2.5 units in the last place, says Vulkan) and products: no box that holds a hit may be missed.
    return enter <= leave * 1.000001 + 1e-30;
}

// Whether the segment meets the triangle (corner and two edges) at 0 < t < 1 (Moeller and Trumbore 1997); both sides count.
fn segment_hits_triangle(origin: vec3f, direction: vec3f, corner: vec3f, edge_b: vec3f, edge_c: vec3f) -> bool {
    let p = cross(direction, edge_c);
    let determinant = dot(edge_b, p);
    let s = origin - corner;
    let q = cross(s, edge_b);
    // Compared after multiplying by the determinant's sign, without dividing.
    let sign = select(-1.0, 1.0, determinant >= 0.0);
    let size = abs(determinant);
    let u = dot(s, p) * sign;
    let v = dot(direction, q) * sign;
    let t = dot(edge_c, q) * sign;
    // A hair wider than it is, or rounding would open a gap between triangles that share an edge.
    let slack = 1e-6 * size;
    return size > 0.0 && u >= -slack && v >= -slack && u + v <= size + slack && t > 0.0 && t < size;
}

fn safe_inverse(direction: vec3f) -> vec3f {
    let sign = select(vec3f(-1.0), vec3f(1.0), direction >= vec3f(0.0));
    return 1.0 / (max(abs(direction), vec3f(1e-20)) * sign);
}
