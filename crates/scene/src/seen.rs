//! What the cameras of a scene see, in a few rays: enough to know how large and how bright the things are that a picture will show.

use crate::{Camera, Scene};
use glam::DVec3;

/// Cameras that are asked, and rays through each picture (fewer where there are so many triangles that it would take long).
const CAMERAS: usize = 4;
const RAYS: [usize; 2] = [16, 9];
const TESTS: usize = 100_000_000;

/// A point on a surface that a camera sees, world space.
pub(crate) struct SeenPoint {
    pub position: DVec3,
    /// Unit, either side.
    pub normal: DVec3,
    /// To the camera, metres.
    pub distance: f64,
}

impl Scene {
    /// Points that the first cameras see, on a grid over each picture. Surfaces of area lights are looked through.
    pub(crate) fn seen_points(&self) -> Vec<SeenPoint> {
        let mut cameras: Vec<Camera> = self.cameras.iter().filter(|camera| camera.unusable.is_none()).take(CAMERAS).cloned().collect();
        if cameras.is_empty() {
            cameras.extend(self.camera(None));
        }
        let surfaces = SeenSurfaces::new(self);
        let budget = TESTS / surfaces.triangles.max(1) / cameras.len().max(1);
        let [columns, rows] = if budget >= RAYS[0] * RAYS[1] { RAYS } else { [8, 4] };
        let mut points = Vec::new();
        for camera in &cameras {
            let tangent = (camera.yfov / 2.0).tan();
            for index in 0..columns * rows {
                let at = |place: usize, count: usize| (place as f64 + 0.5) / count as f64 * 2.0 - 1.0;
                let (x, y) = (at(index % columns, columns), at(index / columns, rows));
                // The picture's shape is not known here; most are about this wide.
                let ray = camera.forward + camera.right * (x * tangent * 16.0 / 9.0) + camera.up * (y * tangent);
                points.extend(surfaces.first(camera.position, ray, camera.near));
            }
        }
        points
    }

    /// How large what the cameras see is, metres, > 0: of the nearer half of it, the median distance to its middle (coordinate by coordinate, the median).
    /// A sky dome, a ground that goes on for kilometres or a distant camera do not count for it. The radius of the whole scene where cameras see nothing.
    pub fn seen_size(&self) -> f64 {
        self.size_of(self.seen_points())
    }

    pub(crate) fn size_of(&self, mut points: Vec<SeenPoint>) -> f64 {
        points.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        points.truncate(points.len().div_ceil(2));
        let median = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(0.0)
        };
        let middle = DVec3::from_array([0, 1, 2].map(|axis| median(points.iter().map(|point| point.position[axis]).collect())));
        let size = median(points.iter().map(|point| point.position.distance(middle)).collect());
        [size, self.bounds().radius()].into_iter().find(|size| *size > 0.0 && size.is_finite()).unwrap_or(1.0)
    }
}

/// What rays meet.
struct SeenSurfaces<'a> {
    scene: &'a Scene,
    /// Local bounds of each mesh.
    bounds: Vec<[DVec3; 2]>,
    triangles: usize,
}

impl<'a> SeenSurfaces<'a> {
    fn new(scene: &'a Scene) -> Self {
        let bounds = scene.meshes.iter().map(|mesh| {
            mesh.positions.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[least, most], position| {
                [least.min(position.as_dvec3()), most.max(position.as_dvec3())]
            })
        });
        let triangles = scene.instances.iter().map(|instance| scene.meshes[instance.mesh].indices.len() / 3).sum();
        Self { scene, bounds: bounds.collect(), triangles }
    }

    /// The first surface beyond the near plane, without those of area lights. `ray` has length 1 along the view.
    fn first(&self, from: DVec3, ray: DVec3, near: f64) -> Option<SeenPoint> {
        let mut nearest = f64::INFINITY;
        let mut found = None;
        for instance in self.scene.instances.iter().filter(|instance| instance.area_light.is_none()) {
            let matrix = instance.world_from_local;
            let determinant = matrix.determinant();
            if !determinant.is_finite() || determinant == 0.0 {
                continue;
            }
            let inverse = matrix.inverse();
            let (origin, direction) = (inverse.transform_point3(from), inverse.transform_vector3(ray));
            let mesh = &self.scene.meshes[instance.mesh];
            if !meets_box(self.bounds[instance.mesh], origin, direction, nearest) {
                continue;
            }
            for corners in mesh.indices.chunks_exact(3) {
                let [a, b, c] = [corners[0], corners[1], corners[2]].map(|index| mesh.positions[index as usize].as_dvec3());
                if let Some(distance) = meets_triangle([a, b, c], origin, direction).filter(|distance| (near..nearest).contains(distance)) {
                    nearest = distance;
                    found = Some((matrix, [a, b, c]));
                }
            }
        }
        let (matrix, corners) = found?;
        let [a, b, c] = corners.map(|corner| matrix.transform_point3(corner));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Some(SeenPoint { position: from + ray * nearest, normal, distance: nearest * ray.length() })
    }
}

fn meets_box([least, most]: [DVec3; 2], origin: DVec3, direction: DVec3, nearest: f64) -> bool {
    let (mut enter, mut leave) = (0.0_f64, nearest);
    for axis in 0..3 {
        let inverse = 1.0 / direction[axis];
        let (a, b) = ((least[axis] - origin[axis]) * inverse, (most[axis] - origin[axis]) * inverse);
        // NaN, from a ray within a plane of the box, leaves the interval as it is.
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    enter <= leave * (1.0 + 1e-12)
}

/// Distance along the ray, in lengths of `direction`.
fn meets_triangle([a, b, c]: [DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let offset = origin - a;
    let u = offset.dot(across) / determinant;
    let along = offset.cross(ab);
    let v = direction.dot(along) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some(ac.dot(along) / determinant)
}
