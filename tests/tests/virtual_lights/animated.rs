//! Shadow rays follow a scene that moves.

use crate::given::turn;
use lobelia::{
    Session, SessionOptions, Shot,
    graph::{GraphFile, PartData, testing::gpu},
};
use std::path::Path;

/// A floor, a wall, a lamp above, and a board that moves sideways into the lamp's light within a second.
const GLTF: &str = r#"{
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2, 3, 4]}],
    "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": {"KHR_lights_punctual": {"lights": [
        {"type": "spot", "intensity": 20, "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.8}}]}},
    "nodes": [
        {"mesh": 0},
        {"mesh": 0, "translation": [0, 0, -1], "rotation": [0.7071068, 0, 0, 0.7071068]},
        {"mesh": 0, "scale": [0.25, 1, 0.25], "translation": [5, 0.5, 0]},
        {"translation": [0.2, 1.5, 0.4], "rotation": [-0.7071068, 0, 0, 0.7071068], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"camera": 0, "translation": [0, 0.8, 3]}],
    "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.01}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "animations": [{"channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}], "samplers": [{"input": 2, "output": 3}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, 0, -1], "max": [1, 0, 1]},
        {"bufferView": 1, "componentType": 5125, "count": 6, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
        {"bufferView": 3, "componentType": 5126, "count": 2, "type": "VEC3"}],
    "bufferViews": [
        {"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        {"buffer": 0, "byteOffset": 72, "byteLength": 8}, {"buffer": 0, "byteOffset": 80, "byteLength": 24}],
    "buffers": [{"uri": "data.bin", "byteLength": 104}]
}"#;

fn write_scene(folder: &Path) -> String {
    let corners = [[-1.0f32, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    bytes.extend([0u32, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    bytes.extend([0.0f32, 1.0, 5.0, 0.5, 0.0, 0.0, 0.5, 0.0].iter().flat_map(|value| value.to_le_bytes()));
    std::fs::write(folder.join("data.bin"), bytes).unwrap();
    let path = folder.join("scene.gltf");
    std::fs::write(&path, GLTF).unwrap();
    path.to_string_lossy().into_owned()
}

/// Bits after `frames` frames that start at `time` and are a second apart.
fn bits(scene: &str, time: f32, frames: u32) -> Vec<u8> {
    let text = r#"(passes: {
        "gbuffer": gbuffer(), "rsm": rsm(resolution: 64), "density": flux_density(), "lights": vpl_lights(count: 64), "visibility": visibility(), "indirect": vpl_gather(),
    }, output: "indirect.radiance")"#;
    let wired = GraphFile::parse(text, "test.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let options = SessionOptions { time, baseline: true, ..SessionOptions::default() };
    let mut session = Session::new(scene, &options).unwrap();
    let keep = vec!["visibility.visibility".to_owned()];
    let shot = Shot { extent: [32, 24], frames, frame_seconds: 1.0, keep, ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).unwrap();
    rendering.run(&mut |_| true).unwrap();
    let read = rendering.runner().read(rendering.gpu(), "visibility.visibility").unwrap();
    let [(_, PartData::Buffer(bytes))] = &read[..] else { panic!("one chunk") };
    bytes.clone()
}

#[test]
fn the_hierarchy_is_rebuilt_when_something_moves() {
    if gpu().is_none() {
        return;
    }
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let scene = write_scene(folder.path());
    let (away, there, moved) = (bits(&scene, 0.0, 1), bits(&scene, 1.0, 1), bits(&scene, 0.0, 2));
    assert!(moved == there, "after moving, rays meet the board where it is");
    assert!(away != there, "where it is makes a difference");
}
