//! Shadows of direct light against rays in f64, for every kind of light: no acne, no light under objects or through corners, no seams.
#![allow(clippy::unwrap_used)]

use glam::DVec3;
use lobelia::{
    Session, Shot,
    graph::{Gpu, GpuOptions, GraphFile},
    measure::Image,
    scene::{LightKind, Scene},
};
use lobelia_tests::has_gpu;

fn render(scene: &Scene, extent: [u32; 2], shadows: &str) -> Image {
    let text = format!(r#"(passes: {{"gbuffer": gbuffer(), {shadows} "direct": direct()}}, output: "direct.radiance")"#);
    let wired = GraphFile::parse(&text, "shadows.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let gpu = Gpu::new(&GpuOptions { adapter: None, baseline: true }).unwrap();
    let mut session = Session::with(gpu, scene.clone(), 0.0).unwrap();
    let shot = Shot { extent, ..Shot::default() };
    session.start(&wired, &shot).unwrap().run(&mut |_| true).unwrap().image()
}

/// Corner, edges and normal (not unit) of a triangle.
struct Triangle([DVec3; 3], DVec3);

/// Distance to the nearest triangle along a ray, in units of its direction (Moeller and Trumbore 1997).
fn nearest(triangles: &[Triangle], origin: DVec3, direction: DVec3) -> Option<(f64, usize)> {
    let mut best: Option<(f64, usize)> = None;
    for (index, Triangle([corner, first, second], _)) in triangles.iter().enumerate() {
        let p = direction.cross(*second);
        let determinant = first.dot(p);
        if determinant == 0.0 {
            continue;
        }
        let from = origin - *corner;
        let u = from.dot(p) / determinant;
        let q = from.cross(*first);
        let (v, distance) = (direction.dot(q) / determinant, second.dot(q) / determinant);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, index));
        }
    }
    best
}

/// Whether the surface at each pixel's centre is seen by the first light; `None` where there is no surface.
fn traced(scene: &Scene, extent: [u32; 2]) -> Vec<Option<bool>> {
    let triangles: Vec<Triangle> = scene
        .triangles()
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.positions.map(|corner| corner.as_dvec3());
            Triangle([a, b - a, c - a], (b - a).cross(c - a))
        })
        .collect();
    let (camera, light) = (scene.camera(None).unwrap(), &scene.lights[0]);
    let [width, height] = extent.map(f64::from);
    let tangent = (camera.yfov / 2.0).tan();
    let eye = camera.position - scene.origin();
    let pixel = |index: u32| {
        let (x, y) = (f64::from(index % extent[0]) + 0.5, f64::from(index / extent[0]) + 0.5);
        let ray = camera.forward
            + camera.right * ((2.0 * x / width - 1.0) * tangent * width / height)
            + camera.up * ((1.0 - 2.0 * y / height) * tangent);
        let (distance, hit) = nearest(&triangles, eye, ray)?;
        let position = eye + ray * distance;
        let to_light =
            if light.kind == LightKind::Directional { -light.direction * 1e3 } else { light.position - scene.origin() - position };
        // Off the surface, towards the side that the light must be on to light it: that of the viewer.
        let normal = triangles[hit].1.normalize();
        let side = -normal * ray.dot(normal).signum();
        let open = nearest(&triangles, position + side * 1e-6, to_light).is_none_or(|(distance, _)| distance >= 1.0);
        Some(side.dot(to_light) > 0.0 && open)
    };
    (0..extent[0] * extent[1]).map(pixel).collect()
}

/// What stands in the way of agreement.
#[derive(Debug)]
struct Disagreement {
    /// Pixels with all eight neighbours alike whose shadow is wrong by more than a hundredth, of those that are lit but for shadows.
    inside: f64,
    /// Mean absolute difference of all of them, edges too.
    mean: f64,
}

fn disagreement(scene: &Scene, extent: [u32; 2], shadows: &str) -> Disagreement {
    let (open, shadowed, truth) = (render(scene, extent, ""), render(scene, extent, shadows), traced(scene, extent));
    let [width, height] = extent.map(|side| side as usize);
    let (mut pixels, mut clear, mut wrong, mut total) = (0, 0, 0, 0.0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let index = y * width + x;
            let [bright, found] = [&open, &shadowed].map(|image| f64::from(image.pixels[index].iter().copied().fold(0.0, f32::max)));
            let Some(lit) = truth[index] else { continue };
            // Half floats tell a hundredth of this.
            if bright < 1e-4 {
                continue;
            }
            let difference = (found / bright - f64::from(u8::from(lit))).abs();
            let around = (y - 1..=y + 1).flat_map(|row| (x - 1..=x + 1).map(move |column| row * width + column));
            pixels += 1;
            total += difference;
            if around.into_iter().all(|neighbour| truth[neighbour] == truth[index]) {
                clear += 1;
                wrong += usize::from(difference > 0.01);
            }
        }
    }
    assert!(pixels > 300 && clear > 200, "{pixels} pixels, {clear} away from edges");
    Disagreement { inside: wrong as f64 / clear as f64, mean: total / pixels as f64 }
}

fn lit_by(name: &str, kind: LightKind, at: [f64; 3], direction: [f64; 3]) -> Scene {
    let mut scene = Scene::load(name).unwrap();
    let mut light = scene.lights[0].clone();
    (light.kind, light.position, light.direction) = (kind, DVec3::from(at), DVec3::from(direction).normalize());
    light.intensity = glam::Vec3::splat(10.0);
    scene.lights = vec![light];
    scene
}

const NARROW: LightKind = LightKind::Spot { inner: 0.5, outer: 0.9 };
const WIDE: LightKind = LightKind::Spot { inner: 0.9, outer: 1.4 };

#[test]
fn shadows_in_the_box_are_those_of_rays() {
    if !has_gpu() {
        return;
    }
    for (kind, at, direction) in [
        (NARROW, [0.6, 1.9, 0.8], [-0.5, -1.0, -0.6]),
        (WIDE, [0.5, 1.95, 0.3], [-0.1, -1.0, -0.1]),
        (LightKind::Point, [0.1, 1.1, 0.5], [0.0, -1.0, 0.0]),
        // Close to the floor, so that most of it is met at grazing angles.
        (LightKind::Point, [0.1, 0.05, 0.8], [0.0, -1.0, 0.0]),
    ] {
        let scene = lit_by("builtin:cornell-diffuse", kind, at, direction);
        let found = disagreement(&scene, [96, 96], r#""rsm": rsm(),"#);
        println!("{kind:?} at {at:?}: {found:?}");
        assert!(found.inside < 1e-3 && found.mean < 3e-3, "{kind:?} at {at:?}: {found:?}");
    }
    // From outside, through the open front: the creases of the walls, which have no thickness, are shadow edges of one texel.
    let scene = lit_by("builtin:cornell-diffuse", LightKind::Directional, [0.0; 3], [-0.4, -0.5, -1.0]);
    let found = disagreement(&scene, [96, 96], r#""rsm": rsm(),"#);
    println!("sun: {found:?}");
    assert!(found.inside < 0.02 && found.mean < 6e-3, "sun: {found:?}");
}

#[test]
fn shadows_of_spheres_are_those_of_rays() {
    if !has_gpu() {
        return;
    }
    for (kind, at, direction) in [
        (NARROW, [2.2, 3.0, 2.6], [-2.2, -2.8, -2.9]),
        (LightKind::Point, [-2.2, 1.9, 0.9], [0.0, -1.0, 0.0]),
        (LightKind::Directional, [0.0; 3], [0.3, -1.0, -0.4]),
    ] {
        let scene = lit_by("builtin:spheres", kind, at, direction);
        let found = disagreement(&scene, [64, 36], r#""rsm": rsm(),"#);
        println!("{kind:?} at {at:?}: {found:?}");
        assert!(found.inside < 1e-3 && found.mean < 0.015, "{kind:?} at {at:?}: {found:?}");
    }
}

/// A map that is too coarse, and none at all, are found out.
#[test]
fn wrong_shadows_are_seen() {
    if !has_gpu() {
        return;
    }
    let scene = lit_by("builtin:cornell-diffuse", LightKind::Point, [0.1, 1.1, 0.5], [0.0, -1.0, 0.0]);
    assert!(disagreement(&scene, [96, 96], "").inside > 0.01);
    assert!(disagreement(&scene, [96, 96], r#""rsm": rsm(resolution: 16),"#).mean > 0.01);
}
