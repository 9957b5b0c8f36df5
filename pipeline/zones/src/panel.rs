// SPDX-License-Identifier: MIT OR Apache-2.0
//! The panel before the backlight: what it shows of a picture, zone by zone and bin by bin.

use metrics::dimming::{behind_panel, panel_bias};
use metrics::hits::with_one_path;
use metrics::{Estimate, JackknifedFigure, without_group};

use super::cells::{Cells, Parts, resampled};
use super::estimates::{add, biased, figure};
use super::map_receiver::Frame;
use super::panel_colour::{Account, LitPixel};
use super::pattern_colours::{ColourSums, worst};
use super::picture::PictureOnPanel;
use super::reference::LightOff;
use super::responses::ChannelLight;
use super::superposition::{Piece, RowOfGroups, rows_of_parts};
use super::{BeyondLight, PatternPicture};

mod veil;

/// What a bin is to the halo.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// None.
    Other,
    /// Black beside bright.
    Black,
    /// Of the largest level.
    Bright,
}

/// What a picture asks for on its panel.
enum Wanted<'a> {
    /// Levels over white, with the contrast of the panel.
    Grey(f64),
    /// X, Y and Z in each bin, on sub-pixels.
    Coloured(&'a PictureOnPanel<'a>, Vec<[f64; 3]>),
}

/// A picture on a panel before zones.
pub(super) struct PanelBeforeZones<'a> {
    frame: Frame,
    zones: [usize; 2],
    /// Zones of every bin along x and y.
    parts: [Vec<Parts>; 2],
    /// Level of each bin from 0 to 1; NaN outside of the panel.
    levels: Vec<f64>,
    roles: Vec<Role>,
    /// Parts of the light.
    light: &'a [ChannelLight],
    wanted: Wanted<'a>,
    /// Light that bins may lack or have too much.
    beyond: BeyondLight,
}

/// What a bin shows: luminance, missing and leaking.
type Outcome = [f64; 3];

/// Readings with all groups of paths, after those without each.
type Readings = Vec<f64>;

/// What a panel shows.
pub(super) struct DisplayedLight {
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
    /// In each bin, of the backlight from beyond alone and behind the panel.
    pub bins: [Vec<f64>; 2],
    /// The same in the mean of each zone.
    pub zones: [Vec<f64>; 2],
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
    pixels: Vec<LitPixel>,
}

impl<'a> PanelBeforeZones<'a> {
    /// The panel of `frame` before `zones` over `area` (lower end and length along x and y, mm) and
    /// these parts of the light, of which bins may lack or have too much what lies beyond the traced
    /// array, which shows a picture; black is that of the halo in or beside bright `halo_zones`.
    pub fn new(
        frame: Frame,
        ([zones, halo_zones], area): ([[usize; 2]; 2], [[f64; 2]; 2]),
        (light, beyond): (&'a [ChannelLight], BeyondLight),
        picture: PatternPicture<'a>,
    ) -> Self {
        let parts = Cells::parts_of_zones(zones, area, &frame);
        let (levels, wanted) = match picture {
            PatternPicture::Grey(image, contrast) => {
                let at = |k: usize| [image.levels[k]];
                let levels = resampled([image.columns, image.rows], at, &frame, area).concat();
                (levels, Wanted::Grey(contrast))
            }
            PatternPicture::Coloured(colours) => {
                let picture = colours.picture;
                let at = |k: usize| picture.xyz[k].map(f64::from);
                let wanted = resampled([picture.columns, picture.rows], at, &frame, area);
                let levels = wanted.iter().map(|xyz| xyz[1]).collect();
                (levels, Wanted::Coloured(colours, wanted))
            }
        };
        let roles = Vec::new();
        let mut panel = Self { frame, zones, parts, levels, roles, light, wanted, beyond };
        panel.roles = panel.roles(halo_zones, &Cells::parts_of_zones(halo_zones, area, &frame));
        panel
    }

    /// The panel with sub-pixels.
    fn colours(&self) -> Option<&PictureOnPanel<'a>> {
        match &self.wanted {
            Wanted::Grey(_) => None,
            Wanted::Coloured(colours, _) => Some(colours),
        }
    }

    /// Numbers of bins on black beside bright and on bright.
    pub fn halo_bins(&self) -> [usize; 2] {
        [Role::Black, Role::Bright].map(|role| self.roles.iter().filter(|r| **r == role).count())
    }

    /// Roles of the bins beside zones, of which each bin holds these `parts`.
    fn roles(&self, zones: [usize; 2], parts: &[Vec<Parts>; 2]) -> Vec<Role> {
        let largest = self.levels.iter().copied().fold(0.0, f64::max);
        let is_bright = |level: f64| level > 0.0 && level >= (1.0 - 1e-9) * largest;
        let of_bin = |k: usize| {
            let bin = self.place(k);
            let zone = |axis: usize| {
                let parts = parts[axis][bin[axis]].iter();
                Some(parts.max_by(|a, b| a.1.total_cmp(&b.1))?.0)
            };
            Some([zone(0)?, zone(1)?])
        };
        let mut bright = vec![false; zones[0] * zones[1]];
        for (k, level) in self.levels.iter().enumerate().filter(|(_, level)| is_bright(**level)) {
            if let Some([i, j]) = of_bin(k).filter(|_| level.is_finite()) {
                bright[j * zones[0] + i] = true;
            }
        }
        let is_near_bright = |[i, j]: [usize; 2]| {
            let about = |k: usize, count: usize| k.saturating_sub(1)..(k + 2).min(count);
            about(j, zones[1]).any(|j| about(i, zones[0]).any(|i| bright[j * zones[0] + i]))
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
    pub fn show(&self, pieces: &[Vec<Piece>], white: &[f64]) -> DisplayedLight {
        let groups = white.len() - 1;
        let found =
            rows_of_parts(self.frame.bins, groups, pieces, |y, rows| self.row(y, rows, white));
        let count = self.zones[0] * self.zones[1];
        let mut sums = [0, 1].map(|_| vec![vec![0.0; groups + 1]; count]);
        let mut areas = vec![0.0; count];
        let mut halo = [0, 1].map(|_| vec![[0.0; 3]; groups + 1]);
        let mut colours =
            self.has_colours().then(|| ColourSums::new(count, groups + 1, self.ends()));
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
                sums.add(row.xyz, row.pixels, (&row.accounts, row.bias));
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
        if let (Some(sums), Wanted::Coloured(on_panel, wanted)) = (&mut colours, &self.wanted) {
            let scale = on_panel.scale[groups];
            sums.white.clone_from(&on_panel.white);
            sums.white_moves_uv = on_panel.white_moves_uv;
            // Beyond the panel nothing is asked for.
            let on_panel = |value: f64| if value.is_nan() { 0.0 } else { value };
            sums.wanted = wanted.iter().map(|xyz| xyz.map(|v| scale * on_panel(v))).collect();
        }
        DisplayedLight { maps, zones, halo, bias, colours }
    }

    /// Luminance that the picture asks for in a bin; 0 outside of the panel.
    fn wanted_y(&self, (bin, reading): (usize, usize), white: &[f64]) -> f64 {
        let scale = self.colours().map_or(white[reading], |colours| colours.scale[reading]);
        let level = self.levels[bin];
        if level.is_nan() { 0.0 } else { level * scale }
    }

    /// Column and row of a bin.
    fn place(&self, bin: usize) -> [usize; 2] {
        [bin % self.frame.bins[0], bin / self.frame.bins[0]]
    }

    /// `light` by parts in a bin with so many times the light that may come from beyond, of one lot or all.
    fn with_beyond(
        &self,
        (bin, light): (usize, &[f64]),
        times: f64,
        lot: Option<usize>,
    ) -> Vec<f64> {
        let place = self.place(bin);
        let more = |((light, part), beyond): ((&f64, &ChannelLight), &LightOff)| {
            let is_changed = lot.is_none_or(|lot| lot == part.lot);
            if is_changed { (light + times * beyond.at(place)).max(0.0) } else { *light }
        };
        light.iter().zip(self.light).zip(&self.beyond.parts).map(more).collect()
    }

    fn lots(&self) -> usize {
        self.light.iter().map(|part| part.lot + 1).max().unwrap_or(0)
    }

    /// Number of [`Self::at_ends`].
    fn ends(&self) -> usize {
        let lots = self.lots();
        2 * if lots > 1 { 1 + lots } else { 1 }
    }

    /// `light` in a bin with more and with less from beyond, of all lots together and, where there are
    /// several, of each ([`worst`]).
    fn at_ends<'l>(&'l self, bin: usize, light: &'l [f64]) -> impl Iterator<Item = Vec<f64>> + 'l {
        let lots = std::iter::once(None).chain((0..self.lots()).map(Some));
        let both = move |lot| [1.0, -1.0].map(|times| self.with_beyond((bin, light), times, lot));
        lots.flat_map(both).take(self.ends())
    }

    /// What a bin shows before `light`.
    fn outcome(&self, at: (usize, usize), light: &[f64], white: f64) -> Outcome {
        let mut account = Account::default();
        let y = self.shown(at, light, white, &mut account)[1];
        [y, account.missing, account.leaking]
    }

    /// Bounds of the bias in what a bin shows before `light`, whose lots have these standard `errors` of
    /// their weights.
    ///
    /// Noise of a lot: half the second difference over two standard errors s. Where the slope
    /// changes by 1 at the distance d s it is s (2 - d) / 2, never less but for 0.01 s than the bias
    /// s (φ(d) - d Φ(-d)) of normal noise, also in the mean over the d that noise gives. Light from
    /// beyond: the largest difference that it makes ([`worst`]), beside its share of white.
    fn biases(&self, at: (usize, usize), light: &[f64], errors: &[f64], white: f64) -> Outcome {
        let middle = self.outcome(at, light, white);
        let mut bounds = [0.0; 3];
        for (lot, error) in errors.iter().enumerate() {
            let of_lot = |part: &ChannelLight| part.lot == lot;
            let pairs = self.light.iter().zip(light).filter(|(part, _)| of_lot(part));
            let sum: f64 = pairs.map(|(part, light)| part.weight() * light).sum();
            if sum <= 0.0 || *error <= 0.0 {
                continue;
            }
            let step = (2.0 * error / sum).min(1.0);
            let ends = [1.0 - step, 1.0 + step].map(|factor| {
                let scaled = self.light.iter().zip(light);
                let scaled = scaled.map(|(part, l)| if of_lot(part) { factor * l } else { *l });
                self.outcome(at, &scaled.collect::<Vec<f64>>(), white)
            });
            (0..3).for_each(|k| {
                bounds[k] += 0.5 * (ends[0][k] + ends[1][k] - 2.0 * middle[k]).abs();
            });
        }
        if self.beyond.of_white > 0.0 {
            let ends: Vec<Outcome> =
                self.at_ends(at.0, light).map(|light| self.outcome(at, &light, white)).collect();
            (0..3).for_each(|k| {
                let changes: Vec<f64> = ends.iter().map(|end| (end[k] - middle[k]).abs()).collect();
                bounds[k] += worst(&changes) + self.beyond.of_white * middle[0];
            });
        }
        bounds
    }

    /// Means over zones and over the bins of the halo of `bins`.
    fn bias(&self, bins: Vec<f64>, areas: &[f64]) -> Bias {
        let (mut zones, mut halo) = ([0, 1].map(|_| vec![0.0; areas.len()]), [0.0; 2]);
        let counts = self.halo_bins().map(|count| count.max(1) as f64);
        let beyond = |bin: usize| -> f64 {
            let place = self.place(bin);
            let parts = self.light.iter().zip(&self.beyond.parts);
            parts.map(|(part, beyond)| part.xyz[1] * beyond.at(place)).sum()
        };
        let bins = [(0..bins.len()).map(beyond).collect(), bins];
        for (k, bias) in bins[1].iter().enumerate() {
            let [x, y] = self.place(k);
            for (j, of_y) in &self.parts[1][y] {
                for (i, of_x) in &self.parts[0][x] {
                    let zone = j * self.zones[0] + i;
                    for (zones, bins) in zones.iter_mut().zip(&bins) {
                        zones[zone] += of_x * of_y * bins[k] / areas[zone];
                    }
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
        self.colours().is_some() || self.light.len() > 1
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
        let contrast = match &self.wanted {
            Wanted::Grey(contrast) => *contrast,
            Wanted::Coloured(colours, wanted) => {
                let wanted = wanted[bin].map(|value| value * colours.scale[reading]);
                let shown = colours.sub_pixels.before(light).show(wanted);
                account.add(wanted[1], shown[1]);
                return shown;
            }
        };
        let backlight = self.luminance(light);
        let wanted = level * white;
        let y = behind_panel(backlight, wanted, contrast);
        let transmitted = if backlight > 0.0 { y / backlight } else { 0.0 };
        let mut xyz = xyz_of(self.light, light).map(|value| transmitted * value);
        xyz[1] = y;
        account.add(wanted, y);
        xyz
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
            let one = match (&self.wanted, k) {
                (_, 0) => self.one_path(rows, x),
                (Wanted::Grey(contrast), _) => self.one_path(rows, x) / contrast,
                (Wanted::Coloured(colours, _), _) => {
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
        for (number, light) in self.at_ends(first + x, light).enumerate() {
            let xyz = self.shown((first + x, groups), &light, white, &mut Account::default());
            for (zone, part) in &self.parts[0][x] {
                add(&mut dark[*zone].0[groups + 1 + number], xyz, *part);
            }
        }
    }

    fn row(&self, y: usize, rows: &[RowOfGroups], white: &[f64]) -> ShownRow {
        let (bins, groups) = (self.frame.bins[0], rows[0].count());
        let totals: Vec<Vec<f64>> = rows.iter().map(RowOfGroups::total).collect();
        let first = y * bins;
        let whole: Vec<Vec<f64>> =
            (0..bins).map(|x| totals.iter().map(|total| total[x]).collect()).collect();
        let mut sums = RowSums::new(self, groups);
        let shown: Vec<[f64; 3]> = (0..bins)
            .map(|x| {
                let account = &mut sums.accounts[groups];
                self.shown((first + x, groups), &whole[x], white[groups], account)
            })
            .collect();
        let luminance = whole.iter().map(|light| self.luminance(light));
        let values = [luminance.collect(), shown.iter().map(|xyz| xyz[1]).collect::<Vec<f64>>()];
        let mut light = vec![0.0; rows.len()];
        for (reading, &white) in white.iter().take(groups).enumerate() {
            for x in 0..bins {
                light_of(rows, &totals, (x, reading), &mut light);
                let account = &mut sums.accounts[reading];
                let xyz = self.shown((first + x, reading), &light, white, account);
                let both = [self.luminance(&light), xyz[1]];
                sums.add_moments(x, [0, 1].map(|k| both[k] - values[k][x]));
                if self.colours().is_some() {
                    self.add_squares(&mut sums.squares[x], (&light, &whole[x]));
                }
                self.add_reading(&mut sums, (first, x, reading), both, xyz);
            }
        }
        for (x, xyz) in shown.iter().enumerate() {
            self.add_reading(&mut sums, (first, x, groups), [values[0][x], values[1][x]], *xyz);
        }
        let errors = self.errors(rows, &values, &sums.moments);
        let n = groups as f64;
        let of_bin = |x: usize| -> Outcome {
            if self.levels[first + x].is_nan() {
                return [0.0; 3];
            }
            let at = (first + x, groups);
            let Wanted::Grey(contrast) = self.wanted else {
                let error = |sum: &f64| (sum * (n - 1.0) / n).sqrt();
                let errors: Vec<f64> = sums.squares[x].iter().map(error).collect();
                return self.biases(at, &whole[x], &errors, white[groups]);
            };
            let backlight = Estimate::new(values[0][x], errors[0][x]);
            let of_noise = panel_bias(backlight, self.wanted_y(at, white), contrast);
            self.biases(at, &whole[x], &[], white[groups]).map(|bound| bound + of_noise)
        };
        let biases: Vec<Outcome> = (0..bins).map(of_bin).collect();
        for x in (0..bins).filter(|x| self.roles[first + x] == Role::Black) {
            self.add_beyond((first, x, groups), &whole[x], white[groups], &mut sums.dark);
        }
        let colours = self.has_colours().then(|| ColourRow {
            xyz: [whole.iter().map(|light| xyz_of(self.light, light)).collect(), shown],
            dark: sums.dark,
            accounts: sums.accounts,
            bias: [1, 2].map(|k| biases.iter().map(|bounds| bounds[k]).sum()),
            pixels: self
                .colours()
                .into_iter()
                .flat_map(|colours| whole.iter().map(|light| colours.sub_pixels.before(light)))
                .collect(),
        });
        let bias = biases.iter().map(|bounds| bounds[0]).collect();
        let one_path = (0..bins).map(|x| self.one_path(rows, x)).fold(0.0, f64::max);
        ShownRow { values, errors, bias, zones: sums.zones, halo: sums.halo, one_path, colours }
    }

    /// Adds the squares of the differences of two lights in each lot.
    fn add_squares(&self, squares: &mut [f64], (one, all): (&[f64], &[f64])) {
        let mut differences = vec![0.0; squares.len()];
        for (part, (one, all)) in self.light.iter().zip(one.iter().zip(all)) {
            differences[part.lot] += part.weight() * (one - all);
        }
        squares.iter_mut().zip(differences).for_each(|(sum, off)| *sum += off * off);
    }

    /// Adds a bin to its zones and to the halo.
    fn add_reading(
        &self,
        sums: &mut RowSums,
        (first, x, reading): (usize, usize, usize),
        both: [f64; 2],
        xyz: [f64; 3],
    ) {
        for (zones, value) in sums.zones.iter_mut().zip(both) {
            for (zone, part) in &self.parts[0][x] {
                zones[*zone][reading] += part * value;
            }
        }
        match self.roles[first + x] {
            Role::Black => {
                add(&mut sums.halo[0][reading], xyz, 1.0);
                for (zone, part) in &self.parts[0][x] {
                    let dark = &mut sums.dark[*zone];
                    add(&mut dark.0[reading], xyz, *part);
                    dark.1 += if reading + 1 == sums.accounts.len() { *part } else { 0.0 };
                }
            }
            Role::Bright => add(&mut sums.halo[1][reading], xyz, 1.0),
            Role::Other => {}
        }
    }
}

/// Sums over the bins of a row, by readings.
struct RowSums {
    zones: [Vec<Readings>; 2],
    halo: [Vec<[f64; 3]>; 2],
    dark: Vec<(Vec<[f64; 3]>, f64)>,
    accounts: Vec<Account>,
    /// In each bin, squares of the differences of each lot from all groups.
    squares: Vec<Vec<f64>>,
    /// In each bin, sums of differences of backlight and of what is shown, and of their squares.
    moments: [Vec<[f64; 2]>; 2],
}

impl RowSums {
    fn new(panel: &PanelBeforeZones, groups: usize) -> Self {
        let (zones, bins) = (panel.zones[0], panel.frame.bins[0]);
        Self {
            zones: [0, 1].map(|_| vec![vec![0.0; groups + 1]; zones]),
            halo: [0, 1].map(|_| vec![[0.0; 3]; groups + 1]),
            dark: vec![(vec![[0.0; 3]; groups + 1 + panel.ends()], 0.0); zones],
            accounts: vec![Account::default(); groups + 1],
            squares: vec![vec![0.0; panel.lots()]; bins],
            moments: [0, 1].map(|_| vec![[0.0; 2]; bins]),
        }
    }

    fn add_moments(&mut self, x: usize, differences: [f64; 2]) {
        for (moments, difference) in self.moments.iter_mut().zip(differences) {
            moments[x][0] += difference;
            moments[x][1] += difference * difference;
        }
    }
}

impl DisplayedLight {
    /// The mean of the light behind the panel over all zones.
    pub fn mean(&self) -> Estimate {
        let zones = &self.zones[1];
        let mean = |read: &dyn Fn(&JackknifedFigure) -> f64| {
            zones.iter().map(read).sum::<f64>() / zones.len() as f64
        };
        let groups = zones.first().map_or(0, |zone| zone.without.len());
        let without = (0..groups).map(|group| mean(&|zone| zone.without[group])).collect();
        let found = JackknifedFigure::new(mean(&|zone| zone.value), without).estimate();
        biased(found, self.bias.zones[1].iter().sum::<f64>() / zones.len() as f64)
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
    for ((light, total), row) in light.iter_mut().zip(totals).zip(rows) {
        *light = match reading {
            all if all == groups => total[x],
            group => without_group(total[x], row.group(group)[x], groups),
        };
    }
}

/// X, Y and Z of `light` by parts.
fn xyz_of(parts: &[ChannelLight], light: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    parts.iter().zip(light).for_each(|(part, light)| add(&mut sum, part.xyz, *light));
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use metrics::gamut::D65;
    use metrics::{chromaticity, gamut};

    use super::super::panel_colour::SubPixels;
    use super::super::picture::PictureLight;

    /// One bin before a light that passes red, green and blue sub-pixels, of whose luminance 1 they
    /// pass 0.07: E[shown] of normal noise against the bound, which is in units behind the panel.
    #[test]
    fn the_bias_of_noise_behind_sub_pixels_is_within_its_bound() {
        let columns = gamut::BT709.to_xyz(D65);
        let behind = [0, 1, 2].map(|s| [0, 1, 2].map(|k| 0.07 * columns[k][s])).to_vec();
        let parts = [ChannelLight {
            channel: 0,
            lot: 0,
            xyz: chromaticity::xyz_of_xy(D65),
            behind: behind.clone(),
        }];
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
                white_moves_uv: 0.0,
            };
            let picture = PatternPicture::Coloured(&on_panel);
            let whole = ([[1, 1]; 2], [[0.0, 1.0]; 2]);
            let none = BeyondLight { parts: vec![LightOff::anywhere(0.0, [1, 1])], of_white: 0.0 };
            let panel = PanelBeforeZones::new(frame, whole, (&parts, none), picture);
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
            let some = BeyondLight { parts: vec![LightOff::anywhere(0.1, [1, 1])], of_white: 0.1 };
            let panel = PanelBeforeZones::new(frame, whole, (&parts, some), picture);
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
