// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ablation of BSDFs: another BSDF with something left out or blurred on purpose.
//!
//! The types show what simpler tables would keep of a BSDF, and what such a simplification costs:
//!
//! - [`RemappedIncidence`] scatters another incident wave, rotated or mirrored about the normal,
//!   and maps its light back. It stands for tables known at some incidences alone, or applied the
//!   wrong way round.
//! - [`Masked`] keeps transmitted light, or light from the inner side, or replaces reflected light
//!   by a specular reflection. Tables of transmission alone are common, and so are those solved
//!   from one side.
//! - [`Binned`] moves each direction to a random place in its cell of an angular basis.
//!
//! Power is conserved, except by the first two masks. None of the results is reciprocal, and none
//! knows its pdf.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;
use rand::RngExt;

use crate::angular_basis::AngularBasis;
use crate::bsdf::{Bsdf, BsdfSample, LobeKind, OutgoingLobe, Polarization, Transport};
use crate::direction::Side;

/// Smallest tangential part of a direction that defines a plane of incidence.
const NORMAL: f64 = 1e-12;

/// Substitute for an incident wave, at the same polar angle and on the same side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IncidenceMap {
    /// The wave in the plane x-z with the same sign of x, rotated into the plane of incidence:
    /// tables of one plane. A relief then scatters in the plane of incidence, whatever the
    /// direction of its grooves.
    InPlane,
    /// Waves from x > 0 themselves, others mirrored at x = 0: tables of one side, taken as
    /// symmetric.
    FromPositiveX,
    /// Waves from x < 0 themselves, others mirrored at x = 0.
    FromNegativeX,
    /// The wave after half a turn about the normal: tables applied the wrong way round.
    HalfTurn,
    /// The mean over all azimuths: tables of the polar angle alone.
    AzimuthMean,
}

/// Azimuths in the mean over all.
const AZIMUTHS: usize = 72;

/// Scatters each incident wave as a substitute for it.
pub struct RemappedIncidence {
    /// The complete BSDF.
    pub bsdf: Arc<dyn Bsdf>,
    /// The substitute for each wave.
    pub map: IncidenceMap,
}

/// A rotation about the normal, after x → -x if it mirrors.
#[derive(Clone, Copy)]
struct Transform {
    cos: f64,
    sin: f64,
    mirrors: bool,
}

impl Transform {
    const NONE: Self = Self { cos: 1.0, sin: 0.0, mirrors: false };

    const HALF_TURN: Self = Self { cos: -1.0, ..Self::NONE };

    const MIRROR: Self = Self { mirrors: true, ..Self::NONE };

    /// From the plane x-z to that of `wi`, at the same sign of x.
    fn from_plane(wi: DVec3) -> Self {
        let tangential = wi.x.hypot(wi.y).copysign(wi.x);
        if tangential.abs() < NORMAL {
            return Self::NONE;
        }
        Self { cos: wi.x / tangential, sin: wi.y / tangential, mirrors: false }
    }

    fn mirrored(self, v: DVec3) -> DVec3 {
        if self.mirrors { DVec3::new(-v.x, v.y, v.z) } else { v }
    }

    /// From a direction to that of its substitute.
    fn inverse(self, v: DVec3) -> DVec3 {
        self.mirrored(DVec3::new(
            self.cos * v.x + self.sin * v.y,
            self.cos * v.y - self.sin * v.x,
            v.z,
        ))
    }

    /// From light of the substitute to light of the wave.
    fn apply(self, v: DVec3) -> DVec3 {
        let v = self.mirrored(v);
        DVec3::new(self.cos * v.x - self.sin * v.y, self.cos * v.y + self.sin * v.x, v.z)
    }
}

impl RemappedIncidence {
    /// Number of waves that stand for one.
    fn count(&self) -> usize {
        match self.map {
            IncidenceMap::AzimuthMean => AZIMUTHS,
            _ => 1,
        }
    }

    /// The map to the wave of this number.
    fn transform(&self, wi: DVec3, number: usize) -> Transform {
        match self.map {
            IncidenceMap::InPlane => Transform::from_plane(wi),
            IncidenceMap::FromPositiveX if wi.x < 0.0 => Transform::MIRROR,
            IncidenceMap::FromNegativeX if wi.x > 0.0 => Transform::MIRROR,
            IncidenceMap::FromPositiveX | IncidenceMap::FromNegativeX => Transform::NONE,
            IncidenceMap::HalfTurn => Transform::HALF_TURN,
            IncidenceMap::AzimuthMean => {
                let (sin, cos) = (TAU * (number as f64 + 0.5) / AZIMUTHS as f64).sin_cos();
                Transform { cos, sin, mirrors: false }
            }
        }
    }
}

impl Bsdf for RemappedIncidence {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let number = match self.count() {
            1 => 0,
            count => rng.random_range(0..count),
        };
        let transform = self.transform(wi, number);
        let mut sample = self.bsdf.sample(transform.inverse(wi), rng)?;
        sample.wo = transform.apply(sample.wo);
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &BsdfSample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let count = self.count();
        let of = |number| {
            let transform = self.transform(wi, number);
            let lobes = self.bsdf.lobes(transform.inverse(wi), polarization);
            lobes.into_iter().map(move |mut lobe| {
                lobe.wo = transform.apply(lobe.wo);
                lobe.power /= count as f64;
                lobe
            })
        };
        (0..count).flat_map(of).collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.bsdf.index(side)
    }
}

/// The light that is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mask {
    /// Transmitted light; reflected light is absorbed.
    Transmission,
    /// Light from the inner side; light from the outer side is absorbed.
    FromInside,
    /// All light; reflected light leaves in the specular direction.
    SpecularReflection,
}

/// Keeps a part of the scattered light and absorbs the rest.
pub struct Masked {
    /// The complete BSDF.
    pub bsdf: Arc<dyn Bsdf>,
    /// The light that is kept.
    pub mask: Mask,
}

impl Masked {
    /// Outgoing direction of light from `wi` that the complete BSDF scatters to `wo`; `None` if it
    /// is absorbed.
    fn kept(&self, wi: DVec3, wo: DVec3, transport: Transport) -> Option<DVec3> {
        let reflected = transport == Transport::Reflection;
        match self.mask {
            Mask::Transmission => (!reflected).then_some(wo),
            Mask::FromInside => (Side::of(wi) == Side::Inner).then_some(wo),
            Mask::SpecularReflection if reflected => Some(DVec3::new(-wi.x, -wi.y, wi.z)),
            Mask::SpecularReflection => Some(wo),
        }
    }
}

impl Bsdf for Masked {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let mut sample = self.bsdf.sample(wi, rng)?;
        sample.wo = self.kept(wi, sample.wo, sample.lobe.transport)?;
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &BsdfSample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let mut lobes = self.bsdf.lobes(wi, polarization);
        lobes.retain_mut(|lobe| {
            let kept = self.kept(wi, lobe.wo, lobe.lobe.transport);
            lobe.wo = kept.unwrap_or(lobe.wo);
            kept.is_some()
        });
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.bsdf.index(side)
    }
}

/// Spreads every direction over its cell of an angular basis.
pub struct Binned {
    bsdf: Arc<dyn Bsdf>,
    cells: AngularBasis,
}

impl Binned {
    /// AngularBasis `width_deg` wide in polar angle and azimuth, from the normal on; `width_deg`
    /// divides 90.
    #[must_use]
    pub fn new(bsdf: Arc<dyn Bsdf>, width_deg: f64) -> Self {
        let every = |from: f64, to: f64| -> Vec<f64> {
            let count = ((to - from) / width_deg).round().max(1.0) as usize;
            (0..count).map(|k| from + width_deg * k as f64).collect()
        };
        let half = 0.5 * width_deg;
        Self {
            bsdf,
            cells: AngularBasis::around_points(&every(0.0, 360.0), &every(half, 90.0 + half), 90.0),
        }
    }

    /// The direction `place` gives in the cell of `wo`, on the side of `wo`.
    fn moved(&self, wo: DVec3, place: impl FnOnce(&AngularBasis, usize) -> DVec3) -> DVec3 {
        let upper = DVec3::new(wo.x, wo.y, wo.z.abs());
        self.cells.locate(upper).map_or(wo, |cell| {
            let moved = place(&self.cells, cell);
            DVec3::new(moved.x, moved.y, moved.z.max(f64::MIN_POSITIVE).copysign(wo.z))
        })
    }
}

impl Bsdf for Binned {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        let mut sample = self.bsdf.sample(wi, rng)?;
        let (u, v) = (rng.random(), rng.random());
        sample.wo = self.moved(sample.wo, |cells, cell| cells.sample_projected(cell, u, v));
        if sample.lobe.kind.is_discrete() {
            sample.lobe.kind = LobeKind::Cell;
        }
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &BsdfSample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let mut lobes = self.bsdf.lobes(wi, polarization);
        for lobe in lobes.iter_mut().filter(|l| l.lobe.kind.is_discrete()) {
            lobe.wo = self.moved(lobe.wo, AngularBasis::centre);
            lobe.lobe.kind = LobeKind::Cell;
        }
        lobes
    }

    fn index(&self, side: Side) -> f64 {
        self.bsdf.index(side)
    }
}

#[cfg(test)]
mod tests;
