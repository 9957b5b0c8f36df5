// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces the samples of a tolerance analysis, each with a seed of its own, and the design without
//! deviations.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};

use super::definition::ToleranceAnalysis;
use super::deviations::{Deviation, Deviations};
use crate::cache::Cache;
use crate::config::dotted_keys::Settings;
use crate::interrupt::Interrupted;
use crate::metrics::Estimate;
use crate::run_context::RunContext;
use crate::stages::model_traces::ModelTraces;
use crate::stages::seeds::mix;

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
    let mut traces = ModelTraces::new(analysis.model, cache);
    let steps = analysis.samples as u64 + NOMINAL_TRACES;
    let progress = context.console.progress(steps, &analysis.name);
    let silent = context.silent();
    let mut nominal: Vec<Figures> = Vec::new();
    for k in 0..NOMINAL_TRACES {
        let seed = mix(context.seed ^ mix(u64::MAX - k));
        let context = RunContext { seed, ..silent };
        nominal.push(figures(analysis, &Settings::new(), &mut traces, context)?);
        progress.inc(1);
    }
    let mut random = Deviations::random(context.seed);
    let mut samples = Vec::new();
    for k in 0..analysis.samples {
        context.interrupt.check()?;
        let deviations = analysis.deviations.draw(&analysis.source, &mut random)?;
        let settings = analysis
            .deviations
            .settings(&analysis.source, &deviations)?;
        let context = RunContext {
            seed: mix(context.seed ^ mix(k as u64)),
            ..silent
        };
        let found = figures(analysis, &settings, &mut traces, context);
        let figures = match found {
            Ok(figures) => Ok(figures),
            Err(error) if error.is::<Interrupted>() => return Err(error),
            Err(error) => Err(format!("{error:#}")),
        };
        samples.push(SampledPackage {
            deviations,
            figures,
        });
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
