// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a tolerance analysis found: `tolerance.json`, a line for each sample, and lines for people.

use std::fmt::Write as _;

use anyhow::Result;
use serde_json::{Value, json};

use super::compute::Sampled;
use super::definition::ToleranceAnalysis;
use super::sample_tracer::Figures;
use super::statistics::{Contribution, Scatter, contributions, scatter, share, without_noise};
use crate::digits::format_value_with_error;
use crate::metrics::Estimate;
use crate::plural::count;
use crate::provenance::FileRecord;
use crate::report::plots::{CumulativeShare, Heading, MarkedValue, Picture, sample_distribution};

/// Version of the layout of `tolerance.json`.
const SCHEMA_VERSION: u32 = 1;
/// Contributors that are listed for people.
const LISTED: usize = 6;

/// Statistics of one figure.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureStatistics {
    /// Key of the figure.
    pub key: String,
    /// Without deviations.
    pub nominal: Estimate,
    /// Over the samples.
    pub scatter: Scatter,
    /// Mean of the samples less the nominal value.
    pub shift: Estimate,
    /// What contributes to the scatter, with the share that no straight line explains.
    pub contributions: Option<(Vec<Contribution>, Estimate)>,
}

/// Everything that one analysis found.
#[derive(Debug, Clone)]
pub struct ToleranceResults<'a> {
    /// The analysis.
    pub analysis: &'a ToleranceAnalysis,
    /// What its traces show.
    pub sampled: &'a Sampled,
    /// By figure, in the order of the file.
    pub figures: Vec<FigureStatistics>,
}

impl<'a> ToleranceResults<'a> {
    /// Statistics of all figures that every sample has.
    pub fn new(analysis: &'a ToleranceAnalysis, sampled: &'a Sampled) -> Self {
        let figures = analysis.figures.iter();
        let figures = figures.filter_map(|key| statistics(analysis, sampled, key));
        Self {
            analysis,
            sampled,
            figures: figures.collect(),
        }
    }

    /// Packages that keep all limits, of all packages, with the 95 % interval of their share; one
    /// without a design keeps none. None without limits.
    pub fn yielded(&self) -> Option<(usize, usize, f64, [f64; 2])> {
        let limits = &self.analysis.limits;
        let holds = |figures: &Figures| {
            let mut limits = limits.iter();
            limits.all(|limit| {
                figures
                    .get(&limit.figure)
                    .is_some_and(|e| limit.bounds.miss(e.value, 0.0) <= 0.0)
            })
        };
        let samples = &self.sampled.samples;
        let good = samples
            .iter()
            .filter(|s| s.figures.as_ref().is_ok_and(holds))
            .count();
        let (part, interval) = share(good, samples.len());
        (!limits.is_empty()).then_some((good, samples.len(), part, interval))
    }

    /// Samples that make no design.
    pub fn failed(&self) -> Vec<&str> {
        let samples = self.sampled.samples.iter();
        samples
            .filter_map(|s| s.figures.as_ref().err().map(String::as_str))
            .collect()
    }

    /// The content of `tolerance.json`.
    pub fn to_json(&self, seed: u64, files: &[FileRecord]) -> Value {
        let analysis = self.analysis;
        let names: Vec<&str> = self.names();
        let figures = self.figures.iter().map(|f| {
            let quantiles = f.scatter.quantiles.iter().map(|(level, quantile)| {
                json!({"level": level, "value": quantile.value, "standard_error": quantile.standard_error})
            });
            let parts = f.contributions.as_ref().map(|(parts, rest)| {
                let parts = parts.iter().map(|part| {
                    json!({
                        "tolerance": names[part.tolerance],
                        "share": part.share,
                        "change_per_deviation": part.slope,
                    })
                });
                json!({"by_tolerance": parts.collect::<Vec<_>>(), "unexplained": rest})
            });
            let entry = json!({
                "nominal": f.nominal,
                "mean": f.scatter.mean,
                "shift": f.shift,
                "deviation": f.scatter.deviation,
                "noise_of_a_trace": f.scatter.noise,
                "quantiles": quantiles.collect::<Vec<_>>(),
                "contributions": parts,
            });
            (f.key.clone(), entry)
        });
        let limits = analysis.limits.iter().map(|limit| {
            json!({"figure": limit.figure, "at_least": limit.bounds.at_least, "at_most": limit.bounds.at_most})
        });
        let yielded = self.yielded().map(|(good, all, part, interval)| {
            json!({"good": good, "of": all, "share": part, "interval_95": interval})
        });
        json!({
            "schema_version": SCHEMA_VERSION,
            "program": {"name": "batwing", "version": env!("CARGO_PKG_VERSION")},
            "name": analysis.name,
            "description": analysis.description,
            "design": analysis.design.name,
            "model": analysis.model.key(&analysis.design),
            "samples": self.sampled.samples.len(),
            "paths": analysis.paths,
            "seed": seed,
            "inputs": analysis.inputs,
            "files": files,
            "tolerances": names,
            "figures": figures.collect::<serde_json::Map<_, _>>(),
            "limits": limits.collect::<Vec<_>>(),
            "yield": yielded,
            "without_design": self.failed(),
        })
    }

    /// The distribution of the first figure over the packages, without the noise of the traces; none
    /// where it has no scatter.
    ///
    /// # Errors
    /// Values that cannot be drawn.
    pub fn distribution_picture(&self) -> Result<Option<Picture>> {
        let Some(first) = self.figures.first() else {
            return Ok(None);
        };
        let samples = self.sampled.samples.iter();
        let values = samples.filter_map(|s| s.figures.as_ref().ok()?.get(&first.key).copied());
        let (_, variance, sorted) = without_noise(&values.collect::<Vec<_>>());
        if variance <= 0.0 {
            return Ok(None);
        }
        let shares = (1..).zip(&sorted).map(|(below, value)| {
            let (share, interval) = share(below, sorted.len());
            CumulativeShare {
                value: *value,
                share,
                interval,
            }
        });
        let nominal = MarkedValue {
            label: "without deviations".to_owned(),
            value: first.nominal.value,
        };
        let analysis = self.analysis;
        let words = format!(
            "{}, {}; noise of the traces taken out",
            analysis.design.name,
            count(sorted.len(), "package")
        );
        sample_distribution(
            &Heading::new("Distribution over the tolerances", words),
            &first.key,
            &shares.collect::<Vec<_>>(),
            &nominal,
            &self.marked_limits(&first.key),
        )
        .map(Some)
    }

    /// Limits of a figure.
    fn marked_limits(&self, key: &str) -> Vec<MarkedValue> {
        let limits = self.analysis.limits.iter();
        let of_figure = limits.filter(|limit| limit.figure == key);
        let bounds = of_figure.flat_map(|limit| {
            let bounds = [
                ("at least", limit.bounds.at_least),
                ("at most", limit.bounds.at_most),
            ];
            bounds.into_iter().filter_map(|(words, bound)| {
                let value = bound?;
                Some(MarkedValue {
                    label: format!("limit: {words} {value}"),
                    value,
                })
            })
        });
        bounds.collect()
    }

    fn names(&self) -> Vec<&str> {
        let tolerances = self.analysis.deviations.tolerances.iter();
        tolerances
            .map(|tolerance| tolerance.name.as_str())
            .collect()
    }

    /// Headings of the table of samples.
    pub fn headings(&self) -> Vec<String> {
        let first = self.sampled.samples.first();
        let offsets = first.into_iter().flat_map(|sample| &sample.offsets);
        let names = self.names();
        let offsets = offsets.map(|offset| {
            let name = names[offset.tolerance];
            if name == offset.place {
                name.to_owned()
            } else {
                format!("{name} {}", offset.place)
            }
        });
        let figures = self.analysis.figures.iter();
        let figures = figures.flat_map(|key| [key.clone(), format!("{key}_standard_error")]);
        offsets.chain(figures).collect()
    }

    /// A line for each sample: offsets, then figures with their errors.
    pub fn rows(&self) -> Vec<Vec<String>> {
        let row = |sample: &super::compute::SampledPackage| -> Vec<String> {
            let offsets = sample.offsets.iter().map(|offset| offset.value.to_string());
            let figures = self.analysis.figures.iter().flat_map(|key| {
                let found = sample.figures.as_ref().ok().and_then(|f| f.get(key));
                found.map_or_else(
                    || [String::new(), String::new()],
                    |e| [e.value.to_string(), e.standard_error.to_string()],
                )
            });
            offsets.chain(figures).collect()
        };
        self.sampled.samples.iter().map(row).collect()
    }

    /// Lines for people.
    pub fn plain_text(&self) -> String {
        let number = |e: Estimate| format_value_with_error(e.value, e.standard_error);
        let mut text = format!(
            "{:<28} {:>16} {:>16} {:>14} {:>14} {:>14}\n",
            "figure", "nominal", "mean shift", "deviation", "5 %", "95 %"
        );
        // Writing to a string cannot fail.
        for f in &self.figures {
            let _ = writeln!(
                text,
                "{:<28} {:>16} {:>16} {:>14} {:>14} {:>14}",
                f.key,
                number(f.nominal),
                number(f.shift),
                number(f.scatter.deviation),
                number(f.scatter.quantiles[0].1),
                number(f.scatter.quantiles[2].1),
            );
        }
        if let Some((good, all, part, [low, high])) = self.yielded() {
            let _ = writeln!(
                text,
                "\nyield: {good} of {all} within the limits, {:.1} % (95 % interval {:.1} to {:.1} %)",
                100.0 * part,
                100.0 * low,
                100.0 * high
            );
        }
        if let Some(why) = self.failed().first() {
            let _ = writeln!(
                text,
                "{} without a design, such as: {why}",
                self.failed().len()
            );
        }
        let names = self.names();
        let main = self
            .figures
            .first()
            .and_then(|f| Some((&f.key, f.contributions.as_ref()?)));
        if let Some((key, (parts, rest))) = main {
            let _ = writeln!(text, "\nshare of the variance of {key}:");
            let mut parts: Vec<&Contribution> = parts.iter().collect();
            parts.sort_by(|a, b| b.share.value.total_cmp(&a.share.value));
            for part in parts.into_iter().take(LISTED) {
                let _ = writeln!(
                    text,
                    "  {:<26} {:>16}",
                    names[part.tolerance],
                    number(part.share)
                );
            }
            let _ = writeln!(
                text,
                "  {:<26} {:>16}",
                "not by straight lines",
                number(*rest)
            );
        }
        text
    }
}

fn statistics(
    analysis: &ToleranceAnalysis,
    sampled: &Sampled,
    key: &str,
) -> Option<FigureStatistics> {
    let nominal = *sampled.nominal.get(key)?;
    let samples = sampled
        .samples
        .iter()
        .filter_map(|s| Some((s, s.figures.as_ref().ok()?)));
    let found: Vec<(&super::compute::SampledPackage, Estimate)> = samples
        .map(|(sample, figures)| Some((sample, *figures.get(key)?)))
        .collect::<Option<_>>()?;
    let values: Vec<Estimate> = found.iter().map(|(_, value)| *value).collect();
    let mut scatter = scatter(&values)?;
    let independent = |sample: &super::compute::SampledPackage| -> (Vec<usize>, Vec<f64>) {
        let columns = analysis.deviations.independent(&sample.offsets);
        let columns = columns.into_iter();
        columns.map(|offset| (offset.tolerance, offset.value)).unzip()
    };
    let inputs: Vec<Vec<f64>> = found
        .iter()
        .map(|(sample, _)| independent(sample).1)
        .collect();
    let groups: Vec<usize> = independent(sampled.samples.first()?).0;
    // What is taken off holds the nominal value too, which drops out of the shift.
    let bias_error = sampled
        .reading_bias
        .get(key)
        .map_or(0.0, |e| e.standard_error);
    let of_nominal = (bias_error.powi(2) - nominal.standard_error.powi(2))
        .abs()
        .sqrt();
    let shift = Estimate::new(
        scatter.mean.value - nominal.value,
        scatter.mean.standard_error.hypot(of_nominal),
    );
    let quantiles = scatter.quantiles.iter_mut().map(|(_, quantile)| quantile);
    for estimate in quantiles.chain([&mut scatter.mean]) {
        estimate.standard_error = estimate.standard_error.hypot(bias_error);
    }
    Some(FigureStatistics {
        key: key.to_owned(),
        nominal,
        shift,
        contributions: contributions(&values, &inputs, &groups)
            .filter(|_| analysis.deviations.tolerances.len() > 1),
        scatter,
    })
}
