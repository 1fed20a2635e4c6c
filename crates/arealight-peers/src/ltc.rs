//! The `area-ltc` pass.

use crate::{
    shared::{PeerPass, Technique},
    table::LtcTable,
};
use lobelia_scene::Ndf;
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Lights pixels by linearly transformed cosines.
pub type LtcPass = PeerPass<Ltc>;

/// Linearly transformed cosines.
pub struct Ltc;

/// Parameters of `area-ltc`: none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct LtcParams {}

impl Technique for Ltc {
    const NAME: &'static str = "area-ltc";
    const DOC: &'static str = "Direct light of area lights by linearly transformed cosines.\n\
        Heitz, Dupuy, Hill and Neubelt 2016: the specular lobe is a clamped cosine under a linear map from a table, which is fitted to our own GGX; mapped back, \
        the light is integrated by Lambert's formula, cut exactly at the horizon. Disks and spheres are polygons of sixteen corners. Refuses the Phong distribution. In the tail of a sharp \
        lobe it has lost light: 0.5 of the exact mean on a metal of roughness 0.1 below an overhead light, seen from 2 cm above.";
    const SHADER: Source<'static> = Source {
        path: "crates/arealight-peers/src/shared.wgsl + ltc.wgsl",
        text: concat!(include_str!("shared.wgsl"), include_str!("ltc.wgsl")),
    };
    type Params = LtcParams;

    fn settings(_: &LtcParams) -> [u32; 2] {
        [0, 0]
    }

    fn refuses(_: &Self::Params, ndf: Ndf) -> Option<&'static str> {
        (ndf == Ndf::Phong).then_some("linearly transformed cosines are fitted to GGX only, but the scene's distribution is phong")
    }

    fn table() -> Option<LtcTable> {
        // What comes with the crate is tested; without it the specular lobe would be dark.
        LtcTable::ggx().ok()
    }
}
