// SPDX-License-Identifier: MIT OR Apache-2.0
//! The progressive trace: few paths first, then four times as many until those of the design. Each
//! number of paths is a whole trace, so that every frame is what `run` gives for it.

use std::borrow::Cow;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, anyhow};
use serde_json::{Value, json};

use arrays::cache::Cache;
use design::Design;
use output::live::{Beside, LiveLight, LiveWriter};
use report::html::pictures::within_page;
use report::path_picture::compact_picture;
use report::plots::Heading;
use results::ModelResult;
use runtime::run_context::RunContext;
use simulate::dome_surface::dome_surface;
use simulate::model::Model;
use simulate::model_result::model_result;
use simulate::model_writer::{Destination, ModelWriter, Output};
use simulate::package_drawing::package_drawing;
use simulate::paths::{by_light, paths};
use simulate::run::Run;
use simulate::tables::{DesignTables, tables};
use simulate::trace::observe;
use simulate::units::Units;
use simulate::warnings::warnings;

use crate::fault::Fault;
use crate::frame::{WavesState, frame};
use crate::session::{Job, Session};
use crate::view_3d::PackageView;
use crate::waves::{CoarseTables, are_cached};

/// Paths of the first frame, and how many times as many the next has.
const FIRST_PATHS: u64 = 4096;
const GROWTH: u64 = 4;
/// Paths of frames between two tables, and the least time from one to the next.
const PATHS_BETWEEN: u64 = 65_536;
const TIME_BETWEEN: Duration = Duration::from_millis(400);
/// Paths in the section.
const PATHS_IN_SECTION: u64 = 24;

/// Traces the jobs of `session` until it ends.
pub fn trace_jobs(session: &Session, cache: &Cache, context: RunContext) {
    while let Some(job) = session.next_job() {
        let context = RunContext { interrupt: &job.interrupt, ..context.mute() };
        let trace = || JobTrace::new(&job, session, cache, context).and_then(|trace| trace.run());
        // A fault of the program ends this trace, not those of other designs.
        let traced = catch_unwind(AssertUnwindSafe(trace))
            .unwrap_or_else(|_| Err(anyhow!("the trace broke off by a fault of the program")));
        match traced {
            Err(error) if !job.interrupt.is_raised() => {
                let file = &job.design.provenance.file;
                session.fail(&job, Fault::of_design(&error, file));
            }
            _ => {}
        }
        session.traced(&job);
    }
}

/// Numbers of paths of the frames of a design that asks for so many.
fn steps(paths: u64) -> Vec<u64> {
    let growing = std::iter::successors(Some(FIRST_PATHS), |paths| paths.checked_mul(GROWTH));
    growing.take_while(|step| *step < paths).chain([paths]).collect()
}

/// Tables by which a frame was traced.
#[derive(Clone, Copy)]
enum Tables<'a> {
    /// Those of the design, where its model has any.
    Of(Option<&'a DesignTables>),
    /// Coarse ones, as far as they are solved.
    Coarse(&'a WavesState),
}

struct JobTrace<'a> {
    job: &'a Job,
    session: &'a Session,
    cache: &'a Cache,
    context: RunContext<'a>,
    package: Option<String>,
    /// Package and paths in three dimensions, or why there are none; traced after the first frame.
    view: RefCell<Option<Result<PackageView>>>,
    warnings: Vec<String>,
}

impl<'a> JobTrace<'a> {
    fn new(
        job: &'a Job,
        session: &'a Session,
        cache: &'a Cache,
        context: RunContext<'a>,
    ) -> Result<Self> {
        let mut warnings = warnings(&job.design)?;
        // A design that cannot be drawn can be traced all the same.
        let package = section(&job.design, context.seed)
            .map_err(|error| warnings.push(format!("the section cannot be drawn: {error:#}")));
        let (package, view) = (package.ok(), RefCell::default());
        Ok(Self { job, session, cache, context, package, view, warnings })
    }

    fn run(&self) -> Result<()> {
        let own = self.tables_of(&self.job.design, self.job.model, true)?;
        // Paths by the tables of the design, not by those before.
        self.view.take();
        let kept = match &self.job.beside {
            Some((design, model)) => self.tables_of(design, *model, false)?,
            None => None,
        };
        for paths in steps(self.job.design.trace.paths) {
            let last = paths == self.job.design.trace.paths;
            let beside = self.beside(paths, kept.as_ref())?;
            let writer = LiveWriter::drawing(beside.as_ref().map(|(beside, _)| beside));
            let (design, model) = (&self.job.design, self.job.model);
            let result = self.model((design, model), paths, own.as_ref(), &writer)?;
            let beside = beside.as_ref().map(|(_, result)| result);
            self.publish(&result, writer, beside, Tables::Of(own.as_ref()), last);
        }
        Ok(())
    }

    /// The tables of a hybrid. While those of the present design are solved, frames show how far
    /// they are.
    fn tables_of(
        &self,
        design: &Design,
        model: Model,
        shows: bool,
    ) -> Result<Option<DesignTables>> {
        if model != Model::Hybrid || design.all_lights().is_some() {
            return Ok(None);
        }
        let coarse = (shows && !are_cached(design, self.cache)).then(|| CoarseTables::new(design));
        if let Some(coarse) = coarse.flatten() {
            self.show_coarse(coarse)?;
        }
        let solved = tables(&[design], Some(self.cache), None, self.context)?;
        Ok(solved.into_iter().next())
    }

    fn show_coarse(&self, mut coarse: CoarseTables) -> Result<()> {
        let mut shown: Option<Instant> = None;
        loop {
            let state = coarse.state();
            let is_due = shown.is_none_or(|at| at.elapsed() >= TIME_BETWEEN);
            if is_due || state.solved == state.rings {
                self.show_mixed(&coarse, &state)?;
                shown = Some(Instant::now());
            }
            if !coarse.solve_next(self.cache, self.context)? {
                return Ok(());
            }
        }
    }

    /// A frame by the tables that are there.
    fn show_mixed(&self, coarse: &CoarseTables, state: &WavesState) -> Result<()> {
        let mut design = self.job.design.clone();
        design.trace.paths = PATHS_BETWEEN.min(design.trace.paths);
        let observation =
            observe(&design, &coarse.surface()?, design.trace.paths, "", self.context)?;
        let mut result = model_result(&design, self.job.model, &observation);
        let writer = LiveWriter::drawing(None);
        let units = Units::from_design(&design, None);
        let output = Output { design: &design, units, out: Path::new("") };
        writer.write(output, &mut result, &mut Cow::Owned(observation), self.context)?;
        self.publish(&result, writer, None, Tables::Coarse(state), false);
        Ok(())
    }

    /// Light and result of what stands beside.
    fn beside(
        &self,
        paths: u64,
        tables: Option<&DesignTables>,
    ) -> Result<Option<(Beside, ModelResult)>> {
        let Some((design, model)) = &self.job.beside else { return Ok(None) };
        let writer = LiveWriter::keeping();
        let result = self.model((design, *model), paths, tables, &writer)?;
        Ok(writer.into_beside().map(|beside| (beside, result)))
    }

    /// Traces a model as `run` does.
    fn model(
        &self,
        (design, model): (&Design, Model),
        paths: u64,
        tables: Option<&DesignTables>,
        writer: &dyn ModelWriter,
    ) -> Result<ModelResult> {
        let mut design = design.clone();
        design.trace.paths = paths;
        let lights = design.all_lights();
        let lights = lights.as_deref();
        let run = Run { design: &design, lights, stopping_rule: None, cache: Some(self.cache) };
        run.model(model, tables, Destination { out: Path::new(""), writer }, self.context)
    }

    fn publish(
        &self,
        result: &ModelResult,
        writer: LiveWriter,
        beside: Option<&ModelResult>,
        tables: Tables,
        last: bool,
    ) {
        let light = writer.into_light();
        let (own, waves) = match tables {
            Tables::Of(own) => (own, None),
            Tables::Coarse(state) => (None, Some(state)),
        };
        let view = self.view(&light, &result.key);
        let has_view = !view.is_null();
        let mut frame = frame(result, beside, &light, self.package.as_deref(), &self.warnings);
        frame["model"] = self.job.model.word().into();
        frame["last"] = last.into();
        frame["waves"] = json!(waves);
        frame["view"] = view;
        let again = (last && !has_view).then(|| frame.clone());
        self.session.publish(self.job, frame);
        // The next design waits for no paths of this one.
        if has_view || self.job.interrupt.is_raised() {
            return;
        }
        let (design, model) = (&self.job.design, self.job.model);
        let traced = PackageView::new(design, model, own, self.context.seed);
        *self.view.borrow_mut() = Some(traced);
        if let Some(mut frame) = again {
            frame["view"] = self.view(&light, &result.key);
            self.session.publish(self.job, frame);
        }
    }

    /// Package and paths as the page reads them, as far as they are traced.
    fn view(&self, light: &LiveLight, model_key: &str) -> Value {
        match (&*self.view.borrow(), &light.far_field) {
            (Some(Ok(view)), Some(far_field)) => view.to_json(far_field, model_key),
            (Some(Err(error)), _) => json!({"error": format!("{error:#}")}),
            _ => Value::Null,
        }
    }
}

/// Section of the package with a few paths by rays, as a part of a page.
fn section(design: &Design, seed: u64) -> Result<String> {
    let parts = match design.colours() {
        None => vec![(design.clone(), PATHS_IN_SECTION)],
        Some(lights) => by_light(design, &lights, PATHS_IN_SECTION)?,
    };
    let (mut found, mut drawing) = (Vec::new(), None);
    for (place, (lit, count)) in parts.iter().enumerate() {
        let surface = dome_surface(lit, Model::Geometric, None)?;
        found.extend(paths(lit, &surface, *count, seed.wrapping_add(place as u64))?);
        drawing.get_or_insert_with(|| package_drawing(lit, surface.meridian()));
    }
    let drawing = drawing.context("expected light to trace")?;
    let heading = Heading::new(&design.name, "plane y = 0, a few paths by rays");
    let picture = compact_picture(&drawing, &heading, &found, &[]);
    Ok(within_page(&picture, "Section of the package with a few paths", "package"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_grow_to_the_paths_of_the_design() {
        assert_eq!(steps(100_000), [4096, 16_384, 65_536, 100_000]);
        assert_eq!(steps(4096), [4096]);
        assert_eq!(steps(100), [100]);
        assert_eq!(steps(u64::MAX).last(), Some(&u64::MAX));
    }
}
