// SPDX-License-Identifier: MIT OR Apache-2.0
//! What an optimisation says of itself: `optimise.json`, the log of generations as a table, and
//! lines for people. No time and no host appear in it, so that the same problem and seed give the
//! same bytes.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::front::FrontDesign;
use super::objective::Judged;
use super::problem::Problem;
use super::recipe::{Coefficient, Optimised, StageOutcome};
use super::stage::FinalCandidate;
use crate::digits::{format_value_with_error, thousands};
use crate::metrics::Estimate;
use crate::plural::count;
use crate::provenance::FileRecord;
use crate::quantity::Curve;

/// Version of the layout of `optimise.json`.
const SCHEMA_VERSION: u32 = 1;
/// Coefficients whose sensitivity is listed for people.
const LISTED: usize = 8;
/// Reasons of refusals that are listed.
const REASONS: usize = 5;

/// Both figures of the designs of a Pareto front.
#[derive(Debug, Clone, PartialEq)]
pub struct FrontFigures {
    /// Keys of the figures.
    pub names: [String; 2],
    /// The designs, by the first term.
    pub designs: Vec<[Estimate; 2]>,
    /// The design at the beginning, where it can be judged.
    pub before: Option<[Estimate; 2]>,
}

impl Optimised {
    /// The content of `optimise.json`.
    pub fn to_json(&self, problem: &Problem, seed: u64, files: &[FileRecord]) -> Value {
        let figures = self.figures().map(|(key, before, after)| {
            let entry = json!({
                "before": before.map(crate::metrics::JackknifedFigure::estimate),
                "after": after.estimate(),
                "change": before.map(|before| after.change(before)),
            });
            (key.to_owned(), entry)
        });
        let constraints = problem.objective.constraints.iter().map(|constraint| {
            let figure = self
                .after
                .figures
                .iter()
                .find(|(key, _)| *key == constraint.figure);
            json!({
                "figure": constraint.figure,
                "at_least": constraint.bounds.at_least,
                "at_most": constraint.bounds.at_most,
                "margin": constraint.margin,
                "value": figure.map(|(_, f)| f.estimate()),
                "met": figure.is_some_and(|(_, f)| constraint.is_met(f)),
            })
        });
        json!({
            "schema_version": SCHEMA_VERSION,
            "program": {"name": "batwing", "version": env!("CARGO_PKG_VERSION")},
            "name": problem.name,
            "description": problem.description,
            "seed": seed,
            "inputs": problem.inputs,
            "files": files,
            "objective": {
                "before": self.before.as_ref().map(Judged::estimate),
                "after": self.after.estimate(),
                "in_search": self.in_search(),
                "at_selection": self.at_selection(),
                "bias_of_search": self.in_search().map(|value| self.bias(value)),
            },
            "figures": figures.collect::<serde_json::Map<_, _>>(),
            "constraints": constraints.collect::<Vec<_>>(),
            "front": self.front.iter().map(FrontDesign::to_json).collect::<Vec<_>>(),
            "active_limits": self.active_limits,
            "coefficients": self.coefficients.iter().map(Coefficient::to_json).collect::<Vec<_>>(),
            "stages": self.stages.iter().map(StageOutcome::to_json).collect::<Vec<_>>(),
        })
    }

    /// Constraints that the verified figures do not meet.
    pub fn missed_constraints(&self, problem: &Problem) -> Vec<String> {
        let missed = problem
            .objective
            .constraints
            .iter()
            .filter_map(|constraint| {
                let figures = &self.after.figures;
                let (_, figure) = figures.iter().find(|(key, _)| *key == constraint.figure)?;
                (!constraint.is_met(figure)).then(|| {
                    format!(
                        "constraints: expected {} by {} standard errors, got {} when verified",
                        constraint.words(),
                        constraint.margin,
                        format_value_with_error(figure.value, figure.standard_error)
                    )
                })
            });
        missed.collect()
    }

    fn last(&self) -> &StageOutcome {
        &self.stages[self.stages.len() - 1]
    }

    /// The selected candidate.
    fn selected(&self) -> &FinalCandidate {
        &self.last().result.final_candidates[0]
    }

    /// Best value that the search saw in the run that the design comes from.
    fn in_search(&self) -> Option<f64> {
        Some(self.selected().search_value).filter(|value| value.is_finite())
    }

    fn at_selection(&self) -> Option<Estimate> {
        let selected = self.selected();
        selected
            .selection_error
            .map(|error| Estimate::new(selected.selection_value, error))
    }

    /// How much better than the verified objective `value` is.
    fn bias(&self, value: f64) -> Estimate {
        let after = self.after.estimate();
        Estimate::new(after.value - value, after.standard_error)
    }

    /// The convergence of the search: the best candidate of every generation that met the constraints
    /// over the number of candidates, and the verified objective before and after.
    ///
    /// # Errors
    /// Values that are no curve.
    pub fn convergence(&self) -> anyhow::Result<Vec<Curve>> {
        let (mut at, mut value, mut error) = (Vec::new(), Vec::new(), Vec::new());
        let mut candidates = 0.0;
        let generations = self
            .stages
            .iter()
            .flat_map(|stage| &stage.result.generations);
        for (end, best) in generations {
            candidates += end.candidates as f64;
            let feasible = best.as_ref().filter(|best| best.feasible);
            let found = feasible.and_then(|best| Some((best.value?, best.standard_error?)));
            if let Some((best, standard_error)) = found {
                at.push(candidates);
                value.push(best);
                error.push(standard_error);
            }
        }
        let level = |label: &str, e: Estimate| {
            Curve::new(
                label,
                vec![0.0, candidates],
                vec![e.value; 2],
                vec![e.standard_error; 2],
            )
        };
        let mut curves = Vec::new();
        if at.len() > 1 {
            curves.push(Curve::new(
                "best of a generation, in the search",
                at,
                value,
                error,
            )?);
        }
        if let Some(before) = &self.before {
            curves.push(level("verified before", before.estimate())?);
        }
        curves.push(level("verified after", self.after.estimate())?);
        Ok(curves)
    }

    /// Both figures of the designs of the Pareto front, in its order, and of the design at the
    /// beginning; none where no front was sought.
    pub fn front(&self, problem: &Problem) -> Option<FrontFigures> {
        let names = problem.objective.pair()?;
        let pair = |judged: &Judged| {
            let [first, second] = names.map(|key| judged.figure(key));
            Some([first?, second?])
        };
        let designs = self.front.iter().filter_map(|one| pair(&one.judged));
        let designs: Vec<[Estimate; 2]> = designs.collect();
        (!designs.is_empty()).then(|| FrontFigures {
            names: names.map(str::to_owned),
            designs,
            before: self.before.as_ref().and_then(pair),
        })
    }

    /// Lines for people.
    pub fn plain_text(&self, problem: &Problem) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        for (k, stage) in self.stages.iter().enumerate() {
            let paths = stage
                .result
                .generations
                .last()
                .map_or(0, |(end, _)| end.paths);
            let _ = writeln!(
                text,
                "stage {}: {} in {}, last with {} paths each{}",
                k + 1,
                count(stage.result.evaluations, "candidate"),
                count(stage.result.generations.len(), "generation"),
                thousands(paths),
                if stage.result.cut_short {
                    "; ended by the budget of time"
                } else {
                    ""
                }
            );
            for (why, number) in stage.result.refusals.iter().take(REASONS) {
                let _ = writeln!(text, "  refused {}: {why}", count(*number, "time"));
            }
        }
        let _ = writeln!(
            text,
            "\n{:<28} {:>18} {:>18}",
            "verified", problem.design.name, problem.name
        );
        let number = |e: Estimate| format_value_with_error(e.value, e.standard_error);
        for (key, before, after) in self.figures() {
            let before = before.map_or_else(String::new, |f| number(f.estimate()));
            let _ = writeln!(
                text,
                "{key:<28} {before:>18} {:>18}",
                number(after.estimate())
            );
        }
        let before = self
            .before
            .as_ref()
            .map_or_else(String::new, |j| number(j.estimate()));
        let _ = writeln!(
            text,
            "{:<28} {before:>18} {:>18}",
            "objective",
            number(self.after.estimate())
        );
        if let Some(value) = self.in_search() {
            let bias = self.bias(value);
            let _ = writeln!(
                text,
                "the search's own best value was {value:.4}, {} better than verified",
                number(bias)
            );
        }
        let runs = self.runs();
        if runs.len() > 1 {
            let listed: Vec<String> = runs
                .iter()
                .map(|(run, e)| format!("{} (run {run})", number(*e)))
                .collect();
            let _ = writeln!(
                text,
                "runs of the last stage ended at {}",
                listed.join(", ")
            );
        }
        if let Some(front) = self.front(problem) {
            let [first, second] = &front.names;
            let _ = writeln!(text, "\n{:<28} {first:>28} {second:>28}", "front, verified");
            for (design, [a, b]) in self.front.iter().zip(&front.designs) {
                let (a, b) = (number(*a), number(*b));
                let _ = writeln!(text, "{:<28} {a:>28} {b:>28}", design.file);
            }
        }
        if !self.active_limits.is_empty() {
            let _ = writeln!(text, "at the limits: {}", self.active_limits.join("; "));
        }
        let mut strongest: Vec<&Coefficient> = self.coefficients.iter().collect();
        strongest.retain(|c| {
            c.sensitivity
                .is_some_and(|s| s.value.abs() > 2.0 * s.standard_error)
        });
        let size = |c: &Coefficient| c.sensitivity.map_or(0.0, |s| s.value.abs());
        strongest.sort_by(|a, b| size(b).total_cmp(&size(a)));
        if !strongest.is_empty() {
            let _ = writeln!(text, "objective for one unit of:");
        }
        for c in strongest.into_iter().take(LISTED) {
            let sensitivity = c.sensitivity.map_or_else(String::new, number);
            let _ = writeln!(
                text,
                "  {:<26} {sensitivity:>18}, at {:.4}",
                c.label, c.found
            );
        }
        text
    }

    /// Best final candidate of each run of the last stage.
    fn runs(&self) -> Vec<(usize, Estimate)> {
        let mut runs: Vec<(usize, Estimate)> = Vec::new();
        for final_candidate in &self.last().result.final_candidates {
            let known = runs.iter().any(|(run, _)| *run == final_candidate.run);
            if let (Some(error), false, true) = (
                final_candidate.selection_error,
                known,
                final_candidate.run > 0,
            ) {
                runs.push((
                    final_candidate.run,
                    Estimate::new(final_candidate.selection_value, error),
                ));
            }
        }
        runs.sort_by_key(|(run, _)| *run);
        runs
    }
}

impl FrontDesign {
    fn to_json(&self) -> Value {
        let figures = self.judged.figures.iter();
        let figures = figures.map(|(key, figure)| (key.clone(), json!(figure.estimate())));
        json!({
            "design": self.file,
            "coefficients": self.coefficients,
            "figures": figures.collect::<serde_json::Map<_, _>>(),
        })
    }
}

impl Coefficient {
    fn to_json(&self) -> Value {
        json!({
            "variable": self.label,
            "start": self.start,
            "found": self.found,
            "sensitivity": self.sensitivity,
        })
    }
}

impl StageOutcome {
    fn to_json(&self) -> Value {
        let result = &self.result;
        let generations = result.generations.iter().map(|(end, best)| {
            json!({
                "generation": end.generation,
                "paths": end.paths,
                "best": best.as_ref().and_then(|b| b.value),
                "standard_error": best.as_ref().and_then(|b| b.standard_error),
                "noise": end.noise,
            })
        });
        let final_candidates = result.final_candidates.iter().map(|final_candidate| {
            json!({
                "run": final_candidate.run,
                "in_search": Some(final_candidate.search_value).filter(|v| v.is_finite()),
                "value": Some(final_candidate.selection_value).filter(|v| v.is_finite()),
                "standard_error": final_candidate.selection_error,
                "feasible": final_candidate.feasible,
            })
        });
        let settings = &self.settings;
        json!({
            "model": settings.model.word(),
            "method": settings.method.name(),
            "most_evaluations": settings.evaluations,
            "restarts": settings.restarts,
            "population": settings.population,
            "evaluations": result.evaluations,
            "cut_short": result.cut_short,
            "refusals": result.refusals.iter().take(REASONS).collect::<Vec<_>>(),
            "generations": generations.collect::<Vec<_>>(),
            "final_candidates": final_candidates.collect::<Vec<_>>(),
        })
    }
}
