//! Inputs that cover a domain, its ends and its traps. A row's numbers depend on its index alone.

use glam::DVec3;
use lobelia_lobes::sampling::hash;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A stream of numbers for one row.
pub struct Draw {
    state: u32,
}

impl Draw {
    /// The stream of row `index` in the table that `seed` names.
    pub fn new(index: u32, seed: u32) -> Self {
        Self { state: hash(index ^ hash(seed)) }
    }

    /// An integer.
    pub fn bits(&mut self) -> u32 {
        self.state = self.state.wrapping_add(0x9e37_79b9);
        hash(self.state)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        f64::from(self.bits()) / 4_294_967_296.0
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// True once in `n` draws.
    pub fn one_in(&mut self, n: u32) -> bool {
        self.bits().is_multiple_of(n)
    }

    /// Log-uniform between two positive numbers, both ends among the values.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        match self.bits() % 64 {
            0 => low,
            1 => high,
            _ => (low.ln() + (high.ln() - low.ln()) * self.unit()).exp().clamp(low, high),
        }
    }

    /// A sharpness: log-uniform in [1e-6, 1e8], both ends and 0 among the values.
    pub fn sharpness(&mut self) -> f64 {
        if self.one_in(64) { 0.0 } else { self.log_between(1e-6, 1e8) }
    }

    /// An angle in [0, pi], with clusters at 0, pi/2 and pi that narrow down to 1e-7 rad, and those three themselves.
    pub fn angle(&mut self) -> f64 {
        let near = |draw: &mut Self| if draw.one_in(16) { 0.0 } else { draw.log_between(1e-7, 0.5) };
        match self.bits() % 8 {
            0 => near(self),
            1 => FRAC_PI_2 - near(self),
            2 => FRAC_PI_2 + near(self),
            3 => PI - near(self),
            _ => self.between(0.0, PI),
        }
    }

    /// A direction: anywhere, or on an axis or near one.
    pub fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let azimuth = self.between(0.0, TAU);
        let s = (1.0 - z * z).max(0.0).sqrt();
        let anywhere = DVec3::new(s * azimuth.cos(), s * azimuth.sin(), z);
        match self.bits() % 16 {
            0..=2 => {
                let sign = if self.one_in(2) { 1.0 } else { -1.0 };
                let axis = DVec3::AXES[self.bits() as usize % 3] * sign;
                if self.one_in(4) { axis } else { (axis + anywhere * self.log_between(1e-7, 0.1)).normalize() }
            }
            _ => anywhere,
        }
    }

    /// A direction at [`Draw::angle`] to another one: nearly parallel, nearly perpendicular and nearly opposite ones among them.
    pub fn direction_near(&mut self, axis: DVec3) -> DVec3 {
        let angle = self.angle();
        self.direction_at(axis, angle)
    }

    /// A direction at a given angle to another one.
    pub fn direction_at(&mut self, axis: DVec3, angle: f64) -> DVec3 {
        let (x, y) = axis.any_orthonormal_pair();
        let azimuth = self.between(0.0, TAU);
        (axis * angle.cos() + (x * azimuth.cos() + y * azimuth.sin()) * angle.sin()).normalize()
    }
}

/// A row from up to four groups of four numbers.
pub fn row(groups: [[f64; 4]; 4]) -> [f32; 16] {
    let mut row = [0.0; 16];
    for (place, value) in row.iter_mut().zip(groups.as_flattened()) {
        *place = *value as f32;
    }
    row
}

/// A direction and a number as a group of a row.
pub fn group(direction: DVec3, number: f64) -> [f64; 4] {
    [direction.x, direction.y, direction.z, number]
}

/// The direction of group `index` of a row as the device sees it: rounded, so not quite of unit length.
pub fn direction_of(row: &[f64; 16], index: usize) -> DVec3 {
    DVec3::new(row[4 * index], row[4 * index + 1], row[4 * index + 2])
}
