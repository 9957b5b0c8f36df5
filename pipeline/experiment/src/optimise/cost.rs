// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cost of a search in paths and time: said before it starts, and kept to where a budget is given.

use std::time::{Duration, Instant};

use metrics::digits::thousands;

use super::file::Method;
use super::problem::{Problem, StageSettings};
use super::stage::SELECTION;
use simulate::model::Model;

/// Candidates of the selection of a run: its mean and its best.
const OF_A_RUN: usize = 2;
/// Runs of BIPOP that a selection is reckoned with: they are as many as converge.
const BIPOP_RUNS: usize = 4;

/// Pace of the traces of a search, by which its end is foreseen.
#[derive(Debug, Clone)]
pub(super) struct Pace {
    pub seconds_per_path: f64,
    /// Time at which everything is to be done.
    pub deadline: Option<Instant>,
}

impl Pace {
    /// True where so many paths end before the deadline.
    pub fn allows(&self, paths: f64) -> bool {
        let time = Duration::from_secs_f64((paths * self.seconds_per_path).min(1e9));
        self.deadline.is_none_or(|deadline| Instant::now() + time <= deadline)
    }

    /// Takes the pace of `paths` traced in `seconds`.
    pub fn update(&mut self, paths: f64, seconds: f64) {
        if paths > 0.0 {
            self.seconds_per_path = seconds / paths;
        }
    }
}

/// Paths of the selection of `stage`, at most.
fn selection(stage: &StageSettings) -> f64 {
    let candidates = match stage.method {
        Method::CmaEs => 1 + OF_A_RUN * stage.restarts,
        Method::Bipop => 1 + OF_A_RUN * BIPOP_RUNS,
        Method::Coordinate | Method::Random => 1 + OF_A_RUN,
        Method::Nsga2 => 1 + stage.population,
    };
    candidates as f64 * (SELECTION * stage.most_paths) as f64
}

/// Paths that follow after the generations of stage `number`, from 0: its selection and those of
/// later stages, sensitivities, verification, and the results of both designs.
pub(super) fn paths_after(problem: &Problem, number: usize) -> f64 {
    let selections: f64 = problem.stages[number..].iter().map(selection).sum();
    let last = &problem.stages[problem.stages.len() - 1];
    let dimension = problem.variables.resumed_dimension(last.knots);
    let moved = if last.model == Model::Hybrid { 0 } else { 2 * dimension };
    let front = if last.method == Method::Nsga2 { last.population } else { 0 };
    let verified = 2 + usize::from(!last.set.is_empty()) + front;
    let traces = verified + 2 * problem.models.len();
    let paths = problem.verification_paths.unwrap_or(problem.design.trace.paths);
    selections + moved as f64 * last.most_paths as f64 + traces as f64 * paths as f64
}

/// Line for people on the cost of the search, by the pace of a pilot.
pub(super) fn words(problem: &Problem, pace: &Pace) -> String {
    let stages = problem.stages.iter();
    let candidates: usize = stages.clone().map(|stage| stage.evaluations).sum();
    let [least, most] = [|s: &StageSettings| s.paths, |s: &StageSettings| s.most_paths].map(|of| {
        stages.clone().map(|stage| stage.evaluations as f64 * of(stage) as f64).sum::<f64>()
    });
    let after = paths_after(problem, 0);
    let time = |paths: f64| time_words(paths * pace.seconds_per_path);
    let range = |least: String, most: String| match least == most {
        true => least,
        false => format!("{least} to {most}"),
    };
    let tables = match problem.models.contains(&Model::Hybrid) {
        true => ", beside tables of orders",
        false => "",
    };
    format!(
        "at most {} candidates with {} paths, then up to {} for selection, sensitivities and \
         verification; about {}{tables}",
        thousands(candidates as u64),
        range(thousands(least as u64), thousands(most as u64)),
        thousands(after as u64),
        range(time(least + after), time(most + after)),
    )
}

/// A time for people.
pub(super) fn time_words(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{:.0} s", s.max(1.0)),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}
