//! A search for the largest error of a function over its whole domain: random points, and hill climbing from the worst of them.

use glam::DVec3;
use std::f64::consts::TAU;

/// A sequence of numbers in [0, 1) that a seed decides (Vigna 2015, SplitMix64).
pub struct Numbers(pub u64);

impl Numbers {
    /// The next one.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// What one coordinate of the search, a number in [0, 1], stands for.
pub fn log_uniform(share: f64, low: f64, high: f64) -> f64 {
    low * (high / low).powf(share)
}

/// A unit vector: two coordinates, its cosine to +Z and its azimuth.
pub fn direction(cosine: f64, turn: f64) -> DVec3 {
    let z = (2.0 * cosine - 1.0).clamp(-1.0, 1.0);
    let s = ((1.0 - z) * (1.0 + z)).sqrt();
    DVec3::new(s * (TAU * turn).cos(), s * (TAU * turn).sin(), z)
}

/// A stated bound.
pub struct Bound {
    /// Function, as in Rust.
    pub name: &'static str,
    /// The domain that the documentation gives, in words.
    pub domain: &'static str,
    /// What it is compared with.
    pub reference: &'static str,
    /// What the documentation states.
    pub stated: f64,
    /// Coordinates of the domain.
    pub dimensions: usize,
    /// The error at a point of the unit cube, in the unit of `stated`.
    pub error: fn(&[f64]) -> f64,
    /// Worst points that longer searches have found; they are always tried.
    pub worst: &'static [&'static [f64]],
}

impl Bound {
    /// With points that are always tried.
    pub fn at(self, worst: &'static [&'static [f64]]) -> Self {
        Self { worst, ..self }
    }
}

/// The largest error that is found, and where. NaN counts as infinite.
pub fn search(bound: &Bound, samples: usize, seed: u64) -> (f64, Vec<f64>) {
    let mut numbers = Numbers(seed);
    let error = |point: &[f64]| {
        let error = (bound.error)(point);
        if error.is_nan() { f64::INFINITY } else { error }
    };
    let mut best: Vec<(f64, Vec<f64>)> = bound.worst.iter().map(|point| (error(point), point.to_vec())).collect();
    for _ in 0..samples {
        // One coordinate in ten is an end or a middle of its range.
        let point: Vec<f64> = (0..bound.dimensions)
            .map(|_| match (numbers.next() * 30.0) as u32 {
                0 => 0.0,
                1 => 1.0,
                2 => 0.5,
                _ => numbers.next(),
            })
            .collect();
        best.push((error(&point), point));
    }
    best.sort_by(|left, right| right.0.total_cmp(&left.0));
    best.truncate(4);
    for (value, point) in &mut best {
        let mut step = 0.1;
        for _ in 0..samples / 8 {
            let tried: Vec<f64> =
                point
                    .iter()
                    .map(|coordinate| {
                        if numbers.next() < 0.5 { *coordinate } else { (coordinate + step * (2.0 * numbers.next() - 1.0)).clamp(0.0, 1.0) }
                    })
                    .collect();
            let found = error(&tried);
            if found > *value {
                (*value, *point) = (found, tried);
            } else {
                step = (step * 0.97).max(1e-5);
            }
        }
    }
    best.sort_by(|left, right| right.0.total_cmp(&left.0));
    best.swap_remove(0)
}
