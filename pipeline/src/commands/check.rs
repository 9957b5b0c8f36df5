// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing check`: checks a design or a table and describes it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use clap::Args;
use rcwa::error::kept_orders;
use serde_json::{Map, Value, json};

use design::{Design, toml_errors};
use experiment::optimise::problem;
use experiment::tolerance::definition::Overrides;
use experiment::{study, tolerance};
use files::cache::{EXTENSION, read_table};
use files::run_context::RunContext;
use metrics::digits::thousands;
use metrics::plural::count;
use simulate::cells::band_cells;
use simulate::description::description;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::scene::Standing;
use simulate::warnings::warnings;
use simulate::{scene, scene_check};

/// `batwing check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// File of a design, study, problem or tolerance analysis, or a table written by `batwing bsdf`
    /// (.bworders)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

/// Checks the file and describes it.
pub fn run(arguments: &CheckArgs, context: RunContext) -> Result<()> {
    if arguments.file.extension().is_some_and(|e| e == EXTENSION) {
        return table(&arguments.file, context);
    }
    match Kind::of(&arguments.file) {
        Kind::Design => of_design(&scene_check::load(&arguments.file)?, context),
        other => other.check(&arguments.file, context),
    }
}

/// Kinds of TOML files, told by keys that the others do not have.
#[derive(Clone, Copy)]
enum Kind {
    Design,
    Study,
    Problem,
    Tolerance,
}

impl Kind {
    /// The kind of the file at `path`; one that cannot be read is taken for a design, whose reader
    /// says why.
    fn of(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let table: Map<String, Value> = toml_errors::read(&text, &[]).unwrap_or_default();
        let has = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
        if has(&["tolerances"]) {
            Self::Tolerance
        } else if has(&["variables", "objective", "stages"]) {
            Self::Problem
        } else if has(&["designs", "factors", "setups"]) {
            Self::Study
        } else {
            Self::Design
        }
    }

    /// Checks a file of an experiment, and says what it would compute.
    fn check(self, path: &Path, context: RunContext) -> Result<()> {
        let file = path.display().to_string();
        let (kind, name, words, inputs) = match self {
            Self::Study => {
                let study = study::load(path, None)?;
                let designs: usize = study.setups.iter().map(|(_, designs)| designs.len()).sum();
                let words = format!(
                    "{}, {} in all",
                    count(study.setups.len(), "set-up"),
                    count(designs, "design")
                );
                ("study", study.name, words, study.inputs)
            }
            Self::Tolerance => {
                let analysis = tolerance::definition::load(path, Overrides::default())?;
                let words = format!(
                    "{} of {}, {} paths each",
                    count(analysis.samples, "sample"),
                    analysis.design.name,
                    thousands(analysis.paths)
                );
                ("tolerance analysis", analysis.name, words, analysis.inputs)
            }
            Self::Problem | Self::Design => {
                let problem = problem::load(path)?;
                let words = format!("a search from {}", problem.design.name);
                ("problem", problem.name, words, problem.inputs)
            }
        };
        let json =
            json!({"file": file, "valid": true, "kind": kind, "name": name, "inputs": inputs});
        context.console.result(&json, || {
            let mut text = format!("{name}: {kind}, {words}");
            for input in &inputs {
                let _ = write!(text, "\n  file        {}", input.file);
            }
            text
        })
    }
}

/// Describes a checked design.
///
/// # Errors
/// A scene that cannot be built.
pub fn of_design(design: &Design, context: RunContext) -> Result<()> {
    let cells: Vec<_> = band_cells(design).into_iter().flatten().collect();
    let models: Vec<String> = Model::all_of(design).into_iter().map(|m| m.key(design)).collect();
    let surface = dome_surface(design, Model::Geometric, None)?;
    let standing = scene::standing(design, &surface)?;
    for warning in warnings(design)? {
        context.console.warn(&warning);
    }
    let json = json!({"file": design.provenance.file, "valid": true, "design": design, "models": models, "cells": cells, "on_bottom": standing.on_bottom, "gaps": standing.gaps});
    context.console.result(&json, || describe(design, &models, &standing))
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
