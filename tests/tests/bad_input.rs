//! Bad input to the program: each row must end in its message and its exit code, without a panic and without a file left behind.
#![allow(clippy::unwrap_used)]

use lobelia_tests::program;
use std::{
    path::Path,
    process::{Command, Output},
    sync::atomic::{AtomicUsize, Ordering},
};

fn run(folder: &Path, arguments: &str) -> Output {
    let graphs = lobelia_tests::root().join("graphs");
    let arguments = arguments.split_whitespace().map(|word| word.replace("GRAPHS", &graphs.display().to_string()));
    Command::new(program()).args(arguments).current_dir(folder).env_remove("LOBELIA_LOG").output().unwrap()
}

/// `passes` of a good graph, to be spoiled.
const GOOD: &str = r#""gbuffer": gbuffer(), "rsm": rsm(resolution: 64), "lights": vpl_lights(count: 64), "visibility": visibility(), "direct": direct(),
    "indirect": vpl_gather(), "sum": compose(from: {"terms": ["direct.radiance", "indirect.radiance"]}), "tonemap": tonemap(from: {"radiance": "sum.radiance"}), "density": flux_density(),"#;

fn graph(passes: &str) -> String {
    format!("(\n  passes: {{\n    {passes}\n  }},\n  output: \"tonemap.image\",\n)\n")
}

/// A triangle without a light.
const UNLIT: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],"bufferViews":[{"buffer":0,"byteLength":36}],
    "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

/// What a clone without Git LFS has in a file's place.
const POINTER: &str = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 7\n";

/// Files that lie in the folder of every row.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    // The header of a GLB that ends before the 4000 bytes it promises.
    let cut =
        [&b"glTF"[..], &2u32.to_le_bytes(), &4000u32.to_le_bytes(), &900u32.to_le_bytes(), b"JSON", &UNLIT.as_bytes()[..100]].concat();
    let spoiled = |from: &str, to: &str| {
        assert!(UNLIT.contains(from), "{from}");
        UNLIT.replace(from, to).into_bytes()
    };
    vec![
        ("unlit.gltf", UNLIT.into()),
        ("text.glb", b"this is no scene".to_vec()),
        ("cut.glb", cut),
        ("header.glb", b"glTF\x02".to_vec()),
        ("empty.gltf", Vec::new()),
        ("short.gltf", spoiled("\"count\":3", "\"count\":300")),
        ("index.gltf", spoiled("\"mesh\":0", "\"mesh\":7")),
        // The x of the first vertex as the bits 0x7fc00000.
        ("nan.gltf", spoiled("base64,AAAAAAAA", "base64,AADAfwAA")),
        ("buffer.gltf", spoiled("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA", "nowhere.bin")),
        ("clay.gltf", spoiled("\"scenes\"", "\"extensionsRequired\":[\"ACME_clay\"],\"scenes\"")),
        ("pointer.glb", POINTER.into()),
        ("pointer.ron", POINTER.into()),
        ("pointer.exr", POINTER.into()),
        ("page.ron", b"<!DOCTYPE html>".to_vec()),
        ("wide.ron", "\u{feff}(passes: {})".encode_utf16().flat_map(u16::to_le_bytes).collect()),
        ("marked.ron", "\u{feff}(passes: {},\noutputs: 1)".into()),
        ("bytes.ron", b"(\n  passes: {\"g\xff\": gbuffer()},\n)".to_vec()),
        ("nothing.ron", Vec::new()),
        ("gbuffer.ron", b"(passes: {\"a\": gbuffer()}, output: \"a.gbuffer\")".to_vec()),
    ]
}

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
        on_graph("syntax", "(\n  passes: {\n    \"a\": gbuffer(,\n  },\n)".into(), &["g.ron:3:18"]),
        on_arguments("empty", "check nothing.ron", &["nothing.ron: cannot read the graph: the file is empty"]),
        on_graph("only a comment", "// nothing\n".into(), &["g.ron:1:", "Unexpected end of RON"]),
        on_graph("cut off", "(passes: {\"a\": gbuffer()".into(), &["g.ron:1:"]),
        on_arguments("not UTF-8", "check bytes.ron", &["bytes.ron:2:14: a graph is UTF-8 text, but this byte is not"]),
        on_graph("a list", "[1, 2]".into(), &["g.ron:1:1: Expected named values", "found a sequence"]),
        on_graph("text behind the end", format!("{}x", graph(GOOD)), &["g.ron:7:2: Non-whitespace trailing characters"]),
        on_graph("brackets without end", format!("(passes: {}", "[".repeat(10_000)), &["g.ron:1:", "brackets are nested too deeply"]),
        on_graph("list of passes", "(passes: [gbuffer()], output: \"a\")".into(), &["g.ron:1:10: Expected named values"]),
        on_graph(
            "no pass at all",
            "(passes: {}, output: \"a.b\")".into(),
            &["g.ron:1:22: output: there is no `a.b`", "the graph has no passes"],
        ),
        on_graph("output that is no name", "(passes: {\"a\": gbuffer()}, output: 3)".into(), &["g.ron:1:36: Expected string"]),
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
            &["g.ron:1:14: duplicate section `passes`", "first written here"],
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
        on_passes(
            "pass as text",
            &spoiled("gbuffer()", "\"gbuffer\""),
            &["g.ron:3:16: pass `gbuffer` has no kind", "\"name\": gbuffer(...)"],
        ),
        on_passes("pass without a name", &with("\"\": gbuffer(),"), &["g.ron:5:", "a pass needs a name"]),
        on_passes("dot in a name", &with("\"a.b\": gbuffer(),"), &["g.ron:5:6: a pass cannot be called `a.b`"]),
        on_passes("parameter of a pass without any", &spoiled("gbuffer()", "gbuffer(size: 3)"), &["`gbuffer` has no parameters"]),
        on_passes(
            "wrong type",
            &spoiled("resolution: 64", "resolution: \"big\""),
            &["g.ron:3:50", "`resolution` cannot be \"big\"", "texels", "[16, 4096]"],
        ),
        on_passes(
            "fraction for an integer",
            &spoiled("count: 64", "count: 1.5"),
            &["g.ron:3:83", "`count` cannot be 1.5: Expected integer", "[1, 65536]"],
        ),
        on_passes(
            "out of range",
            &spoiled("resolution: 64", "resolution: 8"),
            &["g.ron:3:50", "`resolution` is 8, but must lie in [16, 4096]"],
        ),
        on_passes(
            "negative",
            &spoiled("count: 64", "count: -3"),
            &["g.ron:3:83", "`count` cannot be -3: Integer is out of bounds", "[1, 65536]"],
        ),
        on_passes(
            "negative number",
            &spoiled("vpl_gather()", "vpl_gather(clamp: -1.0)"),
            &["g.ron:4:35", "`clamp` is -1, but must lie in [0.0, infinity)"],
        ),
        on_passes(
            "more than an integer holds",
            &spoiled("count: 64", "count: 99999999999999999999"),
            &["g.ron:3:83", "Integer is out of bounds"],
        ),
        on_passes("more than a float holds", &spoiled("tonemap(", "tonemap(exposure: 1e400, "), &["g.ron:4:135", "`exposure` is inf"]),
        on_passes(
            "neither number nor none",
            &spoiled("vpl_gather()", "vpl_gather(clamp: nothing)"),
            &["g.ron:4:35", "expected a number or the word `none`"],
        ),
        on_passes(
            "nan",
            &spoiled("tonemap(", "tonemap(exposure: NaN, "),
            &["g.ron:4:135: pass `tonemap`: `exposure` is NaN, but must lie in [-32.0, 32.0]"],
        ),
        on_passes(
            "infinity",
            &spoiled("vpl_gather()", "vpl_gather(clamp: inf)"),
            &["g.ron:4:35: pass `indirect`: `clamp` is inf, but must lie in [0.0, infinity)"],
        ),
        on_passes(
            "negative infinity",
            &spoiled("tonemap(", "tonemap(exposure: -inf, "),
            &["g.ron:4:135", "`exposure` is -inf, but must lie in [-32.0, 32.0]"],
        ),
        on_graph(
            "value on a line of its own",
            "(\n  passes: {\n    \"rsm\": rsm(\n      resolution:\n        \"big\",\n    ),\n  },\n  output: \"rsm.rsm\",\n)".into(),
            &["g.ron:5:9: pass `rsm`: `resolution` cannot be \"big\": Expected integer"],
        ),
        on_graph(
            "name that a comment repeats",
            "(passes: {\"rsm\": rsm(/* resolutoin */ resolutoin: /* resolutoin */ 64)}, output: \"rsm\")".into(),
            &["g.ron:1:39: pass `rsm` (rsm) has no parameter `resolutoin`"],
        ),
        on_graph(
            "columns count characters",
            "(passes: {\"gbüffer→\": gbufer()}, output: \"a\")".into(),
            &["g.ron:1:23: pass `gbüffer→`", "did you mean `gbuffer`?"],
        ),
        on_graph(
            "lines of another system",
            graph("\"a\": gbufer(),").replace('\n', "\r\n"),
            &["g.ron:3:10: pass `a`", "did you mean `gbuffer`?"],
        ),
        on_passes("unknown choice", &spoiled("tonemap(", "tonemap(curve: filmic, "), &["`curve` cannot be filmic", "aces, agx or none"]),
        on_passes("duplicate pass", &with("\"gbuffer\": gbuffer(),"), &["g.ron:5:6: duplicate pass `gbuffer`", "first written here"]),
        on_passes(
            "duplicate parameter",
            &spoiled("resolution: 64", "resolution: 64, resolution: 32"),
            &["g.ron:3:54: duplicate parameter `resolution`", "first written here"],
        ),
        on_passes("positional parameter", &spoiled("rsm(resolution: 64)", "rsm(64)"), &["g.ron:3:", "Expected"]),
        // Wiring.
        on_passes(
            "unknown port",
            &spoiled("{\"radiance\"", "{\"radience\""),
            &["g.ron:4:133: pass `tonemap` (tonemap) has no input port `radience`", "did you mean `radiance`?"],
        ),
        on_passes(
            "port of a pass without inputs",
            &spoiled("gbuffer()", "gbuffer(from: {\"depth\": \"rsm\"})"),
            &["g.ron:3:32: pass `gbuffer` (gbuffer) has no input port `depth`", "`gbuffer` has no inputs"],
        ),
        on_passes(
            "wires as a list",
            &spoiled("{\"radiance\": \"sum.radiance\"}", "[\"sum.radiance\"]"),
            &["g.ron:4:131: Expected named values"],
        ),
        on_passes("source that is no name", &spoiled("\"sum.radiance\"", "3"), &["g.ron:4:144: Expected string"]),
        on_passes(
            "port wired twice",
            &spoiled("\"radiance\": \"sum.radiance\"", "\"radiance\": \"sum.radiance\", \"radiance\": \"direct.radiance\""),
            &["g.ron:4:161: duplicate port `radiance`", "first written here"],
        ),
        on_passes(
            "source unlike any pass",
            &spoiled("\"sum.radiance\"", "\"nothing\""),
            &["g.ron:4:144: pass `tonemap`, port `radiance: Radiance`: there is no `nothing`", "the passes are gbuffer, rsm, lights"],
        ),
        on_passes(
            "unknown source",
            &spoiled("\"sum.radiance\"", "\"som.radiance\""),
            &["g.ron:4:144: pass `tonemap`, port `radiance: Radiance`: there is no `som.radiance`", "did you mean `sum`?"],
        ),
        on_passes(
            "unknown source port",
            &spoiled("\"sum.radiance\"", "\"sum.radiant\""),
            &["g.ron:4:144:", "there is no `sum.radiant`", "did you mean `sum.radiance`?"],
        ),
        on_passes(
            "wrong type on an edge",
            &spoiled("\"sum.radiance\"", "\"gbuffer.gbuffer\""),
            &["g.ron:4:144: pass `tonemap`, port `radiance`: expected Radiance, but `gbuffer.gbuffer` is GBuffer", "`sum.radiance`"],
        ),
        on_passes(
            "required and empty",
            &spoiled("\"sum.radiance\"", "[]"),
            &["g.ron:4:133: pass `tonemap`, port `radiance: Radiance`: it is required and cannot be left empty"],
        ),
        on_passes("required and none", &spoiled("\"sum.radiance\"", "none"), &["g.ron:4:133", "is required and cannot be left empty"]),
        on_passes(
            "two for one",
            &spoiled("\"sum.radiance\"", "[\"sum.radiance\", \"direct.radiance\"]"),
            &["g.ron:4:133: pass `tonemap`, port `radiance: Radiance`: it takes one producer, not several"],
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
            &[
                "g.ron:3:67: pass `visibility` (visibility), port `gbuffer: GBuffer` is not connected: nothing in this graph makes a GBuffer",
                "add a pass that makes a GBuffer: gbuffer",
            ],
        ),
        on_passes(
            "cycle",
            &with("\"a\": compose(from: {\"terms\": \"b\"}), \"b\": compose(from: {\"terms\": \"a\"}),"),
            &["g.ron:5:6: passes `a`, `b` wait for each other in a cycle", "history"],
        ),
        on_passes("self", &with("\"a\": compose(from: {\"terms\": \"a\"}),"), &["g.ron:5:6: pass `a` reads its own output", "history"]),
        on_graph(
            "unknown output",
            graph(GOOD).replace("tonemap.image", "tonemap.imaje"),
            &["g.ron:6:11: output: there is no `tonemap.imaje`", "did you mean `tonemap.image`?"],
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
            &["g.ron:6:21: variant `v` names no pass: the graph has no `shadow` to replace"],
        ),
        on_graph(
            "mistake in a variant",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"rsm\": rsm(resolution: 3)}}, output:"),
            &["g.ron:6:43: variant `v`: pass `rsm`: `resolution` is 3, but must lie in [16, 4096]"],
        ),
        // The fault shows in a pass that is good without the variant.
        on_graph(
            "variant that takes away too much",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"gbuffer\": none}}, output:"),
            &["g.ron:3:89: variant `v`: pass `visibility` (visibility), port `gbuffer: GBuffer` is not connected"],
        ),
        on_graph(
            "variant that takes away the output",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"tonemap\": none}}, output:"),
            &["g.ron:6:47: variant `v`: output: there is no `tonemap.image`"],
        ),
        on_graph(
            "variant of another type",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"indirect\": visibility()}}, output:"),
            &["g.ron:4:82: variant `v`: pass `sum`, port `terms: Radiance`: there is no `indirect.radiance`", "`indirect.visibility`"],
        ),
        on_graph(
            "pass twice in a variant",
            graph(GOOD).replace("output:", "variants: {\"v\": {\"rsm\": rsm(), \"rsm\": none}}, output:"),
            &["g.ron:6:35: duplicate pass `rsm`"],
        ),
        on_graph(
            "duplicate variant",
            graph(GOOD).replace("output:", "variants: {\"v\": {}, \"v\": {}}, output:"),
            &["g.ron:6:24: duplicate variant `v`", "first written here"],
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
        on_arguments(
            "--set out of range",
            "explain g.ron --set lights.count=0",
            &["--set lights.count", "`count` is 0, but must lie in [1, 65536]"],
        ),
        on_arguments("--set of nothing", "explain g.ron --set lights.count=", &["PASS.PARAM=VALUE"]),
        on_arguments(
            "--set of two",
            "explain g.ron --set lights.count=64,seed:5",
            &["--set lights.count: `64,seed:5` is not a value for it"],
        ),
        on_arguments(
            "--set fraction",
            "explain g.ron --set lights.count=1.5",
            &["--set lights.count: `1.5` is not a value for it: Expected integer"],
        ),
        on_arguments(
            "--set nan",
            "explain g.ron --set indirect.clamp=NaN",
            &["--set indirect.clamp", "`clamp` is NaN, but must lie in [0.0, infinity)"],
        ),
        on_arguments("--set negative", "explain g.ron --set lights.seed=-1", &["--set lights.seed: `-1` is not a value for it"]),
        on_arguments("--size", "render g.ron --size 0x10 -o a.png", &["each side must lie in [1, 8192]"]),
        on_arguments("--size without x", "render g.ron --size 10 -o a.png", &["WIDTHxHEIGHT"]),
        on_arguments("--size of a line", "render g.ron --size 9999999x1 -o a.png", &["each side must lie in [1, 8192]"]),
        on_arguments("--size of three", "render g.ron --size 1x1x1 -o a.png", &["WIDTHxHEIGHT"]),
        on_arguments("--samples -1", "render g.ron --samples -1 -o a.png", &["--samples", "-1 is not in 1..=1000000"]),
        on_arguments("--frames 0", "render g.ron --frames 0 -o a.png", &["--frames", "0 is not in 1..=1000000"]),
        on_arguments("--time inf", "render g.ron --time=-inf -o a.png", &["--time is -inf, but must be finite"]),
        on_arguments("--profile nowhere", "render g.ron --profile nowhere/a.json -o a.png", &["the folder nowhere does not exist"]),
        on_arguments(
            "two results for one file",
            "render g.ron --save direct.radiance=a.png -o a.png",
            &["a.png: two results cannot be written to one file"],
        ),
        on_arguments(
            "no picture",
            "render gbuffer.ron -o a.png",
            &["the graph's output `a.gbuffer` is GBuffer, not a picture", "--save a.gbuffer=FILE.npz"],
        ),
        on_arguments("--samples 0", "render g.ron --samples 0 -o a.png", &["--samples"]),
        on_arguments("--ndf", "render g.ron --ndf beckmann -o a.png", &["neither ggx nor phong"]),
        on_arguments("--time nan", "render g.ron --time NaN -o a.png", &["--time is NaN, but must be finite"]),
        on_arguments("no goal", "render g.ron", &["--output"]),
        on_arguments("unknown ending", "render g.ron -o a.jpg", &["a.jpg: this cannot be written in that format", ".png, .exr"]),
        on_arguments("missing folder", "render g.ron -o nowhere/a.png", &["nowhere/a.png", "does not exist"]),
        on_arguments("malformed --save", "render g.ron --save direct.radiance", &["PASS.PORT=FILE"]),
        on_arguments(
            "unknown --save",
            "render g.ron --save direct.radience=a.exr",
            &["there is no `direct.radience`", "did you mean `direct.radiance`?"],
        ),
        on_arguments(
            "wrong ending for a type",
            "render g.ron --save lights.lights=a.exr",
            &["a.exr: this cannot be written in that format", ".npz"],
        ),
        on_arguments("unknown camera", "render g.ron --camera mian -o a.png", &["no camera is called `mian`", "did you mean `main`?"]),
        on_arguments("unknown pass to describe", "passes gbufer", &["no pass is called `gbufer`; did you mean `gbuffer`?"]),
        // Graph and scene together.
        on_arguments(
            "pruned output",
            "explain g.ron --scene unlit.gltf --keep direct.radiance",
            &["does not make `direct.radiance`: pass `direct` is left out because the scene has no point, spot or directional light"],
        ),
        Row {
            name: "output that this scene does not make",
            graph: graph(GOOD).replace("tonemap.image", "direct.radiance"),
            scene: "",
            arguments: "render g.ron --scene unlit.gltf -o a.png",
            code: 2,
            says: &[
                "g.ron:6:11: this scene does not make `direct.radiance`: pass `direct` is left out because the scene has no point, spot or directional light",
                "choose another output or another scene",
            ],
        },
        on_arguments(
            "--save that this scene does not make",
            "render g.ron --scene unlit.gltf --save direct.radiance=a.exr",
            &["does not make `direct.radiance`"],
        ),
        on_arguments("too many pixels", "explain g.ron --size 8193x16", &["8193x16", "each side must lie in [1, 8192] pixels"]),
        on_arguments(
            "interleaving that does not match",
            "explain g.ron --set visibility.interleave=4",
            &["pass `indirect` (vpl-gather), port `visibility`", "interleaved 4 x 4", "set interleave of the visibility pass to 1"],
        ),
        on_arguments(
            "too many bits",
            "explain g.ron --set lights.count=65536 --size 4000x2000",
            &["g.ron:3:89: pass `visibility` (visibility): 65536 lights seen from 8000000 pixels", "MiB", "fewer lights"],
        ),
        // Scenes.
        on_arguments(
            "unknown builtin",
            "scene-info builtin:cornel-glossy",
            &["no built-in scene is called `cornel-glossy`", "did you mean `cornell-glossy`?"],
        ),
        on_arguments("missing scene", "scene-info nowhere.glb", &["nowhere.glb: cannot be read"]),
        on_arguments("unknown kind of scene", "scene-info g.obj", &["g.obj: not a scene", ".glb, .gltf or .ron"]),
        on_arguments("no glTF", "scene-info text.glb", &["text.glb: not a valid glTF 2.0 file"]),
        on_arguments("truncated GLB", "scene-info cut.glb", &["cut.glb: its header declares 4000 bytes, but the file has", "truncated"]),
        on_arguments(
            "GLB that ends in its header",
            "scene-info header.glb",
            &["header.glb: a GLB header has 12 bytes, but the file ends after 5"],
        ),
        on_arguments("empty glTF", "scene-info empty.gltf", &["empty.gltf: the file is empty"]),
        on_arguments("pointer as scene", "scene-info pointer.glb", &["pointer.glb: it is a Git LFS pointer, not the data of 7 bytes"]),
        on_arguments("pointer as graph", "check pointer.ron", &["pointer.ron: cannot read the graph: it is a Git LFS pointer"]),
        on_arguments("pointer as sweep", "sweep pointer.ron --report .", &["pointer.ron: it is a Git LFS pointer"]),
        on_arguments("web page as graph", "check page.ron", &["page.ron: cannot read the graph: it is a web page (HTML)"]),
        on_arguments("UTF-16 graph", "check wide.ron", &["wide.ron: cannot read the graph: it is UTF-16 text; save it as UTF-8"]),
        on_arguments("fault after a byte-order mark", "check marked.ron", &["marked.ron:2:1: ", "no section `outputs`"]),
        on_arguments(
            "unknown extension that is required",
            "scene-info clay.gltf",
            &["clay.gltf: it requires ACME_clay, which this program cannot read; `--allow-unsupported`"],
        ),
        on_arguments(
            "pointer as reference",
            "compare GRAPHS/direct.ron --scene unlit.gltf --size 8x8 --reference pointer.exr --report .",
            &["pointer.exr: it is a Git LFS pointer"],
        ),
        on_arguments(
            "layer of a reference that is no EXR",
            "compare GRAPHS/direct.ron --scene unlit.gltf --size 8x8 --reference text.glb#Beauty --report .",
            &["text.glb#Beauty: cannot be read as an OpenEXR or Radiance HDR picture: it is text that begins with `this is no scene`"],
        ),
        on_arguments(
            "glTF accessor",
            "scene-info short.gltf",
            &["short.gltf: accessor 0: 300 elements of 12 bytes do not fit into the 36 bytes"],
        ),
        on_arguments("glTF index", "scene-info index.gltf", &["index.gltf: not a valid glTF 2.0 file", "nodes[0].mesh"]),
        on_arguments("glTF position", "scene-info nan.gltf", &["nan.gltf: mesh 0, primitive 0: POSITION of vertex 0 is NaN"]),
        on_arguments("glTF buffer", "scene-info buffer.gltf", &["buffer.gltf: buffer 0: nowhere.bin: cannot be read"]),
        on_arguments("folder as scene", "scene-info .", &["not a scene"]),
        on_scene("RON scene syntax", "(gltf: \"builtin:spheres\",\n  ndf: )", &["s.ron:2:8"]),
        on_scene(
            "RON scene lobes",
            "(gltf: \"builtin:spheres\",\n  ndf: beckmann)",
            &["s.ron:2:8: Unexpected variant named `beckmann`", "ggx, phong"],
        ),
        on_scene("RON scene in itself", "(gltf: \"s.ron\")", &["s.ron:1:2: a RON scene wraps a glTF file or a built-in scene"]),
        on_scene(
            "RON scene light",
            "(gltf: \"builtin:spheres\",\n lights: {\"a\": point(position: (0,0,inf), intensity: (1,1,1))})",
            &["s.ron:2:22: light `a`: position is [0, 0, inf], but must be finite"],
        ),
        on_scene(
            "RON scene kind of light",
            "(gltf: \"builtin:spheres\",\n lights: {\"a\": pint(position: (0,0,0))})",
            &["s.ron:2:16:", "`pint`", "did you mean `point`?"],
        ),
        on_scene(
            "RON scene camera",
            "(gltf: \"builtin:spheres\",\n cameras: {\"a\": (origin: (0,0,0), target: (0,0,0))})",
            &["s.ron:2:35: camera `a`: target must differ from origin"],
        ),
        on_scene(
            "RON scene environment",
            "(gltf: \"builtin:spheres\",\n environment: (file: \"no.hdr\"))",
            &["s.ron:2:16: environment: no.hdr: cannot be read"],
        ),
        on_scene("RON scene field", "(gltf: \"builtin:spheres\", lihgts: {})", &["s.ron:1:", "lihgts", "did you mean `lights`?"]),
        on_scene(
            "RON scene material",
            "(gltf: \"builtin:cornell-glossy\",\n materials: {\"wite\": (roughness: 0.5)})",
            &["s.ron:2:", "no material is called `wite`", "did you mean `white`?"],
        ),
        on_scene(
            "RON scene range",
            "(gltf: \"builtin:cornell-glossy\",\n materials: {\"white\": (roughness: 1.5)})",
            &["s.ron:2:24: material `white`: roughness is 1.5, but must lie in [0, 1]"],
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

/// What is wrong with how the program takes a row; empty if nothing is.
fn complaints(row: &Row) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let mut files = files();
    for (name, text) in [("g.ron", row.graph.as_str()), ("s.ron", row.scene)] {
        if !text.is_empty() {
            files.push((name, text.into()));
        }
    }
    for (name, bytes) in &files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let output = run(folder.path(), row.arguments);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let mut found = Vec::new();
    if output.status.code() != Some(row.code) {
        found.push(format!("exit code {:?}, not {}", output.status.code(), row.code));
    }
    found.extend(row.says.iter().filter(|words| !errors.contains(**words)).map(|words| format!("does not say `{words}`")));
    if errors.contains("panicked") {
        found.push("it panicked".into());
    }
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        match files.iter().find(|(known, _)| *known == name) {
            Some((_, bytes)) if *bytes == std::fs::read(folder.path().join(&name)).unwrap() => {}
            Some(_) => found.push(format!("wrote to `{name}`")),
            None => found.push(format!("left `{name}` behind")),
        }
    }
    let shown: String = errors.chars().take(2000).collect();
    found.into_iter().map(|what| format!("{}: {what}\n{shown}", row.name)).collect()
}

#[test]
fn every_row_ends_in_its_message_and_exit_code() {
    let rows = rows();
    assert!(rows.len() >= 100, "{}", rows.len());
    for (index, row) in rows.iter().enumerate() {
        assert!(!row.says.is_empty() && rows[..index].iter().all(|earlier| earlier.name != row.name), "{}", row.name);
    }
    program();
    let next = AtomicUsize::new(0);
    let workers = std::thread::available_parallelism().map_or(2, usize::from).max(2);
    let work = || {
        let mine = std::iter::from_fn(|| rows.get(next.fetch_add(1, Ordering::Relaxed)));
        mine.flat_map(complaints).collect::<Vec<String>>()
    };
    let failures: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    });
    assert!(failures.is_empty(), "{} complaints about {} rows\n\n{}", failures.len(), rows.len(), failures.join("\n\n"));
}

/// The comparison itself must be able to fail: wrong exit code, missing words, a file left behind.
#[test]
fn the_table_complains_about_good_input() {
    let mut row = on_passes("good", GOOD, &["no such words"]);
    let found = complaints(&row).join("\n");
    assert!(found.contains("exit code Some(0), not 2") && found.contains("does not say `no such words`"), "{found}");
    (row.says, row.code) = (&[], 0);
    assert_eq!(complaints(&row), Vec::<String>::new());
}

/// So that the table can fail: what is good passes.
#[test]
fn good_input_is_good() {
    let folder = tempfile::tempdir().unwrap();
    // A comment behind a value, and a variant that only replaces.
    let good = GOOD.replace("resolution: 64", "resolution: 64 // texels\n");
    let good = graph(&good).replace("output:", "variants: {\"v\": {\"visibility\": none, \"rsm\": rsm()}}, output:");
    std::fs::write(folder.path().join("g.ron"), good).unwrap();
    std::fs::write(folder.path().join("marked.ron"), ["\u{feff}", &graph(GOOD)].concat()).unwrap();
    std::fs::write(folder.path().join("unlit.gltf"), UNLIT).unwrap();
    std::fs::write(folder.path().join("clay.gltf"), UNLIT.replace("\"scenes\"", "\"extensionsRequired\":[\"ACME_clay\"],\"scenes\""))
        .unwrap();
    for arguments in [
        "check g.ron GRAPHS/direct.ron GRAPHS/indirect.ron --scene builtin:spheres",
        "explain g.ron --variant v --set lights.count=32 --set indirect.clamp=none --time -1",
        "explain g.ron --scene unlit.gltf --keep sum",
        "check marked.ron --scene clay.gltf --allow-unsupported",
        "explain marked.ron --scene clay.gltf --allow-unsupported",
        "scene-info clay.gltf --allow-unsupported",
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
