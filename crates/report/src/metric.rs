//! The metrics: what people call them, what they say, and which of two values is better.

use crate::direction::Direction;

/// A metric: how it is named for people and what it means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Metric {
    /// Name in `report.json` and on the command line.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// Which values there are.
    pub range: &'static str,
    /// What it is, in one line.
    pub meaning: &'static str,
    /// Where it comes from.
    pub source: &'static str,
}

const fn metric(
    name: &'static str,
    title: &'static str,
    unit: &'static str,
    range: &'static str,
    meaning: &'static str,
    source: &'static str,
) -> Metric {
    Metric { name, title, unit, range, meaning, source }
}

/// All metrics, in the order of the page.
pub const METRICS: [Metric; 10] = [
    metric(
        "flip_hdr",
        "FLIP, HDR",
        "",
        "0 to 1",
        "The difference that a viewer sees who flips between the two pictures, each pixel at its worst exposure; mean over pixels.",
        "Andersson et al. 2021",
    ),
    metric(
        "flip_ldr",
        "FLIP, displayed",
        "",
        "0 to 1",
        "The same at one exposure, which makes the mean of the reference middle grey.",
        "Andersson et al. 2020",
    ),
    metric(
        "relative_mse",
        "Relative MSE",
        "",
        "0 and up",
        "Squared error over the squared reference, dark pixels softened by a tenth of the mean; mean over pixels and channels. 0.01 is an error of 10 %.",
        "Rousselle et al. 2011, with a floor that follows the mean",
    ),
    metric(
        "rmse",
        "RMSE",
        "radiance",
        "0 and up",
        "Root of the mean squared error. The brightest pixels decide it.",
        "standard definition",
    ),
    metric(
        "mae",
        "Mean absolute error",
        "radiance",
        "0 and up",
        "Mean of the absolute error. Bright pixels count less than in RMSE.",
        "standard definition",
    ),
    metric(
        "psnr",
        "PSNR",
        "dB",
        "0 and up",
        "Mean squared error of displayed values on a logarithmic scale: 6 dB more is half the error.",
        "standard definition",
    ),
    metric(
        "ssim",
        "SSIM",
        "",
        "-1 to 1",
        "Likeness of brightness, contrast and structure in small windows of the displayed luma; 1 is equal.",
        "Wang et al. 2004",
    ),
    metric(
        "mean_ratio",
        "Mean over reference",
        "",
        "0 and up",
        "Mean of the picture over that of the reference: below 1 light is lost, above 1 it is made.",
        "standard definition",
    ),
    metric(
        "fireflies",
        "Fireflies",
        "per million pixels",
        "0 to 1 000 000",
        "Pixels that are ten times as bright as the reference there and around, and as all but two of their neighbours.",
        "this project",
    ),
    metric(
        "temporal_error",
        "Flicker",
        "",
        "0 and up",
        "Mean change from frame to frame that the reference does not make, over its mean radiance.",
        "this project",
    ),
];

impl Metric {
    /// The metric of a machine name.
    pub fn of(name: &str) -> Option<&'static Self> {
        METRICS.iter().find(|metric| metric.name == name)
    }

    /// What people call the metric of a machine name; the name itself where it is not known.
    pub fn title(name: &str) -> &str {
        Self::of(name).map_or(name, |metric| metric.title)
    }

    /// Machine names in the order of the page: known ones first.
    pub(crate) fn sort(names: &mut [String]) {
        names.sort_by_key(|name| (METRICS.iter().position(|metric| metric.name == name).unwrap_or(METRICS.len()), name.clone()));
    }
}

/// The error that a value of a metric stands for, in the unit of the metric: the value itself where lower is better, else its distance from the best value. PSNR, whose
/// best value is infinite, is turned round.
pub fn error_of(metric: &str, value: f64) -> f64 {
    match Direction::of(metric) {
        Direction::Higher if metric.to_lowercase().contains("ssim") => 1.0 - value,
        direction => direction.badness(value),
    }
}

/// The least difference of errors of two values that is called one, however sure it is: 1 % of the smaller error, and as much in decibels.
pub fn least_difference(metric: &str, a: f64, b: f64) -> f64 {
    if metric.to_lowercase().contains("psnr") {
        return 10.0 * 1.01f64.log10();
    }
    0.01 * error_of(metric, a).abs().min(error_of(metric, b).abs())
}

#[cfg(test)]
mod tests {
    use super::{METRICS, Metric, error_of, least_difference};

    #[test]
    fn every_metric_is_explained() {
        for (index, metric) in METRICS.iter().enumerate() {
            for text in [metric.title, metric.range, metric.meaning, metric.source] {
                assert!(!text.is_empty(), "{}", metric.name);
            }
            assert!(!METRICS[..index].iter().any(|other| other.title == metric.title || other.name == metric.name));
        }
        assert_eq!((Metric::title("flip_hdr"), Metric::title("new_metric")), ("FLIP, HDR", "new_metric"));
    }

    #[test]
    fn errors_are_on_one_scale() {
        assert_eq!(
            (error_of("rmse", 0.2), error_of("psnr", 30.0), error_of("ssim", 0.75), error_of("mean_ratio", 0.75)),
            (0.2, -30.0, 0.25, 0.25)
        );
        assert!((least_difference("ssim", 0.75, 0.5) - 0.0025).abs() < 1e-12);
        assert!((least_difference("psnr", 30.0, 20.0) - 0.0432).abs() < 1e-4);
        assert_eq!(least_difference("flip_hdr", 0.0, 0.2), 0.0);
    }
}
