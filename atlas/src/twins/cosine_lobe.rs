//! Twins.

use crate::twin::Twin;

/// Twins of this module.
pub fn twins() -> Vec<Twin> {
    vec![]
}
