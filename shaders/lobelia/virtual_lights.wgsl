// The accessor of virtual lights. Mirrors `lobelia-frame`'s `VirtualLight`, 64 bytes a record, and `VirtualLightLobes`.
//
// Flag: SPECULAR.
#define_import_path lobelia::virtual_lights

#import lobelia::octahedral::octahedral_unpack
#import lobelia::surface::{PackedSurface, Surface, unpack_surface}

struct VirtualLight {
    // Scene space, metres.
    position: vec3f,
    // Of the disk that the light stands for; 0 for a point.
    radius: f32,
    // Incident, over the sampling density, W; times the ratio of the shading and the geometric normal's cosine to the source.
    flux: vec3f,
    geometric_normal: u32,
    // Unit, to the source that lights it.
    direction_to_source: vec3f,
    specular: u32,
    core: vec2u,
    source: u32,
#ifdef DIELECTRIC
    dielectric: u32,
#endif
}

// The patch around a light, with its reflected light as lobes.
struct VirtualLightLobes {
    // Mean position, scene space, metres.
    position: vec3f,
    // Of the disk with the patch's variance of positions, metres.
    radius: f32,
    // Flux that is reflected diffusely, W.
    diffuse: vec3f,
    normal: u32,
#ifdef SPECULAR
    // Flux that the specular lobe reflects, W.
    specular: vec3f,
    lobe_axis: u32,
#endif
    normal_one_minus_length_squared: f32,
#ifdef SPECULAR
    lobe_sharpness: f32,
#endif
}

// The surface that reflects.
fn virtual_light_surface(light: VirtualLight) -> Surface {
    var packed: PackedSurface;
    packed.core = light.core;
    packed.specular = light.specular;
#ifdef DIELECTRIC
    packed.dielectric = light.dielectric;
#endif
    packed.geometric_normal = light.geometric_normal;
    packed.emissive = 0u;
    return unpack_surface(packed);
}

// Its geometric normal, which is stored whatever the flags say.
fn virtual_light_normal(light: VirtualLight) -> vec3f {
    return octahedral_unpack(light.geometric_normal);
}
