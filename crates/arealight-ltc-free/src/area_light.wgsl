// Lights every pixel by all area lights: integrals along the outline of each light.

#import lobelia::anisotropic_ggx::{anisotropic_ggx_visibility, anisotropic_mean_alpha, anisotropic_stretch}
#import lobelia::area_light::AreaLight
#import lobelia::area_light_outline::{Outline, SurfaceFrame, area_light_outline, outline_place, outline_rim_corner, surface_frame, surface_frame_along, to_frame}
#import lobelia::axial_moment::{AxialMoment, add_moment_edge, add_power_edge, lobe_fraction, two_axis_moment}
#import lobelia::brdf::{Brdf, brdf_from_surface, fresnel, ggx_visibility, phong_exponent, phong_visibility, specular_albedo}
#import lobelia::cosine_lobe::cosine_lobe_evaluate
#import lobelia::circular_arc::{CircularArc, arc_of_great_circle, irradiance_along, rim_arc, rim_arc_count}
#import lobelia::ggx_half_vector::{add_ggx_arc, ggx_mean}
#import lobelia::half_vector_integral::{HalfVectorSum, add_half_vector_edge}
#import lobelia::light_outline::{GreatArc, OutlineLine, OutlineWalk, great_arc, lambert_edge, rim_point, spinning_quad, take_horizon, visible_rim, walk_outline}
#import lobelia::math::{safe_normalize, storable}
#import lobelia::microfacet_lobe::beckmann_visibility
#import lobelia::scene::{View, scene_position}
#import lobelia::surface::{PackedSurface, Surface, load_specular, unpack_surface}

struct Settings {
    light_count: u32,
    // Corners or arcs that stand for a rim.
    sides: u32,
    // Scene axis whose part along a surface is its tangent.
    tangent: u32,
    anisotropy: f32,
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
const INV_TAU: f32 = 0.159154943;
const NORMAL: vec3f = vec3f(0.0, 0.0, 1.0);

fn corner(outline: Outline, frame: SurfaceFrame, index: u32) -> vec3f {
#ifdef POLYGON_LIGHTS
    if !outline.round {
        return to_frame(frame, corners[outline_place(outline, index)].xyz - frame.position);
    }
#endif
#ifdef ROUND_SPINNING_QUAD
    return rim_point(outline.rim, 1.57079633 * f32(index));
#else
    return outline_rim_corner(outline, index);
#endif
}

#ifdef ROUND_SPINNING_QUAD
// The outline with the quad that stands for a round light, for a lobe that is as wide as `spread`.
fn spun(outline: Outline, frame: SurfaceFrame, spread: f32) -> Outline {
    var quad = outline;
    if outline.round {
        quad.rim = spinning_quad(outline.rim, mirror(frame.viewer), spread);
        quad.count = 4u;
    }
    return quad;
}
#endif

// The specular lobe of a surface, and what of it the light fills; which fields are used depends on the lobe and the method.
struct SpecularSum {
    ggx: vec3f,
    half_vectors: HalfVectorSum,
    // Of a cosine lobe about the mirror direction; or of the lobes that stand for a microfacet distribution, about the normal in half vectors.
    first: AxialMoment,
    second: AxialMoment,
    third: AxialMoment,
    // Direction of the light that is nearest to the mirror direction, on the outline.
    nearest: vec3f,
    // Azimuth that the outline walks about the mirror direction.
    around: AxialMoment,
    // Largest cosine between the normal and a half vector of the outline, by its great arcs.
    highest: f32,
}

#ifdef METHOD_GREAT_ARCS
#ifndef NDF_PHONG
// Whether this light lies where the lobes that stand for GGX have nothing left, so that its integral is taken of GGX itself.
var<private> beyond_lobes: bool = false;
#endif
#endif

#ifdef ANISOTROPIC
fn stretch() -> vec2f {
    return anisotropic_stretch(settings.anisotropy);
}
#else
fn stretch() -> vec2f {
    return vec2f(1.0);
}
#endif

fn mirror(viewer: vec3f) -> vec3f {
    return vec3f(-viewer.xy, viewer.z);
}

// Phong's exponent falls off in angles of reflected rays as the distribution of the same alpha does in those of half vectors, which are half as large.
fn exponent_of(alpha: f32) -> f32 {
    return 0.25 * phong_exponent(alpha);
}

#ifdef LOBE_COSINE
fn add_specular(sum: ptr<function, SpecularSum>, arc: GreatArc, viewer: vec3f, alpha: f32) {
    let n = exponent_of(alpha);
    var first = (*sum).first;
#ifdef LOBE_TWO_AXIS
    add_moment_edge(&first, arc, mirror(viewer), n + 1.0);
    add_power_edge(&first, arc, mirror(viewer), n);
#else
    add_moment_edge(&first, arc, mirror(viewer), n);
#endif
    (*sum).first = first;
}

fn reflected(brdf: Brdf, sum: SpecularSum, viewer: vec3f) -> vec3f {
#ifdef LOBE_TWO_AXIS
    let n = exponent_of(brdf.alpha);
    let share = two_axis_moment(sum.first, mirror(viewer), NORMAL, n) * (n + 2.0) * INV_TAU;
#else
    let share = lobe_fraction(sum.first);
#endif
    return specular_albedo(brdf, viewer.z) * share;
}

// One triangle of a small light that is above the horizon: its solid angle times the lobe, whose mean over the midpoints of the sides is exact for what is
// quadratic across it. The sums along edges would cancel.
fn small_triangle(brdf: Brdf, a: vec3f, b: vec3f, c: vec3f, viewer: vec3f) -> f32 {
    let middle = (a + b + c) / 3.0;
    let square = dot(middle, middle);
    let solid_angle = -0.5 * dot(middle, cross(b - a, c - a)) * inverseSqrt(square) / square;
    let n = exponent_of(brdf.alpha);
    let first = small_value(n, normalize(a + b), viewer);
    let second = small_value(n, normalize(b + c), viewer);
    let third = small_value(n, normalize(c + a), viewer);
    return solid_angle * (first + second + third) / 3.0;
}

fn small_value(n: f32, direction: vec3f, viewer: vec3f) -> f32 {
    let lobe = cosine_lobe_evaluate(mirror(viewer), n, direction);
#ifdef LOBE_TWO_AXIS
    return (n + 2.0) * INV_TAU * lobe * max(direction.z, 0.0);
#else
    return (n + 1.0) * INV_TAU * lobe * step(0.0, direction.z);
#endif
}
#else
#ifdef METHOD_GREAT_ARCS
// Lobes that stand for GGX: weights and exponents (Lecocq et al. 2017, equation 26, with its errata).
struct LobeMix {
    weights: vec3f,
    exponents: vec3f,
}

fn lobe_mix(alpha: f32) -> LobeMix {
    let n = phong_exponent(alpha);
#ifdef NDF_PHONG
    return LobeMix(vec3f(0.0, 1.0, 0.0), vec3f(0.0, n, 0.0));
#else
    let rest = (1.0 - alpha) * (1.0 + alpha);
    return LobeMix(vec3f(alpha * alpha, 0.7 * rest, 0.3 * rest), vec3f(0.0, n, 0.1 * n));
#endif
}

// Most that the mix may miss of the distribution where a light begins.
const LEAST_SHARE: f32 = 0.5;

// Whether the mix is far below the distribution that it stands for, at a cosine to the normal. Its lobes end where GGX goes on: beyond about 7 alpha the mix is next
// to nothing.
fn outside_of_mix(cosine: f32, alpha: f32) -> bool {
#ifdef NDF_PHONG
    return false;
#else
    let mix = lobe_mix(alpha);
    let z = clamp(cosine, 0.0, 1.0);
    let logarithm = log(max(z, 1e-30));
    let powers = exp(min(mix.exponents * logarithm, vec3f(0.0)));
    let lobes = 0.5 * dot(mix.weights * (mix.exponents + vec3f(2.0)), powers);
    let square = alpha * alpha;
    let below = square * z * z + (1.0 - z) * (1.0 + z);
    return lobes * below * below < LEAST_SHARE * square;
#endif
}

// Largest cosine between the normal and a great arc.
fn highest_of(arc: GreatArc) -> f32 {
    let foot = clamp(atan2(arc.tangent.z, arc.start.z), 0.0, arc.length);
    let last = arc.start.z * cos(arc.length) + arc.tangent.z * sin(arc.length);
    return max(max(arc.start.z, last), arc.start.z * cos(foot) + arc.tangent.z * sin(foot));
}

// What a cosine lobe about the normal has in a region whose highest point is known, and no more: beyond that cosine the lobe has its power by n + 1. The models of
// edges are a few thousandths wrong, which is many times too much where nearly nothing is left.
fn bounded_fraction(moment: AxialMoment, n: f32, highest: f32) -> f32 {
    let found = lobe_fraction(moment);
    let most = exp((n + 1.0) * log(clamp(highest, 1e-30, 1.0)));
    return select(min(found, most), found, moment.walked > 3.14159265);
}

fn add_half_arc(sum: ptr<function, SpecularSum>, start: vec3f, to: vec3f, mix: LobeMix) {
    let arc = great_arc(start, to);
    if arc.length > 0.0 {
        (*sum).highest = max((*sum).highest, highest_of(arc));
    }
    var first = (*sum).first;
    var second = (*sum).second;
    var third = (*sum).third;
#ifndef NDF_PHONG
    add_moment_edge(&first, arc, NORMAL, 0.0);
    add_moment_edge(&third, arc, NORMAL, mix.exponents.z);
#endif
    add_moment_edge(&second, arc, NORMAL, mix.exponents.y);
    (*sum).first = first;
    (*sum).second = second;
    (*sum).third = third;
}

// An edge in half vectors as great arcs (algorithms 1 and 2).
fn add_specular(sum: ptr<function, SpecularSum>, arc: GreatArc, viewer: vec3f, alpha: f32) {
#ifndef NDF_PHONG
    if beyond_lobes {
        var ggx = (*sum).ggx;
        add_ggx_arc(&ggx, arc_of_great_circle(arc), viewer, vec3f(stretch(), alpha));
        (*sum).ggx = ggx;
        return;
    }
#endif
    let mix = lobe_mix(alpha);
    let last = arc.start * cos(arc.length) + arc.tangent * sin(arc.length);
    let ideal = mirror(viewer);
    let foot = atan2(dot(ideal, arc.tangent), dot(ideal, arc.start));
    // Which direction of the light everything else is evaluated at.
    let place = clamp(foot, 0.0, arc.length);
    let nearest = arc.start * cos(place) + arc.tangent * sin(place);
    if dot(nearest, ideal) > dot((*sum).nearest, ideal) || all((*sum).nearest == vec3f(0.0)) {
        (*sum).nearest = nearest;
    }
    var around = (*sum).around;
    add_moment_edge(&around, arc, ideal, 0.0);
    (*sum).around = around;
#ifdef METHOD_SPLIT
    if foot > 0.0 && foot < arc.length {
        var split = nearest;
#ifdef METHOD_BALANCED
        let pull = min(2.0 * abs(dot(cross(arc.start, arc.tangent), viewer)) * alpha, 1.0);
        split = normalize((1.0 - pull) * split + pull * normalize(arc.start + last));
#endif
        add_half_arc(sum, arc.start + viewer, split + viewer, mix);
        add_half_arc(sum, split + viewer, last + viewer, mix);
        return;
    }
#endif
    add_half_arc(sum, arc.start + viewer, last + viewer, mix);
}

fn reflected(brdf: Brdf, sum: SpecularSum, viewer: vec3f) -> vec3f {
#ifndef NDF_PHONG
    if beyond_lobes {
        let mean = ggx_mean(sum.ggx, vec3f(stretch(), brdf.alpha));
        return max(dot(mean, viewer), 0.0) * reflected_at(brdf, safe_normalize(mean, NORMAL), viewer);
    }
#endif
    let mix = lobe_mix(brdf.alpha);
    let fractions = vec3f(
        lobe_fraction(sum.first),
        bounded_fraction(sum.second, mix.exponents.y, sum.highest),
        bounded_fraction(sum.third, mix.exponents.z, sum.highest),
    );
    let energy = dot(mix.weights * (mix.exponents + vec3f(2.0)) / (mix.exponents + vec3f(1.0)), fractions);
    // The mirror direction if the light is there, else the direction of the outline that is nearest to it.
    let light = select(sum.nearest, mirror(viewer), sum.around.walked > 3.14159265);
    let h = safe_normalize(light + viewer, NORMAL);
    return energy * reflected_at(brdf, h, viewer) * dot(h, viewer);
}
#else
#ifdef LOBE_GGX
fn add_specular_arc(sum: ptr<function, SpecularSum>, arc: CircularArc, viewer: vec3f, alpha: f32) {
    var ggx = (*sum).ggx;
    add_ggx_arc(&ggx, arc, viewer, vec3f(stretch(), alpha));
    (*sum).ggx = ggx;
}

fn add_specular(sum: ptr<function, SpecularSum>, arc: GreatArc, viewer: vec3f, alpha: f32) {
    add_specular_arc(sum, arc_of_great_circle(arc), viewer, alpha);
}

fn mean_half_vector(sum: SpecularSum, alpha: f32) -> vec3f {
    return ggx_mean(sum.ggx, vec3f(stretch(), alpha));
}
#else
fn add_specular(sum: ptr<function, SpecularSum>, arc: GreatArc, viewer: vec3f, alpha: f32) {
    var half_vectors = (*sum).half_vectors;
    add_half_vector_edge(&half_vectors, arc, viewer, alpha);
    (*sum).half_vectors = half_vectors;
}

fn mean_half_vector(sum: SpecularSum, alpha: f32) -> vec3f {
    return sum.half_vectors.mean;
}
#endif

// At the mean half vector that the lobe and the light have together; the factor h.v is exact.
fn reflected(brdf: Brdf, sum: SpecularSum, viewer: vec3f) -> vec3f {
    let mean = mean_half_vector(sum, brdf.alpha);
    return max(dot(mean, viewer), 0.0) * reflected_at(brdf, safe_normalize(mean, NORMAL), viewer);
}
#endif

// F G2 / (n.v), which the lobe over half vectors is multiplied with beside h.v.
fn reflected_at(brdf: Brdf, h: vec3f, viewer: vec3f) -> vec3f {
    let cosine = clamp(dot(h, viewer), 0.0, 1.0);
    // Of the viewer mirrored about the half vector.
    let n_dot_l = max(2.0 * cosine * h.z - viewer.z, 1e-4);
    let n_dot_v = max(viewer.z, 1e-4);
#ifdef NDF_BECKMANN
    let masking = beckmann_visibility(brdf.alpha, n_dot_l, n_dot_v);
#else
#ifdef NDF_PHONG
    let masking = phong_visibility(brdf.alpha, n_dot_l, n_dot_v);
#else
#ifdef ANISOTROPIC
    let light = vec3f(2.0 * cosine * h.xy - viewer.xy, n_dot_l);
    let masking = anisotropic_ggx_visibility(brdf.alpha / stretch(), light, vec3f(viewer.xy, n_dot_v));
#else
    let masking = ggx_visibility(brdf.alpha, n_dot_l, n_dot_v);
#endif
#endif
#endif
    return fresnel(brdf, cosine) * min(4.0 * masking * n_dot_l, MAX_FACTOR);
}
#endif

#ifdef LOBE_COSINE
// Whether the lobe hardly changes across the light, so that the sums along its edges would cancel.
fn is_small(outline: Outline, frame: SurfaceFrame, alpha: f32) -> bool {
    let first = corner(outline, frame, 0u);
    var square = 0.0;
    for (var index = 1u; index < outline.count; index++) {
        let offset = corner(outline, frame, index) - first;
        square = max(square, dot(offset, offset));
    }
    return square * (exponent_of(alpha) + 1.0) < 0.25 * dot(first, first);
}

fn reflected_from_small(brdf: Brdf, outline: Outline, frame: SurfaceFrame) -> vec3f {
    let first = corner(outline, frame, 0u);
    var previous = corner(outline, frame, 1u);
    var sum = 0.0;
    for (var index = 2u; index < outline.count; index++) {
        let next = corner(outline, frame, index);
        sum += small_triangle(brdf, first, previous, next, frame.viewer);
        previous = next;
    }
    return specular_albedo(brdf, frame.viewer.z) * max(sum, 0.0);
}
#endif

// A surface's integrals over a light.
struct LightSum {
    cosine: f32,
    specular: SpecularSum,
}

fn add_line(sum: ptr<function, LightSum>, line: OutlineLine, viewer: vec3f, alpha: f32) {
    let arc = great_arc(line.start, line.to);
    if arc.length > 0.0 {
        (*sum).cosine += lambert_edge(arc);
#ifdef SPECULAR
        var specular = (*sum).specular;
        add_specular(&specular, arc, viewer, alpha);
        (*sum).specular = specular;
#endif
    }
}

fn over_polygon(outline: Outline, frame: SurfaceFrame, alpha: f32) -> LightSum {
    var sum: LightSum;
    var walk: OutlineWalk;
    var previous = corner(outline, frame, outline.count - 1u);
    var index = 0u;
    while index < outline.count || walk.waits {
        var line: OutlineLine;
        if walk.waits {
            line = take_horizon(&walk);
        } else {
            let next = corner(outline, frame, index);
            index += 1u;
            line = walk_outline(&walk, previous, next, index == outline.count);
            previous = next;
        }
        add_line(&sum, line, frame.viewer, alpha);
    }
    return sum;
}

#ifdef ROUND_ARCS
// Arcs of a circle that is seen as one; more would be no better.
const CIRCLE_ARCS: u32 = 4u;

fn over_rim(outline: Outline, frame: SurfaceFrame, alpha: f32) -> LightSum {
    var sum: LightSum;
    let visible = visible_rim(outline.rim);
    let count = select(outline.count, CIRCLE_ARCS, outline.circle);
    let all = rim_arc_count(visible, count);
    for (var place = 0u; place < all; place++) {
        let arc = rim_arc(outline.rim, visible, place, count);
        sum.cosine += irradiance_along(arc);
#ifdef SPECULAR
        var specular = sum.specular;
        add_specular_arc(&specular, arc, frame.viewer, alpha);
        sum.specular = specular;
#endif
    }
    return sum;
}
#endif

fn over_light(outline: Outline, frame: SurfaceFrame, alpha: f32) -> LightSum {
#ifdef ROUND_ARCS
    if outline.round {
        return over_rim(outline, frame, alpha);
    }
#endif
    return over_polygon(outline, frame, alpha);
}

// Radiance that leaves towards the viewer for a light of radiance 1 within an outline.
fn light_from(brdf: Brdf, seen: Outline, frame: SurfaceFrame) -> vec3f {
    if seen.count < 3u {
        return vec3f(0.0);
    }
    var outline = seen;
#ifdef ROUND_SPINNING_QUAD
#ifdef SPECULAR
    outline = spun(seen, frame, sqrt(2.0 / (exponent_of(brdf.alpha) + 2.0)));
#else
    outline = spun(seen, frame, 1.0);
#endif
#endif
    var sum = over_light(outline, frame, brdf.alpha);
#ifdef SPECULAR
#ifdef METHOD_GREAT_ARCS
#ifndef NDF_PHONG
    beyond_lobes = sum.specular.second.walked <= 3.14159265 && outside_of_mix(sum.specular.highest, brdf.alpha);
    if beyond_lobes {
        sum.specular = over_light(outline, frame, brdf.alpha).specular;
    }
#endif
#endif
#endif
#ifdef ROUND_SPINNING_QUAD
#ifdef SPECULAR
    // A quad as wide as the specular lobe wants it has not the area of the light.
    sum.cosine = over_light(spun(seen, frame, 1.0), frame, brdf.alpha).cosine;
#endif
#endif
    var sent = brdf.diffuse * max(sum.cosine, 0.0);
#ifdef SPECULAR
#ifdef LOBE_COSINE
    if is_small(outline, frame, brdf.alpha) {
        return sent + reflected_from_small(brdf, outline, frame);
    }
#endif
    sent += reflected(brdf, sum.specular, frame.viewer);
#ifdef METHOD_GREAT_ARCS
#ifndef NDF_PHONG
    beyond_lobes = false;
#endif
#endif
#endif
    return sent;
}

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
    load_specular(&packed, textureLoad(gbuffer_specular, id.xy, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(gbuffer_geometric_normal, id.xy, 0).x;
#endif
    let surface = unpack_surface(packed);
    var brdf = brdf_from_surface(surface);
    let position = scene_position(view, vec2f(id.xy), depth);
    let to_viewer = safe_normalize(view.position - position, surface.normal);
    var total = vec3f(0.0);
    // A shading normal that is turned away reflects nothing to the viewer.
    if dot(surface.normal, to_viewer) > 0.0 {
#ifdef ANISOTROPIC
        let frame = surface_frame_along(position, surface.normal, to_viewer, settings.tangent);
        brdf.alpha = anisotropic_mean_alpha(brdf.alpha, settings.anisotropy);
#else
        let frame = surface_frame(position, surface.normal, to_viewer);
#endif
        for (var index = 0u; index < settings.light_count; index++) {
            let light = lights[index];
            let factor = light_from(brdf, area_light_outline(light, frame, settings.sides), frame);
            var sent = min(factor, vec3f(MAX_FACTOR)) * min(light.radiance, vec3f(MAX_FACTOR));
#ifdef VISIBILITY
            sent *= textureLoad(visible, id.xy, index, 0).x;
#endif
            total = min(total + sent, vec3f(MAX_FACTOR));
        }
    }
    textureStore(radiance, id.xy, vec4f(storable(total), 1.0));
}
