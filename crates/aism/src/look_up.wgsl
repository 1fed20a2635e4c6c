// Compares receivers with imperfect shadow maps. An invocation looks 32 lights up: from one pixel those of one word.

#import lobelia::hemi_octahedral::{hemi_octahedral_decode, hemi_octahedral_encode, hemi_octahedral_norm}
#import lobelia::light_visibility::{interleaved_light, interleaved_pixel, visibility_address}
#import lobelia::math::perpendicular
#import lobelia::octahedral::octahedral_unpack
#import lobelia::scene::{View, scene_position}
#import lobelia::virtual_lights::{VirtualLight, virtual_light_normal}

// As in `maps.wgsl`.
struct Settings {
    light_count: u32,
    interleave: u32,
    resolution: u32,
    points: u32,
    triangle_count: u32,
    candidates: u32,
    seed: u32,
    view_samples: u32,
    area: f32,
    spread: f32,
    // Texel widths.
    bias: f32,
    padding: f32,
}

struct Range {
    // The lights whose maps are there.
    first_light: u32,
    end_light: u32,
    // Word that invocations with z = 0 look up, and the first word of the chunk that is bound.
    first_word: u32,
    chunk_word: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<uniform> range: Range;
@group(0) @binding(3) var<storage, read> virtual_lights: array<VirtualLight>;
@group(0) @binding(4) var<storage, read> maps: array<u32>;
@group(0) @binding(5) var gbuffer_depth: texture_depth_2d;
#ifdef NORMAL_MAP
@group(0) @binding(6) var gbuffer_geometric_normal: texture_2d<u32>;
#else
@group(0) @binding(6) var gbuffer_core: texture_2d<u32>;
#endif
@group(0) @binding(7) var<storage, read_write> visibility: array<u32>;

// As in `maps.wgsl`.
const REFERENCE: u32 = 0x80000000u;
const EMPTY: u32 = 0xffffffffu;

struct SharedLight {
    position: vec3f,
    normal: vec3f,
    tangent: vec3f,
    // Whether its map is there.
    mapped: bool,
}

var<workgroup> shared_lights: array<SharedLight, 32>;

fn receiver_normal(pixel: vec2u) -> vec3f {
#ifdef NORMAL_MAP
    return octahedral_unpack(textureLoad(gbuffer_geometric_normal, pixel, 0).x);
#else
    return octahedral_unpack(textureLoad(gbuffer_core, pixel, 0).x);
#endif
}

// A texel that is borrowed from elsewhere must be nearer than the receiver by this for each radian in between to hide it: surfaces that meet at an angle would
// shade each other.
const REFERENCE_SLOPE: f32 = 4.0;

// Whether what a light's map knows leaves the receiver (in the light's frame) lit.
fn lit(slot: u32, receiver: vec3f, receiver_side: vec3f) -> bool {
    let side = f32(settings.resolution);
    let length_squared = dot(receiver, receiver);
    if !(length_squared > 0.0) {
        return true;
    }
    let texel_width = 2.5 / side;
    // Moved off its surface by the bias, a part of the width that a texel has out there.
    let start = receiver + receiver_side * (settings.bias * texel_width * sqrt(length_squared));
    if start.z <= 0.0 {
        return true;
    }
    let distance = hemi_octahedral_norm(start);
    let height = dot(receiver_side, start);
    let place = (hemi_octahedral_encode(start) * 0.5 + vec2f(0.5)) * side - vec2f(0.5);
    let low = floor(place);
    let share = place - low;
    let start_of_map = slot * ((4u * settings.resolution * settings.resolution - 1u) / 3u);
    var seen = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let step = vec2f(f32(corner & 1u), f32(corner >> 1u));
        let shares = select(vec2f(1.0) - share, share, step > vec2f(0.5));
        var texel = clamp(low + step, vec2f(0.0), vec2f(side - 1.0));
        var word = maps[start_of_map + u32(texel.y) * settings.resolution + u32(texel.x)];
        if word == EMPTY {
            seen += shares.x * shares.y;
            continue;
        }
        var tolerance = 0.0;
        if word >= REFERENCE {
            let other = vec2u(word & 255u, (word >> 8u) & 255u);
            tolerance = REFERENCE_SLOPE * texel_width * length(vec2f(other) - texel);
            texel = vec2f(other);
            word = maps[start_of_map + other.y * settings.resolution + other.x];
        }
        // Where the ray through the texel's centre meets the receiver's plane, but not beyond the receiver: what another surface that meets this one holds
        // there would seem to hide it.
        let ray = hemi_octahedral_decode((texel + vec2f(0.5)) * (2.0 / side) - vec2f(1.0));
        let slope = dot(receiver_side, ray);
        var along = distance;
        if slope < 0.0 && height < 0.0 {
            along = min(height / slope, distance);
        }
        if bitcast<f32>(word) >= along * (1.0 - tolerance) {
            seen += shares.x * shares.y;
        }
    }
    return seen >= 0.5;
}

@compute @workgroup_size(8, 8)
fn look_up(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let extent = vec2u(view.extent);
    let place = interleaved_pixel(id.xy, extent, settings.interleave);
    let word = range.first_word + id.z;
    if local < 32u {
        let index = interleaved_light(word * 32u + local, place.subset, settings.interleave);
        var entry: SharedLight;
        if index >= range.first_light && index < range.end_light {
            entry.position = virtual_lights[index].position;
            entry.normal = virtual_light_normal(virtual_lights[index]);
            entry.tangent = perpendicular(entry.normal);
            entry.mapped = true;
        }
        shared_lights[local] = entry;
    }
    workgroupBarrier();
    if !place.inside {
        return;
    }
    let address = visibility_address(place.pixel, extent, word - range.chunk_word);
    // Maps of a word's lights may come in several dispatches. The one with the first of them starts the word.
    let starts = interleaved_light(word * 32u, place.subset, settings.interleave) >= range.first_light;
    var bits = 0u;
    if !starts {
        bits = visibility[address];
    }
    let depth = textureLoad(gbuffer_depth, place.pixel, 0);
    if depth > 0.0 {
        let normal = receiver_normal(place.pixel);
        let surface = scene_position(view, vec2f(place.pixel), depth);
        for (var order = 0u; order < 32u; order++) {
            let light_normal = shared_lights[order].normal;
            let offset = surface - shared_lights[order].position;
            // Behind either surface nothing is reflected, whatever the bit says.
            if shared_lights[order].mapped && dot(offset, normal) < 0.0 && dot(offset, light_normal) > 0.0 {
                let tangent = shared_lights[order].tangent;
                let bitangent = cross(light_normal, tangent);
                let receiver = vec3f(dot(offset, tangent), dot(offset, bitangent), dot(offset, light_normal));
                let side = vec3f(dot(normal, tangent), dot(normal, bitangent), dot(normal, light_normal));
                let index = interleaved_light(word * 32u + order, place.subset, settings.interleave);
                if lit(index - range.first_light, receiver, side) {
                    bits |= 1u << order;
                }
            }
        }
    }
    visibility[address] = bits;
}
