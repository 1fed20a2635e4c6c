// How much of an area light a pixel sees: rays to points of it, weighted by the irradiance that each would send.

#import lobelia::intersect::{safe_inverse, segment_hits_box, segment_hits_triangle}
#import lobelia::octahedral::octahedral_unpack
#import lobelia::ray::offset_ray_origin
#import lobelia::sampling::hash
#import lobelia::scene::{View, scene_position, view_depth}

struct Settings {
    samples: u32,
    seed: u32,
    node_count: u32,
    // Of each light.
    point_count: u32,
}

// Changes from dispatch to dispatch.
struct Range {
    // Light that invocations with z = 0 trace.
    first_light: u32,
    padding_a: u32,
    padding_b: u32,
    padding_c: u32,
}

struct LightPoint {
    position: vec4f,
    // Where it emits to; w 1: to both sides.
    normal: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<uniform> range: Range;
// Words, not floats: links and counts are small integers, which a device may take for denormal floats and flush.
@group(0) @binding(3) var<storage, read> nodes: array<vec4u>;
@group(0) @binding(4) var<storage, read> triangles: array<vec4f>;
@group(0) @binding(5) var<storage, read> points: array<LightPoint>;
@group(0) @binding(6) var gbuffer_depth: texture_depth_2d;
#ifdef NORMAL_MAP
@group(0) @binding(7) var gbuffer_geometric_normal: texture_2d<u32>;
#else
@group(0) @binding(7) var gbuffer_core: texture_2d<u32>;
#endif
@group(0) @binding(8) var share: texture_storage_2d_array<r32float, write>;

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
fn trace(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(share)) {
        return;
    }
    let light = range.first_light + id.z;
    let depth = textureLoad(gbuffer_depth, id.xy, 0);
    var sent = 0.0;
    var seen = 0.0;
    if depth > 0.0 {
        let normal = receiver_normal(id.xy);
        let distance = view_depth(view, depth);
        let surface = scene_position(view, vec2f(id.xy), depth);
        // Rasterisers place triangles to 1/256 of a pixel: as far off its surface may the point be.
        let footprint = 2.0 * length(view.up) / view.extent.y * distance;
        let start = offset_ray_origin(surface + normal * (footprint / 256.0), normal, 32.0 * distance);
        // The points are well spread, and so is any run of them: a pixel has one that begins where chance says.
        let first = hash(id.x ^ hash(id.y ^ hash(light ^ hash(view.frame ^ hash(view.seed + settings.seed)))));
        for (var index = 0u; index < settings.samples; index++) {
            let point = points[light * settings.point_count + (first + index) % settings.point_count];
            let offset = point.position.xyz - start;
            let square = max(dot(offset, offset), 1e-20);
            let from_light = -dot(point.normal.xyz, offset);
            let cosines = max(dot(normal, offset), 0.0) * select(max(from_light, 0.0), abs(from_light), point.normal.w > 0.0);
            let weight = cosines / (square * square);
            if weight > 0.0 {
                sent += weight;
                // To just before the light: what lies in its own plane does not block it.
                if !blocked(start, start + offset * 0.9999) {
                    seen += weight;
                }
            }
        }
    }
    textureStore(share, id.xy, light, vec4f(select(1.0, seen / max(sent, 1e-30), sent > 0.0), 0.0, 0.0, 0.0));
}
