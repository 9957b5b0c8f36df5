// SPDX-License-Identifier: MIT OR Apache-2.0
//! The problem file as written: one field for each key, unchecked (`docs/reference/problem-file.md`).

use serde::Deserialize;

use design::dotted_keys::Settings;
use design::serde_arrays::List;
use simulate::model::Model;

use crate::checked_file::FileKeys;

/// A whole problem file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemFile {
    /// Short name, used for the design that is found.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Design file to start from, relative to the problem file.
    pub design: String,
    /// Variables.
    pub variables: Vec<VariableKeys>,
    /// Limits of the mould.
    #[serde(default)]
    pub limits: LimitKeys,
    /// Objective.
    pub objective: ObjectiveKeys,
    /// Bounds of figures.
    #[serde(default)]
    pub constraints: Vec<ConstraintKeys>,
    /// Searches one after the other, each from where the one before ended.
    #[serde(default)]
    pub stages: Vec<StageKeys>,
    /// Verification of the result.
    #[serde(default)]
    pub verification: VerificationKeys,
}

impl FileKeys for ProblemFile {}

/// `[[variables]]`: a key of the design, or a profile over its rings or its radius.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VariableKeys {
    /// Key of the design by dotted path.
    pub key: Option<String>,
    /// A profile instead of a key.
    pub profile: Option<Profile>,
    /// Coefficients of the profile; absent: one for each ring.
    pub knots: Option<usize>,
    /// First and last ring of a profile over rings; absent: all.
    pub rings: Option<List<usize, 2>>,
    /// Least value.
    pub from: Option<f64>,
    /// Largest value.
    pub to: Option<f64>,
    /// Start of the search; absent: the value of the design.
    pub start: Option<f64>,
    /// Values are whole multiples of this.
    pub resolution: Option<f64>,
    /// Values of a discrete choice, instead of bounds.
    pub choices: Option<Vec<toml::Value>>,
}

/// Quantities over the rings or over the radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// Slope of the side nearer the axis against the horizontal, positive where it rises outwards,
    /// degrees.
    InnerSlopeDeg,
    /// Slope of the outer side against the horizontal, positive where it falls outwards, degrees.
    OuterSlopeDeg,
    /// Height of a smooth dome above the bottom over the radius, mm.
    HeightMm,
}

/// `[limits]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitKeys {
    /// Least angle of a side against the vertical, degrees.
    pub draft_deg: Option<f64>,
    /// Least interior angle of a tip, degrees.
    pub apex_deg: Option<f64>,
    /// Largest height of the package's dome, mm.
    pub total_height_mm: Option<f64>,
    /// Least width of a ring, µm.
    pub ring_width_um: Option<f64>,
    /// Least radius of tips, µm.
    pub tip_radius_um: Option<f64>,
    /// Least radius of valleys, µm.
    pub valley_radius_um: Option<f64>,
    /// True where the outline may lean over itself.
    #[serde(default)]
    pub overhang: bool,
}

/// `[objective]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectiveKeys {
    /// Weighted terms, which are added up.
    pub terms: Vec<TermKeys>,
    /// Tolerance file, relative to the problem file, over whose deviations the objective is taken.
    pub tolerances: Option<String>,
    /// Packages that are drawn for each candidate.
    pub samples: Option<usize>,
    /// Standard deviations from package to package that are added to the mean.
    pub deviations: Option<f64>,
}

/// Use of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// Larger is better.
    #[default]
    Maximise,
    /// Smaller is better.
    Minimise,
    /// Nearer to `target` is better.
    Target,
}

/// `[[objective.terms]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TermKeys {
    /// Key of a figure.
    pub figure: String,
    /// Use of the figure.
    #[serde(default)]
    pub goal: Goal,
    /// Value sought.
    pub target: Option<f64>,
    /// A miss of the target that counts as 1.
    pub scale: Option<f64>,
    /// Weight among the terms.
    #[serde(default = "one")]
    pub weight: f64,
    /// Target of a distance, relative to the problem file.
    pub file: Option<String>,
}

const fn one() -> f64 {
    1.0
}

/// `[[constraints]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstraintKeys {
    /// Key of a figure.
    pub figure: String,
    /// Least value.
    pub at_least: Option<f64>,
    /// Largest value.
    pub at_most: Option<f64>,
    /// Standard errors by which the bound is kept.
    #[serde(default = "two")]
    pub margin: f64,
}

const fn two() -> f64 {
    2.0
}

/// Method that selects candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// CMA-ES, in as many runs as `restarts` says, which share the evaluations.
    #[default]
    CmaEs,
    /// CMA-ES with restarts of large and small populations by turns, each until it converges.
    Bipop,
    /// One coordinate after the other.
    Coordinate,
    /// Uniform in the box.
    Random,
    /// NSGA-II: the Pareto front of the two terms.
    Nsga2,
}

impl Method {
    /// As written.
    pub fn name(self) -> &'static str {
        match self {
            Self::CmaEs => "cma_es",
            Self::Bipop => "bipop",
            Self::Coordinate => "coordinate",
            Self::Random => "random",
            Self::Nsga2 => "nsga2",
        }
    }
}

/// `[[stages]]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageKeys {
    /// Model of the traces; absent: rays on the relief.
    pub model: Option<Model>,
    /// Method that selects candidates.
    #[serde(default)]
    pub method: Method,
    /// Coefficients of every profile of rings, instead of its own.
    pub knots: Option<usize>,
    /// Most candidates.
    pub evaluations: Option<usize>,
    /// Number of runs of CMA-ES.
    pub restarts: Option<usize>,
    /// Candidates of a generation.
    pub population: Option<usize>,
    /// Standard deviation at the start, as a share of each variable's range.
    pub step: Option<f64>,
    /// Paths of the first traces.
    pub paths: Option<u64>,
    /// Most paths of a trace.
    pub most_paths: Option<u64>,
    /// Keys of the design that hold for the traces of the stage alone.
    #[serde(default)]
    pub set: Settings,
}

/// `[verification]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VerificationKeys {
    /// Models; absent: those of the stages.
    pub models: Option<Vec<Model>>,
    /// Paths of each trace; absent: those of the design.
    pub paths: Option<u64>,
    /// Packages that are drawn of each design; absent: those of the objective.
    pub samples: Option<usize>,
}
