//! What each pass costs, as bars with numbers: variants side by side, all bars of a table on one scale.

use crate::data::{Comparison, PassCost, Variant};
use crate::html::{escape, mebibytes, number, time_with_interval, with_unit};

/// Names of the passes of all variants: the order of the first variant, a pass that only a later variant has after the one that
/// it follows there.
pub(crate) fn pass_names(variants: &[Variant]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for variant in variants {
        let mut place = 0;
        for pass in &variant.passes {
            match names.iter().position(|name| *name == pass.name) {
                Some(found) => place = found + 1,
                None => {
                    names.insert(place, &pass.name);
                    place += 1;
                }
            }
        }
    }
    names
}

/// The table of times.
pub(crate) fn times(comparison: &Comparison) -> String {
    let largest = largest(comparison, |pass| pass.gpu_ms.map_or(0.0, |time| time.p95.max(time.median)));
    let cell = |pass: &PassCost| {
        let cpu = pass.cpu_ms.map_or_else(String::new, |ms| format!("CPU {}", with_unit(ms, "ms")));
        let Some(time) = &pass.gpu_ms else { return bar(0.0, "", "not measured", &cpu) };
        let range = format!("{} to {}", number(time.p5), with_unit(time.p95, "ms"));
        let (from, to) = (percent(time.p5, largest), percent(time.p95, largest));
        let whisker = format!("<i class=\"whisker\" style=\"left:{from:.2}%;width:{:.2}%\"></i>", (to - from).max(0.0));
        let small = [range, cpu].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" · ");
        bar(percent(time.median, largest), &whisker, &time_with_interval(time), &small)
    };
    let total = |variant: &Variant| variant.frame_ms.map_or_else(|| "not measured".to_owned(), |time| time_with_interval(&time));
    table(comparison, "Time of each pass", cell, total)
}

/// The table of memory.
pub(crate) fn memory(comparison: &Comparison) -> String {
    let largest = largest(comparison, |pass| mebibytes(pass.bytes));
    let cell = |pass: &PassCost| bar(percent(mebibytes(pass.bytes), largest), "", &with_unit(mebibytes(pass.bytes), "MiB"), "");
    table(comparison, "Memory of each pass", cell, |variant| with_unit(mebibytes(variant.bytes), "MiB"))
}

fn largest(comparison: &Comparison, value: impl Fn(&PassCost) -> f64) -> f64 {
    let passes = comparison.variants.iter().flat_map(|variant| &variant.passes);
    passes.map(value).filter(|value| value.is_finite()).fold(0.0, f64::max)
}

fn percent(value: f64, largest: f64) -> f64 {
    if value.is_finite() && largest > 0.0 { (value / largest * 100.0).clamp(0.0, 100.0) } else { 0.0 }
}

fn bar(width: f64, whisker: &str, value: &str, small: &str) -> String {
    let small = if small.is_empty() { String::new() } else { format!("<small>{}</small>", escape(small)) };
    format!(
        "<td><div class=\"bar\" aria-hidden=\"true\"><b style=\"width:{width:.2}%\"></b>{whisker}</div><span class=\"value\">{}</span> {small}</td>",
        escape(value)
    )
}

fn table(comparison: &Comparison, caption: &str, cell: impl Fn(&PassCost) -> String, total: impl Fn(&Variant) -> String) -> String {
    let variants = &comparison.variants;
    let heads: String =
        variants.iter().enumerate().map(|(index, variant)| format!("<th scope=\"col\">{}</th>", chip(index, &variant.name))).collect();
    let mut rows = String::new();
    for name in pass_names(variants) {
        rows.push_str(&format!("<tr><th scope=\"row\">{}</th>", escape(name)));
        for (index, variant) in variants.iter().enumerate() {
            let mut found = variant.passes.iter().filter(|pass| pass.name == name).peekable();
            if found.peek().is_none() {
                let pruned = variant.pruned.iter().any(|one| one.pass == name);
                rows.push_str(&format!("<td class=\"quiet\">{}</td>", if pruned { "pruned" } else { "not in this variant" }));
            } else {
                let cells: String = found.map(&cell).collect::<Vec<_>>().join("");
                // A pass that runs more than once keeps one cell with a bar for each run.
                let cells = cells.replace("</td><td>", "<br>");
                rows.push_str(&cells.replacen("<td>", &format!("<td class=\"v{}\">", index % 8), 1));
            }
        }
        rows.push_str("</tr>");
    }
    let totals: String = variants.iter().map(|variant| format!("<td><span class=\"value\">{}</span></td>", total(variant))).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{caption}\"><table class=\"costs\"><caption class=\"hidden\">{caption}</caption><thead><tr><th scope=\"col\">Pass</th>{heads}</tr></thead><tbody>{rows}</tbody><tfoot><tr><th scope=\"row\">whole frame</th>{totals}</tr></tfoot></table></div>"
    )
}

/// Name of a variant with the colour that it has all over the page.
pub(crate) fn chip(index: usize, name: &str) -> String {
    format!("<span class=\"chip v{}\">{}</span>", index % 8, escape(name))
}
