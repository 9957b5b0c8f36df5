// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniformity of the illuminance map: the darkest place between neighbouring LEDs beside the
//! brightest, on a logarithmic scale.
//!
//! By equations 1 to 4 of *Composite Mini-LED Backlight Packaging Structure with High Efficiency and
//! Improved Uniformity*, with L_N = L scaled so that its maximum is `full_scale` (256), L_log =
//! max(0, ln L_N), uniformity = L_log,valley / L_log,peak. With v = L_valley / L_peak this is
//! max(0, 1 + ln v / ln 256), of the map as it is or above its smallest bin ([`above`]).
//! Here are the figures of a single map; [`super::uniformity_forms`] adds their errors.

use super::illuminance::{Grid, largest, smallest};
use super::layout::{Area, Layout};
use super::valley::{Lowest, Valley};
use super::{Estimate, Grouped};

/// How the valley between neighbours is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValleyReading {
    /// Lowest value of a fit to the bins about it.
    Fit,
    /// Smallest of the bins that the segments pass through.
    Bins,
}

impl ValleyReading {
    fn valley(self, grid: Grid, segments: &[[[f64; 2]; 2]], pitch_mm: f64) -> Option<Valley> {
        match self {
            Self::Fit => Valley::fit(grid, segments, pitch_mm),
            Self::Bins => Valley::bins(grid, segments),
        }
    }
}

/// How figures are read from the maps of one design.
#[derive(Debug, Clone)]
pub struct MapReading {
    /// Bins of the maps.
    pub(super) grid: Grid,
    /// LEDs below them.
    pub(super) layout: Layout,
    /// Level that the largest illuminance is scaled to before the logarithm.
    pub(super) full_scale: f64,
    /// Between LEDs next to each other; `None` without any, or with bins too coarse for the fit.
    pub(super) straight: Option<Valley>,
    /// Across the diagonals of four.
    pub(super) diagonal: Option<Valley>,
    /// The area that uniformity is stated of, beside the cell.
    pub(super) area: Option<Area>,
    /// Diameter of the spots that points of cell and area are, mm; `None`: points of the map.
    pub(super) spot_mm: Option<f64>,
    /// The part of each bin that counts; all without.
    pub(super) counted: Option<Vec<f64>>,
}

impl MapReading {
    /// Of maps on `grid` above the LEDs of `layout`, scaled to `full_scale` before the logarithm.
    pub fn new(grid: Grid, layout: Layout, full_scale: f64, reading: ValleyReading) -> Self {
        let valley = |segments: &[_]| reading.valley(grid, segments, layout.pitch_mm);
        let (straight, diagonal) = (valley(&layout.straight()), valley(&layout.diagonal()));
        Self {
            grid,
            layout,
            full_scale,
            straight,
            diagonal,
            area: None,
            spot_mm: None,
            counted: None,
        }
    }

    /// The same with an area, and points that are spots of this diameter.
    #[must_use]
    pub fn with_area(self, area: Option<Area>, spot_mm: Option<f64>) -> Self {
        Self { area, spot_mm, ..self }
    }

    /// The same of bins of which these parts count.
    #[must_use]
    pub fn with_counted(self, counted: Option<Vec<f64>>) -> Self {
        let Some(parts) = &counted else { return self };
        let [straight, diagonal] =
            [self.straight, self.diagonal].map(|valley| valley?.counting(parts));
        Self { straight, diagonal, counted, ..self }
    }

    /// The smallest bin of `map` that counts.
    pub fn smallest(&self, map: &[f64]) -> usize {
        let Some(counted) = &self.counted else {
            return smallest(map).0;
        };
        let bins = map.iter().zip(counted).enumerate().filter(|(_, (_, part))| **part > 0.0);
        let least = bins.min_by(|a, b| a.1.0.total_cmp(b.1.0));
        least.map_or(0, |(bin, _)| bin)
    }

    /// True if the valley between neighbours can be read.
    pub fn has_valley(&self) -> bool {
        self.straight.is_some()
    }

    /// Valleys on the straight segments and on the diagonals. A single row has no diagonal and
    /// repeats the straight valley.
    fn valleys(&self, map: &[f64]) -> Option<[Lowest; 2]> {
        let straight = self.straight.as_ref()?.lowest(map);
        let diagonal = self.diagonal.as_ref();
        let diagonal = diagonal.map_or_else(|| straight.clone(), |valley| valley.lowest(map));
        Some([straight, diagonal])
    }

    /// Where the figures of [`MapReading::plain`] are read on `map`, (x, y) in mm: the valley on the
    /// straight segments and the one on the diagonals, then the middle of the largest bin; `None` as
    /// there.
    pub fn places_mm(&self, map: &[f64]) -> Option<[[f64; 2]; 3]> {
        let [straight, diagonal] = self.valleys(map)?.map(|lowest| lowest.place_mm(self.grid));
        Some([straight, diagonal, self.grid.middle_mm(largest(map).0)])
    }

    /// Uniformity (straight, diagonal) and L_valley / L_peak of one map, with its largest bin as
    /// peak; 0 for a dark map, `None` without neighbours, or with bins too coarse for the fit.
    pub fn plain(&self, map: &[f64]) -> Option<Uniformity<f64>> {
        let peak = largest(map).1;
        let valleys = self.valleys(map)?;
        let [low, corner] = valleys.map(|lowest| ratio(lowest.value(map), peak));
        let on_scale = |v: f64| logarithmic(v, self.full_scale);
        Some(Uniformity {
            straight: on_scale(low),
            diagonal: on_scale(corner),
            valley_to_peak: low,
        })
    }
}

/// Figures of one illuminance map between neighbours, with their errors or without.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Uniformity<T = Estimate> {
    /// Logarithmic, on the straight segments.
    pub straight: T,
    /// Logarithmic, on the diagonals; where there are none, that of the segments.
    pub diagonal: T,
    /// L_valley / L_peak on the straight segments.
    pub valley_to_peak: T,
}

/// A map less its bin `least`.
pub fn above(map: &Grouped, least: usize) -> Grouped {
    map.map(|m| m.iter().map(|l| l - m[least]).collect())
}

/// Valley over peak; 0 where there is no light.
pub(super) fn ratio(valley: f64, peak: f64) -> f64 {
    if peak > 0.0 { valley / peak } else { 0.0 }
}

/// Logarithmic uniformity max(0, 1 + ln v / ln `full_scale`) of v = L_valley / L_peak (equation 4 of the
/// module's source).
pub fn logarithmic(valley_to_peak: f64, full_scale: f64) -> f64 {
    if valley_to_peak <= 0.0 { 0.0 } else { (1.0 + valley_to_peak.ln() / full_scale.ln()).max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::illuminance::{Symmetry, coarser, smoothed};
    use crate::uniformity_forms::Regions;

    fn reading_of(
        grid: Grid,
        layout: &Layout,
        full_scale: f64,
        valley: ValleyReading,
    ) -> MapReading {
        MapReading::new(grid, layout.clone(), full_scale, valley)
    }

    fn uniformity(
        map: &Grouped,
        grid: Grid,
        layout: &Layout,
        full_scale: f64,
        reading: ValleyReading,
    ) -> Option<Uniformity> {
        let reading = reading_of(grid, layout, full_scale, reading);
        let regions = Regions::between_neighbours(&reading);
        Uniformity::of(&regions.estimates(map))
    }

    const GRID: Grid = Grid { columns: 204, rows: 204, bin_mm: 0.1 };
    fn square(side: usize) -> Layout {
        let at = |k: usize| (k as f64 - 0.5 * (side as f64 - 1.0)) * 8.3;
        let axes = (0..side * side).map(|k| [at(k % side), at(k / side)]);
        Layout::rectangular(axes.collect(), side, side, 8.3)
    }

    /// Four Gaussians of width `w` on the LED axes over a floor, scaled by noise of relative size
    /// `noise`.
    fn map(w: f64, floor: f64, noise: f64, groups: usize) -> Grouped {
        let mut state = 1u64;
        let mut normal = || {
            // Sum of twelve uniform numbers, minus six.
            (0..12)
                .map(|_| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1_442_695_040_888_963_407);
                    (state >> 11) as f64 / 9_007_199_254_740_992.0
                })
                .sum::<f64>()
                - 6.0
        };
        let exact: Vec<f64> = (0..GRID.columns * GRID.rows)
            .map(|k| {
                let (x, y) = (
                    GRID.centre_mm(k % GRID.columns, GRID.columns),
                    GRID.centre_mm(k / GRID.columns, GRID.rows),
                );
                let light: f64 = [-4.15f64, 4.15]
                    .iter()
                    .flat_map(|a| {
                        [-4.15f64, 4.15].iter().map(move |b| {
                            (-((x - a).powi(2) + (y - b).powi(2)) / (2.0 * w * w)).exp()
                        })
                    })
                    .sum();
                (light + floor) * 0.01
            })
            .collect();
        Grouped::new(
            (0..groups)
                .map(|_| {
                    exact
                        .iter()
                        .map(|v| {
                            v / groups as f64 * (1.0 + noise * (groups as f64).sqrt() * normal())
                        })
                        .collect()
                })
                .collect(),
        )
    }

    #[test]
    fn quarter_of_the_peak_is_three_quarters_uniform() {
        assert!((logarithmic(0.25, 256.0) - 0.75).abs() < 1e-15);
        assert!((logarithmic(1.0, 256.0) - 1.0).abs() < 1e-15);
        assert!(logarithmic(1.0 / 300.0, 256.0).abs() < 1e-15);
        assert!(logarithmic(0.0, 256.0).abs() < 1e-15);
    }

    #[test]
    fn valley_of_gaussians_is_at_the_middle_of_the_segment() {
        let (w, floor) = (2.0f64, 0.01);
        let u = uniformity(&map(w, floor, 0.0, 4), GRID, &square(2), 256.0, ValleyReading::Fit)
            .expect("neighbours");
        let e = |d2: f64| (-d2 / (2.0 * w * w)).exp();
        let peak = 1.0 + 2.0 * e(8.3 * 8.3) + e(2.0 * 8.3 * 8.3) + floor;
        let middle = 2.0 * e(4.15 * 4.15) + 2.0 * e(4.15f64.powi(2) + 8.3 * 8.3) + floor;
        let centre = 4.0 * e(2.0 * 4.15 * 4.15) + floor;
        assert!((u.straight.value - logarithmic(middle / peak, 256.0)).abs() < 2e-4, "{u:?}");
        assert!((u.diagonal.value - logarithmic(centre / peak, 256.0)).abs() < 5e-4, "{u:?}");
        assert!(u.straight.standard_error < 1e-12);
        let reading = reading_of(GRID, &square(2), 256.0, ValleyReading::Fit);
        let one = map(w, floor, 0.0, 4);
        let plain = reading.plain(one.total()).expect("neighbours");
        assert!((plain.straight - u.straight.value).abs() < 1e-12);
        assert!((plain.diagonal - u.diagonal.value).abs() < 1e-12);
        assert!((plain.valley_to_peak - u.valley_to_peak.value).abs() < 1e-12);
    }

    #[test]
    fn noise_biases_neither_value_beyond_its_error() {
        let noisy = map(2.0, 0.05, 0.04, 64);
        let exact = map(2.0, 0.05, 0.0, 4);
        let smooth = |m: &Grouped| smoothed(m.clone(), GRID, None, Symmetry::Square, 0.1);
        let estimate = uniformity(&smooth(&noisy), GRID, &square(2), 256.0, ValleyReading::Fit)
            .expect("neighbours")
            .straight;
        assert!(
            estimate.bias_bound.expect("a peak is picked") < estimate.standard_error,
            "{estimate:?}"
        );
        let truth = uniformity(&smooth(&exact), GRID, &square(2), 256.0, ValleyReading::Fit)
            .expect("neighbours")
            .straight
            .value;
        assert!(
            (estimate.value - truth).abs() < 3.0 * estimate.standard_error,
            "{estimate:?} against {truth}"
        );
        assert!(estimate.standard_error > 1e-5);
    }

    #[test]
    fn bins_that_are_read_have_the_means_of_the_exact_map() {
        let (w, floor) = (2.0f64, 0.05);
        let (fine, grid) = (map(w, floor, 0.0, 4), coarser(&[], GRID, 6).1);
        let seen = fine.map(|m| coarser(m, GRID, 6).0);
        let read =
            uniformity(&seen, grid, &square(2), 256.0, ValleyReading::Bins).expect("neighbours");
        let mean = |x: f64, y: f64| {
            let part = |k: i32| 0.6 * ((f64::from(k) + 0.5) / 6.0 - 0.5);
            let light = |x: f64, y: f64| -> f64 {
                let near = |v: f64| -> f64 {
                    let at = |a: f64| (-(v - a).powi(2) / (2.0 * w * w)).exp();
                    at(-4.15) + at(4.15)
                };
                near(x) * near(y) + floor
            };
            let sum: f64 = (0..36).map(|k| light(x + part(k % 6), y + part(k / 6))).sum();
            sum / 36.0
        };
        // Bins have their middles at odd multiples of 0.3 mm: 3.9 or 4.5 mm is nearest to an axis,
        // 0.3 mm to the middle of four.
        let peak = mean(3.9, 3.9).max(mean(4.5, 4.5)).max(mean(3.9, 4.5));
        // The segment at y = 4.15 mm passes through bins from 3.6 to 4.2 mm.
        let valley = mean(0.3, 3.9);
        let expected = logarithmic(valley / peak, 256.0);
        assert!((read.straight.value - expected).abs() < 1e-9, "{read:?} {expected}");
        assert!((read.diagonal.value - logarithmic(mean(0.3, 0.3) / peak, 256.0)).abs() < 1e-9);
        let reading = reading_of(grid, &square(2), 256.0, ValleyReading::Bins);
        let plain = reading.plain(seen.total());
        assert!((plain.expect("neighbours").straight - read.straight.value).abs() < 1e-12);
    }

    #[test]
    fn noise_of_read_bins_is_within_error_and_bias_bound() {
        let read = |noise: f64| {
            let seen = map(2.0, 0.05, noise, 64);
            let seen = smoothed(seen, GRID, None, Symmetry::Square, 0.0);
            let seen = seen.map(|m| coarser(m, GRID, 6).0);
            let grid = coarser(&[], GRID, 6).1;
            uniformity(&seen, grid, &square(2), 256.0, ValleyReading::Bins)
                .expect("neighbours")
                .straight
        };
        let (noisy, exact) = (read(0.3), read(0.0));
        let bound = 3.0 * noisy.standard_error + noisy.bias_bound.expect("extremes are picked");
        assert!((noisy.value - exact.value).abs() < bound, "{noisy:?} {exact:?}");
        assert!(noisy.standard_error > 1e-4 && bound < 0.02, "{noisy:?}");
    }

    #[test]
    fn what_is_subtracted_is_the_smallest_bin() {
        let (w, floor) = (2.0f64, 0.05);
        let map = map(w, floor, 0.0, 4);
        let seen = above(&map, smallest(map.total()).0);
        let u = uniformity(&seen, GRID, &square(2), 256.0, ValleyReading::Fit).expect("neighbours");
        // The corner of the map is darkest; with or without a floor the figure is the same.
        let e = |d2: f64| (-d2 / (2.0 * w * w)).exp();
        let corner = GRID.centre_mm(0, GRID.columns).abs();
        let at = |x: f64, y: f64| -> f64 {
            let places = [[-4.15, -4.15], [-4.15, 4.15], [4.15, -4.15], [4.15, 4.15f64]];
            places.iter().map(|[a, b]| e((x - a).powi(2) + (y - b).powi(2))).sum()
        };
        let dark = at(corner, corner);
        let expected = logarithmic((at(0.0, 4.15) - dark) / (at(4.15, 4.15) - dark), 256.0);
        assert!((u.straight.value - expected).abs() < 2e-4, "{u:?} {expected}");
        assert!(seen.total().iter().all(|l| *l >= 0.0));
    }

    #[test]
    fn a_single_package_has_no_uniformity() {
        assert_eq!(
            uniformity(&map(2.0, 0.0, 0.0, 2), GRID, &square(1), 256.0, ValleyReading::Fit),
            None
        );
    }
}
