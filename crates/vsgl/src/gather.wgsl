// Gathers virtual spherical Gaussian lights at every pixel.
//
// A workgroup is 8 x 8 pixels that share one subset of the lights. Lights are unpacked once per workgroup, 32 at a time (one word of visibility), into
// workgroup memory. Sums are kept in 32-bit floats, so that any number of dispatches adds up without loss; `resolve` writes the radiance.

#import lobelia::brdf::{Brdf, brdf_from_surface, evaluate_brdf}
#import lobelia::interleaving::{same_surface, tent_tap}
#import lobelia::light_visibility::{interleaved_light, interleaved_pixel, visibility_address}
#import lobelia::math::{safe_normalize, storable}
#import lobelia::sg_light::solid_angle_over_disk_area
#import lobelia::scene::{View, scene_position, view_depth}
#import lobelia::surface::{PackedSurface, Surface, load_specular, unpack_surface}
#import lobelia::virtual_lights::{VirtualLight, VirtualLightLobes, virtual_light_surface}
#import lobelia::vsgl::{SgLight, SgReceiver, sg_light_of_lobes, sg_light_of_point, sg_receiver, vsgl_accurate, vsgl_fast, vsgl_gaussian, vsgl_is_point, vsgl_printed}

struct Settings {
    light_count: u32,
    interleave: u32,
    // 0: visibility is not interleaved, so a light's bit stands at its own index.
    visibility_interleaved: u32,
    // Of bias reduction.
    threshold: f32,
    // Least squared distance that counts, m^2.
    least_distance_squared: f32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

// Changes from dispatch to dispatch.
struct Range {
    // Words of 32 lights of each pixel's subset.
    first_word: u32,
    end_word: u32,
    // First word of the visibility chunk that is bound.
    chunk_word: u32,
    // 1: the sums start here.
    first: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<uniform> range: Range;
@group(0) @binding(3) var<storage, read> virtual_lights: array<VirtualLight>;
@group(0) @binding(4) var gbuffer_depth: texture_depth_2d;
@group(0) @binding(5) var gbuffer_core: texture_2d<u32>;
#ifdef SPECULAR
@group(0) @binding(6) var gbuffer_specular: texture_2d<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(7) var gbuffer_geometric_normal: texture_2d<u32>;
#endif
#ifdef VISIBILITY
@group(0) @binding(8) var<storage, read> visibility: array<u32>;
#endif
#ifdef LOBES
@group(0) @binding(11) var<storage, read> lobes: array<VirtualLightLobes>;
#endif
// Sums so far, as `gather` changes them and as `resolve` reads them.
@group(0) @binding(9) var red: texture_storage_2d<r32float, read_write>;
@group(0) @binding(20) var green: texture_storage_2d<r32float, read_write>;
@group(0) @binding(21) var blue: texture_storage_2d<r32float, read_write>;
@group(0) @binding(22) var gathered_red: texture_2d<f32>;
@group(0) @binding(23) var gathered_green: texture_2d<f32>;
@group(0) @binding(24) var gathered_blue: texture_2d<f32>;
@group(0) @binding(10) var radiance: texture_storage_2d<rgba16float, write>;

struct SharedLight {
    lobes: SgLight,
#ifdef BIAS_REDUCTION
    // The point at the patch's centre.
    flux: vec3f,
    normal: vec3f,
    geometric_normal: vec3f,
    to_source: vec3f,
    brdf: Brdf,
#endif
}

var<workgroup> shared_lights: array<SharedLight, 32>;

fn load_surface(pixel: vec2u) -> Surface {
    var packed: PackedSurface;
    packed.core = textureLoad(gbuffer_core, pixel, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(gbuffer_specular, pixel, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(gbuffer_geometric_normal, pixel, 0).x;
#endif
    return unpack_surface(packed);
}

fn share_light(slot: u32, index: u32) {
    var entry: SharedLight;
    if index < settings.light_count {
        let light = virtual_lights[index];
#ifdef LOBES
        entry.lobes = sg_light_of_lobes(lobes[index], light);
#else
        entry.lobes = sg_light_of_point(light);
#endif
#ifdef BIAS_REDUCTION
        let surface = virtual_light_surface(light);
        entry.flux = light.flux;
        entry.normal = surface.normal;
        entry.geometric_normal = surface.geometric_normal;
        entry.to_source = light.direction_to_source;
        entry.brdf = brdf_from_surface(surface);
#endif
    }
    shared_lights[slot] = entry;
}

#ifdef BIAS_REDUCTION
// The same light as a point, with the reflectance of both ends.
fn point_contribution(slot: u32, receiver: SgReceiver, surface: Surface, direction: vec3f, distance: f32) -> vec3f {
    let cosines = max(dot(surface.normal, direction), 0.0) * max(-dot(shared_lights[slot].geometric_normal, direction), 0.0);
    if cosines <= 0.0 {
        return vec3f(0.0);
    }
    let geometry = cosines * solid_angle_over_disk_area(distance, shared_lights[slot].lobes.radius);
    let emitted = evaluate_brdf(shared_lights[slot].brdf, shared_lights[slot].normal, shared_lights[slot].geometric_normal, shared_lights[slot].to_source, -direction);
    let reflected = evaluate_brdf(receiver.brdf, surface.normal, surface.geometric_normal, direction, receiver.lobe.fixed_direction);
    return min(shared_lights[slot].flux * min(emitted, vec3f(1e14)) * geometry, vec3f(1e20)) * min(reflected, vec3f(1e14));
}
#endif

// What one light adds to the radiance of a surface.
fn contribution(slot: u32, receiver: SgReceiver, surface: Surface) -> vec3f {
#ifdef BIAS_REDUCTION
    let offset = shared_lights[slot].lobes.position - receiver.position;
    let distance = length(offset);
    let is_point = vsgl_is_point(receiver, shared_lights[slot].lobes, distance, settings.threshold);
#ifdef SHOW_POINTS
    return vec3f(select(0.0, 1.0, is_point));
#else
    if is_point {
        return point_contribution(slot, receiver, surface, safe_normalize(offset, surface.normal), distance);
    }
#endif
#endif
#ifdef SHOW_POINTS
    return vec3f(0.0);
#else
#ifdef FORM_PRINTED
    let radiance = vsgl_printed(receiver, shared_lights[slot].lobes);
#else
#ifdef FORM_ACCURATE
    let radiance = vsgl_accurate(receiver, shared_lights[slot].lobes);
#else
#ifdef FORM_GAUSSIAN
    let radiance = vsgl_gaussian(receiver, shared_lights[slot].lobes);
#else
    let radiance = vsgl_fast(receiver, shared_lights[slot].lobes);
#endif
#endif
#endif
    return min(radiance, vec3f(1e28));
#endif
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let extent = vec2u(view.extent);
    let place = interleaved_pixel(id.xy, extent, settings.interleave);
    var depth = 0.0;
    var surface: Surface;
    if place.inside {
        depth = textureLoad(gbuffer_depth, place.pixel, 0);
        surface = load_surface(place.pixel);
    }
    let position = scene_position(view, vec2f(place.pixel), max(depth, 1e-30));
    let to_viewer = safe_normalize(view.position - position, surface.normal);
    let receiver = sg_receiver(position, surface, brdf_from_surface(surface), to_viewer);
    var total = vec3f(0.0);
    for (var word = range.first_word; word < range.end_word; word++) {
        workgroupBarrier();
        if local < 32u {
            share_light(local, interleaved_light(word * 32u + local, place.subset, settings.interleave));
        }
        workgroupBarrier();
        if depth > 0.0 {
#ifdef VISIBILITY
            var bits = 0u;
            if settings.visibility_interleaved == 1u || settings.interleave == 1u {
                bits = visibility[visibility_address(place.pixel, extent, word - range.chunk_word)];
            } else {
                for (var slot = 0u; slot < 32u; slot++) {
                    let index = interleaved_light(word * 32u + slot, place.subset, settings.interleave);
                    if index < settings.light_count {
                        bits |= ((visibility[visibility_address(place.pixel, extent, index / 32u)] >> (index % 32u)) & 1u) << slot;
                    }
                }
            }
#else
            let bits = 0xffffffffu;
#endif
            if bits != 0u {
                for (var slot = 0u; slot < 32u; slot++) {
                    if ((bits >> slot) & 1u) == 1u {
                        total += contribution(slot, receiver, surface);
                    }
                }
            }
        }
    }
    if place.inside {
        var sum = min(total, vec3f(1e30));
        if range.first == 0u {
            let before = vec3f(textureLoad(red, place.pixel).x, textureLoad(green, place.pixel).x, textureLoad(blue, place.pixel).x);
            sum = min(before + total, vec3f(1e30));
        }
        textureStore(red, place.pixel, vec4f(sum.x));
        textureStore(green, place.pixel, vec4f(sum.y));
        textureStore(blue, place.pixel, vec4f(sum.z));
    }
}

// The sum at a pixel, and its depth.
fn gathered(pixel: vec2u) -> vec4f {
    let sum = vec3f(textureLoad(gathered_red, pixel, 0).x, textureLoad(gathered_green, pixel, 0).x, textureLoad(gathered_blue, pixel, 0).x);
    return vec4f(sum, textureLoad(gbuffer_depth, pixel, 0));
}

// Radiance of a pixel: its own sum, or with interleaving the sum over all subsets of the lights by the tent filter of lobelia::interleaving.
@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let extent = vec2u(view.extent);
    if any(id.xy >= extent) {
        return;
    }
    let own = gathered(id.xy);
    var result = own.xyz;
#ifdef INTERLEAVED
    if own.w > 0.0 {
        let side = i32(settings.interleave);
        let surface = load_surface(id.xy);
        let position = scene_position(view, vec2f(id.xy), own.w);
        let distance = view_depth(view, own.w);
        var total = vec3f(0.0);
        var count = 0.0;
        for (var subset = 0; subset < side * side; subset++) {
            var weighted = vec4f(0.0);
            for (var choice = 0; choice < 4; choice++) {
                let tap = tent_tap(subset, choice, side);
                let other = vec2i(id.xy) + tap.offset;
                if tap.weight <= 0.0 || any(other < vec2i(0)) || any(other >= vec2i(extent)) {
                    continue;
                }
                let known = gathered(vec2u(other));
                if known.w <= 0.0 {
                    continue;
                }
                let offset = scene_position(view, vec2f(other), known.w) - position;
                if same_surface(offset, load_surface(vec2u(other)).normal, surface.normal, surface.geometric_normal, distance) {
                    weighted += tap.weight * vec4f(known.xyz, 1.0);
                }
            }
            if weighted.w > 0.0 {
                total += weighted.xyz / weighted.w;
                count += 1.0;
            }
        }
        // The pixel itself always counts, so count > 0.
        result = total * (f32(side * side) / max(count, 1.0));
    }
#endif
    textureStore(radiance, id.xy, vec4f(storable(select(vec3f(0.0), result, own.w > 0.0)), 1.0));
}
