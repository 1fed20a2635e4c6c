//! Radiance that a GGX surface reflects of an SG light, per unit of the light's peak radiance and without the Fresnel term: the integral of
//! `D(h) G2 / (4 (n.l) (n.o)) (n.l) G(l; light_axis, light_sharpness)` over the hemisphere, without dimension.
//!
//! Approximations to be chosen by what they cost, and the integral by quadrature. All take alpha in [0.001, 1], a light sharpness in [0, 1e8] and unit
//! vectors; a view below the horizon counts as one in it.
//!
//! Errors are RMS over light axes out to two standard deviations of the lobe and the light together, as a share of the RMS value, for a light
//! sharpness of 3, 30, 300, 1e4.
//!
//! | alpha, view | [`glossy_sg_light_one`] | [`glossy_sg_light_two`] | [`glossy_sg_light_three`] | [`filtered_ndf_shading`] |
//! |---|---|---|---|---|
//! | 0.02, 10 degrees | .01 .04 .16 .26 | .01 .02 .04 .04 | .00 .01 .01 .01 | .13 .19 .17 .05 |
//! | 0.05, 60 degrees | .03 .10 .22 .26 | .02 .04 .04 .05 | .01 .03 .02 .02 | .13 .18 .14 .02 |
//! | 0.15, 60 degrees | .13 .23 .25 .26 | .07 .08 .07 .08 | .07 .08 .06 .07 | .18 .15 .07 .03 |
//! | 0.15, 87 degrees | .37 .38 .38 .35 | .20 .26 .31 .27 | .18 .26 .33 .27 | .45 .50 .56 .36 |
//! | 0.6, 60 degrees | .31 .36 .34 .34 | .48 .48 .48 .48 | .49 .49 .49 .49 | .17 .17 .26 .29 |

use super::{NdfLobe, ggx_lobe_one, ggx_lobes_three, ggx_lobes_two, reflection_axis, reflection_lobe_asg};
use crate::{
    asg_product::{asg_sg_integral_of_peak, asg_sg_integral_printed, asg_sg_peak},
    brdf::{ggx_distribution, ggx_visibility},
    sg::{sg_evaluate, sg_integral, sg_product},
    sg_cosine::hemisphere_integral,
};
use gauss_quad::GaussLegendre;
use glam::DVec3;
use std::{
    f64::consts::{PI, TAU},
    num::NonZeroUsize,
};

/// `G2 / (4 (n.o))`: masking and cosine of a light in `direction`, 0 where it is below the horizon. At most `1 / (2 alpha)`.
fn masked_cosine(alpha: f64, normal: DVec3, view: DVec3, direction: DVec3) -> f64 {
    let (n_dot_l, n_dot_v) = (normal.dot(direction), normal.dot(view).max(0.0));
    if n_dot_l <= 0.0 { 0.0 } else { ggx_visibility(alpha, n_dot_l, n_dot_v) * n_dot_l }
}

/// One lobe of the NDF times the light; masking and cosine at the peak of the product.
fn lobe_shading(alpha: f64, lobe: NdfLobe, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    let asg = reflection_lobe_asg(lobe.sharpness, normal, view);
    let axis = asg.to_local(light_axis);
    let peak = asg_sg_peak(asg.eta_x, asg.eta_y, axis, light_sharpness);
    let integral = asg_sg_integral_of_peak(asg.eta_x, asg.eta_y, axis, light_sharpness, &peak);
    lobe.amplitude * masked_cosine(alpha, normal, view, asg.to_world(peak.local)) * integral
}

/// Fast: one regularised ASG, the printed product, masking at the axis of the product of SGs. For a light sharpness of at least 10 or so: broader
/// lights come out too bright, and the printed integral, which grows without bound, is held to pi, which no ASG's integral exceeds.
pub fn glossy_sg_light_fast(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    let lobe = ggx_lobe_one(alpha);
    let asg = reflection_lobe_asg(lobe.sharpness, normal, view);
    let integral = asg_sg_integral_printed(asg.eta_x, asg.eta_y, asg.to_local(light_axis), light_sharpness.max(1e-6)).min(PI);
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

/// Roughness filtering (Tokuyoshi et al. 2024, Hierarchical Light Sampling with Accurate Spherical Gaussian Lighting): the light widens the NDF, and
/// the value of the widened NDF is taken at the half vector to the light's axis. For small lights (`light_sharpness alpha^2` above 5) and for alpha
/// above 0.5.
///
/// `alpha_k^2 = P_k / (1 + P_k)` with `P = alpha^2 / (1 - alpha^2) + 1 / (2 light_sharpness)` along the projected view, and `1 / (2 light_sharpness
/// (n.o)^2)` instead across; the value is `visibility D(h) / (4 sqrt(alpha_along^2 sin^2 + (n.o)^2)) A(light_sharpness)`. Visibility is the share
/// above the horizon of the product of the light and an SG of sharpness `(1 - alpha^2) / (2 alpha^2)` about the mirror direction.
pub fn filtered_ndf_shading(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64) -> f64 {
    let c = normal.dot(view).max(0.0);
    let alpha_squared = alpha * alpha;
    let u = ((1.0 - alpha) * (1.0 + alpha)).max(0.0);
    // P / (1 + P) as alpha^2 plus what the light adds: finite for alpha 1, a light sharpness of 0 and a view in the horizon.
    let widened = |sharpness: f64| alpha_squared + u * u / (2.0 * sharpness + u).max(1e-30);
    let (along, across) = (widened(light_sharpness), widened(light_sharpness * c * c));
    let projected = view - normal * c;
    let s2 = projected.length_squared();
    // What rounding has left of the normal in a short projection would be taken for a slope.
    let straight = projected - normal * normal.dot(projected);
    let tangent = if s2 > 1e-12 { straight.normalize() } else { normal.any_orthonormal_vector() };
    let h = (view + light_axis).normalize_or(normal);
    let (x, y, z) = (tangent.dot(h), normal.cross(tangent).dot(h), normal.dot(h));
    let bracket = x * x / along + y * y / across + z * z;
    let distribution = 1.0 / (PI * (along * across).sqrt() * bracket * bracket);
    let product = sg_product(reflection_axis(normal, view), 0.5 * u / alpha_squared, light_axis, light_sharpness);
    let visibility = hemisphere_integral(product.sharpness, normal.dot(product.axis)) / sg_integral(product.sharpness);
    visibility * distribution / (4.0 * (along * s2 + c * c).sqrt()) * sg_integral(light_sharpness)
}

/// The integral itself, to about `tolerance` of it (1e-4 to 1e-8). Slow.
///
/// Over the directions of the light's lobe where that is narrower than the reflection lobe, over half vectors, stretched by alpha, where it is not;
/// either way the other factor is the smoother one, and panels are split until it is resolved.
pub fn glossy_sg_light_exact(alpha: f64, normal: DVec3, view: DVec3, light_axis: DVec3, light_sharpness: f64, tolerance: f64) -> f64 {
    let half_vector = |l: DVec3| (view + l).normalize_or(normal);
    if 2.0 * light_sharpness * alpha * alpha > 1.0 {
        let (x, y) = light_axis.any_orthonormal_pair();
        // All of the lobe but e^-40 is within this height of its pole.
        let end = (40.0 / light_sharpness).min(2.0);
        let over_light = |r: f64, phi: f64| {
            let height = end * r * r;
            let (s, c) = ((height * (2.0 - height)).max(0.0).sqrt(), 1.0 - height);
            let l = light_axis * c + (x * phi.cos() + y * phi.sin()) * s;
            let density = 2.0 * end * r * (-light_sharpness * height).exp();
            density * ggx_distribution(alpha, normal, half_vector(l)) * masked_cosine(alpha, normal, view, l)
        };
        return integrate_disk(tolerance, &over_light);
    }
    let (x, y) = normal.any_orthonormal_pair();
    let over_half_vectors = |r: f64, phi: f64| {
        let tangent = alpha * r / (1.0 - r);
        let c = 1.0 / (1.0 + tangent * tangent).sqrt();
        let h = (normal + (x * phi.cos() + y * phi.sin()) * tangent) * c;
        let v_dot_h = view.dot(h);
        if v_dot_h <= 0.0 {
            return 0.0;
        }
        let l = h * (2.0 * v_dot_h) - view;
        // D cos over the solid angle, per r and turn.
        let density = 2.0 * r * (1.0 - r) / ((1.0 - r).powi(2) + r * r).powi(2);
        density * masked_cosine(alpha, normal, view, l) * 4.0 * v_dot_h / c * sg_evaluate(light_axis, light_sharpness, l)
    };
    integrate_disk(tolerance, &over_half_vectors) / TAU
}

/// Integral of `f(r, phi)` over [0, 1] and a turn. Panels of Gauss-Legendre points are split until the sum over four quarters agrees with the whole.
fn integrate_disk(tolerance: f64, f: &dyn Fn(f64, f64) -> f64) -> f64 {
    const POINTS: usize = 8;
    const DEPTH: i32 = 16;
    let rule = GaussLegendre::new(NonZeroUsize::new(POINTS).unwrap_or(NonZeroUsize::MIN));
    let rule: Vec<(f64, f64)> = rule.iter().copied().collect();
    let panel = |r: (f64, f64), phi: (f64, f64)| {
        let (half_r, half_phi) = (0.5 * (r.1 - r.0), 0.5 * (phi.1 - phi.0));
        let ring = |at: f64| rule.iter().map(|(node, weight)| weight * f(at, phi.0 + half_phi * (1.0 + node))).sum::<f64>();
        half_r * half_phi * rule.iter().map(|(node, weight)| weight * ring(r.0 + half_r * (1.0 + node))).sum::<f64>()
    };
    // What the horizon cuts off a panel may lie between its edge and all points, and is not seen then. It is as small as the third power of the panel.
    let cells = (8.0 * (1e-5 / tolerance).cbrt()).ceil().clamp(8.0, 100.0) as usize;
    let at = |index: usize| index as f64 / cells as f64;
    let mut open = Vec::new();
    for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
        let (r, phi) = ((at(i), at(i + 1)), (TAU * at(j), TAU * at(j + 1)));
        open.push((r, phi, panel(r, phi)));
    }
    let mut total: f64 = open.iter().map(|(_, _, value)| value).sum();
    // Breadth first, so that the total that errors are measured against is known early. The panels that the horizon crosses double in number with
    // every level, so each may be off by half as much.
    for depth in 0..DEPTH {
        let allowed = 0.1 * tolerance * 0.5f64.powi(depth);
        let mut next = Vec::new();
        for (r, phi, value) in open {
            let (middle_r, middle_phi) = (0.5 * (r.0 + r.1), 0.5 * (phi.0 + phi.1));
            let quarters =
                [(r.0, middle_r), (middle_r, r.1)].map(|r| [(phi.0, middle_phi), (middle_phi, phi.1)].map(|phi| (r, phi, panel(r, phi))));
            let sum: f64 = quarters.as_flattened().iter().map(|(_, _, value)| value).sum();
            total += sum - value;
            if (sum - value).abs() > allowed * total.abs() {
                next.extend_from_slice(quarters.as_flattened());
            }
        }
        if next.is_empty() {
            break;
        }
        open = next;
    }
    total
}
