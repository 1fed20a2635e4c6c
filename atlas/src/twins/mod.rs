//! Every WGSL lobe function with inputs and bounds, a module each.

mod averaged_direction;
mod microfacet_lobe;
mod lobe_similarity;
mod sampling;
mod sg_light;

use crate::twin::Twin;

/// All twins.
pub fn all() -> Vec<Twin> {
    [averaged_direction::twins(), lobe_similarity::twins(), sg_light::twins(), microfacet_lobe::twins(), sampling::twins()].into_iter().flatten().collect()
}
