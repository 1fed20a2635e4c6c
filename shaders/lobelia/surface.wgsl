// A surface as light sees it, and how it is packed: the one place where texels of G-buffers and reflective shadow maps are coded and decoded.
//
// Flags: SPECULAR, NORMAL_MAP, EMISSIVE, and DIELECTRIC (only with SPECULAR); without one, its part is not stored and decodes to the stated constant.
#define_import_path lobelia::surface

#import lobelia::math::safe_normalize
#import lobelia::octahedral::{octahedral_pack, octahedral_unpack}
#import lobelia::packing::{pack_color, pack_shared_exponent, unpack_color, unpack_shared_exponent}
#import lobelia::scene::{MATERIAL_EMITS_BOTH_WAYS, Material}

struct Surface {
    // Shading normal, turned to the viewer.
    normal: vec3f,
    // Interpolated vertex normal, turned to the viewer; without NORMAL_MAP the shading normal.
    geometric_normal: vec3f,
    base_color: vec3f,
    // Without SPECULAR 1, 0 and 0.
    roughness: f32,
    metallic: f32,
    specular: f32,
#ifdef DIELECTRIC
    // Reflectance of what is not metallic, at normal incidence and, w, at grazing incidence. Without DIELECTRIC 0.04 and 1.
    dielectric: vec4f,
#endif
    // Radiance; without EMISSIVE 0.
    emissive: vec3f,
}

struct PackedSurface {
    // Shading normal; base colour.
    core: vec2u,
    // Roughness 16 bits, metallic 8, specular scale 8.
    specular: u32,
#ifdef DIELECTRIC
    // Square roots of the reflectances, 8 bits each.
    dielectric: u32,
#endif
    geometric_normal: u32,
    emissive: u32,
}

// Takes a texel of the specular target: one word, or two with DIELECTRIC.
fn load_specular(packed: ptr<function, PackedSurface>, texel: vec4u) {
    (*packed).specular = texel.x;
#ifdef DIELECTRIC
    (*packed).dielectric = texel.y;
#endif
}

// Roughness, metallic, specular scale, each in [0, 1].
fn pack_specular(surface: Surface) -> u32 {
    let values = clamp(vec3f(surface.roughness, surface.metallic, surface.specular), vec3f(0.0), vec3f(1.0));
    let bits = vec3u(values * vec3f(65535.0, 255.0, 255.0) + vec3f(0.5));
    return bits.x | (bits.y << 16u) | (bits.z << 24u);
}

fn pack_surface(surface: Surface) -> PackedSurface {
    var packed: PackedSurface;
    packed.core = vec2u(octahedral_pack(surface.normal), pack_color(surface.base_color));
    packed.specular = pack_specular(surface);
#ifdef DIELECTRIC
    // 0.04 is a whole number of steps: (51 / 255)^2.
    packed.dielectric = pack4x8unorm(sqrt(clamp(surface.dielectric, vec4f(0.0), vec4f(1.0))));
#endif
    packed.geometric_normal = octahedral_pack(surface.geometric_normal);
    packed.emissive = pack_shared_exponent(surface.emissive);
    return packed;
}

fn unpack_surface(packed: PackedSurface) -> Surface {
    var surface: Surface;
    surface.normal = octahedral_unpack(packed.core.x);
    surface.base_color = unpack_color(packed.core.y);
#ifdef SPECULAR
    surface.roughness = f32(packed.specular & 65535u) / 65535.0;
    surface.metallic = f32((packed.specular >> 16u) & 255u) / 255.0;
    surface.specular = f32(packed.specular >> 24u) / 255.0;
#else
    surface.roughness = 1.0;
    surface.metallic = 0.0;
    surface.specular = 0.0;
#endif
#ifdef DIELECTRIC
    let roots = unpack4x8unorm(packed.dielectric);
    surface.dielectric = roots * roots;
#endif
#ifdef NORMAL_MAP
    surface.geometric_normal = octahedral_unpack(packed.geometric_normal);
#else
    surface.geometric_normal = surface.normal;
#endif
#ifdef EMISSIVE
    surface.emissive = unpack_shared_exponent(packed.emissive);
#else
    surface.emissive = vec3f(0.0);
#endif
    return surface;
}

// What a patch's reflected radiance is multiplied with where shading and geometric normal differ: light falls on the area that the geometric normal gives,
// but is reflected with the shading normal's cosine. 0 where the light is below the shading normal's horizon.
fn shading_normal_factor(surface: Surface, to_light: vec3f) -> f32 {
#ifdef NORMAL_MAP
    return max(dot(surface.normal, to_light), 0.0) / max(dot(surface.geometric_normal, to_light), 0.01);
#else
    return 1.0;
#endif
}

struct MaterialTexels {
    // Linear.
    base_color: vec4f,
    // Raw: green roughness, blue metallic.
    metallic_roughness: vec4f,
    // Raw, in [0, 1].
    normal: vec4f,
    // Linear.
    emissive: vec4f,
}

// A surface from its material, its texels, and the interpolated (not unit) normal and tangent. `to_viewer` need not be unit; `front` is
// whether the viewer sees the front face, which emits; the back does so only if the material says. Surfaces are two-sided: both normals are turned so that the geometric one faces the
// viewer. A zero normal becomes the direction to the viewer, a zero tangent takes the map's x and y away.
fn material_surface(
    material: Material,
    texels: MaterialTexels,
    interpolated_normal: vec3f,
    tangent: vec4f,
    to_viewer: vec3f,
    front: bool,
) -> Surface {
    var surface: Surface;
    let unturned = safe_normalize(interpolated_normal, safe_normalize(to_viewer, vec3f(0.0, 1.0, 0.0)));
    var shading = unturned;
#ifdef NORMAL_MAP
    // Where the mesh has no tangents, w is 0 and so there is no map.
    if tangent.w != 0.0 && material.normal_scale != 0.0 {
        let t = (texels.normal.xyz * 2.0 - vec3f(1.0)) * vec3f(material.normal_scale, material.normal_scale, 1.0);
        let axis_t = safe_normalize(tangent.xyz, vec3f(0.0));
        let axis_b = cross(unturned, axis_t) * tangent.w;
        shading = safe_normalize(t.x * axis_t + t.y * axis_b + t.z * unturned, unturned);
    }
#endif
    // Both normals turn together: the side is that of the interpolated normal.
    let side = select(-1.0, 1.0, dot(unturned, to_viewer) >= 0.0);
    surface.normal = shading * side;
    surface.geometric_normal = unturned * side;
    surface.base_color = material.base_color * texels.base_color.rgb;
    surface.roughness = clamp(material.roughness * texels.metallic_roughness.g, 0.0, 1.0);
    surface.metallic = clamp(material.metallic * texels.metallic_roughness.b, 0.0, 1.0);
    surface.specular = material.specular;
#ifdef DIELECTRIC
    surface.dielectric = material.dielectric;
#endif
    let emits = front || (material.flags & MATERIAL_EMITS_BOTH_WAYS) != 0u;
    surface.emissive = select(vec3f(0.0), material.emissive * texels.emissive.rgb, emits);
    return surface;
}
