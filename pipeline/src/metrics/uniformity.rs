// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniformity: how dark the darkest place between two LEDs looks beside the brightest on the receiver.
//!
//! Equations 1 to 4 of the paper: L_N = L scaled so that its maximum is `full_scale` (256), L_log = max(0, ln L_N),
//! uniformity = L_log,valley / L_log,peak. With v = L_valley / L_peak this is max(0, 1 + ln v / ln 256),
//! of the map as it is or above its smallest bin ([`above_smallest`]).
//!
//! Picking an extreme from noisy bins has a bias. The valley is read from a local fit (`valley`), which leaves none to speak of.
//! The peak is the largest bin, which lies above the true maximum on average; the place that one half of the paths picks, read in the
//! other half, lies below it. The middle of the two, over many ways to halve the paths, is reported as the value and half
//! their distance as the bound of its bias.

use super::illuminance::Grid;
use super::jackknife::spread;
use super::valley::Window;
use super::{Estimate, Grouped};

/// Where LEDs stand, and which of them are next to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Axes (x, y) of the LEDs, mm.
    pub axes_mm: Vec<[f64; 2]>,
    /// Distance of neighbours, mm.
    pub pitch_mm: f64,
    straight: Vec<[usize; 2]>,
    diagonal: Vec<[usize; 2]>,
}

impl Layout {
    /// `columns` × `rows` LEDs, row after row: neighbours stand next to each other along a row or column, or across the diagonal of four.
    pub fn rectangular(axes_mm: Vec<[f64; 2]>, columns: usize, rows: usize, pitch_mm: f64) -> Self {
        let at = |i: usize, j: usize| j * columns + i;
        let (mut straight, mut diagonal) = (Vec::new(), Vec::new());
        for j in 0..rows {
            for i in 0..columns {
                if i + 1 < columns {
                    straight.push([at(i, j), at(i + 1, j)]);
                }
                if j + 1 < rows {
                    straight.push([at(i, j), at(i, j + 1)]);
                }
            }
        }
        for j in 1..rows {
            for i in 1..columns {
                diagonal.push([at(i - 1, j - 1), at(i, j)]);
                diagonal.push([at(i, j - 1), at(i - 1, j)]);
            }
        }
        Self {
            axes_mm,
            pitch_mm,
            straight,
            diagonal,
        }
    }

    /// LEDs anywhere: neighbours are those one pitch apart, within a thousandth. There are no diagonals.
    pub fn by_distance(axes_mm: Vec<[f64; 2]>, pitch_mm: f64) -> Self {
        let near =
            |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) <= pitch_mm * (1.0 + 1e-3);
        let mut order: Vec<usize> = (0..axes_mm.len()).collect();
        order.sort_by(|a, b| axes_mm[*a][0].total_cmp(&axes_mm[*b][0]));
        let mut straight = Vec::new();
        for (k, &a) in order.iter().enumerate() {
            let within = |b: &&usize| axes_mm[**b][0] - axes_mm[a][0] <= pitch_mm * (1.0 + 1e-3);
            for &b in order[k + 1..].iter().take_while(within) {
                if near(axes_mm[a], axes_mm[b]) {
                    straight.push([a.min(b), a.max(b)]);
                }
            }
        }
        straight.sort_unstable();
        Self {
            axes_mm,
            pitch_mm,
            straight,
            diagonal: Vec::new(),
        }
    }

    fn segments(&self, pairs: &[[usize; 2]]) -> Vec<[[f64; 2]; 2]> {
        pairs
            .iter()
            .map(|pair| pair.map(|k| self.axes_mm[k]))
            .collect()
    }

    /// Ends of the segments between LEDs next to each other.
    pub fn straight(&self) -> Vec<[[f64; 2]; 2]> {
        self.segments(&self.straight)
    }

    /// Ends of the segments between diagonal neighbours.
    pub fn diagonal(&self) -> Vec<[[f64; 2]; 2]> {
        self.segments(&self.diagonal)
    }
}

/// The figures of one illuminance map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uniformity {
    /// Valley on the straight segments.
    pub straight: Estimate,
    /// Valley on the diagonals.
    pub diagonal: Estimate,
    /// L_valley / L_peak on the straight segments.
    pub valley_to_peak: Estimate,
}

/// Ways to halve the paths.
const SPLITS: usize = 16;

/// Uniformity of the smoothed map `map` (W/mm² by groups); `None` without neighbours, or with bins too coarse to fit the valley.
pub fn uniformity(
    map: &Grouped,
    grid: Grid,
    layout: &Layout,
    full_scale: f64,
) -> Option<Uniformity> {
    let window =
        |segments: &[[[f64; 2]; 2]]| Window::find(grid, map.total(), segments, layout.pitch_mm);
    let straight = window(&layout.straight())?;
    // A single row has no diagonal; its entry then repeats the straight one.
    let diagonal = window(&layout.diagonal()).unwrap_or_else(|| straight.clone());
    let left_out: Vec<Vec<f64>> = (0..map.count()).map(|g| map.without(g)).collect();
    let peak = Extreme {
        plain: largest(map.total()).1,
        left_out: left_out.iter().map(|m| largest(m).1).collect(),
        crossed: crossed_peak(map),
    };
    let valley = |window: &Window| {
        let plain = window.minimum(map.total());
        Extreme {
            plain,
            left_out: left_out.iter().map(|m| window.minimum(m)).collect(),
            crossed: plain,
        }
    };
    let (low, corner) = (valley(&straight), valley(&diagonal));
    Some(Uniformity {
        straight: combine(&low, &peak, |v| logarithmic(v, full_scale)),
        diagonal: combine(&corner, &peak, |v| logarithmic(v, full_scale)),
        valley_to_peak: combine(&low, &peak, |v| v),
    })
}

/// Uniformity (straight, diagonal) and L_valley / L_peak of one map without groups, the peak its largest bin; `None` as for [`uniformity`].
pub fn plain(map: &[f64], grid: Grid, layout: &Layout, full_scale: f64) -> Option<[f64; 3]> {
    let window = |segments: &[[[f64; 2]; 2]]| Window::find(grid, map, segments, layout.pitch_mm);
    let straight = window(&layout.straight())?;
    let diagonal = window(&layout.diagonal()).unwrap_or_else(|| straight.clone());
    let peak = largest(map).1;
    let [low, corner] = [straight, diagonal].map(|window| window.minimum(map) / peak);
    Some([
        logarithmic(low, full_scale),
        logarithmic(corner, full_scale),
        low,
    ])
}

/// A map above its smallest bin, which becomes 0: equation 1 where it scales a range. The bin is picked once, from all groups.
pub fn above_smallest(map: &Grouped) -> Grouped {
    let bins = map.total().iter().enumerate();
    let least = bins.min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |b| b.0);
    map.map(|m| m.iter().map(|l| l - m[least]).collect())
}

/// Uniformity of one map read bin by bin, as from a display of the map and its cross-section: the largest bin beside the smallest
/// that the segment between the first two neighbours passes through. Noise makes the one larger and the other smaller. `None`
/// without neighbours.
pub fn bin_by_bin(map: &[f64], grid: Grid, layout: &Layout, full_scale: f64) -> Option<f64> {
    let bin = |at: f64, count: usize| {
        let place = (at / grid.bin_mm + 0.5 * count as f64).floor();
        (place.max(0.0) as usize).min(count - 1)
    };
    let &[a, b] = layout.straight().first()?;
    let steps = (4.0 * (b[0] - a[0]).hypot(b[1] - a[1]) / grid.bin_mm).ceil() as usize;
    let values = (0..=steps).map(|k| {
        let s = k as f64 / steps as f64;
        let (x, y) = (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]));
        map[bin(y, grid.rows) * grid.columns + bin(x, grid.columns)]
    });
    let lowest = values.min_by(f64::total_cmp)?;
    Some(logarithmic(lowest / largest(map).1, full_scale))
}

/// Mean over halvings of the value that one half has where the other has its largest bin.
fn crossed_peak(map: &Grouped) -> f64 {
    let splits = SPLITS.min(map.count() - 1);
    let sum: f64 = (1..=splits)
        .map(|split| {
            let [a, b] = map.halves(split);
            0.5 * (b[largest(&a).0] + a[largest(&b).0])
        })
        .sum();
    sum / splits as f64
}

/// Equation 4: max(0, 1 + ln v / ln `full_scale`) of v = L_valley / L_peak.
pub fn logarithmic(valley_to_peak: f64, full_scale: f64) -> f64 {
    if valley_to_peak <= 0.0 {
        0.0
    } else {
        (1.0 + valley_to_peak.ln() / full_scale.ln()).max(0.0)
    }
}

/// An extreme: from all groups, without each group, and from one half of them at the place that the other half picks.
struct Extreme {
    plain: f64,
    left_out: Vec<f64>,
    crossed: f64,
}

fn combine(valley: &Extreme, peak: &Extreme, f: impl Fn(f64) -> f64) -> Estimate {
    let plain = f(valley.plain / peak.plain);
    let crossed = f(valley.crossed / peak.crossed);
    let left_out: Vec<f64> = valley
        .left_out
        .iter()
        .zip(&peak.left_out)
        .map(|(v, p)| f(v / p))
        .collect();
    Estimate {
        value: 0.5 * (plain + crossed),
        standard_error: spread(&left_out),
        bias_bound: Some(0.5 * (plain - crossed).abs()),
    }
}

/// Place and value of the largest bin.
fn largest(map: &[f64]) -> (usize, f64) {
    map.iter()
        .enumerate()
        .fold((0, f64::NEG_INFINITY), |best, (k, &v)| {
            if v > best.1 { (k, v) } else { best }
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::illuminance::{Symmetry, smoothed};

    const GRID: Grid = Grid {
        columns: 204,
        rows: 204,
        bin_mm: 0.1,
    };
    fn square(side: usize) -> Layout {
        let at = |k: usize| (k as f64 - 0.5 * (side as f64 - 1.0)) * 8.3;
        let axes = (0..side * side).map(|k| [at(k % side), at(k / side)]);
        Layout::rectangular(axes.collect(), side, side, 8.3)
    }

    #[test]
    fn neighbours_by_distance_are_those_of_rows_and_columns() {
        let mut by_row = square(5);
        let by_distance = Layout::by_distance(by_row.axes_mm.clone(), by_row.pitch_mm);
        by_row.straight.sort_unstable();
        assert_eq!(by_row.straight, by_distance.straight);
        assert!(by_distance.diagonal().is_empty() && by_row.diagonal().len() == 32);
    }

    /// Four Gaussians of width `w` on the LED axes over a floor, scaled by noise of relative size `noise`.
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
        let u = uniformity(&map(w, floor, 0.0, 4), GRID, &square(2), 256.0).expect("neighbours");
        let e = |d2: f64| (-d2 / (2.0 * w * w)).exp();
        let peak = 1.0 + 2.0 * e(8.3 * 8.3) + e(2.0 * 8.3 * 8.3) + floor;
        let middle = 2.0 * e(4.15 * 4.15) + 2.0 * e(4.15f64.powi(2) + 8.3 * 8.3) + floor;
        let centre = 4.0 * e(2.0 * 4.15 * 4.15) + floor;
        assert!(
            (u.straight.value - logarithmic(middle / peak, 256.0)).abs() < 2e-4,
            "{u:?}"
        );
        assert!(
            (u.diagonal.value - logarithmic(centre / peak, 256.0)).abs() < 5e-4,
            "{u:?}"
        );
        assert!(u.straight.standard_error < 1e-12);
        let [straight, diagonal, ratio] =
            plain(map(w, floor, 0.0, 4).total(), GRID, &square(2), 256.0).expect("neighbours");
        assert!((straight - u.straight.value).abs() < 1e-12);
        assert!((diagonal - u.diagonal.value).abs() < 1e-12);
        assert!((ratio - u.valley_to_peak.value).abs() < 1e-12);
    }

    #[test]
    fn noise_biases_neither_value_beyond_its_error() {
        let noisy = map(2.0, 0.05, 0.04, 64);
        let exact = map(2.0, 0.05, 0.0, 4);
        let smooth = |m: &Grouped| smoothed(m, GRID, Symmetry::Square, 0.1);
        let estimate = uniformity(&smooth(&noisy), GRID, &square(2), 256.0)
            .expect("neighbours")
            .straight;
        assert!(
            estimate.bias_bound.expect("a peak is picked") < estimate.standard_error,
            "{estimate:?}"
        );
        let truth = uniformity(&smooth(&exact), GRID, &square(2), 256.0)
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
    fn what_is_subtracted_is_the_smallest_bin() {
        let (w, floor) = (2.0f64, 0.05);
        let seen = above_smallest(&map(w, floor, 0.0, 4));
        let u = uniformity(&seen, GRID, &square(2), 256.0).expect("neighbours");
        // The corner of the map is darkest; with or without a floor the figure is the same.
        let e = |d2: f64| (-d2 / (2.0 * w * w)).exp();
        let corner = GRID.centre_mm(0, GRID.columns).abs();
        let at = |x: f64, y: f64| -> f64 {
            let places = [
                [-4.15, -4.15],
                [-4.15, 4.15],
                [4.15, -4.15],
                [4.15, 4.15f64],
            ];
            places
                .iter()
                .map(|[a, b]| e((x - a).powi(2) + (y - b).powi(2)))
                .sum()
        };
        let dark = at(corner, corner);
        let expected = logarithmic((at(0.0, 4.15) - dark) / (at(4.15, 4.15) - dark), 256.0);
        assert!(
            (u.straight.value - expected).abs() < 2e-4,
            "{u:?} {expected}"
        );
        assert!(seen.total().iter().all(|l| *l >= 0.0));
    }

    #[test]
    fn bins_alone_read_less_the_noisier_they_are() {
        let read = |noise: f64| {
            let map = map(2.0, 0.05, noise, 4);
            bin_by_bin(map.total(), GRID, &square(2), 256.0).expect("neighbours")
        };
        let exact = uniformity(&map(2.0, 0.05, 0.0, 4), GRID, &square(2), 256.0)
            .expect("neighbours")
            .straight
            .value;
        // Bins are level here, their centres half a bin from the valley: no more than that is lost.
        assert!((read(0.0) - exact).abs() < 1e-3, "{} {exact}", read(0.0));
        // Dozens of bins lie in the valley: its lowest is two standard deviations or more below.
        let floor = |noise: f64| (1.0 - 2.0 * noise).ln() / 256f64.ln();
        for noise in [0.02, 0.05, 0.1] {
            assert!(read(noise) < exact + 0.7 * floor(noise), "{noise}");
        }
        assert_eq!(
            bin_by_bin(map(2.0, 0.0, 0.0, 2).total(), GRID, &square(1), 256.0),
            None
        );
    }

    #[test]
    fn a_single_package_has_no_uniformity() {
        assert_eq!(
            uniformity(&map(2.0, 0.0, 0.0, 2), GRID, &square(1), 256.0),
            None
        );
    }
}
