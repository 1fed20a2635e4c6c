// Picks virtual lights from the texels of reflective shadow maps with the points of a low-discrepancy sequence.

#import lobelia::octahedral::octahedral_pack
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_flux, rsm_lifted_position, rsm_texel, rsm_texel_uv}
#import lobelia::sampling::r2_point
#import lobelia::sampling_density::sample_density
#import lobelia::scene::PunctualLight
#import lobelia::surface::{PackedSurface, load_specular, shading_normal_factor, unpack_surface}
#import lobelia::virtual_lights::VirtualLight

struct Settings {
    count: u32,
    seed: u32,
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
@group(0) @binding(8) var<storage, read_write> virtual_lights: array<VirtualLight>;

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

@compute @workgroup_size(64)
fn pick(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= settings.count {
        return;
    }
    var light: VirtualLight;
    light.direction_to_source = vec3f(0.0, 1.0, 0.0);
    light.geometric_normal = octahedral_pack(vec3f(0.0, 1.0, 0.0));
    let sample = sample_density(weights, r2_point(id.x, settings.seed));
    let face = faces[sample.face];
    let depth = textureLoad(rsm_depth, rsm_texel(face, sample.texel), face.layer, 0);
    if sample.probability <= 0.0 || depth <= 0.0 {
        virtual_lights[id.x] = light;
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
    virtual_lights[id.x] = light;
}
