// SPDX-License-Identifier: MIT OR Apache-2.0
//! Spectra of sources: radiant power over the wavelength in, wavelengths to compute at and their
//! weights out.
//!
//! A far field, a map or a ledger for a whole spectrum is ∫ f(λ) w(λ) dλ / ∫ w(λ) dλ, where f holds
//! for light of one wavelength and 1 W, and w is the spectral power P (radiometric) or P V
//! (photometric, [`metrics::photopic`]). A few wavelengths stand for a spectrum: f is computed there,
//! interpolated linearly between, constant beyond, and the integral of that over w is a sum with
//! positive weights. So are those over X, Y and Z. Wavelengths are dense where these are
//! (`density`), nested from one number to the next ([`quadrature`]). Spectra of lines need none.

mod density;
pub mod lights;
pub mod quadrature;
pub mod rays;
mod shares;

use std::fmt::Display;

use density::Density;
use quadrature::places;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use metrics::kinds::Weighting;
use metrics::plural::count;

/// Number of wavelengths of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// As many as it takes for the figures to change by no more than this from one rule to the
    /// next: fractions as they are, angles in hundreds of degrees.
    Tolerance(f64),
    /// This number, one of [`quadrature::COUNTS`].
    Samples(usize),
}

/// Radiant power over the wavelength, in any unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum SpectralPower {
    /// A blue die and its phosphor: two Gaussians, each cut off at three standard deviations.
    WhiteLed(WhiteLed),
    /// Power at wavelengths, linear between them, none beyond.
    Table {
        /// Wavelengths, ascending, at least two, nm.
        wavelength_nm: Vec<f64>,
        /// Power per nm.
        power: Vec<f64>,
    },
    /// Single wavelengths.
    Lines {
        /// Wavelengths, ascending, nm.
        wavelength_nm: Vec<f64>,
        /// Power of each.
        power: Vec<f64>,
    },
}

/// Keys of a white LED.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WhiteLed {
    /// Peak of the blue die, nm.
    pub blue_nm: f64,
    /// Full width of that peak at half maximum, nm; at least 0.1.
    pub blue_fwhm_nm: f64,
    /// Peak of the phosphor, nm.
    pub phosphor_nm: f64,
    /// Full width of that peak at half maximum, nm; at least 0.1.
    pub phosphor_fwhm_nm: f64,
    /// Share of the radiant power in the die's peak, 0 to 1.
    pub blue_part: f64,
}

/// Why there is no such spectrum.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key} = {got}: expected {expected}")]
pub struct SpectrumError {
    /// Key of the design file under `[light.spectrum]`.
    pub key: &'static str,
    /// The value found.
    pub got: String,
    /// Allowed values.
    pub expected: String,
}

impl SpectrumError {
    fn new(key: &'static str, got: impl Display, expected: impl Display) -> Self {
        Self { key, got: format!("{got}"), expected: format!("{expected}") }
    }
}

/// A checked spectrum.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spectrum {
    /// Distribution of the power.
    pub source: SpectralPower,
    /// Weighting of far fields, maps and figures.
    pub weighting: Weighting,
    /// Sampling; `None` for lines.
    pub sampling: Option<Sampling>,
    /// Lumens per watt of radiant power; V counts as 0 beyond its table.
    pub luminous_efficacy_lm_per_w: f64,
    /// First and last wavelength with power, nm.
    pub range_nm: [f64; 2],
}

/// Wavelengths of use, nm.
pub const WAVELENGTHS_NM: [f64; 2] = [10.0, 100_000.0];
/// Slices of equal power into which a spectrum is cut to be shared by wavelengths.
const SLICES: usize = 4096;
/// Largest power of a row, and least of the largest: sums and products of them are numbers.
const MAX_POWER: f64 = 1e30;
/// Tolerances of use.
const TOLERANCES: [f64; 2] = [1e-6, 1.0];
/// Wavelengths chosen by quantiles are rounded to this many to a nanometre, which no figure sees:
/// the same tables then serve spectra that hardly differ, and every machine.
const PER_NM: f64 = 1000.0;

impl Spectrum {
    /// Checks a spectrum.
    ///
    /// # Errors
    /// Wavelengths out of range or out of order, negative power or none at all, widths or shares
    /// out of range, sampling of lines, a photometric spectrum with wavelengths beyond V(λ).
    pub fn new(
        source: SpectralPower,
        weighting: Weighting,
        sampling: Option<Sampling>,
    ) -> Result<Self, SpectrumError> {
        check_source(&source)?;
        check_sampled(&source, sampling)?;
        let photometric = weighting == Weighting::Photometric;
        let spectrum = Self {
            luminous_efficacy_lm_per_w: efficacy(&source),
            range_nm: range_nm(&source),
            source,
            weighting,
            sampling,
        };
        let [low, high] = spectrum.range_nm;
        let [first, last] = metrics::colour_matching::range_nm();
        if photometric && (low < first || high > last) {
            return Err(SpectrumError::new(
                "weighting",
                format!("photometric for power from {low:.1} to {high:.1} nm"),
                format!("power from {first} to {last} nm only, where V(lambda) is given"),
            ));
        }
        Ok(spectrum)
    }

    /// Light of one wavelength.
    ///
    /// # Errors
    /// A wavelength out of range, or one beyond V(λ) for photometric weighting.
    pub fn line(wavelength_nm: f64, weighting: Weighting) -> Result<Self, SpectrumError> {
        let source = SpectralPower::Lines { wavelength_nm: vec![wavelength_nm], power: vec![1.0] };
        Self::new(source, weighting, None)
    }

    /// The same weighted by radiant power.
    #[must_use]
    pub fn radiometric(&self) -> Self {
        Self { weighting: Weighting::Radiometric, ..self.clone() }
    }

    /// True if all power has one wavelength.
    pub fn is_line(&self) -> bool {
        matches!(&self.source, SpectralPower::Lines { wavelength_nm, .. } if wavelength_nm.len() == 1)
    }

    /// The shares of the power, weighted in any way, that `nodes` (nm, ascending) stand for where
    /// whatever is seen is linear between them; zeros where nothing has weight.
    pub fn weights(&self, nodes: &[f64], weighting: Weighting) -> Vec<f64> {
        let photometric = weighting == Weighting::Photometric;
        if photometric && self.luminous_efficacy_lm_per_w <= 0.0 {
            return vec![0.0; nodes.len()];
        }
        match &self.source {
            SpectralPower::Lines { wavelength_nm, power } => {
                shares::of_nodes(nodes, lines(wavelength_nm, power, photometric))
            }
            continuous => shares::of_nodes(nodes, slices(&Density::new(continuous, photometric))),
        }
    }

    /// X, Y and Z (CIE 1931) that `nodes` (nm, ascending) stand for in 1 W of the spectrum, where
    /// whatever is seen is linear between them. Y is in units of 683 lm.
    pub fn tristimulus(&self, nodes: &[f64]) -> Vec<[f64; 3]> {
        self.seen_through(nodes, &|_| 1.0)
    }

    /// The same through a filter of this transmittance at a wavelength in nm.
    pub fn seen_through(&self, nodes: &[f64], filter: &dyn Fn(f64) -> f64) -> Vec<[f64; 3]> {
        match &self.source {
            SpectralPower::Lines { wavelength_nm, power } => {
                shares::tristimulus(nodes, lines(wavelength_nm, power, false), filter)
            }
            continuous => {
                shares::tristimulus(nodes, slices(&Density::new(continuous, false)), filter)
            }
        }
    }

    /// The wavelength with half of the weighted power on either side, nm: what stands for the
    /// spectrum where one wavelength must.
    pub fn median_nm(&self) -> f64 {
        let photometric = self.weighting == Weighting::Photometric;
        match &self.source {
            SpectralPower::Lines { wavelength_nm, power } => {
                let lines = lines(wavelength_nm, power, photometric);
                let mut below = 0.0;
                let middle = lines.iter().find(|(_, weight)| {
                    below += weight;
                    below >= 0.5
                });
                middle.unwrap_or(&lines[lines.len() - 1]).0
            }
            continuous => rounded(&Density::new(continuous, photometric), 0.5),
        }
    }

    /// Wavelengths (nm, ascending) and weights (adding up to 1) of the rule of `count` points, one of
    /// [`quadrature::COUNTS`], those left out that stand neither for weighted power nor for X, Y and
    /// Z; the lines themselves for a spectrum of lines.
    pub fn rule(&self, count: usize) -> Vec<(f64, f64)> {
        let photometric = self.weighting == Weighting::Photometric;
        match &self.source {
            SpectralPower::Lines { wavelength_nm, power } => {
                lines(wavelength_nm, power, photometric)
            }
            continuous => {
                let wavelengths = Density::of_wavelengths(continuous, photometric);
                let nodes: Vec<f64> = places(count).map(|u| rounded(&wavelengths, u)).collect();
                let power = Density::new(continuous, photometric);
                let weights = shares::of_nodes(&nodes, slices(&power));
                // Of a faint tail or, without weight, of the colours: a node of neither is left out.
                let seen = self.tristimulus(&nodes);
                let all = nodes.into_iter().zip(weights).zip(seen);
                let counts = all.filter(|((_, w), xyz)| *w > 0.0 || xyz.iter().any(|v| *v > 0.0));
                counts.map(|(node, _)| node).collect()
            }
        }
    }

    /// One line for people.
    pub fn describe(&self) -> String {
        if self.is_line() {
            let [nm, _] = self.range_nm;
            let weighting = self.weighting.name();
            return format!("{nm} nm; {weighting}, {:.1} lm/W", self.luminous_efficacy_lm_per_w);
        }
        let source = match &self.source {
            SpectralPower::WhiteLed(led) => format!(
                "white LED, {} % at {} nm ({} nm wide), the rest at {} nm ({} nm wide)",
                (led.blue_part * 1e4).round() / 1e2,
                led.blue_nm,
                led.blue_fwhm_nm,
                led.phosphor_nm,
                led.phosphor_fwhm_nm
            ),
            SpectralPower::Table { wavelength_nm, .. } => {
                format!("table of {}", count(wavelength_nm.len(), "row"))
            }
            SpectralPower::Lines { wavelength_nm, .. } => count(wavelength_nm.len(), "line"),
        };
        let [low, high] = self.range_nm.map(|nm| (nm * 10.0).round() / 10.0);
        let weighting = self.weighting.name();
        let sampling = match self.sampling {
            Some(Sampling::Tolerance(t)) => format!("wavelengths to a tolerance of {t}"),
            Some(Sampling::Samples(1)) => format!("one wavelength, {} nm", self.rule(1)[0].0),
            Some(Sampling::Samples(n)) => count(n, "wavelength"),
            None => "computed line by line".to_owned(),
        };
        format!(
            "{source}; power from {low} to {high} nm, half of it (weighted) below {} nm; {weighting}, {:.1} lm/W; {sampling}",
            self.median_nm(),
            self.luminous_efficacy_lm_per_w
        )
    }

    /// The same of light that a medium converts, whose wavelengths are traced together.
    pub fn describe_converted(&self) -> String {
        let [low, high] = self.range_nm.map(|nm| (nm * 10.0).round() / 10.0);
        format!("power from {low} to {high} nm, half of it below {} nm", self.median_nm())
    }
}

/// The wavelength below which the share `u` of a density lies, rounded, nm.
fn rounded(density: &Density, u: f64) -> f64 {
    let [low, high] = density.range_nm();
    ((density.quantile_nm(u) * PER_NM).round() / PER_NM).clamp(low, high)
}

/// Wavelengths (nm) of slices of equal power, each with a flux of 1.
fn slices(density: &Density) -> impl Iterator<Item = (f64, f64)> {
    let middle = |k: usize| (k as f64 + 0.5) / SLICES as f64;
    (0..SLICES).map(move |k| (density.quantile_nm(middle(k)), 1.0))
}

fn check_source(source: &SpectralPower) -> Result<(), SpectrumError> {
    let within = |key, value: f64, [low, high]: [f64; 2]| {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(SpectrumError::new(key, value, format!("a number from {low} to {high}")))
        }
    };
    match source {
        SpectralPower::WhiteLed(led) => {
            within("blue_nm", led.blue_nm, WAVELENGTHS_NM)?;
            within("phosphor_nm", led.phosphor_nm, WAVELENGTHS_NM)?;
            for (key, width, peak) in [
                ("blue_fwhm_nm", led.blue_fwhm_nm, led.blue_nm),
                ("phosphor_fwhm_nm", led.phosphor_fwhm_nm, led.phosphor_nm),
            ] {
                // Three standard deviations must stay above the shortest wavelength.
                within(
                    key,
                    width,
                    [0.1, ((peak - WAVELENGTHS_NM[0]) / density::REACH_FWHM).max(0.1)],
                )?;
            }
            within("blue_part", led.blue_part, [0.0, 1.0])
        }
        SpectralPower::Table { wavelength_nm, power } => check_rows(wavelength_nm, power, 2),
        SpectralPower::Lines { wavelength_nm, power } => check_rows(wavelength_nm, power, 1),
    }
}

/// Rows of a table or lines: as many powers as wavelengths, these ascending and in range, no power
/// negative, some above 0.
fn check_rows(wavelength_nm: &[f64], power: &[f64], least: usize) -> Result<(), SpectrumError> {
    let rows = wavelength_nm.len();
    if rows < least {
        return Err(SpectrumError::new(
            "wavelength_nm",
            format!("{rows} wavelengths"),
            format!("at least {least}"),
        ));
    }
    if power.len() != rows {
        return Err(SpectrumError::new(
            "power",
            format!("{} numbers", power.len()),
            format!("one for each of the {rows} wavelengths"),
        ));
    }
    let [low, high] = WAVELENGTHS_NM;
    for &nm in wavelength_nm {
        if !(low..=high).contains(&nm) {
            return Err(SpectrumError::new(
                "wavelength_nm",
                nm,
                format!("wavelengths from {low} to {high} nm"),
            ));
        }
    }
    if let Some([before, after]) = wavelength_nm.array_windows().find(|[a, b]| a >= b) {
        return Err(SpectrumError::new(
            "wavelength_nm",
            format!("{after} after {before}"),
            "wavelengths in ascending order",
        ));
    }
    if let Some(bad) = power.iter().find(|p| !(0.0..=MAX_POWER).contains(*p)) {
        let expected = format!("finite numbers from 0 to {MAX_POWER:e}");
        return Err(SpectrumError::new("power", bad, expected));
    }
    let largest = power.iter().copied().fold(0.0, f64::max);
    if largest < 1.0 / MAX_POWER {
        let got =
            if largest > 0.0 { format!("at most {largest:e}") } else { "0 everywhere".into() };
        let expected =
            format!("power above 0, from {:e}, at one wavelength at least", 1.0 / MAX_POWER);
        return Err(SpectrumError::new("power", got, expected));
    }
    Ok(())
}

/// Lines are all computed; everything else says how it is sampled.
fn check_sampled(source: &SpectralPower, sampling: Option<Sampling>) -> Result<(), SpectrumError> {
    let lines = matches!(source, SpectralPower::Lines { .. });
    match sampling {
        None if lines => Ok(()),
        None => Err(SpectrumError::new("tolerance", "missing", "`tolerance` or `samples`")),
        Some(_) if lines => Err(SpectrumError::new(
            "kind",
            "lines, with `tolerance` or `samples`",
            "neither of them: every line is computed",
        )),
        Some(sampling) => check_sampling(sampling),
    }
}

/// Refuses tolerances and numbers of wavelengths that are of no use.
///
/// # Errors
/// The key and what is allowed.
pub fn check_sampling(sampling: Sampling) -> Result<(), SpectrumError> {
    match sampling {
        Sampling::Tolerance(t) if !(TOLERANCES[0]..=TOLERANCES[1]).contains(&t) => {
            let [low, high] = TOLERANCES;
            Err(SpectrumError::new("tolerance", t, format!("a number from {low:e} to {high}")))
        }
        Sampling::Samples(n) if !quadrature::COUNTS.contains(&n) => {
            let counts = quadrature::COUNTS.map(|n| n.to_string()).join(", ");
            Err(SpectrumError::new("samples", n, format!("one of {counts}")))
        }
        Sampling::Tolerance(_) | Sampling::Samples(_) => Ok(()),
    }
}

/// Lines with power and their shares.
fn lines(wavelength_nm: &[f64], power: &[f64], photometric: bool) -> Vec<(f64, f64)> {
    let weight = |nm: f64, p: f64| if photometric { p * metrics::photopic::v(nm) } else { p };
    let weighted = wavelength_nm.iter().zip(power).filter(|(_, p)| **p > 0.0);
    let weighted: Vec<(f64, f64)> = weighted.map(|(&nm, &p)| (nm, weight(nm, p))).collect();
    let total: f64 = weighted.iter().map(|line| line.1).sum();
    weighted.into_iter().map(|(nm, w)| (nm, w / total)).collect()
}

/// First and last wavelength with power, nm.
fn range_nm(source: &SpectralPower) -> [f64; 2] {
    match source {
        SpectralPower::Lines { wavelength_nm, power } => {
            let lines = lines(wavelength_nm, power, false);
            [lines[0].0, lines[lines.len() - 1].0]
        }
        _ => Density::new(source, false).range_nm(),
    }
}

/// Lumens per watt: 683 ∫ P V / ∫ P.
fn efficacy(source: &SpectralPower) -> f64 {
    let ratio = match source {
        SpectralPower::Lines { wavelength_nm, power } => {
            let rows = wavelength_nm.iter().zip(power);
            let seen: f64 = rows.map(|(&nm, p)| p * metrics::photopic::v(nm)).sum();
            seen / power.iter().sum::<f64>()
        }
        _ => Density::new(source, true).total() / Density::new(source, false).total(),
    };
    metrics::photopic::LUMENS_PER_WATT * ratio
}

#[cfg(test)]
mod tests;
