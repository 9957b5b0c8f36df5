// SPDX-License-Identifier: MIT OR Apache-2.0
//! The lowest value of a noisy map on a segment, from a local fit.
//!
//! The smallest of many noisy bins lies below the true minimum by more than its standard error.
//! Between two LEDs the map is smooth on the scale of the LED. The minimum is therefore that of a
//! polynomial fitted by least squares to a window of bins: fourth degree along the segment, second
//! degree across it, with mixed terms. The fit is linear in the map, and a moving mean places its
//! window, so noise has hardly any choice.

use super::illuminance::Grid;

/// Half the window along the segment, in pitches.
const ALONG: f64 = 0.12;
/// Half the window across it, in pitches.
const ACROSS: f64 = 0.1;
/// Powers of u that remain on the segment.
const DEGREES: usize = 5;
/// All terms: 1, u, u², u³, u⁴, v, v², u v, u² v, u v², u² v².
const TERMS: usize = 11;

fn terms(u: f64, v: f64) -> [f64; TERMS] {
    [1.0, u, u * u, u.powi(3), u.powi(4), v, v * v, u * v, u * u * v, u * v * v, u * u * v * v]
}

/// Where the lowest value between neighbours is read.
#[derive(Debug, Clone)]
pub enum Valley {
    /// From a fit.
    Fit(Window),
    /// The smallest of these bins.
    Bins(Vec<usize>),
}

/// Whether bins of `grid` are narrow enough for a fit about the middles of all `segments`.
pub fn fits(grid: Grid, segments: &[[[f64; 2]; 2]], pitch_mm: f64) -> bool {
    let middle = |[a, b]: [[f64; 2]; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    segments.iter().all(|ends| Window::about(grid, middle(*ends), *ends, pitch_mm).is_some())
}

impl Valley {
    /// From a fit to `map` about its lowest stretch; `None` as for [`Window::find`].
    pub fn fit(grid: Grid, map: &[f64], segments: &[[[f64; 2]; 2]], pitch_mm: f64) -> Option<Self> {
        Window::find(grid, map, segments, pitch_mm).map(Self::Fit)
    }

    /// From the bins that `segments` pass through, as a display of the map and its cross-section
    /// shows them; `None` without segments.
    pub fn bins(grid: Grid, segments: &[[[f64; 2]; 2]]) -> Option<Self> {
        let bin = |at: f64, count: usize| {
            let place = (at / grid.bin_mm + 0.5 * count as f64).floor();
            (place.max(0.0) as usize).min(count - 1)
        };
        let mut bins = Vec::new();
        for [a, b] in segments {
            let steps = (4.0 * (b[0] - a[0]).hypot(b[1] - a[1]) / grid.bin_mm).ceil() as usize;
            bins.extend((0..=steps).map(|k| {
                let s = k as f64 / steps as f64;
                let (x, y) = (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]));
                bin(y, grid.rows) * grid.columns + bin(x, grid.columns)
            }));
        }
        bins.sort_unstable();
        bins.dedup();
        (!bins.is_empty()).then_some(Self::Bins(bins))
    }

    /// Lowest value in `map`.
    pub fn minimum(&self, map: &[f64]) -> f64 {
        match self {
            Self::Fit(window) => window.minimum(map),
            Self::Bins(bins) => bins.iter().map(|&k| map[k]).fold(f64::INFINITY, f64::min),
        }
    }

    /// Where [`Valley::minimum`] is read in `map` on `grid`, (x, y) in mm.
    pub fn place_mm(&self, grid: Grid, map: &[f64]) -> [f64; 2] {
        match self {
            Self::Fit(window) => window.place_mm(map),
            Self::Bins(bins) => {
                let least = bins.iter().min_by(|a, b| map[**a].total_cmp(&map[**b]));
                grid.middle_mm(least.copied().unwrap_or(0))
            }
        }
    }
}

/// A window on a segment, ready to be applied to maps.
#[derive(Debug, Clone)]
pub struct Window {
    /// Bins in the window.
    bins: Vec<usize>,
    /// What each bin adds to the coefficients of 1, u, ... u⁴.
    weights: Vec<[f64; DEGREES]>,
    /// Range of u that lies on the segment.
    range: [f64; 2],
    /// Where u = 0, (x, y) in mm.
    centre_mm: [f64; 2],
    /// What a step of 1 in u is, mm.
    step_mm: [f64; 2],
}

impl Window {
    /// The window about the lowest stretch of `map` on `segments` of one `pitch_mm`. `None` without
    /// segments, or where the window holds too few bins for a fit.
    pub fn find(
        grid: Grid,
        map: &[f64],
        segments: &[[[f64; 2]; 2]],
        pitch_mm: f64,
    ) -> Option<Self> {
        let mut best: Option<(f64, [f64; 2], [[f64; 2]; 2])> = None;
        for &[a, b] in segments {
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let steps = (length / (0.5 * grid.bin_mm)).ceil() as usize;
            let point = |k: usize| {
                let s = k as f64 / steps as f64;
                [a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])]
            };
            let values: Vec<f64> = (0..=steps)
                .map(|k| {
                    let [x, y] = point(k);
                    grid.at(map, x, y)
                })
                .collect();
            let reach = ((0.5 * ALONG * pitch_mm / length) * steps as f64).round() as usize;
            for k in reach..=steps - reach {
                let mean =
                    values[k - reach..=k + reach].iter().sum::<f64>() / (2 * reach + 1) as f64;
                if best.is_none_or(|b| mean < b.0) {
                    best = Some((mean, point(k), [a, b]));
                }
            }
        }
        let (_, centre, [a, b]) = best?;
        Self::about(grid, centre, [a, b], pitch_mm)
    }

    fn about(grid: Grid, centre: [f64; 2], [a, b]: [[f64; 2]; 2], pitch_mm: f64) -> Option<Self> {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let t = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        let (along, across) = (ALONG * pitch_mm, ACROSS * pitch_mm);
        let to_window = |p: [f64; 2]| {
            let d = [p[0] - centre[0], p[1] - centre[1]];
            [(d[0] * t[0] + d[1] * t[1]) / along, (d[1] * t[0] - d[0] * t[1]) / across]
        };
        let (mut bins, mut rows) = (Vec::new(), Vec::new());
        // Bins that the window can hold, and one more to each side.
        let near = |k: usize, count: usize| {
            let reach = t[k].abs() * along + t[1 - k].abs() * across;
            let place = |at: f64| at / grid.bin_mm + 0.5 * count as f64;
            let first = (place(centre[k] - reach) - 1.0).floor().max(0.0) as usize;
            let end = (place(centre[k] + reach) + 2.0).ceil().clamp(0.0, count as f64) as usize;
            first..end
        };
        for j in near(1, grid.rows) {
            for i in near(0, grid.columns) {
                let [u, v] =
                    to_window([grid.centre_mm(i, grid.columns), grid.centre_mm(j, grid.rows)]);
                if u.abs() <= 1.0 && v.abs() <= 1.0 {
                    bins.push(j * grid.columns + i);
                    rows.push(terms(u, v));
                }
            }
        }
        if bins.len() < 2 * TERMS {
            return None;
        }
        let inverse = inverse(&rows)?;
        let weights = rows
            .iter()
            .map(|row| std::array::from_fn(|k| (0..TERMS).map(|m| inverse[k][m] * row[m]).sum()))
            .collect();
        let ends = [to_window(a)[0], to_window(b)[0]];
        Some(Self {
            bins,
            weights,
            range: [ends[0].max(-1.0), ends[1].min(1.0)],
            centre_mm: centre,
            step_mm: t.map(|t| t * along),
        })
    }

    /// Lowest value of the fit to `map` on the segment.
    pub fn minimum(&self, map: &[f64]) -> f64 {
        let fit = self.fit(map);
        let values = self.positions().map(|u| value(&fit, u));
        values.fold(f64::INFINITY, f64::min)
    }

    /// Where the fit to `map` is lowest on the segment, (x, y) in mm.
    fn place_mm(&self, map: &[f64]) -> [f64; 2] {
        let fit = self.fit(map);
        let values = self.positions().map(|u| (u, value(&fit, u)));
        let lowest = values.min_by(|a, b| a.1.total_cmp(&b.1));
        let u = lowest.map_or(0.0, |(u, _)| u);
        [0, 1].map(|k| self.centre_mm[k] + u * self.step_mm[k])
    }

    /// Coefficients of 1, u, ... u⁴ on the segment.
    fn fit(&self, map: &[f64]) -> [f64; DEGREES] {
        let mut c = [0.0; DEGREES];
        for (&bin, weights) in self.bins.iter().zip(&self.weights) {
            for (sum, w) in c.iter_mut().zip(weights) {
                *sum += w * map[bin];
            }
        }
        c
    }

    /// Values of u at which the fit is read.
    fn positions(&self) -> impl Iterator<Item = f64> {
        const STEPS: i32 = 400;
        let [low, high] = self.range;
        (0..=STEPS).map(move |k| low + (high - low) * f64::from(k) / f64::from(STEPS))
    }
}

fn value(coefficients: &[f64; DEGREES], u: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * u + c)
}

/// (AᵀA)⁻¹ for the design matrix of rows `a`, by Gauss-Jordan with pivoting; `None` if the window
/// does not determine all terms.
fn inverse(a: &[[f64; TERMS]]) -> Option<[[f64; TERMS]; TERMS]> {
    let mut m = [[0.0; 2 * TERMS]; TERMS];
    for row in a {
        for i in 0..TERMS {
            for j in 0..TERMS {
                m[i][j] += row[i] * row[j];
            }
        }
    }
    for (i, row) in m.iter_mut().enumerate() {
        row[TERMS + i] = 1.0;
    }
    for column in 0..TERMS {
        let pivot =
            (column..TERMS).max_by(|&i, &j| m[i][column].abs().total_cmp(&m[j][column].abs()))?;
        m.swap(column, pivot);
        let p = m[column][column];
        if p.abs() < 1e-9 * a.len() as f64 {
            return None;
        }
        m[column].iter_mut().for_each(|x| *x /= p);
        let pivot_row = m[column];
        for (i, row) in m.iter_mut().enumerate() {
            let factor = row[column];
            if i != column && factor != 0.0 {
                row.iter_mut().zip(&pivot_row).for_each(|(x, y)| *x -= factor * y);
            }
        }
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| m[i][TERMS + j])))
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { columns: 160, rows: 160, bin_mm: 0.1 };

    fn map(f: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        (0..GRID.columns * GRID.rows)
            .map(|k| {
                f(
                    GRID.centre_mm(k % GRID.columns, GRID.columns),
                    GRID.centre_mm(k / GRID.columns, GRID.rows),
                )
            })
            .collect()
    }

    #[test]
    fn polynomials_of_its_own_degree_are_read_exactly() {
        let m = map(|x, y| {
            2.0 + 0.3 * (x - 0.2).powi(2) + 0.05 * (x - 0.2).powi(4) + 0.7 * (y - 1.0)
                - 0.2 * (y - 1.0).powi(2)
        });
        let segment = [[[-4.0, 1.0], [4.0, 1.0]]];
        let low = Window::find(GRID, &m, &segment, 8.0).expect("a window").minimum(&m);
        assert!((low - 2.0).abs() < 1e-5, "{low}");
        let valley = Valley::fit(GRID, &m, &segment, 8.0).expect("a window");
        let [x, y] = valley.place_mm(GRID, &m);
        assert!((x - 0.2).abs() < 0.01 && (y - 1.0).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn slanted_segments_have_their_own_frame() {
        let m = map(|x, y| 1.0 + 0.1 * (x + y).powi(2) + 0.2 * (x - y));
        let low = Window::find(GRID, &m, &[[[-4.0, -4.0], [4.0, 4.0]]], 8.0)
            .expect("a window")
            .minimum(&m);
        assert!((low - 1.0).abs() < 1e-5, "{low}");
    }

    #[test]
    fn a_window_of_few_bins_is_refused() {
        let coarse = Grid { columns: 8, rows: 8, bin_mm: 2.0 };
        assert!(Window::find(coarse, &vec![1.0; 64], &[[[-4.0, 0.0], [4.0, 0.0]]], 8.0).is_none());
        assert!(Window::find(GRID, &map(|_, _| 1.0), &[], 8.0).is_none());
    }
}
