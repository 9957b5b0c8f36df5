// SPDX-License-Identifier: MIT OR Apache-2.0
//! Statistics of a figure over samples: shift and scatter without the noise of the traces,
//! quantiles, yield, and what contributes.
//!
//! A sample's value is its true one and the noise of its trace. The variance of the values less the
//! mean of the squared standard errors is that of the true ones. Quantiles are those of the values
//! drawn towards their mean until their variance is the true one.

use nalgebra::{DMatrix, DVector};

use crate::metrics::Estimate;

/// Standard normal number of a two-sided interval of 95 %.
const Z95: f64 = 1.959_963_984_540_054;
/// Blocks of a jackknife over samples.
const BLOCKS: usize = 40;

/// Scatter of one figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// Mean of the samples.
    pub mean: Estimate,
    /// Standard deviation from package to package.
    pub deviation: Estimate,
    /// Mean standard error of the samples' traces.
    pub noise: f64,
    /// Levels and quantiles.
    pub quantiles: Vec<(f64, Estimate)>,
}

/// Levels of the quantiles, and how many deviations of a normal distribution they lie from the
/// mean.
const LEVELS: [(f64, f64); 3] = [(0.05, 1.645), (0.5, 0.0), (0.95, 1.645)];

/// Mean, deviation and quantiles of `values`; none of fewer than two.
pub fn scatter(values: &[Estimate]) -> Option<Scatter> {
    if values.len() < 2 {
        return None;
    }
    let whole = plain(values);
    let blocks = BLOCKS.min(values.len());
    let left_out: Vec<Vec<f64>> = (0..blocks)
        .map(|block| {
            let rest = values
                .iter()
                .enumerate()
                .filter(|(k, _)| k % blocks != block);
            plain(&rest.map(|(_, value)| *value).collect::<Vec<_>>())
        })
        .collect();
    let estimate = |place: usize| {
        let without: Vec<f64> = left_out.iter().map(|row| row[place]).collect();
        Estimate::new(whole[place], crate::metrics::spread(&without))
    };
    let squares: f64 = values.iter().map(|v| v.standard_error.powi(2)).sum();
    let mean = estimate(0);
    let deviation = estimate(1).sqrt();
    // A scatter that is not seen hides what it could be from the jackknife.
    let quantiles = LEVELS.into_iter().zip((2..).map(estimate));
    let quantiles = quantiles.map(|((level, deviations), found)| {
        let hidden = deviations * deviation.standard_error;
        let error = found.standard_error.max(mean.standard_error.hypot(hidden));
        (level, Estimate::new(found.value, error))
    });
    Some(Scatter {
        mean,
        deviation,
        noise: (squares / values.len() as f64).sqrt(),
        quantiles: quantiles.collect(),
    })
}

/// Mean, variance without noise, quantiles.
fn plain(values: &[Estimate]) -> Vec<f64> {
    let (mean, variance, sorted) = without_noise(values);
    let quantiles = LEVELS.map(|(level, _)| quantile(&sorted, level));
    [mean, variance].into_iter().chain(quantiles).collect()
}

/// Mean, variance without noise (below 0 where that is larger), and the values drawn towards the mean until their deviation is
/// that, ascending.
pub fn without_noise(values: &[Estimate]) -> (f64, f64, Vec<f64>) {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| v.value).sum::<f64>() / n;
    let total = values.iter().map(|v| (v.value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let noise = values.iter().map(|v| v.standard_error.powi(2)).sum::<f64>() / n;
    let variance = total - noise;
    let drawn = if total > 0.0 {
        (variance.max(0.0) / total).sqrt()
    } else {
        0.0
    };
    let mut sorted: Vec<f64> = values
        .iter()
        .map(|v| mean + drawn * (v.value - mean))
        .collect();
    sorted.sort_by(f64::total_cmp);
    (mean, variance, sorted)
}

/// Quantile of ascending values, straight between them (type 7 of Hyndman and Fan 1996).
fn quantile(sorted: &[f64], level: f64) -> f64 {
    let place = level * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    let share = place - place.floor();
    sorted[below] * (1.0 - share) + sorted[above] * share
}

/// A share of `count` trials with its 95 % interval by Wilson's score (J. Am. Stat. Assoc. 22,
/// 209).
pub fn share(successes: usize, count: usize) -> (f64, [f64; 2]) {
    let (n, p) = (count as f64, successes as f64 / count as f64);
    let z2 = Z95 * Z95;
    let middle = (p + 0.5 * z2 / n) / (1.0 + z2 / n);
    let half = Z95 / (1.0 + z2 / n) * (p * (1.0 - p) / n + 0.25 * z2 / (n * n)).sqrt();
    (p, [(middle - half).max(0.0), (middle + half).min(1.0)])
}

/// Part of the variance from package to package of one group of deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// Number of the tolerance.
    pub tolerance: usize,
    /// Share of the variance of the samples' values less their noise.
    pub share: Estimate,
    /// Change of the figure for one standard deviation of a tolerance with a single deviation.
    pub slope: Option<Estimate>,
}

/// Contributions by linear regression of `values` on `inputs` (a row for each sample, a column for
/// each deviation); `groups` names the tolerance of each column. None where there are too few
/// samples for so many columns. The last one is the share that no straight line explains.
///
/// A squared coefficient is too large by its own variance on average, which is taken off.
pub fn contributions(
    values: &[Estimate],
    inputs: &[Vec<f64>],
    groups: &[usize],
) -> Option<(Vec<Contribution>, Estimate)> {
    let (n, p) = (values.len(), groups.len());
    if n < 2 * (p + 1) || p == 0 {
        return None;
    }
    let scales: Vec<f64> = (0..p)
        .map(|j| {
            let mean = inputs.iter().map(|row| row[j]).sum::<f64>() / n as f64;
            let squares: f64 = inputs.iter().map(|row| (row[j] - mean).powi(2)).sum();
            (squares / (n as f64 - 1.0)).sqrt()
        })
        .collect();
    let design = DMatrix::from_fn(n, p + 1, |i, j| match j {
        0 => 1.0,
        _ if scales[j - 1] > 0.0 => inputs[i][j - 1] / scales[j - 1],
        _ => 0.0,
    });
    let y = DVector::from_fn(n, |i, _| values[i].value);
    let inverse = (design.transpose() * &design).try_inverse()?;
    let coefficients = &inverse * (design.transpose() * &y);
    let residual = &y - &design * &coefficients;
    let left = residual.norm_squared() / (n - p - 1) as f64;
    let variance_of = |j: usize| left * inverse[(j + 1, j + 1)];
    let mean = y.mean();
    let total = y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n as f64 - 1.0);
    let noise = values.iter().map(|v| v.standard_error.powi(2)).sum::<f64>() / n as f64;
    let true_variance = total - noise;
    if true_variance <= 0.0 {
        // Nothing but noise is seen, which no deviation explains.
        return None;
    }
    let last = groups.iter().max()? + 1;
    let of_group = |group: usize| {
        let columns = || (0..p).filter(move |&j| groups[j] == group);
        let (mut sum, mut error) = (0.0, 0.0);
        for j in columns() {
            let (b, v) = (coefficients[j + 1], variance_of(j));
            sum += b * b - v;
            error += 4.0 * b * b * v + 2.0 * v * v;
        }
        let slope = (columns().count() == 1).then(|| columns().next()).flatten();
        Contribution {
            tolerance: group,
            share: Estimate::new(sum / true_variance, error.sqrt() / true_variance),
            slope: slope.map(|j| Estimate::new(coefficients[j + 1], variance_of(j).sqrt())),
        }
    };
    let all: Vec<Contribution> = (0..last).map(of_group).collect();
    let explained: f64 = all.iter().map(|c| c.share.value).sum();
    let error: f64 = all.iter().map(|c| c.share.standard_error.powi(2)).sum();
    let scatter = (2.0 / (n as f64 - 1.0)).sqrt() * total / true_variance;
    let rest = Estimate::new(1.0 - explained, error.sqrt().hypot(scatter));
    Some((all, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal numbers by a counter: (12 uniform numbers - 6) has variance 1.
    fn normal(k: usize) -> f64 {
        let share = |j: usize| {
            let x = crate::stages::seeds::mix((12 * k + j) as u64 + 1);
            (x >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(share).sum::<f64>() - 6.0
    }

    #[test]
    fn noise_of_traces_is_taken_off() {
        // True deviation 0.3 about 2, noise 0.4.
        let values: Vec<Estimate> = (0..4000)
            .map(|k| Estimate::new(2.0 + 0.3 * normal(2 * k) + 0.4 * normal(2 * k + 1), 0.4))
            .collect();
        let found = scatter(&values).expect("two or more");
        let near = |estimate: Estimate, truth: f64| {
            assert!(
                (estimate.value - truth).abs() < 4.0 * estimate.standard_error,
                "{estimate:?} {truth}"
            );
            assert!(estimate.standard_error < 0.05);
        };
        near(found.mean, 2.0);
        near(found.deviation, 0.3);
        // Quantiles of a normal law: mean ± 1.6449 deviations.
        near(found.quantiles[0].1, 2.0 - 1.6449 * 0.3);
        near(found.quantiles[1].1, 2.0);
        near(found.quantiles[2].1, 2.0 + 1.6449 * 0.3);
    }

    /// Packages that are all alike, seen through noise: what scatter there could be is within the
    /// errors.
    #[test]
    fn a_scatter_below_the_noise_is_not_called_none() {
        let values = |k: usize| Estimate::new(2.0 + 0.9 * normal(k), 1.0);
        let found = scatter(&(0..100).map(values).collect::<Vec<_>>()).expect("many");
        let deviation = found.deviation;
        assert!(deviation.value.abs() < 1e-12, "{deviation:?}");
        // The variance of 100 squared noises is known to a seventh.
        let error = deviation.standard_error;
        assert!(error > 0.2 && error < 0.5, "{error}");
        assert!(found.quantiles[0].1.standard_error > 1.6 * error);
    }

    #[test]
    fn intervals_of_shares_are_those_of_the_textbook() {
        // 15 of 20: 0.531 to 0.888 (Agresti, Coull 1998 formula of Wilson's interval).
        let (share, [low, high]) = share(15, 20);
        assert!((share - 0.75).abs() < 1e-15);
        assert!(
            (low - 0.531_3).abs() < 1e-4 && (high - 0.888_1).abs() < 1e-4,
            "{low} {high}"
        );
        let (_, [low, high]) = super::share(0, 50);
        assert!(low.abs() < 1e-12 && (high - 0.071_35).abs() < 1e-4);
    }

    #[test]
    fn regression_shares_the_variance_by_its_causes() {
        // 3 a + b + noise; a and b of variance 1, two columns of b's group act half each.
        let inputs: Vec<Vec<f64>> = (0..3000)
            .map(|k| (0..3).map(|j| normal(5 * k + j)).collect())
            .collect();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let values: Vec<Estimate> = inputs
            .iter()
            .enumerate()
            .map(|(k, x)| Estimate::new(3.0 * x[0] + half * (x[1] + x[2]) + normal(5 * k + 3), 1.0))
            .collect();
        let (found, rest) = contributions(&values, &inputs, &[0, 1, 1]).expect("enough");
        for (contribution, truth) in found.iter().zip([0.9, 0.1]) {
            let share = contribution.share;
            assert!(
                (share.value - truth).abs() < 4.0 * share.standard_error + 0.03,
                "{share:?}"
            );
        }
        let slope = found[0].slope.expect("one column");
        assert!((slope.value - 3.0).abs() < 0.1 && found[1].slope.is_none());
        assert!(rest.value.abs() < 4.0 * rest.standard_error);
        assert!(contributions(&values[..6], &inputs[..6], &[0, 1, 1]).is_none());
    }
}
