// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables prepared for drawing: one read of four bytes decides which order a ray takes.
//!
//! In: a layout and the running sums of its nodes. Out: for each node as many equally likely *urns* as it has orders, each with at most two orders in it
//! [Walker 1977], filled so that none is left over [Vose 1991]. An urn is one word: the low bits number its second order, the high ones say how much of it
//! belongs to the first one, whose number is that of the urn. All of it is done in whole numbers: the running sums are rounded to units of which a node has
//! more than 2^31, so that no order is drawn more or less often than its share says by more than 5e-10, and one without a share never.
//!
//! Nodes of a row whose kx differ by whole Brillouin zones scatter to the same outgoing kx: they have the same orders, counted from
//! the kx they lead to. Such a *stack* of nodes needs to be described only once, and its urns lie node by node.
//!
//! \[Walker 1977\] A. J. Walker, *An efficient method for generating discrete random variables with general distributions*, ACM Trans. Math. Softw. 3, 253.
//!
//! \[Vose 1991\] M. D. Vose, *A linear algorithm for generating random numbers with a given distribution*, IEEE Trans. Softw. Eng. 17, 972.

use super::Grid;
use super::build::FULL;
use super::grid::{Layout, Node};
use crate::direction::Side;

/// Fewest and most cells of |ky| in which the search for its rows begins.
const KY_CELLS: [usize; 2] = [256, 8192];

/// Nodes of one side, one ky and one place in a Brillouin zone: whole numbers, kept as reals and in one line of a cache, for loops over many rays.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Stack {
    /// First urn of the node in zone 0, if there were one.
    pub urns: f64,
    /// Urns of a node: one for each order, and one more if light may be absorbed.
    pub count: f64,
    /// Orders that leave on the inner side, on both sides.
    pub inner: f64,
    pub orders: f64,
    /// Zone that the first order leads to, by side.
    pub lowest: [f64; 2],
    /// Bits of an urn that number its second order.
    pub mask: u64,
}

/// Range of |ky| between two rows, likewise.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Gap {
    /// Where it ends.
    pub end: f64,
    /// The lower row, and 1 / distance to the upper one; 0 where interpolation ends.
    pub ky: f64,
    pub per_ky: f64,
    /// Node indices along kx of which both rows have this one and the next: from the first, before the second.
    pub both: [f64; 2],
    /// First stacks of the rows.
    pub stacks: [f64; 2],
}

/// The nodes of a table, prepared for drawing.
#[derive(Clone, Debug)]
pub(super) struct Urns {
    pub list: Vec<u32>,
    /// By side of incidence: stacks by ky and place in a zone, gaps by ky.
    pub stacks: [Vec<Stack>; 2],
    pub gaps: [Vec<Gap>; 2],
    /// How many gaps end surely below each of even cells.
    pub cells: Vec<u32>,
    pub cells_per_ky: f64,
    /// Nodes along kx in a zone.
    pub per_zone: i32,
}

impl Urns {
    /// The nodes of `layout`, whose running sums are `cumulative`.
    pub fn new(grid: &Grid, layout: &Layout, cumulative: &[u32]) -> Self {
        let mut ends = grid.ky.clone();
        ends.insert(layout.below, grid.critical_ky());
        let highest = grid.index_inner.max(grid.index_outer);
        let (cells, cells_per_ky) = cells(&ends, highest);
        ends.push(f64::INFINITY);
        let mut all = Self {
            list: Vec::with_capacity(layout.entries),
            stacks: [Vec::new(), Vec::new()],
            gaps: [Vec::new(), Vec::new()],
            cells,
            cells_per_ky,
            per_zone: grid.kx_per_zone as i32,
        };
        for side in Side::BOTH {
            for row in 0..grid.ky.len() {
                for place in 0..all.per_zone {
                    all.stack(side, (layout, cumulative), row, place);
                }
            }
            all.gaps[side.index()] = (0..ends.len())
                .map(|number| gap(layout, (&ends, number), side, grid.kx_per_zone))
                .collect();
        }
        all
    }

    /// Adds the nodes of one stack.
    fn stack(
        &mut self,
        side: Side,
        (layout, cumulative): (&Layout, &[u32]),
        row: usize,
        place: i32,
    ) {
        let kx = layout.rows[side.index()][row].kx;
        let origin = layout.rows[side.index()][row].origin;
        let nodes = (kx[0]..kx[1])
            .filter(|i| i.rem_euclid(self.per_zone) == place)
            .map(|i| {
                let node = layout.nodes[(origin as i32 + i) as usize];
                (i.div_euclid(self.per_zone), node)
            });
        let Some((first_zone, first)) = nodes.clone().next() else {
            return self.stacks[side.index()].push(Stack::default());
        };
        let sums = |node: Node| &cumulative[node.all()];
        let lossy = nodes
            .clone()
            .any(|(_, node)| sums(node).last() != Some(&FULL));
        let [inner, outer] = first.count.map(u32::from);
        let count = inner + outer + u32::from(lossy);
        let mask = count.next_power_of_two() - 1;
        let stack = Stack {
            urns: self.list.len() as f64 - f64::from(first_zone) * f64::from(count),
            count: f64::from(count),
            inner: f64::from(inner),
            orders: f64::from(inner + outer),
            lowest: first
                .lowest
                .map(|lowest| f64::from(first_zone) + f64::from(lowest)),
            mask: u64::from(mask),
        };
        for (_, node) in nodes {
            fill(&mut self.list, sums(node), count, mask);
        }
        self.stacks[side.index()].push(stack);
    }

    /// The gap in which a |ky| lies, for light from `side`.
    #[inline]
    pub fn gap(&self, side: Side, ky: f64) -> &Gap {
        let gaps = &self.gaps[side.index()];
        let cell = ((ky * self.cells_per_ky) as usize).min(self.cells.len() - 1);
        let mut number = self.cells[cell] as usize;
        while gaps[number].end <= ky {
            number += 1;
        }
        &gaps[number]
    }

    /// Whether no cell of |ky| holds the ends of two gaps.
    pub fn single(&self) -> bool {
        single(&self.cells)
    }

    /// Memory taken, in bytes.
    pub fn bytes(&self) -> usize {
        4 * self.list.len()
            + size_of::<Stack>() * (self.stacks[0].len() + self.stacks[1].len())
            + size_of::<Gap>() * (self.gaps[0].len() + self.gaps[1].len())
            + 4 * self.cells.len()
    }
}

/// Number of ends surely below each of even cells of |ky|, of which there are enough that none holds two ends, if that can be had; and cells per ky.
fn cells(ends: &[f64], highest: f64) -> (Vec<u32>, f64) {
    let mut count = KY_CELLS[0];
    loop {
        let per_ky = count as f64 / highest;
        let cells: Vec<u32> = (0..=count)
            .map(|cell| {
                // A little lower, so that rounding never begins the search too high.
                let from = cell as f64 / per_ky * (1.0 - 1e-14);
                ends.partition_point(|end| *end <= from) as u32
            })
            .collect();
        if single(&cells) || count >= KY_CELLS[1] {
            return (cells, per_ky);
        }
        count *= 2;
    }
}

fn single(cells: &[u32]) -> bool {
    cells.windows(2).all(|pair| pair[1] - pair[0] <= 1)
}

/// The gap below `ends[number]`; a row has `per_zone` stacks.
fn gap(layout: &Layout, (ends, number): (&[f64], usize), side: Side, per_zone: usize) -> Gap {
    let from = if number == 0 { 0.0 } else { ends[number - 1] };
    let (low, high) = layout.rows_around(from);
    let rows = &layout.rows[side.index()];
    let [least, most] = [0, 1].map(|end: usize| [low, high].map(|row| rows[row].kx[end]));
    let [low, high] = [low, high].map(|row| (row, rows[row]));
    Gap {
        end: ends[number],
        ky: low.1.ky,
        per_ky: if low.0 == high.0 { 0.0 } else { low.1.per_gap },
        both: [
            f64::from(least[0].max(least[1])),
            f64::from(most[0].min(most[1]) - 1),
        ],
        stacks: [low.0, high.0].map(|row| (row * per_zone) as f64),
    }
}

/// Fills `count` urns, numbered in the bits of `mask`, with orders of these running sums; what they leave of a whole is absorbed and comes last.
fn fill(urns: &mut Vec<u32>, sums: &[u32], count: u32, mask: u32) {
    // Units of a share that an urn holds.
    let shift = mask.count_ones();
    let size = 1_u64 << (32 - shift);
    let whole = size * u64::from(count);
    // Rounded sums, so that the units add up to all there are.
    let below = |sum: u32| {
        let product = u128::from(sum) * u128::from(whole);
        ((product + u128::from(FULL / 2)) / u128::from(FULL)) as u64
    };
    let mut before = 0;
    let mut units: Vec<u64> = sums
        .iter()
        .map(|sum| {
            let now = below(*sum);
            now - std::mem::replace(&mut before, now)
        })
        .collect();
    units.resize(count as usize, 0);
    units[count as usize - 1] += whole - before;
    // Orders with less than an urn are topped up by those with more.
    let (mut short, mut long): (Vec<usize>, Vec<usize>) =
        (0..count as usize).partition(|order| units[*order] < size);
    let first = urns.len();
    urns.extend(0..count);
    while let (Some(poor), Some(rich)) = (short.pop(), long.last().copied()) {
        urns[first + poor] = ((units[poor] as u32) << shift) | rich as u32;
        units[rich] -= size - units[poor];
        if units[rich] < size {
            long.pop();
            short.push(rich);
        }
    }
    // Those that are left are full: both of their orders are the same.
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How often each order is drawn, in units of 2^-32 / `count`, by adding up the urns.
    fn drawn(urns: &[u32], mask: u32) -> Vec<u64> {
        let mut often = vec![0_u64; urns.len()];
        for (order, urn) in urns.iter().enumerate() {
            let own = u64::from(urn & !mask);
            often[order] += own;
            often[(urn & mask) as usize] += (1 << 32) - own;
        }
        often
    }

    #[test]
    fn urns_hold_what_the_running_sums_say() {
        let cases: [(&[u32], u32); 6] = [
            (&[FULL], 1),
            (&[0, FULL], 2),
            (&[FULL / 3, FULL / 2, FULL / 2, FULL], 4),
            (&[7, 9, 1_000_000, 4_000_000_000, FULL], 5),
            // A quarter absorbed, and all of it.
            (&[FULL / 4, FULL / 4 * 3], 3),
            (&[0, 0], 3),
        ];
        for (sums, count) in cases {
            let mask = count.next_power_of_two() - 1;
            let mut urns = Vec::new();
            fill(&mut urns, sums, count, mask);
            assert_eq!(urns.len(), count as usize);
            let often = drawn(&urns, mask);
            let whole = (u64::from(count) << 32) as f64;
            let mut before = 0;
            for (order, often) in often.iter().enumerate() {
                let sum = sums.get(order).copied().unwrap_or(FULL);
                let share = f64::from(sum - before) / f64::from(FULL);
                let got = *often as f64 / whole;
                assert!(
                    (got - share).abs() < 5e-10,
                    "{sums:?} {order}: {got} {share}"
                );
                assert!(share > 0.0 || *often == 0, "{sums:?} {order}");
                before = sum;
            }
        }
    }

    #[test]
    fn gaps_are_those_of_the_rows_around() {
        for (index_inner, index_outer, count) in [(1.41, 1.0, 22), (1.0, 1.5, 7), (1.4, 1.4, 5)] {
            let grid = Grid {
                period: 10.0,
                wavelength: 0.55,
                index_inner,
                index_outer,
                kx_per_zone: 2,
                ky: Grid::ky_nodes(index_inner, index_outer, count),
            };
            let layout = Layout::new(&grid);
            let urns = Urns::new(&grid, &layout, &vec![FULL; layout.entries]);
            let highest = index_inner.max(index_outer);
            let even = (0..=4000).map(|k| highest * f64::from(k) / 4000.0);
            let ends = urns.gaps[0]
                .iter()
                .map(|gap| gap.end)
                .filter(|end| end.is_finite());
            let beside = ends.clone().flat_map(|e| [e.next_down(), e, e.next_up()]);
            for ky in even.chain(beside).filter(|ky| *ky >= 0.0) {
                let (low, high) = layout.rows_around(ky);
                for side in Side::BOTH {
                    let gap = urns.gap(side, ky);
                    assert_eq!(
                        gap.stacks.map(|stack| stack as usize),
                        [2 * low, 2 * high],
                        "{ky}"
                    );
                    assert_eq!(gap.ky.to_bits(), grid.ky[low].to_bits(), "{ky}");
                    assert_eq!(gap.per_ky > 0.0, low != high, "{ky}");
                }
            }
        }
    }
}
