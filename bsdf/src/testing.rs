// SPDX-License-Identifier: MIT OR Apache-2.0
//! Statistics for the tests of sampling: chi-square of drawn lobes against listed shares.
//!
//! Cells with fewer than 5 expected draws are pooled; the probability of a chi-square at least as large is the regularised
//! upper incomplete gamma function Q(dof/2, chi²/2); a family of m tests at level α each uses 1 - (1 - α)^(1/m) (Šidák).

use crate::direction::Side;
use crate::scatter::{Polarization, Scatter};
use glam::DVec3;

/// Level of a test in a family of `tests` at overall level 0.01.
pub(crate) fn sidak_level(tests: usize) -> f64 {
    1.0 - (1.0_f64 - 0.01).powf(1.0 / tests as f64)
}

/// What drawing showed.
pub(crate) struct Drawn {
    /// Probability that the draws differ from the listed shares as much as they do or more, if these are right.
    pub p_value: f64,
    /// Draws in directions that are not listed; pooled with the rarest lobes.
    pub unlisted: u64,
}

/// Draws of [`Scatter::sample`] against the shares of [`Scatter::lobes`]. What the shares leave to 1 must come out as `None`.
pub(crate) fn draw(
    surface: &impl Scatter,
    wi: DVec3,
    draws: usize,
    rng: &mut dyn rand::Rng,
) -> Drawn {
    let lobes = surface.lobes(wi, Polarization::Unpolarized);
    let mut counts = vec![0_u64; lobes.len() + 1];
    let mut unlisted = 0;
    for _ in 0..draws {
        let cell = surface.sample(wi, rng).map_or(Some(lobes.len()), |sample| {
            let side = Side::of(sample.wo);
            lobes
                .iter()
                .position(|l| Side::of(l.wo) == side && (l.wo - sample.wo).length() < 1e-7)
        });
        match cell {
            Some(cell) => counts[cell] += 1,
            None => unlisted += 1,
        }
    }
    let absorbed = 1.0 - lobes.iter().map(|l| l.share).sum::<f64>();
    let shares: Vec<f64> = lobes
        .iter()
        .map(|l| l.share)
        .chain([absorbed.max(0.0)])
        .collect();
    Drawn {
        p_value: chi_square_p_value(&counts, unlisted, &shares, draws),
        unlisted,
    }
}

/// p-value of counts against expected shares; `unlisted` counts belong to the pool of rare cells.
fn chi_square_p_value(counts: &[u64], unlisted: u64, shares: &[f64], draws: usize) -> f64 {
    let (mut chi2, mut cells) = (0.0, 0);
    let mut pool = (unlisted as f64, 0.0);
    let mut add = |observed: f64, expected: f64| {
        chi2 += (observed - expected).powi(2) / expected;
        cells += 1;
    };
    for (count, share) in counts.iter().zip(shares) {
        let (observed, expected) = (*count as f64, share * draws as f64);
        if expected < 5.0 {
            pool = (pool.0 + observed, pool.1 + expected);
        } else {
            add(observed, expected);
        }
    }
    if pool.1 > 0.5 {
        add(pool.0, pool.1);
    } else if pool.0 >= 10.0 {
        return 0.0;
    }
    if cells < 2 {
        1.0
    } else {
        upper_gamma(0.5 * f64::from(cells - 1), 0.5 * chi2)
    }
}

/// Regularised upper incomplete gamma function Q(a, x).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        // Series of the lower function.
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > 1e-16 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - scale * sum
    } else {
        // Continued fraction from its far end.
        let mut fraction = 0.0;
        for n in (1..2000).rev() {
            let n = f64::from(n);
            fraction = n * (n - a) / (x + 2.0 * n + 1.0 - a - fraction);
        }
        scale / (x + 1.0 - a - fraction)
    }
}

/// ln Γ by Stirling's series, shifted to where it is exact.
fn ln_gamma(mut a: f64) -> f64 {
    let mut shift = 0.0;
    while a < 15.0 {
        shift -= a.ln();
        a += 1.0;
    }
    let inverse = 1.0 / a;
    let i2 = inverse * inverse;
    let series = inverse * (1.0 / 12.0 - i2 * (1.0 / 360.0 - i2 * (1.0 / 1260.0 - i2 / 1680.0)));
    shift + (a - 0.5) * a.ln() - a + 0.5 * std::f64::consts::TAU.ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn tail_of_chi_square_agrees_with_closed_forms() {
        // Two degrees of freedom: exp(-x/2). Four: (1 + x/2) exp(-x/2).
        for x in [0.1_f64, 1.0, 5.0, 20.0, 60.0] {
            assert_relative_eq!(
                upper_gamma(1.0, 0.5 * x),
                (-0.5 * x).exp(),
                max_relative = 1e-12
            );
            assert_relative_eq!(
                upper_gamma(2.0, 0.5 * x),
                (1.0 + 0.5 * x) * (-0.5 * x).exp(),
                max_relative = 1e-11
            );
        }
        assert_relative_eq!(
            ln_gamma(0.5),
            std::f64::consts::PI.sqrt().ln(),
            max_relative = 1e-13
        );
    }

    #[test]
    fn wrong_shares_are_found_out() {
        assert!(chi_square_p_value(&[500, 500], 0, &[0.5, 0.5], 1000) > 0.99);
        assert!(chi_square_p_value(&[600, 400], 0, &[0.5, 0.5], 1000) < 1e-9);
        assert!(chi_square_p_value(&[500, 480], 20, &[0.5, 0.5], 1000) < 1e-9);
    }
}
