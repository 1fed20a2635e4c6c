//! Light from infinitely far, sampled where the picture of it is bright.

use glam::DVec3;
use lobelia_scene::Environment;
use std::f64::consts::{PI, TAU};

/// An environment with the distribution that it is sampled by.
pub struct Sky {
    size: [usize; 2],
    pixels: Vec<DVec3>,
    /// Running sums of each row's weights, one row after another, and of the rows' sums.
    columns: Vec<f64>,
    rows: Vec<f64>,
}

impl Sky {
    /// `None` for a black sky.
    pub fn new(environment: &Environment) -> Option<Self> {
        let size = [environment.width as usize, environment.height as usize];
        let pixels: Vec<DVec3> = environment.pixels.iter().map(|pixel| pixel.as_dvec3() * f64::from(environment.scale)).collect();
        let mut sky = Self { size, pixels, columns: Vec::new(), rows: Vec::new() };
        let mut total = 0.0;
        for y in 0..size[1] {
            let sine = (PI * (y as f64 + 0.5) / size[1] as f64).sin();
            let mut sum = 0.0;
            for x in 0..size[0] {
                // Bilinear filtering carries a bright pixel's light into its neighbours, so these get a share of its weight.
                let near = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy)| sky.pixel(x as i64 + dx, y as i64 + dy).element_sum());
                sum += (0.5 * near[0] + 0.125 * near[1..].iter().sum::<f64>()) * sine;
                sky.columns.push(sum);
            }
            total += sum;
            sky.rows.push(total);
        }
        (total > 0.0 && total.is_finite()).then_some(sky)
    }

    fn pixel(&self, x: i64, y: i64) -> DVec3 {
        let (width, height) = (self.size[0] as i64, self.size[1] as i64);
        self.pixels[(y.clamp(0, height - 1) * width + x.rem_euclid(width)) as usize]
    }

    /// Where a direction is in the picture, in [0, 1).
    fn uv(direction: DVec3) -> [f64; 2] {
        [(direction.x.atan2(-direction.z) / TAU).rem_euclid(1.0), direction.y.clamp(-1.0, 1.0).acos() / PI]
    }

    /// Radiance from a unit direction, filtered bilinearly.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        let [u, v] = Self::uv(direction);
        let (x, y) = (u * self.size[0] as f64 - 0.5, v * self.size[1] as f64 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (s, t) = (x - left, y - top);
        let (left, top) = (left as i64, top as i64);
        self.pixel(left, top).lerp(self.pixel(left + 1, top), s).lerp(self.pixel(left, top + 1).lerp(self.pixel(left + 1, top + 1), s), t)
    }

    /// A direction in proportion to about its radiance, and its density over solid angle.
    pub fn sample(&self, [u, v]: [f64; 2]) -> (DVec3, f64) {
        let (y, v) = pick(&self.rows, v);
        let (x, u) = pick(&self.columns[y * self.size[0]..(y + 1) * self.size[0]], u);
        let (azimuth, polar) = (TAU * (x as f64 + u) / self.size[0] as f64, PI * (y as f64 + v) / self.size[1] as f64);
        let direction = DVec3::new(azimuth.sin() * polar.sin(), polar.cos(), -azimuth.cos() * polar.sin());
        (direction, self.pdf(direction))
    }

    /// Density of [`Sky::sample`], 1/sr.
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let [u, v] = Self::uv(direction);
        let x = ((u * self.size[0] as f64) as usize).min(self.size[0] - 1);
        let y = ((v * self.size[1] as f64) as usize).min(self.size[1] - 1);
        let at = y * self.size[0] + x;
        let weight = self.columns[at] - if x > 0 { self.columns[at - 1] } else { 0.0 };
        let pixels = (self.size[0] * self.size[1]) as f64;
        let total = self.rows.last().copied().unwrap_or(1.0);
        let sine = (v * PI).sin().max(1e-9);
        weight / total * pixels / (TAU * PI * sine)
    }
}

/// The step of a running sum that a number in [0, 1) falls into, and where in it.
fn pick(sums: &[f64], number: f64) -> (usize, f64) {
    let target = number * sums.last().copied().unwrap_or(0.0);
    let index = sums.partition_point(|sum| *sum <= target).min(sums.len() - 1);
    let before = if index > 0 { sums[index - 1] } else { 0.0 };
    let step = sums[index] - before;
    (index, if step > 0.0 { ((target - before) / step).clamp(0.0, 1.0 - 1e-9) } else { 0.5 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn sky() -> Sky {
        let mut pixels = vec![Vec3::splat(0.1); 32 * 16];
        pixels[5 * 32 + 8] = Vec3::splat(50.0);
        Sky::new(&Environment { name: String::new(), width: 32, height: 16, pixels, scale: 2.0 }).unwrap_or_else(|| unreachable!())
    }

    #[test]
    fn directions_follow_the_convention() {
        let sky = sky();
        // u = 0.25 is +X; row 5 of 16 is above the horizon.
        let bright = sky.radiance(DVec3::new(1.0, (PI * 5.5 / 16.0).cos(), 0.0).normalize());
        let polar = PI * 5.5 / 16.0;
        let centre = TAU * 8.5 / 32.0;
        let exact = sky.radiance(DVec3::new(centre.sin() * polar.sin(), polar.cos(), -centre.cos() * polar.sin()));
        assert!((exact - DVec3::splat(100.0)).length() < 1e-6 && bright.x > 20.0, "{exact} {bright}");
        assert!((sky.radiance(DVec3::Z) - DVec3::splat(0.2)).length() < 1e-6);
    }

    #[test]
    fn samples_have_the_density_that_is_said_and_their_mean_is_the_irradiance_of_a_sphere() {
        let sky = sky();
        let (mut mean, mut whole) = (0.0, 0.0);
        let count = 256;
        for i in 0..count * count {
            let u = [(f64::from(i % count) + 0.5) / f64::from(count), (f64::from(i / count) + 0.5) / f64::from(count)];
            let (direction, pdf) = sky.sample(u);
            assert!((direction.length() - 1.0).abs() < 1e-12 && pdf > 0.0);
            mean += sky.radiance(direction).x / pdf / f64::from(count * count);
        }
        // Against the midpoint rule.
        for y in 0..400 {
            for x in 0..800 {
                let (azimuth, polar) = (TAU * (f64::from(x) + 0.5) / 800.0, PI * (f64::from(y) + 0.5) / 400.0);
                let direction = DVec3::new(azimuth.sin() * polar.sin(), polar.cos(), -azimuth.cos() * polar.sin());
                whole += sky.radiance(direction).x * polar.sin() * (TAU / 800.0) * (PI / 400.0);
            }
        }
        assert!((mean / whole - 1.0).abs() < 0.01, "{mean} {whole}");
    }

    #[test]
    fn a_black_sky_is_no_light() {
        let pixels = vec![Vec3::ZERO; 8];
        assert!(Sky::new(&Environment { name: String::new(), width: 4, height: 2, pixels, scale: 1.0 }).is_none());
    }
}
