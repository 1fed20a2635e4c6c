//! Forms of virtual spherical Gaussian lights against quadrature over the disk: the table of docs/vsgl/shading.md.
//! `cargo test -p lobelia-lobes --test vsgl_accuracy -- --nocapture` prints it.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia_lobes::{
    brdf::{Brdf, Distribution},
    microfacet_lobe::{ndf_sharpness_ggx, ndf_sharpness_ggx_broad, reflection_lobe_sg},
    sampling::{hash, unit_float},
    vsgl::{GlossyLobe, SgLight, SgReceiver, vsgl_accurate, vsgl_fast, vsgl_gaussian, vsgl_printed},
};
use std::f64::consts::{PI, TAU};

struct Numbers(u32);

impl Numbers {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 += 1;
        low + (high - low) * unit_float(hash(self.0))
    }

    fn about(&mut self, axis: DVec3, least: f64) -> DVec3 {
        let (z, turn) = (self.between(least, 1.0), self.between(0.0, TAU));
        let (x, y) = axis.any_orthonormal_pair();
        (axis * z + (x * turn.cos() + y * turn.sin()) * (1.0 - z * z).sqrt()).normalize()
    }
}

fn surface(roughness: f64) -> Brdf {
    Brdf::new(DVec3::new(0.6, 0.5, 0.4), 0.5, roughness, 1.0, Distribution::Ggx)
}

/// A patch that is lit with flux 1 and reflects by its material, seen by a surface; and the radiance towards the viewer by quadrature over the patch.
fn pair(numbers: &mut Numbers, ratio: f64, light_roughness: f64, roughness: f64) -> (SgReceiver, SgLight, DVec3) {
    let towards = numbers.about(DVec3::Z, 0.2);
    let viewer = numbers.about(DVec3::Z, 0.2);
    let normal = numbers.about(-towards, 0.3);
    let to_source = numbers.about(normal, 0.3);
    let (own, lit) = (surface(roughness), surface(light_roughness));
    let (distance, radius) = (1.0, 1.0 / ratio);
    let position = towards * distance;
    let (x, y) = normal.any_orthonormal_pair();
    let mut truth = DVec3::ZERO;
    const RINGS: u32 = 48;
    const SPOKES: u32 = 96;
    for ring in 0..RINGS {
        for spoke in 0..SPOKES {
            let (r, turn) =
                (radius * ((f64::from(ring) + 0.5) / f64::from(RINGS)).sqrt(), TAU * (f64::from(spoke) + 0.5) / f64::from(SPOKES));
            let offset = position + x * (r * turn.cos()) + y * (r * turn.sin());
            let square = offset.length_squared();
            let w = offset / square.sqrt();
            let (cos_light, cos_own) = (-normal.dot(w), w.z);
            if cos_light > 0.0 && cos_own > 0.0 {
                truth += lit.evaluate(normal, to_source, -w) * own.evaluate(DVec3::Z, w, viewer) * (cos_light * cos_own / square);
            }
        }
    }
    truth /= f64::from(RINGS * SPOKES);
    let albedo = lit.specular_albedo(normal.dot(to_source));
    let sharpness = if lit.alpha > 0.5 { ndf_sharpness_ggx_broad(lit.alpha) } else { ndf_sharpness_ggx(lit.alpha) };
    let reflected = reflection_lobe_sg(sharpness, normal, to_source);
    let light = SgLight::of_lobes(
        position,
        radius,
        [lit.diffuse * PI, albedo],
        (normal, 0.0),
        (reflected.axis, reflected.sharpness),
        to_source,
        lit,
        sharpness,
    );
    let receiver = SgReceiver {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        diffuse: own.diffuse,
        lobe: GlossyLobe { normal: DVec3::Z, fixed_direction: viewer, brdf: own },
    };
    (receiver, light, truth)
}

type Form = fn(&SgReceiver, &SgLight) -> DVec3;

#[test]
fn forms_against_quadrature_over_the_disk() {
    let forms: [(&str, Form); 4] =
        [("fast", vsgl_fast), ("accurate", vsgl_accurate), ("gaussian", vsgl_gaussian), ("printed", vsgl_printed)];
    println!(
        "| roughness of light, surface | distance / radius | fast | accurate | gaussian | printed |\n| --- | --- | --- | --- | --- | --- |"
    );
    let mut totals = [[0.0; 4]; 2];
    for (light_roughness, roughness) in [(1.0, 1.0), (1.0, 0.3), (0.3, 1.0), (0.3, 0.3)] {
        for ratio in [0.5, 1.0, 2.0, 5.0, 20.0] {
            let mut numbers = Numbers((ratio * 1000.0) as u32 + (roughness * 77_777.0) as u32 + (light_roughness * 999.0) as u32);
            let (mut squares, mut values, mut sums, mut all) = ([0.0; 4], 0.0, [0.0; 4], 0.0);
            for _ in 0..120 {
                let (receiver, light, truth) = pair(&mut numbers, ratio, light_roughness, roughness);
                values += truth.length_squared();
                all += truth.element_sum();
                for (index, (_, form)) in forms.iter().enumerate() {
                    let found = form(&receiver, &light);
                    assert!(found.is_finite() && found.min_element() >= 0.0, "{found}");
                    squares[index] += (found - truth).length_squared();
                    sums[index] += found.element_sum();
                }
            }
            let cell = |index: usize| format!("{:.3} ({:+.2})", f64::sqrt(squares[index] / values), sums[index] / all - 1.0);
            println!("| {light_roughness}, {roughness} | {ratio} | {} | {} | {} | {} |", cell(0), cell(1), cell(2), cell(3));
            for index in 0..4 {
                totals[usize::from(ratio >= 2.0)][index] += f64::sqrt(squares[index] / values) / if ratio >= 2.0 { 12.0 } else { 8.0 };
            }
        }
    }
    println!("mean error near, far: {totals:?}");
    let [near, far] = totals;
    assert!(far[0] < 0.21 && far[1] < 0.21 && far[2] > 1.2 * far[0] && far[3] > 1.5 * far[0], "from two radii on: {far:?}");
    assert!(near[2] < 0.36 && near[0] < 0.46 && near[3] > near[0], "nearer: {near:?}");
}
