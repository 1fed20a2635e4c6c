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

// Sum of all weights.
fn sampling_density_total(weights: texture_2d_array<f32>) -> f32 {
    let top = i32(textureNumLevels(weights)) - 1;
    var total = 0.0;
    for (var face = 0; face < i32(textureNumLayers(weights)); face++) {
        total += textureLoad(weights, vec2i(0), face, top).x;
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

// The texel below texel `start` of level `top` that the unit square's point `point` falls on, in proportion to weights. `start` must have a weight.
fn descend_density(weights: texture_2d_array<f32>, start: vec2i, face: i32, top: i32, point: vec2f) -> DescendedTexel {
    var u = point;
    var texel = start;
    var weight = textureLoad(weights, start, face, top).x;
    for (var level = top - 1; level >= 0; level--) {
        texel *= 2;
        let a = textureLoad(weights, texel, face, level).x;
        let b = textureLoad(weights, texel + vec2i(1, 0), face, level).x;
        let c = textureLoad(weights, texel + vec2i(0, 1), face, level).x;
        let d = textureLoad(weights, texel + vec2i(1, 1), face, level).x;
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
    let faces = i32(textureNumLayers(weights));
    var u = point;
    var face = 0;
    var weight = textureLoad(weights, vec2i(0), 0, top).x;
    if faces > 1 {
        let place = u.x * total;
        var before = 0.0;
        while face < faces - 1 && (weight <= 0.0 || place >= before + weight) {
            before += weight;
            face++;
            weight = textureLoad(weights, vec2i(0), face, top).x;
        }
        u.x = clamp((place - before) / max(weight, 1e-38), 0.0, 0.99999994);
    }
    let found = descend_density(weights, vec2i(0), face, top, u);
    return SampledTexel(found.texel, u32(face), found.weight / total);
}
