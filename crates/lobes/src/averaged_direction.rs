//! Averages of directions: the mean of a lobe has a length R below 1, from which the lobe's sharpness comes back; and averages of
//! positions, from whose variance the radius of a virtual light comes.
//!
//! Two numbers keep their digits where R does not. Near R = 1 everything depends on `q = 1 - R^2`, so q is stored beside a unit axis, and R
//! is taken from it; as `R axis` in half floats a lobe of sharpness 1000 comes back 38 % off and one of 10 000 infinite. And variances are
//! merged, not formed as `E|x|^2 - |E x|^2`, which has no digit left a hundred metres from the origin.

use glam::DVec3;

/// Length of the mean direction of a diffuse lobe (the clamped cosine): exactly 2/3.
pub const DIFFUSE_MEAN_COSINE: f64 = 2.0 / 3.0;

/// The least `1 - R^2` that half floats hold with all their digits; the sharpness that it stands for is 3.2e4.
pub const HALF_LEAST_ONE_MINUS_LENGTH_SQUARED: f64 = 6.2e-5;

/// The least `1 - R^2` that the inverses distinguish; the sharpness that it stands for is 2e8.
const LEAST_ONE_MINUS_LENGTH_SQUARED: f64 = 1e-8;

/// Below this R is a continued fraction, since its closed form cancels.
const FRACTION_END: f64 = 1.0;

/// Length R of the mean direction of a normalised SG, the mean cosine of the angle to its axis: `coth(sharpness) - 1/sharpness`, 0 to 1 for
/// a sharpness >= 0. To rounding. (Mardia and Jupp 2000, Directional Statistics, equation 9.3.9.)
pub fn mean_cosine(sharpness: f64) -> f64 {
    if sharpness >= FRACTION_END {
        let e = (-2.0 * sharpness).exp();
        return (1.0 + e) / (1.0 - e) - 1.0 / sharpness;
    }
    // Lambert's x / (3 + x^2 / (5 + x^2 / (7 + ...))), all terms positive.
    let square = sharpness * sharpness;
    sharpness / (1..12).rev().fold(25.0, |rest, k| f64::from(2 * k + 1) + square / rest)
}

/// `1 - R` without cancellation, 1 to 0; about `1/sharpness` for sharp lobes. To rounding.
pub fn one_minus_mean_cosine(sharpness: f64) -> f64 {
    if sharpness >= FRACTION_END {
        let e = (-2.0 * sharpness).exp();
        return 1.0 / sharpness - 2.0 * e / (1.0 - e);
    }
    1.0 - mean_cosine(sharpness)
}

/// `q = 1 - R^2` (one minus the square of R) without cancellation, 1 to 0; about `2/sharpness` for sharp lobes. To rounding.
pub fn one_minus_mean_cosine_squared(sharpness: f64) -> f64 {
    one_minus_mean_cosine(sharpness) * (1.0 + mean_cosine(sharpness))
}

/// The forward form that goes with [`sharpness_from_averaged_direction_toksvig`]: `sharpness / (1 + sharpness)`. Up to 0.19 too long (at
/// 0.86), three times too long for flat lobes.
pub fn mean_cosine_toksvig(sharpness: f64) -> f64 {
    sharpness / (1.0 + sharpness)
}

/// The forward form that goes with [`sharpness_from_averaged_direction_banerjee`]: the root in [0, 1) of `R (3 - R^2) = sharpness (1 -
/// R^2)`. Up to 0.012 off R.
///
/// Laurijssen et al. 2010 (Fast Estimation and Rendering of Indirect Highlights) solve this cubic with an arc tangent and a sine; here four
/// Newton steps from [`mean_cosine`] do. The exact [`mean_cosine`] is cheaper than either: this form exists for comparisons.
pub fn mean_cosine_banerjee(sharpness: f64) -> f64 {
    let mut u = one_minus_mean_cosine(sharpness);
    let mut length = mean_cosine(sharpness);
    for _ in 0..4 {
        // In R for broad lobes and in u = 1 - R for sharp ones: each keeps the digits that the other loses.
        if sharpness < 1.0 {
            let q = 1.0 - length * length;
            length -= (length * (2.0 + q) - sharpness * q) / (3.0 * q + 2.0 * sharpness * length);
        } else {
            let q = u * (2.0 - u);
            let value = 2.0 - u * u * (3.0 - u) - sharpness * q;
            u += value / (3.0 * q + 2.0 * sharpness * (1.0 - u));
            length = 1.0 - u;
        }
    }
    length
}

/// Length R of an averaged direction of which `q = 1 - R^2` is stored: `sqrt(1 - q)`, q clamped to [0, 1].
///
/// As q nears 1 the length is lost: at 32 bits from a sharpness of 1e-3 down, at 16 bits by 6 % at 0.1. The lobe is flat there.
pub fn averaged_direction_length(one_minus_length_squared: f64) -> f64 {
    (1.0 - one_minus_length_squared.clamp(0.0, 1.0)).sqrt()
}

/// Sharpness of the SG whose mean direction has the length R, given with `q = 1 - R^2`. Within 0.10 % for all lobes.
///
/// Banerjee's form with a correction of this project: `R (3 - R^2 + R^2 q (-0.128827 - 0.751718 R^2 + 0.336101 R^4)) / q`. q below 1e-8
/// counts as 1e-8, so the largest sharpness is 2e8.
pub fn sharpness_from_averaged_direction(length: f64, one_minus_length_squared: f64) -> f64 {
    let q = one_minus_length_squared.max(LEAST_ONE_MINUS_LENGTH_SQUARED);
    let square = length * length;
    let correction = square * q * (-0.128827 + square * (-0.751718 + square * 0.336101));
    length * (3.0 - square + correction) / q
}

/// Sharpness by Banerjee et al. 2005 (Clustering on the Unit Hypersphere using von Mises-Fisher Distributions, equation 4.4): `R (3 - R^2)
/// / q`. Up to 4.9 % too large (at R = 0.80), right for flat lobes and sharp ones.
pub fn sharpness_from_averaged_direction_banerjee(length: f64, one_minus_length_squared: f64) -> f64 {
    length * (3.0 - length * length) / one_minus_length_squared.max(LEAST_ONE_MINUS_LENGTH_SQUARED)
}

/// Sharpness by Toksvig 2005 (Mipmapping Normal Maps): `R / (1 - R)`, here `R (1 + R) / q`. 10 % too small at R = 0.9, 44 % at 0.5, 67 %
/// for flat lobes.
pub fn sharpness_from_averaged_direction_toksvig(length: f64, one_minus_length_squared: f64) -> f64 {
    length * (1.0 + length) / one_minus_length_squared.max(LEAST_ONE_MINUS_LENGTH_SQUARED)
}

/// Sharpness to rounding: Newton's method on [`mean_cosine`], or on its complement where R is above 1/2.
pub fn sharpness_from_averaged_direction_exact(length: f64, one_minus_length_squared: f64) -> f64 {
    let mut sharpness = sharpness_from_averaged_direction(length, one_minus_length_squared);
    if sharpness <= 0.0 {
        return 0.0;
    }
    let complement = one_minus_length_squared.max(LEAST_ONE_MINUS_LENGTH_SQUARED) / (1.0 + length);
    for _ in 0..5 {
        let slope = if sharpness < 1.0 {
            one_minus_mean_cosine_squared(sharpness) - 2.0 * mean_cosine(sharpness) / sharpness
        } else {
            1.0 / (sharpness * sharpness) - sharpness.sinh().powi(-2)
        };
        let missing = if length < 0.5 { length - mean_cosine(sharpness) } else { one_minus_mean_cosine(sharpness) - complement };
        sharpness += missing / slope;
    }
    sharpness
}

/// A mean direction in the form that can be stored: a unit axis and `q = 1 - R^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AveragedDirection {
    /// Unit direction of the mean; any direction where the mean vanishes.
    pub axis: DVec3,
    /// One minus the square of the length of the mean, 0 (a single direction) to 1 (no direction at all).
    pub one_minus_length_squared: f64,
}

impl AveragedDirection {
    /// The mean direction of a normalised SG.
    pub fn of_lobe(axis: DVec3, sharpness: f64) -> Self {
        Self { axis, one_minus_length_squared: one_minus_mean_cosine_squared(sharpness) }
    }

    /// Length of the mean.
    pub fn length(&self) -> f64 {
        averaged_direction_length(self.one_minus_length_squared)
    }

    /// Sharpness of the SG with this mean, by [`sharpness_from_averaged_direction`].
    pub fn sharpness(&self) -> f64 {
        averaged_direction_sharpness(self)
    }
}

/// Sharpness of the SG with this mean, by [`sharpness_from_averaged_direction`] with the length taken from q.
pub fn averaged_direction_sharpness(direction: &AveragedDirection) -> f64 {
    let q = direction.one_minus_length_squared;
    sharpness_from_averaged_direction(averaged_direction_length(q), q)
}

/// Mean of averaged directions with weights >= 0, which need not sum to 1.
///
/// An exact identity, a form of this project: with `m = sum w_i R_i axis_i` the new q is `sum w_i q_i + sum w_i |R_i axis_i - m|^2`, a sum
/// of positive terms where `1 - |m|^2` would cancel. Merges of merges with summed weights are the merge of all. Without any weight the
/// result has no direction (q = 1).
pub fn merge_averaged_directions(parts: &[(f64, AveragedDirection)]) -> AveragedDirection {
    let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
    let first = parts.first().map_or(DVec3::Z, |(_, part)| part.axis);
    if total <= 0.0 {
        return AveragedDirection { axis: first, one_minus_length_squared: 1.0 };
    }
    let vectors = || parts.iter().map(|(weight, part)| (weight / total, part.axis * part.length(), part.one_minus_length_squared));
    let mean: DVec3 = vectors().map(|(weight, vector, _)| vector * weight).sum();
    let q: f64 = vectors().map(|(weight, vector, q)| weight * (q + (vector - mean).length_squared())).sum();
    AveragedDirection { axis: mean.normalize_or(first), one_minus_length_squared: q.min(1.0) }
}

/// Mean position of a set of points and the mean squared distance from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionVariance {
    /// Mean position, m, best relative to an origin near by: half floats need one, 32-bit floats gain from one beyond 100 m.
    pub mean: DVec3,
    /// `E|x - mean|^2`, m^2: 0 for a single point.
    pub variance: f64,
}

/// Mean position and variance of sets with weights >= 0, which need not sum to 1: `sum w_i variance_i + sum w_i |mean_i - mean|^2`. Exact.
/// Without any weight the first part.
pub fn merge_position_variance(parts: &[(f64, PositionVariance)]) -> PositionVariance {
    let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
    if total <= 0.0 {
        return parts.first().map_or(PositionVariance { mean: DVec3::ZERO, variance: 0.0 }, |(_, part)| *part);
    }
    // Offsets from one of the points are exact where they are small, whatever the distance to the origin.
    let origin = parts.first().map_or(DVec3::ZERO, |(_, part)| part.mean);
    let offsets = || parts.iter().map(|(weight, part)| (weight / total, part.mean - origin, part.variance));
    let offset: DVec3 = offsets().map(|(weight, vector, _)| vector * weight).sum();
    let variance = offsets().map(|(weight, vector, variance)| weight * (variance + (vector - offset).length_squared())).sum();
    PositionVariance { mean: origin + offset, variance }
}

/// The same variance as papers print it, `E|x|^2 - |E x|^2`: wrong by 30 % at 100 m for a radius of 0.1 m in 32 bits, and negative half the
/// time in 16. Kept for the test that shows it.
pub fn position_variance_printed(mean: DVec3, mean_squared_length: f64) -> f64 {
    mean_squared_length - mean.length_squared()
}

/// Radius of the uniform disk with this positional variance: `sqrt(2 variance)`, m. Negative variances count as 0.
pub fn radius_from_variance(variance: f64) -> f64 {
    (2.0 * variance.max(0.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sharpnesses() -> impl Iterator<Item = f64> {
        (0..2000).map(|index| 10f64.powf(f64::from(index) / 2000.0 * 14.0 - 6.0))
    }

    #[test]
    fn inverses_are_as_far_off_as_stated() {
        let mut worst = [0.0f64; 4];
        let (mut toksvig, mut banerjee) = (0.0f64, 0.0f64);
        for sharpness in sharpnesses() {
            let (length, q) = (mean_cosine(sharpness), one_minus_mean_cosine_squared(sharpness));
            let forms: [fn(f64, f64) -> f64; 4] = [
                sharpness_from_averaged_direction,
                sharpness_from_averaged_direction_banerjee,
                sharpness_from_averaged_direction_toksvig,
                sharpness_from_averaged_direction_exact,
            ];
            for (worst, form) in worst.iter_mut().zip(forms) {
                *worst = worst.max((form(length, q) / sharpness - 1.0).abs());
            }
            toksvig = toksvig.max(mean_cosine_toksvig(sharpness) - length);
            banerjee = banerjee.max((mean_cosine_banerjee(sharpness) - length).abs());
            // The forward forms undo the inverses of the same name.
            let length = mean_cosine_banerjee(sharpness);
            if length < 0.999 {
                let back = sharpness_from_averaged_direction_banerjee(length, 1.0 - length * length);
                assert!((back / sharpness - 1.0).abs() < 1e-12, "{sharpness}: {back}");
            }
        }
        assert!(worst[0] < 1.05e-3 && worst[0] > 5e-4, "{worst:?}");
        assert!((worst[1] - 0.049).abs() < 1e-3 && (worst[2] - 0.667).abs() < 1e-3, "{worst:?}");
        assert!(worst[3] < 1e-13, "{worst:?}");
        assert!((toksvig - 0.19).abs() < 5e-3 && (banerjee - 0.012).abs() < 1e-3, "{toksvig} {banerjee}");
    }

    #[test]
    fn the_diffuse_lobe_has_a_mean_length_of_two_thirds() {
        let q = 1.0 - DIFFUSE_MEAN_COSINE * DIFFUSE_MEAN_COSINE;
        assert!((sharpness_from_averaged_direction_exact(DIFFUSE_MEAN_COSINE, q) - 2.95150).abs() < 1e-5);
        // What generators store that take the length from the best-fitting SG by Banerjee's cubic.
        assert!((mean_cosine_banerjee(2.2925) - 0.5749).abs() < 1e-4);
    }

    #[test]
    fn a_merge_is_the_mean_of_everything() {
        let parts: Vec<(f64, AveragedDirection)> = (1..9)
            .map(|index| {
                let t = f64::from(index);
                (t, AveragedDirection::of_lobe(DVec3::new(t.cos(), t.sin(), 1.0 + 0.2 * t).normalize(), t * t))
            })
            .collect();
        let merged = merge_averaged_directions(&parts);
        let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
        let mean: DVec3 = parts.iter().map(|(weight, part)| part.axis * (part.length() * weight / total)).sum();
        assert!((merged.axis * merged.length() - mean).length() < 1e-14);
        assert!((merged.one_minus_length_squared - (1.0 - mean.length_squared())).abs() < 1e-14);
        let weight = |parts: &[(f64, AveragedDirection)]| parts.iter().map(|(weight, _)| weight).sum::<f64>();
        let (left, right) = parts.split_at(3);
        let halves = [(weight(left), merge_averaged_directions(left)), (weight(right), merge_averaged_directions(right))];
        let again = merge_averaged_directions(&halves);
        assert!((again.one_minus_length_squared - merged.one_minus_length_squared).abs() < 1e-14);
        assert!((again.axis - merged.axis).length() < 1e-14);
        let nothing = merge_averaged_directions(&[(0.0, parts[0].1)]);
        assert_eq!((nothing.one_minus_length_squared, nothing.sharpness()), (1.0, 0.0));
    }

    #[test]
    fn a_disk_has_its_radius() {
        // A ring of radius r has twice the variance of the disk of that radius.
        let ring: Vec<(f64, PositionVariance)> = (0..12)
            .map(|index| {
                let angle = f64::from(index) / 6.0 * std::f64::consts::PI;
                (1.0, PositionVariance { mean: DVec3::new(1000.0 + angle.cos(), angle.sin(), 0.0), variance: 0.0 })
            })
            .collect();
        let merged = merge_position_variance(&ring);
        assert!((radius_from_variance(0.5 * merged.variance) - 1.0).abs() < 1e-12);
        assert_eq!(radius_from_variance(-1.0), 0.0);
    }
}
