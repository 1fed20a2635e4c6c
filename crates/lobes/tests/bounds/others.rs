//! Averaged directions, masking, albedo, encodings, virtual lights.

use crate::search::{Bound, direction, log_uniform};
use glam::DVec3;
use lobelia_lobes::{averaged_direction::*, brdf::*, octahedral::*, sg_light::*, special::erfc, specular_albedo::*, vsgl::spread_cosine};
use std::f64::consts::PI;

fn inverse_error(share: f64, form: fn(f64, f64) -> f64) -> f64 {
    let sharpness = log_uniform(share, 1e-6, 1e8);
    (form(mean_cosine(sharpness), one_minus_mean_cosine_squared(sharpness)) / sharpness - 1.0).abs()
}

fn albedo_error(p: &[f64], distribution: Distribution, which: usize) -> f64 {
    let (alpha, n_dot_l) = (log_uniform(p[0], 1e-3, 1.0), if p[1] < 0.5 { log_uniform(2.0 * p[1], 1e-5, 1.0) } else { 2.0 * p[1] - 1.0 });
    let (all, schlick) = specular_albedo_integrals(alpha, n_dot_l, distribution);
    let fit = specular_albedo_fit(alpha, n_dot_l, distribution);
    if which == 0 { (fit.0 - all.min(1.0)).abs() } else { (fit.1 - schlick).abs() }
}

fn cone_error(p: &[f64], degrees: f64) -> f64 {
    let (radius, angle) = (degrees.to_radians().tan(), PI * p[0]);
    let (s, c) = angle.sin_cos();
    (cone_irradiance(c, s * s, 1.0, radius) - cone_irradiance_exact(angle, 1.0, radius)).abs() / cone_irradiance_exact(0.0, 1.0, radius)
}

macro_rules! bound {
    ($name:literal, $domain:literal, $reference:literal, $stated:literal, $dimensions:literal, $error:expr) => {
        Bound { name: $name, domain: $domain, reference: $reference, stated: $stated, dimensions: $dimensions, error: $error, worst: &[] }
    };
}

/// All of them.
pub fn bounds() -> Vec<Bound> {
    vec![
        bound!("sharpness_from_averaged_direction", "sharpness 1e-6 to 1e8", "the sharpness", 1.05e-3, 1, |p| {
            inverse_error(p[0], sharpness_from_averaged_direction)
        }),
        bound!("sharpness_from_averaged_direction_banerjee", "sharpness 1e-6 to 1e8", "the sharpness", 0.0495, 1, |p| {
            inverse_error(p[0], sharpness_from_averaged_direction_banerjee)
        }),
        bound!("sharpness_from_averaged_direction_toksvig", "sharpness 1e-6 to 1e8", "the sharpness", 0.67, 1, |p| {
            inverse_error(p[0], sharpness_from_averaged_direction_toksvig)
        }),
        bound!("mean_cosine_toksvig", "sharpness 1e-6 to 1e8", "mean_cosine", 0.1905, 1, |p| {
            let sharpness = log_uniform(p[0], 1e-6, 1e8);
            (mean_cosine_toksvig(sharpness) - mean_cosine(sharpness)).abs()
        }),
        bound!("mean_cosine_banerjee", "sharpness 1e-6 to 1e8", "mean_cosine", 0.0125, 1, |p| {
            let sharpness = log_uniform(p[0], 1e-6, 1e8);
            (mean_cosine_banerjee(sharpness) - mean_cosine(sharpness)).abs()
        }),
        bound!(
            "phong_lambda",
            "alpha 0.001 to 1; all cosines",
            "Smith's Lambda of Beckmann's distribution, of 1 / (1 + Lambda)",
            0.0035,
            2,
            |p| {
                let (alpha, a) = (log_uniform(p[0], 1e-3, 1.0), log_uniform(p[1], 1e-3, 10.0));
                // The cosine at which sqrt(exponent / 2 + 1) / tan is a.
                let tangent = (0.5 * phong_exponent(alpha) + 1.0).sqrt() / a;
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                let exact = 0.5 * ((-a * a).exp() / (a * PI.sqrt()) - erfc(a));
                ((1.0 + exact) / (1.0 + phong_lambda(alpha, cosine)) - 1.0).abs()
            }
        ),
        bound!("specular_albedo_fit, A", "GGX, alpha 0.001 to 1, all cosines", "quadrature", 0.0071, 2, |p| albedo_error(
            p,
            Distribution::Ggx,
            0
        )),
        bound!("specular_albedo_fit, S", "GGX, alpha 0.001 to 1, all cosines", "quadrature", 0.0107, 2, |p| albedo_error(
            p,
            Distribution::Ggx,
            1
        )),
        bound!("specular_albedo_fit, A", "Phong, alpha 0.001 to 1, all cosines", "quadrature", 0.0102, 2, |p| albedo_error(
            p,
            Distribution::Phong,
            0
        )),
        bound!("specular_albedo_fit, S", "Phong, alpha 0.001 to 1, all cosines", "quadrature", 0.0095, 2, |p| albedo_error(
            p,
            Distribution::Phong,
            1
        )),
        bound!("octahedral_pack", "all directions", "the direction, rad", 6.5e-5, 2, |p| {
            let w = direction(p[0], p[1]);
            octahedral_unpack(octahedral_pack(w)).cross(w).length()
        }),
        bound!("spread_cosine", "all cosines, spread 0 to 1", "mean clamped cosine of a normalised SG of normals", 0.0505, 2, |p| {
            use lobelia_lobes::{sg::sg_integral, sg_cosine::clamped_cosine_integral_exact};
            let (c, spread) = (2.0 * p[0] - 1.0, p[1].max(1e-6));
            let sharpness = sharpness_from_averaged_direction_exact((1.0 - spread).sqrt(), spread);
            (spread_cosine(c, spread) - clamped_cosine_integral_exact(sharpness, c.acos()) / sg_integral(sharpness)).abs()
        }),
        bound!("cone_irradiance", "half angle of 5 degrees", "quadrature, over the facing cone's", 0.0012, 1, |p| cone_error(p, 5.0)),
        bound!("cone_irradiance", "half angle of 20 degrees", "quadrature, over the facing cone's", 0.0054, 1, |p| cone_error(p, 20.0)),
        bound!("cone_irradiance", "half angle of 45 degrees", "quadrature, over the facing cone's", 0.0149, 1, |p| cone_error(p, 45.0)),
        bound!("cone_irradiance", "half angle of 70 degrees", "quadrature, over the facing cone's", 0.0344, 1, |p| cone_error(p, 70.0)),
        bound!("cone_irradiance", "half angle of 88 degrees", "quadrature, over the facing cone's", 0.125, 1, |p| cone_error(p, 88.0)),
        bound!(
            "combined_sharpness_bound",
            "bandwidths and sharpness 1e-6 to 1e8; all axes",
            "asg_sg_peak, share of the peak's sharpness",
            1.0000001,
            5,
            |p| {
                use lobelia_lobes::asg_product::asg_sg_peak;
                let [x, y, sharpness] = [p[0], p[1], p[2]].map(|share| log_uniform(share, 1e-6, 1e8));
                let peak = asg_sg_peak(x, y, direction(p[3], p[4]), sharpness);
                2.0 * peak.eta_larger / combined_sharpness_bound(x, y, sharpness)
            }
        ),
        bound!(
            "merge_averaged_directions",
            "two lobes, sharpness 1e-6 to 1e8, any angle",
            "1 - |m|^2 of the mean, over 1",
            1e-14,
            4,
            |p| {
                let [a, b] = [0, 1].map(|i| {
                    AveragedDirection::of_lobe(if i == 0 { DVec3::Z } else { direction(p[2], 0.3) }, log_uniform(p[i], 1e-6, 1e8))
                });
                let merged = merge_averaged_directions(&[(p[3], a), (1.0 - p[3], b)]);
                let mean = a.axis * (a.length() * p[3]) + b.axis * (b.length() * (1.0 - p[3]));
                (merged.one_minus_length_squared - (1.0 - mean.length_squared())).abs()
            }
        ),
    ]
}
