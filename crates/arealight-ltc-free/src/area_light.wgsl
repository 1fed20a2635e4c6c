// Lights every pixel by all area lights: integrals along the outline of each light.

#import lobelia::area_light::{AREA_LIGHT_DISK, AREA_LIGHT_POLYGON, AREA_LIGHT_SPHERE, AreaLight, area_light_facing}
#import lobelia::brdf::{Brdf, brdf_from_surface, fresnel, ggx_visibility, phong_visibility}
#import lobelia::half_vector_integral::{HalfVectorSum, add_half_vector_edge}
#import lobelia::light_outline::{GreatArc, OutlineStep, OutlineWalk, Rim, close_outline, great_arc, lambert_edge, rim_corner, rim_of_disk, rim_of_ellipsoid, walk_outline}
#import lobelia::math::{perpendicular, safe_normalize, storable}
#import lobelia::scene::{View, scene_position}
#import lobelia::surface::{PackedSurface, Surface, unpack_surface}

struct Settings {
    light_count: u32,
    // Of the polygon that stands for a round light.
    sides: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<storage, read> lights: array<AreaLight>;
#ifdef POLYGON_LIGHTS
@group(0) @binding(3) var<storage, read> corners: array<vec4f>;
#endif
@group(0) @binding(4) var gbuffer_depth: texture_2d<f32>;
@group(0) @binding(5) var gbuffer_core: texture_2d<u32>;
#ifdef SPECULAR
@group(0) @binding(6) var gbuffer_specular: texture_2d<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(7) var gbuffer_geometric_normal: texture_2d<u32>;
#endif
#ifdef VISIBILITY
@group(0) @binding(8) var visible: texture_2d_array<f32>;
#endif
@group(0) @binding(9) var radiance: texture_storage_2d<rgba16float, write>;

const MAX_FACTOR: f32 = 1e15;

// The surface at a pixel, with the frame that its lobes are integrated in: z along the shading normal, the viewer in the half plane y = 0, x >= 0.
struct Receiver {
    position: vec3f,
    axis_x: vec3f,
    axis_y: vec3f,
    normal: vec3f,
    viewer: vec3f,
    alpha: f32,
}

fn to_frame(receiver: Receiver, direction: vec3f) -> vec3f {
    return vec3f(dot(direction, receiver.axis_x), dot(direction, receiver.axis_y), dot(direction, receiver.normal));
}

// A light's outline in the frame of the surface.
struct Outline {
    count: u32,
    // First corner of a polygon, and whether its back is seen, from which its corners run the other way.
    first: u32,
    reversed: bool,
    rim: Rim,
}

fn corner(outline: Outline, receiver: Receiver, index: u32) -> vec3f {
    let place = select(index, outline.count - 1u - index, outline.reversed);
#ifdef POLYGON_LIGHTS
#ifdef ROUND_LIGHTS
    if outline.first != 0xffffffffu {
        return to_frame(receiver, corners[outline.first + place].xyz - receiver.position);
    }
#else
    return to_frame(receiver, corners[outline.first + place].xyz - receiver.position);
#endif
#endif
#ifdef ROUND_LIGHTS
    return rim_corner(outline.rim, index, outline.count);
#endif
}

// No corners where nothing is seen: from behind a one-sided light, from its plane, from inside a sphere.
fn outline_of(light: AreaLight, receiver: Receiver) -> Outline {
    var outline: Outline;
    let offset = light.center - receiver.position;
    var front = true;
#ifdef FLAT_LIGHTS
    if light.kind != AREA_LIGHT_SPHERE {
        let facing = safe_normalize(area_light_facing(light), vec3f(0.0));
        let height = -dot(facing, offset);
        // In its plane a light has no extent, and which side is seen is rounding noise.
        front = height > 0.0;
        if abs(height) <= 1e-6 * length(offset) || (!front && light.two_sided == 0u) {
            return outline;
        }
    }
#endif
#ifdef POLYGON_LIGHTS
    if light.kind == AREA_LIGHT_POLYGON {
        outline.count = light.vertex_count;
        outline.first = light.first_vertex;
        outline.reversed = !front;
        return outline;
    }
#endif
#ifdef ROUND_LIGHTS
    outline.first = 0xffffffffu;
    let center = to_frame(receiver, offset);
    let axis_a = to_frame(receiver, light.axis_a);
    let axis_b = to_frame(receiver, light.axis_b);
#ifdef DISK_LIGHTS
    if light.kind == AREA_LIGHT_DISK {
        outline.rim = rim_of_disk(center, axis_a, axis_b);
        outline.count = settings.sides;
    }
#endif
#ifdef SPHERE_LIGHTS
    if light.kind == AREA_LIGHT_SPHERE {
        outline.rim = rim_of_ellipsoid(center, mat3x3f(axis_a, axis_b, to_frame(receiver, light.axis_c)));
        outline.count = select(0u, settings.sides, any(outline.rim.axis_a != vec3f(0.0)));
    }
#endif
#endif
    return outline;
}

// What the light of one outline, of radiance 1, becomes: x the integral of the cosine, and the microfacet lobe's.
struct Lit {
    cosine: f32,
    lobe: HalfVectorSum,
}

fn light_from(outline: Outline, receiver: Receiver) -> Lit {
    var lit: Lit;
    if outline.count < 3u {
        return lit;
    }
    // A pointer to a part of a variable cannot be handed on.
    var lobe: HalfVectorSum;
    var walk: OutlineWalk;
    var previous = corner(outline, receiver, outline.count - 1u);
    for (var index = 0u; index <= outline.count; index++) {
        var step: OutlineStep;
        if index < outline.count {
            let next = corner(outline, receiver, index);
            step = walk_outline(&walk, previous, next);
            previous = next;
        } else {
            step = close_outline(walk);
        }
        for (var part = 0u; part < 2u; part++) {
            let start = select(step.horizon_from, step.start, part == 1u);
            let to = select(step.horizon_to, step.to, part == 1u);
            if all(start == to) {
                continue;
            }
            let arc = great_arc(start, to);
            lit.cosine += lambert_edge(arc);
#ifdef SPECULAR
            add_half_vector_edge(&lobe, arc, receiver.viewer, receiver.alpha);
#endif
        }
    }
    lit.lobe = lobe;
    return lit;
}

#ifdef SPECULAR
// F G2 (h.v) / (n.v), which the lobe is multiplied with, at the mean half vector that the lobe and the light have together; the factor h.v is exact.
fn reflected(brdf: Brdf, receiver: Receiver, lobe: HalfVectorSum) -> vec3f {
    let mean = safe_normalize(lobe.mean, vec3f(0.0, 0.0, 1.0));
    let cosine = clamp(dot(mean, receiver.viewer), 0.0, 1.0);
    // Of the mirrored viewer about the mean half vector.
    let n_dot_l = max(2.0 * cosine * mean.z - receiver.viewer.z, 1e-4);
    let n_dot_v = max(receiver.viewer.z, 1e-4);
#ifdef NDF_PHONG
    let masking = phong_visibility(brdf.alpha, n_dot_l, n_dot_v);
#else
    let masking = ggx_visibility(brdf.alpha, n_dot_l, n_dot_v);
#endif
    let energy = max(dot(lobe.mean, receiver.viewer), 0.0);
    return fresnel(brdf, cosine) * min(4.0 * masking * n_dot_l * energy, MAX_FACTOR);
}
#endif

@compute @workgroup_size(8, 8)
fn area_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(radiance)) {
        return;
    }
    let depth = textureLoad(gbuffer_depth, id.xy, 0).x;
    if depth <= 0.0 {
        textureStore(radiance, id.xy, vec4f(0.0, 0.0, 0.0, 1.0));
        return;
    }
    var packed: PackedSurface;
    packed.core = textureLoad(gbuffer_core, id.xy, 0).xy;
#ifdef SPECULAR
    packed.specular = textureLoad(gbuffer_specular, id.xy, 0).x;
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(gbuffer_geometric_normal, id.xy, 0).x;
#endif
    let surface = unpack_surface(packed);
    let brdf = brdf_from_surface(surface);
    let position = scene_position(view, vec2f(id.xy), depth);
    let to_viewer = safe_normalize(view.position - position, surface.normal);
    let height = dot(surface.normal, to_viewer);
    // A shading normal that is turned away reflects nothing to the viewer.
    var total = vec3f(0.0);
    if height > 0.0 {
        var receiver: Receiver;
        receiver.position = position;
        receiver.normal = surface.normal;
        receiver.axis_x = safe_normalize(to_viewer - surface.normal * height, perpendicular(surface.normal));
        receiver.axis_y = cross(receiver.normal, receiver.axis_x);
        receiver.viewer = to_frame(receiver, to_viewer);
        receiver.viewer.y = 0.0;
        receiver.alpha = brdf.alpha;
        for (var index = 0u; index < settings.light_count; index++) {
            let light = lights[index];
            let lit = light_from(outline_of(light, receiver), receiver);
            var factor = brdf.diffuse * max(lit.cosine, 0.0);
#ifdef SPECULAR
            factor += reflected(brdf, receiver, lit.lobe);
#endif
            var sent = factor * min(light.radiance, vec3f(MAX_FACTOR));
#ifdef VISIBILITY
            sent *= textureLoad(visible, id.xy, index, 0).x;
#endif
            total = min(total + sent, vec3f(MAX_FACTOR));
        }
    }
    textureStore(radiance, id.xy, vec4f(storable(total), 1.0));
}
