// SPDX-License-Identifier: MIT OR Apache-2.0
//! The illuminance map: irradiance from power in square bins, averaged over symmetries and
//! smoothed.
//!
//! Both steps are linear and act on every group of paths alone, so errors follow.

use std::ops::Range;

use super::Grouped;

/// A rectangular map of bins centred on the array's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Bins along x.
    pub columns: usize,
    /// Bins along y.
    pub rows: usize,
    /// Side of a bin, mm.
    pub bin_mm: f64,
}

impl Grid {
    /// x (or y, with the count of rows) of the middle of bin `i` of `count`, mm.
    pub fn centre_mm(&self, i: usize, count: usize) -> f64 {
        (i as f64 + 0.5 - 0.5 * count as f64) * self.bin_mm
    }

    /// (x, y) of the middle of bin `k`, mm.
    pub fn middle_mm(&self, k: usize) -> [f64; 2] {
        [
            self.centre_mm(k % self.columns, self.columns),
            self.centre_mm(k / self.columns, self.rows),
        ]
    }

    /// Bilinear interpolation of `map` between bin centres, clamped at the border.
    pub fn at(&self, map: &[f64], x_mm: f64, y_mm: f64) -> f64 {
        let ([low, right, up, both], [a, b]) = self.corners(x_mm, y_mm);
        (1.0 - b) * ((1.0 - a) * map[low] + a * map[right])
            + b * ((1.0 - a) * map[up] + a * map[both])
    }

    /// The four bins about a point (below left, right, above, both) and the fractions of a bin, in
    /// x and y, from the first to the point, clamped at the border.
    pub fn corners(&self, x_mm: f64, y_mm: f64) -> ([usize; 4], [f64; 2]) {
        let place = |v: f64, count: usize| {
            let u = (v / self.bin_mm + 0.5 * count as f64 - 0.5).clamp(0.0, (count - 1) as f64);
            let i = (u.floor() as usize).min(count.saturating_sub(2));
            (i, u - i as f64)
        };
        let ((i, a), (j, b)) = (place(x_mm, self.columns), place(y_mm, self.rows));
        let bin =
            |i: usize, j: usize| j.min(self.rows - 1) * self.columns + i.min(self.columns - 1);
        let bins = [bin(i, j), bin(i + 1, j), bin(i, j + 1), bin(i + 1, j + 1)];
        (bins, [a, b])
    }
}

/// Place and value of the largest bin.
pub fn largest(map: &[f64]) -> (usize, f64) {
    let larger =
        |best: (usize, f64), (k, &v): (usize, &f64)| if v > best.1 { (k, v) } else { best };
    map.iter().enumerate().fold((0, f64::NEG_INFINITY), larger)
}

/// Place and value of the smallest bin.
pub fn smallest(map: &[f64]) -> (usize, f64) {
    let bins = map.iter().copied().enumerate();
    bins.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
}

/// The mean of `map` over blocks of `together` × `together` bins, and the grid of the blocks; both
/// counts are multiples of `together`.
pub fn coarser(map: &[f64], grid: Grid, together: usize) -> (Vec<f64>, Grid) {
    let wide = Grid {
        columns: grid.columns / together,
        rows: grid.rows / together,
        bin_mm: grid.bin_mm * together as f64,
    };
    let mut mean = vec![0.0; wide.columns * wide.rows];
    let share = 1.0 / (together * together) as f64;
    for (j, row) in map.chunks_exact(grid.columns).enumerate() {
        for (i, value) in row.iter().enumerate() {
            mean[j / together * wide.columns + i / together] += value * share;
        }
    }
    (mean, wide)
}

/// Symmetries of array and packages, each including those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symmetry {
    /// None.
    None,
    /// Mirrored in x = 0 and in y = 0.
    Rectangle,
    /// And in x = y.
    Square,
}

impl Symmetry {
    /// Azimuths of the half-planes in which the light is that at `azimuth_deg`, degrees.
    pub fn azimuths(self, azimuth_deg: f64) -> Vec<f64> {
        let a = azimuth_deg;
        match self {
            Self::None => vec![a],
            Self::Rectangle => vec![a, 180.0 - a, 180.0 + a, 360.0 - a],
            Self::Square => (0..4).map(|quarter| a + 90.0 * f64::from(quarter)).collect(),
        }
    }
}

/// Walls or borders of a cell across a map: light of one side is not smoothed into bins of the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Border {
    /// Share of the area of each bin that can be lit.
    pub parts: Vec<f64>,
    /// True of bins beyond walls, whose light is their own.
    pub is_beyond: Vec<bool>,
    /// Bins along x and y of a cell that repeats, where they are whole numbers.
    pub period: Option<[usize; 2]>,
}

impl Border {
    /// `values` of the bins of one side; 0 elsewhere.
    fn side(&self, values: &[f64], is_beyond: bool) -> Vec<f64> {
        let own = |(value, beyond): (&f64, &bool)| if *beyond == is_beyond { *value } else { 0.0 };
        values.iter().zip(&self.is_beyond).map(own).collect()
    }
}

/// Irradiance of every group, W/mm²: power per area of a bin that can be lit (all without a `border`),
/// averaged over the symmetries, smoothed by a Gaussian. A cell that repeats is smoothed as an endless
/// one; of one that no whole bins fill its border takes nothing from beyond.
pub fn smoothed(
    powers: Grouped,
    grid: Grid,
    border: Option<&Border>,
    symmetry: Symmetry,
    sigma_mm: f64,
) -> Grouped {
    let kernel = kernel(sigma_mm / grid.bin_mm);
    let sides = border.map_or_else(Vec::new, |border| {
        let has_beyond = border.is_beyond.contains(&true) && border.period.is_none();
        let sides = if has_beyond { &[false, true][..] } else { &[false] };
        let area = |side: &bool| convolved(&border.side(&border.parts, *side), grid, &kernel);
        sides.iter().map(|side| (*side, area(side))).collect::<Vec<_>>()
    });
    powers.into_map(|power| {
        let mut map = symmetrised(&power, grid, symmetry);
        for v in &mut map {
            *v /= grid.bin_mm * grid.bin_mm;
        }
        let Some(border) = border else { return convolved(&map, grid, &kernel) };
        if let Some(period) = border.period {
            let endless = convolved_cell(&map, grid, period, &kernel);
            let inside = |(value, part): (f64, &f64)| if *part > 0.0 { value } else { 0.0 };
            return endless.into_iter().zip(&border.parts).map(inside).collect();
        }
        let mut smooth = vec![0.0; map.len()];
        for (is_beyond, area) in &sides {
            let light = convolved(&border.side(&map, *is_beyond), grid, &kernel);
            for (bin, value) in smooth.iter_mut().enumerate() {
                if border.is_beyond[bin] == *is_beyond && border.parts[bin] > 0.0 {
                    *value = light[bin] / area[bin];
                }
            }
        }
        smooth
    })
}

/// Convolution of an endless array of a cell of so many bins; light in bins a whole number of cells apart
/// is added up.
fn convolved_cell(map: &[f64], grid: Grid, [nx, ny]: [usize; 2], kernel: &[f64]) -> Vec<f64> {
    let in_cell = |k: usize, columns: usize| (k / columns % ny) * nx + k % columns % nx;
    let mut cell = vec![0.0; nx * ny];
    for (k, value) in map.iter().enumerate() {
        cell[in_cell(k, grid.columns)] += value;
    }
    // With as many whole cells around as the kernel reaches into.
    let cells = [nx, ny].map(|count| 1 + 2 * (kernel.len() - 1).div_ceil(count));
    let wide = Grid { columns: cells[0] * nx, rows: cells[1] * ny, ..grid };
    let all: Vec<f64> =
        (0..wide.columns * wide.rows).map(|k| cell[in_cell(k, wide.columns)]).collect();
    let smooth = convolved(&all, wide, kernel);
    let middle = cells[1] / 2 * ny * wide.columns + cells[0] / 2 * nx;
    let of_bin = |k: usize| {
        let (i, j) = (k % grid.columns % nx, k / grid.columns % ny);
        smooth[middle + j * wide.columns + i]
    };
    (0..map.len()).map(of_bin).collect()
}

/// Mean over the images of the map under its symmetries.
pub fn symmetrised(map: &[f64], grid: Grid, symmetry: Symmetry) -> Vec<f64> {
    if symmetry == Symmetry::None {
        return map.to_vec();
    }
    let (nx, ny) = (grid.columns, grid.rows);
    let images = |i: usize, j: usize| {
        let rows = [j * nx, (ny - 1 - j) * nx];
        [rows[0] + i, rows[0] + nx - 1 - i, rows[1] + i, rows[1] + nx - 1 - i]
    };
    let mean = |bins: [usize; 4]| 0.25 * bins.iter().map(|&bin| map[bin]).sum::<f64>();
    let mut out = vec![0.0; map.len()];
    let mut set = |bins: [usize; 4], value| bins.iter().for_each(|&bin| out[bin] = value);
    for j in 0..ny.div_ceil(2) {
        let first = if symmetry == Symmetry::Square { j } else { 0 };
        for i in first..nx.div_ceil(2) {
            let bins = images(i, j);
            if symmetry == Symmetry::Square {
                let turned = images(j, i);
                let value = 0.5 * (mean(bins) + mean(turned));
                set(bins, value);
                set(turned, value);
            } else {
                set(bins, mean(bins));
            }
        }
    }
    out
}

/// One side of a Gaussian of `sigma` bins, from the middle outwards, cut at 4 σ.
fn kernel(sigma: f64) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil() as usize;
    (0..=reach)
        .map(|k| if k == 0 { 1.0 } else { (-0.5 * (k as f64 / sigma).powi(2)).exp() })
        .collect()
}

/// Separable convolution; at the border the kernel's weight inside the map counts as one.
fn convolved(map: &[f64], grid: Grid, kernel: &[f64]) -> Vec<f64> {
    if kernel.len() == 1 {
        return map.to_vec();
    }
    let columns = grid.columns;
    let mut line = vec![0.0; columns];
    let mut rows = Vec::with_capacity(map.len());
    let in_row = weights(kernel, columns);
    for source in map.chunks_exact(columns) {
        line.fill(0.0);
        for (offset, weight) in offsets(kernel) {
            let (to, from) = overlap(columns, offset);
            add(&mut line[to], &source[from], weight);
        }
        rows.extend(line.iter().zip(&in_row).map(|(value, weight)| value / weight));
    }
    let mut both = Vec::with_capacity(map.len());
    for (row, whole) in weights(kernel, grid.rows).into_iter().enumerate() {
        line.fill(0.0);
        for (offset, weight) in offsets(kernel) {
            if let Some(from) = row.checked_add_signed(offset).filter(|from| *from < grid.rows) {
                add(&mut line, &rows[from * columns..][..columns], weight);
            }
        }
        both.extend(line.iter().map(|value| value / whole));
    }
    both
}

/// Distances from a bin, from the lowest up, with the kernel's weight there.
fn offsets(kernel: &[f64]) -> impl Iterator<Item = (isize, f64)> {
    let reach = kernel.len() as isize - 1;
    (-reach..=reach).map(|offset| (offset, kernel[offset.unsigned_abs()]))
}

/// Bins of `count` that have a neighbour at `offset`, and these neighbours.
fn overlap(count: usize, offset: isize) -> (Range<usize>, Range<usize>) {
    let (far, rest) =
        (offset.unsigned_abs().min(count), count.saturating_sub(offset.unsigned_abs()));
    let (low, high) = (0..rest, far..count);
    if offset < 0 { (high, low) } else { (low, high) }
}

/// Weight of the kernel inside a line of `count` bins, about each of them.
fn weights(kernel: &[f64], count: usize) -> Vec<f64> {
    let mut sums = vec![0.0; count];
    for (offset, weight) in offsets(kernel) {
        let (to, _) = overlap(count, offset);
        sums[to].iter_mut().for_each(|sum| *sum += weight);
    }
    sums
}

fn add(to: &mut [f64], from: &[f64], weight: f64) {
    for (sum, value) in to.iter_mut().zip(from) {
        *sum += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { columns: 21, rows: 21, bin_mm: 0.1 };

    #[test]
    fn smoothing_keeps_power_and_spreads_by_sigma() {
        let mut power = vec![0.0; 441];
        power[10 * 21 + 10] = 1.0;
        let map =
            smoothed(Grouped::new(vec![power, vec![0.0; 441]]), GRID, None, Symmetry::Square, 0.1);
        let total: f64 = map.total().iter().sum::<f64>() * 0.01;
        assert!((total - 1.0).abs() < 1e-12);
        // Second moment of the discrete Gaussian of σ = one bin.
        let moment: f64 =
            (0..441).map(|k| map.total()[k] * 0.01 * GRID.centre_mm(k % 21, 21).powi(2)).sum();
        assert!((moment.sqrt() - 0.1).abs() < 1e-4, "sigma {}", moment.sqrt());
    }

    #[test]
    fn walls_through_bins_leave_even_light_even() {
        // Walls leave 0.3 of the outer rows and columns but one, and nothing of the outer ones.
        let along = |k: usize| match k {
            0 | 20 => 0.0,
            1 | 19 => 0.3,
            _ => 1.0,
        };
        let part = |k: usize| along(k % 21) * along(k / 21);
        let parts: Vec<f64> = (0..441).map(part).collect();
        let even = Grouped::new(vec![parts.clone(); 2]);
        for sigma_mm in [0.0, 0.05, 0.2] {
            for symmetry in [Symmetry::Square, Symmetry::Rectangle] {
                let is_beyond = vec![false; 441];
                let border = Border { parts: parts.clone(), is_beyond, period: None };
                let map = smoothed(even.clone(), GRID, Some(&border), symmetry, sigma_mm);
                for k in (0..441).filter(|k| part(*k) > 0.0) {
                    // 2 W in each 0.01 mm² by both groups.
                    assert!((map.total()[k] - 200.0).abs() < 1e-9, "{k}: {}", map.total()[k]);
                }
            }
        }
    }

    /// Bright within walls, dark beyond them: neither tells of the other.
    #[test]
    fn light_beyond_walls_is_smoothed_by_itself() {
        let is_within = |k: usize| (5..16).contains(&(k % 21)) && (5..16).contains(&(k / 21));
        let light = (0..441).map(|k| if is_within(k) { 3.0 } else { 1.0 }).collect();
        let border = Border {
            parts: vec![1.0; 441],
            is_beyond: (0..441).map(|k| !is_within(k)).collect(),
            period: None,
        };
        let map = smoothed(
            Grouped::new(vec![light, vec![0.0; 441]]),
            GRID,
            Some(&border),
            Symmetry::None,
            0.2,
        );
        for (k, value) in map.total().iter().enumerate() {
            let exact = if is_within(k) { 300.0 } else { 100.0 };
            assert!((value - exact).abs() < 1e-9, "{k}: {value}");
        }
    }

    /// A cosine over a cell of 15 bins, whose border cuts the outer ones in half, keeps its shape.
    #[test]
    fn a_cell_that_repeats_is_smoothed_without_end() {
        let grid = Grid { columns: 20, rows: 20, bin_mm: 0.1 };
        let share = |k: usize| match k {
            2 | 17 => 0.5,
            3..17 => 1.0,
            _ => 0.0,
        };
        let phase = |k: usize| std::f64::consts::TAU * grid.centre_mm(k, 20) / 1.5;
        let part = |k: usize| share(k % 20) * share(k / 20);
        let exact =
            |k: usize, depth: f64| 1.0 + depth * (phase(k % 20).cos() + phase(k / 20).cos());
        let powers = (0..400).map(|k| 0.01 * part(k) * exact(k, 0.4)).collect();
        let border = Border {
            parts: (0..400).map(part).collect(),
            is_beyond: vec![false; 400],
            period: Some([15, 15]),
        };
        let powers = Grouped::new(vec![powers, vec![0.0; 400]]);
        let map = smoothed(powers, grid, Some(&border), Symmetry::Square, 0.2);
        // A Gaussian of σ = 2 bins damps a wave of 15 bins.
        let depth = 0.4 * (-0.5 * (std::f64::consts::TAU * 2.0 / 15.0).powi(2)).exp();
        for k in 0..400 {
            let exact = if part(k) > 0.0 { exact(k, depth) } else { 0.0 };
            assert!((map.total()[k] - exact).abs() < 1e-3, "{k}: {} {exact}", map.total()[k]);
        }
    }

    #[test]
    fn wider_bins_have_the_mean_of_their_parts() {
        let map: Vec<f64> = (0..441).map(f64::from).collect();
        let (wide, grid) = coarser(&map, GRID, 7);
        assert!((grid.columns, grid.rows) == (3, 3) && (grid.bin_mm - 0.7).abs() < 1e-15);
        // The middle of a bin of 7 x 7 is its mean where the map is linear: bin (1, 2) has its
        // middle at (10, 17).
        assert!((wide[2 * 3 + 1] - f64::from(17 * 21 + 10)).abs() < 1e-9);
        assert!((grid.centre_mm(2, 3) - GRID.centre_mm(17, 21)).abs() < 1e-12);
        assert_eq!(coarser(&map, GRID, 1), (map, GRID));
    }

    #[test]
    fn symmetric_mean_has_all_eight_images() {
        let mut map = vec![0.0; 441];
        map[3 * 21 + 8] = 8.0;
        let mean = symmetrised(&map, GRID, Symmetry::Square);
        for (i, j) in [(8, 3), (12, 3), (8, 17), (12, 17), (3, 8), (3, 12), (17, 8), (17, 12)] {
            assert!((mean[j * 21 + i] - 1.0).abs() < 1e-15);
        }
        assert!((mean.iter().sum::<f64>() - 8.0).abs() < 1e-12);
    }

    #[test]
    fn interpolation_is_exact_on_planes() {
        let map: Vec<f64> = (0..441)
            .map(|k| 2.0 + 3.0 * GRID.centre_mm(k % 21, 21) - GRID.centre_mm(k / 21, 21))
            .collect();
        for (x, y) in [(0.0, 0.0), (0.33, -0.71), (-1.0, 1.0), (0.999, 0.2)] {
            assert!((GRID.at(&map, x, y) - (2.0 + 3.0 * x - y)).abs() < 1e-12);
        }
    }
}
