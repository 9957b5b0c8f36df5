// SPDX-License-Identifier: MIT OR Apache-2.0
//! Computes a study: traces everything that its set-ups need, each trace once, and stores the
//! figures.
//!
//! A trace is named by the hash of everything it depends on: the resolved design without its names
//! (for models of rays, without the settings of tables), seed, paths and tables. A stored trace is
//! read instead of traced. Set-ups that differ only in how a map or far field is read share one
//! trace. Tables have their own names ([`crate::cache`]), so a change of the tracer's keys
//! recomputes none.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde_json::{Value, json};

use super::definition::Study;
use super::file::Probe;
use super::trace_figures::{
    JackknifedFigure, NamedFigures, SetupFigures, ShortRuns, TraceFigures, TraceId,
};
use crate::atomic_file;
use crate::cache::{Cache, Key};
use crate::config::design::Design;
use crate::config::design::solids::CheckedSolid;
use crate::content_hash::sha256_hex;
use crate::geometry::Meridian;
use crate::metrics::spread;
use crate::run_context::RunContext;
use crate::stages::dome_surface::dome_surface;
use crate::stages::model::Model;
use crate::stages::observation::{Observation, plane_grid};
use crate::stages::scene::DomeSurface;
use crate::stages::seeds::mix;
use crate::stages::spectral::SpectralJob;
use crate::stages::tables::{DesignTables, keys, tables};
use crate::stages::trace::observe;

/// Version of tracing and reading; raise it whenever the same design would give other numbers.
const TRACE_VERSION: u32 = 6;

/// Keys of a design that affect only how an observation is read.
const READING_KEYS: [(&str, &[&str]); 2] = [
    ("receiver", &["full_scale", "zero", "read_bin_mm"]),
    (
        "far_field",
        &[
            "centre_deg",
            "peak",
            "peak_fit_deg",
            "read_bin_deg",
            "read_bins",
            "cut_deg",
        ],
    ),
];

/// One trace that a set-up asks for.
struct TraceTask<'a> {
    /// Number of the set-up.
    setup: usize,
    place: TraceId,
    design: &'a Design,
    what: TraceKind<'a>,
    /// Hash of the trace, and of the figures read from it.
    seen: Key,
    judged: Key,
    /// Number of traces, each with its own seed, that short runs are cut from.
    traces: u64,
}

#[derive(Clone, Copy)]
enum TraceKind<'a> {
    Model(Model),
    Probe(&'a [Probe]),
}

/// The figures of all set-ups of `study`; traces and tables are kept in `cache`.
///
/// # Errors
/// Those of the solver and the tracer; an interrupt. Finished traces stay in the cache.
pub fn compute(study: &Study, cache: &Cache, context: RunContext) -> Result<Vec<SetupFigures>> {
    let mut tasks = tasks(study, context.seed)?;
    let mut found: Vec<SetupFigures> = vec![SetupFigures::new(); study.setups.len()];
    let mut known: BTreeMap<Key, TraceFigures> = BTreeMap::new();
    for task in &tasks {
        if let Some(judged) = read(cache, &task.judged, context) {
            known.insert(task.judged.clone(), judged);
        }
    }
    // Tasks were made in the order of set-ups; sorted, equal traces and tables are adjacent.
    tasks.sort_by(|a, b| (a.setup, &a.place).cmp(&(b.setup, &b.place)));
    let mut held: Option<(Vec<Key>, DesignTables)> = None;
    for first in 0..tasks.len() {
        let task = &tasks[first];
        if known.contains_key(&task.judged) {
            continue;
        }
        let (setup, _) = &study.setups[task.setup];
        let label = || format!("set-up {:?}, {}", setup.name, task.place.design);
        let observation = observe_task(task, &mut held, cache, context).with_context(label)?;
        let alike = tasks[first..].iter().filter(|t| t.seen == task.seen);
        let wanted = alike.filter(|t| !known.contains_key(&t.judged));
        let mut judged: BTreeMap<Key, (&TraceTask, TraceFigures)> = BTreeMap::new();
        for other in wanted {
            let of = TraceFigures {
                figures: figures(other, &observation),
                short_runs: short_runs(other, &observation, &study.short_runs),
            };
            judged.insert(other.judged.clone(), (other, of));
        }
        for further in 1..task.traces {
            let seed = mix(context.seed.wrapping_add(further));
            let observation = observe_task(task, &mut held, cache, RunContext { seed, ..context });
            let observation = observation.with_context(label)?;
            for (other, judged) in judged.values_mut() {
                let runs = short_runs(other, &observation, &study.short_runs);
                for (all, more) in judged.short_runs.iter_mut().zip(runs) {
                    all.values.extend(more.values);
                }
            }
        }
        for (key, (_, judged)) in judged {
            write(cache, &key, &judged)?;
            known.insert(key, judged);
        }
        let (done, all) = (known.len(), tasks.len());
        context.console.say(&format!(
            "{}: {}, {done} of at most {all} traces",
            setup.name, task.place.design
        ));
    }
    for task in tasks {
        found[task.setup].insert(task.place, known[&task.judged].clone());
    }
    Ok(found)
}

fn tasks(study: &Study, seed: u64) -> Result<Vec<TraceTask<'_>>> {
    let mut tasks = Vec::new();
    for (number, (_, designs)) in study.setups.iter().enumerate() {
        for design in designs {
            for &model in &study.models {
                let what = TraceKind::Model(model);
                tasks.push(task(study, number, design, what, seed)?);
            }
            let mut rest = study.probes.as_slice();
            while let Some(first) = rest.first() {
                let same = rest
                    .iter()
                    .take_while(|p| (&p.design, p.element) == (&first.design, first.element))
                    .count();
                let (probes, after) = rest.split_at(same);
                if first.design == design.name {
                    let what = TraceKind::Probe(probes);
                    tasks.push(task(study, number, design, what, seed)?);
                }
                rest = after;
            }
        }
    }
    Ok(tasks)
}

fn task<'a>(
    study: &'a Study,
    setup: usize,
    design: &'a Design,
    what: TraceKind<'a>,
    seed: u64,
) -> Result<TraceTask<'a>> {
    // Short runs are cut from traces of models alone.
    let (model, short_runs, traces) = match what {
        TraceKind::Model(model) => {
            let runs = study.short_runs.as_slice();
            (model.key(design), runs, study.short_run_traces)
        }
        TraceKind::Probe(probes) => (probes[0].place(), &[][..], 1),
    };
    let mut all = serde_json::to_value(design)?;
    for name in ["name", "description", "provenance"] {
        remove(&mut all, name);
    }
    let (kind, probes) = match what {
        TraceKind::Model(kind) => (kind, None),
        TraceKind::Probe(probes) => (Model::Geometric, Some(json!(probes))),
    };
    let tables = match kind {
        Model::Hybrid => json!(keys(design).iter().map(Key::hex).collect::<Vec<_>>()),
        // Rays depend on index and absorption, which the design lists, not on the wavelength
        // itself; thin films do depend on it.
        Model::Geometric | Model::Fine | Model::Control => {
            if design.films.is_none() && !design.solids.iter().any(CheckedSolid::is_coated) {
                remove(&mut all, "wavelength_nm");
            }
            json!(null)
        }
    };
    match kind {
        Model::Geometric => remove(&mut all, "hybrid"),
        Model::Fine => {
            let width = all["hybrid"]["element_width_um"].clone();
            all["hybrid"] = json!({ "element_width_um": width });
        }
        Model::Control | Model::Hybrid => {}
    }
    // The design lists indices at its own wavelength; at others they follow from the files it names.
    if design.all_lights().is_some() {
        let named = design.provenance.named.iter().map(|file| &file.sha256);
        all["named_files"] = json!(named.collect::<Vec<_>>());
    }
    let mut ingredients = json!({
        "trace_version": TRACE_VERSION,
        "version": env!("CARGO_PKG_VERSION"),
        "design": all,
        "model": model,
        "probes": probes,
        "short_runs": short_runs,
        "tables": tables,
        "seed": seed,
    });
    if traces > 1 {
        ingredients["short_run_traces"] = traces.into();
    }
    let judged = Key::of(&ingredients);
    for (table, names) in READING_KEYS {
        for name in names {
            remove(&mut all[table], name);
        }
    }
    let element = match what {
        TraceKind::Model(_) => None,
        TraceKind::Probe(probes) => probes.first().map(|p| p.element),
    };
    // The bins that are read affect the extent of the map.
    let plane = plane_grid(design);
    let seen = Key::of(&json!({
        "design": all,
        "plane": [plane.columns, plane.rows],
        "model": kind.key(design),
        "element": element,
        "tables": tables,
        "seed": seed,
    }));
    let place = TraceId {
        design: design.name.clone(),
        model,
    };
    Ok(TraceTask {
        setup,
        place,
        design,
        what,
        seen,
        judged,
        traces,
    })
}

fn remove(value: &mut Value, name: &str) {
    if let Some(map) = value.as_object_mut() {
        map.remove(name);
    }
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
        let job = SpectralJob {
            design,
            lights: &lights,
            model,
            cache: Some(cache),
            context,
        };
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
            let dome = design
                .sphere()
                .with_context(|| format!("{} has no dome", design.name))?;
            DomeSurface::Only(
                Meridian::stepped(dome, &design.elements)?,
                probes[0].element,
            )
        }
    };
    let what = format!("{} {}", design.name, task.place.model);
    observe(design, &surface, design.trace.paths, &what, context)
}

/// Figures of an observation, with their jackknife replicates.
fn figures(task: &TraceTask, seen: &Observation) -> NamedFigures {
    match task.what {
        TraceKind::Model(_) => {
            let without = seen.without(task.design);
            let figures = seen.figures(task.design).into_iter();
            let figure = |f: crate::results::Figure| {
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
                        .map(|[from, to]| seen.sphere.share(powers, *from, *to))
                        .sum()
                };
                let far = &seen.far_field;
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
fn short_runs(task: &TraceTask, seen: &Observation, paths: &[u64]) -> Vec<ShortRuns> {
    let asked = match task.what {
        TraceKind::Model(_) => paths,
        TraceKind::Probe(_) => &[],
    };
    let of = |&paths: &u64| {
        let figures = seen.short_runs(task.design, paths).into_iter();
        figures.map(move |(figure, values)| ShortRuns {
            figure: figure.to_owned(),
            paths: seen.paths_of_run(paths),
            values,
        })
    };
    asked.iter().flat_map(of).collect()
}

/// A stored trace, as it is written.
#[derive(Deserialize)]
struct StoredTrace {
    /// SHA-256 of `judged` as it is printed.
    sha256: String,
    judged: TraceFigures,
}

fn path(cache: &Cache, key: &Key) -> PathBuf {
    cache
        .directory()
        .join("traces")
        .join(format!("{}.json", key.hex()))
}

fn read(cache: &Cache, key: &Key, context: RunContext) -> Option<TraceFigures> {
    let path = path(cache, key);
    let text = std::fs::read(&path).ok()?;
    let read = serde_json::from_slice::<StoredTrace>(&text).map_err(anyhow::Error::from);
    let whole = read.and_then(|kept| {
        let content = serde_json::to_string(&kept.judged)?;
        ensure!(
            sha256_hex(content.as_bytes()) == kept.sha256,
            "it was altered"
        );
        Ok(kept.judged)
    });
    match whole {
        Ok(judged) => Some(judged),
        Err(error) => {
            context.console.warn(&format!(
                "`{}` is no usable trace ({error}); tracing it anew",
                path.display()
            ));
            None
        }
    }
}

fn write(cache: &Cache, key: &Key, judged: &TraceFigures) -> Result<()> {
    let content = serde_json::to_string(judged)?;
    let sha256 = sha256_hex(content.as_bytes());
    let text = format!("{{\"sha256\":\"{sha256}\",\"judged\":{content}}}\n");
    atomic_file::write_bytes(&path(cache, key), text.as_bytes())
}
