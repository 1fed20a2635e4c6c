//! Errors of the quadrature along outlines: the tables of docs/area-lights. `cargo test -p lobelia-lobes --test area_light_tables -- --nocapture` prints them.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia_lobes::{
    anisotropic_ggx::alphas,
    area_light::{
        boundary::{Boundary, Ellipse},
        ggx_half_vector::{Fineness, ggx_half_vector_mean},
        half_vector::half_vector_integral,
        radial_primitive::Microfacets,
        round::sphere,
    },
    sampling::{hash, unit_float},
};

struct Numbers(u32);

impl Numbers {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 += 1;
        low + (high - low) * unit_float(hash(self.0))
    }

    fn vector(&mut self) -> DVec3 {
        // Near enough to a normal distribution.
        let mut component = || (0..6).map(|_| self.between(-1.0, 1.0)).sum::<f64>() / 2f64.sqrt();
        DVec3::new(component(), component(), component())
    }
}

/// A quad about the mirror direction, counter-clockwise as seen from the origin.
fn quad(numbers: &mut Numbers, mirror: DVec3) -> Boundary {
    let center = (mirror + numbers.vector() * 0.3).normalize() * numbers.between(0.5, 2.0);
    let a = numbers.vector().normalize();
    let b = a.cross(numbers.vector()).normalize();
    let (a, b) = (a * 10f64.powf(numbers.between(-1.2, 0.3)), b * 10f64.powf(numbers.between(-1.2, 0.3)));
    let mut corners = vec![center + a + b, center - a + b, center - a - b, center + a - b];
    if a.cross(b).dot(center) > 0.0 {
        corners.reverse();
    }
    Boundary::polygon(&corners)
}

/// Root mean square error over root mean square value, for GGX over 200 random quads.
fn error(alpha: f64, degrees: f64, nodes: usize) -> f64 {
    let angle = degrees.to_radians();
    let view = DVec3::new(angle.sin(), 0.0, angle.cos());
    let mut numbers = Numbers((1e6 * alpha) as u32 + degrees as u32 * 77_777);
    let (mut squares, mut values) = (0.0, 0.0);
    for _ in 0..200 {
        let light = quad(&mut numbers, DVec3::new(-view.x, 0.0, view.z));
        let of = |nodes| half_vector_integral(&light, DVec3::Z, view, Microfacets::Ggx { alpha }, nodes).whole;
        let exact = of(48);
        squares += (of(nodes) - exact).powi(2);
        values += exact * exact;
    }
    f64::sqrt(squares / values)
}

#[test]
fn nodes_of_the_half_vector_integral() {
    println!("| alpha, view | 2 nodes | 3 | 4 | 6 |\n| --- | --- | --- | --- | --- |");
    for alpha in [0.01, 0.05, 0.2, 0.4, 0.6] {
        for degrees in [0.0, 45.0, 70.0, 85.0] {
            let [two, three, four, six] = [2, 3, 4, 6].map(|nodes| error(alpha, degrees, nodes));
            println!("| {alpha}, {degrees} | {two:.1e} | {three:.1e} | {four:.1e} | {six:.1e} |");
            let steep = degrees > 80.0;
            assert!(two < if steep { 0.06 } else { 0.04 }, "two nodes: {two}");
            assert!(three < if steep { 0.02 } else { 0.005 }, "three nodes: {three}");
            assert!(four < if steep { 0.01 } else { 2e-3 }, "four nodes: {four}");
            assert!(six < if steep { 1e-3 } else { 1e-4 }, "six nodes: {six}");
        }
    }
}

/// Root mean square error of the mean half vector's part along the view, which is the reflected light before masking and Fresnel, over its root mean square: GGX over 200 random
/// lights and viewers of all azimuths.
fn error_ggx(alpha: f64, anisotropy: f64, degrees: f64, nodes: Fineness, light: fn(&mut Numbers, DVec3) -> Boundary) -> f64 {
    let mut numbers = Numbers((1e6 * alpha) as u32 + degrees as u32 * 77_777 + (1e3 * anisotropy) as u32);
    let (mut squares, mut values) = (0.0, 0.0);
    for _ in 0..200 {
        let (angle, azimuth) = (degrees.to_radians(), numbers.between(0.0, std::f64::consts::TAU));
        let view = DVec3::new(angle.sin() * azimuth.cos(), angle.sin() * azimuth.sin(), angle.cos());
        let light = light(&mut numbers, DVec3::new(-view.x, -view.y, view.z));
        let of = |nodes| ggx_half_vector_mean(&light, view, alphas(alpha, anisotropy), nodes).dot(view);
        let exact = of(Fineness { nodes: 40, arcs: 256 });
        squares += (of(nodes) - exact).powi(2);
        values += exact * exact;
    }
    f64::sqrt(squares / values)
}

#[test]
fn nodes_of_ggx_half_vectors() {
    println!("| alpha, anisotropy, view | 2 nodes | 3 | 4 | 6 |\n| --- | --- | --- | --- | --- |");
    for alpha in [1e-3, 0.01, 0.05, 0.2, 0.4, 0.8] {
        for anisotropy in [0.0, 0.5, 0.8, 0.95] {
            for degrees in [0.0, 45.0, 70.0, 85.0] {
                let of = |nodes| error_ggx(alpha, anisotropy, degrees, Fineness { nodes, arcs: 1 }, quad);
                let [two, three, four, six] = [2, 3, 4, 6].map(of);
                println!("| {alpha}, {anisotropy}, {degrees} | {two:.1e} | {three:.1e} | {four:.1e} | {six:.1e} |");
                let steep = degrees > 80.0;
                assert!(three < if steep { 0.03 } else { 7e-3 }, "three nodes: {three}");
                assert!(four < if steep { 6e-3 } else { 1.5e-3 }, "four nodes: {four}");
                assert!(six < if steep { 1e-3 } else { 1e-4 }, "six nodes: {six}");
            }
        }
    }
}

/// Spheres are circles, and arcs of circles are what they are; ellipses take more.
#[test]
fn arcs_of_rims() {
    println!("| alpha, view | sphere, 4 arcs | ellipse, 4 | 8 | 16 | 32 |\n| --- | --- | --- | --- | --- | --- |");
    for alpha in [0.01, 0.05, 0.2, 0.8] {
        for degrees in [0.0, 45.0, 70.0, 85.0] {
            let of = |arcs, light| error_ggx(alpha, 0.0, degrees, Fineness { nodes: 20, arcs }, light);
            let sphere = of(4, sphere_light);
            let [four, eight, sixteen, more] = [4, 8, 16, 32].map(|arcs| of(arcs, ellipse_light));
            println!("| {alpha}, {degrees} | {sphere:.1e} | {four:.1e} | {eight:.1e} | {sixteen:.1e} | {more:.1e} |");
            assert!(sphere < 1e-6, "a sphere: {sphere}");
            assert!(eight < 0.03 && sixteen < 5e-3 && more < 1e-3, "an ellipse: {eight}, {sixteen}, {more}");
        }
    }
}

/// An ellipse about the mirror direction, at most as large as half its distance.
fn ellipse_light(numbers: &mut Numbers, mirror: DVec3) -> Boundary {
    let center = (mirror + numbers.vector() * 0.3).normalize();
    let a = numbers.vector().normalize();
    let b = a.cross(numbers.vector()).normalize();
    let size = 10f64.powf(numbers.between(-1.2, -0.3));
    Boundary::ellipse(&Ellipse { center, axis_a: a * size, axis_b: b * size * numbers.between(0.3, 1.0) })
}

fn sphere_light(numbers: &mut Numbers, mirror: DVec3) -> Boundary {
    let center = (mirror + numbers.vector() * 0.3).normalize();
    sphere(center, 10f64.powf(numbers.between(-1.2, -0.1))).boundary().unwrap()
}
