//! Imperfect shadow maps: against a scene whose answer is known, against exact visibility, and on input at the ends of what is allowed.
#![allow(clippy::unwrap_used, missing_docs)]

mod against_exact;
mod extremes;
mod geometry;
#[allow(dead_code)]
#[path = "../virtual_lights/given.rs"]
mod given;
mod refuse;
mod table;

use given::{EXTENT, PIXELS};
use lobelia::frame::SceneWorld;
use lobelia::graph::{Gpu, PartData, Runner};

/// Bits of one chunk that is interleaved k x k.
pub struct Bits {
    words: Vec<u32>,
    interleave: u32,
}

impl Bits {
    pub fn read(runner: &Runner<SceneWorld>, gpu: &Gpu, interleave: u32) -> Self {
        let read = runner.read(gpu, "visibility.visibility").unwrap();
        let [(_, PartData::Buffer(bytes))] = &read[..] else { panic!("one chunk") };
        Self { words: bytemuck::pod_collect_to_vec(bytes), interleave }
    }

    /// Whether a pixel sees a light; `None` if it does not know it.
    pub fn sees(&self, pixel: usize, light: u32) -> Option<bool> {
        let (x, y) = (pixel as u32 % EXTENT[0], pixel as u32 / EXTENT[0]);
        let (k, subsets) = (self.interleave, self.interleave * self.interleave);
        let order = light / subsets;
        (light % subsets == x % k + k * (y % k)).then(|| self.words[order as usize / 32 * PIXELS + pixel] >> (order % 32) & 1 == 1)
    }
}
