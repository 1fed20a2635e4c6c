//! The page of a comparison.

use crate::bars::{chip, memory, times};
use crate::data::{Comparison, PassChange, PassDifference, Picture, Radiance, Replicated, Variant, View};
use crate::direction::Direction;
use crate::html::{
    base64, data_uri, definitions, escape, fill, interval, json, mebibytes, number, pairs_line, parameters, signed_percent, with_unit,
};
use crate::light::light_box;
use crate::metric::Metric;
use crate::radiance;
use crate::tiles::WhereMap;
use crate::verdict::{FRAME, Verdict, fault, leaders, metric_names, verdict};

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
/// On top stands a verdict: the variant that is shown to be better by FLIP where that is there, else by relative MSE, else by RMSE, else by the first metric; the faster
/// one; and where in the picture which one is closer to the reference. Differences within the noise are ties and called so. A picture that cannot be decoded leaves a hole
/// in the page and is named on top of it.
pub fn comparison_page(comparison: &Comparison) -> String {
    let verdict = verdict(comparison);
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"quiet\">{}</p>\n{}\n",
        escape(&comparison.title),
        escape(&comparison.device.name),
        verdict_box(comparison, &verdict)
    );
    body.push_str(&format!("<h2>Quality and cost</h2>\n{}\n", metrics_table(comparison)));
    body.push_str(VIEWER);
    body.push_str(&format!("<h2>Time of each pass</h2>\n<p class=\"quiet\">Bars: median on the device, in milliseconds, all on one scale; the dark line runs from the 5th to the 95th percentile of frames. In brackets the 95 % interval of the median over rounds. Lower is better.</p>\n{}\n", times(comparison)));
    body.push_str(&format!("<h2>Memory of each pass</h2>\n<p class=\"quiet\">On the device, in mebibytes (1 MiB = 1 048 576 bytes), all on one scale. Lower is better.</p>\n{}\n", memory(comparison)));
    body.push_str(&format!("<h2>Where the passes differ</h2>\n{}\n", differences_table(&comparison.differences)));
    body.push_str(&format!("<h2>Settings, and what was pruned</h2>\n<div class=\"columns\">{}</div>\n", settings(&comparison.variants)));
    body.push_str(&format!("<h2>All pictures</h2>\n<p class=\"quiet\">Relative error from 0.1 % (black) to 100 % (yellow), logarithmic; FLIP, HDR from 0 (black) to 1 (yellow).</p>\n{}\n", gallery(comparison)));
    whole_page(&escape(&comparison.title), &body, &json(comparison))
}

fn verdict_box(comparison: &Comparison, verdict: &Verdict) -> String {
    let sentences: String = verdict.sentences.iter().map(|sentence| format!("<li>{}</li>", escape(sentence))).collect();
    let reference = radiance_picture("reference", &comparison.reference.picture, "Reference picture");
    let (faults, scene, command) = (faults(comparison), definitions(&facts(comparison)), escape(&comparison.command));
    let light = comparison.light.as_ref().map(|light| light_box(light, "Which light is compared")).unwrap_or_default();
    let (overlay, caption) = match comparison.map.as_ref().filter(|map| map.is_whole(comparison.variants.len())) {
        Some(map) => (overlay(map, comparison), legend(map, comparison)),
        None => (String::new(), "Reference".to_owned()),
    };
    format!(
        "<section class=\"verdict\" aria-labelledby=\"verdict\"><div><h2 id=\"verdict\">{}</h2><ul>{sentences}</ul>{faults}{light}<h3>Scene and command</h3>{scene}<pre><code>{command}</code></pre></div><figure><div class=\"where\">{reference}{overlay}</div><figcaption>{caption}</figcaption></figure></section>",
        escape(&verdict.headline)
    )
}

/// What was rendered and how, in words.
fn facts(comparison: &Comparison) -> Vec<(String, String)> {
    let (scene, settings, reference) = (&comparison.scene, &comparison.settings, &comparison.reference);
    let [width, height] = settings.size;
    let light = match (&reference.file, &reference.paths) {
        (Some(file), _) => file.clone(),
        (None, Some(paths)) => {
            let depth = reference.depth.map_or_else(String::new, |depth| format!(", up to {depth} scattering events"));
            let samples = reference.samples_per_pixel.map_or_else(String::new, |samples| format!(", {samples} samples per pixel"));
            // The light of `only` has a box of its own.
            let paths = if paths == "only" { "light as above" } else { paths };
            format!("path-traced ({paths}{depth}){samples}")
        }
        (None, None) => "of unknown origin".to_owned(),
    };
    let noise = match reference.relative_noise {
        Some(noise) => format!("its own noise makes a relative MSE of {}", number(noise)),
        None => "its noise is not known and counts as none".to_owned(),
    };
    let over = match comparison.replication {
        Replicated::Groups { count } => format!("{count} groups of the samples"),
        Replicated::Seeds { count } => format!("{count} pictures with other seeds"),
    };
    let times = if settings.rounds > 1 {
        format!("{}; {} rounds in turn, the first not counted", comparison.device.timing.words(), settings.rounds)
    } else {
        format!("{}; one round", comparison.device.timing.words())
    };
    let mut facts = vec![
        ("scene", scene.address.clone()),
        ("camera", scene.camera.clone().unwrap_or_else(|| "the first".to_owned())),
        ("size", format!("{width} x {height} pixels")),
        ("samples", format!("{} per pixel, seed {}", settings.samples, settings.seed)),
        ("triangles", scene.triangles.to_string()),
        ("lights", format!("{} without extent, {} with extent", scene.punctual_lights, scene.area_lights)),
        ("distribution of normals", scene.ndf.clone()),
        ("reference", format!("{light}; {noise}")),
        ("intervals", format!("95 %, over {over} and the noise of the reference; of times over rounds")),
        ("times", times),
    ];
    if let Some(sequence) = &settings.sequence {
        facts.push(("sequence", sequence.words(scene.time)));
    }
    facts.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Pictures that are not what they should be, in words.
fn faults(comparison: &Comparison) -> String {
    let mut items = String::new();
    let mut say = |words: String, fault: String| items.push_str(&format!("<li class=\"fault\">{} {fault}</li>", escape(&words)));
    let hole =
        |picture: &Radiance| radiance::png(picture).is_none().then(|| "has no pixels, or another number than its size says".to_owned());
    let mut look = |words: String, fault: Option<String>| {
        if let Some(fault) = fault {
            say(words, fault);
        }
    };
    look("The reference picture".to_owned(), hole(&comparison.reference.picture));
    for variant in &comparison.variants {
        look(format!("The picture of “{}”", variant.name), hole(&variant.picture));
        look(format!("The relative error map of “{}”", variant.name), fault(&variant.error));
        if let Some(flip) = &variant.flip {
            look(format!("The FLIP map of “{}”", variant.name), fault(flip));
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
    if chips.is_empty() {
        return "Reference. No tint: nowhere is one of them shown to be visibly closer to it.".to_owned();
    }
    format!("Reference, tinted with the variant that is visibly closer to it: {}. No tint: no lead is shown.", chips.join(" "))
}

/// A map as an image.
fn img(id: &str, picture: &Picture, alt: &str) -> String {
    format!(
        "<img id=\"{id}\" width=\"{}\" height=\"{}\" alt=\"{}\" src=\"{}\">",
        picture.width,
        picture.height,
        escape(alt),
        data_uri(picture)
    )
}

/// A picture of radiance: the image that holds it, which is not shown, and the canvas that the script draws it on at the chosen exposure.
fn radiance_picture(key: &str, picture: &Radiance, alt: &str) -> String {
    let (width, height, alt) = (picture.width, picture.height, escape(alt));
    let held = radiance::png(picture).map_or_else(String::new, |png| {
        format!(
            "<img id=\"radiance-{key}\" hidden width=\"{width}\" height=\"{}\" alt=\"{alt}, encoded radiance\" src=\"{}\">",
            2 * height,
            base64(&png)
        )
    });
    format!(
        "{held}<canvas id=\"picture-{key}-picture\" width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{alt}\"></canvas><noscript><p>The pictures need a script to be drawn; they lie beside this page as EXR files.</p></noscript>"
    )
}

/// One row of the table: a measure, and for each variant its value and interval.
struct Row {
    head: String,
    floor: String,
    /// Value and interval.
    cells: Vec<(String, Option<String>)>,
    /// The best, and those that it is not shown to be better than.
    leaders: Vec<usize>,
}

fn metric_row(comparison: &Comparison, name: &str) -> Row {
    let direction = Direction::of(name).words();
    let head = match Metric::of(name) {
        Some(metric) => {
            let unit = if metric.unit.is_empty() { String::new() } else { format!(" [{}]", metric.unit) };
            format!(
                "<strong>{}</strong>{}<small>{direction}; {}</small><small>{} <cite>{}</cite></small>",
                escape(metric.title),
                escape(&unit),
                escape(metric.range),
                escape(metric.meaning),
                escape(metric.source)
            )
        }
        None => format!("<strong>{}</strong><small>{direction}</small>", escape(name)),
    };
    let cells = comparison.variants.iter().map(|variant| match variant.metrics.get(name) {
        Some(found) => (number(found.value), interval(found.low, found.high)),
        None => ("not measured".to_owned(), None),
    });
    let floor = comparison.reference.floor.get(name).map_or_else(String::new, |floor| number(*floor));
    Row { head, floor, cells: cells.collect(), leaders: leaders(comparison, name) }
}

fn metrics_table(comparison: &Comparison) -> String {
    let variants = &comparison.variants;
    let mut rows: Vec<Row> = metric_names(comparison).iter().map(|name| metric_row(comparison, name)).collect();
    let frame = variants.iter().map(|variant| match &variant.frame_ms {
        Some(time) => (with_unit(time.median, "ms"), interval(time.low, time.high)),
        None => ("not measured".to_owned(), None),
    });
    rows.push(Row {
        head: "<strong>Frame time</strong> [ms]<small>lower is better</small><small>Median time of a frame on the device, one sub-pixel sample.</small>".to_owned(),
        floor: String::new(),
        cells: frame.collect(),
        leaders: leaders(comparison, FRAME),
    });
    let least = variants.iter().map(|variant| variant.bytes).min();
    rows.push(Row {
        head: "<strong>Memory</strong> [MiB]<small>lower is better</small><small>All resources of a frame on the device, shared memory counted once; exact.</small>".to_owned(),
        floor: String::new(),
        cells: variants.iter().map(|variant| (with_unit(mebibytes(variant.bytes), "MiB"), None)).collect(),
        // What is exact still ties below 1 %.
        leaders: (0..variants.len()).filter(|&index| least.is_some_and(|least| variants[index].bytes as f64 <= 1.01 * least as f64)).collect(),
    });
    let heads: String =
        variants.iter().enumerate().map(|(index, variant)| format!("<th scope=\"col\">{}</th>", chip(index, &variant.name))).collect();
    let has_floor = rows.iter().any(|row| !row.floor.is_empty());
    let mut html = String::new();
    for row in rows {
        html.push_str(&format!("<tr><th scope=\"row\">{}</th>", row.head));
        for (index, (value, interval)) in row.cells.iter().enumerate() {
            let small = interval.as_ref().map_or_else(String::new, |interval| format!("<small>{interval}</small>"));
            let value = match row.leaders.as_slice() {
                // Where all are equal, none stands out.
                leaders if variants.len() < 2 || !leaders.contains(&index) => value.clone(),
                [_] => format!("<span class=\"best\">★ {value}<span class=\"hidden\"> (best)</span></span>"),
                _ => format!("<span class=\"tie\">≈ {value}<span class=\"hidden\"> (tie)</span></span>"),
            };
            html.push_str(&format!("<td class=\"number\">{value}{small}</td>"));
        }
        if has_floor {
            html.push_str(&format!("<td class=\"number quiet\">{}</td>", row.floor));
        }
        html.push_str("</tr>");
    }
    let floor = if has_floor { "<th scope=\"col\">Perfect picture<small>for the noise of the reference</small></th>" } else { "" };
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Quality and cost\"><table class=\"metrics\"><caption class=\"hidden\">Metrics of each variant; ★ marks the best, ≈ a tie for it</caption><thead><tr><th scope=\"col\">Measure</th>{heads}{floor}</tr></thead><tbody>{html}</tbody></table></div><p class=\"quiet\">★ marks the best of a row, ≈ those between which no difference is shown: it lies within the noise (99 % interval of the paired difference), or is below 1 % (2 % of times). Small figures are 95 % intervals.</p>"
    )
}

fn differences_table(differences: &[PassDifference]) -> String {
    if differences.is_empty() {
        return "<p>No pass differs.</p>".to_owned();
    }
    let ms = |time: Option<f64>| time.map_or_else(String::new, |ms| with_unit(ms, "ms"));
    let rows: String = differences
        .iter()
        .map(|difference| {
            let kind = |kind: &Option<String>| kind.as_deref().unwrap_or("unknown").to_owned();
            let what = match difference.what {
                PassChange::OnlyA => format!("only in the first ({})", kind(&difference.a_kind)),
                PassChange::OnlyB => format!("only in the second ({})", kind(&difference.b_kind)),
                PassChange::Kind => format!("{} instead of {}", kind(&difference.b_kind), kind(&difference.a_kind)),
                PassChange::Parameters => "other parameters".to_owned(),
            };
            let change = difference.a_ms.zip(difference.b_ms).map_or_else(String::new, |(a, b)| signed_percent(b / a - 1.0));
            format!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td>{} {}</td><td>{} {}</td><td class=\"number\">{change}</td></tr>",
                escape(&difference.pass),
                escape(&what),
                escape(&difference.a),
                ms(difference.a_ms),
                escape(&difference.b),
                ms(difference.b_ms),
            )
        })
        .collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Where the passes differ\"><table><thead><tr><th scope=\"col\">Pass</th><th scope=\"col\">What</th><th scope=\"col\">First</th><th scope=\"col\">Second</th><th scope=\"col\">Change of time<small>of the first; medians</small></th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

/// A tone curve and its exposure, in words.
fn tone(view: &View) -> String {
    let curve = match view.curve.as_str() {
        "aces" => "ACES",
        "agx" => "AgX",
        "none" => "none (cut off above 1)",
        other => other,
    };
    format!("{curve}, {}{} stops", if view.exposure >= 0.0 { "+" } else { "" }, number(view.exposure))
}

fn settings(variants: &[Variant]) -> String {
    variants
        .iter()
        .enumerate()
        .map(|(index, variant)| {
            let pruned: String = if variant.pruned.is_empty() {
                "<p class=\"quiet\">Nothing was pruned.</p>".to_owned()
            } else {
                let items =
                    variant.pruned.iter().map(|one| format!("<li><strong>{}</strong>: {}</li>", escape(&one.pass), escape(&one.reason)));
                format!("<p>Pruned:</p><ul>{}</ul>", items.collect::<String>())
            };
            let mut facts = vec![("compared".to_owned(), variant.output.clone())];
            facts.extend(variant.tone.as_ref().map(|view| ("the graph's tone curve".to_owned(), tone(view))));
            facts.push(("pipelines compiled in".to_owned(), with_unit(variant.compile_seconds, "s")));
            let passes = variant.passes.iter().map(|pass| (format!("{} ({})", pass.name, pass.kind), parameters(&pass.parameters)));
            facts.extend(passes.filter(|(_, parameters)| !parameters.is_empty()).map(|(name, found)| (name, pairs_line(&found))));
            format!("<div><h3>{}</h3>{}{pruned}</div>", chip(index, &variant.name), definitions(&facts))
        })
        .collect()
}

fn gallery(comparison: &Comparison) -> String {
    let mut figures = String::new();
    for (index, variant) in comparison.variants.iter().enumerate() {
        let picture = radiance_picture(&index.to_string(), &variant.picture, &format!("Picture of {}", variant.name));
        figures.push_str(&format!("<figure>{picture}<figcaption>Picture: {}</figcaption></figure>", chip(index, &variant.name)));
        for (kind, words, map) in [("error", "Relative error", Some(&variant.error)), ("flip", "FLIP, HDR", variant.flip.as_ref())] {
            if let Some(map) = map {
                let image = img(&format!("picture-{index}-{kind}"), map, &format!("{words} of {}", variant.name));
                figures.push_str(&format!("<figure>{image}<figcaption>{words}: {}</figcaption></figure>", chip(index, &variant.name)));
            }
        }
    }
    format!("<div class=\"gallery\">{figures}</div>")
}
