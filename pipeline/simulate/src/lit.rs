// SPDX-License-Identifier: MIT OR Apache-2.0
//! The part of each bin of a rectangle receiver that can be lit.
//!
//! The walls of the housing are opaque: of a bin that they cut, what lies between them is lit, and its
//! light is divided by that area. Bins beyond the walls are lit where no wall stands. A film ends at
//! its edge, where the light above it jumps: bins that the edge cuts hold light of both sides, and
//! figures leave them out where the film is nearer than such a bin is wide.

use tracer::Measurement;

use design::Design;
use design::resolved::receivers::CheckedReceiver;
use design::resolved::solids::CheckedSolid;
use design::schema::receivers::Normal;
use metrics::illuminance::Grid;
use metrics::lit::LitBins;

use super::observation::plane_grid;

/// Parts of a bin that are rounding.
const ROUNDING: f64 = 1e-9;

/// A rectangle at right angles to an axis, cut into bins.
struct Rectangle {
    /// Numbers of the axes of u, v and the normal.
    axes: [usize; 3],
    /// Lower ends along u and v, mm.
    low_mm: [f64; 2],
    /// Lengths of a bin along u and v, mm.
    bin_mm: [f64; 2],
    bins: [usize; 2],
    /// Its place along the normal, mm.
    at_mm: f64,
    faces_up: bool,
}

/// The lit parts of the bins of the plane; `None` where all are whole.
pub fn of_plane(design: &Design) -> Option<LitBins> {
    let Grid { columns, rows, bin_mm } = plane_grid(design);
    let bins = [columns, rows];
    Rectangle {
        axes: [0, 1, 2],
        low_mm: bins.map(|count| -0.5 * count as f64 * bin_mm),
        bin_mm: [bin_mm; 2],
        bins,
        at_mm: design.receiver.plane_height_mm,
        faces_up: true,
    }
    .lit(design)
}

/// The lit parts of the places of `receiver`; `None` where all are whole, and of what is no rectangle.
pub fn of_receiver(design: &Design, receiver: &CheckedReceiver) -> Option<LitBins> {
    let stated = receiver.stated.kind.rectangle()?;
    let axes = match stated.normal {
        Normal::Up | Normal::Down => [0, 1, 2],
        Normal::AlongX | Normal::AgainstX => [1, 2, 0],
        Normal::AlongY | Normal::AgainstY => [0, 2, 1],
    };
    let of_axis = |k: usize| stated.position_mm[axes[k]];
    Rectangle {
        axes,
        low_mm: [0, 1].map(|k| of_axis(k) - 0.5 * stated.size_mm[k]),
        bin_mm: [0, 1].map(|k| stated.size_mm[k] / stated.bins[k] as f64),
        bins: stated.bins,
        at_mm: of_axis(2),
        faces_up: stated.normal == Normal::Up,
    }
    .lit(design)
}

/// Divisors of the power in the bins of `receiver`: its measures, of the part of each place that can be
/// lit.
pub fn measures(design: &Design, receiver: &CheckedReceiver) -> Vec<f64> {
    let detector = &receiver.detector;
    let mut measures = detector.measures();
    if let Some(lit) = of_receiver(design, receiver) {
        let directions = match &detector.measurement {
            Measurement::Luminance(_, angles) => angles.bins(),
            _ => 1,
        };
        let places = lit.parts.len();
        for (bin, measure) in measures.iter_mut().enumerate() {
            *measure *= lit.parts[bin / directions % places];
        }
    }
    measures
}

/// Films of `design` whose edge cuts bins of the plane or of a receiver, which figures leave out, each
/// with the key of those bins.
pub fn cut_by_films(design: &Design) -> Vec<(String, &CheckedSolid)> {
    let leaves_out = |lit: Option<LitBins>| {
        lit.is_some_and(|lit| lit.parts.iter().zip(&lit.counted).any(|(part, of)| of < part))
    };
    let mut cut = Vec::new();
    if leaves_out(of_plane(design)) {
        let film = film_below(design, design.receiver.plane_height_mm);
        cut.extend(film.map(|film| ("receiver.bin_mm".to_owned(), film)));
    }
    for (number, receiver) in design.receivers.iter().enumerate() {
        let z_mm = receiver.stated.kind.rectangle().map(|stated| stated.position_mm[2]);
        if let Some(z_mm) = z_mm.filter(|_| leaves_out(of_receiver(design, receiver))) {
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
    fn lit(&self, design: &Design) -> Option<LitBins> {
        let parts = self.parts(design);
        let is_cut = self.cut_by_film(design, parts.as_deref());
        if parts.is_none() && is_cut.is_none() {
            return None;
        }
        let parts = parts.unwrap_or_else(|| vec![1.0; self.bins[0] * self.bins[1]]);
        let mut counted = parts.clone();
        for (part, is_cut) in counted.iter_mut().zip(is_cut.iter().flatten()) {
            *part = if *is_cut { 0.0 } else { *part };
        }
        // Where nothing is lit, the figures of what is dark are those of all bins.
        counted.iter().any(|part| *part > 0.0).then_some(LitBins { parts, counted })
    }

    /// Of each bin along u (`k` 0), v (1) or the normal (2), the share of its length between two ends.
    fn shares(&self, k: usize, [from, to]: [f64; 2]) -> Vec<f64> {
        if k == 2 {
            return vec![if (from..to).contains(&self.at_mm) { 1.0 } else { 0.0 }];
        }
        let edge = |bin: usize| self.low_mm[k] + bin as f64 * self.bin_mm[k];
        let share = |bin| (edge(bin + 1).min(to) - edge(bin).max(from)) / self.bin_mm[k];
        let rounded = |share: f64| match share {
            share if share < ROUNDING => 0.0,
            share if share > 1.0 - ROUNDING => 1.0,
            share => share,
        };
        (0..self.bins[k]).map(|bin| rounded(share(bin))).collect()
    }

    /// Share of the area of each bin within a box.
    fn within(&self, ends: [[f64; 2]; 3]) -> Vec<f64> {
        let [u, v, n] = [0, 1, 2].map(|k| self.shares(k, ends[self.axes[k]]));
        let (u, n) = (&u, n[0]);
        v.iter().flat_map(|v| u.iter().map(move |u| u * v * n)).collect()
    }

    /// The parts that walls leave; `None` where they cut no bin.
    fn parts(&self, design: &Design) -> Option<Vec<f64>> {
        let (housing, half) = (design.housing.as_ref()?, design.housing_half_mm()?);
        let of_walls = |beyond: f64, z_mm: [f64; 2]| {
            let [x, y] = half.map(|half| [-half - beyond, half + beyond]);
            self.within([x, y, z_mm])
        };
        let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
        let height = [f64::NEG_INFINITY, housing.height_mm];
        let above = self.within([everywhere, everywhere, [housing.height_mm, f64::INFINITY]]);
        let (inner, outer) = (of_walls(0.0, height), of_walls(housing.thickness_mm, height));
        let all = above.iter().zip(inner).zip(outer);
        let parts = all.map(|((above, inner), outer)| {
            // Beyond the walls is light of its own, of which a bin that holds both counts none.
            let part = if inner > 0.0 { above + inner } else { 1.0 - outer };
            if part > 1.0 - ROUNDING { 1.0 } else { part.max(0.0) }
        });
        let parts: Vec<f64> = parts.collect();
        parts.iter().any(|part| *part < 1.0).then_some(parts)
    }

    /// True of bins that the edge of a film just below cuts; `None` without any.
    fn cut_by_film(&self, design: &Design, parts: Option<&[f64]>) -> Option<Vec<bool>> {
        let film = film_below(design, self.at_mm).filter(|_| self.faces_up)?;
        let around = film.form.upright_box()?;
        if self.at_mm - around.high.z >= self.bin_mm[0].min(self.bin_mm[1]) {
            return None;
        }
        let ends = |k: usize| [around.low[k], around.high[k]];
        let over = self.within([ends(0), ends(1), [f64::NEG_INFINITY, f64::INFINITY]]);
        let is_cut = over.into_iter().enumerate().map(|(bin, over)| {
            let part = parts.map_or(1.0, |parts| parts[bin]);
            over > ROUNDING && over < part - ROUNDING
        });
        let is_cut: Vec<bool> = is_cut.collect();
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

    #[test]
    fn an_upright_rectangle_is_cut_by_walls_up_to_their_height() {
        let of = |at_mm: f64| {
            let (low_mm, bin_mm) = ([-3.5, 6.0], [0.5, 1.0]);
            Rectangle { axes: [1, 2, 0], low_mm, bin_mm, bins: [14, 2], at_mm, faces_up: false }
        };
        // Between the walls: along y they begin with the bins at 3.5 mm, and cut none.
        assert_eq!(of(0.0).lit(&walled(5.5)), None);
        // In a wall, that of the lower row above it alone: 6.85 to 7 mm of 6 to 7 mm.
        let lit = of(3.5).lit(&walled(5.5)).expect("a wall");
        assert!((lit.parts[3] - 0.15).abs() < 1e-12 && lit.parts[14 + 3] >= 1.0, "{lit:?}");
    }
}
