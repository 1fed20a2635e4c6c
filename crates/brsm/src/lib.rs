//! Bidirectional reflective shadow maps (Ritschel et al. 2011, *Making Imperfect Shadow Maps View-Adaptive*): virtual lights where they count in the picture.
//!
//! Picking texels by the flux that they reflect spends lights on walls that nobody sees and on patches that shine past what the camera sees. [`brsm`](BrsmPass)
//! weighs each texel t by what it would send to the camera as a virtual light, estimated at a few pixels:
//!
//! ```text
//!   p(t) = (1 - share) c(t) / mean(c) + share P(t) / mean(P),      c(t) = sqrt(mean over view samples x of L(t -> x)^2)   or   mean over x of L(t -> x)
//! ```
//!
//! with `P` the reflected flux that `flux-density` weighs by and `L(t -> x)` the luminance of the radiance that `t` sends to the camera by way of x, without
//! visibility. Lights are picked in proportion to `p` and their flux is divided by it, so the picture has the same mean whatever `c` is; the share of flux keeps `p`
//! positive where light is reflected, and bounds what a texel that `c` has missed can do. Where the camera sees nothing, or nothing that reflects, the weights
//! are those of flux.
//!
//! **Steps.** `weigh` writes `P` and the sums of it over 2 x 2 texels and so on. `estimate` works on cells: texels of one level of these sums, so that the cost
//! does not grow with the map. It finds `r = c / P` for each, drawing texels of the cell as likely as they reflect flux, against a run of the points of the R2
//! sequence over the screen; every run of that sequence is spread over all of the picture. A workgroup holds 64 cells that lie far apart against
//! one run, so that neighbours meet other runs, and `blur` brings them together by a tent of 3 x 3 cells weighted by flux. `combine` multiplies `P` of every texel by
//! `(1 - share) r / mean(r) + share`: texture and edges of the map stay sharp.
//!
//! **Lights.** `point` is the form of 2011: the two reflectances at texel and pixel over the squared distance, which is bounded below by the radius of the
//! disk that the texel stands for. `gaussian` is that of Tokuyoshi 2014, *Virtual Spherical Gaussian Lights for Real-Time Glossy Indirect Illumination*,
//! section 3.2: the disk is seen as a cone, its specular lobe is an SG, and the products are integrated over the lobe of the pixel, so that `c` has no
//! singularity and a mirror that narrowly misses the centre of a texel still counts. The disk's area is that of the patch of one of `patches` lights, and no
//! smaller than the cell. Far from the patches the forms agree, to 5e-6 on diffuse surfaces and to about a tenth on glossy ones.
//!
//! Cells, the ratio to flux, runs that workgroups share and the root mean square are designs of this project. The view samples are points: the brief
//! filters them.
//!
//! **Stability.** The view samples are fixed in screen space by the seed: a camera that moves by a hundredth of a pixel changes 0.03 % of the weights of
//! `builtin:cornell-glossy`, another seed 24 %. There is no smoothing over frames.
//!
//! TABLE

mod density;

pub use density::{BrsmParams, BrsmPass, Importance, Lights};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the pass of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<BrsmPass>();
}
