// SPDX-License-Identifier: MIT OR Apache-2.0
//! The panel before all channels at full drive: its white, its primaries, the levels of channels.
//!
//! All channels shine at 1, or at the levels that give a stated white with the most light; the
//! largest of these is 1. White is that of the mean over the panel.
//!
//! In a traced array that stands for a larger one a share ε of the light of a channel falls elsewhere, as a
//! mean over the panel. A figure of white then is off by no more than the sum of what (1 + ε) of each
//! channel alone makes of it, to first order. Light that is converted changes its colour on its way: X, Y
//! and Z of a channel have an ε each, and move one by one.

mod grey_ramp;

use anyhow::{Result, ensure};
use serde_json::json;

use arrays::cache::Cache;
use design::resolved::panel::Panel;
use metrics::colour_difference::{self, IN_ITP};
use metrics::gamut::{self, Matrix, Primaries, STANDARDS, apply, inverse};
use metrics::transfer::Transfer;
use metrics::{Estimate, chromaticity, itp};
use runtime::run_context::RunContext;

use super::colour_estimates::{
    ColourEstimate, GamutEstimate, all_stated, coordinates, estimate, grouped,
};
use super::estimates::{add, biased};
use super::needs::Needs;
use super::panel_colour::SubPixels;
use super::picture::{Law, PictureLight, PictureOnPanel, outside};
use super::reference::{Beyond, LightOff};
use super::responses::ChannelLight;
use super::{Array, BeyondLight, ZonedDesign};

/// Most cells of the panel along an axis between which whites are compared.
const MAX_CELLS: usize = 12;
/// Most that the light of a channel changes beside the others on its way to the panel.
const MOST_LOST: f64 = 4.0;

/// What each sub-pixel passes closed, over open; `None` without sub-pixels.
type Closed = Option<[f64; 3]>;

/// The panel before all channels at full drive.
pub struct FullDrive {
    /// Readings of the mean of each part of the light over each cell of the panel.
    cells: Vec<Vec<Vec<f64>>>,
    /// The same over the panel.
    means: Vec<Vec<f64>>,
    /// Parts of the light at the levels of their channels.
    parts: Vec<ChannelLight>,
    /// Levels of the channels, of which the largest is 1.
    pub channel_levels: Vec<f64>,
    closed: Closed,
    factor: f64,
    /// Light of each lot beyond the traced array.
    pub(super) beyond: Vec<Option<Beyond>>,
    /// Share of the light of each lot, as a mean over the panel, that each cell may lack or have too much.
    off_by_cell: Vec<Vec<f64>>,
}

/// Levels of channels, as they are asked for.
#[derive(Debug, Clone, Copy)]
pub struct Channels<'a> {
    /// Their names.
    pub names: &'a [&'a str],
    /// x and y of the white that they give; all at 1 without.
    pub white: Option<[f64; 2]>,
}

impl Channels<'_> {
    /// Refuses a white of other than three channels.
    ///
    /// # Errors
    /// This.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.white.is_none() || self.names.len() == 3,
            "--white: expected a design with three channels, got {}: {}",
            self.names.len(),
            self.names.join(", ")
        );
        Ok(())
    }
}

impl ZonedDesign<'_> {
    /// The panel before channels whose light comes as it is emitted.
    ///
    /// # Errors
    /// A white that they do not give.
    pub fn emitted_drive(&self, contrast: f64, channels: Channels) -> Result<FullDrive> {
        let parts = self.parts.clone().unwrap_or_else(ChannelLight::whole);
        let drive = FullDrive {
            cells: Vec::new(),
            means: vec![vec![1.0; 3]; parts.len()],
            channel_levels: vec![1.0; channels.names.len()],
            beyond: vec![None; lots(&parts)],
            parts,
            closed: closed(self.design.panel.as_ref(), contrast),
            factor: 1.0,
            off_by_cell: Vec::new(),
        };
        drive.of_white(channels)
    }
}

/// Δu'v' of two colours by their x, y, u' and v'.
fn between(a: [f64; 4], b: [f64; 4]) -> f64 {
    (a[2] - b[2]).hypot(a[3] - b[3])
}

/// Number of lots of light.
fn lots(parts: &[ChannelLight]) -> usize {
    parts.iter().map(|part| part.lot + 1).max().unwrap_or(0)
}

fn closed(panel: Option<&Panel>, contrast: f64) -> Closed {
    panel?.closed(contrast)
}

impl Array<'_> {
    /// Means over the panel at full drive, from the cache or computed.
    ///
    /// # Errors
    /// A white that the channels do not give; a cache that cannot be written.
    pub fn full_drive_of(
        &self,
        (panel, contrast): (Option<&Panel>, f64),
        channels: Channels,
        (cache, context): (&Cache, RunContext),
    ) -> Result<FullDrive> {
        let of = json!({"means of": self.parts.len(), "cells of panel": MAX_CELLS});
        let count = channels.names.len();
        let weights: Vec<f64> = self.parts.iter().map(ChannelLight::weight).collect();
        let of_lots = json!({"beyond of": lots(&self.parts), "luminous": weights});
        let beyond: Vec<Option<Beyond>> = self.kept(&of_lots, cache, context, || {
            (0..lots(&self.parts)).map(|lot| self.beyond(Some(lot))).collect()
        })?;
        let bins = self.frame.bins.map(|bins| bins.min(MAX_CELLS));
        let cells: Vec<Vec<Vec<f64>>> =
            self.kept(&of, cache, context, || self.means_of_parts(bins, &self.full_drive()))?;
        // Cells are equal.
        let mut means = vec![vec![0.0; cells[0][0].len()]; self.parts.len()];
        for cell in &cells {
            let sums = means.iter_mut().flatten().zip(cell.iter().flatten());
            sums.for_each(|(sum, value)| *sum += value / cells.len() as f64);
        }
        let off = |of: &Option<Beyond>| self.light_off_by_cell(of.as_ref(), bins);
        let drive = FullDrive {
            off_by_cell: beyond.iter().map(off).collect(),
            cells,
            means,
            parts: self.parts.clone(),
            channel_levels: vec![1.0; count],
            closed: closed(panel, contrast),
            factor: self.receiver.factor(),
            beyond,
        };
        drive.of_white(channels)
    }

    /// The same array with channels at the levels of `full`.
    #[must_use]
    pub fn driven_by(self, full: &FullDrive) -> Self {
        Self { parts: full.parts.clone(), ..self }
    }
}

/// Making of a drive, and light of its channels.
impl FullDrive {
    /// The same at the levels of these channels.
    fn of_white(self, Channels { names, white }: Channels) -> Result<Self> {
        Channels { names, white }.check()?;
        let Some(white) = white else { return Ok(self) };
        let channel_levels = self.levels_of(white, names)?;
        let mut parts = self.parts;
        for part in &mut parts {
            let all = std::iter::once(&mut part.xyz).chain(&mut part.behind);
            all.flatten().for_each(|value| *value *= channel_levels[part.channel]);
        }
        Ok(Self { parts, channel_levels, ..self })
    }

    /// The levels of channels, named so, that give `white` (x, y) with the most light.
    ///
    /// # Errors
    /// Channels of colours on one line, a white outside their gamut.
    fn levels_of(&self, white: [f64; 2], names: &[&str]) -> Result<Vec<f64>> {
        let [x, y] = white;
        self.check_visible("--white", names)?;
        let columns = [0, 1, 2].map(|channel| self.channel(channel, self.last()));
        let rows: Matrix = [0, 1, 2].map(|k| columns.map(|column| column[k]));
        let Some(inverse) = inverse(&rows) else {
            anyhow::bail!("--white: expected channels of three colours, got some on one line");
        };
        let levels = apply(&inverse, chromaticity::xyz_of_xy(white));
        let largest = levels.into_iter().fold(0.0, f64::max);
        let limits: Vec<String> = (0..3)
            .filter(|c| levels[*c] < -1e-9 * largest)
            .map(|c| {
                let [x, y] = chromaticity::xy(columns[c]).unwrap_or_default();
                format!("{} ({x:.4}, {y:.4})", names[c])
            })
            .collect();
        ensure!(
            limits.is_empty() && largest > 0.0,
            "--white: expected a white within the gamut of the channels, got {x:.4},{y:.4}, beyond the one of {}, which would have to be negative",
            limits.join(" and ")
        );
        Ok(levels.map(|level| level.max(0.0) / largest).to_vec())
    }

    /// Refuses `option` before a channel without visible light.
    fn check_visible(&self, option: &str, names: &[&str]) -> Result<()> {
        let dark = (0..names.len()).find(|channel| self.channel(*channel, self.last())[1] <= 0.0);
        let dark = dark.map(|channel| names[channel]);
        ensure!(
            dark.is_none(),
            "{option}: expected visible light of each channel, got none of {:?}",
            dark.unwrap_or_default()
        );
        Ok(())
    }

    /// Refuses primaries that white lies outside of, however the light of each channel changes beside
    /// the others on its way, by up to a factor of `MOST_LOST`.
    ///
    /// # Errors
    /// These.
    pub fn check_emitted_white(&self, primaries: &Primaries) -> Result<()> {
        let to_rgb = inverse(&primaries.to_xyz(gamut::D65)).unwrap_or_default();
        let mut most = [0.0; 3];
        for part in &self.parts {
            let light = apply(&to_rgb, self.xyz_of(part));
            let factor =
                |value: f64| if value > 0.0 { MOST_LOST.sqrt() } else { MOST_LOST.sqrt().recip() };
            (0..3).for_each(|k| most[k] += factor(light[k]) * light[k]);
        }
        if most.iter().any(|light| *light <= 0.0) {
            return Err(outside(primaries, self.white_xy()));
        }
        Ok(())
    }

    fn last(&self) -> usize {
        self.means[0].len() - 1
    }

    fn readings(&self) -> std::ops::Range<usize> {
        0..self.means[0].len()
    }

    fn lots(&self) -> usize {
        self.beyond.len()
    }

    /// The channel of a lot.
    pub(super) fn channel_of(&self, lot: usize) -> usize {
        self.parts.iter().find(|part| part.lot == lot).map_or(0, |part| part.channel)
    }

    /// X, Y and Z of one lot, as a mean over the panel.
    fn of_lot(&self, lot: usize) -> [f64; 3] {
        self.open(&self.means, self.last(), |part| part.lot == lot)
    }

    /// X, Y and Z of light of 1 of a part on the open panel, or in the open without sub-pixels.
    fn xyz_of(&self, part: &ChannelLight) -> [f64; 3] {
        let open = if self.closed.is_some() { &part.behind[..] } else { &[part.xyz] };
        let mut sum = [0.0; 3];
        for xyz in open {
            add(&mut sum, *xyz, 1.0);
        }
        sum
    }

    /// The same of light of these means, of the parts that are `lit`.
    fn open(
        &self,
        means: &[Vec<f64>],
        reading: usize,
        lit: impl Fn(&ChannelLight) -> bool,
    ) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (part, means) in self.parts.iter().zip(means).filter(|(part, _)| lit(part)) {
            add(&mut sum, self.xyz_of(part), means[reading]);
        }
        sum
    }

    /// The same of one channel, as a mean over the panel.
    fn channel(&self, channel: usize, reading: usize) -> [f64; 3] {
        self.open(&self.means, reading, |part| part.channel == channel)
    }

    /// Readings of X, Y and Z of white, in the numbers of the responses.
    fn white(&self) -> Vec<[f64; 3]> {
        self.readings().map(|reading| self.open(&self.means, reading, |_| true)).collect()
    }

    /// x and y of white.
    pub fn white_xy(&self) -> [f64; 2] {
        self.white().last().and_then(|white| chromaticity::xy(*white)).unwrap_or_default()
    }

    /// Means of the parts of the light over the panel, with more of one lot.
    fn light(&self, reading: usize, more_of: Option<usize>) -> Vec<f64> {
        let of = |(part, means): (&ChannelLight, &Vec<f64>)| match more_of {
            Some(lot) if lot == part.lot => (1.0 + self.bound_of_mean(lot)) * means[reading],
            _ => means[reading],
        };
        self.parts.iter().zip(&self.means).map(of).collect()
    }

    /// Share of the light of a lot that the mean over the panel may lack or have too much at full drive.
    fn bound_of_mean(&self, lot: usize) -> f64 {
        self.beyond[lot].as_ref().map_or(0.0, Beyond::bound_of_mean)
    }

    /// Light that places may lack or have too much where it is this share of each lot's.
    pub(super) fn beyond_light(&self, shares: &[LightOff]) -> BeyondLight {
        let of = |(part, means): (&ChannelLight, &Vec<f64>)| {
            shares[part.lot].clone().times(means[self.last()])
        };
        let white = self.open(&self.means, self.last(), |_| true)[1];
        BeyondLight {
            parts: self.parts.iter().zip(&self.means).map(of).collect(),
            of_white: self.moved(|white| white[1]) / white,
        }
    }

    /// How far light from beyond may move a figure of white: the sum of what it does in each lot.
    fn moved(&self, figure: impl Fn([f64; 3]) -> f64) -> f64 {
        self.moved_from(self.open(&self.means, self.last(), |_| true), 0..self.lots(), figure)
    }

    /// The same of `light` that these lots are part of.
    fn moved_from(
        &self,
        light: [f64; 3],
        lots: impl Iterator<Item = usize>,
        figure: impl Fn([f64; 3]) -> f64,
    ) -> f64 {
        let of_lot = |lot: usize| {
            let mut more = light;
            add(&mut more, self.of_lot(lot), self.bound_of_mean(lot));
            (figure(more) - figure(light)).abs()
        };
        lots.map(of_lot).sum()
    }

    /// How far light that a cell may lack or have too much may move its white, Δu'v'.
    fn moved_in(&self, cell: usize) -> f64 {
        let white = self.open(&self.cells[cell], self.last(), |_| true);
        let of_lot = |lot: usize| {
            let mut more = white;
            add(&mut more, self.of_lot(lot), self.off_by_cell[lot][cell]);
            between(coordinates(more), coordinates(white))
        };
        (0..self.lots()).map(of_lot).sum()
    }

    /// The panel before parts of the light; `None` without sub-pixels.
    pub fn panel(&self) -> Option<SubPixels> {
        let open = self.parts.iter().map(|part| [0, 1, 2].map(|s| part.behind[s]));
        self.closed.map(|closed| SubPixels::of_open(&open.collect::<Vec<Matrix>>(), closed))
    }

    /// The picture before this panel; `None` without sub-pixels. `transfer` says whether it is of
    /// absolute luminance.
    pub fn show<'a>(
        &self,
        picture: &'a PictureLight,
        transfer: Transfer,
    ) -> Option<PictureOnPanel<'a>> {
        let white = self.white();
        let moved = [2, 3].map(|k| self.moved(|white| coordinates(white)[k]));
        let absolute = transfer.peak_cd_m2().map(|_| 1.0 / self.factor);
        Some(PictureOnPanel {
            picture,
            sub_pixels: self.panel()?,
            scale: white.iter().map(|white| absolute.unwrap_or(white[1])).collect(),
            white_moves_uv: moved[0].hypot(moved[1]),
            white,
        })
    }

    /// Drives of channels, named so, that pixels of a picture of this law need.
    ///
    /// # Errors
    /// Channels of colours on one line.
    pub fn needs(&self, (primaries, transfer): Law, names: &[&str]) -> Result<Needs> {
        // Pictures of absolute luminance are in cd/m².
        let white_y = self.white()[self.last()][1];
        let y = if transfer.peak_cd_m2().is_some() { 1.0 / self.factor } else { white_y };
        let by_channel = names.len() == 3 && self.closed.is_some();
        if by_channel {
            self.check_visible("--levels", names)?;
        }
        let rows = if by_channel {
            let columns = [0, 1, 2].map(|channel| self.channel(channel, self.last()));
            [0, 1, 2].map(|k| columns.map(|column| column[k] / y))
        } else if let Some(primaries) = primaries {
            primaries.to_xyz(self.white_xy()).map(|row| row.map(|value| value * white_y / y))
        } else {
            // Grey is a share of white.
            return Ok(Needs { matrix: [[0.0, y / white_y, 0.0]; 3], by_channel });
        };
        let Some(matrix) = inverse(&rows) else {
            anyhow::bail!("--levels: expected channels of three colours, got some on one line");
        };
        Ok(Needs { matrix, by_channel })
    }
}

/// Figures with errors.
impl FullDrive {
    /// Colour of white behind the panel.
    pub fn white_figures(&self) -> ColourEstimate {
        let found = ColourEstimate::new(&self.white(), self.factor);
        let of_place = [0, 1, 2, 3].map(|k| self.moved(|white| coordinates(white)[k]));
        let of_temperature = [2, 3].map(|k| self.moved(|white| chromaticity::figures(white)[k]));
        let of_luminance = self.factor * self.moved(|white| white[1]);
        found.biased(of_place, of_temperature, of_luminance)
    }

    /// Colour of a channel alone on the open panel.
    pub fn channel_figures(&self, channel: usize) -> ColourEstimate {
        let readings: Vec<_> =
            self.readings().map(|reading| self.channel(channel, reading)).collect();
        let found = ColourEstimate::new(&readings, self.factor);
        let lots: Vec<usize> =
            (0..self.lots()).filter(|lot| self.channel_of(*lot) == channel).collect();
        let light = self.channel(channel, self.last());
        let moved =
            |figure: &dyn Fn([f64; 3]) -> f64| self.moved_from(light, lots.iter().copied(), figure);
        let of_luminance = self.factor * moved(&|xyz| xyz[1]);
        // Light of one lot keeps its colour.
        if lots.len() < 2 {
            return found.biased([0.0; 4], [0.0; 2], of_luminance);
        }
        let of_place = [0, 1, 2, 3].map(|k| moved(&|xyz| coordinates(xyz)[k]));
        let of_temperature = [2, 3].map(|k| moved(&|xyz| chromaticity::figures(xyz)[k]));
        found.biased(of_place, of_temperature, of_luminance)
    }

    /// The largest Δu'v' of white between any two cells of a twelfth of the panel's sides, or of bins
    /// that are larger.
    pub fn white_difference(&self) -> Option<Estimate> {
        let of = |reading: usize| -> Vec<[f64; 3]> {
            self.cells.iter().map(|cell| self.open(cell, reading, |_| true)).collect()
        };
        let found = colour_difference::estimate(&grouped(self.readings().map(of).collect()))?;
        let whites: Vec<_> = of(self.last()).into_iter().map(coordinates).collect();
        let moved: Vec<f64> = (0..whites.len()).map(|cell| self.moved_in(cell)).collect();
        let largest = |with_moved: f64| {
            let pairs = (0..whites.len()).flat_map(|a| (0..a).map(move |b| [a, b]));
            let apart = pairs
                .map(|[a, b]| between(whites[a], whites[b]) + with_moved * (moved[a] + moved[b]));
            apart.fold(0.0, f64::max)
        };
        Some(biased(found, largest(1.0) - largest(0.0)))
    }

    /// ΔE_ITP from black of the black at full drive; `None` without sub-pixels.
    pub fn black_itp(&self) -> Option<Estimate> {
        let panel = self.panel()?;
        let dark = |reading: usize, more_of: Option<usize>| {
            panel.before(&self.light(reading, more_of)).dark.map(|value| self.factor * value)
        };
        let points = self.readings().map(|reading| vec![dark(reading, None), [0.0; 3]]).collect();
        let found = colour_difference::from_last(&grouped(points), IN_ITP)?;
        let black = dark(self.last(), None);
        let more = |lot| itp::difference(dark(self.last(), Some(lot)), black);
        Some(biased(found, (0..self.lots()).map(more).sum()))
    }

    /// Gamut of the primaries as displayed at full drive, against each standard.
    pub fn gamut(&self) -> Vec<GamutEstimate> {
        let Some(panel) = self.panel() else { return Vec::new() };
        let primaries = |reading: usize, more_of: Option<usize>| {
            panel.before(&self.light(reading, more_of)).primaries()
        };
        let dark = [[f64::NAN; 2]; 3];
        let all: Vec<_> =
            self.readings().map(|reading| primaries(reading, None).unwrap_or(dark)).collect();
        let whole = all[all.len() - 1];
        let more = |lot| primaries(self.last(), Some(lot)).unwrap_or(whole);
        let moved: Vec<_> = (0..self.lots()).map(more).collect();
        let of_standard = |standard: &Primaries| {
            let read = |plane: usize, of: fn(&gamut::Shares) -> f64| {
                let read = |xy: &[[f64; 2]; 3]| of(&gamut::shares(*xy, standard)[plane]);
                let off = moved.iter().map(|xy| (read(xy) - read(&whole)).abs());
                biased(estimate(&all, read), off.sum())
            };
            let shares = [0, 1].map(|k| [read(k, |all| all.area), read(k, |all| all.coverage)]);
            GamutEstimate { standard: standard.name, shares }
        };
        let all = STANDARDS.iter().map(of_standard);
        let is_stated = |of: &GamutEstimate| of.shares.iter().all(|s| all_stated(*s).is_some());
        all.filter(is_stated).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 3] = ["red", "green", "infrared"];

    fn of_share(share: f64) -> Beyond {
        let share = Some(Estimate::new(share, 0.0));
        let by_cell = [Vec::new(), Vec::new()];
        Beyond {
            reach: 2,
            share,
            walls: None,
            by_cell,
            walls_of_mean: 0.0,
            error_of_images: 0.0,
            falls: vec![0.0],
        }
    }

    /// Channels of lights at these wavelengths, alike all over the panel in 17 readings, of which
    /// any place may lack these shares.
    fn full(beyond: [f64; 3]) -> FullDrive {
        let nm = [630.0, 530.0, 460.0];
        let part = |channel: usize| {
            let xyz = metrics::colour_matching::xyz(nm[channel]);
            let dark = xyz.map(|value| 0.01 * value);
            let behind = [0, 1, 2].map(|s| if s == channel { xyz } else { dark }).to_vec();
            ChannelLight { channel, lot: channel, xyz, behind }
        };
        let means = vec![vec![1.0; 17]; 3];
        FullDrive {
            cells: vec![means.clone(); 2],
            means,
            parts: [0, 1, 2].map(part).to_vec(),
            channel_levels: vec![1.0; 3],
            closed: Some([1e-3; 3]),
            factor: 2.0,
            beyond: beyond.map(|share| Some(of_share(share))).to_vec(),
            off_by_cell: beyond.map(|share| vec![share; 2]).to_vec(),
        }
    }

    /// White, its largest difference, gamut and black against channels that are changed by hand.
    #[test]
    fn light_beyond_the_array_is_part_of_the_errors_of_white() {
        let exact = full([0.0; 3]);
        for beyond in [[0.1; 3], [0.0, 0.02, 0.1]] {
            let found = full(beyond);
            let white = found.white_figures();
            let luminance = 2.0 * exact.white()[2][1];
            assert!((white.luminance.value - luminance).abs() < 1e-12 * luminance);
            let bound = white.luminance.bias_bound.expect("a bound");
            let expected: f64 = (0..3).map(|c| 2.0 * beyond[c] * exact.channel(c, 2)[1]).sum();
            assert!((bound - expected).abs() < 1e-9 * luminance, "{bound} {expected}");
            for (channel, share) in beyond.into_iter().enumerate() {
                let of = found.channel_figures(channel).luminance;
                let bound = of.bias_bound.unwrap_or_default();
                assert!((bound - share * of.value).abs() < 1e-12 * of.value, "{channel}: {bound}");
            }
            let bounds = white.chromaticity.expect("lit").map(|of| of.bias_bound.expect("a bound"));
            let start = coordinates(exact.white()[2]);
            let mut worst = [0.0f64; 4];
            for changed in 0..8 {
                let mut sum = [0.0; 3];
                for (channel, share) in beyond.into_iter().enumerate() {
                    let is_more = changed >> channel & 1 == 1;
                    let factor = if is_more { 1.0 + share } else { 1.0 };
                    add(&mut sum, exact.channel(channel, 2), factor);
                }
                let now = coordinates(sum);
                (0..4).for_each(|k| worst[k] = worst[k].max((now[k] - start[k]).abs()));
            }
            assert!(
                (0..4).all(|k| worst[k] > 0.0 && worst[k] <= 1.02 * bounds[k]),
                "{worst:?} {bounds:?}"
            );
            let difference = found.white_difference().expect("lit");
            assert!(difference.value.abs() < 1e-12);
            let bound = difference.bias_bound.expect("a bound");
            assert!(bound >= 1.8 * worst[2].hypot(worst[3]));
            // One of the cells has all of its light.
            let mut half = full(beyond);
            half.off_by_cell.iter_mut().for_each(|cells| cells[0] = 0.0);
            let of_half = half.white_difference().and_then(|of| of.bias_bound).expect("a bound");
            assert!((of_half - 0.5 * bound).abs() < 1e-12, "{of_half} {bound}");
            let gamut = found.gamut();
            let mut shares = gamut.iter().flat_map(|of| of.shares.iter().flatten());
            assert!(shares.any(|share| share.bias_bound.is_some()), "no bound");
        }
        assert_eq!(exact.white_figures().luminance.bias_bound, None);
        // One thousandth of white leaks: its own difference from no light.
        let black = exact.black_itp().expect("sub-pixels");
        let leak = exact.white()[2].map(|value| 2e-3 * value);
        assert!((black.value - itp::difference(leak, [0.0; 3])).abs() < 1e-9 * black.value);
    }

    /// Cells of a ramp that have more of one channel than of the others: without sub-pixels they show it,
    /// with them all that is beyond the grey, and a dark channel leaves grey.
    #[test]
    fn a_ramp_is_as_far_from_white_as_its_light() {
        let shares = [0.5, 1.0];
        let cells = |blue: f64| {
            vec![vec![vec![0.5; 17], vec![0.5; 17], vec![blue; 17]], vec![vec![1.0; 17]; 3]]
        };
        let mut open = full([0.0; 3]);
        open.closed = None;
        let of = |blue: f64| open.of_ramp(&cells(blue), &shares).expect("lit").value;
        let white = open.white()[2];
        let light = |blue: f64| {
            let mut sum = white.map(|value| 0.5 * value);
            add(&mut sum, open.parts[2].xyz, blue - 0.5);
            between(coordinates(sum), coordinates(white))
        };
        assert!(light(0.75) > 0.01 && (of(0.75) - light(0.75)).abs() < 1e-12, "{}", of(0.75));
        assert!(of(0.5) < 1e-12, "{}", of(0.5));
        // Sub-pixels close before too much blue, of which the others pass a hundredth, and cannot show what lacks.
        let panel = full([0.0; 3]);
        let of = |blue: f64| panel.of_ramp(&cells(blue), &shares).expect("lit").value;
        assert!(of(0.75) < 1e-3 && of(0.5) < 1e-6 && of(0.25) > 0.01, "{} {}", of(0.75), of(0.25));
        let bounded = full([0.0, 0.0, 0.1]).of_ramp(&cells(0.25), &shares).expect("lit");
        assert!(bounded.bias_bound.is_some_and(|bound| bound > 0.0), "{bounded:?}");
    }

    /// Primaries of a standard, each shown by one channel through one sub-pixel, cover it whole.
    #[test]
    fn a_panel_of_a_standards_primaries_has_its_gamut() {
        for standard in STANDARDS {
            let mut exact = full([0.0; 3]);
            for (part, xy) in exact.parts.iter_mut().zip(standard.xy) {
                part.behind = vec![[0.0; 3]; 3];
                part.behind[part.channel] = chromaticity::xyz_of_xy(xy);
            }
            exact.closed = Some([0.0; 3]);
            let gamut = exact.gamut();
            let own = gamut.iter().find(|of| of.standard == standard.name).expect("listed");
            for share in own.shares.iter().flatten() {
                assert!((share.value - 1.0).abs() < 1e-9, "{}: {share:?}", standard.name);
            }
        }
    }

    #[test]
    fn dark_channels_and_whites_beyond_the_picture_are_named() {
        let mut dark = full([0.0; 3]);
        dark.parts[2].behind = vec![[0.0; 3]; 3];
        for error in [
            dark.levels_of([0.3127, 0.3290], &NAMES).expect_err("dark"),
            dark.needs((Some(gamut::BT709), Transfer::Srgb), &NAMES).expect_err("dark"),
        ] {
            let words = error.to_string();
            assert!(
                words.contains("expected visible light of each channel, got none of \"infrared\"")
            );
        }
        assert!(dark.channel_figures(2).chromaticity.is_none());
        assert!(full([0.0; 3]).channel_figures(2).chromaticity.is_some());
    }

    /// A white of red and green alone lies outside, whatever comes of them; that of three lights may
    /// come to lie within.
    #[test]
    fn whites_that_no_way_brings_within_the_primaries_are_refused() {
        let mut all = full([0.0; 3]);
        all.means[1] = vec![20.0; 17];
        assert!(!gamut::BT709.hold(all.white_xy()));
        assert!(all.check_emitted_white(&gamut::BT709).is_ok());
        let mut two = full([0.0; 3]);
        for part in &mut two.parts {
            part.behind[2] = [0.0; 3];
            if part.channel == 2 {
                part.behind = vec![[0.0; 3]; 3];
            }
        }
        let error = two.check_emitted_white(&gamut::BT709).expect_err("outside").to_string();
        assert!(error.contains("got BT.709"), "{error}");
    }
}
