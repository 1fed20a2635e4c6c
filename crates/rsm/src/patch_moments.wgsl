// Averages of patches: `begin` makes the records of 4 x 4 texels from the map, `merge` those of each coarser level from the one below.

#import lobelia::patch_moments::{PatchMoments, StoredPatchMoments, merge_patch_moments, pack_patch_moments, patch_moments_address, patch_of_texel, unpack_patch_moments}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_texel, rsm_texel_uv}
#import lobelia::scene::PunctualLight
#import lobelia::surface::{PackedSurface, load_specular, unpack_surface}

struct Settings {
    // Texels a side of the finest level, a power of two.
    side: u32,
    faces: u32,
    // The one that is made.
    level: u32,
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
@group(0) @binding(7) var<storage, read_write> moments: array<StoredPatchMoments>;

fn patch_at(texel: vec2u, face_index: u32) -> PatchMoments {
    let face = faces[face_index];
    let resolution = face.resolution;
    var none: PatchMoments;
    if any(texel >= vec2u(resolution)) {
        return none;
    }
    let place = rsm_texel(face, texel);
    let depth = textureLoad(rsm_depth, place, face.layer, 0);
    if depth <= 0.0 {
        return none;
    }
    var packed: PackedSurface;
    packed.core = textureLoad(rsm_core, place, face.layer, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(rsm_specular, place, face.layer, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(rsm_geometric_normal, place, face.layer, 0).x;
#endif
    return patch_of_texel(face, lights[face.light], rsm_texel_uv(texel, resolution), f32(resolution), depth, unpack_surface(packed));
}

fn inside(id: vec3u) -> bool {
    return all(id.xy < vec2u(settings.side >> settings.level));
}

fn store(id: vec3u, parts: array<PatchMoments, 4>) {
    let merged = merge_patch_moments(parts, vec4f(0.25));
    moments[patch_moments_address(settings.side, settings.faces, settings.level, id.xy, id.z)] = pack_patch_moments(merged);
}

@compute @workgroup_size(8, 8)
fn begin(@builtin(global_invocation_id) id: vec3u) {
    if !inside(id) {
        return;
    }
    var quarters: array<PatchMoments, 4>;
    for (var quarter = 0u; quarter < 4u; quarter++) {
        let corner = id.xy * 4u + vec2u(quarter & 1u, quarter >> 1u) * 2u;
        let texels = array<PatchMoments, 4>(
            patch_at(corner, id.z),
            patch_at(corner + vec2u(1u, 0u), id.z),
            patch_at(corner + vec2u(0u, 1u), id.z),
            patch_at(corner + vec2u(1u, 1u), id.z),
        );
        quarters[quarter] = merge_patch_moments(texels, vec4f(0.25));
    }
    store(id, quarters);
}

fn finer(id: vec3u, offset: vec2u) -> PatchMoments {
    return unpack_patch_moments(moments[patch_moments_address(settings.side, settings.faces, settings.level - 1u, id.xy * 2u + offset, id.z)]);
}

@compute @workgroup_size(8, 8)
fn merge(@builtin(global_invocation_id) id: vec3u) {
    if !inside(id) {
        return;
    }
    store(id, array<PatchMoments, 4>(finer(id, vec2u(0u, 0u)), finer(id, vec2u(1u, 0u)), finer(id, vec2u(0u, 1u)), finer(id, vec2u(1u, 1u))));
}
