// What the texels of reflective shadow maps, taken as virtual lights, send to the camera: `weigh` writes the flux P that each texel reflects, and `estimate`
// the radiance c over that flux for each cell, a square of 2^level texels a side.

#import lobelia::brdf::{Brdf, albedo_estimate, brdf_from_surface, evaluate_brdf, fresnel, phong_exponent}
#import lobelia::math::{PI, luminance, safe_normalize, square}
#import lobelia::microfacet_lobe::{filtered_ndf_shading, ggx_lobe_one, glossy_sg_light_two, lobe_shading, phong_lobe, reflection_lobe_sg}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_flux, rsm_footprint, rsm_lifted_position, rsm_position, rsm_texel, rsm_texel_uv}
#import lobelia::sampling::{hash, r2_point}
#import lobelia::sampling_density::{density_place, density_side, density_weight, descend_density, reflected_flux, sample_density, sampling_density_total, storable_weight}
#import lobelia::scene::{PunctualLight, View, scene_position}
#import lobelia::sg::sg_integral
#import lobelia::sg_cosine::clamped_cosine_integral
#import lobelia::sg_light::{cone_sharpness, scaled_light_product}
#import lobelia::surface::{PackedSurface, Surface, load_specular, unpack_surface}

struct Settings {
    // Cells a side of each face: a power of two, at least 8.
    cells: u32,
    // A cell is a texel of this level of the sums of flux.
    level: u32,
    // View samples in all, and how many of them each cell is held against.
    samples: u32,
    subset: u32,
    seed: u32,
    // How many disks of equal reflected flux the texels are taken for.
    patches: f32,
    padding_a: u32,
    padding_b: u32,
}

// Workgroups of a dispatch.
struct Range {
    first: u32,
    end: u32,
    padding_a: u32,
    padding_b: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> settings: Settings;
@group(0) @binding(2) var<uniform> range: Range;
@group(0) @binding(3) var<storage, read> faces: array<RsmFace>;
@group(0) @binding(4) var<storage, read> lights: array<PunctualLight>;
@group(0) @binding(5) var rsm_depth: texture_depth_2d_array;
@group(0) @binding(6) var rsm_core: texture_2d_array<u32>;
#ifdef SPECULAR
@group(0) @binding(7) var rsm_specular: texture_2d_array<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(8) var rsm_geometric_normal: texture_2d_array<u32>;
#endif
@group(0) @binding(9) var gbuffer_depth: texture_depth_2d;
@group(0) @binding(10) var gbuffer_core: texture_2d<u32>;
#ifdef SPECULAR
@group(0) @binding(11) var gbuffer_specular: texture_2d<u32>;
#endif
#ifdef NORMAL_MAP
@group(0) @binding(12) var gbuffer_geometric_normal: texture_2d<u32>;
#endif
// The finest level, to be written; and all levels.
@group(0) @binding(13) var weights: texture_storage_2d_array<r32float, write>;
@group(0) @binding(14) var flux_sums: texture_2d_array<f32>;
// Per face, row by row; -1 where nothing is known.
@group(0) @binding(15) var<storage, read_write> ratios: array<f32>;

// Largest ratio that is kept, 1/(m^2 sr).
const MOST_RATIO: f32 = 1e18;

// A texel, taken as a virtual light that flux falls on whose largest channel is 1.
struct Emitter {
    position: vec3f,
    // Of the disk that it stands for.
    radius: f32,
    flux: vec3f,
    // Reflected flux times the weight of its face; 0: nothing is there.
    reflected: f32,
    normal: vec3f,
    geometric_normal: vec3f,
    to_source: vec3f,
    brdf: Brdf,
}

struct ViewSample {
    position: vec3f,
    seen: bool,
    normal: vec3f,
    geometric_normal: vec3f,
    to_viewer: vec3f,
    // What contributions are multiplied by.
    scale: f32,
    brdf: Brdf,
}

var<workgroup> view_samples: array<ViewSample, 64>;
#ifdef RELATIVE
var<workgroup> emitters: array<Emitter, 32>;
var<workgroup> brightness: array<f32, 64>;
#endif

fn texel_surface(texel: vec2u, face: RsmFace) -> Surface {
    let place = rsm_texel(face, texel);
    var packed: PackedSurface;
    packed.core = textureLoad(rsm_core, place, face.layer, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(rsm_specular, place, face.layer, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(rsm_geometric_normal, place, face.layer, 0).x;
#endif
    return unpack_surface(packed);
}

fn texel_weight(texel: vec2u, face_index: u32) -> f32 {
    if face_index >= arrayLength(&faces) {
        return 0.0;
    }
    let face = faces[face_index];
    let resolution = face.resolution;
    if any(texel >= vec2u(resolution)) {
        return 0.0;
    }
    let depth = textureLoad(rsm_depth, rsm_texel(face, texel), face.layer, 0);
    if depth <= 0.0 {
        return 0.0;
    }
    let uv = rsm_texel_uv(texel, resolution);
    let flux = rsm_flux(face, lights[face.light], uv, f32(resolution));
    return face.weight * reflected_flux(texel_surface(texel, face), flux, rsm_direction_to_light(face, rsm_position(face, uv, depth)));
}

@compute @workgroup_size(8, 8)
fn weigh(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(weights)) {
        return;
    }
    let place = density_place(id.xy, id.z, textureDimensions(weights).x, density_side(faces[0].resolution));
    textureStore(weights, id.xy, id.z, vec4f(storable_weight(texel_weight(place.texel, place.face)), 0.0, 0.0, 0.0));
}

// `share`: of how many patches the cell has the flux.
fn load_emitter(texel: vec2u, face_index: u32, share: f32) -> Emitter {
    var emitter: Emitter;
    let face = faces[face_index];
    let resolution = face.resolution;
    let depth = textureLoad(rsm_depth, rsm_texel(face, texel), face.layer, 0);
    if any(texel >= vec2u(resolution)) || depth <= 0.0 {
        return emitter;
    }
    let uv = rsm_texel_uv(texel, resolution);
    let flux = rsm_flux(face, lights[face.light], uv, f32(resolution));
    let surface = texel_surface(texel, face);
    emitter.position = rsm_lifted_position(face, uv, depth, surface.geometric_normal, f32(resolution));
    emitter.flux = flux / max(max(max(flux.x, flux.y), flux.z), 1e-38);
    emitter.normal = surface.normal;
    emitter.geometric_normal = surface.geometric_normal;
    emitter.to_source = rsm_direction_to_light(face, emitter.position);
    emitter.reflected = face.weight * reflected_flux(surface, emitter.flux, emitter.to_source);
    emitter.brdf = brdf_from_surface(surface);
    let width = rsm_footprint(face, depth, f32(resolution)) * f32(1u << settings.level);
    let slant = max(dot(surface.geometric_normal, emitter.to_source), 0.1);
    // No finer than the cell, and no more than 64 times as wide.
    emitter.radius = width * inverseSqrt(PI * slant * clamp(share, 2.44140625e-4, 1.0));
    return emitter;
}

// A view sample: the surface at a point of a low-discrepancy sequence over the screen, any run of which is spread over all of it.
fn load_view_sample(index: u32) -> ViewSample {
    var out: ViewSample;
    let extent = textureDimensions(gbuffer_depth);
    let pixel = min(vec2u(r2_point(index, settings.seed) * vec2f(extent)), extent - vec2u(1u));
    let depth = textureLoad(gbuffer_depth, pixel, 0);
    if depth <= 0.0 {
        return out;
    }
    var packed: PackedSurface;
    packed.core = textureLoad(gbuffer_core, pixel, 0).xy;
#ifdef SPECULAR
    load_specular(&packed, textureLoad(gbuffer_specular, pixel, 0));
#endif
#ifdef NORMAL_MAP
    packed.geometric_normal = textureLoad(gbuffer_geometric_normal, pixel, 0).x;
#endif
    let surface = unpack_surface(packed);
    out.position = scene_position(view, vec2f(pixel), depth);
    out.seen = true;
    out.scale = 1.0;
    out.normal = surface.normal;
    out.geometric_normal = surface.geometric_normal;
    out.to_viewer = safe_normalize(view.position - out.position, surface.normal);
    out.brdf = brdf_from_surface(surface);
    return out;
}

#ifdef GAUSSIAN
// Radiance that the surface of a view sample reflects towards the camera of an SG light of peak radiance 1.
fn reflected_of_lobe(at: ViewSample, axis: vec3f, sharpness: f32) -> vec3f {
    var sides = dot(at.normal, at.to_viewer);
#ifdef NORMAL_MAP
    sides = min(sides, dot(at.geometric_normal, axis) * dot(at.geometric_normal, at.to_viewer));
#endif
    if !(sides > 0.0) {
        return vec3f(0.0);
    }
    let across = cross(at.normal, axis);
    var reflected = at.brdf.diffuse * clamped_cosine_integral(sharpness, dot(at.normal, axis), min(dot(across, across), 1.0));
#ifdef SPECULAR
    let alpha = at.brdf.alpha;
    var glossy: f32;
#ifdef NDF_PHONG
    glossy = lobe_shading(alpha, phong_lobe(phong_exponent(alpha)), at.normal, at.to_viewer, axis, sharpness);
#else
    if alpha > 0.5 || 2.0 * sharpness * alpha * alpha > 10.0 {
        glossy = filtered_ndf_shading(alpha, at.normal, at.to_viewer, axis, sharpness);
    } else {
        glossy = glossy_sg_light_two(alpha, at.normal, at.to_viewer, axis, sharpness);
    }
#endif
    let half_vector = safe_normalize(at.to_viewer + axis, at.normal);
    reflected += max(glossy, 0.0) * fresnel(at.brdf, clamp(dot(at.to_viewer, half_vector), 0.0, 1.0));
#endif
    return reflected;
}

// Luminance of what an emitter sends to the camera at a view sample, without visibility. The emitter is a disk seen as a cone; the diffuse lobe that it
// sends is a constant with its cosine pulled out, the specular one an SG about the mirror direction; both times the cone are SG lights again.
fn contribution(emitter: Emitter, at: ViewSample) -> f32 {
    let offset = emitter.position - at.position;
    let direction = safe_normalize(offset, at.normal);
    let leaving = -dot(emitter.normal, direction);
    var sides = leaving;
#ifdef NORMAL_MAP
    sides = min(sides, -dot(emitter.geometric_normal, direction) * dot(emitter.geometric_normal, emitter.to_source));
#endif
    if !(sides > 0.0) {
        return 0.0;
    }
    let distance = length(offset);
    // Sharpness stays below 5e7, where the forms of lobes are tested.
    let radius = max(emitter.radius, 3e-4 * distance);
    let peak = 2.0 / (PI * radius * radius);
    var radiance = emitter.brdf.diffuse * leaving * reflected_of_lobe(at, direction, cone_sharpness(distance, radius));
#ifdef SPECULAR
#ifdef NDF_PHONG
    let ndf_sharpness = phong_lobe(phong_exponent(emitter.brdf.alpha)).sharpness;
#else
    let ndf_sharpness = ggx_lobe_one(emitter.brdf.alpha).sharpness;
#endif
    let sent = reflection_lobe_sg(ndf_sharpness, emitter.normal, emitter.to_source);
    let product = scaled_light_product(-sent.axis, sent.sharpness, direction, distance, radius);
    let amplitude = exp(product.log_amplitude) / sg_integral(sent.sharpness);
    // What is too dim to matter is not worth the second lobe.
    if amplitude > 1e-6 {
        let specular = albedo_estimate(emitter.brdf, max(dot(emitter.normal, emitter.to_source), 0.0)) - emitter.brdf.diffuse * PI;
        radiance += max(specular, vec3f(0.0)) * amplitude * reflected_of_lobe(at, product.axis, product.scaled_sharpness / (radius * radius));
    }
#endif
    return luminance(emitter.flux * min(radiance, vec3f(1e14))) * peak;
}
#else
// Luminance of what an emitter sends to the camera at a view sample, without visibility: that of a virtual point light no nearer than its radius.
fn contribution(emitter: Emitter, at: ViewSample) -> f32 {
    let offset = emitter.position - at.position;
    let direction = safe_normalize(offset, at.normal);
    let cosines = max(dot(at.normal, direction), 0.0) * max(-dot(emitter.normal, direction), 0.0);
    if cosines <= 0.0 {
        return 0.0;
    }
    let geometry = cosines / max(dot(offset, offset), square(emitter.radius));
    let emitted = evaluate_brdf(emitter.brdf, emitter.normal, emitter.geometric_normal, emitter.to_source, -direction);
    let reflected = evaluate_brdf(at.brdf, at.normal, at.geometric_normal, direction, at.to_viewer);
    return luminance(emitter.flux * min(emitted, vec3f(1e10)) * min(reflected, vec3f(1e10))) * geometry;
}
#endif

// How many of the patches of equal flux have the flux of a cell.
fn patch_share(flux: f32) -> f32 {
    return settings.patches * (flux / max(sampling_density_total(flux_sums), 1e-38));
}

// Contribution over reflected flux.
fn ratio_of(emitter: Emitter, at: ViewSample) -> f32 {
    return min(contribution(emitter, at) * select(0.0, 1.0 / emitter.reflected, emitter.reflected > 1e-30), MOST_RATIO);
}

#ifdef RELATIVE
// Divides by the brightness of each view sample: what 32 texels, picked by flux, send on average, and a tenth of the mean of that on top, so that the darkest
// pixels do not outweigh all others.
fn scale_view_samples(local: u32, first_emitter: u32) {
    if local < 32u {
        var emitter: Emitter;
        let found = sample_density(flux_sums, r2_point(first_emitter + local, ~settings.seed));
        if found.probability > 0.0 {
            let flux = density_weight(flux_sums, vec2i(found.texel >> vec2u(settings.level)), i32(found.face), i32(settings.level));
            emitter = load_emitter(found.texel, found.face, patch_share(flux));
        }
        emitters[local] = emitter;
    }
    workgroupBarrier();
    var own = 0.0;
    if view_samples[local].seen {
        for (var index = 0u; index < 32u; index++) {
            own += ratio_of(emitters[index], view_samples[local]) / 32.0;
        }
    }
    brightness[local] = own;
    workgroupBarrier();
    var sum = 0.0;
    var seen = 0.0;
    for (var index = 0u; index < 64u; index++) {
        sum += brightness[index];
        seen += select(0.0, 1.0, view_samples[index].seen);
    }
    let divisor = own + 0.1 * sum / max(seen, 1.0);
    view_samples[local].scale = select(0.0, 1.0 / divisor, divisor > 1e-36);
}
#endif

// A workgroup takes 64 cells that lie far apart and holds them against the same run of view samples: neighbouring cells meet other runs, and the blur that
// follows brings these together. Every sixteen samples another texel stands for the cell, as likely as it reflects flux.
@compute @workgroup_size(64)
fn estimate(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = range.first + id.y * groups.x + id.x;
    if group >= range.end {
        return;
    }
    let stride = settings.cells / 8u;
    let face = group / (stride * stride);
    let place = group % (stride * stride);
    let cell = vec2u(place % stride, place / stride) + stride * vec2u(local % 8u, local / 8u);
    let flux = density_weight(flux_sums, vec2i(cell), i32(face), i32(settings.level));
    let share = patch_share(flux);
    let index = (face * settings.cells + cell.y) * settings.cells + cell.x;
    // A multiple of the run's length, taken modulo the number of samples: all of them are met equally often.
    let start = (group * settings.subset) % settings.samples;
    var sum = 0.0;
    var seen = 0.0;
    for (var first = 0u; first < settings.subset; first += 64u) {
        let count = min(settings.subset - first, 64u);
        workgroupBarrier();
        var own_sample: ViewSample;
        if local < count {
            own_sample = load_view_sample((start + first + local) % settings.samples);
        }
        view_samples[local] = own_sample;
        workgroupBarrier();
#ifdef RELATIVE
        scale_view_samples(local, group * settings.subset + first);
        workgroupBarrier();
#endif
        if flux > 0.0 {
            for (var part = 0u; part < count; part += 16u) {
                let draw = r2_point((first + part) / 16u, hash(index) ^ settings.seed);
                let emitter = load_emitter(descend_density(flux_sums, vec2i(cell), i32(face), i32(settings.level), draw).texel, face, share);
                for (var slot = part; slot < min(part + 16u, count); slot++) {
                    if view_samples[slot].seen {
                        seen += 1.0;
                        let ratio = min(ratio_of(emitter, view_samples[slot]) * view_samples[slot].scale, MOST_RATIO);
#ifdef RELATIVE
                        sum += ratio * ratio;
#else
                        sum += ratio;
#endif
                    }
                }
            }
        }
    }
    var ratio = sum / max(seen, 1.0);
#ifdef RELATIVE
    ratio = sqrt(ratio);
#endif
    ratios[index] = select(-1.0, min(ratio, MOST_RATIO), seen > 0.0);
}
