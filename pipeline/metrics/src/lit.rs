// SPDX-License-Identifier: MIT OR Apache-2.0
//! The part of each bin of a map that can be lit: walls leave a bin that they cut less than its area,
//! by which its light is divided.

use super::illuminance::{Grid, coarser};

/// The parts of the bins of a map that can be lit.
#[derive(Debug, Clone, PartialEq)]
pub struct LitBins {
    /// Share of the area of each bin that can be lit, 0 to 1.
    pub parts: Vec<f64>,
    /// The share that figures count: 0 of bins that they leave out.
    pub counted: Vec<f64>,
}

impl LitBins {
    /// The same of bins of `together` × `together` bins of `grid`.
    #[must_use]
    pub fn coarser(&self, grid: Grid, together: usize) -> Self {
        let [parts, counted] =
            [&self.parts, &self.counted].map(|shares| coarser(shares, grid, together).0);
        Self { parts, counted }
    }

    /// The mean of `map` over the lit parts of blocks of `together` × `together` bins of `grid`.
    pub fn coarser_map(&self, map: &[f64], grid: Grid, together: usize) -> Vec<f64> {
        let light: Vec<f64> = map.iter().zip(&self.parts).map(|(e, part)| e * part).collect();
        let light = coarser(&light, grid, together).0;
        let parts = coarser(&self.parts, grid, together).0;
        let mean = |(light, part)| if part > 0.0 { light / part } else { 0.0 };
        light.into_iter().zip(parts).map(mean).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wider_bins_have_the_mean_of_their_lit_parts() {
        let grid = Grid { columns: 4, rows: 2, bin_mm: 1.0 };
        // A wall cuts the last column but one in half, and no light reaches the last.
        let parts: Vec<f64> = [1.0, 1.0, 0.5, 0.0].repeat(2);
        let lit = LitBins { counted: parts.clone(), parts };
        let even = [3.0, 3.0, 3.0, 0.0].repeat(2);
        assert_eq!(lit.coarser_map(&even, grid, 2), [3.0, 3.0]);
        assert_eq!(lit.coarser(grid, 2).parts, [1.0, 0.25]);
    }
}
