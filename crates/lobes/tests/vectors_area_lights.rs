//! Integrals over area lights against reference values of 12 digits and more: the built-in file, or the one that `LOBELIA_AREA_LIGHT_VECTORS` names
//! (schema `area-lights/1`).
#![allow(clippy::unwrap_used)]

mod common;

use common::{
    area_lights::{polygon, records},
    given, triple, vector,
};
use lobelia_lobes::{
    area_light::{axial_moment::*, boundary::*, edge_models::*, half_vector::*, radial_primitive::*, round::*},
    cosine_lobe::*,
};
use serde_json::Value;

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

/// Every model against the exact moments. The bounds are the largest errors that the specification gives for its scenes and its grid of edges, times the number of
/// edges that a reference outline has near its lobe.
#[test]
fn vectors_moment_by_edge_models() {
    let models = [
        (EdgeModel::Owen { nodes: 2 }, 5e-4),
        (EdgeModel::Owen { nodes: 3 }, 5e-5),
        (EdgeModel::Owen { nodes: 6 }, 2e-5),
        (EdgeModel::Ellipsoid, 0.02),
        (EdgeModel::LorentzianPearson, 0.02),
        (EdgeModel::Lorentzian, 0.03),
    ];
    for (model, bound) in models {
        let (mut worst, mut squares, mut count) = (0f64, 0.0, 0.0);
        for r in records("moment") {
            let light = Boundary::polygon(&polygon(&r));
            let normal = r["clip_normal"].is_array().then(|| vector(&r, "clip_normal"));
            let (axis, n) = (vector(&r, "axis"), given(&r, "n"));
            let expected = lobe_fraction(given(&r, "M"), n);
            let error = (lobe_fraction_model(model, &light, normal, axis, n) - expected).abs();
            assert!(error <= bound, "{model:?}: off by {error:e} in {r}");
            worst = worst.max(error);
            squares += error * error;
            count += 1.0;
        }
        println!("{model:?}: largest {worst:.1e}, root mean square {:.1e}", f64::sqrt(squares / count));
    }
}

#[test]
fn vectors_phong_two_axis() {
    for r in records("phong_two_axis") {
        let light = Boundary::polygon(&polygon(&r));
        let (normal, view, n) = (vector(&r, "normal"), vector(&r, "view"), given(&r, "n"));
        let axis = (normal * (2.0 * normal.dot(view)) - view).normalize();
        let moment = two_axis_moment(&light, normal, axis, normal, n);
        equal(moment, given(&r, "value_M"), 1e-10, 10.0 / (n + 1.0), "moment about two axes", &r);
        equal(moment * (n + 2.0) / std::f64::consts::TAU, given(&r, "value"), 1e-10, 10.0, "two-axis lobe", &r);
    }
}

#[test]
fn vectors_lobe_product() {
    for r in records("lobe_product") {
        let first = CosineLobe { axis: vector(&r, "r1"), exponent: given(&r, "n1"), amplitude: given(&r, "mu1") };
        let second = CosineLobe { axis: vector(&r, "r2"), exponent: given(&r, "n2"), amplitude: given(&r, "mu2") };
        let product = cosine_lobe_product(&first, &second);
        equal(product.exponent, given(&r, "n_p"), 1e-10, 1.0, "exponent of the product", &r);
        equal(product.amplitude, given(&r, "mu_p"), 1e-9, 1e-5, "amplitude of the product", &r);
        assert!((product.axis - triple(&r["r_p"])).length() < 1e-12, "axis of the product in {r}");
    }
}
