//! The estimator: one path of light, from the eye to the lights.

use crate::{
    geometry::{Geometry, Segment, lift},
    light::Lights,
    sampler::Sampler,
    surface::{Surface, Surfaces},
};
use glam::DVec3;
use lobelia_lobes::sampling::{brdf_pdf, sample_brdf};
use lobelia_scene::Scene;
use std::fmt;

/// Which light a picture holds.
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
}

impl LightPaths {
    /// Whether light that has scattered `count` times belongs to the picture.
    fn include(self, count: u32) -> bool {
        match self {
            Self::Direct => count == 1,
            Self::OneBounce => count == 2,
            Self::Full { depth } => count <= depth,
        }
    }

    /// Most scattering events.
    fn depth(self) -> u32 {
        match self {
            Self::Direct => 1,
            Self::OneBounce => 2,
            Self::Full { depth } => depth,
        }
    }
}

impl fmt::Display for LightPaths {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct => formatter.write_str("direct"),
            Self::OneBounce => formatter.write_str("one-bounce"),
            Self::Full { depth } => write!(formatter, "full, up to {depth} scattering events"),
        }
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

    /// Radiance that arrives along a ray, one sample of it.
    pub fn radiance(&self, origin: DVec3, direction: DVec3, paths: LightPaths, sampler: &mut Sampler) -> DVec3 {
        let mut segment = Segment { origin, direction, reach: f64::INFINITY };
        let mut radiance = DVec3::ZERO;
        let mut throughput = DVec3::ONE;
        // Density of the direction that was followed; what the eye sees is found in no other way.
        let mut followed: Option<f64> = None;
        for scattered in 0..=paths.depth() {
            // Balance heuristic: what is found by following counts by its share of both densities.
            let share = |light: Option<f64>| match (followed, light) {
                (Some(followed), Some(light)) => followed / (followed + light),
                _ => 1.0,
            };
            let (surface, distance, triangle) = match self.meet(&segment) {
                Meeting::Nothing => {
                    if let (Some(sky), true) = (&self.lights.sky, paths.include(scattered)) {
                        radiance += throughput * sky.radiance(segment.direction) * share(Some(sky.pdf(segment.direction)));
                    }
                    break;
                }
                Meeting::Emitter { radiance: emitted, pdf } => {
                    if paths.include(scattered) {
                        radiance += throughput * emitted * share(Some(pdf));
                    }
                    break;
                }
                Meeting::Surface { surface, distance, triangle } => (surface, distance, triangle),
            };
            if paths.include(scattered) && surface.emitted != DVec3::ZERO {
                let cosine = -surface.true_normal.dot(segment.direction);
                let pdf = self.lights.triangle_pdf(&self.geometry, triangle, cosine, distance);
                radiance += throughput * surface.emitted * share(pdf);
            }
            if scattered == paths.depth() {
                break;
            }
            let to_viewer = -segment.direction;
            if paths.include(scattered + 1) {
                radiance += throughput * self.light_at(&surface, to_viewer, sampler);
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

    /// Next-event estimation: one sample of every light.
    fn light_at(&self, surface: &Surface, to_viewer: DVec3, sampler: &mut Sampler) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for light in 0..self.lights.count() {
            let u = if self.lights.is_random(light) { sampler.pair() } else { [0.0; 2] };
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
