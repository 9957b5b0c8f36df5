// SPDX-License-Identifier: MIT OR Apache-2.0
//! The bins of the plane, the part of each that can be lit, and bins of receivers that figures count.
//!
//! The walls of the housing are opaque: of a bin that they cut, what lies between them is lit, and its
//! light is divided by that area. Bins beyond the walls are lit where no wall stands. Walls may cut the
//! plane alone: other receivers that they cut are refused. Smoothing does not pass walls. Beyond a cell
//! that repeats nothing is lit, and smoothing goes on in the next cell.
//!
//! A film ends at its edge, where the light above it jumps: bins that the edge cuts hold light of both
//! sides, and figures leave them out where the film is nearer than such a bin is wide.

use design::Design;
use design::resolved::receivers::CheckedReceiver;
use design::resolved::solids::CheckedSolid;
use design::schema::receivers::Normal;
use metrics::illuminance::{Border, Grid};
use metrics::lit::LitBins;

/// Parts of a bin that are rounding.
const ROUNDING: f64 = 1e-9;

/// A level rectangle that is cut into bins.
struct Rectangle {
    /// Lower ends along x and y, mm.
    low_mm: [f64; 2],
    /// Lengths of a bin along x and y, mm.
    bin_mm: [f64; 2],
    bins: [usize; 2],
    z_mm: f64,
}

/// Bins of the plane: centred on the array, up to the margin beyond the outermost axes. Their
/// number is even, or makes whole bins of those that are read.
pub fn plane_grid(design: &Design) -> Grid {
    let r = &design.receiver;
    let margin_mm = r.margin_mm(design.array.pitch_mm);
    let whole = |length: f64, bin: f64| (length / bin - 1e-9).ceil() as usize;
    let [columns, rows] = design.half_extent_mm().map(|half| match r.read_bin_mm {
        Some(read) => whole(2.0 * (half + margin_mm), read) * r.read_together(),
        None => 2 * whole(half + margin_mm, r.bin_mm),
    });
    Grid { columns, rows, bin_mm: r.bin_mm }
}

/// Parts of the plane that walls or the borders of a cell leave; `None` where they cut no bin and nothing
/// repeats. A cell repeats where whole bins fill it and the map covers it.
pub fn border(design: &Design) -> Option<Border> {
    let Grid { columns, rows, bin_mm } = plane_grid(design);
    let plane = Rectangle::of_plane(design);
    let half_mm = design.housing_half_mm()?;
    let bins = half_mm.map(|half| 2.0 * half / bin_mm);
    let fits = |(bins, map): (f64, usize)| {
        (bins - bins.round()).abs() < ROUNDING * bins && bins.round() <= map as f64
    };
    let repeats = design.is_periodic() && bins.into_iter().zip([columns, rows]).all(fits);
    let parts = match plane.parts(design) {
        Some(parts) => parts,
        // A map as large as its cell is cut by no border, and goes on all the same.
        None if repeats => vec![1.0; columns * rows],
        None => return None,
    };
    let inner = plane.within(half_mm.map(|half| [-half, half]));
    Some(Border {
        parts,
        is_beyond: inner.iter().map(|part| *part <= 0.0).collect(),
        period: repeats.then(|| bins.map(|bins| bins.round() as usize)),
    })
}

/// The lit parts of the bins of the plane; `None` where all are whole and counted.
pub fn of_plane(design: &Design) -> Option<LitBins> {
    let Grid { columns, rows, .. } = plane_grid(design);
    let plane = Rectangle::of_plane(design);
    let (parts, is_cut) = (plane.parts(design), plane.cut_by_film(design));
    if parts.is_none() && is_cut.is_none() {
        return None;
    }
    let parts = parts.unwrap_or_else(|| vec![1.0; columns * rows]);
    let counted: Vec<f64> = match is_cut {
        Some(is_cut) => {
            parts.iter().zip(is_cut).map(|(p, cut)| if cut { 0.0 } else { *p }).collect()
        }
        None => parts.clone(),
    };
    // Where a film cuts every bin, all count.
    let counted = if counted.iter().any(|part| *part > 0.0) { counted } else { parts.clone() };
    parts.iter().any(|part| *part > 0.0).then_some(LitBins { parts, counted })
}

/// The share that figures count of each place of `receiver`, which no wall may cut: 0 where the edge of
/// a film does; `None` where all count.
pub fn counted_places(design: &Design, receiver: &CheckedReceiver) -> Option<Vec<f64>> {
    let stated = receiver.stated.kind.rectangle().filter(|r| r.normal == Normal::Up)?;
    let rectangle = Rectangle {
        low_mm: [0, 1].map(|k| stated.position_mm[k] - 0.5 * stated.size_mm[k]),
        bin_mm: [0, 1].map(|k| stated.size_mm[k] / stated.bins[k] as f64),
        bins: stated.bins,
        z_mm: stated.position_mm[2],
    };
    let is_cut = rectangle.cut_by_film(design)?;
    let counted: Vec<f64> = is_cut.into_iter().map(|cut| f64::from(u8::from(!cut))).collect();
    counted.contains(&1.0).then_some(counted)
}

/// Films of `design` whose edge cuts bins of the plane or of a receiver, which figures leave out, each
/// with the key of those bins.
pub fn cut_by_films(design: &Design) -> Vec<(String, &CheckedSolid)> {
    let plane_is_cut =
        of_plane(design).is_some_and(|lit| lit.parts.iter().zip(&lit.counted).any(|(p, c)| c < p));
    let mut cut = Vec::new();
    if plane_is_cut {
        let film = film_below(design, design.receiver.plane_height_mm);
        cut.extend(film.map(|film| ("receiver.bin_mm".to_owned(), film)));
    }
    for (number, receiver) in design.receivers.iter().enumerate() {
        let z_mm = receiver.stated.kind.rectangle().map(|stated| stated.position_mm[2]);
        if let Some(z_mm) = z_mm.filter(|_| counted_places(design, receiver).is_some()) {
            let key = format!("receivers[{}].bins", number + 1);
            cut.extend(film_below(design, z_mm).map(|film| (key, film)));
        }
    }
    cut
}

/// The topmost film below this height.
fn film_below(design: &Design, z_mm: f64) -> Option<&CheckedSolid> {
    let films = design.solids.iter().filter(|solid| solid.table.starts_with("films"));
    let top = |film: &CheckedSolid| film.form.upright_box().map_or(f64::INFINITY, |b| b.high.z);
    films.filter(|film| top(film) <= z_mm).max_by(|a, b| top(a).total_cmp(&top(b)))
}

impl Rectangle {
    fn of_plane(design: &Design) -> Self {
        let Grid { columns, rows, bin_mm } = plane_grid(design);
        let bins = [columns, rows];
        Self {
            low_mm: bins.map(|count| -0.5 * count as f64 * bin_mm),
            bin_mm: [bin_mm; 2],
            bins,
            z_mm: design.receiver.plane_height_mm,
        }
    }

    /// Of each bin along x (`k` 0) or y (1), the share of its length between two ends.
    fn shares(&self, k: usize, [from, to]: [f64; 2]) -> Vec<f64> {
        let edge = |bin: usize| self.low_mm[k] + bin as f64 * self.bin_mm[k];
        let share = |bin| (edge(bin + 1).min(to) - edge(bin).max(from)) / self.bin_mm[k];
        let rounded = |share: f64| match share {
            share if share < ROUNDING => 0.0,
            share if share > 1.0 - ROUNDING => 1.0,
            share => share,
        };
        (0..self.bins[k]).map(|bin| rounded(share(bin))).collect()
    }

    /// Share of the area of each bin within these ends along x and y.
    fn within(&self, ends: [[f64; 2]; 2]) -> Vec<f64> {
        let [x, y] = [0, 1].map(|k| self.shares(k, ends[k]));
        let x = &x;
        y.iter().flat_map(|y| x.iter().map(move |x| x * y)).collect()
    }

    /// The parts that walls leave; `None` where they cut no bin.
    fn parts(&self, design: &Design) -> Option<Vec<f64>> {
        let (housing, half) = (design.housing.as_ref()?, design.housing_half_mm()?);
        // At the top of a cell light still goes round.
        let is_within = if design.is_periodic() {
            self.z_mm <= housing.height_mm
        } else {
            self.z_mm < housing.height_mm
        };
        if !is_within {
            return None;
        }
        let of_walls = |beyond: f64| self.within(half.map(|half| [-half - beyond, half + beyond]));
        let (inner, outer) = (of_walls(0.0), of_walls(housing.thickness_mm));
        let part = |(inner, outer): (f64, f64)| {
            // Beyond the walls is light of its own, of which a bin that holds both counts none; beyond a
            // cell that repeats is none.
            let part = if inner > 0.0 || design.is_periodic() { inner } else { 1.0 - outer };
            if part > 1.0 - ROUNDING { 1.0 } else { part.max(0.0) }
        };
        let parts: Vec<f64> = inner.into_iter().zip(outer).map(part).collect();
        parts.iter().any(|part| *part < 1.0).then_some(parts)
    }

    /// True of bins that the edge of a film just below cuts; `None` without any.
    fn cut_by_film(&self, design: &Design) -> Option<Vec<bool>> {
        let film = film_below(design, self.z_mm)?;
        let around = film.form.upright_box()?;
        if self.z_mm - around.high.z >= self.bin_mm[0].min(self.bin_mm[1]) {
            return None;
        }
        // A film that reaches the walls ends where the bins between them do.
        let parts = self.parts(design);
        let part = |bin: usize| parts.as_ref().map_or(1.0, |parts| parts[bin]);
        let over = self.within([0, 1].map(|k| [around.low[k], around.high[k]]));
        let is_cut = |(bin, over): (usize, f64)| over > ROUNDING && over < part(bin) - ROUNDING;
        let is_cut: Vec<bool> = over.into_iter().enumerate().map(is_cut).collect();
        is_cut.contains(&true).then_some(is_cut)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use design::resolved::Housing;
    use design::resolved::array::PackagePositions;
    use design::resolved::reflector::Reflector;

    /// A package between walls 6.5 and 7 mm apart, 1 mm thick, under a plane of bins of 0.5 mm.
    fn walled(plane_height_mm: f64) -> Design {
        let mut design = design::embedded("d1.toml").expect("valid");
        design.array.positions = PackagePositions::SINGLE;
        design.housing = Some(Housing {
            distance_mm: None,
            inner_size_mm: Some([6.5, 7.0]),
            height_mm: 6.85,
            thickness_mm: 1.0,
            reflector: Reflector::Absorbing,
            floor: None,
        });
        let receiver = &mut design.receiver;
        (receiver.bin_mm, receiver.read_bin_mm) = (0.5, None);
        receiver.plane_height_mm = plane_height_mm;
        design
    }

    #[test]
    fn walls_leave_a_bin_what_lies_between_them() {
        let design = walled(5.5);
        let lit = of_plane(&design).expect("walls cut bins");
        let Grid { columns, rows, .. } = plane_grid(&design);
        let part = |i: usize, j: usize| lit.parts[(rows / 2 + j) * columns + columns / 2 + i];
        // Along x 3.0 to 3.5 mm ends at the wall at 3.25 mm; the wall fills up to 4.25 mm, and half of
        // the bin there lies beyond. Along y bins end at the wall, which is 1 mm thick.
        for (i, expected) in [(0, 1.0), (5, 1.0), (6, 0.5), (7, 0.0), (8, 0.5), (9, 1.0)] {
            assert!((part(i, 0) - expected).abs() < 1e-12, "{i}: {}", part(i, 0));
        }
        for (j, expected) in [(6, 1.0), (7, 0.0), (8, 0.0), (9, 1.0)] {
            assert!((part(0, j) - expected).abs() < 1e-12, "{j}: {}", part(0, j));
        }
        assert_eq!(part(6, 7).to_bits(), 0.0f64.to_bits());
        assert_eq!(lit.parts, lit.counted);
        // Above the walls all is open.
        assert_eq!(of_plane(&walled(7.0)), None);
    }
}
