// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniformity of noisy maps beside the closed form: values, scatter and stated errors over seeds.

use metrics::illuminance::Grid;
use metrics::layout::Layout;
use metrics::uniformity::{MapReading, ValleyReading};
use metrics::uniformity_forms::{RegionForm, Regions};
use metrics::{Estimate, Grouped};
use rayon::prelude::*;
use tracer::random;

const GROUPS: usize = 64;
const SEEDS: u64 = 48;

/// Irradiance of small Lambertian chips `height` mm below the plane: Σ h² / (π (h² + r²)²) per watt.
struct Chips {
    layout: Layout,
    grid: Grid,
    height_mm: f64,
}

impl Chips {
    fn new(side: usize, pitch_mm: f64, height_mm: f64, bin_mm: f64) -> Self {
        let at = |k: usize| (k as f64 - 0.5 * (side as f64 - 1.0)) * pitch_mm;
        let axes = (0..side * side).map(|k| [at(k % side), at(k / side)]).collect();
        let bins = (side as f64 * pitch_mm / bin_mm).round() as usize;
        let grid = Grid { columns: bins, rows: bins, bin_mm };
        Self { layout: Layout::rectangular(axes, side, side, pitch_mm), grid, height_mm }
    }

    fn exact(&self) -> Vec<f64> {
        let of = |bin: usize| -> f64 {
            let [x, y] = self.grid.middle_mm(bin);
            let h2 = self.height_mm * self.height_mm;
            let one = |[a, b]: &[f64; 2]| {
                h2 / (h2 + (x - a).powi(2) + (y - b).powi(2)).powi(2) / std::f64::consts::PI
            };
            self.layout.axes_mm.iter().map(one).sum()
        };
        (0..self.grid.columns * self.grid.rows).map(of).collect()
    }

    /// Counts of `paths` paths of each chip in the bins, by groups, as irradiance per watt.
    fn counted(&self, exact: &[f64], paths: f64, seed: u64) -> Grouped {
        let area = self.grid.bin_mm * self.grid.bin_mm;
        let weight = 1.0 / (paths * area);
        let mut rng = random::stream(seed, 0);
        let groups = (0..GROUPS).map(|_| {
            let counts = exact.iter().map(|e| e * area * paths / GROUPS as f64);
            counts.map(|mean| weight * poisson(mean, || random::unit(&mut rng))).collect()
        });
        Grouped::new(groups.collect())
    }

    fn regions(&self) -> Regions {
        let layout = self.layout.clone();
        Regions::new(&MapReading::new(self.grid, layout, 256.0, ValleyReading::Fit))
    }
}

/// A Poisson count by the product of uniform numbers (Knuth).
fn poisson(mean: f64, mut unit: impl FnMut() -> f64) -> f64 {
    let (limit, mut product, mut count) = ((-mean).exp(), unit(), 0.0);
    while product > limit {
        product *= unit();
        count += 1.0;
    }
    count
}

/// Checks every form over the seeds: its error is never 0, and three errors or the interval in place
/// of one cover the truth; where it is said to be resolved, its scatter is the stated error. The
/// ratio of 48 seeds has a standard error of a tenth: three of them beside 0.8 to 1.25.
fn check(chips: &Chips, paths: f64) {
    let exact = chips.exact();
    let regions = chips.regions();
    let truth = regions.plain(&exact);
    let runs: Vec<Vec<(RegionForm, Estimate)>> = (0..SEEDS)
        .into_par_iter()
        .map(|seed| regions.estimates(&chips.counted(&exact, paths, seed)))
        .collect();
    for (k, (form, truth)) in truth.iter().enumerate() {
        let of: Vec<Estimate> = runs.iter().map(|run| run[k].1).collect();
        let resolved: Vec<&Estimate> = of.iter().filter(|e| e.is_resolved()).collect();
        let covers = |e: &&Estimate| {
            let reach = 3.0 * e.standard_error;
            let [low, high] = e.interval().unwrap_or([e.value - reach, e.value + reach]);
            (low..=high).contains(truth)
        };
        let covered = of.iter().filter(covers).count();
        let what = format!("{} at {paths} paths", form.key);
        assert!(of.iter().all(|e| e.standard_error > 0.0), "{what}");
        assert!(covered as f64 >= 0.9 * of.len() as f64, "{what}: {covered}");
        // Where noise decides whether a figure is resolved, what is resolved holds its errors too.
        let distances = resolved.iter().map(|e| (e.value - truth) / e.standard_error);
        let distance = (distances.map(|d| d * d).sum::<f64>() / resolved.len() as f64).sqrt();
        assert!(resolved.len() < 8 || distance < 1.65, "{what}: {distance} of {}", resolved.len());
        if resolved.len() as f64 > 0.9 * of.len() as f64 {
            let n = resolved.len() as f64;
            let mean = resolved.iter().map(|e| e.value).sum::<f64>() / n;
            let squares = resolved.iter().map(|e| (e.value - mean).powi(2)).sum::<f64>();
            let stated = resolved.iter().map(|e| e.standard_error.powi(2)).sum::<f64>();
            let ratio = (squares / (n - 1.0) / (stated / n)).sqrt();
            assert!((0.55..1.65).contains(&ratio), "{what}: {ratio}");
        }
    }
}

#[test]
#[ignore = "slow: 7 s"]
fn errors_of_four_chips_cover_the_closed_form() {
    let chips = Chips::new(2, 5.0, 3.0, 0.2);
    for paths in [3e2, 2e3, 1e4, 3e4, 1e6] {
        check(&chips, paths);
    }
}

#[test]
#[ignore = "nightly: 4 s"]
fn nightly_errors_of_many_chips_cover_the_closed_form() {
    let chips = Chips::new(7, 5.0, 1.5, 0.25);
    for paths in [2e3, 3e5] {
        check(&chips, paths);
    }
}

#[test]
#[ignore = "nightly: 3 s"]
fn nightly_errors_of_few_paths_in_wide_maps_cover_the_closed_form() {
    let chips = Chips::new(3, 9.0, 6.0, 0.25);
    for paths in [5e2, 2.2e3, 1e4] {
        check(&chips, paths);
    }
}
