// SPDX-License-Identifier: MIT OR Apache-2.0
//! Drawing one order, step by step, so that a tracer can take each step for many rays before the next: tables are larger than the caches of a
//! processor, and the waits of different rays then overlap.
//!
//! `locate` finds the urn, `urn` reads it, which is all that is read of the large arrays, and `order` tells the order; [`OrderTable::redraw`] is for the
//! rare order that does not propagate at the query. Together they are [`Scatter::sample`](crate::Scatter::sample). Here are the operations on one
//! ray; [`OrderDeck`](super::OrderDeck) has the same for loops over many of them.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "a branch or a call within a loop over many rays would keep it from being compiled to wide instructions"
)]

use super::OrderTable;
use super::urns::{Gap, Stack};
use crate::direction::{Side, Tangential};
use crate::scatter::Sample;

/// Where a draw has come to: a node, and one of its urns. All are whole numbers but `part`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrderSpot {
    /// Place of the urn among all of the table.
    pub urn: f64,
    /// The first order in it.
    pub own: f64,
    /// Which part of the urn decides between its two orders, 0 to 1.
    pub part: f64,
    /// Number of the stack of the node.
    pub stack: f64,
    /// The zone in which the node lies.
    pub zone: f64,
}

/// An order that was drawn. All are whole numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrawnOrder {
    /// Whether it leaves on the inner side, else on the outer one.
    pub inner: bool,
    /// Whether the light is absorbed instead.
    pub absorbed: bool,
    /// Its relative number.
    pub order: f64,
}

impl Gap {
    /// One of the nodes around a place along kx, in node indices, drawn by its weight with `u` uniform on 0..1: whether all of
    /// them exist, whether it is one of the upper row, and its index.
    #[inline(always)]
    pub fn corner(&self, ky: f64, position: f64, u: f64) -> (bool, bool, f64) {
        let weight = (ky - self.ky) * self.per_ky;
        let left = position.floor();
        // One number for both choices: first the row, then what is left of it for the column.
        let upper = u < weight;
        let (rest, all) = (
            if upper { u } else { u - weight },
            if upper { weight } else { 1.0 - weight },
        );
        let right = rest < (position - left) * all;
        let exist = (left >= self.both[0]) & (left < self.both[1]);
        (exist, upper, left + if right { 1.0 } else { 0.0 })
    }
}

impl Stack {
    /// The urn of the node in `zone` that `v`, uniform on 0..1, falls to: its place, its first order, and where in the urn.
    #[inline(always)]
    pub fn pick(&self, zone: f64, v: f64) -> [f64; 3] {
        let place = v * self.count;
        let own = place.floor();
        [self.urns + zone * self.count + own, own, place - own]
    }

    /// The order drawn from `urn`.
    #[inline(always)]
    pub fn order(&self, spot: &OrderSpot, urn: u32) -> DrawnOrder {
        let (urn, mask) = (u64::from(urn), self.mask);
        let first = spot.part * 4_294_967_296.0 < (urn & !mask) as f64;
        let second = (urn & mask) as f64;
        let number = if first { spot.own } else { second };
        let inner = number < self.inner;
        let beyond = self.lowest[1] - self.inner;
        DrawnOrder {
            inner,
            absorbed: number >= self.orders,
            order: (if inner { self.lowest[0] } else { beyond }) + number - spot.zone,
        }
    }
}

/// The zone of a node, by its index along kx and 1 / nodes to a zone.
#[inline(always)]
pub(super) fn zone(node: f64, zones_per_node: f64) -> f64 {
    ((node + 0.5) * zones_per_node).floor()
}

impl OrderTable {
    /// One of the nodes around a wavevector of light from `side`, drawn by its weight with the first of two numbers uniform on 0..1, and one of its
    /// urns, drawn with the second.
    #[must_use]
    pub fn locate(&self, side: Side, k: Tangential, [u, v]: [f64; 2]) -> OrderSpot {
        let urns = &self.urns;
        let gap = urns.gap(side, k.ky.abs());
        let position = k.kx * self.layout.nodes_per_kx - self.layout.kx_offset;
        let (exist, upper, node) = gap.corner(k.ky.abs(), position, u);
        let (stacks, node) = if exist {
            (gap.stacks[usize::from(upper)], node)
        } else {
            self.locate_at_rim(side, k, u)
        };
        let zone = zone(node, 1.0 / f64::from(urns.per_zone));
        let stack = stacks + node - zone * f64::from(urns.per_zone);
        let [urn, own, part] = urns.stacks[side.index()][stack as usize].pick(zone, v);
        OrderSpot {
            urn,
            own,
            part,
            stack,
            zone,
        }
    }

    /// The first stack of the row of a node, and its index along kx, where not all nodes around exist.
    #[cold]
    fn locate_at_rim(&self, side: Side, k: Tangential, u: f64) -> (f64, f64) {
        let node = self.corners(side, k.kx, k.ky.abs()).pick(u) as i64;
        let rows = &self.layout.rows[side.index()];
        let first = |row: &super::grid::KyRow| i64::from(row.origin) + i64::from(row.kx[0]);
        let row = rows.partition_point(|row| first(row) <= node) - 1;
        let kx = node - i64::from(rows[row].origin);
        (
            (row as i64 * i64::from(self.urns.per_zone)) as f64,
            kx as f64,
        )
    }

    /// Another urn of the node of a spot, drawn with `v` uniform on 0..1.
    pub(super) fn urn_anew(&self, side: Side, spot: &OrderSpot, v: f64) -> OrderSpot {
        let stack = &self.urns.stacks[side.index()][spot.stack as usize];
        let [urn, own, part] = stack.pick(spot.zone, v);
        OrderSpot {
            urn,
            own,
            part,
            ..*spot
        }
    }

    /// The urn of a spot of this table.
    #[inline]
    #[must_use]
    pub fn urn(&self, spot: &OrderSpot) -> u32 {
        self.urns.list[spot.urn as usize]
    }

    /// The order drawn from an urn for light from `side`: the side on which it leaves, and its relative number; `None` if the light is absorbed.
    #[must_use]
    pub fn order(&self, side: Side, spot: &OrderSpot, urn: u32) -> Option<(Side, i32)> {
        let drawn = self.urns.stacks[side.index()][spot.stack as usize].order(spot, urn);
        let to = if drawn.inner {
            Side::Inner
        } else {
            Side::Outer
        };
        (!drawn.absorbed).then_some((to, drawn.order as i32))
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
