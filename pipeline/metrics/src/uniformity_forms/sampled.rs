// SPDX-License-Identifier: MIT OR Apache-2.0
//! Regions of a map: where they are sampled, and their levels in one map.

use super::{Form, Region};
use crate::illuminance::Grid;
use crate::layout::Layout;
use crate::uniformity::{ValleyReading, largest, logarithmic, ratio, smallest};
use crate::valley::{Lowest, Valley};

/// A weighted mean of up to four bins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) bins: [usize; 4],
    pub(super) weights: [f64; 4],
}

impl Sample {
    /// Bin `k` alone.
    pub(super) fn bin(k: usize) -> Self {
        Self { bins: [k; 4], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    /// Bilinear interpolation at `[x, y]`, mm, as [`Grid::at`].
    pub(super) fn at(grid: Grid, [x, y]: [f64; 2]) -> Self {
        let (bins, [a, b]) = grid.corners(x, y);
        let weights = [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b];
        Self { bins, weights }
    }

    pub(super) fn of(&self, map: &[f64]) -> f64 {
        self.bins.iter().zip(self.weights).map(|(k, w)| w * map[*k]).sum()
    }

    /// Σ c² / Σ c over the weights: the share of one bin's noise.
    pub(super) fn concentration(&self) -> f64 {
        self.weights.iter().map(|c| c * c).sum::<f64>() / self.weights.iter().sum::<f64>()
    }
}

/// One region of a map: where it is sampled, and how its lowest value is read.
#[derive(Debug, Clone)]
pub(super) struct Sampled {
    pub(super) region: Region,
    pub(super) samples: Vec<Sample>,
    /// Share of each sample in means.
    pub(super) areas: Vec<f64>,
    /// The first so many samples are those of extremes.
    pub(super) extremes: usize,
    /// Of segments and diagonals; elsewhere the smallest sample.
    pub(super) valley: Option<Valley>,
}

/// Where a region has its extremes.
#[derive(Debug, Clone)]
pub(super) struct Picks {
    pub(super) low: Pick,
    pub(super) high: Pick,
}

/// What reads an extreme at its place.
#[derive(Debug, Clone)]
pub(super) enum Pick {
    Valley(Lowest),
    Sample(Sample),
}

impl Pick {
    pub(super) fn of(&self, map: &[f64]) -> f64 {
        match self {
            Self::Valley(lowest) => lowest.value(map),
            Self::Sample(sample) => sample.of(map),
        }
    }

    pub(super) fn concentration(&self) -> f64 {
        match self {
            Self::Valley(lowest) => lowest.concentration(),
            Self::Sample(sample) => sample.concentration(),
        }
    }
}

/// Values of one region in one map.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Levels {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) mean: f64,
    pub(super) variance: f64,
}

impl Levels {
    pub(super) fn figure(&self, form: Form, full_scale: f64) -> f64 {
        match form {
            Form::ValleyToPeak => ratio(self.low, self.high),
            Form::MinToMean => ratio(self.low, self.mean),
            Form::Variation => ratio(self.variance.max(0.0).sqrt(), self.mean),
            Form::Logarithmic => logarithmic(ratio(self.low, self.high), full_scale),
        }
    }
}

impl Sampled {
    /// Samples that all count alike.
    pub(super) fn of(region: Region, samples: Vec<Sample>) -> Self {
        let areas = vec![1.0 / samples.len() as f64; samples.len()];
        Self { region, areas, extremes: samples.len(), samples, valley: None }
    }

    /// The bins of a rectangle, by their area inside; those with their middles inside come first.
    pub(super) fn rectangle(grid: Grid, [low, high]: [[f64; 2]; 2]) -> Self {
        let rounding = 1e-9 * grid.bin_mm;
        // Bin, length inside as a fraction of the bin, and whether the middle lies inside.
        let line = |k: usize, count: usize| {
            let half = 0.5 * grid.bin_mm;
            let bins = (0..count).map(move |i| (i, grid.centre_mm(i, count)));
            let parts = bins.map(move |(i, at)| {
                let inside = (at + half).min(high[k]) - (at - half).max(low[k]);
                let has_middle = at >= low[k] - rounding && at <= high[k] + rounding;
                (i, inside / grid.bin_mm, has_middle)
            });
            parts.filter(|part| part.1 > 1e-9).collect::<Vec<_>>()
        };
        let (columns, rows) = (line(0, grid.columns), line(1, grid.rows));
        let bins = rows.iter().flat_map(|(j, height, row)| {
            let bin = move |(i, width, column): &(usize, f64, bool)| {
                (Sample::bin(j * grid.columns + i), width * height, *row && *column)
            };
            columns.iter().map(bin)
        });
        let (within, border): (Vec<_>, Vec<_>) = bins.partition(|(_, _, has_middle)| *has_middle);
        let extremes = within.len();
        let all = within.into_iter().chain(border);
        let (samples, mut areas): (Vec<_>, Vec<_>) = all.map(|(s, area, _)| (s, area)).unzip();
        let whole: f64 = areas.iter().sum();
        for area in &mut areas {
            *area /= whole;
        }
        Self { region: Region::Cell, samples, areas, extremes, valley: None }
    }

    pub(super) fn mean(&self, values: &[f64]) -> f64 {
        values.iter().zip(&self.areas).map(|(value, area)| value * area).sum()
    }

    pub(super) fn values(&self, map: &[f64]) -> Vec<f64> {
        self.samples.iter().map(|s| s.of(map)).collect()
    }

    /// Covariance of the values of two maps over the region.
    pub(super) fn covariance(&self, a: &[f64], b: &[f64]) -> f64 {
        let (mean_a, mean_b) = (self.mean(a), self.mean(b));
        let products = a.iter().zip(b).zip(&self.areas);
        products.map(|((a, b), area)| (a - mean_a) * (b - mean_b) * area).sum()
    }

    pub(super) fn levels(&self, map: &[f64], peak: f64) -> Levels {
        let values = self.values(map);
        let extremes = || values[..self.extremes].iter().copied();
        Levels {
            low: match &self.valley {
                Some(valley) => valley.minimum(map),
                None => extremes().fold(f64::INFINITY, f64::min),
            },
            high: match self.valley {
                Some(_) => peak,
                None => extremes().fold(f64::NEG_INFINITY, f64::max),
            },
            mean: self.mean(&values),
            variance: self.covariance(&values, &values),
        }
    }

    /// Places of the extremes of `map`.
    pub(super) fn picks(&self, map: &[f64]) -> Picks {
        let values = self.values(map);
        let places: Vec<usize> = (0..self.extremes).collect();
        let low = || Pick::Sample(self.samples[smallest(&values, &places)]);
        Picks {
            low: self.valley.as_ref().map_or_else(low, |v| Pick::Valley(v.lowest(map))),
            high: Pick::Sample(self.samples[largest(&values[..self.extremes]).0]),
        }
    }

    /// Levels of `map` with the extremes at given places.
    pub(super) fn at(&self, map: &[f64], picks: &Picks, peak: &Sample) -> Levels {
        let values = self.values(map);
        Levels {
            low: picks.low.of(map),
            high: if self.valley.is_some() { peak.of(map) } else { picks.high.of(map) },
            mean: self.mean(&values),
            variance: self.covariance(&values, &values),
        }
    }

    /// What one of two halves has where the other has its extremes, and their covariance; no mean.
    pub(super) fn cross(&self, a: &[f64], b: &[f64], at_peak: f64) -> Levels {
        let (in_a, in_b) = (self.picks(a), self.picks(b));
        Levels {
            low: 0.5 * (in_a.low.of(b) + in_b.low.of(a)),
            high: match self.valley {
                Some(_) => at_peak,
                None => 0.5 * (in_a.high.of(b) + in_b.high.of(a)),
            },
            mean: 0.0,
            variance: self.covariance(&self.values(a), &self.values(b)),
        }
    }
}

/// Positions in the unit square: the middles of 3 × 3 parts, then a point in every corner.
pub(super) const POINTS: [[f64; 2]; 13] = {
    const L: f64 = 1.0 / 6.0;
    const M: f64 = 0.5;
    const H: f64 = 5.0 / 6.0;
    [
        [L, L],
        [M, L],
        [H, L],
        [L, M],
        [M, M],
        [H, M],
        [L, H],
        [M, H],
        [H, H],
        [0.05, 0.05],
        [0.95, 0.05],
        [0.05, 0.95],
        [0.95, 0.95],
    ]
};

/// Corners of the rectangle between the outermost LED axes, mm.
pub fn cell(layout: &Layout) -> Option<[[f64; 2]; 2]> {
    let first = *layout.axes_mm.first()?;
    let grow = |[low, high]: [[f64; 2]; 2], axis: &[f64; 2]| {
        [[low[0].min(axis[0]), low[1].min(axis[1])], [high[0].max(axis[0]), high[1].max(axis[1])]]
    };
    Some(layout.axes_mm.iter().fold([first; 2], grow))
}

/// The cell, if it is at least two bins of `grid` wide.
pub(super) fn cell_on(grid: Grid, layout: &Layout) -> Option<[[f64; 2]; 2]> {
    cell(layout).filter(|[low, high]| (0..2).all(|k| high[k] - low[k] >= 2.0 * grid.bin_mm))
}

/// Mean of `map` over the cell; `None` without a cell.
pub fn mean_over_cell(grid: Grid, layout: &Layout, map: &[f64]) -> Option<f64> {
    let region = Sampled::rectangle(grid, cell_on(grid, layout)?);
    Some(region.mean(&region.values(map)))
}

/// Values of `map` at the nine points of the cell; `None` without a cell.
pub fn nine_points(grid: Grid, layout: &Layout, map: &[f64]) -> Option<[f64; 9]> {
    let [low, high] = cell_on(grid, layout)?;
    let points = std::array::from_fn(|k| {
        let at = [0, 1].map(|i| low[i] + POINTS[k][i] * (high[i] - low[i]));
        Sample::at(grid, at).of(map)
    });
    Some(points)
}

/// Positions in a pitch that count as one.
const SAME_PHASE: f64 = 0.1;

/// Positions in a pitch at which points are read that see one phase of it alone.
const PHASES: usize = 12;

/// True of columns and of rows if the nine points see one phase of the pitch there. A phase and its
/// mirror image are one. LEDs that do not stand in rows and columns have no phase.
fn one_phase(layout: &Layout) -> [bool; 2] {
    let is_one = |count: usize| {
        let phase = |u: f64| {
            let place = (u * (count as f64 - 1.0)).rem_euclid(1.0);
            place.min(1.0 - place)
        };
        let phases = [POINTS[0][0], POINTS[1][0]].map(phase);
        count > 1 && (phases[0] - phases[1]).abs() < SAME_PHASE
    };
    layout.counts().map_or([false; 2], |counts| counts.map(is_one))
}

/// True if the nine and thirteen points lie at one phase of the pitch, along rows or columns, and are
/// read at all phases for that reason.
pub fn sees_one_phase(layout: &Layout) -> bool {
    one_phase(layout).contains(&true)
}

/// Places of `points` of the cell; where they see one phase of the pitch, at all phases of it.
pub(super) fn over_phases(
    layout: &Layout,
    [low, high]: [[f64; 2]; 2],
    points: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    let counts = layout.counts().unwrap_or([1; 2]);
    let shifts = [0, 1].map(|k| {
        if !one_phase(layout)[k] {
            return vec![0.0];
        }
        let pitch = (high[k] - low[k]) / (counts[k] as f64 - 1.0);
        let shift = |phase| pitch * (phase as f64 / PHASES as f64 - 0.5);
        (0..PHASES).map(shift).collect()
    });
    let place = |u: f64, k: usize, shift: f64| {
        (low[k] + u * (high[k] - low[k]) + shift).clamp(low[k], high[k])
    };
    let all = points.iter().flat_map(|[u, v]| {
        let of_row = shifts[1].iter().map(move |y| (u, v, y));
        of_row.flat_map(|(u, v, y)| shifts[0].iter().map(move |x| (*u, *v, *x, *y)))
    });
    all.map(|(u, v, x, y)| [place(u, 0, x), place(v, 1, y)]).collect()
}

/// Samples half a bin apart along `segments`, or the bins that these pass through.
pub(super) fn along(grid: Grid, segments: &[[[f64; 2]; 2]], reading: ValleyReading) -> Vec<Sample> {
    if let (ValleyReading::Bins, Some(Valley::Bins(bins))) = (reading, Valley::bins(grid, segments))
    {
        return bins.into_iter().map(Sample::bin).collect();
    }
    let mut samples = Vec::new();
    for [a, b] in segments {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let count = (2.0 * length / grid.bin_mm).ceil().max(1.0) as usize;
        samples.extend((0..count).map(|k| {
            let s = (k as f64 + 0.5) / count as f64;
            Sample::at(grid, [0, 1].map(|i| a[i] + s * (b[i] - a[i])))
        }));
    }
    samples
}
