//! The table of `docs/imperfect-visibility.md`. It takes minutes and holds nothing against anything, so it runs only when asked for:
//!
//! ```sh
//! cargo test -p lobelia-tests --test imperfect_visibility table -- --ignored --nocapture
//! ```

use crate::given::turn;
use lobelia::{
    Session, SessionOptions, Shot,
    graph::{GraphFile, PartData, testing::gpu},
};

const LIGHTS: u32 = 256;
const EXTENT: [u32; 2] = [160, 90];

struct Outcome {
    words: Vec<u32>,
    radiance: Vec<[f32; 3]>,
}

fn outcome(session: &mut Session, visibility: &str) -> Outcome {
    let text = format!(
        r#"(passes: {{
            "gbuffer": gbuffer(), "rsm": rsm(resolution: 1024), "density": flux_density(), "lights": vpl_lights(count: {LIGHTS}),
            "visibility": {visibility}, "indirect": vpl_gather(),
        }}, output: "indirect.radiance")"#
    );
    let wired = GraphFile::parse(&text, "table.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let shot = Shot { extent: EXTENT, keep: vec!["visibility.visibility".to_owned()], ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).unwrap();
    let radiance = rendering.run(&mut |_| true).unwrap().pixels;
    let read = rendering.runner().read(rendering.gpu(), "visibility.visibility").unwrap();
    let [(_, PartData::Buffer(bytes))] = &read[..] else { panic!("one chunk") };
    Outcome { words: bytemuck::pod_collect_to_vec(bytes), radiance }
}

/// Shares of leaks and of wrongly dark bits among pairs that face each other, and the squared error of radiance over its mean square.
fn compare(one: &Outcome, exact: &Outcome, facing: &[u32]) -> [f64; 3] {
    let pairs: u32 = facing.iter().map(|word| word.count_ones()).sum();
    let count = |of: fn(u32, u32) -> u32| -> u32 {
        one.words.iter().zip(&exact.words).zip(facing).map(|((one, exact), facing)| (of(*one, *exact) & facing).count_ones()).sum()
    };
    let squares =
        |of: &dyn Fn(usize, usize) -> f64| -> f64 { (0..exact.radiance.len()).flat_map(|p| [0, 1, 2].map(|c| of(p, c).powi(2))).sum() };
    let (value, off) = (
        squares(&|pixel, channel| f64::from(exact.radiance[pixel][channel])),
        squares(&|pixel, channel| f64::from(one.radiance[pixel][channel]) - f64::from(exact.radiance[pixel][channel])),
    );
    let share = |bits: u32| f64::from(bits) / f64::from(pairs);
    [share(count(|one, exact| one & !exact)), share(count(|one, exact| !one & exact)), off / value]
}

#[test]
#[ignore = "measures, for minutes"]
fn table() {
    let (Some(_), Some(shared)) = (gpu(), lobelia_tests::shared()) else { return };
    let _turn = turn();
    let file = |name: &str| shared.join(format!("scenes/{name}/{name}.glb")).to_string_lossy().into_owned();
    for (name, scene) in
        [("cornell-glossy", "builtin:cornell-glossy".to_owned()), ("atrium", file("atrium")), ("living-room", file("living-room"))]
    {
        let mut session = Session::new(&scene, &SessionOptions::default()).unwrap();
        let exact = outcome(&mut session, "visibility()");
        // Maps of nothing but a few single texels: what is dark there faces away.
        let open = outcome(&mut session, "aism(points: 16, spread: 0.25, resolution: 256, pull_push: false)");
        let facing: Vec<u32> = open.words.iter().zip(&exact.words).map(|(open, exact)| open | exact).collect();
        let print = |what: &str, outcome: &Outcome| {
            let [leaks, dark, error] = compare(outcome, &exact, &facing).map(|share| 100.0 * share);
            println!("| {name} | {what} | {:.2} | {leaks:.2} | {dark:.2} | {error:.3} |", leaks + dark);
        };
        print("no shadows | | ", &open);
        for resolution in [16, 32, 64, 128] {
            for points in [512, 2048, 8192, 32768] {
                for sampling in ["adaptive", "uniform"] {
                    let settings = format!("aism(sampling: {sampling}, points: {points}, resolution: {resolution})");
                    print(&format!("{sampling} | {resolution} | {points}"), &outcome(&mut session, &settings));
                }
            }
        }
        for settings in [
            "pull_push: false",
            "view_samples: 0",
            "candidates: 2048",
            "spread: 1.0",
            "spread: 1.6",
            "bias: 0.0",
            "bias: 0.25",
            "bias: 1.0",
        ] {
            print(&format!("adaptive, {settings} | 64 | 8192"), &outcome(&mut session, &format!("aism({settings})")));
        }
    }
}
