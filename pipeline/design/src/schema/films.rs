// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films as written: `[[dome.coating]]`, `[mirror.substrate]`, `[[mirror.coating]]`, and tables of
//! what they reflect and transmit.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use runtime::serde_arrays::List;

/// `[[dome.coating]]`, `[[mirror.coating]]`: one layer.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Refractive index n or [n, k], n above 0, k from 0; this or `material_file`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<Index>,
    /// Material file, as of `[silicone]`; a catalogue of one glass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<String>,
    /// Thickness, nm; 0.001 to 1e9.
    pub thickness_nm: f64,
}

/// `[mirror.substrate]`: the metal under the layers.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Substrate {
    /// Refractive index n or [n, k], n above 0, k from 0; this or `material_file`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index: Option<Index>,
    /// Material file, as of `[silicone]`; a catalogue of one glass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material_file: Option<String>,
}

/// A refractive index as written.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "a refractive index n or [n, k]")]
pub enum Index {
    /// n.
    Real(f64),
    /// [n, k].
    Complex(List<f64, 2>),
}

/// Keys of a filter, and shares of one axis of a polariser; what they leave of 1 is absorbed.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterKeys {
    /// Transmitted share: a number from 0 to 1, rows [angle in degrees, share], or rows [wavelength
    /// in nm, angle, share]; default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transmittance: Option<ByAngle>,
    /// Reflected share, likewise; with `transmittance` at most 1; default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<ByAngle>,
}

/// A share at every angle of incidence and wavelength.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number, rows [angle in degrees, share] or rows [wavelength in nm, angle, share]"
)]
pub enum ByAngle {
    /// One at all.
    Constant(f64),
    /// Angle in degrees and share, ascending; straight lines between, constant beyond.
    Angles(Vec<List<f64, 2>>),
    /// Wavelength in nm, angle and share: such rows for each of ascending wavelengths.
    Spectral(Vec<List<f64, 3>>),
}
