// SPDX-License-Identifier: MIT OR Apache-2.0
//! Asking a table: nodes around an incidence, interpolated shares, one order at random.
//!
//! In: an incident direction. Out: outgoing directions with shares. Both ways out of the table obey one definition, with
//! nodes c of weights `w` around the query and S the share of relative order l on side a at node c:
//!
//! ```text
//! raw(a, l)   = sum over c of w(c) S(c, a, l)
//! kept(a)     = sum of raw(a, l) over the l that propagate at the query
//! stray(a)    = sum of raw(a, l) over the l that do not
//! share(a, l) = raw(a, l) (kept(a) + stray(a) + stray(b) if kept(b) = 0) / kept(a),   b the other side
//! ```

use super::OrderTable;
use super::build::FULL;
use super::grid::Node;
use crate::direction::{Side, Tangential};
use crate::scatter::{
    Lobe, LobeKind, OutgoingLobe, Polarization, Polarizing, Sample, Scatter, Transport,
};
use glam::DVec3;
use rand::RngExt;

/// The nodes around a query and their weights, which sum to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners {
    node: [u32; 4],
    weight: [f64; 4],
    count: usize,
}

impl Corners {
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..self.count).map(|c| (self.node[c] as usize, self.weight[c]))
    }

    /// One of the nodes, drawn by its weight with `u` uniform on 0..1.
    pub(super) fn pick(&self, mut u: f64) -> usize {
        for c in 0..self.count - 1 {
            if u < self.weight[c] {
                return self.node[c] as usize;
            }
            u -= self.weight[c];
        }
        self.node[self.count - 1] as usize
    }
}

/// Powers of one side at a query.
#[derive(Clone, Copy, Debug, Default)]
struct Balance {
    kept: f64,
    stray: f64,
}

/// Factors on the raw shares of the inner and outer side that make up for orders that do not propagate;
/// `None` if no order that propagates has a share, so that all power goes to the mirror reflection.
fn gains(balance: [Balance; 2]) -> Option<[f64; 2]> {
    let [a, b] = balance;
    let gain = |own: Balance, other: Balance| {
        let from_other = if other.kept > 0.0 { 0.0 } else { other.stray };
        if own.kept > 0.0 {
            (own.kept + own.stray + from_other) / own.kept
        } else {
            0.0
        }
    };
    (a.kept > 0.0 || b.kept > 0.0).then(|| [gain(a, b), gain(b, a)])
}

impl OrderTable {
    /// Nodes around (kx, |ky|) of light from `side`.
    pub(super) fn corners(&self, side: Side, kx: f64, ky: f64) -> Corners {
        let (grid, layout) = (&self.grid, &self.layout);
        let rows = &layout.rows[side.index()];
        let (low, high) = layout.rows_around(ky);
        let ky_weight = if low == high {
            0.0
        } else {
            (ky - grid.ky[low]) / (grid.ky[high] - grid.ky[low])
        };

        let position = kx * layout.nodes_per_kx - layout.kx_offset;
        let left = position.floor();
        let kx_weight = position - left;
        let left = left as i64;

        let mut corners = Corners {
            node: [0; 4],
            weight: [0.0; 4],
            count: 0,
        };
        let mut total = 0.0;
        for (row, row_weight) in [(low, 1.0 - ky_weight), (high, ky_weight)] {
            let row = rows[row];
            for (i, weight) in [
                (left, row_weight * (1.0 - kx_weight)),
                (left + 1, row_weight * kx_weight),
            ] {
                let [start, end] = row.kx.map(i64::from);
                if weight > 0.0 && i >= start && i < end {
                    corners.node[corners.count] = (i64::from(row.origin) + i) as u32;
                    corners.weight[corners.count] = weight;
                    corners.count += 1;
                    total += weight;
                }
            }
        }
        if corners.count == 0 {
            return self.nearest(side, low, position);
        }
        for weight in &mut corners.weight {
            *weight /= total;
        }
        corners
    }

    /// The node nearest to `position` (in node indices) in row `row`, or in the next lower row that has nodes.
    fn nearest(&self, side: Side, row: usize, position: f64) -> Corners {
        let rows = &self.layout.rows[side.index()];
        // Row 0 has nodes on both sides in every valid grid.
        let row = rows[..=row]
            .iter()
            .rev()
            .find(|row| row.kx[1] > row.kx[0])
            .unwrap_or(&rows[0]);
        let [start, end] = row.kx.map(f64::from);
        let i = position.round().clamp(start, end - 1.0) as i64;
        let node = (i64::from(row.origin) + i) as u32;
        Corners {
            node: [node; 4],
            weight: [1.0, 0.0, 0.0, 0.0],
            count: 1,
        }
    }

    /// Wavevector of relative order `order`: the grating equation.
    pub(super) fn diffracted(&self, k: Tangential, order: i32) -> Tangential {
        Tangential {
            kx: k.kx + f64::from(order) * self.layout.zone,
            ky: k.ky,
        }
    }

    /// Lowest and highest relative order that propagates on `side` at the query; empty if low > high.
    pub(super) fn propagating(&self, side: Side, k: Tangential) -> (i32, i32) {
        let (n, zone) = (self.grid.index(side), self.layout.zone);
        let rim2 = n * n - k.ky * k.ky;
        if rim2 <= 0.0 {
            return (0, -1);
        }
        let rim = rim2.sqrt();
        let mut low = ((-rim - k.kx) / zone).floor() as i32;
        let mut high = ((rim - k.kx) / zone).ceil() as i32;
        // The estimate is at most two too wide; the definition decides, as it does for a single order.
        while low <= high && !self.diffracted(k, low).propagates(n) {
            low += 1;
        }
        while low <= high && !self.diffracted(k, high).propagates(n) {
            high -= 1;
        }
        (low, high)
    }

    /// Share of the orders `low..=high` on `side` at a node, in units of 1/[`FULL`], and the running sum before them.
    fn span(&self, node: Node, side: Side, (low, high): (i32, i32)) -> (u32, u32) {
        let entries = node.entries(side);
        let lowest = i32::from(node.lowest[side.index()]);
        let from = (low - lowest).clamp(0, entries.len() as i32) as usize + entries.start;
        let to =
            ((high + 1 - lowest).clamp(0, entries.len() as i32) as usize + entries.start).max(from);
        let before = self.running_sum(node, from);
        (before, self.running_sum(node, to) - before)
    }

    /// Running sum of a node before `entry`.
    #[inline]
    pub(super) fn running_sum(&self, node: Node, entry: usize) -> u32 {
        if entry == node.first as usize {
            0
        } else {
            self.cumulative[entry - 1]
        }
    }

    /// Power kept and stray on each side for unpolarised light.
    fn balance(&self, corners: &Corners, range: [(i32, i32); 2]) -> [Balance; 2] {
        let mut balance = [Balance::default(); 2];
        for (node, weight) in corners.iter() {
            let node = self.layout.nodes[node];
            for side in Side::BOTH {
                let (_, kept) = self.span(node, side, range[side.index()]);
                let (_, all) = self.span(node, side, (i32::from(i16::MIN), i32::from(i16::MAX)));
                let side = &mut balance[side.index()];
                side.kept += weight * f64::from(kept) / f64::from(FULL);
                side.stray += weight * f64::from(all - kept) / f64::from(FULL);
            }
        }
        balance
    }

    /// Interpolated shares at an incidence: side that the order leaves on, relative order, share of the incident power.
    /// Only orders that propagate there, in ascending order, inner side first. `k` is the tangential wavevector of the incident light,
    /// with `kx² + ky² < n²` on the side it comes from.
    #[must_use]
    pub fn shares(
        &self,
        side: Side,
        k: Tangential,
        polarization: Polarization,
    ) -> Vec<(Side, i32, f64)> {
        let corners = self.corners(side, k.kx, k.ky.abs());
        let range = Side::BOTH.map(|to| self.propagating(to, k));
        let mut raw = range.map(|(low, high)| vec![0.0; (high - low + 1).max(0) as usize]);
        let mut balance = [Balance::default(); 2];
        for (node, weight) in corners.iter() {
            let node = self.layout.nodes[node];
            for (entry, to, order) in node.orders() {
                let share = weight
                    * match polarization {
                        Polarization::Unpolarized => {
                            let before = self.running_sum(node, entry);
                            f64::from(self.cumulative[entry] - before) / f64::from(FULL)
                        }
                        _ => self.stored(entry, polarization),
                    };
                let (low, high) = range[to.index()];
                let balance = &mut balance[to.index()];
                if (low..=high).contains(&order) {
                    raw[to.index()][(order - low) as usize] += share;
                    balance.kept += share;
                } else {
                    balance.stray += share;
                }
            }
        }
        let gain = gains(balance);
        let mut shares = Vec::with_capacity(raw[0].len() + raw[1].len());
        for to in Side::BOTH {
            let first = range[to.index()].0;
            for (order, raw) in (first..).zip(&raw[to.index()]) {
                let share = match gain {
                    Some(gain) => raw * gain[to.index()],
                    None if to == side && order == 0 => balance[0].stray + balance[1].stray,
                    None => 0.0,
                };
                shares.push((to, order, share));
            }
        }
        shares
    }

    /// The drawn order as a sample; `None` if it does not propagate at the query.
    pub(super) fn leave(&self, from: Side, to: Side, order: i32, k: Tangential) -> Option<Sample> {
        let wo = self.diffracted(k, order).leaving(to, self.grid.index(to))?;
        let lobe = Lobe {
            transport: Transport::between(from, to),
            kind: LobeKind::Order(order),
        };
        Some(Sample {
            wo,
            weight: 1.0,
            lobe,
        })
    }

    /// Draws again among the orders that propagate, for power that fell on side `to` into one that does not.
    #[cold]
    pub(super) fn redirect(
        &self,
        corners: &Corners,
        from: Side,
        to: Side,
        k: Tangential,
        rng: &mut dyn rand::Rng,
    ) -> Option<Sample> {
        for to in [to, to.opposite()] {
            let range = self.propagating(to, k);
            let mut spans = [(0_u32, 0_u32); 4];
            let mut kept = 0.0;
            for (span, (node, weight)) in spans.iter_mut().zip(corners.iter()) {
                *span = self.span(self.layout.nodes[node], to, range);
                kept += weight * f64::from(span.1);
            }
            if kept > 0.0 {
                // A node by its part of what is kept, then an order of that node within its span.
                let mut u = kept * rng.random::<f64>();
                let within = rng.random::<f64>();
                let mut chosen = None;
                for ((before, span), (node, weight)) in spans.into_iter().zip(corners.iter()) {
                    if span > 0 {
                        chosen = Some((before, span, self.layout.nodes[node]));
                        u -= weight * f64::from(span);
                        if u < 0.0 {
                            break;
                        }
                    }
                }
                let (before, span, node) = chosen?;
                let (to, order) = self.at(node, before + (within * f64::from(span)) as u32);
                return self.leave(from, to, order, k);
            }
        }
        self.leave(from, from, 0, k)
    }

    /// Side and relative order that own `level`, in units of 1/[`FULL`], at a node; `level` lies below its total.
    #[inline]
    pub(super) fn at(&self, node: Node, level: u32) -> (Side, i32) {
        let all = node.all();
        let k = self.cumulative[all].partition_point(|sum| *sum <= level);
        let inner = usize::from(node.count[0]);
        if k < inner {
            (Side::Inner, i32::from(node.lowest[0]) + k as i32)
        } else {
            (Side::Outer, i32::from(node.lowest[1]) + (k - inner) as i32)
        }
    }

    /// Probability that a draw at this query gives relative order `order` on side `to`.
    fn probability(
        &self,
        corners: &Corners,
        from: Side,
        k: Tangential,
        to: Side,
        order: i32,
    ) -> f64 {
        let range = Side::BOTH.map(|side| self.propagating(side, k));
        let balance = self.balance(corners, range);
        let Some(gain) = gains(balance) else {
            return if to == from && order == 0 {
                balance[0].stray + balance[1].stray
            } else {
                0.0
            };
        };
        let raw: f64 = corners
            .iter()
            .map(|(node, weight)| {
                weight * f64::from(self.span(self.layout.nodes[node], to, (order, order)).1)
            })
            .sum();
        raw / f64::from(FULL) * gain[to.index()]
    }
}

impl Scatter for OrderTable {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<Sample> {
        let from = Side::of(wi);
        let k = Tangential::incoming(wi, self.grid.index(from));
        let spot = self.locate(from, k, [rng.random(), rng.random()]);
        let (to, order) = self.order(from, &spot, self.urn(&spot))?;
        self.leave(from, to, order, k)
            .or_else(|| self.redraw((from, to), k, rng))
    }

    fn orders(&self) -> Option<&OrderTable> {
        Some(self)
    }

    fn polarizing(&self) -> Option<&dyn Polarizing> {
        self.has_jones().then_some(self)
    }

    fn pdf(&self, wi: DVec3, sample: &Sample) -> Option<f64> {
        let LobeKind::Order(order) = sample.lobe.kind else {
            return Some(0.0);
        };
        let from = Side::of(wi);
        let k = Tangential::incoming(wi, self.grid.index(from));
        let corners = self.corners(from, k.kx, k.ky.abs());
        Some(self.probability(&corners, from, k, Side::of(sample.wo), order))
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let from = Side::of(wi);
        let k = Tangential::incoming(wi, self.grid.index(from));
        self.shares(from, k, polarization)
            .into_iter()
            .filter_map(|(to, order, share)| {
                let wo = self.diffracted(k, order).leaving(to, self.grid.index(to))?;
                let lobe = Lobe {
                    transport: Transport::between(from, to),
                    kind: LobeKind::Order(order),
                };
                Some(OutgoingLobe { wo, share, lobe })
            })
            .collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.grid.index(side)
    }
}
