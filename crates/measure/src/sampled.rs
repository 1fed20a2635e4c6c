//! How far chance moves a number: standard errors, intervals, and differences of numbers that share their chance.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Confidence of the intervals that are shown beside values.
pub const SHOWN_LEVEL: f64 = 0.95;

/// Confidence at which two values are said to differ. Higher than [`SHOWN_LEVEL`], because a page compares many metrics at once and none of them may be told apart by
/// luck.
pub const DECISION_LEVEL: f64 = 0.99;

/// How the replicates of a value came about.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Replication {
    /// The value is of all samples together, and each replicate of all but one group of them; the shares of the groups sum to 1.
    LeaveOut(Vec<f64>),
    /// Each replicate is the whole measurement with other random numbers. The value is one of them, or another one.
    Repeats,
    /// The value is the mean of the replicates, which are independent.
    Means,
    /// The value is the mean of the replicates, each of which may go with its neighbours, as steps of a sequence do.
    Steps,
}

/// A value, and what tells how far chance moves it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sampled {
    /// The value.
    pub value: f64,
    /// The value of each replicate, in an order that all values of one trial share.
    pub replicates: Vec<f64>,
    /// What a replicate is.
    pub replication: Replication,
}

/// Ends of an interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Standard error of a value, and the degrees of freedom with which it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandardError {
    /// Standard deviation of the value over repetitions of the whole measurement.
    pub size: f64,
    /// Degrees of freedom, at least 1.
    pub freedom: f64,
}

impl StandardError {
    /// Of the sum or the difference of two values that share nothing; degrees of freedom by Welch (1947) and Satterthwaite (1946).
    pub fn with(self, other: Self) -> Self {
        let (a, b) = (self.size * self.size, other.size * other.size);
        let freedom = if a + b > 0.0 { (a + b).powi(2) / (a * a / self.freedom + b * b / other.freedom) } else { self.freedom };
        Self { size: (a + b).sqrt(), freedom }
    }

    /// Half the width of an interval of this confidence, by Student's distribution.
    pub fn reach(&self, level: f64) -> f64 {
        if self.size == 0.0 {
            return 0.0;
        }
        StudentsT::new(0.0, 1.0, self.freedom).map_or(f64::INFINITY, |student| student.inverse_cdf(0.5 + 0.5 * level) * self.size)
    }
}

impl Sampled {
    /// A value of which nothing is known but itself.
    pub fn alone(value: f64) -> Self {
        Self { value, replicates: Vec::new(), replication: Replication::Repeats }
    }

    /// The standard error of the value; `None` with fewer than two replicates or with one that is not finite.
    ///
    /// Of groups that are left out it is that of the delete-a-group jackknife for groups of unequal size (Busing, Meijer and van der Leeden 1999, Delete-m Jackknife for
    /// Unequal m). For any function of the samples its square is too large rather than too small on average (Efron and Stein 1981, The Jackknife Estimate of Variance), up
    /// to the difference between all groups and all but one.
    pub fn standard_error(&self) -> Option<StandardError> {
        let count = self.replicates.len();
        if count < 2 || !self.value.is_finite() || self.replicates.iter().any(|value| !value.is_finite()) {
            return None;
        }
        let (n, freedom) = (count as f64, count as f64 - 1.0);
        let mean = self.replicates.iter().sum::<f64>() / n;
        let covariance = |lag: usize| {
            let pairs = self.replicates.iter().zip(&self.replicates[lag..]);
            pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>()
        };
        let variance = match &self.replication {
            Replication::LeaveOut(shares) => {
                if shares.len() != count || shares.iter().any(|share| !(*share > 0.0 && *share < 1.0)) {
                    return None;
                }
                let left = |share: f64| 1.0 / share - 1.0;
                let centre = n * self.value - self.replicates.iter().zip(shares).map(|(value, share)| (1.0 - share) * value).sum::<f64>();
                let part = |(value, share): (&f64, &f64)| {
                    let pseudo = self.value / share - left(*share) * value;
                    (pseudo - centre).powi(2) / left(*share)
                };
                self.replicates.iter().zip(shares).map(part).sum::<f64>() / n
            }
            Replication::Repeats => covariance(0) / freedom,
            Replication::Means => covariance(0) / freedom / n,
            Replication::Steps => (covariance(0) + (2.0 * covariance(1)).max(0.0)) / freedom / n,
        };
        Some(StandardError { size: variance.sqrt(), freedom })
    }

    /// The interval of this confidence around the value: it holds what the measurement gives on average over random numbers.
    pub fn interval(&self, level: f64) -> Option<Interval> {
        let reach = self.standard_error()?.reach(level);
        Some(Interval { low: self.value - reach, high: self.value + reach })
    }

    /// The value and its replicates under a function, such as the logarithm.
    pub fn map(&self, function: impl Fn(f64) -> f64) -> Self {
        Self {
            value: function(self.value),
            replicates: self.replicates.iter().map(|value| function(*value)).collect(),
            replication: self.replication.clone(),
        }
    }

    /// Whether the replicates of both are pairs: what chance does to one in a replicate it does to the other in the same.
    fn is_paired_with(&self, other: &Self) -> bool {
        self.replication == other.replication && self.replicates.len() == other.replicates.len() && !self.replicates.is_empty()
    }

    /// The mean of several values of one trial, replicate by replicate; `None` where their replicates are no pairs.
    pub fn mean(values: &[&Self]) -> Option<Self> {
        let first = values.first()?;
        let count = values.len() as f64;
        let value = values.iter().map(|one| one.value).sum::<f64>() / count;
        if values.len() > 1 && !values.iter().all(|one| first.is_paired_with(one)) {
            return None;
        }
        let replicate = |index: usize| values.iter().map(|one| one.replicates[index]).sum::<f64>() / count;
        Some(Self { value, replicates: (0..first.replicates.len()).map(replicate).collect(), replication: first.replication.clone() })
    }
}

/// The difference of two values, and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// The first less the second.
    pub value: f64,
    /// Its standard error; `None` where it is not known.
    pub error: Option<StandardError>,
}

/// What is shown of two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The first is smaller.
    First,
    /// The second is smaller.
    Second,
    /// No difference is shown: what there is lies within the noise, or is too small to matter.
    Tie,
}

impl Difference {
    /// Of two values of one trial, by the differences of their replicates, so that the noise that they share cancels.
    pub fn paired(first: &Sampled, second: &Sampled) -> Self {
        if !first.is_paired_with(second) {
            return Self::unpaired(first, second);
        }
        let replicates = first.replicates.iter().zip(&second.replicates).map(|(a, b)| a - b).collect();
        let both = Sampled { value: first.value - second.value, replicates, replication: first.replication.clone() };
        Self { value: both.value, error: both.standard_error() }
    }

    /// Of two values that share nothing.
    pub fn unpaired(first: &Sampled, second: &Sampled) -> Self {
        let error = first.standard_error().zip(second.standard_error()).map(|(a, b)| a.with(b));
        Self { value: first.value - second.value, error }
    }

    /// Ends of the interval of this confidence; `None` where nothing is known of the noise.
    pub fn interval(&self, level: f64) -> Option<Interval> {
        let reach = self.error?.reach(level);
        Some(Interval { low: self.value - reach, high: self.value + reach })
    }

    /// Which is smaller, if the interval at [`DECISION_LEVEL`] leaves out 0 and the difference is at least `least`.
    pub fn outcome(&self, least: f64) -> Outcome {
        let shown = self.interval(DECISION_LEVEL).is_some_and(|interval| interval.low > 0.0 || interval.high < 0.0);
        if !shown || self.value.abs() < least {
            Outcome::Tie
        } else if self.value < 0.0 {
            Outcome::First
        } else {
            Outcome::Second
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn sampled(value: f64, replicates: &[f64], replication: Replication) -> Sampled {
        Sampled { value, replicates: replicates.to_vec(), replication }
    }

    /// The mean of 1, 2, 3, 6: variance 14/3, standard error of the mean its quarter's root.
    #[test]
    fn standard_errors_by_hand() {
        let expected = (14.0f64 / 3.0 / 4.0).sqrt();
        let left = sampled(3.0, &[11.0 / 3.0, 10.0 / 3.0, 3.0, 2.0], Replication::LeaveOut(vec![0.25; 4]));
        let error = left.standard_error().unwrap();
        assert!((error.size - expected).abs() < 1e-12 && error.freedom == 3.0, "{error:?}");
        // t(0.975, 3) is 3.1824.
        let interval = left.interval(0.95).unwrap();
        assert!((interval.high - 3.0 - 3.1824 * expected).abs() < 1e-3 && (interval.low + interval.high - 6.0).abs() < 1e-12);
        let values = [1.0, 2.0, 3.0, 6.0];
        assert!((sampled(3.0, &values, Replication::Means).standard_error().unwrap().size - expected).abs() < 1e-12);
        assert!((sampled(3.0, &values, Replication::Repeats).standard_error().unwrap().size - 2.0 * expected).abs() < 1e-12);
        // Neighbours that go together know less than their number says.
        let steps = sampled(3.5, &[1.0, 2.0, 5.0, 6.0], Replication::Steps).standard_error().unwrap();
        assert!(steps.size > 1.1 * sampled(3.5, &[1.0, 2.0, 5.0, 6.0], Replication::Means).standard_error().unwrap().size);
    }

    /// Two groups of one sample and one of two: the same samples, the mean's variance estimated from three groups.
    #[test]
    fn groups_of_unequal_size_count_by_their_share() {
        // Samples 1, 2, and (3, 6): means without each group are 11/3, 10/3 and 3/2.
        let shares = vec![0.25, 0.25, 0.5];
        let left = sampled(3.0, &[11.0 / 3.0, 10.0 / 3.0, 1.5], Replication::LeaveOut(shares));
        // Pseudo-values are the group means 1, 2 and 4.5 about 3, over 3, 3 and 1.
        let expected = ((4.0 / 3.0 + 1.0 / 3.0 + 2.25) / 3.0f64).sqrt();
        assert!((left.standard_error().unwrap().size - expected).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_known_gives_no_interval() {
        assert_eq!(Sampled::alone(1.0).interval(0.95), None);
        assert_eq!(sampled(1.0, &[1.0], Replication::Means).interval(0.95), None);
        assert_eq!(sampled(1.0, &[1.0, f64::NAN], Replication::Means).interval(0.95), None);
        assert_eq!(sampled(f64::INFINITY, &[1.0, 2.0], Replication::Repeats).interval(0.95), None);
        assert_eq!(sampled(1.0, &[1.0, 2.0], Replication::LeaveOut(vec![0.5])).interval(0.95), None);
        assert_eq!(Difference::paired(&Sampled::alone(1.0), &Sampled::alone(2.0)).outcome(0.0), Outcome::Tie);
    }

    #[test]
    fn noise_that_both_share_cancels() {
        let left = |offset: f64| sampled(1.0 + offset, &[0.8 + offset, 1.1 + offset, 1.2 + offset], Replication::Repeats);
        let (one, other) = (left(0.0), left(0.05));
        assert_eq!(Difference::paired(&one, &other).outcome(0.0), Outcome::First);
        assert_eq!(Difference::paired(&other, &one).outcome(0.0), Outcome::Second);
        assert_eq!(Difference::unpaired(&one, &other).outcome(0.0), Outcome::Tie);
        // A difference that is sure and does not matter.
        assert_eq!(Difference::paired(&one, &other).outcome(0.06), Outcome::Tie);
        assert_eq!(Difference::paired(&one, &one).outcome(0.0), Outcome::Tie);
    }

    #[test]
    fn means_are_taken_replicate_by_replicate() {
        let (a, b) = (sampled(1.0, &[1.0, 2.0], Replication::Repeats), sampled(3.0, &[3.0, 6.0], Replication::Repeats));
        assert_eq!(Sampled::mean(&[&a, &b]), Some(sampled(2.0, &[2.0, 4.0], Replication::Repeats)));
        assert_eq!(Sampled::mean(&[&a, &Sampled::alone(1.0)]), None);
        assert_eq!(Sampled::mean(&[]), None);
    }
}
