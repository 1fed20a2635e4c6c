//! Lights that move through the horizon, through the lobe and onto the surface: nothing pops.

use super::ggx::{Track, light_of, round_light_of};
use glam::DVec3;
use lobelia::lobes::area_light::{
    boundary::Ellipse,
    round::{Silhouette, sphere},
};

const STEPS: usize = 200;

/// A square of side 1 that faces the origin from `center`.
fn square(center: DVec3) -> Vec<DVec3> {
    let (a, b) = (DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.0, 0.0, 0.5));
    let corners = [center - a - b, center - a + b, center + a + b, center + a - b];
    let mut corners: Vec<DVec3> = corners.map(|corner| corner.as_vec3().as_dvec3()).to_vec();
    if (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(center) > 0.0 {
        corners.reverse();
    }
    corners
}

fn largest_second_difference(values: &[f64]) -> f64 {
    values.windows(3).map(|three| (three[2] - 2.0 * three[1] + three[0]).abs()).fold(0.0, f64::max)
}

/// A light's way over the time from 0 to 1.
type Path = fn(f64) -> DVec3;

/// From below the horizon to above, through the mirror direction; along the horizon; towards the surface's own plane and point.
const PATHS: [(&str, Path); 3] = [
    ("rising", |t| DVec3::new(-1.5, 0.1, -1.2 + 3.6 * t)),
    ("passing", |t| DVec3::new(-1.0, -3.0 + 6.0 * t, 0.3)),
    ("nearing", |t| DVec3::new(-2.0 * (1.0 - t) - 0.01, 0.05, 0.4)),
];

/// `most_off` is what the light may be off by, over its largest value.
fn does_not_pop(name: &str, most_off: f64, track: impl Fn(Path, f64, f64) -> Option<Track>) {
    for (path, at) in PATHS {
        for view in [20.0, 60.0, 80.0] {
            for alpha in [0.02, 0.1, 0.5] {
                let Some(Track { found, exact }) = track(at, view, alpha) else { return };
                for (what, (found, exact)) in ["irradiance", "lobe"].into_iter().zip(found.iter().zip(&exact)) {
                    let [own, true_one] = [found, exact].map(|values| largest_second_difference(values));
                    // The quadrature may add a hundredth of the largest value, and no more than it is off by anywhere.
                    let most = exact.iter().fold(0.0, |most: f64, value| most.max(*value));
                    assert!(
                        own <= 1.2 * true_one + 0.01 * most + 1e-5,
                        "{name} {path}, {view} degrees, alpha {alpha}: {what} jumps by {own}, the exact one by {true_one}"
                    );
                    let off = found.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(off < most_off * most + 1e-5, "{name} {path}, {view} degrees, alpha {alpha}: {what} is off by {off} of {most}");
                    assert!(most > 1e-4 || path == "passing", "{name} {path}: nothing to see at {view} degrees, alpha {alpha}");
                }
            }
        }
    }
}

fn steps() -> impl Iterator<Item = f64> {
    (0..=STEPS).map(|step| step as f64 / STEPS as f64)
}

#[test]
fn crossings_do_not_pop() {
    let squares = |at: Path, view: f64, alpha: f64| {
        let lights: Vec<Vec<DVec3>> = steps().map(|time| square(at(time))).collect();
        light_of(&lights, view, alpha)
    };
    does_not_pop("a square", 0.03, squares);
    // What the bound must reject: one step that is off by a tenth of the whole.
    let Some(Track { mut found, exact }) = squares(PATHS[0].1, 60.0, 0.1) else { return };
    let most = exact[1].iter().fold(0.0, |most: f64, value| most.max(*value));
    found[1][120] += 0.1 * most;
    assert!(largest_second_difference(&found[1]) > 1.2 * largest_second_difference(&exact[1]) + 0.01 * most + 1e-5);
}

#[test]
fn crossings_of_round_lights_do_not_pop() {
    // Nearer than its radius a sphere is all around.
    let rim = |center: DVec3| match sphere(center, 0.3) {
        Silhouette::Rim(rim) => rim,
        Silhouette::Everywhere => unreachable!("{center} is outside"),
    };
    does_not_pop("a sphere", 0.03, |at, view, alpha| round_light_of(&steps().map(|time| rim(at(time))).collect::<Vec<_>>(), view, alpha));
    let disk = |center: DVec3| Ellipse { center, axis_a: DVec3::new(0.0, 0.3, 0.0), axis_b: DVec3::new(0.1, 0.0, 0.25) }.facing();
    // The eight arcs are not quite the ellipse, which shows where a sharp lobe ends at its rim.
    does_not_pop("an ellipse", 0.05, |at, view, alpha| {
        round_light_of(&steps().map(|time| disk(at(time))).collect::<Vec<_>>(), view, alpha)
    });
}
