// SPDX-License-Identifier: MIT OR Apache-2.0
//! A checked tolerance analysis: reads the file and its design, and checks them against each other.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::json;
use toml::Value;

use design::Design;
use design::dotted_keys::{self, Settings, check_entries_stay, numbered};
use design::resolved::check_paths;
use metrics::Bounds;
use metrics::figures::{self, Definition};
use results::tolerance::BoundEntry;
use runtime::key::Key;
use runtime::provenance::FileRecord;
use simulate::model::Model;
use simulate::observation::check_figure;

use super::deviations::Deviations;
use super::file::{ConstraintKeys, ToleranceFile, ToleranceKeys};
use crate::checked_file::{CheckedFile, Texts};
use crate::design_file::DesignFile;
use crate::study::compute::TRACE_VERSION;

/// Samples where the file states none.
const SAMPLES: usize = 200;
/// Samples of use: fewer give no quantile, more no news.
const ALLOWED: std::ops::RangeInclusive<usize> = 8..=100_000;

/// Lists with an entry for each package, and the entry that changes nothing: a number or a pair.
const PACKAGE_LISTS: [(&str, &[f64]); 5] = [
    ("array.offsets_mm", &[0.0; 2]),
    ("array.turns_deg", &[0.0]),
    ("array.scales", &[1.0]),
    ("led.offsets_mm", &[0.0; 2]),
    ("led.tilts_deg", &[0.0; 2]),
];

/// A checked tolerance analysis.
#[derive(Debug, Clone)]
pub struct ToleranceAnalysis {
    /// Short name.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// The design without deviations.
    pub design: Design,
    /// Its file.
    pub source: DesignFile,
    /// Keys that are set before anything deviates.
    pub set: Settings,
    /// Deviations.
    pub deviations: Deviations,
    /// Model of the traces.
    pub model: Model,
    /// Number of samples.
    pub samples: usize,
    /// Paths of each sample's trace.
    pub paths: u64,
    /// Figures that are reported.
    pub figures: Vec<String>,
    /// Figures that the design must have, each with the key that asks for it.
    pub required: Vec<(String, String)>,
    /// Constraints on a package.
    pub constraints: Vec<BoundEntry>,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
}

impl ToleranceAnalysis {
    /// Key of the figures of all traces: all that they depend on.
    pub fn key(&self, seed: u64) -> Key {
        let named = self.inputs.iter().map(|input| &input.sha256);
        let used = self.design.files.used.iter().map(|used| &used.sha256);
        Key::of(&json!({
            "version": env!("CARGO_PKG_VERSION"),
            "trace_version": TRACE_VERSION,
            "inputs": named.chain(used).collect::<Vec<_>>(),
            "samples": self.samples,
            "paths": self.paths,
            "seed": seed,
        }))
    }
}

/// Values by which a command replaces those of a tolerance file.
#[derive(Debug, Clone, Copy, Default)]
pub struct Overrides {
    /// Number of samples.
    pub samples: Option<usize>,
    /// Paths of each sample.
    pub paths: Option<u64>,
}

/// Reads and checks the analysis at `path`; `texts` stand for files.
///
/// # Errors
/// A file that cannot be read, a key out of range, keys or figures that the design does not have.
pub fn load(path: &Path, texts: &Texts, overrides: Overrides) -> Result<ToleranceAnalysis> {
    CheckedFile::load(path, texts, |file| check(file, overrides))
}

/// `source` with entries that change nothing in the lists of packages that deviate and that it does
/// not state.
fn with_package_lists(
    source: DesignFile,
    tolerances: &[ToleranceKeys],
    packages: usize,
) -> Result<DesignFile> {
    let keys = tolerances.iter().flat_map(|of| of.key.iter().chain(of.keys.iter().flatten()));
    let keys: Vec<String> = keys.map(|key| numbered(&source.table, key)).collect();
    for (list, neutral) in PACKAGE_LISTS {
        ensure!(
            !keys.iter().any(|key| key == list),
            "tolerances: {list}: expected entries of it, as in {list}{}",
            "[*]".repeat(neutral.len())
        );
    }
    let is_wanted = |list: &str| {
        let begins = |key: &String| key.strip_prefix(list).is_some_and(|key| key.starts_with('['));
        keys.iter().any(begins) && dotted_keys::get(&source.table, list).is_none()
    };
    let entry = |neutral: &[f64]| match neutral {
        [number] => Value::Float(*number),
        pair => pair.to_vec().into(),
    };
    let lists = PACKAGE_LISTS.into_iter().filter(|(list, _)| is_wanted(list));
    let lists =
        lists.map(|(list, neutral)| (list.to_owned(), vec![entry(neutral); packages].into()));
    let table = source.table_with(&lists.collect())?;
    Ok(DesignFile::new(source.path, table))
}

fn check(mut head: CheckedFile<ToleranceFile>, overrides: Overrides) -> Result<ToleranceAnalysis> {
    let file = head.keys.clone();
    let source = head.design("design", &file.design)?;
    check_entries_stay(&source.table, &file.set).context("set")?;
    let table = source.table_with(&file.set).context("set")?;
    let source = DesignFile::new(source.path, table);
    let design = source.with(&Settings::new())?;
    let source = with_package_lists(source, &file.tolerances, design.array.count())?;
    let model = file.model.unwrap_or(Model::Geometric).available(&design)?;
    let samples = overrides.samples.or(file.samples).unwrap_or(SAMPLES);
    ensure!(
        ALLOWED.contains(&samples),
        "samples: expected a whole number from {} to {}, got {samples}",
        ALLOWED.start(),
        ALLOWED.end()
    );
    let paths = overrides.paths.or(file.paths).unwrap_or(design.trace.paths);
    check_paths("paths", paths)?;
    let stated = file.figures.iter().flatten().map(|key| ("figures".to_owned(), key.clone()));
    let bounded = file.constraints.iter().enumerate();
    let bounded =
        bounded.map(|(k, keys)| (format!("constraints[{}].figure", k + 1), keys.figure.clone()));
    let required = stated.chain(bounded).collect();
    let figures = file.figures.unwrap_or_else(|| {
        let all = figures::all().filter(Definition::is_main).map(|figure| figure.key);
        all.filter(|key| check_figure(&design, key).is_ok()).map(str::to_owned).collect()
    });
    ensure!(!figures.is_empty(), "figures: expected at least one, got none");
    for figure in &figures {
        check_figure(&design, figure).context("figures")?;
    }
    let constraints = file.constraints.iter().enumerate().map(|(k, keys)| {
        constraint(keys, &figures).with_context(|| format!("constraints[{}]", k + 1))
    });
    let constraints = constraints.collect::<Result<_>>()?;
    let deviations = Deviations::new(&source, &file.tolerances, &file.correlations)?;
    let mut inputs = head.inputs;
    inputs.extend(design.provenance.all_named().cloned());
    Ok(ToleranceAnalysis {
        name: file.name,
        description: file.description,
        design,
        source,
        set: file.set,
        deviations,
        model,
        samples,
        paths,
        figures,
        required,
        constraints,
        inputs,
    })
}

fn constraint(keys: &ConstraintKeys, figures: &[String]) -> Result<BoundEntry> {
    ensure!(
        figures.contains(&keys.figure),
        "figure: expected one of the reported figures, {}, got {:?}",
        figures.join(", "),
        keys.figure
    );
    let Bounds { at_least, at_most } = Bounds::new(keys.at_least, keys.at_most)?;
    Ok(BoundEntry { figure: keys.figure.clone(), at_least, at_most })
}
