//! The estimator: one path of light, from the eye to the lights.

use crate::{
    geometry::{Geometry, Segment, lift},
    light::Lights,
    sampler::Sampler,
    surface::{Surface, Surfaces},
};
use glam::DVec3;
use lobelia_lobes::sampling::{brdf_pdf, sample_brdf};
use lobelia_scene::{LightClass, LightTransport, Scene};
use std::fmt;

/// Which light a picture holds.
// A set takes 512 bytes; there is one in a render, and it is read at every vertex.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightPaths {
    /// Light that scatters exactly once. Lights that are seen directly are not in it.
    Direct,
    /// Light that scatters exactly twice.
    OneBounce,
    /// Everything that scatters at most this often, lights and environment seen directly included.
    Full {
        /// Most scattering events of a path, at least 1.
        depth: u32,
    },
    /// Of each class of light exactly this, at most 1000 scattering events. Other lights stay where they are and stop rays, but are black.
    Only(LightTransport),
}

impl LightPaths {
    /// The light, by class and number of scattering events.
    pub fn transport(&self) -> LightTransport {
        match self {
            Self::Direct => LightTransport::of_all([1]),
            Self::OneBounce => LightTransport::of_all([2]),
            Self::Full { depth } => LightTransport::of_all(0..=*depth),
            Self::Only(transport) => *transport,
        }
    }
}

impl fmt::Display for LightPaths {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct => formatter.write_str("direct"),
            Self::OneBounce => formatter.write_str("one-bounce"),
            Self::Full { depth } => write!(formatter, "full, up to {depth} scattering events"),
            Self::Only(transport) => write!(formatter, "{transport}"),
        }
    }
}

/// Light that is wanted, and how far paths must go for it.
pub struct Wanted {
    set: LightTransport,
    depth: u32,
}

impl Wanted {
    pub fn new(paths: &LightPaths) -> Self {
        let set = paths.transport();
        Self { set, depth: set.depth().unwrap_or(0) }
    }
}

/// A scene made ready for rays.
pub struct World {
    pub scene: Scene,
    pub geometry: Geometry,
    pub surfaces: Surfaces,
    pub lights: Lights,
    /// Whether any material has holes.
    pub cut_outs: bool,
}

/// Holes of cut-outs that one ray goes through at most.
const HOLES: usize = 256;

/// What a ray meets first. Surfaces are by far the most frequent, and a box for each would cost more than moving it.
#[allow(clippy::large_enum_variant)]
enum Meeting {
    Nothing,
    Emitter { radiance: DVec3, pdf: f64 },
    Surface { surface: Surface, distance: f64, triangle: usize },
}

impl World {
    pub fn new(scene: &Scene) -> Self {
        let geometry = Geometry::new(scene);
        let surfaces = Surfaces::new(scene);
        let lights = Lights::new(scene, &geometry, &surfaces);
        let cut_outs = scene.materials.iter().any(|material| material.alpha_mode != lobelia_scene::AlphaMode::Opaque);
        Self { scene: scene.clone(), geometry, surfaces, lights, cut_outs }
    }

    fn meet(&self, segment: &Segment) -> Meeting {
        let emitter = self.lights.nearest_emitter(segment, None);
        let mut rest = Segment { reach: emitter.map_or(segment.reach, |hit| hit.distance), ..*segment };
        let mut passed = 0.0;
        for _ in 0..HOLES {
            let Some(hit) = self.geometry.nearest(&rest) else { break };
            if let Some(surface) = self.surfaces.at(&self.scene, &self.geometry, &rest, &hit) {
                return Meeting::Surface { surface, distance: passed + hit.distance, triangle: hit.triangle };
            }
            // A hole: go on behind it.
            let step = hit.distance + 4e-6 * (rest.origin.abs().max_element() + hit.distance + 0.1);
            passed += step;
            rest = Segment { origin: rest.origin + rest.direction * step, direction: rest.direction, reach: rest.reach - step };
        }
        emitter.map_or(Meeting::Nothing, |hit| Meeting::Emitter {
            radiance: hit.radiance,
            pdf: self.lights.emitter_pdf(hit.emitter, segment.origin, segment.direction, hit.distance),
        })
    }

    /// Whether light arrives along a ray: not stopped by a surface, nor by an area light other than the one that it comes from.
    fn is_free(&self, segment: &Segment, emitter: Option<usize>) -> bool {
        if self.lights.nearest_emitter(segment, emitter).is_some() {
            return false;
        }
        // Cut-outs are rare: only where the quick test is stopped are holes looked for.
        self.geometry.is_free(segment) || (self.cut_outs && matches!(self.meet(segment), Meeting::Nothing | Meeting::Emitter { .. }))
    }

    /// Radiance that arrives along a ray, one sample of it. What is left out changes no random number, so that a picture is the sum of those of its classes.
    pub fn radiance(&self, origin: DVec3, direction: DVec3, light: &Wanted, sampler: &mut Sampler) -> DVec3 {
        let mut segment = Segment { origin, direction, reach: f64::INFINITY };
        let mut radiance = DVec3::ZERO;
        let mut throughput = DVec3::ONE;
        // Density of the direction that was followed; what the eye sees is found in no other way.
        let mut followed: Option<f64> = None;
        for scattered in 0..=light.depth {
            // Balance heuristic: what is found by following counts by its share of both densities.
            let share = |light: Option<f64>| match (followed, light) {
                (Some(followed), Some(light)) => followed / (followed + light),
                _ => 1.0,
            };
            let (surface, distance, triangle) = match self.meet(&segment) {
                Meeting::Nothing => {
                    if let (Some(sky), true) = (&self.lights.sky, light.set.has(LightClass::Environment, scattered)) {
                        radiance += throughput * sky.radiance(segment.direction) * share(Some(sky.pdf(segment.direction)));
                    }
                    break;
                }
                Meeting::Emitter { radiance: emitted, pdf } => {
                    if light.set.has(LightClass::Area, scattered) {
                        radiance += throughput * emitted * share(Some(pdf));
                    }
                    break;
                }
                Meeting::Surface { surface, distance, triangle } => (surface, distance, triangle),
            };
            if surface.unlit {
                // A colour for the eye alone, which passes draw as emission that is seen.
                if scattered == 0 && light.set.has(LightClass::Emissive, 0) {
                    radiance += throughput * surface.emitted;
                }
                break;
            }
            if light.set.has(LightClass::Emissive, scattered) && surface.emitted != DVec3::ZERO {
                let cosine = -surface.true_normal.dot(segment.direction);
                let pdf = self.lights.triangle_pdf(&self.geometry, triangle, cosine, distance);
                radiance += throughput * surface.emitted * share(pdf);
            }
            if scattered == light.depth {
                break;
            }
            let to_viewer = -segment.direction;
            if light.set.has_any(scattered + 1) {
                radiance += throughput * self.light_at(&surface, to_viewer, &light.set, scattered + 1, sampler);
            }
            let Some(sample) = sample_brdf(&surface.brdf, surface.normal, to_viewer, sampler.pair()) else { break };
            throughput *= if surface.normal == surface.geometric_normal {
                sample.weight
            } else {
                let f = surface.brdf.evaluate_brdf(surface.normal, surface.geometric_normal, sample.direction, to_viewer);
                f * (surface.normal.dot(sample.direction) / sample.pdf)
            };
            if !(throughput.max_element() > 0.0 && throughput.is_finite()) {
                break;
            }
            followed = Some(sample.pdf);
            let origin = lift(surface.position, surface.true_normal, sample.direction);
            segment = Segment { origin, direction: sample.direction, reach: f64::INFINITY };
        }
        radiance
    }

    /// Next-event estimation: one sample of every light that is wanted after `count` scattering events.
    fn light_at(&self, surface: &Surface, to_viewer: DVec3, wanted: &LightTransport, count: u32, sampler: &mut Sampler) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for light in 0..self.lights.count() {
            let u = if self.lights.is_random(light) { sampler.pair() } else { [0.0; 2] };
            if !wanted.has(self.lights.class(light), count) {
                continue;
            }
            let Some(sample) = self.lights.sample(light, &self.scene, &self.geometry, &self.surfaces, surface.position, u) else {
                continue;
            };
            let f = surface.brdf.evaluate_brdf(surface.normal, surface.geometric_normal, sample.direction, to_viewer);
            if f == DVec3::ZERO {
                continue;
            }
            let origin = lift(surface.position, surface.true_normal, sample.direction);
            // Short of the light itself.
            let reach = sample.distance * (1.0 - 1e-5) - (origin - surface.position).length();
            if !self.is_free(&Segment { origin, direction: sample.direction, reach }, sample.emitter) {
                continue;
            }
            let share = sample.pdf.map_or(1.0, |pdf| pdf / (pdf + brdf_pdf(&surface.brdf, surface.normal, to_viewer, sample.direction)));
            sum += f * sample.weight * (surface.normal.dot(sample.direction) * share);
        }
        sum
    }
}
