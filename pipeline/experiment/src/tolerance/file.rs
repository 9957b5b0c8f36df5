// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tolerance file as written: one field for each key, unchecked
//! (`docs/reference/tolerance-file.md`).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use design::dotted_keys::Settings;
use design::json_schema::AnyValues;
use simulate::model::Model;

use crate::checked_file::FileKeys;
use crate::ring_slopes::Side;

/// A whole tolerance file.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToleranceFile {
    /// Name of the analysis.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Design file, relative to the tolerance file.
    pub design: String,
    /// Keys of the design by dotted path that are set before anything deviates; `""` takes a key
    /// away.
    #[serde(default)]
    #[schemars(with = "AnyValues")]
    pub set: Settings,
    /// Model of the traces. Default `"geometric"`.
    pub model: Option<Model>,
    /// Packages, 8 to 100 000; `--samples` replaces it. Default 200.
    pub samples: Option<usize>,
    /// Paths of each trace, 1000 to 10¹²; `--paths` replaces it. Default those of the design.
    pub paths: Option<u64>,
    /// Figures to report. Default all of `results.json` that the design has.
    pub figures: Option<Vec<String>>,
    /// Keys and slopes that deviate; at least one.
    pub tolerances: Vec<ToleranceKeys>,
    /// Correlations between tolerances, together positive definite.
    #[serde(default)]
    pub correlations: Vec<CorrelationKeys>,
    /// Bounds of figures, which a good package keeps.
    #[serde(default)]
    pub constraints: Vec<ConstraintKeys>,
}

impl FileKeys for ToleranceFile {
    // `[limits]` of a problem file are those of a mould.
    const FORMER: &[(&str, &str)] = &[("limits", "constraints")];
}

/// `[[tolerances]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToleranceKeys {
    /// Name in results; none twice. Default the (first) key or the profile.
    pub name: Option<String>,
    /// Key of the design by dotted path, entries of lists in brackets from 1; `[*]` stands for every
    /// entry of a list that the design states, also of lists in lists. This, `keys` or `profile`.
    pub key: Option<String>,
    /// Keys that deviate together, by one amount; in place of `key`.
    pub keys: Option<Vec<String>>,
    /// Slopes of all rings (triangles, steps, smooth ones), degrees; in place of `key`.
    pub profile: Option<Side>,
    /// Law of the deviations.
    #[serde(default)]
    pub distribution: Distribution,
    /// Standard deviation of a normal or truncated law, in the unit of the key; above 0.
    pub deviation: Option<f64>,
    /// Largest deviation of a uniform or truncated law, in the unit of the key; above 0.
    pub half_width: Option<f64>,
    /// Value without deviation, where the design does not state the key.
    pub nominal: Option<f64>,
    /// True where all entries that the key or the profile stands for deviate alike.
    #[serde(default)]
    pub common: bool,
    /// True where the deviation is a share of each value: keys that go together, of coordinates, then
    /// scale a body about its own origin. Not of a `profile`.
    #[serde(default)]
    pub relative: bool,
}

/// Laws of deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Normal.
    #[default]
    Normal,
    /// Uniform, up to `half_width` to either side.
    Uniform,
    /// Normal, drawn again beyond `half_width`.
    Truncated,
}

/// `[[correlations]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CorrelationKeys {
    /// Names of two normal tolerances of as many entries.
    pub between: Vec<String>,
    /// Correlation coefficient of their deviations, between -1 and 1.
    pub coefficient: f64,
}

/// `[[constraints]]`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstraintKeys {
    /// A reported figure.
    pub figure: String,
    /// Lower bound; this, `at_most` or both.
    pub at_least: Option<f64>,
    /// Upper bound.
    pub at_most: Option<f64>,
}
