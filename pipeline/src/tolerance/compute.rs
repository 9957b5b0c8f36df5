// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces the samples of a tolerance analysis, each with a seed of its own, and the design without
//! deviations.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use serde_json::json;
use tracer::CheckpointStore;

use super::definition::ToleranceAnalysis;
use super::deviations::{Deviation, Deviations};
use crate::atomic_file::is_of_files;
use crate::cache::Cache;
use crate::checkpoint::{Checkpoints, Groups};
use crate::config::design::Design;
use crate::config::dotted_keys::Settings;
use crate::interrupt::Interrupted;
use crate::metrics::Estimate;
use crate::run_context::RunContext;
use crate::stages::job::{TableCost, Task};
use crate::stages::model::Model;
use crate::stages::model_traces::ModelTraces;
use crate::stages::seeds::mix;
use crate::stages::tables::Ring;

/// Traces of the design without deviations, each with a seed of its own: its error hardly counts
/// beside that of the samples.
const NOMINAL_TRACES: u64 = 16;
/// Figures by key.
pub type Figures = BTreeMap<String, Estimate>;

/// One package of many.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledPackage {
    /// Its deviations.
    pub deviations: Vec<Deviation>,
    /// Its figures, or why it makes no design.
    pub figures: Result<Figures, String>,
}

/// What the traces show.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// Figures of the design without deviations.
    pub nominal: Figures,
    /// Figures of all samples.
    pub samples: Vec<SampledPackage>,
}

/// Traces all samples of `analysis`; tables of orders are kept in `cache`.
///
/// # Errors
/// Those of the solver and the tracer for the design without deviations; more samples without a
/// design than with one; an interrupt.
pub fn compute(
    analysis: &ToleranceAnalysis,
    cache: &Cache,
    context: RunContext,
) -> Result<Sampled> {
    let drawn = draw(analysis, context.seed)?;
    let mut tracer = SampleTracer::new(analysis, &drawn, cache, context);
    let traces = NOMINAL_TRACES + drawn.len() as u64;
    let progress = context.console.progress(traces, &analysis.name);
    let mut nominal: Vec<Figures> = Vec::new();
    let mut samples = Vec::new();
    for number in 0..traces {
        context.interrupt.check()?;
        let figures = if context.is_merging() {
            let found = tracer.kept(number);
            found.with_context(|| format!("{}: trace {number} is missing", analysis.name))?
        } else {
            tracer.trace(number)?
        };
        match number.checked_sub(NOMINAL_TRACES) {
            None => nominal.push(figures.map_err(anyhow::Error::msg)?),
            Some(sample) => samples.push(SampledPackage {
                deviations: drawn[sample as usize].deviations.clone(),
                figures,
            }),
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    let failed: Vec<&String> = samples
        .iter()
        .filter_map(|s| s.figures.as_ref().err())
        .collect();
    ensure!(
        2 * failed.len() < samples.len(),
        "{}: tolerances: expected deviations that most packages survive, got {} of {} without a \
         design: {}",
        analysis.inputs[0].file,
        failed.len(),
        samples.len(),
        failed.first().map_or("", |why| why)
    );
    Ok(Sampled {
        nominal: mean(&nominal),
        samples,
    })
}

/// Deviations of a sample, and the keys that they set.
struct Drawn {
    deviations: Vec<Deviation>,
    settings: Settings,
}

/// The deviations of all samples, in order.
fn draw(analysis: &ToleranceAnalysis, seed: u64) -> Result<Vec<Drawn>> {
    let mut random = Deviations::random(seed);
    let draw = |_| {
        let of = &analysis.deviations;
        let deviations = of.draw(&analysis.source, &mut random)?;
        let settings = of.settings(&analysis.source, &deviations)?;
        Ok(Drawn {
            deviations,
            settings,
        })
    };
    (0..analysis.samples).map(draw).collect()
}

/// Traces of an analysis by number: those without deviations first, then the samples.
struct SampleTracer<'a> {
    analysis: &'a ToleranceAnalysis,
    drawn: &'a [Drawn],
    traces: ModelTraces<'a>,
    context: RunContext<'a>,
}

/// Figures as they are kept: names with the bits of value and standard error, or why there are none.
type KeptFigures = Result<Vec<(String, u64, u64)>, String>;

impl<'a> SampleTracer<'a> {
    fn new(
        analysis: &'a ToleranceAnalysis,
        drawn: &'a [Drawn],
        cache: &'a Cache,
        context: RunContext<'a>,
    ) -> Self {
        Self {
            analysis,
            drawn,
            traces: ModelTraces::new(analysis.model, cache),
            context,
        }
    }

    /// Figures of a trace; for a sample, why it makes no design.
    fn trace(&mut self, number: u64) -> Result<Result<Figures, String>> {
        let (sample, seed) = match number.checked_sub(NOMINAL_TRACES) {
            None => (None, mix(u64::MAX - number)),
            Some(sample) => (Some(sample as usize), mix(sample)),
        };
        let nominal = Settings::new();
        let settings = sample.map_or(&nominal, |sample| &self.drawn[sample].settings);
        let context = RunContext {
            seed: mix(self.context.seed ^ seed),
            // A sample is kept as its figures, not in groups of paths.
            checkpoints: None,
            ..self.context.silent()
        };
        match figures(self.analysis, settings, &mut self.traces, context) {
            // A failure of files may pass: it says nothing of the sample.
            Err(error) if sample.is_none() || error.is::<Interrupted>() || is_of_files(&error) => {
                Err(error)
            }
            other => Ok(other.map_err(|error| format!("{error:#}"))),
        }
    }

    fn groups(&self) -> Option<Groups<'a>> {
        groups(self.analysis, self.context)
    }

    /// What a shard kept of a trace.
    fn kept(&self, number: u64) -> Option<Result<Figures, String>> {
        let bytes = self.groups()?.find(number)?;
        let kept: KeptFigures = serde_json::from_slice(&bytes).ok()?;
        let figure = |(key, value, error): (String, u64, u64)| {
            let estimate = Estimate::new(f64::from_bits(value), f64::from_bits(error));
            (key, estimate)
        };
        Some(kept.map(|figures| figures.into_iter().map(figure).collect()))
    }

    fn keep(&self, number: u64, figures: Result<Figures, String>) -> Result<()> {
        let bits = |(key, estimate): (String, Estimate)| {
            let (value, error) = (estimate.value, estimate.standard_error);
            (key, value.to_bits(), error.to_bits())
        };
        let kept: KeptFigures = figures.map(|figures| figures.into_iter().map(bits).collect());
        if let Some(groups) = self.groups() {
            groups.keep(number, &serde_json::to_vec(&kept)?);
        }
        self.context
            .checkpoints
            .map_or(Ok(()), Checkpoints::is_whole)
    }
}

/// Where shards keep the figures of traces.
fn groups<'a>(analysis: &ToleranceAnalysis, context: RunContext<'a>) -> Option<Groups<'a>> {
    let of = json!({"samples of": analysis.name, "seed": context.seed});
    context.checkpoints.map(|checkpoints| checkpoints.of(&of))
}

/// The traces of `analysis` with this seed, for several processes to share: those without deviations
/// and the samples.
///
/// # Errors
/// Deviations that set what the design does not have.
pub fn shared_traces(analysis: ToleranceAnalysis, seed: u64) -> Result<Vec<SharedTraces>> {
    let samples = NOMINAL_TRACES..NOMINAL_TRACES + analysis.samples as u64;
    let nominal = rings(&analysis, &analysis.design);
    // Every sample has about as many rings of its own as the first one that makes a design.
    let drawn = draw(&analysis, seed)?;
    let mut designs = drawn.iter().map(|of| analysis.source.with(&of.settings));
    let first = designs.find_map(Result::ok);
    let of_sample = first.map_or_else(Vec::new, |design| rings(&analysis, &design));
    let is_shared = |ring: &Ring| nominal.iter().any(|other| other.key == ring.key);
    let (shared, own): (Vec<&Ring>, Vec<&Ring>) = of_sample.iter().partition(|r| is_shared(r));
    let own = TableCost::of(own);
    let analysis = Arc::new(analysis);
    let traces = |numbers, needs_tables, own_tables| SharedTraces {
        analysis: Arc::clone(&analysis),
        seed,
        numbers,
        needs_tables,
        own_tables,
    };
    Ok(vec![
        traces(0..NOMINAL_TRACES, !nominal.is_empty(), TableCost::default()),
        traces(samples, !shared.is_empty(), own),
    ])
}

/// Rings whose tables a trace of `design` needs, each once.
fn rings(analysis: &ToleranceAnalysis, design: &Design) -> Vec<Ring> {
    // With several wavelengths, each has tables of its own.
    if analysis.model != Model::Hybrid || design.all_lights().is_some() {
        return Vec::new();
    }
    let all = Ring::of_design(design, None).into_iter();
    let distinct: BTreeMap<_, _> = all.map(|ring| (ring.key.clone(), ring)).collect();
    distinct.into_values().collect()
}

/// Some traces of an analysis, each a piece.
pub struct SharedTraces {
    analysis: Arc<ToleranceAnalysis>,
    /// Seed of all random numbers.
    seed: u64,
    /// Numbers of the traces.
    numbers: Range<u64>,
    /// Whether they need tables of the design without deviations.
    needs_tables: bool,
    /// Tables that each of them needs beside these.
    own_tables: TableCost,
}

impl Task for SharedTraces {
    fn label(&self) -> &str {
        &self.analysis.name
    }

    fn pieces(&self) -> u64 {
        self.numbers.end - self.numbers.start
    }

    fn paths(&self) -> u64 {
        self.analysis.paths
    }

    fn tables_of(&self) -> Option<&Design> {
        self.needs_tables.then_some(&self.analysis.design)
    }

    fn own_tables(&self) -> TableCost {
        self.own_tables
    }

    fn missing(&self, _: &Cache, context: RunContext) -> Result<Vec<u64>> {
        let seed = self.seed;
        let groups = groups(&self.analysis, RunContext { seed, ..context });
        let missing = groups.map_or_else(Vec::new, |groups| groups.missing(self.numbers.clone()));
        let numbers = missing.into_iter();
        Ok(numbers.map(|number| number - self.numbers.start).collect())
    }

    fn compute(&self, pieces: Range<u64>, cache: &Cache, context: RunContext) -> Result<()> {
        let seed = self.seed;
        let context = RunContext { seed, ..context };
        let drawn = draw(&self.analysis, seed)?;
        let mut tracer = SampleTracer::new(&self.analysis, &drawn, cache, context);
        for number in pieces.map(|piece| self.numbers.start + piece) {
            context.interrupt.check()?;
            if tracer.kept(number).is_none() {
                let figures = tracer.trace(number)?;
                tracer.keep(number, figures)?;
            }
        }
        Ok(())
    }
}

/// The figures of the design with `settings`.
fn figures(
    analysis: &ToleranceAnalysis,
    settings: &Settings,
    traces: &mut ModelTraces,
    context: RunContext,
) -> Result<Figures> {
    let mut design = analysis.source.with(settings)?;
    design.trace.paths = analysis.paths;
    let seen = traces.observe(&design, context)?;
    let wanted = |key: &str| analysis.figures.iter().any(|figure| figure == key);
    let figures = seen.replicated(&design, wanted).into_iter();
    let figures: Figures = figures
        .map(|(key, figure)| (key.to_owned(), figure.estimate()))
        .collect();
    ensure!(!figures.is_empty(), "no figure could be read");
    Ok(figures)
}

/// Means of figures that all of `traces` have, with their errors.
fn mean(traces: &[Figures]) -> Figures {
    let count = traces.len() as f64;
    let of = |key: &String| -> Option<(String, Estimate)> {
        let all: Option<Vec<&Estimate>> = traces.iter().map(|figures| figures.get(key)).collect();
        let all = all?;
        let value = all.iter().map(|e| e.value).sum::<f64>() / count;
        let squares: f64 = all.iter().map(|e| e.standard_error.powi(2)).sum();
        Some((key.clone(), Estimate::new(value, squares.sqrt() / count)))
    };
    traces
        .first()
        .into_iter()
        .flat_map(BTreeMap::keys)
        .filter_map(of)
        .collect()
}
