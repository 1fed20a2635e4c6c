//! Light from shapes of uniform radiance, without tables: integrals of lobes over the solid angle of a polygon, a disk, a sphere, an ellipse or an
//! ellipsoid, at a cost that does not depend on the exponent.
//!
//! Everything is an integral along the outline. Polar integration about an axis r turns that of `f(u.r)` over a region of the sphere into one of the
//! primitive of `f` against the azimuth about r along the region's boundary, so that
//!
//! ```text
//!   Phong       (n+1) M = sum of  (1 - z^(n+1)) d theta,                    z = u.r           axial_moment, edge_integral
//!   two axes    the same, and sums of z^n d phi                                                two_axis
//!   microfacets integral of D(h) dh = sum of  H(z) d theta along the half vectors, z = h.n     half_vector, radial_primitive
//!   Lambert     irradiance = 1/2 sum of  n.(u x du)                                            lambert
//! ```
//!
//! - [`boundary`]: outlines, made of straight edges and elliptical arcs, cut by planes through the shading point;
//! - [`axial_moment`]: the exact moment for real exponents, and Arvo's recurrence for whole ones;
//! - [`two_axis`], [`radial_primitive`], [`half_vector`], [`lambert`]: the other rows of the table above;
//! - [`round`]: disks, spheres, ellipses and ellipsoids as ellipses, and as polygons of equal area;
//! - [`small_light`]: what to use where the edges of a small light cancel.
//!
//! Conventions. The shading point is the origin. Outlines run counter-clockwise as seen from there; one that runs clockwise shows its back and its
//! integrals are negative, so one-sided lights take `max(value, 0)` and two-sided ones `|value|`. Lengths are in any unit; radiance is 1.
//!
//! Source: Lecocq, Dufay, Sourimant and Marvie, Analytic Approximations for Real-Time Area Light Shading (TVCG 2017). The unified form for real
//! exponents, the integral by Owen's function, the exact half-vector boundary and the radial primitives are designs of this project.

pub mod axial_moment;
pub mod boundary;
pub mod round;
