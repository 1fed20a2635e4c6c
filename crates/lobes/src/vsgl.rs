//! What a virtual spherical Gaussian light sends to the viewer by way of a surface, in closed form: the twin of `lobelia::vsgl`, whose comments tell the terms.
//!
//! The light is a disk of radius r with a Lambertian and an SG lobe, the surface has a Lambertian and a glossy lobe; the radiance is a sum of four products, each an integral
//! over the cone in which the disk is seen. Written so that nothing divides by r^2: at r = 0 it is the virtual point light.
//!
//! Sources: Tokuyoshi, Virtual Spherical Gaussian Lights for Real-Time Glossy Indirect Illumination (SIGGRAPH Asia 2014 Technical Briefs), for
//! [`vsgl_printed`] and [`vsgl_is_point`]; Tokuyoshi 2015 and Tokuyoshi et al. 2024 for [`vsgl_gaussian`] and the filtered distribution; [`vsgl_fast`], [`vsgl_accurate`] and
//! [`view_disk`] are designs of this project.

use crate::{
    asg::AnisotropicSphericalGaussian,
    asg_product::{asg_sg_integral, asg_sg_integral_printed},
    averaged_direction::sharpness_from_averaged_direction,
    brdf::{Brdf, Distribution, ggx_visibility, phong_exponent, phong_visibility},
    luminance,
    microfacet_lobe::{
        NdfLobe, ggx_lobe_one, glossy::glossy_sg_light_two, phong_lobe, reflection_axis, reflection_lobe_asg, reflection_lobe_sg,
    },
    sg::{sg_integral, sg_product},
    sg_cosine::{clamped_cosine_integral, hemisphere_integral},
    sg_light::{bias_reduction_applies, combined_sharpness_bound, cone_scaled_sharpness, vsgl_kernel_diffuse_receiver, vsgl_kernel_fast},
};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Length of the mean direction of a Lambertian lobe.
const DIFFUSE_MEAN_COSINE: f64 = 2.0 / 3.0;

/// The microfacet lobe of one end: how a surface reflects light between a fixed direction (to the viewer; at a light, to its source) and others.
#[derive(Clone, Copy, Debug)]
pub struct GlossyLobe {
    /// Unit.
    pub normal: DVec3,
    /// Unit.
    pub fixed_direction: DVec3,
    /// Roughness squared, distribution, and reflectance at normal and grazing incidence.
    pub brdf: Brdf,
}

impl GlossyLobe {
    fn fixed_cosine(&self) -> f64 {
        self.normal.dot(self.fixed_direction).max(0.0)
    }

    /// `F G2 / (4 (n.v) (n.l))` for a cosine between normal and the free direction, and one between both directions.
    fn masking_and_fresnel(&self, n_dot_l: f64, v_dot_l: f64) -> DVec3 {
        let masking = match self.brdf.distribution {
            Distribution::Phong => phong_visibility(self.brdf.alpha, n_dot_l, self.fixed_cosine().max(1e-4)),
            Distribution::Ggx => ggx_visibility(self.brdf.alpha, n_dot_l, self.fixed_cosine()),
        };
        self.brdf.fresnel((0.5 + 0.5 * v_dot_l).clamp(0.0, 1.0).sqrt()) * masking
    }
}

/// A light, ready to be gathered.
#[derive(Clone, Copy, Debug)]
pub struct SgLight {
    /// Metres.
    pub position: DVec3,
    /// Of the disk, metres; 0 for a point.
    pub radius: f64,
    /// Intensity of the Lambertian lobe along the normal, W/sr.
    pub diffuse: DVec3,
    /// One minus the squared length of the mean normal, in [0, 1].
    pub spread: f64,
    /// Unit.
    pub normal: DVec3,
    /// Of the SG lobe, which is about `axis`.
    pub sharpness: f64,
    /// Its intensity at the axis, W/sr.
    pub specular: DVec3,
    /// Unit.
    pub axis: DVec3,
    /// Flux that falls on the same lobe as that of a microfacet surface, W.
    pub flux: DVec3,
    /// How much wider than the surface's own lobe it is, as an inverse sharpness.
    pub widening: f64,
    /// That surface.
    pub lobe: GlossyLobe,
}

/// The lobe of an SG distribution of normals in reflection; its amplitude is the distribution's.
fn sg_lobe(lobe: &GlossyLobe, ndf: NdfLobe) -> AnisotropicSphericalGaussian {
    AnisotropicSphericalGaussian { amplitude: ndf.amplitude, ..reflection_lobe_asg(ndf.sharpness, lobe.normal, lobe.fixed_direction) }
}

fn ndf_of(brdf: &Brdf) -> NdfLobe {
    match brdf.distribution {
        Distribution::Phong => phong_lobe(phong_exponent(brdf.alpha)),
        Distribution::Ggx => ggx_lobe_one(brdf.alpha),
    }
}

impl SgLight {
    /// A light from the flux that each lobe sends (W), and the surface at its centre: `normal` is that of the patch, `axis` and `sharpness` those of the
    /// specular lobe, `to_source` is unit. `ndf_sharpness` is that of the surface's distribution (`lobelia::patch_moments`). The SG is cut off at the light's horizon and made larger by what
    /// that costs.
    #[allow(clippy::too_many_arguments)]
    pub fn of_lobes(
        position: DVec3,
        radius: f64,
        [diffuse, specular]: [DVec3; 2],
        (normal, spread): (DVec3, f64),
        (axis, sharpness): (DVec3, f64),
        to_source: DVec3,
        brdf: Brdf,
        ndf_sharpness: f64,
    ) -> Self {
        let whole = sg_integral(sharpness);
        let upper = hemisphere_integral(sharpness, axis.dot(normal)).max(0.25 * whole);
        let share = (4.0 * spread).clamp(0.0, 1.0);
        let half = (axis + to_source).normalize_or(normal);
        let albedo = brdf.specular_albedo(half.dot(to_source).max(0.0)).max(DVec3::splat(1e-4));
        let own = 1.0 / (2.0 + reflection_lobe_sg(ndf_sharpness, half, to_source).sharpness);
        let mean = 1.0 / (2.0 + sharpness);
        let alpha = (brdf.alpha * (mean / own).min(1.0).sqrt()).max(1e-3);
        Self {
            position,
            radius,
            diffuse: diffuse / PI,
            spread,
            normal,
            sharpness,
            specular: specular / (upper + (whole - upper) * share),
            axis,
            flux: specular / albedo,
            widening: (mean - own).max(0.0),
            lobe: GlossyLobe { normal: half, fixed_direction: to_source, brdf: Brdf { alpha, ..brdf } },
        }
    }
}

/// A surface, ready to receive.
#[derive(Clone, Copy, Debug)]
pub struct SgReceiver {
    /// Metres.
    pub position: DVec3,
    /// Unit.
    pub normal: DVec3,
    /// Diffuse albedo over pi.
    pub diffuse: DVec3,
    /// Its reflection lobe, to the viewer.
    pub lobe: GlossyLobe,
}

impl SgReceiver {
    fn sg_lobe(&self) -> AnisotropicSphericalGaussian {
        sg_lobe(&self.lobe, ndf_of(&self.lobe.brdf))
    }

    /// Sharpness of the round SG that is as broad as the reflection lobe.
    fn strength(&self) -> f64 {
        let lobe = self.sg_lobe();
        2.0 * (lobe.eta_x * lobe.eta_y).sqrt()
    }
}

/// `E[max(n.w, 0)]` over normals n about a mean of length `sqrt(1 - spread)`, c the cosine with the mean's axis: a hyperbola between `max(c, 0)` at spread 0 and
/// 0.28 (exact: 0.25) at 1. Within 0.05 for normals that are distributed as an SG.
pub fn spread_cosine(c: f64, spread: f64) -> f64 {
    let mean = c * (1.0 - spread).max(0.0).sqrt();
    0.5 * (mean + (mean * mean + 0.32 * spread).sqrt())
}

/// Share of normals about the mean that have a direction above their horizon.
pub fn share_above(c: f64, spread: f64) -> f64 {
    (0.5 + c / (2.0 * (0.5 * spread).sqrt() + 1e-4)).clamp(0.0, 1.0)
}

/// Share of a reflection lobe that is above the horizon: a Gaussian of variance `2 alpha^2 + inverse_sharpness` about the mirror direction.
pub fn lobe_above(c: f64, alpha_squared: f64, inverse_sharpness: f64) -> f64 {
    0.5 + 0.5 * c / (c * c + FRAC_PI_2 * (2.0 * alpha_squared + inverse_sharpness)).sqrt()
}

/// How a disk is seen from a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiskView {
    /// Unit: where its light comes from on average.
    pub direction: DVec3,
    /// Length of the irradiance vector of a disk of radiance 1 / area, 1/m^2: `cos / d^2` for a point.
    pub irradiance: f64,
    /// Solid angle over area, 1/m^2.
    pub solid_angle: f64,
    /// Of an SG of that solid angle.
    pub inverse_sharpness: f64,
}

/// The irradiance vector of a uniform Lambertian disk, exact while no part of it is below the surface's horizon (Siegel and Howell 2002, configurations 12 and 13).
///
/// A disk that would reach far through the surface counts as one of three times the radius that just touches it. Nothing is seen from behind either.
pub fn view_disk(receiver: &SgReceiver, light: &SgLight) -> DiskView {
    let nothing = DiskView { direction: receiver.normal, irradiance: 0.0, solid_angle: 0.0, inverse_sharpness: 0.0 };
    let offset = light.position - receiver.position;
    let d = offset.length_squared();
    let tilt = light.normal.dot(receiver.normal);
    let above = receiver.normal.dot(offset);
    let mut height = -light.normal.dot(offset);
    if light.spread > 0.0 {
        let kept = 1.0 - light.spread;
        height = 0.5 * (height * kept.sqrt() + (height * height * kept + 0.32 * light.spread * d).sqrt());
    }
    if !(above > 0.0 && height > 0.0) {
        return nothing;
    }
    let reach = 1.0 - tilt * tilt;
    let square = if light.radius.powi(2) * reach > 9.0 * above * above { 9.0 * above * above / reach } else { light.radius.powi(2) };
    let difference = d - square;
    let q = (difference * difference + 4.0 * square * height * height).sqrt();
    let parallel = if difference >= 0.0 { 2.0 * height * height / (q * (q + difference)) } else { (q - difference) / (2.0 * q * square) };
    let radial = 2.0 * height / (q * (q + d + square));
    let vector = offset * radial - light.normal * (parallel - radial * height);
    let irradiance = vector.length();
    if irradiance <= 1e-18 {
        return nothing;
    }
    let sine_squared = (square * irradiance).min(1.0);
    let inverse_rim = 1.0 / (1.0 + (1.0 - sine_squared).sqrt());
    DiskView {
        direction: vector / irradiance,
        irradiance,
        solid_angle: 2.0 * irradiance * inverse_rim,
        inverse_sharpness: 0.5 * sine_squared * inverse_rim,
    }
}

/// GGX filtered with the extent of an SG light in half vectors (Tokuyoshi et al. 2024), so that times `G2 F / (4 (n.v) (n.l)) (n.l)` and the light's energy it gives
/// reflected radiance. For an inverse sharpness of 0 it is the distribution.
pub fn filtered_ggx(lobe: &GlossyLobe, axis: DVec3, inverse_sharpness: f64) -> f64 {
    let alpha_squared = lobe.brdf.alpha.powi(2);
    let u = ((1.0 - lobe.brdf.alpha) * (1.0 + lobe.brdf.alpha)).max(0.0);
    let c = lobe.fixed_cosine();
    let (c_squared, s_squared) = (c * c, 1.0 - (c * c).min(1.0));
    let wide = u * inverse_sharpness;
    let along = alpha_squared + u * wide / (2.0 + wide);
    let across = alpha_squared + u * wide / (2.0 * c_squared + wide).max(1e-6);
    let both = along * across;
    let h = (lobe.fixed_direction + axis).normalize_or(lobe.normal);
    let slope = lobe.normal.cross(h);
    let slope_squared = slope.length_squared().min(1.0);
    let y = lobe.fixed_direction.dot(slope);
    let y_squared = if s_squared > 1e-4 { (y * y / s_squared).min(slope_squared) } else { 0.0 };
    let bracket = (slope_squared - y_squared) * across + y_squared * along + (1.0 - slope_squared) * both;
    let kept = lobe_above(c, alpha_squared, 0.0) / lobe_above(c, alpha_squared, inverse_sharpness);
    let normalisation = kept * (kept * (alpha_squared * s_squared + c_squared) * both / (along * s_squared + c_squared).max(1e-12)).sqrt();
    normalisation * both / (PI * bracket * bracket)
}

/// The distribution, filtered: [`filtered_ggx`], or for Phong the printed product of an ASG with the light.
fn filtered(lobe: &GlossyLobe, axis: DVec3, inverse_sharpness: f64) -> f64 {
    match lobe.brdf.distribution {
        Distribution::Ggx => filtered_ggx(lobe, axis, inverse_sharpness),
        Distribution::Phong => {
            let asg = sg_lobe(lobe, ndf_of(&lobe.brdf));
            let sharpness = 1.0 / inverse_sharpness.max(1e-8);
            asg.amplitude * asg_sg_integral_printed(asg.eta_x, asg.eta_y, asg.to_local(axis), sharpness) / sg_integral(sharpness)
        }
    }
}

/// Reflectance of a light's specular lobe towards the receiver, 1/sr, over the cone in which the light is seen.
pub fn light_reflectance(light: &SgLight, view: &DiskView) -> DVec3 {
    let direction = -view.direction;
    let c = light.lobe.normal.dot(direction);
    if c <= 0.0 {
        return DVec3::ZERO;
    }
    let shape = filtered(&light.lobe, direction, view.inverse_sharpness + light.widening);
    light.lobe.masking_and_fresnel(c, light.lobe.fixed_direction.dot(direction)) * shape
}

/// How far the light's lobe draws the direction that its light comes from to its own axis, over how far the cone holds it.
fn lobe_pull(light: &SgLight, axis: DVec3, view: &DiskView) -> f64 {
    light.sharpness * view.inverse_sharpness / (1.0 + 0.25 * light.sharpness * (axis + view.direction).length_squared())
}

/// Radiance that the glossy lobe reflects of an SG light that sends the irradiance 1 onto a surface facing it.
pub fn glossy_fast(receiver: &SgReceiver, axis: DVec3, inverse_sharpness: f64) -> DVec3 {
    let lobe = &receiver.lobe;
    let own = receiver.strength() * inverse_sharpness;
    let share = own / (1.0 + own);
    let mix = |a: f64, b: f64| a + (b - a) * share;
    let c = mix(receiver.normal.dot(axis), lobe.fixed_cosine());
    if c <= 0.0 {
        return DVec3::ZERO;
    }
    let v_dot_l = mix(lobe.fixed_direction.dot(axis), lobe.fixed_direction.dot(receiver.sg_lobe().axis));
    lobe.masking_and_fresnel(c, v_dot_l) * (c * filtered(lobe, axis, inverse_sharpness))
}

/// The cheapest form that is sound everywhere: the disk's irradiance is exact for a Lambertian light, GGX lobes of both ends are filtered by its extent. For radius 0 it
/// is the virtual point light.
pub fn vsgl_fast(receiver: &SgReceiver, light: &SgLight) -> DVec3 {
    let view = view_disk(receiver, light);
    if !(view.irradiance > 0.0 && receiver.normal.dot(view.direction) > 0.0) {
        return DVec3::ZERO;
    }
    let shiny = light.flux * light_reflectance(light, &view);
    let emitted = light.diffuse + shiny;
    let lobe_axis = reflection_axis(light.lobe.normal, light.lobe.fixed_direction);
    let pull = lobe_pull(light, lobe_axis, &view) * luminance(shiny) / luminance(emitted).max(1e-30);
    let p = view.direction - lobe_axis * pull;
    let length = p.length().max(1e-6);
    let axis = p / length;
    let glossy = glossy_fast(receiver, axis, view.inverse_sharpness / length);
    emitted * (receiver.diffuse * (view.irradiance * receiver.normal.dot(axis).max(0.0)) + glossy * view.solid_angle)
}

fn glossy_accurate(receiver: &SgReceiver, axis: DVec3, inverse_sharpness: f64) -> DVec3 {
    let lobe = &receiver.lobe;
    let sharpness = 1.0 / inverse_sharpness.max(1e-8);
    let v_dot_l = lobe.fixed_direction.dot(axis);
    if lobe.brdf.distribution == Distribution::Phong {
        let own = receiver.strength() * inverse_sharpness;
        let cosine = receiver.normal.dot(axis);
        let c = cosine + (lobe.fixed_cosine() - cosine) * own / (1.0 + own);
        if c <= 0.0 {
            return DVec3::ZERO;
        }
        let asg = receiver.sg_lobe();
        let integral = asg_sg_integral(asg.eta_x, asg.eta_y, asg.to_local(axis), sharpness);
        return lobe.masking_and_fresnel(c, v_dot_l) * (c * asg.amplitude * integral / sg_integral(sharpness));
    }
    let alpha = lobe.brdf.alpha;
    if alpha > 0.5 || 2.0 * sharpness * alpha * alpha > 10.0 {
        return glossy_fast(receiver, axis, inverse_sharpness);
    }
    let fresnel = lobe.brdf.fresnel((0.5 + 0.5 * v_dot_l).clamp(0.0, 1.0).sqrt());
    fresnel * (glossy_sg_light_two(alpha, receiver.normal, lobe.fixed_direction, axis, sharpness) / sg_integral(sharpness))
}

/// The best forms: both lobes of the light by themselves, the accurate clamped cosine, GGX filtered by the light or as two peaks.
pub fn vsgl_accurate(receiver: &SgReceiver, light: &SgLight) -> DVec3 {
    let view = view_disk(receiver, light);
    if view.irradiance <= 0.0 {
        return DVec3::ZERO;
    }
    let c = receiver.normal.dot(view.direction);
    let plain = light.diffuse * receiver.diffuse * (view.irradiance * c.max(0.0));
    let glossy = light.diffuse * glossy_accurate(receiver, view.direction, view.inverse_sharpness) * view.solid_angle;
    let shiny = light.flux * light_reflectance(light, &view) * view.solid_angle;
    let p = view.direction - light.axis * lobe_pull(light, light.axis, &view);
    let length = p.length().max(1e-6);
    let (axis, inverse_sharpness) = (p / length, view.inverse_sharpness / length);
    let sharpness = 1.0 / inverse_sharpness.max(1e-8);
    let sine_squared = receiver.normal.cross(axis).length_squared().min(1.0);
    let cosine = clamped_cosine_integral(sharpness, receiver.normal.dot(axis), sine_squared) / sg_integral(sharpness);
    plain + glossy + shiny * (receiver.diffuse * cosine + glossy_accurate(receiver, axis, inverse_sharpness))
}

/// A Gaussian cloud of positions, whose intensity is two SGs: nothing in it has an edge. A flat patch leaks a little behind itself.
pub fn vsgl_gaussian(receiver: &SgReceiver, light: &SgLight) -> DVec3 {
    let offset = light.position - receiver.position;
    let d = offset.length_squared();
    let square = light.radius.powi(2).max(4e-8 * d).max(1e-20);
    let (sharpness, density) = (4.0 * d / square, 2.0 / (PI * square));
    let direction = offset.normalize_or(receiver.normal);
    let lobe = |flux: DVec3, axis: DVec3, lobe_sharpness: f64| {
        let product = sg_product(-axis, lobe_sharpness, direction, sharpness);
        let amplitude = flux * (density * product.log_amplitude.exp() / sg_integral(lobe_sharpness));
        let sine_squared = receiver.normal.cross(product.axis).length_squared().min(1.0);
        let plain = receiver.diffuse * clamped_cosine_integral(product.sharpness, receiver.normal.dot(product.axis), sine_squared);
        amplitude * (plain + glossy_fast(receiver, product.axis, 1.0 / product.sharpness.max(1e-3)) * sg_integral(product.sharpness))
    };
    let mean = DIFFUSE_MEAN_COSINE * (1.0 - light.spread).max(0.0).sqrt();
    let dull = sharpness_from_averaged_direction(mean, 1.0 - mean * mean);
    lobe(light.diffuse * PI, light.normal, dull) + lobe(light.specular * sg_integral(light.sharpness), light.axis, light.sharpness)
}

/// The form of the 2014 brief: cone and lobe as SGs of doubled peak, the surface's lobe as an ASG, cosines pulled out.
pub fn vsgl_printed(receiver: &SgReceiver, light: &SgLight) -> DVec3 {
    let offset = light.position - receiver.position;
    let distance = offset.length();
    let direction = offset.normalize_or(receiver.normal);
    let c = receiver.normal.dot(direction);
    if c <= 0.0 {
        return DVec3::ZERO;
    }
    let at_light = -light.normal.dot(direction);
    let (light_cosine, above) = (spread_cosine(at_light, light.spread), share_above(at_light, light.spread));
    // The sharpness of the cone times r^2.
    let s = cone_scaled_sharpness(distance, light.radius).max(1e-24);
    let plain = light.diffuse * (light_cosine * c * 4.0 / s)
        + light.specular * (above * c * vsgl_kernel_diffuse_receiver(-light.axis, light.sharpness, direction, distance, light.radius));
    let asg = receiver.sg_lobe();
    let (local, lobe_local, eta) = (asg.to_local(direction), -asg.to_local(light.axis), [asg.eta_x, asg.eta_y]);
    let kernel = |axis: DVec3, sharpness: f64| vsgl_kernel_fast(eta, axis, sharpness, local, distance, light.radius);
    let glossy = light.diffuse * (light_cosine * kernel(local, 0.0)) + light.specular * (above * kernel(lobe_local, light.sharpness));
    let own = receiver.strength() * light.radius.powi(2) / s;
    let dominant = c + (receiver.lobe.fixed_cosine() - c) * own / (1.0 + own);
    let shading = receiver.lobe.masking_and_fresnel(dominant, receiver.lobe.fixed_direction.dot(direction)) * dominant;
    plain * receiver.diffuse + glossy * shading * asg.amplitude
}

/// Whether the disk may be taken for a point: every product of lobes is flatter than the cone times `threshold` (section 3.3 of the brief).
pub fn vsgl_is_point(receiver: &SgReceiver, light: &SgLight, distance: f64, threshold: f64) -> bool {
    let asg = receiver.sg_lobe();
    bias_reduction_applies(combined_sharpness_bound(asg.eta_x, asg.eta_y, light.sharpness), threshold, distance, light.radius)
}
