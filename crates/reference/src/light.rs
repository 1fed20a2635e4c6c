//! Lights: how each is sampled from a point, and how likely a ray is to be that sample.

use crate::{environment::Sky, geometry::Geometry, geometry::Segment, surface::Surfaces};
use glam::{DMat3, DVec2, DVec3};
use lobelia_lobes::{
    light::spot_falloff,
    luminance,
    sampling::{cone_pdf, sample_cone},
};
use lobelia_scene::{AreaShape, LightClass, LightKind, Scene, triangulate};
use std::f64::consts::TAU;

/// Light that arrives at a point from one direction.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit, towards the light.
    pub direction: DVec3,
    /// How far the light is; infinite for skies.
    pub distance: f64,
    /// Radiance over density, or irradiance on a facing surface for a light without extent.
    pub weight: DVec3,
    /// Density over solid angle; `None` for lights that no ray can meet.
    pub pdf: Option<f64>,
    /// The area light, which does not stand in its own way.
    pub emitter: Option<usize>,
}

/// An [`AreaShape`] in the form that sampling wants.
enum Shape {
    Quad([f64; 2]),
    Disk(f64),
    Sphere(f64),
    Polygon(Polygon),
}

/// A polygon and the triangles that cover it, with running sums of their areas.
struct Polygon {
    outline: Vec<DVec2>,
    triangles: Vec<[DVec2; 3]>,
    areas: Vec<f64>,
}

impl Polygon {
    fn new(shape: &AreaShape) -> Self {
        let corners = shape.outline().unwrap_or_default();
        let outline: Vec<DVec2> = corners.iter().map(|corner| corner.as_dvec2()).collect();
        let triangles: Vec<[DVec2; 3]> = triangulate(&corners).into_iter().map(|indices| indices.map(|index| outline[index])).collect();
        let mut total = 0.0;
        let sum = |[a, b, c]: &[DVec2; 3]| {
            total += 0.5 * (*b - *a).perp_dot(*c - *a).abs();
            total
        };
        let areas = triangles.iter().map(sum).collect();
        Self { outline, triangles, areas }
    }

    fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    fn sample(&self, [u, v]: [f64; 2]) -> DVec2 {
        let target = u * self.area();
        let index = self.areas.partition_point(|sum| *sum <= target).min(self.areas.len() - 1);
        let before = if index > 0 { self.areas[index - 1] } else { 0.0 };
        // What is left of the number after the choice is uniform again.
        let root = ((target - before) / (self.areas[index] - before)).clamp(0.0, 1.0).sqrt();
        let [a, b, c] = self.triangles[index];
        a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v)
    }

    fn contains(&self, at: DVec2) -> bool {
        let edges = self.outline.iter().zip(self.outline.iter().cycle().skip(1));
        let crossings = edges
            .filter(|(from, to)| (from.y > at.y) != (to.y > at.y) && at.x < from.x + (at.y - from.y) / (to.y - from.y) * (to.x - from.x));
        crossings.count() % 2 == 1
    }
}

impl Shape {
    fn new(shape: &AreaShape) -> Self {
        match shape {
            AreaShape::Quad { width, height } => Self::Quad([0.5 * f64::from(*width), 0.5 * f64::from(*height)]),
            AreaShape::Disk { radius } => Self::Disk(f64::from(*radius)),
            AreaShape::Sphere { radius } => Self::Sphere(f64::from(*radius)),
            AreaShape::Polygon { .. } => Self::Polygon(Polygon::new(shape)),
        }
    }
}

/// A flat or round shape that emits.
struct Emitter {
    shape: Shape,
    two_sided: bool,
    centre: DVec3,
    /// Local axes in scene space, their lengths included.
    axes: DMat3,
    radiance: DVec3,
    /// Local coordinates from those about the centre.
    inverse: DMat3,
    /// One factor for all three axes.
    uniform_scale: bool,
}

/// An emitter that a ray met.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    pub emitter: usize,
    pub distance: f64,
    pub radiance: DVec3,
}

/// All lights of a scene.
pub struct Lights {
    punctual: Vec<lobelia_scene::PunctualLight>,
    origin: DVec3,
    emitters: Vec<Emitter>,
    /// Emissive triangles, running sums of their power, and the place of a triangle among them.
    triangles: Vec<usize>,
    powers: Vec<f64>,
    place: Vec<u32>,
    pub sky: Option<Sky>,
}

const NO_LIGHT: u32 = u32::MAX;

impl Lights {
    pub fn new(scene: &Scene, geometry: &Geometry, surfaces: &Surfaces) -> Self {
        let origin = scene.origin();
        let emitters = scene
            .area_lights
            .iter()
            .map(|light| {
                let axes = DMat3::from_mat4(light.world_from_local);
                let lengths = [axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()];
                let even = lengths.iter().all(|length| (length / lengths[0] - 1.0).abs() < 1e-6);
                let square = axes.x_axis.dot(axes.y_axis).abs() + axes.x_axis.dot(axes.z_axis).abs() + axes.y_axis.dot(axes.z_axis).abs();
                Emitter {
                    shape: Shape::new(&light.shape),
                    two_sided: light.two_sided,
                    centre: light.world_from_local.transform_point3(DVec3::ZERO) - origin,
                    axes,
                    inverse: axes.inverse(),
                    radiance: light.radiance.as_dvec3(),
                    uniform_scale: even && square < 1e-6 * lengths[0] * lengths[0],
                }
            })
            .collect();
        let mut lights = Self {
            punctual: scene.lights.clone(),
            origin,
            emitters,
            triangles: Vec::new(),
            powers: Vec::new(),
            place: vec![NO_LIGHT; geometry.triangles.len()],
            sky: scene.environment.as_ref().and_then(Sky::new),
        };
        let mut total = 0.0;
        for triangle in 0..geometry.triangles.len() {
            let power = luminance(surfaces.mean_emission(scene, geometry, triangle)) * area(geometry, triangle);
            if power > 0.0 {
                total += power;
                lights.place[triangle] = lights.triangles.len() as u32;
                lights.triangles.push(triangle);
                lights.powers.push(total);
            }
        }
        lights
    }

    /// How many samples [`Lights::samples`] takes, so how many pairs of numbers it needs.
    pub fn count(&self) -> usize {
        self.punctual.len() + self.emitters.len() + usize::from(!self.triangles.is_empty()) + usize::from(self.sky.is_some())
    }

    /// The class of light `index`.
    pub fn class(&self, index: usize) -> LightClass {
        let index = match index.checked_sub(self.punctual.len()) {
            Some(index) => index,
            None => return LightClass::Punctual,
        };
        match index.checked_sub(self.emitters.len()) {
            None => LightClass::Area,
            Some(0) if !self.triangles.is_empty() => LightClass::Emissive,
            Some(_) => LightClass::Environment,
        }
    }

    /// Whether a light's sample is chosen by numbers: lights without extent leave no choice.
    pub fn is_random(&self, index: usize) -> bool {
        index >= self.punctual.len()
    }

    /// The sample of light `index` at a point; `None` where none of its light arrives.
    pub fn sample(
        &self,
        index: usize,
        scene: &Scene,
        geometry: &Geometry,
        surfaces: &Surfaces,
        position: DVec3,
        u: [f64; 2],
    ) -> Option<LightSample> {
        if let Some(light) = self.punctual.get(index) {
            return self.sample_punctual(light, position);
        }
        let index = index - self.punctual.len();
        if let Some(emitter) = self.emitters.get(index) {
            return emitter.sample(position, u).map(|sample| LightSample { emitter: Some(index), ..sample });
        }
        if index == self.emitters.len() && !self.triangles.is_empty() {
            return self.sample_triangle(scene, geometry, surfaces, position, u);
        }
        let sky = self.sky.as_ref()?;
        let (direction, pdf) = sky.sample(u);
        (pdf > 0.0).then(|| LightSample {
            direction,
            distance: f64::INFINITY,
            weight: sky.radiance(direction) / pdf,
            pdf: Some(pdf),
            emitter: None,
        })
    }

    fn sample_punctual(&self, light: &lobelia_scene::PunctualLight, position: DVec3) -> Option<LightSample> {
        let intensity = light.intensity.as_dvec3();
        if light.kind == LightKind::Directional {
            return Some(LightSample { direction: -light.direction, distance: f64::INFINITY, weight: intensity, pdf: None, emitter: None });
        }
        let offset = light.position - self.origin - position;
        let distance = offset.length();
        if distance == 0.0 {
            return None;
        }
        let direction = offset / distance;
        let falloff = match light.kind {
            LightKind::Spot { inner, outer } => spot_falloff(-direction.dot(light.direction), inner.into(), outer.into()),
            LightKind::Point | LightKind::Directional => 1.0,
        };
        (falloff > 0.0).then(|| LightSample {
            direction,
            distance,
            weight: intensity * falloff / (distance * distance),
            pdf: None,
            emitter: None,
        })
    }

    fn sample_triangle(
        &self,
        scene: &Scene,
        geometry: &Geometry,
        surfaces: &Surfaces,
        position: DVec3,
        [u, v]: [f64; 2],
    ) -> Option<LightSample> {
        let total = self.powers.last()?;
        let target = u * total;
        let index = self.powers.partition_point(|sum| *sum <= target).min(self.powers.len() - 1);
        let before = if index > 0 { self.powers[index - 1] } else { 0.0 };
        // What is left of the number after the choice is uniform again.
        let u = ((target - before) / (self.powers[index] - before)).clamp(0.0, 1.0);
        let triangle = self.triangles[index];
        let root = u.sqrt();
        let weights = [1.0 - root, root * (1.0 - v), root * v];
        let corners = geometry.triangles[triangle].positions.map(|corner| corner.as_dvec3());
        let point = corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2];
        let offset = point - position;
        let distance = offset.length();
        let direction = offset.try_normalize()?;
        let cosine = -geometry.faces[triangle].normal.dot(direction);
        if cosine <= 0.0 {
            return None;
        }
        let pdf = self.triangle_pdf(geometry, triangle, cosine, distance)?;
        let radiance = surfaces.emission(scene, geometry, triangle, weights);
        Some(LightSample { direction, distance, weight: radiance / pdf, pdf: Some(pdf), emitter: None })
    }

    /// Density over solid angle with which a point of an emissive triangle is sampled; `None` for triangles that are not.
    pub fn triangle_pdf(&self, geometry: &Geometry, triangle: usize, cosine: f64, distance: f64) -> Option<f64> {
        let index = self.place[triangle];
        if index == NO_LIGHT || cosine <= 0.0 {
            return None;
        }
        let index = index as usize;
        let power = self.powers[index] - if index > 0 { self.powers[index - 1] } else { 0.0 };
        let share = power / self.powers.last()?;
        Some(share * distance * distance / (area(geometry, triangle) * cosine))
    }

    /// The nearest area light but one that a ray meets before its reach, from either side; light comes only from the emitting one.
    pub fn nearest_emitter(&self, segment: &Segment, but: Option<usize>) -> Option<EmitterHit> {
        let others = self.emitters.iter().enumerate().filter(|(index, _)| Some(*index) != but);
        let hits = others.filter_map(|(index, emitter)| {
            let (distance, front) = emitter.intersect(segment)?;
            Some(EmitterHit { emitter: index, distance, radiance: if front { emitter.radiance } else { DVec3::ZERO } })
        });
        hits.min_by(|left, right| left.distance.total_cmp(&right.distance))
    }

    /// Density over solid angle with which [`Lights::sample`] chooses the point of an area light that a ray from `position` meets.
    pub fn emitter_pdf(&self, emitter: usize, position: DVec3, direction: DVec3, distance: f64) -> f64 {
        self.emitters[emitter].pdf(position, direction, distance)
    }
}

fn area(geometry: &Geometry, triangle: usize) -> f64 {
    let [a, b, c] = geometry.triangles[triangle].positions.map(|corner| corner.as_dvec3());
    0.5 * (b - a).cross(c - a).length()
}

impl Emitter {
    /// Area of the flat shapes.
    fn flat_area(&self) -> f64 {
        let unit = self.axes.x_axis.cross(self.axes.y_axis).length();
        unit * match &self.shape {
            Shape::Quad([x, y]) => 4.0 * x * y,
            Shape::Disk(radius) => std::f64::consts::PI * radius * radius,
            Shape::Polygon(polygon) => polygon.area(),
            Shape::Sphere(_) => 0.0,
        }
    }

    /// Cosine between what a flat shape emits and a ray that meets it: positive where it is lit.
    fn facing_cosine(&self, direction: DVec3) -> f64 {
        let cosine = -self.facing().dot(direction);
        if self.two_sided { cosine.abs() } else { cosine }
    }

    /// The direction that flat shapes emit to.
    fn facing(&self) -> DVec3 {
        let cross = self.axes.x_axis.cross(self.axes.y_axis).normalize_or(DVec3::Z);
        // Local -Z, whichever way the frame is turned.
        if cross.dot(self.axes.z_axis) >= 0.0 { -cross } else { cross }
    }

    fn sample(&self, position: DVec3, [u, v]: [f64; 2]) -> Option<LightSample> {
        let local = match &self.shape {
            Shape::Quad([half_x, half_y]) => DVec3::new((2.0 * u - 1.0) * half_x, (2.0 * v - 1.0) * half_y, 0.0),
            Shape::Polygon(polygon) => polygon.sample([u, v]).extend(0.0),
            Shape::Disk(radius) => {
                let (radius, angle) = (radius * u.sqrt(), TAU * v);
                DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
            }
            Shape::Sphere(radius) if self.uniform_scale => return self.sample_ball(*radius, position, [u, v]),
            Shape::Sphere(radius) => {
                let z = 1.0 - 2.0 * u;
                let s = (1.0 - z * z).max(0.0).sqrt();
                DVec3::new(s * (TAU * v).cos(), s * (TAU * v).sin(), z) * *radius
            }
        };
        let offset = self.centre + self.axes * local - position;
        let distance = offset.length();
        let direction = offset.try_normalize()?;
        let pdf = self.pdf(position, direction, distance);
        // The far side of an ellipsoid is hidden by its near side.
        let faces = match self.shape {
            Shape::Sphere(_) => (self.inverse.transpose() * local).dot(direction) < 0.0,
            _ => self.facing_cosine(direction) > 0.0,
        };
        (faces && pdf > 0.0 && pdf.is_finite()).then(|| LightSample {
            direction,
            distance,
            weight: self.radiance / pdf,
            pdf: Some(pdf),
            emitter: None,
        })
    }

    /// A direction in the cone that a sphere fills.
    fn sample_ball(&self, local_radius: f64, position: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let (offset, radius) = (self.centre - position, local_radius * self.axes.x_axis.length());
        let squared = offset.length_squared();
        if squared <= radius * radius {
            return None;
        }
        let sine_squared = radius * radius / squared;
        let (axis, versine) = (offset / squared.sqrt(), one_minus_cosine(sine_squared));
        let direction = sample_cone(axis, versine, u);
        let segment = Segment { origin: position, direction, reach: f64::INFINITY };
        // At the rim rounding may miss the sphere; its rim is as far away as the tangent is long.
        let distance = self.intersect(&segment).map_or((squared - radius * radius).sqrt(), |hit| hit.0);
        let pdf = cone_pdf(axis, versine, axis);
        Some(LightSample { direction, distance, weight: self.radiance / pdf, pdf: Some(pdf), emitter: None })
    }

    fn pdf(&self, position: DVec3, direction: DVec3, distance: f64) -> f64 {
        match self.shape {
            Shape::Quad(_) | Shape::Disk(_) | Shape::Polygon(_) => {
                let cosine = self.facing_cosine(direction);
                if cosine <= 0.0 { 0.0 } else { distance * distance / (self.flat_area() * cosine) }
            }
            Shape::Sphere(radius) if self.uniform_scale => {
                let squared = (self.centre - position).length_squared();
                let radius = radius * self.axes.x_axis.length();
                if squared <= radius * radius { 0.0 } else { cone_pdf(direction, one_minus_cosine(radius * radius / squared), direction) }
            }
            Shape::Sphere(radius) => {
                // Uniform over the unit sphere; an area element grows by |det M| |M^-T n|.
                let local = self.inverse * (position + direction * distance - self.centre);
                let normal = self.inverse.transpose() * local.normalize_or(DVec3::Z);
                let element = self.axes.determinant().abs() * normal.length();
                let cosine = -normal.normalize_or(DVec3::Z).dot(direction);
                if cosine <= 0.0 { 0.0 } else { distance * distance / (2.0 * TAU * radius * radius * element * cosine) }
            }
        }
    }

    /// Distance, and whether the emitting side was met.
    fn intersect(&self, segment: &Segment) -> Option<(f64, bool)> {
        let origin = self.inverse * (segment.origin - self.centre);
        let direction = self.inverse * segment.direction;
        match &self.shape {
            Shape::Quad(_) | Shape::Disk(_) | Shape::Polygon(_) => {
                let distance = -origin.z / direction.z;
                let at = (origin + direction * distance).truncate();
                let inside = match &self.shape {
                    Shape::Quad([half_x, half_y]) => at.x.abs() <= *half_x && at.y.abs() <= *half_y,
                    Shape::Polygon(polygon) => polygon.contains(at),
                    Shape::Disk(radius) | Shape::Sphere(radius) => at.length_squared() <= radius * radius,
                };
                let met = distance > 0.0 && distance < segment.reach && inside;
                met.then(|| (distance, self.facing_cosine(segment.direction) > 0.0))
            }
            Shape::Sphere(radius) => {
                let a = direction.length_squared();
                let b = origin.dot(direction);
                let c = origin.length_squared() - radius * radius;
                // The discriminant from the nearest point to the centre, which does not cancel for small far spheres.
                let nearest = origin - direction * (b / a);
                let discriminant = a * (radius * radius - nearest.length_squared());
                if discriminant < 0.0 {
                    return None;
                }
                let root = discriminant.sqrt();
                let distance = if c > 0.0 { c / (-b + root) } else { (-b + root) / a };
                (distance > 0.0 && distance < segment.reach).then_some((distance, c > 0.0))
            }
        }
    }
}

/// 1 - cos of an angle from the square of its sine, without cancellation.
fn one_minus_cosine(sine_squared: f64) -> f64 {
    sine_squared / (1.0 + (1.0 - sine_squared).max(0.0).sqrt())
}
