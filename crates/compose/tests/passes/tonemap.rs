//! `tonemap` against the curves in 64-bit floats, for every half float from 0 to 65504 and every exposure from one end to the other.

use crate::{
    EXTENT, draw,
    source::{Pattern, radiance},
};
use glam::DVec3;
use lobelia_graph::{
    Gpu,
    testing::{compare, gpu},
};
use lobelia_lobes::tonemap::{aces, agx, srgb_encode};

const EXPOSURES: [f64; 7] = [-32.0, -9.5, -1.0, 0.0, 1.0, 9.5, 32.0];

/// How far, in steps of 8 bits, a picture may be from the exact value: half a step of rounding and what 32-bit floats add.
const STEPS: f64 = 0.51;

type Curve = fn(DVec3) -> DVec3;
const CURVES: [(&str, Curve); 3] = [("none", |color| color.clamp(DVec3::ZERO, DVec3::ONE)), ("aces", aces), ("agx", agx)];

fn picture(gpu: &Gpu, pattern: &str, curve: &str, exposure: f64) -> Vec<f64> {
    let passes = format!(r#""a": source(pattern: {pattern}), "b": tonemap(curve: {curve}, exposure: {exposure:?})"#);
    let image = draw(gpu, &format!(r#"(passes: {{{passes}}}, output: "b.image")"#));
    assert_eq!((image.bytes.len(), image.extent), (4 * (EXTENT[0] * EXTENT[1]) as usize, EXTENT));
    let opaque = image.bytes.chunks_exact(4).all(|texel| texel[3] == 255);
    assert!(opaque, "{curve} {exposure}");
    image.bytes.chunks_exact(4).flat_map(|texel| [texel[0], texel[1], texel[2]]).map(f64::from).collect()
}

/// Exact values, in steps of 8 bits.
fn expected(pattern: Pattern, curve: Curve, exposure: f64) -> Vec<f64> {
    let texels = radiance(pattern, 0, EXTENT).into_iter();
    let exposed = texels.map(|[r, g, b]| DVec3::new(r.into(), g.into(), b.into()) * exposure.exp2());
    exposed.flat_map(|color| curve(color).to_array()).map(|value| 255.0 * srgb_encode(value)).collect()
}

#[test]
fn every_curve_is_that_of_the_formula() {
    let Some(gpu) = gpu() else { return };
    for (name, curve) in CURVES {
        for exposure in EXPOSURES {
            for (pattern, text) in [(Pattern::Grey, "grey"), (Pattern::Random, "random")] {
                let agrees = compare(&expected(pattern, curve, exposure), &picture(gpu, text, name, exposure), 0.0, STEPS);
                agrees.unwrap_or_else(|worst| panic!("{name}, {exposure} stops, {text}: {worst}"));
            }
        }
    }
}

#[test]
fn another_curve_or_exposure_is_seen() {
    let Some(gpu) = gpu() else { return };
    for (name, _) in CURVES {
        let got = picture(gpu, "grey", name, 0.0);
        for (other, curve) in CURVES {
            let agrees = compare(&expected(Pattern::Grey, curve, 0.0), &got, 0.0, STEPS);
            assert_eq!(agrees.is_ok(), name == other, "{name} against {other}: {agrees:?}");
            compare(&expected(Pattern::Grey, curve, 0.05), &got, 0.0, STEPS).expect_err("a twentieth of a stop must be seen");
        }
    }
}

#[test]
fn brighter_grey_is_never_darker() {
    let Some(gpu) = gpu() else { return };
    for (name, _) in CURVES {
        let got = picture(gpu, "grey", name, 0.0);
        let greys: Vec<f64> = got.chunks_exact(3).map(|texel| texel[1]).collect();
        let falls = greys.windows(2).filter(|pair| pair[1] < pair[0]).count();
        assert_eq!(falls, 0, "{name}");
        assert_eq!(greys[0], 0.0, "{name}: black stays black");
        assert!(greys[greys.len() - 1] > 250.0, "{name}: the brightest is nearly white: {}", greys[greys.len() - 1]);
    }
}
