// SPDX-License-Identifier: MIT OR Apache-2.0
//! A scatterer with something left out or blurred on purpose: what simpler tables would have kept of it.
//!
//! In: any [`Bsdf`]. Out: another one, which sends every incident wave where the first sends
//!
//! - [`RemappedIncidence`]: another wave in its place, turned or mirrored about the normal, and the light that it makes turned or mirrored back: what tables know that were
//!   measured or computed for some incidences alone, or were laid on the wrong way round.
//! - [`Masked`]: only a part of it: what is transmitted, or what comes from the inner side; or all of it with what is reflected turned into the specular direction.
//!   Tables of transmission alone are common, and so are those solved from one side.
//! - [`Binned`]: it, but each direction moved to a random place in its cell of a grid of directions, as tables over angular bins do.
//!
//! All but the first two parts of [`Masked`] keep the power. They are for finding out what such a simplification costs; none is reciprocal, and none knows the probability of a direction.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;
use rand::RngExt;

use crate::angular_basis::AngularBasis;
use crate::bsdf::{Bsdf, BsdfSample, LobeKind, OutgoingLobe, Polarization, Transport};
use crate::direction::Side;

/// Below this tangential part of a direction there is no plane of incidence to speak of.
const NORMAL: f64 = 1e-12;

/// Which wave stands for another at the same angle to the normal and on the same side of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IncidenceMap {
    /// The one in the plane x-z with the same sign of x, turned into the plane of incidence: tables of one plane. A relief then spreads light in the plane of
    /// incidence, wherever its grooves lie.
    InPlane,
    /// Of waves from x > 0 themselves, of others their mirror images at x = 0: tables of one side, taken as symmetric.
    FromPositiveX,
    /// Of waves from x < 0 themselves, of others their mirror images.
    FromNegativeX,
    /// The wave after half a turn about the normal: tables laid on the wrong way round.
    HalfTurn,
    /// Waves from all azimuths with equal probability: tables of the polar angle alone.
    Azimuths,
}

/// Azimuths that stand for all.
const AZIMUTHS: usize = 72;

/// Scatters each wave as another one.
pub struct RemappedIncidence {
    /// What scatters.
    pub bsdf: Arc<dyn Bsdf>,
    /// What stands for what.
    pub by: IncidenceMap,
}

/// A rotation about the normal, after x → -x if it mirrors.
#[derive(Clone, Copy)]
struct Map {
    cos: f64,
    sin: f64,
    mirrors: bool,
}

impl Map {
    const NONE: Self = Self {
        cos: 1.0,
        sin: 0.0,
        mirrors: false,
    };

    const HALF_TURN: Self = Self {
        cos: -1.0,
        ..Self::NONE
    };

    const MIRROR: Self = Self {
        mirrors: true,
        ..Self::NONE
    };

    /// From the plane x-z to that of `wi`, at the same sign of x.
    fn from_plane(wi: DVec3) -> Self {
        let tangential = wi.x.hypot(wi.y).copysign(wi.x);
        if tangential.abs() < NORMAL {
            return Self::NONE;
        }
        Self {
            cos: wi.x / tangential,
            sin: wi.y / tangential,
            mirrors: false,
        }
    }

    fn mirrored(self, v: DVec3) -> DVec3 {
        if self.mirrors {
            DVec3::new(-v.x, v.y, v.z)
        } else {
            v
        }
    }

    /// From a direction to that of its substitute.
    fn back(self, v: DVec3) -> DVec3 {
        self.mirrored(DVec3::new(
            self.cos * v.x + self.sin * v.y,
            self.cos * v.y - self.sin * v.x,
            v.z,
        ))
    }

    /// From light of the substitute to light of the wave.
    fn forth(self, v: DVec3) -> DVec3 {
        let v = self.mirrored(v);
        DVec3::new(
            self.cos * v.x - self.sin * v.y,
            self.cos * v.y + self.sin * v.x,
            v.z,
        )
    }
}

impl RemappedIncidence {
    /// Number of waves that stand for one.
    fn count(&self) -> usize {
        match self.by {
            IncidenceMap::Azimuths => AZIMUTHS,
            _ => 1,
        }
    }

    /// The map to the wave of this number.
    fn map(&self, wi: DVec3, number: usize) -> Map {
        match self.by {
            IncidenceMap::InPlane => Map::from_plane(wi),
            IncidenceMap::FromPositiveX if wi.x < 0.0 => Map::MIRROR,
            IncidenceMap::FromNegativeX if wi.x > 0.0 => Map::MIRROR,
            IncidenceMap::FromPositiveX | IncidenceMap::FromNegativeX => Map::NONE,
            IncidenceMap::HalfTurn => Map::HALF_TURN,
            IncidenceMap::Azimuths => {
                let (sin, cos) = (TAU * (number as f64 + 0.5) / AZIMUTHS as f64).sin_cos();
                Map {
                    cos,
                    sin,
                    mirrors: false,
                }
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
        let map = self.map(wi, number);
        let mut sample = self.bsdf.sample(map.back(wi), rng)?;
        sample.wo = map.forth(sample.wo);
        Some(sample)
    }

    fn pdf(&self, _: DVec3, _: &BsdfSample) -> Option<f64> {
        None
    }

    fn lobes(&self, wi: DVec3, polarization: Polarization) -> Vec<OutgoingLobe> {
        let count = self.count();
        let of = |number| {
            let map = self.map(wi, number);
            let lobes = self.bsdf.lobes(map.back(wi), polarization);
            lobes.into_iter().map(move |mut lobe| {
                lobe.wo = map.forth(lobe.wo);
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

/// What is left of the light that a surface scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mask {
    /// What is transmitted; reflected light is absorbed.
    Transmission,
    /// Light from the inner side; what comes from the outer one is absorbed.
    FromInside,
    /// All of it, but everything reflected leaves in the specular direction.
    SpecularReflection,
}

/// Scatters a part of the light.
pub struct Masked {
    /// What the whole is scattered by.
    pub bsdf: Arc<dyn Bsdf>,
    /// The part that is kept.
    pub part: Mask,
}

impl Masked {
    /// Where light from `wi` that the whole sends to `wo` goes; `None` if it is absorbed.
    fn kept(&self, wi: DVec3, wo: DVec3, transport: Transport) -> Option<DVec3> {
        let reflected = transport == Transport::Reflection;
        match self.part {
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

/// Spreads every direction over its cell.
pub struct Binned {
    bsdf: Arc<dyn Bsdf>,
    cells: AngularBasis,
}

impl Binned {
    /// AngularBasis `width_deg` wide in polar angle and azimuth, from the normal on; `width_deg` divides 90.
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

    /// The cell of a direction on either side, and the direction with `place` in it.
    fn moved(&self, wo: DVec3, place: impl FnOnce(&AngularBasis, usize) -> DVec3) -> DVec3 {
        let upper = DVec3::new(wo.x, wo.y, wo.z.abs());
        self.cells.locate(upper).map_or(wo, |cell| {
            let moved = place(&self.cells, cell);
            DVec3::new(
                moved.x,
                moved.y,
                moved.z.max(f64::MIN_POSITIVE).copysign(wo.z),
            )
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
