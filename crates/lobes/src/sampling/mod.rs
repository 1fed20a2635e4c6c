//! Well-spread points in integer arithmetic, bit for bit those of the device, and directions drawn with them.

mod directions;

pub use directions::*;

/// PCG hash (Jarzynski and Olano 2020).
pub fn hash(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Integer to [0, 1): its upper 24 bits.
pub fn unit_float(bits: u32) -> f64 {
    f64::from(bits >> 8) / f64::from(1u32 << 24)
}

/// Point `index` of the R2 sequence (Roberts 2018), shifted by a vector that `seed` chooses.
pub fn r2_point(index: u32, seed: u32) -> [f64; 2] {
    let shift = [hash(seed), hash(seed ^ 0x9e37_79b9)];
    let generators = [3_242_174_889u32, 2_447_445_413];
    [0, 1].map(|axis| unit_float(index.wrapping_mul(generators[axis]).wrapping_add(shift[axis])))
}

/// Van der Corput sequence in base 2.
pub fn radical_inverse(index: u32) -> f64 {
    unit_float(index.reverse_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest difference between the share of points in [0, x) x [0, y) and its area, over a grid of corners.
    fn discrepancy(points: &[[f64; 2]]) -> f64 {
        let mut worst: f64 = 0.0;
        for i in 1..=32 {
            for j in 1..=32 {
                let (x, y) = (f64::from(i) / 32.0, f64::from(j) / 32.0);
                let inside = points.iter().filter(|point| point[0] < x && point[1] < y).count();
                worst = worst.max((inside as f64 / points.len() as f64 - x * y).abs());
            }
        }
        worst
    }

    #[test]
    fn r2_is_spread_evenly_for_any_seed_and_far_along() {
        for (seed, first) in [(0, 0), (7, 0), (0, 3_000_000_000)] {
            let points: Vec<_> = (0..1024).map(|index| r2_point(first + index, seed)).collect();
            assert!(discrepancy(&points) < 0.01, "seed {seed}: {}", discrepancy(&points));
        }
        // Points that are merely random do not pass.
        let random: Vec<_> = (0..1024).map(|index| [unit_float(hash(2 * index)), unit_float(hash(2 * index + 1))]).collect();
        assert!(discrepancy(&random) > 0.01);
    }

    #[test]
    fn radical_inverse_mirrors_bits() {
        assert_eq!([0, 1, 2, 3].map(radical_inverse), [0.0, 0.5, 0.25, 0.75]);
    }
}
