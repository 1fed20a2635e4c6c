//! Numbers that could leave their range: light from moonlight to many suns, scenes of millimetres and of kilometres, pictures of many pixels. What is written out is in
//! the scene's own units, whatever factor the device works with.
#![allow(clippy::unwrap_used)]

use lobelia::{
    Session, Shot,
    graph::{Gpu, GpuOptions, GraphFile, PartData, PlanOptions, RunOptions},
    lobes::brdf::{Brdf, Distribution},
    measure::Image,
    scene::Scene,
};
use lobelia_tests::{has_gpu, root};
use std::{f64::consts::PI, path::Path};

/// A glTF file with its one buffer inside.
fn gltf(folder: &Path, name: &str, quads: &[([f64; 3], [f64; 3], [f64; 3])], material: &str, nodes: &str, extensions: &str) -> String {
    let mut bytes = Vec::new();
    for (corner, across, along) in quads {
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            bytes.extend((0..3).flat_map(|axis| ((corner[axis] + x * across[axis] + y * along[axis]) as f32).to_le_bytes()));
        }
    }
    let positions = bytes.len();
    let indices: Vec<u16> = (0..quads.len() as u16).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|corner| 4 * quad + corner)).collect();
    bytes.extend(indices.iter().flat_map(|index| index.to_le_bytes()));
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1,2]}}],
        "nodes":[{{"mesh":0}},{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
        "materials":[{material}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[-1e9,-1e9,-1e9],"max":[1e9,1e9,1e9]}},
        {{"bufferView":1,"componentType":5123,"count":{},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{positions}}},{{"buffer":0,"byteOffset":{positions},"byteLength":{}}}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{}"}}]{extensions}}}"#,
        4 * quads.len(),
        indices.len(),
        indices.len() * 2,
        bytes.len(),
        base64(&bytes),
    );
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().enumerate().fold(0u32, |word, (index, byte)| word | u32::from(*byte) << (16 - 8 * index));
        for digit in 0..4 {
            text.push(if digit <= chunk.len() { char::from(DIGITS[(word >> (18 - 6 * digit)) as usize & 63]) } else { '=' });
        }
    }
    text
}

/// A white floor of 4 m (times `size`), seen from straight above, with whatever lights it.
fn floor(folder: &Path, name: &str, size: f64, light: &str, extensions: &str) -> Scene {
    let quads = [([-2.0 * size, 0.0, 2.0 * size], [4.0 * size, 0.0, 0.0], [0.0, 0.0, -4.0 * size])];
    let material = r#"{"pbrMetallicRoughness":{"baseColorFactor":[0.8,0.8,0.8,1],"metallicFactor":0,"roughnessFactor":1}}"#;
    let half = 0.5_f64.sqrt();
    let nodes = format!(r#"{{"camera":0,"translation":[0,{},0],"rotation":[{},0,0,{half}]}},{light}"#, 3.0 * size, -half);
    let camera = format!(r#","cameras":[{{"type":"perspective","perspective":{{"yfov":0.2,"znear":{}}}}}]{extensions}"#, 0.01 * size);
    Scene::load(&gltf(folder, name, &quads, material, &nodes, &camera)).unwrap()
}

/// The floor under a sun that stands in the zenith, of an illuminance in lux.
fn under_sun(folder: &Path, lux: f64) -> Scene {
    let half = 0.5_f64.sqrt();
    let light = format!(r#"{{"rotation":[{},0,0,{half}],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}"#, -half);
    let lights = format!(
        r#","extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"directional","intensity":{lux}}}]}}}}"#
    );
    floor(folder, "sun.gltf", 1.0, &light, &lights)
}

/// The floor under a quad light, one metre square and two metres up, of a radiance.
fn under_quad(folder: &Path, radiance: f64) -> Scene {
    let half = 0.5_f64.sqrt();
    let light = format!(
        r#"{{"translation":[0,2,-1.5],"rotation":[{},0,0,{half}],"extras":{{"area_light":{{"shape":"quad","width":1,"height":1,"radiance":[{radiance},{radiance},{radiance}]}}}}}}"#,
        -half
    );
    floor(folder, "quad.gltf", 1.0, &light, "")
}

fn session(scene: &Scene) -> Session {
    Session::with(Gpu::new(&GpuOptions { adapter: None, baseline: true }).unwrap(), scene.clone(), 0.0).unwrap()
}

/// A radiance of a graph, and its display image, if it ends in one.
fn render(scene: &Scene, graph: &GraphFile, variants: &[String], set: &[&str], output: &str, shot: &Shot) -> (Image, Option<Vec<u8>>) {
    render_in(&mut session(scene), graph, variants, set, output, shot)
}

/// The same on a device that has the scene, and what it has built before.
fn render_in(
    session: &mut Session,
    graph: &GraphFile,
    variants: &[String],
    set: &[&str],
    output: &str,
    shot: &Shot,
) -> (Image, Option<Vec<u8>>) {
    let overrides: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    let wired = graph.wire(&lobelia::registry(), variants, &overrides).unwrap_or_else(|error| panic!("{error}"));
    let mut shot = shot.clone();
    shot.keep.push(output.into());
    let mut rendering = session.start(&wired, &shot).unwrap();
    let picture = rendering.run(&mut |_| true).unwrap();
    (rendering.radiance(output).unwrap(), picture.display)
}

fn text_graph(passes: &str, output: &str) -> GraphFile {
    GraphFile::parse(&format!(r#"(passes: {{"gbuffer": gbuffer(), {passes}}}, output: "{output}")"#), "units.ron").unwrap()
}

fn shipped(name: &str) -> GraphFile {
    GraphFile::load(&root().join("graphs").join(name)).unwrap()
}

fn shot(extent: [u32; 2]) -> Shot {
    Shot { extent, run: RunOptions { check: true, ..RunOptions::default() }, ..Shot::default() }
}

fn middle(image: &Image) -> f64 {
    f64::from(image.pixels[image.pixels.len() / 2][1])
}

const DIRECT: &str = r#""rsm": rsm(resolution: 64), "direct": direct(), "sum": compose(), "tonemap": tonemap(curve: none, from: {"radiance": "sum.radiance"})"#;

#[test]
fn a_floor_under_any_sun_has_the_radiance_that_it_must() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let up = glam::DVec3::Y;
    let factor = Brdf::new(glam::DVec3::splat(0.8), 0.0, 1.0, 1.0, Distribution::Ggx).evaluate(up, up, up).y;
    assert!((factor - 0.8 / PI).abs() < 0.02);
    for lux in [1e-6, 1e-3, 1.0, 1e3, 1e5, 683_000.0, 1e9] {
        let (image, display) =
            render(&under_sun(folder.path(), lux), &text_graph(DIRECT, "tonemap.image"), &[], &[], "sum.radiance", &shot([9, 9]));
        let found = middle(&image) / (factor * lux);
        assert!((found - 1.0).abs() < 1e-3, "{lux} lx: {found} of what is right");
        // Display colours are of the scene's own radiance as well.
        let shown = f64::from(display.unwrap()[4 * 40]) / 255.0;
        let expected = lobelia::lobes::tonemap::srgb_encode((factor * lux).min(1.0));
        assert!((shown - expected).abs() < 0.006, "{lux} lx is shown as {shown}, not {expected}");
    }
}

#[test]
fn light_of_any_strength_gives_the_same_picture_times_that_strength() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let indirect = text_graph(
        r#""rsm": rsm(resolution: 64), "density": flux_density(), "lights": vpl_lights(count: 64), "indirect": vpl_gather(clamp: none),
        "direct": direct(), "sum": compose(), "mean": progressive(from: {"radiance": "sum.radiance"})"#,
        "mean.radiance",
    );
    let area = text_graph(r#""area": area_light(), "emission": emission(), "sum": compose()"#, "sum.radiance");
    let room = |power: i32| {
        let mut scene = Scene::load("builtin:cornell-glossy").unwrap();
        for light in &mut scene.lights {
            light.intensity *= 2.0_f32.powi(power);
        }
        for material in &mut scene.materials {
            material.emissive *= 2.0_f32.powi(power);
        }
        scene
    };
    let lit = |power: i32| under_quad(folder.path(), 2.0 * f64::from(power).exp2());
    let several = |samples, frames| Shot { samples, frames, ..shot([16, 12]) };
    let (plain, _) = render(&room(0), &indirect, &[], &[], "mean.radiance", &several(2, 2));
    let (plain_area, _) = render(&lit(0), &area, &[], &[], "sum.radiance", &shot([16, 12]));
    let sum = |image: &Image| image.pixels.iter().flatten().sum::<f32>();
    assert!(sum(&plain) > 1.0 && sum(&plain_area) > 1.0, "{} {}", sum(&plain), sum(&plain_area));
    for power in [-40, -12, 3, 24, 60] {
        let scale = f64::from(power).exp2();
        let bright = room(power);
        assert!(power == 3 || bright.pre_exposure() != 1.0);
        let (image, _) = render(&bright, &indirect, &[], &[], "mean.radiance", &several(2, 2));
        let (area_image, _) = render(&lit(power), &area, &[], &[], "sum.radiance", &shot([16, 12]));
        for (plain, image) in [(&plain, &image), (&plain_area, &area_image)] {
            let most = plain.pixels.iter().flatten().fold(0.0_f32, |most, value| most.max(*value));
            for (was, is) in plain.pixels.iter().flatten().zip(image.pixels.iter().flatten()) {
                let (was, is) = (f64::from(*was), f64::from(*is) / scale);
                // A place of a half float more or less where darkness loses digits in one and not in the other.
                assert!((was - is).abs() <= 1e-3 * was + 1e-6 * f64::from(most), "2^{power}: {is} is not {was}");
            }
        }
    }
}

#[test]
fn flux_that_is_read_back_is_in_watts() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let graph = text_graph(
        r#""rsm": rsm(resolution: 32), "density": flux_density(), "moments": patch_moments(), "lights": vsgl_lights(count: 16)"#,
        "lights.lights",
    );
    let flux = |lux: f64| {
        let wired = graph.wire(&lobelia::registry(), &[], &[]).unwrap();
        let mut session = session(&under_sun(folder.path(), lux));
        let mut rendering = session.start(&wired, &Shot { keep: vec!["moments.moments".into()], ..shot([8, 8]) }).unwrap();
        rendering.run(&mut |_| true).unwrap();
        let words = |port: &str, stride: usize, words: std::ops::Range<usize>| {
            let parts = rendering.runner().read(rendering.gpu(), port).unwrap();
            let PartData::Buffer(bytes) = &parts[0].1 else { panic!("not a buffer") };
            let values = bytes.chunks_exact(4).map(|word| f32::from_le_bytes(word.try_into().unwrap()));
            values.enumerate().filter(|(index, _)| words.contains(&(index % stride))).map(|(_, value)| f64::from(value)).sum::<f64>()
        };
        (words("lights.lights", 16, 4..7), words("moments.moments", 16, 4..7), words("lights.lights", 16, 0..4))
    };
    let (plain, moments, places) = flux(1.0);
    // All of the floor's 16 m^2, in three channels.
    assert!((plain / 48.0 - 1.0).abs() < 0.1 && moments > 0.0, "{plain} W");
    let (bright, bright_moments, same_places) = flux(2.0_f64.powi(30));
    assert!((bright / plain / 2.0_f64.powi(30) - 1.0).abs() < 1e-5 && (bright_moments / moments / 2.0_f64.powi(30) - 1.0).abs() < 1e-5);
    assert_eq!(places, same_places, "positions are not in proportion to light");
}

#[test]
fn what_is_cut_off_is_counted() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // A lamp that is seen, so much brighter than what it lights that half floats cannot hold both.
    let mut scene = under_quad(folder.path(), 1.0);
    scene.materials.last_mut().unwrap().emissive *= 1e12;
    let camera = lobelia::scene::Camera::look_at(
        "lamp",
        glam::DVec3::new(0.0, 0.2, -1.4),
        glam::DVec3::new(0.0, 2.0, -1.5),
        glam::DVec3::Z,
        0.3,
        0.01,
    );
    scene.cameras.insert(0, camera.unwrap());
    let graph = text_graph(r#""emission": emission()"#, "emission.radiance");
    let wired = graph.wire(&lobelia::registry(), &[], &[]).unwrap();
    let saturated = |scene: &Scene| {
        let mut session = session(scene);
        let mut rendering = session.start(&wired, &shot([8, 8])).unwrap();
        rendering.run(&mut |_| true).unwrap();
        rendering.reports()[0].saturated.iter().map(|finding| finding.saturated).sum::<u64>()
    };
    assert_eq!(saturated(&scene), 3 * 64);
    scene.materials.last_mut().unwrap().emissive /= 1e12;
    assert_eq!(saturated(&scene), 0);
}

/// A floor with a wall, a camera and a lamp or a quad light: `size` times as large, and lit so that pictures are the same.
fn corner(folder: &Path, size: f64, area: bool) -> Scene {
    let scaled = |place: [f64; 3]| place.map(|value| value * size);
    let quads = [
        (scaled([-2.0, 0.0, 2.0]), scaled([4.0, 0.0, 0.0]), scaled([0.0, 0.0, -4.0])),
        (scaled([-2.0, 0.0, -1.0]), scaled([4.0, 0.0, 0.0]), scaled([0.0, 2.0, 0.0])),
        (scaled([0.3, 0.5, 0.5]), scaled([0.6, 0.0, 0.0]), scaled([0.0, 0.1, -0.6])),
    ];
    let material = r#"{"pbrMetallicRoughness":{"baseColorFactor":[0.8,0.5,0.4,1],"metallicFactor":0,"roughnessFactor":0.5}}"#;
    let [x, y, z] = scaled([0.0, 1.6, 4.0]);
    let camera = format!(r#"{{"camera":0,"translation":[{x},{y},{z}],"rotation":[-0.1337808,0,0,0.99101095]}}"#);
    let half = 0.5_f64.sqrt();
    let [x, y, z] = scaled([0.4, 1.7, 0.4]);
    let (light, extension) = if area {
        let light = format!(
            r#"{{"translation":[{x},{y},{z}],"rotation":[{},0,0,{half}],"extras":{{"area_light":{{"shape":"quad","width":{w},"height":{w},"radiance":[9,9,9]}}}}}}"#,
            -half,
            w = 0.5 * size
        );
        (light, String::new())
    } else {
        let light = format!(
            r#"{{"translation":[{x},{y},{z}],"rotation":[{},0,0,{half}],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}"#,
            -half
        );
        let extension = format!(
            r#","extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","intensity":{},"spot":{{"innerConeAngle":0.8,"outerConeAngle":1.1}}}}]}}}}"#,
            30.0 * size * size
        );
        (light, extension)
    };
    let camera_kind = format!(r#","cameras":[{{"type":"perspective","perspective":{{"yfov":0.7,"znear":{}}}}}]{extension}"#, 0.01 * size);
    Scene::load(&gltf(folder, "corner.gltf", &quads, material, &format!("{camera},{light}"), &camera_kind)).unwrap()
}

/// Relative difference of two pictures: of their means, and of the mean of absolute differences.
fn difference(image: &Image, truth: &Image) -> (f64, f64) {
    let sum = |image: &Image| image.pixels.iter().flatten().map(|value| f64::from(*value)).sum::<f64>();
    let apart: f64 = image.pixels.iter().flatten().zip(truth.pixels.iter().flatten()).map(|(a, b)| f64::from((a - b).abs())).sum();
    ((sum(image) / sum(truth) - 1.0).abs(), apart / sum(truth))
}

#[test]
fn a_scene_of_any_size_gives_the_same_picture() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let few = ["lights.count=64", "rsm.resolution=128"];
    for (name, set, output, area) in [
        ("direct.ron", &["rsm.resolution=128"] as &[&str], "sum.radiance", false),
        ("indirect.ron", &few, "indirect.radiance", false),
        ("area-lights.ron", &[], "area.radiance", true),
    ] {
        let graph = shipped(name);
        let mut variants: Vec<Vec<String>> = vec![Vec::new()];
        variants.extend(graph.variant_names().map(|variant| vec![variant.to_owned()]));
        let [mut metres, mut small, mut large] = [1.0, 1e-3, 1e3].map(|size| session(&corner(folder.path(), size, area)));
        for variant in &variants {
            // Two variants lack a pass that is made smaller here.
            let without = if variant == &["two-vsgl"] || variant == &["unshadowed"] { 1 } else { 0 };
            let set = &set[without..];
            let in_session = |session: &mut Session| render_in(session, &graph, variant, set, output, &shot([24, 14])).0;
            let truth = in_session(&mut metres);
            assert!(truth.pixels.iter().flatten().sum::<f32>() > 1.0, "{name} {variant:?}");
            for (session, size) in [(&mut small, "a thousandth of"), (&mut large, "a thousand times")] {
                let (mean, apart) = difference(&in_session(session), &truth);
                assert!(mean < 0.01 && apart < 0.02, "{name} {variant:?} at {size} the size: mean {mean}, pixels {apart}");
            }
        }
    }
}

#[test]
fn every_shipped_graph_is_planned_for_pictures_of_33_megapixels() {
    let room = Scene::load("builtin:cornell-glossy").unwrap().traits();
    let lights = Scene::load("builtin:area-lights").unwrap().traits();
    for entry in std::fs::read_dir(root().join("graphs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "ron") {
            continue;
        }
        let graph = GraphFile::load(&path).unwrap();
        let mut variants: Vec<Vec<String>> = vec![Vec::new()];
        variants.extend(graph.variant_names().map(|variant| vec![variant.to_owned()]));
        for variant in &variants {
            let wired = graph.wire(&lobelia::registry(), variant, &[]).unwrap();
            for traits in [&room, &lights] {
                if let Err(problems) = wired.plan(traits, &PlanOptions::new([7680, 4320])) {
                    // One bit for each light and pixel is more than is given for a thousand lights; how many there may be is said.
                    let text = format!("{problems:?}");
                    assert!(
                        !text.contains("MiB") || text.contains("lights seen from") && text.contains("use fewer lights (at most"),
                        "{}: {text}",
                        path.display()
                    );
                }
            }
        }
    }
}

/// A metal floor below a quad light of one metre, seen from a height above it.
fn grazed(folder: &Path, roughness: f64, height: f64, distance: f64) -> Scene {
    let quads = [([-8.0, 0.0, 4.0], [16.0, 0.0, 0.0], [0.0, 0.0, -16.0])];
    let material =
        format!(r#"{{"pbrMetallicRoughness":{{"baseColorFactor":[0.9,0.9,0.9,1],"metallicFactor":1,"roughnessFactor":{roughness}}}}}"#);
    let half = 0.5_f64.sqrt();
    let light = format!(
        r#"{{"translation":[0,2,0],"rotation":[{},0,0,{half}],"extras":{{"area_light":{{"shape":"quad","width":1.5,"height":1,"radiance":[5,4,3]}}}}}}"#,
        -half
    );
    let turn = -(height / distance).atan() / 2.0;
    let nodes = format!(r#"{{"camera":0,"translation":[0.2,{height},{distance}],"rotation":[{},0,0,{}]}},{light}"#, turn.sin(), turn.cos());
    let camera = r#","cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.01}}]"#;
    Scene::load(&gltf(folder, "grazed.gltf", &quads, &material, &nodes, camera)).unwrap()
}

#[test]
fn approximations_of_lobes_neither_glow_nor_go_out_at_grazing_views() {
    if !has_gpu() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let graph = shipped("area-lights.ron");
    for (roughness, height, distance) in
        [(0.1, 0.02, 3.0), (0.1, 0.3, 3.5), (0.25, 0.02, 2.0), (0.25, 1.0, 3.0), (0.4, 0.1, 3.0), (0.7, 0.02, 3.0)]
    {
        let mut session = session(&grazed(folder.path(), roughness, height, distance));
        let mut with = |variant: &str| {
            let variants = vec!["no-visibility".to_owned(), variant.to_owned()];
            render_in(&mut session, &graph, &variants, &[], "area.radiance", &shot([24, 14])).0
        };
        let exact = with("exact-boundary");
        let sum = |image: &Image| image.pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>();
        for (variant, least, most, most_of_pixel) in [
            ("lorentzian", 0.5, 2.0, 4.0),
            ("lorentzian-pearson", 0.5, 2.0, 4.0),
            ("ellipsoid", 0.5, 2.0, 4.0),
            ("owen", 0.5, 2.0, 4.0),
            ("ltc", 0.3, 1.5, 4.0),
            ("mrp", 0.02, 2.0, 8.0),
        ] {
            let image = with(variant);
            let mean = sum(&image) / sum(&exact);
            // Pixels that are darker than a hundredth of the mean tell little.
            let floor = 0.01 * sum(&exact) / exact.pixels.len() as f64;
            let ratios: Vec<f64> =
                image.pixels.iter().zip(&exact.pixels).map(|(found, exact)| f64::from(found[1]) / f64::from(exact[1]).max(floor)).collect();
            let brightest = ratios.iter().copied().fold(0.0, f64::max);
            let lit = exact.pixels.iter().map(|pixel| f64::from(pixel[1]) > 10.0 * floor);
            let darkest = ratios.iter().zip(lit).filter(|(_, lit)| *lit).map(|(ratio, _)| *ratio).fold(f64::INFINITY, f64::min);
            eprintln!("roughness {roughness}, height {height}: {variant} mean {mean:.3}, pixels {darkest:.3} to {brightest:.2}");
            assert!(
                mean > least && mean < most && brightest < most_of_pixel,
                "roughness {roughness}, height {height}: {variant} {mean}, pixels {darkest} to {brightest}"
            );
        }
    }
}
