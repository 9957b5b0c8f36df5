// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[hybrid]` as written: the settings of tables and bands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::is_default;

/// `[hybrid]`: rings, bands and tables of the wave/ray hybrid and its control.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hybrid {
    /// Radial width of a ring, µm: divides `elements.width_um`, at most 10 000 rings. Default
    /// `elements.width_um`, the rings as designed; a smaller width is a design of its own, of
    /// copies of the relief at that width.
    pub element_width_um: f64,
    /// Neighbouring rings that share a table: divides the number of rings. Default the most, up to
    /// 10, that divide those of an element.
    pub rings_per_band: usize,
    /// Ring of a band that is solved, 1 to `rings_per_band`. Default the middle one: 5 of 10.
    pub representative: usize,
    /// Wavelengths at which rings are solved where a medium converts light, nm, ascending; a path
    /// takes the tables of the nearest. Default the medians of the light and of each emission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tables_nm: Option<Vec<f64>>,
    /// Nodes of the Bloch wavevector in one Brillouin zone, 1 to 64. Default found for the
    /// tolerance; 2 with `ky_count`.
    pub kx_per_zone: Option<usize>,
    /// Nodes of the wavevector along the grooves, 2 to 1024. Default found for the tolerance.
    pub ky_count: Option<usize>,
    /// Error allowed of what is transmitted, over directions; without `ky_count` also by
    /// interpolation, of diffuse light. 1e-8 to 0.1.
    pub tolerance: f64,
    /// Highest diffraction order, up to 2000: not below what propagates or what the tolerance
    /// takes. Default found for the tolerance.
    pub orders: Option<usize>,
    /// Memory for solving a table, GiB; more is refused beforehand. 0.001 to 10⁶.
    pub memory_gib: f64,
    /// Height of stairs in place of slanted sides, µm; 0.001 to 1000. Default sides as they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stairs_um: Option<f64>,
    /// Content of the tables; default `"shares"`.
    #[serde(skip_serializing_if = "is_default")]
    pub tables: TableContent,
    /// Polarisation the bands scatter by; default `"unpolarised"`.
    #[serde(skip_serializing_if = "is_default", alias = "polarisation")]
    pub polarization: Polarization,
}

/// Content of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TableContent {
    /// Shares of the power.
    #[default]
    Shares,
    /// Jones matrices too, by which bands see and change polarisation. Needs `light.polarization =
    /// "carried"` and the default `polarization`; 3 times the memory, 1.5 times the time.
    Matrices,
}

/// Polarisation of the light that meets a band.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Polarization {
    /// The mean of both.
    #[default]
    #[serde(alias = "unpolarized")]
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
            tables_nm: None,
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
