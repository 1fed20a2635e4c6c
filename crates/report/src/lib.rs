//! Pages to look at: variants side by side ([`comparison_page`]) and error against time ([`sweep_page`]).
//!
//! A page is one HTML file: pictures, plots, styles and script are inside it, and its content security policy forbids it to
//! fetch anything. It opens from a disk without a network. Tables, bars and the verdict are plain HTML that needs no script;
//! only pictures of radiance and the viewer do. This crate takes plain data and knows nothing of how it was measured, but for the statistics
//! of [`lobelia_measure::sampled`].

mod bars;
mod choice;
mod data;
mod direction;
mod html;
mod light;
mod metric;
mod page;
mod plot;
mod radiance;
mod sweep;
mod sweep_data;
mod tiles;
mod verdict;

pub use choice::{Choice, Configuration, cheapest_under_error, configurations, most_accurate_under_time, overall, pareto_front};
pub use data::{
    Better, Clock, Compared, Comparison, Device, Measurement, PassChange, PassCost, PassDifference, Picture, Pruned, Radiance, Reference,
    Replicated, SceneFacts, SequenceSettings, Settings, Time, VERSION, Variant, View,
};
pub use direction::Direction;
pub use light::{LeftOut, Light, LightPart, Missing, TechniqueLight};
pub use metric::{METRICS, Metric, error_of, least_difference};
pub use page::comparison_page;
pub use sweep::sweep_page;
pub use sweep_data::{Sweep, SweepRow, plotted_error};
pub use tiles::WhereMap;
