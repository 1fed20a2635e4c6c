//! Error against time as an SVG, both axes logarithmic. Axes and labels take the text colour of the page, points the colour of
//! their variant, so that one plot is legible on light and on dark.

use lobelia_measure::sampled::Interval;
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Polygon, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoFont, RGBAColor, RGBColor, ShapeStyle, TextStyle};

use crate::choice::Configuration;
use crate::html::raised;

/// Why a plot could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the plot could not be drawn: {0}")]
pub(crate) struct PlotError(String);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Twice the size at which a page shows it: plotters places everything on whole units.
const SIZE: (u32, u32) = (1240, 880);
const LEFT: f64 = 170.0;
const RIGHT: f64 = 1210.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 760.0;
const LABEL: f64 = 32.0;
/// Stands for the text colour of the page until the SVG is written.
const INK: RGBColor = RGBColor(1, 2, 3);

/// Stands for the colour of a variant until the SVG is written.
fn tint(variant: usize) -> RGBColor {
    RGBColor(4, 5, (variant % 8) as u8)
}

/// One axis: a range of logarithms that holds all positive values, with room at both ends.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let logarithms = values.filter(|value| *value > 0.0 && value.is_finite()).map(f64::log10);
        let (low, high) = logarithms.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 0.0) };
        // A factor of four at least, so that values that are nearly equal do not look far apart.
        let room = (0.08 * (high - low)).max((0.6 - (high - low)) / 2.0);
        Self { low: low - room, high: high + room, from, to }
    }

    /// Place of a value; one that is not positive has no logarithm and lies on the lower end.
    fn place(&self, value: f64) -> f64 {
        let share = if value > 0.0 { (value.log10() - self.low) / (self.high - self.low) } else { 0.0 };
        self.from + share * (self.to - self.from)
    }

    /// (value, whether it has a label): 1, 2 and 5 of each decade, labelled where there is room.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let span = self.high - self.low;
        let stride = (span / 8.0).ceil().max(1.0) as i32;
        let mut ticks = Vec::new();
        for decade in self.low.floor() as i32..=self.high.ceil() as i32 {
            for digit in 1..10 {
                let value = f64::from(digit) * 10f64.powi(decade);
                let inside = value.log10() >= self.low && value.log10() <= self.high;
                let label = match digit {
                    1 => decade.rem_euclid(stride) == 0,
                    2 | 5 => span < 3.2,
                    _ => false,
                };
                if inside && (label || span < 5.0) {
                    ticks.push((value, label));
                }
            }
        }
        ticks
    }
}

fn tick_label(value: f64) -> String {
    let exponent = value.log10().floor();
    if (-3.0..5.0).contains(&exponent) {
        // Rounded on ten digits: 3·10^-3 is not a binary number.
        format!("{}", (value * 1e10).round() / 1e10)
    } else {
        let exponent = exponent as i32;
        let raised = raised(&exponent.to_string());
        let digit = (value / 10f64.powi(exponent)).round();
        if digit == 1.0 { format!("10{raised}") } else { format!("{digit}·10{raised}") }
    }
}

/// Lines that are no points.
#[derive(Clone, Copy, Default)]
pub(crate) struct Lines {
    /// Target of the error, drawn dashed.
    pub error: Option<f64>,
    /// Target of the time, drawn dashed.
    pub ms: Option<f64>,
    /// The error that the noise of the reference alone makes, drawn dotted with its name.
    pub floor: Option<f64>,
}

/// What is written beside a point: its number, and what sets it apart from the others.
pub(crate) struct Label {
    pub number: usize,
    pub words: String,
}

/// The plot of some configurations. `front` are the indices of the Pareto front by rising time; `variants` are the names that
/// choose colours and shapes; `labels` has one for each point. Points on the front have their whole label, others their number.
pub(crate) fn plot(
    points: &[Configuration],
    front: &[usize],
    labels: &[Label],
    variants: &[&str],
    title: &str,
    lines: Lines,
) -> Result<String, PlotError> {
    let ends = |interval: Option<Interval>| interval.into_iter().flat_map(|interval| [interval.low, interval.high]);
    let times = points
        .iter()
        .flat_map(|point| ends(point.ms_interval()).chain([point.ms]).filter(|ms| *ms > 0.2 * point.ms && *ms < 5.0 * point.ms));
    let errors = points.iter().flat_map(|point| {
        let value = point.error.value;
        ends(point.error_interval()).chain([value]).filter(move |error| *error > 0.2 * value && *error < 5.0 * value)
    });
    let x = Axis::new(times.chain(lines.ms), LEFT, RIGHT);
    let y = Axis::new(errors.chain(lines.error).chain(lines.floor), BOTTOM, TOP);
    let mut svg = String::new();
    let drawn = {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        let frame = draw_frame(&area, &x, &y, title, lines);
        frame.and_then(|()| draw_points(&area, &x, &y, points, front, labels, variants)).and_then(|()| area.present())
    };
    drawn.map_err(|error| PlotError(error.to_string()))?;
    Ok(dress(&svg))
}

type Drawn = Result<(), plotters::drawing::DrawingAreaErrorKind<std::io::Error>>;

/// Axes, their names, and lines that are no points.
fn draw_frame(area: &Area, x: &Axis, y: &Axis, title: &str, lines: Lines) -> Drawn {
    let faint = ShapeStyle { color: INK.mix(0.13), filled: false, stroke_width: 2 };
    let strong = ShapeStyle { color: INK.mix(0.7), filled: false, stroke_width: 3 };
    for (value, label) in x.ticks() {
        let place = x.place(value);
        line(area, (place, TOP), (place, BOTTOM), faint)?;
        if label {
            text(area, &tick_label(value), (place, BOTTOM + 14.0), HPos::Center, VPos::Top, FontTransform::None)?;
        }
    }
    for (value, label) in y.ticks() {
        let place = y.place(value);
        line(area, (LEFT, place), (RIGHT, place), faint)?;
        if label {
            text(area, &tick_label(value), (LEFT - 14.0, place), HPos::Right, VPos::Center, FontTransform::None)?;
        }
    }
    line(area, (LEFT, BOTTOM), (RIGHT, BOTTOM), strong)?;
    line(area, (LEFT, TOP), (LEFT, BOTTOM), strong)?;
    text(area, "Frame time [ms]", ((LEFT + RIGHT) / 2.0, BOTTOM + 66.0), HPos::Center, VPos::Top, FontTransform::None)?;
    let error = format!("Error: {title}");
    text(area, &error, (26.0, (TOP + BOTTOM) / 2.0), HPos::Center, VPos::Center, FontTransform::Rotate270)?;
    let drawable = |value: Option<f64>| value.filter(|value| *value > 0.0 && value.is_finite());
    if let Some(ms) = drawable(lines.ms) {
        dashes(area, (x.place(ms), TOP), (x.place(ms), BOTTOM), 24.0)?;
    }
    if let Some(error) = drawable(lines.error) {
        dashes(area, (LEFT, y.place(error)), (RIGHT, y.place(error)), 24.0)?;
    }
    if let Some(floor) = drawable(lines.floor) {
        dashes(area, (LEFT, y.place(floor)), (RIGHT, y.place(floor)), 8.0)?;
        text(area, "noise of the reference", (RIGHT - 8.0, y.place(floor) - 6.0), HPos::Right, VPos::Bottom, FontTransform::None)?;
    }
    Ok(())
}

fn draw_points(area: &Area, x: &Axis, y: &Axis, points: &[Configuration], front: &[usize], labels: &[Label], variants: &[&str]) -> Drawn {
    let place = |index: usize| (x.place(points[index].ms), y.place(points[index].error.value));
    // Steps: between two points of the front the faster one is the best there is.
    let ink = ShapeStyle { color: INK.mix(0.55), filled: false, stroke_width: 4 };
    for pair in front.windows(2) {
        let (a, b) = (place(pair[0]), place(pair[1]));
        line(area, a, (b.0, a.1), ink)?;
        line(area, (b.0, a.1), b, ink)?;
    }
    let is_front = |index: usize| front.contains(&index);
    let order = (0..points.len()).filter(|&index| !is_front(index)).chain(front.iter().copied());
    for index in order {
        let variant = variants.iter().position(|name| *name == points[index].variant).unwrap_or(0);
        let (at, opacity) = (place(index), if is_front(index) { 1.0 } else { 0.5 });
        error_bars(area, x, y, &points[index], tint(variant).mix(opacity))?;
        if is_front(index) {
            area.draw(&Circle::new(whole(at), 22, ShapeStyle { color: INK.to_rgba(), filled: false, stroke_width: 4 }))?;
            marker(area, at, variant, 13.0, 1.0)?;
        } else {
            marker(area, at, variant, 11.0, 0.5)?;
        }
    }
    // Labels last, so that nothing lies over them; the front's are whole.
    for (index, label) in labels.iter().enumerate().take(points.len()) {
        if !is_front(index) && points.len() > MOST_NUMBERS {
            continue;
        }
        let (px, py) = place(index);
        let words = if is_front(index) && !label.words.is_empty() {
            format!("{}: {}", label.number, label.words)
        } else {
            label.number.to_string()
        };
        let (at, across) = if px > 0.6 * RIGHT { ((px - 24.0, py - 20.0), HPos::Right) } else { ((px + 24.0, py - 20.0), HPos::Left) };
        text(area, &words, at, across, VPos::Bottom, FontTransform::None)?;
    }
    Ok(())
}

/// More points than this have numbers on the front alone: others would hide each other.
const MOST_NUMBERS: usize = 60;

/// 95 % intervals of time and error, cut at the axes.
fn error_bars(area: &Area, x: &Axis, y: &Axis, point: &Configuration, colour: RGBAColor) -> Drawn {
    let style = ShapeStyle { color: colour, filled: false, stroke_width: 3 };
    let (px, py) = (x.place(point.ms), y.place(point.error.value));
    let inside = |place: f64, from: f64, to: f64| place.clamp(from.min(to), from.max(to));
    if let Some(interval) = point.ms_interval() {
        let (low, high) = (inside(x.place(interval.low), LEFT, RIGHT), inside(x.place(interval.high), LEFT, RIGHT));
        line(area, (low, py), (high, py), style)?;
        for end in [low, high] {
            line(area, (end, py - 8.0), (end, py + 8.0), style)?;
        }
    }
    if let Some(interval) = point.error_interval() {
        let (low, high) = (inside(y.place(interval.low), TOP, BOTTOM), inside(y.place(interval.high), TOP, BOTTOM));
        line(area, (px, low), (px, high), style)?;
        for end in [low, high] {
            line(area, (px - 8.0, end), (px + 8.0, end), style)?;
        }
    }
    Ok(())
}

fn whole((x, y): (f64, f64)) -> (i32, i32) {
    (x.round() as i32, y.round() as i32)
}

fn line(area: &Area, from: (f64, f64), to: (f64, f64), style: ShapeStyle) -> Drawn {
    area.draw(&PathElement::new(vec![whole(from), whole(to)], style))
}

fn dashes(area: &Area, from: (f64, f64), to: (f64, f64), period: f64) -> Drawn {
    let style = ShapeStyle { color: INK.mix(0.8), filled: false, stroke_width: 3 };
    let length = (to.0 - from.0).hypot(to.1 - from.1);
    let at = |distance: f64| {
        let share = (distance / length).min(1.0);
        (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share)
    };
    for dash in 0..(length / period).ceil() as u32 {
        let start = f64::from(dash) * period;
        line(area, at(start), at(start + 0.5 * period), style)?;
    }
    Ok(())
}

fn text(area: &Area, words: &str, at: (f64, f64), across: HPos, down: VPos, turn: FontTransform) -> Drawn {
    let style = TextStyle::from(("sans-serif", LABEL).into_font()).color(&INK).pos(Pos::new(across, down)).transform(turn);
    area.draw(&Text::new(words.to_owned(), whole(at), style))
}

/// Corners of the shape of a variant, for a half size of 1; none for a circle. Shapes tell variants apart where colours do not.
pub(crate) fn shape(variant: usize) -> &'static [(f64, f64)] {
    match variant % 4 {
        0 => &[],
        1 => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        2 => &[(0.0, -1.1), (1.1, 0.9), (-1.1, 0.9)],
        _ => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
    }
}

fn marker(area: &Area, at: (f64, f64), variant: usize, size: f64, opacity: f64) -> Drawn {
    let style = ShapeStyle { color: tint(variant).mix(opacity), filled: true, stroke_width: 1 };
    let corners = shape(variant);
    if corners.is_empty() {
        return area.draw(&Circle::new(whole(at), size as i32, style));
    }
    let corners: Vec<(i32, i32)> = corners.iter().map(|(x, y)| whole((at.0 + x * size, at.1 + y * size))).collect();
    area.draw(&Polygon::new(corners, style))
}

/// Colours of the page in place of the stand-ins, and no name space: inside HTML an SVG needs none, and the page then holds no
/// address at all.
fn dress(svg: &str) -> String {
    let mut svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
    for property in ["fill", "stroke"] {
        svg = svg.replace(&format!("{property}=\"#010203\""), &format!("style=\"{property}:currentColor\""));
        for variant in 0..8 {
            svg = svg.replace(&format!("{property}=\"#04050{variant}\""), &format!("style=\"{property}:var(--v{variant})\""));
        }
    }
    match svg.find("<svg") {
        Some(start) => svg[start..].to_owned(),
        None => svg,
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, tick_label};

    #[test]
    fn equal_steps_of_the_logarithm_are_equal_steps_on_the_axis() {
        let axis = Axis::new([0.01, 1.0, 100.0, 0.0, f64::NAN].into_iter(), 0.0, 1000.0);
        let (a, b, c) = (axis.place(0.01), axis.place(1.0), axis.place(100.0));
        assert!((c - b - (b - a)).abs() < 1e-9 && a > 0.0 && c < 1000.0);
        assert_eq!(axis.place(0.0), 0.0);
        let labels: Vec<f64> = axis.ticks().into_iter().filter(|(_, label)| *label).map(|(value, _)| value.log10().round()).collect();
        assert_eq!(labels, [-2.0, -1.0, 0.0, 1.0, 2.0]);
    }

    #[test]
    fn a_single_value_still_gets_labels() {
        let axis = Axis::new([3.0].into_iter(), 0.0, 100.0);
        assert!((axis.place(3.0) - 50.0).abs() < 1e-9);
        assert!(axis.ticks().iter().any(|(_, label)| *label));
    }

    #[test]
    fn labels_are_short() {
        let cases = [(0.003, "0.003"), (1.0, "1"), (2000.0, "2000"), (1e-5, "10⁻⁵"), (2e-6, "2·10⁻⁶"), (1e10, "10¹⁰")];
        for (value, label) in cases {
            assert_eq!(tick_label(value), label);
        }
    }
}
