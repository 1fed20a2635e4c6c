//! Fits linearly transformed cosines to the GGX lobe of `lobelia-lobes`: the table of `crates/arealight-peers`.
//!
//! For every roughness and view angle the three numbers of the map are found by the method of Nelder and Mead so that the cubed difference between both
//! lobes is least (Heitz et al. 2016, section 3); the search starts where that of the neighbour ended. How much light the lobe reflects is exact.

use argmin::{
    core::{CostFunction, Error, Executor},
    solver::neldermead::NelderMead,
};
use clap::Parser;
use glam::{DMat3, DVec3};
use indicatif::{ProgressBar, ProgressStyle};
use lobelia_lobes::{
    brdf::{Distribution, ggx_distribution, ggx_visibility},
    linearly_transformed_cosine::LinearlyTransformedCosine,
    sampling::{ggx_reflection_pdf, sample_cosine_hemisphere, sample_ggx_visible_normal},
    specular_albedo::specular_albedo_integrals,
};
use rayon::prelude::*;
use std::{path::PathBuf, process::ExitCode};

/// Least alpha of the reflectance, as in `lobelia::brdf`.
const MIN_ALPHA: f64 = 0.001;

const EXAMPLES: &str = "\
Examples:
  cargo xtask fit-ltc
      The committed table, crates/arealight-peers/data/ltc-ggx.bin, anew: the same bits.
  cargo xtask fit-ltc -- --size 32 --output small.bin
      A smaller table elsewhere.";

/// Fit linearly transformed cosines to GGX.
#[derive(Parser)]
#[command(name = "fit-ltc", after_help = EXAMPLES)]
struct Arguments {
    /// Roughnesses, and as many view angles.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(4..=256))]
    size: u32,
    /// Samples of each lobe per side of a square.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(8..=128))]
    samples: u32,
    /// File to write.
    #[arg(long, short, default_value = "crates/arealight-peers/data/ltc-ggx.bin")]
    output: PathBuf,
    /// No progress bar.
    #[arg(long, short)]
    quiet: bool,
}

/// The lobe to be fitted: `D G2 / (4 n.v)` towards the light, over the light that it reflects.
#[derive(Clone, Copy)]
struct Target {
    alpha: f64,
    view: DVec3,
    albedo: f64,
}

impl Target {
    fn evaluate(&self, light: DVec3) -> f64 {
        if light.z <= 0.0 {
            return 0.0;
        }
        let half = (light + self.view).normalize();
        let visibility = ggx_visibility(self.alpha, light.z, self.view.z);
        ggx_distribution(self.alpha, DVec3::Z, half) * visibility * light.z / self.albedo
    }

    fn sample(&self, u: [f64; 2]) -> DVec3 {
        let half = sample_ggx_visible_normal(self.alpha, DVec3::Z, self.view, u);
        half * (2.0 * half.dot(self.view)) - self.view
    }

    fn pdf(&self, light: DVec3) -> f64 {
        if light.z <= 0.0 { 0.0 } else { ggx_reflection_pdf(self.alpha, DVec3::Z, self.view, light) }
    }
}

/// A fit in progress: the map is `frame` times the columns (xx, 0, 0), (0, yy, 0), (xz, 0, 1).
#[derive(Clone, Copy)]
struct Fit {
    frame: DMat3,
    numbers: [f64; 3],
}

impl Fit {
    fn map(&self, numbers: &[f64]) -> DMat3 {
        let (xx, yy, xz) = match *numbers {
            [both] => (both, both, 0.0),
            [xx, yy, xz] => (xx, yy, xz),
            _ => (1.0, 1.0, 0.0),
        };
        let (xx, yy) = (xx.max(1e-7), yy.max(1e-7));
        self.frame * DMat3::from_cols(DVec3::X * xx, DVec3::Y * yy, DVec3::new(xz, 0.0, 1.0))
    }
}

struct Problem {
    target: Target,
    fit: Fit,
    points: Vec<[f64; 2]>,
}

impl CostFunction for Problem {
    type Param = Vec<f64>;
    type Output = f64;

    /// Cubed differences, sampled by both lobes in turn and weighted by the sum of their densities.
    fn cost(&self, numbers: &Vec<f64>) -> Result<f64, Error> {
        let map = self.fit.map(numbers);
        let lobe = LinearlyTransformedCosine { inverse: map.inverse() };
        let term = |light: DVec3| {
            let (wanted, found) = (self.target.evaluate(light), lobe.evaluate(light));
            let density = self.target.pdf(light) + found;
            if density > 0.0 { (wanted - found).abs().powi(3) / density } else { 0.0 }
        };
        let both =
            |u: &[f64; 2]| term((map * sample_cosine_hemisphere(DVec3::Z, *u)).normalize_or(DVec3::Z)) + term(self.target.sample(*u));
        Ok(self.points.iter().map(both).sum::<f64>() / self.points.len() as f64)
    }
}

/// The centres of a grid of cells.
fn points(side: u32) -> Vec<[f64; 2]> {
    let at = |index: u32| (f64::from(index) + 0.5) / f64::from(side);
    (0..side * side).map(|index| [at(index % side), at(index / side)]).collect()
}

fn alpha_of(index: u32, size: u32) -> f64 {
    let roughness = f64::from(index) / f64::from(size - 1);
    (roughness * roughness).max(MIN_ALPHA)
}

/// Cosines crowd where the lobe changes: `1 - (index / last)^2`, and not quite 0.
fn cosine_of(index: u32, size: u32) -> f64 {
    let x = f64::from(index) / f64::from(size - 1);
    (1.0 - x * x).max(1e-3)
}

/// One entry: the fit, and what the light it reflects is, whole and weighted with Schlick's term.
fn fit(roughness: u32, angle: u32, arguments: &Arguments, start: Fit) -> Result<(Fit, [f64; 2]), Error> {
    let alpha = alpha_of(roughness, arguments.size);
    let cosine = cosine_of(angle, arguments.size);
    let (albedo, schlick) = specular_albedo_integrals(alpha, cosine, Distribution::Ggx);
    let view = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let target = Target { alpha, view, albedo };
    let points = points(arguments.samples);
    let mut begun = start;
    let symmetric = angle == 0;
    if symmetric {
        begun.frame = DMat3::IDENTITY;
        begun.numbers[2] = 0.0;
    } else {
        // The mean direction of the lobe.
        let mean: DVec3 = points
            .iter()
            .map(|u| target.sample(*u))
            .filter(|light| light.z > 0.0)
            .map(|light| light * target.evaluate(light) / target.pdf(light).max(1e-300))
            .sum();
        let mean = DVec3::new(mean.x, 0.0, mean.z).normalize_or(DVec3::Z);
        begun.frame = DMat3::from_cols(DVec3::new(mean.z, 0.0, -mean.x), DVec3::Y, mean);
    }
    let numbers = if symmetric { vec![begun.numbers[0]] } else { begun.numbers.to_vec() };
    // Steps in proportion to the lobe's width, which spans three orders of magnitude.
    let simplex: Vec<Vec<f64>> = (0..=numbers.len())
        .map(|corner| {
            let mut moved = numbers.clone();
            if corner > 0 {
                moved[corner - 1] += 0.2 * begun.numbers[0].max(1e-4);
            }
            moved
        })
        .collect();
    let solver = NelderMead::new(simplex).with_sd_tolerance(1e-12)?;
    let problem = Problem { target, fit: begun, points };
    let result = Executor::new(problem, solver).configure(|state| state.max_iters(150)).run()?;
    let best = result.state.best_param.unwrap_or(numbers);
    let numbers = match best[..] {
        [both] => [both.max(1e-7), both.max(1e-7), 0.0],
        [xx, yy, xz] => [xx.max(1e-7), yy.max(1e-7), xz],
        _ => begun.numbers,
    };
    Ok((Fit { frame: begun.frame, numbers }, [albedo, schlick]))
}

/// Four numbers of the inverse, scaled so that its middle is 1, then the two amounts of light.
fn entry(fit: &Fit, light: [f64; 2]) -> [f32; 6] {
    let inverse = fit.map(&fit.numbers).inverse();
    let scale = 1.0 / inverse.y_axis.y;
    [inverse.x_axis.x, inverse.z_axis.x, inverse.x_axis.z, inverse.z_axis.z]
        .map(|number| (number * scale) as f32)
        .into_iter()
        .chain(light.map(|share| share as f32))
        .collect::<Vec<_>>()
        .try_into()
        .unwrap_or([0.0; 6])
}

fn table(arguments: &Arguments) -> Result<Vec<[f32; 6]>, Error> {
    let size = arguments.size;
    let style =
        ProgressStyle::with_template("{bar:40} {pos}/{len} roughnesses, {eta} left").unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = if arguments.quiet { ProgressBar::hidden() } else { ProgressBar::new(u64::from(size)).with_style(style) };
    // Along the normal, from rough to smooth: each search begins where the last one ended.
    let mut starts = vec![Fit { frame: DMat3::IDENTITY, numbers: [1.0, 1.0, 0.0] }; size as usize];
    let mut last = starts[0];
    for roughness in (0..size).rev() {
        last = fit(roughness, 0, arguments, last)?.0;
        starts[roughness as usize] = last;
    }
    let rows: Result<Vec<Vec<[f32; 6]>>, Error> = (0..size)
        .into_par_iter()
        .map(|roughness| {
            let mut last = starts[roughness as usize];
            let row = (0..size).map(|angle| {
                let (found, light) = fit(roughness, angle, arguments, last)?;
                last = found;
                Ok(entry(&found, light))
            });
            let row: Result<Vec<[f32; 6]>, Error> = row.collect();
            bar.inc(1);
            row
        })
        .collect();
    bar.finish_and_clear();
    Ok(rows?.concat())
}

/// `LTC1`, the size, then for every roughness all view angles: six numbers, little-endian.
fn bytes(size: u32, table: &[[f32; 6]]) -> Vec<u8> {
    let header = b"LTC1".iter().copied().chain(size.to_le_bytes());
    header.chain(table.iter().flatten().flat_map(|number| number.to_le_bytes())).collect()
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let table = match table(&arguments) {
        Ok(table) => table,
        Err(error) => {
            eprintln!("error: the fit failed: {error}");
            return ExitCode::FAILURE;
        }
    };
    if table.iter().flatten().any(|number| !number.is_finite()) {
        eprintln!("error: the fit gave a number that is not finite");
        return ExitCode::FAILURE;
    }
    if let Err(error) = std::fs::write(&arguments.output, bytes(arguments.size, &table)) {
        eprintln!("error: {}: {error}", arguments.output.display());
        return ExitCode::FAILURE;
    }
    println!("wrote {} ({} x {} fits)", arguments.output.display(), arguments.size, arguments.size);
    ExitCode::SUCCESS
}
