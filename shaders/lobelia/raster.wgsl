// Drawing the scene's meshes: what the camera's and the lights' passes have in common.
#define_import_path lobelia::raster

#import lobelia::math::safe_normalize
#import lobelia::scene::Instance
#import lobelia::surface::MaterialTexels

struct VertexInput {
    @location(0) position: vec3f,
    // Not unit where the file has no normal.
    @location(1) normal: vec3f,
    // w is the handedness, 0 without tangents.
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
}

struct SceneVertex {
    position: vec3f,
    normal: vec3f,
    tangent: vec4f,
    uv: vec2f,
    // -1 where the instance mirrors, which turns its triangles' winding.
    mirror: f32,
}

fn scene_vertex(vertex: VertexInput, instance: Instance) -> SceneVertex {
    let mirror = instance.normal_column_x.w;
    let normal = mat3x3f(instance.normal_column_x.xyz, instance.normal_column_y.xyz, instance.normal_column_z.xyz) * vertex.normal;
    let linear = mat3x3f(instance.scene_from_local[0].xyz, instance.scene_from_local[1].xyz, instance.scene_from_local[2].xyz);
    var out: SceneVertex;
    out.position = (instance.scene_from_local * vec4f(vertex.position, 1.0)).xyz;
    out.normal = safe_normalize(normal, vec3f(0.0, 1.0, 0.0));
    out.tangent = vec4f(safe_normalize(linear * vertex.tangent.xyz, vec3f(0.0)), vertex.tangent.w * mirror);
    out.uv = vertex.uv;
    out.mirror = mirror;
    return out;
}

// Texels of a material. Filtering is bilinear on the full-resolution level.
fn material_texels(
    base_color: texture_2d<f32>, base_color_sampler: sampler,
    metallic_roughness: texture_2d<f32>, metallic_roughness_sampler: sampler,
    normal: texture_2d<f32>, normal_sampler: sampler,
    emissive: texture_2d<f32>, emissive_sampler: sampler,
    uv: vec2f,
) -> MaterialTexels {
    var texels: MaterialTexels;
    texels.base_color = textureSampleLevel(base_color, base_color_sampler, uv, 0.0);
#ifdef SPECULAR
    texels.metallic_roughness = textureSampleLevel(metallic_roughness, metallic_roughness_sampler, uv, 0.0);
#else
    texels.metallic_roughness = vec4f(1.0);
#endif
#ifdef NORMAL_MAP
    texels.normal = textureSampleLevel(normal, normal_sampler, uv, 0.0);
#else
    texels.normal = vec4f(0.5, 0.5, 1.0, 1.0);
#endif
#ifdef EMISSIVE
    texels.emissive = textureSampleLevel(emissive, emissive_sampler, uv, 0.0);
#else
    texels.emissive = vec4f(1.0);
#endif
    return texels;
}
