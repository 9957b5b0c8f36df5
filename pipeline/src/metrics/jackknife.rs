// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums kept by groups, and the standard error of any function of them.

use serde::Serialize;

/// A figure with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// One standard deviation of the value.
    pub standard_error: f64,
    /// For figures that pick a largest or smallest bin: bound of the bias that picking leaves in the value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bias_bound: Option<f64>,
}

impl Estimate {
    /// A value with its standard error and no selection in it.
    pub fn new(value: f64, standard_error: f64) -> Self {
        Self {
            value,
            standard_error,
            bias_bound: None,
        }
    }
}

/// Additive observations (powers in bins), one vector of equal length for each group of paths.
#[derive(Debug, Clone, PartialEq)]
pub struct Grouped {
    groups: Vec<Vec<f64>>,
    total: Vec<f64>,
}

impl Grouped {
    /// From the groups' vectors.
    ///
    /// # Panics
    /// With fewer than two groups or unequal lengths.
    pub fn new(groups: Vec<Vec<f64>>) -> Self {
        assert!(groups.len() >= 2, "a jackknife needs two groups");
        let mut total = vec![0.0; groups[0].len()];
        for group in &groups {
            assert_eq!(group.len(), total.len(), "groups of unequal length");
            for (sum, value) in total.iter_mut().zip(group) {
                *sum += value;
            }
        }
        Self { groups, total }
    }

    /// Number of groups.
    pub fn count(&self) -> usize {
        self.groups.len()
    }

    /// Observations of group `g`.
    pub fn group(&self, g: usize) -> &[f64] {
        &self.groups[g]
    }

    /// Sum over all groups.
    pub fn total(&self) -> &[f64] {
        &self.total
    }

    /// The estimate of the total that all groups but `g` give.
    pub fn without(&self, g: usize) -> Vec<f64> {
        let scale = self.count() as f64 / (self.count() as f64 - 1.0);
        self.total
            .iter()
            .zip(&self.groups[g])
            .map(|(t, v)| (t - v) * scale)
            .collect()
    }

    /// The estimates of the total that the halves of the groups give, for the `split`-th of many ways to halve them: group g goes to
    /// one half or the other by the parity of the common bits of g and `split` (a Walsh code), `split` from 1.
    pub fn halves(&self, split: usize) -> [Vec<f64>; 2] {
        let mut sums = [vec![0.0; self.total.len()], vec![0.0; self.total.len()]];
        let mut counts = [0usize; 2];
        for (g, group) in self.groups.iter().enumerate() {
            let half = ((g & split).count_ones() % 2) as usize;
            counts[half] += 1;
            for (sum, value) in sums[half].iter_mut().zip(group) {
                *sum += value;
            }
        }
        for (sum, count) in sums.iter_mut().zip(counts) {
            let scale = self.count() as f64 / count.max(1) as f64;
            for v in sum {
                *v *= scale;
            }
        }
        sums
    }

    /// Applies a linear map to every group.
    #[must_use]
    pub fn map(&self, f: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self::new(self.groups.iter().map(|g| f(g)).collect())
    }

    /// Standard error of the total in every bin: √(G/(G-1) Σ (x_g - x̄)²).
    pub fn standard_errors(&self) -> Vec<f64> {
        let n = self.count() as f64;
        (0..self.total.len())
            .map(|i| {
                let mean = self.total[i] / n;
                let squares: f64 = self.groups.iter().map(|g| (g[i] - mean).powi(2)).sum();
                (squares * n / (n - 1.0)).sqrt()
            })
            .collect()
    }
}

/// The figure `f` of the totals with its jackknife standard error √((G-1)/G Σ (θ₋g - θ̄)²).
pub fn jackknife(observed: &Grouped, f: impl Fn(&[f64]) -> f64) -> Estimate {
    let left_out: Vec<f64> = (0..observed.count())
        .map(|g| f(&observed.without(g)))
        .collect();
    Estimate::new(f(observed.total()), spread(&left_out))
}

/// The jackknife standard error of values that each leave out one group.
pub(super) fn spread(left_out: &[f64]) -> f64 {
    let n = left_out.len() as f64;
    let mean = left_out.iter().sum::<f64>() / n;
    (left_out.iter().map(|v| (v - mean).powi(2)).sum::<f64>() * (n - 1.0) / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_of_a_sum_is_the_textbook_one() {
        let values = [1.0, 4.0, 2.0, 7.0, 3.0];
        let grouped = Grouped::new(values.iter().map(|&v| vec![v]).collect());
        let estimate = jackknife(&grouped, |t| t[0]);
        assert!((estimate.value - 17.0).abs() < 1e-12);
        // Sum of squared deviations 21.2; sample variance 5.3; error of the sum √(5 · 5.3).
        assert!((estimate.standard_error - 26.5f64.sqrt()).abs() < 1e-12);
        assert!((grouped.standard_errors()[0] - estimate.standard_error).abs() < 1e-12);
    }

    #[test]
    fn halves_are_equal_and_differ_from_split_to_split() {
        let grouped = Grouped::new((0..8).map(|g| vec![f64::from(g)]).collect());
        assert_eq!(grouped.halves(1), [vec![24.0], vec![32.0]]);
        assert_eq!(grouped.halves(2), [vec![20.0], vec![36.0]]);
        assert_eq!(grouped.halves(7), [vec![28.0], vec![28.0]]);
    }

    #[test]
    fn error_of_a_ratio_follows_propagation() {
        // Numerator and denominator vary in step, so the ratio does not vary at all.
        let grouped = Grouped::new(
            (1..20)
                .map(|k| vec![f64::from(k), 2.0 * f64::from(k)])
                .collect(),
        );
        let estimate = jackknife(&grouped, |t| t[0] / t[1]);
        assert!((estimate.value - 0.5).abs() < 1e-15 && estimate.standard_error < 1e-14);
    }
}
