//! What texels send to given pixels, in f64.

use crate::{
    given::{EXTENT, Given, Random, pack_unit, position, run, turn, unpack_unit, view},
    maps::{Map, both, pixels, weights},
};
use glam::DVec3;
use lobelia::{
    graph::{Gpu, testing::gpu},
    scene::{Ndf, Scene},
};
use lobelia_lobes::{
    brdf::{Brdf, Distribution},
    sampling::r2_point,
};
use std::f64::consts::PI;

const SIDE: usize = 16;
const SAMPLES: u32 = 96;
const SUBSET: u32 = 70;
const PATCHES: f64 = 500.0;
const SHARE: f64 = 0.2;

fn brdf(scene: &Scene, color: u32, word: u32) -> Brdf {
    let root = DVec3::new(f64::from(color & 2047) / 2047.0, f64::from((color >> 11) & 2047) / 2047.0, f64::from(color >> 22) / 1023.0);
    let [roughness, metallic, specular] =
        [f64::from(word & 0xffff) / 65535.0, f64::from((word >> 16) & 255) / 255.0, f64::from(word >> 24) / 255.0];
    let distribution = if scene.ndf == Ndf::Phong { Distribution::Phong } else { Distribution::Ggx };
    Brdf::new(root * root, metallic, roughness, specular, distribution)
}

fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Mean luminance that a texel sends to the view samples of its workgroup, over the samples that see something. `None` where rounding decides a side.
fn contribution(scene: &Scene, given: &Given, map: &Map, index: usize, flux_weights: &[f64], seed: u32) -> Option<f64> {
    let camera = view(scene);
    let normal = unpack_unit(map.core[2 * index]);
    let at_texel = brdf(scene, map.core[2 * index + 1], map.specular[index]);
    let (face, x, y) = map.place(index);
    let (stride, face_number) = (SIDE / 8, index / (SIDE * SIDE));
    let group = (face_number * stride + y % stride) * stride + x % stride;
    let place = map.position(index, normal);
    let to_source = (face.position.as_dvec3() - place).normalize();
    let slant = normal.dot(to_source);
    if slant < 1e-3 {
        return None;
    }
    let patch_share = PATCHES * flux_weights[index] / flux_weights.iter().sum::<f64>();
    let radius_squared = map.footprint(index).powi(2) / (PI * slant.max(0.1) * patch_share.clamp(1.0 / 4096.0, 1.0));
    let flux = map.flux(scene, index);
    let (mut sum, mut seen) = (0.0, 0);
    for number in 0..SUBSET {
        let point = r2_point((group as u32 * SUBSET % SAMPLES + number) % SAMPLES, seed);
        let pixel_index = (point[0] * f64::from(EXTENT[0])) as usize + (point[1] * f64::from(EXTENT[1])) as usize * EXTENT[0] as usize;
        let pixel = &given.pixels[pixel_index];
        if pixel.depth == 0.0 {
            continue;
        }
        seen += 1;
        let (seen_at, pixel_normal) = (position(&camera, pixel_index, pixel.depth), unpack_unit(pixel.core[0]));
        let offset = place - seen_at;
        let direction = offset.normalize();
        let cosines = pixel_normal.dot(direction).max(0.0) * (-normal.dot(direction)).max(0.0);
        let reflected = brdf(scene, pixel.core[1], pixel.specular).evaluate(
            pixel_normal,
            direction,
            (camera.position.as_dvec3() - seen_at).normalize(),
        );
        let sent = at_texel.evaluate(normal, to_source, -direction);
        sum += luminance(flux * sent * reflected) * cosines / offset.length_squared().max(radius_squared);
    }
    Some(sum / f64::from(seen))
}

/// Largest error of weights, relative to the larger of the weight and a thousandth of the flux's.
fn worst(gpu: &Gpu, ndf: Ndf, strength: f64) -> f64 {
    let _turn = turn();
    let mut scene = Scene::load("builtin:spheres").unwrap();
    scene.ndf = ndf;
    let given = pixels(&scene, 2.0, &mut Random(5));
    let text = format!(
        r#"(passes: {{
            "surfaces": given_gbuffer(specular: true),
            "rsm": rsm(resolution: {SIDE}),
            "flux": flux_density(),
            "density": brsm(lights: point, importance: mean, cells: {SIDE}, samples: {SAMPLES}, subset: {SUBSET}, patches: {PATCHES}, flux_share: {SHARE}, blur: false, seed: 3),
        }}, output: "density.density")"#
    );
    let seed = 8;
    let runner = run(gpu, &text, &scene, &given, &["rsm.rsm", "flux.density"], seed).unwrap();
    let map = Map::read(&runner, gpu, SIDE);
    let (found, flux) = (weights(&runner, gpu, "density.density"), weights(&runner, gpu, "flux.density"));
    scene.lights[1].intensity *= strength as f32;
    let reflecting = || (0..flux.len()).filter(|index| flux[*index] > 0.0);
    let contributions: Vec<Option<f64>> = (0..flux.len())
        .map(|index| if flux[index] > 0.0 { contribution(&scene, &given, &map, index, &flux, seed + 3) } else { Some(0.0) })
        .collect();
    let clear = reflecting().filter(|index| contributions[*index].is_some()).count();
    assert!(reflecting().count() > 300 && clear * 100 > 98 * reflecting().count(), "{clear} of {}", reflecting().count());
    assert!(reflecting().filter(|index| contributions[*index].is_some_and(|value| value > 0.0)).count() > 100);
    let mean = contributions.iter().flatten().sum::<f64>() / flux.iter().sum::<f64>();
    let error = |index: usize| {
        let value = contributions[index]?;
        let expected = (1.0 - SHARE) * value / mean + SHARE * flux[index];
        Some((found[index] - expected).abs() / expected)
    };
    reflecting().filter_map(error).fold(0.0, f64::max)
}

#[test]
fn weights_are_those_of_the_formula() {
    let Some(gpu) = gpu() else { return };
    for ndf in [Ndf::Ggx, Ndf::Phong] {
        let error = worst(gpu, ndf, 1.0);
        println!("{ndf}: largest relative error {error:.1e}");
        assert!(error < 2e-3, "{ndf}: {error}");
    }
    // The comparison sees one lamp of two shining a twentieth brighter.
    assert!(worst(gpu, Ndf::Ggx, 1.05) > 1e-2);
}

/// Differences between the weights of both forms, and between those of points and of flux, as shares of all.
fn forms_apart(gpu: &Gpu, scene: &Scene, distance: f64, side: u32) -> (f64, f64) {
    let given = pixels(scene, distance, &mut Random(6));
    let parameters = format!("cells: {side}, patches: 65536, subset: 512, flux_share: 0.001, blur: false");
    let form = |lights: &str| both(gpu, scene, &given, side, &format!("lights: {lights}, importance: mean, {parameters}"), 0);
    let ((gaussian, flux), (point, _)) = (form("gaussian"), form("point"));
    let total: f64 = flux.iter().sum();
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / total;
    (apart(&gaussian, &point), apart(&point, &flux))
}

/// Far from the patches a disk is a point: both forms weigh diffuse surfaces alike.
#[test]
fn distant_disks_are_points() {
    let Some(gpu) = gpu() else { return };
    let scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let ((far, from_flux), (near, _)) = (forms_apart(gpu, &scene, 4.0, 128), forms_apart(gpu, &scene, 0.5, 16));
    println!("difference {far:.1e} from afar, {near:.1e} from near by; from flux {from_flux:.1e}");
    assert!(far < 0.01 && from_flux > 0.1, "{far}, {from_flux}");
    assert!(near > 3.0 * far, "{near}");
}

/// Lobes of SGs are approximations of glossy ones, and good ones for steering.
#[test]
fn glossy_lobes_are_alike() {
    let Some(gpu) = gpu() else { return };
    for ndf in [Ndf::Ggx, Ndf::Phong] {
        let mut scene = Scene::load("builtin:spheres").unwrap();
        scene.ndf = ndf;
        scene.materials.iter_mut().for_each(|material| material.roughness = material.roughness.max(0.4));
        let (apart, from_flux) = forms_apart(gpu, &scene, 2.0, 64);
        println!("{ndf}: difference {apart:.2}; from flux {from_flux:.2}");
        assert!(apart < 0.3 * from_flux, "{ndf}: {apart}, {from_flux}");
    }
}

/// Seen from the left and from the right: which side is darker moves the mean, and hardly what is relative to the brightness of pixels.
#[test]
fn relative_importance_forgives_dark_pixels() {
    let Some(gpu) = gpu() else { return };
    let scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let mut random = Random(9);
    let mut given = |left: f64, right: f64| {
        let mut given = pixels(&scene, 1.5, &mut random);
        for (index, pixel) in given.pixels.iter_mut().enumerate() {
            let (side, albedo) = if index as u32 % EXTENT[0] < EXTENT[0] / 2 { (1.0, left) } else { (-1.0, right) };
            let root = (f64::sqrt(albedo) * 1023.0).round() as u32;
            pixel.core = [pack_unit(DVec3::new(side, 0.0, 1.0).normalize()), (2 * root) | (2 * root) << 11 | root << 22];
            pixel.depth = if pixel.depth > 0.0 { view(&scene).near / 2.0 } else { 0.0 };
        }
        given
    };
    let (even, uneven) = (given(0.5, 0.5), given(0.5, 0.05));
    let moved = |importance: &str| {
        let weigh = |given: &Given| both(gpu, &scene, given, 32, &format!("importance: {importance}, flux_share: 0.001"), 0).0;
        let (first, second) = (weigh(&even), weigh(&uneven));
        first.iter().zip(&second).map(|(a, b)| (a - b).abs()).sum::<f64>() / first.iter().sum::<f64>()
    };
    let (mean, relative) = (moved("mean"), moved("relative"));
    println!("a darker side moves {mean:.3} of the mean, {relative:.3} of the relative weights");
    assert!(mean > 0.1 && relative < 0.5 * mean, "{mean}, {relative}");
}
