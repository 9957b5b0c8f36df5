// SPDX-License-Identifier: MIT OR Apache-2.0
//! Quadrature over the quantiles of a spectrum: places between 0 and 1 and their weights.
//!
//! Fejér's second rule with n = 2^k - 1 points: the angles φ_j = jπ/(n+1) give the places (1 - cos
//! φ_j)/2 and the weights (2 sin φ_j/(n+1)) Σ_m sin((2m-1)φ_j)/(2m-1), m = 1..(n+1)/2. Weights are
//! positive and add up to 1, polynomials of degree n are integrated exactly, and the points of one
//! n are among those of the next, so that a finer rule uses all that was computed for a coarser
//! one. References: [Fejér 1933], [Trefethen 2008].

use std::f64::consts::PI;

/// Numbers of points, each rule containing the one before.
pub const COUNTS: [usize; 5] = [1, 3, 7, 15, 31];

/// Places in (0, 1), ascending, and weights of the rule of `count` points, one of [`COUNTS`].
pub fn fejer(count: usize) -> Vec<(f64, f64)> {
    let intervals = count as f64 + 1.0;
    (1..=count)
        .map(|j| {
            let phi = j as f64 * PI / intervals;
            let odd = (0..count.div_ceil(2)).map(|m| (2 * m + 1) as f64);
            let sum: f64 = odd.map(|k| (k * phi).sin() / k).sum();
            // sin² of the half angle is (1 - cos φ)/2 without cancellation.
            ((0.5 * phi).sin().powi(2), 2.0 * phi.sin() / intervals * sum)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_positive_and_polynomials_exact() {
        for count in COUNTS {
            let rule = fejer(count);
            assert!(rule.iter().all(|p| p.1 > 0.0), "{count}");
            for degree in 0..=count {
                let sum: f64 = rule.iter().map(|(u, w)| w * u.powi(degree as i32)).sum();
                let exact = 1.0 / (degree as f64 + 1.0);
                assert!((sum - exact).abs() < 1e-13, "{count} points, u^{degree}: {sum}");
            }
        }
    }

    #[test]
    fn every_rule_contains_the_one_before() {
        for pair in COUNTS.windows(2) {
            let [coarse, fine] = [fejer(pair[0]), fejer(pair[1])];
            for (u, _) in coarse {
                assert!(fine.iter().any(|(v, _)| (u - v).abs() < 1e-15), "{u}");
            }
        }
        // Three points, known in closed form: equal weights at (1 ± √½)/2 and ½.
        let three = fejer(3);
        assert!(three.iter().all(|(_, w)| (w - 1.0 / 3.0).abs() < 1e-15));
        assert!((three[0].0 - 0.5 * (1.0 - 0.5f64.sqrt())).abs() < 1e-15);
    }
}
