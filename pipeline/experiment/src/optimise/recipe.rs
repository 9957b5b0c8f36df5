// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe of an optimisation: stages of search → selection → sensitivities → verification of the
//! result beside the design that it began with, both by paths of a fresh seed.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use arrays::cache::Cache;
use design::Design;
use design::dotted_keys::Settings;
use design::resolved::PATHS;
use metrics::digits::thousands;
use metrics::plural::count;
use results::optimisation::{CoefficientEntry, FILE, MissedCandidate};
use results::paired_figure::PairedFigure;
use runtime::atomic_file;
use runtime::interrupt::Interrupted;
use runtime::run_context::RunContext;
use search::Point;
use simulate::model::Model;
use simulate::model_traces::ModelTraces;
use simulate::observation::Observation;
use simulate::seeds::mix;
use simulate::trace_plan::DomeChoice;

use super::cost::{self, Pace, time_words};
use super::evaluate::Evaluator;
use super::file::Method;
use super::found_design::{FoundDesign, remove_front};
use super::front::FrontDesign;
use super::log::{self, Log};
use super::named_files::NamedFiles;
use super::objective::Evaluation;
use super::outcome::Outcome;
use super::outputs::{DESIGN, FRONT};
use super::problem::{Problem, StageSettings};
use super::robust::RobustObjective;
use super::sensitivities::sensitivities;
use super::shared_evaluations::{Batch, SharedEvaluations};
use super::stage::{StageResult, StageSearch};
use super::variables::Variables;
use crate::design_file::DesignFile;
use crate::missing_figure::{missing_figure, shown};

/// Number of the seed beside those of the search.
const VERIFICATION: u64 = 0x5eed;
/// Paths of a pilot.
const PILOT_PATHS: u64 = 65_536;

/// Recipe of an optimisation.
pub struct Recipe<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Cache of tables.
    pub cache: &'a Cache,
    /// Time for everything.
    pub budget: Option<Duration>,
    pub(super) begun: Instant,
    /// Pace of the traces, where a pilot has told.
    pub(super) pace: Option<Pace>,
    /// Evaluations shared with other processes.
    pub(super) shared: Option<&'a SharedEvaluations<'a>>,
}

/// A stage of the search with its result.
#[derive(Debug, Clone)]
pub struct StageOutcome {
    /// The stage as it ran.
    pub settings: StageSettings,
    pub(super) result: StageResult,
    pub(super) missed: Option<MissedCandidate>,
}

/// Result of an optimisation.
#[derive(Debug, Clone)]
pub struct Optimised {
    /// Stages in their order.
    pub stages: Vec<StageOutcome>,
    /// The design that was found, read again from its file.
    pub design: Design,
    /// Limits at which the design stands.
    pub active_limits: Vec<String>,
    /// Paths of the verification, instead of those of the design.
    pub verification_paths: Option<u64>,
    pub(super) verified: Verified,
}

/// Result of all stages.
pub(super) struct Searched {
    stages: Vec<StageOutcome>,
    /// Keys of the design found.
    settings: Settings,
    /// Variables of the last stage, and where it began and ended.
    variables: Variables,
    start: Point,
    best: Point,
    /// Pace of its traces.
    pace: Pace,
}

/// Evaluations of the designs that were found, by fresh paths.
#[derive(Debug, Clone)]
pub(super) struct Verified {
    /// Of the last stage.
    pub coefficients: Vec<CoefficientEntry>,
    pub before: Option<Evaluation>,
    pub after: Evaluation,
    /// The design found with `set` of the last stage.
    pub as_in_search: Evaluation,
    pub front: Vec<FrontDesign>,
}

impl<'a> Recipe<'a> {
    /// The recipe of `problem`, of whose candidates this process judges all.
    pub fn new(problem: &'a Problem, cache: &'a Cache, budget: Option<Duration>) -> Self {
        let begun = Instant::now();
        Self { problem, cache, budget, begun, pace: None, shared: None }
    }

    /// Traces the design that the search starts with, by few paths: refuses figures that it does
    /// not have, with the settings of every stage and of the verification, and takes the pace.
    ///
    /// # Errors
    /// Figures that a design does not have; those of the tracer; an interrupt.
    pub fn pilot(&mut self, context: RunContext) -> Result<()> {
        let problem = self.problem;
        let variables = &problem.variables;
        let start = variables.settings(&variables.start()?).unwrap_or_default();
        let none = Settings::new();
        let mut sets = vec![&none];
        sets.extend(problem.stages.iter().map(|stage| &stage.set));
        sets.sort_by_key(|set| set.len());
        sets.dedup();
        let context = RunContext { checkpoints: None, ..context.silent() };
        let mut traces = ModelTraces::of_search(self.cache);
        let mut trace = |design: &mut Design, paths: u64| -> Result<(Observation, f64)> {
            design.trace.paths = paths;
            let begun = Instant::now();
            let model = DomeChoice::Model(Model::Geometric);
            let seen = traces.observe(design, model, "", context)?;
            Ok((seen, begun.elapsed().as_secs_f64()))
        };
        for set in sets {
            let with = |settings: &Settings| settings.clone().into_iter().chain(set.clone());
            let all: [Settings; 2] = [with(&start).collect(), with(&none).collect()];
            // A start that makes no design is passed over.
            let made = all.iter().find_map(|s| Some((s, variables.source.with(s).ok()?)));
            let Some((settings, mut design)) = made else {
                continue;
            };
            let (seen, seconds) = trace(&mut design, PILOT_PATHS)?;
            self.check_figures(settings, &design, &seen).map_err(|why| self.about(why))?;
            if self.pace.is_none() {
                let few = *PATHS.start();
                let (_, of_few) = trace(&mut design, few)?;
                self.pace = Some(Pace::new([(few, of_few), (PILOT_PATHS, seconds)]));
            }
        }
        Ok(())
    }

    /// Refuses figures of objective and constraints that `seen`, a trace of the design that
    /// `settings` make, does not show.
    fn check_figures(
        &self,
        settings: &Settings,
        design: &Design,
        seen: &Observation,
    ) -> Result<()> {
        let (objective, source) = (&self.problem.objective, &self.problem.variables.source);
        let shown = shown(design, seen);
        for (key, figure) in objective.read_figures() {
            if !shown.iter().any(|known| known == figure) {
                return Err(missing_figure(&key, figure, &shown, design));
            }
        }
        let file = DesignFile::new(source.path.clone(), source.table_with(settings)?);
        objective.judge(&file, design, seen, false).map(drop)
    }

    /// Says what the search takes at most, and whether that fits into the budget.
    fn say_cost(&self, pace: Pace, deadline: Option<Instant>, context: RunContext) {
        context.console.say(&format!("{}: {}", self.problem.name, cost::words(self.problem, pace)));
        let after = cost::work_after(self.problem, 0);
        if let Some(budget) = self.budget.filter(|_| !pace.allows(after, deadline)) {
            context.console.warn(&format!(
                "{}: --budget: what follows after the search takes about {}, the budget is {}: a \
                 single generation is begun; lower most_paths or verification.paths",
                self.problem.inputs[0].file,
                time_words(pace.seconds(after)),
                time_words(budget.as_secs_f64())
            ));
        }
    }

    /// Searches, chooses and verifies; writes the log and the design into `out`. With `resume` the
    /// search goes on with the log there.
    ///
    /// Where the pieces of a job are merged, nothing is traced.
    ///
    /// # Errors
    /// Those of the tracer, the solver and the files; constraints that no candidate meets; an
    /// interrupt.
    pub fn run(&self, out: &Path, resume: bool, context: RunContext) -> Result<Optimised> {
        let key = self.problem.key(context.seed);
        let file = out.join(log::FILE);
        if !context.is_merging() {
            return self.run_with(Log::open(&file, key.hex(), resume)?, out, context);
        }
        let all = SharedEvaluations::new(key.hex(), None, context)?;
        let log = Log::open(&file, key.hex(), false)?;
        Recipe { shared: Some(&all), ..*self }.run_with(log, out, context)
    }

    fn run_with(&self, mut log: Log, out: &Path, context: RunContext) -> Result<Optimised> {
        let found = self.search(&mut log, context)?;
        // It lists the files that are replaced from here on.
        atomic_file::supersede(&out.join(FILE))?;
        remove_front(out)?;
        let designs = self.designs(&found)?.into_iter();
        let mut named = NamedFiles::new(self.problem, out);
        let designs = designs.map(|design| design.write(&mut named, out));
        let designs = designs.collect::<Result<Vec<_>>>()?;
        let verification_paths = self.affordable_paths(&designs[0].design, found.pace, context);
        let mut problem = self.problem.clone();
        problem.verification_paths = verification_paths;
        let recipe = Recipe { problem: &problem, ..*self };
        let verified = recipe.verify(&found, &designs, context)?;
        let design = designs[0].design.clone();
        Ok(Optimised {
            verification_paths,
            stages: found.stages,
            active_limits: [
                found.variables.limits.active(&design),
                found.variables.at_bounds(&found.best),
            ]
            .concat(),
            design,
            verified,
        })
    }

    /// Paths of the verification of `design`: those stated, or fewer, down to those of a candidate, where
    /// the budget leaves time for no more.
    fn affordable_paths(&self, design: &Design, pace: Pace, context: RunContext) -> Option<u64> {
        let (problem, stated) = (self.problem, self.verification_paths(design));
        let kept = problem.verification_paths;
        let Some(budget) = self.budget else { return kept };
        let (traces, before) = (cost::verifying_traces(problem), cost::sensitivities(problem));
        let affordable = pace.paths_until(traces, before, self.begun + budget);
        let paths = affordable.max(self.last_stage().paths).min(stated);
        if paths == stated {
            return kept;
        }
        context.console.warn(&format!(
            "{}: --budget: {} are left for the verification, not {}: its errors are larger",
            problem.inputs[0].file,
            count(thousands(paths), "path"),
            thousands(stated)
        ));
        Some(paths)
    }

    /// Runs all stages, each from where the one before ended.
    ///
    /// # Errors
    /// Errors of [`Recipe::run`].
    pub(super) fn search(&self, log: &mut Log, context: RunContext) -> Result<Searched> {
        let problem = self.problem;
        let started = Instant::now();
        let deadline = self.budget.map(|budget| self.begun + budget);
        if let Some(pace) = self.pace {
            self.say_cost(pace, deadline, context);
        }
        let mut pace = self.pace.unwrap_or_default();
        let mut found = Searched {
            stages: Vec::new(),
            settings: Settings::new(),
            variables: problem.variables.clone(),
            start: Point::new(),
            best: Point::new(),
            pace,
        };
        let all = problem.stages.len();
        for (number, stage) in (1..).zip(&problem.stages) {
            found.variables = problem.variables.resumed(&found.settings, stage.knots)?;
            found.start = found.variables.start()?;
            let what = format!("{} stage {number} of {all}", problem.name);
            let progress = context.console.progress(stage.evaluations as u64, &what);
            let search = StageSearch {
                number,
                evaluator: self.evaluator(&found.variables, stage),
                log: &mut *log,
                context,
                started,
                deadline,
                pace: &mut pace,
                work_after: cost::work_after(problem, number - 1),
                progress: &progress,
            };
            if let Some(why) = search.evaluator.refusal(&found.start) {
                let file = &problem.inputs[0].file;
                context.console.say(&format!(
                    "batwing: {file}: the start of stage {number} is refused, the search begins around \
                     it: {why}"
                ));
            }
            let result = search.run(&found.start);
            progress.finish_and_clear();
            let result = result.map_err(|error| self.about(error))?;
            found.best.clone_from(&result.final_candidates[0].0);
            // All that was set before stays; what this stage sets goes on top.
            found.settings.extend(found.variables.settings(&found.best)?);
            // A front has no best candidate.
            let missed = result.missed(&found.variables, &problem.objective);
            let missed = missed.filter(|_| stage.method != Method::Nsga2);
            found.stages.push(StageOutcome { settings: stage.clone(), result, missed });
        }
        self.feasible(&found.stages).map_err(|error| self.about(error))?;
        found.pace = pace;
        Ok(found)
    }

    /// The design that was found, then those of the Pareto front, where one was sought. They read
    /// files that they name beside the design of the problem.
    ///
    /// # Errors
    /// A design that does not pass its checks.
    pub(super) fn designs(&self, found: &Searched) -> Result<Vec<FoundDesign>> {
        let name = &self.problem.name;
        let of =
            |settings: &Settings, name, file| FoundDesign::new(self.problem, settings, name, file);
        let mut designs = vec![of(&found.settings, name.clone(), DESIGN.to_owned())?];
        for (number, point) in (1..).zip(&found.last_result().front) {
            let mut settings = found.settings.clone();
            settings.extend(found.variables.settings(point)?);
            let name = format!("{name}-{number:02}");
            designs.push(of(&settings, name, format!("{FRONT}{number:02}.toml"))?);
        }
        Ok(designs)
    }

    /// Judges the design of the problem and `designs` by paths of a fresh seed, and looks for
    /// sensitivities.
    ///
    /// # Errors
    /// Errors of [`Recipe::run`].
    pub(super) fn verify(
        &self,
        found: &Searched,
        designs: &[FoundDesign],
        context: RunContext,
    ) -> Result<Verified> {
        let coefficients = self.coefficients(found, context)?;
        let mut stage = self.last_stage().clone();
        // At the settings of the design.
        let of_search = std::mem::take(&mut stage.set);
        let robust = self.problem.robust.as_ref().map(RobustObjective::verified);
        let mut evaluator = self.evaluator(&found.variables, &stage);
        evaluator.robust = robust.as_ref();
        evaluator.reads_all = true;
        let source = &self.problem.variables.source;
        let best = &designs[0];
        let paths = self.verification_paths(&best.design);
        let as_in_search = best.file.table_with(&of_search)?;
        let as_in_search = DesignFile::new(best.file.path.clone(), as_in_search);
        let mut all = vec![(&best.file, paths), (source, paths)];
        if !of_search.is_empty() {
            all.push((&as_in_search, paths));
        }
        let point = std::slice::from_ref(&found.best);
        let outcomes = verification("the verification", &all, point, &mut evaluator, context)?;
        let mut outcomes = outcomes.into_iter();
        let mut next = || outcomes.next().context("expected the outcome of a design");
        let after = next()?.evaluation()?;
        // The design of the problem may lack what is judged.
        let before = next()?.evaluation().ok();
        let as_in_search =
            if of_search.is_empty() { after.clone() } else { next()?.evaluation()? };
        let front = designs[1..].iter();
        let front = front.map(|one| (&one.file, self.verification_paths(&one.design)));
        let points = &found.last_result().front;
        let front: Vec<_> = front.collect();
        let name = "the verification of the front";
        let front = verification(name, &front, points, &mut evaluator, context)?;
        let front = designs[1..].iter().zip(points).zip(front);
        let front = front.map(|((design, point), outcome)| {
            Ok(FrontDesign {
                file: design.name.clone(),
                coefficients: found.variables.coefficients(point),
                judged: outcome.evaluation()?,
            })
        });
        Ok(Verified {
            coefficients,
            before,
            after,
            as_in_search,
            front: front.collect::<Result<_>>()?,
        })
    }

    /// Paths of the verification of `design`.
    fn verification_paths(&self, design: &Design) -> u64 {
        let paths = self.problem.verification_paths;
        paths.unwrap_or(design.trace.paths)
    }

    /// The coefficients of the last stage with their sensitivities.
    fn coefficients(&self, found: &Searched, context: RunContext) -> Result<Vec<CoefficientEntry>> {
        let variables = &found.variables;
        let evaluator = self.evaluator(variables, self.last_stage());
        let sensitivities = sensitivities(evaluator, &found.best, context)?;
        let labels = variables.labels().into_iter().zip(sensitivities);
        let ends = [&found.start, &found.best].map(|point| variables.coefficients(point));
        let [start, best] = ends;
        let all = labels.zip(start.into_iter().zip(best));
        let choices = [&found.start, &found.best].map(|point| {
            let all = variables.choices(point);
            all.collect::<BTreeMap<_, _>>()
        });
        let all = all.map(|((label, sensitivity), (start, found))| CoefficientEntry {
            choices: choices[0]
                .get(&label)
                .cloned()
                .zip(choices[1].get(&label).cloned())
                .map(<[serde_json::Value; 2]>::from),
            variable: label,
            start,
            found,
            sensitivity,
        });
        Ok(all.collect())
    }

    fn last_stage(&self) -> &StageSettings {
        &self.problem.stages[self.problem.stages.len() - 1]
    }

    fn evaluator<'b>(
        &'b self,
        variables: &'b Variables,
        stage: &'b StageSettings,
    ) -> Evaluator<'b> {
        Evaluator::new(self.problem, variables, stage, self.cache, self.shared)
    }

    /// An error of the search with the file of the problem; an interrupt stays as it is.
    fn about(&self, error: anyhow::Error) -> anyhow::Error {
        if error.is::<Interrupted>() {
            return error;
        }
        error.context(self.problem.inputs[0].file.clone())
    }

    /// Refuses a search that met no candidate within the constraints.
    fn feasible(&self, stages: &[StageOutcome]) -> Result<()> {
        let last = &stages[stages.len() - 1].result;
        if last.final_candidates[0].1.feasible {
            return Ok(());
        }
        let nearest = stages.iter().filter_map(|s| s.result.nearest.as_ref());
        let nearest = nearest.min_by(|a, b| a.value().total_cmp(&b.value()));
        let candidates = stages.iter().map(|s| s.result.evaluations).sum::<usize>();
        let misses = nearest.map(|one| self.problem.objective.missed(&one.figures));
        anyhow::bail!(
            "constraints: expected a candidate that meets them, got none in {}; of the nearest, {}",
            count(candidates, "candidate"),
            misses.unwrap_or_default().join("; ")
        )
    }
}

/// Judges designs by paths of the verification; `points` are what they follow from.
fn verification(
    name: &str,
    designs: &[(&DesignFile, u64)],
    points: &[Point],
    evaluator: &mut Evaluator,
    context: RunContext,
) -> Result<Vec<Outcome>> {
    let context = RunContext { seed: mix(context.seed ^ mix(VERIFICATION)), ..context };
    let progress = context.console.progress(designs.len() as u64, name);
    let batch = Batch {
        name: name.to_owned(),
        count: designs.len(),
        points,
        paths: designs.first().map_or(1, |(_, paths)| *paths),
        progress: &progress,
    };
    let outcomes = evaluator.outcomes(&batch, context, |evaluator, number| {
        let (file, paths) = designs[number];
        evaluator.outcome(file, paths, &format!("{name}, {}", file.name), context)
    });
    progress.finish_and_clear();
    outcomes
}

impl Searched {
    fn last_result(&self) -> &StageResult {
        &self.stages[self.stages.len() - 1].result
    }
}

impl Optimised {
    /// Name of the figure of the first term, before and after.
    pub(super) fn figures(
        &self,
    ) -> impl Iterator<Item = (&str, Option<&PairedFigure>, &PairedFigure)> {
        let Verified { before, after, .. } = &self.verified;
        after.figures.iter().map(move |(key, after)| {
            let before = before.as_ref();
            (key.as_str(), before.and_then(|before| before.figure(key)), after)
        })
    }
}
