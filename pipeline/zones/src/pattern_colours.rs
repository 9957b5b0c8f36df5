// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours of a pattern: sums over bins and zones, and the figures of halo, missing and leaking light.

use metrics::Estimate;
use metrics::colour_difference::{self, Coordinates, IN_ITP, IN_UV};

use super::colour_estimates::{estimate, grouped, stated};
use super::estimates::{add, biased};
use super::panel_colour::{Account, LitPixel};

/// Sums over the black bins of a zone, and their number.
#[derive(Debug, Clone)]
pub(super) struct DarkSum {
    /// By readings, then with more and with less light from beyond the traced array: of all lots together,
    /// and where there are several of each.
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
    pixels: Vec<LitPixel>,
    /// X, Y and Z that the picture asks for in each bin; empty without sub-pixels.
    pub wanted: Vec<[f64; 3]>,
    /// Readings of white behind the panel; empty without sub-pixels.
    pub white: Vec<[f64; 3]>,
    /// Δu'v' of that white that light from beyond may make.
    pub white_moves_uv: f64,
}

impl ColourSums {
    /// None yet, of so many zones and readings, and of `ends` readings with more or less light from
    /// beyond.
    pub fn new(zones: usize, readings: usize, ends: usize) -> Self {
        let dark = DarkSum { sums: vec![[0.0; 3]; readings + ends], bins: 0.0 };
        Self {
            xyz: [Vec::new(), Vec::new()],
            dark: vec![dark; zones],
            accounts: vec![Account::default(); readings],
            bias: [0.0; 2],
            pixels: Vec::new(),
            wanted: Vec::new(),
            white: Vec::new(),
            white_moves_uv: 0.0,
        }
    }

    /// Adds a row of bins.
    pub fn add(
        &mut self,
        xyz: [Vec<[f64; 3]>; 2],
        pixels: Vec<LitPixel>,
        (accounts, bias): (&[Account], [f64; 2]),
    ) {
        self.xyz.iter_mut().zip(xyz).for_each(|(all, row)| all.extend(row));
        self.pixels.extend(pixels);
        self.accounts.iter_mut().zip(accounts).for_each(|(sum, row)| sum.join(row));
        self.bias.iter_mut().zip(bias).for_each(|(sum, row)| *sum += row);
    }

    /// Figures in the quantity that is `factor` times as large.
    pub fn figures(self, factor: f64) -> PatternColours {
        let wanted = self.accounts[self.accounts.len() - 1].wanted;
        let share = |of: fn(&Account) -> f64, bias: f64| {
            let share = estimate(&self.accounts, |all| of(all) / all.wanted);
            stated(share).map(|share| biased(share, bias / wanted))
        };
        let dark: Vec<&DarkSum> = self.dark.iter().filter(|dark| dark.bins > 0.0).collect();
        let largest = |to: &dyn Fn(usize) -> [f64; 3], to_moves: f64, coordinates: Coordinates| {
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
            let moved = dark.iter().map(|dark| {
                let ends = (count..dark.sums.len()).map(|end| {
                    let [a, b] = [mean(dark, end), mean(dark, count - 1)].map(coordinates);
                    let (a, b) = (a.unwrap_or_default(), b.unwrap_or_default());
                    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
                });
                worst(&ends.collect::<Vec<f64>>())
            });
            Some(biased(found, to_moves + moved.fold(0.0, f64::max)))
        };
        let to_white = |reading: usize| self.white[reading];
        PatternColours {
            missing: share(|all| all.missing, self.bias[0]),
            leaking: share(|all| all.leaking, self.bias[1]),
            halo_itp: largest(&|_| [0.0; 3], 0.0, IN_ITP),
            halo_uv: (!self.white.is_empty())
                .then(|| largest(&to_white, self.white_moves_uv, IN_UV))
                .flatten(),
            wanted: times(self.wanted, factor),
            xyz: self.xyz.map(|xyz| times(xyz, factor)),
            pixels: self.pixels,
        }
    }
}

/// The most that light from beyond changes a figure, whose changes with more and with less of it are
/// these: of all channels together, then of each. The larger of the first and the sum of the others.
pub(super) fn worst(changes: &[f64]) -> f64 {
    let pairs = changes.chunks(2).map(|pair| pair.iter().copied().fold(0.0, f64::max));
    let mut pairs = pairs.collect::<Vec<f64>>().into_iter();
    let together = pairs.next().unwrap_or(0.0);
    together.max(pairs.sum())
}

/// Colours in a quantity that is `factor` times as large.
fn times(all: Vec<[f64; 3]>, factor: f64) -> Vec<[f64; 3]> {
    all.into_iter().map(|xyz| xyz.map(|value| factor * value)).collect()
}

/// Colours of a pattern.
pub struct PatternColours {
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
    pub(super) pixels: Vec<LitPixel>,
}
