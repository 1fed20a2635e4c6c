//! Axes of the scene as parameters.

use lobelia_graph::ParamValue;
use serde::{Deserialize, Serialize};

/// An axis of the scene. Surfaces have no tangents of their own; the part of an axis along a surface stands in for them, and where the axis is the normal any direction
/// does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// X.
    #[default]
    X,
    /// Y.
    Y,
    /// Z.
    Z,
}

impl Axis {
    /// 0, 1 or 2, as shaders index vectors.
    pub fn index(self) -> u32 {
        self as u32
    }
}

impl ParamValue for Axis {
    fn kind() -> String {
        "x, y or z".into()
    }
}
