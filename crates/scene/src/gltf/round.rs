//! Factors and angles that are out of range by rounding.

use crate::light::{ROUNDING, rounded_cone};
use serde_json::{Value, json};

/// Factors of a material, where they stand and their range.
const FACTORS: [(&str, f64, f64); 9] = [
    ("/pbrMetallicRoughness/baseColorFactor", 0.0, 1.0),
    ("/pbrMetallicRoughness/metallicFactor", 0.0, 1.0),
    ("/pbrMetallicRoughness/roughnessFactor", 0.0, 1.0),
    ("/emissiveFactor", 0.0, f64::INFINITY),
    ("/alphaCutoff", 0.0, f64::INFINITY),
    ("/extensions/KHR_materials_emissive_strength/emissiveStrength", 0.0, f64::INFINITY),
    ("/extensions/KHR_materials_specular/specularFactor", 0.0, 1.0),
    ("/extensions/KHR_materials_specular/specularColorFactor", 0.0, f64::INFINITY),
    ("/extensions/KHR_materials_clearcoat/clearcoatFactor", 0.0, 1.0),
];

/// How many numbers were clamped, and the first in words.
#[derive(Default)]
struct Clamped(usize, String);

impl Clamped {
    fn number(&mut self, number: &mut Value, least: f64, most: f64, what: impl Fn() -> String) {
        let Some(value) = number.as_f64() else { return };
        if (least..=most).contains(&value) || value < least - ROUNDING || value > most + ROUNDING {
            return;
        }
        let clamped = value.clamp(least, most);
        *number = json!(clamped);
        self.word(|| format!("{} of {value} to {clamped}", what()));
    }

    fn word(&mut self, what: impl Fn() -> String) {
        if self.0 == 0 {
            self.1 = what();
        }
        self.0 += 1;
    }
}

/// Clamps what is out of range by no more than rounding, with a word. What is further out stays, and is refused where it is used.
pub(super) fn round(root: &mut Value) -> Option<String> {
    let mut clamped = Clamped::default();
    let name = |value: &Value, kind: &str, index: usize| match value.get("name").and_then(Value::as_str) {
        Some(name) => format!("{kind} `{name}`"),
        None => format!("{kind} {index}"),
    };
    let materials = root.get_mut("materials").and_then(Value::as_array_mut).into_iter().flatten();
    for (index, material) in materials.enumerate() {
        let at = name(material, "material", index);
        for (pointer, least, most) in FACTORS {
            let what = || format!("{at}: {}", pointer.rsplit('/').next().unwrap_or_default());
            match material.pointer_mut(pointer) {
                Some(Value::Array(numbers)) => numbers.iter_mut().for_each(|number| clamped.number(number, least, most, what)),
                Some(number) => clamped.number(number, least, most, what),
                None => {}
            }
        }
    }
    let lights = root.pointer_mut("/extensions/KHR_lights_punctual/lights").and_then(Value::as_array_mut).into_iter().flatten();
    for (index, light) in lights.enumerate() {
        let at = name(light, "light", index);
        if let Some(intensity) = light.get_mut("intensity") {
            clamped.number(intensity, 0.0, f64::INFINITY, || format!("{at}: intensity"));
        }
        for number in light.get_mut("color").and_then(Value::as_array_mut).into_iter().flatten() {
            clamped.number(number, 0.0, f64::INFINITY, || format!("{at}: color"));
        }
        let Some(spot) = light.get_mut("spot").filter(|spot| spot.is_object()) else { continue };
        let angle = |key: &str, otherwise: f64| spot.get(key).map_or(Some(otherwise), Value::as_f64);
        let (Some(inner), Some(outer)) = (angle("innerConeAngle", 0.0), angle("outerConeAngle", std::f64::consts::FRAC_PI_4)) else {
            continue;
        };
        let rounded = rounded_cone(inner, outer);
        if rounded != (inner, outer) {
            (spot["innerConeAngle"], spot["outerConeAngle"]) = (json!(rounded.0), json!(rounded.1));
            clamped.word(|| format!("{at}: cone angles of {inner} and {outer} to {} and {}", rounded.0, rounded.1));
        }
    }
    (clamped.0 > 0).then(|| format!("numbers out of range by rounding are clamped: {}, first in {}", clamped.0, clamped.1))
}
