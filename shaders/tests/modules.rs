//! Every module composes and validates alone, under every combination of its flags; errors say where.
#![allow(clippy::unwrap_used)]

use lobelia_shaders::{Composer, Flags, ShaderError, Source, modules};

const FLAGS: [&str; 24] = [
    "ANISOTROPIC",
    "SPECULAR",
    "DIELECTRIC",
    "UNLIT",
    "SECOND_UV",
    "VERTEX_COLOR",
    "TEXTURE_TRANSFORM",
    "NORMAL_MAP",
    "EMISSIVE",
    "NDF_PHONG",
    "NDF_BECKMANN",
    "LOBE_TOKSVIG",
    "LOBE_BANERJEE",
    "EDGE_PEAK",
    "EDGE_LORENTZIAN",
    "EDGE_ELLIPSOID",
    "EDGE_NODES_TWO",
    "EDGE_NODES_FOUR",
    "HALF_VECTOR_NODES_TWO",
    "HALF_VECTOR_NODES_FOUR",
    "HALF_VECTOR_NODES_SIX",
    "POLYGON_LIGHTS",
    "DISK_LIGHTS",
    "SPHERE_LIGHTS",
];

/// The flags that a module or anything that it imports looks at: no other changes it.
fn flags_of(source: &Source<'_>) -> Vec<&'static str> {
    let mut texts = vec![source.text];
    let mut seen = vec![import_path(source)];
    let mut next = 0;
    while next < texts.len() {
        for line in texts[next].lines().filter_map(|line| line.strip_prefix("#import ")) {
            let imported = modules().iter().find(|module| {
                let path = import_path(module);
                line == path || line.strip_prefix(path.as_str()).is_some_and(|rest| rest.starts_with("::"))
            });
            if let Some(module) = imported.filter(|module| !seen.contains(&import_path(module))) {
                seen.push(import_path(module));
                texts.push(module.text);
            }
        }
        next += 1;
    }
    let looks_at =
        |flag: &&&str| texts.iter().any(|text| text.lines().any(|line| line.starts_with("#if") && line.ends_with(&format!(" {flag}"))));
    FLAGS.iter().filter(looks_at).copied().collect()
}

/// An entry that imports all public names of a module by touching the module's path.
fn importing(path: &str) -> String {
    format!("#import {path}\n@compute @workgroup_size(1) fn main() {{}}\n")
}

fn import_path(source: &Source<'_>) -> String {
    let line = source.text.lines().find(|line| line.starts_with("#define_import_path")).unwrap();
    line.trim_start_matches("#define_import_path").trim().to_owned()
}

#[test]
fn every_module_is_valid_under_every_combination_of_flags() {
    let mut composer = Composer::new().unwrap();
    for source in modules() {
        // A module alone, with its functions kept by importing it as the entry's own text.
        let text = source.text.replace(&format!("#define_import_path {}", import_path(source)), "");
        let text = format!("{text}\n@compute @workgroup_size(1) fn main() {{}}\n");
        let looked_at = flags_of(source);
        assert!(looked_at.len() <= 10, "{} looks at {} flags: {looked_at:?}", source.path, looked_at.len());
        for bits in 0..1u32 << looked_at.len() {
            let mut flags = Flags::new();
            for (index, flag) in looked_at.iter().enumerate() {
                flags.set(flag, bits >> index & 1 == 1);
            }
            let composed = composer.compose(Source { path: source.path, text: &text }, &flags);
            if let Err(error) = composed {
                panic!("{} under {flags:?}: {error}", source.path);
            }
        }
        composer.compose(Source { path: "entry.wgsl", text: &importing(&import_path(source)) }, &Flags::new()).unwrap();
    }
}

#[test]
fn modules_hold_no_bindings_and_no_entry_points() {
    for source in modules() {
        for word in ["@group", "@binding", "@compute", "@vertex", "@fragment"] {
            assert!(!source.text.contains(word), "{} has {word}", source.path);
        }
    }
}

#[test]
fn the_list_of_modules_is_complete() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("lobelia");
    let mut files: Vec<String> =
        folder.read_dir().unwrap().map(|file| format!("shaders/lobelia/{}", file.unwrap().file_name().display())).collect();
    files.sort();
    let mut listed: Vec<&str> = modules().iter().map(|source| source.path).collect();
    listed.sort_unstable();
    assert_eq!(files, listed);
    for source in modules() {
        assert_eq!(import_path(source), source.path.trim_start_matches("shaders/").trim_end_matches(".wgsl").replace('/', "::"));
    }
}

#[test]
fn modules_test_only_known_flags_and_import_without_conditions() {
    for source in modules() {
        let mut depth = 0;
        for line in source.text.lines().map(str::trim) {
            if let Some(condition) = line.strip_prefix("#if") {
                depth += 1;
                let name = condition.trim_start_matches("def").trim_start_matches("ndef").trim();
                assert!(FLAGS.contains(&name), "{}: `{name}` is not among the flags that are tested", source.path);
            } else if line.starts_with("#endif") {
                depth -= 1;
            }
            assert!(!(line.starts_with("#import") && depth > 0), "{}: {line}", source.path);
        }
        assert_eq!(depth, 0, "{}", source.path);
    }
}

#[test]
fn bindings_structures_and_entry_points_keep_their_names() {
    let text = "#import lobelia::math::luminance\n\
        struct Totals_2 { layer_1: f32 }\n\
        @group(0) @binding(0) var source_radiance_1: texture_2d<f32>;\n\
        @group(0) @binding(1) var<storage, read_write> totals: Totals_2;\n\
        @group(0) @binding(2) var never_used: sampler;\n\
        @compute @workgroup_size(1) fn measure_2() { totals.layer_1 = luminance(textureLoad(source_radiance_1, vec2u(0u), 0).rgb); }\n";
    let composed = Composer::new().unwrap().compose(Source { path: "entry.wgsl", text }, &Flags::new()).unwrap();
    let names: Vec<_> = composed.module.global_variables.iter().filter_map(|(_, variable)| variable.name.clone()).collect();
    assert_eq!(names, ["source_radiance_1", "totals", "never_used"]);
    assert!(composed.module.types.iter().any(|(_, declared)| declared.name.as_deref() == Some("Totals_2")));
    assert_eq!(composed.module.entry_points[0].name, "measure_2");
    let used: Vec<bool> =
        composed.module.global_variables.iter().map(|(handle, _)| !composed.info.get_entry_point(0)[handle].is_empty()).collect();
    assert_eq!(used, [true, true, false]);
}

fn refusal(text: &str) -> ShaderError {
    Composer::new().unwrap().compose(Source { path: "crates/a/src/entry.wgsl", text }, &Flags::new()).unwrap_err()
}

/// Text, place, and what the message must hold.
const REFUSED: [(&str, (usize, usize), &str); 15] = [
    ("@compute @workgroup_size(1)\nfn main() {\n    let x = ;\n}\n", (3, 13), "expected expression"),
    ("@compute @workgroup_size(1)\nfn main() {\n    let x = nothing_here(1.0);\n}\n", (3, 13), "`nothing_here`"),
    ("@compute @workgroup_size(1)\nfn main() {\n    let x: vec3f = 1u + 2.0;\n}\n", (3, 9), "vec3<f32>"),
    // Imports: the unknown module, the unknown name in a known one, the forgotten one.
    (
        "// a\n#import lobelia::octahedra::octahedral_pack\n@compute @workgroup_size(1) fn main() { let a = octahedral_pack(vec3f(1.0)); }\n",
        (2, 9),
        "there is no module `lobelia::octahedra`; did you mean `lobelia::octahedral`?",
    ),
    (
        "#import lobelia::lumin::luminance\n@compute @workgroup_size(1) fn main() { let x = luminance(vec3f(1.0)); }\n",
        (1, 9),
        "there is no module `lobelia::lumin`",
    ),
    (
        "#import lobelia::math::luminanc\n@compute @workgroup_size(1) fn main() { let x = luminanc(vec3f(1.0)); }\n",
        (2, 49),
        "`lobelia::math::luminanc`; did you mean `lobelia::math::luminance`?",
    ),
    (
        "@compute @workgroup_size(1) fn main() { let x = luminance(vec3f(1.0)); }\n",
        (1, 49),
        "`#import lobelia::math::luminance` provides it",
    ),
    // The column counts what was written, though names before it were replaced by longer ones.
    (
        "#import lobelia::math::{PI, square}\n@compute @workgroup_size(1)\nfn main() {\n    let x = square(PI) + missing;\n}\n",
        (4, 26),
        "`missing`",
    ),
    ("#import lobelia::math\n@compute @workgroup_size(1)\nfn main() {\n    let x = math::PI + missing;\n}\n", (4, 24), "`missing`"),
    // Conditions neither move lines nor columns.
    (
        "#ifdef SPECULAR\nfn a() {}\n#else\nfn b() {}\n#endif\n@compute @workgroup_size(1)\nfn main() {\n    let x: u32 = 1.0;\n}\n",
        (8, 9),
        "u32",
    ),
    ("@compute @workgroup_size(1)\nfn main() {\n#if COUNT > 3u\n#endif\n}\n", (3, 1), "COUNT"),
    ("@compute @workgroup_size(1)\nfn main() {}\n\n#endif\n", (4, 1), "endif"),
    // Validation: a function, an entry point, two bindings in one place.
    (
        "\nfn wrong(x: f32) -> f32 {\n    if x > 0.0 { return 1.0; }\n}\n@compute @workgroup_size(1) fn main() { let x = wrong(1.0); }\n",
        (2, 1),
        "`return`",
    ),
    (
        "@group(0) @binding(0) var t: texture_2d<f32>;\n@group(0) @binding(1) var s: sampler;\n@compute @workgroup_size(1)\nfn main() {\n    let x = textureSample(t, s, vec2f(0.0));\n}\n",
        (4, 4),
        "forbidden at this stage",
    ),
    (
        "@group(0) @binding(0) var<uniform> a: f32;\n@group(0) @binding(0) var<uniform> b: f32;\n@compute @workgroup_size(1) fn main() { let c = a + b; }\n",
        (2, 23),
        "conflict",
    ),
];

#[test]
fn errors_say_where_and_what() {
    for (text, (line, column), what) in REFUSED {
        let error = refusal(text);
        let shown = error.to_string();
        assert!(shown.starts_with(&format!("crates/a/src/entry.wgsl:{line}:{column}: ")), "{text}\n{shown}");
        assert!(shown.contains(what), "`{what}` is not in: {shown}");
        assert!(!shown.contains("naga_oil"), "{shown}");
        // The mark stands under the column of the line as written.
        let (written, mark) = error.detail.split_once('\n').unwrap();
        assert!(written.ends_with(text.lines().nth(line - 1).unwrap()), "{shown}");
        assert_eq!(mark.find('^').unwrap() - mark.find("| ").unwrap(), column + 1, "{shown}");
    }
}

#[test]
fn optional_features_are_refused() {
    let f16 = "enable f16;\n@group(0) @binding(0) var<storage, read_write> a: array<f16>;\n@compute @workgroup_size(1) fn main() { a[0] = a[1]; }\n";
    assert!(refusal(f16).message.to_lowercase().contains("f16"), "{}", refusal(f16));
    let f64 = "@group(0) @binding(0) var<storage, read_write> a: array<f64>;\n@compute @workgroup_size(1) fn main() { a[0] = a[1]; }\n";
    assert!(refusal(f64).to_string().to_lowercase().contains("float64"), "{}", refusal(f64));
}

#[test]
fn errors_in_modules_say_where() {
    let entry = Source { path: "entry.wgsl", text: "#import mine::half\n@compute @workgroup_size(1) fn main() { let x = half(1.0); }\n" };
    let compose = |text: &str| {
        let mut composer = Composer::new().unwrap();
        composer.add_module(Source { path: "shaders/mine.wgsl", text })?;
        composer.compose(entry, &Flags::new())
    };
    let refused = [
        ("#define_import_path mine\nfn half(x: f32) -> f32 {\n    return x / ;\n}\n", (3, 16), "expected expression"),
        ("#define_import_path mine\n#import lobelia::math::PI\nfn half(x: f32) -> f32 {\n    return PI * y;\n}\n", (4, 17), "`y`"),
        ("#define_import_path mine\nfn half(x: f32) -> f32 {\n    if x > 0.0 { return 0.5 * x; }\n}\n", (2, 1), "`return`"),
        (
            "#define_import_path mine\n#import lobelia::maths::PI\nfn half(x: f32) -> f32 {\n    return PI * x;\n}\n",
            (2, 9),
            "did you mean `lobelia::math`?",
        ),
        ("#define_import_path mine\nfn half(x: f32) -> f32 {\n#ifdef SPECULAR\n    return 0.5 * x;\n}\n", (6, 1), "endif"),
    ];
    for (text, (line, column), what) in refused {
        let shown = compose(text).unwrap_err().to_string();
        assert!(shown.starts_with(&format!("shaders/mine.wgsl:{line}:{column}: ")), "{text}\n{shown}");
        assert!(shown.contains(what), "`{what}` is not in: {shown}");
    }
    assert!(compose("fn half(x: f32) -> f32 { return x; }\n").unwrap_err().to_string().contains("#define_import_path"));
    compose("#define_import_path mine\nfn half(x: f32) -> f32 {\n    return 0.5 * x;\n}\n").unwrap();
}

#[test]
fn a_module_can_be_replaced() {
    let entry = Source {
        path: "entry.wgsl",
        text: "#import mine::half\n@group(0) @binding(0) var<storage, read_write> out: f32;\n@compute @workgroup_size(1) fn main() { out = half(1.0); }\n",
    };
    let mut composer = Composer::new().unwrap();
    let wrong = Source { path: "shaders/mine.wgsl", text: "#define_import_path mine\nfn half(x: f32) -> f32 { return y; }\n" };
    composer.add_module(wrong).unwrap();
    composer.compose(entry, &Flags::new()).unwrap_err();
    composer
        .add_module(Source { path: "shaders/mine.wgsl", text: "#define_import_path mine\nfn half(x: f32) -> f32 { return 0.5 * x; }\n" })
        .unwrap();
    composer.compose(entry, &Flags::new()).unwrap();
    // And back: what was composed before is not what is remembered.
    composer.add_module(wrong).unwrap();
    composer.compose(entry, &Flags::new()).unwrap_err();
}

#[test]
fn flags_specialise() {
    let text = "@group(0) @binding(0) var<storage, read_write> out: array<u32>;\n@compute @workgroup_size(1) fn main() {\n#ifdef SPECULAR\n    out[0] = #{COUNT}u;\n#else\n    out[0] = 0u;\n#endif\n}\n";
    let mut composer = Composer::new().unwrap();
    let mut expressions = |flags: &Flags| {
        let composed = composer.compose(Source { path: "entry.wgsl", text }, flags).unwrap();
        format!("{:?}", composed.module.entry_points[0].function.expressions)
    };
    let on = expressions(&Flags::new().with("SPECULAR", true).with("COUNT", 7u32));
    let off = expressions(&Flags::new().with("SPECULAR", false).with("COUNT", 7u32));
    assert!(on.contains("U32(7)") && !off.contains("U32(7)"));
}
