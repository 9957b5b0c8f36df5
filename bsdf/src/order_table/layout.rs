// SPDX-License-Identifier: MIT OR Apache-2.0
//! Memory layout of an order table: which array entries belong to each node of incidence.
//!
//! All kx, incoming and outgoing, are multiples of the node spacing (shifted by half a spacing
//! where a zone has an odd number of nodes), so integer arithmetic decides which order propagates
//! where.

use super::{Grid, NodeId};
use crate::direction::Side;
use std::ops::Range;

/// Array entries of the orders of one node, inner orders first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NodeOrders {
    /// Entry of its first order.
    pub first: u32,
    /// Lowest relative order on the inner and the outer side.
    pub lowest: [i16; 2],
    /// Number of orders on the inner and the outer side.
    pub count: [u16; 2],
}

impl NodeOrders {
    /// Entries of the orders that leave on `side`.
    pub fn entries(&self, side: Side) -> Range<usize> {
        let inner_end = self.first as usize + usize::from(self.count[0]);
        match side {
            Side::Inner => self.first as usize..inner_end,
            Side::Outer => inner_end..inner_end + usize::from(self.count[1]),
        }
    }

    /// Entries of all orders.
    pub fn all(&self) -> Range<usize> {
        let first = self.first as usize;
        first..first + usize::from(self.count[0]) + usize::from(self.count[1])
    }

    /// Entry, side and relative order of all orders.
    pub fn orders(self) -> impl Iterator<Item = (usize, Side, i32)> {
        Side::BOTH.into_iter().flat_map(move |side| {
            self.entries(side).enumerate().map(move |(k, entry)| {
                (entry, side, i32::from(self.lowest[side.index()]) + k as i32)
            })
        })
    }

    /// Entry of relative order `order` on `side`, if it is stored.
    pub fn entry(&self, side: Side, order: i32) -> Option<usize> {
        let entries = self.entries(side);
        let k = i64::from(order) - i64::from(self.lowest[side.index()]);
        (0..entries.len() as i64).contains(&k).then(|| entries.start + k as usize)
    }
}

/// All nodes of one side and ky.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KyRow {
    pub ky: f64,
    /// 1 / distance to the next ky; 0 where interpolation ends.
    pub per_gap: f64,
    /// Index of its lowest kx, and one more than that of its highest.
    pub kx: [i32; 2],
    /// Index of the node with kx index 0 in the list of nodes, extrapolated where it does not
    /// exist.
    pub origin: u32,
}

/// Array entries of all nodes.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    pub nodes: Vec<NodeOrders>,
    /// Rows of the inner side, then of the outer side, by ky.
    pub rows: [Vec<KyRow>; 2],
    /// Number of ky nodes below the critical ky.
    pub below: usize,
    /// The critical ky.
    critical: f64,
    /// The ky nodes.
    ky: Vec<f64>,
    pub entries: usize,
    /// Width of a Brillouin zone.
    pub zone: f64,
    /// Nodes per unit of kx.
    pub nodes_per_kx: f64,
    /// [`Grid::kx_offset`].
    pub kx_offset: f64,
}

impl Layout {
    /// Layout of a grid that has been validated.
    pub fn new(grid: &Grid) -> Self {
        let per_zone = grid.kx_per_zone as i64;
        let mut nodes = Vec::new();
        let mut entries = 0;
        let indices: [Vec<Range<i64>>; 2] =
            Side::BOTH.map(|side| (0..grid.ky.len()).map(|j| grid.kx_indices(side, j)).collect());
        let below = grid.ky.partition_point(|ky| *ky < grid.critical_ky());
        let rows = Side::BOTH.map(|side| {
            (0..grid.ky.len())
                .map(|j| {
                    let own = indices[side.index()][j].clone();
                    let origin = (nodes.len() as i64 - own.start) as u32;
                    for i in own.clone() {
                        // Order l propagates if the node index i + l · per_zone is one of its side.
                        let range = [0, 1].map(|to: usize| {
                            let there = &indices[to][j];
                            (
                                -((i - there.start).div_euclid(per_zone)),
                                (there.end - 1 - i).div_euclid(per_zone),
                            )
                        });
                        let count = range.map(|(low, high)| (high - low + 1).max(0));
                        nodes.push(NodeOrders {
                            first: entries as u32,
                            lowest: range.map(|(low, _)| low as i16),
                            count: count.map(|c| c as u16),
                        });
                        entries += (count[0] + count[1]) as usize;
                    }
                    let next = if j + 1 == below { None } else { grid.ky.get(j + 1) };
                    KyRow {
                        ky: grid.ky[j],
                        per_gap: next.map_or(0.0, |next| 1.0 / (next - grid.ky[j])),
                        kx: [own.start as i32, own.end as i32],
                        origin,
                    }
                })
                .collect()
        });
        Self {
            nodes,
            rows,
            below,
            critical: grid.critical_ky(),
            ky: grid.ky.clone(),
            entries,
            zone: grid.zone(),
            nodes_per_kx: grid.kx_per_zone as f64 / grid.zone(),
            kx_offset: grid.kx_offset(),
        }
    }

    /// The rows around a |ky|; the same one twice where interpolation ends.
    #[inline]
    pub fn rows_around(&self, ky: f64) -> (usize, usize) {
        let above = self.ky.partition_point(|node| *node <= ky);
        // Only rows on the query's side of the critical ky.
        let (start, end) = if (ky < self.critical && self.below > 0) || self.below == self.ky.len()
        {
            (0, self.below)
        } else {
            (self.below, self.ky.len())
        };
        (above.max(start + 1) - 1, above.min(end - 1))
    }

    /// True where no row of `side` lies above |ky|, up to grazing incidence.
    pub fn is_beyond_rows(&self, side: Side, ky: f64) -> bool {
        let above = self.ky.partition_point(|node| *node <= ky);
        above > 0 && self.rows[side.index()][above..].iter().all(|row| row.kx[0] >= row.kx[1])
    }

    /// Index of a node in the list.
    pub fn find(&self, node: NodeId) -> Option<usize> {
        let row = self.rows[node.side.index()].get(node.ky_index)?;
        let [start, end] = row.kx.map(i64::from);
        (start..end)
            .contains(&node.kx_index)
            .then(|| (i64::from(row.origin) + node.kx_index) as usize)
    }
}
