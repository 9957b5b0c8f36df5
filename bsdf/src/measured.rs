// SPDX-License-Identifier: MIT OR Apache-2.0
//! A measured or bought BSDF as a [`Bsdf`]: tables on direction cells, from the files of other programs.
//!
//! In: for light from each side, reflected and transmitted, the shares of power in cells of outgoing direction at nodes of incidence. Out:
//! something that can be sampled, its energy checked. A node is drawn by its weight in the interpolation over the incidence, a
//! cell by its share, a direction uniformly in cos θ dΩ of the cell; so the mean over draws is the interpolated table. What the shares leave to 1
//! is absorbed.
//!
//! Between nodes a table says nothing about how its lobes move. [`LobeMotion::Fixed`] leaves them where the node has them, as
//! the formats define it. [`LobeMotion::Shifted`] moves them by what the incidence moved in tangential wavevector: exact for every
//! diffraction order (the grating equation) and for mirrors and interfaces, and how scatter of smooth surfaces behaves
//! [Harvey 1976].
//!
//! \[Harvey 1976\] J. E. Harvey, *Light-scattering characteristics of optical surfaces*, Ph.D. thesis, University of Arizona.

mod scatter_table;

pub use scatter_table::{
    CellDistribution, IncidenceTotals, IncidentNode, PolarFrame, ScatterTable,
};

use crate::bsdf::{
    Albedo, Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarization, Transport,
};
use crate::direction::Side;
use crate::error::Error;
use glam::DVec3;
use rand::RngExt;

/// By how much the shares of one incidence may exceed 1 in sum; what does is scaled down to 1.
pub const GAIN_TOLERANCE: f64 = 1e-2;

/// How lobes move between the nodes of incidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LobeMotion {
    /// Not at all.
    #[default]
    Fixed,
    /// With the tangential wavevector of the incident light.
    Shifted,
}

/// A BSDF by tables, for light from either side.
#[derive(Clone, Debug)]
pub struct MeasuredBsdf {
    indices: [f64; 2],
    between: LobeMotion,
    /// By side of incidence, then reflected and transmitted.
    responses: [[Option<ScatterTable>; 2]; 2],
    worst_sum: f64,
}

/// Position of a transport in arrays.
const fn place(transport: Transport) -> usize {
    match transport {
        Transport::Reflection => 0,
        Transport::Transmission => 1,
    }
}

/// What leaves on its own side, then what passes.
const TRANSPORTS: [Transport; 2] = [Transport::Reflection, Transport::Transmission];

impl MeasuredBsdf {
    /// A BSDF between media of refractive index `indices` (inner, outer), from one response for each side of incidence and
    /// transport; those left out scatter nothing.
    ///
    /// # Errors
    /// If an index is none, a response is given twice, or the shares of one incidence exceed 1 by more than [`GAIN_TOLERANCE`].
    pub fn new(
        indices: [f64; 2],
        between: LobeMotion,
        responses: impl IntoIterator<Item = (Side, Transport, ScatterTable)>,
    ) -> Result<Self, Error> {
        for (name, index) in ["the inner side", "the outer side"]
            .into_iter()
            .zip(indices)
        {
            Error::check_index(name, index)?;
        }
        let mut all = [[None, None], [None, None]];
        for (side, transport, response) in responses {
            let slot = &mut all[side.index()][place(transport)];
            if slot.replace(response).is_some() {
                return Err(Error::Measured(format!(
                    "expected one table for each side and type, got two for {} of light from the {side} side",
                    word(transport)
                )));
            }
        }
        let mut measured = Self {
            indices,
            between,
            responses: all,
            worst_sum: 0.0,
        };
        measured.worst_sum = measured.check()?;
        Ok(measured)
    }

    /// The largest sum of shares at any node.
    fn check(&self) -> Result<f64, Error> {
        let mut worst = 0.0_f64;
        for side in Side::BOTH {
            for transport in TRANSPORTS {
                let Some(response) = self.response(side, transport) else {
                    continue;
                };
                for wi in response.incidences() {
                    let total: f64 = TRANSPORTS.iter().map(|t| self.total(side, *t, wi)).sum();
                    // Between nodes an interpolated table may promise a little more than there is; at its nodes no file may.
                    let stated: f64 = TRANSPORTS
                        .iter()
                        .filter(|t| self.response(side, **t).is_some_and(|r| r.knows(wi)))
                        .map(|t| self.total(side, *t, wi))
                        .sum();
                    if total.is_nan() || stated > 1.0 + GAIN_TOLERANCE {
                        let theta = wi.z.clamp(-1.0, 1.0).acos().to_degrees();
                        let phi = wi.y.atan2(wi.x).to_degrees();
                        return Err(Error::Measured(format!(
                            "light from the {side} side at {theta:.2} degrees, azimuth {phi:.2}: expected shares that sum to at most 1, got {stated:.6}"
                        )));
                    }
                    worst = worst.max(total);
                }
            }
        }
        Ok(worst)
    }

    /// The largest sum of shares at any incidence of the table. Above 1 where two tables on different incidences are interpolated; draws
    /// take no more than 1.
    #[must_use]
    pub fn largest_sum(&self) -> f64 {
        self.worst_sum
    }

    /// Smallest and largest factor on the values of a file that brought their integrals to the powers that it states; `None` where it states none.
    #[must_use]
    pub fn factors(&self) -> Option<[f64; 2]> {
        let all = self.responses().filter_map(|(_, _, r)| r.factors());
        all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The table for light from `side`.
    #[must_use]
    pub fn response(&self, side: Side, transport: Transport) -> Option<&ScatterTable> {
        self.responses[side.index()][place(transport)].as_ref()
    }

    /// All tables.
    pub fn responses(&self) -> impl Iterator<Item = (Side, Transport, &ScatterTable)> {
        Side::BOTH.into_iter().flat_map(move |side| {
            TRANSPORTS
                .into_iter()
                .filter_map(move |t| Some((side, t, self.response(side, t)?)))
        })
    }

    fn total(&self, side: Side, transport: Transport, wi: DVec3) -> f64 {
        self.response(side, transport).map_or(0.0, |r| r.total(wi))
    }

    /// Shares reflected and transmitted of light from the upper-hemisphere direction `wi`, at most 1 together.
    fn shares(&self, side: Side, wi: DVec3) -> [f64; 2] {
        let raw = TRANSPORTS.map(|t| self.total(side, t, wi));
        let sum = raw[0] + raw[1];
        if sum > 1.0 { raw.map(|r| r / sum) } else { raw }
    }

    /// A direction of a node as it leaves for light from `wi`, both in the upper hemisphere.
    fn moved(&self, from: Side, to: Side, wi: DVec3, node: DVec3, wo: DVec3) -> DVec3 {
        if self.between == LobeMotion::Fixed {
            return wo;
        }
        let ratio = self.indices[from.index()] / self.indices[to.index()];
        let x = wo.x + ratio * (node.x - wi.x);
        let y = wo.y + ratio * (node.y - wi.y);
        let z2 = 1.0 - x * x - y * y;
        // A lobe that would not propagate stays where it was.
        if z2 > 0.0 {
            DVec3::new(x, y, z2.sqrt())
        } else {
            wo
        }
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

/// Side on which light from `from` leaves.
fn leaves(from: Side, transport: Transport) -> Side {
    match transport {
        Transport::Reflection => from,
        Transport::Transmission => from.opposite(),
    }
}

impl Bsdf for MeasuredBsdf {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let from = Side::of(wi);
        let wi = upper(wi);
        let shares = self.shares(from, wi);
        let u = rng.random::<f64>();
        let transport = if u < shares[0] {
            Transport::Reflection
        } else if u < shares[0] + shares[1] {
            Transport::Transmission
        } else {
            return None;
        };
        let (node, wo) = self.response(from, transport)?.draw(wi, rng)?;
        let to = leaves(from, transport);
        let wo = self.moved(from, to, wi, node, wo);
        Some(BsdfSample {
            wo: DVec3::new(wo.x, wo.y, to.sign() * wo.z.max(1e-12)).normalize(),
            weight: 1.0,
            lobe: Lobe {
                transport,
                kind: LobeKind::Cell,
            },
        })
    }

    fn pdf(&self, wi: DVec3, sample: &BsdfSample) -> Option<f64> {
        if self.between == LobeMotion::Shifted {
            return None;
        }
        let from = Side::of(wi);
        let transport = sample.lobe.transport;
        let Some(response) = self.response(from, transport) else {
            return Some(0.0);
        };
        let wi = upper(wi);
        let raw: f64 = TRANSPORTS.iter().map(|t| self.total(from, *t, wi)).sum();
        Some(response.density(wi, upper(sample.wo)) / raw.max(1.0))
    }

    fn lobes(&self, wi: DVec3, _: Polarization) -> Vec<OutgoingLobe> {
        let from = Side::of(wi);
        let wi = upper(wi);
        let raw: f64 = TRANSPORTS.iter().map(|t| self.total(from, *t, wi)).sum();
        let scale = 1.0 / raw.max(1.0);
        let mut lobes = Vec::new();
        for transport in TRANSPORTS {
            let Some(response) = self.response(from, transport) else {
                continue;
            };
            let to = leaves(from, transport);
            let lobe = Lobe {
                transport,
                kind: LobeKind::Cell,
            };
            response.visit(wi, &mut |node, middle, share| {
                let wo = self.moved(from, to, wi, node, middle);
                lobes.push(OutgoingLobe {
                    wo: DVec3::new(wo.x, wo.y, to.sign() * wo.z),
                    power: share * scale,
                    lobe,
                });
            });
        }
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.indices[side.index()]
    }

    fn albedo(&self, wi: DVec3, _: Polarization) -> Albedo {
        let [reflected, transmitted] = self.shares(Side::of(wi), upper(wi));
        Albedo {
            reflected,
            transmitted,
        }
    }
}

#[cfg(test)]
mod tests;
