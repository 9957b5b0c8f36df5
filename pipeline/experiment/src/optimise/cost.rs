// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cost of a search in paths and time: said before it starts, and kept to where a budget is given.

use std::iter::Sum;
use std::ops::Add;
use std::time::{Duration, Instant};

use metrics::digits::thousands;
use metrics::plural::count;
use simulate::model::Model;

use super::file::Method;
use super::objective::Constraint;
use super::problem::{Problem, StageSettings};

/// Paths of the traces among which the best is chosen, beside the largest number of the search.
pub(super) const SELECTION: u64 = 4;
/// Candidates of the selection of a run: its mean and its best.
const OF_A_RUN: usize = 2;
/// Runs of BIPOP that a selection is reckoned with: they are as many as converge.
const BIPOP_RUNS: usize = 4;

/// Work of traces.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Work {
    pub traces: f64,
    /// Of all traces.
    pub paths: f64,
}

impl Work {
    pub fn new(traces: usize, paths_of_each: u64) -> Self {
        Self { traces: traces as f64, paths: traces as f64 * paths_of_each as f64 }
    }
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { traces: self.traces + other.traces, paths: self.paths + other.paths }
    }
}

impl Sum for Work {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}

/// Pace of the traces of a search, by which its end is foreseen.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pace {
    seconds_per_trace: f64,
    seconds_per_path: f64,
}

impl Pace {
    /// The pace of two traces, the second of more paths, by their seconds.
    pub fn new([few, many]: [(u64, f64); 2]) -> Self {
        let paths = (many.0 - few.0) as f64;
        let seconds_per_path = ((many.1 - few.1) / paths).max(0.0);
        let seconds_per_trace = (few.1 - few.0 as f64 * seconds_per_path).max(0.0);
        Self { seconds_per_trace, seconds_per_path }
    }

    /// Time that `work` takes, s.
    pub fn seconds(self, work: Work) -> f64 {
        work.traces * self.seconds_per_trace + work.paths * self.seconds_per_path
    }

    /// Paths of each of `traces` that end before the deadline, after `work` of other traces.
    pub fn paths_until(self, traces: usize, work: Work, deadline: Instant) -> u64 {
        let left = deadline.saturating_duration_since(Instant::now()).as_secs_f64();
        let left = left - self.seconds(work + Work::new(traces, 0));
        (left / (traces as f64 * self.seconds_per_path)).max(0.0) as u64
    }

    /// True where `work` ends before the deadline.
    pub fn allows(self, work: Work, deadline: Option<Instant>) -> bool {
        let time = Duration::from_secs_f64(self.seconds(work).min(1e9));
        deadline.is_none_or(|deadline| Instant::now() + time <= deadline)
    }

    /// Takes the pace of `work` that took `seconds`.
    pub fn update(&mut self, work: Work, seconds: f64) {
        let expected = self.seconds(work);
        if expected > 0.0 {
            self.seconds_per_trace *= seconds / expected;
            self.seconds_per_path *= seconds / expected;
        }
    }
}

/// Selection of `stage`, at most.
fn selection(stage: &StageSettings) -> Work {
    let candidates = match stage.method {
        Method::CmaEs => 1 + OF_A_RUN * stage.restarts,
        Method::Bipop => 1 + OF_A_RUN * BIPOP_RUNS,
        Method::Coordinate | Method::Random => 1 + OF_A_RUN,
        Method::Nsga2 => 1 + stage.population,
    };
    Work::new(candidates, SELECTION * stage.most_paths)
}

/// Work that follows after the generations of stage `number`, from 0: its selection and those of
/// later stages, sensitivities, verification, and the results of both designs.
pub(super) fn work_after(problem: &Problem, number: usize) -> Work {
    let selections: Work = problem.stages[number..].iter().map(selection).sum();
    let paths = problem.verification_paths.unwrap_or(problem.design.trace.paths);
    selections + sensitivities(problem) + Work::new(verifying_traces(problem), paths)
}

/// Work of the sensitivities.
pub(super) fn sensitivities(problem: &Problem) -> Work {
    let last = &problem.stages[problem.stages.len() - 1];
    let dimension = problem.variables.resumed_dimension(last.knots);
    let moved = if last.model == Model::Hybrid { 0 } else { 2 * dimension };
    Work::new(moved, last.most_paths)
}

/// Traces of the verification and of the results of both designs.
pub(super) fn verifying_traces(problem: &Problem) -> usize {
    let last = &problem.stages[problem.stages.len() - 1];
    let front = if last.method == Method::Nsga2 { last.population } else { 0 };
    2 + usize::from(!last.set.is_empty()) + front + 2 * problem.models.len()
}

/// Variables, objective, constraints, stages and paths, for people.
pub(crate) fn description(problem: &Problem) -> Vec<(&'static str, String)> {
    let stage = |stage: &StageSettings| {
        let candidates = count(thousands(stage.evaluations as u64), "candidate");
        format!("{candidates} by {} in {}", stage.method.name(), stage.model.word())
    };
    let stages: Vec<String> = problem.stages.iter().map(stage).collect();
    let constraints = problem.objective.constraints.iter().map(Constraint::words);
    let constraints: Vec<String> = constraints.collect();
    vec![
        ("variables", problem.variables.ranges_words().join("; ")),
        ("objective", problem.objective.words().join("; ")),
        ("constraints", constraints.join("; ")),
        ("stages", stages.join("; ")),
        ("paths", paths_words(problem)),
    ]
}

/// Paths of the search, then of what follows, for people.
fn paths_words(problem: &Problem) -> String {
    let [least, most] = paths(problem);
    format!(
        "at most {} candidates with {} paths, then up to {} for selection, sensitivities and \
         verification",
        thousands(least.traces as u64),
        range([least, most].map(|work| thousands(work.paths as u64))),
        thousands(work_after(problem, 0).paths as u64),
    )
}

/// Candidates of all stages, by the least and by the most paths.
fn paths(problem: &Problem) -> [Work; 2] {
    [|s: &StageSettings| s.paths, |s: &StageSettings| s.most_paths]
        .map(|of| problem.stages.iter().map(|s| Work::new(s.evaluations, of(s))).sum::<Work>())
}

fn range([least, most]: [String; 2]) -> String {
    if least == most { least } else { format!("{least} to {most}") }
}

/// Line for people on the cost of the search, by the pace of a pilot.
pub(super) fn words(problem: &Problem, pace: Pace) -> String {
    let [least, most] = paths(problem);
    let after = work_after(problem, 0);
    let tables =
        if problem.models.contains(&Model::Hybrid) { ", beside tables of orders" } else { "" };
    let time = |work: Work| time_words(pace.seconds(work + after));
    format!("{}; about {}{tables}", paths_words(problem), range([least, most].map(time)))
}

/// A time for people.
pub(super) fn time_words(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{:.0} s", s.max(1.0)),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paces_tell_traces_from_their_paths() {
        // 0.1 s a trace and a millisecond for a thousand paths.
        let mut pace = Pace::new([(1000, 0.101), (65_000, 0.165)]);
        assert!((pace.seconds(Work::new(10, 100_000)) - 2.0).abs() < 1e-9);
        pace.update(Work::new(1, 100_000), 0.4);
        assert!((pace.seconds(Work::new(10, 100_000)) - 4.0).abs() < 1e-9);
        let soon = Some(Instant::now() + Duration::from_secs(3));
        assert!(!pace.allows(Work::new(10, 100_000), soon));
        assert!(pace.allows(Work::new(2, 100_000), soon));
        assert!(pace.allows(Work::new(1000, 100_000), None));
    }
}
