//! Reflective shadow maps (Dachsbacher and Stamminger 2005, *Reflective Shadow Maps*).
//!
//! Every punctual light draws the scene from where it stands. A texel of the map is a small patch that the light reaches; it keeps depth, normals and
//! material in the same packing as the G-buffer. Two uses follow: the depth is a shadow map for direct light, and the patches, each reflecting the flux that
//! falls through its texel, are the sources of one bounce of indirect light.
//!
//! The flux through a texel is `intensity * solid angle`, with the solid angle `texel area on the plane at distance 1 * cos^3` (no receiver cosine:
//! flux is already projected), or `irradiance * texel area` for directional lights. `lobelia::reflective_shadow_map` is the accessor for all of this.
//!
//! A spot light is seen by one square face of its outer cone; point lights and spots wider than 65 degrees take the six faces of a cube, exactly
//! 90 degrees each so that they meet without a seam. Near planes lie before the nearest triangle. A directional light takes one orthographic face fitted around
//! the scene, and, where cameras see less than a sixteenth of it, further ones that lie in each other around what the camera sees: a point's flux belongs to
//! the finest face that holds it. Faces have a layer each, or share layers where they are more than 256; where they would take too much memory they have
//! fewer texels than asked for, and the pass warns.

mod faces;
mod flux_density;
mod patch_moments;
mod rsm;

pub use flux_density::FluxDensityPass;
pub use patch_moments::{PatchMomentsParams, PatchMomentsPass};
pub use rsm::{Params, RsmPass};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<RsmPass>().add::<FluxDensityPass>().add::<PatchMomentsPass>();
}
