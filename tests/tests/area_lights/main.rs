//! Integrals over area lights on the device against `f64`.
#![allow(clippy::unwrap_used)]

mod half_vectors;
mod outlines;
