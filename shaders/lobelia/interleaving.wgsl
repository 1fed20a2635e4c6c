// The joint tent filter that brings the subsets of interleaved gathering together: see lobelia::light_visibility for who knows which subset.
//
// Each subset of lights is read from the pixels around that know it, weighted by a tent that falls to zero k pixels away. A box of k x k pixels would
// know every light too, but as each then counts at one place of the block, the result steps with period k: on the glossy box its median squared error
// is 17 times the tent's. Pixels that show another surface do not count; each subset is normalised by itself, so along edges no light is missing that
// one pixel in reach knows.
#define_import_path lobelia::interleaving

struct TentTap {
    // From the pixel that is filtered.
    offset: vec2i,
    // 0: outside the tent.
    weight: f32,
}

// Tap `choice` in [0, 4) of a subset, counted from the pixel's own (0): the up to four pixels of the tent that know a subset lie k apart.
fn tent_tap(subset: i32, choice: i32, side: i32) -> TentTap {
    let offset = vec2i(subset % side, subset / side) - vec2i(side) * vec2i(choice & 1, choice >> 1u);
    return TentTap(offset, f32((side - abs(offset.x)) * (side - abs(offset.y))));
}

// Whether another pixel shows the same surface: a normal within 26 degrees, and no more than a fiftieth of the view depth off the plane.
// `offset`: from this position to the other.
fn same_surface(offset: vec3f, other_normal: vec3f, normal: vec3f, geometric_normal: vec3f, depth: f32) -> bool {
    return dot(other_normal, normal) > 0.9 && abs(dot(offset, geometric_normal)) < 0.02 * depth;
}
