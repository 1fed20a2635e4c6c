//! Which virtual lights each pixel sees, looked up in adaptive imperfect shadow maps: one tiny depth map per light, made of a few thousand points.
//!
//! Ritschel et al. 2008, *Imperfect Shadow Maps for Efficient Computation of Indirect Illumination*; Ritschel et al. 2011, *Making Imperfect Shadow Maps
//! View-Adaptive*. A shadow map of a virtual light need not be good: many lights are summed, and their errors average out. So each light's map
//! covers the hemisphere before it in 64 x 64 texels, the scene is drawn into it as points, and what the points miss is closed by pulling and pushing.
//!
//! What happens, in the order of the shaders in `maps.wgsl` and `look_up.wgsl`:
//!
//! 1. `weigh` (adaptive sampling only). The scene's surface is cut into patches of equal area. Each light weighs them by the solid angle that they
//!    cover before it, and by whether anything that the camera sees lies behind them. The running sum of the weights tells where points go.
//! 2. `splat`. Each point is a disk that stands for its share of the surface. A texel keeps the nearest plane whose disk it sees (`atomicMin`; a
//!    positive float's bits are ordered as it is).
//! 3. `mark_gaps`, `pull` and `push`. Texels that are empty, or that see background between nearer neighbours, refer to a near texel that is neither.
//! 4. `look_up`. Four texels around a receiver are compared with the receiver's own plane, one bit comes out.
//!
//! How the 2011 paper conditions its sampler could not be checked; patches, weights and their systematic resampling are a design of this project, and so
//! are the planes: both what is stored and what is compared is a plane met by the ray through the texel's centre, so that flat surfaces need
//! hardly any bias. Distances are taken in the norm of the hemi-octahedral map, in which the reciprocal distance of a plane is linear on each face of the map.
//!
//! Surfaces block from both sides; alpha masks are not looked at.

mod aism;
mod surface;

pub use aism::{AismPass, Params, Sampling};
pub use surface::SurfaceCurve;

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<AismPass>();
}
