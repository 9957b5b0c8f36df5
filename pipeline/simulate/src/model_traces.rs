// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces of many designs in one model, without files: what searches and tolerance analyses ask
//! for. Tables of orders stay in memory from one design to the next.

use anyhow::Result;

use design::Design;
use files::cache::Cache;
use files::run_context::RunContext;

use super::dome_surface::dome_surface;
use super::model::Model;
use super::observation::Observation;
use super::spectral::SpectralJob;
use super::tables::HeldTables;
use super::trace::TraceJob;

/// Groups that errors are told from: maps are read that many times, so that fewer than in a run
/// leave more of the time to paths. The error of an error is a fifth.
const ERROR_GROUPS: usize = 16;

/// Traces of one model.
pub struct ModelTraces<'a> {
    model: Model,
    cache: &'a Cache,
    tables: HeldTables,
}

impl<'a> ModelTraces<'a> {
    /// Traces of `model`, whose tables `cache` keeps.
    pub fn new(model: Model, cache: &'a Cache) -> Self {
        Self { model, cache, tables: HeldTables::default() }
    }

    /// Tables of orders solved so far.
    pub fn tables_solved(&self) -> usize {
        self.tables.solved
    }

    /// Observation of `design`, by its own number of paths.
    ///
    /// # Errors
    /// Errors of the solver and the tracer; an interrupt.
    pub fn observe(&mut self, design: &Design, context: RunContext) -> Result<Observation> {
        let model = self.model;
        if let Some(lights) = design.all_lights() {
            let job =
                SpectralJob { design, lights: &lights, model, cache: Some(self.cache), context };
            return job.observe();
        }
        let tables = match model {
            Model::Hybrid => Some(self.tables.of_design(design, Some(self.cache), context)?),
            _ => None,
        };
        let surface = dome_surface(design, model, tables.as_ref())?;
        let job = TraceJob {
            design,
            surface: &surface,
            paths: design.trace.paths,
            what: "",
            error_groups: ERROR_GROUPS,
        };
        job.observe(context)
    }
}
