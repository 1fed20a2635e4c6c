//! The numbers of one sample of one pixel.

use lobelia_lobes::sampling::hash;

/// Draws pairs of well-spread numbers in a fixed order.
pub struct Sampler {
    index: u32,
    seed: u32,
    set: u32,
    /// The second half of the last set, if it was not used yet.
    rest: Option<[f64; 2]>,
}

/// The generator has 2^16 points; longer runs begin a new scramble.
const POINTS: u64 = 1 << 16;

impl Sampler {
    /// The numbers of sample `sample` of pixel `pixel`.
    pub fn new(pixel: u32, sample: u64, seed: u32) -> Self {
        let block = (sample / POINTS) as u32;
        Self { index: (sample % POINTS) as u32, seed: hash(pixel ^ hash(seed ^ hash(block))), set: 0, rest: None }
    }

    /// Two numbers in [0, 1).
    pub fn pair(&mut self) -> [f64; 2] {
        if let Some(rest) = self.rest.take() {
            return rest;
        }
        // Sets of four dimensions under seeds of their own: any number of pairs, each well spread in its plane.
        let four = sobol_burley::sample_4d(self.index, 0, hash(self.seed ^ self.set.wrapping_mul(0x9e37_79b9))).map(f64::from);
        self.set += 1;
        self.rest = Some([four[2], four[3]]);
        [four[0], four[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_and_differ_between_pixels() {
        let points = |pixel: u32| -> Vec<[f64; 2]> { (0..256).map(|sample| Sampler::new(pixel, sample, 1).pair()).collect() };
        // 256 points of a (0, 2)-sequence: one in each cell of a 16 x 16 grid.
        let mut cells = [false; 256];
        for [x, y] in points(7) {
            cells[(x * 16.0) as usize * 16 + (y * 16.0) as usize] = true;
        }
        assert!(cells.iter().all(|seen| *seen));
        assert_ne!(points(7), points(8));
        assert_ne!(Sampler::new(7, 0, 1).pair(), Sampler::new(7, 0, 2).pair());
        assert_ne!(Sampler::new(7, 3, 1).pair(), Sampler::new(7, 3 + POINTS, 1).pair());
    }
}
