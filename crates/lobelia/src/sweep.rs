//! Sweeps: the product of scenes, variants, parameters and seeds, one row of JSON a run.
//!
//! ```ron
//! (
//!     graph: "graphs/indirect.ron",                       // beside the current folder
//!     scenes: ["builtin:cornell-glossy", "room.glb"],
//!     variants: ["vpl", "vpl+no-visibility"],             // one run with each; [""] is the graph as it is
//!     parameters: {"lights.count": [256, 1024, 4096]},    // every combination; what is no number or bool is RON in quotes
//!     seeds: [0, 1],
//!     size: (240, 240),
//!     samples: 4,                                         // sub-pixel samples
//!     rounds: 5,                                          // renderings per run; the first warms up
//!     camera: "main",                                     // left out: the first of each scene
//!     output: "indirect.radiance",                        // left out: what the graph ends in
//!     paths: "one-bounce",                                // direct, one-bounce or full (up to depth 2); left out: what the graphs cast
//!     lights: "all",                                      // or classes of lights: "area,punctual"; left out: those that the graphs cast
//!     reference_error: 0.05,                              // when the path-traced reference is good enough
//! )
//! ```

use crate::light::Lights;
use lobelia_graph::Override;
use lobelia_measure::sampled::{Replication, Sampled};
use lobelia_report::Light;
use serde::{Deserialize, Serialize};
use std::{
    collections::{BTreeMap, BTreeSet},
    io::Write as _,
    path::{Path, PathBuf},
};

/// What a sweep file says.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// Graph file.
    pub graph: String,
    /// Scenes.
    pub scenes: Vec<String>,
    /// Variants, joined by `+` where several apply at once; an empty name is the graph as it is.
    #[serde(default = "as_it_is")]
    pub variants: Vec<String>,
    /// `pass.param`, and the values that it takes.
    #[serde(default)]
    pub parameters: BTreeMap<String, Vec<Value>>,
    /// Seeds of the techniques.
    #[serde(default = "one_seed")]
    pub seeds: Vec<u32>,
    /// Pixels.
    #[serde(default = "size")]
    pub size: (u32, u32),
    /// Sub-pixel samples.
    #[serde(default = "samples")]
    pub samples: u32,
    /// Renderings per run; the first warms up where there are more.
    #[serde(default = "rounds")]
    pub rounds: u32,
    /// Camera; the first of each scene if it is left out.
    #[serde(default)]
    pub camera: Option<String>,
    /// `pass.port` that is compared; what the graph ends in if it is left out.
    #[serde(default)]
    pub output: Option<String>,
    /// Paths in the reference; what the graphs cast if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paths: Option<Paths>,
    /// Classes of lights in the reference; those that the graphs cast if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lights: Option<Lights>,
    /// Relative error at which the reference is good enough.
    #[serde(default = "reference_error")]
    pub reference_error: f64,
}

/// A value of a parameter.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// True or false.
    Bool(bool),
    /// A whole number.
    Whole(i64),
    /// Another number.
    Number(f64),
    /// RON.
    Text(String),
}

impl Value {
    /// As it is written in a graph.
    fn ron(&self) -> String {
        match self {
            Self::Bool(value) => value.to_string(),
            Self::Whole(value) => value.to_string(),
            Self::Number(value) => format!("{value:?}"),
            Self::Text(value) => value.clone(),
        }
    }
}

/// Names of [`lobelia_reference::LightPaths`]: `"direct"`, `"one-bounce"`, `"full"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(try_from = "String", into = "String")]
pub enum Paths {
    /// Light that scatters exactly once.
    Direct,
    /// Light that scatters exactly twice.
    OneBounce,
    /// Direct light, one bounce, emission and background: what a whole graph makes.
    Full,
}

impl TryFrom<String> for Paths {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        match name.as_str() {
            "direct" => Ok(Self::Direct),
            "one-bounce" => Ok(Self::OneBounce),
            "full" => Ok(Self::Full),
            _ => Err(format!("`{name}` is none of \"direct\", \"one-bounce\", \"full\"")),
        }
    }
}

impl From<Paths> for String {
    fn from(paths: Paths) -> Self {
        match paths {
            Paths::Direct => "direct",
            Paths::OneBounce => "one-bounce",
            Paths::Full => "full",
        }
        .to_owned()
    }
}

fn as_it_is() -> Vec<String> {
    vec![String::new()]
}

fn one_seed() -> Vec<u32> {
    vec![0]
}

fn size() -> (u32, u32) {
    (240, 240)
}

fn samples() -> u32 {
    4
}

fn rounds() -> u32 {
    5
}

fn reference_error() -> f64 {
    0.1
}

/// What is wrong with a sweep.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// The file does not say what a sweep is.
    #[error("{file}:{line}:{column}: {what}")]
    Syntax {
        /// Which file.
        file: String,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What is wrong.
        what: String,
    },
    /// The file says something impossible.
    #[error("{file}: {what}")]
    Content {
        /// Which file.
        file: String,
        /// What is wrong.
        what: String,
    },
    /// A file or folder cannot be read or written.
    #[error("{}: {source}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] lobelia_measure::MeasureError),
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Place in the product.
    pub index: usize,
    /// Scene address.
    pub scene: String,
    /// Variants, joined by `+`.
    pub variant: String,
    /// `pass.param` and its value as RON.
    pub parameters: Vec<(String, String)>,
    /// Seed.
    pub seed: u32,
}

impl Cell {
    /// Overrides for the graph. What is no `pass.param` is refused when the sweep is read.
    pub fn overrides(&self) -> Vec<Override> {
        self.parameters.iter().filter_map(|(name, value)| format!("{name}={value}").parse().ok()).collect()
    }

    /// Variants by name.
    pub fn variants(&self) -> Vec<String> {
        self.variant.split('+').filter(|name| !name.is_empty()).map(str::to_owned).collect()
    }

    /// In words, for progress.
    pub fn label(&self) -> String {
        let parameters: Vec<String> = self.parameters.iter().map(|(name, value)| format!("{name}={value}")).collect();
        [self.scene.as_str(), self.variant.as_str(), &parameters.join(" "), &format!("seed {}", self.seed)]
            .iter()
            .filter(|part| !part.is_empty())
            .copied()
            .collect::<Vec<_>>()
            .join(", ")
    }
}

/// What one run found.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Row {
    /// Place in the product.
    pub cell: usize,
    /// Scene address.
    pub scene: String,
    /// Variants, joined by `+`.
    pub variant: String,
    /// `pass.param` and its value as RON.
    pub parameters: Vec<(String, String)>,
    /// Seed.
    pub seed: u32,
    /// The device.
    pub device: String,
    /// Median milliseconds of a frame on the device.
    pub ms: Option<f64>,
    /// Mebibytes of all resources.
    pub mebibytes: Option<f64>,
    /// Metrics by name. What has no finite value is null in the file.
    #[serde(deserialize_with = "null_as_infinity")]
    pub metrics: BTreeMap<String, f64>,
    /// Each metric's replicates, in which samples, seeds and the noise of the reference vary; left out where they are not known or not finite.
    #[serde(default)]
    pub replicates: BTreeMap<String, Vec<f64>>,
    /// What a replicate is.
    #[serde(default)]
    pub replication: Option<Replication>,
    /// What a picture without error would score for the noise of the reference alone.
    #[serde(default, deserialize_with = "null_as_infinity")]
    pub floor: BTreeMap<String, f64>,
    /// Median milliseconds of a frame in each timed round.
    #[serde(default)]
    pub round_ms: Vec<f64>,
    /// Median milliseconds of each pass.
    pub passes: Vec<(String, Option<f64>)>,
    /// Which light was compared.
    #[serde(default)]
    pub light: Option<Light>,
    /// Why the run failed, if it did.
    pub failed: Option<String>,
}

/// JSON has no infinity.
fn null_as_infinity<'a, D: serde::Deserializer<'a>>(from: D) -> Result<BTreeMap<String, f64>, D::Error> {
    let values = BTreeMap::<String, Option<f64>>::deserialize(from)?;
    Ok(values.into_iter().map(|(name, value)| (name, value.unwrap_or(f64::INFINITY))).collect())
}

impl Row {
    /// A row for a run that has nothing to show yet.
    pub fn new(cell: &Cell) -> Self {
        Self {
            cell: cell.index,
            scene: cell.scene.clone(),
            variant: cell.variant.clone(),
            parameters: cell.parameters.clone(),
            seed: cell.seed,
            device: String::new(),
            ms: None,
            mebibytes: None,
            metrics: BTreeMap::new(),
            replicates: BTreeMap::new(),
            replication: None,
            floor: BTreeMap::new(),
            round_ms: Vec::new(),
            passes: Vec::new(),
            light: None,
            failed: None,
        }
    }

    /// A metric with its replicates; `None` where the run has none, or one that is not finite.
    pub fn sampled(&self, metric: &str) -> Option<Sampled> {
        let value = self.metrics.get(metric).copied().filter(|value| value.is_finite())?;
        let known = self.replicates.get(metric).zip(self.replication.as_ref());
        Some(known.map_or_else(
            || Sampled::alone(value),
            |(replicates, replication)| Sampled { value, replicates: replicates.clone(), replication: replication.clone() },
        ))
    }
}

/// A share of a sweep: every `count`-th run, beginning with the `index`-th, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub index: usize,
    /// How many there are.
    pub count: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(index, count)| Some((index.trim().parse().ok()?, count.trim().parse().ok()?)));
        match parts {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            Some(_) => Err("the first number must lie in 1 to the second".into()),
            None => Err(format!("`{text}` is not of the form I/N, such as 2/8")),
        }
    }
}

impl Sweep {
    /// Reads a sweep file and refuses what could not be run.
    pub fn load(file: &Path) -> Result<Self, SweepError> {
        let text = lobelia_files::read_text(file).map_err(|what| SweepError::Content { file: file.display().to_string(), what })?;
        Self::parse(&text, &file.display().to_string())
    }

    /// As [`Sweep::load`], from text.
    pub fn parse(text: &str, file: &str) -> Result<Self, SweepError> {
        let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let sweep: Self = options.from_str(text).map_err(|error| SweepError::Syntax {
            file: file.to_owned(),
            line: error.span.start.line,
            column: error.span.start.col,
            what: error.code.to_string(),
        })?;
        let refuse = |what: String| Err(SweepError::Content { file: file.to_owned(), what });
        let empty = [("scenes", sweep.scenes.is_empty()), ("variants", sweep.variants.is_empty()), ("seeds", sweep.seeds.is_empty())];
        if let Some((name, _)) = empty.iter().find(|(_, empty)| *empty) {
            return refuse(format!("`{name}` is empty, so there is nothing to run"));
        }
        for (name, values) in &sweep.parameters {
            if values.is_empty() {
                return refuse(format!("parameter `{name}` has no values, so there is nothing to run"));
            }
            if format!("{name}=0").parse::<Override>().is_err() {
                return refuse(format!("`{name}` is not of the form pass.param, such as lights.count"));
            }
        }
        let sides = [sweep.size.0, sweep.size.1];
        if sides.iter().any(|side| !(1..=crate::MAX_SIDE).contains(side)) {
            return refuse(format!("size {} x {}: each side must lie in [1, {}] pixels", sides[0], sides[1], crate::MAX_SIDE));
        }
        if sweep.samples == 0 || sweep.rounds == 0 {
            return refuse("`samples` and `rounds` must be at least 1".into());
        }
        if !(sweep.reference_error.is_finite() && sweep.reference_error > 0.0) {
            return refuse("`reference_error` must be a number above 0".into());
        }
        Ok(sweep)
    }

    /// All runs: scenes, then variants, then parameters in alphabetical order, then seeds.
    pub fn cells(&self) -> Vec<Cell> {
        let mut combinations: Vec<Vec<(String, String)>> = vec![Vec::new()];
        for (name, values) in &self.parameters {
            combinations = combinations
                .into_iter()
                .flat_map(|head| values.iter().map(move |value| head.iter().cloned().chain([(name.clone(), value.ron())]).collect()))
                .collect();
        }
        let mut cells = Vec::new();
        for scene in &self.scenes {
            for variant in &self.variants {
                for parameters in &combinations {
                    for seed in &self.seeds {
                        let (scene, variant, parameters) = (scene.clone(), variant.clone(), parameters.clone());
                        cells.push(Cell { index: cells.len(), scene, variant, parameters, seed: *seed });
                    }
                }
            }
        }
        cells
    }

    /// Variants and parameters that a scene is rendered with, each once: all runs of all shares, so that every share has the same reference.
    pub fn settings(&self) -> Vec<Cell> {
        let mut cells: Vec<Cell> = self.cells();
        cells.retain(|cell| cell.scene == self.scenes[0] && cell.seed == self.seeds[0]);
        cells
    }

    /// The runs of a share.
    pub fn share(&self, shard: Option<Shard>) -> Vec<Cell> {
        let all = self.cells();
        match shard {
            Some(Shard { index, count }) => all.into_iter().filter(|cell| cell.index % count == index - 1).collect(),
            None => all,
        }
    }
}

/// The rows of a sweep on disk: a copy of the sweep, and a line of JSON for each run.
pub struct Store {
    folder: PathBuf,
    rows: Vec<Row>,
}

impl Store {
    /// Opens or begins a folder. What another sweep left there is refused; a last line that was cut short when the program was killed is dropped.
    pub fn open(folder: &Path, sweep: &Sweep) -> Result<Self, SweepError> {
        let fail = |file: &Path| {
            let file = file.to_owned();
            move |source| SweepError::File { file, source }
        };
        std::fs::create_dir_all(folder).map_err(fail(folder))?;
        let copy = folder.join("sweep.json");
        let text = serde_json::to_string_pretty(sweep)
            .map_err(|error| SweepError::Content { file: copy.display().to_string(), what: error.to_string() })?;
        if copy.exists() {
            if std::fs::read_to_string(&copy).map_err(fail(&copy))? != text {
                let what = "the folder holds the rows of another sweep; name another folder, or remove it".to_owned();
                return Err(SweepError::Content { file: folder.display().to_string(), what });
            }
        } else {
            write_whole(&copy, &text)?;
        }
        let mut store = Self { folder: folder.into(), rows: Vec::new() };
        let file = store.file();
        if file.exists() {
            let text = std::fs::read_to_string(&file).map_err(fail(&file))?;
            let whole = &text[..text.rfind('\n').map_or(0, |end| end + 1)];
            store.rows = parse_rows(whole, &file)?.into_iter().map(|(row, _)| row).collect();
            if whole.len() < text.len() {
                write_whole(&file, whole)?;
            }
        }
        Ok(store)
    }

    /// `rows.jsonl` in the folder.
    pub fn file(&self) -> PathBuf {
        self.folder.join("rows.jsonl")
    }

    /// The rows so far, in the order in which they were found.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Whether a run is done, whatever became of it.
    pub fn has(&self, cell: &Cell) -> bool {
        self.rows.iter().any(|row| row.cell == cell.index)
    }

    /// Adds a row; it is on disk when this returns.
    pub fn add(&mut self, row: Row) -> Result<(), SweepError> {
        let file = self.file();
        let fail = |source| SweepError::File { file: file.clone(), source };
        let mut line = serde_json::to_string(&row).map_err(|error| fail(error.into()))?;
        line.push('\n');
        let mut out = std::fs::OpenOptions::new().create(true).append(true).open(&file).map_err(fail)?;
        out.write_all(line.as_bytes()).and_then(|()| out.sync_data()).map_err(fail)?;
        self.rows.push(row);
        Ok(())
    }
}

/// Writes a file so that it is whole or as it was.
fn write_whole(file: &Path, text: &str) -> Result<(), SweepError> {
    Ok(lobelia_measure::replace_file(file, |out| out.write_all(text.as_bytes()).map_err(|error| error.to_string()))?)
}

fn parse_rows<'a>(text: &'a str, file: &Path) -> Result<Vec<(Row, &'a str)>, SweepError> {
    let line = |(index, line): (usize, &'a str)| {
        serde_json::from_str(line).map(|row| (row, line)).map_err(|error| SweepError::Syntax {
            file: file.display().to_string(),
            line: index + 1,
            column: error.column(),
            what: error.to_string(),
        })
    };
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(line).collect()
}

/// What several folders hold together.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The sweep of all of them.
    pub sweep: Sweep,
    /// In the order of the product.
    pub rows: Vec<Row>,
    /// The same rows as they were written: numbers that are read and written again may change in their last digit.
    pub lines: Vec<String>,
    /// Runs that are in none of the folders.
    pub missing: Vec<Cell>,
}

/// Joins the rows of several folders of one sweep, in the order of the product. A run that is in several folders counts once: the first that did not fail, or else the
/// first.
pub fn merge(folders: &[PathBuf]) -> Result<Merged, SweepError> {
    let fail = |file: &Path| {
        let file = file.to_owned();
        move |source| SweepError::File { file, source }
    };
    let mut sweep: Option<(Sweep, PathBuf)> = None;
    let mut rows: BTreeMap<usize, (Row, String)> = BTreeMap::new();
    for folder in folders {
        let copy = folder.join("sweep.json");
        let text = std::fs::read_to_string(&copy).map_err(fail(&copy))?;
        let here: Sweep = serde_json::from_str(&text)
            .map_err(|error| SweepError::Content { file: copy.display().to_string(), what: error.to_string() })?;
        match &sweep {
            Some((first, place)) if *first != here => {
                let what = format!("it is of another sweep than {}", place.display());
                return Err(SweepError::Content { file: folder.display().to_string(), what });
            }
            Some(_) => {}
            None => sweep = Some((here, folder.clone())),
        }
        let file = folder.join("rows.jsonl");
        let text = if file.exists() { std::fs::read_to_string(&file).map_err(fail(&file))? } else { String::new() };
        for (row, line) in parse_rows(&text, &file)? {
            let better = rows.get(&row.cell).is_none_or(|(there, _)| there.failed.is_some() && row.failed.is_none());
            if better {
                rows.insert(row.cell, (row, line.to_owned()));
            }
        }
    }
    let Some((sweep, _)) = sweep else {
        return Err(SweepError::Content { file: "--merge".into(), what: "no folder is named".into() });
    };
    let done: BTreeSet<usize> = rows.keys().copied().collect();
    let missing = sweep.cells().into_iter().filter(|cell| !done.contains(&cell.index)).collect();
    let (rows, lines) = rows.into_values().unzip();
    Ok(Merged { sweep, rows, lines, missing })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const TEXT: &str = r#"(graph: "g.ron", scenes: ["a", "b"], variants: ["", "x+y"], parameters: {"p.q": [1, 2.5], "p.r": ["none"]}, seeds: [0, 7], camera: "c")"#;

    #[test]
    fn the_product_is_complete_and_shares_part_it() {
        let sweep = Sweep::parse(TEXT, "s.ron").unwrap();
        let cells = sweep.cells();
        assert_eq!(cells.len(), 2 * 2 * 2 * 2);
        assert_eq!(cells[0].parameters, [("p.q".to_owned(), "1".to_owned()), ("p.r".to_owned(), "none".to_owned())]);
        assert_eq!((cells[15].scene.as_str(), cells[15].variants(), cells[15].seed), ("b", vec!["x".to_owned(), "y".to_owned()], 7));
        assert_eq!(cells[0].overrides().len(), 2);
        let mut shared: Vec<usize> =
            (1..=3).flat_map(|index| sweep.share(Some(Shard { index, count: 3 }))).map(|cell| cell.index).collect();
        shared.sort_unstable();
        assert_eq!(shared, (0..16).collect::<Vec<_>>());
        assert_eq!("2/8".parse(), Ok(Shard { index: 2, count: 8 }));
        for bad in ["0/3", "4/3", "a/b", "3", ""] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }

    #[test]
    fn bad_files_are_refused_with_their_place() {
        for (text, place, what) in [
            (r#"(graph: "g", scenes: ["a"], sees: [1])"#, "s.ron:1:", "sees"),
            ("(graph: \"g\",\n scenes: \"a\")", "s.ron:2:", ""),
            (r#"(scenes: ["a"])"#, "s.ron:1:", "graph"),
            (r#"(graph: "g", scenes: [])"#, "s.ron: ", "scenes"),
            (r#"(graph: "g", scenes: ["a"], parameters: {"p.q": []})"#, "s.ron: ", "p.q"),
            (r#"(graph: "g", scenes: ["a"], parameters: {"pq": [1]})"#, "s.ron: ", "pass.param"),
            (r#"(graph: "g", scenes: ["a"], size: (0, 4))"#, "s.ron: ", "pixels"),
            (r#"(graph: "g", scenes: ["a"], samples: 0)"#, "s.ron: ", "samples"),
            (r#"(graph: "g", scenes: ["a"], paths: "some")"#, "s.ron:1:", "some"),
            (r#"(graph: "g", scenes: ["a"], reference_error: 0)"#, "s.ron: ", "reference_error"),
        ] {
            let error = Sweep::parse(text, "s.ron").unwrap_err().to_string();
            assert!(error.starts_with(place) && error.contains(what), "{text}: {error}");
        }
    }

    #[test]
    fn rows_survive_a_kill_and_shards_merge() {
        let sweep = Sweep::parse(TEXT, "s.ron").unwrap();
        let root = tempfile::tempdir().unwrap();
        let row = |cell: &Cell| Row {
            ms: Some(cell.index as f64),
            metrics: [("relative_mse".to_owned(), 0.1), ("psnr".to_owned(), f64::INFINITY)].into(),
            ..Row::new(cell)
        };
        let folders: Vec<PathBuf> = (1..=2).map(|index| root.path().join(format!("shard{index}"))).collect();
        for (index, folder) in folders.iter().enumerate() {
            let mut store = Store::open(folder, &sweep).unwrap();
            for cell in sweep.share(Some(Shard { index: index + 1, count: 2 })) {
                store.add(row(&cell)).unwrap();
            }
        }
        // Killed in the middle of a line.
        let file = folders[0].join("rows.jsonl");
        let mut text = std::fs::read_to_string(&file).unwrap();
        text.truncate(text.len() - 20);
        std::fs::write(&file, &text).unwrap();
        let mut store = Store::open(&folders[0], &sweep).unwrap();
        let lost: Vec<Cell> = sweep.share(Some(Shard { index: 1, count: 2 })).into_iter().filter(|cell| !store.has(cell)).collect();
        assert_eq!((store.rows().len(), lost.len()), (7, 1));
        assert_eq!(merge(&folders).unwrap().missing, lost);
        store.add(row(&lost[0])).unwrap();
        let merged = merge(&folders).unwrap();
        assert!(merged.missing.is_empty() && merged.lines.len() == 16);
        assert_eq!(merged.rows, sweep.cells().iter().map(row).collect::<Vec<_>>());
        // Another sweep does not mix with this one.
        let other = Sweep { samples: 9, ..sweep.clone() };
        assert!(matches!(Store::open(&folders[0], &other), Err(SweepError::Content { .. })));
        Store::open(&root.path().join("other"), &other).unwrap();
        assert!(merge(&[folders[0].clone(), root.path().join("other")]).is_err());
        assert!(merge(&[]).is_err() && merge(&[root.path().join("absent")]).is_err());
        // A run that failed in one folder and not in another is done.
        let mut failed = Store::open(&root.path().join("failed"), &sweep).unwrap();
        failed.add(Row { failed: Some("no".into()), ..Row::new(&sweep.cells()[0]) }).unwrap();
        let rows = merge(&[root.path().join("failed"), folders[0].clone()]).unwrap().rows;
        assert_eq!(rows[0].failed, None);
        // A broken line in the middle has a place.
        std::fs::write(&file, "{}\n").unwrap();
        assert!(Store::open(&folders[0], &sweep).err().unwrap().to_string().contains("rows.jsonl:1:"));
    }
}
