//! Reference values of area lights: the built-in file, or the one that `LOBELIA_AREA_LIGHT_VECTORS` names (schema `area-lights/1`).

use super::triple;
use glam::DVec3;
use serde_json::Value;

const BUILT_IN: &str = include_str!("../data/area-lights.json");

/// The records under a key; a file without any fails the test.
pub fn records(key: &str) -> Vec<Value> {
    let text = match std::env::var("LOBELIA_AREA_LIGHT_VECTORS") {
        Ok(path) if !path.is_empty() => {
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("LOBELIA_AREA_LIGHT_VECTORS: {path}: {error}"))
        }
        _ => BUILT_IN.to_owned(),
    };
    let file: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("the file of reference values is no JSON: {error}"));
    assert_eq!(file["meta"]["schema"], "area-lights/1");
    let found = file[key].as_array().unwrap_or_else(|| panic!("the file of reference values has no list `{key}`"));
    assert!(!found.is_empty(), "`{key}` is empty");
    found.clone()
}

/// The corners of a light.
pub fn polygon(record: &Value) -> Vec<DVec3> {
    record["vertices"].as_array().unwrap().iter().map(triple).collect()
}
