// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces of many designs without files, as studies, tolerance analyses and searches ask for them.
//! Tables of orders stay in memory from one design to the next.

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use runtime::run_context::RunContext;

use super::model::Model;
use super::observation::Observation;
use super::scene::DomeSurface;
use super::spectral::SpectralJob;
use super::tables::HeldTables;
use super::trace::{GROUPS, TraceJob};
use super::trace_plan::DomeChoice;

/// Groups for the errors of a search: maps are read that many times, so that fewer than in a run
/// leave more of the time to paths. The error of an error is a fifth.
const SEARCH_GROUPS: usize = 16;

/// Most tables that a search holds; some 10 MB each.
const SEARCH_TABLES: usize = 600;

/// Traces of many designs.
pub struct ModelTraces<'a> {
    cache: &'a Cache,
    tables: HeldTables,
    error_groups: usize,
}

impl<'a> ModelTraces<'a> {
    /// Traces of designs that differ little, with few groups for their errors; `cache` keeps the
    /// tables.
    pub fn of_search(cache: &'a Cache) -> Self {
        let tables = HeldTables::new(SEARCH_TABLES);
        Self { cache, tables, error_groups: SEARCH_GROUPS }
    }

    /// Traces as in a run; `cache` keeps the tables, memory those of the last design.
    pub fn of_study(cache: &'a Cache) -> Self {
        Self { cache, tables: HeldTables::new(0), error_groups: GROUPS }
    }

    /// Tables of orders solved so far.
    pub fn tables_solved(&self) -> usize {
        self.tables.solved
    }

    /// Traces the own number of paths of `design` and reads its receivers; `what` is shown beside
    /// the progress.
    ///
    /// # Errors
    /// Those of the solver and the tracer; an interrupt.
    pub fn observe(
        &mut self,
        design: &Design,
        dome: DomeChoice,
        what: &str,
        context: RunContext,
    ) -> Result<Observation> {
        let cache = Some(self.cache);
        if let (DomeChoice::Model(model), Some(lights)) = (dome, design.all_lights()) {
            return SpectralJob { design, lights: &lights, model, cache, context }.observe();
        }
        let surface = self.surface(design, dome, context)?;
        let error_groups = self.error_groups;
        TraceJob { error_groups, ..TraceJob::new(design, &surface, what) }.observe(context)
    }

    /// The same of a design in which a medium converts light: power, X, Y, Z and photons, then X, Y and
    /// Z behind each sub-pixel of the panel.
    ///
    /// # Errors
    /// Those of [`Self::observe`].
    pub fn observe_channels(
        &mut self,
        design: &Design,
        dome: DomeChoice,
        what: &str,
        context: RunContext,
    ) -> Result<Vec<Observation>> {
        let surface = self.surface(design, dome, context)?;
        TraceJob::new(design, &surface, what).observe_channels(context)
    }

    fn surface(
        &mut self,
        design: &Design,
        dome: DomeChoice,
        context: RunContext,
    ) -> Result<DomeSurface> {
        let needs_tables = dome == DomeChoice::Model(Model::Hybrid);
        let tables = needs_tables.then(|| self.tables.of_design(design, Some(self.cache), context));
        dome.surface(design, tables.transpose()?.as_ref())
    }
}
