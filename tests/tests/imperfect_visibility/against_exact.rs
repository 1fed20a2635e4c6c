//! Bits against those of shadow rays, in a room.

use crate::given::turn;
use lobelia::{
    Session, SessionOptions, Shot,
    graph::{GraphFile, PartData, testing::gpu},
};

const LIGHTS: u32 = 128;
const EXTENT: [u32; 2] = [48, 48];

fn words(visibility: &str) -> Vec<u32> {
    let text = format!(
        r#"(passes: {{
            "gbuffer": gbuffer(), "rsm": rsm(resolution: 128), "density": flux_density(), "lights": vpl_lights(count: {LIGHTS}),
            "visibility": {visibility}, "indirect": vpl_gather(),
        }}, output: "indirect.radiance")"#
    );
    let wired = GraphFile::parse(&text, "test.ron").unwrap().wire(&lobelia::registry(), &[], &[]).unwrap();
    let options = SessionOptions { baseline: true, ..SessionOptions::default() };
    let mut session = Session::new("builtin:cornell-glossy", &options).unwrap();
    let shot = Shot { extent: EXTENT, keep: vec!["visibility.visibility".to_owned()], ..Shot::default() };
    let mut rendering = session.start(&wired, &shot).unwrap();
    rendering.run(&mut |_| true).unwrap();
    let read = rendering.runner().read(rendering.gpu(), "visibility.visibility").unwrap();
    let [(_, PartData::Buffer(bytes))] = &read[..] else { panic!("one chunk") };
    bytemuck::pod_collect_to_vec(bytes)
}

/// Bits that differ, as a share of those that `exact` has set.
fn differing(words: &[u32], exact: &[u32]) -> f64 {
    let count = |words: &mut dyn Iterator<Item = u32>| words.map(u32::count_ones).sum::<u32>();
    f64::from(count(&mut words.iter().zip(exact).map(|(a, b)| a ^ b))) / f64::from(count(&mut exact.iter().copied()))
}

#[test]
fn few_bits_differ_from_those_of_shadow_rays() {
    if gpu().is_none() {
        return;
    }
    let _turn = turn();
    let exact = words("visibility()");
    let adaptive = differing(&words("aism()"), &exact);
    let uniform = differing(&words("aism(sampling: uniform)"), &exact);
    let coarse = differing(&words("aism(resolution: 16)"), &exact);
    // Points that are so small that nothing is hidden: what is left is which sides surfaces turn to each other.
    let open = differing(&words("aism(points: 16, spread: 0.25, resolution: 256, pull_push: false)"), &exact);
    println!("adaptive {adaptive:.4}, uniform {uniform:.4}, 16 texels {coarse:.4}, open {open:.4}");
    assert!(adaptive < 0.04, "{adaptive}");
    assert!(adaptive < uniform && uniform < 0.06, "{adaptive} {uniform}");
    assert!(coarse > 1.5 * adaptive, "larger texels, worse edges: {coarse} {adaptive}");
    // What must not pass: no shadows, and maps of other lights.
    assert!(open > 0.2, "{open}");
    let pixels = (EXTENT[0] * EXTENT[1]) as usize;
    let mut shifted = words("aism()");
    shifted.rotate_left(pixels);
    assert!(differing(&shifted, &exact) > 0.2);
}
