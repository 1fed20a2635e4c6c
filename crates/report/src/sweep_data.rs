//! What the page of a sweep shows.

use crate::data::null_as_nan;
use lobelia_measure::sampled::Sampled;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Error against time over a grid of settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sweep {
    /// [`crate::VERSION`].
    pub version: u32,
    /// Heading of the page.
    pub title: String,
    /// Devices that gave the times.
    pub devices: Vec<String>,
    /// Machine name of the metric whose error is plotted; see [`crate::plotted_error`] for what that is.
    pub metric: String,
    /// Error that the reader wants to stay under.
    pub target_error: Option<f64>,
    /// Time that the reader wants to stay under, in milliseconds.
    pub target_ms: Option<f64>,
    /// Which light is compared, scene by scene.
    #[serde(default)]
    pub light: Vec<(String, crate::Light)>,
    /// One row per run.
    pub rows: Vec<SweepRow>,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRow {
    /// Name of the scene.
    pub scene: String,
    /// Name of the variant.
    pub variant: String,
    /// Parameters that the sweep changes, by name.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// Seed of the run.
    pub seed: u64,
    /// Median time of a frame on the device, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub ms: f64,
    /// The same of each timed round.
    pub round_ms: Vec<f64>,
    /// Error with its replicates; none where it has no finite value.
    pub error: Option<Sampled>,
    /// The error that a perfect picture would have for the noise of the reference alone; none where that is not known.
    pub floor: Option<f64>,
    /// Why the run failed; its time and error are not used then.
    pub failed: Option<String>,
}

/// The error that is plotted for a value of a metric: the value itself where lower is better; 1 less SSIM; for PSNR, the root of the mean squared error of displayed
/// values; for a ratio, its distance from 1.
pub fn plotted_error(metric: &str, value: f64) -> f64 {
    if metric == "psnr" { 10f64.powf(-value / 20.0) } else { crate::error_of(metric, value) }
}

/// What people call [`plotted_error`].
pub(crate) fn plotted_title(metric: &str) -> String {
    match metric {
        "psnr" => "RMSE of displayed values".to_owned(),
        "ssim" => "1 − SSIM".to_owned(),
        "mean_ratio" => "|mean over reference − 1|".to_owned(),
        _ => crate::Metric::title(metric).to_owned(),
    }
}
