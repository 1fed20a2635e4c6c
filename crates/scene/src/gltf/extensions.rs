//! What is known of glTF extensions, in one list, and what follows for a file that uses or requires one.

use serde_json::Value;
use std::collections::BTreeSet;

/// How an extension is treated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    /// Read as its specification says.
    Read,
    /// Not read, and what remains is still worth a picture: what is lost, in words.
    Ignored(&'static str),
    /// Not drawn on materials, which are near to what is meant without it: what is lost, told of each material that it changes.
    Surface(&'static str),
    /// Not read; this command makes a file without it.
    Convert(&'static str),
}
use Standing::{Convert, Ignored, Read, Surface};

/// All extensions that are known. Whatever is not in here is ignored where it is only used, and refused where it is required.
const KNOWN: &[(&str, Standing)] = &[
    ("KHR_lights_punctual", Read),
    ("KHR_materials_emissive_strength", Read),
    ("KHR_mesh_quantization", Read),
    ("KHR_texture_basisu", Read),
    ("EXT_texture_webp", Read),
    ("KHR_draco_mesh_compression", Read),
    ("EXT_meshopt_compression", Read),
    ("KHR_meshopt_compression", Read),
    ("KHR_texture_transform", Read),
    ("EXT_mesh_gpu_instancing", Read),
    ("KHR_materials_anisotropy", Surface("highlights are not stretched")),
    ("KHR_materials_clearcoat", Surface("surfaces have no coat")),
    ("KHR_materials_diffuse_transmission", Surface("no light passes through surfaces")),
    ("KHR_materials_dispersion", Surface("no light passes through surfaces")),
    ("KHR_materials_ior", Read),
    ("KHR_materials_iridescence", Surface("reflections have no colours of thin films")),
    ("KHR_materials_pbrSpecularGlossiness", Read),
    ("KHR_materials_sheen", Surface("surfaces have no sheen")),
    ("KHR_materials_specular", Read),
    ("KHR_materials_transmission", Surface("surfaces are opaque")),
    ("KHR_materials_unlit", Read),
    ("KHR_materials_subsurface", Surface("no light passes through surfaces")),
    ("KHR_materials_variants", Ignored("surfaces have their default materials")),
    ("KHR_materials_volume", Surface("surfaces have nothing inside")),
    ("KHR_materials_volume_scatter", Ignored("no light passes through")),
    ("KHR_animation_pointer", Ignored("only transforms of nodes are animated")),
    ("KHR_node_visibility", Ignored("hidden nodes are drawn")),
    ("KHR_node_hoverability", Ignored("it draws nothing")),
    ("KHR_node_selectability", Ignored("it draws nothing")),
    ("KHR_interactivity", Ignored("it draws nothing")),
    ("KHR_audio_emitter", Ignored("it draws nothing")),
    ("KHR_audio", Ignored("it draws nothing")),
    ("KHR_xmp", Ignored("it draws nothing")),
    ("KHR_xmp_json_ld", Read),
    ("KHR_physics_rigid_bodies", Ignored("nothing falls")),
    ("KHR_implicit_shapes", Ignored("it draws nothing")),
    ("EXT_lights_ies", Ignored("lights shine evenly")),
    ("EXT_lights_image_based", Ignored("a RON scene names an environment")),
    ("EXT_mesh_features", Ignored("it draws nothing")),
    ("EXT_instance_features", Ignored("it draws nothing")),
    ("EXT_structural_metadata", Ignored("it draws nothing")),
    ("EXT_feature_metadata", Ignored("it draws nothing")),
    ("ADOBE_materials_clearcoat_specular", Ignored("no coat is drawn")),
    ("ADOBE_materials_clearcoat_tint", Ignored("no coat is drawn")),
    ("ADOBE_materials_thin_transparency", Ignored("no light passes through")),
    ("AGI_articulations", Ignored("nodes stand at rest")),
    ("AGI_stk_metadata", Ignored("it draws nothing")),
    ("CESIUM_primitive_outline", Ignored("no outline is drawn")),
    ("FB_geometry_metadata", Ignored("it draws nothing")),
    ("GRIFFEL_bim_data", Ignored("it draws nothing")),
    ("MSFT_lod", Ignored("the finest level is drawn")),
    ("MSFT_packing_normalRoughnessMetallic", Ignored("the standard textures are read")),
    ("MSFT_packing_occlusionRoughnessMetallic", Ignored("the standard textures are read")),
    ("VRM", Ignored("its meshes are drawn with standard materials")),
    ("VRMC_vrm", Ignored("its meshes are drawn with standard materials")),
    ("VRMC_materials_mtoon", Ignored("its meshes are drawn with standard materials")),
    ("VRMC_springBone", Ignored("nothing swings")),
    ("VRMC_node_constraint", Ignored("nodes are not constrained")),
    ("EXT_texture_avif", Convert("npx @gltf-transform/cli png IN.glb OUT.glb --formats \"*\"")),
];

fn names(root: &Value, list: &str) -> BTreeSet<String> {
    let all = root.get(list).and_then(Value::as_array).into_iter().flatten();
    all.filter_map(Value::as_str).map(str::to_owned).collect()
}

fn standing(name: &str) -> Option<Standing> {
    KNOWN.iter().find(|(known, _)| *known == name).map(|(_, standing)| *standing)
}

/// Words about extensions that are not read, or why the file cannot be read. With `allow`, what is required and cannot be read is a word too.
pub(super) fn check(root: &Value, allow: bool) -> Result<Vec<String>, String> {
    let required = names(root, "extensionsRequired");
    let mut used = names(root, "extensionsUsed");
    used.extend(required.iter().cloned());
    let (mut warnings, mut unknown, mut refused) = (Vec::new(), Vec::new(), Vec::new());
    for name in used {
        match standing(&name) {
            Some(Read | Surface(_)) => {}
            Some(Ignored(lost)) => warnings.push(format!("{name} is not read: {lost}")),
            _ if required.contains(&name) => refused.push(name),
            _ => unknown.push(name),
        }
    }
    if !unknown.is_empty() {
        warnings.push(format!("extensions {} are ignored", unknown.join(", ")));
    }
    if refused.is_empty() {
        return Ok(warnings);
    }
    let commands: BTreeSet<&str> =
        refused.iter().filter_map(|name| if let Some(Convert(command)) = standing(name) { Some(command) } else { None }).collect();
    let commands: String = commands.iter().map(|command| format!("; `{command}` makes a file without it")).collect();
    let refused = refused.join(", ");
    if allow {
        warnings.push(format!("it requires {refused}, which this program cannot read: the picture may be wrong{commands}"));
        return Ok(warnings);
    }
    Err(format!("it requires {refused}, which this program cannot read; `--allow-unsupported` reads it without{commands}"))
}

/// The extensions of a material that are not drawn, each with what is lost. One whose numbers are all 0 changes nothing and is not listed.
pub(super) fn lost_of_material<'a>(extension: impl Fn(&str) -> Option<&'a Value>) -> impl Iterator<Item = (&'static str, &'static str)> {
    let lost = KNOWN.iter().filter_map(|(name, standing)| if let Surface(lost) = standing { Some((*name, *lost)) } else { None });
    lost.filter(move |(name, _)| extension(name).and_then(Value::as_object).is_some_and(has_effect))
}

fn has_effect(extension: &serde_json::Map<String, Value>) -> bool {
    let nonzero = |value: &Value| match value {
        Value::Number(number) => number.as_f64() != Some(0.0),
        Value::Array(list) => list.iter().any(|number| number.as_f64() != Some(0.0)),
        _ => false,
    };
    // The strength of each of these extensions is a factor or strength that is 0 unless it is given.
    let strength =
        |key: &str| ["Factor", "Strength", "dispersion"].iter().any(|ending| key.ends_with(ending)) && !key.ends_with("RoughnessFactor");
    extension.iter().any(|(key, value)| strength(key) && nonzero(value))
}
