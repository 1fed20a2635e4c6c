//! Virtual point lights and their visibility on input that no scene has, held against f64: what is picked, what is gathered, what is seen, and what a plan
//! refuses.
#![allow(clippy::unwrap_used, missing_docs)]

mod animated;
mod gather;
mod given;
mod patches;
mod pick;
mod refuse;
mod seen;
