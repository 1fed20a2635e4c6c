//! `lobelia compare --frames` as a user runs it: what flickers is told from what does not, and from what should change.
#![allow(clippy::unwrap_used)]

use lobelia::{Session, SessionOptions, Shot, graph::GraphFile, measure::Image};
use lobelia_tests::{has_gpu, program};
use serde_json::Value;
use std::process::{Command, Output};

const GRAPH: &str = r#"(
    passes: {
        "gbuffer": gbuffer(), "rsm": rsm(resolution: 64), "direct": direct(),
        "density": flux_density(), "lights": vpl_lights(count: 8), "indirect": vpl_gather(),
        "sum": compose(from: {"terms": ["direct.radiance", "indirect.radiance"]}),
    },
    output: "sum.radiance",
    variants: {"few": {}, "many": {"lights": vpl_lights(count: 1024)}, "direct": {"sum": compose(from: {"terms": "direct.radiance"})}},
)"#;

const MOVING: &str = r#"(
    gltf: "builtin:cornell-diffuse",
    light_motion: {"spot": [(seconds: 0, direction: (-0.5, -0.7, -0.5)), (seconds: 1, direction: (0.2, -0.9, -0.3))]},
)"#;

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [("g.ron", GRAPH), ("moving.ron", MOVING)] {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Self(folder)
    }

    fn run(&self, arguments: &str) -> Output {
        let mut command = Command::new(program());
        command.args(arguments.split_whitespace()).current_dir(self.0.path());
        command.env("LOBELIA_CACHE", self.0.path().join("cache")).env_remove("LOBELIA_LOG").output().unwrap()
    }

    /// Flicker by technique, the page's JSON, and what was printed.
    fn flicker(&self, arguments: &str) -> (Vec<f64>, Value, String) {
        let output = self.run(&format!("compare {arguments} --size 32x32 --samples 1 --rounds 2 --reference-spp 64 --report out"));
        assert!(output.status.success(), "{arguments}\n{}", String::from_utf8_lossy(&output.stderr));
        let json: Value = serde_json::from_str(&std::fs::read_to_string(self.0.path().join("out/report.json")).unwrap()).unwrap();
        let of = |variant: &Value| variant["metrics"]["temporal_error"]["value"].as_f64().unwrap();
        let found = json["variants"].as_array().unwrap().iter().map(of).collect();
        (found, json, String::from_utf8(output.stdout).unwrap())
    }
}

#[test]
fn what_flickers_is_told_from_what_is_steady() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    let all = "g.ron:few g.ron:many g.ron:direct --scene builtin:cornell-diffuse --frames 4";
    for against in ["own", "truth"] {
        let (found, ..) = place.flicker(&format!("{all} --new-seeds --flicker-against {against}"));
        let [few, many, direct] = found[..] else { panic!("{found:?}") };
        assert!(few > 0.02 && few > 4.0 * many && many > 0.0, "{against}: {found:?}");
        // Nothing random, nothing that moves.
        assert_eq!(direct, 0.0);
        // Frames that draw the same numbers are the same picture, but for where the clock cuts the sum over many lights.
        let (found, ..) = place.flicker(&format!("{all} --flicker-against {against}"));
        assert!(found.iter().all(|flicker| *flicker < 1e-6), "{against}: {found:?}");
    }
}

#[test]
fn what_moves_as_the_truth_does_is_no_flicker() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    let (found, json, text) =
        place.flicker("g.ron:direct g.ron:few --scene moving.ron --paths direct --frames 4 --fps 6 --time 0.1 --new-seeds");
    let [direct, few] = found[..] else { panic!("{found:?}") };
    assert!(direct < 0.06 && few > 1.5 * direct, "{found:?}");
    let sequence = &json["settings"]["sequence"];
    assert_eq!((&sequence["frames"], &sequence["frames_per_second"], &sequence["new_seeds"]), (&4.into(), &6.0.into(), &true.into()));
    assert_eq!((&sequence["flicker_against"], &sequence["own_samples"]), (&"truth".into(), &Value::Null));
    for said in ["4 frames, 6 per second, from 0.1 s", "path-traced frames", "random numbers of its own for each"] {
        assert!(text.contains(said), "{text}");
    }
    // Three steps tell the noise of the flicker.
    let flicker = &json["variants"][1]["metrics"]["temporal_error"];
    assert!(flicker["low"].as_f64().unwrap() < few && flicker["high"].as_f64().unwrap() > few, "{flicker}");
    // One picture has no flicker.
    let output = place.run("compare g.ron --scene moving.ron --size 8x8 --samples 1 --rounds 1 --reference-spp 4 --report one");
    assert!(output.status.success());
    assert!(!std::fs::read_to_string(place.0.path().join("one/report.json")).unwrap().contains("temporal_error"));
}

#[test]
fn frames_are_where_the_clock_is() {
    if !has_gpu() {
        return;
    }
    let place = Place::new();
    let graph = GraphFile::parse(GRAPH, "g.ron").unwrap();
    let picture = |time: f32, frames: u32, runs: u32| -> Image {
        let options = SessionOptions { baseline: true, time, ..SessionOptions::default() };
        let mut session = Session::new(place.0.path().join("moving.ron").to_str().unwrap(), &options).unwrap();
        let wired = graph.wire(&lobelia::registry(), &["direct".into()], &[]).unwrap();
        let shot = Shot { extent: [32, 32], frames, frame_seconds: 0.25, ..Shot::default() };
        let mut rendering = session.start(&wired, &shot).unwrap();
        (0..runs).map(|_| rendering.run(&mut |_| true).unwrap().image()).last().unwrap()
    };
    let last = picture(0.25, 3, 1);
    assert_eq!(picture(0.75, 1, 1), last);
    assert_ne!(picture(0.25, 1, 1), last);
    // A rendering that is run again begins where it began.
    assert_eq!(picture(0.25, 3, 2), last);
}

#[test]
fn what_makes_no_sense_is_refused() {
    let place = Place::new();
    std::fs::write(place.0.path().join("broken.ron"), MOVING.replace("seconds: 1", "seconds: 0")).unwrap();
    for (arguments, says) in [
        ("--fps 30", "--fps is about sequences"),
        ("--new-seeds", "--new-seeds is about sequences"),
        ("--flicker-against own", "--flicker-against is about sequences"),
        ("--frames 0", "0 is not in 1..=10000"),
        ("--frames 2 --fps 0", "`0` is no number of frames per second"),
        ("--frames 2 --fps nan", "`nan` is no number of frames per second"),
        ("--frames 2 --flicker-against nothing", "invalid value 'nothing'"),
        ("--frames 2 --reference truth.exr", "--reference truth.exr: is one picture"),
        ("--frames 2 --scene broken.ron", "broken.ron:3:"),
        ("--frames 2 --scene broken.ron", "key 2: seconds is 0, but must be more than that of the key before, 0"),
    ] {
        let output = place.run(&format!("compare g.ron {arguments} --report out"));
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments}\n{errors}");
        assert!(errors.contains(says), "{arguments}\n{errors}");
    }
}
