// SPDX-License-Identifier: MIT OR Apache-2.0
//! Alias table of the orders of every node: one read of four bytes samples an order.
//!
//! In: the layout and the running sums of its nodes. Out: for each node as many equally likely bins
//! as it has orders, each with at most two orders in it [Walker 1977], filled without remainder
//! [Vose 1991]. A bin is one word. Its low bits are the alias, the number of its second order. Its
//! high bits are the fraction that belongs to the first order, whose number is that of the bin.
//! Integer arithmetic keeps a node exact to 2^-31: no probability is off by more than 5e-10, and an
//! order of efficiency 0 is never sampled.
//!
//! Nodes of one row whose kx differ by whole Brillouin zones share a Bloch wavevector and therefore
//! the same outgoing kx. [`BlochNodes`] describes them once, and their bins follow node by node.
//!
//! \[Walker 1977\] A. J. Walker, *An efficient method for generating discrete random variables with
//! general distributions*, ACM Trans. Math. Softw. 3, 253.
//!
//! \[Vose 1991\] M. D. Vose, *A linear algorithm for generating random numbers with a given
//! distribution*, IEEE Trans. Softw. Eng. 17, 972.

use super::Grid;
use super::layout::{Layout, NodeOrders};
use crate::direction::Side;

/// The cumulative sum of a node that absorbs nothing.
pub(super) const FULL: u32 = u32::MAX;

/// Fewest and most entries of the lookup from |ky| to its interval.
const KY_LOOKUP: [usize; 2] = [256, 8192];

/// Nodes of one side with one Bloch wavevector. Whole numbers, stored as reals in one cache line
/// for loops over many rays.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct BlochNodes {
    /// First bin of the node in zone 0; extrapolated where zone 0 has no node.
    pub first_bin: f64,
    /// Bins of a node: one for each order, and one more if light may be absorbed.
    pub bin_count: f64,
    /// Orders that leave on the inner side, on both sides.
    pub inner_orders: f64,
    pub orders: f64,
    /// Zone that the first order leads to, by side.
    pub lowest: [f64; 2],
    /// Bits of a bin that hold its alias.
    pub mask: u64,
}

/// Interval of |ky| between two rows, stored like [`BlochNodes`].
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct KyInterval {
    /// End.
    pub end: f64,
    /// ky of the lower row, and 1 / distance to the upper one; 0 where interpolation ends.
    pub ky: f64,
    pub per_ky: f64,
    /// Range of kx indices i such that both rows have the nodes i and i + 1; empty beyond the last
    /// row.
    pub common_kx: [f64; 2],
    /// First [`BlochNodes`] of the lower and the upper row.
    pub bloch_nodes: [f64; 2],
}

/// Alias tables of all nodes.
#[derive(Clone, Debug)]
pub(super) struct AliasTable {
    pub bins: Vec<u32>,
    /// By side of incidence: Bloch nodes by ky and place in a zone, intervals by ky.
    pub bloch_nodes: [Vec<BlochNodes>; 2],
    pub ky_intervals: [Vec<KyInterval>; 2],
    /// Number of intervals that end below the start of each lookup entry.
    pub ky_lookup: Vec<u32>,
    pub lookup_per_ky: f64,
    /// Nodes along kx in one zone.
    pub kx_per_zone: i32,
}

impl AliasTable {
    /// Alias tables of the nodes of `layout`, whose running sums are `cumulative`.
    pub fn new(grid: &Grid, layout: &Layout, cumulative: &[u32]) -> Self {
        let mut ends = grid.ky.clone();
        ends.insert(layout.below, grid.critical_ky());
        let highest = grid.index_inner.max(grid.index_outer);
        let (ky_lookup, lookup_per_ky) = ky_lookup(&ends, highest);
        ends.push(f64::INFINITY);
        let mut all = Self {
            bins: Vec::with_capacity(layout.entries),
            bloch_nodes: [Vec::new(), Vec::new()],
            ky_intervals: [Vec::new(), Vec::new()],
            ky_lookup,
            lookup_per_ky,
            kx_per_zone: grid.kx_per_zone as i32,
        };
        for side in Side::BOTH {
            for row in 0..grid.ky.len() {
                for place in 0..all.kx_per_zone {
                    all.push_bloch_nodes(side, layout, cumulative, row, place);
                }
            }
            all.ky_intervals[side.index()] = (0..ends.len())
                .map(|number| ky_interval(layout, &ends, number, side, grid.kx_per_zone))
                .collect();
        }
        all
    }

    /// Adds the nodes of one side, row and place in a zone.
    fn push_bloch_nodes(
        &mut self,
        side: Side,
        layout: &Layout,
        cumulative: &[u32],
        row: usize,
        place: i32,
    ) {
        let kx = layout.rows[side.index()][row].kx;
        let origin = layout.rows[side.index()][row].origin;
        let nodes = (kx[0]..kx[1]).filter(|i| i.rem_euclid(self.kx_per_zone) == place).map(|i| {
            let node = layout.nodes[(origin as i32 + i) as usize];
            (i.div_euclid(self.kx_per_zone), node)
        });
        let Some((first_zone, first)) = nodes.clone().next() else {
            return self.bloch_nodes[side.index()].push(BlochNodes::default());
        };
        let sums = |node: NodeOrders| &cumulative[node.all()];
        let lossy = nodes.clone().any(|(_, node)| sums(node).last() != Some(&FULL));
        let [inner, outer] = first.count.map(u32::from);
        let count = inner + outer + u32::from(lossy);
        let mask = count.next_power_of_two() - 1;
        let bloch = BlochNodes {
            first_bin: self.bins.len() as f64 - f64::from(first_zone) * f64::from(count),
            bin_count: f64::from(count),
            inner_orders: f64::from(inner),
            orders: f64::from(inner + outer),
            lowest: first.lowest.map(|lowest| f64::from(first_zone) + f64::from(lowest)),
            mask: u64::from(mask),
        };
        for (_, node) in nodes {
            fill(&mut self.bins, sums(node), count, mask);
        }
        self.bloch_nodes[side.index()].push(bloch);
    }

    /// The interval of a |ky| for light from `side`.
    #[inline]
    pub fn ky_interval(&self, side: Side, ky: f64) -> &KyInterval {
        let intervals = &self.ky_intervals[side.index()];
        let entry = ((ky * self.lookup_per_ky) as usize).min(self.ky_lookup.len() - 1);
        let mut number = self.ky_lookup[entry] as usize;
        while intervals[number].end <= ky {
            number += 1;
        }
        &intervals[number]
    }

    /// True if no lookup entry holds the ends of two intervals.
    pub fn has_direct_lookup(&self) -> bool {
        is_direct(&self.ky_lookup)
    }
}

/// Lookup from |ky| to the number of interval ends below it, and its entries per ky. It is refined
/// until no entry holds two ends, or up to its largest size.
fn ky_lookup(ends: &[f64], highest: f64) -> (Vec<u32>, f64) {
    let mut count = KY_LOOKUP[0];
    loop {
        let per_ky = count as f64 / highest;
        let lookup: Vec<u32> = (0..=count)
            .map(|entry| {
                // Slightly lower, so that rounding never starts the search too high.
                let from = entry as f64 / per_ky * (1.0 - 1e-14);
                ends.partition_point(|end| *end <= from) as u32
            })
            .collect();
        if is_direct(&lookup) || count >= KY_LOOKUP[1] {
            return (lookup, per_ky);
        }
        count *= 2;
    }
}

fn is_direct(lookup: &[u32]) -> bool {
    lookup.windows(2).all(|pair| pair[1] - pair[0] <= 1)
}

/// The interval below `ends[number]`; a row has `kx_per_zone` sets of Bloch nodes.
fn ky_interval(
    layout: &Layout,
    ends: &[f64],
    number: usize,
    side: Side,
    kx_per_zone: usize,
) -> KyInterval {
    let from = if number == 0 { 0.0 } else { ends[number - 1] };
    let (low, high) = layout.rows_around(from);
    let rows = &layout.rows[side.index()];
    let [min, max] = [0, 1].map(|end: usize| [low, high].map(|row| rows[row].kx[end]));
    let common = [min[0].max(min[1]), max[0].min(max[1]) - 1];
    let common = if layout.is_beyond_rows(side, from) { [0; 2] } else { common };
    let [low, high] = [low, high].map(|row| (row, rows[row]));
    KyInterval {
        end: ends[number],
        ky: low.1.ky,
        per_ky: if low.0 == high.0 { 0.0 } else { low.1.per_gap },
        common_kx: common.map(f64::from),
        bloch_nodes: [low.0, high.0].map(|row| (row * kx_per_zone) as f64),
    }
}

/// Fills `count` bins, numbered in the bits of `mask`, from running sums of efficiencies (Vose's
/// algorithm). The rest to 1 is absorption, the last outcome.
fn fill(bins: &mut Vec<u32>, sums: &[u32], count: u32, mask: u32) {
    // A bin holds `size` units of probability.
    let shift = mask.count_ones();
    let size = 1_u64 << (32 - shift);
    let whole = size * u64::from(count);
    // Rounding the sums, not the units, keeps their total exact.
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
    // Orders with less than a bin are topped up by those with more.
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..count as usize).partition(|order| units[*order] < size);
    let first = bins.len();
    bins.extend(0..count);
    while let (Some(less), Some(more)) = (small.pop(), large.last().copied()) {
        bins[first + less] = ((units[less] as u32) << shift) | more as u32;
        units[more] -= size - units[less];
        if units[more] < size {
            large.pop();
            small.push(more);
        }
    }
    // The remaining bins are full: their alias is their own order.
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Probability of each order in units of 2^-32 / `count`, summed over the bins.
    fn drawn(bins: &[u32], mask: u32) -> Vec<u64> {
        let mut often = vec![0_u64; bins.len()];
        for (order, bin) in bins.iter().enumerate() {
            let own = u64::from(bin & !mask);
            often[order] += own;
            often[(bin & mask) as usize] += (1 << 32) - own;
        }
        often
    }

    #[test]
    fn bins_hold_the_running_sums() {
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
            let mut bins = Vec::new();
            fill(&mut bins, sums, count, mask);
            assert_eq!(bins.len(), count as usize);
            let often = drawn(&bins, mask);
            let whole = (u64::from(count) << 32) as f64;
            let mut before = 0;
            for (order, often) in often.iter().enumerate() {
                let sum = sums.get(order).copied().unwrap_or(FULL);
                let efficiency = f64::from(sum - before) / f64::from(FULL);
                let got = *often as f64 / whole;
                assert!((got - efficiency).abs() < 5e-10, "{sums:?} {order}: {got} {efficiency}");
                assert!(efficiency > 0.0 || *often == 0, "{sums:?} {order}");
                before = sum;
            }
        }
    }

    #[test]
    fn intervals_are_those_of_the_rows_around() {
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
            let table = AliasTable::new(&grid, &layout, &vec![FULL; layout.entries]);
            let highest = index_inner.max(index_outer);
            let even = (0..=4000).map(|k| highest * f64::from(k) / 4000.0);
            let ends = table.ky_intervals[0]
                .iter()
                .map(|interval| interval.end)
                .filter(|end| end.is_finite());
            let beside = ends.clone().flat_map(|e| [e.next_down(), e, e.next_up()]);
            for ky in even.chain(beside).filter(|ky| *ky >= 0.0) {
                let (low, high) = layout.rows_around(ky);
                for side in Side::BOTH {
                    let interval = table.ky_interval(side, ky);
                    assert_eq!(
                        interval.bloch_nodes.map(|first| first as usize),
                        [2 * low, 2 * high],
                        "{ky}"
                    );
                    assert_eq!(interval.ky.to_bits(), grid.ky[low].to_bits(), "{ky}");
                    assert_eq!(interval.per_ky > 0.0, low != high, "{ky}");
                }
            }
        }
    }
}
