//! Pages: what they hold, what they must not hold, and how they work in a browser.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Command;

use image::{ImageFormat, Rgb, RgbImage};
use lobelia_report::{Comparison, PassCost, PassDifference, Picture, Sweep, SweepRow, Variant, comparison_page, sweep_page};

const NASTY: &str = "a<script>alert(1)</script>\"'&{{data}}";

/// A picture whose neighbouring pixels differ, so that a picture drawn in the wrong place is found.
fn picture(kind: u32) -> Picture {
    let (width, height) = (96, 54);
    let pixels = RgbImage::from_fn(width, height, |x, y| Rgb([(x * 2) as u8, (y * 4) as u8, (kind * 40 + (x * 7 + y * 13) % 30) as u8]));
    let mut png = Cursor::new(Vec::new());
    pixels.write_to(&mut png, ImageFormat::Png).unwrap();
    Picture { width, height, png: png.into_inner() }
}

fn pass(name: &str, median_ms: f64, mebibytes: f64) -> PassCost {
    PassCost { name: name.to_owned(), median_ms, p5_ms: median_ms * 0.9, p95_ms: median_ms * 1.2, mebibytes, cpu_ms: 0.0437 }
}

fn variant(name: &str, kind: u32, flip: f64, ms: f64) -> Variant {
    Variant {
        name: name.to_owned(),
        settings: vec![("gather.lobes".to_owned(), format!("{}17", kind))],
        metrics: BTreeMap::from([("FLIP".to_owned(), flip), ("PSNR [dB]".to_owned(), -20.0 * flip.log10())]),
        picture: picture(kind),
        error: picture(kind + 2),
        flip: Some(picture(kind + 4)),
        passes: vec![pass("G-buffer", ms * 0.31, 31.7), pass("gather", ms * 0.69, 8.19)],
        pruned: vec![("visibility".to_owned(), "nothing reads its output".to_owned())],
        total_ms: ms,
        total_mebibytes: 39.9,
    }
}

fn comparison() -> Comparison {
    Comparison {
        light: None,
        title: "Two gathers".to_owned(),
        device: "Some device".to_owned(),
        scene: vec![("triangles".to_owned(), "12 345".to_owned())],
        command: "lobelia compare --variants \"near,far\" <scene>".to_owned(),
        reference: picture(0),
        variants: vec![variant("near", 1, 0.0312, 2.41), variant("far", 2, 0.0624, 1.37)],
        differences: vec![PassDifference {
            pass: "gather".to_owned(),
            a: "near".to_owned(),
            b: "far".to_owned(),
            change: -0.268,
            what: "radiance".to_owned(),
        }],
    }
}

fn row(scene: &str, variant: &str, samples: u32, ms: f64, error: f64, failed: Option<&str>) -> SweepRow {
    let parameters = vec![("samples".to_owned(), samples.to_string())];
    SweepRow { scene: scene.to_owned(), variant: variant.to_owned(), parameters, seed: 3, ms, error, failed: failed.map(str::to_owned) }
}

fn sweep() -> Sweep {
    Sweep {
        light: Vec::new(),
        title: "Samples".to_owned(),
        device: "Some device".to_owned(),
        rows: vec![
            row("hall", "near", 16, 1.11, 0.0911, None),
            row("hall", "near", 64, 3.33, 0.0222, None),
            row("hall", "far", 16, 2.22, 0.0955, None),
            row("yard", "near", 16, 1.55, 0.00091, None),
            row("yard", "near", 64, 4.44, 0.0, None),
            row("yard", "far", 16, f64::NAN, f64::NAN, Some("device lost <at> pass gather")),
        ],
        metric: "relative MSE".to_owned(),
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

/// The first table cell row that starts with a variant's name.
fn metric_row<'a>(page: &'a str, name: &str) -> &'a str {
    let table = page.split_once("<h2>Quality and cost</h2>").unwrap().1.split_once("</table>").unwrap().0;
    table.split("<tr>").find(|row| row.contains(&format!(">{name}<"))).unwrap()
}

#[test]
fn the_page_holds_every_variant_and_every_number() {
    let page = comparison_page(&comparison());
    let seen = seen(&page);
    let words = [
        "Two gathers",
        "Some device",
        "12 345",
        "triangles",
        "117",
        "217",
        "0.0312",
        "0.0624",
        "30.1",
        "24.1",
        "2.41 ms",
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
        "nothing reads its output",
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
fn the_best_is_marked_for_each_metric() {
    let page = comparison_page(&comparison());
    let (near, far) = (metric_row(&page, "near"), metric_row(&page, "far"));
    assert!(near.contains("★ 0.0312") && near.contains("★ 30.1") && !near.contains("★ 2.41"));
    assert!(far.contains("★ 1.37 ms") && !far.contains("★ 0.0624") && !far.contains("★ 24.1"));
    assert!(!near.contains("★ 39.9") && !far.contains("★ 39.9"), "equal values must not be marked");
}

#[test]
fn the_verdict_names_the_better_one_and_follows_the_numbers() {
    let headline = |comparison: &Comparison| {
        let page = comparison_page(comparison);
        page.split_once("<h2 id=\"verdict\">").unwrap().1.split_once("</h2>").unwrap().0.to_owned()
    };
    let mut one = comparison();
    assert_eq!(headline(&one), "“near” is more accurate, “far” is faster");
    one.variants[0].total_ms = 1.0;
    assert_eq!(headline(&one), "“near” is better: more accurate and faster");
    one.variants[0].total_ms = f64::NAN;
    assert_eq!(headline(&one), "“near” is more accurate");
    one.variants[0].total_ms = 1.0;
    one.variants[0].metrics.insert("FLIP".to_owned(), 0.0623);
    assert_eq!(headline(&one), "“near” and “far” are equally accurate; “near” is the fastest");
    one.variants[0].metrics.insert("FLIP".to_owned(), f64::NAN);
    assert!(headline(&one).starts_with("“far”: FLIP 0.0624"), "NaN must not win");
}

#[test]
fn the_verdict_says_where() {
    let mut one = comparison();
    // "near" is the reference but for the lower right, "far" is the reference there only.
    let paint = |spoil: &dyn Fn(u32, u32) -> bool| {
        let mut pixels = image::load_from_memory(&picture(0).png).unwrap().to_rgb8();
        for (x, y, pixel) in pixels.enumerate_pixels_mut() {
            if spoil(x, y) {
                pixel.0[0] ^= 0x40;
            }
        }
        let mut png = Cursor::new(Vec::new());
        pixels.write_to(&mut png, ImageFormat::Png).unwrap();
        Picture { width: 96, height: 54, png: png.into_inner() }
    };
    one.variants[0].picture = paint(&|x, y| x >= 72 && y >= 40);
    one.variants[1].picture = paint(&|x, y| x < 48 && y < 20);
    let page = comparison_page(&one);
    let sentence = page.split("<li>").find(|item| item.starts_with("Visibly closer")).unwrap();
    assert!(sentence.contains("“near” in") && sentence.contains("most at the upper left"), "{sentence}");
    assert!(sentence.contains("“far” in") && sentence.contains("most at the lower right"), "{sentence}");
    assert!(page.contains("What is left of the error of “near” is largest at the lower right"));
    one.variants[1].picture = one.variants[0].picture.clone();
    assert!(comparison_page(&one).contains("Nowhere in the picture"));
}

#[test]
fn names_cannot_leave_their_place() {
    let mut one = comparison();
    one.title = NASTY.to_owned();
    one.variants[0].name = NASTY.to_owned();
    one.variants[0].passes[0].name = NASTY.to_owned();
    one.variants[0].pruned[0].1 = NASTY.to_owned();
    one.variants[0].metrics.insert(NASTY.to_owned(), 1.0);
    one.differences[0].what = NASTY.to_owned();
    let mut other = sweep();
    other.title = NASTY.to_owned();
    other.metric = NASTY.to_owned();
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
    one.variants[1].metrics.insert("FLIP".to_owned(), f64::NAN);
    let value = data(&comparison_page(&one));
    assert!(value["reference"].get("png").is_none(), "pictures are in the page once");
    let back: Comparison = serde_json::from_value(value).unwrap();
    assert_eq!((back.variants[0].metrics["FLIP"], back.variants[0].picture.width), (0.0312, 96));
    assert!(back.variants[1].metrics["FLIP"].is_nan());
    let back: Sweep = serde_json::from_value(data(&sweep_page(&sweep()))).unwrap();
    assert_eq!(back.rows[..5], sweep().rows[..5]);
    assert!(back.rows[5].ms.is_nan() && back.rows[5].failed.is_some());
}

#[test]
fn the_sweep_page_answers_the_targets_and_lists_what_failed() {
    let page = sweep_page(&sweep());
    let seen = seen(&page);
    let words = [
        "<strong>hall</strong>: the cheapest with relative MSE of at most 0.0500: near (samples 64), 3.33 ms, relative MSE 0.0222",
        "<strong>hall</strong>: the most accurate in at most 2.00 ms: near (samples 16), 1.11 ms, relative MSE 0.0911",
        "<strong>yard</strong>: the cheapest with relative MSE of at most 0.0500: near (samples 16), 1.55 ms, relative MSE 9.10·10⁻⁴",
        // Over both scenes: mean of 1.11 and 1.55 ms, geometric mean of 0.0911 and 0.00091.
        "<strong>All scenes</strong>: the cheapest with relative MSE of at most 0.0500: near (samples 16), 1.33 ms, relative MSE 0.00910",
        "device lost &lt;at&gt; pass gather",
        "1 of 6 runs failed",
        "Frame time [ms]",
        "Error: relative MSE",
        "zero has no logarithm",
    ];
    for word in words {
        assert!(seen.contains(word), "the page does not show {word}");
    }
    assert_eq!(seen.matches("<figure>").count(), 3, "two scenes and both together");
    assert_eq!(seen.matches("role=\"img\"").count(), 3);
    let front = seen.split_once("aria-label=\"Pareto front: hall\"").unwrap().1.split_once("</table>").unwrap().0;
    assert!(front.contains("1.11 ms") && front.contains("3.33 ms") && !front.contains("2.22 ms"), "far is beaten");
    let mut hopeless = sweep();
    hopeless.target_error = Some(1e-9);
    assert!(sweep_page(&hopeless).contains("<strong>hall</strong>: nothing reaches relative MSE of at most 1.00·10⁻⁹"));
}

#[test]
fn empty_pages_are_pages() {
    let mut one = comparison();
    one.variants.clear();
    one.differences.clear();
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
}

fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name))).find(|file| file.is_file())
}

/// What the page says of itself in a browser, and what the browser wrote on its console. None where there is no browser.
fn self_test(page: &str) -> Option<(serde_json::Value, String)> {
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
        .args([
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--enable-logging=stderr",
            "--window-size=1200,900",
        ])
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
    assert_eq!(console, "");
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
