// Drawing the scene's meshes: what the camera's and the lights' passes have in common.
//
// Flags: SECOND_UV, VERTEX_COLOR (the meshes have them), TEXTURE_TRANSFORM (a texture is moved, turned, scaled or read at the second set; set with
// SECOND_UV always), UNLIT (a material reflects nothing), and those of `lobelia::surface`.
#define_import_path lobelia::raster

#import lobelia::math::safe_normalize
#import lobelia::scene::{Instance, MATERIAL_UNLIT, Material, TextureTransform, TextureTransforms}
#import lobelia::surface::{MaterialTexels, Surface}

struct VertexInput {
    @location(0) position: vec3f,
    // Not unit where the file has no normal.
    @location(1) normal: vec3f,
    // w is the handedness, 0 without tangents.
    @location(2) tangent: vec4f,
    @location(3) uv: vec2f,
#ifdef SECOND_UV
    @location(4) second_uv: vec2f,
#endif
#ifdef VERTEX_COLOR
    @location(5) color: vec4f,
#endif
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

// Where each texture of a material is read.
struct TextureCoordinates {
    base_color: vec2f,
    metallic_roughness: vec2f,
    normal: vec2f,
    emissive: vec2f,
}

fn untransformed(uv: vec2f) -> TextureCoordinates {
    return TextureCoordinates(uv, uv, uv, uv);
}

fn transformed_uv(transform: TextureTransform, uv: vec2f, second_uv: vec2f) -> vec2f {
    let at = vec3f(select(uv, second_uv, transform.u_row.w > 0.5), 1.0);
    return vec2f(dot(transform.u_row.xyz, at), dot(transform.v_row.xyz, at));
}

fn transformed(transforms: TextureTransforms, uv: vec2f, second_uv: vec2f) -> TextureCoordinates {
    var out: TextureCoordinates;
    out.base_color = transformed_uv(transforms.base_color, uv, second_uv);
    out.metallic_roughness = transformed_uv(transforms.metallic_roughness, uv, second_uv);
    out.normal = transformed_uv(transforms.normal, uv, second_uv);
    out.emissive = transformed_uv(transforms.emissive, uv, second_uv);
    return out;
}

// A surface that reflects nothing and shows its base colour to both sides, if its material is such.
fn with_unlit(material: Material, surface: Surface) -> Surface {
    var out = surface;
#ifdef UNLIT
    if (material.flags & MATERIAL_UNLIT) != 0u {
        // The factor is that of pre-exposure.
        out.emissive = surface.base_color * material.emissive;
        out.base_color = vec3f(0.0);
        out.metallic = 0.0;
        out.roughness = 1.0;
        out.specular = 0.0;
    }
#endif
    return out;
}

// Texels of a material. Filtering is bilinear on the full-resolution level.
fn material_texels(
    base_color: texture_2d<f32>, base_color_sampler: sampler,
    metallic_roughness: texture_2d<f32>, metallic_roughness_sampler: sampler,
    normal: texture_2d<f32>, normal_sampler: sampler,
    emissive: texture_2d<f32>, emissive_sampler: sampler,
    uv: TextureCoordinates,
) -> MaterialTexels {
    var texels: MaterialTexels;
    texels.base_color = textureSampleLevel(base_color, base_color_sampler, uv.base_color, 0.0);
#ifdef SPECULAR
    texels.metallic_roughness = textureSampleLevel(metallic_roughness, metallic_roughness_sampler, uv.metallic_roughness, 0.0);
#else
    texels.metallic_roughness = vec4f(1.0);
#endif
#ifdef NORMAL_MAP
    texels.normal = textureSampleLevel(normal, normal_sampler, uv.normal, 0.0);
#else
    texels.normal = vec4f(0.5, 0.5, 1.0, 1.0);
#endif
#ifdef EMISSIVE
    texels.emissive = textureSampleLevel(emissive, emissive_sampler, uv.emissive, 0.0);
#else
    texels.emissive = vec4f(1.0);
#endif
    return texels;
}
