//! The page of a sweep.

use crate::choice::{Configuration, cheapest_under_error, configurations, most_accurate_under_time, overall, pareto_front, scenes};
use crate::data::Sweep;
use crate::html::{escape, json, number, pairs_line, with_unit};
use crate::light::light_box;
use crate::page::whole_page;
use crate::plot::{Targets, plot, shape};

/// One plot with its answers: a scene, or all of them.
struct Part {
    name: String,
    note: String,
    points: Vec<Configuration>,
    front: Vec<usize>,
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
    let mut body = format!("<h1>{}</h1>\n<p class=\"quiet\">{}</p>\n", escape(&sweep.title), escape(&sweep.device));
    body.push_str(&answers(sweep, &parts, failed));
    for (scene, light) in &sweep.light {
        body.push_str(&light_box(light, &format!("Which light is compared: {scene}")));
    }
    body.push_str("<h2>Error against time</h2>\n<p class=\"quiet\">Both axes are logarithmic; lower left is better. Ringed points are on the Pareto front: no other is both faster and more accurate.");
    if sweep.target_error.is_some() || sweep.target_ms.is_some() {
        body.push_str(" Dashed lines are the targets.");
    }
    body.push_str("</p>\n");
    body.push_str(&legend(&variants));
    body.push_str("<div class=\"plots\">");
    for part in &parts {
        body.push_str(&figure(part, sweep, &variants));
    }
    body.push_str("</div>\n<h2>The Pareto front</h2>\n");
    for part in &parts {
        body.push_str(&format!("<h3>{}</h3>\n{}\n", escape(&part.name), front_table(part, sweep, &variants)));
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
    let bare: Vec<(f64, f64)> = points.iter().map(Configuration::point).collect();
    Part { name: name.to_owned(), note, front: pareto_front(&bare), points }
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
            format!("{} is the fastest and the most accurate", name(&first.points[fast]))
        }
        (None, None, Some(&accurate), Some(&fast)) => format!(
            "From {} (fastest, {}) to {} (most accurate, {} {})",
            name(&first.points[fast]),
            with_unit(first.points[fast].ms, "ms"),
            name(&first.points[accurate]),
            sweep.metric,
            number(first.points[accurate].error)
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
    format!("{} ({})", point.variant, pairs_line(&point.parameters))
}

fn cost(point: &Configuration, sweep: &Sweep) -> String {
    format!("{}, {} {}", with_unit(point.ms, "ms"), sweep.metric, number(point.error))
}

fn bare(part: &Part) -> Vec<(f64, f64)> {
    part.points.iter().map(Configuration::point).collect()
}

fn answer_error(part: &Part, sweep: &Sweep, target: f64) -> String {
    let goal = format!("{} of at most {}", sweep.metric, number(target));
    match cheapest_under_error(&bare(part), target) {
        Some(index) => format!("the cheapest with {goal}: {}, {}", name(&part.points[index]), cost(&part.points[index], sweep)),
        None => format!("nothing reaches {goal}"),
    }
}

fn answer_ms(part: &Part, sweep: &Sweep, target: f64) -> String {
    let goal = format!("at most {}", with_unit(target, "ms"));
    match most_accurate_under_time(&bare(part), target) {
        Some(index) => format!("the most accurate in {goal}: {}, {}", name(&part.points[index]), cost(&part.points[index], sweep)),
        None => format!("nothing takes {goal}"),
    }
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
    let targets = Targets { error: sweep.target_error, ms: sweep.target_ms };
    let plotted = if part.points.is_empty() {
        "<p class=\"failed\">No configuration ended.</p>".to_owned()
    } else {
        match plot(&part.points, &part.front, variants, &sweep.metric, targets) {
            Ok(svg) => {
                let words = format!(
                    "{} against frame time for {}: {} configurations, {} on the Pareto front, which the table below lists",
                    sweep.metric,
                    part.name,
                    part.points.len(),
                    part.front.len()
                );
                svg.replacen("<svg", &format!("<svg role=\"img\" aria-label=\"{}\"", escape(&words)), 1)
            }
            Err(error) => format!("<p class=\"failed\">{}</p>", escape(&error.to_string())),
        }
    };
    let exact = part.points.iter().filter(|point| point.error <= 0.0 || point.ms <= 0.0).count();
    let floor =
        if exact > 0 { format!(" {exact} with an error or a time of zero lie on the edge: zero has no logarithm.") } else { String::new() };
    format!("<figure><figcaption>{} <small>{}.{floor}</small></figcaption>{plotted}</figure>", escape(&part.name), escape(&part.note))
}

fn front_table(part: &Part, sweep: &Sweep, variants: &[&str]) -> String {
    if part.front.is_empty() {
        return "<p>The front is empty: nothing ended with a finite time and error.</p>".to_owned();
    }
    let rows: String = part
        .front
        .iter()
        .map(|&index| {
            let point = &part.points[index];
            let variant = variants.iter().position(|name| *name == point.variant).unwrap_or(0);
            format!(
                "<tr><th scope=\"row\"><span class=\"chip v{}\">{}</span></th><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td></tr>",
                variant % 8,
                escape(&point.variant),
                escape(&pairs_line(&point.parameters)),
                with_unit(point.ms, "ms"),
                number(point.error)
            )
        })
        .collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Pareto front: {}\"><table><thead><tr><th scope=\"col\">Variant</th><th scope=\"col\">Parameters</th><th scope=\"col\">Frame time<small>lower is better</small></th><th scope=\"col\">{}<small>lower is better</small></th></tr></thead><tbody>{rows}</tbody></table></div>",
        escape(&part.name),
        escape(&sweep.metric)
    )
}

fn failures(sweep: &Sweep) -> String {
    let items: String = sweep
        .rows
        .iter()
        .filter_map(|row| {
            let message = row.failed.as_ref()?;
            let parameters = escape(&pairs_line(&row.parameters));
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
                None => format!("<td class=\"number\">{}</td><td class=\"number\">{}</td>", with_unit(row.ms, "ms"), number(row.error)),
            };
            format!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td>{values}</tr>",
                escape(&row.scene),
                escape(&row.variant),
                escape(&pairs_line(&row.parameters)),
                row.seed
            )
        })
        .collect();
    format!(
        "<h2>All runs</h2>\n<details><summary>{} runs</summary><div class=\"scroll\"><table><thead><tr><th scope=\"col\">Scene</th><th scope=\"col\">Variant</th><th scope=\"col\">Parameters</th><th scope=\"col\">Seed</th><th scope=\"col\">Frame time</th><th scope=\"col\">{}</th></tr></thead><tbody>{rows}</tbody></table></div></details>\n",
        sweep.rows.len(),
        escape(&sweep.metric)
    )
}
