//! Direct light of polygons, disks and spheres of uniform radiance, in closed form: no samples, and no fitted tables.
//!
//! For every pixel and light, the integral of reflectance times cosine over the solid angle that the light fills, as integrals along the light's outline.
//!
//! 1. `lobelia::area_light_outline` gives the outline in the frame of the surface: the corners of a polygon in the order in which they run counter-clockwise as seen
//!    from there, or the rim at which a disk or solid is seen. Disks and spheres may be ellipses and ellipsoids.
//! 2. `lobelia::light_outline` walks along it and leaves out what is below the horizon. It stores no corner, so outlines may have any number and need not be convex.
//!    Rims are taken for arcs of circles (`lobelia::circular_arc`).
//! 3. Every line or arc adds Lambert's term and that of the specular lobe.
//!
//! The specular lobe of a microfacet surface is an integral over half vectors, along whose outline it becomes one of a rational function for GGX (`lobelia::ggx_half_vector`), and one of
//! the distribution's radial primitive for others (`lobelia::half_vector_integral`). What the lobe is multiplied with is evaluated at the mean half vector of lobe and light. This is exact
//! but for a quadrature of a few nodes on either side of an edge's peak, for rims of ellipses, and for that one evaluation.
//!
//! Beside it are the methods of Lecocq, Dufay, Sourimant and Marvie, *Analytic Approximations for Real-Time Area Light Shading* (TVCG 2017), with their errata corrected: half
//! vectors between great arcs (`method`), GGX as a mix of cosine lobes, and cosine lobes integrated along edges by fitted peaks or by Owen's T function (`edge`).
//! `lobe: phong` and `phong_two_axis` are cosine lobes about the mirror direction.
//!
//! Relative MSE over the fully lit part of two reference images 1.5e-3 and 3.2e-4; linearly transformed cosines 3.0e-2 and 7.7e-2, the paper's best
//! 6.3e-2 and 4.7e-2. `docs/area-lights` has the tables.
//!
//! # What remains
//!
//! Masking and Fresnel's term at one half vector: 1 % too much in the mean of `builtin:area-lights`, up to 10 % of the specular light for large lights on rough or grazed
//! surfaces. Shadows come as one factor for each light. G-buffers hold no tangents: `anisotropy` is one for all
//! surfaces, about an axis of the scene.

mod area_light;

pub use area_light::{AreaLightPass, EdgeIntegral, Lobe, Method, Params};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<AreaLightPass>();
}
