//! The device against reference values: those that `crates/lobes` is tested with, or the file that `LOBELIA_AREA_LIGHT_VECTORS` names (schema `area-lights/1`).

#[path = "../../../crates/lobes/tests/common/mod.rs"]
mod common;

use super::{cosine_lobes, ggx, half_vectors};
use common::{
    area_lights::{polygon, records},
    given, vector,
};
use glam::{DMat3, DVec3};
use lobelia::{
    lobes::area_light::{
        axial_moment::lobe_fraction,
        boundary::Boundary,
        half_vector::{HalfVectorIntegral, half_vector_integral},
        radial_primitive::Microfacets,
    },
    shaders::Flags,
};
use serde_json::Value;

/// Into the frame with z along `normal` and `view` in the half plane y = 0, x >= 0.
fn frame(normal: DVec3, view: DVec3) -> DMat3 {
    let x = (view - normal * view.dot(normal)).try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    DMat3::from_cols(x, normal.cross(x), normal).transpose()
}

#[test]
fn vectors_moment_on_the_device() {
    let list = records("moment");
    let cases: Vec<cosine_lobes::Case> = list
        .iter()
        .map(|r| {
            let outline = polygon(r);
            // Where nothing is cut off, the whole light is above the plane that it faces.
            let normal = if r["clip_normal"].is_array() { vector(r, "clip_normal") } else { Boundary::polygon(&outline).facing };
            let axis = vector(r, "axis").normalize();
            let turn = frame(normal.normalize_or(DVec3::Z), axis);
            let outline: Vec<DVec3> = outline.iter().map(|corner| turn * *corner).collect();
            cosine_lobes::Case::new(&outline, turn * axis, given(r, "n"))
        })
        .collect();
    let Some(found) = cosine_lobes::on_device(&cases, &[]) else { return };
    // Owen's function with three nodes is off by 3.9e-5 at most, for an edge; what 32 bits add is in `allowed`.
    let expected = |factor: f64| list.iter().map(move |r| factor * lobe_fraction(given(r, "M"), given(r, "n")));
    let values = || found.iter().map(|found| f64::from(found[0]));
    let (worst, count) = cosine_lobes::misses(&cases, values(), expected(1.0), 8e-5);
    println!("{} moments, the largest error {worst:.2} of what is allowed", cases.len());
    assert_eq!(count, 0, "off by up to {worst} times what is allowed");
    let (_, wrong) = cosine_lobes::misses(&cases, values(), expected(0.99), 8e-5);
    assert!(wrong > cases.len() / 4, "only {wrong} see an error of a hundredth");
}

#[test]
fn vectors_phong_two_axis_on_the_device() {
    let list = records("phong_two_axis");
    let cases: Vec<cosine_lobes::Case> = list
        .iter()
        .map(|r| {
            let (normal, view) = (vector(r, "normal").normalize(), vector(r, "view").normalize());
            let turn = frame(normal, view);
            let outline: Vec<DVec3> = polygon(r).iter().map(|corner| turn * *corner).collect();
            let seen = turn * view;
            cosine_lobes::Case::new(&outline, DVec3::new(-seen.x, -seen.y, seen.z), given(r, "n"))
        })
        .collect();
    let Some(found) = cosine_lobes::on_device(&cases, &[]) else { return };
    let values = || found.iter().map(|found| f64::from(found[1]));
    let expected = |factor: f64| list.iter().map(move |r| factor * given(r, "value"));
    let (worst, count) = cosine_lobes::misses(&cases, values(), expected(1.0), 8e-5);
    println!("{} lobes about two axes, the largest error {worst:.2} of what is allowed", cases.len());
    assert_eq!(count, 0, "off by up to {worst} times what is allowed");
    let (_, wrong) = cosine_lobes::misses(&cases, values(), expected(0.99), 8e-5);
    assert!(wrong > cases.len() / 4, "only {wrong} see an error of a hundredth");
}

#[test]
fn vectors_microfacet_lobes_on_the_device() {
    let list = records("brdf");
    let of = |model: &str| -> Vec<(&Value, Vec<DVec3>, DVec3)> {
        let turned = |r: &'_ Value| {
            let (normal, view) = (vector(r, "normal").normalize(), vector(r, "view").normalize());
            let turn = frame(normal, view);
            (polygon(r).iter().map(|corner| turn * *corner).collect(), turn * view)
        };
        list.iter()
            .filter(|r| r["model"] == model)
            .map(|r| {
                let (corners, view) = turned(r);
                (r, corners, view)
            })
            .collect()
    };
    let six = Flags::new().with("HALF_VECTOR_NODES_SIX", true);
    for (model, flag) in [("blinn", ""), ("beckmann", "NDF_BECKMANN")] {
        let flags = if flag.is_empty() { six.clone() } else { six.clone().with(flag, true) };
        let lights = of(model);
        let alpha = |parameter: f64| if model == "blinn" { (2.0 / (parameter + 2.0)).sqrt() } else { parameter };
        let cases: Vec<half_vectors::Case> =
            lights.iter().map(|(r, corners, view)| half_vectors::Case::new(corners, *view, alpha(given(r, "param")))).collect();
        let Some(found) = half_vectors::on_device(&cases, &flags) else { return };
        // What 32 bits may add to the error of six nodes, which is 1e-3 at the most up to 85 degrees, and a few times that beyond.
        let allowed: Vec<f64> = lights
            .iter()
            .zip(&cases)
            .map(|((r, ..), case)| {
                let six = half_vector_integral(&case.light, DVec3::Z, case.view, half_vectors::microfacets(case.alpha, flag), 6).whole;
                let nodes = (six - given(r, "value")).abs();
                let most = if case.view.z > 0.08 { 1.2e-3 } else { 5e-3 };
                assert!(nodes < most * given(r, "value") + 1e-6, "six nodes: {six} in {r}");
                half_vectors::allowed(case, 2e-6) + nodes
            })
            .collect();
        let misses = |factor: f64| {
            let off = |(((r, ..), (sum, _)), allowed): ((&(&Value, _, _), &(HalfVectorIntegral, _)), &f64)| {
                let off = (sum.whole - factor * given(r, "value")).abs() / allowed;
                if off.is_nan() { f64::INFINITY } else { off }
            };
            let all: Vec<f64> = lights.iter().zip(&found).zip(&allowed).map(off).collect();
            (all.iter().filter(|off| **off > 1.0).count(), all.iter().fold(0.0, |most: f64, off| off.max(most)))
        };
        let (count, most) = misses(1.0);
        println!("{model}: {} lobes, the largest error {most:.2} of what is allowed", cases.len());
        assert_eq!(count, 0, "{model}: off by up to {most} times what is allowed");
        let (wrong, _) = misses(0.98);
        assert!(wrong > cases.len() / 4, "{model}: only {wrong} see an error of a fiftieth");
    }
    // What is given for GGX is the integral of D(h) dh, and the device has that of D(h) h dh: the two meet in 64 bits, where both are known.
    let lights = of("ggx");
    let surfaces: Vec<(Vec<DVec3>, DVec3, f64)> =
        lights.iter().map(|(r, corners, view)| (corners.clone(), *view, given(r, "param"))).collect();
    let Some(means) = ggx::mean_of_polygons(&surfaces) else { return };
    let mut wrong = 0;
    for ((r, corners, view), (found, exact, allowed)) in lights.iter().zip(means) {
        let both = half_vector_integral(&Boundary::polygon(corners), DVec3::Z, *view, Microfacets::Ggx { alpha: given(r, "param") }, 64);
        assert!((both.whole - given(r, "value")).abs() < 1e-9, "{} in {r}", both.whole);
        assert!((both.mean - exact).length() < 1e-6 * exact.length() + 1e-12, "{exact} and {} in {r}", both.mean);
        let allowed = allowed + 4e-4 * exact.length();
        assert!((found - exact).length() < allowed, "{found} is not {exact} in {r}");
        wrong += usize::from((found - exact * 1.02).length() > allowed);
    }
    assert!(wrong > lights.len() / 4, "only {wrong} see an error of a fiftieth");
}
