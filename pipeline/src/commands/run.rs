// SPDX-License-Identifier: MIT OR Apache-2.0
//! `batwing run`: traces one design in the models asked for.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use serde_json::Value;

use arrays::cache::Cache;
use design::Design;
use design::spectrum::Spectrum;
use design::spectrum::lights::Lights;
use metrics::digits::thousands;
use report::run_summary;
use results::earlier::Earlier;
use results::schema::DomeParts;
use results::{DesignResult, Results};
use runtime::run_context::RunContext;
use runtime::store::{MIN_PATHS, Store};
use simulate::description::description;
use simulate::dome_surface::dome_surface;
use simulate::film_table::{FilmTreatment, treatment};
use simulate::job::{Job, SharedWork, Task};
use simulate::model::Model;
use simulate::model_writer::Destination;
use simulate::run::Run;
use simulate::stopping_rule::{ErrorTarget, StoppingRule};
use simulate::trace::GROUPS;
use simulate::warnings::warnings;
use simulate::{model_result, scene, scene_check};

use super::arguments::{ModelChoice, cache, paths};
use super::outputs::{self, TABLES, checkpoints, note_interrupt, results_writable};
use super::shardable::{CommandLine, JobOptions, Shardable, Sharing};
use output::ModelFilesWriter;
use output::in_memory::{MemoryWriter, ModelArrays};

/// `batwing run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Design file
    #[arg(value_name = "DESIGN.toml")]
    pub design: PathBuf,
    /// How to compute it
    #[arg(long, value_enum, default_value = "all")]
    pub model: ModelChoice,
    /// Paths to trace, instead of the design's trace.paths
    #[arg(long, value_name = "N", value_parser = paths)]
    pub paths: Option<u64>,
    /// Trace further batches of as many paths until the standard error of a figure, of its paths alone, is at
    /// most this
    #[arg(long, value_name = "FIGURE=ERROR")]
    pub until_error: Option<ErrorTarget>,
    /// With --until-error: begin no batch that would go beyond so many paths
    #[arg(
        long,
        value_name = "N",
        default_value_t = 2_000_000_000,
        value_parser = paths,
        requires = "until_error"
    )]
    pub most_paths: u64,
    /// Directory for results
    #[arg(long, value_name = "DIR", default_value = "results")]
    pub out: PathBuf,
    /// Directory that keeps tables for later runs [default: .batwing-cache beside the results]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Shards.
    #[command(flatten)]
    pub sharing: Sharing,
}

impl Shardable for RunArgs {
    fn job_options(&self) -> JobOptions<'_> {
        JobOptions::new(&self.out, self.cache.as_deref(), &self.sharing)
    }

    fn words(&self) -> Vec<String> {
        let model = self.model.to_possible_value();
        let model = model.as_ref().map(PossibleValue::get_name);
        CommandLine::new("run", &self.design)
            .option("--model", model)
            .option("--paths", self.paths)
            .all()
    }

    fn work(&self, context: RunContext) -> Result<Box<dyn SharedWork>> {
        ensure!(
            self.until_error.is_none(),
            "--until-error: expected a number of paths for shards, got batches, each of which follows from those before"
        );
        let design = self.design()?;
        let models = self.models(&design)?;
        let lights = design.all_lights();
        let run =
            Run { design: &design, lights: lights.as_deref(), stopping_rule: None, cache: None };
        run.check(&models, context)?;
        let plans = run.plans(&models, context)?.into_iter();
        let tasks = plans.map(|plan| Box::new(plan) as Box<dyn Task>);
        let inputs = design.provenance.inputs();
        Ok(Box::new(Job::new(Vec::new(), tasks.collect(), inputs)))
    }

    /// Traces the design and writes its results and pictures.
    fn run(&self, context: RunContext) -> Result<()> {
        of_design(scene_check::load(&self.design)?, self, context)
    }
}

impl RunArgs {
    /// The design with the number of paths asked for.
    fn design(&self) -> Result<Design> {
        Ok(self.with_paths(scene_check::load(&self.design)?))
    }

    fn with_paths(&self, mut design: Design) -> Design {
        if let Some(paths) = self.paths {
            design.trace.paths = paths;
        }
        design
    }

    /// The models asked for.
    fn models(&self, design: &Design) -> Result<Vec<Model>> {
        match self.model.one() {
            Some(model) => Ok(vec![model.available(design)?]),
            None => Ok(Model::all_of(design)),
        }
    }
}

/// A design with all that decides its traces, checked.
struct Prepared {
    design: Design,
    models: Vec<Model>,
    stopping_rule: Option<StoppingRule>,
}

impl Prepared {
    /// Checks `design` and the arguments against each other, and says what the user may not expect.
    fn new(design: Design, arguments: &RunArgs, context: RunContext) -> Result<Self> {
        let mut design = arguments.with_paths(design);
        let stopping_rule = arguments
            .until_error
            .clone()
            .map(|target| StoppingRule { target, most_paths: arguments.most_paths });
        if let Some(rule) = &stopping_rule {
            rule.target.check(&design)?;
            design.trace.paths = rule.batch(design.trace.paths)?;
        }
        let models = arguments.models(&design)?;
        for warning in warnings(&design)? {
            context.console.warn(&warning);
        }
        if let (None, Some(left_out)) = (arguments.model.one(), Model::left_out(&design)) {
            let file = &design.provenance.file;
            context.console.warn(&format!("{file}: {left_out}"));
        }
        let traced = design.trace.paths.next_multiple_of(GROUPS as u64);
        let one_trace =
            design.spectrum.as_ref().is_none_or(Spectrum::is_line) && design.lights.is_none();
        if traced != design.trace.paths && one_trace {
            let [asked, traced] = [design.trace.paths, traced].map(thousands);
            context.console.say(&format!(
                "{asked} paths are traced as {traced}: {GROUPS} groups of equal size"
            ));
        }
        let prepared = Self { design, models, stopping_rule };
        let lights = prepared.design.all_lights();
        prepared.of_lights(lights.as_deref(), None).check(&prepared.models, context)?;
        Ok(prepared)
    }

    fn of_lights<'a>(&'a self, lights: Option<&'a Lights>, cache: Option<&'a Cache>) -> Run<'a> {
        let stopping_rule = self.stopping_rule.as_ref();
        Run { design: &self.design, lights, stopping_rule, cache }
    }

    /// True where finished groups of paths are worth keeping.
    fn stores_paths(&self) -> bool {
        self.stopping_rule.is_some() || self.design.trace.paths >= MIN_PATHS
    }

    /// Traces the models and writes their files, all but `results.json`.
    fn trace(
        &self,
        destination: Destination,
        cache: Option<&Cache>,
        context: RunContext,
    ) -> Result<Results> {
        let design = &self.design;
        let lights = design.all_lights();
        let run = self.of_lights(lights.as_deref(), cache);
        let models = run.models(&self.models, destination, context)?;
        let designs = vec![DesignResult {
            name: design.name.clone(),
            design_sha256: design.provenance.sha256.clone(),
            models,
        }];
        Ok(Results {
            quick: false,
            seed: context.seed,
            inputs: design.provenance.inputs(),
            files: results::written(destination.out, &designs, [])?,
            designs,
            references: Vec::new(),
            parts: DomeParts::default(),
        })
    }
}

/// Traces `design` in place of the file that the arguments name.
///
/// # Errors
/// Design and arguments that exclude each other; files that cannot be written.
pub fn of_design(design: Design, arguments: &RunArgs, context: RunContext) -> Result<()> {
    let started = Instant::now();
    let prepared = Prepared::new(design, arguments, context)?;
    let Prepared { design, models, .. } = &prepared;
    let needs_tables = models.contains(&Model::Hybrid);
    let stores_paths = prepared.stores_paths();
    let tabulates_films = matches!(treatment(design), FilmTreatment::Table(_));
    let stores = stores_paths || tabulates_films;
    let cache = (arguments.cache.is_some() || needs_tables || stores)
        .then(|| cache(arguments.cache.as_deref(), &arguments.out));
    let folders = models.iter().map(|&m| model_result::folder(design, m));
    results_writable(&arguments.out, folders, &[results::FILE], cache.as_ref())?;
    let stored = [needs_tables.then_some(TABLES), stores_paths.then_some(outputs::PATHS)];
    note_interrupt(context, cache.as_ref(), &stored);
    let checkpoints = checkpoints(cache.as_ref().filter(|_| stores), context)?;
    let earlier = earlier(design, models, arguments, context);
    let writer = ModelFilesWriter { earlier: earlier.clone() };
    let destination = Destination { out: &arguments.out, writer: &writer };
    let storing = context.storing(checkpoints.as_ref());
    let results = prepared.trace(destination, cache.as_ref(), storing)?;
    let standing = standing(design)?;
    match &earlier {
        Some(earlier) => results.write_beside(earlier, &arguments.out)?,
        None => results.write(&arguments.out)?,
    }
    checkpoints.iter().for_each(Store::finish);
    context.console.result(&results.to_json()?, || {
        let light = run_summary::plain_text(&results.designs[0]);
        let (out, seconds) = (arguments.out.display(), started.elapsed().as_secs_f64());
        let wavelengths = results.wavelength_errors();
        format!(
            "{light}{standing}{wavelengths}\n{seconds:.1} s; results in {out}/{}",
            results::FILE
        )
    })
}

/// Traces `design` as [`of_design`] does and writes no file, except into the cache that the
/// arguments name. Returns `results.json` and the arrays of each model.
///
/// # Errors
/// Design and arguments that exclude each other; a cache that cannot be written.
pub fn in_memory(
    design: Design,
    arguments: &RunArgs,
    context: RunContext,
) -> Result<(Value, ModelArrays)> {
    let prepared = Prepared::new(design, arguments, context)?;
    let cache = arguments.cache.as_deref().map(|given| Cache::new(given.to_owned()));
    let checkpoints = checkpoints(cache.as_ref(), context)?;
    let writer = MemoryWriter::default();
    let destination = Destination { out: Path::new(""), writer: &writer };
    let results =
        prepared.trace(destination, cache.as_ref(), context.storing(checkpoints.as_ref()))?;
    checkpoints.iter().for_each(Store::finish);
    Ok((results.to_json()?, writer.into_arrays()))
}

/// Results in the directory that this run does not replace. Says what stays and what does not.
fn earlier(
    design: &Design,
    models: &[Model],
    arguments: &RunArgs,
    context: RunContext,
) -> Option<Earlier> {
    let path = arguments.out.join(results::FILE);
    let models: Vec<String> = models.iter().map(|model| model.key(design)).collect();
    let found = Earlier::read(&arguments.out, &design.name, &design.provenance.sha256, &models);
    let found = found.unwrap_or_else(|error| {
        let path = path.display();
        context.console.warn(&format!("`{path}` is replaced, not added to: {error:#}"));
        None
    })?;
    for model in &found.left_out {
        context.console.warn(&format!("`{}`: no longer lists {model}", path.display()));
    }
    if found.is_empty() {
        return None;
    }
    let kept = found.kept().join(", ");
    context.console.say(&format!("`{}` keeps {kept} beside this run", path.display()));
    Some(found)
}

/// Lines on how the hybrid solves the rings, what stands on the bottom, and narrow gaps; empty where
/// there is nothing to say.
fn standing(design: &Design) -> Result<String> {
    let surface = dome_surface(design, Model::Geometric, None)?;
    let mut said = scene::standing(design, &surface)?.describe();
    said.extend(
        description(design)
            .into_iter()
            .filter(|(key, _)| ["rings", "symmetry", "nine and thirteen points"].contains(key)),
    );
    let shown = |key| if key == "bottom" { "on the bottom" } else { key };
    Ok(said
        .into_iter()
        .map(|(key, words)| format!("{}: {words}\n", shown(key)))
        .collect::<Vec<_>>()
        .concat())
}
