// SPDX-License-Identifier: MIT OR Apache-2.0
//! One stage of a search: candidates generation by generation, runs one after the other, and the
//! selection among what the runs found.
//!
//! Every generation has a seed of its own, so that no candidate is kept for a lucky one. Within a
//! generation all candidates have the same seed and paths, also those that replace refused ones.
//! Paths are doubled where the error of a ranking is too large for it ([`MAX_NOISE`]).

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::{Result, bail};

use metrics::Estimate;
use metrics::plural::count;
use results::figure_entry::FigureEntry;
use results::optimisation::{FinalCandidateEntry, GenerationEntry, MissedCandidate};
use runtime::progress::Progress;
use runtime::run_context::RunContext;
use search::bipop::Bipop;
use search::cma_es::{self, CmaEs};
use search::coordinate::{self, CoordinateSearch};
use search::normal::Normal;
use search::random::RandomSearch;
use search::{Minimiser, Point};
use simulate::seeds::mix;

use super::cost::{Pace, SELECTION, Work};
use super::evaluate::Evaluator;
use super::file::Method;
use super::log::{Candidate, Generation, GenerationEnd, Log};
use super::noise::noise;
use super::objective::Objective;
use super::outcome::{INFEASIBLE, Outcome};
use super::problem::StageSettings;
use super::shared_evaluations::Batch;
use super::variables::Variables;

/// Paths are doubled where the noise of a generation is a larger share of its scatter.
const MAX_NOISE: f64 = 0.7;
/// A search has converged when its standard deviations are below this share of the ranges.
const MIN_STEP: f64 = 2e-3;

/// One of the points among which a stage chooses.
pub(super) type FinalCandidate = (Point, FinalCandidateEntry);

/// Result of a stage.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StageResult {
    /// Best first.
    pub final_candidates: Vec<FinalCandidate>,
    /// Every generation of the search with its best candidate.
    pub generations: Vec<GenerationEntry>,
    /// Candidates traced or refused.
    pub evaluations: usize,
    /// Reasons of refusals with their numbers, most frequent first.
    pub refusals: Vec<(String, usize)>,
    /// Candidate that came nearest to meeting the constraints, where none met them.
    pub nearest: Option<Candidate>,
    /// Candidate with the best objective of those that miss a constraint.
    pub missed: Option<Candidate>,
    /// True where the budget of time ended it.
    pub cut_short: bool,
    /// Points of the Pareto front, by the first term; empty of a search for one objective.
    pub front: Vec<Point>,
}

impl StageResult {
    /// The candidate with the best objective, where it misses a constraint, for people.
    pub fn missed(&self, variables: &Variables, objective: &Objective) -> Option<MissedCandidate> {
        let best = self.generations.iter().filter(|one| one.feasible).filter_map(|one| one.best);
        let best = best.fold(f64::INFINITY, f64::min);
        let missed = self.missed.as_ref().filter(|one| one.objective.is_some_and(|o| o < best))?;
        Some(MissedCandidate {
            objective: FigureEntry::of_sum(
                Estimate::new(missed.objective?, missed.standard_error?),
                missed.interval,
            ),
            variables: variables.listed(&missed.point),
            misses: objective.missed(&missed.figures),
        })
    }
}

/// A search under way, beside its log.
pub(super) struct StageSearch<'a, 'b> {
    /// From 1.
    pub number: usize,
    pub evaluator: Evaluator<'a>,
    pub log: &'b mut Log,
    pub context: RunContext<'a>,
    /// Time at which the search began or was resumed.
    pub started: Instant,
    /// Time at which everything is to be done.
    pub deadline: Option<Instant>,
    /// Pace of the traces.
    pub pace: &'b mut Pace,
    /// Work that follows after the generations.
    pub work_after: Work,
    pub progress: &'b Progress,
}

/// Seed and paths of candidates that are ranked with each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Common {
    /// Number of the seed.
    seed: usize,
    paths: u64,
}

/// State that goes from one generation to the next.
pub(super) struct SearchState {
    paths: u64,
    generation: usize,
    common: Common,
    pub result: StageResult,
}

impl StageSearch<'_, '_> {
    pub(super) fn settings(&self) -> &StageSettings {
        self.evaluator.stage
    }

    /// Runs the search from `start`.
    ///
    /// # Errors
    /// An interrupt; a search without a single candidate that could be traced.
    pub fn run(mut self, start: &Point) -> Result<StageResult> {
        if self.settings().method == Method::Nsga2 {
            return self.front(start);
        }
        let mut state = SearchState::new(self.settings().paths);
        // The start is one of those to select from: a search never ends worse.
        let mut final_candidates = vec![(start.clone(), 0, f64::INFINITY)];
        let runs = match self.settings().method {
            Method::CmaEs => self.settings().restarts,
            _ => 1,
        };
        for run in 1..=runs {
            if state.result.cut_short {
                break;
            }
            let budget =
                (self.settings().evaluations - state.result.evaluations) / (runs - run + 1);
            let seed = mix(mix(self.context.seed ^ mix(self.number as u64)) ^ run as u64);
            // A wide search scatters far above the noise of few paths.
            state.paths = self.settings().paths;
            let mut search = self.search(start, run, budget, seed);
            self.generations(search.as_mut(), &mut state)?;
            final_candidates.extend(found(search.as_ref(), run));
        }
        self.select(final_candidates, &mut state)?;
        Ok(state.result)
    }

    fn search(&self, start: &Point, run: usize, budget: usize, seed: u64) -> Box<dyn Minimiser> {
        let stage = self.settings();
        let start = match run {
            1 => start.clone(),
            _ => Normal::new(seed).point(start.len()),
        };
        let cma_es = cma_es::Settings {
            sigma: stage.step,
            population: stage.population,
            smallest_step: MIN_STEP,
            ..cma_es::Settings::new(start.clone(), seed, budget)
        };
        match stage.method {
            Method::CmaEs => Box::new(CmaEs::new(cma_es)),
            Method::Bipop => Box::new(Bipop::new(cma_es)),
            Method::Coordinate => Box::new(CoordinateSearch::new(coordinate::Settings {
                start,
                step: stage.step,
                smallest_step: MIN_STEP,
                max_evaluations: budget,
            })),
            // The front has a loop of its own.
            Method::Random | Method::Nsga2 => {
                Box::new(RandomSearch::new(start.len(), stage.population, seed, budget))
            }
        }
    }

    fn generations(&mut self, search: &mut dyn Minimiser, state: &mut SearchState) -> Result<()> {
        loop {
            let points = search.ask();
            if points.is_empty() {
                return Ok(());
            }
            let Some(candidates) =
                self.next_generation(&points, state, search.reuses_population())?
            else {
                return Ok(());
            };
            let values: Vec<f64> = candidates.iter().map(Candidate::value).collect();
            search.tell(&values);
        }
    }

    /// The candidates of the next generation, judged; none where the time is over. Those that fill
    /// up the generation before are judged by its seed and paths.
    pub(super) fn next_generation(
        &mut self,
        points: &[Point],
        state: &mut SearchState,
        reuses_population: bool,
    ) -> Result<Option<Vec<Candidate>>> {
        let common = state.begin(reuses_population);
        let Some(generation) = self.generation(points, state.generation, common)? else {
            state.result.cut_short = true;
            return Ok(None);
        };
        state.paths = generation.end.next_paths;
        let candidates = generation.candidates.clone();
        state.book(generation);
        if let Some(best) = state.result.nearest.as_ref().and_then(|best| best.value) {
            let progress = format!("stage {}, best {best:.4}", self.number);
            self.progress.set_message(&progress);
        }
        Ok(Some(candidates))
    }

    /// A generation out of the log, or traced; none where the time is over.
    fn generation(
        &mut self,
        points: &[Point],
        number: usize,
        common: Common,
    ) -> Result<Option<Generation>> {
        let paths = common.paths;
        if let Some(known) = self.log.replayed(number, points)? {
            self.progress.inc(points.len() as u64);
            return Ok(Some(known));
        }
        let work = Work::new(points.len(), paths) + self.work_after;
        // The first generation is one to select from, whatever it takes.
        let is_first = number <= 1 && self.number == 1;
        if number > 0 && !is_first && !self.pace.allows(work, self.deadline) {
            return Ok(None);
        }
        let begun = Instant::now();
        let seed =
            mix(mix(self.context.seed) ^ mix(common.seed as u64) ^ ((self.number as u64) << 32));
        let context = RunContext { seed, ..self.context };
        // Points that make one design are one trace, by the same seed and paths.
        let mut places: BTreeMap<Vec<String>, usize> = BTreeMap::new();
        let mut distinct: Vec<Point> = Vec::new();
        let place_of = |point: &Point| {
            *places.entry(self.evaluator.variables.values(point)).or_insert_with(|| {
                distinct.push(point.clone());
                distinct.len() - 1
            })
        };
        let place_of: Vec<usize> = points.iter().map(place_of).collect();
        let batch = Batch {
            name: match number {
                0 => format!("the selection of stage {}", self.number),
                _ => format!("stage {}, generation {number}", self.number),
            },
            count: distinct.len(),
            points: &distinct,
            paths,
            progress: self.progress,
        };
        let (log, mut judged) = (&mut *self.log, Vec::new());
        let traced = self.evaluator.outcomes(&batch, context, |evaluator, k| {
            let what = format!("{}, candidate {}", batch.name, k + 1);
            let outcome = evaluator.evaluate(&distinct[k], paths, &what, context)?;
            // Alone they come in their order, and who reads the log sees each at once.
            if k == judged.len() {
                judged.push(outcome.clone());
                let known = place_of.iter().take_while(|place| **place <= k).count();
                log.begin(known, |i| Candidate::new(&points[i], evaluator, &judged[place_of[i]]))?;
            }
            Ok(outcome)
        })?;
        self.progress.inc((points.len() - distinct.len()) as u64);
        let is_traced = |one: &&Outcome| matches!(one, Outcome::Evaluated(_));
        let work = Work::new(traced.iter().filter(is_traced).count(), paths);
        self.pace.update(work, begun.elapsed().as_secs_f64());
        let outcomes: Vec<Outcome> = place_of.iter().map(|k| traced[*k].clone()).collect();
        let candidates = points.iter().zip(&outcomes);
        let candidates: Vec<Candidate> = candidates
            .map(|(point, outcome)| Candidate::new(point, &self.evaluator, outcome))
            .collect();
        let judged = outcomes.into_iter().filter_map(|one| one.evaluation().ok());
        let noise = noise(&judged.collect::<Vec<_>>(), &self.evaluator.objective.constraints);
        let coarse = noise.is_some_and(|noise| noise > MAX_NOISE);
        let generation = Generation {
            end: GenerationEnd {
                stage: self.number,
                generation: number,
                candidates: candidates.len(),
                paths,
                next_paths: if coarse {
                    (2 * paths).min(self.settings().most_paths)
                } else {
                    paths
                },
                noise,
                tables: self.evaluator.tables,
                seconds: self.started.elapsed().as_secs_f64(),
            },
            candidates,
        };
        self.log.add(&generation)?;
        Ok(Some(generation))
    }

    /// Judges what the runs found by more paths and a seed of its own.
    pub(super) fn select(
        &mut self,
        found: Vec<(Point, usize, f64)>,
        state: &mut SearchState,
    ) -> Result<Vec<Candidate>> {
        let points: Vec<Point> = found.iter().map(|(point, ..)| point.clone()).collect();
        let common = Common { seed: 0, paths: SELECTION * self.settings().most_paths };
        // Generation 0 is never refused for lack of time.
        let Some(Generation { candidates, .. }) = self.generation(&points, 0, common)? else {
            return Ok(Vec::new());
        };
        let mut final_candidates: Vec<FinalCandidate> = candidates
            .iter()
            .zip(found)
            .map(|(candidate, (point, run, search_value))| {
                let entry = FinalCandidateEntry {
                    run,
                    in_search: Some(search_value).filter(|value| *value < INFEASIBLE),
                    value: candidate.value,
                    standard_error: candidate.standard_error,
                    // The value of one that misses constraints is a penalty.
                    interval: candidate.interval.filter(|_| candidate.feasible),
                    feasible: candidate.feasible,
                    misses: self.evaluator.objective.missed(&candidate.figures),
                };
                (point, entry)
            })
            .collect();
        let value = |(_, one): &FinalCandidate| one.value.unwrap_or(f64::INFINITY);
        final_candidates.sort_by(|a, b| value(a).total_cmp(&value(b)));
        if final_candidates.iter().all(|(_, one)| one.value.is_none()) {
            let why = state.result.refusals.first();
            let why = why.map_or_else(|| "nothing was traced".to_owned(), |(why, _)| why.clone());
            bail!(
                "stages[{}]: expected a candidate that can be traced, got none in {}: {why}",
                self.number,
                count(state.result.evaluations, "candidate")
            );
        }
        state.result.final_candidates = final_candidates;
        Ok(candidates)
    }
}

impl SearchState {
    pub fn new(paths: u64) -> Self {
        Self {
            paths,
            generation: 0,
            common: Common { seed: 0, paths },
            result: StageResult {
                final_candidates: Vec::new(),
                generations: Vec::new(),
                evaluations: 0,
                refusals: Vec::new(),
                nearest: None,
                missed: None,
                cut_short: false,
                front: Vec::new(),
            },
        }
    }

    /// Begins a generation: what its candidates have in common, which those that fill up the one
    /// before share with it.
    fn begin(&mut self, reuses_population: bool) -> Common {
        self.generation += 1;
        if !reuses_population {
            self.common = Common { seed: self.generation, paths: self.paths };
        }
        self.common
    }

    /// Books what a generation showed.
    fn book(&mut self, generation: Generation) {
        let result = &mut self.result;
        result.evaluations += generation.candidates.len();
        for candidate in &generation.candidates {
            if let Some(why) = &candidate.refused {
                // Alike but for their numbers.
                let alike = |known: &str| words(known) == words(why);
                match result.refusals.iter_mut().find(|(known, _)| alike(known)) {
                    Some((_, number)) => *number += 1,
                    None => result.refusals.push((why.clone(), 1)),
                }
            }
        }
        result.refusals.sort_by_key(|(_, number)| Reverse(*number));
        let missed = generation.candidates.iter().filter(|candidate| !candidate.feasible);
        let objective = |candidate: &Candidate| candidate.objective.unwrap_or(f64::INFINITY);
        let missed = missed.chain(&result.missed).filter(|one| one.objective.is_some());
        let missed = missed.min_by(|a, b| objective(a).total_cmp(&objective(b)));
        result.missed = missed.cloned();
        let best = generation.candidates.into_iter();
        let best = best.min_by(|a, b| a.value().total_cmp(&b.value()));
        let best = best.filter(|candidate| candidate.value.is_some());
        let GenerationEnd { generation: number, candidates, paths, noise, .. } = generation.end;
        result.generations.push(GenerationEntry {
            generation: number,
            candidates,
            paths,
            best: best.as_ref().and_then(|best| best.value),
            standard_error: best.as_ref().and_then(|best| best.standard_error),
            feasible: best.as_ref().is_some_and(|best| best.feasible),
            noise,
        });
        if let Some(best) = best
            && result.nearest.as_ref().is_none_or(|known| best.value() < known.value())
        {
            result.nearest = Some(best);
        }
    }
}

/// A reason without its numbers.
fn words(why: &str) -> String {
    why.chars().filter(|c| !c.is_ascii_digit() && !".-".contains(*c)).collect()
}

/// Mean of the last distribution and best candidate of every run, with the best value.
fn found(search: &dyn Minimiser, run: usize) -> Vec<(Point, usize, f64)> {
    let mut found = Vec::new();
    for (number, (favourite, best)) in (run..).zip(search.found()) {
        let value = best.as_ref().map_or(f64::INFINITY, |best| best.value);
        let best = best.map(|best| best.point).filter(|point| *point != favourite);
        let points = [Some(favourite), best].into_iter().flatten();
        found.extend(points.map(|point| (point, number, value)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_that_fill_up_a_generation_have_its_seed_and_paths() {
        let mut state = SearchState::new(1000);
        let first = state.begin(false);
        state.paths = 2000;
        assert_eq!(state.begin(true), first);
        assert_eq!((first.paths, state.generation), (1000, 2));
        let next = state.begin(false);
        assert_eq!(next.paths, 2000);
        assert_ne!(next.seed, first.seed);
    }
}
