// SPDX-License-Identifier: MIT OR Apache-2.0
//! Evaluates candidates: settings, design, limits, trace, objective. Nothing is written but
//! tables of orders, which the cache keeps.

use anyhow::Result;

use super::objective::{Judged, Objective};
use super::problem::{Problem, StageSettings};
use super::robust::RobustObjective;
use super::variables::Variables;
use crate::atomic_file::is_of_files;
use crate::cache::Cache;
use crate::config::design::{Design, PATHS};
use crate::config::dotted_keys::Settings;
use crate::interrupt::Interrupted;
use crate::run_context::RunContext;
use crate::stages::design_file::DesignFile;
use crate::stages::model_traces::ModelTraces;
use crate::stages::seeds::mix;

/// What came of a candidate.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outcome {
    /// Its objective and figures.
    Judged(Judged),
    /// Why it was not traced, or gives no objective.
    Refused(String),
}

/// An objective that no design reaches: candidates that miss constraints come after all that meet
/// them, by their miss.
const INFEASIBLE: f64 = 1e6;

impl Outcome {
    /// What the search minimises.
    pub fn value(&self) -> f64 {
        match self {
            Self::Judged(judged) if judged.miss > 0.0 => INFEASIBLE * (1.0 + judged.miss),
            Self::Judged(judged) => judged.value,
            Self::Refused(_) => f64::INFINITY,
        }
    }

    /// The objective where all constraints are met.
    pub fn feasible(&self) -> Option<&Judged> {
        match self {
            Self::Judged(judged) if judged.miss <= 0.0 => Some(judged),
            _ => None,
        }
    }
}

/// Traces candidates of one stage.
pub(super) struct Evaluator<'a> {
    pub variables: &'a Variables,
    pub objective: &'a Objective,
    pub robust: Option<&'a RobustObjective>,
    pub stage: &'a StageSettings,
    pub traces: ModelTraces<'a>,
}

impl<'a> Evaluator<'a> {
    /// What judges the candidates of a stage of `problem`; tables come from `cache`.
    pub fn new(
        problem: &'a Problem,
        variables: &'a Variables,
        stage: &'a StageSettings,
        cache: &'a Cache,
    ) -> Self {
        Self {
            variables,
            objective: &problem.objective,
            robust: problem.robust.as_ref(),
            stage,
            traces: ModelTraces::new(stage.model, cache),
        }
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

    /// Judges the candidate at `point` by `paths` paths.
    ///
    /// # Errors
    /// An interrupt, those of files. Other failures refuse the candidate.
    pub fn evaluate(&mut self, point: &[f64], paths: u64, context: RunContext) -> Result<Outcome> {
        let design = match self.design(point) {
            Ok(design) => design,
            Err(why) => return Ok(Outcome::Refused(why)),
        };
        match self.judge(&design, paths, context) {
            Ok(judged) => Ok(Outcome::Judged(judged)),
            // A failure of files may pass: it says nothing of the candidate.
            Err(error) if error.is::<Interrupted>() || is_of_files(&error) => Err(error),
            Err(error) => Ok(Outcome::Refused(format!("{error:#}"))),
        }
    }

    /// Judges the design of `file` by `paths` paths: the design itself, or packages that deviate
    /// from it, which share the paths.
    ///
    /// # Errors
    /// Those of the solver and the tracer; figures that cannot be read; an interrupt.
    pub fn judge(&mut self, file: &DesignFile, paths: u64, context: RunContext) -> Result<Judged> {
        let Some(robust) = self.robust else {
            return self.judge_one(file, paths, context);
        };
        let packages = robust.packages(file, context.seed)?;
        let paths = (paths / robust.samples as u64).max(*PATHS.start());
        let judged = (0..).zip(&packages).map(|(number, package)| {
            let seed = mix(context.seed ^ mix(number));
            self.judge_one(package, paths, RunContext { seed, ..context })
        });
        Ok(robust.combine(&judged.collect::<Result<Vec<_>>>()?))
    }

    fn judge_one(&mut self, file: &DesignFile, paths: u64, context: RunContext) -> Result<Judged> {
        let mut design = file.with(&Settings::new())?;
        design.trace.paths = paths;
        let seen = self.traces.observe(&design, context.silent())?;
        self.objective.judge(file, &design, &seen)
    }
}
