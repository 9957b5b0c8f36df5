// SPDX-License-Identifier: MIT OR Apache-2.0
//! Noise of a generation: whether differences between its candidates are more than errors.

use metrics::spread;

use super::objective::{Constraint, Evaluation};

/// A constraint counts where errors decide it for this share of a generation.
const UNDECIDED: f64 = 0.25;

/// The largest noise of the objective, and of those of `constraints` that errors decide for a
/// quarter of the candidates. Noise is the root mean square of standard errors, each against the
/// mean of the generation, as a share of the standard deviation: 1 where all differences are errors.
pub(super) fn noise(judged: &[Evaluation], constraints: &[Constraint]) -> Option<f64> {
    let values: Vec<Replicated> =
        judged.iter().map(|j| (j.objective.value, &j.objective.without[..])).collect();
    let of_constraints = constraints.iter().filter_map(|constraint| {
        let figures = judged.iter().map(|one| one.figure(&constraint.figure));
        let figures: Vec<_> = figures.collect::<Option<_>>()?;
        let undecided = figures.iter().filter(|f| constraint.is_undecided(&f.entry)).count();
        let counts = undecided as f64 >= UNDECIDED * judged.len() as f64;
        let values: Vec<_> = figures.iter().map(|f| (f.entry.value, &f.without[..])).collect();
        counts.then(|| share_of_errors(&values)).flatten()
    });
    share_of_errors(&values).into_iter().chain(of_constraints).reduce(f64::max)
}

/// A value with what it is without every group of paths.
type Replicated<'a> = (f64, &'a [f64]);

/// Root mean square of the errors of `values` over their standard deviation; none where they do not
/// differ.
fn share_of_errors(values: &[Replicated]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = |of: &dyn Fn(&Replicated) -> f64| values.iter().map(of).sum::<f64>() / n;
    let groups = values.iter().map(|(_, without)| without.len()).min()?;
    let means: Vec<f64> = (0..groups).map(|g| mean(&|one| one.1[g])).collect();
    let squared_error = |(_, without): &Replicated| {
        let pairs = without.iter().zip(&means);
        spread(&pairs.map(|(a, b)| a - b).collect::<Vec<f64>>()).powi(2)
    };
    let middle = mean(&|one| one.0);
    let variance = mean(&|one| (one.0 - middle).powi(2));
    (values.len() > 1 && variance > 0.0).then(|| (mean(&squared_error) / variance).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use metrics::Bounds;
    use results::paired_figure::PairedFigure;

    use crate::paired_sum::PairedSum;

    /// Candidates with an exact objective and a figure of the given value and standard error.
    fn candidates(figures: &[(f64, f64)]) -> Vec<Evaluation> {
        let one = |(k, &(value, error)): (usize, &(f64, f64))| {
            // Two replicates `error` to either side: that standard error. Their signs alternate, so
            // that the mean has none.
            let error = if k % 2 == 0 { error } else { -error };
            let figure = PairedFigure::new(value, vec![value - error, value + error]);
            Evaluation {
                objective: PairedSum {
                    value: k as f64,
                    without: vec![k as f64; 2],
                    ..PairedSum::default()
                },
                miss: 0.0,
                figures: vec![("f".to_owned(), figure)],
            }
        };
        figures.iter().enumerate().map(one).collect()
    }

    fn at_least(bound: f64, margin: f64) -> [Constraint; 1] {
        [Constraint {
            figure: "f".to_owned(),
            bounds: Bounds::new(Some(bound), None).expect("bounds"),
            margin,
        }]
    }

    #[test]
    fn an_exact_objective_leaves_the_noise_of_the_constraints_that_errors_decide() {
        let near = candidates(&[(1.0, 0.1), (1.1, 0.1), (1.2, 0.1), (1.3, 0.1)]);
        assert_eq!(noise(&near, &[]), Some(0.0));
        // Deviation sqrt(0.0125), error 0.1; all but one within an error of 1.1.
        let found = noise(&near, &at_least(1.1, 0.0)).expect("a noise");
        assert!((found - 0.1 / 0.0125f64.sqrt()).abs() < 1e-12, "{found}");
        // Two errors above the bound must be kept: 1.3 stands on the limit of 1.1 + 0.2.
        assert_eq!(noise(&near, &at_least(1.1, 2.0)), Some(found));
        // Far from the bound on either side nothing is undecided.
        assert_eq!(noise(&near, &at_least(0.5, 2.0)), Some(0.0));
        assert_eq!(noise(&near, &at_least(2.0, 2.0)), Some(0.0));
        // One of five is less than a quarter.
        let one = candidates(&[(1.0, 0.1), (2.0, 0.1), (3.0, 0.1), (4.0, 0.1), (5.0, 0.1)]);
        assert_eq!(noise(&one, &at_least(1.0, 0.0)), Some(0.0));
        assert!(noise(&one[..4], &at_least(1.0, 0.0)).is_some_and(|noise| noise > 0.0));
    }

    #[test]
    fn errors_that_candidates_share_are_no_noise() {
        let alike = |shift: f64| Evaluation {
            objective: PairedSum {
                value: shift,
                without: vec![shift - 0.5, shift + 0.5],
                ..PairedSum::default()
            },
            miss: 0.0,
            figures: Vec::new(),
        };
        let noise = noise(&[0.0, 1.0, 2.0].map(alike), &[]).expect("a noise");
        assert!(noise < 1e-12, "{noise}");
    }
}
