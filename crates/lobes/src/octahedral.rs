//! The octahedral map of unit vectors to a square, and that of a hemisphere alone (Cigolle et al. 2014, A Survey of Efficient Representations for Independent Unit Vectors).

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

/// Unit vector in 2 x 16 bits, x in the lower half, rounded as WGSL's `pack2x16snorm` does. The direction comes back within 6.5e-5 rad (3 sqrt(2) half
/// steps, in the middle of a face).
pub fn octahedral_pack(direction: DVec3) -> u32 {
    let bits = |value: f64| u32::from((0.5 + 32767.0 * value.clamp(-1.0, 1.0)).floor() as i16 as u16);
    let p = octahedral_encode(direction);
    bits(p.x) | bits(p.y) << 16
}

/// The unit vector that [`octahedral_pack`] packed.
pub fn octahedral_unpack(packed: u32) -> DVec3 {
    let value = |bits: u32| (f64::from(bits as u16 as i16) / 32767.0).max(-1.0);
    octahedral_decode(DVec2::new(value(packed), value(packed >> 16)))
}

/// |x| + |y| + z: the distance to the origin that belongs to the hemi-octahedral map, for z >= 0.
pub fn hemi_octahedral_norm(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z
}

/// Direction with z >= 0 (not zero, of any length) to [-1, 1]^2.
pub fn hemi_octahedral_encode(v: DVec3) -> DVec2 {
    let p = v.truncate() / hemi_octahedral_norm(v);
    DVec2::new(p.x + p.y, p.x - p.y)
}

/// [-1, 1]^2 to the point of the half octahedron, whose norm is 1.
pub fn hemi_octahedral_decode(uv: DVec2) -> DVec3 {
    let p = 0.5 * DVec2::new(uv.x + uv.y, uv.x - uv.y);
    p.extend(1.0 - p.x.abs() - p.y.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spread over the sphere, with the axes, the fold's edges and near misses of both.
    fn directions() -> Vec<DVec3> {
        let spread = (0..100_000).map(|index| {
            let (a, b) = (f64::from(index) * 0.754_877_666, f64::from(index) * 0.569_840_291);
            let z = 2.0 * a.fract() - 1.0;
            let radius = (1.0 - z * z).sqrt();
            let angle = b.fract() * std::f64::consts::TAU;
            DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
        });
        let steps = [-1.0, -1e-7, 0.0, 1e-7, 1.0];
        let edges =
            steps.into_iter().flat_map(|x| steps.into_iter().flat_map(move |y| steps.into_iter().map(move |z| DVec3::new(x, y, z))));
        // The middle of a face is where a step of the code turns the direction most.
        let middle =
            (0..10_000).map(|index| DVec3::new(1.0, 1.0 + f64::from(index % 100) * 3e-6, 1.0 + f64::from(index / 100) * 3e-6).normalize());
        spread.chain(middle).chain(edges.filter(|v| *v != DVec3::ZERO).map(DVec3::normalize)).collect()
    }

    #[test]
    fn packing_error_is_as_stated() {
        let mut worst: f64 = 0.0;
        for direction in directions() {
            let back = octahedral_unpack(octahedral_pack(direction));
            assert!(back.dot(direction) > 0.9);
            worst = worst.max(back.cross(direction).length());
        }
        assert!(worst < 6.48e-5 && worst > 6.4e-5, "{worst:e}");
    }

    #[test]
    fn axes_are_exact_and_a_zero_vector_is_up() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            assert_eq!(octahedral_unpack(octahedral_pack(axis)), axis);
            assert_eq!(octahedral_unpack(octahedral_pack(-axis)), -axis);
        }
        assert_eq!(octahedral_unpack(octahedral_pack(DVec3::ZERO)), DVec3::Z);
    }

    #[test]
    fn comes_back() {
        for direction in directions() {
            let back = octahedral_decode(octahedral_encode(direction));
            assert!((back - direction).length() < 1e-12, "{direction} {back}");
        }
    }

    #[test]
    fn hemispheres_fill_the_square_and_come_back() {
        for direction in directions().into_iter().filter(|direction| direction.z >= 0.0) {
            let uv = hemi_octahedral_encode(direction * 3.0);
            assert!(uv.abs().max_element() <= 1.0 + 1e-15);
            let back = hemi_octahedral_decode(uv);
            assert!((hemi_octahedral_norm(back) - 1.0).abs() < 1e-12 && (back.normalize() - direction).length() < 1e-12);
        }
        assert_eq!(hemi_octahedral_decode(DVec2::new(1.0, 1.0)), DVec3::X, "corners are on the horizon");
    }

    /// What the shadow maps of virtual lights rest on: along a row of a face, the reciprocal distance of a plane has no curvature.
    #[test]
    fn reciprocal_distances_of_planes_are_linear_on_faces() {
        let (normal, height) = (DVec3::new(0.3, -0.2, 0.9), 2.0);
        let reciprocal = |u: f64, v: f64| normal.dot(hemi_octahedral_decode(DVec2::new(u, v))) / height;
        let second_difference = |step: f64| reciprocal(0.5 - step, 0.1) - 2.0 * reciprocal(0.5, 0.1) + reciprocal(0.5 + step, 0.1);
        assert!(second_difference(0.3).abs() < 1e-15);
        assert!(second_difference(0.45).abs() > 1e-2, "across the edge of a face it bends");
    }
}
