//! The page of a sweep.

use std::collections::BTreeMap;

use crate::choice::{Choice, Configuration, cheapest_under_error, configurations, most_accurate_under_time, overall, pareto_front, scenes};
use crate::direction::Direction;
use crate::html::{escape, interval, json, number, pairs_line, parameter, with_unit};
use crate::light::light_box;
use crate::metric::Metric;
use crate::page::whole_page;
use crate::plot::{Label, Lines, plot, shape};
use crate::sweep_data::{Sweep, plotted_title};

/// One plot with its answers: a scene, or all of them.
struct Part {
    name: String,
    note: String,
    points: Vec<Configuration>,
    front: Vec<usize>,
    /// One for each point: those on the front have the first numbers, by rising time.
    labels: Vec<Label>,
}

/// One self-contained HTML file that shows error against time, per scene and over all scenes, with the Pareto front, the answers
/// to the targets, and the runs that failed.
///
/// Points are means over the seeds of one configuration ([`configurations`]); over all scenes they are mean times and geometric
/// means of errors ([`overall`]). With one scene there is no part over all scenes.
pub fn sweep_page(sweep: &Sweep) -> String {
    let parts = parts(sweep);
    let mut variants: Vec<&str> = Vec::new();
    for row in &sweep.rows {
        if !variants.contains(&row.variant.as_str()) {
            variants.push(&row.variant);
        }
    }
    let failed = sweep.rows.iter().filter(|row| row.failed.is_some()).count();
    let mut body = format!("<h1>{}</h1>\n<p class=\"quiet\">{}</p>\n", escape(&sweep.title), escape(&sweep.devices.join(", ")));
    body.push_str(&answers(sweep, &parts, failed));
    for (scene, light) in &sweep.light {
        body.push_str(&light_box(light, &format!("Which light is compared: {scene}")));
    }
    body.push_str("<h2>Error against time</h2>\n<p class=\"quiet\">Both axes are logarithmic; lower left is better. Bars are 95 % intervals. Ringed points are on the Pareto front: none that stands there is shown to be better in time or error without being worse in the other. A difference counts where its 99 % interval leaves out zero and it is at least 1 % of the error, or 2 % of the time. Numbers are those of the tables below.");
    if sweep.target_error.is_some() || sweep.target_ms.is_some() {
        body.push_str(" Dashed lines are the targets.");
    }
    if parts.iter().any(|part| floor(part).is_some()) {
        body.push_str(" The dotted line is the error that the noise of the reference alone would give a perfect picture: near it and below, points say little.");
    }
    body.push_str("</p>\n");
    if let Some(metric) = Metric::of(&sweep.metric) {
        body.push_str(&format!(
            "<p class=\"quiet\"><strong>{}</strong> ({}; {}): {} <cite>{}</cite></p>\n",
            escape(metric.title),
            Direction::of(metric.name).words(),
            escape(metric.range),
            escape(metric.meaning),
            escape(metric.source)
        ));
    }
    let unknown = parts
        .iter()
        .flat_map(|part| &part.points)
        .filter(|point| point.ms_error.is_none() || point.error.standard_error().is_none())
        .count();
    if unknown > 0 {
        body.push_str(&format!("<p class=\"quiet\">Of {unknown} points the noise of time or error is not known; they are taken as exact. More rounds, samples or seeds would tell it.</p>\n"));
    }
    body.push_str(&legend(&variants));
    body.push_str("<div class=\"plots\">");
    for part in &parts {
        body.push_str(&figure(part, sweep, &variants));
    }
    body.push_str("</div>\n<h2>The Pareto front</h2>\n");
    for part in &parts {
        body.push_str(&format!("<h3>{}</h3>\n{}\n", escape(&part.name), front_table(part, sweep, &variants)));
    }
    body.push_str("<h2>The other configurations</h2>\n");
    for part in &parts {
        body.push_str(&format!("<h3>{}</h3>\n{}\n", escape(&part.name), rest_table(part, sweep, &variants)));
    }
    body.push_str(&failures(sweep));
    body.push_str(&all_rows(sweep));
    whole_page(&escape(&sweep.title), &body, &json(sweep))
}

fn parts(sweep: &Sweep) -> Vec<Part> {
    let names = scenes(&sweep.rows);
    let mut parts = Vec::new();
    if names.len() > 1 {
        let note = "configurations that ended in every scene; mean time, geometric mean of the error".to_owned();
        parts.push(part("All scenes", note, overall(&sweep.rows)));
    }
    for scene in names {
        let points = configurations(&sweep.rows, scene);
        let most = points.iter().map(|point| point.count).max().unwrap_or(0);
        let note = if most > 1 { format!("means over up to {most} seeds") } else { "one seed".to_owned() };
        parts.push(part(scene, note, points));
    }
    parts
}

fn part(name: &str, note: String, points: Vec<Configuration>) -> Part {
    let front = pareto_front(&points);
    let labels = labels(&points, &front);
    Part { name: name.to_owned(), note, points, front, labels }
}

/// Numbers, and the parameters in which points differ, under the last part of their names.
fn labels(points: &[Configuration], front: &[usize]) -> Vec<Label> {
    let varies = |name: &str| points.iter().any(|point| point.parameters.get(name) != points[0].parameters.get(name));
    let mut others = front.len();
    let label = |(index, point): (usize, &Configuration)| {
        let number = front.iter().position(|&one| one == index).map_or_else(
            || {
                others += 1;
                others
            },
            |place| place + 1,
        );
        let differing = point.parameters.iter().filter(|(name, _)| varies(name));
        let words: Vec<String> =
            differing.map(|(name, value)| format!("{} {}", name.rsplit('.').next().unwrap_or(name), parameter(value))).collect();
        let words = words.join(", ");
        // What does not fit is in the table.
        Label { number, words: if words.chars().count() <= 28 { words } else { String::new() } }
    };
    points.iter().enumerate().map(label).collect()
}

/// The noise of the reference in a plot: that of its points, which have one reference.
fn floor(part: &Part) -> Option<f64> {
    part.points.iter().filter_map(|point| point.floor).filter(|floor| *floor > 0.0 && floor.is_finite()).reduce(f64::max)
}

/// What the targets ask for, in words; without targets, the ends of the front.
fn answers(sweep: &Sweep, parts: &[Part], failed: usize) -> String {
    let Some(first) = parts.first() else {
        return "<section class=\"verdict bad\"><div><h2>The sweep has no runs</h2></div></section>".to_owned();
    };
    let headline = match (sweep.target_error, sweep.target_ms, first.front.last(), first.front.first()) {
        (Some(target), _, _, _) => answer_error(first, sweep, target),
        (None, Some(target), _, _) => answer_ms(first, sweep, target),
        (None, None, Some(&accurate), Some(&fast)) if accurate == fast => {
            format!(
                "{} stands alone: none is shown to be faster or more accurate without being worse in the other",
                name(&first.points[fast])
            )
        }
        (None, None, Some(&accurate), Some(&fast)) => format!(
            "From {} (fastest, {}) to {} (most accurate, {} {})",
            name(&first.points[fast]),
            with_unit(first.points[fast].ms, "ms"),
            name(&first.points[accurate]),
            plotted_title(&sweep.metric),
            number(first.points[accurate].error.value)
        ),
        _ => "No configuration ended with a finite time and error".to_owned(),
    };
    let mut items = String::new();
    for part in parts {
        let mut lines = Vec::new();
        if let Some(target) = sweep.target_error {
            lines.push(answer_error(part, sweep, target));
        }
        if let Some(target) = sweep.target_ms {
            lines.push(answer_ms(part, sweep, target));
        }
        for line in lines {
            items.push_str(&format!("<li><strong>{}</strong>: {}</li>", escape(&part.name), escape(&line)));
        }
    }
    if failed > 0 {
        items.push_str(&format!(
            "<li>{failed} of {} runs failed, listed below; their configurations are in no plot and no answer.</li>",
            sweep.rows.len()
        ));
    }
    let bad = if first.front.is_empty() { " bad" } else { "" };
    format!(
        "<section class=\"verdict{bad}\" aria-labelledby=\"verdict\"><div><h2 id=\"verdict\">{}</h2><ul>{items}</ul></div></section>\n",
        escape(&capital(&headline))
    )
}

fn capital(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

fn name(point: &Configuration) -> String {
    format!("{} ({})", point.variant, parameters_line(&point.parameters))
}

fn parameters_line(parameters: &BTreeMap<String, serde_json::Value>) -> String {
    pairs_line(&parameters.iter().map(|(name, value)| (name.clone(), parameter(value))).collect::<Vec<_>>())
}

fn with_interval(text: String, found: Option<lobelia_measure::sampled::Interval>) -> String {
    match found.and_then(|found| interval(Some(found.low), Some(found.high))) {
        Some(interval) => format!("{text} ({interval})"),
        None => text,
    }
}

fn time(point: &Configuration) -> String {
    with_interval(with_unit(point.ms, "ms"), point.ms_interval())
}

fn error(point: &Configuration) -> String {
    with_interval(number(point.error.value), point.error_interval())
}

fn cost(point: &Configuration, sweep: &Sweep) -> String {
    format!("{}, {} {}", time(point), plotted_title(&sweep.metric), error(point))
}

fn answer(part: &Part, sweep: &Sweep, choice: &Choice, what: &str, tie: &str, goal: &str) -> String {
    match choice {
        Choice::Found { index, ties } => {
            let ties: Vec<String> = ties.iter().map(|&tie| name(&part.points[tie])).collect();
            let ties = if ties.is_empty() { String::new() } else { format!("; no difference in {tie} is shown to {}", ties.join(", ")) };
            format!("the {what} {goal}: {}, {}{ties}", name(&part.points[*index]), cost(&part.points[*index], sweep))
        }
        Choice::Perhaps(index) => {
            let point = &part.points[*index];
            format!("nothing is shown to reach {goal}; {} may, {}", name(point), cost(point, sweep))
        }
        Choice::Nothing => format!("nothing reaches {goal}"),
    }
}

fn answer_error(part: &Part, sweep: &Sweep, target: f64) -> String {
    let goal = format!("{} of at most {}", plotted_title(&sweep.metric), number(target));
    answer(part, sweep, &cheapest_under_error(&part.points, target), "cheapest with", "time", &goal)
}

fn answer_ms(part: &Part, sweep: &Sweep, target: f64) -> String {
    let goal = format!("at most {}", with_unit(target, "ms"));
    answer(part, sweep, &most_accurate_under_time(&part.points, target), "most accurate in", "accuracy", &goal)
}

fn legend(variants: &[&str]) -> String {
    let items: String = variants.iter().enumerate().map(|(index, name)| format!("<li>{}{}</li>", mark(index), escape(name))).collect();
    format!("<ul class=\"legend\" aria-label=\"Variants\">{items}</ul>\n")
}

/// The shape of a variant as in the plots.
fn mark(variant: usize) -> String {
    let corners = shape(variant);
    let inside = if corners.is_empty() {
        "<circle cx=\"8\" cy=\"8\" r=\"6\"/>".to_owned()
    } else {
        let points: Vec<String> = corners.iter().map(|(x, y)| format!("{:.1},{:.1}", 8.0 + 6.0 * x, 8.0 + 6.0 * y)).collect();
        format!("<polygon points=\"{}\"/>", points.join(" "))
    };
    format!("<svg class=\"mark tinted v{}\" viewBox=\"0 0 16 16\" aria-hidden=\"true\">{inside}</svg>", variant % 8)
}

fn figure(part: &Part, sweep: &Sweep, variants: &[&str]) -> String {
    let lines = Lines { error: sweep.target_error, ms: sweep.target_ms, floor: floor(part) };
    let plotted = if part.points.is_empty() {
        "<p class=\"failed\">No configuration ended.</p>".to_owned()
    } else {
        match plot(&part.points, &part.front, &part.labels, variants, &plotted_title(&sweep.metric), lines) {
            Ok(svg) => {
                let words = format!(
                    "{} against frame time for {}: {} configurations, {} on the Pareto front, which the table below lists",
                    plotted_title(&sweep.metric),
                    part.name,
                    part.points.len(),
                    part.front.len()
                );
                svg.replacen("<svg", &format!("<svg role=\"img\" aria-label=\"{}\"", escape(&words)), 1)
            }
            Err(error) => format!("<p class=\"failed\">{}</p>", escape(&error.to_string())),
        }
    };
    let exact = part.points.iter().filter(|point| point.error.value <= 0.0 || point.ms <= 0.0).count();
    let floor =
        if exact > 0 { format!(" {exact} with an error or a time of zero lie on the edge: zero has no logarithm.") } else { String::new() };
    format!("<figure><figcaption>{} <small>{}.{floor}</small></figcaption>{plotted}</figure>", escape(&part.name), escape(&part.note))
}

fn front_table(part: &Part, sweep: &Sweep, variants: &[&str]) -> String {
    if part.front.is_empty() {
        return "<p>The front is empty: nothing ended with a finite time and error.</p>".to_owned();
    }
    table(part, sweep, variants, &part.front, "Pareto front")
}

fn rest_table(part: &Part, sweep: &Sweep, variants: &[&str]) -> String {
    let rest: Vec<usize> = (0..part.points.len()).filter(|index| !part.front.contains(index)).collect();
    if rest.is_empty() {
        return "<p>There are none.</p>".to_owned();
    }
    let table = table(part, sweep, variants, &rest, "Other configurations");
    format!("<details><summary>{} that one on the front beats</summary>{table}</details>", rest.len())
}

fn table(part: &Part, sweep: &Sweep, variants: &[&str], indices: &[usize], what: &str) -> String {
    let rows: String = indices
        .iter()
        .map(|&index| {
            let point = &part.points[index];
            let variant = variants.iter().position(|name| *name == point.variant).unwrap_or(0);
            let ms = interval(point.ms_interval().map(|found| found.low), point.ms_interval().map(|found| found.high)).unwrap_or_default();
            let off = interval(point.error_interval().map(|found| found.low), point.error_interval().map(|found| found.high)).unwrap_or_default();
            format!(
                "<tr><td class=\"number\">{}</td><th scope=\"row\"><span class=\"chip v{}\">{}</span></th><td>{}</td><td class=\"number\">{}<small>{ms}</small></td><td class=\"number\">{}<small>{off}</small></td></tr>",
                part.labels[index].number,
                variant % 8,
                escape(&point.variant),
                escape(&parameters_line(&point.parameters)),
                with_unit(point.ms, "ms"),
                number(point.error.value)
            )
        })
        .collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{what}: {}\"><table><thead><tr><th scope=\"col\">No.</th><th scope=\"col\">Variant</th><th scope=\"col\">Parameters</th><th scope=\"col\">Frame time<small>lower is better</small></th><th scope=\"col\">{}<small>lower is better</small></th></tr></thead><tbody>{rows}</tbody></table></div>",
        escape(&part.name),
        escape(&plotted_title(&sweep.metric))
    )
}

fn failures(sweep: &Sweep) -> String {
    let items: String = sweep
        .rows
        .iter()
        .filter_map(|row| {
            let message = row.failed.as_ref()?;
            let parameters = escape(&parameters_line(&row.parameters));
            Some(format!(
                "<li>{}, {} ({parameters}), seed {}: <code>{}</code></li>",
                escape(&row.scene),
                escape(&row.variant),
                row.seed,
                escape(message)
            ))
        })
        .collect();
    if items.is_empty() { String::new() } else { format!("<h2>Failed runs</h2>\n<div class=\"failed\"><ul>{items}</ul></div>\n") }
}

fn all_rows(sweep: &Sweep) -> String {
    let rows: String = sweep
        .rows
        .iter()
        .map(|row| {
            let values = match row.failed {
                Some(_) => "<td colspan=\"2\">failed</td>".to_owned(),
                None => format!(
                    "<td class=\"number\">{}</td><td class=\"number\">{}</td>",
                    with_unit(row.ms, "ms"),
                    row.error.as_ref().map_or_else(|| "not finite".to_owned(), |error| number(error.value))
                ),
            };
            format!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td>{values}</tr>",
                escape(&row.scene),
                escape(&row.variant),
                escape(&parameters_line(&row.parameters)),
                row.seed
            )
        })
        .collect();
    format!(
        "<h2>All runs</h2>\n<details><summary>{} runs</summary><div class=\"scroll\"><table><thead><tr><th scope=\"col\">Scene</th><th scope=\"col\">Variant</th><th scope=\"col\">Parameters</th><th scope=\"col\">Seed</th><th scope=\"col\">Frame time</th><th scope=\"col\">{}</th></tr></thead><tbody>{rows}</tbody></table></div></details>\n",
        sweep.rows.len(),
        escape(&plotted_title(&sweep.metric))
    )
}
