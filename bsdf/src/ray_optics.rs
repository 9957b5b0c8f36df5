// SPDX-License-Identifier: MIT OR Apache-2.0
//! The same unit cell by ray optics: the control without diffraction.
//!
//! In: the outline of one period of a relief as plain points and indices (x along t, z from the inner side outward,
//! 0 ≤ z ≤ depth, wrapped at the period, a later polygon lying over an earlier one). Out: a [`Bsdf`] that follows rays through
//! the periodic cell facet by facet, each reflecting or refracting by Fresnel's formulas, until they leave. The relief does not
//! vary along b, so ky is kept and a ray in a medium of index n has the in-plane wavevector (kx, kz) with
//! `kx² + kz² = n² - ky²`: the conical mount is a planar one with shorter vectors. Neither interference nor diffraction;
//! each facet sees unpolarised light anew (the rotation of the polarisation from facet to facet is not followed), so that
//! lists of lobes for s or p are those for unpolarised light.

mod beams;
mod outline;
mod ray;

pub use outline::{Outline, Polygon};

use crate::bsdf::{Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarization, Transport};
use crate::direction::{Side, Wavevector};
use crate::error::Error;
use glam::DVec3;
use outline::Facet;
use rand::RngExt;
use ray::{Ray, Step};
use std::sync::atomic::{AtomicU64, Ordering};

/// Part of the incident power below which [`Bsdf::lobes`] no longer splits a beam, unless set otherwise.
const POWER_CUTOFF: f64 = 1e-5;

/// One period of a relief, traced by rays.
#[derive(Debug)]
pub struct UnitCell {
    period: f64,
    /// Heights at which rays enter and leave, a hair outside 0 and the depth.
    limits: [f64; 2],
    index: [f64; 2],
    facets: Vec<Facet>,
    /// Points that part a beam: ends of facets, and where facets and the limits meet the border of the period.
    corners: Vec<[f64; 2]>,
    power_cutoff: f64,
    lost: AtomicU64,
}

impl UnitCell {
    /// Cell of the given outline.
    ///
    /// # Errors
    /// If a length or an index is not positive and finite, or a polygon has fewer than three points, points outside
    /// the cell's height, sides that meet other than at the corner they share, or is wider than two periods.
    pub fn new(outline: &Outline) -> Result<Self, Error> {
        outline.validate()?;
        let hair = 1e-9 * (outline.period + outline.depth);
        let limits = [-hair, outline.depth + hair];
        let facets = outline.facets();
        Ok(Self {
            period: outline.period,
            limits,
            corners: beams::corners(&facets, outline.period, limits),
            index: [outline.index_inner, outline.index_outer],
            facets,
            power_cutoff: POWER_CUTOFF,
            lost: AtomicU64::new(0),
        })
    }

    /// The same cell, whose [`Bsdf::lobes`] split beams down to the given part of the incident power (default 1e-5). A weaker beam
    /// goes on as one ray, with all its power.
    #[must_use]
    pub fn with_power_cutoff(mut self, power_cutoff: f64) -> Self {
        self.power_cutoff = power_cutoff;
        self
    }

    /// Number of boundaries between different media in one period, split where outlines meet.
    #[must_use]
    pub fn facet_count(&self) -> usize {
        self.facets.len()
    }

    /// Number of rays lost so far to rounding (found in the wrong medium, or never leaving). Samples that are lost are
    /// `None`. Expected to stay 0.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Counts a lost ray.
    fn lose(&self) {
        self.lost.fetch_add(1, Ordering::Relaxed);
    }

    /// Ray that enters from `side` at `x`.
    fn enter(&self, side: Side, k: Wavevector, kz: f64, x: f64) -> Ray {
        Ray {
            x,
            z: self.limits[side.index()],
            kx: k.kx,
            kz,
            ky: k.ky,
            index: self.index(side),
            last: None,
        }
    }

    /// In-plane start of light from `wi`: side, tangential wavevector, kz.
    fn incoming(&self, wi: DVec3) -> (Side, Wavevector, f64) {
        let side = Side::of(wi);
        let n = self.index(side);
        (side, Wavevector::incoming(wi, n), -n * wi.z)
    }
}

/// Lobe of a ray that came from `from` and leaves along `wo`.
fn facets_lobe(from: Side, wo: DVec3) -> Lobe {
    Lobe {
        transport: Transport::between(from, Side::of(wo)),
        kind: LobeKind::Facets,
    }
}

impl Bsdf for UnitCell {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let (from, k, kz) = self.incoming(wi);
        if kz == 0.0 {
            return None;
        }
        let mut ray = self.enter(from, k, kz, self.period * rng.random::<f64>());
        for _ in 0..ray::MOST_STEPS {
            match self.step(&ray) {
                Step::Hit { facet, t } => {
                    let hit = self.interact(&ray, facet, t);
                    let reflect = hit.reflectance >= 1.0 || rng.random::<f64>() < hit.reflectance;
                    ray = if reflect {
                        hit.reflected
                    } else {
                        hit.refracted
                    };
                }
                Step::Wrap { t } => self.wrap(&mut ray, t),
                Step::Leave => {
                    let wo = ray.direction();
                    let lobe = facets_lobe(from, wo);
                    return Some(BsdfSample {
                        wo,
                        weight: 1.0,
                        lobe,
                    });
                }
                Step::Lost => break,
            }
        }
        self.lose();
        None
    }

    /// Not known without following all rays.
    fn pdf(&self, _wi: DVec3, _sample: &BsdfSample) -> Option<f64> {
        None
    }

    /// All directions reached, by splitting the incident beam wherever the outline does: exact in the entry position. For any
    /// polarisation the shares are those of unpolarised light.
    fn lobes(&self, wi: DVec3, _polarization: Polarization) -> Vec<OutgoingLobe> {
        let (from, k, kz) = self.incoming(wi);
        if kz == 0.0 {
            return Vec::new();
        }
        beams::lobes(self, self.enter(from, k, kz, 0.0))
            .into_iter()
            .map(|(wo, share)| OutgoingLobe {
                wo,
                power: share,
                lobe: facets_lobe(from, wo),
            })
            .collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.index[side.index()]
    }
}

#[cfg(test)]
mod tests;
