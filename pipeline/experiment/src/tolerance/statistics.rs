// SPDX-License-Identifier: MIT OR Apache-2.0
//! Statistics of a figure over samples: shift and scatter without the noise of the traces,
//! quantiles, yield, and what contributes.
//!
//! A sample's value is its true one and the noise of its trace. The variance of the values less the
//! mean of the squared standard errors is that of the true ones. Quantiles are those of the values
//! drawn towards their mean until their variance is the true one.

use nalgebra::{DMatrix, DVector};

use metrics::Estimate;

use super::compute::NoisyValues;

/// Standard normal number of a two-sided interval of 95 %.
const Z95: f64 = 1.959_963_984_540_054;
/// Standard normal number that 95 % of draws stay below.
const Z95_ONE_SIDED: f64 = 1.644_853_626_951_472;
/// A scatter is resolved where the variance of the values is above what pure noise reaches as often as
/// a normal number lies so many deviations above its mean.
const SEEN: f64 = 2.0;
/// Blocks of a jackknife over samples.
const BLOCKS: usize = 40;

/// Scatter of one figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// Mean of the samples.
    pub mean: Estimate,
    /// Standard deviation from package to package.
    pub deviation: Estimate,
    /// Upper bound of the deviation, at 95 % confidence, where it is not seen above the noise.
    pub below: Option<f64>,
    /// Root mean square error of the samples' traces.
    pub noise: f64,
    /// Levels and quantiles.
    pub quantiles: Vec<(f64, Estimate)>,
}

/// Levels of the quantiles, and how many deviations of a normal distribution they lie from the
/// mean.
const LEVELS: [(f64, f64); 3] = [(0.05, 1.645), (0.5, 0.0), (0.95, 1.645)];

/// Mean, deviation and quantiles of `values`; none of fewer than two.
pub fn scatter(NoisyValues { values, freedoms }: &NoisyValues) -> Option<Scatter> {
    if values.len() < 2 {
        return None;
    }
    let whole = plain(values);
    let blocks = BLOCKS.min(values.len());
    let squares: f64 = values.iter().map(|v| v.standard_error.powi(2)).sum();
    let left_out: Vec<Vec<f64>> = (0..blocks)
        .map(|block| {
            let rest = values.iter().enumerate().filter(|(k, _)| k % blocks != block);
            plain(&rest.map(|(_, value)| *value).collect::<Vec<_>>())
        })
        .collect();
    let estimate = |place: usize| {
        let without: Vec<f64> = left_out.iter().map(|row| row[place]).collect();
        Estimate::new(whole[place], metrics::spread(&without))
    };
    let mut mean = estimate(0);
    let (variance, noise) = (whole[1], squares / values.len() as f64);
    // Relative deviation of a variance of normal values.
    let of_noise = freedoms.map_or(0.0, |freedoms| noise * (2.0 / freedoms).sqrt());
    let deviation = estimate(1).with_error(of_noise).sqrt();
    let ratio = |z: f64| variance_ratio(z, values.len() as f64 - 1.0, *freedoms);
    let total = variance + noise;
    let is_seen = total > noise * ratio(SEEN) || noise == 0.0;
    // Values that happen to lie nearer than their noise bound the scatter no better.
    let mut largest = total.max(noise) / ratio(-Z95_ONE_SIDED) - noise;
    if total <= 0.0 {
        // All in one bin, or none seen: within half a bin, or what no path reached.
        largest = 3.0 * noise;
        mean.standard_error = (noise / values.len() as f64).sqrt();
    }
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
        below: (!is_seen).then(|| largest.sqrt()),
        noise: noise.sqrt(),
        quantiles: quantiles.collect(),
    })
}

/// Quantile of the ratio of two variances of one normal law, of n degrees of freedom over m, at a
/// standard normal number z (Paulson 1942); without m the second is exact.
fn variance_ratio(z: f64, n: f64, m: Option<f64>) -> f64 {
    let [a, b] = [2.0 / (9.0 * n), m.map_or(0.0, |m| 2.0 / (9.0 * m))];
    // Of the cube root x of the ratio, ((1 - b) x - (1 - a)) / √(b x² + a) is a normal number.
    let (square, product) = ((1.0 - b).powi(2) - z * z * b, (1.0 - a) * (1.0 - b));
    let constant = (1.0 - a).powi(2) - z * z * a;
    let root = (product * product - square * constant).max(0.0).sqrt();
    ((product + root.copysign(z)) / square).powi(3)
}

/// Mean, variance without noise, quantiles.
fn plain(values: &[Estimate]) -> Vec<f64> {
    let (mean, variance, sorted) = without_noise(values);
    let quantiles = LEVELS.map(|(level, _)| quantile(&sorted, level));
    [mean, variance].into_iter().chain(quantiles).collect()
}

/// Mean, variance without noise, and the values without noise, ascending. The variance is below 0
/// where that of the values is less than that of their noise; the values are then all the mean.
pub fn without_noise(values: &[Estimate]) -> (f64, f64, Vec<f64>) {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| v.value).sum::<f64>() / n;
    let total = values.iter().map(|v| (v.value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let noise = values.iter().map(|v| v.standard_error.powi(2)).sum::<f64>() / n;
    let variance = total - noise;
    let drawn = if total > 0.0 { (variance.max(0.0) / total).sqrt() } else { 0.0 };
    let mut sorted: Vec<f64> = values.iter().map(|v| mean + drawn * (v.value - mean)).collect();
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
    /// Share of the variance of the samples' values less their noise. Below 0 where the group acts
    /// against others that it is correlated with.
    pub share: Estimate,
    /// Change of the figure for one standard deviation of a tolerance with a single deviation.
    pub slope: Option<Estimate>,
}

/// Contributions by linear regression of `values` on `inputs` (a row for each sample, a column for
/// each deviation); `groups` names the tolerance of each column. None where there are too few
/// samples for so many columns. The last one is the share that no straight line explains; all
/// shares sum to 1.
///
/// Errors are jackknifes over blocks of samples.
pub fn contributions(
    values: &[Estimate],
    inputs: &[Vec<f64>],
    groups: &[usize],
) -> Option<(Vec<Contribution>, Estimate)> {
    let (n, p) = (values.len(), groups.len());
    if n < 2 * (p + 1) || p == 0 {
        return None;
    }
    let count = BLOCKS.min(n);
    let centre = centre(values, inputs);
    let mut blocks = vec![Moments::none(p); count];
    for (k, (value, row)) in values.iter().zip(inputs).enumerate() {
        blocks[k % count].add(*value, row, &centre);
    }
    let all = blocks.iter().fold(Moments::none(p), Moments::plus);
    let whole = all.regression()?;
    // Nothing but noise is seen, which no deviation explains.
    (whole.variance > 0.0).then_some(())?;
    let without: Vec<Regression> =
        blocks.iter().map(|block| all.less(block).regression()).collect::<Option<_>>()?;
    // A ratio x / V errs by (dx - (x / V) dV) / V to first order.
    let share = |part: &dyn Fn(&Regression) -> f64| {
        let value = part(&whole) / whole.variance;
        let changes: Vec<f64> =
            without.iter().map(|one| (part(one) - value * one.variance) / whole.variance).collect();
        Estimate::new(value, metrics::spread(&changes))
    };
    let of_group = |group: usize| {
        let columns: Vec<usize> = (0..p).filter(|&j| groups[j] == group).collect();
        let slope = |j: usize| {
            let left_out: Vec<f64> = without.iter().map(|one| one.coefficients[j]).collect();
            Estimate::new(whole.coefficients[j], metrics::spread(&left_out))
        };
        Contribution {
            tolerance: group,
            share: share(&|one| columns.iter().map(|&j| one.explained[j]).sum()),
            slope: (columns.len() == 1).then(|| slope(columns[0])),
        }
    };
    let last = groups.iter().max()? + 1;
    let rest = share(&|one| one.unexplained);
    Some(((0..last).map(of_group).collect(), rest))
}

/// A linear regression on inputs over their standard deviations.
struct Regression {
    /// Change of the value for one standard deviation of each input.
    coefficients: DVector<f64>,
    /// What each input explains of the variance.
    explained: DVector<f64>,
    /// What is left of it, without noise.
    unexplained: f64,
    /// Variance of the values without noise: the sum of those parts.
    variance: f64,
}

/// Sums of samples from which regressions follow.
#[derive(Clone)]
struct Moments {
    /// Sum of z zᵀ, z = (1, inputs, value), inputs and value less their means over all samples.
    products: DMatrix<f64>,
    /// Sum of the squared errors of the values.
    noise: f64,
}

/// Means of the inputs, and of the values behind them. Sums about them lose no digits.
fn centre(values: &[Estimate], inputs: &[Vec<f64>]) -> Vec<f64> {
    let n = values.len() as f64;
    let columns = inputs.first().map_or(0, Vec::len);
    let of_inputs = (0..columns).map(|j| inputs.iter().map(|row| row[j]).sum::<f64>() / n);
    let of_values = values.iter().map(|v| v.value).sum::<f64>() / n;
    of_inputs.chain([of_values]).collect()
}

impl Moments {
    /// Those of no sample with `inputs` deviations.
    fn none(inputs: usize) -> Self {
        Self { products: DMatrix::zeros(inputs + 2, inputs + 2), noise: 0.0 }
    }

    fn add(&mut self, value: Estimate, inputs: &[f64], centre: &[f64]) {
        let numbers = inputs.iter().chain([&value.value]);
        let centred = numbers.zip(centre).map(|(number, centre)| number - centre);
        let z: Vec<f64> = [1.0].into_iter().chain(centred).collect();
        let z = DVector::from_vec(z);
        self.products.ger(1.0, &z, &z, 1.0);
        self.noise += value.standard_error.powi(2);
    }

    fn plus(mut self, other: &Self) -> Self {
        self.products += &other.products;
        self.noise += other.noise;
        self
    }

    fn less(&self, other: &Self) -> Self {
        Self { products: &self.products - &other.products, noise: self.noise - other.noise }
    }

    /// The regression of these samples; none where inputs do not vary or depend on each other.
    ///
    /// With r the correlations of the inputs, c their covariances with the value and b = r⁻¹ c the
    /// coefficients, the variance that is explained is bᵀ r b, of which `b_j c_j` belongs to
    /// input j. The covariance of b is s² r⁻¹ / (n - 1), s² the variance about the straight lines;
    /// products of coefficients are too large by it on average, which adds s² / (n - 1) to each
    /// part.
    fn regression(&self) -> Option<Regression> {
        let sums = &self.products;
        let (n, p) = (sums[(0, 0)], sums.nrows() - 2);
        let covariance =
            |i: usize, j: usize| (sums[(i, j)] - sums[(0, i)] * sums[(0, j)] / n) / (n - 1.0);
        let scales: Vec<f64> = (1..=p).map(|j| covariance(j, j).sqrt()).collect();
        let correlations =
            DMatrix::from_fn(p, p, |i, j| covariance(i + 1, j + 1) / (scales[i] * scales[j]));
        let with_value = DVector::from_fn(p, |j, _| covariance(j + 1, p + 1) / scales[j]);
        let coefficients = correlations.cholesky()?.solve(&with_value);
        let total = covariance(p + 1, p + 1);
        let residual = (total - coefficients.dot(&with_value)) * (n - 1.0);
        let about_lines = residual.max(0.0) / (n - p as f64 - 1.0);
        let noise = self.noise / n;
        let too_large = about_lines / (n - 1.0);
        Some(Regression {
            explained: coefficients.component_mul(&with_value).add_scalar(-too_large),
            unexplained: about_lines - noise,
            variance: total - noise,
            coefficients,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use search::normal::Normal;

    /// Values of which the errors are known exactly.
    fn exact(values: Vec<Estimate>) -> NoisyValues {
        NoisyValues { values, freedoms: None }
    }

    #[test]
    fn noise_of_traces_is_taken_off() {
        // True deviation 0.3 about 2, noise 0.4.
        let mut random = Normal::new(1);
        let mut value = || 2.0 + 0.3 * random.normal() + 0.4 * random.normal();
        let values: Vec<Estimate> = (0..4000).map(|_| Estimate::new(value(), 0.4)).collect();
        let found = scatter(&exact(values)).expect("two or more");
        let near = |estimate: Estimate, truth: f64| {
            assert!(
                (estimate.value - truth).abs() < 4.0 * estimate.standard_error,
                "{estimate:?} {truth}"
            );
            assert!(estimate.standard_error < 0.05);
        };
        near(found.mean, 2.0);
        near(found.deviation, 0.3);
        assert_eq!(found.below, None);
        // Quantiles of a normal law: mean ± 1.6449 deviations.
        near(found.quantiles[0].1, 2.0 - 1.6449 * 0.3);
        near(found.quantiles[1].1, 2.0);
        near(found.quantiles[2].1, 2.0 + 1.6449 * 0.3);
    }

    /// Packages that are all alike, seen through noise: what scatter there could be is within the
    /// errors.
    #[test]
    fn a_scatter_below_the_noise_is_not_called_none() {
        let mut random = Normal::new(1);
        let value = |_| Estimate::new(2.0 + 0.9 * random.normal(), 1.0);
        let found = scatter(&exact((0..100).map(value).collect())).expect("many");
        let deviation = found.deviation;
        assert!(deviation.value.abs() < 1e-12, "{deviation:?}");
        assert!(found.below.is_some_and(|below| below > 0.2 && below < 0.6), "{found:?}");
        // The variance of 100 squared noises is known to a seventh.
        let error = deviation.standard_error;
        assert!(error > 0.2 && error < 0.5, "{error}");
        assert!(found.quantiles[0].1.standard_error > 1.6 * error);
    }

    /// However near the values happen to lie, what could hide in the noise does.
    #[test]
    fn no_bound_of_the_scatter_is_far_below_the_noise() {
        for (count, least) in [(8, 1.4), (30, 0.7), (200, 0.4)] {
            let value = |k: usize| Estimate::new(2.0 + 1e-3 * k as f64 / count as f64, 1.0);
            let values: Vec<Estimate> = (0..count).map(value).collect();
            let below = |freedoms| {
                let found = scatter(&NoisyValues { values: values.clone(), freedoms });
                found.and_then(|found| found.below).expect("not seen")
            };
            let (known, repeated) = (below(None), below(Some(15.0)));
            assert!(known > least && repeated > known, "{known} {repeated}");
        }
    }

    #[test]
    fn ratios_of_variances_are_those_of_the_tables() {
        // Quantiles of F and of χ² over its degrees of freedom at 95 and 5 %.
        for (z, n, m, expected) in [
            (Z95_ONE_SIDED, 10.0, Some(15.0), 2.544),
            (-Z95_ONE_SIDED, 15.0, Some(10.0), 1.0 / 2.544),
            (Z95_ONE_SIDED, 30.0, Some(15.0), 2.247),
            (Z95_ONE_SIDED, 10.0, None, 1.831),
            (-Z95_ONE_SIDED, 7.0, None, 0.3096),
        ] {
            let found = variance_ratio(z, n, m);
            assert!((found / expected - 1.0).abs() < 0.015, "{found} {expected}");
        }
    }

    #[test]
    fn intervals_of_shares_are_those_of_the_textbook() {
        // 15 of 20: 0.531 to 0.888 (Agresti, Coull 1998 formula of Wilson's interval).
        let (share, [low, high]) = share(15, 20);
        assert!((share - 0.75).abs() < 1e-15);
        assert!((low - 0.531_3).abs() < 1e-4 && (high - 0.888_1).abs() < 1e-4, "{low} {high}");
        let (_, [low, high]) = super::share(0, 50);
        assert!(low.abs() < 1e-12 && (high - 0.071_35).abs() < 1e-4);
    }

    /// Whether an estimate lies within 4 of its errors, which are below `most`.
    fn assert_near(estimate: Estimate, truth: f64, most: f64) {
        assert!(
            (estimate.value - truth).abs() < 4.0 * estimate.standard_error
                && estimate.standard_error < most,
            "{estimate:?} {truth}"
        );
    }

    #[test]
    fn regression_shares_the_variance_by_its_causes() {
        // 3 a + b + noise; a and b of variance 1, two columns of b's group act half each.
        let mut random = Normal::new(1);
        let inputs: Vec<Vec<f64>> =
            (0..3000).map(|_| (0..3).map(|_| random.normal()).collect()).collect();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let value = |x: &Vec<f64>| {
            let value = 3.0 * x[0] + half * (x[1] + x[2]) + random.normal();
            Estimate::new(value, 1.0)
        };
        let values: Vec<Estimate> = inputs.iter().map(value).collect();
        let (found, rest) = contributions(&values, &inputs, &[0, 1, 1]).expect("enough");
        assert_near(found[0].share, 0.9, 0.02);
        assert_near(found[1].share, 0.1, 0.02);
        assert_near(found[0].slope.expect("one column"), 3.0, 0.1);
        assert!(found[1].slope.is_none());
        assert_near(rest, 0.0, 0.02);
        assert!(contributions(&values[..6], &inputs[..6], &[0, 1, 1]).is_none());
    }

    /// Of α a + β b with correlation r the part of a is α² + α β r, whatever the noise.
    #[test]
    fn shares_of_correlated_causes_are_those_of_their_covariances() {
        for (alpha, beta, correlation) in [(2.0, 1.0, 0.95), (2.0, -1.0, 0.8), (1.0, 1.0, -0.5)] {
            let mut random = Normal::new(7);
            let independent = f64::sqrt(1.0 - correlation * correlation);
            let inputs: Vec<Vec<f64>> = (0..4000)
                .map(|_| {
                    let a = random.normal();
                    // In another unit, which the shares do not depend on.
                    vec![a, 1e-3 * (correlation * a + independent * random.normal())]
                })
                .collect();
            let both = 2.0 * alpha * beta * correlation;
            let variance = alpha * alpha + beta * beta + both;
            let shares = [alpha, beta].map(|one| (one * one + 0.5 * both) / variance);
            for noise in [0.0, 0.5] {
                let value = |x: &Vec<f64>| {
                    let value = 5.0 + alpha * x[0] + 1e3 * beta * x[1];
                    Estimate::new(value + noise * random.normal(), noise)
                };
                let values: Vec<Estimate> = inputs.iter().map(value).collect();
                let (found, rest) = contributions(&values, &inputs, &[0, 1]).expect("enough");
                assert_near(found[0].share, shares[0], 0.05);
                assert_near(found[1].share, shares[1], 0.05);
                let sum: f64 = found.iter().map(|one| one.share.value).sum();
                assert!((sum + rest.value - 1.0).abs() < 1e-9, "{sum} {rest:?}");
                let error = 4.0 * rest.standard_error + 1e-9;
                assert!(rest.value.abs() < error && error < 0.2, "{rest:?}");
            }
        }
    }

    /// A bend that no straight line follows is what is left.
    #[test]
    fn what_straight_lines_leave_is_the_rest_without_noise() {
        // a + (b² - 1) / 2: variances 1 and 1/2.
        let mut random = Normal::new(3);
        let inputs: Vec<Vec<f64>> =
            (0..4000).map(|_| vec![random.normal(), random.normal()]).collect();
        let value = |x: &Vec<f64>| {
            let value = x[0] + 0.5 * (x[1] * x[1] - 1.0);
            Estimate::new(value + 0.6 * random.normal(), 0.6)
        };
        let values: Vec<Estimate> = inputs.iter().map(value).collect();
        let (found, rest) = contributions(&values, &inputs, &[0, 1]).expect("enough");
        assert_near(found[0].share, 2.0 / 3.0, 0.05);
        assert_near(found[1].share, 0.0, 0.05);
        assert_near(rest, 1.0 / 3.0, 0.05);
    }
}
