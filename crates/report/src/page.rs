//! The page of a comparison.

use crate::bars::{chip, memory, times};
use crate::data::{Comparison, PassDifference, Picture, Variant};
use crate::direction::Direction;
use crate::html::{data_uri, definitions, escape, fill, json, number, signed_percent, with_unit};
use crate::light::light_box;
use crate::verdict::{Verdict, WhereMap, fault, metric_names, metric_values, verdict};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const VIEWER: &str = include_str!("viewer.html");

/// A whole page around `body`, with `data` as the JSON inside it. Title and body are HTML already.
pub(crate) fn whole_page(title: &str, body: &str, data: &str) -> String {
    fill(PAGE, &[("title", title), ("style", STYLE), ("body", body), ("data", data), ("script", SCRIPT)])
}

/// One self-contained HTML file that shows the variants of a comparison against the reference and against each other.
///
/// On top stands a verdict: the variant that is better by FLIP where that is there, else by relative MSE, else by RMSE, else by
/// the first metric; the faster one; and where in the picture which one is closer to the reference, judged on the pictures as
/// shown. Values within 1 % of each other count as equal. Pictures are taken as they are: one that cannot be decoded leaves a hole
/// in the page, is named on top of it, and the page then says nothing about where.
pub fn comparison_page(comparison: &Comparison) -> String {
    let verdict = verdict(comparison);
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"quiet\">{}</p>\n{}\n",
        escape(&comparison.title),
        escape(&comparison.device),
        verdict_box(comparison, &verdict)
    );
    body.push_str(&format!("<h2>Quality and cost</h2>\n{}\n", metrics_table(comparison)));
    body.push_str(VIEWER);
    body.push_str(&format!("<h2>Time of each pass</h2>\n<p class=\"quiet\">Bars: median on the device, in milliseconds, all on one scale; the dark line runs from the 5th to the 95th percentile. Lower is better.</p>\n{}\n", times(comparison)));
    body.push_str(&format!("<h2>Memory of each pass</h2>\n<p class=\"quiet\">On the device, in mebibytes (1 MiB = 1 048 576 bytes), all on one scale. Lower is better.</p>\n{}\n", memory(comparison)));
    body.push_str(&format!("<h2>Where the passes differ</h2>\n{}\n", differences_table(&comparison.differences)));
    body.push_str(&format!("<h2>Settings, and what was pruned</h2>\n<div class=\"columns\">{}</div>\n", settings(&comparison.variants)));
    body.push_str(&format!("<h2>All pictures</h2>\n{}\n", gallery(comparison)));
    whole_page(&escape(&comparison.title), &body, &json(comparison))
}

fn verdict_box(comparison: &Comparison, verdict: &Verdict) -> String {
    let sentences: String = verdict.sentences.iter().map(|sentence| format!("<li>{}</li>", escape(sentence))).collect();
    let reference = img("picture-reference-picture", &comparison.reference, "Reference picture");
    let (faults, scene, command) = (faults(comparison), definitions(&comparison.scene), escape(&comparison.command));
    let light = comparison.light.as_ref().map(|light| light_box(light, "Which light is compared")).unwrap_or_default();
    let (overlay, caption) = match &verdict.map {
        Some(map) => (overlay(map, comparison), legend(map, comparison)),
        None => (String::new(), "Reference".to_owned()),
    };
    format!(
        "<section class=\"verdict\" aria-labelledby=\"verdict\"><div><h2 id=\"verdict\">{}</h2><ul>{sentences}</ul>{faults}{light}<h3>Scene and command</h3>{scene}<pre><code>{command}</code></pre></div><figure><div class=\"where\">{reference}{overlay}</div><figcaption>{caption}</figcaption></figure></section>",
        escape(&verdict.headline)
    )
}

/// Pictures that are not what they should be, in words.
fn faults(comparison: &Comparison) -> String {
    let mut items = String::new();
    let mut look = |words: String, picture: &Picture| {
        if let Some(fault) = fault(picture) {
            items.push_str(&format!("<li class=\"fault\">{} {fault}</li>", escape(&words)));
        }
    };
    look("The reference picture".to_owned(), &comparison.reference);
    for variant in &comparison.variants {
        look(format!("The picture of “{}”", variant.name), &variant.picture);
        look(format!("The relative error map of “{}”", variant.name), &variant.error);
        if let Some(flip) = &variant.flip {
            look(format!("The FLIP map of “{}”", variant.name), flip);
        }
    }
    if items.is_empty() { items } else { format!("<ul class=\"failed\">{items}</ul>") }
}

/// Tiles over the reference, coloured by the variant that is closest to it there.
fn overlay(map: &WhereMap, comparison: &Comparison) -> String {
    let tiles: String = map
        .closest
        .iter()
        .enumerate()
        .filter_map(|(tile, winner)| {
            let (column, row) = (tile as u32 % map.columns, tile as u32 / map.columns);
            winner.map(|winner| format!("<rect class=\"v{}\" x=\"{column}\" y=\"{row}\" width=\"1\" height=\"1\"/>", winner % 8))
        })
        .collect();
    let words: Vec<String> = comparison
        .variants
        .iter()
        .enumerate()
        .map(|(index, variant)| format!("{} in {:.0} %", variant.name, map.share(index) * 100.0))
        .collect();
    format!(
        "<svg viewBox=\"0 0 {} {}\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"Closest to the reference: {}\">{tiles}</svg>",
        map.columns,
        map.rows,
        escape(&words.join(", "))
    )
}

fn legend(map: &WhereMap, comparison: &Comparison) -> String {
    let leaders = comparison.variants.iter().enumerate().filter(|(index, _)| map.share(*index) > 0.0);
    let chips: Vec<String> = leaders.map(|(index, variant)| chip(index, &variant.name)).collect();
    format!("Reference, tinted with the variant that is visibly closer to it: {}. No tint: no visible lead.", chips.join(" "))
}

fn img(id: &str, picture: &Picture, alt: &str) -> String {
    format!(
        "<img id=\"{id}\" width=\"{}\" height=\"{}\" alt=\"{}\" src=\"{}\">",
        picture.width,
        picture.height,
        escape(alt),
        data_uri(picture)
    )
}

fn metrics_table(comparison: &Comparison) -> String {
    let variants = &comparison.variants;
    let mut columns: Vec<(String, Direction, &str, Vec<f64>)> = metric_names(comparison)
        .into_iter()
        .map(|name| {
            let values = metric_values(comparison, &name);
            let direction = Direction::of(&name);
            (name, direction, "", values)
        })
        .collect();
    let frame: Vec<f64> = variants.iter().map(|variant| variant.total_ms).collect();
    let memory: Vec<f64> = variants.iter().map(|variant| variant.total_mebibytes).collect();
    columns.push(("Frame time".to_owned(), Direction::Lower, "ms", frame));
    columns.push(("Memory".to_owned(), Direction::Lower, "MiB", memory));
    let heads: String = columns
        .iter()
        .map(|(name, direction, _, _)| format!("<th scope=\"col\">{}<small>{}</small></th>", escape(name), direction.words()))
        .collect();
    let rows: String = variants
        .iter()
        .enumerate()
        .map(|(index, variant)| {
            let cells: String = columns
                .iter()
                .map(|(_, direction, unit, values)| {
                    let best = direction.best(values);
                    let text = if unit.is_empty() { number(values[index]) } else { with_unit(values[index], unit) };
                    // Where all are equal, none stands out.
                    if best.contains(&index) && best.len() < variants.len() {
                        format!("<td class=\"number\"><span class=\"best\">★ {text}<span class=\"hidden\"> (best)</span></span></td>")
                    } else {
                        format!("<td class=\"number\">{text}</td>")
                    }
                })
                .collect();
            format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", chip(index, &variant.name))
        })
        .collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Quality and cost\"><table><caption class=\"hidden\">Metrics of each variant; ★ marks the best</caption><thead><tr><th scope=\"col\">Variant</th>{heads}</tr></thead><tbody>{rows}</tbody></table></div><p class=\"quiet\">★ marks the best of each column.</p>"
    )
}

fn differences_table(differences: &[PassDifference]) -> String {
    if differences.is_empty() {
        return "<p>No pass differs.</p>".to_owned();
    }
    let rows: String = differences
        .iter()
        .map(|difference| {
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td class=\"number\">{}</td></tr>",
                escape(&difference.pass),
                escape(&difference.what),
                escape(&difference.a),
                escape(&difference.b),
                signed_percent(difference.change)
            )
        })
        .collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Where the passes differ\"><table><thead><tr><th scope=\"col\">Pass</th><th scope=\"col\">What</th><th scope=\"col\">From</th><th scope=\"col\">To</th><th scope=\"col\">Change<small>of the first</small></th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

fn settings(variants: &[Variant]) -> String {
    variants
        .iter()
        .enumerate()
        .map(|(index, variant)| {
            let pruned: String = if variant.pruned.is_empty() {
                "<p class=\"quiet\">Nothing was pruned.</p>".to_owned()
            } else {
                let items = variant.pruned.iter().map(|(pass, why)| format!("<li><strong>{}</strong>: {}</li>", escape(pass), escape(why)));
                format!("<p>Pruned:</p><ul>{}</ul>", items.collect::<String>())
            };
            format!("<div><h3>{}</h3>{}{pruned}</div>", chip(index, &variant.name), definitions(&variant.settings))
        })
        .collect()
}

fn gallery(comparison: &Comparison) -> String {
    let mut figures = String::new();
    for (index, variant) in comparison.variants.iter().enumerate() {
        let kinds = [
            ("picture", "Picture", Some(&variant.picture)),
            ("error", "Relative error map", Some(&variant.error)),
            ("flip", "FLIP map", variant.flip.as_ref()),
        ];
        for (kind, words, picture) in kinds {
            if let Some(picture) = picture {
                let image = img(&format!("picture-{index}-{kind}"), picture, &format!("{words} of {}", variant.name));
                figures.push_str(&format!("<figure>{image}<figcaption>{words}: {}</figcaption></figure>", chip(index, &variant.name)));
            }
        }
    }
    format!("<div class=\"gallery\">{figures}</div>")
}
