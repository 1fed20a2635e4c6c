// Which lights a pixel knows, and where the bits of their visibility stand. Mirrors `lobelia-frame`'s `LightVisibilityShape`.
//
// Passes over pixels and lights run in groups of 8 x 8 invocations. With interleaving k, invocations are dealt out so that a group's pixels share
// one subset of the lights: the picture is taken apart into k x k sub-pictures, each padded to whole groups.
#define_import_path lobelia::light_visibility

struct InterleavedPixel {
    pixel: vec2u,
    // Which of the k^2 subsets.
    subset: u32,
    inside: bool,
}

// The pixel of an invocation. `groups_per_side` is the width of a sub-picture in groups, rounded up.
fn interleaved_pixel(invocation: vec2u, extent: vec2u, interleave: u32) -> InterleavedPixel {
    let side = (((extent + vec2u(interleave - 1u)) / interleave) + vec2u(7u)) / 8u * 8u;
    let sub = invocation / side;
    let pixel = (invocation - sub * side) * interleave + sub;
    return InterleavedPixel(pixel, sub.x + interleave * sub.y, all(pixel < extent) && all(sub < vec2u(interleave)));
}

// Index of light `order` of a subset.
fn interleaved_light(order: u32, subset: u32, interleave: u32) -> u32 {
    return order * interleave * interleave + subset;
}

// Address of word `word` (within its chunk) of a pixel.
fn visibility_address(pixel: vec2u, extent: vec2u, word: u32) -> u32 {
    return word * extent.x * extent.y + pixel.y * extent.x + pixel.x;
}
