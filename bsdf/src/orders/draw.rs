// SPDX-License-Identifier: MIT OR Apache-2.0
//! Drawing one order, step by step, so that a tracer can take each step for many rays before the next: tables are larger than the caches of a
//! processor, and the waits of different rays then overlap.
//!
//! [`OrderTable::locate`] finds the node, [`OrderTable::search`] begins at it, [`OrderTable::narrow`] halves the orders that are left until
//! [`OrderTable::found`] tells the one; [`OrderTable::redraw`] is for the rare order that does not propagate at the query. Together they are [`Scatter::sample`](crate::Scatter::sample).

use super::OrderTable;
use super::build::FULL;
use super::grid::Node;
use crate::direction::{Side, Tangential};
use crate::scatter::Sample;

/// Entries of the running sums that are kept beside each other at a node.
const MARKS: usize = 13;

/// A node in one line of a cache: its place, its orders, and its running sums at the ends of the first [`MARKS`] of [`MARKS`] + 1 equal blocks.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Marked {
    node: Node,
    marks: [u32; MARKS],
}

impl Marked {
    pub fn new(node: Node, cumulative: &[u32]) -> Self {
        let own = &cumulative[node.all()];
        let block = block(node) as usize;
        let mark = |number: usize| own.get((number + 1) * block - 1).copied().unwrap_or(FULL);
        Self {
            node,
            marks: std::array::from_fn(mark),
        }
    }
}

/// Orders in a block of a node.
#[inline]
fn block(node: Node) -> u32 {
    let count = u32::from(node.count[0]) + u32::from(node.count[1]);
    count.div_ceil(MARKS as u32 + 1).max(1)
}

/// A search for the order of a node that owns a number.
#[derive(Clone, Copy, Debug)]
pub struct OrderSearch {
    node: Node,
    /// The number, in units of 1/[`u32::MAX`].
    level: u32,
    /// First entry that may own it, and how many may.
    from: u32,
    left: u32,
}

impl OrderSearch {
    /// A search that is done and found nothing.
    pub const NONE: Self = Self {
        node: Node {
            first: 0,
            lowest: [0; 2],
            count: [0; 2],
        },
        level: 0,
        from: 0,
        left: 0,
    };

    /// How many more times it must be narrowed.
    #[inline]
    #[must_use]
    pub fn steps(&self) -> u32 {
        let rest = self.left.saturating_sub(1);
        u32::BITS - rest.leading_zeros()
    }
}

impl OrderTable {
    /// Index of one of the nodes around a wavevector of light from `side`, drawn by its weight with `u` uniform on 0..1.
    #[inline]
    #[must_use]
    pub fn locate(&self, side: Side, k: Tangential, u: f64) -> usize {
        let (layout, ky) = (&self.layout, k.ky.abs());
        let rows = &layout.rows[side.index()];
        let (low, high) = layout.rows_around(ky);
        let ky_weight = if low == high {
            0.0
        } else {
            (ky - rows[low].ky) * rows[low].per_gap
        };
        let position = k.kx * layout.nodes_per_kx - layout.kx_offset;
        let left = position.floor();
        let kx_weight = position - left;
        let left = left as i32;
        let has_both = |row: usize| left >= rows[row].kx[0] && left + 1 < rows[row].kx[1];
        if !(has_both(low) && has_both(high)) {
            return self.corners(side, k.kx, ky).pick(u);
        }
        // One number for both choices: first the row, then what is left of it for the column.
        let upper = u < ky_weight;
        let (row, rest, all) = if upper {
            (high, u, ky_weight)
        } else {
            (low, u - ky_weight, 1.0 - ky_weight)
        };
        let node = rows[row].origin as i32 + left + i32::from(rest < kx_weight * all);
        node as usize
    }

    /// The first entry of a node. Asked for all rays before their searches, it brings what these need into the caches while they wait together.
    #[inline]
    #[must_use]
    pub fn first(&self, node: usize) -> u32 {
        self.marked[node].node.first
    }

    /// Begins the search among the orders of a node, whose first entry is `first`, for `u` uniform on 0..1.
    #[inline]
    #[must_use]
    pub fn search(&self, node: usize, first: u32, u: f64) -> OrderSearch {
        let Marked { node, marks } = &self.marked[node];
        let node = *node;
        let level = (u * f64::from(FULL)) as u32;
        let before: u32 = marks.iter().map(|mark| u32::from(*mark <= level)).sum();
        let count = u32::from(node.count[0]) + u32::from(node.count[1]);
        let skipped = before * block(node);
        OrderSearch {
            node,
            level,
            from: first + skipped,
            left: block(node).min(count.saturating_sub(skipped)),
        }
    }

    /// Halves what is left of a search; nothing happens to one that is done.
    #[inline]
    pub fn narrow(&self, search: &mut OrderSearch) {
        let half = search.left / 2;
        let middle = search.from + half;
        // At the end of a search this reads an entry that does not count.
        let sum = self.cumulative[(middle.max(1) - 1) as usize];
        search.from = if half > 0 && sum <= search.level {
            middle
        } else {
            search.from
        };
        search.left -= half;
    }

    /// The order found by a search that is done: the side on which it leaves, and its relative number; `None` if the light is absorbed.
    #[inline]
    #[must_use]
    pub fn found(&self, search: &OrderSearch) -> Option<(Side, i32)> {
        if search.left == 0 || self.cumulative[search.from as usize] <= search.level {
            return None;
        }
        let k = search.from - search.node.first;
        let (inner, lowest) = (u32::from(search.node.count[0]), search.node.lowest);
        Some(if k < inner {
            (Side::Inner, i32::from(lowest[0]) + k as i32)
        } else {
            (Side::Outer, i32::from(lowest[1]) + (k - inner) as i32)
        })
    }

    /// Width of a Brillouin zone: the step of kx from one order to the next.
    #[inline]
    #[must_use]
    pub fn zone(&self) -> f64 {
        self.layout.zone
    }

    /// Draws again, for light from `from` that fell to an order on side `to` that does not propagate.
    #[cold]
    pub fn redraw(
        &self,
        (from, to): (Side, Side),
        k: Tangential,
        rng: &mut dyn rand::Rng,
    ) -> Option<Sample> {
        let corners = self.corners(from, k.kx, k.ky.abs());
        self.redirect(&corners, from, to, k, rng)
    }
}
