//! A WGSL function held against its `f64` form over a table of inputs that covers its domain.

use lobelia_graph::{BuildError, Gpu, testing::evaluate};
use lobelia_shaders::Flags;

/// Inputs of one evaluation: four `vec4f`.
pub type Row = [f32; 16];

/// Rows per twin.
pub const ROWS: u32 = 1 << 17;

/// What one output should be, and how far off it may be.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// The value of the `f64` form.
    pub value: f64,
    /// The largest allowed error, in units of `scale`.
    pub bound: f64,
    /// What errors are measured against: |value| for a relative error, 1 for an absolute one.
    pub scale: f64,
    /// Whether a negative value is a failure by itself.
    pub non_negative: bool,
}

impl Expected {
    /// A relative error; below 1e-30 it is taken relative to that.
    pub fn relative(value: f64, bound: f64) -> Self {
        Self { value, bound, scale: value.abs().max(1e-30), non_negative: false }
    }

    /// An absolute error.
    pub fn absolute(value: f64, bound: f64) -> Self {
        Self { value, bound, scale: 1.0, non_negative: false }
    }

    /// An error relative to `scale`, such as the integral of a lobe whose clamped part may be tiny.
    pub fn scaled(value: f64, scale: f64, bound: f64) -> Self {
        Self { value, bound, scale: scale.max(1e-30), non_negative: false }
    }

    /// Negative values fail.
    pub fn non_negative(self) -> Self {
        Self { non_negative: true, ..self }
    }
}

/// One WGSL function, its `f64` form, and inputs that cover the domain.
pub struct Twin {
    /// `module::function`, as in WGSL.
    pub name: &'static str,
    /// Imports and `fn value(input: Input) -> vec4f`, where `Input` has the fields `a`, `b`, `c`, `d: vec4f`.
    pub wgsl: &'static str,
    /// The domain in words, for the table in the documentation.
    pub domain: &'static str,
    /// Row `index` of [`ROWS`].
    pub input: fn(u32) -> Row,
    /// What the first outputs should be for a row, at most four of them; the inputs are those that the device sees.
    pub expected: fn(&[f64; 16]) -> Vec<Expected>,
}

/// The worst that was found over a table.
#[derive(Clone, Debug)]
pub struct Report {
    /// `module::function`.
    pub name: &'static str,
    /// How many rows were evaluated.
    pub rows: usize,
    /// Error of the worst output, in its unit (see [`Expected::scale`]).
    pub error: f64,
    /// What was allowed there.
    pub bound: f64,
    /// Row of the worst output.
    pub row: Row,
    /// What was expected there, and what came.
    pub values: (f64, f64),
    /// Outputs that were NaN, infinite, or negative where that is a failure.
    pub broken: usize,
}

impl Report {
    /// Whether every output was finite, of the right sign and within its bound.
    pub fn passes(&self) -> bool {
        self.rows > 0 && self.broken == 0 && self.error <= self.bound
    }
}

/// Evaluates the twin on the device over its whole table and says how far off the worst output is, as a share of what is allowed.
pub fn check(gpu: &Gpu, twin: &Twin) -> Result<Report, BuildError> {
    let rows: Vec<Row> = (0..ROWS).map(twin.input).collect();
    check_rows(gpu, twin, &rows)
}

/// As [`check`], over rows of the caller's.
pub fn check_rows(gpu: &Gpu, twin: &Twin, rows: &[Row]) -> Result<Report, BuildError> {
    let text = format!(
        "{}\nstruct Input {{ a: vec4f, b: vec4f, c: vec4f, d: vec4f }}\nstruct Output {{ value: vec4f }}\n\
         fn evaluate(input: Input) -> Output {{ return Output(value(input)); }}\n",
        twin.wgsl
    );
    let found: Vec<[f32; 4]> = evaluate(gpu, &text, &Flags::new(), rows)?;
    let mut report = Report { name: twin.name, rows: rows.len(), error: 0.0, bound: 1.0, row: [0.0; 16], values: (0.0, 0.0), broken: 0 };
    let mut worst = -1.0;
    for (row, outputs) in rows.iter().zip(&found) {
        for (expected, got) in (twin.expected)(&row.map(f64::from)).iter().zip(outputs.map(f64::from)) {
            let broken = !got.is_finite() || (expected.non_negative && got < 0.0);
            report.broken += usize::from(broken);
            let error = (got - expected.value).abs() / expected.scale;
            // Written so that NaN, of either side, is the worst there is.
            let share = if broken || error.is_nan() { f64::INFINITY } else { error / expected.bound };
            if share > worst {
                worst = share;
                report = Report { error, bound: expected.bound, row: *row, values: (expected.value, got), ..report };
                if error.is_nan() {
                    report.error = f64::INFINITY;
                }
            }
        }
    }
    Ok(report)
}
