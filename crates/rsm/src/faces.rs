//! How lights see: their faces.
//!
//! A perspective face begins a little before the first thing that its light sees. A directional light sees the sphere around the scene; where cameras see but
//! a small part of a large scene it has further faces, each lying in the next, the finest around what is seen. A point is drawn in every face that holds it,
//! but its flux belongs to the finest of them alone, so the sum over all texels is the light's flux whatever the faces are.

use encase::StorageBuffer;
use glam::{DMat4, DVec2, DVec3, DVec4, UVec2, Vec4};
use lobelia_frame::{ReflectiveShadowMapShape, RsmFace};
use lobelia_scene::{CUBE_FACE_OUTER, LightKind, Lookout, PunctualLight, Scene, SceneTraits, Sight, Triangle, device::ViewUniform};

/// Faces of all lights together.
pub fn count(traits: &SceneTraits) -> usize {
    let single = traits.punctual_lights() - traits.cube_lights - traits.directional_lights;
    single + 6 * traits.cube_lights + traits.directional_faces * traits.directional_lights
}

/// The shape of the map, and how many faces a directional light has.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub shape: ReflectiveShadowMapShape,
    pub directional: usize,
}

/// [`all`] as the device reads them.
pub fn bytes(scene: &Scene, layout: &Layout, camera: Option<&ViewUniform>) -> Vec<u8> {
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    match bytes.write(&all(scene, layout, camera)) {
        Ok(()) => bytes.into_inner(),
        // Writing to a Vec fails only if it cannot grow, which aborts.
        Err(_) => Vec::new(),
    }
}

/// Farthest near plane as a fraction of the scene's radius. Depth is reverse-Z float, so a near plane this close costs no precision.
const NEAR: f64 = 1e-3;

/// Nearest near plane as a fraction of the distance to the end of the scene. Where a triangle that large is cut off at the near plane, `f32` rounds the place of
/// the cut by about a quarter of this.
const LEAST_NEAR: f64 = 1.0 / (1u64 << 21) as f64;

/// What `f32` makes of a position, as a fraction of the largest coordinate: a triangle's corners are rounded when they are moved, turned and projected.
const ROUNDING: f64 = 1.0 / (1u64 << 22) as f64;

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

/// All faces, lights in the order of the scene. `camera`: whose picture is made; the scene's first if there is none yet.
pub fn all(scene: &Scene, layout: &Layout, camera: Option<&ViewUniform>) -> Vec<RsmFace> {
    let bounds = scene.bounds();
    let (centre, radius) = (bounds.centre() - scene.origin(), bounds.radius().max(1e-6));
    let farthest = [bounds.min, bounds.max].map(|corner| (corner - scene.origin()).abs().max_element());
    let rounding = farthest[0].max(farthest[1]) * ROUNDING;
    let triangles = scene.triangles();
    let nested = layout.directional > 1 && scene.lights.iter().any(|light| light.kind == LightKind::Directional);
    let sight = if nested { sight(scene, camera) } else { None };
    let mut faces: Vec<RsmFace> = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        let first = faces.len() as u32;
        let position = light.position - scene.origin();
        let near = |tangent: f64| {
            // In the corner of a face the distance along its axis is the least for the distance from the light.
            let reach = 0.5 * distance_to(&triangles, position) / (1.0 + 2.0 * tangent * tangent).sqrt();
            let far = position.distance(centre) + radius;
            (radius * NEAR).min(reach.max(far * LEAST_NEAR))
        };
        let views: Vec<View> = match light.kind {
            LightKind::Directional => {
                let whole = directional(light, centre, radius);
                let sight = sight.unwrap_or(Sight { centre, radius });
                nest(whole, &sight, &triangles, layout)
            }
            LightKind::Spot { outer, .. } if outer <= CUBE_FACE_OUTER => {
                let tangent = (f64::from(outer).tan() * MARGIN).max(LEAST_TANGENT);
                vec![View::perspective(position, light.direction, any_up(light.direction), tangent, near(tangent))]
            }
            _ => {
                let near = near(1.0);
                CUBE.map(|(forward, up)| View::perspective(position, forward, up, 1.0, near)).into()
            }
        };
        let count = views.len() as u32;
        for view in views {
            let place = layout.shape.place(faces.len() as u32);
            let rounding = rounding.max(view.depth_range * ROUNDING);
            faces.push(RsmFace {
                light: index as u32,
                first_face: first,
                face_count: count,
                resolution: layout.shape.resolution,
                layer: place.0,
                corner: UVec2::from(place.1),
                rounding: rounding as f32,
                ..view.face()
            });
        }
    }
    faces
}

fn sight(scene: &Scene, camera: Option<&ViewUniform>) -> Option<Sight> {
    let first = || {
        let camera = scene.camera(None).ok()?;
        Some(ViewUniform::new(&camera, scene.origin(), [16, 9], glam::Vec2::ZERO, 0, 0, None))
    };
    let view = camera.copied().or_else(first)?;
    Lookout::new(scene).sight(&view)
}

/// Distance from a point to the nearest triangle; infinite if there is none.
fn distance_to(triangles: &[Triangle], point: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for triangle in triangles {
        let corners = triangle.positions.map(|corner| corner.as_dvec3() - point);
        let (low, high) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
        // Outside of the box around it the triangle is no nearer than the box.
        if low.max(-high).max(DVec3::ZERO).length_squared() < least {
            least = least.min(nearest_to_origin(corners).length_squared());
        }
    }
    least.sqrt()
}

/// The point of a triangle that is nearest to the origin (Ericson 2005, section 5.1.5).
fn nearest_to_origin([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (-ab.dot(a), -ac.dot(a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (-ab.dot(b), -ac.dot(b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (-ab.dot(c), -ac.dot(c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
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
    View {
        position,
        forward: light.direction,
        right,
        up,
        near: radius * 0.5,
        depth_range: radius * 3.0,
        weight: 1.0,
        hole: RsmFace::NO_HOLE,
    }
}

/// Faces that lie in each other around what is seen, the finest first and `whole` last. Each ends at the borders of texels of the next, so that every texel of
/// the next lies in it or not.
fn nest(whole: View, sight: &Sight, triangles: &[Triangle], layout: &Layout) -> Vec<View> {
    let steps = layout.directional.max(1) - 1;
    let mut views = vec![whole];
    let (axis_x, axis_y, forward) = (views[0].right.normalize(), views[0].up.normalize(), views[0].forward);
    let texels = f64::from(layout.shape.resolution);
    let whole_half = views[0].right.length();
    let step = (whole_half / (sight.radius * MARGIN)).max(1.0).powf(1.0 / steps.max(1) as f64);
    for _ in 0..steps {
        let last = views.len() - 1;
        let (half, middle) = (views[last].right.length(), views[last].position);
        let texel = 2.0 * half / texels;
        let across = (texels / step).ceil().clamp(2.0, texels);
        let to_sight = sight.centre - middle;
        // Rows are counted from the top.
        let place = DVec2::new(half + to_sight.dot(axis_x), half - to_sight.dot(axis_y)) / texel - across / 2.0;
        let first = place.round().clamp(DVec2::ZERO, DVec2::splat(texels - across));
        let end = first + across;
        views[last].hole = Vec4::new(first.x as f32, first.y as f32, end.x as f32, end.y as f32) / layout.shape.resolution as f32;
        let centre = (first + across / 2.0) * texel - half;
        let half = across / 2.0 * texel;
        // On its axis, two widths before what is seen: positions there lose no digits to the size of the scene.
        let axis = middle + axis_x * centre.x - axis_y * centre.y;
        let position = axis + forward * ((sight.centre - axis).dot(forward) - 2.0 * half);
        let (near, far) = depths(triangles, position, [axis_x, axis_y, forward], half).unwrap_or((half, 3.0 * half));
        let slack = 1e-3 * (far - near) + 1e-2 * half;
        views.push(View {
            position,
            right: axis_x * half,
            up: axis_y * half,
            near: near - slack,
            depth_range: far - near + 2.0 * slack,
            weight: 1.0,
            hole: RsmFace::NO_HOLE,
            forward,
        });
    }
    let finest = views[steps].right.length();
    for view in &mut views {
        view.weight = (finest / view.right.length()).powi(2);
    }
    views.reverse();
    views
}

/// The least and the greatest distance along the last axis of whatever of the triangles lies in the square column around it.
fn depths(triangles: &[Triangle], position: DVec3, axes: [DVec3; 3], half: f64) -> Option<(f64, f64)> {
    let mut found: Option<(f64, f64)> = None;
    let (mut shape, mut cut) = (Vec::new(), Vec::new());
    for triangle in triangles {
        shape.clear();
        shape.extend(triangle.positions.map(|corner| {
            let offset = corner.as_dvec3() - position;
            DVec3::from(axes.map(|axis| axis.dot(offset)))
        }));
        // Sutherland and Hodgman 1974, against the four sides.
        for side in [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y] {
            let inside = |point: &DVec3| half - side.dot(point.truncate());
            cut.clear();
            for (index, to) in shape.iter().enumerate() {
                let from = &shape[(index + shape.len() - 1) % shape.len()];
                let (before, after) = (inside(from), inside(to));
                if (before < 0.0) != (after < 0.0) {
                    cut.push(from.lerp(*to, before / (before - after)));
                }
                if after >= 0.0 {
                    cut.push(*to);
                }
            }
            std::mem::swap(&mut shape, &mut cut);
        }
        for point in &shape {
            let (near, far) = found.unwrap_or((point.z, point.z));
            found = Some((near.min(point.z), far.max(point.z)));
        }
    }
    found
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
    weight: f64,
    hole: Vec4,
}

impl View {
    fn perspective(position: DVec3, forward: DVec3, up: DVec3, tangent: f64, near: f64) -> Self {
        let right = forward.cross(up).normalize() * tangent;
        let up = right.cross(forward);
        Self { position, forward, right, up, near, depth_range: 0.0, weight: 1.0, hole: RsmFace::NO_HOLE }
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

    /// As the device has it; where it lies in the map is filled in by the caller.
    fn face(&self) -> RsmFace {
        RsmFace {
            clip_from_scene: self.clip_from_scene().as_mat4(),
            position: self.position.as_vec3(),
            near: self.near as f32,
            forward: self.forward.as_vec3(),
            depth_range: self.depth_range as f32,
            right: self.right.as_vec3(),
            light: 0,
            up: self.up.as_vec3(),
            first_face: 0,
            face_count: 1,
            resolution: 1,
            layer: 0,
            weight: self.weight as f32,
            hole: self.hole,
            corner: UVec2::ZERO,
            rounding: 0.0,
        }
    }
}
