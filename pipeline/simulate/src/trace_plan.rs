// SPDX-License-Identifier: MIT OR Apache-2.0
//! A trace before it begins: the design, what stands on its dome, paths and seed.

use std::ops::Range;

use anyhow::{Context, Result};

use arrays::cache::Cache;
use design::Design;
use geometry::Meridian;
use runtime::key::Key;
use runtime::run_context::RunContext;

use super::dome_surface::{dome_surface, without_tables};
use super::job::Task;
use super::model::Model;
use super::observation::Observation;
use super::scene::DomeSurface;
use super::tables::{DesignTables, tables};
use super::trace::{GROUPS, TraceJob};

/// Surface of the dome: choice of a trace plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DomeChoice {
    /// The relief in a model.
    Model(Model),
    /// This element (from 1) alone, all others absorbing.
    Element(usize),
}

impl DomeChoice {
    /// The surface of the dome of `design`; the hybrid needs `tables`.
    ///
    /// # Errors
    /// A dome that the design does not have.
    pub fn surface(self, design: &Design, tables: Option<&DesignTables>) -> Result<DomeSurface> {
        match self {
            Self::Model(model) => dome_surface(design, model, tables),
            Self::Element(element) => {
                let base = design.base().with_context(|| format!("{} has no dome", design.name))?;
                Ok(DomeSurface::Only(Meridian::stepped(base, &design.elements)?, element))
            }
        }
    }
}

/// A trace that is to be made; its pieces are groups of paths.
#[derive(Debug, Clone)]
pub struct TracePlan {
    /// The design.
    pub design: Design,
    /// Surface of its dome.
    pub dome: DomeChoice,
    /// Number of paths.
    pub paths: u64,
    /// Shown beside the progress and in warnings; it names the model.
    pub what: String,
    /// Seed.
    pub seed: u64,
}

impl TracePlan {
    /// The trace of `design` in `model` with its own number of paths.
    pub fn of_model(design: &Design, model: Model, seed: u64) -> Self {
        Self {
            design: design.clone(),
            dome: DomeChoice::Model(model),
            paths: design.trace.paths,
            what: format!("{} {}", design.name, model.key(design)),
            seed,
        }
    }

    /// The surface of the dome; the hybrid needs `tables`.
    ///
    /// # Errors
    /// A dome that the design does not have.
    pub fn surface(&self, tables: Option<&DesignTables>) -> Result<DomeSurface> {
        self.dome.surface(&self.design, tables)
    }

    /// The trace with `surface` on the dome.
    pub(super) fn job<'b>(&'b self, surface: &'b DomeSurface) -> TraceJob<'b> {
        TraceJob { paths: self.paths, ..TraceJob::new(&self.design, surface, &self.what) }
    }

    /// Traces it.
    ///
    /// # Errors
    /// A scene that cannot be built, those of the tracer; an interrupt.
    pub fn observe(&self, surface: &DomeSurface, context: RunContext) -> Result<Observation> {
        let seed = self.seed;
        self.job(surface).observe(RunContext { seed, ..context })
    }
}

impl Task for TracePlan {
    fn label(&self) -> &str {
        &self.what
    }

    fn pieces(&self) -> u64 {
        GROUPS as u64
    }

    fn paths(&self) -> u64 {
        self.paths.div_ceil(GROUPS as u64)
    }

    fn tables_of(&self) -> Option<&Design> {
        let needs_tables = self.dome == DomeChoice::Model(Model::Hybrid);
        needs_tables.then_some(&self.design)
    }

    fn missing(&self, _: &Cache, context: RunContext) -> Result<Vec<u64>> {
        let surface = match self.dome {
            DomeChoice::Model(model) => without_tables(&self.design, model)?,
            DomeChoice::Element(_) => self.surface(None)?,
        };
        let fields = self.job(&surface).key_fields(self.seed);
        let groups = context.checkpoints.map(|all| all.entries(Key::of(&fields)));
        Ok(groups.map_or_else(Vec::new, |groups| groups.missing(0..self.pieces())))
    }

    fn compute(&self, pieces: Range<u64>, cache: &Cache, context: RunContext) -> Result<()> {
        let tables = match self.dome {
            DomeChoice::Model(Model::Hybrid) => {
                Some(tables(&[&self.design], Some(cache), None, context)?.remove(0))
            }
            _ => None,
        };
        let surface = self.surface(tables.as_ref())?;
        let seed = self.seed;
        let job = self.job(&surface);
        job.keep_groups(pieces, RunContext { seed, ..context })
    }
}
