//! SGs, ASGs, their integrals and products.

use crate::search::{Bound, direction, log_uniform};
use glam::DVec3;
use lobelia_lobes::{asg::*, asg_product::*, sg::*, sg_cosine::*};
use std::f64::consts::PI;

/// 0 at the end, else log-uniform over [1e-6, 1e8].
fn sharpness(share: f64) -> f64 {
    if share == 0.0 { 0.0 } else { log_uniform(share, 1e-6, 1e8) }
}

/// Where the forms are not in their limits.
fn middle(share: f64) -> f64 {
    if share == 0.0 { 0.0 } else { log_uniform(share, 1e-3, 1e4) }
}

fn asg_sg_error(p: &[f64], form: fn(f64, f64, DVec3, f64) -> f64) -> f64 {
    let (x, y, sharpness, axis) = (middle(p[0]), middle(p[1]), middle(p[2]), direction(p[3], p[4]));
    let peak = asg_sg_integral_exact(x, y, DVec3::Z, sharpness);
    (form(x, y, axis, sharpness) - asg_sg_integral_exact(x, y, axis, sharpness)).abs() / peak
}

/// The error of the tangent Gaussian at the peak, its cosine that of the peak.
pub fn peak_alone(p: &[f64]) -> f64 {
    asg_sg_error(p, |x, y, axis, sharpness| {
        let peak = asg_sg_peak(x, y, axis, sharpness);
        let visible = if axis.z > 0.0 { peak.local.z } else { 0.0 };
        visible * peak.log_amplitude.exp() * asg_integral(peak.eta_larger, peak.eta_smaller)
    })
}

/// The recommended form of ASG times SG.
pub fn asg_sg() -> Bound {
    Bound {
        name: "asg_sg_integral",
        domain: "bandwidths and sharpness 0, 1e-3 to 1e4; all axes",
        reference: "quadrature, over the value at the ASG's axis",
        stated: 0.05,
        dimensions: 5,
        error: |p| asg_sg_error(p, asg_sg_integral),
        worst: &[&[1.0, 0.0, 0.52623, 0.89197, 0.75], &[0.30509, 0.50446, 0.57143, 0.75357, 1.0]],
    }
}

/// Over the lobe's integral A.
fn over_lobe(p: &[f64], low: f64, form: fn(f64, f64, f64) -> f64, exact: fn(f64, f64) -> f64) -> f64 {
    let (sharpness, angle) = (if low == 0.0 && p[0] == 0.0 { 0.0 } else { log_uniform(p[0], low.max(1e-6), 1e8) }, PI * p[1]);
    let (s, c) = angle.sin_cos();
    (form(sharpness, c, s * s) - exact(sharpness, angle)).abs() / sg_integral(sharpness)
}

/// Over the value, above the horizon.
fn over_value(p: &[f64], form: fn(f64, f64, f64) -> f64, exact: fn(f64, f64) -> f64) -> f64 {
    let (sharpness, angle) = (sharpness(p[0]), 0.5 * PI * p[1]);
    let (s, c) = angle.sin_cos();
    (form(sharpness, c.max(0.0), s * s) / exact(sharpness, angle) - 1.0).abs()
}

fn asg_integral_error(x: f64, y: f64, form: fn(f64, f64) -> f64) -> f64 {
    (form(x, y) / asg_integral_exact(x, y) - 1.0).abs()
}

macro_rules! bound {
    ($name:literal, $domain:literal, $reference:literal, $stated:literal, $dimensions:literal, $error:expr) => {
        Bound { name: $name, domain: $domain, reference: $reference, stated: $stated, dimensions: $dimensions, error: $error, worst: &[] }
    };
}

/// All of them.
pub fn bounds() -> Vec<Bound> {
    vec![
        asg_sg(),
        bound!("asg_sg_integral", "sharpness of 10 and above", "quadrature, over the value at the ASG's axis", 0.02, 5, |p| {
            let share = (1e4f64).ln();
            let from = ((p[2] * (1e3f64).ln() + (1e4f64).ln()) / (share + (1e3f64).ln())).min(1.0);
            asg_sg_error(&[p[0], p[1], from, p[3], p[4]], asg_sg_integral)
        }),
        bound!(
            "asg_sg_integral_printed",
            "sharpness 10 to 1e4, bandwidths 1 to 1e4",
            "quadrature, over the value at the ASG's axis",
            0.054,
            5,
            |p| {
                let [x, y] = [p[0], p[1]].map(|share| log_uniform(share, 1.0, 1e4));
                let (sharpness, axis) = (log_uniform(p[2], 10.0, 1e4), direction(p[3], p[4]));
                let error = asg_sg_integral_printed(x, y, axis, sharpness) - asg_sg_integral_exact(x, y, axis, sharpness);
                error.abs() / asg_sg_integral_exact(x, y, DVec3::Z, sharpness)
            }
        )
        .at(&[&[0.178, 0.0949, 0.0, 0.8809, 0.75]]),
        bound!("asg_integral", "bandwidths 0, 1e-6 to 1e8", "quadrature", 0.0145, 2, |p| asg_integral_error(
            sharpness(p[0]),
            sharpness(p[1]),
            asg_integral
        )),
        bound!("asg_integral", "bandwidths of 5 and above", "quadrature", 0.00345, 2, |p| {
            asg_integral_error(log_uniform(p[0], 5.0, 1e8), log_uniform(p[1], 5.0, 1e8), asg_integral)
        })
        .at(&[&[0.0, 0.0]]),
        bound!("asg_integral_fast", "bandwidths of 8 and above", "quadrature", 3.4e-4, 2, |p| {
            asg_integral_error(log_uniform(p[0], 8.0, 1e8), log_uniform(p[1], 8.0, 1e8), asg_integral_fast)
        })
        .at(&[&[0.0, 0.0]]),
        bound!("asg_integral_printed", "bandwidths of 1 and above", "quadrature", 0.052, 2, |p| {
            asg_integral_error(log_uniform(p[0], 1.0, 1e6), log_uniform(p[1], 1.0, 1e6), asg_integral_printed)
        })
        .at(&[&[0.0308, 0.0]]),
        bound!("asg_integral_printed", "bandwidths of 5 and above", "quadrature", 2.75e-4, 2, |p| {
            asg_integral_error(log_uniform(p[0], 5.0, 1e6), log_uniform(p[1], 5.0, 1e6), asg_integral_printed)
        })
        .at(&[&[0.01698, 0.0]]),
        bound!(
            "sg_product_integral_fast",
            "sum of sharpnesses of 10 and above",
            "exact, over the value of parallel lobes",
            0.0255,
            3,
            |p| {
                let sum = log_uniform(p[0], 10.0, 2e8);
                let a = if p[1] < 0.5 { sum * log_uniform(2.0 * p[1], 1e-6, 0.5) } else { 0.5 * sum };
                let other = direction(p[2], 0.0);
                let exact = sg_product_integral(DVec3::Z, a, other, sum - a);
                (sg_product_integral_fast(DVec3::Z, a, other, sum - a) - exact).abs() / sg_integral(sum)
            }
        )
        .at(&[&[0.0, 0.64205, 0.87446]]),
        bound!("sg_integral_fast", "sharpness of 3 and above", "exact", 0.0025, 1, |p| {
            let sharpness = log_uniform(p[0], 3.0, 1e8);
            (sg_integral_fast(sharpness) / sg_integral(sharpness) - 1.0).abs()
        }),
        bound!("hemisphere_integral", "sharpness 0, 1e-6 to 1e8; all angles", "quadrature, over A", 0.005, 2, |p| {
            over_lobe(p, 0.0, |x, c, _| hemisphere_integral(x, c), hemisphere_integral_exact)
        }),
        bound!("hemisphere_integral", "above the horizon", "quadrature, over the value", 0.0052, 2, |p| {
            over_value(p, |x, c, _| hemisphere_integral(x, c), hemisphere_integral_exact)
        }),
        bound!("hemisphere_integral_fast", "sharpness of 10 and above", "quadrature, over A", 0.0075, 2, |p| {
            over_lobe(p, 10.0, |x, c, _| hemisphere_integral_fast(x, c), hemisphere_integral_exact)
        }),
        bound!("hemisphere_integral_fast", "sharpness 1e-6 to 1e8", "quadrature, over A", 0.14, 2, |p| {
            over_lobe(p, 1e-6, |x, c, _| hemisphere_integral_fast(x, c), hemisphere_integral_exact)
        }),
        bound!("hemisphere_integral_meder", "sharpness 0, 1e-6 to 1e8", "quadrature, over A", 0.012, 2, |p| {
            over_lobe(p, 0.0, |x, c, _| hemisphere_integral_meder(x, c), hemisphere_integral_exact)
        }),
        bound!("clamped_cosine_integral", "sharpness 0, 1e-6 to 1e8; all angles", "quadrature, over A", 0.0013, 2, |p| {
            over_lobe(p, 0.0, clamped_cosine_integral, clamped_cosine_integral_exact)
        }),
        bound!("clamped_cosine_integral", "above the horizon", "quadrature, over the value", 0.0065, 2, |p| {
            over_value(p, clamped_cosine_integral, clamped_cosine_integral_exact)
        }),
        bound!("clamped_cosine_integral_fast", "sharpness 0, 1e-6 to 1e8; all angles", "quadrature, over A", 0.0156, 2, |p| {
            over_lobe(p, 0.0, |x, c, _| clamped_cosine_integral_fast(x, c), clamped_cosine_integral_exact)
        }),
        bound!("clamped_cosine_integral_fast", "above the horizon", "quadrature, over the value", 0.053, 2, |p| {
            over_value(p, |x, c, _| clamped_cosine_integral_fast(x, c), clamped_cosine_integral_exact)
        })
        .at(&[&[0.62449, 0.97138]]),
        bound!("clamped_cosine_integral_fast", "axis in the horizon", "Bessel function", 0.00151, 1, |p| {
            (clamped_cosine_integral_fast(sharpness(p[0]), 0.0) / clamped_cosine_integral_at_horizon(sharpness(p[0])) - 1.0).abs()
        }),
        bound!("clamped_cosine_integral_constant_cosine", "sharpness of 100 and above", "quadrature, over A", 0.04, 2, |p| {
            over_lobe(p, 100.0, |x, c, _| clamped_cosine_integral_constant_cosine(x, c), clamped_cosine_integral_exact)
        })
        .at(&[&[0.0, 0.5]]),
        bound!("clamped_cosine_integral_hill", "sharpness of 1 and above", "quadrature, over A", 0.04, 2, |p| {
            over_lobe(p, 1.0, |x, c, _| clamped_cosine_integral_hill(x, c), clamped_cosine_integral_exact)
        })
        .at(&[&[0.0138, 0.0]]),
        bound!("clamped_cosine_integral_difference", "sharpness 1e-6 to 1e8", "quadrature, over A", 0.004, 2, |p| {
            over_lobe(p, 1e-6, |x, c, _| clamped_cosine_integral_difference(x, c), clamped_cosine_integral_exact)
        }),
        bound!("clamped_cosine_integral_meder", "sharpness 1e-6 to 1e8", "quadrature, over A", 0.0112, 2, |p| {
            over_lobe(p, 1e-6, |x, c, _| clamped_cosine_integral_meder(x, c), clamped_cosine_integral_exact)
        }),
    ]
}
