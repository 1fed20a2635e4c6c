// The accessor of sampling densities: picks texels in proportion to their weights. Mirrors `lobelia-frame`'s `SamplingDensity`.
#define_import_path lobelia::sampling_density

#import lobelia::brdf::{albedo_estimate, brdf_from_surface}
#import lobelia::math::luminance
#import lobelia::surface::Surface

// What a texture can hold so that 2^26 of them add up to less than the largest float.
const MOST_SAMPLING_WEIGHT: f32 = 1e28;

struct SampledTexel {
    texel: vec2u,
    face: u32,
    // Of this texel over that of all; 0: nothing can be picked.
    probability: f32,
}

// A weight as it is stored: not negative, not too large; what is not a number counts as 0.
fn storable_weight(weight: f32) -> f32 {
    return select(0.0, min(weight, MOST_SAMPLING_WEIGHT), weight > 0.0);
}

// Luminance of the flux that a surface reflects of the flux from the unit direction `to_light`, estimated. The estimate of the specular albedo may be too
// low; a hundredth of the lobe's scale on top keeps every reflecting texel in play.
fn reflected_flux(surface: Surface, flux: vec3f, to_light: vec3f) -> f32 {
    let albedo = albedo_estimate(brdf_from_surface(surface), max(dot(surface.normal, to_light), 0.0)) + vec3f(0.01 * surface.specular);
    return luminance(flux * albedo);
}

// Texels a side of the finest level of a face, for a map of `resolution` >= 2 texels a side.
fn density_side(resolution: u32) -> u32 {
    return 1u << (32u - countLeadingZeros(resolution - 1u));
}

// Faces along each side of a layer.
fn density_tiles(weights: texture_2d_array<f32>) -> i32 {
    return i32(textureDimensions(weights, 0).x >> (textureNumLevels(weights) - 1u));
}

// Places for faces; those behind the last face have no weight.
fn density_faces(weights: texture_2d_array<f32>) -> i32 {
    let tiles = density_tiles(weights);
    return i32(textureNumLayers(weights)) * tiles * tiles;
}

// A texel of a level, by its place in its face.
fn density_weight(weights: texture_2d_array<f32>, texel: vec2i, face: i32, level: i32) -> f32 {
    let tiles = density_tiles(weights);
    let in_layer = face % (tiles * tiles);
    let side = 1 << (textureNumLevels(weights) - 1u - u32(level));
    return textureLoad(weights, vec2i(in_layer % tiles, in_layer / tiles) * side + texel, face / (tiles * tiles), level).x;
}

// The face and the texel in it of a texel of the finest level of a layer. `side`: see `density_side`.
struct DensityPlace {
    face: u32,
    texel: vec2u,
}

fn density_place(texel: vec2u, layer: u32, layer_side: u32, side: u32) -> DensityPlace {
    let tiles = layer_side / side;
    let tile = texel / side;
    return DensityPlace((layer * tiles + tile.y) * tiles + tile.x, texel % side);
}

// Sum of all weights.
fn sampling_density_total(weights: texture_2d_array<f32>) -> f32 {
    let top = i32(textureNumLevels(weights)) - 1;
    var total = 0.0;
    for (var face = 0; face < density_faces(weights); face++) {
        total += density_weight(weights, vec2i(0), face, top);
    }
    return total;
}

// Splits [0, 1) at `share` and stretches the part that `u` lies in to [0, 1): x is 0 or 1 for the part, y the new number. A part without weight is never
// entered.
fn split_unit(u: f32, first: f32, second: f32) -> vec2f {
    let sum = first + second;
    let place = u * sum;
    let in_first = second <= 0.0 || (first > 0.0 && place < first);
    let stretched = select((place - first) / max(second, 1e-38), place / max(first, 1e-38), in_first);
    return vec2f(select(1.0, 0.0, in_first), clamp(stretched, 0.0, 0.99999994));
}

struct DescendedTexel {
    texel: vec2u,
    weight: f32,
}

// The texel of a face below texel `start` of level `top` that the unit square's point `point` falls on, in proportion to weights. `start` must have a weight.
fn descend_density(weights: texture_2d_array<f32>, start: vec2i, face: i32, top: i32, point: vec2f) -> DescendedTexel {
    var u = point;
    var texel = start;
    var weight = density_weight(weights, start, face, top);
    for (var level = top - 1; level >= 0; level--) {
        texel *= 2;
        let a = density_weight(weights, texel, face, level);
        let b = density_weight(weights, texel + vec2i(1, 0), face, level);
        let c = density_weight(weights, texel + vec2i(0, 1), face, level);
        let d = density_weight(weights, texel + vec2i(1, 1), face, level);
        let across = split_unit(u.x, a + c, b + d);
        let right = across.x > 0.5;
        let upper = select(a, b, right);
        let lower = select(c, d, right);
        let down = split_unit(u.y, upper, lower);
        texel += vec2i(vec2f(across.x, down.x));
        u = vec2f(across.y, down.y);
        weight = select(upper, lower, down.x > 0.5);
    }
    return DescendedTexel(vec2u(texel), weight);
}

// The texel of the unit square's point `u`. Well-spread points give well-spread texels: at every level the square is cut in two, then each half in two.
fn sample_density(weights: texture_2d_array<f32>, point: vec2f) -> SampledTexel {
    let total = sampling_density_total(weights);
    if !(total > 0.0 && total < 3e38) {
        return SampledTexel(vec2u(0u), 0u, 0.0);
    }
    let top = i32(textureNumLevels(weights)) - 1;
    let faces = density_faces(weights);
    var u = point;
    var face = 0;
    var weight = density_weight(weights, vec2i(0), 0, top);
    if faces > 1 {
        let place = u.x * total;
        var before = 0.0;
        while face < faces - 1 && (weight <= 0.0 || place >= before + weight) {
            before += weight;
            face++;
            weight = density_weight(weights, vec2i(0), face, top);
        }
        u.x = clamp((place - before) / max(weight, 1e-38), 0.0, 0.99999994);
    }
    let found = descend_density(weights, vec2i(0), face, top, u);
    return SampledTexel(found.texel, u32(face), found.weight / total);
}
