//! What several crates need and none of them owns: files that appear whole or not at all, and the name that a reader most likely meant.

mod files;
mod names;

pub use files::{WriteError, check_goal, replace_file};
pub use names::nearest;
