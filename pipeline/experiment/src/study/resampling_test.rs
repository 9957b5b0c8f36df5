// SPDX-License-Identifier: MIT OR Apache-2.0
//! Resampling test: could the targets of a study be single runs of a set-up?
//!
//! Published figures are mostly those of one run each, with its noise. The test cuts every trace of
//! a set-up into K short runs. The k-th runs of all traces together form a table such as a paper
//! prints. The distance of a table from the mean of runs is χ² = Σ ((x - mean)/deviation)² over all
//! figures with a target. For a resampled table, mean and deviation are those of the other runs.
//! Where targets are rounded, distances are shortened by the rounding, for resampled tables too. p
//! = (1 + number of resampled tables at least as far off as the targets)/(1 + K).
//!
//! The test assumes nothing of the distribution of runs, nor that figures of one run are
//! independent. Traces of a study share their random numbers, so each trace takes its runs in an
//! order of its own; the number is a mean over many such orders. The same test is made of each
//! trace alone, of the least likely trace of a table, and of each figure over all traces. For a
//! figure, the share of resampled tables at least as near tells whether targets have less noise
//! than single runs.

use serde::Serialize;

use super::targets::Targets;
use super::trace_figures::{SetupFigures, ShortRuns, TraceId};

/// Fewest runs that determine a deviation.
const LEAST: usize = 16;
/// Orders in which runs of different traces are combined.
const ORDERS: usize = 61;

/// Test of the targets against runs of one length.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Paths of a run.
    pub paths: f64,
    /// Runs of each trace.
    pub runs: usize,
    /// Figures compared.
    pub figures: usize,
    /// χ² of the targets; infinite if a figure that never varies misses its target.
    pub chi_square: f64,
    /// Mean χ² of resampled tables, each against the others.
    pub expected: f64,
    /// Share of our own tables at least as far off: (1 + number)/(1 + runs).
    pub p: f64,
    /// Each trace alone.
    pub cases: Vec<TraceComparison>,
    /// Each figure over all traces.
    pub by_figure: Vec<FigureComparison>,
    /// Share of resampled tables whose least likely trace is at least as unlikely as that of the
    /// targets: (1 + number)/(1 + runs).
    #[serde(rename = "p_of_worst_case")]
    pub p_of_worst: f64,
}

/// Test of the targets of one trace against its runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TraceComparison {
    /// Design and model.
    #[serde(flatten)]
    pub place: TraceId,
    /// χ² of its targets.
    pub chi_square: f64,
    /// Share of runs at least as far off: (1 + number)/(1 + runs).
    pub p: f64,
}

/// Test of the targets of one figure against runs of all traces.
#[derive(Debug, Clone, PartialEq, Serialize)]
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

/// One figure of one trace: its runs, its target and the rounding of that.
#[derive(Clone)]
struct FigureSample {
    place: TraceId,
    figure: String,
    values: Vec<f64>,
    target: f64,
    rounding: f64,
}

/// A comparison for every length of run with at least 16 runs.
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

/// Whether two lengths of run are equal.
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

/// χ² of the targets of one trace, and of each of its runs.
struct TraceSums {
    place: TraceId,
    targets: f64,
    own: Vec<f64>,
}

/// The sums of every trace; samples of one trace are adjacent.
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
    columns.chunk_by(|a, b| a.place == b.place).map(of).collect()
}

/// Resampled tables: the number of the run of each trace. In table k of an order, each trace
/// contributes the run a fixed number of steps of its own further on.
fn tables(traces: usize, runs: usize) -> impl Iterator<Item = Vec<usize>> {
    let of = move |order, k| move |trace: usize| (k + (7 + order) * trace) % runs;
    (0..ORDERS)
        .flat_map(move |order| (0..runs).map(move |k| (0..traces).map(of(order, k)).collect()))
}

/// χ² of every resampled table, and of the targets.
fn together(sums: &[TraceSums], runs: usize) -> (Vec<f64>, f64) {
    let of = |table: Vec<usize>| sums.iter().zip(table).map(|(s, k)| s.own[k]).sum();
    let own = tables(sums.len(), runs).map(of).collect();
    (own, sums.iter().map(|s| s.targets).sum())
}

/// (1 + mean number in an order)/(1 + runs), for a number over all orders.
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
    // Number of other runs at least as far off as each run.
    let ranks: Vec<Vec<usize>> =
        sums.iter().map(|s| s.own.iter().map(|&own| far(s, own) - 1).collect()).collect();
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

/// ((value - mean)/deviation)² against `others`, the distance shortened by `rounding`. Without
/// deviation: 0 for their value, infinite for another.
fn square(value: f64, others: &[f64], rounding: f64) -> f64 {
    let count = others.len() as f64;
    let mean = others.iter().sum::<f64>() / count;
    let squares: f64 = others.iter().map(|v| (v - mean).powi(2)).sum();
    let off = ((value - mean).abs() - rounding).max(0.0).powi(2);
    // All equal but for rounding of the sums.
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
        TraceId { design: design.to_owned(), model: "geometric".to_owned() }
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
        let columns: Vec<FigureSample> =
            [1, 2, 4, 5, 8, 10, 11, 13, 16, 17, 19, 20].map(|stride| even(63, stride, 0.9)).into();
        let together = compared(1.0, &columns).expect("runs enough");
        assert_eq!(together.figures, 12);
        assert!(together.p < 0.05, "{together:?}");
        let fair: Vec<FigureSample> =
            columns.into_iter().map(|c| FigureSample { target: c.target - 0.33, ..c }).collect();
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
        let [near, far] = &compared.by_figure[..] else { panic!("{compared:?}") };
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
        // Seven chances to have a run that is the farthest of its 63; of runs so regular some
        // coincide.
        let most = (1.0 + 7.0) / 64.0;
        assert!(all.p_of_worst > 0.5 * most && all.p_of_worst <= most, "{all:?}");
        let sum: f64 = all.cases.iter().map(|case| case.chi_square).sum();
        assert!((sum - all.chi_square).abs() < 1e-12);
    }
}
