// SPDX-License-Identifier: MIT OR Apache-2.0
//! A grey ramp: columns of zones at rising drives, and how far what the panel shows lies from white.

use metrics::{Estimate, colour_difference};

use super::{FullDrive, MAX_CELLS, between};
use crate::Array;
use crate::colour_estimates::{coordinates, estimate, grouped};
use crate::estimates::{add, biased};
use crate::pattern_colours::worst;
use crate::reference::Beyond;
use crate::responses::ChannelLight;

impl Array<'_> {
    /// The largest Δu'v' from white in a grey ramp: up to 12 equal steps of columns of zones at drives that
    /// rise from left to right to 1, each of which shows as much of white; `None` of a single column.
    pub fn grey_ramp(&self, full: &FullDrive) -> Option<Estimate> {
        let [across, along] = self.zones;
        let steps = across.min(MAX_CELLS);
        let step = |column: usize| column * steps / across;
        let shares: Vec<f64> = (1..=steps).map(|k| k as f64 / steps as f64).collect();
        let drives = (0..across * along).map(|zone| shares[step(zone % across)]).collect();
        let drives = vec![drives; full.channel_levels.len()];
        let columns = self.means_of_parts([across, 1], &drives);
        let mean = |at: usize| {
            let own: Vec<_> = (0..across).filter(|column| step(*column) == at).collect();
            let of = |part: usize, reading: usize| {
                let sum: f64 = own.iter().map(|column| columns[*column][part][reading]).sum();
                sum / own.len() as f64
            };
            let readings = |part: usize| full.readings().map(|r| of(part, r)).collect();
            (0..self.parts.len()).map(readings).collect()
        };
        let ramp: Vec<Vec<Vec<f64>>> = (0..steps).map(mean).collect();
        (steps > 1).then(|| full.of_ramp(&ramp, &shares)).flatten()
    }
}

impl FullDrive {
    /// The largest Δu'v' from white of cells of these parts of the light, which show these shares of it.
    pub(super) fn of_ramp(&self, cells: &[Vec<Vec<f64>>], shares: &[f64]) -> Option<Estimate> {
        let (panel, white) = (self.panel(), self.white());
        let light = |cell: usize, reading: usize| -> Vec<f64> {
            cells[cell].iter().map(|readings| readings[reading]).collect()
        };
        let shown = |share: f64, reading: usize, light: &[f64]| {
            if let Some(panel) = &panel {
                return panel.before(light).show(white[reading].map(|value| share * value));
            }
            let mut sum = [0.0; 3];
            self.parts.iter().zip(light).for_each(|(part, light)| add(&mut sum, part.xyz, *light));
            sum
        };
        let points = |reading: usize| -> Vec<[f64; 3]> {
            let cells = shares.iter().enumerate();
            let cells = cells.map(|(cell, share)| shown(*share, reading, &light(cell, reading)));
            cells.chain([white[reading]]).collect()
        };
        let readings = self.readings().map(points).collect();
        let largest = colour_difference::from_last(&grouped(readings), colour_difference::IN_UV)?;
        let bound = |(cell, share): (usize, &f64)| {
            let light = light(cell, self.last());
            let shown = |light: &[f64]| shown(*share, self.last(), light);
            self.bias_by_noise(&light, &cells[cell], &shown) + self.bias_by_beyond(&light, &shown)
        };
        let of_cells = shares.iter().enumerate().map(bound).fold(0.0, f64::max);
        let of_white = [2, 3].map(|k| self.moved(|white| coordinates(white)[k]));
        Some(biased(largest, of_white[0].hypot(of_white[1]) + of_cells))
    }

    /// Bound of the Δu'v' that noise makes where `shown` clips: in each lot half the second difference over
    /// two standard errors, as of bins of a pattern.
    fn bias_by_noise(
        &self,
        light: &[f64],
        readings: &[Vec<f64>],
        shown: &dyn Fn(&[f64]) -> [f64; 3],
    ) -> f64 {
        let as_it_is = shown(light);
        let of_lot = |lot: usize| {
            let own = || self.parts.iter().zip(readings).filter(|(part, _)| part.lot == lot);
            let sums: Vec<f64> = self
                .readings()
                .map(|reading| own().map(|(part, of)| part.weight() * of[reading]).sum())
                .collect();
            let sum = estimate(&sums, |sum| *sum);
            if sum.value <= 0.0 {
                return 0.0;
            }
            let step = (2.0 * sum.standard_error / sum.value).min(1.0);
            let ends = [1.0 - step, 1.0 + step].map(|factor| {
                let scaled = self.parts.iter().zip(light);
                let scaled = scaled.map(|(part, l)| if part.lot == lot { factor * l } else { *l });
                shown(&scaled.collect::<Vec<f64>>())
            });
            let mean = [0, 1, 2].map(|k| 0.5 * (ends[0][k] + ends[1][k]));
            between(coordinates(mean), coordinates(as_it_is))
        };
        (0..self.lots()).map(of_lot).sum()
    }

    /// Bound of the Δu'v' that more or less light from beyond makes, of all lots together or of each.
    fn bias_by_beyond(&self, light: &[f64], shown: &dyn Fn(&[f64]) -> [f64; 3]) -> f64 {
        let as_it_is = coordinates(shown(light));
        let off = |lot: usize| self.beyond[lot].as_ref().map_or(0.0, Beyond::bound);
        let change = |times: f64, changed: Option<usize>| {
            let of = |((part, l), means): ((&ChannelLight, &f64), &Vec<f64>)| {
                let is_changed = changed.is_none_or(|lot| lot == part.lot);
                let more =
                    if is_changed { times * off(part.lot) * means[self.last()] } else { 0.0 };
                (l + more).max(0.0)
            };
            let light: Vec<f64> = self.parts.iter().zip(light).zip(&self.means).map(of).collect();
            between(coordinates(shown(&light)), as_it_is)
        };
        let lots = std::iter::once(None).chain((0..self.lots()).map(Some));
        let changes: Vec<f64> =
            lots.flat_map(|lot| [1.0, -1.0].map(|times| change(times, lot))).collect();
        worst(&changes)
    }
}
