// Patches of reflective shadow maps and their averages over blocks of texels: what virtual spherical Gaussian lights are made of.
// Mirrors `lobelia-frame`'s `PatchMoments`.
//
// Averages are merged, never formed as differences of squares: the variance of positions grows by the scatter of the parts' means, and so does one minus
// the squared length of an averaged direction. Far from the origin and for sharp lobes the difference would have no digit left.
//
// Flags: SPECULAR; LOBE_TOKSVIG or LOBE_BANERJEE: how a lobe's sharpness is coded as the length of its mean direction (neither: exactly).
#define_import_path lobelia::patch_moments

#import lobelia::averaged_direction::{AveragedDirection, PositionVariance, averaged_direction_length, mean_cosine_banerjee, mean_cosine_toksvig, merge_averaged_directions, merge_position_variance, one_minus_mean_cosine_squared, sharpness_from_averaged_direction, sharpness_from_averaged_direction_banerjee, sharpness_from_averaged_direction_toksvig}
#import lobelia::brdf::{brdf_from_surface, phong_exponent, specular_albedo}
#import lobelia::math::{PI, luminance}
#import lobelia::microfacet_lobe::{ndf_sharpness_ggx, ndf_sharpness_ggx_broad, ndf_sharpness_phong, reflection_lobe_sg}
#import lobelia::octahedral::{octahedral_pack, octahedral_unpack}
#import lobelia::reflective_shadow_map::{RsmFace, rsm_direction_to_light, rsm_flux, rsm_footprint, rsm_position}
#import lobelia::scene::PunctualLight
#import lobelia::surface::{Surface, shading_normal_factor}

// A set of patches. Flux is the mean over texels, the rest is weighted with flux.
struct PatchMoments {
    // Scene space, metres.
    position: vec3f,
    // Mean squared distance from it, m^2.
    variance: f32,
    // Flux that is reflected diffusely, W.
    diffuse: vec3f,
    // Geometric normal.
    normal: AveragedDirection,
    // Flux that is reflected by specular lobes, W; without SPECULAR 0.
    specular: vec3f,
    // Direction of those lobes; the mean is the shorter, the broader they are.
    lobe: AveragedDirection,
}

struct StoredPatchMoments {
    position: vec3f,
    variance: f32,
    diffuse: vec3f,
    normal: u32,
#ifdef SPECULAR
    specular: vec3f,
    lobe: u32,
#endif
    normal_one_minus_length_squared: f32,
#ifdef SPECULAR
    lobe_one_minus_length_squared: f32,
#endif
}

fn pack_patch_moments(moments: PatchMoments) -> StoredPatchMoments {
    var stored: StoredPatchMoments;
    stored.position = moments.position;
    stored.variance = moments.variance;
    stored.diffuse = moments.diffuse;
    stored.normal = octahedral_pack(moments.normal.axis);
    stored.normal_one_minus_length_squared = moments.normal.one_minus_length_squared;
#ifdef SPECULAR
    stored.specular = moments.specular;
    stored.lobe = octahedral_pack(moments.lobe.axis);
    stored.lobe_one_minus_length_squared = moments.lobe.one_minus_length_squared;
#endif
    return stored;
}

fn unpack_patch_moments(stored: StoredPatchMoments) -> PatchMoments {
    var moments: PatchMoments;
    moments.position = stored.position;
    moments.variance = stored.variance;
    moments.diffuse = stored.diffuse;
    moments.normal = AveragedDirection(octahedral_unpack(stored.normal), stored.normal_one_minus_length_squared);
#ifdef SPECULAR
    moments.specular = stored.specular;
    moments.lobe = AveragedDirection(octahedral_unpack(stored.lobe), stored.lobe_one_minus_length_squared);
#else
    moments.lobe = moments.normal;
#endif
    return moments;
}

// Weight of a set among others: the luminance of what it reflects.
fn patch_weight(moments: PatchMoments) -> f32 {
    return luminance(moments.diffuse + moments.specular);
}

// Where the records of a level begin. `side`: texels a side of the finest level, `level` >= 2, the first one that is stored.
fn patch_moments_level_start(side: u32, faces: u32, level: u32) -> u32 {
    let first = side >> 2u;
    let own = side >> level;
    // 4^k + 4^(k-1) + ... is a geometric sum of whole numbers.
    return faces * ((first * first - own * own) / 3u * 4u);
}

fn patch_moments_address(side: u32, faces: u32, level: u32, texel: vec2u, face: u32) -> u32 {
    let own = side >> level;
    return patch_moments_level_start(side, faces, level) + (face * own + texel.y) * own + texel.x;
}

// Length of the mean direction of a lobe, as one minus its square.
fn code_sharpness(sharpness: f32) -> f32 {
#ifdef LOBE_TOKSVIG
    let r = mean_cosine_toksvig(sharpness);
    return (1.0 + r) / (1.0 + sharpness);
#else
#ifdef LOBE_BANERJEE
    // The cubic's own inverse keeps the digits of short complements: q = R (3 - R^2) / sharpness.
    let r = mean_cosine_banerjee(sharpness);
    return select(1.0 - r * r, r * (3.0 - r * r) / max(sharpness, 1.0), sharpness > 1.0);
#else
    return one_minus_mean_cosine_squared(sharpness);
#endif
#endif
}

fn decode_sharpness(one_minus_length_squared: f32) -> f32 {
    let r = averaged_direction_length(one_minus_length_squared);
#ifdef LOBE_TOKSVIG
    return sharpness_from_averaged_direction_toksvig(r, one_minus_length_squared);
#else
#ifdef LOBE_BANERJEE
    return sharpness_from_averaged_direction_banerjee(r, one_minus_length_squared);
#else
    return sharpness_from_averaged_direction(r, one_minus_length_squared);
#endif
#endif
}

// Sharpness of the SG that stands for the scene's distribution of normals.
fn patch_ndf_sharpness(alpha: f32) -> f32 {
#ifdef NDF_PHONG
    return ndf_sharpness_phong(phong_exponent(alpha));
#else
    return select(ndf_sharpness_ggx(alpha), ndf_sharpness_ggx_broad(alpha), alpha > 0.5);
#endif
}

// The set of one texel. `depth` is that of the map, 0 where nothing is seen.
fn patch_of_texel(face: RsmFace, light: PunctualLight, uv: vec2f, resolution: f32, depth: f32, surface: Surface) -> PatchMoments {
    var moments: PatchMoments;
    moments.normal = AveragedDirection(surface.geometric_normal, 0.0);
    moments.lobe = moments.normal;
    if depth <= 0.0 {
        return moments;
    }
    moments.position = rsm_position(face, uv, depth);
    let to_light = rsm_direction_to_light(face, moments.position);
    // Uniform over the texel's area, which is stretched where the surface is seen at an angle.
    let footprint = rsm_footprint(face, depth, resolution);
    let cosine = max(dot(surface.geometric_normal, to_light), 0.05);
    moments.variance = footprint * footprint / 12.0 * (1.0 + 1.0 / (cosine * cosine));
    let flux = min(rsm_flux(face, light, uv, resolution) * shading_normal_factor(surface, to_light), vec3f(1e24));
    let brdf = brdf_from_surface(surface);
    moments.diffuse = flux * (brdf.diffuse * PI);
#ifdef SPECULAR
    moments.specular = flux * specular_albedo(brdf, max(dot(surface.normal, to_light), 0.0));
    let reflected = reflection_lobe_sg(patch_ndf_sharpness(brdf.alpha), surface.normal, to_light);
    moments.lobe = AveragedDirection(reflected.axis, clamp(code_sharpness(reflected.sharpness), 1e-8, 1.0));
#endif
    return moments;
}

// The union of four sets, taken with weights >= 0 (shares of area, which need not sum to 1).
fn merge_patch_moments(parts: array<PatchMoments, 4>, weights: vec4f) -> PatchMoments {
    let a = parts[0];
    let b = parts[1];
    let c = parts[2];
    let d = parts[3];
    let w = weights / max(weights.x + weights.y + weights.z + weights.w, 1e-30);
    var moments: PatchMoments;
    moments.diffuse = a.diffuse * w.x + b.diffuse * w.y + c.diffuse * w.z + d.diffuse * w.w;
    let all = w * vec4f(patch_weight(a), patch_weight(b), patch_weight(c), patch_weight(d));
    let place = merge_position_variance(
        array<PositionVariance, 4>(
            PositionVariance(a.position, a.variance),
            PositionVariance(b.position, b.variance),
            PositionVariance(c.position, c.variance),
            PositionVariance(d.position, d.variance),
        ),
        all,
    );
    moments.position = place.mean;
    moments.variance = place.variance;
    moments.normal = merge_averaged_directions(array<AveragedDirection, 4>(a.normal, b.normal, c.normal, d.normal), all);
#ifdef SPECULAR
    moments.specular = a.specular * w.x + b.specular * w.y + c.specular * w.z + d.specular * w.w;
    let shiny = w * vec4f(luminance(a.specular), luminance(b.specular), luminance(c.specular), luminance(d.specular));
    moments.lobe = merge_averaged_directions(array<AveragedDirection, 4>(a.lobe, b.lobe, c.lobe, d.lobe), shiny);
#else
    moments.lobe = moments.normal;
#endif
    return moments;
}
