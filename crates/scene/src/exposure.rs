//! The factor that brings a scene's light into the range of half floats.
//!
//! Pictures between passes are half floats: full precision from 2^-14 to 65504. Sunlight of 100,000 lx off a metal is far above that range and a night
//! below it, so lights, emission and environment reach the device times a power of two, and whatever is read back is divided by it. Only what is
//! cheap to know is asked: what the cameras see, and how much light would fall there if nothing stood in between.

use crate::{AreaShape, LightKind, Scene, seen::SeenPoint};
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

impl Scene {
    /// What light is multiplied by on the device: 1 for ordinary scenes, else the power of two that brings the upper quartile of diffuse radiance, as seen by
    /// the scene's cameras with every light unobstructed, to between 1/2 and 1; less where emission or environment would exceed half floats otherwise.
    ///
    /// It depends on the scene at its present time and nothing else. Highlights above 65504 over this factor are still cut off.
    pub fn pre_exposure(&self) -> f32 {
        self.pre_exposure_for(&self.seen_points())
    }

    pub(crate) fn pre_exposure_for(&self, seen: &[SeenPoint]) -> f32 {
        let brightest = self.brightest_emission();
        let usual = self.usual_radiance(seen);
        // Without light on any surface, emission is all that there is to see, and it need not lie low.
        let usual = if usual > 0.0 {
            usual
        } else if brightest <= MOST {
            brightest.min(*ORDINARY.end())
        } else {
            brightest
        };
        factor(usual, brightest)
    }

    /// The largest channel of everything that emits.
    fn brightest_emission(&self) -> f64 {
        let materials = self.materials.iter().map(|material| {
            let seen = if material.unlit { material.base_color } else { material.emissive };
            seen.max_element()
        });
        let lights = self.area_lights.iter().map(|light| light.radiance.max_element());
        let environment = self.environment.iter().flat_map(|environment| {
            environment.pixels.iter().map(|pixel| pixel.max_element() * environment.scale).filter(|value| value.is_finite())
        });
        materials.chain(lights).chain(environment).map(f64::from).fold(0.0, f64::max)
    }

    /// Upper quartile of what a white diffuse surface would reflect, over what the cameras see; 0 where no light reaches any of it.
    fn usual_radiance(&self, seen: &[SeenPoint]) -> f64 {
        let lights = self.illuminants();
        if lights.is_empty() {
            return 0.0;
        }
        let radiance = |point: &SeenPoint| lights.iter().map(|light| light.irradiance(point.position, point.normal)).sum::<f64>() / PI;
        let mut values: Vec<f64> = seen.iter().map(radiance).collect();
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
