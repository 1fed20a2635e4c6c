//! Shadows and one bounce of indirect light where the map of a light is hard to fit, against the path tracer: under domes and on grounds far larger than what
//! is seen, behind thin walls, and of many lights.
#![allow(clippy::unwrap_used)]

mod rooms;

use glam::DVec3;
use lobelia::{
    Session, Shot,
    graph::{Gpu, GpuOptions, GraphFile},
    measure::Image,
    reference::{LightPaths, Render, Settings},
    scene::{Camera, LightKind, PunctualLight, Scene},
};
use lobelia_tests::{has_gpu, root};
use rooms::{SPOT, Solid, light, scene};

const SIZE: [u32; 2] = [64, 36];

/// Radiance of a pass of a graph of `graphs/`.
fn rendered(scene: &Scene, graph: &str, variants: &[&str], set: &[&str], radiance: &str, samples: u32) -> Image {
    let graph = GraphFile::load(&root().join("graphs").join(graph)).unwrap();
    let variants: Vec<String> = variants.iter().map(|variant| (*variant).to_owned()).collect();
    let overrides: Vec<_> = set.iter().map(|text| text.parse().unwrap()).collect();
    let wired = graph.wire(&lobelia::registry(), &variants, &overrides).unwrap();
    let gpu = Gpu::new(&GpuOptions { adapter: None, baseline: true }).unwrap();
    let mut session = Session::with(gpu, scene.clone(), 0.0).unwrap();
    let shot = Shot { extent: SIZE, samples, keep: vec![radiance.to_owned()], ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).unwrap();
    rendering.run(&mut |_| true).unwrap();
    rendering.radiance(radiance).unwrap()
}

fn direct(scene: &Scene, set: &[&str]) -> Image {
    rendered(scene, "direct.ron", &[], set, "direct.radiance", 16)
}

fn indirect(scene: &Scene, set: &[&str]) -> Image {
    let set: Vec<&str> = ["indirect.clamp=none", "lights.count=1024"].iter().chain(set).copied().collect();
    rendered(scene, "indirect.ron", &["exact-visibility"], &set, "indirect.radiance", 4)
}

fn truth(scene: &Scene, paths: LightPaths, samples: u64) -> Image {
    let camera = scene.camera(None).unwrap();
    let mut render = Render::new(scene, &camera, Settings { size: SIZE, paths, samples, seed: 1 }).unwrap();
    while render.done() < render.passes() {
        render.step();
    }
    Image { width: SIZE[0] as usize, height: SIZE[1] as usize, pixels: render.picture().pixels }
}

fn values(image: &Image) -> impl Iterator<Item = f64> + '_ {
    image.pixels.iter().map(|pixel| pixel.iter().map(|value| f64::from(*value)).sum::<f64>() / 3.0)
}

fn mean(image: &Image) -> f64 {
    values(image).sum::<f64>() / image.pixels.len() as f64
}

/// Mean absolute difference over the mean of the truth.
fn difference(found: &Image, truth: &Image) -> f64 {
    values(found).zip(values(truth)).map(|(found, truth)| (found - truth).abs()).sum::<f64>() / truth.pixels.len() as f64 / mean(truth)
}

fn camera() -> Camera {
    Camera::look_at("main", DVec3::new(0.0, 1.6, 4.0), DVec3::new(0.0, 0.5, 0.0), DVec3::Y, 0.7, 0.01).unwrap()
}

fn lamps() -> [(&'static str, PunctualLight); 3] {
    [
        ("spot", light(SPOT, DVec3::new(1.5, 3.0, 2.0), DVec3::new(0.0, 0.3, 0.0), 30.0)),
        ("point", light(LightKind::Point, DVec3::new(1.5, 2.0, 1.0), DVec3::ZERO, 10.0)),
        ("sun", light(LightKind::Directional, DVec3::new(0.6, 1.0, 0.4), DVec3::ZERO, 5.0)),
    ]
}

fn box_on_floor() -> Solid {
    let mut solid = Solid::default();
    solid.ground(2.0, 0.0);
    solid.cuboid(DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 1.0, 0.5));
    solid
}

/// The lamp over a box on a floor, with a ground or a dome of that size around.
fn surrounded(lamp: &PunctualLight, size: f64, dome: bool) -> Scene {
    let mut around = Solid::default();
    if dome {
        around.dome(size);
    } else {
        around.ground(size, -0.02);
    }
    scene(vec![box_on_floor(), around], vec![lamp.clone()], camera())
}

#[test]
fn direct_light_under_domes_and_on_grounds_of_any_size() {
    if !has_gpu() {
        return;
    }
    for (name, lamp) in lamps() {
        for (size, dome) in [(10.0, false), (1e3, false), (1e5, false), (1e3, true), (1e5, true)] {
            // No sun shines into a closed dome.
            if dome && lamp.kind == LightKind::Directional {
                continue;
            }
            let scene = surrounded(&lamp, size, dome);
            let (found, reference) = (direct(&scene, &[]), truth(&scene, LightPaths::Direct, 32));
            let (ratio, difference) = (mean(&found) / mean(&reference), difference(&found, &reference));
            println!(
                "{name}, {} of {size} m: mean {ratio:.4} of the truth, difference {difference:.4}",
                if dome { "dome" } else { "ground" }
            );
            assert!((ratio - 1.0).abs() < 3e-3 && difference < 0.01, "{name} {size} {dome}: {ratio}, {difference}");
        }
    }
}

/// One bounce too: the store of virtual lights holds what lights the picture, and all of it.
#[test]
fn indirect_light_under_domes_and_on_grounds_of_any_size() {
    if !has_gpu() {
        return;
    }
    let [spot, _, sun] = lamps().map(|(_, lamp)| lamp);
    // Few of the sun's virtual lights are near the box, so their noise is the larger.
    for (lamp, size, dome, most) in [(&spot, 5e3, true, 0.03), (&spot, 1e5, true, 0.03), (&spot, 1e5, false, 0.03), (&sun, 1e3, false, 0.2)]
    {
        let scene = surrounded(lamp, size, dome);
        let (found, reference) = (mean(&indirect(&scene, &[])), mean(&truth(&scene, LightPaths::OneBounce, 128)));
        println!("{size} m: {:.4} of the truth", found / reference);
        assert!((found / reference - 1.0).abs() < most, "{size} m, dome {dome}: {found} for {reference}");
    }
}

/// A room of that size with walls of that thickness, closed all round. Walls abut, so that their outer sides end where others begin.
fn room(size: f64, wall: f64) -> Solid {
    let half = size / 2.0;
    let mut solid = Solid::default();
    let (low, high) = (-wall, half + wall);
    let slab = |solid: &mut Solid, least: [f64; 3], greatest: [f64; 3]| solid.cuboid(DVec3::from(least), DVec3::from(greatest));
    slab(&mut solid, [-half, -wall, -half], [half, 0.0, half]);
    slab(&mut solid, [-half, half, -half], [half, high, half]);
    slab(&mut solid, [-half - wall, low, -half], [-half, high, half]);
    slab(&mut solid, [half, low, -half], [half + wall, high, half]);
    slab(&mut solid, [-half - wall, low, -half - wall], [half + wall, high, -half]);
    slab(&mut solid, [-half - wall, low, half], [half + wall, high, half + wall]);
    solid
}

#[test]
fn thin_walls_keep_the_light_out() {
    if !has_gpu() {
        return;
    }
    let mut failed = Vec::new();
    for (size, walls) in [(0.4, &[1e-3][..]), (4.0, &[1e-3, 3e-3, 1e-2])] {
        for &wall in walls {
            let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) * (size / 4.0);
            let lamps = [
                light(LightKind::Spot { inner: 0.3, outer: 0.7 }, at(3.0, 6.0, 2.0), at(0.0, 1.0, 0.0), 500.0),
                light(LightKind::Point, at(2.6, 3.1, 2.3), at(0.0, 1.0, 0.0), 100.0),
                light(LightKind::Directional, at(3.0, 5.0, 2.0), at(0.0, 0.0, 0.0), 5.0),
            ];
            let camera = Camera::look_at("main", at(0.0, 1.0, 1.8), at(0.0, 0.9, 0.0), DVec3::Y, 1.1, 1e-3).unwrap();
            for resolution in [128, 1024] {
                for lamp in &lamps {
                    let scene = scene(vec![room(size, wall)], vec![lamp.clone()], camera.clone());
                    let found = direct(&scene, &[&format!("rsm.resolution={resolution}")]);
                    let lit = values(&found).filter(|value| *value > 0.0).count();
                    if lit > 0 {
                        failed.push(format!("{size} m, walls of {wall} m, {resolution} texels, {:?}: {lit} pixels are lit", lamp.kind));
                    }
                }
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

fn many_lights(count: usize) -> Scene {
    // Spread by the plastic number (Roberts 2018), away from box and floor.
    let lamp = |index: usize| {
        let [x, y, z] = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|step| (step * (index as f64 + 0.5)).fract());
        light(LightKind::Point, DVec3::new(4.0 * x - 2.0, 1.1 + y, 4.0 * z - 2.0), DVec3::ZERO, 30.0 / count as f32)
    };
    scene(vec![box_on_floor()], (0..count).map(lamp).collect(), camera())
}

#[test]
fn hundreds_of_lights_cast_shadows() {
    if !has_gpu() {
        return;
    }
    for count in [64, 200] {
        let scene = many_lights(count);
        let reference = truth(&scene, LightPaths::Direct, 16);
        let found = rendered(&scene, "direct.ron", &[], &["rsm.resolution=64"], "direct.radiance", 4);
        let open = rendered(&scene, "direct.ron", &["unshadowed"], &[], "direct.radiance", 4);
        let [shadowed, unshadowed] = [&found, &open].map(|image| difference(image, &reference));
        println!("{count} lights: difference {shadowed:.4}, without shadows {unshadowed:.4}");
        assert!((mean(&found) / mean(&reference) - 1.0).abs() < 0.01 && shadowed < 0.02 && unshadowed > 2.0 * shadowed);
    }
}
