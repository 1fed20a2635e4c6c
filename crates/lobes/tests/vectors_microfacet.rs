//! Reflection lobes against reference values of 14 digits.
#![allow(clippy::unwrap_used)]

mod common;

use common::{agrees, close, given, number, records, vector};
use lobelia_lobes::microfacet_lobe::*;

#[test]
fn vectors_reflection_lobe() {
    let mut in_the_horizon = 0;
    for r in records("reflection_lobe") {
        let (alpha, view, normal) = (given(&r, "alpha"), vector(&r, "view"), vector(&r, "normal"));
        let sharpness = ndf_sharpness_ggx(alpha);
        close(sharpness, given(&r, "ndf_sharpness"), &r);
        close(ndf_sharpness_beckmann(alpha), given(&r, "ndf_sharpness"), &r);

        let (round, slab) = (reflection_lobe_sg(sharpness, normal, view), reflection_lobe_asg(sharpness, normal, view));
        for axis in [round.axis, slab.axis, reflection_axis(normal, view)] {
            assert!((axis - vector(&r, "axis")).length() < 1e-10, "{r}: {axis}");
        }
        close(round.sharpness, given(&r, "sharpness"), &r);
        close(slab.eta_x, given(&r, "eta_perpendicular"), &r);
        close(slab.eta_y, given(&r, "eta_in_plane"), &r);
        // The larger bandwidth is across the plane of incidence, and the frame is orthonormal.
        assert!(slab.tangent.dot(normal).abs() < 1e-10 && slab.tangent.dot(view).abs() < 1e-10, "{r}: {slab:?}");
        assert!(slab.bitangent.dot(slab.axis).abs() < 1e-10 && (slab.bitangent.length() - 1.0).abs() < 1e-10, "{r}: {slab:?}");

        let (round, slab) = (reflection_lobe_sg_printed(sharpness, normal, view), reflection_lobe_asg_printed(sharpness, normal, view));
        match (number(&r, "sharpness_printed"), number(&r, "eta_perpendicular_printed")) {
            (Some(printed), Some(across)) => {
                close(round.sharpness, printed, &r);
                close(slab.eta_x, across, &r);
            }
            _ => {
                in_the_horizon += 1;
                assert!(round.sharpness == f64::INFINITY && slab.eta_x == f64::INFINITY, "{r}: {round:?}, {slab:?}");
            }
        }
        close(slab.eta_y, given(&r, "eta_in_plane"), &r);
    }
    assert!(in_the_horizon < 24);
    // What the comparisons must reject.
    assert!(!agrees(1.0 + 1e-9, 1.0, 1e-10) && !agrees(f64::NAN, 1.0, 1e-10));
}
