// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces the samples of a tolerance analysis, each with a seed of its own, and the design without
//! deviations.
//!
//! Samples that break symmetries of the design are read without averaging over them. The extremes of
//! their noisier maps are biased, so that the design is read like them too: what that adds to its
//! figures is taken off those of the samples.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use serde_json::json;
use tracer::CheckpointStore;

use super::definition::ToleranceAnalysis;
use super::deviations::Deviation;
use super::drawn_samples::{DrawnSamples, Traced};
use crate::atomic_file::is_of_files;
use crate::cache::Cache;
use crate::checkpoint::{Checkpoints, Groups};
use crate::config::design::Design;
use crate::config::dotted_keys::Settings;
use crate::config::schema::Average;
use crate::interrupt::Interrupted;
use crate::metrics::Estimate;
use crate::run_context::RunContext;
use crate::stages::job::{TableCost, Task};
use crate::stages::model::Model;
use crate::stages::model_traces::ModelTraces;
use crate::stages::seeds::mix;
use crate::stages::tables::Ring;

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
    /// What reading without symmetries adds to them; it is taken off the figures of the samples.
    /// Empty where samples have the symmetries of the design.
    pub reading: Figures,
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
    let drawn = DrawnSamples::new(analysis, context.seed)?;
    let mut tracer = SampleTracer::new(analysis, &drawn, cache, context);
    let traces = drawn.traces();
    let progress = context.console.progress(traces, &analysis.name);
    let mut nominal: Vec<Figures> = Vec::new();
    let mut unaveraged: Vec<Figures> = Vec::new();
    let mut samples = Vec::new();
    for number in 0..traces {
        context.interrupt.check()?;
        let figures = if context.is_merging() {
            let found = tracer.kept(number);
            found.with_context(|| format!("{}: trace {number} is missing", analysis.name))?
        } else {
            tracer.trace(number)?
        };
        match drawn.traced(number) {
            Traced::Nominal => nominal.push(figures.map_err(anyhow::Error::msg)?),
            Traced::Unaveraged => unaveraged.push(figures.map_err(anyhow::Error::msg)?),
            Traced::Sample(sample) => samples.push(SampledPackage {
                deviations: drawn.samples[sample].deviations.clone(),
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
    let nominal = mean(&nominal);
    let reading = differences(&mean(&unaveraged), &nominal);
    for figures in samples.iter_mut().filter_map(|s| s.figures.as_mut().ok()) {
        for (key, added) in &reading {
            if let Some(figure) = figures.get_mut(key) {
                figure.value -= added.value;
            }
        }
    }
    Ok(Sampled {
        nominal,
        reading,
        samples,
    })
}

/// Figures of `to` less those of `from`, which are independent.
fn differences(to: &Figures, from: &Figures) -> Figures {
    let of = |(key, to): (&String, &Estimate)| {
        let from = from.get(key)?;
        let error = to.standard_error.hypot(from.standard_error);
        Some((key.clone(), Estimate::new(to.value - from.value, error)))
    };
    to.iter().filter_map(of).collect()
}

/// Traces of an analysis by number: those without deviations first, then the samples.
struct SampleTracer<'a> {
    analysis: &'a ToleranceAnalysis,
    drawn: &'a DrawnSamples,
    traces: ModelTraces<'a>,
    context: RunContext<'a>,
}

/// Figures as they are kept: names with the bits of value and standard error, or why there are none.
type KeptFigures = Result<Vec<(String, u64, u64)>, String>;

impl<'a> SampleTracer<'a> {
    fn new(
        analysis: &'a ToleranceAnalysis,
        drawn: &'a DrawnSamples,
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
        let traced = self.drawn.traced(number);
        let nominal = Settings::new();
        let (settings, seed) = match traced {
            Traced::Sample(sample) => (&self.drawn.samples[sample].settings, mix(sample as u64)),
            Traced::Nominal | Traced::Unaveraged => (&nominal, mix(u64::MAX - number)),
        };
        let averaged = traced == Traced::Nominal || !self.drawn.breaks_symmetry;
        let is_sample = matches!(traced, Traced::Sample(_));
        let context = RunContext {
            seed: mix(self.context.seed ^ seed),
            // A sample is kept as its figures, not in groups of paths.
            checkpoints: None,
            ..self.context.silent()
        };
        match figures(
            self.analysis,
            (settings, averaged),
            &mut self.traces,
            context,
        ) {
            // A failure of files may pass: it says nothing of the sample.
            Err(error) if !is_sample || error.is::<Interrupted>() || is_of_files(&error) => {
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
    let nominal = rings(&analysis, &analysis.design);
    // Every sample has about as many rings of its own as the first one that makes a design.
    let drawn = DrawnSamples::new(&analysis, seed)?;
    let of_design = 0..drawn.nominal();
    let of_samples = drawn.nominal()..drawn.traces();
    let mut designs = drawn
        .samples
        .iter()
        .map(|of| analysis.source.with(&of.settings));
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
        traces(of_design, !nominal.is_empty(), TableCost::default()),
        traces(of_samples, !shared.is_empty(), own),
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
        let drawn = DrawnSamples::new(&self.analysis, seed)?;
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

/// The figures of the design with these settings, with or without averaging over symmetries.
fn figures(
    analysis: &ToleranceAnalysis,
    (settings, averaged): (&Settings, bool),
    traces: &mut ModelTraces,
    context: RunContext,
) -> Result<Figures> {
    let mut design = analysis.source.with(settings)?;
    design.trace.paths = analysis.paths;
    if !averaged {
        design.receiver.average = Average::None;
    }
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
