//! Bad input to the program: each row must end in its message and its exit code, without a panic and without a file left behind.
#![allow(clippy::unwrap_used)]

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};

/// The program, built once.
fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "-p", "lobelia-lobelia", "--bin", "lobelia"])
            .current_dir(lobelia_tests::root())
            .status();
        assert!(built.unwrap().success());
        let folder = std::env::current_exe().unwrap().parent().and_then(Path::parent).unwrap().to_owned();
        folder.join(format!("lobelia{}", std::env::consts::EXE_SUFFIX))
    })
}

fn run(folder: &Path, arguments: &str) -> Output {
    let graphs = lobelia_tests::root().join("graphs");
    let arguments = arguments.split_whitespace().map(|word| word.replace("GRAPHS", &graphs.display().to_string()));
    Command::new(program()).args(arguments).current_dir(folder).env_remove("LOBELIA_LOG").output().unwrap()
}

/// `passes` of a good graph, to be spoiled.
const GOOD: &str = r#""gbuffer": gbuffer(), "rsm": rsm(resolution: 64), "lights": vpl_lights(count: 64), "visibility": visibility(), "direct": direct(),
    "indirect": vpl_gather(), "sum": compose(from: {"terms": ["direct.radiance", "indirect.radiance"]}), "tonemap": tonemap(from: {"radiance": "sum.radiance"}),"#;

fn graph(passes: &str) -> String {
    format!("(\n  passes: {{\n    {passes}\n  }},\n  output: \"tonemap.image\",\n)\n")
}

/// A triangle without a light.
const UNLIT: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

struct Row {
    name: &'static str,
    /// Text of `g.ron`; empty: none is written.
    graph: String,
    /// Text of `s.ron`; empty: none is written.
    scene: &'static str,
    arguments: &'static str,
    code: i32,
    says: &'static [&'static str],
}

fn on_graph(name: &'static str, graph: String, says: &'static [&'static str]) -> Row {
    Row { name, graph, scene: "", arguments: "check g.ron", code: 2, says }
}

fn on_passes(name: &'static str, passes: &str, says: &'static [&'static str]) -> Row {
    on_graph(name, graph(passes), says)
}

fn on_arguments(name: &'static str, arguments: &'static str, says: &'static [&'static str]) -> Row {
    Row { name, graph: graph(GOOD), scene: "", arguments, code: 2, says }
}

fn on_scene(name: &'static str, scene: &'static str, says: &'static [&'static str]) -> Row {
    Row { name, graph: String::new(), scene, arguments: "scene-info s.ron", code: 2, says }
}

fn rows() -> Vec<Row> {
    let with = |extra: &str| format!("{GOOD}\n    {extra}");
    let spoiled = |from: &str, to: &str| {
        assert!(GOOD.contains(from), "{from}");
        GOOD.replace(from, to)
    };
    let mut rows = vec![
        // Files and syntax.
        on_graph("syntax", "(\n  passes: {\n    \"a\": gbuffer(,\n  },\n)".into(), &["g.ron:3:"]),
        on_graph("empty", " ".into(), &["g.ron:1:"]),
        on_graph("cut off", "(passes: {\"a\": gbuffer()".into(), &["g.ron:1:"]),
        on_arguments("missing graph", "check missing.ron", &["missing.ron", "cannot read the graph"]),
        on_arguments("folder as graph", "check .", &["cannot read the graph"]),
        on_graph(
            "unknown section",
            "(passes: {}, outputs: \"a\")".into(),
            &["g.ron:1:14", "no section `outputs`", "did you mean `output`?"],
        ),
        on_graph("no passes", "(output: \"a.b\")".into(), &["the graph has no `passes`"]),
        on_graph("no output", "(passes: {\"a\": gbuffer()})".into(), &["does not say what its `output` is"]),
        on_graph(
            "duplicate section",
            "(passes: {}, passes: {}, output: \"a\")".into(),
            &["duplicate section `passes`", "first written here"],
        ),
        // Passes and parameters.
        on_passes(
            "unknown kind",
            &spoiled("gbuffer()", "gbufer()"),
            &["g.ron:3:16", "pass `gbuffer`", "no kind of pass is called `gbufer`", "did you mean `gbuffer`?"],
        ),
        on_passes("no kind", &spoiled("gbuffer()", "(size: 2)"), &["g.ron:3:16", "pass `gbuffer` has no kind"]),
        on_passes(
            "unknown parameter",
            &spoiled("resolution: 64", "resolutoin: 64"),
            &["g.ron:3:38", "(rsm) has no parameter `resolutoin`", "did you mean `resolution`?"],
        ),
        on_passes("parameter of a pass without any", &spoiled("gbuffer()", "gbuffer(size: 3)"), &["`gbuffer` has no parameters"]),
        on_passes(
            "wrong type",
            &spoiled("resolution: 64", "resolution: \"big\""),
            &["g.ron:3:50", "`resolution` cannot be \"big\"", "texels", "[16, 4096]"],
        ),
        on_passes("fraction for an integer", &spoiled("count: 64", "count: 1.5"), &["`count` cannot be 1.5"]),
        on_passes(
            "out of range",
            &spoiled("resolution: 64", "resolution: 8"),
            &["g.ron:3:50", "`resolution` is 8, but must lie in [16, 4096]"],
        ),
        on_passes("negative", &spoiled("count: 64", "count: -3"), &["`count` cannot be -3"]),
        on_passes("nan", &spoiled("tonemap(", "tonemap(exposure: NaN, "), &["`exposure` is NaN, but must lie in [-32.0, 32.0]"]),
        on_passes("infinity", &spoiled("vpl_gather()", "vpl_gather(clamp: inf)"), &["`clamp` is inf"]),
        on_passes("unknown choice", &spoiled("tonemap(", "tonemap(curve: filmic, "), &["`curve` cannot be filmic", "aces, agx or none"]),
        on_passes("duplicate pass", &with("\"gbuffer\": gbuffer(),"), &["duplicate pass `gbuffer`", "first written here"]),
        on_passes(
            "duplicate parameter",
            &spoiled("resolution: 64", "resolution: 64, resolution: 32"),
            &["duplicate parameter `resolution`"],
        ),
        on_passes("positional parameter", &spoiled("rsm(resolution: 64)", "rsm(64)"), &["g.ron:3:"]),
        // Wiring.
        on_passes(
            "unknown port",
            &spoiled("{\"radiance\"", "{\"radience\""),
            &["pass `tonemap` (tonemap) has no input port `radience`", "did you mean `radiance`?"],
        ),
        on_passes(
            "unknown source",
            &spoiled("\"sum.radiance\"", "\"som.radiance\""),
            &["port `radiance: Radiance`: there is no `som.radiance`", "did you mean `sum`?"],
        ),
        on_passes(
            "unknown source port",
            &spoiled("\"sum.radiance\"", "\"sum.radiant\""),
            &["there is no `sum.radiant`", "did you mean `sum.radiance`?"],
        ),
        on_passes(
            "wrong type on an edge",
            &spoiled("\"sum.radiance\"", "\"gbuffer.gbuffer\""),
            &["g.ron:4:", "port `radiance`: expected Radiance, but `gbuffer.gbuffer` is GBuffer", "`sum.radiance`"],
        ),
        on_passes(
            "required and empty",
            &spoiled("\"sum.radiance\"", "[]"),
            &["port `radiance: Radiance`", "is required and cannot be left empty"],
        ),
        on_passes(
            "two for one",
            &spoiled("\"sum.radiance\"", "[\"sum.radiance\", \"direct.radiance\"]"),
            &["takes one producer, not several"],
        ),
        on_passes(
            "ambiguous",
            &spoiled("tonemap(from: {\"radiance\": \"sum.radiance\"})", "tonemap()"),
            &[
                "port `radiance: Radiance` is ambiguous",
                "`direct.radiance`, `indirect.radiance`, `sum.radiance`",
                "from: {\"radiance\": \"direct.radiance\"}",
            ],
        ),
        on_passes(
            "nothing makes it",
            &spoiled("\"gbuffer\": gbuffer(), ", ""),
            &["is not connected: nothing in this graph makes a GBuffer", "add a pass that makes a GBuffer: gbuffer"],
        ),
        on_passes(
            "cycle",
            &with("\"a\": compose(from: {\"terms\": \"b\"}), \"b\": compose(from: {\"terms\": \"a\"}),"),
            &["passes `a`, `b` wait for each other in a cycle", "history"],
        ),
        on_passes("self", &with("\"a\": compose(from: {\"terms\": \"a\"}),"), &["pass `a` reads its own output"]),
        on_graph(
            "unknown output",
            graph(GOOD).replace("tonemap.image", "tonemap.imaje"),
            &["output: there is no `tonemap.imaje`", "did you mean `tonemap.image`?"],
        ),
        on_graph("unknown output pass", graph(GOOD).replace("tonemap.image", "tonmap.image"), &["did you mean `tonemap`?"]),
        on_passes(
            "several at once",
            &spoiled("gbuffer()", "gbufer()").replace("resolution: 64", "resolution: 1"),
            &["gbufer", "`resolution` is 1", "2 problems"],
        ),
        // Variants.
        on_graph(
            "variant of no pass",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"shadow\": rsm()}}, output:"),
            &["variant `v` names no pass: the graph has no `shadow` to replace"],
        ),
        on_graph(
            "mistake in a variant",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"rsm\": rsm(resolution: 3)}}, output:"),
            &["`resolution` is 3"],
        ),
        on_graph(
            "duplicate variant",
            graph(GOOD).replace("output:", "variants: {\"v\": {}, \"v\": {}}, output:"),
            &["duplicate variant `v`"],
        ),
        on_arguments(
            "unknown variant",
            "explain GRAPHS/indirect.ron --variant no-visibilty",
            &["no variant is called `no-visibilty`", "did you mean `no-visibility`?"],
        ),
        // The command line.
        on_arguments("malformed --set", "explain g.ron --set lights=3", &["PASS.PARAM=VALUE"]),
        on_arguments(
            "--set of no pass",
            "explain g.ron --set light.count=3",
            &["--set light.count", "has no pass `light`", "did you mean `lights`?"],
        ),
        on_arguments("--set of no parameter", "explain g.ron --set lights.cuont=3", &["has no parameter `cuont`", "did you mean `count`?"]),
        on_arguments("--set of no value", "explain g.ron --set lights.count=many", &["`many` is not a value for it", "[1, 65536]"]),
        on_arguments("--set out of range", "explain g.ron --set lights.count=0", &["--set lights.count", "`count` is 0"]),
        on_arguments("--size", "render g.ron --size 0x10 -o a.png", &["each side must lie in [1, 8192]"]),
        on_arguments("--size without x", "render g.ron --size 10 -o a.png", &["WIDTHxHEIGHT"]),
        on_arguments("--samples 0", "render g.ron --samples 0 -o a.png", &["--samples"]),
        on_arguments("--ndf", "render g.ron --ndf beckmann -o a.png", &["neither ggx nor phong"]),
        on_arguments("--time nan", "render g.ron --time NaN -o a.png", &["--time is NaN, but must be finite"]),
        on_arguments("no goal", "render g.ron", &["--output"]),
        on_arguments("unknown ending", "render g.ron -o a.jpg", &["a.jpg", ".png, .exr"]),
        on_arguments("missing folder", "render g.ron -o nowhere/a.png", &["nowhere/a.png", "does not exist"]),
        on_arguments("malformed --save", "render g.ron --save direct.radiance", &["PASS.PORT=FILE"]),
        on_arguments(
            "unknown --save",
            "render g.ron --save direct.radience=a.exr",
            &["there is no `direct.radience`", "did you mean `direct.radiance`?"],
        ),
        on_arguments("wrong ending for a type", "render g.ron --save lights.lights=a.exr", &["a.exr", ".npz"]),
        on_arguments("unknown camera", "render g.ron --camera mian -o a.png", &["no camera is called `mian`", "did you mean `main`?"]),
        on_arguments("unknown pass to describe", "passes gbufer", &["no pass is called `gbufer`; did you mean `gbuffer`?"]),
        // Graph and scene together.
        on_arguments(
            "pruned output",
            "explain g.ron --scene unlit.gltf --keep direct.radiance",
            &["does not make `direct.radiance`: pass `direct` is left out because the scene has no point, spot or directional light"],
        ),
        on_arguments(
            "interleaving that does not match",
            "explain g.ron --set visibility.interleave=4",
            &["pass `indirect` (vpl-gather), port `visibility`", "interleaved 4 x 4", "set interleave of the visibility pass to 1"],
        ),
        on_arguments(
            "too many bits",
            "explain g.ron --set lights.count=65536 --size 4000x2000",
            &["pass `visibility`", "MiB", "fewer lights"],
        ),
        // Scenes.
        on_arguments(
            "unknown builtin",
            "scene-info builtin:cornel-glossy",
            &["no built-in scene is called `cornel-glossy`", "did you mean `cornell-glossy`?"],
        ),
        on_arguments("missing scene", "scene-info nowhere.glb", &["nowhere.glb: cannot be read"]),
        on_arguments("unknown kind of scene", "scene-info g.obj", &["g.obj: not a scene", ".glb, .gltf or .ron"]),
        on_arguments("no glTF", "scene-info text.glb", &["text.glb", "glTF"]),
        on_scene("RON scene syntax", "(gltf: \"builtin:spheres\",\n  ndf: )", &["s.ron:2:"]),
        on_scene("RON scene field", "(gltf: \"builtin:spheres\", lihgts: {})", &["s.ron:1:", "lihgts", "did you mean `lights`?"]),
        on_scene(
            "RON scene material",
            "(gltf: \"builtin:cornell-glossy\",\n materials: {\"wite\": (roughness: 0.5)})",
            &["s.ron:2:", "no material is called `wite`", "did you mean `white`?"],
        ),
        on_scene(
            "RON scene range",
            "(gltf: \"builtin:cornell-glossy\",\n materials: {\"white\": (roughness: 1.5)})",
            &["s.ron:2:", "roughness is 1.5, but must lie in [0, 1]"],
        ),
        on_scene("RON scene of nothing", "(gltf: \"nowhere.glb\")", &["nowhere.glb"]),
    ];
    rows.push(Row {
        name: "unknown adapter",
        graph: graph(GOOD),
        scene: "",
        arguments: "render g.ron --size 8x8 --adapter no-such-device -o a.png",
        code: 1,
        says: &["no Vulkan, Metal or DX12 adapter was found whose name contains `no-such-device`"],
    });
    rows
}

#[test]
fn every_row_ends_in_its_message_and_exit_code() {
    let rows = rows();
    assert!(rows.len() >= 40, "{}", rows.len());
    let mut failures = Vec::new();
    for row in &rows {
        let folder = tempfile::tempdir().unwrap();
        let mut before = vec!["unlit.gltf", "text.glb"];
        std::fs::write(folder.path().join("unlit.gltf"), UNLIT).unwrap();
        std::fs::write(folder.path().join("text.glb"), "this is no scene").unwrap();
        for (name, text) in [("g.ron", row.graph.as_str()), ("s.ron", row.scene)] {
            if !text.is_empty() {
                std::fs::write(folder.path().join(name), text).unwrap();
                before.push(name);
            }
        }
        let output = run(folder.path(), row.arguments);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        let mut complain = |what: String| failures.push(format!("{}: {what}\n{errors}", row.name));
        if output.status.code() != Some(row.code) {
            complain(format!("exit code {:?}, not {}", output.status.code(), row.code));
        }
        for words in row.says {
            if !errors.contains(words) {
                complain(format!("does not say `{words}`"));
            }
        }
        if errors.contains("panicked") {
            complain("it panicked".into());
        }
        for entry in std::fs::read_dir(folder.path()).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            if !before.contains(&name.as_str()) {
                complain(format!("left `{name}` behind"));
            }
        }
    }
    assert!(failures.is_empty(), "{} of {} rows\n\n{}", failures.len(), rows.len(), failures.join("\n\n"));
}

/// So that the table can fail: what is good passes.
#[test]
fn good_input_is_good() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("g.ron"), graph(GOOD)).unwrap();
    for arguments in [
        "check g.ron GRAPHS/direct.ron GRAPHS/indirect.ron --scene builtin:spheres",
        "explain g.ron",
        "passes",
        "passes vpl_gather",
        "scene-info builtin:spheres --json",
        "completions bash",
    ] {
        let output = run(folder.path(), arguments);
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(!output.stdout.is_empty(), "{arguments}");
    }
}
