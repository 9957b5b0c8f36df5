// SPDX-License-Identifier: MIT OR Apache-2.0
//! Measured BSDFs: tables on cells of direction, from the files of other programs.
//!
//! In: for each side of incidence and transport, the power in cells of outgoing direction at nodes
//! of incidence. Out: a [`Bsdf`] whose energy is checked. Sampling takes a node by its
//! interpolation weight, a cell by its power, and a direction uniform in cos θ dΩ of the cell; its
//! expectation is the interpolated table. The rest to 1 is absorbed.
//!
//! A table does not state how lobes move between its nodes. [`LobeMotion::Fixed`] leaves them where
//! the node has them, as the formats define it. [`LobeMotion::Shifted`] moves them by the change of
//! the tangential wavevector of the incidence. That is exact for diffraction orders (the grating
//! equation), mirrors and interfaces, and it holds for the scatter of smooth surfaces [Harvey
//! 1976].
//!
//! \[Harvey 1976\] J. E. Harvey, *Light-scattering characteristics of optical surfaces*, Ph.D.
//! thesis, University of Arizona.

mod reciprocal;
mod scatter_table;

pub use scatter_table::{CellDistribution, IncidenceTotals, IncidentNode, ScatterTable};

use crate::bsdf::{
    Albedo, Bsdf, BsdfSample, GAIN_TOLERANCE, Lobe, LobeKind, OutgoingLobe, Polarisation, Transport,
};
use crate::direction::Side;
use crate::error::Error;
use glam::DVec3;
use rand::RngExt;

/// Motion of lobes between the nodes of incidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LobeMotion {
    /// Lobes stay where the node has them.
    #[default]
    Fixed,
    /// Lobes move with the tangential wavevector of the incident light.
    Shifted,
}

/// A BSDF given by tables, for light from either side.
#[derive(Clone, Debug)]
pub struct MeasuredBsdf {
    indices: [f64; 2],
    between: LobeMotion,
    /// By side of incidence and transport.
    tables: [[Option<ScatterTable>; 2]; 2],
    /// Side of incidence whose transmission follows from that of the other.
    derived: Option<Side>,
    largest_power: f64,
    largest_at_node: f64,
}

impl MeasuredBsdf {
    /// A BSDF between media of refractive index `indices` (inner, outer), from at most one table
    /// for each side of incidence and transport; those left out scatter nothing.
    ///
    /// # Errors
    /// If an index is invalid, a table is given twice, or the power of one incidence exceeds 1 by
    /// more than 0.1.
    pub fn new(
        indices: [f64; 2],
        between: LobeMotion,
        tables: impl IntoIterator<Item = (Side, Transport, ScatterTable)>,
    ) -> Result<Self, Error> {
        for (name, index) in ["the inner side", "the outer side"].into_iter().zip(indices) {
            Error::check_index(name, index)?;
        }
        let mut all = [[None, None], [None, None]];
        for (side, transport, table) in tables {
            let slot = &mut all[side.index()][transport.index()];
            if slot.replace(table).is_some() {
                return Err(Error::Measured(format!(
                    "expected one table for each side and type, got two for {} of light from the {side} side",
                    word(transport)
                )));
            }
        }
        let mut measured = Self {
            indices,
            between,
            tables: all,
            derived: None,
            largest_power: 0.0,
            largest_at_node: 0.0,
        };
        [measured.largest_power, measured.largest_at_node] = measured.check()?;
        Ok(measured)
    }

    /// The side of which no transmission is given, where it is given of the other.
    pub fn lacks_transmission(&self) -> Option<Side> {
        let given = |side: Side| self.table(side, Transport::Transmission).is_some();
        Side::BOTH.into_iter().find(|side| !given(*side) && given(side.opposite()))
    }

    /// The same surface, with the transmission of light from a side of which none was given by
    /// reciprocity from that of light from the other. Tables that put more light into a direction
    /// than can come back from it are scaled down there.
    #[must_use]
    pub fn reciprocal(mut self) -> Self {
        let Some(side) = self.lacks_transmission() else { return self };
        let [this, other] = [side, side.opposite()].map(|side| self.index(side));
        let given = self.table(side.opposite(), Transport::Transmission);
        let Some(mut table) = given.map(|t| reciprocal::reversed(t, (other / this).powi(2))) else {
            return self;
        };
        table.limit(|wi| (1.0 - self.total(side, Transport::Reflection, wi)).max(0.0));
        let slot = side.index();
        self.tables[slot][Transport::Transmission.index()] = Some(table);
        if let Ok([largest_power, largest_at_node]) = self.check() {
            return Self { derived: Some(side), largest_power, largest_at_node, ..self };
        }
        self.tables[slot][Transport::Transmission.index()] = None;
        self
    }

    /// The largest power at any incidence of the tables, and the largest that they state
    /// themselves.
    fn check(&self) -> Result<[f64; 2], Error> {
        let [mut worst, mut worst_stated] = [0.0_f64; 2];
        for side in Side::BOTH {
            for transport in Transport::BOTH {
                let Some(table) = self.table(side, transport) else {
                    continue;
                };
                for wi in table.incidences() {
                    let total: f64 = Transport::BOTH.iter().map(|t| self.total(side, *t, wi)).sum();
                    // Interpolation may exceed 1 a little between the nodes; at its nodes no file
                    // may.
                    let stated: f64 = Transport::BOTH
                        .iter()
                        .filter(|t| self.table(side, **t).is_some_and(|r| r.has_node(wi)))
                        .map(|t| self.total(side, *t, wi))
                        .sum();
                    if total.is_nan() || stated > 1.0 + GAIN_TOLERANCE {
                        let theta = wi.z.clamp(-1.0, 1.0).acos().to_degrees();
                        let phi = wi.y.atan2(wi.x).to_degrees();
                        return Err(Error::Measured(format!(
                            "light from the {side} side at {theta:.2} degrees, azimuth {phi:.2}: expected powers that sum to at most 1, got {stated:.6}"
                        )));
                    }
                    worst = worst.max(total);
                    worst_stated = worst_stated.max(stated);
                }
            }
        }
        Ok([worst, worst_stated])
    }

    /// The side whose transmission [`MeasuredBsdf::reciprocal`] added.
    pub fn derived(&self) -> Option<Side> {
        self.derived
    }

    /// The largest power at any incidence of the tables. It exceeds 1 where two tables with
    /// different incidences are interpolated; sampling scales it down to 1.
    pub fn largest_power(&self) -> f64 {
        self.largest_power
    }

    /// The largest power that the tables state for an incidence: above 1 by an error of
    /// measurement.
    pub fn largest_at_node(&self) -> f64 {
        self.largest_at_node
    }

    /// Smallest and largest factor that brought the integrals of a file's values to the powers it
    /// states; `None` where it states none.
    pub fn factors(&self) -> Option<[f64; 2]> {
        let all = self.tables().filter_map(|(_, _, r)| r.factors());
        all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The table for light from `side`.
    pub fn table(&self, side: Side, transport: Transport) -> Option<&ScatterTable> {
        self.tables[side.index()][transport.index()].as_ref()
    }

    /// All tables.
    pub fn tables(&self) -> impl Iterator<Item = (Side, Transport, &ScatterTable)> {
        Side::BOTH.into_iter().flat_map(move |side| {
            Transport::BOTH.into_iter().filter_map(move |t| Some((side, t, self.table(side, t)?)))
        })
    }

    fn total(&self, side: Side, transport: Transport, wi: DVec3) -> f64 {
        self.table(side, transport).map_or(0.0, |r| r.total(wi))
    }

    /// Reflected and transmitted power of light from the upper-hemisphere direction `wi`, at most 1
    /// together.
    fn powers(&self, side: Side, wi: DVec3) -> [f64; 2] {
        let raw = Transport::BOTH.map(|t| self.total(side, t, wi));
        let sum = raw[0] + raw[1];
        if sum > 1.0 { raw.map(|r| r / sum) } else { raw }
    }

    /// The outgoing direction for light from `wi`, of a direction `wo` at a node; all in the upper
    /// hemisphere.
    fn moved(&self, from: Side, to: Side, wi: DVec3, node: DVec3, wo: DVec3) -> DVec3 {
        if self.between == LobeMotion::Fixed {
            return wo;
        }
        let ratio = self.indices[from.index()] / self.indices[to.index()];
        let x = wo.x + ratio * (node.x - wi.x);
        let y = wo.y + ratio * (node.y - wi.y);
        let z2 = 1.0 - x * x - y * y;
        // A lobe that would become evanescent stays where it was.
        if z2 > 0.0 { DVec3::new(x, y, z2.sqrt()) } else { wo }
    }
}

/// The word for a transport in messages.
fn word(transport: Transport) -> &'static str {
    match transport {
        Transport::Reflection => "reflection",
        Transport::Transmission => "transmission",
    }
}

/// Mirrored into the upper hemisphere.
fn upper(direction: DVec3) -> DVec3 {
    DVec3::new(direction.x, direction.y, direction.z.abs())
}

impl Bsdf for MeasuredBsdf {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let from = Side::from_direction(wi);
        let wi = upper(wi);
        let [reflected, transmitted] = self.powers(from, wi);
        let u = rng.random::<f64>();
        let transport = if u < reflected {
            Transport::Reflection
        } else if u < reflected + transmitted {
            Transport::Transmission
        } else {
            return None;
        };
        let (node, wo) = self.table(from, transport)?.sample(wi, rng)?;
        let to = transport.exit_side(from);
        let wo = self.moved(from, to, wi, node, wo);
        Some(BsdfSample {
            wo: DVec3::new(wo.x, wo.y, to.sign() * wo.z.max(1e-12)).normalize(),
            weight: 1.0,
            lobe: Lobe { transport, kind: LobeKind::Cell },
        })
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        if self.between == LobeMotion::Shifted {
            return None;
        }
        let from = Side::from_direction(wi);
        let transport = sample.lobe.transport;
        let Some(table) = self.table(from, transport) else {
            return Some(0.0);
        };
        let wi = upper(wi);
        let raw: f64 = Transport::BOTH.iter().map(|t| self.total(from, *t, wi)).sum();
        Some(table.density(wi, upper(sample.wo)) / raw.max(1.0))
    }

    fn lobes(&self, wi: DVec3, _: Polarisation) -> Vec<OutgoingLobe> {
        let from = Side::from_direction(wi);
        let wi = upper(wi);
        let raw: f64 = Transport::BOTH.iter().map(|t| self.total(from, *t, wi)).sum();
        let scale = 1.0 / raw.max(1.0);
        let mut lobes = Vec::new();
        for transport in Transport::BOTH {
            let Some(table) = self.table(from, transport) else {
                continue;
            };
            let to = transport.exit_side(from);
            let lobe = Lobe { transport, kind: LobeKind::Cell };
            table.visit_cells(wi, &mut |node, centre, power| {
                let wo = self.moved(from, to, wi, node, centre);
                lobes.push(OutgoingLobe {
                    wo: DVec3::new(wo.x, wo.y, to.sign() * wo.z),
                    power: power * scale,
                    lobe,
                });
            });
        }
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.indices[side.index()]
    }

    fn albedo(&self, wi: DVec3, _: Polarisation) -> Albedo {
        let [reflected, transmitted] = self.powers(Side::from_direction(wi), upper(wi));
        Albedo { reflected, transmitted }
    }
}

#[cfg(test)]
mod tests;
