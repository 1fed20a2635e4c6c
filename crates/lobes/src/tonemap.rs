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

/// ACES reference and output transforms, rational fit by Stephen Hill (BakingLab, ACES.hlsl); linear in, linear out.
pub fn aces(radiance: DVec3) -> DVec3 {
    let color = radiance.clamp(DVec3::ZERO, DVec3::splat(MAX_INPUT));
    let c = rows([[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]], color);
    let fitted = (c * (c + 0.024_578_6) - 0.000_090_537) / (c * (0.983_729 * c + 0.432_951) + 0.238_081);
    rows([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]], fitted)
        .clamp(DVec3::ZERO, DVec3::ONE)
}

/// AgX (Troy Sobotka), base look, contrast fit by Benjamin Wrensch 2023; linear in, linear out.
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
        for curve in [aces as fn(DVec3) -> DVec3, agx] {
            let mut before = DVec3::ZERO;
            for step in 0..400 {
                let mapped = curve(DVec3::splat(1e-6 * 10f64.powf(f64::from(step) / 20.0)));
                assert!(mapped.min_element() >= 0.0 && mapped.max_element() <= 1.0);
                // The AgX polynomial wavers by less than a 16-bit step at its shoulder.
                assert!((mapped - before).min_element() >= -2e-3, "{before} {mapped}");
                before = mapped;
            }
            assert!(before.min_element() > 0.9, "the brightest is nearly white: {before}");
        }
    }

    #[test]
    fn srgb_is_continuous() {
        assert!((srgb_encode(0.003_130_8) - srgb_encode(0.003_130_9)).abs() < 1e-5);
        assert!((srgb_encode(1.0) - 1.0).abs() < 1e-12);
        assert!((srgb_encode(0.5) - 0.735_356_98).abs() < 1e-6);
    }
}
