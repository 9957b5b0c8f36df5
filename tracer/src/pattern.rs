// SPDX-License-Identifier: MIT OR Apache-2.0
//! Patterns over the place: where a level surface is printed, where a film has particles.

use rand::Rng;

use crate::error::Error;
use crate::random;

/// Marks in equal rectangular cells side by side; nothing is printed around them.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    /// The corner of the lowest x and y, mm.
    low: [f64; 2],
    /// Lengths of a cell, mm.
    cell: [f64; 2],
    columns: usize,
    rows: usize,
    marks: Marks,
}

/// What is printed in the cells, along x, row after row from the lowest y.
#[derive(Debug, Clone, PartialEq)]
pub enum Marks {
    /// A round dot about the middle: its radius, mm, at most half of the cell.
    Dots(Vec<f32>),
    /// A share of the area, 0 to 1, in grains much finer than all else: chance decides.
    Shares(Vec<f32>),
}

impl Pattern {
    /// A pattern of `columns` cells along x, about the origin; `cell` are the lengths of a cell, mm.
    ///
    /// # Errors
    /// No whole rows, dots that overlap, shares beyond 1.
    pub fn new(cell: [f64; 2], columns: usize, marks: Marks) -> Result<Self, Error> {
        let (what, expected, most) = match &marks {
            Marks::Dots(_) => {
                ("radius of a dot in mm", "0 to half of its cell", 0.5 * cell[0].min(cell[1]))
            }
            Marks::Shares(_) => ("printed share", "0 to 1", 1.0),
        };
        let (Marks::Dots(values) | Marks::Shares(values)) = &marks;
        let refuse =
            |what: &str, expected, got| Err(Error::Number { what: what.to_owned(), expected, got });
        if columns == 0 || values.len() % columns != 0 {
            return refuse("cells of a pattern", "whole rows", values.len() as f64);
        }
        // A radius in single precision may be rounded up.
        let fits = |value: &f32| (0.0..=most * (1.0 + 1e-6)).contains(&f64::from(*value));
        if let Some(value) = values.iter().find(|value| !fits(value)) {
            return refuse(what, expected, f64::from(*value));
        }
        let rows = values.len() / columns;
        let counts = [columns, rows];
        let low = [0, 1].map(|k| -0.5 * cell[k] * counts[k] as f64);
        Ok(Self { low, cell, columns, rows, marks })
    }

    /// True where the pattern is printed.
    pub(crate) fn covers(&self, at: [f64; 2], rng: &mut impl Rng) -> bool {
        let [x, y] = [0, 1].map(|k| (at[k] - self.low[k]) / self.cell[k]);
        let is_inside = x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64;
        if !is_inside {
            return false;
        }
        let number = y as usize * self.columns + x as usize;
        match &self.marks {
            Marks::Dots(radii) => {
                let from_middle = [x.fract() - 0.5, y.fract() - 0.5];
                let [across, up] = [0, 1].map(|k| from_middle[k] * self.cell[k]);
                across.hypot(up) < f64::from(radii[number])
            }
            Marks::Shares(shares) => random::unit(rng) < f64::from(shares[number]),
        }
    }

    /// The share of the cells that is printed.
    pub fn coverage(&self) -> f64 {
        let area = self.cell[0] * self.cell[1];
        let (Marks::Dots(values) | Marks::Shares(values)) = &self.marks;
        let share = |value: &f32| match self.marks {
            Marks::Dots(_) => std::f64::consts::PI * f64::from(*value).powi(2) / area,
            Marks::Shares(_) => f64::from(*value),
        };
        values.iter().map(share).sum::<f64>() / values.len() as f64
    }

    /// True if it is its own image in the planes across x and y through its middle.
    pub fn is_mirrored(&self) -> bool {
        let (Marks::Dots(values) | Marks::Shares(values)) = &self.marks;
        let rows = || values.chunks(self.columns);
        rows().eq(rows().rev()) && rows().all(|row| row.iter().eq(row.iter().rev()))
    }
}
