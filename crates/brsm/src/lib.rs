//! Bidirectional reflective shadow maps.

mod density;

pub use density::{BrsmParams, BrsmPass, Importance, Lights};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the pass of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<BrsmPass>();
}
