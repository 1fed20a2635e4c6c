//! Metrics with their replicates: what samples, seeds and the noise of the reference do to them.

use crate::{
    Image, MeasureError, Metrics, measure_each,
    sampled::{Replication, Sampled},
};
use rayon::prelude::*;
use std::{collections::BTreeMap, f64::consts::TAU};

/// A picture, and the parts or repetitions of it that tell its noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Pictures {
    /// What is measured.
    pub image: Image,
    /// How the others came about. [`Replication::LeaveOut`]: `parts` are the means of groups of samples, whose means weighted by their shares are the image.
    /// Otherwise they are whole pictures with other random numbers.
    pub replication: Replication,
    /// Groups, or whole pictures.
    pub parts: Vec<Image>,
}

impl Pictures {
    /// A picture of whose noise nothing is known.
    pub fn alone(image: Image) -> Self {
        Self { image, replication: Replication::Repeats, parts: Vec::new() }
    }

    /// The picture without one group, or one of the repetitions.
    fn replicate(&self, index: usize) -> Image {
        match &self.replication {
            Replication::LeaveOut(shares) => {
                let share = shares[index];
                let rest = |(all, part): (&[f32; 3], &[f32; 3])| {
                    [0, 1, 2].map(|channel| ((f64::from(all[channel]) - share * f64::from(part[channel])) / (1.0 - share)) as f32)
                };
                Image { pixels: self.image.pixels.iter().zip(&self.parts[index].pixels).map(rest).collect(), ..self.image.clone() }
            }
            _ => self.parts[index].clone(),
        }
    }
}

/// A picture with normal noise of the given variance added, times `scale`; the same `draw` adds the same noise. The channels of a pixel share one draw, as those of a path
/// do. Values may fall below 0: noise that could not would have a mean.
fn jostled(image: &Image, variance: &[[f32; 3]], scale: f64, draw: u64) -> Image {
    let pixel = |(index, (pixel, variance)): (usize, (&[f32; 3], &[f32; 3]))| {
        let normal = scale * normal(draw, index as u64);
        [0, 1, 2].map(|channel| (f64::from(pixel[channel]) + normal * f64::from(variance[channel].max(0.0)).sqrt()) as f32)
    };
    Image { pixels: image.pixels.iter().zip(variance).enumerate().map(pixel).collect(), ..image.clone() }
}

/// A standard normal number (Box and Muller 1958) from two hashes.
fn normal(draw: u64, index: u64) -> f64 {
    // SplitMix64 (Steele, Lea and Flood 2014).
    let hash = |seed: u64| {
        let mut x = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let uniform = |salt: u64| ((hash(hash(2 * index + salt) ^ hash(!draw)) >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    (-2.0 * uniform(0).ln()).sqrt() * (TAU * uniform(1)).cos()
}

/// The reference and the picture of each technique in one replicate, none for a technique that has fewer. All techniques see the same moved reference; an empty `variance`
/// leaves it where it is.
pub fn replicate(reference: &Image, variance: &[[f32; 3]], techniques: &[Pictures], index: usize) -> (Image, Vec<Option<Image>>) {
    let scale = techniques.iter().find(|technique| index < technique.parts.len()).map_or(1.0, |technique| match &technique.replication {
        // Without a group, a mean moves by the root of this, times its standard deviation.
        Replication::LeaveOut(shares) => shares[index].sqrt() / (1.0 - shares[index]),
        _ => 1.0,
    });
    let moved = if variance.is_empty() { reference.clone() } else { jostled(reference, variance, scale, index as u64) };
    let pictures = techniques.iter().map(|technique| (index < technique.parts.len()).then(|| technique.replicate(index)));
    (moved, pictures.collect())
}

/// Metrics of several techniques against one reference, by name, each with replicates in which the samples of the technique and the noise of the reference vary.
///
/// `variance` is that of each value of the reference, empty where it is not known: the reference then counts as exact. A replicate that leaves out a group of samples
/// moves the reference as far as leaving out as large a share of its samples would, so that both noises come out at their size, and all techniques see the same moved
/// reference, so that it cancels from their differences as far as it should. A technique without parts has values without replicates. The order is that of the
/// techniques.
pub fn measure_replicates(
    reference: &Image,
    variance: &[[f32; 3]],
    techniques: &[Pictures],
) -> Result<Vec<BTreeMap<&'static str, Sampled>>, MeasureError> {
    if !variance.is_empty() && variance.len() != reference.pixels.len() {
        let what = format!("{} variances do not go with {} pixels", variance.len(), reference.pixels.len());
        return Err(MeasureError::Size(what));
    }
    for technique in techniques {
        let shares = match &technique.replication {
            Replication::LeaveOut(shares) => shares.len() == technique.parts.len() && shares.iter().all(|share| (0.0..1.0).contains(share)),
            _ => true,
        };
        if !shares || technique.parts.iter().any(|part| part.pixels.len() != technique.image.pixels.len()) {
            return Err(MeasureError::Size("parts of a picture do not go together with it".into()));
        }
    }
    let images: Vec<&Image> = techniques.iter().map(|technique| &technique.image).collect();
    let values = measure_each(reference, &images)?;
    let rounds = techniques.iter().map(|technique| technique.parts.len()).max().unwrap_or(0);
    let round = |index: usize| -> Result<Vec<Option<Metrics>>, MeasureError> {
        let (moved, pictures) = replicate(reference, variance, techniques, index);
        let taking: Vec<&Image> = pictures.iter().flatten().collect();
        let mut found = measure_each(&moved, &taking)?.into_iter();
        Ok(pictures.iter().map(|picture| picture.as_ref().and_then(|_| found.next())).collect())
    };
    let replicates: Vec<Vec<Option<Metrics>>> = (0..rounds).into_par_iter().map(round).collect::<Result<_, _>>()?;
    let sampled = |(index, (technique, value)): (usize, (&Pictures, Metrics))| {
        let parts: Vec<[(&str, f64); 9]> = replicates.iter().filter_map(|round| round[index]).map(|metrics| metrics.by_name()).collect();
        let metric = |(place, (name, value)): (usize, (&'static str, f64))| {
            let replicates = parts.iter().map(|part| part[place].1).collect();
            (name, Sampled { value, replicates, replication: technique.replication.clone() })
        };
        value.by_name().into_iter().enumerate().map(metric).collect()
    };
    Ok(techniques.iter().zip(values).enumerate().map(sampled).collect())
}

/// What a picture without any error would score against this reference, for the reference's own noise alone.
pub fn noise_floor(reference: &Image, variance: &[[f32; 3]]) -> Result<Metrics, MeasureError> {
    if variance.len() != reference.pixels.len() {
        return Err(MeasureError::Size(format!("{} variances do not go with {} pixels", variance.len(), reference.pixels.len())));
    }
    crate::measure(reference, &jostled(reference, variance, 1.0, u64::MAX))
}
