// SPDX-License-Identifier: MIT OR Apache-2.0
//! Luminescent substances of media as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;
use super::scattering::ByWavelength;

/// `luminophores`: a substance that absorbs light and emits it at other wavelengths, unpolarised and
/// alike in all directions.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Luminophore {
    /// Name in the ledger.
    pub name: String,
    /// Absorption coefficient beside that of the medium, 1/mm, 0 to 10⁶; rows count as 0 beyond
    /// their ends.
    pub absorption_per_mm: ByWavelength,
    /// Photons emitted for each that is absorbed, 0 to 1; over the wavelength absorbed rows go on as
    /// they end.
    pub quantum_yield: ByWavelength,
    /// Spectrum of the emitted light.
    pub emission: Emission,
    /// True: no photon is emitted with more energy than was absorbed, none at all where the whole
    /// emission lies at shorter waves. Default false: the emission spectrum is the same whatever is
    /// absorbed.
    #[serde(default, skip_serializing_if = "is_default")]
    pub stokes_only: bool,
}

/// Emission spectrum: a peak, rows or a file.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Emission {
    /// Peak of a Gaussian in power per nm, nm, cut off at three standard deviations; with `fwhm_nm`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_nm: Option<f64>,
    /// Its full width at half maximum, nm; from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fwhm_nm: Option<f64>,
    /// Wavelengths, nm, ascending; with `power`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wavelength_nm: Option<Vec<f64>>,
    /// Power per nm at each, in any unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub power: Option<Vec<f64>>,
    /// File of these two columns.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}
