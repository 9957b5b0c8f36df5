// SPDX-License-Identifier: MIT OR Apache-2.0
//! The lowest value of a noisy map on a segment, from a local fit.
//!
//! The smallest of many noisy bins lies below the true minimum by more than its standard error.
//! Between two LEDs the map is smooth on the scale of the LED. The minimum is therefore that of a
//! polynomial fitted by least squares to a window of bins: fourth degree along the segment, second
//! degree across it, with mixed terms. The fit is linear in the map. Windows cover
//! the segment, each is read in its middle, and the lowest counts, anew in every map.

use std::sync::{Arc, OnceLock};

use super::illuminance::Grid;

/// Half the window along the segment and the most between two windows, in pitches.
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

/// How the lowest value between neighbours is read.
#[derive(Debug, Clone)]
pub enum Valley {
    /// From a fit about the lowest stretch of a map.
    Fit(FittedValley),
    /// The smallest of these bins.
    Bins(Vec<usize>),
}

/// Segments on which fits are made.
#[derive(Debug, Clone)]
pub struct FittedValley {
    grid: Grid,
    segments: Vec<Arc<Segment>>,
    pitch_mm: f64,
    /// The part of each bin that counts; all without.
    counted: Option<Vec<f64>>,
}

/// A segment, with its windows from one end to the other once they are asked for.
#[derive(Debug)]
struct Segment {
    ends: [[f64; 2]; 2],
    windows: OnceLock<Vec<Window>>,
}

/// Where one map is lowest: what reads another map at the same place.
#[derive(Debug, Clone)]
pub struct Lowest(Place);

#[derive(Debug, Clone)]
enum Place {
    /// A position in a window of a segment.
    Fit(Arc<Segment>, usize, f64),
    /// A bin.
    Bin(usize),
}

/// True if the bins of a grid of which something counts (all without parts) are narrow enough for a
/// fit about the middle of the first of `segments`, which are all of about one length.
pub fn fits(bins: (Grid, Option<&[f64]>), segments: &[[[f64; 2]; 2]], pitch_mm: f64) -> bool {
    segments.first().is_none_or(|ends| {
        let [a, b] = *ends;
        let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
        Window::about(bins, middle, *ends, pitch_mm).is_some()
    })
}

impl Valley {
    /// From fits; `None` without segments, or where a window holds too few bins.
    pub fn fit(grid: Grid, segments: &[[[f64; 2]; 2]], pitch_mm: f64) -> Option<Self> {
        let segment = |ends: &_| Arc::new(Segment { ends: *ends, windows: OnceLock::new() });
        let each = segments.iter().map(segment).collect();
        let valley = FittedValley { grid, segments: each, pitch_mm, counted: None };
        (!segments.is_empty() && fits((grid, None), segments, pitch_mm))
            .then_some(Self::Fit(valley))
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

    /// The same without the bins of which nothing counts; `None` where too few are left.
    pub fn counting(self, counted: &[f64]) -> Option<Self> {
        match self {
            Self::Fit(valley) => {
                let ends: Vec<_> = valley.segments.iter().map(|segment| segment.ends).collect();
                let is_read = fits((valley.grid, Some(counted)), &ends, valley.pitch_mm);
                let counted = Some(counted.to_vec());
                let fresh = |ends| Arc::new(Segment { ends, windows: OnceLock::new() });
                let segments = ends.into_iter().map(fresh).collect();
                is_read.then_some(Self::Fit(FittedValley { segments, counted, ..valley }))
            }
            Self::Bins(mut bins) => {
                bins.retain(|bin| counted[*bin] > 0.0);
                (!bins.is_empty()).then_some(Self::Bins(bins))
            }
        }
    }

    /// Where `map` is lowest.
    pub fn lowest(&self, map: &[f64]) -> Lowest {
        Lowest(match self {
            Self::Fit(valley) => valley.lowest(map).unwrap_or(Place::Bin(0)),
            Self::Bins(bins) => {
                let lowest = bins.iter().min_by(|a, b| map[**a].total_cmp(&map[**b]));
                Place::Bin(lowest.copied().unwrap_or(0))
            }
        })
    }

    /// Segments between which a minimum is picked.
    pub fn segments(&self) -> usize {
        match self {
            Self::Fit(valley) => valley.segments.len(),
            Self::Bins(_) => 1,
        }
    }

    /// Lowest value in `map`.
    pub fn minimum(&self, map: &[f64]) -> f64 {
        self.lowest(map).value(map)
    }
}

impl Lowest {
    /// Value of `map` at this place.
    pub fn value(&self, map: &[f64]) -> f64 {
        match &self.0 {
            Place::Fit(segment, k, u) => value(&segment.window(*k).fit(map), *u),
            Place::Bin(bin) => map[*bin],
        }
    }

    /// The place, (x, y) in mm.
    pub fn place_mm(&self, grid: Grid) -> [f64; 2] {
        match &self.0 {
            Place::Fit(segment, k, u) => segment.window(*k).point_mm(*u),
            Place::Bin(bin) => grid.middle_mm(*bin),
        }
    }

    /// Σ c² / Σ c over the weights c of the bins that are read: the share of one bin's noise.
    pub fn concentration(&self) -> f64 {
        match &self.0 {
            Place::Fit(segment, k, u) => {
                let weights = || segment.window(*k).weights.iter().map(|c| value(c, *u));
                weights().map(|c| c * c).sum::<f64>() / weights().sum::<f64>()
            }
            Place::Bin(_) => 1.0,
        }
    }
}

impl Segment {
    /// Window `k`, which was built before it was picked.
    fn window(&self, k: usize) -> &Window {
        &self.windows.get().expect("built")[k]
    }

    /// Windows whose middle parts cover the segment.
    fn windows(&self, valley: &FittedValley) -> &[Window] {
        let (grid, pitch_mm) = ((valley.grid, valley.counted.as_deref()), valley.pitch_mm);
        self.windows.get_or_init(|| {
            let [a, b] = self.ends;
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let margin = (0.5 * ALONG * pitch_mm / length).min(0.5);
            let steps = ((1.0 - 2.0 * margin) * length / (ALONG * pitch_mm)).ceil().max(1.0);
            let centre = |k: usize| {
                let s = margin + (1.0 - 2.0 * margin) * k as f64 / steps;
                [0, 1].map(|i| a[i] + s * (b[i] - a[i]))
            };
            // Half of what lies between two centres.
            let half = 0.5 * (1.0 - 2.0 * margin) * length / steps / (ALONG * pitch_mm);
            let last = steps as usize;
            let window = |k| {
                let mut window = Window::about(grid, centre(k), self.ends, pitch_mm)?;
                let [low, high] = &mut window.range;
                *low = if k == 0 { *low } else { -half };
                *high = if k == last { *high } else { half };
                Some(window)
            };
            (0..=last).filter_map(window).collect()
        })
    }
}

impl FittedValley {
    /// Most segments on which fits are made to one map.
    const MAX_SEGMENTS: usize = 8;

    /// The lowest fit to `map`. Neighbouring windows share most of their bins and each is read in
    /// its middle, so that the minimum changes with the map steadily.
    fn lowest(&self, map: &[f64]) -> Option<Place> {
        let mut best: Option<(f64, Place)> = None;
        for segment in self.lowest_segments(map) {
            for (k, window) in segment.windows(self).iter().enumerate() {
                let (u, low) = window.lowest(map);
                if best.as_ref().is_none_or(|(lowest, _)| low < *lowest) {
                    best = Some((low, Place::Fit(segment.clone(), k, u)));
                }
            }
        }
        best.map(|(_, place)| place)
    }

    /// The segments of the lowest moving means of `map`.
    fn lowest_segments(&self, map: &[f64]) -> Vec<Arc<Segment>> {
        if self.segments.len() <= Self::MAX_SEGMENTS {
            return self.segments.clone();
        }
        let mean = |segment: &Arc<Segment>| (self.lowest_mean(map, segment.ends), segment.clone());
        let mut means: Vec<_> = self.segments.iter().map(mean).collect();
        means.sort_by(|a, b| a.0.total_cmp(&b.0));
        means.truncate(Self::MAX_SEGMENTS);
        means.into_iter().map(|(_, segment)| segment).collect()
    }

    /// Smallest moving mean of `map` on the segment from `a` to `b`.
    fn lowest_mean(&self, map: &[f64], [a, b]: [[f64; 2]; 2]) -> f64 {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let steps = (length / (0.5 * self.grid.bin_mm)).ceil() as usize;
        let at = |k: usize| {
            let s = k as f64 / steps as f64;
            self.grid.at(map, a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]))
        };
        let values: Vec<f64> = (0..=steps).map(at).collect();
        let reach = ((0.5 * ALONG * self.pitch_mm / length) * steps as f64).round() as usize;
        let means = values.windows(2 * reach + 1);
        let means = means.map(|part| part.iter().sum::<f64>() / part.len() as f64);
        means.fold(f64::INFINITY, f64::min)
    }
}

/// A window on a segment, ready to be applied to maps.
#[derive(Debug, Clone)]
pub struct Window {
    /// Bins in the window.
    bins: Vec<usize>,
    /// What each bin adds to the coefficients of 1, u, ... u⁴.
    weights: Vec<[f64; DEGREES]>,
    /// Range of u that is read: the middle of the window, or up to the end of the segment.
    range: [f64; 2],
    /// Where u = 0, (x, y) in mm.
    centre_mm: [f64; 2],
    /// What a step of 1 in u is, mm.
    step_mm: [f64; 2],
}

impl Window {
    /// A window of the bins of a grid of which something counts.
    fn about(
        (grid, counted): (Grid, Option<&[f64]>),
        centre: [f64; 2],
        [a, b]: [[f64; 2]; 2],
        pitch_mm: f64,
    ) -> Option<Self> {
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
                let bin = j * grid.columns + i;
                if u.abs() <= 1.0 && v.abs() <= 1.0 && counted.is_none_or(|of| of[bin] > 0.0) {
                    bins.push(bin);
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

    /// Where the fit to `map` is lowest on the segment, and its value there.
    fn lowest(&self, map: &[f64]) -> (f64, f64) {
        let fit = self.fit(map);
        let values = self.positions().map(|u| (u, value(&fit, u)));
        values.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.0, fit[0]))
    }

    /// The point at `u`, (x, y) in mm.
    fn point_mm(&self, u: f64) -> [f64; 2] {
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
        const STEPS: i32 = 160;
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
        let valley = Valley::fit(GRID, &segment, 8.0).expect("a window");
        let low = valley.minimum(&m);
        assert!((low - 2.0).abs() < 1e-5, "{low}");
        let [x, y] = valley.lowest(&m).place_mm(GRID);
        assert!((x - 0.2).abs() < 0.01 && (y - 1.0).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn slanted_segments_have_their_own_frame() {
        let m = map(|x, y| 1.0 + 0.1 * (x + y).powi(2) + 0.2 * (x - y));
        let valley = Valley::fit(GRID, &[[[-4.0, -4.0], [4.0, 4.0]]], 8.0).expect("a window");
        let low = valley.minimum(&m);
        assert!((low - 1.0).abs() < 1e-5, "{low}");
    }

    #[test]
    fn a_window_of_few_bins_is_refused() {
        let coarse = Grid { columns: 8, rows: 8, bin_mm: 2.0 };
        assert!(Valley::fit(coarse, &[[[-4.0, 0.0], [4.0, 0.0]]], 8.0).is_none());
        assert!(Valley::fit(GRID, &[], 8.0).is_none());
    }

    #[test]
    fn bins_behind_a_wall_beside_the_segment_do_not_count() {
        let wall = -0.3;
        let lit = map(|_, y| if y > wall { 1.0 } else { 0.0 });
        let of_y = |x: f64, y: f64| 1.0 + 0.1 * x * x + 0.2 * y;
        let m = map(|x, y| if y > wall { of_y(x, y) } else { 0.0 });
        let valley = Valley::fit(GRID, &[[[-4.0, 0.0], [4.0, 0.0]]], 8.0).expect("a window");
        assert!(valley.minimum(&m) < 0.95, "{}", valley.minimum(&m));
        let counting = valley.clone().counting(&lit).expect("bins above the wall");
        assert!((counting.minimum(&m) - 1.0).abs() < 1e-5, "{}", counting.minimum(&m));
        assert!(valley.counting(&vec![0.0; lit.len()]).is_none());
    }

    #[test]
    fn of_two_minima_one_is_read() {
        // A W along x: minima of 1 at -1.5 and 1.5 mm, 1.3 in the middle.
        let w = |x: f64| 1.0 + 0.3 * ((x / 1.5).powi(2) - 1.0).powi(2);
        let m = map(|x, _| w(x));
        let valley = Valley::fit(GRID, &[[[-4.0, 0.0], [4.0, 0.0]]], 8.0).expect("a window");
        let [x, _] = valley.lowest(&m).place_mm(GRID);
        assert!((valley.minimum(&m) - 1.0).abs() < 2e-3, "{}", valley.minimum(&m));
        assert!((x.abs() - 1.5).abs() < 0.05, "{x}");
    }

    #[test]
    fn what_is_read_elsewhere_is_the_place_of_this_map() {
        let [one, other] = [-1.0, 1.0].map(|at| map(|x, _| 1.0 + 0.1 * (x - at).powi(2)));
        let valley = Valley::fit(GRID, &[[[-4.0, 0.0], [4.0, 0.0]]], 8.0).expect("a window");
        assert!((valley.lowest(&one).value(&other) - 1.4).abs() < 2e-3);
        // 20 x 17 bins and 11 terms: a fit has the noise of a few bins' worth at most.
        assert!((0.005..0.1).contains(&valley.lowest(&one).concentration()));
    }
}
