//! Which pixels of a picture count.

use crate::{Image, MeasureError};

/// Which pixels count.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Row by row; `true` counts.
    pub counts: Vec<bool>,
}

impl Mask {
    /// Everything.
    pub fn all(image: &Image) -> Self {
        Self { counts: vec![true; image.pixels.len()] }
    }

    /// Leaves out outlines and creases, where a pixel mixes what several surfaces send and one ray through its centre cannot stand for it.
    ///
    /// A pixel and its right or lower neighbour are both left out if one of them sees a surface and the other does not, if the farther of their
    /// distances is more than `distance_ratio` times the nearer, or if the cosine between their normals is below `cosine`. The ratio is one of first
    /// differences: a plane seen at a very flat angle is left out too, which costs pixels and lets no edge through.
    ///
    /// `normals` are unit vectors and `distances` metres from the eye, row by row, `distances.len()` a multiple of `width`; a distance of 0 means that
    /// nothing is seen, and its normal is not looked at. `distance_ratio` >= 1, `cosine` in [-1, 1]. [`MeasureError::Size`] if the arrays do not go
    /// together.
    pub fn away_from_silhouettes(
        width: usize,
        normals: &[[f32; 3]],
        distances: &[f32],
        distance_ratio: f32,
        cosine: f32,
    ) -> Result<Self, MeasureError> {
        if width == 0 || !distances.len().is_multiple_of(width) || normals.len() != distances.len() {
            return Err(MeasureError::Size(format!(
                "{} distances and {} normals are no picture of {width} pixels a row",
                distances.len(),
                normals.len()
            )));
        }
        let abrupt = |a: usize, b: usize| {
            let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (one, other) = (distances[a], distances[b]);
            let nothing = one == 0.0 && other == 0.0;
            // Every comparison fails for a NaN, which makes it an edge.
            let close = one > 0.0 && other > 0.0 && one <= distance_ratio * other && other <= distance_ratio * one;
            !(nothing || (close && dot(normals[a], normals[b]) >= cosine))
        };
        let mut counts = vec![true; distances.len()];
        for index in 0..distances.len() {
            let right = (index % width + 1 < width).then_some(index + 1);
            let below = Some(index + width).filter(|below| *below < distances.len());
            for neighbour in right.into_iter().chain(below).filter(|neighbour| abrupt(index, *neighbour)) {
                (counts[index], counts[neighbour]) = (false, false);
            }
        }
        Ok(Self { counts })
    }

    /// Takes away every pixel within `radius` of one that does not count, in a square: what is left out is dilated.
    ///
    /// Rows have `width` pixels; the last one may be shorter. A width of 0 is taken for one row.
    pub fn eroded(&self, width: usize, radius: usize) -> Self {
        let width = if width == 0 { self.counts.len().max(1) } else { width };
        let near = |x: usize, y: usize| {
            (y.saturating_sub(radius)..=y.saturating_add(radius).min(self.counts.len() / width)).all(|row| {
                let columns = x.saturating_sub(radius)..=x.saturating_add(radius).min(width - 1);
                columns.into_iter().all(|column| self.counts.get(row * width + column).copied().unwrap_or(true))
            })
        };
        let counts = (0..self.counts.len()).map(|index| near(index % width, index / width)).collect();
        Self { counts }
    }

    /// Share of pixels that count; 0 without pixels.
    pub fn share(&self) -> f64 {
        self.counts.iter().filter(|counts| **counts).count() as f64 / self.counts.len().max(1) as f64
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    const UP: [f32; 3] = [0.0, 1.0, 0.0];
    const SIDE: [f32; 3] = [1.0, 0.0, 0.0];

    fn row(normals: &[[f32; 3]], distances: &[f32]) -> Vec<bool> {
        Mask::away_from_silhouettes(distances.len(), normals, distances, 1.05, 0.9).unwrap().counts
    }

    #[test]
    fn eroding_takes_the_neighbourhood_too() {
        let mask = Mask { counts: vec![true, true, true, true, false] };
        assert_eq!(mask.eroded(5, 1).counts, [true, true, true, false, false]);
        assert_eq!(mask.eroded(5, 1).share(), 0.6);
        assert_eq!(mask.eroded(5, 0), mask);
        // The same five pixels one above the other, then as rows of two with a short last one.
        assert_eq!(mask.eroded(1, 1).counts, [true, true, true, false, false]);
        assert_eq!(mask.eroded(2, 1).counts, [true, true, false, false, false]);
        assert_eq!(mask.eroded(0, 1), mask.eroded(5, 1));
        assert_eq!(mask.eroded(5, usize::MAX).share(), 0.0);
    }

    #[test]
    fn both_sides_of_an_edge_are_left_out() {
        assert_eq!(row(&[UP; 4], &[1.0, 1.0, 2.0, 2.0]), [true, false, false, true], "an outline");
        assert_eq!(row(&[UP, UP, SIDE, SIDE], &[1.0; 4]), [true, false, false, true], "a crease");
        assert_eq!(row(&[UP, UP, [0.0; 3], [0.0; 3]], &[1.0, 1.0, 0.0, 0.0]), [true, false, false, true], "against nothing");
        assert_eq!(row(&[UP; 4], &[1.0, 1.0, f32::NAN, 1.0]), [true, false, false, false], "not a number");
        let below = Mask::away_from_silhouettes(2, &[UP, UP, SIDE, UP], &[1.0; 4], 1.05, 0.9).unwrap();
        assert_eq!(below.counts, [false, true, false, false]);
    }

    #[test]
    fn what_is_smooth_or_empty_counts() {
        assert_eq!(row(&[UP; 4], &[1.0, 1.04, 1.08, 1.12]), [true; 4]);
        assert_eq!(row(&[[0.0; 3]; 3], &[0.0; 3]), [true; 3]);
    }

    #[test]
    fn arrays_that_do_not_go_together_are_refused() {
        for (width, normals, distances) in [(0, 4, 4), (3, 4, 4), (2, 3, 4)] {
            let refused = Mask::away_from_silhouettes(width, &vec![UP; normals], &vec![1.0; distances], 1.05, 0.9);
            assert!(matches!(refused, Err(MeasureError::Size(_))), "{width} {normals} {distances}");
        }
    }
}
