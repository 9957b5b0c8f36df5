// SPDX-License-Identifier: MIT OR Apache-2.0
//! Estimates of sums over bins, with bounds of their bias.

use metrics::hits::with_one_path;
use metrics::{Estimate, JackknifedFigure, without_group};

/// The estimate with this bound of its bias, if there is one.
pub(super) fn biased(estimate: Estimate, bias: f64) -> Estimate {
    if bias > 0.0 { estimate.with_bias(bias) } else { estimate }
}

/// Adds `weight` times a colour.
pub(super) fn add(sum: &mut [f64; 3], value: [f64; 3], weight: f64) {
    (0..3).for_each(|k| sum[k] += weight * value[k]);
}

/// The mean of sums over this number of bins, of which one path adds so much to one.
pub(super) fn figure(mut sums: Vec<f64>, bins: f64, one_path: f64) -> JackknifedFigure {
    for sum in &mut sums {
        *sum /= bins;
    }
    let value = sums.pop().unwrap_or_default();
    let figure = JackknifedFigure::new(value, sums);
    let known = with_one_path(figure.estimate(), one_path / bins);
    JackknifedFigure { standard_error: known.standard_error, ..figure }
}

/// Sums without each group, scaled to all, then the sum of all.
pub(super) fn readings(groups: &[f64]) -> Vec<f64> {
    let total: f64 = groups.iter().sum();
    let without = groups.iter().map(|group| without_group(total, *group, groups.len()));
    without.chain([total]).collect()
}
