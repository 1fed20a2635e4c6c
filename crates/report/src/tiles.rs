//! Which variant is closest to the reference, tile by tile.

use serde::{Deserialize, Serialize};

/// Which variant is closest to the reference, tile by tile, on the pictures as displayed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WhereMap {
    /// Tiles in a row.
    pub columns: u32,
    /// Rows of tiles.
    pub rows: u32,
    /// Index of the variant that is visibly closer than all others, row by row from the top; none where no variant is, or where that is not shown.
    pub closest: Vec<Option<usize>>,
    /// For each variant, the mean absolute difference of each tile from the reference, in levels of 255.
    pub distance: Vec<Vec<f64>>,
}

impl WhereMap {
    /// Whether the parts go together.
    pub(crate) fn is_whole(&self, variants: usize) -> bool {
        let tiles = self.columns as usize * self.rows as usize;
        let counts = self.distance.len() == variants && self.distance.iter().all(|distance| distance.len() == tiles);
        tiles > 0 && counts && self.closest.len() == tiles && self.closest.iter().flatten().all(|variant| *variant < variants)
    }

    /// Share of the tiles in which a variant leads.
    pub(crate) fn share(&self, variant: usize) -> f64 {
        self.closest.iter().filter(|winner| **winner == Some(variant)).count() as f64 / self.closest.len() as f64
    }

    pub(crate) fn sentences(&self, name: impl Fn(usize) -> String) -> Vec<String> {
        let mut leads: Vec<usize> = (0..self.distance.len()).filter(|&variant| self.share(variant) > 0.0).collect();
        leads.sort_by(|&a, &b| self.share(b).total_cmp(&self.share(a)));
        if leads.is_empty() {
            return vec!["Nowhere in the picture is one of them shown to be visibly closer to the reference.".to_owned()];
        }
        let parts: Vec<String> = leads
            .iter()
            .map(|&variant| {
                let advantage = |tile: usize| {
                    let runner_up = (0..self.distance.len()).filter(|&other| other != variant).map(|other| self.distance[other][tile]);
                    let lead = runner_up.fold(f64::INFINITY, f64::min) - self.distance[variant][tile];
                    if self.closest[tile] == Some(variant) { lead } else { 0.0 }
                };
                let share = self.share(variant) * 100.0;
                format!("{} in {share:.0} % of the picture, most at the {}", name(variant), self.region(advantage))
            })
            .collect();
        let mut sentences = vec![format!("Visibly closer to the reference: {}.", parts.join("; "))];
        let best = leads[0];
        if self.distance[best].iter().any(|&distance| distance >= 1.0) {
            let region = self.region(|tile| self.distance[best][tile]);
            sentences.push(format!("What is left of the error of {} is largest at the {region}.", name(best)));
        }
        sentences
    }

    /// The ninth of the picture where the mean weight is largest.
    fn region(&self, weight: impl Fn(usize) -> f64) -> &'static str {
        const NAMES: [&str; 9] = ["upper left", "top", "upper right", "left", "centre", "right", "lower left", "bottom", "lower right"];
        let (mut sums, mut counts) = ([0.0f64; 9], [0.0f64; 9]);
        for tile in 0..self.closest.len() {
            let (column, row) = (tile as u32 % self.columns, tile as u32 / self.columns);
            let ninth = (row * 3 / self.rows * 3 + column * 3 / self.columns) as usize;
            sums[ninth] += weight(tile);
            counts[ninth] += 1.0;
        }
        let mean = |ninth: usize| sums[ninth] / counts[ninth].max(1.0);
        let largest = (0..9).max_by(|&a, &b| mean(a).total_cmp(&mean(b))).unwrap_or(4);
        NAMES[largest]
    }
}
