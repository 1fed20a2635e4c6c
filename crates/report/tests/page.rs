//! Pages: what they hold, what they must not hold, and how they work in a browser.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::{ImageFormat, Rgb, RgbImage};
use lobelia_measure::sampled::{Replication, Sampled};
use lobelia_report::{
    Better, Clock, Compared, Comparison, Device, LeftOut, Light, LightPart, METRICS, Measurement, Missing, PassChange, PassCost,
    PassDifference, Picture, Pruned, Radiance, Reference, Replicated, SceneFacts, Settings, Sweep, SweepRow, TechniqueLight, Time, VERSION,
    Variant, View, WhereMap, comparison_page, sweep_page,
};

const NASTY: &str = "a<script>alert(1)</script>\"'&{{data}}";

const SIZE: (u32, u32) = (96, 54);

/// A map whose neighbouring pixels differ, so that one drawn in the wrong place is found.
fn picture(kind: u32) -> Picture {
    let (width, height) = SIZE;
    let pixels = RgbImage::from_fn(width, height, |x, y| Rgb([(x * 2) as u8, (y * 4) as u8, (kind * 40 + (x * 7 + y * 13) % 30) as u8]));
    let mut png = Cursor::new(Vec::new());
    pixels.write_to(&mut png, ImageFormat::Png).unwrap();
    Picture { width, height, png: png.into_inner() }
}

/// Radiance from a ten thousandth to a hundred in its first row, and neighbours that differ below.
fn radiance(kind: u32) -> Radiance {
    let (width, height) = SIZE;
    let value = |index: u32| {
        let (x, y) = (index % width, index / width);
        if y == 0 && x < 4 {
            return PATCHES[x as usize];
        }
        [x as f32 / 96.0, y as f32 / 54.0, (kind * 40 + (x * 7 + y * 13) % 30) as f32 / 255.0]
    };
    Radiance { width, height, pixels: (0..width * height).map(value).collect() }
}

/// What the first pixels hold: exact in eight bits of a shared exponent.
const PATCHES: [[f32; 3]; 4] = [[0.25, 0.125, 0.0625], [1.0, 0.5, 4.0], [0.0078125, 0.00390625, 0.0], [64.0, 32.0, 16.0]];

fn time(median: f64) -> Time {
    Time { median, low: Some(median * 0.97), high: Some(median * 1.02), p5: median * 0.9, p95: median * 1.2, rounds: 4 }
}

fn pass(name: &str, median_ms: f64, bytes: u64) -> PassCost {
    let parameters = serde_json::json!({"lobes": 17, "clamp": null, "kind": "wide", "scale": 0.1f32});
    PassCost { name: name.to_owned(), kind: "gather".to_owned(), parameters, gpu_ms: Some(time(median_ms)), cpu_ms: Some(0.0437), bytes }
}

fn measured(value: f64) -> Measurement {
    Measurement { value, low: Some(0.95 * value), high: Some(1.06 * value) }
}

fn variant(name: &str, kind: u32, flip: f64, ms: f64) -> Variant {
    Variant {
        name: name.to_owned(),
        output: "sum.radiance".to_owned(),
        metrics: BTreeMap::from([("flip_hdr".to_owned(), measured(flip)), ("psnr".to_owned(), measured(-20.0 * flip.log10()))]),
        frame_ms: Some(time(ms)),
        bytes: 41_838_182,
        compile_seconds: 0.25,
        tone: Some(View { curve: "agx".to_owned(), exposure: 2.0 }),
        passes: vec![pass("G-buffer", ms * 0.31, 33_239_859), pass("gather", ms * 0.69, 8_587_837)],
        pruned: vec![Pruned { pass: "visibility".to_owned(), reason: "nothing reads its output".to_owned() }],
        picture: radiance(kind),
        error: picture(kind + 2),
        flip: Some(picture(kind + 4)),
    }
}

fn compared(metric: &str, better: Better) -> Compared {
    let (low, high) = (Some(0.01), Some(0.02));
    Compared { metric: metric.to_owned(), a: "near".to_owned(), b: "far".to_owned(), difference: 0.015, low, high, better }
}

fn map(closest: impl Fn(u32, u32) -> Option<usize>) -> WhereMap {
    let (columns, rows) = (12, 9);
    let closest: Vec<Option<usize>> = (0..columns * rows).map(|tile| closest(tile % columns, tile / columns)).collect();
    let distance = |variant: usize| closest.iter().map(|one| if *one == Some(variant) { 0.0 } else { 3.0 }).collect();
    WhereMap { columns, rows, distance: vec![distance(0), distance(1)], closest }
}

/// With an entry in every list.
fn light() -> Light {
    let what = LightPart { class: "area".to_owned(), scatterings: vec![1], words: "area lights".to_owned() };
    let missing = |technique: &str| Missing { technique: technique.to_owned(), what: what.clone(), share: Some(0.125) };
    Light {
        held: Some(vec![what.clone()]),
        techniques: vec![TechniqueLight { technique: "near".to_owned(), claim: vec![what.clone()], silent: vec!["fog".to_owned()] }],
        missing: vec![missing("near")],
        extra: vec![missing("far")],
        left_out: vec![LeftOut { what: what.clone(), share: Some(0.25) }],
    }
}

fn comparison() -> Comparison {
    Comparison {
        light: Some(light()),
        version: VERSION,
        title: "Two gathers".to_owned(),
        command: "lobelia compare --variants \"near,far\" <scene>".to_owned(),
        device: Device { name: "Some device".to_owned(), timing: Clock::Timestamps },
        scene: SceneFacts { address: "hall.glb".to_owned(), triangles: 12_345, ..SceneFacts::default() },
        settings: Settings { size: [96, 54], samples: 16, seed: 3, rounds: 5, sequence: None },
        reference: Reference {
            paths: Some("full".to_owned()),
            depth: Some(2),
            samples_per_pixel: Some(640),
            relative_noise: Some(0.00123),
            floor: BTreeMap::from([("flip_hdr".to_owned(), 0.00456)]),
            picture: radiance(0),
            ..Reference::default()
        },
        replication: Replicated::Groups { count: 8 },
        view: View { curve: "agx".to_owned(), exposure: 2.0 },
        variants: vec![variant("near", 1, 0.0312, 2.41), variant("far", 2, 0.0624, 1.37)],
        comparisons: vec![compared("flip_hdr", Better::A), compared("psnr", Better::A), compared("frame_ms", Better::B)],
        differences: vec![PassDifference {
            pass: "gather".to_owned(),
            a: "near".to_owned(),
            b: "far".to_owned(),
            what: PassChange::Kind,
            a_kind: Some("vpl_gather".to_owned()),
            b_kind: Some("vsgl_gather".to_owned()),
            a_ms: Some(1.0),
            b_ms: Some(0.732),
        }],
        map: Some(map(|x, _| (x < 6).then_some(0))),
    }
}

fn row(scene: &str, variant: &str, samples: u32, ms: f64, error: f64, failed: Option<&str>) -> SweepRow {
    let parameters = BTreeMap::from([("lights.samples".to_owned(), samples.into()), ("lights.kind".to_owned(), "wide".into())]);
    // Few digits, which JSON keeps to the last bit.
    let short = |value: f64| (value * 1e6).round() / 1e6;
    let replicates = [0.98, 1.02, 0.99, 1.01, 1.0].map(|factor| short(factor * error)).to_vec();
    SweepRow {
        scene: scene.to_owned(),
        variant: variant.to_owned(),
        parameters,
        seed: 3,
        ms,
        round_ms: if ms.is_finite() { [0.99, 1.0, 1.01, 1.0].map(|factor| short(factor * ms)).to_vec() } else { Vec::new() },
        error: error.is_finite().then_some(Sampled { value: error, replicates, replication: Replication::Repeats }),
        floor: Some(0.0004),
        failed: failed.map(str::to_owned),
    }
}

fn sweep() -> Sweep {
    Sweep {
        light: vec![("hall".to_owned(), light())],
        version: VERSION,
        title: "Samples".to_owned(),
        devices: vec!["Some device".to_owned()],
        rows: vec![
            row("hall", "near", 16, 1.11, 0.0911, None),
            row("hall", "near", 64, 3.33, 0.0222, None),
            row("hall", "far", 16, 2.22, 0.0955, None),
            row("yard", "near", 16, 1.55, 0.00091, None),
            row("yard", "near", 64, 4.44, 0.0, None),
            row("yard", "far", 16, f64::NAN, f64::NAN, Some("device lost <at> pass gather")),
        ],
        metric: "relative_mse".to_owned(),
        target_error: Some(0.05),
        target_ms: Some(2.0),
    }
}

/// The JSON element of a page, as a browser would cut it out.
fn data(page: &str) -> serde_json::Value {
    let start = page.find("<script type=\"application/json\" id=\"data\">").unwrap();
    let inside = page[start..].split_once('>').unwrap().1.split_once("</script>").unwrap().0;
    serde_json::from_str(inside).unwrap()
}

/// The page without its JSON and its script: what a reader sees.
fn seen(page: &str) -> &str {
    page.split_once("</main>").unwrap().0
}

/// The row of a measure in the table.
fn metric_row<'a>(page: &'a str, title: &str) -> &'a str {
    let table = page.split_once("<h2>Quality and cost</h2>").unwrap().1.split_once("</table>").unwrap().0;
    table.split("<tr>").find(|row| row.contains(&format!("<strong>{title}</strong>"))).unwrap()
}

#[test]
fn the_page_holds_every_variant_and_every_number() {
    let page = comparison_page(&comparison());
    let seen = seen(&page);
    let words = [
        "Two gathers",
        "Some device",
        "12345",
        "triangles",
        "lobes 17",
        "scale 0.1",
        "clamp none",
        "kind wide",
        "0.0312",
        "0.0296 to 0.0331",
        "0.0624",
        "0.00456",
        "30.1",
        "24.1",
        "2.41 ms",
        "2.34 to 2.46",
        "1.37 ms",
        "39.9 MiB",
        "31.7 MiB",
        "8.19 MiB",
        "0.747 ms",
        "1.66 ms",
        "0.945 ms",
        "0.425 ms",
        "CPU 0.0437 ms",
        "−26.8 %",
        "vsgl_gather instead of vpl_gather",
        "nothing reads its output",
        "640 samples per pixel",
        "95 %, over 8 groups of the samples",
        "AgX, +2.00 stops",
        "lobelia compare --variants &quot;near,far&quot; &lt;scene&gt;",
        "lower is better",
        "higher is better",
    ];
    for word in words {
        assert!(seen.contains(word), "the page does not show {word}");
    }
    for kind in ["picture", "error", "flip"] {
        for variant in 0..2 {
            assert!(seen.contains(&format!("id=\"picture-{variant}-{kind}\"")));
        }
    }
}

#[test]
fn every_metric_is_explained_where_it_stands() {
    let mut one = comparison();
    for metric in METRICS {
        one.variants[0].metrics.insert(metric.name.to_owned(), measured(0.5));
    }
    one.variants[0].metrics.insert("new_metric".to_owned(), measured(0.5));
    let page = comparison_page(&one);
    for metric in METRICS {
        let row = metric_row(&page, metric.title);
        for text in [metric.meaning, metric.source, metric.range, metric.unit] {
            assert!(row.contains(text), "{}: {text}", metric.name);
        }
        assert!(row.contains("is better"));
        assert!(!seen(&page).contains(&format!(">{}<", metric.name)), "{} is no name for people", metric.name);
    }
    assert!(metric_row(&page, "new_metric").contains("lower is better"));
}

#[test]
fn the_best_and_ties_are_marked_for_each_metric() {
    let mut one = comparison();
    let page = comparison_page(&one);
    assert!(metric_row(&page, "FLIP, HDR").contains("★ 0.0312") && !metric_row(&page, "FLIP, HDR").contains("★ 0.0624"));
    assert!(metric_row(&page, "PSNR").contains("★ 30.1") && metric_row(&page, "Frame time").contains("★ 1.37 ms"));
    assert!(!metric_row(&page, "Memory").contains('★') && metric_row(&page, "Memory").contains("≈"), "equal values are a tie");
    one.comparisons[0].better = Better::Tie;
    let page = comparison_page(&one);
    let row = metric_row(&page, "FLIP, HDR");
    assert!(row.contains("≈ 0.0312") && row.contains("≈ 0.0624") && !row.contains('★'), "{row}");
}

fn headline(comparison: &Comparison) -> String {
    let page = comparison_page(comparison);
    page.split_once("<h2 id=\"verdict\">").unwrap().1.split_once("</h2>").unwrap().0.to_owned()
}

#[test]
fn the_verdict_names_the_better_one_and_follows_what_is_shown() {
    let mut one = comparison();
    assert_eq!(headline(&one), "“near” is more accurate, “far” is faster");
    one.variants[0].frame_ms = Some(time(1.0));
    one.comparisons[2].better = Better::A;
    assert_eq!(headline(&one), "“near” is better: more accurate and faster");
    one.comparisons[2].better = Better::Tie;
    assert_eq!(headline(&one), "“near” is more accurate; no faster one is shown");
    one.comparisons[0].better = Better::Tie;
    assert_eq!(headline(&one), "No difference in accuracy is shown between “near” and “far”, nor in time");
    one.comparisons[2].better = Better::A;
    assert_eq!(headline(&one), "No difference in accuracy is shown between “near” and “far”; “near” is faster");
    assert!(comparison_page(&one).contains("By PSNR “near” is better than “far” (30.1"), "another metric tells them apart");
    // One round tells no noise, and no time.
    for variant in &mut one.variants {
        variant.frame_ms = Some(Time { low: None, high: None, ..time(1.0) });
    }
    assert_eq!(headline(&one), "No difference in accuracy is shown between “near” and “far”");
    assert!(comparison_page(&one).contains("who is faster is not said"));
    one.variants[0].frame_ms = None;
    assert_eq!(headline(&one), "No difference in accuracy is shown between “near” and “far”");
    one.variants[0].metrics.insert("flip_hdr".to_owned(), measured(f64::NAN));
    assert!(headline(&one).starts_with("“far”: FLIP, HDR 0.0624"), "NaN must not win");
}

#[test]
fn of_three_only_the_pairs_that_were_told_apart_are() {
    let mut one = comparison();
    one.variants.push(variant("third", 3, 0.0315, 1.38));
    one.map = None;
    let pair = |metric: &str, a: &str, b: &str, better: Better| Compared { a: a.to_owned(), b: b.to_owned(), ..compared(metric, better) };
    one.comparisons = vec![
        pair("flip_hdr", "near", "far", Better::A),
        pair("flip_hdr", "near", "third", Better::Tie),
        pair("flip_hdr", "far", "third", Better::B),
        pair("frame_ms", "near", "far", Better::B),
        pair("frame_ms", "near", "third", Better::B),
        pair("frame_ms", "far", "third", Better::Tie),
    ];
    assert_eq!(headline(&one), "No difference in accuracy is shown between “near” and “third”; “far” and “third” are faster");
    let page = comparison_page(&one);
    let row = metric_row(&page, "FLIP, HDR");
    assert!(row.contains("≈ 0.0312") && row.contains("≈ 0.0315") && !row.contains("≈ 0.0624") && !row.contains('★'), "{row}");
}

#[test]
fn what_speaks_against_the_verdict_is_said() {
    let mut one = comparison();
    one.comparisons[1].better = Better::B;
    one.variants[1].metrics.insert("psnr".to_owned(), measured(40.0));
    assert!(comparison_page(&one).contains("But by PSNR “far” is better than “near” (40.0"));
    // And that the reference is too noisy to tell.
    assert!(!comparison_page(&one).contains("The noise of the reference alone would make"));
    one.reference.floor.insert("flip_hdr".to_owned(), 0.02);
    assert!(comparison_page(&one).contains("The noise of the reference alone would make FLIP, HDR 0.0200"));
}

#[test]
fn the_verdict_says_where() {
    let mut one = comparison();
    one.map = Some(map(|x, y| match (x, y) {
        (0..4, 0..3) => Some(0),
        (8..12, 6..9) => Some(1),
        _ => None,
    }));
    let page = comparison_page(&one);
    let sentence = page.split("<li>").find(|item| item.starts_with("Visibly closer")).unwrap();
    assert!(sentence.contains("“near” in 11 %") && sentence.contains("most at the upper left"), "{sentence}");
    assert!(sentence.contains("“far” in 11 %") && sentence.contains("most at the lower right"), "{sentence}");
    assert_eq!(page.matches("<rect class").count(), 24);
    one.map = Some(map(|_, _| None));
    assert!(comparison_page(&one).contains("Nowhere in the picture is one of them shown"));
    // A map that does not go together with the variants is none.
    one.map.as_mut().unwrap().closest.pop();
    assert!(!comparison_page(&one).contains("Nowhere in the picture"));
}

#[test]
fn names_cannot_leave_their_place() {
    let mut one = comparison();
    one.title = NASTY.to_owned();
    one.variants[0].name = NASTY.to_owned();
    one.variants[0].passes[0].name = NASTY.to_owned();
    one.variants[0].pruned[0].reason = NASTY.to_owned();
    one.variants[0].metrics.insert(NASTY.to_owned(), measured(1.0));
    one.variants[0].passes[0].parameters = serde_json::json!({NASTY: NASTY});
    one.differences[0].b_kind = Some(NASTY.to_owned());
    one.scene.address = NASTY.to_owned();
    let mut other = sweep();
    other.title = NASTY.to_owned();
    other.metric = NASTY.to_owned();
    other.rows[0].parameters.insert(NASTY.to_owned(), NASTY.into());
    other.rows[0].scene = NASTY.to_owned();
    other.rows[0].variant = NASTY.to_owned();
    other.rows[5].failed = Some(NASTY.to_owned());
    for page in [comparison_page(&one), sweep_page(&other)] {
        assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert"));
        assert_eq!(page.matches("<script").count(), 2, "one element of data and one of script");
        assert_eq!(data(&page)["title"], NASTY);
    }
}

#[test]
fn the_page_fetches_nothing() {
    for page in [comparison_page(&comparison()), sweep_page(&sweep())] {
        assert!(page.contains("default-src 'none'"));
        for address in ["http://", "https://", "url(", "@import", "<link", "href=", "src=\"/", "fetch(", "XMLHttpRequest"] {
            assert!(!page.contains(address), "the page holds {address}");
        }
        for source in page.split("src=\"").skip(1) {
            assert!(source.starts_with("data:image/png;base64,"));
        }
    }
}

#[test]
fn the_json_inside_gives_the_data_back() {
    let mut one = comparison();
    one.variants[1].metrics.insert("flip_hdr".to_owned(), measured(f64::NAN));
    let value = data(&comparison_page(&one));
    assert_eq!(value["version"], 1);
    assert!(value["reference"]["picture"].get("pixels").is_none(), "pictures are in the page once");
    let back: Comparison = serde_json::from_value(value.clone()).unwrap();
    assert_eq!((back.variants[0].metrics["flip_hdr"], back.variants[0].picture.width), (measured(0.0312), 96));
    assert!(back.variants[1].metrics["flip_hdr"].value.is_nan());
    assert_eq!((&back.comparisons, &back.differences, &back.map), (&one.comparisons, &one.differences, &one.map));
    assert_eq!(serde_json::to_value(&back).unwrap(), value, "nothing is lost on the way");
    let sweep_value = data(&sweep_page(&sweep()));
    let back: Sweep = serde_json::from_value(sweep_value.clone()).unwrap();
    assert_eq!(back.rows[..5], sweep().rows[..5]);
    assert!(back.rows[5].ms.is_nan() && back.rows[5].failed.is_some());
    assert_eq!(serde_json::to_value(&back).unwrap(), sweep_value);
}

/// Every field of the JSON is in the documentation, and what it has there is a field.
#[test]
fn every_field_is_documented() {
    let docs = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/report.md")).unwrap();
    let mut one = comparison();
    one.settings.sequence = Some(lobelia_report::SequenceSettings {
        frames: 2,
        frames_per_second: 24.0,
        new_seeds: false,
        flicker_against: "truth".to_owned(),
        own_samples: None,
        reference_flicker: None,
    });
    let mut fields = std::collections::BTreeSet::new();
    // Names that are data, not fields.
    let open = ["metrics", "floor", "parameters"];
    collect(&serde_json::to_value(&one).unwrap(), &open, &mut fields);
    collect(&serde_json::to_value(sweep()).unwrap(), &open, &mut fields);
    assert!(fields.len() > 60, "{fields:?}");
    for field in &fields {
        assert!(docs.contains(&format!("`{field}`")), "docs/report.md does not say what {field} is");
    }
    for metric in METRICS {
        assert!(
            docs.contains(&format!("`{}`", metric.name)) && docs.contains(metric.title),
            "docs/report.md does not say what {} is",
            metric.name
        );
    }
}

fn collect(value: &serde_json::Value, open: &[&str], fields: &mut std::collections::BTreeSet<String>) {
    for (name, inside) in value.as_object().into_iter().flatten() {
        fields.insert(name.clone());
        if open.contains(&name.as_str()) {
            inside.as_object().into_iter().flatten().for_each(|(_, inside)| collect(inside, open, fields));
        } else {
            collect(inside, open, fields);
        }
    }
    value.as_array().into_iter().flatten().for_each(|inside| collect(inside, open, fields));
}

#[test]
fn the_sweep_page_answers_the_targets_and_lists_what_failed() {
    let page = sweep_page(&sweep());
    let seen = seen(&page);
    let words = [
        "<strong>hall</strong>: the cheapest with Relative MSE of at most 0.0500: near (lights.kind wide, lights.samples 64), 3.33 ms (3.29 to 3.37), Relative MSE 0.0222 (0.0212 to 0.0232)",
        "<strong>hall</strong>: the most accurate in at most 2.00 ms: near (lights.kind wide, lights.samples 16), 1.11 ms",
        "<strong>yard</strong>: the cheapest with Relative MSE of at most 0.0500: near (lights.kind wide, lights.samples 16), 1.55 ms",
        // Over both scenes: mean of 1.11 and 1.55 ms, geometric mean of 0.0911 and 0.00091.
        "<strong>All scenes</strong>: the cheapest with Relative MSE of at most 0.0500: near (lights.kind wide, lights.samples 16), 1.33 ms",
        "Relative MSE 0.00910",
        "device lost &lt;at&gt; pass gather",
        "1 of 6 runs failed",
        "Frame time [ms]",
        "Error: Relative MSE",
        "zero has no logarithm",
        "noise of the reference",
        // Points are named: numbers and what differs, on the front; the constant parameter is left out.
        "1: samples 16",
        "2: samples 64",
    ];
    for word in words {
        assert!(seen.contains(word), "the page does not show {word}");
    }
    assert_eq!(seen.matches("<figure>").count(), 3, "two scenes and both together");
    assert_eq!(seen.matches("role=\"img\"").count(), 3);
    let table = |what: &str| seen.split_once(&format!("aria-label=\"{what}: hall\"")).unwrap().1.split_once("</table>").unwrap().0;
    let front = table("Pareto front");
    assert!(front.contains("1.11 ms") && front.contains("3.33 ms") && !front.contains("2.22 ms"), "far is beaten");
    assert!(table("Other configurations").contains("2.22 ms") && table("Other configurations").contains(">3<"));
    let mut hopeless = sweep();
    hopeless.target_error = Some(1e-9);
    assert!(sweep_page(&hopeless).contains("<strong>hall</strong>: nothing reaches Relative MSE of at most 1.00·10⁻⁹"));
    // A target inside of an interval is not shown to be met.
    hopeless.target_error = Some(0.0223);
    assert!(sweep_page(&hopeless).contains("<strong>hall</strong>: nothing is shown to reach Relative MSE of at most 0.0223; near ("));
}

#[test]
fn intervals_are_bars_and_what_is_not_known_is_said() {
    let count = |sweep: &Sweep| sweep_page(sweep).matches("<polyline").count();
    let (with, mut without) = (sweep(), sweep());
    for row in &mut without.rows {
        row.round_ms.clear();
        row.error = row.error.as_ref().map(|error| Sampled::alone(error.value));
    }
    assert!(count(&with) >= count(&without) + 3 * 7, "{} {}", count(&with), count(&without));
    assert!(
        sweep_page(&without).contains("the noise of time or error is not known")
            && !sweep_page(&with).contains("the noise of time or error is not known")
    );
}

#[test]
fn empty_pages_are_pages() {
    let mut one = comparison();
    one.variants.clear();
    one.differences.clear();
    one.comparisons.clear();
    assert!(comparison_page(&one).contains("No metric to compare by"));
    let mut other = sweep();
    other.rows.clear();
    assert!(sweep_page(&other).contains("The sweep has no runs"));
    other.rows = vec![row("hall", "near", 1, 1.0, 1.0, Some("lost"))];
    assert!(sweep_page(&other).contains("No configuration ended"));
}

#[test]
fn a_picture_that_is_not_what_it_says_is_named() {
    assert!(!comparison_page(&comparison()).contains("class=\"fault\""));
    let mut one = comparison();
    one.variants[1].error.width = 95;
    one.variants[1].flip.as_mut().unwrap().png.truncate(300);
    let page = comparison_page(&one);
    assert!(page.contains("The relative error map of “far” is 96 x 54 pixels, not 95 x 54"));
    assert!(page.contains("The FLIP map of “far” is not a whole PNG file"));
    assert_eq!(page.matches("class=\"fault\"").count(), 2);
    one.variants[0].picture.pixels.pop();
    assert!(comparison_page(&one).contains("The picture of “near” has no pixels, or another number than its size says"));
}

fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name))).find(|file| file.is_file())
}

/// What the page says of itself in a browser, and what the browser wrote on its console. None where there is no browser.
fn self_test(page: &str) -> Option<(serde_json::Value, String)> {
    self_test_at(page, 1280)
}

/// As [`self_test`], in a window of this width.
fn self_test_at(page: &str, width: u32) -> Option<(serde_json::Value, String)> {
    let Some(browser) = browser() else {
        assert!(std::env::var_os("LOBELIA_REQUIRE_BROWSER").is_none(), "LOBELIA_REQUIRE_BROWSER is set and there is no browser");
        eprintln!("skipped: no chromium, chromium-browser or google-chrome in PATH");
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    std::fs::write(&file, page).unwrap();
    let address = format!("file://{}#selftest", Path::new(&file).display());
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"])
        .args(["--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--enable-logging=stderr"])
        .arg(format!("--window-size={width},900"))
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .args(["--virtual-time-budget=5000", "--dump-dom", &address])
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout);
    let console: String = String::from_utf8_lossy(&output.stderr).lines().filter(|line| line.contains("CONSOLE")).collect();
    // The script holds the words as well; the element that it adds comes last.
    let inside = dom.rsplit_once("<output id=\"selftest\">").expect("the self-test did not end").1.split_once("</output>").unwrap().0;
    let text = inside.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    Some((serde_json::from_str(&text).unwrap(), console))
}

#[test]
fn the_comparison_works_in_a_browser() {
    let Some((result, console)) = self_test(&comparison_page(&comparison())) else { return };
    assert_eq!(result["ok"], true, "{result}");
    assert_eq!(result["images"], 7);
    assert_eq!(result["distinct"], 21, "the pictures must differ at all seven places of each of three layers: {result}");
    assert_eq!(result["inside"], true, "the table of metrics and costs does not fit 1280 pixels");
    assert_eq!(console, "");
    tones_are_those_of_the_library(&result);
}

/// Bytes of the first pixels of the reference under each curve and exposure, by the functions that the script has copies of.
fn tones_are_those_of_the_library(result: &serde_json::Value) {
    use lobelia_lobes::tonemap::{aces, agx, srgb_encode};
    let mut seen = std::collections::BTreeSet::new();
    for (curve, name) in ["agx", "aces", "none"].into_iter().enumerate() {
        for (place, exposure) in [-3.0f64, 0.0, 4.0].into_iter().enumerate() {
            for (pixel, patch) in PATCHES.into_iter().enumerate() {
                let exposed = glam::DVec3::from(patch.map(f64::from)) * exposure.exp2();
                let mapped = match name {
                    "aces" => aces(exposed),
                    "agx" => agx(exposed),
                    _ => exposed.clamp(glam::DVec3::ZERO, glam::DVec3::ONE),
                };
                for channel in 0..3 {
                    let expected = 255.0 * srgb_encode(mapped[channel]);
                    let found = result["tones"][curve][place][pixel][channel].as_f64().unwrap();
                    assert!((found - expected).abs() <= 1.0, "{name} {exposure} {patch:?}: {found}, not {expected}");
                    seen.insert(found as u8);
                }
            }
        }
    }
    assert!(seen.len() > 40, "the patches do not tell curves apart: {seen:?}");
}

#[test]
fn the_pages_fit_a_narrow_window() {
    for page in [comparison_page(&comparison()), sweep_page(&sweep())] {
        let Some((result, _)) = self_test_at(&page, 800) else { return };
        assert_eq!(result["ok"], true, "{result}");
    }
}

#[test]
fn names_full_of_markup_work_in_a_browser() {
    let mut one = comparison();
    one.variants[0].name = NASTY.to_owned();
    one.variants[1].flip = None;
    let Some((result, console)) = self_test(&comparison_page(&one)) else { return };
    assert_eq!(result["ok"], true, "{result}");
    assert_eq!(console, "");
}

#[test]
fn the_sweep_works_in_a_browser() {
    let Some((result, console)) = self_test(&sweep_page(&sweep())) else { return };
    assert_eq!((&result["ok"], &result["plots"]), (&true.into(), &3.into()), "{result}");
    assert_eq!(console, "");
}

#[test]
fn a_broken_picture_fails_in_a_browser() {
    // Broken in the page itself, behind the back of the look at the pictures.
    let page = comparison_page(&comparison());
    let (before, after) = page.split_once("id=\"picture-1-error\"").unwrap();
    let broken = format!("{before}id=\"picture-1-error\"{}", after.replacen("base64,iVBORw0KGgo", "base64,AAAAAAAAAAA", 1));
    let Some((result, _)) = self_test(&broken) else { return };
    assert_eq!(result["ok"], false);
    let failures = result["failures"].to_string();
    assert!(failures.contains("picture-1-error has not loaded") && !failures.contains("picture-0"), "{failures}");
}

#[test]
fn a_viewer_that_draws_the_wrong_side_fails_in_a_browser() {
    let page = comparison_page(&comparison());
    let swapped = page.replacen("drawPane(b, 0, edge, canvas.width)", "drawPane(a, 0, edge, canvas.width)", 1);
    assert_ne!(page, swapped);
    let Some((result, _)) = self_test(&swapped) else { return };
    assert_eq!(result["ok"], false);
    assert!(result["failures"].to_string().contains("wiped: the canvas holds"), "{result}");
}
