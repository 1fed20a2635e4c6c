//! Scenes as they are loaded: conventions, hostile files, RON wrappers, animation, built-in scenes.
#![allow(clippy::unwrap_used)]

mod animation;
mod area_lights;
mod builtin;
mod compressed;
mod conventions;
mod fuzz;
mod glb;
mod hostile;
mod instancing;
mod materials;
mod posing;
mod ron;
mod shared;
mod usable;
