//! The factor that brings a scene's light into the range of half floats.
//!
//! Pictures between passes are half floats: full precision from 2^-14 to 65504. Sunlight of 100,000 lx off a metal is far above that range and a night
//! below it, so lights, emission and environment reach the device times a power of two, and whatever is read back is divided by it. Only what is
//! cheap to know is asked: what the cameras see, and how much light would fall there if nothing stood in between.

use crate::{AreaShape, Camera, LightKind, Scene};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// A picture whose diffuse radiance is usually in this range, and whose emission stays below [`MOST`], is left as it is.
const ORDINARY: std::ops::RangeInclusive<f64> = 1.0 / 256.0..=64.0;

/// Most that emission seen by the camera may be, with room for sums below 65504.
const MOST: f64 = 32768.0;

/// Least that usual diffuse radiance may become so that bright emission fits: 2^4 above where half floats lose digits.
const LEAST: f64 = 1.0 / 1024.0;

/// Largest exponent of the factor. Beyond it numbers are out of 32-bit floats' range as well.
const MOST_STOPS: f64 = 96.0;

/// Cameras that are asked, and rays through each picture (and fewer where there are so many triangles that it would take long).
const CAMERAS: usize = 4;
const RAYS: [usize; 2] = [16, 9];
const TESTS: usize = 100_000_000;

impl Scene {
    /// What light is multiplied by on the device: 1 for ordinary scenes, else the power of two that brings the upper quartile of diffuse radiance, as seen by
    /// the scene's cameras with every light unobstructed, to between 1/2 and 1; less where emission or environment would exceed half floats otherwise.
    ///
    /// It depends on the scene at its present time and nothing else. Highlights above 65504 over this factor are still cut off.
    pub fn pre_exposure(&self) -> f32 {
        let brightest = self.brightest_emission();
        let usual = self.usual_radiance();
        // Without light on any surface, emission is all that there is to see.
        let usual = if usual > 0.0 { usual } else { brightest };
        factor(usual, brightest)
    }

    /// The largest channel of everything that emits.
    fn brightest_emission(&self) -> f64 {
        let materials = self.materials.iter().map(|material| material.emissive.max_element());
        let lights = self.area_lights.iter().map(|light| light.radiance.max_element());
        let environment = self.environment.iter().flat_map(|environment| {
            environment.pixels.iter().map(|pixel| pixel.max_element() * environment.scale).filter(|value| value.is_finite())
        });
        materials.chain(lights).chain(environment).map(f64::from).fold(0.0, f64::max)
    }

    /// Upper quartile of what a white diffuse surface would reflect, over what the cameras see; 0 where no light reaches any of it.
    fn usual_radiance(&self) -> f64 {
        let lights = self.illuminants();
        if lights.is_empty() {
            return 0.0;
        }
        let cameras: Vec<Camera> = match self.cameras.iter().filter(|camera| camera.unusable.is_none()).take(CAMERAS) {
            cameras if !self.cameras.is_empty() => cameras.cloned().collect(),
            _ => self.camera(None).into_iter().collect(),
        };
        let seen = SeenSurfaces::new(self);
        let budget = (TESTS / seen.triangles.max(1) / cameras.len().max(1)).max(1);
        let [columns, rows] = if budget >= RAYS[0] * RAYS[1] { RAYS } else if budget >= 32 { [8, 4] } else { [3, 2] };
        let mut values = Vec::new();
        for camera in &cameras {
            let tangent = (camera.yfov / 2.0).tan();
            for index in 0..columns * rows {
                let at = |place: usize, count: usize| (place as f64 + 0.5) / count as f64 * 2.0 - 1.0;
                let (x, y) = (at(index % columns, columns), at(index / columns, rows));
                // The picture's shape is not known here; most are about this wide.
                let ray = camera.forward + camera.right * (x * tangent * 16.0 / 9.0) + camera.up * (y * tangent);
                if let Some((position, normal)) = seen.first(camera.position, ray, camera.near) {
                    let sum: f64 = lights.iter().map(|light| light.irradiance(position, normal)).sum();
                    values.push(sum / PI);
                }
            }
        }
        values.retain(|value| *value > 0.0 && value.is_finite());
        values.sort_by(f64::total_cmp);
        values.get(values.len() * 3 / 4).copied().unwrap_or(0.0)
    }

    fn illuminants(&self) -> Vec<Illuminant> {
        let punctual = self.lights.iter().map(|light| Illuminant {
            position: light.position,
            direction: light.direction,
            strength: f64::from(light.intensity.max_element()),
            kind: light.kind,
            area: 0.0,
        });
        let with_extent = self.area_lights.iter().map(|light| {
            let axes = DMat3::from_mat4(light.world_from_local);
            let stretch = axes.x_axis.cross(axes.y_axis).length();
            let area = match &light.shape {
                AreaShape::Quad { width, height } => f64::from(*width) * f64::from(*height) * stretch,
                AreaShape::Disk { radius } => PI * f64::from(*radius).powi(2) * stretch,
                AreaShape::Sphere { radius } => PI * f64::from(*radius).powi(2) * axes.determinant().abs().powf(2.0 / 3.0),
                AreaShape::Polygon { vertices } => crate::light::twice_signed_area(vertices).abs() / 2.0 * stretch,
            };
            Illuminant {
                position: light.world_from_local.transform_point3(DVec3::ZERO),
                direction: DVec3::ZERO,
                strength: f64::from(light.radiance.max_element()) * area,
                kind: LightKind::Point,
                area,
            }
        });
        punctual.chain(with_extent).filter(|light| light.strength > 0.0 && light.strength.is_finite()).collect()
    }
}

/// The power of two for scenes whose diffuse radiance is usually `usual` and whose emission is at most `brightest`.
fn factor(usual: f64, brightest: f64) -> f32 {
    if usual <= 0.0 || (ORDINARY.contains(&usual) && brightest <= MOST) {
        return 1.0;
    }
    let room = if brightest > 0.0 { MOST / brightest } else { f64::INFINITY };
    let target = (1.0 / usual).min(room.max(LEAST / usual));
    target.log2().floor().clamp(-MOST_STOPS, MOST_STOPS).exp2() as f32
}

/// A light as far as its irradiance is concerned.
struct Illuminant {
    position: DVec3,
    direction: DVec3,
    /// W/sr, or W/m^2 if directional.
    strength: f64,
    kind: LightKind,
    /// Of lights with extent, m^2: nothing is lit brighter than at their surface.
    area: f64,
}

impl Illuminant {
    /// On a surface, either side, W/m^2.
    fn irradiance(&self, position: DVec3, normal: DVec3) -> f64 {
        if self.kind == LightKind::Directional {
            return self.strength * normal.dot(self.direction).abs();
        }
        let offset = position - self.position;
        let distance = offset.length();
        let Some(direction) = offset.try_normalize() else { return 0.0 };
        let falloff = match self.kind {
            LightKind::Spot { inner, outer } => {
                let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
                ((direction.dot(self.direction) - outer) / (inner - outer).max(0.001)).clamp(0.0, 1.0).powi(2)
            }
            LightKind::Point | LightKind::Directional => 1.0,
        };
        self.strength * falloff * normal.dot(direction).abs() / (distance * distance + self.area / PI)
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

    /// The first surface, without those of area lights, and its unit normal; world space.
    fn first(&self, from: DVec3, ray: DVec3, near: f64) -> Option<(DVec3, DVec3)> {
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
        Some((from + ray * nearest, (b - a).cross(c - a).normalize_or_zero()))
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

#[cfg(test)]
mod tests {
    use super::factor;

    #[test]
    fn ordinary_scenes_are_left_alone_and_others_are_brought_into_range() {
        assert_eq!(factor(1.0, 100.0), 1.0);
        assert_eq!(factor(0.0, 0.0), 1.0, "nothing to see");
        assert_eq!(factor(0.01, 30_000.0), 1.0);
        // 683,000 lx, and a night of 1e-6 lx.
        assert_eq!(factor(683_000.0 / std::f64::consts::PI, 0.0), 0.5_f32.powi(18));
        assert_eq!(factor(1e-6 / std::f64::consts::PI, 0.0), 2.0_f32.powi(21));
        // A bright lamp that is seen: it fits as long as what it lights keeps its digits.
        assert_eq!(factor(1.0, 1e6), 0.5_f32.powi(5));
        assert_eq!(factor(1.0, 1e12), 0.5_f32.powi(10));
        for exponent in -40..40 {
            let scale = f64::exp2(f64::from(exponent));
            let value = factor(1e4 * scale, 3e5 * scale);
            let (bright, dim) = (3e5 * scale * f64::from(value), 1e4 * scale * f64::from(value));
            assert!(bright <= 32768.0 || dim <= 1.0, "2^{exponent}: {bright} {dim}");
            assert!(dim > 1.0 / 512.0, "2^{exponent}: {dim}");
        }
    }
}
