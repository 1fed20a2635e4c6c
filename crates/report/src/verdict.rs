//! Which variant is shown to be better, and where: the lines on top of the page.

use crate::{
    data::{Better, Comparison},
    direction::Direction,
    html::{number, value_with_interval, with_unit},
    metric::{Metric, error_of},
};

/// Metrics that decide, the first that is there; where none is, the first in the order of the page.
const DECIDING: [&str; 4] = ["flip_hdr", "flip", "relative_mse", "rmse"];

/// The name under which the times of frames are compared.
pub(crate) const FRAME: &str = "frame_ms";

/// What the top of the page says.
pub(crate) struct Verdict {
    pub headline: String,
    pub sentences: Vec<String>,
}

pub(crate) fn verdict(comparison: &Comparison) -> Verdict {
    let (headline, mut sentences) = words(comparison);
    if let Some(map) = comparison.map.as_ref().filter(|map| map.is_whole(comparison.variants.len())) {
        sentences.extend(map.sentences(|index| quoted(&comparison.variants[index].name)));
    }
    Verdict { headline, sentences }
}

/// Name of the metric that decides.
pub(crate) fn deciding_metric(comparison: &Comparison) -> Option<String> {
    let names = metric_names(comparison);
    let preferred = DECIDING.iter().find_map(|wanted| names.iter().find(|name| name.to_lowercase() == *wanted));
    preferred.or(names.first()).cloned()
}

/// Names of all metrics of all variants, in the order of the page.
pub(crate) fn metric_names(comparison: &Comparison) -> Vec<String> {
    let mut names: Vec<String> = comparison.variants.iter().flat_map(|variant| variant.metrics.keys().cloned()).collect();
    Metric::sort(&mut names);
    names.dedup();
    names
}

/// The error of each variant by a metric, or its time by [`FRAME`]; infinite where it has none.
fn errors(comparison: &Comparison, metric: &str) -> Vec<f64> {
    let of = |variant: &crate::data::Variant| {
        if metric == FRAME {
            return variant.frame_ms.map_or(f64::INFINITY, |time| time.median);
        }
        variant.metrics.get(metric).map_or(f64::INFINITY, |found| error_of(metric, found.value))
    };
    comparison.variants.iter().map(of).map(|error| if error.is_nan() { f64::INFINITY } else { error }).collect()
}

/// Whether variant `a` is shown to be better than variant `b`.
pub(crate) fn is_better(comparison: &Comparison, metric: &str, a: usize, b: usize) -> bool {
    let (a, b) = (&comparison.variants[a].name, &comparison.variants[b].name);
    comparison
        .comparisons
        .iter()
        .filter(|one| one.metric == metric)
        .any(|one| (one.better == Better::A && one.a == *a && one.b == *b) || (one.better == Better::B && one.a == *b && one.b == *a))
}

/// The variant of the least error by a measure, and those that it is not shown to be better than, itself first. Empty where no variant has a finite value.
pub(crate) fn leaders(comparison: &Comparison, metric: &str) -> Vec<usize> {
    let errors = errors(comparison, metric);
    let Some(best) = (0..errors.len()).filter(|&index| errors[index].is_finite()).min_by(|&a, &b| errors[a].total_cmp(&errors[b])) else {
        // Likenesses of equal pictures are infinite.
        return Vec::new();
    };
    let rest = (0..errors.len()).filter(|&other| other != best && errors[other].is_finite() && !is_better(comparison, metric, best, other));
    std::iter::once(best).chain(rest).collect()
}

fn words(comparison: &Comparison) -> (String, Vec<String>) {
    let variants = &comparison.variants;
    let Some(metric) = deciding_metric(comparison) else {
        return ("No metric to compare by".to_owned(), Vec::new());
    };
    let title = Metric::title(&metric);
    let name = |index: usize| quoted(&variants[index].name);
    let accurate = leaders(comparison, &metric);
    let Some(&best) = accurate.first() else {
        return (format!("No variant has a finite {title}"), Vec::new());
    };
    let value = |index: usize| variants[index].metrics.get(&metric).map_or_else(|| "no value".to_owned(), value_with_interval);
    let finite = errors(comparison, &metric).iter().filter(|error| error.is_finite()).count();
    if finite < 2 {
        let time = variants[best].frame_ms.map_or_else(String::new, |time| format!(", {}", with_unit(time.median, "ms")));
        let only = format!("{}: {title} {}{time}", name(best), value(best));
        return (only, vec!["There is no second variant with this metric to hold it against.".to_owned()]);
    }
    let fast = leaders(comparison, FRAME);
    let timed = errors(comparison, FRAME).iter().filter(|ms| ms.is_finite()).count() == variants.len()
        && variants.iter().all(|variant| variant.frame_ms.is_some_and(|time| time.low.is_some()));
    let headline = match (accurate.as_slice(), fast.as_slice()) {
        ([_], _) if !timed => format!("{} is more accurate", name(best)),
        ([_], [fastest]) if *fastest == best => format!("{} is better: more accurate and faster", name(best)),
        ([_], [fastest]) => format!("{} is more accurate, {} is faster", name(best), name(*fastest)),
        ([_], several) if several.contains(&best) => format!("{} is more accurate; no faster one is shown", name(best)),
        ([_], several) => format!("{} is more accurate, {} are faster", name(best), list(several, &name)),
        (tied, fast) => {
            let accuracy = match tied {
                [a, b] => format!("No difference in accuracy is shown between {} and {}", name(*a), name(*b)),
                _ => format!("None is shown to be more accurate among {}", list(tied, &name)),
            };
            match fast {
                _ if !timed => accuracy,
                [fastest] => format!("{accuracy}; {} is faster", name(*fastest)),
                _ if fast.len() == variants.len() => format!("{accuracy}, nor in time"),
                several => format!("{accuracy}; {} are faster", list(several, &name)),
            }
        }
    };
    let mut sentences = Vec::new();
    let all: Vec<String> =
        sorted(&errors(comparison, &metric)).into_iter().map(|index| format!("{} for {}", value(index), name(index))).collect();
    sentences.push(format!("{title} ({}): {}.", Direction::of(&metric).words(), all.join(", ")));
    if accurate.len() > 1 {
        sentences.push("What differs there lies within the noise of samples and reference, or is too small to matter.".to_owned());
    }
    sentences.extend(times(comparison, &fast, timed));
    for other in metric_names(comparison).iter().filter(|other| **other != metric) {
        let rivals = if accurate.len() > 1 { accurate.clone() } else { vec![best] };
        let winner = leaders(comparison, other).first().copied().filter(|winner| {
            // Where accuracy is a tie, another metric may tell them apart; where it is not, only what speaks against the verdict is news.
            rivals.iter().any(|&rival| rival != *winner && is_better(comparison, other, *winner, rival))
                && (accurate.len() > 1 || *winner != best)
        });
        if let Some(winner) = winner {
            let but = if accurate.len() > 1 { "By" } else { "But by" };
            let shown = variants[winner].metrics.get(other).map_or_else(String::new, |found| format!(" ({})", value_with_interval(found)));
            let against: Vec<usize> =
                rivals.iter().copied().filter(|&rival| rival != winner && is_better(comparison, other, winner, rival)).collect();
            sentences.push(format!("{but} {} {} is better than {}{shown}.", Metric::title(other), name(winner), list(&against, &name)));
        }
    }
    if let (Some(floor), Some(found)) = (comparison.reference.floor.get(&metric), variants[best].metrics.get(&metric))
        && error_of(&metric, found.value) < 2.0 * error_of(&metric, *floor)
        && Direction::of(&metric) == Direction::Lower
    {
        sentences.push(format!(
            "The noise of the reference alone would make {title} {}: what is near that may be closer to the truth than it seems; a reference with less noise would tell.",
            number(*floor)
        ));
    }
    (headline, sentences)
}

/// What is said of times.
fn times(comparison: &Comparison, fast: &[usize], timed: bool) -> Vec<String> {
    let order = sorted(&errors(comparison, FRAME));
    let (Some(&first), Some(&last)) = (order.first(), order.last()) else { return Vec::new() };
    let name = |index: usize| quoted(&comparison.variants[index].name);
    let time = |index: usize| comparison.variants[index].frame_ms.map_or_else(String::new, |time| crate::html::time_with_interval(&time));
    if first == last {
        return Vec::new();
    }
    let mut sentences = vec![format!("A frame takes {} with {}, {} with {}.", time(first), name(first), time(last), name(last))];
    if !timed {
        sentences.push("Times are of one round, so that nothing tells their noise: who is faster is not said.".to_owned());
    } else if fast.len() > 1 {
        sentences.push(format!("{} is not shown to be faster than {}.", name(fast[0]), list(&fast[1..], &name)));
    }
    sentences
}

/// Indices of finite errors, the least first.
fn sorted(errors: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..errors.len()).filter(|&index| errors[index].is_finite()).collect();
    order.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    order
}

/// Names with commas and an "and".
fn list(indices: &[usize], name: &impl Fn(usize) -> String) -> String {
    let names: Vec<String> = indices.iter().map(|&index| name(index)).collect();
    match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}

/// Names hold commas and verbs: quotes show where one ends.
fn quoted(name: &str) -> String {
    format!("“{name}”")
}

/// What is wrong with a picture, in words; none where it can be shown.
pub(crate) fn fault(picture: &crate::data::Picture) -> Option<String> {
    match image::load_from_memory_with_format(&picture.png, image::ImageFormat::Png) {
        Err(_) => Some("is not a whole PNG file".to_owned()),
        Ok(decoded) if (decoded.width(), decoded.height()) != (picture.width, picture.height) => {
            Some(format!("is {} x {} pixels, not {} x {}", decoded.width(), decoded.height(), picture.width, picture.height))
        }
        Ok(_) => None,
    }
}
