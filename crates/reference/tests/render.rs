//! The picture that grows: the same however it is made, honest about its noise, and never brighter than what lights it.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use lobelia_reference::{Checkpoint, LightPaths, Picture, ReferenceError, Render, Settings};
use lobelia_scene::{Environment, LightClass, LightTransport, Scene};

fn settings(paths: LightPaths, samples: u64) -> Settings {
    Settings { size: [24, 16], paths, samples, seed: 3 }
}

fn start(scene: &Scene, settings: Settings) -> Render {
    Render::new(scene, &scene.camera(None).unwrap(), settings).unwrap()
}

fn finish(mut render: Render) -> Picture {
    while render.done() < render.passes() {
        render.step();
    }
    render.picture()
}

fn mean(picture: &Picture) -> f64 {
    picture.pixels.as_flattened().iter().map(|value| f64::from(*value)).sum::<f64>() / (3 * picture.pixels.len()) as f64
}

#[test]
fn a_picture_does_not_depend_on_threads_or_interruptions() {
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let wanted = settings(LightPaths::Full { depth: 4 }, 64);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| finish(start(&scene, wanted)))
    };
    let whole = on(1);
    assert_eq!(whole, on(3));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("part.checkpoint");
    let mut killed = start(&scene, wanted);
    killed.step();
    killed.step();
    killed.checkpoint().save(&file).unwrap();
    drop(killed);
    let mut resumed = start(&scene, wanted);
    resumed.resume(Checkpoint::load(&file).unwrap(), &file).unwrap();
    assert_eq!(resumed.done(), 2);
    assert_eq!(finish(resumed), whole);
    // More samples of the same picture go on from there too; another seed is another picture.
    let mut longer = start(&scene, Settings { samples: 128, ..wanted });
    longer.resume(Checkpoint::load(&file).unwrap(), &file).unwrap();
    let other = start(&scene, Settings { seed: 4, ..wanted });
    assert_ne!(other.key(), longer.key());
    assert_ne!(finish(other), whole);
}

#[test]
fn checkpoints_of_something_else_and_broken_ones_are_refused() {
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.checkpoint");
    let mut one = start(&scene, settings(LightPaths::Direct, 32));
    one.step();
    one.checkpoint().save(&file).unwrap();
    let mut warm = scene.clone();
    warm.materials[0].base_color.x *= 0.5;
    for (what, mut other) in [
        ("paths", start(&scene, settings(LightPaths::OneBounce, 32))),
        ("light", start(&scene, settings(LightPaths::Only(LightTransport::of(LightClass::Punctual, [1])), 32))),
        ("material", start(&warm, settings(LightPaths::Direct, 32))),
        ("size", start(&scene, Settings { size: [16, 24], ..settings(LightPaths::Direct, 32) })),
    ] {
        let error = other.resume(Checkpoint::load(&file).unwrap(), &file).unwrap_err();
        assert!(matches!(error, ReferenceError::Checkpoint { .. }), "{what}: {error}");
    }
    let whole = std::fs::read(&file).unwrap();
    for (what, bytes) in [
        ("cut", &whole[..whole.len() - 5]),
        ("short", &whole[..20]),
        ("other", &b"something else that is long enough to be read as a head, and more"[..]),
    ] {
        std::fs::write(&file, bytes).unwrap();
        assert!(matches!(Checkpoint::load(&file), Err(ReferenceError::Checkpoint { .. })), "{what}");
    }
    assert!(matches!(Checkpoint::load(&folder.path().join("absent")), Err(ReferenceError::File { .. })));
    assert!(one.checkpoint().save(&folder.path().join("no/such/folder/x")).is_err());
}

#[test]
fn settings_out_of_range_are_refused() {
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let camera = scene.camera(None).unwrap();
    for bad in [
        Settings { size: [0, 4], ..settings(LightPaths::Direct, 1) },
        Settings { size: [1 << 16, 1 << 16], ..settings(LightPaths::Direct, 1) },
        settings(LightPaths::Direct, 0),
        settings(LightPaths::Full { depth: 0 }, 1),
        settings(LightPaths::Only(LightTransport::nothing()), 1),
        settings(LightPaths::Only(LightTransport::of_all([1001])), 1),
    ] {
        assert!(matches!(Render::new(&scene, &camera, bad), Err(ReferenceError::Settings(_))), "{bad:?}");
    }
}

/// Four times the passes halve the error, and the estimate is what two independent pictures differ by.
#[test]
fn the_estimated_noise_is_the_noise() {
    let scene = Scene::load("builtin:cornell-glossy").unwrap();
    let of = |samples: u64, seed: u32| finish(start(&scene, Settings { seed, ..settings(LightPaths::Direct, samples) }));
    let (few, many) = (of(128, 1), of(512, 1));
    assert!(many.relative_noise() < 0.5 * few.relative_noise() && many.relative_noise() > 0.0);
    // The estimate is the spread of whole passes; points of several passes fill each other's gaps, so the truth may be better, not worse.
    let (one, two) = (of(128, 5), of(128, 6));
    let average = mean(&one);
    let differences = one.pixels.as_flattened().iter().zip(two.pixels.as_flattened()).map(|(left, right)| {
        let value = 0.5 * f64::from(left + right);
        0.5 * f64::from(left - right).powi(2) / (value * value + 0.01 * average * average)
    });
    let measured = differences.sum::<f64>() / (3 * one.pixels.len()) as f64;
    let estimated = 0.5 * (one.relative_noise() + two.relative_noise());
    assert!(measured < 2.0 * estimated && measured > 0.02 * estimated, "{measured:e} {estimated:e}");
}

/// A closed even sky: whatever stands in it is at most as bright as it, and a Lambertian surface as bright as its albedo says.
#[test]
fn a_white_furnace() {
    let mut scene = Scene::load("builtin:spheres").unwrap();
    scene.lights.clear();
    let pixels = vec![Vec3::ONE; 32 * 16];
    scene.environment = Some(Environment { name: "even".into(), width: 32, height: 16, pixels, scale: 1.0 });
    for material in &mut scene.materials {
        (material.base_color, material.metallic, material.emissive) = (Vec3::ONE, 1.0, Vec3::ZERO);
        material.base_color_texture = None;
        material.metallic_roughness_texture = None;
        material.normal_texture = None;
    }
    let glossy = finish(start(&scene, settings(LightPaths::Full { depth: 8 }, 256)));
    // White metals lose to masking, and to the paths beyond the depth.
    assert!(
        glossy.pixels.as_flattened().iter().all(|value| *value < 1.03),
        "{:?}",
        glossy.pixels.as_flattened().iter().copied().fold(0.0, f32::max)
    );
    assert!(mean(&glossy) > 0.3 && mean(&glossy) < 1.0, "{}", mean(&glossy));
    for material in &mut scene.materials {
        (material.metallic, material.specular) = (0.0, 0.0);
    }
    let matt = finish(start(&scene, settings(LightPaths::Full { depth: 64 }, 256)));
    assert!((mean(&matt) - 1.0).abs() < 2e-3, "{}", mean(&matt));
}

/// Direct light, one bounce and the rest are parts of the whole.
#[test]
fn light_paths_add_up() {
    let scene = Scene::load("builtin:cornell-diffuse").unwrap();
    let of = |paths| mean(&finish(start(&scene, settings(paths, 1024))));
    let (direct, one, two) = (of(LightPaths::Direct), of(LightPaths::OneBounce), of(LightPaths::Full { depth: 2 }));
    let seen = of(LightPaths::Full { depth: 1 }) - direct;
    assert!(one > 0.05 * direct && ((direct + one + seen) / two - 1.0).abs() < 0.01, "{direct} {one} {seen} {two}");
}

/// A picture is the sum of those of its classes of lights and of its numbers of scattering events: of the same random numbers to rounding, of others within noise.
#[test]
fn classes_of_lights_add_up() {
    let mut scene = Scene::load("builtin:area-lights").unwrap();
    scene.lights = Scene::load("builtin:cornell-glossy").unwrap().lights;
    scene.environment = Some(Environment { name: "even".into(), width: 8, height: 4, pixels: vec![Vec3::splat(0.3); 32], scale: 1.0 });
    // Some surface that is no area light's.
    let ordinary = scene.instances.iter().find(|instance| instance.area_light.is_none()).unwrap();
    let material = scene.meshes[ordinary.mesh].material;
    scene.materials[material].emissive = Vec3::new(0.4, 0.2, 0.1);
    let traits = scene.traits();
    assert!(LightClass::ALL.into_iter().all(|class| traits.lights_of(class) > 0), "{traits:?}");
    let of = |light: LightTransport, seed: u32| finish(start(&scene, Settings { seed, ..settings(LightPaths::Only(light), 64) }));
    let all = LightTransport::of_all(0..=3);
    let whole = of(all, 3);
    let parts: Vec<Picture> = all.parts().map(|(_, part)| of(part, 3)).collect();
    assert!(
        parts.len() == 4 && parts.iter().all(|part| mean(part) > 0.01 * mean(&whole)),
        "{:?}",
        parts.iter().map(mean).collect::<Vec<_>>()
    );
    for (index, value) in whole.pixels.as_flattened().iter().enumerate() {
        let sum: f32 = parts.iter().map(|part| part.pixels.as_flattened()[index]).sum();
        assert!((sum - value).abs() <= 2e-5 * value.abs() + 1e-6, "{index}: {sum} {value}");
    }
    // All classes by this way are what the depth alone asks for.
    assert_eq!(finish(start(&scene, settings(LightPaths::Full { depth: 3 }, 64))).pixels, whole.pixels);
    // Other seeds, and single numbers of scattering events.
    let counts: f64 = (0..=3).map(|count| mean(&of(LightTransport::of_all([count]), 20 + count))).sum();
    assert!((counts / mean(&whole) - 1.0).abs() < 0.03, "{counts} {}", mean(&whole));
    let classes: f64 = all.parts().enumerate().map(|(index, (_, part))| mean(&of(part, 30 + index as u32))).sum();
    assert!((classes / mean(&whole) - 1.0).abs() < 0.03, "{classes} {}", mean(&whole));
}
