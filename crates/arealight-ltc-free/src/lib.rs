//! Area lights.

mod area_light;

pub use area_light::{AreaLightPass, EdgeIntegral, Lobe, Method, Params};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<AreaLightPass>();
}
