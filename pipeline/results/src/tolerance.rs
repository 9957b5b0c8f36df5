// SPDX-License-Identifier: MIT OR Apache-2.0
//! `tolerance.json` as a file: the same types write it and read it.
//!
//! The reference is `docs/reference/tolerance-file.md`. No time and no host appear in it, so that
//! the same analysis and seed give the same bytes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use metrics::digits::significant;
use metrics::plural::count;
use metrics::quantity::Unit;
use metrics::{Bounds, Estimate};
use runtime::provenance::FileRecord;

use super::figure_entry::FigureEntry;
use super::schema::Program;
use super::sealed_file::SealedFile;
use super::shown;

/// File under the directory of results.
pub const FILE: &str = "tolerance.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 3;

/// A share of so many standard errors is seen.
const SEEN: f64 = 2.0;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToleranceResultsFile {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// Program.
    pub program: Program,
    /// Name of the analysis.
    pub name: String,
    /// One line for people.
    pub description: String,
    /// Name of the design.
    pub design: String,
    /// Key of the model.
    pub model: String,
    /// Number of packages.
    pub samples: usize,
    /// Paths of each package.
    pub paths: u64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// Files that came out.
    pub files: Vec<FileRecord>,
    /// Names of the tolerances.
    pub tolerances: Vec<String>,
    /// Statistics of figures, by key.
    pub figures: BTreeMap<String, ToleranceFigureEntry>,
    /// Constraints of a package.
    pub constraints: Vec<BoundEntry>,
    /// Packages that meet it; none without constraints.
    #[serde(rename = "yield")]
    pub yielded: Option<YieldEntry>,
    /// Distribution of the first figure of the analysis; none where it has no scatter.
    pub distribution: Option<DistributionEntry>,
    /// Figures that some packages lack, so that they have no statistics, with the reason.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub unread: BTreeMap<String, String>,
    /// Reasons of packages that make no design.
    pub without_design: Vec<String>,
}

/// Statistics of a figure over the packages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToleranceFigureEntry {
    /// Symbol of the unit of a figure that depends on the light; empty where its key says it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Without deviations.
    pub nominal: FigureEntry,
    /// Of the packages.
    pub mean: Estimate,
    /// `mean` less `nominal`.
    pub shift: FigureEntry,
    /// Standard deviation from package to package, without the noise of traces; none where it is
    /// not seen above that noise.
    pub deviation: Option<Estimate>,
    /// Upper bound of such a deviation, at 95 % confidence.
    pub deviation_below: Option<f64>,
    /// Root mean square error of a trace.
    pub noise_of_a_trace: f64,
    /// By level, ascending; none where the deviation is not seen.
    pub quantiles: Vec<QuantileEntry>,
    /// Shares of the variance; none of a single tolerance, of too few packages, or where the
    /// deviation is not seen.
    pub contributions: Option<ContributionsEntry>,
}

impl SealedFile for ToleranceResultsFile {
    const FILE: &'static str = FILE;
    const VERSION: u32 = SCHEMA_VERSION;
    const WORK: &'static str = "analysis";
    const AGAIN: &'static str = "analyse again";

    fn files(&self) -> &[FileRecord] {
        &self.files
    }
}

impl ToleranceResultsFile {
    /// Unit of the figure under `key`.
    pub fn unit(&self, key: &str) -> Unit {
        self.figures.get(key).map_or_else(|| shown::named(key).1, |figure| figure.unit(key))
    }
}

/// Texts of a figure in a table.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureRow {
    /// Without deviations.
    pub nominal: String,
    /// Mean shift.
    pub shift: String,
    /// Standard deviation; none where it is not resolved.
    pub deviation: Option<String>,
    /// Noise of a trace.
    pub noise: String,
    /// By level.
    pub quantiles: Vec<(f64, String)>,
}

impl ToleranceFigureEntry {
    /// Unit of the figure, whose key is `key`.
    pub fn unit(&self, key: &str) -> Unit {
        Unit::from_name(&self.unit).unwrap_or(shown::named(key).1)
    }

    /// The figure under `key` in a table.
    pub fn row(&self, key: &str) -> FigureRow {
        let unit = self.unit(key);
        let quantile = |one: &QuantileEntry| (one.level, shown::estimate(one.quantile, unit));
        FigureRow {
            nominal: shown::text(&self.nominal, unit),
            shift: shown::difference_between(&self.shift, unit),
            deviation: self.deviation.map(|deviation| shown::difference(deviation, unit)),
            noise: shown::spread(self.noise_of_a_trace, unit),
            quantiles: self.quantiles.iter().map(quantile).collect(),
        }
    }
}

/// A quantile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QuantileEntry {
    /// Share of packages below it.
    pub level: f64,
    /// The quantile.
    #[serde(flatten)]
    pub quantile: Estimate,
}

/// Shares of the variance of a figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContributionsEntry {
    /// In the order of the file.
    pub by_tolerance: Vec<ContributionEntry>,
    /// Share that no straight line explains.
    pub unexplained: Estimate,
}

/// The share of one tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContributionEntry {
    /// Name.
    pub tolerance: String,
    /// Share of the variance.
    pub share: Estimate,
    /// Change of the figure for one standard deviation, of a tolerance of one entry.
    pub change_per_deviation: Option<Estimate>,
}

/// Bounds of a figure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoundEntry {
    /// Key of the figure.
    pub figure: String,
    /// Least value.
    pub at_least: Option<f64>,
    /// Largest value.
    pub at_most: Option<f64>,
}

impl BoundEntry {
    /// Both bounds.
    pub fn bounds(&self) -> Bounds {
        Bounds { at_least: self.at_least, at_most: self.at_most }
    }
}

/// Packages that meet all constraints; no number where noise decides which do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct YieldEntry {
    /// Their number.
    pub good: Option<usize>,
    /// Number of all packages.
    pub of: usize,
    /// Share of packages.
    pub share: Option<f64>,
    /// 95 % interval of the share.
    pub interval_95: Option<[f64; 2]>,
    /// Reason why there is no share.
    pub not_resolved: Option<String>,
}

impl YieldEntry {
    /// For people.
    pub fn words(&self) -> String {
        let (Some(good), Some(share), Some(interval)) = (self.good, self.share, self.interval_95)
        else {
            let why = self.not_resolved.as_deref().unwrap_or_default();
            return format!("not resolved: {why}");
        };
        let [low, high] = interval.map(|share| 100.0 * share);
        format!(
            "{good} of {}, {:.1} % (95 % interval {low:.1} to {high:.1} %)",
            count(self.of, "package"),
            100.0 * share
        )
    }
}

/// Sentence on figures whose scatter is not seen above the noise of a trace, by their names and the
/// `bounds` of their deviations; `None` without such figures.
pub fn unseen(bounds: &[String]) -> Option<String> {
    (!bounds.is_empty()).then(|| {
        format!(
            "not resolved: the noise of a trace hides the scatter, which is below, at 95 % \
             confidence: {}",
            bounds.join(", ")
        )
    })
}

/// A share of a variance for people: an upper bound where it is within two errors of 0.
pub fn share_words(share: Estimate) -> String {
    let Estimate { value, standard_error, .. } = share;
    if value.abs() > SEEN * standard_error {
        return shown::estimate(share, Unit::Fraction);
    }
    format!("not seen, < {} %", significant(100.0 * (value.max(0.0) + SEEN * standard_error)))
}

/// Distribution of a figure over the packages, without the noise of traces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DistributionEntry {
    /// Key of the figure.
    pub figure: String,
    /// Packages that it is of.
    pub packages: usize,
    /// Ascending: those of all packages, evenly thinned where there are many.
    pub shares: Vec<CumulativeShareEntry>,
}

/// A value with the share of packages at or below it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CumulativeShareEntry {
    /// Value of the figure.
    pub value: f64,
    /// Share of packages.
    pub share: f64,
    /// 95 % interval of the share.
    pub interval_95: [f64; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_variance_stand_in_percent() {
        assert_eq!(share_words(Estimate::new(0.83, 0.05)), "83.0 ± 5.0 %");
        assert_eq!(share_words(Estimate::new(0.02, 0.05)), "not seen, < 12 %");
    }
}
