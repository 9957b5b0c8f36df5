// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cells of equal length that bins of a map lie in: zones, and places of a picture.

use rayon::prelude::*;

use super::map_receiver::Frame;

/// Cells of equal length along an axis that bins lie in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cells {
    /// Lower end, mm.
    pub low_mm: f64,
    /// Length of all, mm.
    pub length_mm: f64,
    /// Number.
    pub count: usize,
}

/// Cells that a bin lies in, with the part of the bin in each.
pub(super) type Parts = Vec<(usize, f64)>;

impl Cells {
    /// Parts of every bin of `frame` in the columns and rows of `zones` over `area` (lower end and length).
    pub fn parts_of_zones(
        zones: [usize; 2],
        area: [[f64; 2]; 2],
        frame: &Frame,
    ) -> [Vec<Parts>; 2] {
        [0, 1].map(|axis| {
            let [low_mm, length_mm] = area[axis];
            Self { low_mm, length_mm, count: zones[axis] }.parts(frame, axis)
        })
    }

    /// Parts of every bin of `frame` along `axis`.
    pub fn parts(&self, frame: &Frame, axis: usize) -> Vec<Parts> {
        let (bin, cell) = (frame.bin_mm[axis], self.length_mm / self.count as f64);
        let of_bin = |k: usize| {
            let from = (frame.low_mm[axis] + k as f64 * bin - self.low_mm) / cell;
            let to = from + bin / cell;
            // Touching is no part, also where positions are rounded.
            let first = (from + 1e-9).floor().max(0.0) as usize;
            let end = ((to - 1e-9).ceil().max(0.0) as usize).min(self.count);
            let part = |c: usize| (to.min(c as f64 + 1.0) - from.max(c as f64)) * cell / bin;
            (first..end).map(|c| (c, part(c))).collect()
        };
        (0..frame.bins[axis]).map(of_bin).collect()
    }
}

/// Part of a bin that lies in any cell.
pub(super) fn inside(parts: &Parts) -> f64 {
    parts.iter().map(|(_, part)| part).sum()
}

/// Mean over the cells of an image of `size` that each bin of `frame` lies in, of the values `at` its
/// places; NaN outside of the panel.
pub(super) fn resampled<const K: usize>(
    size: [usize; 2],
    at: impl Fn(usize) -> [f64; K] + Sync,
    frame: &Frame,
    area: [[f64; 2]; 2],
) -> Vec<[f64; K]> {
    let [x, y] = [0, 1].map(|axis| {
        let [low_mm, length_mm] = area[axis];
        Cells { low_mm, length_mm, count: size[axis] }.parts(frame, axis)
    });
    let mean = |of_y: &Parts, of_x: &Parts| {
        let mut sums = [0.0; K];
        for (j, of_y) in of_y {
            for (i, of_x) in of_x {
                let values = at(j * size[0] + i);
                (0..K).for_each(|k| sums[k] += of_x * of_y * values[k]);
            }
        }
        sums.map(|sum| sum / (inside(of_x) * inside(of_y)))
    };
    let row = |of_y: &Parts| x.iter().map(|of_x| mean(of_y, of_x)).collect::<Vec<_>>();
    let rows: Vec<Vec<[f64; K]>> = y.par_iter().map(row).collect();
    rows.concat()
}
