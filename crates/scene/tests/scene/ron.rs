//! RON scenes.

use crate::glb::{Glb, folder, load_in};
use glam::{DVec3, Vec3};
use lobelia_scene::{LightKind, Ndf, Scene, SceneError};
use serde_json::json;

fn load(text: &str) -> Result<Scene, SceneError> {
    let glb = Glb::triangle().bytes();
    let mut pixels = std::io::Cursor::new(Vec::new());
    image::Rgb32FImage::from_raw(2, 1, vec![1.0, 2.0, 3.0, 4.0, 5.0, 60_000.0])
        .unwrap()
        .write_to(&mut pixels, image::ImageFormat::OpenExr)
        .unwrap();
    let mut negative = std::io::Cursor::new(Vec::new());
    image::Rgb32FImage::from_raw(1, 1, vec![1.0, -2.0, 3.0]).unwrap().write_to(&mut negative, image::ImageFormat::OpenExr).unwrap();
    let files: [(&str, &[u8]); 4] =
        [("scene.ron", text.as_bytes()), ("triangle.glb", &glb), ("sky.exr", pixels.get_ref()), ("negative.exr", negative.get_ref())];
    load_in(&folder(&files), "scene.ron")
}

/// Asserts where and with what words a file is refused.
#[track_caller]
fn refused(text: &str, line: usize, column: usize, expected: &str) {
    let error = load(text).expect_err("it should be refused");
    let shown = error.to_string();
    assert!(shown.contains(expected), "`{expected}` is not in: {shown}");
    let SceneError::Ron { line: at_line, column: at_column, .. } = error else { panic!("no position: {shown}") };
    assert_eq!((at_line, at_column), (line, column), "{shown}");
    assert!(shown.contains(&format!("scene.ron:{line}:{column}: ")), "{shown}");
}

#[test]
fn everything_can_be_added_or_overridden() {
    let scene = load(
        r#"(
            gltf: "builtin:cornell-glossy", // a comment
            ndf: phong,
            environment: (file: "sky.exr", scale: 0.25),
            cameras: {
                "close": (origin: (0, 1, 3), target: (0, 1, 0), yfov: 0.5),
                "side": (origin: (3, 1, 0), target: (0, 1, 0), up: (0, 0, 1), near: 0.5),
            },
            lights: {
                "spot": spot(position: (0, 1.9, 0), direction: (0, -2, 0), intensity: (1, 2, 3), inner: 0.1, outer: 0.4),
                "bulb": point(position: (0, 1, 0), intensity: (4, 4, 4)),
                "sun": directional(direction: (1, 0, 0), illuminance: (5, 5, 5)),
            },
            materials: {
                "*": (specular: 0.5, roughness: 0.6),
                "tall-box": (roughness: 0.2, base_color: (0.1, 0.2, 0.3), metallic: 0.25, emissive: (7, 0, 0)),
            },
        )"#,
    )
    .unwrap();
    assert_eq!(scene.ndf, Ndf::Phong);
    let environment = scene.environment.as_ref().unwrap();
    assert_eq!((environment.scale, environment.pixels.as_slice()), (0.25, &[Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 60_000.0)][..]));
    let cameras: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(cameras, ["close", "side", "main", "low"]);
    let close = scene.camera(None).unwrap();
    assert_eq!((close.name.as_str(), close.position, close.forward), ("close", DVec3::new(0.0, 1.0, 3.0), DVec3::NEG_Z));
    assert_eq!((close.yfov, close.right), (0.5, DVec3::X));
    // A thousandth of the diagonal of a 2 m box.
    assert!((close.near - 12f64.sqrt() * 1e-3).abs() < 1e-9);
    let side = scene.camera(Some("side")).unwrap();
    assert_eq!((side.near, side.forward, side.up), (0.5, DVec3::NEG_X, DVec3::Z));
    let lights: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(lights, ["spot", "bulb", "sun"]);
    assert_eq!((scene.lights[0].direction, scene.lights[0].kind), (DVec3::NEG_Y, LightKind::Spot { inner: 0.1, outer: 0.4 }));
    assert_eq!((scene.lights[2].kind, scene.lights[2].intensity), (LightKind::Directional, Vec3::splat(5.0)));
    let of = |name: &str| scene.materials.iter().find(|material| material.name == name).unwrap();
    assert_eq!((of("white").specular, of("white").roughness), (0.5, 0.6));
    let tall = of("tall-box");
    assert_eq!((tall.roughness, tall.metallic, tall.base_color), (0.2, 0.25, Vec3::new(0.1, 0.2, 0.3)));
    assert_eq!((tall.specular, tall.emissive), (0.5, Vec3::new(7.0, 0.0, 0.0)));
    let traits = scene.traits();
    assert!(traits.environment && traits.emissive && traits.ndf == Ndf::Phong);
}

#[test]
fn the_example_of_the_documentation_loads() {
    let documentation = include_str!("../../src/lib.rs");
    let (_, after) = documentation.split_once("```ron\n").unwrap();
    let (example, _) = after.split_once("//! ```").unwrap();
    let text = example
        .replace("//! ", "")
        .replace("atrium.glb", "builtin:ring-caustic")
        .replace("sky.hdr", "sky.exr")
        .replace("\"Gold\"", "\"ring\"");
    let scene = load(&text).unwrap();
    assert_eq!((scene.lights.len(), scene.camera(None).unwrap().name.as_str(), scene.ndf), (3, "close", Ndf::Phong));
}

#[test]
fn little_is_needed() {
    let scene = load("(gltf: \"triangle.glb\")").unwrap();
    assert_eq!((scene.triangles().len(), scene.ndf), (1, Ndf::Ggx));
    assert!(scene.name.ends_with("scene.ron"));
}

#[test]
fn lights_of_the_file_can_be_dropped_with_their_surfaces() {
    let mut glb = Glb::triangle();
    let bulb = glb.light(json!({"type": "point"}));
    glb.node(json!({"extensions": {"KHR_lights_punctual": {"light": bulb}}}));
    glb.node(json!({"name": "lamp", "extras": {"area_light": {"shape": "sphere", "radius": 1, "radiance": [1, 1, 1]}}}));
    let load = |rest: &str| {
        let text = format!("(gltf: \"lit.glb\", {rest})");
        load_in(&folder(&[("scene.ron", text.as_bytes()), ("lit.glb", &glb.bytes())]), "scene.ron").unwrap()
    };
    let kept = load("");
    assert_eq!((kept.lights.len(), kept.area_lights.len(), kept.instances.len()), (1, 1, 2));
    let dropped = load("keep_lights: false, lights: {\"new\": point(position: (0, 0, 1), intensity: (1, 1, 1))}");
    assert_eq!((dropped.lights.len(), dropped.area_lights.len(), dropped.instances.len()), (1, 0, 1));
    assert_eq!(dropped.lights[0].name, "new");
    // `*` is not the black surface of a light.
    let rough = load("materials: {\"*\": (specular: 1.0, emissive: (0, 0, 0))}");
    let surface = rough.instances.iter().find(|instance| instance.area_light.is_some()).unwrap();
    let material = &rough.materials[rough.meshes[surface.mesh].material];
    assert_eq!((material.specular, material.emissive), (0.0, Vec3::ONE));
}

#[test]
fn normal_maps_can_be_switched_off() {
    let mut glb = Glb::square(json!({"name": "wall", "normalTexture": {"index": 0}}));
    glb.texture(&crate::glb::png(1, 1, &[128, 128, 255, 255]), json!({}));
    for (on, expected) in [("true", true), ("false", false)] {
        let text = format!("(gltf: \"square.glb\", materials: {{\"wall\": (normal_map: {on})}})");
        let scene = load_in(&folder(&[("scene.ron", text.as_bytes()), ("square.glb", &glb.bytes())]), "scene.ron").unwrap();
        assert_eq!(scene.traits().normal_maps, expected);
    }
}

#[test]
fn syntax_and_spelling() {
    assert!(load("").unwrap_err().to_string().ends_with("scene.ron: the file is empty"));
    refused("(\n  gltf: \"triangle.glb\",\n  ndf: gxg,\n)", 3, 8, "gxg");
    refused("(\n  gltf: \"triangle.glb\",\n  enviroment: (file: \"sky.exr\"),\n)", 3, 3, "did you mean `environment`?");
    refused("(\n  gltf: \"triangle.glb\",\n  materials: {\"*\": (roughnes: 0.1)},\n)", 3, 21, "did you mean `roughness`?");
    refused("(\n  gltf: \"triangle.glb\",\n  lights: {\"a\": sport(outer: 1)},\n)", 3, 17, "did you mean `spot`?");
    refused("(ndf: ggx)", 1, 10, "gltf");
    refused("(gltf: \"triangle.glb\", keep_lights: 3)", 1, 36, "bool");
    refused("(gltf: \"triangle.glb\",\n cameras: {\"a\": (origin: (0, 0), target: (0, 0, 0))})", 2, 31, "Expected a tuple of size 3");
    refused("(gltf: \"triangle.glb\",\n materials: {\"*\": (), \"*\": ()})", 2, 24, "duplicate name `*`");
}

#[test]
fn values_out_of_range() {
    let with = |rest: &str| format!("(\n  gltf: \"triangle.glb\", // roughness: in a comment\n  {rest}\n)");
    for (rest, column, expected) in [
        ("materials: {\"default\": (metallic: 0, roughness: 1.5)},", 40, "material `default`: roughness is 1.5, but must lie in [0, 1]"),
        ("materials: {\"default\": (specular: NaN)},", 27, "specular is NaN"),
        ("materials: {\"default\": (base_color: (0, 2, 0))},", 27, "base_color is 2"),
        ("materials: {\"default\": (emissive: (0, -2, 0))},", 27, "emissive is [0, -2, 0]"),
        ("materials: {\"defualt\": ()},", 15, "no material is called `defualt`\n  help: did you mean `default`?"),
        ("lights: {\"a\": point(position: (0, inf, 0), intensity: (1, 1, 1))},", 23, "light `a`: position is [0, inf, 0]"),
        ("lights: {\"a\": point(position: (0, 0, 0), intensity: (-1, 1, 1))},", 12, "light `a`: its intensity is [-1, 1, 1]"),
        ("lights: {\"a\": point(position: (0, 0, 0), intensity: (1e60, 1, 1))},", 12, "must be finite"),
        ("lights: {\"a\": directional(direction: (0, 0, 0), illuminance: (1, 1, 1))},", 29, "direction is zero"),
        (
            "lights: {\"a\": spot(position: (0, 0, 0), direction: (0, 1, 0), intensity: (1, 1, 1), outer: 2)},",
            12,
            "its cone angles are 0 and 2",
        ),
        ("cameras: {\"a\": (origin: (0, 0, 1), target: (0, 0, 0), yfov: 4)},", 57, "camera `a`: yfov is 4, but must lie in (0, pi)"),
        ("cameras: {\"a\": (origin: (0, 0, 1), target: (0, 0, 0), near: 0)},", 57, "near is 0, but must be positive"),
        ("cameras: {\"a\": (origin: (0, 0, 1), target: (0, 0, 1))},", 38, "target must differ from origin"),
        ("cameras: {\"a\": (origin: (0, 2, 0), target: (0, 0, 0))},", 38, "not lie along up"),
        ("cameras: {\"a\": (origin: (0, NaN, 0), target: (0, 0, 0))},", 19, "origin is [0, NaN, 0], but must be finite"),
        ("cameras: {\"a\": (origin: (0, 0, 1), target: (0, 0, 0), up: (0, 0, 0))},", 57, "up is zero"),
        ("environment: (file: \"nowhere.hdr\"),", 17, "nowhere.hdr: cannot be read"),
        ("environment: (file: \"triangle.glb\"),", 17, "triangle.glb: it cannot be decoded: it is a binary glTF file"),
        ("environment: (file: \"sky.exr#Beauty\"),", 17, "sky.exr: it has no layer `Beauty` that is a picture"),
        ("environment: (file: \"sky.exr\", scale: -1),", 34, "environment: scale is -1"),
    ] {
        refused(&with(rest), 3, column, expected);
    }
}

#[test]
fn wrapped_files() {
    refused("(gltf: \"other.ron\")", 1, 2, "not another RON scene");
    for (text, expected) in [
        ("(gltf: \"nowhere.glb\")", "nowhere.glb: cannot be read"),
        ("(gltf: \"builtin:sphere\")", "did you mean `spheres`?"),
        ("(gltf: \"triangle.glb\", cameras: {\"a\": (origin: (0, 1e12, 1), target: (0, 0, 0))})", "camera `a` is at [0, 1000000000000, 1]"),
    ] {
        let error = load(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

const MOVING: &str = r#"(
    gltf: "builtin:cornell-glossy",
    lights: {"bulb": point(position: (9, 9, 9), intensity: (1, 1, 1))},
    light_motion: {
        "spot": [
            (seconds: 0, position: (0, 1, 0), direction: (0, -2, 0)),
            (seconds: 2, position: (2, 1, 0), direction: (3, 0, 0)),
        ],
        "bulb": [(seconds: 1, position: (0, 1, 0)), (seconds: 3, position: (0, 3, 0))],
    },
)"#;

#[test]
fn lights_move_along_their_keys() {
    let mut scene = load(MOVING).unwrap();
    let traits = scene.traits();
    assert!(traits.animated && traits.animation_seconds == 3.0);
    assert!(scene.lights.iter().all(|light| light.animated));
    let place = |scene: &Scene, name: &str| {
        let light = scene.lights.iter().find(|light| light.name == name).unwrap();
        (light.position, light.direction)
    };
    // The scene is loaded as it is at the start.
    assert_eq!(place(&scene, "spot"), (DVec3::Y, DVec3::NEG_Y));
    assert_eq!(place(&scene, "bulb").0, DVec3::Y);
    let version = scene.geometry_version();
    scene.set_time(1.0);
    let (position, direction) = place(&scene, "spot");
    assert!((position - DVec3::new(1.0, 1.0, 0.0)).length() < 1e-12);
    assert!((direction - DVec3::new(1.0, -1.0, 0.0).normalize()).length() < 1e-12);
    assert_eq!(place(&scene, "bulb").0, DVec3::Y);
    assert_eq!(scene.geometry_version(), version + 1);
    scene.set_time(1.0);
    assert_eq!(scene.geometry_version(), version + 1);
    scene.set_time(100.0);
    assert_eq!((place(&scene, "spot").0, place(&scene, "bulb").0), (DVec3::new(2.0, 1.0, 0.0), DVec3::new(0.0, 3.0, 0.0)));
}

#[test]
fn broken_motions_are_refused_where_they_stand() {
    let text = |keys: &str| format!("(gltf: \"builtin:cornell-glossy\", light_motion: {{\n  \"spot\": [\n{keys}\n]}})");
    let good = "    (seconds: 1, position: (0, 1, 0), direction: (0, -1, 0)),\n";
    let refused_second = |key: &str, expected: &str| refused(&text(&format!("{good}    ({key})")), 4, 6, expected);
    refused_second(
        "seconds: 1, position: (0, 1, 0), direction: (0, -1, 0)",
        "key 2: seconds is 1, but must be more than that of the key before, 1",
    );
    refused_second("seconds: -2, position: (0, 1, 0), direction: (0, -1, 0)", "seconds is -2, but must be finite and not negative");
    refused_second("seconds: 2, position: (0, inf, 0), direction: (0, -1, 0)", "position is [0, inf, 0], but must be finite");
    refused_second("seconds: 2, position: (0, 1, 0), direction: (0, 0, 0)", "direction is zero");
    refused_second("seconds: 2, direction: (0, -1, 0)", "position must be given in every key or in none");
    refused_second("seconds: 2, position: (0, 1, 0)", "direction must be given in every key or in none");
    refused_second("seconds: 2", "position is missing, and a direction too");
    refused_second("seconds: 2, position: (0, 1, 0), direction: (0, 1, 0)", "opposite to that of the key before");
    refused(&text(""), 2, 3, "the motion of light `spot` has no key");
    refused("(gltf: \"builtin:cornell-glossy\", light_motion: {\n\"spott\": []})", 2, 1, "no light is called `spott`");
    let bulb =
        "(gltf: \"builtin:cornell-glossy\", lights: {\"a\": point(position: (0, 1, 0), intensity: (1, 1, 1))},\nlight_motion: {\"a\": [";
    refused(&format!("{bulb}(seconds: 0, direction: (1, 0, 0))]}})"), 2, 23, "a point light has none");
    let far = text("(seconds: 0, position: (1e10, 0, 0))");
    assert!(load(&far).unwrap_err().to_string().contains("light `spot` is at"), "{}", load(&far).unwrap_err());
    // A word that is no field.
    assert!(load(&text("(second: 0)")).unwrap_err().to_string().contains("did you mean `seconds`"));
}

#[test]
fn bad_pixels_of_an_environment_are_clamped_and_counted() {
    let scene = load("(gltf: \"triangle.glb\", environment: (file: \"negative.exr\"))").unwrap();
    assert_eq!(scene.environment.unwrap().pixels, [Vec3::new(1.0, 0.0, 3.0)]);
    assert!(scene.warnings[0].contains("negative.exr: pixels that are no radiance are clamped: 1 negative, now 0"), "{:?}", scene.warnings);
}

#[test]
fn a_picture_of_eight_bits_is_no_radiance_until_it_is_decoded() {
    let png = crate::glb::png(1, 1, &[188, 0, 255, 255]);
    let files: [(&str, &[u8]); 2] = [("scene.ron", b"(gltf: \"builtin:spheres\", environment: (file: \"sky.png\"))"), ("sky.png", &png)];
    let scene = load_in(&folder(&files), "scene.ron").unwrap();
    let pixel = scene.environment.unwrap().pixels[0];
    assert!((pixel - Vec3::new(0.5029, 0.0, 1.0)).abs().max_element() < 1e-4, "{pixel}");
    assert!(scene.warnings.iter().any(|warning| warning.contains("no range above 1")), "{:?}", scene.warnings);
}

#[test]
fn a_byte_order_mark_moves_no_position_and_rounding_is_clamped() {
    let marked = "\u{feff}(\n  gltf: \"triangle.glb\",\n  enviroment: (file: \"sky.exr\"),\n)";
    refused(marked, 3, 3, "did you mean `environment`?");
    refused("\u{feff}(gltf: 3)", 1, 7, "Expected string");
    let scene = load(
        "\u{feff}(gltf: \"triangle.glb\", materials: {\"*\": (roughness: 1.0000001, metallic: -1e-9, base_color: (1.0000002, 0, 0))}, lights: {
            \"a\": spot(position: (0, 0, 1), direction: (0, 0, -1), intensity: (1, 1, 1), outer: 1.5708),
            \"b\": spot(position: (0, 0, 1), direction: (0, 0, -1), intensity: (1, 1, 1), inner: 0.5, outer: 0.4)})",
    )
    .unwrap();
    let material = &scene.materials[0];
    assert_eq!((material.roughness, material.metallic, material.base_color), (1.0, 0.0, Vec3::X));
    assert_eq!(scene.lights[0].kind, LightKind::Spot { inner: 0.0, outer: std::f32::consts::FRAC_PI_2 });
    assert_eq!(scene.lights[1].kind, LightKind::Spot { inner: 0.4, outer: 0.4 });
    assert!(scene.warnings.iter().filter(|warning| warning.contains("clamped")).count() == 2, "{:?}", scene.warnings);
}

const WALK: &str = r#"(
    gltf: "builtin:cornell-glossy",
    cameras: {"walk": (origin: (0, 1, 9), target: (0, 1, 0), yfov: 0.5)},
    camera_motion: {
        "walk": [
            (seconds: 1, origin: (0, 1, 4), target: (0, 1, 0)),
            (seconds: 3, origin: (4, 1, 0), target: (0, 1, 0)),
        ],
    },
)"#;

#[test]
fn cameras_move_along_their_keys() {
    let mut scene = load(WALK).unwrap();
    let traits = scene.traits();
    assert!(traits.animated && traits.animation_seconds == 3.0);
    let mut at = |seconds: f32| {
        scene.set_time(seconds);
        (scene.camera(Some("walk")).unwrap(), scene.geometry_version())
    };
    // Before the first key it stands there, as it is loaded.
    let (start, version) = at(0.0);
    assert_eq!((start.position, start.forward, start.yfov), (DVec3::new(0.0, 1.0, 4.0), DVec3::NEG_Z, 0.5));
    let (middle, moved) = at(2.0);
    assert!((middle.position - DVec3::new(2.0, 1.0, 2.0)).length() < 1e-12 && moved == version + 1);
    assert!((middle.forward - DVec3::new(-1.0, 0.0, -1.0).normalize()).length() < 1e-12);
    assert!((middle.up - DVec3::Y).length() < 1e-12 && (middle.right - middle.forward.cross(middle.up)).length() < 1e-12);
    let (end, _) = at(9.0);
    assert!((end.position - DVec3::new(4.0, 1.0, 0.0)).length() < 1e-12 && (end.forward - DVec3::NEG_X).length() < 1e-12);
}

#[test]
fn impossible_camera_keys_are_refused_by_place() {
    let with = |from: &str, to: &str| {
        assert!(WALK.contains(from), "{from}");
        WALK.replace(from, to)
    };
    refused(&with("\"walk\": [", "\"wlak\": ["), 5, 9, "no camera is called `wlak`");
    refused(&with("seconds: 3", "seconds: 1"), 7, 14, "key 2: seconds is 1, but must be more than that of the key before, 1");
    refused(&with("seconds: 1", "seconds: -1"), 6, 14, "key 1: seconds is -1, but must be finite and not negative");
    refused(&with("origin: (4, 1, 0), target: (0, 1, 0)", "origin: (0, 9, 0), target: (0, 1, 0)"), 7, 14, "not lie along up");
    refused(&with("origin: (4, 1, 0)", "origin: (0, 1, 0)"), 7, 14, "key 2: target must differ from origin");
    refused(
        &with("origin: (4, 1, 0)", "origin: (0, 1, -4)"),
        7,
        14,
        "key 2: target is such that the view turns straight up, straight down",
    );
    refused(&with("origin: (4, 1, 0)", "origin: (inf, 1, 0)"), 7, 14, "key 2: origin is [inf, 1, 0], but must be finite");
}

#[test]
fn the_example_of_the_documentation_is_a_scene() {
    let page = include_str!("../../../../docs/scenes.md");
    let example = page.split("```ron\n").nth(1).unwrap().split("```").next().unwrap();
    let scene = load(example).unwrap();
    assert_eq!(scene.camera(None).unwrap().name, "walk");
    assert!(["key", "bulb", "sun"].iter().all(|name| scene.lights.iter().any(|light| light.name == *name)));
    assert_eq!(scene.traits().animation_seconds, 2.0);
}
