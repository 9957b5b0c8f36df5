// SPDX-License-Identifier: MIT OR Apache-2.0
//! The panel before the backlight: what it shows of a picture, zone by zone and bin by bin.

use metrics::dimming::{behind_panel, panel_bias};
use metrics::glare::{Glare, Viewing};
use metrics::hits::with_one_path;
use metrics::{Estimate, JackknifedFigure};

use super::Pattern;
use super::cells::{Cells, Parts, resampled};
use super::colour::{ColourSums, PictureOnPanel, add};
use super::estimates::{biased, figure};
use super::map_receiver::Frame;
use super::panel_colour::{self, Account, Place};
use super::responses::Part;
use super::superposition::{Piece, RowOfGroups, rows_of_parts};

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
pub(super) struct Panel<'a> {
    frame: Frame,
    zones: [usize; 2],
    /// Zones of every bin along x and y.
    parts: [Vec<Parts>; 2],
    /// Level of each bin from 0 to 1; NaN outside of the panel.
    levels: Vec<f64>,
    roles: Vec<Role>,
    contrast: f64,
    /// Parts of the light.
    light: &'a [Part],
    /// The panel with sub-pixels, and X, Y and Z that are wanted in each bin.
    colours: Option<(&'a PictureOnPanel<'a>, Vec<[f64; 3]>)>,
    /// Light that any bin may lack or have too much, by parts, and over full white.
    beyond: (Vec<f64>, f64),
}

/// What a bin shows: luminance, missing and leaking.
type Outcome = [f64; 3];

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
    /// What noise and light beyond the traced array leave behind the panel.
    pub bias: Bias,
    /// Colours, where parts of the light have some.
    pub colours: Option<ColourSums>,
}

/// Bounds of the bias behind the panel: of noise where the backlight is about as bright as what is
/// wanted, and of light beyond the traced array.
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
    /// Sums of X, Y and Z over black and bright bins.
    halo: [Vec<[f64; 3]>; 2],
    /// The largest of what one path adds to a bin.
    one_path: f64,
    /// Colours, where parts of the light have some.
    colours: Option<ColourRow>,
}

/// Colours of one row of bins.
struct ColourRow {
    /// X, Y and Z of the backlight and behind the panel.
    xyz: [Vec<[f64; 3]>; 2],
    /// Sums over the black bins of each column of zones, by readings and then with more and with less
    /// light from beyond, and their parts.
    dark: Vec<(Vec<[f64; 3]>, f64)>,
    /// What is missing and leaks, by readings.
    accounts: Vec<Account>,
    /// Bounds of the bias in what is missing and leaks.
    bias: [f64; 2],
    /// The panel before each bin.
    places: Vec<Place>,
}

impl<'a> Panel<'a> {
    /// The panel of `frame` before `zones` over `area` (lower end and length along x and y, mm) and
    /// these parts of the light, of which any bin may lack or have `beyond` of full drive too much,
    /// which shows the picture of `pattern`.
    pub fn new(
        frame: Frame,
        (zones, area): ([usize; 2], [[f64; 2]; 2]),
        (light, beyond): (&'a [Part], f64),
        pattern: Pattern<'a>,
    ) -> Self {
        let parts = [0, 1].map(|axis| {
            let [low_mm, length_mm] = area[axis];
            Cells { low_mm, length_mm, count: zones[axis] }.parts(&frame, axis)
        });
        let wanted = pattern.colours.map(|colours| {
            let picture = colours.picture;
            let at = |k: usize| picture.xyz[k].map(f64::from);
            (colours, resampled([picture.columns, picture.rows], at, &frame, area))
        });
        let image = pattern.picture;
        let levels = if let Some((_, wanted)) = &wanted {
            wanted.iter().map(|xyz| xyz[1]).collect()
        } else {
            let at = |k: usize| [image.levels[k]];
            resampled([image.columns, image.rows], at, &frame, area).concat()
        };
        let mut panel = Self {
            frame,
            zones,
            parts,
            levels,
            roles: Vec::new(),
            contrast: pattern.contrast,
            light,
            colours: wanted,
            beyond: (pattern.full_light.iter().map(|mean| beyond * mean).collect(), beyond),
        };
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
    pub fn show(&self, pieces: &[Vec<Piece>], white: &[f64]) -> Shown {
        let groups = white.len() - 1;
        let found =
            rows_of_parts(self.frame.bins, groups, pieces, |y, rows| self.row(y, rows, white));
        let count = self.zones[0] * self.zones[1];
        let mut sums = [0, 1].map(|_| vec![vec![0.0; groups + 1]; count]);
        let mut areas = vec![0.0; count];
        let mut halo = [0, 1].map(|_| vec![[0.0; 3]; groups + 1]);
        let mut colours = self.has_colours().then(|| ColourSums::new(count, groups + 1));
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
            if let (Some(sums), Some(row)) = (&mut colours, row.colours) {
                sums.add(row.xyz, row.places, (&row.accounts, row.bias));
                for (j, part) in &self.parts[1][y] {
                    let of_row = &mut sums.dark[j * self.zones[0]..][..self.zones[0]];
                    of_row.iter_mut().zip(&row.dark).for_each(|(sum, of)| sum.add(of, *part));
                }
            }
            for (sum, of_row) in halo.iter_mut().zip(row.halo) {
                sum.iter_mut().zip(of_row).for_each(|(sum, value)| add(sum, value, 1.0));
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
        let luminance = |sums: &Vec<[f64; 3]>| sums.iter().map(|xyz| xyz[1]).collect();
        let mut of_bins =
            halo.iter().zip(bins).map(|(sum, n)| figure(luminance(sum), n as f64, one_path));
        let halo = match (of_bins.next(), of_bins.next()) {
            (Some(black), Some(bright)) if bins.iter().all(|n| *n > 0) => Some([black, bright]),
            _ => None,
        };
        if let (Some(sums), Some((of, wanted))) = (&mut colours, &self.colours) {
            // Beyond the panel nothing is asked for.
            let on_panel = |value: f64| if value.is_nan() { 0.0 } else { value };
            let scale = of.scale[groups];
            sums.white.clone_from(&of.white);
            sums.wanted = wanted.iter().map(|xyz| xyz.map(|v| scale * on_panel(v))).collect();
        }
        Shown { maps, zones, halo, bias, colours }
    }

    /// The share of the halo that lies below the veil of the eye which looks at what is wanted of this
    /// `luminance` ([`metrics::glare`]); `None` without black beside bright, or without a halo. Light is
    /// that of [`Self::show`].
    pub fn hidden(
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
                    let light = self.with_beyond(&light, more);
                    let veil = veil[bin] * (1.0 - more * self.beyond.1);
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

    /// Luminance that the picture asks for in a bin; 0 outside of the panel.
    fn wanted_y(&self, (bin, reading): (usize, usize), white: &[f64]) -> f64 {
        let scale = self.colours.as_ref().map_or(white[reading], |(of, _)| of.scale[reading]);
        let level = self.levels[bin];
        if level.is_nan() { 0.0 } else { level * scale }
    }

    /// `light` by parts with so many times the light that may come from beyond.
    fn with_beyond(&self, light: &[f64], times: f64) -> Vec<f64> {
        let beyond = self.beyond.0.iter().chain(std::iter::repeat(&0.0));
        light.iter().zip(beyond).map(|(light, more)| (light + times * more).max(0.0)).collect()
    }

    /// What a bin shows before `light`.
    fn outcome(&self, at: (usize, usize), light: &[f64], white: f64) -> Outcome {
        let mut account = Account::default();
        let y = self.shown(at, light, white, &mut account)[1];
        [y, account.missing, account.leaking]
    }

    /// Bounds of the bias in what a bin shows before `light`, whose channels have these standard
    /// `errors` of their luminance.
    ///
    /// Noise of a channel: half the second difference over two standard errors s. Where the slope
    /// changes by 1 at the distance d s it is s (2 - d) / 2, never less but for 0.01 s than the bias
    /// s (φ(d) - d Φ(-d)) of normal noise, also in the mean over the d that noise gives. Light from
    /// beyond: the largest difference that it makes, beside its share of white.
    fn biases(&self, at: (usize, usize), light: &[f64], errors: &[f64], white: f64) -> Outcome {
        let middle = self.outcome(at, light, white);
        let mut bounds = [0.0; 3];
        for (channel, error) in errors.iter().enumerate() {
            let of_channel = |part: &Part| part.channel == channel;
            let pairs = self.light.iter().zip(light).filter(|(part, _)| of_channel(part));
            let luminance: f64 = pairs.map(|(part, light)| part.xyz[1] * light).sum();
            if luminance <= 0.0 || *error <= 0.0 {
                continue;
            }
            let step = (2.0 * error / luminance).min(1.0);
            let ends = [1.0 - step, 1.0 + step].map(|factor| {
                let scaled = self.light.iter().zip(light);
                let scaled = scaled.map(|(part, l)| if of_channel(part) { factor * l } else { *l });
                self.outcome(at, &scaled.collect::<Vec<f64>>(), white)
            });
            (0..3).for_each(|k| {
                bounds[k] += 0.5 * (ends[0][k] + ends[1][k] - 2.0 * middle[k]).abs();
            });
        }
        if self.beyond.1 > 0.0 {
            let ends =
                [1.0, -1.0].map(|more| self.outcome(at, &self.with_beyond(light, more), white));
            (0..3).for_each(|k| {
                let far = ends.iter().map(|end| (end[k] - middle[k]).abs()).fold(0.0, f64::max);
                bounds[k] += far + self.beyond.1 * middle[0];
            });
        }
        bounds
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

    fn has_colours(&self) -> bool {
        self.colours.is_some() || self.light.len() > 1
    }

    /// Luminance of the backlight of `light` by parts.
    fn luminance(&self, light: &[f64]) -> f64 {
        self.light.iter().zip(light).map(|(part, light)| part.xyz[1] * light).sum()
    }

    /// X, Y and Z behind the panel in a bin before `light` by parts; outside of the panel nothing is
    /// shown. What is wanted is stored in `account`.
    fn shown(
        &self,
        (bin, reading): (usize, usize),
        light: &[f64],
        white: f64,
        account: &mut Account,
    ) -> [f64; 3] {
        let level = self.levels[bin];
        if level.is_nan() {
            return [0.0; 3];
        }
        if let Some((colours, wanted)) = &self.colours {
            let wanted = wanted[bin].map(|value| value * colours.scale[reading]);
            let shown = colours.sub_pixels.before(light).show(wanted);
            account.add(wanted, &shown);
            return shown.xyz;
        }
        let backlight = self.luminance(light);
        let wanted = level * white;
        let y = behind_panel(backlight, wanted, self.contrast);
        let transmitted = if backlight > 0.0 { y / backlight } else { 0.0 };
        let mut xyz = xyz_of(self.light, light).map(|value| transmitted * value);
        xyz[1] = y;
        let is_clipped = y.to_bits() != wanted.to_bits();
        account.add([0.0, wanted, 0.0], &panel_colour::Shown { levels: [0.0; 3], xyz, is_clipped });
        xyz
    }

    /// Luminance of each channel.
    fn by_channel(&self, sums: &mut [f64], light: &[f64]) {
        sums.fill(0.0);
        for (part, light) in self.light.iter().zip(light) {
            sums[part.channel] += part.xyz[1] * light;
        }
    }

    /// Light of one path in a bin of a row, of all parts.
    fn one_path(&self, rows: &[RowOfGroups], x: usize) -> f64 {
        let parts = rows.iter().zip(self.light);
        parts.map(|(row, part)| part.xyz[1] * row.one_path[x]).sum()
    }

    /// Standard errors of the backlight and of what is shown in the bins of a row, by sums of
    /// differences of groups and of their squares.
    fn errors(
        &self,
        rows: &[RowOfGroups],
        values: &[Vec<f64>; 2],
        moments: &[Vec<[f64; 2]>; 2],
    ) -> [Vec<f64>; 2] {
        let n = rows[0].count() as f64;
        let error = |k: usize, x: usize| {
            let [sum, squares] = moments[k][x];
            let scatter = ((squares - sum * sum / n).max(0.0) * (n - 1.0) / n).sqrt();
            // Light that no path brought may come all the same.
            let one = match (&self.colours, k) {
                (_, 0) => self.one_path(rows, x),
                (None, _) => self.one_path(rows, x) / self.contrast,
                (Some((colours, _)), _) => {
                    let light: Vec<f64> = rows.iter().map(|row| row.one_path[x]).collect();
                    colours.sub_pixels.before(&light).dark[1]
                }
            };
            with_one_path(Estimate::new(values[k][x], scatter), one).standard_error
        };
        [0, 1].map(|k| (0..values[k].len()).map(|x| error(k, x)).collect())
    }

    /// Adds what a black bin shows with more and with less light from beyond.
    fn add_beyond(
        &self,
        (first, x, groups): (usize, usize, usize),
        light: &[f64],
        white: f64,
        dark: &mut [(Vec<[f64; 3]>, f64)],
    ) {
        for (number, more) in [(groups + 1, 1.0), (groups + 2, -1.0)] {
            let light = self.with_beyond(light, more);
            let xyz = self.shown((first + x, groups), &light, white, &mut Account::default());
            for (zone, part) in &self.parts[0][x] {
                add(&mut dark[*zone].0[number], xyz, *part);
            }
        }
    }

    fn row(&self, y: usize, rows: &[RowOfGroups], white: &[f64]) -> ShownRow {
        let (bins, groups) = (self.frame.bins[0], rows[0].count());
        let totals: Vec<Vec<f64>> = rows.iter().map(RowOfGroups::total).collect();
        let first = y * bins;
        let roles = &self.roles[first..][..bins];
        let whole = |x: usize| totals.iter().map(|total| total[x]).collect::<Vec<f64>>();
        let mut accounts = vec![Account::default(); groups + 1];
        let shown: Vec<[f64; 3]> = (0..bins)
            .map(|x| {
                let at = (first + x, groups);
                self.shown(at, &whole(x), white[groups], &mut accounts[groups])
            })
            .collect();
        let luminance = (0..bins).map(|x| self.luminance(&whole(x)));
        let values = [luminance.collect(), shown.iter().map(|xyz| xyz[1]).collect::<Vec<f64>>()];
        let mut zones = [0, 1].map(|_| vec![vec![0.0; groups + 1]; self.zones[0]]);
        let mut halo = [0, 1].map(|_| vec![[0.0; 3]; groups + 1]);
        let mut dark = vec![(vec![[0.0; 3]; groups + 3], 0.0); self.zones[0]];
        let channels = self.light.iter().map(|part| part.channel + 1).max().unwrap_or(0);
        let mut of_all = vec![vec![0.0; channels]; bins];
        let mut of_one = vec![0.0; channels];
        if self.colours.is_some() {
            for (x, sums) in of_all.iter_mut().enumerate() {
                self.by_channel(sums, &whole(x));
            }
        }
        // Squares of the differences of each channel.
        let mut squares = vec![vec![0.0; channels]; bins];
        // Sums of differences from the reading of all groups, and of their squares.
        let mut moments = [0, 1].map(|_| vec![[0.0; 2]; bins]);
        let mut light = vec![0.0; rows.len()];
        for reading in 0..=groups {
            for x in 0..bins {
                let (both, xyz) = if reading == groups {
                    ([values[0][x], values[1][x]], shown[x])
                } else {
                    light_of(rows, &totals, (x, reading), &mut light);
                    let at = (first + x, reading);
                    let xyz = self.shown(at, &light, white[reading], &mut accounts[reading]);
                    ([self.luminance(&light), xyz[1]], xyz)
                };
                if reading < groups && self.colours.is_some() {
                    self.by_channel(&mut of_one, &light);
                    let pairs = of_one.iter().zip(&of_all[x]);
                    let differences = squares[x].iter_mut().zip(pairs);
                    differences.for_each(|(sum, (one, all))| *sum += (one - all).powi(2));
                }
                for k in 0..2 {
                    let difference = both[k] - values[k][x];
                    moments[k][x][0] += difference;
                    moments[k][x][1] += difference * difference;
                    for (zone, part) in &self.parts[0][x] {
                        zones[k][*zone][reading] += part * both[k];
                    }
                }
                match roles[x] {
                    Role::Black => {
                        add(&mut halo[0][reading], xyz, 1.0);
                        for (zone, part) in &self.parts[0][x] {
                            add(&mut dark[*zone].0[reading], xyz, *part);
                            dark[*zone].1 += if reading == groups { *part } else { 0.0 };
                        }
                    }
                    Role::Bright => add(&mut halo[1][reading], xyz, 1.0),
                    Role::Other => {}
                }
            }
        }
        let n = groups as f64;
        let errors = self.errors(rows, &values, &moments);
        let of_bin = |x: usize| -> Outcome {
            if self.levels[first + x].is_nan() {
                return [0.0; 3];
            }
            let at = (first + x, groups);
            if self.colours.is_some() {
                let error = |sum: &f64| (sum * (n - 1.0) / n).sqrt();
                let errors: Vec<f64> = squares[x].iter().map(error).collect();
                return self.biases(at, &whole(x), &errors, white[groups]);
            }
            let backlight = Estimate::new(values[0][x], errors[0][x]);
            let wanted = self.wanted_y(at, white);
            let of_noise = panel_bias(backlight, wanted, self.contrast);
            self.biases(at, &whole(x), &[], white[groups]).map(|bound| bound + of_noise)
        };
        let biases: Vec<Outcome> = (0..bins).map(of_bin).collect();
        for x in (0..bins).filter(|x| roles[*x] == Role::Black) {
            self.add_beyond((first, x, groups), &whole(x), white[groups], &mut dark);
        }
        let bias = biases.iter().map(|bounds| bounds[0]).collect();
        let colours = self.has_colours().then(|| ColourRow {
            xyz: [(0..bins).map(|x| xyz_of(self.light, &whole(x))).collect(), shown],
            dark,
            accounts,
            bias: [1, 2].map(|k| biases.iter().map(|bounds| bounds[k]).sum()),
            places: self
                .colours
                .iter()
                .flat_map(|(colours, _)| (0..bins).map(|x| colours.sub_pixels.before(&whole(x))))
                .collect(),
        });
        let one_path = (0..bins).map(|x| self.one_path(rows, x)).fold(0.0, f64::max);
        ShownRow { values, errors, bias, zones, halo, one_path, colours }
    }
}

/// Light by parts in a bin of a row, without a group, or of all where `reading` is their number.
fn light_of(
    rows: &[RowOfGroups],
    totals: &[Vec<f64>],
    (x, reading): (usize, usize),
    light: &mut [f64],
) {
    let groups = rows[0].count();
    let rest = groups as f64 / (groups as f64 - 1.0);
    for ((light, total), row) in light.iter_mut().zip(totals).zip(rows) {
        *light =
            if reading == groups { total[x] } else { rest * (total[x] - row.group(reading)[x]) };
    }
}

/// X, Y and Z of `light` by parts.
fn xyz_of(parts: &[Part], light: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    parts.iter().zip(light).for_each(|(part, light)| add(&mut sum, part.xyz, *light));
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use formats::level_image::LevelImage;
    use metrics::gamut::D65;
    use metrics::{chromaticity, gamut};

    use super::super::colour::PictureLight;
    use super::super::panel_colour::SubPixels;

    /// One bin before a light that passes red, green and blue sub-pixels, of whose luminance 1 they
    /// pass 0.07: E[shown] of normal noise against the bound, which is in units behind the panel.
    #[test]
    fn the_bias_of_noise_behind_sub_pixels_is_within_its_bound() {
        let columns = gamut::BT709.to_xyz(D65);
        let behind = [0, 1, 2].map(|s| [0, 1, 2].map(|k| 0.07 * columns[k][s])).to_vec();
        let parts =
            [Part { channel: 0, xyz: chromaticity::xyz_of_xy(D65), behind: behind.clone() }];
        let open = [[behind[0], behind[1], behind[2]]];
        let white = chromaticity::xyz_of_xy(D65).map(|value| 0.07 * value);
        let frame = Frame { bins: [1, 1], bin_mm: [1.0; 2], low_mm: [0.0; 2] };
        // White, a saturated red, black.
        for level in [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0; 3]] {
            let xyz = gamut::apply(&columns, level).map(|value| value as f32);
            let picture = PictureLight { columns: 1, rows: 1, xyz: vec![xyz] };
            let on_panel = PictureOnPanel {
                picture: &picture,
                sub_pixels: SubPixels::of_open(&open, [1e-3; 3]),
                scale: vec![0.07],
                white: vec![white],
            };
            let image = LevelImage { columns: 1, rows: 1, levels: vec![0.0] };
            let pattern = Pattern {
                drives: &[],
                picture: &image,
                contrast: 1000.0,
                colours: Some(&on_panel),
                viewing: None,
                full_light: &[],
            };
            let whole = ([1, 1], [[0.0, 1.0]; 2]);
            let panel = Panel::new(frame, whole, (&parts, 0.0), pattern);
            let noise = 0.03;
            for d in [0.0, 0.5, 1.0, -0.7, 3.0] {
                let exact = 1.0 + d * noise;
                let (mut weight, mut mean, mut bound) = (0.0, [0.0; 3], [0.0; 3]);
                for step in -400..=400 {
                    let z = f64::from(step) * 0.01;
                    let density = (-0.5 * z * z).exp();
                    let light = [exact + z * noise];
                    weight += density;
                    let seen = panel.outcome((0, 0), &light, 1.0);
                    let stated = panel.biases((0, 0), &light, &[noise], 1.0);
                    (0..3).for_each(|k| mean[k] += density * seen[k]);
                    (0..3).for_each(|k| bound[k] += density * stated[k]);
                }
                let seen = panel.outcome((0, 0), &[exact], 1.0);
                for k in 0..3 {
                    let (bias, bound) = ((mean[k] / weight - seen[k]).abs(), bound[k] / weight);
                    assert!(bias <= bound + 1e-4 * noise, "{level:?} {d} {k}: {bias} {bound}");
                    // Nothing behind the panel is off by more than it passes.
                    assert!(bound <= 0.07 * 2.0 * noise, "{level:?} {d} {k}: {bound}");
                }
                if d == 0.0 && level[1] > 0.0 {
                    let bias = seen[0] - mean[0] / weight;
                    assert!((bias - 0.07 * 0.398_942 * noise).abs() < 1e-4 * noise, "{bias}");
                }
            }
            // Light from beyond: a tenth of full drive on black is a tenth of what leaks.
            let beyond = Pattern { full_light: &[1.0], ..pattern };
            let panel = Panel::new(frame, whole, (&parts, 0.1), beyond);
            let [y, ..] = panel.biases((0, 0), &[1.0], &[0.0], 1.0);
            if level.iter().all(|own| own.abs() < f64::MIN_POSITIVE) {
                // Beside the same share of white.
                assert!((y - 2.0 * 0.1 * 0.07e-3).abs() < 1e-9, "{y}");
            } else {
                assert!(y > 1e-3 * level[1], "{y}");
            }
        }
    }
}
