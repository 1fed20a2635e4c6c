//! What rays meet: triangles through a bounding volume hierarchy, and lights of exact shape.

use glam::{DMat3, DVec3, Vec3A};
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

/// A triangle's vertices and normal.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Vertices in its mesh, in the order of the corners.
    pub vertices: [u32; 3],
    /// Unit, on the side of the front.
    pub normal: DVec3,
}

/// How an instance turns directions.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// For tangents.
    pub linear: DMat3,
    /// For normals.
    pub normal: DMat3,
    /// Whether it mirrors.
    pub mirrored: bool,
}

/// The surfaces of a scene that reflect. Area lights are not among them: their shapes are met exactly.
pub struct Geometry {
    pub triangles: Vec<Triangle>,
    /// What is known of each triangle before any ray meets it.
    pub faces: Vec<Face>,
    /// World directions from local ones, for each instance.
    pub frames: Vec<Frame>,
    tree: CwBvh,
    tests: Vec<RtTriangle>,
}

impl Geometry {
    pub fn new(scene: &Scene) -> Self {
        let frames: Vec<Frame> = scene
            .instances
            .iter()
            .map(|instance| {
                let linear = DMat3::from_mat4(instance.world_from_local);
                Frame { linear, normal: linear.inverse().transpose(), mirrored: linear.determinant() < 0.0 }
            })
            .collect();
        let mut faces = Vec::new();
        let mut kept = Vec::new();
        let mut within = (usize::MAX, 0);
        for triangle in scene.triangles() {
            within = if within.0 == triangle.instance { (within.0, within.1 + 3) } else { (triangle.instance, 0) };
            let instance = &scene.instances[triangle.instance];
            if instance.area_light.is_none() {
                // Mirrored instances have two corners exchanged, as in `Scene::triangles`.
                let order = if frames[triangle.instance].mirrored { [0, 2, 1] } else { [0, 1, 2] };
                let indices = &scene.meshes[instance.mesh].indices;
                let [a, b, c] = triangle.positions.map(|corner| corner.as_dvec3());
                let normal = (b - a).cross(c - a).normalize_or(DVec3::Y);
                faces.push(Face { vertices: order.map(|place| indices[within.1 + place]), normal });
                kept.push(triangle);
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
        Self { triangles: kept, faces, frames, tree, tests }
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
