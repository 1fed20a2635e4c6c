//! Choices on error and time that respect their noise.
//!
//! Two values differ where the 99 % interval of their difference leaves out 0 and the difference is at least 1 % of the smaller error, or 2 % of the smaller time: else they
//! tie. Errors are compared by the differences of their replicates, in which the noise of the reference cancels; times of different runs share nothing. A value of which
//! no noise is known counts as exact.

use crate::sweep_data::SweepRow;
use lobelia_measure::{
    sampled::{Difference, Interval, Outcome, Replication, SHOWN_LEVEL, Sampled, StandardError},
    timing::LEAST_CHANGE,
};
use std::collections::BTreeMap;

/// Share of the smaller of two errors below which they are called equal, however sure their difference is.
const LEAST_ERROR: f64 = 0.01;

/// Runs of one variant with one set of parameters, taken together.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Name of the variant.
    pub variant: String,
    /// Parameters by name.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// Time in milliseconds.
    pub ms: f64,
    /// Its standard error; none where it is not known.
    pub ms_error: Option<StandardError>,
    /// Error.
    pub error: Sampled,
    /// What a picture without error would score for the noise of the reference alone, where that is known.
    pub floor: Option<f64>,
    /// How many runs are behind it (in [`configurations`]), or how many scenes (in [`overall`]).
    pub count: usize,
}

impl Configuration {
    /// (time in milliseconds, error).
    pub fn point(&self) -> (f64, f64) {
        (self.ms, self.error.value)
    }

    fn is_finite(&self) -> bool {
        self.ms.is_finite() && self.error.value.is_finite()
    }

    /// 95 % interval of the time.
    pub fn ms_interval(&self) -> Option<Interval> {
        let reach = self.ms_error?.reach(SHOWN_LEVEL);
        // A reach beyond the value itself tells no lower end; a time is above 0.
        reach.is_finite().then_some(Interval { low: (self.ms - reach).max(0.0), high: self.ms + reach })
    }

    /// 95 % interval of the error, not below 0.
    pub fn error_interval(&self) -> Option<Interval> {
        let found = self.error.interval(SHOWN_LEVEL)?;
        Some(Interval { low: found.low.max(0.0), high: found.high })
    }

    /// Which of two takes less time, if that is shown.
    pub fn faster(&self, other: &Self) -> Outcome {
        let error = self.ms_error.zip(other.ms_error).map(|(a, b)| a.with(b));
        outcome(Difference { value: self.ms - other.ms, error }, LEAST_CHANGE * self.ms.min(other.ms))
    }

    /// Which of two has the lesser error, if that is shown.
    pub fn more_accurate(&self, other: &Self) -> Outcome {
        outcome(Difference::paired(&self.error, &other.error), LEAST_ERROR * self.error.value.min(other.error.value))
    }

    /// Whether this is shown to be better in time or error, and is not shown to be worse in the other.
    pub fn beats(&self, other: &Self) -> bool {
        let outcomes = [self.faster(other), self.more_accurate(other)];
        outcomes.contains(&Outcome::First) && !outcomes.contains(&Outcome::Second)
    }
}

/// As [`Difference::outcome`], but what has no known noise counts as exact.
fn outcome(difference: Difference, least: f64) -> Outcome {
    let error = difference.error.or(Some(StandardError { size: 0.0, freedom: 1.0 }));
    if difference.value.abs() <= least { Outcome::Tie } else { Difference { error, ..difference }.outcome(0.0) }
}

/// Indices of the Pareto front, by rising time: a configuration is left out if, and only if, one on the front beats it ([`Configuration::beats`]).
///
/// Being beaten by one that is left out itself does not count. Ties are not transitive: in a row of configurations each of which ties with the next in time and is less
/// accurate, all but the last would be beaten by their neighbour, though the first may be far faster than the last. That rule has one solution where beating makes no
/// circles, and noise of different sizes can make them; of a circle, the configuration with the least product of time and error stays.
pub fn pareto_front(points: &[Configuration]) -> Vec<usize> {
    let beats: Vec<Vec<bool>> =
        points.iter().map(|a| points.iter().map(|b| a.is_finite() && b.is_finite() && a.beats(b)).collect()).collect();
    let mut open: Vec<usize> = (0..points.len()).filter(|&index| points[index].is_finite()).collect();
    let mut front: Vec<usize> = Vec::new();
    while !open.is_empty() {
        let unbeaten = |&&index: &&usize| !open.iter().any(|&other| beats[other][index]);
        let product = |index: usize| points[index].ms * points[index].error.value;
        let circle = || open.iter().min_by(|&&a, &&b| product(a).total_cmp(&product(b)));
        let Some(&stays) = open.iter().find(unbeaten).or_else(circle) else { break };
        front.push(stays);
        open.retain(|&index| index != stays && !beats[stays][index]);
    }
    front.sort_by(|&a, &b| points[a].ms.total_cmp(&points[b].ms).then(points[a].error.value.total_cmp(&points[b].error.value)));
    front
}

/// What a target chooses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// One that is shown to meet the target, and others that do and between which and it no difference is shown in what the choice is by.
    Found {
        /// Index of the chosen one.
        index: usize,
        /// Indices of the others.
        ties: Vec<usize>,
    },
    /// None is shown to meet it; this one meets it by its value, but its interval reaches beyond.
    Perhaps(usize),
    /// None meets it.
    Nothing,
}

/// The fastest configuration whose 95 % interval of the error ends at or below `target_error`. Of those that tie with it in time, the most accurate is chosen.
pub fn cheapest_under_error(points: &[Configuration], target_error: f64) -> Choice {
    choose(
        points,
        |point| point.error.value <= target_error,
        |point| point.error_interval().is_none_or(|interval| interval.high <= target_error),
        |point| point.ms,
        |point| point.error.value,
        Configuration::faster,
    )
}

/// The most accurate configuration whose 95 % interval of the time ends at or below `target_ms` milliseconds. Of those that tie with it in error, the fastest is chosen.
pub fn most_accurate_under_time(points: &[Configuration], target_ms: f64) -> Choice {
    choose(
        points,
        |point| point.ms <= target_ms,
        |point| point.ms_interval().is_none_or(|interval| interval.high <= target_ms),
        |point| point.error.value,
        |point| point.ms,
        Configuration::more_accurate,
    )
}

fn choose(
    points: &[Configuration],
    by_value: impl Fn(&Configuration) -> bool,
    shown: impl Fn(&Configuration) -> bool,
    least: impl Fn(&Configuration) -> f64,
    then: impl Fn(&Configuration) -> f64,
    outcome: impl Fn(&Configuration, &Configuration) -> Outcome,
) -> Choice {
    let order =
        |&a: &usize, &b: &usize| least(&points[a]).total_cmp(&least(&points[b])).then(then(&points[a]).total_cmp(&then(&points[b])));
    let reached: Vec<usize> = (0..points.len()).filter(|&index| points[index].is_finite() && by_value(&points[index])).collect();
    let sure: Vec<usize> = reached.iter().copied().filter(|&index| shown(&points[index])).collect();
    let Some(first) = sure.iter().copied().min_by(order) else {
        return reached.into_iter().min_by(order).map_or(Choice::Nothing, Choice::Perhaps);
    };
    let close: Vec<usize> =
        sure.into_iter().filter(|&index| index == first || outcome(&points[first], &points[index]) == Outcome::Tie).collect();
    let other =
        |&a: &usize, &b: &usize| then(&points[a]).total_cmp(&then(&points[b])).then(least(&points[a]).total_cmp(&least(&points[b])));
    let index = close.iter().copied().min_by(other).unwrap_or(first);
    Choice::Found { index, ties: close.into_iter().filter(|&one| one != index).collect() }
}

/// Configurations of one scene in the order of the rows: mean time and mean error over the seeds, so that no lucky seed is chosen. A configuration with a failed run, or
/// with a value that is not finite, is left out: a mean over the runs that happened to end would flatter it.
pub fn configurations(rows: &[SweepRow], scene: &str) -> Vec<Configuration> {
    let mut groups: Vec<Vec<&SweepRow>> = Vec::new();
    for row in rows.iter().filter(|row| row.scene == scene) {
        match groups.iter_mut().find(|group| group[0].variant == row.variant && group[0].parameters == row.parameters) {
            Some(group) => group.push(row),
            None => groups.push(vec![row]),
        }
    }
    groups.iter().filter_map(|group| configuration(group)).filter(Configuration::is_finite).collect()
}

fn configuration(runs: &[&SweepRow]) -> Option<Configuration> {
    if runs.iter().any(|run| run.failed.is_some()) {
        return None;
    }
    let errors: Vec<&Sampled> = runs.iter().map(|run| run.error.as_ref()).collect::<Option<_>>()?;
    let mean = errors.iter().map(|error| error.value).sum::<f64>() / errors.len() as f64;
    let error = Sampled::mean(&errors).unwrap_or_else(|| Sampled {
        value: mean,
        replicates: errors.iter().map(|error| error.value).collect(),
        replication: Replication::Means,
    });
    let ms = runs.iter().map(|run| run.ms).sum::<f64>() / runs.len() as f64;
    // Runs are hours apart, rounds of one run are not: where there are enough runs, they tell more.
    let times: Vec<f64> =
        if runs.len() > 2 { runs.iter().map(|run| run.ms).collect() } else { runs.iter().flat_map(|run| run.round_ms.clone()).collect() };
    let logarithm = Sampled { value: ms, replicates: times, replication: Replication::Means }.map(f64::ln);
    let ms_error = logarithm.standard_error().map(|error| StandardError { size: error.size * ms, ..error });
    let floors: Option<Vec<f64>> = runs.iter().map(|run| run.floor).collect();
    let floor = floors.map(|floors| floors.iter().sum::<f64>() / runs.len() as f64);
    Some(Configuration {
        variant: runs[0].variant.clone(),
        parameters: runs[0].parameters.clone(),
        ms,
        ms_error,
        error,
        floor,
        count: runs.len(),
    })
}

/// Configurations over all scenes: those that ended in every scene, with the mean time and the geometric mean of the error.
///
/// Errors of scenes lie orders of magnitude apart, and an arithmetic mean would be the error of the hardest scene alone. A front over the bare rows of all scenes would
/// only tell which scene is easy.
pub fn overall(rows: &[SweepRow]) -> Vec<Configuration> {
    let scenes = scenes(rows);
    let mut found: Vec<Vec<Configuration>> = Vec::new();
    for scene in &scenes {
        for one in configurations(rows, scene) {
            match found.iter_mut().find(|group| group[0].variant == one.variant && group[0].parameters == one.parameters) {
                Some(group) => group.push(one),
                None => found.push(vec![one]),
            }
        }
    }
    found.retain(|group| group.len() == scenes.len());
    found.iter().map(|group| over_scenes(group)).filter(Configuration::is_finite).collect()
}

fn over_scenes(group: &[Configuration]) -> Configuration {
    let count = group.len() as f64;
    let logarithms: Vec<Sampled> = group.iter().map(|one| one.error.map(f64::ln)).collect();
    let mean = logarithms.iter().map(|one| one.value).sum::<f64>() / count;
    let error = Sampled::mean(&logarithms.iter().collect::<Vec<_>>()).unwrap_or_else(|| Sampled::alone(mean)).map(f64::exp);
    let errors: Option<Vec<StandardError>> = group.iter().map(|one| one.ms_error).collect();
    let sum = errors.and_then(|errors| errors.into_iter().reduce(StandardError::with));
    let floors: Option<Vec<f64>> = group.iter().map(|one| one.floor.map(f64::ln)).collect();
    Configuration {
        ms: group.iter().map(|one| one.ms).sum::<f64>() / count,
        ms_error: sum.map(|error| StandardError { size: error.size / count, ..error }),
        error,
        floor: floors.map(|floors| (floors.iter().sum::<f64>() / count).exp()),
        count: group.len(),
        ..group[0].clone()
    }
}

/// Names of the scenes, in the order of the rows.
pub(crate) fn scenes(rows: &[SweepRow]) -> Vec<&str> {
    let mut scenes: Vec<&str> = Vec::new();
    for row in rows {
        if !scenes.contains(&row.scene.as_str()) {
            scenes.push(&row.scene);
        }
    }
    scenes
}

#[cfg(test)]
#[path = "choice_tests.rs"]
mod tests;
