//! The saved inputs of the fuzz targets, and what becomes of them when bytes change: nothing panics, and what must be read still is.
#![allow(clippy::unwrap_used)]

use lobelia_tests::{
    root,
    untrusted::{TARGETS, read},
};
use std::time::{Duration, Instant};

/// Saved inputs of a target, by name.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = root().join("fuzz/corpus").join(target);
    let mut inputs: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            (path.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(path).unwrap())
        })
        .collect();
    inputs.sort();
    inputs
}

#[test]
fn saved_inputs_are_read_or_refused() {
    let read_whole = ["indirect.ron", "cornell.ron", "triangle.gltf", "triangle.glb", "grey.exr", "grey.hdr", "variants.txt"];
    let mut accepted = Vec::new();
    for target in TARGETS {
        for (name, bytes) in corpus(target) {
            let start = Instant::now();
            if read(target, &bytes) {
                accepted.push(name.clone());
            }
            assert!(start.elapsed() < Duration::from_secs(20), "{target}/{name} takes {:?}", start.elapsed());
        }
    }
    for name in read_whole {
        assert!(accepted.iter().any(|accepted| accepted == name), "{name} is not read: {accepted:?}");
    }
    for name in ["huge-count.gltf", "deep.gltf", "loop.gltf", "deep.ron", "huge.png", "huge.hdr", "huge.exr", "odd.txt", "deep.txt"] {
        assert!(!accepted.iter().any(|accepted| accepted == name), "{name} is read");
    }
}

/// One of the ways in which a file goes wrong.
fn damaged(bytes: &[u8], next: &mut impl FnMut() -> usize) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + next() % 3 {
        let length = bytes.len().max(1);
        let (at, count) = (next() % length, next() % 16);
        let end = (at + count).min(bytes.len());
        match next() % 6 {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at.min(end)..end)),
            2 => {
                let copy = bytes[at.min(end)..end].to_vec();
                bytes.splice(at.min(end)..at.min(end), copy);
            }
            3 => bytes[at.min(end)..end].fill([0, 255, b'9', b'-'][next() % 4]),
            4 if at < bytes.len() => bytes[at] ^= 1 << (next() % 8),
            // Another number in place of one.
            _ => {
                if let Some(digit) = (at..bytes.len()).find(|index| bytes[*index].is_ascii_digit()) {
                    let number = ["4294967295", "-1", "1e39", "0", "1e-40", "18446744073709551615"][next() % 6];
                    bytes.splice(digit..=digit, number.bytes());
                }
            }
        }
    }
    bytes
}

#[test]
fn damaged_inputs_do_not_panic() {
    let seconds: Option<u64> = std::env::var("LOBELIA_FUZZ").ok().and_then(|text| text.parse().ok());
    for target in TARGETS {
        let inputs: Vec<_> = corpus(target).into_iter().filter(|(_, bytes)| bytes.len() < 16_000).collect();
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize
        };
        let start = Instant::now();
        let mut runs = 0;
        while seconds.map_or(runs < 60, |seconds| start.elapsed() < Duration::from_secs(seconds)) {
            let (name, bytes) = &inputs[next() % inputs.len()];
            let bytes = damaged(bytes, &mut next);
            let begin = Instant::now();
            let result = std::panic::catch_unwind(|| read(target, &bytes));
            let slow = begin.elapsed() > Duration::from_secs(10);
            if result.is_err() || slow {
                let saved = std::env::temp_dir().join(format!("lobelia-{target}-{runs}"));
                std::fs::write(&saved, &bytes).unwrap();
                panic!("{target}: {name}, damaged ({}), {}", saved.display(), if slow { "takes too long" } else { "panics" });
            }
            runs += 1;
        }
        println!("{target}: {runs} inputs in {:?}", start.elapsed());
    }
}
