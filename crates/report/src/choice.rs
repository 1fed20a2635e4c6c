//! Choices on error and time. A point is (time in milliseconds, error); one with a value that is not finite is never chosen.

use crate::data::SweepRow;

fn finite(point: (f64, f64)) -> bool {
    point.0.is_finite() && point.1.is_finite()
}

/// Indices of the points that no other point beats in both time and error, by rising time.
///
/// A point beats another when it is no worse in both and better in one: of two points with one time, only the more accurate
/// stays; equal points all stay.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|&index| finite(points[index])).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut front: Vec<usize> = Vec::new();
    for index in order {
        let stays = front.last().is_none_or(|&last| points[index].1 < points[last].1 || points[index] == points[last]);
        if stays {
            front.push(index);
        }
    }
    front
}

/// Index of the fastest point with an error of at most `target_error`; of equally fast ones the more accurate. None where no
/// point reaches it.
pub fn cheapest_under_error(points: &[(f64, f64)], target_error: f64) -> Option<usize> {
    let reached = (0..points.len()).filter(|&index| finite(points[index]) && points[index].1 <= target_error);
    reached.min_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)))
}

/// Index of the most accurate point with a time of at most `target_ms` milliseconds; of equally accurate ones the faster. None
/// where no point is that fast.
pub fn most_accurate_under_time(points: &[(f64, f64)], target_ms: f64) -> Option<usize> {
    let reached = (0..points.len()).filter(|&index| finite(points[index]) && points[index].0 <= target_ms);
    reached.min_by(|&a, &b| points[a].1.total_cmp(&points[b].1).then(points[a].0.total_cmp(&points[b].0)))
}

/// Runs of one variant with one set of parameters, taken together.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Name of the variant.
    pub variant: String,
    /// Parameters, as (name, value).
    pub parameters: Vec<(String, String)>,
    /// Time in milliseconds.
    pub ms: f64,
    /// Error.
    pub error: f64,
    /// How many runs are behind it (in [`configurations`]), or how many scenes (in [`overall`]).
    pub count: usize,
}

impl Configuration {
    /// (time in milliseconds, error).
    pub fn point(&self) -> (f64, f64) {
        (self.ms, self.error)
    }
}

/// Configurations of one scene in the order of the rows: mean time and mean error over the seeds, so that no lucky seed is
/// chosen. A configuration with a failed run, or with a value that is not finite, is left out: a mean over the runs that happened
/// to end would flatter it.
pub fn configurations(rows: &[SweepRow], scene: &str) -> Vec<Configuration> {
    let mut found: Vec<Configuration> = Vec::new();
    for row in rows.iter().filter(|row| row.scene == scene) {
        let (ms, error) = row.point();
        match found.iter_mut().find(|one| one.variant == row.variant && one.parameters == row.parameters) {
            Some(one) => {
                one.ms += ms;
                one.error += error;
                one.count += 1;
            }
            None => {
                found.push(Configuration { variant: row.variant.clone(), parameters: row.parameters.clone(), ms, error, count: 1 });
            }
        }
    }
    for one in &mut found {
        one.ms /= one.count as f64;
        one.error /= one.count as f64;
    }
    found.retain(|one| finite(one.point()));
    found
}

/// Configurations over all scenes: those that ended in every scene, with the mean time and the geometric mean of the error.
///
/// Errors of scenes lie orders of magnitude apart, and an arithmetic mean would be the error of the hardest scene alone. A front
/// over the bare rows of all scenes would only tell which scene is easy.
pub fn overall(rows: &[SweepRow]) -> Vec<Configuration> {
    let scenes = scenes(rows);
    let mut found: Vec<Configuration> = Vec::new();
    for scene in &scenes {
        for one in configurations(rows, scene) {
            match found.iter_mut().find(|other| other.variant == one.variant && other.parameters == one.parameters) {
                Some(other) => {
                    other.ms += one.ms;
                    other.error += one.error.ln();
                    other.count += 1;
                }
                None => found.push(Configuration { error: one.error.ln(), count: 1, ..one }),
            }
        }
    }
    found.retain(|one| one.count == scenes.len());
    for one in &mut found {
        one.ms /= one.count as f64;
        one.error = (one.error / one.count as f64).exp();
    }
    found
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
mod tests {
    use super::{cheapest_under_error, configurations, most_accurate_under_time, overall, pareto_front};
    use crate::data::SweepRow;

    const POINTS: [(f64, f64); 8] = [
        (4.0, 0.10),      // on the front
        (1.0, 0.50),      // on the front
        (2.0, 0.50),      // slower than 1, as accurate
        (4.0, 0.30),      // as fast as 0, less accurate
        (f64::NAN, 0.01), // no time
        (0.5, f64::NAN),  // no error
        (9.0, 0.02),      // on the front
        (0.1, f64::INFINITY),
    ];

    #[test]
    fn the_front_holds_what_nothing_beats_by_rising_time() {
        assert_eq!(pareto_front(&POINTS), [1, 0, 6]);
        assert_eq!(pareto_front(&[(1.0, 1.0), (1.0, 1.0), (1.0, 2.0)]), [0, 1]);
        assert!(pareto_front(&[(f64::NAN, f64::NAN)]).is_empty());
        assert!(pareto_front(&[]).is_empty());
    }

    #[test]
    fn the_front_is_what_comparing_all_pairs_gives() {
        let points: Vec<(f64, f64)> = (0..60u32).map(|k| (f64::from(k * 37 % 11), f64::from(k * 53 % 13))).collect();
        let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
        let mut expected: Vec<usize> = (0..points.len()).filter(|&b| !points.iter().any(|&a| beats(a, points[b]))).collect();
        let mut front = pareto_front(&points);
        front.sort_unstable();
        expected.sort_unstable();
        assert_eq!(front, expected);
    }

    #[test]
    fn targets_choose_the_cheapest_and_the_most_accurate() {
        assert_eq!(cheapest_under_error(&POINTS, 0.3), Some(0), "of two at 4 ms, the more accurate");
        assert_eq!(cheapest_under_error(&POINTS, 0.5), Some(1));
        assert_eq!(cheapest_under_error(&POINTS, 0.05), Some(6));
        assert_eq!(cheapest_under_error(&POINTS, 0.015), None, "the point without a time must not be chosen");
        assert_eq!(most_accurate_under_time(&POINTS, 3.0), Some(1), "of two at 0.5, the faster");
        assert_eq!(most_accurate_under_time(&POINTS, 4.0), Some(0));
        assert_eq!(most_accurate_under_time(&POINTS, 0.7), None, "points without an error must not be chosen");
        assert_eq!(most_accurate_under_time(&POINTS, f64::NAN), None);
    }

    fn row(scene: &str, samples: u32, seed: u64, ms: f64, error: f64) -> SweepRow {
        let parameters = vec![("samples".to_owned(), samples.to_string())];
        SweepRow { scene: scene.to_owned(), variant: "v".to_owned(), parameters, seed, ms, error, failed: None }
    }

    #[test]
    fn a_failed_row_is_never_chosen_whatever_its_values() {
        let mut rows = [row("hall", 1, 0, 5.0, 0.5), row("hall", 2, 0, 0.1, 0.0)];
        rows[1].failed = Some("device lost".to_owned());
        let points: Vec<(f64, f64)> = rows.iter().map(SweepRow::point).collect();
        assert_eq!(pareto_front(&points), [0]);
        assert_eq!(cheapest_under_error(&points, 1.0), Some(0));
        assert_eq!(most_accurate_under_time(&points, 10.0), Some(0));
    }

    #[test]
    fn seeds_are_averaged_and_one_failed_seed_takes_the_configuration_out() {
        let mut rows =
            vec![row("hall", 1, 0, 4.0, 0.1), row("hall", 2, 0, 8.0, 0.1), row("hall", 1, 1, 6.0, 0.3), row("hall", 2, 1, 8.0, 0.1)];
        rows[3].failed = Some("lost".to_owned());
        let found = configurations(&rows, "hall");
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].ms, found[0].count), (5.0, 2));
        assert!((found[0].error - 0.2).abs() < 1e-12);
    }

    #[test]
    fn overall_needs_every_scene_and_takes_the_geometric_mean() {
        let rows = [row("hall", 1, 0, 4.0, 0.01), row("yard", 1, 0, 6.0, 1.0), row("hall", 2, 0, 1.0, 0.01)];
        let found = overall(&rows);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].ms, found[0].count), (5.0, 2));
        assert!((found[0].error - 0.1).abs() < 1e-12);
        let exact = overall(&[row("hall", 1, 0, 4.0, 0.0), row("yard", 1, 0, 6.0, 1.0)]);
        assert_eq!(exact[0].error, 0.0);
    }
}
