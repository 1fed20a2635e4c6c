//! Virtual point lights (Keller 1997, *Instant Radiosity*; Dachsbacher and Stamminger 2006, *Splatting Indirect Illumination*).
//!
//! One bounce of indirect light is direct light from the patches that the light sources reach. [`vpl-lights`](VplLightsPass) picks N patches from the
//! reflective shadow maps, as likely as a sampling density says (in proportion to the flux that they reflect, say); [`vpl-gather`](VplGatherPass) adds
//! up, at every pixel x with view direction v, what they send there:
//!
//! ```text
//!   L(x, v) = sum_j  f(x; l_j, v)  (n_x . l_j)  V_j  I_j(-l_j) / d_j^2,      I_j(w) = Phi_j f(y_j; s_j, w) (n_j . w)
//! ```
//!
//! with `Phi_j` the incident flux of the patch's texel over `N` times its probability, `s_j` the direction to the source, and `f` the full glTF reflectance
//! at both ends, glossy lobes included. The sum is an unbiased estimate of `_indirect1` of the reference images, with two well-known vices: it has
//! spots where a patch is near (`1/d^2`), which `clamp` bounds at the price of energy in corners, and glossy lobes turn single lights into
//! blotches, which is what virtual spherical Gaussian lights were made for.
//!
//! Lights stand at the centres of texels. Spread over their texels' planes they would look less regular where the map is coarse, but half of those in
//! texels that an edge runs through would lie behind the next wall, and light nobody: on `builtin:cornell-diffuse` that loses 0.5 % of the mean
//! radiance with maps of 512 texels a side and 1.4 % with 64, where centres are within 0.1 % and 0.3 %.

mod gather;
mod lights;

pub use gather::{VplGatherParams, VplGatherPass};
pub use lights::{VplLightsParams, VplLightsPass};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<VplLightsPass>().add::<VplGatherPass>();
}
