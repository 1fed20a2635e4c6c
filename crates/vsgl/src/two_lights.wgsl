// All patches of all maps as two lights: one of the Lambertian lobes, one of the specular ones.

#import lobelia::averaged_direction::{AveragedDirection, PositionVariance, merge_averaged_directions, merge_position_variance, radius_from_variance}
#import lobelia::math::luminance
#import lobelia::octahedral::octahedral_pack
#import lobelia::patch_moments::{StoredPatchMoments, decode_sharpness, patch_moments_level_start, unpack_patch_moments}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light}
#import lobelia::surface::{Surface, pack_surface}
#import lobelia::virtual_lights::{VirtualLight, VirtualLightLobes}

struct Settings {
    side: u32,
    faces: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(2) var<storage, read> moments: array<StoredPatchMoments>;
@group(0) @binding(3) var<storage, read_write> virtual_lights: array<VirtualLight>;
@group(0) @binding(4) var<storage, read_write> lobes: array<VirtualLightLobes>;

// One lobe of a set of patches.
struct Gathered {
    flux: vec3f,
    place: PositionVariance,
    // Normal, or direction of the specular lobe.
    direction: AveragedDirection,
    // That the brightest part belongs to: it says where the light's source is.
    face: u32,
    brightest: f32,
}

const THREADS: u32 = 64u;

var<workgroup> partial: array<Gathered, THREADS>;

fn both(a: Gathered, b: Gathered) -> Gathered {
    let weights = vec4f(luminance(a.flux), luminance(b.flux), 0.0, 0.0);
    let place = merge_position_variance(array<PositionVariance, 4>(a.place, b.place, a.place, a.place), weights);
    let direction = merge_averaged_directions(array<AveragedDirection, 4>(a.direction, b.direction, a.direction, a.direction), weights);
    return Gathered(a.flux + b.flux, place, direction, select(b.face, a.face, a.brightest >= b.brightest), max(a.brightest, b.brightest));
}

// Sums over all records of the finest stored level. The order is that of the map, so equal maps give equal lights.
fn sum_up(local: u32, specular: bool) -> Gathered {
    let side = settings.side >> 2u;
    let records = settings.faces * side * side;
    let start = patch_moments_level_start(settings.side, settings.faces, 2u);
    var sum: Gathered;
    sum.direction = AveragedDirection(vec3f(0.0, 1.0, 0.0), 0.0);
    let length = (records + THREADS - 1u) / THREADS;
    for (var index = local * length; index < min((local + 1u) * length, records); index++) {
        let block = unpack_patch_moments(moments[start + index]);
        var part: Gathered;
        // A record holds the mean over sixteen texels.
        part.flux = 16.0 * select(block.diffuse, block.specular, specular);
        part.place = PositionVariance(block.position, block.variance);
        part.direction = block.normal;
        if specular {
            part.direction = block.lobe;
        }
        part.face = index / (side * side);
        part.brightest = luminance(part.flux);
        if part.brightest > 0.0 {
            sum = both(sum, part);
        }
    }
    workgroupBarrier();
    partial[local] = sum;
    for (var step = THREADS / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if local < step {
            partial[local] = both(partial[local], partial[local + step]);
        }
    }
    workgroupBarrier();
    return partial[0];
}

fn point_of(sum: Gathered, surface: Surface) -> VirtualLight {
    var light: VirtualLight;
    light.position = sum.place.mean;
    light.radius = radius_from_variance(sum.place.variance);
    light.flux = min(sum.flux, vec3f(1e24));
    light.geometric_normal = octahedral_pack(surface.normal);
    light.direction_to_source = rsm_direction_to_light(faces[sum.face], sum.place.mean);
    let packed = pack_surface(surface);
    light.core = packed.core;
    light.specular = packed.specular;
#ifdef DIELECTRIC
    light.dielectric = packed.dielectric;
#endif
    light.source = faces[sum.face].light;
    return light;
}

@compute @workgroup_size(64)
fn reduce(@builtin(local_invocation_index) local: u32) {
    let dull = sum_up(local, false);
    var surface: Surface;
    surface.roughness = 1.0;
    if local == 0u {
        surface.normal = dull.direction.axis;
        surface.geometric_normal = dull.direction.axis;
        surface.base_color = vec3f(1.0);
        var record: VirtualLightLobes;
        record.position = dull.place.mean;
        record.radius = radius_from_variance(dull.place.variance);
        record.diffuse = min(dull.flux, vec3f(1e24));
        record.normal = octahedral_pack(dull.direction.axis);
        record.normal_one_minus_length_squared = dull.direction.one_minus_length_squared;
        virtual_lights[0] = point_of(dull, surface);
        lobes[0] = record;
    }
#ifdef SPECULAR
    let shiny = sum_up(local, true);
    if local == 0u {
        // A perfect mirror but for a roughness that makes the lobe as broad as it is: for light along the normal, sharpness is 1 / (2 alpha^2).
        let sharpness = decode_sharpness(shiny.direction.one_minus_length_squared);
        let alpha = clamp(inverseSqrt(2.0 * sharpness + 1.0), 0.001, 1.0);
        surface.roughness = sqrt(alpha);
        surface.metallic = 1.0;
        surface.specular = 1.0;
        surface.normal = shiny.direction.axis;
        surface.geometric_normal = shiny.direction.axis;
        var record: VirtualLightLobes;
        record.position = shiny.place.mean;
        record.radius = radius_from_variance(shiny.place.variance);
        record.normal = octahedral_pack(shiny.direction.axis);
        record.normal_one_minus_length_squared = 1.0;
        record.specular = min(shiny.flux, vec3f(1e24));
        record.lobe_axis = octahedral_pack(shiny.direction.axis);
        record.lobe_sharpness = sharpness;
        virtual_lights[1] = point_of(shiny, surface);
        lobes[1] = record;
    }
#endif
}
