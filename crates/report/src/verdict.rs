//! Which variant is better, and where: the line on top of the page.

use image::RgbImage;

use crate::data::{Comparison, Picture};
use crate::direction::Direction;
use crate::html::{number, with_unit};

/// Relative gap of a metric or of a time below which two variants are called equal.
const EQUAL: f64 = 0.01;

/// Metrics that decide, the first that is there; where none is, the first by name.
const DECIDING: [&str; 4] = ["flip", "relative mse", "relmse", "rmse"];

/// What the top of the page says.
pub(crate) struct Verdict {
    pub headline: String,
    pub sentences: Vec<String>,
    pub map: Option<WhereMap>,
}

pub(crate) fn verdict(comparison: &Comparison) -> Verdict {
    let map = WhereMap::new(comparison);
    let (headline, mut sentences) = words(comparison);
    if let Some(map) = &map {
        sentences.extend(map.sentences(comparison));
    }
    Verdict { headline, sentences, map }
}

/// Name of the metric that decides.
pub(crate) fn deciding_metric(comparison: &Comparison) -> Option<String> {
    let names = metric_names(comparison);
    let preferred = DECIDING.iter().find_map(|wanted| names.iter().find(|name| name.to_lowercase().replace('_', " ").contains(wanted)));
    preferred.or(names.first()).cloned()
}

/// Names of all metrics of all variants, sorted.
pub(crate) fn metric_names(comparison: &Comparison) -> Vec<String> {
    let mut names: Vec<String> = comparison.variants.iter().flat_map(|variant| variant.metrics.keys().cloned()).collect();
    names.sort();
    names.dedup();
    names
}

/// The value of one metric for each variant, NaN where a variant does not have it.
pub(crate) fn metric_values(comparison: &Comparison, metric: &str) -> Vec<f64> {
    comparison.variants.iter().map(|variant| variant.metrics.get(metric).copied().unwrap_or(f64::NAN)).collect()
}

fn words(comparison: &Comparison) -> (String, Vec<String>) {
    let variants = &comparison.variants;
    let Some(metric) = deciding_metric(comparison) else {
        return ("No metric to compare by".to_owned(), Vec::new());
    };
    let direction = Direction::of(&metric);
    let values = metric_values(comparison, &metric);
    let times: Vec<f64> = variants.iter().map(|variant| variant.total_ms).collect();
    let accurate = order(&values, direction);
    let fast = order(&times, Direction::Lower);
    let name = |index: usize| quoted(&variants[index].name);
    let (Some(&best), second) = (accurate.first(), accurate.get(1).copied()) else {
        return (format!("No variant has a finite {metric}"), Vec::new());
    };
    let Some(second) = second else {
        let only = format!("{}: {metric} {}, {}", name(best), number(values[best]), with_unit(times[best], "ms"));
        return (only, vec!["There is no second variant with this metric to hold it against.".to_owned()]);
    };
    let equal = gap(direction.badness(values[best]), direction.badness(values[second])) < EQUAL;
    // Without a time of the best there is nothing to say of who is faster than it.
    let fastest = fast.first().copied().filter(|_| fast.len() > 1 && times[best].is_finite());
    let as_fast = |index: usize| fastest.is_some_and(|fastest| gap(times[fastest], times[index]) < EQUAL);
    let headline = match (equal, fastest) {
        (false, Some(fastest)) if fastest == best => format!("{} is better: more accurate and faster", name(best)),
        (false, Some(_)) if as_fast(best) => format!("{} is better: more accurate, and as fast", name(best)),
        (false, Some(fastest)) => format!("{} is more accurate, {} is faster", name(best), name(fastest)),
        (false, None) => format!("{} is more accurate", name(best)),
        (true, Some(fastest)) => {
            let close = accurate.iter().filter(|&&index| gap(direction.badness(values[best]), direction.badness(values[index])) < EQUAL);
            let names: Vec<String> = close.map(|&index| name(index)).collect();
            let all_as_fast = accurate.iter().all(|&index| as_fast(index));
            let speed = if all_as_fast { "they are equally fast".to_owned() } else { format!("{} is the fastest", name(fastest)) };
            format!("{} are equally accurate; {speed}", names.join(" and "))
        }
        (true, None) => format!("{} and {} are equally accurate", name(best), name(second)),
    };
    let mut sentences = vec![format!(
        "{metric} ({}): {} for {}, {} for {}{}.",
        direction.words(),
        number(values[best]),
        name(best),
        number(values[second]),
        name(second),
        share(direction, values[best], values[second])
    )];
    if let (Some(&first), Some(&last)) = (fast.first(), fast.last())
        && first != last
    {
        let (fast_ms, slow_ms) = (times[first], times[last]);
        let factor = if fast_ms > 0.0 { format!(" ({} times as long)", number(slow_ms / fast_ms)) } else { String::new() };
        sentences.push(format!(
            "A frame takes {} with {}, {} with {}{factor}.",
            with_unit(fast_ms, "ms"),
            name(first),
            with_unit(slow_ms, "ms"),
            name(last)
        ));
    }
    for other in metric_names(comparison).iter().filter(|other| **other != metric) {
        let values = metric_values(comparison, other);
        let order = order(&values, Direction::of(other));
        if let (Some(&winner), Some(&next)) = (order.first(), order.get(1))
            && winner != best
            && !equal
            && gap(Direction::of(other).badness(values[winner]), Direction::of(other).badness(values[next])) >= EQUAL
        {
            sentences.push(format!("But by {other} {} is better ({}).", name(winner), number(values[winner])));
        }
    }
    (headline, sentences)
}

/// Names hold commas and verbs: quotes show where one ends.
fn quoted(name: &str) -> String {
    format!("“{name}”")
}

/// Indices of the finite values, the best first.
fn order(values: &[f64], direction: Direction) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).filter(|&index| values[index].is_finite()).collect();
    order.sort_by(|&a, &b| direction.badness(values[a]).total_cmp(&direction.badness(values[b])));
    order
}

/// Difference of two values over the larger of their sizes, 0 for two zeros.
fn gap(a: f64, b: f64) -> f64 {
    let size = a.abs().max(b.abs());
    if size == 0.0 { 0.0 } else { (a - b).abs() / size }
}

fn share(direction: Direction, best: f64, second: f64) -> String {
    match direction {
        Direction::Lower if second > 0.0 && best >= 0.0 && best < second => format!(" ({} % lower)", number((1.0 - best / second) * 100.0)),
        _ => String::new(),
    }
}

/// Which variant is closest to the reference, tile by tile, on the pictures as shown (8 bits, tone-mapped).
pub(crate) struct WhereMap {
    pub columns: u32,
    pub rows: u32,
    /// Index of the closest variant, none where no variant leads.
    pub closest: Vec<Option<usize>>,
    /// Mean absolute difference from the reference, in levels of 255, per variant and tile.
    distance: Vec<Vec<f64>>,
}

/// A lead must be visible: at least this much of the runner-up's distance, and this many levels of 255.
const LEAD: f64 = 0.1;
const LEAD_LEVELS: f64 = 0.25;

impl WhereMap {
    /// None with fewer than two variants, and where pictures cannot be decoded or their sizes differ.
    fn new(comparison: &Comparison) -> Option<Self> {
        let reference = decode(&comparison.reference)?;
        let pictures: Vec<RgbImage> = comparison.variants.iter().map(|variant| decode(&variant.picture)).collect::<Option<_>>()?;
        let (width, height) = reference.dimensions();
        if pictures.len() < 2 || width == 0 || height == 0 || pictures.iter().any(|picture| picture.dimensions() != (width, height)) {
            return None;
        }
        let columns = width.min(24);
        let rows = (f64::from(columns) * f64::from(height) / f64::from(width)).round().clamp(1.0, f64::from(height.min(24))) as u32;
        let tile_of = |x: u32, y: u32| {
            let column = u64::from(x) * u64::from(columns) / u64::from(width);
            let row = u64::from(y) * u64::from(rows) / u64::from(height);
            (row * u64::from(columns) + column) as usize
        };
        let tiles = (columns * rows) as usize;
        let distance: Vec<Vec<f64>> = pictures
            .iter()
            .map(|picture| {
                let (mut sums, mut counts) = (vec![0.0; tiles], vec![0.0; tiles]);
                for ((x, y, expected), pixel) in reference.enumerate_pixels().zip(picture.pixels()) {
                    let tile = tile_of(x, y);
                    let difference: u32 = expected.0.iter().zip(pixel.0).map(|(a, b)| u32::from(a.abs_diff(b))).sum();
                    sums[tile] += f64::from(difference) / 3.0;
                    counts[tile] += 1.0;
                }
                sums.iter().zip(&counts).map(|(sum, count)| sum / f64::max(*count, 1.0)).collect()
            })
            .collect();
        let closest = (0..tiles)
            .map(|tile| {
                let mut order: Vec<usize> = (0..distance.len()).collect();
                order.sort_by(|&a, &b| distance[a][tile].total_cmp(&distance[b][tile]));
                let lead = distance[order[1]][tile] - distance[order[0]][tile];
                (lead >= LEAD_LEVELS && lead >= LEAD * distance[order[1]][tile]).then_some(order[0])
            })
            .collect();
        Some(Self { columns, rows, closest, distance })
    }

    /// Share of the tiles in which a variant leads.
    pub fn share(&self, variant: usize) -> f64 {
        self.closest.iter().filter(|winner| **winner == Some(variant)).count() as f64 / self.closest.len() as f64
    }

    fn sentences(&self, comparison: &Comparison) -> Vec<String> {
        let mut leads: Vec<usize> = (0..self.distance.len()).filter(|&variant| self.share(variant) > 0.0).collect();
        leads.sort_by(|&a, &b| self.share(b).total_cmp(&self.share(a)));
        if leads.is_empty() {
            return vec!["Nowhere in the picture does one of them come visibly closer to the reference.".to_owned()];
        }
        let parts: Vec<String> = leads
            .iter()
            .map(|&variant| {
                let advantage = |tile: usize| {
                    let runner_up = (0..self.distance.len()).filter(|&other| other != variant).map(|other| self.distance[other][tile]);
                    let lead = runner_up.fold(f64::INFINITY, f64::min) - self.distance[variant][tile];
                    if self.closest[tile] == Some(variant) { lead } else { 0.0 }
                };
                let share = self.share(variant) * 100.0;
                format!(
                    "{} in {share:.0} % of the picture, most at the {}",
                    quoted(&comparison.variants[variant].name),
                    self.region(advantage)
                )
            })
            .collect();
        let mut sentences = vec![format!("Visibly closer to the reference: {}.", parts.join("; "))];
        let best = leads[0];
        if self.distance[best].iter().any(|&distance| distance >= 1.0) {
            let region = self.region(|tile| self.distance[best][tile]);
            sentences.push(format!("What is left of the error of {} is largest at the {region}.", quoted(&comparison.variants[best].name)));
        }
        sentences
    }

    /// The ninth of the picture where the mean weight is largest.
    fn region(&self, weight: impl Fn(usize) -> f64) -> &'static str {
        const NAMES: [&str; 9] = ["upper left", "top", "upper right", "left", "centre", "right", "lower left", "bottom", "lower right"];
        let (mut sums, mut counts) = ([0.0f64; 9], [0.0f64; 9]);
        for tile in 0..self.closest.len() {
            let (column, row) = (tile as u32 % self.columns, tile as u32 / self.columns);
            let ninth = (row * 3 / self.rows * 3 + column * 3 / self.columns) as usize;
            sums[ninth] += weight(tile);
            counts[ninth] += 1.0;
        }
        let mean = |ninth: usize| sums[ninth] / counts[ninth].max(1.0);
        let largest = (0..9).max_by(|&a, &b| mean(a).total_cmp(&mean(b))).unwrap_or(4);
        NAMES[largest]
    }
}

/// What is wrong with a picture, in words; none where it can be shown.
pub(crate) fn fault(picture: &Picture) -> Option<String> {
    match decode(picture) {
        None => Some("is not a whole PNG file".to_owned()),
        Some(decoded) if decoded.dimensions() != (picture.width, picture.height) => {
            let (width, height) = decoded.dimensions();
            Some(format!("is {width} x {height} pixels, not {} x {}", picture.width, picture.height))
        }
        Some(_) => None,
    }
}

fn decode(picture: &Picture) -> Option<RgbImage> {
    let decoded = image::load_from_memory_with_format(&picture.png, image::ImageFormat::Png).ok()?;
    Some(decoded.to_rgb8())
}
