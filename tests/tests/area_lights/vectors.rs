//! The device against reference values: those that `crates/lobes` is tested with, or the file that `LOBELIA_AREA_LIGHT_VECTORS` names (schema `area-lights/1`).

use super::{cosine_lobes, ggx, half_vectors};
use glam::{DMat3, DVec3};
use lobelia::{
    lobes::area_light::{
        axial_moment::lobe_fraction, boundary::Boundary, half_vector::half_vector_integral, radial_primitive::Microfacets,
    },
    shaders::Flags,
};
use serde_json::Value;

const BUILT_IN: &str = include_str!("../../../crates/lobes/tests/data/area-lights.json");

fn records(key: &str) -> Vec<Value> {
    let text = match std::env::var("LOBELIA_AREA_LIGHT_VECTORS") {
        Ok(path) if !path.is_empty() => {
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("LOBELIA_AREA_LIGHT_VECTORS: {path}: {error}"))
        }
        _ => BUILT_IN.to_owned(),
    };
    let file: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("the file of reference values is no JSON: {error}"));
    let found = file[key].as_array().unwrap_or_else(|| panic!("the file of reference values has no list `{key}`"));
    assert!(!found.is_empty(), "`{key}` is empty");
    found.clone()
}

fn vector(value: &Value) -> DVec3 {
    let part = |index: usize| value[index].as_f64().unwrap_or_else(|| panic!("{value} is no vector"));
    DVec3::new(part(0), part(1), part(2))
}

fn number(record: &Value, key: &str) -> f64 {
    record[key].as_f64().unwrap_or_else(|| panic!("`{key}` is no number in {record}"))
}

fn corners(record: &Value) -> Vec<DVec3> {
    record["vertices"].as_array().unwrap_or_else(|| panic!("no vertices in {record}")).iter().map(vector).collect()
}

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
            let outline = corners(r);
            // Where nothing is cut off, the whole light is above the plane that it faces.
            let normal = if r["clip_normal"].is_array() { vector(&r["clip_normal"]) } else { Boundary::polygon(&outline).facing };
            let axis = vector(&r["axis"]).normalize();
            let turn = frame(normal.normalize_or(DVec3::Z), axis);
            let outline: Vec<DVec3> = outline.iter().map(|corner| turn * *corner).collect();
            cosine_lobes::Case::new(&outline, turn * axis, number(r, "n"))
        })
        .collect();
    let Some(found) = cosine_lobes::on_device(&cases, &[]) else { return };
    // Owen's function with three nodes is off by 3.9e-5 at most, for an edge; what 32 bits add is in `allowed`.
    let expected: Vec<f64> = list.iter().map(|r| lobe_fraction(number(r, "M"), number(r, "n"))).collect();
    let place = |case: &cosine_lobes::Case| cases.iter().position(|other| std::ptr::eq(other, case)).unwrap();
    let values = || found.iter().map(|found| f64::from(found[0]));
    let (worst, count) = cosine_lobes::misses(&cases, values(), |case| expected[place(case)], 8e-5);
    println!("{} moments, the largest error {worst:.2} of what is allowed", cases.len());
    assert_eq!(count, 0, "off by up to {worst} times what is allowed");
    let (_, wrong) = cosine_lobes::misses(&cases, values(), |case| 0.99 * expected[place(case)], 8e-5);
    assert!(wrong > cases.len() / 4, "only {wrong} see an error of a hundredth");
}

#[test]
fn vectors_phong_two_axis_on_the_device() {
    let list = records("phong_two_axis");
    let cases: Vec<cosine_lobes::Case> = list
        .iter()
        .map(|r| {
            let (normal, view) = (vector(&r["normal"]).normalize(), vector(&r["view"]).normalize());
            let turn = frame(normal, view);
            let outline: Vec<DVec3> = corners(r).iter().map(|corner| turn * *corner).collect();
            let seen = turn * view;
            cosine_lobes::Case::new(&outline, DVec3::new(-seen.x, -seen.y, seen.z), number(r, "n"))
        })
        .collect();
    let Some(found) = cosine_lobes::on_device(&cases, &[]) else { return };
    let place = |case: &cosine_lobes::Case| cases.iter().position(|other| std::ptr::eq(other, case)).unwrap();
    let values = || found.iter().map(|found| f64::from(found[1]));
    let (worst, count) = cosine_lobes::misses(&cases, values(), |case| number(&list[place(case)], "value"), 8e-5);
    println!("{} lobes about two axes, the largest error {worst:.2} of what is allowed", cases.len());
    assert_eq!(count, 0, "off by up to {worst} times what is allowed");
    let (_, wrong) = cosine_lobes::misses(&cases, values(), |case| 0.99 * number(&list[place(case)], "value"), 8e-5);
    assert!(wrong > cases.len() / 4, "only {wrong} see an error of a hundredth");
}

#[test]
fn vectors_microfacet_lobes_on_the_device() {
    let list = records("brdf");
    let of = |model: &str| -> Vec<(&Value, Vec<DVec3>, DVec3)> {
        let turned = |r: &'_ Value| {
            let (normal, view) = (vector(&r["normal"]).normalize(), vector(&r["view"]).normalize());
            let turn = frame(normal, view);
            (corners(r).iter().map(|corner| turn * *corner).collect(), turn * view)
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
            lights.iter().map(|(r, corners, view)| half_vectors::Case::new(corners, *view, alpha(number(r, "param")))).collect();
        let Some(found) = half_vectors::on_device(&cases, &flags) else { return };
        let misses = |factor: f64| {
            let off = |((r, _, _), (case, (sum, _))): (&(&Value, Vec<DVec3>, DVec3), (&half_vectors::Case, &_))| {
                let sum: &lobelia::lobes::area_light::half_vector::HalfVectorIntegral = sum;
                let expected = factor * number(r, "value");
                // What 32 bits add to the error of six nodes, which is 1e-3 at the most up to 85 degrees, and a few times that beyond.
                let six = half_vector_integral(&case.light, DVec3::Z, case.view, half_vectors::microfacets(case.alpha, flag), 6).whole;
                let nodes = (six - number(r, "value")).abs();
                let most = if case.view.z > 0.08 { 1.2e-3 } else { 5e-3 };
                assert!(nodes < most * number(r, "value") + 1e-6, "six nodes: {six} in {r}");
                let off = (sum.whole - expected).abs() / (half_vectors::allowed(case, 2e-6) + nodes);
                if off.is_nan() { f64::INFINITY } else { off }
            };
            let all: Vec<f64> = lights.iter().zip(cases.iter().zip(&found)).map(off).collect();
            (all.iter().filter(|off| **off > 1.0).count(), all.iter().fold(0.0, |most, off| off.max(most)))
        };
        println!("{model}: {} lobes, the largest error {:.2} of what is allowed", cases.len(), misses(1.0).1);
        assert_eq!(misses(1.0).0, 0, "{model}: off by up to {} times what is allowed", misses(1.0).1);
        assert!(misses(0.98).0 > cases.len() / 4, "{model}: only {} see an error of a fiftieth", misses(0.98).0);
    }
    // What is given for GGX is the integral of D(h) dh, and the device has that of D(h) h dh: the two meet in 64 bits, where both are known.
    let lights = of("ggx");
    let surfaces: Vec<(Vec<DVec3>, DVec3, f64)> =
        lights.iter().map(|(r, corners, view)| (corners.clone(), *view, number(r, "param"))).collect();
    let Some(means) = ggx::mean_of_polygons(&surfaces) else { return };
    for ((r, corners, view), (found, exact, allowed)) in lights.iter().zip(means) {
        let both = half_vector_integral(&Boundary::polygon(corners), DVec3::Z, *view, Microfacets::Ggx { alpha: number(r, "param") }, 64);
        assert!((both.whole - number(r, "value")).abs() < 1e-9, "{} in {r}", both.whole);
        assert!((both.mean - exact).length() < 1e-6 * exact.length() + 1e-12, "{exact} and {} in {r}", both.mean);
        assert!((found - exact).length() < allowed + 4e-4 * exact.length(), "{found} is not {exact} in {r}");
    }
}
