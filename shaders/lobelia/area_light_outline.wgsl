// Area lights as outlines in the frame of a surface: what passes that integrate over lights share.
//
// Flags: POLYGON_LIGHTS, DISK_LIGHTS, SPHERE_LIGHTS for the shapes that a scene has.
#define_import_path lobelia::area_light_outline

#import lobelia::area_light::{AREA_LIGHT_DISK, AREA_LIGHT_POLYGON, AREA_LIGHT_SPHERE, AreaLight, area_light_facing}
#import lobelia::light_outline::{Rim, rim_corner, rim_of_disk, rim_of_ellipsoid}
#import lobelia::math::{perpendicular, safe_normalize}

// A surface with the frame that its lobes are integrated in, z along the shading normal.
struct SurfaceFrame {
    // Scene space.
    position: vec3f,
    axis_x: vec3f,
    axis_y: vec3f,
    normal: vec3f,
    // In the frame.
    viewer: vec3f,
}

// The viewer is in the half plane y = 0, x >= 0.
fn surface_frame(position: vec3f, normal: vec3f, to_viewer: vec3f) -> SurfaceFrame {
    let height = dot(normal, to_viewer);
    let axis_x = safe_normalize(to_viewer - normal * height, perpendicular(normal));
    return SurfaceFrame(position, axis_x, cross(normal, axis_x), normal, vec3f(dot(to_viewer, axis_x), 0.0, height));
}

// x is the tangent: the part of a scene axis along the surface.
fn surface_frame_along(position: vec3f, normal: vec3f, to_viewer: vec3f, axis: u32) -> SurfaceFrame {
    var along = vec3f(0.0);
    along[axis] = 1.0;
    let axis_x = safe_normalize(along - normal * dot(along, normal), perpendicular(normal));
    let axis_y = cross(normal, axis_x);
    return SurfaceFrame(position, axis_x, axis_y, normal, vec3f(dot(to_viewer, axis_x), dot(to_viewer, axis_y), dot(to_viewer, normal)));
}

fn to_frame(frame: SurfaceFrame, direction: vec3f) -> vec3f {
    return vec3f(dot(direction, frame.axis_x), dot(direction, frame.axis_y), dot(direction, frame.normal));
}

struct Outline {
    // Corners; 0 where nothing is seen.
    count: u32,
    // First corner of a polygon in the scene's array, and whether its back is seen, from which its corners run the other way.
    first: u32,
    reversed: bool,
    // A round light has a rim instead; that of a sphere is seen as a circle.
    round: bool,
    circle: bool,
    rim: Rim,
}

#ifdef SPHERE_LIGHTS
fn is_sphere(light: AreaLight) -> bool {
    let lengths = vec3f(dot(light.axis_a, light.axis_a), dot(light.axis_b, light.axis_b), dot(light.axis_c, light.axis_c));
    let products = vec3f(dot(light.axis_a, light.axis_b), dot(light.axis_b, light.axis_c), dot(light.axis_c, light.axis_a));
    return all(abs(lengths - lengths.x) <= vec3f(1e-5 * lengths.x)) && all(abs(products) <= vec3f(1e-5 * lengths.x));
}
#endif

// No corners from behind a one-sided light, from its plane, or from inside a sphere. `sides`: how many corners or arcs stand for a rim.
fn area_light_outline(light: AreaLight, frame: SurfaceFrame, sides: u32) -> Outline {
    var outline: Outline;
    let offset = light.center - frame.position;
    var front = true;
    if light.kind != AREA_LIGHT_SPHERE {
        let facing = safe_normalize(area_light_facing(light), vec3f(0.0));
        let height = -dot(facing, offset);
        // In its plane a light has no extent, and which side is seen is rounding noise.
        front = height > 0.0;
        if !(abs(height) > 1e-6 * length(offset)) || (!front && light.two_sided == 0u) {
            return outline;
        }
    }
#ifdef POLYGON_LIGHTS
    if light.kind == AREA_LIGHT_POLYGON {
        outline.count = light.vertex_count;
        outline.first = light.first_vertex;
        outline.reversed = !front;
        return outline;
    }
#endif
    outline.round = true;
#ifdef DISK_LIGHTS
    if light.kind == AREA_LIGHT_DISK {
        outline.rim = rim_of_disk(to_frame(frame, offset), to_frame(frame, light.axis_a), to_frame(frame, light.axis_b));
        outline.count = sides;
    }
#endif
#ifdef SPHERE_LIGHTS
    if light.kind == AREA_LIGHT_SPHERE {
        let axes = mat3x3f(to_frame(frame, light.axis_a), to_frame(frame, light.axis_b), to_frame(frame, light.axis_c));
        outline.rim = rim_of_ellipsoid(to_frame(frame, offset), axes);
        outline.count = select(0u, sides, any(outline.rim.axis_a != vec3f(0.0)));
        outline.circle = is_sphere(light);
    }
#endif
    return outline;
}

// Place of a polygon's corner in the scene's array, so that the outline runs counter-clockwise as seen from the surface.
fn outline_place(outline: Outline, index: u32) -> u32 {
    return outline.first + select(index, outline.count - 1u - index, outline.reversed);
}

// Corner of a round light's polygon.
fn outline_rim_corner(outline: Outline, index: u32) -> vec3f {
    return rim_corner(outline.rim, index, outline.count);
}
