// SPDX-License-Identifier: MIT OR Apache-2.0
//! Evaluates candidates: settings, design, limits, trace, objective. Nothing is written but
//! tables of orders, which the cache keeps.

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use design::dotted_keys::Settings;
use design::resolved::PATHS;
use runtime::atomic_file::is_of_files;
use runtime::interrupt::Interrupted;
use runtime::run_context::RunContext;
use simulate::model_traces::ModelTraces;
use simulate::seeds::mix;
use simulate::trace_plan::DomeChoice;

use super::objective::{Evaluation, Objective};
use super::outcome::Outcome;
use super::problem::{Problem, StageSettings};
use super::robust::RobustObjective;
use super::shared_evaluations::{Batch, SharedEvaluations, TracedOutcome};
use super::variables::Variables;
use crate::design_file::DesignFile;

/// Traces candidates of one stage.
pub(super) struct Evaluator<'a> {
    pub variables: &'a Variables,
    pub objective: &'a Objective,
    pub robust: Option<&'a RobustObjective>,
    pub stage: &'a StageSettings,
    traces: ModelTraces<'a>,
    /// Evaluations shared with other processes.
    shared: Option<&'a SharedEvaluations<'a>>,
    /// Tables of orders solved so far.
    pub tables: usize,
    /// True where all figures are read, not those of the objective alone.
    pub reads_all: bool,
}

impl<'a> Evaluator<'a> {
    /// Evaluator of the candidates of a stage of `problem`, alone or with others; tables come from
    /// `cache`.
    pub fn new(
        problem: &'a Problem,
        variables: &'a Variables,
        stage: &'a StageSettings,
        cache: &'a Cache,
        shared: Option<&'a SharedEvaluations<'a>>,
    ) -> Self {
        Self {
            variables,
            objective: &problem.objective,
            robust: problem.robust.as_ref(),
            stage,
            traces: ModelTraces::of_search(cache),
            shared,
            tables: 0,
            reads_all: false,
        }
    }

    /// The outcomes of `batch`, in order: here, or here and by others. `judge` makes one of them.
    ///
    /// # Errors
    /// Errors of `judge` and of sharing; an interrupt.
    pub fn outcomes(
        &mut self,
        batch: &Batch,
        context: RunContext,
        mut judge: impl FnMut(&mut Self, usize) -> Result<Outcome>,
    ) -> Result<Vec<Outcome>> {
        let shared = self.shared;
        let mut one = |number| -> Result<TracedOutcome> {
            let before = self.traces.tables_solved();
            let outcome = judge(self, number)?;
            let tables = self.traces.tables_solved() - before;
            Ok(TracedOutcome { outcome, tables })
        };
        let all = match shared {
            Some(shared) => shared.evaluate(batch, context, &mut one)?,
            None => (0..batch.count)
                .map(|number| {
                    context.interrupt.check()?;
                    let one = one(number);
                    batch.progress.inc(1);
                    one
                })
                .collect::<Result<_>>()?,
        };
        self.tables += all.iter().map(|one| one.tables).sum::<usize>();
        Ok(all.into_iter().map(|one| one.outcome).collect())
    }

    /// The design at `point`, or why there is none.
    fn design(&self, point: &[f64]) -> Result<DesignFile, String> {
        let made = || -> Result<(DesignFile, Design)> {
            let mut settings = self.variables.settings(point)?;
            settings.extend(self.stage.set.clone());
            let source = &self.variables.source;
            let file = DesignFile::new(source.path.clone(), source.table_with(&settings)?);
            // Parsed with its settings, so that messages name them.
            Ok((file, source.with(&settings)?))
        };
        let (file, design) = made().map_err(|why| format!("{why:#}"))?;
        match self.variables.limits.broken(&design) {
            Some(broken) => Err(broken),
            None => Ok(file),
        }
    }

    /// Reason why the candidate at `point` is not traced, if it is not.
    pub fn refusal(&self, point: &[f64]) -> Option<String> {
        self.design(point).err()
    }

    /// Judges the candidate at `point` by `paths` paths; warnings name it by `what` and its values.
    ///
    /// # Errors
    /// An interrupt, those of files. Other failures refuse the candidate.
    pub fn evaluate(
        &mut self,
        point: &[f64],
        paths: u64,
        what: &str,
        context: RunContext,
    ) -> Result<Outcome> {
        let design = match self.design(point) {
            Ok(design) => design,
            Err(why) => return Ok(Outcome::Refused(why)),
        };
        let what = format!("{what} ({})", self.variables.listed(point).join(", "));
        self.outcome(&design, paths, &what, context)
    }

    /// Judges the design of `file` by `paths` paths; warnings name it by `what`.
    ///
    /// # Errors
    /// An interrupt, those of files. Other failures refuse the design.
    pub fn outcome(
        &mut self,
        file: &DesignFile,
        paths: u64,
        what: &str,
        context: RunContext,
    ) -> Result<Outcome> {
        match self.judge(file, paths, what, context) {
            Ok(judged) => Ok(Outcome::Evaluated(judged)),
            // A failure of files may pass: it says nothing of the candidate.
            Err(error) if error.is::<Interrupted>() || is_of_files(&error) => Err(error),
            Err(error) => Ok(Outcome::Refused(format!("{error:#}"))),
        }
    }

    /// Judges the design of `file` by `paths` paths: the design itself, or packages that deviate
    /// from it, which share the paths.
    ///
    /// # Errors
    /// Errors of the solver and the tracer; figures that cannot be read; an interrupt.
    fn judge(
        &mut self,
        file: &DesignFile,
        paths: u64,
        what: &str,
        context: RunContext,
    ) -> Result<Evaluation> {
        let Some(robust) = self.robust else {
            return self.judge_one(file, paths, what, context);
        };
        let packages = robust.packages(file, context.seed)?;
        let paths = (paths / robust.samples as u64).max(*PATHS.start());
        let judged = (0..).zip(&packages).map(|(number, package)| {
            let seed = mix(context.seed ^ mix(number));
            let what = format!("{what}, package {}", number + 1);
            self.judge_one(package, paths, &what, RunContext { seed, ..context })
        });
        Ok(robust.combine(&judged.collect::<Result<Vec<_>>>()?, self.objective))
    }

    fn judge_one(
        &mut self,
        file: &DesignFile,
        paths: u64,
        what: &str,
        context: RunContext,
    ) -> Result<Evaluation> {
        let mut design = file.with(&Settings::new())?;
        what.clone_into(&mut design.name);
        design.trace.paths = paths;
        let context = RunContext {
            // An outcome is kept, if at all, not groups of paths.
            checkpoints: None,
            ..context.silent()
        };
        let seen =
            self.traces.observe(&design, DomeChoice::Model(self.stage.model), "", context)?;
        self.objective.judge(file, &design, &seen, self.reads_all)
    }
}
