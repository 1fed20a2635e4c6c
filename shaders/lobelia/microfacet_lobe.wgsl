// Microfacet reflectance as lobes: normal distribution functions (NDF) as SGs, reflection lobes, and the radiance that a GGX surface reflects of an
// SG light. alpha is in [0.001, 1]; normal, view and axes are unit vectors. The twins in `f64`, with sources and the errors of approximations:
// `crates/lobes/src/microfacet_lobe.rs` and `microfacet_lobe/glossy.rs`.
#define_import_path lobelia::microfacet_lobe

#import lobelia::math::{PI, decay_mean_upper, perpendicular, safe_normalize}
#import lobelia::brdf::{ggx_visibility, phong_visibility}
#import lobelia::sg::{SphericalGaussian, sg_integral, sg_product}
#import lobelia::sg_cosine::hemisphere_integral
#import lobelia::asg::{AnisotropicSphericalGaussian, asg_sg_integral_of_peak, asg_sg_integral_printed, asg_sg_peak, asg_to_local}

// An SG about the normal that stands for an NDF, or for a part of one.
struct NdfLobe {
    sharpness: f32,
    // Value where the half vector is the normal, 1/sr.
    amplitude: f32,
}

// Beckmann's distribution, exp(-tan^2 / alpha^2) / (pi alpha^2 cos^4), 1/sr, for n.h >= 0 (Walter et al. 2007, equation 25). sin^2 is d (1 - d/4) with
// d = |h - n|^2: the cross product of nearly parallel vectors has lost the digits that a sharp lobe needs.
fn beckmann_distribution(alpha: f32, n: vec3f, h: vec3f) -> f32 {
    let offset = h - n;
    let d = dot(offset, offset);
    let cosine = dot(n, h);
    let cosine_squared = max(cosine * cosine, 1e-6);
    let tangent_squared = max(d * (1.0 - 0.25 * d), 0.0) / cosine_squared;
    let width = alpha * cosine_squared;
    return exp(-tangent_squared / (alpha * alpha)) / (PI * width * width);
}

// G2 / (4 (n.l) (n.v)) for Beckmann's distribution, for cosines in (0, 1]. The Phong distribution of the same alpha borrows its masking.
fn beckmann_visibility(alpha: f32, n_dot_l: f32, n_dot_v: f32) -> f32 {
    return phong_visibility(alpha, n_dot_l, n_dot_v);
}

// Sharpness of the SG with the distribution's curvature at the normal. L1 error 0.010 of the integral at alpha 0.1, 0.23 at 0.5.
fn ndf_sharpness_beckmann(alpha: f32) -> f32 {
    return 2.0 / (alpha * alpha);
}

// The same for GGX, which has a tail that no SG has: L1 error 0.41.
fn ndf_sharpness_ggx(alpha: f32) -> f32 {
    return 2.0 / (alpha * alpha);
}

// For GGX with alpha above 0.5: 2 / alpha^2 - 2, without the cancellation near 1.
fn ndf_sharpness_ggx_broad(alpha: f32) -> f32 {
    return max(2.0 * (1.0 - alpha) * (1.0 + alpha) / (alpha * alpha), 0.0);
}

// For the Phong distribution (n.h)^exponent, exponent >= 0.
fn ndf_sharpness_phong(exponent: f32) -> f32 {
    return exponent + 1.0;
}

// Amplitude with which an SG about the normal integrates to 1 against the projected solid angle.
fn ndf_amplitude_projected(sharpness: f32) -> f32 {
    return 0.5 / (PI * decay_mean_upper(sharpness));
}

fn beckmann_lobe(alpha: f32) -> NdfLobe {
    return NdfLobe(ndf_sharpness_beckmann(alpha), 1.0 / (PI * alpha * alpha));
}

fn phong_lobe(exponent: f32) -> NdfLobe {
    return NdfLobe(ndf_sharpness_phong(exponent), (exponent + 2.0) / (2.0 * PI));
}

// GGX as one SG with its peak. L1 error about 0.41 up to alpha 0.3, less above 0.5.
fn ggx_lobe_one(alpha: f32) -> NdfLobe {
    return NdfLobe(select(ndf_sharpness_ggx(alpha), ndf_sharpness_ggx_broad(alpha), alpha > 0.5), 1.0 / (PI * alpha * alpha));
}

fn part_of_ggx(alpha: f32, energy: f32, factor: f32) -> NdfLobe {
    let sharpness = factor * ndf_sharpness_ggx(alpha);
    return NdfLobe(sharpness, 0.5 * energy * sharpness / PI);
}

// GGX as the sum of two SGs: L1 error 0.117 for small alpha. For alpha up to 0.5. A form of this project.
fn ggx_lobes_two(alpha: f32) -> array<NdfLobe, 2> {
    return array<NdfLobe, 2>(part_of_ggx(alpha, 0.554678, 1.469881), part_of_ggx(alpha, 0.445322, 0.224401));
}

// GGX as the sum of three SGs: L1 error 0.047 for small alpha. For alpha up to 0.5. A form of this project.
fn ggx_lobes_three(alpha: f32) -> array<NdfLobe, 3> {
    return array<NdfLobe, 3>(
        part_of_ggx(alpha, 0.289911, 2.291398),
        part_of_ggx(alpha, 0.497579, 0.593012),
        part_of_ggx(alpha, 0.21251, 0.094761)
    );
}

// The mirror direction of the view.
fn reflection_axis(normal: vec3f, view: vec3f) -> vec3f {
    return 2.0 * dot(normal, view) * normal - view;
}

// 1 / (c^2 + s^2 / (2 ndf_sharpness)) for the view's cosine c and sine s: the inverse square of the cosine with a floor of alpha / 2 in the horizon.
// 0 for a sharpness of 0. A form of this project.
fn regularized_stretch(ndf_sharpness: f32, normal: vec3f, view: vec3f) -> f32 {
    let c = dot(normal, view);
    let across = cross(normal, view);
    return ndf_sharpness / max(ndf_sharpness * c * c + 0.5 * dot(across, across), 1e-30);
}

// The reflection lobe of an SG NDF as an SG of amplitude 1 (Wang et al. 2009, section 4). Its energy goes to 0 for a view in the horizon; |n.o| counts as at least
// 1e-10. For comparison.
fn reflection_lobe_sg_printed(ndf_sharpness: f32, normal: vec3f, view: vec3f) -> SphericalGaussian {
    let sharpness = ndf_sharpness / (4.0 * max(abs(dot(normal, view)), 1e-10));
    return SphericalGaussian(reflection_axis(normal, view), sharpness, 1.0);
}

// The same with the regularised cosine, finite for every view. A form of this project. L1 error 0.22 at 45 degrees, about 1 at 80: the true lobe is
// not round.
fn reflection_lobe_sg(ndf_sharpness: f32, normal: vec3f, view: vec3f) -> SphericalGaussian {
    let sharpness = 0.25 * ndf_sharpness * sqrt(regularized_stretch(ndf_sharpness, normal, view));
    return SphericalGaussian(reflection_axis(normal, view), sharpness, 1.0);
}

fn reflection_lobe_of_stretch(ndf_sharpness: f32, stretch: f32, normal: vec3f, view: vec3f) -> AnisotropicSphericalGaussian {
    let axis = reflection_axis(normal, view);
    let normal_cross = cross(normal, axis);
    // The cross product of nearly parallel vectors is rounded in every direction, so its part along the axis is taken out. Where it is too short for a
    // direction the bandwidths are equal and any frame will do.
    let across = normal_cross - axis * dot(axis, normal_cross);
    let tangent = safe_normalize(select(perpendicular(axis), across, dot(across, across) > 1e-12), vec3f(1.0, 0.0, 0.0));
    let eta = 0.125 * ndf_sharpness;
    return AnisotropicSphericalGaussian(tangent, cross(axis, tangent), axis, eta * stretch, eta, 1.0);
}

// The reflection lobe as an ASG of amplitude 1, eta_x along n x axis, eta_y in the plane of incidence (Xu et al. 2013, section 5). |n.o| counts as at
// least 1e-10. For comparison.
fn reflection_lobe_asg_printed(ndf_sharpness: f32, normal: vec3f, view: vec3f) -> AnisotropicSphericalGaussian {
    let c = max(abs(dot(normal, view)), 1e-10);
    return reflection_lobe_of_stretch(ndf_sharpness, 1.0 / (c * c), normal, view);
}

// The same with the regularised cosine, finite for every view. A form of this project. eta_x is at most ndf_sharpness^2 / 4. Multiply by the NDF's
// amplitude for D(h). In 32 bits eta_x is off by 3e-7 sqrt(ndf_sharpness), relative, for a view near the horizon: that of its cosine.
fn reflection_lobe_asg(ndf_sharpness: f32, normal: vec3f, view: vec3f) -> AnisotropicSphericalGaussian {
    return reflection_lobe_of_stretch(ndf_sharpness, regularized_stretch(ndf_sharpness, normal, view), normal, view);
}

// G2 / (4 (n.o)): masking and cosine of a light in a direction, 0 below the horizon. A view below the horizon counts as one in it.
fn masked_cosine(alpha: f32, normal: vec3f, view: vec3f, direction: vec3f) -> f32 {
    let n_dot_l = dot(normal, direction);
    if !(n_dot_l > 0.0) {
        return 0.0;
    }
    return ggx_visibility(alpha, n_dot_l, max(dot(normal, view), 0.0)) * n_dot_l;
}

fn lobe_shading(alpha: f32, lobe: NdfLobe, normal: vec3f, view: vec3f, light_axis: vec3f, light_sharpness: f32) -> f32 {
    let asg = reflection_lobe_asg(lobe.sharpness, normal, view);
    let axis = asg_to_local(asg, light_axis);
    let peak = asg_sg_peak(asg.eta_x, asg.eta_y, axis, light_sharpness);
    let integral = asg_sg_integral_of_peak(asg.eta_x, asg.eta_y, axis, light_sharpness, peak);
    let direction = asg.tangent * peak.local.x + asg.bitangent * peak.local.y + asg.axis * peak.local.z;
    return lobe.amplitude * masked_cosine(alpha, normal, view, direction) * integral;
}

// Radiance that a GGX surface reflects of an SG light of peak radiance 1, without the Fresnel term: the integral of D G2 / (4 (n.l) (n.o)) (n.l) G(l) over
// the hemisphere. Fast: one ASG and the printed product, for a light sharpness of at least 10; its integral is held to pi, which no ASG's exceeds.
fn glossy_sg_light_fast(alpha: f32, normal: vec3f, view: vec3f, light_axis: vec3f, light_sharpness: f32) -> f32 {
    let lobe = ggx_lobe_one(alpha);
    let asg = reflection_lobe_asg(lobe.sharpness, normal, view);
    let integral = min(asg_sg_integral_printed(asg.eta_x, asg.eta_y, asg_to_local(asg, light_axis), max(light_sharpness, 1e-6)), PI);
    let axis = sg_product(asg.axis, 2.0 * sqrt(asg.eta_x) * sqrt(asg.eta_y), light_axis, light_sharpness).axis;
    return lobe.amplitude * masked_cosine(alpha, normal, view, axis) * integral;
}

// The same by one ASG and the peak form of the product.
fn glossy_sg_light_one(alpha: f32, normal: vec3f, view: vec3f, light_axis: vec3f, light_sharpness: f32) -> f32 {
    return lobe_shading(alpha, ggx_lobe_one(alpha), normal, view, light_axis, light_sharpness);
}

// The same by two ASGs: balanced, for alpha up to 0.5.
fn glossy_sg_light_two(alpha: f32, normal: vec3f, view: vec3f, light_axis: vec3f, light_sharpness: f32) -> f32 {
    let lobes = ggx_lobes_two(alpha);
    return lobe_shading(alpha, lobes[0], normal, view, light_axis, light_sharpness)
        + lobe_shading(alpha, lobes[1], normal, view, light_axis, light_sharpness);
}

// The same by three ASGs, for alpha up to 0.5.
fn glossy_sg_light_three(alpha: f32, normal: vec3f, view: vec3f, light_axis: vec3f, light_sharpness: f32) -> f32 {
    let lobes = ggx_lobes_three(alpha);
    return lobe_shading(alpha, lobes[0], normal, view, light_axis, light_sharpness)
        + lobe_shading(alpha, lobes[1], normal, view, light_axis, light_sharpness)
        + lobe_shading(alpha, lobes[2], normal, view, light_axis, light_sharpness);
}

// The same by filtering the NDF with the light (Tokuyoshi et al. 2024): for small lights, 2 light_sharpness alpha^2 > 10, and for alpha above 0.5.
fn filtered_ndf_shading(alpha: f32, normal: vec3f, view: vec3f, light_axis: vec3f, light_sharpness: f32) -> f32 {
    let c = max(dot(normal, view), 0.0);
    let alpha_squared = alpha * alpha;
    let u = max((1.0 - alpha) * (1.0 + alpha), 0.0);
    // P / (1 + P) for P = alpha^2 / u + 1 / (2 sharpness), written as alpha^2 plus what the light adds.
    let along = alpha_squared + u * u / max(2.0 * light_sharpness + u, 1e-30);
    let across = alpha_squared + u * u / max(2.0 * light_sharpness * c * c + u, 1e-30);
    let projected = view - normal * c;
    let s_squared = dot(projected, projected);
    // What rounding has left of the normal in a short projection would be taken for a slope.
    let straight = projected - normal * dot(normal, projected);
    let tangent = safe_normalize(select(perpendicular(normal), straight, s_squared > 1e-12), vec3f(1.0, 0.0, 0.0));
    let h = safe_normalize(view + light_axis, normal);
    let local = vec3f(dot(tangent, h), dot(cross(normal, tangent), h), dot(normal, h));
    let bracket = local.x * local.x / along + local.y * local.y / across + local.z * local.z;
    let distribution = 1.0 / (PI * sqrt(along * across) * bracket * bracket);
    let product = sg_product(reflection_axis(normal, view), 0.5 * u / alpha_squared, light_axis, light_sharpness);
    let visibility = hemisphere_integral(product.sharpness, dot(normal, product.axis)) / sg_integral(product.sharpness);
    return visibility * distribution / (4.0 * sqrt(along * s_squared + c * c)) * sg_integral(light_sharpness);
}
