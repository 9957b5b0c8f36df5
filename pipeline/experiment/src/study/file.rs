// SPDX-License-Identifier: MIT OR Apache-2.0
//! The study file as written: one field for each key, unchecked (`docs/reference/study-file.md`).

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use design::dotted_keys::Settings;
use design::json_schema::AnyValues;
use runtime::serde_arrays::List;
use simulate::model::Model;

use crate::checked_file::FileKeys;

/// A whole study file.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Name of output files: letters, digits, `-`, `_`, `.`; no `.` first.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Design files, relative to the study: at least one, none with the name of another.
    pub designs: Vec<String>,
    /// Models of each design, such as every design has; at least one.
    pub models: Vec<Model>,
    /// Paths of each trace, 1000 to 10¹²; `--paths` replaces it. Default those of the designs.
    pub paths: Option<u64>,
    /// Arrangement of the levels of the factors.
    #[serde(default)]
    pub arrangement: FactorArrangement,
    /// True where set-ups that make no design (outlines that cross, values out of range) are listed
    /// with the reason and left out; otherwise the study is refused.
    #[serde(default)]
    pub skip_impossible: bool,
    /// Table of `set` and `set_of`, as of a level: what all set-ups have in common.
    #[serde(default)]
    pub base: Level,
    /// Factors that are varied: a key with its values, or levels.
    #[serde(default)]
    pub factors: Vec<Factor>,
    /// Set-ups put together by hand.
    #[serde(default)]
    pub setups: Vec<ExplicitSetup>,
    /// Probes: the share of an element's light in ranges of polar angles while all others absorb,
    /// as in Figures 3 and 4.
    #[serde(default)]
    pub probes: Vec<Probe>,
    /// File of target figures, relative to the study, with tables `[DESIGN.MODEL]` as those of
    /// `targets`; this or `targets`.
    pub targets_file: Option<String>,
    /// Figures that designs should have, tables `[targets.DESIGN.MODEL]`, models as in
    /// `results.json` (`geometric_100um`): a number (`near`), or `{ at_least = .. }`,
    /// `{ at_most = .. }`, both, or `{ near = .. }`.
    #[schemars(with = "Option<AnyValues>")]
    pub targets: Option<toml::Table>,
    /// A difference that counts as 1 in the misfit, by figure; at least 1e-9. Default 5° of peak
    /// angle, 0.06 of centre/peak, 0.02 of uniformity, 0.01 of extraction, 0.03 of illuminance
    /// valley/peak and of the forms of uniformity.
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

/// Arrangement of levels to set-ups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FactorArrangement {
    /// The base, and each level of each factor alone.
    #[default]
    OneAtATime,
    /// The base, and every combination of levels, one of each factor.
    Grid,
}

/// `[[factors]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Name of its own.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Key of every design by dotted path; with `values`, or `levels` in place of both.
    pub key: Option<String>,
    /// Values of the key, each a level.
    #[schemars(with = "Option<Vec<serde_json::Value>>")]
    pub values: Option<Vec<toml::Value>>,
    /// Levels that set several keys; names of their own.
    #[serde(default)]
    pub levels: Vec<NamedLevel>,
}

/// `[[factors.levels]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedLevel {
    /// Name.
    pub name: String,
    /// Keys of every design.
    #[serde(default)]
    #[schemars(with = "AnyValues")]
    pub set: Settings,
    /// Keys of single designs, by their names.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, AnyValues>")]
    pub set_of: BTreeMap<String, Settings>,
}

/// `[base]`, and what a level sets.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Keys of every design.
    #[serde(default)]
    #[schemars(with = "AnyValues")]
    pub set: Settings,
    /// Keys of single designs, by their names.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, AnyValues>")]
    pub set_of: BTreeMap<String, Settings>,
}

/// `[[setups]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExplicitSetup {
    /// Name of its own.
    pub name: String,
    /// Level of each factor that is not as in the base: factor = level.
    #[serde(default)]
    pub levels: BTreeMap<String, String>,
    /// Keys of every design, beside those of the levels.
    #[serde(default)]
    #[schemars(with = "AnyValues")]
    pub set: Settings,
    /// Keys of single designs, by their names.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, AnyValues>")]
    pub set_of: BTreeMap<String, Settings>,
}

/// `[[probes]]`: the light of one element while all others absorb.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Name of the design.
    pub design: String,
    /// Element, counted from 1.
    pub element: usize,
    /// Ranges of polar angles in which its light is counted, degrees: one after the other from 0 to
    /// 180, as `[[20, 30], [50, 90]]`.
    pub ranges_deg: Vec<List<f64, 2>>,
    /// Share that it should be, 0 to 1, then part of the misfit.
    #[serde(skip_serializing)]
    pub target: Option<f64>,
    /// A difference that counts as 1 in the misfit; above 0. Default 0.25.
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
