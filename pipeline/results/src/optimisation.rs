// SPDX-License-Identifier: MIT OR Apache-2.0
//! `optimise.json` as a file: the same types write it and read it.
//!
//! The reference is `docs/reference/problem-file.md`. No time and no host appear in it, so that the
//! same problem and seed give the same bytes.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use metrics::estimate::DISTINCT;
use metrics::plural::count;
use metrics::quantity::Unit;
use metrics::{Bounds, Estimate};
use runtime::provenance::FileRecord;

use super::figure_entry::FigureEntry;
use super::schema::Program;
use super::sealed_file::SealedFile;
use super::shown;

/// File under the directory of results.
pub const FILE: &str = "optimise.json";
/// Version of the layout.
pub const SCHEMA_VERSION: u32 = 4;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OptimisationFile {
    /// [`SCHEMA_VERSION`] of the program that wrote it.
    pub schema_version: u32,
    /// Program.
    pub program: Program,
    /// Name of the problem and of the design found.
    pub name: String,
    /// Name of the design at the beginning.
    pub design: String,
    /// One line for people.
    pub description: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Files that went in.
    pub inputs: Vec<FileRecord>,
    /// Files that came out.
    pub files: Vec<FileRecord>,
    /// The objective; smaller is better.
    pub objective: ObjectiveEntry,
    /// Figures of the terms of the objective.
    #[serde(default)]
    pub terms: Vec<String>,
    /// All figures of both designs, and the others of objective and constraints, by key.
    pub figures: BTreeMap<String, ComparedFigure>,
    /// Constraints in the order of the problem.
    pub constraints: Vec<ConstraintEntry>,
    /// The Pareto front, where one was sought.
    pub front: Option<FrontEntry>,
    /// Limits at which the design stands.
    pub active_limits: Vec<String>,
    /// Coefficients of the variables in the last stage.
    pub coefficients: Vec<CoefficientEntry>,
    /// Searches in their order.
    pub stages: Vec<StageEntry>,
}

/// The objective of the designs at the beginning and found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObjectiveEntry {
    /// Verified, at the beginning, where it can be judged.
    pub before: Option<FigureEntry>,
    /// Verified, of the design found.
    pub after: FigureEntry,
    /// Their difference, paired by groups of paths and by packages.
    pub change: Option<FigureEntry>,
    /// Judgement of the change.
    pub verdict: Option<Verdict>,
    /// Best value that the search saw in the run of the design; none where the start was selected.
    pub in_search: Option<f64>,
    /// When it was selected.
    pub at_selection: Option<FigureEntry>,
    /// Verified, of the design found, with `set` of the last stage.
    pub as_in_search: FigureEntry,
    /// `as_in_search` less `in_search`.
    pub bias_of_search: Option<FigureEntry>,
}

impl ObjectiveEntry {
    /// For people: how the best value that the search saw compares with that by fresh paths; smaller is
    /// better.
    pub fn bias_in_words(&self) -> Option<String> {
        let bias = self.bias_of_search?;
        let words = |by: &FigureEntry| shown::number(by, Unit::Relative);
        let fresh = "by fresh paths in the same settings";
        Some(match Verdict::new(&bias, Some(true)) {
            Verdict::Better => format!("better by {} than {fresh}", words(&bias)),
            Verdict::Worse => format!("worse by {} than {fresh}", words(&bias.negated())),
            Verdict::Unchanged => format!("the same as {fresh}"),
            Verdict::NotResolved | Verdict::Changed => {
                format!(
                    "not different beyond errors from that {fresh}, {}",
                    words(&self.as_in_search)
                )
            }
        })
    }
}

/// A figure before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ComparedFigure {
    /// Symbol of the unit of a figure that depends on the light; empty where its key says it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// At the beginning.
    pub before: Option<FigureEntry>,
    /// Of the design found.
    pub after: FigureEntry,
    /// Their difference, paired by groups of paths.
    pub change: Option<FigureEntry>,
    /// Judgement of the change.
    pub verdict: Option<Verdict>,
}

/// Judgement of a change by its error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Beyond errors.
    Better,
    /// Beyond errors.
    Worse,
    /// Beyond errors, of a figure that is neither better nor worse.
    Changed,
    /// Within errors.
    NotResolved,
    /// No change, and no error of it.
    Unchanged,
}

impl Verdict {
    /// The verdict on `change` of a figure of which the larger of two values is better, the
    /// smaller, or neither. What lies between two ends counts three errors to each.
    pub fn new(change: &FigureEntry, larger_is_better: Option<bool>) -> Self {
        let is_placed = change.peak_place.is_off_axis();
        let change = change.between_ends().unwrap_or(change.estimate());
        let rises = change.value > 0.0;
        if is_placed && change.value == 0.0 && change.standard_error == 0.0 {
            return Self::Unchanged;
        }
        if !is_placed || change.value.abs() <= DISTINCT * change.standard_error {
            return Self::NotResolved;
        }
        match larger_is_better {
            None => Self::Changed,
            Some(larger) if larger == rises => Self::Better,
            Some(_) => Self::Worse,
        }
    }

    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "WORSE",
            Self::Changed => "changed",
            Self::NotResolved => "not resolved",
            Self::Unchanged => "unchanged",
        }
    }
}

/// A constraint and whether it is met.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConstraintEntry {
    /// Key of the figure.
    pub figure: String,
    /// Least value.
    pub at_least: Option<f64>,
    /// Largest value.
    pub at_most: Option<f64>,
    /// Standard errors by which the bound is kept.
    pub margin: f64,
    /// Verified value.
    pub value: Option<FigureEntry>,
    /// True if it is met, margin included.
    pub met: bool,
}

impl ConstraintEntry {
    /// Bounds.
    pub fn bounds(&self) -> Bounds {
        Bounds { at_least: self.at_least, at_most: self.at_most }
    }
}

/// A Pareto front of two figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrontEntry {
    /// Keys of the figures.
    pub figures: [String; 2],
    /// Both figures at the beginning, where they can be judged.
    pub before: Option<[FigureEntry; 2]>,
    /// Designs, by the first term.
    pub designs: Vec<FrontDesignEntry>,
}

/// A design of a Pareto front.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrontDesignEntry {
    /// File.
    pub design: String,
    /// Coefficients of the variables.
    pub coefficients: Vec<f64>,
    /// Both figures, verified.
    pub figures: [FigureEntry; 2],
    /// True if it meets the constraints as verified.
    pub feasible: bool,
    /// Constraints that it misses, each with by how much.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misses: Vec<String>,
}

/// A coefficient of a variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoefficientEntry {
    /// Key or profile with the number of the coefficient.
    pub variable: String,
    /// At the start of the last stage.
    pub start: f64,
    /// Value at the end of the search.
    pub found: f64,
    /// Choices that `start` and `found` are shares of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub choices: Option<[serde_json::Value; 2]>,
    /// Change of the objective for one unit, where it was looked at.
    pub sensitivity: Option<Estimate>,
}

/// A search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageEntry {
    /// Model of its traces.
    pub model: String,
    /// Method of the search.
    pub method: String,
    /// Most candidates.
    pub most_evaluations: usize,
    /// Runs.
    pub restarts: usize,
    /// Candidates of a generation.
    pub population: usize,
    /// Candidates traced or refused.
    pub evaluations: usize,
    /// True if the budget of time ended it.
    pub cut_short: bool,
    /// Most frequent reasons of refusals with their numbers.
    pub refusals: Vec<(String, usize)>,
    /// Candidate with the best objective, where it misses a constraint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missed: Option<MissedCandidate>,
    /// Generations in their order.
    pub generations: Vec<GenerationEntry>,
    /// Candidates of the selection, best first.
    pub final_candidates: Vec<FinalCandidateEntry>,
}

/// A generation and its best candidate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GenerationEntry {
    /// Number, from 1.
    pub generation: usize,
    /// Number of candidates.
    pub candidates: usize,
    /// Paths of each trace.
    pub paths: u64,
    /// Least value, none where nothing was traced.
    pub best: Option<f64>,
    /// Standard error.
    pub standard_error: Option<f64>,
    /// True if it meets the constraints.
    pub feasible: bool,
    /// Standard error of the values, as a share of their scatter.
    pub noise: Option<f64>,
}

/// A candidate with a better objective than all that meet the constraints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MissedCandidate {
    /// Its objective, as the search saw it.
    pub objective: FigureEntry,
    /// Its variables with their values, for people.
    pub variables: Vec<String>,
    /// Constraints that it misses, each with by how much.
    pub misses: Vec<String>,
}

/// A candidate of the selection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FinalCandidateEntry {
    /// Run, 0 for the start.
    pub run: usize,
    /// Best value of the run, as the search saw it.
    pub in_search: Option<f64>,
    /// Objective by the paths of the selection.
    pub value: Option<f64>,
    /// Standard error.
    pub standard_error: Option<f64>,
    /// Ends of the objective, where a figure of it is known between ends alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval: Option<[f64; 2]>,
    /// True if it meets the constraints.
    pub feasible: bool,
    /// Constraints that it misses, each with by how much.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misses: Vec<String>,
}

impl FinalCandidateEntry {
    /// The objective with its state; `None` of one that was refused.
    pub fn objective(&self) -> Option<FigureEntry> {
        let estimate = Estimate::new(self.value?, self.standard_error?);
        Some(FigureEntry::of_sum(estimate, self.interval))
    }
}

impl StageEntry {
    /// The best candidate of the selection of each run, by its number.
    pub fn runs(&self) -> Vec<(usize, FigureEntry)> {
        let mut runs: Vec<(usize, FigureEntry)> = Vec::new();
        for one in self.final_candidates.iter().filter(|one| one.run > 0) {
            let known = runs.iter().any(|(run, _)| *run == one.run);
            if let (Some(objective), false) = (one.objective(), known) {
                runs.push((one.run, objective));
            }
        }
        runs.sort_by_key(|(run, _)| *run);
        runs
    }
}

impl SealedFile for OptimisationFile {
    const FILE: &'static str = FILE;
    const VERSION: u32 = SCHEMA_VERSION;
    const WORK: &'static str = "search";
    const AGAIN: &'static str = "search again";

    fn files(&self) -> &[FileRecord] {
        &self.files
    }
}

impl OptimisationFile {
    /// Figures of a table for people, those that changed and those of objective and constraints, and
    /// a sentence on the rest.
    pub fn listed(&self) -> (Vec<(&str, &ComparedFigure)>, Option<String>) {
        let is_asked = |key: &String| {
            self.terms.contains(key) || self.constraints.iter().any(|c| c.figure == *key)
        };
        let still = [Verdict::NotResolved, Verdict::Unchanged];
        let is_still = |figure: &ComparedFigure| figure.verdict.is_some_and(|v| still.contains(&v));
        let all = self.figures.iter();
        let (listed, rest): (Vec<_>, Vec<_>) =
            all.partition(|(key, figure)| is_asked(key) || !is_still(figure));
        let counted = still.map(|verdict| {
            let number = rest.iter().filter(|(_, figure)| figure.verdict == Some(verdict)).count();
            (number > 0).then(|| format!("{number} {}", verdict.words()))
        });
        let counted: Vec<String> = counted.into_iter().flatten().collect();
        let others = count(rest.len(), "other figure");
        let words = (!rest.is_empty()).then(|| format!("{others}: {}", counted.join(", ")));
        (listed.into_iter().map(|(key, figure)| (key.as_str(), figure)).collect(), words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_search_saw_is_better_worse_or_not_told_apart() {
        let plain = |value: f64| FigureEntry::new(Estimate::new(value, 0.1));
        let words = |bias: FigureEntry| {
            let objective = ObjectiveEntry {
                before: None,
                after: plain(0.0),
                change: None,
                verdict: None,
                in_search: Some(0.0),
                at_selection: None,
                as_in_search: bias,
                bias_of_search: Some(bias),
            };
            objective.bias_in_words().expect("a bias")
        };
        let fresh = "by fresh paths in the same settings";
        assert_eq!(words(plain(0.5)), format!("better by 0.50 ± 0.10 than {fresh}"));
        assert_eq!(words(plain(-0.5)), format!("worse by 0.50 ± 0.10 than {fresh}"));
        let near = words(plain(-0.2));
        assert_eq!(near, format!("not different beyond errors from that {fresh}, -0.20 ± 0.10"));
        let open = FigureEntry { interval: Some([-1.0, -0.5]), ..plain(-0.7) };
        assert_eq!(words(open), format!("worse by 0.5 to 1 than {fresh}"));
        let open = FigureEntry { interval: Some([-1.0, 0.25]), ..open };
        assert!(words(open).starts_with("not different"), "{}", words(open));
    }
}
