//! `lobelia reference`, `compare` and `sweep` as a user runs them: killed, resumed, shared out, with failing runs and folders that cannot be written.
#![allow(clippy::unwrap_used)]

use lobelia::measure::{read_exr, relative_mse};
use lobelia::report::{Better, Comparison, Replicated, Sweep};
use lobelia_tests::{has_gpu, program, root};
use serde_json::Value;
use std::{
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

/// A folder with a cache of references of its own.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn command(&self, arguments: &str) -> Command {
        let graphs = root().join("graphs");
        let mut command = Command::new(program());
        command
            .args(arguments.split_whitespace().map(|word| word.replace("GRAPHS", &graphs.display().to_string())))
            .current_dir(self.0.path())
            .env("LOBELIA_CACHE", self.0.path().join("cache"))
            .env_remove("LOBELIA_LOG");
        command
    }

    fn run(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Runs, and gives what was printed; fails with the errors if the command does.
    fn good(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments}\n{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    }

    /// Runs, expects the exit code, and gives the errors.
    fn bad(&self, arguments: &str, code: i32) -> String {
        let output = self.run(arguments);
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{arguments}\n{errors}");
        assert!(!errors.contains("panicked"), "{errors}");
        errors
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_str(&std::fs::read_to_string(self.path(name)).unwrap()).unwrap()
    }

    fn rows(&self, folder: &str) -> Vec<Value> {
        let text = std::fs::read_to_string(self.path(folder).join("rows.jsonl")).unwrap();
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

const REFERENCE: &str = "reference --scene builtin:cornell-glossy --size 32x32 --paths full --seed 5 --checkpoint 0.1";

#[test]
fn a_killed_reference_goes_on_to_the_same_picture() {
    let place = Place::new();
    place.good(&format!("{REFERENCE} --spp 2048 --threads 1 -o whole.exr -q"));
    // Killed after the first checkpoint, on another number of threads.
    let mut child = place.command(&format!("{REFERENCE} --spp 2048 --threads 2 -o part.exr -q")).stderr(Stdio::null()).spawn().unwrap();
    let begin = Instant::now();
    while !place.path("part.checkpoint").exists() && begin.elapsed() < Duration::from_secs(120) {
        if child.try_wait().unwrap().is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // A machine that is done before it is killed leaves no checkpoint; the picture must then be there.
    let killed = place.path("part.checkpoint").exists();
    assert!(killed || place.path("part.exr").exists());
    let output = place.run(&format!("{REFERENCE} --spp 2048 -o part.exr"));
    assert!(output.status.success());
    assert!(!killed || String::from_utf8_lossy(&output.stderr).contains("going on from"), "{output:?}");
    for name in ["exr", "variance.exr"] {
        let bytes = |stem: &str| std::fs::read(place.path(&format!("{stem}.{name}"))).unwrap();
        assert_eq!(bytes("whole"), bytes("part"), "{name}");
    }
    assert!(!place.path("part.checkpoint").exists());
}

#[test]
fn a_reference_stops_at_its_error_and_refuses_what_is_not_its_own() {
    let place = Place::new();
    let text = place.good(&format!("{REFERENCE} --error 0.5 -o a.exr"));
    assert!(text.contains("estimated relative error"), "{text}");
    let samples: u32 = text.split('(').nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((64..2048).contains(&samples), "{text}");
    std::fs::write(place.path("b.checkpoint"), "not a checkpoint").unwrap();
    assert!(place.bad(&format!("{REFERENCE} -o b.exr"), 2).contains("b.checkpoint"));
    for (arguments, message) in [
        ("reference --scene builtin:cornell-glossy -o a.png", "a.png"),
        ("reference --scene builtin:cornell-glossy -o no/such/a.exr", "does not exist"),
        ("reference --scene builtin:cornell-glossy --spp 0 -o a.exr", "--spp"),
        ("reference --scene builtin:cornell-glossy --error 0 -o a.exr", "--error"),
        ("reference --scene builtin:cornell-glossy --error nan -o a.exr", "--error"),
        ("reference --scene builtin:cornell-glossy --camera nobody -o a.exr", "nobody"),
        ("reference --scene builtin:cornell-glossy --paths some -o a.exr", "one-bounce"),
        ("reference --scene builtin:nothing -o a.exr", "nothing"),
    ] {
        assert!(place.bad(arguments, 2).contains(message), "{arguments}: {}", place.bad(arguments, 2));
    }
}

const COMPARE: &str = "compare GRAPHS/indirect.ron:vpl GRAPHS/indirect.ron:no-visibility --scene builtin:cornell-glossy --size 48x48 --samples 4 --rounds 2 \
    --set lights.count=64 --set rsm.resolution=128 --reference-error 0.4";

#[test]
fn a_comparison_says_what_the_pictures_say() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    let text = place.good(&format!("{COMPARE} --report out"));
    assert!(text.contains("indirect:no-visibility") && text.contains("relative_mse"), "{text}");
    let report = place.json("out/report.json");
    let truth = read_exr(&place.path("out/reference.exr")).unwrap();
    let variants = report["variants"].as_array().unwrap();
    assert_eq!(variants.len(), 2);
    // The file is what its structures say, and holds nothing else.
    let typed: Comparison = serde_json::from_value(report.clone()).unwrap();
    assert_eq!(serde_json::to_value(&typed).unwrap(), report);
    assert_eq!((typed.version, typed.settings.size, typed.settings.samples, typed.settings.rounds), (1, [48, 48], 4, 2));
    assert_eq!((typed.reference.paths.as_deref(), typed.reference.depth, typed.reference.file.as_deref()), (Some("only"), None, None));
    assert!(typed.light.is_some_and(|light| light.held.is_some_and(|held| !held.is_empty())));
    assert_eq!(typed.replication, Replicated::Groups { count: 4 });
    let floor = typed.reference.floor["relative_mse"];
    assert!(floor > 0.0 && (0.5..2.0).contains(&(floor / typed.reference.relative_noise.unwrap())), "{:?}", typed.reference);
    for (variant, file) in typed.variants.iter().zip(["indirect_vpl.exr", "indirect_no-visibility.exr"]) {
        let image = read_exr(&place.path("out").join(file)).unwrap();
        let said = variant.metrics["relative_mse"];
        assert!((said.value / relative_mse(&truth, &image).unwrap() - 1.0).abs() < 1e-9, "{file}: {said:?}");
        for (name, metric) in &variant.metrics {
            let (low, high) = (metric.low.unwrap(), metric.high.unwrap());
            assert!(low <= metric.value && metric.value <= high, "{name}: {metric:?}");
        }
        assert!(said.low.unwrap() < said.value && said.value < said.high.unwrap());
        assert!(variant.frame_ms.unwrap().median > 0.0 && variant.bytes > 0);
        let pass = variant.passes.iter().find(|pass| pass.name == "lights").unwrap();
        assert!(pass.gpu_ms.unwrap().median > 0.0 && pass.parameters["count"] == 64 && pass.kind == "vpl-lights", "{pass:?}");
        assert_eq!(variant.tone.as_ref().map(|tone| (tone.curve.as_str(), tone.exposure)), Some(("agx", 2.0)));
    }
    // Light through walls is worse than light with shadows.
    let error = |index: usize| typed.variants[index].metrics["relative_mse"].value;
    assert!(error(0) < error(1), "{} {}", error(0), error(1));
    // What differs is the visibility, and nothing else.
    let passes: Vec<&str> = report["differences"].as_array().unwrap().iter().map(|row| row["pass"].as_str().unwrap()).collect();
    assert_eq!(passes, ["visibility"]);
    let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
    assert!(
        page.contains("indirect:vpl") && page.contains("data:image/png;base64,") && !page.contains("http://") && !page.contains("https://")
    );
    // The truth is kept: a second comparison of the same scene traces nothing, and a file in its place gives the same numbers.
    let kept: Vec<_> =
        std::fs::read_dir(place.path("cache")).unwrap().map(|entry| entry.unwrap().metadata().unwrap().modified().unwrap()).collect();
    place.good(&format!("{COMPARE} --reference out/reference.exr --report again -q"));
    let again = place.json("again/report.json");
    // The noise of the reference lies beside it, so that intervals are the same, too, but for the digits that a file keeps.
    for (name, metric) in report["variants"][0]["metrics"].as_object().unwrap() {
        for part in ["value", "low", "high"] {
            let (now, then) = (again["variants"][0]["metrics"][name][part].as_f64().unwrap(), metric[part].as_f64().unwrap());
            assert!((now - then).abs() <= 1e-9 * then.abs(), "{name}.{part}: {now} {then}");
        }
    }
    place.good(&format!("{COMPARE} --report third -q"));
    let then: Vec<_> =
        std::fs::read_dir(place.path("cache")).unwrap().map(|entry| entry.unwrap().metadata().unwrap().modified().unwrap()).collect();
    assert_eq!((kept.len(), kept), (1, then));
}

/// A technique against itself is a tie in every metric, with many samples and with one, for which other seeds are rendered.
#[test]
fn a_technique_against_itself_is_a_tie() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    for (samples, replication) in [(1, Replicated::Seeds { count: 6 }), (5, Replicated::Groups { count: 5 })] {
        let text = place.good(&format!(
            "compare GRAPHS/indirect.ron:vpl GRAPHS/indirect.ron:vpl --scene builtin:cornell-glossy --size 24x24 --samples {samples} --rounds 2 \
             --set lights.count=16 --set rsm.resolution=64 --reference-error 0.5 --report out"
        ));
        let report: Comparison = serde_json::from_value(place.json("out/report.json")).unwrap();
        assert_eq!((report.replication, report.comparisons.len()), (replication, 10));
        assert!(report.comparisons.iter().all(|one| one.better == Better::Tie || one.metric == "frame_ms"), "{:?}", report.comparisons);
        let spread = report.variants[0].metrics["relative_mse"];
        assert!(spread.high.unwrap() > 1.001 * spread.value, "{spread:?}");
        assert!(text.contains("relative_mse: no difference is shown between indirect:vpl and indirect:vpl (2)"), "{text}");
        let page = std::fs::read_to_string(place.path("out/report.html")).unwrap();
        assert!(page.contains("No difference in accuracy is shown between “indirect:vpl” and “indirect:vpl (2)”"));
    }
}

#[test]
fn comparisons_that_cannot_be_made_end_in_words() {
    let place = Place::new();
    std::fs::write(place.path("file"), "").unwrap();
    std::fs::write(place.path("broken.exr"), "not a picture").unwrap();
    for (arguments, message) in [
        ("compare GRAPHS/indirect.ron:nothing --report out", "nothing"),
        ("compare no.ron --report out", "no.ron"),
        ("compare GRAPHS/indirect.ron --report file", "file"),
        ("compare GRAPHS/indirect.ron --reference broken.exr --report out", "broken.exr"),
        ("compare GRAPHS/indirect.ron --reference absent.exr --report out", "absent.exr"),
        ("compare GRAPHS/indirect.ron --output gbuffer.depth --report out --size 16x16", "gbuffer.depth"),
        ("compare GRAPHS/indirect.ron --reference-error 0 --report out", "--reference-error"),
        ("compare --report out", "GRAPH"),
    ] {
        let errors = place.bad(arguments, 2);
        assert!(errors.contains(message), "{arguments}: {errors}");
    }
    assert!(!place.path("out/report.html").exists());
}

const SWEEP: &str = r#"(graph: "GRAPH", scenes: ["builtin:cornell-diffuse"], variants: ["vpl", "no such variant", "no-visibility"],
    parameters: {"lights.count": [16, 64], "rsm.resolution": [64]}, seeds: [0, 1], size: (24, 24), samples: 2, rounds: 2, reference_error: 0.5)"#;

/// Rows by run, without the times.
fn timeless(mut rows: Vec<Value>) -> Vec<Value> {
    rows.sort_by_key(|row| row["cell"].as_u64());
    for row in &mut rows {
        let row = row.as_object_mut().unwrap();
        row.remove("ms");
        row.remove("round_ms");
        row.remove("passes");
    }
    rows
}

#[test]
fn a_sweep_survives_kills_and_failures_and_is_the_sum_of_its_shards() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    std::fs::write(place.path("s.ron"), SWEEP.replace("GRAPH", &root().join("graphs/indirect.ron").display().to_string())).unwrap();
    let text = place.good("sweep s.ron --report whole --target-error 10 --target-ms 0.000001");
    assert!(text.contains("cheapest with relative_mse at most 10: ") && text.contains("most accurate within 0.000001 ms: none"), "{text}");
    assert!(text.contains("4 of 12 runs failed"), "{text}");
    let whole = place.rows("whole");
    assert_eq!(whole.len(), 12);
    for row in &whole {
        let failed = row["failed"].as_str();
        assert_eq!(failed.is_some(), row["variant"] == "no such variant");
        assert!(failed.is_none_or(|message| message.contains("no such variant")));
        assert!(failed.is_some() || row["metrics"]["relative_mse"].as_f64().unwrap() > 0.0);
    }
    // Killed: the last line is cut, and two more are missing.
    let file = place.path("whole/rows.jsonl");
    let text = std::fs::read_to_string(&file).unwrap();
    let cut: Vec<&str> = text.lines().take(10).collect();
    let half = format!("{}\n", cut[..9].join("\n")) + &cut[9][..30];
    std::fs::create_dir(place.path("killed")).unwrap();
    std::fs::copy(place.path("whole/sweep.json"), place.path("killed/sweep.json")).unwrap();
    std::fs::write(place.path("killed/rows.jsonl"), half).unwrap();
    place.good("sweep s.ron --report killed -q");
    let resumed = place.rows("killed");
    assert_eq!(timeless(resumed.clone()), timeless(whole.clone()));
    // What was there was not run again: its times are the old ones.
    assert_eq!(resumed[..9], whole[..9]);
    for shard in ["1/3", "2/3", "3/3"] {
        place.good(&format!("sweep s.ron --report shard{} --shard {shard} -q", &shard[..1]));
    }
    place.good("sweep --merge shard1 shard2 shard3 --report merged -q");
    assert_eq!(timeless(place.rows("merged")), timeless(whole));
    let output = place.run("sweep --merge shard1 shard3 --report two");
    assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains("4 of 12 runs are in none"), "{output:?}");
    let typed: Sweep = serde_json::from_value(place.json("merged/report.json")).unwrap();
    assert_eq!(serde_json::to_value(&typed).unwrap(), place.json("merged/report.json"));
    let good = typed.rows.iter().find(|row| row.failed.is_none()).unwrap();
    assert_eq!((typed.version, &good.parameters["lights.count"], good.round_ms.len()), (1, &Value::from(16), 1));
    assert!(good.floor.unwrap() > 0.0 && good.error.as_ref().unwrap().replicates.len() == 6, "{good:?}");
    let page = std::fs::read_to_string(place.path("merged/report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("no such variant") && page.contains("lights.count"));
}

#[test]
fn sweeps_that_cannot_be_run_end_in_words() {
    let place = Place::new();
    std::fs::write(place.path("bad.ron"), "(graph: \"g.ron\",\n scenes: 3)").unwrap();
    std::fs::write(place.path("s.ron"), r#"(graph: "absent.ron", scenes: ["builtin:cornell-diffuse"])"#).unwrap();
    for (arguments, code, message) in [
        ("sweep bad.ron --report out", 2, "bad.ron:2:"),
        ("sweep absent.ron --report out", 2, "absent.ron"),
        ("sweep s.ron --report out --shard 3/2", 2, "--shard"),
        ("sweep --merge nowhere --report out", 1, "nowhere"),
        ("sweep --report out", 2, "SWEEP.ron"),
    ] {
        let errors = place.bad(arguments, code);
        assert!(errors.contains(message), "{arguments}: {errors}");
    }
    // A graph that cannot be read fails in its row.
    place.good("sweep s.ron --report rows -q");
    assert!(place.rows("rows")[0]["failed"].as_str().unwrap().contains("absent.ron"));
    // The folder of another sweep is left alone.
    std::fs::write(place.path("t.ron"), r#"(graph: "other.ron", scenes: ["builtin:cornell-diffuse"])"#).unwrap();
    assert!(place.bad("sweep t.ron --report rows", 2).contains("another sweep"));
}

/// What cannot be written ends in a message: here a folder stands where the rows belong.
#[test]
fn rows_that_cannot_be_written_end_in_a_message() {
    let place = Place::new();
    std::fs::write(place.path("s.ron"), r#"(graph: "absent.ron", scenes: ["builtin:cornell-diffuse"])"#).unwrap();
    place.good("sweep s.ron --report rows -q");
    std::fs::remove_file(place.path("rows/rows.jsonl")).unwrap();
    std::fs::create_dir(place.path("rows/rows.jsonl")).unwrap();
    assert!(place.bad("sweep s.ron --report rows -q", 1).contains("rows.jsonl"));
}

/// What is saved of a picture of several samples is their average, whatever the file.
#[test]
fn saved_radiances_are_averages() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    let saves = "--save direct.radiance=a.exr --save direct.radiance=a.npz";
    place.good(&format!("render GRAPHS/direct.ron --size 16x16 --samples 4 -q {saves}"));
    place.good("render GRAPHS/direct.ron --size 16x16 --samples 1 -q --save direct.radiance=one.npz");
    let picture = read_exr(&place.0.path().join("a.exr")).unwrap();
    let array = |name: &str| -> Vec<f32> {
        let mut file = npyz::npz::NpzArchive::open(place.0.path().join(name)).unwrap();
        let array = file.by_name("image").unwrap().unwrap();
        assert_eq!(array.shape(), [16, 16, 4]);
        array.into_vec().unwrap()
    };
    let off = |values: &[f32]| {
        let texels = values.chunks(4).zip(&picture.pixels);
        texels.flat_map(|(texel, pixel)| (0..3).map(|channel| (texel[channel] - pixel[channel]).abs())).fold(0.0f32, f32::max)
    };
    assert!(off(&array("a.npz")) == 0.0, "the two files differ by {}", off(&array("a.npz")));
    assert!(off(&array("one.npz")) > 0.0, "a single sample must not pass");
}
