//! Reference values: the built-in file, or the one that `LOBELIA_LOBE_VECTORS` names (schema `spherical-gaussians/1`).
#![allow(clippy::unwrap_used, dead_code)]

pub mod area_lights;

use glam::DVec3;
use serde_json::Value;

const BUILT_IN: &str = include_str!("../data/spherical-gaussians.json");

/// The records under a key; a file without any fails the test.
pub fn records(key: &str) -> Vec<Value> {
    let text = match std::env::var("LOBELIA_LOBE_VECTORS") {
        Ok(path) if !path.is_empty() => {
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("LOBELIA_LOBE_VECTORS: {path}: {error}"))
        }
        _ => BUILT_IN.to_owned(),
    };
    let file: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("the file of reference values is no JSON: {error}"));
    let found = file.get(key).and_then(Value::as_array).unwrap_or_else(|| panic!("the file of reference values has no list `{key}`"));
    assert!(!found.is_empty(), "`{key}` is empty");
    found.clone()
}

/// A number, or `None` where the record has null.
pub fn number(record: &Value, key: &str) -> Option<f64> {
    let value = record.get(key).unwrap_or_else(|| panic!("no `{key}` in {record}"));
    assert!(value.is_null() || value.is_number(), "`{key}` is no number in {record}");
    value.as_f64()
}

/// A number that must be there.
pub fn given(record: &Value, key: &str) -> f64 {
    number(record, key).unwrap_or_else(|| panic!("`{key}` is null in {record}"))
}

/// Three numbers.
pub fn triple(value: &Value) -> DVec3 {
    let parts: Vec<f64> = value.as_array().unwrap().iter().map(|part| part.as_f64().unwrap()).collect();
    DVec3::new(parts[0], parts[1], parts[2])
}

/// A direction, normalised as the reference does.
pub fn vector(record: &Value, key: &str) -> DVec3 {
    triple(&record[key]).normalize()
}

/// Whether two values agree to `relative`, or to 1e-12 near zero. NaN never does.
pub fn agrees(got: f64, want: f64, relative: f64) -> bool {
    (got - want).abs() <= relative * want.abs() + 1e-12
}

/// An exact form: 1e-10 relative, 1e-12 absolute near zero.
pub fn close(got: f64, want: f64, what: &dyn std::fmt::Display) {
    assert!(agrees(got, want, 1e-10), "{what}: {got:e}, not {want:e}");
}
