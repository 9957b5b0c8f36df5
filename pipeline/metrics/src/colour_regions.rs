// SPDX-License-Identifier: MIT OR Apache-2.0
//! Parts of the cell and of the upper half-space between which colours are compared.
//!
//! Bins are many and each holds few paths; parts are no larger than what an observer tells apart: a
//! twelfth of the pitch, and the 10° by quarters of the azimuth at which IES LM-79 measures the
//! spatial uniformity of chromaticity, where the intensity exceeds a tenth of its peak.

use super::far_field::AngularBins;
use super::illuminance::Grid;
use super::layout::Layout;
use super::uniformity_forms::{PHASES, cell_on};

/// Width of a ring of directions, degrees.
const RING_DEG: f64 = 10.0;
/// Parts of the azimuth, of which the first begins 45° before 0.
const QUARTERS: usize = 4;
/// Smallest intensity, over the largest, of directions that count.
const MIN_INTENSITY: f64 = 0.1;

/// Bins put together.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Part of each bin; `None` of bins that belong to none.
    of_bin: Vec<Option<usize>>,
    count: usize,
}

impl Parts {
    /// Sum of the `bins` in each part.
    pub fn sums(&self, bins: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.count];
        for (part, value) in self.of_bin.iter().zip(bins) {
            if let Some(part) = part {
                sums[*part] += value;
            }
        }
        sums
    }

    /// Parts of the cell of `layout`, each a twelfth of the pitch wide or, where that is more, a bin;
    /// `None` where it is not two bins of `grid` wide.
    pub fn of_cell(grid: Grid, layout: &Layout) -> Option<Self> {
        let [low, high] = cell_on(grid, layout)?;
        let counts = [0, 1].map(|k| {
            let width = high[k] - low[k];
            let wanted = (PHASES as f64 * width / layout.pitch_mm).round();
            wanted.min((width / grid.bin_mm).floor()).max(1.0) as usize
        });
        let place = |at: f64, k: usize| {
            let share = (at - low[k]) / (high[k] - low[k]);
            // Bins on the edge of the cell lie in it.
            let is_inside = (-1e-9..=1.0 + 1e-9).contains(&share);
            let part = (share * counts[k] as f64).max(0.0) as usize;
            is_inside.then_some(part.min(counts[k] - 1))
        };
        let of_bin = (0..grid.columns * grid.rows).map(|bin| {
            let [x, y] = grid.middle_mm(bin);
            Some(place(y, 1)? * counts[0] + place(x, 0)?)
        });
        Some(Self { of_bin: of_bin.collect(), count: counts[0] * counts[1] })
    }
}

/// Parts of the upper half-space: 10° of polar angle by a quarter of the azimuth, of which the first
/// ring is whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    /// The parts.
    pub parts: Parts,
    /// Solid angles, sr.
    sr: Vec<f64>,
}

impl Directions {
    /// Parts of the bins of `sphere`.
    pub fn new(sphere: AngularBins) -> Self {
        let key = |bin: usize| {
            let theta = sphere.centre_deg(bin / sphere.azimuths);
            let ring = (theta / RING_DEG) as usize;
            let phi = (bin % sphere.azimuths) as f64 + 0.5;
            let quarter = (phi / sphere.azimuths as f64 + 0.125).fract() * QUARTERS as f64;
            let quarter = if ring == 0 { 0 } else { quarter as usize };
            (theta < 90.0).then_some([ring, quarter])
        };
        let bins = 0..sphere.polar * sphere.azimuths;
        let mut keys: Vec<[usize; 2]> = bins.clone().filter_map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        let of_bin = bins.clone().map(|bin| keys.binary_search(&key(bin)?).ok()).collect();
        let parts = Parts { of_bin, count: keys.len() };
        let of_one = |bin: usize| sphere.ring_sr(bin / sphere.azimuths) / sphere.azimuths as f64;
        let sr = parts.sums(&bins.map(of_one).collect::<Vec<_>>());
        Self { parts, sr }
    }

    /// True of the parts whose intensity, from their luminous `fluxes`, exceeds a tenth of the
    /// largest.
    pub fn are_bright(&self, fluxes: &[f64]) -> Vec<bool> {
        let intensities: Vec<f64> = fluxes.iter().zip(&self.sr).map(|(f, sr)| f / sr).collect();
        let peak = intensities.iter().copied().fold(0.0, f64::max);
        intensities.iter().map(|i| *i > 0.0 && *i >= MIN_INTENSITY * peak).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::far_field::BinPlacement;

    #[test]
    fn every_bin_of_the_cell_lies_in_one_part() {
        let axes = (0..6).map(|k| [f64::from(k % 3) * 6.0 - 6.0, f64::from(k / 3) * 6.0 - 3.0]);
        let layout = Layout::of_places(axes.collect());
        for (bin_mm, counts) in [(0.1, [24, 12]), (0.5, [24, 12]), (1.0, [12, 6])] {
            let bins = (20.0 / bin_mm) as usize;
            let grid = Grid { columns: bins, rows: bins, bin_mm };
            let parts = Parts::of_cell(grid, &layout).expect("a cell");
            assert_eq!(parts.count, counts[0] * counts[1], "{bin_mm}");
            let sums = parts.sums(&vec![bin_mm * bin_mm; bins * bins]);
            assert!(sums.iter().all(|area| *area > 0.0), "{bin_mm}: {sums:?}");
            let area: f64 = sums.iter().sum();
            assert!((area - 72.0).abs() < 12.0 * 18.0 * bin_mm / 6.0, "{bin_mm}: {area}");
        }
    }

    #[test]
    fn directions_fill_the_upper_half_space() {
        for (bin_deg, azimuths, count) in [(1.0, 36, 33), (5.0, 8, 33), (10.0, 1, 9), (15.0, 4, 21)]
        {
            let polar = (180.0 / bin_deg) as usize;
            let sphere = AngularBins { bin_deg, polar, azimuths, bins: BinPlacement::Between };
            let directions = Directions::new(sphere);
            let whole: f64 = directions.sr.iter().sum();
            assert_eq!(directions.parts.count, count, "{bin_deg}");
            assert!((whole - TAU).abs() < 1e-9, "{bin_deg}: {whole}");
            // Even light is bright everywhere; in one part alone it is bright there.
            assert!(directions.are_bright(&directions.sr).iter().all(|bright| *bright));
            let mut one = vec![0.0; count];
            one[1] = 1.0;
            let bright = directions.are_bright(&one);
            assert!(bright[1] && bright.iter().filter(|b| **b).count() == 1);
        }
    }
}
