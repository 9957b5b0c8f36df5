// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[panel]` as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[panel]`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Largest over smallest transmittance of all sub-pixels, from 1; default 5000.
    pub contrast: Option<f64>,
    /// Red, green and blue sub-pixels, three tables in this order; none: one filter for all light,
    /// which shows no colours.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sub_pixels: Vec<SubPixel>,
}

/// `[[panel.sub_pixels]]`: either `wavelength_nm` and `transmittance`, or `file`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SubPixel {
    /// Wavelengths, nm, ascending, 10 to 100 000, at least two.
    pub wavelength_nm: Option<Vec<f64>>,
    /// Share of the light that the open sub-pixel passes at each, of all that meets the pixel; 0 to
    /// 1, of all three together at most 1, straight lines between rows, nothing beyond the first and last.
    pub transmittance: Option<Vec<f64>>,
    /// File of these two columns instead.
    pub file: Option<String>,
    /// Transmittance of the closed sub-pixel over that of the open one, 0 to 1; default 1 over the
    /// contrast.
    pub black: Option<f64>,
}
