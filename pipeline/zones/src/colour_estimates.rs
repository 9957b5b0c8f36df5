// SPDX-License-Identifier: MIT OR Apache-2.0
//! Colours with their errors, from readings of which the last is that of all groups of paths.

use metrics::{Estimate, Grouped, JackknifedFigure, chromaticity};

use super::estimates::biased;

/// A figure of readings.
pub(super) fn estimate<T>(readings: &[T], read: impl Fn(&T) -> f64) -> Estimate {
    let mut values: Vec<f64> = readings.iter().map(read).collect();
    let value = values.pop().unwrap_or(f64::NAN);
    JackknifedFigure::new(value, values).estimate()
}

/// x, y, u' and v'; NaN in the dark.
pub(super) fn coordinates(xyz: [f64; 3]) -> [f64; 4] {
    let [x, y] = chromaticity::xy(xyz).unwrap_or([f64::NAN; 2]);
    let [u, v] = chromaticity::uv(xyz).unwrap_or([f64::NAN; 2]);
    [x, y, u, v]
}

/// An estimate that is a number and has an error.
pub(super) fn stated(estimate: Estimate) -> Option<Estimate> {
    Some(estimate).filter(|of| of.value.is_finite() && of.standard_error.is_finite())
}

/// Estimates of which each is one of [`stated`].
pub(super) fn all_stated<const N: usize>(all: [Estimate; N]) -> Option<[Estimate; N]> {
    all.iter().all(|one| stated(*one).is_some()).then_some(all)
}

/// Groups of paths from readings of colours.
pub(super) fn grouped(mut readings: Vec<Vec<[f64; 3]>>) -> Grouped {
    let all = readings.pop().unwrap_or_default().concat();
    let without: Vec<Vec<f64>> = readings.iter().map(|colours| colours.concat()).collect();
    Grouped::from_readings(&without, &all)
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
    /// The colour of readings of X, Y and Z, whose luminance is `factor` times as large.
    pub(super) fn new(readings: &[[f64; 3]], factor: f64) -> Self {
        let place = |k: usize| estimate(readings, |xyz| coordinates(*xyz)[k]);
        let figure = |k: usize| estimate(readings, |xyz| chromaticity::figures(*xyz)[k]);
        Self {
            chromaticity: all_stated([0, 1, 2, 3].map(place)),
            temperature: all_stated([2, 3].map(figure)),
            luminance: estimate(readings, |xyz| factor * xyz[1]),
        }
    }

    /// The same with these bounds of bias.
    pub(super) fn biased(
        self,
        of_place: [f64; 4],
        of_temperature: [f64; 2],
        of_luminance: f64,
    ) -> Self {
        let places = |all: [Estimate; 4]| [0, 1, 2, 3].map(|k| biased(all[k], of_place[k]));
        let temperature = |all: [Estimate; 2]| [0, 1].map(|k| biased(all[k], of_temperature[k]));
        Self {
            chromaticity: self.chromaticity.map(places),
            temperature: self.temperature.map(temperature),
            luminance: biased(self.luminance, of_luminance),
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
