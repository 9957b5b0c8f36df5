// SPDX-License-Identifier: MIT OR Apache-2.0
//! Statistical bounds that a correct program exceeds once in a million times.

use metrics::Grouped;

/// Five standard errors: what a single comparison may be off.
pub const SIGMAS: f64 = 5.0;

/// Pearson's statistic of `counts` against the probabilities `expected` (which sum to 1), with its
/// degrees of freedom. Classes that expect fewer than ten are put together.
pub fn chi_square(counts: &[f64], expected: &[f64]) -> (f64, usize) {
    let total: f64 = counts.iter().sum();
    let (mut statistic, mut classes, mut rest) = (0.0, 0, (0.0, 0.0));
    for (count, probability) in counts.iter().zip(expected) {
        let mean = probability * total;
        if mean >= 10.0 {
            statistic += (count - mean).powi(2) / mean;
            classes += 1;
        } else {
            rest = (rest.0 + count, rest.1 + mean);
        }
    }
    if rest.1 > 0.0 {
        statistic += (rest.0 - rest.1).powi(2) / rest.1.max(1.0);
        classes += 1;
    }
    (statistic, classes.max(2) - 1)
}

/// What chi-square with `freedom` degrees of freedom exceeds once in a million times (Wilson and
/// Hilferty 1931).
pub fn chi_square_limit(freedom: usize) -> f64 {
    // The normal deviate of 1e-6.
    let z = 4.753;
    let v = 2.0 / (9.0 * freedom as f64);
    freedom as f64 * (1.0 - v + z * v.sqrt()).powi(3)
}

/// Judges whether two independent observations of the same bins agree within their standard errors;
/// bins whose common error is not above `least` hold too few paths to know it.
///
/// # Panics
/// If no five bins are known so well, or any bin or their mean square is too far off.
pub fn agree(what: &str, a: &Grouped, b: &Grouped, least: f64) {
    let errors = a.standard_errors().into_iter().zip(b.standard_errors());
    let errors: Vec<f64> = errors.map(|(a, b)| a.hypot(b)).collect();
    let bins = a.total().iter().zip(b.total()).zip(&errors);
    let off: Vec<f64> =
        bins.filter(|(_, error)| **error > least).map(|((a, b), error)| (a - b) / error).collect();
    let mean = off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64;
    let most = off.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let bound = 1.0 + 5.0 * (2.0 / off.len() as f64).sqrt();
    assert!(off.len() >= 5 && mean < bound && most < 6.0, "{what}: {mean} of {bound}, {most}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limit_is_exceeded_once_in_a_million() {
        for freedom in [10, 30, 100] {
            // P(χ² > x) = exp(-x/2) Σ (x/2)^j / j!, j below half an even number of degrees of
            // freedom.
            let half = 0.5 * chi_square_limit(freedom);
            let (mut term, mut sum) = (1.0, 0.0);
            for j in 1..=freedom / 2 {
                sum += term;
                term *= half / j as f64;
            }
            let tail = (-half).exp() * sum;
            assert!((0.5e-6..2e-6).contains(&tail), "{freedom}: {tail:e}");
        }
    }

    #[test]
    fn wrong_shares_exceed_the_limit() {
        let expected = [0.2, 0.3, 0.5];
        let (right, freedom) = chi_square(&[2010.0, 2980.0, 5010.0], &expected);
        assert!(right < chi_square_limit(freedom));
        let (wrong, freedom) = chi_square(&[2300.0, 2700.0, 5000.0], &expected);
        assert!(wrong > chi_square_limit(freedom));
    }
}
