//! From linear radiance to display colours in [0, 1].

use glam::DVec3;

/// Highlights beyond this are white under every curve.
pub const MAX_INPUT: f64 = 1e6;

/// sRGB transfer function (IEC 61966-2-1), for values in [0, 1].
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn rows(m: [[f64; 3]; 3], color: DVec3) -> DVec3 {
    DVec3::from_array(m.map(|row| DVec3::from_array(row).dot(color)))
}

/// Inverse of [`srgb_encode`]: linear value of an encoded one in [0, 1].
pub fn srgb_decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// ACES reference and output transforms, rational fit by Stephen Hill (BakingLab, ACES.hlsl); linear in, linear out. Grey below 0.0033 is black.
pub fn aces(radiance: DVec3) -> DVec3 {
    let color = radiance.clamp(DVec3::ZERO, DVec3::splat(MAX_INPUT));
    let c = rows([[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]], color);
    let fitted = (c * (c + 0.024_578_6) - 0.000_090_537) / (c * (0.983_729 * c + 0.432_951) + 0.238_081);
    rows([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]], fitted)
        .clamp(DVec3::ZERO, DVec3::ONE)
}

/// AgX (Troy Sobotka), base look, contrast fit by Benjamin Wrensch 2023 (Minimal AgX Implementation); linear in, linear out. 16.5 stops of radiance,
/// 1.8e-4 to 16.3, are shown. Rising grey falls by up to 4e-6 just before white, where the fit dips; the brightest is 0.9965.
pub fn agx(radiance: DVec3) -> DVec3 {
    let color = radiance.clamp(DVec3::ZERO, DVec3::splat(MAX_INPUT));
    let inset = rows(
        [
            [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
            [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_4],
            [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
        ],
        color,
    );
    let x = ((inset.max(DVec3::splat(1e-10)).map(f64::log2) + 12.473_93) / 16.5).clamp(DVec3::ZERO, DVec3::ONE);
    let (x2, x4) = (x * x, x * x * x * x);
    let curved = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32;
    let outset = rows(
        [
            [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
            [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
            [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
        ],
        curved,
    );
    outset.clamp(DVec3::ZERO, DVec3::ONE).map(|value| value.powf(2.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_with_grey_and_stay_in_range() {
        // How far below an earlier value a later one may be: the fit of AgX dips just before white.
        for (curve, dip) in [(aces as fn(DVec3) -> DVec3, 0.0), (agx, 4e-6)] {
            let mut highest = DVec3::ZERO;
            for step in 0..=200_000 {
                let mapped = curve(DVec3::splat(10f64.powf(-8.0 + f64::from(step) / 5e3)));
                assert!(mapped.min_element() >= 0.0 && mapped.max_element() <= 1.0);
                assert!((highest - mapped).max_element() <= dip, "{highest} {mapped}");
                highest = highest.max(mapped);
            }
            assert!(highest.min_element() > 0.996, "the brightest is nearly white: {highest}");
            assert_eq!(curve(DVec3::ZERO), DVec3::ZERO);
        }
    }

    #[test]
    fn grey_stays_grey() {
        for curve in [aces as fn(DVec3) -> DVec3, agx] {
            for value in [0.01, 0.18, 1.0, 5.0] {
                let mapped = curve(DVec3::splat(value));
                assert!(mapped.max_element() - mapped.min_element() < 1e-3, "{mapped}");
                assert!(mapped.min_element() > 0.0);
            }
        }
    }

    #[test]
    fn middle_grey_is_where_the_curves_are_known_to_put_it() {
        // ACES' fit at 1, worked by hand: (1.0245786 - 0.000090537) / (0.983729 + 0.432951 + 0.238081); AgX: 0.18 lies 10 of 16.5
        // stops up, the pivot of its curve, whose height is one half.
        assert!((aces(DVec3::ONE).x - 0.619_115).abs() < 1e-3, "{}", aces(DVec3::ONE));
        let grey = agx(DVec3::splat(0.18)).x.powf(1.0 / 2.2);
        assert!((grey - 0.5).abs() < 5e-3, "{grey}");
    }

    #[test]
    fn srgb_is_continuous() {
        assert!((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_9)).abs() < 1e-5);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-12);
        assert!((srgb_encode(0.5) - 0.735_356_98).abs() < 1e-6);
    }
}
