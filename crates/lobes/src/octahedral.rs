//! The octahedral map of unit vectors to a square (Cigolle et al. 2014).

use glam::{DVec2, DVec3};

fn fold(p: DVec2) -> DVec2 {
    let sign = |value: f64| if value >= 0.0 { 1.0 } else { -1.0 };
    DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
}

/// Unit vector to [-1, 1]^2. A zero vector maps to +Z.
pub fn octahedral_encode(direction: DVec3) -> DVec2 {
    let sum = direction.abs().element_sum();
    if sum <= 0.0 {
        return DVec2::ZERO;
    }
    let p = direction.truncate() / sum;
    if direction.z < 0.0 { fold(p) } else { p }
}

/// [-1, 1]^2 to unit vector.
pub fn octahedral_decode(p: DVec2) -> DVec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let xy = if z < 0.0 { fold(p) } else { p };
    xy.extend(z).normalize_or(DVec3::Z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_back() {
        for index in 0..1000 {
            let (a, b) = (index as f64 * 0.7548, index as f64 * 0.5698);
            let z = 2.0 * a.fract() - 1.0;
            let radius = (1.0 - z * z).sqrt();
            let angle = b.fract() * std::f64::consts::TAU;
            let direction = DVec3::new(radius * angle.cos(), radius * angle.sin(), z);
            let back = octahedral_decode(octahedral_encode(direction));
            assert!((back - direction).length() < 1e-12, "{direction} {back}");
        }
    }
}
