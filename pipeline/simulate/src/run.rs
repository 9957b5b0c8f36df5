// SPDX-License-Identifier: MIT OR Apache-2.0
//! The recipe of a run: tables → scene → trace → figures → files, for each model of a design.

use std::borrow::Cow;

use anyhow::Result;

use arrays::cache::Cache;
use design::Design;
use design::spectrum::lights::Lights;
use results::ModelResult;
use runtime::run_context::RunContext;

use super::added_errors::AddedErrors;
use super::film_table::{FilmTreatment, treatment};
use super::model::Model;
use super::model_writer::{Destination, Output};
use super::observation::Observation;
use super::paths_3d::WavelengthScene;
use super::scene::DomeSurface;
use super::spectral::SpectralJob;
use super::stopping_rule::{self, StoppingRule};
use super::tables::{DesignTables, tables};
use super::trace::TraceJob;
use super::trace_plan::TracePlan;
use super::units::Units;
use super::{model_result, package};

/// A design to be run.
pub struct Run<'a> {
    /// The design.
    pub design: &'a Design,
    /// Lights of several wavelengths; none for one wavelength.
    pub lights: Option<&'a Lights>,
    /// Stopping rule; without one, the design's number of paths is traced.
    pub stopping_rule: Option<&'a StoppingRule>,
    /// Cache of tables.
    pub cache: Option<&'a Cache>,
}

impl Run<'_> {
    /// Refuses `models` that need more wavelengths than there are tables or memory for, before
    /// anything is traced.
    ///
    /// # Errors
    /// Number of wavelengths, and the largest number allowed.
    pub fn check(&self, models: &[Model], context: RunContext) -> Result<()> {
        let lights = self.lights.into_iter();
        let jobs = lights.flat_map(|lights| models.iter().map(move |model| (lights, *model)));
        let mut jobs = jobs.map(|(lights, model)| self.spectral_job(lights, model, context));
        jobs.try_for_each(SpectralJob::check)
    }

    /// The traces of `models`, for several processes to share.
    ///
    /// # Errors
    /// Wavelengths that follow from what has been traced.
    pub fn plans(&self, models: &[Model], context: RunContext) -> Result<Vec<TracePlan>> {
        let Some(lights) = self.lights else {
            let plan = |model: &Model| TracePlan::of_model(self.design, *model, context.seed);
            return Ok(models.iter().map(plan).collect());
        };
        let plans = models.iter().map(|&model| self.spectral_job(lights, model, context).plans());
        Ok(plans.collect::<Result<Vec<_>>>()?.concat())
    }

    /// Runs `models`, one after another; the tables of the hybrid come first.
    ///
    /// # Errors
    /// Errors of the solver, the tracer and the files; an interrupt.
    pub fn models(
        &self,
        models: &[Model],
        destination: Destination,
        context: RunContext,
    ) -> Result<Vec<ModelResult>> {
        // With several wavelengths, each has tables of its own.
        let needs_tables = models.contains(&Model::Hybrid) && self.lights.is_none();
        let tables = needs_tables.then(|| tables(&[self.design], self.cache, None, context));
        let tables = tables.transpose()?.map(|mut all| all.remove(0));
        models
            .iter()
            .map(|&model| self.model(model, tables.as_ref(), destination, context))
            .collect()
    }

    /// Runs one model, with tables of one wavelength where it needs them.
    ///
    /// # Errors
    /// Same as [`Run::models`].
    pub fn model(
        &self,
        model: Model,
        tables: Option<&DesignTables>,
        destination: Destination,
        context: RunContext,
    ) -> Result<ModelResult> {
        match self.lights {
            None => self.monochromatic(model, tables, destination, context),
            Some(lights) => self.spectral(lights, model, destination, context),
        }
    }

    fn monochromatic(
        &self,
        model: Model,
        tables: Option<&DesignTables>,
        destination: Destination,
        context: RunContext,
    ) -> Result<ModelResult> {
        let design = self.design;
        let plan = TracePlan::of_model(design, model, context.seed);
        let surface = plan.surface(tables)?;
        let job = plan.job(&surface);
        let (observation, until_error) = match self.stopping_rule {
            None => (job.observe(context)?, None),
            Some(rule) => {
                let (mean, said) = stopping_rule::observe_until(&job, rule, context)?;
                (mean, Some(said))
            }
        };
        let mut result = model_result::model_result(design, model, &observation);
        let batches = until_error.is_some();
        let first = (!batches).then_some(&observation);
        let errors = errors_of_tables(first, &job, context)?;
        let of_film_table = errors_of_film_table(first, &job, context)?;
        result.until_error = until_error;
        if let (Model::Hybrid, Some(tables)) = (model, tables) {
            result.tables = tables.describe();
        }
        let part = WavelengthScene { design, surface: &surface, share: 1.0 };
        let units = Units::from_design(design, None);
        let output = Output { design, units, out: destination.out };
        let surfaces = observation.surfaces_per_path;
        let mut observation = Cow::Owned(observation);
        let draws = destination.writer.draws_package();
        // Paths of the package are traced on one thread.
        let (package, written) = rayon::join(
            || draws.then(|| package::package(design, &[part], false, surfaces, context.seed)),
            || destination.writer.write(output, &mut result, &mut observation, context),
        );
        written?;
        for errors in [errors, of_film_table].into_iter().flatten() {
            errors.add_to(&mut result, &units);
        }
        if let Some(package) = package {
            package::write(package, output, &mut result, context)?;
        }
        Ok(result)
    }

    fn spectral(
        &self,
        lights: &Lights,
        model: Model,
        destination: Destination,
        context: RunContext,
    ) -> Result<ModelResult> {
        let job = self.spectral_job(lights, model, context);
        let trace = job.trace(self.stopping_rule)?;
        let mut observation = trace.observation();
        let mut result = model_result::model_result(self.design, model, &observation);
        result.until_error.clone_from(&trace.until_error);
        let errors = trace.wavelength_errors(&observation);
        let of_film_table = trace.film_table_errors(&observation, beside_pieces(context))?;
        result.spectrum = Some(trace.describe()?);
        let units = Units::from_design(self.design, Some(lights));
        let output = Output { design: self.design, units, out: destination.out };
        destination.writer.write(output, &mut result, &mut observation, context)?;
        for errors in [Some(errors), of_film_table].into_iter().flatten() {
            errors.add_to(&mut result, &units);
        }
        let nodes = trace.by_wavelength();
        if !nodes.is_empty() {
            destination.writer.write_by_wavelength(output, &mut result, &nodes, &observation)?;
        }
        if destination.writer.draws_package() {
            let parts = trace.surfaces();
            let surfaces = observation.surfaces_per_path;
            let package = package::package(self.design, &parts, true, surfaces, context.seed);
            package::write(package, output, &mut result, context)?;
        }
        Ok(result)
    }

    fn spectral_job<'a>(
        &'a self,
        lights: &'a Lights,
        model: Model,
        context: RunContext<'a>,
    ) -> SpectralJob<'a> {
        SpectralJob { design: self.design, lights, model, cache: self.cache, context }
    }
}

/// Errors of what `job` saw by tables that hold at few of the wavelengths of converted light: the
/// change where every path takes those of the second nearest. Batches saw other paths, so that the
/// first of them is compared.
fn errors_of_tables(
    observation: Option<&Observation>,
    job: &TraceJob<'_>,
    context: RunContext,
) -> Result<Option<AddedErrors>> {
    let Some(surface) = job.surface.second_nearest() else {
        if let DomeSurface::ByWavelength(..) = job.surface {
            context.console.warn(&format!(
                "{}: hybrid.tables_nm: relief of {} has tables at one wavelength, so that their error for light of others is not known; two or more show it",
                job.design.provenance.file, job.what
            ));
        }
        return Ok(None);
    };
    let what = format!("{}, tables of the second nearest wavelength", job.what);
    let other = TraceJob { surface: &surface, what: &what, ..*job };
    let other = other.observe(beside_pieces(context))?;
    against(observation, job, context, |seen| AddedErrors::of_wavelengths(seen, &other, job.design))
        .map(Some)
}

/// Errors of what `job` saw by the cells of its table of films: from the change to cells of twice the
/// width, traced with a quarter of the paths.
fn errors_of_film_table(
    observation: Option<&Observation>,
    job: &TraceJob<'_>,
    context: RunContext,
) -> Result<Option<AddedErrors>> {
    if !matches!(treatment(job.design), FilmTreatment::Table(_)) {
        return Ok(None);
    }
    let wide = job.observe_widened(beside_pieces(context))?;
    against(observation, job, context, |seen| AddedErrors::of_film_table(seen, &wide, job.design))
        .map(Some)
}

/// The context of a trace that belongs to no shard: a merge computes it.
fn beside_pieces(context: RunContext<'_>) -> RunContext<'_> {
    RunContext { checkpoints: context.checkpoints.filter(|all| !all.is_merging()), ..context }
}

/// Errors of what `job` saw; of batches those of the first one, which is traced here.
fn against(
    observation: Option<&Observation>,
    job: &TraceJob<'_>,
    context: RunContext,
    errors: impl Fn(&Observation) -> AddedErrors,
) -> Result<AddedErrors> {
    Ok(match observation {
        Some(seen) => errors(seen),
        None => errors(&job.observe(context)?),
    })
}
