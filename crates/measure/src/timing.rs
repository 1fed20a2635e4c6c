//! Statistics of times: medians with their spread, and ratios of two things timed in turn.

use crate::sampled::{Difference, Outcome, Replication, SHOWN_LEVEL, Sampled};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Median and spread of some times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Half of the values are below.
    pub median: f64,
    /// One in twenty is below.
    pub p5: f64,
    /// One in twenty is above.
    pub p95: f64,
    /// How many values there are.
    pub count: usize,
}

impl Summary {
    /// Of finite values; `None` where there is none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        // Between neighbours in proportion: the median of an even number is the mean of the middle two.
        let at = |share: f64| {
            let place = share * last as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            values[low] + (values[(low + 1).min(last)] - values[low]) * part
        };
        Some(Self { median: at(0.5), p5: at(0.05), p95: at(0.95), count: values.len() })
    }
}

/// Share of the shorter of two times below which they are called equal, however sure their difference is: clocks and allocators move times by as much.
pub const LEAST_CHANGE: f64 = 0.02;

/// A time with its spread and an interval.
#[derive(Clone, Debug, PartialEq)]
pub struct Timed {
    /// Of all values of all rounds.
    pub summary: Summary,
    /// Natural logarithms: the median, and the median of each round.
    pub logarithm: Sampled,
}

impl Timed {
    /// Of the values of each round, in milliseconds. Rounds without a value above 0 are left out; `None` where none is left.
    pub fn of(rounds: &[Vec<f64>]) -> Option<Self> {
        let medians: Vec<f64> = rounds
            .iter()
            .filter_map(|round| Summary::of(round.iter().copied()))
            .map(|summary| summary.median)
            .filter(|ms| *ms > 0.0)
            .collect();
        let summary = Summary::of(rounds.iter().flatten().copied()).filter(|_| !medians.is_empty())?;
        let replicates = medians.iter().map(|ms| ms.ln()).collect();
        Some(Self { summary, logarithm: Sampled { value: summary.median.ln(), replicates, replication: Replication::Means } })
    }

    /// Ends of the 95 % interval of the median, if rounds are spread like a log-normal; `None` with fewer than two rounds.
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.logarithm.interval(SHOWN_LEVEL).map(|interval| (interval.low.exp(), interval.high.exp()))
    }

    /// Which of two things that were timed in turn, round by round, takes less, if that is shown.
    pub fn outcome(&self, other: &Self) -> Outcome {
        Difference::paired(&self.logarithm, &other.logarithm).outcome(LEAST_CHANGE.ln_1p())
    }
}

/// How many times longer one thing takes than another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Geometric mean of the rounds' ratios.
    pub ratio: f64,
    /// Ends of its 95 % confidence interval, if ratios of rounds are spread like a log-normal. Both infinitely far for fewer than two rounds.
    pub interval: (f64, f64),
    /// Rounds.
    pub count: usize,
}

impl Ratio {
    /// Of two things that were timed in turn, round by round: what slows the machine for a while slows both. Rounds with a time that is not above 0 are left out;
    /// `None` where none is left.
    pub fn paired(numerator: &[f64], denominator: &[f64]) -> Option<Self> {
        let usable = |value: f64| value.is_finite() && value > 0.0;
        let logs: Vec<f64> = numerator
            .iter()
            .zip(denominator)
            .filter(|(left, right)| usable(**left) && usable(**right))
            .map(|(left, right)| (left / right).ln())
            .collect();
        let count = logs.len();
        if count == 0 {
            return None;
        }
        let mean = logs.iter().sum::<f64>() / count as f64;
        let interval = match StudentsT::new(0.0, 1.0, count as f64 - 1.0) {
            Ok(student) if count > 1 => {
                let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1) as f64;
                let reach = student.inverse_cdf(0.975) * (variance / count as f64).sqrt();
                ((mean - reach).exp(), (mean + reach).exp())
            }
            _ => (0.0, f64::INFINITY),
        };
        Some(Self { ratio: mean.exp(), interval, count })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn summaries() {
        let summary = Summary::of([3.0, 1.0, f64::NAN, 2.0, 4.0]).unwrap();
        assert_eq!((summary.median, summary.count), (2.5, 4));
        assert!((summary.p5 - 1.15).abs() < 1e-12 && (summary.p95 - 3.85).abs() < 1e-12);
        assert_eq!(Summary::of([7.0]).unwrap().p95, 7.0);
        assert_eq!(Summary::of([f64::INFINITY]), None);
    }

    #[test]
    fn times_have_intervals_over_rounds_and_ties() {
        let rounds = |scale: f64| [1.0, 1.02, 0.99, 1.01].map(|round| vec![scale * round, scale * round * 1.3, scale * round * 0.9]);
        let one = Timed::of(&rounds(2.0)).unwrap();
        let (low, high) = one.interval().unwrap();
        assert!(low < one.summary.median && one.summary.median < high && high / low < 1.06, "{low} {high}");
        // What slows both in the same rounds hides no difference, but 1 % is none.
        assert_eq!(one.outcome(&Timed::of(&rounds(2.1)).unwrap()), Outcome::First);
        assert_eq!(Timed::of(&rounds(2.1)).unwrap().outcome(&one), Outcome::Second);
        assert_eq!(one.outcome(&Timed::of(&rounds(2.02)).unwrap()), Outcome::Tie);
        // One round says nothing of its noise.
        let single = Timed::of(&[vec![1.0, 1.1]]).unwrap();
        assert_eq!((single.interval(), single.outcome(&Timed::of(&[vec![9.0]]).unwrap())), (None, Outcome::Tie));
        assert_eq!(Timed::of(&[vec![], vec![f64::NAN]]), None);
    }

    #[test]
    fn a_ratio_of_rounds_forgives_a_slow_machine() {
        // The second round is ten times slower for both.
        let ratio = Ratio::paired(&[2.0, 20.2, 1.98], &[1.0, 10.0, 1.0]).unwrap();
        assert!((ratio.ratio - 2.0).abs() < 0.01 && ratio.interval.0 > 1.9 && ratio.interval.1 < 2.1, "{ratio:?}");
        // t(0.975, 2 degrees of freedom) is 4.303.
        let spread = Ratio::paired(&[1.0, std::f64::consts::E, 1.0 / std::f64::consts::E], &[1.0; 3]).unwrap();
        assert!((spread.interval.1.ln() - 4.303 / 3f64.sqrt()).abs() < 1e-3, "{spread:?}");
        assert_eq!(Ratio::paired(&[1.0], &[2.0]).unwrap().interval, (0.0, f64::INFINITY));
        assert_eq!(Ratio::paired(&[0.0, f64::NAN], &[1.0, 1.0]), None);
    }
}
