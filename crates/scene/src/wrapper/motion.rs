//! Key frames of lights, as they are written.

use super::{
    File, Ordered,
    position::Step::{Field, Nth, Quoted},
};
use crate::{
    LightKind, Scene, SceneError,
    error::suggestion,
    motion::{Key, LightMotion},
};
use glam::DVec3;
use serde::Deserialize;
use std::fmt;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenKey {
    seconds: f32,
    position: Option<(f64, f64, f64)>,
    direction: Option<(f64, f64, f64)>,
}

/// Gives lights of the scene their motion, and puts them where they are at the start.
pub(super) fn add(file: &File<'_>, scene: &mut Scene, motions: &Ordered<Vec<WrittenKey>>) -> Result<(), SceneError> {
    for (name, written) in &motions.0 {
        let about = |message: String, help| file.about(&[Field("light_motion"), Quoted(name)], message, help);
        let Some(kind) = scene.lights.iter().find(|light| light.name == *name).map(|light| light.kind) else {
            let known: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
            return Err(about(format!("no light is called `{name}`"), Some(suggestion(name, &known))));
        };
        if written.is_empty() {
            return Err(about(format!("the motion of light `{name}` has no key"), None));
        }
        let mut keys: Vec<Key> = Vec::new();
        for (index, key) in written.iter().enumerate() {
            keys.push(checked(&Place { file, light: name, index }, key, kind, keys.last())?);
        }
        for light in scene.lights.iter_mut().filter(|light| light.name == *name) {
            light.animated = true;
            light.node = None;
        }
        scene.motions.push(LightMotion { light: name.clone(), keys });
    }
    // Lights of the file are at time 0 too.
    scene.move_lights(0.0);
    Ok(())
}

/// A key, to say where one of its fields stands.
struct Place<'a> {
    file: &'a File<'a>,
    light: &'a str,
    index: usize,
}

impl Place<'_> {
    fn fail(&self, field: &'static str, message: impl fmt::Display) -> SceneError {
        // Keys are found by the field that each must have; other fields stand behind it or, where they come first, before it.
        let path = [Field("light_motion"), Quoted(self.light), Nth("seconds", self.index)];
        let message = format!("motion of light `{}`, key {}: {field} {message}", self.light, self.index + 1);
        self.file.about(&path, message, None)
    }
}

fn checked(place: &Place<'_>, written: &WrittenKey, kind: LightKind, before: Option<&Key>) -> Result<Key, SceneError> {
    let seconds = written.seconds;
    if !(seconds.is_finite() && seconds >= 0.0) {
        return Err(place.fail("seconds", format_args!("is {seconds}, but must be finite and not negative")));
    }
    if let Some(before) = before.filter(|before| before.seconds >= seconds) {
        return Err(place.fail("seconds", format_args!("is {seconds}, but must be more than that of the key before, {}", before.seconds)));
    }
    let vector = |field: &'static str, written: Option<(f64, f64, f64)>| match written.map(|(x, y, z)| DVec3::new(x, y, z)) {
        Some(vector) if !vector.is_finite() => Err(place.fail(field, format_args!("is {vector}, but must be finite"))),
        found => Ok(found),
    };
    let position = vector("position", written.position)?;
    let direction = match vector("direction", written.direction)? {
        Some(direction) => Some(direction.try_normalize().ok_or_else(|| place.fail("direction", "is zero, and so points nowhere"))?),
        None => None,
    };
    match kind {
        LightKind::Point if direction.is_some() => return Err(place.fail("direction", "is given, but a point light has none")),
        LightKind::Directional if position.is_some() => return Err(place.fail("position", "is given, but a directional light has none")),
        _ if position.is_none() && direction.is_none() => return Err(place.fail("position", "is missing, and a direction too")),
        _ => {}
    }
    if let Some(before) = before {
        for (field, given, known) in
            [("position", position.is_some(), before.position.is_some()), ("direction", direction.is_some(), before.direction.is_some())]
        {
            if given != known {
                return Err(place.fail(field, "must be given in every key or in none"));
            }
        }
        if let (Some(from), Some(to)) = (before.direction, direction)
            && from.dot(to) < -1.0 + 1e-9
        {
            return Err(
                place.fail("direction", "is opposite to that of the key before, so that it is open which way to turn; add a key between")
            );
        }
    }
    Ok(Key { seconds, position, direction })
}
