//! Virtual point lights against the truth: convergence on the glossy box, and flux, cosines and Jacobians on the diffuse one.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia::{
    Shot,
    measure::{Image, Mask, compare, mean, read_exr},
    scene::{LightKind, Ndf, Scene, Triangle},
};
use lobelia_tests::{Render, has_gpu, shared};

fn gathered(scene: &str, side: u32, samples: u32, count: u32, seed: u32) -> Image {
    let lights = format!("lights.count={count}");
    let shot = Shot { extent: [side, side], samples, seed, ..Shot::default() };
    let set = ["indirect.clamp=none", lights.as_str(), "rsm.resolution=512"];
    let render = Render { graph: "indirect.ron", scene, variants: &["exact-visibility"], set: &set, ndf: Ndf::Ggx, shot };
    render.radiance("indirect.radiance").unwrap()
}

/// Blocks of k x k pixels whose pixels are alike: no edge runs through them, so a few samples give their mean.
fn even_blocks(reference: &Image, k: usize) -> Mask {
    let (width, height) = (reference.width / k, reference.height / k);
    let block = |x: usize, y: usize| {
        let values: Vec<f32> =
            (0..k * k).map(|index| reference.pixels[(y * k + index / k) * reference.width + x * k + index % k][1]).collect();
        let (low, high) = values.iter().fold((f32::MAX, 0.0f32), |(low, high), value| (low.min(*value), high.max(*value)));
        high < 1.15 * low
    };
    Mask { counts: (0..width * height).map(|index| block(index % width, index / width)).collect() }
}

/// Relative MSE without the worst twentieth of the blocks: near creases the `1/d^2` of single lights dominates, whose variance is infinite, so that the
/// plain mean of so few lights says more about luck than about N.
fn trimmed(reference: &Image, test: &Image, mask: &Mask) -> f64 {
    let alone = |index: usize| Mask { counts: (0..reference.pixels.len()).map(|other| other == index).collect() };
    let counted = (0..reference.pixels.len()).filter(|index| mask.counts[*index]);
    let mut errors: Vec<f64> = counted.map(|index| compare(reference, test, &alone(index)).unwrap().relative_mse).collect();
    errors.sort_by(f64::total_cmp);
    let kept = &errors[..errors.len() * 19 / 20];
    kept.iter().sum::<f64>() / kept.len() as f64
}

/// On blocks of 4 x 4 pixels, so that a test takes seconds. Each sample has its own lights; the average of S samples of N lights has S N of them.
#[test]
fn error_falls_as_one_over_the_number_of_lights() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    let full = read_exr(&shared.join("reference/cornell-glossy-main_indirect1.exr")).unwrap();
    let (reference, mask) = (full.downsampled(4).unwrap(), even_blocks(&full, 4));
    assert!(mask.share() > 0.3, "{}", mask.share());
    let mut errors = Vec::new();
    for count in [256, 1024, 4096] {
        // Sub-pixel positions and lights differ by seed; the mean over seeds tells the trend from luck.
        let of_seed = |seed: u32| trimmed(&reference, &gathered("builtin:cornell-glossy", 60, 4, count, seed), &mask);
        let error = (of_seed(1) + of_seed(2)) / 2.0;
        println!("4 x {count} lights: relative MSE {error:.6} over {:.0} % of the blocks", 100.0 * mask.share());
        errors.push(error);
    }
    // A factor of 4 each if it were 1/N exactly; low-discrepancy points do better.
    assert!(errors[1] < errors[0] / 3.0 && errors[2] < errors[1] / 3.0, "{errors:?}");
    assert!(errors[2] < 1e-4, "{errors:?}");
}

/// The same mean radiance in another seed, and not with the visibility missing.
#[test]
fn mean_of_the_glossy_box() {
    if !has_gpu() {
        return;
    }
    let Some(shared) = shared() else { return };
    let reference = mean(&read_exr(&shared.join("reference/cornell-glossy-main_indirect1.exr")).unwrap());
    let found = mean(&gathered("builtin:cornell-glossy", 60, 4, 2048, 3));
    for channel in 0..3 {
        let ratio = found[channel] / reference[channel];
        assert!((ratio - 1.0).abs() < 0.02, "channel {channel}: {ratio}");
    }
}

/// One bounce on Lambertian surfaces by brute force in f64: from the point that a pixel sees, a cosine-distributed direction, the surface that it
/// meets, the light there with a shadow ray. Shares nothing with virtual lights but the triangles.
fn brute_force_mean(scene: &Scene, side: u32, paths: u32) -> DVec3 {
    let triangles = scene.triangles();
    let origin = scene.origin();
    let camera = scene.camera(None).unwrap();
    let light = &scene.lights[0];
    let LightKind::Spot { inner, outer } = light.kind else { panic!("the box has a spot light") };
    let light_position = light.position - origin;
    let mut state = 0x2545_f491_4f6c_dd1du64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let tangent = (camera.yfov / 2.0).tan();
    let mut total = DVec3::ZERO;
    for y in 0..side {
        for x in 0..side {
            for _ in 0..paths {
                let ndc =
                    [(f64::from(x) + random()) / f64::from(side) * 2.0 - 1.0, 1.0 - (f64::from(y) + random()) / f64::from(side) * 2.0];
                let view = (camera.forward + camera.right * (ndc[0] * tangent) + camera.up * (ndc[1] * tangent)).normalize();
                let Some(first) = nearest(&triangles, camera.position - origin, view) else { continue };
                let (radius, angle) = (random().sqrt(), random() * std::f64::consts::TAU);
                let (t, b) = first.normal.any_orthonormal_pair();
                let direction =
                    t * (radius * angle.cos()) + b * (radius * angle.sin()) + first.normal * (1.0 - radius * radius).max(0.0).sqrt();
                let Some(second) = nearest(&triangles, first.position + first.normal * 1e-9, direction) else { continue };
                let to_light = light_position - second.position;
                let (distance, l) = (to_light.length(), to_light.normalize());
                let cosine = second.normal.dot(l);
                if cosine <= 0.0
                    || nearest(&triangles, second.position + second.normal * 1e-9, l).is_some_and(|hit| hit.distance < distance)
                {
                    continue;
                }
                let ramp = (-l).dot(light.direction) - f64::from(outer).cos();
                let falloff = (ramp / (f64::from(inner).cos() - f64::from(outer).cos())).clamp(0.0, 1.0).powi(2);
                let albedo = |hit: &Hit| scene.materials[hit.material].base_color.as_dvec3();
                let irradiance = light.intensity.as_dvec3() * falloff * cosine / (distance * distance);
                // Cosine-distributed directions cancel pi and the cosine at the first surface.
                total += albedo(&first) * albedo(&second) * irradiance / std::f64::consts::PI;
            }
        }
    }
    total / f64::from(side * side * paths)
}

struct Hit {
    distance: f64,
    position: DVec3,
    normal: DVec3,
    material: usize,
}

fn nearest(triangles: &[Triangle], origin: DVec3, direction: DVec3) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for triangle in triangles {
        let [a, b, c] = triangle.positions.map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let slope = normal.dot(direction);
        if slope == 0.0 {
            continue;
        }
        let distance = normal.dot(a - origin) / slope;
        let position = origin + direction * distance;
        let inside = [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (*to - *from).cross(position - *from).dot(normal) >= 0.0);
        if distance > 1e-9 && inside && best.as_ref().is_none_or(|hit| distance < hit.distance) {
            best = Some(Hit { distance, position, normal: normal * -slope.signum(), material: triangle.material });
        }
    }
    best
}

/// [`brute_force_mean`] of the diffuse box with 6000 paths per pixel of 60 x 60; its standard error is about 0.1 %.
const DIFFUSE_BOX_MEAN: DVec3 = DVec3::new(0.046_622, 0.024_572, 0.012_271);

#[test]
fn the_diffuse_box_has_the_right_mean() {
    if !has_gpu() {
        return;
    }
    let scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let short = brute_force_mean(&scene, 60, 300);
    let found = mean(&gathered("builtin:cornell-diffuse", 60, 8, 4096, 1));
    println!("brute force {short}, long run {DIFFUSE_BOX_MEAN}; virtual lights {found:?}");
    for channel in 0..3 {
        let truth = DIFFUSE_BOX_MEAN[channel];
        assert!((short[channel] / truth - 1.0).abs() < 0.02, "channel {channel}: the long run was of another scene");
        assert!((found[channel] / truth - 1.0).abs() < 0.01, "channel {channel}: {}", found[channel] / truth);
    }
    // And without shadows it is far from right, so the figure means something.
    let shot = Shot { extent: [60, 60], ..Shot::default() };
    let render = Render {
        graph: "indirect.ron",
        scene: "builtin:cornell-diffuse",
        variants: &["no-visibility"],
        set: &["indirect.clamp=none"],
        ndf: Ndf::Ggx,
        shot,
    };
    let open = mean(&render.radiance("indirect.radiance").unwrap());
    assert!(open[0] / DIFFUSE_BOX_MEAN[0] > 1.05, "{open:?}");
}
