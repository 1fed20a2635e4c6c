//! Falloff of punctual lights (KHR_lights_punctual, without range).

/// Share of a spot's intensity at an angle to its axis: 1 inside the inner cone, 0 outside the outer one, a squared ramp in the cosine between.
/// Angles in radians, `0 <= inner <= outer <= pi/2`.
pub fn spot_falloff(cos_angle: f64, inner: f64, outer: f64) -> f64 {
    let scale = 1.0 / (inner.cos() - outer.cos()).max(0.001);
    ((cos_angle - outer.cos()) * scale).clamp(0.0, 1.0).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn falls_from_one_to_zero_between_the_cones() {
        assert_eq!(spot_falloff(1.0, 0.2, 0.5), 1.0);
        assert_eq!(spot_falloff(0.2f64.cos(), 0.2, 0.5), 1.0);
        assert_eq!(spot_falloff(0.51f64.cos(), 0.2, 0.5), 0.0);
        let middle = (0.2f64.cos() + 0.5f64.cos()) / 2.0;
        assert!((spot_falloff(middle, 0.2, 0.5) - 0.25).abs() < 1e-12);
        // A hard rim stays finite.
        assert!(spot_falloff(0.3f64.cos(), 0.3, 0.3).is_finite());
    }
}
