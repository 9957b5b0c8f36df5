// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe of an optimisation: stages of search → selection → sensitivities → verification of the
//! result beside the design that it began with, both by paths of a fresh seed.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use super::evaluate::Evaluator;
use super::front::FrontDesign;
use super::log::{self, Log};
use super::objective::Judged;
use super::outcome::Outcome;
use super::problem::{Problem, StageSettings};
use super::robust::RobustObjective;
use super::shared_evaluations::{Batch, SharedEvaluations};
use super::stage::{StageResult, StageSearch};
use super::variables::Variables;
use crate::atomic_file;
use crate::cache::Cache;
use crate::config::design::Design;
use crate::config::dotted_keys::Settings;
use crate::interrupt::Interrupted;
use crate::metrics::{Estimate, JackknifedFigure, spread};
use crate::results::optimisation::FILE;
use crate::run_context::RunContext;
use crate::search::Point;
use crate::stages::design_file::DesignFile;
use crate::stages::model::Model;
use crate::stages::scene_check;
use crate::stages::seeds::mix;

/// The design that was found, under the directory of results.
pub const DESIGN: &str = "design.toml";
/// How files of the designs of a Pareto front begin.
const FRONT: &str = "front-";
/// Share of a range by which a coefficient is moved to see what it does.
const MOVE: f64 = 0.02;
/// Numbers of the seeds beside those of the search.
const VERIFICATION: u64 = 0x5eed;
const SENSITIVITY: u64 = 0x5e45;

/// How an optimisation is made.
pub struct Recipe<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Where tables come from and go to.
    pub cache: &'a Cache,
    /// Time for the search; what is begun is finished.
    pub budget: Option<Duration>,
    /// Who else judges candidates.
    pub(super) shared: Option<&'a SharedEvaluations<'a>>,
}

/// What a stage of the search found, for results.
#[derive(Debug, Clone)]
pub struct StageOutcome {
    /// The stage as it ran.
    pub settings: StageSettings,
    pub(super) result: StageResult,
}

/// A coefficient of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// Key or profile with the number of the coefficient.
    pub label: String,
    /// At the start of the last stage.
    pub start: f64,
    /// Where the search ended.
    pub found: f64,
    /// Change of the objective for one unit, where it was looked at.
    pub sensitivity: Option<Estimate>,
}

/// What an optimisation found.
#[derive(Debug, Clone)]
pub struct Optimised {
    /// Stages in their order.
    pub stages: Vec<StageOutcome>,
    /// The design that was found, read again from its file.
    pub design: Design,
    /// Coefficients of the last stage.
    pub coefficients: Vec<Coefficient>,
    /// Limits at which the design stands.
    pub active_limits: Vec<String>,
    pub(super) before: Option<Judged>,
    pub(super) after: Judged,
    /// The design found with `set` of the last stage.
    pub(super) as_in_search: Judged,
    pub(super) front: Vec<FrontDesign>,
}

/// What all stages found.
pub(super) struct Searched {
    stages: Vec<StageOutcome>,
    /// Keys of the design found.
    settings: Settings,
    /// Variables of the last stage, and where it began and ended.
    variables: Variables,
    start: Point,
    best: Point,
}

/// A design that was found, as its file will be.
pub(super) struct FoundDesign {
    /// Name under the directory of results.
    name: String,
    file: DesignFile,
    pub design: Design,
}

/// What fresh paths show of the designs that were found.
pub(super) struct Verified {
    coefficients: Vec<Coefficient>,
    before: Option<Judged>,
    after: Judged,
    /// The design found with `set` of the last stage.
    as_in_search: Judged,
    /// Of the designs of the front.
    front: Vec<Judged>,
}

impl<'a> Recipe<'a> {
    /// The recipe of `problem`, of whose candidates this process judges all.
    pub fn new(problem: &'a Problem, cache: &'a Cache, budget: Option<Duration>) -> Self {
        Self {
            problem,
            cache,
            budget,
            shared: None,
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
        if context.is_merging() {
            let all = SharedEvaluations::new(key.hex(), None, context)?;
            let shared = Recipe {
                shared: Some(&all),
                ..*self
            };
            return shared.run_with(
                Log::open(&out.join(log::FILE), key.hex(), false)?,
                out,
                context,
            );
        }
        self.run_with(
            Log::open(&out.join(log::FILE), key.hex(), resume)?,
            out,
            context,
        )
    }

    fn run_with(&self, mut log: Log, out: &Path, context: RunContext) -> Result<Optimised> {
        let found = self.search(&mut log, context)?;
        // It lists the files that are replaced from here on.
        atomic_file::supersede(&out.join(FILE))?;
        remove_front(out)?;
        let designs = self.designs(&found)?.into_iter();
        let designs = designs.map(|design| self.write(design, out));
        let designs = designs.collect::<Result<Vec<_>>>()?;
        let verified = self.verify(&found, &designs, context)?;
        let points = &found.last_result().front;
        let front = designs[1..].iter().zip(points).zip(verified.front);
        let front = front.map(|((design, point), judged)| FrontDesign {
            file: design.name.clone(),
            coefficients: found.variables.coefficients(point),
            judged,
        });
        let design = designs[0].design.clone();
        Ok(Optimised {
            front: front.collect(),
            stages: found.stages,
            active_limits: [
                found.variables.limits.active(&design),
                found.variables.at_bounds(&found.best),
            ]
            .concat(),
            coefficients: verified.coefficients,
            design,
            before: verified.before,
            after: verified.after,
            as_in_search: verified.as_in_search,
        })
    }

    /// Runs all stages, each from where the one before ended.
    ///
    /// # Errors
    /// As [`Recipe::run`].
    pub(super) fn search(&self, log: &mut Log, context: RunContext) -> Result<Searched> {
        let problem = self.problem;
        let started = Instant::now();
        let deadline = self.budget.map(|budget| started + budget);
        let mut found = Searched {
            stages: Vec::new(),
            settings: Settings::new(),
            variables: problem.variables.clone(),
            start: Point::new(),
            best: Point::new(),
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
                progress: &progress,
            };
            if let Some(why) = search.evaluator.refusal(&found.start) {
                let file = &problem.inputs[0].file;
                context.console.say(&format!(
                    "batwing: {file}: the start of stage {number} is refused, and the search begins around it: {why}"
                ));
            }
            let result = search.run(&found.start);
            progress.finish_and_clear();
            let result = result.map_err(|error| self.about(error))?;
            found.best.clone_from(&result.final_candidates[0].point);
            // All that was set before stays; what this stage sets goes on top.
            found
                .settings
                .extend(found.variables.settings(&found.best)?);
            found.stages.push(StageOutcome {
                settings: stage.clone(),
                result,
            });
        }
        self.feasible(&found.stages)
            .map_err(|error| self.about(error))?;
        Ok(found)
    }

    /// The design that was found, then those of the Pareto front, where one was sought. They read
    /// files that they name beside the design of the problem.
    ///
    /// # Errors
    /// A design that does not pass its checks.
    pub(super) fn designs(&self, found: &Searched) -> Result<Vec<FoundDesign>> {
        let name = &self.problem.name;
        let mut designs = vec![self.design(&found.settings, name.clone(), DESIGN.to_owned())?];
        for (number, point) in (1..).zip(&found.last_result().front) {
            let mut settings = found.settings.clone();
            settings.extend(found.variables.settings(point)?);
            let name = format!("{name}-{number:02}");
            designs.push(self.design(&settings, name, format!("{FRONT}{number:02}.toml"))?);
        }
        Ok(designs)
    }

    /// The design with `settings` under a name.
    fn design(&self, settings: &Settings, name: String, file: String) -> Result<FoundDesign> {
        let problem = self.problem;
        let source = &problem.variables.source;
        let mut table = source.table_with(settings)?;
        let of = format!("{} optimised: {}", problem.design.name, problem.description);
        table.insert("name".to_owned(), toml::Value::String(name));
        table.insert("description".to_owned(), toml::Value::String(of));
        let source = DesignFile::new(source.path.clone(), table);
        let design = source.with(&Settings::new());
        Ok(FoundDesign {
            design: design.with_context(|| format!("{file}: the design found"))?,
            name: file,
            file: source,
        })
    }

    /// Writes a design that was found into `out`, and reads it again.
    fn write(&self, found: FoundDesign, out: &Path) -> Result<FoundDesign> {
        let path = out.join(&found.name);
        self.copy_named_files(out)?;
        atomic_file::write_bytes(&path, toml::to_string(&found.file.table)?.as_bytes())?;
        let design = scene_check::load(&path)
            .with_context(|| format!("{}: the design found", path.display()))?;
        Ok(FoundDesign {
            file: DesignFile::new(path, found.file.table),
            design,
            ..found
        })
    }

    /// Judges the design of the problem and `designs` by paths of a fresh seed, and looks for
    /// sensitivities.
    ///
    /// # Errors
    /// As [`Recipe::run`].
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
        let after = next()?.judged()?;
        // The design of the problem may lack what is judged.
        let before = next()?.judged().ok();
        let as_in_search = if of_search.is_empty() {
            after.clone()
        } else {
            next()?.judged()?
        };
        let front = designs[1..].iter();
        let front = front.map(|one| (&one.file, self.verification_paths(&one.design)));
        let points = &found.last_result().front;
        let front: Vec<_> = front.collect();
        let name = "the verification of the front";
        let front = verification(name, &front, points, &mut evaluator, context)?;
        let front = front.into_iter().map(Outcome::judged);
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
    fn coefficients(&self, found: &Searched, context: RunContext) -> Result<Vec<Coefficient>> {
        let variables = &found.variables;
        let sensitivities =
            self.sensitivities(variables, self.last_stage(), &found.best, context)?;
        let labels = variables.labels().into_iter().zip(sensitivities);
        let ends = [&found.start, &found.best].map(|point| variables.coefficients(point));
        let [start, best] = ends;
        let all = labels.zip(start.into_iter().zip(best));
        let all = all.map(|((label, sensitivity), (start, found))| Coefficient {
            label,
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
        if last.final_candidates[0].feasible {
            return Ok(());
        }
        let nearest = stages.iter().filter_map(|s| s.result.nearest.as_ref());
        let nearest = nearest.min_by(|a, b| a.value().total_cmp(&b.value()));
        let misses = self.problem.objective.constraints.iter().map(|constraint| {
            let figures = nearest.map(|candidate| &candidate.figures);
            let figure = figures.and_then(|figures| figures.get(&constraint.figure));
            let got = figure.map_or_else(
                || "nothing".to_owned(),
                |f| format!("{:.4} ± {:.4}", f.value, f.standard_error),
            );
            format!("{} (nearest: {got})", constraint.words())
        });
        let misses: Vec<String> = misses.collect();
        anyhow::bail!(
            "constraints: expected a candidate that meets {}, got none in {}",
            misses.join("; "),
            crate::plural::count(
                stages.iter().map(|s| s.result.evaluations).sum::<usize>(),
                "candidate"
            )
        )
    }

    /// Copies the files that the design names to where the design that was found looks for them.
    fn copy_named_files(&self, out: &Path) -> Result<()> {
        let source = &self.problem.variables.source.path;
        let folder = source.parent().unwrap_or(Path::new(""));
        for record in &self.problem.design.provenance.named {
            let name = Path::new(&record.file);
            let relative = name.strip_prefix(folder).unwrap_or(name);
            let plain = relative
                .components()
                .all(|part| matches!(part, std::path::Component::Normal(_)));
            anyhow::ensure!(
                plain,
                "design: expected files that it names below its own folder, got `{}`",
                record.file
            );
            let bytes = std::fs::read(folder.join(relative))
                .with_context(|| format!("`{}` cannot be read", record.file))?;
            atomic_file::write_bytes(&out.join(relative), &bytes)?;
        }
        Ok(())
    }

    /// Change of the objective for one unit of each coefficient at `point`, by paired traces; only
    /// where no tables have to be solved for it.
    fn sensitivities(
        &self,
        variables: &Variables,
        stage: &StageSettings,
        point: &Point,
        context: RunContext,
    ) -> Result<Vec<Option<Estimate>>> {
        if stage.model == Model::Hybrid {
            return Ok(vec![None; point.len()]);
        }
        let mut evaluator = self.evaluator(variables, stage);
        let seed = mix(context.seed ^ mix(SENSITIVITY));
        let context = RunContext { seed, ..context };
        let what = "sensitivities";
        let progress = context.console.progress(2 * point.len() as u64, what);
        let moved = (0..point.len()).flat_map(|k| {
            [-MOVE, MOVE].map(|side| {
                let mut moved = point.clone();
                moved[k] = (moved[k] + side).clamp(0.0, 1.0);
                moved
            })
        });
        let moved: Vec<Point> = moved.collect();
        let batch = Batch {
            name: what.to_owned(),
            count: moved.len(),
            points: &moved,
            paths: stage.most_paths,
            progress: &progress,
        };
        let outcomes = evaluator.outcomes(&batch, context, |evaluator, number| {
            evaluator.evaluate(&moved[number], stage.most_paths, context)
        });
        progress.finish_and_clear();
        let outcomes: Vec<_> = moved.iter().zip(outcomes?).collect();
        let mut found = Vec::new();
        for (k, pair) in outcomes.chunks(2).enumerate() {
            let at = |moved: &Point| variables.coefficients(moved)[k];
            let judged = pair.iter().filter_map(|(moved, outcome)| match outcome {
                Outcome::Judged(one) => Some((at(moved), one)),
                Outcome::Refused(_) => None,
            });
            let judged: Vec<(f64, &Judged)> = judged.collect();
            found.push(match judged.as_slice() {
                [(a, low), (b, high)] if b > a && variables.is_number(k) => {
                    let pairs = high.without.iter().zip(&low.without);
                    let differences: Vec<f64> = pairs.map(|(h, l)| h - l).collect();
                    let unit = b - a;
                    let change = (high.value - low.value) / unit;
                    Some(Estimate::new(change, spread(&differences) / unit))
                }
                _ => None,
            });
        }
        Ok(found)
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
    let context = RunContext {
        seed: mix(context.seed ^ mix(VERIFICATION)),
        ..context
    };
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
        evaluator.outcome(file, paths, context)
    });
    progress.finish_and_clear();
    outcomes
}

/// Removes the designs of the front of an earlier search.
fn remove_front(out: &Path) -> Result<()> {
    for entry in std::fs::read_dir(out)? {
        let entry = entry?;
        let name = entry.file_name();
        let number = name.to_str().and_then(|name| {
            let number = name.strip_prefix(FRONT)?.strip_suffix(".toml")?;
            number.parse::<u32>().ok()
        });
        if number.is_some() {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
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
    ) -> impl Iterator<Item = (&str, Option<&JackknifedFigure>, &JackknifedFigure)> {
        self.after.figures.iter().map(|(key, after)| {
            let before = self.before.as_ref();
            let before = before.and_then(|b| b.figures.iter().find(|(known, _)| known == key));
            (key.as_str(), before.map(|b| &b.1), after)
        })
    }
}
