// SPDX-License-Identifier: MIT OR Apache-2.0
//! Places of packages in columns and rows, and the traced place that stands for each.
//!
//! The whole array may be larger than that of the design, at the same pitch, with walls, plates and
//! films as far from its outermost packages. The outer half of the traced array then stands for the
//! packages near each wall, and its middle for all others.

use anyhow::{Result, ensure};

use design::Design;

use simulate::observation::layout;

/// Packages along a side of a traced array that stands for a larger one, at least: two packages
/// away from the middle tell how the light falls off.
const MIN_TRACED: usize = 5;

/// Places of the packages of an array.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Columns and rows that are traced: those of the design.
    pub traced: [usize; 2],
    /// Columns and rows of the whole array.
    pub whole: [usize; 2],
    /// Distance of columns and of rows, mm; of a single one that which the design states.
    pub pitch_mm: [f64; 2],
    /// (x, y) of the first package of the whole array, mm.
    first_mm: [f64; 2],
    /// Number in the design of the package in each column of each row.
    numbers: Vec<usize>,
}

impl Places {
    /// The places of `design`, or of a larger array of `whole` columns and rows.
    ///
    /// # Errors
    /// Packages that stand otherwise than in full rows; a whole array that is smaller, or larger
    /// than so few packages can stand for.
    pub fn new(design: &Design, whole: Option<[usize; 2]>) -> Result<Self> {
        ensure!(
            design.array.drives.is_none(),
            "array.positions_file: expected positions without powers for zones, whose levels say what each package emits"
        );
        ensure!(
            whole.is_none() || design.prints.is_empty(),
            "--packages: expected none with [[prints]]: ink of the design does not repeat from package to package"
        );
        let axes = design.array.axes_mm();
        let Some([[left, across], [low, along]]) = layout(design).lattice() else {
            anyhow::bail!(
                "array: expected packages in full, evenly spaced rows at right angles for zones, got others"
            );
        };
        let (first_mm, stated) = ([left, low], design.array.pitch_mm.along());
        let even = [across, along];
        let pitch_mm = [0, 1].map(|k| if even[k] > 0.0 { even[k] } else { stated[k] });
        let place = |axis: &[f64; 2]| {
            [0, 1].map(|k| ((axis[k] - first_mm[k]) / pitch_mm[k]).round() as usize)
        };
        let places: Vec<[usize; 2]> = axes.iter().map(place).collect();
        let traced = [0, 1].map(|k| places.iter().map(|at| at[k]).max().unwrap_or(0) + 1);
        let mut numbers = vec![0; axes.len()];
        for (number, [i, j]) in places.into_iter().enumerate() {
            numbers[j * traced[0] + i] = number;
        }
        let whole = whole.unwrap_or(traced);
        for k in 0..2 {
            let (name, most) = (["columns", "rows"][k], traced[k]);
            ensure!(
                whole[k] == most || whole[k] > most && most >= MIN_TRACED,
                "--packages: expected {most} {name} as in the design{}, got {}",
                if most >= MIN_TRACED {
                    " or more".to_owned()
                } else {
                    format!(", whose array stands for a larger one from {MIN_TRACED} {name}")
                },
                whole[k]
            );
        }
        let first_mm =
            [0, 1].map(|k| first_mm[k] - 0.5 * (whole[k] - traced[k]) as f64 * pitch_mm[k]);
        Ok(Self { traced, whole, pitch_mm, first_mm, numbers })
    }

    /// True if the traced array stands for a larger one along an axis.
    pub fn is_extended(&self, axis: usize) -> bool {
        self.whole[axis] > self.traced[axis]
    }

    /// Packages of the whole array.
    pub fn count(&self) -> usize {
        self.whole[0] * self.whole[1]
    }

    /// The traced column (`axis` 0) or row that stands for number `i` of the whole array.
    pub fn stand_in(&self, axis: usize, i: usize) -> usize {
        let (traced, whole) = (self.traced[axis], self.whole[axis]);
        if whole == traced {
            return i;
        }
        let (reach, from_end) = (self.reach(axis), whole - 1 - i);
        if i <= from_end { i.min(reach) } else { traced - 1 - from_end.min(reach) }
    }

    /// Packages from the one that stands for the inner ones to the nearest wall.
    pub fn reach(&self, axis: usize) -> usize {
        (self.traced[axis] - 1) / 2
    }

    /// The number in the design of the package in column and row.
    pub fn number(&self, [i, j]: [usize; 2]) -> usize {
        self.numbers[j * self.traced[0] + i]
    }

    /// Drives of the packages of the design, in its order, from those of the packages in columns
    /// and rows.
    pub fn in_order(&self, drives: &[f64]) -> Vec<f64> {
        let mut ordered = vec![0.0; self.numbers.len()];
        for (number, drive) in self.numbers.iter().zip(drives) {
            ordered[*number] = *drive;
        }
        ordered
    }

    /// Places of all packages of the whole array, mm, row after row.
    pub fn axes_mm(&self) -> Vec<[f64; 2]> {
        let at = |k: usize, i: usize| self.first_mm[k] + i as f64 * self.pitch_mm[k];
        let row = |j: usize| (0..self.whole[0]).map(move |i| [at(0, i), at(1, j)]);
        (0..self.whole[1]).flat_map(row).collect()
    }

    /// Lower end and length of the area of all packages along an axis, mm: half a pitch beyond the
    /// outermost axes.
    pub fn area_mm(&self, axis: usize) -> [f64; 2] {
        let pitch = self.pitch_mm[axis];
        [self.first_mm[axis] - 0.5 * pitch, self.whole[axis] as f64 * pitch]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use design::schema::Pitch;

    fn square(count: usize) -> Design {
        let mut design = design::embedded("d1.toml").expect("valid");
        design.array.positions = design::resolved::array::PackagePositions::Grid {
            columns: count,
            rows: count,
            arrangement: design::schema::Arrangement::Square,
        };
        design.array.pitch_mm = Pitch::Same(8.0);
        design
    }

    #[test]
    fn the_middle_stands_for_all_that_are_far_from_walls() {
        for (traced, expected) in [
            (5, [0, 1, 2, 2, 2, 2, 2, 3, 4]),
            (6, [0, 1, 2, 2, 2, 3, 3, 4, 5]),
            (9, [0, 1, 2, 3, 4, 5, 6, 7, 8]),
        ] {
            let places = Places::new(&square(traced), Some([9, 9])).expect("large enough");
            let found: Vec<usize> = (0..9).map(|i| places.stand_in(0, i)).collect();
            assert_eq!(found, expected, "{traced}");
            let are_equal = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-12);
            assert!(are_equal(places.axes_mm()[80], [32.0, 32.0]));
            assert!(are_equal(places.area_mm(1), [-36.0, 72.0]));
        }
    }

    #[test]
    fn arrays_that_stand_for_no_other_are_refused() {
        for (traced, whole) in [(4, [9, 9]), (5, [9, 4]), (9, [5, 9])] {
            let error = Places::new(&square(traced), Some(whole)).expect_err("refused");
            assert!(error.to_string().starts_with("--packages: expected"), "{error}");
        }
        let mut hexagonal = square(5);
        hexagonal.array.positions = design::resolved::array::PackagePositions::Grid {
            columns: 5,
            rows: 5,
            arrangement: design::schema::Arrangement::Hexagonal,
        };
        let error = Places::new(&hexagonal, None).expect_err("refused");
        assert!(error.to_string().starts_with("array: expected packages in full"), "{error}");
    }
}
