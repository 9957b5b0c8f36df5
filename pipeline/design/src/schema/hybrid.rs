// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[hybrid]` as written: the settings of tables and bands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;

/// `[hybrid]`: rings, bands and tables of the wave/ray hybrid and its control.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hybrid {
    /// Radial width of a ring, µm; must divide the width of an element.
    pub element_width_um: f64,
    /// Neighbouring rings that share one table.
    pub rings_per_band: usize,
    /// Which ring of a band its table is computed for, from 1.
    pub representative: usize,
    /// Nodes of the Bloch wavevector in one Brillouin zone; chosen for the tolerance if absent, but
    /// where `ky_count` is given.
    pub kx_per_zone: Option<usize>,
    /// Nodes of the wavevector along the grooves, 0 to the largest; chosen for the tolerance if
    /// absent.
    pub ky_count: Option<usize>,
    /// No direction's share may move by more than this when slices are halved or a third more
    /// orders kept.
    pub tolerance: f64,
    /// Highest diffraction order to keep; found for the tolerance if absent.
    pub orders: Option<usize>,
    /// A table that would take more memory than this while it is solved is refused, GiB.
    pub memory_gib: f64,
    /// Slanted sides become stairs of this height before they are solved, µm; as they are if
    /// absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stairs_um: Option<f64>,
    /// What tables keep of their orders.
    #[serde(skip_serializing_if = "is_default")]
    pub tables: TableContent,
    /// Polarisation whose shares the bands scatter by.
    #[serde(skip_serializing_if = "is_default")]
    pub polarization: Polarization,
}

/// What tables keep of their orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TableContent {
    /// Shares of the power.
    #[default]
    Shares,
    /// Jones matrices beside them.
    Matrices,
}

/// Polarisation of the light that meets a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Polarization {
    /// Half s, half p.
    #[default]
    Unpolarised,
    /// E across the plane of incidence.
    S,
    /// H across the plane of incidence.
    P,
}

impl Default for Hybrid {
    fn default() -> Self {
        Self {
            element_width_um: 10.0,
            rings_per_band: 10,
            representative: 5,
            kx_per_zone: None,
            ky_count: None,
            tolerance: 2e-3,
            orders: None,
            memory_gib: 4.0,
            stairs_um: None,
            tables: TableContent::default(),
            polarization: Polarization::default(),
        }
    }
}
