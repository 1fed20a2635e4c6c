// One thread per pixel, a loop over lights.

#import lobelia::brdf::{brdf_from_surface, evaluate_brdf}
#import lobelia::light::light_sample
#import lobelia::math::{safe_normalize, storable}
#import lobelia::octahedral::octahedral_unpack
#import lobelia::reflective_shadow_map::{RsmFace, rsm_cube_face, rsm_direction_to_light, rsm_distance, rsm_project, rsm_ray, rsm_ray_origin, rsm_texel}
#import lobelia::scene::{PunctualLight, View, scene_position}
#import lobelia::surface::{PackedSurface, load_specular, unpack_surface}

struct Settings {
    light_count: u32,
    face_count: u32,
    // Width of the filter in texels.
    filter_width: u32,
    // Texels.
    bias: f32,
}

// Largest reflectance and largest irradiance that count; their product is finite.
const MAX_FACTOR: f32 = 1e18;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<storage, read> lights: array<PunctualLight>;
@group(0) @binding(3) var gbuffer_depth: texture_depth_2d;
@group(0) @binding(4) var gbuffer_core: texture_2d<u32>;
#ifdef SPECULAR
@group(0) @binding(5) var gbuffer_specular: texture_2d<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(6) var gbuffer_geometric_normal: texture_2d<u32>;
#endif
#ifdef SHADOWS
@group(0) @binding(7) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(8) var rsm_depth: texture_depth_2d_array;
#ifdef NORMAL_MAP
@group(0) @binding(9) var rsm_normal: texture_2d_array<u32>;
#else
@group(0) @binding(9) var rsm_core: texture_2d_array<u32>;
#endif
#endif
@group(0) @binding(10) var radiance: texture_storage_2d<rgba16float, write>;

#ifdef SHADOWS
// Slopes, in texels of depth per texel, beyond which neither a texel's plane nor a receiver is believed.
const MAX_SLOPE: f32 = 16.0;

fn caster_normal(face: RsmFace, texel: vec2u) -> vec3f {
    let place = rsm_texel(face, texel);
#ifdef NORMAL_MAP
    return octahedral_unpack(textureLoad(rsm_normal, place, face.layer, 0).x);
#else
    return octahedral_unpack(textureLoad(rsm_core, place, face.layer, 0).x);
#endif
}

// A point that may be in shadow, as a face of a map sees it.
struct Receiver {
    position: vec3f,
    // Geometric, on the side that is lit.
    normal: vec3f,
    uv: vec2f,
    // Along the face's forward axis, metres.
    distance: f32,
    // Metres by which a caster must stand before it, where both may be one curved surface.
    slack: f32,
    // And where they are not: what rounding makes of distances, and rasterisation of edges.
    rounding: f32,
    // How far the plane of a texel is trusted, metres.
    reach: f32,
}

// What a texel says of a receiver.
struct Tap {
    // Its surface stands between the light and the receiver.
    shades: bool,
    // Its surface is the receiver's own.
    own: bool,
}

fn look(face: RsmFace, texel: vec2u, receiver: Receiver) -> Tap {
    var tap: Tap;
    let depth = textureLoad(rsm_depth, rsm_texel(face, texel), face.layer, 0);
    if depth <= 0.0 {
        return tap;
    }
    let caster = rsm_distance(face, depth);
#ifdef DEPTH_COMPARISON
    tap.shades = caster < receiver.distance - receiver.slack;
    tap.own = !tap.shades;
#else
    let texel_uv = (vec2f(texel) + vec2f(0.5)) / f32(face.resolution);
    let position = rsm_ray_origin(face, texel_uv) + rsm_ray(face, texel_uv) * caster;
    let normal = caster_normal(face, texel);
    let offset = position - receiver.position;
    let height = dot(offset, receiver.normal);
    // On a smooth surface a place lies off the plane of another by half their distance times the turn of the normal between them.
    let turn = normal - receiver.normal;
    let continuous = dot(normal, receiver.normal) > 0.5;
    tap.own = continuous && abs(height) <= receiver.slack + length(offset) * length(turn);
    // Past a convex edge the receiver is met below the other side's plane, but no caster stands behind the receiver's own plane.
    if height <= receiver.rounding {
        return tap;
    }
    let descent = dot(rsm_ray(face, receiver.uv), normal);
    let rise = dot(position - rsm_ray_origin(face, receiver.uv), normal);
    // A plane seen edge-on says nothing about its neighbourhood.
    let met = select(caster, clamp(rise / descent, caster - receiver.reach, caster + receiver.reach), abs(descent) > 1e-4);
    tap.shades = met < receiver.distance - select(receiver.rounding, receiver.slack, continuous);
    tap.own = tap.own && !tap.shades;
#endif
    return tap;
}

fn texel_at(face: RsmFace, place: vec2i) -> vec2u {
    return vec2u(clamp(place, vec2i(0), vec2i(i32(face.resolution) - 1)));
}

// Share of the filter's texels past which the light is seen.
fn shadow(first: RsmFace, position: vec3f, geometric_normal: vec3f) -> f32 {
    let orthographic = first.depth_range != 0.0;
    var index = first.first_face;
    if orthographic {
        // The finest that holds the filter too; the last holds everything.
        let last = first.first_face + first.face_count - 1u;
        let inset = vec2f(0.5 * f32(settings.filter_width) + 0.5) / f32(first.resolution);
        while index < last {
            let uv = rsm_project(faces[index], position).xy;
            if all(uv >= inset) && all(uv <= vec2f(1.0) - inset) {
                break;
            }
            index += 1u;
        }
    } else if first.face_count == 6u {
        index += rsm_cube_face(position - first.position);
    }
    let face = faces[index];
    let resolution = f32(face.resolution);
    let projected = rsm_project(face, position);
    if projected.z <= select(0.0, face.near, orthographic) || any(projected.xy < vec2f(0.0)) || any(projected.xy > vec2f(1.0)) {
        return 1.0;
    }
    let width_at_one = 2.0 * length(face.right) / resolution;
    let footprint = select(width_at_one * projected.z, width_at_one, orthographic);
    let depth_scale = select(projected.z, max(projected.z, 0.5 * length(face.right)), orthographic);
    var slack = settings.bias * footprint + max(depth_scale * 2.44140625e-4, face.rounding);
#ifdef DEPTH_COMPARISON
    // Over one texel the receiver's own depth changes by the tangent of its slope.
    let cosine = abs(dot(geometric_normal, rsm_direction_to_light(face, position)));
    slack += settings.bias * footprint * min(sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1e-3), MAX_SLOPE);
#endif
    // Rasterisers place corners to 1/256 of a texel.
    let rounding = max(depth_scale * 1.9073486328125e-6, face.rounding) + footprint / 256.0;
    let receiver = Receiver(position, geometric_normal, projected.xy, projected.z, slack, rounding, MAX_SLOPE * footprint);
    let width = i32(settings.filter_width);
    let corner = projected.xy * resolution - vec2f(0.5 * f32(width));
    let base = vec2i(floor(corner));
    let fraction = corner - vec2f(base);
    var lit = 0.0;
    var own = false;
    var shaded = false;
    for (var y = 0; y <= width; y++) {
        let weight_y = select(select(1.0, 1.0 - fraction.y, y == 0), fraction.y, y == width);
        for (var x = 0; x <= width; x++) {
            let weight = weight_y * select(select(1.0, 1.0 - fraction.x, x == 0), fraction.x, x == width);
            let tap = look(face, texel_at(face, base + vec2i(x, y)), receiver);
            if !tap.shades {
                lit += weight;
                own = own || tap.own;
            } else {
                shaded = true;
            }
        }
    }
#ifndef DEPTH_COMPARISON
    if shaded && lit > 0.0 {
        var found = 0;
        for (var y = -1; y <= width + 1; y++) {
            for (var x = -1; x <= width + 1; x++) {
                found += select(0, 1, look(face, texel_at(face, base + vec2i(x, y)), receiver).own);
            }
        }
        // Whatever the light passes by, it must end on the receiver's own surface somewhere near: what is seen past the rim of a wall thinner than a texel says
        // nothing about what is behind the wall. A single texel was seen through a crack that rasterisation leaves where walls abut without sharing corners.
        if found < 2 {
            return 0.0;
        }
    } else if !shaded && !own {
        // In a corner the texels around may all be of what ends there: a look at those around them.
        var shades = false;
        for (var y = -1; y <= width + 1; y++) {
            for (var x = -1; x <= width + 1; x++) {
                let tap = look(face, texel_at(face, base + vec2i(x, y)), receiver);
                shades = shades || tap.shades;
                own = own || tap.own;
            }
        }
        return select(1.0, 0.0, shades && !own);
    }
#endif
    return clamp(lit / f32(width * width), 0.0, 1.0);
}
#endif

@compute @workgroup_size(8, 8)
fn direct(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(radiance)) {
        return;
    }
    let depth = textureLoad(gbuffer_depth, id.xy, 0);
    if depth <= 0.0 {
        textureStore(radiance, id.xy, vec4f(0.0, 0.0, 0.0, 1.0));
        return;
    }
    var packed: PackedSurface;
    packed.core = textureLoad(gbuffer_core, id.xy, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(gbuffer_specular, id.xy, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(gbuffer_geometric_normal, id.xy, 0).x;
#endif
    let surface = unpack_surface(packed);
    let brdf = brdf_from_surface(surface);
    let position = scene_position(view, vec2f(id.xy), depth);
    let to_viewer = safe_normalize(view.position - position, surface.normal);
    var total = vec3f(0.0);
#ifdef SHADOWS
    // Faces of one light follow each other; the first knows the light.
    for (var index = 0u; index < settings.face_count; index += max(faces[index].face_count, 1u)) {
        let light = lights[faces[index].light];
#else
    for (var index = 0u; index < settings.light_count; index += 1u) {
        let light = lights[index];
#endif
        let incident = light_sample(light, position);
        let cosine = dot(surface.normal, incident.direction);
        if cosine > 0.0 && max(max(incident.irradiance.x, incident.irradiance.y), incident.irradiance.z) > 0.0 {
            let f = evaluate_brdf(brdf, surface.normal, surface.geometric_normal, incident.direction, to_viewer);
            // Bounds far above what a half float holds: infinity times a black channel or a shadow would be NaN.
            var reflected = min(f * cosine, vec3f(MAX_FACTOR)) * min(incident.irradiance, vec3f(MAX_FACTOR));
#ifdef SHADOWS
            reflected *= shadow(faces[index], position, surface.geometric_normal);
#endif
            total = min(total + reflected, vec3f(MAX_FACTOR));
        }
    }
    textureStore(radiance, id.xy, vec4f(storable(total), 1.0));
}
