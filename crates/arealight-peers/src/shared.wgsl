// Lights every pixel by all area lights; what one light sends is the business of `light_from`.

#import lobelia::area_light::AreaLight
#import lobelia::area_light_outline::{Outline, SurfaceFrame, area_light_outline, outline_place, outline_rim_corner, surface_frame, surface_frame_along, to_frame}
#import lobelia::brdf::{Brdf, brdf_from_surface}
#import lobelia::light_outline::{OutlineLine, OutlineWalk, great_arc, lambert_edge, take_horizon, walk_outline}
#import lobelia::math::{safe_normalize, storable}
#import lobelia::scene::{View, scene_position}
#import lobelia::surface::{PackedSurface, Surface, load_specular, unpack_surface}

struct Settings {
    light_count: u32,
    // Fits a side of the table.
    table_size: u32,
    first: u32,
    second: u32,
    // Scene axis whose part along a surface is its tangent.
    tangent: u32,
    anisotropy: f32,
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

// Lambert's formula over an outline under a linear map.
fn mapped_irradiance(outline: Outline, frame: SurfaceFrame, map: mat3x3f) -> f32 {
    var sum = 0.0;
    var walk: OutlineWalk;
    var previous = map * corner(outline, frame, outline.count - 1u);
    var index = 0u;
    while index < outline.count || walk.waits {
        var line: OutlineLine;
        if walk.waits {
            line = take_horizon(&walk);
        } else {
            let next = map * corner(outline, frame, index);
            index += 1u;
            line = walk_outline(&walk, previous, next, index == outline.count);
            previous = next;
        }
        sum += lambert_edge(great_arc(line.start, line.to));
    }
    return max(sum, 0.0);
}

const NO_MAP: mat3x3f = mat3x3f(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), vec3f(0.0, 0.0, 1.0));

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
    // A shading normal that is turned away reflects nothing to the viewer.
    if dot(surface.normal, to_viewer) > 0.0 {
#ifdef ANISOTROPIC
        let frame = surface_frame_along(position, surface.normal, to_viewer, settings.tangent);
#else
        let frame = surface_frame(position, surface.normal, to_viewer);
#endif
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
