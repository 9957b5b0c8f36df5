// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a tolerance analysis found: `tolerance.json`, a line for each sample, and lines for people.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use metrics::Estimate;
use metrics::plural::count;
use results::figure_entry::{COLUMNS, FigureEntry};
use results::schema::Program;
use results::shown;
use results::tolerance::{
    BoundEntry, ContributionEntry, ContributionsEntry, CumulativeShareEntry, DistributionEntry,
    FigureRow, QuantileEntry, SCHEMA_VERSION, ToleranceFigureEntry, ToleranceResultsFile,
    YieldEntry, share_words, unseen,
};
use simulate::observation::{unit_in_files, unit_of};

use super::compute::{NoisyValues, Sampled, scatter as of_paths};
use super::definition::ToleranceAnalysis;
use super::sample_tracer::Figures;
use super::statistics::{Scatter, contributions, scatter, share, without_noise};

/// Packages of a distribution that are kept for its picture.
const DRAWN: usize = 500;
/// Standard errors of a package within which noise decides whether it keeps a bound.
const NEAR: f64 = 2.0;
/// Contributors that are listed for people.
const LISTED: usize = 6;

/// Everything that one analysis found.
#[derive(Debug, Clone)]
pub struct ToleranceResults<'a> {
    /// The analysis.
    pub analysis: &'a ToleranceAnalysis,
    /// Figures of its traces.
    pub sampled: &'a Sampled,
    /// By key, in the order of the file.
    figures: Vec<(String, ToleranceFigureEntry)>,
}

impl<'a> ToleranceResults<'a> {
    /// Statistics of all figures that every sample has.
    pub fn new(analysis: &'a ToleranceAnalysis, sampled: &'a Sampled) -> Self {
        let figures = analysis.figures.iter();
        let figures =
            figures.filter_map(|key| Some((key.clone(), statistics(analysis, sampled, key)?)));
        Self { analysis, sampled, figures: figures.collect() }
    }

    /// Packages that meet all constraints, of all packages, with the 95 % interval of their share;
    /// one without a design meets none. None without constraints; no share where noise decides.
    fn yielded(&self) -> Option<YieldEntry> {
        let constraints = &self.analysis.constraints;
        let holds = |figures: &Figures| {
            constraints.iter().all(|constraint| {
                figures
                    .get(&constraint.figure)
                    .is_some_and(|e| constraint.bounds().miss(e.value, 0.0) <= 0.0)
            })
        };
        let samples = &self.sampled.samples;
        let good = samples.iter().filter(|s| s.figures.as_ref().is_ok_and(holds)).count();
        let of = samples.len();
        let (share, interval_95) = share(good, of);
        let why = constraints.iter().find_map(|constraint| self.undecided(constraint));
        let entry = match why {
            None => YieldEntry {
                good: Some(good),
                of,
                share: Some(share),
                interval_95: Some(interval_95),
                not_resolved: None,
            },
            not_resolved => {
                YieldEntry { good: None, of, share: None, interval_95: None, not_resolved }
            }
        };
        (!constraints.is_empty()).then_some(entry)
    }

    /// Figures that some packages lack, with the reason; of those that the file does not ask for
    /// such that any has.
    fn unread(&self) -> BTreeMap<String, String> {
        let samples = || self.sampled.samples.iter().filter_map(|s| s.figures.as_ref().ok());
        let all = samples().count();
        let asked = |key: &String| self.analysis.required.iter().any(|(_, figure)| figure == key);
        let keys = self.analysis.figures.iter();
        let keys = keys.filter(|key| self.figure(key).is_none());
        let one = |key: &String| {
            let count = samples().filter(|figures| figures.contains_key(key)).count();
            let why = format!("can be read from {count} of {all} packages");
            (count > 0 || asked(key)).then(|| (key.clone(), why))
        };
        keys.filter_map(one).collect()
    }

    /// Reason why noise decides which packages meet `constraint`, if it does.
    fn undecided(&self, constraint: &BoundEntry) -> Option<String> {
        let key = &constraint.figure;
        let found = self.figure(key).zip(self.sampled.values(key));
        let Some((figure, NoisyValues { values, .. })) = found else {
            return self.unread().get(key).map(|why| format!("{key} {why}"));
        };
        let is_near = |e: &&Estimate| {
            let near = |bound: f64| (e.value - bound).abs() < NEAR * e.standard_error;
            [constraint.at_least, constraint.at_most].into_iter().flatten().any(near)
        };
        let (noise, near) = (figure.noise_of_a_trace, values.iter().filter(is_near).count());
        let unit = unit_of(&self.analysis.design, key);
        let exceeds = figure.deviation.is_none_or(|deviation| noise > deviation.value);
        (exceeds && near > 0).then(|| {
            format!(
                "the noise of a trace of {key}, {}, {}, and {near} of {} lie within {NEAR} \
                 standard errors of the bound; take more paths",
                shown::spread(noise, unit),
                figure.deviation.map_or_else(
                    || "hides its scatter".to_owned(),
                    |scatter| format!("exceeds its scatter, {}", shown::difference(scatter, unit)),
                ),
                count(values.len(), "package"),
            )
        })
    }

    /// Samples that make no design.
    pub fn failed(&self) -> Vec<&str> {
        let samples = self.sampled.samples.iter();
        samples.filter_map(|s| s.figures.as_ref().err().map(String::as_str)).collect()
    }

    /// The content of `tolerance.json`, without the files that came out.
    pub fn to_file(&self, seed: u64) -> ToleranceResultsFile {
        let analysis = self.analysis;
        ToleranceResultsFile {
            schema_version: SCHEMA_VERSION,
            program: Program::this(),
            name: analysis.name.clone(),
            description: analysis.description.clone(),
            design: analysis.design.name.clone(),
            model: analysis.model.key(&analysis.design),
            samples: self.sampled.samples.len(),
            paths: analysis.paths,
            seed,
            inputs: analysis.inputs.clone(),
            files: Vec::new(),
            tolerances: names(analysis).into_iter().map(str::to_owned).collect(),
            figures: self.figures.iter().cloned().collect(),
            constraints: analysis.constraints.clone(),
            yielded: self.yielded(),
            distribution: self.distribution(),
            unread: self.unread(),
            without_design: self.failed().into_iter().map(str::to_owned).collect(),
        }
    }

    /// The distribution of the first figure over the packages, without the noise of the traces;
    /// none where it has no scatter.
    fn distribution(&self) -> Option<DistributionEntry> {
        let (key, first) = self.figures.first()?;
        first.deviation?;
        let (.., sorted) = without_noise(&self.sampled.values(key)?.values);
        let packages = sorted.len();
        let stride = packages.div_ceil(DRAWN);
        let shares = (1..).zip(&sorted).map(|(below, value)| {
            let (share, interval_95) = share(below, packages);
            CumulativeShareEntry { value: *value, share, interval_95 }
        });
        let last = packages - 1;
        let drawn = shares.enumerate().filter(|(k, _)| k % stride == 0 || *k == last);
        Some(DistributionEntry {
            figure: key.clone(),
            packages,
            shares: drawn.map(|(_, share)| share).collect(),
        })
    }

    /// Statistics of the figure under `key`.
    fn figure(&self, key: &str) -> Option<&ToleranceFigureEntry> {
        self.figures.iter().find(|(known, _)| known == key).map(|(_, figure)| figure)
    }

    /// Headings of the table of samples.
    pub fn headings(&self) -> Vec<String> {
        let first = self.sampled.samples.first();
        let offsets = first.into_iter().flat_map(|sample| &sample.offsets);
        let names = names(self.analysis);
        let offsets = offsets.map(|offset| {
            let name = names[offset.tolerance];
            if name == offset.place { name.to_owned() } else { format!("{name} {}", offset.place) }
        });
        let figures = self.analysis.figures.iter().flat_map(|key| {
            COLUMNS.map(|column| match column {
                "value" => key.clone(),
                other => format!("{key}_{other}"),
            })
        });
        offsets.chain(figures).collect()
    }

    /// A line for each sample: offsets, then figures with their states.
    pub fn rows(&self) -> Vec<Vec<String>> {
        let row = |sample: &super::compute::SampledPackage| -> Vec<String> {
            let offsets = sample.offsets.iter().map(|offset| offset.value.to_string());
            let figures = self.analysis.figures.iter().flat_map(|key| {
                let found = sample.figures.as_ref().ok().and_then(|f| f.get(key));
                found.map(FigureEntry::columns).unwrap_or_default()
            });
            offsets.chain(figures).collect()
        };
        self.sampled.samples.iter().map(row).collect()
    }

    /// Lines for people.
    pub fn plain_text(&self) -> String {
        let mut text = String::new();
        let mut row = |name: &str, cells: [&str; 6]| {
            let [nominal, shift, deviation, noise, low, high] = cells;
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{name:<28} {nominal:>18} {shift:>20} {deviation:>20} {noise:>14} {low:>16} \
                 {high:>16}"
            );
        };
        row("figure", ["nominal", "mean shift", "deviation", "noise", "5 %", "95 %"]);
        for (key, figure) in &self.figures {
            let FigureRow { nominal, shift, deviation, noise, quantiles } = figure.row(key);
            let unresolved = "not resolved";
            let ends = [quantiles.first(), quantiles.last()];
            let [low, high] = ends.map(|end| end.map_or(unresolved, |(_, text)| text));
            let deviation = deviation.as_deref().unwrap_or(unresolved);
            row(key, [&nominal, &shift, deviation, &noise, low, high]);
        }
        let bounded = self.figures.iter().filter_map(|(key, figure)| {
            let unit = unit_of(&self.analysis.design, key);
            Some(format!("{key} {}", shown::spread(figure.deviation_below?, unit)))
        });
        if let Some(unseen) = unseen(&bounded.collect::<Vec<_>>()) {
            let _ = writeln!(text, "{unseen}");
        }
        for (key, why) in self.unread() {
            let _ = writeln!(text, "without statistics: {key} {why}");
        }
        if let Some(found) = self.yielded() {
            let _ = writeln!(text, "\nyield: {}", found.words());
        }
        if let Some(why) = self.failed().first() {
            let _ = writeln!(text, "{} without a design, such as: {why}", self.failed().len());
        }
        let main = self.figures.first();
        let main = main.and_then(|(key, figure)| Some((key, figure.contributions.as_ref()?)));
        if let Some((key, ContributionsEntry { by_tolerance, unexplained })) = main {
            let _ = writeln!(text, "\nshare of the variance of {key}:");
            let mut parts: Vec<&ContributionEntry> = by_tolerance.iter().collect();
            parts.sort_by(|a, b| b.share.value.total_cmp(&a.share.value));
            for part in parts.into_iter().take(LISTED) {
                let share = share_words(part.share);
                let _ = writeln!(text, "  {:<26} {share:>16}", part.tolerance);
            }
            let rest = share_words(*unexplained);
            let _ = writeln!(text, "  {:<26} {rest:>16}", "not by straight lines");
        }
        text
    }
}

/// Names of the tolerances.
fn names(analysis: &ToleranceAnalysis) -> Vec<&str> {
    analysis.deviations.tolerances.iter().map(|tolerance| tolerance.name.as_str()).collect()
}

fn statistics(
    analysis: &ToleranceAnalysis,
    sampled: &Sampled,
    key: &str,
) -> Option<ToleranceFigureEntry> {
    let nominal = *sampled.nominal.get(key)?;
    let found = sampled.values(key)?;
    let Scatter { mut mean, deviation, below, noise, mut quantiles } = scatter(&found)?;
    let independent = |sample: &super::compute::SampledPackage| -> (Vec<usize>, Vec<f64>) {
        let columns = analysis.deviations.independent(&sample.offsets);
        let columns = columns.into_iter();
        columns.map(|offset| (offset.tolerance, offset.value)).unzip()
    };
    let built = sampled.samples.iter().filter(|sample| sample.figures.is_ok());
    let inputs: Vec<Vec<f64>> = built.map(|sample| independent(sample).1).collect();
    let groups: Vec<usize> = independent(sampled.samples.first()?).0;
    // What is taken off holds the nominal value too, which drops out of the shift.
    let bias_error = sampled.reading_bias.get(key).map_or(0.0, |e| e.standard_error);
    let of_nominal = (bias_error.powi(2) - of_paths(&nominal).powi(2)).abs().sqrt();
    let shift = Estimate::new(mean.value - nominal.value, mean.standard_error.hypot(of_nominal));
    // Peaks lie anywhere in their bins, those of the samples and that of the design.
    let width = nominal.interval.filter(|_| nominal.is_bin()).map(|[low, high]| high - low);
    let shift = FigureEntry {
        interval: width.map(|width| [shift.value - width, shift.value + width]),
        upper_bound: None,
        peak_place: nominal.peak_place,
        ..FigureEntry::new(shift)
    };
    for estimate in quantiles.iter_mut().map(|(_, quantile)| quantile).chain([&mut mean]) {
        estimate.standard_error = estimate.standard_error.hypot(bias_error);
    }
    let is_resolved = below.is_none();
    let quantiles = quantiles.into_iter().filter(|_| is_resolved);
    let quantiles = quantiles.map(|(level, quantile)| QuantileEntry { level, quantile });
    let names = names(analysis);
    let contributions = contributions(&found.values, &inputs, &groups);
    let contributions = contributions.filter(|_| names.len() > 1 && is_resolved);
    let contributions = contributions.map(|(parts, unexplained)| {
        let parts = parts.into_iter().map(|part| ContributionEntry {
            tolerance: names[part.tolerance].to_owned(),
            share: part.share,
            change_per_deviation: part.slope,
        });
        ContributionsEntry { by_tolerance: parts.collect(), unexplained }
    });
    Some(ToleranceFigureEntry {
        unit: unit_in_files(&analysis.design, key),
        nominal,
        mean,
        shift,
        deviation: is_resolved.then_some(deviation),
        deviation_below: below,
        noise_of_a_trace: noise,
        quantiles: quantiles.collect(),
        contributions,
    })
}
