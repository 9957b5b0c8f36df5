// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tables of diffraction orders over the hemispheres of incidence, from both sides, for s and p.
//!
//! In: a [`Grid`] of incident tangential wavevectors and one [`EfficiencyRow`] for each node and
//! polarisation, from any solver. Out: an [`OrderTable`], which is a [`Bsdf`]. A relief that varies
//! along t alone couples (kx, ky) to (kx + l λ/Λ, ky) and to nothing else [Petit 1980]. The
//! efficiency of each *relative order* l therefore varies smoothly with the incidence, and the
//! grating equation gives the direction from the ray's own kx. Interpolating at fixed l keeps one
//! peak one peak, where interpolating in angle would make two.
//!
//! **Interpolation** is linear in kx and in |ky| between the nodes around the query, over those
//! that exist (|k|² < n² of the side of incidence), with renormalised weights. Beyond the last nodes
//! the part that is not reflected as by a mirror falls to 0 at grazing incidence, where every surface
//! is a mirror, by Fresnel's formula of a flat one: R goes to 1. At |ky| equal to the lower of the two indices the other side closes:
//! nodes below and above it are never mixed.
//!
//! **Evanescent orders.** Near a Rayleigh point an order may propagate at a node and be evanescent
//! at the query. Its power then goes to the propagating orders of the same side, in proportion to
//! their own; to those of the other side if that side has none; to the mirror reflection if none is
//! left. Power is conserved exactly. Sampling follows the same rule, so the expected frequencies of
//! `sample` are the powers that `lobes` lists.
//!
//! \[Petit 1980\] R. Petit (ed.), *Electromagnetic Theory of Gratings*, Springer, chapter 1.

mod alias_table;
mod batch;
mod build;
mod grid;
mod jones;
mod layout;
mod query;
mod sample;

pub use batch::{BinLocations, Flag, OrderTableBatch, SampledOrders};
pub use grid::{Grid, NodeId};
pub use jones::{Jones, JonesRow, Mueller, OrderJones, OrderMueller, mueller};
pub use sample::{BinLocation, SampledOrder};

use crate::bsdf::{Bsdf, Polarisation};
use crate::direction::Side;
use crate::error::Error;
use crate::json;
use alias_table::AliasTable;
use layout::Layout;
use std::any::Any;

/// Tolerance of efficiencies outside 0 to 1 and of sums above 1, for rounding of a solver or of
/// f32; a sum within it of 1 is 1.
pub const EFFICIENCY_TOLERANCE: f64 = 1e-6;

/// Origin of a table: design, solver and errors.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableHeader {
    /// Design that the relief belongs to.
    pub design: String,
    /// Ring whose relief was solved.
    pub ring: String,
    /// Band of the surface that the ring stands for.
    pub band: String,
    /// Unit of the period and wavelength of the grid, such as `um`.
    pub length_unit: String,
    /// Highest order M kept by the solver: orders -M..M.
    pub truncation: usize,
    /// Slices that the relief was cut into.
    pub slices: usize,
    /// Estimated absolute error of an efficiency.
    pub estimated_error: f64,
    /// Worst deviation of the power balance from 1.
    pub energy_residual: f64,
    /// Further entries: material, wavelengths of a spectrum, version of the solver.
    #[serde(default, deserialize_with = "more")]
    pub more: serde_json::Map<String, serde_json::Value>,
}

/// [`TableHeader::more`] from JSON without duplicate keys.
fn more<'de, D: serde::Deserializer<'de>>(
    deserializer: D,
) -> Result<serde_json::Map<String, serde_json::Value>, D::Error> {
    json::object(deserializer, "more")
}

/// Efficiency of one diffraction order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderEfficiency {
    /// Side it leaves on.
    pub to: Side,
    /// Relative order l.
    pub order: i32,
    /// Power per incident power, summed over the outgoing polarisations; 0 to 1.
    pub efficiency: f64,
}

impl OrderEfficiency {
    /// Efficiency of relative order `order` on side `to`.
    pub fn new(to: Side, order: i32, efficiency: f64) -> Self {
        Self { to, order, efficiency }
    }
}

/// Efficiencies of one incident wave, as a solver gives them.
#[derive(Clone, Debug, PartialEq)]
pub struct EfficiencyRow {
    /// The incident wavevector.
    pub node: NodeId,
    /// [`Polarisation::S`] or [`Polarisation::P`].
    pub polarisation: Polarisation,
    /// Efficiencies; 0 for the orders left out.
    pub orders: Vec<OrderEfficiency>,
}

/// Table of diffraction orders. An order takes sixteen bytes (s, p, cumulative, alias bin) and a
/// node twelve; evanescent orders are not stored.
#[derive(Clone, Debug)]
pub struct OrderTable {
    header: TableHeader,
    grid: Grid,
    layout: Layout,
    /// Efficiencies for s, entry by entry: node after node, inner orders ascending, then outer
    /// ones.
    s: Vec<f32>,
    /// Efficiencies for p.
    p: Vec<f32>,
    /// Running sums of the unpolarised efficiencies within each node, in units of 1/[`FULL`].
    cumulative: Vec<u32>,
    /// The same as an alias table, for sampling.
    alias_table: AliasTable,
    /// Jones matrices of the orders, if known: 32 bytes an order.
    jones: Option<Vec<jones::Packed>>,
}

impl OrderTable {
    /// The table behind a BSDF, if it is one: tracers sample tables for many rays at a time.
    pub fn downcast(bsdf: &dyn Bsdf) -> Option<&Self> {
        (bsdf as &dyn Any).downcast_ref()
    }

    /// The table with the efficiencies of one polarisation for both; for unpolarised light, with
    /// the mean of s and p for both.
    ///
    /// # Errors
    /// None for a valid table.
    pub fn for_polarisation(&self, polarisation: Polarisation) -> Result<Self, Error> {
        let entries = 0..self.entry_count();
        let efficiencies: Vec<f32> = entries.map(|e| self.stored(e, polarisation) as f32).collect();
        Self::from_parts(self.header.clone(), self.grid.clone(), efficiencies.clone(), efficiencies)
    }

    /// Origin.
    pub fn header(&self) -> &TableHeader {
        &self.header
    }

    /// Incident wavevectors.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Number of nodes, both sides together.
    pub fn node_count(&self) -> usize {
        self.layout.nodes.len()
    }

    /// Number of stored orders, all nodes together.
    pub fn entry_count(&self) -> usize {
        self.s.len()
    }

    /// The stored efficiencies of a node, inner side first, orders ascending.
    ///
    /// # Errors
    /// If the grid has no such node.
    pub fn node_efficiencies(
        &self,
        node: NodeId,
        polarisation: Polarisation,
    ) -> Result<Vec<OrderEfficiency>, Error> {
        let index = self.layout.find(node).ok_or(Error::NoSuchNode { node: node.to_string() })?;
        let orders = self.layout.nodes[index].orders();
        Ok(orders
            .map(|(entry, to, order)| {
                OrderEfficiency::new(to, order, self.stored(entry, polarisation))
            })
            .collect())
    }

    /// The stored efficiency of relative order `order` leaving on side `to`; `None` if the grid has
    /// no such node or the order does not propagate there.
    pub(crate) fn node_efficiency(
        &self,
        node: NodeId,
        to: Side,
        order: i32,
        polarisation: Polarisation,
    ) -> Option<f64> {
        let entry = self.layout.nodes[self.layout.find(node)?].entry(to, order)?;
        Some(self.stored(entry, polarisation))
    }

    /// Efficiency of one entry; for unpolarised light the mean of s and p.
    fn stored(&self, entry: usize, polarisation: Polarisation) -> f64 {
        let (s, p) = (f64::from(self.s[entry]), f64::from(self.p[entry]));
        match polarisation {
            Polarisation::S => s,
            Polarisation::P => p,
            Polarisation::Unpolarised => 0.5 * (s + p),
        }
    }

    /// The arrays of a file: s, then p.
    pub(crate) fn arrays(&self) -> [&[f32]; 2] {
        [&self.s, &self.p]
    }

    /// Place of every node in the arrays.
    pub(crate) fn layout(&self) -> &Layout {
        &self.layout
    }
}

#[cfg(test)]
mod tests;
