//! What the pages show: plain data, filled in by whoever measured it.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize};

/// Variants of a renderer on one scene, against a reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// Heading of the page.
    pub title: String,
    /// Device and driver that drew the pictures and gave the times.
    pub device: String,
    /// Facts of the scene, as (name, value): triangles, lights, picture size.
    pub scene: Vec<(String, String)>,
    /// Command line that makes this comparison again.
    pub command: String,
    /// What every variant is held against.
    pub reference: Picture,
    /// The variants, in the order of the page.
    pub variants: Vec<Variant>,
    /// Which light is compared.
    #[serde(default)]
    pub light: Option<crate::Light>,
    /// Where the passes of two variants differ, in the order of the page.
    pub differences: Vec<PassDifference>,
}

/// One variant: its settings, what it costs and how far it is from the reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Variant {
    /// Name, unique within the comparison.
    pub name: String,
    /// Settings, as (name, value).
    pub settings: Vec<(String, String)>,
    /// Value of each metric; which direction is better follows from the name, see [`crate::Direction`]. A value that is not
    /// finite is shown and never the best.
    #[serde(deserialize_with = "null_values_as_nan")]
    pub metrics: BTreeMap<String, f64>,
    /// Tone-mapped picture.
    pub picture: Picture,
    /// Map of the error relative to the reference.
    pub error: Picture,
    /// FLIP map, where it was computed.
    pub flip: Option<Picture>,
    /// Costs of the passes, in the order in which they run.
    pub passes: Vec<PassCost>,
    /// Passes that do not run, as (pass, why).
    pub pruned: Vec<(String, String)>,
    /// Time of a whole frame on the device, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub total_ms: f64,
    /// Memory of a whole frame on the device, in mebibytes.
    #[serde(deserialize_with = "null_as_nan")]
    pub total_mebibytes: f64,
}

/// A picture that is already encoded as PNG.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The PNG file. Left out of the JSON: the page holds it as a data URI.
    #[serde(skip)]
    pub png: Vec<u8>,
}

/// What one pass costs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PassCost {
    /// Name of the pass.
    pub name: String,
    /// Median of its time on the device, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub median_ms: f64,
    /// 5th percentile of its time on the device, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub p5_ms: f64,
    /// 95th percentile of its time on the device, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub p95_ms: f64,
    /// Memory that it holds on the device, in mebibytes.
    #[serde(deserialize_with = "null_as_nan")]
    pub mebibytes: f64,
    /// Time that the processor spends on recording it, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub cpu_ms: f64,
}

/// How far one pass of two variants differs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PassDifference {
    /// Name of the pass.
    pub pass: String,
    /// Name of the first variant.
    pub a: String,
    /// Name of the second variant.
    pub b: String,
    /// Change from the first to the second, as a fraction of the first: 0.25 is shown as +25 %. A value that is not finite is
    /// shown as "not defined".
    #[serde(deserialize_with = "null_as_nan")]
    pub change: f64,
    /// What changes: an output of the pass, its time, its memory.
    pub what: String,
}

/// Error against time over a grid of settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sweep {
    /// Heading of the page.
    pub title: String,
    /// Device and driver that gave the times.
    pub device: String,
    /// One row per run.
    pub rows: Vec<SweepRow>,
    /// Which light is compared, scene by scene.
    #[serde(default)]
    pub light: Vec<(String, crate::Light)>,
    /// Name of the error metric, with its unit in brackets where it has one; lower is better.
    pub metric: String,
    /// Error that the reader wants to stay under, in the unit of the metric.
    pub target_error: Option<f64>,
    /// Time that the reader wants to stay under, in milliseconds.
    pub target_ms: Option<f64>,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRow {
    /// Name of the scene.
    pub scene: String,
    /// Name of the variant.
    pub variant: String,
    /// Parameters that the sweep changes, as (name, value).
    pub parameters: Vec<(String, String)>,
    /// Seed of the run.
    pub seed: u64,
    /// Time of a frame on the device, in milliseconds.
    #[serde(deserialize_with = "null_as_nan")]
    pub ms: f64,
    /// Error, in the unit of the metric.
    #[serde(deserialize_with = "null_as_nan")]
    pub error: f64,
    /// Why the run failed; its time and error are not used then.
    pub failed: Option<String>,
}

impl SweepRow {
    /// (time in milliseconds, error) of the run; both NaN where it failed, so that no choice can fall on it.
    pub fn point(&self) -> (f64, f64) {
        if self.failed.is_some() { (f64::NAN, f64::NAN) } else { (self.ms, self.error) }
    }
}

/// JSON has no NaN and no infinity: the writer turns them into null, so the reader must take null back.
fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

fn null_values_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, f64>, D::Error> {
    let values = BTreeMap::<String, Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|(name, value)| (name, value.unwrap_or(f64::NAN))).collect())
}
