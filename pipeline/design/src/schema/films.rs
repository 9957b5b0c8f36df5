// SPDX-License-Identifier: MIT OR Apache-2.0
//! Thin films as written: `[[dome.coating]]`, `[mirror.substrate]`, `[[mirror.coating]]`.

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
