// SPDX-License-Identifier: MIT OR Apache-2.0
//! The problem file as written: one field for each key, unchecked (`docs/reference/problem-file.md`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use design::dotted_keys::Settings;
use design::json_schema::AnyValues;
use runtime::serde_arrays::List;
use simulate::model::Model;

use crate::checked_file::FileKeys;

/// A whole problem file.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProblemFile {
    /// Name of the design that is found: at most 100 letters, digits, `-`, `_`, `.`; no `.` first,
    /// not the name of the design, no ending of a file.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Design file to start from, relative to the problem file.
    pub design: String,
    /// Keys and profiles that are varied; at least one.
    pub variables: Vec<VariableKeys>,
    /// Limits of the mould. Without them only overhang is refused.
    #[serde(default)]
    pub limits: LimitKeys,
    /// Weighted figures that are sought; at least one `[[objective.terms]]`.
    pub objective: ObjectiveKeys,
    /// Bounds of figures. Default none.
    #[serde(default)]
    pub constraints: Vec<ConstraintKeys>,
    /// Searches, each from the result of the one before. Default one with default keys.
    #[serde(default)]
    pub stages: Vec<StageKeys>,
    /// Models and paths of the traces of the result.
    #[serde(default)]
    pub verification: VerificationKeys,
}

impl FileKeys for ProblemFile {}

/// `[[variables]]`: a key of the design, or a profile over its rings or its radius.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariableKeys {
    /// Key of the design by dotted path, entries of lists in brackets from 1, such as
    /// `solids[2].position_mm[3]`; this, `keys` or `profile`.
    pub key: Option<String>,
    /// Keys of real numbers that the design states and that move together: bounds and `start` are
    /// those of the first, the others keep their distances from it; in place of `key`.
    pub keys: Option<Vec<String>>,
    /// Profile over the rings (triangles, steps and smooth ones) or over the radius (of a dome of
    /// revolution); in place of `key`.
    pub profile: Option<Profile>,
    /// Coefficients of the profile, a clamped cubic B-spline (of lower degree below four): 1 to the
    /// number of rings of slopes, 3 to 40 of heights. Default one for each ring, 8 of heights.
    pub knots: Option<usize>,
    /// First and last ring of a profile of slopes, from 1. Default all.
    pub rings: Option<List<usize, 2>>,
    /// Lower bound of each coefficient, in its unit, below `to`; required without `choices`.
    pub from: Option<f64>,
    /// Upper bound of each coefficient; required without `choices`.
    pub to: Option<f64>,
    /// Value where the search starts, the same for all coefficients, within the bounds. Default the
    /// design, moved into the bounds.
    pub start: Option<f64>,
    /// Step of which values are multiples, above 0, up to `to` - `from`.
    pub resolution: Option<f64>,
    /// Values of a discrete choice of a `key`, 2 to 1000, instead of bounds; a list or a table
    /// replaces the whole key.
    #[schemars(with = "Option<Vec<serde_json::Value>>")]
    pub choices: Option<Vec<toml::Value>>,
    /// Value of a `key` that follows others, instead of bounds: a formula such as
    /// `"5 * array.pitch_mm"`.
    pub value: Option<String>,
}

/// Quantities over the rings or over the radius.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// Slopes of the inner sides of rings against the horizontal, positive where they rise
    /// outwards, degrees.
    InnerSlopeDeg,
    /// Slopes of the outer sides, positive where they fall outwards, degrees.
    OuterSlopeDeg,
    /// Height of a smooth dome over the radius, mm.
    HeightMm,
}

/// `[limits]`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LimitKeys {
    /// Least angle of a straight side of an element against the vertical, degrees; 0 to 45. Default
    /// 0.
    pub draft_deg: Option<f64>,
    /// Least interior angle of a sharp tip, degrees; 0 to 170. Default 0.
    pub apex_deg: Option<f64>,
    /// Largest height of the dome, mm; above 0. Default none.
    pub total_height_mm: Option<f64>,
    /// Least width of an element, µm; above 0. Default none.
    pub ring_width_um: Option<f64>,
    /// Least radius of tips of the relief, µm; above 0. Default none.
    pub tip_radius_um: Option<f64>,
    /// Least radius of valleys of the relief, µm; above 0. Default none.
    pub valley_radius_um: Option<f64>,
    /// True where the outline may lean over itself.
    #[serde(default)]
    pub overhang: bool,
}

/// `[objective]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ObjectiveKeys {
    /// Weighted terms that are added up; at least one.
    pub terms: Vec<TermKeys>,
    /// Tolerance file, relative to the problem file, over which the objective is taken; its `set`,
    /// `tolerances` and `correlations` hold for every candidate, the rest does not count.
    pub tolerances: Option<String>,
    /// Packages that are drawn for each candidate, with the same deviations for all candidates of a
    /// generation, and that share its paths; 3 to 1000. Default 8.
    pub samples: Option<usize>,
    /// Standard deviations from package to package that are added to the mean of the objective, 0
    /// to 6; 1.645 stands for the worst 5 % of a normal law. Default 0.
    pub deviations: Option<f64>,
}

/// Use of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermKeys {
    /// A figure of results (`receiver.NAME` is `flux.NAME`), `design.KEY` (the number under a
    /// dotted key that the design states, such as `design.array.pitch_mm`), `far_field_distance` or
    /// `illuminance_distance`.
    pub figure: String,
    /// Use of the figure.
    #[serde(default)]
    pub goal: Goal,
    /// Value sought, with `goal = "target"` alone.
    pub target: Option<f64>,
    /// A difference that counts as 1; 1e-12 to 1e12. Default 1.
    pub scale: Option<f64>,
    /// Weight of the term; 1e-12 to 1e12.
    #[serde(default = "one")]
    pub weight: f64,
    /// Target of a distance, relative to the problem file; with the two distances alone.
    pub file: Option<String>,
}

const fn one() -> f64 {
    1.0
}

/// `[[constraints]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstraintKeys {
    /// A figure as of a term, without distances.
    pub figure: String,
    /// Lower bound; this, `at_most` or both.
    pub at_least: Option<f64>,
    /// Upper bound.
    pub at_most: Option<f64>,
    /// Standard errors by which a bound is kept; 0 or above.
    #[serde(default = "two")]
    pub margin: f64,
}

const fn two() -> f64 {
    2.0
}

/// Method that selects candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// CMA-ES.
    #[default]
    CmaEs,
    /// CMA-ES with restarts of large and small populations by turns, each until it converges.
    Bipop,
    /// One step along each coefficient either way, then the gains together; half as far after a
    /// round without gain.
    Coordinate,
    /// Uniform in the bounds.
    Random,
    /// NSGA-II: the Pareto front of two terms, in the last stage alone, without `tolerances`.
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
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageKeys {
    /// Model of the traces. Default `"geometric"`.
    pub model: Option<Model>,
    /// Method that selects candidates.
    #[serde(default)]
    pub method: Method,
    /// Coefficients of every profile of slopes in this stage, at most one a ring. Default those of
    /// the variable.
    pub knots: Option<usize>,
    /// Most candidates, `population` to 10⁶. Default 100 × `population`.
    pub evaluations: Option<usize>,
    /// Runs of `"cma_es"`, which share the evaluations; the first starts at the design, others at
    /// random. A generation for each must fit; above 1 of `"cma_es"` alone. Default 3, or as many
    /// as fit.
    pub restarts: Option<usize>,
    /// Candidates of a generation (not of `"coordinate"`), 4 to 10 000. Default 4 + ⌊3 ln n⌋, n
    /// coefficients; 40 of `"nsga2"`.
    pub population: Option<usize>,
    /// Standard deviation (or step) at the start, as a share of the ranges; above 0 to 1. Default
    /// 0.2.
    pub step: Option<f64>,
    /// Paths of the first traces, 1000 to 10¹². Default 65 536.
    pub paths: Option<u64>,
    /// Most paths of a trace of the search, at least `paths`. Default 1 048 576 or `paths`.
    pub most_paths: Option<u64>,
    /// Keys of the design for traces of this stage alone, none that a variable names; `""` takes a
    /// key away.
    #[serde(default)]
    #[schemars(with = "AnyValues")]
    pub set: Settings,
}

/// `[verification]`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VerificationKeys {
    /// Models in which the result is traced. Default those of the stages.
    pub models: Option<Vec<Model>>,
    /// Paths of each trace, 1000 to 10¹². Default those of the design.
    pub paths: Option<u64>,
    /// Packages of each design, which share the paths, where the objective has tolerances; 3 to
    /// 1000. Default `objective.samples`.
    pub samples: Option<usize>,
}
