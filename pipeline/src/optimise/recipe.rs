// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe of an optimisation: stages of search → selection → sensitivities → verification of the
//! result beside the design that it began with, both by paths of a fresh seed.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

use super::evaluate::{Evaluator, Outcome};
use super::front::FrontDesign;
use super::log::{self, Log};
use super::objective::Judged;
use super::problem::{Problem, StageSettings};
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

/// Where and how long an optimisation runs.
pub struct Job<'a> {
    /// The problem.
    pub problem: &'a Problem,
    /// Directory of results.
    pub out: &'a Path,
    /// Where tables come from and go to.
    pub cache: &'a Cache,
    /// Whether the log under `out` is gone on with.
    pub resume: bool,
    /// Time for the search; what is begun is finished.
    pub budget: Option<Duration>,
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
    pub(super) front: Vec<FrontDesign>,
}

/// What all stages found.
struct Searched {
    stages: Vec<StageOutcome>,
    /// Keys of the design found.
    settings: Settings,
    /// Variables of the last stage, and where it began and ended.
    variables: Variables,
    start: Point,
    best: Point,
}

impl Job<'_> {
    /// Searches, chooses and verifies; writes the log and the design.
    ///
    /// # Errors
    /// Those of the tracer, the solver and the files; constraints that no candidate meets; an
    /// interrupt.
    pub fn run(&self, context: RunContext) -> Result<Optimised> {
        let found = self.search(context)?;
        self.feasible(&found.stages)
            .map_err(|error| self.about(error))?;
        // It lists the files that are replaced from here on.
        atomic_file::supersede(&self.out.join(FILE))?;
        let (file, design) = self.write(&found.settings, &self.problem.name, DESIGN)?;
        let coefficients = self.coefficients(&found, context)?;
        let (before, after) = self.verify(&file, &design, &found.variables, context)?;
        let front = self.front(&found, context)?;
        Ok(Optimised {
            stages: found.stages,
            active_limits: found.variables.limits.active(&design),
            coefficients,
            design,
            before,
            after,
            front,
        })
    }

    /// Runs all stages, each from where the one before ended.
    fn search(&self, context: RunContext) -> Result<Searched> {
        let problem = self.problem;
        let key = problem.key(context.seed);
        let mut log = Log::open(&self.out.join(log::FILE), key.hex(), self.resume)?;
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
                log: &mut log,
                context,
                started,
                deadline,
                progress: &progress,
            };
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
        Ok(found)
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

    /// Judges the design of the problem, where it can be judged, and the one found, by paths of a
    /// fresh seed and at the tolerance of the design.
    fn verify(
        &self,
        file: &DesignFile,
        design: &Design,
        variables: &Variables,
        context: RunContext,
    ) -> Result<(Option<Judged>, Judged)> {
        let (paths, context) = self.verification(design, context);
        let problem = self.problem;
        let mut stage = self.last_stage().clone();
        stage.set.clear();
        let mut evaluator = self.evaluator(variables, &stage);
        let after = evaluator.judge(file, paths, context)?;
        let before = evaluator.judge(&problem.variables.source, paths, context);
        Ok((before.ok(), after))
    }

    /// Paths and seed of the verification.
    fn verification<'b>(&self, design: &Design, context: RunContext<'b>) -> (u64, RunContext<'b>) {
        let paths = self.problem.verification_paths;
        let seed = mix(context.seed ^ mix(VERIFICATION));
        (
            paths.unwrap_or(design.trace.paths),
            RunContext { seed, ..context },
        )
    }

    /// Writes and verifies the designs of the Pareto front, where one was sought.
    fn front(&self, found: &Searched, context: RunContext) -> Result<Vec<FrontDesign>> {
        let mut stage = self.last_stage().clone();
        stage.set.clear();
        let points = &found.stages[found.stages.len() - 1].result.front;
        self.remove_front()?;
        let mut evaluator = self.evaluator(&found.variables, &stage);
        let what = "verification of the front";
        let progress = context.console.progress(points.len() as u64, what);
        let mut front = Vec::new();
        for (number, point) in (1..).zip(points) {
            let mut settings = found.settings.clone();
            settings.extend(found.variables.settings(point)?);
            let name = format!("{}-{number:02}", self.problem.name);
            let file = format!("{FRONT}{number:02}.toml");
            let (source, design) = self.write(&settings, &name, &file)?;
            let (paths, context) = self.verification(&design, context);
            front.push(FrontDesign {
                file,
                coefficients: found.variables.coefficients(point),
                judged: evaluator.judge(&source, paths, context)?,
            });
            progress.inc(1);
        }
        progress.finish_and_clear();
        Ok(front)
    }

    /// Removes the designs of the front of an earlier search.
    fn remove_front(&self) -> Result<()> {
        for entry in std::fs::read_dir(self.out)? {
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

    fn last_stage(&self) -> &StageSettings {
        &self.problem.stages[self.problem.stages.len() - 1]
    }

    fn evaluator<'a>(
        &'a self,
        variables: &'a Variables,
        stage: &'a StageSettings,
    ) -> Evaluator<'a> {
        Evaluator::new(self.problem, variables, stage, self.cache)
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

    /// Writes the design with `settings` under a name, and reads it again.
    fn write(&self, settings: &Settings, name: &str, file: &str) -> Result<(DesignFile, Design)> {
        let problem = self.problem;
        let mut table = problem.variables.source.table_with(settings)?;
        let text = |value: String| toml::Value::String(value);
        table.insert("name".to_owned(), text(name.to_owned()));
        let of = format!("{} optimised: {}", problem.design.name, problem.description);
        table.insert("description".to_owned(), text(of));
        let path = self.out.join(file);
        self.copy_named_files()?;
        atomic_file::write_bytes(&path, toml::to_string(&table)?.as_bytes())?;
        let design = scene_check::load(&path)
            .with_context(|| format!("{}: the design found", path.display()))?;
        Ok((DesignFile::new(path, table), design))
    }

    /// Copies the files that the design names to where the design that was found looks for them.
    fn copy_named_files(&self) -> Result<()> {
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
            atomic_file::write_bytes(&self.out.join(relative), &bytes)?;
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
        let mut found = Vec::new();
        for k in 0..point.len() {
            let mut judged = Vec::new();
            for side in [-MOVE, MOVE] {
                context.interrupt.check()?;
                let mut moved = point.clone();
                moved[k] = (moved[k] + side).clamp(0.0, 1.0);
                let at = variables.coefficients(&moved)[k];
                if let Outcome::Judged(one) =
                    evaluator.evaluate(&moved, stage.most_paths, context)?
                {
                    judged.push((at, one));
                }
                progress.inc(1);
            }
            found.push(match judged.as_slice() {
                [(a, low), (b, high)] if b > a => {
                    let pairs = high.without.iter().zip(&low.without);
                    let differences: Vec<f64> = pairs.map(|(h, l)| h - l).collect();
                    let unit = b - a;
                    let change = (high.value - low.value) / unit;
                    Some(Estimate::new(change, spread(&differences) / unit))
                }
                _ => None,
            });
        }
        progress.finish_and_clear();
        Ok(found)
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
