// SPDX-License-Identifier: MIT OR Apache-2.0
//! The objective over tolerances: the mean over packages that deviate from a candidate, and so many
//! standard deviations from package to package beside it.

use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::file::ObjectiveKeys;
use super::objective::Judged;
use crate::config::dotted_keys::Settings;
use crate::metrics::JackknifedFigure;
use crate::provenance::FileRecord;
use crate::stages::design_file::DesignFile;
use crate::tolerance::definition::{self, Overrides};
use crate::tolerance::deviations::Deviations;

/// Packages that are drawn where the problem does not say.
const SAMPLES: usize = 8;
/// Tolerances of every candidate.
#[derive(Debug, Clone)]
pub(super) struct RobustObjective {
    set: Settings,
    deviations: Deviations,
    /// Packages of each candidate.
    pub samples: usize,
    added: f64,
}

impl RobustObjective {
    /// The tolerances that `keys` name, with the files that go in.
    ///
    /// # Errors
    /// A tolerance file that cannot be used, numbers out of range.
    pub fn new(keys: &ObjectiveKeys, folder: &Path) -> Result<Option<(Self, Vec<FileRecord>)>> {
        let Some(file) = &keys.tolerances else {
            ensure!(
                keys.samples.is_none() && keys.deviations.is_none(),
                "objective.tolerances: expected a file beside `samples` and `deviations`"
            );
            return Ok(None);
        };
        let analysis = definition::load(&folder.join(file), Overrides::default())
            .context("objective.tolerances")?;
        let samples = keys.samples.unwrap_or(SAMPLES);
        ensure!(
            (2..=1000).contains(&samples),
            "objective.samples: expected 2 to 1000, got {samples}"
        );
        let added = keys.deviations.unwrap_or(0.0);
        ensure!(
            (0.0..=6.0).contains(&added),
            "objective.deviations: expected 0 to 6, got {added}"
        );
        let robust = Self {
            set: analysis.set,
            deviations: analysis.deviations,
            samples,
            added,
        };
        Ok(Some((robust, analysis.inputs)))
    }

    /// Settings of the packages that deviate from the design of `candidate`; the same deviations
    /// for all candidates of one `seed`.
    ///
    /// # Errors
    /// Keys that the candidate does not have.
    pub fn packages(&self, candidate: &DesignFile, seed: u64) -> Result<Vec<DesignFile>> {
        let table = candidate.table_with(&self.set)?;
        let nominal = DesignFile::new(candidate.path.clone(), table);
        let mut random = Deviations::random(seed);
        let package = |_| -> Result<DesignFile> {
            let drawn = self.deviations.draw(&nominal, &mut random)?;
            let settings = self.deviations.settings(&nominal, &drawn)?;
            let table = nominal.table_with(&settings)?;
            Ok(DesignFile::new(candidate.path.clone(), table))
        };
        (0..self.samples).map(package).collect()
    }

    /// Mean and deviation of `packages`, whose traces are independent; figures are means, misses of
    /// constraints those of the means' worst package.
    pub fn combine(&self, packages: &[Judged]) -> Judged {
        let first = &packages[0];
        let noise = packages
            .iter()
            .map(|one| one.standard_error().powi(2))
            .sum::<f64>()
            / packages.len() as f64;
        let value = |of: &dyn Fn(&Judged) -> f64| {
            let n = packages.len() as f64;
            let mean = packages.iter().map(of).sum::<f64>() / n;
            let squares: f64 = packages.iter().map(|one| (of(one) - mean).powi(2)).sum();
            mean + self.added * (squares / (n - 1.0) - noise).max(0.0).sqrt()
        };
        let groups = packages
            .iter()
            .map(|one| one.without.len())
            .min()
            .unwrap_or(0);
        let figures = first.figures.iter().enumerate().map(|(k, (key, figure))| {
            let mean = |of: &dyn Fn(&JackknifedFigure) -> f64| {
                let all = packages.iter().map(|one| of(&one.figures[k].1));
                all.sum::<f64>() / packages.len() as f64
            };
            let without = (0..figure.without.len()).map(|g| mean(&|f| f.without[g]));
            let without = without.collect();
            (
                key.clone(),
                JackknifedFigure::new(mean(&|f| f.value), without),
            )
        });
        Judged {
            value: value(&|one| one.value),
            without: (0..groups).map(|g| value(&|one| one.without[g])).collect(),
            miss: packages.iter().map(|one| one.miss).fold(0.0, f64::max),
            figures: figures.collect(),
        }
    }
}
