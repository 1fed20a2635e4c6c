//! Area lights as pictures: against path-traced references, and techniques against each other.
#![allow(clippy::unwrap_used)]

use lobelia::{
    Shot,
    measure::{Image, Mask, Statistics, compare, read_exr},
    scene::Ndf,
};
use lobelia_tests::{Render, has_gpu, shared};

fn render(scene: &str, extent: [u32; 2], samples: u32, ndf: Ndf, variants: &[&str], set: &[&str]) -> Image {
    let shot = Shot { extent, samples, camera: Some("main".into()), ..Shot::default() };
    Render { graph: "area-lights.ron", scene, variants, set, ndf, shot }.radiance("area.radiance").unwrap()
}

/// Pixels that see all of every light: shadows change nothing there. (A shadowed light takes its specular lobe with it in proportion, which is an approximation of the
/// visibility, not of what is tested here.)
fn lit(without: &Image, with: &Image) -> Mask {
    let same = |(a, b): (&[f32; 3], &[f32; 3])| {
        let (all, off) = (a.iter().sum::<f32>(), a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f32>());
        all > 0.0 && off <= 1e-3 * all
    };
    Mask { counts: without.pixels.iter().zip(&with.pixels).map(same).collect() }
}

/// A scene with its reference, and the pixels that see every light whole.
struct Known {
    name: &'static str,
    scene: String,
    reference: Image,
    lit: Mask,
}

impl Known {
    fn all() -> Option<[Self; 2]> {
        let shared = shared()?;
        has_gpu().then(|| {
            ["area-quad", "area-disk-sphere"].map(|name| {
                let scene = shared.join(format!("scenes/{name}/{name}.glb")).display().to_string();
                let reference = read_exr(&shared.join(format!("reference/{name}-main_direct.exr"))).unwrap();
                let of = |variants: &[&str], set: &[&str]| render(&scene, [320, 180], 16, Ndf::Ggx, variants, set);
                let lit = lit(&of(&["no-visibility"], &[]), &of(&[], &["visibility.samples=32"]));
                let counted = lit.counts.iter().filter(|counts| **counts).count();
                assert!(counted > lit.counts.len() / 8, "{name}: only {counted} pixels see every light whole");
                Self { name, scene, reference, lit }
            })
        })
    }

    fn error(&self, variant: &str, set: &[&str]) -> Statistics {
        let image = render(&self.scene, [320, 180], 16, Ndf::Ggx, &["no-visibility", variant], set);
        compare(&self.reference, &image, &self.lit).unwrap()
    }
}

#[test]
fn closer_to_the_reference_than_linearly_transformed_cosines() {
    let Some(scenes) = Known::all() else { return };
    for (known, most) in scenes.iter().zip([2.5e-3, 6e-4]) {
        let (ours, cosines) = (known.error("exact-boundary", &[]), known.error("ltc", &[]));
        println!("{}: {ours:?}, linearly transformed cosines {cosines:?}", known.name);
        assert!(ours.relative_mse < most, "{}: {ours:?}", known.name);
        assert!((ours.mean_ratio - 1.0).abs() < 0.01, "{}: {ours:?}", known.name);
        assert!(5.0 * ours.relative_mse < cosines.relative_mse, "{}: {ours:?} against {cosines:?}", known.name);
    }
}

/// The errors of docs/area-lights.
#[test]
#[ignore = "a table for the documentation, with nothing to pass or fail"]
fn table_of_errors() {
    let Some(scenes) = Known::all() else { return };
    println!("| technique | {} | {} |\n| --- | --- | --- |", scenes[0].name, scenes[1].name);
    let techniques: [(&str, &[&str]); 15] = [
        ("exact-boundary", &[]),
        ("exact-boundary", &["area.boundary_nodes=2"]),
        ("exact-boundary", &["area.boundary_nodes=6", "area.round_arcs=32"]),
        ("exact-boundary", &["area.round=polygon"]),
        ("exact-boundary", &["area.round=spinning_quad"]),
        ("owen", &[]),
        ("ellipsoid", &[]),
        ("lorentzian-pearson", &[]),
        ("lorentzian", &[]),
        ("owen", &["area.method=vertices"]),
        ("ltc", &[]),
        ("mrp", &[]),
        ("monte-carlo", &["area.samples=1"]),
        ("monte-carlo", &["area.samples=16"]),
        ("monte-carlo", &["area.samples=256"]),
    ];
    for (variant, set) in techniques {
        let errors = scenes.each_ref().map(|known| known.error(variant, set).relative_mse);
        println!("| {variant} {} | {:.1e} | {:.1e} |", set.join(" "), errors[0], errors[1]);
    }
}

/// The nearer part of `builtin:area-lights`, of roughness 0.3 and more: samples that are uniform over the lights hardly ever meet a sharper lobe.
fn rough(image: &Image) -> Mask {
    Mask { counts: (0..image.pixels.len()).map(|pixel| pixel / image.width > image.height * 55 / 100).collect() }
}

/// Seven lights of all shapes, at 26 to 70 degrees. Monte Carlo knows nothing of outlines, and the others only share those.
#[test]
fn techniques_agree() {
    if !has_gpu() {
        return;
    }
    let scene = "builtin:area-lights";
    let extent = [160, 90];
    for ndf in [Ndf::Ggx, Ndf::Phong] {
        let of = |variant: &str, set: &[&str]| render(scene, extent, 1, ndf, &["no-visibility", variant], set);
        let samples = of("monte-carlo", &["area.samples=256"]);
        let all = rough(&samples);
        let against = |image: &Image| compare(&samples, image, &all).unwrap();
        // A round light of 64 corners is round.
        let ours = against(&of("exact-boundary", &["area.round_arcs=32", "area.round_sides=64", "area.boundary_nodes=6"]));
        // Masking and Fresnel at the mean half vector: 1.1 % too much here for GGX, 1.6 % too little for Phong.
        let most = if ndf == Ndf::Ggx { 5e-4 } else { 4e-3 };
        assert!(ours.relative_mse < most && (ours.mean_ratio - 1.0).abs() < 0.02, "{ndf:?}: {ours:?}");
        let owen = against(&of("owen", &[]));
        assert!(owen.relative_mse < 0.05 && owen.relative_mse > ours.relative_mse, "{ndf:?}, great arcs: {owen:?}");
        let points = against(&of("mrp", &[]));
        assert!(points.relative_mse < 0.3 && points.relative_mse > owen.relative_mse, "{ndf:?}, representative points: {points:?}");
        if ndf == Ndf::Ggx {
            let cosines = against(&of("ltc", &[]));
            assert!(cosines.relative_mse < 0.01 && (cosines.mean_ratio - 1.0).abs() < 0.02, "linearly transformed cosines: {cosines:?}");
        }
        // What the comparison must reject: the cosine lobe is another lobe.
        let other = against(&of("phong", &[]));
        assert!(other.relative_mse > 4.0 * owen.relative_mse, "{ndf:?}, a cosine lobe: {other:?}");
    }
}

/// Disks, spheres and their like as arcs, as polygons and as the quad that spins, for the specular lobe and for diffuse light.
#[test]
fn round_lights_as_arcs_polygons_and_quads() {
    if !has_gpu() {
        return;
    }
    let of = |variant: &str, set: &[&str]| render("builtin:area-lights", [160, 90], 1, Ndf::Ggx, &["no-visibility", variant], set);
    let truth = of("exact-boundary", &["area.round_arcs=64"]);
    let against = |image: &Image| compare(&truth, image, &Mask { counts: vec![true; truth.pixels.len()] }).unwrap();
    let arcs = against(&of("exact-boundary", &[]));
    let [few, many] =
        ["area.round_sides=8", "area.round_sides=64"].map(|sides| against(&of("exact-boundary", &["area.round=polygon", sides])));
    let quads = against(&of("exact-boundary", &["area.round=spinning_quad"]));
    println!("arcs {arcs:?}\n8 sides {few:?}\n64 {many:?}\nquads {quads:?}");
    assert!(arcs.relative_mse < 5e-5, "{arcs:?}");
    assert!(many.relative_mse < 2e-5 && few.relative_mse > 10.0 * many.relative_mse, "{few:?}, {many:?}");
    assert!(quads.relative_mse < 0.05 && quads.relative_mse > 100.0 * arcs.relative_mse, "{quads:?}");
}

/// Brushed surfaces: samples know nothing of half vectors.
#[test]
fn anisotropic_surfaces_agree_with_samples() {
    if !has_gpu() {
        return;
    }
    for set in
        [["area.anisotropy=0.6", "area.tangent=x"], ["area.anisotropy=0.8", "area.tangent=z"], ["area.anisotropy=-0.5", "area.tangent=x"]]
    {
        let of = |variant: &str, more: &[&str]| {
            render("builtin:area-lights", [160, 90], 1, Ndf::Ggx, &["no-visibility", variant], &[&set[..], more].concat())
        };
        let samples = of("monte-carlo", &["area.samples=256"]);
        let all = rough(&samples);
        let ours = compare(&samples, &of("exact-boundary", &[]), &all).unwrap();
        let plain = render("builtin:area-lights", [160, 90], 1, Ndf::Ggx, &["no-visibility", "exact-boundary"], &[]);
        let without = compare(&samples, &plain, &all).unwrap();
        println!("{set:?}: {ours:?}, without anisotropy {without:?}");
        assert!(ours.relative_mse < 5e-3 && (ours.mean_ratio - 1.0).abs() < 0.03, "{set:?}: {ours:?}");
        assert!(without.relative_mse > 5.0 * ours.relative_mse, "{set:?}: {without:?} must be further off than {ours:?}");
    }
}

#[test]
fn seeds_and_samples_of_monte_carlo() {
    if !has_gpu() {
        return;
    }
    let of = |set: &[&str]| render("builtin:area-lights", [96, 54], 1, Ndf::Ggx, &["no-visibility", "monte-carlo"], set);
    let base = of(&[]);
    assert!(base.pixels == of(&[]).pixels, "equal seeds");
    assert!(base.pixels != of(&["area.seed=1"]).pixels, "another seed");
    let truth = of(&["area.samples=256"]);
    let error = |image: &Image| compare(&truth, image, &rough(&truth)).unwrap().relative_mse;
    let [few, many] = [error(&of(&["area.samples=4"])), error(&of(&["area.samples=32"]))];
    assert!(few > 5.0 * many, "eight times as many samples: {few} to {many}");
}

#[test]
fn what_cannot_be_asked_is_refused() {
    if !has_gpu() {
        return;
    }
    let ask = |ndf, variants: &[&str], set: &[&str]| {
        let shot = Shot { extent: [16, 9], ..Shot::default() };
        Render { graph: "area-lights.ron", scene: "builtin:area-lights", variants, set, ndf, shot }.radiance("area.radiance").unwrap_err()
    };
    assert!(ask(Ndf::Phong, &["ltc"], &[]).contains("fitted to GGX only"));
    assert!(ask(Ndf::Ggx, &[], &["area.boundary_nodes=5"]).contains("must be 2, 3, 4 or 6"));
    assert!(ask(Ndf::Ggx, &[], &["area.edge_nodes=9"]).contains("edge_nodes"));
    assert!(ask(Ndf::Phong, &[], &["area.anisotropy=0.5"]).contains("anisotropy is for GGX"));
    assert!(ask(Ndf::Ggx, &["owen"], &["area.anisotropy=0.5"]).contains("anisotropy is for GGX"));
    assert!(ask(Ndf::Phong, &["monte-carlo"], &["area.anisotropy=0.5"]).contains("anisotropy is for GGX"));
    assert!(ask(Ndf::Ggx, &[], &["area.anisotropy=1"]).contains("anisotropy"));
    assert!(ask(Ndf::Ggx, &["monte-carlo"], &["area.samples=0"]).contains("samples"));
}

/// Plans alone: no device is needed.
#[test]
fn what_a_scene_does_not_have_is_left_out() {
    let graph = lobelia::graph::GraphFile::load(&lobelia_tests::root().join("graphs/area-lights.ron")).unwrap();
    let plan = |scene: &lobelia::scene::Scene| {
        let wired = graph.wire(&lobelia::registry(), &["no-visibility".into()], &[]).unwrap();
        wired.plan(&scene.traits(), &lobelia::graph::PlanOptions::new([16, 9])).unwrap()
    };
    let flags = |scene: &lobelia::scene::Scene| -> Vec<&'static str> {
        let plan = plan(scene);
        let area = plan.passes.iter().find(|pass| pass.name == "area").unwrap();
        let shapes = ["POLYGON_LIGHTS", "DISK_LIGHTS", "SPHERE_LIGHTS", "ROUND_ARCS"];
        area.specialisations.iter().filter(|flag| flag.on && shapes.contains(&flag.flag)).map(|flag| flag.flag).collect()
    };
    let mut scene = lobelia::scene::Scene::load("builtin:area-lights").unwrap();
    assert_eq!(flags(&scene), ["POLYGON_LIGHTS", "DISK_LIGHTS", "SPHERE_LIGHTS", "ROUND_ARCS"]);
    // The quad, the triangle and the star come first.
    scene.area_lights.truncate(3);
    scene.instances.retain(|instance| instance.area_light.is_none_or(|light| light < 3));
    assert_eq!(flags(&scene), ["POLYGON_LIGHTS"]);
    let without = plan(&lobelia::scene::Scene::load("builtin:cornell-glossy").unwrap());
    assert!(
        without.dropped.iter().any(|dropped| dropped.pass == "area" && dropped.reason.contains("no area light")),
        "{:?}",
        without.dropped
    );
}
