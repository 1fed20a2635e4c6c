//! The WGSL module library that passes share, and the one interface behind which shaders are composed.
//!
//! In goes an entry file and a set of [`Flags`]; out comes a validated naga module. Which composer does it ([naga_oil] today) is known to
//! `composer.rs` alone.
//!
//! Modules hold no bindings and no entry points, and never import under a condition; functions take textures and values as arguments.

mod composer;
mod error;
mod flags;

pub use composer::{Composed, Composer};
pub use error::ShaderError;
pub use flags::{FlagValue, Flags};

/// A WGSL text and the path that errors show for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Source<'a> {
    /// Path from the root of the workspace, such as `crates/vpl/src/gather.wgsl`.
    pub path: &'a str,
    /// WGSL.
    pub text: &'a str,
}

macro_rules! modules {
    ($($name:literal),* $(,)?) => {
        &[$(Source {
            path: concat!("shaders/lobelia/", $name, ".wgsl"),
            text: include_str!(concat!("../lobelia/", $name, ".wgsl")),
        }),*]
    };
}

/// Every module of the library, each after the ones it imports.
pub fn modules() -> &'static [Source<'static>] {
    modules![
        "math",
        "octahedral",
        "hemi_octahedral",
        "sg",
        "sg_cosine",
        "asg",
        "cosine_lobe",
        "averaged_direction",
        "sg_light",
        "lobe_similarity",
        "packing",
        "scene",
        "area_light",
        "light",
        "surface",
        "brdf",
        "microfacet_lobe",
        "radial_primitive",
        "light_outline",
        "circular_arc",
        "ggx_half_vector",
        "anisotropic_ggx",
        "half_vector_integral",
        "area_light_outline",
        "edge_integral",
        "axial_moment",
        "sampling",
        "direction_sampling",
        "tonemap",
        "ray",
        "raster",
        "reflective_shadow_map",
        "patch_moments",
        "sampling_density",
        "virtual_lights",
        "vsgl",
        "light_visibility",
        "interleaving",
        "intersect"
    ]
}
