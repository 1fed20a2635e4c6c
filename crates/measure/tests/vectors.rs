//! Against values that another program computed: the pairs of `reference/metrics/metrics.json`, one of them copied here.
#![allow(clippy::unwrap_used)]

use lobelia_measure::{
    Image,
    flip::{Exposures, PIXELS_PER_DEGREE, flip_hdr, flip_ldr},
    mean, read_exr, relative_mse, relative_mse_with_epsilon, rmse,
};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Relative difference that summing in another order and rounding to 32 bits can make, with room.
const TOLERANCE: f64 = 1e-5;

/// The folder of large optional material, or a word that the test is skipped.
fn reference() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("LOBELIA_SHARED").map_or_else(beside, PathBuf::from).join("reference");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: reference images are not here (set LOBELIA_SHARED)");
    None
}

/// An EXR file as it is; an 8-bit PNG file as sRGB-encoded values in [0, 1].
fn read(path: &Path) -> Image {
    if path.extension().unwrap() == "exr" {
        return read_exr(path).unwrap();
    }
    let picture = image::open(path).unwrap().to_rgb8();
    let pixels = picture.pixels().map(|pixel| pixel.0.map(|value| f32::from(value) / 255.0)).collect();
    Image { width: picture.width() as usize, height: picture.height() as usize, pixels }
}

#[track_caller]
fn assert_close(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < TOLERANCE, "found {found}, expected {expected}");
}

#[test]
fn a_pair_measured_elsewhere() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let [reference, test] = ["reference", "test"].map(|part| read(&data.join(format!("cornell-glossy-main_ldr_{part}.png"))));
    assert_close(rmse(&reference, &test).unwrap(), 0.09965944033189);
    assert_close(relative_mse_with_epsilon(&reference, &test, 0.01).unwrap(), 0.10979679903505575);
    // Exchanged, the relative error is another one: which image is the reference matters.
    let exchanged = relative_mse_with_epsilon(&test, &reference, 0.01).unwrap();
    assert!((exchanged / 0.10979679903505575 - 1.0).abs() > 0.1, "{exchanged}");
    let brighter = Image { pixels: test.pixels.iter().map(|pixel| pixel.map(|value| value * 1.01)).collect(), ..test };
    let off = rmse(&reference, &brighter).unwrap();
    assert!((off / 0.09965944033189 - 1.0).abs() > 10.0 * TOLERANCE, "one percent of brightness is seen: {off}");
}

#[test]
fn every_pair_measured_elsewhere() {
    let Some(folder) = reference() else { return };
    let list: Value = serde_json::from_slice(&std::fs::read(folder.join("metrics/metrics.json")).unwrap()).unwrap();
    let vectors = list["vectors"].as_array().unwrap();
    assert!(vectors.len() >= 4);
    for vector in vectors {
        let [reference, test] = ["reference", "test"].map(|part| read(&folder.join(vector[part].as_str().unwrap())));
        assert_close(rmse(&reference, &test).unwrap(), vector["rmse"].as_f64().unwrap());
        let relative = relative_mse_with_epsilon(&reference, &test, 0.01).unwrap();
        assert_close(relative, vector["relmse_eps_0.01"].as_f64().unwrap());
        // The floor that follows the brightness of the reference is another one.
        let floor = (0.1 * mean(&reference).iter().sum::<f64>() / 3.0).powi(2);
        assert_close(relative_mse(&reference, &test).unwrap(), relative_mse_with_epsilon(&reference, &test, floor).unwrap());
        assert!((relative_mse(&reference, &test).unwrap() / relative - 1.0).abs() > 0.1);
    }
}

/// The renderer averaged before it rounded to half floats. A pixel is off by 2^-11 of its value at most, and so is the mean; the bound is nearly
/// reached, because a lamp in the picture is one value that is rounded the same way in thousands of pixels. Below 6.1e-5 half floats are 6e-8 apart.
fn agrees(found: &[f64], stated: &[f64]) -> bool {
    found.len() == stated.len() && found.iter().zip(stated).all(|(found, stated)| (found - stated).abs() <= stated / 2048.0 + 3e-8)
}

/// Channel order and half floats: the means of the images are those that the renderer stated.
#[test]
fn images_have_the_means_that_their_renderer_stated() {
    let Some(folder) = reference() else { return };
    let mut images = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "json") {
            continue;
        }
        let setup: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let name = setup["name"].as_str().unwrap();
        for part in ["direct", "indirect1", "full"] {
            let found = mean(&read_exr(&folder.join(format!("{name}_{part}.exr"))).unwrap());
            let stated = setup["statistics"][part]["mean"].as_array().unwrap();
            let stated: Vec<f64> = stated.iter().map(|value| value.as_f64().unwrap()).collect();
            assert!(agrees(&found, &stated), "{name} {part}: found {found:?}, stated {stated:?}");
            assert!(!agrees(&[found[2], found[1], found[0]], &stated), "{name} {part}: red and blue exchanged must be seen");
            assert!(!agrees(&found.map(|value| value * 1.001), &stated), "{name} {part}: a thousandth must be seen");
            images += 1;
        }
    }
    assert!(images >= 9, "{images}");
}

#[test]
fn flip_of_a_pair_measured_elsewhere() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let [reference, test] = ["reference", "test"].map(|part| read(&data.join(format!("cornell-glossy-main_ldr_{part}.png"))));
    let found = flip_ldr(&reference, &test, PIXELS_PER_DEGREE).unwrap();
    assert!((found.mean - 0.37509721517562866).abs() < 1e-5, "{}", found.mean);
    // Seen from half the distance it is another number.
    assert!((flip_ldr(&reference, &test, 0.5 * PIXELS_PER_DEGREE).unwrap().mean - found.mean).abs() > 1e-3);
}

/// FLIP of every pair, HDR with its exposures, and every pixel of its maps.
#[test]
fn flip_maps_measured_elsewhere() {
    let Some(folder) = reference() else { return };
    let list: Value = serde_json::from_slice(&std::fs::read(folder.join("metrics/metrics.json")).unwrap()).unwrap();
    for vector in list["vectors"].as_array().unwrap() {
        let [reference, test] = ["reference", "test"].map(|part| read(&folder.join(vector[part].as_str().unwrap())));
        let parameters = &vector["parameters"];
        let found = if vector["kind"] == "HDR" {
            let exposures = Exposures::of(&reference);
            assert!((exposures.start - parameters["startExposure"].as_f64().unwrap()).abs() < 1e-4, "{exposures:?}");
            assert!((exposures.stop - parameters["stopExposure"].as_f64().unwrap()).abs() < 1e-3, "{exposures:?}");
            assert_eq!(exposures.count as u64, parameters["numExposures"].as_u64().unwrap());
            flip_hdr(&reference, &test, PIXELS_PER_DEGREE).unwrap()
        } else {
            flip_ldr(&reference, &test, PIXELS_PER_DEGREE).unwrap()
        };
        let expected = vector["flip_mean"].as_f64().unwrap();
        let map = exr::prelude::read_all_flat_layers_from_file(folder.join(vector["map"].as_str().unwrap())).unwrap();
        let values: Vec<f32> = map.layer_data[0].channel_data.list[0].sample_data.values_as_f32().collect();
        let worst = values.iter().zip(&found.map).map(|(want, got)| (want - got).abs()).fold(0.0, f32::max);
        println!(
            "{} {}: mean {} against {expected}, largest difference of a pixel {worst:.1e}",
            vector["kind"], vector["reference"], found.mean
        );
        assert!((found.mean - expected).abs() < 1e-5 && worst < 1e-4, "{vector}: {} {worst}", found.mean);
    }
}
