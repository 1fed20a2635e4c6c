//! RON scenes: a glTF file (or a built-in scene) with camera, lights, environment and materials added or overridden.

mod camera_motion;
mod motion;
mod position;

use crate::{
    Camera, LightKind, LoadOptions, Ndf, PunctualLight, Scene, SceneError, environment, error::suggestion, gltf::check_light, light,
};
use glam::{DVec3, Vec3};
use position::Step::{self, Field, Quoted};
use serde::{Deserialize, Deserializer, de::MapAccess};
use std::{fmt, marker::PhantomData, path::Path};

/// A map that keeps the order of the file.
#[derive(Debug)]
struct Ordered<T>(Vec<(String, T)>);

impl<T> Default for Ordered<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Ordered<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> serde::de::Visitor<'de> for Visitor<T> {
            type Value = Ordered<T>;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a map from names")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries: Vec<(String, T)> = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    if entries.iter().any(|(known, _)| *known == name) {
                        return Err(serde::de::Error::custom(format!("duplicate name `{name}`")));
                    }
                    entries.push((name, map.next_value()?));
                }
                Ok(Ordered(entries))
            }
        }
        deserializer.deserialize_map(Visitor(PhantomData))
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    gltf: String,
    ndf: Option<Ndf>,
    environment: Option<WrittenEnvironment>,
    #[serde(default)]
    cameras: Ordered<WrittenCamera>,
    #[serde(default)]
    lights: Ordered<WrittenLight>,
    #[serde(default = "yes")]
    keep_lights: bool,
    #[serde(default)]
    light_motion: Ordered<Vec<motion::WrittenKey>>,
    #[serde(default)]
    camera_motion: Ordered<Vec<camera_motion::WrittenCameraKey>>,
    #[serde(default)]
    materials: Ordered<WrittenMaterial>,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenEnvironment {
    file: String,
    #[serde(default = "one")]
    scale: f32,
}

fn one() -> f32 {
    1.0
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenCamera {
    origin: (f64, f64, f64),
    target: (f64, f64, f64),
    #[serde(default = "upwards")]
    up: (f64, f64, f64),
    #[serde(default = "usual_yfov")]
    yfov: f64,
    near: Option<f64>,
}

fn upwards() -> (f64, f64, f64) {
    (0.0, 1.0, 0.0)
}

fn usual_yfov() -> f64 {
    0.7
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum WrittenLight {
    Point {
        position: (f64, f64, f64),
        intensity: (f32, f32, f32),
    },
    Spot {
        position: (f64, f64, f64),
        direction: (f64, f64, f64),
        intensity: (f32, f32, f32),
        #[serde(default)]
        inner: f32,
        outer: f32,
    },
    Directional {
        direction: (f64, f64, f64),
        illuminance: (f32, f32, f32),
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenMaterial {
    base_color: Option<(f32, f32, f32)>,
    metallic: Option<f32>,
    roughness: Option<f32>,
    specular: Option<f32>,
    emissive: Option<(f32, f32, f32)>,
    normal_map: Option<bool>,
}

/// The file being read, to say where something stands.
struct File<'a> {
    path: String,
    text: &'a str,
}

impl File<'_> {
    /// An error about what stands at `path`.
    fn about(&self, path: &[Step<'_>], message: impl Into<String>, help: Option<String>) -> SceneError {
        let (line, column) = position::of(self.text, path);
        SceneError::Ron { file: self.path.clone(), line, column, message: message.into(), help }
    }
}

/// An entry of one of the file's maps, to say where one of its fields stands.
struct Entry<'a> {
    file: &'a File<'a>,
    section: &'a str,
    kind: &'a str,
    name: &'a str,
}

impl Entry<'_> {
    fn fail(&self, field: &str, message: impl fmt::Display) -> SceneError {
        let Entry { file, section, kind, name } = self;
        file.about(&[Field(section), Quoted(name), Field(field)], format!("{kind} `{name}`: {message}"), None)
    }

    fn point(&self, field: &str, (x, y, z): (f64, f64, f64)) -> Result<DVec3, SceneError> {
        let point = DVec3::new(x, y, z);
        if point.is_finite() { Ok(point) } else { Err(self.fail(field, format_args!("{field} is {point}, but must be finite"))) }
    }

    fn direction(&self, field: &str, written: (f64, f64, f64)) -> Result<DVec3, SceneError> {
        let direction = self.point(field, written)?;
        direction.try_normalize().ok_or_else(|| self.fail(field, format_args!("{field} is zero, and so points nowhere")))
    }

    /// A number in [0, 1]; one that is out of range by rounding is clamped.
    fn unit(&self, field: &str, value: f32) -> Result<f32, SceneError> {
        let rounded = value.clamp(0.0, 1.0);
        if f64::from((value - rounded).abs()) <= light::ROUNDING {
            Ok(rounded)
        } else {
            Err(self.fail(field, format_args!("{field} is {value}, but must lie in [0, 1]")))
        }
    }
}

/// Loads a RON scene.
pub(crate) fn load(path: &Path, load: &LoadOptions) -> Result<Scene, SceneError> {
    let shown = path.display().to_string();
    let text = lobelia_files::read_text(path).map_err(|reason| SceneError::Unreadable { file: shown.clone(), reason })?;
    parse(&text, &shown, path.parent().unwrap_or(Path::new(".")), load)
}

pub(crate) fn parse(text: &str, shown: &str, folder: &Path, load: &LoadOptions) -> Result<Scene, SceneError> {
    let file = File { path: shown.to_owned(), text };
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let written: Written = options.from_str(text).map_err(|error| {
        let (line, column) = (error.span.start.line, error.span.start.col);
        SceneError::Ron { file: shown.to_owned(), line, column, message: error.code.to_string(), help: unknown_field_help(&error.code) }
    })?;
    let base = if written.gltf.starts_with("builtin:") { written.gltf.clone() } else { folder.join(&written.gltf).display().to_string() };
    if base.to_lowercase().ends_with(".ron") {
        return Err(file.about(&[Field("gltf")], "a RON scene wraps a glTF file or a built-in scene, not another RON scene", None));
    }
    let mut scene = Scene::load_with(&base, load)?;
    if !written.keep_lights {
        scene.drop_lights();
    }
    if let Some(ndf) = written.ndf {
        scene.ndf = ndf;
    }
    if let Some(environment) = &written.environment {
        let fail =
            |field: &str, message: String| file.about(&[Field("environment"), Field(field)], format!("environment: {message}"), None);
        let scale = environment.scale;
        if !(scale.is_finite() && scale >= 0.0) {
            return Err(fail("scale", format!("scale is {scale}, but must be finite and not negative")));
        }
        let (environment, notes) = environment::load(&folder.join(&environment.file), scale).map_err(|message| fail("file", message))?;
        scene.environment = Some(environment);
        scene.warnings.extend(notes);
    }
    add_cameras(&file, &mut scene, &written.cameras)?;
    add_lights(&file, &mut scene, &written.lights)?;
    motion::add(&file, &mut scene, &written.light_motion)?;
    let up_of = |name: &str| {
        let camera = written.cameras.0.iter().find(|(known, _)| known == name);
        camera.map_or(DVec3::Y, |(_, camera)| DVec3::from(camera.up).normalize_or(DVec3::Y))
    };
    camera_motion::add(&file, &mut scene, &written.camera_motion, up_of)?;
    change_materials(&file, &mut scene, &written.materials)?;
    Ok(scene)
}

fn unknown_field_help(error: &ron::Error) -> Option<String> {
    match error {
        ron::Error::NoSuchStructField { expected, found, .. } => Some(suggestion(found, expected)),
        ron::Error::NoSuchEnumVariant { expected, found, .. } => Some(suggestion(found, expected)),
        _ => None,
    }
}

fn vec3((x, y, z): (f32, f32, f32)) -> Vec3 {
    Vec3::new(x, y, z)
}

fn add_cameras(file: &File<'_>, scene: &mut Scene, cameras: &Ordered<WrittenCamera>) -> Result<(), SceneError> {
    let mut added = Vec::new();
    for (name, written) in &cameras.0 {
        let entry = Entry { file, section: "cameras", kind: "camera", name };
        if !(written.yfov > 1e-4 && written.yfov < std::f64::consts::PI - 1e-4) {
            return Err(entry.fail("yfov", format_args!("yfov is {}, but must lie in (0, pi) radians", written.yfov)));
        }
        let near = written.near.unwrap_or_else(|| scene.usual_near());
        if !(near > 0.0 && near.is_finite()) {
            return Err(entry.fail("near", format_args!("near is {near}, but must be positive and finite")));
        }
        let (origin, target) = (entry.point("origin", written.origin)?, entry.point("target", written.target)?);
        let up = entry.direction("up", written.up)?;
        let camera = Camera::look_at(name, origin, target, up, written.yfov, near);
        added.push(camera.ok_or_else(|| entry.fail("target", "target must differ from origin and not lie along up"))?);
    }
    // A camera of the wrapper comes first, and replaces one of the same name.
    scene.cameras.retain(|camera| !added.iter().any(|new| new.name == camera.name));
    added.append(&mut scene.cameras);
    scene.cameras = added;
    Ok(())
}

fn add_lights(file: &File<'_>, scene: &mut Scene, lights: &Ordered<WrittenLight>) -> Result<(), SceneError> {
    for (name, light) in &lights.0 {
        let entry = Entry { file, section: "lights", kind: "light", name };
        let (kind, position, direction, intensity) = match *light {
            WrittenLight::Point { position, intensity } => (LightKind::Point, entry.point("position", position)?, DVec3::NEG_Z, intensity),
            WrittenLight::Spot { position, direction, intensity, inner, outer } => {
                let rounded = light::rounded_cone(inner.into(), outer.into());
                if rounded != (inner.into(), outer.into()) {
                    scene
                        .warnings
                        .push(format!("light `{name}`: cone angles of {inner} and {outer} are clamped to {} and {}", rounded.0, rounded.1));
                }
                let kind = LightKind::Spot { inner: rounded.0 as f32, outer: rounded.1 as f32 };
                (kind, entry.point("position", position)?, entry.direction("direction", direction)?, intensity)
            }
            WrittenLight::Directional { direction, illuminance } => {
                (LightKind::Directional, DVec3::ZERO, entry.direction("direction", direction)?, illuminance)
            }
        };
        let intensity = vec3(intensity);
        check_light(kind, intensity).map_err(|message| entry.fail("", message))?;
        scene.lights.retain(|known| known.name != *name);
        scene.lights.push(PunctualLight { name: name.clone(), kind, position, direction, intensity, animated: false, node: None });
    }
    Ok(())
}

fn change_materials(file: &File<'_>, scene: &mut Scene, changes: &Ordered<WrittenMaterial>) -> Result<(), SceneError> {
    // The surfaces of area lights stay what they are.
    let light_surfaces: Vec<usize> = scene
        .instances
        .iter()
        .filter(|instance| instance.area_light.is_some())
        .map(|instance| scene.meshes[instance.mesh].material)
        .collect();
    for (name, change) in &changes.0 {
        let surfaces = scene.materials.iter_mut().enumerate().filter(|(index, _)| !light_surfaces.contains(index));
        let mut materials: Vec<_> = surfaces.map(|(_, material)| material).collect();
        if name != "*" && !materials.iter().any(|material| material.name == *name) {
            let known: Vec<&str> = materials.iter().map(|material| material.name.as_str()).collect();
            let help = Some(suggestion(name, &known));
            return Err(file.about(&[Field("materials"), Quoted(name)], format!("no material is called `{name}`"), help));
        }
        let entry = Entry { file, section: "materials", kind: "material", name };
        let unit = |field: &str, value: Option<f32>| value.map(|value| entry.unit(field, value)).transpose();
        let metallic = unit("metallic", change.metallic)?;
        let roughness = unit("roughness", change.roughness)?;
        let specular = unit("specular", change.specular)?;
        let base_color = change.base_color.map(vec3);
        for channel in base_color.iter().flat_map(|color| color.to_array()) {
            entry.unit("base_color", channel)?;
        }
        let base_color = base_color.map(|color| color.clamp(Vec3::ZERO, Vec3::ONE));
        let emissive = change.emissive.map(vec3);
        if let Some(emissive) = emissive.filter(|color| !color.is_finite() || color.min_element() < 0.0) {
            return Err(entry.fail("emissive", format_args!("emissive is {emissive}, but must be finite and not negative")));
        }
        for material in materials.iter_mut().filter(|material| name == "*" || material.name == *name) {
            material.metallic = metallic.unwrap_or(material.metallic);
            material.roughness = roughness.unwrap_or(material.roughness);
            material.specular = specular.unwrap_or(material.specular);
            material.base_color = base_color.unwrap_or(material.base_color);
            material.emissive = emissive.unwrap_or(material.emissive);
            if change.normal_map == Some(false) {
                material.normal_texture = None;
            }
        }
    }
    Ok(())
}
