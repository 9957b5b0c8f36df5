// SPDX-License-Identifier: MIT OR Apache-2.0
//! Full runs of the design of a problem and of the one found, by fresh paths: what `results.json`
//! beside an optimisation holds.

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use results::DesignResult;
use runtime::run_context::RunContext;
use simulate::model::Model;
use simulate::model_writer::Destination;
use simulate::run::Run;
use simulate::seeds::mix;
use simulate::trace_plan::TracePlan;

use super::problem::Problem;

/// Number of the seed of these runs beside that of the search.
const RESULTS: u64 = 0xf1e5;

/// The run of one design in all models of the verification.
#[derive(Debug, Clone)]
pub struct VerificationRun {
    design: Design,
    models: Vec<Model>,
}

impl VerificationRun {
    /// The run of `design`.
    pub fn new(problem: &Problem, design: &Design) -> Self {
        let mut design = design.clone();
        if let Some(paths) = problem.verification_paths {
            design.trace.paths = paths;
        }
        let mut models = Model::all_of(&design);
        models.retain(|model| problem.models.contains(model));
        if models.is_empty() {
            // A dome that has become smooth has no other.
            models.push(Model::Geometric);
        }
        Self { design, models }
    }

    /// The seed of these runs, beside that of the search.
    pub fn seed(seed: u64) -> u64 {
        mix(seed ^ mix(RESULTS))
    }

    /// Traces of the run, for several processes to share; `context` has the seed of the runs.
    ///
    /// # Errors
    /// Wavelengths that follow from what has been traced.
    pub fn plans(&self, context: RunContext) -> Result<Vec<TracePlan>> {
        let lights = self.design.all_lights();
        let run = Run {
            design: &self.design,
            lights: lights.as_deref(),
            stopping_rule: None,
            cache: None,
        };
        run.plans(&self.models, context)
    }

    /// Results of the run, with files at `destination`; `context` has the seed of the runs.
    ///
    /// # Errors
    /// Errors of the solver, the tracer and the files; an interrupt.
    pub fn results(
        &self,
        destination: Destination,
        cache: &Cache,
        context: RunContext,
    ) -> Result<DesignResult> {
        let design = &self.design;
        let lights = design.all_lights();
        let lights = lights.as_deref();
        let run = Run { design, lights, stopping_rule: None, cache: Some(cache) };
        Ok(DesignResult {
            name: design.name.clone(),
            design_sha256: design.provenance.sha256.clone(),
            models: run.models(&self.models, destination, context)?,
        })
    }
}
