//! What the pages show and `report.json` holds: plain data, filled in by whoever measured it. `docs/report.md` describes every field.
//!
//! JSON has no infinity and no NaN: a number that is not finite is null in the file, and null is read as NaN.

use crate::tiles::WhereMap;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

/// Version of the JSON of [`Comparison`] and of [`crate::Sweep`]. It rises when a field changes its meaning or goes; new fields do not raise it.
pub const VERSION: u32 = 1;

/// Variants of a renderer on one scene, against a reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Comparison {
    /// [`VERSION`].
    pub version: u32,
    /// Heading of the page.
    pub title: String,
    /// Command line that makes this comparison again.
    pub command: String,
    /// What drew the pictures and gave the times.
    pub device: Device,
    /// What is rendered.
    pub scene: SceneFacts,
    /// How it is rendered.
    pub settings: Settings,
    /// What every variant is held against.
    pub reference: Reference,
    /// Which light is compared.
    #[serde(default)]
    pub light: Option<crate::Light>,
    /// What the intervals are over.
    pub replication: Replicated,
    /// How the page shows radiance at first.
    pub view: View,
    /// The variants, in the order of the page.
    pub variants: Vec<Variant>,
    /// Every pair of variants by every metric and by the time of a frame.
    pub comparisons: Vec<Compared>,
    /// Where the passes of two variants differ, in the order of the page.
    pub differences: Vec<PassDifference>,
    /// Which variant is closest to the reference where; none with fewer than two variants.
    pub map: Option<WhereMap>,
}

/// A device, and how time was taken on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Name of the adapter.
    pub name: String,
    /// How time was taken.
    pub timing: Clock,
}

/// How time was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// Not at all.
    Off,
    /// Timestamps on the device.
    Timestamps,
    /// The wall clock, each pass alone.
    WallClock,
}

impl Clock {
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Off => "not taken",
            Self::Timestamps => "timestamps on the device",
            Self::WallClock => "wall clock, each pass alone",
        }
    }
}

/// Facts of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneFacts {
    /// File, or `builtin:NAME`.
    pub address: String,
    /// Camera; none for the first.
    pub camera: Option<String>,
    /// Time of animations at the first frame, seconds.
    pub time: f64,
    /// Triangles.
    pub triangles: u64,
    /// Lights without extent.
    pub punctual_lights: u64,
    /// Lights with extent.
    pub area_lights: u64,
    /// Distribution of normals.
    pub ndf: String,
}

/// How a comparison was rendered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Sub-pixel samples.
    pub samples: u32,
    /// Seed of the shown pictures.
    pub seed: u32,
    /// Rounds in turn; the first is not timed where there are more.
    pub rounds: u32,
    /// Frames of a sequence; none for one picture.
    pub sequence: Option<SequenceSettings>,
}

/// How a sequence was rendered. Pictures and all metrics but `temporal_error` are of its last frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SequenceSettings {
    /// Frames.
    pub frames: u32,
    /// Frames per second.
    pub frames_per_second: f64,
    /// Whether every frame has random numbers of its own.
    pub new_seeds: bool,
    /// `truth` for path-traced frames, `own` for each technique's own mean over more samples.
    pub flicker_against: String,
    /// Samples of that mean, for `own`.
    pub own_samples: Option<u32>,
    /// The flicker that the noise of path-traced frames alone would make if each had its own, for `truth`.
    pub reference_flicker: Option<f64>,
}

impl SequenceSettings {
    /// In words, for a sequence that begins at `start` seconds.
    pub fn words(&self, start: f64) -> String {
        let against = match (self.own_samples, self.reference_flicker) {
            (Some(samples), _) => format!("each technique's own mean over {samples} samples: its bias is not seen"),
            (None, Some(noise)) => format!("path-traced frames, whose noise alone would make {noise:.1e} if each had its own"),
            (None, None) => "path-traced frames".to_owned(),
        };
        let seeds = if self.new_seeds { ", random numbers of its own for each" } else { "" };
        format!(
            "{} frames, {} per second, from {start} s{seeds}; flicker against {against}; pictures and other metrics are of the last frame",
            self.frames, self.frames_per_second
        )
    }
}

/// What variants are held against.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Reference {
    /// File that was given; none where it was path-traced.
    pub file: Option<String>,
    /// Which light a path-traced reference holds: `direct`, `one-bounce`, `full`, or `only` what [`Comparison::light`] says.
    pub paths: Option<String>,
    /// Most scattering events of its paths, for `full`.
    pub depth: Option<u32>,
    /// Its samples per pixel.
    pub samples_per_pixel: Option<u64>,
    /// Relative mean squared error that its own noise makes; none where that is not known.
    pub relative_noise: Option<f64>,
    /// What a picture without error would score against it for that noise alone, by metric; empty where it is not known.
    #[serde(deserialize_with = "null_values_as_nan")]
    pub floor: BTreeMap<String, f64>,
    /// The picture.
    pub picture: Radiance,
}

/// What an interval is over.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Replicated {
    /// So many groups of the samples of a picture.
    Groups {
        /// Groups.
        count: u32,
    },
    /// So many pictures with other seeds.
    Seeds {
        /// Pictures.
        count: u32,
    },
}

/// How radiance is brought to a display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct View {
    /// `aces`, `agx` or `none`, as the `tonemap` pass has them.
    pub curve: String,
    /// Exposure in stops: radiance is multiplied by 2 to this power.
    pub exposure: f64,
}

/// One variant: its settings, what it costs and how far it is from the reference.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Variant {
    /// Name, unique within the comparison.
    pub name: String,
    /// `pass.port` of what is compared.
    pub output: String,
    /// Value of each metric under its machine name, see [`crate::Metric`].
    pub metrics: BTreeMap<String, Measurement>,
    /// Time of a whole frame on the device, milliseconds.
    pub frame_ms: Option<Time>,
    /// Memory of a whole frame on the device; memory that resources share counts once.
    pub bytes: u64,
    /// Seconds that making its pipelines took.
    pub compile_seconds: f64,
    /// How its graph brings radiance to a display, where it does.
    pub tone: Option<View>,
    /// The passes, in the order in which they run.
    pub passes: Vec<PassCost>,
    /// Passes that do not run.
    pub pruned: Vec<Pruned>,
    /// Linear radiance.
    pub picture: Radiance,
    /// Map of the error relative to the reference.
    pub error: Picture,
    /// FLIP map, where it was computed.
    pub flip: Option<Picture>,
}

/// A value and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// The value.
    #[serde(deserialize_with = "null_as_nan")]
    pub value: f64,
    /// Lower end of the interval; none where it is not known.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
}

/// A time on the device.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Time {
    /// Median over the frames of all timed rounds, milliseconds.
    pub median: f64,
    /// Lower end of the 95 % interval of the median over rounds; none with one round.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// 5th percentile over frames.
    pub p5: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Rounds behind the interval.
    pub rounds: u32,
}

/// A pass that does not run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pruned {
    /// Its name.
    pub pass: String,
    /// Why.
    pub reason: String,
}

/// Linear radiance, row 0 at the top.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Radiance {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// RGB, row by row. Left out of the JSON: the page holds it as a picture, and the EXR files beside it exactly.
    #[serde(skip)]
    pub pixels: Vec<[f32; 3]>,
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
    /// Name of the pass in the graph.
    pub name: String,
    /// Registered name of its kind.
    pub kind: String,
    /// Its parameters, by name.
    pub parameters: serde_json::Value,
    /// Its time on the device, milliseconds; none where it was not taken.
    pub gpu_ms: Option<Time>,
    /// Median time that the processor spends on recording it, milliseconds.
    pub cpu_ms: Option<f64>,
    /// Memory of what it makes.
    pub bytes: u64,
}

/// Two variants by one measure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    /// Machine name of the metric, or `frame_ms`.
    pub metric: String,
    /// Name of the first variant.
    pub a: String,
    /// Name of the second variant.
    pub b: String,
    /// By how much the first is worse: the difference of errors in the unit of the metric (of their distances from the best value for likenesses, ratios and signed
    /// errors), and for `frame_ms` the ratio of times less 1. Below 0 the first is better.
    #[serde(deserialize_with = "null_as_nan")]
    pub difference: f64,
    /// Lower end of its 99 % interval; none where it is not known.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// What is shown.
    pub better: Better,
}

/// Which of two variants is shown to be better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Better {
    /// The first.
    A,
    /// The second.
    B,
    /// Neither: the difference lies within the noise, or is too small to matter.
    Tie,
}

/// One pass that is not the same in two variants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassDifference {
    /// Name of the pass.
    pub pass: String,
    /// Name of the first variant.
    pub a: String,
    /// Name of the second variant.
    pub b: String,
    /// What differs.
    pub what: PassChange,
    /// Its kind in the first variant.
    pub a_kind: Option<String>,
    /// Its kind in the second variant.
    pub b_kind: Option<String>,
    /// Its median time in the first variant, milliseconds.
    pub a_ms: Option<f64>,
    /// Its median time in the second variant, milliseconds.
    pub b_ms: Option<f64>,
}

/// What differs in a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PassChange {
    /// Only the first variant has it.
    OnlyA,
    /// Only the second variant has it.
    OnlyB,
    /// Another kind of pass stands there.
    Kind,
    /// The same kind with other parameters.
    Parameters,
}

/// JSON has no NaN and no infinity: the writer turns them into null, so the reader must take null back.
pub(crate) fn null_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

fn null_values_as_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, f64>, D::Error> {
    let values = BTreeMap::<String, Option<f64>>::deserialize(deserializer)?;
    Ok(values.into_iter().map(|(name, value)| (name, value.unwrap_or(f64::NAN))).collect())
}
