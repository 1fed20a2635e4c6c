//! What a camera sees, roughly: where shadows must be fine.

use crate::{CUBE_FACE_OUTER, CoarseLight, LightKind, PunctualLight, Scene, device::ViewUniform};
use glam::{DVec3, Vec2, Vec3A};
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray, RayHit},
    rt_triangle::RtTriangle,
    triangle::Triangle,
};
use std::time::Duration;

/// A sphere around the surfaces that a camera sees nearest: those within [`Sight::DEPTH`] times the distance of the first of them. Scene space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Its middle.
    pub centre: DVec3,
    /// Its radius, > 0.
    pub radius: f64,
}

/// Rays through a picture, across and down.
const RAYS: [u32; 2] = [24, 14];

/// Share of the rays that meet something which are nearer than what counts as the first surface in view: a twig before the lens is not what is looked at.
const FIRST: f64 = 0.05;

impl Sight {
    /// How many times as far as the first surface in view the sphere reaches.
    pub const DEPTH: f64 = 4.0;

    fn of(eye: DVec3, mut directions: Vec<(DVec3, f64)>) -> Option<Self> {
        directions.sort_by(|left, right| left.1.total_cmp(&right.1));
        let first = directions.get((directions.len() as f64 * FIRST) as usize)?.1;
        let near = || directions.iter().take_while(|(_, distance)| *distance <= first * Self::DEPTH);
        let (mut least, mut greatest) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (direction, distance) in near() {
            let position = eye + *direction * *distance;
            (least, greatest) = (least.min(position), greatest.max(position));
        }
        let centre = (least + greatest) / 2.0;
        let reach = near().map(|(direction, distance)| (eye + *direction * *distance).distance(centre)).fold(0.0, f64::max);
        // Between the rays there is more than they met; half the distance is what a view of common width shows of a wall.
        Some(Self { centre, radius: (reach * 1.1).max(first * 0.5) })
    }
}

/// The triangles of a scene, to look at with few rays.
pub struct Lookout {
    tree: CwBvh,
    tests: Vec<RtTriangle>,
}

impl Lookout {
    /// Takes over the triangles as they are now.
    pub fn new(scene: &Scene) -> Self {
        let corners: Vec<Triangle> = scene
            .triangles()
            .iter()
            .map(|triangle| {
                let [v0, v1, v2] = triangle.positions.map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let tree = build_cwbvh_from_tris(&corners, BvhBuildParams::fast_build(), &mut Duration::default());
        let tests = tree.primitive_indices.iter().map(|index| RtTriangle::from(&corners[*index as usize])).collect();
        Self { tree, tests }
    }

    /// What a camera sees; `None` if that is nothing.
    pub fn sight(&self, view: &ViewUniform) -> Option<Sight> {
        if self.tests.is_empty() {
            return None;
        }
        let eye = view.position.as_dvec3();
        let look = |index: u32| {
            let at = |place: u32, side: u32| 2.0 * (f64::from(place) + 0.5) / f64::from(side) - 1.0;
            let (x, y) = (at(index % RAYS[0], RAYS[0]), at(index / RAYS[0], RAYS[1]));
            let direction = (view.forward.as_dvec3() + view.right.as_dvec3() * x + view.up.as_dvec3() * y).try_normalize()?;
            let ray = Ray::new(Vec3A::from(view.position), direction.as_vec3a(), view.near, f32::INFINITY);
            let mut hit = RayHit::none();
            self.tree.ray_traverse(ray, &mut hit, |ray, index| self.tests[index].intersect(ray)).then_some((direction, f64::from(hit.t)))
        };
        Sight::of(eye, (0..RAYS[0] * RAYS[1]).filter_map(look).collect())
    }
}

/// Of a scene: the faces of each directional light's map, and the lights that are far away for what a camera sees.
///
/// Faces lie in each other, so that a texel of the finest covers as much of what cameras see as a map of an ordinary scene would: 1 where the scene is no
/// larger than [`LARGE`] times that, else as many as keep each at most [`STEP`] times as wide as the next.
pub(crate) fn facts(scene: &Scene) -> (usize, Vec<CoarseLight>) {
    let bounds = scene.bounds();
    let radius = bounds.radius();
    let directional = scene.lights.iter().any(|light| light.kind == LightKind::Directional);
    let distance = |light: &PunctualLight| light.position.distance(bounds.centre());
    let distant = |light: &PunctualLight| light.kind != LightKind::Directional && distance(light) > DISTANT * radius;
    if !radius.is_finite() || scene.cameras.is_empty() || !(directional || scene.lights.iter().any(distant)) {
        return (1, Vec::new());
    }
    let lookout = Lookout::new(scene);
    let mut ratio = 0.0f64;
    let mut sights = Vec::new();
    for camera in scene.cameras.iter().filter(|camera| camera.unusable.is_none()) {
        let view = ViewUniform::new(camera, scene.origin(), [16, 9], Vec2::ZERO, 0, 0, None);
        let Some(sight) = lookout.sight(&view) else { continue };
        ratio = ratio.max(radius / sight.radius);
        sights.push((camera, sight));
    }
    let ratio = ratio.min(1e12);
    let faces = if !directional || ratio <= LARGE { 1 } else { 1 + (ratio.ln() / STEP.ln()).ceil() as usize };
    let width = |light: &PunctualLight, sight: &Sight| match light.kind {
        LightKind::Directional if faces > 1 => 2.0 * sight.radius,
        LightKind::Directional => 2.0 * radius,
        LightKind::Spot { outer, .. } if outer <= CUBE_FACE_OUTER => {
            2.0 * f64::from(outer).tan() * (light.position - scene.origin()).distance(sight.centre)
        }
        _ => 2.0 * (light.position - scene.origin()).distance(sight.centre),
    };
    let coarse = |light: &PunctualLight| {
        let seen = sights.iter().map(|(camera, sight)| CoarseLight {
            light: light.name.clone(),
            camera: camera.name.clone(),
            face_width: width(light, sight),
            sight_width: 2.0 * sight.radius,
        });
        seen.max_by(|left, right| (left.face_width * right.sight_width).total_cmp(&(right.face_width * left.sight_width)))
    };
    let lights = scene.lights.iter().filter(|light| light.kind == LightKind::Directional || distant(light)).filter_map(coarse);
    (faces, lights.collect())
}

/// See [`facts`].
const LARGE: f64 = 16.0;

/// See [`facts`].
const STEP: f64 = 8.0;

/// A light is far away at so many radii of the scene.
const DISTANT: f64 = 8.0;
