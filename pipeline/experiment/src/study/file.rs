// SPDX-License-Identifier: MIT OR Apache-2.0
//! The study file as written: one field for each key, unchecked (`docs/reference/study-file.md`).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use design::dotted_keys::Settings;
use design::serde_arrays::List;
use simulate::model::Model;

use crate::checked_file::FileKeys;

/// A whole study file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Short name, used for output files.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Design files, relative to the study file.
    pub designs: Vec<String>,
    /// Models of each design.
    pub models: Vec<Model>,
    /// Paths of each trace; those of the designs if absent.
    pub paths: Option<u64>,
    /// Arrangement of the levels of the factors.
    #[serde(default)]
    pub arrangement: FactorArrangement,
    /// True where set-ups without a valid design are listed and left out; otherwise the study is
    /// refused.
    #[serde(default)]
    pub skip_impossible: bool,
    /// Settings of all set-ups.
    #[serde(default)]
    pub base: Level,
    /// Factors.
    #[serde(default)]
    pub factors: Vec<Factor>,
    /// Set-ups put together by hand.
    #[serde(default)]
    pub setups: Vec<ExplicitSetup>,
    /// Numbers of paths of short runs that each trace is cut into.
    #[serde(default)]
    pub short_runs: Vec<u64>,
    /// Traces of each model, each with its own seed, that short runs are cut from.
    #[serde(default = "one")]
    pub short_run_traces: u64,
    /// Probes of single elements.
    #[serde(default)]
    pub probes: Vec<Probe>,
    /// File of target figures, relative to the study file.
    pub targets_file: Option<String>,
    /// Target figures: design, model, figure.
    pub targets: Option<toml::Table>,
    /// Scale of each figure: a miss of one scale counts as 1.
    #[serde(default)]
    pub scales: BTreeMap<String, f64>,
}

impl FileKeys for StudyFile {
    const REMOVED: &[(&str, &str)] = &[(
        "rounding",
        "removed with the comparison of targets with short runs, whose results stand in \
         docs/reproduction.md",
    )];
}

const fn one() -> u64 {
    1
}

/// Arrangement of levels to set-ups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FactorArrangement {
    /// The base, and every level alone.
    #[default]
    OneAtATime,
    /// Every combination of levels, one of each factor.
    Grid,
}

/// `[[factors]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Name.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Key that `values` are values of.
    pub key: Option<String>,
    /// Values of the key, each a level.
    pub values: Option<Vec<toml::Value>>,
    /// Levels that set several keys.
    #[serde(default)]
    pub levels: Vec<NamedLevel>,
}

/// `[[factors.levels]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedLevel {
    /// Name.
    pub name: String,
    /// Keys of every design.
    #[serde(default)]
    pub set: Settings,
    /// Keys of single designs, by their names.
    #[serde(default)]
    pub set_of: BTreeMap<String, Settings>,
}

/// `[base]`, and what a level sets.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Keys of every design.
    #[serde(default)]
    pub set: Settings,
    /// Keys of single designs, by their names.
    #[serde(default)]
    pub set_of: BTreeMap<String, Settings>,
}

/// `[[setups]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExplicitSetup {
    /// Name.
    pub name: String,
    /// Factor → level.
    #[serde(default)]
    pub levels: BTreeMap<String, String>,
    /// Keys of every design, beside those of the levels.
    #[serde(default)]
    pub set: Settings,
    /// Keys of single designs, by their names.
    #[serde(default)]
    pub set_of: BTreeMap<String, Settings>,
}

/// `[[probes]]`: the light of one element while all others absorb.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name of the design.
    pub design: String,
    /// Element, from 1.
    pub element: usize,
    /// Ranges of polar angles in which its light is counted, degrees, one after the other.
    pub ranges_deg: Vec<List<f64, 2>>,
    /// Target of the share.
    #[serde(skip_serializing)]
    pub target: Option<f64>,
    /// Scale: a miss of one scale counts as 1.
    #[serde(skip_serializing, default = "quarter")]
    pub scale: f64,
}

impl Probe {
    /// Name of the element among the models of its design.
    pub fn place(&self) -> String {
        format!("element_{}_alone", self.element)
    }

    /// Name of the figure.
    pub fn figure(&self) -> String {
        let ranges = self.ranges_deg.iter();
        let ranges: Vec<String> = ranges.map(|List([a, b])| format!("{a}_to_{b}")).collect();
        format!("share_{}_deg", ranges.join("_and_"))
    }
}

fn quarter() -> f64 {
    0.25
}
