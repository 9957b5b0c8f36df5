// SPDX-License-Identifier: MIT OR Apache-2.0
//! `study.json` as a file: the same types write it and read it.
//!
//! The reference is `docs/reference/study-file.md`.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize};

use metrics::quantity::Unit;
use metrics::{Bounds, Estimate};
use runtime::provenance::FileRecord;

use super::figure_entry::FigureEntry;
use super::sealed_file::SealedFile;
use super::shown;
use super::target::{Sought, Verdict};

/// File under the directory of results.
pub const FILE: &str = "study.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 4;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyFile {
    /// `batwing-study`.
    pub schema: String,
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// `batwing`.
    pub program: String,
    /// Version of the program that wrote it.
    pub version: String,
    /// Name of the study.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// Files that came out.
    pub files: Vec<FileRecord>,
    /// Scales of misses by figure.
    pub scales: BTreeMap<String, f64>,
    /// Factors in the order of the study.
    pub factors: Vec<FactorEntry>,
    /// Set-ups, the base first.
    pub setups: Vec<SetupEntry>,
    /// Set-ups that make no design.
    pub impossible: Vec<LeftOutEntry>,
    /// Set-ups by misfit, the smallest first; empty without targets.
    pub ranking: Vec<RankedEntry>,
    /// Set-ups that are not ranked, for want of figures with targets.
    #[serde(default)]
    pub unranked: Vec<LeftOutEntry>,
    /// Slopes over factors that are numbers.
    pub sensitivities: Vec<SensitivityEntry>,
}

/// A factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FactorEntry {
    /// Name.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// The key, for a factor of one key.
    pub key: Option<String>,
    /// Names of its levels.
    pub levels: Vec<String>,
}

/// A set-up and its figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetupEntry {
    /// Name.
    pub name: String,
    /// Factor → level, where it is not that of the base.
    pub levels: BTreeMap<String, String>,
    /// Misfit to the targets, where it has all figures with a target.
    pub misfit: Option<Estimate>,
    /// Figures of all traces, in the order of the tables.
    pub figures: Vec<StudyFigureEntry>,
}

/// A figure of a trace of a set-up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyFigureEntry {
    /// Name of the design.
    pub design: String,
    /// Key of the model.
    pub model: String,
    /// Key of the figure.
    pub figure: String,
    /// Symbol of the unit of a figure that depends on the light; empty where its key says it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Value, standard error and state.
    #[serde(flatten)]
    pub value: FigureEntry,
    /// Difference from the base.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change: Option<FigureEntry>,
    /// Value sought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<f64>,
    /// Bounds sought.
    #[serde(flatten, deserialize_with = "bounds_sought")]
    pub bounds: Option<Bounds>,
    /// Signed distance from the target in scales.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub miss: Option<f64>,
    /// Verdict on a figure with a target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
}

/// A set-up that is left out.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LeftOutEntry {
    /// Name.
    pub setup: String,
    /// Reason.
    pub why: String,
}

/// A set-up in the ranking.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankedEntry {
    /// Name.
    pub setup: String,
    /// Misfit.
    pub misfit: Estimate,
    /// Excess over the first one.
    pub above_first: Estimate,
    /// True where it cannot be told from the first.
    pub tied_with_first: bool,
}

/// Change of a figure for one unit of a factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensitivityEntry {
    /// Name of the factor.
    pub factor: String,
    /// Its key.
    pub key: Option<String>,
    /// Name of the design.
    pub design: String,
    /// Key of the model.
    pub model: String,
    /// Key of the figure.
    pub figure: String,
    /// Slope.
    pub change_per_unit: Estimate,
}

impl SealedFile for StudyFile {
    const FILE: &'static str = FILE;
    const VERSION: u32 = SCHEMA_VERSION;
    const WORK: &'static str = "study";
    const AGAIN: &'static str = "run the study again";

    fn files(&self) -> &[FileRecord] {
        &self.files
    }
}

impl StudyFigureEntry {
    /// Unit of the figure.
    pub fn unit(&self) -> Unit {
        Unit::from_name(&self.unit).unwrap_or(shown::named(&self.figure).1)
    }

    /// Value or bounds sought.
    pub fn sought(&self) -> Option<Sought> {
        self.target.map(Sought::Near).or(self.bounds.map(Sought::Within))
    }
}

/// Reads bounds from the keys of a figure; `None` where it has neither.
fn bounds_sought<'de, D: Deserializer<'de>>(figure: D) -> Result<Option<Bounds>, D::Error> {
    let bounds = Bounds::deserialize(figure)?;
    Ok(bounds.at_least.or(bounds.at_most).map(|_| bounds))
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    #[test]
    fn a_figure_is_written_as_it_is_read() {
        let plain = json!({
            "design": "D1", "model": "hybrid_10um", "figure": "uniformity",
            "value": 0.75, "standard_error": 0.01,
        });
        let with = |more: Value| {
            let mut entry = plain.clone();
            entry
                .as_object_mut()
                .expect("an object")
                .extend(more.as_object().expect("one").clone());
            entry
        };
        let near = with(json!({"target": 0.8, "miss": -1.0, "verdict": "met"}));
        // A bound that is not sought is written as null.
        let bounded =
            with(json!({"at_least": 0.7, "at_most": null, "miss": 0.0, "verdict": "not_resolved"}));
        let bounds = Bounds { at_least: Some(0.7), at_most: None };
        for (json, sought) in [
            (near, Some(Sought::Near(0.8))),
            (bounded, Some(Sought::Within(bounds))),
            (with(json!({"unit": "lm", "change": {"value": 0.1, "standard_error": 0.0}})), None),
        ] {
            let entry: StudyFigureEntry = serde_json::from_value(json.clone()).expect("a figure");
            assert_eq!(entry.sought(), sought);
            assert_eq!(serde_json::to_value(&entry).expect("JSON"), json);
        }
    }
}
