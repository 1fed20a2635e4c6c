//! From what trials measured to what a report says: intervals, ties, and how pictures are shown first.

mod tiles;

pub use tiles::where_closest;

use crate::trial::{Change, Measured, differences};
use glam::DVec3;
use lobelia_graph::Timing;
use lobelia_lobes::{
    luminance,
    tonemap::{aces, agx, srgb_encode},
};
use lobelia_measure::{
    Image,
    sampled::{DECISION_LEVEL, Difference, Outcome, Replication, SHOWN_LEVEL, Sampled},
    timing::{LEAST_CHANGE, Timed},
};
use lobelia_report::{
    Better, Clock, Compared, Measurement, PassChange, PassDifference, Radiance, Replicated, Time, View, error_of, least_difference,
};
use std::collections::BTreeMap;

/// Metrics of one technique with their replicates, by machine name.
pub type Metrics = BTreeMap<String, Sampled>;

/// A value with its 95 % interval. Ends that no value of the metric can have are cut off.
pub fn measurement(metric: &str, found: &Sampled) -> Measurement {
    let interval = found.interval(SHOWN_LEVEL);
    let (least, most) = match metric {
        "psnr" => (f64::NEG_INFINITY, f64::INFINITY),
        "ssim" => (-1.0, 1.0),
        "flip_hdr" | "flip_ldr" => (0.0, 1.0),
        "fireflies" => (0.0, 1e6),
        _ => (0.0, f64::INFINITY),
    };
    Measurement {
        value: found.value,
        low: interval.map(|interval| interval.low.clamp(least, most)),
        high: interval.map(|interval| interval.high.clamp(least, most)),
    }
}

/// A time as a report has it.
pub fn time(found: &Timed) -> Time {
    let (summary, interval) = (found.summary, found.interval());
    Time {
        median: summary.median,
        low: interval.map(|interval| interval.0),
        high: interval.map(|interval| interval.1),
        p5: summary.p5,
        p95: summary.p95,
        rounds: found.logarithm.replicates.len() as u32,
    }
}

/// How time was taken, as a report has it.
pub fn clock(timing: Timing) -> Clock {
    match timing {
        Timing::Off => Clock::Off,
        Timing::Timestamps => Clock::Timestamps,
        Timing::Isolated => Clock::WallClock,
    }
}

fn better(outcome: Outcome) -> Better {
    match outcome {
        Outcome::First => Better::A,
        Outcome::Second => Better::B,
        Outcome::Tie => Better::Tie,
    }
}

/// Two values of one metric, by their errors.
fn compare_metric(metric: &str, names: [&str; 2], values: [&Sampled; 2]) -> Compared {
    let [first, second] = values.map(|value| value.map(|value| error_of(metric, value)));
    let difference = Difference::paired(&first, &second);
    let interval = difference.interval(DECISION_LEVEL);
    let outcome = difference.outcome(least_difference(metric, values[0].value, values[1].value));
    let [a, b] = names.map(str::to_owned);
    Compared {
        metric: metric.to_owned(),
        a,
        b,
        difference: difference.value,
        low: interval.map(|interval| interval.low).filter(|end| end.is_finite()),
        high: interval.map(|interval| interval.high).filter(|end| end.is_finite()),
        better: better(outcome),
    }
}

fn compare_times(names: [&str; 2], times: [&Timed; 2]) -> Compared {
    let difference = Difference::paired(&times[0].logarithm, &times[1].logarithm);
    let interval = difference.interval(DECISION_LEVEL);
    let [a, b] = names.map(str::to_owned);
    Compared {
        metric: "frame_ms".to_owned(),
        a,
        b,
        difference: difference.value.exp_m1(),
        low: interval.map(|interval| interval.low.exp_m1()).filter(|end| end.is_finite()),
        high: interval.map(|interval| interval.high.exp_m1()).filter(|end| end.is_finite()),
        better: better(difference.outcome(LEAST_CHANGE.ln_1p())),
    }
}

/// Every pair of techniques by every metric that both have, and by the time of a frame.
pub fn compare_all(names: &[&str], metrics: &[Metrics], times: &[Option<&Timed>]) -> Vec<Compared> {
    let mut found = Vec::new();
    for first in 0..names.len() {
        for second in first + 1..names.len() {
            let pair = [names[first], names[second]];
            for (metric, value) in &metrics[first] {
                if let Some(other) = metrics[second].get(metric) {
                    found.push(compare_metric(metric, pair, [value, other]));
                }
            }
            if let (Some(a), Some(b)) = (times[first], times[second]) {
                found.push(compare_times(pair, [a, b]));
            }
        }
    }
    found
}

/// What the intervals of a trial are over.
pub fn replicated(measured: &Measured) -> Replicated {
    let count = measured.pictures.parts.len() as u32;
    match measured.pictures.replication {
        Replication::LeaveOut(_) => Replicated::Groups { count },
        _ => Replicated::Seeds { count },
    }
}

/// Where the passes of all techniques differ from those of the first.
pub fn pass_differences(measured: &[Measured]) -> Vec<PassDifference> {
    let Some((first, others)) = measured.split_first() else { return Vec::new() };
    let of = |measured: &Measured, name: &str| {
        let pass = measured.passes.iter().find(|pass| pass.name == name)?;
        Some((pass.kind.to_owned(), pass.gpu_ms.as_ref().map(|time| time.summary.median)))
    };
    let difference = |other: &Measured, (pass, change): (String, Change)| {
        let (a, b) = (of(first, &pass), of(other, &pass));
        PassDifference {
            a: first.name.clone(),
            b: other.name.clone(),
            what: match change {
                Change::OnlyFirst => PassChange::OnlyA,
                Change::OnlySecond => PassChange::OnlyB,
                Change::Kind => PassChange::Kind,
                Change::Parameters => PassChange::Parameters,
            },
            a_ms: a.as_ref().and_then(|(_, ms)| *ms),
            b_ms: b.as_ref().and_then(|(_, ms)| *ms),
            a_kind: a.map(|(kind, _)| kind),
            b_kind: b.map(|(kind, _)| kind),
            pass,
        }
    };
    others
        .iter()
        .flat_map(|other| differences(first, other).into_iter().map(|found| difference(other, found)).collect::<Vec<_>>())
        .collect()
}

/// Radiance as a report has it.
pub fn radiance(image: &Image) -> Radiance {
    Radiance { width: image.width as u32, height: image.height as u32, pixels: image.pixels.clone() }
}

/// Share of black and of white pixels above which a graph's own exposure does not suit the scene.
const UNSUITABLE: f64 = 0.75;

/// How pictures are shown at first: as the first graph with a tone curve shows them, or, where that leaves most of the reference black or white or there is none, so exposed
/// that the mean luminance of the reference is middle grey.
pub fn first_view<'a>(reference: &Image, tones: impl IntoIterator<Item = &'a View>) -> View {
    let luminances = || reference.pixels.iter().map(|pixel| luminance(DVec3::from(pixel.map(|value| f64::from(value).max(0.0)))));
    let mean = luminances().filter(|value| value.is_finite()).sum::<f64>() / reference.pixels.len().max(1) as f64;
    let exposure = if mean > 0.0 { (0.18 / mean).log2() } else { 0.0 };
    let tone = tones.into_iter().next();
    let Some(tone) = tone else { return View { curve: "agx".to_owned(), exposure } };
    let shown = |pixel: &[f32; 3]| {
        let exposed = DVec3::from(pixel.map(f64::from)) * tone.exposure.exp2();
        let mapped = match tone.curve.as_str() {
            "aces" => aces(exposed),
            "agx" => agx(exposed),
            _ => exposed.clamp(DVec3::ZERO, DVec3::ONE),
        };
        srgb_encode(luminance(mapped))
    };
    let lost = reference.pixels.iter().map(shown).filter(|value| *value < 2.0 / 255.0 || *value > 252.0 / 255.0).count();
    if lost as f64 > UNSUITABLE * reference.pixels.len() as f64 { View { curve: tone.curve.clone(), exposure } } else { tone.clone() }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn sampled(value: f64, noise: f64) -> Sampled {
        let replicates = [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0].map(|sign| value + sign * noise).to_vec();
        Sampled { value, replicates, replication: Replication::Repeats }
    }

    fn outcome(metric: &str, a: Sampled, b: Sampled) -> Better {
        compare_metric(metric, ["a", "b"], [&a, &b]).better
    }

    #[test]
    fn directions_are_those_of_the_metrics() {
        assert_eq!(outcome("rmse", sampled(0.1, 1e-3), sampled(0.2, 1e-3)), Better::A);
        assert_eq!(outcome("psnr", sampled(30.0, 0.01), sampled(20.0, 0.01)), Better::A);
        assert_eq!(outcome("ssim", sampled(0.8, 1e-3), sampled(0.9, 1e-3)), Better::B);
        assert_eq!(outcome("mean_ratio", sampled(0.8, 1e-3), sampled(1.1, 1e-3)), Better::B);
        // Noise that is not shared, and differences that do not matter.
        let shifted = |value: f64| Sampled {
            replicates: sampled(value, 0.1).replicates.iter().map(|x| 2.0 * value - x).collect(),
            ..sampled(value, 0.1)
        };
        assert_eq!(outcome("rmse", sampled(0.3, 0.1), shifted(0.4)), Better::Tie);
        assert_eq!(outcome("rmse", sampled(0.3000, 1e-6), sampled(0.3029, 1e-6)), Better::Tie);
        assert_eq!(outcome("rmse", sampled(0.3000, 1e-6), sampled(0.3031, 1e-6)), Better::A);
        assert_eq!(outcome("psnr", sampled(f64::INFINITY, 0.0), sampled(20.0, 0.01)), Better::Tie);
    }

    #[test]
    fn ends_of_intervals_are_values_of_the_metric() {
        let found = measurement("flip_hdr", &sampled(0.1, 0.2));
        assert!(found.low == Some(0.0) && found.high.unwrap() > 0.4 && found.high.unwrap() <= 1.0, "{found:?}");
        assert_eq!(measurement("flip_hdr", &Sampled::alone(0.1)), Measurement { value: 0.1, low: None, high: None });
    }

    #[test]
    fn all_pairs_are_compared() {
        let metrics = |error: f64| Metrics::from([("rmse".to_owned(), sampled(error, 1e-3))]);
        let timed = |scale: f64| Timed::of(&[1.0, 1.01, 0.99, 1.0].map(|round| vec![scale * round])).unwrap();
        let times = [timed(1.0), timed(2.0), timed(2.01)];
        let found = compare_all(&["a", "b", "c"], &[metrics(0.1), metrics(0.2), metrics(0.1)], &times.each_ref().map(Some));
        let of =
            |metric: &str, a: &str, b: &str| found.iter().find(|one| one.metric == metric && one.a == a && one.b == b).unwrap().clone();
        assert_eq!(found.len(), 6);
        assert_eq!(
            (of("rmse", "a", "b").better, of("rmse", "a", "c").better, of("rmse", "b", "c").better),
            (Better::A, Better::Tie, Better::B)
        );
        assert_eq!((of("frame_ms", "a", "b").better, of("frame_ms", "b", "c").better), (Better::A, Better::Tie));
        assert!((of("frame_ms", "a", "b").difference + 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_first_view_shows_something() {
        let image = |value: f32| Image { width: 4, height: 4, pixels: vec![[value; 3]; 16] };
        let tone = View { curve: "aces".to_owned(), exposure: 2.0 };
        assert_eq!(first_view(&image(0.1), [&tone]), tone);
        // Far too bright and far too dark for what the graph has.
        for value in [1e4f32, 1e-6] {
            let view = first_view(&image(value), [&tone]);
            assert!(view.curve == "aces" && (f64::from(value) * view.exposure.exp2() - 0.18).abs() < 1e-3, "{view:?}");
        }
        assert_eq!(first_view(&image(0.18), []).curve, "agx");
        assert_eq!(first_view(&image(0.0), []).exposure, 0.0);
    }
}
