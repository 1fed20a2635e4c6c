//! The table of linearly transformed cosines, as `cargo xtask fit-ltc` writes it.

/// What is wrong with a table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TableError {
    /// It does not begin as a table does.
    #[error("this is no table of linearly transformed cosines: it does not begin with `LTC1`")]
    NoTable,
    /// Its length is not what its size asks for.
    #[error("the table is {found} bytes long, but one of {size} x {size} fits takes {wanted}")]
    Length {
        /// Fits a side.
        size: u32,
        /// Bytes there are.
        found: usize,
        /// Bytes there should be.
        wanted: usize,
    },
    /// A number is not finite.
    #[error("fit {0} holds a number that is not finite")]
    NotFinite(usize),
}

/// Fits over roughness (rows, from 0 to 1) and view angle (columns; the cosine is `1 - (column / last)^2`).
#[derive(Clone, Debug, PartialEq)]
pub struct LtcTable {
    /// Fits a side, at least 2.
    pub size: u32,
    /// Of each: four numbers of the inverse map (`lobelia::linearly_transformed_cosine`), the share of light that is reflected where all reflect all, and
    /// that with Schlick's term `(1 - h.v)^5`.
    pub fits: Vec<[f32; 6]>,
}

impl LtcTable {
    /// The table of GGX that comes with this crate.
    pub fn ggx() -> Result<Self, TableError> {
        Self::read(include_bytes!("../data/ltc-ggx.bin"))
    }

    /// Reads a file's bytes: `LTC1`, the size, the fits, little-endian.
    pub fn read(bytes: &[u8]) -> Result<Self, TableError> {
        let (magic, rest) = bytes.split_at_checked(4).ok_or(TableError::NoTable)?;
        let (size, numbers) = rest.split_at_checked(4).ok_or(TableError::NoTable)?;
        let size = size.try_into().map(u32::from_le_bytes).map_err(|_| TableError::NoTable)?;
        if magic != b"LTC1" || !(2..=4096).contains(&size) {
            return Err(TableError::NoTable);
        }
        let wanted = size as usize * size as usize * 24;
        if numbers.len() != wanted {
            return Err(TableError::Length { size, found: bytes.len(), wanted: wanted + 8 });
        }
        let number = |bytes: &[u8]| bytes.try_into().map_or(0.0, f32::from_le_bytes);
        let fit = |bytes: &[u8]| std::array::from_fn(|index| number(&bytes[4 * index..4 * index + 4]));
        let fits: Vec<[f32; 6]> = numbers.chunks_exact(24).map(fit).collect();
        match fits.iter().position(|fit| fit.iter().any(|number| !number.is_finite())) {
            Some(index) => Err(TableError::NotFinite(index)),
            None => Ok(Self { size, fits }),
        }
    }

    /// The six numbers for a roughness and a cosine of the view, bilinear as on the device.
    pub fn at(&self, roughness: f64, cosine: f64) -> [f64; 6] {
        let last = f64::from(self.size - 1);
        let place = |x: f64| {
            let x = x.clamp(0.0, 1.0) * last;
            let low = x.floor().min(last - 1.0);
            (low as usize, x - low)
        };
        let (row, down) = place(roughness);
        let (column, right) = place((1.0 - cosine.clamp(0.0, 1.0)).sqrt());
        let at = |row: usize, column: usize| self.fits[row * self.size as usize + column].map(f64::from);
        let corners = [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)];
        std::array::from_fn(|index| {
            let [a, b, c, d] = corners.map(|corner| corner[index]);
            (a + (b - a) * right) * (1.0 - down) + (c + (d - c) * right) * down
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use glam::DVec3;
    use lobelia_lobes::{
        brdf::{Brdf, Distribution},
        linearly_transformed_cosine::LinearlyTransformedCosine,
        sampling::{ggx_reflection_pdf, r2_point, sample_ggx_visible_normal},
    };

    #[test]
    fn spoilt_tables_are_refused() {
        let good = include_bytes!("../data/ltc-ggx.bin");
        assert!(LtcTable::read(good).is_ok());
        assert_eq!(LtcTable::read(b"LTC"), Err(TableError::NoTable));
        assert_eq!(LtcTable::read(b"LTC2\x40\0\0\0"), Err(TableError::NoTable));
        assert!(matches!(LtcTable::read(&good[..good.len() - 1]), Err(TableError::Length { size: 64, .. })));
        let mut spoilt = good.to_vec();
        spoilt[8 + 24 * 5..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(LtcTable::read(&spoilt), Err(TableError::NotFinite(5)));
    }

    /// Mean of `(wanted - found)^2` over that of the mean square, by samples of the lobe.
    fn misfit(alpha: f64, cosine: f64, stretch: f64) -> f64 {
        let fit = LtcTable::ggx().unwrap().at(alpha.sqrt(), cosine);
        let lobe = LinearlyTransformedCosine::new([stretch * fit[0], stretch * fit[1], fit[2], fit[3]]);
        let brdf =
            Brdf { diffuse: DVec3::ZERO, reflectance_normal: DVec3::ONE, reflectance_grazing: 1.0, alpha, distribution: Distribution::Ggx };
        let view = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
        let (mut error, mut all) = (0.0, 0.0);
        for index in 0..20_000 {
            let half = sample_ggx_visible_normal(alpha, DVec3::Z, view, r2_point(index, 0));
            let light = half * (2.0 * half.dot(view)) - view;
            if light.z <= 0.0 {
                continue;
            }
            let wanted = brdf.evaluate(DVec3::Z, light, view).x * light.z;
            let found = fit[4] * lobe.evaluate(light);
            let pdf = ggx_reflection_pdf(alpha, DVec3::Z, view, light);
            error += (wanted - found).powi(2) / pdf;
            all += wanted * wanted / pdf;
        }
        error / all
    }

    #[test]
    fn the_table_is_that_of_our_reflectance() {
        // Largest of the relative squared misfits of Heitz et al.'s lobe, whose shape is not that of GGX.
        for (alpha, cosine, most) in [(0.01, 0.9, 0.02), (0.1, 0.9, 0.02), (0.3, 0.7, 0.02), (0.6, 0.5, 0.04), (0.2, 0.3, 0.06)] {
            let misfit = [1.0, 1.2].map(|stretch| misfit(alpha, cosine, stretch));
            assert!(misfit[0] < most, "alpha {alpha}, cosine {cosine}: {misfit:?}");
            assert!(misfit[1] > 1.3 * misfit[0], "a stretched lobe fits as well: {misfit:?}");
        }
    }
}
