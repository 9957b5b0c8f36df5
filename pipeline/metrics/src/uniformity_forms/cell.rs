// SPDX-License-Identifier: MIT OR Apache-2.0
//! The cell between the outermost LEDs, a stated area, and the points in them.

use crate::illuminance::Grid;
use crate::layout::{Area, Layout};
use crate::sample::Sample;
use crate::sampled::Sampled;

/// Positions in the unit square: the middles of 3 × 3 parts, then a point in every corner.
pub(crate) const POINTS: [[f64; 2]; 13] = {
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
pub fn cell(layout: &Layout) -> Option<Area> {
    let first = *layout.axes_mm.first()?;
    let grow = |[low, high]: [[f64; 2]; 2], axis: &[f64; 2]| {
        [[low[0].min(axis[0]), low[1].min(axis[1])], [high[0].max(axis[0]), high[1].max(axis[1])]]
    };
    Some(layout.axes_mm.iter().fold([first; 2], grow))
}

/// The cell, if it is at least two bins of `grid` wide.
pub(crate) fn cell_on(grid: Grid, layout: &Layout) -> Option<Area> {
    cell(layout).filter(|[low, high]| (0..2).all(|k| high[k] - low[k] >= 2.0 * grid.bin_mm))
}

/// Bins that a mean of a map is taken over.
#[derive(Debug, Clone)]
pub struct MapMean(Sampled);

impl MapMean {
    /// Over the cell of `layout` on `grid`, of whose bins these parts are `counted`; `None` where it is
    /// not two bins wide.
    pub fn of_cell(grid: Grid, counted: Option<&[f64]>, layout: &Layout) -> Option<Self> {
        cell_on(grid, layout).map(|corners| Self(Sampled::rectangle(grid, counted, corners)))
    }

    /// Over the values at points (x, y), mm, between bins that are `counted`.
    pub fn of_points(grid: Grid, counted: Option<&[f64]>, points_mm: &[[f64; 2]]) -> Self {
        let samples = points_mm.iter().map(|at| Sample::at(grid, counted, *at));
        Self(Sampled::points(samples.collect()))
    }

    /// Mean of `map`.
    pub fn of(&self, map: &[f64]) -> f64 {
        self.0.mean(map)
    }
}

/// Values of `map` at the nine points of the cell, at all phases of the pitch where they see one,
/// between the bins that are counted; `None` without a cell.
pub fn nine_points(
    (grid, counted): (Grid, Option<&[f64]>),
    layout: &Layout,
    spot_mm: Option<f64>,
    map: &[f64],
) -> Option<Vec<f64>> {
    let spot = spot_mm.map(|diameter_mm| [diameter_mm; 2]);
    let area = cell_on(grid, layout)?;
    let samples = samples((grid, counted), layout, area, (&POINTS[..9], spot));
    Some(samples.iter().map(|sample| sample.of(map)).collect())
}

/// Samples of `map` at `points` of an area, of bins that are counted: means over spots of these
/// diameters along x and y, or values at points.
pub(crate) fn samples(
    (grid, counted): (Grid, Option<&[f64]>),
    layout: &Layout,
    area: Area,
    (points, spot): (&[[f64; 2]], Option<[f64; 2]>),
) -> Vec<Sample> {
    let sample = |at| match spot {
        Some(diameters_mm) => Sample::spot(grid, counted, at, diameters_mm),
        None => Sample::at(grid, counted, at),
    };
    over_phases(layout, area, points).into_iter().map(sample).collect()
}

/// Positions in a pitch that count as one.
const SAME_PHASE: f64 = 0.1;

/// Positions in a pitch at which points are read that see one phase of it alone.
pub const PHASES: usize = 12;

/// The distance of columns and of rows, where the nine points of the area see one phase of it. A
/// phase and its mirror image are one. LEDs that do not stand in rows and columns have no phase.
fn one_phase(layout: &Layout, [low, high]: Area) -> [Option<f64>; 2] {
    let Some(lattice) = layout.lattice() else {
        return [None; 2];
    };
    [0, 1].map(|k| {
        let [first, step] = lattice[k];
        let phase = |point: &[f64; 2]| {
            let at = low[k] + point[k] * (high[k] - low[k]);
            let place = ((at - first) / step).rem_euclid(1.0);
            place.min(1.0 - place)
        };
        let phases = || POINTS[..9].iter().map(phase);
        let spread = phases().fold(0.0, f64::max) - phases().fold(1.0, f64::min);
        (step > 0.0 && spread < SAME_PHASE).then_some(step)
    })
}

/// True if the nine and thirteen points of the area lie at one phase of the pitch, along rows or
/// columns, and are read at all phases for that reason.
pub fn sees_one_phase(layout: &Layout, area: Area) -> bool {
    one_phase(layout, area).iter().any(Option::is_some)
}

/// Places of `points` of the area; where they see one phase of the pitch, at all phases of it.
fn over_phases(layout: &Layout, [low, high]: Area, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let shifts = one_phase(layout, [low, high]).map(|pitch| {
        let Some(pitch) = pitch else { return vec![0.0] };
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
