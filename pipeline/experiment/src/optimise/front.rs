// SPDX-License-Identifier: MIT OR Apache-2.0
//! A stage that seeks the Pareto front of the two terms of the objective, and the designs of the
//! front, each verified by fresh paths.

use anyhow::Result;

use design::dotted_keys::Settings;
use search::Point;
use search::nsga2::{Judgement, Nsga2, fronts};
use simulate::seeds::mix;

use super::log::Candidate;
use super::objective::{Evaluation, Objective};
use super::stage::{SearchState, StageResult, StageSearch};

/// A verified design of the front.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FrontDesign {
    /// File under the directory of results.
    pub file: String,
    /// Coefficients of the variables, in the units of the design.
    pub coefficients: Vec<f64>,
    /// Its figures.
    pub judged: Evaluation,
}

impl StageSearch<'_, '_> {
    /// Seeks the front from `start`.
    ///
    /// # Errors
    /// An interrupt; a search without a single candidate that could be traced.
    pub(super) fn front(mut self, start: &Point) -> Result<StageResult> {
        let settings = self.settings();
        let seed = mix(self.context.seed ^ mix(self.number as u64));
        let mut search = Nsga2::new(start, settings.population, seed, settings.evaluations);
        let mut state = SearchState::new(settings.paths);
        loop {
            let points = search.ask();
            if points.is_empty() {
                break;
            }
            let Some(candidates) = self.next_generation(&points, &mut state, false)? else {
                break;
            };
            let objective = self.evaluator.objective;
            let judged = candidates.iter().map(|one| judgement(objective, one));
            search.tell(&judged.collect::<Vec<_>>());
        }
        let found = search.front().iter().cloned();
        let mut found: Vec<_> = found.map(|point| (point, 1, f64::INFINITY)).collect();
        found.push((start.clone(), 0, f64::INFINITY));
        let found = self.distinct(found);
        let candidates = self.select(found, &mut state)?;
        state.result.front = first_front(self.evaluator.objective, &candidates);
        Ok(state.result)
    }

    /// The first of all points that make the same design.
    fn distinct(&self, found: Vec<(Point, usize, f64)>) -> Vec<(Point, usize, f64)> {
        let mut distinct: Vec<(Settings, (Point, usize, f64))> = Vec::new();
        for one in found {
            // A point that makes no design is refused when it is judged.
            let settings = self.evaluator.variables.settings(&one.0);
            let settings = settings.unwrap_or_default();
            if settings.is_empty() || distinct.iter().all(|(known, _)| *known != settings) {
                distinct.push((settings, one));
            }
        }
        distinct.into_iter().map(|(_, one)| one).collect()
    }
}

/// Worth of a candidate among others.
fn judgement(objective: &Objective, candidate: &Candidate) -> Judgement {
    let costs = objective.pair_of_costs(&candidate.figures);
    let miss = match (candidate.feasible, costs) {
        (true, Some(_)) => 0.0,
        (_, Some(_)) => candidate.value(),
        _ => f64::INFINITY,
    };
    Judgement { objectives: costs.unwrap_or([f64::INFINITY; 2]), miss }
}

/// Points that meet the constraints and that no other candidate dominates, by the first term.
fn first_front(objective: &Objective, candidates: &[Candidate]) -> Vec<Point> {
    let judged = candidates.iter().map(|one| judgement(objective, one));
    let judged: Vec<Judgement> = judged.collect();
    let mut first = fronts(&judged).into_iter().next().unwrap_or_default();
    first.retain(|k| judged[*k].miss <= 0.0);
    first.sort_by(|a, b| judged[*a].objectives[0].total_cmp(&judged[*b].objectives[0]));
    let points = first.into_iter().map(|k| candidates[k].point.clone());
    points.collect()
}
