// Picks virtual spherical Gaussian lights: patches of a reflective shadow map as large as the light's share of the picture, read from averages.

#import lobelia::averaged_direction::radius_from_variance
#import lobelia::math::{INV_PI, safe_normalize}
#import lobelia::microfacet_lobe::reflection_axis
#import lobelia::octahedral::octahedral_pack
#import lobelia::patch_moments::{PatchMoments, StoredPatchMoments, decode_sharpness, merge_patch_moments, patch_moments_address, patch_of_texel, patch_weight, unpack_patch_moments}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_flux, rsm_footprint, rsm_lifted_position, rsm_texel, rsm_texel_uv}
#import lobelia::sampling::r2_point
#import lobelia::sampling_density::{density_weight, sample_density, sampling_density_total}
#import lobelia::scene::PunctualLight
#import lobelia::surface::{PackedSurface, load_specular, shading_normal_factor, unpack_surface}
#import lobelia::virtual_lights::{VirtualLight, VirtualLightLobes}

struct Settings {
    count: u32,
    seed: u32,
    // Texels a side of the finest level, a power of two.
    side: u32,
    faces: u32,
    // Share of the density that a light's patch takes: overlap / count.
    share: f32,
    // Blocks whose variance exceeds this many times that of a flat one do not count.
    edges: f32,
    // Of a light's disk, in units of that of a flat patch of its share.
    least_radius: f32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(2) var<storage, read> lights: array<PunctualLight>;
@group(0) @binding(3) var rsm_depth: texture_depth_2d_array;
@group(0) @binding(4) var rsm_core: texture_2d_array<u32>;
#ifdef SPECULAR
@group(0) @binding(5) var rsm_specular: texture_2d_array<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(6) var rsm_geometric_normal: texture_2d_array<u32>;
#endif
@group(0) @binding(7) var weights: texture_2d_array<f32>;
@group(0) @binding(8) var<storage, read> moments: array<StoredPatchMoments>;
@group(0) @binding(9) var<storage, read_write> virtual_lights: array<VirtualLight>;
@group(0) @binding(10) var<storage, read_write> lobes: array<VirtualLightLobes>;

fn packed_texel(texel: vec2u, face: RsmFace) -> PackedSurface {
    let place = rsm_texel(face, texel);
    var packed: PackedSurface;
    packed.core = textureLoad(rsm_core, place, face.layer, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(rsm_specular, place, face.layer, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(rsm_geometric_normal, place, face.layer, 0).x;
#endif
    return packed;
}

fn patch_at(texel: vec2u, face_index: u32) -> PatchMoments {
    let face = faces[face_index];
    let resolution = face.resolution;
    var none: PatchMoments;
    if any(texel >= vec2u(resolution)) {
        return none;
    }
    let depth = textureLoad(rsm_depth, rsm_texel(face, texel), face.layer, 0);
    if depth <= 0.0 {
        return none;
    }
    let surface = unpack_surface(packed_texel(texel, face));
    return patch_of_texel(face, lights[face.light], rsm_texel_uv(texel, resolution), f32(resolution), depth, surface);
}

// A block of 2^level x 2^level texels.
fn block_at(level: u32, block: vec2u, face: u32) -> PatchMoments {
    if level == 0u {
        return patch_at(block, face);
    }
    if level == 1u {
        let corner = block * 2u;
        return merge_patch_moments(
            array<PatchMoments, 4>(
                patch_at(corner, face),
                patch_at(corner + vec2u(1u, 0u), face),
                patch_at(corner + vec2u(0u, 1u), face),
                patch_at(corner + vec2u(1u, 1u), face),
            ),
            vec4f(0.25),
        );
    }
    return unpack_patch_moments(moments[patch_moments_address(settings.side, settings.faces, level, block, face)]);
}

// The four blocks of a level around a texel, and their shares.
struct Taps {
    corner: vec2i,
    most: vec2i,
    shares: vec4f,
}

fn taps_around(level: u32, texel: vec2u) -> Taps {
    let place = (vec2f(texel) + vec2f(0.5)) / f32(1u << level) - vec2f(0.5);
    let corner = floor(place);
    let f = place - corner;
    let shares = vec4f((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
    return Taps(vec2i(corner), vec2i(i32(settings.side >> level) - 1), shares);
}

fn tap(taps: Taps, index: i32) -> vec2u {
    return vec2u(clamp(taps.corner + vec2i(index & 1, index >> 1u), vec2i(0), taps.most));
}

// A block's share in a patch around a texel: 0 where it lies across an edge or on another surface, so that patches grow along their own surface only.
// `own` is the texel itself, with the spread of normals that its curvature makes over a texel.
fn share_of_surface(block: PatchMoments, own: PatchMoments, level: u32) -> f32 {
    let texels = f32(1u << (2u * level));
    // Spread goes with the square of the side; on a flat surface next to none is left.
    let curved = settings.edges * own.normal.one_minus_length_squared * texels + 1e-3;
    let flat_variance = own.variance * texels;
    let offset = dot(block.position - own.position, own.normal.axis);
    let same = block.variance <= settings.edges * flat_variance
        && offset * offset <= settings.edges * flat_variance * 0.25
        && dot(block.normal.axis, own.normal.axis) > 0.5
        && block.normal.one_minus_length_squared <= curved
        && patch_weight(block) > 0.0;
    return select(0.0, 1.0, same);
}

// Levels that a spline's patch is larger than its block: half the binary logarithm of 3.
const SPLINE_LEVELS: f32 = 0.79248125;
// Of a kernel on the light's own surface, for the patch to be read from it.
const LEAST_SHARE: f32 = 0.05;

struct Around {
    patch_moments: PatchMoments,
    // Mean weight of its texels.
    weight: f32,
    // Of the kernel that lies on the texel's own surface.
    share: f32,
}

// The quadratic B-spline over three blocks, f: place in the middle one. Unlike a bilinear kernel it has the same variance wherever the texel lies in its
// block: a quarter of the block's squared side, as much as a box of three times the area.
fn spline(f: f32) -> vec3f {
    return vec3f(0.5 * (1.0 - f) * (1.0 - f), 0.75 - (f - 0.5) * (f - 0.5), 0.5 * f * f);
}

// The patch around a texel, averaged over 3 x 3 blocks of a level.
fn patch_around(level: u32, texel: vec2u, face: u32, own: PatchMoments) -> Around {
    let place = (vec2f(texel) + vec2f(0.5)) / f32(1u << level);
    let middle = vec2i(floor(place));
    let across = spline(fract(place.x));
    let down = spline(fract(place.y));
    let side = i32(settings.side >> level);
    var rows: array<PatchMoments, 4>;
    var row_shares = vec4f(0.0);
    var weight = 0.0;
    for (var y = 0; y < 3; y++) {
        var blocks: array<PatchMoments, 4>;
        var shares = vec4f(0.0);
        for (var x = 0; x < 3; x++) {
            let block = middle + vec2i(x, y) - vec2i(1);
            if all(block >= vec2i(0)) && all(block < vec2i(side)) {
                blocks[x] = block_at(level, vec2u(block), face);
                shares[x] = across[x] * down[y] * share_of_surface(blocks[x], own, level);
                weight += shares[x] * density_weight(weights, block, i32(face), i32(level));
            }
        }
        row_shares[y] = shares.x + shares.y + shares.z;
        rows[y] = merge_patch_moments(blocks, shares);
    }
    let sum = row_shares.x + row_shares.y + row_shares.z;
    return Around(merge_patch_moments(rows, row_shares), weight / max(sum, 1e-30) / f32(1u << (2u * level)), sum);
}

// Mean weight of a texel in that patch.
fn mean_weight_around(level: u32, texel: vec2u, face: u32) -> f32 {
    let taps = taps_around(level, texel);
    var sum = 0.0;
    for (var index = 0; index < 4; index++) {
        sum += taps.shares[index] * density_weight(weights, vec2i(tap(taps, index)), i32(face), i32(level));
    }
    return sum / f32(1u << (2u * level));
}

@compute @workgroup_size(64)
fn pick(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= settings.count {
        return;
    }
    var light: VirtualLight;
    light.direction_to_source = vec3f(0.0, 1.0, 0.0);
    light.geometric_normal = octahedral_pack(vec3f(0.0, 1.0, 0.0));
    var record: VirtualLightLobes;
    record.normal = light.geometric_normal;
    let sample = sample_density(weights, r2_point(id.x, settings.seed));
    let face = faces[sample.face];
    let depth = textureLoad(rsm_depth, rsm_texel(face, sample.texel), face.layer, 0);
    if sample.probability <= 0.0 || depth <= 0.0 {
        virtual_lights[id.x] = light;
        lobes[id.x] = record;
        return;
    }
    let resolution = face.resolution;
    let uv = rsm_texel_uv(sample.texel, resolution);
    let packed = packed_texel(sample.texel, face);
    let surface = unpack_surface(packed);
    light.position = rsm_lifted_position(face, uv, depth, surface.geometric_normal, f32(resolution));
    light.geometric_normal = octahedral_pack(surface.geometric_normal);
    light.direction_to_source = rsm_direction_to_light(face, light.position);
    let flux = rsm_flux(face, lights[face.light], uv, f32(resolution)) * shading_normal_factor(surface, light.direction_to_source);
    light.flux = min(flux / (f32(settings.count) * sample.probability), vec3f(1e24));
#ifdef SPECULAR
    light.specular = packed.specular;
#endif
#ifdef DIELECTRIC
    light.dielectric = packed.dielectric;
#endif
    light.core = packed.core;
    light.source = face.light;

    // Weights over the total, in units of one light's share: how much of the density a patch of one texel takes.
    let total = sampling_density_total(weights);
    let unit = sample.probability / settings.share;
    var level = 0.0;
#ifdef KERNEL_CENTRE
    // As if the density were constant over the patch: 4^level p = share (Krivanek and Colbert 2008).
    level = -0.5 * log2(unit);
#else
    // The level at which the patch itself takes its share: a density that varies makes it neither too wide nor too narrow.
    level = -0.5 * log2(unit);
    let top = firstLeadingBit(settings.side);
    if level > 0.0 {
        var below = unit;
        level = f32(top);
        for (var next = 1u; next <= top; next++) {
            let here = mean_weight_around(next, sample.texel, sample.face) * f32(1u << (2u * next)) / (total * settings.share);
            if here >= 1.0 {
                level = f32(next) - clamp(log(here) / max(log(here / max(below, 1e-30)), 1e-6), 0.0, 1.0);
                break;
            }
            below = here;
        }
    }
#endif
    // The spline's three times wider than its block.
    level = min(level - SPLINE_LEVELS, f32(firstLeadingBit(settings.side)));
    var own = patch_at(sample.texel, sample.face);
    own.normal.one_minus_length_squared = 0.25 * block_at(1u, sample.texel / 2u, sample.face).normal.one_minus_length_squared;
    var chosen = own;
    var weight = sample.probability * total;
    var size = level;
    if level > 0.0 {
        // The largest patch up to that level of which a part is on the light's own surface.
        var whole = u32(level);
        var lower = patch_around(whole, sample.texel, sample.face, own);
        while lower.share < LEAST_SHARE && whole > 0u {
            whole -= 1u;
            size = f32(whole);
            lower = patch_around(whole, sample.texel, sample.face, own);
        }
        chosen = lower.patch_moments;
        weight = lower.weight;
        let part = size - f32(whole);
        if part > 0.0 {
            let upper = patch_around(whole + 1u, sample.texel, sample.face, own);
            if upper.share >= LEAST_SHARE {
                chosen = merge_patch_moments(array<PatchMoments, 4>(chosen, upper.patch_moments, chosen, upper.patch_moments), vec4f(1.0 - part, part, 0.0, 0.0));
                weight = mix(weight, upper.weight, part);
            }
        }
    }
    // Flux over probability, both averaged over the patch: where the density follows the flux every light gets the same, at the borders of what is lit too.
#ifdef KERNEL_CENTRE
    let scale = 1.0 / (f32(settings.count) * sample.probability);
#else
    let scale = total / (f32(settings.count) * max(weight, 1e-37));
#endif
    // Lights that are as likely as their texels are bright, blurred over their patches, make an image of the patches' light that is blurred by half the variance
    // times its second derivative. Drawn to the patch's mean by half the way they lose it again: so much brighter is the brighter side.
    record.position = 0.5 * (own.position + chosen.position);
    // Below the finest level a patch is a part of its texel.
    let texels = exp2(2.0 * (level + SPLINE_LEVELS));
    let footprint = rsm_footprint(face, depth, f32(resolution));
    let stretch = 1.0 / max(dot(surface.geometric_normal, light.direction_to_source), 0.05);
    // A patch that found no room to grow is still the only light of its share of the flux.
    let nominal = footprint * sqrt(texels * stretch * INV_PI);
    record.radius = max(radius_from_variance(chosen.variance * min(texels, 1.0)), settings.least_radius * nominal);
    record.diffuse = min(chosen.diffuse * scale, vec3f(1e24));
    record.normal = octahedral_pack(chosen.normal.axis);
    record.normal_one_minus_length_squared = chosen.normal.one_minus_length_squared;
#ifdef SPECULAR
    record.specular = min(chosen.specular * scale, vec3f(1e24));
    // Directions to the source differ over the patch, and with them the lobes' directions: that is no spread of the lobe at any one place. So the lobe is taken
    // about the mean normal that mirrors source and lobe into each other, and what the source's nearness spreads it by is taken away.
    let to_source = rsm_direction_to_light(face, chosen.position);
    let normal = safe_normalize(chosen.lobe.axis + to_source, surface.normal);
    record.lobe_axis = octahedral_pack(reflection_axis(normal, light.direction_to_source));
    let source_distance = select(distance(face.position, chosen.position), 1e18, face.depth_range != 0.0);
    let nearness = record.radius / max(source_distance, 1e-18);
    let lobe_sharpness = decode_sharpness(chosen.lobe.one_minus_length_squared);
    record.lobe_sharpness = lobe_sharpness / max(1.0 - 0.25 * nearness * nearness * lobe_sharpness, 0.1);
#endif
    light.radius = record.radius;
    virtual_lights[id.x] = light;
    lobes[id.x] = record;
}
