// Lights every pixel by all area lights; what one light sends is the business of `light_from`.

#import lobelia::area_light::AreaLight
#import lobelia::area_light_outline::{Outline, SurfaceFrame, area_light_outline, outline_place, outline_rim_corner, surface_frame, to_frame}
#import lobelia::brdf::{Brdf, brdf_from_surface}
#import lobelia::light_outline::{GreatArc, OutlineStep, OutlineWalk, close_outline, great_arc, lambert_edge, walk_outline}
#import lobelia::math::{safe_normalize, storable}
#import lobelia::scene::{View, scene_position}
#import lobelia::surface::{PackedSurface, Surface, unpack_surface}

struct Settings {
    light_count: u32,
    // Fits a side of the table.
    table_size: u32,
    first: u32,
    second: u32,
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
const NORMAL: vec3f = vec3f(0.0, 0.0, 1.0);
// Corners of the polygon that stands for a round light.
const SIDES: u32 = 16u;

fn corner(outline: Outline, frame: SurfaceFrame, index: u32) -> vec3f {
#ifdef POLYGON_LIGHTS
    if !outline.round {
        return to_frame(frame, corners[outline_place(outline, index)].xyz - frame.position);
    }
#endif
    return outline_rim_corner(outline, index);
}

// What a step of a walk adds to Lambert's integral.
fn lambert_step(step: OutlineStep) -> f32 {
    var sum = 0.0;
    if any(step.horizon_from != step.horizon_to) {
        sum += lambert_edge(great_arc(step.horizon_from, step.horizon_to));
    }
    if any(step.start != step.to) {
        sum += lambert_edge(great_arc(step.start, step.to));
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn light_pixels(@builtin(global_invocation_id) id: vec3u) {
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
    var total = vec3f(0.0);
    // A shading normal that is turned away reflects nothing to the viewer.
    if dot(surface.normal, to_viewer) > 0.0 {
        let frame = surface_frame(position, surface.normal, to_viewer);
        for (var index = 0u; index < settings.light_count; index++) {
            let factor = light_from(index, brdf, frame, id.xy);
            var sent = min(factor, vec3f(MAX_FACTOR)) * min(lights[index].radiance, vec3f(MAX_FACTOR));
#ifdef VISIBILITY
            sent *= textureLoad(visible, id.xy, index, 0).x;
#endif
            total = min(total + sent, vec3f(MAX_FACTOR));
        }
    }
    textureStore(radiance, id.xy, vec4f(storable(total), 1.0));
}
