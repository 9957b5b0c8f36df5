// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums by groups of paths, and jackknife errors of functions of them.

use rayon::prelude::*;

use super::Estimate;

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
        // New memory is written before it is read: read first, each of its pages would be mapped twice.
        let mut total: Vec<f64> = groups[0].iter().map(|value| 0.0 + value).collect();
        for group in &groups[1..] {
            assert_eq!(group.len(), total.len(), "groups of unequal length");
            for (sum, value) in total.iter_mut().zip(group) {
                *sum += value;
            }
        }
        Self { groups, total }
    }

    /// From readings that each leave out one group, scaled to the total as by [`Grouped::without`], and
    /// that of all groups. Groups of what is no sum are pseudo-values (J. W. Tukey, Ann. Math. Stat. 29
    /// (1958) 614), whose sum is free of bias to first order.
    ///
    /// # Panics
    /// With fewer than two readings without a group or unequal lengths.
    pub fn from_readings(without: &[Vec<f64>], all: &[f64]) -> Self {
        let rest = (without.len() as f64 - 1.0) / without.len() as f64;
        let group = |without: &Vec<f64>| {
            assert_eq!(without.len(), all.len(), "readings of unequal length");
            all.iter().zip(without).map(|(all, without)| all - rest * without).collect()
        };
        Self::new(without.iter().map(group).collect())
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
        let pairs = self.total.iter().zip(&self.groups[g]);
        pairs.map(|(total, group)| without_group(*total, *group, self.count())).collect()
    }

    /// The weighted sum of all parts, group by group: groups of one number are added, so that a
    /// jackknife sees what each group of every part contributes.
    ///
    /// # Panics
    /// Without parts, or with parts of unequal shape.
    pub fn weighted(parts: &[(f64, &Self)]) -> Self {
        let (first, rest) = parts.split_first().expect("at least one part");
        let scaled = |group: &[f64], weight: f64| group.iter().map(|v| weight * v).collect();
        let mut groups: Vec<Vec<f64>> = first.1.groups.iter().map(|g| scaled(g, first.0)).collect();
        for (weight, part) in rest {
            assert_eq!(part.count(), groups.len(), "parts of unequal groups");
            for (sums, group) in groups.iter_mut().zip(&part.groups) {
                assert_eq!(sums.len(), group.len(), "parts of unequal length");
                for (sum, value) in sums.iter_mut().zip(group) {
                    *sum += weight * value;
                }
            }
        }
        Self::new(groups)
    }

    /// [`Grouped::weighted`] of the first `bins` bins, in 1/`together` as many groups: each holds
    /// neighbours of the parts. Where their number is no multiple of that, all groups stay.
    ///
    /// # Panics
    /// As [`Grouped::weighted`].
    pub fn weighted_merged(parts: &[(f64, &Self)], bins: usize, together: usize) -> Self {
        let count = parts.first().expect("at least one part").1.count();
        let is_multiple = count.is_multiple_of(together) && count >= 2 * together;
        let together = if is_multiple { together } else { 1 };
        let of = |group: usize| {
            let mut sums = vec![0.0; bins];
            for (weight, part) in parts {
                assert_eq!(part.count(), count, "parts of unequal groups");
                for values in &part.groups[group * together..(group + 1) * together] {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += weight * value;
                    }
                }
            }
            sums
        };
        Self::new((0..count / together).into_par_iter().map(of).collect())
    }

    /// Adds `other` in place, group by group: the bits of [`Grouped::weighted`] of both with
    /// weights of 1.
    ///
    /// # Panics
    /// If `other` has another shape.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.count(), other.count(), "parts of unequal groups");
        self.total.fill(0.0);
        for (sums, group) in self.groups.iter_mut().zip(&other.groups) {
            assert_eq!(sums.len(), group.len(), "parts of unequal length");
            for ((sum, value), total) in sums.iter_mut().zip(group).zip(&mut self.total) {
                *sum += value;
                *total += *sum;
            }
        }
    }

    /// Applies a linear map to the groups, each of which goes when its image is there, so that old
    /// and new groups are never all in memory.
    #[must_use]
    pub fn into_map(self, f: impl Fn(Vec<f64>) -> Vec<f64> + Sync + Send) -> Self {
        drop(self.total);
        Self::new(self.groups.into_par_iter().map(f).collect())
    }

    /// Total and standard error in every bin of `f`(bin, power), without a copy of the groups: the
    /// bits of [`Grouped::map`], [`Grouped::total`] and [`Grouped::standard_errors`].
    pub fn each(&self, f: impl Fn(usize, f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let n = self.count() as f64;
        let of = |i: usize| {
            let values = || self.groups.iter().map(|group| f(i, group[i]));
            // Starting at 0, as totals do.
            let total = values().fold(0.0, |sum, value| sum + value);
            let mean = total / n;
            let squares: f64 = values().map(|value| (value - mean).powi(2)).sum();
            (total, (squares * n / (n - 1.0)).sqrt())
        };
        (0..self.total.len()).map(of).unzip()
    }

    /// Applies a linear map to every group.
    #[must_use]
    pub fn map(&self, f: impl Fn(&[f64]) -> Vec<f64> + Sync) -> Self {
        Self::new(self.groups.par_iter().map(|g| f(g)).collect())
    }

    /// Standard error of the total in every bin: √(G/(G-1) Σ (x_g - x̄)²).
    pub fn standard_errors(&self) -> Vec<f64> {
        self.each(|_, power| power).1
    }
}

/// The estimate of a sum that all of `count` groups but one give.
pub fn without_group(total: f64, group: f64, count: usize) -> f64 {
    (total - group) * (count as f64 / (count as f64 - 1.0))
}

/// The figure `f` of the totals with its jackknife standard error √((G-1)/G Σ (θ₋g - θ̄)²).
pub fn jackknife(observed: &Grouped, f: impl Fn(&[f64]) -> f64) -> Estimate {
    let left_out: Vec<f64> = (0..observed.count()).map(|g| f(&observed.without(g))).collect();
    Estimate::new(f(observed.total()), spread(&left_out))
}

/// The square of a sum over `count` groups without the noise of the groups: what different groups
/// have in common, from the square of the sum and the sum of the groups' own squares. A product of
/// two vectors counts as a square too. It may lie below 0.
pub fn without_noise(square: f64, of_groups: f64, count: usize) -> f64 {
    let count = count as f64;
    count / (count - 1.0).max(1.0) * (square - of_groups)
}

/// Values apart by no more of their size are equal: what differs is the rounding of sums.
const ROUNDING: f64 = 1e-13;

/// The jackknife standard error of values that each leave out one group; exactly 0 of equal ones.
pub fn spread(left_out: &[f64]) -> f64 {
    let n = left_out.len() as f64;
    let mean = left_out.iter().sum::<f64>() / n;
    if left_out.iter().all(|value| (value - mean).abs() <= ROUNDING * mean.abs()) {
        return 0.0;
    }
    (left_out.iter().map(|v| (v - mean).powi(2)).sum::<f64>() * (n - 1.0) / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_have_no_error() {
        assert!(spread(&[0.1; 64]).abs() <= 0.0);
    }

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
    fn weighted_sums_keep_groups_together() {
        let a = Grouped::new(vec![vec![1.0, 0.0], vec![3.0, 1.0], vec![2.0, 5.0]]);
        let b = Grouped::new(vec![vec![-2.0, 1.0], vec![-6.0, 0.0], vec![-4.0, 2.0]]);
        assert_eq!(Grouped::weighted(&[(1.0, &a)]), a);
        let sum = Grouped::weighted(&[(0.5, &a), (0.25, &b)]);
        assert_eq!(sum.group(1), [0.0, 0.5]);
        assert_eq!(sum.total(), [0.0, 3.75]);
        // What groups of one number have in common cancels: the first bin does not vary.
        assert!(sum.standard_errors()[0].abs() < 1e-15);
    }

    #[test]
    fn what_saves_memory_has_the_bits_of_what_does_not() {
        let mut rng = tracer::random::stream(5, 0);
        let mut draw = || -> Vec<f64> { (0..37).map(|_| tracer::random::unit(&mut rng)).collect() };
        let a = Grouped::new((0..64).map(|_| draw()).collect());
        let b = Grouped::new((0..64).map(|_| draw()).collect());
        let mut sum = a.clone();
        sum.add(&b);
        assert_eq!(sum, Grouped::weighted(&[(1.0, &a), (1.0, &b)]));

        let f = |i: usize, power: f64| 0.37 * power / (1.0 + i as f64);
        let whole = |bins: &[f64]| bins.iter().enumerate().map(|(i, v)| f(i, *v)).collect();
        let mapped = a.map(whole);
        let copied = (mapped.total().to_vec(), mapped.standard_errors());
        assert_eq!(a.each(f), copied);
        assert_eq!(a.into_map(|bins| whole(&bins)), mapped);
    }

    #[test]
    fn readings_without_groups_give_the_groups_back() {
        let mut rng = tracer::random::stream(6, 0);
        let mut draw = || -> Vec<f64> { (0..3).map(|_| tracer::random::unit(&mut rng)).collect() };
        let groups = Grouped::new((0..8).map(|_| draw()).collect());
        let without: Vec<Vec<f64>> = (0..8).map(|g| groups.without(g)).collect();
        let back = Grouped::from_readings(&without, groups.total());
        for g in 0..8 {
            let pairs = back.group(g).iter().zip(groups.group(g));
            assert!(pairs.fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) < 1e-14);
        }
        // The square of a mean lies too high by the variance of the mean, which pseudo-values lack.
        let square = |sums: &[f64]| vec![(sums[0] / 8.0).powi(2)];
        let squares: Vec<Vec<f64>> = without.iter().map(|sums| square(sums)).collect();
        let free = Grouped::from_readings(&squares, &square(groups.total())).total()[0];
        let variance = (groups.standard_errors()[0] / 8.0).powi(2);
        assert!((square(groups.total())[0] - variance - free).abs() < 1e-12);
    }

    #[test]
    fn merged_groups_have_the_same_total_and_the_error_of_fewer() {
        let a = Grouped::new((0..8).map(|k| vec![f64::from(k), 1.0]).collect());
        let merged = Grouped::weighted_merged(&[(0.5, &a), (1.5, &a)], 1, 4);
        assert_eq!((merged.count(), merged.total()), (2, &[56.0][..]));
        assert_eq!([merged.group(0), merged.group(1)], [[12.0], [44.0]]);
        // Four groups of three cannot be.
        assert_eq!(Grouped::weighted_merged(&[(1.0, &a)], 2, 3), a);
    }

    #[test]
    fn squares_of_noise_are_none() {
        // Two groups of one level and opposite noise: 4 L² of the sum, of which the noise adds none.
        let groups = [3.0 + 0.5, 3.0 - 0.5f64];
        let own: f64 = groups.iter().map(|v| v * v).sum();
        let square = groups.iter().sum::<f64>().powi(2);
        assert!((without_noise(square, own, 2) - 4.0 * (9.0 - 0.25)).abs() < 1e-12);
        // Of equal groups the square is that of the sum.
        assert!((without_noise(144.0, 36.0, 4) - 144.0).abs() < 1e-12);
    }

    #[test]
    fn error_of_a_ratio_follows_propagation() {
        // Numerator and denominator vary in step, so the ratio does not vary at all.
        let grouped =
            Grouped::new((1..20).map(|k| vec![f64::from(k), 2.0 * f64::from(k)]).collect());
        let estimate = jackknife(&grouped, |t| t[0] / t[1]);
        assert!((estimate.value - 0.5).abs() < 1e-15);
        // What rounding leaves is no error.
        assert_eq!(estimate.standard_error.to_bits(), 0.0f64.to_bits());
        assert_eq!(spread(&[0.3, 0.1 + 0.2, 0.3, 0.6 - 0.3]).to_bits(), 0.0f64.to_bits());
        assert!(spread(&[0.3, 0.3 + 1e-12]) > 4e-13);
    }
}
