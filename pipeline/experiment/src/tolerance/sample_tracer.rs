// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces single samples of a tolerance analysis by number, and keeps their figures for other
//! processes.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use serde_json::json;
use tracer::CheckpointStore;

use design::dotted_keys::Settings;
use design::schema::Average;
use files::atomic_file::is_of_files;
use files::cache::Cache;
use files::checkpoint::{Checkpoints, Groups};
use files::interrupt::Interrupted;
use files::run_context::RunContext;
use metrics::Estimate;
use simulate::model_traces::ModelTraces;
use simulate::seeds::mix;

use super::definition::ToleranceAnalysis;
use super::drawn_samples::{DrawnSamples, Traced};

/// Figures by key.
pub type Figures = BTreeMap<String, Estimate>;

/// Traces of an analysis by number: those without deviations first, then the samples.
pub(super) struct SampleTracer<'a> {
    analysis: &'a ToleranceAnalysis,
    drawn: &'a DrawnSamples,
    traces: ModelTraces<'a>,
    context: RunContext<'a>,
}

/// Figures as they are kept: names with the bits of value and standard error, or why there are
/// none.
type KeptFigures = Result<Vec<(String, u64, u64)>, String>;

impl<'a> SampleTracer<'a> {
    pub fn new(
        analysis: &'a ToleranceAnalysis,
        drawn: &'a DrawnSamples,
        cache: &'a Cache,
        context: RunContext<'a>,
    ) -> Self {
        Self { analysis, drawn, traces: ModelTraces::new(analysis.model, cache), context }
    }

    /// Figures of a trace; for a sample, why it makes no design.
    pub fn trace(&mut self, number: u64) -> Result<Result<Figures, String>> {
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
        match figures(self.analysis, (settings, averaged), &mut self.traces, context) {
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
    pub fn kept(&self, number: u64) -> Option<Result<Figures, String>> {
        let bytes = self.groups()?.find(number)?;
        let kept: KeptFigures = serde_json::from_slice(&bytes).ok()?;
        let figure = |(key, value, error): (String, u64, u64)| {
            let estimate = Estimate::new(f64::from_bits(value), f64::from_bits(error));
            (key, estimate)
        };
        Some(kept.map(|figures| figures.into_iter().map(figure).collect()))
    }

    pub fn keep(&self, number: u64, figures: Result<Figures, String>) -> Result<()> {
        let bits = |(key, estimate): (String, Estimate)| {
            let (value, error) = (estimate.value, estimate.standard_error);
            (key, value.to_bits(), error.to_bits())
        };
        let kept: KeptFigures = figures.map(|figures| figures.into_iter().map(bits).collect());
        if let Some(groups) = self.groups() {
            groups.keep(number, &serde_json::to_vec(&kept)?);
        }
        self.context.checkpoints.map_or(Ok(()), Checkpoints::is_whole)
    }
}

/// Where shards keep the figures of traces.
pub(super) fn groups<'a>(
    analysis: &ToleranceAnalysis,
    context: RunContext<'a>,
) -> Option<Groups<'a>> {
    let of = json!({"samples of": analysis.name, "seed": context.seed});
    context.checkpoints.map(|checkpoints| checkpoints.of(&of))
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
    let figures: Figures =
        figures.map(|(key, figure)| (key.to_owned(), figure.estimate())).collect();
    ensure!(!figures.is_empty(), "no figure could be read");
    Ok(figures)
}
