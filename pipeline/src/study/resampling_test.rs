// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether the targets of a study could be what single runs read.
//!
//! Published figures are mostly those of one run each, with its noise. Every trace of a set-up is cut into K runs; the k-th run of all
//! traces together is a table such as a paper prints. How far a table is from what runs read on average is told by
//! χ² = Σ ((x - mean)/deviation)² over all figures that have a target. For a table of our own, mean and deviation are those of the other
//! runs. Where targets are rounded, distances up to that count as none and longer ones as so much shorter, in our own tables too. The share of our own tables that lie at least as far off as the targets is then the chance to find targets as far off, if
//! they were single runs of this set-up: (1 + number)/(1 + K). Nothing is assumed of how runs scatter, nor that figures of one run are
//! independent. Traces of a study share their random numbers; the runs of each are taken in an order of its own, so that tables of ours
//! hold independent runs, as published ones do, and the number is the mean over many such orders. The same is told of each trace alone, as a
//! sum over many figures may hide one that no run comes near, and of the least likely trace of a table, as of several one is always the worst;
//! and of one figure over all traces, with the share of our own tables that are as near: targets nearer than single runs would be have less noise than those.

use serde_json::{Value, json};

use super::targets::Targets;
use super::trace_figures::{SetupFigures, ShortRuns, TraceId};

/// Least number of runs that say anything of their scatter.
const LEAST: usize = 16;
/// Ways to put runs of different traces together.
const ORDERS: usize = 61;

/// How the targets compare with single runs of so many paths.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Paths of a run.
    pub paths: f64,
    /// Runs of each trace.
    pub runs: usize,
    /// Figures compared.
    pub figures: usize,
    /// χ² of the targets; infinite if a figure that never varies misses its target.
    pub chi_square: f64,
    /// Mean χ² of our own tables, each against the others.
    pub expected: f64,
    /// Share of our own tables at least as far off: (1 + number)/(1 + runs).
    pub p: f64,
    /// Each trace alone.
    pub cases: Vec<TraceComparison>,
    /// Each figure over all traces.
    pub by_figure: Vec<FigureComparison>,
    /// Share of our own tables in which the least likely trace is at least as unlikely as that of the targets: (1 + number)/(1 + runs).
    pub p_of_worst: f64,
}

/// How the targets of one trace compare with single runs of it.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceComparison {
    /// Design and model.
    pub place: TraceId,
    /// χ² of its targets.
    pub chi_square: f64,
    /// Share of runs at least as far off: (1 + number)/(1 + runs).
    pub p: f64,
}

/// How the targets of one figure compare with single runs of all traces.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureComparison {
    /// Key of the figure.
    pub figure: String,
    /// χ² of its targets.
    pub chi_square: f64,
    /// Share of our own tables at least as far off: (1 + number)/(1 + runs).
    pub p: f64,
    /// Share of our own tables at least as near: (1 + number)/(1 + runs).
    pub p_nearer: f64,
}

impl Comparison {
    /// As in `study.json`.
    pub fn to_json(&self) -> Value {
        // JSON has no infinity: null, if a figure that never varies misses its target.
        let finite = |v: f64| v.is_finite().then_some(v);
        let cases = self.cases.iter().map(|case| {
            json!({
                "design": case.place.design,
                "model": case.place.model,
                "chi_square": finite(case.chi_square),
                "p": case.p,
            })
        });
        let by_figure = self.by_figure.iter().map(|of| {
            json!({
                "figure": of.figure,
                "chi_square": finite(of.chi_square),
                "p": of.p,
                "p_nearer": of.p_nearer,
            })
        });
        json!({
            "paths": self.paths,
            "runs": self.runs,
            "figures": self.figures,
            "chi_square": finite(self.chi_square),
            "expected": finite(self.expected),
            "p": self.p,
            "p_of_worst_case": self.p_of_worst,
            "cases": cases.collect::<Vec<_>>(),
            "by_figure": by_figure.collect::<Vec<_>>(),
        })
    }
}

/// One figure: of which trace, what the runs read, what was published, and by how much that may be rounded.
#[derive(Clone)]
struct FigureSample {
    place: TraceId,
    figure: String,
    values: Vec<f64>,
    target: f64,
    rounding: f64,
}

/// A comparison for every length of run; none for lengths of which there are fewer than 16 runs.
pub fn compare(found: &SetupFigures, targets: &Targets) -> Vec<Comparison> {
    let mut lengths: Vec<f64> = Vec::new();
    for runs in found.values().flat_map(|judged| &judged.short_runs) {
        if !lengths.iter().any(|known| same(*known, runs.paths)) {
            lengths.push(runs.paths);
        }
    }
    let of = |&paths: &f64| compared(paths, &columns(found, targets, paths));
    lengths.iter().filter_map(of).collect()
}

/// Whether two lengths of run are one.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 0.5
}

fn columns(found: &SetupFigures, targets: &Targets, paths: f64) -> Vec<FigureSample> {
    let mut columns = Vec::new();
    for (place, judged) in found {
        let of_length = |runs: &&ShortRuns| same(runs.paths, paths);
        for runs in judged.short_runs.iter().filter(of_length) {
            let target = targets.of(&place.design, &place.model, &runs.figure);
            if let Some((target, _)) = target {
                let rounding = targets.rounding.get(&runs.figure);
                columns.push(FigureSample {
                    place: place.clone(),
                    figure: runs.figure.clone(),
                    values: runs.values.clone(),
                    target,
                    rounding: rounding.copied().unwrap_or(0.0),
                });
            }
        }
    }
    columns
}

/// χ² of the targets of one trace, and of each of its own runs.
struct TraceSums {
    place: TraceId,
    targets: f64,
    own: Vec<f64>,
}

/// The sums of every trace of `columns`, which stand side by side.
fn sums(columns: &[FigureSample], runs: usize) -> Vec<TraceSums> {
    let of = |columns: &[FigureSample]| {
        let target = |c: &FigureSample| square(c.target, &c.values, c.rounding);
        let own = |k: usize| {
            let of = |c: &FigureSample| {
                let mut others = c.values.clone();
                let value = others.remove(k);
                square(value, &others, c.rounding)
            };
            columns.iter().map(of).sum()
        };
        TraceSums {
            place: columns[0].place.clone(),
            targets: columns.iter().map(target).sum(),
            own: (0..runs).map(own).collect(),
        }
    };
    columns
        .chunk_by(|a, b| a.place == b.place)
        .map(of)
        .collect()
}

/// Tables of our own, of every order: of each trace the number of the run that stands in it. The k-th table of an order takes of each trace the run that lies
/// a number of its own further on.
fn tables(traces: usize, runs: usize) -> impl Iterator<Item = Vec<usize>> {
    let of = move |order, k| move |trace: usize| (k + (7 + order) * trace) % runs;
    (0..ORDERS)
        .flat_map(move |order| (0..runs).map(move |k| (0..traces).map(of(order, k)).collect()))
}

/// χ² of every table of our own, and of the targets.
fn together(sums: &[TraceSums], runs: usize) -> (Vec<f64>, f64) {
    let of = |table: Vec<usize>| sums.iter().zip(table).map(|(s, k)| s.own[k]).sum();
    let own = tables(sums.len(), runs).map(of).collect();
    (own, sums.iter().map(|s| s.targets).sum())
}

/// (1 + mean number of an order)/(1 + runs), for so many tables of all orders.
fn share(number: usize, runs: usize) -> f64 {
    (1.0 + number as f64 / ORDERS as f64) / (1.0 + runs as f64)
}

fn compared(paths: f64, columns: &[FigureSample]) -> Option<Comparison> {
    let runs = columns.iter().map(|c| c.values.len()).min()?;
    if runs < LEAST {
        return None;
    }
    let sums = sums(columns, runs);
    let (own, chi_square) = together(&sums, runs);
    let far = |s: &TraceSums, as_far_as: f64| s.own.iter().filter(|own| **own >= as_far_as).count();
    let worst = sums.iter().map(|s| far(s, s.targets)).min()?;
    // How many runs of a trace are as far off as each of them is, itself left out.
    let ranks: Vec<Vec<usize>> = sums
        .iter()
        .map(|s| s.own.iter().map(|&own| far(s, own) - 1).collect())
        .collect();
    let as_bad = |table: &Vec<usize>| ranks.iter().zip(table).any(|(r, &k)| r[k] <= worst);
    let as_bad = tables(sums.len(), runs).filter(as_bad).count();
    let cases = sums.iter().map(|s| TraceComparison {
        place: s.place.clone(),
        chi_square: s.targets,
        p: share(far(s, s.targets) * ORDERS, runs),
    });
    Some(Comparison {
        paths,
        runs,
        figures: columns.len(),
        chi_square,
        expected: sums.iter().flat_map(|s| &s.own).sum::<f64>() / runs as f64,
        p: share(own.iter().filter(|own| **own >= chi_square).count(), runs),
        cases: cases.collect(),
        by_figure: by_figure(columns, runs),
        p_of_worst: share(as_bad, runs),
    })
}

fn by_figure(columns: &[FigureSample], runs: usize) -> Vec<FigureComparison> {
    let mut figures: Vec<&String> = Vec::new();
    for column in columns {
        if !figures.contains(&&column.figure) {
            figures.push(&column.figure);
        }
    }
    let of = |figure: &String| {
        let columns = columns.iter().filter(|c| c.figure == *figure);
        let columns: Vec<FigureSample> = columns.cloned().collect();
        let (own, chi_square) = together(&sums(&columns, runs), runs);
        let count = |within: fn(f64, f64) -> bool| {
            own.iter().filter(|own| within(**own, chi_square)).count()
        };
        FigureComparison {
            figure: figure.clone(),
            chi_square,
            p: share(count(|own, targets| own >= targets), runs),
            p_nearer: share(count(|own, targets| own <= targets), runs),
        }
    };
    figures.into_iter().map(of).collect()
}

/// ((value - mean)/deviation)² against `others`, distances up to `rounding` taken as none and longer ones as so much shorter: 0 for the value
/// that all of them have, infinite for another.
fn square(value: f64, others: &[f64], rounding: f64) -> f64 {
    let count = others.len() as f64;
    let mean = others.iter().sum::<f64>() / count;
    let squares: f64 = others.iter().map(|v| (v - mean).powi(2)).sum();
    let off = ((value - mean).abs() - rounding).max(0.0).powi(2);
    // All alike but for rounding.
    let alike = 1e-24 * mean.powi(2) * count;
    match (squares <= alike, off <= alike) {
        (true, true) => 0.0,
        (true, false) => f64::INFINITY,
        (false, _) => off / (squares / (count - 1.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(design: &str) -> TraceId {
        TraceId {
            design: design.to_owned(),
            model: "geometric".to_owned(),
        }
    }

    /// Runs of one figure that scatter evenly over -1 to 1, in an order that differs with `stride`.
    fn even(count: usize, stride: usize, target: f64) -> FigureSample {
        let at = |k: usize| 2.0 * ((k * stride % count) as f64 + 0.5) / count as f64 - 1.0;
        FigureSample {
            place: place("D1"),
            figure: "uniformity".to_owned(),
            values: (0..count).map(at).collect(),
            target,
            rounding: 0.0,
        }
    }

    #[test]
    fn a_target_within_the_scatter_is_likely_and_one_outside_is_not() {
        let of = |target: f64| compared(1.0, &[even(63, 1, target)]).expect("runs enough");
        // |x| of runs is even over 0 to 1: the share beyond t is 1 - t.
        for target in [0.25, 0.5, 0.75] {
            let p = of(target).p;
            assert!((p - (1.0 - target)).abs() < 0.02, "{target} {p}");
        }
        // Deviation of an even spread is 1/√3.
        assert!((of(0.5).chi_square - 0.75).abs() < 0.03);
        assert!((of(1.5).p - 1.0 / 64.0).abs() < 1e-12);
        assert!((of(0.5).expected - 1.0).abs() < 0.1);
    }

    #[test]
    fn many_figures_are_judged_together() {
        // Each target alone is no farther off than two of five runs; all twelve so is rare.
        let columns: Vec<FigureSample> = [1, 2, 4, 5, 8, 10, 11, 13, 16, 17, 19, 20]
            .map(|stride| even(63, stride, 0.9))
            .into();
        let together = compared(1.0, &columns).expect("runs enough");
        assert_eq!(together.figures, 12);
        assert!(together.p < 0.05, "{together:?}");
        let fair: Vec<FigureSample> = columns
            .into_iter()
            .map(|c| FigureSample {
                target: c.target - 0.33,
                ..c
            })
            .collect();
        assert!(compared(1.0, &fair).expect("runs enough").p > 0.2);
    }

    #[test]
    fn what_never_varies_is_met_or_excluded() {
        let level = |target| FigureSample {
            place: place("D1"),
            figure: "uniformity".to_owned(),
            values: vec![27.5; 20],
            target,
            rounding: 2.5,
        };
        let met = compared(1.0, &[level(27.5), level(30.0)]).expect("runs enough");
        assert!(met.chi_square.abs() < 1e-12 && met.p > 0.999);
        let missed = compared(1.0, &[level(20.0)]).expect("runs enough");
        assert!(missed.chi_square.is_infinite() && missed.p < 0.05);
        let few = FigureSample {
            place: place("D1"),
            figure: "uniformity".to_owned(),
            values: vec![1.0; 15],
            target: 1.0,
            rounding: 0.0,
        };
        assert_eq!(compared(1.0, &[few]), None);
    }

    #[test]
    fn one_figure_is_judged_over_all_traces() {
        let of = |figure: &str, target: f64, stride: usize| FigureSample {
            figure: figure.to_owned(),
            place: place(&format!("D{stride}")),
            ..even(63, stride, target)
        };
        let strides = [1, 2, 4, 5, 8, 10];
        let columns: Vec<FigureSample> = strides
            .iter()
            .flat_map(|&stride| [of("near", 0.02, stride), of("far", 0.95, stride + 9)])
            .collect();
        let compared = compared(1.0, &columns).expect("runs enough");
        let [near, far] = &compared.by_figure[..] else {
            panic!("{compared:?}")
        };
        assert_eq!((&near.figure[..], &far.figure[..]), ("near", "far"));
        assert!(near.p > 0.95 && near.p_nearer < 0.05, "{near:?}");
        assert!(far.p < 0.05 && far.p_nearer > 0.95, "{far:?}");
        let sum = near.chi_square + far.chi_square;
        assert!((sum - compared.chi_square).abs() < 1e-12);
    }

    #[test]
    fn one_case_that_no_run_comes_near_stands_out_of_a_likely_sum() {
        let of = |design: &str, target: f64, stride: usize| FigureSample {
            place: place(design),
            ..even(63, stride, target)
        };
        let quiet = [1, 2, 4, 5, 8, 10].map(|stride| of(&format!("D{stride}"), 0.1, stride));
        let loud = of("loud", 1.3, 11);
        let columns: Vec<FigureSample> = quiet.into_iter().chain([loud]).collect();
        let all = compared(1.0, &columns).expect("runs enough");
        assert!(all.p > 0.3, "{all:?}");
        assert_eq!(all.cases.len(), 7);
        assert!((all.cases[6].p - 1.0 / 64.0).abs() < 1e-12);
        assert!(all.cases[..6].iter().all(|case| case.p > 0.8));
        // Seven chances to have a run that is the farthest of its 63; of runs so regular some coincide.
        let most = (1.0 + 7.0) / 64.0;
        assert!(
            all.p_of_worst > 0.5 * most && all.p_of_worst <= most,
            "{all:?}"
        );
        let sum: f64 = all.cases.iter().map(|case| case.chi_square).sum();
        assert!((sum - all.chi_square).abs() < 1e-12);
    }
}
