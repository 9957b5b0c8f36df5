// SPDX-License-Identifier: MIT OR Apache-2.0
//! The packages of a checked design, side by side.

use serde::Serialize;

use crate::schema::{Arrangement, Pitch, is_default};

/// Packages side by side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Array {
    /// Places.
    #[serde(flatten)]
    pub positions: PackagePositions,
    /// Distances of neighbours; in a list the least one allowed.
    pub pitch_mm: Pitch,
    /// True if light of one package meets the others.
    pub crossing: bool,
    /// Power of each package over that of full drive, in the order of [`Self::axes_mm`]; `None`
    /// where all are at 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drives: Option<Vec<f64>>,
}

/// Places of packages.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum PackagePositions {
    /// On a grid about the origin.
    Grid {
        /// Packages along x.
        columns: usize,
        /// Packages along y.
        rows: usize,
        /// Places of the rows.
        #[serde(skip_serializing_if = "is_default")]
        arrangement: Arrangement,
    },
    /// One by one, as a file states them.
    List {
        /// (x, y) of each axis, mm.
        positions_mm: Vec<[f64; 2]>,
        /// The file.
        #[serde(skip)]
        file: String,
    },
}

impl PackagePositions {
    /// A package alone at the origin.
    pub const SINGLE: Self = Self::Grid { columns: 1, rows: 1, arrangement: Arrangement::Square };
}

impl Array {
    /// Number of packages.
    pub fn count(&self) -> usize {
        match &self.positions {
            PackagePositions::Grid { columns, rows, .. } => columns * rows,
            PackagePositions::List { positions_mm, .. } => positions_mm.len(),
        }
    }

    /// Columns and rows that stand at right angles, as the symmetries and the figures of uniformity
    /// take for granted.
    pub fn rectangle(&self) -> Option<[usize; 2]> {
        match self.positions {
            PackagePositions::Grid { columns, rows, arrangement: Arrangement::Square } => {
                Some([columns, rows])
            }
            _ => None,
        }
    }

    /// The key of the design file that says how near packages stand.
    pub fn distance_key(&self) -> &'static str {
        match self.positions {
            PackagePositions::Grid { .. } => "array.pitch_mm",
            PackagePositions::List { .. } => "array.positions_file",
        }
    }

    /// Places of the axes of the packages, (x, y) in mm, row after row.
    pub fn axes_mm(&self) -> Vec<[f64; 2]> {
        let (columns, rows, arrangement) = match &self.positions {
            PackagePositions::List { positions_mm, .. } => return positions_mm.clone(),
            PackagePositions::Grid { columns, rows, arrangement } => {
                (*columns, *rows, *arrangement)
            }
        };
        let middle = |k: usize, n: usize| k as f64 - 0.5 * (n as f64 - 1.0);
        let [pitch_x, pitch_y] = self.pitch_mm.along();
        let at = |i: usize, j: usize| {
            let (x, y) = (middle(i, columns), middle(j, rows));
            match arrangement {
                Arrangement::Square => [x * pitch_x, y * pitch_y],
                Arrangement::Hexagonal => {
                    // A quarter of a pitch to either side, so that the array stays centred.
                    let shift = if rows == 1 {
                        0.0
                    } else if j.is_multiple_of(2) {
                        -0.25
                    } else {
                        0.25
                    };
                    [(x + shift) * pitch_x, y * pitch_y * 0.75_f64.sqrt()]
                }
            }
        };
        (0..rows).flat_map(|j| (0..columns).map(move |i| at(i, j))).collect()
    }
}
