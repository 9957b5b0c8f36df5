// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flux, mean and extremes over the bins of a receiver.
//!
//! The largest of noisy bins lies too high, the bin that one half of the paths picks, read in the
//! other half, too low; the value is the middle of both, averaged over many halvings, and half
//! their distance bounds its bias. The smallest bin is treated likewise.

use rayon::prelude::*;

use super::jackknife::spread;
use super::{Estimate, Grouped};

/// Bins of a receiver.
#[derive(Debug, Clone, PartialEq)]
pub struct Bins {
    /// Area, solid angle or étendue of each; none is 0.
    measures: Vec<f64>,
}

impl Bins {
    /// Bins of these `measures`.
    pub fn new(measures: Vec<f64>) -> Self {
        Self { measures }
    }

    /// Flux, mean, smallest and largest value, smallest over largest, which dark bins lack (NaN).
    pub fn values(&self, powers: &[f64]) -> [f64; 5] {
        let flux: f64 = powers.iter().sum();
        let [low, high] = self.extremes(powers).map(|bin| self.value(powers, bin));
        [flux, flux / self.measures.iter().sum::<f64>(), low, high, low / high]
    }

    /// The same with their errors.
    pub fn estimates(&self, powers: &Grouped) -> [Estimate; 5] {
        let groups = (0..powers.count()).into_par_iter();
        let without: Vec<[f64; 5]> = groups.map(|g| self.values(&powers.without(g))).collect();
        let values = self.values(powers.total());
        let halvings: Vec<[f64; 2]> = powers
            .halvings()
            .into_par_iter()
            .map(|split| {
                let [a, b] = powers.halves(split);
                let (of_a, of_b) = (self.extremes(&a), self.extremes(&b));
                [0, 1].map(|k| 0.5 * (self.value(&b, of_a[k]) + self.value(&a, of_b[k])))
            })
            .collect();
        let mean = |k: usize| halvings.iter().map(|e| e[k]).sum::<f64>() / halvings.len() as f64;
        let [low, high] = [mean(0), mean(1)];
        let crossed = [None, None, Some(low), Some(high), Some(low / high)];
        std::array::from_fn(|k| {
            let left_out: Vec<f64> = without.iter().map(|values| values[k]).collect();
            let (value, standard_error) = (values[k], spread(&left_out));
            match crossed[k].filter(|crossed| crossed.is_finite()) {
                None => Estimate::new(value, standard_error),
                Some(crossed) => Estimate {
                    value: 0.5 * (value + crossed),
                    standard_error,
                    bias_bound: Some(0.5 * (value - crossed).abs()),
                },
            }
        })
    }

    /// Change of each of [`Bins::values`] by the power of one path where none arrived; 0 of the
    /// ratio, which is no sum.
    pub fn one_path(&self, power: f64) -> [f64; 5] {
        let least = self.measures.iter().copied().fold(f64::INFINITY, f64::min);
        let all: f64 = self.measures.iter().sum();
        [power, power / all, power / least, power / least, 0.0]
    }

    fn value(&self, powers: &[f64], bin: usize) -> f64 {
        powers[bin] / self.measures[bin]
    }

    /// Numbers of the bins of the smallest and the largest value.
    fn extremes(&self, powers: &[f64]) -> [usize; 2] {
        let value = |bin: &usize| self.value(powers, *bin);
        let bins = 0..self.measures.len();
        bins.fold([0; 2], |[low, high], bin| {
            let low = if value(&bin) < value(&low) { bin } else { low };
            [low, if value(&bin) > value(&high) { bin } else { high }]
        })
    }
}

/// The largest value of a map.
pub fn largest(map: &Grouped) -> Estimate {
    Bins::new(vec![1.0; map.total().len()]).estimates(map)[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grouped(bins: &[f64], noise: f64) -> Grouped {
        let mut rng = tracer::random::stream(3, 0);
        let mut normal = || (0..12).map(|_| tracer::random::unit(&mut rng)).sum::<f64>() - 6.0;
        let group = |_| bins.iter().map(|v| v * (1.0 + 8.0 * noise * normal()) / 64.0).collect();
        Grouped::new((0..64).map(group).collect())
    }

    #[test]
    fn mean_and_extremes_are_those_of_power_over_measure() {
        let bins = Bins::new(vec![1.0, 2.0, 4.0]);
        let found = bins.estimates(&grouped(&[3.0, 2.0, 16.0], 0.0));
        for (found, expected) in found.iter().zip([21.0, 3.0, 1.0, 4.0, 0.25]) {
            assert!((found.value - expected).abs() < 1e-12, "{found:?} {expected}");
            assert!(found.standard_error < 1e-12, "{found:?}");
        }
        let dark = bins.values(&[0.0; 3]);
        assert!(dark[4].is_nan() && dark[..4].iter().all(|v| *v == 0.0), "{dark:?}");
    }

    #[test]
    fn noise_biases_extremes_within_their_bound() {
        let even = Bins::new(vec![1.0; 100]);
        let found = even.estimates(&grouped(&[1.0; 100], 0.05));
        for (estimate, expected) in found[1..].iter().zip([1.0; 4]) {
            let bound = 3.0 * estimate.standard_error + estimate.bias_bound.unwrap_or(0.0);
            assert!((estimate.value - expected).abs() < bound, "{estimate:?}");
        }
        // The plain ones are four standard deviations and more apart.
        assert!(found[4].bias_bound.expect("a bound") > 0.05, "{found:?}");
    }
}
