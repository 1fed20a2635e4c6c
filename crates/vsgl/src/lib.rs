//! Virtual spherical Gaussian lights.

mod gather;
mod lights;
mod two_lights;

pub use gather::{Form, Show, VsglGatherParams, VsglGatherPass};
pub use lights::{Kernel, VsglLightsParams, VsglLightsPass};
pub use two_lights::TwoVsglPass;

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<VsglLightsPass>().add::<VsglGatherPass>().add::<TwoVsglPass>();
}
