//! The mathematics that several rooms share, in `f64` and without a device: reflectance, falloff, encodings, point sets, tone curves.
//!
//! Every function that also exists in WGSL has the same name there; a device test (`tests/tests/twins.rs`) holds the two together over the whole domain.

pub mod anisotropic_ggx;
pub mod area_light;
pub mod asg;
pub mod asg_product;
pub mod averaged_direction;
pub mod brdf;
pub mod cosine_lobe;
pub mod light;
pub mod linearly_transformed_cosine;
pub mod lobe_similarity;
pub mod microfacet_lobe;
pub mod octahedral;
pub mod packing;
pub mod quadrature;
pub mod sampling;
pub mod sg;
pub mod sg_cosine;
pub mod sg_light;
pub mod special;
pub mod specular_albedo;
pub mod tonemap;
pub mod vsgl;

/// Relative luminance of linear Rec. 709 colour.
pub fn luminance(color: glam::DVec3) -> f64 {
    color.dot(glam::DVec3::new(0.2126, 0.7152, 0.0722))
}
