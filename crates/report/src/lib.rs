//! Pages to look at: variants side by side ([`comparison_page`]) and error against time ([`sweep_page`]).
//!
//! A page is one HTML file: pictures, plots, styles and script are inside it, and its content security policy forbids it to
//! fetch anything. It opens from a disk without a network. Tables, bars and the verdict are plain HTML that needs no script;
//! only the viewer does. This crate takes plain data and knows nothing of how it was measured.

mod bars;
mod choice;
mod data;
mod direction;
mod html;
mod light;
mod page;
mod plot;
mod sweep;
mod verdict;

pub use choice::{Configuration, cheapest_under_error, configurations, most_accurate_under_time, overall, pareto_front};
pub use data::{Comparison, PassCost, PassDifference, Picture, Sweep, SweepRow, Variant};
pub use direction::Direction;
pub use light::{LeftOut, Light, LightPart, Missing, TechniqueLight};
pub use page::comparison_page;
pub use sweep::sweep_page;
