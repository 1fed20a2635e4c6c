//! Every module composes and validates alone, under every combination of its flags; errors say where.
#![allow(clippy::unwrap_used)]

use lobelia_shaders::{Composer, Flags, Source, modules};

const FLAGS: [&str; 4] = ["SPECULAR", "NORMAL_MAP", "EMISSIVE", "NDF_PHONG"];

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
        for bits in 0..1u32 << FLAGS.len() {
            let mut flags = Flags::new();
            for (index, flag) in FLAGS.iter().enumerate() {
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
fn bindings_and_entry_points_keep_their_names() {
    let text = "#import lobelia::math::luminance\n\
        @group(0) @binding(0) var source_radiance: texture_2d<f32>;\n\
        @group(0) @binding(1) var<storage, read_write> total_luminance: array<f32>;\n\
        @compute @workgroup_size(1) fn measure() { total_luminance[0] = luminance(textureLoad(source_radiance, vec2u(0u), 0).rgb); }\n";
    let composed = Composer::new().unwrap().compose(Source { path: "entry.wgsl", text }, &Flags::new()).unwrap();
    let names: Vec<_> = composed.module.global_variables.iter().filter_map(|(_, variable)| variable.name.clone()).collect();
    assert_eq!(names, ["source_radiance", "total_luminance"]);
    assert_eq!(composed.module.entry_points[0].name, "measure");
}

fn refused(text: &str) -> String {
    Composer::new().unwrap().compose(Source { path: "crates/a/src/entry.wgsl", text }, &Flags::new()).unwrap_err().to_string()
}

#[test]
fn errors_say_where() {
    let syntax = refused("@compute @workgroup_size(1)\nfn main() {\n    let x = ;\n}\n");
    assert!(syntax.starts_with("crates/a/src/entry.wgsl:3:13:"), "{syntax}");
    let import = refused("#import lobelia::lumin::luminance\n@compute @workgroup_size(1) fn main() { let x = luminance(vec3f(1.0)); }\n");
    assert!(import.contains("lobelia::lumin"), "{import}");
    let near = refused(
        "#import lobelia::octahedra::octahedral_pack\n@compute @workgroup_size(1) fn main() { let a = octahedral_pack(vec3f(1.0)); }\n",
    );
    assert!(near.contains("did you mean `lobelia::octahedral`?"), "{near}");
    let unknown = refused("@compute @workgroup_size(1)\nfn main() {\n    let x = nothing_here(1.0);\n}\n");
    assert!(unknown.starts_with("crates/a/src/entry.wgsl:3:"), "{unknown}");
    let types = refused("@compute @workgroup_size(1)\nfn main() {\n    let x: vec3f = 1u + 2.0;\n}\n");
    assert!(types.starts_with("crates/a/src/entry.wgsl:3:"), "{types}");
}

#[test]
fn errors_in_modules_say_where() {
    let entry = Source { path: "entry.wgsl", text: "#import mine::half\n@compute @workgroup_size(1) fn main() { let x = half(1.0); }\n" };
    let compose = |text: &str| {
        let mut composer = Composer::new().unwrap();
        composer.add_module(Source { path: "shaders/mine.wgsl", text })?;
        composer.compose(entry, &Flags::new())
    };
    let text = compose("#define_import_path mine\nfn half(x: f32) -> f32 {\n    return x / ;\n}\n").unwrap_err().to_string();
    assert!(text.starts_with("shaders/mine.wgsl:3:"), "{text}");
    compose("#define_import_path mine\nfn half(x: f32) -> f32 {\n    return 0.5 * x;\n}\n").unwrap();
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
