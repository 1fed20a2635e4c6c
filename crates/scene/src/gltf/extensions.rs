//! The extensions that are read, and what is lost of those that are not read in full.

use serde_json::Value;

/// Extensions that are drawn as they say.
const READ: [&str; 10] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    // Says nothing that could be drawn.
    "KHR_xmp_json_ld",
];

/// Extensions of materials without which the base material is still near to what is meant, and what is lost.
const BASE_MATERIAL: [(&str, &str); 9] = [
    ("KHR_materials_anisotropy", "highlights are not stretched"),
    ("KHR_materials_clearcoat", "surfaces have no coat"),
    ("KHR_materials_diffuse_transmission", "no light passes through surfaces"),
    ("KHR_materials_dispersion", "no light passes through surfaces"),
    ("KHR_materials_iridescence", "reflections have no colours of thin films"),
    ("KHR_materials_sheen", "surfaces have no sheen"),
    ("KHR_materials_subsurface", "no light passes through surfaces"),
    ("KHR_materials_transmission", "surfaces are opaque"),
    ("KHR_materials_volume", "surfaces have nothing inside"),
];

/// Extensions of the whole file without which what is drawn is what the file shows first, and what is lost.
const WHOLE_FILE: [(&str, &str); 1] = [("KHR_materials_variants", "surfaces have their default materials")];

/// Whether a file that requires an extension can be drawn, in full or nearly.
pub(crate) fn is_known(name: &str) -> bool {
    READ.contains(&name) || BASE_MATERIAL.iter().chain(&WHOLE_FILE).any(|(known, _)| *known == name)
}

/// The names of all extensions that [`is_known`] knows.
pub(crate) fn known() -> Vec<&'static str> {
    READ.into_iter().chain(BASE_MATERIAL.iter().chain(&WHOLE_FILE).map(|(name, _)| *name)).collect()
}

/// What is lost of an extension of the whole file.
pub(super) fn lost_of_file(name: &str) -> Option<&'static str> {
    WHOLE_FILE.iter().find(|(known, _)| *known == name).map(|(_, lost)| *lost)
}

/// The extensions of a material that are not drawn, each with what is lost. One whose numbers are all 0 changes nothing and is not listed.
pub(super) fn lost_of_material<'a>(extension: impl Fn(&str) -> Option<&'a Value>) -> impl Iterator<Item = (&'static str, &'static str)> {
    BASE_MATERIAL.into_iter().filter(move |(name, _)| extension(name).and_then(Value::as_object).is_some_and(has_effect))
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
