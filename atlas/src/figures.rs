//! The figures of the atlas: each approximation's error over its domain.

use crate::heat_map::{Axis, Curves, HeatMap, Panel};
use glam::{DVec3, Vec3};
use lobelia_lobes::{
    asg::*,
    asg_product::*,
    averaged_direction::*,
    brdf::ggx_distribution,
    lobe_similarity::{lobe_similarity, lobe_similarity_exact},
    microfacet_lobe::*,
    sg::*,
    sg_cosine::*,
};
use std::f64::consts::TAU;

/// One picture.
pub struct Figure {
    /// File name without its ending.
    pub name: &'static str,
    /// Computes it.
    pub panels: fn() -> Vec<Panel>,
}

/// All figures, in the order of the page.
pub fn all() -> Vec<Figure> {
    vec![
        Figure { name: "sg", panels: gaussian },
        Figure { name: "sg-product", panels: product },
        Figure { name: "hemisphere", panels: hemisphere },
        Figure { name: "clamped-cosine", panels: clamped_cosine },
        Figure { name: "asg-integral", panels: anisotropic },
        Figure { name: "asg-sg", panels: anisotropic_product },
        Figure { name: "reflection-lobe", panels: reflection },
        Figure { name: "glossy", panels: glossy },
        Figure { name: "averaged-direction", panels: averaged },
        Figure { name: "similarity", panels: similarity },
    ]
}

const CELLS: [usize; 2] = [96, 72];

fn degrees(high: f64) -> Axis {
    Axis::linear("angle, degrees", 0.0, high)
}

fn sharpness(low: f64, high: f64) -> Axis {
    Axis::logarithmic("sharpness", low, high)
}

fn map(title: &str, x: Axis, y: Axis, size: [usize; 2], error: impl Fn(f64, f64) -> f64 + Sync) -> Panel {
    Panel::Map(HeatMap::evaluate(title, x, y, size, error))
}

fn tilted(angle: f64) -> DVec3 {
    let (sine, cosine) = angle.to_radians().sin_cos();
    DVec3::new(sine, 0.0, cosine)
}

/// The value of an SG in 32 bits two ways, the worst of many directions where it is above 1e-4; and the fast integral.
fn gaussian() -> Vec<Panel> {
    let worst = |sharpness: f64, form: fn(f32, Vec3, Vec3) -> f32| {
        let mut worst: f64 = 0.0;
        for step in 0..200u32 {
            let mut draw = crate::draw::Draw::new(step, 70);
            let axis = draw.direction().as_vec3();
            let angle = draw.between(0.0, 4.2) / sharpness.max(1.0).sqrt();
            let direction = draw.direction_at(axis.as_dvec3(), angle).as_vec3();
            let exact = sg_evaluate(axis.as_dvec3(), f64::from(sharpness as f32), direction.as_dvec3());
            if exact > 1e-4 {
                worst = worst.max((f64::from(form(sharpness as f32, axis, direction)) / exact - 1.0).abs());
            }
        }
        worst
    };
    let value = Curves::evaluate(
        "value in 32 bits, worst relative error",
        sharpness(1e-2, 1e8),
        &[
            ("exp(s (w.axis - 1))", &|s| worst(s, |s, axis, w| (s * (axis.dot(w) - 1.0)).exp())),
            ("exp(-s |w - axis|^2 / 2)", &|s| worst(s, |s, axis, w| (-0.5 * s * (w - axis).length_squared()).exp())),
        ],
    );
    let integral = Curves::evaluate(
        "integral, relative error",
        sharpness(1e-2, 1e2),
        &[("sg_integral_fast, 2 pi / s", &|s| sg_integral_fast(s) / sg_integral(s) - 1.0)],
    );
    vec![Panel::Curves(value), Panel::Curves(integral)]
}

fn product() -> Vec<Panel> {
    let of = |form: fn(DVec3, f64, DVec3, f64) -> f64, s: f64, angle: f64| form(DVec3::Z, s, tilted(angle), s);
    let x = || Axis::logarithmic("sharpness of both", 0.1, 1e4);
    vec![
        map("fast, over the value at 0 degrees", x(), degrees(180.0), CELLS, |s, angle| {
            (of(sg_product_integral_fast, s, angle) - of(sg_product_integral, s, angle)) / of(sg_product_integral, s, 0.0)
        }),
        map("fast, relative", x(), degrees(180.0), CELLS, |s, angle| {
            let log_exact = log_sg_product_integral(DVec3::Z, s, tilted(angle), s);
            // As logarithms: both underflow for sharp lobes.
            let log_fast = (TAU / (2.0 * s)).ln() - 0.25 * s * (DVec3::Z - tilted(angle)).length_squared();
            (log_fast - log_exact).exp_m1()
        }),
    ]
}

fn over_angle(title: &str, form: impl Fn(f64, f64) -> f64 + Sync, exact: impl Fn(f64, f64) -> f64 + Sync) -> Panel {
    map(title, sharpness(1e-2, 1e4), degrees(180.0), CELLS, |s, angle| {
        (form(s, angle.to_radians()) - exact(s, angle.to_radians())) / sg_integral(s)
    })
}

fn hemisphere() -> Vec<Panel> {
    let panel = |title, form: fn(f64, f64) -> f64| over_angle(title, move |s, angle| form(s, angle.cos()), hemisphere_integral_exact);
    vec![
        panel("hemisphere_integral", hemisphere_integral),
        panel("..._fast", hemisphere_integral_fast),
        panel("..._meder", hemisphere_integral_meder),
    ]
}

fn clamped_cosine() -> Vec<Panel> {
    let panel = |title, form: fn(f64, f64) -> f64| over_angle(title, move |s, angle| form(s, angle.cos()), clamped_cosine_integral_exact);
    vec![
        over_angle(
            "clamped_cosine_integral",
            |s, angle| clamped_cosine_integral(s, angle.cos(), angle.sin().powi(2)),
            clamped_cosine_integral_exact,
        ),
        panel("..._fast", clamped_cosine_integral_fast),
        panel("..._constant_cosine", clamped_cosine_integral_constant_cosine),
        panel("..._difference (2022)", clamped_cosine_integral_difference),
        panel("..._meder", clamped_cosine_integral_meder),
        panel("..._hill", clamped_cosine_integral_hill),
    ]
}

fn anisotropic() -> Vec<Panel> {
    let panel = |title, form: fn(f64, f64) -> f64| {
        let (x, y) = (Axis::logarithmic("eta_x", 1e-3, 1e4), Axis::logarithmic("eta_y", 1e-3, 1e4));
        map(title, x, y, [72, 72], move |x, y| form(x, y) / asg_integral_exact(x, y) - 1.0)
    };
    vec![panel("asg_integral", asg_integral), panel("..._printed", asg_integral_printed), panel("..._fast", asg_integral_fast)]
}

fn anisotropic_product() -> Vec<Panel> {
    let panel = |title, eta: [f64; 2], form: fn(f64, f64, DVec3, f64) -> f64| {
        map(title, sharpness(0.1, 1e3), degrees(90.0), [36, 30], move |s, angle| {
            // Tilted across both bandwidths alike.
            let (sine, cosine) = angle.to_radians().sin_cos();
            let axis = DVec3::new(0.6 * sine, 0.8 * sine, cosine);
            let exact = |axis| asg_sg_integral_exact(eta[0], eta[1], axis, s);
            (form(eta[0], eta[1], axis, s) - exact(axis)) / exact(DVec3::Z)
        })
    };
    vec![
        panel("asg_sg_integral, eta 50, 5", [50.0, 5.0], asg_sg_integral),
        panel("..._printed, eta 50, 5", [50.0, 5.0], asg_sg_integral_printed),
        panel("asg_sg_integral, eta 2, 1", [2.0, 1.0], asg_sg_integral),
    ]
}

/// L1 distance between D(h) and a lobe of amplitude 1 over the upper hemisphere, over the integral of D(h), both with peak 1.
fn reflection_distance(alpha: f64, view: DVec3, lobe: impl Fn(DVec3) -> f64) -> f64 {
    let mirror = reflection_axis(DVec3::Z, view);
    let (x, y) = mirror.any_orthonormal_pair();
    let (mut off, mut whole) = (0.0, 0.0);
    const RINGS: u32 = 90;
    const SECTORS: u32 = 96;
    // Rings whose radius grows by equal factors from far inside the lobe to the far side.
    let (low, high) = ((0.02 * alpha).ln(), std::f64::consts::PI.ln());
    let step = (high - low) / f64::from(RINGS);
    for ring in 0..RINGS {
        let angle = (low + (f64::from(ring) + 0.5) * step).exp();
        let weight = angle.sin() * angle * step;
        for sector in 0..SECTORS {
            let azimuth = TAU * (f64::from(sector) + 0.5) / f64::from(SECTORS);
            let l = mirror * angle.cos() + (x * azimuth.cos() + y * azimuth.sin()) * angle.sin();
            if l.z > 0.0 {
                let h = (l + view).normalize_or(DVec3::Z);
                let value = beckmann_distribution(alpha, DVec3::Z, h) / beckmann_distribution(alpha, DVec3::Z, DVec3::Z);
                whole += value * weight;
                off += (lobe(l) - value).abs() * weight;
            }
        }
    }
    off / whole
}

fn reflection() -> Vec<Panel> {
    let alpha = || Axis::logarithmic("alpha", 0.01, 1.0);
    let angle = || Axis::linear("view angle, degrees", 0.0, 90.0);
    let panel = |title, lobe: fn(f64, DVec3, DVec3) -> f64| {
        map(title, alpha(), angle(), [48, 60], move |alpha, degrees| {
            let view = tilted(degrees);
            reflection_distance(alpha, view, |l| lobe(alpha, view, l))
        })
    };
    vec![
        panel("SG, printed (Beckmann, L1)", |alpha, view, l| {
            let lobe = reflection_lobe_sg_printed(ndf_sharpness_beckmann(alpha), DVec3::Z, view);
            lobe.evaluate(l) / lobe.amplitude
        }),
        panel("ASG, printed", |alpha, view, l| {
            let lobe = reflection_lobe_asg_printed(ndf_sharpness_beckmann(alpha), DVec3::Z, view);
            lobe.evaluate(l) / lobe.amplitude
        }),
        panel("ASG, regularised", |alpha, view, l| {
            let lobe = reflection_lobe_asg(ndf_sharpness_beckmann(alpha), DVec3::Z, view);
            lobe.evaluate(l) / lobe.amplitude
        }),
    ]
}

fn glossy() -> Vec<Panel> {
    type Form = fn(f64, DVec3, DVec3, DVec3, f64) -> f64;
    let panel = |title, form: Form| {
        let (x, y) = (sharpness(3.0, 1e4), Axis::logarithmic("alpha", 0.01, 1.0));
        map(title, x, y, [24, 20], move |s, alpha| {
            let (view, n) = (tilted(60.0), DVec3::Z);
            let light = reflection_axis(n, view);
            form(alpha, n, view, light, s) / glossy_sg_light_exact(alpha, n, view, light, s, 1e-4) - 1.0
        })
    };
    vec![
        panel("glossy_sg_light_fast", glossy_sg_light_fast),
        panel("..._one", glossy_sg_light_one),
        panel("..._two", glossy_sg_light_two),
        panel("..._three", glossy_sg_light_three),
        panel("filtered_ndf_shading", filtered_ndf_shading),
        map(
            "GGX as three SGs, over its peak",
            Axis::logarithmic("alpha", 0.01, 1.0),
            Axis::linear("angle / alpha", 0.0, 4.0),
            [48, 40],
            |alpha, scaled| {
                let n = tilted((scaled * alpha).min(1.5).to_degrees());
                let sum: f64 = ggx_lobes_three(alpha).iter().map(|lobe| lobe.about(DVec3::Z).evaluate(n)).sum();
                (sum - ggx_distribution(alpha, DVec3::Z, n)) / ggx_distribution(alpha, DVec3::Z, DVec3::Z)
            },
        ),
    ]
}

fn averaged() -> Vec<Panel> {
    let inverse = |form: fn(f64, f64) -> f64, s: f64| form(mean_cosine(s), one_minus_mean_cosine_squared(s)) / s - 1.0;
    let back = Curves::evaluate(
        "sharpness from an averaged direction",
        sharpness(1e-3, 1e5),
        &[
            ("toksvig", &|s| inverse(sharpness_from_averaged_direction_toksvig, s)),
            ("banerjee", &|s| inverse(sharpness_from_averaged_direction_banerjee, s)),
            ("default (corrected)", &|s| inverse(sharpness_from_averaged_direction, s)),
        ],
    );
    let forth = Curves::evaluate(
        "mean cosine from a sharpness",
        sharpness(1e-3, 1e5),
        &[
            ("toksvig", &|s| mean_cosine_toksvig(s) / mean_cosine(s) - 1.0),
            ("banerjee", &|s| mean_cosine_banerjee(s) / mean_cosine(s) - 1.0),
        ],
    );
    vec![Panel::Curves(back), Panel::Curves(forth)]
}

fn similarity() -> Vec<Panel> {
    let error =
        |a: f64, b: f64, angle: f64| lobe_similarity(DVec3::Z, a, tilted(angle), b) - lobe_similarity_exact(DVec3::Z, a, tilted(angle), b);
    vec![
        map("lobe_similarity, same axis", sharpness(1e-2, 1e4), sharpness(1e-2, 1e4), [72, 72], move |a, b| error(a, b, 0.0)),
        map("lobe_similarity, same sharpness", sharpness(1e-2, 1e4), degrees(180.0), CELLS, move |s, angle| error(s, s, angle)),
    ]
}
