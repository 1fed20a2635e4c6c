//! Pixels that are no radiance.

use super::Radiance;

/// How many pixels had a channel that is no radiance, by what it was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// Below zero; now zero.
    pub negative: usize,
    /// NaN; now zero.
    pub nan: usize,
    /// Infinite; now the largest finite value beside it.
    pub infinite: usize,
}

impl Mended {
    /// What was done, in words; nothing if nothing was.
    pub fn words(&self) -> Option<String> {
        let parts = [
            (self.negative, "negative, now 0"),
            (self.nan, "NaN, now 0"),
            (self.infinite, "infinite, now the largest finite value beside it"),
        ];
        let parts: Vec<String> = parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        (!parts.is_empty()).then(|| format!("pixels that are no radiance are clamped: {}", parts.join("; ")))
    }
}

impl Radiance {
    /// Makes every value finite and not negative. What is infinite becomes the largest finite value of the nearest pixels that have one, around the
    /// seam at the left and right, which an environment does not have; 0 if there is none at all.
    pub fn mend(&mut self) -> Mended {
        let mut mended = Mended::default();
        for pixel in &mut self.pixels {
            mended.negative += usize::from(pixel.iter().any(|value| *value < 0.0));
            mended.nan += usize::from(pixel.iter().any(|value| value.is_nan()));
            mended.infinite += usize::from(pixel.contains(&f32::INFINITY));
            // Zero also for -0, whose sign would make -inf of a reciprocal.
            *pixel = pixel.map(|value| if value > 0.0 { value } else { 0.0 });
        }
        if mended.infinite > 0 {
            (0..3).for_each(|channel| self.fill_infinite(channel));
        }
        mended
    }

    /// Grows finite values into what is infinite, one ring of pixels after another.
    fn fill_infinite(&mut self, channel: usize) {
        let mut open: Vec<usize> = (0..self.pixels.len()).filter(|place| self.pixels[*place][channel].is_infinite()).collect();
        let neighbours = |place: usize, width: usize, height: usize| {
            let (x, y) = (place % width, place / width);
            let rows = y.saturating_sub(1)..=(y + 1).min(height - 1);
            rows.flat_map(move |row| [width - 1, 0, 1].map(|step| row * width + (x + step) % width))
        };
        let (width, height) = (self.width, self.height);
        let finite_beside = |pixels: &[[f32; 3]], place: usize| {
            let values = neighbours(place, width, height).map(|other| pixels[other][channel]).filter(|value| value.is_finite());
            values.reduce(f32::max)
        };
        while !open.is_empty() {
            let ring: Vec<(usize, f32)> = open.iter().filter_map(|place| Some((*place, finite_beside(&self.pixels, *place)?))).collect();
            if ring.is_empty() {
                open.iter().for_each(|place| self.pixels[*place][channel] = 0.0);
                return;
            }
            for (place, value) in &ring {
                self.pixels[*place][channel] = *value;
            }
            // Only what lies beside this ring can be next.
            let mut next: Vec<usize> = ring.iter().flat_map(|(place, _)| neighbours(*place, width, height)).collect();
            next.retain(|place| self.pixels[*place][channel].is_infinite());
            next.sort_unstable();
            next.dedup();
            open = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[f32]) -> Radiance {
        Radiance { width: values.len(), height: 1, pixels: values.iter().map(|value| [*value, 1.0, 2.0]).collect(), notes: Vec::new() }
    }

    fn red(picture: &Radiance) -> Vec<f32> {
        picture.pixels.iter().map(|pixel| pixel[0]).collect()
    }

    #[test]
    fn what_is_no_radiance_is_clamped_and_counted() {
        let mut picture = row(&[1.0, -2.0, f32::NAN, 3.0, f32::NEG_INFINITY, -0.0]);
        let mended = picture.mend();
        assert_eq!(mended, Mended { negative: 2, nan: 1, infinite: 0 });
        assert_eq!(red(&picture), [1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
        assert!(picture.pixels.iter().all(|pixel| pixel[0].is_sign_positive() && pixel[1..] == [1.0, 2.0]));
        assert!(mended.words().is_some_and(|words| words.contains("2 negative") && words.contains("1 NaN") && !words.contains("infinite")));
        assert_eq!(picture.mend().words(), None);
    }

    #[test]
    fn infinity_becomes_the_largest_finite_neighbour() {
        const INF: f32 = f32::INFINITY;
        let mut picture = row(&[1.0, 7.0, INF, 5.0, 1.0]);
        assert_eq!(picture.mend(), Mended { infinite: 1, ..Mended::default() });
        assert_eq!(red(&picture), [1.0, 7.0, 7.0, 5.0, 1.0]);
        // A run of five, grown from both of its ends, and across the seam.
        let mut picture = row(&[INF, INF, INF, 2.0, 9.0, 4.0, INF, INF]);
        assert_eq!(picture.mend().infinite, 5);
        assert_eq!(red(&picture), [4.0, 2.0, 2.0, 2.0, 9.0, 4.0, 4.0, 4.0]);
        let mut picture = row(&[INF, INF]);
        picture.mend();
        assert_eq!(red(&picture), [0.0, 0.0]);
        // A disc of the sun that a half float could not hold.
        let (width, height) = (400, 200);
        let mut sun = Radiance { width, height, pixels: vec![[1.0; 3]; width * height], notes: Vec::new() };
        for y in 0..height {
            for x in 0..width {
                let across = (x as f32 - 3.0).abs();
                let distance = across.min(width as f32 - across).hypot(y as f32 - 90.0);
                sun.pixels[y * width + x] = if distance < 60.0 {
                    [INF; 3]
                } else if distance < 62.0 {
                    [6e4, 5e4, 4e4]
                } else {
                    [1.0; 3]
                };
            }
        }
        assert!(sun.mend().infinite > 9000);
        assert_eq!(sun.pixels[90 * width + 3], [6e4, 5e4, 4e4]);
        assert!(sun.pixels.iter().flatten().all(|value| value.is_finite()));
    }
}
