// SPDX-License-Identifier: MIT OR Apache-2.0
//! A function given by a table, linear between its rows.

use super::MaterialError;

/// Values at ascending wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    rows: Vec<[f64; 2]>,
    /// Wavelengths that stood below a longer one, and that were given more than once.
    misplaced: Vec<f64>,
    repeated: Vec<f64>,
}

impl Table {
    /// Rows [wavelength, value]; at least one, wavelengths above 0. Rows are sorted; those of one
    /// wavelength become one with their mean.
    pub(super) fn new(mut rows: Vec<[f64; 2]>) -> Result<Self, MaterialError> {
        if rows.is_empty() {
            return Err(MaterialError::EmptyTable);
        }
        if let Some(&[got, _]) = rows.iter().find(|r| !(r[0].is_finite() && r[0] > 0.0)) {
            return Err(MaterialError::Wavelength { got });
        }
        if let Some((row, &[_, got])) = (1..).zip(&rows).find(|(_, r)| !r[1].is_finite()) {
            return Err(MaterialError::Value { row, got });
        }
        let falls = |pair: &[[f64; 2]]| (pair[1][0] < pair[0][0]).then_some(pair[1][0]);
        let misplaced = rows.windows(2).filter_map(falls).collect();
        rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let same = |a: &[f64; 2], b: &[f64; 2]| a[0].to_bits() == b[0].to_bits();
        let groups = || rows.chunk_by(same);
        let repeated = groups().filter(|group| group.len() > 1).map(|group| group[0][0]).collect();
        let mean = |group: &[[f64; 2]]| {
            let first = group[0][1];
            let off: f64 = group.iter().map(|row| row[1] - first).sum();
            [group[0][0], first + off / group.len() as f64]
        };
        let rows = groups().map(mean).collect();
        Ok(Self { rows, misplaced, repeated })
    }

    /// Rows that were out of order, and those of one wavelength.
    pub(super) fn repairs(&self) -> [&[f64]; 2] {
        [&self.misplaced, &self.repeated]
    }

    /// First and last wavelength.
    pub(super) fn range(&self) -> [f64; 2] {
        [self.rows[0][0], self.rows[self.rows.len() - 1][0]]
    }

    /// The lowest value.
    pub(super) fn lowest(&self) -> f64 {
        self.rows.iter().map(|r| r[1]).fold(f64::INFINITY, f64::min)
    }

    /// The value at a wavelength inside the range.
    pub(super) fn at(&self, wavelength: f64) -> f64 {
        let above = self.rows.partition_point(|r| r[0] < wavelength);
        let [x1, y1] = self.rows[above.min(self.rows.len() - 1)];
        if above == 0 || x1 <= wavelength {
            return y1;
        }
        let [x0, y0] = self.rows[above - 1];
        let t = (wavelength - x0) / (x1 - x0);
        y0 + t * (y1 - y0)
    }
}
