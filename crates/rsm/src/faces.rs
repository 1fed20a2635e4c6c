//! How lights see: their faces.

use encase::StorageBuffer;
use glam::{DMat4, DVec3, DVec4};
use lobelia_frame::RsmFace;
use lobelia_scene::{CUBE_FACE_OUTER, LightKind, PunctualLight, Scene, SceneTraits};

/// Faces of all lights together.
pub fn count(traits: &SceneTraits) -> usize {
    traits.punctual_lights() - traits.cube_lights + 6 * traits.cube_lights
}

/// [`all`] as the device reads them.
pub fn bytes(scene: &Scene) -> Vec<u8> {
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    match bytes.write(&all(scene)) {
        Ok(()) => bytes.into_inner(),
        // Writing to a Vec fails only if it cannot grow, which aborts.
        Err(_) => Vec::new(),
    }
}

/// Near plane as a fraction of the scene's radius. Depth is reverse-Z float, so a near plane this close costs no precision.
const NEAR: f64 = 1e-3;

/// A face is this much wider than the cone it serves, so that filtering at the cone's rim stays inside.
const MARGIN: f64 = 1.02;

/// Least tangent of a spot's half angle: even a beam without width has a face.
const LEAST_TANGENT: f64 = 1e-4;

/// Forward and up of a cube's faces in the order +X -X +Y -Y +Z -Z.
const CUBE: [(DVec3, DVec3); 6] = [
    (DVec3::X, DVec3::Y),
    (DVec3::NEG_X, DVec3::Y),
    (DVec3::Y, DVec3::Z),
    (DVec3::NEG_Y, DVec3::Z),
    (DVec3::Z, DVec3::Y),
    (DVec3::NEG_Z, DVec3::Y),
];

/// All faces, lights in the order of the scene.
pub fn all(scene: &Scene) -> Vec<RsmFace> {
    let bounds = scene.bounds();
    let (centre, radius) = (bounds.centre() - scene.origin(), bounds.radius().max(1e-6));
    let mut faces: Vec<RsmFace> = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        let first = faces.len() as u32;
        let position = light.position - scene.origin();
        let views: Vec<View> = match light.kind {
            LightKind::Directional => vec![directional(light, centre, radius)],
            LightKind::Spot { outer, .. } if outer <= CUBE_FACE_OUTER => {
                let tangent = (f64::from(outer).tan() * MARGIN).max(LEAST_TANGENT);
                vec![View::perspective(position, light.direction, any_up(light.direction), tangent, radius * NEAR)]
            }
            _ => CUBE.map(|(forward, up)| View::perspective(position, forward, up, 1.0, radius * NEAR)).into(),
        };
        let count = views.len() as u32;
        faces.extend(views.into_iter().map(|view| view.face(index as u32, first, count)));
    }
    faces
}

fn any_up(forward: DVec3) -> DVec3 {
    if forward.y.abs() < 0.99 { DVec3::Y } else { DVec3::X }
}

/// An orthographic view of the sphere around the scene.
fn directional(light: &PunctualLight, centre: DVec3, radius: f64) -> View {
    let position = centre - light.direction * (2.0 * radius);
    let up = any_up(light.direction);
    let right = light.direction.cross(up).normalize() * radius * MARGIN;
    let up = right.cross(light.direction);
    View { position, forward: light.direction, right, up, near: radius * 0.5, depth_range: radius * 3.0 }
}

struct View {
    position: DVec3,
    forward: DVec3,
    /// Half width at distance 1, or in metres.
    right: DVec3,
    up: DVec3,
    near: f64,
    /// 0 for perspective.
    depth_range: f64,
}

impl View {
    fn perspective(position: DVec3, forward: DVec3, up: DVec3, tangent: f64, near: f64) -> Self {
        let right = forward.cross(up).normalize() * tangent;
        let up = right.cross(forward);
        Self { position, forward, right, up, near, depth_range: 0.0 }
    }

    fn clip_from_scene(&self) -> DMat4 {
        let row = |axis: DVec3| axis.extend(-axis.dot(self.position));
        let forward = row(self.forward);
        let (x, y) = (row(self.right / self.right.length_squared()), row(self.up / self.up.length_squared()));
        let (z, w) = if self.depth_range == 0.0 {
            (DVec4::new(0.0, 0.0, 0.0, self.near), forward)
        } else {
            // Depth 1 at the near plane, 0 at the far one.
            let scaled = forward / -self.depth_range;
            (scaled + DVec4::new(0.0, 0.0, 0.0, 1.0 + self.near / self.depth_range), DVec4::W)
        };
        DMat4::from_cols(x, y, z, w).transpose()
    }

    fn face(&self, light: u32, first_face: u32, face_count: u32) -> RsmFace {
        RsmFace {
            clip_from_scene: self.clip_from_scene().as_mat4(),
            position: self.position.as_vec3(),
            near: self.near as f32,
            forward: self.forward.as_vec3(),
            depth_range: self.depth_range as f32,
            right: self.right.as_vec3(),
            light,
            up: self.up.as_vec3(),
            first_face,
            face_count,
        }
    }
}
