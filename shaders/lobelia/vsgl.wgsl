// What a virtual spherical Gaussian light sends to the viewer by way of a surface, in closed form: Tokuyoshi 2014 (`printed`) and two forms of this project.
// The twins in `f64`, with the errors of each form: `crates/lobes/src/vsgl.rs`.
//
// The light is a disk of radius r with a Lambertian and an SG lobe, the surface has a Lambertian and a glossy lobe. Radiance is a sum of four products,
// each an integral over the cone in which the disk is seen, divided by pi r^2; written so that nothing divides by r^2, they tend to the point light's
// as r tends to 0, and stay finite as the distance does.
//
// Flags: SPECULAR, NDF_PHONG, NORMAL_MAP.
#define_import_path lobelia::vsgl

#import lobelia::brdf::{Brdf, brdf_from_surface, ggx_visibility, phong_exponent, phong_visibility, specular_albedo}
#import lobelia::asg::{AnisotropicSphericalGaussian, asg_sg_integral, asg_to_local}
#import lobelia::math::{INV_PI, PI, fifth_power, safe_normalize}
#import lobelia::microfacet_lobe::{ggx_lobe_one, glossy_sg_light_two, phong_lobe, reflection_lobe_asg, reflection_lobe_sg}
#import lobelia::octahedral::{octahedral_pack, octahedral_unpack}
#import lobelia::patch_moments::patch_ndf_sharpness
#import lobelia::sg::sg_integral
#import lobelia::sg_cosine::{clamped_cosine_integral, hemisphere_integral}
#import lobelia::sg_light::{bias_reduction_applies, combined_sharpness_bound, cone_scaled_sharpness, vsgl_kernel_diffuse_receiver, vsgl_kernel_fast}
#import lobelia::surface::Surface
#import lobelia::virtual_lights::{VirtualLight, VirtualLightLobes, virtual_light_surface}

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
}

// A surface, ready to receive.
struct SgReceiver {
    position: vec3f,
    normal: vec3f,
    geometric_normal: vec3f,
    to_viewer: vec3f,
    // Between normal and viewer.
    cosine: f32,
    brdf: Brdf,
    // The reflection lobe: that of an SG distribution of normals.
    lobe: AnisotropicSphericalGaussian,
    // The view projected onto the surface, unit, and its length.
    along: vec3f,
    sine: f32,
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
// for spread 0, 0.28 (exact: 0.25) for 1. Within 0.03.
fn spread_cosine(c: f32, spread: f32) -> f32 {
    let mean = c * sqrt(max(1.0 - spread, 0.0));
    return 0.5 * (mean + sqrt(mean * mean + 0.32 * spread));
}

// Share of normals about the mean that have a direction above their horizon: a step for a flat patch.
fn share_above(c: f32, spread: f32) -> f32 {
    return clamp(0.5 + c / (2.0 * sqrt(0.5 * spread) + 1e-4), 0.0, 1.0);
}

// A light of given lobes. The SG is cut off at the light's horizon and made larger by what that costs.
fn sg_light_of_lobes(lobes: VirtualLightLobes) -> SgLight {
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
    return sg_light_of_lobes(lobes);
}

fn sg_receiver(position: vec3f, surface: Surface, brdf: Brdf, to_viewer: vec3f) -> SgReceiver {
    var receiver: SgReceiver;
    receiver.position = position;
    receiver.normal = surface.normal;
    receiver.geometric_normal = surface.geometric_normal;
    receiver.to_viewer = to_viewer;
    receiver.cosine = max(dot(surface.normal, to_viewer), 0.0);
    receiver.brdf = brdf;
#ifdef SPECULAR
#ifdef NDF_PHONG
    let ndf = phong_lobe(phong_exponent(brdf.alpha));
#else
    let ndf = ggx_lobe_one(brdf.alpha);
#endif
    receiver.lobe = reflection_lobe_asg(ndf.sharpness, surface.normal, to_viewer);
    receiver.lobe.amplitude = ndf.amplitude;
    // The bitangent of the reflection lobe lies in the plane of incidence; its part in the surface is the direction of the projected view.
    let projected = to_viewer - surface.normal * dot(surface.normal, to_viewer);
    let squared = dot(projected, projected);
    receiver.sine = sqrt(min(squared, 1.0));
    receiver.along = select(cross(receiver.lobe.tangent, surface.normal), projected * inverseSqrt(max(squared, 1e-12)), squared > 1e-6);
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

// Whether a direction can be reflected to the viewer at all: with a normal map, both must be on one side of the geometric surface.
fn faces(receiver: SgReceiver, direction: vec3f) -> bool {
#ifdef NORMAL_MAP
    return dot(receiver.geometric_normal, direction) > 0.0;
#else
    return true;
#endif
}

#ifdef SPECULAR
// G2 / (4 (n.v)) F for light from a direction: what the distribution of normals is multiplied with. 0 below the horizon.
fn masking_and_fresnel(receiver: SgReceiver, direction: vec3f) -> vec3f {
    let c = dot(receiver.normal, direction);
    if !(c > 0.0) {
        return vec3f(0.0);
    }
#ifdef NDF_PHONG
    let masking = phong_visibility(receiver.brdf.alpha, c, max(receiver.cosine, 1e-4)) * c;
#else
    let masking = ggx_visibility(receiver.brdf.alpha, c, receiver.cosine) * c;
#endif
    // v.h = sqrt((1 + v.l) / 2).
    let v_dot_h = sqrt(clamp(0.5 + 0.5 * dot(receiver.to_viewer, direction), 0.0, 1.0));
    let grazing = fifth_power(1.0 - v_dot_h);
    return masking * mix(receiver.brdf.reflectance_normal, vec3f(receiver.brdf.reflectance_grazing), grazing);
}

// The direction in which the product of the reflection lobe and a light of sharpness `scaled / r^2` is about largest.
fn dominant_direction(receiver: SgReceiver, axis: vec3f, scaled: f32, square: f32) -> vec3f {
    let own = 2.0 * sqrt(receiver.lobe.eta_x) * sqrt(receiver.lobe.eta_y) * square;
    return safe_normalize(receiver.lobe.axis * (own / (own + scaled)) + axis * (scaled / (own + scaled)), axis);
}

// Radiance that a GGX surface reflects of an SG light that sends the irradiance 1 onto a surface facing it, over G2 / (4 (n.v)) F: GGX filtered with the
// light's extent in half vectors (Tokuyoshi et al. 2024). The density that integrates to 1 is D / (4 sqrt(alpha_along^2 s^2 + c^2)); the factor
// in front undoes its masking for a point light, whose result is exact. inverse_sharpness: of the light, >= 0.
fn filtered_ggx(receiver: SgReceiver, axis: vec3f, inverse_sharpness: f32) -> f32 {
    let alpha = receiver.brdf.alpha;
    let alpha_squared = alpha * alpha;
    let u = max((1.0 - alpha) * (1.0 + alpha), 0.0);
    let c = receiver.cosine;
    let wide = u * u * inverse_sharpness;
    let along = alpha_squared + wide / (2.0 + u * inverse_sharpness);
    let across = alpha_squared + wide / max(2.0 * c * c + u * inverse_sharpness, 1e-6);
    let h = safe_normalize(receiver.to_viewer + axis, receiver.normal);
    let x = dot(receiver.along, h);
    let y = dot(receiver.lobe.tangent, h);
    // 1 - x^2 - y^2 without the normal's rounding.
    let z_squared = max(1.0 - x * x - y * y, 0.0);
    let bracket = x * x / along + y * y / across + z_squared;
    let s_squared = receiver.sine * receiver.sine;
    let normalisation = sqrt((alpha_squared * s_squared + c * c) / (along * across * max(along * s_squared + c * c, 1e-12)));
    return INV_PI * normalisation / (bracket * bracket);
}
#endif

// The cheapest form that is sound everywhere. Energy of the cone is exact; cosines are smoothed over it by a hyperbola; a GGX lobe is filtered by the light's
// extent, a Phong lobe is an ASG.
fn vsgl_fast(receiver: SgReceiver, light: SgLight, view: SgView) -> vec3f {
    if !faces(receiver, view.direction) {
        return vec3f(0.0);
    }
    let square = light.radius * light.radius;
    let s = max(cone_scaled_sharpness(view.distance, light.radius), 1e-36);
    let own = light.diffuse * (view.light_cosine * 4.0 / s);
    let own_width = square / s;
    var reflected = own * soft_cosine(dot(receiver.normal, view.direction), own_width);
#ifdef SPECULAR
    // The light's lobe in the cone.
    let lobe = light.sharpness * square;
    let sum = lobe + s;
    let p = view.direction * (s / sum) - light.axis * (lobe / sum);
    let p_squared = max(dot(p, p), 1e-12);
    let p_inverse = inverseSqrt(p_squared);
    let axis = p * p_inverse;
    let d = light.axis + view.direction;
    let n = sum * p_squared * p_inverse;
    let shiny = light.specular * (view.above * 4.0 / n * exp(-light.sharpness * (s / sum) * dot(d, d) / (1.0 + p_squared * p_inverse)));
    let width = square / n;
    reflected += shiny * soft_cosine(dot(receiver.normal, axis), width);
    reflected *= receiver.brdf.diffuse;
#ifdef NDF_PHONG
    let local = asg_to_local(receiver.lobe, view.direction);
    let lobe_local = -asg_to_local(receiver.lobe, light.axis);
    let eta = vec2f(receiver.lobe.eta_x, receiver.lobe.eta_y);
    let glossy = light.diffuse * (view.light_cosine * vsgl_kernel_fast(eta, local, 0.0, local, view.distance, light.radius))
        + light.specular * (view.above * vsgl_kernel_fast(eta, lobe_local, light.sharpness, local, view.distance, light.radius));
    let direction = dominant_direction(receiver, view.direction, s, square);
    return reflected + glossy * receiver.lobe.amplitude * masking_and_fresnel(receiver, direction);
#else
    let glossy = own * filtered_ggx(receiver, view.direction, own_width) + shiny * filtered_ggx(receiver, axis, width);
    let direction = dominant_direction(receiver, view.direction, s, square);
    return reflected + glossy * masking_and_fresnel(receiver, direction);
#endif
#else
    return reflected * receiver.brdf.diffuse;
#endif
}

// Mean of max(n.l, 0) over an SG of the given inverse sharpness, c: the cosine with its axis. Within 0.03 of the exact mean; max(c, 0) for 0.
fn soft_cosine(c: f32, inverse_sharpness: f32) -> f32 {
    let mean = c / (1.0 + inverse_sharpness * (1.0 + 1.45 * inverse_sharpness));
    return 0.5 * (mean + sqrt(mean * mean + 0.64 * inverse_sharpness / (1.0 + 2.2 * inverse_sharpness)));
}

// The form of the 2014 brief: cone and lobe as SGs of doubled peak, the surface's lobe as an ASG, cosines pulled out.
fn vsgl_printed(receiver: SgReceiver, light: SgLight, view: SgView) -> vec3f {
    let c = dot(receiver.normal, view.direction);
    if !(c > 0.0 && faces(receiver, view.direction)) {
        return vec3f(0.0);
    }
    let s = max(cone_scaled_sharpness(view.distance, light.radius), 1e-36);
    var reflected = light.diffuse * (view.light_cosine * c * 4.0 / s);
#ifdef SPECULAR
    reflected += light.specular * (view.above * c * vsgl_kernel_diffuse_receiver(-light.axis, light.sharpness, view.direction, view.distance, light.radius));
    reflected *= receiver.brdf.diffuse;
    let local = asg_to_local(receiver.lobe, view.direction);
    let lobe_local = -asg_to_local(receiver.lobe, light.axis);
    let eta = vec2f(receiver.lobe.eta_x, receiver.lobe.eta_y);
    let glossy = light.diffuse * (view.light_cosine * vsgl_kernel_fast(eta, local, 0.0, local, view.distance, light.radius))
        + light.specular * (view.above * vsgl_kernel_fast(eta, lobe_local, light.sharpness, local, view.distance, light.radius));
    let direction = dominant_direction(receiver, view.direction, s, light.radius * light.radius);
    return reflected + glossy * receiver.lobe.amplitude * masking_and_fresnel(receiver, direction);
#else
    return reflected * receiver.brdf.diffuse;
#endif
}

#ifdef SPECULAR
// Radiance that the glossy lobe reflects of an SG light of peak radiance 1, by the best form there is for it.
fn glossy_accurate(receiver: SgReceiver, axis: vec3f, sharpness: f32) -> vec3f {
    let alpha = receiver.brdf.alpha;
    let direction = dominant_direction(receiver, axis, sharpness, 1.0);
#ifdef NDF_PHONG
    // The distribution is an SG but for its tail.
    let local = asg_to_local(receiver.lobe, axis);
    let integral = asg_sg_integral(receiver.lobe.eta_x, receiver.lobe.eta_y, local, sharpness);
    return masking_and_fresnel(receiver, direction) * (receiver.lobe.amplitude * integral);
#else
    let shading = masking_and_fresnel(receiver, direction);
    if alpha > 0.5 || 2.0 * sharpness * alpha * alpha > 10.0 {
        return shading * filtered_ggx(receiver, axis, 1.0 / max(sharpness, 1e-6)) * sg_integral(sharpness);
    }
    // The two-lobe form carries its own masking; Fresnel's term is what is left.
    let v_dot_h = sqrt(clamp(0.5 + 0.5 * dot(receiver.to_viewer, direction), 0.0, 1.0));
    let fresnel = mix(receiver.brdf.reflectance_normal, vec3f(receiver.brdf.reflectance_grazing), fifth_power(1.0 - v_dot_h));
    return fresnel * glossy_sg_light_two(alpha, receiver.normal, receiver.to_viewer, axis, sharpness);
#endif
}
#endif

// The best forms: a Gaussian of positions times the SG of intensity, the accurate clamped cosine, GGX filtered by the light or as two peaks.
fn vsgl_accurate(receiver: SgReceiver, light: SgLight, view: SgView) -> vec3f {
    if !faces(receiver, view.direction) {
        return vec3f(0.0);
    }
    // Sharpness 4 d^2 / r^2, at most 1e8.
    let distance_squared = view.distance * view.distance;
    let square = max(max(light.radius * light.radius, 4e-8 * distance_squared), 1e-36);
    let position_sharpness = 4.0 * distance_squared / square;
    let density = 2.0 * INV_PI / square;
    let own = light.diffuse * (view.light_cosine * density);
    let c = dot(receiver.normal, view.direction);
    let across = cross(receiver.normal, view.direction);
    var reflected = receiver.brdf.diffuse * own * clamped_cosine_integral(position_sharpness, c, min(dot(across, across), 1.0));
#ifdef SPECULAR
    reflected += own * glossy_accurate(receiver, view.direction, position_sharpness);
    let sum = light.sharpness + position_sharpness;
    let p = view.direction * (position_sharpness / max(sum, 1e-30)) - light.axis * (light.sharpness / max(sum, 1e-30));
    let p_length = length(p);
    let axis = safe_normalize(p, view.direction);
    let d = light.axis + view.direction;
    let amplitude = exp(-light.sharpness * (position_sharpness / max(sum, 1e-30)) * dot(d, d) / (1.0 + p_length));
    let shiny = light.specular * (view.above * density * amplitude);
    let sharpness = sum * p_length;
    let shiny_across = cross(receiver.normal, axis);
    reflected += shiny * (receiver.brdf.diffuse * clamped_cosine_integral(sharpness, dot(receiver.normal, axis), min(dot(shiny_across, shiny_across), 1.0)) + glossy_accurate(receiver, axis, sharpness));
#endif
    return reflected;
}

// Whether the disk may be taken for a point: every product of lobes is flatter than the cone times `threshold` (section 3.3 of the brief).
fn vsgl_is_point(receiver: SgReceiver, light: SgLight, view: SgView, threshold: f32) -> bool {
    var sharpest = 0.0;
#ifdef SPECULAR
    sharpest = combined_sharpness_bound(receiver.lobe.eta_x, receiver.lobe.eta_y, light.sharpness);
#endif
    return bias_reduction_applies(sharpest, threshold, view.distance, light.radius);
}
