// SPDX-License-Identifier: MIT OR Apache-2.0
//! The panel before the backlight: what it shows of a picture, zone by zone and bin by bin.

use metrics::dimming::{behind_panel, panel_bias};
use metrics::hits::with_one_path;
use metrics::{Estimate, JackknifedFigure};

use formats::level_image::LevelImage;

use super::map_receiver::Frame;
use super::superposition::{Piece, RowOfGroups, rows};

/// Cells of equal length along an axis that bins lie in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    /// Lower end, mm.
    pub low_mm: f64,
    /// Length of all, mm.
    pub length_mm: f64,
    /// Number.
    pub count: usize,
}

/// Cells that a bin lies in, with the part of the bin in each.
pub(super) type Parts = Vec<(usize, f64)>;

impl Cells {
    /// Parts of every bin of `frame` along `axis`.
    pub fn parts(&self, frame: &Frame, axis: usize) -> Vec<Parts> {
        let (bin, cell) = (frame.bin_mm[axis], self.length_mm / self.count as f64);
        let of_bin = |k: usize| {
            let from = (frame.low_mm[axis] + k as f64 * bin - self.low_mm) / cell;
            let to = from + bin / cell;
            // Touching is no part, also where positions are rounded.
            let first = (from + 1e-9).floor().max(0.0) as usize;
            let end = ((to - 1e-9).ceil().max(0.0) as usize).min(self.count);
            let part = |c: usize| (to.min(c as f64 + 1.0) - from.max(c as f64)) * cell / bin;
            (first..end).map(|c| (c, part(c))).collect()
        };
        (0..frame.bins[axis]).map(of_bin).collect()
    }
}

/// Part of a bin that lies in any cell.
pub(super) fn inside(parts: &Parts) -> f64 {
    parts.iter().map(|(_, part)| part).sum()
}

/// Mean over the cells of `image` that each bin of `frame` lies in; NaN outside of the panel.
pub(super) fn resampled(image: &LevelImage, frame: &Frame, area: [[f64; 2]; 2]) -> Vec<f64> {
    let [x, y] = [(0, image.columns), (1, image.rows)].map(|(axis, count)| {
        let [low_mm, length_mm] = area[axis];
        Cells { low_mm, length_mm, count }.parts(frame, axis)
    });
    let level = |(j, of_y): (usize, f64), (i, of_x): (usize, f64)| {
        of_x * of_y * image.levels[j * image.columns + i]
    };
    let mean = |of_y: &Parts, of_x: &Parts| {
        let sum: f64 =
            of_y.iter().flat_map(|row| of_x.iter().map(move |column| level(*row, *column))).sum();
        sum / (inside(of_x) * inside(of_y))
    };
    y.iter().flat_map(|of_y| x.iter().map(move |of_x| mean(of_y, of_x))).collect()
}

/// Part that a bin plays in the halo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// None.
    Other,
    /// Black beside bright.
    Black,
    /// Of the largest level.
    Bright,
}

/// A picture on a panel before zones.
pub(super) struct Panel {
    frame: Frame,
    zones: [usize; 2],
    /// Zones of every bin along x and y.
    parts: [Vec<Parts>; 2],
    /// Level of each bin from 0 to 1; NaN outside of the panel.
    levels: Vec<f64>,
    roles: Vec<Role>,
    contrast: f64,
}

/// Readings with all groups of paths, after those without each.
type Readings = Vec<f64>;

/// What a panel shows.
pub(super) struct Shown {
    /// Backlight and light behind the panel in each bin, as they are summed, with standard errors.
    pub maps: [(Vec<f64>, Vec<f64>); 2],
    /// The same of each zone, with replicates.
    pub zones: [Vec<JackknifedFigure>; 2],
    /// Mean of black bins beside bright ones, and of bright ones; `None` without such bins.
    pub halo: Option<[JackknifedFigure; 2]>,
    /// What noise leaves behind the panel.
    pub bias: Bias,
}

/// Bounds of the bias that noise leaves where the backlight is about as bright as what is wanted.
pub(super) struct Bias {
    /// In each bin.
    pub bins: Vec<f64>,
    /// In the mean of each zone.
    pub zones: Vec<f64>,
    /// In the means of the halo's bins.
    pub halo: [f64; 2],
}

/// One row of bins.
struct ShownRow {
    values: [Vec<f64>; 2],
    errors: [Vec<f64>; 2],
    /// Bounds of bias behind the panel.
    bias: Vec<f64>,
    /// Sums over the bins of each column of zones.
    zones: [Vec<Readings>; 2],
    /// Sums over black and bright bins.
    halo: [Readings; 2],
    /// The largest of what one path adds to a bin.
    one_path: f64,
}

impl Panel {
    /// The panel of `frame` before `zones` over `area` (lower end and length along x and y, mm),
    /// which shows `image`.
    pub fn new(
        frame: Frame,
        (zones, area): ([usize; 2], [[f64; 2]; 2]),
        image: &LevelImage,
        contrast: f64,
    ) -> Self {
        let parts = [0, 1].map(|axis| {
            let [low_mm, length_mm] = area[axis];
            Cells { low_mm, length_mm, count: zones[axis] }.parts(&frame, axis)
        });
        let levels = resampled(image, &frame, area);
        let mut panel = Self { frame, zones, parts, levels, roles: Vec::new(), contrast };
        panel.roles = panel.roles();
        panel
    }

    /// Numbers of bins on black beside bright and on bright.
    pub fn halo_bins(&self) -> [usize; 2] {
        [Role::Black, Role::Bright].map(|role| self.roles.iter().filter(|r| **r == role).count())
    }

    fn roles(&self) -> Vec<Role> {
        let largest = self.levels.iter().copied().fold(0.0, f64::max);
        let is_bright = |level: f64| level > 0.0 && level >= (1.0 - 1e-9) * largest;
        let of_bin = |k: usize| {
            let bin = [k % self.frame.bins[0], k / self.frame.bins[0]];
            let zone = |axis: usize| {
                let parts = self.parts[axis][bin[axis]].iter();
                Some(parts.max_by(|a, b| a.1.total_cmp(&b.1))?.0)
            };
            Some([zone(0)?, zone(1)?])
        };
        let mut bright = vec![false; self.zones[0] * self.zones[1]];
        for (k, level) in self.levels.iter().enumerate().filter(|(_, level)| is_bright(**level)) {
            if let Some([i, j]) = of_bin(k).filter(|_| level.is_finite()) {
                bright[j * self.zones[0] + i] = true;
            }
        }
        let is_near_bright = |[i, j]: [usize; 2]| {
            let about = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
            about(j, self.zones[1])
                .any(|j| about(i, self.zones[0]).any(|i| bright[j * self.zones[0] + i]))
        };
        let role = |(k, level): (usize, &f64)| match of_bin(k) {
            Some(_) if is_bright(*level) => Role::Bright,
            Some(zone) if *level == 0.0 && is_near_bright(zone) => Role::Black,
            _ => Role::Other,
        };
        self.levels.iter().enumerate().map(role).collect()
    }

    /// What it shows before the light of `pieces`; `white` is the mean luminance of the backlight
    /// at full drive, with readings as of [`Readings`].
    pub fn show(&self, pieces: &[Piece], white: &[f64]) -> Shown {
        let groups = white.len() - 1;
        let found = rows(self.frame.bins, groups, pieces, |y, row| self.row(y, row, white));
        let count = self.zones[0] * self.zones[1];
        let mut sums = [0, 1].map(|_| vec![vec![0.0; groups + 1]; count]);
        let mut areas = vec![0.0; count];
        let mut halo = [0, 1].map(|_| vec![0.0; groups + 1]);
        let mut maps = [0, 1].map(|_| (Vec::new(), Vec::new()));
        let mut bias = Vec::with_capacity(self.levels.len());
        let across = self.areas_of_columns();
        let one_path = found.iter().map(|row| row.one_path).fold(0.0, f64::max);
        for (y, row) in found.into_iter().enumerate() {
            for (j, part) in &self.parts[1][y] {
                for i in 0..self.zones[0] {
                    let zone = j * self.zones[0] + i;
                    areas[zone] += part * across[i];
                    for (sums, of_row) in sums.iter_mut().zip(&row.zones) {
                        let readings = sums[zone].iter_mut().zip(&of_row[i]);
                        readings.for_each(|(sum, value)| *sum += part * value);
                    }
                }
            }
            for (sum, of_row) in halo.iter_mut().zip(row.halo) {
                sum.iter_mut().zip(of_row).for_each(|(sum, value)| *sum += value);
            }
            for ((map, values), errors) in maps.iter_mut().zip(row.values).zip(row.errors) {
                map.0.extend(values);
                map.1.extend(errors);
            }
            bias.extend(row.bias);
        }
        let bias = self.bias(bias, &areas);
        let zones = sums.map(|sums| {
            let means = sums.into_iter().zip(&areas);
            means.map(|(sums, area)| figure(sums, *area, one_path)).collect()
        });
        let bins = self.halo_bins();
        let mut of_bins =
            halo.into_iter().zip(bins).map(|(sum, n)| figure(sum, n as f64, one_path));
        let halo = match (of_bins.next(), of_bins.next()) {
            (Some(black), Some(bright)) if bins.iter().all(|n| *n > 0) => Some([black, bright]),
            _ => None,
        };
        Shown { maps, zones, halo, bias }
    }

    /// Means over zones and over the bins of the halo of `bins`.
    fn bias(&self, bins: Vec<f64>, areas: &[f64]) -> Bias {
        let (mut zones, mut halo) = (vec![0.0; areas.len()], [0.0; 2]);
        let counts = self.halo_bins().map(|count| count.max(1) as f64);
        for (k, bias) in bins.iter().enumerate() {
            let [x, y] = [k % self.frame.bins[0], k / self.frame.bins[0]];
            for (j, of_y) in &self.parts[1][y] {
                for (i, of_x) in &self.parts[0][x] {
                    let zone = j * self.zones[0] + i;
                    zones[zone] += of_x * of_y * bias / areas[zone];
                }
            }
            match self.roles[k] {
                Role::Black => halo[0] += bias / counts[0],
                Role::Bright => halo[1] += bias / counts[1],
                Role::Other => {}
            }
        }
        Bias { bins, zones, halo }
    }

    /// Bins in each column of zones, by their parts.
    fn areas_of_columns(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.zones[0]];
        for (zone, part) in self.parts[0].iter().flatten() {
            areas[*zone] += part;
        }
        areas
    }

    fn row(&self, y: usize, row: &RowOfGroups, white: &[f64]) -> ShownRow {
        let (bins, groups) = (self.frame.bins[0], row.count());
        let total = row.total();
        let levels = &self.levels[y * bins..][..bins];
        let roles = &self.roles[y * bins..][..bins];
        // Outside of the panel nothing is shown.
        let shown = |backlight: f64, level: f64, white: f64| {
            if level.is_nan() { 0.0 } else { behind_panel(backlight, level * white, self.contrast) }
        };
        let values = [
            total.clone(),
            (0..bins).map(|x| shown(total[x], levels[x], white[groups])).collect::<Vec<f64>>(),
        ];
        let mut zones = [0, 1].map(|_| vec![vec![0.0; groups + 1]; self.zones[0]]);
        let mut halo = [0, 1].map(|_| vec![0.0; groups + 1]);
        // Sums of differences from the reading of all groups, and of their squares.
        let mut moments = [0, 1].map(|_| vec![[0.0; 2]; bins]);
        let rest = groups as f64 / (groups as f64 - 1.0);
        for reading in 0..=groups {
            for x in 0..bins {
                let both = if reading == groups {
                    [values[0][x], values[1][x]]
                } else {
                    let backlight = rest * (total[x] - row.group(reading)[x]);
                    [backlight, shown(backlight, levels[x], white[reading])]
                };
                for k in 0..2 {
                    let difference = both[k] - values[k][x];
                    moments[k][x][0] += difference;
                    moments[k][x][1] += difference * difference;
                    for (zone, part) in &self.parts[0][x] {
                        zones[k][*zone][reading] += part * both[k];
                    }
                }
                match roles[x] {
                    Role::Black => halo[0][reading] += both[1],
                    Role::Bright => halo[1][reading] += both[1],
                    Role::Other => {}
                }
            }
        }
        let n = groups as f64;
        let error = |k: usize, x: usize| {
            let [sum, squares] = moments[k][x];
            let scatter = ((squares - sum * sum / n).max(0.0) * (n - 1.0) / n).sqrt();
            // Light that no path brought may come all the same.
            let share = if k == 0 { 1.0 } else { 1.0 / self.contrast };
            with_one_path(Estimate::new(values[k][x], scatter), share * row.one_path[x])
                .standard_error
        };
        let errors: [Vec<f64>; 2] = [0, 1].map(|k| (0..bins).map(|x| error(k, x)).collect());
        let of_bin = |x: usize| {
            let backlight = Estimate::new(total[x], errors[0][x]);
            let wanted = levels[x] * white[groups];
            if wanted.is_nan() { 0.0 } else { panel_bias(backlight, wanted, self.contrast) }
        };
        let bias = (0..bins).map(of_bin).collect();
        let one_path = row.one_path.iter().copied().fold(0.0, f64::max);
        ShownRow { values, errors, bias, zones, halo, one_path }
    }
}

/// The mean of sums over this number of bins, of which one path adds so much to one.
pub(super) fn figure(mut sums: Readings, bins: f64, one_path: f64) -> JackknifedFigure {
    for sum in &mut sums {
        *sum /= bins;
    }
    let value = sums.pop().unwrap_or_default();
    let figure = JackknifedFigure::new(value, sums);
    let known = with_one_path(figure.estimate(), one_path / bins);
    JackknifedFigure { standard_error: known.standard_error, ..figure }
}
