// Draws the scene into one face of a reflective shadow map. The viewer that normals turn to is the light.

#import lobelia::raster::{VertexInput, material_texels, scene_vertex, transformed, untransformed, with_unlit}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light}
#import lobelia::scene::{Instance, Material, TextureTransforms}
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
#ifdef TEXTURE_TRANSFORM
@group(1) @binding(9) var<uniform> texture_transforms: TextureTransforms;
#endif

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
#ifdef SECOND_UV
    @location(4) second_uv: vec2f,
#endif
#ifdef VERTEX_COLOR
    @location(5) color: vec4f,
#endif
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
#ifdef SECOND_UV
    out.second_uv = input.second_uv;
#endif
#ifdef VERTEX_COLOR
    out.color = input.color;
#endif
    return out;
}

struct Targets {
    @location(0) core: vec2u,
#ifdef SPECULAR
#ifdef DIELECTRIC
    @location(1) specular: vec2u,
#else
    @location(1) specular: u32,
#endif
#endif
#ifdef NORMAL_MAP
    @location(2) geometric_normal: u32,
#endif
}

@fragment
fn fragment(in: Varying) -> Targets {
#ifdef TEXTURE_TRANSFORM
#ifdef SECOND_UV
    let uv = transformed(texture_transforms, in.uv, in.second_uv);
#else
    let uv = transformed(texture_transforms, in.uv, in.uv);
#endif
#else
    let uv = untransformed(in.uv);
#endif
    var texels = material_texels(
        base_color_texture, base_color_sampler,
        metallic_roughness_texture, metallic_roughness_sampler,
        normal_texture, normal_sampler,
        emissive_texture, emissive_sampler,
        uv,
    );
#ifdef VERTEX_COLOR
    texels.base_color *= in.color;
#endif
#ifdef ALPHA_MASK
    if texels.base_color.a < material.alpha_cutoff {
        discard;
    }
#endif
    let to_light = rsm_direction_to_light(faces[drawn_face.x], in.position);
    let surface = material_surface(material, texels, in.normal, in.tangent, to_light, true);
    let packed = pack_surface(with_unlit(material, surface));
    var out: Targets;
    out.core = packed.core;
#ifdef SPECULAR
#ifdef DIELECTRIC
    out.specular = vec2u(packed.specular, packed.dielectric);
#else
    out.specular = packed.specular;
#endif
#endif
#ifdef NORMAL_MAP
    out.geometric_normal = packed.geometric_normal;
#endif
    return out;
}
