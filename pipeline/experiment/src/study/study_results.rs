// SPDX-License-Identifier: MIT OR Apache-2.0
//! Results of a study: figures of every set-up, changes against the base, misfits to targets.
//!
//! All traces of a study use the same random numbers, group of paths by group. A figure keeps its
//! values without each group, so that the standard error of a difference comes from the differences
//! of each group (paired jackknife).

use std::cmp::Reverse;
use std::collections::BTreeMap;

use metrics::estimate::DISTINCT;
use metrics::{Estimate, spread};
use results::paired_figure::{PairedFigure, jump};
use results::shown::named;
use results::study::{
    FactorEntry, LeftOutEntry, RankedEntry, SCHEMA_VERSION, SensitivityEntry, SetupEntry,
    StudyFigureEntry, StudyFile,
};
use results::target::{Sought, Target, Verdict};
use simulate::observation::{is_comparable, unit_in_files, why_absent};

use super::definition::Study;
use super::targets::Targets;
use super::trace_figures::{NamedFigures, SetupFigures, TraceId, find};
use crate::paired_sum::PairedSum;

/// Misfit of a set-up, the root mean square of misses in units of their scales. `None` without targets,
/// or without one of the figures of `base`.
pub fn misfit(found: &SetupFigures, base: &SetupFigures, targets: &Targets) -> Option<PairedSum> {
    let (figures, sought): (Vec<_>, Vec<_>) = misses(found, targets).into_iter().unzip();
    if figures.is_empty() || absent(found, base, targets).next().is_some() {
        return None;
    }
    let root_mean_square = |values: &[f64]| {
        let squares = sought.iter().zip(values).map(|(target, value)| target.miss(*value).powi(2));
        (squares.sum::<f64>() / values.len() as f64).sqrt()
    };
    Some(PairedSum::new(&figures, root_mean_square))
}

/// Places and names of the figures with a target that `base` has and `found` has not.
fn absent<'a>(
    found: &'a SetupFigures,
    base: &'a SetupFigures,
    targets: &'a Targets,
) -> impl Iterator<Item = (&'a TraceId, &'a str, Target)> {
    let all = base.iter().flat_map(|(place, of)| of.iter().map(move |(f, _)| (place, f)));
    all.filter(|(place, name)| find(found, place, name).is_none()).filter_map(|(place, name)| {
        Some((place, name.as_str(), targets.of(&place.design, &place.model, name)?))
    })
}

/// Figures with a target, with their targets.
fn misses<'a>(found: &'a SetupFigures, targets: &Targets) -> Vec<(&'a PairedFigure, Target)> {
    let of = |place: &TraceId, name: &str| targets.of(&place.design, &place.model, name);
    let all = found
        .iter()
        .flat_map(|(place, judged)| judged.iter().map(move |(name, f)| (place, name, f)));
    all.filter_map(|(place, name, figure)| Some((figure, of(place, name)?))).collect()
}

/// A study with the figures of its traces.
pub struct StudyResults<'a> {
    /// The study.
    pub study: &'a Study,
    /// By set-up.
    pub found: Vec<SetupFigures>,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A figure with a target that a set-up has not.
pub struct AbsentFigure<'a> {
    /// Design and model.
    pub place: &'a TraceId,
    /// Name of the figure.
    pub figure: &'a str,
    /// Target.
    pub target: Target,
    /// Reason.
    pub why: String,
}

impl StudyResults<'_> {
    /// Set-ups by misfit, the smallest first, and of equal ones the one that meets more targets; empty
    /// without targets.
    fn ranking(&self, setups: &[SetupEntry]) -> Vec<RankedEntry> {
        let mut misfits: Vec<(&SetupEntry, PairedSum)> = setups
            .iter()
            .zip(&self.found)
            .filter_map(|(setup, found)| Some((setup, self.misfit(found)?)))
            .collect();
        let met = |setup: &SetupEntry| {
            let verdicts =
                setup.figures.iter().filter(|figure| figure.verdict == Some(Verdict::Met));
            Reverse(verdicts.count())
        };
        misfits.sort_by_cached_key(|(setup, _)| met(setup));
        misfits.sort_by(|a, b| a.1.value.total_cmp(&b.1.value));
        let ranked = |(setup, misfit): &(&SetupEntry, PairedSum)| {
            let above_first = misfit.change(&misfits[0].1);
            RankedEntry {
                setup: setup.name.clone(),
                misfit: misfit.estimate(),
                above_first,
                tied_with_first: is_tied(above_first),
            }
        };
        misfits.iter().map(ranked).collect()
    }

    /// Misfit of a set-up.
    fn misfit(&self, found: &SetupFigures) -> Option<PairedSum> {
        misfit(found, &self.found[0], &self.study.targets)
    }

    /// Figures with a target that set-up `index` has not; it is not ranked then.
    pub fn absent(&self, index: usize) -> impl Iterator<Item = AbsentFigure<'_>> {
        let all = absent(&self.found[index], &self.found[0], &self.study.targets);
        all.map(move |(place, figure, target)| {
            let designs = &self.study.setups[index].1;
            let design = designs.iter().find(|design| design.name == place.design);
            let is_shown = |key: &str| find(&self.found[index], place, key).is_some();
            let why = design.map_or_else(String::new, |design| {
                why_absent(design, design.trace.paths, figure, is_shown)
            });
            AbsentFigure { place, figure, target, why }
        })
    }

    /// Set-ups that are not ranked, for want of figures with targets.
    pub fn unranked(&self) -> Vec<LeftOutEntry> {
        let one = |index: usize| {
            let words = self.absent(index).map(|of| {
                let TraceId { design, model } = of.place;
                format!("no {} of {design} {model}: {}", of.figure, of.why)
            });
            let words: Vec<String> = words.collect();
            let setup = self.study.setups[index].0.name.clone();
            (!words.is_empty()).then(|| LeftOutEntry { setup, why: words.join("; ") })
        };
        (0..self.found.len()).filter_map(one).collect()
    }

    /// Every figure of set-up `index`.
    fn figures(&self, index: usize) -> Vec<StudyFigureEntry> {
        let designs = &self.study.setups[index].1;
        let of_trace = |(place, judged): (&TraceId, &NamedFigures)| {
            let design = designs.iter().find(|design| design.name == place.design);
            let entry = |(name, figure): &(String, PairedFigure)| {
                let base = (index > 0 && self.is_comparable(index, place, name))
                    .then(|| find(&self.found[0], place, name))
                    .flatten();
                let target = self.study.targets.of(&place.design, &place.model, name);
                let (near, bounds) = match target.map(|target| target.sought) {
                    Some(Sought::Near(value)) => (Some(value), None),
                    Some(Sought::Within(bounds)) => (None, Some(bounds)),
                    None => (None, None),
                };
                StudyFigureEntry {
                    design: place.design.clone(),
                    model: place.model.clone(),
                    figure: name.clone(),
                    unit: design.map_or_else(String::new, |design| unit_in_files(design, name)),
                    value: figure.entry,
                    change: base.map(|b| figure.change(b).in_range_of_changes(named(name).1)),
                    target: near,
                    bounds,
                    miss: target.map(|target| target.miss(figure.entry.value)),
                    verdict: target.map(|target| target.judge(&figure.entry)),
                }
            };
            judged.iter().map(entry).collect::<Vec<_>>()
        };
        self.found[index].iter().flat_map(of_trace).collect()
    }

    /// True where a figure of set-up `index` may be subtracted from that of the base.
    fn is_comparable(&self, index: usize, place: &TraceId, figure: &str) -> bool {
        let of = |setup: usize| {
            self.study.setups[setup].1.iter().find(|design| design.name == place.design)
        };
        of(0).zip(of(index)).is_some_and(|(base, design)| is_comparable(base, design, figure))
    }

    /// Sensitivities: change of every figure per unit of each numeric factor, the slope of the line
    /// through its levels.
    fn slopes(&self) -> Vec<SensitivityEntry> {
        let mut slopes = Vec::new();
        for factor in &self.study.factors {
            let Some(numbers) = &factor.numbers else {
                continue;
            };
            let at: Vec<(f64, usize)> = factor
                .levels
                .iter()
                .zip(numbers)
                .filter_map(|((label, _), &x)| {
                    let alone = |levels: &BTreeMap<String, String>| {
                        levels.len() == 1 && levels.get(&factor.name) == Some(label)
                    };
                    let index = self.study.setups.iter().position(|s| alone(&s.0.levels))?;
                    Some((x, index))
                })
                .collect();
            if at.len() < 2 {
                continue;
            }
            for (place, judged) in &self.found[0] {
                for (name, _) in judged {
                    let point = |&(x, setup): &(f64, usize)| {
                        self.is_comparable(setup, place, name).then_some(())?;
                        Some((x, find(&self.found[setup], place, name)?))
                    };
                    let points: Option<Vec<(f64, &PairedFigure)>> = at.iter().map(point).collect();
                    let Some(slope) = points.and_then(|p| slope(&p)) else {
                        continue;
                    };
                    slopes.push(SensitivityEntry {
                        factor: factor.name.clone(),
                        key: factor.key.clone(),
                        design: place.design.clone(),
                        model: place.model.clone(),
                        figure: name.clone(),
                        change_per_unit: slope,
                    });
                }
            }
        }
        slopes
    }

    /// The content of `study.json` (`docs/reference/study-file.md`), without the files beside it.
    pub fn to_file(&self) -> StudyFile {
        let study = self.study;
        let setups = study.setups.iter().enumerate().map(|(index, (setup, _))| SetupEntry {
            name: setup.name.clone(),
            levels: setup.levels.clone(),
            misfit: self.misfit(&self.found[index]).map(|misfit| misfit.estimate()),
            figures: self.figures(index),
        });
        let setups: Vec<SetupEntry> = setups.collect();
        let factors = study.factors.iter().map(|factor| FactorEntry {
            name: factor.name.clone(),
            description: factor.description.clone(),
            key: factor.key.clone(),
            levels: factor.levels.iter().map(|(level, _)| level.clone()).collect(),
        });
        StudyFile {
            schema: "batwing-study".to_owned(),
            schema_version: SCHEMA_VERSION,
            program: "batwing".to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            name: study.file.name.clone(),
            description: study.file.description.clone(),
            seed: self.seed,
            inputs: study.inputs.clone(),
            files: Vec::new(),
            scales: study.targets.scales.clone(),
            factors: factors.collect(),
            ranking: self.ranking(&setups),
            setups,
            impossible: study.impossible.clone(),
            unranked: self.unranked(),
            sensitivities: self.slopes(),
        }
    }
}

/// True of an excess over the first set-up that cannot be told from none; that of the first is among
/// these.
fn is_tied(above_first: Estimate) -> bool {
    above_first.value <= DISTINCT * above_first.standard_error
}

/// Slope of the least-squares line through `points`, with its standard error; `None` where all x
/// are the same.
fn slope(points: &[(f64, &PairedFigure)]) -> Option<Estimate> {
    let count = points.len() as f64;
    let mean = points.iter().map(|p| p.0).sum::<f64>() / count;
    let square: f64 = points.iter().map(|p| (p.0 - mean).powi(2)).sum();
    let groups = points.iter().map(|p| p.1.without.len()).min()?;
    let of = |value: &dyn Fn(&PairedFigure) -> f64| {
        points.iter().map(|(x, f)| (x - mean) * value(f)).sum::<f64>() / square
    };
    let without: Vec<f64> = (0..groups).map(|g| of(&|f| f.without[g])).collect();
    // Biases of extremes are alike and add up by sign; other hidden errors are each their own.
    let hidden = |is_common: bool| {
        let of_kind = points.iter().filter(move |(_, f)| f.hides_a_bias() == is_common);
        of_kind.map(|(x, f)| (x - mean) * f.hidden_error() / square)
    };
    let common: f64 = hidden(true).sum();
    let value = of(&|f| f.entry.value);
    let common = common.abs().max(jump(value, &without, value.abs()) / 3f64.sqrt());
    let error = hidden(false).fold(spread(&without), f64::hypot).hypot(common);
    (square > 0.0).then_some(Estimate::new(value, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(value: f64, without: &[f64]) -> PairedFigure {
        PairedFigure::new(value, without.to_vec())
    }

    fn found(uniformity: PairedFigure) -> SetupFigures {
        let place = TraceId { design: "D1".to_owned(), model: "hybrid_10um".to_owned() };
        let figures = vec![("uniformity".to_owned(), uniformity)];
        SetupFigures::from([(place, figures)])
    }

    #[test]
    fn misfits_are_in_units_of_the_scales() {
        let table = toml::from_str("[D1.hybrid_10um]\nuniformity = 0.75").expect("valid");
        let targets = Targets::new(&table, &BTreeMap::new()).expect("valid");
        let of = |found: &SetupFigures| misfit(found, found, &targets);
        let third = of(&found(figure(0.79, &[0.79, 0.80, 0.78]))).expect("a target");
        let estimate = third.estimate();
        assert!((estimate.value - 2.0).abs() < 1e-12);
        // √((3-1)/3 · 2 · 0.5²) of misses 2, 2.5 and 1.5.
        assert!((estimate.standard_error - (1.0f64 / 3.0).sqrt()).abs() < 1e-12);
        let one = found(figure(0.79, &[0.79, 0.78]));
        assert_eq!(misfit(&one, &one, &Targets::default()), None);
        // Both vary alike, so that their difference has no error.
        let first = of(&found(figure(0.77, &[0.77, 0.78, 0.76]))).expect("a target");
        let above = third.change(&first);
        assert!((above.value - 1.0).abs() < 1e-12 && above.standard_error < 1e-12);
        assert!(!is_tied(above) && is_tied(first.change(&first)));
        assert!(is_tied(Estimate::new(0.2, 0.1)));
        // A value that jumps where all replicates hold is not told by their scatter.
        let jumped = of(&found(figure(0.83, &[0.77, 0.78, 0.76]))).expect("a target");
        assert!(is_tied(jumped.change(&first)));
        // A peak that is a bin errs by a third of half its width, whatever the replicates say.
        let mut bin = figure(0.79, &[0.79, 0.79, 0.79]);
        bin.entry.interval = Some([0.76, 0.82]);
        let bin = of(&found(bin)).expect("a target").estimate();
        assert!((bin.standard_error - 0.01 / 0.02).abs() < 1e-9, "{bin:?}");
        // Without the figure that the base has there is nothing to rank.
        assert_eq!(misfit(&SetupFigures::new(), &one, &targets), None);
    }

    #[test]
    fn slopes_are_those_of_straight_lines() {
        let figures: Vec<PairedFigure> = [1.0, 2.0, 4.0]
            .iter()
            .map(|x| figure(3.0 * x + 1.0, &[3.1 * x + 1.0, 2.9 * x + 1.0]))
            .collect();
        let points: Vec<(f64, &PairedFigure)> = [1.0, 2.0, 4.0].into_iter().zip(&figures).collect();
        let found = slope(&points).expect("a slope");
        // Jackknife of two: √(½ · 2 · 0.1²).
        assert!((found.value - 3.0).abs() < 1e-12 && (found.standard_error - 0.1).abs() < 1e-12);
        assert!(slope(&points[..1]).is_none());
    }
}
