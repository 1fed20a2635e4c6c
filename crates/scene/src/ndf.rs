//! The normal distribution function of a scene.

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Normal distribution function of specular lobes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ndf {
    /// GGX (Trowbridge-Reitz).
    #[default]
    Ggx,
    /// Phong with exponent `2 / alpha^2 - 2`.
    Phong,
}

impl FromStr for Ndf {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "ggx" => Ok(Ndf::Ggx),
            "phong" => Ok(Ndf::Phong),
            _ => Err(format!("`{text}` is neither ggx nor phong")),
        }
    }
}

impl fmt::Display for Ndf {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Ndf::Ggx => "ggx",
            Ndf::Phong => "phong",
        })
    }
}
