// What the scene puts on the device: view, lights, instances, materials. Mirrors `lobelia-scene`'s `device` module.
// Scene space is world space minus the scene's origin, metres.
#define_import_path lobelia::scene

const LIGHT_POINT: u32 = 0u;
const LIGHT_SPOT: u32 = 1u;
const LIGHT_DIRECTIONAL: u32 = 2u;

// Back faces emit as well.
const MATERIAL_EMITS_BOTH_WAYS: u32 = 1u;
// Drawn in its base colour; reflects nothing.
const MATERIAL_UNLIT: u32 = 2u;

struct View {
    clip_from_scene: mat4x4f,
    previous_clip_from_scene: mat4x4f,
    // Camera, scene space.
    position: vec3f,
    near: f32,
    // Unit.
    forward: vec3f,
    frame: u32,
    // Times aspect * tan(yfov / 2).
    right: vec3f,
    seed: u32,
    // Times tan(yfov / 2).
    up: vec3f,
    // What everything in proportion to light is multiplied by: lights, emission and environment as they are stored, and so all radiance and flux.
    pre_exposure: f32,
    // Pixels.
    extent: vec2f,
    // Added to the sample position, pixels, within [-0.5, 0.5].
    jitter: vec2f,
}

struct PunctualLight {
    // Scene space, metres.
    position: vec3f,
    kind: u32,
    // Unit; where the light travels.
    direction: vec3f,
    cos_outer: f32,
    // W/sr (point, spot) or W/m^2 (directional), per channel.
    intensity: vec3f,
    // 1 / max(0.001, cos inner - cos outer).
    spot_scale: f32,
}

struct Instance {
    scene_from_local: mat4x4f,
    // Columns of the inverse transpose of its linear part; w of the first is the sign of its determinant.
    normal_column_x: vec4f,
    normal_column_y: vec4f,
    normal_column_z: vec4f,
}

struct Material {
    base_color: vec3f,
    metallic: f32,
    // Radiance, W/(sr m^2).
    emissive: vec3f,
    roughness: f32,
    // Scale of the specular lobe; 0: diffuse only.
    specular: f32,
    normal_scale: f32,
    // 0: opaque.
    alpha_cutoff: f32,
    // MATERIAL_EMITS_BOTH_WAYS, MATERIAL_UNLIT, both or 0.
    flags: u32,
    // Reflectance of what is not metallic at normal incidence, xyz, and at grazing incidence, w.
    dielectric: vec4f,
}

// Where one texture of a material is read: u' = dot(u_row.xyz, (u, v, 1)), v' likewise, for the mesh's second set of coordinates where u_row.w is 1.
struct TextureTransform {
    u_row: vec4f,
    v_row: vec4f,
}

struct TextureTransforms {
    base_color: TextureTransform,
    metallic_roughness: TextureTransform,
    normal: TextureTransform,
    emissive: TextureTransform,
}

// Direction through the sample position of pixel (x, y), y down; not unit: its part along `view.forward` is 1.
fn primary_ray(view: View, pixel: vec2f) -> vec3f {
    let ndc = (pixel + vec2f(0.5) + view.jitter) * 2.0 / view.extent - vec2f(1.0);
    return view.forward + ndc.x * view.right - ndc.y * view.up;
}

// Distance along `view.forward`, metres, of a reverse-Z depth > 0.
fn view_depth(view: View, depth: f32) -> f32 {
    return view.near / depth;
}

// Scene-space position of what pixel (x, y) sees. Its error is about 2^-23 of the distance to the camera.
fn scene_position(view: View, pixel: vec2f, depth: f32) -> vec3f {
    return view.position + primary_ray(view, pixel) * view_depth(view, depth);
}

// The inverse of `scene_position`: pixel coordinates and depth of a point of the scene. The depth lies in (0, 1] for what the camera can see; for points
// level with the camera or behind it it does not, and the pixel means nothing.
fn project(view: View, position: vec3f) -> vec3f {
    let offset = position - view.position;
    let along = dot(offset, view.forward);
    let distance = select(along, -1e-20, abs(along) < 1e-20);
    let ndc = vec2f(dot(offset, view.right) / dot(view.right, view.right), dot(offset, view.up) / dot(view.up, view.up)) / distance;
    let pixel = (vec2f(ndc.x, -ndc.y) + vec2f(1.0)) * 0.5 * view.extent - vec2f(0.5) - view.jitter;
    return vec3f(pixel, view.near / distance);
}
