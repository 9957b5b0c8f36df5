// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray optics in one period of a relief: the control without diffraction.
//!
//! In: the outline of one period as plain points and indices (x along t, z from the inner side
//! outward, 0 ≤ z ≤ depth, periodic in x, later polygons over earlier ones). Out: a [`Bsdf`] that
//! traces rays through the periodic cell. At each facet a ray reflects or refracts by Fresnel's
//! formulas, until it leaves. The relief does not vary along b, so ky is conserved, and a ray in a
//! medium of index n has the in-plane wavevector (kx, kz) with `kx² + kz² = n² - ky²`: the conical
//! mount is a planar one with shorter vectors. There is neither interference nor diffraction.
//! Polarised samples carry Stokes parameters from facet to facet; plain samples and lobes take the
//! light at each facet as unpolarised, so lobes for s or p are those for unpolarised light.

mod beams;
mod crossing;
mod outline;
mod ray;
mod relief;

pub use outline::{Outline, Polygon};
pub use relief::{Relief, ReliefCell, ReliefLattice, ReliefShape};

use crate::bsdf::{
    Bsdf, BsdfSample, Lobe, LobeKind, OutgoingLobe, Polarisation, PolarisedBsdf, Transport, s_axis,
};
use crate::direction::{Side, Wavevector};
use crate::error::Error;
use crate::stokes;
use crossing::Carried;
use glam::{DVec2, DVec3};
use outline::Facet;
use rand::RngExt;
use ray::{FacetInteraction, Ray, Step};
use std::sync::atomic::{AtomicU64, Ordering};

/// Power below which [`Bsdf::lobes`] no longer splits a beam, which then continues as one ray with
/// all its power.
const POWER_CUTOFF: f64 = 1e-5;

/// One period of a relief, traced by ray optics.
#[derive(Debug)]
pub struct UnitCell {
    period: f64,
    /// Heights at which rays enter and leave, slightly outside 0 and the depth.
    limits: [f64; 2],
    index: [f64; 2],
    facets: Vec<Facet>,
    /// Points that split a beam: ends of facets, and intersections of facets and limits with the
    /// border of the period.
    corners: Vec<DVec2>,
    /// Power of a beam that is given up; another one in tests alone.
    power_cutoff: f64,
    /// Cosine and sine of the angle from t to x, about the normal.
    turn: DVec2,
    lost: AtomicU64,
}

impl UnitCell {
    /// Unit cell of an outline.
    ///
    /// # Errors
    /// If a length or an index is not positive and finite, or a polygon has fewer than three
    /// points, points outside the cell's height, sides that intersect, or a width beyond two
    /// periods.
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
            turn: DVec2::X,
            lost: AtomicU64::new(0),
        })
    }

    /// The same cell with its x axis at `angle` (radians) from t towards b, in place of along t.
    #[must_use]
    pub fn turned(mut self, angle: f64) -> Self {
        self.turn = DVec2::from_angle(angle);
        self
    }

    /// Number of rays lost so far to rounding (in the wrong medium, or never leaving), expected to
    /// be 0. A lost sample is `None`.
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

    /// A direction of the cell in the frame of the surface.
    fn outgoing(&self, wo: DVec3) -> DVec3 {
        self.turn.rotate(wo.truncate()).extend(wo.z)
    }

    /// Side, tangential wavevector and kz of light from `wi`, in the frame of the cell.
    fn incoming(&self, wi: DVec3) -> (Side, Wavevector, f64) {
        let side = Side::from_direction(wi);
        let wi = self.in_cell(wi);
        let n = self.index(side);
        (side, Wavevector::incoming(wi, n), -n * wi.z)
    }

    /// A vector of the frame of the surface in that of the cell.
    fn in_cell(&self, v: DVec3) -> DVec3 {
        DVec2::new(self.turn.x, -self.turn.y).rotate(v.truncate()).extend(v.z)
    }

    /// Traces one ray that enters from `wi` anywhere, until it leaves; `reflects` draws at each
    /// facet from the ray that comes and what it meets. `None` of a ray that is lost.
    fn followed(
        &self,
        wi: DVec3,
        rng: &mut dyn rand::Rng,
        mut reflects: impl FnMut(&Ray, &FacetInteraction, &mut dyn rand::Rng) -> bool,
    ) -> Option<BsdfSample> {
        let (from, k, kz) = self.incoming(wi);
        if kz == 0.0 {
            return None;
        }
        let ray = self.enter(from, k, kz, self.period * rng.random::<f64>());
        let wo = self.traced(ray, |ray, hit| reflects(ray, hit, rng))?.direction();
        let lobe = facets_lobe(from, wo);
        Some(BsdfSample { wo: self.outgoing(wo), weight: 1.0, lobe })
    }

    /// Traces one ray until it leaves, one branch at each facet. `None` of a ray that is lost.
    fn traced(
        &self,
        mut ray: Ray,
        mut reflects: impl FnMut(&Ray, &FacetInteraction) -> bool,
    ) -> Option<Ray> {
        for _ in 0..ray::MAX_STEPS {
            match self.step(&ray) {
                Step::Hit { facet, t } => {
                    let hit = self.interact(&ray, facet, t);
                    ray = if reflects(&ray, &hit) { hit.reflected } else { hit.refracted };
                }
                Step::Wrap { t } => self.wrap(&mut ray, t),
                Step::Leave => return Some(ray),
                Step::Lost => break,
            }
        }
        self.lose();
        None
    }
}

/// Lobe of a ray that came from `from` and leaves along `wo`.
fn facets_lobe(from: Side, wo: DVec3) -> Lobe {
    Lobe { transport: Transport::between(from, Side::from_direction(wo)), kind: LobeKind::Facets }
}

impl Bsdf for UnitCell {
    fn sample(&self, wi: DVec3, rng: &mut dyn rand::Rng) -> Option<BsdfSample> {
        self.followed(wi, rng, |_, hit, rng| {
            hit.reflectance >= 1.0 || rng.random::<f64>() < hit.reflectance
        })
    }

    /// Unknown without tracing all rays.
    fn pdf(&self, _wi: DVec3, _sample: &BsdfSample) -> Option<f64> {
        None
    }

    /// All directions reached, by splitting the incident beam at the corners of the outline: exact
    /// in the entry position. For any polarisation the powers are those of unpolarised light.
    fn lobes(&self, wi: DVec3, _polarisation: Polarisation) -> Vec<OutgoingLobe> {
        let (from, k, kz) = self.incoming(wi);
        if kz == 0.0 {
            return Vec::new();
        }
        beams::lobes(self, self.enter(from, k, kz, 0.0))
            .into_iter()
            .map(|(wo, power)| OutgoingLobe {
                wo: self.outgoing(wo),
                power,
                lobe: facets_lobe(from, wo),
            })
            .collect()
    }

    fn index(&self, side: Side) -> f64 {
        self.index[side.index()]
    }

    /// Rays enter evenly, and go back as they came.
    fn is_reciprocal(&self) -> bool {
        true
    }

    fn as_polarised(&self) -> Option<&dyn PolarisedBsdf> {
        Some(self)
    }
}

impl PolarisedBsdf for UnitCell {
    fn sample_polarised(
        &self,
        wi: DVec3,
        light: [f64; 3],
        rng: &mut dyn rand::Rng,
    ) -> Option<(BsdfSample, [f64; 3])> {
        let mut carried = Carried { light, s: self.in_cell(s_axis(wi)) };
        let sample = self.followed(wi, rng, |ray, hit, rng| {
            let normal = DVec3::new(hit.normal.x, 0.0, hit.normal.y);
            carried.reflects(ray.direction(), normal, &hit.crossing, rng)
        })?;
        let Carried { light, s } = carried;
        let axis = self.in_cell(s_axis(sample.wo));
        Some((sample, stokes::turned(light, self.in_cell(sample.wo), s, axis)))
    }
}

#[cfg(test)]
mod tests;
