// SPDX-License-Identifier: MIT OR Apache-2.0
//! Parts of the writers of scattering tables on direction cells, and the figures of what a table
//! lost on the way.

use std::path::{Path, PathBuf};

use crate::convert::{Resolution, Smearing};
use bsdf::{Bsdf, Transport};
use serde_json::{Value, json};

use super::program;

/// Resolution of a written table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// Steps of tables on angles.
    pub resolution: Resolution,
    /// Logarithm of the cells of a tensor tree along one coordinate.
    pub tree_log2: u32,
}

/// One written file.
pub struct Written {
    /// Path.
    pub path: PathBuf,
    /// Loss of detail.
    pub smearing: Smearing,
}

/// Surface to write on direction cells.
pub struct CellTable<'a> {
    /// Surface.
    pub surface: &'a dyn Bsdf,
    /// Resolution.
    pub fineness: &'a Fineness,
    /// Vacuum wavelength to state, nm.
    pub wavelength_nm: Option<f64>,
}

impl CellTable<'_> {
    /// Wavelength in words.
    pub(super) fn stated_wavelength(&self) -> String {
        self.wavelength_nm.map_or("wavelength not stated".to_owned(), |w| format!("{w} nm"))
    }

    /// Comments at the head of a file.
    pub(super) fn comments(&self, smearing: &Smearing) -> Vec<String> {
        let width = format!("spread over cells up to {:.4} degrees wide", smearing.width_deg);
        let spread = if smearing.resolving_deg().is_finite() {
            let apart = smearing.resolving_deg();
            format!("orders are {width}; {apart:.4} would keep neighbours apart")
        } else {
            format!("light is {width}")
        };
        vec![format!("{}, {}, unpolarised light", program(), self.stated_wavelength()), spread]
    }
}

/// Path beside `path` for one of several files, whose stem ends in `part`.
pub(super) fn beside(path: &Path, part: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{part}.{ending}"))
}

/// Figures of a smearing for programs, every incidence included.
pub fn describe(written: &Written) -> Value {
    let s = &written.smearing;
    let incidences: Vec<Value> = s
        .incidences
        .iter()
        .map(|i| {
            json!({
                "from": i.side, "transport": if i.transport == Transport::Reflection { "reflected" } else { "transmitted" },
                "theta_deg": i.theta_deg, "phi_deg": i.phi_deg, "before": i.before, "after": i.after, "merged": i.merged,
            })
        })
        .collect();
    json!({
        "file": written.path.display().to_string(),
        "cell_width_deg": s.width_deg,
        "mean_shift_deg": s.mean_shift_deg,
        "closest_orders_deg": s.closest_deg.is_finite().then_some(s.closest_deg),
        "resolving_deg": s.resolving_deg().is_finite().then_some(s.resolving_deg()),
        "share_in_shared_cells": s.merged(),
        "worst_energy_difference": s.worst_energy(),
        "incidences": incidences,
    })
}

/// Lines on a smearing for people.
pub fn summary(written: &Written) -> String {
    let s = &written.smearing;
    let apart = if s.resolving_deg().is_finite() {
        format!(
            "orders of 1 % and more stand {:.3} degrees apart at least: cells of {:.3} degrees would keep them apart",
            s.closest_deg,
            s.resolving_deg()
        )
    } else {
        "no two orders of 1 % and more".to_owned()
    };
    format!(
        "{}\n  cells up to {:.3} degrees wide, orders moved by {:.3} degrees on the mean, {:.1} % of the power in cells with several orders\n  power of any of {} incidences changed by at most {:.1e}\n  {apart}",
        written.path.display(),
        s.width_deg,
        s.mean_shift_deg,
        100.0 * s.merged(),
        s.incidences.len(),
        s.worst_energy(),
    )
}
