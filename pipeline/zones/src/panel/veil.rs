// SPDX-License-Identifier: MIT OR Apache-2.0
//! What of a halo the glare of the eye itself hides.

use metrics::glare::{Glare, Viewing};
use metrics::{Estimate, JackknifedFigure};

use super::{PanelBeforeZones, Role, light_of};
use crate::estimates::biased;
use crate::panel_colour::Account;
use crate::superposition::{Piece, RowOfGroups, rows_of_parts};

impl PanelBeforeZones<'_> {
    /// The share of the halo that lies below the veil of the eye which looks at what is wanted of this
    /// `luminance` ([`metrics::glare`]); `None` without black beside bright, or without a halo. Light is
    /// that of [`Self::show`].
    pub(in super::super) fn hidden(
        &self,
        pieces: &[Vec<Piece>],
        white: &[f64],
        luminance: &[f64],
        viewing: Viewing,
    ) -> Option<Estimate> {
        let (bins, groups) = (self.frame.bins, white.len() - 1);
        let Viewing { distance_mm, observer } = viewing;
        // Without the halo, which is what may be hidden.
        let wanted = |(bin, shown): (usize, &f64)| shown.min(self.wanted_y((bin, groups), white));
        let wanted: Vec<f64> = luminance.iter().enumerate().map(wanted).collect();
        let glare = Glare::new(&wanted, bins, self.frame.bin_mm, distance_mm, observer);
        let veil = glare.veils(|bin| self.roles[bin] == Role::Black);
        // Sums of the halo and of what of it lies below the veil, by readings.
        let read = |y: usize, rows: &[RowOfGroups]| {
            let totals: Vec<Vec<f64>> = rows.iter().map(RowOfGroups::total).collect();
            let mut sums = vec![[0.0; 2]; groups + 3];
            let mut light = vec![0.0; rows.len()];
            for x in (0..bins[0]).filter(|x| self.roles[y * bins[0] + x] == Role::Black) {
                let bin = y * bins[0] + x;
                for (number, sum) in sums.iter_mut().enumerate() {
                    let reading = number.min(groups);
                    light_of(rows, &totals, (x, reading), &mut light);
                    // The last two have more light before less veil, and less before more.
                    let more = [0.0, 1.0, -1.0][number - reading];
                    let light = self.with_beyond(&light, more, None);
                    let veil = veil[bin] * (1.0 - more * self.beyond.of_white);
                    let at = (bin, reading);
                    let halo = self.shown(at, &light, white[reading], &mut Account::default())[1];
                    sum[0] += halo.max(0.0);
                    sum[1] += halo.max(0.0).min(veil);
                }
            }
            sums
        };
        let mut sums = vec![[0.0; 2]; groups + 3];
        for row in rows_of_parts(bins, groups, pieces, read) {
            sums.iter_mut().zip(row).for_each(|(sum, row)| *sum = [0, 1].map(|k| sum[k] + row[k]));
        }
        let mut shares: Vec<f64> = sums.iter().map(|[halo, below]| below / halo).collect();
        let ends = shares.split_off(groups + 1);
        let share = shares.pop().filter(|share| share.is_finite())?;
        // Of no light at all nothing is hidden, or all.
        let off = |end: &f64| if end.is_nan() { 1.0 } else { (end - share).abs() };
        let estimate = JackknifedFigure::new(share, shares).estimate();
        Some(biased(estimate, ends.iter().map(off).fold(0.0, f64::max)))
    }
}
