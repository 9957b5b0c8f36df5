// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces single samples of a tolerance analysis by number, and keeps their figures for other
//! processes.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

use arrays::cache::Cache;
use design::dotted_keys::Settings;
use design::schema::Average;
use metrics::digits::thousands;
use results::figure_entry::FigureEntry;
use runtime::atomic_file::is_of_files;
use runtime::interrupt::Interrupted;
use runtime::run_context::RunContext;
use runtime::store::Entries;
use simulate::model_traces::ModelTraces;
use simulate::seeds::mix;
use simulate::trace_plan::DomeChoice;

use super::definition::ToleranceAnalysis;
use super::drawn_samples::{DrawnSamples, Traced};
use crate::missing_figure::{missing_figure, shown};

/// Figures by key.
pub type Figures = BTreeMap<String, FigureEntry>;

/// Traces of an analysis by number: those without deviations first, then the samples.
pub(super) struct SampleTracer<'a> {
    analysis: &'a ToleranceAnalysis,
    drawn: &'a DrawnSamples,
    traces: ModelTraces<'a>,
    context: RunContext<'a>,
}

impl<'a> SampleTracer<'a> {
    pub fn new(
        analysis: &'a ToleranceAnalysis,
        drawn: &'a DrawnSamples,
        cache: &'a Cache,
        context: RunContext<'a>,
    ) -> Self {
        Self { analysis, drawn, traces: ModelTraces::of_search(cache), context }
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
        let label = match traced {
            Traced::Sample(sample) => format!("{}, sample {}", self.analysis.name, sample + 1),
            _ => format!("{}, without deviations", self.analysis.name),
        };
        let of = (settings, averaged, label);
        let found = figures(self.analysis, of, &mut self.traces, context);
        let found = found.and_then(|found| {
            ensure!(!is_sample || !found.is_empty(), "no figure could be read");
            Ok(found)
        });
        match found {
            // A failure of files may pass: it says nothing of the sample.
            Err(error) if !is_sample || error.is::<Interrupted>() || is_of_files(&error) => {
                Err(error)
            }
            other => Ok(other.map_err(|error| format!("{error:#}"))),
        }
    }

    /// Figures of a trace that a shard kept.
    pub fn kept(&self, number: u64) -> Option<Result<Figures, String>> {
        entries(self.analysis, self.context)?.find_value(number)
    }

    /// Traces `number` and keeps its figures.
    ///
    /// # Errors
    /// Those of [`SampleTracer::trace`]; figures that cannot be kept.
    pub fn trace_and_keep(&mut self, number: u64) -> Result<Result<Figures, String>> {
        let figures = self.trace(number)?;
        let entries = entries(self.analysis, self.context);
        entries.map_or(Ok(()), |entries| entries.keep_value(number, &figures))?;
        Ok(figures)
    }

    /// Refuses an analysis that asks for other figures than `found`, those of the design.
    ///
    /// # Errors
    /// The figures that the design has.
    pub fn check_figures(&mut self, found: &Result<Figures, String>) -> Result<()> {
        let (analysis, Ok(found)) = (self.analysis, found) else {
            return Ok(());
        };
        let Some((key, figure)) =
            analysis.required.iter().find(|(_, figure)| !found.contains_key(figure))
        else {
            ensure!(
                !found.is_empty(),
                "{}: expected light to read figures from, got none in {} paths",
                analysis.inputs[0].file,
                thousands(analysis.paths)
            );
            return Ok(());
        };
        let mut design = analysis.design.clone();
        design.trace.paths = analysis.paths;
        let context = RunContext { checkpoints: None, ..self.context.silent() };
        let model = DomeChoice::Model(analysis.model);
        let seen = self.traces.observe(&design, model, "", context)?;
        Err(missing_figure(key, figure, &shown(&design, &seen), &design))
            .with_context(|| analysis.inputs[0].file.clone())
    }
}

/// The figures of traces that shards keep.
pub(super) fn entries<'a>(
    analysis: &ToleranceAnalysis,
    context: RunContext<'a>,
) -> Option<Entries<'a>> {
    context.checkpoints.map(|store| store.entries(analysis.key(context.seed)))
}

/// The figures of the design with these settings, with or without averaging over symmetries; warnings
/// name it by a label.
fn figures(
    analysis: &ToleranceAnalysis,
    (settings, averaged, label): (&Settings, bool, String),
    traces: &mut ModelTraces,
    context: RunContext,
) -> Result<Figures> {
    let mut design = analysis.source.with(settings)?;
    design.name = label;
    design.trace.paths = analysis.paths;
    if !averaged {
        design.receiver.average = Average::None;
    }
    let seen = traces.observe(&design, DomeChoice::Model(analysis.model), "", context)?;
    let wanted = |key: &str| analysis.figures.iter().any(|figure| figure == key);
    let figures = seen.estimates(&design, wanted).into_iter();
    Ok(figures.map(|figure| (figure.key.into_owned(), figure.entry)).collect())
}
