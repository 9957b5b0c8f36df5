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
    /// Offset of each package from its place, likewise, mm; empty for nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub offsets_mm: Vec<[f64; 2]>,
    /// Turn of each package beside that of its file, likewise, degrees; empty for nothing.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub turns_deg: Vec<f64>,
    /// Size of each package over that of its file, likewise; empty for 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scales: Vec<f64>,
    /// Size over that of the stated package, as the file of positions states it; empty for 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub stated_scales: Vec<f64>,
}

/// Turn of a package about its axis, and its size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Counterclockwise as seen from above, degrees.
    pub turn_deg: f64,
    /// All its lengths over those of the package as stated.
    pub scale: f64,
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
        /// Turn of each package about its axis, degrees; empty for nothing.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        turns_deg: Vec<f64>,
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
            _ if self.is_offset() => "array.offsets_mm",
            PackagePositions::Grid { .. } => "array.pitch_mm",
            PackagePositions::List { .. } => "array.positions_file",
        }
    }

    /// True if a package stands off its place.
    pub fn is_offset(&self) -> bool {
        self.offsets_mm.iter().flatten().any(|along| *along != 0.0)
    }

    /// True if a package has a turn beside that of its file.
    pub fn has_own_turns(&self) -> bool {
        self.turns_deg.iter().any(|turn| *turn != 0.0)
    }

    /// Turns of the packages that their file states, degrees; empty for nothing.
    pub fn stated_turns_deg(&self) -> &[f64] {
        match &self.positions {
            PackagePositions::Grid { .. } => &[],
            PackagePositions::List { turns_deg, .. } => turns_deg,
        }
    }

    /// Turn of a package about its axis, degrees.
    pub fn turn_deg(&self, package: usize) -> f64 {
        let turns = [self.stated_turns_deg(), &self.turns_deg];
        turns.into_iter().filter_map(|turns| turns.get(package)).sum()
    }

    /// True if a package is turned.
    pub fn is_turned(&self) -> bool {
        (0..self.count()).any(|package| self.turn_deg(package) != 0.0)
    }

    /// All lengths of a package over those of the package as stated, 0.25 to 4: 0.5 to 2 by its file times
    /// 0.5 to 2 of its own.
    pub fn scale(&self, package: usize) -> f64 {
        let scales = [&self.stated_scales, &self.scales];
        scales.into_iter().filter_map(|scales| scales.get(package)).product()
    }

    /// Turn and size of a package.
    pub fn pose(&self, package: usize) -> Pose {
        Pose { turn_deg: self.turn_deg(package), scale: self.scale(package) }
    }

    /// The least and the largest size of a package over the stated one.
    pub fn scale_range(&self) -> [f64; 2] {
        let scales = (0..self.count()).map(|package| self.scale(package));
        scales
            .fold([f64::INFINITY, 0.0], |[least, most], scale| [least.min(scale), most.max(scale)])
    }

    /// True if a package has another size than the stated one.
    pub fn is_scaled(&self) -> bool {
        self.scale_range().map(f64::to_bits) != [1.0_f64.to_bits(); 2]
    }

    /// True if a package has a size beside that of its file.
    pub fn has_own_scales(&self) -> bool {
        self.scales.iter().any(|scale| scale.to_bits() != 1.0_f64.to_bits())
    }

    /// Where the axes of the packages stand, (x, y) in mm, row after row.
    pub fn axes_mm(&self) -> Vec<[f64; 2]> {
        let mut axes = self.places_mm();
        for ([x, y], [along_x, along_y]) in axes.iter_mut().zip(&self.offsets_mm) {
            *x += along_x;
            *y += along_y;
        }
        axes
    }

    /// Places of the axes of the packages without their offsets, likewise: what board, walls and
    /// maps follow.
    pub fn places_mm(&self) -> Vec<[f64; 2]> {
        let (columns, rows, arrangement) = match &self.positions {
            PackagePositions::List { positions_mm, .. } => return positions_mm.clone(),
            PackagePositions::Grid { columns, rows, arrangement } => {
                (*columns, *rows, *arrangement)
            }
        };
        let middle = |k: usize, n: usize| k as f64 - 0.5 * (n as f64 - 1.0);
        let [pitch_x, pitch_y] = self.pitch_mm.along();
        let rows_mm = match self.pitch_mm {
            Pitch::Same(pitch_mm) => pitch_mm * 0.75_f64.sqrt(),
            Pitch::Along(_) => pitch_y,
        };
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
                    [(x + shift) * pitch_x, y * rows_mm]
                }
            }
        };
        (0..rows).flat_map(|j| (0..columns).map(move |i| at(i, j))).collect()
    }
}
