//! Virtual spherical Gaussian lights (VSGLs): one bounce of glossy indirect light, caustics included, without the bright spots of point lights.
//!
//! A virtual point light sends `1 / d^2` into corners, and a glossy lobe makes a spot of it. Tokuyoshi 2014 (*Virtual Spherical Gaussian Lights for Real-Time
//! Glossy Indirect Illumination*, SIGGRAPH Asia Technical Briefs) takes each light for a patch with an extent and a lobe, both as wide as the light's share of
//! the reflective shadow map, so that the sum over lights is smooth however glossy surfaces are.
//!
//! # From map to picture
//!
//! 1. `patch-moments` (crate `rsm`) averages the map's texels over blocks: position and variance, normal, reflected flux, direction and width of specular lobes.
//! 2. [`vsgl-lights`](VsglLightsPass) picks texels as a sampling density says and reads for each the patch around it. With a share of the density of
//!    `overlap / N`, the patch's level is that at which the blocks around the texel hold this share; its radius is `r^2 = 2 sigma^2`, that of a uniform
//!    disk with the same variance. For a density p that is constant over the patch the level is `-1/2 log2(p N / overlap)`, with p per texel
//!    (Krivanek and Colbert 2008; the brief's `h_max - 1/2 log2(N p / k)` with p over the unit square).
//! 3. [`vsgl-gather`](VsglGatherPass) adds up, at every pixel, what the patches send there, in closed form (`lobelia::vsgl`).
//!
//! [`two-vsgl`](TwoVsglPass) sums a whole scene up as two lights, after Tokuyoshi 2015.
//!
//! # What is ours
//!
//! Measured on the glossy box, the ring, the atrium and the living room (see `docs/vsgl`), each of these was worth its place:
//!
//! - **The disk's own irradiance.** Instead of a cone about the light's centre with cosines pulled out of the integral, the irradiance vector of a uniform
//!   disk in closed form. The pulled-out cosine at the light goes to zero near its plane, and with it all light within a radius of a corner: of the
//!   diffuse box's mean radiance the cone loses 9 to 6 %, the disk 3 to 1 %.
//! - **GGX at both ends.** The lobe of the light and that of the surface are GGX filtered by the light's extent (Tokuyoshi et al. 2024), not SGs. For a
//!   radius of 0 both are GGX itself: the picture of point lights comes out to 1e-9 in relative MSE, where SG lobes lose a fifth of it.
//! - **Flux over density, both averaged.** A light's power is the patch's mean flux over the patch's mean weight. Where the density follows the flux every
//!   light gets the same, also at the rim of what is lit; with the density at the centre alone (`kernel: centre`) the light that is blurred beyond the rim is lost.
//! - **Patches stay on their surface.** Blocks whose positions or normals vary more than those of a flat or evenly curved surface do not count.
//! - **Half the shift.** A patch's mean lies on its brighter side. Lights drawn there by half the way lose, to second order, the blur that their radius brings.
//! - **The share as least radius.** Among leaves and folds patches find no room; a light there keeps the radius of its share instead of becoming a point.
//!
//! # Bias
//!
//! Patches blur, and what is blurred is missing in corners. `overlap` and N trade that against noise; `bias_reduction` is the brief's consistent way out: where all
//! lobes are flat over the cone, the patch is gathered as a point with the reflectance of both ends, so that with N (and the map's resolution) the picture
//! converges to that of point lights, which has no bias.

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
