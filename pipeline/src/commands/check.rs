// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing check`: checks a design, a table or the file of an experiment, and describes it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use clap::Args;
use rcwa::error::kept_orders;
use serde_json::{Value, json};

use arrays::order_tables::{EXTENSION, read_table};
use design::Design;
use geometry::Cell;
use metrics::digits::thousands;
use metrics::plural::count;
use runtime::run_context::RunContext;
use simulate::cells::band_cells;
use simulate::description::description;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::solids::Standing;
use simulate::warnings::warnings;
use simulate::{scene, scene_check};

/// `batwing check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Design file, study, problem or tolerance file, or a table of `batwing bsdf` (.bworders)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

/// Checks the file and describes it.
pub fn run(arguments: &CheckArgs, context: RunContext) -> Result<()> {
    if arguments.file.extension().is_some_and(|e| e == EXTENSION) {
        return table(&arguments.file, context);
    }
    if let Some(found) = experiment::description::describe(&arguments.file)? {
        let file = arguments.file.display().to_string();
        let lines: BTreeMap<_, _> = found.lines.iter().cloned().collect();
        let json = json!({"file": file, "valid": true, "kind": found.kind, "lines": lines, "inputs": found.inputs});
        return context.console.result(&json, || {
            let lines = found.lines.iter().map(|(key, value)| format!("\n  {key:<11} {value}"));
            format!("{} {}{}", found.kind, found.words, lines.collect::<String>())
        });
    }
    of_design(&scene_check::load(&arguments.file)?, context)
}

/// Describes a checked design.
///
/// # Errors
/// A scene that cannot be built.
pub fn of_design(design: &Design, context: RunContext) -> Result<()> {
    let cells: Vec<Value> =
        band_cells(design).into_iter().flatten().map(|cell| cell_json(&cell)).collect();
    let models: Vec<String> = Model::all_of(design).into_iter().map(|m| m.key(design)).collect();
    let surface = dome_surface(design, Model::Geometric, None)?;
    let standing = scene::standing(design, &surface)?;
    for warning in warnings(design)? {
        context.console.warn(&warning);
    }
    let json = json!({"file": design.provenance.file, "valid": true, "design": design, "models": models, "cells": cells, "on_bottom": standing.on_bottom, "gaps": standing.gaps});
    context.console.result(&json, || describe(design, &models, &standing))
}

/// Shape of a ring's period; its relief is a list of one polygon.
fn cell_json(cell: &Cell) -> Value {
    let polygon = json!({"index": cell.inner_index, "points_um": cell.points_um});
    json!({
        "ring": cell.ring,
        "period_um": cell.period_um,
        "depth_um": cell.depth_um,
        "slope_deg": cell.slope_deg,
        "background_index": cell.background_index,
        "inner_index": cell.inner_index,
        "polygons": [polygon],
    })
}

fn describe(design: &Design, models: &[String], standing: &Standing) -> String {
    let mut text = format!("{}: {}\n", design.name, design.description);
    let mut line = |key: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {key:<11} {value}");
    };
    for (key, value) in description(design) {
        line(key, &value);
    }
    for (key, value) in standing.describe() {
        line(key, &value);
    }
    line("paths", &thousands(design.trace.paths));
    for used in &design.files.used {
        let share = used.flux_used.map_or(String::new(), |share| {
            format!(", {:.2} % of its flux leaves upwards and is used", 100.0 * share)
        });
        line("file", &format!("{}{share}", used.file));
    }
    line("models", &models.join(", "));
    if let Some(left_out) = Model::left_out(design) {
        line("", &left_out);
    }
    text
}

fn table(path: &Path, context: RunContext) -> Result<()> {
    let table = read_table(path)?;
    let header = table.header();
    let json: Value = json!({"file": path.display().to_string(), "valid": true, "header": header, "grid": table.grid(), "nodes": table.node_count(), "orders": table.entry_count()});
    let name = path
        .file_name()
        .ok_or_else(|| anyhow!("`{}` names no file", path.display()))?
        .to_string_lossy()
        .into_owned();
    context.console.result(&json, || {
        format!(
            "{name}: design {}, band {}, ring {}\n  period {} {unit}, wavelength {} {unit}\n  {}, {}, estimated error {:.1e}\n  {} of incidence, {} in all",
            header.design, header.band, header.ring, table.grid().period, table.grid().wavelength, kept_orders(header.truncation), count(header.slices, "slice"), header.estimated_error, count(table.node_count(), "direction"), count(table.entry_count(), "order"),
            unit = header.length_unit,
        )
    })
}
