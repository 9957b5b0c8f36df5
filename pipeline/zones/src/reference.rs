// SPDX-License-Identifier: MIT OR Apache-2.0
//! What responses say whatever the pattern: the backlight at full drive, the spread of one zone's
//! light, and light beyond the traced array. It is kept beside the responses.

use serde::{Deserialize, Serialize};

use metrics::bins::Bins;
use metrics::dimming::{beyond, radius_at};
use metrics::figures::OF_RECEIVER;
use metrics::layout::Layout;
use metrics::{Estimate, Grouped, JackknifedFigure};

use super::Array;
use super::cells::{Cells, inside};
use super::estimates::{biased, figure, readings};
use super::responses::ChannelLight;
use super::superposition::{Block, Piece, RowOfGroups, rows, rows_of_parts};
use super::walls::AtWalls;

/// Bins of the map at full drive times groups, beyond which groups are merged for its extremes.
const MAX_VALUES: usize = 20_000_000;
/// Groups that are left then.
const MERGED: usize = 16;
/// Shares of the largest value whose radii are given.
pub const SHARES: [f64; 3] = [0.5, 0.1, 0.01];

/// Figures that do not depend on the pattern, in the numbers of the responses.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Reference {
    /// Mean of the panel at full drive without each group of paths, then with all.
    pub white: Vec<f64>,
    /// Figures of the registry of the panel at full drive, by key.
    pub uniformity: Vec<(String, Estimate)>,
    /// Groups that the errors of extremes come from.
    pub groups_of_extremes: usize,
    /// Light of one zone.
    pub spread: Spread,
    /// Light beyond the traced array over all light of an inner package; `None` where the whole
    /// array is traced.
    pub beyond: Option<Beyond>,
}

/// Mean over rings about a lit zone.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Spread {
    /// Column and row of the zone.
    pub zone: [usize; 2],
    /// Its middle, mm.
    pub centre_mm: [f64; 2],
    /// Mean distance of the bins of each ring, mm.
    pub distance_mm: Vec<f64>,
    /// Mean of each ring.
    pub rings: Vec<JackknifedFigure>,
    /// Radii at which [`SHARES`] of the largest ring are reached; `None` where the rings do not
    /// tell.
    pub radii_mm: Vec<Option<Estimate>>,
}

/// Light of an inner package that its response does not show where it falls: beyond the traced array,
/// or wrong beside walls that it is moved to.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Beyond {
    /// Packages from the inner one to the walls of the traced array.
    pub reach: usize,
    /// Share of its light beyond; `None` where the light does not fall off towards the walls.
    pub share: Option<Estimate>,
    /// Light that lies wrong beside walls to which packages are moved, over the mean at full drive;
    /// `None` where the traced array is the stated one.
    pub walls: Option<Estimate>,
    /// The most of that in each cell of a pitch from a wall on, across x and across y.
    pub by_cell: [Vec<f64>; 2],
    /// The most of that in the mean over the panel.
    pub walls_of_mean: f64,
    /// The most that lies wrong of light beyond walls, over it.
    pub error_of_images: f64,
    /// Share of its light on the cell of a package so many places away or farther, at most.
    pub falls: Vec<f64>,
}

impl Beyond {
    /// The largest share that both may be at any place: two standard errors above their values, and all
    /// light where it does not fall off.
    pub fn bound(&self) -> f64 {
        let at_corner = self.by_cell.iter().filter_map(|cells| cells.first());
        (self.largest_share() + at_corner.sum::<f64>()).min(1.0)
    }

    /// The same of the mean over the panel: light lies wrong beside walls alone.
    pub fn bound_of_mean(&self) -> f64 {
        (self.largest_share() + self.walls_of_mean).min(1.0)
    }

    fn largest_share(&self) -> f64 {
        self.share.map_or(1.0, |of| of.value.abs() + 2.0 * of.standard_error)
    }
}

/// Light that places of a pattern may lack or have too much.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LightOff {
    /// Anywhere.
    anywhere: f64,
    /// Beside walls: no more than all lit packages together make.
    beside: f64,
    /// Beside walls at the largest drive, in the bins along x and y.
    by_bin: [Vec<f64>; 2],
    /// No more than all light.
    all: f64,
}

impl LightOff {
    /// This share in all of so many bins along x and y.
    pub fn anywhere(share: f64, bins: [usize; 2]) -> Self {
        let by_bin = bins.map(|bins| vec![0.0; bins]);
        Self { anywhere: share, beside: 0.0, by_bin, all: share }
    }

    /// In a bin.
    pub fn at(&self, [i, j]: [usize; 2]) -> f64 {
        let walls = self.by_bin[0][i] + self.by_bin[1][j];
        (self.anywhere + self.beside.min(walls)).min(self.all)
    }

    /// So many times that.
    pub fn times(mut self, factor: f64) -> Self {
        for share in [&mut self.anywhere, &mut self.beside, &mut self.all] {
            *share *= factor;
        }
        self.by_bin.iter_mut().flatten().for_each(|share| *share *= factor);
        self
    }
}

impl Reference {
    /// Puts its figures into a quantity that is `factor` times as large; those at full drive may lack
    /// what is beyond.
    pub(super) fn scale(&mut self, factor: f64) {
        let [of_mean, anywhere] =
            self.beyond.as_ref().map_or([0.0; 2], |of| [of.bound_of_mean(), of.bound()]);
        for (key, estimate) in &mut self.uniformity {
            let (factor, share) = match &key[..] {
                "mean" => (factor, of_mean),
                "min" | "max" => (factor, anywhere),
                // A ratio of two levels has the bias of both.
                _ => (1.0, 2.0 * anywhere),
            };
            *estimate = biased(*estimate, share * estimate.value).times(factor);
        }
        for ring in &mut self.spread.rings {
            let numbers = [&mut ring.value, &mut ring.standard_error].into_iter();
            numbers.chain(&mut ring.without).for_each(|number| *number *= factor);
        }
        self.white.iter_mut().for_each(|number| *number *= factor);
    }
}

impl Array<'_> {
    /// The figures that do not depend on a pattern.
    pub(super) fn reference(&self) -> Reference {
        let (white, uniformity, groups_of_extremes) = self.at_full_drive();
        let beyond = self.beyond(None);
        // Light beyond, and what the walls send back, lies among the packages that are traced.
        let bias = beyond.as_ref().map_or(0.0, |beyond| {
            let of_zone = self.dealt([0, 0]).len() as f64;
            let traced = (self.places.traced[0] * self.places.traced[1]) as f64;
            beyond.bound() * white[white.len() - 1] * of_zone / traced
        });
        Reference { spread: self.spread(bias), white, uniformity, groups_of_extremes, beyond }
    }

    /// Readings of the mean of the panel, figures of its map, and the groups of their errors.
    fn at_full_drive(&self) -> (Vec<f64>, Vec<(String, Estimate)>, usize) {
        let groups = self.responses.groups;
        let parts = [0, 1].map(|axis| self.zone_cells(axis).parts(&self.frame, axis));
        // Bins of the map of extremes: those at least half on the panel.
        let within = parts.each_ref().map(|parts| {
            let on: Vec<usize> =
                (0..parts.len()).filter(|k| inside(&parts[*k]) > 0.5 - 1e-9).collect();
            on.first().map_or(0..0, |first| *first..on[on.len() - 1] + 1)
        });
        let bins = within.clone().map(|range| range.len());
        let all = bins[0] * bins[1] * groups;
        let together = if all > MAX_VALUES { groups / MERGED } else { 1 };
        let [across, along] =
            parts.each_ref().map(|parts| parts.iter().map(inside).collect::<Vec<f64>>());
        let read = |y: usize, row: &RowOfGroups| {
            let sum = |group: usize| -> f64 {
                let values = row.group(group).iter().zip(&across);
                along[y] * values.map(|(value, part)| value * part).sum::<f64>()
            };
            let mut map = vec![vec![0.0; bins[0]]; groups / together];
            if within[1].contains(&y) {
                for group in 0..groups {
                    let to = map[group / together].iter_mut();
                    to.zip(&row.group(group)[within[0].clone()]).for_each(|(sum, v)| *sum += v);
                }
            }
            ((0..groups).map(sum).collect::<Vec<f64>>(), within[1].contains(&y).then_some(map))
        };
        let found = self.with_pieces(&self.full_drive(), |pieces| {
            let pieces = self.luminous(pieces.iter().cloned());
            rows(self.frame.bins, groups, &pieces, read)
        });
        let mut sums = vec![0.0; groups];
        let mut maps = vec![Vec::with_capacity(bins[0] * bins[1]); groups / together];
        for (of_row, map) in found {
            sums.iter_mut().zip(of_row).for_each(|(sum, value)| *sum += value);
            for (all, row) in maps.iter_mut().zip(map.into_iter().flatten()) {
                all.extend(row);
            }
        }
        let area = across.iter().sum::<f64>() * along.iter().sum::<f64>();
        let white = readings(&sums).into_iter().map(|reading| reading / area).collect();
        let low = [0, 1].map(|k| self.frame.middle_mm(k, within[k].start));
        let high = [0, 1].map(|k| self.frame.middle_mm(k, within[k].end.max(1) - 1));
        let middle = [0, 1].map(|k| 0.5 * (low[k] + high[k]));
        (white, self.uniformity(&Grouped::new(maps), bins, middle), groups / together)
    }

    /// Readings of the mean at these drives of each channel over each of `count` cells of the panel, in
    /// each part of the light.
    pub(super) fn means_of_parts(
        &self,
        count: [usize; 2],
        drives: &[Vec<f64>],
    ) -> Vec<Vec<Vec<f64>>> {
        let cells = [0, 1].map(|axis| Cells { count: count[axis], ..self.zone_cells(axis) });
        let parts = [0, 1].map(|axis| cells[axis].parts(&self.frame, axis));
        let groups = self.responses.groups;
        // Sums over each column of cells, by part of the light and group.
        let read = |_: usize, rows: &[RowOfGroups]| -> Vec<Vec<Vec<f64>>> {
            let sums = |row: &RowOfGroups, group: usize| {
                let mut sums = vec![0.0; count[0]];
                for (value, of_x) in row.group(group).iter().zip(&parts[0]) {
                    for (cell, part) in of_x {
                        sums[*cell] += part * value;
                    }
                }
                sums
            };
            rows.iter().map(|row| (0..groups).map(|group| sums(row, group)).collect()).collect()
        };
        let found =
            self.with_pieces(drives, |parts| rows_of_parts(self.frame.bins, groups, parts, read));
        let bins = |k: usize| cells[k].length_mm / (count[k] as f64 * self.frame.bin_mm[k]);
        let area = bins(0) * bins(1);
        let mut means = vec![vec![vec![0.0; groups]; self.parts.len()]; count[0] * count[1]];
        for (row, of_y) in found.iter().zip(&parts[1]) {
            for (j, part) in of_y {
                for (k, cell) in means[j * count[0]..][..count[0]].iter_mut().enumerate() {
                    for (sums, of_row) in cell.iter_mut().zip(row) {
                        let groups = sums.iter_mut().zip(of_row);
                        groups.for_each(|(sum, of_row)| *sum += part * of_row[k] / area);
                    }
                }
            }
        }
        let of_cell = |cell: Vec<Vec<f64>>| cell.iter().map(|part| readings(part)).collect();
        means.into_iter().map(of_cell).collect()
    }

    /// Mean and extremes of the map at full drive, and the points of a display.
    fn uniformity(
        &self,
        map: &Grouped,
        bins: [usize; 2],
        middle: [f64; 2],
    ) -> Vec<(String, Estimate)> {
        let [columns, rows] = self.places.whole;
        let pitch = self.places.pitch_mm;
        let axes = self.places.axes_mm();
        let layout = if self.places.is_lattice() {
            Layout::rectangular(axes, columns, rows, pitch[0].min(pitch[1]))
        } else {
            Layout::of_places(axes)
        };
        let mut read = Bins::new(&vec![1.0; bins[0] * bins[1]], None);
        if bins.iter().all(|count| *count >= 3) {
            let leds = layout.seen_from(middle, self.frame.bin_mm);
            read = read.with_points(bins, &leds, None, None);
        }
        let estimates = read.estimates(map).into_iter();
        // The first is the sum over bins, which has no unit here.
        let named = OF_RECEIVER.into_iter().zip(estimates).skip(1);
        named.map(|(figure, estimate)| (figure.key.to_owned(), estimate)).collect()
    }

    /// The light of the zone nearest to the middle, of which a part `bias` may lie elsewhere.
    fn spread(&self, bias: f64) -> Spread {
        let zone = self.zones.map(|count| count / 2);
        let of_part = |part| self.zone_pieces(zone, part, 1.0);
        let pieces = self.luminous((0..self.parts.len()).map(of_part));
        let centre_mm = [0, 1].map(|k| {
            let [low, length] = self.places.area_mm(k);
            low + length * (zone[k] as f64 + 0.5) / self.zones[k] as f64
        });
        let (block, at) = sum_of(&pieces, self.responses.groups);
        let width = self.frame.bin_mm[0].max(self.frame.bin_mm[1]);
        let distance = |i: usize, j: usize| {
            let x = self.frame.at_mm(0, at[0] + i as isize) - centre_mm[0];
            let y = self.frame.at_mm(1, at[1] + j as isize) - centre_mm[1];
            x.hypot(y)
        };
        let is_on_panel = |bin: &[usize; 2]| {
            (0..2).all(|k| {
                let [low, length] = self.places.area_mm(k);
                let middle = self.frame.at_mm(k, at[k] + bin[k] as isize);
                (low..=low + length).contains(&middle)
            })
        };
        let places = || {
            let all = (0..block.bins[1]).flat_map(|j| (0..block.bins[0]).map(move |i| [i, j]));
            all.filter(is_on_panel)
        };
        let ring = |[i, j]: [usize; 2]| (distance(i, j) / width) as usize;
        let rings = places().map(ring).max().unwrap_or(0) + 1;
        let (mut counts, mut distances) = (vec![0.0; rings], vec![0.0; rings]);
        let mut sums = vec![vec![0.0; block.groups]; rings];
        for [i, j] in places() {
            let ring = ring([i, j]);
            counts[ring] += 1.0;
            distances[ring] += distance(i, j);
            for (group, sum) in sums[ring].iter_mut().enumerate() {
                *sum += block.row(group, j)[i];
            }
        }
        let full = |k: &usize| counts[*k] > 0.0;
        let there: Vec<usize> = (0..rings).filter(full).collect();
        let ring = |k: &usize| figure(readings(&sums[*k]), counts[*k], block.one_path);
        let distance_mm: Vec<f64> = there.iter().map(|k| distances[*k] / counts[*k]).collect();
        let rings: Vec<JackknifedFigure> = there.iter().map(ring).collect();
        let radii_mm = SHARES.map(|share| radius(&distance_mm, &rings, share, bias)).to_vec();
        Spread { zone, centre_mm, distance_mm, rings, radii_mm }
    }

    /// Light of an inner package, of one lot or all, beyond the traced array.
    pub(super) fn beyond(&self, lot: Option<usize>) -> Option<Beyond> {
        let extended: Vec<usize> = (0..2).filter(|k| self.places.is_extended(*k)).collect();
        let reach = extended.iter().map(|k| self.places.reach(*k)).min()?;
        let inner = [0, 1].map(|k| self.places.stand_in(k, self.places.whole[k] / 2));
        let counted =
            self.parts.iter().enumerate().filter(|(_, part)| lot.is_none_or(|lot| lot == part.lot));
        let piece = |(number, part): (usize, &ChannelLight)| {
            let weight = if lot.is_some() { part.weight() } else { part.xyz[1] };
            Piece { weight, ..self.responses.at(inner, number) }
        };
        let pieces: Vec<Piece> = counted.map(piece).collect();
        let (block, at) = sum_of(&pieces, self.responses.groups);
        let traced = self.receiver.frame;
        // Shells of whole packages, along the axes on which the array is larger.
        let centre = [0, 1].map(|k| {
            let shorter = (self.places.whole[k] - self.places.traced[k]) as f64;
            let before = 0.5 * shorter + inner[k] as f64 + 0.5;
            self.places.area_mm(k)[0] + before * self.places.pitch_mm[k]
        });
        let shell = |i: usize, j: usize| {
            let away = |k: usize, bin: usize| {
                let mm = traced.at_mm(k, at[k] + bin as isize) - centre[k];
                (mm.abs() / self.places.pitch_mm[k]).round() as usize
            };
            extended.iter().map(|&k| away(k, [i, j][k])).max().unwrap_or(0)
        };
        let mut shells = vec![vec![0.0; block.groups]; reach + 1];
        let mut all = vec![0.0; block.groups];
        for j in 0..block.bins[1] {
            for i in 0..block.bins[0] {
                let shell = shell(i, j);
                for (group, sum) in all.iter_mut().enumerate() {
                    let value = block.row(group, j)[i];
                    *sum += value;
                    if let Some(shell) = shells.get_mut(shell) {
                        shell[group] += value;
                    }
                }
            }
        }
        let packages = |shell: usize| match (shell, extended.len()) {
            (0, _) => 1.0,
            (_, 1) => 2.0,
            _ => 8.0 * shell as f64,
        };
        let shells: Vec<Vec<f64>> = shells.iter().map(|sums| readings(sums)).collect();
        let all = readings(&all);
        let share = |reading: usize| {
            // A shell that no path reached holds less than one.
            let of_shell = |sums: &Vec<f64>| sums[reading].max(block.one_path);
            let shells: Vec<f64> = shells.iter().map(of_shell).collect();
            Some(beyond(&shells, packages)? / all[reading])
        };
        let last = all.len() - 1;
        let without: Option<Vec<f64>> = (0..last).map(share).collect();
        let share = share(last).zip(without);
        let share = share.map(|(value, all)| JackknifedFigure::new(value, all).estimate());
        let falls = self.falls((&block, at), centre, reach);
        let falls = falls.into_iter().map(|light| light / all[last]).collect();
        let mut found = Beyond {
            reach,
            share,
            walls: None,
            by_cell: [Vec::new(), Vec::new()],
            walls_of_mean: 0.0,
            error_of_images: 0.0,
            falls,
        };
        for axis in 0..2 {
            let Some(AtWalls { error, share, by_cell }) = self.error_at_walls(axis, lot) else {
                continue;
            };
            // A corner has the errors of both.
            found.walls = Some(found.walls.map_or(share, |other| {
                let error = other.standard_error.hypot(share.standard_error);
                Estimate::new(other.value + share.value, error)
            }));
            // Two walls, over all cells.
            let cells = self.places.whole[axis] as f64;
            found.walls_of_mean += 2.0 * by_cell.iter().sum::<f64>() / cells;
            found.error_of_images = found.error_of_images.max(error);
            found.by_cell[axis] = by_cell;
        }
        Some(found)
    }

    /// The most light of a response on a cell of a package so many places from its own or farther: two
    /// standard errors above the means of rings.
    fn falls(
        &self,
        (block, at): (&Block, [isize; 2]),
        centre_mm: [f64; 2],
        reach: usize,
    ) -> Vec<f64> {
        let (pitch, frame) = (self.places.pitch_mm, self.receiver.frame);
        let away =
            |k: usize, bin: usize| (frame.at_mm(k, at[k] + bin as isize) - centre_mm[k]) / pitch[k];
        let mut rings = vec![(0.0, vec![0.0; block.groups]); reach + 1];
        for j in 0..block.bins[1] {
            for i in 0..block.bins[0] {
                let ring = away(0, i).hypot(away(1, j)).round() as usize;
                let Some((count, sums)) = rings.get_mut(ring) else { continue };
                *count += 1.0;
                for (group, sum) in sums.iter_mut().enumerate() {
                    *sum += block.row(group, j)[i];
                }
            }
        }
        let bins_of_cell = pitch[0] / frame.bin_mm[0] * (pitch[1] / frame.bin_mm[1]);
        let mut most = 0.0;
        let mut falls: Vec<f64> = Vec::with_capacity(rings.len());
        for (count, sums) in rings.iter().rev() {
            let mean = figure(readings(sums), f64::max(*count, 1.0), block.one_path);
            most = f64::max(most, (mean.value + 2.0 * mean.standard_error) * bins_of_cell);
            falls.push(most);
        }
        falls.reverse();
        falls
    }

    /// Mean over each of so many cells of the panel of the light that places may lack or have too much at
    /// full drive.
    pub(super) fn light_off_by_cell(&self, beyond: Option<&Beyond>, count: [usize; 2]) -> Vec<f64> {
        let off = self.light_off(beyond, &vec![1.0; self.places.packages_by_zone().len()]);
        let [x, y] = [0, 1].map(|axis| {
            Cells { count: count[axis], ..self.zone_cells(axis) }.parts(&self.frame, axis)
        });
        let mut sums = vec![[0.0; 2]; count[0] * count[1]];
        for (j, of_y) in y.iter().enumerate() {
            for (i, of_x) in x.iter().enumerate() {
                let value = off.at([i, j]);
                for ((b, part_y), (a, part_x)) in
                    of_y.iter().flat_map(|y| of_x.iter().map(move |x| (y, x)))
                {
                    let [sum, area] = &mut sums[b * count[0] + a];
                    *sum += part_x * part_y * value;
                    *area += part_x * part_y;
                }
            }
        }
        sums.into_iter().map(|[sum, area]| sum / area).collect()
    }

    /// Light that places may lack or have too much at these drives of the zones, over the mean at full
    /// drive: that of full drive at the largest, or what all lit packages together may make.
    pub(super) fn light_off(&self, beyond: Option<&Beyond>, drives: &[f64]) -> LightOff {
        let Some(beyond) = beyond else { return LightOff::anywhere(0.0, self.frame.bins) };
        let largest = drives.iter().copied().fold(0.0, f64::max);
        let last = beyond.falls.len().saturating_sub(1);
        let (mut far, mut beside) = (0.0, 0.0);
        for (packages, drive) in self.places.packages_by_zone().iter().zip(drives) {
            for package in packages {
                far += drive * beyond.falls[last];
                for away in self.places.moved_to(*package) {
                    beside += drive * beyond.error_of_images * beyond.falls[away.min(last)];
                }
            }
        }
        let far = if beyond.share.is_some() { far } else { largest };
        // Cells of a pitch between a bin and both walls.
        let at_walls = |k: usize, bin: usize| -> f64 {
            let ([low, length], middle) = (self.places.area_mm(k), self.frame.middle_mm(k, bin));
            let away = [middle - low, low + length - middle];
            let cell = |mm: f64| (mm / self.places.pitch_mm[k]).max(0.0) as usize;
            largest * away.iter().filter_map(|mm| beyond.by_cell[k].get(cell(*mm))).sum::<f64>()
        };
        LightOff {
            anywhere: far.min(beyond.largest_share() * largest),
            beside,
            by_bin: [0, 1].map(|k| (0..self.frame.bins[k]).map(|bin| at_walls(k, bin)).collect()),
            all: largest,
        }
    }
}

/// The sum of pieces over the bins that they reach, and its first bin.
pub(super) fn sum_of(pieces: &[Piece], groups: usize) -> (Block, [isize; 2]) {
    let ends = |piece: &Piece, k: usize| {
        let [low, high] = piece.within[k];
        [piece.at[k].max(low), (piece.at[k] + piece.bins()[k] as isize).min(high)]
    };
    let at = [0, 1].map(|k| pieces.iter().map(|piece| ends(piece, k)[0]).min().unwrap_or(0));
    let end = [0, 1].map(|k| pieces.iter().map(|piece| ends(piece, k)[1]).max().unwrap_or(0));
    let bins = [0, 1].map(|k| (end[k] - at[k]).max(0) as usize);
    let mut moved = pieces.to_vec();
    for piece in &mut moved {
        for (k, first) in at.into_iter().enumerate() {
            piece.at[k] -= first;
            piece.within[k] = piece.within[k].map(|end| end.saturating_sub(first));
        }
    }
    (Block::sum(bins, groups, &moved), at)
}

/// The radius of `share` of the largest ring, where each ring may hold `bias` more or less; `None`
/// where any reading has none.
fn radius(
    distance_mm: &[f64],
    rings: &[JackknifedFigure],
    share: f64,
    bias: f64,
) -> Option<Estimate> {
    let read = |value: &dyn Fn(&JackknifedFigure) -> f64| {
        radius_at(distance_mm, &rings.iter().map(value).collect::<Vec<f64>>(), share)
    };
    let groups = rings.first()?.without.len();
    let without: Option<Vec<f64>> = (0..groups).map(|g| read(&|ring| ring.without[g])).collect();
    let figure = JackknifedFigure::new(read(&|ring| ring.value)?, without?);
    if bias <= 0.0 {
        return Some(figure.estimate());
    }
    let [low, high] = [-bias, bias].map(|more| read(&|ring| ring.value + more));
    Some(figure.estimate().with_bias(0.5 * (high? - low?).abs()))
}
