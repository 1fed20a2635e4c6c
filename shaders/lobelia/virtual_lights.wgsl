// The accessor of virtual lights. Mirrors `lobelia-frame`'s `VirtualLight`: 64 bytes a record.
#define_import_path lobelia::virtual_lights

#import lobelia::octahedral::octahedral_unpack
#import lobelia::surface::{PackedSurface, Surface, unpack_surface}

struct VirtualLight {
    // Scene space, metres.
    position: vec3f,
    // Of the disk that the light stands for; 0 for a point.
    radius: f32,
    // Incident, over the sampling density, W.
    flux: vec3f,
    geometric_normal: u32,
    // Unit, to the source that lights it.
    direction_to_source: vec3f,
    specular: u32,
    core: vec2u,
    source: u32,
}

// The surface that reflects.
fn virtual_light_surface(light: VirtualLight) -> Surface {
    var packed: PackedSurface;
    packed.core = light.core;
    packed.specular = light.specular;
    packed.geometric_normal = light.geometric_normal;
    packed.emissive = 0u;
    return unpack_surface(packed);
}

// Its geometric normal, which is stored whatever the flags say.
fn virtual_light_normal(light: VirtualLight) -> vec3f {
    return octahedral_unpack(light.geometric_normal);
}
