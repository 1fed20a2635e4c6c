//! The `area-monte-carlo` pass.

use crate::shared::{PeerPass, Technique};
use lobelia_frame::Axis;
use lobelia_scene::Ndf;
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Lights pixels by samples of each light.
pub type MonteCarloPass = PeerPass<MonteCarlo>;

/// Samples of the solid angle.
pub struct MonteCarlo;

/// Parameters of `area-monte-carlo`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct MonteCarloParams {
    /// Samples of each light for every pixel, all in one dispatch, which bounds their number; for more, average frames (`--samples`). The error falls a little faster
    /// than one over their root.
    #[param(unit = "samples", range = 1..=256)]
    pub samples: u32,
    /// Added to the run's seed, to try other samples with everything else equal.
    pub seed: u32,
    /// Brushed surfaces: alphas are alpha (1 + anisotropy) along the tangent and alpha (1 - anisotropy) across it, for all materials. GGX only.
    #[param(range = -0.95..=0.95)]
    pub anisotropy: f32,
    /// Scene axis whose part along a surface is its tangent.
    pub tangent: Axis,
}

impl Default for MonteCarloParams {
    fn default() -> Self {
        Self { samples: 16, seed: 0, anisotropy: 0.0, tangent: Axis::X }
    }
}

impl Technique for MonteCarlo {
    const NAME: &'static str = "area-monte-carlo";
    const DOC: &'static str = "Direct light of area lights by Monte Carlo integration over their solid angle.\n\
        Unbiased. Polygons as spherical triangles (Arvo 1995), tiny ones by area; spheres and ellipsoids as the cone that a sphere fills in their own coordinates, disks by \
        area. An R2 sequence with a shift of its own for every pixel and frame.";
    const SHADER: Source<'static> = Source {
        path: "crates/arealight-peers/src/shared.wgsl + monte_carlo.wgsl",
        text: concat!(include_str!("shared.wgsl"), include_str!("monte_carlo.wgsl")),
    };
    const TRIANGLES: bool = true;
    type Params = MonteCarloParams;

    fn settings(params: &MonteCarloParams) -> [u32; 2] {
        [params.samples, params.seed]
    }

    fn anisotropy(params: &MonteCarloParams) -> (f32, Axis) {
        (params.anisotropy, params.tangent)
    }

    fn refuses(params: &MonteCarloParams, ndf: Ndf) -> Option<&'static str> {
        (params.anisotropy != 0.0 && ndf != Ndf::Ggx).then_some("anisotropy is for GGX lobes only")
    }
}
