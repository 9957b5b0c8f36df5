// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flux, mean and extremes over the bins of a receiver.
//!
//! Extremes, their biases and errors: `super::sampled`.

use super::sampled::{LevelEstimates, Levels, Sampled};
use super::uniformity::ratio;
use super::{Estimate, Grouped};

/// Bins of a receiver.
#[derive(Debug, Clone)]
pub struct Bins {
    region: Sampled,
    /// Sum of areas, solid angles or étendues.
    measure: f64,
    /// The smallest of them.
    least: f64,
}

impl Bins {
    /// Bins of these `measures`, of which none is 0.
    pub fn new(measures: &[f64]) -> Self {
        Self {
            region: Sampled::densities(measures),
            measure: measures.iter().sum(),
            least: measures.iter().copied().fold(f64::INFINITY, f64::min),
        }
    }

    /// Flux, mean, smallest and largest value, smallest over largest, which dark bins lack (NaN).
    pub fn values(&self, powers: &[f64]) -> [f64; 5] {
        let flux: f64 = powers.iter().sum();
        let Levels { low, high, .. } = self.region.levels(powers, f64::NAN);
        [flux, flux / self.measure, low, high, low / high]
    }

    /// The same with their errors.
    pub fn estimates(&self, powers: &Grouped) -> [Estimate; 5] {
        let flux: f64 = powers.total().iter().sum();
        let error = powers.map(|bins| vec![bins.iter().sum()]).standard_errors()[0];
        let levels = LevelEstimates::new(std::slice::from_ref(&self.region), powers);
        // Half of the paths may show no light where all do.
        let of_lit = levels.estimate(0, |levels| ratio(levels.low, levels.high));
        let dark = Estimate::new(f64::NAN, 0.0);
        [
            Estimate::new(flux, error),
            Estimate::new(flux / self.measure, error / self.measure),
            levels.estimate(0, |levels| levels.low),
            levels.estimate(0, |levels| levels.high),
            if flux > 0.0 { of_lit } else { dark },
        ]
    }

    /// Change of each of [`Bins::values`] by the power of one path where none arrived; 0 of the
    /// ratio, which is no sum.
    pub fn one_path(&self, power: f64) -> [f64; 5] {
        let (all, least) = (self.measure, self.least);
        [power, power / all, power / least, power / least, 0.0]
    }
}

/// The largest value of a map.
pub fn largest(map: &Grouped) -> Estimate {
    Bins::new(&vec![1.0; map.total().len()]).estimates(map)[3]
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
        let bins = Bins::new(&[1.0, 2.0, 4.0]);
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
        let even = Bins::new(&[1.0; 100]);
        let found = even.estimates(&grouped(&[1.0; 100], 0.05));
        for (estimate, expected) in found[1..].iter().zip([1.0; 4]) {
            let bound = 3.0 * estimate.standard_error + estimate.bias_bound.unwrap_or(0.0);
            assert!((estimate.value - expected).abs() < bound, "{estimate:?}");
        }
        // The plain ones are four standard deviations and more apart.
        assert!(found[4].bias_bound.expect("a bound") > 0.05, "{found:?}");
    }
}
