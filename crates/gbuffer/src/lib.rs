//! The surface that the camera sees, and the light that it emits.
//!
//! [`gbuffer`](GBufferPass) draws the scene once and keeps, at every pixel centre, what later passes need to light the surface there: depth, shading
//! normal, base colour, and where the scene has them roughness and metallic, the geometric normal behind a normal map, emission. It is packed into
//! 12 to 24 bytes; `lobelia::surface` is the only place that knows how.
//!
//! Positions are not stored: `lobelia::scene::scene_position` rebuilds them from reverse-Z depth (Reed 2015, *Depth Precision Visualized*) with a
//! relative error of 2^-23 of the distance to the camera. Because the device works in scene space (world minus a whole-metre origin), that
//! figure holds at any distance from the world's origin: a square seen from 2.5 m is rebuilt to 1.8e-7 m at the origin and to 1.9e-7 m at 14 km.
//!
//! [`emission`](EmissionPass) turns emission and environment into radiance, so that light sources are seen.

mod emission;
mod gbuffer;

pub use emission::EmissionPass;
pub use gbuffer::GBufferPass;

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<GBufferPass>().add::<EmissionPass>();
}
