// SPDX-License-Identifier: MIT OR Apache-2.0
//! Grid of incident wavevectors: which nodes a table holds.
//!
//! In: period, wavelength, the two refractive indices, kx nodes per Brillouin zone, ky nodes. Out:
//! the nodes that propagate, and their kx and ky.

use super::{EfficiencyRow, OrderEfficiency};
use crate::bsdf::Polarisation;
use crate::direction::Side;
use crate::error::Error;
use std::ops::Range;

/// Most nodes of a table, and most orders of all nodes together.
const MAX_NODES: f64 = 4e6;
const MAX_ENTRIES: f64 = 1e8;
/// Highest refractive index.
const HIGHEST_INDEX: f64 = 100.0;
/// Highest relative order; the layout stores 16 bits.
const HIGHEST_ORDER: f64 = 16_000.0;

/// Incident tangential wavevectors of a table, in units of the vacuum wavenumber.
///
/// Along t they are `kx_i = (i + offset) (λ/Λ) / kx_per_zone` for every integer i. The offset is 0
/// for an even and 1/2 for an odd number of nodes per zone, so that half a zone is a node. Along b
/// they are those of `ky`, each for both signs. On a side of index n a node exists if and only if
/// `kx² + ky² < n²`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Period of the relief, in any unit.
    pub period: f64,
    /// Vacuum wavelength, in the same unit.
    pub wavelength: f64,
    /// Refractive index of the inner side (z < 0).
    pub index_inner: f64,
    /// Refractive index of the outer side (z > 0).
    pub index_outer: f64,
    /// Nodes along kx in one Brillouin zone, that is per λ/Λ; at least 1.
    pub kx_per_zone: usize,
    /// Nodes along ky: ascending, not negative, none equal to the lower of the two indices.
    pub ky: Vec<f64>,
}

/// One incident wavevector of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId {
    /// Side the light comes from.
    pub side: Side,
    /// Index of kx, any sign.
    pub kx_index: i64,
    /// Index into the grid's `ky`.
    pub ky_index: usize,
}

impl std::fmt::Display for NodeId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { side, kx_index, ky_index } = self;
        write!(f, "side {side}, kx index {kx_index}, ky index {ky_index}")
    }
}

impl Grid {
    /// Refractive index of a side.
    pub fn index(&self, side: Side) -> f64 {
        match side {
            Side::Inner => self.index_inner,
            Side::Outer => self.index_outer,
        }
    }

    /// Width of a Brillouin zone, λ/Λ: the step of kx from one order to the next.
    pub fn zone(&self) -> f64 {
        self.wavelength / self.period
    }

    /// Offset of the kx nodes from 0 in units of their spacing: 0 for an even number per zone, 1/2
    /// for an odd one.
    pub(crate) fn kx_offset(&self) -> f64 {
        if self.kx_per_zone.is_multiple_of(2) { 0.0 } else { 0.5 }
    }

    /// Index of the node at -kx.
    pub fn mirror(&self, kx_index: i64) -> i64 {
        if self.kx_per_zone.is_multiple_of(2) { -kx_index } else { -1 - kx_index }
    }

    /// kx of the node index `kx_index`. Indices 0 to `kx_per_zone - 1` make up one zone, and order
    /// m of the Bloch wavevector `kx(i)` is the node `i + m · kx_per_zone`.
    pub fn kx(&self, kx_index: i64) -> f64 {
        (kx_index as f64 + self.kx_offset()) * self.zone() / self.kx_per_zone as f64
    }

    /// The |ky| at which the side of lower index closes; interpolation is cut there.
    pub fn critical_ky(&self) -> f64 {
        self.index_inner.min(self.index_outer)
    }

    /// Indices of kx of the nodes in the row `ky_index` of `side`, possibly none.
    pub fn kx_indices(&self, side: Side, ky_index: usize) -> Range<i64> {
        let (n, ky) = (self.index(side), self.ky[ky_index]);
        let inside = |i: i64| {
            let kx = self.kx(i);
            kx * kx + ky * ky < n * n
        };
        let rim = (n * n - ky * ky).max(0.0).sqrt();
        // The square root gives an estimate, and the definition decides.
        let spacing = self.zone() / self.kx_per_zone as f64;
        let mut end = (rim / spacing + 1.0 - self.kx_offset()).floor() as i64;
        while end > 0 && !inside(end - 1) {
            end -= 1;
        }
        while inside(end) {
            end += 1;
        }
        if end == 0 { 0..0 } else { self.mirror(end - 1)..end }
    }

    /// Number of nodes, both sides together.
    pub fn node_count(&self) -> usize {
        let rows =
            Side::BOTH.into_iter().flat_map(|side| (0..self.ky.len()).map(move |j| (side, j)));
        rows.map(|(side, j)| self.kx_indices(side, j).count()).sum()
    }

    /// All nodes: inner side first, by ky, then by kx ascending.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> + '_ {
        Side::BOTH.into_iter().flat_map(move |side| {
            (0..self.ky.len()).flat_map(move |ky_index| {
                let each = self.kx_indices(side, ky_index);
                each.map(move |kx_index| NodeId { side, kx_index, ky_index })
            })
        })
    }

    /// Rows of the whole grid from a function of (side, kx, ky, polarisation): a closed form, or a
    /// solver called for one incidence at a time.
    pub fn rows<'a, F>(&'a self, mut orders: F) -> impl Iterator<Item = EfficiencyRow> + 'a
    where
        F: FnMut(Side, f64, f64, Polarisation) -> Vec<OrderEfficiency> + 'a,
    {
        let both = [Polarisation::S, Polarisation::P];
        self.nodes().flat_map(move |node| both.map(|polarisation| (node, polarisation))).map(
            move |(node, polarisation)| {
                let (kx, ky) = (self.kx(node.kx_index), self.ky[node.ky_index]);
                EfficiencyRow {
                    node,
                    polarisation,
                    orders: orders(node.side, kx, ky, polarisation),
                }
            },
        )
    }

    /// `count` ≥ 2 ky nodes from 0 on, distributed over the ranges below and above the critical ky.
    /// They are dense at the critical ky and at the rim, where efficiencies vary as a square root.
    pub fn ky_nodes(index_inner: f64, index_outer: f64, count: usize) -> Vec<f64> {
        let (low, high) = (index_inner.min(index_outer), index_inner.max(index_outer));
        let above =
            (((high - low) / high * count as f64).round() as usize).min(count.saturating_sub(1));
        let below = count - above;
        let lower = (0..below)
            .map(|j| low * (std::f64::consts::FRAC_PI_2 * j as f64 / (below as f64 - 0.5)).sin());
        let upper = (0..above).map(|j| {
            let phase = std::f64::consts::PI * (j as f64 + 0.5) / above as f64;
            low + (high - low) * 0.5 * (1.0 - phase.cos())
        });
        lower.chain(upper).collect()
    }

    /// Checks the invariants that the rest of the crate relies on.
    ///
    /// # Errors
    /// If a length or an index is not positive and finite, the ky nodes are not ascending, or the
    /// grid is empty or too large.
    pub fn validate(&self) -> Result<(), Error> {
        Error::check_length("period of a table", self.period)?;
        Error::check_length("wavelength of a table", self.wavelength)?;
        Error::check_index("inner side of a table", self.index_inner)?;
        Error::check_index("outer side of a table", self.index_outer)?;
        let refuse = |text: String| Err(Error::Grid(text));
        let highest = self.index_inner.max(self.index_outer);
        if highest > HIGHEST_INDEX {
            return refuse(format!(
                "expected refractive indices up to {HIGHEST_INDEX}, got {highest}"
            ));
        }
        if self.kx_per_zone == 0 {
            return refuse("expected at least 1 kx node per zone, got 0".to_owned());
        }
        if self.ky.is_empty() || self.ky.len() > usize::from(u16::MAX) {
            return refuse(format!("expected 1 to {} ky nodes, got {}", u16::MAX, self.ky.len()));
        }
        if !self.ky.iter().all(|ky| ky.is_finite() && *ky >= 0.0)
            || !self.ky.is_sorted_by(|a, b| a < b)
        {
            return refuse(format!(
                "expected ky nodes not negative and ascending, got {:?}",
                self.ky
            ));
        }
        if self.ky.contains(&self.critical_ky()) {
            let critical = self.critical_ky();
            return refuse(format!(
                "expected no ky node at the critical {critical}, where one side closes"
            ));
        }
        let orders = 2.0 * highest / self.zone();
        if orders.is_nan() || orders >= HIGHEST_ORDER {
            return refuse(format!(
                "expected fewer than {HIGHEST_ORDER} propagating orders, got {orders:.0}"
            ));
        }
        // Bounds in floating point first: `kx_indices` iterates, and must not iterate far.
        let across = (orders + 2.0) * self.kx_per_zone as f64;
        let nodes = 2.0 * across * self.ky.len() as f64;
        if nodes >= MAX_NODES || nodes * 2.0 * (orders + 2.0) >= MAX_ENTRIES {
            return refuse(format!(
                "too large: about {nodes:.0} nodes of up to {:.0} orders",
                2.0 * orders
            ));
        }
        for side in Side::BOTH {
            if self.kx_indices(side, 0).is_empty() {
                let ky = self.ky[0];
                return refuse(format!(
                    "expected nodes from the {side} side, got none at the lowest ky {ky}"
                ));
            }
        }
        Ok(())
    }
}
