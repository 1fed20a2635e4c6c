//! Where lights are put changes the noise of what is gathered, and not its mean.

use crate::given::turn;
use lobelia::{
    Session, SessionOptions, Shot,
    graph::{GraphFile, testing::gpu},
};

/// Per run: mean radiance of the picture, of its left half and of its lower half, each in three channels.
fn means(density: &str, gather: &str, seeds: std::ops::Range<u32>) -> Vec<[f64; 9]> {
    let _turn = turn();
    let text = format!(
        r#"(passes: {{
            "gbuffer": gbuffer(), "rsm": rsm(resolution: 128), "density": {density}, "lights": vpl_lights(count: 512),
            "visibility": visibility(), "indirect": vpl_gather({gather}),
        }}, output: "indirect.radiance")"#
    );
    let wired = GraphFile::parse(&text, "test.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let mut session = Session::new("builtin:cornell-glossy", &SessionOptions { baseline: true, ..SessionOptions::default() }).unwrap();
    let extent = [24, 24];
    let run = |seed: u32| {
        let mut rendering = session.start(&wired, &Shot { extent, seed, ..Shot::default() }).unwrap();
        rendering.run(&mut |_| true).unwrap();
        let image = rendering.radiance("indirect.radiance").unwrap();
        let mut means = [0.0; 9];
        for (index, pixel) in image.pixels.iter().enumerate() {
            let (left, lower) = (index as u32 % extent[0] < extent[0] / 2, index as u32 / extent[0] >= extent[1] / 2);
            for channel in 0..3 {
                let value = f64::from(pixel[channel]) / f64::from(extent[0] * extent[1]);
                means[channel] += value;
                means[3 + channel] += if left { value } else { 0.0 };
                means[6 + channel] += if lower { value } else { 0.0 };
            }
        }
        means
    };
    seeds.map(run).collect()
}

fn statistics(runs: &[[f64; 9]], index: usize) -> (f64, f64) {
    let count = runs.len() as f64;
    let mean = runs.iter().map(|run| run[index]).sum::<f64>() / count;
    let variance = runs.iter().map(|run| (run[index] - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, variance / count)
}

/// Largest difference of means in standard errors.
fn apart(one: &[[f64; 9]], other: &[[f64; 9]]) -> f64 {
    let distance = |index| {
        let ((a, variance_a), (b, variance_b)) = (statistics(one, index), statistics(other, index));
        (a - b).abs() / (variance_a + variance_b).sqrt()
    };
    (0..9).map(distance).fold(0.0, f64::max)
}

#[test]
fn what_is_gathered_is_the_same_on_average() {
    if gpu().is_none() {
        return;
    }
    let flux = means("flux_density()", "", 0..24);
    let gaussian = means("brsm()", "", 100..124);
    let point = means("brsm(lights: point, flux_share: 0.05)", "", 200..224);
    let brighter: Vec<[f64; 9]> = flux.iter().map(|run| run.map(|value| value * 1.05)).collect();
    println!(
        "standard errors apart: gaussian {:.2}, point {:.2}, 5 % brighter {:.2}",
        apart(&flux, &gaussian),
        apart(&flux, &point),
        apart(&brighter, &gaussian)
    );
    for other in [&gaussian, &point] {
        assert!(apart(&flux, other) < 3.5);
        assert!(apart(&brighter, other) > 3.5, "the comparison sees 5 %");
    }
}
