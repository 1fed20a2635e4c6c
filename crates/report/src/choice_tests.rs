use super::*;

/// Noise of the time and of the error, relative. That of the error goes up and down together in all, as the noise of a reference does.
fn noisy(ms: f64, error: f64, ms_noise: f64, error_noise: f64) -> Configuration {
    let offsets = [-1.0, 1.0, -1.0, 1.0, 1.0, -1.0].map(|offset| error * (1.0 + error_noise * offset));
    Configuration {
        variant: "v".to_owned(),
        parameters: BTreeMap::new(),
        ms,
        ms_error: Some(StandardError { size: ms * ms_noise, freedom: 10.0 }),
        error: Sampled { value: error, replicates: offsets.to_vec(), replication: Replication::Repeats },
        floor: None,
        count: 1,
    }
}

fn exact(ms: f64, error: f64) -> Configuration {
    Configuration { ms_error: None, error: Sampled::alone(error), ..noisy(ms, error, 0.0, 0.0) }
}

fn points() -> Vec<Configuration> {
    let points = [
        (4.0, 0.10),      // on the front
        (1.0, 0.50),      // on the front
        (2.0, 0.50),      // slower than 1, as accurate
        (4.0, 0.30),      // as fast as 0, less accurate
        (f64::NAN, 0.01), // no time
        (0.5, f64::NAN),  // no error
        (9.0, 0.02),      // on the front
        (0.1, f64::INFINITY),
    ];
    points.map(|(ms, error)| exact(ms, error)).to_vec()
}

#[test]
fn the_front_holds_what_nothing_beats_by_rising_time() {
    assert_eq!(pareto_front(&points()), [1, 0, 6]);
    assert_eq!(pareto_front(&[exact(1.0, 1.0), exact(1.0, 1.0), exact(1.0, 2.0)]), [0, 1]);
    assert!(pareto_front(&[exact(f64::NAN, f64::NAN)]).is_empty());
    assert!(pareto_front(&[]).is_empty());
}

#[test]
fn without_noise_the_front_is_that_of_all_pairs() {
    let points: Vec<Configuration> = (0..60u32).map(|k| exact(f64::from(1 + k * 37 % 11), f64::from(1 + k * 53 % 13))).collect();
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    let mut expected: Vec<usize> = (0..points.len()).filter(|&b| !points.iter().any(|a| beats(a.point(), points[b].point()))).collect();
    let mut front = pareto_front(&points);
    front.sort_unstable();
    expected.sort_unstable();
    assert_eq!(front, expected);
}

/// One per cent faster, at twice the error: not on the front, whether the noise of the times is known or not.
#[test]
fn a_difference_that_is_none_puts_nothing_on_the_front() {
    assert_eq!(pareto_front(&[noisy(1.00, 0.1, 0.02, 0.01), noisy(0.99, 0.2, 0.02, 0.01)]), [0]);
    assert_eq!(pareto_front(&[exact(1.00, 0.1), exact(0.99, 0.2)]), [0]);
    // Even where rounds agree to a thousandth: what runs differ by is more.
    assert_eq!(pareto_front(&[noisy(1.00, 0.1, 0.001, 0.01), noisy(0.99, 0.2, 0.001, 0.01)]), [0]);
    // The same of the error: nothing is gained for twice the time.
    // (A negative noise is one that goes the other way, so that it does not cancel.)
    assert_eq!(pareto_front(&[noisy(1.0, 0.1, 0.01, 0.1), noisy(2.0, 0.095, 0.01, -0.1)]), [0]);
    // What is shown counts.
    assert_eq!(pareto_front(&[noisy(1.0, 0.1, 0.001, 0.01), noisy(0.9, 0.2, 0.001, 0.01)]), [1, 0]);
}

/// Each is as fast as the next within the noise, but not as the one after it.
#[test]
fn ties_in_a_row_do_not_push_each_other_out() {
    let row: Vec<Configuration> = (0..9).map(|k| noisy(1.04f64.powi(k), 0.9f64.powi(k), 0.01, 0.001)).collect();
    assert_eq!((row[0].faster(&row[1]), row[0].faster(&row[2])), (Outcome::Tie, Outcome::First));
    assert_eq!(pareto_front(&row), [0, 2, 4, 6, 8]);
}

#[test]
fn what_is_left_out_is_beaten_by_what_is_not() {
    let mut state = 5u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1u32 << 24)
    };
    for _ in 0..50 {
        let points: Vec<Configuration> =
            (0..30).map(|_| noisy(1.0 + random(), 0.1 + 0.1 * random(), 0.1 * random(), 0.1 * random())).collect();
        let front = pareto_front(&points);
        assert!(!front.is_empty());
        for index in 0..points.len() {
            let beaten = front.iter().any(|&other| points[other].beats(&points[index]));
            assert_eq!(!beaten, front.contains(&index), "{front:?} {index}");
        }
    }
}

#[test]
fn targets_choose_the_cheapest_and_the_most_accurate() {
    let points = points();
    let found = |index: usize| Choice::Found { index, ties: vec![] };
    assert_eq!(cheapest_under_error(&points, 0.3), Choice::Found { index: 0, ties: vec![3] }, "of two at 4 ms, the more accurate");
    assert_eq!(cheapest_under_error(&points, 0.5), found(1));
    assert_eq!(cheapest_under_error(&points, 0.05), found(6));
    assert_eq!(cheapest_under_error(&points, 0.015), Choice::Nothing, "the point without a time must not be chosen");
    assert_eq!(most_accurate_under_time(&points, 3.0), Choice::Found { index: 1, ties: vec![2] }, "of two at 0.5, the faster");
    assert_eq!(most_accurate_under_time(&points, 4.0), found(0));
    assert_eq!(most_accurate_under_time(&points, 0.7), Choice::Nothing, "points without an error must not be chosen");
    assert_eq!(most_accurate_under_time(&points, f64::NAN), Choice::Nothing);
}

#[test]
fn a_target_is_met_where_the_interval_ends_below_it() {
    let points = [noisy(1.0, 0.099, 0.01, 0.05), noisy(2.0, 0.05, 0.01, 0.05), noisy(2.01, 0.04, 0.01, 0.05)];
    // The fastest may be above the target; of the two others, which tie in time, the more accurate.
    assert_eq!(cheapest_under_error(&points, 0.1), Choice::Found { index: 2, ties: vec![1] });
    assert_eq!(cheapest_under_error(&points[..1], 0.1), Choice::Perhaps(0));
    assert_eq!(cheapest_under_error(&points[..1], 0.09), Choice::Nothing);
    assert_eq!(most_accurate_under_time(&points, 2.02), Choice::Found { index: 0, ties: vec![] });
    assert_eq!(most_accurate_under_time(&points[1..], 2.02), Choice::Perhaps(1));
}

fn row(scene: &str, samples: u32, seed: u64, ms: f64, error: f64) -> SweepRow {
    SweepRow {
        scene: scene.to_owned(),
        variant: "v".to_owned(),
        parameters: BTreeMap::from([("samples".to_owned(), samples.into())]),
        seed,
        ms,
        round_ms: vec![0.99 * ms, 1.01 * ms],
        error: Some(Sampled { value: error, replicates: vec![0.9 * error, 1.1 * error], replication: Replication::Repeats }),
        floor: Some(0.1 * error),
        failed: None,
    }
}

#[test]
fn a_failed_row_is_never_chosen_whatever_its_values() {
    let mut rows = [row("hall", 1, 0, 5.0, 0.5), row("hall", 2, 0, 0.1, 0.0)];
    rows[1].failed = Some("device lost".to_owned());
    let found = configurations(&rows, "hall");
    assert_eq!((found.len(), found[0].ms), (1, 5.0));
}

#[test]
fn seeds_are_averaged_and_one_failed_seed_takes_the_configuration_out() {
    let mut rows = vec![row("hall", 1, 0, 4.0, 0.1), row("hall", 2, 0, 8.0, 0.1), row("hall", 1, 1, 6.0, 0.3), row("hall", 2, 1, 8.0, 0.1)];
    rows[3].failed = Some("lost".to_owned());
    let found = configurations(&rows, "hall");
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].ms, found[0].count), (5.0, 2));
    assert!((found[0].error.value - 0.2).abs() < 1e-12 && (found[0].error.replicates[0] - 0.18).abs() < 1e-12);
    // Both runs' rounds: their logarithms lie 0.2 about their mean.
    assert!((found[0].ms_error.map_or(0.0, |error| error.size) - 5.0 * 0.2034 / 3f64.sqrt()).abs() < 0.01, "{:?}", found[0].ms_error);
}

#[test]
fn overall_needs_every_scene_and_takes_the_geometric_mean() {
    let rows = [row("hall", 1, 0, 4.0, 0.01), row("yard", 1, 0, 6.0, 1.0), row("hall", 2, 0, 1.0, 0.01)];
    let found = overall(&rows);
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].ms, found[0].count), (5.0, 2));
    assert!((found[0].error.value - 0.1).abs() < 1e-12 && (found[0].error.replicates[1] - 0.11).abs() < 1e-12);
    assert!((found[0].floor.map_or(0.0, f64::ln) - 0.01f64.ln()).abs() < 1e-9);
    let exact = overall(&[row("hall", 1, 0, 4.0, 0.0), row("yard", 1, 0, 6.0, 1.0)]);
    assert_eq!(exact[0].error.value, 0.0);
}
