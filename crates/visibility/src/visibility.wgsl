// One bit per pixel and virtual light. An invocation traces 32 rays: from one pixel to the lights of one word.

#import lobelia::intersect::{safe_inverse, segment_hits_box, segment_hits_triangle}
#import lobelia::light_visibility::{interleaved_light, interleaved_pixel, visibility_address}
#import lobelia::octahedral::octahedral_unpack
#import lobelia::ray::offset_ray_origin
#import lobelia::scene::{View, scene_position, view_depth}
#import lobelia::virtual_lights::{VirtualLight, virtual_light_normal}

struct Settings {
    light_count: u32,
    interleave: u32,
    node_count: u32,
    padding: u32,
}

// Changes from dispatch to dispatch.
struct Range {
    // Word that invocations with z = 0 trace, and the first word of the chunk that is bound.
    first_word: u32,
    chunk_word: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<uniform> range: Range;
// Words, not floats: links and counts are small integers, which a device may take for denormal floats and flush.
@group(0) @binding(3) var<storage, read> nodes: array<vec4u>;
@group(0) @binding(4) var<storage, read> triangles: array<vec4f>;
@group(0) @binding(5) var<storage, read> virtual_lights: array<VirtualLight>;
@group(0) @binding(6) var gbuffer_depth: texture_depth_2d;
#ifdef NORMAL_MAP
@group(0) @binding(7) var gbuffer_geometric_normal: texture_2d<u32>;
#else
@group(0) @binding(7) var gbuffer_core: texture_2d<u32>;
#endif
@group(0) @binding(8) var<storage, read_write> visibility: array<u32>;

struct SharedLight {
    position: vec3f,
    normal: vec3f,
}

var<workgroup> shared_lights: array<SharedLight, 32>;

fn receiver_normal(pixel: vec2u) -> vec3f {
#ifdef NORMAL_MAP
    return octahedral_unpack(textureLoad(gbuffer_geometric_normal, pixel, 0).x);
#else
    return octahedral_unpack(textureLoad(gbuffer_core, pixel, 0).x);
#endif
}

// Whether anything stands between two points.
fn blocked(start: vec3f, end: vec3f) -> bool {
    let direction = end - start;
    let inverse = safe_inverse(direction);
    var index = 0u;
    while index < settings.node_count {
        let low = nodes[2u * index];
        let high = nodes[2u * index + 1u];
        if segment_hits_box(start, inverse, bitcast<vec3f>(low.xyz), bitcast<vec3f>(high.xyz)) {
            let first = high.w / 16u;
            for (var triangle = first; triangle < first + (high.w & 15u); triangle++) {
                if segment_hits_triangle(start, direction, triangles[3u * triangle].xyz, triangles[3u * triangle + 1u].xyz, triangles[3u * triangle + 2u].xyz) {
                    return true;
                }
            }
            index += 1u;
        } else {
            index = low.w;
        }
    }
    return false;
}

@compute @workgroup_size(8, 8)
fn trace(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let extent = vec2u(view.extent);
    let place = interleaved_pixel(id.xy, extent, settings.interleave);
    let word = range.first_word + id.z;
    if local < 32u {
        let index = interleaved_light(word * 32u + local, place.subset, settings.interleave);
        var entry: SharedLight;
        if index < settings.light_count {
            entry.normal = virtual_light_normal(virtual_lights[index]);
            let position = virtual_lights[index].position;
            entry.position = offset_ray_origin(position, entry.normal, 32.0 * max(max(abs(position.x), abs(position.y)), abs(position.z)));
        }
        shared_lights[local] = entry;
    }
    workgroupBarrier();
    if !place.inside {
        return;
    }
    var bits = 0u;
    let depth = textureLoad(gbuffer_depth, place.pixel, 0);
    if depth > 0.0 {
        let normal = receiver_normal(place.pixel);
        let distance = view_depth(view, depth);
        let surface = scene_position(view, vec2f(place.pixel), depth);
        // Rasterisers place triangles to 1/256 of a pixel: as far off its surface may the point be.
        let footprint = 2.0 * length(view.up) / view.extent.y * distance;
        let start = offset_ray_origin(surface + normal * (footprint / 256.0), normal, 32.0 * distance);
        for (var slot = 0u; slot < 32u; slot++) {
            let light_normal = shared_lights[slot].normal;
            let offset = shared_lights[slot].position - start;
            // Behind either surface nothing is reflected, whatever the bit says.
            if dot(offset, normal) > 0.0 && dot(offset, light_normal) < 0.0 {
                if !blocked(start, shared_lights[slot].position) {
                    bits |= 1u << slot;
                }
            }
        }
    }
    visibility[visibility_address(place.pixel, extent, word - range.chunk_word)] = bits;
}
