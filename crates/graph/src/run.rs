//! Running a plan: a [`Runner`] owns every resource, a [`Frame`] is what a pass records into.

mod frame;
mod runner;

pub use frame::{Frame, FrameInfo, Progress, WorkRate};
pub use runner::{FrameReport, PartData, PassTime, RunOptions, Runner, Timing};
