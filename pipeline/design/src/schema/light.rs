// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[light]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use crate::spectrum::Weighting;
use crate::tagged::{Kinds, Tagged};

/// `[light]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Vacuum wavelength, nm; this or `spectrum`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<f64>,
    /// Power over the wavelength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// With `wavelength_nm`: what figures are weighted by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weighting: Option<Weighting>,
    /// Whether rays carry their polarisation.
    #[serde(default, skip_serializing_if = "is_default")]
    pub polarization: Carrying,
}

/// What rays know of their polarisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Carrying {
    /// Nothing: every surface sees unpolarised light.
    #[default]
    Unpolarised,
    /// What smooth surfaces made of it.
    Carried,
}

/// `[light.spectrum]`, and `spectrum` of a source.
pub type Spectrum = Tagged<SpectrumKeys, SpectrumForm>;

/// Keys of all spectra.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectrumKeys {
    /// What figures are weighted by; of a source as of the design.
    pub weighting: Option<Weighting>,
    /// Largest change of a figure from one number of wavelengths to the next.
    pub tolerance: Option<f64>,
    /// Number of wavelengths.
    pub samples: Option<usize>,
}

/// Kinds of spectrum.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpectrumForm {
    /// Blue die and phosphor.
    WhiteLed(WhiteLed),
    /// Power at wavelengths, linear between them.
    Table(SpectrumRows),
    /// Single wavelengths.
    Lines(SpectrumRows),
}

impl Kinds for SpectrumForm {
    const TAG: &'static str = "kind";
}

/// Keys of a white LED.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WhiteLed {
    /// Peak of the blue die, nm.
    pub blue_nm: f64,
    /// Full width of that peak at half its height, nm.
    pub blue_fwhm_nm: f64,
    /// Peak of the phosphor, nm.
    pub phosphor_nm: f64,
    /// Full width of that peak at half its height, nm.
    pub phosphor_fwhm_nm: f64,
    /// Share of the radiant power that is blue.
    pub blue_part: f64,
}

/// Keys of a table and of lines.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectrumRows {
    /// Wavelengths, nm.
    pub wavelength_nm: Option<Vec<f64>>,
    /// Power at each.
    pub power: Option<Vec<f64>>,
    /// A file of two columns instead, relative to the design file.
    pub file: Option<String>,
}
