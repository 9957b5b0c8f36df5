// SPDX-License-Identifier: MIT OR Apache-2.0
//! Positions of the LEDs of an array, and the segments between neighbours.

/// Lower left and upper right corner of a rectangle, mm.
pub type Area = [[f64; 2]; 2];

/// Positions of LEDs and pairs of neighbours.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Axes (x, y) of the LEDs, mm.
    pub axes_mm: Vec<[f64; 2]>,
    /// Distance of neighbours, mm.
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

    /// LEDs anywhere: neighbours are those one pitch apart, within a thousandth. There are no
    /// diagonals.
    pub fn by_distance(axes_mm: Vec<[f64; 2]>, pitch_mm: f64) -> Self {
        let near =
            |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) <= pitch_mm * (1.0 + 1e-3);
        let mut order: Vec<usize> = (0..axes_mm.len()).collect();
        order.sort_by(|a, b| axes_mm[*a][0].total_cmp(&axes_mm[*b][0]));
        let mut straight = Vec::new();
        for (k, &a) in order.iter().enumerate() {
            let within = |b: &&usize| axes_mm[**b][0] - axes_mm[a][0] <= pitch_mm * (1.0 + 1e-3);
            for &b in order[k + 1..].iter().take_while(within) {
                if near(axes_mm[a], axes_mm[b]) {
                    straight.push([a.min(b), a.max(b)]);
                }
            }
        }
        straight.sort_unstable();
        Self { axes_mm, pitch_mm, straight, diagonal: Vec::new() }
    }

    /// First coordinate and distance of columns and of rows, where these are evenly spaced and an LED
    /// stands in every place of them; the distance of a single one is 0.
    pub fn lattice(&self) -> Option<[[f64; 2]; 2]> {
        let lines = [0, 1].map(|k| {
            let mut at: Vec<f64> = self.axes_mm.iter().map(|axis| axis[k]).collect();
            at.sort_by(f64::total_cmp);
            at.dedup_by(|next, kept| *next - *kept <= 1e-3 * self.pitch_mm);
            at
        });
        let even = |at: &Vec<f64>| {
            let (first, last) = (*at.first()?, *at.last()?);
            let step = (last - first) / (at.len().max(2) - 1) as f64;
            let is_even = at.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() <= 1e-2 * step);
            is_even.then_some([first, step])
        };
        let is_full = lines[0].len() * lines[1].len() == self.axes_mm.len();
        Some([even(&lines[0])?, even(&lines[1])?]).filter(|_| is_full)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_by_distance_are_those_of_rows_and_columns() {
        let at = |k: usize| (k as f64 - 2.0) * 8.3;
        let axes = (0..25).map(|k| [at(k % 5), at(k / 5)]);
        let mut by_row = Layout::rectangular(axes.collect(), 5, 5, 8.3);
        let by_distance = Layout::by_distance(by_row.axes_mm.clone(), by_row.pitch_mm);
        by_row.straight.sort_unstable();
        assert_eq!(by_row.straight, by_distance.straight);
        assert!(by_distance.diagonal().is_empty() && by_row.diagonal().len() == 32);
        let [first, step] = by_distance.lattice().expect("evenly spaced")[1];
        assert!((first + 16.6).abs() < 1e-9 && (step - 8.3).abs() < 1e-9);
        by_row.axes_mm.pop();
        assert_eq!(by_row.lattice(), None);
    }
}
