//! Pictures of errors: heat maps over two parameters and curves over one, several panels in a row.

use plotters::{
    coord::Shift,
    prelude::*,
    style::{FontStyle, register_font},
};
use std::{
    path::{Path, PathBuf},
    sync::OnceLock,
};

/// An axis of a panel.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Name and unit.
    pub label: &'static str,
    /// Whether equal steps are equal factors; `low` is above 0 then.
    pub logarithmic: bool,
    /// First value.
    pub low: f64,
    /// Last value.
    pub high: f64,
}

impl Axis {
    /// Equal steps are equal differences.
    pub fn linear(label: &'static str, low: f64, high: f64) -> Self {
        Self { label, logarithmic: false, low, high }
    }

    /// Equal steps are equal factors.
    pub fn logarithmic(label: &'static str, low: f64, high: f64) -> Self {
        Self { label, logarithmic: true, low, high }
    }

    /// The value at a share of the axis in [0, 1].
    pub fn at(&self, share: f64) -> f64 {
        if self.logarithmic { self.low * (self.high / self.low).powf(share) } else { self.low + (self.high - self.low) * share }
    }

    fn ends(&self) -> std::ops::Range<f64> {
        if self.logarithmic { self.low.log10()..self.high.log10() } else { self.low..self.high }
    }

    fn tick(&self, place: f64) -> String {
        match self.logarithmic {
            // Decades only.
            true if (place - place.round()).abs() > 1e-6 => String::new(),
            true if (-2.0..4.0).contains(&place.round()) => format!("{}", 10f64.powi(place.round() as i32)),
            true => format!("1e{}", place.round()),
            false => format!("{}", (place * 1000.0).round() / 1000.0),
        }
    }
}

/// Errors over two parameters.
#[derive(Clone, Debug)]
pub struct HeatMap {
    /// What is shown.
    pub title: String,
    /// To the right.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// Cells to the right and upwards.
    pub size: [usize; 2],
    /// Errors, rows from the bottom. NaN is a value that is undefined.
    pub values: Vec<f64>,
}

impl HeatMap {
    /// Evaluates the absolute value of an error at the middle of every cell, on all cores.
    pub fn evaluate(title: &str, x: Axis, y: Axis, size: [usize; 2], error: impl Fn(f64, f64) -> f64 + Sync) -> Self {
        let mut values = vec![0.0; size[0] * size[1]];
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let band = size[1].div_ceil(threads).max(1) * size[0];
        std::thread::scope(|scope| {
            for (index, part) in values.chunks_mut(band).enumerate() {
                let (x, y, error) = (&x, &y, &error);
                scope.spawn(move || {
                    for (offset, value) in part.iter_mut().enumerate() {
                        let cell = index * band + offset;
                        let share = |at: usize, of: usize| (at as f64 + 0.5) / of as f64;
                        *value = error(x.at(share(cell % size[0], size[0])), y.at(share(cell / size[0], size[1]))).abs();
                    }
                });
            }
        });
        Self { title: title.to_owned(), x, y, size, values }
    }
}

/// Errors over one parameter.
#[derive(Clone, Debug)]
pub struct Curves {
    /// What is shown.
    pub title: String,
    /// The parameter.
    pub x: Axis,
    /// Name, and errors at equal shares of the axis.
    pub lines: Vec<(&'static str, Vec<f64>)>,
}

impl Curves {
    /// Evaluates absolute errors along the axis.
    pub fn evaluate(title: &str, x: Axis, lines: &[(&'static str, &dyn Fn(f64) -> f64)]) -> Self {
        const STEPS: usize = 240;
        let line = |error: &dyn Fn(f64) -> f64| (0..=STEPS).map(|step| error(x.at(step as f64 / STEPS as f64)).abs()).collect();
        let lines = lines.iter().map(|(name, error)| (*name, line(error))).collect();
        Self { title: title.to_owned(), x, lines }
    }
}

/// One panel of a picture.
#[derive(Clone, Debug)]
pub enum Panel {
    /// Two parameters.
    Map(HeatMap),
    /// One parameter.
    Curves(Curves),
}

/// Why a picture was not drawn.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// A panel whose values do not fit its size, or no panel.
    #[error("{0}")]
    Shape(String),
    /// The plotting library.
    #[error("cannot draw: {0}")]
    Plot(String),
    /// The file.
    #[error("{}: {what}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// What went wrong.
        what: String,
    },
}

/// Errors from 10^LOW to 1 have a colour; below counts as LOW, above as 1.
pub const LOW: f64 = -7.0;

const PANEL: [u32; 2] = [380, 350];
const BAR: u32 = 92;
const UNDEFINED: RGBColor = RGBColor(200, 200, 200);

/// The colour of an error.
pub fn colour(error: f64) -> [u8; 3] {
    if error.is_nan() {
        return [UNDEFINED.0, UNDEFINED.1, UNDEFINED.2];
    }
    let share = 1.0 - error.max(1e-300).log10() / LOW;
    let colour = colorous::INFERNO.eval_continuous(share.clamp(0.0, 1.0));
    [colour.r, colour.g, colour.b]
}

fn rgb(error: f64) -> RGBColor {
    let [r, g, b] = colour(error);
    RGBColor(r, g, b)
}

fn failed(error: impl std::fmt::Display) -> DrawError {
    DrawError::Plot(error.to_string())
}

/// Draws panels in rows of up to three, with the colour scale at the right, as a PNG that appears whole or not at all.
pub fn draw(panels: &[Panel], file: &Path) -> Result<(), DrawError> {
    let (pixels, size) = render(panels)?;
    let fail = |what: String| DrawError::File { file: file.into(), what };
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new_with_quality(
        &mut bytes,
        image::codecs::png::CompressionType::Best,
        image::codecs::png::FilterType::Adaptive,
    );
    image::ImageEncoder::write_image(encoder, &pixels, size[0], size[1], image::ExtendedColorType::Rgb8)
        .map_err(|error| fail(error.to_string()))?;
    let part = file.with_extension("png.part");
    std::fs::write(&part, &bytes).and_then(|()| std::fs::rename(&part, file)).map_err(|error| fail(error.to_string()))
}

fn render(panels: &[Panel]) -> Result<(Vec<u8>, [u32; 2]), DrawError> {
    if panels.is_empty() {
        return Err(DrawError::Shape("a picture needs a panel".into()));
    }
    for panel in panels {
        if let Panel::Map(map) = panel
            && (map.values.is_empty() || map.values.len() != map.size[0] * map.size[1])
        {
            return Err(DrawError::Shape(format!(
                "`{}` has {} values for {} x {} cells",
                map.title,
                map.values.len(),
                map.size[0],
                map.size[1]
            )));
        }
    }
    font()?;
    let has_map = panels.iter().any(|panel| matches!(panel, Panel::Map(_)));
    let columns = panels.len().min(3) as u32;
    let rows = (panels.len() as u32).div_ceil(columns);
    let size = [columns * PANEL[0] + if has_map { BAR } else { 0 }, rows * PANEL[1]];
    let mut pixels = vec![255; (3 * size[0] * size[1]) as usize];
    {
        let root = BitMapBackend::with_buffer(&mut pixels, (size[0], size[1])).into_drawing_area();
        let (body, bar) = root.split_horizontally((columns * PANEL[0]) as i32);
        for (area, panel) in body.split_evenly((rows as usize, columns as usize)).iter().zip(panels) {
            match panel {
                Panel::Map(map) => draw_map(area, map)?,
                Panel::Curves(curves) => draw_curves(area, curves)?,
            }
        }
        if has_map {
            draw_bar(&bar, size[1])?;
        }
        root.present().map_err(failed)?;
    }
    Ok((pixels, size))
}

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;

fn font() -> Result<(), DrawError> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let registered = REGISTERED.get_or_init(|| register_font("sans-serif", FontStyle::Normal, dejavu::sans::regular()).is_ok());
    if *registered { Ok(()) } else { Err(DrawError::Plot("the font of the labels cannot be read".into())) }
}

fn draw_map(area: &Area<'_>, map: &HeatMap) -> Result<(), DrawError> {
    let (x, y) = (map.x.ends(), map.y.ends());
    let mut chart = ChartBuilder::on(area)
        .caption(&map.title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(38)
        .y_label_area_size(52)
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(failed)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(map.x.label)
        .y_desc(map.y.label)
        .x_labels(ticks(&map.x))
        .y_labels(ticks(&map.y))
        .x_label_formatter(&|place| map.x.tick(*place))
        .y_label_formatter(&|place| map.y.tick(*place))
        .label_style(("sans-serif", 12))
        .axis_desc_style(("sans-serif", 13))
        .draw()
        .map_err(failed)?;
    let at = |range: &std::ops::Range<f64>, step: usize, steps: usize| range.start + (range.end - range.start) * step as f64 / steps as f64;
    let cells = map.values.iter().enumerate().map(|(cell, error)| {
        let (column, row) = (cell % map.size[0], cell / map.size[0]);
        let low = (at(&x, column, map.size[0]), at(&y, row, map.size[1]));
        let high = (at(&x, column + 1, map.size[0]), at(&y, row + 1, map.size[1]));
        Rectangle::new([low, high], rgb(*error).filled())
    });
    chart.draw_series(cells).map_err(failed)?;
    Ok(())
}

/// About one label a decade, or six.
fn ticks(axis: &Axis) -> usize {
    if axis.logarithmic { (axis.high / axis.low).log10().round() as usize + 1 } else { 7 }
}

fn draw_curves(area: &Area<'_>, curves: &Curves) -> Result<(), DrawError> {
    let mut chart = ChartBuilder::on(area)
        .caption(&curves.title, ("sans-serif", 15))
        .margin(8)
        .margin_right(20)
        .x_label_area_size(38)
        .y_label_area_size(52)
        .build_cartesian_2d(curves.x.ends(), LOW..1.0)
        .map_err(failed)?;
    let y = Axis::logarithmic("error", 10f64.powf(LOW), 10.0);
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.1))
        .x_desc(curves.x.label)
        .y_desc("error")
        .x_labels(ticks(&curves.x))
        .y_labels(9)
        .x_label_formatter(&|place| curves.x.tick(*place))
        .y_label_formatter(&|place| y.tick(*place))
        .label_style(("sans-serif", 12))
        .axis_desc_style(("sans-serif", 13))
        .draw()
        .map_err(failed)?;
    let ends = curves.x.ends();
    for (index, (name, errors)) in curves.lines.iter().enumerate() {
        let colour = colorous::TABLEAU10[index % 10];
        let colour = RGBColor(colour.r, colour.g, colour.b);
        let points = errors.iter().enumerate().filter(|(_, error)| error.is_finite()).map(|(step, error)| {
            let place = ends.start + (ends.end - ends.start) * step as f64 / (errors.len() - 1).max(1) as f64;
            (place, error.max(1e-300).log10().clamp(LOW, 1.0))
        });
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))
            .map_err(failed)?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(legend_corner(curves))
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.2))
        .label_font(("sans-serif", 12))
        .draw()
        .map_err(failed)
}

/// The upper corner that the lines leave free.
fn legend_corner(curves: &Curves) -> SeriesLabelPosition {
    let ends = |pick: fn(&[f64]) -> Option<&f64>| curves.lines.iter().filter_map(|(_, errors)| pick(errors)).copied().fold(0.0, f64::max);
    if ends(<[f64]>::last) > ends(<[f64]>::first) { SeriesLabelPosition::UpperLeft } else { SeriesLabelPosition::UpperRight }
}

fn draw_bar(area: &Area<'_>, height: u32) -> Result<(), DrawError> {
    let (top, bottom) = (36, (height.min(PANEL[1]) - 46) as i32);
    let place = |exponent: f64| bottom - ((exponent - LOW) / -LOW * f64::from(bottom - top)) as i32;
    for y in top..=bottom {
        let exponent = LOW + f64::from(bottom - y) / f64::from(bottom - top) * -LOW;
        area.draw(&Rectangle::new([(8, y), (26, y + 1)], rgb(10f64.powf(exponent)).filled())).map_err(failed)?;
    }
    for decade in (LOW as i32)..=0 {
        let label = if decade == 0 {
            "1 or more".to_owned()
        } else if f64::from(decade) == LOW {
            format!("1e{decade}, less")
        } else {
            format!("1e{decade}")
        };
        area.draw(&Text::new(label, (31, place(f64::from(decade)) - 6), ("sans-serif", 12))).map_err(failed)?;
    }
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn map(values: Vec<f64>) -> HeatMap {
        HeatMap { title: "t".into(), x: Axis::logarithmic("x", 1.0, 100.0), y: Axis::linear("y", 0.0, 1.0), size: [2, 2], values }
    }

    #[test]
    fn a_cell_has_the_colour_of_its_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.png");
        draw(&[Panel::Map(map(vec![1e-7, 1e-3, 1.0, f64::NAN]))], &file).unwrap();
        let picture = image::open(&file).unwrap().to_rgb8();
        let seen = |colour: [u8; 3]| picture.pixels().filter(|pixel| pixel.0 == colour).count();
        for error in [1e-7, 1e-3, 1.0, f64::NAN] {
            // A quarter of a plot of about 290 x 260 pixels.
            assert!(seen(colour(error)) > 12_000, "{error}: {}", seen(colour(error)));
        }
        // Rows go up: the first two values are below the last two.
        let place = |error: f64| {
            picture.enumerate_pixels().filter(|(.., pixel)| pixel.0 == colour(error)).map(|(x, y, _)| (x, y)).nth(6000).unwrap()
        };
        assert!(place(1e-3).1 > place(f64::NAN).1 && place(1e-3).0 > 190);
        assert_ne!(colour(f64::NAN), colour(1.0));
        assert_eq!((colour(0.0), colour(5.0)), (colour(1e-7), colour(1.0)));
    }

    #[test]
    fn axes_place_values() {
        let axis = Axis::logarithmic("x", 1e-2, 1e4);
        assert!((axis.at(0.5) - 10.0).abs() < 1e-12 && (axis.ends().start + 2.0).abs() < 1e-12);
        assert_eq!([axis.tick(-2.0), axis.tick(0.5), axis.tick(6.0)], ["0.01", "", "1e6"]);
        let map = HeatMap::evaluate("t", axis, Axis::linear("y", 0.0, 10.0), [3, 5], |x, y| -(x + 1000.0 * y));
        assert!((map.values[0] - (0.1 + 1000.0)).abs() < 1e-9 && (map.values[14] - (1000.0 + 9000.0)).abs() < 1e-9, "{:?}", map.values);
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let file = Path::new("unused.png");
        assert!(matches!(draw(&[], file), Err(DrawError::Shape(_))));
        assert!(matches!(draw(&[Panel::Map(map(vec![1.0; 3]))], file), Err(DrawError::Shape(_))));
        let nowhere = Path::new("no/such/folder/a.png");
        assert!(matches!(draw(&[Panel::Map(map(vec![1.0; 4]))], nowhere), Err(DrawError::File { .. })));
        let flat = Curves::evaluate("t", Axis::linear("x", 0.0, 1.0), &[("zero", &|_| 0.0), ("undefined", &|_| f64::NAN)]);
        assert!(render(&[Panel::Curves(flat)]).is_ok());
    }
}
