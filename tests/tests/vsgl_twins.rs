//! The shading of virtual spherical Gaussian lights on the device against its twin in `f64`.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use lobelia::{
    graph::testing::{evaluate, gpu},
    lobes::{
        brdf::{Brdf, Distribution},
        sampling::{hash, unit_float},
        vsgl::{GlossyLobe, SgLight, SgReceiver, light_reflectance, view_disk, vsgl_accurate, vsgl_fast, vsgl_gaussian, vsgl_printed},
    },
    shaders::Flags,
};

const WGSL: &str = "
#import lobelia::asg::AnisotropicSphericalGaussian
#import lobelia::brdf::{Brdf, phong_exponent}
#import lobelia::microfacet_lobe::{phong_lobe, reflection_lobe_asg}
#import lobelia::surface::Surface
#import lobelia::vsgl::{GlossyLobe, SgLight, SgReceiver, glossy_lobe, light_reflectance, sg_receiver, view_disk, vsgl_accurate, vsgl_fast, vsgl_gaussian, vsgl_printed}
struct Input { place: vec4f, normal: vec4f, axis: vec4f, half_vector: vec4f, source: vec4f, viewer: vec4f, numbers: vec4f }
struct Output { fast: vec4f, accurate: vec4f, gaussian: vec4f, printed: vec4f, view: vec4f, reflectance: vec4f }
fn evaluate(input: Input) -> Output {
    let own = Brdf(vec3f(0.2, 0.1, 0.05), vec3f(0.5, 0.4, 0.3), 1.0, input.numbers.x);
    var surface: Surface;
    surface.normal = vec3f(0.0, 0.0, 1.0);
    surface.geometric_normal = surface.normal;
    let receiver = sg_receiver(vec3f(0.0), surface, own, input.viewer.xyz);
    var light: SgLight;
    light.position = input.place.xyz;
    light.radius = input.place.w;
    light.diffuse = vec3f(0.3, 0.2, 0.1);
    light.normal = input.normal.xyz;
    light.spread = input.normal.w;
    light.axis = input.axis.xyz;
    light.sharpness = input.axis.w;
    light.specular = vec3f(2.0, 1.0, 0.5);
    light.flux = vec3f(1.0, 1.5, 0.7);
    light.widening = input.half_vector.w;
    light.lobe = glossy_lobe(input.half_vector.xyz, input.source.xyz, Brdf(vec3f(0.0), vec3f(0.6, 0.5, 0.4), 1.0, input.numbers.y));
#ifdef NDF_PHONG
    let ndf = phong_lobe(phong_exponent(input.numbers.y));
    light.sg_lobe = reflection_lobe_asg(ndf.sharpness, input.half_vector.xyz, input.source.xyz);
    light.sg_lobe.amplitude = ndf.amplitude;
#endif
    let view = view_disk(receiver, light);
    var reflectance = vec3f(0.0);
    if view.irradiance > 0.0 { reflectance = light_reflectance(light, view); }
    return Output(vec4f(vsgl_fast(receiver, light), 0.0), vec4f(vsgl_accurate(receiver, light), 0.0), vec4f(vsgl_gaussian(receiver, light), 0.0),
        vec4f(vsgl_printed(receiver, light), 0.0), vec4f(view.direction, view.irradiance), vec4f(reflectance, view.solid_angle));
}";

const COUNT: u32 = 60_000;

type Row = [[f32; 4]; 7];

type Form = fn(&SgReceiver, &SgLight) -> DVec3;

/// A light about the receiver: roughness 0.03 to 1 at both ends, radii from none to ten times the distance, distances from 1e-2 to 1e4, spread normals, every view.
fn case(index: u32, distribution: Distribution) -> (Row, SgReceiver, SgLight) {
    let mut count = 0;
    let mut number = |low: f64, high: f64| {
        count += 1;
        f64::from((low + (high - low) * unit_float(hash(index ^ hash(count)))) as f32)
    };
    let mut direction = |least: f64| {
        let (z, turn) = (number(least, 1.0), number(0.0, std::f64::consts::TAU));
        let s = (1.0 - z * z).sqrt();
        DVec3::new(s * turn.cos(), s * turn.sin(), z).normalize().as_vec3()
    };
    let (towards, viewer, turn, source) = (direction(0.03), direction(0.03), direction(0.05), direction(0.1));
    // The light looks back, more or less; its surface's lobe is about its own normal.
    let back = -towards.as_dvec3();
    let about = |v: Vec3| {
        let (x, y) = back.any_orthonormal_pair();
        (x * f64::from(v.x) + y * f64::from(v.y) + back * f64::from(v.z)).normalize().as_vec3()
    };
    let (normal, source) = (about(turn), about(source));
    let half = normal;
    let axis = (half * (2.0 * half.dot(source)) - source).normalize();
    let distance = 10f64.powf(number(-2.0, 4.0));
    let place = (towards.as_dvec3() * distance).as_vec3();
    let radius = if index.is_multiple_of(5) { 0.0 } else { (distance * 10f64.powf(number(-3.0, 1.0))) as f32 };
    let [own, lit] = [0, 1].map(|_| 10f64.powf(number(-1.5, 0.0)).powi(2).max(1e-3) as f32);
    let spread = if index.is_multiple_of(3) { 0.0 } else { number(0.0, 0.9) as f32 };
    let sharpness = 10f64.powf(number(0.0, 4.0)) as f32;
    let widening = if index.is_multiple_of(2) { 0.0 } else { number(0.0, 0.2) as f32 };
    let row = [
        place.extend(radius).to_array(),
        normal.extend(spread).to_array(),
        axis.extend(sharpness).to_array(),
        half.extend(widening).to_array(),
        source.extend(0.0).to_array(),
        viewer.extend(0.0).to_array(),
        [own, lit, 0.0, 0.0],
    ];
    let brdf = |diffuse: DVec3, reflectance_normal: DVec3, alpha: f32| Brdf {
        diffuse,
        reflectance_normal,
        reflectance_grazing: 1.0,
        alpha: alpha.into(),
        distribution,
    };
    let seen = |v: DVec3| v.as_vec3().as_dvec3();
    let (diffuse, reflectance) = (seen(DVec3::new(0.2, 0.1, 0.05)), seen(DVec3::new(0.5, 0.4, 0.3)));
    let receiver = SgReceiver {
        position: DVec3::ZERO,
        normal: DVec3::Z,
        diffuse,
        lobe: GlossyLobe { normal: DVec3::Z, fixed_direction: viewer.as_dvec3(), brdf: brdf(diffuse, reflectance, own) },
    };
    let light = SgLight {
        position: place.as_dvec3(),
        radius: radius.into(),
        diffuse: seen(DVec3::new(0.3, 0.2, 0.1)),
        spread: spread.into(),
        normal: normal.as_dvec3(),
        sharpness: sharpness.into(),
        specular: seen(DVec3::new(2.0, 1.0, 0.5)),
        axis: axis.as_dvec3(),
        flux: seen(DVec3::new(1.0, 1.5, 0.7)),
        widening: widening.into(),
        lobe: GlossyLobe {
            normal: half.as_dvec3(),
            fixed_direction: source.as_dvec3(),
            brdf: brdf(DVec3::ZERO, seen(DVec3::new(0.6, 0.5, 0.4)), lit),
        },
    };
    (row, receiver, light)
}

/// Share of rows that are off by more than `relative` of their size, and the relative error that one in a thousand exceeds. Any NaN, infinity or negative value is a failure.
fn disagreement(found: &[[f32; 4]], twins: &[DVec3], relative: f64) -> (f64, f64) {
    let mut errors: Vec<f64> = found
        .iter()
        .zip(twins)
        .map(|(found, twin)| {
            let found = DVec3::new(found[0].into(), found[1].into(), found[2].into());
            assert!(found.is_finite() && found.min_element() >= 0.0, "{found} for {twin}");
            // Below this nothing of it is stored.
            let scale = twin.abs().max_element().max(1e-12);
            let error = (found - *twin).abs().max_element() / scale;
            if error.is_nan() { f64::INFINITY } else { error }
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let over = errors.iter().filter(|error| **error > relative).count();
    (over as f64 / errors.len() as f64, errors[errors.len() * 999 / 1000])
}

#[test]
fn shading_agrees_with_its_twin() {
    let Some(gpu) = gpu() else { return };
    for distribution in [Distribution::Ggx, Distribution::Phong] {
        let cases: Vec<(Row, SgReceiver, SgLight)> = (0..COUNT).map(|index| case(index, distribution)).collect();
        let rows: Vec<Row> = cases.iter().map(|case| case.0).collect();
        let flags = Flags::new().with("SPECULAR", true).with("NDF_PHONG", distribution == Distribution::Phong);
        let found: Vec<[[f32; 4]; 6]> = evaluate(gpu, WGSL, &flags, &rows).unwrap();
        let column = |index: usize| -> Vec<[f32; 4]> { found.iter().map(|row| row[index]).collect() };
        let twins = |form: Form| -> Vec<DVec3> { cases.iter().map(|(_, receiver, light)| form(receiver, light)).collect() };
        let reflectance = |receiver: &SgReceiver, light: &SgLight| {
            let view = view_disk(receiver, light);
            if view.irradiance > 0.0 { light_reflectance(light, &view) } else { DVec3::ZERO }
        };
        let irradiance = |receiver: &SgReceiver, light: &SgLight| DVec3::splat(view_disk(receiver, light).irradiance);
        let forms: [(&str, usize, Form); 6] = [
            ("fast", 0, vsgl_fast),
            ("accurate", 1, vsgl_accurate),
            ("gaussian", 2, vsgl_gaussian),
            ("printed", 3, vsgl_printed),
            ("reflectance", 5, reflectance),
            ("irradiance", 4, irradiance),
        ];
        for (name, index, form) in forms {
            let mut seen = column(index);
            if name == "irradiance" {
                seen.iter_mut().for_each(|row| *row = [row[3]; 4]);
            }
            let wanted = twins(form);
            let (over, tail) = disagreement(&seen, &wanted, 1e-3);
            let lit = wanted.iter().filter(|value| value.max_element() > 1e-9).count();
            assert!(lit > cases.len() / 4, "{distribution:?} {name}: only {lit} rows are lit");
            assert!(
                over == 0.0 && tail < 3e-5,
                "{distribution:?} {name}: {over:.1e} of the rows are off by more than 1e-3; one in a thousand by {tail:.1e}"
            );
            // What the comparison must reject: a receiver that is 1 % rougher, or for what knows no receiver a light that is 1 % larger.
            let nudged = cases.iter().map(|(_, receiver, light)| {
                let (mut receiver, mut light) = (*receiver, *light);
                receiver.lobe.brdf.alpha *= 1.01;
                light.radius *= 1.01;
                light.lobe.brdf.alpha *= 1.01;
                form(&receiver, &light)
            });
            let wrong = disagreement(&seen, &nudged.collect::<Vec<DVec3>>(), 1e-3);
            assert!(wrong.0 > 0.1, "{distribution:?} {name}: only {} of the rows see a rougher surface and a larger light", wrong.0);
        }
    }
}
