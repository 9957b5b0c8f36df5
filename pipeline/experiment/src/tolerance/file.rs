// SPDX-License-Identifier: MIT OR Apache-2.0
//! The tolerance file as written: one field for each key, unchecked
//! (`docs/reference/tolerance-file.md`).

use serde::Deserialize;

use design::dotted_keys::Settings;
use simulate::model::Model;

use crate::checked_file::FileKeys;
use crate::ring_slopes::Side;

/// A whole tolerance file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToleranceFile {
    /// Short name.
    pub name: String,
    /// One line for people.
    #[serde(default)]
    pub description: String,
    /// Design file, relative to the tolerance file.
    pub design: String,
    /// Keys of the design that are set before anything deviates.
    #[serde(default)]
    pub set: Settings,
    /// Model of the traces; absent: rays on the relief.
    pub model: Option<Model>,
    /// Number of samples.
    pub samples: Option<usize>,
    /// Paths of each sample's trace; absent: those of the design.
    pub paths: Option<u64>,
    /// Figures that are reported; absent: all.
    pub figures: Option<Vec<String>>,
    /// Deviations.
    pub tolerances: Vec<ToleranceKeys>,
    /// Correlations between tolerances, by name.
    #[serde(default)]
    pub correlations: Vec<CorrelationKeys>,
    /// Constraints on a package.
    #[serde(default)]
    pub constraints: Vec<ConstraintKeys>,
}

impl FileKeys for ToleranceFile {
    // `[limits]` of a problem file are those of a mould.
    const FORMER: &[(&str, &str)] = &[("limits", "constraints")];
}

/// `[[tolerances]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ToleranceKeys {
    /// Name in results; absent: the key.
    pub name: Option<String>,
    /// Key of the design by dotted path; `*` stands for every entry of a list.
    pub key: Option<String>,
    /// Slopes of the rings instead of a key.
    pub profile: Option<Side>,
    /// Law of the deviations.
    #[serde(default)]
    pub distribution: Distribution,
    /// Standard deviation of a normal law, in the unit of the key.
    pub deviation: Option<f64>,
    /// Largest deviation of a uniform or truncated law.
    pub half_width: Option<f64>,
    /// Value without deviation, of keys that the design does not state.
    pub nominal: Option<f64>,
    /// True where all entries that the key or the profile stands for deviate alike.
    #[serde(default)]
    pub common: bool,
}

/// Laws of deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Normal, of standard deviation `deviation`.
    #[default]
    Normal,
    /// Uniform, up to `half_width` to either side.
    Uniform,
    /// Normal, drawn again beyond `half_width`.
    Truncated,
}

/// `[[correlations]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CorrelationKeys {
    /// Names of two tolerances.
    pub between: Vec<String>,
    /// Correlation coefficient of their deviations.
    pub coefficient: f64,
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
}
