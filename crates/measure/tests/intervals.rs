//! Intervals and ties on made-up techniques whose truth is known: intervals hold it about as often as they say, the same technique with other random numbers is a tie,
//! and a planted difference is found.
#![allow(clippy::unwrap_used)]

use lobelia_measure::{
    Image, Pictures, measure_replicates,
    sampled::{Difference, Outcome, Replication, SHOWN_LEVEL, Sampled},
};
use std::collections::BTreeMap;

const SIZE: [usize; 2] = [10, 8];
const VALUES: usize = SIZE[0] * SIZE[1];

/// Uniform numbers, and sums of twelve of them, which are nearly normal.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut x = self.0 ^ (self.0 >> 33);
        x = x.wrapping_mul(0xff51_afd7_ed55_8ccd);
        ((x ^ (x >> 33)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn truth() -> Image {
    let value = |index: usize| 0.2 + (index % SIZE[0]) as f32 * 0.1 + (index / SIZE[0]) as f32 * 0.05;
    Image {
        width: SIZE[0],
        height: SIZE[1],
        pixels: (0..VALUES).map(|index| [value(index), 0.8 * value(index), 0.5 * value(index)]).collect(),
    }
}

/// A technique: relative bias, and relative noise of one sample, for each pixel and for bands of the picture, as virtual lights make it.
#[derive(Clone, Copy)]
struct Technique {
    bias: f64,
    noise: f64,
    bands: f64,
}

impl Technique {
    fn sample(&self, random: &mut Random) -> Image {
        let bands: Vec<f64> = (0..16).map(|_| random.normal()).collect();
        let pixel = |(index, pixel): (usize, &[f32; 3])| {
            let factor = 1.0 + self.bias + self.noise * random.normal() + self.bands * bands[index * 16 / VALUES];
            pixel.map(|value| (f64::from(value) * factor) as f32)
        };
        Image { pixels: truth().pixels.iter().enumerate().map(pixel).collect(), ..truth() }
    }

    /// Sixteen samples in eight groups.
    fn pictures(&self, random: &mut Random) -> Pictures {
        let samples: Vec<Image> = (0..16).map(|_| self.sample(random)).collect();
        let parts: Vec<Image> = (0..8).map(|group| mean(&[&samples[group], &samples[group + 8]])).collect();
        Pictures { image: mean(&parts.iter().collect::<Vec<_>>()), replication: Replication::LeaveOut(vec![0.125; 8]), parts }
    }

    /// One sample, and five with other random numbers.
    fn single(&self, random: &mut Random) -> Pictures {
        let image = self.sample(random);
        let parts = std::iter::once(image.clone()).chain((0..5).map(|_| self.sample(random))).collect();
        Pictures { image, replication: Replication::Repeats, parts }
    }
}

fn mean(images: &[&Image]) -> Image {
    let pixel = |index: usize| {
        [0, 1, 2].map(|channel| {
            let sum: f64 = images.iter().map(|image| f64::from(image.pixels[index][channel])).sum();
            (sum / images.len() as f64) as f32
        })
    };
    Image { pixels: (0..VALUES).map(pixel).collect(), ..truth() }
}

const REFERENCE_NOISE: f64 = 0.02;

/// The truth with noise, and the variance of that.
fn reference(random: &mut Random) -> (Image, Vec<[f32; 3]>) {
    let moved = |pixel: &[f32; 3]| {
        let factor = 1.0 + REFERENCE_NOISE * random.normal();
        pixel.map(|value| (f64::from(value) * factor) as f32)
    };
    let image = Image { pixels: truth().pixels.iter().map(moved).collect(), ..truth() };
    let variance = truth().pixels.iter().map(|pixel| pixel.map(|value| (f64::from(value) * REFERENCE_NOISE).powi(2) as f32)).collect();
    (image, variance)
}

type Make = fn(&Technique, &mut Random) -> Pictures;

/// One trial: techniques against a reference of their own.
fn trial(techniques: &[Technique], make: Make, random: &mut Random) -> Vec<BTreeMap<&'static str, Sampled>> {
    let (reference, variance) = reference(random);
    let pictures: Vec<Pictures> = techniques.iter().map(|technique| make(technique, random)).collect();
    measure_replicates(&reference, &variance, &pictures).unwrap()
}

const TRIALS: usize = 150;
const NAMES: [&str; 6] = ["relative_mse", "rmse", "mae", "psnr", "flip_hdr", "mean_ratio"];

#[test]
fn intervals_hold_the_truth_about_as_often_as_they_say() {
    let techniques = [
        ("bias", Technique { bias: 0.1, noise: 0.1, bands: 0.05 }),
        ("noise", Technique { bias: 0.0, noise: 0.4, bands: 0.1 }),
        ("bands", Technique { bias: 0.03, noise: 0.05, bands: 0.4 }),
    ];
    for (what, technique) in techniques {
        for (kind, make) in [("groups", Technique::pictures as Make), ("repeats", Technique::single)] {
            let mut random = Random(7);
            let trials: Vec<_> = (0..TRIALS).map(|_| trial(&[technique], make, &mut random).remove(0)).collect();
            for name in NAMES {
                // What the measurement gives on average, from all trials.
                let expected = trials.iter().map(|found| found[name].value).sum::<f64>() / TRIALS as f64;
                let held = trials.iter().filter(|found| {
                    let interval = found[name].interval(SHOWN_LEVEL).unwrap();
                    interval.low <= expected && expected <= interval.high
                });
                let rate = held.count() as f64 / TRIALS as f64;
                eprintln!("{what} {kind} {name}: {rate:.3}");
                assert!(rate >= 0.9, "{what}, {kind}: the interval of {name} holds its mean in {rate} of the trials");
                // Not by being far too wide: the spread of values is that of the standard errors, within a factor of two.
                let spread = trials.iter().map(|found| (found[name].value - expected).powi(2)).sum::<f64>() / TRIALS as f64;
                let said = trials.iter().map(|found| found[name].standard_error().unwrap().size.powi(2)).sum::<f64>() / TRIALS as f64;
                let ratio = (said / spread).sqrt();
                assert!((0.8..2.0).contains(&ratio), "{what}, {kind}: the standard error of {name} is {ratio} times its spread");
            }
        }
    }
}

/// How often each outcome comes of two techniques, by metric.
fn outcomes(first: Technique, second: Technique, make: Make, name: &str) -> [usize; 3] {
    let mut random = Random(11);
    let mut counts = [0; 3];
    for _ in 0..TRIALS {
        let found = trial(&[first, second], make, &mut random);
        match Difference::paired(&found[0][name], &found[1][name]).outcome(0.0) {
            Outcome::First => counts[0] += 1,
            Outcome::Second => counts[1] += 1,
            Outcome::Tie => counts[2] += 1,
        }
    }
    counts
}

#[test]
fn one_technique_with_other_random_numbers_is_a_tie() {
    for technique in [Technique { bias: 0.1, noise: 0.1, bands: 0.05 }, Technique { bias: 0.0, noise: 0.3, bands: 0.2 }] {
        for make in [Technique::pictures as Make, Technique::single] {
            for name in ["relative_mse", "flip_hdr"] {
                let [first, second, _] = outcomes(technique, technique, make, name);
                assert!(first + second <= TRIALS / 25, "{name}: {} of {TRIALS} are told apart", first + second);
            }
        }
    }
}

/// Half as much bias again is seen nearly always, and never the wrong way round.
#[test]
fn a_planted_difference_is_found() {
    let (better, worse) = (Technique { bias: 0.1, noise: 0.1, bands: 0.05 }, Technique { bias: 0.15, noise: 0.1, bands: 0.05 });
    for name in ["relative_mse", "flip_hdr"] {
        let [found, wrong, _] = outcomes(better, worse, Technique::pictures, name);
        assert!(found >= TRIALS * 9 / 10 && wrong == 0, "{name}: found {found}, wrong {wrong} of {TRIALS}");
        let [wrong, found, _] = outcomes(worse, better, Technique::pictures, name);
        assert!(found >= TRIALS * 9 / 10 && wrong == 0, "{name}: found {found}, wrong {wrong} of {TRIALS}");
    }
}

/// The noise of the reference alone makes intervals, and a floor that a perfect picture meets.
#[test]
fn the_noise_of_the_reference_counts() {
    let mut random = Random(3);
    let (noisy, variance) = reference(&mut random);
    let still = Technique { bias: 0.05, noise: 0.0, bands: 0.0 }.pictures(&mut random);
    let with = measure_replicates(&noisy, &variance, std::slice::from_ref(&still)).unwrap();
    let without = measure_replicates(&noisy, &[], &[still]).unwrap();
    let size = |found: &[BTreeMap<&str, Sampled>]| found[0]["relative_mse"].standard_error().unwrap().size;
    assert!(size(&with) > 1e-5 && size(&without) < 1e-3 * size(&with), "{} {}", size(&with), size(&without));
    assert_eq!(with[0]["relative_mse"].value, without[0]["relative_mse"].value);
    let floor = lobelia_measure::noise_floor(&noisy, &variance).unwrap();
    let perfect = lobelia_measure::measure(&noisy, &truth()).unwrap();
    assert!((floor.relative_mse / perfect.relative_mse - 1.0).abs() < 0.5, "{} {}", floor.relative_mse, perfect.relative_mse);
    assert!((floor.flip_hdr / perfect.flip_hdr - 1.0).abs() < 0.5, "{} {}", floor.flip_hdr, perfect.flip_hdr);
    assert!(measure_replicates(&noisy, &variance[1..], &[Pictures::alone(truth())]).is_err());
    assert!(measure_replicates(&noisy, &variance, &[Pictures { parts: vec![truth()], ..Pictures::alone(truth()) }]).is_ok());
    let shares = Replication::LeaveOut(vec![0.5]);
    assert!(measure_replicates(&noisy, &variance, &[Pictures { replication: shares, ..Pictures::alone(truth()) }]).is_err());
}
