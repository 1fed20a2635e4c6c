//! Accumulation over frames: [`progressive`](ProgressivePass) shows the mean of all frames since the picture last changed.
//!
//! A technique that draws random numbers is a little wrong in every frame, each time differently. While neither scene nor camera moves, the mean of n
//! frames has 1/n of the variance, and whatever is left in the limit is bias: the error that no patience removes.
//!
//! The sum is an integer. A half float is a multiple of 2^-24 below 2^16, so that 40 bits hold it, and 64 bits the sum of 2^24 frames, exactly.
//! A sum in `f32` stalls once it is 2^24 times what is added, and a running mean once the n-th part of a change is below its last place; sums that
//! carry their rounding error along are compensated only as long as no shader compiler simplifies them, as WGSL permits. Integers depend on neither.
//!
//! The mean starts anew with the history of the graph (a parameter, a variant, the size) and with every change of the scene or of the camera;
//! the offset of samples within pixels is no such change.

mod progressive;

pub use progressive::{ProgressiveParams, ProgressivePass};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the pass of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<ProgressivePass>();
}
