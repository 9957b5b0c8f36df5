// SPDX-License-Identifier: MIT OR Apache-2.0
//! Computes a study: traces everything that its set-ups need, each trace once, and stores the
//! figures.
//!
//! A trace is named by the hash of everything it depends on: the fields of the design that
//! [`Design::trace_fields`] lists, seed, paths and tables. A stored trace is read instead of
//! traced. Set-ups that differ only in how a map or far field is read share one
//! trace. Tables have their own names ([`files::cache`]), so a change of the tracer's keys
//! recomputes none.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde_json::{Value, json};

use design::Design;
use design::resolved::trace_key::ReliefModel;
use design::serde_arrays::List;
use files::atomic_file;
use files::cache::{Cache, Key};
use files::content_hash::sha256_hex;
use files::run_context::RunContext;
use geometry::Meridian;
use metrics::{JackknifedFigure, spread};
use simulate::dome_surface::dome_surface;
use simulate::job::Task;
use simulate::model::Model;
use simulate::observation::{Observation, plane_grid};
use simulate::scene::DomeSurface;
use simulate::seeds::mix;
use simulate::spectral::SpectralJob;
use simulate::tables::{DesignTables, keys, tables};
use simulate::trace::observe;

use super::definition::Study;
use super::file::Probe;
use super::trace_figures::{NamedFigures, SetupFigures, ShortRuns, TraceFigures, TraceId};

/// Version of tracing and reading; raise it whenever the same design would give other numbers.
const TRACE_VERSION: u32 = 7;

/// One trace that a set-up asks for.
struct TraceTask<'a> {
    /// Number of the set-up.
    setup: usize,
    place: TraceId,
    design: &'a Design,
    what: TraceKind<'a>,
    /// Key of the trace.
    trace_key: Key,
    /// Key of the figures that are read from it.
    figures_key: Key,
    /// Number of traces, each with its own seed, that short runs are cut from.
    traces: u64,
}

#[derive(Clone, Copy)]
enum TraceKind<'a> {
    Model(Model),
    Probe(&'a [Probe]),
}

/// Where a task stands in a study.
#[derive(Debug, Clone)]
struct TaskIndex {
    /// Number of the set-up.
    setup: usize,
    /// Number of the design in it.
    design: usize,
    what: PlacedKind,
}

#[derive(Debug, Clone)]
enum PlacedKind {
    Model(Model),
    /// Numbers of probes of one element.
    Probes(Range<usize>),
}

/// The figures of all set-ups of `study`; traces and tables are kept in `cache`.
///
/// # Errors
/// Those of the solver and the tracer; an interrupt. Finished traces stay in the cache. A trace
/// that is missing where a job is merged.
pub fn compute(study: &Study, cache: &Cache, context: RunContext) -> Result<Vec<SetupFigures>> {
    let mut tasks: Vec<TraceTask> =
        places(study).iter().map(|place| task(study, place, context.seed)).collect();
    let mut found: Vec<SetupFigures> = vec![SetupFigures::new(); study.setups.len()];
    let mut known: BTreeMap<Key, TraceFigures> = BTreeMap::new();
    for task in &tasks {
        if let Some(stored) = read(cache, &task.figures_key, context) {
            known.insert(task.figures_key.clone(), stored);
        }
    }
    // Tasks were made in the order of set-ups; sorted, equal traces and tables are adjacent.
    tasks.sort_by(|a, b| (a.setup, &a.place).cmp(&(b.setup, &b.place)));
    let mut held: Option<(Vec<Key>, DesignTables)> = None;
    for first in 0..tasks.len() {
        let task = &tasks[first];
        if known.contains_key(&task.figures_key) {
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
        let traced = trace(study, &wanted, &mut held, cache, context);
        known.extend(traced.with_context(|| label.clone())?);
        let (done, all) = (known.len(), tasks.len());
        let (setup, _) = &study.setups[task.setup];
        context
            .console
            .say(&format!("{}: {}, {done} of at most {all} traces", setup.name, task.place.design));
    }
    for task in tasks {
        found[task.setup].insert(task.place, known[&task.figures_key].clone());
    }
    Ok(found)
}

/// Traces what all of `wanted` are read from, and stores the figures of each.
fn trace(
    study: &Study,
    wanted: &[&TraceTask],
    held: &mut Option<(Vec<Key>, DesignTables)>,
    cache: &Cache,
    context: RunContext,
) -> Result<BTreeMap<Key, TraceFigures>> {
    let Some(&task) = wanted.first() else {
        return Ok(BTreeMap::new());
    };
    let observation = observe_task(task, held, cache, context)?;
    let mut read: BTreeMap<Key, (&TraceTask, TraceFigures)> = BTreeMap::new();
    for other in wanted {
        let of = TraceFigures {
            figures: figures(other, &observation),
            short_runs: short_runs(other, &observation, &study.short_runs),
        };
        read.insert(other.figures_key.clone(), (other, of));
    }
    for further in 1..task.traces {
        let seed = mix(context.seed.wrapping_add(further));
        let observation = observe_task(task, held, cache, RunContext { seed, ..context })?;
        for (other, figures) in read.values_mut() {
            let runs = short_runs(other, &observation, &study.short_runs);
            for (all, more) in figures.short_runs.iter_mut().zip(runs) {
                all.values.extend(more.values);
            }
        }
    }
    let mut traced = BTreeMap::new();
    for (key, (_, figures)) in read {
        write(cache, &key, &figures)?;
        traced.insert(key, figures);
    }
    Ok(traced)
}

/// The traces of a study, each once with all that is read from it, for several processes to share.
pub fn shared_traces(study: &Arc<Study>, seed: u64) -> Vec<SharedTrace> {
    let mut numbers: BTreeMap<Key, usize> = BTreeMap::new();
    let mut traces: Vec<SharedTrace> = Vec::new();
    for place in places(study) {
        let task = task(study, &place, seed);
        let number = *numbers.entry(task.trace_key.clone()).or_insert(traces.len());
        if number == traces.len() {
            traces.push(SharedTrace {
                study: Arc::clone(study),
                seed,
                label: task.label(study),
                paths: task.design.trace.paths * task.traces,
                places: Vec::new(),
                keys: Vec::new(),
            });
        }
        let trace = &mut traces[number];
        trace.paths = trace.paths.max(task.design.trace.paths * task.traces);
        trace.places.push(place);
        trace.keys.push(task.figures_key);
    }
    traces
}

/// A trace of a study and all that is read from it: one piece.
pub struct SharedTrace {
    study: Arc<Study>,
    seed: u64,
    label: String,
    paths: u64,
    places: Vec<TaskIndex>,
    /// Keys of the figures.
    keys: Vec<Key>,
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
        let place = self.places.first()?;
        let design = &self.study.setups[place.setup].1[place.design];
        // With several wavelengths, each has tables of its own.
        let needs_tables = matches!(place.what, PlacedKind::Model(Model::Hybrid));
        (needs_tables && design.all_lights().is_none()).then_some(design)
    }

    fn missing(&self, cache: &Cache, context: RunContext) -> Result<Vec<u64>> {
        let whole = self.keys.iter().all(|key| read(cache, key, context).is_some());
        Ok(if whole { Vec::new() } else { vec![0] })
    }

    fn compute(&self, pieces: Range<u64>, cache: &Cache, context: RunContext) -> Result<()> {
        // The trace itself is the piece, not its groups of paths.
        let context = RunContext { seed: self.seed, checkpoints: None, ..context };
        if pieces.is_empty() {
            return Ok(());
        }
        let places = self.places.iter();
        let tasks: Vec<TraceTask> =
            places.map(|place| task(&self.study, place, self.seed)).collect();
        let unread = |task: &&TraceTask| read(cache, &task.figures_key, context).is_none();
        let wanted: Vec<&TraceTask> = tasks.iter().filter(unread).collect();
        let traced = trace(&self.study, &wanted, &mut None, cache, context);
        traced.map(drop).with_context(|| self.label.clone())
    }
}

fn places(study: &Study) -> Vec<TaskIndex> {
    let mut places = Vec::new();
    for (setup, (_, designs)) in study.setups.iter().enumerate() {
        for (number, design) in designs.iter().enumerate() {
            let mut add = |what| {
                places.push(TaskIndex { setup, design: number, what });
            };
            for &model in &study.models {
                add(PlacedKind::Model(model));
            }
            let mut begin = 0;
            while let Some(first) = study.probes.get(begin) {
                let same = study.probes[begin..]
                    .iter()
                    .take_while(|p| (&p.design, p.element) == (&first.design, first.element))
                    .count();
                if first.design == design.name {
                    add(PlacedKind::Probes(begin..begin + same));
                }
                begin += same;
            }
        }
    }
    places
}

impl TraceTask<'_> {
    /// What it is, for people.
    fn label(&self, study: &Study) -> String {
        let (setup, _) = &study.setups[self.setup];
        format!("set-up {:?}, {}", setup.name, self.place.design)
    }
}

fn task<'a>(study: &'a Study, place: &TaskIndex, seed: u64) -> TraceTask<'a> {
    let setup = place.setup;
    let design = &study.setups[setup].1[place.design];
    let what = match &place.what {
        PlacedKind::Model(model) => TraceKind::Model(*model),
        PlacedKind::Probes(probes) => TraceKind::Probe(&study.probes[probes.clone()]),
    };
    // Short runs are cut from traces of models alone.
    let (model, short_runs, traces) = match what {
        TraceKind::Model(model) => {
            let runs = study.short_runs.as_slice();
            (model.key(design), runs, study.short_run_traces)
        }
        TraceKind::Probe(probes) => (probes[0].place(), &[][..], 1),
    };
    let (kind, probes) = match what {
        TraceKind::Model(kind) => (kind, None),
        TraceKind::Probe(probes) => (Model::Geometric, Some(json!(probes))),
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
        "trace_version": TRACE_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "design": fields,
        "reading": design.reading_fields(),
        "model": model,
        "probes": probes,
        "short_runs": short_runs,
        "short_run_traces": traces,
        "tables": tables,
        "seed": seed,
    }));
    let element = match what {
        TraceKind::Model(_) => None,
        TraceKind::Probe(probes) => probes.first().map(|p| p.element),
    };
    // The bins that are read affect the extent of the map.
    let plane = plane_grid(design);
    let trace_key = Key::of(&json!({
        "design": fields,
        "plane": [plane.columns, plane.rows],
        "model": kind.key(design),
        "element": element,
        "tables": tables,
        "seed": seed,
    }));
    let place = TraceId { design: design.name.clone(), model };
    TraceTask { setup, place, design, what, trace_key, figures_key, traces }
}

/// Traces one task; `held` keeps the tables used last.
fn observe_task(
    task: &TraceTask,
    held: &mut Option<(Vec<Key>, DesignTables)>,
    cache: &Cache,
    context: RunContext,
) -> Result<Observation> {
    let design = task.design;
    if let (TraceKind::Model(model), Some(lights)) = (task.what, design.all_lights()) {
        let job = SpectralJob { design, lights: &lights, model, cache: Some(cache), context };
        return job.observe();
    }
    let surface = match task.what {
        TraceKind::Model(Model::Hybrid) => {
            let keys = keys(design);
            if held.as_ref().is_none_or(|(of, _)| *of != keys) {
                *held = None;
                let solved = tables(&[design], Some(cache), None, context)?.remove(0);
                *held = Some((keys, solved));
            }
            let tables = held.as_ref().map(|h| &h.1);
            dome_surface(design, Model::Hybrid, tables)?
        }
        TraceKind::Model(model) => dome_surface(design, model, None)?,
        TraceKind::Probe(probes) => {
            let dome = design.base().with_context(|| format!("{} has no dome", design.name))?;
            DomeSurface::Only(Meridian::stepped(dome, &design.elements)?, probes[0].element)
        }
    };
    let what = format!("{} {}", design.name, task.place.model);
    observe(design, &surface, design.trace.paths, &what, context)
}

/// Figures of an observation, with their jackknife replicates.
fn figures(task: &TraceTask, observation: &Observation) -> NamedFigures {
    match task.what {
        TraceKind::Model(_) => {
            let without = observation.without(task.design);
            let figures = observation.figures(task.design).into_iter();
            let figure = |f: results::Figure| {
                let without = without.iter().find(|(key, _)| *key == f.key)?;
                let figure = JackknifedFigure {
                    value: f.estimate.value,
                    standard_error: f.estimate.standard_error,
                    without: without.1.clone(),
                };
                Some((f.key.to_owned(), figure))
            };
            figures.filter_map(figure).collect()
        }
        TraceKind::Probe(probes) => probes
            .iter()
            .map(|probe| {
                let share = |powers: &[f64]| -> f64 {
                    let ranges = probe.ranges_deg.iter();
                    ranges
                        .map(|List([from, to])| observation.sphere.share(powers, *from, *to))
                        .sum()
                };
                let far = &observation.far_field;
                let without: Vec<f64> = (0..far.count()).map(|g| share(&far.without(g))).collect();
                let figure = JackknifedFigure {
                    value: share(far.total()),
                    standard_error: spread(&without),
                    without,
                };
                (probe.figure(), figure)
            })
            .collect(),
    }
}

/// Short runs cut from an observation of a model.
fn short_runs(task: &TraceTask, observation: &Observation, paths: &[u64]) -> Vec<ShortRuns> {
    let asked = match task.what {
        TraceKind::Model(_) => paths,
        TraceKind::Probe(_) => &[],
    };
    let of = |&paths: &u64| {
        let figures = observation.short_runs(task.design, paths).into_iter();
        figures.map(move |(figure, values)| ShortRuns {
            figure: figure.to_owned(),
            paths: observation.paths_of_run(paths),
            values,
        })
    };
    asked.iter().flat_map(of).collect()
}

/// The figures of a trace, as they are stored.
#[derive(Deserialize)]
struct StoredFigures {
    /// The key under which they were stored.
    key: String,
    /// SHA-256 of `figures` as they are printed.
    sha256: String,
    figures: TraceFigures,
}

fn path(cache: &Cache, key: &Key) -> PathBuf {
    cache.directory().join("traces").join(format!("{}.json", key.hex()))
}

fn read(cache: &Cache, key: &Key, context: RunContext) -> Option<TraceFigures> {
    let path = path(cache, key);
    let text = std::fs::read(&path).ok()?;
    let read = serde_json::from_slice::<StoredFigures>(&text).map_err(anyhow::Error::from);
    let whole = read.and_then(|stored| {
        let content = serde_json::to_string(&stored.figures)?;
        ensure!(sha256_hex(content.as_bytes()) == stored.sha256, "it was altered");
        ensure!(
            stored.key == key.hex(),
            "expected the trace of key {}, got that of {}",
            key.hex(),
            stored.key
        );
        Ok(stored.figures)
    });
    match whole {
        Ok(figures) => Some(figures),
        Err(error) => {
            context.console.warn(&format!(
                "`{}` is no usable trace ({error}); tracing it anew",
                path.display()
            ));
            None
        }
    }
}

fn write(cache: &Cache, key: &Key, figures: &TraceFigures) -> Result<()> {
    let content = serde_json::to_string(figures)?;
    let sha256 = sha256_hex(content.as_bytes());
    let text =
        format!("{{\"key\":\"{}\",\"sha256\":\"{sha256}\",\"figures\":{content}}}\n", key.hex());
    atomic_file::write_bytes(&path(cache, key), text.as_bytes())
}
