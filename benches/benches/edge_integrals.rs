//! The edge integral of cosine lobes: cost of an edge on the device and error over a floor, for every model, in turn within one run. Table 2 of Lecocq et al. 2017
//! remade. `cargo bench -p lobelia-benches --bench edge_integrals`
#![allow(clippy::unwrap_used, missing_docs)]

use glam::DVec3;
use lobelia::{
    graph::testing::{evaluate, gpu},
    lobes::area_light::{
        axial_moment::{axial_moment, lobe_fraction},
        boundary::Boundary,
        edge_models::{EdgeModel, lobe_fraction_model},
    },
    shaders::Flags,
};
use std::time::Instant;

const ROWS: usize = 1 << 15;
const EDGES: usize = 64;
const ROUNDS: usize = 5;
const EXPONENTS: [f64; 3] = [100.0, 500.0, 5000.0];

/// Sums edges that differ a little, so that nothing is computed once for all.
fn shader(edge: &str) -> String {
    format!(
        "#import lobelia::edge_integral::edge_j
         struct Input {{ edge: vec4f }}
         struct Output {{ sum: vec4f }}
         // Arvo 1995: the sum over every second power, by recurrence.
         fn arvo(s: f32, low: f32, high: f32, order: f32) -> f32 {{
             let c = sqrt(1.0 - s * s);
             let from_cosine = c * cos(low);
             let to_cosine = c * cos(high);
             var power_low = c * sin(low);
             var power_high = c * sin(high);
             var power = power_high - power_low;
             power_low *= from_cosine * from_cosine;
             power_high *= to_cosine * to_cosine;
             var sum = power;
             for (var k = 3.0; k <= order - 1.0; k += 2.0) {{
                 power = (power_high - power_low + (k - 1.0) * c * c * power) / k;
                 sum += power;
                 power_low *= from_cosine * from_cosine;
                 power_high *= to_cosine * to_cosine;
             }}
             return s * sum;
         }}
         fn nothing(s: f32, low: f32, high: f32, order: f32) -> f32 {{
             return s + low * high + order;
         }}
         fn evaluate(input: Input) -> Output {{
             var sum = 0.0;
             for (var k = 0; k < {EDGES}; k++) {{
                 let f = f32(k) * 1e-3;
                 sum += {edge}(input.edge.x * (1.0 - f), input.edge.y + f, input.edge.z - f, input.edge.w);
             }}
             return Output(vec4f(sum));
         }}"
    )
}

/// A floor seen at an angle under four lights: largest and root mean square error in lobe fractions.
fn error(model: EdgeModel, n: f64) -> f64 {
    let lights = [(-1.2, 1.0, 0.8, 0.5), (0.9, 0.6, 0.1, 1.2), (0.0, 2.0, 1.0, 1.0), (1.8, 1.4, 0.3, 0.3)];
    let (mut squares, mut most, mut count) = (0.0, 0f64, 0.0);
    for place in 0..24 * 24 {
        let at = DVec3::new(f64::from(place % 24) / 6.0 - 2.0, f64::from(place / 24) / 6.0 - 2.0, 0.0);
        let view = (DVec3::new(0.0, -5.0, 2.5) - at).normalize();
        let mirror = DVec3::new(-view.x, -view.y, view.z);
        for (x, height, half_width, half_height) in lights {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(a, b)| DVec3::new(x + a * half_width, 1.5, height + b * half_height) - at);
            let light = Boundary::polygon(&corners);
            let exact = lobe_fraction(axial_moment(&light, Some(DVec3::Z), mirror, n), n);
            let found = lobe_fraction_model(model, &light, Some(DVec3::Z), mirror, n);
            squares += (found - exact).powi(2);
            most = most.max(exact);
            count += 1.0;
        }
    }
    f64::sqrt(squares / count) / most
}

fn main() {
    let gpu = gpu().expect("this benchmark needs a device");
    let rows: Vec<f32> = (0..ROWS).map(|row| 0.001 + 0.9 * (row as f32 + 0.5) / ROWS as f32).collect();
    let ways: [(&str, &str, &[&str], Option<EdgeModel>); 8] = [
        ("nothing", "nothing", &[], None),
        ("Arvo", "arvo", &[], None),
        ("Lorentzian", "edge_j", &["EDGE_PEAK", "EDGE_LORENTZIAN"], Some(EdgeModel::Lorentzian)),
        ("Lorentzian-Pearson", "edge_j", &["EDGE_PEAK"], Some(EdgeModel::LorentzianPearson)),
        ("ellipsoid", "edge_j", &["EDGE_PEAK", "EDGE_ELLIPSOID"], Some(EdgeModel::Ellipsoid)),
        ("Owen, 2 nodes", "edge_j", &["EDGE_NODES_TWO"], Some(EdgeModel::Owen { nodes: 2 })),
        ("Owen, 3 nodes", "edge_j", &[], Some(EdgeModel::Owen { nodes: 3 })),
        ("Owen, 4 nodes", "edge_j", &["EDGE_NODES_FOUR"], Some(EdgeModel::Owen { nodes: 4 })),
    ];
    let mut best = vec![[f64::INFINITY; 3]; ways.len()];
    // The first round makes the pipelines.
    for round in 0..=ROUNDS {
        for (way, (_, function, flags, _)) in ways.iter().enumerate() {
            for (place, n) in EXPONENTS.iter().enumerate() {
                let inputs: Vec<[f32; 4]> = rows.iter().map(|s| [*s, -0.9, 1.1, *n as f32 + 1.0]).collect();
                let flags = flags.iter().fold(Flags::new(), |flags, flag| flags.with(flag, true));
                let clock = Instant::now();
                let sums: Vec<[f32; 4]> = evaluate(gpu, &shader(function), &flags, &inputs).unwrap();
                let seconds = clock.elapsed().as_secs_f64();
                assert!(sums.iter().all(|sum| sum[0].is_finite()));
                if round > 0 {
                    best[way][place] = best[way][place].min(seconds);
                }
            }
        }
    }
    let device = gpu.info().map_or("host device", |info| info.name.as_str());
    println!(
        "Nanoseconds an edge, the loop around it taken off, at exponents {EXPONENTS:?}; root mean square error over the largest value. {device}"
    );
    println!(
        "| edge | 100 | 500 | 5000 | 5000 to 100 | to ellipsoid | error at 100 | 500 | 5000 |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    );
    let cost = |way: usize, place: usize| (best[way][place] - best[0][place]) / (ROWS * EDGES) as f64 * 1e9;
    for (way, (name, _, _, model)) in ways.iter().enumerate().skip(1) {
        let [a, b, c] = [0, 1, 2].map(|place| cost(way, place));
        let errors = match model {
            Some(model) => EXPONENTS.map(|n| format!("{:.1e}", error(*model, n))),
            None => ["-", "-", "-"].map(str::to_owned),
        };
        println!("| {name} | {a:.1} | {b:.1} | {c:.1} | {:.3} | {:.2} | {} |", c / a, c / cost(4, 2), errors.join(" | "));
    }
}
