// Picks virtual spherical Gaussian lights: patches of a reflective shadow map as large as the light's share of the picture, read from averages.

#import lobelia::averaged_direction::radius_from_variance
#import lobelia::octahedral::octahedral_pack
#import lobelia::patch_moments::{PatchMoments, StoredPatchMoments, decode_sharpness, merge_patch_moments, patch_moments_address, patch_of_texel, unpack_patch_moments}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_flux, rsm_lifted_position, rsm_texel_uv}
#import lobelia::sampling::r2_point
#import lobelia::sampling_density::{sample_density, sampling_density_total}
#import lobelia::scene::PunctualLight
#import lobelia::surface::{PackedSurface, shading_normal_factor, unpack_surface}
#import lobelia::virtual_lights::{VirtualLight, VirtualLightLobes}

struct Settings {
    count: u32,
    seed: u32,
    // Texels a side of the finest level, a power of two.
    side: u32,
    faces: u32,
    // Share of the density that a light's patch takes: overlap / count.
    share: f32,
    // A patch grows no further where its variance would exceed this many times that of a flat one.
    edges: f32,
    padding_a: u32,
    padding_b: u32,
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

fn packed_texel(texel: vec2u, face: u32) -> PackedSurface {
    var packed: PackedSurface;
    packed.core = textureLoad(rsm_core, texel, face, 0).xy;
#ifdef SPECULAR
    packed.specular = textureLoad(rsm_specular, texel, face, 0).x;
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(rsm_geometric_normal, texel, face, 0).x;
#endif
    return packed;
}

fn patch_at(texel: vec2u, face_index: u32) -> PatchMoments {
    let resolution = textureDimensions(rsm_depth).x;
    var none: PatchMoments;
    if any(texel >= vec2u(resolution)) {
        return none;
    }
    let face = faces[face_index];
    let depth = textureLoad(rsm_depth, texel, face_index, 0);
    if depth <= 0.0 {
        return none;
    }
    let surface = unpack_surface(packed_texel(texel, face_index));
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

// The patch around a texel, averaged bilinearly over blocks of a level.
fn patch_around(level: u32, texel: vec2u, face: u32) -> PatchMoments {
    let taps = taps_around(level, texel);
    return merge_patch_moments(
        array<PatchMoments, 4>(
            block_at(level, tap(taps, 0), face),
            block_at(level, tap(taps, 1), face),
            block_at(level, tap(taps, 2), face),
            block_at(level, tap(taps, 3), face),
        ),
        taps.shares,
    );
}

// Mean weight of a texel in that patch.
fn mean_weight_around(level: u32, texel: vec2u, face: u32) -> f32 {
    let taps = taps_around(level, texel);
    var sum = 0.0;
    for (var index = 0; index < 4; index++) {
        sum += taps.shares[index] * textureLoad(weights, tap(taps, index), face, i32(level)).x;
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
    let depth = textureLoad(rsm_depth, sample.texel, sample.face, 0);
    if sample.probability <= 0.0 || depth <= 0.0 {
        virtual_lights[id.x] = light;
        lobes[id.x] = record;
        return;
    }
    let face = faces[sample.face];
    let resolution = textureDimensions(rsm_depth).x;
    let uv = rsm_texel_uv(sample.texel, resolution);
    let packed = packed_texel(sample.texel, sample.face);
    let surface = unpack_surface(packed);
    light.position = rsm_lifted_position(face, uv, depth, surface.geometric_normal, f32(resolution));
    light.geometric_normal = octahedral_pack(surface.geometric_normal);
    light.direction_to_source = rsm_direction_to_light(face, light.position);
    let flux = rsm_flux(face, lights[face.light], uv, f32(resolution)) * shading_normal_factor(surface, light.direction_to_source);
    light.flux = min(flux / (f32(settings.count) * sample.probability), vec3f(1e24));
#ifdef SPECULAR
    light.specular = packed.specular;
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
    level = min(level, f32(firstLeadingBit(settings.side)));
    let whole = u32(max(floor(level), 0.0));
    let own = patch_at(sample.texel, sample.face);
    var lower = own;
    var lower_level = 0u;
    var part = max(level, 0.0) - f32(whole);
    // Walk up while the patch stays as flat as its texel says: bilinear blocks of a plane have at most four times the variance of their area.
    for (var next = 1u; next <= whole; next++) {
        let candidate = patch_around(next, sample.texel, sample.face);
        if candidate.variance > settings.edges * own.variance * f32(1u << (2u * next)) {
            part = 0.0;
            break;
        }
        lower = candidate;
        lower_level = next;
    }
    var chosen = lower;
    var weight = mean_weight_around(lower_level, sample.texel, sample.face);
    if part > 0.0 && lower_level == whole && whole < firstLeadingBit(settings.side) {
        let upper = patch_around(whole + 1u, sample.texel, sample.face);
        if upper.variance <= settings.edges * own.variance * f32(1u << (2u * (whole + 1u))) {
            chosen = merge_patch_moments(array<PatchMoments, 4>(lower, upper, lower, upper), vec4f(1.0 - part, part, 0.0, 0.0));
            weight = mix(weight, mean_weight_around(whole + 1u, sample.texel, sample.face), part);
        }
    }
    // Flux over probability, both averaged over the patch: where the density follows the flux every light gets the same, at the borders of what is lit too.
#ifdef KERNEL_CENTRE
    let scale = 1.0 / (f32(settings.count) * sample.probability);
#else
    let scale = total / (f32(settings.count) * max(weight, 1e-37));
#endif
    record.position = chosen.position;
    // Below the finest level a patch is a part of its texel.
    record.radius = radius_from_variance(chosen.variance * min(exp2(2.0 * level), 1.0));
    record.diffuse = min(chosen.diffuse * scale, vec3f(1e24));
    record.normal = octahedral_pack(chosen.normal.axis);
    record.normal_one_minus_length_squared = chosen.normal.one_minus_length_squared;
#ifdef SPECULAR
    record.specular = min(chosen.specular * scale, vec3f(1e24));
    record.lobe_axis = octahedral_pack(chosen.lobe.axis);
    record.lobe_sharpness = decode_sharpness(chosen.lobe.one_minus_length_squared);
#endif
    light.radius = record.radius;
    virtual_lights[id.x] = light;
    lobes[id.x] = record;
}
