//! Facts of a scene that passes ask.

use crate::{AlphaMode, AreaShape, LightKind, MIN_ALPHA, Material, Ndf, Scene, TextureRef, UvSet};
use glam::{Affine2, DVec3};
use serde::Serialize;

/// Half angle in radians up to which a spot light is seen by one square face; wider ones take six, like points.
pub const CUBE_FACE_OUTER: f32 = 65.0 * std::f32::consts::PI / 180.0;

/// An axis-aligned box in world space, metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Least corner.
    pub min: DVec3,
    /// Greatest corner.
    pub max: DVec3,
}

impl Bounds {
    /// Holds nothing.
    pub const EMPTY: Bounds = Bounds { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Grows to hold a point.
    pub fn include(&mut self, point: DVec3) {
        // `min` of glam drops NaN; a NaN must stay visible.
        if point.is_nan() {
            *self = Bounds { min: DVec3::NAN, max: DVec3::NAN };
        }
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// Middle.
    pub fn centre(&self) -> DVec3 {
        (self.min + self.max) / 2.0
    }

    /// Radius of the sphere about the centre that holds it.
    pub fn radius(&self) -> f64 {
        (self.max - self.min).length() / 2.0
    }

    /// Whether both corners are finite.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }
}

/// A light whose map may be too coarse for what a camera sees.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CoarseLight {
    /// Its name.
    pub light: String,
    /// Camera.
    pub camera: String,
    /// What one face of its map covers where that camera looks, metres.
    pub face_width: f64,
    /// Width of what is seen there, metres.
    pub sight_width: f64,
}

/// What a scene has, as far as passes care. Decides what is pruned and how shaders are specialised.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneTraits {
    /// Triangles of all instances.
    pub triangles: usize,
    /// Instances.
    pub instances: usize,
    /// Materials in use.
    pub materials: usize,
    /// Textures.
    pub textures: usize,
    /// Whether any material has a specular lobe.
    pub specular: bool,
    /// Smallest alpha of all specular lobes, textures included.
    pub sharpest_alpha: Option<f32>,
    /// Whether any material can be metallic.
    pub metallic: bool,
    /// Whether any material has a normal map.
    pub normal_maps: bool,
    /// Whether any material is cut out by alpha.
    pub alpha_mask: bool,
    /// Whether any material emits and so lights others.
    pub emissive: bool,
    /// Instances whose material emits, those of area lights not counted.
    pub emissive_surfaces: usize,
    /// Whether any material is drawn in its colour whatever the light ([`Material::unlit`]).
    pub unlit: bool,
    /// Whether any dielectric has another reflectance than [`Material::DIELECTRIC`].
    pub dielectric: bool,
    /// Whether any mesh has colours.
    pub vertex_colors: bool,
    /// Whether any material reads two sets of texture coordinates.
    pub second_uvs: bool,
    /// Whether any texture is moved, turned, scaled or read at the second set of texture coordinates.
    pub texture_transforms: bool,
    /// Whether any material has a base-colour texture.
    pub base_color_textures: bool,
    /// Whether any material has a metallic-roughness texture.
    pub metallic_roughness_textures: bool,
    /// Whether any material has an emission texture.
    pub emissive_textures: bool,
    /// Point lights.
    pub point_lights: usize,
    /// Spot lights.
    pub spot_lights: usize,
    /// Directional lights.
    pub directional_lights: usize,
    /// Point lights, and spots too wide for one face: each takes six faces of a shadow map.
    pub cube_lights: usize,
    /// Faces of the shadow map of each directional light: 1, or more, each lying in the next, where cameras see a small part of a large scene.
    pub directional_faces: usize,
    /// Lights that are far away, or directional in a scene that is large, for what a camera sees: each with the camera that sees the smallest part.
    pub coarse_lights: Vec<CoarseLight>,
    /// Quad lights.
    pub quad_lights: usize,
    /// Disk lights.
    pub disk_lights: usize,
    /// Sphere lights.
    pub sphere_lights: usize,
    /// Polygon lights other than quads.
    pub polygon_lights: usize,
    /// Whether there is an environment map.
    pub environment: bool,
    /// Whether anything moves.
    pub animated: bool,
    /// Length of the longest animation, seconds.
    pub animation_seconds: f32,
    /// Bounds of the geometry.
    pub bounds: Bounds,
    /// Normal distribution function.
    pub ndf: Ndf,
}

impl SceneTraits {
    /// Point, spot and directional lights.
    pub fn punctual_lights(&self) -> usize {
        self.point_lights + self.spot_lights + self.directional_lights
    }

    /// Area lights of all shapes.
    pub fn area_lights(&self) -> usize {
        self.flat_lights() + self.disk_lights + self.sphere_lights
    }

    /// Quad and polygon lights: those with corners.
    pub fn flat_lights(&self) -> usize {
        self.quad_lights + self.polygon_lights
    }

    /// The same scene with every fact set that only permits leaving something out.
    pub fn unspecialised(&self) -> Self {
        // Code for every shape of area light, where there is one at all.
        let shapes = usize::from(self.area_lights() > 0);
        // Vertex colours, second texture coordinates and transforms of textures stay what they are: where there are none, the device has no buffer of them.
        Self {
            disk_lights: self.disk_lights.max(shapes),
            sphere_lights: self.sphere_lights.max(shapes),
            specular: true,
            metallic: true,
            normal_maps: true,
            alpha_mask: true,
            emissive: true,
            unlit: true,
            dielectric: true,
            base_color_textures: true,
            metallic_roughness_textures: true,
            emissive_textures: true,
            ..self.clone()
        }
    }

    /// The facts in words, for printing.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let yes = |on: bool| (if on { "yes" } else { "no" }).to_owned();
        let size = self.bounds.max - self.bounds.min;
        let mut facts = vec![
            ("triangles", self.triangles.to_string()),
            ("instances", self.instances.to_string()),
            ("materials", self.materials.to_string()),
            ("textures", self.textures.to_string()),
            ("size (m)", format!("{:.3} x {:.3} x {:.3}", size.x, size.y, size.z)),
            ("centre (m)", format!("{:.3}", self.bounds.centre())),
            ("specular lobes", yes(self.specular)),
            ("sharpest alpha", self.sharpest_alpha.map_or("-".into(), |alpha| format!("{alpha:.4}"))),
            ("metallic", yes(self.metallic)),
            ("normal maps", yes(self.normal_maps)),
            ("alpha mask", yes(self.alpha_mask)),
            ("emissive", yes(self.emissive)),
            ("base-colour textures", yes(self.base_color_textures)),
            ("metallic-roughness textures", yes(self.metallic_roughness_textures)),
            ("emission textures", yes(self.emissive_textures)),
            ("point lights", self.point_lights.to_string()),
            ("spot lights", self.spot_lights.to_string()),
            ("directional lights", self.directional_lights.to_string()),
            ("emissive surfaces", self.emissive_surfaces.to_string()),
            ("quad lights", self.quad_lights.to_string()),
            ("disk lights", self.disk_lights.to_string()),
            ("sphere lights", self.sphere_lights.to_string()),
            ("polygon lights", self.polygon_lights.to_string()),
            ("environment map", yes(self.environment)),
            ("animation (s)", if self.animated { format!("{:.3}", self.animation_seconds) } else { "none".into() }),
            ("normal distribution", self.ndf.to_string()),
        ];
        let rare = [
            ("unlit surfaces", self.unlit),
            ("other dielectrics than of index 1.5", self.dielectric),
            ("vertex colours", self.vertex_colors),
            ("second texture coordinates", self.second_uvs),
            ("transformed textures", self.texture_transforms),
        ];
        facts.extend(rare.into_iter().filter(|(_, there)| *there).map(|(name, there)| (name, yes(there))));
        facts
    }
}

/// Least roughness factor of a material's texture.
fn least_roughness(scene: &Scene, material: &Material) -> f32 {
    let texture = material.metallic_roughness_texture.and_then(|reference| scene.textures.get(reference.texture));
    let least = texture.and_then(|texture| texture.rgba.chunks_exact(4).map(|texel| texel[1]).min());
    material.roughness * least.map_or(1.0, |green| f32::from(green) / 255.0)
}

pub(crate) fn of(scene: &Scene) -> SceneTraits {
    let mut used = vec![false; scene.materials.len()];
    let mut triangles = 0;
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        used[mesh.material] = true;
        triangles += mesh.indices.len() / 3;
    }
    let materials: Vec<&Material> = scene.materials.iter().zip(&used).filter(|(_, used)| **used).map(|(material, _)| material).collect();
    let any = |fact: fn(&Material) -> bool| materials.iter().any(|material| fact(material));
    let specular = materials.iter().filter(|material| material.specular > 0.0 && !material.unlit);
    let alphas = specular.map(|material| least_roughness(scene, material).powi(2).max(MIN_ALPHA));
    let lights = |fits: fn(&LightKind) -> bool| scene.lights.iter().filter(|light| fits(&light.kind)).count();
    let area = |fits: fn(&AreaShape) -> bool| scene.area_lights.iter().filter(|light| fits(&light.shape)).count();
    let emits = |mesh: usize| scene.materials[scene.meshes[mesh].material].emits();
    let wide = |kind: &LightKind| match kind {
        LightKind::Point => true,
        LightKind::Spot { outer, .. } => *outer > CUBE_FACE_OUTER,
        LightKind::Directional => false,
    };
    let (directional_faces, coarse_lights) = crate::sight::facts(scene);
    SceneTraits {
        triangles,
        instances: scene.instances.len(),
        materials: materials.len(),
        textures: scene.textures.len(),
        specular: any(|material| material.specular > 0.0 && !material.unlit),
        sharpest_alpha: alphas.reduce(f32::min),
        metallic: any(|material| material.metallic > 0.0 && !material.unlit),
        normal_maps: any(|material| material.normal_texture.is_some()),
        alpha_mask: any(|material| material.alpha_mode != AlphaMode::Opaque),
        emissive_surfaces: scene.instances.iter().filter(|instance| instance.area_light.is_none() && emits(instance.mesh)).count(),
        emissive: any(Material::emits),
        unlit: any(|material| material.unlit),
        dielectric: any(|material| material.specular > 0.0 && !material.unlit && material.dielectric != Material::DIELECTRIC),
        vertex_colors: scene.instances.iter().any(|instance| !scene.meshes[instance.mesh].colors.is_empty()),
        second_uvs: any(|material| material.textures().iter().flatten().any(|texture| texture.uv_set == UvSet::Second)),
        texture_transforms: any(|material| {
            let moved = |texture: &TextureRef| texture.uv_set == UvSet::Second || texture.uv_transform != Affine2::IDENTITY;
            material.textures().iter().flatten().any(moved)
        }),
        base_color_textures: any(|material| material.base_color_texture.is_some()),
        metallic_roughness_textures: any(|material| material.metallic_roughness_texture.is_some()),
        emissive_textures: any(|material| material.emissive_texture.is_some()),
        point_lights: lights(|kind| matches!(kind, LightKind::Point)),
        spot_lights: lights(|kind| matches!(kind, LightKind::Spot { .. })),
        directional_lights: lights(|kind| matches!(kind, LightKind::Directional)),
        cube_lights: scene.lights.iter().filter(|light| wide(&light.kind)).count(),
        directional_faces,
        coarse_lights,
        quad_lights: area(|shape| matches!(shape, AreaShape::Quad { .. })),
        disk_lights: area(|shape| matches!(shape, AreaShape::Disk { .. })),
        sphere_lights: area(|shape| matches!(shape, AreaShape::Sphere { .. })),
        polygon_lights: area(|shape| matches!(shape, AreaShape::Polygon { .. })),
        environment: scene.environment.is_some(),
        animated: scene.is_animated(),
        animation_seconds: scene.animation_seconds(),
        bounds: scene.bounds(),
        ndf: scene.ndf,
    }
}
