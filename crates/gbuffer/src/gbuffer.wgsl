// Draws the scene into the G-buffer. Every surface is two-sided: normals turn to the viewer; emission leaves the front only.

#import lobelia::scene::{Instance, Material, TextureTransforms, View}
#import lobelia::surface::{material_surface, pack_surface}
#import lobelia::raster::{VertexInput, material_texels, scene_vertex, transformed, untransformed, with_unlit}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;

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
    @location(4) mirror: f32,
#ifdef SECOND_UV
    @location(5) second_uv: vec2f,
#endif
#ifdef VERTEX_COLOR
    @location(6) color: vec4f,
#endif
}

@vertex
fn vertex(input: VertexInput, @builtin(instance_index) index: u32) -> Varying {
    let vertex = scene_vertex(input, instances[index]);
    var out: Varying;
    out.clip = view.clip_from_scene * vec4f(vertex.position, 1.0);
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
    out.mirror = vertex.mirror;
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
#ifdef EMISSIVE
    @location(3) emissive: u32,
#endif
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) front_facing: bool) -> Targets {
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
    let front = front_facing == (in.mirror > 0.0);
    let surface = material_surface(material, texels, in.normal, in.tangent, view.position - in.position, front);
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
#ifdef EMISSIVE
    out.emissive = packed.emissive;
#endif
    return out;
}
