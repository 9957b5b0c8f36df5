// SPDX-License-Identifier: MIT OR Apache-2.0
//! A function given by a table, linear between its rows.

use super::MaterialError;

/// Values at ascending wavelengths.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    rows: Vec<[f64; 2]>,
}

impl Table {
    /// Rows [wavelength, value]; at least one, wavelengths above 0 and ascending.
    pub(super) fn new(rows: Vec<[f64; 2]>) -> Result<Self, MaterialError> {
        if rows.is_empty() {
            return Err(MaterialError::EmptyTable);
        }
        if let Some(&[got, _]) = rows.iter().find(|r| !(r[0].is_finite() && r[0] > 0.0)) {
            return Err(MaterialError::Wavelength { got });
        }
        if let Some(i) = rows.windows(2).position(|w| w[1][0] <= w[0][0]) {
            return Err(MaterialError::Order {
                row: i + 2,
                got: rows[i + 1][0],
                before: rows[i][0],
            });
        }
        Ok(Self { rows })
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
