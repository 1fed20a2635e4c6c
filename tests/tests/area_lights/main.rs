//! Integrals over area lights on the device against `f64`.
#![allow(clippy::unwrap_used)]

mod cosine_lobes;
mod crossing;
mod ggx;
mod half_vectors;
mod outlines;
mod round;
mod vectors;
