//! Known techniques for the light of area lights, so that others can be compared with them: each pass takes the same inputs and gives the same output as
//! `area-light`, so that a graph swaps one for another.
//!
//! - `area-monte-carlo`: samples of the solid angle. Unbiased, noisy; what the others approximate.
//! - `area-mrp`: the most representative point (Karis 2013): a point light where the mirror ray comes nearest, with a wider lobe.
//! - `area-ltc`: linearly transformed cosines (Heitz et al. 2016), with a table fitted to our own reflectance by `cargo xtask fit-ltc`.
//!
//! All of them take the diffuse term as Lambert's exact integral, except for Monte Carlo, which samples the whole reflectance; so what differs is the specular
//! lobe. Round lights are polygons of equal area for the exact parts, as in `area-light`. None casts a shadow without visibility.

mod ltc;
mod monte_carlo;
mod mrp;
mod shared;
mod table;

pub use ltc::LtcPass;
pub use monte_carlo::MonteCarloPass;
pub use mrp::MrpPass;
pub use table::{LtcTable, TableError};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Adds the passes of this crate.
pub fn register(registry: &mut Registry<SceneWorld>) {
    registry.add::<MonteCarloPass>();
    registry.add::<MrpPass>();
    registry.add::<LtcPass>();
}
