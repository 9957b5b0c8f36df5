// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sampling of one order, in steps that a tracer can take for many rays at a time.
//!
//! Tables exceed the caches of a processor; taking each step for many rays before the next one
//! overlaps their waits for memory. `locate_bin` finds the bin of the alias table, `bin` reads it
//! (the only read of the large arrays), and `order` decodes the order.
//! [`OrderTable::resample_propagating`] handles the rare order that is evanescent at the query.
//! Together they are [`Bsdf::sample`](crate::Bsdf::sample). This module holds the operations on one
//! ray; [`OrderTableBatch`](super::OrderTableBatch) runs them over many.

#![expect(
    clippy::inline_always,
    clippy::needless_bitwise_bool,
    reason = "a branch or a call within a loop over many rays prevents wide instructions"
)]

use super::OrderTable;
use super::alias_table::{BlochNodes, KyInterval};
use crate::direction::{Side, Wavevector};

/// [`BinLocation::fraction`] of the mirror reflection.
const MIRROR: f64 = -1.0;

/// A node and one bin of its alias table. All fields but `fraction` are whole numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BinLocation {
    /// Index of the bin in the table.
    pub bin: f64,
    /// Number of its first order.
    pub own: f64,
    /// Position within the bin, which decides between its two orders, 0 to 1; `MIRROR` for its
    /// own order, which is the mirror reflection, whatever the bin holds.
    pub fraction: f64,
    /// Index of the Bloch nodes that the node belongs to.
    pub bloch: f64,
    /// Brillouin zone of the node.
    pub zone: f64,
}

/// A sampled order. All fields are whole numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampledOrder {
    /// True if it leaves on the inner side, else on the outer one.
    pub inner: bool,
    /// True if the light is absorbed instead.
    pub absorbed: bool,
    /// Relative number.
    pub order: f64,
}

impl BinLocation {
    /// True if the light takes the mirror reflection, which near grazing incidence no node gives.
    pub(super) fn is_mirror(&self) -> bool {
        self.fraction < 0.0
    }
}

impl KyInterval {
    /// Samples one of the four nodes around `position` (in node indices along kx) by its bilinear
    /// weight, with `u` uniform on 0..1. Returns whether all four exist, whether the node lies in
    /// the upper row, and its index.
    #[inline(always)]
    pub fn sample_node(&self, ky: f64, position: f64, u: f64) -> (bool, bool, f64) {
        let weight = (ky - self.ky) * self.per_ky;
        let left = position.floor();
        // One number for both choices: first the row, then its remainder for the column.
        let upper = u < weight;
        let (rest, all) =
            (if upper { u } else { u - weight }, if upper { weight } else { 1.0 - weight });
        let right = rest < (position - left) * all;
        let exist = (left >= self.common_kx[0]) & (left < self.common_kx[1]);
        (exist, upper, left + if right { 1.0 } else { 0.0 })
    }
}

impl BlochNodes {
    /// Samples a bin of the node in `zone` with `v` uniform on 0..1. Returns its index, its first
    /// order and the position within the bin.
    #[inline(always)]
    pub fn sample_bin(&self, zone: f64, v: f64) -> [f64; 3] {
        let place = v * self.bin_count;
        let own = place.floor();
        [self.first_bin + zone * self.bin_count + own, own, place - own]
    }

    /// The order sampled from `bin`.
    #[inline(always)]
    pub fn order(&self, location: &BinLocation, bin: u32) -> SampledOrder {
        let (bin, mask) = (u64::from(bin), self.mask);
        let first = location.fraction * 4_294_967_296.0 < (bin & !mask) as f64;
        let second = (bin & mask) as f64;
        let number = if first { location.own } else { second };
        let inner = number < self.inner_orders;
        let outer = self.lowest[1] - self.inner_orders;
        SampledOrder {
            inner,
            absorbed: number >= self.orders,
            order: (if inner { self.lowest[0] } else { outer }) + number - location.zone,
        }
    }
}

/// The zone of a node, from its index along kx and 1 / nodes per zone.
#[inline(always)]
pub(super) fn zone(node: f64, zones_per_node: f64) -> f64 {
    ((node + 0.5) * zones_per_node).floor()
}

impl OrderTable {
    /// Samples a node around a wavevector of light from `side` by its interpolation weight, and a
    /// bin of that node, with two numbers uniform on 0..1.
    pub fn locate_bin(&self, side: Side, k: Wavevector, [u, v]: [f64; 2]) -> BinLocation {
        let table = &self.alias_table;
        let interval = table.ky_interval(side, k.ky.abs());
        let position = k.kx * self.layout.nodes_per_kx - self.layout.kx_offset;
        let (exist, upper, node) = interval.sample_node(k.ky.abs(), position, u);
        let (first, node, is_mirror) = if exist {
            (interval.bloch_nodes[usize::from(upper)], node, false)
        } else {
            self.node_at_rim(side, k, u)
        };
        let zone = zone(node, 1.0 / f64::from(table.kx_per_zone));
        let bloch = first + node - zone * f64::from(table.kx_per_zone);
        let nodes = &table.bloch_nodes[side.index()][bloch as usize];
        let [bin, own, fraction] = nodes.sample_bin(zone, v);
        if is_mirror {
            let own = match side {
                Side::Inner => zone - nodes.lowest[0],
                Side::Outer => nodes.inner_orders + zone - nodes.lowest[1],
            };
            return BinLocation { bin, own, fraction: MIRROR, bloch, zone };
        }
        BinLocation { bin, own, fraction, bloch, zone }
    }

    /// The first Bloch nodes of the row of a sampled node, its index along kx, and true for the
    /// mirror reflection instead of its orders, where not all four nodes around exist.
    #[cold]
    fn node_at_rim(&self, side: Side, k: Wavevector, u: f64) -> (f64, f64, bool) {
        let stencil = self.stencil(side, k.kx, k.ky.abs());
        let sampled = stencil.sample(u);
        let node = sampled.unwrap_or_else(|| stencil.sample_node(0.0)) as i64;
        let rows = &self.layout.rows[side.index()];
        let first = |row: &super::layout::KyRow| i64::from(row.origin) + i64::from(row.kx[0]);
        let row = rows.partition_point(|row| first(row) <= node) - 1;
        let kx = node - i64::from(rows[row].origin);
        let first = (row as i64 * i64::from(self.alias_table.kx_per_zone)) as f64;
        (first, kx as f64, sampled.is_none())
    }

    /// Another bin of the same node, sampled with `v` uniform on 0..1.
    pub(super) fn resample_bin(&self, side: Side, location: &BinLocation, v: f64) -> BinLocation {
        let bloch = &self.alias_table.bloch_nodes[side.index()][location.bloch as usize];
        let [bin, own, fraction] = bloch.sample_bin(location.zone, v);
        BinLocation { bin, own, fraction, ..*location }
    }

    /// Reads a bin.
    #[inline]
    pub fn bin(&self, location: &BinLocation) -> u32 {
        self.alias_table.bins[location.bin as usize]
    }

    /// The order sampled from a bin for light from `side`: the side on which it leaves, and its
    /// relative order; `None` if the light is absorbed.
    pub fn order(&self, side: Side, location: &BinLocation, bin: u32) -> Option<(Side, i32)> {
        let sampled = self.alias_table.bloch_nodes[side.index()][location.bloch as usize]
            .order(location, bin);
        let to = if sampled.inner { Side::Inner } else { Side::Outer };
        (!sampled.absorbed).then_some((to, sampled.order as i32))
    }
}
