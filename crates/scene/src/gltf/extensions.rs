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
    /// Not read; this command makes a file without it.
    Convert(&'static str),
}
use Standing::{Convert, Ignored, Read};

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
    ("KHR_texture_transform", Ignored("textures lie untransformed")),
    ("EXT_mesh_gpu_instancing", Ignored("each mesh is drawn once")),
    ("KHR_materials_anisotropy", Ignored("highlights are isotropic")),
    ("KHR_materials_clearcoat", Ignored("no coat is drawn")),
    ("KHR_materials_diffuse_transmission", Ignored("no light passes through")),
    ("KHR_materials_dispersion", Ignored("no light is dispersed")),
    ("KHR_materials_ior", Ignored("the index of refraction is 1.5")),
    ("KHR_materials_iridescence", Ignored("no thin film is drawn")),
    ("KHR_materials_pbrSpecularGlossiness", Ignored("the metallic-roughness fallback is drawn")),
    ("KHR_materials_sheen", Ignored("no sheen is drawn")),
    ("KHR_materials_specular", Ignored("specular reflection is that of an index of refraction of 1.5")),
    ("KHR_materials_transmission", Ignored("no light passes through")),
    ("KHR_materials_unlit", Ignored("its surfaces are lit")),
    ("KHR_materials_variants", Ignored("the default materials are drawn")),
    ("KHR_materials_volume", Ignored("no light passes through")),
    ("KHR_materials_volume_scatter", Ignored("no light passes through")),
    ("KHR_animation_pointer", Ignored("only transforms of nodes are animated")),
    ("KHR_node_visibility", Ignored("hidden nodes are drawn")),
    ("KHR_node_hoverability", Ignored("it draws nothing")),
    ("KHR_node_selectability", Ignored("it draws nothing")),
    ("KHR_interactivity", Ignored("it draws nothing")),
    ("KHR_audio_emitter", Ignored("it draws nothing")),
    ("KHR_audio", Ignored("it draws nothing")),
    ("KHR_xmp", Ignored("it draws nothing")),
    ("KHR_xmp_json_ld", Ignored("it draws nothing")),
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
            Some(Read) => {}
            Some(Ignored(lost)) => warnings.push(format!("extension {name} is ignored: {lost}")),
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
