//! Virtual spherical lights on input that no scene has, held against a quadrature in f64 and against virtual point lights.
#![allow(clippy::unwrap_used, missing_docs)]

#[allow(dead_code)]
#[path = "../virtual_lights/given.rs"]
mod given;

use given::{Given, PIXELS, Pixel, Random, light, pack_unit, plan, position, run, turn, unpack_unit, view};
use glam::{DVec3, Vec3};
use lobelia::{
    frame::VirtualLight,
    graph::{Gpu, testing::gpu},
    scene::{Ndf, Scene},
};
use lobelia_lobes::brdf::{Brdf, Distribution};
use std::f64::consts::TAU;

fn scene(ndf: Ndf) -> Scene {
    let mut scene = Scene::load("builtin:cornell-diffuse").unwrap();
    scene.ndf = ndf;
    scene
}

/// Pixels before the camera, lights around and among them that face away from it.
fn case(scene: &Scene, lights: u32, random: &mut Random) -> Given {
    let near = f64::from(view(scene).near);
    let pixels = (0..PIXELS)
        .map(|_| {
            let normal = (DVec3::Z + random.direction() * 0.8).normalize();
            let (color, specular) = random.material();
            let depth = (near / (3.0 + 2.0 * random.next())) as f32;
            Pixel { depth, core: [pack_unit(normal), color], specular, geometric_normal: pack_unit(normal) }
        })
        .collect();
    let lights = (0..lights)
        .map(|_| {
            let place = DVec3::new(2.0 * random.next() - 1.0, 2.0 * random.next() - 1.0, -2.5 * random.next());
            light(random, place, DVec3::NEG_Z)
        })
        .collect();
    Given { pixels, lights, visibility: Vec::new() }
}

fn render(gpu: &Gpu, scene: &Scene, given: &Given, gather: &str, seed: u32) -> Vec<DVec3> {
    let _turn = turn();
    let count = given.lights.len();
    let text = format!(
        r#"(passes: {{"surfaces": given_gbuffer(specular: true), "lights": given_lights(count: {count}), "indirect": {gather}}},
            output: "indirect.radiance")"#
    );
    let runner = run(gpu, &text, scene, given, &[], seed).unwrap();
    let image = runner.read_image(gpu, "indirect.radiance").unwrap().to_f32_rgba();
    image.into_iter().map(|[r, g, b, _]| DVec3::new(r.into(), g.into(), b.into())).collect()
}

fn brdf(scene: &Scene, color: u32, word: u32) -> Brdf {
    let root = DVec3::new(f64::from(color & 2047) / 2047.0, f64::from((color >> 11) & 2047) / 2047.0, f64::from(color >> 22) / 1023.0);
    let distribution = if scene.ndf == Ndf::Phong { Distribution::Phong } else { Distribution::Ggx };
    let (roughness, metallic) = (f64::from(word & 0xffff) / 65535.0, f64::from((word >> 16) & 255) / 255.0);
    Brdf::new(root * root, metallic, roughness, f64::from(word >> 24) / 255.0, distribution)
}

/// The integral over the cone, by the midpoint rule.
fn quadrature(scene: &Scene, given: &Given, index: usize, light: &VirtualLight, radius: f64) -> DVec3 {
    const STEPS: u32 = 400;
    let pixel = &given.pixels[index];
    let camera = view(scene);
    let at = position(&camera, index, pixel.depth);
    let (n_x, n_y) = (unpack_unit(pixel.core[0]), unpack_unit(light.core.x));
    let (f_x, f_y) = (brdf(scene, pixel.core[1], pixel.specular), brdf(scene, light.core.y, light.specular));
    let offset = light.position.as_dvec3() - at;
    let (v, s) = ((camera.position.as_dvec3() - at).normalize(), light.direction_to_source.as_dvec3());
    let axis = offset.normalize();
    let (a, b) = axis.any_orthonormal_pair();
    let hypotenuse = offset.length().hypot(radius);
    let versine = 1.0 - offset.length() / hypotenuse;
    let mut sum = DVec3::ZERO;
    for i in 0..STEPS * STEPS {
        let depth = versine * (f64::from(i % STEPS) + 0.5) / f64::from(STEPS);
        let (sine, cosine) = (TAU * (f64::from(i / STEPS) + 0.5) / f64::from(STEPS)).sin_cos();
        let across = (depth * (2.0 - depth)).sqrt();
        let w = axis * (1.0 - depth) + (a * cosine + b * sine) * across;
        let cosines = n_x.dot(w).max(0.0) * n_y.dot(-w).max(0.0);
        if cosines > 0.0 {
            sum += f_x.evaluate(n_x, w, v) * f_y.evaluate(n_y, s, -w) * cosines;
        }
    }
    let cone = TAU * versine / f64::from(STEPS * STEPS);
    sum * cone / (TAU / 2.0 * radius * radius) * light.flux.as_dvec3()
}

/// Squared residuals over the squared standard errors that the runs show, both summed over pixels: about 1 (7/5 for the few runs) when the estimator is
/// right. And the standard error of the sum relative to the sum.
fn score(runs: &[Vec<DVec3>], expected: &[(usize, f64)]) -> (f64, f64) {
    let count = runs.len() as f64;
    let (mut residuals, mut variances, mut sum) = (0.0, 0.0, 0.0);
    for (index, expected) in expected {
        let mean = runs.iter().map(|run| run[*index].y).sum::<f64>() / count;
        variances += runs.iter().map(|run| (run[*index].y - mean).powi(2)).sum::<f64>() / (count - 1.0) / count;
        residuals += (mean - expected).powi(2);
        sum += expected;
    }
    (residuals / variances, variances.sqrt() / sum)
}

#[test]
fn one_light_is_the_integral_over_its_cone() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(1);
    for (ndf, radius) in [(Ndf::Ggx, 0.3), (Ndf::Ggx, 3.0), (Ndf::Phong, 1.0)] {
        let scene = scene(ndf);
        let mut given = case(&scene, 1, &mut random);
        given.lights[0].position = Vec3::new(0.2, -0.1, -1.5);
        given.lights[0].radius = radius as f32;
        // Far above the smallest halves, whose steps would be larger than the noise.
        given.lights[0].flux *= 1e4;
        let runs: Vec<_> = (0..8).map(|seed| render(gpu, &scene, &given, "vsl_gather(samples: 64, radius: given)", seed)).collect();
        let expected = |radius: f64| -> Vec<(usize, f64)> {
            let value = |index| (index, quadrature(&scene, &given, index, &given.lights[0], radius).y);
            (0..PIXELS).step_by(15).map(value).collect()
        };
        let (ratio, error) = score(&runs, &expected(radius));
        let (wrong, _) = score(&runs, &expected(radius * 2.0));
        println!("{ndf} radius {radius}: {ratio:.2}, standard error {error:.1e}; with a wrong radius {wrong:.1}");
        assert!(error < 0.005, "{error}");
        assert!(ratio < 2.0, "{ratio}");
        assert!(wrong > 10.0, "a wrong radius is seen: {wrong}");
    }
}

fn worst(found: &[DVec3], expected: &[DVec3]) -> f64 {
    let error = |(a, b): (&DVec3, &DVec3)| ((*a - *b).abs() / (b.abs() + 1e-4)).max_element();
    found.iter().zip(expected).map(error).fold(0.0, f64::max)
}

#[test]
fn without_radius_it_is_a_point_light() {
    let Some(gpu) = gpu() else { return };
    let scene = scene(Ndf::Ggx);
    let given = case(&scene, 50, &mut Random(2));
    let points = render(gpu, &scene, &given, "vpl_gather(clamp: none)", 0);
    let none = render(gpu, &scene, &given, "vsl_gather(radius_scale: 0.0)", 0);
    assert!(worst(&none, &points) < 2e-3, "{}", worst(&none, &points));
    let some = render(gpu, &scene, &given, "vsl_gather()", 0);
    assert!(worst(&some, &points) > 0.1);
}

#[test]
fn radii_are_distances_to_the_kth_nearest_light_that_shines() {
    let Some(gpu) = gpu() else { return };
    let scene = scene(Ndf::Ggx);
    let mut given = case(&scene, 150, &mut Random(3));
    given.lights[7].flux = Vec3::ZERO;
    let nearest = render(gpu, &scene, &given, "vsl_gather(neighbours: 6)", 0);
    let with = |k: usize| {
        let mut radii = given.clone();
        for (index, light) in radii.lights.iter_mut().enumerate() {
            let others = given.lights.iter().enumerate().filter(|(other, light)| *other != index && light.flux != Vec3::ZERO);
            let mut distances: Vec<f32> = others.map(|(_, other)| other.position.distance(light.position)).collect();
            distances.sort_by(f32::total_cmp);
            light.radius = distances[k - 1];
        }
        render(gpu, &scene, &radii, "vsl_gather(radius: given)", 0)
    };
    assert!(worst(&nearest, &with(6)) < 2e-3, "{}", worst(&nearest, &with(6)));
    assert!(worst(&nearest, &with(5)) > 0.02, "one neighbour less is seen");
}

#[test]
fn equal_seeds_give_equal_pictures() {
    let Some(gpu) = gpu() else { return };
    let scene = scene(Ndf::Ggx);
    let given = case(&scene, 70, &mut Random(4));
    let first = render(gpu, &scene, &given, "vsl_gather()", 5);
    assert_eq!(first, render(gpu, &scene, &given, "vsl_gather()", 5));
    assert_ne!(first, render(gpu, &scene, &given, "vsl_gather()", 6));
}

#[test]
fn interleaving_keeps_the_mean() {
    let Some(gpu) = gpu() else { return };
    let scene = scene(Ndf::Ggx);
    let mut given = case(&scene, 256, &mut Random(5));
    let first = given.pixels[0];
    given
        .pixels
        .iter_mut()
        .for_each(|pixel| *pixel = Pixel { core: [pack_unit(DVec3::Z), first.core[1]], specular: first.specular | 0xffff, ..first });
    // Far, so that neighbours differ by their lights only.
    for light in &mut given.lights {
        light.position *= Vec3::new(300.0, 300.0, -300.0);
        light.flux *= 90_000.0;
    }
    let quarter = Given { lights: given.lights[..64].to_vec(), ..given.clone() };
    let mean = |image: &[DVec3]| image.iter().map(|pixel| pixel.y).sum::<f64>() / PIXELS as f64;
    let whole = mean(&render(gpu, &scene, &given, "vsl_gather()", 0));
    let parts = mean(&render(gpu, &scene, &given, "vsl_gather(interleave: 4)", 0));
    let other = mean(&render(gpu, &scene, &quarter, "vsl_gather(interleave: 4)", 0));
    println!("whole {whole}, interleaved {parts}, a quarter of the lights {other}");
    let same = |found: f64| (found / whole - 1.0).abs() < 0.02;
    assert!(whole > 0.0 && same(parts) && !same(other));
}

/// Any bits in the packed words, lights upon pixels and far away, of any radius and strength: the safety net in [`run`] finds nothing that must not be.
#[test]
fn extremes_stay_finite() {
    let Some(gpu) = gpu() else { return };
    let mut random = Random(6);
    for round in 0..12 {
        let scene = scene(if round % 2 == 0 { Ndf::Ggx } else { Ndf::Phong });
        let mut given = case(&scene, 64, &mut random);
        for pixel in &mut given.pixels {
            pixel.depth = [pixel.depth, 0.0, 1e-7, 1.0][(random.next() * 4.0) as usize];
            pixel.core = [random.word(), random.word()];
            pixel.specular = [0, random.word() & 0xffff, 0xffff][round % 3] | (random.word() & 0xffff_0000);
        }
        let camera = view(&scene);
        for (index, light) in given.lights.iter_mut().enumerate() {
            let pixel = (random.next() * PIXELS as f64) as usize;
            let on = position(&camera, pixel, given.pixels[pixel].depth.max(1e-7));
            let radius = [1e-12, 1e-3, 1.0, 1e12][index / 4 % 4];
            light.position = (on + random.direction() * radius * [0.0, 1e-3, 1.0, 1e4][index % 4]).as_vec3();
            light.radius = radius as f32;
            light.flux = Vec3::splat([1e24, 1e-30, 0.0, 1.0][index % 4]) * Vec3::new(1.0, 0.0, 0.5);
            light.core.x = random.word();
            light.core.y = random.word();
            light.specular = random.word();
            light.direction_to_source = random.direction().as_vec3();
        }
        let gather = format!("vsl_gather(samples: {}, radius: given, interleave: {})", [1, 3, 8][round % 3], [1, 4][round / 2 % 2]);
        let found = render(gpu, &scene, &given, &gather, round as u32);
        assert!(found.iter().all(|radiance| radiance.min_element() >= 0.0 && radiance.max_element() <= 65504.0));
    }
}

#[test]
fn what_cannot_be_read_is_refused() {
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let refused = |lights: u32, gather: &str| {
        let text = format!(
            r#"(passes: {{"surfaces": given_gbuffer(specular: true), "lights": given_lights(count: 1000),
                "visibility": given_visibility(lights: {lights}), "indirect": {gather}}}, output: "indirect.radiance")"#
        );
        plan(&text, &scene, &[]).err().map(|problems| problems.to_string())
    };
    assert_eq!(refused(1000, "vsl_gather()"), None);
    assert!(refused(999, "vsl_gather()").unwrap().contains("999 lights"));
    for wrong in ["samples: 0", "samples: 65", "neighbours: 0", "neighbours: 33", "interleave: 9", "radius: other", "radius_scale: -1.0"] {
        let name = wrong.split(':').next().unwrap();
        assert!(refused(1000, &format!("vsl_gather({wrong})")).unwrap().contains(name), "{wrong}");
    }
}
