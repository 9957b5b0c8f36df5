// SPDX-License-Identifier: MIT OR Apache-2.0
//! Flux, mean and extremes over the bins of a receiver, and the points of a display on it.
//!
//! Extremes, their biases and errors: `super::sampled`.

use super::figures::Definition;
use super::figures::receiver::{FLUX, MAX, MEAN, MIN, MIN_TO_MAX, NINE_POINTS, THIRTEEN_POINTS};
use super::illuminance::Grid;
use super::layout::Layout;
use super::sampled::{LevelEstimates, Levels, Sampled};
use super::uniformity;
use super::uniformity_forms::{POINTS, samples};
use super::{Estimate, Grouped};

/// Smallest over largest of all bins, and of the points.
const RATIOS: [Definition; 3] = [MIN_TO_MAX, NINE_POINTS, THIRTEEN_POINTS];

/// Bins of a receiver.
#[derive(Debug, Clone)]
pub struct Bins {
    /// All bins, then nine and thirteen points of a rectangle.
    regions: Vec<Sampled>,
    /// Sum of areas, solid angles or étendues.
    measure: f64,
    /// The smallest of them.
    least: f64,
}

impl Bins {
    /// Bins of these `measures`, of which those of a share above 0 are `counted`; all without.
    pub fn new(measures: &[f64], counted: Option<&[f64]>) -> Self {
        let is_counted = |k: usize| counted.is_none_or(|shares| shares[k] > 0.0);
        let measured = (0..measures.len()).filter(|k| is_counted(*k)).map(|k| measures[k]);
        Self {
            measure: measures.iter().sum(),
            least: measured.fold(f64::INFINITY, f64::min),
            regions: vec![Sampled::densities(measures, is_counted)],
        }
    }

    /// The same with the nine and thirteen points of the rectangle that these bins, all alike, fill
    /// in `columns` and `rows`. `layout` are the LEDs below, and `spot` the diameters of what is
    /// averaged at each point, both in bins from the middle.
    #[must_use]
    pub fn with_points(
        mut self,
        [columns, rows]: [usize; 2],
        layout: &Layout,
        spot: Option<[f64; 2]>,
        counted: Option<&[f64]>,
    ) -> Self {
        let grid = (Grid { columns, rows, bin_mm: 1.0 }, counted);
        let area = [-0.5, 0.5].map(|side| [side * columns as f64, side * rows as f64]);
        let of = |points| Sampled::points(samples(grid, layout, area, (points, spot)));
        self.regions.extend([of(&POINTS[..9]), of(&POINTS)]);
        self
    }

    /// Flux, mean, smallest and largest value, smallest over largest, which dark bins lack (NaN);
    /// the same of the points, where there are some.
    pub fn values(&self, powers: &[f64]) -> Vec<(Definition, f64)> {
        let flux: f64 = powers.iter().sum();
        let levels = self.regions.iter().map(|region| region.levels(powers, f64::NAN));
        let levels: Vec<Levels> = levels.collect();
        let all = [
            (FLUX, flux),
            (MEAN, flux / self.measure),
            (MIN, levels[0].low),
            (MAX, levels[0].high),
        ];
        all.into_iter().chain(RATIOS.into_iter().zip(levels.iter().map(ratio))).collect()
    }

    /// The same with their errors, without their definitions.
    pub fn estimates(&self, powers: &Grouped) -> Vec<Estimate> {
        self.figures(powers).into_iter().map(|(_, estimate)| estimate).collect()
    }

    /// The same with their errors.
    pub fn figures(&self, powers: &Grouped) -> Vec<(Definition, Estimate)> {
        let flux: f64 = powers.total().iter().sum();
        let error = powers.map(|bins| vec![bins.iter().sum()]).standard_errors()[0];
        let levels = LevelEstimates::new(&self.regions, powers);
        let all = [
            (FLUX, Estimate::new(flux, error)),
            (MEAN, Estimate::new(flux / self.measure, error / self.measure)),
            (MIN, levels.estimate(0, |levels| levels.low)),
            (MAX, levels.estimate(0, |levels| levels.high)),
        ];
        // Half of the paths may show no light where all do.
        let of_lit = |levels: &Levels| uniformity::ratio(levels.low, levels.high);
        let ratios = (0..self.regions.len()).map(|region| {
            if flux > 0.0 { levels.share(region, of_lit) } else { Estimate::new(f64::NAN, 0.0) }
        });
        all.into_iter().chain(RATIOS.into_iter().zip(ratios)).collect()
    }

    /// Change of those of [`Bins::values`] that are sums by the power of one path where none arrived.
    pub fn one_path(&self, power: f64) -> [(Definition, f64); 4] {
        let (all, least) = (self.measure, self.least);
        [(FLUX, power), (MEAN, power / all), (MIN, power / least), (MAX, power / least)]
    }
}

/// Smallest over largest value.
fn ratio(levels: &Levels) -> f64 {
    levels.low / levels.high
}

/// The largest value of a map.
pub fn largest(map: &Grouped) -> Estimate {
    Bins::new(&vec![1.0; map.total().len()], None).estimates(map)[3]
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
        let bins = Bins::new(&[1.0, 2.0, 4.0], None);
        let found = bins.estimates(&grouped(&[3.0, 2.0, 16.0], 0.0));
        for (found, expected) in found.iter().zip([21.0, 3.0, 1.0, 4.0, 0.25]) {
            assert!((found.value - expected).abs() < 1e-12, "{found:?} {expected}");
            assert!(found.standard_error < 1e-12, "{found:?}");
        }
        // Nine points that no path has reached beside a bin that some have.
        let mut corner = vec![0.0; 144];
        corner[0] = 1.0;
        let none = Layout::of_places(vec![]);
        let points = Bins::new(&[1.0; 144], None).with_points([12; 2], &none, None, None);
        let ends = points.estimates(&grouped(&corner, 0.0))[5].interval().expect("open");
        assert!(ends[0] <= 0.0 && ends[1] >= 1.0, "{ends:?}");
        let dark = bins.values(&[0.0; 3]);
        assert!(dark[4].1.is_nan() && dark[..4].iter().all(|(_, v)| *v == 0.0), "{dark:?}");
    }

    #[test]
    fn points_of_a_display_are_those_of_the_standard() {
        // Bins of 2 x 1 mm of a field 30 x 12 mm that falls off from the middle: nine points lie at
        // 10 and 4 mm, thirteen at 13.5 and 5.4 mm.
        let at = |k: usize| [(k % 15) as f64 * 2.0 - 14.0, (k / 15) as f64 - 5.5];
        let field = |[x, y]: [f64; 2]| 500.0 - x * x - 3.0 * y * y;
        let powers: Vec<f64> = (0..180).map(|k| field(at(k))).collect();
        let none = Layout::of_places(Vec::new());
        let of = |spot, powers: &[f64]| {
            let bins = Bins::new(&[2.0; 180], None).with_points([15, 12], &none, spot, None);
            bins.values(powers)[5..].iter().map(|(_, value)| *value).collect::<Vec<_>>()
        };
        let expected = [[10.0, 4.0], [13.5, 5.4]].map(|place| field(place) / field([0.0, 0.0]));
        for (found, expected) in of(None, &powers).iter().zip(expected) {
            assert!((found - expected).abs() < 4e-3, "{found} {expected}");
        }
        // Over a disc of radius r the mean of x² is that of its middle and r²/4 more.
        let radius: f64 = 2.0;
        let mean = |place: [f64; 2]| field(place) - radius.powi(2);
        let found = of(Some([radius, 2.0 * radius]), &powers);
        let expected = mean([10.0, 4.0]) / mean([0.0, 0.0]);
        assert!((found[0] - expected).abs() < 4e-3, "{found:?} {expected}");
        // A wave of which all nine points see the crest is read over its whole pitch.
        let wave: Vec<f64> =
            (0..180).map(|k| 2.0 + (std::f64::consts::TAU * at(k)[0] / 10.0).cos()).collect();
        let axes = (0..6).map(|k| [f64::from(k % 3) * 10.0 - 10.0, f64::from(k / 3) * 5.0 - 2.5]);
        let leds = Layout::of_places(axes.collect()).seen_from([0.0; 2], [2.0, 1.0]);
        let bins = Bins::new(&[2.0; 180], None);
        assert!(of(None, &wave)[0] > 0.9);
        assert!(bins.with_points([15, 12], &leds, None, None).values(&wave)[5].1 < 0.5);
    }

    #[test]
    fn noise_biases_extremes_within_their_bound() {
        let even = Bins::new(&[1.0; 100], None);
        let found = even.estimates(&grouped(&[1.0; 100], 0.05));
        for (estimate, expected) in found[1..].iter().zip([1.0; 4]) {
            let bound = 3.0 * estimate.standard_error + estimate.bias_bound.unwrap_or(0.0);
            assert!((estimate.value - expected).abs() < bound, "{estimate:?}");
        }
        // The plain ones are four standard deviations and more apart.
        assert!(found[4].bias_bound.expect("a bound") > 0.05, "{found:?}");
    }
}
