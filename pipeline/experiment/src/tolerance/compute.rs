// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces the samples of a tolerance analysis, each with a seed of its own, and the design without
//! deviations.
//!
//! Samples that break symmetries of the design are read without averaging over them. The extremes
//! of their noisier maps are biased, so that the design is read like them too: what that adds to
//! its figures is taken off those of the samples.
//!
//! The design is traced many times, so that its figures tell the noise of a trace where the stated
//! errors do not hold it.

use std::collections::BTreeMap;

use anyhow::{Result, bail, ensure};

use arrays::cache::Cache;
use metrics::Estimate;
use metrics::far_field::PeakPlace;
use results::figure_entry::FigureEntry;
use runtime::run_context::RunContext;
use simulate::observation::unit_of;

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
    /// Noise between traces of the design without deviations, read as samples are.
    pub repeated: BTreeMap<String, RepeatedNoise>,
    /// Figures of all samples.
    pub samples: Vec<SampledPackage>,
}

/// Noise of a figure between traces of one design.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepeatedNoise {
    /// Variance of the figure.
    pub variance: f64,
    /// Traces less one.
    pub freedoms: f64,
}

impl RepeatedNoise {
    /// That of `values`; none of fewer than two.
    fn new(values: &[f64]) -> Option<Self> {
        let freedoms = values.len().checked_sub(1).filter(|one| *one > 0)? as f64;
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Some(Self { variance: squares / freedoms, freedoms })
    }
}

/// A figure of all samples, with errors that hold the noise of repeated traces.
#[derive(Debug, Clone, PartialEq)]
pub struct NoisyValues {
    /// In the order of the samples that make a design.
    pub values: Vec<Estimate>,
    /// Degrees of freedom of the errors, where they come of repeated traces.
    pub freedoms: Option<f64>,
}

impl Sampled {
    /// The figure under `key` of the samples that make a design; none where one of them lacks it.
    /// Mean squared errors are at least the variance between traces of one design.
    pub fn values(&self, key: &str) -> Option<NoisyValues> {
        let figures = self.samples.iter().filter_map(|sample| sample.figures.as_ref().ok());
        let entries: Option<Vec<&FigureEntry>> = figures.map(|figures| figures.get(key)).collect();
        let entries = entries?;
        let stated = entries.iter().map(|e| noise(e).powi(2)).sum::<f64>() / entries.len() as f64;
        let repeated = self.repeated.get(key).filter(|repeated| repeated.variance > stated);
        let more = repeated.map_or(0.0, |repeated| (repeated.variance - stated).sqrt());
        let value = |e: &&FigureEntry| Estimate::new(e.value, noise(e).hypot(more));
        Some(NoisyValues {
            values: entries.iter().map(value).collect(),
            freedoms: repeated.map(|repeated| repeated.freedoms),
        })
    }
}

/// What other paths would change in a figure, by its stated error: all of it where the figure is known
/// between two ends alone, which may lie anywhere in them, as a peak in its bin.
fn noise(entry: &FigureEntry) -> f64 {
    match entry.interval {
        Some([low, high]) if entry.is_bin() => {
            entry.standard_error.max((high - low) / 12f64.sqrt())
        }
        Some(_) => entry.standard_error,
        None => entry.estimate().scatter(),
    }
}

/// The part of the noise that a mean over traces makes smaller.
pub(super) fn scatter(entry: &FigureEntry) -> f64 {
    if entry.is_bin() { noise(entry) } else { entry.estimate().scatter() }
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
    let repeated = repeated_noise(if unaveraged.is_empty() { &nominal } else { &unaveraged });
    let nominal = mean(&nominal);
    let reading_bias = differences(&mean(&unaveraged), &nominal);
    for figures in samples.iter_mut().filter_map(|s| s.figures.as_mut().ok()) {
        for (key, added) in &reading_bias {
            if let Some(figure) = figures.get_mut(key) {
                *figure = less(*figure, added.value).in_range(unit_of(&analysis.design, key));
            }
        }
    }
    Ok(Sampled { nominal, reading_bias, repeated, samples })
}

/// A figure less what its reading added.
fn less(figure: FigureEntry, added: f64) -> FigureEntry {
    let interval = figure.interval.map(|ends| ends.map(|end| end - added));
    FigureEntry { value: figure.value - added, interval, ..figure }
}

/// Noise of the figures that two or more of `traces` have.
fn repeated_noise(traces: &[Figures]) -> BTreeMap<String, RepeatedNoise> {
    let keys = traces.iter().flat_map(BTreeMap::keys);
    let of = |key: &String| {
        let values = traces.iter().filter_map(|figures| Some(figures.get(key)?.value));
        Some((key.clone(), RepeatedNoise::new(&values.collect::<Vec<_>>())?))
    };
    keys.filter_map(of).collect()
}

/// Figures of `to` less those of `from`, which are independent.
fn differences(to: &Figures, from: &Figures) -> BTreeMap<String, Estimate> {
    let of = |(key, to): (&String, &FigureEntry)| {
        let from = from.get(key)?;
        let error = scatter(to).hypot(scatter(from));
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

/// Mean of one figure. Its scatter is that of the values, or the stated one where that is more. Sums
/// that no path of any trace reached err by one path of all of them; ends of figures that are not
/// resolved are averaged, and the bias that picking leaves stays.
fn mean_of(all: &[&FigureEntry]) -> FigureEntry {
    let count = all.len() as f64;
    let mean = |of: &dyn Fn(&FigureEntry) -> f64| all.iter().map(|e| of(e)).sum::<f64>() / count;
    let is_unseen = all.iter().all(|e| e.upper_bound.is_some());
    let values: Vec<f64> = all.iter().map(|e| e.value).collect();
    let variance = RepeatedNoise::new(&values).map_or(0.0, |repeated| repeated.variance);
    let variance = mean(&|e| scatter(e).powi(2)).max(variance);
    let error =
        if is_unseen { mean(&|e| e.standard_error) / count } else { (variance / count).sqrt() };
    let bias_bound =
        all.iter().any(|e| e.bias_bound.is_some()).then(|| mean(&|e| e.bias_bound.unwrap_or(0.0)));
    let of_bias = bias_bound.unwrap_or(0.0) / 3f64.sqrt();
    let ends = |k: usize| mean(&|e| e.interval.map_or(e.value, |ends| ends[k]));
    let places = [PeakPlace::NotResolved, PeakPlace::OnAxis].into_iter();
    let mut places = places.filter(|place| all.iter().any(|e| e.peak_place == *place));
    FigureEntry {
        interval: all.iter().any(|e| e.interval.is_some()).then(|| [ends(0), ends(1)]),
        bias_bound,
        peak_place: places.next().unwrap_or_default(),
        ..FigureEntry::new(Estimate::new(mean(&|e| e.value), error.hypot(of_bias)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::statistics;
    use super::*;

    const KEY: &str = "cell_valley_to_peak";

    fn sampled(traces: &[FigureEntry], samples: &[FigureEntry]) -> Sampled {
        let figures = |entry: &FigureEntry| Figures::from([(KEY.to_owned(), *entry)]);
        let traces: Vec<Figures> = traces.iter().map(figures).collect();
        let package = |entry| SampledPackage { offsets: Vec::new(), figures: Ok(figures(entry)) };
        Sampled {
            nominal: mean(&traces),
            reading_bias: BTreeMap::new(),
            repeated: repeated_noise(&traces),
            samples: samples.iter().map(package).collect(),
        }
    }

    /// Traces of one design whose stated errors are far below what they scatter by.
    #[test]
    fn noise_is_no_less_than_that_of_repeated_traces() {
        let value = |k: usize| 0.3 + 0.06 * (2.4 * k as f64).sin();
        let stated = |k: usize| FigureEntry::new(Estimate::new(value(k), 1e-9));
        let traces: Vec<FigureEntry> = (0..16).map(stated).collect();
        let samples: Vec<FigureEntry> = (16..46).map(stated).collect();
        let of = sampled(&traces, &samples);
        let found = of.values(KEY).expect("all have it");
        assert_eq!(found.freedoms, Some(15.0));
        let statistics = statistics::scatter(&found).expect("many");
        // A sine of amplitude 0.06 has a deviation of 0.0424.
        assert!((statistics.noise - 0.0424).abs() < 0.003, "{statistics:?}");
        assert!(statistics.below.is_some_and(|below| below > 0.03), "{statistics:?}");
        let error = of.nominal[KEY].standard_error;
        assert!((error - 0.25 * statistics.noise).abs() < 1e-6, "{error}");
        // Samples that scatter by more are seen.
        let wider = |k: usize| FigureEntry::new(Estimate::new(3.0 * value(k), 1e-9));
        let samples: Vec<FigureEntry> = (16..46).map(wider).collect();
        let found = sampled(&traces, &samples).values(KEY).expect("all have it");
        let statistics = statistics::scatter(&found).expect("many");
        let deviation = statistics.deviation;
        assert!(statistics.below.is_none(), "{statistics:?}");
        assert!((deviation.value - 0.12).abs() < 0.01, "{deviation:?}");
        // The square of the noise is known to a third.
        assert!(deviation.standard_error > 0.002, "{deviation:?}");
    }

    /// The error of a figure that is not resolved is all of its interval, that of one that is leaves out
    /// the bias, and that of a beam of many crossings is stated already.
    #[test]
    fn figures_between_ends_have_the_noise_of_their_ends() {
        let open = FigureEntry::new(Estimate::between(0.1, 0.9, 0.0));
        assert_eq!(noise(&open).to_bits(), open.standard_error.to_bits());
        let held = FigureEntry::new(Estimate::between(0.30, 0.31, 0.02));
        assert!((noise(&held) - 0.02).abs() < 1e-12);
        let bin = FigureEntry::new(Estimate::new(20.0, 0.5));
        let bin = FigureEntry { interval: Some([17.5, 22.5]), ..bin };
        assert!((noise(&bin) - 5.0 / 12f64.sqrt()).abs() < 1e-12);
        let beam = FigureEntry::new(Estimate::new(23.0, 120.0 / 12f64.sqrt()));
        let beam = FigureEntry { interval: Some([20.0, 140.0]), ..beam };
        assert!((noise(&beam) - 120.0 / 12f64.sqrt()).abs() < 1e-12);
    }

    /// The bias of picking is common to all traces of a mean, their scatter is not.
    #[test]
    fn a_mean_keeps_the_bias_of_its_traces() {
        let traces = [FigureEntry::new(Estimate::between(0.3, 0.5, 0.004)); 16];
        let mean = sampled(&traces, &[]).nominal[KEY];
        let expected = 0.001f64.hypot(0.1 / 3f64.sqrt());
        assert!((mean.standard_error - expected).abs() < 1e-12, "{mean:?}");
        assert!((scatter(&mean) - 0.001).abs() < 1e-9, "{mean:?}");
    }

    #[test]
    fn ends_stay_in_the_range_of_their_unit() {
        let entry = FigureEntry::new(Estimate::between(0.5, 0.7, 0.01));
        for added in [0.5, 0.0, -0.3] {
            let moved = less(entry, added).in_range(metrics::quantity::Unit::Fraction);
            let [low, high] = moved.interval.expect("not resolved");
            assert!(0.0 <= low && low < moved.value, "{moved:?}");
            assert!(moved.value < high && high <= 1.0, "{moved:?}");
        }
    }
}
