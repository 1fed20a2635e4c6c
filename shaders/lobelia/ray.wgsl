// Rays that start on a surface.
#define_import_path lobelia::ray

// A point moved off its surface along `normal` (unit), far enough that a ray from it does not meet the surface again, and no farther: by a
// number of units in the last place, so it works near 0 and at a kilometre (Waechter and Binder 2019, A Fast and Robust Method for
// Avoiding Self-Intersection, Ray Tracing Gems, chapter 6). Positions rebuilt from a depth buffer carry its error too, so `distance`, how
// far from the camera or light the position was measured, adds 2^-21 of itself. Near 0, where units are too small to mean anything, it is 2^-16 m, or 2^-14 of that
// distance where a scene is so small that this is less, and never less than 2^-15 of the coordinate.
fn offset_ray_origin(position: vec3f, normal: vec3f, distance: f32) -> vec3f {
    let moved = position + normal * (distance * 4.76837158203125e-7);
    let units = vec3i(normal * 256.0);
    let bits = bitcast<vec3i>(moved) + select(units, -units, moved < vec3f(0.0));
    let least = max(vec3f(min(1.52587890625e-5, distance * 6.103515625e-5)), abs(moved) * 3.0517578125e-5);
    return select(bitcast<vec3f>(bits), moved + normal * least, abs(moved) < vec3f(0.03125));
}
