// SPDX-License-Identifier: MIT OR Apache-2.0
//! Queries of a table: nodes around an incidence, interpolated efficiencies, one sampled order.
//!
//! In: an incident direction. Out: outgoing directions with efficiencies. Both [`Bsdf::lobes`] and
//! [`Bsdf::sample`] follow one definition, with nodes c of weights `w` around the query and S the
//! efficiency of relative order l on side a at node c:
//!
//! ```text
//! raw(a, l)        = sum over c of w(c) S(c, a, l)
//! propagating(a)   = sum of raw(a, l) over the l that propagate at the query
//! evanescent(a)    = sum of raw(a, l) over the others
//! efficiency(a, l) = raw(a, l) total(a) / propagating(a)
//! total(a)         = propagating(a) + evanescent(a)
//!                    + evanescent(b) if propagating(b) = 0,   b the other side
//! ```
//!
//! At the rim, where nodes around the query are missing, all of this is multiplied by the part
//! `scattered`, and the mirror reflection gets the rest.

use super::alias_table::FULL;
use super::layout::NodeOrders;
use super::{OrderEfficiency, OrderTable};
use crate::bsdf::{
    Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation, PolarisedBsdf, Transport,
};
use crate::direction::{Side, Wavevector};
use glam::DVec3;
use rand::RngExt;

/// Interpolation stencil: the nodes around a query and their weights, which sum to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stencil {
    node: [u32; 4],
    weight: [f64; 4],
    count: usize,
    /// Part of the power that the nodes scatter; the mirror reflection has the rest. 1 where all
    /// four nodes exist, 0 at grazing incidence.
    pub(super) scattered: f64,
}

impl Stencil {
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..self.count).map(|c| (self.node[c] as usize, self.weight[c]))
    }

    /// Efficiency of an order whose nodes have `of_nodes`.
    pub(super) fn with_mirror(&self, of_nodes: f64, is_mirror: bool) -> f64 {
        self.scattered * of_nodes + if is_mirror { 1.0 - self.scattered } else { 0.0 }
    }

    /// Samples one of the nodes by its weight, with `u` uniform on 0..1; `None` for the mirror
    /// reflection instead.
    pub(super) fn sample(&self, u: f64) -> Option<usize> {
        (u < self.scattered).then(|| self.sample_node(u / self.scattered))
    }

    /// Samples one of the nodes by its weight, with `u` uniform on 0..1.
    pub(super) fn sample_node(&self, mut u: f64) -> usize {
        for c in 0..self.count - 1 {
            if u < self.weight[c] {
                return self.node[c] as usize;
            }
            u -= self.weight[c];
        }
        self.node[self.count - 1] as usize
    }
}

/// Transmittance of unpolarised light through a flat surface, from its kz² on a side of index `n` to
/// one of index `other`, up to a factor and with the sign of n² - n'² left out: near grazing
/// incidence what a surface does not reflect goes to 0 like this, whatever its relief.
fn opening(kz_squared: f64, n: f64, other: f64) -> f64 {
    let (own, there) = (n * n, other * other);
    let kz = kz_squared.max(0.0).sqrt();
    let behind = (kz * kz + (own - there).abs()).sqrt();
    if behind <= 0.0 {
        return 0.5;
    }
    let (s, p) = (kz + behind, there * kz + own * behind);
    kz * behind * (1.0 / (s * s) + own * there / (p * p))
}

/// Unpolarised power of one side at a query: in propagating and in evanescent orders.
#[derive(Clone, Copy, Debug, Default)]
struct Balance {
    propagating: f64,
    evanescent: f64,
}

/// Factors on the raw efficiencies of the inner and outer side that redistribute the power of
/// evanescent orders; `None` if no propagating order has power, so that all goes to the mirror
/// reflection.
fn gains(balance: [Balance; 2]) -> Option<[f64; 2]> {
    let [a, b] = balance;
    let gain = |own: Balance, other: Balance| {
        let from_other = if other.propagating > 0.0 { 0.0 } else { other.evanescent };
        if own.propagating > 0.0 {
            (own.propagating + own.evanescent + from_other) / own.propagating
        } else {
            0.0
        }
    };
    (a.propagating > 0.0 || b.propagating > 0.0).then(|| [gain(a, b), gain(b, a)])
}

impl OrderTable {
    /// Nodes around (kx, |ky|) of light from `side`.
    pub(super) fn stencil(&self, side: Side, kx: f64, ky: f64) -> Stencil {
        let (grid, layout) = (&self.grid, &self.layout);
        let rows = &layout.rows[side.index()];
        let (low, high) = layout.rows_around(ky);
        let ky_weight =
            if low == high { 0.0 } else { (ky - grid.ky[low]) / (grid.ky[high] - grid.ky[low]) };

        let position = kx * layout.nodes_per_kx - layout.kx_offset;
        let left = position.floor();
        let kx_weight = position - left;
        let left = left as i64;

        let mut stencil = Stencil { node: [0; 4], weight: [0.0; 4], count: 0, scattered: 1.0 };
        let is_inside =
            |row: usize| (rows[row].kx[0].into()..i64::from(rows[row].kx[1]) - 1).contains(&left);
        let at_rim = !is_inside(low) || !is_inside(high) || layout.is_beyond_rows(side, ky);
        let (mut total, mut opened) = (0.0, 0.0);
        for (row, row_weight) in [(low, 1.0 - ky_weight), (high, ky_weight)] {
            let row = rows[row];
            for (i, weight) in
                [(left, row_weight * (1.0 - kx_weight)), (left + 1, row_weight * kx_weight)]
            {
                let [start, end] = row.kx.map(i64::from);
                if weight > 0.0 && i >= start && i < end {
                    stencil.node[stencil.count] = (i64::from(row.origin) + i) as u32;
                    stencil.weight[stencil.count] = weight;
                    stencil.count += 1;
                    total += weight;
                    if at_rim {
                        opened += weight * self.opening(side, grid.kx(i), row.ky);
                    }
                }
            }
        }
        if stencil.count == 0 {
            stencil = self.nearest(side, low, position);
            let node = self.wavevector(side, stencil.node[0] as usize);
            (total, opened) = (1.0, self.opening(side, node.kx, node.ky));
        }
        for weight in &mut stencil.weight {
            *weight /= total;
        }
        if at_rim {
            // In between, where the nodes span less than their own, this is 1.
            stencil.scattered = (self.opening(side, kx, ky) * total / opened).min(1.0);
        }
        stencil
    }

    /// [`opening`] of light from `side`.
    fn opening(&self, side: Side, kx: f64, ky: f64) -> f64 {
        let (n, other) = (self.grid.index(side), self.grid.index(side.opposite()));
        opening(n * n - kx * kx - ky * ky, n, other)
    }

    /// The node nearest to `position` (in node indices) in row `row`, or in the next lower row that
    /// has nodes.
    fn nearest(&self, side: Side, row: usize, position: f64) -> Stencil {
        let rows = &self.layout.rows[side.index()];
        // Row 0 has nodes on both sides in every valid grid.
        let row = rows[..=row].iter().rev().find(|row| row.kx[1] > row.kx[0]).unwrap_or(&rows[0]);
        let [start, end] = row.kx.map(f64::from);
        let i = position.round().clamp(start, end - 1.0) as i64;
        let node = (i64::from(row.origin) + i) as u32;
        Stencil { node: [node; 4], weight: [1.0, 0.0, 0.0, 0.0], count: 1, scattered: 1.0 }
    }

    /// Wavevector of relative order `order`: the grating equation.
    pub(super) fn diffracted(&self, k: Wavevector, order: i32) -> Wavevector {
        Wavevector { kx: k.kx + f64::from(order) * self.layout.zone, ky: k.ky }
    }

    /// Lowest and highest relative order that propagates on `side` at the query; empty if low >
    /// high.
    pub(super) fn propagating_orders(&self, side: Side, k: Wavevector) -> (i32, i32) {
        let (n, zone) = (self.grid.index(side), self.layout.zone);
        let rim2 = n * n - k.ky * k.ky;
        if rim2 <= 0.0 {
            return (0, -1);
        }
        let rim = rim2.sqrt();
        let mut low = ((-rim - k.kx) / zone).floor() as i32;
        let mut high = ((rim - k.kx) / zone).ceil() as i32;
        // The estimate is at most two too wide; the definition decides, as it does for a single
        // order.
        while low <= high && !self.diffracted(k, low).propagates(n) {
            low += 1;
        }
        while low <= high && !self.diffracted(k, high).propagates(n) {
            high -= 1;
        }
        (low, high)
    }

    /// Running sum before the orders `low..=high` on `side` at a node, and their efficiency, both
    /// in units of 1/[`FULL`].
    fn range_sum(&self, node: NodeOrders, side: Side, (low, high): (i32, i32)) -> (u32, u32) {
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
    pub(super) fn running_sum(&self, node: NodeOrders, entry: usize) -> u32 {
        if entry == node.first as usize { 0 } else { self.cumulative[entry - 1] }
    }

    /// Unpolarised power on each side.
    fn balance(&self, stencil: &Stencil, range: [(i32, i32); 2]) -> [Balance; 2] {
        let mut balance = [Balance::default(); 2];
        for (node, weight) in stencil.iter() {
            let node = self.layout.nodes[node];
            for side in Side::BOTH {
                let (_, propagating) = self.range_sum(node, side, range[side.index()]);
                let (_, all) =
                    self.range_sum(node, side, (i32::from(i16::MIN), i32::from(i16::MAX)));
                let side = &mut balance[side.index()];
                side.propagating += weight * f64::from(propagating) / f64::from(FULL);
                side.evanescent += weight * f64::from(all - propagating) / f64::from(FULL);
            }
        }
        balance
    }

    /// Interpolated efficiencies of the orders that propagate at an incidence, inner side first,
    /// orders ascending. `k` is the tangential wavevector of the incident light, with `kx² + ky² <
    /// n²` on the side it comes from.
    pub fn efficiencies(
        &self,
        side: Side,
        k: Wavevector,
        polarisation: Polarisation,
    ) -> Vec<OrderEfficiency> {
        let stencil = self.stencil(side, k.kx, k.ky.abs());
        let range = Side::BOTH.map(|to| self.propagating_orders(to, k));
        let mut raw = range.map(|(low, high)| vec![0.0; (high - low + 1).max(0) as usize]);
        let mut balance = [Balance::default(); 2];
        for (node, weight) in stencil.iter() {
            let node = self.layout.nodes[node];
            for (entry, to, order) in node.orders() {
                let power = weight
                    * match polarisation {
                        Polarisation::Unpolarised => {
                            let before = self.running_sum(node, entry);
                            f64::from(self.cumulative[entry] - before) / f64::from(FULL)
                        }
                        _ => self.stored(entry, polarisation),
                    };
                let (low, high) = range[to.index()];
                let balance = &mut balance[to.index()];
                if (low..=high).contains(&order) {
                    raw[to.index()][(order - low) as usize] += power;
                    balance.propagating += power;
                } else {
                    balance.evanescent += power;
                }
            }
        }
        let gain = gains(balance);
        let mut efficiencies = Vec::with_capacity(raw[0].len() + raw[1].len());
        for to in Side::BOTH {
            let first = range[to.index()].0;
            for (order, raw) in (first..).zip(&raw[to.index()]) {
                let efficiency = match gain {
                    Some(gain) => raw * gain[to.index()],
                    None if to == side && order == 0 => {
                        balance[0].evanescent + balance[1].evanescent
                    }
                    None => 0.0,
                };
                let efficiency = stencil.with_mirror(efficiency, to == side && order == 0);
                efficiencies.push(OrderEfficiency::new(to, order, efficiency));
            }
        }
        efficiencies
    }

    /// The sample of an order; `None` if the order is evanescent at the query.
    pub(super) fn order_sample(
        &self,
        from: Side,
        to: Side,
        order: i32,
        k: Wavevector,
    ) -> Option<BsdfSample> {
        let wo = self.diffracted(k, order).leaving(to, self.grid.index(to))?;
        let lobe = Lobe { transport: Transport::between(from, to), kind: LobeKind::Order(order) };
        Some(BsdfSample { wo, weight: 1.0, lobe })
    }

    /// Samples again among the propagating orders, for light from `from` whose sampled order on
    /// side `to` is evanescent.
    #[cold]
    pub fn resample_propagating(
        &self,
        from: Side,
        to: Side,
        k: Wavevector,
        rng: &mut dyn rand::Rng,
    ) -> Option<BsdfSample> {
        let stencil = self.stencil(from, k.kx, k.ky.abs());
        for to in [to, to.opposite()] {
            let range = self.propagating_orders(to, k);
            let mut sums = [(0_u32, 0_u32); 4];
            let mut total = 0.0;
            for (sum, (node, weight)) in sums.iter_mut().zip(stencil.iter()) {
                *sum = self.range_sum(self.layout.nodes[node], to, range);
                total += weight * f64::from(sum.1);
            }
            if total > 0.0 {
                // A node by its part of the total, then an order of that node within its range.
                let mut u = total * rng.random::<f64>();
                let within = rng.random::<f64>();
                let mut chosen = None;
                for ((before, sum), (node, weight)) in sums.into_iter().zip(stencil.iter()) {
                    if sum > 0 {
                        chosen = Some((before, sum, self.layout.nodes[node]));
                        u -= weight * f64::from(sum);
                        if u < 0.0 {
                            break;
                        }
                    }
                }
                let (before, sum, node) = chosen?;
                let (to, order) = self.order_at(node, before + (within * f64::from(sum)) as u32);
                return self.order_sample(from, to, order, k);
            }
        }
        self.order_sample(from, from, 0, k)
    }

    /// Side and relative order whose range of the running sums holds `level`, in units of
    /// 1/[`FULL`], at a node; `level` lies below its total.
    #[inline]
    pub(super) fn order_at(&self, node: NodeOrders, level: u32) -> (Side, i32) {
        let all = node.all();
        let k = self.cumulative[all].partition_point(|sum| *sum <= level);
        let inner = usize::from(node.count[0]);
        if k < inner {
            (Side::Inner, i32::from(node.lowest[0]) + k as i32)
        } else {
            (Side::Outer, i32::from(node.lowest[1]) + (k - inner) as i32)
        }
    }

    /// Probability of sampling relative order `order` on side `to` at this query.
    fn probability(
        &self,
        stencil: &Stencil,
        from: Side,
        k: Wavevector,
        to: Side,
        order: i32,
    ) -> f64 {
        let range = Side::BOTH.map(|side| self.propagating_orders(side, k));
        let balance = self.balance(stencil, range);
        let is_mirror = to == from && order == 0;
        let Some(gain) = gains(balance) else {
            let all = balance[0].evanescent + balance[1].evanescent;
            return stencil.with_mirror(if is_mirror { all } else { 0.0 }, is_mirror);
        };
        let raw: f64 = stencil
            .iter()
            .map(|(node, weight)| {
                weight * f64::from(self.range_sum(self.layout.nodes[node], to, (order, order)).1)
            })
            .sum();
        stencil.with_mirror(raw / f64::from(FULL) * gain[to.index()], is_mirror)
    }
}

impl Bsdf for OrderTable {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let from = Side::from_direction(wi);
        let k = Wavevector::incoming(wi, self.grid.index(from));
        let location = self.locate_bin(from, k, [rng.random(), rng.random()]);
        let (to, order) = self.order(from, &location, self.bin(&location))?;
        self.order_sample(from, to, order, k)
            .or_else(|| self.resample_propagating(from, to, k, rng))
    }

    fn as_polarised(&self) -> Option<&dyn PolarisedBsdf> {
        self.has_jones().then_some(self)
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        let LobeKind::Order(order) = sample.lobe.kind else {
            return Some(0.0);
        };
        let from = Side::from_direction(wi);
        let k = Wavevector::incoming(wi, self.grid.index(from));
        let stencil = self.stencil(from, k.kx, k.ky.abs());
        Some(self.probability(&stencil, from, k, Side::from_direction(sample.wo), order))
    }

    fn lobes(&self, wi: DVec3, polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let from = Side::from_direction(wi);
        let k = Wavevector::incoming(wi, self.grid.index(from));
        self.efficiencies(from, k, polarisation)
            .into_iter()
            .filter_map(|OrderEfficiency { to, order, efficiency }| {
                let wo = self.diffracted(k, order).leaving(to, self.grid.index(to))?;
                let lobe =
                    Lobe { transport: Transport::between(from, to), kind: LobeKind::Order(order) };
                Some(OutgoingLobe { wo, power: efficiency, lobe })
            })
            .collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.grid.index(side)
    }
}
