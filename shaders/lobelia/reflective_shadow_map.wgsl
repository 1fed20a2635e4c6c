// The accessor of reflective shadow maps: faces, positions, flux. Mirrors `lobelia-frame`'s `RsmFace`.
#define_import_path lobelia::reflective_shadow_map

#import lobelia::light::light_intensity
#import lobelia::math::safe_normalize
#import lobelia::scene::{PunctualLight, LIGHT_DIRECTIONAL}

struct RsmFace {
    // Reverse Z.
    clip_from_scene: mat4x4f,
    // Light (perspective) or centre of the near plane's axis (orthographic), scene space.
    position: vec3f,
    near: f32,
    forward: vec3f,
    // 0: perspective. Otherwise far minus near distance, metres.
    depth_range: f32,
    // Times the half width at distance 1 (perspective) or in metres (orthographic).
    right: vec3f,
    light: u32,
    up: vec3f,
    first_face: u32,
    face_count: u32,
    // Texels a side.
    resolution: u32,
    // Layer of the map's textures, and the first texel there.
    layer: u32,
    // How likely a virtual light is placed here for the flux that is reflected, among the faces of one light.
    weight: f32,
    // Texture coordinates of what a finer face of the same light covers: least x, y, greatest x, y. Empty: greatest below least.
    hole: vec4f,
    corner: vec2u,
    // What rounding makes of positions in a scene of this size, metres.
    rounding: f32,
}

// Where a texel of a face lies in its layer.
fn rsm_texel(face: RsmFace, texel: vec2u) -> vec2u {
    return face.corner + texel;
}

// Where a point lies in a face: texture coordinates, and distance along `forward` in metres.
fn rsm_project(face: RsmFace, position: vec3f) -> vec3f {
    let offset = position - face.position;
    let distance = dot(offset, face.forward);
    let plane = vec2f(dot(offset, face.right) / dot(face.right, face.right), dot(offset, face.up) / dot(face.up, face.up));
    let ndc = select(plane, plane / max(distance, 1e-20), face.depth_range == 0.0);
    return vec3f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y, distance);
}

// Which face of a cube (order +X -X +Y -Y +Z -Z) a direction from the light belongs to.
fn rsm_cube_face(direction: vec3f) -> u32 {
    let size = abs(direction);
    if size.x >= size.y && size.x >= size.z {
        return select(0u, 1u, direction.x < 0.0);
    }
    if size.y >= size.z {
        return select(2u, 3u, direction.y < 0.0);
    }
    return select(4u, 5u, direction.z < 0.0);
}

// Centre of a texel.
fn rsm_texel_uv(texel: vec2u, resolution: u32) -> vec2f {
    return (vec2f(texel) + vec2f(0.5)) / f32(resolution);
}

fn rsm_ndc(uv: vec2f) -> vec2f {
    return vec2f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
}

// Direction of the ray through `uv`; its part along `forward` is 1.
fn rsm_ray(face: RsmFace, uv: vec2f) -> vec3f {
    if face.depth_range != 0.0 {
        return face.forward;
    }
    let ndc = rsm_ndc(uv);
    return face.forward + ndc.x * face.right + ndc.y * face.up;
}

// Where the ray through `uv` starts.
fn rsm_ray_origin(face: RsmFace, uv: vec2f) -> vec3f {
    let ndc = rsm_ndc(uv);
    return face.position + select(vec3f(0.0), ndc.x * face.right + ndc.y * face.up, face.depth_range != 0.0);
}

// Distance along `forward` of a stored depth > 0.
fn rsm_distance(face: RsmFace, depth: f32) -> f32 {
    return select(face.near / max(depth, 1e-30), face.near + (1.0 - depth) * face.depth_range, face.depth_range != 0.0);
}

fn rsm_position(face: RsmFace, uv: vec2f, depth: f32) -> vec3f {
    return rsm_ray_origin(face, uv) + rsm_ray(face, uv) * rsm_distance(face, depth);
}

// Width of a texel in metres on a plane across the view, at a stored depth > 0.
fn rsm_footprint(face: RsmFace, depth: f32, resolution: f32) -> f32 {
    return 2.0 * length(face.right) / resolution * select(rsm_distance(face, depth), 1.0, face.depth_range != 0.0);
}

// The position of a virtual light: the texel's centre. A place spread over the texel's plane would look less regular, but at the edges of the scene half of
// such places lie behind the next wall, where no pixel sees them. The lift is the precision to which rasterisers place triangles, 1/256 of a texel: no
// light may start below its own surface.
fn rsm_lifted_position(face: RsmFace, uv: vec2f, depth: f32, normal: vec3f, resolution: f32) -> vec3f {
    return rsm_position(face, uv, depth) + normal * (rsm_footprint(face, depth, resolution) / 256.0);
}

// Flux through the texel at `uv` of a map of `resolution` texels a side, W per channel: intensity times solid angle (cos^3 over the area on the plane at
// distance 1), or irradiance times area. Where a finer face covers the texel its flux is counted there, and 0 here.
fn rsm_flux(face: RsmFace, light: PunctualLight, uv: vec2f, resolution: f32) -> vec3f {
    if all(uv > face.hole.xy) && all(uv < face.hole.zw) {
        return vec3f(0.0);
    }
    let area = 4.0 * length(face.right) * length(face.up) / (resolution * resolution);
    if light.kind == LIGHT_DIRECTIONAL {
        return light.intensity * area;
    }
    let ray = rsm_ray(face, uv);
    let length_squared = dot(ray, ray);
    let inverse_length = inverseSqrt(length_squared);
    return light_intensity(light, ray * inverse_length) * (area * inverse_length / length_squared);
}

// Unit direction from a point to the light.
fn rsm_direction_to_light(face: RsmFace, position: vec3f) -> vec3f {
    return select(safe_normalize(face.position - position, -face.forward), -face.forward, face.depth_range != 0.0);
}
