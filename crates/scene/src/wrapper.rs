//! RON scenes: a glTF file (or a built-in scene) with camera, lights, environment and materials added or overridden.

use crate::{
    Camera, Environment, LightKind, Ndf, PunctualLight, Scene, SceneError,
    error::suggestion,
    gltf::check_light,
};
use glam::{DVec3, Vec3};
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
                while let Some((name, value)) = map.next_entry::<String, T>()? {
                    if entries.iter().any(|(known, _)| *known == name) {
                        return Err(serde::de::Error::custom(format!("duplicate name `{name}`")));
                    }
                    entries.push((name, value));
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
    #[serde(default = "usual_near")]
    near: f64,
}

fn upwards() -> (f64, f64, f64) {
    (0.0, 1.0, 0.0)
}

fn usual_yfov() -> f64 {
    0.7
}

fn usual_near() -> f64 {
    0.01
}

#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum WrittenLight {
    Point { position: (f64, f64, f64), intensity: (f32, f32, f32) },
    Spot { position: (f64, f64, f64), direction: (f64, f64, f64), intensity: (f32, f32, f32), #[serde(default)] inner: f32, outer: f32 },
    Directional { direction: (f64, f64, f64), illuminance: (f32, f32, f32) },
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
    fn at(&self, line: usize, column: usize, message: impl Into<String>, help: Option<String>) -> SceneError {
        SceneError::Ron { file: self.path.clone(), line, column, message: message.into(), help }
    }

    /// An error about a quoted name, or about the section it stands in.
    fn about(&self, section: &str, name: &str, message: impl Into<String>, help: Option<String>) -> SceneError {
        let section_start = self.text.find(section).unwrap_or(0);
        let quoted = format!("\"{name}\"");
        let offset = self.text[section_start..].find(&quoted).map_or(section_start, |found| section_start + found);
        let before = &self.text[..offset];
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        self.at(before.matches('\n').count() + 1, column, message, help)
    }
}

/// Loads a RON scene.
pub(crate) fn load(path: &Path) -> Result<Scene, SceneError> {
    let shown = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| SceneError::Unreadable { file: shown.clone(), reason: error.to_string() })?;
    parse(&text, &shown, path.parent().unwrap_or(Path::new(".")))
}

pub(crate) fn parse(text: &str, shown: &str, folder: &Path) -> Result<Scene, SceneError> {
    let file = File { path: shown.to_owned(), text };
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let written: Written = options.from_str(text).map_err(|error| {
        let help = unknown_field_help(&error.code);
        file.at(error.span.start.line, error.span.start.col, error.code.to_string(), help)
    })?;
    let base = if written.gltf.starts_with("builtin:") { written.gltf.clone() } else { folder.join(&written.gltf).display().to_string() };
    if base.to_lowercase().ends_with(".ron") {
        return Err(file.about("gltf", &written.gltf, "a RON scene wraps a glTF file or a built-in scene, not another RON scene", None));
    }
    let mut scene = Scene::load(&base)?;
    if let Some(ndf) = written.ndf {
        scene.ndf = ndf;
    }
    if let Some(environment) = &written.environment {
        scene.environment = Some(load_environment(&file, environment, folder)?);
    }
    add_cameras(&file, &mut scene, &written.cameras)?;
    add_lights(&file, &mut scene, &written)?;
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

fn dvec3((x, y, z): (f64, f64, f64)) -> DVec3 {
    DVec3::new(x, y, z)
}

fn vec3((x, y, z): (f32, f32, f32)) -> Vec3 {
    Vec3::new(x, y, z)
}

fn load_environment(file: &File<'_>, written: &WrittenEnvironment, folder: &Path) -> Result<Environment, SceneError> {
    let fail = |message: String| file.about("environment", &written.file, message, None);
    if !(written.scale.is_finite() && written.scale >= 0.0) {
        return Err(fail(format!("environment: scale is {}, but must be finite and not negative", written.scale)));
    }
    let path = folder.join(&written.file);
    let name = path.display().to_string();
    let mut reader = image::ImageReader::open(&path)
        .and_then(image::ImageReader::with_guessed_format)
        .map_err(|error| fail(format!("environment {name}: cannot be read: {error}")))?;
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height, limits.max_alloc) = (Some(8192), Some(8192), Some(1 << 30));
    reader.limits(limits);
    let decoded = reader.decode().map_err(|error| fail(format!("environment {name}: cannot be decoded: {error}")))?.to_rgb32f();
    let (width, height) = decoded.dimensions();
    let pixels: Vec<Vec3> = decoded.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
    if let Some(place) = pixels.iter().position(|pixel| !pixel.is_finite() || pixel.min_element() < 0.0) {
        let (x, y) = (place as u32 % width, place as u32 / width);
        return Err(fail(format!("environment {name}: pixel ({x}, {y}) is {}, but radiance must be finite and not negative", pixels[place])));
    }
    Ok(Environment { name, width, height, pixels, scale: written.scale })
}

fn add_cameras(file: &File<'_>, scene: &mut Scene, cameras: &Ordered<WrittenCamera>) -> Result<(), SceneError> {
    let mut added = Vec::new();
    for (name, written) in &cameras.0 {
        let fail = |message: String| file.about("cameras", name, format!("camera `{name}`: {message}"), None);
        if !(written.yfov > 0.0 && written.yfov < std::f64::consts::PI) {
            return Err(fail(format!("yfov is {}, but must lie in (0, pi) radians", written.yfov)));
        }
        if !(written.near > 0.0 && written.near.is_finite()) {
            return Err(fail(format!("near is {}, but must be positive", written.near)));
        }
        let (origin, target, up) = (dvec3(written.origin), dvec3(written.target), dvec3(written.up));
        let camera = Camera::look_at(name, origin, target, up, written.yfov, written.near).filter(|camera| camera.position.is_finite());
        added.push(camera.ok_or_else(|| fail("origin and target must differ and up not lie along the view".into()))?);
    }
    // A camera of the wrapper comes first, and replaces one of the same name.
    scene.cameras.retain(|camera| !added.iter().any(|new| new.name == camera.name));
    added.append(&mut scene.cameras);
    scene.cameras = added;
    Ok(())
}

fn add_lights(file: &File<'_>, scene: &mut Scene, written: &Written) -> Result<(), SceneError> {
    if !written.keep_lights {
        scene.lights.clear();
    }
    for (name, light) in &written.lights.0 {
        let fail = |message: String| file.about("lights", name, format!("light `{name}`: {message}"), None);
        let (kind, position, direction, intensity) = match *light {
            WrittenLight::Point { position, intensity } => (LightKind::Point, dvec3(position), DVec3::NEG_Y, vec3(intensity)),
            WrittenLight::Spot { position, direction, intensity, inner, outer } => {
                (LightKind::Spot { inner, outer }, dvec3(position), dvec3(direction), vec3(intensity))
            }
            WrittenLight::Directional { direction, illuminance } => (LightKind::Directional, DVec3::ZERO, dvec3(direction), vec3(illuminance)),
        };
        check_light(kind, intensity).map_err(fail)?;
        let direction = direction.try_normalize().ok_or_else(|| fail("its direction is zero".into()))?;
        if !position.is_finite() {
            return Err(fail(format!("its position is {position}, but must be finite")));
        }
        scene.lights.retain(|known| known.name != *name);
        scene.lights.push(PunctualLight { name: name.clone(), kind, position, direction, intensity, animated: false, node: None });
    }
    Ok(())
}

fn change_materials(file: &File<'_>, scene: &mut Scene, changes: &Ordered<WrittenMaterial>) -> Result<(), SceneError> {
    for (name, change) in &changes.0 {
        let known: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
        if name != "*" && !known.contains(&name.as_str()) {
            return Err(file.about("materials", name, format!("no material is called `{name}`"), Some(suggestion(name, &known))));
        }
        let fail = |message: String| file.about("materials", name, format!("material `{name}`: {message}"), None);
        let unit = |what: &str, value: Option<f32>| match value {
            Some(value) if !(0.0..=1.0).contains(&value) => Err(fail(format!("{what} is {value}, but must lie in [0, 1]"))),
            value => Ok(value),
        };
        let (metallic, roughness) = (unit("metallic", change.metallic)?, unit("roughness", change.roughness)?);
        let specular = unit("specular", change.specular)?;
        let base_color = change.base_color.map(vec3);
        for channel in base_color.iter().flat_map(|color| color.to_array()) {
            unit("base_color", Some(channel))?;
        }
        let emissive = change.emissive.map(vec3);
        if emissive.is_some_and(|color| !color.is_finite() || color.min_element() < 0.0) {
            return Err(fail("emissive must be finite and not negative".into()));
        }
        let light_surfaces: Vec<usize> =
            scene.instances.iter().filter(|instance| instance.area_light.is_some()).map(|instance| scene.meshes[instance.mesh].material).collect();
        for (index, material) in scene.materials.iter_mut().enumerate() {
            // `*` means the scene's surfaces; those of area lights stay what they are.
            if (name == "*" && !light_surfaces.contains(&index)) || *name == material.name {
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
    }
    Ok(())
}
