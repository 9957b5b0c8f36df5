// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing bsdf`: the tables of diffraction orders of a design, computed anew and written to files.

use std::fmt::Write as _;

use anyhow::{Result, ensure};
use serde_json::json;

use super::writable;
use crate::cache::{EXTENSION, write_table};
use crate::cli;
use crate::config;
use crate::stages::tables::{labelled, tables};
use crate::stages::trace::Environment;

/// Solves every ring that stands for a band and writes `<design>-band-08-ring-075.bworders`.
pub fn run(arguments: &cli::Bsdf, env: Environment) -> Result<()> {
    let design = config::load(&arguments.design)?;
    ensure!(
        design.has_relief(),
        "{}: the dome is smooth, there are no tables to compute",
        arguments.design.display()
    );
    let count = design.hybrid_rings().shapes.len() / design.hybrid.rings_per_band;
    if let Some(band) = arguments.band {
        ensure!(
            (1..=count).contains(&band),
            "--band {band}: expected a band from 1 to {count}"
        );
    }
    writable(&arguments.out)?;
    let solved = tables(&[&design], None, arguments.band, env)?.remove(0);
    let mut rows = Vec::new();
    let mut text = String::from("band  ring  period (um)  orders  slices  estimated error  file\n");
    for (i, table) in solved.bands.iter().enumerate() {
        let Some(table) = table else { continue };
        let (band, ring) = (i + 1, table.cell.ring);
        let file = arguments.out.join(format!(
            "{}-band-{band:02}-ring-{ring:03}.{EXTENSION}",
            design.name
        ));
        write_table(&file, &labelled(&table.table, &design, band, ring)?)?;
        let h = table.table.header();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{band:>4}  {ring:>4}  {:>11.4}  {:>6}  {:>6}  {:>15.1e}  {}",
            table.cell.period_um,
            h.truncation,
            h.slices,
            h.estimated_error,
            file.display()
        );
        rows.push(json!({"band": band, "ring": ring, "period_um": table.cell.period_um, "orders": h.truncation, "slices": h.slices, "estimated_error": h.estimated_error, "energy_residual": h.energy_residual, "file": file.display().to_string()}));
    }
    env.console
        .result(&json!({"design": design.name, "tables": rows}), || text)
}
