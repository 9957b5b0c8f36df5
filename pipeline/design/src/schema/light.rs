// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[light]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use crate::spectrum::WhiteLed;
use crate::tagged::{Kinds, Tagged};
use metrics::kinds::Carrying;
use metrics::kinds::Weighting;

/// `[light]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Vacuum wavelength, nm; 10 to 100 000, with at most 1878 orders in relief. This or
    /// `[light.spectrum]`.
    pub wavelength_nm: Option<f64>,
    /// Spectrum, as below.
    pub spectrum: Option<Spectrum>,
    /// With `wavelength_nm`: weighting of all sources. Default `"radiometric"`, with `led.power_lm`
    /// `"photometric"`.
    pub weighting: Option<Weighting>,
    /// Step of the wavelengths at which light is traced where a medium converts it, nm; 0.5 to 50,
    /// default 5; one that leaves at most 256 wavelengths.
    pub step_nm: Option<f64>,
    /// Polarisation of the light on its way; default `"unpolarised"`.
    #[serde(default, skip_serializing_if = "is_default", alias = "polarisation")]
    pub polarization: Carrying,
}

/// `[light.spectrum]`, and `spectrum` of a source.
pub type Spectrum = Tagged<SpectrumKeys, SpectrumForm>;

/// Keys of all spectra.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectrumKeys {
    /// Weighting of figures. Required without `led.power_lm`; refused in `sources.spectrum`.
    pub weighting: Option<Weighting>,
    /// Wavelengths are added until figures change little, or all within two of their errors. Little
    /// is at most this for `uniformity`, `centre_to_peak` and `extraction_efficiency`, and a
    /// hundred times as many degrees for the peak angle. 1e-6 to 1, default 0.005; not for lines.
    pub tolerance: Option<f64>,
    /// Number of wavelengths in place of `tolerance`: 1, 3, 7, 15 or 31; not for lines. They lie
    /// where power, X, Y and Z are: a single one is not the median of the power.
    pub samples: Option<usize>,
}

/// Kinds of spectrum.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SpectrumForm {
    /// Blue die and phosphor, two Gaussians, each cut off at three standard deviations.
    WhiteLed(WhiteLed),
    /// Linear between rows, nothing beyond.
    Table(SpectrumRows),
    /// Single wavelengths, each computed.
    Lines(SpectrumRows),
}

impl Kinds for SpectrumForm {
    const TAG: &'static str = "kind";
}

/// Keys of a table and of lines.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpectrumRows {
    /// Wavelengths, nm, ascending, 10 to 100 000: at least two in a table, one of lines.
    pub wavelength_nm: Option<Vec<f64>>,
    /// Power per nm at each (of lines, power of each), in any unit; from 0, one above 0.
    pub power: Option<Vec<f64>>,
    /// File of these two columns instead; form as of `dome.meridian_file`, or a spectrum of Speos.
    pub file: Option<String>,
}
