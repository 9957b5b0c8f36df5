// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums of shifted maps, row by row and group by group of paths.
//!
//! Every row of bins is summed by one thread in one order, so that the number of threads changes no
//! bit; only one row of all groups is in memory at a time.

use rayon::prelude::*;

/// A map by groups of paths.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Bins along x and y.
    pub bins: [usize; 2],
    /// Groups of paths.
    pub groups: usize,
    /// Value in each bin of each group of each row: rows outside, bins inside.
    data: Vec<f64>,
    /// What one path of the packages in it adds to a bin.
    pub one_path: f64,
}

impl Block {
    /// A map from its groups, each row after row.
    pub fn new(bins: [usize; 2], groups: &[Vec<f64>], one_path: f64) -> Self {
        let rows = (0..bins[1]).map(|j| j * bins[0]..(j + 1) * bins[0]);
        let rows = rows.flat_map(|row| groups.iter().flat_map(move |group| &group[row.clone()]));
        Self { bins, groups: groups.len(), data: rows.copied().collect(), one_path }
    }

    /// The sum of `pieces` over `bins`.
    pub fn sum(bins: [usize; 2], groups: usize, pieces: &[Piece]) -> Self {
        let rows = rows(bins, groups, pieces, |_, row| row.values.clone());
        let one_path = pieces.iter().map(|piece| piece.weight * piece.block.one_path).sum();
        Self { bins, groups, data: rows.concat(), one_path }
    }

    /// Bins of one row in one group.
    #[inline]
    pub fn row(&self, group: usize, row: usize) -> &[f64] {
        let begin = (row * self.groups + group) * self.bins[0];
        &self.data[begin..begin + self.bins[0]]
    }

    fn value(&self, group: usize, [i, j]: [usize; 2]) -> f64 {
        self.row(group, j)[i]
    }
}

/// Mirror images of a map about its middle: x and y exchanged first, then mirrored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Turn {
    /// x and y exchanged.
    pub swap: bool,
    /// Mirrored along x and along y.
    pub mirror: [bool; 2],
}

/// A block at a place of a larger map.
#[derive(Debug, Clone, Copy)]
pub struct Piece<'a> {
    /// The map.
    pub block: &'a Block,
    /// Which image of it.
    pub turn: Turn,
    /// Its first bin along x and y in the larger map, which may lie before it.
    pub at: [isize; 2],
    /// First bin along x and y that it may light, and the first that it may not.
    pub within: [[isize; 2]; 2],
    /// Factor.
    pub weight: f64,
}

/// No end of what a piece may light.
pub const ANYWHERE: [[isize; 2]; 2] = [[isize::MIN, isize::MAX]; 2];

impl Piece<'_> {
    /// Bins along x and y.
    pub fn bins(&self) -> [usize; 2] {
        let [x, y] = self.block.bins;
        if self.turn.swap { [y, x] } else { [x, y] }
    }

    /// Adds its part of row `y` of the larger map.
    fn add_to(&self, sum: &mut RowOfGroups, y: usize) {
        let [width, height] = self.bins();
        let [across, along] = self.within;
        let y = y as isize;
        let local = y - self.at[1];
        if local < 0 || local >= height as isize || y < along[0] || y >= along[1] {
            return;
        }
        let local = local as usize;
        let row = if self.turn.mirror[1] { height - 1 - local } else { local };
        let begin = self.at[0].max(across[0]).max(0);
        let end = (self.at[0] + width as isize).min(across[1]).min(sum.bins as isize);
        if begin >= end {
            return;
        }
        let (weight, to) = (self.weight, begin as usize..end as usize);
        let own = (begin - self.at[0]) as usize..(end - self.at[0]) as usize;
        for (group, values) in sum.values.chunks_exact_mut(sum.bins).enumerate() {
            let to = values[to.clone()].iter_mut();
            match (self.turn.swap, self.turn.mirror[0]) {
                (false, false) => {
                    let part = &self.block.row(group, row)[own.clone()];
                    to.zip(part).for_each(|(sum, value)| *sum += weight * value);
                }
                (false, true) => {
                    let part = &self.block.row(group, row)[width - own.end..width - own.start];
                    to.zip(part.iter().rev()).for_each(|(sum, value)| *sum += weight * value);
                }
                (true, mirrored) => {
                    for (i, sum) in own.clone().zip(to) {
                        let column = if mirrored { width - 1 - i } else { i };
                        *sum += weight * self.block.value(group, [row, column]);
                    }
                }
            }
        }
        let one_path = weight * self.block.one_path;
        sum.one_path[to].iter_mut().for_each(|sum| *sum += one_path);
    }
}

/// One row of a map by groups of paths.
pub struct RowOfGroups {
    /// Bins in the row.
    bins: usize,
    /// Values of the groups one after the other.
    values: Vec<f64>,
    /// What one path of all packages that reach a bin adds to it.
    pub one_path: Vec<f64>,
}

impl RowOfGroups {
    /// Number of groups.
    pub fn count(&self) -> usize {
        self.values.len() / self.bins
    }

    /// Values of all bins in one group.
    pub fn group(&self, group: usize) -> &[f64] {
        &self.values[group * self.bins..(group + 1) * self.bins]
    }

    /// Sums over all groups.
    pub fn total(&self) -> Vec<f64> {
        let mut total = vec![0.0; self.bins];
        for group in 0..self.count() {
            total.iter_mut().zip(self.group(group)).for_each(|(sum, value)| *sum += value);
        }
        total
    }
}

/// Reads every row of the sum of `pieces` over `bins`, in order from the bottom.
pub fn rows<T: Send>(
    bins: [usize; 2],
    groups: usize,
    pieces: &[Piece],
    read: impl Fn(usize, &RowOfGroups) -> T + Sync,
) -> Vec<T> {
    rows_of_parts(bins, groups, &[pieces], |y, rows| read(y, &rows[0]))
}

/// The same of several parts of the light, each the sum of its own pieces.
pub fn rows_of_parts<'a, T: Send>(
    bins: [usize; 2],
    groups: usize,
    parts: &[impl AsRef<[Piece<'a>]> + Sync],
    read: impl Fn(usize, &[RowOfGroups]) -> T + Sync,
) -> Vec<T> {
    let row = |y: usize| {
        let sum = |pieces: &[Piece]| {
            let mut sum = RowOfGroups {
                bins: bins[0],
                values: vec![0.0; groups * bins[0]],
                one_path: vec![0.0; bins[0]],
            };
            for piece in pieces {
                piece.add_to(&mut sum, y);
            }
            sum
        };
        let sums: Vec<RowOfGroups> = parts.iter().map(|pieces| sum(pieces.as_ref())).collect();
        read(y, &sums)
    };
    (0..bins[1]).into_par_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two groups of 3 x 2 bins: group g holds 10 (j + g) + i.
    fn block() -> Block {
        let group =
            |g: usize| -> Vec<f64> { (0..6).map(|k| (10 * (k / 3 + g) + k % 3) as f64).collect() };
        Block::new([3, 2], &[group(0), group(1)], 0.5)
    }

    #[test]
    fn images_are_placed_and_added() {
        let block = block();
        let plain = Piece {
            block: &block,
            turn: Turn::default(),
            at: [1, 1],
            within: ANYWHERE,
            weight: 2.0,
        };
        let of = |turn: Turn| Block::sum([5, 4], 2, &[Piece { turn, ..plain }]);
        let all = |block: &Block, group: usize| -> Vec<Vec<f64>> {
            (0..4).map(|j| block.row(group, j).to_vec()).collect()
        };
        let none = vec![0.0; 5];
        let as_is = of(Turn::default());
        let expected = [
            none.clone(),
            vec![0.0, 0.0, 2.0, 4.0, 0.0],
            vec![0.0, 20.0, 22.0, 24.0, 0.0],
            none.clone(),
        ];
        assert_eq!(all(&as_is, 0), expected);
        assert_eq!(as_is.row(1, 1), [0.0, 20.0, 22.0, 24.0, 0.0]);
        let mirrored = of(Turn { mirror: [true, true], swap: false });
        let expected = [
            none.clone(),
            vec![0.0, 24.0, 22.0, 20.0, 0.0],
            vec![0.0, 4.0, 2.0, 0.0, 0.0],
            none.clone(),
        ];
        assert_eq!(all(&mirrored, 0), expected);
        // Exchanged, then mirrored along x: columns of the block from the last to the first.
        let swapped = of(Turn { mirror: [true, false], swap: true });
        let expected = [
            none,
            vec![0.0, 20.0, 0.0, 0.0, 0.0],
            vec![0.0, 22.0, 2.0, 0.0, 0.0],
            vec![0.0, 24.0, 4.0, 0.0, 0.0],
        ];
        assert_eq!(all(&swapped, 0), expected);
        let twice = [plain, Piece { at: [2, 2], ..plain }];
        let seen = rows([5, 4], 2, &twice, |y, row| (y, row.total()[2], row.one_path[2]));
        assert_eq!(seen, [(0, 0.0, 0.0), (1, 24.0, 1.0), (2, 64.0 + 20.0, 2.0), (3, 60.0, 1.0)]);
        // Across the lower ends, and within the first two columns alone.
        let turned = Turn { mirror: [true, true], swap: false };
        let across = Piece { turn: turned, at: [-1, -1], ..plain };
        let of = |piece: Piece| all(&Block::sum([5, 4], 2, &[piece]), 0)[0].clone();
        assert_eq!(of(across), [2.0, 0.0, 0.0, 0.0, 0.0]);
        let narrow = Piece { within: [[2, 9], [0, 9]], at: [1, 0], ..plain };
        assert_eq!(of(narrow), [0.0, 0.0, 2.0, 4.0, 0.0]);
    }
}
