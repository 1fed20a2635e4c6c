//! What rays meet: triangles through a bounding volume hierarchy, and lights of exact shape.

use glam::{DVec3, Vec3A};
use lobelia_scene::{Scene, Triangle};
use obvhs::{
    BvhBuildParams,
    cwbvh::{CwBvh, builder::build_cwbvh_from_tris},
    ray::{Ray, RayHit},
    rt_triangle::RtTriangle,
};
use std::time::Duration;

/// A ray in scene space.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// Nothing at or beyond this distance counts.
    pub reach: f64,
}

/// A triangle that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub triangle: usize,
    pub distance: f64,
}

/// The surfaces of a scene that reflect. Area lights are not among them: their shapes are met exactly.
pub struct Geometry {
    pub triangles: Vec<Triangle>,
    /// Index of a triangle's first corner in its mesh's index list.
    pub first_index: Vec<u32>,
    tree: CwBvh,
    tests: Vec<RtTriangle>,
}

impl Geometry {
    pub fn new(scene: &Scene) -> Self {
        let mut first_index = Vec::new();
        let mut kept = Vec::new();
        let mut within = (usize::MAX, 0);
        for triangle in scene.triangles() {
            within = if within.0 == triangle.instance { (within.0, within.1 + 3) } else { (triangle.instance, 0) };
            if scene.instances[triangle.instance].area_light.is_none() {
                kept.push(triangle);
                first_index.push(within.1);
            }
        }
        let corners: Vec<obvhs::triangle::Triangle> = kept
            .iter()
            .map(|triangle| {
                let [v0, v1, v2] = triangle.positions.map(Vec3A::from);
                obvhs::triangle::Triangle { v0, v1, v2 }
            })
            .collect();
        let tree = build_cwbvh_from_tris(&corners, BvhBuildParams::medium_build(), &mut Duration::default());
        let tests = tree.primitive_indices.iter().map(|index| RtTriangle::from(&corners[*index as usize])).collect();
        Self { triangles: kept, first_index, tree, tests }
    }

    /// The nearest triangle.
    pub fn nearest(&self, segment: &Segment) -> Option<Hit> {
        if self.triangles.is_empty() {
            return None;
        }
        let ray = ray(segment);
        let mut hit = RayHit::none();
        self.tree
            .ray_traverse(ray, &mut hit, |ray, index| self.tests[index].intersect(ray))
            .then(|| Hit { triangle: self.tree.primitive_indices[hit.primitive_id as usize] as usize, distance: f64::from(hit.t) })
    }

    /// Whether nothing is in the way.
    pub fn is_free(&self, segment: &Segment) -> bool {
        self.triangles.is_empty() || self.tree.ray_traverse_miss(ray(segment), |ray, index| self.tests[index].intersect(ray))
    }

    /// True normal of a triangle, on the side of its front.
    pub fn true_normal(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.triangles[triangle].positions.map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).normalize_or(DVec3::Y)
    }

    /// Barycentric coordinates of the point of a triangle's plane that a ray meets, in `f64`, and that point: nearer to the plane than the `f32` hit.
    pub fn locate(&self, triangle: usize, segment: &Segment) -> ([f64; 3], DVec3) {
        let [a, b, c] = self.triangles[triangle].positions.map(|corner| corner.as_dvec3());
        let (u, v) = (b - a, c - a);
        let p = segment.direction.cross(v);
        let determinant = u.dot(p);
        if determinant == 0.0 {
            return ([1.0, 0.0, 0.0], a);
        }
        let s = segment.origin - a;
        let x = (s.dot(p) / determinant).clamp(0.0, 1.0);
        let y = (segment.direction.dot(s.cross(u)) / determinant).clamp(0.0, 1.0 - x);
        ([1.0 - x - y, x, y], a + u * x + v * y)
    }
}

fn ray(segment: &Segment) -> Ray {
    let reach = if segment.reach.is_finite() { segment.reach as f32 } else { f32::INFINITY };
    Ray::new(segment.origin.as_vec3a(), segment.direction.as_vec3a(), 0.0, reach)
}

/// Where a ray begins that leaves a surface: lifted off its triangle by more than `f32` can err at this distance from the scene's origin.
pub fn lift(position: DVec3, true_normal: DVec3, direction: DVec3) -> DVec3 {
    let side = if true_normal.dot(direction) >= 0.0 { 1.0 } else { -1.0 };
    position + true_normal * (side * 4e-6 * (position.abs().max_element() + 0.1))
}
