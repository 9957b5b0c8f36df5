// SPDX-License-Identifier: MIT OR Apache-2.0
//! The objective over tolerances: the mean over packages that deviate from a candidate, and so many
//! standard deviations from package to package beside it.

use std::path::Path;

use anyhow::{Context, Result, ensure};

use design::dotted_keys::Settings;
use results::figure_entry::FigureEntry;
use results::paired_figure::PairedFigure;
use runtime::provenance::FileRecord;

use super::file::ObjectiveKeys;
use super::objective::{Evaluation, Objective};
use crate::checked_file::Texts;
use crate::design_file::DesignFile;
use crate::paired_sum::PairedSum;
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
    /// Packages of each design that is verified.
    verification_samples: usize,
    added: f64,
}

impl RobustObjective {
    /// The tolerances that `keys` name, with the files that go in; `verified` are the packages of
    /// the verification, where the problem states them.
    ///
    /// # Errors
    /// A tolerance file that cannot be used, numbers out of range.
    pub fn new(
        keys: &ObjectiveKeys,
        verified: Option<usize>,
        folder: &Path,
    ) -> Result<Option<(Self, Vec<FileRecord>)>> {
        let Some(file) = &keys.tolerances else {
            ensure!(
                verified.is_none(),
                "verification.samples: expected it beside objective.tolerances alone"
            );
            ensure!(
                keys.samples.is_none() && keys.deviations.is_none(),
                "objective.tolerances: expected a file beside `samples` and `deviations`"
            );
            return Ok(None);
        };
        let analysis = definition::load(&folder.join(file), &Texts::new(), Overrides::default())
            .context("objective.tolerances")?;
        let samples = keys.samples.unwrap_or(SAMPLES);
        let verification_samples = verified.unwrap_or(samples);
        for (key, samples) in [("objective", samples), ("verification", verification_samples)] {
            ensure!(
                (3..=1000).contains(&samples),
                "{key}.samples: expected 3 to 1000, got {samples}"
            );
        }
        let added = keys.deviations.unwrap_or(0.0);
        ensure!((0.0..=6.0).contains(&added), "objective.deviations: expected 0 to 6, got {added}");
        let robust = Self {
            set: analysis.set,
            deviations: analysis.deviations,
            samples,
            verification_samples,
            added,
        };
        Ok(Some((robust, analysis.inputs)))
    }

    /// The same over the packages of the verification.
    pub fn verified(&self) -> Self {
        Self { samples: self.verification_samples, ..self.clone() }
    }

    /// Refuses deviations of keys that the design of `source` does not hold.
    ///
    /// # Errors
    /// The first such key.
    pub fn check(&self, source: &DesignFile) -> Result<()> {
        Self { samples: 1, ..self.clone() }.packages(source, 0).map(drop)
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

    /// Mean and deviation of `packages`, whose traces are independent. Figures are means,
    /// by which `objective` judges the constraints.
    pub fn combine(&self, packages: &[Evaluation], objective: &Objective) -> Evaluation {
        let first = &packages[0];
        let all: Vec<&Evaluation> = packages.iter().collect();
        let value = |of: &dyn Fn(&Evaluation) -> f64| self.value(&all, of);
        let without_package = |k: usize| {
            let rest: Vec<&Evaluation> = [&all[..k], &all[k + 1..]].concat();
            self.value(&rest, &|one| one.objective.value)
        };
        let groups = packages.iter().map(|one| one.objective.without.len()).min().unwrap_or(0);
        let figures = first.figures.iter().filter_map(|(key, figure)| {
            // A package may lack one that nothing asks for.
            let all = packages.iter().map(|one| one.figure(key));
            let all: Vec<&PairedFigure> = all.collect::<Option<_>>()?;
            let mean = |of: &dyn Fn(&PairedFigure) -> f64| {
                all.iter().map(|figure| of(figure)).sum::<f64>() / all.len() as f64
            };
            let without = (0..figure.without.len()).map(|g| mean(&|f| f.without[g]));
            let without = without.collect();
            let mut over_packages = PairedFigure::new(mean(&|f| f.entry.value), without);
            let values: Vec<f64> = all.iter().map(|figure| figure.entry.value).collect();
            let of_packages = deviation(&values) / (values.len() as f64).sqrt();
            // Their scatter holds the noise of their paths.
            let entry = &mut over_packages.entry;
            let by_paths = entry.standard_error.hypot(mean(&PairedFigure::hidden_error));
            entry.standard_error = by_paths.max(of_packages);
            // Of figures that a package knows between two ends, the mean lies between their means.
            if all.iter().any(|figure| figure.entry.ends().is_some()) {
                let ends = |f: &PairedFigure| f.entry.ends().unwrap_or([f.entry.value; 2]);
                let [low, high] = [0, 1].map(|k| mean(&|f| ends(f)[k]));
                let unseen = |low: f64| (low == 0.0 && entry.value == 0.0).then_some(high);
                *entry = match unseen(low) {
                    None => FigureEntry { interval: Some([low, high]), ..*entry },
                    bound => FigureEntry { upper_bound: bound, ..*entry },
                };
            }
            Some((key.clone(), over_packages))
        });
        let figures: Vec<(String, PairedFigure)> = figures.collect();
        let of_packages = |error: fn(&Evaluation) -> f64| {
            packages.iter().map(error).sum::<f64>() / packages.len() as f64
        };
        Evaluation {
            objective: PairedSum {
                value: value(&|one| one.objective.value),
                without: (0..groups).map(|g| value(&|one| one.objective.without[g])).collect(),
                without_package: (0..packages.len()).map(without_package).collect(),
                hidden_error: of_packages(|one| one.objective.hidden_error),
                common_error: of_packages(|one| one.objective.common_error),
            },
            miss: objective.miss(&figures),
            figures,
        }
    }

    /// Mean and deviation of what `of` gives of `packages`, without what their own noise adds.
    fn value(&self, packages: &[&Evaluation], of: &dyn Fn(&Evaluation) -> f64) -> f64 {
        let values: Vec<f64> = packages.iter().map(|one| of(one)).collect();
        let n = values.len() as f64;
        let squared_errors = packages.iter().map(|one| one.objective.standard_error().powi(2));
        let noise = squared_errors.sum::<f64>() / n;
        let mean = values.iter().sum::<f64>() / n;
        mean + self.added * (deviation(&values).powi(2) - noise).max(0.0).sqrt()
    }
}

/// Standard deviation of `values` as a sample.
fn deviation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (n - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A package with an objective, two replicates about it, and a figure of opposite sign.
    fn package(value: f64, error: f64) -> Evaluation {
        let about = |value: f64| vec![value - error, value + error];
        let figure = PairedFigure::new(-value, about(-value));
        Evaluation {
            objective: PairedSum { value, without: about(value), ..PairedSum::default() },
            miss: 0.0,
            figures: vec![("extraction_efficiency".to_owned(), figure)],
        }
    }

    fn robust(added: f64) -> RobustObjective {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/designs/bare-dome.toml");
        let (source, _) = DesignFile::read(&path).expect("a design");
        let keys = toml::from_str("key = \"mirror.reflectance\"\ndeviation = 0.01");
        let keys = [keys.expect("TOML")];
        RobustObjective {
            set: Settings::new(),
            deviations: Deviations::new(&source, &keys, &[]).expect("a key"),
            samples: 5,
            verification_samples: 5,
            added,
        }
    }

    /// With a constraint of the figure of packages.
    fn objective() -> Objective {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/designs/bare-dome.toml");
        let (source, _) = DesignFile::read(&path).expect("a design");
        let term = toml::from_str("figure = \"uniformity\"").expect("TOML");
        let constraint = "figure = \"extraction_efficiency\"\nat_least = -2.0";
        let constraint = toml::from_str(constraint).expect("TOML");
        let folder = Path::new("");
        let (objective, _) =
            Objective::new(&[term], &[constraint], &source, folder).expect("an objective");
        objective
    }

    #[test]
    fn deviations_are_added_without_the_noise_of_traces() {
        let packages = [1.0, 2.0, 6.0].map(|value| package(value, 0.0));
        // Mean 3, variance (4 + 1 + 9) / 2 = 7.
        for (added, expected) in [(0.0, 3.0), (2.0, 3.0 + 2.0 * 7f64.sqrt())] {
            let all = robust(added).combine(&packages, &objective());
            assert!((all.objective.value - expected).abs() < 1e-12, "{}", all.objective.value);
            assert!((all.figures[0].1.entry.value + 3.0).abs() < 1e-12);
        }
        // Of the mean: the standard error of a mean of three. The deviation's own is known less well.
        let estimate = robust(0.0).combine(&packages, &objective()).objective.estimate();
        assert!((estimate.standard_error - (7.0f64 / 3.0).sqrt()).abs() < 1e-12);
        let figure = &robust(0.0).combine(&packages, &objective()).figures[0].1;
        assert!((figure.entry.standard_error - (7.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!(
            robust(2.0).combine(&packages, &objective()).objective.estimate().standard_error
                > estimate.standard_error
        );
        // Two replicates 0.5 to either side: a squared standard error of 0.25.
        let packages = [1.0, 2.0, 6.0].map(|value| package(value, 0.5));
        let all = robust(1.0).combine(&packages, &objective());
        assert!((all.objective.value - 3.0 - (7.0f64 - 0.25).sqrt()).abs() < 1e-12);
        // The constraint is judged by the mean, -3, and its error over packages, more than by paths.
        let error = all.figures[0].1.entry.standard_error;
        assert!((error - (7.0f64 / 3.0).sqrt()).abs() < 1e-12, "{error}");
        assert!((all.miss - 0.5 * (-2.0 + 2.0 * error + 3.0)).abs() < 1e-12);
        // Nothing but noise adds nothing.
        let alike = [2.0, 2.1, 2.2].map(|value| package(value, 0.5));
        assert!((robust(3.0).combine(&alike, &objective()).objective.value - 2.1).abs() < 1e-12);
    }

    #[test]
    fn packages_of_one_seed_deviate_alike_and_by_their_law() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/designs/bare-dome.toml");
        let (source, _) = DesignFile::read(&path).expect("a design");
        let robust = RobustObjective { samples: 400, ..robust(0.0) };
        let of = |seed: u64| -> Vec<f64> {
            let packages = robust.packages(&source, seed).expect("packages");
            let value = |file: &DesignFile| file.table["mirror"]["reflectance"].as_float();
            packages.iter().map(|file| value(file).expect("a number")).collect()
        };
        let drawn = of(3);
        assert_eq!(drawn, of(3));
        assert_ne!(drawn, of(4));
        let nominal = source.table["mirror"]["reflectance"].as_float().expect("a number");
        let n = drawn.len() as f64;
        let mean = drawn.iter().sum::<f64>() / n;
        let variance = drawn.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        // Standard errors of mean and variance of 400 normal numbers of deviation 0.01.
        assert!((mean - nominal).abs() < 4.0 * 0.01 / n.sqrt(), "{mean}");
        assert!((variance / 1e-4 - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{variance}");
    }
}
