//! Every sampler against its density by Pearson's chi-squared test, and the weights of BRDF samples against the albedo by quadrature.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia_lobes::{
    brdf::{Brdf, Distribution, MIN_ALPHA},
    quadrature::integrate,
    sampling::*,
};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::{PI, TAU};

const SAMPLES: usize = 100_000;

/// No test of a right density is this unlikely to pass; all tests of wrong ones below are far beyond.
const LEAST_P: f64 = 1e-4;

/// SplitMix64 (Steele et al. 2014): pairs of independent numbers in [0, 1).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn pair(&mut self) -> [f64; 2] {
        [self.unit(), self.unit()]
    }
}

/// Bins about an axis out to a versine (1 - cos), equal in azimuth and in `r / (1 + r)`, r being the root of versine over scale: with the scale of a lobe,
/// as many lie within the lobe as around it, and densities that fall as the cube of the angle stay smooth.
#[derive(Clone, Copy)]
struct Grid {
    axis: DVec3,
    scale: f64,
    last: f64,
}

const RINGS: usize = 16;
const SECTORS: usize = 24;
const FINE: usize = 20;

impl Grid {
    fn new(axis: DVec3, scale: f64, last: f64) -> Self {
        Self { axis, scale, last }
    }

    fn coordinate(&self, versine: f64) -> f64 {
        let r = (versine / self.scale).sqrt();
        r / (1.0 + r)
    }

    /// Where a direction falls; one more than the last bin for what lies outside.
    fn bin(&self, w: DVec3) -> usize {
        let versine = 0.5 * (w - self.axis).length_squared();
        // A sample on the rim of a cone may be rounded to just outside.
        if versine > self.last * (1.0 + 1e-9) {
            return RINGS * SECTORS;
        }
        let (x, y) = self.axis.any_orthonormal_pair();
        let ring = self.coordinate(versine) / self.coordinate(self.last) * RINGS as f64;
        let sector = (w.dot(y).atan2(w.dot(x)) / TAU).rem_euclid(1.0) * SECTORS as f64;
        (ring as usize).min(RINGS - 1) * SECTORS + (sector as usize).min(SECTORS - 1)
    }

    /// Integral of a density over every bin, and over what lies outside if nothing is missing.
    fn integrals(&self, pdf: impl Fn(DVec3) -> f64) -> Vec<f64> {
        let (x, y) = self.axis.any_orthonormal_pair();
        let (rings, sectors) = (RINGS * FINE, SECTORS * FINE);
        let step = self.coordinate(self.last) / rings as f64;
        let mut bins = vec![0.0; RINGS * SECTORS];
        for ring in 0..rings {
            let q = (ring as f64 + 0.5) * step;
            let versine = self.scale * (q / (1.0 - q)).powi(2);
            let sine = (versine * (2.0 - versine)).sqrt();
            // d omega = d versine d azimuth.
            let measure = 2.0 * self.scale * q / (1.0 - q).powi(3) * step * TAU / sectors as f64;
            for sector in 0..sectors {
                let azimuth = (sector as f64 + 0.5) * TAU / sectors as f64;
                let w = self.axis * (1.0 - versine) + (x * azimuth.cos() + y * azimuth.sin()) * sine;
                bins[ring / FINE * SECTORS + sector / FINE] += pdf(w) * measure;
            }
        }
        let total: f64 = bins.iter().sum();
        bins.push((1.0 - total).max(0.0));
        bins
    }
}

/// Probability of a chi-squared at least as large as that between counts and expectations, neighbouring bins pooled until 5 are expected.
fn p_value(counts: &[usize], expected: &[f64]) -> f64 {
    let mut pools: Vec<(f64, f64)> = vec![];
    let mut open = (0.0, 0.0);
    for (count, share) in counts.iter().zip(expected) {
        open = (open.0 + *count as f64, open.1 + share * SAMPLES as f64);
        if open.1 >= 5.0 {
            pools.push(open);
            open = (0.0, 0.0);
        }
    }
    let last = pools.last_mut().unwrap();
    *last = (last.0 + open.0, last.1 + open.1);
    let chi_squared: f64 = pools.iter().map(|(count, expected)| (count - expected).powi(2) / expected).sum();
    ChiSquared::new((pools.len() - 1) as f64).unwrap().sf(chi_squared)
}

type Sampler = Box<dyn Fn([f64; 2]) -> Option<DVec3>>;
type Density = Box<dyn Fn(DVec3) -> f64>;

struct Case {
    name: String,
    grid: Grid,
    sample: Sampler,
    pdf: Density,
}

impl Case {
    fn new(name: String, grid: Grid, sample: impl Fn([f64; 2]) -> DVec3 + 'static, pdf: impl Fn(DVec3) -> f64 + 'static) -> Self {
        Self { name, grid, sample: Box::new(move |u| Some(sample(u))), pdf: Box::new(pdf) }
    }

    fn p_value(&self, pdf: &dyn Fn(DVec3) -> f64) -> f64 {
        let mut random = Random(17);
        let mut counts = vec![0; RINGS * SECTORS + 1];
        for _ in 0..SAMPLES {
            let place = (self.sample)(random.pair()).map_or(RINGS * SECTORS, |w| self.grid.bin(w));
            counts[place] += 1;
        }
        p_value(&counts, &self.grid.integrals(pdf))
    }
}

fn axes() -> [DVec3; 3] {
    [DVec3::Z, DVec3::new(0.48, -0.6, -0.64), DVec3::new(-0.3, 0.9, 1e-9).normalize()]
}

/// A unit vector at a cosine to `n`.
fn at(n: DVec3, cosine: f64) -> DVec3 {
    n * cosine + n.any_orthonormal_pair().0 * (1.0 - cosine * cosine).sqrt()
}

/// Cosines of views.
const VIEWS: [f64; 4] = [1.0, 0.7, 0.2, 0.02];

fn simple_cases() -> Vec<Case> {
    let mut cases = vec![];
    for (index, n) in axes().into_iter().enumerate() {
        let name = |text: &str| format!("{text}, axis {index}");
        cases.push(Case::new(name("sphere"), Grid::new(n, 1.0, 2.0), sample_sphere, |_| sphere_pdf()));
        let above = Grid::new(n, 1.0, 1.0);
        cases.push(Case::new(name("hemisphere"), above, move |u| sample_hemisphere(n, u), move |w| hemisphere_pdf(n, w)));
        cases.push(Case::new(name("cosine"), above, move |u| sample_cosine_hemisphere(n, u), move |w| cosine_hemisphere_pdf(n, w)));
        for versine in [1e-12, 1e-6, 0.1, 1.0, 2.0] {
            let grid = Grid::new(n, versine, versine);
            cases.push(Case::new(
                name(&format!("cone {versine}")),
                grid,
                move |u| sample_cone(n, versine, u),
                move |w| cone_pdf(n, versine, w),
            ));
        }
        for sharpness in [0.0, 1e-6, 1e-3, 1.0, 3.0, 100.0, 1e6, 1e8] {
            let grid = Grid::new(n, 1.0 / (sharpness + 1.0), 2.0);
            cases.push(Case::new(
                name(&format!("SG {sharpness}")),
                grid,
                move |u| sample_sg(n, sharpness, u),
                move |w| sg_pdf(n, sharpness, w),
            ));
        }
        for exponent in [0.0, 1e-3, 1.0, 100.0, 1e4, 2e6] {
            let grid = Grid::new(n, 1.0 / (exponent + 1.0), 1.0);
            let (sample, pdf) = (move |u| sample_phong_half_vector(exponent, n, u), move |h| phong_half_vector_pdf(exponent, n, h));
            cases.push(Case::new(name(&format!("Phong {exponent}")), grid, sample, pdf));
        }
        for alpha in [MIN_ALPHA, 0.01, 0.1, 0.5, 1.0] {
            let grid = Grid::new(n, alpha * alpha, 1.0);
            let (sample, pdf) = (move |u| sample_ggx_half_vector(alpha, n, u), move |h| ggx_half_vector_pdf(alpha, n, h));
            cases.push(Case::new(name(&format!("GGX {alpha}")), grid, sample, pdf));
            for cosine in VIEWS.into_iter().chain([1e-3, 0.0]) {
                let v = at(n, cosine);
                let (sample, pdf) = (move |u| sample_ggx_visible_normal(alpha, n, v, u), move |h| ggx_visible_normal_pdf(alpha, n, v, h));
                cases.push(Case::new(name(&format!("visible GGX {alpha}, view {cosine}")), grid, sample, pdf));
            }
        }
    }
    cases
}

/// Samples of BRDFs, binned by their half vectors: d l = 4 v.h d h.
fn brdf_case(brdf: Brdf, n: DVec3, cosine: f64) -> Case {
    let v = at(n, cosine);
    Case {
        name: format!("{brdf:?}, view {cosine}"),
        grid: Grid::new(n, if brdf.diffuse.x > 0.0 { 0.3 * brdf.alpha } else { brdf.alpha * brdf.alpha }, 1.0),
        sample: Box::new(move |u| sample_brdf(&brdf, n, v, u).map(|sample| (sample.direction + v).normalize())),
        pdf: Box::new(move |h| {
            let v_dot_h = v.dot(h);
            if v_dot_h <= 0.0 { 0.0 } else { 4.0 * v_dot_h * brdf_pdf(&brdf, n, v, 2.0 * v_dot_h * h - v) }
        }),
    }
}

fn brdf_cases() -> Vec<Case> {
    let mut cases = vec![];
    for distribution in [Distribution::Ggx, Distribution::Phong] {
        for (roughness, metallic) in [(0.1, 1.0), (0.3, 1.0), (1.0, 1.0), (0.15, 0.0), (0.5, 0.3), (1.0, 0.0)] {
            for (n, cosine) in axes().into_iter().cycle().zip(VIEWS) {
                cases.push(brdf_case(Brdf::new(DVec3::new(0.9, 0.6, 0.2), metallic, roughness, 1.0, distribution), n, cosine));
            }
        }
    }
    cases
}

#[test]
fn samples_are_distributed_as_their_densities_say() {
    let mut failed = vec![];
    let cases: Vec<Case> = simple_cases().into_iter().chain(brdf_cases()).collect();
    let mut least = 1.0f64;
    for case in &cases {
        let p = case.p_value(&case.pdf);
        least = least.min(p);
        if p.is_nan() || p < LEAST_P {
            failed.push(format!("{}: {p:e}", case.name));
        }
    }
    println!("{} cases, least p {least:e}", cases.len());
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
fn densities_integrate_to_one() {
    let mut worst = [0.0f64; 2];
    for case in simple_cases() {
        let (x, y) = case.grid.axis.any_orthonormal_pair();
        // Over the logarithm of the versine, which resolves any lobe; a view's horizon lies between panels.
        let total = integrate((1e-24f64).ln(), case.grid.last.ln(), 60, |log_versine| {
            let versine = log_versine.exp();
            let (along, across) = (case.grid.axis * (1.0 - versine), (versine * (2.0 - versine)).max(0.0).sqrt());
            integrate(0.0, TAU, 8, |azimuth| (case.pdf)(along + (x * azimuth.cos() + y * azimuth.sin()) * across)) * versine
        });
        // The edge of what a viewer sees lies across panels; a broken power of the cosine is not smooth at the horizon.
        let bound = if case.name.starts_with("visible") { 2e-5 } else { 1e-8 };
        worst[usize::from(bound > 1e-6)] = (total - 1.0).abs().max(worst[usize::from(bound > 1e-6)]);
        assert!((total - 1.0).abs() < bound, "{}: {total}", case.name);
    }
    println!("{worst:?}");
    // Of BRDFs, what is missing are draws without a sample, which the chi-squared tests count.
    for case in brdf_cases() {
        let total: f64 = case.grid.integrals(&case.pdf).iter().take(RINGS * SECTORS).sum();
        assert!(total < 1.0 + 2e-3 && total > 0.2, "{}: {total}", case.name);
    }
}

#[test]
fn wrong_densities_are_rejected() {
    let n = axes()[1];
    let rejected = |case: &Case, what: &str, pdf: &dyn Fn(DVec3) -> f64| {
        assert!(case.p_value(&case.pdf) > LEAST_P, "{what}");
        let p = case.p_value(pdf);
        assert!(p < 1e-9, "{what}: {p:e}");
    };
    for sharpness in [1.0, 100.0, 1e6] {
        let grid = Grid::new(n, 1.0 / (sharpness + 1.0), 2.0);
        let case = Case::new("SG".into(), grid, move |u| sample_sg(n, sharpness, u), move |w| sg_pdf(n, sharpness, w));
        rejected(&case, "sharpness", &|w| sg_pdf(n, 1.1 * sharpness, w));
        rejected(&case, "axis", &|w| sg_pdf((n + n.any_orthonormal_vector() * 0.1 / sharpness.sqrt()).normalize(), sharpness, w));
    }
    for alpha in [0.01, 0.1, 0.9] {
        let grid = Grid::new(n, alpha * alpha, 1.0);
        let case = Case::new("GGX".into(), grid, move |u| sample_ggx_half_vector(alpha, n, u), move |h| ggx_half_vector_pdf(alpha, n, h));
        rejected(&case, "alpha", &|h| ggx_half_vector_pdf(1.1 * alpha, n, h));
        let v = at(n, 0.2);
        let (sample, pdf) = (move |u| sample_ggx_visible_normal(alpha, n, v, u), move |h| ggx_visible_normal_pdf(alpha, n, v, h));
        let case = Case::new("visible".into(), grid, sample, pdf);
        rejected(&case, "alpha of visible normals", &|h| ggx_visible_normal_pdf(1.1 * alpha, n, v, h));
        rejected(&case, "all normals", &|h| ggx_half_vector_pdf(alpha, n, h));
    }
    let grid = Grid::new(n, 0.01, 1.0);
    let case = Case::new("Phong".into(), grid, move |u| sample_phong_half_vector(100.0, n, u), move |h| phong_half_vector_pdf(100.0, n, h));
    rejected(&case, "exponent", &|h| phong_half_vector_pdf(110.0, n, h));
    let brdf = |roughness| Brdf::new(DVec3::splat(0.5), 0.0, roughness, 1.0, Distribution::Ggx);
    let (right, wrong) = (brdf_case(brdf(0.4), n, 0.2), brdf_case(brdf(0.44), n, 0.2));
    rejected(&right, "roughness", &wrong.pdf);
}

/// Share of a white sky's light that is reflected to `v`, +Z being the normal: the diffuse part in closed form, the specular one by the midpoint rule over
/// half vectors, in azimuth and the logarithm of the tangent.
fn albedo(brdf: &Brdf, v: DVec3) -> DVec3 {
    let (steps, azimuths) = (800, 192);
    let (low, high) = ((1e-6f64).ln(), (1e6f64).ln());
    let step = (high - low) / steps as f64;
    let mut total = brdf.diffuse * PI;
    for index in 0..steps {
        let tangent = (low + (index as f64 + 0.5) * step).exp();
        let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
        let measure = tangent * tangent * cosine.powi(3) * step * TAU / azimuths as f64;
        for azimuth in 0..azimuths {
            let angle = (azimuth as f64 + 0.5) * TAU / azimuths as f64;
            let h = DVec3::new(angle.cos() * tangent, angle.sin() * tangent, 1.0) * cosine;
            let v_dot_h = v.dot(h);
            let l = 2.0 * v_dot_h * h - v;
            if v_dot_h > 0.0 && l.z > 0.0 {
                total += (brdf.evaluate(DVec3::Z, l, v) - brdf.diffuse) * (l.z * 4.0 * v_dot_h * measure);
            }
        }
    }
    total
}

/// Mean of the weights' first channel, its standard error, and the largest.
fn mean_weight(brdf: &Brdf, v: DVec3) -> (f64, f64, f64) {
    let mut random = Random(5);
    let (mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0f64);
    for _ in 0..SAMPLES {
        let weight = sample_brdf(brdf, DVec3::Z, v, random.pair()).map_or(0.0, |sample| sample.weight.x);
        sum += weight;
        squares += weight * weight;
        largest = largest.max(weight);
    }
    let (count, mean) = (SAMPLES as f64, sum / SAMPLES as f64);
    (mean, ((squares / count - mean * mean).max(0.0) / count).sqrt(), largest)
}

#[test]
fn weights_have_the_albedo_as_their_mean() {
    // What the midpoint rule leaves where the horizon cuts a lobe.
    const QUADRATURE: f64 = 3e-4;
    let agree = |(mean, deviation, _): (f64, f64, f64), albedo: f64| (mean - albedo).abs() <= 5.0 * deviation + QUADRATURE;
    for distribution in [Distribution::Ggx, Distribution::Phong] {
        for (metallic, specular) in [(0.0, 1.0), (0.5, 1.0), (1.0, 1.0), (0.0, 0.0)] {
            for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
                for cosine in VIEWS {
                    let v = at(DVec3::Z, cosine);
                    let brdf = Brdf::new(DVec3::splat(0.8), metallic, roughness, specular, distribution);
                    let (found, wanted) = (mean_weight(&brdf, v), albedo(&brdf, v).x);
                    assert!(agree(found, wanted), "{brdf:?}, view {cosine}: {found:?}, quadrature {wanted}");
                }
            }
        }
    }
    // A lobe that is rougher by a tenth reflects differently.
    let (v, brdf) = (at(DVec3::Z, 0.2), |roughness| Brdf::new(DVec3::ONE, 1.0, roughness, 1.0, Distribution::Ggx));
    assert!(!agree(mean_weight(&brdf(0.8), v), albedo(&brdf(0.88), v).x));
}

#[test]
fn a_white_metal_of_ggx_never_weighs_more_than_one() {
    for roughness in [0.0, 0.1, 0.35, 0.6, 0.8, 1.0] {
        for cosine in VIEWS.into_iter().chain([1e-4]) {
            let v = at(DVec3::Z, cosine);
            let (mean, deviation, largest) = mean_weight(&Brdf::new(DVec3::ONE, 1.0, roughness, 1.0, Distribution::Ggx), v);
            assert!(mean <= 1.0 + 1e-6 && largest <= 1.0 + 1e-6, "roughness {roughness}, view {cosine}: {mean} {largest}");
            // A furnace that is not dark either: masking takes less than alpha away from the horizon.
            let alpha = (roughness * roughness).max(MIN_ALPHA);
            assert!(cosine < 0.3 || mean > 1.0 - alpha - 5.0 * deviation, "roughness {roughness}, view {cosine}: {mean}");
        }
    }
}

#[test]
fn ends_of_the_domain_give_unit_vectors() {
    let last = 1.0 - f64::EPSILON / 2.0;
    for n in axes() {
        for u in [0.0, 1e-300, 0.5, 1.0 - 1.0 / 16_777_216.0, last].into_iter().flat_map(|x| [[x, 0.0], [x, last], [x, 0.25]]) {
            let mut found = vec![sample_sphere(u), sample_hemisphere(n, u), sample_cosine_hemisphere(n, u)];
            found.extend([0.0, 1e-16, 2.0].map(|versine| sample_cone(n, versine, u)));
            found.extend([0.0, 1e-300, 1e-12, 1.0, 400.0, 1e8].map(|sharpness| sample_sg(n, sharpness, u)));
            found.extend([0.0, 2e6].map(|exponent| sample_phong_half_vector(exponent, n, u)));
            for alpha in [MIN_ALPHA, 1.0] {
                found.push(sample_ggx_half_vector(alpha, n, u));
                found.extend([1.0, 0.5, 1e-12, 0.0].map(|cosine| sample_ggx_visible_normal(alpha, n, at(n, cosine), u)));
            }
            for w in found {
                assert!(w.is_finite() && (w.length() - 1.0).abs() < 1e-12, "{u:?}: {w}");
            }
        }
    }
    assert_eq!((sample_sg_versine(0.0, 0.25), sample_sg_versine(1e8, 1.0), sample_sg_versine(7.0, 0.0)), (0.5, 2.0, 0.0));
    // Of the sharpest lobe, u is told back: 1 - u = exp(-sharpness versine).
    for u in [1e-12, 0.1, 0.9, 1.0 - 1e-9] {
        assert!((-(-1e8 * sample_sg_versine(1e8, u)).exp_m1() / u - 1.0).abs() < 1e-12);
    }
    let black = Brdf::new(DVec3::ZERO, 0.0, 0.5, 0.0, Distribution::Ggx);
    assert_eq!(sample_brdf(&black, DVec3::Z, DVec3::Z, [0.3, 0.3]).unwrap().weight, DVec3::ZERO);
    assert_eq!(sample_brdf(&black, DVec3::Z, DVec3::NEG_Z, [0.3, 0.3]), None);
}
