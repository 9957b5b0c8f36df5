// SPDX-License-Identifier: MIT OR Apache-2.0
//! Uniformity: how dark the darkest place between two LEDs looks beside the brightest on the receiver.
//!
//! Equations 1 to 4 of the paper: L_N = L scaled so that its maximum is `full_scale` (256), L_log = max(0, ln L_N),
//! uniformity = L_log,valley / L_log,peak. With v = L_valley / L_peak this is max(0, 1 + ln v / ln 256).
//!
//! The largest of many noisy bins lies above the true maximum, the smallest below the true minimum. The place picked
//! from all groups but one, read in the group left out, errs the other way: it is a true value at a place that is
//! not quite the best. The middle of the two is reported as the value and half their distance as the bound of its bias.

use super::jackknife::spread;
use super::illuminance::Grid;
use super::{Estimate, Grouped};

/// Where the LEDs are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// LEDs along x.
    pub columns: usize,
    /// LEDs along y.
    pub rows: usize,
    /// Distance of neighbours, mm.
    pub pitch_mm: f64,
}

impl Layout {
    /// Axis (x, y) of the LED in column `i`, row `j`, mm; the array is centred on the origin.
    pub fn axis_mm(&self, i: usize, j: usize) -> [f64; 2] {
        let place = |k: usize, n: usize| (k as f64 - 0.5 * (n as f64 - 1.0)) * self.pitch_mm;
        [place(i, self.columns), place(j, self.rows)]
    }

    /// Ends of the segments between LEDs next to each other along a row or column.
    pub fn straight(&self) -> Vec<[[f64; 2]; 2]> {
        let mut segments = Vec::new();
        for j in 0..self.rows {
            for i in 0..self.columns {
                if i + 1 < self.columns {
                    segments.push([self.axis_mm(i, j), self.axis_mm(i + 1, j)]);
                }
                if j + 1 < self.rows {
                    segments.push([self.axis_mm(i, j), self.axis_mm(i, j + 1)]);
                }
            }
        }
        segments
    }

    /// Ends of the segments between diagonal neighbours.
    pub fn diagonal(&self) -> Vec<[[f64; 2]; 2]> {
        let mut segments = Vec::new();
        for j in 1..self.rows {
            for i in 1..self.columns {
                segments.push([self.axis_mm(i - 1, j - 1), self.axis_mm(i, j)]);
                segments.push([self.axis_mm(i, j - 1), self.axis_mm(i - 1, j)]);
            }
        }
        segments
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

/// Uniformity of the smoothed map `map` (W/mm² by groups); `None` without neighbours.
pub fn uniformity(map: &Grouped, grid: Grid, layout: Layout, full_scale: f64) -> Option<Uniformity> {
    let straight = samples(&layout.straight(), grid.bin_mm);
    let diagonal = samples(&layout.diagonal(), grid.bin_mm);
    if straight.is_empty() {
        return None;
    }
    let left_out: Vec<Vec<f64>> = (0..map.count()).map(|g| map.without(g)).collect();
    let peak = Picked::of(map, &left_out, |m| largest(m), |m, &k| m[k]);
    let valley = |points: &[[f64; 2]]| Picked::of(map, &left_out, |m| darkest(grid, m, points), |m, p: &[f64; 2]| grid.at(m, p[0], p[1]));
    let low = valley(&straight);
    // A single row has no diagonal; its entry then repeats the straight one.
    let corner = if diagonal.is_empty() { low.clone() } else { valley(&diagonal) };
    Some(Uniformity {
        straight: combine(&low, &peak, |v| logarithmic(v, full_scale)),
        diagonal: combine(&corner, &peak, |v| logarithmic(v, full_scale)),
        valley_to_peak: combine(&low, &peak, |v| v),
    })
}

/// Equation 4: max(0, 1 + ln v / ln `full_scale`) of v = L_valley / L_peak.
pub fn logarithmic(valley_to_peak: f64, full_scale: f64) -> f64 {
    if valley_to_peak <= 0.0 { 0.0 } else { (1.0 + valley_to_peak.ln() / full_scale.ln()).max(0.0) }
}

/// A picked extreme: on all groups, without each group, and read where the others put it.
#[derive(Clone)]
struct Picked {
    plain: f64,
    left_out: Vec<f64>,
    crossed: f64,
}

impl Picked {
    fn of<P>(map: &Grouped, left_out: &[Vec<f64>], pick: impl Fn(&[f64]) -> P, read: impl Fn(&[f64], &P) -> f64) -> Self {
        let places: Vec<P> = left_out.iter().map(|m| pick(m)).collect();
        Self {
            plain: read(map.total(), &pick(map.total())),
            left_out: left_out.iter().zip(&places).map(|(m, p)| read(m, p)).collect(),
            crossed: places.iter().enumerate().map(|(g, p)| read(map.group(g), p)).sum(),
        }
    }
}

fn combine(valley: &Picked, peak: &Picked, f: impl Fn(f64) -> f64) -> Estimate {
    let plain = f(valley.plain / peak.plain);
    let crossed = f(valley.crossed / peak.crossed);
    let left_out: Vec<f64> = valley.left_out.iter().zip(&peak.left_out).map(|(v, p)| f(v / p)).collect();
    Estimate { value: 0.5 * (plain + crossed), standard_error: spread(&left_out), bias_bound: Some(0.5 * (plain - crossed).abs()) }
}

fn largest(map: &[f64]) -> usize {
    (0..map.len()).fold(0, |best, k| if map[k] > map[best] { k } else { best })
}

fn darkest(grid: Grid, map: &[f64], points: &[[f64; 2]]) -> [f64; 2] {
    let mut best = (f64::INFINITY, points[0]);
    for &p in points {
        let value = grid.at(map, p[0], p[1]);
        if value < best.0 {
            best = (value, p);
        }
    }
    best.1
}

/// Points along the segments, half a bin apart, both ends included.
fn samples(segments: &[[[f64; 2]; 2]], bin_mm: f64) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for [a, b] in segments {
        let steps = ((b[0] - a[0]).hypot(b[1] - a[1]) / (0.5 * bin_mm)).ceil() as usize;
        for k in 0..=steps {
            let s = k as f64 / steps as f64;
            points.push([a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::illuminance::{Symmetry, smoothed};

    const GRID: Grid = Grid { columns: 204, rows: 204, bin_mm: 0.1 };
    const LAYOUT: Layout = Layout { columns: 2, rows: 2, pitch_mm: 8.3 };

    /// Four Gaussians of width `w` on the LED axes over a floor, scaled by noise of relative size `noise`.
    fn map(w: f64, floor: f64, noise: f64, groups: usize) -> Grouped {
        let mut state = 1u64;
        let mut normal = || {
            // Sum of twelve uniform numbers, minus six.
            (0..12).map(|_| { state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407); (state >> 11) as f64 / 9_007_199_254_740_992.0 }).sum::<f64>() - 6.0
        };
        let exact: Vec<f64> = (0..GRID.columns * GRID.rows)
            .map(|k| {
                let (x, y) = (GRID.centre_mm(k % GRID.columns, GRID.columns), GRID.centre_mm(k / GRID.columns, GRID.rows));
                let light: f64 = [-4.15f64, 4.15].iter().flat_map(|a| [-4.15f64, 4.15].iter().map(move |b| (-((x - a).powi(2) + (y - b).powi(2)) / (2.0 * w * w)).exp())).sum();
                (light + floor) * 0.01
            })
            .collect();
        Grouped::new((0..groups).map(|_| exact.iter().map(|v| v / groups as f64 * (1.0 + noise * (groups as f64).sqrt() * normal())).collect()).collect())
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
        let u = uniformity(&map(w, floor, 0.0, 4), GRID, LAYOUT, 256.0).expect("neighbours");
        let e = |d2: f64| (-d2 / (2.0 * w * w)).exp();
        let peak = 1.0 + 2.0 * e(8.3 * 8.3) + e(2.0 * 8.3 * 8.3) + floor;
        let middle = 2.0 * e(4.15 * 4.15) + 2.0 * e(4.15f64.powi(2) + 8.3 * 8.3) + floor;
        let centre = 4.0 * e(2.0 * 4.15 * 4.15) + floor;
        assert!((u.straight.value - logarithmic(middle / peak, 256.0)).abs() < 2e-4, "{u:?}");
        assert!((u.diagonal.value - logarithmic(centre / peak, 256.0)).abs() < 5e-4, "{u:?}");
        assert!(u.straight.standard_error < 1e-12);
    }

    #[test]
    fn noise_biases_neither_value_beyond_its_error() {
        let noisy = map(2.0, 0.05, 0.04, 64);
        let exact = map(2.0, 0.05, 0.0, 4);
        let smooth = |m: &Grouped| smoothed(m, GRID, Symmetry::Square, 0.1);
        let estimate = uniformity(&smooth(&noisy), GRID, LAYOUT, 256.0).expect("neighbours").straight;
        let truth = uniformity(&smooth(&exact), GRID, LAYOUT, 256.0).expect("neighbours").straight.value;
        assert!((estimate.value - truth).abs() < 3.0 * estimate.standard_error, "{estimate:?} against {truth}");
        assert!(estimate.standard_error > 1e-5);
    }

    #[test]
    fn a_single_package_has_no_uniformity() {
        let alone = Layout { columns: 1, rows: 1, pitch_mm: 8.3 };
        assert_eq!(uniformity(&map(2.0, 0.0, 0.0, 2), GRID, alone, 256.0), None);
    }
}
