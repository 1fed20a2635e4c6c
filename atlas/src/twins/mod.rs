//! Every WGSL lobe function with inputs and bounds, a module each.

mod asg;
mod averaged_direction;
mod brdf;
mod cosine_lobe;
mod lobe_similarity;
mod microfacet_lobe;
mod sampling;
mod sg;
mod sg_cosine;
mod sg_light;

use crate::twin::Twin;

/// All twins.
pub fn all() -> Vec<Twin> {
    let rooms = [
        sg::twins,
        sg_cosine::twins,
        cosine_lobe::twins,
        asg::twins,
        averaged_direction::twins,
        sg_light::twins,
        lobe_similarity::twins,
        brdf::twins,
        microfacet_lobe::twins,
        sampling::twins,
    ];
    rooms.into_iter().flat_map(|twins: fn() -> Vec<Twin>| twins()).collect()
}
