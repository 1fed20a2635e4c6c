//! Light from shapes of uniform radiance, without tables: integrals of lobes over the solid angle of a polygon, a disk, a sphere, an ellipse or an
//! ellipsoid, at a cost that does not depend on the exponent.
//!
//! Everything is an integral along the outline. Polar integration about an axis r turns that of `f(u.r)` over a region of the sphere into one of the
//! primitive of `f` against the azimuth about r along the region's boundary, so that for a cosine lobe `(n+1) M` is the sum of `(1 - z^(n+1)) d theta`
//! with `z = u.r`.
//!
//! - [`boundary`]: outlines, made of straight edges and elliptical arcs, cut by planes through the shading point;
//! - [`axial_moment`]: the exact moment for real exponents, and Arvo's recurrence for whole ones;
//! - [`edge_models`]: the same at a cost that does not depend on the exponent;
//! - irradiance is in [`lambert`];
//! - [`radial_primitive`] and [`half_vector`]: microfacet lobes, by the same integration in half vectors;
//! - [`ggx_half_vector`]: GGX, with one alpha or two, as the vector irradiance of stretched half vectors, which takes far fewer operations;
//! - [`round`]: disks, spheres, ellipses and ellipsoids as ellipses, and as polygons of equal area.
//!
//! Conventions. The shading point is the origin. Outlines run counter-clockwise as seen from there; one that runs clockwise shows its back and its
//! integrals are negative, so one-sided lights take `max(value, 0)` and two-sided ones `|value|`. Lengths are in any unit; radiance is 1.
//!
//! Source: Lecocq, Dufay, Sourimant and Marvie, Analytic Approximations for Real-Time Area Light Shading (TVCG 2017). The unified form for real
//! exponents is a design of this project.

pub mod axial_moment;
pub mod boundary;
pub mod circular_arc;
pub mod edge_models;
pub mod ggx_half_vector;
pub mod half_vector;
pub mod lambert;
pub mod radial_primitive;
pub mod round;
