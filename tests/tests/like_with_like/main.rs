//! Like with like: the truth of a comparison holds the light that the graphs cast, and what is missing is said.
//!
//! The scene is a room with a screen in its middle: a spot lights the left of it, a lamp in the ceiling the right. No indirect technique casts the lamp's light; one
//! without visibility makes up for it by light that leaks through the screen.
#![allow(clippy::unwrap_used, missing_docs)]

use lobelia::{
    Session, SessionOptions, Shot,
    frame::{GBuffer, ImageShape, LightClass, LightTransport, Radiance, SceneWorld},
    graph::{
        BuildError, CreateContext, DeviceOf, Frame, GraphFile, InputShapes, NoParams, OutputShapes, Pass, PlanContext, PlanOptions,
        PortError, Ports, Registry, RunError,
    },
    light::{Claim, compare, truth_paths, uncast},
    measure::{mean, read_exr},
    reference::{LightPaths, Settings},
    scene::Scene,
    truth::truth,
};
use lobelia_tests::{has_gpu, program, root};
use serde_json::Value;
use std::{path::Path, process::Command};

const ROOM: &str = include_str!("room.gltf");

/// The room with the lamp as an area light of the same size and radiance.
fn room_with_area_light() -> String {
    let lamp = r#""mesh": 1, "translation": [1, 2.45, -0.5], "rotation": [1, 0, 0, 0], "scale": [0.6, 1, 0.6]"#;
    assert!(ROOM.contains(lamp));
    let light = r#""translation": [1, 2.45, -0.5], "rotation": [-0.7071067811865476, 0, 0, 0.7071067811865476],
        "extras": {"area_light": {"shape": "quad", "width": 0.6, "height": 0.6, "radiance": [6, 6, 6]}}"#;
    ROOM.replace(lamp, light)
}

fn load(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.gltf");
    std::fs::write(&file, text).unwrap();
    Session::load(file.to_str().unwrap(), &SessionOptions::default()).unwrap()
}

/// Runs the program in a folder that has both rooms; standard output and standard error.
fn run(folder: &Path, arguments: &str) -> (String, String, Option<i32>) {
    std::fs::write(folder.join("emissive.gltf"), ROOM).unwrap();
    std::fs::write(folder.join("area.gltf"), room_with_area_light()).unwrap();
    let graphs = root().join("graphs").display().to_string();
    let output = Command::new(program())
        .args(arguments.split_whitespace().map(|word| word.replace("GRAPHS", &graphs)))
        .current_dir(folder)
        .env("LOBELIA_CACHE", folder.join("cache"))
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (text(&output.stdout), text(&output.stderr), output.status.code())
}

fn good(folder: &Path, arguments: &str) -> (String, String) {
    let (out, errors, code) = run(folder, arguments);
    assert_eq!(code, Some(0), "{arguments}\n{errors}");
    (out, errors)
}

fn json(file: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

const COMPARE: &str = "compare GRAPHS/indirect.ron:vpl GRAPHS/indirect.ron:no-visibility --size 64x36 --samples 4 --rounds 1 --set lights.count=64 \
    --set rsm.resolution=128 --reference-error 0.2";

/// The sentence that the page begins with.
fn headline(folder: &Path) -> String {
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    let begin = page.split_once("id=\"verdict\">").unwrap().1;
    begin.split_once("</h2>").unwrap().0.to_owned()
}

#[test]
fn light_that_nobody_casts_decides_nothing_unless_it_is_asked_for() {
    if !has_gpu() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    for (scene, class, words) in [("emissive.gltf", "emissive", "emissive surfaces"), ("area.gltf", "area", "area lights")] {
        let errors = |report: &str| {
            let report = json(&folder.join(report).join("report.json"));
            let variants = report["variants"].as_array().unwrap().clone();
            [0, 1].map(|index| variants[index]["metrics"]["relative_mse"]["value"].as_f64().unwrap())
        };
        let (text, _) = good(folder, &format!("{COMPARE} --scene {scene} --report like"));
        let [exact, leaking] = errors("like");
        assert!(exact < 0.1 * leaking, "{scene}: {exact} {leaking}");
        assert!(headline(&folder.join("like")).starts_with("“indirect:vpl” is"), "{}", headline(&folder.join("like")));
        assert!(text.contains(&format!("punctual lights (direct light, one bounce), {words} (seen directly).")), "{text}");
        assert!(text.contains(&format!("Not compared, since no technique casts it: {words} (direct light, one bounce)")), "{text}");
        let light = &json(&folder.join("like/report.json"))["light"];
        assert_eq!(light["missing"].as_array().unwrap().len(), 0);
        assert_eq!(light["left_out"][0]["what"]["scatterings"], serde_json::json!([1, 2]));

        let (text, _) = good(folder, &format!("{COMPARE} --scene {scene} --report all --lights all"));
        assert!(text.contains(&format!("No technique casts {words} (direct light, one bounce): ")), "{text}");
        let light = &json(&folder.join("all/report.json"))["light"];
        let missing = light["missing"].as_array().unwrap();
        assert_eq!(missing.len(), 2);
        // The share is what the two truths differ by.
        let [like, all] = ["like", "all"].map(|report| {
            let image = read_exr(&folder.join(report).join("reference.exr")).unwrap();
            mean(&image).iter().sum::<f64>()
        });
        for (one, technique) in missing.iter().zip(["indirect:vpl", "indirect:no-visibility"]) {
            let share = one["share"].as_f64().unwrap();
            assert_eq!((one["technique"].as_str(), one["what"]["class"].as_str()), (Some(technique), Some(class)));
            assert!((share - (1.0 - like / all)).abs() < 0.03 && share > 0.1, "{share} {like} {all}");
        }
        let page = std::fs::read_to_string(folder.join("all/report.html")).unwrap();
        assert!(page.contains(&format!("No technique casts {words} (direct light, one bounce): ")));
    }
    // A file's light is not known.
    let (text, _) = good(folder, &format!("{COMPARE} --scene area.gltf --reference all/reference.exr --report file"));
    assert!(text.contains("which light it holds is not known") && text.contains("“indirect:vpl” casts punctual lights"), "{text}");
    // Only some paths, all lights: what is not there of both sides.
    let (text, _) = good(folder, &format!("{COMPARE} --scene area.gltf --paths direct --report direct"));
    assert!(text.contains("The truth holds punctual lights (direct light), area lights (direct light)."), "{text}");
    assert!(text.contains("No technique casts area lights (direct light): "), "{text}");
    assert!(text.contains("All techniques also cast punctual lights (one bounce), which the truth does not hold."), "{text}");
}

#[test]
fn settings_of_a_graph_are_techniques_of_their_own() {
    if !has_gpu() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let common = "--scene emissive.gltf --size 32x18 --samples 1 --rounds 1 --reference-spp 16";
    let (text, errors) = good(
        folder,
        &format!(
            "compare GRAPHS/indirect.ron:vpl@lights.count=16,rsm.resolution=64 GRAPHS/indirect.ron:vpl@lights.count=256 GRAPHS/direct.ron \
            --set lights.count=8 --set rsm.resolution=128 {common} --report out"
        ),
    );
    let report = json(&folder.join("out/report.json"));
    let names: Vec<&str> = report["variants"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["indirect:vpl@lights.count=16,rsm.resolution=64", "indirect:vpl@lights.count=256", "direct"]);
    assert!(names.iter().all(|name| text.contains(name)), "{text}");
    // A technique's own setting wins over one for all; what a graph lacks is a word.
    let images: Vec<_> = names.iter().map(|name| read_exr(&folder.join(format!("out/{}.exr", name.replace(':', "_")))).unwrap()).collect();
    assert!(images[0] != images[1], "other settings, other pictures");
    assert!(errors.contains("warning: --set lights.count=8: direct has no pass `lights`; it stays as it is"), "{errors}");
    // Claims that differ: the truth holds both, and who does not cast what is said.
    assert!(text.contains("“direct” does not cast punctual lights (one bounce): "), "{text}");
    // What none of them has is a mistake, with the nearest name of any.
    for (what, message) in [
        ("--set light.count=8", "did you mean `lights`?"),
        ("--set lights.cuont=8", "did you mean `count`?"),
        ("--set nothing.x=8", "has no pass `nothing`"),
    ] {
        let (_, errors, code) = run(folder, &format!("compare GRAPHS/direct.ron GRAPHS/indirect.ron {what} {common} --report no"));
        assert!(code == Some(2) && errors.contains(message), "{what}: {errors}");
    }
    let (_, errors, code) = run(folder, &format!("compare GRAPHS/direct.ron@lights.count=8 {common} --report no"));
    assert!(code == Some(2) && errors.contains("has no pass `lights`"), "{errors}");
}

#[test]
fn a_sweep_says_which_light_it_compares() {
    if !has_gpu() {
        return;
    }
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let graph = root().join("graphs/indirect.ron").display().to_string();
    let sweep = |more: &str| {
        format!(
            r#"(graph: "{graph}", scenes: ["area.gltf"], variants: ["vpl", "no-visibility"], parameters: {{"lights.count": [16], "rsm.resolution": [64]}},
            size: (32, 18), samples: 1, rounds: 1, reference_error: 0.4{more})"#
        )
    };
    std::fs::write(folder.join("like.ron"), sweep("")).unwrap();
    std::fs::write(folder.join("all.ron"), sweep(r#", lights: "all""#)).unwrap();
    std::fs::write(folder.join("bad.ron"), sweep(r#", lights: "moon""#)).unwrap();
    let (text, _) = good(folder, "sweep like.ron --report like");
    assert!(text.contains("area.gltf: The truth holds punctual lights (direct light, one bounce), area lights (seen directly)."), "{text}");
    let (text, _) = good(folder, "sweep all.ron --report all");
    assert!(text.contains("area.gltf: No technique casts area lights (direct light, one bounce): "), "{text}");
    let page = std::fs::read_to_string(folder.join("all/report.html")).unwrap();
    assert!(page.contains("No technique casts area lights (direct light, one bounce): "));
    let (_, errors, code) = run(folder, "sweep bad.ron --report bad");
    assert!(code == Some(2) && errors.contains("`moon` is none of punctual, area, emissive, environment, all"), "{errors}");
}

#[test]
fn lights_that_no_pass_casts_are_always_named() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let unlit = "no pass of this graph casts the light of 1 area light: seen directly, but lighting nothing";
    let (text, _) = good(folder, "explain GRAPHS/indirect.ron --scene area.gltf");
    assert!(
        text.contains("cast: punctual lights (direct light, one bounce), area lights (seen directly)") && text.contains(unlit),
        "{text}"
    );
    let (text, _) = good(folder, "explain GRAPHS/area-lights.ron --scene area.gltf");
    assert!(!text.contains("casts the light of 1 area light") && text.contains("casts the light of 1 punctual light"), "{text}");
    let (text, _) = good(folder, "scene-info area.gltf");
    assert!(text.contains("1 area light cast by") && text.contains("area-light, area-monte-carlo"), "{text}");
    let (text, _) = good(folder, "scene-info emissive.gltf");
    assert!(text.contains("warning: no built-in pass casts the light of 1 emissive surface"), "{text}");
    if !has_gpu() {
        return;
    }
    let render = "render GRAPHS/direct.ron --scene area.gltf --size 16x9 -o a.png";
    assert!(good(folder, render).1.contains(unlit));
    assert!(!good(folder, &format!("{render} -q")).1.contains("warning"));
}

/// What `output` of a graph shows over what the truth of some light shows: 1 where the light is what was cast.
fn ratio(scene: &Scene, graph: &str, output: &str, light: impl Fn(Claim) -> LightTransport) -> f64 {
    let graph = GraphFile::load(&root().join("graphs").join(graph)).unwrap();
    let set = |text: &str| text.parse::<lobelia::graph::Override>().unwrap();
    let sets = ["rsm.resolution=256", "lights.count=256", "indirect.clamp=none"].map(set);
    let sets = if graph.passes.iter().any(|pass| pass.name.text == "rsm") { sets.to_vec() } else { Vec::new() };
    let wired = graph.wire(&lobelia::registry(), &[], &sets).unwrap();
    let shot = Shot { extent: [32, 18], samples: 16, keep: vec![output.to_owned()], ..Shot::default() };
    let plan = wired.plan(&scene.traits(), &shot.plan_options()).unwrap();
    let light = light(Claim::of_output(&plan, Some(output)));
    let settings = Settings { size: shot.extent, paths: LightPaths::Only(light), samples: 256, seed: 1 };
    let expected = truth(scene, &scene.camera(None).unwrap(), settings, None, None, &mut |_| true).unwrap().image;
    let mut session = Session::with(lobelia::graph::Gpu::new(&Default::default()).unwrap(), scene.clone(), 0.0).unwrap();
    let mut rendering = session.start(&wired, &shot).unwrap();
    rendering.run(&mut |_| true).unwrap();
    let sum = |image: &lobelia::measure::Image| mean(image).iter().sum::<f64>();
    sum(&rendering.radiance(output).unwrap()) / sum(&expected)
}

/// Passes cast what they claim: their pictures are as bright as the truth of the claim, and not as bright as that of another.
#[test]
fn claims_are_what_passes_cast() {
    if !has_gpu() {
        return;
    }
    let (emissive, area) = (load(ROOM), load(&room_with_area_light()));
    for (scene, graph, output) in [
        (&emissive, "indirect.ron", "direct.radiance"),
        (&emissive, "indirect.ron", "indirect.radiance"),
        (&emissive, "indirect.ron", "emission.radiance"),
        (&emissive, "indirect.ron", "sum.radiance"),
        (&area, "area-lights.ron", "area.radiance"),
        (&area, "area-lights.ron", "sum.radiance"),
    ] {
        let right = ratio(scene, graph, output, |claim| claim.light);
        assert!((right - 1.0).abs() < 0.1, "{graph} {output}: {right}");
    }
    // A wrong claim is seen by this very check.
    for light in [
        LightTransport::of(LightClass::Punctual, [2]),
        LightTransport::of(LightClass::Punctual, [1, 2]),
        LightTransport::of(LightClass::Emissive, [1]),
    ] {
        let wrong = ratio(&emissive, "indirect.ron", "direct.radiance", |_| light);
        assert!((wrong - 1.0).abs() > 0.15, "{light}: {wrong}");
    }
}

#[derive(Ports)]
pub struct GlowIn {
    /// What the camera sees.
    pub gbuffer: GBuffer,
}

#[derive(Ports)]
pub struct GlowOut {
    /// Light of somebody's own.
    pub radiance: Radiance,
}

/// A pass of somebody else's that makes radiance and claims nothing.
pub struct Glow;

impl Pass for Glow {
    const NAME: &'static str = "glow";
    const DOC: &'static str = "Glows.";
    type World = SceneWorld;
    type Params = NoParams;
    type Inputs = GlowIn;
    type Outputs = GlowOut;
    type Bindings = ();

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(GlowOutShapes { radiance: ImageShape { extent: inputs.gbuffer.extent } })
    }

    fn create(_: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        Ok(Self)
    }

    fn bind(&self, _: &CreateContext<'_, Self>, _: &GlowIn, _: &GlowOut) -> Result<(), BuildError> {
        Ok(())
    }

    fn record(&mut self, _: &mut Frame<'_>, _: &DeviceOf<Self>, _: &()) -> Result<(), RunError> {
        Ok(())
    }
}

/// A claim of nothing does not make the truth empty: all light is in it, and the pass is named.
#[test]
fn a_pass_that_does_not_state_its_light_is_named() {
    let mut registry: Registry<SceneWorld> = lobelia::registry();
    registry.add::<Glow>();
    let text = r#"(passes: {"gbuffer": gbuffer(), "own": glow(), "rsm": rsm(), "direct": direct(), "sum": compose()}, output: "sum.radiance",
        variants: {"without": {"own": none}})"#;
    let graph = GraphFile::parse(text, "own.ron").unwrap();
    let traits = load(ROOM).traits();
    let claim = |variants: &[&str]| {
        let variants: Vec<String> = variants.iter().map(|name| (*name).to_owned()).collect();
        let plan = graph.wire(&registry, &variants, &[]).unwrap().plan(&traits, &PlanOptions::new([8, 8])).unwrap();
        Claim::of_output(&plan, None)
    };
    let (own, known) = (claim(&[]), claim(&["without"]));
    assert_eq!((own.silent.as_slice(), known.silent.len()), (["own (glow)".to_owned()].as_slice(), 0));
    assert_eq!(truth_paths(None, std::slice::from_ref(&known)), LightPaths::Only(LightTransport::of(LightClass::Punctual, [1])));
    assert_eq!(truth_paths(None, &[known.clone(), own.clone()]), LightPaths::Full { depth: 2 });
    let asked = Some(LightPaths::Direct);
    assert_eq!(truth_paths(asked, std::slice::from_ref(&own)), LightPaths::Direct);
    let techniques = [("known", &known), ("own", &own)];
    let mut mean = |light: &LightTransport| Ok::<_, std::convert::Infallible>(if light.has(LightClass::Emissive, 1) { 1.0 } else { 4.0 });
    let light = compare(Some(&LightPaths::Full { depth: 2 }), &techniques, &traits, &mut mean).unwrap();
    let sentences = light.sentences();
    assert!(sentences.iter().any(|one| one.contains("“own”: `own (glow)` makes radiance but does not state")), "{sentences:?}");
    // Of the other one it is known what is missing; of this one nothing is said to be.
    assert!(!light.missing.is_empty() && light.missing.iter().all(|one| one.technique == "known"));
    assert!(uncast(&own, &traits).iter().any(|one| one.contains("own (glow) makes radiance but does not state")));
}
