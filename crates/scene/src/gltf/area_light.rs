//! `extras.area_light` of a node, and the surface that such a light has.

use crate::{AreaLight, AreaShape, Instance, Material, Mesh, Scene, light::polygon_fault, triangulate};
use glam::{DMat4, Vec2, Vec3};
use serde::Deserialize;
use std::{f32::consts::PI, sync::Arc};

#[derive(Deserialize)]
struct Extras {
    area_light: Option<Written>,
}

#[derive(Deserialize)]
struct Written {
    shape: String,
    width: Option<f32>,
    height: Option<f32>,
    radius: Option<f32>,
    vertices: Option<Vec<[f32; 2]>>,
    radiance: [f32; 3],
    #[serde(default)]
    two_sided: bool,
}

/// The area light at a node, if its extras hold one.
pub(crate) fn parse(json: &str, name: &str, node: usize) -> Result<Option<AreaLight>, String> {
    // Other programs keep other things in extras.
    let value: serde_json::Value = serde_json::from_str(json).map_err(|error| format!("its extras are not JSON: {error}"))?;
    if value.get("area_light").is_none() {
        return Ok(None);
    }
    let extras: Extras = serde_json::from_value(value).map_err(|error| format!("extras.area_light: {error}"))?;
    let Some(light) = extras.area_light else { return Ok(None) };
    let length = |name: &str, value: Option<f32>| match value {
        Some(value) if value > 0.0 && value.is_finite() => Ok(value),
        Some(value) => Err(format!("extras.area_light: `{name}` is {value}, but must be positive and finite")),
        None => Err(format!("extras.area_light: a {} needs `{name}`", light.shape)),
    };
    let shape = match light.shape.as_str() {
        "quad" => AreaShape::Quad { width: length("width", light.width)?, height: length("height", light.height)? },
        "disk" => AreaShape::Disk { radius: length("radius", light.radius)? },
        "sphere" => AreaShape::Sphere { radius: length("radius", light.radius)? },
        "polygon" => {
            let written = light.vertices.ok_or("extras.area_light: a polygon needs `vertices`")?;
            let vertices: Vec<Vec2> = written.into_iter().map(Vec2::from_array).collect();
            if let Some(fault) = polygon_fault(&vertices) {
                return Err(format!("extras.area_light: {fault}"));
            }
            AreaShape::Polygon { vertices }
        }
        other => return Err(format!("extras.area_light: shape `{other}` is none of quad, disk, sphere, polygon")),
    };
    let radiance = Vec3::from_array(light.radiance);
    if !radiance.is_finite() || radiance.min_element() < 0.0 {
        return Err(format!("extras.area_light: radiance is {radiance}, but must be finite and not negative"));
    }
    let (name, world_from_local) = (name.to_owned(), DMat4::IDENTITY);
    Ok(Some(AreaLight { name, shape, world_from_local, radiance, two_sided: light.two_sided, node: Some(node) }))
}

/// Adds the light's own surface: black, emitting on its front, which blocks light and is seen.
pub(crate) fn add_surface(scene: &mut Scene, index: usize) {
    let light = scene.area_lights[index].clone();
    let mut mesh = match &light.shape {
        AreaShape::Quad { .. } | AreaShape::Polygon { .. } => polygon(&light.shape.outline().unwrap_or_default()),
        AreaShape::Disk { radius } => disk(*radius),
        AreaShape::Sphere { radius } => sphere(*radius, 64, 32),
    };
    mesh.material = scene.materials.len();
    mesh.fill();
    scene.materials.push(Material {
        name: format!("{} (light)", light.name),
        base_color: Vec3::ZERO,
        metallic: 0.0,
        specular: 0.0,
        emissive: light.radiance,
        emits_both_ways: light.two_sided,
        ..Material::default()
    });
    let meshes = Arc::make_mut(&mut scene.meshes);
    meshes.push(mesh);
    let mesh = meshes.len() - 1;
    scene.instances.push(Instance {
        mesh,
        world_from_local: light.world_from_local,
        name: light.name,
        area_light: Some(index),
        node: light.node,
        node_from_local: DMat4::IDENTITY,
    });
}

/// Front towards -Z.
fn polygon(outline: &[Vec2]) -> Mesh {
    let mut mesh = Mesh { positions: outline.iter().map(|vertex| vertex.extend(0.0)).collect(), ..Mesh::default() };
    mesh.normals = vec![Vec3::NEG_Z; mesh.positions.len()];
    for [a, b, c] in triangulate(outline) {
        // A front face is counter-clockwise as seen from -Z.
        let turned = (outline[b] - outline[a]).perp_dot(outline[c] - outline[a]) > 0.0;
        let [b, c] = if turned { [c, b] } else { [b, c] };
        mesh.indices.extend([a, b, c].map(|corner| corner as u32));
    }
    mesh
}

/// Front towards -Z.
fn disk(radius: f32) -> Mesh {
    const SEGMENTS: u32 = 128;
    // The polygon has the disk's area, not its circumscribed circle.
    let step = 2.0 * PI / SEGMENTS as f32;
    let rim = radius * (step / step.sin()).sqrt();
    let at = |segment: u32| Vec2::from_angle(step * segment as f32) * rim;
    let mut mesh = Mesh { positions: vec![Vec3::ZERO], ..Mesh::default() };
    mesh.positions.extend((0..SEGMENTS).map(|segment| at(segment).extend(0.0)));
    mesh.normals = vec![Vec3::NEG_Z; mesh.positions.len()];
    mesh.indices = (0..SEGMENTS).flat_map(|segment| [0, 1 + (segment + 1) % SEGMENTS, 1 + segment]).collect();
    mesh
}

/// A sphere with its front outwards.
pub(crate) fn sphere(radius: f32, segments: u32, rings: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for ring in 0..=rings {
        let (sine, cosine) = (PI * ring as f32 / rings as f32).sin_cos();
        // In floats the sine of pi is not 0, and the pole would be a ring of slivers that face anywhere.
        let sine = if ring == rings { 0.0 } else { sine };
        for segment in 0..=segments {
            let around = Vec2::from_angle(2.0 * PI * (segment % segments) as f32 / segments as f32);
            let normal = Vec3::new(sine * around.x, cosine, -sine * around.y);
            mesh.positions.push(normal * radius);
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(segment as f32 / segments as f32, ring as f32 / rings as f32));
        }
    }
    for ring in 0..rings {
        for segment in 0..segments {
            let above = ring * (segments + 1) + segment;
            let below = above + segments + 1;
            if ring + 1 < rings {
                mesh.indices.extend([above, below, below + 1]);
            }
            if ring > 0 {
                mesh.indices.extend([above, below + 1, above + 1]);
            }
        }
    }
    mesh
}
