//! The sampling density of bidirectional reflective shadow maps: contributions against f64 on given pixels, the mix with reflected flux, what happens
//! where there is nothing to weigh, and whether what is gathered stays the same on average.
#![allow(clippy::unwrap_used, missing_docs, dead_code)]

mod contribution;
mod extremes;
#[path = "../virtual_lights/given.rs"]
mod given;
mod maps;
mod mix;
mod unbiased;
