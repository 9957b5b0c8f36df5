// SPDX-License-Identifier: MIT OR Apache-2.0
//! Default strategy parameters of CMA-ES.
//!
//! Numbers of equations are those of \[Hansen 2016\] N. Hansen, *The CMA evolution strategy: a
//! tutorial*, arXiv:1604.00772.

/// Weights and learning rates of dimension n and population λ (table 1).
#[derive(Debug, Clone)]
pub(super) struct Strategy {
    /// w_i by rank, best first; those of the worse half are negative (49-53).
    pub(super) weights: Vec<f64>,
    /// Number μ of parents.
    pub(super) parents: usize,
    /// μ_eff = 1/Σw², over the positive weights (8).
    pub(super) mu_eff: f64,
    /// Learning rate of the path of the step size (55).
    pub(super) c_sigma: f64,
    /// Damping of the step size (55).
    pub(super) d_sigma: f64,
    /// Learning rate of the path of the covariance (56).
    pub(super) c_c: f64,
    /// Learning rate of the rank-one update (57).
    pub(super) c_1: f64,
    /// Learning rate of the rank-μ update (58).
    pub(super) c_mu: f64,
    /// Expected length of a normal vector.
    pub(super) chi: f64,
}

/// λ = 4 + ⌊3 ln n⌋ (48).
pub(super) fn default_population(dimension: usize) -> usize {
    4 + (3.0 * (dimension as f64).ln()).floor() as usize
}

impl Strategy {
    pub(super) fn new(dimension: usize, population: usize) -> Self {
        let n = dimension as f64;
        let half = f64::midpoint(population as f64, 1.0).ln();
        // (49)
        let raw: Vec<f64> = (1..=population).map(|rank| half - (rank as f64).ln()).collect();
        let parents = population / 2;
        let (better, worse) = raw.split_at(parents);
        let mu_eff = effective(better);
        let c_1 = 2.0 / ((n + 1.3).powi(2) + mu_eff);
        let c_mu = (2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((n + 2.0).powi(2) + mu_eff))
            .min(1.0 - c_1);
        // (50-52): the covariance stays positive definite.
        let negative = (1.0 + c_1 / c_mu)
            .min(1.0 + 2.0 * effective(worse) / (mu_eff + 2.0))
            .min((1.0 - c_1 - c_mu) / (n * c_mu));
        let (positive_sum, negative_sum) = (better.iter().sum::<f64>(), -worse.iter().sum::<f64>());
        // (53)
        let weight = |w: &f64| {
            if *w >= 0.0 { w / positive_sum } else { negative * w / negative_sum }
        };
        let c_sigma = (mu_eff + 2.0) / (n + mu_eff + 5.0);
        Self {
            weights: raw.iter().map(weight).collect(),
            parents,
            mu_eff,
            c_sigma,
            d_sigma: 1.0 + 2.0 * (((mu_eff - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma,
            c_c: (4.0 + mu_eff / n) / (n + 4.0 + 2.0 * mu_eff / n),
            c_1,
            c_mu,
            chi: n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

/// (Σw)²/Σw².
fn effective(weights: &[f64]) -> f64 {
    weights.iter().sum::<f64>().powi(2) / weights.iter().map(|w| w * w).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::{Strategy, default_population};

    /// Attributes of `CMAEvolutionStrategy(10 * [0], 1).sp` of pycma 4.5.0: parents, μ_eff, c_c,
    /// c_1, c_μ, first and last weight, sums of the positive and of the negative ones. Its c_σ is
    /// (μ_eff + 2)/(n + μ_eff + 3), larger than the tutorial's.
    #[test]
    fn defaults_are_those_of_pycma() {
        let s = Strategy::new(10, default_population(10));
        assert_eq!((s.weights.len(), s.parents), (10, 5));
        let sum = |sign: f64| -> f64 {
            let same = |w: &&f64| **w * sign > 0.0;
            s.weights.iter().filter(same).sum()
        };
        for (got, expected) in [
            (s.mu_eff, 3.167_299_281_410_701_7),
            (s.c_c, 0.294_990_383_035_622_25),
            (s.c_1, 0.015_283_824_524_751_714),
            (s.c_mu, 0.023_551_776_650_417_47),
            (s.weights[0], 0.456_272_646_903_405_97),
            (s.weights[9], -0.549_749_917_697_385_4),
            (sum(1.0), 1.0),
            (sum(-1.0), -1.648_945_714_440_647),
        ] {
            assert!((got - expected).abs() < 1e-13, "{got} {expected}");
        }
    }
}
