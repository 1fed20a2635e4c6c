//! `builtin:area-lights`: every shape of area light over a floor whose strips grow rougher towards the viewer.

use super::{Builder, add_quad};
use crate::{AreaLight, AreaShape, Mesh, Scene, Texture, TextureRef, gltf::area_light::add_surface};
use glam::{DMat4, DQuat, DVec3, Vec2, Vec3};
use std::{f64::consts::PI, sync::Arc};

/// Roughness of the strips, from the lights to the viewer.
const ROUGHNESS: [f32; 6] = [0.05, 0.15, 0.3, 0.45, 0.6, 0.8];

/// A checkerboard of two greys, two fields a side.
fn checker() -> Texture {
    const SIDE: u32 = 64;
    let texel = |index: u32| {
        let (x, y) = (index % SIDE * 2 / SIDE, index / SIDE * 2 / SIDE);
        let grey = if (x + y) % 2 == 0 { 255 } else { 215 };
        [grey, grey, grey, 255]
    };
    Texture { name: "checker".into(), width: SIDE, height: SIDE, rgba: (0..SIDE * SIDE).flat_map(texel).collect() }
}

/// Five points; not convex.
fn star(radius: f32) -> AreaShape {
    let corner = |index: usize| {
        let angle = std::f32::consts::PI * index as f32 / 5.0;
        Vec2::new(angle.sin(), angle.cos()) * radius * if index.is_multiple_of(2) { 1.0 } else { 0.42 }
    };
    AreaShape::Polygon { vertices: (0..10).map(corner).collect() }
}

pub(super) fn area_lights() -> Scene {
    let mut build = Builder::default();
    build.scene.textures = Arc::new(vec![checker()]);
    let (left, back, depth) = (-4.2, -0.6, 0.6);
    for (index, roughness) in ROUGHNESS.into_iter().enumerate() {
        let name = format!("strip {roughness:.2}");
        let material = build.material(&name, [0.75, 0.75, 0.75], 0.5, roughness);
        build.scene.materials[material].base_color_texture = Some(TextureRef::default());
        let (far, near) = (back + depth * index as f32, back + depth * (index + 1) as f32);
        let mut mesh = Mesh::default();
        add_quad(&mut mesh, [[left, 0.0, near], [-left, 0.0, near], [-left, 0.0, far], [left, 0.0, far]].map(Vec3::from_array));
        // One repeat of the checker every 0.6 m.
        mesh.uvs = mesh.positions.iter().map(|corner| Vec2::new(corner.x, corner.z - back) / depth).collect();
        build.place(&name, mesh, material, DVec3::ZERO);
    }
    let triangle = AreaShape::Polygon { vertices: vec![Vec2::new(-0.45, -0.35), Vec2::new(0.45, -0.35), Vec2::new(0.0, 0.5)] };
    let lights = [
        ("quad", AreaShape::Quad { width: 0.7, height: 0.7 }, [1.0, 1.0], [1.0, 0.75, 0.5]),
        ("triangle", triangle, [1.0, 1.0], [0.6, 0.8, 1.0]),
        ("star", star(0.5), [1.0, 1.0], [1.0, 0.55, 0.45]),
        ("disk", AreaShape::Disk { radius: 0.38 }, [1.0, 1.0], [0.9, 0.9, 0.9]),
        ("ellipse", AreaShape::Disk { radius: 0.4 }, [0.55, 1.2], [0.5, 1.0, 0.6]),
        ("sphere", AreaShape::Sphere { radius: 0.32 }, [1.0, 1.0], [1.0, 0.7, 0.9]),
        ("ellipsoid", AreaShape::Sphere { radius: 0.36 }, [0.5, 1.3], [0.95, 0.85, 0.4]),
    ];
    let middle = (lights.len() as f64 - 1.0) / 2.0;
    for (index, (name, shape, scale, color)) in lights.into_iter().enumerate() {
        let at = DVec3::new(1.15 * (index as f64 - middle), 0.62, -0.75);
        // Local -Z towards the viewer and a little down.
        let turn = DQuat::from_rotation_y(PI) * DQuat::from_rotation_x(-0.25);
        let tilt = if name == "ellipsoid" || name == "ellipse" { DQuat::from_rotation_z(0.5) } else { DQuat::IDENTITY };
        let scale = DVec3::new(scale[0], scale[1], scale[0]);
        let world_from_local = DMat4::from_scale_rotation_translation(scale, turn * tilt, at);
        let radiance = Vec3::from_array(color) * 4.0;
        let two_sided = name == "star";
        build.scene.area_lights.push(AreaLight { name: name.into(), shape, world_from_local, radiance, two_sided, node: None });
    }
    build.camera("main", [0.0, 3.4, 7.2], [0.0, 0.05, 0.55], 0.52);
    build.camera("low", [0.0, 0.55, 5.4], [0.0, 0.35, 0.0], 0.62);
    let count = build.scene.area_lights.len();
    let mut scene = build.finish();
    for index in 0..count {
        add_surface(&mut scene, index);
    }
    scene
}
