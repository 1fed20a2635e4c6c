// Gathers virtual spherical lights at every pixel, by Monte Carlo over the cone that each fills.
//
// Lights and pixels are dealt out as vpl-gather does it: a workgroup is 8 x 8 pixels that share one subset of the lights, which are unpacked into
// workgroup memory 32 at a time. Sums are kept in 32-bit floats, so that any number of dispatches adds up without loss; `resolve` writes the radiance.

#import lobelia::brdf::{Brdf, brdf_from_surface, evaluate_brdf}
#import lobelia::direction_sampling::{brdf_pdf, sample_brdf, sample_cone}
#import lobelia::interleaving::{same_surface, tent_tap}
#import lobelia::light_visibility::{interleaved_light, interleaved_pixel, visibility_address}
#import lobelia::math::{TAU, safe_normalize, storable}
#import lobelia::sampling::{hash, r2_point, unit_float}
#import lobelia::scene::{View, scene_position, view_depth}
#import lobelia::surface::{PackedSurface, Surface, load_specular, unpack_surface}
#import lobelia::virtual_lights::{VirtualLight, virtual_light_surface}

struct Settings {
    light_count: u32,
    interleave: u32,
    // 0: visibility is not interleaved, so a light's bit stands at its own index.
    visibility_interleaved: u32,
    // Per light and pixel.
    samples: u32,
    // Least squared distance that counts, m^2: keeps a light of no radius finite.
    least_distance_squared: f32,
    // Of `radii.wgsl`.
    radius_scale: f32,
    neighbours: u32,
    given: u32,
    seed: u32,
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
// Sums so far, as `gather` changes them and as `resolve` reads them.
@group(0) @binding(9) var red: texture_storage_2d<r32float, read_write>;
@group(0) @binding(20) var green: texture_storage_2d<r32float, read_write>;
@group(0) @binding(21) var blue: texture_storage_2d<r32float, read_write>;
@group(0) @binding(22) var gathered_red: texture_2d<f32>;
@group(0) @binding(23) var gathered_green: texture_2d<f32>;
@group(0) @binding(24) var gathered_blue: texture_2d<f32>;
@group(0) @binding(10) var radiance: texture_storage_2d<rgba16float, write>;
@group(0) @binding(11) var<storage, read> radii: array<f32>;

struct SharedLight {
    position: vec3f,
    radius: f32,
    flux: vec3f,
    normal: vec3f,
    geometric_normal: vec3f,
    to_source: vec3f,
    brdf: Brdf,
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
        let surface = virtual_light_surface(light);
        entry.position = light.position;
        entry.radius = radii[index];
        entry.flux = light.flux;
        entry.normal = surface.normal;
        entry.geometric_normal = surface.geometric_normal;
        entry.to_source = light.direction_to_source;
        entry.brdf = brdf_from_surface(surface);
    }
    shared_lights[slot] = entry;
}

// Whether a lobe of this BRDF is narrower than a cone, so that it is worth sampling: the peak of its density is about 1 / (4 pi alpha^2).
fn narrower_than_cone(brdf: Brdf, versine: f32) -> bool {
#ifdef SPECULAR
    return 2.0 * brdf.alpha * brdf.alpha < versine && brdf.reflectance_grazing > 0.0;
#else
    return false;
#endif
}

// What one light adds to the radiance of a surface:
//
//   Phi / (pi r^2)  int_cone  f_x(w) f_y(-w) (n_x . w) (-n_y . w) dw
//
// `random` differs from pixel to pixel and from light to light. The samples are dealt out among up to three techniques: the cone, the reflectance at the
// pixel, and that at the light, the last two where they are narrower than the cone; with fewer samples than techniques chance decides. The balance
// heuristic divides by the mean of their densities p; as |cone| / (pi r^2) = 2 / (s (s + d)) and |cone| p of the cone is 1, nothing is divided by r, and r = 0 is a point light.
fn contribution(slot: u32, position: vec3f, surface: Surface, brdf: Brdf, to_viewer: vec3f, random: u32) -> vec3f {
    let offset = shared_lights[slot].position - position;
    let distance = length(offset);
    let radius = shared_lights[slot].radius;
    let axis = safe_normalize(offset, surface.normal);
    // Hypotenuse of distance and radius; 1 - d/s without cancellation.
    let s = sqrt(distance * distance + radius * radius);
    let area = max(s * (s + distance), 2.0 * settings.least_distance_squared);
    let versine = clamp(radius * (radius / area), 0.0, 1.0);
    let cone = TAU * versine;
    let normal = shared_lights[slot].normal;
    let to_source = shared_lights[slot].to_source;
    if dot(normal, to_source) <= 0.0 || dot(surface.normal, to_viewer) <= 0.0 {
        return vec3f(0.0);
    }
    let sample_here = narrower_than_cone(brdf, versine);
    let sample_there = narrower_than_cone(shared_lights[slot].brdf, versine);
    let count = f32(settings.samples);
    let techniques = 1.0 + f32(sample_here) + f32(sample_there);
    let by_chance = count < techniques;
    let each = select(floor(count / techniques), count / techniques, by_chance);
    let count_there = select(0.0, each, sample_there);
    let count_here = select(0.0, each, sample_here);
    let count_cone = count - count_there - count_here;
    var total = vec3f(0.0);
    for (var i = 0u; i < settings.samples; i++) {
        let technique = min(f32(i) + select(0.5, unit_float(hash(~random + i)), by_chance), count - 1e-6);
        let u = r2_point(i, random);
        var direction: vec3f;
        var inside = true;
        if technique < count_cone {
            direction = sample_cone(axis, versine, u);
        } else {
            if technique < count - count_there {
                let drawn = sample_brdf(brdf, surface.normal, to_viewer, u);
                direction = drawn.direction;
                inside = drawn.pdf > 0.0;
            } else {
                let drawn = sample_brdf(shared_lights[slot].brdf, normal, to_source, u);
                direction = -drawn.direction;
                inside = drawn.pdf > 0.0;
            }
            let off_axis = direction - axis;
            inside = inside && dot(off_axis, off_axis) <= 2.0 * versine;
        }
        let cosines = max(dot(surface.normal, direction), 0.0) * max(-dot(shared_lights[slot].geometric_normal, direction), 0.0);
        if !inside || cosines <= 0.0 {
            continue;
        }
        var density = count_cone;
        if sample_here {
            density += count_here * cone * brdf_pdf(brdf, surface.normal, to_viewer, direction);
        }
        if sample_there {
            density += count_there * cone * brdf_pdf(shared_lights[slot].brdf, normal, to_source, -direction);
        }
        let emitted = evaluate_brdf(shared_lights[slot].brdf, normal, shared_lights[slot].geometric_normal, to_source, -direction);
        let reflected = evaluate_brdf(brdf, surface.normal, surface.geometric_normal, direction, to_viewer);
        // Bounded factors, so that the product stays finite: infinity times a black channel would be NaN. (Each is below 1e12 by far.)
        total += min(emitted, vec3f(1e9)) * min(reflected, vec3f(1e9)) * (cosines / min(density, 1e18));
    }
    let scale = 2.0 / area;
    return min(min(shared_lights[slot].flux, vec3f(1e18)) * min(min(total, vec3f(1e18)) * scale, vec3f(1e18)), vec3f(1e30));
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
    let brdf = brdf_from_surface(surface);
    let pixel_random = hash(settings.seed ^ hash(place.pixel.y * extent.x + place.pixel.x));
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
                        let light = interleaved_light(word * 32u + slot, place.subset, settings.interleave);
                        total += contribution(slot, position, surface, brdf, to_viewer, hash(pixel_random ^ light));
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
