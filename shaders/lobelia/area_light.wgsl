// Area lights as the scene puts them on the device. Mirrors `lobelia-scene`'s `device` module. Scene space, metres.
#define_import_path lobelia::area_light

// Quads and all other polygons.
const AREA_LIGHT_POLYGON: u32 = 0u;
// Disks and ellipses.
const AREA_LIGHT_DISK: u32 = 1u;
// Spheres and ellipsoids.
const AREA_LIGHT_SPHERE: u32 = 2u;

struct AreaLight {
    // Image of the local origin: the middle of all shapes but polygons.
    center: vec3f,
    // AREA_LIGHT_POLYGON, _DISK or _SPHERE.
    kind: u32,
    // Half axes of a disk or sphere, local unit axes of a polygon. Under non-uniform scale and shear they are neither of one length nor perpendicular.
    axis_a: vec3f,
    // First of its corners in the array of corners.
    first_vertex: u32,
    axis_b: vec3f,
    // Corners; 0 for the round shapes. They run counter-clockwise as seen from the side that emits.
    vertex_count: u32,
    // Flat shapes emit to the side that this points away from.
    axis_c: vec3f,
    // 1: a flat shape emits to both sides.
    two_sided: u32,
    // W/(sr m^2).
    radiance: vec3f,
    padding: u32,
}

// The direction that a flat light emits to; not unit. Perpendicular to the light under any linear map.
fn area_light_facing(light: AreaLight) -> vec3f {
    let normal = cross(light.axis_a, light.axis_b);
    return select(normal, -normal, dot(normal, light.axis_c) >= 0.0);
}
