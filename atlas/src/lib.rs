//! The error atlas: how far each lobe formula is off, on the device and from the exact value, and what it costs.
//!
//! The tables of [`twins`] serve both the tests (every WGSL function against its `f64` form) and the pages in `docs/lobes/`, which
//! `cargo xtask atlas` draws anew.

pub mod cost;
pub mod draw;
pub mod figures;
pub mod heat_map;
pub mod table;
pub mod twin;
pub mod twins;
