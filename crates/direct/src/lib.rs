//! Direct light of point, spot and directional lights: light that scatters exactly once on its way to the eye.
//!
//! For every pixel and light, `f(l, v) E (n.l)` with the glTF reflectance `f` (`lobelia::brdf`) and the irradiance `E` that the light sends there
//! (`lobelia::light`), times whether the light is seen.
//!
//! # Shadows
//!
//! The reflective shadow map of the light answers that. A depth comparison needs a bias, and every bias either leaves acne or lets light under objects.
//! Here each texel is taken for what it is: a piece of a plane, with a normal. The plane is met with the very ray that goes to the shaded point,
//! and the point is in shadow if the plane is met earlier. For flat casters and receivers this is exact up to rounding, however coarse the map and
//! however steep the angle, so the bias only covers curvature: `bias` texels' worth of distance, plus 2^-12 of the distance for rounding. Neighbouring
//! texels are weighted as percentage-closer filtering does (Reeves et al. 1987).
//!
//! Measured on the glossy box against a path-traced reference, 1024 texels, relative MSE away from edges: without a bias 3.1e-5 with planes and 4.3e-2
//! with plain depths, which cover everything with acne. With a bias of one texel, scaled by the slope, plain depths do as well (3.1e-5), at the price
//! that the bias has to be known. Over the whole picture both are at 1.3e-3, where shadow edges one texel wide decide: 3.9e-3 with 512 texels,
//! 2.0e-2 with 256. `comparison: depth` is there so that this can be measured again.

mod direct;

pub use direct::{Comparison, DirectPass, Params};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<DirectPass>();
}
