// SPDX-License-Identifier: MIT OR Apache-2.0
//! Positions of the LEDs of an array, and the segments between neighbours.

use std::f64::consts::{PI, TAU};

/// Lower left and upper right corner of a rectangle, mm.
pub type Area = [[f64; 2]; 2];

/// Positions of LEDs and pairs of neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Axes (x, y) of the LEDs, mm.
    pub axes_mm: Vec<[f64; 2]>,
    /// Least distance of neighbours, mm.
    pub pitch_mm: f64,
    straight: Vec<[usize; 2]>,
    diagonal: Vec<[usize; 2]>,
}

impl Layout {
    /// `columns` × `rows` LEDs, row after row: neighbours stand next to each other along a row or
    /// column, or across the diagonal of four.
    pub fn rectangular(axes_mm: Vec<[f64; 2]>, columns: usize, rows: usize, pitch_mm: f64) -> Self {
        let at = |i: usize, j: usize| j * columns + i;
        let (mut straight, mut diagonal) = (Vec::new(), Vec::new());
        for j in 0..rows {
            for i in 0..columns {
                if i + 1 < columns {
                    straight.push([at(i, j), at(i + 1, j)]);
                }
                if j + 1 < rows {
                    straight.push([at(i, j), at(i, j + 1)]);
                }
            }
        }
        for j in 1..rows {
            for i in 1..columns {
                diagonal.push([at(i - 1, j - 1), at(i, j)]);
                diagonal.push([at(i, j - 1), at(i - 1, j)]);
            }
        }
        Self { axes_mm, pitch_mm, straight, diagonal }
    }

    /// LEDs anywhere. In full rows and columns, evenly spaced, they are those of
    /// [`Layout::rectangular`]; elsewhere neighbours are LEDs with no other between them
    /// (`neighbours`), and there are no diagonals.
    pub fn of_places(mut axes_mm: Vec<[f64; 2]>) -> Self {
        let straight = neighbours(&axes_mm);
        let length = |&[a, b]: &[usize; 2]| distance(axes_mm[a], axes_mm[b]);
        let pitch_mm = straight.iter().map(length).reduce(f64::min).unwrap_or_default();
        let Some([[left, across], [low, along]]) = lattice(&axes_mm, pitch_mm) else {
            return Self { axes_mm, pitch_mm, straight, diagonal: Vec::new() };
        };
        let number = |at: f64, first: f64, step: f64| {
            if step > 0.0 { ((at - first) / step).round() as usize } else { 0 }
        };
        axes_mm.sort_by_key(|[x, y]| (number(*y, low, along), number(*x, left, across)));
        let [last_x, last_y] = axes_mm.last().copied().unwrap_or_default();
        let (columns, rows) = (number(last_x, left, across) + 1, number(last_y, low, along) + 1);
        Self::rectangular(axes_mm, columns, rows, pitch_mm)
    }

    /// The same in coordinates from `origin_mm`, in units of `unit_mm` along x and y.
    #[must_use]
    pub fn seen_from(&self, origin_mm: [f64; 2], unit_mm: [f64; 2]) -> Self {
        let moved = |axis: &[f64; 2]| [0, 1].map(|k| (axis[k] - origin_mm[k]) / unit_mm[k]);
        Self {
            axes_mm: self.axes_mm.iter().map(moved).collect(),
            pitch_mm: self.pitch_mm / unit_mm[0].max(unit_mm[1]),
            ..self.clone()
        }
    }

    /// First coordinate and distance of columns and of rows, where these are evenly spaced and an LED
    /// stands in every place of them; the distance of a single one is 0.
    pub fn lattice(&self) -> Option<[[f64; 2]; 2]> {
        lattice(&self.axes_mm, self.pitch_mm)
    }

    /// Shortest and longest distance of LEDs next to each other, mm, and the number of such pairs;
    /// `None` without any.
    pub fn distances_mm(&self) -> Option<([f64; 2], usize)> {
        let lengths = self.straight().into_iter().map(|[a, b]| distance(a, b));
        let ends = lengths.map(|length| [length; 2]);
        let ends = ends.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])?;
        Some((ends, self.straight.len()))
    }

    fn segments(&self, pairs: &[[usize; 2]]) -> Vec<[[f64; 2]; 2]> {
        pairs.iter().map(|pair| pair.map(|k| self.axes_mm[k])).collect()
    }

    /// Ends of the segments between LEDs next to each other.
    pub fn straight(&self) -> Vec<[[f64; 2]; 2]> {
        self.segments(&self.straight)
    }

    /// Ends of the segments between diagonal neighbours.
    pub fn diagonal(&self) -> Vec<[[f64; 2]; 2]> {
        self.segments(&self.diagonal)
    }
}

/// [`Layout::lattice`] of LEDs whose neighbours are at least `pitch_mm` apart.
fn lattice(axes_mm: &[[f64; 2]], pitch_mm: f64) -> Option<[[f64; 2]; 2]> {
    let lines = [0, 1].map(|k| {
        let mut at: Vec<f64> = axes_mm.iter().map(|axis| axis[k]).collect();
        at.sort_by(f64::total_cmp);
        at.dedup_by(|next, kept| *next - *kept <= 1e-3 * pitch_mm);
        at
    });
    let even = |at: &Vec<f64>| {
        let (first, last) = (*at.first()?, *at.last()?);
        let step = (last - first) / (at.len().max(2) - 1) as f64;
        let is_even = at.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= 1e-2 * step);
        is_even.then_some([first, step])
    };
    let is_full = lines[0].len() * lines[1].len() == axes_mm.len();
    Some([even(&lines[0])?, even(&lines[1])?]).filter(|_| is_full)
}

fn distance([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    (a - c).hypot(b - d)
}

/// Pairs of LEDs, the lower number first, with no other between them: the β-skeleton of β = 4/3
/// (Kirkpatrick and Radke 1985). No third lies in both discs about the points at a third and two
/// thirds of the way that reach to the farther end. That joins rows, columns and the six neighbours
/// of a hexagon, whatever their distances, and no diagonal of a rectangle, also where places are off
/// by a part of the pitch.
fn neighbours(axes_mm: &[[f64; 2]]) -> Vec<[usize; 2]> {
    let mut order: Vec<usize> = (0..axes_mm.len()).collect();
    order.sort_by(|a, b| axes_mm[*a][0].total_cmp(&axes_mm[*b][0]));
    let extent = [0, 1].map(|k| {
        let at = || axes_mm.iter().map(|axis| axis[k]);
        at().fold(f64::NEG_INFINITY, f64::max) - at().fold(f64::INFINITY, f64::min)
    });
    let count = axes_mm.len() as f64;
    // Far enough for all neighbours of most LEDs.
    let reach = 2.5 * (extent[0] * extent[1] / count).sqrt().max((extent[0] + extent[1]) / count);
    let mut pairs = Vec::new();
    for (place, &a) in order.iter().enumerate() {
        let in_reach = |b: &&usize| (axes_mm[**b][0] - axes_mm[a][0]).abs() <= reach;
        let after = order[place + 1..].iter().take_while(in_reach);
        let before = order[..place].iter().rev().take_while(in_reach);
        let near: Vec<usize> = before
            .chain(after)
            .copied()
            .filter(|b| distance(axes_mm[*b], axes_mm[a]) <= reach)
            .collect();
        let is_joined =
            |b: usize, others: &[usize]| !others.iter().any(|c| is_between(axes_mm, [a, b], *c));
        let mut own: Vec<usize> = near.iter().copied().filter(|b| is_joined(*b, &near)).collect();
        if !are_around(axes_mm, a, &own, reach) {
            let is_far = |b: &usize| *b != a && distance(axes_mm[*b], axes_mm[a]) > reach;
            let far = order.iter().copied().filter(is_far);
            let far: Vec<usize> = far.filter(|b| is_joined(*b, &own)).collect();
            own.extend(far.into_iter().filter(|b| is_joined(*b, &order)));
        }
        pairs.extend(own.into_iter().filter(|b| a < *b).map(|b| [a, b]));
    }
    pairs.sort_unstable();
    pairs
}

/// True if LED `c` lies between `a` and `b`, of which it is neither.
fn is_between(axes_mm: &[[f64; 2]], [a, b]: [usize; 2], c: usize) -> bool {
    if c == a || c == b {
        return false;
    }
    let [a, b, c] = [a, b, c].map(|k| axes_mm[k]);
    let part = |share: f64| [0, 1].map(|k| a[k] + share * (b[k] - a[k]));
    let radius = 2.0 / 3.0 * distance(a, b) * (1.0 - 1e-9);
    [1.0, 2.0].iter().all(|third| distance(c, part(third / 3.0)) < radius)
}

/// True if every LED farther than `reach` from `a` has one of its neighbours `own` in the circle
/// between: beyond a neighbour at the distance d these are all at the angle φ to it that are farther
/// than d/cos φ.
fn are_around(axes_mm: &[[f64; 2]], a: usize, own: &[usize], reach: f64) -> bool {
    let from_a = own.iter().map(|b| [0, 1].map(|k| axes_mm[*b][k] - axes_mm[a][k]));
    let mut angles: Vec<f64> = from_a.map(|[x, y]| y.atan2(x)).collect();
    angles.sort_by(f64::total_cmp);
    let Some(first) = angles.first().copied() else { return false };
    angles.push(first + TAU);
    let widest = angles.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let far = own.iter().map(|b| distance(axes_mm[*b], axes_mm[a])).fold(0.0, f64::max);
    widest < PI && far / (0.5 * widest).cos() <= reach
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `columns` x `rows` LEDs from one corner.
    fn grid(columns: usize, rows: usize, [across, along]: [f64; 2]) -> Vec<[f64; 2]> {
        let at = |k: usize| [(k % columns) as f64 * across, (k / columns) as f64 * along];
        (0..columns * rows).map(at).collect()
    }

    #[test]
    fn places_in_rows_and_columns_are_a_rectangle_in_any_order() {
        for pitch in [[8.25, 8.25], [12.0, 11.0], [30.0, 3.0]] {
            let axes = grid(5, 4, pitch);
            let by_row = Layout::rectangular(axes.clone(), 5, 4, pitch[1]);
            let mut mixed = axes;
            mixed.reverse();
            mixed.swap(3, 11);
            assert_eq!(Layout::of_places(mixed), by_row, "{pitch:?}");
            let (ends, pairs) = by_row.distances_mm().expect("neighbours");
            assert!((ends[0] - pitch[1]).abs() < 1e-9 && (ends[1] - pitch[0]).abs() < 1e-9);
            assert_eq!(pairs, 31);
            let [first, step] = by_row.lattice().expect("evenly spaced")[0];
            assert!(first.abs() < 1e-9 && (step - pitch[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn neighbours_are_those_with_no_other_between_them() {
        // Without one corner there are no even rows, and the rest is joined as before.
        let mut axes = grid(5, 4, [30.0, 11.0]);
        axes.pop();
        let layout = Layout::of_places(axes);
        assert_eq!((layout.lattice(), layout.straight.len()), (None, 29));
        assert!(layout.diagonal().is_empty());
        // Off by a tenth of the pitch, rows and columns stay what they are.
        let moved = |(k, [x, y]): (usize, [f64; 2])| {
            [x + (k * 7 % 5) as f64 * 0.4 - 0.8, y + (k * 11 % 7) as f64 * 0.3 - 0.9]
        };
        let even = grid(12, 9, [10.0, 8.0]);
        let expected = Layout::rectangular(even.clone(), 12, 9, 8.0).straight;
        let mut found = neighbours(&even.into_iter().enumerate().map(moved).collect::<Vec<_>>());
        let mut expected = expected;
        expected.sort_unstable();
        found.sort_unstable();
        assert_eq!(found, expected);
        // A hexagonal array: six about the middle one.
        let place = |k: usize| {
            let (column, row) = ((k % 5) as f64, k / 5);
            [column + 0.5 * (row % 2) as f64, row as f64 * 0.75f64.sqrt()]
        };
        let pairs = neighbours(&(0..25).map(place).collect::<Vec<_>>());
        assert_eq!(pairs.iter().filter(|pair| pair.contains(&12)).count(), 6);
        assert_eq!(pairs.len(), 5 * 4 + 4 * 9);
    }

    #[test]
    fn neighbours_of_few_and_of_distant_places_are_found() {
        assert!(neighbours(&[]).is_empty() && neighbours(&[[3.0, 1.0]]).is_empty());
        assert_eq!(neighbours(&[[0.0, 0.0], [5.0, 0.0], [900.0, 0.0]]), [[0, 1], [1, 2]]);
        // Every pair against the definition, for places by chance and in two far groups.
        let mut rng = tracer::random::stream(5, 0);
        let mut place = |k: usize| {
            let [x, y] = [0, 1].map(|_| tracer::random::unit(&mut rng));
            [10.0 * x + if k < 40 { 0.0 } else { 3000.0 }, 40.0 * y]
        };
        let axes: Vec<[f64; 2]> = (0..90).map(&mut place).collect();
        let all = (0..90).flat_map(|a| (a + 1..90).map(move |b| [a, b]));
        let joined = all.filter(|pair| !(0..90).any(|c| is_between(&axes, *pair, c)));
        assert_eq!(neighbours(&axes), joined.collect::<Vec<_>>());
    }
}
