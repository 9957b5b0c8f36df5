// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces the samples of a tolerance analysis, each with a seed of its own, and the design without
//! deviations.
//!
//! Samples that break symmetries of the design are read without averaging over them. The extremes
//! of their noisier maps are biased, so that the design is read like them too: what that adds to
//! its figures is taken off those of the samples.

use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};

use files::cache::Cache;
use files::run_context::RunContext;
use metrics::Estimate;
use metrics::far_field::PeakPlace;
use results::figure_entry::FigureEntry;

use super::definition::ToleranceAnalysis;
use super::deviations::Offset;
use super::drawn_samples::{DrawnSamples, Traced};
use super::sample_tracer::{Figures, SampleTracer};

/// One package of many.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledPackage {
    /// Offsets that are added to numbers of the design.
    pub offsets: Vec<Offset>,
    /// Figures, or the reason why it makes no design.
    pub figures: Result<Figures, String>,
}

/// Figures of the traces.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampled {
    /// Figures of the design without deviations.
    pub nominal: Figures,
    /// Bias of reading without symmetries; it is taken off the figures of the samples.
    /// Empty where samples have the symmetries of the design.
    pub reading_bias: BTreeMap<String, Estimate>,
    /// Figures of all samples.
    pub samples: Vec<SampledPackage>,
}

/// Traces all samples of `analysis`; tables of orders are kept in `cache`, figures of finished
/// traces in the checkpoints of `context`, from which a repetition takes them.
///
/// # Errors
/// Those of the solver and the tracer for the design without deviations; figures that the design
/// does not have; more samples without a design than with one; an interrupt.
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
        let figures = match tracer.kept(number) {
            Some(kept) => kept,
            None if context.is_merging() => {
                bail!("{}: trace {number} is missing", analysis.name)
            }
            None => tracer.trace_and_keep(number)?,
        };
        if number == 0 {
            tracer.check_figures(&figures)?;
        }
        match drawn.traced(number) {
            Traced::Nominal => nominal.push(figures.map_err(anyhow::Error::msg)?),
            Traced::Unaveraged => unaveraged.push(figures.map_err(anyhow::Error::msg)?),
            Traced::Sample(sample) => samples
                .push(SampledPackage { offsets: drawn.samples[sample].offsets.clone(), figures }),
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    let failed: Vec<&String> = samples.iter().filter_map(|s| s.figures.as_ref().err()).collect();
    ensure!(
        2 * failed.len() < samples.len(),
        "{}: tolerances: expected deviations with which more than half of the packages can be \
         built, got {} of {} without a design: {}",
        analysis.inputs[0].file,
        failed.len(),
        samples.len(),
        failed.first().map_or("", |why| why)
    );
    let nominal = mean(&nominal);
    let reading_bias = differences(&mean(&unaveraged), &nominal);
    for figures in samples.iter_mut().filter_map(|s| s.figures.as_mut().ok()) {
        for (key, added) in &reading_bias {
            if let Some(figure) = figures.get_mut(key) {
                figure.value -= added.value;
                figure.interval = figure.interval.map(|ends| ends.map(|end| end - added.value));
            }
        }
    }
    Ok(Sampled { nominal, reading_bias, samples })
}

/// Figures of `to` less those of `from`, which are independent.
fn differences(to: &Figures, from: &Figures) -> BTreeMap<String, Estimate> {
    let of = |(key, to): (&String, &FigureEntry)| {
        let from = from.get(key)?;
        let error = to.standard_error.hypot(from.standard_error);
        Some((key.clone(), Estimate::new(to.value - from.value, error)))
    };
    to.iter().filter_map(of).collect()
}

/// Means of figures that all of `traces` have, with their errors and states.
fn mean(traces: &[Figures]) -> Figures {
    let of = |key: &String| -> Option<(String, FigureEntry)> {
        let all: Option<Vec<&FigureEntry>> =
            traces.iter().map(|figures| figures.get(key)).collect();
        Some((key.clone(), mean_of(&all?)))
    };
    traces.first().into_iter().flat_map(BTreeMap::keys).filter_map(of).collect()
}

/// Mean of one figure. Sums that no path of any trace reached err by one path of all of them; ends
/// of figures that are not resolved are averaged.
fn mean_of(all: &[&FigureEntry]) -> FigureEntry {
    let count = all.len() as f64;
    let mean = |of: &dyn Fn(&FigureEntry) -> f64| all.iter().map(|e| of(e)).sum::<f64>() / count;
    let is_unseen = all.iter().all(|e| e.upper_bound.is_some());
    let squares: f64 = all.iter().map(|e| e.standard_error.powi(2)).sum();
    let error = if is_unseen { mean(&|e| e.standard_error) } else { squares.sqrt() };
    let ends = |k: usize| mean(&|e| e.interval.map_or(e.value, |ends| ends[k]));
    let places = [PeakPlace::NotResolved, PeakPlace::OnAxis].into_iter();
    let mut places = places.filter(|place| all.iter().any(|e| e.peak_place == *place));
    FigureEntry {
        interval: all.iter().any(|e| e.interval.is_some()).then(|| [ends(0), ends(1)]),
        bias_bound: all
            .iter()
            .find_map(|e| e.bias_bound)
            .map(|_| mean(&|e| e.bias_bound.unwrap_or(0.0))),
        peak_place: places.next().unwrap_or_default(),
        ..FigureEntry::new(Estimate::new(mean(&|e| e.value), error / count))
    }
}
