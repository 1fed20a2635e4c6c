//! Primaries of colours.

use glam::{DMat3, DVec3};
use std::fmt;

/// CIE 1931 chromaticities (x, y) of a colour space's primaries and white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primaries {
    /// Red, green and blue.
    pub rgb: [[f64; 2]; 3],
    /// White.
    pub white: [f64; 2],
}

impl fmt::Display for Primaries {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.rgb;
        let point = |[x, y]: [f64; 2]| format!("({x:.4}, {y:.4})");
        write!(formatter, "red {}, green {}, blue {}, white {}", point(red), point(green), point(blue), point(self.white))
    }
}

impl Primaries {
    /// ITU-R BT.709 and sRGB, white D65.
    pub const REC709: Self = Self { rgb: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], white: [0.3127, 0.3290] };
    /// CIE XYZ itself, white of equal energy.
    pub const XYZ: Self = Self { rgb: [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], white: [1.0 / 3.0, 1.0 / 3.0] };

    /// Chromaticities closer than this to those of Rec. 709 are taken for them: files round to three digits.
    const SAME: f64 = 1e-3;

    /// Whether these are those of Rec. 709, up to rounding.
    pub fn is_rec709(&self) -> bool {
        let pairs = self.rgb.iter().chain([&self.white]).zip(Self::REC709.rgb.iter().chain([&Self::REC709.white]));
        pairs.into_iter().all(|(mine, theirs)| (mine[0] - theirs[0]).abs() <= Self::SAME && (mine[1] - theirs[1]).abs() <= Self::SAME)
    }

    /// CIE XYZ from linear colours, white at Y = 1. Nothing where the primaries lie on a line or a white has no luminance.
    fn to_xyz(self) -> Option<DMat3> {
        let column = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
        let columns = DMat3::from_cols(column(self.rgb[0]), column(self.rgb[1]), column(self.rgb[2]));
        let white = column(self.white) / self.white[1];
        if !(columns.determinant().abs() > 1e-6 && white.is_finite() && white.min_element() >= 0.0) {
            return None;
        }
        let scale = columns.inverse() * white;
        let matrix = columns * DMat3::from_diagonal(scale);
        (matrix.is_finite() && scale.min_element() > 0.0).then_some(matrix)
    }

    /// Linear Rec. 709 from linear colours of these primaries: by way of CIE XYZ, with Bradford's adaptation of the white (Lam 1985) where it differs, so
    /// that what is white stays white. Nothing if these are no primaries.
    pub fn to_rec709(&self) -> Option<DMat3> {
        if self.is_rec709() {
            return Some(DMat3::IDENTITY);
        }
        let bradford =
            DMat3::from_cols(DVec3::new(0.8951, -0.7502, 0.0389), DVec3::new(0.2664, 1.7135, -0.0685), DVec3::new(-0.1614, 0.0367, 1.0296));
        let cone = |white: [f64; 2]| bradford * (DVec3::new(white[0], white[1], 1.0 - white[0] - white[1]) / white[1]);
        let gain = cone(Self::REC709.white) / cone(self.white);
        let adapt = bradford.inverse() * DMat3::from_diagonal(gain) * bradford;
        let matrix = Self::REC709.to_xyz()?.inverse() * adapt * self.to_xyz()?;
        matrix.is_finite().then_some(matrix)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_rows(primaries: Primaries, rows: [[f64; 3]; 3]) {
        let found = primaries.to_rec709().unwrap().transpose().to_cols_array_2d();
        for (found, expected) in found.as_flattened().iter().zip(rows.as_flattened()) {
            assert!((found - expected).abs() < 5e-4, "{found} is not {expected}");
        }
    }

    #[test]
    fn known_matrices() {
        // ITU-R BT.2087, table 4.
        let rec2020 = Primaries { rgb: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046]], white: [0.3127, 0.3290] };
        assert_rows(rec2020, [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]]);
        // ACES 2065-1, whose white is not D65, as OpenColorIO's ACES configuration has it with Bradford's adaptation.
        let aces = Primaries { rgb: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], white: [0.32168, 0.33767] };
        assert_rows(aces, [[2.52169, -1.13413, -0.38756], [-0.27648, 1.37272, -0.09624], [-0.01538, -0.15298, 1.16835]]);
    }

    #[test]
    fn white_stays_white() {
        for white in [[0.3127, 0.3290], [1.0 / 3.0, 1.0 / 3.0], [0.3457, 0.3585]] {
            for rgb in [Primaries::REC709.rgb, Primaries::XYZ.rgb, [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]]] {
                let found = Primaries { rgb, white }.to_rec709().unwrap() * DVec3::ONE;
                assert!((found - DVec3::ONE).abs().max_element() < 1e-6, "{found}");
            }
        }
    }

    #[test]
    fn rounding_is_the_same_space_and_nonsense_is_none() {
        let rounded = Primaries { white: [0.313, 0.329], ..Primaries::REC709 };
        assert_eq!(rounded.to_rec709(), Some(DMat3::IDENTITY));
        for nonsense in [
            Primaries { rgb: [[0.0; 2]; 3], white: [0.0; 2] },
            Primaries { rgb: [[0.3, 0.3]; 3], ..Primaries::REC709 },
            Primaries { white: [0.3, 0.0], ..Primaries::REC709 },
            Primaries { white: [f64::NAN, 0.3], ..Primaries::REC709 },
            Primaries { rgb: [[f64::INFINITY, 0.3], [0.3, 0.6], [0.15, 0.06]], ..Primaries::REC709 },
            // A white outside of the triangle.
            Primaries { white: [0.7, 0.3], ..Primaries::REC709 },
        ] {
            assert_eq!(nonsense.to_rec709(), None, "{nonsense}");
        }
    }
}
