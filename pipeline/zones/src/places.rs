// SPDX-License-Identifier: MIT OR Apache-2.0
//! Places of packages in columns and rows or anywhere, and the traced place that stands for each.
//!
//! The whole array of full rows at right angles may be larger than that of the design, at the same
//! pitch, with walls, plates and films as far from its outermost packages. Packages nearer to a wall
//! than the middle of the stated array are then traced where they stand, and one far from all walls
//! stands for all others.
//!
//! Zones are equal rectangles over the area of all packages: half a pitch beyond the outermost ones,
//! where places follow no rows the pitch p of as many squares, (w + p)(h + p) = N p².

use anyhow::{Result, ensure};

use design::Design;
use design::resolved::array::PackagePositions;

use simulate::observation::layout;

/// Packages along a side of a traced array that stands for a larger one, at least: two packages
/// away from the middle tell how the light falls off.
const MIN_TRACED: usize = 5;

/// Places of the packages of an array.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Columns and rows that the design states.
    pub stated: [usize; 2],
    /// Columns and rows of the array in which responses are traced: as stated, or more.
    pub traced: [usize; 2],
    /// Columns and rows of the whole array.
    pub whole: [usize; 2],
    /// Distance of columns and of rows, mm; of a single one that which the design states.
    pub pitch_mm: [f64; 2],
    /// (x, y) of the first package of the whole array, mm.
    first_mm: [f64; 2],
    /// Lower end and length of the area of all packages along x and y, mm.
    area_mm: [[f64; 2]; 2],
    /// Places of packages that stand in no full rows at right angles, mm, in the order of the design.
    off_lattice_mm: Vec<[f64; 2]>,
    /// Columns and rows of the packages in each zone.
    packages_by_zone: Vec<Vec<[usize; 2]>>,
    /// Number in the design of the package in each column of each row.
    numbers: Vec<usize>,
}

impl Places {
    /// The places of `design`, or of a larger array of `whole` columns and rows. Of a design that was
    /// widened, `stated_packages` are the columns and rows before.
    ///
    /// # Errors
    /// A whole array that is smaller, or larger than so few packages can stand for, or of packages
    /// that differ.
    pub fn new(
        design: &Design,
        whole: Option<[usize; 2]>,
        stated_packages: Option<[usize; 2]>,
    ) -> Result<Self> {
        ensure!(
            design.array.drives.is_none(),
            "array.positions_file: expected positions without powers for zones, whose levels say what each package emits"
        );
        ensure!(
            whole.is_none()
                || !(design.array.is_turned()
                    || design.array.is_scaled()
                    || design.array.is_offset()),
            "--packages: expected none where packages are turned, of other sizes or off their places, which do not repeat"
        );
        let axes = design.array.places_mm();
        let Some([[left, across], [low, along]]) = layout(design).lattice() else {
            ensure!(
                whole.is_none(),
                "--packages: expected none of packages that stand otherwise than in full, evenly spaced rows at right angles"
            );
            return Ok(Self::off_lattice(design, axes));
        };
        let (first_mm, stated) = ([left, low], design.array.pitch_mm.along());
        let even = [across, along];
        let pitch_mm = [0, 1].map(|k| if even[k] > 0.0 { even[k] } else { stated[k] });
        if let (Some(_), Some(print)) = (whole, design.print_of_one_place(pitch_mm)) {
            anyhow::bail!(
                "--packages: expected [[prints]] that repeat from package to package, dots whose pitch divides that of the packages, got {}",
                print.name()
            );
        }
        let place = |axis: &[f64; 2]| {
            [0, 1].map(|k| ((axis[k] - first_mm[k]) / pitch_mm[k]).round() as usize)
        };
        let places: Vec<[usize; 2]> = axes.iter().map(place).collect();
        let traced = [0, 1].map(|k| places.iter().map(|at| at[k]).max().unwrap_or(0) + 1);
        let mut numbers = vec![0; axes.len()];
        for (number, [i, j]) in places.into_iter().enumerate() {
            numbers[j * traced[0] + i] = number;
        }
        let (whole, stated_packages) = (whole.unwrap_or(traced), stated_packages.unwrap_or(traced));
        for k in 0..2 {
            let (name, most) = (["columns", "rows"][k], stated_packages[k]);
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
        let area = |k: usize| [first_mm[k] - 0.5 * pitch_mm[k], whole[k] as f64 * pitch_mm[k]];
        Ok(Self {
            stated: stated_packages,
            traced,
            whole,
            pitch_mm,
            first_mm,
            area_mm: [area(0), area(1)],
            off_lattice_mm: Vec::new(),
            packages_by_zone: Vec::new(),
            numbers,
        })
    }

    /// Places in staggered rows, or in no rows.
    fn off_lattice(design: &Design, axes: Vec<[f64; 2]>) -> Self {
        let ends = [0, 1].map(|k| {
            let along = axes.iter().map(|at| at[k]);
            [along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max)]
        });
        let first_mm = ends.map(|[low, _]| low);
        let [w, h] = ends.map(|[low, high]| high - low);
        let (whole, pitch_mm) = match design.array.positions {
            PackagePositions::Grid { columns, rows, .. } => {
                ([columns, rows], [design.array.pitch_mm.along()[0], h / (rows as f64 - 1.0)])
            }
            PackagePositions::List { .. } => {
                let more = axes.len() as f64 - 1.0;
                let root = ((w + h).powi(2) + 4.0 * more * w * h).sqrt();
                ([axes.len(), 1], [0.5 * (w + h + root) / more; 2])
            }
        };
        let area = |k: usize, length: f64| [first_mm[k] - 0.5 * pitch_mm[k], length + pitch_mm[k]];
        Self {
            stated: whole,
            traced: whole,
            whole,
            pitch_mm,
            first_mm,
            area_mm: [area(0, w), area(1, h)],
            numbers: (0..axes.len()).collect(),
            off_lattice_mm: axes,
            packages_by_zone: Vec::new(),
        }
    }

    /// True of full rows at right angles.
    pub fn is_lattice(&self) -> bool {
        self.off_lattice_mm.is_empty()
    }

    /// True of places that a file states in no full rows at right angles.
    pub fn are_free(&self) -> bool {
        !self.is_lattice() && self.whole[1] == 1
    }

    /// Deals the packages to zones.
    ///
    /// # Errors
    /// Zones that do not divide full rows evenly; a package on the border of two zones; a zone
    /// without any.
    pub fn divide(&mut self, zones: [usize; 2]) -> Result<()> {
        let [columns, rows] = self.whole;
        let divides = (0..2).all(|k| zones[k] > 0 && self.whole[k].is_multiple_of(zones[k]));
        ensure!(
            !self.is_lattice() || divides,
            "--zones: expected columns and rows that divide {columns} x {rows} packages evenly, got {} x {}",
            zones[0],
            zones[1]
        );
        ensure!(
            zones[0] * zones[1] <= self.count(),
            "--zones: expected at most as many as there are packages, {}, got {} x {}",
            self.count(),
            zones[0],
            zones[1]
        );
        let mut packages_by_zone = vec![Vec::new(); zones[0] * zones[1]];
        for number in 0..self.count() {
            let package = [number % columns, number / columns];
            let [i, j] = match self.off_lattice_mm.get(number) {
                None => [0, 1].map(|k| package[k] * zones[k] / self.whole[k]),
                Some(at) => {
                    let along = [0, 1].map(|k| {
                        let [low, length] = self.area_mm[k];
                        (at[k] - low) / length * zones[k] as f64
                    });
                    ensure!(
                        along.iter().all(|place| (place - place.round()).abs() > 1e-6),
                        "--zones: expected borders that pass between the packages, got one through that at {at:?} mm"
                    );
                    along.map(|place| place as usize)
                }
            };
            packages_by_zone[j * zones[0] + i].push(package);
        }
        if let Some(zone) = packages_by_zone.iter().position(Vec::is_empty) {
            anyhow::bail!(
                "--zones: expected packages in every zone, got none in column {} of row {}",
                zone % zones[0] + 1,
                zones[1] - zone / zones[0]
            );
        }
        self.packages_by_zone = packages_by_zone;
        Ok(())
    }

    /// Columns and rows of the packages in each zone, row after row.
    pub fn packages_by_zone(&self) -> &[Vec<[usize; 2]>] {
        &self.packages_by_zone
    }

    /// True if packages stand for others along an axis. Where the whole array is traced, all packages of
    /// one twice as long as stated are traced where they stand.
    pub fn is_extended(&self, axis: usize) -> bool {
        let whole = self.whole[axis];
        whole > self.traced[axis] || whole > 2 * self.stated[axis]
    }

    /// True if packages stand for others among the stated ones alone.
    pub fn is_narrow(&self) -> bool {
        self.traced == self.stated && (0..2).any(|k| self.is_extended(k))
    }

    /// Packages of the whole array.
    pub fn count(&self) -> usize {
        self.whole[0] * self.whole[1]
    }

    /// The traced column (`axis` 0) or row that stands for number `i` of the whole array.
    pub fn stand_in(&self, axis: usize, i: usize) -> usize {
        let (traced, whole) = (self.traced[axis], self.whole[axis]);
        if !self.is_extended(axis) {
            return i;
        }
        let (near_wall, from_end) = (self.near_wall(axis), whole - 1 - i);
        match (i <= from_end, i.min(from_end) < near_wall) {
            (true, true) => i,
            (true, false) => (traced - 1) / 2,
            (false, true) => traced - 1 - from_end,
            (false, false) => traced / 2,
        }
    }

    /// Places to the walls along each axis, of a package that another stands for.
    pub fn moved_to(&self, package: [usize; 2]) -> impl Iterator<Item = usize> {
        let axes = (0..2).filter(|k| self.traced[*k] > self.stated[*k]);
        let ends = axes.map(move |k| (k, [package[k], self.whole[k] - 1 - package[k]]));
        let moved = ends.filter(|(k, ends)| ends.iter().all(|away| *away >= self.near_wall(*k)));
        moved.flat_map(|(_, ends)| ends)
    }

    /// True if the package in this traced column or row stands for one or more.
    pub fn is_traced(&self, axis: usize, i: usize) -> bool {
        let traced = self.traced[axis];
        let near_wall = self.near_wall(axis);
        !self.is_extended(axis)
            || i.min(traced - 1 - i) < near_wall
            || [(traced - 1) / 2, traced / 2].contains(&i)
    }

    /// Packages from each wall that are traced where they stand.
    pub fn near_wall(&self, axis: usize) -> usize {
        (self.stated[axis] - 1) / 2
    }

    /// Packages from the one that stands for the inner ones to the nearest wall of the traced array.
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
        if !self.is_lattice() {
            return self.off_lattice_mm.clone();
        }
        let at = |k: usize, i: usize| self.first_mm[k] + i as f64 * self.pitch_mm[k];
        let row = |j: usize| (0..self.whole[0]).map(move |i| [at(0, i), at(1, j)]);
        (0..self.whole[1]).flat_map(row).collect()
    }

    /// Lower end and length of the area of all packages along an axis, mm: half a pitch beyond the
    /// outermost axes.
    pub fn area_mm(&self, axis: usize) -> [f64; 2] {
        self.area_mm[axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use design::schema::Pitch;

    fn square(count: usize) -> Design {
        let mut design = design::embedded("d1.toml").expect("valid");
        design.array.positions = PackagePositions::Grid {
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
            let places = Places::new(&square(traced), Some([9, 9]), None).expect("large enough");
            let found: Vec<usize> = (0..9).map(|i| places.stand_in(0, i)).collect();
            assert_eq!(found, expected, "{traced}");
            let are_equal = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-12);
            assert!(are_equal(places.axes_mm()[80], [32.0, 32.0]));
            assert!(are_equal(places.area_mm(1), [-36.0, 72.0]));
        }
        // Widened: those beside walls, and one in the middle; of even columns two.
        for (whole, expected) in [(48, [0, 1, 15, 15, 29, 30]), (12, [0, 1, 5, 6, 10, 11])] {
            let traced = whole.min(31);
            let places = Places::new(&square(traced), Some([whole; 2]), Some([5; 2]));
            let places = places.expect("large enough");
            let of = [0, 1, 2, whole - 3, whole - 2, whole - 1].map(|i| places.stand_in(0, i));
            assert_eq!(of, expected);
            assert!((0..traced).all(|i| places.is_traced(0, i) == expected.contains(&i)));
            let away = |i: usize| places.moved_to([i, 0]).collect::<Vec<usize>>();
            assert_eq!((away(1), away(4)), (Vec::new(), vec![4, whole - 5]));
        }
        let places = Places::new(&square(10), Some([10; 2]), Some([5; 2])).expect("large enough");
        assert!((0..10).all(|i| places.stand_in(0, i) == i) && !places.is_extended(0));
    }

    #[test]
    fn arrays_that_stand_for_no_other_are_refused() {
        for (traced, whole) in [(4, [9, 9]), (5, [9, 4]), (9, [5, 9])] {
            let error = Places::new(&square(traced), Some(whole), None).expect_err("refused");
            assert!(error.to_string().starts_with("--packages: expected"), "{error}");
        }
    }

    #[test]
    fn packages_that_differ_stand_for_no_others() {
        let set: [fn(&mut Design); 4] = [
            |design| design.array.turns_deg = vec![1.0; 25],
            |design| design.array.scales = [vec![1.0; 24], vec![1.1]].concat(),
            |design| design.array.stated_scales = vec![0.5; 25],
            |design| design.array.offsets_mm = vec![[0.1, 0.0]; 25],
        ];
        for set in set {
            let mut design = square(5);
            set(&mut design);
            let error = Places::new(&design, Some([9, 9]), None).expect_err("refused").to_string();
            assert!(error.contains("turned, of other sizes or off their places"), "{error}");
            assert!(Places::new(&design, None, None).is_ok());
        }
    }

    /// Staggered rows have a zone for each package, and the pitch of others fills their area.
    #[test]
    fn packages_aslant_belong_to_the_zone_that_they_stand_in() {
        let mut design = square(5);
        design.array.positions = PackagePositions::Grid {
            columns: 5,
            rows: 4,
            arrangement: design::schema::Arrangement::Hexagonal,
        };
        design.array.pitch_mm = Pitch::Along(runtime::serde_arrays::List([8.0, 6.0]));
        let error = Places::new(&design, Some([10, 4]), None).expect_err("no lattice").to_string();
        assert!(error.starts_with("--packages: expected none of packages"), "{error}");
        let mut places = Places::new(&design, None, None).expect("staggered");
        assert!(!places.is_lattice() && !places.are_free() && places.whole == [5, 4]);
        for (axis, expected) in [(0, [-22.0, 44.0]), (1, [-12.0, 24.0])] {
            let off = (0..2).map(|k| (places.area_mm(axis)[k] - expected[k]).abs());
            assert!(off.sum::<f64>() < 1e-12, "{axis}");
        }
        places.divide([5, 4]).expect("one in each");
        for (i, j) in (0..4).flat_map(|j| (0..5).map(move |i| (i, j))) {
            assert_eq!(places.packages_by_zone()[j * 5 + i], [[i, j]]);
        }
        for (zones, words) in [
            ([11, 4], "at most as many as there are packages, 20"),
            ([1, 5], "packages in every zone, got none in column 1 of row 3"),
            ([1, 1], "none"),
            (
                [11, 1],
                "borders that pass between the packages, got one through that at [-18.0, -9.0]",
            ),
        ] {
            let said = places.divide(zones).map_or_else(|e| e.to_string(), |()| "none".to_owned());
            assert!(said.contains(words), "{zones:?}: {said}");
        }
        let positions_mm = vec![[0.0, 0.0], [8.0, 0.0], [0.0, 8.0], [8.0, 8.0], [20.0, 20.0]];
        design.array.positions =
            PackagePositions::List { positions_mm, turns_deg: Vec::new(), file: String::new() };
        let places = Places::new(&design, None, None).expect("places");
        assert!(places.are_free());
        let p = places.pitch_mm[0];
        assert!(((20.0 + p).powi(2) - 5.0 * p * p).abs() < 1e-9, "{p}");
    }
}
