// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of a backlight of several channels, and of what a panel of sub-pixels shows before it.
//!
//! The light of channel c in one of its wavelengths is a part of its own, with the X, Y and Z that
//! it stands for in the open and behind each sub-pixel ([`Part`]), so that any panel and any levels
//! follow from one set of responses. The white of the panel is that of its mean at full drive, the
//! levels of the channels being 1 or those of a stated white ([`FullDrive::levels`]).

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::json;

use arrays::cache::Cache;
use design::resolved::panel::Panel;
use formats::level_image::{ColourImage, LevelImage};
use metrics::colour_difference::{self, Coordinates, IN_ITP, IN_UV};
use metrics::gamut::{self, Matrix, Primaries, STANDARDS, apply, inverse};
use metrics::transfer::Transfer;
use metrics::{Estimate, Grouped, JackknifedFigure, chromaticity, itp};
use runtime::run_context::RunContext;

use super::estimates::biased;
use super::map_receiver::Frame;
use super::needs::Needs;
use super::panel_colour::{Account, Backlight, PictureColours, Place, SubPixels};
use super::reference::Beyond;
use super::responses::Part;
use super::{Array, ZonedDesign};

/// Most cells of the panel along an axis between which whites are compared.
const MAX_CELLS: usize = 12;

/// Adds `weight` times a colour.
pub(super) fn add(sum: &mut [f64; 3], value: [f64; 3], weight: f64) {
    (0..3).for_each(|k| sum[k] += weight * value[k]);
}

/// A figure of readings, the last of which is that of all groups.
fn estimate<T>(readings: &[T], read: impl Fn(&T) -> f64) -> Estimate {
    let mut values: Vec<f64> = readings.iter().map(read).collect();
    let value = values.pop().unwrap_or(f64::NAN);
    JackknifedFigure::new(value, values).estimate()
}

/// x, y, u' and v'; NaN in the dark.
fn coordinates(xyz: [f64; 3]) -> [f64; 4] {
    let [x, y] = chromaticity::xy(xyz).unwrap_or([f64::NAN; 2]);
    let [u, v] = chromaticity::uv(xyz).unwrap_or([f64::NAN; 2]);
    [x, y, u, v]
}

/// An estimate that is a number and has an error.
fn stated(estimate: Estimate) -> Option<Estimate> {
    Some(estimate).filter(|of| of.value.is_finite() && of.standard_error.is_finite())
}

/// Estimates of which each is one of [`stated`].
fn all_stated<const N: usize>(all: [Estimate; N]) -> Option<[Estimate; N]> {
    all.iter().all(|one| stated(*one).is_some()).then_some(all)
}

/// Groups of paths from readings of colours one after the other, of which the last is that of all
/// groups.
fn grouped(mut readings: Vec<Vec<[f64; 3]>>) -> Grouped {
    let all = readings.pop().unwrap_or_default().concat();
    let without: Vec<Vec<f64>> = readings.iter().map(|colours| colours.concat()).collect();
    Grouped::from_readings(&without, &all)
}

/// Refuses primaries that a panel's white lies outside of.
///
/// # Errors
/// These.
pub fn check_white(primaries: &Primaries, white: [f64; 2]) -> Result<()> {
    let [x, y] = white;
    ensure!(
        primaries.hold(white),
        "--gamut: expected primaries about the white of the panel, {x:.4},{y:.4}, got {}; --white states another white",
        primaries.name
    );
    Ok(())
}

/// X, Y and Z that a picture asks for in each pixel, row after row from the bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct PictureLight {
    /// Pixels along x.
    pub columns: usize,
    /// Pixels along y.
    pub rows: usize,
    /// X, Y and Z over Y of white, or in cd/m² where the transfer states them.
    pub xyz: Vec<[f32; 3]>,
}

impl PictureLight {
    /// The light of `image` on a panel of this white (x, y).
    ///
    /// # Errors
    /// A white outside the primaries.
    pub fn new(
        image: &ColourImage,
        (primaries, transfer): (&Primaries, Transfer),
        white: [f64; 2],
    ) -> Result<Self> {
        check_white(primaries, white)?;
        let level = |level: u16| transfer.light(f64::from(level) / 65_535.0);
        let light: Vec<f64> = (0..=u16::MAX).map(level).collect();
        let peak = transfer.peak_cd_m2().unwrap_or(1.0);
        let colours = PictureColours::new(primaries, white, Transfer::Linear, peak);
        let one = |levels: &[u16; 3]| {
            let light = levels.map(|level| light[usize::from(level)]);
            colours.xyz(light).map(|value| value as f32)
        };
        let xyz = image.levels.par_iter().map(one).collect();
        Ok(Self { columns: image.columns, rows: image.rows, xyz })
    }
}

impl PictureLight {
    /// Levels as light, in place of X, Y and Z.
    pub fn grey(image: &LevelImage) -> Self {
        let xyz = image.levels.iter().map(|level| [*level as f32; 3]).collect();
        Self { columns: image.columns, rows: image.rows, xyz }
    }
}

/// A picture on a panel of sub-pixels.
pub struct PictureOnPanel<'a> {
    /// What it asks for.
    pub picture: &'a PictureLight,
    /// The panel, before parts of the light.
    pub sub_pixels: SubPixels,
    /// Factor from the picture to the numbers of the responses, by readings.
    pub scale: Vec<f64>,
    /// Readings of X, Y and Z of white behind the panel, in the numbers of the responses.
    pub white: Vec<[f64; 3]>,
}

/// Sums over the black bins of a zone, by readings and then with more and with less light from beyond
/// the traced array, and their number.
#[derive(Debug, Clone)]
pub(super) struct DarkSum {
    sums: Vec<[f64; 3]>,
    bins: f64,
}

impl DarkSum {
    /// Adds a part of a row.
    pub fn add(&mut self, (sums, bins): &(Vec<[f64; 3]>, f64), part: f64) {
        self.sums.iter_mut().zip(sums).for_each(|(sum, value)| add(sum, *value, part));
        self.bins += part * bins;
    }
}

/// Sums of colours of a pattern, in the numbers of the responses.
pub(super) struct ColourSums {
    xyz: [Vec<[f64; 3]>; 2],
    /// Of each zone.
    pub dark: Vec<DarkSum>,
    accounts: Vec<Account>,
    /// Bounds of the bias in what is missing and leaks.
    bias: [f64; 2],
    places: Vec<Place>,
    /// X, Y and Z that the picture asks for in each bin; empty without sub-pixels.
    pub wanted: Vec<[f64; 3]>,
    /// Readings of white behind the panel; empty without sub-pixels.
    pub white: Vec<[f64; 3]>,
}

impl ColourSums {
    /// None yet, of so many zones and readings.
    pub fn new(zones: usize, readings: usize) -> Self {
        let dark = DarkSum { sums: vec![[0.0; 3]; readings + 2], bins: 0.0 };
        Self {
            xyz: [Vec::new(), Vec::new()],
            dark: vec![dark; zones],
            accounts: vec![Account::default(); readings],
            bias: [0.0; 2],
            places: Vec::new(),
            wanted: Vec::new(),
            white: Vec::new(),
        }
    }

    /// Adds a row of bins.
    pub fn add(
        &mut self,
        xyz: [Vec<[f64; 3]>; 2],
        places: Vec<Place>,
        (accounts, bias): (&[Account], [f64; 2]),
    ) {
        self.xyz.iter_mut().zip(xyz).for_each(|(all, row)| all.extend(row));
        self.places.extend(places);
        self.accounts.iter_mut().zip(accounts).for_each(|(sum, row)| sum.join(row));
        self.bias.iter_mut().zip(bias).for_each(|(sum, row)| *sum += row);
    }

    /// Figures in the quantity that is `factor` times as large.
    pub fn figures(self, factor: f64) -> ColourFigures {
        let wanted = self.accounts[self.accounts.len() - 1].wanted;
        let share = |of: fn(&Account) -> f64, bias: f64| {
            let share = estimate(&self.accounts, |all| of(all) / all.wanted);
            stated(share).map(|share| biased(share, bias / wanted))
        };
        let dark: Vec<&DarkSum> = self.dark.iter().filter(|dark| dark.bins > 0.0).collect();
        let largest = |to: &dyn Fn(usize) -> [f64; 3], coordinates: Coordinates| {
            let mean = |dark: &&DarkSum, reading: usize| {
                dark.sums[reading].map(|sum| factor * sum / dark.bins)
            };
            let points = |reading: usize| {
                dark.iter().map(|dark| mean(dark, reading)).chain([to(reading)]).collect()
            };
            let count = self.accounts.len();
            let readings = (0..count).map(points).collect();
            let found = colour_difference::from_last(&grouped(readings), coordinates)?;
            // As far as light from beyond moves any of them.
            let moved = dark.iter().flat_map(|dark| {
                [count, count + 1].map(|end| {
                    let [a, b] = [mean(dark, end), mean(dark, count - 1)].map(coordinates);
                    let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
                    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
                })
            });
            Some(biased(found, moved.fold(0.0, f64::max)))
        };
        let to_white = |reading: usize| self.white[reading];
        ColourFigures {
            missing: share(|all| all.missing, self.bias[0]),
            leaking: share(|all| all.leaking, self.bias[1]),
            halo_itp: largest(&|_| [0.0; 3], IN_ITP),
            halo_uv: (!self.white.is_empty()).then(|| largest(&to_white, IN_UV)).flatten(),
            wanted: times(self.wanted, factor),
            xyz: self.xyz.map(|xyz| times(xyz, factor)),
            places: self.places,
        }
    }
}

/// Colours in a quantity that is `factor` times as large.
fn times(all: Vec<[f64; 3]>, factor: f64) -> Vec<[f64; 3]> {
    all.into_iter().map(|xyz| xyz.map(|value| factor * value)).collect()
}

/// Colours of a pattern.
pub struct ColourFigures {
    /// Luminance that the picture asks for and the panel does not show, over all that it asks for;
    /// `None` where it asks for none.
    pub missing: Option<Estimate>,
    /// Luminance that it shows beyond what is asked for, likewise.
    pub leaking: Option<Estimate>,
    /// Largest ΔE_ITP from black of the black of a zone beside bright; `None` without any.
    pub halo_itp: Option<Estimate>,
    /// Largest Δu'v' of the same from the white of the panel; `None` without sub-pixels too.
    pub halo_uv: Option<Estimate>,
    /// X, Y and Z that the picture asks for in each bin; empty without sub-pixels.
    pub wanted: Vec<[f64; 3]>,
    /// X, Y and Z of the backlight and behind the panel in each bin.
    pub xyz: [Vec<[f64; 3]>; 2],
    /// The panel before each bin; empty without sub-pixels.
    places: Vec<Place>,
}

/// A colour with its errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColourEstimate {
    /// x, y, u' and v'; `None` in the dark.
    pub chromaticity: Option<[Estimate; 4]>,
    /// Correlated colour temperature, K, and Duv, where they are stated.
    pub temperature: Option<[Estimate; 2]>,
    /// Y.
    pub luminance: Estimate,
}

impl ColourEstimate {
    fn new(readings: &[[f64; 3]], factor: f64) -> Self {
        let at = |k: usize| estimate(readings, |xyz| coordinates(*xyz)[k]);
        let of = |k: usize| estimate(readings, |xyz| chromaticity::figures(*xyz)[k]);
        Self {
            chromaticity: all_stated([0, 1, 2, 3].map(at)),
            temperature: all_stated([of(2), of(3)]),
            luminance: estimate(readings, |xyz| factor * xyz[1]),
        }
    }
}

/// Area and coverage of a standard's gamut in x, y and in u', v'.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GamutEstimate {
    /// Name of the standard.
    pub standard: &'static str,
    /// Area and coverage in x, y, then in u', v'.
    pub shares: [[Estimate; 2]; 2],
}

/// The panel before all channels at full drive.
pub struct FullDrive {
    /// Readings of the mean of each part over each cell of the panel.
    cells: Vec<Vec<Vec<f64>>>,
    /// The same over the panel.
    means: Vec<Vec<f64>>,
    parts: Vec<Part>,
    sub_pixels: Option<[f64; 3]>,
    factor: f64,
    /// Share of the light of any channel that any place may lack or have too much.
    beyond: f64,
}

impl ZonedDesign<'_> {
    /// The panel before channels whose light comes as it is emitted.
    pub fn emitted_drive(&self, contrast: f64) -> FullDrive {
        let parts = self.parts.clone().unwrap_or_else(Part::whole);
        let means = vec![vec![1.0; 3]; parts.len()];
        let sub_pixels = closed(self.design.panel.as_ref(), contrast);
        FullDrive { cells: Vec::new(), means, parts, sub_pixels, factor: 1.0, beyond: 0.0 }
    }
}

/// What each sub-pixel passes closed, over open; `None` without sub-pixels.
fn closed(panel: Option<&Panel>, contrast: f64) -> Option<[f64; 3]> {
    let panel = panel.filter(|panel| !panel.sub_pixels.is_empty())?;
    Some([0, 1, 2].map(|s| panel.sub_pixels[s].black.unwrap_or(1.0 / contrast)))
}

impl Array<'_> {
    /// Means over the panel at full drive, from the cache or computed.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn full_drive_of(
        &self,
        panel: Option<&Panel>,
        contrast: f64,
        (cache, context): (&Cache, RunContext),
    ) -> Result<FullDrive> {
        let of = json!({"means of": self.parts.len(), "cells of panel": MAX_CELLS});
        let beyond: Option<Beyond> =
            self.kept(&json!("beyond"), cache, context, || self.beyond())?;
        let count = self.frame.bins.map(|bins| bins.min(MAX_CELLS));
        let cells: Vec<Vec<Vec<f64>>> =
            self.kept(&of, cache, context, || self.means_of_parts(count))?;
        // Cells are equal.
        let mut means = vec![vec![0.0; cells[0][0].len()]; self.parts.len()];
        for cell in &cells {
            let sums = means.iter_mut().flatten().zip(cell.iter().flatten());
            sums.for_each(|(sum, value)| *sum += value / cells.len() as f64);
        }
        let sub_pixels = closed(panel, contrast);
        Ok(FullDrive {
            cells,
            means,
            parts: self.parts.clone(),
            sub_pixels,
            factor: self.receiver.factor(),
            beyond: beyond.as_ref().map_or(0.0, Beyond::bound),
        })
    }

    /// Sets the levels of the channels at full drive.
    pub fn set(&mut self, full: &FullDrive) {
        self.parts.clone_from(&full.parts);
    }
}

impl FullDrive {
    /// True if the panel has sub-pixels.
    pub fn has_sub_pixels(&self) -> bool {
        self.sub_pixels.is_some()
    }

    /// The panel before parts of the light; `None` without sub-pixels.
    pub fn panel(&self) -> Option<SubPixels> {
        let closed = self.sub_pixels?;
        let open = self.parts.iter().map(|part| [0, 1, 2].map(|s| part.behind[s]));
        Some(SubPixels::of_open(&open.collect::<Vec<Matrix>>(), closed))
    }

    /// X, Y and Z that light of these means shows on the open panel, or in the open without
    /// sub-pixels, of the parts that are `lit`.
    fn open(&self, means: &[Vec<f64>], reading: usize, lit: impl Fn(&Part) -> bool) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (part, means) in self.parts.iter().zip(means).filter(|(part, _)| lit(part)) {
            let open = if self.has_sub_pixels() { &part.behind[..] } else { &[part.xyz] };
            for xyz in open {
                add(&mut sum, *xyz, means[reading]);
            }
        }
        sum
    }

    /// The same of one channel, as a mean over the panel.
    fn channel(&self, channel: usize, reading: usize) -> [f64; 3] {
        self.open(&self.means, reading, |part| part.channel == channel)
    }

    fn readings(&self) -> std::ops::Range<usize> {
        0..self.means[0].len()
    }

    /// Readings of X, Y and Z of white, in the numbers of the responses.
    fn white(&self) -> Vec<[f64; 3]> {
        self.readings().map(|reading| self.open(&self.means, reading, |_| true)).collect()
    }

    /// The largest Δu'v' of white between any two cells of a twelfth of the panel's sides, or of bins
    /// that are larger.
    pub fn white_difference(&self) -> Option<Estimate> {
        let of = |reading: usize| {
            self.cells.iter().map(|cell| self.open(cell, reading, |_| true)).collect()
        };
        let found = colour_difference::estimate(&grouped(self.readings().map(of).collect()))?;
        let moved = [2, 3].map(|k| self.moved(|white| coordinates(white)[k]));
        Some(biased(found, 2.0 * moved[0].hypot(moved[1])))
    }

    /// ΔE_ITP from black of the black at full drive; `None` without sub-pixels.
    pub fn black_itp(&self) -> Option<Estimate> {
        let panel = self.panel()?;
        let dark = |reading: usize| {
            let light: Vec<f64> = self.means.iter().map(|means| means[reading]).collect();
            panel.before(&light).dark.map(|value| self.factor * value)
        };
        let points = self.readings().map(|reading| vec![dark(reading), [0.0; 3]]).collect();
        let found = colour_difference::from_last(&grouped(points), IN_ITP)?;
        let black = dark(self.means[0].len() - 1);
        let more = black.map(|value| (1.0 + self.beyond) * value);
        Some(biased(found, itp::difference(more, black)))
    }

    /// Grey levels as light on this panel, whose white is that of full drive.
    pub fn greys(&self, image: &LevelImage) -> PictureLight {
        let white = chromaticity::xyz_of_xy(self.white_xy());
        let of = |level: &f64| white.map(|value| (level * value) as f32);
        let xyz = image.levels.iter().map(of).collect();
        PictureLight { columns: image.columns, rows: image.rows, xyz }
    }

    /// Mean of each part of the light over the panel.
    pub fn light(&self) -> Vec<f64> {
        self.means.iter().map(|means| means[means.len() - 1]).collect()
    }

    /// How far light from beyond may move a figure of white: the sum of what it does in each channel.
    fn moved(&self, figure: impl Fn([f64; 3]) -> f64) -> f64 {
        let last = self.means[0].len() - 1;
        let white = self.open(&self.means, last, |_| true);
        let channels = self.parts.iter().map(|part| part.channel + 1).max().unwrap_or(0);
        let of_channel = |channel: usize| {
            let mut more = white;
            add(&mut more, self.channel(channel, last), self.beyond);
            (figure(more) - figure(white)).abs()
        };
        (0..channels).map(of_channel).sum()
    }

    /// Lowers the channels, named so, to the levels that give `white` (x, y) with the most light; the
    /// levels, of which the largest is 1.
    ///
    /// # Errors
    /// Other than three channels, channels of colours on one line, a white outside their gamut.
    pub fn levels(&mut self, white: [f64; 2], names: &[&str]) -> Result<Vec<f64>> {
        let [x, y] = white;
        ensure!(
            names.len() == 3,
            "--white: expected a design with three channels, got {}: {}",
            names.len(),
            names.join(", ")
        );
        self.check_visible("--white", names)?;
        let last = self.means[0].len() - 1;
        let columns = [0, 1, 2].map(|channel| self.channel(channel, last));
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
        let levels = levels.map(|level| level.max(0.0) / largest);
        for part in &mut self.parts {
            let level = levels[part.channel];
            let all = std::iter::once(&mut part.xyz).chain(&mut part.behind);
            all.flatten().for_each(|value| *value *= level);
        }
        Ok(levels.to_vec())
    }

    /// Refuses `option` before a channel without visible light.
    fn check_visible(&self, option: &str, names: &[&str]) -> Result<()> {
        let last = self.means[0].len() - 1;
        let dark = (0..names.len()).find(|channel| self.channel(*channel, last)[1] <= 0.0);
        let dark = dark.map(|channel| names[channel]);
        ensure!(
            dark.is_none(),
            "{option}: expected visible light of each channel, got none of {:?}",
            dark.unwrap_or_default()
        );
        Ok(())
    }

    /// x and y of white.
    pub fn white_xy(&self) -> [f64; 2] {
        self.white().last().and_then(|white| chromaticity::xy(*white)).unwrap_or_default()
    }

    /// The picture before this panel; `None` without sub-pixels. `transfer` says whether it is of
    /// absolute luminance.
    pub fn show<'a>(
        &self,
        picture: &'a PictureLight,
        transfer: Transfer,
    ) -> Option<PictureOnPanel<'a>> {
        let white = self.white();
        let absolute = transfer.peak_cd_m2().map(|_| 1.0 / self.factor);
        Some(PictureOnPanel {
            picture,
            sub_pixels: self.panel()?,
            scale: white.iter().map(|white| absolute.unwrap_or(white[1])).collect(),
            white,
        })
    }

    /// Levels of channels, named so, that pixels of these primaries and transfer need.
    ///
    /// # Errors
    /// Channels of colours on one line.
    pub fn needs(
        &self,
        primaries: &Primaries,
        transfer: Transfer,
        names: &[&str],
    ) -> Result<Needs> {
        let last = self.means[0].len() - 1;
        // Pictures of absolute luminance are in cd/m².
        let white_y = self.white()[last][1];
        let y = if transfer.peak_cd_m2().is_some() { 1.0 / self.factor } else { white_y };
        let by_channel = names.len() == 3 && self.has_sub_pixels();
        if by_channel {
            self.check_visible("--levels", names)?;
        }
        let rows = if by_channel {
            let columns = [0, 1, 2].map(|channel| self.channel(channel, last));
            [0, 1, 2].map(|k| columns.map(|column| column[k] / y))
        } else {
            primaries.to_xyz(self.white_xy()).map(|row| row.map(|value| value * white_y / y))
        };
        let matrix = inverse(&rows)
            .context("--levels: expected channels of three colours, got some on one line")?;
        Ok(Needs { matrix, by_channel })
    }

    /// Colour of white behind the panel.
    pub fn white_figures(&self) -> ColourEstimate {
        let found = ColourEstimate::new(&self.white(), self.factor);
        let moved = |k: usize| self.moved(|white| coordinates(white)[k]);
        let bias = [0, 1, 2, 3].map(moved);
        let of_temperature = [2, 3].map(|k| self.moved(|white| chromaticity::figures(white)[k]));
        ColourEstimate {
            chromaticity: found
                .chromaticity
                .map(|all| [0, 1, 2, 3].map(|k| biased(all[k], bias[k]))),
            temperature: found
                .temperature
                .map(|all| [0, 1].map(|k| biased(all[k], of_temperature[k]))),
            luminance: biased(found.luminance, self.factor * self.moved(|white| white[1])),
        }
    }

    /// Colour of a channel alone on the open panel.
    pub fn channel_figures(&self, channel: usize) -> ColourEstimate {
        let readings = 0..self.means[0].len();
        let readings: Vec<_> = readings.map(|reading| self.channel(channel, reading)).collect();
        let found = ColourEstimate::new(&readings, self.factor);
        let luminance = biased(found.luminance, self.beyond * found.luminance.value);
        ColourEstimate { luminance, ..found }
    }

    /// Gamut of the primaries as displayed at full drive, against each standard.
    pub fn gamut(&self) -> Vec<GamutEstimate> {
        let Some(panel) = self.panel() else { return Vec::new() };
        let of = |reading: usize| {
            let light: Vec<f64> = self.means.iter().map(|means| means[reading]).collect();
            panel.before(&light).primaries().unwrap_or([[f64::NAN; 2]; 3])
        };
        let primaries: Vec<_> = (0..self.means[0].len()).map(of).collect();
        let whole = primaries[primaries.len() - 1];
        let channels = self.parts.iter().map(|part| part.channel + 1).max().unwrap_or(0);
        let more = |channel: usize| {
            let factor = |part: &Part| {
                if part.channel == channel { 1.0 + self.beyond } else { 1.0 }
            };
            let light = self.parts.iter().zip(self.light());
            let light: Vec<f64> = light.map(|(part, light)| factor(part) * light).collect();
            panel.before(&light).primaries().unwrap_or(whole)
        };
        let moved: Vec<_> = (0..channels).map(more).collect();
        let of_standard = |standard: &Primaries| {
            let read = |plane: usize, of: fn(&gamut::Shares) -> f64| {
                let read = |xy: &[[f64; 2]; 3]| of(&gamut::shares(*xy, standard)[plane]);
                let off = moved.iter().map(|xy| (read(xy) - read(&whole)).abs());
                biased(estimate(&primaries, read), off.sum())
            };
            let shares = [0, 1].map(|k| [read(k, |all| all.area), read(k, |all| all.coverage)]);
            GamutEstimate { standard: standard.name, shares }
        };
        let all = STANDARDS.iter().map(of_standard);
        let is_stated = |of: &GamutEstimate| of.shares.iter().all(|s| all_stated(*s).is_some());
        all.filter(is_stated).collect()
    }
}

/// What a panel shows, pixel by pixel from the top, as sRGB of 8 bits in which the panel's white is
/// white: red, green and blue of light that sRGB does not reach are cut off.
pub fn painted(
    shown: &ColourFigures,
    (frame, area): (&Frame, [[f64; 2]; 2]),
    on_panel: &PictureOnPanel,
    white: [f64; 2],
) -> Vec<u8> {
    /// Steps of the table of levels.
    const STEPS: usize = 65_535;
    let within = [0, 1].map(|k| frame.middles_within(k, area[k]));
    let [columns, rows] = within.clone().map(|range| range.len());
    let row = |y: usize| &shown.places[y * frame.bins[0]..][within[0].clone()];
    let places = within[1].clone().flat_map(row).copied().collect();
    let scale = on_panel.scale[on_panel.scale.len() - 1];
    let picture = on_panel.picture;
    let wanted = |i: usize, j: usize| {
        picture.xyz[j * picture.columns + i].map(|value| scale * f64::from(value))
    };
    let white_y = on_panel.white[on_panel.white.len() - 1][1];
    let to_rgb = inverse(&gamut::BT709.to_xyz(white)).unwrap_or_default();
    let to_rgb = to_rgb.map(|row| row.map(|value| value / white_y));
    let level = |k: usize| (255.0 * Transfer::Srgb.level(k as f64 / STEPS as f64)).round() as u8;
    let table: Vec<u8> = (0..=STEPS).map(level).collect();
    let encoded = |light: f64| table[(light.clamp(0.0, 1.0) * STEPS as f64).round() as usize];
    let in_bins = [0, 1].map(|k| {
        let [low, length] = area[k];
        let first = frame.low_mm[k] + within[k].start as f64 * frame.bin_mm[k];
        [(low - first) / frame.bin_mm[k], length / frame.bin_mm[k]]
    });
    let backlight = Backlight::new([columns, rows], in_bins, places);
    let rows = backlight.show([picture.columns, picture.rows], wanted, |_, row| {
        row.iter()
            .flat_map(|(_, shown)| apply(&to_rgb, shown.xyz).map(encoded))
            .collect::<Vec<u8>>()
    });
    rows.into_iter().rev().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Channels of lights at these wavelengths, alike all over the panel in 17 readings, of which
    /// any place may lack a tenth.
    fn full(beyond: f64) -> FullDrive {
        let nm = [630.0, 530.0, 460.0];
        let part = |channel: usize| {
            let xyz = metrics::colour_matching::xyz(nm[channel]);
            let dark = xyz.map(|value| 0.01 * value);
            let behind = [0, 1, 2].map(|s| if s == channel { xyz } else { dark }).to_vec();
            Part { channel, xyz, behind }
        };
        let means = vec![vec![1.0; 17]; 3];
        FullDrive {
            cells: vec![means.clone(); 2],
            means,
            parts: [0, 1, 2].map(part).to_vec(),
            sub_pixels: Some([1e-3; 3]),
            factor: 2.0,
            beyond,
        }
    }

    /// White, its largest difference, gamut and black against channels that are changed by hand.
    #[test]
    fn light_beyond_the_array_is_part_of_the_errors_of_white() {
        let (exact, found) = (full(0.0), full(0.1));
        let white = found.white_figures();
        let luminance = 2.0 * exact.white()[2][1];
        assert!((white.luminance.value - luminance).abs() < 1e-12 * luminance);
        let bound = white.luminance.bias_bound.expect("a bound");
        assert!((bound - 0.1 * luminance).abs() < 1e-9 * luminance, "{bound}");
        assert_eq!(exact.white_figures().luminance.bias_bound, None);
        let bounds = white.chromaticity.expect("lit").map(|of| of.bias_bound.expect("a bound"));
        let start = coordinates(exact.white()[2]);
        let mut worst = [0.0f64; 4];
        for changed in 0..8 {
            let mut sum = [0.0; 3];
            for channel in 0..3 {
                let factor = if changed >> channel & 1 == 1 { 1.1 } else { 1.0 };
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
        assert!(difference.bias_bound.expect("a bound") >= 2.0 * worst[2].hypot(worst[3]) * 0.9);
        let gamut = found.gamut();
        let mut shares = gamut.iter().flat_map(|of| of.shares.iter().flatten());
        assert!(shares.any(|share| share.bias_bound.is_some()), "no bound");
        // One thousandth of white leaks: its own difference from no light.
        let black = exact.black_itp().expect("sub-pixels");
        let leak = exact.white()[2].map(|value| 2e-3 * value);
        assert!((black.value - itp::difference(leak, [0.0; 3])).abs() < 1e-9 * black.value);
    }

    #[test]
    fn dark_channels_and_whites_beyond_the_picture_are_named() {
        let names = ["red", "green", "infrared"];
        let mut dark = full(0.0);
        dark.parts[2].behind = vec![[0.0; 3]; 3];
        for error in [
            dark.levels([0.3127, 0.3290], &names).expect_err("dark"),
            dark.needs(&gamut::BT709, Transfer::Srgb, &names).expect_err("dark"),
        ] {
            let words = error.to_string();
            assert!(
                words.contains("expected visible light of each channel, got none of \"infrared\"")
            );
        }
        assert!(dark.channel_figures(2).chromaticity.is_none());
        assert!(full(0.0).channel_figures(2).chromaticity.is_some());
        let image = ColourImage::grey(&LevelImage { columns: 1, rows: 1, levels: vec![1.0] });
        let of = |white| PictureLight::new(&image, (&gamut::BT709, Transfer::Srgb), white);
        let error = of([0.2, 0.33]).expect_err("beyond").to_string();
        assert!(error.contains("got BT.709"), "{error}");
        let light = of(gamut::D65).expect("within").xyz[0];
        assert!((light[1] - 1.0).abs() < 1e-6 && light.iter().all(|value| *value > 0.0));
    }
}
