//! Radiance that a GGX surface reflects of an SG light, per unit of the light's peak radiance and without the Fresnel term: the integral of
//! `D(h) G2 / (4 (n.l) (n.o)) (n.l) G(l; light_axis, light_sharpness)` over the hemisphere, dimensionless.
//!
//! Four approximations, to be chosen by what they cost, and the integral by quadrature. All take alpha in [0.001, 1], a view with n.o >= 0 (0 below the
//! horizon) and a light sharpness in [0, 1e8].

use super::{NdfLobe, ggx_lobe_one, ggx_lobes_three, ggx_lobes_two, reflection_axis, reflection_lobe_asg};
use crate::{
    asg::asg_integral,
    asg_product::{asg_sg_integral_printed, asg_sg_peak},
    brdf::{ggx_distribution, ggx_visibility},
    quadrature::rule,
    sg::{sg_integral, sg_product},
    sg_cosine::hemisphere_integral,
};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// `G2 / (4 (n.o))`: masking and cosine of a light in `direction`, 0 where it is below the horizon.
fn masked_cosine(alpha: f64, normal: DVec3, view: DVec3, direction: DVec3) -> f64 {
    let (n_dot_l, n_dot_v) = (normal.dot(direction), normal.dot(view));
    if n_dot_l <= 0.0 || n_dot_v < 0.0 { 0.0 } else { ggx_visibility(alpha, n_dot_l, n_dot_v) * n_dot_l }
}

/// One lobe of the NDF times the light, by the peak form of the product; masking and cosine at its peak.
fn lobe_shading(alpha: f64, lobe: NdfLobe, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    let asg = reflection_lobe_asg(lobe.sharpness, normal, view);
    let peak = asg_sg_peak(asg.eta_x, asg.eta_y, asg.to_local(light_axis), light_sharpness);
    let integral = peak.local.z.max(0.0) * peak.log_amplitude.exp() * asg_integral(peak.eta_larger, peak.eta_smaller);
    lobe.amplitude * masked_cosine(alpha, normal, view, asg.to_world(peak.local)) * integral
}

/// Fast: one regularised ASG, the printed product, masking at the axis of the product of SGs.
pub fn glossy_sg_light_fast(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    let lobe = ggx_lobe_one(alpha);
    let asg = reflection_lobe_asg(lobe.sharpness, normal, view);
    let integral = asg_sg_integral_printed(asg.eta_x, asg.eta_y, asg.to_local(light_axis), light_sharpness);
    let sharpness = 2.0 * asg.eta_x.sqrt() * asg.eta_y.sqrt();
    let axis = sg_product(asg.axis, sharpness, light_axis, light_sharpness).axis;
    lobe.amplitude * masked_cosine(alpha, normal, view, axis) * integral
}

/// One regularised ASG and the peak form of the product.
pub fn glossy_sg_light_one(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    lobe_shading(alpha, ggx_lobe_one(alpha), normal, view, light_axis, light_sharpness)
}

/// Balanced: the NDF as two SGs, each warped to an ASG.
pub fn glossy_sg_light_two(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    ggx_lobes_two(alpha).iter().map(|lobe| lobe_shading(alpha, *lobe, normal, view, light_axis, light_sharpness)).sum()
}

/// The NDF as three SGs, each warped to an ASG.
pub fn glossy_sg_light_three(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    ggx_lobes_three(alpha).iter().map(|lobe| lobe_shading(alpha, *lobe, normal, view, light_axis, light_sharpness)).sum()
}

/// Roughness filtering (Tokuyoshi et al. 2024).
pub fn filtered_ndf_shading(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    let c = normal.dot(view);
    if c < 0.0 {
        return 0.0;
    }
    let alpha_squared = alpha * alpha;
    let u = ((1.0 - alpha) * (1.0 + alpha)).max(0.0);
    let widened = |sharpness: f64| alpha_squared + u * u / (2.0 * sharpness + u).max(1e-30);
    let (along, across) = (widened(light_sharpness), widened(light_sharpness * c * c));
    let projected = view - normal * c;
    let s2 = projected.length_squared();
    let tangent = if s2 > 1e-12 { projected / s2.sqrt() } else { normal.any_orthonormal_vector() };
    let h = (view + light_axis).normalize_or(normal);
    let (x, y, z) = (tangent.dot(h), normal.cross(tangent).dot(h), normal.dot(h));
    let bracket = x * x / along + y * y / across + z * z;
    let distribution = 1.0 / (PI * (along * across).sqrt() * bracket * bracket);
    let lobe_sharpness = 0.5 * u / alpha_squared;
    let product = sg_product(reflection_axis(normal, view), lobe_sharpness, light_axis, light_sharpness);
    let visibility = hemisphere_integral(product.sharpness, normal.dot(product.axis)) / sg_integral(product.sharpness);
    visibility * distribution / (4.0 * (along * s2 + c * c).sqrt()) * sg_integral(light_sharpness)
}
