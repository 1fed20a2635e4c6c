//! From terms of radiance to a picture: [`compose`](ComposePass) adds them up, [`tonemap`](TonemapPass) turns the sum into display colours.

mod compose;
mod tonemap;

pub use compose::ComposePass;
pub use tonemap::{Curve, TonemapParams, TonemapPass};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<ComposePass>().add::<TonemapPass>();
}
