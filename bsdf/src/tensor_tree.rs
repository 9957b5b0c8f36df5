// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tensor trees: adaptive tables of a BSDF over the squares of incidence and of exit.
//!
//! In: nested branches and blocks of values, or the cells of a tabulated function. Out: the values
//! for one incidence, leaf by leaf, and their integral. The unit square stands for the hemisphere
//! by the concentric map ([`square_to_disc`]), so a leaf of edge h has the projected solid angle h²
//! π everywhere. Rank 4 has the coordinates (incidence u, v, exit u, v); a point of the disc is the
//! tangential part of the direction in which light *travels*, before and after. Rank 3 is
//! isotropic: its first coordinate is (1 - sin θ)/2 of the incidence, and exit is rotated so that
//! light arrives travelling along +x. Source of the structure: Radiance, `bsdf_t.c` (G. Ward).

use crate::angular_basis::{disc_to_square, square_to_disc};

/// Largest depth of a tree: cells of 1/2^12 of the square are 0.02 degrees wide.
pub const MAX_DEPTH: u32 = 12;

/// A branch with one child for each half of each coordinate, or a block of values.
#[derive(Clone, Debug, PartialEq)]
pub enum Branch {
    /// 2^rank children; bit i of the number says which half of coordinate i.
    Split(Vec<Branch>),
    /// (2^log2)^rank values, the last coordinate running fastest.
    Block {
        /// Logarithm of the values along one coordinate.
        log2: u32,
        /// The values, 1/sr.
        values: Vec<f32>,
    },
}

/// A tree of rank 3 or 4.
#[derive(Clone, Debug, PartialEq)]
pub struct TensorTree {
    /// 3 (isotropic) or 4.
    pub rank: usize,
    /// The whole square.
    pub root: Branch,
}

/// A square of exit directions with one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// Lowest corner.
    pub corner: [f64; 2],
    /// Edge.
    pub edge: f64,
    /// The BSDF, 1/sr.
    pub value: f64,
}

impl Leaf {
    /// Integral of cos θ dΩ over it, sr.
    pub fn projected(&self) -> f64 {
        std::f64::consts::PI * self.edge * self.edge
    }
}

impl TensorTree {
    /// Coordinates of light that travels with the tangential unit-disc part (x, y) before it meets
    /// the surface.
    pub fn incidence(&self, [x, y]: [f64; 2]) -> Vec<f64> {
        if self.rank == 3 {
            vec![0.5 * (1.0 - x.hypot(y)).clamp(0.0, 1.0 - 1e-12)]
        } else {
            disc_to_square([x, y]).to_vec()
        }
    }

    /// Visits every square of exit for light of these coordinates, until `visit` returns false.
    pub fn leaves(&self, incidence: &[f64], visit: &mut impl FnMut(Leaf) -> bool) {
        visit_leaves(&self.root, self.rank, incidence, [0.0, 0.0], 1.0, visit);
    }

    /// Power scattered per incident power.
    pub fn total(&self, incidence: &[f64]) -> f64 {
        let mut sum = 0.0;
        self.leaves(incidence, &mut |leaf| {
            sum += leaf.value * leaf.projected();
            true
        });
        sum
    }

    /// Number of values.
    pub fn values(&self) -> usize {
        fn count(branch: &Branch) -> usize {
            match branch {
                Branch::Split(children) => children.iter().map(count).sum(),
                Branch::Block { values, .. } => values.len(),
            }
        }
        count(&self.root)
    }

    /// Edge of the smallest square.
    pub fn finest(&self) -> f64 {
        fn depth(branch: &Branch) -> u32 {
            match branch {
                Branch::Split(children) => 1 + children.iter().map(depth).max().unwrap_or(0),
                Branch::Block { log2, .. } => *log2,
            }
        }
        0.5_f64.powi(depth(&self.root) as i32)
    }

    /// The tree of rank 4 for light that goes backwards, with all values times `scale`: incidence
    /// and exit change places, and directions of travel turn round.
    #[must_use]
    pub fn reversed(&self, scale: f64) -> Self {
        Self { rank: self.rank, root: reversed(&self.root, scale as f32) }
    }

    /// A tree of rank 4 with 2^`log2` cells along each coordinate, from its non-zero cells:
    /// incidence cell, exit cell and value, with cells numbered u · 2^log2 + v. Parts of one value
    /// become one leaf.
    pub fn from_cells(log2: u32, mut cells: Vec<([u32; 2], f32)>) -> Self {
        // Morton order, that of the branches: interleaved bits of all four coordinates, highest
        // first.
        let key = |[i, o]: [u32; 2]| {
            let mask = (1_u32 << log2) - 1;
            let parts = [i >> log2, i & mask, o >> log2, o & mask];
            (0..log2).rev().fold(0_u64, |key, bit| {
                let digit = (0..4).fold(0, |d, k| d | (((parts[k] >> bit) & 1) << k));
                (key << 4) | u64::from(digit)
            })
        };
        cells.sort_unstable_by_key(|c| key(c.0));
        let keyed: Vec<(u64, f32)> = cells.iter().map(|c| (key(c.0), c.1)).collect();
        Self { rank: 4, root: from_sorted(&keyed, log2) }
    }
}

/// The branch of rank 4 with halves (a, b, c, d) of its coordinates at (1-c, 1-d, 1-a, 1-b).
fn reversed(branch: &Branch, scale: f32) -> Branch {
    match branch {
        Branch::Split(children) => {
            let from = |k: usize| !((k >> 2 & 3) | (k & 3) << 2) & 15;
            let all = (0..children.len()).filter_map(|k| children.get(from(k)));
            Branch::Split(all.map(|child| reversed(child, scale)).collect())
        }
        Branch::Block { log2, values } => {
            let bits = 2 * log2;
            let (count, low) = (values.len(), (1_usize << bits) - 1);
            let from = |k: usize| (count - 1) & !((k >> bits) | (k & low) << bits);
            let all = (0..count).filter_map(|k| values.get(from(k)));
            Branch::Block { log2: *log2, values: all.map(|value| value * scale).collect() }
        }
    }
}

/// The branch over sorted cells of a cube of 2^log2 cells an edge; cells not listed are zero.
fn from_sorted(cells: &[(u64, f32)], log2: u32) -> Branch {
    let leaf = |value: f32| Branch::Block { log2: 0, values: vec![value] };
    if cells.is_empty() {
        return leaf(0.0);
    }
    if log2 == 0 {
        return leaf(cells[0].1);
    }
    let shift = 4 * (log2 - 1);
    let mut rest = cells;
    let children: Vec<Branch> = (0..16_u64)
        .map(|digit| {
            let end = rest.partition_point(|c| (c.0 >> shift) & 15 <= digit);
            let (mine, others) = rest.split_at(end);
            rest = others;
            from_sorted(mine, log2 - 1)
        })
        .collect();
    match &children[0] {
        Branch::Block { log2: 0, values } if children.iter().all(|c| *c == children[0]) => {
            leaf(values[0])
        }
        _ => Branch::Split(children),
    }
}

fn visit_leaves(
    branch: &Branch,
    rank: usize,
    incidence: &[f64],
    corner: [f64; 2],
    edge: f64,
    visit: &mut impl FnMut(Leaf) -> bool,
) -> bool {
    let fixed = rank - 2;
    match branch {
        Branch::Split(children) => {
            let (mut low, mut rest) = (0, [0.0; 2]);
            for k in 0..fixed {
                let upper = incidence[k] >= 0.5;
                low |= usize::from(upper) << k;
                rest[k] = 2.0 * incidence[k] - f64::from(u8::from(upper));
            }
            let half = 0.5 * edge;
            (0..4).all(|quarter| {
                let [a, b] = [quarter & 1, quarter >> 1];
                let corner = [corner[0] + a as f64 * half, corner[1] + b as f64 * half];
                let child = &children[low | quarter << fixed];
                visit_leaves(child, rank, &rest[..fixed], corner, half, visit)
            })
        }
        Branch::Block { log2, values } => {
            let side = 1_usize << log2;
            let row = incidence
                .iter()
                .fold(0, |row, c| row * side + ((c * side as f64) as usize).min(side - 1));
            let edge = edge / side as f64;
            (0..side * side).all(|k| {
                let (a, b) = (k / side, k % side);
                visit(Leaf {
                    corner: [corner[0] + a as f64 * edge, corner[1] + b as f64 * edge],
                    edge,
                    value: f64::from(values[row * side * side + k]),
                })
            })
        }
    }
}

/// The point at (a, b) of 0..1 in cell number `cell`, of 2^`log2` cells along an edge, on the disc.
pub fn cell_point(cell: u32, log2: u32, [a, b]: [f64; 2]) -> [f64; 2] {
    let side = f64::from(1_u32 << log2);
    let [u, v] = [cell >> log2, cell & ((1 << log2) - 1)];
    square_to_disc([(f64::from(u) + a) / side, (f64::from(v) + b) / side])
}

/// The cell of a point of the disc.
pub fn cell_of(point: [f64; 2], log2: u32) -> u32 {
    let side = 1_u32 << log2;
    let [u, v] = disc_to_square(point).map(|c| ((c * f64::from(side)) as u32).min(side - 1));
    u << log2 | v
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn cells_come_back_from_the_tree_that_was_grown_of_them() {
        let log2 = 3;
        let mut cells = Vec::new();
        for k in 0..200_u32 {
            cells.push(([k * 37 % 64, k * 11 % 64], (k + 1) as f32));
        }
        cells.sort_by_key(|c| c.0);
        cells.dedup_by_key(|c| c.0);
        let tree = TensorTree::from_cells(log2, cells.clone());
        assert!(tree.values() < 64 * 64, "{}", tree.values());
        for incidence in 0..64_u32 {
            let [u, v] = [incidence >> 3, incidence & 7].map(|c| (f64::from(c) + 0.5) / 8.0);
            let expected: f64 =
                cells.iter().filter(|c| c.0[0] == incidence).map(|c| f64::from(c.1)).sum();
            let sum = tree.total(&[u, v]);
            assert!((sum - expected * PI / 64.0).abs() < 1e-9, "{sum}");
            tree.leaves(&[u, v], &mut |leaf| {
                if leaf.value > 0.0 {
                    let [a, b] = leaf.corner.map(|c| (c * 8.0).round() as u32);
                    assert!(
                        (leaf.edge - 0.125).abs() < 1e-12
                            && cells.contains(&([incidence, a * 8 + b], leaf.value as f32))
                    );
                }
                true
            });
        }
    }

    #[test]
    fn a_tree_run_backwards_has_the_value_of_the_pair() {
        let log2 = 2;
        let cells: Vec<_> = (0..256_u32).map(|k| ([k * 7 % 16, k / 16], k as f32)).collect();
        let split = TensorTree::from_cells(log2, cells);
        let values: Vec<f32> = (0..256).map(|k| (k * k % 101) as f32).collect();
        let block = TensorTree { rank: 4, root: Branch::Block { log2, values } };
        let at = |tree: &TensorTree, from: [f64; 2], to: [f64; 2]| {
            let mut found = f64::NAN;
            tree.leaves(&from, &mut |leaf| {
                let inside =
                    |k: usize| (leaf.corner[k]..leaf.corner[k] + leaf.edge).contains(&to[k]);
                if inside(0) && inside(1) {
                    found = leaf.value;
                }
                true
            });
            found
        };
        let back = |[u, v]: [f64; 2]| [1.0 - u, 1.0 - v];
        for tree in [split, block] {
            let reversed = tree.reversed(0.5);
            for k in 0..256 {
                let point = |k: u32| [k >> 2 & 3, k & 3].map(|c| (f64::from(c) + 0.4) / 4.0);
                let (a, b) = (point(k), point(k >> 4));
                let (there, here) = (at(&tree, a, b), at(&reversed, back(b), back(a)));
                assert!((0.5 * there - here).abs() < 1e-9, "{there} {here}");
            }
        }
    }

    #[test]
    fn a_uniform_tree_is_one_leaf() {
        let cells = (0..256_u32).flat_map(|i| (0..256).map(move |o| ([i, o], 0.25))).collect();
        let tree = TensorTree::from_cells(4, cells);
        assert_eq!(tree.values(), 1);
        assert!((tree.total(&[0.3, 0.7]) - 0.25 * PI).abs() < 1e-12);
    }
}
