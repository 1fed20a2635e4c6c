//! The `area-mrp` pass.

use crate::shared::{PeerPass, Technique};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Lights pixels by most representative points.
pub type MrpPass = PeerPass<Mrp>;

/// Most representative points.
pub struct Mrp;

/// Parameters of `area-mrp`: none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct MrpParams {}

impl Technique for Mrp {
    const NAME: &'static str = "area-mrp";
    const DOC: &'static str = "Direct light of area lights by their most representative point.\n\
        Karis 2013, Real Shading in Unreal Engine 4: the specular lobe sees a point light where the mirror ray comes nearest to the light, times (alpha / alpha')^2 with \
        alpha' = alpha + radius / (2 distance), which keeps about the lobe's energy. Flat lights take the point of their outline nearest to where the ray meets their \
        plane, and the radius of a disk of their area. The diffuse term is Lambert's exact integral. \
        Where a light lies in the tail of a sharp lobe it is too dark: 0.03 of the exact mean on a metal of roughness 0.1 below an overhead light, seen from 2 cm above.";
    const SHADER: Source<'static> = Source {
        path: "crates/arealight-peers/src/shared.wgsl + mrp.wgsl",
        text: concat!(include_str!("shared.wgsl"), include_str!("mrp.wgsl")),
    };
    type Params = MrpParams;

    fn settings(_: &MrpParams) -> [u32; 2] {
        [0, 0]
    }
}
