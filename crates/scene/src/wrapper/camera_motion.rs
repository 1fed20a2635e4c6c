//! Key frames of cameras, as they are written.

use super::{
    File, Ordered,
    position::Step::{Field, Nth, Quoted},
};
use crate::{
    Camera, Scene, SceneError,
    error::suggestion,
    motion::{CameraKey, CameraMotion},
};
use glam::DVec3;
use serde::Deserialize;
use std::fmt;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenCameraKey {
    seconds: f32,
    origin: (f64, f64, f64),
    target: (f64, f64, f64),
}

/// Gives cameras of the scene their motion, and puts them where they are at the start. `up_of` is the upward direction that the file gives a camera.
pub(super) fn add(
    file: &File<'_>,
    scene: &mut Scene,
    motions: &Ordered<Vec<WrittenCameraKey>>,
    up_of: impl Fn(&str) -> DVec3,
) -> Result<(), SceneError> {
    for (name, written) in &motions.0 {
        let about = |message: String, help| file.about(&[Field("camera_motion"), Quoted(name)], message, help);
        if !scene.cameras.iter().any(|camera| camera.name == *name) {
            let known: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
            return Err(about(format!("no camera is called `{name}`"), Some(suggestion(name, &known))));
        }
        if written.is_empty() {
            return Err(about(format!("the motion of camera `{name}` has no key"), None));
        }
        let up = up_of(name);
        let mut keys: Vec<CameraKey> = Vec::new();
        for (index, key) in written.iter().enumerate() {
            keys.push(checked(&Place { file, camera: name, index }, key, up, keys.last())?);
        }
        for camera in scene.cameras.iter_mut().filter(|camera| camera.name == *name) {
            camera.node = None;
        }
        scene.camera_motions.push(CameraMotion { camera: name.clone(), up, keys });
    }
    // Cameras of the file are at time 0 too.
    scene.move_cameras(0.0);
    Ok(())
}

/// A key, to say where it stands.
struct Place<'a> {
    file: &'a File<'a>,
    camera: &'a str,
    index: usize,
}

impl Place<'_> {
    fn fail(&self, field: &'static str, message: impl fmt::Display) -> SceneError {
        let path = [Field("camera_motion"), Quoted(self.camera), Nth("seconds", self.index)];
        self.file.about(&path, format!("motion of camera `{}`, key {}: {field} {message}", self.camera, self.index + 1), None)
    }
}

fn checked(place: &Place<'_>, written: &WrittenCameraKey, up: DVec3, before: Option<&CameraKey>) -> Result<CameraKey, SceneError> {
    let seconds = written.seconds;
    if !(seconds.is_finite() && seconds >= 0.0) {
        return Err(place.fail("seconds", format_args!("is {seconds}, but must be finite and not negative")));
    }
    if let Some(before) = before.filter(|before| before.seconds >= seconds) {
        return Err(place.fail("seconds", format_args!("is {seconds}, but must be more than that of the key before, {}", before.seconds)));
    }
    let point = |field: &'static str, (x, y, z): (f64, f64, f64)| {
        let point = DVec3::new(x, y, z);
        if point.is_finite() { Ok(point) } else { Err(place.fail(field, format_args!("is {point}, but must be finite"))) }
    };
    let key = CameraKey { seconds, origin: point("origin", written.origin)?, target: point("target", written.target)? };
    if Camera::look_at("", key.origin, key.target, up, 1.0, 1.0).is_none() {
        return Err(place.fail("target", "must differ from origin and not lie along up"));
    }
    if let Some(before) = before {
        // The view goes straight from one to the other, and with it its part across `up`: that vanishes on the way only between opposite ones.
        let across = |key: &CameraKey| (key.target - key.origin).cross(up).normalize_or_zero();
        if across(before).dot(across(&key)) < -1.0 + 1e-9 {
            let why = "is such that the view turns straight up, straight down or over its origin after the key before; add a key between";
            return Err(place.fail("target", why));
        }
    }
    Ok(key)
}
