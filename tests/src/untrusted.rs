//! Everything that reads what users bring, from bytes: what the fuzz targets (`fuzz/`) and the test over their saved inputs both call. None may panic.

use lobelia::{graph::GraphFile, graph::Override, scene::Scene};
use std::path::{Path, PathBuf};

/// Names of the entries: folders of `fuzz/corpus`.
pub const TARGETS: [&str; 5] = ["graph", "scene", "gltf", "picture", "overrides"];

/// Gives the bytes to the entry of that name; whether they were accepted.
///
/// # Panics
/// If there is no such entry, or a temporary file cannot be written.
pub fn read(target: &str, bytes: &[u8]) -> bool {
    match target {
        "graph" => graph(bytes),
        "scene" => scene(bytes, "ron"),
        "gltf" => scene(bytes, if bytes.starts_with(b"glTF") { "glb" } else { "gltf" }),
        "picture" => picture(bytes),
        "overrides" => overrides(bytes),
        _ => panic!("no entry `{target}`"),
    }
}

/// A graph in RON: parsed and wired against the real passes, with each of its variants too.
fn graph(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(file) = GraphFile::parse(text, "graph.ron") else { return false };
    let registry = lobelia::registry();
    let variants: Vec<String> = file.variant_names().map(str::to_owned).take(8).collect();
    let plain = file.wire(&registry, &[], &[]).is_ok();
    for variant in variants {
        let _ = file.wire(&registry, &[variant], &[]);
    }
    plain
}

/// A scene as a file that ends so.
fn scene(bytes: &[u8], ending: &str) -> bool {
    with_file(bytes, ending, |path| Scene::load(&path.display().to_string()).is_ok())
}

/// A reference picture (EXR), and the same bytes as the environment of a scene (EXR, HDR and PNG).
fn picture(bytes: &[u8]) -> bool {
    with_file(bytes, "exr", |path| {
        let reference = lobelia::measure::read_exr(path).is_ok();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let text = format!("(gltf: \"builtin:cornell-diffuse\", environment: (file: \"{name}\"))");
        let scene = path.with_extension("ron");
        let environment = std::fs::write(&scene, text).is_ok() && Scene::load(&scene.display().to_string()).is_ok();
        reference || environment
    })
}

/// `PASS.PARAM=VALUE`, a line each, after a first line of `GRAPH[:VARIANT[+VARIANT]]...`, wired into that graph.
fn overrides(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let mut lines = text.lines();
    let variants = lines.next().unwrap_or_default();
    let Ok(overrides) = lines.map(str::parse).collect::<Result<Vec<Override>, _>>() else { return false };
    let graphs: PathBuf = crate::root().join("graphs/indirect.ron");
    let address = format!("{}{}", graphs.display(), variants);
    lobelia::trial::techniques(&[address], &overrides, &lobelia::registry()).is_ok()
}

fn with_file(bytes: &[u8], ending: &str, read: impl FnOnce(&Path) -> bool) -> bool {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(format!("input.{ending}"));
    std::fs::write(&path, bytes).expect("a temporary file");
    read(&path)
}
