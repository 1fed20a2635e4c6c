//! Integrals over area lights against reference values of 12 digits and more: the built-in file, or the one that `LOBELIA_AREA_LIGHT_VECTORS` names
//! (schema `area-lights/1`).
#![allow(clippy::unwrap_used)]

mod common;

use common::{given, triple, vector};
use glam::DVec3;
use lobelia_lobes::area_light::{axial_moment::*, boundary::*, half_vector::*, radial_primitive::*, round::*};
use serde_json::Value;

const BUILT_IN: &str = include_str!("data/area-lights.json");

/// The records under a key; a file without any fails the test.
fn records(key: &str) -> Vec<Value> {
    let text = match std::env::var("LOBELIA_AREA_LIGHT_VECTORS") {
        Ok(path) if !path.is_empty() => {
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("LOBELIA_AREA_LIGHT_VECTORS: {path}: {error}"))
        }
        _ => BUILT_IN.to_owned(),
    };
    let file: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("the file of reference values is no JSON: {error}"));
    assert_eq!(file["meta"]["schema"], "area-lights/1");
    let found = file[key].as_array().unwrap_or_else(|| panic!("the file of reference values has no list `{key}`"));
    assert!(!found.is_empty(), "`{key}` is empty");
    found.clone()
}

fn polygon(record: &Value) -> Vec<DVec3> {
    record["vertices"].as_array().unwrap().iter().map(triple).collect()
}

/// Relative to the value, or to a scale below which the reference itself has no digits.
fn equal(got: f64, want: f64, relative: f64, scale: f64, what: &str, record: &Value) {
    let error = (got - want).abs();
    assert!(error <= relative * want.abs() + 1e-15 * scale, "{what}: {got:e}, off by {error:e}, in {record}");
}

#[test]
fn vectors_edge_integrals() {
    for r in records("edge_EJ") {
        let (s, from, to, n) = (given(&r, "s"), given(&r, "phi0"), given(&r, "phi1"), given(&r, "n"));
        equal(edge_e(s, from, to, n), given(&r, "E"), 1e-12, 1.0, "E", &r);
        equal(edge_j(s, from, to, n), given(&r, "J"), 1e-11, 1.0, "J", &r);
    }
}

#[test]
fn vectors_edge_integrals_of_arvo() {
    for r in records("edge_F") {
        let (length, c, foot, n) = (given(&r, "Phi"), given(&r, "c"), given(&r, "delta"), given(&r, "n"));
        let odd = r["parity"] == "odd";
        let want = given(&r, "F");
        equal(arvo_integral(length, c, foot, n, odd), want, 1e-11, 1.0, "F", &r);
        if n.fract() == 0.0 && n <= 1e4 {
            equal(arvo_recurrence(length, c, foot, n as u32), want, 1e-11, 1.0, "recurrence", &r);
        }
    }
}

#[test]
fn vectors_moment() {
    for r in records("moment") {
        let light = Boundary::polygon(&polygon(&r));
        let normal = r["clip_normal"].is_array().then(|| vector(&r, "clip_normal"));
        let (axis, n) = (vector(&r, "axis"), given(&r, "n"));
        equal(axial_moment(&light, normal, axis, n), given(&r, "M"), 1e-11, 10.0 / (n + 1.0), "M", &r);
        equal(solid_angle(&light, normal), given(&r, "solid_angle"), 1e-11, 10.0, "solid angle", &r);
        if n.fract() == 0.0 && n <= 1e4 {
            equal(axial_moment_arvo(&light, normal, axis, n as u32), given(&r, "M"), 1e-10, 1e3 / (n + 1.0), "Arvo", &r);
        }
    }
}

#[test]
fn vectors_disk_and_sphere() {
    for r in records("disk") {
        let disk = Ellipse { center: triple(&r["center"]), axis_a: triple(&r["half_axis_a"]), axis_b: triple(&r["half_axis_b"]) };
        let (normal, axis, n) = (vector(&r, "normal"), vector(&r, "axis"), given(&r, "n"));
        let light = Boundary::ellipse(&disk);
        equal(axial_moment(&light, Some(normal), axis, n), given(&r, "M"), 1e-10, 1e3 / (n + 1.0), "M", &r);
        equal(solid_angle(&light, Some(normal)), given(&r, "solid_angle_above_normal"), 1e-10, 1e3, "solid angle", &r);
    }
    for r in records("sphere") {
        let light = sphere(triple(&r["center"]), given(&r, "radius")).boundary().unwrap();
        let (normal, axis, n) = (vector(&r, "normal"), vector(&r, "axis"), given(&r, "n"));
        equal(axial_moment(&light, Some(normal), axis, n), given(&r, "M"), 1e-10, 1e3 / (n + 1.0), "M", &r);
        equal(solid_angle(&light, Some(normal)), given(&r, "solid_angle_above_normal"), 1e-10, 1e3, "solid angle", &r);
    }
}

#[test]
fn vectors_microfacet_lobes() {
    for r in records("brdf") {
        let parameter = given(&r, "param");
        let microfacets = match r["model"].as_str().unwrap() {
            "blinn" => Microfacets::Blinn { n: parameter },
            "beckmann" => Microfacets::Beckmann { m: parameter },
            "ggx" => Microfacets::Ggx { alpha: parameter },
            other => panic!("model `{other}` in {r}"),
        };
        let light = Boundary::polygon(&polygon(&r));
        let (normal, view) = (vector(&r, "normal"), vector(&r, "view"));
        let found = half_vector_integral(&light, normal, view, microfacets, 64);
        equal(found.whole, given(&r, "value"), 1e-9, 1e3, "microfacet lobe", &r);
    }
}
