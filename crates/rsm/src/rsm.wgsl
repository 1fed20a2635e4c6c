// Draws the scene into one face of a reflective shadow map. The viewer that normals turn to is the light.

#import lobelia::raster::{VertexInput, material_texels, scene_vertex}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light}
#import lobelia::scene::{Instance, Material}
#import lobelia::surface::{material_surface, pack_surface}

@group(0) @binding(0) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
// x: which face is drawn.
@group(0) @binding(2) var<uniform> drawn_face: vec4u;

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var base_color_texture: texture_2d<f32>;
@group(1) @binding(2) var metallic_roughness_texture: texture_2d<f32>;
@group(1) @binding(3) var normal_texture: texture_2d<f32>;
@group(1) @binding(4) var emissive_texture: texture_2d<f32>;
@group(1) @binding(5) var base_color_sampler: sampler;
@group(1) @binding(6) var metallic_roughness_sampler: sampler;
@group(1) @binding(7) var normal_sampler: sampler;
@group(1) @binding(8) var emissive_sampler: sampler;

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
}

@vertex
fn vertex(input: VertexInput, @builtin(instance_index) index: u32) -> Varying {
    let vertex = scene_vertex(input, instances[index]);
    var out: Varying;
    out.clip = faces[drawn_face.x].clip_from_scene * vec4f(vertex.position, 1.0);
    out.position = vertex.position;
    out.normal = vertex.normal;
    out.tangent = vertex.tangent;
    out.uv = vertex.uv;
    return out;
}

struct Targets {
    @location(0) core: vec2u,
#ifdef SPECULAR
    @location(1) specular: u32,
#endif
#ifdef NORMAL_MAP
    @location(2) geometric_normal: u32,
#endif
}

@fragment
fn fragment(in: Varying) -> Targets {
    let texels = material_texels(
        base_color_texture, base_color_sampler,
        metallic_roughness_texture, metallic_roughness_sampler,
        normal_texture, normal_sampler,
        emissive_texture, emissive_sampler,
        in.uv,
    );
#ifdef ALPHA_MASK
    if texels.base_color.a < material.alpha_cutoff {
        discard;
    }
#endif
    let to_light = rsm_direction_to_light(faces[drawn_face.x], in.position);
    let packed = pack_surface(material_surface(material, texels, in.normal, in.tangent, to_light, true));
    var out: Targets;
    out.core = packed.core;
#ifdef SPECULAR
    out.specular = packed.specular;
#endif
#ifdef NORMAL_MAP
    out.geometric_normal = packed.geometric_normal;
#endif
    return out;
}
