// SPDX-License-Identifier: MIT OR Apache-2.0
//! Evaluates candidates: settings → design → limits → trace → objective. Nothing is written but
//! tables of orders, which the cache keeps.

use anyhow::Result;

use super::objective::{Judged, Objective};
use super::problem::StageSettings;
use super::variables::Variables;
use crate::config::design::Design;
use crate::interrupt::Interrupted;
use crate::run_context::RunContext;
use crate::stages::model_traces::ModelTraces;

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
    pub stage: &'a StageSettings,
    pub traces: ModelTraces<'a>,
}

impl Evaluator<'_> {
    /// The design at `point`, or why there is none.
    pub fn design(&self, point: &[f64]) -> Result<Design, String> {
        let made = || -> Result<Design> {
            let mut settings = self.variables.settings(point)?;
            settings.extend(self.stage.set.clone());
            self.variables.source.with(&settings)
        };
        let design = made().map_err(|why| format!("{why:#}"))?;
        if let Some(broken) = self.variables.limits.broken(&design) {
            return Err(broken);
        }
        Ok(design)
    }

    /// Judges the candidate at `point` by `paths` paths.
    ///
    /// # Errors
    /// An interrupt. Other failures refuse the candidate.
    pub fn evaluate(&mut self, point: &[f64], paths: u64, context: RunContext) -> Result<Outcome> {
        let design = match self.design(point) {
            Ok(design) => design,
            Err(why) => return Ok(Outcome::Refused(why)),
        };
        match self.judge(&design, paths, context) {
            Ok(judged) => Ok(Outcome::Judged(judged)),
            Err(error) if error.is::<Interrupted>() => Err(error),
            Err(error) => Ok(Outcome::Refused(format!("{error:#}"))),
        }
    }

    /// Judges `design` by `paths` paths.
    ///
    /// # Errors
    /// Those of the solver and the tracer; figures that cannot be read; an interrupt.
    pub fn judge(&mut self, design: &Design, paths: u64, context: RunContext) -> Result<Judged> {
        let mut design = design.clone();
        design.trace.paths = paths;
        let seen = self.traces.observe(&design, context.silent())?;
        self.objective.judge(&design, &seen)
    }
}
