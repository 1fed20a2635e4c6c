//! Which of two values of a metric is better.

/// Direction in which a metric gets better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Errors, times, memory.
    Lower,
    /// Likeness, such as PSNR and SSIM.
    Higher,
    /// Ratios, such as mean of the picture over mean of the reference.
    NearOne,
    /// Signed errors, such as bias.
    NearZero,
}

impl Direction {
    /// Direction of a metric by its name: PSNR and SSIM rise, a ratio aims at one, a bias aims at zero, all others fall.
    pub fn of(metric: &str) -> Self {
        let metric = metric.to_lowercase();
        // Whole words: "iterations" is no ratio.
        let has = |wanted: &str| metric.split(|letter: char| !letter.is_alphanumeric()).any(|word| word == wanted);
        if metric.contains("psnr") || metric.contains("ssim") {
            Self::Higher
        } else if has("ratio") {
            Self::NearOne
        } else if has("bias") {
            Self::NearZero
        } else {
            Self::Lower
        }
    }

    /// The direction in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Lower => "lower is better",
            Self::Higher => "higher is better",
            Self::NearOne => "closer to 1 is better",
            Self::NearZero => "closer to 0 is better",
        }
    }

    /// Distance from the best value there is, for ordering only; infinite for a value that is not finite.
    pub fn badness(self, value: f64) -> f64 {
        let badness = match self {
            Self::Lower => value,
            Self::Higher => -value,
            Self::NearOne => (value - 1.0).abs(),
            Self::NearZero => value.abs(),
        };
        if value.is_finite() { badness } else { f64::INFINITY }
    }

    /// Indices of the best values: more than one where they are equal, none where no value is finite.
    pub fn best(self, values: &[f64]) -> Vec<usize> {
        let least = values.iter().map(|&value| self.badness(value)).fold(f64::INFINITY, f64::min);
        (0..values.len()).filter(|&index| least.is_finite() && self.badness(values[index]) == least).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Direction;

    #[test]
    fn the_best_follows_the_direction_and_is_never_nan() {
        let values = [f64::NAN, 2.0, 0.9, -3.0, f64::NEG_INFINITY];
        assert_eq!(Direction::of("relative MSE").best(&values), [3]);
        assert_eq!(Direction::of("PSNR [dB]").best(&values), [1]);
        assert_eq!(Direction::of("mean ratio").best(&values), [2]);
        assert_eq!(Direction::of("mean_ratio"), Direction::NearOne);
        assert_eq!(Direction::of("iterations"), Direction::Lower);
        assert_eq!(Direction::of("bias").best(&values), [2]);
        assert_eq!(Direction::Lower.best(&[1.0, 1.0, 2.0]), [0, 1]);
        assert!(Direction::Lower.best(&[f64::NAN, f64::INFINITY]).is_empty());
    }
}
