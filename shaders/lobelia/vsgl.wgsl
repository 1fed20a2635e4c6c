// What a virtual spherical Gaussian light sends to the viewer by way of a surface, in closed form: Tokuyoshi 2014 (`printed`), Tokuyoshi 2015 (`gaussian`) and two
// forms of this project. The twin in `f64` is `crates/lobes/src/vsgl.rs`; `tests/tests/vsgl_limits.rs` holds them against the point light and, in `f64`, against a disk.
//
// The light is a disk of radius r with a Lambertian and an SG lobe, the surface has a Lambertian and a glossy lobe. Radiance is a sum of four products,
// each an integral over the cone in which the disk is seen, divided by pi r^2; written so that nothing divides by r^2, they tend to the point light's
// as r tends to 0, and stay finite as the distance does.
//
// Flags: SPECULAR, NDF_PHONG, NORMAL_MAP.
#define_import_path lobelia::vsgl

#import lobelia::averaged_direction::{DIFFUSE_MEAN_COSINE, sharpness_from_averaged_direction}
#import lobelia::brdf::{Brdf, brdf_from_surface, ggx_visibility, phong_exponent, phong_visibility, specular_albedo}
#import lobelia::asg::{AnisotropicSphericalGaussian, asg_sg_integral, asg_sg_integral_printed, asg_to_local}
#import lobelia::math::{INV_PI, PI, fifth_power, luminance, safe_normalize}
#import lobelia::microfacet_lobe::{ggx_lobe_one, glossy_sg_light_two, phong_lobe, reflection_axis, reflection_lobe_asg, reflection_lobe_sg}
#import lobelia::octahedral::{octahedral_pack, octahedral_unpack}
#import lobelia::patch_moments::patch_ndf_sharpness
#import lobelia::sg::{sg_integral, sg_product}
#import lobelia::sg_cosine::{clamped_cosine_integral, hemisphere_integral}
#import lobelia::sg_light::{bias_reduction_applies, combined_sharpness_bound, cone_scaled_sharpness, vsgl_kernel_diffuse_receiver, vsgl_kernel_fast}
#import lobelia::surface::Surface
#import lobelia::virtual_lights::{VirtualLight, VirtualLightLobes, virtual_light_surface}

// The microfacet lobe of one end: how a surface reflects light between a fixed direction (to the viewer; at a light, to its source) and others.
struct GlossyLobe {
    normal: vec3f,
    // The fixed direction.
    fixed_direction: vec3f,
    alpha: f32,
    reflectance_normal: vec3f,
    reflectance_grazing: f32,
}

// A light, ready to be gathered.
struct SgLight {
    // Scene space, metres.
    position: vec3f,
    radius: f32,
    // Intensity of the Lambertian lobe along the normal, W/sr.
    diffuse: vec3f,
    // One minus the squared length of the mean normal.
    spread: f32,
    normal: vec3f,
    // Of the SG lobe, which is about `axis`.
    sharpness: f32,
    // Its intensity at the axis, W/sr.
    specular: vec3f,
    axis: vec3f,
    // The same lobe as that of a microfacet surface: flux falling on it, W, and how much wider than the surface's own it is, as an inverse sharpness.
    flux: vec3f,
    widening: f32,
    lobe: GlossyLobe,
#ifdef NDF_PHONG
    sg_lobe: AnisotropicSphericalGaussian,
#endif
}

// A surface, ready to receive.
struct SgReceiver {
    position: vec3f,
    normal: vec3f,
    geometric_normal: vec3f,
    // Diffuse albedo over pi.
    diffuse: vec3f,
    brdf: Brdf,
    // The reflection lobe, and that of an SG distribution of normals.
    lobe: GlossyLobe,
    sg_lobe: AnisotropicSphericalGaussian,
    // Sharpness of the round SG that is as broad as it.
    strength: f32,
}

// Where a light is seen.
struct SgView {
    direction: vec3f,
    distance: f32,
    // Cosine at the light, smoothed where its normals are spread; and how much of the lobe is above the light's own horizon.
    light_cosine: f32,
    above: f32,
}

// E[max(n.w, 0)] over normals n about a mean of length R = sqrt(1 - spread), c: the cosine with the mean's axis. A hyperbola between the limits: max(c, 0)
// for spread 0, 0.28 (exact: 0.25) for 1. Within 0.05 for normals distributed as an SG.
fn spread_cosine(c: f32, spread: f32) -> f32 {
    let mean = c * sqrt(max(1.0 - spread, 0.0));
    return 0.5 * (mean + sqrt(mean * mean + 0.32 * spread));
}

// Share of normals about the mean that have a direction above their horizon: a step for a flat patch.
fn share_above(c: f32, spread: f32) -> f32 {
    return clamp(0.5 + c / (2.0 * sqrt(0.5 * spread) + 1e-4), 0.0, 1.0);
}

#ifdef SPECULAR
// Share of a reflection lobe that is above the horizon: a Gaussian of variance 2 alpha^2 + inverse sharpness about the mirror direction, whose integral is
// written as a root.
fn lobe_above(c: f32, alpha_squared: f32, inverse_sharpness: f32) -> f32 {
    return 0.5 + 0.5 * c * inverseSqrt(c * c + 1.5707963 * (2.0 * alpha_squared + inverse_sharpness));
}

fn glossy_lobe(normal: vec3f, direction: vec3f, brdf: Brdf) -> GlossyLobe {
    return GlossyLobe(normal, direction, brdf.alpha, brdf.reflectance_normal, brdf.reflectance_grazing);
}

fn fixed_cosine(lobe: GlossyLobe) -> f32 {
    return max(dot(lobe.normal, lobe.fixed_direction), 0.0);
}
#endif

// A light of given lobes, and the point at its centre. The SG is cut off at the light's horizon and made larger by what that costs.
fn sg_light_of_lobes(lobes: VirtualLightLobes, point: VirtualLight) -> SgLight {
    var light: SgLight;
    light.position = lobes.position;
    light.radius = lobes.radius;
    light.diffuse = lobes.diffuse * INV_PI;
    light.normal = octahedral_unpack(lobes.normal);
    light.spread = lobes.normal_one_minus_length_squared;
    light.axis = light.normal;
#ifdef SPECULAR
    light.axis = octahedral_unpack(lobes.lobe_axis);
    light.sharpness = lobes.lobe_sharpness;
    let whole = sg_integral(light.sharpness);
    let upper = max(hemisphere_integral(light.sharpness, dot(light.axis, light.normal)), 0.25 * whole);
    // Over all normals a lobe loses nothing, over one what is below its horizon.
    light.specular = lobes.specular / mix(upper, whole, clamp(4.0 * light.spread, 0.0, 1.0));
    // The surface that mirrors the source into the lobe's axis.
    let surface = virtual_light_surface(point);
    var brdf = brdf_from_surface(surface);
    let normal = safe_normalize(light.axis + point.direction_to_source, surface.normal);
    let cosine = max(dot(normal, point.direction_to_source), 0.0);
    light.flux = lobes.specular / max(specular_albedo(brdf, cosine), vec3f(1e-4));
    // Widths, of which even the broadest lobe has a finite one: near 0 a sharpness that was averaged has no digits.
    let own = 1.0 / (2.0 + reflection_lobe_sg(patch_ndf_sharpness(brdf.alpha), normal, point.direction_to_source).sharpness);
    let mean = 1.0 / (2.0 + light.sharpness);
    light.widening = max(mean - own, 0.0);
    // Where the patch is glossier than its centre.
    brdf.alpha = max(brdf.alpha * sqrt(min(mean / own, 1.0)), 1e-3);
    light.lobe = glossy_lobe(normal, point.direction_to_source, brdf);
#ifdef NDF_PHONG
    let ndf = phong_lobe(phong_exponent(brdf.alpha));
    light.sg_lobe = reflection_lobe_asg(ndf.sharpness, normal, point.direction_to_source);
    light.sg_lobe.amplitude = ndf.amplitude;
#endif
#endif
    return light;
}

// A virtual point light as a patch of no extent: its lobes are those of its material.
fn sg_light_of_point(point: VirtualLight) -> SgLight {
    let surface = virtual_light_surface(point);
    let brdf = brdf_from_surface(surface);
    var lobes: VirtualLightLobes;
    lobes.position = point.position;
    lobes.diffuse = point.flux * (brdf.diffuse * PI);
    lobes.normal = point.geometric_normal;
#ifdef SPECULAR
    lobes.specular = point.flux * specular_albedo(brdf, max(dot(surface.normal, point.direction_to_source), 0.0));
    let reflected = reflection_lobe_sg(patch_ndf_sharpness(brdf.alpha), surface.normal, point.direction_to_source);
    lobes.lobe_axis = octahedral_pack(reflected.axis);
    lobes.lobe_sharpness = min(reflected.sharpness, 1e8);
#endif
    var light = sg_light_of_lobes(lobes, point);
#ifdef SPECULAR
    // Not by way of the packed axis: half of its error would be the normal's.
    light.axis = reflected.axis;
    light.lobe.normal = surface.normal;
#endif
    return light;
}

fn sg_receiver(position: vec3f, surface: Surface, brdf: Brdf, to_viewer: vec3f) -> SgReceiver {
    var receiver: SgReceiver;
    receiver.position = position;
    receiver.normal = surface.normal;
    receiver.geometric_normal = surface.geometric_normal;
    receiver.diffuse = brdf.diffuse;
    receiver.brdf = brdf;
#ifdef SPECULAR
#ifdef NDF_PHONG
    let ndf = phong_lobe(phong_exponent(brdf.alpha));
#else
    let ndf = ggx_lobe_one(brdf.alpha);
#endif
    receiver.sg_lobe = reflection_lobe_asg(ndf.sharpness, surface.normal, to_viewer);
    receiver.sg_lobe.amplitude = ndf.amplitude;
    receiver.strength = 2.0 * sqrt(receiver.sg_lobe.eta_x * receiver.sg_lobe.eta_y);
    receiver.lobe = glossy_lobe(surface.normal, to_viewer, brdf);
#endif
    return receiver;
}

fn sg_view(receiver: SgReceiver, light: SgLight) -> SgView {
    let offset = light.position - receiver.position;
    let distance_squared = dot(offset, offset);
    // A light upon the surface is taken for one above it.
    let direction = select(receiver.normal, offset * inverseSqrt(max(distance_squared, 1e-36)), distance_squared > 1e-36);
    let c = -dot(light.normal, direction);
    return SgView(direction, sqrt(distance_squared), spread_cosine(c, light.spread), share_above(c, light.spread));
}

// How a disk is seen from a surface.
struct DiskView {
    // Unit: where its light comes from on average.
    direction: vec3f,
    // Length of the irradiance vector of a disk of radiance 1 / area, 1/m^2: cos / d^2 for a point.
    irradiance: f32,
    // Solid angle over area, 1/m^2.
    solid_angle: f32,
    // Of an SG of that solid angle.
    inverse_sharpness: f32,
}

// The irradiance vector of a uniform Lambertian disk is exact while no part of it is below the surface's horizon: from the form factors of a disk and
// elements parallel and perpendicular to it (Siegel and Howell 2002, configurations 12 and 13), written without differences and without a division by
// the area. A disk that would reach far through the surface counts as one of three times the radius that just touches it, since the patch that it stands for does not. The solid
// angle is that of a spherical cap with the same vector.
fn view_disk(receiver: SgReceiver, light: SgLight) -> DiskView {
    let offset = light.position - receiver.position;
    let d = dot(offset, offset);
    let tilt = dot(light.normal, receiver.normal);
    let above = dot(receiver.normal, offset);
    // Height above the disk's plane, smoothed where its normals are spread.
    var height = -dot(light.normal, offset);
    if light.spread > 0.0 {
        height = 0.5 * (height * sqrt(1.0 - light.spread) + sqrt(height * height * (1.0 - light.spread) + 0.32 * light.spread * d));
    }
    if !(above > 0.0 && height > 0.0) {
        return DiskView(receiver.normal, 0.0, 0.0, 0.0);
    }
    var square = light.radius * light.radius;
    let reach = 1.0 - tilt * tilt;
    if square * reach > 9.0 * above * above {
        square = 9.0 * above * above / reach;
    }
    let difference = d - square;
    let q = max(sqrt(difference * difference + 4.0 * square * height * height), max(1e-9 * (d + square), 1e-36));
    // parallel = 2 height^2 / (q (q + difference)), which for a negative difference is (q - difference) / (2 q square); radial = 2 height / (q (q + d + square)).
    let outside = difference >= 0.0;
    let below = select(2.0 * square, q + difference, outside);
    let inverse = 1.0 / q;
    let parallel = select(q - difference, 2.0 * height * height, outside) * inverse / max(below, 1e-36);
    let radial = 2.0 * height * inverse / (q + d + square);
    let vector = offset * radial - light.normal * (parallel - radial * height);
    let squared = dot(vector, vector);
    if !(squared > 1e-36) {
        return DiskView(receiver.normal, 0.0, 0.0, 0.0);
    }
    let inverse_length = inverseSqrt(squared);
    let irradiance = squared * inverse_length;
    let sine_squared = min(square * irradiance, 1.0);
    let inverse_rim = 1.0 / (1.0 + sqrt(1.0 - sine_squared));
    return DiskView(vector * inverse_length, irradiance, 2.0 * irradiance * inverse_rim, 0.5 * sine_squared * inverse_rim);
}

// Whether a direction can be reflected to the viewer at all: with a normal map, both must be on one side of the geometric surface.
fn faces(receiver: SgReceiver, direction: vec3f) -> bool {
#ifdef NORMAL_MAP
    return dot(receiver.geometric_normal, direction) > 0.0;
#else
    return true;
#endif
}

#ifdef SPECULAR
// F G2 / (4 (n.v) (n.l)) for a cosine between normal and the free direction, and one between both directions.
fn masking_and_fresnel(lobe: GlossyLobe, n_dot_l: f32, v_dot_l: f32) -> vec3f {
#ifdef NDF_PHONG
    let masking = phong_visibility(lobe.alpha, n_dot_l, max(fixed_cosine(lobe), 1e-4));
#else
    let masking = ggx_visibility(lobe.alpha, n_dot_l, fixed_cosine(lobe));
#endif
    // v.h = sqrt((1 + v.l) / 2).
    let v_dot_h = sqrt(clamp(0.5 + 0.5 * v_dot_l, 0.0, 1.0));
    return masking * mix(lobe.reflectance_normal, vec3f(lobe.reflectance_grazing), fifth_power(1.0 - v_dot_h));
}

// GGX filtered with the extent of an SG light in half vectors (Tokuyoshi et al. 2024), so that times G2 F / (4 (n.v) (n.l)) (n.l) and the light's energy it
// gives reflected radiance. What integrates to 1 is D / (4 sqrt(alpha_along^2 s^2 + c^2)); the factor in front undoes its masking for a point light, for
// which D itself is left. inverse_sharpness: of the light, >= 0.
fn filtered_ggx(lobe: GlossyLobe, axis: vec3f, inverse_sharpness: f32) -> f32 {
    let alpha_squared = lobe.alpha * lobe.alpha;
    let u = max((1.0 - lobe.alpha) * (1.0 + lobe.alpha), 0.0);
    let c = fixed_cosine(lobe);
    let c_squared = c * c;
    let s_squared = 1.0 - min(c_squared, 1.0);
    let wide = u * inverse_sharpness;
    // Squared alphas of the filtered distribution, alpha^2 + u wide / (2 + wide) along and alpha^2 + u wide / (2 c^2 + wide) across, with one division.
    let along_below = 2.0 + wide;
    let across_below = max(2.0 * c_squared + wide, 1e-6);
    let inverse = 1.0 / (along_below * across_below);
    let along = (alpha_squared * along_below + u * wide) * (across_below * inverse);
    let across = (alpha_squared * across_below + u * wide) * (along_below * inverse);
    let both = along * across;
    let sum = lobe.fixed_direction + axis;
    let h = sum * inverseSqrt(max(dot(sum, sum), 1e-12));
    // h over the surface: across the plane of incidence, and along it. Looking down, both alphas are the same.
    let slope = cross(lobe.normal, h);
    let y = dot(lobe.fixed_direction, slope);
    let slope_squared = min(dot(slope, slope), 1.0);
    let y_squared = select(0.0, min(y * y / max(s_squared, 1e-4), slope_squared), s_squared > 1e-4);
    // Times both alphas.
    let bracket = (slope_squared - y_squared) * across + y_squared * along + (1.0 - slope_squared) * both;
    // What spreads below the horizon is lost to the reflection but not to the light: the power is a fit to the energy over all lights.
    let kept = lobe_above(c, alpha_squared, 0.0) / lobe_above(c, alpha_squared, inverse_sharpness);
    let normalisation = kept * sqrt(kept * (alpha_squared * s_squared + c_squared) * both / max(along * s_squared + c_squared, 1e-12));
    return INV_PI * normalisation * both / max(bracket * bracket, 1e-36);
}

// Reflectance of a light's specular lobe towards the receiver, 1/sr, as it is over the cone in which the light is seen.
fn light_reflectance(light: SgLight, view: DiskView) -> vec3f {
    let direction = -view.direction;
    let c = dot(light.lobe.normal, direction);
    if !(c > 0.0) {
        return vec3f(0.0);
    }
    let spread = view.inverse_sharpness + light.widening;
#ifdef NDF_PHONG
    let local = asg_to_local(light.sg_lobe, direction);
    let sharpness = 1.0 / max(spread, 1e-8);
    let shape = light.sg_lobe.amplitude * asg_sg_integral_printed(light.sg_lobe.eta_x, light.sg_lobe.eta_y, local, sharpness) / sg_integral(sharpness);
#else
    let shape = filtered_ggx(light.lobe, direction, spread);
#endif
    return masking_and_fresnel(light.lobe, c, dot(light.lobe.fixed_direction, direction)) * shape;
}

// How far the light's lobe draws the direction that its light comes from to its own axis, over how far the cone holds it: an SG's sharpness over the
// cone's, less in the lobe's tail, where GGX falls off as a power and an SG would draw without bound.
fn lobe_pull(light: SgLight, axis: vec3f, view: DiskView) -> f32 {
    let off = axis + view.direction;
    return light.sharpness * view.inverse_sharpness / (1.0 + 0.25 * light.sharpness * dot(off, off));
}

// Radiance that the glossy lobe reflects of an SG light that sends the irradiance 1 onto a surface facing it. What masks it is taken at about the largest
// product of both lobes.
fn glossy_fast(receiver: SgReceiver, axis: vec3f, inverse_sharpness: f32) -> vec3f {
    let own = receiver.strength * inverse_sharpness;
    let share = own / (1.0 + own);
    let c = mix(dot(receiver.normal, axis), fixed_cosine(receiver.lobe), share);
    if !(c > 0.0) {
        return vec3f(0.0);
    }
    let v_dot_l = mix(dot(receiver.lobe.fixed_direction, axis), dot(receiver.lobe.fixed_direction, receiver.sg_lobe.axis), share);
#ifdef NDF_PHONG
    let sharpness = 1.0 / max(inverse_sharpness, 1e-8);
    let local = asg_to_local(receiver.sg_lobe, axis);
    let shape = receiver.sg_lobe.amplitude * asg_sg_integral_printed(receiver.sg_lobe.eta_x, receiver.sg_lobe.eta_y, local, sharpness) / sg_integral(sharpness);
#else
    let shape = filtered_ggx(receiver.lobe, axis, inverse_sharpness);
#endif
    return masking_and_fresnel(receiver.lobe, c, v_dot_l) * (c * shape);
}
#endif

// The cheapest form that is sound everywhere. The disk's irradiance is exact for a Lambertian light; GGX lobes of both ends are filtered by its extent (Phong
// lobes are ASGs). For radius 0 it is the virtual point light, GGX included.
fn vsgl_fast(receiver: SgReceiver, light: SgLight) -> vec3f {
    let view = view_disk(receiver, light);
    let c = dot(receiver.normal, view.direction);
    if !(view.irradiance > 0.0 && c > 0.0 && faces(receiver, view.direction)) {
        return vec3f(0.0);
    }
#ifdef SPECULAR
    let shiny = light.flux * light_reflectance(light, view);
    // Bounded, so that times nothing it is nothing.
    let emitted = min(light.diffuse + shiny, vec3f(1e28));
    // Both lobes of the light as one, whose axis the specular one pulls to itself by its share.
    // The lobe's axis, made again: what is not read from the light's record costs less.
    let lobe_axis = reflection_axis(light.lobe.normal, light.lobe.fixed_direction);
    let pull = lobe_pull(light, lobe_axis, view) * luminance(shiny) / max(luminance(emitted), 1e-30);
    let p = view.direction - lobe_axis * pull;
    let inverse_length = inverseSqrt(max(dot(p, p), 1e-12));
    let axis = p * inverse_length;
    let glossy = glossy_fast(receiver, axis, view.inverse_sharpness * inverse_length);
    return emitted * (receiver.diffuse * (view.irradiance * max(dot(receiver.normal, axis), 0.0)) + glossy * view.solid_angle);
#else
    return light.diffuse * receiver.diffuse * (view.irradiance * c);
#endif
}

#ifdef SPECULAR
fn glossy_accurate(receiver: SgReceiver, axis: vec3f, inverse_sharpness: f32) -> vec3f {
    let alpha = receiver.lobe.alpha;
    let sharpness = 1.0 / max(inverse_sharpness, 1e-8);
#ifdef NDF_PHONG
    let own = receiver.strength * inverse_sharpness;
    let c = mix(dot(receiver.normal, axis), fixed_cosine(receiver.lobe), own / (1.0 + own));
    if !(c > 0.0) {
        return vec3f(0.0);
    }
    // The distribution is an SG but for its tail.
    let integral = asg_sg_integral(receiver.sg_lobe.eta_x, receiver.sg_lobe.eta_y, asg_to_local(receiver.sg_lobe, axis), sharpness);
    return masking_and_fresnel(receiver.lobe, c, dot(receiver.lobe.fixed_direction, axis)) * (c * receiver.sg_lobe.amplitude * integral / sg_integral(sharpness));
#else
    if alpha > 0.5 || 2.0 * sharpness * alpha * alpha > 10.0 {
        return glossy_fast(receiver, axis, inverse_sharpness);
    }
    // The two-lobe form carries its own masking; Fresnel's term is what is left.
    let v_dot_h = sqrt(clamp(0.5 + 0.5 * dot(receiver.lobe.fixed_direction, axis), 0.0, 1.0));
    let fresnel = mix(receiver.lobe.reflectance_normal, vec3f(receiver.lobe.reflectance_grazing), fifth_power(1.0 - v_dot_h));
    return fresnel * (glossy_sg_light_two(alpha, receiver.normal, receiver.lobe.fixed_direction, axis, sharpness) / sg_integral(sharpness));
#endif
}
#endif

// The best forms: both lobes of the light by themselves, the accurate clamped cosine, GGX filtered by the light or as two peaks.
fn vsgl_accurate(receiver: SgReceiver, light: SgLight) -> vec3f {
    let view = view_disk(receiver, light);
    let c = dot(receiver.normal, view.direction);
    if !(view.irradiance > 0.0 && faces(receiver, view.direction)) {
        return vec3f(0.0);
    }
    var reflected = light.diffuse * receiver.diffuse * (view.irradiance * max(c, 0.0));
#ifdef SPECULAR
    reflected += light.diffuse * glossy_accurate(receiver, view.direction, view.inverse_sharpness) * view.solid_angle;
    let shiny = min(light.flux * light_reflectance(light, view) * view.solid_angle, vec3f(1e28));
    let p = view.direction - light.axis * lobe_pull(light, light.axis, view);
    let p_length = max(length(p), 1e-6);
    let axis = p / p_length;
    let inverse_sharpness = view.inverse_sharpness / p_length;
    let sharpness = 1.0 / max(inverse_sharpness, 1e-8);
    let across = cross(receiver.normal, axis);
    let cosine = clamped_cosine_integral(sharpness, dot(receiver.normal, axis), min(dot(across, across), 1.0)) / sg_integral(sharpness);
    reflected += shiny * (receiver.diffuse * cosine + glossy_accurate(receiver, axis, inverse_sharpness));
#endif
    return reflected;
}

// One lobe of the light as an SG of incoming radiance, gathered. `flux`: of the whole lobe, W.
fn gaussian_lobe(receiver: SgReceiver, flux: vec3f, lobe_axis: vec3f, lobe_sharpness: f32, direction: vec3f, sharpness: f32, density: f32) -> vec3f {
    let product = sg_product(-lobe_axis, lobe_sharpness, direction, sharpness);
    let amplitude = flux * (density * exp(product.log_amplitude) / sg_integral(lobe_sharpness));
    let across = cross(receiver.normal, product.axis);
    let c = dot(receiver.normal, product.axis);
    var reflected = receiver.diffuse * clamped_cosine_integral(product.sharpness, c, min(dot(across, across), 1.0));
#ifdef SPECULAR
    reflected += glossy_fast(receiver, product.axis, 1.0 / max(product.sharpness, 1e-3)) * sg_integral(product.sharpness);
#endif
    return min(amplitude, vec3f(1e28)) * reflected;
}

// A Gaussian cloud of positions, whose intensity is two SGs (Tokuyoshi 2015; 2024): nothing in it has an edge, so it is the form for lights as large as what
// they light, such as two for a whole scene. A flat patch leaks a little behind itself.
fn vsgl_gaussian(receiver: SgReceiver, light: SgLight) -> vec3f {
    let offset = light.position - receiver.position;
    let d = dot(offset, offset);
    // Variance per axis is r^2 / 4. The floor keeps the sharpness within 1e8, and a point on a point finite.
    let square = max(max(light.radius * light.radius, 4e-8 * d), 1e-20);
    let sharpness = 4.0 * d / square;
    let density = 2.0 * INV_PI / square;
    let direction = safe_normalize(offset, receiver.normal);
    // A Lambertian lobe has a mean direction of length 2/3, spread normals make it shorter.
    let mean = DIFFUSE_MEAN_COSINE * sqrt(max(1.0 - light.spread, 0.0));
    let dull = sharpness_from_averaged_direction(mean, 1.0 - mean * mean);
    var reflected = gaussian_lobe(receiver, light.diffuse * PI, light.normal, dull, direction, sharpness, density);
#ifdef SPECULAR
    reflected += gaussian_lobe(receiver, light.specular * sg_integral(light.sharpness), light.axis, light.sharpness, direction, sharpness, density);
#endif
    return reflected;
}

// The form of the 2014 brief: cone and lobe as SGs of doubled peak, the surface's lobe as an ASG, cosines pulled out.
fn vsgl_printed(receiver: SgReceiver, light: SgLight) -> vec3f {
    let view = sg_view(receiver, light);
    let c = dot(receiver.normal, view.direction);
    if !(c > 0.0 && faces(receiver, view.direction)) {
        return vec3f(0.0);
    }
    let s = max(cone_scaled_sharpness(view.distance, light.radius), 1e-24);
    var reflected = light.diffuse * (view.light_cosine * c * 4.0 / s);
#ifdef SPECULAR
    reflected += light.specular * (view.above * c * vsgl_kernel_diffuse_receiver(-light.axis, light.sharpness, view.direction, view.distance, light.radius));
    reflected *= receiver.diffuse;
    let local = asg_to_local(receiver.sg_lobe, view.direction);
    let lobe_local = -asg_to_local(receiver.sg_lobe, light.axis);
    let eta = vec2f(receiver.sg_lobe.eta_x, receiver.sg_lobe.eta_y);
    let glossy = light.diffuse * (view.light_cosine * vsgl_kernel_fast(eta, local, 0.0, local, view.distance, light.radius))
        + light.specular * (view.above * vsgl_kernel_fast(eta, lobe_local, light.sharpness, local, view.distance, light.radius));
    let own = receiver.strength * light.radius * light.radius / s;
    let dominant = mix(c, fixed_cosine(receiver.lobe), own / (1.0 + own));
    let shading = masking_and_fresnel(receiver.lobe, dominant, dot(receiver.lobe.fixed_direction, view.direction)) * dominant;
    // Bounded, so that times nothing it is nothing.
    return reflected + min(glossy, vec3f(1e28)) * (receiver.sg_lobe.amplitude * shading);
#else
    return reflected * receiver.diffuse;
#endif
}

// Whether the disk may be taken for a point: every product of lobes is flatter than the cone times `threshold` (section 3.3 of the brief).
fn vsgl_is_point(receiver: SgReceiver, light: SgLight, distance: f32, threshold: f32) -> bool {
    var sharpest = 0.0;
#ifdef SPECULAR
    sharpest = combined_sharpness_bound(receiver.sg_lobe.eta_x, receiver.sg_lobe.eta_y, light.sharpness);
#endif
    return bias_reduction_applies(sharpest, threshold, distance, light.radius);
}
