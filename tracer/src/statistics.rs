// SPDX-License-Identifier: MIT OR Apache-2.0
//! Means and the jackknife: values in, estimates with standard errors out.
//!
//! A run is cut into G groups of equally many paths, independent of each other. The scatter of the
//! groups gives the error of any mean; for a derived metric (a ratio, the place of a maximum) the
//! jackknife evaluates it on all groups but one, G times: SE² = (G-1)/G Σ (f₋g - mean f₋)².
//! References: [Welford 1962], [Efron, Stein 1981].

/// A result with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value computed from all paths.
    pub value: f64,
    /// Standard error of `value`, same unit.
    pub standard_error: f64,
}

impl Estimate {
    /// Distance from `expected` in standard errors (0/0 counts as 0).
    pub fn deviations_from(&self, expected: f64) -> f64 {
        let difference = (self.value - expected).abs();
        if difference == 0.0 { 0.0 } else { difference / self.standard_error }
    }
}

/// Count, mean and sum of squared deviations of values.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Unbiased variance of one value, 0 for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count < 2 { 0.0 } else { self.squares / (self.count - 1) as f64 }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1) as f64).sqrt()
    }

    /// Mean and standard error together.
    pub fn estimate(&self) -> Estimate {
        Estimate { value: self.mean, standard_error: self.standard_error() }
    }
}

impl FromIterator<f64> for Moments {
    /// Adds one value after the other [Welford 1962].
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut all = Self::default();
        for value in values {
            all.count += 1;
            let before = value - all.mean;
            all.mean += before / all.count as f64;
            all.squares += before * (value - all.mean);
        }
        all
    }
}

/// The jackknife estimate of a metric: `whole` from all groups, `left_out[g]` from all groups but
/// g.
pub fn jackknife(whole: f64, left_out: &[f64]) -> Estimate {
    let groups = left_out.len() as f64;
    let moments: Moments = left_out.iter().copied().collect();
    Estimate {
        value: whole,
        standard_error: ((groups - 1.0) / groups * moments.squares).max(0.0).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{stream, unit};

    #[test]
    fn jackknife_of_a_mean_is_its_standard_error() {
        let mut rng = stream(8, 0);
        let values: Vec<f64> = (0..64).map(|_| unit(&mut rng)).collect();
        let moments: Moments = values.iter().copied().collect();
        let sum: f64 = values.iter().sum();
        let left_out: Vec<f64> = values.iter().map(|v| (sum - v) / 63.0).collect();
        let estimate = jackknife(sum / 64.0, &left_out);
        assert!((estimate.standard_error / moments.standard_error() - 1.0).abs() < 1e-10);
    }
}
