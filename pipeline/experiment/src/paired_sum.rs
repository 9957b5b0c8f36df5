// SPDX-License-Identifier: MIT OR Apache-2.0
//! A number made of several figures of a trace, an objective or a misfit, with its jackknife
//! replicates, for differences between traces by the same random numbers.

use serde::{Deserialize, Serialize};

use metrics::{Estimate, spread};
use results::paired_figure::{PairedFigure, above_rounding, jump};

/// A number made of figures, with its errors.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PairedSum {
    /// Value.
    pub value: f64,
    /// Values without each group of paths.
    pub without: Vec<f64>,
    /// Values without each package, where it is taken over tolerances.
    pub without_package: Vec<f64>,
    /// Error that no replicate shows, of bins and of sums that no path reached.
    pub hidden_error: f64,
    /// The same of extremes that are not resolved, which paired traces have in common.
    pub common_error: f64,
}

impl PairedSum {
    /// What `total` makes of the values of `figures`.
    pub fn new(figures: &[&PairedFigure], total: impl Fn(&[f64]) -> f64) -> Self {
        let values: Vec<f64> = figures.iter().map(|figure| figure.entry.value).collect();
        let value = total(&values);
        let groups = figures.iter().map(|figure| figure.without.len()).min().unwrap_or(0);
        let without = |g: usize| total(&figures.iter().map(|f| f.without[g]).collect::<Vec<_>>());
        let moved_by = |k: usize, error: f64| {
            let mut moved = values.clone();
            moved[k] += error;
            (total(&moved) - value).abs()
        };
        let hidden = |is_common: bool| {
            let of_kind = figures.iter().enumerate();
            let of_kind = of_kind.filter(|(_, figure)| figure.hides_a_bias() == is_common);
            let errors = of_kind.map(|(k, figure)| (k, figure.hidden_error()));
            errors.map(|(k, e)| moved_by(k, e).max(moved_by(k, -e))).fold(0.0, f64::hypot)
        };
        Self {
            value,
            without: (0..groups).map(without).collect(),
            without_package: Vec::new(),
            hidden_error: hidden(false),
            common_error: hidden(true),
        }
    }

    /// Standard error by the paths, for the packages that were drawn.
    pub fn standard_error(&self) -> f64 {
        spread(&self.without)
    }

    /// The value with its standard error. That over packages holds the noise of their paths; where
    /// few packages happen to lie near each other, it is no less than the error by paths.
    pub fn estimate(&self) -> Estimate {
        let scatter = self.standard_error().max(of_packages(&self.without_package));
        Estimate::new(self.value, scatter.hypot(self.hidden_error).hypot(self.common_error))
    }

    /// Its difference from `base`, which was judged by the same random numbers; its error is that of
    /// the differences, group by group and package by package, and of a jump that no group contains.
    pub fn change(&self, base: &Self) -> Estimate {
        let size = self.value.abs().max(base.value.abs());
        let value = above_rounding(self.value - base.value, size);
        let by_paths = differences(&self.without, &base.without);
        let by_packages = of_packages(&differences(&self.without_package, &base.without_package));
        let jump = jump(value, &by_paths, size);
        let common = (self.common_error - base.common_error).abs().max(jump / 3f64.sqrt());
        let hidden = self.hidden_error.hypot(base.hidden_error).hypot(common);
        let scatter = above_rounding(spread(&by_paths).max(by_packages), size);
        Estimate::new(value, scatter.hypot(hidden))
    }
}

/// Replicates of the difference of two numbers.
pub fn differences(of: &[f64], base: &[f64]) -> Vec<f64> {
    of.iter().zip(base).map(|(a, b)| a - b).collect()
}

/// Standard error by the packages, 0 without any.
pub fn of_packages(without_package: &[f64]) -> f64 {
    if without_package.is_empty() { 0.0 } else { spread(without_package) }
}
