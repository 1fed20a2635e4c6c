// Draws the scene into the G-buffer. Every surface is two-sided: normals turn to the viewer; emission leaves the front only.

#import lobelia::scene::{Instance, Material, View}
#import lobelia::surface::{material_surface, pack_surface}
#import lobelia::raster::{VertexInput, material_texels, scene_vertex}

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

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
    @location(4) mirror: f32,
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
    out.mirror = vertex.mirror;
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
#ifdef EMISSIVE
    @location(3) emissive: u32,
#endif
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) front_facing: bool) -> Targets {
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
    let front = front_facing == (in.mirror > 0.0);
    let packed = pack_surface(material_surface(material, texels, in.normal, in.tangent, view.position - in.position, front));
    var out: Targets;
    out.core = packed.core;
#ifdef SPECULAR
    out.specular = packed.specular;
#endif
#ifdef NORMAL_MAP
    out.geometric_normal = packed.geometric_normal;
#endif
#ifdef EMISSIVE
    out.emissive = packed.emissive;
#endif
    return out;
}
