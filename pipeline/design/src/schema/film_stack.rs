// SPDX-License-Identifier: MIT OR Apache-2.0
//! `[[films]]` as written: plates and films over the array.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Silicone;
use super::solids::SolidScatter;
use runtime::serde_arrays::List;

/// `[[films]]`: one plate or film, the lowest first.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Film {
    /// Name in the ledger and in receivers, as `solids.name`.
    pub name: String,
    /// Height of its lower face, mm; to 10 000, at least 1e-4 above what lies below. This of the
    /// lowest film; of others this or `gap_mm`.
    pub z_mm: Option<f64>,
    /// Air between it and the film below, mm; 1e-4 to 10 000, or 0 for optical contact; default
    /// 0.01.
    pub gap_mm: Option<f64>,
    /// Thickness without grooves, mm; 1e-4 to 10 000.
    pub thickness_mm: f64,
    /// Lengths along x and y, about the middle of the array, mm; 1e-6 to 10 000. Default what the
    /// walls of the housing leave; without walls the cells of the array.
    pub size_mm: Option<List<f64, 2>>,
    /// Material: a table with the keys of `[silicone]`.
    pub medium: Silicone,
    /// Upper face: keys of `[solids.scatter]`; default smooth.
    pub top: Option<SolidScatter>,
    /// Lower face, likewise.
    pub bottom: Option<SolidScatter>,
}
