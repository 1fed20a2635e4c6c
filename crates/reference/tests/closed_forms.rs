//! Each kind of light on a Lambertian floor against the irradiance that is known for it.
#![allow(clippy::unwrap_used)]

use base64::Engine as _;
use glam::DVec3;
use lobelia_reference::{LightPaths, Picture, Render, Settings};
use lobelia_scene::{Camera, Environment, LightClass, LightTransport, Scene};
use std::f64::consts::PI;

const ALBEDO: f64 = 0.5;

/// A scene file: a floor of 200 m at y = 0 that reflects `ALBEDO`, and more nodes, meshes, materials and extensions in JSON. The second mesh is a square
/// of 1 x 1 m facing up, of the second material.
fn scene(nodes: &str, lights: &str, material: &str) -> Scene {
    let mut bytes = Vec::new();
    for half in [100f32, 0.5] {
        for [x, z] in [[-half, -half], [-half, half], [half, half], [half, -half]] {
            bytes.extend([x, 0.0, z].iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    // The nodes after the floor.
    let count = serde_json::from_str::<Vec<serde_json::Value>>(&format!("[{nodes}]")).unwrap().len();
    let list = (0..=count).map(|node| node.to_string()).collect::<Vec<_>>().join(", ");
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let text = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [{list}]}}],
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
        "extensions": {{"KHR_lights_punctual": {{"lights": [{lights}]}}}},
        "nodes": [{{"mesh": 0}}, {nodes}],
        "materials": [{{"pbrMetallicRoughness": {{"baseColorFactor": [{ALBEDO}, {ALBEDO}, {ALBEDO}, 1], "metallicFactor": 0}}}}, {material}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 2, "material": 0}}]}},
                   {{"primitives": [{{"attributes": {{"POSITION": 1}}, "indices": 2, "material": 1}}]}}],
        "buffers": [{{"byteLength": {}, "uri": "data:application/octet-stream;base64,{data}"}}],
        "bufferViews": [{{"buffer": 0, "byteOffset": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 96, "byteLength": 12}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-100, 0, -100], "max": [100, 0, 100]}},
                      {{"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-0.5, 0, -0.5], "max": [0.5, 0, 0.5]}},
                      {{"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}}]}}"#,
        bytes.len()
    );
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.gltf");
    std::fs::write(&file, text).unwrap();
    let mut scene = Scene::load(file.to_str().unwrap()).unwrap();
    for material in &mut scene.materials {
        // Lambert alone.
        material.specular = 0.0;
    }
    scene
}

const DARK: &str = r#"{"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}}"#;

/// Irradiance at the origin, from the mean of a small picture of the floor there; the camera looks from the side, below every light.
fn irradiance(scene: &Scene, samples: u64) -> DVec3 {
    irradiance_of(scene, LightPaths::Direct, samples)
}

/// The same of some light only.
fn irradiance_of(scene: &Scene, paths: LightPaths, samples: u64) -> DVec3 {
    let camera = Camera::look_at("c", DVec3::new(0.3, 0.4, 5.0), DVec3::ZERO, DVec3::Y, 1e-4, 0.01).unwrap();
    let settings = Settings { size: [8, 8], paths, samples, seed: 1 };
    let mut render = Render::new(scene, &camera, settings).unwrap();
    while render.done() < render.passes() {
        render.step();
    }
    let Picture { pixels, dropped, .. } = render.picture();
    assert_eq!(dropped, 0);
    pixels.iter().map(|pixel| DVec3::from(pixel.map(f64::from))).sum::<DVec3>() / pixels.len() as f64 * PI / ALBEDO
}

fn close(got: DVec3, want: DVec3, relative: f64) {
    assert!((got - want).abs().max_element() <= relative * want.max_element(), "{got}, not {want}");
}

#[test]
fn lights_without_extent() {
    let node = r#"{"translation": [0, 2, 0], "rotation": [-0.7071067811865476, 0, 0, 0.7071067811865476], "extensions": {"KHR_lights_punctual": {"light": 0}}}"#;
    let point = scene(node, r#"{"type": "point", "intensity": 10, "color": [1, 0.5, 0.25]}"#, DARK);
    close(irradiance(&point, 4), DVec3::new(10.0, 5.0, 2.5) / 4.0, 5e-6);
    let spot = scene(node, r#"{"type": "spot", "intensity": 10, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}}"#, DARK);
    close(irradiance(&spot, 4), DVec3::splat(2.5), 5e-6);
    let sun = scene(node, r#"{"type": "directional", "intensity": 3}"#, DARK);
    close(irradiance(&sun, 4), DVec3::splat(3.0), 5e-6);
    // Aside, the cosine and the longer way count: 10 / d^2 times cos, d^2 = 2^2 + 1.5^2.
    let aside = scene(
        r#"{"translation": [1.5, 2, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}"#,
        r#"{"type": "point", "intensity": 10}"#,
        DARK,
    );
    close(irradiance(&aside, 4), DVec3::splat(10.0 / 6.25 * 0.8), 5e-6);
}

/// Form factor of a rectangle a x b, parallel to a receiver below one of its corners at distance h.
fn corner_factor(a: f64, b: f64, h: f64) -> f64 {
    let (x, y) = (a / h, b / h);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
}

/// A node with an area light at (0, 1, 0) that faces down.
fn area_light(shape: &str, more: &str) -> String {
    format!(
        r#"{{"translation": [0, 1, 0], "rotation": [-0.7071067811865476, 0, 0, 0.7071067811865476], {more} "extras": {{"area_light": {{{shape}, "radiance": [2, 4, 6]}}}}}}"#
    )
}

#[test]
fn lights_with_extent() {
    let radiance = DVec3::new(2.0, 4.0, 6.0);
    let quad = scene(&area_light(r#""shape": "quad", "width": 0.8, "height": 0.6"#, ""), "", DARK);
    close(irradiance(&quad, 256), radiance * PI * 4.0 * corner_factor(0.4, 0.3, 1.0), 1e-3);
    let disk = scene(&area_light(r#""shape": "disk", "radius": 0.5"#, ""), "", DARK);
    close(irradiance(&disk, 256), radiance * PI * 0.25 / 1.25, 1e-3);
    let sphere = scene(&area_light(r#""shape": "sphere", "radius": 0.5"#, ""), "", DARK);
    close(irradiance(&sphere, 256), radiance * PI * 0.25, 1e-3);
    // Twice as wide along one axis: an ellipse of half axes 1 and 0.5 has no simple form; a quad has.
    let wide = scene(&area_light(r#""shape": "quad", "width": 0.8, "height": 0.6"#, r#""scale": [2, 1, 1],"#), "", DARK);
    close(irradiance(&wide, 256), radiance * PI * 4.0 * corner_factor(0.8, 0.3, 1.0), 1e-3);
    // Turned away, the flat ones give nothing.
    let away = area_light(r#""shape": "disk", "radius": 0.5"#, "").replace("-0.7071067811865476", "0.7071067811865476");
    close(irradiance(&scene(&away, "", DARK), 64), DVec3::ZERO, 0.0);
}

/// An ellipsoid by quadrature over its outline's directions: rays from the origin that meet it.
#[test]
fn an_ellipsoid() {
    let node = area_light(r#""shape": "sphere", "radius": 0.5"#, r#""scale": [1.6, 1, 0.5],"#);
    // The node is turned about X: local z points down, so the half axes are 0.8 along x, 0.25 along y, 0.5 along z.
    let half = DVec3::new(0.8, 0.25, 0.5);
    let mut sum = 0.0;
    let steps = 600;
    for i in 0..steps {
        for j in 0..steps {
            // Square of the projected hemisphere: d omega cos = dx dz.
            let (x, z) = ((f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0, (f64::from(j) + 0.5) / f64::from(steps) * 2.0 - 1.0);
            let y2 = 1.0 - x * x - z * z;
            if y2 > 0.0 {
                let (d, o) = (DVec3::new(x, y2.sqrt(), z) / half, DVec3::new(0.0, -1.0, 0.0) / half);
                let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
                sum += f64::from(u8::from(b * b - a * c > 0.0 && b < 0.0));
            }
        }
    }
    let area = sum * 4.0 / f64::from(steps * steps);
    close(irradiance(&scene(&node, "", DARK), 1024), DVec3::new(2.0, 4.0, 6.0) * area, 5e-3);
}

#[test]
fn emissive_surfaces_emit_from_their_front() {
    let material = r#"{"pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [1, 0.5, 0.25], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}}"#;
    let down = r#"{"mesh": 1, "translation": [0, 1, 0], "rotation": [1, 0, 0, 0]}"#;
    let want = DVec3::new(8.0, 4.0, 2.0) * PI * 4.0 * corner_factor(0.5, 0.5, 1.0);
    close(irradiance(&scene(down, "", material), 256), want, 1e-3);
    let up = r#"{"mesh": 1, "translation": [0, 1, 0]}"#;
    close(irradiance(&scene(up, "", material), 64), DVec3::ZERO, 0.0);
}

#[test]
fn an_environment_and_what_stands_before_it() {
    // The second square is below the floor.
    let mut open = scene(r#"{"mesh": 1, "translation": [0, -3, 0]}"#, "", DARK);
    let pixels = vec![glam::Vec3::new(1.0, 2.0, 3.0); 16 * 8];
    open.environment = Some(Environment { name: "even".into(), width: 16, height: 8, pixels, scale: 0.5 });
    close(irradiance(&open, 256), DVec3::new(0.5, 1.0, 1.5) * PI, 2e-3);
    // A black square of 1 m, 1 m above the point, takes its form factor away.
    let mut covered = scene(r#"{"mesh": 1, "translation": [0, 1, 0]}"#, "", DARK);
    covered.environment = open.environment.clone();
    let left = 1.0 - 4.0 * corner_factor(0.5, 0.5, 1.0);
    close(irradiance(&covered, 1024), DVec3::new(0.5, 1.0, 1.5) * PI * left, 2e-3);
}

/// All four classes over one floor, each where it hides no other: alone, each gives what is known for it, with the same numbers as among the others.
#[test]
fn each_class_of_lights_alone() {
    let lamp = r#"{"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0}, "emissiveFactor": [1, 0.5, 0.25]}"#;
    let nodes = [
        r#"{"translation": [3, 4, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}}"#.to_owned(),
        // The emissive square looks down from 1.5 m at the side.
        r#"{"mesh": 1, "translation": [0, 1.5, 2], "rotation": [1, 0, 0, 0]}"#.to_owned(),
        area_light(r#""shape": "disk", "radius": 0.5"#, ""),
    ];
    let mut all = scene(&nodes.join(", "), r#"{"type": "point", "intensity": 50}"#, lamp);
    all.environment =
        Some(Environment { name: "even".into(), width: 16, height: 8, pixels: vec![glam::Vec3::splat(0.5); 128], scale: 1.0 });
    let of = |class: LightClass| irradiance_of(&all, LightPaths::Only(LightTransport::of(class, [1])), 1024);
    close(of(LightClass::Punctual), DVec3::splat(50.0 / 25.0 * 0.8), 5e-6);
    close(of(LightClass::Area), DVec3::new(2.0, 4.0, 6.0) * PI * 0.25 / 1.25, 2e-3);
    // A rectangle whose corners lie at x = +-0.5, z = 1.5 and 2.5 over the receiver: what reaches to 2.5 less what reaches to 1.5.
    let factor = 2.0 * (corner_factor(0.5, 2.5, 1.5) - corner_factor(0.5, 1.5, 1.5));
    close(of(LightClass::Emissive), DVec3::new(1.0, 0.5, 0.25) * PI * factor, 2e-3);
    // The sky without what the disk and the square hide of it.
    let open = 1.0 - 0.25 / 1.25 - factor;
    close(of(LightClass::Environment), DVec3::splat(0.5 * PI * open), 5e-3);
    let sum: DVec3 = LightClass::ALL.into_iter().map(of).sum();
    close(irradiance_of(&all, LightPaths::Direct, 1024), sum, 1e-6);
}
