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
//! **Importance.** `mean` is as published. `relative`, the default, divides `L(t -> x)` by the brightness of x, estimated with 32 texels picked by flux, plus a tenth of
//! the mean of these, and takes the root of the mean square: with that density the mean relative squared error of pixels would be least, were it not for
//! visibility. The mean spends lights on the brightest pixels, which need them least.
//!
//! Cells, the ratio to flux, runs that workgroups share and relative importance are designs of this project. The view samples are points: the brief
//! filters them.
//!
//! **Stability.** The view samples are fixed in screen space by the seed: a camera that moves by a hundredth of a pixel changes 0.02 % of the weights of
//! `builtin:cornell-glossy`, another seed 14 %. There is no smoothing over frames.
//!
//! **Error.** Relative squared error of `indirect.radiance` at 128 x 96 pixels, exact visibility, a clamp of 10 per square metre, against 32768 lights of the same estimator (half of them
//! by flux), without the worst hundredth of the pixels; means over four seeds, with 256 / 1024 lights. Standard errors are 2 to 10 %.
//!
//! | density | `cornell-glossy` | ring caustic | atrium | living room |
//! | --- | --- | --- | --- | --- |
//! | `flux-density` | 0.018 / 0.0032 | 0.121 / 0.059 | 0.054 / 0.016 | 0.043 / 0.0131 |
//! | `brsm`: gaussian, relative | 0.015 / 0.0026 | 0.108 / 0.035 | 0.042 / 0.011 | 0.031 / 0.0069 |
//! | point, relative | 0.013 | 0.101 | 0.052 | 0.030 |
//! | gaussian, mean | 0.030 | 0.126 | 0.048 | 0.060 |
//!
//! So it saves a sixth to a half of the lights. The median pixel gains nothing, and with the worst hundredth counted too (glossy lobes that meet a single light) the mean is
//! too noisy to tell the densities apart. Disks and points differ by no more than the noise in three of the four scenes; in the atrium disks are better. More patches
//! (1024 instead of 16), so smaller disks, make the glossy box worse than flux does (0.022, with a share of 0.15): weights gather where surfaces meet, whose
//! light the clamp of `vpl-gather` bounds.
//!
//! **Time.** On a software device `brsm` takes 13 % of a frame of 240 x 240 pixels and 256 lights with exact visibility, where `flux-density` takes 1.4 %; it does not grow
//! with the picture, nor with the number of lights.

mod density;

pub use density::{BrsmParams, BrsmPass, Importance, Lights};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the pass of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<BrsmPass>();
}
