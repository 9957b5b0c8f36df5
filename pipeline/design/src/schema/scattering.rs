// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scattering of media as written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use runtime::serde_arrays::List;

/// A number at every wavelength.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged, expecting = "a number or rows [wavelength in nm, value]")]
pub enum ByWavelength {
    /// One at all.
    Constant(f64),
    /// Wavelength in nm and value, ascending; straight lines between.
    Rows(Vec<List<f64, 2>>),
}

impl Default for ByWavelength {
    fn default() -> Self {
        Self::Constant(0.0)
    }
}

/// `particles`: equal spheres that absorb nothing and scatter independently.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Particles {
    /// Diameter, µm; 0.001 to 100.
    pub diameter_um: f64,
    /// Refractive index, 0.1 to 10.
    pub index: ByWavelength,
    /// Share of the volume that they fill, 0 to 1.
    pub volume_fraction: f64,
}
