// Weights of texels in proportion to the flux that they reflect.

#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_flux, rsm_position, rsm_texel, rsm_texel_uv}
#import lobelia::sampling_density::{density_place, density_side, reflected_flux, storable_weight}
#import lobelia::scene::PunctualLight
#import lobelia::surface::{PackedSurface, load_specular, unpack_surface}

@group(0) @binding(0) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(1) var<storage, read> lights: array<PunctualLight>;
@group(0) @binding(2) var rsm_depth: texture_depth_2d_array;
@group(0) @binding(3) var rsm_core: texture_2d_array<u32>;
#ifdef SPECULAR
@group(0) @binding(4) var rsm_specular: texture_2d_array<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(5) var rsm_geometric_normal: texture_2d_array<u32>;
#endif
@group(0) @binding(6) var weights: texture_storage_2d_array<r32float, write>;

// Luminance of the flux that a texel reflects, estimated, times the weight of its face; 0 where nothing is seen.
fn texel_weight(texel: vec2u, face_index: u32) -> f32 {
    if face_index >= arrayLength(&faces) {
        return 0.0;
    }
    let face = faces[face_index];
    let resolution = face.resolution;
    if any(texel >= vec2u(resolution)) {
        return 0.0;
    }
    let place = rsm_texel(face, texel);
    let depth = textureLoad(rsm_depth, place, face.layer, 0);
    if depth <= 0.0 {
        return 0.0;
    }
    let uv = rsm_texel_uv(texel, resolution);
    let flux = rsm_flux(face, lights[face.light], uv, f32(resolution));
    if max(max(flux.x, flux.y), flux.z) <= 0.0 {
        return 0.0;
    }
    var packed: PackedSurface;
    packed.core = textureLoad(rsm_core, place, face.layer, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(rsm_specular, place, face.layer, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(rsm_geometric_normal, place, face.layer, 0).x;
#endif
    let surface = unpack_surface(packed);
    let to_light = rsm_direction_to_light(face, rsm_position(face, uv, depth));
    return face.weight * reflected_flux(surface, flux, to_light);
}

@compute @workgroup_size(8, 8)
fn weigh(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(weights)) {
        return;
    }
    let place = density_place(id.xy, id.z, textureDimensions(weights).x, density_side(faces[0].resolution));
    textureStore(weights, id.xy, id.z, vec4f(storable_weight(texel_weight(place.texel, place.face)), 0.0, 0.0, 0.0));
}
