//! Where in the picture which technique is closer to the reference.

use lobelia_measure::{
    Image, Pictures, display, replicate,
    sampled::{Difference, Outcome, Sampled},
};
use lobelia_report::WhereMap;

/// A lead must be visible: at least this much of the runner-up's distance, and this many levels of 255.
const LEAD: f64 = 0.1;
const LEAD_LEVELS: f64 = 0.25;

/// Most tiles along a side.
const MOST: usize = 24;

/// Which technique is closest to the reference, tile by tile, on the pictures as [`display`] shows them: only where its lead over every other is visible and is shown to be
/// more than noise. None with fewer than two techniques, or where sizes differ.
pub fn where_closest(reference: &Image, variance: &[[f32; 3]], techniques: &[Pictures]) -> Option<WhereMap> {
    let (width, height) = (reference.width, reference.height);
    let fits = techniques.iter().all(|technique| (technique.image.width, technique.image.height) == (width, height));
    if techniques.len() < 2 || width == 0 || height == 0 || !fits {
        return None;
    }
    let columns = width.min(MOST);
    let rows = ((columns * height) as f64 / width as f64).round().clamp(1.0, height.min(MOST) as f64) as usize;
    let tile_of = |index: usize| index / width * rows / height * columns + index % width * columns / width;
    let distances = |reference: &Image, image: &Image| -> Vec<f64> {
        let (expected, found) = (display(reference, reference), display(reference, image));
        let (mut sums, mut counts) = (vec![0.0; columns * rows], vec![0.0; columns * rows]);
        for (index, (a, b)) in expected.pixels.iter().zip(&found.pixels).enumerate() {
            let tile = tile_of(index);
            sums[tile] += (0..3).map(|channel| f64::from((a[channel] - b[channel]).abs())).sum::<f64>() * 85.0;
            counts[tile] += 1.0;
        }
        sums.iter().zip(&counts).map(|(sum, count)| sum / f64::max(*count, 1.0)).collect()
    };
    let values: Vec<Vec<f64>> = techniques.iter().map(|technique| distances(reference, &technique.image)).collect();
    let most = techniques.iter().map(|technique| technique.parts.len()).max().unwrap_or(0);
    let mut replicates: Vec<Vec<Vec<f64>>> = vec![Vec::new(); techniques.len()];
    for index in 0..most {
        let (moved, pictures) = replicate(reference, variance, techniques, index);
        for (found, picture) in replicates.iter_mut().zip(pictures) {
            found.extend(picture.map(|picture| distances(&moved, &picture)));
        }
    }
    let sampled = |technique: usize, tile: usize| Sampled {
        value: values[technique][tile],
        replicates: replicates[technique].iter().map(|distances| distances[tile]).collect(),
        replication: techniques[technique].replication.clone(),
    };
    let closest = (0..columns * rows).map(|tile| {
        let best = (0..techniques.len()).min_by(|&a, &b| values[a][tile].total_cmp(&values[b][tile]))?;
        let leads = (0..techniques.len()).filter(|&other| other != best).all(|other| {
            let least = LEAD_LEVELS.max(LEAD * values[other][tile]);
            Difference::paired(&sampled(best, tile), &sampled(other, tile)).outcome(least) == Outcome::First
        });
        leads.then_some(best)
    });
    Some(WhereMap { columns: columns as u32, rows: rows as u32, closest: closest.collect(), distance: values.clone() })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use lobelia_measure::sampled::Replication;

    fn flat(value: impl Fn(usize, usize) -> f32) -> Image {
        Image { width: 48, height: 24, pixels: (0..48 * 24).map(|index| [value(index % 48, index / 48); 3]).collect() }
    }

    fn steady(image: Image) -> Pictures {
        let parts = vec![image.clone(); 4];
        Pictures { image, replication: Replication::Repeats, parts }
    }

    #[test]
    fn the_closer_one_leads_where_it_is_shown_to() {
        let reference = flat(|_, _| 0.5);
        let left = steady(flat(|x, _| if x < 24 { 0.5 } else { 0.6 }));
        let right = steady(flat(|x, _| if x < 24 { 0.6 } else { 0.5 }));
        let map = where_closest(&reference, &[], &[left.clone(), right]).unwrap();
        assert_eq!((map.columns, map.rows), (24, 12));
        for (tile, closest) in map.closest.iter().enumerate() {
            assert_eq!(*closest, Some(usize::from(tile % 24 >= 12)));
        }
        // The same picture twice, and one alone.
        assert!(where_closest(&reference, &[], &[left.clone(), left.clone()]).unwrap().closest.iter().all(Option::is_none));
        assert_eq!(where_closest(&reference, &[], std::slice::from_ref(&left)), None);
        // A lead that comes and goes with the seed is none.
        let noisy = |sign: f32| Pictures {
            image: flat(|_, _| 0.5 + 0.02 * sign),
            replication: Replication::Repeats,
            parts: [0.02f32, -0.02, 0.06, -0.05].map(|off| flat(|_, _| 0.5 + off * sign)).to_vec(),
        };
        let two = [noisy(1.0), steady(flat(|_, _| 0.55))];
        assert!(where_closest(&reference, &[], &two).unwrap().closest.iter().all(Option::is_none));
        // Nor is one whose noise is not known.
        let alone = [Pictures::alone(reference.clone()), Pictures::alone(flat(|_, _| 0.6))];
        assert!(where_closest(&reference, &[], &alone).unwrap().closest.iter().all(Option::is_none));
    }
}
