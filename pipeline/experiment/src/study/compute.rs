// SPDX-License-Identifier: MIT OR Apache-2.0
//! Computes a study: traces everything that its set-ups need, each trace once, and stores the
//! figures.
//!
//! A trace is named by the hash of everything it depends on: the fields of the design that
//! [`Design::trace_fields`] lists, seed, paths and tables. A stored trace is read instead of
//! traced. Set-ups that differ only in how a map or far field is read share one
//! trace. Tables have their own names ([`arrays::cache`]), so a change of the tracer's keys
//! recomputes none.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use arrays::cache::Cache;
use design::Design;
use design::resolved::trace_key::ReliefModel;
use results::paired_figure::PairedFigure;
use runtime::key::Key;
use runtime::run_context::RunContext;
use runtime::serde_arrays::List;
use runtime::store::Store;
use simulate::job::Task;
use simulate::model::Model;
use simulate::model_traces::ModelTraces;
use simulate::observation::{Observation, plane_grid};
use simulate::tables::keys;
use simulate::trace_plan::DomeChoice;

use super::definition::Study;
use crate::missing_figure::missing_figure;

use super::trace_figures::{NamedFigures, SetupFigures, TraceId};

/// Version of tracing and reading; raise it whenever the same design would give other numbers.
pub(crate) const TRACE_VERSION: u32 = 12;

/// Folder in the cache of the figures of traces.
const FOLDER: &str = "traces";

/// One trace that a set-up asks for.
struct TraceTask {
    /// Number of the set-up.
    setup: usize,
    /// Number of the design in it.
    design: usize,
    dome: DomeChoice,
    /// Numbers of the probes of the element; empty for a model.
    probes: Range<usize>,
    id: TraceId,
    /// Key of the trace.
    trace_key: Key,
    /// Key of the figures that are read from it.
    figures_key: Key,
}

/// Traces the tasks of a study, and stores what it reads from them.
struct Tracer<'a> {
    study: &'a Study,
    traces: ModelTraces<'a>,
    store: Store,
    context: RunContext<'a>,
}

/// The figures of all set-ups of `study`; traces and tables are kept in `cache`.
///
/// # Errors
/// Errors of the solver and the tracer; an interrupt. Finished traces stay in the cache. A trace
/// that is missing where a job is merged.
pub fn compute(study: &Study, cache: &Cache, context: RunContext) -> Result<Vec<SetupFigures>> {
    let mut tasks = tasks(study, context.seed);
    let mut tracer = Tracer::new(study, cache, context);
    let mut known: BTreeMap<Key, NamedFigures> = BTreeMap::new();
    for task in &tasks {
        if let Some(stored) = tracer.stored(task) {
            known.insert(task.figures_key.clone(), stored);
        }
    }
    // Tasks were made in the order of set-ups; sorted, equal traces and tables are adjacent.
    tasks.sort_by(|a, b| (a.setup, &a.id).cmp(&(b.setup, &b.id)));
    for first in 0..tasks.len() {
        let task = &tasks[first];
        if let Some(stored) = known.get(&task.figures_key) {
            if task.setup == 0 {
                task.has_targets(study, stored)?;
            }
            continue;
        }
        let label = task.label(study);
        ensure!(
            !context.is_merging(),
            "{label}: expected its trace among the pieces of the job, found none that can be used"
        );
        let alike = tasks[first..].iter().filter(|t| t.trace_key == task.trace_key);
        let wanted: Vec<&TraceTask> =
            alike.filter(|t| !known.contains_key(&t.figures_key)).collect();
        known.extend(tracer.trace(&wanted).context(label)?);
        if task.setup == 0 {
            task.has_targets(study, &known[&task.figures_key])?;
        }
        let (done, all) = (known.len(), tasks.len());
        let (setup, _) = &study.setups[task.setup];
        context
            .console
            .say(&format!("{}: {}, {done} of at most {all} traces", setup.name, task.id.design));
    }
    let mut found: Vec<SetupFigures> = vec![SetupFigures::new(); study.setups.len()];
    for task in tasks {
        found[task.setup].insert(task.id, known[&task.figures_key].clone());
    }
    Ok(found)
}

impl<'a> Tracer<'a> {
    fn new(study: &'a Study, cache: &'a Cache, context: RunContext<'a>) -> Self {
        Self {
            study,
            traces: ModelTraces::of_study(cache),
            store: Store::lasting(cache.directory(), FOLDER, context.console),
            context,
        }
    }

    /// Stored figures of `task`.
    fn stored(&self, task: &TraceTask) -> Option<NamedFigures> {
        self.store.entries(task.figures_key.clone()).find_value(0)
    }

    /// Traces what all of `wanted` are read from, and stores the figures of each.
    fn trace(&mut self, wanted: &[&TraceTask]) -> Result<BTreeMap<Key, NamedFigures>> {
        let Some(&task) = wanted.first() else {
            return Ok(BTreeMap::new());
        };
        let observation = self.observe(task)?;
        let figures = wanted.iter().map(|other| {
            let figures = other.figures(self.study, &observation);
            (other.figures_key.clone(), figures)
        });
        let read: BTreeMap<Key, NamedFigures> = figures.collect();
        for (key, figures) in &read {
            self.store.entries(key.clone()).keep_value(0, figures)?;
        }
        Ok(read)
    }

    fn observe(&mut self, task: &TraceTask) -> Result<Observation> {
        let design = task.design(self.study);
        let what = format!("{} {}", task.label(self.study), task.id.model);
        self.traces.observe(design, task.dome, &what, self.context)
    }
}

/// The traces of a study, each once with all that is read from it, for several processes to share.
pub fn shared_traces(study: &Arc<Study>, seed: u64) -> Vec<SharedTrace> {
    let mut numbers: BTreeMap<Key, usize> = BTreeMap::new();
    let mut traces: Vec<SharedTrace> = Vec::new();
    for task in tasks(study, seed) {
        let number = *numbers.entry(task.trace_key.clone()).or_insert(traces.len());
        let paths = task.design(study).trace.paths;
        if number == traces.len() {
            let (study, label) = (Arc::clone(study), task.label(study));
            traces.push(SharedTrace { study, seed, label, paths, tasks: Vec::new() });
        }
        let trace = &mut traces[number];
        trace.paths = trace.paths.max(paths);
        trace.tasks.push(task);
    }
    traces
}

/// A trace of a study and all that is read from it: one piece.
pub struct SharedTrace {
    study: Arc<Study>,
    seed: u64,
    label: String,
    paths: u64,
    tasks: Vec<TraceTask>,
}

impl Task for SharedTrace {
    fn label(&self) -> &str {
        &self.label
    }

    fn pieces(&self) -> u64 {
        1
    }

    fn paths(&self) -> u64 {
        self.paths
    }

    fn tables_of(&self) -> Option<&Design> {
        let task = self.tasks.first()?;
        let design = task.design(&self.study);
        // With several wavelengths, each has tables of its own.
        let needs_tables = task.dome == DomeChoice::Model(Model::Hybrid);
        (needs_tables && design.all_lights().is_none()).then_some(design)
    }

    fn missing(&self, cache: &Cache, context: RunContext) -> Result<Vec<u64>> {
        let tracer = Tracer::new(&self.study, cache, context);
        let complete = self.tasks.iter().all(|task| tracer.stored(task).is_some());
        Ok(if complete { Vec::new() } else { vec![0] })
    }

    fn compute(&self, pieces: Range<u64>, cache: &Cache, context: RunContext) -> Result<()> {
        // The trace itself is the piece, not its groups of paths.
        let context = RunContext { seed: self.seed, checkpoints: None, ..context };
        if pieces.is_empty() {
            return Ok(());
        }
        let mut tracer = Tracer::new(&self.study, cache, context);
        let tasks = self.tasks.iter();
        let wanted: Vec<&TraceTask> = tasks.filter(|task| tracer.stored(task).is_none()).collect();
        tracer.trace(&wanted).map(drop).with_context(|| self.label.clone())
    }
}

/// The tasks of all set-ups of `study`, in their order.
fn tasks(study: &Study, seed: u64) -> Vec<TraceTask> {
    let mut tasks = Vec::new();
    for (setup, (_, designs)) in study.setups.iter().enumerate() {
        for (number, design) in designs.iter().enumerate() {
            let mut add = |dome, probes| {
                tasks.push(TraceTask::new(study, (setup, number), dome, probes, seed));
            };
            for &model in &study.file.models {
                add(DomeChoice::Model(model), 0..0);
            }
            let mut begin = 0;
            while let Some(first) = study.file.probes.get(begin) {
                let same = study.file.probes[begin..]
                    .iter()
                    .take_while(|p| (&p.design, p.element) == (&first.design, first.element))
                    .count();
                if first.design == design.name {
                    add(DomeChoice::Element(first.element), begin..begin + same);
                }
                begin += same;
            }
        }
    }
    tasks
}

impl TraceTask {
    fn new(
        study: &Study,
        (setup, number): (usize, usize),
        dome: DomeChoice,
        probes: Range<usize>,
        seed: u64,
    ) -> Self {
        let design = &study.setups[setup].1[number];
        let of_element = &study.file.probes[probes.clone()];
        let (kind, element, model) = match dome {
            DomeChoice::Model(model) => (model, None, model.key(design)),
            DomeChoice::Element(element) => {
                (Model::Geometric, Some(element), of_element[0].place())
            }
        };
        let (relief, tables) = match kind {
            Model::Hybrid => {
                let keys = keys(design);
                let keys: Vec<&str> = keys.iter().map(Key::hex).collect();
                (ReliefModel::OrderTables, json!(keys))
            }
            Model::Geometric => (ReliefModel::Elements, Value::Null),
            Model::Fine => (ReliefModel::Rings, Value::Null),
            Model::Control => (ReliefModel::RayTables, Value::Null),
        };
        let fields = design.trace_fields(relief);
        let figures_key = Key::of(&json!({
            "read": [json!(design.emitted), json!(design.receivers)],
            "trace_version": TRACE_VERSION,
            "version": env!("CARGO_PKG_VERSION"),
            "design": fields,
            "reading": design.reading_fields(),
            "panel": design.panel,
            "model": model,
            "probes": element.map(|_| of_element),
            "tables": tables,
            "seed": seed,
        }));
        // The bins that are read affect the extent of the map.
        let plane = plane_grid(design);
        let trace_key = Key::of(&json!({
            "design": fields,
            "plane": [plane.columns, plane.rows],
            "sub_pixels": design.sub_pixels(),
            "model": kind.key(design),
            "element": element,
            "tables": tables,
            "seed": seed,
        }));
        let id = TraceId { design: design.name.clone(), model };
        Self { setup, design: number, dome, probes, id, trace_key, figures_key }
    }

    fn design<'a>(&self, study: &'a Study) -> &'a Design {
        &study.setups[self.setup].1[self.design]
    }

    /// Refuses targets of figures that a design of the base does not have.
    fn has_targets(&self, study: &Study, found: &NamedFigures) -> Result<()> {
        let TraceId { design, model } = &self.id;
        let of_design = study.targets.figures.get(design);
        let wanted = of_design.and_then(|of| of.get(model)).into_iter().flatten();
        let figures: Vec<String> = found.iter().map(|(key, _)| key.clone()).collect();
        let mut others = wanted.filter(|(figure, _)| !figures.contains(figure));
        let key = format!("targets.{design}.{model}");
        others.next().map_or(Ok(()), |(figure, _)| {
            Err(missing_figure(&key, figure, &figures, self.design(study)))
                .with_context(|| study.inputs[0].file.clone())
        })
    }

    /// Set-up and design, for people.
    fn label(&self, study: &Study) -> String {
        let (setup, _) = &study.setups[self.setup];
        format!("set-up {:?}, {}", setup.name, self.id.design)
    }

    /// Figures of an observation, with their jackknife replicates.
    fn figures(&self, study: &Study, observation: &Observation) -> NamedFigures {
        let design = self.design(study);
        if let DomeChoice::Model(_) = self.dome {
            return observation.estimated_replicates(design, |_| true);
        }
        let probes = study.file.probes[self.probes.clone()].iter().map(|probe| {
            let share = |powers: &[f64]| -> f64 {
                let ranges = probe.ranges_deg.iter();
                ranges.map(|List([from, to])| observation.sphere.share(powers, *from, *to)).sum()
            };
            let far = &observation.far_field;
            let without: Vec<f64> = (0..far.count()).map(|g| share(&far.without(g))).collect();
            let value = share(far.total());
            (probe.figure(), PairedFigure::new(value, without))
        });
        probes.collect()
    }
}
