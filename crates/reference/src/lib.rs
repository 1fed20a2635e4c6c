//! Ground truth: a progressive path tracer on the CPU, over the same scenes, materials and conventions as the passes.
//!
//! What light a picture holds is chosen by [`LightPaths`]: light that scatters once, exactly twice, or up to
//! a depth, or of each class of light exactly some numbers of scattering events. Each vertex samples every light
//! (next-event estimation) and continues by sampling the BRDF; where both can find the same light they share it by multiple importance sampling with
//! the balance heuristic (Veach and Guibas 1995, Optimally Combining Sampling Techniques for Monte Carlo Rendering).
//!
//! A picture is a function of scene, camera, size, settings and seed alone: not of the number of threads, nor of how often the work was interrupted.
//! Shading is done in `f64`, rays against triangles in `f32`. Numbers come from Owen-scrambled Sobol points (Burley 2020, crate `sobol_burley`), a
//! scramble of its own for each pixel.
//!
//! Read [`surface`] for what a material is, `light` for how lights are sampled, `path` for the estimator, [`progress`] for the picture that grows.

mod environment;
mod geometry;
mod light;
mod path;
pub mod progress;
mod sampler;
pub mod surface;

pub use path::LightPaths;
pub use progress::{Checkpoint, Picture, ReferenceError, Render, Settings};
