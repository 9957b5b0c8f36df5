// SPDX-License-Identifier: MIT OR Apache-2.0
//! One sample of a map: a weighted mean of bins, at a point or over a spot.

use std::sync::Arc;

use super::illuminance::Grid;

/// A weighted mean of bins.
#[derive(Debug, Clone)]
pub(crate) enum Sample {
    /// Up to four bins.
    Between { bins: [usize; 4], weights: [f64; 4] },
    /// Any number of bins.
    Spot(Arc<[(usize, f64)]>),
}

/// Chords of a spot in a row of bins.
const CHORDS: usize = 8;

impl Sample {
    /// Bin `k` times `weight`.
    pub fn bin(k: usize, weight: f64) -> Self {
        Self::Between { bins: [k; 4], weights: [weight, 0.0, 0.0, 0.0] }
    }

    /// Bilinear interpolation at `[x, y]`, mm, as [`Grid::at`], between the bins that are `counted`.
    pub fn at(grid: Grid, counted: Option<&[f64]>, [x, y]: [f64; 2]) -> Self {
        let (bins, [a, b]) = grid.corners(x, y);
        let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
        let is_counted = |bin: usize| counted.is_none_or(|parts| parts[bin] > 0.0);
        let within: [f64; 4] =
            std::array::from_fn(|k| if is_counted(bins[k]) { weights[k] } else { 0.0 });
        let whole: f64 = within.iter().sum();
        let is_cut = bins.iter().any(|bin| !is_counted(*bin));
        let weights = if is_cut && whole > 0.0 { within.map(|w| w / whole) } else { weights };
        Self::Between { bins, weights }
    }

    /// Mean over a disc about `[x, y]`, mm, or an ellipse of these diameters along x and y: bins by
    /// their part in it, of those on the map, and the part of that which is `counted`.
    pub fn spot(
        grid: Grid,
        counted: Option<&[f64]>,
        [x, y]: [f64; 2],
        diameters_mm: [f64; 2],
    ) -> Self {
        let [across, radius] = diameters_mm.map(|diameter_mm| 0.5 * diameter_mm);
        // Bins from one end of an interval to the other, with the ends of each that lie within.
        let parts = |[from, to]: [f64; 2], count: usize| {
            let edge = move |i: usize| (i as f64 - 0.5 * count as f64) * grid.bin_mm;
            let place = |at: f64| (at / grid.bin_mm + 0.5 * count as f64).clamp(0.0, count as f64);
            let bins = place(from).floor() as usize..place(to).ceil() as usize;
            bins.map(move |i| (i, [edge(i).max(from), edge(i + 1).min(to)]))
        };
        let mut bins = Vec::new();
        for (j, [low, high]) in parts([y - radius, y + radius], grid.rows) {
            let first = bins.len();
            let height = (high - low) / CHORDS as f64;
            for chord in 0..CHORDS {
                let at = low + (chord as f64 + 0.5) * height - y;
                let half = across / radius * (radius * radius - at * at).max(0.0).sqrt();
                for (i, [left, right]) in parts([x - half, x + half], grid.columns) {
                    let (bin, area) = (j * grid.columns + i, (right - left).max(0.0) * height);
                    match bins[first..].iter_mut().find(|(known, _)| *known == bin) {
                        Some((_, sum)) => *sum += area,
                        None => bins.push((bin, area)),
                    }
                }
            }
        }
        for (bin, area) in &mut bins {
            *area *= counted.map_or(1.0, |parts| parts[*bin]);
        }
        let whole: f64 = bins.iter().map(|(_, area)| area).sum();
        if whole <= 0.0 {
            return Self::at(grid, counted, [x, y]);
        }
        Self::Spot(bins.into_iter().map(|(bin, area)| (bin, area / whole)).collect())
    }

    /// Value in `map`.
    pub fn of(&self, map: &[f64]) -> f64 {
        self.sum(|bin, weight| weight * map[bin])
    }

    /// Σ c² / Σ c over the weights c of the bins that are read: the share of one bin's noise.
    pub fn concentration(&self) -> f64 {
        self.sum(|_, weight| weight * weight) / self.sum(|_, weight| weight)
    }

    fn sum(&self, of: impl Fn(usize, f64) -> f64) -> f64 {
        match self {
            Self::Between { bins, weights } => {
                bins.iter().zip(weights).map(|(bin, weight)| of(*bin, *weight)).sum()
            }
            Self::Spot(bins) => bins.iter().map(|(bin, weight)| of(*bin, *weight)).sum(),
        }
    }
}
